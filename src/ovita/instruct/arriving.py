"""How the goal is reached: "approach the tray from above", "come straight down".

It is read before anybody reads the rest, and its words become blanks, so that all other words keep their places.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import takewhile

from ovita.instruct.chunks import Chunk
from ovita.instruct.frames import (
    Arrive,
    Quantity,
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
