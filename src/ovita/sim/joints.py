"""From a path to the motion of an arm's joints and back, through the simulation's kinematic models (extra `sim`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ovita.errors import RequestError, RobotError
from ovita.io.messages import JointMotion
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.sim import Base, RobotModel, load_model, require, simulate
from ovita.sim.world import PREFIX, SimWorld, build


def joint_motion(
    trajectory: Trajectory,
    scene: Scene,
    arm: str = "iiwa",
    *,
    base: Base | None = None,
    limits: Robot | None = None,
    contacts: Sequence[str] = (),
) -> tuple[JointMotion, tuple[str, ...]]:
    """The joints' motion with which a simulated arm follows a trajectory, and how well it does, in sentences.

    Args:
        trajectory: In the scene's coordinates.
        scene: What the arm must not touch.
        arm: A shipped arm's name or a .toml file.
        base: Pose of the arm's base in scene coordinates; None lets the simulation choose it.
        limits: The limits that the trajectory was adapted to.
        contacts: Objects that are meant to be touched.

    Raises:
        RequestError: If a waypoint is out of reach, the arm strays from the path, or it touches what it must not.
        RobotError: If there is no such arm.
        MissingExtra: If the simulation is not installed.
    """
    model = _arm(arm)
    done = simulate(trajectory, scene, model, base=base, limits=limits, contacts=contacts)
    report = done.report
    if report.status in ("unreachable", "off course"):
        problem = next((s for s in report.sentences()[1:] if report.status == "off course" or "reached" in s), "")
        raise RequestError(f"the {model.title} cannot follow this trajectory: {problem} Say where it stands: --base")
    struck = [contact.name for contact in report.contacts if not contact.meant]
    if struck:
        raise RequestError(f"the {model.title} would touch {', '.join(struck)}; say where it stands: --base")
    names = _names(done.stage)
    positions = done.states[:, [_address(done.stage, name) for name in names]]
    velocities = np.gradient(positions, done.motion.times, axis=0)
    velocities[[0, -1]] = 0.0
    return JointMotion(names, positions, done.motion.times, velocities, scene.frame), report.sentences()


def tool_path(motion: JointMotion, arm: str = "iiwa", *, base: Base | None = None) -> Trajectory:
    """The path of an arm's tip through a motion of its joints, in the axes in which the base is given (`motion.frame`).

    Args:
        motion: Of all joints of the arm, by the names of its model.
        arm: A shipped arm's name or a .toml file.
        base: Pose of the arm's base; None for the origin.

    Raises:
        RobotError: If there is no such arm, or it has other joints.
        MissingExtra: If the simulation is not installed.
    """
    model = _arm(arm)
    stage = build(model, Scene(), base or Base(), 0.0)
    names = _names(stage)
    if set(motion.names) != set(names):
        raise RobotError(
            f"the joints {', '.join(motion.names)} are not those of the {model.title}, which are {', '.join(names)}"
        )
    addresses = [_address(stage, name) for name in motion.names]
    import mujoco

    data = mujoco.MjData(stage.model)

    def forward(joints: Array) -> tuple[Array, Array]:
        data.qpos[addresses] = joints
        mujoco.mj_kinematics(stage.model, data)
        turn = np.zeros(4)
        mujoco.mju_mat2Quat(turn, data.site_xmat[stage.tip])
        return data.site_xpos[stage.tip].copy(), turn

    return motion.through(forward)


def _arm(name: str) -> RobotModel:
    require()
    model = load_model(name)
    if model.controller != "arm":
        raise RobotError(f"{name!r} is no arm, so it has no joints to move; name one: --arm iiwa")
    return model


def _names(stage: SimWorld) -> tuple[str, ...]:
    model: Any = stage.model
    return tuple(model.joint(j).name.removeprefix(PREFIX) for j in range(model.njnt))


def _address(stage: SimWorld, name: str) -> int:
    model: Any = stage.model
    return int(model.joint(PREFIX + name).qposadr[0])
