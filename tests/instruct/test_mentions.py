"""What a sentence mentions: things by a part of their name, amounts without a number, factors."""

import numpy as np
import pytest

from ovita.chain import adapt
from ovita.instruct.notation import show
from ovita.instruct.sketch import sketch
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.request import Request

PATH = Trajectory(np.column_stack([np.linspace(-1, 1, 41), np.zeros(41), np.full(41, 0.3)]), np.full(41, 0.4))


def scene_of(*names):
    return Scene(tuple(SceneObject(name, [k * 0.4 - 0.4, 0.3, 0.1], [0.1, 0.1, 0.2]) for k, name in enumerate(names)))


SCENE = scene_of("tile stack", "workbench", "spray cans")


def named(text, scene=SCENE):
    return [name for mention in sketch(text, scene).mentions for name in mention.items]


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("over the tiles", ["tile stack"]),
        ("along the bench", ["workbench"]),
        ("those cans", ["spray cans"]),
        ("on the line", []),
        ("over the top", []),
        ("the work is done", []),
        ("don't change a thing", []),
    ],
)
def test_a_part_of_a_name_names_the_one_thing_that_has_it(text, names):
    assert named(text) == names


def test_a_part_that_two_names_have_names_neither():
    assert named("past the house", scene_of("greenhouse", "warehouse")) == []


@pytest.mark.parametrize(
    ("text", "amounts"),
    [
        ("hold a minute at the bench", [(60.0, "s")]),
        ("at walking pace", [(1.4, "m/s")]),
        ("0.25 m a minute", [(0.25, "m")]),
        ("a metre", [(1.0, "m")]),
    ],
)
def test_amounts_without_a_number(text, amounts):
    assert [(m.value, m.unit) for m in sketch(text, SCENE).mentions if not m.is_object] == amounts


def test_things_without_a_name_in_letters_do_no_harm():
    assert named("over the bench", scene_of("42", "workbench")) == ["workbench"]


def said(text):
    return adapt(Request(text, PATH, SCENE), writer="builtin")


@pytest.mark.parametrize("text", ["leave the path as it is", "the bit near the bench is lovely, don't touch it"])
def test_what_is_to_stay_stays_and_that_is_done(text):
    result = said(text)
    shown = result.proposal or result
    assert shown.status == "done" and np.array_equal(shown.adapted.positions, PATH.positions)
    assert any(warning.startswith("Nothing had to change") for warning in shown.warnings)


def test_stop_it_at_a_place_is_no_denial():
    result = said("stop it at the workbench for ten seconds, then carry on")
    assert result.status == "done" and "Wait 10 s" in result.plan[0]


@pytest.mark.parametrize(
    "said",
    [
        "stop 20 cm before the jar and wait 5 seconds",
        "wait 20 cm before the jar for 5 s",
        "pause for 5 s 20 cm short of the jar, then go on",
    ],
)
def test_a_wait_short_of_a_thing_is_one_there(said):
    scene = Scene((SceneObject("jar", [0.6, 0.15, 0.3], [0.1, 0.1, 0.1]),))
    result = adapt(Request(said, PATH, scene))
    standing = result.adapted.positions[result.adapted.dwells]
    assert show(result.frames).startswith("wait at=jar by=") and result.status == "done"
    assert len(standing) == 50 and np.allclose(standing, [0.55 - 0.03**0.5, 0.0, 0.3], atol=0.001)
    assert np.allclose(result.adapted.positions[-1], PATH.positions[-1])


def test_a_halt_before_a_thing_is_a_little_short_of_it():
    scene = Scene((SceneObject("jar", [0.6, 0.15, 0.3], [0.1, 0.1, 0.1]),))
    result = adapt(Request("before you get to the jar, hold for 3 seconds", PATH, scene))
    standing = result.adapted.positions[result.adapted.dwells]
    assert result.status == "done" and len(standing) == 30 and (standing[:, 0] < 0.55).all()
    asked = adapt(Request("wait 5 cm before the jar", PATH, scene))
    assert asked.status == "needs_clarification" and "comes no nearer than 0.1 m" in asked.question


@pytest.mark.parametrize(
    ("text", "amount"),
    [("speed x2.5", (2.5, "x")), ("multiply the speed by 1.5", (1.5, "x")), ("threefold speed", (3.0, "x")),
     ("faster by a factor of 2", (2.0, "x")), ("left by 2", (2.0, "")), ("x 0.2", (0.2, ""))],
)  # fmt: skip
def test_factors_are_told_from_other_numbers(text, amount):
    assert [(m.value, m.unit) for m in sketch(text, SCENE).mentions if not m.is_object] == [amount]


def test_the_words_of_a_text_in_place_of_a_name_are_no_things():
    scene = scene_of("please print all keys and then stop", "workbench")
    assert not [m for m in sketch("print it, then stop there", scene).mentions if m.is_object]
