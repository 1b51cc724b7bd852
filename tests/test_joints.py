"""Joints of an arm: from a path through inverse kinematics into a bag, and back through the kinematic model."""

import json
import sys

import numpy as np
import pytest

pytest.importorskip("mujoco")
pytest.importorskip("mink")
pytest.importorskip("toppra")
pytest.importorskip("rosbags")

from ovita.chain import adapt
from ovita.cli.transfer_ import convert, send
from ovita.errors import MissingExtra, RequestError, RobotError
from ovita.io import load_task, ros2, save_trajectory
from ovita.io.bags import load_joint_motion
from ovita.io.links import deliver_joints
from ovita.io.messages import JointMotion
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Frame, Scene, SceneObject, transformed
from ovita.paths.trajectory import Trajectory
from ovita.request import Request
from ovita.sim import Base
from ovita.sim.joints import joint_motion, tool_path

PATH = Trajectory([[0.45, 0.1 * i - 0.2, 0.5] for i in range(5)], [0.1, 0.2, 0.2, 0.2, 0.1])
FLU = Frame("flu")


@pytest.fixture(scope="module")
def motion():
    return joint_motion(PATH, Scene(frame=FLU), "iiwa", base=Base())


def test_there_and_back_through_a_bag(motion, tmp_path):
    joints, said = motion
    assert len(joints.names) == 7 and any("Tracking error" in text for text in said)
    assert joints.times[-1] == pytest.approx(PATH.duration, rel=0.05)
    assert (joints.velocities[[0, -1]] == 0).all()
    receipt = deliver_joints(str(tmp_path / "a.mcap"), joints)
    assert receipt.size > 1000 and len(receipt.sha256) == 64
    path = tool_path(load_joint_motion(tmp_path / "a.mcap"), "iiwa")
    assert path.duration == pytest.approx(joints.times[-1])
    along = np.clip(path.positions[:, 1], -0.2, 0.2)
    np.testing.assert_allclose(path.positions, np.column_stack([0 * along + 0.45, along, 0 * along + 0.5]), atol=2e-3)
    assert np.abs(path.positions[[0, -1]] - PATH.positions[[0, -1]]).max() < 2e-3
    mixed = JointMotion(joints.names[::-1], joints.positions[:, ::-1], joints.times)
    np.testing.assert_allclose(tool_path(mixed, "iiwa").positions, path.positions, atol=1e-12)


def test_what_no_arm_can_do(motion):
    with pytest.raises(RequestError, match="no waypoint is within reach"):
        joint_motion(PATH, Scene(frame=FLU), "iiwa", base=Base(5, 5, 0))
    far = Trajectory([[0.45, 0, 0.5], [0.45, 2.0, 0.5]], [0.2, 0.2])
    with pytest.raises(RequestError, match=r"cannot follow this trajectory: 1 waypoint cannot be reached \(2\)"):
        joint_motion(far, Scene(frame=FLU), "iiwa", base=Base())
    inside = Scene((SceneObject("box", [0.45, 0, 0.5], [0.1, 0.1, 0.1]),), FLU)
    with pytest.raises(RequestError, match="would touch box"):
        joint_motion(PATH, inside, "iiwa", base=Base())
    with pytest.raises(RobotError, match="'jackal' is no arm"):
        joint_motion(PATH, Scene(), "jackal")
    with pytest.raises(RobotError, match="the joints x are not those of the KUKA"):
        tool_path(JointMotion(("x",), [[0], [1]], [0, 1]), "iiwa")


def test_joints_go_to_topics_but_not_to_drones(motion, monkeypatch):
    joints, _ = motion
    sent = {}

    def publish(address, build):
        from ovita.io.messages import Maker

        sent["name"], sent["message"] = build(Maker(lambda name, **fields: (name, fields)))
        return b"bytes"

    monkeypatch.setattr(ros2, "publish", publish)
    assert deliver_joints("ros2:/arm/joint_trajectory", joints).size == 5
    assert sent["name"] == "trajectory_msgs/msg/JointTrajectory"
    assert sent["message"][1]["joint_names"] == list(joints.names)
    with pytest.raises(RequestError, match="go to ROS 2 topics or bags only"):
        deliver_joints("mavlink:udp:127.0.0.1:14550", joints)


def test_turned_scenes_mean_the_same(motion):
    joints, _ = motion
    rfu = Frame("rfu")
    moved = transformed(PATH, FLU, rfu)
    other, _ = joint_motion(moved, Scene(frame=rfu), "iiwa", base=Base(yaw=np.pi / 2))
    np.testing.assert_allclose(other.positions[[0, -1]], joints.positions[[0, -1]], atol=1e-3)


def test_the_commands(tmp_path, capsys):
    task, bag, back = (str(tmp_path / name) for name in ("a.json", "j.mcap", "b.json"))
    save_trajectory(task, PATH, Scene(frame=FLU))
    arm = ["--arm", "iiwa", "--base", "0,0,0,0"]
    convert.main([task, bag, "--type", "joints", "--to-topic", "/arm", *arm], standalone_mode=False)
    said = capsys.readouterr()
    assert "points of the joints a1, a2" in said.out and "Tracking error" in said.err
    convert.main([bag, back, *arm], standalone_mode=False)
    assert "the path of the tip of iiwa" in capsys.readouterr().err
    there = load_task(back)
    assert there.scene.frame == FLU
    np.testing.assert_allclose(there.trajectory.positions[[0, -1]], PATH.positions[[0, -1]], atol=2e-3)


def test_the_gate_refuses_what_the_arm_cannot_do(tmp_path, capsys):
    robot = Robot("cell", Box((-2, -2, -2), (2, 2, 2)), max_speed=0.5)
    result = adapt(Request("go up by 0.05", PATH, Scene(frame=FLU), robot), writer="builtin")
    result.save(str(tmp_path / "r.json"))
    out, log = str(tmp_path / "j.mcap"), str(tmp_path / "log.jsonl")
    asked = [str(tmp_path / "r.json"), "--to", out, "--type", "joints", "--arm", "iiwa", "--yes", "--log", log]
    with pytest.raises(SystemExit) as stopped:
        send.main([*asked, "--base", "3,3,0,0"], standalone_mode=False)
    assert stopped.value.code == 4 and "no waypoint is within reach" in capsys.readouterr().out
    with pytest.raises(RequestError, match="joints need an arm and its place"):
        send.main(asked, standalone_mode=False)
    send.main([*asked, "--base", "0,0,0,0"], standalone_mode=False)
    events = [json.loads(line)["event"] for line in (tmp_path / "log.jsonl").read_text().splitlines()]
    assert events == ["refused", "sending", "sent"] and load_joint_motion(out).names[0] == "a1"


def test_without_the_simulation_the_kinematic_model_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    motion = JointMotion(("a1",), np.zeros((2, 1)), np.array([0.0, 1.0]))
    with pytest.raises(MissingExtra, match=r"this needs mujoco: pip install 'ovita\[sim\]'"):
        tool_path(motion)
