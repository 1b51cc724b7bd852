"""What is said as one and is two turns, what answers a question, and what "there", "the rest" and a zone are."""

import json

import numpy as np
import pytest

from ovita.dialogue.session import Session
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory

S = np.linspace(0.0, 1.0, 61)
PATH = Trajectory(np.column_stack([4.0 * S - 2.0, 0.3 * np.sin(3.0 * S), 0.6 + 0.0 * S]), np.full(61, 0.4))
THINGS = Scene(
    (
        SceneObject("piano", np.array([-1.0, 0.7, 0.5]), [0.6, 0.3, 1.0]),
        SceneObject("table", np.array([1.0, -0.6, 0.4]), [0.6, 0.6, 0.8]),
    )
)


def talk(*said):
    session = Session(PATH, THINGS, writer="builtin")
    results = [session.say(text) for text in said]
    return session, results[-1]


def speed_at(session, name):
    path = session.current
    return path.speeds[int(np.linalg.norm(path.positions - THINGS[name].position, axis=1).argmin())]


@pytest.mark.parametrize(
    "said", ["make it 10 cm, and slow down near the table", "10 cm. And at most 0.2 m/s near the table"]
)
def test_a_correction_and_a_further_wish_go_and_come_back_as_one(said):
    session, _ = talk("5 cm to the left", said)
    assert np.allclose(session.current.positions[:, 0], PATH.positions[:, 0] - 0.1)
    assert speed_at(session, "table") == pytest.approx(0.2, abs=0.01)
    after = session.current
    assert session.say("undo").status == "done"
    assert np.allclose(session.current.positions[:, 0], PATH.positions[:, 0] - 0.05)
    assert session.redo() and np.array_equal(session.current.to_array(), after.to_array())


@pytest.mark.parametrize("said", ["undo that, and go up by 10 cm", "Take that back and go 10 cm up."])
def test_a_step_back_and_what_to_do_instead_are_two_turns_that_come_back_as_one(said):
    session, result = talk("5 cm to the left", said)
    assert result.status == "done" and len(session.steps) == 1
    assert np.allclose(session.current.positions - PATH.positions, [0, 0, 0.1])


def test_what_is_dropped_and_what_to_do_instead_come_back_as_one():
    session, result = talk("5 cm to the left and slow down near the piano", "scrap the shift, just go up by 10 cm")
    after = session.current
    assert result.status == "done" and np.allclose(after.positions - PATH.positions, [0, 0, 0.1])
    assert session.undo() and np.allclose(session.current.positions - PATH.positions, [-0.05, 0, 0])
    assert session.redo() and np.array_equal(session.current.to_array(), after.to_array())


def test_nothing_is_split_off_that_is_not_understood():
    session, result = talk("5 cm to the left", "make it 10 cm, and fly to the lamp and dance")
    assert result.status != "done" or len(session.steps) == 1


def test_a_first_half_that_fails_is_told():
    session = Session(PATH, THINGS, "jackal", writer="builtin")
    session.say("5 cm to the left")
    result = session.say("make it 100 m, and slow down near the table")
    assert result.status == "not_as_meant" and any("100.000 m without" in text for text in result.warnings)


@pytest.mark.parametrize(
    "said",
    [
        "it is too near the wall",
        "the waypoints are too close together",
        "it is too close for comfort",
        "the rest was good, thanks",
    ],
)
def test_what_is_said_of_something_else_is_not_of_the_last_thing(said):
    session, _ = talk("slower near the piano", said)
    assert THINGS["piano"].distance(session.current.positions).min() == pytest.approx(
        THINGS["piano"].distance(PATH.positions).min(), abs=1e-3
    )


def test_what_was_said_as_one_is_taken_back_as_one_after_it_was_saved(tmp_path):
    session, _ = talk("5 cm to the left", "make it 10 cm, and slow down near the table")
    session.save(str(tmp_path / "talk.json"))
    again = Session.load(str(tmp_path / "talk.json"), writer="builtin")
    assert np.allclose(again.current.positions[:, 0], PATH.positions[:, 0] - 0.1)
    assert again.undo() and np.allclose(again.current.positions[:, 0], PATH.positions[:, 0] - 0.05)


@pytest.mark.parametrize("said", ["no, closer", "not the piano, the table", "a bit more, please"])
def test_a_correction_stays_one_turn(said):
    session, _ = talk("go 10 cm farther from the piano", said)
    steps = len(session.steps)
    session.say("undo")
    assert steps == 2 and session.adaptation is session.steps[0].adaptation


@pytest.mark.parametrize(
    ("said", "answer", "moved"), [("Move it by 10 cm.", "to the right", 0.1), ("shift it by 12 cm", "up", 0.12)]
)
def test_an_answer_keeps_the_amount_of_what_was_asked_about(said, answer, moved):
    session, result = talk(said, answer)
    assert result.status == "done"
    assert np.abs(session.current.positions - PATH.positions).max() == pytest.approx(moved)


def test_one_of_two_places_is_left_out():
    session, result = talk("at most 0.2 m/s near the piano and the table", "Not at the piano.")
    assert result.status == "done"
    assert speed_at(session, "piano") == pytest.approx(0.4) and speed_at(session, "table") == pytest.approx(0.2)


def test_the_rest_of_the_way_is_what_was_not_said_before():
    session, _ = talk("half speed in the first quarter", "and the rest of the way a little bit faster")
    assert session.current.speeds[5] == pytest.approx(0.2) and session.current.speeds[-5] > 0.45


@pytest.mark.parametrize("said", ["make the zone 0.9 m", "within 0.9 m", "make it 0.9 metres around each"])
def test_a_zone_gets_the_size_that_is_said(said):
    _, result = talk("slower near the piano and the table", said)
    assert {p.value for p in result.parameters if p.role == "radius"} == {0.9}


def test_both_bounds_stand_where_both_are_said():
    session, _ = talk("at least 0.2 m/s", "make that 0.3, and limit the max to 0.35")
    assert session.current.speeds.min() >= 0.3 - 1e-6 and session.current.speeds.max() <= 0.35 + 1e-6


def test_too_close_is_to_what_was_just_said():
    session, result = talk("slower near the piano", "still too fast, and it's a bit too close as well")
    before = THINGS["piano"].distance(PATH.positions).min()
    assert result.status == "done" and THINGS["piano"].distance(session.current.positions).min() > before + 0.01
    assert speed_at(session, "piano") < 0.2


def test_a_second_half_that_waited_for_a_yes_in_a_saved_session_is_taken_back_with_the_first(tmp_path):
    session, result = talk("5 cm to the left", "slow down near the table if nobody is there")
    assert result.status == "needs_confirmation"
    file = tmp_path / "talk.json"
    session.save(str(file))
    document = json.loads(file.read_text())
    document["events"][-1]["same_utterance"] = True
    file.write_text(json.dumps(document))
    again = Session.load(str(file), writer="builtin")
    again.accept()
    assert len(again.steps) == 2 and again.undo() and not again.steps


def test_another_thing_for_a_stretch_between_two_takes_the_place_of_one():
    session, result = talk("one height between the piano and the table", "I meant the table, not the piano")
    assert result.status and len(session.current) == len(PATH)


@pytest.mark.parametrize(
    "said",
    [
        "keep the ends where they were",
        "but the start and goal should not move",
        "Start and end must stay at their original points though",
    ],
)
def test_both_ends_are_put_back_where_both_are_named(said):
    session, result = talk("5 cm to the left", said)
    after = session.current.positions
    assert result.status == "done" and np.allclose(after[[0, -1]], PATH.positions[[0, -1]])
    assert (np.abs(after - PATH.positions).max() > 0.04).all()
