"""The files in examples/ros do what docs/howto.md says of them."""

import os
import runpy
import subprocess
import sys
import types
from pathlib import Path

import pytest

from ovita.cli.main import cli
from ovita.io.links import deliver
from ovita.paths.scene import Frame, Scene
from ovita.paths.trajectory import Trajectory

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "examples" / "ros"
JUDGES = Path(os.environ.get("OVITA_ROS_JUDGES", HERE.parents[1] / ".ros-judges"))
DOMAIN = 95 + os.getpid() % 5


def test_what_the_launch_file_starts_is_a_command_of_ovita(monkeypatch):
    """Launch itself is on no package index, so that only the command is checked, not that launch runs it."""
    made = types.SimpleNamespace
    stubs = {
        "launch": {"LaunchDescription": lambda parts: parts},
        "launch.actions": {
            "DeclareLaunchArgument": lambda name, **more: made(name=name, **more),
            "ExecuteProcess": lambda **more: made(**more),
        },
        "launch.substitutions": {"LaunchConfiguration": lambda name: f"<{name}>"},
    }
    for name, attributes in stubs.items():
        module = types.ModuleType(name)
        module.__dict__.update(attributes)
        monkeypatch.setitem(sys.modules, name, module)
    *arguments, process = runpy.run_path(str(EXAMPLES / "ovita.launch.py"))["generate_launch_description"]()
    chosen = {f"<{argument.name}>": argument.default_value for argument in arguments}
    program, group, command, *options = [chosen.get(word, word) for word in process.cmd]
    serve = cli.get_command(None, group).get_command(None, command)
    assert program == "ovita" and serve.make_context("serve", options).params["robot"] == "drone"


@pytest.mark.parametrize("name", ["kilted", "jazzy"])
def test_an_adapted_path_is_a_goal_of_nav2(name):
    """nav_msgs/Path from ovita's own DDS, through the example, to a FollowPath server of the real rclpy."""
    pytest.importorskip("cyclonedds")
    python = JUDGES / name / "bin" / "python"
    if not list((JUDGES / name).glob("lib/python3*/site-packages/nav2_msgs")):
        pytest.skip(f"there is no rclpy of {name} with nav2_msgs in {JUDGES}; make ros-judges")
    about = {"ROS_DOMAIN_ID": str(DOMAIN), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "PYTHONUNBUFFERED": "1"}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True, "env": {**os.environ, **about}}
    server = subprocess.Popen([python, HERE / "nav2_judge.py"], **pipes)
    follower = subprocess.Popen([python, EXAMPLES / "follow_adapted.py"], **pipes)
    try:
        assert server.stdout.readline() == "ready\n"
        path = Trajectory([[0, 0, 0], [1, 0.5, 0], [2, 1, 0]], [0.5, 0.5, 0.5])
        deliver(f"ros2:/ovita/adapted?domain={DOMAIN}&local=1&timeout=20", path, Scene(frame=Frame("flu")))
        assert server.stdout.readline() == "map 3 2.0 1.0\n"
        assert "accepted" in follower.stdout.readline()
        assert "ended with error code 0" in follower.stdout.readline()
    finally:
        for process in (server, follower):
            process.kill()
            process.communicate()
