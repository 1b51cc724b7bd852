"""The learned reader: sentences of the tests' own making, determinism, and the same numbers as in training."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ovita.instruct.encoder import encode, layout, network
from ovita.instruct.learned import LearnedReader
from ovita.instruct.meaning import same
from ovita.instruct.notation import parse, show
from ovita.instruct.sketch import sketch
from ovita.instruct.transformer import softmax
from ovita.paths.scene import Scene, SceneObject

OBJECTS = ("cup", "box", "lamp")
SCENE = Scene(tuple(SceneObject(name, (0.3 * i, 0.2, 0.0)) for i, name in enumerate(OBJECTS)))
CHECK = Path(__file__).parent / "learned_check.npz"


@pytest.fixture(scope="module")
def reader():
    return LearnedReader()


@pytest.mark.parametrize(
    ("sentence", "reading"),
    [
        ("Keep at least 20 cm away from the cup.", "clearance cup at_least=20cm"),
        ("slow down near the lamp please", "pace slower @near=lamp"),
        ("Move the whole path 10 cm to the left.", "move left=10cm"),
        ("Raise the goal by 5 cm.", "end goal up=5cm"),
        ("go a bit closer to the box", "closer box deg=slight"),
        ("make it smoother", "smooth"),
        ("wait at the cup for 3 seconds", "wait at=cup for=3s"),
        ("stay further away from the lamp", "farther lamp"),
        ("pass between the cup and the box", "via between=cup+box"),
        ("speed up after the cup and slow down before the box", "pace faster @after=cup; pace slower @before=box"),
        ("at most 0.3 m/s near the box", "pace at_most=0.3m/s @near=box"),
        ("circle the box twice", "circle box turns=2"),
    ],
)
def test_reads_plain_sentences(reader, sentence, reading):
    found = reader.read(sentence, SCENE)
    assert same(found.frames, parse(reading, OBJECTS)), show(found.frames)


@pytest.mark.parametrize(
    ("said", "wanted"), [("a bit more", "scale more deg=slight"), ("make it 20 cm", "set by=20cm")]
)
def test_reads_feedback(reader, said, wanted):
    found = reader.read(said, SCENE, before=parse("farther cup by=10cm", OBJECTS))
    assert not found.frames
    assert show(found.edits).replace("0.2m", "20cm") == wanted


def test_is_deterministic_and_loaded_once(reader):
    one, other = (LearnedReader().read("go around the lamp, 12 cm out", SCENE) for _ in range(2))
    assert one == other
    assert network() is network() is reader.net


def test_nonsense_is_less_sure_than_a_request(reader):
    asked = reader.read("slow down near the lamp", SCENE)
    for nonsense in ("purple monkeys dream of nine violins", "what is the capital of France?"):
        found = reader.read(nonsense, SCENE)
        assert found.improper or found.question or found.confidence < asked.confidence - 0.2


def test_an_amount_that_was_not_used_caps_the_confidence(reader):
    found = reader.read("slow down near the lamp, 4711 km, 815 s, 99 degrees, 7 mph", SCENE)
    assert found.confidence <= 0.5


def test_numpy_and_torch_agree():
    with np.load(CHECK) as saved:
        for i, sentence in enumerate(saved["sentences"]):
            encoded = encode(sketch(str(sentence), SCENE_OF_CHECK, known=network().known), network().splitter)
            heads = network().read(encoded).heads
            for head, (a, b) in layout().items():
                assert heads[head] == pytest.approx(softmax(saved[f"heads{i}"][:, a:b]), abs=2e-3)


SCENE_OF_CHECK = Scene((SceneObject("cup", (0.0, 0.2, 0.0)), SceneObject("box", (0.3, -0.2, 0.0))))


def test_importing_loads_no_weights():
    code = "import ovita.instruct.learned, ovita.instruct.encoder as e; print(e.network.cache_info().currsize)"
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "0"
    )


@pytest.mark.parametrize(
    ("said", "speed"), [("no faster than 30 m/min near the cup", 0.5), ("at most 12 in/s near the cup", 0.3048)]
)
def test_a_rate_is_not_read_as_a_length(said, speed):
    (frame,) = LearnedReader().read(said, SCENE_OF_CHECK).frames
    assert frame.amount.value == pytest.approx(speed) and frame.amount.unit == "m/s"
