"""Whatever the bytes are, nothing but an error of ovita comes out."""

import contextlib
import copy
import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ovita.errors import FormatError, OvitaError
from ovita.io import documents, files, json_, scene_from_dict, tables, trajectory_from_rows

VALID = {
    "trajectory": [[0.0, 0.0, 0.0, 0.5], [0.1, 0.0, 0.0, 0.5], [0.2, 0.0, 0.1, 0.0]],
    "instruction": "go left",
    "objects": [
        {"name": "mug", "x": 0.1, "y": 0.2, "z": 0.0, "dimensions": [0.1, 0.1, 0.1]},
        {"name": "can", "position": [1, 1, 1], "orientation": [1, 0, 0, 0]},
    ],
    "Env_descp": None,
    "constraints": "",
    "frame": "flu",
    "timestep": 0.1,
    "robot": "drone",
}
ADAPTATION = {
    "schema": json_.ADAPTATION_SCHEMA,
    "adapted": [{"x": 0, "y": 1, "z": 2, "t": 0}, {"x": 0, "y": 1, "z": 3, "t": 1}],
    "scene": {"objects": VALID["objects"]},
}
ROBOT = {"name": "r", "margin": 0.1, "max_speed": 1, "workspace": {"center": [0, 0, 0], "r_min": 0, "r_max": 1}}
CSV = b"x,y,z,t,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n1,0,0,1.5,1,0,0,0\n1,0,0,2,0,1,0,0\n1,2,0,3,0,1,0,0\n"

anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.integers(10**300, 10**310) | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=10,
)
fuzz = settings(derandomize=True, deadline=None, max_examples=40)


def parse_everything(data):
    for parse in (
        json_.parse,
        tables.parse_csv,
        lambda text, file: documents.robot_from_dict(json_.parse_object(text, file), file),
        lambda text, file: documents.robot_from_dict(documents.parse_toml(text, file), file),
    ):
        try:
            parse(files.decode(data, "f"), "f")
        except FormatError as error:
            assert str(error).startswith("f: ")
            assert len(str(error)) < 400
            assert "\n" not in str(error)
            str(error).encode("utf-8")


def places(value, path=()):
    yield path
    if isinstance(value, (dict, list)):
        for key in value if isinstance(value, dict) else range(len(value)):
            yield from places(value[key], (*path, key))


def replaced(document, path, value):
    if not path:
        return value
    document = copy.deepcopy(document)
    inner = document
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    return document


@fuzz
@given(st.binary(max_size=200) | st.text(max_size=200).map(lambda t: t.encode("utf-8", "surrogatepass")))
def test_any_bytes(data):
    parse_everything(data)


@fuzz
@given(anything)
def test_any_json(value):
    parse_everything(json.dumps(value).encode())
    parse_everything(json.dumps({"trajectory": value, "objects": value, "workspace": value}).encode())


@pytest.mark.parametrize("document", [VALID, ADAPTATION, ROBOT], ids=["task", "adaptation", "robot"])
@fuzz
@given(data=st.data())
def test_one_value_replaced(document, data):
    path = data.draw(st.sampled_from(list(places(document))))
    parse_everything(json.dumps(replaced(document, path, data.draw(anything))).encode())


@pytest.mark.parametrize(
    "content", [json.dumps(VALID).encode(), json.dumps(ADAPTATION).encode(), CSV], ids=["task", "adaptation", "csv"]
)
@fuzz
@given(data=st.data())
def test_some_bytes_replaced(content, data):
    start = data.draw(st.integers(0, len(content)))
    end = data.draw(st.integers(start, min(start + 20, len(content))))
    piece = data.draw(st.binary(max_size=5) | st.sampled_from([b"NaN", b"1e999", b"-1", b"[[", b"\x00", b"\xff", b'"']))
    parse_everything(content[:start] + piece + content[end:])


cells = st.sampled_from(["0", "1", "-1", "2.5", "1e9", "1e-300", "nan", "", "x", "1e400", "\u0663", '"'])


@fuzz
@given(st.permutations(["x", "y", "z", "t"]), st.lists(st.tuples(cells, cells, cells, cells), max_size=6))
def test_any_table(header, rows):
    parse_everything("\n".join(",".join(row) for row in [header, *rows]).encode())


@fuzz
@given(st.lists(st.tuples(*[st.floats(-1e9, 1e9)] * 3, st.floats(1e-3, 10)), min_size=1, max_size=8))
def test_any_motion_with_times(rows):
    time, lines = 0.0, ["x,y,z,t"]
    for x, y, z, dt in rows:
        time += dt
        lines.append(f"{x!r},{y!r},{z!r},{time!r}")
    with contextlib.suppress(FormatError):
        task = tables.parse_csv("\n".join(lines), "f")
        assert (task.trajectory.speeds >= 0).all()


@fuzz
@given(anything)
def test_the_pure_functions(value):
    with contextlib.suppress(OvitaError):
        trajectory_from_rows(value)
    with contextlib.suppress(OvitaError):
        scene_from_dict({"objects": value, "frame": value, "constraints": value})
