"""Bags with what a camera saw: written by rosbags, for tests."""

from __future__ import annotations

import io
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from ovita.paths.scene import quaternion
from ovita.perceive import View

ROS2, ROS1 = get_typestore(Stores.ROS2_HUMBLE), get_typestore(Stores.ROS1_NOETIC)
ROS1.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))
SECOND = 10**9
START = 1_700_000_000 * SECOND


class Camera:
    """Makes the messages of one store."""

    def __init__(self, store: Any = ROS2) -> None:
        self.store = store

    def new(self, name: str, /, **fields: Any) -> Any:
        return self.store.types[name](**fields)

    def header(self, frame: str, at: float) -> Any:
        sec, nanosec = divmod(START + round(at * SECOND), SECOND)
        stamp = self.new("builtin_interfaces/msg/Time", sec=sec, nanosec=nanosec)
        seq = {"seq": 0} if self.store is ROS1 else {}
        return self.new("std_msgs/msg/Header", stamp=stamp, frame_id=frame, **seq)

    def image(self, pixels: np.ndarray, encoding: str, frame="cam_optical", at=0.0, pad=0, big=False) -> Any:
        kind = pixels.dtype.newbyteorder(">" if big else "<")
        rows = np.ascontiguousarray(pixels.astype(kind)).view(np.uint8).reshape(len(pixels), -1)
        rows = np.pad(rows, ((0, 0), (0, pad)))
        size = {"height": pixels.shape[0], "width": pixels.shape[1], "step": rows.shape[1]}
        fields = {**size, "encoding": encoding, "is_bigendian": int(big), "data": rows.ravel()}
        return self.new("sensor_msgs/msg/Image", header=self.header(frame, at), **fields)

    def compressed(self, data: bytes, form: str, frame="cam_optical", at=0.0) -> Any:
        body = np.frombuffer(data, dtype=np.uint8)
        return self.new("sensor_msgs/msg/CompressedImage", header=self.header(frame, at), format=form, data=body)

    def info(
        self, intrinsics: np.ndarray, shape: tuple[int, int], frame="cam_optical", at=0.0, bend=0.0, p=None
    ) -> Any:
        p = intrinsics if p is None else p
        matrix = np.hstack([p, np.zeros((3, 1))]).ravel()
        names = "dkrp" if self.store is not ROS1 else "DKRP"
        values = np.full(5, bend), intrinsics.ravel().copy(), np.eye(3).ravel(), matrix
        region = self.new(
            "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
        )
        return self.new(
            "sensor_msgs/msg/CameraInfo", header=self.header(frame, at), height=shape[0], width=shape[1],
            distortion_model="plumb_bob", binning_x=0, binning_y=0, roi=region, **dict(zip(names, values, strict=True)),
        )  # fmt: skip

    def tf(self, *links: tuple[str, str, np.ndarray], at=0.0) -> Any:
        found = []
        for parent, child, pose in links:
            w, x, y, z = quaternion(pose[:3, :3])
            turn = self.new("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)
            shift = self.new("geometry_msgs/msg/Vector3", **dict(zip("xyz", map(float, pose[:3, 3]), strict=True)))
            moved = self.new("geometry_msgs/msg/Transform", translation=shift, rotation=turn)
            header = self.header(parent, at)
            stamped = "geometry_msgs/msg/TransformStamped"
            found.append(self.new(stamped, header=header, child_frame_id=child, transform=moved))
        return self.new("tf2_msgs/msg/TFMessage", transforms=found)

    def cloud(self, points: np.ndarray, colours: np.ndarray, frame="cam_optical", at=0.0) -> Any:
        kind = np.dtype(
            {"names": ["x", "y", "z", "rgb"], "formats": ["<f4"] * 4, "offsets": [0, 4, 8, 16], "itemsize": 20}
        )
        table = np.zeros(len(points), dtype=kind)
        for i, axis in enumerate("xyz"):
            table[axis] = points[:, i]
        words = (colours.astype(np.uint32) * np.uint32([1 << 16, 1 << 8, 1])).sum(axis=1).astype("<u4")
        table["rgb"] = words.view("<f4")
        field = "sensor_msgs/msg/PointField"
        fields = [self.new(field, name=n, offset=kind.fields[n][1], datatype=7, count=1) for n in kind.names]
        return self.new(
            "sensor_msgs/msg/PointCloud2", header=self.header(frame, at), height=1, width=len(points), fields=fields,
            is_bigendian=False, point_step=20, row_step=20 * len(points), is_dense=True,
            data=np.frombuffer(table.tobytes(), dtype=np.uint8),
        )  # fmt: skip


Said = tuple[str, float, Any]


def write(path: Path, said: Iterable[Said], store: Any = ROS2) -> Path:
    """Write (topic, seconds, message) into a bag: .bag, else a folder in MCAP or, for names with db3, sqlite3."""
    if store is ROS1:
        with Writer1(path) as bag:
            _fill(bag, said, store, store.serialize_ros1)
        return path
    plugin = StoragePlugin.SQLITE3 if "db3" in path.name else StoragePlugin.MCAP
    with Writer2(path, version=8, storage_plugin=plugin) as bag:
        _fill(bag, said, store, store.serialize_cdr)
    return path


def _fill(bag: Any, said: Iterable[Said], store: Any, serialize: Any) -> None:
    connections: dict[str, Any] = {}
    for topic, at, message in said:
        if topic not in connections:
            connections[topic] = bag.add_connection(topic, message.__msgtype__, typestore=store)
        bag.write(connections[topic], START + round(at * SECOND), serialize(message, message.__msgtype__))


def png(pixels: np.ndarray) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "PNG")
    return stream.getvalue()


def millimetres(view: View) -> np.ndarray:
    return np.nan_to_num(view.depth * 1000.0).round().astype(np.uint16)
