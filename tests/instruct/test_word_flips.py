"""One word of an instruction turned round: the result turns round with it, or the instruction is refused."""

import sys
from functools import cache
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

SPEC = spec_from_file_location("word_flips", Path(__file__).parents[2] / "benchmarks" / "word_flips.py")
word_flips = module_from_spec(SPEC)
sys.modules["word_flips"] = word_flips
SPEC.loader.exec_module(word_flips)

FLIPS = sorted({pair.flip for pair, _, _ in word_flips.pairs(100, seed=3)})


@cache
def judged():
    return list(word_flips.judged(100, seed=3))


@pytest.mark.parametrize("flip", FLIPS)
def test_the_result_turns_round_with_the_word(flip):
    sides = [
        (text, outcome)
        for pair, outcomes in judged()
        if pair.flip == flip
        for (text, _), outcome in zip((pair.one, pair.other), outcomes, strict=True)
    ]
    assert [side for side in sides if side[1][0] == "wrong"] == []


def test_most_sides_are_done_rather_than_refused():
    kinds = [kind for _, outcomes in judged() for kind, _ in outcomes]
    assert kinds.count("right") >= 0.85 * len(kinds)


def test_a_result_that_goes_the_other_way_is_wrong():
    pair, trajectory, scene = next(
        p for p in word_flips.pairs(100, seed=3) if p[0].family == "shift" and p[0].flip == "left/right"
    )
    assert word_flips.outcome(pair.one[0], pair.other[1], trajectory, scene)[0] == "wrong"
