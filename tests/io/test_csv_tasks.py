import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ovita.errors import FormatError
from ovita.io import load_task, save_task, save_trajectory, tables
from ovita.paths.trajectory import Trajectory

EXPECTED = Trajectory.from_array([[0, 1, 2, 0.5], [3, 4, 5, 0.25]])


def parse(text):
    return tables.parse_csv(text, "f.csv")


@pytest.mark.parametrize(
    "text",
    [
        "x,y,z,speed\n0,1,2,0.5\n3,4,5,0.25\n",
        "x,y,z,speed\r\n0,1,2,0.5\r\n3,4,5,0.25",
        "x,y,z,speed\r0,1,2,0.5\r3,4,5,0.25\r",
        "Speed;X;Y;Z\n.5;0;1;2\n.25;3;4;5\n",
        " x \ty\t z\tVELOCITY\n0\t 1 \t2\t5e-1\n3\t4\t5\t+0.25\n",
        "\n\nx, y, z, v\n\n0, 1, 2, 0.5\n,,,\n3, 4, 5, 0.25\n\n",
        "# made by hand\n# x,y,z,speed\n0,1,2,0.5\n3,4,5,0.25\n",
        '"x","y","z","speed"\n"0","1","2","0.5"\n3,4,5,0.25\n',
    ],
)
def test_headers_are_read_forgivingly(text):
    task = parse(text)
    assert task.trajectory == EXPECTED
    assert task.notes == ()


def test_orientation_and_timestep():
    task = parse("# timestep: 0.5\nx,y,z,speed,qx,qy,qz,qw\n0,1,2,0.5,0,0,0,1\n3,4,5,0.25,1,0,0,0\n")
    assert task.trajectory.orientations.tolist() == [[1, 0, 0, 0], [0, 1, 0, 0]]
    assert task.trajectory.timestep == 0.5


def test_what_is_assumed_or_ignored_is_noted():
    assert "assumed 0.1 m/s" in parse("x,y,z\n0,1,2\n3,4,5\n").notes[0]
    task = parse("x,y,z,speed,gripper,t,\n0,1,2,0.5,open,0,\n3,4,5,0.25,shut,0,\n")
    assert task.trajectory == EXPECTED
    assert "gripper, (without a name)" in task.notes[0]
    assert "ignored the times t" in task.notes[1]


def test_times_instead_of_speeds():
    task = parse("time,x,y,z\n0,0,0,0\n1,2,0,0\n2,4,0,0\n2.5,4,0,0\n3.5,6,0,0\n")
    assert task.trajectory.duration == pytest.approx(3.5)
    assert task.trajectory.speeds[3] == 0
    assert task.trajectory.timestep == 0.5
    assert task.notes[0] == "derived the speeds from the times t"


H = "x,y,z,speed\n"
BAD = {
    "no header": ("0,1,2,0.5\n3,4,5,0.25\n", "the first line (0, 1, 2, 0.5) must name the columns"),
    "comments only": ("# hello\n# world\n", "no header, only comments"),
    "header only": (H, "a header but no row"),
    "one row": (H + "0,1,2,3\n", "f.csv: has 1 waypoint; a trajectory needs at least 2"),
    "no y": ("x,z\n1,2\n1,2\n", "has no y, only x, z"),
    "twice": ("x,y,z,speed,V\n1,2,3,4,5\n", "V repeats the column speed"),
    "ragged": (H + "0,1,2,3\n0,1,2\n", "row[1] holds 3 values where the header names 4 (line 3)"),
    "ragged after a comment": ("# hi\n\n" + H + "0,1,2,3\n0,1,2\n", "row[1] holds 3 values", "(line 5)"),
    "text": (H + "0,1,2,3\n0,abc,2,3\n", "y[1] is 'abc', not a number (line 3)"),
    "empty cell": (H + "0,1,2,3\n0,1,,3\n", "z[1] is empty, expected a number (line 3)"),
    "NaN": (H + "0,1,2,3\nnan,1,2,3\n", "x[1] is nan, not a finite number (line 3)"),
    "infinite": (H + "0,1,2,3\n0,1,2,-Infinity\n", "speed[1] is -inf, not a finite number"),
    "overflow": (H + "0,1,2,1e999\n0,1,2,3\n", "speed[0] is inf"),
    "far": (H + "0,1,2,3\n0,1e10,2,3\n", "y[1] is 10000000000.0, beyond the largest magnitude"),
    "underscore": (H + "0,1,2,3\n0,1_0,2,3\n", "y[1] is '1_0', not a number"),
    "decimal comma": ("x;y;z\n1,5;2;3\n1;2;3\n", "x[0] is '1,5', not a number; write decimals with a point"),
    "negative speed": (H + "0,1,2,3\n0,1,2,-3\n", "speed[1] speed -3 is negative"),
    "half a quaternion": ("x,y,z,qw,qx\n1,2,3,4,5\n1,2,3,4,5\n", "only qw, qx of the quaternion"),
    "zero quaternion": ("x,y,z,qw,qx,qy,qz\n1,2,3,1,0,0,0\n1,2,3,0,0,0,0\n", "qw[1] the quaternion"),
    "time repeats": ("x,y,z,t\n0,0,0,0\n1,0,0,1\n2,0,0,1\n", "t[2] is at 1 s, not after the 1 s before it"),
    "time leaps": ("x,y,z,t\n0,0,0,0\n1000,0,0,1e-9\n", "t[1] moves 1000 m in 1e-09 s"),
    "timestep": ("# timestep: -1\n" + H, "timestep is '-1', expected a time > 0"),
    "endless field": (H + "9" * 200_000 + ",1,2,3\n", "this is not CSV: field larger"),
    "JSON": ('{"trajectory": []}', "must name the columns"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_gives_one_sentence(case):
    text, *fragments = BAD[case]
    with pytest.raises(FormatError) as caught:
        parse(text)
    message = str(caught.value)
    assert message.startswith("f.csv: ")
    assert "\n" not in message
    assert len(message) < 250
    for fragment in fragments:
        assert fragment in message


numbers = st.floats(-1e9, 1e9)


@settings(derandomize=True, deadline=None, max_examples=50)
@given(
    st.lists(st.tuples(numbers, numbers, numbers, st.floats(0, 1e9)), min_size=2, max_size=6),
    st.booleans(),
    st.just(0.1) | st.floats(1e-6, 1e6),
)
def test_a_trajectory_round_trips_exactly(tmp_path_factory, rows, turned, timestep):
    path = tmp_path_factory.getbasetemp() / "round trip.csv"
    rows = np.array(rows)
    turns = np.array([[np.cos(i), 0, np.sin(i), 0] for i in range(len(rows))]) if turned else None
    trajectory = Trajectory(rows[:, :3], rows[:, 3], turns, timestep)
    save_trajectory(path, trajectory)
    assert load_task(path).trajectory == trajectory


def test_a_csv_file_can_be_saved_with_its_scene_left_out(tmp_path):
    task = parse("x,y,z,speed\n0,1,2,0.5\n3,4,5,0.25\n")
    save_task(tmp_path / "t.CSV", task)
    assert (tmp_path / "t.CSV").read_text() == "x,y,z,speed\n0.0,1.0,2.0,0.5\n3.0,4.0,5.0,0.25\n"
