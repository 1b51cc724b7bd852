"""Scenes: the objects around a trajectory, and the frame that says which way is left."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ovita.errors import SceneError, UnknownObject
from ovita.paths.trajectory import Array

DEFAULT_SIZE = 0.05
"""Edge of the cube that stands for an object without dimensions [m]."""

DIRECTIONS = ("left", "right", "front", "back", "up", "down")

_AXES: Mapping[str, Mapping[str, tuple[float, float, float]]] = {
    "rfu": {"right": (1, 0, 0), "front": (0, 1, 0), "up": (0, 0, 1)},
    "flu": {"front": (1, 0, 0), "left": (0, 1, 0), "up": (0, 0, 1)},
    "ned": {"front": (1, 0, 0), "right": (0, 1, 0), "down": (0, 0, 1)},
}
_OPPOSITE = {"left": "right", "right": "left", "front": "back", "back": "front", "up": "down", "down": "up"}


@dataclass(frozen=True)
class Frame:
    """Which way the words left, right, front, back, up and down point in world coordinates.

    Args:
        name: "rfu" (+x right, +y front, +z up), "flu" (+x front, +y left, +z up; ROS REP-103) or
            "ned" (+x front (north), +y right (east), +z down).

    Raises:
        SceneError: For any other name.
    """

    name: str = "rfu"

    def __post_init__(self) -> None:
        if self.name not in _AXES:
            raise SceneError(f"unknown frame {self.name!r}; known frames are {', '.join(_AXES)}", key="frame")

    def direction(self, word: str) -> Array:
        """Unit vector (3,) of a direction word.

        Raises:
            SceneError: If the word is not one of left, right, front, back, up, down.
        """
        axes = _AXES[self.name]
        if word in axes:
            return np.array(axes[word], dtype=float)
        if _OPPOSITE.get(word) in axes:
            return -np.array(axes[_OPPOSITE[word]], dtype=float)
        raise SceneError(f"unknown direction {word!r}; directions are {', '.join(DIRECTIONS)}", key="direction")

    def offset(self, **amounts: float) -> Array:
        """Sum of direction words times metres: `offset(left=0.2, up=0.1)` to a vector (3,) [m]."""
        return sum((amount * self.direction(word) for word, amount in amounts.items()), np.zeros(3))

    def words(self, vector: Array) -> dict[str, float]:
        """Split a vector (3,) [m] into the direction words that it points along, each with metres > 0."""
        parts = {word: float(np.dot(vector, self.direction(word))) for word in DIRECTIONS}
        return {word: amount for word, amount in parts.items() if amount > 0}

    def describe(self) -> str:
        """One line for people and prompts, such as "+x right, +y front, +z up"."""
        return ", ".join(f"+{axis} {word}" for axis, word in zip("xyz", _AXES[self.name], strict=True))


RFU = Frame("rfu")


@dataclass(frozen=True, eq=False)
class SceneObject:
    """An oriented cuboid.

    Args:
        name: As written in the scene.
        position: Centre (3,) [m].
        dimensions: Full edge lengths (3,) [m], or None if the scene does not say.
        orientation: Unit quaternion (4,) wxyz.
        extra: Other keys of the scene file, kept as they were.

    Raises:
        SceneError: On an empty name or values that are not finite.
    """

    name: str
    position: Array
    dimensions: Array | None = None
    orientation: Array = field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0]))
    extra: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise SceneError("an object has no name", key="name")
        vector = self._vector("position", self.position, 3)
        object.__setattr__(self, "position", vector)
        if self.dimensions is not None:
            size = self._vector("dimensions", self.dimensions, 3)
            if (size < 0).any():
                raise SceneError(f"object {self.name!r}: dimensions {size.tolist()} are negative", key="dimensions")
            object.__setattr__(self, "dimensions", size)
        quaternion = self._vector("orientation", self.orientation, 4)
        norm = float(np.linalg.norm(quaternion))
        if norm < 1e-9:
            raise SceneError(f"object {self.name!r}: the orientation (wxyz) has length zero", key="orientation")
        if abs(norm - 1.0) > 1e-12:
            quaternion = quaternion / norm
            quaternion.flags.writeable = False
        object.__setattr__(self, "orientation", quaternion)

    def _vector(self, key: str, value: Any, size: int) -> Array:
        try:
            array = np.array(value, dtype=np.float64)
        except (TypeError, ValueError):
            array = np.zeros(0)
        if array.shape != (size,) or not np.isfinite(array).all():
            raise SceneError(f"object {self.name!r}: {key} must be {size} finite numbers, not {value!r}", key=key)
        array.flags.writeable = False
        return array

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, SceneObject):
            return NotImplemented
        if (self.dimensions is None) != (other.dimensions is None) or self.name != other.name:
            return False
        same_size = self.dimensions is None or np.array_equal(self.dimensions, other.dimensions)  # type: ignore[arg-type]
        return bool(
            same_size
            and np.array_equal(self.position, other.position)
            and np.array_equal(self.orientation, other.orientation)
            and dict(self.extra) == dict(other.extra)
        )

    __hash__ = None  # type: ignore[assignment]

    @property
    def size(self) -> Array:
        """Full edge lengths (3,) [m]: the dimensions, or a 5 cm cube."""
        return np.full(3, DEFAULT_SIZE) if self.dimensions is None else self.dimensions

    @property
    def radius(self) -> float:
        """Radius of the bounding sphere [m]: half the diagonal of the cuboid."""
        return float(np.linalg.norm(self.size)) / 2.0

    @property
    def rotation(self) -> Array:
        """Rotation matrix (3, 3): columns are the cuboid's axes in the world frame."""
        w, x, y, z = self.orientation
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )

    def distance(self, points: Array) -> Array:
        """Distance of points (N, 3) [m] to the centre, (N,) [m]."""
        return np.asarray(np.linalg.norm(points - self.position, axis=1))

    def clearance(self, points: Array) -> Array:
        """Signed distance of points (N, 3) [m] to the cuboid's surface, (N,) [m]; negative inside."""
        local = np.abs((points - self.position) @ self.rotation) - self.size / 2.0
        outside = np.linalg.norm(np.maximum(local, 0.0), axis=1)
        return np.asarray(outside + np.minimum(local.max(axis=1), 0.0))


@dataclass(frozen=True)
class Scene:
    """What surrounds a trajectory.

    Args:
        objects: With names that differ (ignoring case).
        frame: Which way is left.
        environment: Free description, or "".
        constraints_text: Free text on limits, or "".
        extra: Other keys of the scene file, kept as they were.

    Raises:
        SceneError: If two objects bear the same name.
    """

    objects: tuple[SceneObject, ...] = ()
    frame: Frame = RFU
    environment: str = ""
    constraints_text: str = ""
    extra: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "objects", tuple(self.objects))
        seen: dict[str, int] = {}
        for i, item in enumerate(self.objects):
            key = canonical(item.name)
            if key in seen:
                raise SceneError(
                    f"two objects are named {item.name!r} (numbers {seen[key]} and {i}); give each its own name",
                    key="objects",
                    index=i,
                )
            seen[key] = i

    def __iter__(self) -> Iterator[SceneObject]:
        return iter(self.objects)

    def __len__(self) -> int:
        return len(self.objects)

    def __bool__(self) -> bool:
        return True

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and self.find(name) is not None

    def __getitem__(self, name: str) -> SceneObject:
        """The object with that name; case, articles, plural and small typos are forgiven.

        Raises:
            UnknownObject: If no object fits, or more than one does equally well.
        """
        found = self.find(name)
        if found is None:
            raise UnknownObject(name, self.names)
        return found

    @property
    def names(self) -> tuple[str, ...]:
        """The objects' names as written in the scene."""
        return tuple(item.name for item in self.objects)

    def find(self, name: str) -> SceneObject | None:
        """The one object that `name` can mean, or None.

        Tried in turn, each accepted only if exactly one object fits: the same words, the same words without
        a plural s, a name that contains all the words, a close spelling.
        """
        wanted = canonical(name)
        if not wanted:
            return None
        names = [canonical(item.name) for item in self.objects]
        singular = [_singular(n) for n in names]
        words = set(_singular(wanted).split())
        for fits in (
            [i for i, n in enumerate(names) if n == wanted],
            [i for i, n in enumerate(singular) if n == _singular(wanted)],
            [i for i, n in enumerate(singular) if words <= set(n.split())],
            [i for i, n in enumerate(singular) if n in difflib.get_close_matches(_singular(wanted), singular, 3, 0.84)],
        ):
            if len(fits) == 1:
                return self.objects[fits[0]]
            if fits:
                return None
        return None


def canonical(name: str) -> str:
    """A name for comparison: lower case, words separated by one space, without a leading article."""
    words = re.sub(r"[\W_]+", " ", name.lower()).split()
    if len(words) > 1 and words[0] in ("the", "a", "an"):
        words = words[1:]
    return " ".join(words)


def _singular(name: str) -> str:
    return " ".join(w[:-1] if len(w) > 3 and w.endswith("s") and not w.endswith("ss") else w for w in name.split())
