"""Waits where the path stands still already: how long it stands there in all, or longer."""

import numpy as np
import pytest

from ovita import Scene, SceneObject, accept, adapt
from ovita.instruct.notation import parse, show
from ovita.instruct.realise import realise
from ovita.instruct.understanding import understand
from ovita.paths.trajectory import Trajectory
from ovita.request import Request
from ovita.toolkit.speed import dwell

X = np.linspace(0.0, 2.0, 21)
ROWS = dwell(np.column_stack([X, 0.0 * X, 0.0 * X + 0.3, 0.0 * X + 0.5]), 0.5, 20)
PATH = Trajectory(ROWS[:, :3], ROWS[:, 3])
DESK, SINK = SceneObject("desk", [1.0, 0.3, 0.1], [0.1] * 3), SceneObject("sink", [1.3, 0.3, 0.1], [0.1] * 3)
STEPS_THERE = 20


@pytest.mark.parametrize(
    ("said", "steps"),
    [
        ("wait 5 seconds at the desk", 50),
        ("wait only 1 second at the desk", 10),
        ("wait 2 seconds longer at the desk", 40),
        ("wait another 3 seconds at the desk", 50),
        ("wait longer at the desk", 40),
        ("you don't need to wait at the desk any more", 0),
    ],
)
def test_how_long_it_stands_there_afterwards(said, steps):
    result = adapt(Request(said, PATH, Scene((DESK,))))
    result = accept(result) if result.proposal is not None else result
    path = result.adapted.positions
    assert result.status == "done"
    assert (np.diff(path, axis=0) == 0.0).all(axis=1).sum() == steps
    assert np.allclose(np.unique(path[:, 0].round(9)), np.unique(PATH.positions[:, 0].round(9)))


def test_a_longer_wait_is_one_in_the_notation_too():
    (frame,) = parse("wait longer at=desk for=2s", ("desk",))
    assert frame.longer and parse(show((frame,)), ("desk",))[0].longer


def test_the_stop_that_is_meant_is_the_one_by_the_thing_though_it_is_no_near_one():
    result = adapt(Request("don't wait at the sink", PATH, Scene((SINK,))))
    assert result.status == "done" and len(result.adapted) == len(PATH) - STEPS_THERE


def test_on_the_way_to_what_is_at_the_goal_is_behind_the_last_stop():
    rack = SceneObject("rack", [2.0, 0.2, 0.3], [0.1] * 3)
    result = adapt(Request("hurry up on the way to the rack", PATH, Scene((rack,))))
    faster = result.adapted.speeds > PATH.speeds
    assert result.status == "done" and not faster[:31].any() and faster[32:].all()


def test_to_wait_over_what_the_path_passes_over_it_does_not_rise():
    table = SceneObject("table", [1.5, 0.02, 0.2], [0.3, 0.3, 0.1])
    result = adapt(Request("wait 2 seconds above the table", PATH, Scene((table,))))
    path = result.adapted.positions
    assert result.status == "done" and np.allclose(path[:, 2], 0.3)
    assert (np.diff(path, axis=0) == 0.0).all(axis=1).sum() == STEPS_THERE + 20


def test_the_stop_by_a_thing_is_meant_though_the_next_waypoint_is_nearer():
    bell = SceneObject("bell", [1.06, 0.3, 0.3], [0.1] * 3)
    result = adapt(Request("wait 4 seconds at the bell", PATH, Scene((bell,))))
    assert result.status == "done" and len(result.adapted) == len(PATH) + 20


@pytest.mark.parametrize("said", ["wait 2 s at each room", "wait 2 s at room 1 and room 2"])
def test_a_wait_at_all_of_several_things_is_one_at_each(said):
    rooms = Scene(tuple(SceneObject(f"room {n}", [2.0 * n, 1.0, 0.5], [0.9, 0.1, 1.0]) for n in (1, 2)))
    drive = Trajectory(np.column_stack([np.linspace(0, 6, 31), np.zeros(31), np.zeros(31)]), np.full(31, 0.5))
    found = understand(said, rooms, drive)
    assert [frame.place for frame in found.reading.frames] == ["room 1", "room 2"]
    result = adapt(Request(said, drive, rooms))
    assert len((result.proposal or result).adapted) == 31 + 40


@pytest.mark.parametrize("text", ["wait at=5wp for=1s; wait at=9wp for=2s", "wait at=9wp for=2s; wait at=5wp for=1s"])
def test_numbers_of_waypoints_are_those_of_the_path_before_any_wait(text):
    straight = Trajectory.from_array(np.column_stack([X, 0.0 * X, 0.0 * X, 0.0 * X + 0.5]))
    builder = realise(parse(text), straight, Scene())
    rows, _ = builder.run()
    stands = {round(float(x), 3): int((rows[:, 0] == x).sum()) - 1 for x in X[[4, 8]]}
    assert stands == {round(float(X[4]), 3): 10, round(float(X[8]), 3): 20}
