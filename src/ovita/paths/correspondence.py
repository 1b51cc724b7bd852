"""Correspondence between the waypoints of an adapted trajectory and those of the original."""

from __future__ import annotations

from dataclasses import dataclass
from difflib import SequenceMatcher
from functools import cached_property
from typing import Literal

import numpy as np

from ovita.paths.geometry import Mask, extent, fractions, lengths, project, repeats, runs
from ovita.paths.trajectory import Array, arc_length, interpolate

Method = Literal["index", "index without dwells", "kept waypoints", "arc length"]

SMALL = 0.01
"""Distances below this share of the original's extent do not count."""

UNTOUCHED = 0.3
"""If so large a share of the waypoints is still on the path, in order, these hold the others in place."""

_LIKELIER = 2.0
"""A path was resampled unless waypoints put in or taken out in one place explain it so many times better."""

_FINE = 4
"""Into how many parts each segment is cut to find untouched waypoints."""

_DRAWN = 3.0
"""A stretch that became so many times as long as it was holds waypoints that were drawn anew."""


@dataclass(frozen=True, eq=False)
class Correspondence:
    """The waypoints of an original and of an adapted path that belong together, both counted from 0.

    Args:
        method: "index": by number; "index without dwells": by number once repeated waypoints are set aside; "kept
            waypoints": those that were taken over, in order, with others taken out or put in between; "arc length": by
            shares of the path's length.
        forward: Fractional adapted waypoint of each original one (N,); NaN where it was taken out.
        backward: Fractional original waypoint of each adapted one (M,); NaN where it was put in.
    """

    method: Method
    forward: Array
    backward: Array

    @cached_property
    def kept(self) -> Mask:
        """Which original waypoints have a counterpart (N,)."""
        return np.isfinite(self.forward)

    @cached_property
    def old(self) -> Mask:
        """Which adapted waypoints come from the original (M,)."""
        return np.isfinite(self.backward)

    @property
    def removed(self) -> tuple[tuple[int, int], ...]:
        """Runs (first, last) of original waypoints that were taken out."""
        return tuple(runs(~self.kept))

    @property
    def added(self) -> tuple[tuple[int, int], ...]:
        """Runs (first, last) of inserted waypoints."""
        return tuple(runs(~self.old))

    def of_original(self, adapted: Array) -> Array:
        """For each original waypoint its row (N, D) among adapted rows (M, D); NaN where it has none."""
        return _rows(adapted, self.forward)

    def of_adapted(self, original: Array) -> Array:
        """For each adapted waypoint its row (M, D) among original rows (N, D); NaN where it has none."""
        return _rows(original, self.backward)

    def carried(self, mask: Mask) -> Mask:
        """A mask of original waypoints (N,) as one of adapted waypoints (M,); insertions are excluded."""
        chosen = np.zeros(len(self.backward), dtype=bool)
        chosen[self.old] = mask[np.rint(self.backward[self.old]).astype(int)]
        return chosen

    def carried_back(self, mask: Mask) -> Mask:
        """A mask of adapted waypoints (M,) as one of original waypoints (N,); removals are excluded."""
        chosen = np.zeros(len(self.forward), dtype=bool)
        chosen[self.kept] = mask[np.rint(self.forward[self.kept]).astype(int)]
        return chosen


def carried_over(original: Array, adapted: Array, first: int, last: int) -> tuple[int, int] | None:
    """The first and the last waypoint on an adapted path of what were `first` to `last`; None if none is left."""
    came = correspond(original, adapted).backward
    left = np.flatnonzero((came >= first - 1e-9) & (came <= last + 1e-9))
    return (int(left[0]), int(left[-1])) if len(left) else None


def correspond(original: Array, adapted: Array) -> Correspondence:
    """Match the waypoints of two paths.

    Equal counts match by index, unless the waypoints were only spread anew along the same path. Otherwise repeats
    (dwells) are set aside on both sides, and tried in turn:

    - waypoints that are bit by bit where they were, if that is three tenths of them; between these, equal counts match
      by index and other stretches as below;
    - by share of the path's length (resampled), if that leaves the path where it was;
    - the first k waypoints from the start and the others from the goal, if that shifts the path as a whole (put in
      or taken out in one place: extended, cut short, a loop);
    - by what is still where it was, if that is three tenths of the waypoints, and by length in between (resampled and
      changed in parts);
    - the second or the third, whichever leaves the more even displacements.

    Args:
        original: (N, 3+) [m].
        adapted: (M, 3+) [m].
    """
    n, m = len(original), len(adapted)
    if n == m and not _spread_anew(original[:, :3], adapted[:, :3]):
        index = np.arange(n, dtype=float)
        return Correspondence("index", index, index)
    old_keep, new_keep = ~repeats(original), ~repeats(adapted)
    old, new = original[old_keep, :3], adapted[new_keep, :3]
    method: Method = "index without dwells"
    if len(old) == len(new) and n != m:
        forward = backward = np.arange(len(old), dtype=float)
    else:
        small = SMALL * extent(old)
        kept = _kept(old, new, small) if n != m else None
        method = "arc length" if kept is None else "kept waypoints"
        forward, backward = _unequal(old, new, small) if kept is None else kept
        if kept is None and not np.isfinite(forward).all():
            method = "kept waypoints"
    return Correspondence(method, _through(forward, old_keep, new_keep), _through(backward, new_keep, old_keep))


def _rows(rows: Array, places: Array) -> Array:
    found = np.isfinite(places)
    result = np.full((len(places), rows.shape[1]), np.nan)
    result[found] = interpolate(rows, places[found])
    return result


def _through(places: Array, here: Mask, there: Mask) -> Array:
    """Places among waypoints without repeats, written for all waypoints: masks say which are no repeats.

    A place between two waypoints of which the first is repeated lies behind its last repeat.
    """
    first = np.flatnonzero(there)
    last = np.append(first[1:], len(there)) - 1
    result = np.full(len(places), np.nan)
    found = np.isfinite(places)
    low = np.minimum(np.floor(places[found]).astype(int), len(first) - 1)
    share = places[found] - low
    result[found] = np.where(share > 0.0, last[low] + share, first[low])
    return np.asarray(result[np.cumsum(here) - 1])


def _spread_anew(old: Array, new: Array) -> bool:
    """Whether equally many waypoints match well by length and badly by index."""
    small = SMALL * extent(old)
    if lengths(new[[0, -1]] - old[[0, -1]]).max() > small or lengths(new - old).max() <= 2 * small:
        return False
    there = _by_length(old, new)
    return bool(np.linalg.norm(interpolate(new, there) - old, axis=1).max() <= small)


def _by_length(old: Array, new: Array) -> Array:
    return np.asarray(np.interp(fractions(old), fractions(new), np.arange(len(new), dtype=float)))


def _kept(old: Array, new: Array, small: float) -> tuple[Array, Array] | None:
    """A match anchored at unmoved waypoints; None if these are too few."""
    here, there = ([row.tobytes() for row in np.round(rows, 9) + 0.0] for rows in (old, new))
    blocks = SequenceMatcher(None, here, there, autojunk=False).get_matching_blocks()
    if sum(block.size for block in blocks) < max(2.0, UNTOUCHED * min(len(old), len(new))):
        return None
    forward, backward = np.full(len(old), np.nan), np.full(len(new), np.nan)
    a = b = 0
    for i, j, size in blocks:
        _fill(forward, backward, (old, new), (a, i), (b, j), small)
        forward[i : i + size], backward[j : j + size] = np.arange(j, j + size), np.arange(i, i + size)
        a, b = i + size, j + size
    if np.isnan(backward).any() and len([*runs(np.isnan(forward)), *runs(np.isnan(backward))]) > 1:
        # A straight path that was moved along itself and extended lies on its old waypoints by chance.
        *moved, spread = _best_split(old, new)
        if spread <= (SMALL * small) ** 2:
            return moved[0], moved[1]
    return forward, backward


def _fill(
    forward: Array,
    backward: Array,
    paths: tuple[Array, Array],
    here: tuple[int, int],
    there: tuple[int, int],
    small: float,
) -> None:
    """Match the gap between two kept stretches: original waypoints a..b-1 and adapted waypoints c..d-1."""
    (a, b), (c, d) = here, there
    old, new = paths[0][a:b], paths[1][c:d]
    inner = 0 < a and b < len(forward) and 0 < c and d < len(backward)
    if len(old) == len(new):
        forward[a:b], backward[c:d] = np.arange(c, d), np.arange(a, b)
    elif inner and not len(old):
        _between(backward, paths[0][a - 1 : a + 1], new, (c, d), a - 1, small)
    elif inner and not len(new):
        _between(forward, paths[1][c - 1 : c + 1], old, (a, b), c - 1, small)
    elif len(old) and len(new):
        if inner:  # with the kept waypoints on both sides, lengths can be compared
            a, b, c, d = a - 1, b + 1, c - 1, d + 1
            old, new = paths[0][a:b], paths[1][c:d]
        long = float(arc_length(new)[-1]) > _DRAWN * float(arc_length(old)[-1]) + 5 * small
        f, g = _unequal(old, new, small) if len(old) > 1 and len(new) > 1 and not (inner and long) else _split(old, new)
        forward[a:b], backward[c:d] = f + c, g + a


def _between(into: Array, segment: Array, points: Array, span: tuple[int, int], first: int, small: float) -> None:
    """Place points (K, 3) on the segment (2, 3) if all lie on it: waypoints inserted into it or removed."""
    distance, place = project(segment, points)
    if distance.max() <= small:
        into[slice(*span)] = first + np.maximum.accumulate(place)


def _unequal(old: Array, new: Array, small: float) -> tuple[Array, Array]:
    """Both directions of a match of paths without repeats that do not share enough waypoints."""
    by_length = _by_length(old, new)
    both = by_length, _by_length(new, old)
    forward, backward, spread = _best_split(old, new)
    even = float((interpolate(new, by_length) - old).var(axis=0).sum())
    # A few waypoints of a resampled path can be matched one to one by chance, and then say nothing of the others.
    if len(new) < len(old) and even <= (2 * small) ** 2:
        return both
    if spread <= (small / 2) ** 2:
        return forward, backward
    if even > (2 * small) ** 2:
        anchored, share = _anchored(old, new, small)
        if share >= UNTOUCHED:
            return anchored, _inverse(anchored, old, new, small)
    # The displacements of a path that was scaled or turned vary too, but they follow from its shape.
    likelier = _LIKELIER * spread < even and _distortion(old, new, forward) < _distortion(old, new, by_length)
    return (forward, backward) if likelier else both


def _inverse(forward: Array, old: Array, new: Array, small: float) -> Array:
    """The original place (m,) of each new waypoint; NaN beyond the ends and in redrawn stretches."""
    backward = np.interp(np.arange(len(new)), forward, np.arange(len(old)), left=np.nan, right=np.nan)
    s = arc_length(new)
    along_new = np.interp(forward, np.arange(len(new)), s)
    backward[(s < along_new[0]) & (s >= along_new[0] - small)] = 0.0
    backward[(s > along_new[-1]) & (s <= along_new[-1] + small)] = len(old) - 1.0
    drawn = np.flatnonzero(np.diff(along_new) > _DRAWN * np.diff(arc_length(old)) + 5 * small)
    for i in drawn:
        backward[int(np.floor(forward[i])) + 1 : int(np.ceil(forward[i + 1]))] = np.nan
    return backward


def _anchored(old: Array, new: Array, small: float) -> tuple[Array, float]:
    """A match by the waypoints that the new path still passes, in order, and their share of all.

    Each old waypoint takes a point of the new path, none before that of its predecessor, so that the sum of the
    distances, each at most three `small`, is least.
    """
    n, cuts = len(old), np.arange((len(new) - 1) * _FINE + 1) / _FINE
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
    return np.interp(there, along_new, np.arange(len(new), dtype=float)), share


def _split(old: Array, new: Array) -> tuple[Array, Array]:
    forward, backward, _ = _best_split(old, new)
    return forward, backward


def _best_split(old: Array, new: Array) -> tuple[Array, Array, float]:
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
    forward, backward = np.full(n, np.nan), np.full(m, np.nan)
    forward[:k] = backward[:k] = np.arange(k)
    if k < shared:
        forward[n - shared + k :] = np.arange(m - shared + k, m)
        backward[m - shared + k :] = np.arange(n - shared + k, n)
    return forward, backward, float(variance[k])


def _distortion(old: Array, new: Array, forward: Array) -> float:
    """Variance [m^2] of the matched waypoints that no affine map of the original explains."""
    found = np.isfinite(forward)
    system = np.column_stack([old[found], np.ones(int(found.sum()))])
    moved = interpolate(new, forward[found])
    solution, *_ = np.linalg.lstsq(system, moved, rcond=None)
    return float(((system @ solution - moved) ** 2).sum(axis=1).mean())
