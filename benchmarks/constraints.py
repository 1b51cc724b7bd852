"""The constraint module measured: against a dense formulation of the paper's program, in growth, and by solver.

    python benchmarks/constraints.py             all tables (a few minutes)
    python benchmarks/constraints.py --quick     fewer repetitions
    python benchmarks/constraints.py --stress    also 2,000 generated problems and 2,000 instructions, each checked

The dense formulation is ours, after the paper's equations: 4 N unknowns, full matrices, CVXOPT, weights by 50 Optuna
trials that minimise deviation. CVXOPT, Optuna, OSQP and Clarabel are needed for their columns only; a column whose
package is missing is left out. Both sides of a comparison are measured in turn, in one process, by the CPU time of
the calling thread, so that what else runs on the machine matters less.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import runpy
import time
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ovita.limits import ConstraintOptions, Solution, constrain
from ovita.limits import paper as published
from ovita.limits.qp import Weights, solve_qp
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory

SINGLE = ConstraintOptions(lambda_smooth=0.01, lambda_shape=0.0, obstacle_shape="sphere")
FIRST = replace(SINGLE, steps=1)
TUNED = ConstraintOptions(lambda_smooth="auto", obstacle_shape="sphere")


def cases(n: int) -> dict[str, tuple[Trajectory, Scene, Robot]]:
    """A path that is clear, one that leaves a shell, and one that hits an obstacle, each with n waypoints."""
    s = np.linspace(0.0, 1.0, n)
    wave = np.column_stack([2.0 * s - 1.0, 0.4 * np.sin(9.0 * s), 0.3 * np.cos(6.0 * s)])
    arc = np.column_stack([np.cos(2.0 * s), np.sin(2.0 * s), 0.4 + 0.2 * s]) * 1.15
    speed = 0.5 + 0.4 * np.sin(20.0 * s)
    cup = SceneObject("cup", wave[n // 2] + [0.0, 0.02, 0.03], [0.2, 0.2, 0.25])
    far = SceneObject("cup", [0.0, 2.0, 1.0], [0.2, 0.2, 0.25])
    drone, arm = Robot.preset("drone"), Robot.preset("arm")
    return {
        "clear": (Trajectory(wave, speed), Scene((far,)), drone),
        "shell": (Trajectory(arc + np.array([-0.5, 0.0, 0.6]), speed), Scene((far,)), arm),
        "obstacle": (Trajectory(wave, speed), Scene((cup,)), drone),
    }


def ours(case: tuple[Trajectory, Scene, Robot], options: ConstraintOptions) -> Solution:
    trajectory, scene, robot = case
    original = trajectory.with_(positions=trajectory.positions + 1e-3)
    return constrain(trajectory, scene, robot, original=original, options=options)


def dense_qp(case: tuple[Trajectory, Scene, Robot], dev: float, smooth: float) -> Array | None:
    """The paper's program with full matrices, solved by CVXOPT; None if it has no solution."""
    cvxopt = importlib.import_module("cvxopt")
    cvxopt.solvers.options["show_progress"] = False
    trajectory, scene, robot = case
    reference = trajectory.to_array()
    n = len(reference)
    d1 = np.kron(np.eye(n - 1, n, 1) - np.eye(n - 1, n), np.eye(4))
    hessian = 2.0 * (dev * np.eye(4 * n) + smooth * d1.T @ d1)
    rows = published.linearise(reference[:, :3], scene, robot, (), ConstraintOptions())
    g = np.zeros((len(rows), 4 * n))
    for k in range(4):
        g[np.arange(len(rows)), rows.waypoints * 4 + k] = -rows.normals[:, k]
    lower, upper = published._bounds(reference, robot, ConstraintOptions())
    eye = np.eye(4 * n)
    low, high = np.isfinite(lower.ravel()), np.isfinite(upper.ravel())
    full = np.vstack([g, -eye[low], eye[high]])
    right = np.concatenate([-rows.offsets, -lower.ravel()[low], upper.ravel()[high]])
    matrix = cvxopt.matrix
    try:
        found = cvxopt.solvers.qp(matrix(hessian), matrix(-2.0 * dev * reference.ravel()), matrix(full), matrix(right))
    except (ValueError, ArithmeticError):
        return None
    return np.array(found["x"]).reshape(n, 4) if found["status"] == "optimal" else None


def dense_module(case: tuple[Trajectory, Scene, Robot], trials: int = 50) -> Array | None:
    """The whole published module: 50 trials of the dense program for the smallest deviation."""
    optuna = importlib.import_module("optuna")
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    reference = case[0].to_array()

    def deviation(trial: Any) -> float:
        x = dense_qp(case, *(trial.suggest_float(name, 1e-3, 1e1, log=True) for name in ("dev", "smooth")))
        return float("inf") if x is None else float(((x - reference) ** 2).sum())

    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=0))
    study.optimize(deviation, n_trials=trials)
    return dense_qp(case, study.best_params["dev"], study.best_params["smooth"])


def milliseconds(*calls: Callable[[], object], repeat: int, burst: int = 3) -> list[float]:
    """Median time of each call; the calls take turns, a turn is a few calls in a row."""
    for call in calls:
        call()
    times: list[list[float]] = [[] for _ in calls]
    for _ in range(max(repeat // burst, 1)):
        for k, call in enumerate(calls):
            for _ in range(min(burst, repeat)):
                began = time.thread_time()
                call()
                times[k].append((time.thread_time() - began) * 1e3)
    return [float(np.median(t)) for t in times]


def side_by_side(repeat: int) -> None:
    """One solve, and the whole module, at T = 100."""
    if not available("cvxopt"):
        print("\nCVXOPT is not installed: no comparison with the dense program")
        return
    print("\nOne solve at T = 100 (medians, ms): ours after one linearisation, already legal, and to convergence")
    table("case", "dense CVXOPT", "ours, first", "ratio", "ours", "ratio", "violation ours", "violation dense")
    for name, case in cases(100).items():
        slow, first, last = milliseconds(
            lambda c=case: dense_qp(c, 1.0, 0.01),
            lambda c=case: ours(c, FIRST),
            lambda c=case: ours(c, SINGLE),
            repeat=repeat,
        )
        mine = max(worst(ours(case, options)) for options in (FIRST, SINGLE))
        table(name, slow, first, slow / first, last, slow / last, mine, worst(ours_of(case, dense_qp(case, 1.0, 0.01))))
    if not available("optuna"):
        return
    print("\nWhole module at T = 100, weights searched with 50 trials (medians, ms)")
    table("case", "dense + Optuna", "ours", "ratio", "status")
    few = max(repeat // 10, 1)
    for name, case in cases(100).items():
        fast = milliseconds(lambda c=case: ours(c, TUNED), repeat=repeat)[0]
        slow = once(lambda c=case: dense_module(c), few)
        table(name, slow, fast, slow / fast, ours(case, TUNED).verdict.status)


def ours_of(case: tuple[Trajectory, Scene, Robot], waypoints: Array | None) -> Solution | None:
    """Our measurements of somebody else's answer."""
    if waypoints is None:
        return None
    trajectory = case[0].with_(positions=waypoints[:, :3], speeds=np.maximum(waypoints[:, 3], 0.0))
    return ours((trajectory, *case[1:]), ConstraintOptions(enabled=False, obstacle_shape="sphere"))


def worst(answer: Solution | None) -> str:
    """The worst violation of an answer, or that there is none."""
    return "no answer" if answer is None else f"{max(c.violation_after for c in answer.verdict.checks):.1e}"


def once(call: Callable[[], object], repeat: int) -> float:
    times = []
    for _ in range(repeat):
        began = time.thread_time()
        call()
        times.append((time.thread_time() - began) * 1e3)
    return float(np.median(times))


def growth(repeat: int) -> None:
    """Time and memory from 1e2 to 1e5 waypoints, 1e6 where the path is clear."""
    print("\nGrowth, smoothing 0.1, five oriented boxes in the way (medians; peak of Python's allocations)")
    table("waypoints", "clear s", "obstacles s", "peak MB", "status")
    taken: dict[int, list[float]] = {}
    options = ConstraintOptions(lambda_smooth=0.1)
    for n in (100, 1_000, 10_000, 100_000, 1_000_000):
        free, crowded = long_path(n)
        few = repeat if n < 10_000 else max(repeat // 5, 1)
        runs = [lambda c=free: ours(c, options)] + ([lambda c=crowded: ours(c, options)] if n < 1_000_000 else [])
        seconds = [t / 1e3 for t in milliseconds(*runs, repeat=few)]
        tracemalloc.start()
        answer = runs[-1]()
        peak = tracemalloc.get_traced_memory()[1] / 2**20
        tracemalloc.stop()
        taken[n] = seconds
        table(n, *seconds, *[""] * (2 - len(seconds)), peak, answer.verdict.status)
    for k, name in enumerate(("clear", "obstacles")):
        exponent = np.log10(taken[100_000][k] / taken[10_000][k])
        print(f"growth exponent from 1e4 to 1e5 waypoints, {name}: {exponent:.2f}")


def long_path(n: int) -> tuple[tuple[Trajectory, Scene, Robot], tuple[Trajectory, Scene, Robot]]:
    s = np.linspace(0.0, 4.0 * np.pi, n)
    path = np.column_stack([s / 6.0 - 1.0, 0.4 * np.sin(s), 0.3 * np.cos(0.7 * s) + 0.5])
    trajectory = Trajectory(path, np.abs(0.5 + 0.6 * np.sin(s)))
    objects = tuple(
        SceneObject(f"box {i}", path[int(n * share)] + [0.0, 0.01, 0.02], [0.2, 0.15, 0.3], [1.0, 0.1 * i, 0.2, 0.0])
        for i, share in enumerate((0.15, 0.35, 0.5, 0.7, 0.9))
    )
    drone = Robot.preset("drone")
    return (trajectory, Scene(), drone), (trajectory, Scene(objects), drone)


def solvers(repeat: int) -> None:
    """The same sparse program, set up and solved by several solvers."""
    names = ["piqp", *(name for name in ("osqp", "clarabel") if available(name))]
    print("\nThe paper's sparse program with an obstacle, assembled and solved (medians, ms; deviation from PIQP)")
    table("waypoints", *names, *(f"{name} diff" for name in names[1:]))
    for n in (100, 1_000, 10_000):
        trajectory, scene, robot = cases(n)["obstacle"]
        reference = trajectory.to_array()
        rows = published.linearise(reference[:, :3], scene, robot, (), ConstraintOptions())
        lower, upper = published._bounds(reference, robot, ConstraintOptions())
        problem = (reference, rows, lower, upper)
        runs = [lambda p=problem, name=name: SOLVERS[name](*p) for name in names]
        times = milliseconds(*runs, repeat=max(repeat // 3, 1))
        best = runs[0]()
        table(n, *times, *(f"{np.abs(run() - best).max():.1e}" for run in runs[1:]))


def by_piqp(reference: Array, rows: Any, lower: Array, upper: Array) -> Array:
    found = solve_qp(reference, Weights(1.0, 0.01), lower=lower, upper=upper, rows=rows)
    return np.full_like(reference, np.nan) if found is None else found


def stacked(reference: Array, rows: Any, lower: Array, upper: Array) -> tuple[Any, Array, Any, Array, Array]:
    """P, c, A, low and high of the same program with bounds as rows."""
    sparse = importlib.import_module("scipy.sparse")
    n = len(reference)
    d1 = sparse.kron(
        sparse.diags([-np.ones(n - 1), np.ones(n - 1)], [0, 1], shape=(n - 1, n)), sparse.identity(4), "csc"
    )
    p = 2.0 * (sparse.identity(4 * n) + 0.01 * d1.T @ d1)
    columns = (rows.waypoints[:, None] * 4 + np.arange(4)).ravel()
    g = sparse.csc_matrix((rows.normals.ravel(), (np.repeat(np.arange(len(rows)), 4), columns)), (len(rows), 4 * n))
    a = sparse.vstack([g, sparse.identity(4 * n)], format="csc")
    low = np.concatenate([rows.offsets, lower.ravel()])
    high = np.concatenate([np.full(len(rows), np.inf), upper.ravel()])
    return sparse.triu(p, format="csc"), -2.0 * reference.ravel(), a, low, high


def by_osqp(reference: Array, rows: Any, lower: Array, upper: Array) -> Array:
    osqp = importlib.import_module("osqp")
    p, c, a, low, high = stacked(reference, rows, lower, upper)
    solver = osqp.OSQP()
    solver.setup(p, c, a, low, high, verbose=False, eps_abs=1e-8, eps_rel=1e-8, max_iter=100_000)
    return np.asarray(solver.solve().x).reshape(-1, 4)


def by_clarabel(reference: Array, rows: Any, lower: Array, upper: Array) -> Array:
    clarabel = importlib.import_module("clarabel")
    sparse = importlib.import_module("scipy.sparse")
    p, c, a, low, high = stacked(reference, rows, lower, upper)
    up, down = np.isfinite(high), np.isfinite(low)
    full = sparse.vstack([a[up], -a[down]], format="csc")
    right = np.concatenate([high[up], -low[down]])
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    found = clarabel.DefaultSolver(p, c, full, right, [clarabel.NonnegativeConeT(len(right))], settings).solve()
    return np.asarray(found.x).reshape(-1, 4)


SOLVERS: dict[str, Callable[..., Array]] = {"piqp": by_piqp, "osqp": by_osqp, "clarabel": by_clarabel}


def available(package: str) -> bool:
    return importlib.util.find_spec(package) is not None


def table(*cells: object) -> None:
    print("  ".join((f"{c:,.3g}" if isinstance(c, float) else str(c)).rjust(16) for c in cells))


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    options.add_argument("--quick", action="store_true", help="fewer repetitions")
    options.add_argument("--stress", nargs="?", type=int, const=2000, help="also solve that many generated problems")
    chosen = options.parse_args()
    repeat = 5 if chosen.quick else 30
    side_by_side(repeat)
    growth(5 if chosen.quick else 15)
    solvers(repeat)
    if chosen.stress:
        print()
        for name in ("constraint_scenes", "trust_scenes"):
            script = Path(__file__).parents[1] / "tests" / "limits" / f"{name}.py"
            runpy.run_path(str(script))["main"](chosen.stress)


if __name__ == "__main__":
    main()
