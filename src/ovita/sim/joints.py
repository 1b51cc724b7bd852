"""Joints of an arm: the motion that follows a path, the path of a motion, their names, and where the arm stands now."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ovita.errors import RequestError, RobotError
from ovita.io.messages import JointMotion
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.sim.models import ArmLimits, RobotModel, load_model, mujoco
from ovita.sim.placement import Base, WorldTransform
from ovita.sim.report import FAILED, Report
from ovita.sim.simulate import require, simulate
from ovita.sim.world import PREFIX, SimWorld, build
from ovita.text import listed

START_TOLERANCE = 0.01
"""Largest gap of a joint [rad or m] between where it is and where a motion starts; MoveIt's allowed_start_tolerance."""


BEYOND = 0.01
"""How far beyond its range a joint may be measured [rad or m]."""


@dataclass(frozen=True)
class ArmJoints:
    """An arm's joints and how others call them.

    Args:
        own: Names in its model, J of them.
        sent: Names under which its controller knows them.
        known: Every set of names that is understood, each in the model's order.
        ranges: How far each joint goes, (low, high) [rad or m].
    """

    title: str
    own: tuple[str, ...]
    sent: tuple[str, ...]
    known: tuple[tuple[str, ...], ...]
    ranges: tuple[tuple[float, float], ...]

    def order(self, names: Sequence[str]) -> list[int]:
        """Where each of the model's joints is among other names, which may have more.

        Raises:
            RobotError: If no set of known names is among them.
        """
        for known in self.known:
            if set(known) <= set(names):
                return [list(names).index(name) for name in known]
        theirs = ", ".join(names[:12]) + (" ..." if len(names) > 12 else "")
        problem = f"the joints {theirs} are not those of the {self.title}, which are {', '.join(self.sent)}"
        hint = f"--joint-names lbr_iiwa_joint_N, or all {len(self.own)} names with commas"
        raise RobotError(f"{problem}; say how they are named: {hint}")

    def state(self, values: Mapping[str, float]) -> Array:
        """The positions (J,) of the model's joints among named ones [rad or m].

        Raises:
            RobotError: If no set of known names is among them, or a joint would be where it cannot be.
        """
        here = list(values.values())
        state = np.array([here[i] for i in self.order(list(values))], dtype=float)
        for name, q, (low, high) in zip(self.sent, state.tolist(), self.ranges, strict=True):
            if not low - BEYOND <= q <= high + BEYOND:
                unit = "; is it in degrees?" if abs(q) > 2.0 * np.pi else ""
                raise RobotError(f"joint state: {name} is {q:.3f} rad, but goes from {low:.3f} to {high:.3f} rad{unit}")
        return state


def joints_of_arm(model: RobotModel, stage: SimWorld, asked: str | None = None) -> ArmJoints:
    """The joints of an arm; `asked` are the names of its controller, a pattern such as lbr_iiwa_joint_N or all of them.

    N is the joint's number from 1, * its name in the model.

    Raises:
        RobotError: If the names do not fit the joints.
    """
    own = stage.joints
    others = [spelled(own, text) for text in (*model.joint_names, *model.aliases)]
    sent = spelled(own, asked) if asked else others[0] if model.joint_names else own
    limited = zip(stage.model.jnt_limited, stage.model.jnt_range.tolist(), strict=True)
    ranges = tuple((low, high) if bound else (-np.inf, np.inf) for bound, (low, high) in limited)
    return ArmJoints(model.title, own, sent, tuple(dict.fromkeys((sent, own, *others))), ranges)


def spelled(own: Sequence[str], text: str) -> tuple[str, ...]:
    """Names of J joints from a pattern or from all of them with commas."""
    names = tuple(part.strip() for part in text.split(","))
    if len(names) == 1 and "*" in text:
        names = tuple(text.replace("*", name) for name in own)
    elif len(names) == 1 and "N" in text:
        before, _, behind = text.rpartition("N")
        names = tuple(f"{before}{i + 1}{behind}" for i in range(len(own)))
    if len(names) != len(own) or len({*names} - {""}) != len(own):
        problem = f"the joint names {text!r} do not fit the {len(own)} joints {', '.join(own)}"
        hint = "give a pattern with N for the joint's number or * for its name, or as many names, with commas"
        raise RobotError(f"{problem}; {hint}")
    return names


def joint_motion(
    trajectory: Trajectory,
    scene: Scene,
    arm: str | RobotModel = "iiwa",
    *,
    base: Base | None = None,
    limits: Robot | None = None,
    contacts: Sequence[str] = (),
    names: str | None = None,
    state: Mapping[str, float] | None = None,
) -> tuple[JointMotion, tuple[str, ...]]:
    """The joints' motion with which a simulated arm follows a trajectory, and how well it does, in sentences.

    It is what the arm's controller tracked in the simulation: positions, velocities and accelerations at 50 Hz. The arm
    is a shipped one's name, a file or a model; the rest is as in `simulate`.

    `names` are those of the controller's joints, see `joints_of_arm`; `state` is where the joints are now [rad], and
    the motion starts in that posture if it reaches the path from there.

    Raises:
        RequestError: If a waypoint is out of reach, the arm strays from the path, or it touches what it must not.
        RobotError: If there is no such arm.
        MissingExtra: If the simulation is not installed.
    """
    model = _arm(arm)
    tried = [] if state is None else [_from_posture(model, arm_joints(model, names).state(state))]
    for some in (*tried, model):
        done = simulate(trajectory, scene, some, base=base, limits=limits, contacts=contacts)
        if done.report.status not in FAILED:
            break
    else:
        raise RequestError(_refused(model, done.report))
    joints, plan, frames = joints_of_arm(model, done.stage, names), done.plan, done.frames
    columns = _columns(done.stage, joints.own)
    rows = (plan.coordinates, plan.rates, plan.accelerations)
    positions, velocities, accelerations = (values[frames][:, columns].copy() for values in rows)
    velocities[[0, -1]] = accelerations[[0, -1]] = 0.0
    motion = JointMotion(joints.sent, positions, plan.times[frames], velocities, scene.frame, accelerations)
    return motion, done.report.sentences()


def _refused(model: RobotModel, report: Report) -> str:
    """Why a simulated motion is not to be sent, and what to do."""
    struck = [contact for contact in report.contacts if not contact.meant]
    if struck and report.status != "unreachable":
        itself = ", or which links may touch: --ignore-contact LINK,LINK" if any(c.links for c in struck) else ""
        return f"the {model.title} would touch {listed([c.told for c in struck])}; say where it stands: --base{itself}"
    problem = next((s for s in report.sentences()[1:] if report.status == "off course" or "reached" in s), "")
    return f"the {model.title} cannot follow this trajectory: {problem} Say where it stands: --base"


def tool_path(
    motion: JointMotion, arm: str | RobotModel = "iiwa", *, base: Base | None = None, names: str | None = None
) -> Trajectory:
    """The path of an arm's tip through a motion of all its joints, in the axes of the base (`motion.frame`).

    Raises:
        RobotError: If there is no such arm, or it has other joints.
        MissingExtra: If the simulation is not installed.
    """
    model = _arm(arm)
    world = WorldTransform(motion.frame)
    stage = build(model, Scene(), world.base(base or Base()), 0.0)
    joints = joints_of_arm(model, stage, names)
    order = joints.order(motion.names)
    if len(order) != len(motion.names):
        other = [name for i, name in enumerate(motion.names) if i not in order]
        raise RobotError(f"the {model.title} has no joints {', '.join(other)}; leave them out of the motion")
    columns = _columns(stage, joints.own)
    data = mujoco.MjData(stage.model)

    def forward(row: Array) -> tuple[Array, Array]:
        data.qpos[columns] = row[order]
        mujoco.mj_kinematics(stage.model, data)
        turn = np.zeros(4)
        mujoco.mju_mat2Quat(turn, data.site_xmat[stage.tip])
        return data.site_xpos[stage.tip] * world.signs, world.turned(turn)

    return motion.through(forward)


def arm_joints(arm: str | RobotModel, names: str | None = None) -> ArmJoints:
    """The joints of an arm by its name, file or model; see `joints_of_arm`."""
    model = _arm(arm)
    return joints_of_arm(model, build(model, Scene(), Base(), 0.0), names)


def gaps(motion: JointMotion, state: Array) -> dict[str, float]:
    """How far each joint (J,) is from where a motion starts [rad or m]; turns are not taken off."""
    return dict(zip(motion.names, np.abs(motion.positions[0] - state).tolist(), strict=True))


def start_problem(motion: JointMotion, state: Array, tolerance: float = START_TOLERANCE) -> str | None:
    """Why a motion must not start from a state (J,), as a sentence, or None where every gap is within tolerance."""
    found = gaps(motion, state)
    far = sorted((name for name, gap in found.items() if gap > tolerance), key=lambda name: -found[name])
    if not far:
        return None
    worst, start = far[0], float(motion.positions[0][motion.names.index(far[0])])
    more = f" ({len(far)} of {len(found)} joints are beyond the tolerance of {tolerance:g})" if len(found) > 1 else ""
    gap = f"{worst} is {found[worst]:.3f} rad from where the motion starts, at {start:.3f} rad{more}"
    return f"{gap}: the arm would jump; --approach plans a way there, or move the arm there first"


def _from_posture(model: RobotModel, posture: Array) -> RobotModel:
    """The model with a posture of one's own that inverse kinematics tries first."""
    assert isinstance(model.limits, ArmLimits)
    first = tuple(float(q) for q in posture)
    return replace(model, limits=replace(model.limits, postures=(first, *model.limits.postures)))


def _arm(name: str | RobotModel) -> RobotModel:
    require()
    model = name if isinstance(name, RobotModel) else load_model(name)
    if model.controller != "arm":
        raise RobotError(f"{model.name!r} is no arm, so it has no joints to move; name one: --arm iiwa")
    return model


def _columns(stage: SimWorld, names: Sequence[str]) -> list[int]:
    model: Any = stage.model
    return [int(model.joint(PREFIX + name).qposadr[0]) for name in names]
