"""Stops that are denied: "past the drum without stopping", "don't stop at the cup, just slow down there".

A reader of everything else would take the stop and pass over the denial. So what denies a stop becomes blanks before
anybody reads the rest, whose words keep their places.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import takewhile

from ovita.instruct.chunks import Chunk
from ovita.instruct.frames import NoStop
from ovita.paths.part import WHOLE, PathPart

HALTS = ("stop", "wait", "hover")
"""Classes of words for a halt."""

DENIED = frozenset(
    (
        *("never", "no", "non", "not", "but not", "do not", "don't", "dont", "don't you", "don't ever", "never ever"),
        *("without", "must not", "mustn't", "must never", "should not", "shouldn't", "should never", "shall not"),
        *("may not", "not ever", "don't want", "do not want", "no need", "need not", "needn't", "instead of"),
        *("rather than", "not to", "so as not to", "try not to", "at no point", "nvr", "nor", "no more"),
        *("doesn't", "doesnt", "does not", "doesn't need", "forget", "forget about", "omit", "ditch"),
        *("skip", "remove", "cut", "drop", "delete", "cancel", "scrap", "lose", "leave out", "take out", "get rid of"),
    )
)
"""Words that deny what should be; others say what is: "it didn't stop there"."""

TAKEN = ("take", "leave", "cut")
"""Words that deny what is behind them with an "out" after it."""

NONSTOP, MOVING = "nonstop", "keep moving"
"""What says by itself that there is no stop."""

OTHERS = (NONSTOP, MOVING, "stop by", "to stop")
"""What is a halt besides, where it is denied."""

LASTING = frozenset(("short", "good"))
"""Words of a stop that is not one on the way: "stop short", "stop for good"."""

NEEDED = ("need to", "have to", "has to")
"""What it is said of that it is not needed: "it doesn't have to stop"."""

BETWEEN = frozenset(
    (
        *("the", "that", "this", "its", "it", "want", "to", "ever", "be", "a", "any", "have", "you", "make", "need"),
        *NEEDED,
        *("bother", "little", "short", "brief"),
    )
)
"""Fillers between a denial and what it denies."""

LEADING = ("filler", "at", "in", "on", "by", "near", "over", "whole", "path", "between", "before", "after")
HOW = frozenset("so that quite too long longer dead soon".split())
"""Fillers that say how a stop is not to be, which is no denial of it."""

REFERRING = ("only", "there", "here")
MORE = ("more", "anymore", "any more")
ENDING = ("comma", "dot", "and", "only", "because", "then_on")


@dataclass(frozen=True)
class _Denial:
    """Where a stop is denied: chunks from `first` up to `end`, the word for the stop, the object named, a part."""

    first: int
    halt: int
    end: int
    named: int
    part: PathPart


def denied_stops(text: str, said: Sequence[Chunk]) -> tuple[str, tuple[NoStop, ...]]:
    """An utterance without the stops that it denies, and where there is to be none.

    It is left as it is where a stop is asked for and one is denied without a place of its own.

    Args:
        text: As it was said or typed.
        said: The same in chunks.
    """
    denials, asked = _halts(said)
    if (asked and any(denial.named < 0 for denial in denials)) or "why" in text.lower().split():
        return text, ()
    for denial in denials:
        text = _without(text, said, denial)
    return text, tuple(dict.fromkeys(NoStop(part=denial.part) for denial in denials))


def _halts(said: Sequence[Chunk]) -> tuple[list[_Denial], bool]:
    """The stops that are denied, and whether others are asked for."""
    halts = [i for i, chunk in enumerate(said) if chunk.kind in HALTS or chunk.text.lower() in OTHERS]
    found = {i: _denial(said, i) for i in halts}
    asked = any(denial is None and said[i].kind in HALTS for i, denial in found.items())
    return [denial for denial in found.values() if denial is not None], asked


def _denial(said: Sequence[Chunk], halt: int) -> _Denial | None:
    """What denies a word for a stop and nothing else, or None."""
    first = _denied_from(said, halt)
    if first < 0:
        return None
    if NONSTOP in (said[halt].text.lower(), f"{said[first].text.lower()}stop"):
        return _Denial(first, halt, halt + 1, -1, WHOLE)
    behind = list(takewhile(_leads, said[halt + 1 :]))
    at = halt + 1 + len(behind)
    kind = said[at].kind if at < len(said) else ""
    limits = [chunk.kind for chunk in behind if chunk.kind in ("before", "after")]
    if kind == "OBJ":
        part = PathPart(limits[0] if limits else "near", places=said[at].names[:1])
        return _ended(said, _Denial(first, halt, at + 1, at, part))
    if limits:
        return None
    earlier = [chunk for chunk in said[:first] if chunk.kind == "OBJ"] if kind == "there" else []
    part = PathPart("near", places=earlier[-1].names[:1]) if earlier else WHOLE
    return _ended(said, _Denial(first, halt, at + (kind == "there"), -1, part))


def _denied_from(said: Sequence[Chunk], halt: int) -> int:
    """The chunk from which on a word for a stop is denied; -1 where it is not."""
    word = said[halt].text.lower()
    if word in (NONSTOP, MOVING):
        return halt
    between = list(takewhile(lambda chunk: chunk.text.lower() in BETWEEN, reversed(said[:halt])))
    first = halt - len(between) - 1
    if _takes_out(said, first, halt):
        return first
    if first < 0 or said[first].text.lower() not in DENIED or not LASTING.isdisjoint(word.split()):
        return -1
    needed = said[first].text.lower().endswith("need") or any(chunk.text.lower() in NEEDED for chunk in between)
    if said[first].text.lower().startswith("does") and not needed:
        return -1
    told = first > 0 and said[first - 1].text.lower().startswith(("there", "does"))  # "there is no stop", a complaint
    return -1 if told and said[first].text.lower() in ("no", "not") else first


def _takes_out(said: Sequence[Chunk], first: int, halt: int) -> bool:
    """Whether a stop is to be taken out: "take the stop at the tap out"."""
    taken = first >= 0 and said[first].text.lower() in TAKEN
    return taken and any(chunk.text.lower() == "out" for chunk in said[halt + 1 : halt + 6])


def _leads(chunk: Chunk) -> bool:
    """Whether a chunk may stand between a stop and its place."""
    return chunk.kind in LEADING and chunk.text.lower() not in HOW


def _ended(said: Sequence[Chunk], denial: _Denial) -> _Denial | None:
    """A denial with which its clause ends."""
    behind = list(takewhile(_says_nothing, said[denial.end :]))
    then = said[denial.end + len(behind) :]
    if then and then[0].kind not in ENDING:
        return None
    return replace(denial, end=denial.end + len(behind)) if any(map(_is_more, behind)) else denial


def _says_nothing(chunk: Chunk) -> bool:
    return (chunk.kind == "filler" and _leads(chunk)) or _is_more(chunk)


def _is_more(chunk: Chunk) -> bool:
    return chunk.text.lower() in MORE


def _without(text: str, said: Sequence[Chunk], denial: _Denial) -> str:
    """A text without a denial; the object that it names stays where later words refer to it."""
    referred = denial.named >= 0 and any(chunk.kind in REFERRING for chunk in said[denial.end :])
    first = denial.first - (denial.first > 0 and said[denial.first - 1].kind == "and")
    begin = said[first].span[0]
    end = said[denial.halt if referred else denial.end - 1].span[1]
    end -= 3 if referred and text[:end].lower().endswith(" at") else 0
    return text[:begin] + " " * (end - begin) + text[end:]
