"""Feedback in `ovita chat`, typed as a person types it, and in a session that was saved in between."""

import json

import numpy as np
import pytest

from command_line import ovita
from ovita.dialogue.session import Session
from ovita.io import load_task
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory

ROWS = [[0, y, 0.3, 0.4] for y in np.linspace(0, 2, 41)]
THINGS = {"cup": [0.4, 0.5, 0.3], "bottle": [0.4, 1.5, 0.3]}


def chat(folder, *lines):
    scene = {
        "trajectory": ROWS,
        "objects": [{"name": n, **dict(zip("xyz", at, strict=True))} for n, at in THINGS.items()],
    }
    path = folder / "scene.json"
    path.write_text(json.dumps(scene), encoding="utf-8")
    end = folder / "end.csv"
    typed = "\n".join([*lines, f"/save {end}", "/quit"]) + "\n"
    done = ovita("chat", path, "--writer", "builtin", stdin=typed)
    assert done.returncode == 0, done.stderr
    return done.stdout, load_task(str(end)).trajectory


def test_a_conversation_of_feedback(tmp_path):
    told, end = chat(
        tmp_path,
        "go left by 0.2 and slow down near the cup",
        "a bit more",
        "the shift",
        "I meant the bottle",
        "perfect, thanks",
        "slower still",
        "undo that",
        "/history",
    )
    assert "Which do you mean: left (shift to the left, now 0.2 m) or slowdown" in told
    assert "left 0.2 m -> 0.25 m" in told and "Took 'perfect, thanks' as: it is right as it is" in told
    assert "Took 'undo that' as: take the last turn back." in told
    assert "3. on current: I meant the bottle" in told and "4." not in told.split("1. on current")[-1]
    assert end.positions[0, 0] == pytest.approx(-0.25)
    assert end.speeds[[10, 30]] == pytest.approx([0.4, 0.2])


def test_original_keeps_turned_knobs_and_starting_over_ends_at_the_beginning(tmp_path):
    told, end = chat(tmp_path, "go left by 0.1", "/set left=0.3", "/original go up by 0.1", "/why")
    assert 'You asked: "go left by 0.1. go up by 0.1".' in told
    assert end.positions[0] == pytest.approx([-0.3, 0, 0.4])
    _, end = chat(tmp_path, "go left by 0.1", "twice that", "start over")
    assert end.positions[0] == pytest.approx([0, 0, 0.3])


def test_feedback_goes_on_after_a_session_was_saved(tmp_path):
    scene = Scene(tuple(SceneObject(name, at) for name, at in THINGS.items()))
    session = Session(Trajectory.from_array(ROWS), scene, writer="builtin")
    for said in ("slow down near the cup", "I meant the bottle", "a bit more"):
        session.say(said)
    session.save(str(tmp_path / "session.json"))
    again = Session.load(str(tmp_path / "session.json"), writer="builtin")
    assert [step.kind for step in again.steps] == ["said", "reworded", "knobs"]
    again.say("also near the cup")
    assert again.current.speeds[[10, 30]] == pytest.approx([0.152, 0.152])
    again.say("undo the last two")
    assert again.current.speeds[[10, 30]] == pytest.approx([0.4, 0.2])  # two steps, not two instructions


def test_an_objects_name_does_not_say_what_a_knob_does():
    path = Trajectory.from_array(np.column_stack([np.linspace(0, 1, 20), np.zeros((20, 2)), np.full(20, 0.4)]))
    session = Session(path, Scene((SceneObject("approach light", [0.5, 0.3, 0.4]),)), writer="builtin")
    session.say("go away from the approach light by 0.1")
    session.say("further away")
    assert session.adaptation.parameters[0].value > 0.1
