"""Recorded positions as a trajectory: noise smoothed, standing still found, and no more waypoints than it takes.

The method, for N samples at times t (on an even grid, onto which they are interpolated):

1. The noise is the median magnitude of the third differences over 0.6745 sqrt(20): a motion that is sampled often
   enough has hardly any of its own.
2. The robot stands still where the slope of a straight line is below the larger of 4 standard errors and 3 % of the
   recording's usual speed, for 0.3 s at least. The line spans 0.4 s, up to 2 s where the noise would hide the motion.
   It has stood until the time, and starts with the power of time (1 to 3), that explain what follows best, and stands
   at the mean of those samples.
3. Between, positions and velocities are those of cubics fitted to a moving window (Savitzky and Golay 1964). The window
   is the widest of a fixed list whose expected squared error, Mallows's C_p, is within a tenth of the least.
4. Kept are the samples without which the polyline would be off by the noise (at least 1 mm), or the speed between two,
   which changes evenly in time, by 1 % of the highest; and one for each hundredth of the length. They are moved along
   the path to where their speeds bring the robot by then, so that each is passed in time.
5. The first and last position stay as they were recorded.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ovita.errors import TrajectoryError
from ovita.paths.geometry import Mask, runs
from ovita.paths.trajectory import TIMESTEP, Array, Trajectory, arc_length, interpolate

FEWEST = 30
"""Samples below which nothing is smoothed: there is too little to tell noise from motion."""

_WINDOWS = (5, 7, 9, 11, 15, 19, 25, 31, 41, 51, 65, 81, 101)
_SLACK = 0.1
_STILL_OVER, _STILL_FOR = (0.4, 0.6, 0.9, 1.4, 2.0), 0.3
_STILL_SHARE = 0.03
_LONGEST_DWELL = 200
_FINEST = 0.001
_SPEED_SHARE = 0.01
_SPANS = 100
_SLOWEST = 0.02
_PASSES = 8


@dataclass(frozen=True, eq=False)
class Smoothed:
    """A recording as a trajectory.

    Args:
        noise: Standard deviation of the recorded coordinates [m].
        off: Largest distance between the smoothed samples and the waypoints' polyline [m].
        still: How long the robot stands, each time [s].
    """

    trajectory: Trajectory
    noise: float
    off: float
    still: tuple[float, ...]


def noise_of(positions: Array) -> float:
    """Standard deviation of the coordinates (N, 3) about a smooth motion [m]; 0 for too few."""
    if len(positions) < FEWEST:
        return 0.0
    return float(np.sqrt((np.median(np.abs(np.diff(positions, 3, axis=0)), axis=0) ** 2).mean() / 20.0) / 0.6745)


def smoothed(times: Array, positions: Array, turns: Array | None = None) -> Smoothed:
    """A recorded motion as a trajectory, by the method above.

    Times (N,) [s] increase strictly, N >= `FEWEST`; positions are (N, 3) [m], turns unit quaternions (N, 4) wxyz.

    Raises:
        TrajectoryError: If it does not move.
    """
    step = float(np.median(np.diff(times)))
    count = max(round(float(times[-1] - times[0]) / step) + 1, FEWEST)
    grid = np.linspace(times[0], times[-1], count)
    step = float(grid[1] - grid[0])
    even = np.column_stack([np.interp(grid, times, column) for column in positions.T])
    noise = max(noise_of(positions), noise_of(even))  # of the stamps, too
    if float(np.ptp(even, axis=0).max()) <= max(8.0 * noise, 1e-9):
        raise TrajectoryError(f"stands still: it moves by no more than its noise of {noise * 1e3:.2g} mm", key="poses")
    still = _still(even, step, noise)
    if still.all():
        problem = f"moves too little or too slowly to be told from its noise of {noise * 1e3:.2g} mm"
        raise TrajectoryError(problem, key="poses")
    pieces = list(_pieces(even, still, step, noise))
    pieces[0].places[0], pieces[-1].places[-1] = positions[0], positions[-1]
    return _assembled(pieces, grid, step, noise, _mean_turns(times, turns, grid))


@dataclass(eq=False)
class _Piece:
    """A stretch of samples: where it begins, its positions (M, 3) and speeds (M,); at rest, one place that is held."""

    first: int
    places: Array
    speeds: Array
    rest: bool


def _slopes(values: Array, half: int, step: float) -> Array:
    """Slopes (N, 3) of straight lines over 2 half + 1 samples, fewer at the ends."""
    at = np.arange(len(values))
    first, end = np.maximum(at - half, 0), np.minimum(at + half + 1, len(values))
    n = (end - first).astype(float)[:, None]
    centred = values - values.mean(axis=0)
    moment = np.vstack([np.zeros(3), np.cumsum(centred * at[:, None], axis=0)])
    total = np.vstack([np.zeros(3), np.cumsum(centred, axis=0)])
    middle = ((first + end - 1) / 2.0)[:, None]
    return np.asarray(
        (moment[end] - moment[first] - middle * (total[end] - total[first])) / (n * (n * n - 1) / 12) / step
    )


def _still(even: Array, step: float, noise: float) -> Mask:
    """Which samples (N,) stand still."""
    for over in _STILL_OVER:  # longer where the noise would hide the motion
        half = max(round(over / step / 2), 1)
        speeds = np.linalg.norm(_slopes(even, half, step), axis=1)
        error = noise * np.sqrt(12.0 / (2 * half + 1) ** 3) / step
        usual = float(np.median(speeds[speeds >= np.median(speeds)]))
        if 12.0 * error <= usual:
            break
    still = speeds < max(4.0 * error, _STILL_SHARE * usual)
    for (_, first), (end, _) in pairwise(_stretches(still)):
        apart = even[max(first - half, 0) : first].mean(axis=0) - even[end : end + half].mean(axis=0)
        still[first:end] |= bool((end - first) * step < _STILL_FOR and np.linalg.norm(apart) < 2.0 * noise)
    for first, end in _stretches(still):
        if (end - first) * step < _STILL_FOR:
            still[first:end] = False
            continue
        # The line over the edge of a standstill slopes already, that of a gentle start hardly.
        middle, reach = (first + end) // 2, 2 * half
        begin = middle - _start(even[max(first - reach, 0) : middle + 1][::-1], noise) if first else 0
        stop = middle + _start(even[middle : end + reach], noise) + 1 if end < len(even) else end
        still[first:end] = False
        if (stop - begin) * step >= _STILL_FOR / 2.0:
            still[begin:stop] = True
    return np.asarray(still)


def _start(values: Array, noise: float) -> int:
    """The last of some samples (K, 3) at which what stands at first has not begun to move, by a power of time."""
    since = np.maximum(np.arange(len(values)) - np.arange(max(len(values) - 3, 1))[:, None], 0.0)
    best, found = 25.0 * noise**2, len(values) - 1
    place = values[: len(values) // 3 + 1].mean(axis=0)
    for power in (1, 2, 3):
        shape = since**power
        explained = ((shape @ (values - place)) ** 2).sum(axis=1) / (shape**2).sum(axis=1)
        if explained.max() > best:
            best, found = float(explained.max()), int(np.argmax(explained))
    return found


def _stretches(mask: Mask) -> list[tuple[int, int]]:
    return [(first, last + 1) for first, last in runs(mask)]


def _pieces(even: Array, still: Mask, step: float, noise: float) -> Iterator[_Piece]:
    """Motions and standstills in turn; a motion begins and ends where the robot stands before and after it."""
    rests = {(a, b): even[a:b].mean(axis=0) for a, b in _stretches(still)}
    before, behind = ({span[side]: place for span, place in rests.items()} for side in (1, 0))
    for first, end in sorted([*rests, *_stretches(~still)]):
        if (first, end) in rests:
            yield _Piece(first, np.tile(rests[first, end], (end - first, 1)), np.zeros(end - first), True)
            continue
        start = max(first - 1, 0)
        values = even[start : end + 1].copy()
        ends = [(side, place) for side, place in ((0, before.get(first)), (-1, behind.get(end))) if place is not None]
        for side, place in ends:
            values[side] = place
        smooth, velocity = _fitted(values, step, noise)
        speeds = np.linalg.norm(velocity, axis=1)
        for side, place in ends:
            smooth[side], speeds[side] = place, 0.0
        yield _Piece(start, smooth, speeds, False)


def _fitted(values: Array, step: float, noise: float) -> tuple[Array, Array]:
    """Positions and velocities (M, 3) of cubics in a moving window, as wide as the motion allows."""
    from scipy.signal import savgol_coeffs, savgol_filter

    noise = max(noise, noise_of(values))  # a recording that mostly stands hardly shows the noise of its stamps
    widths = [width for width in _WINDOWS if width <= len(values)]
    if len(values) < 3:
        return values, np.tile((values[-1] - values[0]) / (step * max(len(values) - 1, 1)), (len(values), 1))
    if not widths or noise <= 0.0:
        return values, np.gradient(values, step, axis=0)
    risks = []
    for width in widths:
        residual = values - savgol_filter(values, width, 3, axis=0)
        own = float(savgol_coeffs(width, 3)[width // 2])
        inner = residual[width // 2 : len(values) - width // 2] if len(values) > 2 * width else residual
        risks.append(float((inner**2).mean()) / noise**2 + 2.0 * own)
    best = int(np.argmin(risks))
    width = max(w for w, risk in zip(widths, risks, strict=True) if risk <= risks[best] + _SLACK * 2.25 / widths[best])
    return (
        np.asarray(savgol_filter(values, width, 3, axis=0)),
        np.asarray(savgol_filter(values, width, 3, deriv=1, delta=step, axis=0)),
    )


def _kept(places: Array, speeds: Array, near: float, apart: float) -> tuple[NDArray[np.intp], float]:
    """Indices without which the polyline or the speeds would be off, at least one a stretch, and how far off it is."""
    off = 0.0
    speed_off = _SPEED_SHARE * max(float(speeds.max()), 1e-12)
    keep = np.zeros(len(places), dtype=bool)
    keep[[0, -1]] = True
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    stack = [(0, len(places) - 1)]
    while stack:
        a, b = stack.pop()
        if b - a < 2:
            continue
        inner = slice(a + 1, b)
        share = np.arange(1, b - a) / (b - a)
        chord = places[b] - places[a]
        length = float(chord @ chord)
        rel = places[inner] - places[a]
        on = np.clip(rel @ chord / length, 0.0, 1.0)[:, None] if length > 0 else np.zeros((b - a - 1, 1))
        away = np.linalg.norm(rel - on * chord, axis=1) / near
        uneven = np.abs(speeds[inner] - (speeds[a] + share * (speeds[b] - speeds[a]))) / speed_off
        worst = np.maximum(away, uneven)
        split = int(np.argmax(worst))
        if worst[split] <= 1.0:
            if along[b] - along[a] <= apart:
                off = max(off, float(away.max()) * near)
                continue
            split = int(np.argmin(np.abs(along[inner] - (along[a] + along[b]) / 2)))
        keep[a + 1 + split] = True
        stack += [(a, a + 1 + split), (a + 1 + split, b)]
    return np.flatnonzero(keep), off


def _assembled(pieces: list[_Piece], grid: Array, step: float, noise: float, turns: Array | None) -> Smoothed:
    """The waypoints of all pieces; a dwell is as many of them as fit its time."""
    total = sum(float(arc_length(piece.places)[-1]) for piece in pieces)
    rests = tuple((len(piece.places) - 1) * step for piece in pieces if piece.rest)
    timestep, off = _timestep(np.array(rests)), 0.0
    rows: list[Array] = []
    for piece in pieces:
        if piece.rest:
            count = max(round((len(piece.places) - 1) * step / timestep), 1) + (not rows)
            place = piece.places[0 if piece is pieces[0] else -1]
            middle = piece.first + len(piece.places) // 2
            rows.append(np.column_stack([np.tile([*place, 0.0], (count, 1)), np.full(count, middle)]))
        else:
            at, places, speeds, away = _thinned(piece, step, noise, total)
            off = max(off, away)
            rows.append(np.column_stack([places, speeds, piece.first + at])[bool(rows) :])
    table = np.concatenate(rows)
    index = np.clip(table[:, 4].astype(int), 0, len(grid) - 1)
    built = Trajectory(table[:, :3], table[:, 3], None if turns is None else turns[index], timestep)
    return Smoothed(built, noise, off, rests)


def _timestep(rests: Array) -> float:
    """The longest timestep, a part of the shortest rest, that fits all rests (K,) [s] within half a sample's time."""
    if not len(rests):
        return TIMESTEP
    least = max(rests.max() / _LONGEST_DWELL, 0.01)
    parts = np.arange(max(np.ceil(rests.min() / TIMESTEP), 1), max(np.floor(rests.min() / least), 1) + 1)
    steps = rests.min() / (parts if len(parts) else np.ones(1))
    off = np.abs(np.round(rests / steps[:, None]) * steps[:, None] - rests).max(axis=1)
    return float(steps[int(np.argmax(off <= max(0.01, off.min())))])


def _thinned(piece: _Piece, step: float, noise: float, total: float) -> tuple[NDArray[np.intp], Array, Array, float]:
    """What is kept of a motion: indices, places (K, 3), speeds (K,), and how far the polyline is off [m].

    The recording is `total` [m] long. Waypoints go along the path to where their speeds bring the robot by then, so
    that each is passed in time.
    """
    at, off = _kept(piece.places, piece.speeds, max(noise, _FINEST), total / _SPANS)
    dt = np.diff(at) * step
    places = piece.places[at]
    along = arc_length(places)
    speeds = np.maximum(piece.speeds[at], _SLOWEST * (float(piece.speeds.max()) or along[-1] / dt.sum()))
    for side in (0, -1):
        if len(at) > 2 and piece.speeds[side] == 0.0:
            speeds[side] = 0.0
    due = np.concatenate([[0.0], np.cumsum((speeds[1:] + speeds[:-1]) / 2.0 * dt)])
    for _ in range(_PASSES):  # each cuts corners of the polyline a little
        along = arc_length(places)
        places = interpolate(places, np.interp(due * (along[-1] / due[-1]), along, np.arange(len(along))))
    places[[0, -1]] = piece.places[[0, -1]]
    return at, places, speeds * (arc_length(places)[-1] / due[-1]), off


def _mean_turns(times: Array, turns: Array | None, grid: Array) -> Array | None:
    """Orientations (M, 4) on the grid: the mean over three samples, each quaternion with the sign of its neighbours."""
    if turns is None:
        return None
    signs = np.cumprod(np.where((turns[1:] * turns[:-1]).sum(axis=1) < 0, -1.0, 1.0))
    steady = turns * np.concatenate([[1.0], signs])[:, None]
    even = np.column_stack([np.interp(grid, times, column) for column in steady.T])
    padded = np.vstack([even[:1], even, even[-1:]])
    mean = padded[:-2] + padded[1:-1] + padded[2:]
    return np.asarray(mean / np.linalg.norm(mean, axis=1, keepdims=True))
