"""Change how fast the robot moves, by an amount or by a law; the path stays as it is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.geometry import Mask, fractions, runs
from ovita.paths.trajectory import REST, Array, arc_length
from ovita.toolkit import arguments
from ovita.toolkit.arguments import ROUNDING, Place, eased, smoothstep, snapped
from ovita.toolkit.catalogue import operation
from ovita.toolkit.insertion import densified

SPARSE = 0.1
"""Segments of up to this share of the path's length are short enough for any ramp."""

SMALLEST = 0.01
"""Speeds nearer to 0 than this share of the other end's count as that share in an exponential law."""

LOOK = 0.05
"""Fraction of the path's length over which the directions before and behind a waypoint are taken."""

SEGMENTS = 3.0
"""Segments over which they are taken too where that is less, so that a turn is not taken for wider than it is."""

LEAD = 0.1
"""Fraction of the path's length over which the robot slows down before a turn; it takes half to speed up again."""


SOON = 3.0
"""The most time at the mean speed [s] for which it is slower before a turn."""


@operation("Speed", core=True)
def scale_speed(traj: ArrayLike, factor: float, *, where: ArrayLike | None = None, ease: float = 0.0) -> Array:
    """Multiply the speed: 0.5 is half as fast.

    Args:
        factor: >= 0.
        where: Mask (N,), or None for all waypoints, ends included; at its edges the speed jumps from one waypoint to
            the next unless it is eased.
        ease: Length of a soft edge inside the mask as a fraction (0..1) of the path's length.
    """
    rows = arguments.waypoints(traj)
    scale = arguments.number(factor, "factor", low=0.0)
    rise = arguments.number(ease, "ease", low=0.0, high=1.0)
    weights = eased(arguments.mask(where, len(rows)), rows[:, :3], rise)
    rows[:, 3] *= np.where(weights == 1.0, scale, 1.0 + (scale - 1.0) * weights)
    return rows


@operation("Speed")
def shift_speed(traj: ArrayLike, by: float, *, where: ArrayLike | None = None) -> Array:
    """Add so many m/s to the speed (negative: slower), never below 0.

    Waypoints at rest stay at rest, so that starts, stops and dwells survive.

    Args:
        by: [m/s].
    """
    rows = arguments.waypoints(traj)
    moving = arguments.mask(where, len(rows)) & (rows[:, 3] > 0.0)
    rows[moving, 3] = np.maximum(rows[moving, 3] + arguments.number(by, "by"), 0.0)
    return rows


@operation("Speed")
def set_speed(traj: ArrayLike, speed: float, *, where: ArrayLike | None = None) -> Array:
    """Set the speed to so many m/s.

    Waypoints at rest stay at rest, so that starts, stops and dwells survive, unless all that are meant are at rest.

    Args:
        speed: [m/s], >= 0.
    """
    rows = arguments.waypoints(traj)
    chosen = arguments.mask(where, len(rows))
    moving = chosen & (rows[:, 3] > 0.0)
    rows[moving if moving.any() else chosen, 3] = arguments.number(speed, "speed", low=0.0)
    return rows


@operation("Speed")
def set_duration(traj: ArrayLike, seconds: float, *, where: ArrayLike | None = None) -> Array:
    """Take so many seconds for the way, by one factor on its speeds; standing still is on top.

    Args:
        seconds: [s], > 0.
    """
    rows = arguments.waypoints(traj)
    chosen = arguments.mask(where, len(rows))
    now = travel_time(rows, chosen)
    if now == 0.0:
        raise ValueError("that part has no length, so it cannot take so many seconds; choose two waypoints or more")
    rows[chosen, 3] *= now / arguments.positive(seconds, "seconds")
    return rows


def travel_time(rows: Array, part: Mask) -> float:
    """The time that the segments inside a part (N,) of a trajectory (N, 4+) take, standing still left out [s]."""
    ds, total = np.diff(arc_length(rows[:, :3])), rows[:-1, 3] + rows[1:, 3]
    moving = part[:-1] & part[1:] & (ds > 0.0) & (total > REST)
    return float((2.0 * ds[moving] / total[moving]).sum())


@operation("Speed")
def bound_speed(
    traj: ArrayLike, at_most: float | None = None, at_least: float | None = None, *, where: ArrayLike | None = None
) -> Array:
    """Never faster than at_most m/s, never slower than at_least.

    Waypoints at rest stay at rest, so that starts, stops and dwells survive; promise it by expect_speed with the same
    at_most or at_least.

    Args:
        at_most: [m/s], > 0.
        at_least: [m/s], >= 0.
    """
    rows = arguments.waypoints(traj)
    low, high = arguments.bounds(None, at_least, at_most, "", "m/s", 0.0)
    arguments.positive(min(high, 1.0), "at_most")
    moving = arguments.mask(where, len(rows)) & (rows[:, 3] > 0.0)
    rows[moving, 3] = np.clip(rows[moving, 3], low, high)
    return rows


@operation("Speed")
def ramp_speed(
    traj: ArrayLike, start: float | None = None, end: float | None = None, *, where: ArrayLike | None = None
) -> Array:
    """Change speed steadily from start to end in m/s; None keeps that end's speed.

    It is linear along the path, but to or from a standstill by constant acceleration: a linear one would creep.

    Args:
        where: Mask (N,), or None for all waypoints, ends included; at its edges the speed jumps from one waypoint to
            the next. Each unbroken run of it gets its own ramp.
    """
    return _from_to(traj, start, end, where, _steadily)


def _steadily(low: float, high: float, u: Array) -> Array:
    """Speeds (N,) at the fractions u (N,) of the way between two speeds."""
    if min(low, high) == 0.0:
        return np.asarray(np.sqrt(low**2 * (1.0 - u) + high**2 * u))
    return low * (1.0 - u) + high * u


@operation("Speed")
def exponential_speed(
    traj: ArrayLike, start: float | None = None, end: float | None = None, *, where: ArrayLike | None = None
) -> Array:
    """Change speed exponentially from start to end in m/s; None keeps that end's speed.

    The speed is start (end / start)^u at the fraction u of the length; between the ends, an end at less than a
    hundredth of the other's speed counts as that. A dwell stays at rest.

    Args:
        where: Mask (N,), or None for all waypoints, ends included; at its edges the speed jumps from one waypoint to
            the next. Each unbroken run of it gets its own law.
    """

    def law(low: float, high: float, u: Array) -> Array:
        first, final = max(low, SMALLEST * high), max(high, SMALLEST * low)
        between = first * (final / first) ** u if first > 0.0 else np.zeros_like(u)
        return np.where(u == 0.0, low, np.where(u == 1.0, high, between))

    rows = _from_to(traj, start, end, where, law)
    rows[_resting(arguments.waypoints(traj)) & arguments.mask(where, len(rows)), 3] = 0.0
    return rows


@operation("Speed")
def accelerate(traj: ArrayLike, rate: float, *, where: ArrayLike | None = None) -> Array:
    """Accelerate by rate m/s^2 (negative: brake).

    The speed at the distance s is sqrt(v0^2 + 2 rate s), and 0 once that is negative; v0 is the speed at the first
    waypoint, for a negative rate at the first that moves. A dwell stays at rest.

    Args:
        rate: [m/s^2].
        where: Mask (N,), or None for all waypoints, ends included; at its edges the speed jumps from one waypoint to
            the next. Each unbroken run of it starts anew.
    """
    rows = arguments.waypoints(traj)
    gain = arguments.number(rate, "rate")
    resting, s = _resting(rows), arc_length(rows[:, :3])
    if gain == 0.0:
        return rows
    for a, b in runs(arguments.mask(where, len(rows))):
        moving = np.flatnonzero(rows[a : b + 1, 3] > 0.0)
        if gain < 0.0 and not len(moving):
            continue
        begin = a if gain > 0.0 else a + int(moving[0])
        squared = rows[begin, 3] ** 2 + 2.0 * gain * (s[begin : b + 1] - s[begin])
        law = np.sqrt(np.maximum(squared, 0.0))
        rows[begin + 1 : b + 1, 3] = np.where(resting[begin + 1 : b + 1], 0.0, law[1:])
    return rows


@operation("Speed")
def trapezoid_speed(traj: ArrayLike, cruise: float | None = None, *, ramp: float = 0.25) -> Array:
    """From 0 to cruise m/s and back to 0.

    The speed is a trapezoid over time: rise and fall have constant acceleration, so that it is cruise sqrt(s / l) at
    the distance s from an end, with l the length of the ramp. A dwell stays at rest.

    Args:
        traj: (N, 4); where the waypoints are too sparse for the ramps, more are inserted.
        cruise: [m/s], >= 0; None for the highest present speed.
        ramp: Length of the rise and of the fall as a fraction (0..0.5) of the path's length.
    """
    rows = arguments.waypoints(traj)
    top = float(rows[:, 3].max()) if cruise is None else arguments.number(cruise, "cruise", low=0.0)
    share = arguments.number(ramp, "ramp", low=0.0, high=0.5)
    length = float(arc_length(rows[:, :3])[-1])
    if length > 0.0:
        rows, _ = densified(rows, np.ones(len(rows), dtype=bool), max(share, SPARSE) * length)
    fraction = fractions(rows[:, :3])
    left = np.minimum(fraction, 1.0 - fraction)
    law = np.sqrt(snapped(left / share)) if share > ROUNDING else (left > 0.0).astype(np.float64)
    rows[:, 3] = np.where(_resting(rows), 0.0, top * law)
    return rows


@operation("Speed")
def slow_turns(traj: ArrayLike, factor: float = 0.5, *, angle: float = 30.0) -> Array:
    """Slow down before and in turns.

    A waypoint is in a turn if the directions over 5 % of the path's length before it and behind it differ by the angle,
    and those over 3 segments, where that is less, by a third of it. The speed is multiplied by the factor there, and by
    less and less over 10 % of the path before a turn and 5 % after it, but no more than what takes 3 s, or over a third
    and a sixth of the way between two turns.

    Args:
        factor: 0..1.
        angle: [degrees], from 0 to 180.
    """
    rows = arguments.waypoints(traj)
    times = arguments.number(factor, "factor", low=0.0, high=1.0)
    sharp = np.radians(arguments.number(angle, "angle", low=0.0, high=180.0))
    s = arc_length(rows[:, :3])
    if s[-1] == 0.0:
        return rows
    steps = np.diff(s)
    look = float(np.clip(SEGMENTS * np.median(steps[steps > 0.0]), LOOK / 5.0 * s[-1], LOOK * s[-1]))
    wide, close = (_bends(rows[:, :3], s, reach) for reach in (LOOK * s[-1], look))
    turns = s[(wide >= sharp - 1e-9) & (close >= sharp / 3.0 - 1e-9)]
    if not len(turns):
        return rows
    edged = np.concatenate([[-np.inf], turns, [np.inf]])
    ahead = edged[np.searchsorted(edged, s)] - s
    behind = s - edged[np.searchsorted(edged, s, side="right") - 1]
    moving = rows[:, 3] > 0.0
    soon = SOON * float(rows[moving, 3].mean()) if moving.any() else np.inf
    lead = np.minimum(min(LEAD * s[-1], soon), (ahead + behind) / 3.0)
    lead[lead == 0.0] = 1.0
    weights = np.maximum(smoothstep(1.0 - ahead / lead), smoothstep(1.0 - 2.0 * behind / lead))
    rows[:, 3] *= np.where(weights == 1.0, times, 1.0 + (times - 1.0) * weights)
    return rows


@operation("Speed")
def stop_at(traj: ArrayLike, at: Place, *, brake: float = 0.15, resume: bool = False) -> Array:
    """Brake to a stop at a PLACE; the path ends there unless resume=True.

    The speed falls as under constant deceleration, by sqrt(distance left / braking distance).

    Args:
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


@operation("Speed")
def dwell(traj: ArrayLike, at: Place, steps: int = 10, *, in_all: bool = False) -> Array:
    """Wait at a PLACE for so many steps of 0.1 s.

    The waypoint's speed becomes 0 and `steps` exact repeats of it are inserted after it.

    Args:
        traj: (N, 4); the result is (N + steps, 4), less what was there already with in_all.
        steps: Timesteps to wait, >= 1.
        in_all: Count the steps that the path waits there already, which may then be more or fewer than before.
    """
    rows = arguments.waypoints(traj)
    count = arguments.integer(steps, "steps", 1, arguments.MOST_WAYPOINTS)
    i = arguments.locate(rows, at)
    if in_all:
        first, last = stands(rows, i)
        rows, i = np.delete(rows, np.arange(first + 1, last + 1), axis=0), first
    rows[i, 3] = 0.0
    return np.insert(rows, i + 1, np.repeat(rows[i : i + 1], count, axis=0), axis=0)


def stands(rows: Array, i: int) -> tuple[int, int]:
    """The first and the last waypoint of the repeats of one at rest; that one alone where there are none."""
    first, last = next((a, b) for a, b in runs((rows[:, :3] == rows[i, :3]).all(axis=1)) if a <= i <= b)
    return (first, last) if (rows[first : last + 1, 3] <= REST).any() else (i, i)


@operation("Speed")
def keep_moving(traj: ArrayLike, *, where: ArrayLike | None = None) -> Array:
    """Leave out the stops between the ends; the path stays, and repeats of waypoints go.

    The speed runs evenly from where the robot brakes for a stop to where it is fast again.

    Args:
        traj: (N, 4); the result is (M, 4) with M <= N.
    """
    rows = arguments.waypoints(traj)
    inside: Mask = arguments.mask(where, len(rows)).copy()
    inside[[0, -1]] = False
    stays: Mask = ~(inside & np.concatenate([[False], _repeats(rows)]))
    rows, inside = rows[stays], inside[stays]
    speeds, s = rows[:, 3].copy(), arc_length(rows[:, :3])
    for a, b in runs(inside & (speeds <= REST)):
        first, last = _regained(speeds, a, -1), _regained(speeds, b, 1)
        if max(speeds[first], speeds[last]) > REST:
            rows[first : last + 1, 3] = np.interp(s[first : last + 1], s[[first, last]], speeds[[first, last]])
    return rows


def _regained(speeds: Array, i: int, step: int) -> int:
    """Where the speed is fast again, going on from a stop in one direction."""
    while 0 <= i + step < len(speeds) and bool(speeds[i + step] > speeds[i]):
        i += step
    return i


def _from_to(
    traj: ArrayLike,
    start: float | None,
    end: float | None,
    where: ArrayLike | None,
    law: Callable[[float, float, Array], Array],
) -> Array:
    """A trajectory with a law of the end speeds and the share of the length on each run of a mask."""
    rows = arguments.waypoints(traj)
    if start is None and end is None:
        raise ValueError("give start, end or both in m/s")
    begin = None if start is None else arguments.number(start, "start", low=0.0)
    finish = None if end is None else arguments.number(end, "end", low=0.0)
    still = _resting(rows)
    for a, b in runs(arguments.mask(where, len(rows))):
        low = rows[a, 3] if begin is None else begin
        high = rows[b, 3] if finish is None else finish
        share = fractions(rows[a : b + 1, :3]) if b > a else np.full(1, float(begin is None))
        rows[a : b + 1, 3] = np.where(still[a : b + 1], 0.0, law(low, high, share))
    return rows


def _bends(positions: Array, s: Array, look: float) -> Array:
    """Angles (N,) [rad] between the directions over a distance before and behind each waypoint."""
    before, behind = (
        np.column_stack([np.interp(s + step, s, coordinate) for coordinate in positions.T]) for step in (-look, look)
    )
    entering, leaving = positions - before, behind - positions
    across = np.linalg.norm(np.cross(entering, leaving), axis=1)
    return np.asarray(np.arctan2(across, (entering * leaving).sum(axis=1)))


def _resting(rows: Array) -> Mask:
    """Mask of the waypoints of a dwell: at rest, and a repeat of a neighbour."""
    same = _repeats(rows)
    repeat = np.concatenate([[False], same]) | np.concatenate([same, [False]])
    return np.asarray(repeat & (rows[:, 3] == 0.0))


def _repeats(rows: Array) -> Mask:
    """Which waypoints but the first, (N - 1,), are where the one before them is."""
    return np.asarray((np.diff(rows[:, :3], axis=0) == 0.0).all(axis=1))
