"""Right edits keep their promises and wrong ones break them; the whole table is in docs/trust.md."""

import runpy
from pathlib import Path

import pytest

PROMISES = runpy.run_path(str(Path(__file__).parents[2] / "benchmarks" / "promises.py"))


@pytest.mark.parametrize("kind", PROMISES["KINDS"])
def test_right_edits_are_accepted_and_wrong_ones_flagged(kind):
    falsely = PROMISES["falsely"]
    assert len(falsely(kind, 40, True)) <= 1
    assert len(falsely(kind, 40, False)) <= 1


@pytest.mark.parametrize(
    ("seed", "right"), [(310132, True), (310159, True), (310291, True), (310166, False), (310229, False)]
)
def test_an_angle_between_short_segments_is_no_kink_and_a_corner_that_stands_out_is_one(seed, right):
    assert not PROMISES["falsely"]("smoother", 1, right, seed)
