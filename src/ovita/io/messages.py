"""ROS messages that hold a path, read from and built for any library that names their fields as ROS does.

rosbags, cyclonedds and rclpy all do. Positions are in metres, quaternions xyzw, times whole nanoseconds. Axes are those
of REP-103 (x forward, y left, z up: `flu`), or what the frame's name ends in: `_ned`, `_rfu`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ovita.errors import TrajectoryError, needs
from ovita.io.documents import Kind, brief, listing
from ovita.io.waypoints import from_columns, pose_columns, speeds_from_times, timed, turns_of
from ovita.paths.scene import Frame
from ovita.paths.trajectory import Array, Trajectory, first_bad

TYPES: dict[Kind, str] = {
    "path": "nav_msgs/msg/Path",
    "poses": "geometry_msgs/msg/PoseArray",
    "multidof": "trajectory_msgs/msg/MultiDOFJointTrajectory",
}
"""The message of each kind of path."""

JOINTS = "trajectory_msgs/msg/JointTrajectory"
"""A motion of joints, which is no path without a kinematic model."""

FRAME_ID = "map"
"""Frame of a message where nothing else is said."""

BODY = "base_link"
"""Name of the body that a MultiDOFJointTrajectory moves where nothing else is said."""

_BILLION = 10**9
_UNEVEN = 0.05
_MOST_LISTED = 10


@dataclass(frozen=True)
class Maker:
    """How a library builds messages.

    `new("geometry_msgs/msg/Point", x=..., ...)` builds one from the name of its type and its fields; `floats` turns an
    array (N,) into what a field of type float64[] takes.
    """

    new: Callable[..., Any]
    floats: Callable[[Array], Any] = lambda values: values.tolist()

    def stamp(self, nanoseconds: int, kind: str = "Time") -> Any:
        """A builtin_interfaces Time or Duration."""
        sec, nanosec = divmod(nanoseconds, _BILLION)
        return self.new(f"builtin_interfaces/msg/{kind}", sec=sec, nanosec=nanosec)

    def header(self, frame_id: str, nanoseconds: int = 0) -> Any:
        """A std_msgs Header."""
        return self.new("std_msgs/msg/Header", stamp=self.stamp(nanoseconds), frame_id=frame_id)

    def vector(self, xyz: Sequence[float], kind: str = "Vector3") -> Any:
        """A geometry_msgs Vector3 or Point."""
        x, y, z = map(float, xyz)
        return self.new(f"geometry_msgs/msg/{kind}", x=x, y=y, z=z)

    def quaternion(self, wxyz: Sequence[float]) -> Any:
        """A geometry_msgs Quaternion."""
        w, x, y, z = map(float, wxyz)
        return self.new("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)

    def pose(self, xyz: Sequence[float], wxyz: Sequence[float]) -> Any:
        """A geometry_msgs Pose."""
        return self.new("geometry_msgs/msg/Pose", position=self.vector(xyz, "Point"), orientation=self.quaternion(wxyz))


_POSE, _JOINTS = "geometry_msgs/Pose", "trajectory_msgs/JointTrajectory"

MOVEIT = {
    "object_recognition_msgs/msg/ObjectType": "string key\nstring db",
    "moveit_msgs/msg/CollisionObject": f"""std_msgs/Header header
{_POSE} pose
string id
object_recognition_msgs/ObjectType type
shape_msgs/SolidPrimitive[] primitives
{_POSE}[] primitive_poses
shape_msgs/Mesh[] meshes
{_POSE}[] mesh_poses
shape_msgs/Plane[] planes
{_POSE}[] plane_poses
string[] subframe_names
{_POSE}[] subframe_poses
byte operation""",
    "moveit_msgs/msg/AttachedCollisionObject": f"""string link_name
moveit_msgs/CollisionObject object
string[] touch_links
{_JOINTS} detach_posture
float64 weight""",
    "moveit_msgs/msg/RobotState": """sensor_msgs/JointState joint_state
sensor_msgs/MultiDOFJointState multi_dof_joint_state
moveit_msgs/AttachedCollisionObject[] attached_collision_objects
bool is_diff""",
    "moveit_msgs/msg/RobotTrajectory": f"""{_JOINTS} joint_trajectory
trajectory_msgs/MultiDOFJointTrajectory multi_dof_joint_trajectory""",
    "moveit_msgs/msg/DisplayTrajectory": """string model_id
moveit_msgs/RobotTrajectory[] trajectory
moveit_msgs/RobotState trajectory_start""",
}
"""MoveIt 2's messages that hold a plan, and those that they are made of."""


@cache
def typestore(ros1: bool = False) -> Any:
    """The messages of ROS 2 (Humble, which later distributions have kept) or of ROS 1 Noetic, as rosbags knows them.

    Raises:
        MissingExtra: If rosbags is not installed.
    """
    with needs("rosbags", "ros"):
        typesys = import_module("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC if ros1 else typesys.Stores.ROS2_HUMBLE)
    for name, text in MOVEIT.items():
        store.register(typesys.get_types_from_msg(text, name))
    return store


@dataclass(frozen=True)
class TopicMessage:
    """A message on a topic: the topic, its type, itself, and when it was logged or came [ns]."""

    topic: str
    type: str
    message: Any
    at: int = 0


def listed_names(names: Iterable[str]) -> str:
    """Names of topics or types, ten at most, joined by commas."""
    found = sorted(name if name.isprintable() else repr(name) for name in names)
    more = f" and {len(found) - _MOST_LISTED} more" if len(found) > _MOST_LISTED else ""
    return (", ".join(found[:_MOST_LISTED]) + more) or "none"


def frame_of(frame_id: str) -> Frame:
    """The axes of a ROS frame: those of REP-103, or those that its name ends in, _ned or _rfu."""
    if frame_id.endswith(("_optical", "_optical_frame")):
        problem = f"is in {brief(frame_id)!r}, a camera's optical frame (z forward)"
        raise TrajectoryError(f"{problem}; transform it to a fixed frame first", key="header.frame_id")
    return Frame(next((name for name in ("ned", "rfu") if frame_id.endswith(f"_{name}")), "flu"))


def build(
    kind: Kind, trajectory: Trajectory, maker: Maker, *, frame_id: str = FRAME_ID, start: int = 0, body: str = BODY
) -> tuple[Any, tuple[str, ...]]:
    """A message from a trajectory in the axes of `frame_of(frame_id)`, and notes on what is lost.

    Its first waypoint is due at `start` [ns]; `body` is what a MultiDOFJointTrajectory moves.
    """
    notes: tuple[str, ...] = ()
    times = np.zeros(len(trajectory))
    if kind != "poses":
        trajectory, times, notes = timed(trajectory)
    turns, own = turns_of(trajectory)
    notes += () if own else ("there are no orientations; every pose got the identity",)
    stamps = [round(t * 1e9) for t in times.tolist()]
    header = maker.header(frame_id, start)
    if kind == "multidof":
        points = _points(trajectory, turns, stamps, maker)
        return maker.new(TYPES[kind], header=header, joint_names=[body], points=points), notes
    poses = [maker.pose(p, q) for p, q in zip(trajectory.positions, turns, strict=True)]
    if kind == "poses":
        return maker.new(TYPES[kind], header=header, poses=poses), (*notes, "a PoseArray holds no speeds and no times")
    stamped = [
        maker.new("geometry_msgs/msg/PoseStamped", header=maker.header(frame_id, start + t), pose=pose)
        for t, pose in zip(stamps, poses, strict=True)
    ]
    note = "a Path holds its speeds as the times of its poses only; MultiDOFJointTrajectory keeps them as they are"
    return maker.new(TYPES[kind], header=header, poses=stamped), (*notes, note)


def parse(kind: Kind, message: Any) -> tuple[Trajectory, str, str, tuple[str, ...]]:
    """The trajectory of a message, its frame_id, the body that it moves ("" if absent), and notes."""
    frame_id = str(message.header.frame_id)
    if kind == "multidof":
        trajectory, body, remarks = _parse_points(message)
        return trajectory, frame_id, body, remarks
    poses = list(message.poses)
    columns: dict[str, Array] = {}
    notes: tuple[str, ...] = ()
    if kind == "path":
        frame_id = _one_frame(frame_id, poses)
        columns, notes = _times([stamp_ns(p.header.stamp) for p in poses])
        poses = [stamped.pose for stamped in poses]
    built, said = _built([p.position for p in poses], [p.orientation for p in poses], columns, "poses")
    return built, frame_id, "", notes + said


def _one_frame(frame_id: str, poses: Sequence[Any]) -> str:
    """The frame of a path and of all its stamped poses."""
    for i, stamped in enumerate(poses):
        own = str(stamped.header.frame_id)
        if own and own != (frame_id or own):
            problem = f"is in the frame {brief(own)!r}, the path in {brief(frame_id)!r}; transform it to one frame"
            raise TrajectoryError(problem, key="poses", index=i)
        frame_id = frame_id or own
    return frame_id


def _points(trajectory: Trajectory, turns: Array, stamps: list[int], maker: Maker) -> list[Any]:
    still = maker.vector((0.0, 0.0, 0.0))
    points = []
    velocities = _velocities(trajectory)
    kind = "trajectory_msgs/msg/MultiDOFJointTrajectoryPoint"
    for p, q, v, t in zip(trajectory.positions, turns, velocities, stamps, strict=True):
        transform = maker.new("geometry_msgs/msg/Transform", translation=maker.vector(p), rotation=maker.quaternion(q))
        twist = maker.new("geometry_msgs/msg/Twist", linear=maker.vector(v), angular=still)
        moving: dict[str, Any] = {"transforms": [transform], "velocities": [twist], "accelerations": []}
        points.append(maker.new(kind, **moving, time_from_start=maker.stamp(t, "Duration")))
    return points


def _velocities(trajectory: Trajectory) -> Array:
    """Velocities (N, 3) [m/s]: the speeds, along the path ahead (at its end, behind)."""
    steps = np.diff(trajectory.positions, axis=0)
    moving = np.flatnonzero(np.linalg.norm(steps, axis=1) > 0)
    if not len(moving):
        return np.outer(trajectory.speeds, [1.0, 0.0, 0.0])
    ahead = steps[moving[np.searchsorted(moving, np.arange(len(trajectory))).clip(max=len(moving) - 1)]]
    return np.asarray(ahead * (trajectory.speeds / np.linalg.norm(ahead, axis=1))[:, None])


def _parse_points(message: Any) -> tuple[Trajectory, str, tuple[str, ...]]:
    points, names = list(message.points), list(map(str, message.joint_names))
    for i, point in enumerate(points):
        if len(point.transforms) != 1:
            what = f"moves {len(point.transforms)} bodies ({listing(names)})"
            raise TrajectoryError(f"{what}; a path is the motion of one", key="points", index=i)
    columns, notes = _times([stamp_ns(p.time_from_start) for p in points])
    times = None
    if points and all(len(point.velocities) == 1 for point in points):
        linear = [_xyz(point.velocities[0].linear) for point in points]
        times, notes = columns.get("t"), ()
        columns = {"speed": np.linalg.norm(np.array(linear, dtype=float), axis=1)}
    transforms = [point.transforms[0] for point in points]
    built, said = _built([t.translation for t in transforms], [t.rotation for t in transforms], columns, "points")
    if times is not None and built.duration > 0:
        built, more = _with_dwell(built, times)
        said += more
    return built, next(iter(names), ""), notes + said


def _xyz(vector: Any) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z


def _with_dwell(trajectory: Trajectory, times: Array) -> tuple[Trajectory, tuple[str, ...]]:
    """The trajectory with the timestep that its dwells have by their times, and whether the other times agree."""
    dwell = (np.diff(trajectory.arc_length) == 0) & (trajectory.speeds[1:] == 0)
    if dwell.any():
        timestep = round(float(np.diff(times)[dwell].mean()), 9)
        trajectory = Trajectory(trajectory.positions, trajectory.speeds, trajectory.orientations, timestep)
    if abs(trajectory.duration - times[-1]) > _UNEVEN * max(times[-1], 1e-9):
        ends = f"its times end at {times[-1]:.3g} s, its velocities at {trajectory.duration:.3g} s"
        return trajectory, (f"{ends}; the velocities count",)
    return trajectory, ()


def _times(stamps: list[int]) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Stamps [ns] as the column t [s] from 0, or None if they are not usable."""
    if len(set(stamps)) <= 1:
        return {}, ()
    if any(b <= a for a, b in pairwise(stamps)):
        return {}, ("the stamps do not increase from pose to pose and were ignored",)
    return {"t": np.array([(stamp - stamps[0]) / 1e9 for stamp in stamps])}, ()


def _built(
    places: list[Any], turns: list[Any], columns: dict[str, Array], key: str
) -> tuple[Trajectory, tuple[str, ...]]:
    positions = np.array([_xyz(place) for place in places], dtype=float).reshape(-1, 3)
    rotations = np.array([[q.w, *_xyz(q)] for q in turns], dtype=float).reshape(-1, 4)
    zero, unset = (len(rotations) > 0 and (rotations == [w, 0.0, 0.0, 0.0]).all() for w in (0.0, 1.0))
    own = None if zero or unset else rotations
    built, notes = from_columns(pose_columns(positions, own) | columns, key=key, timestep=None)
    left_out = ("every quaternion has length zero, so the orientations were left out",)
    return built, notes + left_out if zero else notes


def stamp_ns(stamp: Any) -> int:
    """A Time or Duration [ns]."""
    return int(stamp.sec) * _BILLION + int(stamp.nanosec)


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
        accelerations: (N, J) [rad/s^2 or m/s^2], or None.

    Raises:
        TrajectoryError: On shapes that do not fit, a value that is not finite, or times that do not increase.
    """

    names: tuple[str, ...]
    positions: Array
    times: Array
    velocities: Array | None = None
    frame: Frame = _FLU
    accelerations: Array | None = None

    def __post_init__(self) -> None:
        shape = (len(self.times), len(self.names))
        for key in ("positions", "velocities", "accelerations", "times"):
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

    @property
    def duration(self) -> float:
        """[s]."""
        return float(self.times[-1] - self.times[0])

    def after(self, first: JointMotion) -> JointMotion:
        """This motion once another, of the same joints and to where this one starts, has ended; at rest between."""

        def together(key: str) -> Any:
            parts = getattr(first, key), getattr(self, key)
            return None if parts[0] is None or parts[1] is None else np.concatenate([parts[0], parts[1][1:]])

        joined = {key: together(key) for key in ("positions", "velocities", "accelerations")}
        times = np.concatenate([first.times, first.times[-1] + self.times[1:] - self.times[0]])
        return replace(self, times=times, **joined)

    def through(self, forward: Forward) -> Trajectory:
        """The path of the tool by a kinematic model; its speeds follow from the times."""
        poses = [forward(row) for row in self.positions]
        places = np.array([place for place, _ in poses], dtype=float)
        speeds, timestep, _ = speeds_from_times(places, self.times, "times")
        return Trajectory(places, speeds, np.array([turn for _, turn in poses], dtype=float), timestep)


def build_joints(motion: JointMotion, maker: Maker, *, frame_id: str = "") -> Any:
    """A JointTrajectory message for a motion that starts immediately (stamp 0)."""
    frame_id = frame_id or ("" if motion.frame == _FLU else f"base_{motion.frame.name}")
    none = np.zeros((len(motion.times), 0))
    given = {key: getattr(motion, key) for key in ("positions", "velocities", "accelerations")} | {"effort": None}
    points = []
    for i, time in enumerate(motion.times):
        row = {key: maker.floats((none if rows is None else rows)[i]) for key, rows in given.items()}
        due = maker.stamp(round((time - motion.times[0]) * 1e9), "Duration")
        points.append(maker.new("trajectory_msgs/msg/JointTrajectoryPoint", **row, time_from_start=due))
    return maker.new(JOINTS, header=maker.header(frame_id), joint_names=list(motion.names), points=points)


def parse_joints(message: Any) -> JointMotion:
    """The motion in a JointTrajectory message."""
    points, names = list(message.points), tuple(str(name) for name in message.joint_names)
    for i, point in enumerate(points):
        if len(point.positions) != len(names):
            problem = f"holds {len(point.positions)} positions for {len(names)} joints"
            raise TrajectoryError(problem, key="points", index=i)

    def column(key: str) -> Array | None:
        rows = [getattr(point, key) for point in points]
        return np.array(rows, dtype=float) if rows and all(len(row) == len(names) for row in rows) else None

    positions = np.array([point.positions for point in points], dtype=float).reshape(len(points), len(names))
    times = np.array([int(p.time_from_start.sec) + int(p.time_from_start.nanosec) / 1e9 for p in points])
    frame = frame_of(str(message.header.frame_id))
    return JointMotion(names, positions, times, column("velocities"), frame, column("accelerations"))
