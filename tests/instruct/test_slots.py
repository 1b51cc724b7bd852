"""Frames and edits as atoms of the learned reader, and sentences as it sees them."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "training"))
from atoms import atoms_of

from ovita.instruct.frames import Quantity
from ovita.instruct.meaning import same
from ovita.instruct.notation import parse, parse_edits, show
from ovita.instruct.sketch import sketch
from ovita.instruct.slots import HEADS, Atom, Unfit, items_of
from ovita.paths.scene import Scene, SceneObject

OBJECTS = ("cup", "left shelf", "right shelf", "toolbox")
SCENE = Scene(tuple(SceneObject(name, (0.3 * i, 0.2, 0.0)) for i, name in enumerate(OBJECTS)))

FRAMES = (
    "move left=20cm up",
    "move -y=5cm @range=5-15",
    "end goal to=cup; end start right=6in up=2cm",
    "closer cup by=5cm; farther left_shelf+right_shelf deg=large",
    "clearance cup at_least=20cm @!near=toolbox",
    "via between=left_shelf+right_shelf; via over=cup by=10cm",
    "pace slower by=30% @near=cup; pace at_most=0.3m/s @near=toolbox,0.5m",
    "pace accelerate by=-0.1m/s2 @last=2ft",
    "keep ends; keep @first; keep rest",
    "wait at=12wp for=3s; stop at=goal",
    "circle cup turns=2 radius=15cm cw; spiral at=goal rise=10cm",
    "wave size=3cm waves=4 @last=50%",
    "extend by=30cm; extend to=cup",
    "waypoints merge=3; waypoints fewer; waypoints by=2x",
    "rotate 90deg ccw about=start; tilt 5deg left; mirror left",
    "resize smaller by=20%; quadrant 3; trim last=5wp; trim before=cup",
    "height to=0.4m @after=cup; bound left=0.5m",
    "move up @beyond=up,30cm; move down @falling; move up @every=3; move up @selection",
)

EDITS = (
    "scale more deg=slight",
    "scale 1.5x on=pace",
    "set by=10cm",
    "set for=5s",
    "set left=10cm",
    "set by=+10cm",
    "flip",
    "replace right",
    "replace obj=toolbox",
    "replace goal",
    "restrict @near=cup",
    "except @last",
    "drop on=pace",
    "undo",
    "accept",
)


@pytest.mark.parametrize("notation", FRAMES)
def test_frames_survive_as_atoms(notation):
    frames = parse(notation, OBJECTS)
    atoms = atoms_of(frames)
    assert all(value in HEADS[head] for atom in atoms for head, value in atom.labels.items())
    assert same(items_of(atoms), frames)


@pytest.mark.parametrize("notation", EDITS)
def test_edits_survive_as_atoms(notation):
    edits = parse_edits(notation, OBJECTS)
    assert show(items_of(atoms_of(edits))) == show(edits)


def test_what_atoms_cannot_say_is_refused():
    with pytest.raises(Unfit):
        atoms_of(parse("pace faster @falling @after=cup", OBJECTS))


def test_a_bare_number_of_feedback_has_the_unit_before():
    atoms = atoms_of(parse_edits("set by=20"))
    (edit,) = items_of(atoms, parse("move left=10cm"))
    assert edit.quantity.value == pytest.approx(0.2)
    assert edit.quantity.unit == "m"


@pytest.mark.parametrize(
    ("sentence", "seen"),
    [
        ("Keep 20 cm from the cup", "keep <m> from the <A>"),
        ("from the cup's side to the toolbox", "from the <A> 's side to the <B>"),
        ("forty-five degrees at 0.3 m/s for 2 s", "<deg> at <m/s> for <s>"),
        ("half the speed before the last metre", "half the speed before the last <m>"),
        ("pass the shelf", "pass the <which>"),
        ("1/2 as fast, 10-15 cm up", "<n> as fast , <m> up"),
    ],
)
def test_objects_and_amounts_are_replaced_by_marks(sentence, seen):
    assert " ".join(p.text for p in sketch(sentence, SCENE, known={"slow"}).pieces).replace("the the", "the") in (
        seen,
        seen.replace("the <", "<"),
        seen.replace("the <A>", "<A>").replace("the <B>", "<B>"),
    )


@pytest.mark.parametrize(
    ("sentence", "value", "unit"),
    [
        ("a foot and a half higher", 0.4572, "m"),
        ("every third waypoint", 3, ""),
        ("half as much again", 1.5, "x"),
        ("a quarter turn", 90, "deg"),
        ("three quarters of it", 0.75, "%"),
        ("5 to 8 cm", 0.065, "m"),
        ("brake with 0.2 m/s2", 0.2, "m/s2"),
    ],
)
def test_amounts_keep_their_value_and_unit(sentence, value, unit):
    (mention,) = sketch(sentence, SCENE).mentions
    assert (mention.value, mention.unit) == (pytest.approx(value), unit)


def test_what_is_below_a_height_counts_from_the_ground_up_as_a_person_says_it():
    meant = parse("move up=2cm @beyond=down,20cm")
    (atom,) = atoms_of(meant)
    told = replace(atom, amounts=atom.amounts | {"part": Quantity(0.2, "m")})
    assert items_of([atom]) == items_of([told]) == meant


def test_a_wait_at_several_things_is_one_at_each_and_an_end_is_at_one():
    at = {"spot": "object"}
    waits = items_of([Atom({"action": "wait", **at}, objects=("cup", "box"))])
    assert show(waits) == "wait at=cup; wait at=box"
    assert len(items_of([Atom({"action": "stop", **at}, objects=("cup", "box"))])) == 1
