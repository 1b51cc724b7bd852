"""Which waypoint of an adapted trajectory came from which of the original, whatever was done to it."""

from __future__ import annotations

import numpy as np

from ovita.paths.geometry import SAME_PLACE, Mask, fractions
from ovita.paths.trajectory import Array, arc_length, interpolate

SMALL = 0.01
"""Distances below this share of the original's extent do not count."""

LIKELIER = 2.0
"""A path was resampled unless waypoints put in or taken out in one place explain it so many times better."""

UNTOUCHED = 0.3
"""If so large a share of the waypoints is still on the path, in order, these hold the others in place."""

FINE = 4
"""Into how many parts each segment is cut to find them."""


def match(original: Array, adapted: Array) -> Array:
    """Fractional indices (N,) into the adapted waypoints, NaN where an original waypoint has no counterpart.

    Equal counts match by index, unless the waypoints were only spread anew along the same path. Otherwise repeats
    (dwells) are set aside on both sides, and tried in turn:

    - by fraction of the path's length (resampled), if that leaves the path where it was;
    - the first k waypoints from the start and the others from the goal, if that shifts the path as a whole (put in
      or taken out in one place: extended, cut short, a loop);
    - by what is still where it was, if that is three tenths of the waypoints, and by length in between (resampled and
      changed in parts);
    - the first or the second, whichever leaves the more even displacements.

    Args:
        original: (N, 3+) [m].
        adapted: (M, 3+) [m].
    """
    n, m = len(original), len(adapted)
    if n == m and not _spread_anew(original[:, :3], adapted[:, :3]):
        return np.arange(n, dtype=np.float64)
    old_keep, new_keep = _fresh(original), _fresh(adapted)
    old, new = original[old_keep, :3], adapted[new_keep, :3]
    if len(old) == len(new) and n != m:
        source = np.arange(len(old), dtype=np.float64)
    else:
        source = _unequal(old, new)
    into = np.flatnonzero(new_keep).astype(np.float64)
    found = np.isfinite(source)
    source[found] = np.interp(source[found], np.arange(len(into)), into)
    return np.asarray(source[np.cumsum(old_keep) - 1])


def _spread_anew(old: Array, new: Array) -> bool:
    """Whether equally many waypoints match well by length and badly by index."""
    small = SMALL * float(np.linalg.norm(np.ptp(old, axis=0)))
    if np.linalg.norm(new - old, axis=1).max() <= 2 * small:
        return False
    source = np.interp(fractions(old), fractions(new), np.arange(len(new), dtype=np.float64))
    return bool(np.linalg.norm(interpolate(new, source) - old, axis=1).max() <= small)


def _unequal(old: Array, new: Array) -> Array:
    small = SMALL * float(np.linalg.norm(np.ptp(old, axis=0)))
    by_length = np.interp(fractions(old), fractions(new), np.arange(len(new), dtype=np.float64))
    split, spread = _best_split(old, new)
    even = float((interpolate(new, by_length) - old).var(axis=0).sum())
    # A few waypoints of a resampled path can be matched one to one by chance, and then say nothing of the others.
    if len(new) < len(old) and even <= (2 * small) ** 2:
        return by_length
    if spread <= (small / 2) ** 2:
        return split
    if even > (2 * small) ** 2:
        anchored, share = _anchored(old, new, small)
        if share >= UNTOUCHED:
            return anchored
    # The displacements of a path that was scaled or turned vary too, but they follow from its shape.
    likelier = LIKELIER * spread < even and _distortion(old, new, split) < _distortion(old, new, by_length)
    return split if likelier else by_length


def _anchored(old: Array, new: Array, small: float) -> tuple[Array, float]:
    """A match by the waypoints that the new path still passes, in order, and their share of all.

    Each old waypoint takes a point of the new path, none before that of its predecessor, so that the sum of the
    distances, each at most three `small`, is least.
    """
    n, cuts = len(old), np.arange((len(new) - 1) * FINE + 1) / FINE
    points = interpolate(new, cuts)
    total, came = np.zeros(len(points)), np.empty((n, len(points)), dtype=np.int64)
    index = np.arange(len(points))
    for i, place in enumerate(old):
        lowest = np.minimum.accumulate(total)
        came[i] = np.maximum.accumulate(np.where(total <= lowest, index, 0))
        total = lowest + np.minimum(np.linalg.norm(points - place, axis=1), 3 * small)
    at = np.empty(n, dtype=np.int64)
    # A curve drawn after the goal may pass it again: the first time counts.
    at[-1] = int(np.flatnonzero(total <= total.min() + small / 2)[0])
    for i in range(n - 1, 0, -1):
        at[i - 1] = came[i][at[i]]
    held = np.linalg.norm(points[at] - old, axis=1) <= small
    share = float(held.mean())
    if not held.any():
        return np.zeros(n), 0.0
    known, ends = np.flatnonzero(held), cuts[at[held]]
    # What is before the first or after the last of them belongs to the start or the goal of the new path.
    if known[0] > 0:
        known, ends = np.append(0, known), np.append(0.0, ends)
    along_new, along_old = fractions(new), fractions(old)
    if known[-1] < n - 1:
        s, left = arc_length(new), float(np.ptp(arc_length(old)[known[-1] :]))
        done = float(np.interp(ends[-1], np.arange(len(new)), s))
        # Where much more is left than before, something was drawn after the goal.
        last = (
            len(new) - 1.0
            if s[-1] - done <= 1.5 * left + 5 * small
            else float(np.interp(done + left, s, np.arange(len(new))))
        )
        known, ends = np.append(known, n - 1), np.append(ends, last)
    there = np.interp(along_old, along_old[known], np.interp(ends, np.arange(len(new)), along_new))
    return np.interp(there, along_new, np.arange(len(new), dtype=np.float64)), share


def _best_split(old: Array, new: Array) -> tuple[Array, float]:
    """The best match of the first k waypoints from the start and the rest from the goal, and its variance [m^2]."""
    n, m = len(old), len(new)
    shared = min(n, m)
    head = new[:shared] - old[:shared]
    rest = new[m - shared :] - old[n - shared :]
    zero = np.zeros((1, 3))

    def sums(a: Array, b: Array) -> Array:
        """Sum over the first k of a and the others of b, for k = 0..shared."""
        return np.asarray(np.concatenate([zero, (a - b).cumsum(axis=0)]) + b.sum(axis=0))

    variance = (sums(head**2, rest**2) / shared - (sums(head, rest) / shared) ** 2).sum(axis=1)
    k = shared - int(np.argmin(np.round(variance, 12)[::-1]))
    source = np.full(n, np.nan)
    source[:k] = np.arange(k)
    if k < shared:
        source[n - shared + k :] = np.arange(m - shared + k, m)
    return source, float(variance[k])


def _distortion(old: Array, new: Array, source: Array) -> float:
    """Variance [m^2] of the matched waypoints that no affine map of the original explains."""
    found = np.isfinite(source)
    system = np.column_stack([old[found], np.ones(int(found.sum()))])
    moved = interpolate(new, source[found])
    solution, *_ = np.linalg.lstsq(system, moved, rcond=None)
    return float(((system @ solution - moved) ** 2).sum(axis=1).mean())


def _fresh(rows: Array) -> Mask:
    moved = np.linalg.norm(np.diff(rows[:, :3], axis=0), axis=1) > SAME_PLACE
    return np.concatenate([[True], moved])
