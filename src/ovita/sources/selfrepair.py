"""Self-repair: what a speaker takes back in the middle of an utterance, "two, no, three centimetres" (Levelt 1983).

Amounts, directions, paces and objects that are named anew behind "no", "I mean" or "wait" replace what is before. What
was taken back becomes blanks, so that all words keep their places. Changes of a path are read without it: the network
that reads them has learned it.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import dropwhile, takewhile

from ovita.instruct.chunks import Chunk, chunks
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array

ENDS = frozenset(("comma", "dot", "and"))
LINKING = ("filler", "on", "at", "from")
NOES = ("no", "nope", "nah", "wait")
DIGITS = "0123456789.,"
GROUPS = (
    frozenset("left right front back up down raise lower".split()),
    frozenset("faster slower".split()),
    frozenset("closer farther".split()),
    frozenset("slight large".split()),
    frozenset("half third quarter tenth fifth double triple Qx Qpc".split()),
    frozenset(("OBJ",)),
)
"""Classes of words of which one takes the place of another; two numbers do where their units allow it."""

FEW = 5
"""So many chunks back is what a correction may take the place of."""


def repaired(text: str, scene: Scene, positions: Array | None = None) -> str:
    """An utterance without what its speaker takes back; its words keep their places, but for a unit taken over.

    Args:
        text: As it was said or typed.
        scene: Whose objects it may name.
        positions: The path (N, 3) [m], or None.
    """
    said = [chunk for chunk in chunks(text, scene, positions) if chunk.kind != "filler"]
    for i in range(1, len(said) - 1):
        used = _marker(said[i:])
        behind = list(dropwhile(_pauses, said[i + used :])) if used else []
        pairs = _pairs(_before(said[:i]), list(takewhile(lambda chunk: chunk.kind not in ENDS, behind)))
        if pairs:
            spoken = [chunk.span[1] for chunk in said[:i] if not _pauses(chunk)]
            return repaired(_without(text, pairs, (spoken[-1], pairs[0][1].span[0])), scene, positions)
    return text


def _pauses(chunk: Chunk) -> bool:
    return chunk.kind in ("comma", "dot", "by", "to", "correct") or chunk.text.lower() in NOES


def _before(said: Sequence[Chunk]) -> list[Chunk]:
    """The last few chunks of the clause before a marker, the nearest first."""
    return list(takewhile(lambda chunk: chunk.kind not in ("dot", "and"), dropwhile(_pauses, said[::-1])))[:FEW]


def _pairs(before: list[Chunk], behind: Sequence[Chunk]) -> list[tuple[Chunk, Chunk]]:
    """What is taken back and what takes its place; nothing if the first chunk behind the marker takes no place."""
    pairs: list[tuple[Chunk, Chunk]] = []
    for new in behind:
        old = next((chunk for chunk in before if _replaces(new, chunk)), None)
        if old is not None:
            before.remove(old)
            pairs.append((old, new))
        elif not pairs and new.kind not in LINKING:
            break
    return pairs


def _marker(said: Sequence[Chunk]) -> int:
    """How many chunks say that something is taken back: "I mean", or "no" before a pause or a number; 0 if none."""
    first, behind = said[0], said[1]
    if first.kind == "correct":
        return 1
    return int(first.kind == "never" and first.text.lower() in NOES and (behind.kind in ENDS or behind.q is not None))


def _replaces(new: Chunk, old: Chunk) -> bool:
    if new.q is not None and old.q is not None:
        return new.kind == old.kind or "Qn" in (new.kind, old.kind)
    return any(new.kind in group and old.kind in group for group in GROUPS)


def _without(text: str, pairs: Sequence[tuple[Chunk, Chunk]], marker: tuple[int, int]) -> str:
    """A text without a marker and what is taken back; a bare number takes over the unit of the one before it."""
    letters = list(text)
    for begin, end in (*(old.span for old, _ in pairs), marker):
        letters[begin:end] = " " * (end - begin)
    added = 0
    for old, new in sorted(pairs, key=lambda pair: pair[1].span, reverse=True):
        unit = _unit(text[slice(*old.span)])
        if new.q is not None and unit and not _unit(text[slice(*new.span)]):
            letters[new.span[1] : new.span[1]] = f" {unit}"
            added += len(unit) + 1
    del letters[marker[0] : marker[0] + min(added, marker[1] - marker[0] - 1)]
    return "".join(letters)


def _unit(amount: str) -> str:
    """The unit as it is written in an amount: "inches" of "two inches", "" of "five" and "5"."""
    *numbers, last = amount.split()
    return last.lstrip(DIGITS) if numbers or not last.isalpha() else ""
