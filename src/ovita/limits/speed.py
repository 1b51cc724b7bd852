"""Limits on speed: v_min <= v <= v_max, acceleration along the path and across it.

Speeds below the least one are raised, standstill aside; then speeds are only ever lowered, and the path is kept.
Between two waypoints the acceleration is constant (the time law of `Trajectory`), so it is
(v_{i+1}^2 - v_i^2) / (2 ds_i) along the path; across it, v_i^2 times the curvature.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ovita.limits.problem import ConstraintOptions
from ovita.paths.geometry import crosses, dots, lengths
from ovita.paths.robot import Robot
from ovita.paths.trajectory import Array, Trajectory, arc_length


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


def limit_speeds(speeds: Array, positions: Array, limits: Dynamics) -> Array:
    """The speeds (N,) [m/s] at positions (N, 3) [m], raised to the least one and then lowered to every limit."""
    legal = np.maximum(speeds, 0.0) if (speeds < 0).any() else speeds
    if limits.least > 0.0:
        legal = np.where((legal > 0.0) & (legal < limits.least), limits.least, legal)
    if np.isfinite(limits.top):
        legal = np.minimum(legal, limits.top)
    if np.isfinite(limits.across):
        legal = np.minimum(legal, _bend_speed(positions, limits.across))
    if np.isfinite(limits.along):
        # w_{i+1} <= w_i + 2 a ds is  w_i <= min over j <= i of (w_j + 2 a (s_i - s_j)), and the same backwards.
        gain = 2.0 * limits.along * arc_length(positions)
        squares = legal**2
        reachable = gain + np.minimum.accumulate(squares - gain)
        reachable = np.minimum(squares, reachable)
        stoppable = np.minimum.accumulate((reachable + gain)[::-1])[::-1] - gain
        lowered = np.sqrt(np.maximum(np.minimum(reachable, stoppable), 0.0))
        legal = np.where(lowered < legal * (1.0 - 1e-12), lowered, legal)
    return np.asarray(legal)


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
    return np.asarray(trajectory.speeds - _bend_speed(trajectory.positions, limit))


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


def _bend_speed(positions: Array, limit: float) -> Array:
    """Highest speed (N,) [m/s] that keeps the acceleration across the path within a limit [m/s^2]."""
    bend = curvature(positions)
    return np.asarray(np.sqrt(np.divide(limit, bend, out=np.full(len(bend), np.inf), where=bend > 0)))
