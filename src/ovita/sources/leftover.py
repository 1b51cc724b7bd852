"""What a sentence asks for besides the way: its words without those that only carry the way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

from ovita.instruct.lexicon import concept_at, is_filler
from ovita.instruct.numbers import amount_at
from ovita.instruct.objects import BEFORE_IT
from ovita.sources.markers import GOALS, MOTION, PICKING, STARTS, TOURS, VIAS, base
from ovita.sources.places import Text
from ovita.text import the

JOINTS = frozenset(", ; . : ! ? ( ) and then after afterwards but next finally while - / |".split())
"""Marks and words between two things that are said."""

SEQUENCERS = frozenset("then next afterwards finally subsequently later onward onwards lastly on second".split())
"""Words that put what follows behind what was said."""

CARRIERS = frozenset(
    """take bring move go goes going run fly flying travel drive carry make draw plan generate create compute produce
    give show send lead guide route path trajectory way movement motion line course it that which this one let
    have want would like could can you i we please be is should must need to with on by at sort kind of swing
    climb climbing climbs head heading proceed continue along so okay ok well right basically obviously think
    thinking was were am maybe perhaps just now then and me us my your the a an new some there know lets let's see
    up over from start starting do does need needs um uh hey hi hello robot drone arm oh also first sweep swinging
    glide slide shift pass passes passing next here leg trip journey task job possible able wondering mind helpful
    great cool happy glad kindly try manage help if will ask asking asked about how what where get getting gets it's
    i'd i'll you'd don't mission flight drop pick use using via point end stop order reach reaching back home same
    n dear when scan second third return returning
    """.split()
) - {"don't"}
"""Words that carry a route and ask for nothing else."""

LINKS = frozenset("please oh with that which having and so while".split())
"""Words that tie what follows to the way before it."""

TAILS = frozenset(("about it", "on the way", "along the way", "on its way", "on your way", "will you", "would you",
                   "for me"))  # fmt: skip
"""Phrases at the end of a request that ask for nothing more where there is only one way."""

DENIALS, TOUCHING = (
    frozenset("don't not never without avoid avoiding nor no".split()),
    frozenset("hit hitting knock knocking touch touching bump bumping crash crashing collide colliding".split()),
)
"""Words that ask not to touch something, which the limits see to."""

SUBJECTS, STATES = frozenset("the it they he she this that my our".split()), frozenset("is are was were".split())
"""How a remark begins, and its verbs: "the ward is asleep"."""

SPEEDS = frozenset("v vel velocity speed vmax".split())


class Leftover:
    """The pieces of a sentence that were not taken by the way."""

    def __init__(self, text: Text, taken: list[bool], instead: Mapping[int, str], start: str) -> None:
        self.text, self.words, self.taken = text, text.words, taken
        self.start = start  # where the way begins, which "there" does not mean
        self.instead = dict(instead)
        self.notes: list[str] = []
        self.parts: list[str] = []

    def spoken_of_all(self) -> str:
        """What was not taken, without what only carried the way."""
        self.carried_things()
        self.with_units()
        self.with_ceiling()
        said: list[str] = []
        for first, last in self.stretches():
            first, last = self.trimmed(first, last)
            if first < last:
                said.append(self.spoken(first, last))
                self.parts += [self.spoken(*part) for part in self.fragments(first, last) if not self.idle(*part)]
        return ", ".join(said)

    def with_ceiling(self) -> None:
        """Say "ceiling 1.8 m" as a height that is not to be exceeded."""
        for k in range(len(self.words) - 1):
            behind = k + 1 + (self.words[k + 1] in ("of", ":"))
            amount = amount_at(self.words, behind) if self.words[k] == "ceiling" and behind < len(self.words) else None
            if amount is not None and amount.unit == "m" and not self.taken[k]:
                self.instead |= {k: "never higher than"} | {n: "" for n in range(k + 1, behind)}

    def with_units(self) -> None:
        """Give a speed that is a bare number its unit."""
        for k in range(len(self.words) - 1):
            amount = amount_at(self.words, k + 1) if self.words[k] in SPEEDS else None
            if amount is not None and not amount.unit and amount.used == 1 and not self.taken[k]:
                most = self.words[k] == "vmax" or self.words[k - 1 : k] in (["max"], ["maximum"])
                self.instead |= {k: "at most" if most else "at", k + 1: f"{amount.value:g} m/s"}
                self.notes.append(f"took {amount.value:g} as m/s")

    def carried_things(self) -> None:
        """Take "carry the soup" out where nothing is known of soup."""
        for i, word in enumerate(self.words):
            concept, said = concept_at(self.words, i)
            if self.taken[i] or not base(word, MOTION | PICKING | STARTS | GOALS) or (concept and said > 1):
                continue
            end = self.thing_behind(i + 1)
            if end > i + 1:
                self.notes.append(f"took {' '.join(self.words[i:end])!r} as what is carried")
                self.taken[i:end] = [True] * (end - i)

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
        fragments = self.fragments(first, last)
        while fragments and self.idle(*fragments[0]):
            fragments.pop(0)
        while len(fragments) > 1 and self.idle(*fragments[-1]):
            fragments.pop()
        if not fragments:
            return first, first
        begin, end = fragments[0][0], fragments[-1][1]
        if end == last < len(self.taken):  # "generate a trajectory | from the box"
            end = begin + len(_without_last(self.words[begin:end], CARRIERS))
        begin = end - len(_without_last(self.words[begin:end][::-1], LINKS))
        tail = next((n for n in (3, 2) if " ".join(self.words[end - n : end]) in TAILS), 0)
        return begin, max(end - tail, begin)

    def fragments(self, first: int, last: int) -> list[tuple[int, int]]:
        """The runs of words between the joints of a stretch."""
        joints = [first - 1, *(k for k in range(first, last) if self.words[k] in JOINTS), last]
        return [(a + 1, b) for a, b in pairwise(joints) if a + 1 < b]

    def idle(self, first: int, last: int) -> bool:
        """Whether a fragment asks for nothing: it carries the way, is a remark, or says what the limits see to."""
        words = self.words[first:last]
        verbs = MOTION | STARTS | GOALS | VIAS | TOURS
        if all(word in CARRIERS or is_filler(word) or base(word, verbs) for word in words):
            return True
        if any(amount_at(self.words, k) is not None for k in range(first, last)):
            return False
        why = self.needless(words) or self.remarked(first, last)
        if why:
            text, pieces = self.text.text, self.text.pieces
            self.notes.append(f"took {text[pieces[first].span[0] : pieces[last - 1].span[1]]!r} as {why}")
        return bool(why)

    def needless(self, words: Sequence[str]) -> str:
        """Why words that forbid what is never done need not be followed, or ""."""
        denied = next((k for k, word in enumerate(words) if word in DENIALS), len(words))
        touch = next((k for k, word in enumerate(words) if word in TOUCHING), -1)
        return "what the limits see to" if touch > denied else ""

    def remarked(self, first: int, last: int) -> str:
        """What a fragment is that only tells how things are, or ""."""
        words = self.words[first:last]
        states = words[0] in SUBJECTS and bool(STATES & set(words)) and self.tells_nothing(first, last)
        return "a remark, not as something to do" if states or list(words[:2]) == ["never", "mind"] else ""

    def tells_nothing(self, first: int, last: int) -> bool:
        """Whether a fragment names no object and nothing to do."""
        known = [concept_at(self.words, k)[0] for k in range(first, last) if self.words[k] not in STATES]
        objects = [self.text.object_at(k) for k in range(first, last)]
        return not any(known) and not any(objects)

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
                out += text[at:begin] + (f"at {the(meant)}" if self.words[k] == "there" else the(meant))
                at = end
        return out + text[at : self.text.pieces[last - 1].span[1]]

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
    return words[:count]
