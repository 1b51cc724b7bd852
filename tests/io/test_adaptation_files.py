import json
import math
from dataclasses import asdict
from pathlib import Path

import pytest

from ovita.errors import FormatError
from ovita.io import is_adaptation, load_document, load_task, save_document, scene_dict
from ovita.measure import compare
from ovita.paths.robot import Robot
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.result import Adaptation

ROWS = [[0.1, 0.2, 0.30000000000000004, 1e-17], [1.0, 2.0, 3.0, 38.5]]
SCENE = Scene((SceneObject("mug", [1, 2, 3]),), Frame("ned"), "a table", "stay low")


def document(**keys):
    return {
        "instruction": "go left",
        "status": "done",
        "adapted": ROWS,
        "original": ROWS[::-1],
        "plan": ["move it"],
        "scene": scene_dict(SCENE),
        "changes": {"length": {"before": 1.0, "after": math.pi}},
        **keys,
    }


def test_a_document_round_trips_exactly(tmp_path):
    path = tmp_path / "r.json"
    save_document(path, document())
    assert load_document(path) == {"schema": "ovita.adaptation/1", **document()}
    text = path.read_text()
    assert text.startswith('{\n "schema": "ovita.adaptation/1",\n')
    assert "\n  [0.1, 0.2, 0.30000000000000004, 1e-17],\n" in text


def test_saving_twice_gives_the_same_bytes(tmp_path):
    save_document(tmp_path / "a.json", document())
    save_document(tmp_path / "b.json", load_document(tmp_path / "a.json"))
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()


def test_a_saved_adaptation_is_a_task_again(tmp_path):
    save_document(tmp_path / "r.json", document(timestep=0.2, robot="arm"))
    task = load_task(tmp_path / "r.json")
    assert task.trajectory == Trajectory.from_array(ROWS, timestep=0.2)
    assert (task.scene, task.instruction, task.robot, task.extra) == (SCENE, "go left", "arm", {})


def test_the_robot_of_an_adaptation(tmp_path):
    path, drone = tmp_path / "r.json", json.loads(json.dumps(asdict(Robot.preset("drone"))))
    save_document(path, document(robot=drone))
    task = load_task(path)
    assert (task.robot, task.notes) == ("drone", ())
    save_document(path, document(robot={**drone, "max_speed": 0.1}))
    task = load_task(path)
    assert task.robot is None
    assert "limits of the robot 'drone' are not taken over" in task.notes[0]


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("a.json", '{"schema": "ovita.adaptation/1"}', True),
        ("a.json", '{"schema": "ovita.adaptation/2"}', True),
        ("a.json", '{"schema": 1}', False),
        ("a.json", '{"trajectory": []}', False),
        ("a.csv", "x,y,z", False),
    ],
)
def test_an_adaptation_is_told_from_a_task(tmp_path, name, content, expected):
    (tmp_path / name).write_text(content)
    assert is_adaptation(tmp_path / name) is expected


def test_what_cannot_be_read_is_not_told_apart(tmp_path):
    with pytest.raises(FormatError, match="no such file"):
        is_adaptation(tmp_path / "a.json")
    (tmp_path / "a.json").write_text("{")
    with pytest.raises(FormatError, match="not JSON"):
        is_adaptation(tmp_path / "a.json")


@pytest.mark.parametrize(
    ("content", "fragment"),
    [
        ('{"a": 1}', "no schema is given, expected 'ovita.adaptation/1'"),
        ('{"trajectory": []}', "this is a task, not a saved adaptation"),
        ('{"schema": "ovita.adaptation/2"}', "schema is 'ovita.adaptation/2'; this version of ovita reads"),
        ('{"schema": 5}', "schema is 5"),
        ('{"schema": "ovita.adaptation/1", "adapted": [[1, NaN]]}', "adapted[0][1] is nan, not a finite number"),
        ("[]", "top level is an empty list"),
        ("hello", "this is not JSON"),
    ],
)
def test_a_bad_document_gives_one_sentence(tmp_path, content, fragment):
    (tmp_path / "r.json").write_text(content)
    with pytest.raises(FormatError) as caught:
        load_document(tmp_path / "r.json")
    assert fragment in str(caught.value)


@pytest.mark.parametrize(
    ("keys", "fragment"),
    [
        ({"schema": "ovita.adaptation/9"}, "reads 'ovita.adaptation/1'"),
        ({"adapted": None, "status": "failed"}, "no adapted trajectory (its status is 'failed')"),
        ({"adapted": [[0, 0, 0, 1], [0, 0, 0, -1]]}, "adapted[1] speed -1 is negative"),
        ({"scene": 3}, "scene is 3, expected an object"),
        ({"scene": {"objects": [{}]}}, "objects[0] has no name"),
    ],
)
def test_a_document_that_is_no_task(tmp_path, keys, fragment):
    content = {"schema": "ovita.adaptation/1", **document(), **keys}
    (tmp_path / "r.json").write_text(json.dumps(content))
    with pytest.raises(FormatError) as caught:
        load_task(tmp_path / "r.json")
    assert fragment in str(caught.value)


@pytest.mark.parametrize("keys", [{"schema": "other"}, {"a": float("nan")}, {"a": object()}])
def test_a_document_that_cannot_be_saved(tmp_path, keys):
    with pytest.raises(FormatError, match=r"r\.json"):
        save_document(tmp_path / "r.json", document(**keys))
    assert not (tmp_path / "r.json").exists()


def test_a_result_of_version_0_1_0_loads_with_its_changes_measured_again():
    result = Adaptation.load(str(Path(__file__).with_name("result_0_1_0.json")))
    assert result.status == "done" and result.changes == compare(result.original, result.adapted, result.scene)
    assert Adaptation.from_document(result.to_document()) == result
