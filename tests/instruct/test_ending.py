"""Ends that come sooner or later: what says so is read apart, and the path is cut there, or goes on."""

import numpy as np
import pytest

from ovita import Scene, SceneObject, accept, adapt
from ovita.instruct.meaning import same
from ovita.instruct.notation import parse, show
from ovita.instruct.referee import understand
from ovita.paths.trajectory import Trajectory
from ovita.request import Request

X = np.linspace(0.0, 3.0, 13)
SPEEDS = np.full(13, 0.5)
SPEEDS[-3:] = 0.4, 0.2, 0.0
PATH = Trajectory(np.column_stack([X, np.zeros(13), np.full(13, 0.2)]), SPEEDS)
SCENE = Scene((SceneObject("cup", [1.5, 0.6, 0.1], [0.1] * 3),))


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("stop a metre earlier", "trim last=1m"),
        ("stop half a metre short of where you stop now", "trim last=0.5m"),
        ("finish 20 cm sooner", "trim last=20cm"),
        ("it should stop 10 cm before the goal", "trim last=10cm"),
        ("stop 10 cm further on", "extend by=10cm"),
        ("slower near the cup, and stop 20 cm earlier", "pace slower @near=cup; trim last=20cm"),
        ("stop 10 cm before the cup", "stop at=cup by=10cm"),
        ("I need it back 5 seconds sooner.", "pace faster by=5s"),
        ("arrive 2 seconds later", "pace slower by=2s"),
    ],
)
def test_an_end_that_comes_sooner_or_later(said, meant):
    verdict = understand(said, SCENE, PATH)
    assert same(verdict.reading.frames, parse(meant, SCENE.names)), show(verdict.reading.frames)
    assert verdict.outcome == "do"


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
    assert "trim" not in show(understand(said, SCENE, PATH).reading.frames)


def test_the_path_is_cut_between_waypoints_and_the_robot_comes_to_rest_as_before():
    result = adapt(Request("stop 60 cm earlier", PATH, SCENE))
    cut = result.adapted
    assert result.status == "done" and np.allclose(cut.positions[-1], [2.4, 0.0, 0.2])
    assert cut.speeds[-1] == 0.0 and 0.0 < cut.speeds[-2] < 0.5 and np.allclose(cut.speeds[:6], 0.5)


def test_an_end_at_a_building_is_beside_it_at_the_height_of_a_level_path():
    shed = SceneObject("shed", [5.0, 0.0, 1.0], [2.0, 2.0, 2.0])
    goal = adapt(Request("end at the shed", PATH, Scene((shed,)))).adapted.positions[-1]
    assert 3.0 < goal[0] < 4.0 and abs(goal[1]) < 1e-6 and np.isclose(goal[2], 0.2)


def test_a_few_metres_are_three_and_a_ramp_keeps_the_stops():
    assert same(understand("stop a few metres earlier", SCENE, PATH).reading.frames, parse("trim last=3m", ()))
    rows = np.insert(PATH.to_array(), 4, [[0.75, 0.0, 0.2, 0.0]] * 3, axis=0)
    path = Trajectory(rows[:, :3], rows[:, 3])
    result = adapt(Request("start slow, then get faster and faster", path, SCENE))
    result = accept(result) if result.proposal is not None else result
    assert (result.adapted.speeds[4:7] == 0.0).all()
