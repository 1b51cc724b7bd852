"""Sessions: feedback on original and current, undo, redo, knobs."""

import numpy as np
import pytest

from ovita.dialogue.session import Session
from ovita.errors import PolicyError, RequestError
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory

PATH = Trajectory.from_array(np.column_stack([np.linspace(0, 1, 20), np.zeros((20, 2)), np.full(20, 0.4)]))


@pytest.fixture
def session():
    return Session(PATH, Scene((SceneObject("cup", [0.5, 0.3, 0.4]),)), writer="builtin")


def offset(session):
    return session.current.positions[0] - PATH.positions[0]


def test_feedback_on_current_adds_up(session):
    session.say("go left by 0.1")
    session.say("go up by 0.2")
    assert offset(session) == pytest.approx([-0.1, 0, 0.2])
    assert [s.said for s in session.steps] == ["go left by 0.1", "go up by 0.2"]


def test_feedback_on_original_applies_everything_said_to_the_original(session):
    session.say("go left by 0.1")
    result = session.say("slow down near the cup", on="original")
    assert offset(session) == pytest.approx([-0.1, 0, 0])
    assert result.original == PATH and result.instruction == "go left by 0.1. slow down near the cup"
    assert session.current.speeds.min() == pytest.approx(0.2)


def test_undo_and_redo(session):
    assert not session.undo() and not session.redo()
    session.say("go left by 0.1")
    session.say("go left by 0.1")
    assert session.undo() and offset(session) == pytest.approx([-0.1, 0, 0])
    assert session.redo() and offset(session) == pytest.approx([-0.2, 0, 0])
    session.undo()
    session.say("go up by 0.1")
    assert not session.redo()


def test_what_is_not_understood_changes_nothing(session):
    session.say("go left by 0.1")
    assert session.say("moonwalk").status == "not_understood"
    assert len(session.steps) == 1 and offset(session) == pytest.approx([-0.1, 0, 0])
    with pytest.raises(RequestError, match="empty"):
        session.say(" ")


def test_knobs(session):
    with pytest.raises(RequestError, match="no policy yet"):
        session.tune({"left": 0.3})
    session.say("go left by 0.1")
    session.tune({"left": 0.3})
    assert offset(session) == pytest.approx([-0.3, 0, 0])
    with pytest.raises(PolicyError):
        session.tune({"sideways": 1})
    assert session.undo() and offset(session) == pytest.approx([-0.1, 0, 0])
