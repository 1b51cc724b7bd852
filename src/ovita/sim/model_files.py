"""Model files of robots, MJCF and URDF, made ready for the simulator, and robots known by such a file alone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain, product
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ovita.errors import FormatError, RobotError
from ovita.io.files import read_text
from ovita.paths.trajectory import Array
from ovita.sim.models import ArmLimits, DroneLimits, RobotModel, Tip, mujoco
from ovita.text import listed

MODELS = (".xml", ".mjcf", ".urdf")
"""Endings of model files."""

TIPS = ("attachment_site", "tip", "tcp", "tool0", "flange", "ee_link", "hand")
"""Sites and bodies of these names, or ending in _NAME, are taken for an arm's tip; else the last body of the chain."""

SPEED, PICKUP = 1.0, 4.0
"""Of joints whose file states no speed: this one [rad/s]; and every joint reaches its speed in 1 / PICKUP [s]."""

POSTURES = 16
"""Postures from which inverse kinematics starts where the file has none of its own."""

_AS_IT_IS = {"strippath": "false", "discardvisual": "true", "fusestatic": "false"}
"""How MuJoCo is to compile a URDF: its meshes where they are, links without joints kept, as they may be tools."""


def read_spec(path: Path) -> Any:
    """A model file as MuJoCo edits it; meshes of a URDF are looked for beside it and in the folders above.

    Raises:
        RobotError: If it cannot be read.
    """
    try:
        if path.suffix.lower() != ".urdf":
            return mujoco.MjSpec.from_file(str(path))
        root = _urdf(path)
        for mesh in root.iter("mesh"):
            mesh.set("filename", _located(path, mesh.get("filename", "")))
        ElementTree.SubElement(ElementTree.SubElement(root, "mujoco"), "compiler", _AS_IT_IS)
        return mujoco.MjSpec.from_string(ElementTree.tostring(root, encoding="unicode"))
    except FormatError as error:
        raise RobotError(str(error)) from None
    except ValueError as error:
        raise RobotError(f"{path}: cannot be read: {str(error).splitlines()[0]}") from None


def _urdf(path: Path) -> ElementTree.Element:
    try:
        return ElementTree.fromstring(read_text(path))
    except ElementTree.ParseError as error:
        raise RobotError(f"{path}: cannot be read: {error}") from None


def _located(path: Path, name: str) -> str:
    """The file that a URDF means by package://PACKAGE/REST or by a relative path; the text itself if there is none."""
    rest = name.partition("://")[2] or name
    for folder in path.resolve().parents:
        for tail in (rest, rest.partition("/")[2]):
            if tail and (folder / tail).is_file():
                return str(folder / tail)
    return name


def make_arm(spec: Any, robot: RobotModel) -> None:
    """Make a model an arm as its controller wants it.

    Only the joints between base and tip move; each has a motor; neighbouring links and the pairs that the robot names
    do not touch each other.

    Raises:
        RobotError: If there is no such tip or link, or a joint's torque is not known.
    """
    joints = _keep_chain(spec, robot)
    limits = robot.limits
    assert isinstance(limits, ArmLimits)
    if limits.torque and len(limits.torque) != len(joints):
        raise RobotError(f"{robot.model}: torque has {len(limits.torque)} values, the arm has {len(joints)} joints")
    torques = limits.torque or [_torque(spec, joint) for joint in joints]
    if not all(torques):
        hint = f"give the torque of each of its {len(joints)} joints in the .toml"
        raise RobotError(f"{robot.model}: has no actuators; {hint}")
    _drive(spec, joints, torques)
    _part(spec, robot)


def _keep_chain(spec: Any, robot: RobotModel) -> list[Any]:
    """The joints between base and tip; all others are fixed where they are, with what depends on them removed."""
    chain = list(_to_base(_tip_body(spec, robot)))
    joints = [joint for link in reversed(chain) for joint in link.joints]
    turning = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
    if not joints or any(joint.type not in turning for joint in joints):
        raise RobotError(f"{robot.model}: no chain of hinges leads from its base to the tip; name the tip: --tip NAME")
    kept = {joint.name for joint in joints}
    loose = list(spec.keys)
    if len(kept) < len(list(spec.joints)):
        things = (*spec.equalities, *spec.sensors, *spec.actuators, *spec.tendons)
        loose += [thing for thing in things if getattr(thing, "target", None) not in kept]
        loose += [joint for joint in spec.joints if joint.name not in kept]
    for thing in loose:
        spec.delete(thing)
    return joints


def add_tip(spec: Any, model: object, tip: Tip) -> Any:
    """Make a site for the tip on its body, and return the body.

    Raises:
        RobotError: If the model has no such body.
    """
    body = spec.body(tip.body)
    if body is None:
        raise RobotError(f"{model}: has no body {tip.body!r} for the tip")
    body.add_site(name="tip", pos=tip.position)
    return body


def _tip_body(spec: Any, robot: RobotModel) -> Any:
    """The body that the tip is on; a site is made for it where there is none."""
    if isinstance(robot.tip, Tip):
        return add_tip(spec, robot.model, robot.tip)
    site = spec.site(robot.tip)
    if site is not None:
        return site.parent
    body = spec.body(robot.tip)
    if body is None:
        names = listed(sorted({thing.name for thing in (*spec.sites, *spec.bodies)} - {"", "world"}))
        problem = f"has no site {robot.tip!r} for the tip, and no body of that name"
        raise RobotError(f"{robot.model}: {problem}; it has {names}")
    body.add_site(name=robot.tip)
    return body


def _torque(spec: Any, joint: Any) -> float:
    """The largest torque of a joint [Nm], or force [N], by its actuator or by itself; 0 where none is stated."""
    for actuator in spec.actuators:
        if actuator.target == joint.name:
            ranges = [actuator.forcerange * abs(actuator.gear[0])]
            if not actuator.biasprm.any():  # a motor: what it is told is its force
                ranges.append(actuator.ctrlrange * abs(actuator.gainprm[0] * actuator.gear[0]))
            stated = [float(np.abs(pair).min()) for pair in ranges if np.abs(pair).min() > 0]
            if stated:
                return min(stated)
    return float(np.abs(joint.actfrcrange).min())


def _drive(spec: Any, joints: Sequence[Any], torques: Sequence[float]) -> None:
    """A motor at each joint in place of what drove it."""
    for actuator in list(spec.actuators):
        spec.delete(actuator)
    for i, (joint, torque) in enumerate(zip(joints, torques, strict=True)):
        joint.name = joint.name or f"joint{i + 1}"
        actuator = spec.add_actuator(target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_motor()
        actuator.ctrlrange = [-torque, torque]
        actuator.ctrllimited = 1


def _part(spec: Any, robot: RobotModel) -> None:
    """Exclude contacts of the base with the first moving links, and of the pairs that the robot names.

    MuJoCo itself excludes other neighbours, but not those of a body that is fixed to the world.
    """
    moved = {b.name: sum(bool(link.joints) for link in _to_base(b)) for b in spec.bodies if b.name != "world"}
    for name in [name for name in chain.from_iterable(robot.ignore_contacts) if name not in moved]:
        raise RobotError(f"{robot.model}: has no link {name!r}; its links are {listed(sorted(moved))}")
    fixed, first = ([name for name, joints in moved.items() if joints == count] for count in (0, 1))
    there = {frozenset((e.bodyname1, e.bodyname2)) for e in spec.excludes}
    for a, b in sorted({*product(fixed, first), *robot.ignore_contacts}):
        if a and b and frozenset((a, b)) not in there:
            spec.add_exclude(bodyname1=a, bodyname2=b)


def _to_base(body: Any) -> Iterator[Any]:
    while body is not None and body.name != "world":
        yield body
        body = body.parent


def model_file(folder: Path) -> Path:
    """The one robot in a folder, such as one of the MuJoCo Menagerie; scenes do not count.

    Raises:
        RobotError: If there is none, or several.
    """
    files = [p for p in sorted(folder.iterdir()) if p.suffix.lower() in MODELS and not p.stem.startswith("scene")]
    named = [p for p in files if folder.name.endswith(p.stem)]
    robots = named if len(named) == 1 else files
    if len(robots) != 1:
        found = f"several robots ({listed([p.name for p in files[:8]])}); name one" if files else "no .xml and no .urdf"
        raise RobotError(f"{folder}: holds {found}")
    return robots[0]


def model_of(path: Path, tip: str | None = None) -> RobotModel:
    """A robot by its model file alone: an arm, or a drone whose rotors act at sites.

    What the file does not state is assumed, and told in the notes of every report.

    Raises:
        RobotError: If it can be neither.
    """
    spec = read_spec(path)
    free = [joint for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE]
    if not free:
        return _arm_of(path, spec, tip or _guessed_tip(spec))
    if list(spec.actuators) and all(a.trntype == mujoco.mjtTrn.mjTRN_SITE for a in spec.actuators):
        return _drone_of(path, spec)
    raise RobotError(f"{path}: it moves about, but not on rotors; describe a rover in a .toml (docs/robots.md)")


def _arm_of(path: Path, spec: Any, tip: str) -> RobotModel:
    from scipy.stats import qmc

    wide = RobotModel(path.stem, path.stem, path, "arm", tip, ArmLimits((), (), ()))
    home = next((np.array(key.qpos) for key in spec.keys if len(key.qpos)), np.zeros(0))
    every = [joint.name for joint in spec.joints]
    joints = _keep_chain(spec, wide)
    names = [joint.name for joint in joints]
    low, high = _ranges(joints, in_degrees=spec.compiler.degree and path.suffix.lower() != ".urdf")
    points = qmc.Halton(len(joints), scramble=False).random(POSTURES + 1)[1:]
    rows = [0.5 * (low + high) + 0.25 * (high - low) * (2.0 * point - 1.0) for point in points]
    if len(home) == len(every):
        rows.insert(0, home[[every.index(name) for name in names]])
    postures = tuple(tuple(row) for row in np.clip(rows, low, high).tolist())
    stated = _urdf_speeds(path)
    speeds = tuple(stated.get(name, SPEED) for name in names)
    unknown = len(set(names) - stated.keys())
    notes = [f"The tip is {tip!r}; accelerations are assumed: every joint reaches its speed in {1 / PICKUP:g} s."]
    if unknown:
        notes.append(f"The model states no speed of {unknown} joints; {SPEED:g} rad/s is assumed.")
    limits = ArmLimits(speeds, tuple(PICKUP * v for v in speeds), postures)
    return RobotModel(path.stem, path.stem, path, "arm", tip, limits, 0.001, 0.002, 0.004, notes=tuple(notes))


def _ranges(joints: Sequence[Any], *, in_degrees: bool) -> tuple[Array, Array]:
    """How far each joint (J,) goes down and up [rad], at most half a turn; that where nothing is stated."""
    low, high = np.array([joint.range for joint in joints], dtype=float).T * (np.pi / 180.0 if in_degrees else 1.0)
    open_ = high <= low
    return np.maximum(np.where(open_, -np.pi, low), -np.pi), np.minimum(np.where(open_, np.pi, high), np.pi)


def _guessed_tip(spec: Any) -> str:
    names = sorted(thing.name for thing in (*spec.sites, *spec.bodies) if thing.name)

    def hinges(body: Any) -> int:
        return sum(joint.type == mujoco.mjtJoint.mjJNT_HINGE for link in _to_base(body) for joint in link.joints)

    deepest = max((body for body in spec.bodies if body.name), key=hinges)
    return next((name for tip in TIPS for name in names if f"_{name}".endswith(f"_{tip}")), str(deepest.name))


def _urdf_speeds(path: Path) -> dict[str, float]:
    """The speeds of joints that a URDF states [rad/s], which MuJoCo does not read."""
    if path.suffix.lower() != ".urdf":
        return {}
    limits = {str(joint.get("name")): limit for joint in _urdf(path).iter("joint") for limit in joint.findall("limit")}
    speeds = {name: float(limit.get("velocity", 0)) for name, limit in limits.items()}
    return {name: speed for name, speed in speeds.items() if speed > 0}


def _drone_of(path: Path, spec: Any) -> RobotModel:
    model = spec.compile()
    body = int(model.jnt_bodyid[0])
    mass = float(model.body_subtreemass[body])
    thrust = float((model.actuator_ctrlrange[:, 1] * model.actuator_gear[:, 2]).sum())
    spare = thrust / mass - abs(float(model.opt.gravity[2]))
    if spare <= 0:
        raise RobotError(f"{path}: its rotors lift at most {thrust:.3g} N, and it weighs {mass:.3g} kg")
    limits = DroneLimits(2.0, min(3.0, 0.5 * spare), 6.0, 4.0, 120.0, 20.0)
    assumed = f"Speed (2 m/s), acceleration ({limits.acceleration:.3g} m/s^2) and gains are assumed"
    notes = (f"{assumed}; give a .toml for others.",)
    return RobotModel(path.stem, path.stem, path, "drone", Tip(str(model.body(body).name)), limits, notes=notes)
