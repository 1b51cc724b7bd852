"""Scenes: the frame that says which way is left, and the objects around a trajectory.

Frames differ by quarter and half turns, so a transform between two of them exchanges and negates coordinates and never
rounds them.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ovita.errors import SceneError, UnknownObject
from ovita.paths.geometry import Cuboid, closest_to_point, extent, is_level
from ovita.paths.trajectory import Array, Trajectory, interpolate
from ovita.text import listed, point

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


def side_passed(frame: Frame, path: Array, place: Array) -> str:
    """On which side of a place (3,) [m] a path (N, 3) [m] passes, as a direction word, seen from above.

    "" where it passes right over or under the place, within a hundredth of its extent.
    """
    up = frame.direction("up")
    flat = path - (path - place) @ up[:, None] * up
    nearest = closest_to_point(flat, place)[1]
    away = interpolate(flat, np.array([nearest]))[0] - place
    words = frame.words(away)
    word = max(words, key=words.__getitem__, default="")
    return word if words.get(word, 0.0) > 0.01 * extent(path) else ""


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


DEFAULT_SIZE = 0.05
"""Edge of the cube that stands for an object without dimensions [m]."""

UPRIGHT = 0.999
"""The upward share of an object's axis that is upright."""

WIDE = 3.0
"""How many times as long as it is thick, and as far as a path is from its surface, an object is that counts as wide."""

ASSUMED_SHARE = 0.5
"""Share of the room beside a path that an object of assumed size takes up at most."""


@dataclass(frozen=True, eq=False, repr=False)
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

    if TYPE_CHECKING:  # what may be given is wider than what is held

        def __init__(
            self,
            name: str,
            position: ArrayLike,
            dimensions: ArrayLike | None = None,
            orientation: ArrayLike = (1.0, 0.0, 0.0, 0.0),
            extra: Mapping[str, Any] = ...,
        ) -> None: ...

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
        arrays = ("position", "dimensions", "orientation")
        same = all(np.array_equal(getattr(self, key), getattr(other, key)) for key in arrays)
        return same and self.name == other.name and dict(self.extra) == dict(other.extra)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        size = "" if self.dimensions is None else f", {point(self.dimensions)}"
        return f"SceneObject({self.name!r}, {point(self.position)}{size})"

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
        return matrix(self.orientation)

    @cached_property
    def cuboid(self) -> Cuboid:
        """The body in space, for exact distances; an object without dimensions is a 5 cm cube."""
        return Cuboid(self.position, self.rotation, self.size / 2.0)

    def core(self, path: Array, of: str = "centre") -> Cuboid:
        """What a path (N, 3) [m] is closer to or farther from: the centre, or of a wide object the middle of its body.

        Past a wall or a pole the way to its centre leads along it; the line or the plate in its middle is straight
        ahead. An object is wide that is much longer than it is thick, and than the path is from its surface. Of an
        upright one that a level path passes at its height, it is the upright line in its middle: a path on the floor
        passes a door there, and not a metre below its centre.

        Args:
            path: (N, 3) [m].
            of: "surface" for all of the body, as stated distances are measured; without dimensions it is the centre.
        """
        if of == "surface" and self.dimensions is not None:
            return self.cuboid
        centre = Cuboid(self.position, self.rotation, np.zeros(3))
        if self.dimensions is None:
            return centre
        thickness, gap = float(self.size.min()), self.cuboid.closest(path)[0]
        inner = (self.size - thickness) / 2.0
        if gap > 0.0 and float(self.size.max()) > WIDE * max(thickness, gap):
            return replace(centre, half=inner)
        upright = np.abs(self.rotation[2]) > UPRIGHT
        beside = bool((np.abs(path[:, 2] - self.position[2]) <= self.size[upright].sum() / 2.0).all())
        level = beside and bool(upright.any()) and is_level(path, np.array([0.0, 0.0, 1.0]))
        return replace(centre, half=np.where(upright, inner, 0.0)) if level else centre

    def assumed_edge(self, path: Array, keep: float, edge: float = DEFAULT_SIZE) -> float:
        """Edge [m] to assume where the scene gives no dimensions: less than `edge` where a path shows that it is less.

        A path (N, 3) [m] leaves some room between the distance to keep [m] and the centre. The cube's bounding sphere
        takes at most `ASSUMED_SHARE` of it, so that an assumption neither calls that path too near nor rules out
        coming nearer.
        """
        room = max(closest_to_point(path, self.position)[0] - keep, 0.0)
        return float(min(edge, 2.0 * ASSUMED_SHARE * room / np.sqrt(3.0)))

    def body(self, path: Array, keep: float = 0.0) -> Cuboid:
        """As `cuboid`; without dimensions of the edge that a path (N, 3) [m] leaves, see `assumed_edge`."""
        if self.dimensions is not None:
            return self.cuboid
        return Cuboid(self.position, self.rotation, np.full(3, self.assumed_edge(path, keep) / 2.0))

    def distance(self, points: Array) -> Array:
        """Distance of points (N, 3) [m] to the centre, (N,) [m]."""
        return np.asarray(np.linalg.norm(points - self.position, axis=1))

    def clearance(self, points: Array) -> Array:
        """Signed distance of points (N, 3) [m] to the cuboid's surface, (N,) [m]; negative inside."""
        return self.cuboid.signed(points)[0]


@dataclass(frozen=True, repr=False)
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

    if TYPE_CHECKING:  # what may be given is wider than what is held

        def __init__(
            self,
            objects: Iterable[SceneObject] = (),
            frame: Frame = RFU,
            environment: str = "",
            constraints_text: str = "",
            extra: Mapping[str, Any] = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        if not isinstance(self.objects, Iterable) or not all(isinstance(item, SceneObject) for item in self.objects):
            raise SceneError("the objects of a scene are SceneObjects, such as SceneObject('cup', [0.4, 0.2, 0.1])")
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

    def __repr__(self) -> str:
        return f"<Scene: {listed(self.names) or 'no objects'}; frame {self.frame.name}>"

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

    def in_frame(self, target: Frame) -> Scene:
        """The scene with its objects written in another frame, which becomes its own."""
        if self.frame == target:
            return self
        turn = rotation(self.frame, target)
        turned = quaternion(turn)
        objects = tuple(
            replace(
                item, position=turn @ item.position + 0.0, orientation=product(turned, item.orientation[None, :])[0]
            )
            for item in self
        )
        return replace(self, objects=objects, frame=target)

    def find(self, name: str) -> SceneObject | None:
        """The one object that `name` can mean, or None; "(0.3, 0.2, 0.1)" is the point there, in the scene's frame [m].

        Tried in turn, each accepted only if exactly one object fits: the same words, the same words without
        a plural s, a name that contains all the words, a close spelling.
        """
        if POINT.fullmatch(name):
            return _point(name)
        wanted = canonical(name)
        fits = next(filter(None, self._fitting(wanted)), []) if wanted else []
        return fits[0] if len(fits) == 1 else None

    def _fitting(self, wanted: str) -> Iterator[list[SceneObject]]:
        names, singular, wanted_singular = self._canonical, self._singular, _singular(wanted)
        yield [o for o, n in zip(self.objects, names, strict=True) if n == wanted]
        yield [o for o, n in zip(self.objects, singular, strict=True) if n == wanted_singular]
        words = set(wanted_singular.split())
        yield [o for o, n in zip(self.objects, singular, strict=True) if words <= set(n.split())]
        close = difflib.get_close_matches(wanted_singular, singular, 3, 0.84)
        yield [o for o, n in zip(self.objects, singular, strict=True) if n in close]

    @cached_property
    def _canonical(self) -> tuple[str, ...]:
        return tuple(canonical(item.name) for item in self.objects)

    @cached_property
    def _singular(self) -> tuple[str, ...]:
        return tuple(map(_singular, self._canonical))


_COORDINATE = r"-?(?:\d+\.?\d*|\.\d+)"
POINT = re.compile(rf"\( ?{_COORDINATE}, ?{_COORDINATE}, ?{_COORDINATE} ?\)")
"""A point by its coordinates."""


@lru_cache(maxsize=1024)
def _point(name: str) -> SceneObject:
    """The object without a size that a point is; always the same one."""
    place = [float(value) for value in name.strip("()").split(",")]
    plain = f"({', '.join(f'{value:g}' for value in place)})"
    return SceneObject(name, place) if name == plain else _point(plain)


@lru_cache(maxsize=1024)
def canonical(name: str) -> str:
    """A name for comparison: lower case, words separated by one space, without a leading article."""
    words = re.sub(r"[\W_]+", " ", name.lower()).split()
    if len(words) > 1 and words[0] in ("the", "a", "an"):
        words = words[1:]
    return " ".join(words)


def _singular(name: str) -> str:
    return " ".join(w[:-1] if len(w) > 3 and w.endswith("s") and not w.endswith("ss") else w for w in name.split())
