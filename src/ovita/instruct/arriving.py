"""How a place is reached: "approach the tray from above", "wait on its left".

It is read before anybody reads the rest, and its words become blanks, so that all other words keep their places.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import takewhile
from typing import Any

from ovita.instruct.chunks import Chunk
from ovita.instruct.frames import (
    Arrive,
    Hover,
    MoveEnd,
    Quantity,
    Reading,
    SemanticFrame,
    Side,
    StopAt,
    Wait,
)

COMING = frozenset(
    """approach approaching approached arrive arrives arriving arrival come comes coming came descend descends
    descending descent land lands landing lower lowers lowering enter enters entering end ends ending finish finishes
    finishing""".split()
)
"""Words for reaching the goal."""

UPRIGHT = frozenset("vertical vertically plumb overhead".split())
"""Words for a way that is neither left nor right."""

ABOVE, HIGH = ("from above", "from overhead", "from higher", "from higher up"), ("above", "higher", "higher up")
STOPS = ("comma", "dot", "and")
PASSED = frozenset(
    "straight in on down from then for the a over near at right directly to onto it by of nice like not side".split()
)
"""Words that go with it, and say nothing else."""


def arrivals(text: str, said: Sequence[Chunk]) -> tuple[str, tuple[Arrive, ...]]:
    """An utterance without the direction from which the goal is reached, and that as a frame.

    Args:
        text: As it was said or typed.
        said: The same in chunks.
    """
    at = next((i for i in range(len(said)) if _from_above(said, i)), -1)
    if at < 0 or _denied(said[:at]):
        return text, ()
    clause = _said_of_it(said, at)
    frame = _arrival(clause)
    if frame is None:
        return text, ()
    begin, end = clause[0].span[0], clause[-1].span[1]
    return text[:begin] + " " * (end - begin) + text[end:], (frame,)


def _denied(before: Sequence[Chunk]) -> bool:
    """Whether the clause that some chunks end denies what comes: "do not come in from above"."""
    clause = takewhile(lambda chunk: chunk.kind not in STOPS, reversed(before))
    return any(chunk.kind in ("never", "avoid") for chunk in clause)


def _arrival(clause: Sequence[Chunk]) -> Arrive | None:
    """What a clause says of reaching the goal from above, if it says nothing else."""
    lengths = [chunk for chunk in clause if chunk.kind == "Qm"]
    things = [chunk for chunk in clause if chunk.kind in ("OBJ", "goal")]
    if not all(map(_belongs, clause)) or max(len(lengths), len(things)) > 1 or not _reaches(clause, bool(lengths)):
        return None
    by = Quantity(lengths[0].number.value, "m", said=lengths[0].number.said) if lengths else None
    return Arrive(direction="up", by=by, place=next((thing.names[0] for thing in things if thing.kind == "OBJ"), ""))


def _reaches(clause: Sequence[Chunk], measured: bool) -> bool:
    """Whether a clause is about reaching the goal, or the last so much of the path."""
    words = {word for chunk in clause for word in chunk.text.lower().split()}
    return bool(words & COMING) or (measured and any(chunk.kind in ("nth", "last") for chunk in clause))


def _from_above(said: Sequence[Chunk], i: int) -> bool:
    """Whether a chunk says that something comes from above: "from above", "vertically", "straight down"."""
    word = said[i].text.lower()
    if word in UPRIGHT:
        return True
    behind = said[i + 1].kind if i + 1 < len(said) else "dot"
    above = word in ABOVE or (word in HIGH and any(chunk.kind == "from" for chunk in said[max(i - 2, 0) : i]))
    down = word == "down" and i > 0 and said[i - 1].text.lower() == "straight"
    return (above or down) and behind not in ("OBJ", "filler")


def _said_of_it(said: Sequence[Chunk], i: int) -> Sequence[Chunk]:
    """The clause around a chunk, and those behind it that say more of the same: "..., vertical, final 30 mm"."""
    begin = max((k + 1 for k in range(i) if said[k].kind in STOPS), default=0)
    end = next((k for k in range(i, len(said)) if said[k].kind in STOPS), len(said))
    while end < len(said) and said[end].kind == "comma":
        then = next((k for k in range(end + 1, len(said)) if said[k].kind in STOPS), len(said))
        more = said[end + 1 : then]
        if not more or not all(map(_belongs, more)) or any(chunk.kind in ("OBJ", "goal") for chunk in more):
            break
        end = then
    return said[begin:end]


def _belongs(chunk: Chunk) -> bool:
    """Whether a chunk says no more than how, where and over what length the goal is reached."""
    words = chunk.text.lower().split()
    known = COMING | UPRIGHT | PASSED | {"above", "straight", "higher", "up"}
    return chunk.kind in ("filler", "OBJ", "goal", "Qm", "nth", "comma") or known.issuperset(words)


def stood_beside(reading: Reading, said: Sequence[Chunk]) -> Reading:
    """A reading with the side of a thing on which to wait or stop: "hover on its left", "wait in front of the gate".

    To wait in front of it is to wait by it, or so far before it on the path.

    Args:
        reading: By whatever reader.
        said: The utterance in chunks.
    """
    at = _side_of_thing(said)
    stop = None if at is None else _stop_there(reading, said, at.name)
    if at is None or stop is None:
        return reading
    frames = [frame for frame in reading.frames if frame is not stop and not _passes(frame, at.name)]
    unread = tuple(word for word in reading.unread if word not in at.words(said))
    return replace(reading, frames=(*frames, *at.beside(stop)), unread=unread)


def _stop_there(reading: Reading, said: Sequence[Chunk], name: str) -> Wait | Hover | StopAt | None:
    """The one stop at a thing, or the one that is said and not read where the thing is passed; None for others."""
    if any(isinstance(frame, MoveEnd) for frame in reading.frames):
        return None
    still = [frame for frame in reading.frames if isinstance(frame, Wait | Hover | StopAt) and name in frame.named]
    if still:
        return still[0] if len(still) == 1 else None
    return _halt_said(reading, said, name)


def _halt_said(reading: Reading, said: Sequence[Chunk], name: str) -> Wait | StopAt | None:
    """The one stop that is said and not read, where a thing is passed; None for others."""
    halts = [chunk for chunk in said if chunk.kind in HALTING]
    passed = [frame for frame in reading.frames if _passes(frame, name)]
    if not passed or len(halts) != 1 or halts[0].text not in reading.unread:
        return None
    return (StopAt if halts[0].kind == "stop" else Wait)(place=name, words=passed[0].words)


def _passes(frame: SemanticFrame, name: str) -> bool:
    return isinstance(frame, Side) and name in frame.objects


HALTING = ("wait", "hover", "stop")
"""Classes of words for standing still."""


@dataclass(frozen=True)
class _Beside:
    """A side of a thing, and how far from it."""

    side: Any
    name: str
    by: Quantity | None

    def beside(self, stop: Wait | Hover | StopAt) -> tuple[SemanticFrame, ...]:
        """A stop at the thing as one on this side of it."""
        if isinstance(stop, StopAt):
            if self.side == "front":
                return (replace(stop, by=self.by, aim="" if self.by else "short"),)
            offset = ((self.side, self.by),)
            return (MoveEnd(end="goal", relation="to", place=self.name, offset=offset, words=stop.words),)
        wait = Wait(place=self.name, duration=stop.duration, words=stop.words)
        if self.side == "front":
            return (replace(wait, by=self.by),)
        return Side(objects=(self.name,), direction=self.side, by=self.by, words=stop.words), wait

    def words(self, said: Sequence[Chunk]) -> set[str]:
        """The words that this is read from, as readers write them that leave them unread."""
        kinds = {*HALTING, self.side, *(["Qm"] if self.by else [])}
        return {chunk.text for chunk in said if chunk.kind in kinds} | ({f"{self.by.value:g} m"} if self.by else set())


def _side_of_thing(said: Sequence[Chunk]) -> _Beside | None:
    """A side that is said right before one thing, with the length before both; None for none."""
    row = [chunk for chunk in said if chunk.kind not in ("filler", "approx", "of", "on", "in", "to", "at")]
    for before, side, thing in zip([None, *row], row, row[1:], strict=False):
        if side.kind in ("left", "right", "front", "back") and thing.kind == "OBJ" and len(thing.names) == 1:
            return _Beside(side.kind, thing.names[0], before.q if before and before.kind == "Qm" else None)
    return None
