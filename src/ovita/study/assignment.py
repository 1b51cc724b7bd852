"""Who sees what, in which order: Williams squares, items equally often, nobody rates what they adapted, letters."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, combinations
from typing import TypeVar

from ovita.errors import RequestError
from ovita.study.design import StudyDesign
from ovita.study.ratings import Phase

T = TypeVar("T", bound=Hashable)

LETTERS = "ABCDEFGHJKLMNPQRSTUVWXYZ"
"""Letters that conditions hide behind; without I and O, which look like numbers."""


@dataclass(frozen=True)
class StudyPage:
    """One page of a person's study.

    Args:
        kind: One of `questions.KINDS`.
        phase: Whether it belongs to the adaptation phase.
        position: Which page it is, from 1.
        item: The sample that is shown, or ""; what is judged on a page "judge" is drawn when it is first shown.
        conditions: What is shown of it, from left to right.
        explanation: Whether what the system says is shown.
        expected: The answer that a check of attention asks for.
    """

    id: str
    kind: str
    phase: Phase
    position: int
    item: str = ""
    conditions: tuple[str, ...] = ()
    explanation: bool = False
    expected: int = 0


@dataclass(frozen=True)
class Participant:
    """A person, by number only.

    Args:
        id: Such as "p07".
        letters: What each condition is called on this person's pages.
    """

    id: str
    group: str
    letters: dict[str, str]
    pages: tuple[StudyPage, ...]

    @property
    def adapted(self) -> frozenset[str]:
        """The items that this person adapts."""
        return frozenset(page.item for page in self.pages if page.kind == "adapt")

    @property
    def rated(self) -> frozenset[str]:
        """The items that this person rates."""
        return frozenset(page.item for page in self.pages if page.kind == "rate")


def williams(k: int) -> tuple[tuple[int, ...], ...]:
    """Orders of k conditions in which each stands in each place, and follows each other one, equally often.

    For an even k these are k orders in which each ordered pair of neighbours occurs once, for an odd one 2 k orders
    in which each occurs twice (Williams 1949).
    """
    first = [(i + 1) // 2 if i % 2 else (k - i // 2) % k for i in range(k)]
    rows = [tuple((value + shift) % k for value in first) for shift in range(k)]
    return tuple(rows if k % 2 == 0 or k == 1 else rows + [row[::-1] for row in rows])


def assign(design: StudyDesign, items: Sequence[str], conditions: Sequence[str]) -> tuple[Participant, ...]:
    """Lay out the study of every person.

    Each item is rated equally often, or once more where the numbers do not come out even. A person sees an item under
    all conditions, one after the other in a Williams order, and then two of them side by side. The rows of the
    square, the explanation and the pairs are each spread evenly over a person's items, and over the persons of an item
    as far as that allows.

    Raises:
        RequestError: If the numbers cannot be met.
    """
    count = _items_per_person(design, items, conditions)
    chance = random.Random(f"ovita study {design.seed}")
    layout = _Layout(design, tuple(items), tuple(conditions), chance)
    return tuple(layout.person(i, group, count) for i, group in enumerate(design.people, 1))


def _items_per_person(design: StudyDesign, items: Sequence[str], conditions: Sequence[str]) -> int:
    k = len(conditions)
    if k > len(LETTERS):
        raise RequestError(f"the runs hold {k} conditions, more than there are letters; name some in [conditions]")
    count, rest = divmod(design.per_person, k)
    if rest:
        near = " or ".join(str(n * k) for n in (count, count + 1) if n)
        raise RequestError(f"--per-person {design.per_person} is no multiple of the {k} conditions; take {near}")
    if count + design.adapt.items > len(items):
        raise RequestError(
            f"each person would rate {count} items and adapt {design.adapt.items} others, but the runs share only"
            f" {len(items)}; lower --per-person, or add samples to the runs"
        )
    return count


_page = partial(StudyPage, "", position=0)
"""A page that has no number yet."""


class _Layout:
    """What was given to whom so far; persons are laid out one after the other."""

    def __init__(
        self, design: StudyDesign, items: tuple[str, ...], conditions: tuple[str, ...], chance: random.Random
    ) -> None:
        self.design, self.items, self.conditions, self.chance = design, items, conditions, chance
        self.given: Counter[tuple[Hashable, ...]] = Counter()
        self.rows = williams(len(conditions))
        self.pairs = tuple(combinations(conditions, 2))
        self.shown = {"on": (True,), "off": (False,), "both": (True, False)}[design.explanation]

    def person(self, number: int, group: str, count: int) -> Participant:
        """The pages of one more person."""
        design, chance = self.design, self.chance
        rated = self._fewest("rated", self.items, count, group)
        adapted = self._fewest("adapted", [i for i in self.items if i not in rated], design.adapt.items, group)
        chance.shuffle(rated)
        letters = dict(zip(self.conditions, chance.sample(LETTERS, len(self.conditions)), strict=True))
        early = [name for name in design.questionnaires if name == "tlx" and adapted]
        late = [name for name in design.questionnaires if name not in early]
        pages = [_page("introduction", "adapt" if adapted else "rate")]
        for item in adapted:
            told = self._even("told in adapting", self.shown, number, item)
            pages.append(_page("adapt", "adapt", item=item, explanation=told))
        pages += [_page(name, "adapt") for name in early]
        blocks = [self._block(item, number) for item in rated]
        pages += chain.from_iterable(self._with_checks(blocks))
        for _ in range(design.adapt.judging):
            pages.append(_page("judge", "rate", explanation=self._even("told in judging", self.shown, number, "")))
        pages += [_page(name, "rate") for name in (*late, "closing")]
        numbered = tuple(replace(page, id=f"s{i:03d}", position=i) for i, page in enumerate(pages, 1))
        return Participant(f"p{number:0{len(str(len(design.people)))}d}", group, letters, numbered)

    def _block(self, item: str, number: int) -> list[StudyPage]:
        """The pages about an item: each condition in turn, then two side by side."""
        told = self._even("told", self.shown, number, item)
        row = self._even("row", self.rows, number, item)
        pages = [_page("rate", "rate", item=item, conditions=(self.conditions[i],), explanation=told) for i in row]
        if self.design.preference and self.pairs:
            pair = self._even("pair", self.pairs, number, item)
            turned = self._even(("side", pair), (False, True), number, item)
            beside = pair[::-1] if turned else pair
            pages.append(_page("preference", "rate", item=item, conditions=beside, explanation=told))
        return pages

    def _with_checks(self, blocks: list[list[StudyPage]]) -> list[list[StudyPage]]:
        """Checks of attention between the items, never at the very beginning."""
        found = list(blocks)
        for _ in range(self.design.attention):
            expected = self.chance.choice((1, 2, 4, 5))
            at = self.chance.randint(1, len(found))
            found.insert(at, [_page("attention", "rate", expected=expected)])
        return found

    def _fewest(self, what: str, pool: Sequence[str], count: int, group: str) -> list[str]:
        """The items that were given least often, and among these least often to this group."""
        order = list(pool)
        self.chance.shuffle(order)
        order.sort(key=lambda item: (self.given[what, item], self.given[what, group, item]))
        for item in order[:count]:
            self.given[what, item] += 1
            self.given[what, group, item] += 1
        return order[:count]

    def _even(self, what: Hashable, choices: Sequence[T], number: int, item: str) -> T:
        """The choice that this person had least often, and among these the item, and among these everybody."""
        order = list(choices)
        self.chance.shuffle(order)
        scopes: tuple[tuple[Hashable, ...], ...] = ((what, "person", number), (what, "item", item), (what, "all"))
        best = min(order, key=lambda choice: [self.given[*scope, choice] for scope in scopes])
        for scope in scopes:
            self.given[*scope, best] += 1
        return best
