"""Programs of one's own as baselines: one line of JSON in, one out."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest

from ovita.baselines import adapted_by, baseline_named
from ovita.errors import RequestError, WriterError
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.request import Request

PROGRAM = Path(__file__).parent / "stand_in.py"
REQUEST = Request(
    "go up", Trajectory([[0, 0, 0], [1, 0, 0.5]], [0.2, 0.3]), Scene((SceneObject("cup", [0.0, 1.0, 0.0]),))
)


@pytest.fixture
def program(request):
    """A function from a mode to the stand-in as a baseline, ended after the test."""
    made = []

    def start(mode, timeout=60.0):
        made.append(baseline_named(f"exec:{sys.executable} '{PROGRAM}' {mode}", timeout=timeout))
        return made[-1]

    yield start
    for item in made:
        item.close()


def test_a_program_answers_with_a_trajectory_and_what_it_matched(program):
    got = program("lift").deform(REQUEST)
    assert got.trajectory.to_array() == pytest.approx(np.array([[0, 0, 0.1, 0.2], [1, 0, 0.6, 0.3]]))
    assert (got.matched, got.similarity) == ("go up|rfu|['cup']", 0.5)


def test_a_program_that_reads_on_is_started_once(program):
    one = program("process")
    assert len({one.deform(REQUEST).matched for _ in range(3)}) == 1


def test_a_program_that_ends_after_an_answer_is_started_again(program):
    one = program("once")
    assert [one.deform(REQUEST).similarity for _ in range(3)] == [0.5] * 3


def test_a_program_that_is_closed_is_gone(program):
    one = program("process")
    pid = int(one.deform(REQUEST).matched)
    one.close()
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_a_program_that_ended_is_not_killed_again_by_its_number(program, monkeypatch):
    one = program("crash")
    killed = []
    monkeypatch.setattr(os, "killpg", lambda *numbers: killed.append(numbers))
    with pytest.raises(WriterError):
        one.deform(REQUEST)
    one.close()
    assert killed == []


@pytest.mark.parametrize(
    ("mode", "problem"),
    [
        ("crash", "ended with exit code 3 and no answer: OSError: no weights in model/latte.h5"),
        (
            "chatter",
            "answered 'DONE - computing textual embeddings (1, 768)', which is no JSON; print",
        ),
        ("list", "answered JSON that is no object; write one with the key trajectory"),
        ("error", "says: more than 6 objects"),
        ("rows", "answered no trajectory: "),
        ("word", "answered the similarity 'high', which is no number"),
    ],
)
def test_what_a_program_does_wrong_is_one_sentence(program, mode, problem):
    one = program(mode)
    with pytest.raises(WriterError) as failure:
        one.deform(REQUEST)
    assert str(failure.value).startswith(one.name) and problem in str(failure.value)
    assert "\n" not in str(failure.value) and not failure.value.unreached
    result = adapted_by(one, REQUEST)
    assert (result.status, result.adapted) == ("failed", REQUEST.trajectory) and problem in result.error


def test_a_program_that_takes_too_long_is_ended(program):
    one = program("hang", timeout=0.3)
    with pytest.raises(WriterError, match=r"gave no answer within 0\.3 s$"):
        one.deform(REQUEST)
    assert one._running is None


def test_a_command_that_cannot_be_started_was_never_reached():
    with pytest.raises(WriterError, match="cannot be started: No such file") as failure:
        baseline_named("exec:/no/such/program").deform(REQUEST)
    assert failure.value.unreached
    with pytest.raises(RequestError, match="exec: names no command"):
        baseline_named("exec:")
    with pytest.raises(RequestError, match="cannot be read: No closing quotation"):
        baseline_named("exec:python 'x")
