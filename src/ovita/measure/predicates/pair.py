"""An original and an adapted trajectory with their waypoints matched, and the sizes that count in their scene."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np

from ovita.measure.predicates.matching import match
from ovita.paths.geometry import Mask, path_distances
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array
from ovita.toolkit.correspondence import counterparts

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


def feet(path: Array, points: Array) -> Array:
    """The nearest points (M, 3) on a polyline (N, 3) to points (M, 3)."""
    start, step = path[:-1], np.diff(path, axis=0)
    squared = np.maximum((step**2).sum(axis=1), 1e-300)
    away = points[:, None] - start
    share = np.clip((away * step).sum(axis=2) / squared, 0.0, 1.0)
    feet = start + share[:, :, None] * step
    nearest = np.linalg.norm(points[:, None] - feet, axis=2).argmin(axis=1)
    return np.asarray(feet[np.arange(len(points)), nearest])
