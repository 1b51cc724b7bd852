"""Ends of a path: where it is cut, and how a robot comes to rest there."""

import numpy as np
import pytest

from ovita import Scene, SceneObject, accept, adapt
from ovita.instruct.notation import show
from ovita.instruct.understanding import understand
from ovita.paths.trajectory import Trajectory
from ovita.request import Request

X = np.linspace(0.0, 3.0, 13)
SPEEDS = np.full(13, 0.5)
SPEEDS[-3:] = 0.4, 0.2, 0.0
PATH = Trajectory(np.column_stack([X, np.zeros(13), np.full(13, 0.2)]), SPEEDS)
SCENE = Scene((SceneObject("cup", [1.5, 0.6, 0.1], [0.1] * 3),))


@pytest.mark.parametrize(
    "said",
    [
        "it stops 10 cm short",
        "move the end 10 cm further",
        "stop 10 cm before, then go on",
        "don't stop 10 cm earlier",
        "stop 10 cm before the tree",
        "slow down 10 cm before the end",
    ],
)
def test_a_complaint_a_denial_and_what_is_before_something_else_cut_nothing(said):
    found = understand(said, SCENE, PATH)
    assert found.outcome != "do" or "trim" not in show(found.reading.frames)


def test_the_path_is_cut_between_waypoints_and_the_robot_comes_to_rest_as_before():
    result = adapt(Request("cut off the last 60 cm", PATH, SCENE))
    cut = result.adapted
    assert result.status == "done" and np.allclose(cut.positions[-1], [2.4, 0.0, 0.2])
    assert cut.speeds[-1] == 0.0 and 0.0 < cut.speeds[-2] < 0.5 and np.allclose(cut.speeds[:6], 0.5)


def test_an_end_at_a_building_is_beside_it_at_the_height_of_a_level_path():
    shed = SceneObject("shed", [5.0, 0.0, 1.0], [2.0, 2.0, 2.0])
    goal = adapt(Request("end at the shed", PATH, Scene((shed,)))).adapted.positions[-1]
    assert 3.0 < goal[0] < 4.0 and abs(goal[1]) < 1e-6 and np.isclose(goal[2], 0.2)


def test_a_ramp_keeps_the_stops():
    rows = np.insert(PATH.to_array(), 4, [[0.75, 0.0, 0.2, 0.0]] * 3, axis=0)
    path = Trajectory(rows[:, :3], rows[:, 3])
    result = adapt(Request("start slow, then get faster and faster", path, SCENE))
    result = accept(result) if result.proposal is not None else result
    assert (result.adapted.speeds[4:7] == 0.0).all()


@pytest.mark.parametrize("said", ["finish 60 cm earlier", "end 60 cm short of where it ends now"])
def test_an_earlier_end_is_cut_and_not_gone_on_to_and_back(said):
    result = adapt(Request(said, PATH, SCENE))
    cut = (result.proposal or result).adapted
    assert np.allclose(cut.positions[-1], [2.4, 0.0, 0.2]) and cut.length < PATH.length


def test_a_ramp_over_the_last_metre_is_one_of_what_a_stop_leaves():
    path = Trajectory(np.column_stack([np.linspace(0.0, 4.0, 81), np.zeros(81), np.full(81, 0.2)]), np.full(81, 0.5))
    scene = Scene((SceneObject("gate", [3.0, 0.4, 0.2], [0.1] * 3),))
    result = adapt(Request("stop 50 cm before the gate and ramp the speed down over the last 1 m", path, scene))
    cut = (result.proposal or result).adapted
    before = cut.arc_length[-1] - cut.arc_length
    assert cut.length < 3.0 and cut.speeds[-1] == 0.0
    assert (cut.speeds[(before > 0.3) & (before < 0.7)] < 0.45).all() and np.allclose(cut.speeds[before > 1.1], 0.5)


def test_a_zone_that_is_stated_is_measured_from_the_surface():
    path = Trajectory(np.column_stack([np.linspace(0.0, 4.0, 81), np.zeros(81), np.full(81, 0.2)]), np.full(81, 0.5))
    carton = SceneObject("carton", [2.0, 0.4, 0.2], [0.8, 0.4, 0.4])
    result = adapt(Request("within 30 cm of the carton at most 0.1 m/s", path, Scene((carton,))))
    slow = (result.proposal or result).adapted.speeds <= 0.1 + 1e-9
    assert np.array_equal(slow, carton.cuboid.depth(path.positions) <= 0.3) and 'of="surface"' in result.code
