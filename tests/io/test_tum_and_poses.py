import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ovita.errors import FormatError
from ovita.io import load_task, save_task, save_trajectory, tables
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Trajectory

RNG = np.random.default_rng(5)
PATH = Trajectory(np.cumsum(RNG.normal(size=(20, 3)), axis=0), np.linspace(0.2, 0.8, 20), RNG.normal(size=(20, 4)))

coordinates = st.floats(-1e3, 1e3, allow_subnormal=False)
paths = st.lists(st.tuples(coordinates, coordinates, coordinates), min_size=2, max_size=15, unique=True)


@given(paths, st.floats(0.1, 2.0))
@settings(derandomize=True, deadline=None, max_examples=60)
def test_tum_and_poses_round_trip(points, speed):
    points = np.round(points, 3)
    if (np.linalg.norm(np.diff(points, axis=0), axis=1) == 0).any():
        return
    path = Trajectory(points, np.full(len(points), speed), np.tile([0.6, 0, 0.8, 0], (len(points), 1)))
    back = tables.parse_tum(tables.dumps_tum(path)[0], "f").trajectory
    assert (back.positions == path.positions).all() and (back.orientations == path.orientations).all()
    np.testing.assert_allclose(back.speeds, path.speeds, rtol=1e-6)
    poses = tables.parse_csv(tables.dumps_poses(path)[0], "f").trajectory
    assert (poses.positions == path.positions).all() and (poses.orientations == path.orientations).all()


def test_tum_keeps_the_time_of_day_and_says_what_it_loses(tmp_path):
    text = "# timestamp tx ty tz qx qy qz qw\n1305031098.6 0 0 0 0 0 0 1\n1305031099.6 1 0 0 0 0 0 1\n"
    (tmp_path / "a.tum").write_text(text)
    task = load_task(tmp_path / "a.tum")
    assert task.trajectory.duration == pytest.approx(1.0) and task.extra == {"start_time": 1305031098.6}
    assert task.trajectory.orientations.tolist() == [[1, 0, 0, 0]] * 2
    notes = save_task(tmp_path / "b.txt", task)
    assert (tmp_path / "b.txt").read_text().splitlines()[1].startswith("1305031098.6 0.0 0.0 0.0 0.0 0.0 0.0 1.0")
    assert load_task(tmp_path / "b.txt").trajectory == task.trajectory
    scene = Scene((SceneObject("cup", [0, 0, 0]),), Frame("flu"))
    bare = Trajectory(PATH.positions, PATH.speeds)
    notes = save_trajectory(tmp_path / "c.tum", bare, scene)
    for part in ("times instead of speeds", "no orientations", "no frame; say --frame flu", "holds no objects"):
        assert any(part in note for note in notes), (part, notes)


def test_seven_columns_without_a_header(tmp_path):
    (tmp_path / "p.csv").write_text("# recorded\n1,2,3,0,0,0,1\n2,2,3,0,0,1,0\n")
    task = load_task(tmp_path / "p.csv")
    assert task.trajectory.orientations.tolist() == [[1, 0, 0, 0], [0, 0, 0, 1]]
    assert "seven columns were read as x, y, z, qx, qy, qz, qw" in task.notes[0]
    (tmp_path / "p.csv").write_text("1,2,3,0,0,0,1\n2,2,3,0,zero,1,0\n")
    with pytest.raises(FormatError, match=r"qy\[1\] is 'zero', not a number \(line 2\)"):
        load_task(tmp_path / "p.csv")
    notes = save_trajectory(tmp_path / "q.pose.csv", PATH)
    assert (tmp_path / "q.pose.csv").read_text().startswith("x,y,z,qx,qy,qz,qw\n") and "no speeds" in notes[0]
    assert (load_task(tmp_path / "q.pose.csv").trajectory.orientations == PATH.orientations).all()


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("0 1 2 3 0 0 0\n", "line 1 holds 7 values, expected 8"),
        ("0 1 2 3 0 0 0 1\n1 1 2 nan 0 0 0 1\n", "line 2: z is 'nan', not a finite number"),
        ("0 1 2 3 0 0 0 1\n1 1 2 x 0 0 0 1\n", "line 2: z is 'x'"),
        ("1 1 2 3 0 0 0 1\n1 2 2 3 0 0 0 1\n", "times must increase strictly"),
        ("0 1 2 3 0 0 0 1\n", "at least 2"),
        ("0 1 2 3 0 0 0 0\n1 2 2 3 0 0 0 1\n", "length zero"),
        ("# nothing\n", "only comments"),
        ("0 1 2 1e12 0 0 0 1\n1 1 2 3 0 0 0 1\n", "line 1: z"),
    ],
)
def test_malformed_tum(text, problem):
    with pytest.raises(FormatError, match=problem):
        tables.parse_tum(text, "f.tum")


def test_a_text_file_that_is_neither(tmp_path):
    (tmp_path / "a.txt").write_text("hello\n")
    with pytest.raises(FormatError, match="neither TUM text"):
        load_task(tmp_path / "a.txt")


@given(st.text(alphabet="0123456789 .-e\n#naQGCWPL\t", max_size=200))
@settings(derandomize=True, deadline=None, max_examples=60)
def test_nothing_but_a_format_error_comes_out_of_any_text(text):
    for parse in (tables.parse_tum, tables.parse_csv):
        try:
            parse(text or " ", "f")
        except FormatError as error:
            assert "\n" not in str(error) and len(str(error)) < 300
