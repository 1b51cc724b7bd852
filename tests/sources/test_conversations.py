"""A conversation about a scene without a trajectory: the first sentence makes one, in the chat and the studio."""

import json

import pytest
from click.testing import CliRunner

from ovita.cli.main import cli
from ovita.dialogue.session import Session
from ovita.sources.words import begun, restated
from ovita.studio.files import open_file
from ovita.studio.html import suggestions
from ovita.studio.sessions import SessionController

OBJECTS = [
    {"name": "box", "x": 0.3, "y": -0.3, "z": 0.05, "dimensions": [0.12, 0.1, 0.1]},
    {"name": "plate", "x": 0.3, "y": 0.3, "z": 0.01, "dimensions": [0.22, 0.22, 0.02]},
    {"name": "bottle", "x": 0.3, "y": 0.0, "z": 0.13, "dimensions": [0.07, 0.07, 0.26]},
]


@pytest.fixture
def scene(tmp_path):
    file = tmp_path / "scene.json"
    file.write_text(json.dumps({"objects": OBJECTS, "robot": "arm"}))
    return file


def test_the_chat_plans_the_first_sentence_and_adapts_the_next(scene, tmp_path):
    said = f"go to the plate\nthe box\nslower near the bottle\n/save {tmp_path / 'out.json'}\n/quit\n"
    done = CliRunner().invoke(cli, ["chat", str(scene), "--writer", "builtin"], input=said)
    assert done.exit_code == 0, done.output
    assert "no trajectory yet" in done.output and "Where does it start?" in done.output
    assert "Plan the way from above the box to above the plate" in done.output
    saved = json.loads((tmp_path / "out.json").read_text())
    assert saved["status"] == "done" and saved["instruction"] == "slower near the bottle"


@pytest.mark.parametrize(
    ("before", "answer", "whole"),
    [
        ("go to the plate", "the box", "go to the plate, from the box"),
        ("from the box, slowly", "the plate", "from the box, slowly, to the plate"),
        ("go to the plate.", "from the box", "go to the plate, from the box"),
        ("go to the plate", "no, from the plate to the box", "no, from the plate to the box"),
        ("", "from the box to the plate", "from the box to the plate"),
    ],
)
def test_an_answer_completes_the_sentence_that_was_asked_about(scene, before, answer, whole):
    assert restated(before, answer, open_file(str(scene), nothing()).session.scene) == whole


def nothing():
    from ovita.paths.trajectory import standing_still

    return Session(standing_still(), writer="builtin")


def test_the_studio_plans_in_a_scene_without_a_trajectory(scene, tmp_path):
    opened = open_file(str(scene), nothing())
    assert opened.session.bare and any("from where to where" in note for note in opened.notes)
    assert suggestions(opened.session.current, opened.session.scene)[0] == "From the box to the plate, slowly"
    journal = tmp_path / "journal.jsonl"
    opened.session.keep(str(journal))
    desk = SessionController(opened.session)
    desk.say("go to the plate", "current").join()
    assert desk.said.question.startswith("Where does it start?") and desk.session.bare
    desk.answer("the box").join()
    session = desk.session
    assert not session.bare and session.adaptation.status == "done" and len(session.original) == 60
    assert session.adaptation.plan[0].startswith("Plan the way from above the box")
    desk.say("slower near the bottle", "current").join()
    assert [step.said for step in session.steps] == ["go to the plate, from the box", "slower near the bottle"]
    again = Session.resume(str(journal), writer="builtin")
    assert len(again.steps) == 2 and again.original == session.original


def test_what_cannot_be_planned_is_said_and_the_session_waits(scene):
    session = open_file(str(scene), nothing()).session
    result = begun(session, "from the box to 9, 0, 0")
    assert result.status == "infeasible" and "outside the workspace" in result.explanation and session.bare
