"""ovita against real ROS 2: nodes of the rclpy wheels of two distributions, each in an own virtual environment.

`make ros-judges` makes them in .ros-judges/kilted and .ros-judges/jazzy; OVITA_ROS_JUDGES names another folder.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds")
pytest.importorskip("rosbags")

from ovita.errors import LinkError
from ovita.io import open_task
from ovita.io.bags import JOINT_PLANS
from ovita.io.links import Address, deliver, deliver_joints
from ovita.io.messages import JOINTS, TYPES, JointMotion
from ovita.io.recorded import JOINT_STATE
from ovita.io.ros2 import receive_joints, topics
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory

HERE = Path(__file__).parent
JUDGES = Path(os.environ.get("OVITA_ROS_JUDGES", HERE.parents[1] / ".ros-judges"))
DOMAIN = 20 + os.getpid() % 70
PATH = Trajectory([[0, 0, 0], [1, 0.5, 0], [2, 1, 0.25]], [0.5, 0.5, 0.5])


@pytest.fixture(params=["kilted", "jazzy"], scope="module")
def judge(request):
    """Starts a node of a distribution, which says that it is there."""
    python = JUDGES / request.param / "bin" / "python"
    if not python.exists():
        pytest.skip(f"there is no ROS 2 {request.param} in {JUDGES}; make ros-judges")
    running = []

    def start(*words):
        process = subprocess.Popen(
            [str(python), str(HERE / "judge.py"), *map(str, words)],
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"},
        )
        running.append(process)
        assert process.stdout.readline() == "ready\n"
        return process

    start.python = python
    yield start
    for process in running:
        process.kill()
        process.communicate()


def address(topic, **options):
    told = "".join(f"&{key}={value}" for key, value in options.items())
    return f"ros2:{topic}?domain={DOMAIN}&local=1&timeout=15{told}"


def test_both_ways(judge):
    """The review found that nothing went either way with Kilted."""
    judge("say", TYPES["path"], "/plan", DOMAIN, "latched")
    assert open_task(address("/plan")).trajectory.positions[-1].tolist() == [1.5, 0.0, 0.0]
    hearing = judge("hear", TYPES["path"], "/adapted", DOMAIN)
    deliver(address("/adapted"), PATH, Scene())
    (heard,) = json.loads(hearing.communicate(timeout=20)[0])
    assert len(heard["poses"]) == 3 and heard["header"]["stamp"]["sec"] > 1_700_000_000


def test_best_effort_odometry_is_recorded(judge):
    judge("say", "nav_msgs/msg/Odometry", "/odom", DOMAIN, "best_effort")
    task = open_task(address("/odom", **{"for": 1.5}))
    assert task.trajectory.speeds.mean() == pytest.approx(0.5, rel=0.5)
    there = {row.topic: row for row in topics(Address.parse(address("/x").replace("timeout=15", "timeout=4")))}
    assert there["/odom"].types == ("nav_msgs/msg/Odometry",) and there["/odom"].offered == "best effort"
    with pytest.raises(LinkError, match="/odom carries nav_msgs/msg/Odometry, not nav_msgs/msg/Path"):
        open_task(address("/odom", type="path"))


@pytest.mark.parametrize("kind", [*JOINT_PLANS, JOINT_STATE])
def test_joints_are_heard(judge, kind):
    needs(judge, kind.partition("/")[0])
    topic = f"/{kind.rpartition('/')[2].lower()}"
    judge("say", kind, topic, DOMAIN)
    motion, _ = receive_joints(Address.parse(address(topic, **{"for": 0.5})))
    assert motion.names == ("a", "b")
    assert motion.positions.shape == (4, 2) if kind != JOINT_STATE else len(motion.positions) > 10


def test_joints_are_told(judge):
    hearing = judge("hear", JOINTS, "/controller", DOMAIN)
    deliver_joints(address("/controller"), JointMotion(("a", "b"), [[0, 0], [0.1, 0.2]], [0, 1]))
    (heard,) = json.loads(hearing.communicate(timeout=20)[0])
    assert heard["joint_names"] == ["a", "b"] and heard["points"][1]["positions"] == [0.1, 0.2]


def needs(judge, package):
    """Skip where a distribution lacks the messages that `judge_messages.py` builds."""
    if not list(judge.python.parents[1].glob(f"lib/python3*/site-packages/{package}")):
        pytest.skip(f"{judge.python} has no {package}; make ros-judges")


@pytest.mark.parametrize("backend", ["dds", "rclpy"])
def test_a_node_of_ros_asks_ours(judge, backend, tmp_path):
    """The example of the documentation, as a node of the distribution, against `ovita ros serve` on either backend."""
    asking = judge.python
    running = sys.executable if backend == "dds" else asking
    root = HERE.parents[1]
    environment = {
        **os.environ,
        "ROS_DOMAIN_ID": str(DOMAIN + 1),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "PYTHONPATH": str(root / "src"),
    }
    command = [str(running), "-m", "ovita", "ros", "serve", "--robot", "drone", "--writer", "builtin"]
    node = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
    try:
        assert ("services /ovita/accept" in node.stdout.readline()) == (backend == "rclpy")
        ask = [str(asking), str(root / "examples" / "ros" / "ask_ovita.py"), "go left by 0.2"]
        said = subprocess.run(ask, capture_output=True, text=True, timeout=40, env=environment)
        assert said.stdout.startswith("done"), said.stdout + said.stderr
        assert "40 poses, to 1.95 0.20 0.50" in said.stdout
        assert node.poll() is None
    finally:
        node.kill()
        node.communicate()
