"""From an utterance to a verdict: landmarks of the path, what the learned reader makes of it, and the referee."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

from ovita.instruct import frames as F
from ovita.instruct.chunks import Chunk, chunks
from ovita.instruct.contradictions import contradictions
from ovita.instruct.degrees import extent_of
from ovita.instruct.edits import Also
from ovita.instruct.facts import clauses
from ovita.instruct.landmarks import with_landmarks
from ovita.instruct.learned import LearnedReader
from ovita.instruct.meaning import same
from ovita.instruct.referee import Outcome, Understanding, judged, reads
from ovita.instruct.together import with_units
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.text import quoted

if TYPE_CHECKING:
    from ovita.instruct.looking_back import Hearing


def understand(
    text: str,
    scene: Scene,
    trajectory: Trajectory | None = None,
    before: Sequence[F.SemanticFrame] = (),
) -> Understanding:
    """Have an utterance read, and judge the reading.

    Args:
        text: As it was said or typed.
        scene: Whose objects it may name.
        trajectory: The path, for phrases such as "the object nearest to the goal".
        before: Frames of the turns in force, where the utterance may be about them.
    """
    positions = None if trajectory is None else trajectory.positions
    said = text
    text, taken = with_landmarks(said, scene, positions)
    found = _understood(text, scene, positions, before)
    found = found if text == said else _in_own_words(found, said, chunks(text, scene, positions))
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

    It is the network's, or that with one choice made otherwise; nothing speaks against it.

    Args:
        text: As it was said or typed.
        scene: Whose objects it may name.
        trajectory: The path that it is about.
        refused: The frames of the readings that were not meant.
    """
    positions = trajectory.positions
    text, _ = with_landmarks(text, scene, positions)
    said = chunks(text, scene, positions)
    reader = learned_reader()
    heard = reader.hear(text, scene, positions)
    for one in (reader.reading(heard), *reader.runners_up(heard)):
        found = in_units(one, said, positions)
        if _may_be_meant(said, found) and not any(same(found.frames, old) for old in refused):
            return Understanding("needs_confirmation", found, found.unread)
    return Understanding("decline", F.Reading())


def _may_be_meant(said: Sequence[Chunk], reading: F.Reading) -> bool:
    """Whether a reading says what to do, and nothing speaks against it."""
    return reads(reading) and not contradictions(said, reading.frames)


def _understood(text: str, scene: Scene, positions: Array | None, before: Sequence[F.SemanticFrame]) -> Understanding:
    """As `understand`, of an utterance that is written out."""
    said = chunks(text, scene, positions)
    return judged(said, in_units(learned_reader().read(text, scene, positions, before or None), said, positions))


def in_units(reading: F.Reading, said: Sequence[Chunk], positions: Array | None) -> F.Reading:
    """A reading whose bare lengths and speeds are in a unit that suits."""
    also = [edit.frame for edit in reading.edits if isinstance(edit, Also)]
    made = iter(with_units((*reading.frames, *also), said, extent_of(positions)))
    frames = tuple(next(made) for _ in reading.frames)
    edits = tuple(replace(edit, frame=next(made)) if isinstance(edit, Also) else edit for edit in reading.edits)
    return (
        reading if (frames, edits) == (reading.frames, reading.edits) else replace(reading, frames=frames, edits=edits)
    )


def read(text: str, scene: Scene, trajectory: Trajectory | None = None) -> F.Reading:
    """An utterance as an instruction by itself; where it would not be done without asking, all of it is left unread.

    Args:
        text: As for `understand`, as the others.
        scene: Whose objects it may name.
        trajectory: The path, or None.
    """
    verdict = understand(text, scene, trajectory)
    return replace(verdict.reading, unread=() if verdict.outcome == "do" else verdict.unused or (text,))


def feedback(text: str, scene: Scene, before: Sequence[F.SemanticFrame], positions: Array | None) -> F.Reading | None:
    """An utterance as edits of the frames before it, or a question about them; None where it is an instruction.

    Args:
        text: As it was said or typed.
        scene: Whose objects it may name.
        before: The frames that it may be about.
        positions: The path (N, 3) [m], or None.
    """
    from ovita.instruct.looking_back import weighed

    return weighed(overheard(text, scene, before, positions))


def overheard(text: str, scene: Scene, before: Sequence[F.SemanticFrame], positions: Array | None) -> Hearing:
    """An utterance as the reader hears it as feedback, and as an instruction."""
    from ovita.instruct.looking_back import Hearing
    from ovita.instruct.remarks import remark
    from ovita.instruct.revised import given_up, left_over, revised

    text, _ = with_landmarks(text, scene, positions)
    said = chunks(text, scene, positions)
    told, reader = remark(text, scene, before, positions), learned_reader()
    if told.says_nothing:
        return Hearing(told, F.Reading(), F.Reading())
    edits = in_units(reader.read(text, scene, positions, before), said, positions)
    made = given_up(revised(edits.edits, said, told), told)
    edits = replace(edits, edits=made)
    strange = [c[1].text for c in clauses(said) if [chunk.kind for chunk in c[:2]] == ["and", "unknown"]]  # "and dance"
    edits = replace(edits, unread=left_over((*edits.unread, *strange), edits.edits, said, told))
    return Hearing(told, edits, reader.read(text, scene, positions))


@cache
def learned_reader() -> LearnedReader:
    """The learned reader, which loads its weights when the first sentence is read."""
    return LearnedReader()
