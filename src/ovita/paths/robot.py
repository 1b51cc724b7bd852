"""Robots as far as a trajectory is concerned: workspace, margins and speed limit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ovita.errors import RobotError
from ovita.paths.scene import DEFAULT_SIZE
from ovita.paths.trajectory import Array

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Box:
    """An axis-aligned box that the path must stay in: corners `lower` and `upper` [m]."""

    lower: Vector
    upper: Vector
    kind: Literal["box"] = "box"

    def __post_init__(self) -> None:
        lower, upper = _vector("workspace.lower", self.lower), _vector("workspace.upper", self.upper)
        if any(a > b for a, b in zip(lower, upper, strict=True)):
            raise RobotError(f"workspace: lower {list(lower)} exceeds upper {list(upper)}")
        object.__setattr__(self, "lower", lower)
        object.__setattr__(self, "upper", upper)

    def inside(self, points: Array) -> Array:
        """Signed distance of points (N, 3) [m] to the nearest face, (N,) [m]; negative outside."""
        x, y, z = np.minimum(points - self.lower, np.subtract(self.upper, points)).T
        return np.asarray(np.minimum(np.minimum(x, y), z))

    def describe(self) -> str:
        """One line for people."""
        axes = (f"{a} {lo:g}..{hi:g}" for a, lo, hi in zip("xyz", self.lower, self.upper, strict=True))
        return "box " + ", ".join(axes) + " m"


@dataclass(frozen=True)
class Shell:
    """A spherical shell that the path must stay in: centre [m] and two radii [m]."""

    center: Vector
    r_min: float
    r_max: float
    kind: Literal["shell"] = "shell"

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", _vector("workspace.center", self.center))
        if not (np.isfinite(self.r_max) and 0 <= self.r_min < self.r_max):
            raise RobotError(f"workspace: radii {self.r_min!r}..{self.r_max!r} must satisfy 0 <= r_min < r_max")

    def inside(self, points: Array) -> Array:
        """Signed distance of points (N, 3) [m] to the nearest sphere, (N,) [m]; negative outside."""
        r = np.linalg.norm(points - np.asarray(self.center), axis=1)
        return np.asarray(np.minimum(r - self.r_min, self.r_max - r))

    def describe(self) -> str:
        """One line for people."""
        c = ", ".join(f"{x:g}" for x in self.center)
        return f"reach {self.r_min:g}..{self.r_max:g} m around ({c})"


@dataclass(frozen=True)
class Robot:
    """The limits that an adapted trajectory must obey.

    Args:
        name: For reports.
        workspace: Where the path must stay, or None for anywhere.
        margin: Distance kept from the workspace's border [m].
        obstacle_margin: Distance kept from every object [m].
        max_speed: [m/s], or None for no limit.
        object_size: Edge of the cube that stands for an object without dimensions [m].

    Raises:
        RobotError: On values that are negative, not finite, or leave no workspace.
    """

    name: str = "none"
    workspace: Box | Shell | None = None
    margin: float = 0.01
    obstacle_margin: float = 0.01
    max_speed: float | None = 1.0
    object_size: float = DEFAULT_SIZE

    def __post_init__(self) -> None:
        for key in ("margin", "obstacle_margin", "object_size"):
            value = getattr(self, key)
            if not (np.isfinite(value) and value >= 0):
                raise RobotError(f"{key} {value!r} is not a length >= 0 m")
        if self.max_speed is not None and not (np.isfinite(self.max_speed) and self.max_speed > 0):
            raise RobotError(f"max_speed {self.max_speed!r} is not a speed > 0 m/s; leave it out for no limit")
        if isinstance(self.workspace, Shell) and self.workspace.r_min + 2 * self.margin > self.workspace.r_max:
            raise RobotError(f"the margin {self.margin:g} m leaves nothing of the workspace")

    @classmethod
    def preset(cls, name: str) -> Robot:
        """One of the shipped robots: "drone", "arm", "ground" or "none" (no workspace, no speed limit).

        The figures of the first three are those of the OVITA release (field.md, section 1).

        Raises:
            RobotError: For any other name.
        """
        try:
            return PRESETS[name.lower()]
        except KeyError:
            raise RobotError(
                f"unknown robot {name!r}; presets are {', '.join(PRESETS)}, or give a .toml or .json file"
            ) from None


def _vector(key: str, value: object) -> Vector:
    try:
        x, y, z = (float(v) for v in value)  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        raise RobotError(f"{key} must be 3 numbers, not {value!r}") from None
    if not np.isfinite([x, y, z]).all():
        raise RobotError(f"{key} must be 3 finite numbers, not {value!r}")
    return x, y, z


PRESETS: dict[str, Robot] = {
    robot.name: robot
    for robot in (
        Robot("drone", Box((-3.0, -3.0, -1.0), (3.0, 3.0, 3.0))),
        Robot("arm", Shell((-0.5, 0.0, 0.6), 0.15, 1.2)),
        Robot("ground", Box((-3.0, -3.0, -0.01), (3.0, 3.0, 0.01))),
        Robot("none", None, max_speed=None),
    )
}
