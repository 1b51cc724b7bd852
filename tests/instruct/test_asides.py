"""What people say besides what they want is left out, and what they want is not."""

import pytest

from ovita import Scene, SceneObject
from ovita.instruct.asides import without_asides

SCENE = Scene((SceneObject("cup", [0, 0, 0], [0.1, 0.1, 0.1]), SceneObject("vase", [1, 0, 0], [0.1, 0.1, 0.1])))


@pytest.mark.parametrize(
    ("said", "left"),
    [
        ("Keep more to the right. The stretchers come through on the left.", "Keep more to the right."),
        ("I've got an elderly group today, so everything a bit slower", "everything a bit slower"),
        ("skip the cup, I already did it by hand", "skip the cup"),
        ("slow down at the vase, I don't want it knocked over", "slow down at the vase"),
        ("Nobody can work there. At most half a metre a second.", "At most half a metre a second."),
    ],
)
def test_reasons_and_stories_are_left_out(said, left):
    assert without_asides(said, SCENE, first=True) == left


@pytest.mark.parametrize(
    "said",
    [
        "I want it higher",
        "The cup is hot. Keep away from it.",  # what is pointed at stays
        "she should go slower near the cup",
        "the vase is too close, go farther from it",
        "I'm talking twenty feet minimum",
        "He's in the way.",  # nothing else is said
        "so high that it clears the cup",
        "go left by 10 cm, then up",
    ],
)
def test_wishes_stay(said):
    assert without_asides(said, SCENE, first=True) == said


def test_feedback_tells_of_what_came_out():
    assert without_asides("The sign is wrong. Go right.", SCENE, first=False) == "The sign is wrong. Go right."
    assert without_asides("Good. And slower there, she's sleeping.", SCENE, first=False) == "And slower there."
