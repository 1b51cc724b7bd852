"""Whether an utterance looks back at what was done, or is an instruction of its own.

Plain facts of its words count points for the one or the other; their sum says how likely the feedback that was read is
meant.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import pairwise
from typing import TypeAlias

from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.editing import OPPOSITE, apply, directions_of
from ovita.instruct.lexicon import CONNECTIVES, DETERMINERS, filler
from ovita.instruct.remarks import FACTORS, SKIPPED, Candidate, Phrase, Remark
from ovita.paths.part import WHOLE
from ovita.paths.scene import Scene

LIKELY = 0.39
"""How likely feedback has to be meant to be taken as such."""

EVEN = 0.5
"""How likely feedback has to be meant, among the ways to take it, to be done without being shown first."""

FEW = 8
"""Words and marks of feedback that is so short that the network is not asked what it thinks of the rules' reading."""

COMMANDS = frozenset("undo redo restart accept explain again flip meant except also same".split())
"""Cues that no instruction of its own has."""

OPENING = frozenset(
    """go move shift drive fly raise lift run proceed be keep stay get hold veer boost do halve cut slow speed turn
    steer take bring make let leave pass come avoid reduce increase decrease lower put start end finish stop wait pause
    circle bend""".split()
)
"""Verbs that open an instruction: "go at a slower rate" is one, "slower" is none."""

BACKWARD = frozenset(
    """more less again that that's those these too not only just instead than still yet even enough same also was were
    been had did said meant mean sorry back other opposite wrong change part thing no nope nah never rather as so fine
    ok okay good better further another undo redo forget cancel scrap drop kill lose remove yes""".split()
)
"""Words that speak of what was done, or of what is meant instead."""

PLACING = frozenset(
    """near around at by from to of over under past before after behind beside above below toward towards off between
    along with clear reaching into""".split()
)
"""Words before a place."""

ARTICLES = frozenset("the a an his her my your our their its two".split())

LEADING = SKIPPED | frozenset(
    "in on at near by over from of to around during while and just for with , . ! ? but".split()
)
"""Words that may stand beside a place that is all that is said."""

PAST = frozenset("was did said had been were went that's".split())


@dataclass(frozen=True)
class Retrospect:
    """An utterance as feedback, beside the instruction that it would be.

    Args:
        said: The utterance.
        best: The likeliest way to read it as feedback.
        fresh: What it is as an instruction.
        score: How much of it the feedback reads.
        weight: How much each of its pieces says.
    """

    said: Remark
    best: Candidate
    fresh: F.Reading
    score: float
    weight: Callable[[Phrase], float]

    @cached_property
    def reading(self) -> F.Reading:
        """The feedback, with what it leaves out."""
        return F.Reading(edits=self.best.edits, unread=self.unread, question=self.best.question, asked=self.best.asked)

    @cached_property
    def plain(self) -> bool:
        """Whether the rules are enough: few words of feedback, or an instruction by its first word, all of it read."""
        if looks_back(self):
            return len(self.said.pieces) <= FEW and not self.unread
        return self.whole and {*self.tokens[:1]} <= OPENING

    @cached_property
    def points(self) -> float:
        """What speaks for feedback and against an instruction, as the logarithm of odds."""
        return sum(worth * float(fact(self)) for worth, fact in FACTS.values())

    @cached_property
    def clauses(self) -> set[int]:
        """The clauses that the feedback is read from."""
        return {p.clause for p in self.best.used}

    @cached_property
    def near(self) -> list[Phrase]:
        """The pieces of these clauses."""
        return [p for p in self.said.active if p.clause in self.clauses]

    @cached_property
    def words(self) -> list[Phrase]:
        """Those of them that say something."""
        return [p for p in self.near if p.content]

    @cached_property
    def left(self) -> list[Phrase]:
        """The pieces that the feedback does not use."""
        used = {id(p) for p in self.best.used}
        return [p for p in self.said.active if id(p) not in used]

    @cached_property
    def cues(self) -> set[str]:
        """The cues that it is read from."""
        return {cue for p in self.best.used for cue in p.cues}

    @cached_property
    def unread(self) -> tuple[str, ...]:
        """What it says and the feedback leaves out."""
        return tuple(p.text for p in self.left if p.content and self.weight(p) >= 1.5)

    @cached_property
    def whole(self) -> bool:
        """Whether it reads whole as an instruction."""
        return bool(self.fresh.frames) and not (self.fresh.unread or self.fresh.question or self.fresh.improper)

    @cached_property
    def known(self) -> set[str]:
        """The objects of what was done."""
        return {name for frame in self.said.before for name in frame.named}

    @cached_property
    def tokens(self) -> list[str]:
        """Its words."""
        return [word for p in self.said.active for word in p.text.split()]

    @cached_property
    def opens(self) -> bool:
        """Whether one of these clauses begins as an instruction does."""
        firsts = {p.clause: p.text.split()[0] for p in reversed(self.near) if p.text[0].isalnum()}
        return any(word in OPENING for word in firsts.values())

    def edits(self, *kinds: type[E.Edit]) -> bool:
        """Whether the feedback has edits of some kinds."""
        return any(isinstance(edit, kinds) for edit in self.best.edits)


def looks_back(it: Retrospect) -> bool:
    """Whether an utterance is feedback rather than an instruction."""
    if not (it.best.edits or it.best.question):
        return False
    if it.best.edits and all(isinstance(edit, E.Also) for edit in it.best.edits):
        return not (it.whole and _joins(it))
    if not it.said.before or (it.whole and it.best.question):
        return not it.said.before
    if _settled(it):
        return True
    return 1 / (1 + math.exp(-it.points)) > LIKELY


def kin(frame: F.SemanticFrame, known: F.SemanticFrame) -> bool:
    """Whether two frames are about the same: of one kind, and along the same axis if they have one."""
    ways, others = directions_of(frame), directions_of(known)
    along = not ways or not others or any(w in (o, OPPOSITE[o]) for w in ways for o in others)
    return frame.NAME == known.NAME and along


def _settled(it: Retrospect) -> bool:
    """Whether it says that the same kind of change is meant otherwise: "... instead", "without the slowing down"."""
    gone = it.edits(E.Drop) and {"without", "alone", "original"} & set(it.tokens)
    rest = "rest" in it.tokens and it.said.cued("keep")
    if _of_it(it) and it.edits(E.Rescale) and len(it.words) <= 3 and not _akin(it):  # "increase it by 50 %"
        return True
    return _akin(it) and bool(gone or rest or it.tokens[-1:] == ["instead"])


def _joins(it: Retrospect) -> bool:
    """Whether an "also" stands between two things to do, not before or behind all: "go up, also be slower"."""
    also = it.said.cued("also")
    words = [p for p in it.said.pieces if p.text[0].isalnum()]
    return (
        len(it.fresh.frames) > 1 and bool(also) and not set(map(id, also)) & {id(p) for p in (*words[:2], *words[-1:])}
    )


def _akin(it: Retrospect) -> bool:
    return any(kin(frame, known) for frame in it.fresh.frames for known in it.said.before)


def _bare(it: Retrospect) -> bool:
    """Whether it reads whole as an instruction, and no word of it looks back."""
    back = set(it.tokens) & BACKWARD or it.said.beside or it.said.praised or _of_it(it) or _compares(it)
    return it.whole and not back and not it.edits(E.Command, E.Flip)


def _compares(it: Retrospect) -> bool:
    """Whether it is little more than a comparative: "a bit higher yet"."""
    short = len([p for p in it.said.active if p.content]) <= 3 and not it.opens
    return short and any(p.text.split()[0].endswith("er") for p in it.words)


def _of_it(it: Retrospect) -> bool:
    """Whether an amount is one on what was done: "double it", "half of that", "reduce it by half", "50 % more"."""
    pairs = [*pairwise(it.said.active), *((q, p) for p, q in pairwise(it.said.active))]
    much = {*FACTORS, "more", "less"}
    by = any(p.cues & much and q.text in ("it", "that", "this", "them", "of") for p, q in pairs)
    return by or any(p.number and p.number.unit in ("%", "x") and q.cues & {"more", "less"} for p, q in pairs)


def _says_where(it: Retrospect) -> bool:
    """Whether a part of the path comes with a word that restricts to it or leaves it out."""
    return it.edits(E.Restrict, E.Except) and bool(it.said.cued("only", "except", "not", "but"))


def _among_words(it: Retrospect) -> bool:
    """Whether words of an instruction surround a mere place: "finish on the cup" restricts nothing."""
    mere = bool(it.best.edits) and all(isinstance(edit, E.Restrict | E.Except) for edit in it.best.edits)
    left = {id(p) for p in it.left}
    return mere and not _corrects(it) and any(id(p) in left and p.text.split()[0] not in LEADING for p in it.near)


def _corrects(it: Retrospect) -> bool:
    """Whether it says that something else was meant or is enough: "left by 0.3 instead", "no, make it 0.3"."""
    cued = it.said.cued("meant", "enough", "also", "same", "only", "not", "except", "undo", "whole")
    return it.said.pieces[0].text in ("no", "nope", "nah", "make") or bool(cued)


@cache
def _small() -> frozenset[str]:
    """Words that say nothing by themselves."""
    return frozenset({*filler(), *CONNECTIVES, *DETERMINERS, *SKIPPED, *BACKWARD, *PAST, *PLACING})


def _odd(it: Retrospect) -> float:
    """How many words beside it nothing knows, 4 at most, in pairs."""
    return min(sum(p.text[0].isalpha() and not p.content and p.text not in _small() for p in it.near), 4) / 2


def _unknown(it: Retrospect) -> Iterator[str]:
    """What stands before each "the" whose noun no reader knows: "near the fan" where there is none."""
    unread = {word.lower() for words in it.fresh.unread for word in words.split()}
    for i, p in enumerate(it.near):
        behind = it.near[i + 1 : i + 3] if p.text in ARTICLES else []
        noun = next((q for q in behind if not (q.text in filler() and q is not behind[-1])), None)
        if noun is not None and not noun.content and noun.text not in _small() and (not unread or noun.text in unread):
            yield it.near[i - 1].text.split()[-1] if i else ""


def _share(it: Retrospect) -> float:
    """How much of the clauses it is read from (0..1)."""
    left = {id(p) for p in it.left}
    return sum(it.weight(p) for p in it.words if id(p) not in left) / (sum(map(it.weight, it.words)) or 1.0)


def _length(it: Retrospect) -> float:
    """Words of the clauses that it is read from, 20 at most, in tens."""
    return min(sum(len(p.text.split()) for p in it.near), 20) / 10


def _named(pieces: Sequence[Phrase]) -> set[str]:
    return {name for p in pieces for name in p.items}


Fact: TypeAlias = Callable[[Retrospect], float | bool]

FACTS: dict[str, tuple[float, Fact]] = {
    "always": (0.14, lambda it: True),
    "no instruction": (1.70, lambda it: not it.fresh.frames),
    "an instruction": (-1.17, lambda it: it.whole),
    "nothing looks back": (-1.49, _bare),
    "an instruction with amounts": (-1.47, lambda it: any(frame.quantities for frame in it.fresh.frames)),
    "an instruction that asks back": (-1.13, lambda it: bool(it.fresh.question)),
    "an instruction with a place": (-0.76, lambda it: any(frame.part != WHOLE for frame in it.fresh.frames)),
    "opens as an instruction": (-0.89, lambda it: it.whole and it.opens),
    "a place": (-1.63, lambda it: it.edits(E.Restrict)),
    "but for a place": (-1.10, lambda it: it.edits(E.Except)),
    "only there or not there": (1.59, _says_where),
    "a place among words": (-0.96, _among_words),
    "takes away": (0.27, lambda it: it.edits(E.Drop)),
    "an instruction that was meant": (0.55, lambda it: it.whole and bool(it.said.cued("meant"))),
    "an instruction with a not": (0.37, lambda it: it.whole and bool(it.said.cued("not", "enough"))),
    "once more": (0.29, lambda it: it.edits(E.Again)),
    "a word of a dialogue": (0.10, lambda it: bool(it.cues & COMMANDS)),
    "an instruction by a dialogue's word": (0.14, lambda it: it.whole and bool(it.cues & COMMANDS)),
    "praise beside it": (-0.14, lambda it: bool(it.said.praised)),
    "other kinds of change": (-1.27, lambda it: it.said.elsewhere),
    "another object": (-0.73, lambda it: bool(_named(it.said.active) - it.known)),
    "much unread": (-1.43, lambda it: len(it.unread) > 1),
    "unknown words": (-0.72, _odd),
    "an unknown thing": (-0.84, lambda it: any(True for _ in _unknown(it))),
    "a place at an unknown thing": (-2.49, lambda it: any(word in PLACING for word in _unknown(it))),
    "share read": (1.49, _share),
    "score": (0.96, lambda it: it.score / 5),
    "length": (-2.67, _length),
    "a phrase of a dialogue": (
        1.41,
        lambda it: any(len(p.text.split()) > 1 and p.cues & COMMANDS for p in it.best.used),
    ),
    "the past": (1.20, lambda it: bool(set(it.tokens) & PAST)),
    "still": (1.89, lambda it: bool(it.said.cued("weak", "again"))),
    "meant": (1.30, lambda it: bool(it.said.cued("meant"))),
    "not": (0.49, lambda it: bool(it.said.cued("not", "enough"))),
    "that": (1.17, lambda it: "that" in it.tokens),
    "double it": (1.44, _of_it),
    "the other side": (2.07, lambda it: it.said.beside),
}
"""What each fact counts, as logarithms of odds; `training/looking_back.py` fits them on feedback and first requests."""


@dataclass(frozen=True)
class Hearing:
    """What the network says of an utterance.

    Args:
        edits: As feedback.
        alone: As an instruction of its own.
        rules: How likely it holds the feedback that the rules read, as a logarithm.
    """

    edits: F.Reading
    alone: F.Reading
    rules: float


def weighed(it: Retrospect, heard: Hearing) -> F.Reading | None:
    """The feedback of the rules or of the network, with how likely it is meant; None if an instruction is likelier."""
    readings = ways(it, heard)
    points = {who: sum(worth * float(fact(it, heard)) for worth, fact in GROUNDS[who].values()) for who in readings}
    best = max(points, key=lambda who: points[who])
    reading = readings[best]
    likely = 1 / sum(math.exp(value - points[best]) for value in points.values())
    return None if reading is None else replace(reading, confidence=likely)


def ways(it: Retrospect, heard: Hearing) -> dict[str, F.Reading | None]:
    """The ways to take an utterance, by the names of GROUNDS: the feedback that each is, None for an instruction."""
    found: dict[str, F.Reading | None] = {"instruction": None}
    if it.best.question or not _idle(it.best.edits, it.said.before):
        found["rules"] = it.reading
    mere = heard.edits.question or all(isinstance(edit, E.Also) for edit in heard.edits.edits)
    if not (mere or _agree(it, heard) or _idle(heard.edits.edits, it.said.before)):
        found["network"] = heard.edits
    return found


def _idle(edits: Sequence[E.Edit], before: tuple[F.SemanticFrame, ...]) -> bool:
    """Whether edits change nothing: a number for a slot that takes none of its unit."""
    sure = any(isinstance(edit, E.Command | E.Again | E.Rescale) for edit in edits)
    return not sure and apply(edits, before, Scene()) == before


def _agree(it: Retrospect, heard: Hearing) -> bool:
    """Whether the feedback of the rules and of the network comes to the same, but for numbers, which the rules read."""
    both = (it.best.edits, heard.edits.edits)
    slots = [[edit.slot if isinstance(edit, E.Set) else "" for edit in edits] for edits in both]
    commands = [[edit for edit in edits if isinstance(edit, E.Command)] for edits in both]
    if not all(both) or commands[0] != commands[1]:
        return False
    alike = slots[0] == slots[1] and all(slots[0])
    return alike or F.same(*(apply(edits, it.said.before, Scene()) for edits in both))


def _odds(likely: float) -> float:
    likely = min(max(likely, 0.02), 0.98)
    return math.log(likely / (1 - likely))


Ground: TypeAlias = Callable[[Retrospect, Hearing], float | bool]

GROUNDS: dict[str, dict[str, tuple[float, Ground]]] = {
    "instruction": {
        "length": (0.47, lambda it, heard: min(sum(len(p.text.split()) for p in it.said.pieces), 20) / 10),
        "another object": (0.11, lambda it, heard: bool(_named(it.said.active) - it.known)),
        "other kinds of change": (0.72, lambda it, heard: it.said.elsewhere),
        "to the network": (0.27, lambda it, heard: _odds(heard.alone.confidence) if heard.alone.frames else 0.0),
    },
    "rules": {
        "looks back": (0.37, lambda it, heard: min(max(it.points, -6.0), 6.0)),
        "taken by the rules alone": (0.76, lambda it, heard: looks_back(it)),
        "both agree": (2.75, lambda it, heard: _agree(it, heard)),
        "likelihood": (0.45, lambda it, heard: max(heard.rules, -25.0) / 5),
    },
    "network": {
        "confidence": (0.91, lambda it, heard: _odds(heard.edits.confidence)),
        "unread": (0.76, lambda it, heard: bool(heard.edits.unread)),
        "nothing to the rules": (-0.26, lambda it, heard: not it.best.edits),
    },
}
"""What speaks for taking an utterance as an instruction, or as the feedback that the rules or the network read, and
how much, as logarithms of odds; `training/feedback_points.py` fits them on voices that the network had not seen."""
