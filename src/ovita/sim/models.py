"""Robot models: a file of bodies (MJCF or URDF) and a file of limits (TOML), read and checked."""

from __future__ import annotations

import os
import tomllib
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import TypeAdapter, ValidationError

from ovita.errors import RobotError

FOLDER = Path(__file__).parent / "models"
SHIPPED = ("iiwa", "jackal", "crazyflie")
STAND_INS = {"arm": "iiwa", "ground": "jackal", "drone": "crazyflie"}
"""The robot that stands for each preset of limits (`ovita.paths.robot.PRESETS`)."""


@dataclass(frozen=True)
class ArmLimits:
    """Limits of an arm that is bolted down.

    Args:
        velocity: Of each joint [rad/s].
        acceleration: Of each joint [rad/s^2].
        torque: Of each joint [Nm]; only for models without actuators, such as a URDF.
        postures: Joint positions that inverse kinematics starts from [rad].
    """

    velocity: tuple[float, ...]
    acceleration: tuple[float, ...]
    postures: tuple[tuple[float, ...], ...]
    torque: tuple[float, ...] = ()


@dataclass(frozen=True)
class RoverLimits:
    """Limits and wheels of a skid-steered rover.

    Args:
        max_speed: [m/s].
        max_turn: [rad/s].
        acceleration: [m/s^2].
        turn_acceleration: [rad/s^2].
        wheel_radius: [m].
        track: Between left and right wheels [m].
        left: Actuators of the left wheels, which take a speed [rad/s].
        right: Actuators of the right wheels.
        slip: The wheels are driven as if the track were wider by this factor, >= 1.
    """

    max_speed: float
    max_turn: float
    acceleration: float
    turn_acceleration: float
    wheel_radius: float
    track: float
    left: tuple[str, ...]
    right: tuple[str, ...]
    slip: float = 1.0


@dataclass(frozen=True)
class DroneLimits:
    """Limits and gains of a multirotor whose actuators are the thrusts of its rotors.

    Args:
        max_speed: [m/s].
        acceleration: [m/s^2].
        position_gain: [1/s^2].
        velocity_gain: [1/s].
        attitude_gain: [1/s^2].
        rate_gain: [1/s].
        endurance: How long it flies on one battery [s], or None if that is not known.
    """

    max_speed: float
    acceleration: float
    position_gain: float
    velocity_gain: float
    attitude_gain: float
    rate_gain: float
    endurance: float | None = None


@dataclass(frozen=True)
class Tip:
    """The point that follows the trajectory, for models without a site.

    Args:
        body: That it is fixed to.
        position: In that body's frame (3,) [m].
    """

    body: str
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class RobotModel:
    """A robot that can be simulated.

    Args:
        name: For commands and reports.
        title: For people.
        model: The MJCF or URDF file.
        controller: Which controller class drives it.
        tip: Site that follows the trajectory, or where on which body it is.
        limits: As that controller wants them.
        corner: The path may cut a corner by this [m].
        tolerance: Tracking error, root mean square over time, that counts as followed [m].
        peak_tolerance: Largest tracking error at any moment that counts as followed [m].
    """

    name: str
    title: str
    model: Path
    controller: Literal["arm", "rover", "drone"]
    tip: str | Tip
    limits: ArmLimits | RoverLimits | DroneLimits
    corner: float = 0.005
    tolerance: float = 0.05
    peak_tolerance: float = 0.1


@dataclass(frozen=True)
class _Common:
    """The keys that every TOML file has."""

    model: str
    controller: Literal["arm", "rover", "drone"]
    tip: str | Tip
    title: str = ""
    corner: float = field(default=0.005)
    tolerance: float = field(default=0.05)
    peak_tolerance: float | None = field(default=None)


_LIMITS: dict[str, type[ArmLimits | RoverLimits | DroneLimits]] = {
    "arm": ArmLimits,
    "rover": RoverLimits,
    "drone": DroneLimits,
}


def load_model(name: str | os.PathLike[str]) -> RobotModel:
    """Read a shipped robot by its name, or a robot of one's own from a .toml file.

    Raises:
        RobotError: If there is no such robot or its file is malformed; names the file and the key.
    """
    text = os.fspath(name)
    if text in SHIPPED:
        path = FOLDER / f"{text}.toml"
    elif text.endswith(".toml"):
        path = Path(text)
    else:
        raise RobotError(
            f"unknown robot {text!r}; robots that can be simulated are {', '.join(SHIPPED)}, or give a .toml file"
        )
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise RobotError(f"{path}: cannot be read: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise RobotError(f"{path}: is no TOML: {error}") from None
    return _model(path, document)


def _model(path: Path, document: dict[str, Any]) -> RobotModel:
    names = {f.name for f in fields(_Common)}
    common: _Common = _read(path, _Common, {k: v for k, v in document.items() if k in names})
    rest = {k: v for k, v in document.items() if k not in names}
    kind = _LIMITS[common.controller]
    known = [f.name for f in fields(kind)]
    for key in rest:
        if key not in known:
            raise RobotError(f"{path}: {key} is no key of a robot with controller {common.controller!r}")
    limits = _read(path, kind, rest)
    for f in fields(kind):
        value = getattr(limits, f.name)
        if f.type in ("float", "tuple[float, ...]") and not (np.isfinite(value).all() and (np.array(value) > 0).all()):
            raise RobotError(f"{path}: {f.name} {value!r} is not > 0")
    for key in ("corner", "tolerance", "peak_tolerance"):
        if getattr(common, key) is not None and not getattr(common, key) > 0:
            raise RobotError(f"{path}: {key} {getattr(common, key)!r} is not > 0 m")
    file = path.parent / common.model
    if not file.is_file():
        raise RobotError(f"{path}: model {common.model!r} does not exist beside it")
    return RobotModel(
        path.stem,
        common.title or path.stem,
        file,
        common.controller,
        common.tip,
        limits,
        common.corner,
        common.tolerance,
        2.0 * common.tolerance if common.peak_tolerance is None else common.peak_tolerance,
    )


def _read(path: Path, kind: Any, document: dict[str, Any]) -> Any:
    try:
        return TypeAdapter(kind).validate_python(document)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"]) or "it"
        raise RobotError(f"{path}: {key}: {first['msg'].lower()}") from None
