"""What robots record: read, smoothed and thinned; what cannot be used is said in one sentence."""

import numpy as np
import pytest

pytest.importorskip("rosbags")

from rosbags.rosbag1 import Reader as Reader1
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from ovita.errors import FormatError
from ovita.io import Choices, load_task, save_trajectory
from ovita.io.bags import bag_maker, load_joint_motion
from ovita.io.geodesy import Home
from ovita.io.messages import TYPES, JointMotion, build, build_joints, typestore
from ovita.io.smoothing import smoothed
from ovita.paths.trajectory import Trajectory

HZ = 50.0
SECOND = 10**9
START = 1_700_000_000 * SECOND


def drive(seconds=12.0, standing=(5.0, 7.0), noise=0.003, seed=0):
    """Times, true speeds and noisy positions of a winding drive at 0.5 m/s that starts, stands and ends at rest."""
    fine = np.linspace(0.0, seconds, round(seconds * 1000) + 1)
    gaps = [fine, seconds - fine]
    if standing:
        middle, half = np.mean(standing), np.diff(standing)[0] / 2
        gaps.append(np.abs(fine - middle) - half)
    speed = 0.5 * np.clip(np.minimum.reduce(gaps) / 0.8, 0, 1)
    along = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 * 0.001)])
    heading = 1.2 * np.sin(1.3 * along)
    steps = np.diff(along)[:, None] * np.column_stack([np.cos(heading), np.sin(heading), 0 * heading])[1:]
    places = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    pick = np.arange(0, len(fine), round(1000 / HZ))
    rng = np.random.default_rng(seed)
    return fine[pick], speed[pick], places[pick] + rng.normal(size=(len(pick), 3)) * noise


def sample(kind, place, nanoseconds, maker, *, frame="map", child="base_link", turn=(1.0, 0.0, 0.0, 0.0)):
    """One message of what robots record."""
    head, new = maker.header(frame, nanoseconds), maker.new
    place = (*place, 0.0)[:3]
    pose = maker.pose(place, turn)
    covered = {"covariance": np.zeros(36)}
    transform = {"translation": maker.vector(place), "rotation": maker.quaternion(turn)}
    stamped = {
        "child_frame_id": child,
        "transform": new("geometry_msgs/msg/Transform", **transform),
    }
    match kind.rpartition("/")[2]:
        case "Odometry":
            zero = maker.vector((0, 0, 0))
            twist = new("geometry_msgs/msg/Twist", linear=zero, angular=zero)
            return new(
                kind,
                header=head,
                child_frame_id=child,
                pose=new("geometry_msgs/msg/PoseWithCovariance", pose=pose, **covered),
                twist=new("geometry_msgs/msg/TwistWithCovariance", twist=twist, **covered),
            )
        case "PoseStamped":
            return new(kind, header=head, pose=pose)
        case "PoseWithCovarianceStamped":
            return new(kind, header=head, pose=new("geometry_msgs/msg/PoseWithCovariance", pose=pose, **covered))
        case "PointStamped":
            return new(kind, header=head, point=maker.vector(place, "Point"))
        case "TransformStamped":
            return new(kind, header=head, **stamped)
        case "TFMessage":
            return new(kind, transforms=[new("geometry_msgs/msg/TransformStamped", header=head, **stamped)])
        case "JointState":
            empty = np.zeros(0)
            return new(kind, header=head, name=["a", "b"], position=np.array(place[:2]), velocity=empty, effort=empty)
    raise AssertionError(kind)


KINDS = [
    "nav_msgs/msg/Odometry",
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/PointStamped",
    "geometry_msgs/msg/TransformStamped",
    "tf2_msgs/msg/TFMessage",
]


def record(file, messages, *, ros1=False):
    """A bag of messages [(topic, type, message, logged)]."""
    store = typestore(ros1)
    opening = Writer1(file) if ros1 else Writer(file, version=8, storage_plugin=StoragePlugin.MCAP)
    with opening as writer:
        known = {}
        for topic, kind, message, at in messages:
            if topic not in known:
                known[topic] = writer.add_connection(topic, kind, typestore=store)
            data = store.serialize_ros1(message, kind) if ros1 else store.serialize_cdr(message, kind)
            writer.write(known[topic], at, data)
    return file


def recording(file, kind, places, times, *, ros1=False, topic="/x", **fields):
    maker = bag_maker(ros1)
    stamps = [START + round(t * SECOND) for t in times]
    return record(
        file,
        [(topic, kind, sample(kind, p, s, maker, **fields), s) for p, s in zip(places, stamps, strict=True)],
        ros1=ros1,
    )


def speed_errors(trajectory, times, speeds):
    moving = speeds > 0.05
    return np.abs(trajectory.at(times).speeds - speeds)[moving] / speeds[moving]


@pytest.mark.parametrize("ros1", [False, True], ids=["ros2", "ros1"])
@pytest.mark.parametrize("kind", KINDS)
def test_recordings_become_paths(tmp_path, kind, ros1):
    if ros1 and kind.startswith("tf2"):
        pytest.skip("the message store of ROS 1 has no tf2_msgs to write with")
    times, speeds, places = drive()
    bag = recording(tmp_path / ("a.bag" if ros1 else "a"), kind, places, times, ros1=ros1)
    task = load_task(bag)
    path = task.trajectory
    assert (path.positions[[0, -1]] == places[[0, -1]]).all()
    assert np.median(speed_errors(path, times, speeds)) < 0.02
    assert 100 <= len(path) < 250
    dwell = (np.diff(path.arc_length) == 0).sum() * path.timestep
    assert dwell == pytest.approx(2.0, abs=0.15) and path.duration == pytest.approx(12.0, abs=0.3)
    assert any("smoothed a recording of 601 samples (noise 2.8 mm)" in note for note in task.notes), task.notes
    assert any("stands still" in note for note in task.notes)
    assert task.scene.extra["ros"]["frame_id"] == "map"


@pytest.mark.parametrize("noise", [0.0, 0.001, 0.005])
def test_speeds_of_noisy_recordings(noise):
    """The review found 9 % median and 75 % worst for the speeds between noisy poses at 50 Hz."""
    times, speeds, places = drive(noise=noise, seed=3)
    found = smoothed(times, places)
    assert found.noise == pytest.approx(noise, rel=0.1, abs=1e-5)
    assert np.median(speed_errors(found.trajectory, times, speeds)) < 0.02
    assert len(found.still) == 1


def test_a_noisy_path_is_a_recording_too(tmp_path):
    times, speeds, places = drive()
    maker = bag_maker()
    poses = [
        sample("geometry_msgs/msg/PoseStamped", p, START + round(t * SECOND), maker)
        for p, t in zip(places, times, strict=True)
    ]
    message = maker.new(TYPES["path"], header=maker.header("map", START), poses=poses)
    bag = record(tmp_path / "a", [("/plan", TYPES["path"], message, START)])
    task = load_task(bag)
    assert np.median(speed_errors(task.trajectory, times, speeds)) < 0.02
    raw = load_task(bag, Choices(raw=True)).trajectory
    assert len(raw) == len(places) and (raw.positions == places).all()


def test_raw_keeps_every_sample(tmp_path):
    times, _, places = drive(standing=())
    bag = recording(tmp_path / "a", KINDS[0], places, times)
    assert (load_task(bag, Choices(raw=True)).trajectory.positions == places).all()


def spoilt(tmp_path, change):
    """A task, or the error, of a recording of which `change` spoils messages and their stamps."""
    times, _, places = drive(seconds=4.0, standing=(), noise=0.001)
    maker = bag_maker()
    rows = []
    for i, (p, t) in enumerate(zip(places, times, strict=True)):
        fields = {"place": p, "nanoseconds": START + round(t * SECOND)} | change(i)
        rows.append(("/odom", KINDS[0], sample(KINDS[0], maker=maker, **fields), START + round(t * SECOND)))
    return load_task(record(tmp_path / "a", rows))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda i: {"place": (np.nan, 0, 0)} if i == 7 else {},
            "left out 1 of 201 samples, which hold numbers that are not finite; the first is sample 7",
        ),
        (
            lambda i: {"turn": (0, 0, 0, 0)} if i in (3, 4) else {},
            "left out 2 of 201 samples, which have a quaternion of length zero; the first is sample 3",
        ),
        (lambda i: {"turn": (0, 0, 0, 0)}, "every quaternion has length zero, so the orientations were left out"),
        (lambda i: {"nanoseconds": START + 5} if i == 9 else {}, "1 of 201 samples are stamped before"),
        (
            lambda i: {"nanoseconds": START} if i == 1 else {},
            "left out 1 of 201 samples, which repeat the stamp before them; the first is sample 1",
        ),
        (lambda i: {"nanoseconds": 0}, "the stamps are not set; the times of logging count"),
    ],
)
def test_bad_samples_are_named(tmp_path, change, said):
    task = spoilt(tmp_path, change)
    assert [note for note in task.notes if said in note]
    assert task.trajectory.duration == pytest.approx(4.0, abs=0.2)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda i: {"frame": "map" if i < 9 else "odom"}, r"header.frame_id changes in the recording \(map, odom\)"),
        (lambda i: {"child": f"robot{i % 2}"}, r"child_frame_id changes in the recording \(robot0, robot1\)"),
        (lambda i: {"place": (1.0, 2.0, 0.0)}, "stands still"),
        (lambda i: {"place": (np.nan,) * 3} if i else {}, "has 1 usable of 201 samples"),
        (lambda i: {"frame": "camera_optical_frame"}, "camera's optical frame"),
    ],
)
def test_useless_recordings_are_refused(tmp_path, change, said):
    with pytest.raises(FormatError, match=said) as caught:
        spoilt(tmp_path, change)
    assert "/odom" in str(caught.value)


def test_one_bad_number_in_a_path(tmp_path):
    """The review found a traceback."""
    maker = bag_maker()
    message, _ = build("path", Trajectory([[i, 0, 0] for i in range(60)], [1.0] * 60), maker, start=START)
    message.poses[3].pose.position.y = float("nan")
    bag = record(tmp_path / "a", [("/plan", TYPES["path"], message, START)])
    with pytest.raises(FormatError, match=r"poses\[3\].*y is nan, not a finite number"):
        load_task(bag)


def tf(maker, parent, child, place, at, turn=(1.0, 0.0, 0.0, 0.0)):
    return sample("tf2_msgs/msg/TFMessage", place, at, maker, frame=parent, child=child, turn=turn)


def test_frames_of_transforms(tmp_path):
    """The lidar sits 1 m ahead of the base, which drives along x of odom, which lies turned by a right angle in map."""
    maker, kind, half = bag_maker(), "tf2_msgs/msg/TFMessage", np.sqrt(0.5)
    rows = [("/tf_static", kind, tf(maker, "base_link", "lidar", (1, 0, 0), START), START)]
    for i in range(101):
        at = START + i * SECOND // 50
        rows.append(("/tf", kind, tf(maker, "map", "odom", (10, 0, 0), at, (half, 0, 0, half)), at))
        rows.append(("/tf", kind, tf(maker, "odom", "base_link", (0.01 * i, 0, 0), at), at))
        rows.append(("/tf", kind, tf(maker, "base_link", "wheel", (0, 0, 0.001 * (i % 7)), at), at))
    bag = record(tmp_path / "a", rows)
    with pytest.raises(FormatError, match=r"several frames move \(base_link:wheel, odom:base_link\); choose one"):
        load_task(bag)
    with pytest.raises(FormatError, match="'map:no' names no two frames of this recording"):
        load_task(bag, Choices(frames="map:no"))
    for frames, start, end in (
        ("odom:base_link", (0, 0, 0), (1, 0, 0)),
        ("map:base_link", (10, 0, 0), (10, 1, 0)),
        ("map:lidar", (10, 1, 0), (10, 2, 0)),
    ):
        path = load_task(bag, Choices(frames=frames)).trajectory
        np.testing.assert_allclose(path.positions[[0, -1]], [start, end], atol=1e-9)
        assert path.duration == pytest.approx(2.0, rel=0.02)


def test_a_plan_is_taken_before_a_recording(tmp_path):
    maker, (times, _, places) = bag_maker(), drive(standing=())
    plan, _ = build("path", Trajectory([[0, 0, 0], [1, 0, 0]], [1, 1]), maker, start=START)
    rows = [("/plan", TYPES["path"], plan, START)]
    rows += [
        ("/odom", KINDS[0], sample(KINDS[0], p, START + round(t * SECOND), maker), START)
        for p, t in zip(places, times, strict=True)
    ]
    bag = record(tmp_path / "a", rows)
    assert len(load_task(bag).trajectory) == 2
    assert len(load_task(bag, Choices(topic="/odom")).trajectory) > 50
    with pytest.raises(FormatError, match="/odom is a recording of 601 messages, read as one path"):
        load_task(bag, Choices(topic="/odom", message=3))


def test_joint_states(tmp_path):
    maker = bag_maker()
    rows = []
    for i in range(20):
        at = START + i * SECOND // 50
        rows.append(
            (
                "/joint_states",
                "sensor_msgs/msg/JointState",
                sample("sensor_msgs/msg/JointState", (0.1 * i, -0.1 * i), at, maker),
                at,
            )
        )
    bag = record(tmp_path / "a", rows)
    motion = load_joint_motion(bag)
    assert motion.names == ("a", "b") and motion.positions[:, 0] == pytest.approx(0.1 * np.arange(20))
    assert motion.times == pytest.approx(np.arange(20) / 50)
    with pytest.raises(FormatError, match=r"/joint_states holds joint positions \(a, b\), not a path"):
        load_task(bag)


def plans(maker, *motions):
    """MoveIt's DisplayTrajectory of several motions."""
    new, none = maker.new, []
    head = maker.header("world", START)
    empty = np.zeros(0)
    parts = [
        new(
            "moveit_msgs/msg/RobotTrajectory",
            joint_trajectory=build_joints(m, maker),
            multi_dof_joint_trajectory=new(TYPES["multidof"], header=head, joint_names=none, points=none),
        )
        for m in motions
    ]
    state = new(
        "moveit_msgs/msg/RobotState",
        joint_state=new(
            "sensor_msgs/msg/JointState", header=head, name=none, position=empty, velocity=empty, effort=empty
        ),
        multi_dof_joint_state=new(
            "sensor_msgs/msg/MultiDOFJointState",
            header=head,
            joint_names=none,
            transforms=none,
            twist=none,
            wrench=none,
        ),
        attached_collision_objects=none,
        is_diff=False,
    )
    return parts, new("moveit_msgs/msg/DisplayTrajectory", model_id="arm", trajectory=parts, trajectory_start=state)


def test_plans_of_moveit(tmp_path):
    first = JointMotion(("a", "b"), [[0, 0], [1, 2]], [0, 1])
    then = JointMotion(("b", "a"), [[2, 1], [3, 3]], [0, 2])
    parts, shown = plans(bag_maker(), first, then)
    one = record(tmp_path / "one", [("/p", "moveit_msgs/msg/RobotTrajectory", parts[0], START)])
    assert (load_joint_motion(one).positions == first.positions).all()
    two = record(tmp_path / "two", [("/p", "moveit_msgs/msg/DisplayTrajectory", shown, START)])
    joined = load_joint_motion(two)
    assert joined.positions.tolist() == [[0, 0], [1, 2], [3, 3]] and joined.times.tolist() == [0, 1, 3]
    with pytest.raises(FormatError, match=r"/p holds joint positions \(a, b\), not a path"):
        load_task(two)


def test_a_body_that_moveit_plans(tmp_path):
    maker = bag_maker()
    path = Trajectory([[0, 0, 0], [1, 0, 0], [2, 1, 0]], [0.5, 0.5, 0.5])
    body, _ = build("multidof", path, maker)
    nothing = maker.new("trajectory_msgs/msg/JointTrajectory", header=maker.header("map"), joint_names=[], points=[])
    message = maker.new("moveit_msgs/msg/RobotTrajectory", joint_trajectory=nothing, multi_dof_joint_trajectory=body)
    bag = record(tmp_path / "a", [("/p", "moveit_msgs/msg/RobotTrajectory", message, START)])
    assert (load_task(bag).trajectory.positions == path.positions).all()


def test_ros_1_bags_are_written(tmp_path):
    path = Trajectory([[0, 0, 0], [1, 0.5, 0], [2, 1, 0]], [0.25, 0.5, 0.125])
    for kind in TYPES:
        save_trajectory(tmp_path / "a.bag", path, choices=Choices(kind=kind), verdict="infeasible: x")
        task = load_task(tmp_path / "a.bag")
        back = task.trajectory
        assert back.positions[:, [0, 1]] == pytest.approx(
            np.column_stack([path.positions[:, 1], -path.positions[:, 0]])
        )
        assert task.verdict == "infeasible: x"
        with Reader1(tmp_path / "a.bag") as reader:
            assert all(at > START for _, at, _ in reader.messages())


@pytest.mark.parametrize("ending", ["mcap", "db3"])
def test_bags_are_stamped_with_the_time(tmp_path, ending):
    """The review found stamps of 0."""
    save_trajectory(tmp_path / f"a.{ending}", Trajectory([[0, 0, 0], [1, 0, 0]], [1, 1]))
    stamp = load_task(tmp_path / f"a.{ending}").scene.extra["ros"]["stamp"]
    assert stamp > START
    save_trajectory(tmp_path / f"b.{ending}", *(lambda t: (t.trajectory, t.scene))(load_task(tmp_path / f"a.{ending}")))
    assert load_task(tmp_path / f"b.{ending}").scene.extra["ros"]["stamp"] == stamp


@pytest.mark.parametrize("compression", [None, "zstd"])
def test_a_recording_that_was_cut_off(tmp_path, compression):
    times, _, places = drive(standing=())
    maker, store, kind = bag_maker(), typestore(), KINDS[0]
    writer = Writer(tmp_path / "a", version=8, storage_plugin=StoragePlugin.MCAP)
    if compression:
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        topic = writer.add_connection("/odom", kind, typestore=store)
        for p, t in zip(places, times, strict=True):
            at = START + round(t * SECOND)
            writer.write(topic, at, store.serialize_cdr(sample(kind, p, at, maker), kind))
    whole = next((tmp_path / "a").glob("*.mcap")).read_bytes()
    sizes = []
    for share in (0.4, 0.7, 0.9, 0.999):
        (tmp_path / "cut.mcap").write_bytes(whole[: int(len(whole) * share)])
        task = load_task(tmp_path / "cut.mcap", Choices(raw=True))
        assert "the recording was cut off" in task.notes[0]
        assert (task.trajectory.positions == places[: len(task.trajectory)]).all()
        sizes.append(len(task.trajectory))
    assert sizes == sorted(sizes) and 100 < sizes[0] < 595 <= sizes[-1]
    (tmp_path / "cut.mcap").write_bytes(whole[:60])
    with pytest.raises(FormatError, match=r"cut off|damaged"):
        load_task(tmp_path / "cut.mcap")


def test_a_bag_without_a_topic_may_have_been_cut_off(tmp_path):
    save_trajectory(tmp_path / "a.mcap", Trajectory([[0, 0, 0], [1, 0, 0]], [1, 1]))
    (tmp_path / "cut.mcap").write_bytes((tmp_path / "a.mcap").read_bytes()[:700])
    with pytest.raises(FormatError, match="holds no topics; it may have been cut off before its first message"):
        load_task(tmp_path / "cut.mcap")


def test_a_part_of_a_recording(tmp_path):
    """Seconds count from the first sample; what lies outside is neither smoothed nor kept."""
    times, speeds, places = drive()
    bag = recording(tmp_path / "a", KINDS[0], places, times)
    task = load_task(bag, Choices(span=(6.0, 11.0)))
    assert task.trajectory.duration == pytest.approx(5.0, abs=0.3)
    assert (task.trajectory.positions[[0, -1]] == places[[300, 550]]).all()
    assert np.median(speed_errors(task.trajectory, times[300:551] - 6.0, speeds[300:551])) < 0.02
    assert any("left out 350 of 601 samples, which lie outside the time" in note for note in task.notes)
    raw = load_task(bag, Choices(raw=True, span=(11.0, np.inf))).trajectory
    assert (raw.positions == places[550:]).all()
    with pytest.raises(FormatError, match=r"lasts 12.0 s and has 0 samples after 13 s"):
        load_task(bag, Choices(span=(13.0, np.inf)))


def test_a_part_of_joint_states(tmp_path):
    times, _, places = drive()
    bag = recording(tmp_path / "a", "sensor_msgs/msg/JointState", places, times)
    motion = load_joint_motion(bag, Choices(span=(2.0, 4.0)))
    assert (motion.positions == places[100:201, :2]).all() and motion.times[-1] == pytest.approx(2.0)


@pytest.mark.parametrize("ending", [".csv", ".tum", ".mcap"])
def test_a_part_of_a_path_with_times(tmp_path, ending):
    whole = Trajectory([[0, 0, 0], [1, 0, 0], [1, 0, 0], [2, 1, 0], [4, 1, 0]], [0.5, 0, 0, 0.5, 1.0], timestep=1.0)
    save_trajectory(tmp_path / f"a{ending}", whole)
    read = load_task(tmp_path / f"a{ending}").trajectory
    part = load_task(tmp_path / f"a{ending}", Choices(span=(1.0, 6.0))).trajectory
    moments = np.linspace(0, 5, 40)
    assert np.allclose(part.at(moments).positions, read.at(moments + 1.0).positions, atol=1e-6)
    assert part.duration == pytest.approx(5.0)


def test_a_mission_has_no_seconds(tmp_path):
    home = Choices(home=Home(47.4, 8.5, 400.0))
    save_trajectory(tmp_path / "a.plan", Trajectory([[0, 0, 5], [9, 0, 5]], [1, 1]), choices=home)
    with pytest.raises(FormatError, match="a mission records no times; leave --from and --to out"):
        load_task(tmp_path / "a.plan", Choices(span=(1.0, 2.0)))


def test_convert_takes_seconds(tmp_path):
    from click.testing import CliRunner

    from ovita.cli.main import cli

    save_trajectory(tmp_path / "a.csv", Trajectory([[0, 0, 0], [10, 0, 0]], [1, 1]))
    command = ["convert", str(tmp_path / "a.csv"), str(tmp_path / "b.csv"), "--from", "2", "--to"]
    done = CliRunner().invoke(cli, [*command, "6"])
    assert "2 waypoints, 4.000 m in 4.000 s" in done.output
    swapped = CliRunner().invoke(cli, [*command, "1"])
    assert "--from 2 --to 1: the first second must come before the last" in str(swapped.output) + str(swapped.exception)
