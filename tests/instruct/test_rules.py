"""The rules reader: sentences to frames, by the table."""

import numpy as np
import pytest

from ovita.instruct.frames import same
from ovita.instruct.notation import parse, show
from ovita.instruct.rules import read
from ovita.paths.scene import Scene, SceneObject

NAMES = ("cup", "box", "lamp")
SCENE = Scene(tuple(SceneObject(name, np.array([i, 1.0, 0.5])) for i, name in enumerate(NAMES)))


@pytest.mark.parametrize(
    ("sentence", "notation"),
    [
        ("left 20 cm", "move left=20cm"),
        ("move it 5 cm up and 10 left", "move up=5cm left=10cm"),
        ("spd -20%", "pace slower by=20%"),
        ("clr >= 80 mm cup", "clearance cup at_least=80mm"),
        ("wp 5-15: L 2 cm", "move left=2cm @range=5-15"),
        ("z += 0.05", "move up=0.05m"),
        ("not so close to the lamp, please", "farther lamp"),
        ("come no nearer than 30 cm to the lamp", "clearance lamp at_least=30cm"),
        ("the goal further from the cup, 10 cm", "end goal away=cup by=10cm"),
        ("never higher than 80 cm", "height at_most=80cm"),
        ("go left, no, right, 4 cm", "move right=4cm"),
        ("wait 3 s at the box, then go faster", "wait at=box for=3s; pace faster @after=box"),
        ("everywhere except near the cup, 20 % faster", "pace faster by=20% @!near=cup"),
        ("twice around the box, clockwise", "circle box turns=2 cw"),
        ("keep the start, move the rest up 2 cm", "keep start; move up=2cm"),
        ("slow down in the turns", "pace turns"),
        ("slower near the cup because it is hot", "pace slower @near=cup"),
    ],
)
def test_a_sentence_becomes_its_frames(sentence, notation):
    reading = read(sentence, SCENE)
    assert same(reading.frames, parse(notation, NAMES)), show(reading.frames)
    assert not (reading.unread or reading.question or reading.improper)


@pytest.mark.parametrize(
    "sentence", ["keep away from the piano", "polish the cup", "shift by 5 cm", "who won the game"]
)
def test_what_cannot_be_done_is_not_read_as_done(sentence):
    reading = read(sentence, SCENE)
    assert reading.unread or reading.question or reading.improper or not reading.frames


@pytest.mark.parametrize(
    "sentence",
    [
        "go faster and slower",
        "at least 30 cm from the cup and at most 10 cm from the cup",
        "speed at least 2 m/s, at most 1 m/s",
    ],
)
def test_what_excludes_itself_is_improper(sentence):
    assert read(sentence, SCENE).improper
