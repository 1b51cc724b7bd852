"""Ends that come sooner or later: "stop half a metre short of where you stop now", "be back 5 seconds earlier".

It is read before anybody reads the rest, and its words become blanks, so that all other words keep their places.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

from ovita.instruct.chunks import Chunk
from ovita.instruct.frames import Extend, Pace, Quantity, Trim

ENDING = frozenset("stop stopping halt park end ending finish finishing".split())
"""Words for coming to the end; "it stops 10 cm short" complains."""

NOW = frozenset("stops stopped halts parks ends ended finishes goal there that".split()) | ENDING
"""Words for where it ends as yet."""

ARRIVING = frozenset("arrive arriving back home done ready be finished get need there".split())
IN_TIME: Mapping[str, Literal["faster", "slower"]] = {"earlier": "faster", "sooner": "faster", "later": "slower"}
"""Words for being there so many seconds sooner or later, and what the speed is to be for it."""

SOONER = frozenset("earlier sooner short shorter before".split())
LATER = frozenset("later further farther longer beyond past".split())

AMONG = frozenset(
    """it the path a by of than now where you do does is currently that just about already usually on so at in to there
    here out make have let can could should must will would please want i we and right time""".split()
)
"""Words that go with it, and say nothing else."""

PAUSES = ("comma", "dot", "and", "because")


def moved_ends(text: str, said: Sequence[Chunk]) -> tuple[str, tuple[Trim | Extend | Pace, ...]]:
    """An utterance without how much sooner or later the path is to end, and that as a frame.

    It is left as it is where the path goes on after it stops, and where anything else is said in the same clause.

    Args:
        text: As it was said or typed.
        said: The same in chunks.
    """
    if any(chunk.kind == "then_on" for chunk in said):
        return text, ()
    found = [(clause, frame) for clause in _clauses(said) if (frame := _moved_end(clause)) is not None]
    if len(found) != 1:
        return text, ()
    clause, frame = found[0]
    begin, end = clause[0].span[0], clause[-1].span[1]
    return text[:begin] + " " * (end - begin) + text[end:], (frame,)


def _clauses(said: Sequence[Chunk]) -> list[list[Chunk]]:
    """Chunks between commas, stops and conjunctions."""
    clauses: list[list[Chunk]] = [[]]
    for chunk in said:
        if chunk.kind in PAUSES:
            clauses.append([])
        else:
            clauses[-1].append(chunk)
    return [clause for clause in clauses if clause]


def _moved_end(clause: Sequence[Chunk]) -> Trim | Extend | Pace | None:
    """How much sooner or later a clause says that the path ends, if it says nothing else."""
    at = next((i for i, chunk in enumerate(clause) if chunk.kind in ("Qm", "Qs")), -1)
    if at < 0 or any(chunk.kind in ("OBJ", "never") for chunk in clause):
        return None
    timed, q = clause[at].kind == "Qs", clause[at].number
    first, then = _words(clause[:at]), _words(clause[at + 1 :])
    way = [word for word in (*first, *then) if word in SOONER | LATER]
    known = AMONG | (ARRIVING if timed else NOW) | {*way[:1]}
    if len(way) != 1 or not known.issuperset((*first, *then)):
        return None
    if timed:
        arrives = way[0] in IN_TIME and not ARRIVING.isdisjoint((*first, *then))
        return Pace(change=IN_TIME[way[0]], amount=Quantity(q.value, "s", said=q.said)) if arrives else None
    amount = Quantity(q.value, "m", said=q.said)
    if not _ends(first, then, way[0]):
        return None
    return Trim(cut="last", amount=amount) if way[0] in SOONER else Extend(by=amount)


def _words(chunks: Sequence[Chunk]) -> list[str]:
    return [word for chunk in chunks for word in chunk.text.lower().split()]


def _ends(first: Sequence[str], then: Sequence[str], way: str) -> bool:
    """Whether the words before a length are about ending, and those behind it say what it is before or beyond.

    "The end" is a place, and not what is to be done.
    """
    at = next((i for i, word in enumerate(first) if word in ENDING), -1)
    placed = way not in ("before", "beyond", "past") or not NOW.isdisjoint(then)
    return at >= 0 and first[max(at - 1, 0)] != "the" and placed
