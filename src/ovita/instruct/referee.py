"""The referee: from what the readers made of an utterance to a verdict: do it, show it first, ask back, or decline.

It reads nothing itself. It compares the readings, counts what they leave unused, and holds them against plain facts of
the utterance: its numbers, objects, directions, negations and bounds. Each ground counts some points; their sum says
how likely a reading is meant.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import TYPE_CHECKING, Literal

from ovita.errors import OvitaError
from ovita.instruct import frames as F
from ovita.instruct.beforehand import goes_past, heard_apart, stands, tells, with_landmarks
from ovita.instruct.chunks import DOING, Chunk, chunks
from ovita.instruct.contradictions import CHECKS, LEFT, NEVER, asked, contradictions
from ovita.instruct.degrees import extent_of
from ovita.instruct.edits import Also, Edit
from ovita.instruct.facts import BOUNDS, UNKNOWN, clauses, opposed
from ovita.instruct.frames import name_of
from ovita.instruct.meaning import same
from ovita.instruct.patterns import FRACTION
from ovita.instruct.rules import PAUSES
from ovita.instruct.slots import TRAINED
from ovita.instruct.together import as_said, at_each, contrasted, halted, prolonged, spread, with_units
from ovita.paths.part import WHOLE
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.text import quoted

if TYPE_CHECKING:
    from ovita.instruct.feedback import Reader
    from ovita.instruct.learned import LearnedReader
    from ovita.instruct.looking_back import Hearing, Retrospect

Outcome = Literal["do", "needs_confirmation", "ask", "decline"]
Who = Literal["rules", "learned"]
By = Literal["both", "rules", "learned"]
Weighed = Mapping[str, float]

POINTS = {
    "always": 1.19,
    "both agree": 1.02,
    "agree but for words left": 1.21,
    "confidence": 0.84,
    "the rules read otherwise": -1.21,
    "contradicted": -0.62,
    "the other contradicted": 0.46,
    "likelihood": 0.43,
    "in common": 1.72,
    "the other reads nothing": -0.84,
}
"""What each ground counts, as logarithms of odds; `training/referee.py` fits them on voices that the network had not
seen."""

DO, SHOW = 0.83, 0.15
"""How likely a reading has to be meant to be done at once, and to be shown."""

WHOLE_READ = 0.56
"""How likely it has to be where the rules read every word and nothing speaks against it."""

AGAINST_WHOLE = 0.88
"""How likely the network's reading has to be to be done where the rules read every word, and read it otherwise."""

CERTAIN = 0.93
"""How likely a reading has to be for words that it leaves not to matter, however few there are."""

CURT, DOUBTED = 5, 10
"""Chunks of an utterance that is so short that every word of it counts, and that every doubt about it does."""

SHORT = 6
"""Chunks of an utterance that is so short that the network is not asked what it thinks of the rules' one frame."""

EMPTY = frozenset(
    """the a an it its your my our please pls kindly thanks you go goes going move fly drive come be is are do make put
    set use take let let's give me us in and of to than now""".split()
)
"""Words that point at nothing and ask for nothing; of others that the rules pass over, the network is asked too."""


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
    said = text
    text, taken = with_landmarks(said, scene, positions)
    found = _with_the_rest(text, scene, positions, before) or _understood(
        text, scene, positions, before, quick=quick and not taken
    )
    found = found if text == said else _in_own_words(found, said, chunks(text, scene, positions)[0])
    outcome: Outcome = "needs_confirmation" if taken and found.outcome == "do" else found.outcome
    return replace(found, outcome=outcome, doubts=(*found.doubts, taken)) if taken else found


def _in_own_words(found: Understanding, said: str, put: Sequence[Chunk]) -> Understanding:
    """A verdict that names no words which were put in place of those that were said."""
    foreign = [chunk.text for chunk in put if chunk.text.lower() not in said.lower()]
    unused = tuple(word for word in found.unused if word.lower() in said.lower())
    doubts = tuple(text for text in found.doubts if not any(quoted([word]) in text for word in foreign))
    return replace(found, unused=unused, doubts=doubts)


def otherwise(
    text: str, scene: Scene, trajectory: Trajectory, refused: Sequence[Sequence[F.SemanticFrame]]
) -> Understanding:
    """The next likeliest reading of an instruction of which some were refused, to be agreed to; or a refusal.

    It comes from the other reader, or from the network with one choice made otherwise; nothing speaks against it.

    Args:
        text: As it was said or typed.
        scene: Whose objects it may name.
        trajectory: The path that it is about.
        refused: The frames of the readings that were not meant.
    """
    positions = trajectory.positions
    text, _ = with_landmarks(text, scene, positions)
    said, _ = chunks(text, scene, positions)
    text, apart = heard_apart(text, scene, positions, ())
    for by, one in _readings(text, scene, positions):
        found = at_each(in_units(one, said, positions), said)
        found = replace(found, frames=(*found.frames, *apart))
        if _may_be_meant(said, found) and not any(same(found.frames, old) for old in refused):
            return Understanding("needs_confirmation", found, by, found.unread)
    return Understanding("decline", F.Reading(), "rules")


def _readings(text: str, scene: Scene, positions: Array) -> Iterator[tuple[By, F.Reading]]:
    """All readings of an instruction: the rules', where they read every word, then the network's, likeliest first."""
    rules = by_rules(text, scene, (), positions)
    if not rules.unread:
        yield "rules", rules
    if (reader := learned_reader()) is not None:
        heard = reader.hear(text, scene, positions)
        yield from (("learned", one) for one in (reader.reading(heard), *reader.runners_up(heard)))


def _may_be_meant(said: Sequence[Chunk], reading: F.Reading) -> bool:
    """Whether a reading says what to do, and nothing speaks against it."""
    return _reads(reading) and not contradictions(said, reading.frames)


def _with_the_rest(
    text: str, scene: Scene, positions: Array | None, before: Sequence[F.SemanticFrame]
) -> Understanding | None:
    """As `understand`, where something is heard apart; None of other utterances, and if the rest speaks against it."""
    rest, apart = heard_apart(text, scene, positions, before)
    if not apart or contradictions(chunks(text, scene, positions)[0], apart, (asked,)):
        return None
    left = chunks(rest, scene, positions)[0]
    told = all(map(tells, clauses(left)))
    if all(chunk.kind in (UNKNOWN if told else UNKNOWN - {"unknown"}) for chunk in left):
        return Understanding("do", F.Reading(apart), "rules", confidence=1.0, rules=F.Reading(), apart=apart)
    found = replace(_understood(rest, scene, positions, before, quick=False), apart=apart)
    if found.reading.asks:
        return found
    if not _reads(found.reading) or found.outcome not in ("do", "needs_confirmation"):
        return _alone(found, left, told=told)
    if any(stands(frame, apart) for frame in _frames(found.reading)):
        return None
    more = tuple(frame for frame in found.reading.frames if not goes_past(frame, apart))
    return replace(found, reading=replace(found.reading, frames=(*more, *apart)))


def _alone(found: Understanding, left: Sequence[Chunk], *, told: bool) -> Understanding:
    """The verdict on what was heard apart where nothing else is read; it is done if the rest tells how things are."""
    unread = tuple(chunk.text for chunk in left if chunk.kind not in UNKNOWN - {"unknown"})
    outcome: Outcome = "do" if told and found.outcome == "decline" else "needs_confirmation"
    return replace(found, outcome=outcome, reading=F.Reading(found.apart, unread=unread), unused=unread)


def _understood(
    text: str, scene: Scene, positions: Array | None, before: Sequence[F.SemanticFrame], *, quick: bool
) -> Understanding:
    """As `understand`, of an utterance that is written out."""
    rules = by_rules(text, scene, before, positions)
    said, _ = chunks(text, scene, positions)
    rules = in_units(rules, said, positions)
    alone = len(rules.frames) == 1 and not isinstance(rules.frames[0], F.Keep)
    if quick and alone and _plain(said) and _whole(said, rules):
        rules = at_each(rules, said)
        return Understanding("do", rules, "rules", confidence=DO, rules=rules)
    reader = learned_reader()
    if reader is None or any(name_of(frame) not in TRAINED or _winds(frame) for frame in rules.frames):
        return judged(said, at_each(rules, said), None)
    heard = reader.hear(text, scene, positions, before or None)
    learned = in_units(reader.reading(heard), said, positions)
    weighed: Weighed = {"rules": heard.weigh(_items(rules)), "learned": heard.weigh(_items(learned))}
    return judged(said, at_each(rules, said), at_each(learned, said), weighed)


def _winds(frame: F.SemanticFrame) -> bool:
    """Whether it is a spiral of a part of the path; the network knows but spirals at a place."""
    return isinstance(frame, F.Figure) and frame.shape == "spiral" and bool(frame.part) and not frame.place


def in_units(reading: F.Reading, said: Sequence[Chunk], positions: Array | None) -> F.Reading:
    """A reading with contrasts of pace apart, and bare lengths in the unit that words or the path's size suggest."""
    reading = replace(reading, frames=as_said(halted(spread(reading.frames, said), said), said))
    reading = prolonged(reading, said)
    also = [edit.frame for edit in reading.edits if isinstance(edit, Also)]
    made = iter(with_units((*contrasted(reading.frames), *also), said, extent_of(positions)))
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
    from ovita.instruct.looking_back import Hearing, in_excess

    text, _ = with_landmarks(text, scene, positions)
    said, _ = chunks(text, scene, positions)
    found = retrospect(text, scene, before, positions, instruction)
    edits = in_excess(in_units(found.reading, said, positions).edits, said, before)
    found = replace(found, best=replace(found.best, edits=edits))
    guessed = all(chunk.kind in UNKNOWN for chunk in said) and not any(p.content for p in found.said.pieces)
    reader = None if guessed or not before else learned_reader()
    if reader is None:
        return found, None
    heard = reader.hear(text, scene, positions, before)
    learned, alone = in_units(reader.reading(heard), said, positions), reader.read(text, scene, positions)
    learned = replace(learned, edits=in_excess(learned.edits, said, before))
    return found, Hearing(learned, alone)


def by_rules(text: str, scene: Scene, before: Sequence[F.SemanticFrame], positions: Array | None) -> F.Reading:
    """What the rules make of an utterance: feedback on the frames before where it is that, else an instruction."""
    from ovita.instruct.feedback import read_feedback
    from ovita.instruct.rules import reader

    instruction = reader(scene, positions)
    found = read_feedback(text, scene, before, positions, instruction) if before else None
    return found if found is not None else instruction(text, before if "there" in text.lower().split() else ())


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
    said: Sequence[Chunk], rules: F.Reading, learned: F.Reading | None, weighed: Weighed | None = None
) -> Understanding:
    """The verdict on what two readers made of an utterance.

    Args:
        said: The utterance in chunks.
        rules: What the rules made of it.
        learned: What the learned reader made of it; None where there is none.
        weighed: How likely the network holds each of the two readings to be (`learned.NetworkReading.weigh`).
    """
    if rules.improper and not rules.unread and (_bounds(rules) or not _reads(learned)):
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
    doubts = (*contradictions(said, _frames(reading)), *found.besides)
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
    if learned is None or rules.edits or (not _reads(learned) and learned.confidence < REFUSING):
        return rules
    counts = not rules.unread and (_reads(learned) or _whole(said, rules))
    return rules if counts else replace(rules, frames=())


REFUSING = 0.6
"""How sure the network has to be that nothing can be done, for a part that the rules read not to be shown."""


def _share_read(said: Sequence[Chunk], rules: F.Reading) -> float:
    """Which share of the words that may ask for something the rules used (0..1)."""
    asking = sum(chunk.kind not in UNKNOWN or chunk.kind == "unknown" for chunk in said)
    return max(1.0 - len(rules.unread) / max(asking, 1), 0.0)


def _unplaced(said: Sequence[Chunk], rules: F.Reading) -> tuple[str, ...]:
    """The words that the rules did not read; where they read nothing at all, those that only a guess can place."""
    if _reads(rules):
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
        return _whole(self.said, self.rules)

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
        return {by: one for by, one in both.items() if one is not None and _reads(one)}

    def likeliest(self) -> tuple[By, F.Reading, float]:
        """Whose reading is the likeliest, the reading, and how likely it is meant (0..1)."""
        rated = {by: likelihood(self.grounds(by)) for by in self.candidates}
        best: Who = "rules" if self._rules_prevail() else max(rated, key=lambda by: rated[by])
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
        apart = any(frame.part.kind == "outside" for frame in _frames(self.rules))
        return apart and bool(self.learned and self.learned.improper)

    def _rules_prevail(self) -> bool:
        """Whether the rules read all of it, and the network leaves words, holds the opposite or means another part."""
        if not self.whole or self.learned is None or "rules" not in self.candidates:
            return False
        mine, theirs = _frames(self.rules), _frames(self.learned)
        doubtful = self.learned.unread or contradictions(self.said, theirs)
        return bool(doubtful) or opposed(theirs, mine) or _but_for_the_part(theirs, mine)

    def grounds(self, by: Who) -> dict[str, float]:
        """What speaks for and against a reader's reading, by the names of POINTS."""
        one, other = (self.rules, self.learned) if by == "rules" else (self.learned or F.Reading(), self.rules)
        met = _reads(other)
        heard = self.learned is not None and (self.agree or by == "learned")
        sure = min(max(self.learned.confidence, 0.02), 0.98) if self.learned is not None and heard else 0.5
        theirs = _frames(other or F.Reading())
        return {
            "always": 1.0,
            "both agree": float(self.agree),
            "agree but for words left": 0.0 if self.agree else self.in_part,
            "confidence": math.log(sure / (1.0 - sure)),
            "the rules read otherwise": float(by == "learned" and met),
            "contradicted": float(bool(contradictions(self.said, _frames(one)))),
            "the other contradicted": float(not self.agree and bool(contradictions(self.said, theirs))),
            "likelihood": max(self.weighed[by], UNLIKELY) / 5.0 if self.weighed else 0.0,
            "in common": _shared(_frames(one), theirs) if met and not self.agree else 0.0,
            "the other reads nothing": float(other is not None and not met),
        }


UNLIKELY = -25.0
"""The least log-likelihood that counts."""


def likelihood(found: Mapping[str, float]) -> float:
    """How likely a reading is meant (0..1), from the grounds for and against it."""
    return 1.0 / (1.0 + math.exp(-sum(POINTS[name] * value for name, value in found.items())))


def _shown_first(said: Sequence[Chunk], reading: F.Reading, left: Sequence[str], certain: bool) -> bool:
    """Whether a likely reading is not done at once: for what the words hold, or for strange or left ones."""
    if _taken_back(said, left) or contradictions(said, _frames(reading), NEVER):
        return True
    if len(said) <= DOUBTED:
        checks = CHECKS if len(said) <= CURT or not certain else LEFT
        if contradictions(said, _frames(reading), checks):
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


def _plain(said: Sequence[Chunk]) -> bool:
    """Whether an utterance is short and no word of it is mere filler but for the plainest ones."""
    return len(said) <= SHORT and all({*c.text.lower().split()} <= EMPTY for c in said if c.kind == "filler")


def _read_all(rules: F.Reading) -> bool:
    """Whether the rules read every word."""
    return _reads(rules) and not rules.unread


def _whole(said: Sequence[Chunk], rules: F.Reading) -> bool:
    """Whether the rules read every word, and nothing speaks against what they read."""
    return _read_all(rules) and not contradictions(said, _frames(rules))


def _unread(rules: F.Reading, learned: F.Reading | None) -> Understanding:
    """The verdict where no reader has anything to go by: the first question, else the first reason to decline."""
    both: dict[By, F.Reading] = {"rules": rules, "learned": learned or F.Reading()}
    for by, one in both.items():
        if one.question:
            return Understanding("ask", one, by, one.unread, confidence=one.confidence)
    by = next((by for by, one in both.items() if one.improper), "rules")
    return Understanding("decline", both[by], by, both[by].unread, confidence=both[by].confidence)


def _but_for_the_part(one: Sequence[F.SemanticFrame], other: Sequence[F.SemanticFrame]) -> bool:
    """Whether two readings differ only in parts of the path, degrees, and ending somewhere or passing there."""
    mine, theirs = (tuple(map(_roughly, frames)) for frames in (one, other))
    return same(mine, theirs)


def _roughly(frame: F.SemanticFrame) -> F.SemanticFrame:
    match frame:
        case F.MoveEnd(end="goal", relation="to", offset=(), place=str() as place) if place not in ("", *F.SPOTS):
            frame = F.Visit(objects=(place,), relation="at")
        case F.MoveEnd(level=F.Quantity() as level):
            frame = F.Height(level=level)
    return replace(frame, part=WHOLE, degree=None)


def _shared(one: Sequence[F.SemanticFrame], other: Sequence[F.SemanticFrame]) -> float:
    """Which share of their frames two readings have in common."""
    alike = sum(any(same((frame,), (twin,)) for twin in other) for frame in one)
    return 2.0 * alike / max(len(one) + len(other), 1)


def _reads(reading: F.Reading | None) -> bool:
    """Whether a reading says what to do."""
    return reading is not None and bool(reading.frames or reading.edits) and not (reading.question or reading.improper)


def _agree(one: F.Reading | None, other: F.Reading | None) -> bool:
    if one is None or other is None or not (_reads(one) and _reads(other)):
        return False
    plain = [[edit for edit in reading.edits if not isinstance(edit, Also)] for reading in (one, other)]
    return plain[0] == plain[1] and same(_frames(one), _frames(other))


def _items(reading: F.Reading) -> tuple[F.SemanticFrame | Edit, ...]:
    return reading.edits or reading.frames


def _frames(reading: F.Reading) -> tuple[F.SemanticFrame, ...]:
    return (*reading.frames, *(edit.frame for edit in reading.edits if isinstance(edit, Also)))
