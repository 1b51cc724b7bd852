"""Which waypoint of an adapted trajectory came from which of the original, when their counts differ."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ovita.paths.geometry import SAME_PLACE, Mask, fractions
from ovita.paths.trajectory import Array, interpolate


def correspond(original: Array, adapted: Array) -> Array:
    """Fractional indices (N,) into the adapted waypoints, NaN where an original waypoint has no counterpart.

    Equal counts correspond by index. Otherwise repeats (dwells) are set aside, and then the counts are equal, or
    the waypoints correspond from the start on (the path was extended or cut short), or by fraction of the path's
    length (it was resampled): whichever makes the displacements of the waypoints differ least.

    Args:
        original: (N, 3+) [m].
        adapted: (M, 3+) [m].
    """
    n, m = len(original), len(adapted)
    if n == m:
        return np.arange(n, dtype=np.float64)
    old_keep, new_keep = _fresh(original), _fresh(adapted)
    old, new = original[old_keep, :3], adapted[new_keep, :3]
    if len(old) == len(new):
        source = np.arange(len(old), dtype=np.float64)
    else:
        shared = min(len(old), len(new))
        by_count = np.full(len(old), np.nan)
        by_count[:shared] = np.arange(shared)
        by_length = np.interp(fractions(old), fractions(new), np.arange(len(new), dtype=np.float64))
        source = min(by_count, by_length, key=lambda candidate: _unevenness(old, new, candidate))
    into = np.flatnonzero(new_keep).astype(np.float64)
    found = np.isfinite(source)
    source[found] = np.interp(source[found], np.arange(len(into)), into)
    return np.asarray(source[np.cumsum(old_keep) - 1])


def counterparts(rows: Array, source: Array) -> Array:
    """Adapted rows (N, D) at fractional indices (N,) as `correspond` returns; NaN where there is none."""
    found = np.isfinite(source)
    result = np.full((len(source), rows.shape[1]), np.nan)
    result[found] = interpolate(rows, source[found])
    return result


def selections(where: Mapping[str, Any] | None, source: Array, adapted_count: int) -> tuple[Mask, Mask]:
    """The stored mask of an expectation over the original (N,) and over the adapted waypoints (M,).

    Args:
        where: {"count": ..., "ranges": [[first, last], ...]}, or None for everything. A count that is the
            adapted and not the original one means adapted waypoints; any other is stretched.
        source: (N,) from `correspond`.
        adapted_count: M.
    """
    n, m = len(source), adapted_count
    if where is None:
        return np.ones(n, dtype=bool), np.ones(m, dtype=bool)
    selected = np.zeros(int(where["count"]), dtype=bool)
    for first, last in where["ranges"]:
        selected[int(first) : int(last) + 1] = True
    found = np.isfinite(source)
    if len(selected) == m != n:
        over_original = np.zeros(n, dtype=bool)
        over_original[found] = selected[np.rint(source[found]).astype(int)]
        return over_original, selected
    if len(selected) != n:
        selected = selected[np.rint(np.linspace(0, len(selected) - 1, n)).astype(int)]
    origin = np.rint(np.interp(np.arange(m), source[found], np.flatnonzero(found), left=-1.0, right=-1.0)).astype(int)
    return selected, np.where(origin >= 0, selected[origin], False)


def _fresh(rows: Array) -> Mask:
    moved = np.linalg.norm(np.diff(rows[:, :3], axis=0), axis=1) > SAME_PLACE
    return np.concatenate([[True], moved])


def _unevenness(old: Array, new: Array, source: Array) -> float:
    found = np.isfinite(source)
    if found.sum() < 2:
        return np.inf
    shift = interpolate(new, source[found]) - old[found]
    return float(shift.var(axis=0).sum())
