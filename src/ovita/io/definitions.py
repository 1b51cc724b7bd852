"""The definitions of ROS messages: those that rosbags brings, and those of MoveIt that it lacks (extra `ros`)."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import Any

from ovita.errors import MissingExtra

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
    try:
        typesys = import_module("rosbags.typesys")
    except ImportError:
        raise MissingExtra("rosbags", "ros") from None
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC if ros1 else typesys.Stores.ROS2_HUMBLE)
    for name, text in MOVEIT.items():
        store.register(typesys.get_types_from_msg(text, name))
    return store
