"""What a sentence asks for besides the way: its words without those that only carry the way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

from ovita.instruct.lexicon import concept_at, is_filler
from ovita.instruct.numbers import amount_at
from ovita.instruct.objects import BEFORE_IT
from ovita.sources.asides import CARRIERS, DENIALS, LEADING, needless, reason_at
from ovita.sources.markers import CARRYING, GOALS, MOTION, PICKING, STARTS, base
from ovita.sources.places import Text
from ovita.sources.wording import ABOUT, LAPS, amount_in, reworded
from ovita.text import the

JOINTS = frozenset(", ; . : ! ? ( ) and then after afterwards but next finally while - / |".split())
"""Marks and words between two things that are said."""

SEQUENCERS = frozenset(
    "then next afterwards finally subsequently later onward onwards lastly on second secondly thirdly".split()
)
"""Words that put what follows behind what was said."""

LINKS = frozenset("please oh with that which having and so while".split())
"""Words that tie what follows to the way before it."""

TAILS = frozenset(("about it", "on the way", "along the way", "on its way", "on your way", "will you", "would you",
                   "for me"))  # fmt: skip
"""Phrases at the end of a request that ask for nothing more where there is only one way."""

WITH = frozenset("with a of for an it".split())
ENDS = frozenset("end start beginning".split())
BRIEF = frozenset("quick short brief little quickly".split())
STOPS = frozenset("stop pause halt break stay visit wait dwell hold hover stopover".split())


class Leftover:
    """The pieces of a sentence that were not taken by the way."""

    def __init__(self, text: Text, taken: list[bool], instead: Mapping[int, str], start: str, goal: str) -> None:
        self.text, self.words, self.taken = text, text.words, taken
        self.start = start  # where the way begins, which "there" does not mean
        self.goal = goal  # where it ends and did not come before: there it can wait without being near otherwise
        self.instead = dict(instead)
        self.notes: list[str] = []
        self.parts: list[str] = []

    def spoken_of_all(self) -> str:
        """What was not taken, without what only carried the way."""
        self.reasons()
        self.carried_things()
        self.short_stops()
        self.with_waits()
        instead, notes = reworded(self.text, self.taken)
        self.instead |= instead
        self.notes += notes
        said: list[str] = []
        for first, last in self.stretches():
            first, last = self.trimmed(first, last)
            spoken = " ".join(self.spoken(first, last).split()) if first < last else ""
            if spoken:
                said.append(spoken)
                self.parts += [self.spoken(*part) for part in self.fragments(first, last) if not self.idle(*part)]
        return ", ".join(said)

    def short_stops(self) -> None:
        """Take the adjective of "a quick stop at the station" out, which is not how to move."""
        for k in range(len(self.words) - 1):
            if self.words[k] in BRIEF and self.words[k + 1] in STOPS and self.taken[k + 1]:
                self.taken[k] = True

    def with_waits(self) -> None:
        """Say a time right behind a place as a wait there: "via the bin (3 s)"."""
        for first, last in self.stretches():
            for begin, end in self.fragments(first, last)[: 1 if first else 0]:
                begin += self.words[begin] == "for"
                k, amount = amount_in(self.words, begin, end)
                others = {*self.words[begin:k], *self.words[k + (amount.used if amount else 0) : end]}
                if amount is not None and amount.unit == "s" and others <= STOPS | WITH:
                    meant = self.meant_before(begin)
                    self.instead |= {n: "" for n in range(begin, end)}
                    self.instead[k] = f"wait {amount.value:g} s {self.at_place(meant)}"

    def circled(self) -> list[str]:
        """The objects that are to be circled."""
        around = (k for k in range(1, len(self.words)) if not self.taken[k] and self.words[k] in ABOUT)
        laps = LAPS | {"time", "times", "round", "circle", "circles", "once", "twice", "go"}
        found = [self.text.object_at(k + 1) for k in around if laps & set(self.words[max(k - 3, 0) : k])]
        return [place[0].objects[0].name for place in found if place is not None and not place[0].unclear]

    def carried_things(self) -> None:
        """Take "carry the soup" out where nothing is known of soup."""
        for i, word in enumerate(self.words):
            concept, said = concept_at(self.words, i)
            if self.taken[i] or not base(word, MOTION | PICKING | STARTS | GOALS) or (concept and said > 1):
                continue
            end = max(self.thing_behind(i + 1), self.thing_between(i))
            if end > i + 1:
                self.notes.append(f"took {' '.join(self.words[i:end])!r} as what is carried")
                self.taken[i:end] = [True] * (end - i)

    def thing_between(self, i: int) -> int:
        """Where "bring the ring |from the vise" ends, whatever a ring is; i where it is no such phrase."""
        end = i + 2
        if not base(self.words[i], CARRYING) or self.words[i + 1 : i + 2] not in (["the"], ["my"], ["our"], ["this"]):
            return i
        while end < min(len(self.words), i + 4) and not self.taken[end] and self.words[end].isalpha():
            end += 1
        plain = not any(self.text.object_at(k) or amount_at(self.words, k) for k in range(i + 2, end))
        return end if i + 2 < end < len(self.words) and self.taken[end] and plain else i

    def thing_behind(self, i: int) -> int:
        """Where the name of an unknown thing at piece i ends, at the end of a stretch or at a mark; i for none."""
        end = i
        while end < min(len(self.words), i + 5) and not self.taken[end] and self.nameless(end):
            end += 1
        closed = (
            end == len(self.words) or self.taken[end] or self.words[end] in JOINTS or concept_at(self.words, end)[0]
        )
        named = any(not is_filler(word) and word not in CARRIERS for word in self.words[i:end])
        return end if closed and named else i

    def nameless(self, k: int) -> bool:
        """Whether a word may be of the name of a thing that ovita does not know."""
        word = self.words[k]
        known = concept_at(self.words, k)[0] or amount_at(self.words, k) or self.text.object_at(k)
        return word.replace("'", "").isalpha() and word not in JOINTS and not known and word not in DENIALS

    def stretches(self) -> list[tuple[int, int]]:
        """The runs of pieces that were not taken."""
        edges = [0, *(k for k in range(1, len(self.taken)) if self.taken[k] != self.taken[k - 1]), len(self.taken)]
        return [(a, b) for a, b in pairwise(edges) if a < b and not self.taken[a]]

    def trimmed(self, first: int, last: int) -> tuple[int, int]:
        """A stretch without the carriers and marks at its edges."""
        fragments = [part for part in self.fragments(first, last) if not self.idle(*part)]
        if not fragments:
            return first, first
        begin, end = fragments[0][0], fragments[-1][1]
        if end == last < len(self.taken):  # "generate a trajectory | from the box"
            kept = end
            end = begin + len(_without_last(self.words[begin:end], CARRIERS | LEADING))
            k, amount = amount_in(self.words, begin, kept)
            end = max(end, k + amount.used) if amount is not None else end
        begin = end - len(_without_last(self.words[begin:end][::-1], LINKS))
        tail = next((n for n in (3, 2) if " ".join(self.words[end - n : end]) in TAILS), 0)
        return begin, max(end - tail, begin)

    def fragments(self, first: int, last: int) -> list[tuple[int, int]]:
        """The runs of words between the joints of a stretch."""
        joints = [first - 1, *(k for k in range(first, last) if self.words[k] in JOINTS), last]
        return [(a + 1, b) for a, b in pairwise(joints) if a + 1 < b]

    def idle(self, first: int, last: int) -> bool:
        """Whether a fragment asks for nothing."""
        why = needless(self.text, first, last, behind=first > 0 and self.taken[first - 1])
        if why:
            self.note(first, last, why)
        return why is not None

    def note(self, first: int, last: int, why: str) -> None:
        """Say what some words were taken as."""
        begin, end = self.text.pieces[first].span[0], self.text.pieces[last - 1].span[1]
        self.notes.append(f"took {self.text.text[begin:end]!r} as {why}")

    def reasons(self) -> None:
        """Take out why something is asked for: "because the floor is wet"."""
        for first, last in self.stretches():
            for begin, end in self.fragments(first, last):
                at = next((k for k in range(begin, end) if reason_at(self.text, k, end)), end)
                if at < end:
                    self.note(at, end, "a reason, not as something to do")
                    self.taken[at:end] = [True] * (end - at)

    def spoken(self, first: int, last: int) -> str:
        """A stretch as it was said, with "there" and "around it" as what they mean where that was named before it."""
        meant = self.meant_before(first)
        text, at, out = self.text.text, self.text.pieces[first].span[0], ""
        for k in range(first, last):
            begin, end = self.text.pieces[k].span
            if k in self.instead:
                gap = " " if self.words[k - 1 : k] and k - 1 in self.instead else text[at:begin]
                out, at = out + gap + self.instead[k], end
            refers = self.words[k] == "there" or (self.words[k] == "it" and self.words[k - 1] in BEFORE_IT)
            if self.text.object_at(k) is not None:
                meant = ""
            if refers and meant:
                out += text[at:begin] + (self.at_place(meant) if self.words[k] == "there" else the(meant))
                at = end
        return out + text[at : self.text.pieces[last - 1].span[1]]

    def at_place(self, name: str) -> str:
        """At an object, or at the goal where that is the end of the way."""
        return "at the goal" if name in ("", self.goal) else f"at {the(name)}"

    def meant_before(self, first: int) -> str:
        """The object that was named last before a piece, or ""."""
        found = [self.text.object_at(k) for k in range(first - 1, -1, -1)]
        named = [place[0].objects[-1].name for place in found if place is not None and not place[0].unclear]
        there = [name for name in named if name != self.start] or named
        return there[0] if there else ""


def _without_last(words: Sequence[str], of: frozenset[str]) -> Sequence[str]:
    """Words without those at the end that are of a set."""
    count = len(words)
    while count and words[count - 1] in of:
        count -= 1
    return words if ENDS & set(words[count:]) and "at" in words[count:] else words[:count]
