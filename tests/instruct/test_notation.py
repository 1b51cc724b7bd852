"""Frames and edits are printed in the notation and read back as they were."""

import importlib.util
import sys
from pathlib import Path

import pytest

from ovita.errors import InputError
from ovita.instruct.frames import Pace, Quantity
from ovita.instruct.meaning import same
from ovita.instruct.notation import parse, parse_edits, show

CORPUS = Path(__file__).parents[2] / "training" / "corpus"
spec = importlib.util.spec_from_file_location("corpus_check", CORPUS / "check.py")
check = importlib.util.module_from_spec(spec)
sys.modules["corpus_check"] = check
spec.loader.exec_module(check)


def test_what_is_printed_is_read_back():
    """Over every fourth voice of the corpus: some thousand frames and edits."""
    seen = 0
    for path in [p for p in sorted(CORPUS.glob("*/*.txt")) if p.parent.name not in ("generation", "ways")][::4]:
        for line in check.examples(path):
            assert not line.problem, f"{path.name}:{line.number}: {line.problem}"
            assert same(parse(show(line.frames), line.objects), line.frames), line.reading
            printed = show(line.edits)
            assert show(parse_edits(printed, line.objects)) == printed, line.reading
            seen += len(line.frames) + len(line.edits)
    assert seen > 3000


def test_quantities_are_in_si_and_keep_what_was_said():
    (frame,) = parse("move left=20cm up=6in", ())
    assert [(d, round(q.value, 6), q.said) for d, q in frame.offset] == [("left", 0.2, "20cm"), ("up", 0.1524, "6in")]


def test_equal_meanings_compare_equal():
    for one, other in [
        ("pace slower by=50%", "pace slower by=0.5x"),
        ("pace slower by=2x", "pace set to=50%"),
        ("pace faster by=30%", "pace faster by=1.3x"),
        ("move left=0.2m up=10cm", "move up=0.1m left=20cm"),
        ("pace slower @near=start", "pace slower @first"),
        ("pace slower @after=50%", "pace slower @last=50%"),
    ]:
        assert same(parse(one), parse(other)), (one, other)
    assert not same(parse("move left=0.2m"), parse("move right=0.2m"))
    assert Pace(change="slower", amount=Quantity(0.3, "%")).factor == 0.7


@pytest.mark.parametrize(
    ("text", "said"),
    [("leap cup", "no frame"), ("closer mug", "object"), ("move left=far", "quantity"), ("end", "needs")],
)
def test_what_is_not_of_the_notation_is_refused_with_its_word(text, said):
    with pytest.raises(InputError, match=said):
        parse(text, ("cup",))


@pytest.mark.parametrize(
    ("said", "on"),
    [("drop fire_door", "fire door"), ("set for=3s on=pace_fire_door", "pace fire door"), ("drop turn 1", "turn 1")],
)
def test_an_edit_names_an_object_as_the_scene_does(said, on):
    (edit,) = parse_edits(said, ("fire door", "cup"))
    assert edit.on == on
    assert parse_edits(show((edit,)), ("fire door", "cup")) == (edit,)
