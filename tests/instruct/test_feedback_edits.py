"""Feedback read as edits, and what edits make of frames."""

import json
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ovita.instruct.editing import apply, by_hand
from ovita.instruct.frames import Quantity, from_json, name_of, to_json
from ovita.instruct.meaning import same
from ovita.instruct.notation import parse, parse_edits, show
from ovita.instruct.understanding import feedback, learned_reader, overheard
from ovita.paths.part import PathPart, both, outside
from ovita.paths.scene import Scene, SceneObject
from ovita.policy import Parameter

NAMES = ("cup", "blue box", "person")
SCENE = Scene(tuple(SceneObject(name, [0.3 * i, 0.5, 0.2]) for i, name in enumerate(NAMES)))
REALISED = {"0.left": Quantity(0.2, "m"), "0.amount": Quantity(0.5, "x", "to"), "0.by": Quantity(0.1, "m")}

SAID = [
    ("move left=20cm", "hmm more like 10 cm", "move left=10cm"),
    ("move left=20cm", "a bit more", "move left=25cm"),
    ("move left", "a bit more", "move left=0.25m"),
    ("pace faster by=50%", "too fast", "pace faster by=33%"),
    ("farther cup by=30cm", "not so far", "farther cup by=20cm"),
    ("move up=10cm", "half of that", "move up=5cm"),
    ("move left=20cm", "the other way", "move right=20cm"),
    ("move left=20cm", "right, not left", "move right=20cm"),
    ("closer cup by=5cm", "I meant the blue box", "closer blue_box by=5cm"),
    ("wait at=cup for=2s", "make that 5 seconds", "wait at=cup for=5s"),
    ("move up=10cm", "I can hardly see a difference", "move up=15cm"),
    ("circle cup radius=10cm turns=2", "bigger", "circle cup radius=15cm turns=2"),
    ("pace slower; move up=10cm", "leave the speed out", "move up=10cm"),
    ("pace slower by=20%; move up=10cm", "the lift is fine, but slower still", "pace slower by=30%; move up=10cm"),
    ("move up=10cm", "5 cm more", "move up=15cm"),
    ("wait at=cup for=3s; move up=10cm", "5 s, and only 5 cm up", "wait at=cup for=5s; move up=5cm"),
    (
        "closer cup by=10cm; wait at=cup for=5s",
        "eight seconds, and 20 cm rather than 10 cm",
        "closer cup by=20cm; wait at=cup for=8s",
    ),
    (
        "clearance cup at_least=30cm; pace at_most=0.5m/s",
        "r 45cm, v 0.3m/s",
        "clearance cup at_least=45cm; pace at_most=0.3m/s",
    ),
    ("circle cup radius=30cm turns=1", "three revolutions, of 25 cm radius", "circle cup radius=25cm turns=3"),
    ("circle cup radius=25cm turns=2", "make it three", "circle cup radius=25cm turns=3"),
    ("circle cup cw; return", "other way round", "circle cup ccw; return"),
    ("pace slower by=20%", "too slow now", "pace slower by=13.3%"),
    ("pace to=20s", "faster", "pace set to=13.3s"),
    ("pace to=20s", "make that half a minute", "pace set to=30s"),
]


@pytest.mark.parametrize(("before", "said", "wanted"), SAID, ids=[f"{b} -> {s}" for b, s, _ in SAID])
def test_what_is_said_about_frames_changes_them(before, said, wanted):
    frames = parse(before, NAMES)
    reading = feedback(said, SCENE, frames, None)
    assert reading is not None and not reading.question
    assert same(apply(reading.edits, frames, SCENE, REALISED), parse(wanted, NAMES))


BESIDE_INSTRUCTIONS = [
    ("side cup left", "on the right of it, sorry", "side cup right"),
    ("side cup left", "behind it, sorry", "side cup back"),
    ("pace slower @near=cup", "do the same near the person", "pace slower @near=cup; pace slower @near=person"),
    ("move left=20cm; pace slower by=20%", "more to the left and slower", "move left=30cm; pace slower by=30%"),
    ("move left=20cm; move up=10cm", "a bit more to the left", "move left=25cm; move up=10cm"),
    ("move left=20cm up=10cm", "a bit more to the left", "move left=25cm up=10cm"),
    ("move left=20cm up=10cm", "15 cm instead of 10 cm", "move left=20cm up=15cm"),
    ("circle cup radius=10cm", "r=15cm", "circle cup radius=15cm"),
    ("move up=10cm", "lower it again", "move up=6.7cm"),
    ("clearance person at_least=50cm", "a whole metre", "clearance person at_least=1m"),
    ("tilt left 5deg", "the other side, please", "tilt right 5deg"),
]


@pytest.mark.parametrize(("before", "said", "wanted"), BESIDE_INSTRUCTIONS)
def test_feedback_is_told_from_instructions(before, said, wanted):
    frames = parse(before, NAMES)
    reading = feedback(said, SCENE, frames, None)
    assert reading is not None and not reading.question
    assert same(apply(reading.edits, frames, SCENE, REALISED), parse(wanted, NAMES))


IN_PART = [
    ("pace slower @last=50%", "not the last half, the first half", "pace slower @first=50%"),
    ("pace slower", "only near the cup", "pace slower @near=cup"),
    ("clearance person at_least=50cm", "80 would be safer", "clearance person at_least=80cm"),
    ("closer person by=5cm", "also linger there for 3 s", "closer person by=5cm; wait at=person for=3s"),
    ("side person left", "pass on its right instead", "side person right"),
    ("pace slower", "but not around the person", "pace slower @!near=person"),
    ("move up=10cm", "only in the second half", "move up=10cm @last=50%"),
    ("farther cup by=20cm", "a great deal more, my cat drinks from it", "farther cup by=40cm"),
    ("move up=10cm", "that's quite right", "move up=10cm"),
    ("zigzag size=4mm @middle", "over the last part also", "zigzag size=4mm @middle; zigzag size=4mm @last"),
    ("wait at=cup for=5s", "time to lift the lid, so ten seconds", "wait at=cup for=10s"),
    ("pace slower by=30%; move up=2cm", "the speed should drop less than that", "pace slower by=20%; move up=2cm"),
]


@pytest.mark.parametrize(("before", "said", "wanted"), IN_PART)
def test_what_is_said_in_passing_is_read(before, said, wanted):
    frames = parse(before, NAMES)
    reading = feedback(said, SCENE, frames, None)
    assert same(apply(reading.edits, frames, SCENE, REALISED), parse(wanted, NAMES))


@pytest.mark.parametrize(
    "said",
    [
        "go left by 0.1",
        "slow down near the cup",
        "move up by 5 cm near the person",
        "leave a clearance of 350 mm around the fan",
        "put in three waves",
    ],
)
def test_instructions_are_no_feedback(said):
    assert feedback(said, SCENE, parse("move left=20cm", NAMES), None) is None


@pytest.mark.parametrize(
    ("said", "edit"),
    [
        ("undo", "undo"),
        ("back to the original", "restart"),
        ("why did you do that?", "explain"),
        ("perfect", "accept"),
        ("bring it back", "redo"),
        ("again", "again"),
    ],
)
def test_commands_of_a_dialogue(said, edit):
    assert show(feedback(said, SCENE, parse("move left=20cm"), None).edits) == edit


@pytest.mark.parametrize(
    ("said", "edit"),
    [
        ("undo the last two", "undo 2"),
        ("undo both", "undo 2"),
        ("forget the first one", "drop turn 1"),
        ("undo the second one", "drop turn 2"),
    ],
)
def test_turns_that_are_taken_back_are_counted(said, edit):
    before = parse("move left=20cm; pace slower @near=cup", SCENE.names)
    assert show(feedback(said, SCENE, before, None).edits) == edit


def test_which_of_two_frames_is_asked():
    reading = feedback("a bit more", SCENE, parse("move left=20cm; pace slower by=20%"), None)
    assert reading.question and reading.asked == ("move", "pace") and not reading.edits


@pytest.mark.parametrize(
    ("before", "edits", "wanted"),
    [
        ("closer cup deg=slight", "set by=10cm", "closer cup by=10cm"),
        ("pace slower by=60%", "scale 2x", "pace set by=0.16x"),
        ("pace faster by=2x", "scale 0.5x", "pace faster by=1.5x"),
        ("circle cup turns=2", "scale more deg=slight", "circle cup turns=3"),
        ("move left=10cm up", "set up=4cm", "move left=10cm up=4cm"),
        ("move left=4in", "set by=6", "move left=6in"),
        ("move left=5cm @first", "except @near=cup", "move left=5cm @first @!near=cup"),
        ("closer cup by=5cm", "also closer blue_box", "closer cup by=5cm; closer blue_box by=5cm"),
        ("smooth; move up=1cm", "drop smooth", "move up=1cm"),
        ("curve more", "scale more", "curve more deg=large"),
        ("end goal up=5cm", "replace start", "end start up=5cm"),
        ("via over=cup", "replace down", "via under=cup"),
    ],
)
def test_edits_of_frames(before, edits, wanted):
    after = apply(parse_edits(edits, NAMES), parse(before, NAMES), SCENE)
    assert same(after, parse(wanted, NAMES)), show(after)


def test_amounts_that_a_person_turned_by_hand_stay_in_their_slots():
    knobs = [
        Parameter("left", 0.1, "m", role="by", slot="0.left"),
        Parameter("slowdown", 0.5, "", role="factor", slot="1.amount"),
        Parameter("radius", 0.4, "m", role="radius", slot="1.part"),
    ]
    frames = parse("move left; pace slower @near=cup", NAMES)
    after = by_hand(frames, knobs, {"left": 0.3, "slowdown": 0.7, "radius": 0.2})
    assert same(after, parse("move left=0.3m; pace set to=0.7x @near=cup,20cm", NAMES))


def test_frames_survive_a_document():
    parts = [PathPart("indices", ranges=((2, 5),), count=20), both(outside(PathPart("near", ("cup",), 0.2)))]
    text = "move left=20cm up @first; closer cup+blue_box by=5cm; circle cup turns=2 cw; wait at=50% for=2s; pace turns"
    frames = tuple(
        type(f)(**{**f.__dict__, "part": parts[i % 2]}) if i else f for i, f in enumerate(parse(text, NAMES))
    )
    again = from_json(json.loads(json.dumps(to_json(frames))))
    assert again == frames and same(again, frames)
    for broken in ({}, {"frame": "Shift"}, {"frame": "Fly"}, {"frame": "Smooth", "part": {"kind": "moon"}}):
        with pytest.raises(ValueError, match="no frame"):
            from_json([broken])


WORDS = """more less a bit much too not so far slow fast slower faster half of that it the other cup box no only near
end first left right undo speed shift again without keep as was 0.3 instead make 10 cm % also same
for , ? go""".split()


@settings(max_examples=100, deadline=None)
@given(st.lists(st.sampled_from(WORDS), min_size=1, max_size=7).map(" ".join) | st.text(max_size=40))
def test_any_words_are_read_and_applied_without_an_error(said):
    frames = parse("move left=20cm; pace slower @near=cup", NAMES)
    reading = feedback(said, SCENE, frames, None)
    if reading is not None:
        apply(reading.edits, frames, SCENE, REALISED)


def test_the_training_voices_are_read(tmp_path):
    """A quarter of the lines of every fourth voice, most of which it was not tuned on."""
    sys.path.insert(0, str(Path(__file__).parents[2] / "training"))
    from evaluate_feedback import CORPUS, measured

    for voice in sorted((CORPUS / "voices").glob("*.txt"))[::4]:
        (tmp_path / voice.name).symlink_to(voice)
    counts = measured(tmp_path, every=4).values()
    right, read = sum(c["right"] for c in counts), sum(c.total() - c["none"] for c in counts)
    assert right >= 0.75 * read and read > 150, f"{right} of {read}"


@pytest.mark.parametrize(
    ("before", "said", "after"),
    [
        ("move down=10cm", "3 cm too low", "move down=7cm"),
        ("wait at=cup for=3s", "2 seconds too long", "wait at=cup for=1s"),
        ("wait at=cup for=3s", "2 seconds too short", "wait at=cup for=5s"),
        ("move left=10cm", "4 cm too far", "move left=6cm"),
    ],
)
def test_an_amount_that_is_too_much_is_so_much_less(before, said, after):
    frames = parse(before, NAMES)
    found = feedback(said, SCENE, frames, None)
    assert found is not None and same(apply(found.edits, frames, SCENE), parse(after, NAMES)), show(found.edits)


def test_to_begin_earlier_is_no_more_speed():
    frames = parse("pace set to=0.3m/s @near=person", NAMES)
    found = feedback("even earlier please", SCENE, frames, None)
    assert found is not None and not found.edits and "how far before" in found.question


@pytest.mark.parametrize(
    ("before", "edits", "after"),
    [
        (
            "height at_least=10cm; circle cup cw",
            "set at_least=14cm; flip on=circle",
            "height at_least=14cm; circle cup ccw",
        ),
        (
            "height at_least=10cm; circle cup radius=20cm",
            "set at_least=14cm",
            "height at_least=14cm; circle cup radius=20cm",
        ),
        (
            "closer cup by=2cm; arrive up by=5cm",
            "scale 2x on=closer; set by=8cm",
            "closer cup by=4cm; arrive up by=8cm",
        ),
        ("move left=10cm; pace faster by=20%", "set by=30% on=pace; scale 0.5x", "move left=5cm; pace faster by=30%"),
        ("move left=10cm; side cup right", "scale 2x on=move; flip", "move left=20cm; side cup left"),
        ("move left=10cm; wait at=cup", "scale 2x on=move; replace obj=person", "move left=20cm; wait at=person"),
    ],
)
def test_an_edit_that_names_no_change_is_about_one_that_fits_and_no_other_edit_is_about(before, edits, after):
    assert same(apply(parse_edits(edits, NAMES), parse(before, NAMES), SCENE), parse(after, NAMES))


@pytest.mark.parametrize("said", ["drop it", "without that", "forget the wave", "a bit less", "the other way", "15 cm"])
@pytest.mark.parametrize("before", ["return; height at_most=12m; reverse", "extend by=5cm; smooth", "zigzag size=5cm"])
def test_what_an_edit_is_about_stands_before_it(said, before):
    frames = parse(before, NAMES)
    read = learned_reader().read(said, SCENE, None, frames)
    assert {getattr(edit, "on", "") for edit in read.edits} <= {"", *map(name_of, frames)}


@pytest.mark.parametrize("said", ["reset all", "undone, please", "discard all changes"])
def test_a_sure_step_back_is_no_other_wish(said):
    found = feedback(said, SCENE, parse("move left=10cm", NAMES), None)
    assert found is not None and all(edit.NAME in ("undo", "restart", "drop") for edit in found.edits)


def heard(text, before):
    return overheard(text, SCENE, parse(before, NAMES), None)


@pytest.mark.parametrize("text", ["Hop higher.", "hop higher"])
def test_a_capital_letter_leaves_no_word_unread(text):
    assert "hop" not in heard(text, "hop cup by=20cm; wait at=cup").edits.unread


@pytest.mark.parametrize(
    ("text", "before"), [("30 s longer", "wait at=cup for=30s"), ("rotation the other way", "rotate 30deg cw")]
)
def test_a_longer_wait_and_a_rotation_are_no_other_change(text, before):
    assert not heard(text, before).said.elsewhere
