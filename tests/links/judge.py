"""What a ROS 2 node of its own does, with nothing of ovita: run by the Python of a distribution's wheels.

judge.py say TYPE TOPIC DOMAIN [best_effort|latched|default] [COUNT]    publish until killed, or COUNT messages
judge.py hear TYPE TOPIC DOMAIN [best_effort|latched|default] [COUNT]   print COUNT messages as JSON
"""

import json
import sys
import time
from importlib import import_module

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy


def kind_of(name):
    package, _, short = name.partition("/msg/")
    return getattr(import_module(f"{package}.msg"), short)


def as_dict(value):
    if hasattr(value, "get_fields_and_field_types"):
        return {name: as_dict(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, (str, int, float, bool)):
        return value
    return [as_dict(item) for item in value]


def planned(name, message, i):
    """A plan of MoveIt around a trajectory of joints."""
    plan = message if name.endswith("/RobotTrajectory") else kind_of("moveit_msgs/msg/RobotTrajectory")()
    plan.joint_trajectory = filled("trajectory_msgs/msg/JointTrajectory", i)
    if plan is not message:
        message.trajectory = [plan]
    return message


def put(message, x):
    """Move a pose, point or transform to x, whatever it is wrapped in."""
    place = message
    for field in ("pose", "pose", "point", "transform"):
        place = getattr(place, field, place)
    getattr(place, "position", getattr(place, "translation", place)).x = x
    if hasattr(message, "child_frame_id"):
        message.child_frame_id = "base_link"


def filled(name, i):
    """Message i of a robot that drives at 0.5 m/s along x, at 50 Hz."""
    message = kind_of(name)()
    if hasattr(message, "data"):
        message.data = f"message {i}"
        return message
    nanoseconds = 1_700_000_000_000_000_000 + i * 20_000_000

    def stamped(header, at=nanoseconds):
        header.frame_id = "map"
        header.stamp.sec, header.stamp.nanosec = divmod(at, 1_000_000_000)

    if name.startswith("moveit"):
        return planned(name, message, i)
    stamped(message.header)
    if name.endswith("/Path"):
        for k in range(4):
            pose = kind_of("geometry_msgs/msg/PoseStamped")()
            stamped(pose.header, nanoseconds + k * 1_000_000_000)
            pose.pose.position.x, pose.pose.position.y = 0.5 * k, float(i)
            message.poses.append(pose)
    elif name.endswith("/PoseArray"):
        for k in range(4):
            pose = kind_of("geometry_msgs/msg/Pose")()
            pose.position.x = 0.5 * k
            message.poses.append(pose)
    elif name.endswith("/MultiDOFJointTrajectory"):
        message.joint_names = ["base_link"]
        for k in range(4):
            point = kind_of("trajectory_msgs/msg/MultiDOFJointTrajectoryPoint")()
            turn, twist = kind_of("geometry_msgs/msg/Transform")(), kind_of("geometry_msgs/msg/Twist")()
            turn.translation.x, twist.linear.x = 0.5 * k, 0.5
            point.transforms, point.velocities, point.time_from_start.sec = [turn], [twist], k
            message.points.append(point)
    elif name.endswith("/JointTrajectory"):
        message.joint_names = ["a", "b"]
        for k in range(4):
            point = kind_of("trajectory_msgs/msg/JointTrajectoryPoint")()
            point.positions, point.time_from_start.sec = [0.1 * k, 0.2 * k], k
            message.points.append(point)
    elif name.endswith("/JointState"):
        message.name, message.position = ["a", "b"], [0.01 * i, 0.02 * i]
    else:
        put(message, 0.01 * i)
    return message


def main(what, name, topic, domain, quality="default", count="0"):
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=int(domain))
    node = rclpy.create_node("judge", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    profile = QoSProfile(
        history=HistoryPolicy.KEEP_ALL if int(count) > 100 else HistoryPolicy.KEEP_LAST,
        depth=50,
        reliability=ReliabilityPolicy.BEST_EFFORT if quality == "best_effort" else ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if quality == "latched" else DurabilityPolicy.VOLATILE,
    )
    if what == "hear":
        heard = []
        node.create_subscription(kind_of(name), topic, heard.append, profile)
        print("ready", flush=True)
        while len(heard) < max(int(count), 1):
            executor.spin_once(timeout_sec=0.05)
        print(json.dumps([as_dict(message) for message in heard]), flush=True)
        return
    publisher = node.create_publisher(kind_of(name), topic, profile)
    print("ready", flush=True)
    if quality == "latched":
        publisher.publish(filled(name, 0))
    while int(count) and not publisher.get_subscription_count():
        executor.spin_once(timeout_sec=0.01)
    i = 0
    while not int(count) or i < int(count):
        if quality != "latched":
            publisher.publish(filled(name, i))
        i += 1
        executor.spin_once(timeout_sec=0.001)
        time.sleep(0.02 if not int(count) else 0.002)
    time.sleep(5)


main(*sys.argv[1:])
