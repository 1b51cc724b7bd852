"""Start ovita with a robot's limits and the objects of a scene file: ros2 launch ovita.launch.py robot:=drone."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration


def generate_launch_description():
    robot, scene = LaunchConfiguration("robot"), LaunchConfiguration("scene")
    return LaunchDescription(
        [
            DeclareLaunchArgument("robot", default_value="drone", description="whose limits hold"),
            DeclareLaunchArgument("scene", default_value="scene.json", description="a file with the objects"),
            ExecuteProcess(cmd=["ovita", "ros", "serve", "--robot", robot, "--scene", scene], output="screen"),
        ]
    )
