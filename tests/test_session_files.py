"""Sessions that branch, change by hand, and survive on disk."""

import json

import numpy as np
import pytest

from ovita.dialogue.history import ROOT
from ovita.dialogue.session import Session
from ovita.errors import FormatError, PolicyError, RequestError
from ovita.io.files import Journal
from ovita.limits import ConstraintOptions
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory

PATH = Trajectory.from_array(np.column_stack([np.linspace(0, 1, 20), np.zeros((20, 2)), np.full(20, 0.4)]))
CUP = SceneObject("cup", [0.5, 0.3, 0.0])


@pytest.fixture
def session():
    return Session(PATH, Scene((CUP,)), writer="builtin")


def offset(session):
    return session.current.positions[0] - PATH.positions[0]


def slowest(session):
    return float(session.current.positions[np.argmin(session.current.speeds), 0])


def moved(cup_x):
    return Scene((SceneObject("cup", [cup_x, 0.3, 0.0]),))


def same(a, b):
    assert [s.said for s in a.steps] == [s.said for s in b.steps]
    assert a.history.parents == b.history.parents and a.history.head == b.history.head
    assert a.current == b.current and a.original == b.original and a.robot == b.robot
    assert a.constraints == b.constraints and a.scene.objects == b.scene.objects
    assert [s.kind for s in a.history.steps] == [s.kind for s in b.history.steps]


def test_any_turn_can_be_gone_on_from_and_nothing_is_lost(session):
    session.say("go left by 0.1")
    session.say("go up by 0.2")
    session.branch(0)
    assert offset(session) == pytest.approx([-0.1, 0, 0])
    session.say("go down by 0.3")
    assert offset(session) == pytest.approx([-0.1, 0, -0.3])
    session.branch(1)
    assert offset(session) == pytest.approx([-0.1, 0, 0.2])
    assert [s.said for s in session.steps] == ["go left by 0.1", "go up by 0.2"]
    session.branch(ROOT)
    assert session.current == PATH and len(session.history.steps) == 3
    with pytest.raises(RequestError, match="no turn 9"):
        session.branch(8)


def test_a_moved_object_runs_every_policy_again(session):
    session.say("go left by 0.1")
    session.say("slow down near the cup")
    before = slowest(session)
    session.change("moved the cup", scene=moved(0.9))
    assert slowest(session) > before + 0.1
    assert offset(session) == pytest.approx([-0.1, 0, 0])
    assert session.steps[-1].kind == "hand"
    session.undo()
    assert slowest(session) == before and session.scene.objects == (CUP,)
    session.redo()
    assert session.scene["cup"].position[0] == 0.9


def test_limits_are_a_turn_too_and_pins_are_kept(session):
    session.say("go left by 0.4")
    tight = Robot(max_speed=0.2)
    session.change("limits: 0.2 m/s", robot=tight, constraints=ConstraintOptions(pinned=(3,)))
    assert session.current.speeds.max() == pytest.approx(0.2) and session.constraints.pinned == (3,)
    assert session.undo() and session.constraints.pinned == () and session.robot == Robot.preset("none")


def test_a_hand_edit_before_anything_was_said(session):
    session.change("moved the cup", scene=moved(0.2))
    assert session.current == PATH and session.steps[-1].adaptation.scene["cup"].position[0] == 0.2
    session.say("slow down near the cup")
    assert session.current.speeds.min() < 0.3 and session.current.speeds[-1] == pytest.approx(0.4)


def test_moving_the_goal_moves_what_the_policy_starts_from(session):
    session.say("go left by 0.1")
    longer = PATH.with_(positions=PATH.positions * [1.5, 1, 1])
    session.change("moved the goal", original=longer)
    assert session.current.positions[-1] == pytest.approx([1.4, 0, 0])


def test_code_is_edited_in_the_sandbox(session):
    session.say("go left by 0.1")
    code = "def adapt(traj, scene, *, up=0.3):\n    return move(traj, up=up)\n"
    session.recode(code)
    assert offset(session) == pytest.approx([0, 0, 0.3])
    session.tune({"up": 0.5})
    assert offset(session) == pytest.approx([0, 0, 0.5])
    with pytest.raises(PolicyError, match="line 2"):
        session.recode("def adapt(traj, scene):\n    return open('/etc/passwd')\n")
    assert offset(session) == pytest.approx([0, 0, 0.5])


def test_a_dragged_knob_is_one_turn(session):
    session.say("go left by 0.1 and slow down near the cup")
    for value in np.linspace(0.1, 0.4, 7):
        session.tune({"left": float(value)}, merge=True)
    assert len(session.steps) == 2 and offset(session) == pytest.approx([-0.4, 0, 0])
    assert len(session.adaptation.plan) <= len(session.steps[0].adaptation.plan) + 1
    session.tune({"slowdown": 0.9}, merge=True)
    assert len(session.steps) == 3
    session.undo()
    session.undo()
    assert offset(session) == pytest.approx([-0.1, 0, 0])


def test_a_knob_that_is_turned_back_is_not_told(session):
    session.say("go left by 0.2")
    plan = session.adaptation.plan
    session.tune({"left": 0.3}, merge=True)
    session.tune({"left": 0.2}, merge=True)
    assert session.adaptation.plan == plan and len(session.steps) == 2


def test_a_draft_counts_only_when_it_is_adopted(session):
    session.say("go left by 0.1")
    given_up, kept = session.draft(), session.draft()
    given_up.say("go up by 1")
    kept.say("go up by 0.2")
    assert offset(session) == pytest.approx([-0.1, 0, 0])
    session.adopt(kept)
    assert offset(session) == pytest.approx([-0.1, 0, 0.2])
    with pytest.raises(RequestError, match="gone on"):
        session.adopt(given_up)


def busy(session):
    session.say("go left by 0.1")
    session.say("slow down near the cup")
    session.tune({"slowdown": 0.7}, merge=True)
    session.tune({"slowdown": 0.8}, merge=True)
    session.settle()
    session.tune({"slowdown": 0.9}, merge=True)
    session.undo()
    session.change("moved the cup", scene=moved(0.8), constraints=ConstraintOptions(fix_goal=True))
    session.branch(0)


def test_save_and_load(session, tmp_path):
    busy(session)
    file = str(tmp_path / "mine.session.json")
    session.save(file)
    again = Session.load(file, writer="builtin")
    same(session, again)
    assert again.redo() and again.redo() and again.scene["cup"].position[0] == 0.8


def test_a_journal_gives_the_session_back(session, tmp_path):
    file = str(tmp_path / "journal.jsonl")
    session.keep(file)
    busy(session)
    again = Session.resume(file, writer="builtin")
    same(session, again)
    again.say("go up by 0.1")
    same(again, Session.resume(file))


def test_what_waits_for_a_yes_waits_for_it_in_the_journal_too(session, tmp_path):
    file = str(tmp_path / "journal.jsonl")
    session.keep(file)
    session.say("go up by 0.1")
    session.say("go slower near the cup if it is hot")
    assert session.pending is not None
    again = Session.resume(file, writer="builtin")
    assert again.pending is not None and again.pending.proposal is not None
    again.say("yes")
    assert len(again.steps) == 2 and again.pending is None
    third = Session.resume(file, writer="builtin")
    assert len(third.steps) == 2 and third.pending is None


def test_what_was_refused_waits_no_longer(session, tmp_path):
    file = str(tmp_path / "journal.jsonl")
    session.keep(file)
    session.say("go slower near the cup if it is hot")
    session.dismiss("leave it")
    assert session.pending is None and Session.resume(file, writer="builtin").pending is None


def test_an_adopted_turn_is_in_the_journal(session, tmp_path):
    session.keep(str(tmp_path / "j"))
    draft = session.draft()
    draft.say("go left by 0.1")
    session.adopt(draft)
    same(session, Session.resume(str(tmp_path / "j")))


def test_a_turn_that_was_cut_off_anywhere_is_gone_and_the_rest_is_there(session, tmp_path):
    file = tmp_path / "journal.jsonl"
    session.keep(str(file))
    session.say("go left by 0.1")
    whole = file.read_bytes()
    session.say("go up by 0.2")
    longer = file.read_bytes()
    for size in [len(whole), len(whole) + 1, (len(whole) + len(longer)) // 2, len(longer) - 1]:
        file.write_bytes(longer[:size])
        again = Session.resume(str(file), writer="builtin")
        assert [s.said for s in again.steps] == ["go left by 0.1"]
    again.say("go down by 0.1")
    assert [s.said for s in Session.resume(str(file)).steps] == ["go left by 0.1", "go down by 0.1"]


@pytest.mark.parametrize(
    "change",
    [
        lambda d: d.update(schema="other"),
        lambda d: d["events"].pop(0),
        lambda d: d["events"][1].update(at=7),
        lambda d: d["events"][1].update(kind="magic"),
        lambda d: d["events"][1].update(adaptation=None),
        lambda d: d["events"][1]["adaptation"].pop("code"),
        lambda d: d["events"][0]["situation"].pop("robot"),
        lambda d: d["events"][0]["situation"].update(original=[[1, 2]]),
        lambda d: d["events"][0]["situation"].update(constraints={"lambda_dev": -1}),
        lambda d: d.update(events=[1]),
    ],
)
def test_a_damaged_session_file_is_refused_in_a_sentence(session, tmp_path, change):
    session.say("go left by 0.1")
    file = tmp_path / "s.json"
    session.save(str(file))
    document = json.loads(file.read_text())
    change(document)
    file.write_text(json.dumps(document))
    with pytest.raises(FormatError) as error:
        Session.load(str(file))
    assert str(file) in str(error.value) and "\n" not in str(error.value)


def test_a_damaged_line_in_the_middle_of_a_journal_is_named(tmp_path):
    file = tmp_path / "j"
    file.write_bytes(b'{"a":1}\n{oops\n{"b":2}\n')
    with pytest.raises(FormatError, match="line 2"):
        Journal(file).read()


def test_a_saved_adaptation_is_gone_on_from_without_running_it(session):
    session.say("go left by 0.1")
    opened = Session.of(session.adaptation, writer="builtin")
    assert opened.current == session.current and opened.original == PATH
    opened.tune({"left": 0.3})
    assert offset(opened) == pytest.approx([-0.3, 0, 0])


def test_a_journal_of_many_gestures_shrinks_when_it_is_read(session, tmp_path):
    file = tmp_path / "journal.jsonl"
    session.keep(str(file))
    session.say("go left by 0.1")
    for value in np.linspace(0.1, 0.5, 12):
        session.tune({"left": float(value)}, merge=True)
        session.settle()
    size = file.stat().st_size
    again = Session.resume(str(file))
    same(session, again)
    assert file.stat().st_size < size / 2
    again.undo()
    same(again, Session.resume(str(file)))
