"""An original and an adapted trajectory with their waypoints matched, and the sizes that count in their scene."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from ovita.paths.correspondence import Correspondence, correspond
from ovita.paths.geometry import Mask, extent, path_distances, project
from ovita.paths.part import PathPart, locate, named
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory, interpolate

NOTICEABLE = 0.01
"""A change of place counts from this share of the original's extent on."""

EDGE = 0.05
"""What lies within this share of the extent is at the same place for a person who looks at a plot."""


Where: TypeAlias = PathPart | Mapping[str, Any] | None
"""The part of the original path that a check looks at: a `PathPart` or its JSON document; None means all of it."""


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
        return extent(self.original[:, :3]) or 1.0

    @cached_property
    def noticeable(self) -> float:
        """The smallest change of place that counts [m]."""
        return NOTICEABLE * self.extent

    @cached_property
    def trajectory(self) -> Trajectory:
        """The original."""
        return Trajectory.from_array(self.original)

    @cached_property
    def match(self) -> Correspondence:
        """Which waypoints belong together."""
        return correspond(self.original, self.adapted)

    @cached_property
    def source(self) -> Array:
        """Fractional indices (N,) into the adapted waypoints; NaN where a waypoint has no counterpart."""
        return self.match.forward

    @cached_property
    def matched(self) -> Array:
        """The adapted row of each original waypoint (N, 4), NaN where there is none."""
        return self.match.of_original(self.adapted)

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
        """The adapted rows from the old goal on (K, 4), K >= 1."""
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
        name = f"the old {what}" if what in ("start", "goal") else named(what)
        if isinstance(what, str) and what not in ("start", "goal"):
            name = f"the {self.scene[what].name}"
        return locate(what, self.trajectory, self.scene), name

    def along(self, word: str) -> Array:
        """Displacement (N,) of each original waypoint along a direction word [m]."""
        return np.asarray(self.shift @ self.scene.frame.direction(word))


def selected(pair: Pair, where: Where) -> Mask:
    """Which original waypoints a part of the path means, (N,).

    Raises:
        ValueError: If `where` describes no part of a path.
        UnknownObject: If it names an object that the scene does not have.
    """
    return PathPart.from_json(where).mask(pair.trajectory, pair.scene)


def said(where: Where) -> str:
    """A part of the path in words, beginning with a blank; "" for everything."""
    words = PathPart.from_json(where).words()
    return f" {words}" if words else ""


def feet(path: Array, points: Array) -> Array:
    """The nearest points (M, 3) on a polyline (N, 3) to points (M, 3)."""
    return interpolate(path, project(path, points)[1])
