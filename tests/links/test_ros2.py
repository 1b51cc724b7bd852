"""ROS 2 without ROS: two processes on loopback, with the names and the wire format of ROS 2."""

import json
import os
import subprocess
import sys
import textwrap
import types

import numpy as np
import pytest

pytest.importorskip("cyclonedds")
pytest.importorskip("rosbags")

from rosbags.typesys import Stores, get_typestore

from ovita.errors import FormatError, LinkError, MissingExtra
from ovita.io import bus, open_task
from ovita.io.links import Address, deliver
from ovita.io.messages import JOINTS, TYPES, JointMotion, Maker, build, build_joints, parse_joints
from ovita.paths.scene import Frame, Scene, transformed
from ovita.paths.trajectory import Trajectory

LOOPBACK = """<CycloneDDS><Domain>
<General><Interfaces><NetworkInterface name="lo"/></Interfaces><AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>40</MaxAutoParticipantIndex>
<Peers><Peer address="localhost"/></Peers></Discovery></Domain></CycloneDDS>"""
DOMAIN = 100 + os.getpid() % 100
PATH = Trajectory([[0, 0, 0], [1, 0.5, 0], [2, 1, 0.25], [3, 0, 1]], [0.25, 0.5, 0.5, 0.125], [[1, 2, 3, 4]] * 4)
STORE = get_typestore(Stores.ROS2_HUMBLE)


def maker():
    return Maker(lambda name, **fields: bus.idl_type(name)(**fields))


@pytest.fixture
def loopback(monkeypatch):
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)


def other(code):
    """Another process on the same isolated domain."""
    done = [sys.executable, "-c", textwrap.dedent(code).replace("DOMAIN", str(DOMAIN))]
    return subprocess.Popen(done, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def finished(process):
    out, err = process.communicate(timeout=20)
    assert process.returncode == 0, err
    return json.loads(out)


@pytest.mark.parametrize("kind", list(TYPES))
def test_messages_are_those_of_ros_to_the_byte(kind):
    name = TYPES[kind]
    ours, _ = build(kind, PATH, maker(), frame_id="map", start=1_700_000_000_123_456_789)
    theirs, _ = build(
        kind, PATH, Maker(lambda n, **f: STORE.types[n](**f), floats=np.asarray), start=1_700_000_000_123_456_789
    )
    assert bytes(ours.serialize()) == bytes(STORE.serialize_cdr(theirs, name))
    package, _, short = name.partition("/msg/")
    assert type(ours).__idl_typename__.replace(".", "::") == f"{package}::msg::dds_::{short}_" == bus.ros_type(name)


def test_motions_of_joints_too():
    motion = JointMotion(("a", "b"), [[0, 1], [0.5, 1.25]], [0, 0.5], [[0, 0], [1, 0.5]])
    message = build_joints(motion, maker())
    read = STORE.deserialize_cdr(bytes(message.serialize()), JOINTS)
    assert (parse_joints(read).positions == motion.positions).all()


RECEIVE = """
    import json
    from ovita.io import open_task
    task = open_task("ros2:/plan?domain=DOMAIN&timeout=15", frame="rfu")
    path = task.trajectory
    print(json.dumps([path.positions.tolist(), path.speeds.tolist(), path.orientations.tolist(), list(task.notes)]))
"""


def test_two_processes(loopback):
    listener = other(RECEIVE)
    receipt = deliver(f"ros2:/plan?domain={DOMAIN}&timeout=15&type=multidof", PATH, Scene())
    positions, speeds, orientations, notes = finished(listener)
    np.testing.assert_allclose(positions, PATH.positions, atol=1e-15)
    np.testing.assert_allclose(speeds, PATH.speeds, rtol=1e-15)
    assert np.abs((np.array(orientations) * PATH.orientations).sum(axis=1)) == pytest.approx(1.0)
    assert len(receipt.sha256) == 64 and any("ROS frame 'map', read as flu" in note for note in notes)


SPEAK = """
    import time
    from cyclonedds.core import Policy, Qos
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.pub import DataWriter
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic
    from cyclonedds.util import duration
    from ovita.io.messages import Maker, build
    from ovita.io import bus
    from ovita.paths.trajectory import Trajectory

    path = Trajectory([[0, 0, 0], [1, 0, 0], [1, 2, 0]], [1, 1, 1])
    message, _ = build("path", path, Maker(lambda name, **f: bus.idl_type(name)(**f)), frame_id="odom")
    participant = DomainParticipant(DOMAIN)
    writers = {}
    for name in ("Volatile", "TransientLocal"):
        qos = Qos(Policy.Reliability.Reliable(duration(seconds=1)), getattr(Policy.Durability, name),
                  Policy.History.KeepLast(10))
        writers[name] = DataWriter(participant, Topic(participant, f"rt/{name}", type(message)), qos=qos)
    writers["TransientLocal"].write(message)
    pose = Topic(participant, "rt/pose", bus.idl_type("geometry_msgs/msg/PoseStamped"))
    kept = DataWriter(participant, pose), DataReader(participant, pose)
    print("ready", flush=True)
    while True:
        writers["Volatile"].write(message)
        time.sleep(0.05)
"""


@pytest.fixture(scope="module")
def speaker():
    """Another process that publishes with the settings that ROS 2 has by default, and latched."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CYCLONEDDS_URI", LOOPBACK)
        process = other(SPEAK)
    assert process.stdout.readline() == "ready\n"
    yield
    process.kill()
    process.communicate()


@pytest.mark.parametrize("durability", ["Volatile", "TransientLocal"])
def test_a_publisher_as_ros_has_it(loopback, speaker, durability):
    task = open_task(f"ros2:/{durability}?domain={DOMAIN}&timeout=15")
    assert task.trajectory.positions.tolist() == [[0, 0, 0], [1, 0, 0], [1, 2, 0]]
    assert task.scene.extra["ros"]["frame_id"] == "odom" and task.scene.frame == Frame("flu")


def test_nobody_there_and_wrong_topics(loopback, speaker):
    with pytest.raises(LinkError, match=r"nobody subscribed to /x in domain \d+ within 0.3 s; nothing was sent"):
        deliver(f"ros2:/x?domain={DOMAIN + 1}&timeout=0.3", PATH, Scene())
    with pytest.raises(LinkError, match=r"nobody publishes /x in domain \d+ within 0.3 s$"):
        open_task(f"ros2:/x?domain={DOMAIN + 1}&timeout=0.3")
    with pytest.raises(LinkError, match="/pose carries geometry_msgs/msg/PoseStamped, not nav_msgs/msg/Path"):
        open_task(f"ros2:/pose?domain={DOMAIN}&timeout=10&type=path")
    with pytest.raises(LinkError, match=r"nobody publishes /plan .*topics there: /TransientLocal, /Volatile, /pose"):
        open_task(f"ros2:/plan?domain={DOMAIN}&timeout=2")
    with pytest.raises(LinkError, match=r"those there take geometry_msgs/msg/PoseStamped, not nav_msgs/msg/Path"):
        deliver(f"ros2:/pose?domain={DOMAIN}&timeout=2", PATH, Scene())


def test_a_broken_network_setting(monkeypatch):
    monkeypatch.setenv(
        "CYCLONEDDS_URI",
        '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="none9"/>'
        "</Interfaces></General></Domain></CycloneDDS>",
    )
    with pytest.raises(LinkError, match="DDS cannot start here"):
        open_task("ros2:/x?domain=231&timeout=0.3")


def test_without_the_extra(monkeypatch):
    monkeypatch.setattr(bus, "find_spec", lambda name: None)
    monkeypatch.setitem(sys.modules, "cyclonedds", None)
    with pytest.raises(MissingExtra, match=r"pip install 'ovita\[ros\]'"):
        open_task("ros2:/x")


def test_a_ros_that_is_not_set_up_is_passed_over(monkeypatch):
    monkeypatch.setitem(sys.modules, "rclpy", None)
    monkeypatch.setattr(bus, "find_spec", lambda name: object())
    assert not bus.has_rclpy()


class Node:
    """What ovita uses of rclpy's node."""

    def __init__(self, offered, subscribers):
        self.context, self.offered, self.subscribers, self.published = None, offered, subscribers, []

    def create_publisher(self, kind, topic, profile):
        return types.SimpleNamespace(
            get_subscription_count=lambda: self.subscribers,
            publish=self.published.append,
            wait_for_all_acked=lambda timeout: True,
        )

    def create_subscription(self, kind, topic, heard, profile):
        message, _ = build("poses", PATH, Maker(lambda n, **f: STORE.types[n](**f)))
        heard(message, {"source_timestamp": 7})

    def get_topic_names_and_types(self):
        return self.offered

    def get_publishers_info_by_topic(self, topic):
        profile = types.SimpleNamespace(reliability=1, durability=2)
        return [
            types.SimpleNamespace(topic_type=kind, qos_profile=profile, node_name="other")
            for kind in dict(self.offered).get(topic, ())
        ]

    def get_subscriptions_info_by_topic(self, topic):
        return []

    def get_name(self):
        return "ovita"

    def destroy_node(self):
        pass


@pytest.fixture
def rclpy(monkeypatch):
    """rclpy as far as ovita uses it; the real one exists only where ROS 2 is installed."""
    node = Node([("/plan", [TYPES["poses"]]), ("/scan", ["sensor_msgs/msg/LaserScan"])], 1)
    executor = types.SimpleNamespace(add_node=lambda n: None, remove_node=lambda n: None, spin_once=lambda **k: None)
    modules = {
        "rclpy": {
            "Context": lambda: None,
            "init": lambda **k: None,
            "create_node": lambda name, **k: node,
            "shutdown": lambda **k: None,
        },
        "rclpy.duration": {"Duration": lambda **k: None},
        "rclpy.executors": {"SingleThreadedExecutor": lambda **k: executor},
        "rclpy.qos": {
            "QoSProfile": lambda **k: k,
            "DurabilityPolicy": types.SimpleNamespace(TRANSIENT_LOCAL=1, VOLATILE=2),
            "ReliabilityPolicy": types.SimpleNamespace(RELIABLE=1, BEST_EFFORT=2),
        },
        "rclpy.serialization": {"serialize_message": lambda m: STORE.serialize_cdr(m, m.__msgtype__)},
    }
    for name, content in modules.items():
        module = types.ModuleType(name)
        module.__dict__.update(content)
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr(bus, "message_class", lambda name: STORE.types[name])
    monkeypatch.setattr(bus, "find_spec", lambda name: name == "rclpy")
    return node


def test_rclpy_is_used_where_it_is_installed(rclpy):
    task = open_task("ros2:/plan?domain=3", frame="rfu")
    np.testing.assert_allclose(task.trajectory.positions, transformed(PATH, Frame("flu"), Frame("rfu")).positions)
    receipt = deliver("ros2:/plan", PATH, Scene())
    assert len(rclpy.published[0].poses) == 4 and receipt.size > 100
    with pytest.raises(LinkError, match=r"/scan carries sensor_msgs/msg/LaserScan, not "):
        open_task("ros2:/scan")
    with pytest.raises(LinkError, match="nobody publishes /no in domain"):
        open_task("ros2:/no?timeout=0.1")
    rclpy.subscribers = 0
    with pytest.raises(LinkError, match="nobody subscribed to /plan"):
        deliver("ros2:/plan?timeout=0.1", PATH, Scene())


def test_a_message_that_is_no_path(rclpy, monkeypatch):
    monkeypatch.setattr(
        Node, "create_subscription", lambda self, kind, topic, heard, profile: heard(empty(), {"source_timestamp": 1})
    )

    def empty():
        message, _ = build("poses", PATH, Maker(lambda n, **f: STORE.types[n](**f)))
        message.poses = message.poses[:1]
        return message

    with pytest.raises(FormatError, match=r"ros2:/plan: .*has 1 waypoint"):
        open_task("ros2:/plan")
    assert Address.parse("ros2:/plan").bus == "ros2"
