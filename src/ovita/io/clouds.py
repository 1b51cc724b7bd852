"""Point clouds from files: PLY (ascii and binary), PCD (ascii, binary and binary_compressed) and NPY."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ovita.errors import FormatError, SceneError
from ovita.io.documents import listing
from ovita.io.files import errors_of, examine, file_name, suffix, system_errors
from ovita.paths.trajectory import Array

CLOUDS = (".ply", ".pcd", ".npy")
"""Endings of the files that point clouds are read from."""

LARGEST_SPREAD = 1000.0
"""A cloud whose middle half is spread wider is taken to be in millimetres [m]."""

_HEADER = 64 * 1024
_PLY_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_RGB = (("red", "green", "blue"), ("r", "g", "b"), ("diffuse_red", "diffuse_green", "diffuse_blue"))

Columns = Mapping[str, NDArray[Any]]


@dataclass(frozen=True, eq=False)
class PointCloud:
    """Points in space, perhaps with colours.

    Args:
        points: (N, 3) [m]; rows that are not finite are left out.
        colours: Red, green, blue (N, 3) as 8-bit numbers, or None.
        name: What to call it in messages.
        notes: What a person should know about how it was read.

    Raises:
        SceneError: On shapes that do not fit, no finite point, or points that seem to be in millimetres.
    """

    points: Array
    colours: NDArray[np.uint8] | None = None
    name: str = "the point cloud"
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        points = np.asarray(self.points, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3:
            raise SceneError(f"a cloud has shape {points.shape}; expected one row x, y, z for each point", key="points")
        kept = np.isfinite(points).all(axis=1)
        if not kept.any():
            raise SceneError("holds no point with finite coordinates", key="points")
        points = points[kept]
        low, high = np.quantile(points, (0.25, 0.75), axis=0)
        if (high - low).max() > LARGEST_SPREAD:
            raise SceneError("spans kilometres; if it is in millimetres, divide its coordinates by 1000", key="points")
        object.__setattr__(self, "points", points)
        if self.colours is not None:
            object.__setattr__(self, "colours", np.asarray(self.colours, dtype=np.uint8)[kept])

    def __len__(self) -> int:
        return len(self.points)

    def moved(self, pose: Array) -> PointCloud:
        """The cloud after a rigid transform (4, 4), such as that from a sensor's frame to the world."""
        return replace(self, points=self.points @ pose[:3, :3].T + pose[:3, 3])


def load_cloud(path: str | os.PathLike[str]) -> PointCloud:
    """Read a point cloud from a file; its ending says the format.

    Raises:
        FormatError: If it cannot be read or holds no points; names the file and what is wrong.
    """
    examine(path)
    file, ending = file_name(path), suffix(path)
    if ending not in CLOUDS:
        raise FormatError(file, f"point clouds are read from {', '.join(CLOUDS)} files")
    with system_errors(path, "read"):
        data = Path(path).read_bytes()
    with errors_of(path):
        read = {".ply": _ply, ".pcd": _pcd, ".npy": _npy}[ending](data, file)
        return replace(read, name=file)


def of_columns(columns: Columns, file: str, notes: tuple[str, ...] = ()) -> PointCloud:
    """The cloud in columns of numbers by name: x, y, z, and colours as red, green, blue or packed in rgb."""
    missing = [axis for axis in "xyz" if axis not in columns]
    if missing:
        raise FormatError(file, f"its points lack {listing(missing)}; they have {listing(columns)}")
    points = np.column_stack([np.asarray(columns[axis], dtype=np.float64) for axis in "xyz"])
    return PointCloud(points, _colours_of(columns), notes=notes)


def _colours_of(columns: Columns) -> NDArray[np.uint8] | None:
    for names in _RGB:
        if all(name in columns for name in names):
            return _bytes_of(np.column_stack([columns[name] for name in names]))
    packed = next((columns[name] for name in ("rgb", "rgba") if name in columns), None)
    if packed is None:
        return None
    # PCL packs 0x00RRGGBB, and often calls these four bytes a float.
    words = packed.astype("<f4").view("<u4") if packed.dtype.kind == "f" else packed.astype("<u4")
    return np.column_stack([words >> 16 & 255, words >> 8 & 255, words & 255]).astype(np.uint8)


def _bytes_of(colours: NDArray[Any]) -> NDArray[np.uint8]:
    """Colours as bytes: fractions of 1 where they are real numbers of at most 1."""
    fractions = colours.dtype.kind == "f" and (not colours.size or float(np.nanmax(colours)) <= 1.0)
    return np.nan_to_num(np.clip(colours * 255.0 if fractions else colours, 0, 255)).round().astype(np.uint8)


def _npy(data: bytes, file: str) -> PointCloud:
    try:
        array = np.load(io.BytesIO(data), allow_pickle=False)
    except (ValueError, OSError, EOFError):
        raise FormatError(file, "this is no NPY file of numbers, or it is cut off") from None
    shape, kind = getattr(array, "shape", "?"), getattr(array, "dtype", np.dtype("O")).kind
    if len(shape) != 2 or shape[1] not in (3, 6) or kind not in "fiu":
        raise FormatError(file, f"has shape {shape}; a cloud has rows x, y, z or x, y, z, red, green, blue")
    return PointCloud(array[:, :3], _bytes_of(array[:, 3:]) if array.shape[1] == 6 else None)


def _header(data: bytes, last: str, file: str, kind: str) -> tuple[list[list[str]], int]:
    """The words of each header line, up to the one that begins with `last`, and where the body begins."""
    lines: list[list[str]] = []
    stream = io.BytesIO(data)
    while stream.tell() < _HEADER and (line := stream.readline()).endswith(b"\n"):
        words = line.decode("ascii", "replace").split()
        if words and words[0] not in ("comment", "obj_info", "#"):
            lines.append(words)
            if words[0] == last:
                return lines, stream.tell()
    raise FormatError(file, f"this is no {kind} file: its header has no end ({last})")


def _table(body: bytes, kind: np.dtype[Any], count: int, file: str) -> Columns:
    if kind.itemsize * count > len(body):
        raise FormatError(file, f"is cut off: {count} points are announced, and there are {len(body) // kind.itemsize}")
    rows = np.frombuffer(body, dtype=kind, count=count)
    return {name: rows[name] for name in kind.names or ()}


def _text_table(body: bytes, names: Sequence[str], count: int, file: str) -> Columns:
    lines = [line for line in body.decode("ascii", "replace").split("\n") if line.strip()][:count]
    if len(lines) < max(count, 1):
        raise FormatError(file, f"is cut off: {count} points are announced, and there are {len(lines)}")
    try:
        rows = np.loadtxt(lines, dtype=np.float64, ndmin=2, comments=None)
    except ValueError as error:
        raise FormatError(file, f"holds a row that is not numbers ({' '.join(str(error).split())[:80]})") from None
    if rows.shape[1] < len(names):
        raise FormatError(file, f"has {rows.shape[1]} numbers a row, and its header names {len(names)}")
    return {name: rows[:, i] for i, name in enumerate(names)}


def _count(word: str, file: str) -> int:
    if not word.isdecimal():
        raise FormatError(file, f"its header says {word[:20]!r} where a number of points belongs")
    return int(word)


def _ply(data: bytes, file: str) -> PointCloud:
    if not data.startswith(b"ply"):
        raise FormatError(file, "this is no PLY file; those begin with the word ply")
    lines, start = _header(data, "end_header", file, "PLY")
    form = next((line[1] for line in lines if line[0] == "format" and len(line) > 1), "")
    count, properties = _vertices(lines, file)
    names = [line[2] for line in properties]
    if len(set(names)) < len(names):
        raise FormatError(file, "two properties of its points bear the same name")
    if form == "ascii":
        return of_columns(_text_table(data[start:], names, count, file), file)
    order = {"binary_little_endian": "<", "binary_big_endian": ">"}.get(form)
    if order is None:
        raise FormatError(file, f"the PLY format {form[:30]!r} is unknown; save it as ascii or binary_little_endian")
    kind = np.dtype([(line[2], order + _PLY_TYPES[line[1]]) for line in properties])
    return of_columns(_table(data[start:], kind, count, file), file)


def _vertices(lines: Sequence[list[str]], file: str) -> tuple[int, list[list[str]]]:
    """How many points a PLY header announces, and the lines of their properties."""
    first, until, *_ = [*(i for i, line in enumerate(lines) if line[0] == "element"), len(lines), len(lines)]
    vertex = lines[first] if first < len(lines) else []
    if vertex[1:2] != ["vertex"] or len(vertex) < 3:
        raise FormatError(file, "its first element must be vertex, with the number of points")
    properties = [line for line in lines[first:until] if line[0] == "property"]
    if any(len(line) != 3 or line[1] not in _PLY_TYPES for line in properties):
        raise FormatError(file, "a property of its points is a list or of an unknown type")
    return _count(vertex[2], file), properties


def _pcd(data: bytes, file: str) -> PointCloud:
    lines, start = _header(data, "DATA", file, "PCD")
    header = {line[0]: line[1:] for line in lines}
    body, form = data[start:], (header["DATA"] or [""])[0]
    kind, total = _fields(header, file), _count((header.get("POINTS") or [""])[0], file)
    notes = _viewpoint(header.get("VIEWPOINT", []))
    read = {"ascii": _ascii_fields, "binary": _table, "binary_compressed": _compressed}.get(form)
    if read is None:
        raise FormatError(file, f"the PCD format {form[:30]!r} is unknown; save it as binary")
    return of_columns(read(body, kind, total, file), file, notes)


def _fields(header: Mapping[str, list[str]], file: str) -> np.dtype[Any]:
    """The type of a row of a PCD file; its padding fields, all called "_", get names of their own."""
    names, sizes, types = (header.get(key, []) for key in ("FIELDS", "SIZE", "TYPE"))
    counts = [_count(word, file) for word in header.get("COUNT", ["1"] * len(names))]
    kinds = [f"<{kind.lower()}{size}" for kind, size in zip(types, sizes, strict=False)]
    if not names or not len(names) == len(counts) == len(kinds):
        raise FormatError(file, "its header must give FIELDS, SIZE, TYPE and COUNT, one entry for each field")
    unique = [name if name != "_" else f"_{i}" for i, name in enumerate(names)]
    try:
        return np.dtype([(n, k) if c == 1 else (n, k, (c,)) for n, k, c in zip(unique, kinds, counts, strict=True)])
    except (TypeError, ValueError):
        raise FormatError(file, f"a field has an unknown type; SIZE and TYPE are {' '.join(kinds)[:60]}") from None


def _ascii_fields(body: bytes, kind: np.dtype[Any], total: int, file: str) -> Columns:
    """Rows of a PCD file in text; what packs colours gets its own type back."""
    fields = [(name, kind[name]) for name in kind.names or ()]
    wide = [[n] if not f.shape else [f"{n}[{i}]" for i in range(f.shape[0])] for n, f in fields]
    columns = _text_table(body, [name for names in wide for name in names], total, file)
    packed = {n: columns[n].astype(f) for n, f in fields if n in ("rgb", "rgba") and n in columns}
    return {**columns, **packed}


def _viewpoint(words: Sequence[str]) -> tuple[str, ...]:
    """What to say of a viewpoint that is not the origin: the points are taken as they stand."""
    if not words or words == ["0", "0", "0", "1", "0", "0", "0"]:
        return ()
    return (f"the file gives the viewpoint {' '.join(words)[:80]}; its points are taken as they stand",)


def _compressed(body: bytes, kind: np.dtype[Any], count: int, file: str) -> Columns:
    """Columns that PCL compressed by LZF, one field after the other."""
    packed, unpacked = (int(size) for size in np.frombuffer(body[:8].ljust(8, b"\0"), dtype="<u4"))
    if unpacked != kind.itemsize * count or packed > len(body) - 8:
        raise FormatError(file, "its compressed part is cut off or of another size than its header says")
    raw = _unpacked(body[8 : 8 + packed], unpacked, file)
    columns, at = {}, 0
    for name in kind.names or ():
        end = at + kind[name].itemsize * count
        columns[name], at = np.frombuffer(raw[at:end], dtype=kind[name].base), end
    return columns


def _unpacked(packed: bytes, size: int, file: str) -> bytes:
    """LZF: runs of new bytes, and copies of what came before."""
    out, at = bytearray(), 0
    try:
        while at < len(packed):
            control = packed[at]
            at += 1
            if control < 32:
                out += packed[at : at + control + 1]
                at += control + 1
                continue
            length = control >> 5
            if length == 7:
                length += packed[at]
                at += 1
            source = len(out) - ((control & 31) << 8) - packed[at] - 1
            at += 1
            if source < 0 or len(out) > size:
                raise IndexError
            for _ in range(length + 2):
                out.append(out[source])
                source += 1
    except IndexError:
        out.clear()
    if len(out) != size:
        raise FormatError(file, "its compressed part is damaged")
    return bytes(out)
