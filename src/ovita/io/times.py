"""Speeds from times: the time law of a trajectory, read backwards."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ovita.errors import TrajectoryError
from ovita.io.documents import LARGEST
from ovita.paths.trajectory import TIMESTEP, Array, Trajectory

SMOOTHNESS = 0.02
"""Weight of the speeds' second differences against the fit of the times; 1/64 passes alternating noise unamplified."""

Mask = NDArray[np.bool_]

TOLERANCE = 0.05
"""Relative error of a segment's duration from which on it is remarked."""

_ROUNDS = 50


def speeds_from_times(positions: Array, times: Array, key: str = "t") -> tuple[Array, float, tuple[str, ...]]:
    """Find speeds with which a trajectory reaches its waypoints at given times.

    Times that came from a trajectory give its speeds back, see `timelaw.chained_speeds`. For others the time law
    v_i + v_i+1 = 2 ds_i / dt_i, a chain, would turn noise into oscillation. So their speeds minimise

        sum_i ((v_i + v_i+1) / 2 - m_i)^2 / m_i^2  +  SMOOTHNESS * sum_i (v_i-1 - 2 v_i + v_i+1)^2 / max(m)^2

    with the mean speeds m_i = ds_i / dt_i and v >= 0, and are then scaled so that the time spent moving is met
    exactly. A repeated position is a dwell: its speed is 0.

    Args:
        positions: (N, 3) [m].
        times: (N,) [s], strictly increasing.
        key: What a message calls the times.

    Returns:
        The speeds (N,) [m/s], the duration of one dwell waypoint [s] (the mean one; the default timestep if there
        is no dwell), and remarks on what could not be met.

    Raises:
        TrajectoryError: If a time does not increase or asks for an impossible speed; names the waypoint.
    """
    dt = np.diff(times)
    if (dt <= 0).any():
        i = int(np.argmax(dt <= 0)) + 1
        problem = f"is at {times[i]:.9g} s, not after the {times[i - 1]:.9g} s before it; times must increase strictly"
        raise TrajectoryError(problem, key=key, index=i)
    ds = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    with np.errstate(over="ignore"):
        mean = ds / dt
    if (mean > LARGEST).any():
        i = int(np.argmax(mean > LARGEST)) + 1
        raise TrajectoryError(f"moves {ds[i - 1]:g} m in {dt[i - 1]:g} s; check the times", key=key, index=i)
    moving = ds > 0
    dwells = dt[~moving]
    timestep = float(dwells.mean()) if len(dwells) else TIMESTEP
    uneven = bool(len(dwells)) and float(np.abs(dwells - timestep).max()) > 0.01 * timestep
    remarks = [f"the dwells differ in length; each now lasts their mean, {timestep:.3g} s"] if uneven else []
    if not moving.any():
        return np.zeros(len(positions)), timestep, tuple(remarks)
    rest = np.concatenate([[not moving[0]], ~moving])
    speeds = _rescued(_fit(mean, moving, rest), mean, moving)
    chained = chained_speeds(ds, dt)
    if chained is not None and no_rougher(chained, speeds):
        return chained, timestep, tuple(remarks)
    spent = 2.0 * ds[moving] / (speeds[:-1] + speeds[1:])[moving]
    factor = float(spent.sum() / dt[moving].sum())
    error = float(np.abs(spent / factor / dt[moving] - 1.0).max())
    if error > TOLERANCE:
        remarks.append(f"the times are too uneven for smooth speeds; single segments are off by up to {error:.0%}")
    return speeds * factor, timestep, tuple(remarks)


def _fit(mean: Array, moving: Mask, rest: Mask) -> Array:
    """Minimise the sum above with v = 0 where `rest`; negative speeds are set to 0 and the others solved again."""
    # scipy.linalg takes longer to import than a file to read, and only files with times need it.
    from scipy.linalg import solveh_banded

    n, top = len(rest), float(mean.max())
    weight = np.where(moving, 0.25 / np.maximum(mean / top, 0.02) ** 2, 0.0)
    bands = np.zeros((3, n))
    bands[0, :-1] += weight
    bands[0, 1:] += weight
    bands[1, :-1] += weight
    smooth = SMOOTHNESS * (moving[:-1] & moving[1:])
    bands[0, :-2] += smooth
    bands[0, 1:-1] += 4.0 * smooth
    bands[0, 2:] += smooth
    bands[1, : n - 2] += -2.0 * smooth
    bands[1, 1 : n - 1] += -2.0 * smooth
    bands[2, : n - 2] += smooth
    bands[0] += 1e-12
    target = np.zeros(n)
    target[:-1] += 2.0 * weight * mean / top
    target[1:] += 2.0 * weight * mean / top
    fixed = rest.copy()
    speeds = np.zeros(n)
    for _ in range(_ROUNDS):
        speeds = solveh_banded(_without(bands, fixed), np.where(fixed, 0.0, target), lower=True)
        negative = (speeds < 0) & ~fixed
        if not negative.any():
            break
        fixed |= negative
    return np.asarray(np.where(fixed, 0.0, np.maximum(speeds, 0.0)) * top)


def _without(bands: Array, fixed: Mask) -> Array:
    """The banded matrix with the rows and columns of fixed unknowns replaced by those of the identity."""
    free = ~fixed
    reduced = bands.copy()
    reduced[0] = np.where(fixed, 1.0, bands[0])
    for k in (1, 2):
        reduced[k, :-k] = np.where(free[:-k] & free[k:], bands[k, :-k], 0.0)
    return reduced


def _rescued(speeds: Array, mean: Array, moving: Mask) -> Array:
    """Give segments that move, but ended up with no speed at either end, their mean speed at both."""
    stuck = np.flatnonzero(moving & (speeds[:-1] + speeds[1:] < 1e-3 * mean))
    speeds = speeds.copy()
    for i in stuck:
        speeds[i + 1] = max(speeds[i + 1], 2.0 * mean[i])
    return speeds


_ROUGHER = 1.7
_GRAIN = 1e-4


def chained_speeds(ds: Array, dt: Array) -> Array | None:
    """Speeds (N,) [m/s] that give segments (N-1,) [m] exactly their durations (N-1,) [s], or None.

    The law dt = 2 ds / (v_i + v_i+1) is a chain v_i+1 = 2 ds/dt - v_i with one free value c, so that all solutions
    are v_i = u_i + (-1)^i c. A dwell (ds = 0) sets the speed after it to 0 and so fixes c there; elsewhere c is the
    one for which the second differences have the smallest sum of magnitudes, their median: it is the exact one
    where the speeds are linear over most waypoints. Times that came from somewhere else make the chain oscillate; if
    its speeds turn negative, the answer is None.
    """
    moving = ds > 0
    speeds = np.zeros(len(ds) + 1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], moving, [False]]).astype(int)))
    for first, end in zip(edges[::2], edges[1::2], strict=True):
        chain = _chain(ds[first:end] / dt[first:end], free=first == 0)
        if chain is None:
            return None
        speeds[first : end + 1] = chain
    return speeds


def no_rougher(chained: Array, fitted: Array) -> bool:
    """Whether speeds (N,) that meet their times exactly are hardly rougher than speeds (N,) that only fit them.

    So they are for times that came from the time law, where the fit rounds corners off; the noise of a clock makes the
    chain oscillate, twice as rough for 10 waypoints and ever more for longer paths.
    """
    rough, smooth = (float(np.abs(np.diff(speeds, 2)).sum()) for speeds in (chained, fitted))
    return rough <= _ROUGHER * smooth + _GRAIN * float(chained.max()) * len(chained)


def timed(trajectory: Trajectory) -> tuple[Trajectory, Array, tuple[str, ...]]:
    """A trajectory, the times (N,) [s] of its waypoints, which increase strictly, and remarks.

    A waypoint that repeats the one before it while moving takes no time, and is left out.
    """
    durations = trajectory.durations
    keep = np.concatenate([[True], durations > 0])
    if keep.all():
        return trajectory, trajectory.times, ()
    if keep.sum() < 2:
        keep[-1] = True
    turns = trajectory.orientations
    kept = Trajectory(
        trajectory.positions[keep], trajectory.speeds[keep], None if turns is None else turns[keep], trajectory.timestep
    )
    left = f"left out {int((~keep).sum())} of {len(keep)} waypoints, which repeat the one before and take no time"
    return kept, kept.times, (left,)


def _chain(mean: Array, free: bool) -> Array | None:
    """Speeds (n+1,) of neighbouring segments with mean speeds (n,); `free` if the first speed is not known to be 0."""
    scale = float(mean.max())
    signs = np.where(np.arange(len(mean) + 1) % 2 == 0, 1.0, -1.0)
    speeds = signs * np.concatenate([[0.0], np.cumsum(-signs[:-1] * 2.0 * mean)])
    if free:
        best = _straightest(np.diff(speeds, 2), signs[:-2], scale) if len(mean) > 1 else float(mean[0])
        lowest, highest = float((-speeds[::2]).max()), float(speeds[1::2].min())
        speeds = speeds + signs * min(max(best, lowest), highest)
    if (speeds < -1e-6 * scale).any():
        return None
    return np.asarray(np.maximum(speeds, 0.0))


def _straightest(bends: Array, signs: Array, scale: float) -> float:
    """The c for which |bends + 4 signs c| has the smallest sum; of two equally good ones, that with more zeros."""
    wanted = np.sort(-signs * bends / 4.0)
    middle = wanted[(len(wanted) - 1) // 2 : len(wanted) // 2 + 1]
    straight = [int((np.abs(wanted - c) < 1e-9 * scale).sum()) for c in middle]
    return float(middle[int(np.argmax(straight))])
