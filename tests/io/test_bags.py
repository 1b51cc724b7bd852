"""ROS bags: round trips, topics, frames, and bags that nobody should trust."""

import shutil
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("rosbags")

from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from ovita.errors import FormatError, MissingExtra, TrajectoryError
from ovita.io import Choices, bags, load_task, save_trajectory
from ovita.io.bags import load_joint_motion, save_joint_motion
from ovita.io.messages import TYPES, JointMotion, Maker, build, parse
from ovita.paths.scene import Frame, Scene, SceneObject, transformed
from ovita.paths.trajectory import Trajectory

STORE = get_typestore(Stores.ROS2_HUMBLE)
RNG = np.random.default_rng(7)
POINTS = np.cumsum(RNG.normal(size=(12, 3)), axis=0)
POSITIONS = np.repeat(POINTS, [1, 1, 1, 5, *[1] * 8], axis=0)
SPEEDS = np.array([0.1, 0.2, 0.3, 0.4, 0, 0, 0, 0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8])
PATH = Trajectory(POSITIONS, SPEEDS, RNG.normal(size=(16, 4)), 0.5)


def reread(path, **chosen):
    task = load_task(path, Choices(**chosen))
    return transformed(task.trajectory, task.scene.frame, Frame("rfu")), task


@pytest.mark.parametrize("ending", ["mcap", "db3"])
@pytest.mark.parametrize("kind", ["path", "poses", "multidof"])
def test_round_trips(tmp_path, ending, kind):
    file = tmp_path / f"a.{ending}"
    notes = save_trajectory(file, PATH, Scene((SceneObject("cup", [0, 0, 0]),)), choices=Choices(kind=kind))
    back, task = reread(file)
    assert (back.positions == PATH.positions).all()
    assert np.abs((back.orientations * PATH.orientations).sum(axis=1)) == pytest.approx(1.0)
    assert task.scene.frame == Frame("flu") and task.fixed_frame
    assert task.scene.extra["ros"]["type"] == TYPES[kind]
    assert any("holds no objects" in note for note in notes) and any("flu" in n or "front" in n for n in notes)
    if kind == "multidof":
        np.testing.assert_allclose(back.speeds, PATH.speeds, rtol=1e-15)
        assert back.timestep == 0.5
    elif kind == "path":
        np.testing.assert_allclose(back.durations, PATH.durations, atol=2e-9)
        np.testing.assert_allclose(back.speeds[4:], PATH.speeds[4:], atol=1e-6)
    else:
        assert (back.speeds == 0.1).all() and any("no speeds are given" in note for note in task.notes)
    assert save_trajectory(tmp_path / f"b.{ending}", back, choices=Choices(kind=kind, topic="x"))
    assert load_task(tmp_path / f"b.{ending}").scene.extra["ros"]["topic"] == "/x"


@given(
    st.lists(st.tuples(*[st.integers(-300, 300)] * 3, st.integers(1, 40), st.integers(0, 3)), min_size=2, max_size=15),
    st.sampled_from(list(TYPES)),
)
@settings(derandomize=True, deadline=None, max_examples=60)
def test_messages_hold_any_path(rows, kind):
    if any(a[:3] == b[:3] for a, b in pairwise(rows)):
        return
    repeats = [1 + row[4] for row in rows]
    positions = np.repeat([row[:3] for row in rows], repeats, axis=0) / 100
    speeds = np.concatenate([[row[3] / 20, *[0.0] * row[4]] for row in rows])
    path = Trajectory(positions, speeds)
    maker = Maker(lambda name, **fields: SimpleNamespace(**fields))
    back, frame_id, _, notes = parse(kind, build(kind, path, maker, frame_id="odom", start=7)[0])
    assert (back.positions == path.positions).all() and frame_id == "odom"
    if kind == "path":
        assert back.duration == pytest.approx(path.duration, rel=1e-6)
        uneven = any("uneven" in note or "differ in length" in note for note in notes)
        assert uneven or back.durations == pytest.approx(path.durations, rel=0.06, abs=1e-6)
    if kind == "multidof":
        np.testing.assert_allclose(back.durations, path.durations, rtol=1e-6, atol=1e-8)
        np.testing.assert_allclose(back.speeds, path.speeds, rtol=1e-15)


@pytest.mark.parametrize(("name", "storage"), [("bag", "mcap"), ("bag.db3", "db3")])
def test_a_folder_as_ros_records_it(tmp_path, name, storage):
    folder = f"{tmp_path}/{name}/"
    assert save_trajectory(folder, PATH, choices=Choices(kind="multidof"))
    assert sorted(p.suffix for p in (tmp_path / name).iterdir()) == [f".{storage}", ".yaml"]
    assert (reread(folder)[0].positions == PATH.positions).all()
    with pytest.raises(FormatError, match="there is something of this name already"):
        save_trajectory(folder, PATH)
    with pytest.raises(FormatError, match="cannot be written: no such file"):
        save_trajectory(f"{tmp_path}/no/bag/", PATH)
    assert not [p for p in tmp_path.iterdir() if p.name != name]


def test_what_a_bag_said_is_written_again(tmp_path):
    choices = Choices(topic="/arm/plan", kind="multidof", frame_id="odom_ned")
    save_trajectory(tmp_path / "a.mcap", PATH, choices=choices)
    back, task = reread(tmp_path / "a.mcap")
    assert task.scene.frame == Frame("ned") and (back.positions == PATH.positions).all()
    save_trajectory(tmp_path / "b.mcap", task.trajectory, task.scene)
    assert load_task(tmp_path / "b.mcap").scene.extra == task.scene.extra
    before = (tmp_path / "b.mcap").read_bytes()
    save_trajectory(tmp_path / "b.mcap", task.trajectory, task.scene)
    assert (tmp_path / "b.mcap").read_bytes() == before


def path_message(positions, frames=("map",), header="map", store=STORE, stamps=None):
    t = store.types
    stamps = stamps or list(range(len(positions)))
    extra = {"seq": 0} if store is not STORE else {}

    def head(frame, sec):
        stamp = t["builtin_interfaces/msg/Time"](sec=sec, nanosec=0)
        return t["std_msgs/msg/Header"](stamp=stamp, frame_id=frame, **extra)

    poses = []
    for i, p in enumerate(positions):
        point = t["geometry_msgs/msg/Point"](*map(float, p))
        pose = t["geometry_msgs/msg/Pose"](point, t["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0))
        poses.append(t["geometry_msgs/msg/PoseStamped"](head(frames[i % len(frames)], stamps[i]), pose))
    return t["nav_msgs/msg/Path"](head(header, 0), poses)


def bag(folder, contents, plugin=StoragePlugin.MCAP):
    """A bag folder with messages [(topic, type, message)]."""
    with Writer(folder, version=8, storage_plugin=plugin) as writer:
        known = {}
        for i, (topic, name, message) in enumerate(contents):
            if topic not in known:
                known[topic] = writer.add_connection(topic, name, typestore=STORE)
            if message is not None:
                writer.write(known[topic], i, STORE.serialize_cdr(message, name))
    return folder


LINE = [[0, 0, 0], [1, 0, 0], [2, 0, 0]]
PATH_TYPE = TYPES["path"]


@pytest.mark.parametrize("plugin", list(StoragePlugin), ids=lambda p: p.name)
def test_a_folder_is_read_and_the_topic_is_chosen(tmp_path, plugin):
    string = STORE.types["std_msgs/msg/String"]("hi")
    contents = [
        ("/plan", PATH_TYPE, path_message(LINE)),
        ("/other", PATH_TYPE, path_message([[0, 0, 0], [0, 5, 0]])),
        ("/chat", "std_msgs/msg/String", string),
    ]
    folder = bag(tmp_path / "bag", contents, plugin)
    with pytest.raises(FormatError, match=r"several topics with a path.*--topic: /other .*, /plan \(nav_msgs/msg/Path"):
        load_task(folder)
    assert len(load_task(folder, Choices(topic="plan")).trajectory) == 3
    assert load_task(folder, Choices(topic="/other")).trajectory.length == 5
    with pytest.raises(FormatError, match=r"/chat is a std_msgs/msg/String, not a path; topics with a path: /other"):
        load_task(folder, Choices(topic="/chat"))
    with pytest.raises(FormatError, match="/nowhere is not in this bag"):
        load_task(folder, Choices(topic="/nowhere"))
    only = bag(tmp_path / "only", contents[2:], plugin)
    with pytest.raises(FormatError, match="no topic holds a path; its topics are /chat"):
        load_task(only)


def test_the_last_of_several_messages(tmp_path):
    contents = [("/plan", PATH_TYPE, path_message(np.array(LINE) * k)) for k in (1, 2, 3)]
    folder = bag(tmp_path / "bag", contents)
    task = load_task(folder)
    assert task.trajectory.length == 6 and "/plan holds 3 messages; read the last" in task.notes[0]
    assert load_task(folder, Choices(message=0)).trajectory.length == 2
    with pytest.raises(FormatError, match="there is no message 3 on /plan; it holds 3"):
        load_task(folder, Choices(message=3))


def test_mixed_frames(tmp_path):
    folder = bag(tmp_path / "a", [("/plan", PATH_TYPE, path_message(LINE, frames=("map", "odom")))])
    with pytest.raises(FormatError, match=r"poses\[1\] is in the frame 'odom', the path in 'map'"):
        load_task(folder)
    contents = [("/plan", PATH_TYPE, path_message(LINE, frames=(f,), header=f)) for f in ("map", "odom")]
    folder = bag(tmp_path / "b", contents)
    with pytest.raises(FormatError, match=r"the 2 messages on /plan are in different frames \(map, odom\)"):
        load_task(folder)
    assert load_task(folder, Choices(message=1)).scene.extra["ros"]["frame_id"] == "odom"
    contents = [("/plan", PATH_TYPE, path_message(LINE, frames=("",), header="camera_optical_frame"))]
    with pytest.raises(FormatError, match="a camera's optical frame"):
        load_task(bag(tmp_path / "c", contents))


@pytest.mark.parametrize(
    ("message", "problem"),
    [
        (path_message([[0, 0, 0], [np.nan, 0, 0]]), r"poses\[1\] x is nan, not a finite"),
        (path_message([[0, 0, 0]]), "has 1 waypoint"),
        (path_message([]), "has no waypoint"),
    ],
)
def test_unusable_paths(tmp_path, message, problem):
    with pytest.raises(FormatError, match=problem):
        load_task(bag(tmp_path / "bag", [("/plan", PATH_TYPE, message)]))


def test_stamps_that_tell_no_times(tmp_path):
    same = bag(tmp_path / "a", [("/plan", PATH_TYPE, path_message(LINE, stamps=[5, 5, 5]))])
    assert (load_task(same).trajectory.speeds == 0.1).all()
    back = bag(tmp_path / "b", [("/plan", PATH_TYPE, path_message(LINE, stamps=[5, 7, 6]))])
    assert "the stamps do not increase" in load_task(back).notes[0]


def test_a_recording_without_messages(tmp_path):
    folder = bag(tmp_path / "bag", [("/plan", PATH_TYPE, None)])
    with pytest.raises(FormatError, match="there is no message on /plan; the recording may have been cut off"):
        load_task(folder)


@pytest.mark.parametrize("ending", ["mcap", "db3"])
def test_cut_off_and_damaged_bags(tmp_path, ending):
    save_trajectory(tmp_path / f"a.{ending}", PATH)
    whole = (tmp_path / f"a.{ending}").read_bytes()
    cut = tmp_path / f"cut.{ending}"
    for length in [0, 1, 7, 100, *range(200, len(whole) - 40, len(whole) // 12)]:
        cut.write_bytes(whole[:length])
        try:
            task = load_task(cut)
        except FormatError as error:
            assert "\n" not in str(error) and str(error).startswith(str(cut))
        else:  # the message was whole, and what came after it is missing
            assert ending == "mcap" and "the recording was cut off" in task.notes[0]
            assert task.trajectory == load_task(tmp_path / "a.mcap").trajectory
    rng = np.random.default_rng(0)
    for _ in range(25):
        damaged = bytearray(whole)
        for i in rng.integers(0, len(whole), 40):
            damaged[i] = int(rng.integers(0, 256))
        cut.write_bytes(bytes(damaged))
        try:
            load_task(cut)
        except FormatError as error:
            assert "\n" not in str(error)


def test_missing_files_and_folders(tmp_path):
    with pytest.raises(FormatError, match="there is no such file"):
        load_task(tmp_path / "no.mcap")
    (tmp_path / "x.bag").mkdir()
    with pytest.raises(FormatError):
        load_task(tmp_path / "x.bag")
    (tmp_path / "half").mkdir()
    (tmp_path / "half" / "metadata.yaml").write_text("rosbag2_bagfile_information: [")
    with pytest.raises(FormatError, match="cannot be read as a bag"):
        load_task(tmp_path / "half")
    save_trajectory(tmp_path / "a.mcap", PATH)
    folder = bag(tmp_path / "whole", [("/plan", PATH_TYPE, path_message(LINE))])
    next(folder.glob("*.mcap")).unlink()
    with pytest.raises(FormatError, match="cannot be read as a bag"):
        load_task(folder)
    shutil.rmtree(folder)


def test_ros_1_bags_are_read(tmp_path):
    noetic = get_typestore(Stores.ROS1_NOETIC)
    with Writer1(tmp_path / "a.bag") as writer:
        connection = writer.add_connection("/plan", PATH_TYPE, typestore=noetic)
        message = path_message(LINE, store=noetic)
        writer.write(connection, 0, noetic.serialize_ros1(message, PATH_TYPE))
    task = load_task(tmp_path / "a.bag")
    assert task.trajectory.positions.tolist() == LINE and task.trajectory.speeds.tolist() == [1, 1, 1]


def test_several_bodies_are_no_path(tmp_path):
    message, _ = build("multidof", PATH, bags.bag_maker())
    message.points[3].transforms = message.points[3].transforms * 2
    with pytest.raises(FormatError, match=r"points\[3\] moves 2 bodies"):
        load_task(bag(tmp_path / "bag", [("/m", TYPES["multidof"], message)]))


def test_velocities_win_over_times_that_disagree(tmp_path):
    message, _ = build("multidof", PATH, bags.bag_maker())
    for point in message.points:
        point.time_from_start.sec *= 3
    task = load_task(bag(tmp_path / "bag", [("/m", TYPES["multidof"], message)]))
    np.testing.assert_allclose(task.trajectory.speeds, PATH.speeds, rtol=1e-15)
    assert any("the velocities count" in note for note in task.notes)


def test_without_velocities_the_times_count(tmp_path):
    message, _ = build("multidof", PATH, bags.bag_maker())
    for point in message.points:
        point.velocities = []
    task = load_task(bag(tmp_path / "bag", [("/m", TYPES["multidof"], message)]))
    np.testing.assert_allclose(task.trajectory.durations, PATH.durations, atol=2e-9)


MOTION = JointMotion(("a", "b"), [[0, 1], [0.5, 1.25], [1, 1.5]], [0, 0.5, 1.25], [[0, 0], [1, 0.5], [0, 0]])


def test_motions_of_joints(tmp_path):
    for motion in (MOTION, JointMotion(MOTION.names, MOTION.positions, MOTION.times)):
        save_joint_motion(tmp_path / "j.mcap", motion)
        back = load_joint_motion(tmp_path / "j.mcap")
        assert back.names == motion.names and (back.positions == motion.positions).all()
        assert (back.times == motion.times).all()
        assert (back.velocities is None) == (motion.velocities is None)
        assert motion.velocities is None or (back.velocities == motion.velocities).all()
    with pytest.raises(FormatError, match=r"holds joint positions \(a, b\), not a path.*kinematic model"):
        load_task(tmp_path / "j.mcap")
    tool = MOTION.through(lambda q: ((q[0], q[1], 0.0), (1.0, 0.0, 0.0, 0.0)))
    assert tool.positions[1].tolist() == [0.5, 1.25, 0] and tool.duration == pytest.approx(1.25)
    save_trajectory(tmp_path / "p.mcap", PATH)
    with pytest.raises(FormatError, match="no topic holds"):
        load_joint_motion(tmp_path / "p.mcap")


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"times": [0, 0.5, 0.5]}, "increase strictly"),
        ({"positions": [[0, 1], [0.5, np.nan], [1, 1]]}, "not finite"),
        ({"positions": [[0, 1], [0.5, 1]]}, "shape"),
        ({"names": ()}, "shape|at least 1 joint"),
    ],
)
def test_motions_that_make_no_sense(change, problem):
    fields = {"names": ("a", "b"), "positions": MOTION.positions, "times": MOTION.times} | change
    with pytest.raises(TrajectoryError, match=problem):
        JointMotion(**fields)


def test_without_rosbags(tmp_path, monkeypatch):
    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr("ovita.io.bags.import_module", missing)
    with pytest.raises(MissingExtra, match=r"pip install 'ovita\[ros\]'"):
        save_trajectory(tmp_path / "a.mcap", PATH)
    assert not (tmp_path / "a.mcap").exists()


def test_the_maker_needs_no_ros():
    made = Maker(lambda name, **fields: (name, fields))
    message, notes = build("poses", PATH, made, frame_id="map")
    assert message[0] == TYPES["poses"] and len(message[1]["poses"]) == 16 and "no speeds" in notes[-1]
