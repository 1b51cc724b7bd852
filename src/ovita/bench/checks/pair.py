"""An original and an adapted trajectory with their waypoints matched, and the sizes that count in their scene."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np

from ovita.scene import Scene
from ovita.toolkit.arguments import Mask, fractions
from ovita.toolkit.correspondence import SAME_PLACE, counterparts
from ovita.toolkit.shaping import path_distances
from ovita.trajectory import Array, interpolate

NOTICEABLE = 0.01
"""A change of place counts from this share of the original's extent on."""

EDGE = 0.05
"""What lies within this share of the extent is at the same place for a person who looks at a plot."""


class Pair:
    """Two trajectories to compare.

    Args:
        original: (N, 4): x, y, z [m], speed [m/s].
        adapted: (M, 4).
        scene: Whose objects and frame are meant.
    """

    def __init__(self, original: Array, adapted: Array, scene: Scene) -> None:
        self.original, self.adapted, self.scene = original, adapted, scene

    @cached_property
    def extent(self) -> float:
        """Diagonal of the box around the original path [m]; 1 if it has none."""
        return float(np.linalg.norm(np.ptp(self.original[:, :3], axis=0))) or 1.0

    @cached_property
    def noticeable(self) -> float:
        """The smallest change of place that counts [m]."""
        return NOTICEABLE * self.extent

    @cached_property
    def source(self) -> Array:
        """Fractional indices (N,) into the adapted waypoints; NaN where a waypoint has no counterpart."""
        return match(self.original, self.adapted)

    @cached_property
    def matched(self) -> Array:
        """The adapted row of each original waypoint (N, 4), NaN where there is none."""
        return counterparts(self.adapted, self.source)

    @cached_property
    def found(self) -> Mask:
        """Which original waypoints have a counterpart (N,)."""
        return np.isfinite(self.source)

    @cached_property
    def shift(self) -> Array:
        """Displacement of each original waypoint (N, 3) [m], NaN where it has no counterpart."""
        return self.matched[:, :3] - self.original[:, :3]

    @cached_property
    def tail(self) -> Array:
        """The adapted rows from the old goal on (K, 4), K >= 1: what was added after it."""
        if self.found[-1] and len(self.adapted) != len(self.original):
            begin = round(float(self.source[-1]))
        else:
            gap = np.linalg.norm(self.adapted[:, :3] - self.original[-1, :3], axis=1)
            late = np.flatnonzero(gap <= gap.min() + 2 * self.noticeable)
            begin = int(late[0])
        return self.adapted[begin:]

    @cached_property
    def off_path(self) -> Array:
        """Distance (M,) of each adapted waypoint to the original path [m]."""
        return path_distances(self.original[:, :3], self.adapted[:, :3])

    @cached_property
    def uncovered(self) -> Array:
        """Distance (N,) of each original waypoint to the adapted path [m]."""
        return path_distances(self.adapted[:, :3], self.original[:, :3])

    @cached_property
    def seen_after(self) -> Pair:
        """The same pair with the original's waypoints where they are now: for places that the path came to."""
        rows = np.where(self.found[:, None], self.matched, self.original)
        rows[:, 3] = self.original[:, 3]
        return Pair(rows, self.adapted, self.scene)

    def leeway(self, points: Array) -> Array:
        """How far the limits may have pushed the original path aside at points (K, 3) of it to spare objects, (K,) [m].

        An object's bounding sphere and 2 % of the extent around it may be cleared, and the path before and after it
        may be bent, by half of what it is nearer than 10 % of the extent.
        """
        result = np.zeros(len(points))
        for item in self.scene:
            inside = item.radius - np.linalg.norm(points - item.position, axis=1)
            bent = (inside + 10 * self.noticeable) / 2.0
            result = np.maximum.reduce([result, inside + 2 * self.noticeable, bent])
        return result

    def place(self, what: Any) -> tuple[Array, str]:
        """The point (3,) [m] that an argument means, and how to name it.

        Args:
            what: An object's name, three coordinates [m], "start" or "goal" (of the original), or
                {"between": [a, b]}, the midpoint of two places.

        Raises:
            UnknownObject: If the scene has no such object.
        """
        if isinstance(what, Mapping):
            (a, first), (b, second) = (self.place(part) for part in what["between"])
            return (a + b) / 2.0, f"the midpoint of {first} and {second}"
        if what == "start":
            return np.array(self.original[0, :3]), "the old start"
        if what == "goal":
            return np.array(self.original[-1, :3]), "the old goal"
        if isinstance(what, str):
            found = self.scene[what]
            return np.array(found.position), f"the {found.name}"
        return np.array(what, dtype=float), "[" + ", ".join(f"{value:g}" for value in what) + "]"

    def along(self, word: str) -> Array:
        """Displacement (N,) of each original waypoint along a direction word [m]."""
        return np.asarray(self.shift @ self.scene.frame.direction(word))


def match(original: Array, adapted: Array) -> Array:
    """Fractional indices (N,) into the adapted waypoints, NaN where an original waypoint has no counterpart.

    Equal counts match by index. Otherwise repeats (dwells) are set aside on both sides, and the candidates are:
    by fraction of the path's length (resampled), and the first k waypoints from the start and the others from the
    goal, for every k (waypoints were inserted or taken out in one place: extended, cut short, a loop). The one
    whose displacements vary least wins; of equals, the one that keeps most from the start.

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
        by_length = np.interp(fractions(old), fractions(new), np.arange(len(new), dtype=np.float64))
        split, spread = _best_split(old, new)
        even = float((interpolate(new, by_length) - old).var(axis=0).sum())
        # A few waypoints of a resampled path can be matched one to one by chance, and then say nothing of the others.
        resampled = len(new) < len(old) and even <= (2 * NOTICEABLE * float(np.linalg.norm(np.ptp(old, axis=0)))) ** 2
        source = by_length if resampled or even < spread else split
    into = np.flatnonzero(new_keep).astype(np.float64)
    found = np.isfinite(source)
    source[found] = np.interp(source[found], np.arange(len(into)), into)
    return np.asarray(source[np.cumsum(old_keep) - 1])


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


def _fresh(rows: Array) -> Mask:
    moved = np.linalg.norm(np.diff(rows[:, :3], axis=0), axis=1) > SAME_PLACE
    return np.concatenate([[True], moved])


def feet(path: Array, points: Array) -> Array:
    """The nearest points (M, 3) on a polyline (N, 3) to points (M, 3)."""
    start, step = path[:-1], np.diff(path, axis=0)
    squared = np.maximum((step**2).sum(axis=1), 1e-300)
    away = points[:, None] - start
    share = np.clip((away * step).sum(axis=2) / squared, 0.0, 1.0)
    feet = start + share[:, :, None] * step
    nearest = np.linalg.norm(points[:, None] - feet, axis=2).argmin(axis=1)
    return np.asarray(feet[np.arange(len(points)), nearest])
