"""From where the goal is reached: what says so is read apart, and the path does it."""

import numpy as np
import pytest

from ovita import Scene, SceneObject, adapt
from ovita.instruct.meaning import same
from ovita.instruct.notation import parse, show
from ovita.instruct.understanding import understand
from ovita.paths.trajectory import Trajectory
from ovita.request import Request

T = np.linspace(0.0, 1.0, 41)
PATH = Trajectory(np.column_stack([2.0 * T - 1.0, 0.2 * np.sin(3.0 * T), np.full(41, 0.3)]), np.full(41, 0.4))
TRAY, CUP = (
    SceneObject("tray", PATH.positions[-1] - [0.0, 0.0, 0.15], [0.2, 0.2, 0.02]),
    SceneObject("cup", [-0.5, 0.5, 0.1], [0.1] * 3),
)
SCENE = Scene((TRAY, CUP))


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("come in from above", "arrive up"),
        ("approach the tray from above", "arrive up at=tray"),
        ("come in from higher up", "arrive up"),
        ("at the end descend vertically for the last 8 cm", "arrive up by=8cm"),
        ("approach the tray from above, final 30 mm", "arrive up at=tray by=30mm"),
        ("end at the cup, coming in from directly above", "end goal to=cup; arrive up"),
    ],
)
def test_what_says_from_where_the_goal_is_reached_is_read_beside_the_rest(said, meant):
    verdict = understand(said, SCENE, PATH)
    assert same(verdict.reading.frames, parse(meant, SCENE.names)), show(verdict.reading.frames)
    assert verdict.outcome in ("do", "needs_confirmation")


@pytest.mark.parametrize(
    "said",
    [
        "pass the cup from above",
        "move down 10 cm",
        "from above the cup please",
        "do not come in from above",
        "it should arrive not from above",
        "is it coming in from above?",
    ],
)
def test_what_is_passed_over_denied_or_asked_is_no_approach(said):
    found = understand(said, SCENE, PATH)
    assert found.outcome != "do" or "arrive" not in show(found.reading.frames)


def test_the_goal_is_reached_straight_from_above():
    result = adapt(Request("approach the tray from above over the last 20 cm", PATH, SCENE))
    path = result.adapted.positions
    last = path[path[:, 2] > 0.301]
    assert result.status == "done" and np.allclose(path[-1], PATH.positions[-1])
    assert np.isclose(path[:, 2].max(), 0.5) and np.allclose(last[np.argmax(last[:, 2]) :, :2], path[-1, :2])


def test_an_object_far_from_the_goal_is_asked_about():
    result = adapt(Request("approach the cup from above", PATH, SCENE))
    assert result.status == "needs_clarification" and "should it end there" in result.question
