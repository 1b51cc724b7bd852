"""Views and point clouds from ROS bags: the topics by their types, the camera's place from the transforms or a file."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal

import numpy as np

from ovita.errors import FormatError, LinkError
from ovita.io.bags import opened
from ovita.io.cameras import (
    CLOUD,
    COMPRESSED,
    IMAGE,
    INFO,
    TRANSFORMS,
    CameraModel,
    Colours,
    Transforms,
    camera_of,
    cloud_of,
    colours_of,
    depth_of,
    holds_depth,
    is_grey,
    named,
)
from ovita.io.clouds import PointCloud
from ovita.io.documents import listing, validated
from ovita.io.files import errors_of, file_name, read_text
from ovita.io.json_ import parse_object
from ovita.io.links import Address
from ovita.io.messages import TopicMessage, stamp_ns
from ovita.io.ros2 import capture
from ovita.paths.trajectory import Array
from ovita.perceive.view import View, landing

StreamKind = Literal["depth", "colour", "grey", "cloud", "info", "tf"]

TOGETHER = 100_000_000
"""A picture and a depth picture that are further apart in time are not of one moment [ns]."""

STALE = 50_000_000
"""A camera's place that is further off in time is said [ns]."""

_TRANSPORTS = ("/compressedDepth", "/compressed")


@dataclass(frozen=True, eq=False)
class Mount:
    """Where a camera is mounted: its pose (4, 4) in a frame of the recording, or in the world where `frame` is ""."""

    pose: Array
    frame: str = ""


@dataclass(frozen=True)
class RecordingChoices:
    """What a recording leaves open.

    Args:
        rgb: Topic of the picture; None takes the only one, or none.
        depth: Topic of the depth; None takes the only one.
        cloud: Topic of a point cloud, instead of depth.
        at: Times from the start of the recording, one view each [s]; () takes the last depth.
        camera_frame: The camera's optical frame; None takes that of the messages.
        world_frame: The frame of the scene; None takes the root of the transforms.
        mount: Where the camera is mounted, where the recording's transforms do not say it.
    """

    rgb: str | None = None
    depth: str | None = None
    cloud: str | None = None
    at: tuple[float, ...] = ()
    camera_frame: str | None = None
    world_frame: str | None = None
    mount: Mount | None = None

    @property
    def options(self) -> list[str]:
        """The options of the command line by which something was chosen."""
        made = [item.name for item in fields(self) if getattr(self, item.name) != item.default]
        return ["--pose" if name == "mount" else "--" + name.replace("_", "-") for name in made]


@dataclass(frozen=True, eq=False)
class Recorded:
    """What a recording shows: views, or clouds where it holds no depth pictures; and what a person should know."""

    views: tuple[View, ...] = ()
    clouds: tuple[PointCloud, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Topic:
    topic: str
    type: str
    kind: StreamKind
    connection: Any

    @property
    def base(self) -> str:
        """The topic without its image transport."""
        return _base(self.topic)


def _base(topic: str) -> str:
    return next((topic.removesuffix(end) for end in _TRANSPORTS if topic.endswith(end)), topic)


@dataclass
class _Reader:
    bag: Any
    file: str
    streams: Mapping[str, _Topic]
    notes: list[str] = field(default_factory=list)

    def nearest(self, stream: _Topic, at: int | None) -> Any:
        """The message of a stream that is nearest to a time on the recorder's clock [ns], or the last."""
        stamped = ((stamp, raw) for _, stamp, raw in self.bag.messages(connections=[stream.connection]))
        best = _nearest((0 if at is None else abs(stamp - at), raw) for stamp, raw in stamped)
        if best is None:
            raise FormatError(self.file, f"there is no message on {stream.topic}; the recording may have been cut off")
        return self.bag.deserialize(best[1], stream.type)

    def near_stamp(self, stream: _Topic, stamp: int) -> Any:
        """The message of a stream whose own time is nearest to another's [ns], or None if it is not of that moment."""
        messages = self._messages(stream)
        best = _nearest((abs(stamp_ns(message.header.stamp) - stamp), message) for message in messages)
        return None if best is None or best[0] > TOGETHER else best[1]

    def transforms(self, wanted: int) -> Transforms:
        """Every transform of the recording as it was at a time."""
        tree = Transforms(wanted)
        for stream in [one for one in self.streams.values() if one.kind == "tf"]:
            for message in self._messages(stream):
                tree.add(message.transforms, fixed=stream.topic.endswith("tf_static"))
        return tree

    def _messages(self, stream: _Topic) -> Iterator[Any]:
        raws = (raw for _, _, raw in self.bag.messages(connections=[stream.connection]))
        return (self.bag.deserialize(raw, stream.type) for raw in raws)


def _nearest(messages: Iterable[tuple[int, Any]]) -> tuple[int, Any] | None:
    """Of messages in the order of their times, each with how far off it is, the last before they get farther off."""
    best: tuple[int, Any] | None = None
    for off, message in messages:
        if best is not None and off > best[0]:
            break
        best = off, message
    return best


def read_recording(path: str | os.PathLike[str], choices: RecordingChoices | None = None) -> Recorded:
    """Read views from a ROS 1 or ROS 2 bag.

    Colours of another camera than the depth's are taken over point by point. Without depth pictures, a point cloud is
    read.

    Raises:
        FormatError: If a topic is missing, cannot be chosen or holds something else, or the camera has no place.
        MissingExtra: If rosbags or, for compressed pictures, pillow is not installed.
    """
    with opened(path) as bag:
        return _recorded(bag, file_name(path), choices or RecordingChoices())


def _recorded(bag: Any, file: str, choices: RecordingChoices) -> Recorded:
    kinds = [(one, _kind(bag, one)) for one in bag.connections]
    streams = {one.topic: _Topic(one.topic, one.msgtype, kind, one) for one, kind in kinds if kind is not None}
    reader = _Reader(bag, file, streams)
    depth = None if choices.cloud else _chosen(reader, ("depth",), choices.depth, "--depth")
    times, found = _times(bag, file, choices.at) or [None], Recorded()
    if depth is not None:
        colour = _chosen(reader, ("colour", "grey"), choices.rgb, "--rgb")
        found = Recorded(views=tuple(_view(reader, depth, colour, at, choices) for at in times))
    elif cloud := _chosen(reader, ("cloud",), choices.cloud, "--cloud"):
        found = Recorded(clouds=tuple(_cloud(reader, cloud, at, choices) for at in times))
    else:
        there = listing(sorted({c.topic for c in bag.connections}))
        raise FormatError(reader.file, f"no topic holds depth pictures or a point cloud; its topics are {there}")
    return replace(found, notes=tuple(dict.fromkeys(reader.notes)))


def _times(bag: Any, file: str, seconds: Sequence[float]) -> list[int | None]:
    """Times from the start of a recording on its recorder's clock [ns]."""
    lasts = (bag.end_time - bag.start_time) / 1e9 if seconds else 0.0
    for at in seconds:
        if not 0.0 <= at <= lasts:
            raise FormatError(file, f"lasts {lasts:.1f} s, so there is nothing --at {at:g}")
    return [int(bag.start_time + at * 1e9) for at in seconds]


def load_mount(path: str | os.PathLike[str]) -> Mount:
    """Read where a camera is mounted from a JSON file: "pose" (4, 4), and "frame" where it is not the world.

    Raises:
        FormatError: If the file cannot be read, or the pose is no rigid transform.
    """
    file = file_name(path)
    document = parse_object(read_text(path), file)
    rows = validated(list[list[float]], document.get("pose"), file, "pose")
    pose = np.array(rows, dtype=float) if {len(row) for row in rows} == {4} else np.zeros((1, 1))
    turn = pose[:3, :3]
    square = pose.shape == (4, 4) and np.allclose(pose[3], (0.0, 0.0, 0.0, 1.0))
    if not (square and np.allclose(turn @ turn.T, np.eye(3), atol=2e-3) and np.linalg.det(turn) > 0.0):
        raise FormatError(file, "must be a rigid transform of 4 rows of 4 numbers, camera to frame", key="pose")
    return Mount(pose, validated(str, document.get("frame", ""), file, "frame"))


@dataclass(frozen=True)
class _LiveConnection:
    topic: str
    msgtype: str


@dataclass(frozen=True, eq=False)
class _Capture:
    """Messages that came live, as an open bag shows them."""

    came: tuple[TopicMessage, ...]

    @property
    def connections(self) -> list[_LiveConnection]:
        return [_LiveConnection(*pair) for pair in dict.fromkeys((one.topic, one.type) for one in self.came)]

    def messages(self, connections: Sequence[_LiveConnection]) -> Iterable[tuple[_LiveConnection, int, Any]]:
        topics = {connection.topic: connection for connection in connections}
        return ((topics[one.topic], one.at, one.message) for one in self.came if one.topic in topics)

    def deserialize(self, message: Any, kind: str) -> Any:
        return message


def read_live(place: str, choices: RecordingChoices | None = None) -> Recorded:
    """Look through a camera on live ROS 2 topics, over DDS, without ROS.

    Args:
        place: Address of the topic with the depth or the point cloud, such as ros2:/camera/depth/image_rect_raw.
        choices: As for a recording; a picture is read where its topic is named.

    Raises:
        LinkError: If nobody publishes there, or no depth comes in time.
        FormatError: As `read_recording`.
        MissingExtra: If cyclonedds is not installed.
    """
    address, choices = Address.parse(place), choices or RecordingChoices()
    wanted = {address.target, *([choices.rgb] if choices.rgb else [])}
    homes = {_base(topic).rpartition("/")[0] for topic in wanted}

    def chosen(there: Mapping[str, str]) -> list[str]:
        infos = [topic for topic, kind in there.items() if kind == INFO and topic.rpartition("/")[0] in homes]
        return [*(wanted & set(there)), *infos, *(topic for topic, kind in there.items() if kind == TRANSFORMS)]

    def enough(came: Sequence[TopicMessage]) -> bool:
        topics = {one.topic for one in came}
        kinds = {one.type for one in came}
        camera = INFO in kinds or any(one.topic == address.target and one.type == CLOUD for one in came)
        return wanted <= topics and camera and (TRANSFORMS in kinds or choices.mount is not None)

    came = capture(address, chosen, enough)
    if all(one.topic != address.target for one in came):
        raise LinkError(f"{place}: the topic is there, but no message came within {address.timeout:g} s")
    cloud = any(one.topic == address.target and one.type == CLOUD for one in came)
    topics = (None, address.target) if cloud else (address.target, None)
    return _recorded(_Capture(came), place, replace(choices, at=(), depth=topics[0], cloud=topics[1]))


# Topics


def _kind(bag: Any, connection: Any) -> StreamKind | None:
    known: dict[str, StreamKind] = {INFO: "info", CLOUD: "cloud", TRANSFORMS: "tf", "tf/msg/tfMessage": "tf"}
    if connection.msgtype not in (IMAGE, COMPRESSED):
        return known.get(connection.msgtype)
    first = next((raw for _, _, raw in bag.messages(connections=[connection])), None)
    if first is None:
        return None
    message = bag.deserialize(first, connection.msgtype)
    return "depth" if holds_depth(message) else "grey" if is_grey(message) else "colour"


def _chosen(reader: _Reader, kinds: Sequence[StreamKind], wanted: str | None, option: str) -> _Topic | None:
    """The stream that a person names, or the only one of the first of these kinds that there is; None if none is."""
    if wanted is not None:
        return _named_topic(reader, kinds, wanted, option)
    for kind in kinds:
        alike = _streams_of(reader, kind)
        if len(alike) > 1:
            several = listing(stream.topic for stream in alike)
            raise FormatError(reader.file, f"there are several topics with {kind}, choose one with {option}: {several}")
        if alike:
            return alike[0]
    return None


def _named_topic(reader: _Reader, kinds: Sequence[StreamKind], wanted: str, option: str) -> _Topic:
    """The stream of one of these kinds that a person names."""
    topic = wanted if wanted.startswith("/") else f"/{wanted}"
    found = reader.streams.get(topic)
    if found is None or found.kind not in kinds:
        fits = listing(stream.topic for stream in reader.streams.values() if stream.kind in kinds)
        holds = "is not in this bag" if found is None else f"holds no {kinds[0]}"
        raise FormatError(reader.file, f"{topic} {holds}; {option} may be {fits}")
    return found


def _streams_of(reader: _Reader, kind: StreamKind) -> list[_Topic]:
    """The streams of a kind; the same pictures in two transports are one, the raw one, which needs no decoding."""
    fits = [stream for stream in reader.streams.values() if stream.kind == kind]
    return list({stream.base: stream for stream in sorted(fits, key=lambda one: -len(one.topic))}.values())


def _camera(reader: _Reader, stream: _Topic, size: tuple[int, int]) -> CameraModel:
    """The camera model that goes with a stream of pictures: that beside it, or the only one of its size."""
    infos = [info for info in reader.streams.values() if info.kind == "info"]
    fits = [model for model in _models(reader, stream, infos) if model.size == size]
    if not fits or any(not np.array_equal(fits[0].intrinsics, model.intrinsics) for model in fits):
        wide, high = size
        there = f"those there are {listing(info.topic for info in infos)}" if infos else "there is no CameraInfo at all"
        raise FormatError(reader.file, f"no CameraInfo beside {stream.topic} is of {wide}x{high} pixels; {there}")
    if fits[0].distorted:
        reader.notes.append(f"{stream.topic} is not rectified; the bend of the lens is not taken out of it")
    return fits[0]


def _models(reader: _Reader, stream: _Topic, infos: Sequence[_Topic]) -> list[CameraModel]:
    home = stream.base.rpartition("/")[0]
    beside = [info for info in infos if info.topic.rpartition("/")[0] == home]
    return [camera_of(reader.nearest(info, None), rectified="rect" in stream.base) for info in beside or infos]


# Views


def _view(reader: _Reader, depth: _Topic, colour: _Topic | None, at: int | None, choices: RecordingChoices) -> View:
    message = reader.nearest(depth, at)
    where = f"{reader.file} {depth.topic}"
    distances = depth_of(message, where)
    size = distances.shape[1], distances.shape[0]
    model, stamp = _camera(reader, depth, size), stamp_ns(message.header.stamp)
    tree = reader.transforms(stamp)
    own = named(choices.camera_frame or message.header.frame_id)
    pose = _pose(reader, tree, own, choices)
    rgb = None if colour is None else _colours(reader, colour, (distances, model, own, stamp), tree)
    with errors_of(where):
        return View(distances, model.intrinsics, pose, rgb, name=where)


def _pose(reader: _Reader, tree: Transforms, camera: str, choices: RecordingChoices) -> Array:
    """The camera's pose in the world, from its mount and the transforms."""
    mount = choices.mount
    if mount is None:
        if "optical" not in camera:
            reader.notes.append(f"the frame {camera!r} is taken to be optical: x right, y down, z forward")
        return _frame_pose(reader, tree, camera, choices, fixed=False)
    if not mount.frame:
        return mount.pose
    return np.asarray(_frame_pose(reader, tree, named(mount.frame), choices, fixed=True) @ mount.pose)


def _frame_pose(reader: _Reader, tree: Transforms, start: str, choices: RecordingChoices, *, fixed: bool) -> Array:
    """The pose of a frame in the world; one of a camera that nothing is `fixed` to is not the world itself."""
    world = named(choices.world_frame) if choices.world_frame else tree.root(start)
    found = tree.between(start, world) if start in tree.frames or start == world else None
    if found is None or (not fixed and world == start):
        there = f"the frames are {listing(tree.frames)}" if tree.frames else "it holds no transforms"
        remedy = "name --camera-frame and --world-frame, or give the camera's pose with --pose FILE"
        raise FormatError(reader.file, f"nothing says where {start!r} is in the world ({there}); {remedy}")
    pose, off = found
    if off > STALE:
        reader.notes.append(f"the place of {start!r} is known {off * 1e-9:.2g} s off the picture only")
    reader.notes.append(f"the scene is in the frame {world!r} of the recording")
    return pose


def _colours(
    reader: _Reader, colour: _Topic, seen: tuple[Array, CameraModel, str, int], tree: Transforms
) -> Colours | None:
    """The colours of the depth's pixels, or None where they cannot be had, which is noted."""
    distances, model, own, stamp = seen
    message = reader.near_stamp(colour, stamp)
    if message is None:
        reader.notes.append(f"no picture on {colour.topic} is of the moment of the depth; colours are left out")
        return None
    picture = colours_of(message, f"{reader.file} {colour.topic}")
    theirs, size = named(message.header.frame_id), (picture.shape[1], picture.shape[0])
    if picture.shape[:2] == distances.shape and theirs == own:
        return picture
    link, alike = tree.between(own, theirs), picture.shape[:2] == distances.shape
    if link is None:
        registered, differ = (
            "; picture and depth are taken to be registered",
            ", and their sizes differ; colours are left out",
        )
        reader.notes.append(f"nothing connects {theirs!r} and {own!r}{registered if alike else differ}")
        return picture if alike else None
    reader.notes.append(f"the colours of {colour.topic} were carried over to the depth camera's pixels")
    return carried_over(picture, _camera(reader, colour, size), distances, model, link[0])


def carried_over(picture: Colours, theirs: CameraModel, depth: Array, own: CameraModel, link: Array) -> Colours:
    """Colours (H, W, 3) for each pixel of a depth picture (H, W) [m], from a picture of another camera.

    `link` is the pose (4, 4) of the depth camera in the other one's frame.
    """
    high, wide = np.indices(depth.shape, dtype=float)
    rays = np.stack([wide, high, np.ones(depth.shape)], axis=-1) @ np.linalg.inv(own.intrinsics).T
    points = (rays * depth[..., None]) @ link[:3, :3].T + link[:3, 3]
    ahead = np.where(points[..., 2] > 1e-6, points[..., 2], np.nan)
    pixels = (points @ theirs.intrinsics.T)[..., :2] / ahead[..., None]
    inside, rows, columns = landing(pixels, theirs.size[::-1])
    return np.where(inside[..., None], picture[rows, columns], 0).astype(np.uint8)


def _cloud(reader: _Reader, stream: _Topic, at: int | None, choices: RecordingChoices) -> PointCloud:
    message = reader.nearest(stream, at)
    where = f"{reader.file} {stream.topic}"
    with errors_of(where):
        cloud = cloud_of(message, where)
    tree = reader.transforms(stamp_ns(message.header.stamp))
    own = named(choices.camera_frame or message.header.frame_id)
    if not tree.frames and choices.mount is None:
        reader.notes.append(f"the recording holds no transforms; the scene is in the cloud's own frame {own!r}")
        return cloud
    return replace(cloud.moved(_pose(reader, tree, own, choices)), name=where)
