"""Limits on speed: 0 <= v <= v_max, acceleration along the path and across it.

Speeds are only ever lowered and the path is kept. Between two waypoints the acceleration is constant (the time law
of `Trajectory`), so it is (v_{i+1}^2 - v_i^2) / (2 ds_i) along the path; across it, v_i^2 times the curvature.
"""

from __future__ import annotations

import numpy as np

from ovita.paths.trajectory import Array, arc_length


def lower_speeds(
    speeds: Array,
    positions: Array,
    *,
    max_speed: float | None = None,
    max_acceleration: float | None = None,
    max_lateral_acceleration: float | None = None,
) -> Array:
    """The highest speeds (N,) [m/s] below the given ones that obey every limit.

    Args:
        speeds: (N,) [m/s].
        positions: (N, 3) [m].
        max_speed: [m/s], or None.
        max_acceleration: Along the path [m/s^2], or None.
        max_lateral_acceleration: Across the path [m/s^2], or None.
    """
    legal = np.maximum(speeds, 0.0) if (speeds < 0).any() else speeds
    if max_speed is not None:
        legal = np.minimum(legal, max_speed)
    if max_lateral_acceleration is not None:
        bend = curvature(positions)
        cap = np.sqrt(np.divide(max_lateral_acceleration, bend, out=np.full(len(bend), np.inf), where=bend > 0))
        legal = np.minimum(legal, cap)
    if max_acceleration is not None:
        # w_{i+1} <= w_i + 2 a ds is  w_i <= min over j <= i of (w_j + 2 a (s_i - s_j)), and the same backwards.
        gain = 2.0 * max_acceleration * arc_length(positions)
        squares = legal**2
        reachable = gain + np.minimum.accumulate(squares - gain)
        reachable = np.minimum(squares, reachable)
        stoppable = np.minimum.accumulate((reachable + gain)[::-1])[::-1] - gain
        lowered = np.sqrt(np.maximum(np.minimum(reachable, stoppable), 0.0))
        legal = np.where(lowered < legal * (1.0 - 1e-12), lowered, legal)
    return np.asarray(legal)


def curvature(positions: Array) -> Array:
    """Curvature at each waypoint, (N,) [1/m]: that of the circle through it and its two distinct neighbours.

    It is 0 at start and goal; a repeated waypoint has the curvature of the place.
    """
    n = len(positions)
    new = np.concatenate([[True], np.linalg.norm(np.diff(positions, axis=0), axis=1) > 1e-12])
    place = np.cumsum(new) - 1
    p = positions[new]
    bend = np.zeros(len(p))
    if len(p) >= 3:
        a, b, c = p[1:-1] - p[:-2], p[2:] - p[1:-1], p[2:] - p[:-2]
        twice_area = np.linalg.norm(np.cross(a, b), axis=1)
        sides = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1) * np.linalg.norm(c, axis=1)
        turned_back = (sides <= 1e-300) | (((a * b).sum(axis=1) < 0) & (twice_area <= 1e-12))
        bend[1:-1] = np.where(turned_back, np.inf, 2.0 * twice_area / np.maximum(sides, 1e-300))
    return np.asarray(bend[place]) if n else bend
