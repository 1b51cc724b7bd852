"""Planning from place to place: the request, the result, and the protocol that every planner follows.

A planner finds a polyline; `finished` puts waypoints and speeds on it, enforces the robot's limits, and has the result
measured by `limits.verify`, which knows nothing of how it was found.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from itertools import pairwise
from numbers import Integral, Real
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

import ovita.plugins as plugins
from ovita.errors import RequestError
from ovita.io.documents import Task, load_robot
from ovita.io.documents import plain as as_json
from ovita.io.messages import JointMotion
from ovita.limits import ConstraintCheck, ConstraintOptions, constrain, verify
from ovita.limits.path import PathProblem, ball, bounds
from ovita.limits.qp import Weights
from ovita.limits.route import find_route
from ovita.paths.geometry import lengths
from ovita.paths.robot import PRESETS, Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory, arc_length
from ovita.sources.places import SIDES, Anchor, Location, locate, obstacles, read_place, troubles
from ovita.text import called_as, length, listed, number, point, sentence, shortened

WAYPOINTS, MOST_WAYPOINTS = 60, 2000
TIME_LIMIT = 30.0
SHARE, SLOW = 0.5, 0.25
"""Speed of a planned path where none is asked for: this share of the robot's highest, or without one this [m/s]."""

RAMP = 0.15
"""Share of the path on which it comes up to speed, and comes to rest."""

_HOMES = {
    "limits": "planner:LimitsPlanner",
    "rrt_connect": "sampling:SamplingPlanner",
    "rrt_star": "sampling:SamplingPlanner",
    "mpc": "mpc:TrackingPlanner",
    "joint": "joints:JointPlanner",
}

PLANNERS = tuple(_HOMES)

Progress = Callable[[str], None]


@dataclass(frozen=True)
class PlanRequest:
    """What is to be planned, by the arguments of `plan`.

    Args:
        waypoints: How many the trajectory gets; more where the way needs them.
        speed: On the way [m/s]; None takes half of the robot's highest.

    Raises:
        RequestError: On numbers that make no sense.
    """

    scene: Scene
    robot: Robot
    start: Anchor
    goal: Anchor
    via: tuple[Anchor, ...] = ()
    waypoints: int = WAYPOINTS
    speed: float | None = None
    seed: int = 0
    time_limit: float = TIME_LIMIT

    def __post_init__(self) -> None:
        for name in ("waypoints", "seed", "speed", "time_limit"):
            value, kind = getattr(self, name), Integral if name in ("waypoints", "seed") else Real
            if not isinstance(value, kind) and (name, value) != ("speed", None):
                raise RequestError(f"{name.replace('_', ' ')} {shortened(value)} is no number; give one")
        if not len(self.anchors) <= self.waypoints <= MOST_WAYPOINTS:
            raise RequestError(f"{self.waypoints} waypoints: give {len(self.anchors)} to {MOST_WAYPOINTS}")
        if self.speed is not None and not 0.0 < self.speed < np.inf:
            raise RequestError(f"speed {self.speed:g} m/s: give a speed above 0")
        if not 0.0 < self.time_limit < np.inf:
            raise RequestError(f"time limit {self.time_limit:g} s: give a time above 0")
        if not 0 <= self.seed < 2**31:
            raise RequestError(f"seed {self.seed}: give a whole number from 0 to {2**31 - 1}")

    @property
    def anchors(self) -> tuple[Anchor, ...]:
        """Start, via points and goal."""
        return (self.start, *self.via, self.goal)

    @property
    def corners(self) -> Array:
        """Their positions (K, 3) [m]."""
        return np.array([anchor.position for anchor in self.anchors])

    @property
    def cruise(self) -> float:
        """The speed on the way [m/s]."""
        top = self.robot.max_speed
        wanted = self.speed if self.speed is not None else SLOW if top is None else SHARE * top
        return max(wanted if top is None else min(wanted, top), self.robot.min_speed)

    @property
    def lowered(self) -> tuple[str, ...]:
        """That the speed that was asked for is more than the robot's highest."""
        top = self.robot.max_speed
        if self.speed is None or top is None or self.speed <= top:
            return ()
        return (f"The speed is {number(top)} m/s, the highest of {self.robot.name}, not {number(self.speed)} m/s.",)

    @property
    def told(self) -> str:
        """The way in words: "from above the box, passing above the bottle, to above the plate"."""
        via = f", passing {listed(dict.fromkeys(anchor.label for anchor in self.via))}," if self.via else ""
        return f"from {self.start.label}{via} to {self.goal.label}"


@dataclass(frozen=True, eq=False)
class Plan:
    """What a planner found.

    Args:
        planner: Its name.
        request: What was asked for.
        trajectory: The path with its speeds, or None where there is none.
        checks: Every limit, measured on it by the independent verifier.
        problems: Why there is none, or which limits it breaks, each a sentence with what to do.
        notes: What else a person should know.
        seconds: How long the search took.
        motion: Of the joints of an arm, where the planner plans for them.
    """

    planner: str
    request: PlanRequest
    trajectory: Trajectory | None = None
    checks: tuple[ConstraintCheck, ...] = ()
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    seconds: float = field(default=0.0, compare=False)
    motion: JointMotion | None = None

    @property
    def ok(self) -> bool:
        """Whether there is a trajectory that keeps every limit."""
        return self.trajectory is not None and not self.problems

    @property
    def cost(self) -> float:
        """Length of the path [m], infinite where there is none."""
        return np.inf if self.trajectory is None else self.trajectory.length

    def task(self, robot: str | None = None) -> Task:
        """The trajectory in its scene, as a file holds it.

        Args:
            robot: The robot's name or file; None takes the name of a preset.

        Raises:
            RequestError: If there is no legal trajectory.
        """
        if self.trajectory is None or not self.ok:
            raise RequestError(" ".join(self.problems))
        request = self.request
        named = robot or (request.robot.name if PRESETS.get(request.robot.name) == request.robot else None)
        via = [anchor.label for anchor in request.via]
        planned: dict[str, Any] = {"planner": self.planner, "from": request.start.label, "via": via}
        planned |= {"to": request.goal.label, "seed": request.seed}
        if self.motion is not None:
            planned["joints"] = as_json({name: getattr(self.motion, name) for name in ("names", "times", "positions")})
        return Task(self.trajectory, request.scene, extra={"planned": planned}, robot=named)

    def sentences(self) -> list[str]:
        """The outcome in plain words."""
        if self.trajectory is None or not self.ok:
            return [f"No legal path was found {self.request.told}.", *self.problems, *self.notes]
        path = self.trajectory
        straight = float(lengths(np.diff(self.request.corners, axis=0)).sum())
        more = f", {length(path.length - straight)} more than the straight way" if path.length > straight + 1e-3 else ""
        said = f"Planned {self.request.told}: {len(path)} waypoints, {number(path.length)} m{more},"
        return [f"{said} {number(path.duration)} s.", *self.request.lowered, *self.notes]


class Planner(Protocol):
    """Anything that plans."""

    @property
    def name(self) -> str:
        """As on the command line."""
        ...

    def plan(self, request: PlanRequest, progress: Progress | None = None) -> Plan:
        """Plan; what cannot be is said in `Plan.problems`.

        Raises:
            MissingExtra: If the planner's package is not installed.
        """
        ...


def planner_named(name: str) -> Planner:
    """A planner by its name, ovita's own or a plug-in's.

    Raises:
        RequestError: If there is no such planner.
    """
    if name in _HOMES:
        module, _, kind = _HOMES[name].partition(":")
        own: Planner = getattr(import_module(f"ovita.sources.{module}"), kind)(name=name)
        return own
    found: Planner | None = plugins.make("planners", name, "plan")
    if found is None:
        known = (*PLANNERS, *plugins.entries("planners"))
        raise RequestError(f"there is no planner {name!r}; the planners are {', '.join(known)}")
    return found


@called_as('plan(scene, start="box", goal=[0.4, 0.2, 0.3], robot="arm")')
def plan(
    scene: Scene,
    *,
    start: str | Location | SceneObject | ArrayLike,
    goal: str | Location | SceneObject | ArrayLike,
    via: Sequence[str | Location | SceneObject | ArrayLike] = (),
    robot: Robot | str = "none",
    planner: Planner | str = "limits",
    waypoints: int = WAYPOINTS,
    speed: float | None = None,
    seed: int = 0,
    time_limit: float = TIME_LIMIT,
    progress: Progress | None = None,
) -> Plan:
    """Plan a trajectory from place to place within a robot's limits.

    Args:
        scene: Its objects are obstacles.
        start: An object, its name, a place in words ("10 cm above the box") or a position (3,) [m].
        goal: Likewise.
        via: What to pass, in order.
        robot: The limits, or the name of a preset or robot file.
        planner: Or its name, one of `PLANNERS`.
        waypoints: How many the trajectory gets.
        speed: On the way [m/s]; None takes half of the robot's highest.
        seed: Of planners that sample; equal seeds give equal plans.
        time_limit: For the search [s].
        progress: Called with a short line now and then.

    Returns:
        The plan; where there is no legal way, `problems` says why and what to do.

    Raises:
        RequestError: If a place or a number cannot be used.
        RobotError: If there is no such robot.
        MissingExtra: If the planner's package is not installed.
    """
    if not isinstance(scene, Scene):
        raise RequestError(f"plan takes a Scene, not {shortened(scene)}; that of a file is ovita.load(file).scene")
    limits = load_robot(robot) if not isinstance(robot, Robot) else robot
    chosen = planner_named(planner) if isinstance(planner, str) else planner
    if not callable(getattr(chosen, "plan", None)):
        raise RequestError(f"{shortened(chosen)} is no planner; the planners are {', '.join(PLANNERS)}")
    places = [_said(place, scene) for place in (start, *via, goal)]
    first, *passed, last = anchored(places, scene, limits)
    request = PlanRequest(scene, limits, first, last, tuple(passed), waypoints, speed, seed, time_limit)
    return planned(request, chosen, progress)


def planned(request: PlanRequest, planner: Planner, progress: Progress | None = None) -> Plan:
    """As the planner plans; places that no legal path can have are refused before."""
    problems = impossible(request)
    return Plan(planner.name, request, problems=problems) if problems else planner.plan(request, progress)


def anchored(places: Sequence[Location], scene: Scene, robot: Robot) -> list[Anchor]:
    """Where places are for a robot, each on the side that faces its neighbour."""
    centers = [np.array(p.point) if p.point else np.mean([o.position for o in p.objects], axis=0) for p in places]
    others = [*centers[1:2], *centers[:-1]] if len(centers) > 1 else [None]
    found = [locate(place, scene, robot, other) for place, other in zip(places, others, strict=True)]
    for k, place in enumerate(places):
        if 0 < k < len(places) - 1 and place.relation in (*SIDES, "beside") and place.height is None:
            found[k] = _passed(place, found[k - 1 : k + 2], scene, robot)
    return found


def _passed(place: Location, anchors: Sequence[Anchor], scene: Scene, robot: Robot) -> Anchor:
    """Where a way passes beside an object: at the height at which it comes by, as far as the object reaches there.

    Where an object is to be on one side of the robot and is there on the straight way, that is where it passes.
    """
    before, there, behind = anchors
    item, leg, up = place.objects[0], behind.position - before.position, scene.frame.direction("up")
    share = float((item.position - before.position) @ leg) / max(float(leg @ leg), 1e-12)
    foot = before.position + min(max(share, 0.0), 1.0) * leg
    if place.seen and not troubles(foot, scene, robot):
        away = scene.frame.direction(place.relation) if place.away is None else np.array(place.away)
        if (foot - item.position) @ away > 0.0 and item.clearance(foot[None])[0] >= (place.distance or 0.0):
            return replace(there, position=foot)
    half = float(np.abs(item.rotation.T @ up) @ item.size) / 2.0
    middle, now = float(item.position @ up), float(there.position @ up)
    level = there.position + (float(np.clip(foot @ up, middle - half, middle + half)) - now) * up
    return replace(there, position=level) if not (robot.planar or troubles(level, scene, robot)) else there


def _said(place: str | Location | SceneObject | ArrayLike, scene: Scene) -> Location:
    if isinstance(place, Location):
        return place
    if isinstance(place, SceneObject):
        return Location(objects=(place,))
    if isinstance(place, str):
        return read_place(place, scene)
    try:
        values = np.asarray(place, dtype=float)
    except (TypeError, ValueError):
        values = np.zeros(0)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise RequestError(f"{place!r} is no position: give x, y, z in metres")
    return Location(point=(float(values[0]), float(values[1]), float(values[2])))


def impossible(request: PlanRequest) -> tuple[str, ...]:
    """Why start, via points or goal cannot be on any legal path, each a sentence; none if they can."""
    names = ["the start", *(f"via point {i}" for i in range(1, len(request.via) + 1)), "the goal"]
    named = zip(names, request.anchors, strict=True)
    found = tuple(text for name, anchor in named for text in _barred(name, anchor, request))
    if not found and lengths(np.diff(request.corners, axis=0)).sum() < 1e-9:
        return ("Start and goal are the same place, so there is no way to plan; name another goal or a via point.",)
    return found


def _barred(name: str, anchor: Anchor, request: PlanRequest) -> list[str]:
    """Why no legal path can be at a place, each a sentence."""
    at = point([round(float(value), 3) for value in anchor.position])
    where = f"{name}, {at}," if not anchor.objects else f"{name}, {anchor.label} at {at},"
    remedy = "; choose another place, or a robot with other limits"
    return [sentence(f"{where} {why}{remedy}") for why in troubles(anchor.position, request.scene, request.robot)]


def finished(request: PlanRequest, polyline: Array, anchors: Sequence[int], planner: str, started: float) -> Plan:
    """Waypoints and speeds on a polyline, within the limits, verified.

    Anchors are the vertices of the polyline (K, 3) [m] that are start, via points and goal; the search `started` at a
    time of `time.perf_counter` [s].
    """
    line, corners = spread(polyline, max(request.waypoints, len(polyline)), request.cruise)
    options = ConstraintOptions(
        fix_start=True, fix_goal=True, pinned=tuple(corners[i] for i in anchors), repair_original=True
    )
    solution = constrain(line, request.scene, request.robot, original=line, options=options)
    path = solution.trajectory
    checks = verify(path, request.scene, request.robot, proposed=line, original=line, options=options)
    held = all(check.held for check in checks)
    problems = () if held else solution.verdict.conflicts or (_UNEXPLAINED,)
    return Plan(planner, request, path, checks, problems, seconds=time.perf_counter() - started)


_UNEXPLAINED = "The path breaks a limit; reduce the robot's margins, or choose another planner."


def spread(polyline: Array, count: int, cruise: float) -> tuple[Trajectory, list[int]]:
    """A trajectory of so many waypoints along a polyline (K, 3) [m], and which of them are its vertices.

    Every vertex is a waypoint, the others are spread evenly between them; it starts and ends at rest.
    """
    steps = lengths(np.diff(polyline, axis=0))
    shares = steps / max(float(steps.sum()), 1e-12) * (count - 1)
    parts = np.maximum(np.floor(shares), 1).astype(int)
    for i in np.argsort(np.floor(shares) - shares, kind="stable")[: max(count - 1 - int(parts.sum()), 0)]:
        parts[i] += 1
    corners = [0, *np.cumsum(parts).tolist()]
    legs = zip(polyline[:-1], polyline[1:], parts, strict=True)
    rows = [a + np.linspace(0.0, 1.0, n, endpoint=False)[:, None] * (b - a) for a, b, n in legs]
    positions = np.vstack([*rows, polyline[-1:]])
    return Trajectory(positions, speed_profile(positions, cruise)), corners


def speed_profile(positions: Array, cruise: float) -> Array:
    """Speeds (N,) [m/s] from rest up to a cruising speed and back to rest, at a constant acceleration."""
    s = arc_length(positions)
    ramp = max(RAMP * float(s[-1]), 1e-12)
    share = np.minimum(np.minimum(s, s[-1] - s) / ramp, 1.0)
    return np.asarray(cruise * np.sqrt(np.maximum(share, 0.0)))


@dataclass(frozen=True)
class LimitsPlanner:
    """The constraint module as a planner: the straight way, moved as little as the limits need.

    It goes around obstacles by a visibility graph and pulls the path back to the straight line as far as the limits let
    it (see `limits.solve`), so it is deterministic and takes milliseconds. Where so few waypoints cannot go around
    something, they are spread along the shortest legal polyline instead.
    """

    name: str = "limits"

    def plan(self, request: PlanRequest, progress: Progress | None = None) -> Plan:
        """Plan; seed and time limit do not matter."""
        started = time.perf_counter()
        if progress is not None:
            progress("going around obstacles")
        found = finished(request, request.corners, range(len(request.anchors)), self.name, started)
        if found.ok:
            return found
        route = _legal_polyline(request)
        if route is None:
            return replace(found, seconds=time.perf_counter() - started)
        again = finished(request, *route, self.name, started)
        return again if again.ok else replace(found, seconds=again.seconds)


def _legal_polyline(request: PlanRequest) -> tuple[Array, list[int]] | None:
    """The shortest legal polyline (K, 3) [m] and which of its vertices are start, via points and goal, or None."""
    robot, corners = request.robot, request.corners
    lower, upper = bounds(robot)
    if robot.planar:
        lower[2] = upper[2] = corners[0, 2]
    problem = PathProblem(corners, Weights(), lower, upper, obstacles(request.scene, robot), ball(robot))
    rows, anchors = [corners[:1]], [0]
    for a, b in pairwise(corners):
        between = find_route(problem, a, b)
        if isinstance(between, str):
            return None
        rows += [between, b[None]]
        anchors.append(anchors[-1] + len(between) + 1)
    return np.vstack(rows), anchors
