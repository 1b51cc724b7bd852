"""Sessions: feedback on original and current, undo, redo, knobs."""

import numpy as np
import pytest

from ovita.dialogue.session import Session
from ovita.errors import PolicyError, RequestError
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.writers.base import Reply

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


def test_a_later_turn_that_loses_what_an_earlier_one_asked_says_so_and_keeps_it_on_request(session):
    session.say("stay at least 0.6 away from the cup")
    moved = session.say("go forward by 0.2")
    assert moved.status == "done" and len(moved.lost) == 1, moved.message
    assert moved.lost[0].turns_ago == 1 and "cup" in moved.lost[0].outcome
    assert "one turn ago" in moved.message and "keep it" in moved.message
    again = session.say("yes, keep it")
    assert again.status == "done" and not again.lost, again.message
    assert session.scene["cup"].distance(session.current.positions).min() >= 0.59
    assert len(session.steps) == 3 and session.undo() and session.adaptation.lost == moved.lost


def test_what_a_later_turn_asks_for_itself_is_not_lost(session):
    session.say("stay at least 0.6 away from the cup")
    assert not session.say("go closer to the cup by 0.1").lost
    session.say("slow down near the cup")
    assert not session.say("move at a constant speed of 0.3").lost


def test_a_speed_bound_or_a_side_that_a_later_turn_breaks_is_lost():
    policies = (
        "expect_speed(at_most=0.3); return bound_speed(traj, at_most=0.3)",
        "expect_side('up', at_most=0.5); return bound(traj, up=0.5)",
        "expect_faster(); return scale_speed(traj, 2)",
        "expect_moved(up=1.0); return move(traj, up=1.0)",
    )
    answers = [Reply("policy", code=f"def adapt(traj, scene):\n    {body}\n") for body in policies]

    class Scripted:
        name = "scripted"

        def write(self, prompt):
            return answers.pop(0)

    session = Session(PATH, Scene(), writer=Scripted())
    results = [session.say(words) for words in ("cap it", "keep low", "be quick", "rise")]
    assert [[loss.text for loss in result.lost] for result in results] == [
        [],
        [],
        ["the speed is at most 0.3 m/s"],
        ["the path stays at most 0.5 m above the ground"],
    ]


def test_an_end_that_was_to_stay_is_brought_back(session):
    session.say("keep the start where it is and go up by 0.1")
    moved = session.say("go left by 0.1")
    assert [loss.text for loss in moved.lost] == ["the start stays where it was"]
    session.say("keep it")
    assert session.current.positions[0] == pytest.approx([0, 0, 0], abs=1e-9)
    assert session.current.positions[-1] == pytest.approx([0.9, 0, 0.1])


def test_a_loss_is_told_by_the_history_two_turns_later_and_survives_a_file(session, tmp_path):
    session.say("stay at least 0.6 away from the cup")
    session.say("slow down in the second half")
    moved = session.say("go forward by 0.2")
    assert moved.lost[0].turns_ago == 2 and "2 turns ago" in moved.message
    session.save(str(tmp_path / "s.json"))
    assert Session.load(str(tmp_path / "s.json")).adaptation == moved


def test_changed_limits_and_hand_edits_are_not_words_that_the_original_is_adapted_to(session):
    session.change("limits: drone", robot=Robot.preset("drone"))
    session.change("moved the cup", scene=Scene((SceneObject("cup", [0.5, 0.35, 0.4]),)))
    session.say("go left by 0.1", on="original")
    result = session.say("go up by 0.05", on="original")
    assert result.usable and result.instruction == "go left by 0.1. go up by 0.05"


def test_what_one_turn_is_to_touch_is_no_obstacle_in_the_next(session):
    session.say("end at the cup")
    end = session.current.positions[-1]
    smoother = session.say("make the path smoother")
    assert smoother.contacts == ("cup",) and session.current.positions[-1] == pytest.approx(end, abs=1e-9)


def test_a_change_of_the_limits_or_by_hand_says_what_earlier_turns_lose(session):
    session.say("stay at least 0.6 away from the cup")
    session.say("slow down in the second half")
    box = Robot(name="box", workspace=Box((-1, -0.05, -1), (2, 1, 1)), max_speed=None)
    tighter = session.change("limits: box", robot=box)
    assert [loss.instruction for loss in tighter.lost] == ["stay at least 0.6 away from the cup"], tighter.message
    assert tighter.lost[0].turns_ago == 1
    assert session.undo() and not session.adaptation.lost
    moved = Scene((SceneObject("cup", [0.5, 0.0, 0.4]),))
    assert not session.change("moved cup", scene=moved).lost  # the turn runs again and keeps its distance there


def test_what_a_knob_is_stays_with_it_when_it_is_turned_saved_or_the_code_is_edited(tmp_path):
    scene = Scene((SceneObject("[red] cup", [0.5, 0.3, 0.4]),))
    session = Session(PATH, scene, writer="builtin")
    session.say("go closer to the cup by 0.1 and slow down to 50 % near the cup")

    def known():
        return {p.name: (p.unit, p.role, p.about, p.direction) for p in session.adaptation.parameters}

    first = known()
    assert first["closer_by"] == ("m", "by", "[red] cup", "closer")
    assert first["slowdown"] == ("", "factor", "", "slower")
    assert {p.meaning for p in session.adaptation.parameters} >= {"how much closer to [red] cup"}
    session.tune({"closer_by": 0.2})
    assert known() == first
    session.save(str(tmp_path / "session.json"))
    session = Session.load(str(tmp_path / "session.json"), writer="builtin")
    assert known() == first
    session.recode(session.adaptation.code.replace("# factor on the speed", "# my own"))
    assert known() == {**first, "slowdown": ("", None, "", "")}
