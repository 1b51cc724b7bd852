import json
import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ovita.errors import FormatError, SceneError, TrajectoryError
from ovita.io import (
    Task,
    json_,
    load_task,
    save_task,
    save_trajectory,
    scene_dict,
    scene_from_dict,
    trajectory_from_rows,
    trajectory_rows,
)
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Trajectory

ROWS = [[0, 0, 0, 0.5], [1.5, 0, 0, 0.25]]


def parse(document):
    return json_.parse(document if isinstance(document, str) else json.dumps(document), "f.json")


def with_object(**keys):
    return {"trajectory": ROWS, "objects": [{"name": "mug", "x": 1, "y": 2, "z": 3}, keys]}


def rows(*some):
    return {"trajectory": list(some)}


BAD = {
    "not JSON": ("hello", "f.json: this is not JSON", "line 1, column 1"),
    "cut off": ('{"trajectory": [\n[1, 2', "not JSON", "line 2, column 6"),
    "two documents": ("{} {}", "not JSON", "extra data"),
    "a list": ([[0, 0, 0, 1]], "top level is a list of 1, expected an object"),
    "a number": ("3", "top level is 3"),
    "null": ("null", "top level is null"),
    "no trajectory": ({"path": [], "objects": []}, "no key 'trajectory', only path, objects", "rows"),
    "nothing at all": ({}, "the object is empty; give a list of rows"),
    "misspelt": ({"Trajectroy": ROWS}, "rename 'Trajectroy' to 'trajectory'"),
    "null trajectory": ({"trajectory": None}, "the trajectory is null"),
    "a text": ({"trajectory": "x"}, "f.json: trajectory is 'x', expected a list of rows"),
    "columns": ({"trajectory": {"x": [1]}}, "trajectory is an object, expected a list of rows"),
    "empty": (rows(), "trajectory is empty"),
    "one waypoint": (rows([0, 0, 0, 1]), "trajectory has 1 waypoint; a trajectory needs at least 2"),
    "flat": (rows(0, 0, 0, 1), "trajectory[0] is 0, expected a row"),
    "flat later": (rows([0, 0, 0, 1], 5), "trajectory[1] is 5, expected a row of 4 numbers"),
    "two columns": (rows([0, 0], [1, 1]), "trajectory[0] holds 2 numbers, expected 3 (x, y, z)"),
    "no columns": (rows([], []), "trajectory[0] holds 0 numbers"),
    "ragged": (rows([0, 0, 0, 1], [0, 0, 0, 1], [0, 0]), "trajectory[2] holds 2 numbers where the first row holds 4"),
    "text in a row": (rows([0, 0, 0, 1], [0, "a", 0, 1]), "trajectory[1] y is 'a', not a number"),
    "null in a row": (rows([0, 0, 0, 1], [0, 0, None, 1]), "trajectory[1] z is null, not a number"),
    "list in a row": (rows([0, 0, 0, 1], [0, 0, [1], 1]), "trajectory[1] z is a list of 1, not a number"),
    "boolean in a row": (rows([0, 0, 0, 1], [0, 0, 0, True]), "trajectory[1] speed is true, not a number"),
    "NaN": (rows([0, 0, 0, 1], [float("nan"), 0, 0, 1]), "trajectory[1] x is nan, not a finite number"),
    "infinity": (rows([0, 0, 0, 1], [0, 0, 0, float("inf")]), "trajectory[1] speed is inf, not a finite number"),
    "overflow": ('{"trajectory": [[0, 0, 0, 1], [0, 1e999, 0, 1]]}', "trajectory[1] y is inf"),
    "huge float": (rows([0, 0, 0, 1], [0, 1e300, 0, 1]), "trajectory[1] y is 1e+300, beyond the largest magnitude"),
    "huge integer": (rows([0, 0, 0, 1], [10**400, 0, 0, 1]), "trajectory[1] x is a huge integer, beyond"),
    "endless integer": ('{"trajectory": ' + "9" * 5000 + "}", "thousands of digits"),
    "negative speed": (rows([0, 0, 0, 1], [1, 0, 0, -0.5]), "trajectory[1] speed -0.5 is negative"),
    "zero quaternion": (rows([0] * 8, [1] * 8), "trajectory[0] the quaternion (wxyz) has length zero"),
    "dict without z": (rows({"x": 0, "y": 0}, {"x": 1, "y": 0}), "trajectory has no z, only x, y"),
    "dict lacks": (rows({"x": 0, "y": 0, "z": 0}, {"x": 1, "y": 0}), "trajectory[1] lacks z, unlike the first"),
    "dict has more": (rows({"x": 0, "y": 0, "z": 0}, {"x": 1, "y": 0, "z": 0, "v": 1}), "trajectory[1] has v"),
    "dict then list": (rows({"x": 0, "y": 0, "z": 0}, [1, 0, 0]), "trajectory[1] is a list of 3"),
    "speed twice": (rows({"x": 0, "y": 0, "z": 0, "v": 1, "speed": 1}), "trajectory[0] gives speed twice"),
    "half a quaternion": (
        rows(*[{"x": i, "y": 0, "z": 0, "qw": 1} for i in (0, 1)]),
        "trajectory has only qw of the quaternion",
    ),
    "time stands still": (
        rows(*[{"x": i, "y": 0, "z": 0, "t": 1} for i in (0, 1)]),
        "trajectory[1] is at 1 s, not after the 1 s before",
    ),
    "instruction": ({"trajectory": ROWS, "instruction": ["go"]}, "instruction is a list of 1, expected text"),
    "timestep": ({"trajectory": ROWS, "timestep": 0}, "timestep is 0, expected a time > 0"),
    "timestep text": ({"trajectory": ROWS, "timestep": "fast"}, "timestep is 'fast'"),
    "environment": ({"trajectory": ROWS, "Env_descp": 5}, "Env_descp is 5, expected text"),
    "two environments": ({"trajectory": ROWS, "Env_descp": "a", "environment": "b"}, "differs from environment"),
    "constraints": ({"trajectory": ROWS, "constraints": 5}, "constraints is 5, expected text"),
    "unknown frame": (
        {"trajectory": ROWS, "frame": "enu"},
        "frame is an unknown frame 'enu'; known frames are rfu, flu, ned",
    ),
    "frame": ({"trajectory": ROWS, "frame": 1}, "frame is 1, expected text"),
    "objects": ({"trajectory": ROWS, "objects": {"mug": [0, 0, 0]}}, "objects is an object, expected a list"),
    "object": ({"trajectory": ROWS, "objects": ["mug"]}, "objects[0] is 'mug', expected an object"),
    "no name": (with_object(x=0, y=0, z=0), "objects[1] has no name (its keys are x, y, z)"),
    "empty name": (with_object(name=" ", x=0, y=0, z=0), "objects[1] name is blank"),
    "name": (with_object(name=7, x=0, y=0, z=0), "objects[1] name is 7, expected text"),
    "no coordinates": (with_object(name="cup"), "objects[1] ('cup') has no x, y, z"),
    "no z": (with_object(name="cup", x=0, y=0), "objects[1] ('cup') has no z; give x, y and z in metres"),
    "coordinate": (with_object(name="cup", x=0, y="1", z=0), "objects[1] y is '1', not a number"),
    "boolean": (with_object(name="cup", x=0, y=False, z=0), "objects[1] y is false, not a number"),
    "far": (with_object(name="cup", x=0, y=1e12, z=0), "objects[1] y is 1000000000000.0, beyond"),
    "NaN coordinate": (with_object(name="cup", x=float("nan"), y=0, z=0), "objects[1].x is nan, not a finite number"),
    "two places": (with_object(name="cup", x=0, y=0, z=0, position=[0, 0, 1]), "objects[1] ('cup') has a position"),
    "position": (with_object(name="cup", position=[0, 0]), "objects[1] position holds 2 values, expected 3"),
    "position dict": (with_object(name="cup", position={"x": 0}), "position has the keys x, expected {x, y, z}"),
    "dimensions": (with_object(name="cup", x=0, y=0, z=0, dimensions=2), "objects[1] dimensions is 2"),
    "negative size": (
        with_object(name="cup", x=0, y=0, z=0, dimensions=[1, -1, 1]),
        "dimensions[1] is -1, expected",
    ),
    "orientation": (with_object(name="c", x=0, y=0, z=0, orientation=[0] * 4), "objects[1]", "length zero"),
    "same name": (with_object(name="MUG ", x=0, y=0, z=0), "objects[1] two objects are named 'MUG ' (numbers 0 and 1)"),
    "repeated key": ('{"trajectory": [], "trajectory": []}', "trajectory stands twice in one JSON object"),
    "NaN among the rest": ({"trajectory": ROWS, "colour": {"rgb": [0, float("nan")]}}, "colour.rgb[1] is nan"),
    "half a character": ('{"trajectory": [[0,0,0,1],[1,0,0,1]], "instruction": "\\ud800"}', "surrogate"),
    "very deep": ("[" * 100_000, "nested too deeply"),
    "deep extra": ('{"trajectory": [], "a": ' + "[" * 80 + "]" * 80 + "}", "nested too deeply; ovita reads up to 64"),
    "deep row": ('{"trajectory": [[0,0,0,' + "[" * 500 + "]" * 500 + "]]}", "speed is a list of 1, not a number"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_gives_one_sentence(case):
    document, *fragments = BAD[case]
    with pytest.raises(FormatError) as caught:
        parse(document)
    message = str(caught.value)
    assert message.startswith("f.json: ")
    assert "\n" not in message
    assert len(message) < 250
    for fragment in fragments:
        assert fragment in message


def test_the_culprit_is_an_attribute_too():
    with pytest.raises(FormatError) as caught:
        parse({"trajectory": [*ROWS, [0, 0, 0, -1]]})
    assert (caught.value.file, caught.value.key, caught.value.index) == ("f.json", "trajectory", 2)


def test_the_public_layout():
    task = parse(
        {
            "trajectory": ROWS,
            "instruction": "Go",
            "objects": [{"name": "SODA Can", "x": 1, "y": 2, "z": 3, "dimensions": [0.1, 0.2, 0.3], "colour": "red"}],
            "Env_descp": "a table",
            "constraints": "stay low",
            "robot": "drone",
            "author": {"name": "me"},
        }
    )
    assert task.trajectory == Trajectory.from_array(ROWS)
    assert (task.instruction, task.robot, task.path, task.notes) == ("Go", "drone", "f.json", ())
    assert (task.scene.environment, task.scene.constraints_text) == ("a table", "stay low")
    assert task.scene["soda can"].size.tolist() == [0.1, 0.2, 0.3]
    assert task.scene["soda can"].extra == {"colour": "red"}
    assert task.extra == {"author": {"name": "me"}}


def test_everything_but_the_trajectory_may_be_missing():
    task = parse({"trajectory": ROWS})
    assert task == Task(Trajectory.from_array(ROWS), path="f.json")
    blank = dict.fromkeys(["instruction", "objects", "environment", "constraints", "frame", "timestep", "robot"])
    assert parse({"trajectory": ROWS, **blank}).scene == Scene()


def test_objects_in_other_layouts():
    task = parse(
        {
            "trajectory": ROWS,
            "frame": "FLU",
            "objects": [
                {"name": "a", "position": [1, 2, 3], "dimensions": {"width": 1, "depth": 2, "height": 3}},
                {"name": "b", "position": {"x": 1, "y": 2, "z": 3}, "dimensions": {"z": 3, "y": 2, "x": 1}},
                {"name": "c", "x": 1, "y": 2, "z": 3, "orientation": {"w": 0, "x": 0, "y": 0, "z": 2}},
            ],
        }
    )
    a, b, c = task.scene
    assert a.position.tolist() == b.position.tolist() == [1, 2, 3]
    assert a.size.tolist() == b.size.tolist() == [1, 2, 3]
    assert c.orientation.tolist() == [0, 0, 0, 1]
    assert task.scene.frame == Frame("flu")


@pytest.mark.parametrize("speed", ["speed", "velocity", "v", " Speed "])
def test_rows_may_be_objects(speed):
    document = rows(*[{"z": z, "y": y, "x": x, speed: v} for x, y, z, v in ROWS])
    assert parse(document).trajectory == Trajectory.from_array(ROWS)


def test_rows_with_orientation():
    eight = [[*row, 0.0, 0.0, 0.6, 0.8] for row in ROWS]
    task = parse({"trajectory": eight})
    assert task.trajectory.orientations.tolist() == [[0, 0, 0.6, 0.8]] * 2
    assert trajectory_rows(task.trajectory) == eight


def test_rows_with_times_get_speeds():
    document = rows(*[{"x": i, "y": 0, "z": 0, "t": i / 2} for i in range(5)])
    task = parse(document)
    np.testing.assert_allclose(task.trajectory.speeds, 2.0)
    assert "derived the speeds" in task.notes[0]


def test_what_is_assumed_is_noted():
    task = parse(rows([0, 0, 0], [1, 0, 0]))
    assert task.trajectory.speeds.tolist() == [0.1, 0.1]
    assert "assumed 0.1 m/s" in task.notes[0]
    task = parse(rows(*[{"x": i, "y": 0, "z": 0, "speed": 1, "grip": [], "t": 0} for i in range(2)]))
    assert "grip" in task.notes[0]
    assert "ignored the times" in task.notes[1]


def test_a_structure_of_constraints_is_kept(tmp_path):
    task = parse({"trajectory": ROWS, "constraints": [{"kind": "stay_above", "z": 0.1}]})
    assert task.scene.extra["constraints"] == [{"kind": "stay_above", "z": 0.1}]
    save_task(tmp_path / "t.json", task)
    assert load_task(tmp_path / "t.json").scene == task.scene


@pytest.mark.parametrize("key", ["environment", "Env_descp"])
@pytest.mark.parametrize("value", ["a table", "", None])
def test_the_name_of_the_environment_is_written_as_it_was_read(tmp_path, key, value):
    task = parse({"trajectory": ROWS, key: value})
    save_task(tmp_path / "t.json", task)
    written = json.loads((tmp_path / "t.json").read_text())
    assert {"environment", "Env_descp"} & set(written) == ({key} if value or key == "Env_descp" else set())
    assert load_task(tmp_path / "t.json").scene == task.scene


def test_a_waypoint_is_a_line(tmp_path):
    scene = Scene((SceneObject("mug", [0, 0, 0], [1, 1, 1]),), environment="caf\u00e9")
    save_trajectory(tmp_path / "t.json", Trajectory.from_array(ROWS), scene, "go")
    text = (tmp_path / "t.json").read_text(encoding="utf-8")
    assert "  [0.0, 0.0, 0.0, 0.5],\n  [1.5, 0.0, 0.0, 0.25]\n" in text
    assert '  {"name": "mug", "x": 0.0, "y": 0.0, "z": 0.0, "dimensions": [1.0, 1.0, 1.0]}\n' in text
    assert "caf\u00e9" in text
    assert text.endswith("}\n")


@pytest.mark.parametrize(
    ("extra", "fragment"),
    [
        ({"a": float("nan")}, "cannot be written as JSON"),
        ({"a": {1, 2}}, "a set cannot be written"),
        ({"a": {1: 2}}, "the key 1 is not text"),
        ({"trajectory": []}, "extra may not hold 'trajectory'"),
        ({"a": "\ud800"}, "not valid Unicode"),
    ],
)
def test_what_json_does_not_know_is_not_written(tmp_path, extra, fragment):
    with pytest.raises(FormatError, match=r"t\.json") as caught:
        save_trajectory(tmp_path / "t.json", Trajectory.from_array(ROWS), extra=extra)
    assert fragment in str(caught.value)
    assert os.listdir(tmp_path) == []


def test_arrays_among_the_extra_keys_become_lists(tmp_path):
    extra = {"a": np.arange(3), "b": np.float64(0.5), "c": (1, np.bool_(True)), "d": np.zeros((2, 2))}
    save_trajectory(tmp_path / "t.json", Trajectory.from_array(ROWS), extra=extra)
    expected = {"a": [0, 1, 2], "b": 0.5, "c": [1, True], "d": [[0.0, 0.0], [0.0, 0.0]]}
    assert load_task(tmp_path / "t.json").extra == expected


def test_the_pure_functions_raise_errors_without_a_file():
    with pytest.raises(TrajectoryError, match="waypoint 1: z is null"):
        trajectory_from_rows([[0, 0, 0, 1], [0, 0, None, 1]])
    with pytest.raises(SceneError, match="has no z") as caught:
        scene_from_dict({"objects": [{"name": "a", "x": 0, "y": 0}]})
    assert (caught.value.key, caught.value.index) == ("objects", 0)


def test_a_robot_that_is_no_name_stays_among_the_extra_keys():
    task = parse({"trajectory": ROWS, "robot": {"max_speed": 1}})
    assert task.robot is None
    assert task.extra == {"robot": {"max_speed": 1}}


def test_good_rows_are_read_at_once_without_a_look_at_single_values(tmp_path, monkeypatch):
    values = np.random.default_rng(0).uniform(0, 1, (1000, 4))
    save_trajectory(tmp_path / "t.json", Trajectory.from_array(values))
    monkeypatch.delattr("ovita.io.waypoints.number_problem")
    assert np.array_equal(load_task(tmp_path / "t.json").trajectory.to_array(), values)


coordinates = st.floats(-1e9, 1e9)
speeds = st.floats(0, 1e9)
words = st.text(st.characters(codec="utf-8"), max_size=20)
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | words,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(words, inner, max_size=3),
    max_leaves=8,
)
quaternions = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 1e-3)
extras = st.dictionaries(words.map("x_".__add__), json_values, max_size=3)


@st.composite
def trajectories(draw):
    n = draw(st.integers(2, 6))
    waypoints = draw(st.lists(st.tuples(coordinates, coordinates, coordinates, speeds), min_size=n, max_size=n))
    turns = draw(st.none() | st.lists(quaternions, min_size=n, max_size=n))
    timestep = draw(st.just(0.1) | st.floats(1e-6, 1e6))
    columns = np.array(waypoints)
    return Trajectory(columns[:, :3], columns[:, 3], None if turns is None else np.array(turns), timestep)


@st.composite
def scenes(draw):
    points = st.tuples(coordinates, coordinates, coordinates)
    objects = [
        SceneObject(
            f"thing {i} {draw(words)}",
            np.array(draw(points)),
            draw(st.none() | points.map(np.abs)),
            np.array(draw(quaternions)),
            draw(extras),
        )
        for i in range(draw(st.integers(0, 3)))
    ]
    frame = Frame(draw(st.sampled_from(["rfu", "flu", "ned"])))
    return Scene(tuple(objects), frame, draw(words), draw(words))


@settings(derandomize=True, deadline=None, max_examples=40)
@given(trajectories(), scenes(), words, extras, st.none() | st.just("arm"))
def test_a_task_round_trips_exactly(tmp_path_factory, trajectory, scene, instruction, extra, robot):
    path = tmp_path_factory.getbasetemp() / "round trip.json"
    task = Task(trajectory, scene, instruction, extra, str(path), robot)
    save_task(path, task)
    loaded = load_task(path)
    assert loaded == task
    assert np.array_equal(np.signbit(loaded.trajectory.positions), np.signbit(trajectory.positions))
    again = path.with_name("again.json")
    save_task(again, loaded)
    assert again.read_bytes() == path.read_bytes()


@settings(derandomize=True, deadline=None, max_examples=40)
@given(scenes(), extras)
def test_a_scene_survives_as_a_plain_dict(scene, extra):
    scene = Scene(scene.objects, scene.frame, scene.environment, scene.constraints_text, extra)
    assert scene_from_dict(json.loads(json.dumps(scene_dict(scene)))) == scene


@settings(derandomize=True, deadline=None, max_examples=40)
@given(trajectories())
def test_a_trajectory_survives_as_rows(trajectory):
    rows = json.loads(json.dumps(trajectory_rows(trajectory)))
    assert trajectory_from_rows(rows, timestep=trajectory.timestep) == trajectory
