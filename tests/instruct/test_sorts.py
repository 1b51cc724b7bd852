"""Sorts of things: what a thing is called that its name does not say, and several of a sort."""

import pytest

from ovita import Scene, SceneObject
from ovita.instruct.lexicon import sorts_of
from ovita.instruct.meaning import same
from ovita.instruct.notation import parse, show
from ovita.instruct.understanding import understand


def scene_of(*names):
    return Scene(tuple(SceneObject(name, [0.3 * i, 0.3, 0.1], [0.1] * 3) for i, name in enumerate(names)))


def test_a_sort_of_a_sort_is_one_too_and_the_head_counts():
    assert {"dog", "animal"} <= sorts_of(["yorkshire", "terrier"])
    assert "dog" not in sorts_of(["terrier", "bed"])
    assert not sorts_of(["gizmo"])


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("keep further away from the dog", "farther Yorkshire_terrier"),
        ("slow down near the monkey", "pace slower @near=marmoset"),
        ("slow down near both animals", "pace slower @near=Yorkshire_terrier+marmoset"),
        ("wait 2 s at the light", "wait at=table_lamp for=2s"),
        ("slow near monkey", "pace slower @near=marmoset"),
    ],
)
def test_one_or_all_of_a_sort_are_meant_by_it(said, meant):
    scene = scene_of("Yorkshire terrier", "marmoset", "table lamp")
    verdict = understand(said, scene)
    assert same(verdict.reading.frames, parse(meant, scene.names)), show(verdict.reading.frames)
    assert verdict.outcome == "do"


def test_which_of_a_sort_is_asked_and_the_bigger_one_is_known():
    two = (SceneObject("collie", [0.3, 0.3, 0.1], [0.4] * 3), SceneObject("beagle", [0.9, 0.3, 0.1], [0.1] * 3))
    assert understand("keep further away from the dog", Scene(two)).reading.question
    assert show(understand("keep further away from the smaller dog", Scene(two)).reading.frames) == "farther beagle"


def test_a_thing_by_its_own_name_is_no_other_of_that_sort():
    scene = scene_of("light", "lamp")
    assert show(understand("slow down near the light", scene).reading.frames) == "pace slower @near=light"


def test_a_word_of_the_language_alone_is_no_sort():
    scene = scene_of("lamp", "cup")
    assert not any(frame.named for frame in understand("go higher in a light rain", scene).reading.frames)
