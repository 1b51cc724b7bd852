"""Who sees what: Williams squares, equal counts, cross-rating."""

from collections import Counter
from itertools import pairwise

import pytest

from ovita.errors import RequestError
from ovita.study.assignment import assign, williams
from ovita.study.design import AdaptationPhase, StudyDesign


@pytest.mark.parametrize("k", range(1, 9))
def test_williams_square(k):
    rows = williams(k)
    assert len(rows) == (k if k % 2 == 0 or k == 1 else 2 * k)
    assert all(sorted(row) == list(range(k)) for row in rows)
    neighbours = Counter(pair for row in rows for pair in pairwise(row))
    assert len(neighbours) == k * (k - 1)
    assert set(neighbours.values()) <= {1 if k % 2 == 0 else 2}
    assert set(Counter((place, c) for row in rows for place, c in enumerate(row)).values()) == {len(rows) // k}


def laid_out(people=12, items=8, conditions=4, adapt=2, **more):
    design = StudyDesign("t", "c", participants=people, per_person=4 * conditions, seed=5,
                         adapt=AdaptationPhase(adapt), **more)  # fmt: skip
    samples, names = [f"i{i}" for i in range(items)], [f"c{i}" for i in range(conditions)]
    return assign(design, samples, names)


def test_counts_are_equal():
    people = laid_out()
    rated = Counter((p.item, p.conditions) for person in people for p in person.pages if p.kind == "rate")
    assert len(rated) == 8 * 4 and set(rated.values()) == {12 * 4 // 8}
    for person in people:
        told = Counter(page.explanation for page in person.pages if page.kind == "rate")
        assert told[True] == told[False]
        first = Counter(b.conditions for a, b in pairwise(person.pages) if b.kind == "rate" and a.kind != "rate")
        assert set(first.values()) == {1}, "four items, four conditions: each comes first once"


@pytest.mark.parametrize(("people", "items", "adapt"), [(30, 11, 3), (7, 5, 1), (13, 40, 0)])
def test_counts_differ_by_one_at_most_and_nobody_rates_what_they_adapted(people, items, adapt):
    found = laid_out(people, items, 2, adapt)
    counts = Counter(item for person in found for item in person.rated)
    assert max(counts.values()) - min(counts.get(f"i{i}", 0) for i in range(items)) <= 1
    for person in found:
        assert len(person.adapted) == adapt and len(person.rated) == 4
        assert not person.adapted & person.rated


def test_pairs_and_their_sides_are_balanced():
    pages = [p for person in laid_out(24, 8, 3, 0) for p in person.pages if p.kind == "preference"]
    pairs = Counter(frozenset(p.conditions) for p in pages)
    assert len(pairs) == 3 and max(pairs.values()) - min(pairs.values()) <= 1
    left = Counter(p.conditions for p in pages)
    assert max(left.values()) - min(left.values()) <= 4


def test_letters_and_orders_differ_between_people_and_follow_from_the_seed():
    people = laid_out()
    assert len({tuple(person.letters.values()) for person in people}) == len(people)
    assert all(len(set(person.letters.values())) == 4 for person in people)
    assert people == laid_out()
    assert people != laid_out(groups={"expert": 12})


def test_groups_see_the_items_equally_often():
    people = laid_out(groups={"expert": 4, "other": 8}, adapt=0)
    assert Counter(person.group for person in people) == {"expert": 4, "other": 8}
    counts = Counter((person.group, item) for person in people for item in person.rated)
    assert {counts["expert", f"i{i}"] for i in range(8)} <= {1, 2, 3}


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"per_person": 7}, "take 6 or 9"), ({"adapt": AdaptationPhase(5)}, "only 6")],
)
def test_numbers_that_cannot_be_met(changes, words):
    design = StudyDesign("t", "c", **{"per_person": 6, **changes})
    with pytest.raises(RequestError, match=words):
        assign(design, [f"i{i}" for i in range(6)], ["a", "b", "c"])
