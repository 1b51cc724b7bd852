"""Exact geometry of polylines and cuboids: lengths, distances between segments and bodies, turning angles.

A polyline is its waypoints (N, 3) [m] joined by straight segments. A place on it is a fractional waypoint index: 2.5 is
midway between waypoints 2 and 3, counted from 0.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ovita.paths.trajectory import Array, arc_length

Mask: TypeAlias = NDArray[np.bool_]

SAME_PLACE = 1e-9
"""Waypoints nearer than this to the one before them are taken for its repeats, as in a dwell [m]."""

_ONES = np.ones(3)
_NEXT, _AFTER = np.array([1, 2, 0]), np.array([2, 0, 1])
_PAIRS = np.triu_indices(6, 1)
_BLOCK = 1_000_000

GROUND = 0.01
"""Heights up to this are on the ground [m]."""

LEVEL = 0.01
"""A path whose heights differ by no more than this share of its extent is level."""


def dots(a: Array, b: Array) -> Array:
    """Scalar products of vectors (..., 3), (...)."""
    return np.asarray((a * b) @ _ONES)  # quicker than a sum over an axis of three


def lengths(vectors: Array) -> Array:
    """Lengths of vectors (..., 3), (...)."""
    return np.asarray(np.sqrt(dots(vectors, vectors)))


def crosses(a: Array, b: Array) -> Array:
    """Vector products of vectors (..., 3), (..., 3); quicker than numpy's, which takes any axes."""
    return np.asarray(a[..., _NEXT] * b[..., _AFTER] - a[..., _AFTER] * b[..., _NEXT])


def fractions(positions: Array) -> Array:
    """Share of the path's length travelled up to each waypoint, (N,) from 0 to 1; by index if it has no length."""
    s = arc_length(positions)
    return s / s[-1] if s[-1] > 0 else np.linspace(0.0, 1.0, len(s))


def extent(positions: Array) -> float:
    """Diagonal of the axis-aligned box around points (N, 3) [m]."""
    return float(np.linalg.norm(np.ptp(positions, axis=0)))


def is_level(positions: Array, up: Array) -> bool:
    """Whether a path (N, 3) [m] keeps its height, but for 1 % of its extent, as on a floor."""
    return bool(np.ptp(positions @ up) <= LEVEL * extent(positions))


def on_the_ground(positions: Array, up: Array) -> bool:
    """Whether a path (N, 3) [m] is level at the height of the ground, where only a robot that rolls can be."""
    return is_level(positions, up) and bool(np.abs(positions @ up).max() <= GROUND)


def spacing(positions: Array) -> float:
    """Mean length of the segments that have one [m]; 0 if none has."""
    steps = lengths(np.diff(positions, axis=0))
    return float(steps[steps > 0].mean()) if (steps > 0).any() else 0.0


def runs(mask: Mask) -> Iterator[tuple[int, int]]:
    """First and last index of each unbroken run of a mask, in order."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return ((int(a), int(b) - 1) for a, b in edges.reshape(-1, 2))


def repeats(positions: Array) -> Mask:
    """Mask (N,) of waypoints (N, 3) that repeat the position before them."""
    return np.concatenate([[False], lengths(np.diff(positions[:, :3], axis=0)) <= SAME_PLACE])


def project(path: Array, points: Array) -> tuple[Array, Array]:
    """The nearest place on a polyline for each of some points.

    Args:
        path: (N, 3) [m].
        points: (M, 3) [m].

    Returns:
        Distances (M,) [m] and the places as fractional waypoints (M,); the first of several equally near ones.
    """
    start, step = path[:-1], np.diff(path, axis=0)
    squared = np.maximum(dots(step, step), 1e-300)
    distance, place = np.empty(len(points)), np.empty(len(points))
    size = max(1, _BLOCK // len(step))
    for low in range(0, len(points), size):
        away = points[low : low + size, None] - start
        share = np.clip(dots(away, step) / squared, 0.0, 1.0)
        away -= share[:, :, None] * step
        gap = dots(away, away)
        nearest = gap.argmin(axis=1)
        rows = np.arange(len(nearest))
        distance[low : low + size] = np.sqrt(gap[rows, nearest])
        place[low : low + size] = nearest + share[rows, nearest]
    return distance, place


def path_distances(path: Array, points: Array) -> Array:
    """Distances (M,) [m] of points (M, 3) to a polyline (N, 3)."""
    return project(path, points)[0]


def closest_to_point(path: Array, point: Array) -> tuple[float, float]:
    """Distance [m] of a polyline (N, 3) to a point (3,), and the fractional waypoint where it occurs."""
    step, away = path[1:] - path[:-1], np.asarray(point, dtype=float) - path[:-1]
    share = np.minimum(np.maximum(dots(away, step) / np.maximum(dots(step, step), 1e-300), 0.0), 1.0)
    away = away - share[:, None] * step
    gap = dots(away, away)
    nearest = int(gap.argmin())
    return float(np.sqrt(gap[nearest])), float(nearest + share[nearest])


def within(path: Array, point: Array, radius: float) -> Mask:
    """Which waypoints (N,) of a polyline (N, 3) come within a radius [m] of a point (3,), or whose segment does.

    A segment that passes through the ball with both ends outside is represented by the end nearer to the point.
    """
    distance = lengths(path - point)
    inside = np.asarray(distance <= radius)
    start, step = path[:-1], np.diff(path, axis=0)
    share = np.clip(dots(point - start, step) / np.maximum(dots(step, step), 1e-300), 0.0, 1.0)
    through = (lengths(start + share[:, None] * step - point) <= radius) & ~inside[:-1] & ~inside[1:]
    ends = np.flatnonzero(through)
    inside[ends + (share[ends] > 0.5)] = True
    return inside


def within_core(path: Array, core: Cuboid, radius: float) -> Mask:
    """As `within`, of the middle of a wide body instead of a point."""
    if not core.half.any():
        return within(path, core.center, radius)
    inside = np.asarray(core.depth(path) <= radius)
    least, share = core.along(path[:-1], path[1:])
    ends = np.flatnonzero((least <= radius) & ~inside[:-1] & ~inside[1:])
    inside[ends + (share[ends] > 0.5)] = True
    return inside


def turning_angles(path: Array, least: float = 0.0) -> Array:
    """Angle (N,) [rad] by which a polyline (N, 3) turns at each waypoint; 0 at the ends and at repeated waypoints.

    A repeated waypoint is turned at where it is reached for the first time. Segments up to `least` [m] do not count.
    """
    angles = np.zeros(len(path))
    steps = np.diff(path, axis=0)
    moving = np.flatnonzero(lengths(steps) > max(SAME_PLACE, least))
    if len(moving) > 1:
        a, b = steps[moving[:-1]], steps[moving[1:]]
        angles[moving[:-1] + 1] = np.arctan2(lengths(crosses(a, b)), dots(a, b))
    return angles


def rotation_about(axis: Array, angle: float) -> Array:
    """Rotation matrix (3, 3) about a unit vector (3,) by an angle [rad], anticlockwise seen from its tip."""
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross)


@dataclass(frozen=True, eq=False)
class Cuboid:
    """All points closer than `radius` to an oriented box, its core; a core of no size makes it a ball.

    Its signed distance is a convex function, so along a segment it has one minimum, found exactly here; and for every
    unit vector n the half-space {x : n.x >= support(n)} is free of it.

    Args:
        center: (3,) [m].
        rotation: (3, 3), columns are the box's axes in the world.
        half: Half edge lengths of the core (3,) [m]; zeros for a ball.
        radius: Thickness of the layer around the core [m].
    """

    center: Array
    rotation: Array
    half: Array
    radius: float = 0.0

    @cached_property
    def reach(self) -> float:
        """Radius of the bounding ball, layer included [m]."""
        return float(np.linalg.norm(self.half)) + self.radius

    @cached_property
    def _ball(self) -> bool:
        return not self.half.any()

    def _to_core(self, local: Array) -> Array:
        """By how much points in the box's axes (M, 3) are beyond it, along each axis."""
        return local if self._ball else np.maximum(np.abs(local) - self.half, 0.0)

    def _local(self, start: Array, end: Array) -> tuple[Array, Array]:
        """Starts and directions of segments in the box's axes."""
        a, d = start - self.center, end - start
        return (a, d) if self._ball else (a @ self.rotation, d @ self.rotation)

    def support(self, normals: Array) -> Array:
        """Largest n.x over the body for unit vectors (M, 3), (M,) [m]."""
        return np.asarray(normals @ self.center + np.abs(normals @ self.rotation) @ self.half + self.radius)

    def signed(self, points: Array) -> tuple[Array, Array]:
        """Signed distance of points (M, 3) [m] to the surface, (M,) [m], negative inside, and outward normals (M, 3).

        At the very centre of a ball there is no normal; it is zero there.
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

    def depth(self, points: Array) -> Array:
        """Signed distance of points (M, 3) [m], (M,), as `signed` has it, without normals."""
        if self._ball:
            return np.asarray(lengths(points - self.center) - self.radius)
        beyond = np.abs((points - self.center) @ self.rotation) - self.half
        return np.asarray(lengths(np.maximum(beyond, 0.0)) + np.minimum(beyond.max(axis=1), 0.0) - self.radius)

    def on_surface(self, point: Array) -> Array:
        """The point of the surface (3,) [m] that is nearest to a point (3,), from inside and outside alike."""
        distance, normal = self.signed(point[None])
        return np.asarray(point - distance[0] * normal[0])

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

    def closest(self, path: Array) -> tuple[float, float]:
        """Smallest signed distance [m] of a polyline (N, 3), negative inside, and the fractional waypoint of it."""
        distance, t = self.along(path[:-1], path[1:])
        i = int(np.argmin(distance))
        return float(distance[i]), float(i + t[i])

    def hit(self, start: Array, end: Array, pad: float) -> Mask:
        """Whether segments from (M, 3) to (M, 3) [m] come closer than `pad` [m], (M,); quicker than `along`."""
        if self.radius + pad <= 0.0:
            return np.asarray(self.along(start, end)[0] < pad)
        a, d = self._local(start, end)
        beyond = self._to_core(a + _closest(a, d, self.half)[:, None] * d)
        return np.asarray(dots(beyond, beyond) < (self.radius + pad) ** 2)

    def near(self, start: Array, end: Array, within: float) -> NDArray[np.intp]:
        """Indices of the segments (M, 3) to (M, 3) [m] that may come closer than `within` [m]: a quick sieve."""
        twice = lengths(start + end - 2.0 * self.center) - lengths(end - start)
        return (twice < 2.0 * (self.reach + within)).nonzero()[0]


def _closest(a: Array, d: Array, half: Array) -> Array:
    """Where the segments a + t d are closest to the box |x| <= half, (M,) in 0..1.

    The squared distance is convex and piecewise quadratic in t, with breaks where a coordinate enters or leaves
    the box; its slope is linear between breaks, so its zero is found by interpolation.
    """
    if not half.any():
        nearest = -dots(a, d) / np.maximum(dots(d, d), 1e-300)
        return np.asarray(np.minimum(np.maximum(nearest, 0.0), 1.0))
    rows, moving = len(a), np.abs(d) > 1e-280
    t = np.zeros((rows, 8))
    t[:, 7] = 1.0
    np.divide(half - a, d, out=t[:, 1:4], where=moving)
    np.divide(-half - a, d, out=t[:, 4:7], where=moving)
    t = np.minimum(np.maximum(t, 0.0), 1.0)
    t.sort(axis=1)
    x = a[:, None, :] + t[:, :, None] * d[:, None, :]
    slope = ((x - np.minimum(np.maximum(x, -half), half)) @ d[:, :, None])[:, :, 0]
    last = np.maximum((slope <= 0).sum(axis=1) - 1, 0)
    after = np.minimum(last + 1, 7)
    i = np.arange(rows)
    t0, t1, g0, g1 = t[i, last], t[i, after], slope[i, last], slope[i, after]
    share = np.divide(-g0, g1 - g0, out=np.zeros(rows), where=g1 > g0)
    return np.asarray(t0 + np.minimum(np.maximum(share, 0.0), 1.0) * (t1 - t0))


def _deepest(a: Array, d: Array, half: Array) -> tuple[Array, Array]:
    """Where segments that cross the box |x| <= half are deepest inside, and the signed depth there (<= 0).

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
