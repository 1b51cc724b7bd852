"""Planners on random scenes: how often they succeed, whether it is legal, how long the way is and how long it takes.

`python benchmarks/planners.py` plans 100 random drone scenes (8 boxes, 4 m wide) with every planner, beside OMPL as it
comes (RRT-Connect and its own simplification, the same validity, no constraint module), and 50 arm problems in joint
space, which a simulated iiwa then follows in physics while its contacts are counted. A result counts as legal if
`limits.verify`, which knows no planner, finds every limit kept on whole segments. Times are CPU time.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ovita import Robot, Scene, SceneObject, Trajectory, verify
from ovita.limits import ConstraintOptions
from ovita.paths.geometry import lengths
from ovita.sources.places import Location, troubles
from ovita.sources.planner import Plan, Planner, PlanRequest, anchored, planned, planner_named, spread
from ovita.sources.sampling import PointSpace

DRONE, ARM = Robot.preset("drone"), Robot.preset("arm")


@dataclass(frozen=True)
class Problem:
    """A scene with a start and a goal that are legal."""

    scene: Scene
    robot: Robot
    start: tuple[float, float, float]
    goal: tuple[float, float, float]

    def request(self, seed: int, time_limit: float = 60.0) -> PlanRequest:
        places = [Location(point=self.start), Location(point=self.goal)]
        first, last = anchored(places, self.scene, self.robot)
        return PlanRequest(self.scene, self.robot, first, last, seed=seed, time_limit=time_limit)


def drone_problem(seed: int) -> Problem:
    """Eight boxes of 0.2 to 1 m between two places that are 2 m apart at least."""
    rng = np.random.default_rng(seed)
    while True:
        objects = [
            SceneObject(f"box {i}", rng.uniform([-1.4, -1.4, 0.2], [1.4, 1.4, 1.8]), rng.uniform(0.2, 1.0, 3))
            for i in range(8)
        ]
        scene = Scene(tuple(objects))
        a, b = rng.uniform([-2, -2, 0.2], [2, 2, 1.8]), rng.uniform([-2, -2, 0.2], [2, 2, 1.8])
        apart = np.linalg.norm(b - a) > 2.0
        if apart and not troubles(a, scene, DRONE) and not troubles(b, scene, DRONE):
            return Problem(scene, DRONE, tuple(a.tolist()), tuple(b.tolist()))


def arm_problem(seed: int) -> Problem:
    """Four boxes on a table in front of an arm, and two places 0.3 m apart at least."""
    rng = np.random.default_rng(1000 + seed)
    while True:
        objects = []
        for i in range(4):
            size = rng.uniform([0.05, 0.05, 0.05], [0.15, 0.15, 0.35])
            x, y = rng.uniform([0.0, -0.4], [0.35, 0.4])
            objects.append(SceneObject(f"box {i}", [x, y, size[2] / 2], size))
        scene = Scene(tuple(objects))
        a, b = (rng.uniform([0.0, -0.4, 0.1], [0.35, 0.4, 0.5]) for _ in "ab")
        apart = np.linalg.norm(b - a) > 0.3
        if apart and not troubles(a, scene, ARM) and not troubles(b, scene, ARM):
            return Problem(scene, ARM, tuple(a.tolist()), tuple(b.tolist()))


@dataclass(frozen=True)
class OmplAlone:
    """RRT-Connect and `simplifySolution` of OMPL, as its tutorials use them."""

    name: str = "ompl alone"

    def plan(self, request: PlanRequest, progress: object = None) -> Plan:
        from ompl import base, geometric, util

        util.setLogLevel(util.LOG_NONE)
        util.RNG.setSeed(request.seed + 1)
        inside = PointSpace.of(request)
        space = base.RealVectorStateSpace(3)
        limits = base.RealVectorBounds(3)
        for k in range(3):
            limits.setLow(k, float(inside.lower[k]))
            limits.setHigh(k, float(inside.upper[k]))
        space.setBounds(limits)
        setup = geometric.SimpleSetup(space)
        setup.setStateValidityChecker(lambda s: inside.clearance((s[0], s[1], s[2])) >= 0.0)
        ends = []
        for corner in request.corners:
            state = space.allocState()
            for k in range(3):
                state[k] = float(corner[k])
            ends.append(state)
        setup.setStartAndGoalStates(*ends)
        setup.setPlanner(geometric.RRTConnect(setup.getSpaceInformation()))
        setup.solve(request.time_limit)
        if not setup.haveExactSolutionPath():
            return Plan(self.name, request, problems=("no way",))
        setup.simplifySolution()
        path = setup.getSolutionPath()
        rows = np.array([[path.getState(i)[k] for k in range(3)] for i in range(path.getStateCount())])
        line, _ = spread(rows, max(request.waypoints, len(rows)), request.cruise)
        return Plan(self.name, request, line)


def legal(path: Trajectory, problem: Problem, *, speed: bool) -> bool:
    """Whether a path keeps every limit, or every one that is not about speed."""
    options = ConstraintOptions(repair_original=True)
    checks = verify(path, problem.scene, problem.robot, proposed=path, original=path, options=options)
    return all(check.held for check in checks if speed or check.geometric)


def measure(planner: Planner, problems: Sequence[Problem]) -> list[Plan]:
    """Every problem's plan, its CPU time as `seconds`."""
    from dataclasses import replace

    found = []
    for i, problem in enumerate(problems):
        began = time.process_time()
        plan = planned(problem.request(i), planner)
        found.append(replace(plan, seconds=time.process_time() - began))
    return found


def row(name: str, plans: Sequence[Plan], problems: Sequence[Problem], *, speed: bool = True) -> str:
    """A line of the table: success, legal, length over the straight way, CPU time."""
    done = [(p, q) for p, q in zip(plans, problems, strict=True) if p.trajectory is not None and p.ok]
    right = sum(legal(p.trajectory, q, speed=speed) for p, q in done if p.trajectory is not None)
    ratio = [p.cost / float(lengths(np.diff(p.request.corners, axis=0)).sum()) for p, _ in done]
    spent = sorted(p.seconds for p in plans)
    share = f"{len(done)}/{len(plans)}"
    middle = statistics.median(ratio) if ratio else float("nan")
    worst = spent[int(0.95 * (len(spent) - 1))]
    return f"| {name} | {share} | {right}/{len(done)} | {middle:.3f} | {statistics.median(spent):.3f} | {worst:.3f} |"


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=100)
    parser.add_argument("--arms", type=int, default=50)
    options = parser.parse_args()
    problems = [drone_problem(seed) for seed in range(options.scenes)]
    print("| planner | found | of these legal | median length / straight | CPU s, median | CPU s, 95 % |")
    print("|---|---|---|---|---|---|", flush=True)
    for name in ("limits", "rrt_connect", "mpc", "rrt_star"):
        print(row(name, measure(planner_named(name), problems), problems), flush=True)
    alone = measure(OmplAlone(), problems)
    print(row("OMPL alone, path only", alone, problems, speed=False), flush=True)
    if not options.arms:
        return
    from ovita.sources.joints import touched

    cells = [arm_problem(seed) for seed in range(options.arms)]
    plans = measure(planner_named("joint"), cells)
    print(row("joint (arm)", plans, cells), flush=True)
    followed = [touched(plan) for plan in plans if plan.ok]
    free = sum(not contacts for contacts, _ in followed)
    print(f"\nfollowed in physics: {free} of {len(followed)} without any contact, ", end="")
    print(f"worst error of a joint {max((error for _, error in followed), default=0.0):.4f} rad")
    for plan in plans:
        if not plan.ok:
            print("not found:", " ".join(plan.problems))


if __name__ == "__main__":
    main()
