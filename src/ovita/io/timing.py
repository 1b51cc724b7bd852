"""Speeds from times: the time law of a trajectory, read backwards."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ovita.errors import TrajectoryError
from ovita.io.documents import LARGEST
from ovita.io.timelaw import chained_speeds, no_rougher
from ovita.paths.trajectory import TIMESTEP, Array

SMOOTHNESS = 0.02
"""Weight of the speeds' second differences against the fit of the times; 1/64 passes alternating noise unamplified."""

Mask = NDArray[np.bool_]

TOLERANCE = 0.05
"""Relative error of a segment's duration from which on it is remarked."""

_ROUNDS = 50


def speeds_from_times(positions: Array, times: Array, key: str = "t") -> tuple[Array, float, tuple[str, ...]]:
    """Find speeds that make a trajectory reach its waypoints at given times.

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
