"""The node that adapts paths: what it answers to good and to bad messages, whatever carries them."""

import json

import numpy as np
import pytest

pytest.importorskip("rosbags")

from ovita.io.bags import bag_maker
from ovita.io.messages import build
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.serve.ros import PathNode

MAKER = bag_maker()
LINE = Trajectory(np.column_stack([np.linspace(0, 2, 30), np.zeros(30), np.ones(30)]), np.full(30, 0.5))


def path(trajectory=LINE, frame_id="map"):
    return build("path", trajectory, MAKER, frame_id=frame_id, start=10**18)[0]


def node(**given):
    made = PathNode(**given)
    assert made.take_path(path())["status"] == "ready"
    return made


def test_it_adapts():
    status, result = node().take_words(json.dumps({"instruction": "go left by 0.2", "id": "7"}))
    assert status["id"] == "7" and status["status"] == "done" and status["published"]
    assert result.adapted.positions[:, 1] == pytest.approx(0.2)
    assert status["changes"]
    json.dumps(status)


def test_feedback_and_undo():
    ours = node()
    ours.take_words("go left by 0.2")
    _, more = ours.take_words("a bit more")
    assert more.adapted.positions[:, 1].mean() > 0.2
    _, back = ours.undo()
    assert back.adapted.positions[:, 1] == pytest.approx(0.2)
    _, first = ours.undo()
    assert first.adapted.positions[:, 1] == pytest.approx(0)
    assert ours.undo()[0]["message"] == "there is nothing to undo"


def test_a_reading_is_offered_and_not_taken():
    ours = node(scene=(Scene((SceneObject("red cup", [1, 0.5, 1]),)), False))
    said = "go left by 0.2 and dance"
    offered, nothing = ours.take_words(said)
    assert offered["status"] == "needs_confirmation" and nothing is None and not offered["published"]
    assert offered["proposal"]["accept"] == "say yes" and offered["proposal"]["plan"]
    status, taken = ours.take_words("yes")
    assert taken is not None and status["published"]
    ours.take_words(said)
    assert ours.take_words("no")[1] is None or ours.session.current == taken.adapted
    assert "nothing waits for a yes" in ours.accept()[0]["message"]


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda m: m.poses.clear(), "has no waypoint"),
        (lambda m: setattr(m.poses[3].pose.position, "x", float("nan")), "not a finite number"),
        (lambda m: setattr(m.header, "frame_id", "camera_optical_frame"), "transform it to one frame"),
        (lambda m: setattr(m.poses[4].header, "frame_id", "odom"), "transform it to one frame"),
    ],
)
def test_bad_paths_are_statuses(spoil, said):
    ours, message = node(), path()
    spoil(message)
    status = ours.take_path(message)
    assert status["status"] == "error" and said in status["message"]
    assert "there is no path yet" in ours.take_words("go up by 0.1")[0]["message"]
    assert ours.take_path(path())["status"] == "ready"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("", "the instruction is empty"),
        ("x" * 5000, "has 5000 characters"),
        ("{", "this is not JSON"),
        ("[" * 10_000, "characters"),
        ('{"instruction": 5}', "say {"),
        ('{"instruction": "go up", "run": 1}', "say {"),
        ('{"instruction": "go up by 0.1", "on": "that"}', '"on" is'),
    ],
)
def test_bad_words_are_statuses(words, said):
    status, result = node().take_words(words)
    assert result is None and status["status"] == "error" and said in status["message"]


def test_what_is_not_understood_changes_nothing():
    status, result = node().take_words("frobnicate the flux")
    assert result is None and not status["published"] and status["status"] not in ("done", "error")


def test_a_failure_inside_is_a_status(monkeypatch, capsys):
    ours = node()
    monkeypatch.setattr(type(ours.session), "say", lambda *a, **k: 1 / 0)
    status, result = ours.take_words("go up by 0.1")
    assert result is None and status["message"].startswith("this failed inside ovita (ZeroDivisionError)")
    assert "ZeroDivisionError" in capsys.readouterr().err


def test_what_the_gate_refuses_is_not_published():
    post = Scene((SceneObject("post", [1, 0.2, 1], [0.4, 0.4, 2]),))
    status, result = node(scene=(post, False), robot=Robot("fast", max_speed=1.0)).take_words("go left by 0.2")
    assert status["verified"] and status["published"] == (not status["refusals"]) == (result is not None)
    status, result = node(robot=Robot("slow", max_speed=0.1)).take_words("go left by 0.2")
    assert status["verified"] and status["published"] == (not status["refusals"]) == (result is not None)
    shapeless = node(robot=Robot("still", max_speed=None)).take_words("go left by 0.2")
    assert shapeless[1] is None and shapeless[0]["refusals"]
