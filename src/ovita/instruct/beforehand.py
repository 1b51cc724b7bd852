"""An utterance before the reader sees it: with waypoints for features of the path, and without what is heard apart."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from ovita.instruct import frames as F
from ovita.instruct.arriving import arrivals
from ovita.instruct.chunks import Chunk, chunks
from ovita.instruct.facts import PAUSES, UNKNOWN
from ovita.instruct.landmarks import by_feature, on_axes
from ovita.instruct.nonstop import denied_stops
from ovita.instruct.numerals import written_out
from ovita.instruct.selfrepair import repaired
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array


def with_landmarks(text: str, scene: Scene, positions: Array | None) -> tuple[str, str]:
    """An utterance without slips of the tongue, with waypoints for features of the path, and what was taken for what.

    Args:
        text: As it was said or typed.
        scene: Whose objects it may name.
        positions: The path (N, 3) [m], or None.
    """
    text, points = on_axes(repaired(written_out(text), scene, positions), scene)
    text, rows = by_feature(text, scene, positions)
    return _marked(text), " ".join(filter(None, (points, rows)))


def _marked(text: str) -> str:
    """An utterance that begins with "this part" with "here" in its place, which is what was marked by hand."""
    words = text.split()
    for i, (word, thing) in enumerate(pairwise(words[:EARLY])):
        if word.lower() == "this" and thing.lower().strip(",:") in STRETCHES:
            return " ".join((*words[:i], "here", *words[i + 2 :]))
    return text


EARLY = 4
"""Words of an utterance among which "this part" is no part that was named before it."""

STRETCHES = frozenset("part bit section stretch segment".split())


def heard_apart(
    text: str, scene: Scene, positions: Array | None, before: Sequence[F.SemanticFrame]
) -> tuple[str, tuple[F.SemanticFrame, ...]]:
    """An utterance without what is heard before all else, and that.

    That is stops that are denied, and a direction of approach.
    """
    found: list[F.SemanticFrame] = []
    for hear, about in ((denied_stops, HALTS), (arrivals, ())):
        if not any(isinstance(frame, about) for frame in before):
            text, heard = hear(text, chunks(text, scene, positions)[0])
            found += heard
    return text, tuple(found)


HALTS = (F.StopAt, F.Wait, F.Hover)
"""Frames that make a robot stand still."""


def stands(frame: F.SemanticFrame, apart: Sequence[F.SemanticFrame]) -> bool:
    """Whether a frame makes the robot stand still, or end, where it is said not to stop."""
    there = [one.part for one in apart if isinstance(one, F.NoStop)]
    anywhere = any(not part or part.places[:1] == frame.named[:1] for part in there)
    return anywhere and isinstance(frame, (*HALTS, F.MoveEnd) if all(there) else HALTS)


def goes_past(frame: F.SemanticFrame, apart: Sequence[F.SemanticFrame]) -> bool:
    """Whether a frame says no more than that it goes on past a thing at which there is to be no stop."""
    past = {place for one in apart if isinstance(one, F.NoStop) for place in one.part.places}
    mere = isinstance(frame, F.Extend) or (isinstance(frame, F.Visit) and frame.relation == "at")
    return mere and bool(frame.named) and {*frame.named} <= past


DOING = frozenset(
    "plain farther closer faster slower raise lower drop up down left right touch wait stop keep avoid".split()
)
"""Classes of words that may begin what is to be done."""

SUBJECTS = frozenset("it it's he he's she she's they they're we i the my our your there this that people".split())


def tells(clause: Sequence[Chunk]) -> bool:
    """Whether a clause begins as one that tells how things are, and has no word for what is to be done."""
    first = next((chunk.text.lower().split()[0] for chunk in clause if chunk.kind not in PAUSES), "")
    says = any(chunk.kind not in UNKNOWN - {"unknown"} for chunk in clause)
    return not says or (first in SUBJECTS and all(chunk.kind not in DOING for chunk in clause))
