"""Point clouds from PLY, PCD and NPY files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ovita.errors import FormatError, OvitaError
from ovita.io.clouds import load_cloud

POINTS = np.array([[0.0, 1.0, 2.0], [0.5, -0.25, 0.125], [-1.5, 2.5, 0.75]])
COLOURS = np.array([[255, 0, 0], [0, 128, 0], [1, 2, 3]], dtype=np.uint8)
WORDS = (COLOURS.astype(np.uint32) * [1 << 16, 1 << 8, 1]).sum(axis=1).astype("<u4")


def ply(form: str, order: str = "<") -> bytes:
    header = f"ply\nformat {form} 1.0\ncomment by hand\nelement vertex 3\nproperty float x\nproperty double y\n"
    header += "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
    header += "element face 0\nproperty list uchar int vertex_indices\nend_header\n"
    if form == "ascii":
        rows = [" ".join(map(str, [*p, *c])) for p, c in zip(POINTS.tolist(), COLOURS.tolist(), strict=True)]
        return header.encode() + "\n".join(rows).encode() + b"\n"
    kind = np.dtype([(n, order + t) for n, t in zip("xyzrgb", ("f4", "f8", "f4", "u1", "u1", "u1"), strict=True)])
    return header.encode() + np.array([(*p, *c) for p, c in zip(POINTS, COLOURS, strict=True)], dtype=kind).tobytes()


def lzf(data: bytes) -> bytes:
    """Packed the way that LZF allows without any copy, but for the last part, which repeats what is before it."""
    return b"".join(bytes([len(data[i : i + 32]) - 1]) + data[i : i + 32] for i in range(0, len(data), 32))


def pcd(form: str, viewpoint: str = "0 0 0 1 0 0 0") -> bytes:
    header = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z _ rgb\nSIZE 4 4 4 1 4\nTYPE F F F U F\nCOUNT 1 1 1 4 1\n"
    header += f"WIDTH 3\nHEIGHT 1\nVIEWPOINT {viewpoint}\nPOINTS 3\nDATA {form}\n"
    packed = WORDS.view("<f4")
    if form == "ascii":
        rows = [f"{x} {y} {z} 0 0 0 0 {float(c)!r}" for (x, y, z), c in zip(POINTS.tolist(), packed, strict=True)]
        return (header + "\n".join(rows) + "\n").encode()
    kind = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("_", "u1", (4,)), ("rgb", "<f4")])
    rows = np.array([(*p, [0] * 4, c) for p, c in zip(POINTS, packed, strict=True)], dtype=kind)
    if form == "binary":
        return header.encode() + rows.tobytes()
    raw = b"".join(np.ascontiguousarray(rows[name]).tobytes() for name in kind.names)
    return header.encode() + np.array([len(lzf(raw)), len(raw)], dtype="<u4").tobytes() + lzf(raw)


FILES = {
    "a.ply": ply("ascii"),
    "b.ply": ply("binary_little_endian"),
    "c.ply": ply("binary_big_endian", ">"),
    "a.pcd": pcd("ascii"),
    "b.pcd": pcd("binary"),
    "c.pcd": pcd("binary_compressed"),
}


@pytest.mark.parametrize("name", FILES)
def test_points_and_colours(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(FILES[name])
    cloud = load_cloud(tmp_path / name)
    assert np.array_equal(cloud.points, POINTS) and cloud.notes == ()
    assert cloud.colours is not None and cloud.colours.tolist() == COLOURS.tolist()


@pytest.mark.parametrize("colours", [COLOURS.astype(float), COLOURS / 255.0], ids=["bytes", "fractions"])
def test_npy(tmp_path: Path, colours: np.ndarray) -> None:
    np.save(tmp_path / "a.npy", np.hstack([POINTS, colours]))
    cloud = load_cloud(tmp_path / "a.npy")
    assert np.array_equal(cloud.points, POINTS)
    assert cloud.colours is not None and cloud.colours.tolist() == COLOURS.tolist()


def test_points_that_are_not_finite_are_left_out(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.vstack([POINTS, [[np.nan, 0, 0], [0, np.inf, 0]]]))
    assert len(load_cloud(tmp_path / "a.npy")) == len(POINTS)


def test_copies_in_a_compressed_file(tmp_path: Path) -> None:
    header = b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 9\nHEIGHT 1\nPOINTS 9\nDATA binary_compressed\n"
    # Four bytes of the number 1, then 26 copies of them: 104 bytes, of which a long copy says 7 + 95 + 2.
    body = bytes([3]) + np.float32(1.0).tobytes() + bytes([7 << 5, 95, 3])
    (tmp_path / "a.pcd").write_bytes(header + np.array([len(body), 108], dtype="<u4").tobytes() + body)
    assert np.array_equal(load_cloud(tmp_path / "a.pcd").points, np.ones((9, 3)))


def test_a_viewpoint_is_said(tmp_path: Path) -> None:
    (tmp_path / "a.pcd").write_bytes(pcd("binary", "0 0 1 1 0 0 0"))
    cloud = load_cloud(tmp_path / "a.pcd")
    assert np.array_equal(cloud.points, POINTS) and "viewpoint 0 0 1" in cloud.notes[0]


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("a.xyz", b"0 0 0", "point clouds are read from .ply, .pcd, .npy"),
        ("a.ply", b"solid cube", "no PLY file"),
        ("a.ply", b"ply\nformat ascii 1.0\n", "header has no end"),
        ("a.ply", ply("ascii").replace(b"element vertex", b"element edge"), "first element must be vertex"),
        ("a.ply", ply("ascii").replace(b"property float z", b"property float w"), "lack z"),
        ("a.ply", ply("ascii").replace(b"property float z", b"property float x"), "same name"),
        ("a.ply", ply("ascii").replace(b"vertex 3", b"vertex 9"), "9 points are announced, and there are 3"),
        ("a.ply", ply("ascii").replace(b"vertex 3", b"vertex many"), "'many'"),
        ("a.ply", ply("binary_little_endian")[:-9], "is cut off"),
        ("a.ply", ply("ascii").replace(b"ascii", b"zipped"), "format 'zipped' is unknown"),
        ("a.pcd", pcd("binary").replace(b"DATA", b"Data"), "header has no end"),
        ("a.pcd", pcd("binary")[:-1], "is cut off"),
        ("a.pcd", pcd("binary_compressed")[:-1], "cut off"),
        ("a.pcd", pcd("ascii").replace(b"TYPE F F F U F", b"TYPE F F F"), "FIELDS, SIZE, TYPE and COUNT"),
        ("a.npy", b"nonsense", "no NPY file"),
    ],
)
def test_what_cannot_be_read_is_said(tmp_path: Path, name: str, content: bytes, says: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(FormatError) as error:
        load_cloud(tmp_path / name)
    assert says in str(error.value) and name in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize(("array", "says"), [(np.full((4, 3), np.nan), "no point"), (POINTS * 3000, "millimetres")])
def test_values_that_cannot_be(tmp_path: Path, array: np.ndarray, says: str) -> None:
    np.save(tmp_path / "a.npy", array)
    with pytest.raises(FormatError, match=says):
        load_cloud(tmp_path / "a.npy")


def test_a_pickle_is_not_opened(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.array([{"x": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(FormatError, match="no NPY file"):
        load_cloud(tmp_path / "a.npy")


@given(st.sampled_from(sorted(FILES)), st.data())
def test_damage_is_one_sentence_or_read(
    tmp_path_factory: pytest.TempPathFactory, name: str, data: st.DataObject
) -> None:
    content = bytearray(FILES[name])
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.mktemp("damaged") / name
    path.write_bytes(bytes(content[: data.draw(st.integers(1, len(content)))]))
    try:
        load_cloud(path)
    except OvitaError as error:
        assert "\n" not in str(error)
