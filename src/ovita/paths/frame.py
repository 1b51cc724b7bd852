"""Frames: which way left, right, front, back, up and down point, and the transforms between such frames.

The frames differ by quarter and half turns, so a transform exchanges and negates coordinates and never rounds them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ovita.errors import SceneError
from ovita.paths.trajectory import Array, Trajectory

DIRECTIONS = ("left", "right", "front", "back", "up", "down")

_AXES: Mapping[str, Mapping[str, tuple[float, float, float]]] = {
    "rfu": {"right": (1, 0, 0), "front": (0, 1, 0), "up": (0, 0, 1)},
    "flu": {"front": (1, 0, 0), "left": (0, 1, 0), "up": (0, 0, 1)},
    "ned": {"front": (1, 0, 0), "right": (0, 1, 0), "down": (0, 0, 1)},
}
OPPOSITE = {"left": "right", "right": "left", "front": "back", "back": "front", "up": "down", "down": "up"}


@dataclass(frozen=True)
class Frame:
    """Which way the words left, right, front, back, up and down point in world coordinates.

    Args:
        name: "rfu" (+x right, +y front, +z up), "flu" (+x front, +y left, +z up; ROS REP-103) or
            "ned" (+x front (north), +y right (east), +z down).
        level: The height that what moves in it keeps, as on a floor [m]; an object or a place between two is meant at
            that height then. None for what can rise.

    Raises:
        SceneError: For any other name.
    """

    name: str = "rfu"
    level: float | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or self.name not in _AXES:
            raise SceneError(f"unknown frame {self.name!r}; known frames are {', '.join(_AXES)}", key="frame")

    def direction(self, word: str) -> Array:
        """Unit vector (3,) of a direction word.

        Raises:
            SceneError: If the word is not one of left, right, front, back, up, down.
        """
        axes = _AXES[self.name]
        if word in axes:
            return np.array(axes[word], dtype=float)
        if OPPOSITE.get(word) in axes:
            return -np.array(axes[OPPOSITE[word]], dtype=float)
        raise SceneError(f"unknown direction {word!r}; directions are {', '.join(DIRECTIONS)}", key="direction")

    def offset(self, **amounts: float) -> Array:
        """Sum of direction words times metres: `offset(left=0.2, up=0.1)` to a vector (3,) [m]."""
        return sum((amount * self.direction(word) for word, amount in amounts.items()), np.zeros(3))

    def levelled(self, point: Array) -> Array:
        """A point (3,) [m], right above or below where it is at the height that is kept; as it is where none is."""
        up = self.direction("up")
        return point if self.level is None else np.asarray(point + (self.level - point @ up) * up)

    def words(self, vector: Array) -> dict[str, float]:
        """Split a vector (3,) [m] into the direction words that it points along, each with metres > 0."""
        parts = {word: float(np.dot(vector, self.direction(word))) for word in DIRECTIONS}
        return {word: amount for word, amount in parts.items() if amount > 0}

    def describe(self) -> str:
        """One line for people and prompts, such as "+x right, +y front, +z up"."""
        return ", ".join(f"+{axis} {word}" for axis, word in zip("xyz", _AXES[self.name], strict=True))


RFU = Frame("rfu")


def rotation(source: Frame, target: Frame) -> Array:
    """The matrix (3, 3) that takes coordinates in `source` to those in `target`."""
    words = ("right", "front", "up")
    there = np.column_stack([target.direction(word) for word in words])
    here = np.column_stack([source.direction(word) for word in words])
    return np.asarray(there @ here.T)


def transformed(trajectory: Trajectory, source: Frame, target: Frame) -> Trajectory:
    """The trajectory with its positions and orientations written in another frame."""
    return trajectory if source == target else rotated(trajectory, rotation(source, target))


def rotated(trajectory: Trajectory, matrix: Array) -> Trajectory:
    """The trajectory turned by a rotation matrix (3, 3)."""
    orientations = trajectory.orientations
    if orientations is not None:
        orientations = product(quaternion(matrix), orientations)
    return replace(trajectory, positions=trajectory.positions @ matrix.T + 0.0, orientations=orientations)


def quaternion(matrix: Array) -> Array:
    """Unit quaternion (4,) wxyz of a rotation matrix (3, 3), by its largest component."""
    m = matrix
    squares = np.array(
        [
            1 + m[0, 0] + m[1, 1] + m[2, 2],
            1 + m[0, 0] - m[1, 1] - m[2, 2],
            1 - m[0, 0] + m[1, 1] - m[2, 2],
            1 - m[0, 0] - m[1, 1] + m[2, 2],
        ]
    )
    a, b, c = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    d, e, f = m[0, 1] + m[1, 0], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1]
    rows = np.array([[squares[0], a, b, c], [a, squares[1], d, e], [b, d, squares[2], f], [c, e, f, squares[3]]])
    row = rows[int(np.argmax(squares))]
    return np.asarray(row / np.linalg.norm(row))


def matrix(quaternion: Array) -> Array:
    """Rotation matrix (3, 3) of a unit quaternion (4,) wxyz."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def product(left: Array, right: Array) -> Array:
    """Quaternion product of one (4,) with many (N, 4), wxyz."""
    w, x, y, z = left
    turn = np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])
    return np.asarray(right @ turn.T)
