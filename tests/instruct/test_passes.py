"""Straight stretches by their number: rows, passes and corridors, and what is before or after a corner."""

import numpy as np
import pytest

from ovita import Scene, SceneObject
from ovita.instruct.landmarks import by_number, straights
from ovita.instruct.notation import show
from ovita.instruct.referee import understand
from ovita.paths.trajectory import Trajectory

ROWS = np.concatenate([
    np.column_stack([np.linspace(0.0, 10.0, 21)[:: 1 if k % 2 == 0 else -1], np.full(21, 1.5 * k), np.ones(21)])
    for k in range(3)
])  # fmt: skip
HALL = np.concatenate([
    np.column_stack([np.zeros(20), np.linspace(0.0, 8.0, 20), np.zeros(20)]),
    np.column_stack([np.linspace(0.5, 9.0, 20), np.full(20, 8.5), np.zeros(20)]),
])  # fmt: skip
SCENE = Scene((SceneObject("cup", [5.0, 4.0, 1.0], [0.1] * 3),))


def test_the_rows_of_a_field_are_its_straight_stretches():
    found = straights(ROWS)
    assert len(found) == 3
    for k, (first, last) in enumerate(found):
        assert 21 * k <= first <= 21 * k + 2 and 21 * k + 18 <= last <= 21 * k + 20


@pytest.mark.parametrize(
    ("path", "said", "words"),
    [
        (ROWS, "slower in the second row", "slower in waypoints 2"),
        (ROWS, "lift the middle pass 10 cm", "lift waypoints 2"),
        (ROWS, "10 cm lower on the last lane", "10 cm lower on waypoints 4"),
        (HALL, "faster after the corner", "faster from waypoint 2"),
        (HALL, "slow before the bend", "slow up to waypoint "),
    ],
)
def test_what_is_called_by_its_number_is_told_by_waypoints_and_shown_first(path, said, words):
    text, taken = by_number(said, SCENE, path)
    assert text.startswith(words) and taken.startswith("It is taken that")
    trajectory = Trajectory(path, np.full(len(path), 0.5))
    verdict = understand(said, SCENE, trajectory)
    assert verdict.outcome == "needs_confirmation" and (
        "@range" in (read := show(verdict.reading.frames)) or "@after" in read
    )


@pytest.mark.parametrize(
    ("path", "said"),
    [
        (ROWS[:21], "slower in the first row"),
        (ROWS, "slower in the fifth row"),
        (ROWS, "go left by 0.1"),
        (HALL, "faster after the corner of the table"),
        (None, "slower in the second row"),
    ],
)
def test_nothing_is_taken_where_there_is_no_such_stretch(path, said):
    assert by_number(said, SCENE, path) == (said, "")


def test_an_object_that_is_called_so_is_no_stretch():
    scene = Scene((SceneObject("second row", [5.0, 4.0, 1.0], [0.1] * 3),))
    assert by_number("slower near the second row", scene, ROWS)[1] == ""
