"""ROS 2 bags (MCAP and sqlite3, files and folders) both ways, and ROS 1 bags read, through rosbags (extra `ros`)."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ovita.errors import FormatError, MissingExtra, OvitaError, RequestError
from ovita.io.documents import NONE, Choices, Kind, Task, listing
from ovita.io.files import BAGS, atomic_write, errors_of, file_name, is_bag, suffix
from ovita.io.geodesy import MISSION, ROS, on_earth
from ovita.io.messages import (
    BODY,
    FRAME_ID,
    JOINTS,
    TYPES,
    JointMotion,
    Maker,
    build,
    build_joints,
    frame_of,
    listed_names,
    parse,
    parse_joints,
)
from ovita.paths.frame import Frame, transformed
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory

TOPIC, JOINT_TOPIC = "/path", "/joint_trajectory"
"""Topics of paths and of joint motions where none is named."""

VERDICT_TOPIC, STRING = "/verdict", "std_msgs/msg/String"
"""Where a bag carries the verdict on its trajectory."""

_KINDS: Mapping[str, Kind] = {name: kind for kind, name in TYPES.items()}
_VERSION = 8
_STORAGE = {".mcap": "MCAP", ".db3": "SQLITE3"}


def load(path: str | os.PathLike[str], choices: Choices) -> Task:
    """Read the path that a message of a bag holds.

    Raises:
        FormatError: If there is no such message or it holds no usable path; names topic and pose.
        MissingExtra: If rosbags is not installed.
    """
    file = file_name(path)
    read = read_message(path, choices, list(_KINDS))
    topic, kind, message = read.topic, read.type, read.message
    if kind == JOINTS:
        joints = listing(map(str, message.joint_names))
        raise FormatError(
            file,
            f"{topic} holds joint positions ({joints}), not a path; to turn them into one takes the arm's kinematic "
            "model: ovita convert --arm NAME|FILE, or in Python load_joint_motion(...).through(forward)",
        )
    with errors_of(f"{file} {topic}"):
        task = task_of(_KINDS[kind], message, topic=topic)
    return replace(task, path=file, notes=read.notes + task.notes, verdict=read.verdict)


def task_of(kind: Kind, message: Any, *, topic: str) -> Task:
    """The task in a ROS message; its scene keeps topic, type and frame."""
    trajectory, frame_id, body, notes = parse(kind, message)
    frame = frame_of(frame_id)
    kept = {"topic": topic, "type": TYPES[kind], "frame_id": frame_id} | ({"body": body} if body else {})
    said = f"its waypoints are in the ROS frame {frame_id!r}, read as {frame.name} ({frame.describe()})"
    return Task(trajectory, Scene(frame=frame, extra={ROS: kept}), notes=(*notes, said), fixed_frame=True)


def topic_named(text: str) -> str:
    """A topic's name with its slash."""
    name = text if text.startswith("/") else f"/{text}"
    if not re.fullmatch(r"(/[A-Za-z_][A-Za-z0-9_]*)+", name):
        raise RequestError(f"{text!r} is no name for a topic; write letters, digits, _ and /, such as /plan")
    return name


def message_of(
    trajectory: Trajectory, scene: Scene, choices: Choices, maker: Maker, *, start: int = 0
) -> tuple[str, Kind, Any, tuple[str, ...]]:
    """Topic, kind and message for a trajectory, and notes on what is lost."""
    kept = scene.extra.get(ROS)
    kept = kept if isinstance(kept, Mapping) else {}
    topic = topic_named(choices.topic) if choices.topic else str(kept.get("topic") or TOPIC)
    topic = topic if topic.startswith("/") else f"/{topic}"
    kind: Kind = choices.kind or _KINDS.get(str(kept.get("type")), "path")
    frame_id = str(choices.frame_id or kept.get("frame_id") or FRAME_ID)
    moved, axes = _in_ros_axes(trajectory, scene, frame_id)
    body = str(kept.get("body") or BODY)
    # A controller begins at once where the stamp is 0, and may skip what lies before any other.
    begin = 0 if kind == "multidof" else start
    message, notes = build(kind, moved, maker, frame_id=frame_id, start=begin, body=body)
    said = f"written as {TYPES[kind]} on {topic} in the frame {frame_id!r}, {axes}"
    objects = ("a ROS message holds no objects and no instruction",) if len(scene) else ()
    return topic, kind, message, (said, *notes, *objects)


def dumps(
    path: str | os.PathLike[str], trajectory: Trajectory, scene: Scene, choices: Choices, verdict: str = ""
) -> tuple[bytes, tuple[str, ...]]:
    """The content of a bag with one message, by file extension, and notes on what is lost."""
    topic, kind, message, notes = message_of(trajectory, scene, choices, bag_maker())
    return bag_of(path, _with_verdict(LoggedMessage(topic, TYPES[kind], message), verdict)), notes


def save_folder(
    path: str | os.PathLike[str], trajectory: Trajectory, scene: Scene, choices: Choices, verdict: str = ""
) -> tuple[str, ...]:
    """Write a bag as a folder with metadata, as `ros2 bag record` does; return notes on what is lost."""
    file, target = file_name(path), Path(os.path.abspath(path))
    if target.exists():
        raise FormatError(file, "there is something of this name already; a bag's folder must be new")
    topic, kind, message, notes = message_of(trajectory, scene, choices, bag_maker())
    try:
        with tempfile.TemporaryDirectory(prefix=".ovita-", dir=target.parent) as folder:
            messages = _with_verdict(LoggedMessage(topic, TYPES[kind], message), verdict)
            os.rename(_written(Path(folder, target.name), file, messages), target)
    except OSError as error:
        raise FormatError(file, f"cannot be written: {(error.strerror or str(error)).lower()}") from None
    return notes


@dataclass(frozen=True)
class LoggedMessage:
    """A message to write to a bag: its topic and type, itself, and when it is logged [ns]."""

    topic: str
    type: str
    message: Any
    at: int = 0


def text_message(maker: Maker, topic: str, text: str, at: int = 0) -> LoggedMessage:
    """A std_msgs/String."""
    return LoggedMessage(topic, STRING, maker.new(STRING, data=text), at)


def bag_of(path: str | os.PathLike[str], messages: Sequence[LoggedMessage]) -> bytes:
    """The content of a bag file that holds some messages, by file extension."""
    file = file_name(path)
    if suffix(path) not in _STORAGE:
        raise FormatError(file, "bags are written as .mcap or .db3; ROS 1 bags are only read")
    with tempfile.TemporaryDirectory(prefix="ovita-") as folder:
        inside = _written(Path(folder, Path(path).name), file, messages)
        written = [entry for entry in os.listdir(inside) if entry.endswith(suffix(path))]
        return Path(inside, written[0]).read_bytes()


def _with_verdict(logged: LoggedMessage, verdict: str) -> list[LoggedMessage]:
    return [logged, text_message(bag_maker(), VERDICT_TOPIC, verdict)] if verdict else [logged]


def _written(folder: Path, file: str, messages: Sequence[LoggedMessage]) -> Path:
    """The folder after a bag was written into it: MCAP, or sqlite3 where its name ends in .db3."""
    rosbag2 = _import("rosbags.rosbag2")
    store = _typestore()
    plugin = getattr(rosbag2.StoragePlugin, _STORAGE.get(folder.suffix.lower(), "MCAP"))
    with _damage(file, "cannot be written"), rosbag2.Writer(folder, version=_VERSION, storage_plugin=plugin) as bag:
        topics: dict[str, Any] = {}
        for one in messages:
            if one.topic not in topics:
                topics[one.topic] = bag.add_connection(one.topic, one.type, typestore=store)
            bag.write(topics[one.topic], one.at, store.serialize_cdr(one.message, one.type))
    return folder


@dataclass(frozen=True)
class BagMessage:
    """A message of a bag: its topic and type, itself, what a person should know, and the verdict that comes with it."""

    topic: str
    type: str
    message: Any
    notes: tuple[str, ...] = ()
    verdict: str = ""


def read_message(path: str | os.PathLike[str], choices: Choices, names: Sequence[str]) -> BagMessage:
    """The chosen message of a bag file or folder.

    `names` are the types that fit; a JointTrajectory is found as well, or only that where there are none.
    """
    file = _checked(path)
    with opened(path) as bag:
        topic, name = _topic({c.topic: c.msgtype for c in bag.connections}, choices.topic, [*names, JOINTS], file)
        raw = _raw(bag, topic, name)
        message = bag.deserialize(raw[_index(bag, raw, topic, name, choices.message, file)], name)
        said = [bag.deserialize(data, STRING).data for data in _raw(bag, VERDICT_TOPIC, STRING)]
    several = choices.message is None and len(raw) > 1
    notes = (f"{topic} holds {len(raw)} messages; read the last (--message picks another)",) if several else ()
    return BagMessage(topic, name, message, notes, str(said[0]) if said else "")


@contextmanager
def opened(path: str | os.PathLike[str]) -> Iterator[Any]:
    """A bag file or folder, open for reading; whatever is wrong with it in the block becomes one sentence.

    Raises:
        FormatError: If it is no bag, or is damaged.
        MissingExtra: If rosbags is not installed.
    """
    file = _checked(path)
    anyreader = _import("rosbags.highlevel")
    with _damage(file), anyreader.AnyReader([Path(path)], default_typestore=_typestore()) as bag:
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


def _raw(bag: Any, topic: str, name: str) -> list[bytes]:
    connections = [c for c in bag.connections if c.topic == topic and c.msgtype == name]
    return [data for _, _, data in bag.messages(connections=connections)] if connections else []


def _index(bag: Any, raw: Sequence[bytes], topic: str, name: str, wanted: int | None, file: str) -> int:
    """Which of the messages on a topic is read."""
    if not raw:
        raise FormatError(file, f"there is no message on {topic}; the recording may have been cut off")
    chosen = -1 if wanted is None else wanted
    if not -len(raw) <= chosen < len(raw):
        raise FormatError(file, f"there is no message {chosen} on {topic}; it holds {len(raw)}, counted from 0")
    frames = {str(bag.deserialize(data, name).header.frame_id) for data in raw} if wanted is None else set()
    if len(frames) > 1:
        problem = f"the {len(raw)} messages on {topic} are in different frames ({listing(sorted(frames))})"
        raise FormatError(file, f"{problem}; choose one with --message")
    return chosen


def bag_maker() -> Maker:
    """How rosbags builds messages."""
    types = _typestore().types
    return Maker(lambda name, **fields: types[name](**fields), floats=np.ascontiguousarray)


def _topic(topics: Mapping[str, str], wanted: str | None, names: Sequence[str], file: str) -> tuple[str, str]:
    what = "a path" if len(names) > 1 else "positions of joints"
    fits = {topic: name for topic, name in topics.items() if name in names}
    fitting = listed_names(f"{topic} ({name})" for topic, name in fits.items())
    if wanted is not None:
        topic = wanted if wanted.startswith("/") or wanted in topics else f"/{wanted}"
        if topic in fits:
            return topic, fits[topic]
        is_not = f"is a {topics[topic]}, not {what}" if topic in topics else "is not in this bag"
        raise FormatError(file, f"{topic} {is_not}; topics with {what}: {fitting}")
    if len(fits) == 1:
        return next(iter(fits.items()))
    if fits:
        raise FormatError(file, f"there are several topics with {what}, choose one with --topic: {fitting}")
    there = listed_names(f"{topic} ({name})" for topic, name in topics.items())
    raise FormatError(file, f"no topic holds {what}; its topics are {there}")


def _in_ros_axes(trajectory: Trajectory, scene: Scene, frame_id: str) -> tuple[Trajectory, str]:
    """The trajectory in the axes of a ROS frame, and these in words."""
    target = frame_of(frame_id)
    if MISSION in scene.extra and target == Frame("flu"):
        return on_earth(trajectory, scene), "+x east, +y north, +z up (REP-103, about home)"
    return transformed(trajectory, scene.frame, target), target.describe()


def _typestore() -> Any:
    typesys = _import("rosbags.typesys")
    return typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)


def _import(name: str) -> Any:
    from importlib import import_module

    try:
        return import_module(name)
    except ImportError:
        raise MissingExtra("rosbags", "ros") from None


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


def save_joint_motion(path: str | os.PathLike[str], motion: JointMotion, choices: Choices = NONE) -> None:
    """Write a motion of joints as a bag with one JointTrajectory message.

    Raises:
        FormatError: If the bag cannot be written there.
        MissingExtra: If rosbags is not installed.
    """
    atomic_write(path, dumps_joints(path, motion, choices))


def dumps_joints(path: str | os.PathLike[str], motion: JointMotion, choices: Choices = NONE) -> bytes:
    """What `save_joint_motion` writes, by the ending of the file's name."""
    message = build_joints(motion, bag_maker(), frame_id=choices.frame_id or "")
    return bag_of(path, [LoggedMessage(topic_named(choices.topic or JOINT_TOPIC), JOINTS, message)])


def load_joint_motion(path: str | os.PathLike[str], choices: Choices = NONE) -> JointMotion:
    """Read a motion of joints from a bag.

    Raises:
        FormatError: If there is no JointTrajectory or it is malformed; names topic and point.
        MissingExtra: If rosbags is not installed.
    """
    read = read_message(path, choices, [])
    if read.type != JOINTS:
        raise FormatError(file_name(path), f"{read.topic} is a {read.type}, not a JointTrajectory")
    with errors_of(f"{file_name(path)} {read.topic}"):
        return parse_joints(read.message)
