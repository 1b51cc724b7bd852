"""The constraint module as published (OVITA, arXiv 2508.17260): one linearised quadratic program.

    minimise    lambda_dev |x - x_ref|^2 + lambda_smooth |D1 x|^2                              (objective)
    subject to  lower + delta <= p_i <= upper - delta                                           (box workspace)
      or        r_min + delta <= |p_i - c| <= r_max - delta, linearised at x_ref                (shell workspace)
                |p_i - o|^2 >= R^2 + delta^2, linearised at x_ref, R half the diagonal          (obstacle spheres)
                v_i <= v_max                                                                    (speed)
                p_0, p_{N-1} as in x_ref                                                        (fixed ends)

over x in R^4N, with both weights searched by Optuna (TPE, 50 trials, 1e-3..1e1, logarithmic) for the smallest
deviation |x - x_ref|^2. Two corrections: D1 is waypoint-major (the released code penalised x against y), and v_i >= 0.
Known limits, which `verify` will report: only waypoints are constrained, the linearised spheres throw a waypoint near
a centre far away, and the linearised r_max is an outer approximation.
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from ovita.errors import needs
from ovita.limits.path import bounds
from ovita.limits.problem import ConstraintOptions, obstacles_of
from ovita.limits.qp import Rows, Weights, solve_qp
from ovita.paths.robot import Robot, Shell
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory

RANGE = (1e-3, 1e1)
"""Of both weights."""


def solve(
    proposed: Trajectory, scene: Scene, robot: Robot, contacts: Sequence[str], options: ConstraintOptions
) -> tuple[Trajectory, tuple[str, ...]]:
    """Solve the published program.

    With `options.trials` 0 the weights are those of the options, and Optuna is not needed.

    Returns:
        The optimum, or the proposal if the program has none; and notes.

    Raises:
        MissingExtra: If the weights are to be searched and optuna is not installed.
    """
    reference = proposed.to_array()
    rows = linearise(reference[:, :3], scene, robot, contacts, options)
    lower, upper = _bounds(reference, robot, options)

    def at(dev: float, smooth: float) -> Array | None:
        return solve_qp(reference, Weights(dev, smooth), lower=lower, upper=upper, rows=rows)

    dev = options.lambda_dev
    smooth = 0.0 if options.lambda_smooth == "auto" else options.lambda_smooth
    notes: tuple[str, ...] = ()
    if options.trials:
        with needs("optuna", "tuning"):
            optuna = importlib.import_module("optuna")
        optuna.logging.set_verbosity(optuna.logging.ERROR)
        study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=options.seed))

        def deviation(trial: Any) -> float:
            x = at(*(trial.suggest_float(name, *RANGE, log=True) for name in ("dev", "smooth")))
            return float("inf") if x is None else float(((x - reference) ** 2).sum())

        study.optimize(deviation, n_trials=options.trials)
        dev, smooth = study.best_params["dev"], study.best_params["smooth"]
        notes = (f"{options.trials} trials chose lambda_dev {dev:.3g} and lambda_smooth {smooth:.3g}.",)
    best = at(dev, smooth)
    if best is None:
        return proposed, (*notes, "The published quadratic program has no solution.")
    return proposed.with_(positions=best[:, :3], speeds=np.maximum(best[:, 3], 0.0)), notes


def linearise(
    reference: Array, scene: Scene, robot: Robot, contacts: Sequence[str], options: ConstraintOptions
) -> Rows:
    """First-order expansion of the squared distances at x_ref (N, 3): rows over (x, y, z, v) of each waypoint."""
    parts = [Rows.none(4)]
    if options.obstacles:
        for body in obstacles_of(scene, robot, contacts=contacts, path=reference, shape="sphere"):
            if body.half.any():
                continue  # a support: no sphere stands for a table top, so only the verification knows it
            radius = body.radius - body.keep
            parts.append(_outside(reference, body.center, radius**2 + body.keep**2))
    if isinstance(robot.workspace, Shell):
        center = np.asarray(robot.workspace.center)
        parts.append(_outside(reference, center, (robot.workspace.r_min + robot.margin) ** 2))
        inner = _outside(reference, center, (robot.workspace.r_max - robot.margin) ** 2)
        parts.append(Rows(inner.waypoints, -inner.normals, -inner.offsets))
    return Rows.join(*parts)


def _outside(reference: Array, center: Array, square: float) -> Rows:
    """|p - c|^2 >= square, linearised: 2 (p_ref - c).p >= square - |p_ref - c|^2 + 2 (p_ref - c).p_ref."""
    offset = reference - center
    normals = np.column_stack([2.0 * offset, np.zeros(len(offset))])
    offsets = square - (offset**2).sum(axis=1) + 2.0 * (offset * reference).sum(axis=1)
    return Rows(np.arange(len(reference)), normals, offsets)


def _bounds(reference: Array, robot: Robot, options: ConstraintOptions) -> tuple[Array, Array]:
    low, high = bounds(robot)
    lower = np.tile(np.append(low, 0.0), (len(reference), 1))
    top = np.inf if robot.max_speed is None else robot.max_speed
    upper = np.tile(np.append(high, top), (len(reference), 1))
    pins = list(options.pins(len(reference)))
    lower[pins, :3] = upper[pins, :3] = reference[pins, :3]
    return lower, upper
