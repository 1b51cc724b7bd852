"""Let a path swing from side to side, or shake it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.scene import RFU, Frame
from ovita.paths.trajectory import Array, arc_length
from ovita.toolkit import arguments
from ovita.toolkit.arguments import Mask
from ovita.toolkit.courses import course_headings, densified, distinct, positive
from ovita.toolkit.shaping import perpendicular, runs

MOST_WAVES = 500.0
"""The most waves that one call may ask for."""

PER_ZIGZAG = 4.0
"""The fewest segments on one wave of a zigzag: enough for a waypoint of its own at every corner."""

PER_SINUSOID = 8.0
"""The fewest segments on one wave of a sinusoid."""


def zigzag(
    traj: ArrayLike,
    amplitude: float,
    *,
    waves: float = 6.0,
    where: ArrayLike | None = None,
    direction: str | None = None,
    frame: Frame = RFU,
) -> Array:
    """Zigzag sideways, or along a direction word.

    The displacement is a triangle wave over the path's length, level and perpendicular to the heading, to the right
    first; its corners are at waypoints.

    Args:
        traj: (N, 4); where the waypoints are too sparse for the waves, more are inserted.
        amplitude: [m], >= 0, to either side.
        waves: Number of whole waves, > 0, on each unbroken run of the mask; its ends stay if this is a multiple of
            one half.
        where: Mask (N,), or None for all waypoints; the others stay as they are.
        direction: A direction word, such as "up" to go up first and then down; None for sideways.
        frame: Which way is left.
    """
    return _rippled(traj, amplitude, waves, where, direction, frame, _triangle, PER_ZIGZAG)


def wave(
    traj: ArrayLike,
    amplitude: float,
    *,
    waves: float = 4.0,
    where: ArrayLike | None = None,
    direction: str | None = None,
    frame: Frame = RFU,
) -> Array:
    """Swing sideways, or along a direction word, in a sine.

    Args:
        traj: (N, 4); where the waypoints are too sparse for the waves, more are inserted.
        amplitude: [m], >= 0, to either side.
        waves: Number of whole waves, > 0, on each unbroken run of the mask; its ends stay if this is a multiple of
            one half.
        where: Mask (N,), or None for all waypoints; the others stay as they are.
        direction: A direction word, such as "up" to go up first and then down; None for sideways.
        frame: Which way is left.
    """
    return _rippled(traj, amplitude, waves, where, direction, frame, np.sin, PER_SINUSOID)


def noise(traj: ArrayLike, amount: float, *, seed: int = 0, where: ArrayLike | None = None) -> Array:
    """Shake by up to amount metres.

    The displacements are uniform in a ball; the same seed shakes in the same directions, whatever the amount.

    Args:
        traj: (N, 4).
        amount: [m], >= 0.
        seed: Of the random numbers, >= 0.
        where: Mask (N,), or None for all waypoints, start and goal included.
    """
    rows = arguments.waypoints(traj)
    radius = arguments.number(amount, "amount", low=0.0)
    selected = arguments.mask(where, len(rows)) & (radius > 0.0)
    random = np.random.default_rng(arguments.integer(seed, "seed", 0, 2**31 - 1))
    away = random.normal(size=(len(rows), 3))
    away *= (np.cbrt(random.uniform(size=len(rows))) / np.maximum(np.linalg.norm(away, axis=1), 1e-12))[:, None]
    # Each repeat of a waypoint is shaken as the first, so that a dwell stays a dwell.
    away = away[distinct(rows)][np.cumsum(distinct(rows)) - 1]
    rows[selected, :3] += radius * away[selected]
    return rows


def _rippled(
    traj: ArrayLike,
    amplitude: float,
    waves: float,
    where: ArrayLike | None,
    direction: str | None,
    frame: Frame,
    shape: Callable[[Array], Array],
    per_wave: float,
) -> Array:
    rows = arguments.waypoints(traj)
    swing = arguments.number(amplitude, "amplitude", low=0.0)
    count = positive(waves, "waves", MOST_WAVES)
    selected = arguments.mask(where, len(rows))
    axis = None if direction is None else arguments.direction(frame, direction)
    if swing == 0.0:
        return rows
    rows, stretches = _dense(rows, selected, per_wave * count)
    if axis is None:
        sideways = perpendicular(course_headings(rows)) * frame.direction("up")[2]
    else:
        sideways = np.tile(axis, (len(rows), 1))
    for stretch in stretches:
        offset = swing * shape(_phase(rows[stretch], count))
        touched = np.abs(offset) > 1e-9 * swing
        rows[stretch, :3][touched] += (offset[:, None] * sideways[stretch])[touched]
    return rows


def _dense(rows: Array, selected: Mask, segments: float) -> tuple[Array, list[slice]]:
    """Rows in which each run of a mask that has a length has so many segments at least, and where these runs are."""
    parts, stretches, done, total = [], [], 0, 0
    for a, b in runs(selected):
        length = float(arc_length(rows[a : b + 1, :3])[-1])
        if length > 0.0:
            part, _ = densified(rows[a : b + 1], np.ones(b + 1 - a, dtype=bool), length / segments)
            begin = total + a - done
            stretches.append(slice(begin, begin + len(part)))
            parts += [rows[done:a], part]
            done, total = b + 1, begin + len(part)
            if total - done > arguments.MOST_WAYPOINTS:
                raise ValueError(f"this would need more than {arguments.MOST_WAYPOINTS} new waypoints; ask for less")
    return np.concatenate([*parts, rows[done:]]), stretches


def _phase(part: Array, waves: float) -> Array:
    """Phase (M,) along a stretch from 0 to 2 pi waves, stretched a little so that each crest is at a waypoint."""
    s = arc_length(part[:, :3])
    crests = np.arange(0.5, 2.0 * waves, 1.0) * np.pi
    wanted = crests / (2.0 * np.pi * waves) * s[-1]
    after = np.clip(np.searchsorted(s, wanted), 1, len(s) - 1)
    nearest = np.where(wanted - s[after - 1] <= s[after] - wanted, s[after - 1], s[after])
    inner = (nearest > 0.0) & (nearest < s[-1]) & (np.diff(nearest, prepend=-1.0) > 0.0)
    knots = np.concatenate([[0.0], nearest[inner], [s[-1]]])
    return np.asarray(np.interp(s, knots, np.concatenate([[0.0], crests[inner], [2.0 * np.pi * waves]])))


def _triangle(phase: Array) -> Array:
    """The triangle wave with the zeros and the crests of the sine."""
    turn = phase / (2.0 * np.pi) + 0.25
    return np.asarray(1.0 - 4.0 * np.abs(turn - np.floor(turn) - 0.5))
