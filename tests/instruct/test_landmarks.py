"""Points of the compass, and features of a path such as its rows: what they are taken for."""

import itertools
import re

import numpy as np
import pytest

from ovita.chain import adapt
from ovita.instruct.landmarks import by_feature, on_axes
from ovita.instruct.notation import show
from ovita.instruct.understanding import understand
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.request import Request

SILO = SceneObject("silo", np.array([0.5, 0.3, 0.0]), [0.1, 0.1, 0.1])
PATH = Trajectory(np.column_stack([np.linspace(0.0, 1.0, 30), np.zeros(30), np.zeros(30)]), np.full(30, 0.2))


@pytest.mark.parametrize(
    ("frame", "north", "east"), [("rfu", "front", "right"), ("flu", "left", "front"), ("ned", "front", "right")]
)
def test_a_point_of_the_compass_is_a_direction_of_the_frame(frame, north, east):
    turned, taken = on_axes("north of it, then eastwards", Scene((SILO,), Frame(frame)))
    assert turned == f"{north} of it, then {east}"
    assert f"north is {north}" in taken and f"east is {east}" in taken


def test_the_name_of_an_object_is_no_point_of_the_compass():
    scene = Scene((SceneObject("north gate", np.zeros(3)),))
    assert on_axes("stop at the north gate", scene) == ("stop at the north gate", "")


def test_it_is_shown_first_with_what_it_was_taken_for():
    found = understand("move 2 m north", Scene((SILO,)), PATH)
    assert show(found.reading.frames) == "move front=2m"
    assert found.outcome == "needs_confirmation" and any("north is front" in doubt for doubt in found.doubts)


ARCH = Trajectory(
    np.column_stack([np.linspace(0.0, 1.0, 41), np.zeros(41), 0.2 + 0.3 * np.sin(np.linspace(0.0, np.pi, 41))]),
    np.full(41, 0.2),
)


def adapted(said, *objects):
    return adapt(Request(said, ARCH, Scene(objects)), writer="builtin")


def test_the_top_of_a_path_is_a_part_of_it_and_its_highest_point():
    higher = adapted("5 cm higher at the top").adapted.positions[:, 2] - ARCH.positions[:, 2]
    assert abs(higher.max() - 0.05) < 1e-3 and abs(higher[[0, -1]]).max() < 1e-9
    rows = adapted("stop at the top for 3 s").adapted.to_array()
    still = rows[np.flatnonzero((np.diff(rows[:, :3], axis=0) == 0.0).all(axis=1)), 2]
    assert len(still) >= 29 and np.allclose(still, ARCH.positions[:, 2].max())


def test_rows_are_told_by_their_height_and_one_that_is_left_out_is_cut_off():
    rows = [(0, 0, 2), (4, 0, 2), (4, 0, 1), (0, 0, 1), (0, 0, 0), (4, 0, 0)]
    line = np.concatenate([np.linspace(a, b, 20) for a, b in itertools.pairwise(rows)])
    lawn = Trajectory(line[np.r_[True, (np.diff(line, axis=0) != 0.0).any(axis=1)]].astype(float), np.full(96, 0.5))
    top = understand("the top row 20 cm higher", Scene(()), lawn)
    assert top.outcome == "needs_confirmation" and top.reading.frames[0].part.until < 25
    bottom = understand("the bottom row slower", Scene(()), lawn)
    assert bottom.reading.frames[0].part.amount > 70
    assert show(understand("leave out the last row", Scene(()), lawn).reading.frames).startswith("trim last=")


def lawn(rows=4, long=10.0, apart=1.0, home=True):
    """Rows along x, one above the other in y, a way there and one home; and the first and last waypoint of each row."""
    corners = [(-6.0, -4.0)] + [(x, y * apart) for y in range(rows) for x in ((0, long) if y % 2 == 0 else (long, 0))]
    corners += [(-5.0, -4.0)] if home else []
    line = np.concatenate([np.linspace(a, b, 21)[:-1] for a, b in itertools.pairwise(corners)] + [[corners[-1]]])
    path = np.column_stack([line, np.ones(len(line))])
    return path, [(20 + 40 * row + 1, 40 + 40 * row + 1) for row in range(rows)]


@pytest.mark.parametrize(
    ("said", "rows"),
    [
        ("slower on the second row", [(1, 1)]), ("slower on lane 3", [(2, 2)]), ("slower on lane three", [(2, 2)]),
        ("slower on the last lane", [(3, 3)]), ("the last two strips slower", [(2, 3)]),
        ("slower on rows 2 to 3", [(1, 2)]), ("slower on all the rows", [(0, 3)]),
    ],
)  # fmt: skip
def test_rows_by_number_are_waypoints_and_no_way_there_or_home(said, rows):
    path, known = lawn()
    told, taken = by_feature(said, Scene(()), path)
    [(first, last)] = [(known[a][0], known[b][1]) for a, b in rows]
    a, b = map(int, re.search(r"waypoints (\d+) to (\d+)", told).groups())
    assert abs(a - first) <= 1 and abs(b - last) <= 1 and taken


@pytest.mark.parametrize("said", ["slower on row 9", "slower on the last nine rows", "hold the middle lane", "top row"])
def test_rows_that_are_not_there_stay_as_they_are_said(said):
    path, _ = lawn()
    told, taken = by_feature(said, Scene(()), path)
    assert told == said and ("no part of this path" in taken) == ("9" in said or "nine" in said)


@pytest.mark.parametrize(
    "said",
    [
        "move all the row one meter to the left", "go straight 0.5 m", "pass 0.2 left of the cup",
        "pass two objects on the left", "first pass the cup, then wait", "last pass the box",
    ],
)  # fmt: skip
def test_a_verb_or_a_length_counts_no_row(said):
    path, _ = lawn()
    told, taken = by_feature(said, Scene(()), path)
    assert taken == "" and "waypoint" not in told


def test_a_row_behind_a_verb_is_told_by_its_number():
    path, _ = lawn()
    (told, _), (plain, _) = (by_feature(said, Scene(()), path) for said in ("lower lane 3 by 5 cm", "lane 3"))
    assert told == f"lower {plain} by 5 cm" and plain.startswith("waypoints ")


def test_what_an_object_is_called_is_no_feature():
    path, _ = lawn()
    named = Scene((SceneObject("row 3", np.zeros(3)), SceneObject("top shelf", np.zeros(3))))
    assert by_feature("slower by row 3", named, path)[0] == "slower by row 3"
    assert by_feature("wait at the top", named, ARCH.positions)[0] == "wait at the top"


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("wait 2 s when it's at its highest", "wait 2 s at waypoint 21"),
        ("stop for a second at the peak", "stop for a second at waypoint 21"),
        ("slower after the highest point", "slower from waypoint 21 on"),
        ("slower before the top of the arc", "slower up to waypoint 21"),
        ("wait at the rightmost point", "wait at waypoint 41"),
        ("over the top of the box", "over the top of the box"),
    ],
)
def test_the_outermost_point_of_a_path_is_a_waypoint(said, meant):
    assert by_feature(said, Scene(()), ARCH.positions)[0] == meant


def test_stops_and_the_way_back_are_waypoints():
    out = np.column_stack([np.linspace(0.0, 1.0, 11), np.zeros(11), np.zeros(11)])
    path = np.concatenate([out[:6], out[5:6], out[5:6], out[6:], out[-2::-1] + np.array([0.0, 0.1, 0.0])])
    assert by_feature("faster after the stop", Scene(()), path)[0] == "faster from waypoint 8 on"
    assert by_feature("slower on the way back", Scene(()), path)[0] == "slower from waypoint 13 to waypoint 22"
    assert by_feature("the return trip can be faster", Scene(()), path)[0].startswith("from waypoint 13")
    assert by_feature("slower on the way back", Scene(()), out)[0] == "slower on the way back"
    assert by_feature("after the third stop", Scene(()), path)[0] == "after the third stop"
