"""What words mean where they stand in a sentence about a way: what is denied, bounded, timed, or in order."""

from __future__ import annotations

from ovita.instruct.lexicon import concept_at, is_filler
from ovita.instruct.numbers import amount_at
from ovita.instruct.objects import GENERIC
from ovita.sources.asides import CARRIERS, DENIALS
from ovita.sources.leftover import JOINTS, SEQUENCERS
from ovita.sources.markers import (
    COMPARED,
    DETERMINERS,
    MOTION,
    NO_NAMES,
    NO_ROUTE,
    TIMES,
    TOURS,
    Marker,
    base,
    markers_at,
)
from ovita.sources.places import Location, Text

BEFORE = frozenset({"before", "after"})
HEIGHTS = frozenset("above below under over higher lower exceed exceeding height altitude".split())
WHERE = frozenset("at in by near beside on inside within".split())


class Context:
    """A sentence while its way is taken out of it.

    Args:
        text: The sentence.
    """

    def __init__(self, text: Text) -> None:
        self.text, self.words = text, text.words
        self.taken = [False] * len(text)
        self.edge = 0  # behind the last place that was taken

    def take(self, i: int, end: int) -> int:
        """Take the pieces from i up to an end out of the sentence."""
        self.taken[i:end] = [True] * (end - i)
        self.edge = end
        return end

    def ends_at(self, end: int) -> bool:
        """Whether a phrase ends at a piece: at a joint, or where another marker begins."""
        return end >= len(self.text) or self.words[end] in JOINTS or bool(markers_at(self.words, end))

    def place(self, mark: Marker) -> tuple[Location, int] | None:
        """The place behind a marker; "through the gate" leads between its posts."""
        through = mark.role == "via" and self.words[mark.end - 1] in ("through", "cross", "crossing")
        return (self.text.between(mark.end) if through else None) or self.text.place_at(mark.end)

    def leads(self, k: int) -> bool:
        """Whether a preposition of the way begins at piece k, with its place."""
        return any(mark.bare and self.text.place_at(mark.end) is not None for mark in markers_at(self.words, k))

    def measured(self, i: int) -> int:
        """Behind the distance at piece i, if there is one."""
        amount = amount_at(self.words, i) if i < len(self.text) else None
        return i + amount.used if amount is not None and amount.unit == "m" else i

    def length_of_time(self, i: int) -> int:
        """How many words a time at piece i takes."""
        amount = amount_at(self.words, i)
        return amount.used if amount is not None and amount.unit in ("s", "step") else 0

    def timed(self, i: int, end: int) -> bool:
        """Whether a phrase from piece i to an end has a time in it, right behind it or right before it."""
        before = range(max(self.fragment(i), i - 3), i)
        behind = end + (self.words[end : end + 1] == ["for"])
        return self.words[end : end + 1] == ["for"] or any(
            self.length_of_time(k) for k in (*before, *range(i, end), behind) if k < len(self.text)
        )

    def of_a_thing(self, k: int) -> bool:
        """Whether a word may be of what is carried: "the thing", "what's"."""
        word = self.words[k]
        if word in DETERMINERS:
            return True
        if word in WHERE or word in JOINTS or (self.text.object_at(k) is not None and word not in GENERIC):
            return False
        return word.replace("'", "").isalpha() and not any(mark.bare for mark in markers_at(self.words, k))

    def carried(self, i: int) -> bool:
        """Whether nothing but carriers stands between piece i and the mark, joint or phrase of the way before it."""
        for k in range(i - 1, -1, -1):
            if self.taken[k] or self.words[k] in JOINTS:
                return True
            word = self.words[k]
            if word not in CARRIERS | BEFORE and not is_filler(word) and not base(word, MOTION | TOURS):
                return False
        return True

    def fragment(self, i: int) -> int:
        """Where the fragment begins that piece i stands in."""
        return next((k + 1 for k in range(i - 1, -1, -1) if self.taken[k] or self.words[k] in JOINTS), 0)

    def after_that(self, i: int) -> bool:
        """Whether a word of order stands before piece i in its fragment, or joins that to what was before."""
        begin = self.fragment(i)
        while begin > self.edge and self.words[begin - 1] in JOINTS:
            begin -= 1
        return bool(SEQUENCERS & set(self.words[begin:i])) or self.words[begin:i][-2:] == ["from", "there"]

    def follows(self, i: int) -> bool:
        """Whether the way goes on at piece i from where it was said to end."""
        between = self.words[self.edge : i]
        adjacent = all(word in JOINTS or word in CARRIERS for word in between)
        return self.words[i] == "->" or adjacent or self.after_that(i)

    def rounds(self, i: int) -> bool:
        """Whether "round" stands in "round and round the lamp"."""
        return self.words[i] in ("round", "around") and "and" in (*self.words[i - 1 : i], *self.words[i + 1 : i + 2])

    def barred(self, i: int, mark: Marker) -> bool:
        """Whether words that look like a marker are none here."""
        if mark.role == "via" and (not self.carried(i) or self.rounds(i)):
            return True
        return self.denied(i) if mark.role != "via" else False

    def denied(self, i: int) -> bool:
        """Whether a word of denial stands before piece i in its fragment, and is not of an amount: "no more than"."""
        begin = max(self.fragment(i), self.bounded(i))
        return bool(DENIALS & set(self.words[begin:i]))

    def bounded(self, i: int) -> int:
        """Behind the last amount before piece i that is bounded or is none of a distance to something, or 0."""
        for k in range(i - 1, self.fragment(i) - 1, -1):
            amount = amount_at(self.words, k)
            if amount is None or not amount.unit or k + amount.used > i:
                continue
            high = bool(HEIGHTS & set(self.words[max(k - 3, 0) : k]))
            return k + amount.used if amount.unit != "m" or high else 0
        return 0

    def turns_away(self, i: int) -> bool:
        """Whether a "from" or "to" at piece i is that of "15 cm from the cup" or "clearance to the pillar"."""
        if self.words[i - 1 : i] and self.words[i - 1] in COMPARED:
            return True
        begin = max(next((k + 1 for k in range(i - 1, -1, -1) if self.parted(k)), 0), self.bounded(i))
        if begin == i:
            return False
        found = [amount_at(self.words, i - n) for n in range(1, min(4, i) + 1)]
        measured = any(a is not None and a.used == n and a.unit == "m" for n, a in enumerate(found, start=1))
        return measured or bool(NO_ROUTE & set(self.words[begin:i]))

    def parted(self, k: int) -> bool:
        """Whether what is said before piece k, and with it, has nothing to do with what comes behind."""
        return self.taken[k] or self.words[k] in JOINTS or self.text.object_at(k) is not None

    def noun_at(self, i: int) -> str:
        """The words from piece i on that name something unknown, or ""."""
        end = i
        while end < len(self.text) and self.unnamed(end):
            end += 1
        return " ".join(self.words[i : min(end, i + 3)])

    def unnamed(self, k: int) -> bool:
        """Whether a word is none that ovita knows."""
        word = self.words[k]
        if not word.isalpha() or word in NO_NAMES or word in JOINTS or word in CARRIERS or is_filler(word):
            return False
        known = concept_at(self.words, k)[0] or amount_at(self.words, k) or self.text.object_at(k)
        return not known and not markers_at(self.words, k)

    def turns_around(self, mark: Marker, end: int) -> bool:
        """Whether "go round the tree one time" is a circle."""
        return mark.relation == "beside" and bool(TIMES & set(self.words[end : end + 2]))
