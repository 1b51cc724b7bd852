"""Stops that are denied: there is to be none there, and all else that is said is read as before."""

import pytest

from ovita import Scene, SceneObject
from ovita.instruct.meaning import same
from ovita.instruct.notation import parse, show
from ovita.instruct.understanding import understand

SCENE = Scene((SceneObject("cup", [0.3, 0.3, 0.1], [0.1] * 3), SceneObject("vase", [0.9, 0.1, 0.1], [0.1] * 3)))


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("no stops, please", "nonstop"),
        ("keep moving the whole time", "nonstop"),
        ("don't stop at the cup any more", "nonstop @near=cup"),
        ("no stopping till the vase", "nonstop @before=vase"),
        ("slow down near the cup, and don't stop there", "pace slower @near=cup; nonstop @near=cup"),
        ("10 cm farther from the cup, and don't stop near it", "farther cup by=10cm; nonstop @near=cup"),
        ("you dont need to wait at the cup any more", "nonstop @near=cup"),
        ("no need to stop at the cup", "nonstop @near=cup"),
        ("it doesn't have to stop at the cup", "nonstop @near=cup"),
        ("no more waiting at the cup", "nonstop @near=cup"),
    ],
)
def test_what_denies_a_stop_is_read_beside_the_rest(said, meant):
    verdict = understand(said, SCENE)
    assert same(verdict.reading.frames, parse(meant, SCENE.names)), show(verdict.reading.frames)
    assert verdict.outcome == "do"


@pytest.mark.parametrize(
    "said",
    [
        "stop at the cup and don't stop at the cup",
        "stop at the cup without ever stopping",
        "there is no stop at the cup, it should wait 5 seconds",
        "don't wait so long",
        "carry on to the vase, don't stop short",
        "no wait, the vase",
        "does it fly non-stop?",
        "will it pass the cup without stopping?",
    ],
)
def test_what_denies_no_stop_asks_for_none_to_go(said):
    found = understand(said, SCENE)
    assert found.outcome != "do" or "nonstop" not in show(found.reading.frames)


def test_a_stop_that_is_missed_is_not_taken_out_unasked():
    assert understand("why no stop at the cup?", SCENE).outcome != "do"


@pytest.mark.parametrize(
    "said", ["don't stop at the tap", "take the stop at the tap out", "remove the stop at the tap"]
)
def test_a_thing_whose_name_is_a_verb_is_a_thing_behind_an_article(said):
    scene = Scene((SceneObject("tap", [1.0, 0.2, 0.0], [0.1] * 3),))
    assert show(understand(said, scene).reading.frames) == "nonstop @near=tap"
