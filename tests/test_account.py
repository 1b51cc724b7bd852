"""What a path is like in sentences, and the answer to a question about it."""

import numpy as np
import pytest

import ovita as ov
from ovita.measure import account
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.request import Request
from ovita.writers.base import Reply, WriterInfo

POSITIONS = np.array([[0.0, 0.0, 0.2], [0.5, 0.0, 0.6], [1.0, 0.0, 0.2]])
PATH = Trajectory(POSITIONS, np.array([0.1, 0.2, 0.1]))
SCENE = Scene((SceneObject("cup", [0.5, 0.3, 0.6]), SceneObject("box", [0.25, 0.0, 0.0], dimensions=[0.1, 0.1, 0.2])))


def test_length_time_speed_and_height_are_told():
    told = " ".join(account(PATH, SCENE))
    assert "1.28 m long" in told and f"takes {PATH.duration:.2f} s" in told
    assert "0.10 to 0.20 m/s (fastest at waypoint 2)" in told
    assert "height is 0.20 to 0.60 m (highest at waypoint 2)" in told


def test_what_was_asked_about_is_told_and_else_what_is_nearest():
    *_, cup = account(PATH, SCENE, ["cup"])
    assert cup.startswith("The cup: the path comes within 30.0 cm of its centre") and "0.60 m high" in cup
    *_, nearest = account(PATH, SCENE)
    assert nearest.startswith("The box: ") and "of its surface" in nearest


def test_a_path_through_an_object_and_a_level_one():
    level = Trajectory([[0.0, 0.0, 0.05], [0.5, 0.0, 0.05]], np.array([0.1, 0.1]))
    told = account(level, SCENE, ["box"])
    assert "height is 0.05 m throughout" in told[1]
    assert "goes through it" in told[2]
    assert len(account(level, Scene(()))) == 2


def test_a_thin_object_between_waypoints_far_apart_is_seen_and_up_is_that_of_the_frame():
    across = Trajectory([[0.0, 0.0, -1.0], [9.0, 0.0, -2.0]], np.array([1.0, 1.0]))
    post = SceneObject("TV post", [4.5678, 0.0, -1.5], dimensions=[0.001, 1.0, 1.0])
    told = account(across, Scene((post,), Frame("ned")))
    assert told[1] == "Its height is 1.00 to 2.00 m (highest at waypoint 2)."
    assert told[2].startswith("The TV post: the path goes through it, after 4.6")


def test_an_answer_changes_nothing_and_says_so():
    class Answering:
        name = "answering"

        def write(self, prompt):
            return Reply("answer", answer="It takes 8 s.", writer=WriterInfo("builtin"))

    result = ov.adapt(Request("how long does it take?", PATH, SCENE), writer=Answering())
    assert (result.status, result.message, result.usable) == ("answered", "It takes 8 s.", False)
    assert np.array_equal(result.adapted.positions, PATH.positions)
    assert ov.Adaptation.from_document(result.to_document()).message == "It takes 8 s."


QUESTIONS = (
    "How long does it take?",
    "How close does it get to the cup?",
    "Is it going over the box?",
    "what's the top speed?",
)


@pytest.mark.parametrize("question", QUESTIONS)
def test_the_built_in_writer_answers_questions_about_the_path(question):
    result = ov.adapt(Request(question, PATH, SCENE), writer="builtin")
    assert result.status == "answered" and f"takes {PATH.duration:.2f} s" in result.message
    assert np.array_equal(result.adapted.to_array(), PATH.to_array())


def test_a_question_in_a_conversation_is_about_the_path_as_it_is_now():
    session = ov.Session(PATH, SCENE, writer="builtin")
    session.say("go up by 0.1")
    told = session.say("How high is the highest point now?")
    assert told.status == "answered" and "0.30 to 0.70 m" in told.message
    assert session.say("a bit more").status == "done"  # is about the turn before the question
    assert "go up" in session.say("why did you do that?").message
