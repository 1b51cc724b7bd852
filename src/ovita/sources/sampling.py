"""RRT-Connect and RRT* of OMPL for a point robot with its distances (extra `planning`).

OMPL searches a tree of straight motions, each checked all along against every obstacle: as far as the clearance at a
point reaches, the motion is free. RRT-Connect stops at the first way; RRT* goes on to a number of iterations, so that
equal seeds give equal plans on any machine, unless the time limit ends it before. Both are then shortened.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import dist, hypot, inf
from typing import Any

import numpy as np

from ovita.errors import MissingExtra
from ovita.limits.path import bounds
from ovita.limits.problem import TOLERANCE, Obstacle
from ovita.paths.robot import Robot, Shell
from ovita.paths.trajectory import Array, arc_length
from ovita.sources.places import obstacles
from ovita.sources.planner import Plan, PlanRequest, Progress, finished
from ovita.text import number

ITERATIONS = {"rrt_connect": 0, "rrt_star": 1_000}
"""Iterations of the search between two places; it goes on to `MOST` where it has found no way yet."""

MOST = 20_000

ROOM = 1.0
"""How far beyond places and obstacles a way is searched [m]."""

SLACK = -0.9 * TOLERANCE
"""A clearance that counts as none [m]; what `verify` forgives, nearly."""

STEP = 1e-3
"""Least step along a motion that is checked [m]."""

SHORTCUTS = 60
"""Points of a way between which shorter ways are tried."""

Clearance = Callable[[Sequence[float]], float]
"""The distance of a place to the nearest limit, negative beyond it; it changes by no more than the place moves."""


@dataclass(frozen=True)
class SamplingPlanner:
    """Plans by OMPL; the name is "rrt_connect" or "rrt_star"."""

    name: str = "rrt_connect"

    def plan(self, request: PlanRequest, progress: Progress | None = None) -> Plan:
        """Plan from place to place, one leg after the other.

        Raises:
            MissingExtra: If ompl is not installed.
        """
        started = time.perf_counter()
        space = PointSpace.of(request)
        rows: list[Array] = []
        anchors = [0]
        for i, (a, b) in enumerate(pairwise(request.corners)):
            left = request.time_limit - (time.perf_counter() - started)
            leg = search(self.name, space, a, b, seed=request.seed + 1 + i, seconds=left, progress=progress)
            if leg is None:
                return _failed(self.name, request, i, started)
            rows.append(leg[:-1])
            anchors.append(anchors[-1] + len(leg) - 1)
        polyline = np.vstack([*rows, request.corners[-1:]])
        return finished(request, polyline, anchors, self.name, started)


def _failed(name: str, request: PlanRequest, leg: int, started: float) -> Plan:
    a, b = request.anchors[leg : leg + 2]
    seconds = time.perf_counter() - started
    why = f"{name} found no way from {a.label} to {b.label} in {number(seconds)} s"
    hint = "allow more time, free the way, or ask the planner 'limits', which says what is in the way."
    return Plan(name, request, problems=(f"{why}; {hint}",), seconds=seconds)


@dataclass(frozen=True)
class PointSpace:
    """Where a point robot may be.

    Args:
        lower: (D,) [m], D the coordinates that it can choose.
        upper: (D,) [m].
        clearance: Of a place of D coordinates [m].
        level: The height of a robot that stays on a plane [m], or None.
    """

    lower: Array
    upper: Array
    clearance: Clearance
    level: float | None = None

    @classmethod
    def of(cls, request: PlanRequest) -> PointSpace:
        """The space that a request leaves."""
        robot, bodies = request.robot, obstacles(request.scene, request.robot)
        lower, upper = _extent(robot, request.corners, bodies)
        level = float(request.start.position[2]) if robot.planar else None
        dims = 2 if level is not None else 3
        return cls(lower[:dims], upper[:dims], clearance_of(robot, bodies, level), level)

    def point(self, values: Sequence[float]) -> Array:
        """A point (3,) [m] from the coordinates that are chosen."""
        return np.array([*values, self.level] if self.level is not None else values, dtype=float)


def _extent(robot: Robot, corners: Array, bodies: Sequence[Obstacle]) -> tuple[Array, Array]:
    """The box that is searched: what places and obstacles take up and some room around, within the workspace."""
    lower, upper = bounds(robot)
    reach = np.array([[*(b.center - b.reach), *(b.center + b.reach)] for b in bodies] or np.zeros((0, 6)))
    low = np.vstack([corners, reach[:, :3]]).min(axis=0) - ROOM
    high = np.vstack([corners, reach[:, 3:]]).max(axis=0) + ROOM
    if isinstance(robot.workspace, Shell):
        center = np.asarray(robot.workspace.center)
        lower, upper = center - robot.workspace.r_max, center + robot.workspace.r_max
    return np.maximum(low, lower), np.minimum(high, upper)


def clearance_of(robot: Robot, bodies: Sequence[Obstacle], level: float | None) -> Clearance:
    """The clearance of points; in plain Python, since a search asks for one point at a time, a million times."""
    boxes = [(b.center.tolist(), b.rotation.T.tolist(), b.half.tolist(), float(b.radius)) for b in bodies]
    shell = robot.workspace if isinstance(robot.workspace, Shell) else None

    def clearance(place: Sequence[float]) -> float:
        x, y = place[0], place[1]
        z = place[2] if level is None else level
        best = inf if shell is None else shell.r_max - robot.margin - dist((x, y, z), shell.center)
        for (cx, cy, cz), axes, half, radius in boxes:
            dx, dy, dz = x - cx, y - cy, z - cz
            beyond = [abs(ax * dx + ay * dy + az * dz) - h for (ax, ay, az), h in zip(axes, half, strict=True)]
            deepest = max(beyond)
            away = deepest if deepest <= 0.0 else hypot(*(max(b, 0.0) for b in beyond))
            best = min(best, away - radius)
        return best

    return clearance


def search(
    name: str,
    space: PointSpace,
    start: Array,
    goal: Array,
    *,
    seed: int,
    seconds: float,
    progress: Progress | None = None,
) -> Array | None:
    """The vertices (K, 3) [m] of a way from start to goal, or None if none is found.

    Raises:
        MissingExtra: If ompl is not installed.
    """
    dims = len(space.lower)
    ends = [np.clip(p[:dims], space.lower, space.upper).tolist() for p in (start, goal)]

    def free(place: Sequence[float]) -> bool:
        return space.clearance(place) >= SLACK

    def passable(a: Sequence[float], b: Sequence[float]) -> bool:
        """Whether a motion is free all along: each step is as long as the clearance allows."""
        whole, at = dist(a, b), 0.0
        while at < whole:
            share = at / whole
            room = space.clearance([p + share * (q - p) for p, q in zip(a, b, strict=True)])
            if room < SLACK:
                return False
            at += max(room, STEP)
        return free(b)

    if passable(ends[0], ends[1]):
        return np.array([start, goal])
    box = space.lower, space.upper
    path = solve(name, box, free, ends[0], ends[1:], seed, seconds, passable=passable, progress=progress)
    if path is None:
        return None
    points = np.array([space.point(row) for row in shortened(path, passable)])
    points[0], points[-1] = start, goal
    return points


def shortened(
    path: Array, passable: Callable[[Sequence[float], Sequence[float]], bool], count: int = SHORTCUTS
) -> Array:
    """The shortest polyline (K, D) between points on a path (N, D) whose motions are all passable."""
    s = arc_length(path)
    even = np.linspace(0.0, s[-1], max(count - len(path), 0))
    at = np.unique(np.concatenate([s, even]))
    rows = np.column_stack([np.interp(at, s, path[:, k]) for k in range(path.shape[1])])
    points, cost, before = rows.tolist(), np.full(len(rows), np.inf), np.zeros(len(rows), dtype=int)
    cost[0] = 0.0
    for j in range(1, len(rows)):
        along = cost[:j] + np.linalg.norm(rows[:j] - rows[j], axis=1)
        for i in np.argsort(along, kind="stable"):
            if i == j - 1 or passable(points[i], points[j]):
                cost[j], before[j] = along[i], i
                break
    chain = [len(rows) - 1]
    while chain[-1]:
        chain.append(int(before[chain[-1]]))
    return rows[chain[::-1]]


def solve(
    name: str,
    box: tuple[Array, Array],
    free: Callable[[Sequence[float]], bool],
    start: Sequence[float],
    goals: Sequence[Sequence[float]],
    seed: int,
    seconds: float,
    *,
    passable: Callable[[Sequence[float], Sequence[float]], bool],
    progress: Progress | None = None,
) -> Array | None:
    """OMPL in a box (lowest and highest coordinates, (D,) each): vertices (K, D) from start (D,) to a goal, or None.

    A place is legal where it is `free`, the straight motion between two where it is `passable`. The seed is > 0, the
    name "rrt_connect" or "rrt_star".

    Raises:
        MissingExtra: If ompl is not installed.
    """
    try:
        from ompl import base, geometric, util
    except ImportError:
        raise MissingExtra("ompl", "planning") from None
    dims = range(len(box[0]))

    class Motions(base.MotionValidator):  # type: ignore[misc]
        def checkMotion(self, a: Any, b: Any, *_: Any) -> bool:
            return passable([a[k] for k in dims], [b[k] for k in dims])

    util.setLogLevel(util.LOG_NONE)
    util.RNG.setSeed(seed)
    space = _space(base, box)
    si = base.SpaceInformation(space)
    si.setStateValidityChecker(lambda state: free([state[k] for k in dims]))
    si.setMotionValidator(Motions(si))
    si.setup()
    problem = base.ProblemDefinition(si)
    problem.addStartState(_state(space, start))
    targets = base.GoalStates(si)
    for goal in goals:
        targets.addState(_state(space, goal))
    problem.setGoal(targets)
    known = problem.hasExactSolution
    planner = geometric.RRTConnect(si)
    if name == "rrt_star":
        problem.setOptimizationObjective(base.PathLengthOptimizationObjective(si))
        planner = geometric.RRTstar(si)
        known = lambda: bool(planner.bestCost().value() < inf)  # noqa: E731  # it hands its way over at the very end
    planner.setProblemDefinition(problem)
    planner.setup()
    patience = _patience(name, seconds, known, progress)
    planner.solve(base.PlannerTerminationCondition(patience))
    if not problem.hasExactSolution():
        return None
    path = problem.getSolutionPath()
    return np.array([[path.getState(i)[k] for k in range(len(dims))] for i in range(path.getStateCount())])


def _space(base: Any, box: tuple[Array, Array]) -> Any:
    """OMPL's space of a box."""
    space, limits = base.RealVectorStateSpace(len(box[0])), base.RealVectorBounds(len(box[0]))
    for k, (low, high) in enumerate(zip(*(side.tolist() for side in box), strict=True)):
        limits.setLow(k, low)
        limits.setHigh(k, high)
    space.setBounds(limits)
    return space


def _state(space: Any, values: Sequence[float]) -> Any:
    state = space.allocState()
    for k, value in enumerate(values):
        state[k] = float(value)
    return state


def _patience(name: str, seconds: float, found: Callable[[], bool], progress: Progress | None) -> Callable[[], bool]:
    """Whether a search has had its iterations or its time; tells how far it is now and then."""
    until, least = time.perf_counter() + seconds, ITERATIONS[name]
    done = 0

    def over() -> bool:
        nonlocal done
        done += 1
        if progress is not None and done % 500 == 0:
            progress(f"{name}: {done} iterations")
        enough = done > MOST or (done > least and found())
        return enough or (done % 16 == 0 and time.perf_counter() > until)

    return over
