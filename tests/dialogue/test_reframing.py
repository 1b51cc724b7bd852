"""Feedback on turns that keep their frames: what it does to the path, the history and the saved session."""

from dataclasses import dataclass

import numpy as np
import pytest

from ovita.dialogue.session import Session
from ovita.instruct.frames import with_selection
from ovita.instruct.meaning import same
from ovita.instruct.notation import parse, show
from ovita.paths.part import PathPart
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.writers.generate import reply_for

N = 41
PATH = Trajectory.from_array(np.column_stack([np.zeros(N), np.linspace(0, 2, N), np.full(N, 0.3), np.full(N, 0.4)]))
SCENE = Scene((SceneObject("cup", [0.4, 0.5, 0.3]), SceneObject("bottle", [0.4, 1.5, 0.3])))


@dataclass(frozen=True)
class NotationWriter:
    """Reads instructions in the notation of frames."""

    name: str = "notation"

    def write(self, prompt):
        request = prompt.request
        return reply_for(parse(request.instruction, request.scene.names), request)


@pytest.fixture
def session():
    return Session(PATH, SCENE, writer=NotationWriter())


def frames(session):
    return show(session.adaptation.frames)


@pytest.mark.parametrize(
    ("first", "said", "wanted"),
    [
        ("move left=20cm", "a bit more", "move left=25cm"),
        ("move left=20cm", "hmm more like 10 cm", "move left=10cm"),
        ("move left=20cm", "the other way", "move right=20cm"),
        ("move left", "half of that", "move left=0.12m"),
        ("pace slower @near=cup", "I meant the bottle", "pace slower @near=bottle"),
        ("move left=20cm; pace slower", "leave the speed out", "move left=20cm"),
        ("wait at=cup for=2s", "make that 5 seconds", "wait at=cup for=5s"),
        ("circle cup radius=10cm", "bigger", "circle cup radius=15cm"),
    ],
)
def test_the_last_turn_is_realised_again_from_where_it_began(session, first, said, wanted):
    session.say(first)
    result = session.say(said)
    assert result.usable, result.message
    assert same(result.frames, parse(wanted, SCENE.names)), frames(session)
    assert result.original == PATH and result.taken.startswith(f"took '{said}' as: ")


def test_a_bit_more_says_what_it_turned(session):
    session.say("move left=0.2m")
    result = session.say("a bit more")
    assert result.taken == "took 'a bit more' as: left 0.2 m -> 0.25 m (shift to the left)"
    assert session.current.positions[0, 0] == pytest.approx(-0.25)
    assert (
        session.steps[-1].kind == "knobs" and session.undo() and session.current.positions[0, 0] == pytest.approx(-0.2)
    )


def test_what_was_turned_by_hand_is_what_more_is_more_of(session, tmp_path):
    session.say("move left=0.2m; pace slower @near=cup")
    session.tune({"left": 0.4, "slowdown": 0.8})
    assert same(session.adaptation.frames, parse("move left=0.4m; pace set to=0.8x @near=cup", SCENE.names))
    session.save(str(tmp_path / "s.json"))
    again = Session.load(str(tmp_path / "s.json"), writer=NotationWriter())
    assert again.adaptation == session.adaptation
    again.say("no shift")
    assert same(again.adaptation.frames, parse("pace set to=0.8x @near=cup", SCENE.names))


def test_an_earlier_turn_is_meant_where_the_words_fit_it_better(session):
    session.say("pace slower by=50% @near=cup")
    session.say("move left=0.2m")
    result = session.say("undo the speed")
    assert result.usable and same(result.frames, parse("move left=0.2m"))
    assert session.current.speeds[10] == pytest.approx(0.4) and session.steps[-1].feedback_on == "original"


def test_what_is_said_of_an_earlier_and_of_the_last_turn_changes_both(session):
    session.say("move left=0.2m")
    session.say("move up=0.1m")
    session.say("a bit more to the left")
    assert same(session.adaptation.frames, parse("move left=0.25m; move up=0.1m"))


def test_feedback_on_the_original_realises_all_frames_again(session):
    session.say("move left=0.2m")
    session.say("move up=0.1m")
    result = session.say("twice that", on="original")
    assert result.original == PATH and same(result.frames, parse("move left=0.2m; move up=0.2m"))
    assert session.current.positions[0] == pytest.approx([-0.2, 0, 0.5])


def test_which_of_two_changes_is_asked_and_answered(session):
    session.say("move left=0.2m; pace slower @near=cup")
    asked = session.say("a bit more")
    assert asked.status == "needs_clarification" and "left" in asked.question and "slowdown" in asked.question
    session.say("the shift")
    assert session.current.positions[0, 0] == pytest.approx(-0.25)


def test_again_undo_and_why(session):
    session.say("move left=0.2m")
    session.say("again")
    assert session.current.positions[0, 0] == pytest.approx(-0.4)
    why = session.say("why did you do that?")
    assert "What was done" in why.message and len(session.steps) == 2
    session.say("undo the last two")
    assert session.current == PATH
    assert session.say("bring it back").status == "done" and len(session.steps) == 1


def test_here_is_the_part_that_was_marked(session):
    session.say("move left=0.2m")
    marked = PathPart("indices", ranges=((0, 9),), count=N)
    frame = parse("move left=0.2m @selection")[0]
    assert with_selection((frame,), marked)[0].part == marked
