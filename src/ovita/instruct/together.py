"""What the frames of one utterance say together: shifts that are one, "there" and "the rest", repeats, contradictions.

What of an object is meant the words before it say, for the frames of both readers: "end on the box" is on its top,
"touch the box" at its surface. These words stand in `aiming/aims.txt`.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from functools import cache
from itertools import pairwise
from typing import Any, Literal, TypeAlias

from ovita.instruct import frames as F
from ovita.instruct.chunks import UNIT_KIND, Chunk
from ovita.instruct.edits import Also
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


def as_said(frames: Sequence[F.SemanticFrame], said: Sequence[Chunk]) -> tuple[F.SemanticFrame, ...]:
    """Frames with what the network does not see.

    That is a height below zero, a wait under a thing and not above it, and whose distance is multiplied.
    """
    kinds = {chunk.kind for chunk in said}
    below = {then.q.value for sign, then in pairwise(said) if sign.kind == "minus" and then.q}
    if "under" in kinds and kinds.isdisjoint(("up", "over", "raise", "rising")):
        frames = [_underneath(frame) for frame in frames]
    if not kinds.isdisjoint(("multiply", "waypoints")):
        frames = [_multiplied(frame) for frame in frames]
    return tuple(_below_zero(frame, below) for frame in frames)


def _underneath(frame: F.SemanticFrame) -> F.SemanticFrame:
    """To hover under a thing is to wait where the path passes it."""
    if not isinstance(frame, F.Hover) or len(frame.objects) != 1:
        return frame
    return F.Wait(place=frame.objects[0], duration=frame.duration, words=frame.words)


def _multiplied(frame: F.SemanticFrame) -> F.SemanticFrame:
    """A distance that is multiplied, or the waypoints', is every waypoint's; else "twice as far" is the path's."""
    if not isinstance(frame, F.Approach) or frame.by is None or frame.by.unit != "x":
        return frame
    return replace(frame, by=replace(frame.by, role="to"))


def _below_zero(frame: F.SemanticFrame, below: Container[float]) -> F.SemanticFrame:
    """A height with the sign that stands before it: "don't go lower than z = -0.2"."""
    level = getattr(frame, "level", None)
    if level is None or level.value not in below:
        return frame
    return replace(frame, level=replace(level, value=-level.value, said=""))  # type: ignore[call-arg]


def halted(frames: Sequence[F.SemanticFrame], said: Sequence[Chunk]) -> tuple[F.SemanticFrame, ...]:
    """Frames with a stop short of an object as a wait there, where it lasts or the path goes on after it.

    "Stop 20 cm before the cup and wait 5 seconds", "stop 20 cm before the cup, then continue".
    """
    made: list[F.SemanticFrame] = []
    on = any(chunk.kind == "then_on" for chunk in said)
    for frame in frames:
        if isinstance(frame, F.StopAt) and frame.by and on and len(frames) == 1:
            return (F.Wait(place=frame.place, by=frame.by, words=frame.words),)
        last = made[-1] if made else None
        if isinstance(frame, F.Wait) and frame.duration and isinstance(last, F.StopAt) and last.by:
            if frame.place in ("", "goal", last.place):
                made[-1] = replace(frame, place=last.place, by=last.by, words=(*last.words, *frame.words))
                continue
        made.append(frame)
    return tuple(made)


def at_each(reading: F.Reading, said: Sequence[Chunk]) -> F.Reading:
    """A reading whose waits are at all of several things: "wait 2 seconds at each room", "at the cup and the box"."""
    made: list[F.SemanticFrame] = []
    for frame in reading.frames:
        made += _at_each_of(frame, _listed_with(frame, reading, said)) if isinstance(frame, F.Wait) else [frame]
    if len(made) == len(reading.frames):
        return reading
    places = {frame.place for frame in made if isinstance(frame, F.Wait)}
    read = {chunk.text for chunk in said if chunk.kind == "OBJ" and places.issuperset(chunk.names)}
    return replace(reading, frames=tuple(made), unread=tuple(word for word in reading.unread if word not in read))


def _at_each_of(wait: F.Wait, names: Sequence[str]) -> list[F.Wait]:
    """A wait at each of some things; of none, the wait as it is."""
    return [replace(wait, place=name) for name in names] or [wait]


def _listed_with(wait: F.Wait, reading: F.Reading, said: Sequence[Chunk]) -> tuple[str, ...]:
    """The objects of the list in which a wait's place is named; none of which another frame is about."""
    elsewhere = {name for frame in reading.frames if frame is not wait for name in frame.named}
    names = next((names for names in _listed(said) if wait.place in names), ())
    return names if elsewhere.isdisjoint(names) else ()


def _listed(said: Sequence[Chunk]) -> list[tuple[str, ...]]:
    """The objects that are named in one list, each list's names."""
    lists: list[tuple[str, ...]] = [()]
    row = [chunk for chunk in said if chunk.kind != "filler"]
    for before, chunk in pairwise([None, *row]):
        if chunk is None or chunk.kind not in ("OBJ", "and", "comma"):
            lists.append(())
        elif chunk.kind == "OBJ":
            lists[-1] = (*lists[-1], *chunk.names) if before and before.kind in ("and", "comma") else chunk.names
    return lists


def prolonged(reading: F.Reading, said: Sequence[Chunk]) -> F.Reading:
    """A reading whose one wait is to last longer than the path stands there already: "wait 2 seconds longer"."""
    also = [edit.frame for edit in reading.edits if isinstance(edit, Also)]
    waits = [frame for frame in (*reading.frames, *also) if isinstance(frame, F.Wait) or _hovers_at(frame)]
    words = _for_longer(said) if len(waits) == 1 else []
    if not words:
        return reading
    unread = tuple(word for word in reading.unread if word not in words)
    return replace(_with_frames(reading, {wait: _longer(wait) for wait in waits}), unread=unread)


def _with_frames(reading: F.Reading, changed: Mapping[F.SemanticFrame, F.SemanticFrame]) -> F.Reading:
    """A reading with other frames for some of it, also for those that feedback adds."""
    frames = tuple(changed.get(frame, frame) for frame in reading.frames)
    edits = tuple(replace(e, frame=changed.get(e.frame, e.frame)) if isinstance(e, Also) else e for e in reading.edits)
    return replace(reading, frames=frames, edits=edits)


def _hovers_at(frame: F.SemanticFrame) -> bool:
    """Whether a frame hovers at one object, so high as it does already."""
    return isinstance(frame, F.Hover) and len(frame.objects) == 1 and frame.by is None


def _longer(frame: F.SemanticFrame) -> F.SemanticFrame:
    """A wait, or a stay above an object, as a wait that is to last longer than it does."""
    if isinstance(frame, F.Hover):
        return F.Wait(place=frame.objects[0], duration=frame.duration, longer=True, words=frame.words)
    return replace(frame, longer=True)  # type: ignore[call-arg]


def _for_longer(said: Sequence[Chunk]) -> list[str]:
    """The words beside a wait or its duration that ask for more of it: "longer", "another", "more"."""
    waiting = _where(said, "wait", "hover", "Qs", "Qstep", "keep")
    denied = {i + 1 for i in _where(said, "never", "max", "at_least", "at_most")}
    found = [i for i, chunk in enumerate(said) if chunk.text.lower() in LONGER and i not in denied]
    found += [
        i for i, chunk in enumerate(said) if chunk.text.lower().split()[-1] in MORE and {i - 1, i + 1} & {*waiting}
    ]
    return [said[i].text for i in found]


def _where(said: Sequence[Chunk], *kinds: str) -> list[int]:
    """The numbers of the chunks of some classes."""
    return [i for i, chunk in enumerate(said) if chunk.kind in kinds]


LONGER, MORE = frozenset(("longer", "another", "an extra", "an additional")), frozenset(("more", "extra", "additional"))
"""Words for more time than there is, anywhere in an utterance about one wait, and beside its duration."""


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


def spread(frames: Sequence[F.SemanticFrame], said: Sequence[Chunk]) -> tuple[F.SemanticFrame, ...]:
    """Frames in which "between 20 and 60 cm" is two bounds, and not what lies in the middle.

    Args:
        frames: As read; a height, a distance or a speed that is the mean of the two becomes a pair.
        said: The utterance in chunks.
    """
    found = tuple(frames)
    for word, one, link, other in zip(said, said[1:], said[2:], said[3:], strict=False):
        match word.kind, one.q, link.kind, other.q:
            case "between", F.Quantity(value=first, unit=unit), "and" | "to", F.Quantity(value=high):
                low = first if unit else first * (unit_of(other, other.kind) or 1.0)
                found = tuple(two for frame in found for two in _pair(frame, *sorted((low, high))))
    return found


def _pair(frame: F.SemanticFrame, low: float, high: float) -> tuple[F.SemanticFrame, ...]:
    """A frame about the middle of two values as the two bounds; any other as it is."""
    slot = {F.Height: "level", F.Clearance: "distance", F.Pace: "amount"}.get(type(frame), "")
    q = frame.quantities.get(slot)
    if q is None or abs(q.value - (low + high) / 2.0) > 0.02 * high or not high > low > 0.0:
        return (frame,)
    least, most = replace(q, value=low, role="at_least", said=""), replace(q, value=high, role="at_most", said="")
    if isinstance(frame, F.Pace):
        return replace(frame, change="floor", amount=least), replace(frame, change="cap", amount=most)
    if isinstance(frame, F.Clearance):
        return replace(frame, distance=least, along=False), replace(frame, distance=most, along=True)
    return replace(frame, level=least), replace(frame, level=most)  # type: ignore[call-arg]


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
        bare = _bare(frame, numbers)
        return _refilled(frame, {slot: measured(q, kind) for slot, q in bare.items()}) if bare else frame

    numbers = {chunk.number.value for chunk in said if chunk.kind == "Qn"}
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
