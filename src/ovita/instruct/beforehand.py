"""An utterance before the readers see it: put in plain words, and without what is heard before all else."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import takewhile

from ovita.instruct import frames as F
from ovita.instruct.arriving import arrivals, moved_ends
from ovita.instruct.asides import without_asides
from ovita.instruct.chunks import DOING, Chunk, chunks
from ovita.instruct.facts import UNKNOWN
from ovita.instruct.idioms import plainer, without_cargo, without_now
from ovita.instruct.landmarks import by_number, by_stops, not_so_high, on_axes
from ovita.instruct.nonstop import denied_stops
from ovita.instruct.numerals import written_out
from ovita.instruct.rules import PAUSES
from ovita.instruct.selfrepair import repaired
from ovita.limits.problem import is_support
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array


def put_plainly(text: str, scene: Scene, positions: Array | None, *, first: bool = False) -> tuple[str, str]:
    """An utterance without slips of the tongue, idioms, compass points and numbers of rows, and what was taken.

    The first one about a path says nothing of what was done to it.
    """
    text = without_asides(text, scene, first=first)
    text = not_so_high(without_now(text, scene), scene, positions) if first else text
    text, points = on_axes(repaired(plainer(without_cargo(written_out(text), scene), scene), scene, positions), scene)
    text = by_stops(_all_but(text, scene, positions), scene, positions)
    text, stretches = by_number(text, scene, positions)
    return text, " ".join(filter(None, (points, stretches)))


def _all_but(text: str, scene: Scene, positions: Array | None) -> str:
    """An utterance with the names of all objects but some: "20 cm from everything except the box"."""
    things = [item.name for item in scene if not is_support(item)]
    said = [chunk for chunk in chunks(text, scene, positions)[0] if chunk.kind not in ("filler", "here", "there")]
    for i in (i for i, chunk in enumerate(said) if chunk.kind == "except" and i > 0):
        begin, named = _all_before(said, i, things), _named_after(said, i)
        others = [name for name in things if not any(name in one.names for one in named)]
        if begin is not None and named and 0 < len(others) < len(things):
            return f"{text[:begin]}{' and '.join(f'the {name}' for name in others)}{text[named[-1].span[1] :]}"
    return text


def _all_before(said: Sequence[Chunk], i: int, things: Sequence[str]) -> int | None:
    """Where the words for all objects begin that stand before an "except", or in it ("everything but"); or None."""
    found = (said[k].span[0] for k in range(i - 1, max(i - 5, -1), -1) if _is_all(said[k], things))
    own = said[i].text.lower().startswith(EVERYTHING) and said[i - 1].kind in APART
    return next(found, said[i].span[0] if own else None)


def _named_after(said: Sequence[Chunk], i: int) -> Sequence[Chunk]:
    """The objects in the list behind a chunk, with what stands between them."""
    named = list(takewhile(lambda one: one.kind in ("OBJ", "and", "comma"), said[i + 1 :]))
    while named and named[-1].kind != "OBJ":
        named.pop()
    return named


def _is_all(chunk: Chunk, things: Sequence[str]) -> bool:
    return (chunk.kind == "OBJ" and len(chunk.names) == len(things) > 1) or chunk.text.lower() in EVERYTHING


EVERYTHING = ("everything", "anything", "all")
APART = ("from", "than", "to")


def heard_apart(
    text: str, scene: Scene, positions: Array | None, before: Sequence[F.SemanticFrame]
) -> tuple[str, tuple[F.SemanticFrame, ...]]:
    """An utterance without what is heard before all else, and that.

    That is stops that are denied, a direction of approach, and how much sooner or later the path is to end.
    """
    found: list[F.SemanticFrame] = []
    for hear, about in ((denied_stops, HALTS), (arrivals, ()), (moved_ends, ENDS)):
        if not any(isinstance(frame, about) for frame in before):
            text, heard = hear(text, chunks(text, scene, positions)[0])
            found += heard
    return text, tuple(found)


HALTS = (F.StopAt, F.Wait, F.Hover)
"""Frames that make a robot stand still."""

ENDS = (F.StopAt, F.MoveEnd, F.Trim, F.Extend)
"""Frames that say where the path ends."""


def stands(frame: F.SemanticFrame, apart: Sequence[F.SemanticFrame]) -> bool:
    """Whether a frame makes the robot stand still, or end, where it is said not to stop."""
    there = [one.part for one in apart if isinstance(one, F.NoStop)]
    anywhere = any(not part or part.places[:1] == frame.named[:1] for part in there)
    return anywhere and isinstance(frame, (*HALTS, F.MoveEnd) if all(there) else HALTS)


SUBJECTS = frozenset("it it's he he's she she's they they're we i the my our your there this that people".split())


def tells(clause: Sequence[Chunk]) -> bool:
    """Whether a clause begins as one that tells how things are, and has no word for what is to be done."""
    first = next((chunk.text.lower().split()[0] for chunk in clause if chunk.kind not in PAUSES), "")
    says = any(chunk.kind not in UNKNOWN - {"unknown"} for chunk in clause)
    return not says or (first in SUBJECTS and all(chunk.kind not in DOING for chunk in clause))
