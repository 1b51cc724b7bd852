"""Self-repair: what is taken back is not read, and what stays keeps its place."""

import pytest

from ovita import Scene, SceneObject
from ovita.instruct.meaning import same
from ovita.instruct.notation import parse, show
from ovita.instruct.understanding import understand
from ovita.sources.selfrepair import repaired

SCENE = Scene((SceneObject("cup", [0.3, 0.3, 0.1], [0.1] * 3), SceneObject("vase", [0.9, 0.1, 0.1], [0.1] * 3)))


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("slow it by a third, no, half near the cup", "pace slower by=50% @near=cup"),
        ("shift it right three inches, no, wait, five", "move right=5in"),
        ("closer to the vase, sorry, the cup, by 4 cm", "closer cup by=4cm"),
        ("down 6 cm. No. 9.", "move down=9cm"),
        ("go back by two, no four, centimetres", "move back=4cm"),
        ("port two, correction, port three feet", "move left=3ft"),
        ("forward a bit, I mean backward a bit", "move back deg=slight"),
        ("10 cm to the left, I mean 12 cm", "move left=12cm"),
        ("go left, no, right, 4 cm", "move right=4cm"),
        ("go left 3 cm, no, right 5", "move right=5cm"),
        ("move 3 inches left, no, 5", "move left=5in"),
        ("wait 3 seconds, no, 5 seconds, at the cup", "wait at=cup for=5s"),
    ],
)
def test_what_is_corrected_is_read(said, meant):
    verdict = understand(said, SCENE)
    assert same(verdict.reading.frames, parse(meant, SCENE.names)), show(verdict.reading.frames)
    assert verdict.outcome in ("do", "needs_confirmation")


@pytest.mark.parametrize(
    "said",
    [
        "go up, no higher than 30 cm",
        "0.2 m/s near the cup, no more no less",
        "stay away from the cup, I mean it",
        "go left by 5 cm and right by 3 cm near the vase",
        "no, left by 5 cm",
        "",
    ],
)
def test_what_is_not_taken_back_stays(said):
    assert repaired(said, SCENE) == said


def test_words_keep_their_places():
    text = "closer to the cup by 5 cm, sorry, the vase, and go up"
    assert repaired(text, SCENE).find("and go up") == text.find("and go up")


@pytest.mark.parametrize("said", ["", ".", "no", "I mean", "no, no, 5", "wait"])
def test_next_to_nothing_is_read_without_an_error(said):
    assert understand(said, SCENE).outcome in ("ask", "decline", "needs_confirmation", "do")


def test_an_order_that_is_taken_back_is_not_done():
    assert "stop at" not in show(understand("stop at the cup, no, don't stop", SCENE).reading.frames)
