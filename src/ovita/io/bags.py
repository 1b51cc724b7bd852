"""ROS bags both ways, through rosbags (extra `ros`): MCAP and sqlite3 files and folders of ROS 2, `.bag` of ROS 1."""

from __future__ import annotations

import os
import re
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ovita.errors import FormatError, OvitaError, RequestError, TrajectoryError, needs
from ovita.io import messages as ros
from ovita.io.documents import NONE, Choices, Kind, Task, listing
from ovita.io.files import BAGS, atomic_write, errors_of, file_name, is_bag, suffix, system_errors
from ovita.io.geodesy import MISSION, ROS, on_earth
from ovita.io.recorded import JOINT_STATE, RECORDED, TRANSFORMS, StampedMessage, joints_of, looks_recorded, path_of
from ovita.io.waypoints import excerpt
from ovita.paths.scene import Frame, Scene, transformed
from ovita.paths.trajectory import Trajectory

TOPIC, JOINT_TOPIC = "/path", "/joint_trajectory"
"""Topics of paths and of joint motions where none is named."""

VERDICT_TOPIC, STRING = "/verdict", "std_msgs/msg/String"
"""Where a bag carries the verdict on its trajectory."""

ROBOT_PLAN, DISPLAYED_PLAN = "moveit_msgs/msg/RobotTrajectory", "moveit_msgs/msg/DisplayTrajectory"
"""What MoveIt plans, and what it publishes to be seen."""

JOINT_PLANS = (ros.JOINTS, ROBOT_PLAN, DISPLAYED_PLAN)
"""Messages that hold a motion of joints as a plan."""

_KINDS: Mapping[str, Kind] = {name: kind for kind, name in ros.TYPES.items()}
_PATHS = (
    (*ros.TYPES.values(), *JOINT_PLANS),
    tuple(n for n in RECORDED if n not in TRANSFORMS),
    TRANSFORMS,
    (JOINT_STATE,),
)
_JOINT_MOTIONS = (JOINT_PLANS, (JOINT_STATE,))
_VERSION = 8


def load(path: str | os.PathLike[str], choices: Choices) -> Task:
    """Read the path that a message of a bag holds.

    Raises:
        FormatError: If there is no such message or it holds no usable path; names topic and pose.
        MissingExtra: If rosbags is not installed.
    """
    file = file_name(path)
    read = read_topic(path, choices, _PATHS)
    topic, kind = read.topic, read.type
    with errors_of(f"{file} {topic}"):
        if kind in RECORDED:
            task = recorded_task(kind, read.samples, choices, topic=topic)
        else:
            message = read.samples[0].message
            if kind == DISPLAYED_PLAN and len(message.trajectory) == 1:
                kind, message = ROBOT_PLAN, message.trajectory[0]
            if kind == ROBOT_PLAN and not len(message.joint_trajectory.points):
                kind, message = ros.TYPES["multidof"], message.multi_dof_joint_trajectory
            if kind not in _KINDS:
                held = f"{topic} holds joint positions ({_joint_names(kind, message)}), not a path"
                raise FormatError(file, f"{held}; {_TAKES_A_MODEL}")
            task = task_of(_KINDS[kind], message, choices, topic=topic, at=read.samples[0].logged)
    return replace(task, path=file, notes=read.notes + task.notes, verdict=read.verdict)


_TAKES_A_MODEL = (
    "to turn them into one takes the arm's kinematic model: ovita convert --arm NAME|FILE, or in Python "
    "load_joint_motion(...).through(forward)"
)


def _joint_names(kind: str, message: Any) -> str:
    if kind == DISPLAYED_PLAN:
        message = next(iter(message.trajectory), None)
    message = getattr(message, "joint_trajectory", message)
    names = getattr(message, "joint_names", getattr(message, "name", ()))
    return listing(map(str, names))


def recorded_task(kind: str, samples: Sequence[StampedMessage], choices: Choices, *, topic: str) -> Task:
    """The task in a recording, all messages of a topic; its scene keeps topic, frame and time."""
    trajectory, frame_id, body, notes = path_of(kind, samples, choices)
    stamp = next(
        (ros.stamp_ns(s.message.header.stamp) for s in samples if hasattr(s.message, "header")), samples[0].logged
    )
    return _task(trajectory, "path", topic, frame_id, body, stamp, notes)


def task_of(kind: Kind, message: Any, choices: Choices = NONE, *, topic: str, at: int = 0) -> Task:
    """The task in a ROS message; its scene keeps topic, type, frame and time, by default `at` [ns].

    A Path whose poses were sampled at a rate and are noisy is a recording, and smoothed as one unless it is wanted raw.
    """
    stamp = ros.stamp_ns(message.header.stamp) or at
    if kind == "path" and not choices.raw:
        samples = [StampedMessage(stamp, pose) for pose in message.poses]
        places = [pose.pose.position for pose in message.poses]
        times = np.array([ros.stamp_ns(pose.header.stamp) for pose in message.poses]) / 1e9
        if looks_recorded(times, np.array([[p.x, p.y, p.z] for p in places])):
            trajectory, frame_id, body, notes = path_of("geometry_msgs/msg/PoseStamped", samples, choices)
            return _task(trajectory, kind, topic, str(message.header.frame_id) or frame_id, body, stamp, notes)
    trajectory, frame_id, body, notes = ros.parse(kind, message)
    return _task(excerpt(trajectory, choices), kind, topic, frame_id, body, stamp, notes)


def _task(
    trajectory: Trajectory, kind: Kind, topic: str, frame_id: str, body: str, stamp: int, notes: tuple[str, ...]
) -> Task:
    frame = ros.frame_of(frame_id)
    kept = {"topic": topic, "type": ros.TYPES[kind], "frame_id": frame_id} | ({"body": body} if body else {})
    said = f"its waypoints are in the ROS frame {frame_id!r}, read as {frame.name} ({frame.describe()})"
    extra = {ROS: kept | ({"stamp": stamp} if stamp else {})}
    return Task(trajectory, Scene(frame=frame, extra=extra), notes=(*notes, said), fixed_frame=True)


def topic_named(text: str) -> str:
    """A topic's name with its slash."""
    name = text if text.startswith("/") else f"/{text}"
    if not re.fullmatch(r"(/[A-Za-z_][A-Za-z0-9_]*)+", name):
        raise RequestError(f"{text!r} is no name for a topic; write letters, digits, _ and /, such as /plan")
    return name


def message_of(
    trajectory: Trajectory, scene: Scene, choices: Choices, maker: ros.Maker, *, start: int = 0
) -> tuple[str, Kind, Any, tuple[str, ...]]:
    """Topic, kind and message for a trajectory, and notes on what is lost."""
    kept = _kept(scene)
    topic = topic_named(choices.topic) if choices.topic else str(kept.get("topic") or TOPIC)
    topic = topic if topic.startswith("/") else f"/{topic}"
    kind: Kind = choices.kind or _KINDS.get(str(kept.get("type")), "path")
    frame_id = str(choices.frame_id or kept.get("frame_id") or ros.FRAME_ID)
    moved, axes = _in_ros_axes(trajectory, scene, frame_id)
    body = str(kept.get("body") or ros.BODY)
    # A controller begins at once where the stamp is 0, and may skip what lies before any other.
    begin = 0 if kind == "multidof" else start
    message, notes = ros.build(kind, moved, maker, frame_id=frame_id, start=begin, body=body)
    said = f"written as {ros.TYPES[kind]} on {topic} in the frame {frame_id!r}, {axes}"
    objects = ("a ROS message holds no objects and no instruction",) if len(scene) else ()
    return topic, kind, message, (said, *notes, *objects)


def _kept(scene: Scene) -> Mapping[str, Any]:
    """What a scene keeps of the ROS message that a trajectory came from."""
    kept = scene.extra.get(ROS)
    return kept if isinstance(kept, Mapping) else {}


def dumps(
    path: str | os.PathLike[str], trajectory: Trajectory, scene: Scene, choices: Choices, verdict: str = ""
) -> tuple[bytes, tuple[str, ...]]:
    """The content of a bag with one message, by file extension, and notes on what is lost."""
    messages, notes = _messages(path, trajectory, scene, choices, verdict)
    return bag_of(path, messages), notes


def _messages(
    path: str | os.PathLike[str], trajectory: Trajectory, scene: Scene, choices: Choices, verdict: str
) -> tuple[list[ros.TopicMessage], tuple[str, ...]]:
    """The messages of a bag, stamped as the one that the trajectory came from, else with the time of writing."""
    maker = bag_maker(ros1=suffix(path) == ".bag")
    at = _kept(scene).get("stamp")
    at = at if isinstance(at, int) and at > 0 else time.time_ns()
    topic, kind, message, notes = message_of(trajectory, scene, choices, maker, start=at)
    said = [text_message(maker, VERDICT_TOPIC, verdict, at)] if verdict else []
    return [ros.TopicMessage(topic, ros.TYPES[kind], message, at), *said], notes


def save_folder(
    path: str | os.PathLike[str], trajectory: Trajectory, scene: Scene, choices: Choices, verdict: str = ""
) -> tuple[str, ...]:
    """Write a bag as a folder with metadata, as `ros2 bag record` does; return notes on what is lost."""
    file, target = file_name(path), Path(os.path.abspath(path))
    if target.exists():
        raise FormatError(file, "there is something of this name already; a bag's folder must be new")
    messages, notes = _messages(os.fspath(path).rstrip("/" + os.sep), trajectory, scene, choices, verdict)
    with system_errors(path, "written"), tempfile.TemporaryDirectory(prefix=".ovita-", dir=target.parent) as folder:
        os.rename(_written(Path(folder, target.name), file, messages), target)
    return notes


def text_message(maker: ros.Maker, topic: str, text: str, at: int = 0) -> ros.TopicMessage:
    """A std_msgs/String."""
    return ros.TopicMessage(topic, STRING, maker.new(STRING, data=text), at)


def bag_of(path: str | os.PathLike[str], messages: Sequence[ros.TopicMessage]) -> bytes:
    """The content of a bag file that holds some messages, by file extension."""
    file = file_name(path)
    with tempfile.TemporaryDirectory(prefix="ovita-") as folder:
        inside = _written(Path(folder, Path(path).name), file, messages)
        written = [entry for entry in os.listdir(inside) if entry.endswith(suffix(path))] if inside.is_dir() else [""]
        return Path(inside, written[0]).read_bytes()


def _written(folder: Path, file: str, messages: Sequence[ros.TopicMessage]) -> Path:
    """The folder after a bag was written into it: MCAP, or sqlite3 where its name ends in .db3; or a ROS 1 bag file."""
    ending = folder.suffix.lower()
    store = ros.typestore(ending == ".bag")
    if ending == ".bag":
        opening, serialized = _import("rosbags.rosbag1").Writer(folder), store.serialize_ros1
    else:
        rosbag2, serialized = _import("rosbags.rosbag2"), store.serialize_cdr
        plugin = rosbag2.StoragePlugin.SQLITE3 if ending == ".db3" else rosbag2.StoragePlugin.MCAP
        opening = rosbag2.Writer(folder, version=_VERSION, storage_plugin=plugin)
    with _damage(file, "cannot be written"), opening as bag:
        topics: dict[str, Any] = {}
        for one in messages:
            if one.topic not in topics:
                topics[one.topic] = bag.add_connection(one.topic, one.type, typestore=store)
            bag.write(topics[one.topic], one.at, serialized(one.message, one.type))
    return folder


@dataclass(frozen=True)
class BagTopic:
    """What is read of a bag: one message, or all of a recording; notes for a person, and the verdict beside it."""

    topic: str
    type: str
    samples: tuple[StampedMessage, ...]
    notes: tuple[str, ...] = ()
    verdict: str = ""


def read_topic(path: str | os.PathLike[str], choices: Choices, tiers: Sequence[Sequence[str]]) -> BagTopic:
    """What a bag file or folder holds on the chosen topic, or on the only one of the first of these types that it has.

    Of a recording it is every message, else the chosen one.
    """
    file = _checked(path)
    with opened(path) as bag:
        types = {c.topic: c.msgtype for c in bag.connections}
        topic, name = _topic(types, choices.topic, tiers, file)
        raw, notes = _raw(bag, topic, name), bag.rescued
        if not raw:
            raise FormatError(file, f"there is no message on {topic}; the recording may have been cut off")
        if name in (*RECORDED, JOINT_STATE):
            if choices.message is not None:
                problem = f"{topic} is a recording of {len(raw)} messages, read as one path; leave --message out"
                raise FormatError(file, problem)
            raw = [*_of_fixed_frames(bag, topic, name), *raw]
        else:
            if choices.message is None and len(raw) > 1:
                notes += (f"{topic} holds {len(raw)} messages; read the last (--message picks another)",)
            raw = [raw[_index(bag, raw, topic, name, choices.message, file)]]
        samples = tuple(StampedMessage(at, bag.deserialize(data, name)) for at, data in raw)
        verdicts = [str(bag.deserialize(data, STRING).data) for _, data in _raw(bag, VERDICT_TOPIC, STRING)]
    return BagTopic(topic, name, samples, notes, next(iter(verdicts), ""))


def _of_fixed_frames(bag: Any, topic: str, name: str) -> list[tuple[int, bytes]]:
    """The transforms on /tf_static that go with those on a topic."""
    there = {c.topic for c in bag.connections if c.msgtype == name and name in TRANSFORMS} - {topic}
    return [pair for fixed in sorted(there) if fixed.endswith("tf_static") for pair in _raw(bag, fixed, name)]


@contextmanager
def opened(path: str | os.PathLike[str]) -> Iterator[Any]:
    """A bag file or folder, open for reading; whatever is wrong with it in the block becomes one sentence.

    Raises:
        FormatError: If it is no bag, or is damaged.
        MissingExtra: If rosbags is not installed.
    """
    file = _checked(path)
    anyreader = _import("rosbags.highlevel")
    with (
        _damage(file),
        rescued(path) as (whole, notes),
        anyreader.AnyReader([whole], default_typestore=ros.typestore()) as bag,
    ):
        bag.rescued = notes
        yield bag


def _checked(path: str | os.PathLike[str]) -> str:
    """The file's name for messages, once it is a bag."""
    file = file_name(path)
    if not os.path.exists(path):
        raise FormatError(file, "there is no such file")
    if not is_bag(path):
        raise FormatError(file, f"this is no bag; those end in {', '.join(BAGS)}, or are folders with metadata.yaml")
    if os.path.isdir(path) and suffix(path) == ".bag":
        raise FormatError(file, "this is a folder; name a ROS 1 bag file in it")
    return file


def _raw(bag: Any, topic: str, name: str) -> list[tuple[int, bytes]]:
    """The messages on a topic, and when they were logged [ns]."""
    connections = [c for c in bag.connections if c.topic == topic and c.msgtype == name]
    return [(at, data) for _, at, data in bag.messages(connections=connections)] if connections else []


def _index(bag: Any, raw: Sequence[tuple[int, bytes]], topic: str, name: str, wanted: int | None, file: str) -> int:
    """Which of the messages on a topic is read."""
    chosen = -1 if wanted is None else wanted
    if not -len(raw) <= chosen < len(raw):
        raise FormatError(file, f"there is no message {chosen} on {topic}; it holds {len(raw)}, counted from 0")
    plain = wanted is None and name not in (ROBOT_PLAN, DISPLAYED_PLAN)
    frames = {str(bag.deserialize(data, name).header.frame_id) for _, data in raw} if plain else set()
    if len(frames) > 1:
        problem = f"the {len(raw)} messages on {topic} are in different frames ({listing(sorted(frames))})"
        raise FormatError(file, f"{problem}; choose one with --message")
    return chosen


def bag_maker(ros1: bool = False) -> ros.Maker:
    """How rosbags builds messages, of ROS 2 or of ROS 1, whose headers are numbered."""
    types = ros.typestore(ros1).types

    def new(kind: str, /, **fields: Any) -> Any:
        return types[kind](**fields, **({"seq": 0} if ros1 and kind == "std_msgs/msg/Header" else {}))

    return ros.Maker(new, floats=np.ascontiguousarray)


def _topic(topics: Mapping[str, str], wanted: str | None, tiers: Sequence[Sequence[str]], file: str) -> tuple[str, str]:
    """The chosen topic with its type, or the only one of the first of these types that there is."""
    what = "positions of joints" if tiers is _JOINT_MOTIONS else "a path"
    if not topics:
        raise FormatError(file, "holds no topics; it may have been cut off before its first message")
    known = {topic: name for topic, name in topics.items() if any(name in names for names in tiers)}
    fits = {topic: name for topic, name in known.items() if not topic.endswith("tf_static")}
    if wanted is not None:
        topic = wanted if wanted.startswith("/") or wanted in topics else f"/{wanted}"
        if topic in known:
            return topic, known[topic]
        is_not = f"is a {topics[topic]}, not {what}" if topic in topics else "is not in this bag"
        raise FormatError(file, f"{topic} {is_not}; topics with {what}: {_listed(fits)}")
    return _first(fits, tiers, what, topics, file)


def _first(
    fits: Mapping[str, str], tiers: Sequence[Sequence[str]], what: str, topics: Mapping[str, str], file: str
) -> tuple[str, str]:
    """The only topic of the first of some types that there is."""
    of_tiers = ([pair for pair in fits.items() if pair[1] in names] for names in tiers)
    first = next(filter(None, of_tiers), [])
    if not first:
        raise FormatError(file, f"no topic holds {what}; its topics are {_listed(topics)}")
    if len(first) > 1:
        raise FormatError(file, f"there are several topics with {what}, choose one with --topic: {_listed(fits)}")
    return first[0]


def _listed(topics: Mapping[str, str]) -> str:
    return ros.listed_names(f"{topic} ({name})" for topic, name in topics.items())


def _in_ros_axes(trajectory: Trajectory, scene: Scene, frame_id: str) -> tuple[Trajectory, str]:
    """The trajectory in the axes of a ROS frame, and these in words."""
    target = ros.frame_of(frame_id)
    if MISSION in scene.extra and target == Frame("flu"):
        return on_earth(trajectory, scene), "+x east, +y north, +z up (REP-103, about home)"
    return transformed(trajectory, scene.frame, target), target.describe()


def _import(name: str) -> Any:
    with needs("rosbags", "ros"):
        return import_module(name)


@contextmanager
def _damage(file: str, what: str = "cannot be read as a bag; it may be cut off or damaged") -> Iterator[None]:
    """Turn any library error on a damaged bag into one sentence."""
    try:
        yield
    except OvitaError:
        raise
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise FormatError(file, f"{what} ({reason[:120]})") from None


# MCAP files whose recording was cut off (https://mcap.dev/spec)

_MAGIC = b"\x89MCAP0\r\n"
_END = b"\x0f" + (4).to_bytes(8, "little") + bytes(4) + b"\x02" + (20).to_bytes(8, "little") + bytes(20) + _MAGIC
_CHUNK, _DATA_END, _FOOTER = 0x06, 0x0F, 0x02


@contextmanager
def rescued(path: str | os.PathLike[str]) -> Iterator[tuple[Path, tuple[str, ...]]]:
    """The file itself; or where it is an MCAP that was cut off, a copy of its whole records, and a note on that."""
    whole = Path(path)
    inside = sorted(whole.glob("*.mcap")) if whole.is_dir() else [whole]
    file = inside[-1] if inside else whole
    if file.suffix.lower() != ".mcap" or not file.is_file() or _ended(file):
        yield whole, ()
        return
    data = file.read_bytes()
    end = _whole(data, len(_MAGIC))
    inner = _of_chunk(data[end:])
    if end <= len(_MAGIC) and not inner:
        yield whole, ()
        return
    note = f"the recording was cut off; what is whole in its {len(data)} bytes was read, and the rest is lost"
    with tempfile.TemporaryDirectory(prefix="ovita-") as folder:
        copy = Path(folder, "whole.mcap")
        copy.write_bytes(data[:end] + inner + _END)
        yield copy, (note,)


def _ended(file: Path) -> bool:
    size = file.stat().st_size
    with open(file, "rb") as stream:
        begins = stream.read(len(_MAGIC)) == _MAGIC
        stream.seek(max(size - len(_MAGIC), 0))
        return not begins or (size > len(_MAGIC) and stream.read() == _MAGIC)


def _whole(data: bytes, at: int) -> int:
    """Where the last whole record ends, of those before the summary."""
    while at + 9 <= len(data) and data[at] not in (_DATA_END, _FOOTER):
        after = at + 9 + int.from_bytes(data[at + 1 : at + 9], "little")
        if after > len(data):
            break
        at = after
    return at


def _of_chunk(data: bytes) -> bytes:
    """The whole records in the beginning of a chunk, b"" if there are none."""
    if len(data) < 49 or data[0] != _CHUNK:
        return b""
    named = 41 + int.from_bytes(data[37:41], "little")
    records = data[named + 8 :]
    if data[41:named] == b"zstd":
        zstandard = import_module("zstandard")
        try:
            records = zstandard.ZstdDecompressor().decompressobj().decompress(records)
        except zstandard.ZstdError:
            return b""
    elif named > 41:
        return b""
    return records[: _whole(records, 0)]


def save_joint_motion(path: str | os.PathLike[str], motion: ros.JointMotion, choices: Choices = NONE) -> None:
    """Write a motion of joints as a bag with one JointTrajectory message.

    Raises:
        FormatError: If the bag cannot be written there.
        MissingExtra: If rosbags is not installed.
    """
    atomic_write(path, dumps_joints(path, motion, choices))


def dumps_joints(path: str | os.PathLike[str], motion: ros.JointMotion, choices: Choices = NONE) -> bytes:
    """What `save_joint_motion` writes, by the ending of the file's name."""
    message = ros.build_joints(motion, bag_maker(ros1=suffix(path) == ".bag"), frame_id=choices.frame_id or "")
    return bag_of(
        path, [ros.TopicMessage(topic_named(choices.topic or JOINT_TOPIC), ros.JOINTS, message, time.time_ns())]
    )


def load_joint_motion(path: str | os.PathLike[str], choices: Choices = NONE) -> ros.JointMotion:
    """Read a motion of joints from a bag: a JointTrajectory, a plan of MoveIt, or a recording of JointState.

    Raises:
        FormatError: If there is none or it is malformed; names topic and point.
        MissingExtra: If rosbags is not installed.
    """
    read = read_topic(path, choices, _JOINT_MOTIONS)
    with errors_of(f"{file_name(path)} {read.topic}"):
        return motion_of(read.type, read.samples, choices)[0]


def motion_of(
    kind: str, samples: Sequence[StampedMessage], choices: Choices = NONE
) -> tuple[ros.JointMotion, tuple[str, ...]]:
    """The motion of joints in a message, or in a recording of JointState, and notes."""
    if kind == JOINT_STATE:
        return joints_of(samples, choices)
    if choices.span is not None:
        raise TrajectoryError("is a plan, not a recording; leave --from and --to out")
    message = samples[0].message
    if kind == ros.JOINTS:
        return ros.parse_joints(message), ()
    parts = [message] if kind == ROBOT_PLAN else list(message.trajectory)
    motions = [ros.parse_joints(part.joint_trajectory) for part in parts if len(part.joint_trajectory.points)]
    if not motions:
        raise TrajectoryError("holds no positions of joints", key="joint_trajectory")
    joined = motions[0]
    for motion in motions[1:]:
        joined = _followed(joined, motion)
    return joined, (f"a plan of {len(motions)} parts, one after the other",) if len(motions) > 1 else ()


def _followed(first: ros.JointMotion, then: ros.JointMotion) -> ros.JointMotion:
    if set(first.names) != set(then.names):
        problem = f"moves {listing(first.names)}, then {listing(then.names)}; send the parts one by one"
        raise TrajectoryError(problem, key="trajectory")
    order = [then.names.index(name) for name in first.names]
    positions, velocities = then.positions[:, order], None
    fresh = slice(1 if np.allclose(first.positions[-1], positions[0], atol=1e-9) else 0, None)
    gap = max(float(np.diff(first.times).min()), 1e-6) if fresh.start == 0 else 0.0
    times = np.concatenate([first.times, then.times[fresh] - then.times[0] + first.times[-1] + gap])
    if first.velocities is not None and then.velocities is not None:
        velocities = np.concatenate([first.velocities, then.velocities[fresh][:, order]])
    places = np.concatenate([first.positions, positions[fresh]])
    return ros.JointMotion(first.names, places, times, velocities, first.frame)
