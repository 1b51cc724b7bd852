"""What the frames of one utterance say together: shifts that are one, "there" and "the rest", repeats, contradictions.

What of an object is meant the words before it say, for the frames of both readers: "end on the box" is on its top,
"touch the box" at its surface. These words stand in `aiming/aims.txt`.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from functools import cache
from typing import Any, Literal, TypeAlias

from ovita.instruct import frames as F
from ovita.instruct.chunks import UNIT_KIND, Chunk
from ovita.instruct.fillers import CLEAR, REST, THERE
from ovita.instruct.lexicon import DETERMINERS, concepts, stems
from ovita.instruct.numerals import bare_unit, unit_at
from ovita.paths.part import WHOLE, PathPart, outside


def added(made: list[F.SemanticFrame], frame: F.SemanticFrame) -> list[F.SemanticFrame]:
    """The frames with one more; two shifts of a part are one, and a distance to what is passed over is how far over."""
    joined = _joined(made[-1], frame) if made else None
    return [*made, frame] if joined is None else [*made[:-1], replace(joined, words=made[-1].words + frame.words)]


def _joined(last: F.SemanticFrame, frame: F.SemanticFrame) -> F.SemanticFrame | None:
    """Two frames as one, or None where they are two."""
    match last, frame:
        case (
            (F.Hop() | F.Hover() | F.Visit(relation="over" | "under")) as over,
            F.Approach(by=F.Quantity() as by) | F.Clearance(distance=by),
        ):
            if over.named == frame.named and not over.quantities.get("by"):
                return replace(over, by=replace(by, role="by")) if by != CLEAR else over
        case (F.Shift() | F.MoveEnd()) as first, (F.Shift() | F.MoveEnd()) as second:
            open_ = {way for way, q in first.offset if q is None}
            before, then = dict(first.offset), dict(second.offset)
            if before and first == replace(second, offset=first.offset) and before.keys() & then.keys() <= open_:
                return replace(first, offset=tuple((before | then).items()))
    return None


def of_the_end(last: F.SemanticFrame, frame: F.SemanticFrame) -> F.SemanticFrame:
    """A shift of what was shifted just before: "raise the start by 4 cm and shift it left"."""
    if isinstance(last, F.MoveEnd) and isinstance(frame, F.Shift) and last.offset and not (last.relation or frame.part):
        return F.MoveEnd(end=last.end, offset=frame.offset, degree=frame.degree, words=frame.words)
    return frame


THEN = frozenset("then afterwards thereafter afterward next onwards".split())
"""Words of a clause that goes on from where the one before it was."""


def goes_on(words: Container[str]) -> bool:
    """Whether a clause with some words goes on from where the one before it was."""
    return any(word in words for word in THEN) or ("after" in words and "that" in words)


def afterwards(last: F.SemanticFrame, frame: F.SemanticFrame) -> F.SemanticFrame:
    """What comes then: after the object that the path passes or waits at, or the part of the path that is named."""
    if not isinstance(frame, F.Pace | F.Shift):
        return frame
    if last.part.kind == "first":
        return replace(frame, part=outside(last.part))
    passed = isinstance(last, F.Wait | F.Hover | F.Hop | F.Visit | F.Side | F.Figure)
    places = last.part.places if last.part.kind in ("before", "near", "between") else last.named if passed else ()
    at = places[-1] if places else ""
    if isinstance(last, F.Wait) and last.place == "middle":
        return replace(frame, part=PathPart("range", amount=0.5, unit="share"))
    return replace(frame, part=PathPart("after", (at,))) if isinstance(at, str) and at not in ("", *F.SPOTS) else frame


STRETCH_AT: Mapping[str, Literal["first", "last"]] = {"start": "first", "goal": "last"}
"""The part of the path at each of its ends."""


def shared(made: Sequence[F.SemanticFrame], frame: F.SemanticFrame) -> F.SemanticFrame:
    """A frame with the part that opened the sentence: "points 5 to 15 higher and slower"."""
    return frame if frame.part or not isinstance(frame, F.Pace | F.Shift) else replace(frame, part=made[-1].part)


def placed(made: Sequence[F.SemanticFrame], frame: F.SemanticFrame) -> F.SemanticFrame:
    """A frame whose "there" and "the rest" are what the sentence had said."""
    if frame.part == THERE:
        return replace(frame, part=_there(made))
    if frame.part == REST:
        return replace(frame, part=_rest(made, paced=isinstance(frame, F.Pace)))
    if frame.part.kind == "both":
        inner = tuple(p for p in frame.part.parts if p not in (THERE, REST))
        if THERE in frame.part.parts:  # "but not near the cup, there slower"
            inner = tuple(p.parts[0] if p.kind == "outside" else p for p in inner)
        return replace(frame, part=inner[0] if len(inner) == 1 else replace(frame.part, parts=inner))
    return frame


def _there(made: Sequence[F.SemanticFrame]) -> PathPart:
    for frame in reversed(made):
        place = getattr(frame, "place", "")
        if isinstance(frame, F.MoveEnd):
            return PathPart(STRETCH_AT[frame.end])
        if frame.part:
            return frame.part.parts[0] if frame.part.kind == "outside" else frame.part
        if place in STRETCH_AT:
            return PathPart(STRETCH_AT[place], unit="share")
        if isinstance(frame, F.Visit) and frame.relation == "between":
            return PathPart("between", frame.objects[:2])
        if frame.named:
            return PathPart("near", (frame.named[0],))
    return WHOLE


def _rest(made: Sequence[F.SemanticFrame], paced: bool) -> PathPart:
    """What is left over of the path; of one whose start keeps its speed, what comes after its first part."""
    for frame in reversed(made):
        match frame:
            case F.Keep(what="start" | "goal" as end) if paced:
                return outside(PathPart(STRETCH_AT[end]))
            case F.Keep(what="start" | "goal" | "ends"):
                return WHOLE
            case F.Wait(place=str() as place) if place not in ("", *F.SPOTS):
                return PathPart("after", (place,))
        if frame.part:
            return outside(frame.part)
    return WHOLE


def within(frame: F.SemanticFrame, radius: float | None) -> F.SemanticFrame:
    """A frame near an object within the distance that the utterance says counts as near."""
    near = radius is not None and frame.part.kind == "near" and frame.part.amount is None
    return replace(frame, part=replace(frame.part, amount=radius)) if near else frame


def settled(made: Sequence[F.SemanticFrame]) -> list[F.SemanticFrame]:
    """Without frames that another one says in full; a speed that alone is to stay is to be constant."""
    match made:
        case [F.Keep(what="speed") as kept]:
            return [F.Pace(change="constant", part=kept.part, words=kept.words)]  # to ask for nothing else
        case [F.Clearance(distance=distance) as clear] if distance == CLEAR:
            return [F.Approach(sense="farther", objects=clear.objects, words=clear.words)]
    once = contrasted([frame for i, frame in enumerate(made) if frame not in made[:i]])
    return [frame for frame in once if not any(_covers(other, frame) for other in once)]


def contrasted(made: Sequence[F.SemanticFrame]) -> list[F.SemanticFrame]:
    """Faster as a whole beside slower in a part is faster in the rest: "quickly, but gently by the lamp"."""
    made = at_the_ends(made)
    paces = [frame for frame in made if isinstance(frame, F.Pace) and frame.change in ("faster", "slower")]
    match sorted(paces, key=lambda pace: bool(pace.part)):
        case [whole, local] if local.part and not whole.part and whole.change != local.change:
            return [replace(frame, part=outside(local.part)) if frame is whole else frame for frame in made]
        case [first, then] if _speeds_up_again(first, then):
            return [replace(then, part=PathPart("after", first.part.places)) if f is then else f for f in made]
    return made


def _speeds_up_again(first: F.Pace, then: F.Pace) -> bool:
    """Whether it is to be faster again after it was slower near something: "slower over it, then speed up again"."""
    there = first.part.kind == "near" and then == replace(then, change="faster", part=first.part)
    return there and first.change == "slower" and not then.amount


def at_the_ends(made: Sequence[F.SemanticFrame]) -> list[F.SemanticFrame]:
    """A speed that is to rise and to fall rises at the start and falls at the goal: "soft start, soft stop"."""
    if not all(ramp in made for ramp in RAMPS):
        return [*made]
    return [RAMPS_APART[RAMPS.index(frame)] if frame in RAMPS else frame for frame in made]


RAMPS = (F.Pace(change="rampup"), F.Pace(change="rampdown"))
RAMPS_APART = (replace(RAMPS[0], part=PathPart("first")), replace(RAMPS[1], part=PathPart("last")))
"""Where the speed rises and falls if both are asked for of no part."""


def _covers(full: F.SemanticFrame, bare: F.SemanticFrame) -> bool:
    """Whether a frame says all that another says, and more: "smooth it, a bit smoother near the end"."""
    if type(full) is not type(bare) or (
        full.part != bare.part and not isinstance(bare, F.Smooth | F.Figure | F.Straighten)
    ):
        return False
    if isinstance(full, F.Shift) and isinstance(bare, F.Shift):
        return full != bare and all(q is None and way in dict(full.offset) for way, q in bare.offset)
    said: dict[str, Any] = {s.name: getattr(full, s.name) for s in fields(bare) if getattr(bare, s.name) == s.default}
    return full != bare and full == replace(bare, **said)


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
    units = {kind: [(k, f) for k, chunk in enumerate(said) if (f := unit_of(chunk, kind))] for kind in ("Qm", "Qv")}

    def measured(q: F.Quantity, kind: str) -> F.Quantity:
        at = next((k for k, chunk in enumerate(said) if chunk.q and chunk.q.value == abs(q.value)), len(said))
        near = [f for k, f in units[kind] if k < at][-1:] or [f for _, f in units[kind]][:1]
        known = near[0] if near else None
        factor = bare_unit(q.value, known, extent) if kind == "Qm" else known if known and abs(q.value) >= 1.0 else 1.0
        if factor == 1.0 and extent is None:
            return q  # metres, for want of a path that would tell
        return replace(q, value=q.value * factor, unit="m" if kind == "Qm" else "m/s", said="")

    def filled(frame: F.SemanticFrame) -> F.SemanticFrame:
        kind = "Qv" if isinstance(frame, F.Pace) else "Qm"
        if multiplied and isinstance(frame, F.Approach) and frame.by is not None and not frame.by.unit:
            return replace(frame, by=replace(frame.by, unit="x", role="to"))
        bare = _bare(frame, numbers)
        return _refilled(frame, {slot: measured(q, kind) for slot, q in bare.items()}) if bare else frame

    numbers = {chunk.number.value for chunk in said if chunk.kind == "Qn"}
    multiplied = any(chunk.kind == "multiply" for chunk in said)
    return tuple(map(filled, frames))


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


def improper(frames: Sequence[F.SemanticFrame]) -> str:
    """What the frames contradict each other about, or ""."""
    seen: dict[object, tuple[float, float]] = {}
    for key, low, high in (bound for frame in frames for bound in _claims(frame)):
        before = seen.get(key, (-INFINITE, INFINITE))
        seen[key] = max(before[0], low), min(before[1], high)
        if seen[key][0] > seen[key][1]:
            return "That asks for two things that exclude each other."
    return ""


INFINITE = float("inf")
ALONG = {
    "up": ("z", True), "down": ("z", False), "left": ("y", True), "right": ("y", False),
    "front": ("x", True), "back": ("x", False),
}  # fmt: skip
"""The axis of each direction, and whether it points along it."""


def _claims(frame: F.SemanticFrame) -> list[tuple[object, float, float]]:
    """What a frame is about, with the least and the greatest value that it leaves."""
    match frame:
        case F.Shift(offset=offset):
            axes = [ALONG[way] for way, _ in offset if way in ALONG]
            return [((axis, frame.part), *_side(more)) for axis, more in axes]
        case F.Pace(change="faster" | "slower" as change, amount=None):
            return [(("pace", frame.part), *_side(change == "faster"))]
        case F.Pace(change="cap" | "floor", amount=F.Quantity() as q):
            return [(("duration" if q.unit == "s" else "speed", frame.part), *_limits(q))]
        case F.Approach(sense=sense, objects=objects):
            return [(("near", name), *_side(sense == "closer")) for name in objects]
        case F.Clearance(objects=objects, distance=q):
            return [(("clearance", name), *_limits(q)) for name in objects]
        case F.Height(level=q, of=of):
            return [(("height", of, frame.part), *_limits(q))]
    return []


def _side(more: bool) -> tuple[float, float]:
    """The values of a change to more, or to less."""
    return (1.0, INFINITE) if more else (-INFINITE, -1.0)


def _limits(q: F.Quantity) -> tuple[float, float]:
    return (-INFINITE if q.role == "at_most" else q.value), (INFINITE if q.role == "at_least" else q.value)


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
