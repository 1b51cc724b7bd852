"""The referee: from two readings of an utterance to a verdict: do it, show it first, ask back, or decline.

It reads nothing itself. It compares the readings, counts what they leave unused, and holds them against plain facts of
the utterance: its numbers, objects, directions, negations and bounds. Each ground counts some points; their sum says
how likely a reading is meant.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

from ovita.instruct import frames as F
from ovita.instruct.chunks import Chunk
from ovita.instruct.contradictions import CHECKS, LEFT, NEVER, contradictions
from ovita.instruct.edits import Also, Edit
from ovita.instruct.facts import BOUNDS, UNKNOWN, clauses, opposed
from ovita.instruct.meaning import same
from ovita.instruct.patterns import FRACTION
from ovita.instruct.rules import PAUSES
from ovita.instruct.senses import DOING
from ovita.paths.part import WHOLE

Outcome = Literal["do", "needs_confirmation", "ask", "decline"]
Who = Literal["rules", "learned"]
By = Literal["both", "rules", "learned"]
Weighed = Mapping[str, float]

POINTS = {
    "always": 0.94,
    "both agree": 1.57,
    "agree but for words left": 0.47,
    "confidence": 0.68,
    "the rules read otherwise": -0.09,
    "contradicted": -0.72,
    "the other contradicted": 0.17,
    "likelihood": 0.53,
    "in common": 0.33,
    "the other reads nothing": -0.11,
}
"""What each ground counts, as logarithms of odds; `training/referee.py` fits them on voices that the network had not
seen."""

DO, SHOW = 0.80, 0.15
"""How likely a reading has to be meant to be done at once, and to be shown."""

WHOLE_READ = 0.56
"""How likely it has to be where the rules read every word and nothing speaks against it."""

AGAINST_WHOLE = 0.82
"""How likely the network's reading has to be to be done where the rules read every word, and read it otherwise."""

CERTAIN = 0.93
"""How likely a reading has to be for words that it leaves not to matter, however few there are."""

CURT, DOUBTED = 5, 10
"""Chunks of an utterance that is so short that every word of it counts, and that every doubt about it does."""


@dataclass(frozen=True)
class Understanding:
    """What is to be done about an utterance.

    Args:
        outcome: Do it, show it and ask for a yes, ask back, or decline.
        reading: The reading that counts: its frames or edits, its question, or why it declines.
        by: Whose reading that is.
        unused: Words that it does not use and that may ask for something.
        doubts: What speaks against it, as sentences.
        confidence: How likely it is meant (0..1).
        rules: What the rules made of it, or None.
        learned: What the learned reader made of it, or None where there is none.
        apart: What was heard before both read the rest (`heard_apart`); the reading holds it, too.
    """

    outcome: Outcome
    reading: F.Reading
    by: By
    unused: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    confidence: float = 0.0
    rules: F.Reading | None = None
    learned: F.Reading | None = None
    apart: tuple[F.SemanticFrame, ...] = ()

    @property
    def whole(self) -> bool:
        """Whether the rules read all of it, so that another reading is one against them."""
        return self.rules is not None and _read_all(self.rules)


def judged(
    said: Sequence[Chunk], rules: F.Reading, learned: F.Reading | None, weighed: Weighed | None = None
) -> Understanding:
    """The verdict on what two readers made of an utterance.

    Args:
        said: The utterance in chunks.
        rules: What the rules made of it.
        learned: What the learned reader made of it; None where there is none.
        weighed: How likely the network holds each of the two readings to be (`learned.NetworkReading.weigh`).
    """
    if rules.improper and not rules.unread and (_bounds(rules) or not reads(learned)):
        return Understanding("decline", rules, "rules", confidence=1.0, rules=rules, learned=learned)
    found = both_readings(said, rules, learned, weighed)
    if not found.candidates or all(chunk.kind in UNKNOWN | {"OBJ"} for chunk in said):
        guessed = all(chunk.kind in UNKNOWN for chunk in said) and not (learned and learned.asks)
        return replace(_unread(rules, F.Reading() if guessed else learned), rules=rules, learned=learned)
    return _decided(said, rules, learned, found)


def _decided(said: Sequence[Chunk], rules: F.Reading, learned: F.Reading | None, found: Readings) -> Understanding:
    """The verdict on the likelier of two readings, as they are weighed."""
    by, reading, confidence = found.likeliest()
    unplaced, sure = _unplaced(said, rules), found.sure(by, confidence)
    by = "both" if _agree(rules, learned) else by  # also where the rules leave a word
    left = (*reading.unread, *(unplaced if by == "both" or len(said) <= CURT else ()))
    doubts = (*contradictions(said, frames_of(reading)), *found.besides)
    at_once = sure and not (found.besides or _shown_first(said, reading, (*left, *unplaced), confidence >= CERTAIN))
    outcome: Outcome = "do" if at_once else "needs_confirmation" if sure or confidence >= SHOW else "decline"
    return Understanding(outcome, reading, by, tuple(dict.fromkeys(left)), doubts, confidence, rules, learned)


def both_readings(
    said: Sequence[Chunk], rules: F.Reading, learned: F.Reading | None, weighed: Weighed | None = None
) -> Readings:
    """What counts of two readings of an utterance, as for `judged`."""
    in_part = _share_read(said, rules) if _agree(rules, learned) else 0.0
    return Readings(said, _all_or_nothing(said, rules, learned), learned, weighed, in_part)


def _bounds(reading: F.Reading) -> bool:
    """Whether a reading holds limits."""
    return any(q.role in BOUNDS for frame in reading.frames for q in frame.quantities.values())


def _all_or_nothing(said: Sequence[Chunk], rules: F.Reading, learned: F.Reading | None) -> F.Reading:
    """What counts of the rules' reading: all or nothing, but for feedback, and where the network has nothing to say."""
    if learned is None or rules.edits or (not reads(learned) and learned.confidence < REFUSING):
        return rules
    counts = not rules.unread and (reads(learned) or read_whole(said, rules))
    return rules if counts else replace(rules, frames=())


REFUSING = 0.6
"""How sure the network has to be that nothing can be done, for a part that the rules read not to be shown."""


def _share_read(said: Sequence[Chunk], rules: F.Reading) -> float:
    """Which share of the words that may ask for something the rules used (0..1)."""
    asking = sum(chunk.kind not in UNKNOWN or chunk.kind == "unknown" for chunk in said)
    return max(1.0 - len(rules.unread) / max(asking, 1), 0.0)


def _unplaced(said: Sequence[Chunk], rules: F.Reading) -> tuple[str, ...]:
    """The words that the rules did not read; where they read nothing at all, those that only a guess can place."""
    if reads(rules):
        return rules.unread
    guessed = {chunk.text for chunk in said if chunk.kind in GUESSED}
    return tuple(word for word in rules.unread if word in guessed)


GUESSED = frozenset(("unknown", "after", "before", *FRACTION))
"""Classes of words of which nothing else in an utterance tells what they ask for."""


@dataclass(frozen=True)
class Readings:
    """What two readers made of one utterance.

    Args:
        said: The utterance in chunks.
        rules: What the rules made of it.
        learned: What the learned reader made of it; None where there is none.
        weighed: How likely the network holds each of the two readings to be (`learned.NetworkReading.weigh`).
        in_part: Which share of the words the rules used for the same reading; 0 where they read otherwise.
    """

    said: Sequence[Chunk]
    rules: F.Reading
    learned: F.Reading | None
    weighed: Weighed | None = None
    in_part: float = 0.0

    @cached_property
    def agree(self) -> bool:
        """Whether both readers say what to do, and the same."""
        return _agree(self.rules, self.learned)

    @cached_property
    def whole(self) -> bool:
        """Whether the rules read every word, and nothing speaks against what they read."""
        return read_whole(self.said, self.rules)

    @cached_property
    def refused(self) -> bool:
        """Whether the network is sure that nothing can be done, or near certain that a question has to be asked."""
        if self.learned is None:
            return False
        asks = bool(self.learned.question) and self.learned.confidence >= AGAINST_WHOLE
        refuses = self.learned.improper and self.learned.confidence >= REFUSING
        return asks or (bool(refuses) and not self.told_apart)

    @property
    def besides(self) -> tuple[str, ...]:
        """What the network says of a wish that no frame can say, unless the rules read every word."""
        told = "" if self.learned is None or self.whole else self.learned.besides
        return (told,) if told else ()

    @cached_property
    def candidates(self) -> dict[Who, F.Reading]:
        """The readings that say what to do; one that both agree on is the rules'."""
        both: dict[Who, F.Reading | None] = {"rules": self.rules, "learned": None if self.agree else self.learned}
        return {by: one for by, one in both.items() if one is not None and reads(one)}

    def likeliest(self) -> tuple[By, F.Reading, float]:
        """Whose reading is the likeliest, the reading, and how likely it is meant (0..1)."""
        rated = {by: likelihood(self.grounds(by)) for by in self.candidates}
        prevail = self._rules_prevail(rated.get("rules", 0.0))
        best: Who = "rules" if prevail else max(rated, key=lambda by: rated[by])
        return "both" if self.agree else best, self.candidates[best], rated[best]

    def sure(self, by: By, confidence: float) -> bool:
        """Whether a reading is likely enough to be done, more so one against an utterance that the rules read."""
        if self.whole and by == "learned":
            return confidence >= (AGAINST_WHOLE if len(self.said) > CURT else CERTAIN)
        if self.whole and self.told_apart:
            return True
        return confidence >= (WHOLE_READ if self.whole and not self.refused else DO)

    @cached_property
    def told_apart(self) -> bool:
        """Whether the network finds a contradiction where a part is told from the rest: "fast, but slowly near it"."""
        apart = any(frame.part.kind == "outside" for frame in frames_of(self.rules))
        return apart and bool(self.learned and self.learned.improper)

    def _rules_prevail(self, likely: float) -> bool:
        """Whether the rules read all of it, and the network leaves words, is contradicted or means another part.

        Or it holds the opposite, where the rules are likely enough to be done.
        """
        if not self.whole or self.learned is None or "rules" not in self.candidates:
            return False
        mine, theirs = frames_of(self.rules), frames_of(self.learned)
        doubtful = self.learned.unread or contradictions(self.said, theirs)
        return bool(doubtful) or _but_for_the_part(theirs, mine) or (likely >= WHOLE_READ and opposed(theirs, mine))

    def grounds(self, by: Who) -> dict[str, float]:
        """What speaks for and against a reader's reading, by the names of POINTS."""
        one, other = (self.rules, self.learned) if by == "rules" else (self.learned or F.Reading(), self.rules)
        met = reads(other)
        heard = self.learned is not None and (self.agree or by == "learned")
        sure = min(max(self.learned.confidence, 0.02), 0.98) if self.learned is not None and heard else 0.5
        theirs = frames_of(other or F.Reading())
        return {
            "always": 1.0,
            "both agree": float(self.agree),
            "agree but for words left": 0.0 if self.agree else self.in_part,
            "confidence": math.log(sure / (1.0 - sure)),
            "the rules read otherwise": float(by == "learned" and met),
            "contradicted": float(bool(contradictions(self.said, frames_of(one)))),
            "the other contradicted": float(not self.agree and bool(contradictions(self.said, theirs))),
            "likelihood": max(self.weighed[by], UNLIKELY) / 5.0 if self.weighed else 0.0,
            "in common": _shared(frames_of(one), theirs) if met and not self.agree else 0.0,
            "the other reads nothing": float(other is not None and not met),
        }


UNLIKELY = -25.0
"""The least log-likelihood that counts."""


def likelihood(found: Mapping[str, float]) -> float:
    """How likely a reading is meant (0..1), from the grounds for and against it."""
    return 1.0 / (1.0 + math.exp(-sum(POINTS[name] * value for name, value in found.items())))


def _shown_first(said: Sequence[Chunk], reading: F.Reading, left: Sequence[str], certain: bool) -> bool:
    """Whether a likely reading is not done at once: for what the words hold, or for strange or left ones."""
    if _taken_back(said, left) or contradictions(said, frames_of(reading), NEVER):
        return True
    if len(said) <= DOUBTED:
        checks = CHECKS if len(said) <= CURT or not certain else LEFT
        if contradictions(said, frames_of(reading), checks):
            return True
    if len(said) <= CURT and _matters(said, left, certain):
        return True
    figure_left = any(chunk.kind in FIGURES and chunk.text in reading.unread for chunk in said)
    return figure_left or any(map(_is_strange_wish, clauses(said)))


FIGURES = frozenset("circle spiral eight zigzag".split())
"""Classes of words for a figure; one that is left is what the wish is about."""


def _is_strange_wish(clause: Sequence[Chunk]) -> bool:
    """Whether a clause begins with a word that nobody knows: "and moonwalk near the cup"."""
    return [chunk.kind for chunk in clause[:2]] == ["and", "unknown"]


def _taken_back(said: Sequence[Chunk], unread: Sequence[str]) -> bool:
    """Whether a clause denies what another one asks for: "stop there, no, don't stop"."""
    row = clauses(said)
    denied = [c for c in row if any(chunk.kind == "never" and chunk.text in unread for chunk in c)]
    kinds = [{chunk.kind for clause in row if (clause in denied) is no for chunk in clause} for no in (True, False)]
    return bool(kinds[0] & kinds[1] & DOING)


def _matters(said: Sequence[Chunk], left: Sequence[str], certain: bool) -> bool:
    """Whether words that are left of few may ask for something: known words, or a clause of which nothing is read."""
    if not certain:
        return bool(left)
    strange = [[chunk.text in left for chunk in clause if chunk.kind not in PAUSES] for clause in clauses(said)]
    known = any(chunk.text in left and chunk.kind not in UNKNOWN | {"never"} for chunk in said)
    return known or any(clause and all(clause) for clause in strange)


def _read_all(rules: F.Reading) -> bool:
    """Whether the rules read every word."""
    return reads(rules) and not rules.unread


def read_whole(said: Sequence[Chunk], rules: F.Reading) -> bool:
    """Whether the rules read every word, and nothing speaks against what they read."""
    return _read_all(rules) and not contradictions(said, frames_of(rules))


def _unread(rules: F.Reading, learned: F.Reading | None) -> Understanding:
    """The verdict where no reader has anything to go by: the first question, else the first reason to decline."""
    both: dict[By, F.Reading] = {"rules": rules, "learned": learned or F.Reading()}
    for by, one in both.items():
        if one.question:
            return Understanding("ask", one, by, one.unread, confidence=one.confidence)
    by = next((by for by, one in both.items() if one.improper), "rules")
    return Understanding("decline", both[by], by, both[by].unread, confidence=both[by].confidence)


def _but_for_the_part(one: Sequence[F.SemanticFrame], other: Sequence[F.SemanticFrame]) -> bool:
    """Whether two readings differ only in parts of the path, degrees, an end or a pass there, and "speed up to"."""
    mine, theirs = (tuple(map(_roughly, frames)) for frames in (one, other))
    return same(mine, theirs)


def _roughly(frame: F.SemanticFrame) -> F.SemanticFrame:
    match frame:
        case F.MoveEnd(end="goal", relation="to", offset=(), place=str() as place) if place not in ("", *F.SPOTS):
            frame = F.Visit(objects=(place,), relation="at")
        case F.MoveEnd(level=F.Quantity() as level):
            frame = F.Height(level=level)
        case F.Pace(change="rampup", amount=F.Quantity(role="to")):
            frame = replace(frame, change="set")
    return replace(frame, part=WHOLE, degree=None)


def _shared(one: Sequence[F.SemanticFrame], other: Sequence[F.SemanticFrame]) -> float:
    """Which share of their frames two readings have in common."""
    alike = sum(any(same((frame,), (twin,)) for twin in other) for frame in one)
    return 2.0 * alike / max(len(one) + len(other), 1)


def reads(reading: F.Reading | None) -> bool:
    """Whether a reading says what to do."""
    return reading is not None and bool(reading.frames or reading.edits) and not (reading.question or reading.improper)


def _agree(one: F.Reading | None, other: F.Reading | None) -> bool:
    if one is None or other is None or not (reads(one) and reads(other)):
        return False
    plain = [[edit for edit in reading.edits if not isinstance(edit, Also)] for reading in (one, other)]
    return plain[0] == plain[1] and same(frames_of(one), frames_of(other))


def items_of(reading: F.Reading) -> tuple[F.SemanticFrame | Edit, ...]:
    """What a reading asks for: edits of feedback, else frames."""
    return reading.edits or reading.frames


def frames_of(reading: F.Reading) -> tuple[F.SemanticFrame, ...]:
    """The frames of a reading, those that its edits add among them."""
    return (*reading.frames, *(edit.frame for edit in reading.edits if isinstance(edit, Also)))
