"""Obstacles: oriented cuboids with rounded edges, and their exact distance to segments.

An `Obstacle` is all points closer than `radius` to an oriented cuboid, its core. With a core of no size that is a
sphere: the bounding sphere of the paper, |x_i - o|^2 >= R^2 (there R^2 = R_obs^2 + delta^2; here R = R_obs + delta,
the distance that is really kept).

Its signed distance is a convex function. So along a segment it has one minimum, found exactly below; and for every
unit vector n the half-space {x : n.x >= support(n)} is free of the obstacle. Imposed on both ends of a segment it
keeps the whole segment out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ovita.paths.robot import Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array

_ONES = np.ones(3)
_PAIRS = np.triu_indices(6, 1)


def dots(a: Array, b: Array) -> Array:
    """Scalar products of vectors (..., 3), (...)."""
    return np.asarray((a * b) @ _ONES)  # quicker than a sum over an axis of three


def lengths(vectors: Array) -> Array:
    """Lengths of vectors (..., 3), (...)."""
    return np.asarray(np.sqrt(dots(vectors, vectors)))


@dataclass(frozen=True, eq=False)
class Obstacle:
    """All points closer than `radius` to an oriented cuboid.

    Args:
        name: The object's name.
        center: (3,) [m].
        rotation: (3, 3), columns are the cuboid's axes in the world.
        half: Half edge lengths of the core (3,) [m]; zeros for a sphere.
        radius: Distance to keep from the core [m].
        what: "obstacle", or "workspace" for the inner sphere of a shell.
    """

    name: str
    center: Array
    rotation: Array
    half: Array
    radius: float
    what: Literal["obstacle", "workspace"] = "obstacle"

    @cached_property
    def reach(self) -> float:
        """Radius of the bounding sphere, margin included [m]."""
        return float(np.linalg.norm(self.half)) + self.radius

    @cached_property
    def _ball(self) -> bool:
        """Whether the core has no size."""
        return not self.half.any()

    def _to_core(self, local: Array) -> Array:
        """By how much points in the cuboid's axes (M, 3) are beyond it, along each axis."""
        return local if self._ball else np.maximum(np.abs(local) - self.half, 0.0)

    def _local(self, start: Array, end: Array) -> tuple[Array, Array]:
        """Starts and directions of segments in the cuboid's axes."""
        a, d = start - self.center, end - start
        return (a, d) if self._ball else (a @ self.rotation, d @ self.rotation)

    def support(self, normals: Array) -> Array:
        """Largest n.x over the obstacle for unit vectors (M, 3), (M,) [m]."""
        return np.asarray(normals @ self.center + np.abs(normals @ self.rotation) @ self.half + self.radius)

    def signed(self, points: Array) -> tuple[Array, Array]:
        """Signed distance of points (M, 3) [m] to the surface, (M,) [m], negative inside, and outward normals (M, 3).

        At the very centre of a sphere there is no normal; it is zero there.
        """
        if self._ball:
            offset = points - self.center
            distance = lengths(offset)
            return distance - self.radius, offset / np.where(distance > 0.0, distance, 1.0)[:, None]
        local = (points - self.center) @ self.rotation
        beyond = np.abs(local) - self.half
        outward = np.maximum(beyond, 0.0)
        distance = lengths(outward)
        sign = np.where(local < 0, -1.0, 1.0)
        outside = distance > 0
        normals = np.divide(outward * sign, distance[:, None], out=np.zeros_like(local), where=outside[:, None])
        if not outside.all():
            inner = np.flatnonzero(~outside)
            axis = beyond[inner].argmax(axis=1)
            normals[inner, axis] = sign[inner, axis]
            distance[inner] = beyond[inner, axis]
        return np.asarray(distance - self.radius), np.asarray(normals @ self.rotation.T)

    def along(self, start: Array, end: Array) -> tuple[Array, Array]:
        """Smallest signed distance of segments and where it is.

        Args:
            start: (M, 3) [m].
            end: (M, 3) [m].

        Returns:
            The distance (M,) [m], negative inside, and the position on the segment (M,) in 0..1.
        """
        a, d = self._local(start, end)
        t = _closest(a, d, self.half)
        distance = lengths(self._to_core(a + t[:, None] * d))
        if not self._ball and (distance <= 1e-12).any():
            inner = np.flatnonzero(distance <= 1e-12)
            t[inner], distance[inner] = _deepest(a[inner], d[inner], self.half)
        return np.asarray(distance - self.radius), t

    def hit(self, start: Array, end: Array, pad: float) -> NDArray[np.bool_]:
        """Whether segments from (M, 3) to (M, 3) [m] come closer than `pad` [m], (M,); quicker than `along`."""
        a, d = self._local(start, end)
        beyond = self._to_core(a + _closest(a, d, self.half)[:, None] * d)
        return np.asarray(dots(beyond, beyond) < (self.radius + pad) ** 2)

    def near(self, start: Array, end: Array, within: float) -> NDArray[np.intp]:
        """Indices of the segments (M, 3) to (M, 3) [m] that may come closer than `within` [m]: a quick sieve."""
        twice = lengths(start + end - 2.0 * self.center) - lengths(end - start)
        return (twice < 2.0 * (self.reach + within)).nonzero()[0]


def build(
    scene: Scene, robot: Robot, *, contacts: Sequence[str] = (), shape: Literal["box", "sphere"] = "box"
) -> tuple[Obstacle, ...]:
    """The scene's objects as obstacles, without those in `contacts`.

    Args:
        scene: Whose objects.
        robot: Its `obstacle_margin` is the distance to keep, its `object_size` the edge of an object of unknown size.
        contacts: Names of objects that are meant to be touched.
        shape: "box" keeps the cuboid, "sphere" replaces it by its bounding sphere (the paper).

    Raises:
        UnknownObject: If a contact is not in the scene.
    """
    touched = {scene[name].name for name in contacts}
    return tuple(from_object(item, robot, shape) for item in scene if item.name not in touched)


def from_object(item: SceneObject, robot: Robot, shape: Literal["box", "sphere"]) -> Obstacle:
    """One object as an obstacle that is to be kept clear of by the robot's `obstacle_margin`."""
    size = np.full(3, robot.object_size) if item.dimensions is None else np.asarray(item.dimensions)
    half, radius = size / 2.0, robot.obstacle_margin
    if shape == "sphere":
        half, radius = np.zeros(3), float(np.linalg.norm(half)) + radius
    return Obstacle(item.name, np.asarray(item.position), item.rotation, half, radius)


def _closest(a: Array, d: Array, half: Array) -> Array:
    """Where the segments a + t d are closest to the cuboid |x| <= half, (M,) in 0..1.

    The squared distance is convex and piecewise quadratic in t, with breaks where a coordinate enters or leaves
    the cuboid; its slope is linear between breaks, so its zero is found by interpolation.
    """
    if not half.any():
        nearest = -dots(a, d) / np.maximum(dots(d, d), 1e-300)
        return np.asarray(np.minimum(np.maximum(nearest, 0.0), 1.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        breaks = np.concatenate([(half - a) / d, (-half - a) / d], axis=1)
    breaks = np.clip(np.where(np.isfinite(breaks), breaks, 0.0), 0.0, 1.0)
    rows = len(a)
    t = np.sort(np.concatenate([np.zeros((rows, 1)), breaks, np.ones((rows, 1))], axis=1), axis=1)
    x = a[:, None, :] + t[:, :, None] * d[:, None, :]
    slope = ((x - np.clip(x, -half, half)) * d[:, None, :]).sum(axis=2)
    last = np.maximum((slope <= 0).sum(axis=1) - 1, 0)
    after = np.minimum(last + 1, t.shape[1] - 1)
    i = np.arange(rows)
    t0, t1, g0, g1 = t[i, last], t[i, after], slope[i, last], slope[i, after]
    share = np.divide(-g0, g1 - g0, out=np.zeros(rows), where=g1 > g0)
    return np.asarray(t0 + np.clip(share, 0.0, 1.0) * (t1 - t0))


def _deepest(a: Array, d: Array, half: Array) -> tuple[Array, Array]:
    """Where segments that cross the cuboid |x| <= half are deepest inside, and the signed depth there (<= 0).

    Inside, the signed distance is the largest of six linear functions; its minimum lies where two of them cross.
    """
    offset = np.concatenate([a - half, -a - half], axis=1)
    rate = np.concatenate([d, -d], axis=1)
    j, k = _PAIRS
    gap = rate[:, j] - rate[:, k]
    cross = np.divide(offset[:, k] - offset[:, j], gap, out=np.zeros_like(gap), where=np.abs(gap) > 1e-300)
    ends = np.broadcast_to([0.0, 1.0], (len(a), 2))
    t = np.concatenate([ends, np.minimum(np.maximum(cross, 0.0), 1.0)], axis=1)
    depth = (offset[:, None, :] + t[:, :, None] * rate[:, None, :]).max(axis=2)
    best = depth.argmin(axis=1)
    i = np.arange(len(a))
    return t[i, best], np.minimum(depth[i, best], 0.0)
