"""Change how fast the robot moves; the path stays as it is."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.trajectory import Array, arc_length
from ovita.toolkit import arguments
from ovita.toolkit.arguments import Place
from ovita.toolkit.shaping import eased, runs, snapped


def scale_speed(traj: ArrayLike, factor: float, *, where: ArrayLike | None = None, ease: float = 0.0) -> Array:
    """Multiply the speed: 0.5 is half as fast.

    Args:
        traj: (N, 4).
        factor: >= 0.
        where: Mask (N,), or None for all waypoints.
        ease: Length of a soft edge inside the mask as a fraction (0..1) of the path's length.
    """
    rows = arguments.waypoints(traj)
    scale = arguments.number(factor, "factor", low=0.0)
    rise = arguments.number(ease, "ease", low=0.0, high=1.0)
    weights = eased(arguments.mask(where, len(rows)), rows[:, :3], rise)
    rows[:, 3] *= np.where(weights == 1.0, scale, 1.0 + (scale - 1.0) * weights)
    return rows


def shift_speed(traj: ArrayLike, by: float, *, where: ArrayLike | None = None) -> Array:
    """Add so many m/s to the speed (negative: slower), never below 0.

    Waypoints at rest stay at rest, so that starts, stops and dwells survive.

    Args:
        traj: (N, 4).
        by: [m/s].
        where: Mask (N,), or None for all waypoints.
    """
    rows = arguments.waypoints(traj)
    moving = arguments.mask(where, len(rows)) & (rows[:, 3] > 0.0)
    rows[moving, 3] = np.maximum(rows[moving, 3] + arguments.number(by, "by"), 0.0)
    return rows


def set_speed(traj: ArrayLike, speed: float, *, where: ArrayLike | None = None) -> Array:
    """Set the speed to so many m/s.

    Args:
        traj: (N, 4).
        speed: [m/s], >= 0.
        where: Mask (N,), or None for all waypoints.
    """
    rows = arguments.waypoints(traj)
    rows[arguments.mask(where, len(rows)), 3] = arguments.number(speed, "speed", low=0.0)
    return rows


def ramp_speed(
    traj: ArrayLike, start: float | None = None, end: float | None = None, *, where: ArrayLike | None = None
) -> Array:
    """Change speed steadily from start to end in m/s; None keeps that end's speed.

    Args:
        traj: (N, 4).
        start: [m/s], >= 0, or None for the present speed at the first selected waypoint.
        end: [m/s], >= 0, or None for the present speed at the last selected waypoint.
        where: Mask (N,), or None for all waypoints; each unbroken run of it gets its own ramp.
    """
    rows = arguments.waypoints(traj)
    if start is None and end is None:
        raise ValueError("give start, end or both in m/s")
    begin = None if start is None else arguments.number(start, "start", low=0.0)
    finish = None if end is None else arguments.number(end, "end", low=0.0)
    for a, b in runs(arguments.mask(where, len(rows))):
        low = rows[a, 3] if begin is None else begin
        high = rows[b, 3] if finish is None else finish
        share = arguments.fractions(rows[a : b + 1, :3]) if b > a else np.full(1, float(begin is None))
        rows[a : b + 1, 3] = low * (1.0 - share) + high * share
    return rows


def stop_at(traj: ArrayLike, at: Place, *, brake: float = 0.15, resume: bool = False) -> Array:
    """Brake to a stop at a PLACE; the path ends there unless resume=True.

    The speed falls as under constant deceleration, by sqrt(distance left / braking distance).

    Args:
        traj: (N, 4).
        at: The place of a waypoint; an object or point (3,) [m] means the waypoint nearest to it.
        brake: Braking distance as a fraction (0..1) of the path's length.
        resume: Speed up again in the same way after the stop.
    """
    rows = arguments.waypoints(traj)
    share = arguments.number(brake, "brake", low=0.0, high=1.0)
    i = arguments.locate(rows, at)
    if not resume:
        i = max(i, 1)
    s = arc_length(rows[:, :3])
    gap = np.abs(s - s[i])
    span = share * s[-1]
    left = snapped(gap / span) if span > 0 else np.ones_like(gap)
    rows[:, 3] *= np.sqrt(left)
    rows[i, 3] = 0.0
    return rows if resume else rows[: i + 1].copy()


def dwell(traj: ArrayLike, at: Place, steps: int = 10) -> Array:
    """Wait at a PLACE for so many steps of 0.1 s.

    The waypoint's speed becomes 0 and `steps` exact repeats of it are inserted after it.

    Args:
        traj: (N, 4); the result is (N + steps, 4).
        at: The place of a waypoint; an object or point (3,) [m] means the waypoint nearest to it.
        steps: Timesteps to wait, >= 1.
    """
    rows = arguments.waypoints(traj)
    count = arguments.integer(steps, "steps", 1, arguments.MOST_WAYPOINTS)
    i = arguments.locate(rows, at)
    rows[i, 3] = 0.0
    return np.insert(rows, i + 1, np.repeat(rows[i : i + 1], count, axis=0), axis=0)
