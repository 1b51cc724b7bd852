"""Solids: boxes, cylinders and balls, and how far points and lines of sight are from the surfaces of many at once.

Coordinates lie in the middle axis, (P, 3, N) for P solids and N points, so that each of the three is a row of memory.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from ovita.paths.trajectory import Array
from ovita.perceive.evidence import Evidence

Kind = Literal["box", "cylinder", "sphere"]

CAUCHY = 2.5
"""Residual, in standard deviations, from which a pixel counts for less and less."""


@dataclass(frozen=True, eq=False)
class Solid:
    """A primitive shape.

    Args:
        kind: A box; a cylinder along its own z axis; a sphere.
        center: (3,) [m].
        rotation: (3, 3), columns are its axes.
        size: Full edge lengths of the cuboid around it (3,) [m].
        loss: Mean loss of the pixels, and a little for every number of the shape; 0.4 is noise alone.
        spread: Median distance of the measured points to its surface [m].
        tilted: Whether it stands on none of its faces.
        regular: Whether it explains the pixels; if not, it is the box around them.
    """

    kind: Kind
    center: Array
    rotation: Array
    size: Array
    loss: float = float("nan")
    spread: float = float("nan")
    tilted: bool = False
    regular: bool = True

    def turned(self, axes: Array, origin: Array) -> Solid:
        """Back from axes whose rows are (3, 3) and whose zero is `origin` (3,) in the world."""
        center, rotation = axes.T @ self.center + origin, axes.T @ self.rotation
        rotation, size = _plainest(self.kind, rotation, self.size)
        return replace(self, center=center, rotation=rotation, size=size)


def _plainest(kind: Kind, rotation: Array, size: Array) -> tuple[Array, Array]:
    """The same solid with its axes named so that its rotation is as small as can be."""
    if kind == "sphere":
        return np.eye(3), size
    if kind == "cylinder":
        axis = rotation[:, 2] * (1.0 if rotation[2, 2] >= 0 else -1.0)
        turn = np.cross((0.0, 0.0, 1.0), axis)
        sine, cosine = float(np.linalg.norm(turn)), float(axis[2])
        if sine < 1e-9:
            return np.eye(3), size
        return Rotation.from_rotvec(turn / sine * np.arctan2(sine, cosine)).as_matrix(), size
    best = max(_QUARTERS, key=lambda quarter: float(np.trace(rotation @ quarter)))
    return rotation @ best, np.abs(best.T) @ size


_QUARTERS = tuple(np.round(Rotation.create_group("O").as_matrix()))


def losses(residuals: Array) -> Array:
    """Mean Cauchy loss along the last axis."""
    return np.asarray(0.5 * CAUCHY**2 * np.log1p((residuals * (1.0 / CAUCHY)) ** 2).mean(axis=-1))


def rotations(vectors: Array) -> Array:
    """Rotation matrices (P, 3, 3) of rotation vectors (P, 3) [rad], after Rodrigues."""
    angles = np.sqrt((vectors**2).sum(axis=1))[:, None, None]
    cross = (vectors @ _CROSS).reshape(-1, 3, 3)
    safe = np.maximum(angles, 1e-12)
    return np.asarray(
        np.eye(3) + np.sin(safe) / safe * cross + 2.0 * (np.sin(0.5 * safe) / safe) ** 2 * (cross @ cross)
    )


_CROSS = np.cross(np.eye(3)[:, None], np.eye(3)[None]).swapaxes(1, 2).reshape(3, 9)
"""Takes a vector to the matrix, row by row, that makes the cross product with it."""


def misfits(kind: Kind, numbers: Array, turn: Array, evidence: Evidence, *, grounded: bool) -> Array:
    """How far points and lines of sight are from touching many solids (P, N + E), in standard deviations.

    Args:
        kind: Of the solids.
        numbers: (P, 9): centre, rotation vector in the solid's own axes, full size.
        turn: Rotation that the rotation vectors start from (3, 3).
        evidence: Points and touching lines.
        grounded: Whether the solids have no underside.
    """
    inverse = (turn @ rotations(numbers[:, 3:6])).swapaxes(1, 2)
    half, origin = 0.5 * numbers[:, 6:, None], inverse @ numbers[:, :3, None]
    near = _signed(kind, inverse @ evidence.points.T - origin, half, grounded)
    near *= evidence.point_weights
    eyes, rays = inverse @ evidence.eyes.T - origin, inverse @ evidence.rays.T
    at = _deepest(kind, eyes, rays, half, grounded)
    rays *= at[:, None]
    rays += eyes
    touch = _signed(kind, rays, half, grounded)
    touch *= evidence.ray_weights
    return np.concatenate([near, touch], axis=1)


def undersides(kind: Kind, numbers: Array, turn: Array) -> Array:
    """Heights of the lowest points of many solids, (P,) [m]; see `misfits`."""
    up = np.abs((turn @ rotations(numbers[:, 3:6]))[:, 2])
    half = 0.5 * numbers[:, 6:]
    if kind == "sphere":
        below = half[:, 0]
    elif kind == "cylinder":
        below = half[:, 0] * np.sqrt(np.maximum(1.0 - up[:, 2] ** 2, 0.0)) + half[:, 2] * up[:, 2]
    else:
        below = (up * half).sum(axis=1)
    return np.asarray(numbers[:, 2] - below)


def _signed(kind: Kind, local: Array, half: Array, grounded: bool) -> Array:
    """Signed distance of points (P, 3, N) in the solids' own axes to their surfaces, (P, N), negative inside."""
    if kind == "sphere":
        return np.asarray(_length(local[:, 0], local[:, 1], local[:, 2]) - half[:, 0])
    up = local[:, 2] if grounded else np.abs(local[:, 2])
    if kind == "cylinder":
        beyond = [_length(local[:, 0], local[:, 1]) - half[:, 0], up - half[:, 2]]
    else:
        beyond = [np.abs(local[:, 0]) - half[:, 0], np.abs(local[:, 1]) - half[:, 1], up - half[:, 2]]
    inner = beyond[0]
    for each in beyond[1:]:
        inner = np.maximum(inner, each)
    outer = _length(*(np.maximum(each, 0.0) for each in beyond))
    return np.asarray(outer + np.minimum(inner, 0.0))


def _length(*parts: Array) -> Array:
    total = parts[0] * parts[0]
    for part in parts[1:]:
        total += part * part
    return np.asarray(np.sqrt(total, out=total))


def _deepest(kind: Kind, eyes: Array, rays: Array, half: Array, grounded: bool) -> Array:
    """Where lines (P, 3, E) are deepest inside the solids, or pass them nearest, as distances along them (P, E).

    Midway between the last entry into and the first exit out of the slabs (for a cylinder: the tube and the slab) that
    the solid is the intersection of; exact where the line just touches, which is where it counts.
    """
    nearest = np.asarray(-np.einsum("pie,pie->pe", eyes, rays))
    if kind == "sphere":
        return nearest
    if kind == "cylinder":
        into, out = _through_tube(eyes, rays, half)
    else:
        first, second = (_through_slab(eyes[:, i], rays[:, i], half[:, i]) for i in (0, 1))
        into, out = np.maximum(first[0], second[0]), np.minimum(first[1], second[1])
    bottom, top = _through_slab(eyes[:, 2], rays[:, 2], half[:, 2], grounded)
    into, out = np.maximum(into, bottom), np.minimum(out, top)
    reach = 2.0 * np.sqrt((half**2).sum(axis=1))
    low, high = nearest - reach, nearest + reach
    return np.asarray(0.5 * (np.minimum(np.maximum(into, low), high) + np.minimum(np.maximum(out, low), high)))


def _through_slab(eyes: Array, rays: Array, half: Array, grounded: bool = False) -> tuple[Array, Array]:
    """Where lines enter and leave |x| <= half, or x <= half if it goes down for ever (P, E)."""
    steep = 1.0 / np.where(np.abs(rays) < 1e-12, 1e-12, rays)
    middle = eyes * steep
    if grounded:
        end = half * steep - middle
        down = rays < 0
        return np.where(down, end, -np.inf), np.where(down, np.inf, end)
    reach = np.abs(steep) * half
    return -middle - reach, reach - middle


def _through_tube(eyes: Array, rays: Array, half: Array) -> tuple[Array, Array]:
    """Where lines enter and leave the round side of a cylinder; twice where they pass it nearest if they miss it."""
    aa = np.maximum(rays[:, 0] ** 2 + rays[:, 1] ** 2, 1e-12)
    ab = eyes[:, 0] * rays[:, 0] + eyes[:, 1] * rays[:, 1]
    under = ab**2 - aa * (eyes[:, 0] ** 2 + eyes[:, 1] ** 2 - half[:, 0] ** 2)
    root = np.sqrt(np.maximum(under, 0.0))
    return (-ab - root) / aa, (root - ab) / aa
