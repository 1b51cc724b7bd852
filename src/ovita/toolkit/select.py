"""Masks: which waypoints an edit applies to. Combine them with &, | and ~."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.frame import RFU, Frame
from ovita.paths.geometry import Mask
from ovita.paths.geometry import within as passing
from ovita.paths.trajectory import Array
from ovita.toolkit import arguments
from ovita.toolkit.arguments import Place, Target
from ovita.toolkit.catalogue import operation


@operation("Choose waypoints", core=True)
def near(traj: ArrayLike, obj: Target, within: float) -> Mask:
    """Mask: waypoints at most so many metres from an object's centre.

    Where only the line between two waypoints passes so near, the nearer one counts.

    Args:
        traj: (N, 4).
        obj: Object or point (3,) [m].
        within: Distance [m], >= 0.
    """
    rows = arguments.waypoints(traj)
    radius = arguments.number(within, "within", low=0.0)
    return passing(rows[:, :3], arguments.point(obj), radius)


@operation("Choose waypoints", core=True)
def first(traj: ArrayLike, n: int | None = None, *, fraction: float | None = None) -> Mask:
    """Mask: the first n waypoints, or a fraction (0..1) of all.

    Args:
        traj: (N, 4).
        n: Number of waypoints, 1 to N: indices 0 to n - 1.
        fraction: Share of the waypoint count; exactly one of n and fraction is given.
    """
    rows = arguments.waypoints(traj)
    return np.arange(len(rows)) < _count(rows, n, fraction)


@operation("Choose waypoints", core=True)
def last(traj: ArrayLike, n: int | None = None, *, fraction: float | None = None) -> Mask:
    """Mask: the last n waypoints, or a fraction (0..1) of all.

    Args:
        traj: (N, 4).
        n: Number of waypoints, 1 to N: indices N - n to N - 1.
        fraction: Share of the waypoint count; exactly one of n and fraction is given.
    """
    rows = arguments.waypoints(traj)
    return np.arange(len(rows)) >= len(rows) - _count(rows, n, fraction)


@operation("Choose waypoints")
def between(traj: ArrayLike, a: Place, b: Place) -> Mask:
    """Mask: from PLACE a to PLACE b.

    Args:
        traj: (N, 4).
        a: Waypoint index from 0 (int), fraction of the path's length (float), "start", "goal", or an object or
            point (3,) [m] that means the waypoint nearest to it.
        b: The other end, in any order; both ends are included.
    """
    rows = arguments.waypoints(traj)
    low, high = sorted((arguments.locate(rows, a, "a"), arguments.locate(rows, b, "b")))
    index = np.arange(len(rows))
    return (index >= low) & (index <= high)


@operation("Choose waypoints")
def where_rising(traj: ArrayLike, direction: str = "up", *, frame: Frame = RFU) -> Mask:
    """Mask: where the path heads up (or another direction word).

    Args:
        traj: (N, 4).
        direction: A direction word.
    """
    rows = arguments.waypoints(traj)
    axis = arguments.direction(frame, direction)
    steps = np.diff(rows[:, :3], axis=0)
    rising = steps @ axis > 1e-6 * np.linalg.norm(steps, axis=1)
    return np.concatenate([rising, rising[-1:]])


@operation("Choose waypoints")
def every(traj: ArrayLike, k: int, start: int = 0) -> Mask:
    """Mask: every k-th waypoint from index start on.

    Args:
        traj: (N, 4).
        k: Stride, 1 to N.
        start: Index of the first selected waypoint, from 0.
    """
    n = len(arguments.waypoints(traj))
    stride, begin = arguments.integer(k, "k", 1, n), arguments.integer(start, "start", 0, n - 1)
    selected = np.zeros(n, dtype=bool)
    selected[begin::stride] = True
    return selected


def _count(rows: Array, n: Any, fraction: Any) -> int:
    if (n is None) == (fraction is None):
        raise ValueError("give exactly one of n (a number of waypoints) and fraction (0..1)")
    if fraction is not None:
        share = arguments.number(fraction, "fraction", low=0.0, high=1.0)
        return max(round(share * len(rows)), int(share > 0))
    if isinstance(n, float) and not n.is_integer():
        raise ValueError(f"n counts waypoints and {n:g} is no whole number; did you mean fraction={n:g}?")
    return arguments.integer(n, "n", 1, len(rows))
