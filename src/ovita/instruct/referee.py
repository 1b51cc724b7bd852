"""The referee: from what the readers made of an utterance to a verdict: do it, show it first, ask back, or decline.

It reads nothing itself. It compares the readings, counts what they leave unused, and holds them against plain facts of
the utterance: its numbers, objects, directions, negations and bounds. Each ground counts some points; their sum says
how likely a reading is meant.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal, TypeGuard

from ovita.errors import OvitaError
from ovita.instruct import frames as F
from ovita.instruct.chunks import Chunk, chunks
from ovita.instruct.contradictions import BOUNDS, CHECKS, NEVER, UNKNOWN, clauses, contradictions, elsewhere, opposed
from ovita.instruct.edits import Also, Edit
from ovita.instruct.frames import name_of
from ovita.instruct.lexicon import extent_of, written_out
from ovita.instruct.selfrepair import repaired
from ovita.instruct.slots import TRAINED
from ovita.instruct.together import spread, with_units
from ovita.paths.part import WHOLE
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory

if TYPE_CHECKING:
    from ovita.instruct.feedback import Reader
    from ovita.instruct.learned import LearnedReader
    from ovita.instruct.looking_back import Hearing, Retrospect

Outcome = Literal["do", "needs_confirmation", "ask", "decline"]
Who = Literal["rules", "learned"]
By = Literal["both", "rules", "learned"]
Weighed = Mapping[str, "tuple[float, float] | None"]

POINTS = {
    "always": 1.34,
    "both agree": 1.96,
    "confidence": 0.92,
    "confidence in both": 0.74,
    "unread by the network": 0.42,
    "the rules read otherwise": -1.70,
    "contradicted": -1.00,
    "the other contradicted": 0.75,
    "beyond the network": -1.54,
    "likelihood": 0.34,
    "weakest": 0.36,
    "in common": 1.53,
    "but for the part": 0.43,
    "fewer frames": -0.09,
    "more frames": 0.71,
    "the other asks": -0.55,
    "the other reads nothing": -1.08,
}
"""What each ground counts, as logarithms of odds; `training/referee.py` fits them on voices that the network had not
seen."""

DO, SHOW = 0.82, 0.15
"""How likely a reading has to be meant to be done at once, and to be shown."""

WHOLE_READ, AGAINST_WHOLE = 0.55, 0.93
"""How likely it has to be where the rules read every word and nothing speaks against it, and to be done instead."""

CURT, DOUBTED = 5, 10
"""Chunks of an utterance that is so short that every word of it counts, and that every doubt about it does."""

SHORT = 6
"""Chunks of an utterance that is so short that the network is not asked what it thinks of the rules' one frame."""

EMPTY = frozenset(
    """the a an it its your my our please pls kindly thanks you go goes going move fly drive come be is are do make put
    set use take let let's give me us in and of to than now""".split()
)
"""Words that point at nothing and ask for nothing; of others that the rules pass over, the network is asked too."""

LONG = 20
"""Chunks of an utterance that is too long for the rules to have the last word."""


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
    """

    outcome: Outcome
    reading: F.Reading
    by: By
    unused: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    confidence: float = 0.0
    rules: F.Reading | None = None
    learned: F.Reading | None = None

    @property
    def whole(self) -> bool:
        """Whether the rules read all of it, so that another reading is one against them."""
        return self.rules is not None and _reads(self.rules) and not (self.rules.unread or self.rules.aside)


def understand(
    text: str,
    scene: Scene,
    trajectory: Trajectory | None = None,
    before: Sequence[F.SemanticFrame] = (),
    *,
    quick: bool = False,
) -> Understanding:
    """Have an utterance read by all readers, and judge what they say.

    Args:
        text: As it was said or typed.
        scene: Whose objects it may name.
        trajectory: The path, for phrases such as "the object nearest to the goal".
        before: Frames of the turns in force, where the utterance may be about them.
        quick: Whether the network need not be asked where the rules read one frame from all of a short utterance.
    """
    positions = None if trajectory is None else trajectory.positions
    text = repaired(written_out(text), scene, positions)
    rules = by_rules(text, scene, before, positions)
    said, _ = chunks(text, scene, positions)
    rules = in_units(rules, said, positions)
    if quick and _plain(said) and len(rules.frames) == 1 and _whole(said, rules):
        rules = replace(rules, frames=spread(rules.frames, said))
        return Understanding("do", rules, "rules", confidence=DO, rules=rules)
    reader = learned_reader()
    if reader is None or any(name_of(frame) not in TRAINED for frame in rules.frames):
        return judged(said, rules, None)
    heard = reader.hear(text, scene, positions, before or None)
    learned = in_units(reader.reading(heard), said, positions)
    return judged(said, rules, learned, {"rules": heard.weigh(_items(rules)), "learned": heard.weigh(_items(learned))})


def in_units(reading: F.Reading, said: Sequence[Chunk], positions: Array | None) -> F.Reading:
    """A reading whose bare lengths have the unit that the utterance or the size of the path suggests."""
    also = [edit.frame for edit in reading.edits if isinstance(edit, Also)]
    made = iter(with_units((*reading.frames, *also), said, extent_of(positions)))
    frames = tuple(next(made) for _ in reading.frames)
    edits = tuple(replace(edit, frame=next(made)) if isinstance(edit, Also) else edit for edit in reading.edits)
    return (
        reading if (frames, edits) == (reading.frames, reading.edits) else replace(reading, frames=frames, edits=edits)
    )


def feedback(
    text: str, scene: Scene, before: Sequence[F.SemanticFrame], positions: Array | None, instruction: Reader
) -> F.Reading | None:
    """Feedback as the rules or the network read it, whichever is likelier meant; None where it is none.

    Args:
        text: As it was said or typed.
        scene: Whose objects it may name.
        before: The frames that it may be about.
        positions: The path (N, 3) [m], or None.
        instruction: Reads the utterance as an instruction, by itself or after some frames.
    """
    from ovita.instruct.looking_back import looks_back, weighed

    found, heard = overheard(text, scene, before, positions, instruction)
    if heard is None:
        return found.reading if looks_back(found) else None
    return weighed(found, heard)


def overheard(
    text: str, scene: Scene, before: Sequence[F.SemanticFrame], positions: Array | None, instruction: Reader
) -> tuple[Retrospect, Hearing | None]:
    """An utterance as feedback and as an instruction by the rules, and what the network says if it has to be asked."""
    from ovita.instruct.feedback import retrospect
    from ovita.instruct.looking_back import Hearing, is_plain

    text = repaired(written_out(text), scene, positions)
    said, _ = chunks(text, scene, positions)
    found = retrospect(text, scene, before, positions, instruction)
    edits = in_units(found.reading, said, positions).edits
    found = replace(found, best=replace(found.best, edits=edits))
    guessed = all(chunk.kind in UNKNOWN for chunk in said) and not any(p.content for p in found.said.pieces)
    reader = None if is_plain(found) or guessed or not before else learned_reader()
    if reader is None:
        return found, None
    heard = reader.hear(text, scene, positions, before)
    learned, alone = in_units(reader.reading(heard), said, positions), reader.read(text, scene, positions)
    return found, Hearing(learned, alone)


def by_rules(text: str, scene: Scene, before: Sequence[F.SemanticFrame], positions: Array | None) -> F.Reading:
    """What the rules make of an utterance: feedback on the frames before where it is that, else an instruction."""
    from ovita.instruct.feedback import read_feedback
    from ovita.instruct.rules import reader

    instruction = reader(scene, positions)
    found = read_feedback(text, scene, before, positions, instruction) if before else None
    return found if found is not None else instruction(text, ())


@cache
def learned_reader() -> LearnedReader | None:
    """The learned reader; None where its weights are not present, and the rules read alone."""
    from ovita.instruct.encoder import network
    from ovita.instruct.learned import LearnedReader

    try:
        return LearnedReader(network())
    except OvitaError:
        return None


def judged(
    said: Sequence[Chunk], rules: F.Reading | None, learned: F.Reading | None, weighed: Weighed | None = None
) -> Understanding:
    """The verdict on what two readers made of an utterance; either may be None.

    Args:
        said: The utterance in chunks.
        rules: What the rules made of it.
        learned: What the learned reader made of it.
        weighed: How likely the network holds each of the two readings to be (`learned.NetworkReading.weigh`).
    """
    known: dict[str, Any] = {"rules": rules, "learned": learned}
    unread = _unplaced(said, rules)
    partly = rules.frames if rules is not None else ()
    if rules is not None and unread and _reads(learned) and not rules.edits:
        rules = replace(rules, frames=())  # all or nothing: what the rules read in part is the network's
    both: tuple[tuple[Who, F.Reading | None], ...] = (("rules", rules), ("learned", learned))
    candidates = [(by, reading) for by, reading in both if reading is not None and _reads(reading)]
    if rules is not None and rules.improper and not rules.unread and (not _reads(learned) or _bounds(rules)):
        return Understanding("decline", rules, "rules", confidence=1.0, **known)
    if not candidates or all(chunk.kind in UNKNOWN | {"OBJ"} for chunk in said):
        guessed = all(chunk.kind in UNKNOWN for chunk in said)
        return _unread(rules, None if guessed else learned, known)
    agreed = _agree(rules, learned)
    if agreed:
        candidates = candidates[:1]
    rated = [(likelihood(grounds(said, by, rules, learned, weighed)), by, one) for by, one in candidates]
    whole = _whole(said, rules)
    over = whole and learned is not None and _gives_way(said, learned, rules)
    confidence, best, chosen = rated[0] if over else max(rated, key=lambda one: one[0])
    by: By = "both" if agreed else best
    curt = by == "learned" and len(said) <= CURT
    left = [*chosen.unread, *(unread if curt else ())]
    reading = replace(chosen, frames=spread(chosen.frames, said))
    against = whole and by == "learned"
    enough = AGAINST_WHOLE if against else WHOLE_READ if whole else DO
    turned = against and (len(said) <= CURT or opposed(_frames(reading), _frames(rules or F.Reading())))
    sure = confidence >= enough and not turned and not _shown_first(said, reading, left, [*left, *unread])
    outcome: Outcome = "do" if sure else "needs_confirmation" if confidence >= SHOW else "decline"
    doubts = contradictions(said, _frames(reading))
    if _denied(said, (*partly, *_frames(reading))) or _one_of_two(said, _frames(reading)):
        outcome = "decline"  # the opposite of what is said is not even shown
    return Understanding(outcome, reading, by, tuple(dict.fromkeys(left)), doubts, confidence, **known)


def _unplaced(said: Sequence[Chunk], rules: F.Reading | None) -> tuple[str, ...]:
    """The words that the rules did not read; where they read nothing at all, those that only a guess can place."""
    if rules is None or _reads(rules):
        return () if rules is None else rules.unread
    guessed = {chunk.text for chunk in said if chunk.kind in ("unknown", "after", "before")}
    return tuple(word for word in rules.unread if word in guessed)


def _denied(said: Sequence[Chunk], frames: tuple[F.SemanticFrame, ...]) -> bool:
    """Whether a way past, over or through something is read where only that is denied: "do not fly over the cup"."""
    ways = [frame for frame in frames if isinstance(frame, F.Visit | F.Hop | F.Hover | F.StopAt | F.Wait)]
    passed = "filler over under through touch to at by near stop wait hover".split()
    row = [chunk for chunk in said if chunk.kind not in passed]
    things = [chunk for chunk in row if chunk.kind == "OBJ"]
    denied = [thing for no, thing in pairwise(row) if no.kind == "never" and thing.kind == "OBJ"]
    only = [thing for thing in denied if sum(thing.names == other.names for other in things) == 1]
    return any({*thing.names} & {*frame.named} for thing in only for frame in ways)


def _one_of_two(said: Sequence[Chunk], frames: tuple[F.SemanticFrame, ...]) -> bool:
    """Whether a shift goes to one of two opposite sides that are both asked for: "go left and right"."""
    shifts = [{way for way, _ in frame.offset} for frame in frames if isinstance(frame, F.Shift)]
    return any(chunk.kind == "sideways" for chunk in said) and any(len(way & {"left", "right"}) == 1 for way in shifts)


def _shown_first(said: Sequence[Chunk], reading: F.Reading, left: Sequence[str], unread: Sequence[str]) -> bool:
    """Whether a reading is never done at once: for what the words hold, a "not" beside what was read, or any of few."""
    frames, row = _frames(reading), clauses(said)
    denied = [c for c in row if any(chunk.kind == "never" and chunk.text in left for chunk in c)]
    beside = denied and not all(elsewhere(frame, denied, wholly=True) for frame in frames)
    curt = left and len(said) <= CURT
    checks = CHECKS if len(said) <= DOUBTED else NEVER
    return bool(beside or curt or _taken_back(row, unread) or contradictions(said, frames, checks))


def _taken_back(row: Sequence[Sequence[Chunk]], unread: Sequence[str]) -> bool:
    """Whether a clause denies what another one asks for: "stop there, no, don't stop"."""
    denied = [c for c in row if any(chunk.kind == "never" and chunk.text in unread for chunk in c)]
    kinds = [{chunk.kind for clause in row if (clause in denied) is no for chunk in clause} for no in (True, False)]
    return bool((kinds[0] & kinds[1]) - UNKNOWN - {"never"})


def _bounds(reading: F.Reading) -> bool:
    """Whether a reading holds limits."""
    return any(q.role in BOUNDS for frame in reading.frames for q in frame.quantities.values())


def _plain(said: Sequence[Chunk]) -> bool:
    """Whether an utterance is short and no word of it is mere filler but for the plainest ones."""
    return len(said) <= SHORT and all({*c.text.lower().split()} <= EMPTY for c in said if c.kind == "filler")


def _gives_way(said: Sequence[Chunk], learned: F.Reading, rules: F.Reading | None) -> bool:
    """Whether the network's reading is none against one of the rules that is whole."""
    against = bool(contradictions(said, _frames(learned))) or opposed(_frames(learned), _frames(rules or F.Reading()))
    return bool(learned.unread) or against or _but_for_the_part(learned, rules)


def _whole(said: Sequence[Chunk], rules: F.Reading | None) -> bool:
    """Whether the rules read every word of what is not long, and nothing speaks against what they read."""
    if rules is None or not _reads(rules) or rules.unread or rules.aside or len(said) > LONG:
        return False
    return not contradictions(said, _frames(rules))


def _unread(rules: F.Reading | None, learned: F.Reading | None, known: Mapping[str, Any]) -> Understanding:
    """The verdict where no reader has anything to go by: the first question, else the first reason to decline."""
    both: list[tuple[By, F.Reading]] = [("rules", rules or F.Reading()), ("learned", learned or F.Reading())]
    ways: tuple[tuple[str, Outcome], ...] = (("question", "ask"), ("improper", "decline"))
    for wanted, outcome in ways:
        for by, one in both:
            if getattr(one, wanted):
                return Understanding(outcome, one, by, unused=one.unread, confidence=one.confidence, **known)
    return Understanding("decline", both[0][1], "rules", unused=both[0][1].unread, **known)


def grounds(
    said: Sequence[Chunk],
    by: Who,
    rules: F.Reading | None,
    learned: F.Reading | None,
    weighed: Weighed | None = None,
) -> dict[str, float]:
    """What speaks for and against a reader's reading, by the names of POINTS; one that both agree on is the rules'."""
    one, other = (rules, learned) if by == "rules" else (learned, rules)
    assert one is not None
    agree, mine, met = _agree(rules, learned), by == "rules", _reads(other)
    apart = met and not agree
    sure = min(max(learned.confidence, 0.02), 0.98) if learned is not None and (agree or not mine) else 0.5
    weight = None if weighed is None else weighed.get(by)
    total, least = weight or (0.0, 0.0)
    more = len(_frames(one)) - len(_frames(other or F.Reading()))
    return {
        "always": 1.0,
        "both agree": float(agree),
        "confidence": 0.0 if agree else math.log(sure / (1.0 - sure)),
        "confidence in both": math.log(sure / (1.0 - sure)) if agree else 0.0,
        "unread by the network": float(not mine and bool(one.unread)),
        "the rules read otherwise": float(not mine and met),
        "contradicted": float(bool(contradictions(said, _frames(one)))),
        "the other contradicted": float(not agree and bool(contradictions(said, _frames(other or F.Reading())))),
        "beyond the network": float(weighed is not None and weight is None),
        "likelihood": max(total, -25.0) / 5.0,
        "weakest": max(least, -8.0) / 3.0,
        "in common": _shared(one, other) if apart else 0.0,
        "but for the part": float(apart and _but_for_the_part(one, other)),
        "fewer frames": float(apart and more < 0),
        "more frames": float(apart and more > 0),
        "the other asks": float(other is not None and bool(other.question or other.improper)),
        "the other reads nothing": float(other is not None and not (met or other.question or other.improper)),
    }


def _but_for_the_part(one: F.Reading, other: F.Reading | None) -> bool:
    """Whether two readings differ only in parts of the path and words of degree."""
    mine, theirs = (
        tuple(replace(f, part=WHOLE, degree=None) for f in _frames(reading or F.Reading())) for reading in (one, other)
    )
    return F.same(mine, theirs)


def _shared(one: F.Reading, other: F.Reading | None) -> float:
    """Which share of their frames two readings have in common."""
    mine, theirs = _frames(one), _frames(other or F.Reading())
    alike = sum(any(F.same((frame,), (twin,)) for twin in theirs) for frame in mine)
    return 2.0 * alike / max(len(mine) + len(theirs), 1)


def likelihood(found: Mapping[str, float]) -> float:
    """How likely a reading is meant (0..1), from the grounds for and against it."""
    return 1.0 / (1.0 + math.exp(-sum(POINTS[name] * value for name, value in found.items())))


def _reads(reading: F.Reading | None) -> TypeGuard[F.Reading]:
    """Whether a reading says what to do."""
    return reading is not None and bool(reading.frames or reading.edits) and not (reading.question or reading.improper)


def _agree(one: F.Reading | None, other: F.Reading | None) -> bool:
    if one is None or other is None or not (_reads(one) and _reads(other)):
        return False
    plain = [[edit for edit in reading.edits if not isinstance(edit, Also)] for reading in (one, other)]
    return plain[0] == plain[1] and F.same(_frames(one), _frames(other))


def _items(reading: F.Reading) -> tuple[F.SemanticFrame | Edit, ...]:
    return reading.edits or reading.frames


def _frames(reading: F.Reading) -> tuple[F.SemanticFrame, ...]:
    return (*reading.frames, *(edit.frame for edit in reading.edits if isinstance(edit, Also)))
