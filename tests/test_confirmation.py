"""A reading that is not certain: it is shown, and done only once a person agrees."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from ovita import accept
from ovita.chain import adapt, another
from ovita.cli.main import cli
from ovita.dialogue.postconditions import answered
from ovita.dialogue.session import Session
from ovita.errors import FormatError, RequestError
from ovita.gate import review
from ovita.instruct.notation import parse
from ovita.io import load_task
from ovita.paths.part import PathPart
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.request import Request
from ovita.result import Adaptation
from ovita.writers.base import Reply, WriterChain, WriterInfo
from ovita.writers.generate import BuiltinWriter, reply_for

PATH = Trajectory(np.column_stack([np.linspace(0, 1, 30), np.zeros((30, 2))]), np.full(30, 0.4))
SCENE = Scene((SceneObject("cup", [0.5, 0.3, 0.0]),))
CODE = """def adapt(traj, scene, *,
    right=0.05,  # [m] shift to the right
):
    {then}return move(traj, right=right)
"""
SAID = "right 5 cm, feed 0.7"


def proposes(*, then="expect_moved(right=right)\n    ", doubts=("The speed is not certain.",), **kwargs):
    return Reply(
        "policy",
        plan=("Shift the whole path 0.05 m to the right.", "Multiply the speed by 0.7."),
        code=CODE.format(then=then),
        unplaced=("feed",),
        confirm=True,
        doubts=doubts,
        writer=WriterInfo("builtin"),
        **kwargs,
    )


class Unsure:
    """Proposes what the built-in writer would not be sure of; the rest goes to the built-in writer."""

    name = "builtin"

    def write(self, prompt):
        return proposes() if "feed" in prompt.request.instruction else BuiltinWriter().write(prompt)


@pytest.fixture
def unsure():
    return adapt(Request(SAID, PATH, SCENE), writer=Unsure())


def right(result):
    return float((result.adapted.positions - result.original.positions)[0, 0])


def test_the_reading_is_shown_and_nothing_is_done(unsure):
    assert unsure.status == "needs_confirmation" and not unsure.usable
    assert unsure.adapted == unsure.original == PATH and unsure.unplaced == ("feed",)
    assert unsure.message == (
        "I understood: shift the whole path 0.05 m to the right; multiply the speed by 0.7. "
        "The start and the goal would move 0.05 m right. Not used: 'feed'. The speed is not certain."
    )
    assert unsure.proposal is not None and unsure.proposal.status == "done"
    assert right(unsure.proposal) == pytest.approx(0.05)
    assert "Nothing is done about 'feed'." in unsure.proposal.assumptions


def test_a_document_holds_the_whole_proposal(unsure, tmp_path):
    document = unsure.to_document()
    assert document["status"] == "needs_confirmation" and document["adapted"] == document["original"]
    assert Adaptation.from_document(document["proposal"]) == unsure.proposal
    unsure.save(str(tmp_path / "r.json"))
    assert accept(Adaptation.load(str(tmp_path / "r.json"))) == unsure.proposal
    said = " ".join(review(str(tmp_path / "r.json")).refusals)
    assert "needs_confirmation" in said and "--accept" in said
    task = load_task(str(tmp_path / "r.json"))
    assert task.trajectory == PATH, "going on from it goes on from what there is"


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"proposal": None}, "proposal"),
        ({"status": "done"}, "proposal"),
        ({"proposal": {}}, "proposal.writer"),
    ],
)
def test_a_document_without_its_proposal_is_refused(unsure, change, key):
    with pytest.raises(FormatError, match=key):
        Adaptation.from_document({**unsure.to_document(), **change})


def test_documents_of_before_there_were_proposals_are_read():
    document = adapt(Request("go left by 0.1", PATH, SCENE), writer="builtin").to_document()
    del document["proposal"]
    assert Adaptation.from_document(document).proposal is None


def test_only_a_proposal_can_be_accepted(unsure):
    with pytest.raises(RequestError, match="'done'"):
        accept(accept(unsure))


def test_how_it_would_come_out_is_said():
    slow = Robot.preset("none")
    broken = proposes(then="expect_moved(left=0.3)\n    ", doubts=())

    class Writer:
        name = "w"

        def write(self, prompt):
            return broken

    result = adapt(Request(SAID, PATH, SCENE, slow), writer=Writer(), repairs=0)
    assert result.status == "needs_confirmation" and result.proposal.status == "not_as_meant"
    assert result.message.endswith("It would not come out as meant.")


def test_a_model_that_is_certain_is_preferred_and_one_that_fails_is_not():
    class Model:
        name = "model"

        def __init__(self, reply):
            self.reply, self.prompts = reply, []

        def write(self, prompt):
            self.prompts.append(prompt)
            return self.reply

    certain = Model(
        Reply(
            "policy",
            plan=("Up.",),
            code="def adapt(traj, scene):\n    expect_moved(up=0.1)\n    return move(traj, up=0.1)\n",
        )
    )
    done = adapt(Request(SAID, PATH, SCENE), writer=WriterChain((Unsure(), certain), "line"))
    assert done.status == "done" and done.adapted.positions[0, 2] == pytest.approx(0.1)
    assert 'Not understood: "feed"' in certain.prompts[0].situation
    asks = Model(Reply("question", question="Which one?"))
    shown = adapt(Request(SAID, PATH, SCENE), writer=WriterChain((Unsure(), asks), "line"))
    assert shown.status == "needs_confirmation"
    assert shown.writer.tried == ("builtin: asks whether it is meant without 'feed'", "model: asks: Which one?")


# The command line


@pytest.fixture
def run(monkeypatch, tmp_path):
    """Runs `ovita adapt` in this process with the unsure writer."""
    scene = {"trajectory": [[0, 0, 0, 0.4], [1, 0, 0, 0.4]], "objects": [{"name": "cup", "x": 0.5, "y": 0.3, "z": 0}]}
    (tmp_path / "scene.json").write_text(json.dumps(scene))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("ovita.cli.common.writer_from", lambda *a, **k: Unsure())

    def call(*arguments, answer="", terminal=False):
        monkeypatch.setattr("ovita.cli.adapt_._on_a_terminal", lambda: terminal)
        return CliRunner().invoke(cli, ["adapt", *arguments], input=answer)

    return call


def test_without_a_terminal_it_exits_3_with_the_proposal_in_the_file(run):
    done = run("scene.json", SAID, "--out", "r.json")
    assert done.exit_code == 3 and "I understood" in done.output and "0.05 m" in done.output
    assert "ovita adapt r.json --accept" in done.output
    taken = run("r.json", "--accept", "--out", "s.json", "--trajectory", "s.csv")
    assert taken.exit_code == 0, taken.output
    assert Adaptation.load("s.json").status == "done" and Path("s.csv").read_text().startswith("x,y,z")


@pytest.mark.parametrize(
    ("answer", "code", "status"),
    [("y\n", 0, "done"), ("n\n", 3, "needs_confirmation"), ("\n", 3, "needs_confirmation")],
)
def test_a_terminal_asks(run, answer, code, status):
    done = run("scene.json", SAID, "--out", "r.json", answer=answer, terminal=True)
    assert done.exit_code == code and "Do this? [y/N]" in done.output
    assert Adaptation.load("r.json").status == status


def test_accept_asks_nothing_and_json_never_asks(run):
    assert run("scene.json", SAID, "--accept").exit_code == 0
    shown = run("scene.json", SAID, "--json", terminal=True)
    assert shown.exit_code == 3 and json.loads(shown.output)["status"] == "needs_confirmation"


def test_accepting_changes_nothing_else(run):
    run("scene.json", SAID, "--out", "r.json")
    assert run("r.json", "--accept", "--writer", "builtin").exit_code == 0
    refused = run("r.json", "--accept", "--robot", "drone")
    assert isinstance(refused.exception, RequestError) and "--robot" in str(refused.exception)
    run("scene.json", "go up by 0.1", "--out", "done.json")
    refused = run("done.json", "--accept")
    assert isinstance(refused.exception, RequestError) and "no proposal" in str(refused.exception)


def test_explain_and_plot_speak_of_the_proposal(run, tmp_path):
    run("scene.json", SAID, "--out", "r.json")
    told = CliRunner().invoke(cli, ["explain", "r.json", "--code"])
    assert "I understood" in told.output and "not done yet" in told.output and "def adapt" in told.output
    drawn = CliRunner().invoke(cli, ["plot", "r.json", "--out", "r.svg"])
    assert drawn.exit_code == 0 and (tmp_path / "r.svg").exists()


# The conversation


@pytest.mark.parametrize(
    ("said", "agrees", "rest"),
    [
        ("yes", True, ""),
        ("Yes, please!", True, ""),
        ("ok.", True, ""),
        ("no", False, ""),
        ("never mind", False, ""),
        ("no, 10 cm", False, "10 cm"),
        ("no 10 cm", False, "10 cm"),
        ("yes, but slower", True, "but slower"),
        ("No - the other way", False, "the other way"),
        ("10 cm", None, "10 cm"),
        ("no faster than 0.3", None, "no faster than 0.3"),
        ("right by 10 cm", None, "right by 10 cm"),
        ("okay go up by 0.1", None, "okay go up by 0.1"),
    ],
)
def test_what_agrees_and_what_does_not(said, agrees, rest):
    assert answered(said) == (agrees, rest)


@pytest.fixture
def session():
    talk = Session(PATH, SCENE, writer=Unsure())
    assert talk.say(SAID).status == "needs_confirmation"
    assert talk.pending is not None and not talk.steps and talk.current == PATH
    return talk


def test_yes_does_it_and_undo_takes_it_back(session):
    assert session.say("yes").status == "done"
    assert session.pending is None and [step.said for step in session.steps] == [SAID]
    assert session.current.positions[:, 0] == pytest.approx(PATH.positions[:, 0] + 0.05)
    assert session.undo() and session.current == PATH


def test_no_forgets_it(session):
    assert session.say("no").message == "Nothing changed."
    assert session.pending is None and not session.steps
    with pytest.raises(RequestError, match="nothing waits"):
        session.accept()


@pytest.mark.parametrize("said", ["no, 10 cm", "10 cm", "make it 10 cm"])
def test_no_with_a_correction_does_the_corrected(session, said):
    assert session.say(said).status == "done"
    assert session.current.positions[:, 0] == pytest.approx(PATH.positions[:, 0] + 0.1)
    assert len(session.steps) == 1 and session.undo() and session.current == PATH


def test_another_instruction_leaves_it_behind(session):
    assert session.say("no, go up by 0.2").status == "done"
    assert session.current.positions[0] == pytest.approx([0, 0, 0.2]) and session.pending is None


def test_yes_and_more_does_both(session):
    assert session.say("yes, and go up by 0.2").status == "done"
    assert session.current.positions[0] == pytest.approx([0.05, 0, 0.2])


def test_what_is_not_understood_keeps_it_open(session):
    assert session.say("moonwalk").status == "not_understood"
    assert session.say("yes").status == "done"


def test_a_draft_carries_it(session):
    draft = session.draft()
    draft.say("yes")
    session.adopt(draft)
    assert session.pending is None and len(session.steps) == 1


def test_a_saved_proposal_goes_on_in_a_session(unsure):
    talk = Session.of(unsure, writer="builtin")
    assert talk.pending == unsure and not talk.steps
    assert talk.say("yes").status == "done" and len(talk.steps) == 1


class Wrong:
    """Proposes to go right, whatever is said."""

    name = "builtin"

    def write(self, prompt):
        frames = parse("move right=5cm")
        return replace(reply_for(frames, prompt.request), confirm=True)


@pytest.fixture
def misread():
    talk = Session(PATH, SCENE, writer=Wrong())
    assert "to the right" in talk.say("slow down near the cup").message
    return talk


def test_after_a_no_another_reading_waits(misread):
    other = misread.say("no")
    assert other.status == "needs_confirmation" and misread.pending == other and misread.current == PATH
    assert other.explanation.startswith("Then perhaps otherwise. I understood: multiply the speed by")
    assert misread.say("yes").status == "done"
    assert [step.said for step in misread.steps] == ["slow down near the cup"]
    assert misread.current.speeds.min() < 0.39 and misread.undo() and misread.current == PATH


def test_another_reading_is_shown_only_once(misread):
    misread.say("no")
    assert misread.say("no").message == "Nothing changed." and misread.pending is None


def test_what_a_marked_part_is_about_has_no_other_reading():
    talk = Session(PATH, SCENE, writer=Wrong())
    talk.say("slower here", selection=PathPart("first", amount=0.5, unit="share"))
    assert talk.say("no").message == "Nothing changed."


@pytest.mark.parametrize("said", ["never mind", "cancel", "no thanks"])
def test_who_ends_the_matter_is_asked_nothing_more(misread, said):
    assert misread.say(said).message == "Nothing changed." and misread.pending is None


def test_there_is_no_other_reading_of_what_a_model_wrote(unsure):
    misread = adapt(Request("slow down near the cup", PATH, SCENE), writer=Wrong())
    assert another([misread]) is not None and another([unsure]) is None, "that one was not made of frames"
    assert another([replace(misread, writer=replace(misread.writer, kind="llm"))]) is None


@pytest.mark.parametrize(("answer", "code", "status"), [("n\ny\n", 0, "done"), ("n\nn\n", 3, "needs_confirmation")])
def test_a_terminal_shows_another_reading(run, monkeypatch, answer, code, status):
    monkeypatch.setattr("ovita.cli.common.writer_from", lambda *a, **k: Wrong())
    done = run("scene.json", "slow down near the cup", "--out", "r.json", answer=answer, terminal=True)
    assert done.exit_code == code and "Then perhaps otherwise." in done.output
    assert Adaptation.load("r.json").status == status


def test_a_hand_edit_ends_it(session):
    session.change("other limits", robot=Robot.preset("drone"))
    assert session.pending is None


def test_another_reading_is_run_as_isolated_as_the_first(run, monkeypatch):
    asked = []
    monkeypatch.setattr("ovita.cli.common.writer_from", lambda *a, **k: Wrong())
    monkeypatch.setattr("ovita.cli.adapt_.another", lambda refused, **how: asked.append(how))
    run("scene.json", "slow down near the cup", "--isolation", "degraded", answer="n\n", terminal=True)
    assert asked == [{"isolation": "degraded"}]


def test_words_that_told_the_way_too_have_no_other_reading():
    standing = Trajectory(np.zeros((2, 3)), np.zeros(2))
    talk = Session(standing, SCENE, writer="builtin")
    talk.begin(adapt(Request("slow down near the cup", PATH, SCENE), writer=Wrong()))
    assert talk.pending is not None and talk.say("no").message == "Nothing changed."
