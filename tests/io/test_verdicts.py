"""A file says what became of its trajectory, wherever its format has room."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from ovita.cli.main import cli
from ovita.errors import TrajectoryError
from ovita.io import Choices, load_task, save_task, save_trajectory
from ovita.io.geodesy import Home
from ovita.io.messages import JointMotion, build_joints, parse, parse_joints
from ovita.paths.scene import Frame, Scene
from ovita.paths.trajectory import Trajectory
from ovita.result import Adaptation

PATH = Trajectory([[0, 0, 1], [1, 0, 1], [2, 1, 1]], [0.5, 0.5, 0.5])
VERDICT = "infeasible: The limits cannot all hold."
CHOICES = Choices(home=Home(47.0, 8.0, 400.0))


@pytest.mark.parametrize("name", ["t.json", "t.csv", "t.pose.csv", "t.tum", "t.plan", "t.mcap", "t.db3", "bag/"])
def test_the_verdict_travels_with_the_trajectory(tmp_path, name):
    if name in ("t.mcap", "t.db3", "bag/"):
        pytest.importorskip("rosbags")
    path = f"{tmp_path}/{name}"
    save_trajectory(path, PATH, choices=CHOICES, verdict=VERDICT.replace(" ", "\n", 1))
    task = load_task(path)
    assert task.verdict == VERDICT
    assert task.notes[-1] == f"the file says of its trajectory: {VERDICT}"
    assert len(task.trajectory) == len(PATH)
    again = tmp_path / "again.csv"
    save_task(again, task)
    assert load_task(again).verdict == VERDICT


@pytest.mark.parametrize("name", ["t.json", "t.csv", "t.tum", "t.plan"])
def test_without_a_verdict_nothing_is_said(tmp_path, name):
    save_trajectory(tmp_path / name, PATH, choices=CHOICES)
    assert load_task(tmp_path / name).verdict == ""
    assert "verdict" not in (tmp_path / name).read_text()


def test_a_format_without_room_says_so(tmp_path):
    notes = save_trajectory(tmp_path / "t.waypoints", PATH, choices=CHOICES, verdict=VERDICT)
    assert "QGC WPL text has no room for the verdict (infeasible)" in notes


def test_a_verdict_of_the_users_own_shape_is_kept(tmp_path):
    save_trajectory(tmp_path / "t.json", PATH, extra={"verdict": {"by": "me"}})
    task = load_task(tmp_path / "t.json")
    assert (task.verdict, task.extra) == ("", {"verdict": {"by": "me"}})


@pytest.mark.parametrize(("status", "mark"), [("done", ""), ("infeasible", "-infeasible"), ("limited", "-limited")])
def test_a_saved_adaptation_is_a_task_with_a_verdict(tmp_path, status, mark):
    result = Adaptation("go", status, PATH, PATH)
    result.save(str(tmp_path / "r.json"))
    assert load_task(tmp_path / "r.json").verdict == result.verdict
    assert result.verdict.startswith(status if mark else "")
    assert result.mark == mark


class _Fields:
    def __init__(self, **fields):
        self.__dict__.update(fields)


def message(*xs, stamped=True):
    poses = [_Fields(position=_Fields(x=x, y=0.0, z=0.0), orientation=_Fields(x=0.0, y=0.0, z=0.0, w=0.0)) for x in xs]
    stamps = [_Fields(frame_id="", stamp=_Fields(sec=i * stamped, nanosec=0)) for i in range(len(xs))]
    return _Fields(
        header=_Fields(frame_id="map", stamp=_Fields(sec=0, nanosec=0)),
        poses=[_Fields(header=header, pose=pose) for header, pose in zip(stamps, poses, strict=True)],
    )


def test_a_stamped_path_with_a_nan_gives_one_sentence():
    with pytest.raises(TrajectoryError, match="x is nan, not a finite number") as caught:
        parse("path", message(0.0, float("nan"), 2.0))
    assert caught.value.index == 1


def test_quaternions_of_length_zero_are_left_out_aloud():
    trajectory, _, _, notes = parse("path", message(0.0, 1.0, 2.0))
    assert trajectory.orientations is None
    assert "every quaternion has length zero, so the orientations were left out" in notes


@pytest.mark.parametrize("name", ["flu", "rfu", "ned"])
def test_joints_keep_the_axes_of_their_base(name):
    pytest.importorskip("rosbags")
    from ovita.io.bags import bag_maker

    motion = JointMotion(("a",), np.array([[0.0], [1.0]]), np.array([0.0, 1.0]), frame=Frame(name))
    assert parse_joints(build_joints(motion, bag_maker())).frame == Frame(name)


def test_convert_warns_of_what_the_gate_would_refuse(tmp_path):
    slow = Trajectory(PATH.positions, [0.5, 0.0, 0.0])
    save_trajectory(tmp_path / "t.json", slow)
    done = CliRunner().invoke(cli, ["convert", str(tmp_path / "t.json"), str(tmp_path / "o.csv")])
    assert done.exit_code == 0
    assert "ovita send would refuse it: From waypoint 2 it goes on at speed 0" in done.output
    save_trajectory(tmp_path / "t.json", Trajectory(PATH.positions, [9.0, 9.0, 9.0]), Scene(), extra={"robot": "drone"})
    done = CliRunner().invoke(cli, ["convert", str(tmp_path / "t.json"), str(tmp_path / "o.csv")])
    assert "ovita send would refuse it: Measured again, the speed limit is broken" in done.output


@pytest.mark.parametrize(
    ("key", "value", "fragment"),
    [
        ("adapted", [["0", 0, 0, 1], [1, 0, 0, 1]], "adapted[0] [0] is '0', not a number"),
        ("adapted", [[True, 0, 0, 1], [1, 0, 0, 1]], "adapted[0] [0] is true, not a number"),
        ("timestep", "0.1", "timestep is '0.1', not a number"),
        ("attempts", True, "attempts is true, expected a whole number"),
        ("warnings", "none", "warnings is 'none', expected a list"),
        ("robot", {"name": "r", "margin": "0.1"}, "robot.margin is '0.1', not a number"),
    ],
)
def test_a_result_is_read_by_the_strict_rules_of_json(key, value, fragment):
    document = json.loads(json.dumps(Adaptation("go", "done", PATH, PATH).to_document()))
    if key == "attempts":
        document["writer"][key] = value
    else:
        document[key] = value
    with pytest.raises(Exception, match=r"f\.json") as caught:
        Adaptation.from_document(document, file="f.json")
    assert fragment in str(caught.value)
