"""From an utterance to a verdict: what is heard apart, what both readers make of the rest, and the referee."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

from ovita.errors import OvitaError
from ovita.instruct import frames as F
from ovita.instruct.amended import amended
from ovita.instruct.beforehand import goes_past, heard_apart, stands, tells, with_landmarks
from ovita.instruct.chunks import Chunk, chunks
from ovita.instruct.contradictions import asked, contradictions
from ovita.instruct.degrees import extent_of
from ovita.instruct.edits import Also
from ovita.instruct.facts import UNKNOWN, clauses
from ovita.instruct.frames import name_of
from ovita.instruct.meaning import same
from ovita.instruct.referee import (
    DO,
    By,
    Outcome,
    Understanding,
    Weighed,
    frames_of,
    items_of,
    judged,
    read_whole,
    reads,
)
from ovita.instruct.slots import TRAINED
from ovita.instruct.together import contrasted, with_units
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.text import quoted

if TYPE_CHECKING:
    from ovita.instruct.feedback import Reader
    from ovita.instruct.learned import LearnedReader
    from ovita.instruct.looking_back import Hearing, Retrospect


SHORT = 6
"""Chunks of an utterance that is so short that the network is not asked what it thinks of the rules' one frame."""

EMPTY = frozenset(
    """the a an it its your my our please pls kindly thanks you go goes going move fly drive come be is are do make put
    set use take let let's give me us in and of to than now""".split()
)
"""Words that point at nothing and ask for nothing; of others that the rules pass over, the network is asked too."""


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
        found = in_units(one, said, positions)
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
    return reads(reading) and not contradictions(said, reading.frames)


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
    if not reads(found.reading) or found.outcome not in ("do", "needs_confirmation"):
        return _alone(found, left, told=told)
    if any(stands(frame, apart) for frame in frames_of(found.reading)):
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
    said, _ = chunks(text, scene, positions)
    rules = in_units(by_rules(text, scene, before, positions), said, positions)
    alone = len(rules.frames) == 1 and not isinstance(rules.frames[0], F.Keep)
    if quick and alone and _plain(said) and read_whole(said, rules):
        return Understanding("do", rules, "rules", confidence=DO, rules=rules)
    reader = learned_reader()
    if reader is None or any(name_of(frame) not in TRAINED or _winds(frame) for frame in rules.frames):
        return judged(said, rules, None)
    heard = reader.hear(text, scene, positions, before or None)
    learned = reader.reading(heard)
    weighed: Weighed = {"rules": heard.weigh(items_of(rules)), "learned": heard.weigh(items_of(learned))}
    learned = in_units(learned, said, positions)
    return judged(said, rules, learned, weighed)


def _winds(frame: F.SemanticFrame) -> bool:
    """Whether it is a spiral of a part of the path; the network knows but spirals at a place."""
    return isinstance(frame, F.Figure) and frame.shape == "spiral" and bool(frame.part) and not frame.place


def in_units(reading: F.Reading, said: Sequence[Chunk], positions: Array | None) -> F.Reading:
    """A reading with what neither reader sees, contrasts of pace apart, and bare lengths in a unit that suits."""
    reading = amended(reading, said)
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
    learned = in_units(reader.reading(heard), said, positions)
    alone = reader.read(text, scene, positions)
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


def _plain(said: Sequence[Chunk]) -> bool:
    """Whether an utterance is short and no word of it is mere filler but for the plainest ones."""
    return len(said) <= SHORT and all({*c.text.lower().split()} <= EMPTY for c in said if c.kind == "filler")
