"""The time law of a trajectory, inverted without loss where the times came from it."""

from __future__ import annotations

import numpy as np

from ovita.paths.trajectory import Array, Trajectory

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
