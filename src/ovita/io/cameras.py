"""ROS messages of cameras: pictures, depth, clouds, camera models and transforms, as arrays.

They are read from any library that names their fields as ROS does. Depth is in metres with nan for none, transforms
are rigid (4, 4) matrices from child to parent.
"""

from __future__ import annotations

import io
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ovita.errors import FormatError, needs
from ovita.io.clouds import PointCloud, of_columns
from ovita.io.documents import brief, listing
from ovita.io.messages import stamp_ns
from ovita.paths.scene import matrix
from ovita.paths.trajectory import Array

IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
INFO, CLOUD = "sensor_msgs/msg/CameraInfo", "sensor_msgs/msg/PointCloud2"
TRANSFORMS = "tf2_msgs/msg/TFMessage"

MAX_EDGE = 16384
"""Longest edge of a picture that is decoded [pixels]."""

_DEPTHS = {"16UC1": ("u2", 1e-3), "mono16": ("u2", 1e-3), "32FC1": ("f4", 1.0), "64FC1": ("f8", 1.0)}
_CHANNELS = {
    "rgb8": (0, 1, 2), "bgr8": (2, 1, 0), "8UC3": (2, 1, 0), "rgba8": (0, 1, 2), "bgra8": (2, 1, 0), "8UC4": (2, 1, 0),
    "mono8": (0, 0, 0), "8UC1": (0, 0, 0),
}  # fmt: skip
_WIDTHS = {"rgba8": 4, "bgra8": 4, "8UC4": 4, "mono8": 1, "8UC1": 1}
_FIELDS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
_DEPTH_HEADER = 12

Colours = NDArray[np.uint8]


def holds_depth(message: Any) -> bool:
    """Whether an Image or CompressedImage holds distances rather than colours."""
    encoding = getattr(message, "encoding", None)
    return "compresseddepth" in str(message.format).lower() if encoding is None else encoding in _DEPTHS


def is_grey(message: Any) -> bool:
    """Whether an Image is grey, such as that of an infrared camera."""
    return getattr(message, "encoding", "") in ("mono8", "8UC1")


def depth_of(message: Any, where: str) -> Array:
    """Distances (H, W) [m] of an Image in 16UC1 (millimetres) or 32FC1 (metres), or of a compressedDepth message."""
    if not hasattr(message, "encoding"):
        return _compressed_depth(message, where)
    kind, scale = _DEPTHS.get(str(message.encoding), ("", 0.0))
    if not kind:
        raise FormatError(where, f"holds {brief(str(message.encoding))}, expected depth as 16UC1 or 32FC1")
    return _positive(_pixels(message, kind, 1, where)[..., 0] * scale)


def colours_of(message: Any, where: str) -> Colours:
    """Red, green, blue (H, W, 3) of an Image or a CompressedImage."""
    if not hasattr(message, "encoding"):
        image = decode_picture(bytes(message.data), where)
        return np.asarray(image.convert("RGB"), dtype=np.uint8)
    encoding = str(message.encoding)
    if encoding not in _CHANNELS:
        raise FormatError(where, f"holds {brief(encoding)}; colours are read from {listing(_CHANNELS)}")
    pixels = _pixels(message, "u1", _WIDTHS.get(encoding, 3), where)
    return np.ascontiguousarray(pixels[..., list(_CHANNELS[encoding])])


def _pixels(message: Any, kind: str, channels: int, where: str) -> NDArray[Any]:
    """The numbers of an Image (H, W, channels), without the padding of its rows."""
    height, width, step = int(message.height), int(message.width), int(message.step)
    order = ">" if message.is_bigendian else "<"
    row = width * channels * np.dtype(kind).itemsize
    data = np.frombuffer(bytes(message.data), dtype=np.uint8)
    if not (0 < height <= MAX_EDGE and 0 < width <= MAX_EDGE) or step < row or len(data) < step * height:
        raise FormatError(where, f"says {width}x{height} pixels, which its {len(data)} bytes do not hold")
    rows = np.ascontiguousarray(data[: step * height].reshape(height, step)[:, :row])
    return rows.view(order + kind).reshape(height, width, channels)


def _compressed_depth(message: Any, where: str) -> Array:
    """Depth in the transport compressedDepth: 12 bytes of parameters, then a PNG; 32-bit depth is stored inverted."""
    form, data = str(message.format), bytes(message.data)
    if "rvl" in form.lower():
        raise FormatError(where, "is compressed by RVL; record it as PNG, or the raw topic")
    if len(data) <= _DEPTH_HEADER:
        raise FormatError(where, "is cut off")
    raw = np.asarray(decode_picture(data[_DEPTH_HEADER:], where), dtype=np.float64)
    if raw.ndim != 2:
        raise FormatError(where, "holds colours where depth belongs")
    if "32FC1" in form:
        a, b = np.frombuffer(data[4:_DEPTH_HEADER], dtype="<f4").astype(float)
        return _positive(np.where(raw > 0, a / np.where(raw > b, raw - b, np.nan), np.nan))
    return _positive(raw * 1e-3)


def _positive(depth: Array) -> Array:
    return np.asarray(np.where(np.isfinite(depth) & (depth > 0.0), depth, np.nan), dtype=np.float64)


def decode_picture(data: bytes, where: str) -> Any:
    """The picture (a `PIL.Image.Image`) in the bytes of a PNG or JPEG file.

    Raises:
        FormatError: If it is none, is damaged, or is too large.
        MissingExtra: Without pillow.
    """
    with needs("pillow", "perceive"):
        from PIL import Image
    try:
        image = Image.open(io.BytesIO(data), formats=("PNG", "JPEG"))
        if max(image.size) > MAX_EDGE:
            raise FormatError(where, f"is {image.size[0]}x{image.size[1]} pixels, which is too large")
        image.load()
    except FormatError:
        raise
    except Exception as error:  # whatever a damaged picture makes the decoder raise, a person gets a sentence
        raise FormatError(where, f"is no PNG or JPEG picture ({type(error).__name__})") from None
    return image


def cloud_of(message: Any, where: str) -> PointCloud:
    """The points of a PointCloud2, in the frame of its header."""
    (width, *rows), step = map(int, (message.width, message.height, message.row_step)), int(message.point_step)
    count, data = width * rows[0], bytes(message.data)
    fields = {str(f.name): f for f in message.fields if int(f.datatype) in _FIELDS and int(f.count) in (0, 1)}
    order = ">" if message.is_bigendian else "<"
    kinds = [np.dtype(order + _FIELDS[int(f.datatype)]) for f in fields.values()]
    offsets = [int(f.offset) for f in fields.values()]
    ends = [at + kind.itemsize for at, kind in zip(offsets, kinds, strict=True)]
    if count <= 0 or max(ends, default=0) > step or rows[1] < width * step or len(data) < rows[0] * rows[1]:
        raise FormatError(where, f"says {count} points of {step} bytes, which its {len(data)} bytes do not hold")
    body = np.frombuffer(data, np.uint8, rows[0] * rows[1]).reshape(rows)[:, : width * step].tobytes()
    layout = {"names": list(fields), "formats": kinds, "offsets": offsets, "itemsize": step}
    table: Any = np.frombuffer(body, np.dtype(layout), count)  # type: ignore[call-overload]
    return of_columns({name: table[name] for name in fields}, where)


@dataclass(frozen=True, eq=False)
class CameraModel:
    """A CameraInfo: size [pixels], camera matrix (3, 3), and whether the lens still bends what it describes."""

    size: tuple[int, int]
    intrinsics: Array
    distorted: bool


def camera_of(message: Any, *, rectified: bool) -> CameraModel:
    """The camera matrix of a CameraInfo: that of the rectified picture, or of the raw one."""
    names = "kpd" if hasattr(message, "k") else "KPD"  # of ROS 2 and ROS 1
    raw, projected, lens = (np.array(getattr(message, name), dtype=float) for name in names)
    raw, projected = raw.reshape(3, 3), projected.reshape(3, 4)[:, :3]
    bends = bool(np.abs(lens).max(initial=0.0) > 1e-6)
    use = rectified and projected[0, 0] > 0
    return CameraModel((int(message.width), int(message.height)), projected if use else raw, bends and not rectified)


@dataclass(eq=False)
class Transforms:
    """A tree of frames, filled message by message; each edge is kept as it was nearest to the wanted time.

    Args:
        wanted: Time [ns]; None keeps the last.
    """

    wanted: int | None = None
    edges: dict[str, tuple[str, Array, int | None]] = field(default_factory=dict)

    def add(self, transforms: Iterable[Any], *, fixed: bool = False) -> None:
        """Take in a TFMessage's transforms; `fixed` for those of /tf_static, which hold for all time."""
        for one in transforms:
            child, parent = named(one.child_frame_id), named(one.header.frame_id)
            off = None if fixed else self._off(stamp_ns(one.header.stamp))
            before = self.edges.get(child)
            if before is None or off is None or (before[2] is not None and off <= before[2]):
                self.edges[child] = (parent, _matrix(one.transform), off)

    def _off(self, stamp: int) -> int:
        return 0 if self.wanted is None else abs(stamp - self.wanted)

    def root(self, frame: str) -> str:
        """The frame that all others hang on, seen from one of them."""
        frame, seen = named(frame), {frame}
        while frame in self.edges and self.edges[frame][0] not in seen:
            frame = self.edges[frame][0]
            seen.add(frame)
        return frame

    def between(self, source: str, target: str) -> tuple[Array, int] | None:
        """The pose (4, 4) of one frame in another, and how old it is at most [ns]; None where nothing connects them."""
        source, target = named(source), named(target)
        links: dict[str, list[tuple[str, Array, int]]] = {}
        for child, (parent, pose, off) in self.edges.items():
            links.setdefault(child, []).append((parent, pose, off or 0))
            links.setdefault(parent, []).append((child, np.asarray(np.linalg.inv(pose), dtype=float), off or 0))
        reached: dict[str, tuple[Array, int]] = {source: (np.eye(4), 0)}
        waiting = deque([source])
        while waiting:
            here = waiting.popleft()
            pose, oldest = reached[here]
            for there, step, off in links.get(here, ()):
                if there not in reached:
                    reached[there] = step @ pose, max(oldest, off)
                    waiting.append(there)
        return reached.get(target)

    @property
    def frames(self) -> tuple[str, ...]:
        """Every frame that is known."""
        return tuple(dict.fromkeys([*self.edges, *(parent for parent, _, _ in self.edges.values())]))


def named(frame_id: object) -> str:
    """A frame's name without the slash that ROS 1 puts before it."""
    return str(frame_id).lstrip("/")


def _matrix(transform: Any) -> Array:
    turn, shift = transform.rotation, transform.translation
    quaternion = np.array([turn.w, turn.x, turn.y, turn.z], dtype=float)
    norm = float(np.linalg.norm(quaternion))
    pose = np.eye(4)
    pose[:3, :3] = matrix(quaternion / norm if norm > 1e-9 else np.array([1.0, 0.0, 0.0, 0.0]))
    pose[:3, 3] = shift.x, shift.y, shift.z
    return pose
