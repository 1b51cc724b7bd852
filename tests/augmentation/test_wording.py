"""Sentences mean what was drawn: the grammar's are read as it, and people's are used only where they fit anywhere."""

from random import Random

import pytest

from ovita.augment.ground import RandomScenes
from ovita.augment.wording import NotOffered, draw, families_from, grammar, sentences, slots_of, slotted, with_voices
from ovita.errors import RequestError
from ovita.instruct import notation
from ovita.instruct.meaning import same
from ovita.instruct.understanding import understand


def test_what_the_grammar_says_is_read_as_what_was_drawn():
    """The readers know nothing of the grammar, so they are a witness; a few sentences may be read otherwise."""
    pool, right, read = RandomScenes(waypoints=40), 0, 0
    for block in range(2):
        ground = pool.ground(7, block)
        task = ground.task
        for family in families_from(()):
            rng = Random(f"{block}/{family}")
            try:
                drawn = draw(rng, ground, family, grammar())
            except NotOffered:
                continue
            for said in sentences(rng, drawn, grammar(), 1):
                reading = understand(said, task.scene, task.trajectory).reading
                read += 1
                right += same(reading.frames, drawn.frames)
    assert read > 20 and right >= 0.9 * read


def test_every_meaning_is_in_the_notation_and_says_all_of_its_slots():
    known = {"dir": "left", "dir2": "up", "obj": "cup", "s": "3s", "v": "0.2m/s", "pc": "30%", "deg": "20deg"}
    known |= {"m": "10cm", "small": "5cm", "gap": "20cm", "k": "5", "k2": "30", "part": "@first"}
    for meanings in grammar().meanings.values():
        for meaning in meanings:
            assert notation.parse(meaning.means.format_map(known), ["cup"]), meaning.means
            for said in meaning.say:
                assert sorted(slots_of(said)) == sorted(slots_of(meaning.means)), said
    for part, phrases in grammar().parts.items():
        assert all(sorted(slots_of(said)) == sorted(slots_of(part)) for said in phrases), part


@pytest.mark.parametrize(
    ("sentence", "reading", "shape", "template"),
    [
        ("Nudge the cup side 4 cm up, will you", "move up=4cm", None, None),
        ("Nudge it 4 cm up, will you", "move up=4cm", "move up={m}", "Nudge it {m} up, will you"),
        ("Give the red cup 12.5 centimetres, at least", "clearance red_cup at_least=12.5cm",
         "clearance at_least={m} {obj}", "Give {obj} {m}, at least"),
        ("30 percent off the pace near the cup", "pace slower by=30% @near=cup",
         "pace @near={obj} by={pc} slower", "{pc} off the pace near {obj}"),
        ("the last 6 points are junk", "trim last=6wp", "trim last={k}wp", "the last {k} points are junk"),
        ("my cup wants 5 cm", "clearance cup at_least=5cm", None, None),
        ("a handbreadth up", "move up=10cm", None, None),
        ("5 cm up, 3rd time", "move up=5cm", None, None),
        ("up and faster", "move up; pace faster", None, None),
        ("which one?", "? which cup", None, None),
    ],
)  # fmt: skip
def test_what_a_person_wrote_is_used_where_it_fits_any_scene(sentence, reading, shape, template):
    assert slotted(sentence, reading, ["cup", "red cup"]) == (None if shape is None else (shape, template))


def test_voices_are_heard(tmp_path):
    with pytest.raises(RequestError, match="has a sentence with a reading"):
        with_voices(tmp_path)
    (tmp_path / "ann.txt").write_text("# scene: cup\nGet you gone from the cup! | farther cup\nUp => more | scale 2x\n")
    wordings = with_voices(tmp_path)
    ground = RandomScenes(("tabletop",), 30).ground(0, 0)
    drawn = next(
        d
        for i in range(99)
        if (d := draw(Random(i), ground, "distance", wordings)).clauses[0].meaning.means == "farther {obj}"
    )
    name = drawn.frames[0].named[0]
    assert f"Get you gone from the {name}!" in list(sentences(Random(0), drawn, wordings, 12))
