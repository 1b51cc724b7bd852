"""The referee: from a reading of an utterance to a verdict: do it, show it first, ask back, or decline.

It reads nothing itself. It goes by how sure the reader is, and holds what was read against plain facts of the utterance
(`instruct.contradictions`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

from ovita.instruct import frames as F
from ovita.instruct.chunks import Chunk
from ovita.instruct.contradictions import contradictions
from ovita.instruct.edits import Also
from ovita.instruct.facts import UNKNOWN, clauses
from ovita.instruct.together import excluded

Outcome = Literal["do", "needs_confirmation", "ask", "decline"]

DO, SHOW = 0.5, 0.05
"""How sure the reader has to be of all frames for them to be done at once, and to be shown; `training/answers.py`
measures what comes of it."""

CERTAIN = 0.8
"""How sure it has to be for facts of the words that it sees itself, and for words that nobody knows, not to count."""

CURT = 5
"""Chunks of an utterance that is so short that words which nobody knows are named."""


@dataclass(frozen=True)
class Understanding:
    """What is to be done about an utterance.

    Args:
        outcome: Do it, show it and ask for a yes, ask back, or decline.
        reading: Its frames or edits, its question, or why it declines.
        unused: Words that it does not use and that may ask for something.
        doubts: What speaks against it, as sentences.
        confidence: How sure the reader is that it is meant in all particulars (0..1).
    """

    outcome: Outcome
    reading: F.Reading
    unused: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    confidence: float = 0.0


def judged(said: Sequence[Chunk], reading: F.Reading) -> Understanding:
    """The verdict on what was read from an utterance.

    Args:
        said: The utterance in chunks.
        reading: With the reader's own confidence.
    """
    if not reads(reading) or all(chunk.kind in UNKNOWN | {"OBJ"} for chunk in said):
        return _nothing(reading, said)
    if against := excluded(frames_of(reading)):
        return _nothing(replace(reading, improper=against), said)
    sure, strange = reading.confidence, _strange(said)
    doubts = (*contradictions(said, frames_of(reading), certain=sure >= CERTAIN), *filter(None, (reading.besides,)))
    held_up = strange if sure < CERTAIN else {*strange} & _alone(said)
    at_once = sure >= DO and not (doubts or held_up)
    outcome: Outcome = "do" if at_once else "needs_confirmation" if sure >= SHOW else "decline"
    left = tuple(dict.fromkeys((*reading.unread, *strange)))
    return Understanding(outcome, reading, left, doubts, sure)


def _alone(said: Sequence[Chunk]) -> set[str]:
    """The last words of clauses that say nothing which is known: "go left, moonwalk"."""
    return {clause[-1].text for clause in clauses(said) if {chunk.kind for chunk in clause} <= UNKNOWN}


def _strange(said: Sequence[Chunk]) -> list[str]:
    """The words that nobody knows: each of few, else what is to be done besides ("... and dance")."""
    if len(said) <= CURT:
        return [chunk.text for chunk in said if chunk.kind == "unknown"]
    return [then.text for chunk, then in pairwise(said) if (chunk.kind, then.kind) == ("and", "unknown")]


def _nothing(reading: F.Reading, said: Sequence[Chunk]) -> Understanding:
    """The verdict where there is nothing to do: the question, or the reason to decline, and the words nobody knows."""
    reading = F.Reading() if reads(reading) else reading
    outcome: Outcome = "ask" if reading.question else "decline"
    strange = tuple(dict.fromkeys(chunk.text for chunk in said if chunk.kind == "unknown"))
    return Understanding(outcome, reading, reading.unread or strange, confidence=reading.confidence)


def reads(reading: F.Reading | None) -> bool:
    """Whether a reading says what to do."""
    return reading is not None and bool(reading.frames or reading.edits) and not (reading.question or reading.improper)


def frames_of(reading: F.Reading) -> tuple[F.SemanticFrame, ...]:
    """The frames of a reading, those that its edits add among them."""
    return (*reading.frames, *(edit.frame for edit in reading.edits if isinstance(edit, Also)))
