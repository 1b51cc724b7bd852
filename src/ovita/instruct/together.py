"""What the frames of one utterance say together: shifts that are one, "there" and "the rest", repeats, contradictions.

What of an object is meant the words before it say, for the frames of both readers: "end on the box" is on its top,
"touch the box" at its surface. These words stand in `aiming/aims.txt`.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from functools import cache
from typing import TypeAlias

from ovita.instruct import frames as F
from ovita.instruct.chunks import UNIT_KIND, Chunk
from ovita.instruct.fillers import CLEAR, REST, THERE
from ovita.instruct.lexicon import DETERMINERS, bare_unit, concepts, stems, unit_at
from ovita.paths.part import WHOLE, PathPart, outside


def added(made: list[F.SemanticFrame], frame: F.SemanticFrame) -> list[F.SemanticFrame]:
    """The frames with one more; two shifts of a part are one, and a distance to what is passed over is how far over."""
    joined = _joined(made[-1], frame) if made else None
    return [*made, frame] if joined is None else [*made[:-1], replace(joined, words=made[-1].words + frame.words)]


def _joined(last: F.SemanticFrame, frame: F.SemanticFrame) -> F.SemanticFrame | None:
    """Two frames as one, or None where they are two."""
    over = isinstance(last, F.Hop | F.Hover) or (isinstance(last, F.Visit) and last.relation in ("over", "under"))
    if over and last.named == frame.named and not last.quantities.get("by"):
        by = frame.by if isinstance(frame, F.Approach) else frame.distance if isinstance(frame, F.Clearance) else None
        return None if by is None else replace(last, by=replace(by, role="by"))  # type: ignore[call-arg]
    if not isinstance(last, F.Shift | F.MoveEnd) or not isinstance(frame, F.Shift | F.MoveEnd):
        return None
    if not last.offset or last != replace(frame, offset=last.offset):
        return None
    ways = dict(frame.offset)
    taken = {way: q for way, q in last.offset if q is not None or way not in ways}
    return None if taken.keys() & ways.keys() else replace(last, offset=(*taken.items(), *frame.offset))


def of_the_end(last: F.SemanticFrame, frame: F.SemanticFrame) -> F.SemanticFrame:
    """A shift of what was shifted just before: "raise the start by 4 cm and shift it left"."""
    if isinstance(last, F.MoveEnd) and isinstance(frame, F.Shift) and last.offset and not (last.relation or frame.part):
        return F.MoveEnd(end=last.end, offset=frame.offset, degree=frame.degree, words=frame.words)
    return frame


THEN = frozenset("then after afterwards thereafter that afterward next onwards".split())
"""Words of a clause that goes on from where the one before it waits."""


def afterwards(last: F.SemanticFrame, frame: F.SemanticFrame) -> F.SemanticFrame:
    """After a wait at an object, what comes then begins there."""
    if not isinstance(frame, F.Pace | F.Shift):
        return frame
    if last.part.kind == "before":
        return replace(frame, part=replace(last.part, kind="after"))  # "faster until the cup, then slower"
    at = last.place if isinstance(last, F.Wait) else last.objects[0] if isinstance(last, F.Hover) else ""
    return replace(frame, part=PathPart("after", (at,))) if isinstance(at, str) and at not in ("", *F.SPOTS) else frame


def shared(made: Sequence[F.SemanticFrame], frame: F.SemanticFrame) -> F.SemanticFrame:
    """A frame with the part that opened the sentence: "points 5 to 15 higher and slower"."""
    last = made[-1] if made else None
    if last is None or frame.part or not last.part or not isinstance(frame, (F.Pace, F.Shift)):
        return frame
    return replace(frame, part=last.part)


def placed(made: Sequence[F.SemanticFrame], frame: F.SemanticFrame) -> F.SemanticFrame:
    """A frame whose "there" and "the rest" are what the sentence had said."""
    if frame.part == THERE:
        return replace(frame, part=_there(made))
    if frame.part == REST:
        return replace(frame, part=_rest(made, paced=isinstance(frame, F.Pace)))
    if frame.part.kind == "both":
        inner = tuple(p for p in frame.part.parts if p not in (THERE, REST))
        return replace(frame, part=inner[0] if len(inner) == 1 else replace(frame.part, parts=inner))
    return frame


def _there(made: Sequence[F.SemanticFrame]) -> PathPart:
    for frame in reversed(made):
        if isinstance(frame, F.MoveEnd):
            return PathPart("first" if frame.end == "start" else "last")
        if frame.part:
            return frame.part
        place = getattr(frame, "place", "")
        if place in ("start", "goal"):
            return PathPart("first" if place == "start" else "last", unit="share")
        if isinstance(frame, F.Visit) and frame.relation == "between":
            return PathPart("between", frame.objects[:2])
        if frame.named:
            return PathPart("near", (frame.named[0],))
    return WHOLE


def _rest(made: Sequence[F.SemanticFrame], paced: bool) -> PathPart:
    """What is left over of the path; of one whose start keeps its speed, what comes after its first part."""
    for frame in reversed(made):
        if isinstance(frame, F.Keep) and frame.what in ("start", "goal") and paced:
            return outside(PathPart("first" if frame.what == "start" else "last"))
        if isinstance(frame, F.Keep) and frame.what in ("start", "goal", "ends"):
            return WHOLE
        if frame.part:
            return outside(frame.part)
    return WHOLE


def settled(made: Sequence[F.SemanticFrame]) -> list[F.SemanticFrame]:
    """Without frames that another one says in full; a speed that alone is to stay is to be constant."""
    if len(made) == 1 and isinstance(made[0], F.Keep) and made[0].what == "speed":
        return [F.Pace(change="constant", part=made[0].part, words=made[0].words)]  # to ask for nothing else
    if len(made) == 1 and isinstance(made[0], F.Clearance) and made[0].distance == CLEAR:
        return [F.Approach(sense="farther", objects=made[0].objects, words=made[0].words)]
    once = list(dict.fromkeys(made))
    return [f for f in once if not any(f is not other and _covers(other, f) for other in once)]


def _covers(full: F.SemanticFrame, bare: F.SemanticFrame) -> bool:
    """Whether a frame says all that another says, and more: "smooth it, a bit smoother near the end"."""
    if type(full) is not type(bare) or (full.part != bare.part and not isinstance(bare, F.Smooth | F.Figure)):
        return False
    slots = [(getattr(bare, s.name), getattr(full, s.name), s.default) for s in fields(bare) if s.compare]
    return full != bare and all(one in (other, default) for one, other, default in slots)


def spread(frames: Sequence[F.SemanticFrame], said: Sequence[Chunk]) -> tuple[F.SemanticFrame, ...]:
    """Frames in which "between 20 and 60 cm" is two bounds, and not what lies in the middle.

    Args:
        frames: As read; a height, a distance or a speed that is the mean of the two becomes a pair.
        said: The utterance in chunks.
    """
    found = tuple(frames)
    for word, one, link, other in zip(said, said[1:], said[2:], said[3:], strict=False):
        if word.kind == "between" and link.kind in ("and", "to") and one.q is not None and other.q is not None:
            scales = (1.0,) if one.q.unit else (1.0, 0.01, 0.001)
            pairs = [sorted((one.q.value * scale, other.q.value)) for scale in scales]
            read = (tuple(two for frame in found for two in _pair(frame, *pair)) for pair in pairs)
            found = next((frames for frames in read if frames != found), found)
    return found


def _pair(frame: F.SemanticFrame, low: float, high: float) -> tuple[F.SemanticFrame, ...]:
    """A frame about the middle of two values as the two bounds; any other as it is."""
    slot = {F.Height: "level", F.Clearance: "distance", F.Pace: "amount"}.get(type(frame), "")
    q = getattr(frame, slot) if slot else None
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
    paced = isinstance(frame, F.Pace) and frame.change in ("set", "cap", "floor")
    dimension = "m/s" if paced else "m" if isinstance(frame, MEASURED) else None
    stated = {slot: q for slot, q in frame.quantities.items() if q.role != "of" and slot not in UNMEASURED}
    return {
        slot: q for slot, q in stated.items() if dimension and q.unit in ("", dimension) and abs(q.value) in numbers
    }


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
    return next((factor for unit, factor, used in found if UNIT_KIND.get(unit) == kind and used), None)


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
ALONG = {"up": ("z", 1), "down": ("z", -1), "left": ("y", 1), "right": ("y", -1), "front": ("x", 1), "back": ("x", -1)}


def _claims(frame: F.SemanticFrame) -> list[tuple[object, float, float]]:
    """What a frame is about, with the least and the greatest value that it leaves."""
    match frame:
        case F.Shift(offset=offset):
            signs = [ALONG[direction] for direction, _ in offset if direction in ALONG]
            return [((axis, frame.part), *_sign(sign)) for axis, sign in signs]
        case F.Pace(change="faster" | "slower" as change, amount=None):
            return [(("pace", frame.part), *_sign(1 if change == "faster" else -1))]
        case F.Pace(change="cap" | "floor", amount=F.Quantity() as q):
            return [(("speed", frame.part), *_limits(q))]
        case F.Approach(sense=sense, objects=objects):
            return [(("near", name), *_sign(1 if sense == "closer" else -1)) for name in objects]
        case F.Clearance(objects=objects, distance=q):
            return [(("clearance", name), *_limits(q)) for name in objects]
        case F.Height(level=q, of=of):
            return [(("height", of, frame.part), *_limits(q))]
    return []


def _sign(sign: int) -> tuple[float, float]:
    return (1.0, INFINITE) if sign > 0 else (-INFINITE, -1.0)


def _limits(q: F.Quantity) -> tuple[float, float]:
    return (-INFINITE if q.role == "at_most" else q.value), (INFINITE if q.role == "at_least" else q.value)


_LINKS = frozenset({"and", ",", "or", "both"})

_ON: dict[str, F.Aim] = {"on": "top", "resting": "top", "touching": "surface"}
MEANT: Mapping[type[F.SemanticFrame], Mapping[str, F.Aim]] = {
    F.MoveEnd: _ON | {"above": "above", "below": "below", "behind": "behind", "beside": "beside", "by": "beside"},
    F.Extend: _ON,
    F.Visit: {"resting": "top", "touching": "surface", "beside": "beside", "by": "beside"},
    F.StopAt: {"resting": "top"},
    F.Wait: {"resting": "top"},
}
"""What words before an object say of it in each kind of frame; "wait on the table" may be said of a place beside it."""

Word: TypeAlias = tuple[str, F.Span]
"""A word in small letters, and where it stands."""

Named: TypeAlias = tuple[tuple[str, ...], F.Span]
"""Objects, and where they are named in the utterance."""


def aimed(
    frames: Sequence[F.SemanticFrame], words: Sequence[Word], named: Sequence[Named]
) -> tuple[F.SemanticFrame, ...]:
    """Frames with what of an object is meant, where the words before it say so.

    Args:
        frames: As read, by whatever reader.
        words: The utterance that they were read from, word for word.
        named: Every place where it names objects.
    """
    said = [(names, span, concept) for names, span, concept in _said(words, named) if concept]
    if _ending([word for word, _ in words]):
        frames = [_apart(frame, said) for frame in frames]
    return tuple(_aimed(frame, said) for frame in frames) if said else tuple(frames)


def _ending(words: Sequence[str]) -> bool:
    """Whether an utterance tells where to end or begin, and not where to move an end that is named."""
    verbs = {word for phrase in concepts(folder="aiming")["ending"] for word in phrase.split()}
    told = any(word in verbs and before not in DETERMINERS for before, word in zip(("", *words), words, strict=False))
    return told and not {*words} & {word for phrase in concepts(folder="aiming")["amount"] for word in phrase.split()}


def _apart(frame: F.SemanticFrame, said: Sequence[tuple[tuple[str, ...], F.Span, str]]) -> F.SemanticFrame:
    """An end so far from an object, where a reader took the distance for how far the end moves."""
    if not isinstance(frame, F.MoveEnd) or frame.relation not in ("away", "toward") or frame.by is None:
        return frame
    if any(concept == "from" and frame.place in names for names, _, concept in said):
        return replace(frame, relation="to", aim="beside")
    return frame


def _aimed(frame: F.SemanticFrame, said: Sequence[tuple[tuple[str, ...], F.Span, str]]) -> F.SemanticFrame:
    if not isinstance(frame, F.AIMED) or frame.aim or not _free(frame):
        return frame
    own = {frame.place} if not isinstance(frame, F.Visit) else {*frame.objects}
    meant = MEANT[type(frame)]
    for names, span, concept in said:
        within = not frame.words or any(a < span[1] and span[0] < b for a, b in frame.words)
        if concept in meant and within and own & {*names}:
            return _so_far(replace(frame, aim=meant[concept]))
    return frame


def _so_far(frame: F.SemanticFrame) -> F.SemanticFrame:
    """An end so far above or below an object, as that far up or down from it."""
    if not isinstance(frame, F.MoveEnd) or frame.aim not in ("above", "below") or frame.by is None:
        return frame
    return replace(frame, offset=(("up" if frame.aim == "above" else "down", frame.by),), by=None, aim="")


def _free(frame: F.SemanticFrame) -> bool:
    """Whether a frame goes to an object as such, not beside it, toward it, over it or between two."""
    match frame:
        case F.MoveEnd(relation=relation, offset=offset, place=place):
            return relation == "to" and not offset and isinstance(place, str)
        case F.Visit(relation=relation):
            return relation == "at"
        case F.StopAt(place=place) | F.Wait(place=place) | F.Extend(place=place):
            return isinstance(place, str) and place not in ("", *F.SPOTS)
    return False


def _said(words: Sequence[Word], named: Sequence[Named]) -> Iterator[tuple[tuple[str, ...], F.Span, str]]:
    """Each naming of objects with the concept of the words right before it, or before those named along with it."""
    spans = [span for _, span in named]
    for names, span in named:
        before = [word for word in words if word[1][1] <= span[0]]
        yield names, span, _before(before, spans)


def _before(words: Sequence[Word], spans: Sequence[F.Span]) -> str:
    """The concept of the phrase that words end with; determiners, and other objects named before, are passed over."""
    rest = list(words)
    listed = False
    while rest:
        bare = [word for word, _ in rest]
        while bare and bare[-1] in DETERMINERS:
            bare.pop()
        concept = next((c for c, phrase in _phrases() if _ends_with(bare, phrase)), "")
        if concept:
            return concept if not listed or concept == "touching" else ""
        word, at = rest.pop()
        inside = any(a <= at[0] < b for a, b in spans)
        listed = listed or inside
        if not (inside or word in DETERMINERS or word in _LINKS):
            return ""
    return ""


@cache
def _phrases() -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Every phrase with its concept, longest first."""
    found = [(concept, tuple(phrase.split())) for concept, said in concepts(folder="aiming").items() for phrase in said]
    return tuple(sorted(found, key=lambda pair: -len(pair[1])))


def _ends_with(words: Sequence[str], phrase: Sequence[str]) -> bool:
    """Whether words end with a phrase, each as it is or inflected."""
    last = words[len(words) - len(phrase) :] if len(words) >= len(phrase) else ()
    return bool(last) and all(one in stems(word) for word, one in zip(last, phrase, strict=True))
