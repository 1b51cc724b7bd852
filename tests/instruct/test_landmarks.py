"""Points of the compass: which directions they are in a frame, and that it is always shown first."""

import itertools

import numpy as np
import pytest

from ovita.chain import adapt
from ovita.instruct.landmarks import on_axes
from ovita.instruct.notation import show
from ovita.instruct.referee import understand
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


def test_not_so_high_lowers_what_is_high_and_no_end():
    low = adapted("don't go so high").adapted.positions
    assert low[:, 2].max() < ARCH.positions[:, 2].max() - 0.02
    assert np.allclose(low[[0, -1]], ARCH.positions[[0, -1]])
    flat = Trajectory(np.column_stack([np.linspace(0.0, 1.0, 20), np.zeros(20), np.full(20, 0.5)]), np.full(20, 0.2))
    result = adapt(Request("don't go quite so high", flat, Scene(())), writer="builtin")
    assert np.ptp(result.adapted.positions[:, 2]) < 1e-9 and result.adapted.positions[0, 2] < 0.5


def test_the_top_of_a_path_is_a_part_of_it_and_its_highest_point():
    higher = adapted("5 cm higher at the top").adapted.positions[:, 2] - ARCH.positions[:, 2]
    assert abs(higher.max() - 0.05) < 1e-3 and abs(higher[[0, -1]]).max() < 1e-9
    rows = adapted("stop at the top for 3 s").adapted.to_array()
    still = rows[np.flatnonzero((np.diff(rows[:, :3], axis=0) == 0.0).all(axis=1)), 2]
    assert len(still) >= 29 and np.allclose(still, ARCH.positions[:, 2].max())


def test_until_a_thing_that_is_beside_the_start_is_where_the_path_passes_over_it():
    cup = SceneObject("cup", [0.3, 0.0, 0.1], [0.06] * 3)
    low = Trajectory(
        np.column_stack([np.linspace(0.2, 0.8, 31), np.zeros(31), np.r_[np.linspace(0.12, 0.5, 4), np.full(27, 0.5)]]),
        np.full(31, 0.2),
    )
    result = adapt(Request("twice as fast until the cup", low, Scene((cup,))), writer="builtin")
    faster = np.flatnonzero(result.adapted.speeds > 0.3)
    assert faster[-1] in (4, 5, 6)


def test_higher_on_the_way_to_where_it_ends_leaves_the_ends():
    bin_ = SceneObject("bin", [1.0, 0.0, 0.1], [0.06] * 3)
    up = adapted("lift it 5 cm on the way to the bin", bin_).adapted.positions[:, 2] - ARCH.positions[:, 2]
    assert abs(up[[0, -1]]).max() < 1e-9 and up[10:30].min() > 0.049


def test_rows_are_told_by_their_height_and_one_that_is_left_out_is_cut_off():
    rows = [(0, 0, 2), (4, 0, 2), (4, 0, 1), (0, 0, 1), (0, 0, 0), (4, 0, 0)]
    line = np.concatenate([np.linspace(a, b, 20) for a, b in itertools.pairwise(rows)])
    lawn = Trajectory(line[np.r_[True, (np.diff(line, axis=0) != 0.0).any(axis=1)]].astype(float), np.full(96, 0.5))
    top = understand("the top row 20 cm higher", Scene(()), lawn)
    assert top.outcome == "needs_confirmation" and top.reading.frames[0].part.until < 25
    bottom = understand("the bottom row slower", Scene(()), lawn)
    assert bottom.reading.frames[0].part.amount > 70
    assert show(understand("leave out the last row", Scene(()), lawn).reading.frames).startswith("trim last=")


def test_a_little_short_of_the_end_is_a_little_of_the_path():
    assert show(understand("park it a little short of where it ends now", Scene(()), ARCH).reading.frames).startswith(
        "trim last="
    )


def test_before_it_is_lowered_is_where_the_way_down_begins():
    part = understand("wait two seconds before you lower it", Scene(()), ARCH).reading.frames[0]
    assert part.place.value == 21.0
