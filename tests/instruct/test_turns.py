"""Turns of phrase stand in files: each compiles, and says the same in plain words."""

import re

import pytest

from ovita import Scene, SceneObject
from ovita.instruct.idioms import MEANT, plainer, turns

SCENE = Scene(
    tuple(
        SceneObject(name, [i, 0, 0], [0.1, 0.1, 0.1])
        for i, name in enumerate(("cup", "hen", "panel 1", "panel 2", "panel 3"))
    )
)


@pytest.mark.parametrize("turn", [*turns("plain"), *turns("things")], ids=lambda turn: turn.said[:40])
def test_every_turn_of_phrase_compiles_and_knows_its_groups(turn):
    groups = set(turn.pattern.groupindex)
    assert {name for name in re.findall(r"\\g<(\w+)>", turn.meant)} <= groups
    assert not turn.meant.startswith("@") or turn.meant[1:] in MEANT
    assert not turn.said.startswith(("[^", ".")), "it would be tried from every letter on: cubic in the length"
    assert "{" not in re.sub(r"\{\d+(,\d+)?\}|\{THING\}", "", turn.said)


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("lift it there, then come back to the original height before the end", "lift it there"),
        ("take half the time for the first ten waypoints", "go twice as fast for the first ten waypoints"),
        ("nothing over half a metre a second", "go at most half a metre a second"),
        ("have it quit two feet before where it stops now", "have it stop two feet earlier"),
        ("speed that bit up", "speed up that bit"),
        ("leave the first and last quarters", "leave the first quarter and the last quarter"),
        ("at 0.4 m/s, but near the cup at half of that", "at 0.4 m/s, but near the cup at 0.2 m/s"),
        ("the stop at the cup is too long, half of that will do", "wait half as long at the cup"),
        ("come home faster", "on the way back go faster"),
        ("forget about the stop at the cup", "make no stop at the cup"),
        ("pass over the cup about 10 cm higher", "near the cup go 10 cm higher"),
        ("slower at panels 1 to 3", "slower at panel 1 and panel 2 and panel 3"),
        ("bit more, another 5 cm", "5 cm more"),
        ("that's a bit short", "that is a bit too short"),
        ("bit faster then, to make up the time", "a bit faster then"),
        ("z floor 1.0 m", "never lower than 1.0 m"),
        ("but don't move the start", "but keep the start"),
        ("the end must not move", "keep the end"),
        ("fly up to the hen", "go to the hen"),
    ],
)
def test_it_is_put_in_plain_words(said, meant):
    assert plainer(said, SCENE) == meant


@pytest.mark.parametrize(
    "said",
    [
        "go to the cup",
        "come back to the cup",
        "pass the hen on its left",
        "another lap around the hen",
        "stop at the cup",
    ],
)
def test_what_is_plain_stays(said):
    assert plainer(said, SCENE) == said
