"""Your own constraints: a margin function and its linearisation; ready-made convex sets and boxes to keep out of.

    @dataclass(frozen=True)
    class BelowShelf:
        height: float
        name = "below the shelf"
        unit = "m"
        limit = "under the shelf"

        def margin(self, trajectory):           # (N,), >= 0 where the limit holds
            return self.height - trajectory.positions[:, 2]

        def rows(self, path):                   # normals . x_i >= offsets, near this path (N, 3)
            n = len(path)
            return Rows(np.arange(n), np.tile([0.0, 0.0, -1.0], (n, 1)), np.full(n, -self.height))

    constrain(..., options=ConstraintOptions(custom=(BelowShelf(0.8),)))

The solver linearises `rows` again at every iterate; `verify` uses `margin` alone. A constraint that cannot be helped
by moving the path (say, on orientations) returns `Rows.none()` and is then only measured. Packages offer constraints
by name through the entry point group "ovita.limits".

The convex sets are plain data and are met exactly: a segment between two points of a convex set stays in it, and the
solver approaches the set by cuts, half-spaces n.x >= c that contain it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Protocol, Self, runtime_checkable

import numpy as np

from ovita.errors import ConstraintDefinitionError
from ovita.limits.problem import Obstacle
from ovita.limits.qp import Rows
from ovita.paths.geometry import lengths
from ovita.paths.trajectory import Array, Trajectory
from ovita.plugins import entries
from ovita.plugins import load as loaded


@runtime_checkable
class Constraint(Protocol):
    """A limit of your own.

    Attributes:
        name: For reports.
        unit: Of the margin.
        limit: The limit in words.
    """

    @property
    def name(self) -> str:
        """For reports."""

    @property
    def unit(self) -> str:
        """Of the margin, such as "m"."""

    @property
    def limit(self) -> str:
        """The limit in words."""

    def margin(self, trajectory: Trajectory) -> Array:
        """Margin of each waypoint (N,) or segment (N-1,) to the limit; negative where violated."""

    def rows(self, path: Array) -> Rows:
        """Linearised limits near a path (N, 3) [m]."""


def load(name: str, **values: Any) -> Constraint:
    """The constraint that an installed package offers under this name.

    Args:
        name: Of the entry point in the group "ovita.limits".
        values: Handed to it, if it is callable.

    Raises:
        ConstraintDefinitionError: If there is none, or it is not a constraint.
    """
    found = loaded("limits", name, ConstraintDefinitionError)
    if found is None:
        known = ", ".join(sorted(entries("limits"))) or "none at all"
        raise ConstraintDefinitionError(f"no installed package offers the constraint {name!r}; on offer: {known}")
    return check(found(**values) if callable(found) else found)


def check(candidate: object) -> Constraint:
    """The candidate itself, if it is a constraint.

    Raises:
        ConstraintDefinitionError: If it lacks name, unit, limit, margin or rows.
    """
    if not isinstance(candidate, Constraint):
        raise ConstraintDefinitionError(
            f"{candidate!r} is not a constraint: it needs name, unit, limit, margin(trajectory) and rows(path)"
        )
    return candidate


Vector = tuple[float, float, float]


class ConvexSet(ABC):
    """A convex set that every waypoint must be in."""

    unit = "m"

    @abstractmethod
    def excess(self, points: Array) -> Array:
        """By how much points (M, 3) are outside, (M,) [m]; <= 0 inside."""

    @abstractmethod
    def project(self, points: Array) -> Array:
        """The nearest points of the set, (M, 3) [m]."""

    @abstractmethod
    def cut(self, points: Array) -> tuple[Array, Array]:
        """Supporting half-space n.x >= c at the border nearest to each point, (M, 3), (M,)."""

    @abstractmethod
    def shrunk(self, by: float) -> Self:
        """The set without a border of that width [m]."""

    def margin(self, trajectory: Trajectory) -> Array:
        """Distance of each waypoint to the border, (N,) [m]; negative outside."""
        return np.asarray(-self.excess(trajectory.positions))

    def rows(self, path: Array) -> Rows:
        """The cuts at a path (N, 3)."""
        normals, offsets = self.cut(path)
        return Rows(np.arange(len(path)), normals, offsets)


@dataclass(frozen=True)
class Ball(ConvexSet):
    """Stay within `radius` [m] of `center` [m]: for a manipulator, its reach."""

    center: Vector
    radius: float
    name: str = "ball"

    def __post_init__(self) -> None:
        _positive(self.name, radius=self.radius)

    @property
    def limit(self) -> str:
        """In words."""
        return f"within {self.radius:g} m of {_point(self.center)}"

    def excess(self, points: Array) -> Array:
        """See `ConvexSet`."""
        return np.asarray(lengths(self.away(points)) - self.radius)

    def project(self, points: Array) -> Array:
        """See `ConvexSet`."""
        away = self.away(points)
        distance = lengths(away)[:, None]
        inner = points - away * (1.0 - self.radius / np.maximum(distance, 1e-300))
        return np.where(distance > self.radius, inner, points)

    def cut(self, points: Array) -> tuple[Array, Array]:
        """See `ConvexSet`."""
        away = self.away(points)
        normals = -away / np.maximum(lengths(away)[:, None], 1e-300)
        return normals, normals @ np.asarray(self.center) - self.radius

    def shrunk(self, by: float) -> Self:
        """See `ConvexSet`."""
        return replace(self, radius=max(self.radius - by, 1e-9))

    def away(self, points: Array) -> Array:
        """Vectors (M, 3) [m] from the middle to points (M, 3)."""
        return np.asarray(points - np.asarray(self.center))


@dataclass(frozen=True)
class Cylinder(Ball):
    """Stay within `radius` [m] of the straight line through `center` [m] along `axis`, endless."""

    axis: Vector = (0.0, 0.0, 1.0)
    name: str = "cylinder"

    def __post_init__(self) -> None:
        _positive(self.name, radius=self.radius, axis=float(np.linalg.norm(self.axis)))

    @property
    def limit(self) -> str:
        """In words."""
        return f"within {self.radius:g} m of the line through {_point(self.center)} along {_point(self.axis)}"

    def away(self, points: Array) -> Array:
        """Vectors (M, 3) [m] from the line to points (M, 3)."""
        along = np.asarray(self.axis) / np.linalg.norm(self.axis)
        offset = super().away(points)
        return np.asarray(offset - (offset @ along)[:, None] * along)


@dataclass(frozen=True)
class Polytope(ConvexSet):
    """Stay where normals[k] . x <= offsets[k] for every k, with normals (K, 3) and offsets (K,) [m]."""

    normals: tuple[Vector, ...]
    offsets: tuple[float, ...]
    name: str = "polytope"

    def __post_init__(self) -> None:
        lengths = np.linalg.norm(np.asarray(self.normals, dtype=float).reshape(-1, 3), axis=1)
        if len(lengths) != len(self.offsets) or not len(lengths):
            raise ConstraintDefinitionError(f"{self.name}: {len(lengths)} normals but {len(self.offsets)} offsets")
        for length in lengths:
            _positive(self.name, normal=float(length))
        unit = tuple(tuple(float(v) / w for v in n) for n, w in zip(self.normals, lengths, strict=True))
        object.__setattr__(self, "normals", unit)
        object.__setattr__(self, "offsets", tuple(float(o / w) for o, w in zip(self.offsets, lengths, strict=True)))

    @property
    def limit(self) -> str:
        """In words."""
        return f"inside {len(self.offsets)} planes"

    def excess(self, points: Array) -> Array:
        """The distance to the plane that is exceeded most."""
        return np.asarray((points @ np.asarray(self.normals).T - np.asarray(self.offsets)).max(axis=1))

    def project(self, points: Array) -> Array:
        """By Dykstra's alternating projections."""
        normals, offsets = np.asarray(self.normals), np.asarray(self.offsets)
        moved, memory = points.copy(), np.zeros((len(offsets), *points.shape))
        for _ in range(500):
            if float(self.excess(moved).max(initial=-1.0)) <= 1e-12:
                break
            for k in range(len(offsets)):
                tried = moved + memory[k]
                moved = tried - np.maximum(tried @ normals[k] - offsets[k], 0.0)[:, None] * normals[k]
                memory[k] = tried - moved
        return moved

    def cut(self, points: Array) -> tuple[Array, Array]:
        """The plane that is exceeded most, or that is nearest."""
        normals, offsets = np.asarray(self.normals), np.asarray(self.offsets)
        worst = (points @ normals.T - offsets).argmax(axis=1)
        return -normals[worst], -offsets[worst]

    def shrunk(self, by: float) -> Self:
        """See `ConvexSet`."""
        return replace(self, offsets=tuple(o - by for o in self.offsets))


@dataclass(frozen=True)
class KeepOut:
    """Keep out of an axis-aligned box, corners `lower` and `upper` [m]; whole segments are kept out."""

    lower: Vector
    upper: Vector
    name: str = "keep-out box"
    unit = "m"

    def __post_init__(self) -> None:
        if any(a > b for a, b in zip(self.lower, self.upper, strict=True)):
            raise ConstraintDefinitionError(f"{self.name}: lower {list(self.lower)} exceeds upper {list(self.upper)}")

    @property
    def limit(self) -> str:
        """In words."""
        return f"outside the box {_point(self.lower)} .. {_point(self.upper)}"

    @property
    def body(self) -> Obstacle:
        """The box as an obstacle."""
        lower, upper = np.asarray(self.lower, dtype=float), np.asarray(self.upper, dtype=float)
        return Obstacle((lower + upper) / 2.0, np.eye(3), (upper - lower) / 2.0, 0.0, self.name)

    def margin(self, trajectory: Trajectory) -> Array:
        """Distance of each segment to the box, (N-1,) [m]; negative inside."""
        return self.body.along(trajectory.positions[:-1], trajectory.positions[1:])[0]

    def rows(self, path: Array) -> Rows:
        """No rows: the solver takes the box as an obstacle."""
        return Rows.none()


_KINDS: Mapping[str, Callable[..., Any]] = {
    "ball": Ball,
    "cylinder": Cylinder,
    "polytope": Polytope,
    "keep-out": KeepOut,
}


def region(data: Mapping[str, Any]) -> Ball | Cylinder | Polytope | KeepOut:
    """Build a region from data such as {"kind": "cylinder", "center": [0, 0, 0], "radius": 0.5}.

    Raises:
        ConstraintDefinitionError: If the kind is unknown or a value is missing or senseless.
    """
    values = {k: tuple(v) if isinstance(v, list) else v for k, v in data.items() if k != "kind"}
    try:
        built: Ball | Cylinder | Polytope | KeepOut = _KINDS[data["kind"]](**values)
    except KeyError:
        raise ConstraintDefinitionError(f"a region needs a kind, one of {', '.join(_KINDS)}") from None
    except (TypeError, ValueError) as problem:
        raise ConstraintDefinitionError(f"{data['kind']}: {problem}") from None
    return built


def _positive(name: str, **values: float) -> None:
    for key, value in values.items():
        if not (np.isfinite(value) and value > 0):
            raise ConstraintDefinitionError(f"{name}: {key} {value!r} is not > 0")


def _point(values: Vector) -> str:
    return "(" + ", ".join(f"{v:g}" for v in values) + ")"
