"""Poses as vectors in task frames: what skills are learned from, and how what frames say is put together.

A pose is a vector (d,): a position [m], d = 3, or a position and a rotation vector [rad] about a base orientation,
d = 6 (the quaternion logarithm). A task frame is a place with an orientation, such as an object's; a demonstration
looks the same in it wherever the object stands.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ovita.errors import RequestError
from ovita.paths.scene import Scene, matrix, product
from ovita.paths.trajectory import Array

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

START, GOAL = "start", "goal"
"""Task frames that every demonstration has: its first and its last position, with the world's axes."""

WIDEST = np.deg2rad(150.0)
"""Orientations farther than this from their mean have no unambiguous logarithm worth averaging [rad]."""

UNKNOWN = 1e6
"""Variance of what is not known [m2, rad2]."""

_IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


@dataclass(frozen=True, eq=False)
class TaskFrame:
    """A place with an orientation, in the world.

    Args:
        name: An object's name, "start", "goal", or "" for the world itself.
        origin: (3,) [m].
        turn: Unit quaternion (4,) wxyz.
    """

    name: str = ""
    origin: Array = field(default_factory=lambda: np.zeros(3))
    turn: Array = field(default_factory=lambda: _IDENTITY)


WORLD = TaskFrame()


@dataclass(frozen=True, eq=False)
class PathDistribution:
    """A Gaussian at each of some phases: where a demonstrated movement is then, and how much it varies.

    Args:
        phases: (T,), increasing from 0 to 1.
        mean: (T, d).
        covariance: (T, d, d).
        base: Orientation that rotation vectors are about, unit quaternion (4,) wxyz; None if d = 3.
    """

    phases: Array
    mean: Array
    covariance: Array
    base: Array | None = None

    def at(self, phases: Array) -> PathDistribution:
        """The Gaussians at other phases (M,), linearly interpolated."""
        where = np.interp(phases, self.phases, np.arange(len(self.phases), dtype=float))
        low = np.clip(where.astype(int), 0, len(self.phases) - 2)
        share = where - low
        mean = self.mean[low] + share[:, None] * (self.mean[low + 1] - self.mean[low])
        step = self.covariance[low + 1] - self.covariance[low]
        return PathDistribution(phases, mean, self.covariance[low] + share[:, None, None] * step, self.base)


def frames_of(names: Sequence[str], scene: Scene, start: Array, goal: Array) -> tuple[TaskFrame, ...]:
    """The task frames with these names: objects of a scene, or the ends (3,) [m] of a movement.

    Raises:
        UnknownObject: If the scene has no such object.
    """
    ends = {START: start, GOAL: goal}
    if not names:
        return (WORLD,)

    def frame(name: str) -> TaskFrame:
        if name in ends and name not in scene:
            return TaskFrame(name, ends[name])
        return TaskFrame(name, scene[name].position, scene[name].orientation)

    return tuple(map(frame, names))


def rotation(quaternions: Array) -> Rotation:
    """Quaternions (..., 4) wxyz as scipy's rotations, whose quaternions end with w."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(np.roll(quaternions, -1, axis=-1))


def wxyz(turns: Rotation) -> Array:
    """Scipy's rotations as quaternions (..., 4) wxyz."""
    return np.asarray(np.roll(turns.as_quat(), 1, axis=-1))


def mean_orientation(quaternions: Array) -> Array:
    """The mean (4,) of unit quaternions (..., 4) wxyz, whatever their signs."""
    return wxyz(rotation(quaternions.reshape(-1, 4)).mean())


def logarithm(base: Array, quaternions: Array) -> Array:
    """Rotation vectors (N, 3) [rad] that take a base (4,) to quaternions (N, 4), in the body's axes."""
    return np.asarray((rotation(base).inv() * rotation(quaternions)).as_rotvec())


def exponential(base: Array, vectors: Array) -> Array:
    """Unit quaternions (N, 4) wxyz that rotation vectors (N, 3) [rad] lead to from a base (4,): `logarithm` undone."""
    turned = rotation(base)
    return wxyz(turned * type(turned).from_rotvec(vectors))


def local(frame: TaskFrame, positions: Array, orientations: Array | None) -> tuple[Array, Array | None]:
    """Positions (N, 3) [m] and orientations (N, 4) of the world in a task frame."""
    turned = None if orientations is None else product(frame.turn * [1, -1, -1, -1], orientations)
    return (positions - frame.origin) @ matrix(frame.turn), turned


def vectors(positions: Array, orientations: Array | None, base: Array | None) -> Array:
    """Poses as vectors (N, d): positions (N, 3) [m], and orientations (N, 4) about a base (4,) where there is one.

    Raises:
        RequestError: If an orientation is nearly opposite to the base.
    """
    if orientations is None or base is None:
        return positions
    turns = logarithm(base, orientations)
    widest = float(np.linalg.norm(turns, axis=1).max())
    if widest > WIDEST:
        raise RequestError(
            f"the orientations lie up to {np.rad2deg(widest):.0f} degrees from their mean, too far to be averaged; "
            f"leave them out, or cut the movement in two"
        )
    return np.column_stack([positions, turns])


def in_world(reference: PathDistribution, frame: TaskFrame, base: Array | None) -> PathDistribution:
    """A reference in a task frame written in the world, its rotations about another base.

    Means are exact; the covariance of rotations is carried over to first order.
    """
    turn = matrix(frame.turn)
    d = reference.mean.shape[1]
    mean = np.empty_like(reference.mean)
    mean[:, :3] = reference.mean[:, :3] @ turn.T + frame.origin
    if base is not None and reference.base is not None:
        mean[:, 3:] = logarithm(base, product(frame.turn, exponential(reference.base, reference.mean[:, 3:])))
    jacobian = np.eye(d)
    jacobian[:3, :3] = turn
    return PathDistribution(reference.phases, mean, jacobian @ reference.covariance @ jacobian.T, base)


def fused(references: Sequence[PathDistribution], frames: Sequence[TaskFrame]) -> PathDistribution:
    """What several task frames say of one movement, written in the world, its rotations about the first frame's base.

    Where a frame's demonstrations agree closely, it decides; where they vary, the others do.
    """
    first = references[0].base
    base = None if first is None else product(frames[0].turn, first[None])[0]
    return multiplied([in_world(reference, frame, base) for reference, frame in zip(references, frames, strict=True)])


def multiplied(references: Sequence[PathDistribution]) -> PathDistribution:
    """The product of the Gaussians of several references at every phase.

    Source: Calinon, A tutorial on task-parameterized movement learning and retrieval (2016), equation 6, after the
    regression in each frame instead of before it.
    """
    first = references[0]
    if len(references) == 1:
        return first
    precisions = [np.linalg.inv(one.covariance) for one in references]
    covariance = np.linalg.inv(np.sum(precisions, axis=0))
    weighted = [np.einsum("tij,tj->ti", p, one.mean) for p, one in zip(precisions, references, strict=True)]
    mean = np.einsum("tij,tj->ti", covariance, np.sum(weighted, axis=0))
    return PathDistribution(first.phases, mean, covariance, first.base)


def off_the_way(positions: Array, phases: Array) -> Array:
    """How far positions (..., T, 3) [m] are from the straight way between their ends, at the same phases (T,)."""
    return positions - _way(positions[..., 0, :], positions[..., -1, :], phases)


def along_the_way(frames: PathDistribution, mean: Array, covariance: Array) -> PathDistribution:
    """What the way between the ends says, wherever task frames place these.

    A task frame turns and moves all of a movement with its object, also what is far from it and belongs to others.
    Between the ends, demonstrations vary less about the straight way from one to the other: by the mean (T, 3) [m] they
    are away from it, with the covariance (T, 3, 3).
    """
    s = frames.phases[:, None, None]
    ends = (1.0 - s) ** 2 * frames.covariance[0] + s**2 * frames.covariance[-1]
    there = np.tile(UNKNOWN * np.eye(frames.mean.shape[1]), (len(s), 1, 1))
    there[:, :3, :3] = covariance + ends[:, :3, :3]
    placed = frames.mean.copy()
    placed[:, :3] = mean + _way(frames.mean[0, :3], frames.mean[-1, :3], frames.phases)
    # At the ends it only repeats what the task frames said.
    trust = np.maximum(4.0 * s * (1.0 - s), 1e-6)
    return PathDistribution(frames.phases, placed, there / trust, frames.base)


def _way(start: Array, goal: Array, phases: Array) -> Array:
    return start[..., None, :] + phases[:, None] * (goal - start)[..., None, :]


def moments(rows: Array, floor: Array) -> tuple[Array, Array]:
    """Mean (T, d) and covariance (T, d, d) over demonstrations (D, T, d), kept regular.

    With few demonstrations the sample covariance is singular: it is drawn towards a diagonal of the same trace, wholly
    where there are two, and by d / (D + d) otherwise. A floor (d,) [squared units] is added.
    """
    mean = rows.mean(axis=0)
    count, d = len(rows), rows.shape[2]
    away = rows - mean
    covariance = np.einsum("nti,ntj->tij", away, away) / max(count - 1, 1)
    return mean, shrunk(covariance, 1.0 if count < 3 else d / (count + d)) + np.diag(floor)


def shrunk(covariance: Array, share: float) -> Array:
    """Covariances (T, d, d) drawn by a share towards diagonals of the same trace, positions and rotations apart."""
    target = np.zeros_like(covariance)
    for group in groups(covariance.shape[1]):
        level = np.trace(covariance[:, group, group], axis1=1, axis2=2) / 3.0
        target[:, group, group] = level[:, None, None] * np.eye(3)
    return (1.0 - share) * covariance + share * target


def groups(d: int) -> Iterable[slice]:
    """The components of a pose that share a unit: the position, and the rotation where d = 6."""
    return (slice(first, first + 3) for first in range(0, d, 3))
