"""Robots as far as a trajectory is concerned: workspace, margins and speed limit."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ovita.errors import RobotError
from ovita.paths.scene import DEFAULT_SIZE
from ovita.paths.trajectory import Array, is_real
from ovita.plugins import blamed, culprit, entries, load

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


def _not_negative(value: Any) -> bool:
    return is_real(value) and value >= 0


def _limit(value: Any) -> bool:
    return value is None or (is_real(value) and value > 0)


_WANTED: Mapping[str, tuple[Callable[[Any], bool], str]] = {
    **dict.fromkeys(
        ("margin", "obstacle_margin", "object_size", "radius", "person_margin"), (_not_negative, "a length >= 0 m")
    ),
    "max_speed": (_limit, "a speed > 0 m/s; leave it out for no limit"),
    **dict.fromkeys(
        ("max_acceleration", "max_lateral_acceleration"),
        (_limit, "an acceleration > 0 m/s^2; leave it out for no limit"),
    ),
    "min_speed": (_not_negative, "a speed >= 0 m/s"),
}
"""What each value has to be."""


@dataclass(frozen=True)
class Robot:
    """The limits that an adapted trajectory must obey.

    The workspace bounds the path itself (for an arm, its tool centre point); distances to objects count from the
    body, a ball of `radius` around every point of the path.

    Args:
        name: For reports.
        workspace: Where the path must stay, or None for anywhere.
        margin: Distance kept between the path and the workspace's border [m].
        obstacle_margin: Distance kept between the body and every object [m].
        max_speed: [m/s], or None for no limit.
        object_size: Edge of the cube assumed for an object without dimensions [m].
        radius: Of the body around the path's point [m]; 0 for a point.
        person_margin: Distance kept between the body and a person [m]; see `limits.kinds`.
        max_acceleration: Along the path [m/s^2], or None for no limit.
        max_lateral_acceleration: Across the path, v^2 times curvature [m/s^2], or None for no limit.
        min_speed: Lowest speed while moving [m/s]; 0 for no limit. Standing still is always allowed.
        planar: Whether the robot cannot leave the horizontal plane of its path.

    Raises:
        RobotError: On values that are negative, not finite, or leave no workspace.
    """

    name: str = "none"
    workspace: Box | Shell | None = None
    margin: float = 0.01
    obstacle_margin: float = 0.01
    max_speed: float | None = 1.0
    object_size: float = DEFAULT_SIZE
    radius: float = 0.0
    person_margin: float = 0.3
    max_acceleration: float | None = None
    max_lateral_acceleration: float | None = None
    min_speed: float = 0.0
    planar: bool = False

    def __post_init__(self) -> None:
        for key, (fits, what) in _WANTED.items():
            if not fits(getattr(self, key)):
                raise RobotError(f"{key} {getattr(self, key)!r} is not {what}")
        if self.max_speed is not None and self.min_speed > self.max_speed:
            raise RobotError(f"min_speed {self.min_speed:g} m/s exceeds max_speed {self.max_speed:g} m/s")
        if not isinstance(self.planar, bool):
            raise RobotError(f"planar {self.planar!r} is neither true nor false")
        if isinstance(self.workspace, Shell) and self.workspace.r_min + 2 * self.margin > self.workspace.r_max:
            raise RobotError(f"the margin {self.margin:g} m leaves nothing of the workspace")

    @classmethod
    def preset(cls, name: str) -> Robot:
        """A robot by name: "drone", "arm", "ground" or "none" (no workspace, no speed limit), an alias, or a plug-in's.

        Workspaces, margins and top speeds of the first three are those of the OVITA release; radius and accelerations
        are those of a Crazyflie 2, a hand flange and a Jackal, with their sources in docs/limits.md.

        Raises:
            RobotError: For any other name.
        """
        found = PRESETS.get(preset_name(name)) or _of_a_plugin(name)
        if found is None:
            known = (*PRESETS, *entries("robots"))
            raise RobotError(
                f"unknown robot {name!r}; presets are {', '.join(known)} (or {', '.join(ALIASES)}), "
                f"or give a .toml or .json file"
            )
        return found


def _of_a_plugin(name: str) -> Robot | None:
    found = load("robots", name, RobotError)
    if callable(found):
        with blamed("robots", name, RobotError):
            found = found()
    if found is not None and not isinstance(found, Robot):
        raise RobotError(f"{culprit('robots', name)} is a {type(found).__name__}, not a Robot")
    return found


ALIASES = {"iiwa": "arm", "crazyflie": "drone", "jackal": "ground", "rover": "ground"}
"""Other names of the presets: the machines that stand for them in simulation, and a rover."""


def preset_name(name: str) -> str:
    """The preset that a name or an alias means, in lower case; the name itself where it is neither."""
    return ALIASES.get(name.lower(), name.lower())


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
        Robot(
            "drone",
            Box((-3.0, -3.0, -1.0), (3.0, 3.0, 3.0)),
            radius=0.07,
            max_acceleration=4.0,
            max_lateral_acceleration=5.0,
        ),
        Robot(
            "arm",
            Shell((-0.5, 0.0, 0.6), 0.15, 1.2),
            radius=0.032,
            max_acceleration=13.0,
            max_lateral_acceleration=13.0,
        ),
        Robot(
            "ground",
            Box((-3.0, -3.0, -0.01), (3.0, 3.0, 0.01)),
            radius=0.33,
            max_acceleration=2.5,
            max_lateral_acceleration=2.5,
            planar=True,
        ),
        Robot("none", None, max_speed=None),
    )
}

UNLIMITED = PRESETS["none"]
"""The robot where none is named: no workspace and no limits on speed."""
