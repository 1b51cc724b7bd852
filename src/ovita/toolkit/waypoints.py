"""Smooth a path, and change the number and the order of its waypoints."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.geometry import runs
from ovita.paths.trajectory import Array, interpolate, source_indices
from ovita.toolkit import arguments
from ovita.toolkit.catalogue import operation

CUTOFF = 8.0
"""Half-waves per path at which smoothing of strength 1 halves the amplitude."""


@operation("Waypoints")
def smooth(traj: ArrayLike, strength: float = 1.0) -> Array:
    """Take out bends and jitter; strength 0 does nothing, 10 a lot; start and goal stay.

    The deviation from the chord is a sine series; half-wave k is divided by 1 + strength (k / 8)^4, so that
    the bending energy (the sum of squared second differences) falls as strength grows.

    Args:
        traj: (N, 4).
        strength: >= 0.
    """
    rows = arguments.waypoints(traj)
    amount = arguments.number(strength, "strength", low=0.0)
    # A dwell repeats a waypoint: it is smoothed as one waypoint, so that it stays a dwell.
    fresh = np.concatenate([[True], (np.diff(rows[:, :3], axis=0) != 0).any(axis=1)])
    path = rows[fresh, :3]
    n = len(path)
    if amount == 0.0 or n < 3:
        return rows
    chord = path[0] + np.linspace(0.0, 1.0, n)[:, None] * (path[-1] - path[0])
    inner = (path - chord)[1:-1]
    gain = 1.0 / (1.0 + amount * (np.arange(1, n - 1) / CUTOFF) ** 4)
    path[1:-1] = chord[1:-1] + _sine(_sine(inner) * gain[:, None]) * (2.0 / (n - 1))
    rows[:, :3] = path[np.cumsum(fresh) - 1]
    return rows


@operation("Waypoints")
def resample(traj: ArrayLike, n: int, by: Literal["arc_length", "index"] = "arc_length") -> Array:
    """Give the same path n waypoints.

    Args:
        traj: (N, 4).
        n: Number of waypoints, >= 2.
        by: "arc_length" spaces them evenly along the path, "index" evenly in waypoint count (keeps waits).
    """
    rows = arguments.waypoints(traj)
    count = arguments.integer(n, "n", 2, arguments.MOST_WAYPOINTS)
    if by not in ("arc_length", "index"):
        raise ValueError(f"by must be 'arc_length' or 'index', not {by!r}")
    return interpolate(rows, source_indices(rows[:, :3], count, by))


@operation("Waypoints")
def average(traj: ArrayLike, k: int) -> Array:
    """Merge each k waypoints into one.

    That one is their mean, speed and extra columns included.

    Args:
        traj: (N, 4); the result is (ceil(N / k), 4), its last waypoint the mean of what is left over.
        k: Waypoints a group, from 1 to N - 1.
    """
    rows = arguments.waypoints(traj)
    size = arguments.integer(k, "k", 1, len(rows) - 1)
    starts = np.arange(0, len(rows), size)
    counts = np.diff(np.append(starts, len(rows)))
    return np.asarray(np.add.reduceat(rows, starts, axis=0) / counts[:, None])


@operation("Waypoints")
def reverse(traj: ArrayLike, *, where: ArrayLike | None = None) -> Array:
    """Reverse the waypoints' order.

    Speeds and extra columns go along.

    Args:
        traj: (N, 4).
        where: Mask (N,), or None for all waypoints; each unbroken run of it is reversed for itself, so the
            path jumps at its edges.
    """
    rows = arguments.waypoints(traj)
    for a, b in runs(arguments.mask(where, len(rows))):
        rows[a : b + 1] = rows[a : b + 1][::-1].copy()
    return rows


def _sine(values: Array) -> Array:
    """Discrete sine transform of the first kind of columns (M, D); its own inverse up to the factor 2 / (M + 1)."""
    zero = np.zeros((1, values.shape[1]))
    odd = np.concatenate([zero, values, zero, -values[::-1]])
    return np.asarray(-np.fft.rfft(odd, axis=0).imag[1 : len(values) + 1] / 2.0)
