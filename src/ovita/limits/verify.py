"""Measuring a trajectory against every limit, independently of how it was found.

This module imports no solver. Each segment is measured twice, exactly (the minimum of a convex function, see
`obstacles`) and by dense sampling with the point distance of `SceneObject`; the worse of the two counts.
Between two waypoints the acceleration is constant (the time law of `Trajectory`), so it is
(v_{i+1}^2 - v_i^2) / (2 ds_i) along the path; across it, v_i^2 times the curvature.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ovita.limits.problem import (
    TOLERANCE,
    ConstraintCheck,
    ConstraintOptions,
    Obstacle,
    Place,
    about_path,
    from_object,
    in_the_way,
    is_support,
    solid_of,
)
from ovita.paths.geometry import crosses, dots, lengths
from ovita.paths.robot import Box, Robot, Shell
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory, arc_length
from ovita.text import called_as


@dataclass(frozen=True)
class Dynamics:
    """Limits on speeds; infinite where there is none.

    Args:
        top: Highest speed [m/s].
        along: Largest acceleration along the path [m/s^2].
        across: Largest acceleration across the path [m/s^2].
        least: Lowest speed while moving [m/s].
    """

    top: float = np.inf
    along: float = np.inf
    across: float = np.inf
    least: float = 0.0


def dynamics(robot: Robot, options: ConstraintOptions, original: Trajectory | None = None) -> Dynamics:
    """The limits of the robot and of the options, whichever is lower.

    An original trajectory may accelerate as hard as it does against the robot's limits, but not against the options'.
    """

    def limit(own: float | None, option: float | None, measure: Callable[[Trajectory], Array]) -> float:
        bound = np.inf if own is None else own
        if original is not None and np.isfinite(bound):
            bound = max(bound, float(measure(original).max(initial=0.0)))
        return bound if option is None else min(bound, option)

    return Dynamics(
        np.inf if robot.max_speed is None else robot.max_speed,
        limit(robot.max_acceleration, options.max_acceleration, accelerations),
        limit(robot.max_lateral_acceleration, options.max_lateral_acceleration, lateral_accelerations),
        robot.min_speed,
    )


def too_slow(trajectory: Trajectory, limits: Dynamics) -> Array:
    """By how much each moving waypoint is slower than the least speed (N,) [m/s].

    Where the acceleration limit leaves less, next to a standstill, that is enough.
    """
    v, s = trajectory.speeds, arc_length(trajectory.positions)
    still = s[v <= 0.0]
    floor = np.full(len(v), limits.least)
    if len(still) and np.isfinite(limits.along):
        after = np.searchsorted(still, s)
        gap = np.minimum(
            np.abs(s - still[np.clip(after - 1, 0, len(still) - 1)]),
            np.abs(still[np.clip(after, 0, len(still) - 1)] - s),
        )
        floor = np.minimum(floor, np.sqrt(2.0 * limits.along * gap) * (1.0 - 1e-9))
    return np.where(v > 0.0, floor - v, -np.inf)


def too_quick(trajectory: Trajectory, limit: float) -> Array:
    """Excess of the faster end's speed of each segment over what the slower end allows (N-1,) [m/s]."""
    if not np.isfinite(limit):
        return np.full(len(trajectory) - 1, -np.inf)
    reachable = 2.0 * limit * np.diff(arc_length(trajectory.positions))
    v = trajectory.speeds
    return np.maximum(v[1:] - np.sqrt(v[:-1] ** 2 + reachable), v[:-1] - np.sqrt(v[1:] ** 2 + reachable))


def too_bent(trajectory: Trajectory, limit: float) -> Array:
    """By how much each waypoint is faster than its bend allows (N,) [m/s]."""
    return np.asarray(trajectory.speeds - bend_speed(trajectory.positions, limit))


def accelerations(trajectory: Trajectory) -> Array:
    """Size of the acceleration along each segment (N-1,) [m/s^2]; infinite for a jump of speed in one place."""
    change = np.abs(np.diff(trajectory.speeds**2))
    twice = 2.0 * np.diff(arc_length(trajectory.positions))
    return np.divide(change, twice, out=np.where(change > 0, np.inf, 0.0), where=twice > 0)


def lateral_accelerations(trajectory: Trajectory) -> Array:
    """Acceleration across the path at each waypoint (N,) [m/s^2]; infinite where a moving path turns on the spot."""
    bend, v = curvature(trajectory.positions), trajectory.speeds
    return np.multiply(bend, v**2, out=np.zeros(len(v)), where=v > 0)


def curvature(positions: Array) -> Array:
    """Curvature at each waypoint, (N,) [1/m]: that of the circle through it and its two distinct neighbours.

    It is 0 at start and goal; a repeated waypoint has the curvature of the place.
    """
    n = len(positions)
    new = np.concatenate([[True], lengths(positions[1:] - positions[:-1]) > 1e-12])
    place = np.cumsum(new) - 1
    p = positions[new]
    bend = np.zeros(len(p))
    if len(p) >= 3:
        a, b, c = p[1:-1] - p[:-2], p[2:] - p[1:-1], p[2:] - p[:-2]
        twice_area = lengths(crosses(a, b))
        sides = lengths(a) * lengths(b) * lengths(c)
        turned_back = (sides <= 1e-300) | ((dots(a, b) < 0) & (twice_area <= 1e-12))
        bend[1:-1] = np.where(turned_back, np.inf, 2.0 * twice_area / np.maximum(sides, 1e-300))
    return np.asarray(bend[place]) if n else bend


def bend_speed(positions: Array, limit: float) -> Array:
    """Highest speed (N,) [m/s] that keeps the acceleration across the path within a limit [m/s^2]."""
    bend = curvature(positions)
    return np.asarray(np.sqrt(np.divide(limit, bend, out=np.full(len(bend), np.inf), where=bend > 0)))


FLAT = 1e-6
"""A path whose heights differ by less than this is horizontal [m]."""

SAMPLES = 20
"""Points per segment of the dense check."""


Worst = tuple[float, int | None]
"""By how much a limit is broken, 0 where it holds, and at which waypoint or segment (i joins waypoints i and i + 1)."""


@dataclass(frozen=True)
class Measure:
    """One limit and how to measure it: by how much each waypoint or segment breaks it (<= 0 where it holds).

    `granted` measures what a change must keep where the original path breaks a standard limit: no worse than that.
    """

    name: str
    subject: str
    limit: str
    unit: str
    place: Place
    excess: Callable[[Trajectory], Array]
    granted: Callable[[Trajectory], Array] | None = None

    @property
    def geometric(self) -> bool:
        """Whether the limit is about the path rather than about speed."""
        return about_path(self.unit)

    def worst(self, trajectory: Trajectory) -> Worst:
        """By how much the limit is broken at its worst, and where."""
        excess = self.excess(trajectory)
        where = int(excess.argmax()) if len(excess) else 0
        return (float(excess[where]), where) if len(excess) and excess[where] > 0 else (0.0, None)

    def excused(self, trajectory: Trajectory) -> bool:
        """Whether a trajectory that breaks the limit does so no worse than the original path."""
        return self.granted is not None and float(self.granted(trajectory).max(initial=0.0)) <= TOLERANCE


@called_as("verify(result, scene, robot, proposed=result, original=before)")
def verify(
    result: Trajectory,
    scene: Scene,
    robot: Robot,
    *,
    proposed: Trajectory,
    original: Trajectory,
    contacts: Sequence[str] = (),
    options: ConstraintOptions | None = None,
) -> tuple[ConstraintCheck, ...]:
    """Measure every limit on result and proposal, and on the original where either violates it.

    Args:
        result: Trajectory to judge.
        scene: Its objects are obstacles.
        robot: Whose limits.
        proposed: The trajectory before the constraint module; pinned waypoints are compared with it.
        original: The trajectory before any change.
        contacts: Objects that are meant to be touched and are no obstacles.
        options: Which limits are asked for.
    """
    measures = measure_all(scene, robot, proposed, original, contacts, options or ConstraintOptions())
    before, after = ([m.worst(t) for m in measures] for t in (proposed, result))
    return compare(measures, original, before, after)


def compare(
    measures: Sequence[Measure], original: Trajectory, before: Sequence[Worst], after: Sequence[Worst]
) -> tuple[ConstraintCheck, ...]:
    """One check per measure, from its violations by proposal and result.

    The original is measured where one of those breaks the limit.
    """
    found = []
    for m, (proposed, before_at), (left, after_at) in zip(measures, before, after, strict=True):
        own = m.worst(original)[0] if max(proposed, left) > 0 else None
        places = before_at, after_at, m.place
        found.append(ConstraintCheck(m.name, m.subject, m.limit, proposed, left, m.unit, *places, own))
    return tuple(found)


def measure_all(
    scene: Scene,
    robot: Robot,
    proposed: Trajectory,
    original: Trajectory,
    contacts: Sequence[str],
    options: ConstraintOptions,
) -> list[Measure]:
    """Every limit that robot, scene and options impose on a trajectory."""
    found: list[Measure] = []
    if robot.workspace is not None:
        text = f"{robot.workspace.describe()}, {robot.margin:g} m from its border"
        found.append(Measure("workspace", "", text, "m", "segment", lambda t: _outside(t.positions, robot)))
    level = plane(robot, original)
    if level is not None:
        text = f"on its plane z = {level:g} m"
        found.append(Measure("plane", "", text, "m", "waypoint", lambda t: np.abs(t.positions[:, 2] - level)))
    if options.obstacles:
        found += [
            _obstacle(item, robot, original, options) for item in in_the_way(scene, robot, contacts, proposed.positions)
        ]
    found += _dynamic(robot, original, options)
    found += [_custom(constraint, proposed) for constraint in options.custom]
    for i in options.pins(len(proposed)):
        start, goal = i == 0 and options.fix_start, i == len(proposed) - 1 and options.fix_goal
        name = "start" if start else "goal" if goal else "pinned"
        place = proposed.positions[i]
        found.append(Measure(name, "", f"waypoint {i + 1} stays", "m", "waypoint", partial(_moved, i, place)))
    return found


def plane(robot: Robot, original: Trajectory) -> float | None:
    """Height z [m] of the plane that a planar robot stays on: that of its original path; None for any other robot."""
    heights = original.positions[:, 2]
    level = float(heights[0])
    if not robot.planar or np.abs(heights - level).max() > FLAT:
        return None
    box = robot.workspace
    if isinstance(box, Box) and not box.lower[2] + robot.margin <= level <= box.upper[2] - robot.margin:
        return None  # the workspace decides
    return level


def _dynamic(robot: Robot, original: Trajectory, options: ConstraintOptions) -> list[Measure]:
    """The limits on speed and acceleration."""
    found: list[Measure] = []
    limits = dynamics(robot, options)
    granted = limits if options.repair_original else dynamics(robot, options, original)
    if robot.max_speed is not None:
        text = f"at most {limits.top:g} m/s"
        found.append(Measure("speed", "", text, "m/s", "waypoint", lambda t: t.speeds - limits.top))
    if limits.least > 0.0:
        text = f"at least {limits.least:g} m/s while moving"
        found.append(Measure("least speed", "", text, "m/s", "waypoint", lambda t: too_slow(t, granted)))
    accelerations: tuple[tuple[str, Place, Callable[..., Array], float, float], ...] = (
        ("acceleration", "segment", too_quick, limits.along, granted.along),
        ("lateral acceleration", "waypoint", too_bent, limits.across, granted.across),
    )
    for name, place, excess, limit, grant in accelerations:
        if np.isfinite(limit):
            excuse = partial(excess, limit=grant) if grant > limit else None
            text = f"at most {limit:g} m/s^2"
            found.append(Measure(name, "", text, "m/s", place, partial(excess, limit=limit), excuse))
    return found


def _custom(constraint: Any, proposed: Trajectory) -> Measure:
    """A constraint of the user's own, see `custom.Constraint`."""
    place: Place = "segment" if len(constraint.margin(proposed)) == len(proposed) - 1 else "waypoint"

    names = constraint.name, "", constraint.limit, constraint.unit
    return Measure(*names, place, lambda t: -np.asarray(constraint.margin(t), dtype=float))


def _outside(positions: Array, robot: Robot) -> Array:
    """Excess of each segment over the workspace (N-1,) [m]: at its ends, and for a shell where it is innermost."""
    assert robot.workspace is not None
    at_ends = robot.margin - robot.workspace.inside(positions)
    worst = np.maximum(at_ends[:-1], at_ends[1:])
    if isinstance(robot.workspace, Shell) and robot.workspace.r_min > 0:
        center = np.asarray(robot.workspace.center)
        a, d = positions[:-1] - center, np.diff(positions, axis=0)
        t = np.clip(-(a * d).sum(axis=1) / np.maximum((d * d).sum(axis=1), 1e-300), 0.0, 1.0)
        nearest = np.linalg.norm(a + t[:, None] * d, axis=1)
        worst = np.maximum(worst, robot.workspace.r_min + robot.margin - nearest)
    return np.asarray(worst)


def _obstacle(item: SceneObject, robot: Robot, original: Trajectory, options: ConstraintOptions) -> Measure:
    path = None if options.repair_original else original.positions
    body = from_object(item, robot, options.obstacle_shape, path, granted=False)
    near = from_object(item, robot, options.obstacle_shape, path)
    distance: Callable[[Array], Array]
    if options.obstacle_shape == "sphere" and not is_support(item):
        distance, what = item.distance, "its bounding sphere"
    else:
        known = solid_of(item, robot) if item.dimensions is not None else replace(item, dimensions=2.0 * body.half)
        distance, what = known.clearance, "its sides, and do not go through its top" if is_support(item) else "it"
    text = f"keep {body.keep:g} m from {what}" + (f" ({body.note})" if body.note else "")
    if robot.radius > 0.0:
        text += f", counted from the path of a body of {robot.radius:g} m radius"
    as_near = distance if np.array_equal(near.half, body.half) else replace(item, dimensions=2.0 * near.half).clearance
    excuse = (lambda t: _too_close(t.positions, near, as_near)) if near.radius < body.radius else None
    return Measure(
        "obstacle", item.name, text, "m", "segment", lambda t: _too_close(t.positions, body, distance), excuse
    )


def _too_close(positions: Array, body: Obstacle, distance: Callable[[Array], Array]) -> Array:
    """Excess of each segment (N-1,) [m]: the exact distance, and the smallest of densely sampled ones."""
    start, end = positions[:-1], positions[1:]
    excess = np.full(len(start), -np.inf)
    near = body.near(start, end, 1e-9)
    if not len(near):
        return excess
    exact, _ = body.along(start[near], end[near])
    t = np.linspace(0.0, 1.0, SAMPLES + 1)[:, None, None]
    points = start[near] + t * (end[near] - start[near])
    sampled = distance(points.reshape(-1, 3)).reshape(SAMPLES + 1, -1).min(axis=0) - body.radius
    excess[near] = -np.minimum(exact, sampled)
    return excess


def _moved(i: int, place: Array, trajectory: Trajectory) -> Array:
    """How far waypoint i is from a place, (N,) [m]; the others may be anywhere."""
    out = np.full(len(trajectory), -np.inf)
    out[i : i + 1] = lengths(trajectory.positions[i : i + 1] - place)
    return out
