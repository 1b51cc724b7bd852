"""What the frames of one utterance say together, and what the words around them say besides.

That is units that are said once, limits that exclude each other, and what of an object is meant: "end on the box" is on
its top, "touch the box" at its surface. These words stand in `aiming/aims.txt`.
"""

from __future__ import annotations

from collections.abc import Collection, Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import TypeAlias

from ovita.instruct import frames as F
from ovita.instruct.chunks import UNIT_KIND, Chunk
from ovita.instruct.lexicon import DETERMINERS, concepts, stems
from ovita.instruct.numerals import bare_unit, unit_at

MEASURED = (F.Shift, F.MoveEnd, F.Approach, F.Clearance, F.Height, F.Extend, F.Hover, F.Hop, F.Bound, F.Visit, F.Figure)
"""Frames whose bare numbers are lengths, but for those of `UNMEASURED` slots."""

UNMEASURED = ("turns", "waves", "duration")


def _bare(frame: F.SemanticFrame, numbers: Container[float]) -> dict[str, F.Quantity]:
    """The lengths or speeds of a frame, by slot, that are among the numbers that were said without a unit."""
    match frame:
        case F.Pace(change="set" | "cap" | "floor"):
            units = ("", "m/s")
        case _ if isinstance(frame, MEASURED):
            units = ("", "m")
        case _:
            return {}
    stated = {slot: q for slot, q in frame.quantities.items() if q.role != "of" and slot not in UNMEASURED}
    return {slot: q for slot, q in stated.items() if q.unit in units and abs(q.value) in numbers}


def with_units(
    frames: Sequence[F.SemanticFrame], said: Sequence[Chunk], extent: float | None = None
) -> tuple[F.SemanticFrame, ...]:
    """Frames whose bare lengths and speeds have the unit of another one that is said ("radius 20 ft, rise 60").

    Where no unit is said, a length too large for metres is in centimetres; others stay bare, which is metres.

    Args:
        frames: As read, by whatever reader.
        said: The utterance in chunks.
        extent: Diagonal of the path's bounding box [m], or None.
    """
    timed = any(isinstance(frame, F.Pace) and frame.amount and frame.amount.unit == "s" for frame in frames)
    return tuple(map(_Told(said, extent, timed).filled, frames))


@dataclass(frozen=True)
class _Told:
    """The numbers and units of an utterance, on a path of some extent [m]; `timed` if a pace is in seconds."""

    said: Sequence[Chunk]
    extent: float | None
    timed: bool

    def filled(self, frame: F.SemanticFrame) -> F.SemanticFrame:
        """A frame whose bare amounts have the unit that they are meant in."""
        at, second = self._seconds()
        behind = {chunk.number.value for chunk in self.said[at:] if chunk.kind == "Qn" and chunk.number.value >= 1.0}
        match frame:
            case F.Pace() if second and (q := _bare(frame, behind).get("amount")) is not None:
                return replace(frame, amount=F.Quantity(q.value * second, "s", q.role))
            case F.Approach(by=F.Quantity(unit="") as by) if any(chunk.kind == "multiply" for chunk in self.said):
                return replace(frame, by=replace(by, unit="x", role="to"))
        kind = "Qv" if isinstance(frame, F.Pace) else "Qm"
        bare = _bare(frame, {chunk.number.value for chunk in self.said if chunk.kind == "Qn"})
        return _refilled(frame, {slot: self._measured(q, kind) for slot, q in bare.items()}) if bare else frame

    def _seconds(self) -> tuple[int, float]:
        """Where a unit of time is said and how long it is [s]: "the first half takes ten minutes, the second six"."""
        times = self._units("Qs") if self.timed and not self._units("Qv") else []
        return times[0] if times else (len(self.said), 0.0)

    def _units(self, kind: str) -> list[tuple[int, float]]:
        """Where amounts of a kind are said, and what one of their unit is in SI."""
        return [(k, factor) for k, chunk in enumerate(self.said) if (factor := unit_of(chunk, kind))]

    def _measured(self, q: F.Quantity, kind: str) -> F.Quantity:
        """A bare length or speed in the unit of the one said before it, else of the first."""
        units = self._units(kind)
        at = next((k for k, chunk in enumerate(self.said) if chunk.q and chunk.q.value == abs(q.value)), len(self.said))
        near = [factor for k, factor in units if k < at][-1:] or [factor for _, factor in units[:1]]
        known = near[0] if near else None
        if kind == "Qm":
            factor = bare_unit(q.value, known, self.extent)
        else:
            factor = known if known and abs(q.value) >= 1.0 else 1.0
        if factor == 1.0 and self.extent is None:
            return q  # metres, for want of a path that would tell
        return replace(q, value=q.value * factor, unit="m" if kind == "Qm" else "m/s", said="")


def unit_of(chunk: Chunk, kind: str = "Qm") -> float | None:
    """What one of the unit that a length (or a speed, "Qv") is said in is in SI; None where it is none with a unit."""
    words = chunk.text.lower().split()
    found = (unit_at(words, k) for k in range(1, len(words))) if chunk.kind == kind else ()
    return next((factor for unit, factor, _ in found if UNIT_KIND.get(unit) == kind), None)


def _refilled(frame: F.SemanticFrame, filled: Mapping[str, F.Quantity]) -> F.SemanticFrame:
    """A frame with other quantities in some of its slots."""
    offset = tuple((way, filled.get(way, q)) for way, q in getattr(frame, "offset", ()))
    own = {slot: q for slot, q in filled.items() if hasattr(frame, slot)}
    return replace(frame, **own, **({"offset": offset} if offset else {}))  # type: ignore[arg-type]


def excluded(frames: Sequence[F.SemanticFrame]) -> str:
    """What is said of frames whose limits exclude each other, or ""."""
    limits = [limit for frame in frames for limit in _limited(frame)]
    least = [(about, q.value) for about, q in limits if q.role != "at_most"]
    most = [(about, q.value) for about, q in limits if q.role == "at_most"]
    crossed = any(one == other and low > high for one, low in least for other, high in most)
    return "That asks for two things that exclude each other." if crossed else ""


def _limited(frame: F.SemanticFrame) -> list[tuple[object, F.Quantity]]:
    """What a frame sets limits to, and which."""
    match frame:
        case F.Pace(change="cap" | "floor", amount=F.Quantity() as q):
            return [(("duration" if q.unit == "s" else "speed", frame.part), q)]
        case F.Clearance(objects=objects, distance=q):
            return [(("clearance", name), q) for name in objects if q.role in ("at_least", "at_most")]
        case F.Height(level=F.Quantity(role="at_least" | "at_most") as q, of=of):
            return [(("height", of, frame.part), q)]
    return []


LIMITING = frozenset(
    """never not no don't dont can't cannot mustn't max maximum most limit limited always throughout whole entire along
    any everywhere keep stay remain kept staying keeping farther further exceed hug""".split()
)
"""Words with which a greatest distance is one that holds all along: "stay within 30 cm", not "come within 30 cm"."""

NEGATIONS = frozenset("never not no don't dont can't cannot mustn't".split())
"""Those of them that may deny something else."""

COMPARED_TO = frozenset("than more further farther beyond exceed".split())
"""Words with which a negation is about the distance: "not more than 30 cm away"."""

TOUCHES = frozenset("touch touching hit hitting bump bumping knock knocking brush scratch".split())
"""Words for what a negation may deny beside a distance: "come within 10 cm, but don't touch it"."""

ALWAYS = frozenset(
    "never not don't always throughout whole entire everywhere stay stays staying remain remaining".split()
)
"""Words with which all of a path stays on one side of an object."""


def held_along(frame: F.SemanticFrame, words: Collection[str]) -> F.SemanticFrame:
    """A greatest distance, or a side to stay on, as one that holds all along, where the words around it say so."""
    if isinstance(frame, F.Side) and {frame.direction, F.OPPOSITES.get(frame.direction)} <= {*words}:
        return frame  # "on the left, not on the right"
    if isinstance(frame, F.Side) and (not ALWAYS.isdisjoint(words) or ("keep" in words and "on" not in words)):
        return replace(frame, along=True)
    only_touch = not TOUCHES.isdisjoint(words) and COMPARED_TO.isdisjoint(words)
    limiting = LIMITING - (NEGATIONS if only_touch else frozenset())
    if isinstance(frame, F.Clearance) and frame.distance.role == "at_most" and not limiting.isdisjoint(words):
        return replace(frame, along=True)
    return frame


_PASSED = DETERMINERS | {"and", ",", "or", "both"}
"""Words between an object and what is said of it, or between two objects."""

_ON: dict[str, F.Aim] = {"on": "top", "resting": "top", "touching": "surface"}
MEANT: Mapping[type[F.SemanticFrame], Mapping[str, F.Aim]] = {
    F.MoveEnd: _ON | {"above": "above", "below": "below", "behind": "behind", "beside": "beside", "by": "beside"},
    F.Extend: _ON,
    F.Visit: {"resting": "top", "touching": "surface", "beside": "beside", "by": "beside"},
    F.StopAt: {"resting": "top", "short": "short"},
    F.Wait: {"resting": "top", "short": "short"},
}
"""What words before an object say of it in each kind of frame; "wait on the table" may be said of a place beside it."""

Word: TypeAlias = tuple[str, F.Span]
"""A word in small letters, and where it stands."""

Named: TypeAlias = tuple[tuple[str, ...], F.Span]
"""Objects, and where they are named in the utterance."""

_Said: TypeAlias = tuple[tuple[str, ...], F.Span, str]
"""Objects, where they are named, and the concept of the words before them."""


def aimed(
    frames: Sequence[F.SemanticFrame], words: Sequence[Word], named: Sequence[Named]
) -> tuple[F.SemanticFrame, ...]:
    """Frames with what of an object is meant, where the words before it say so.

    Args:
        frames: As read, by whatever reader.
        words: The utterance that they were read from, word for word.
        named: Every place where it names objects.
    """
    said = list(_said(words, named))
    if _ending({word for word, _ in words}):
        frames = [_apart(frame, said) for frame in frames]
    return tuple(_aimed(frame, said) for frame in frames)


def _ending(words: set[str]) -> bool:
    """Whether an utterance tells where to end or begin, and not by how much to move an end."""
    aims = concepts(folder="aiming")
    return not words.isdisjoint(aims["ending"]) and words.isdisjoint(aims["amount"])


def _apart(frame: F.SemanticFrame, said: Sequence[_Said]) -> F.SemanticFrame:
    """An end so far from an object, where a reader took the distance for how far the end moves."""
    match frame:
        case F.MoveEnd(relation="away" | "toward", place=place, by=F.Quantity()):
            if any(concept == "from" and place in names for names, _, concept in said):
                return replace(frame, relation="to", aim="beside")
    return frame


def _aimed(frame: F.SemanticFrame, said: Sequence[_Said]) -> F.SemanticFrame:
    """A frame that goes to an object as such (not beside it, toward it, or over it), with what is meant of it."""
    match frame:
        case F.MoveEnd(relation="to", offset=(), aim="", place=place):
            own: tuple[F.Place, ...] = (place,)
        case F.StopAt(place=place, aim="") | F.Wait(place=place, aim="") | F.Extend(place=place, aim=""):
            own = (place,)
        case F.Visit(relation="at", objects=objects, aim=""):
            own = objects
        case _:
            return frame
    meant = MEANT[type(frame)]
    for names, (begin, end), concept in said:
        within = not frame.words or any(a < end and begin < b for a, b in frame.words)
        if concept in meant and within and {*own} & {*names}:
            return _so_far(replace(frame, aim=meant[concept]))
    return frame


def _so_far(frame: F.SemanticFrame) -> F.SemanticFrame:
    """An end so far above or below an object, as that far up or down from it."""
    match frame:
        case F.MoveEnd(aim="above", by=F.Quantity() as by):
            return replace(frame, offset=(("up", by),), by=None, aim="")
        case F.MoveEnd(aim="below", by=F.Quantity() as by):
            return replace(frame, offset=(("down", by),), by=None, aim="")
    return frame


def _said(words: Sequence[Word], named: Sequence[Named]) -> Iterator[_Said]:
    """Each naming of objects with the concept of the words right before it; all that are touched together share it."""
    concept, end = "", 0
    for names, span in named:
        between = [word for word, at in words if end <= at[0] and at[1] <= span[0]]
        together = concept == "touching" and _PASSED.issuperset(between)
        concept, end = concept if together else _concept(between), span[1]
        yield names, span, concept


def _concept(words: list[str]) -> str:
    """The concept of the phrase that words end with, or ""."""
    while words and words[-1] in _PASSED:
        words = words[:-1]
    return next((concept for concept, phrase in _phrases() if _ends_with(words, phrase)), "")


@cache
def _phrases() -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Every phrase with its concept, longest first."""
    found = [(concept, tuple(phrase.split())) for concept, said in concepts(folder="aiming").items() for phrase in said]
    return tuple(sorted(found, key=lambda pair: -len(pair[1])))


def _ends_with(words: Sequence[str], phrase: Sequence[str]) -> bool:
    """Whether words end with a phrase, each as it is or inflected."""
    last = words[-len(phrase) :]
    return len(last) == len(phrase) and all(one in stems(word) for word, one in zip(last, phrase, strict=True))
