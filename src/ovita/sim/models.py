"""Robot models: a file of bodies (MJCF or URDF) and a file of limits (TOML), read and checked."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from ovita.errors import FormatError, RobotError
from ovita.io.documents import parse_toml, validated
from ovita.io.files import read_text
from ovita.paths.robot import ALIASES, preset_name


class _Lazily:
    """A module that is imported when it is first used; what was taken from it once is at hand."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, name: str) -> Any:
        found = getattr(import_module(self._name), name)
        setattr(self, name, found)
        return found


mujoco: Any = _Lazily("mujoco")
"""The simulator, of the extra `sim`, which `require` checks for."""

_Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]

FOLDER = Path(__file__).parent / "models"
SHIPPED = ("iiwa", "jackal", "crazyflie")
STAND_INS = {"arm": "iiwa", "ground": "jackal", "drone": "crazyflie"}
"""The robot that stands for each preset of limits (`ovita.paths.robot.PRESETS`)."""


@dataclass(frozen=True)
class ArmLimits:
    """Limits of an arm that is bolted down, for each joint: velocity [rad/s], acceleration [rad/s^2], torque [Nm].

    Torques are only for models without actuators, such as a URDF; inverse kinematics starts from the postures [rad].
    """

    velocity: tuple[_Positive, ...]
    acceleration: tuple[_Positive, ...]
    postures: tuple[tuple[float, ...], ...]
    torque: tuple[_Positive, ...] = ()


@dataclass(frozen=True)
class RoverLimits:
    """Limits [m/s, rad/s, m/s^2, rad/s^2] and wheels of a skid-steered rover: radius and track [m].

    The actuators of the left and right wheels take a speed [rad/s]; the wheels are driven as if the track were wider by
    the factor `slip`, >= 1.
    """

    max_speed: _Positive
    max_turn: _Positive
    acceleration: _Positive
    turn_acceleration: _Positive
    wheel_radius: _Positive
    track: _Positive
    left: tuple[str, ...]
    right: tuple[str, ...]
    slip: _Positive = 1.0


@dataclass(frozen=True)
class DroneLimits:
    """Limits [m/s, m/s^2] of a multirotor whose actuators are the thrusts of its rotors, and its controller's gains.

    The gains of position and attitude are in 1/s^2, those of their rates in 1/s; endurance on one battery [s], if
    known.
    """

    max_speed: _Positive
    acceleration: _Positive
    position_gain: _Positive
    velocity_gain: _Positive
    attitude_gain: _Positive
    rate_gain: _Positive
    endurance: float | None = None


@dataclass(frozen=True)
class Tip:
    """The point that follows the trajectory, for models without a site: a position (3,) [m] in a body's frame."""

    body: str
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class RobotModel:
    """A robot that can be simulated.

    Args:
        model: The MJCF or URDF file.
        tip: Site that follows the trajectory, or where on which body it is.
        corner: The path may cut a corner by this [m].
        tolerance: Tracking error, root mean square over time, that counts as followed [m].
        peak_tolerance: Largest tracking error at any moment that counts as followed [m].
        joint_names: Of an arm, the names under which its controller knows the joints: a pattern with N for the joint's
            number or * for its name in the model, or all of them with commas.
        aliases: More such patterns, which are understood in what is read.
        ignore_contacts: Pairs of an arm's links that may touch each other.
        notes: What every report says of the robot.
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
    joint_names: tuple[str, ...] = ()
    aliases: tuple[str, ...] = ()
    ignore_contacts: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Common:
    model: str
    controller: Literal["arm", "rover", "drone"]
    tip: str | Tip
    title: str = ""
    corner: _Positive = 0.005
    tolerance: _Positive = 0.05
    peak_tolerance: _Positive | None = None
    joint_names: str | tuple[str, ...] = ()
    aliases: tuple[str, ...] = ()
    ignore_contacts: tuple[tuple[str, str], ...] = ()


_LIMITS: Mapping[str, type[ArmLimits | RoverLimits | DroneLimits]] = {
    "arm": ArmLimits,
    "rover": RoverLimits,
    "drone": DroneLimits,
}


def load_model(
    name: str | os.PathLike[str], *, tip: str | None = None, ignore_contacts: Iterable[str] = ()
) -> RobotModel:
    """Read a shipped robot by its name, a robot of one's own from a .toml file, or a model file or folder as it is.

    The tip is the site or body that follows trajectories, in place of the file's; `ignore_contacts` are more pairs of
    links that may touch each other, each as "LINK,LINK".

    Raises:
        RobotError: If there is no such robot or its file is malformed; names the file and the key.
    """
    model = _loaded(os.fspath(name), tip)
    pairs: list[Any] = [tuple(part.strip() for part in text.split(",")) for text in ignore_contacts]
    for pair in pairs:
        if len(pair) != 2 or not all(pair):
            raise RobotError(f"--ignore-contact {','.join(pair)!r} does not name two links; write LINK,LINK")
    return replace(model, tip=tip or model.tip, ignore_contacts=(*model.ignore_contacts, *pairs))


def _loaded(text: str, tip: str | None) -> RobotModel:
    shipped = STAND_INS.get(preset_name(text))
    if shipped is not None:
        path = FOLDER / f"{shipped}.toml"
    elif text.endswith(".toml"):
        path = Path(text)
    elif Path(text).is_dir() or Path(text).is_file():
        from ovita.sim.model_files import model_file, model_of

        return model_of(model_file(Path(text)) if Path(text).is_dir() else Path(text), tip)
    else:
        known = f"robots that can be simulated are {', '.join(STAND_INS)} (or {', '.join(ALIASES)})"
        own = "or give a .toml file, a .urdf or .xml model, or a folder with one"
        raise RobotError(f"unknown robot {text!r}; {known}, {own}")
    try:
        return _model(path, parse_toml(read_text(path), str(path)))
    except FormatError as error:
        raise RobotError(str(error)) from None


def _model(path: Path, document: dict[str, Any]) -> RobotModel:
    own_keys = {f.name for f in fields(_Common)}
    own, rest = ({key: document[key] for key in document if (key in own_keys) is wanted} for wanted in (True, False))
    common = validated(_Common, own, str(path))
    kind = _LIMITS[common.controller]
    for key in sorted(rest.keys() - {f.name for f in fields(kind)}):
        raise RobotError(f"{path}: {key} is no key of a robot with controller {common.controller!r}")
    limits = validated(kind, rest, str(path))
    file = path.parent / common.model
    if not file.is_file():
        raise RobotError(f"{path}: model {common.model!r} does not exist beside it")
    joints = common.joint_names if isinstance(common.joint_names, str) else ",".join(common.joint_names)
    made = {"name": path.stem, "title": common.title or path.stem, "model": file, "limits": limits}
    made |= {"joint_names": (joints,) if joints else ()}
    made |= {"peak_tolerance": common.peak_tolerance or 2.0 * common.tolerance}
    return RobotModel(**{**vars(common), **made})
