"""Joint motions as trajectory_msgs/JointTrajectory in a bag, for an arm's controller."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ovita.errors import FormatError, TrajectoryError
from ovita.io.bags import bag_maker, bag_of, read_message, topic_named
from ovita.io.files import atomic_write, errors_of, file_name
from ovita.io.messages import JOINTS, Maker, frame_of
from ovita.io.task import NONE, Choices
from ovita.io.times import speeds_from_times
from ovita.paths.frame import Frame
from ovita.paths.trajectory import Array, Trajectory, first_bad

TOPIC = "/joint_trajectory"
"""Topic that is written where nothing else is said."""

_FLU = Frame("flu")

Forward = Callable[[Array], tuple[ArrayLike, ArrayLike]]
"""Forward kinematics: joint positions (J,) to a position (3,) [m] and an orientation (4,) wxyz."""


@dataclass(frozen=True, eq=False)
class JointMotion:
    """A motion of J joints through N points.

    Args:
        names: Of the joints.
        positions: (N, J) [rad, or m where a joint slides].
        times: (N,) [s], increasing strictly.
        velocities: (N, J) [rad/s or m/s], or None.
        frame: The axes in which the place of the arm's base is given.

    Raises:
        TrajectoryError: On shapes that do not fit, a value that is not finite, or times that do not increase.
    """

    names: tuple[str, ...]
    positions: Array
    times: Array
    velocities: Array | None = None
    frame: Frame = _FLU

    def __post_init__(self) -> None:
        shape = (len(self.times), len(self.names))
        for key in ("positions", "velocities", "times"):
            if getattr(self, key) is None:
                continue
            array = np.array(getattr(self, key), dtype=np.float64)
            if array.shape != (shape[:1] if key == "times" else shape):
                raise TrajectoryError(f"{key} have shape {array.shape}, expected one row for each of {shape}", key=key)
            bad = first_bad(array)
            if bad is not None:
                raise TrajectoryError("contains a value that is not finite", key=key, index=bad)
            array.flags.writeable = False
            object.__setattr__(self, key, array)
        if not len(self.names) or len(self.times) < 2:
            raise TrajectoryError("a motion of joints needs at least 1 joint and 2 points", key="positions")
        if (np.diff(self.times) <= 0).any():
            i = int(np.argmax(np.diff(self.times) <= 0)) + 1
            raise TrajectoryError("is not after the time before it; times must increase strictly", key="times", index=i)

    def through(self, forward: Forward) -> Trajectory:
        """The path of the tool by a kinematic model; its speeds follow from the times.

        Raises:
            TrajectoryError: If the model's poses make no trajectory.
        """
        poses = [forward(row) for row in self.positions]
        places = np.array([place for place, _ in poses], dtype=float)
        speeds, timestep, _ = speeds_from_times(places, self.times, "times")
        return Trajectory(places, speeds, np.array([turn for _, turn in poses], dtype=float), timestep)


def build_joints(motion: JointMotion, maker: Maker, *, frame_id: str = "") -> Any:
    """A JointTrajectory message for a motion that starts immediately (stamp 0)."""
    frame_id = frame_id or ("" if motion.frame == _FLU else f"base_{motion.frame.name}")
    points = [
        maker.new(
            "trajectory_msgs/msg/JointTrajectoryPoint",
            positions=maker.floats(motion.positions[i]),
            velocities=maker.floats(np.zeros(0) if motion.velocities is None else motion.velocities[i]),
            accelerations=maker.floats(np.zeros(0)),
            effort=maker.floats(np.zeros(0)),
            time_from_start=maker.stamp(round((motion.times[i] - motion.times[0]) * 1e9), "Duration"),
        )
        for i in range(len(motion.times))
    ]
    return maker.new(JOINTS, header=maker.header(frame_id), joint_names=list(motion.names), points=points)


def parse_joints(message: Any) -> JointMotion:
    """The motion in a JointTrajectory message.

    Raises:
        TrajectoryError: If it holds none; names the point.
    """
    points, names = list(message.points), tuple(str(name) for name in message.joint_names)
    for i, point in enumerate(points):
        if len(point.positions) != len(names):
            problem = f"holds {len(point.positions)} positions for {len(names)} joints"
            raise TrajectoryError(problem, key="points", index=i)
    moving = bool(points) and all(len(point.velocities) == len(names) for point in points)
    return JointMotion(
        names,
        np.array([point.positions for point in points], dtype=float).reshape(len(points), len(names)),
        np.array([int(p.time_from_start.sec) + int(p.time_from_start.nanosec) / 1e9 for p in points]),
        np.array([point.velocities for point in points], dtype=float) if moving else None,
        frame_of(str(message.header.frame_id)),
    )


def save_joint_motion(path: str | os.PathLike[str], motion: JointMotion, choices: Choices = NONE) -> None:
    """Write a motion of joints as a bag with one JointTrajectory message.

    Raises:
        FormatError: If the bag cannot be written there.
        MissingExtra: If rosbags is not installed.
    """
    atomic_write(path, dumps(path, motion, choices))


def dumps(path: str | os.PathLike[str], motion: JointMotion, choices: Choices = NONE) -> bytes:
    """What `save_joint_motion` writes, by the ending of the file's name.

    Raises:
        FormatError: If the name is not that of a ROS 2 bag.
        MissingExtra: If rosbags is not installed.
    """
    message = build_joints(motion, bag_maker(), frame_id=choices.frame_id or "")
    return bag_of(path, topic_named(choices.topic or TOPIC), JOINTS, message)


def load_joint_motion(path: str | os.PathLike[str], choices: Choices = NONE) -> JointMotion:
    """Read a motion of joints from a bag.

    Raises:
        FormatError: If there is no JointTrajectory or it is malformed; names topic and point.
        MissingExtra: If rosbags is not installed.
    """
    read = read_message(path, choices, [])
    if read.type != JOINTS:
        raise FormatError(file_name(path), f"{read.topic} is a {read.type}, not a JointTrajectory")
    with errors_of(f"{file_name(path)} {read.topic}"):
        return parse_joints(read.message)
