"""Edits applied to frames: what the frames of earlier turns are after some feedback."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from math import ceil, floor
from typing import Any, TypeAlias

from ovita.errors import InputError
from ovita.instruct import frames as F
from ovita.instruct.degrees import Degree
from ovita.instruct.edits import Again, Also, Command, Drop, Edit, Except, Flip, Replace, Rescale, Restrict, Set
from ovita.instruct.frames import name_of
from ovita.instruct.notation import ROLES, quantity
from ovita.paths.part import PathPart, any_of, both, outside
from ovita.paths.scene import Scene
from ovita.policy import Parameter
from ovita.units import dimension

Frames: TypeAlias = tuple[F.SemanticFrame, ...]
Change: TypeAlias = Callable[[F.SemanticFrame], F.SemanticFrame]

Values: TypeAlias = Mapping[str, F.Quantity]
"""What was realised for the slots that frames leave open, by "NUMBER.SLOT", such as "0.left" or "1.amount"."""

MORE: dict[Degree, float] = {"slight": 1.25, "moderate": 1.5, "large": 2.0}
"""What "a bit more", "more" and "much more" multiply an effect by; "less" divides by the same."""

_PAIRS = (
    ("cw", "ccw"), ("faster", "slower"), ("closer", "farther"), ("rampup", "rampdown"), ("larger", "smaller"),
    ("more", "less"), ("toward", "away"), ("over", "under"), ("at_least", "at_most"),
)  # fmt: skip
OPPOSITE: dict[str, str] = {**F.OPPOSITES, **dict(_PAIRS), **{b: a for a, b in _PAIRS}, "fewer": "more"}
"""Each direction, sense and change with its opposite."""

_FIRST: dict[str, str] = {"circle": "radius", "zigzag": "size", "wave": "size", "shake": "size"}


def _offset(frame: F.SemanticFrame) -> F.Offset:
    """The directions of a frame, none where it has none."""
    offset: F.Offset = getattr(frame, "offset", ())
    return offset


def slots(frame: F.SemanticFrame) -> dict[str, tuple[str, ...]]:
    """The slots of a frame that hold or may hold a quantity, with the units that they take; the main one first."""
    known = {slot.name: slot.metadata["units"] for slot in fields(frame) if slot.metadata}
    first = {_main_of(frame): known["radius"]} if isinstance(frame, F.Figure) else {}
    return {direction: ("m", "step", "") for direction, _ in _offset(frame)} | first | known


def _main_of(figure: F.Figure) -> str:
    """What "bigger" is about: what the figure states, else its radius or swing."""
    stated = [name for name in ("radius", "size") if name in figure.quantities]
    return stated[0] if stated else _FIRST.get(figure.shape, "radius")


def _with(frame: F.SemanticFrame, **changed: Any) -> F.SemanticFrame:
    """A frame with other values in slots that its class has."""
    return replace(frame, **changed)


def put(frame: F.SemanticFrame, slot: str, quantity: F.Quantity) -> F.SemanticFrame:
    """A frame with a quantity in a slot: a field, or a direction of its offset."""
    offset = _offset(frame)
    if slot in dict(offset):
        return _with(frame, offset=tuple((d, quantity if d == slot else q) for d, q in offset))
    return _with(frame, **{slot: quantity})


def quantity_of(parameter: Parameter, value: object = None) -> F.Quantity | None:
    """What a parameter's value is to the slot that it stands for; None if it is no number."""
    number = parameter.value if value is None else value
    if isinstance(number, bool) or not isinstance(number, int | float):
        return None
    if parameter.role == "factor":
        return F.Quantity(float(number), "x", "to")
    if parameter.role == "count" and parameter.slot.endswith(".duration"):
        return F.Quantity(float(number), "step")
    role: F.Role = parameter.role if parameter.role in ROLES else "by"
    return F.Quantity(float(number), dimension(parameter.unit), role)


def realised_values(parameters: Sequence[Parameter]) -> dict[str, F.Quantity]:
    """What was realised for the slots of frames."""
    found = {p.slot: quantity_of(p) for p in parameters if p.slot}
    return {slot: q for slot, q in found.items() if q is not None}


def by_hand(
    frames: Sequence[F.SemanticFrame], parameters: Sequence[Parameter], values: Mapping[str, object]
) -> tuple[F.SemanticFrame, ...]:
    """Frames with the amounts that a person gave to parameters by hand.

    Args:
        frames: As they were realised.
        parameters: With the slots that they stand for.
        values: New values of parameters, by name.
    """
    known = list(frames)
    for parameter in parameters:
        number, _, slot = parameter.slot.partition(".")
        q = quantity_of(parameter, values[parameter.name]) if parameter.name in values and slot else None
        if q is not None and int(number) < len(known):
            known[int(number)] = _by_hand(known[int(number)], slot, q)
    return tuple(known)


def _by_hand(frame: F.SemanticFrame, slot: str, q: F.Quantity) -> F.SemanticFrame:
    if slot == "part" and frame.part.kind in ("near", "first", "last", "middle", "turns"):
        return replace(frame, part=replace(frame.part, amount=q.value))
    if slot not in slots(frame):
        return frame
    old = frame.quantities.get(slot)
    frame = put(frame, slot, replace(q, role=old.role if old and q.unit != "x" else q.role))
    return replace(frame, change="set") if isinstance(frame, F.Pace) and q.unit == "x" else frame


def apply(
    edits: Sequence[Edit], frames: Sequence[F.SemanticFrame], scene: Scene, values: Values | None = None
) -> tuple[F.SemanticFrame, ...]:
    """Frames after some edits; commands change none.

    Args:
        edits: In the order in which they were said.
        frames: The frames before.
        scene: With the objects.
        values: What was realised for slots that the frames leave open, and what a person turned by hand.
    """
    known = tuple(frames)
    for edit in _told_apart(edits, known):
        known = _APPLIED[type(edit)](edit, known, dict(values or {}))
        if isinstance(edit, Restrict):  # what is confined to where the same is asked for already is that
            known = tuple(frame for i, frame in enumerate(known) if frame not in known[:i])
    return known


def directions_of(frame: F.SemanticFrame) -> tuple[str, ...]:
    """The directions that a frame names."""
    offset = _offset(frame)
    direction = getattr(frame, "direction", "")
    over = {"over": ("up",), "under": ("down",)}.get(getattr(frame, "relation", ""), ())
    return (*(d for d, _ in offset), *((direction,) if direction else ()), *over)


def is_called(frame: F.SemanticFrame, name: str) -> bool:
    """Whether a person would call a frame so: by its kind, one of its directions or its objects."""
    kind, _, thing = name.partition(" ")
    both = kind in (name_of(frame), frame.NAME) and thing in frame.named
    return both or name in (name_of(frame), frame.NAME, *directions_of(frame), *frame.named)


def name_among(frames: Sequence[F.SemanticFrame], i: int) -> str:
    """What one of several frames is called, and no other: its kind, a direction or an object of its own, or both."""
    frame, others = frames[i], [f for k, f in enumerate(frames) if k != i]
    both = (f"{name_of(frame)} {thing}" for thing in frame.named)
    names = (name_of(frame), *directions_of(frame), *frame.named, *both)
    return next((name for name in names if not any(is_called(f, name) for f in others)), names[0])


def chosen(frames: Sequence[F.SemanticFrame], on: str, fits: Callable[[F.SemanticFrame], int]) -> int | None:
    """Number of the frame that an edit is about: the last one called so that fits, else that fits best, else called so.

    Args:
        frames: Those before.
        on: What the edit calls it, or "".
        fits: How well a frame fits; 0 if it does not.
    """
    named = [i for i, frame in enumerate(frames) if on and is_called(frame, on)]
    how_well = [fits(frame) for frame in frames]
    both = [i for i in named if how_well[i]]
    best = max(how_well, default=0)
    fitting = [i for i, fit in enumerate(how_well) if fit == best > 0]
    return next(reversed(both or fitting or named), None)


def _fit(edit: Edit, frame: F.SemanticFrame) -> int:
    """How well a frame fits an edit that does not say which one it is about; 0 if it does not."""
    match edit:
        case Set(slot=slot, quantity=q):
            name = slot_for(frame, slot, q.unit)
            held = frame.quantities.get(name)
            return 0 if not name else 1 + (held is not None) + (held is not None and slot in (name, held.role))
        case Rescale():
            return int(bool(slots(frame)) or isinstance(frame, F.Smooth | F.Curve))
        case Flip():
            return int(_flip(frame) != frame)
        case Replace(direction=None, end=""):
            return int(bool(frame.named))
        case Replace(direction=way, end=end):
            return int((_turned(frame, way) if way else _at_end(frame, end)) != frame)
    return 1


ABOUT_ONE = (Set, Rescale, Flip, Replace, Restrict, Except)
"""Edits of one of the frames before."""


def _told_apart(edits: Sequence[Edit], frames: Frames) -> list[Edit]:
    """Several edits, each that names no frame as one of a frame that fits it and that no other edit is about."""
    taken = {i for edit in edits for i, frame in enumerate(frames) if edit.on and is_called(frame, edit.on)}
    found: list[Edit] = []
    for edit in edits:
        open_ = [frame for i, frame in enumerate(frames) if i not in taken]
        if len(edits) > 1 and not edit.on and isinstance(edit, ABOUT_ONE) and taken:
            at = chosen(open_, "", lambda frame, edit=edit: _fit(edit, frame))  # type: ignore[misc]
            if at is not None:
                i = frames.index(open_[at])
                edit = replace(edit, on=name_among(frames, i))
                taken.add(i)
        found.append(edit)
    return found


def _changed(frames: Frames, on: str, fits: Callable[[F.SemanticFrame], int], change: Change) -> Frames:
    """Frames with a change of the one that an edit is about."""
    i = chosen(frames, on, fits)
    return frames if i is None else _put_at(frames, i, change(frames[i]))


def _confined(old: PathPart, part: PathPart) -> PathPart:
    """The part that a change is confined to; on one side of a thing that it is near to, it stays near to it."""
    sided = part.kind in ("before", "after") and old.kind == "near" and part.places == old.places
    return both(old, part) if sided else part


def _parted(frames: Frames, on: str, change: Change) -> Frames:
    """Frames with the part changed of the one that an edit is about, or of that of its directions which it names."""
    i = chosen(frames, on, bool)
    offset = () if i is None else _offset(frames[i])
    if i is None or len(offset) < 2 or on not in dict(offset):
        return _changed(frames, on, bool, change)
    one = _with(frames[i], offset=tuple(pair for pair in offset if pair[0] == on))
    return (*frames[:i], _without(frames[i], on), change(one), *frames[i + 1 :])


def _put_at(frames: Frames, i: int, frame: F.SemanticFrame) -> Frames:
    return (*frames[:i], frame, *frames[i + 1 :])


def realised(frame: F.SemanticFrame, number: int, values: Values) -> F.SemanticFrame:
    """A frame whose open slots hold what was realised for them."""
    for slot in slots(frame):
        if slot not in frame.quantities and (q := values.get(f"{number}.{slot}")) is not None:
            frame = put(frame, slot, q)
            if isinstance(frame, F.Pace) and q.unit in ("x", "%") and q.role != "by":
                frame = replace(frame, change="set")
    return frame


def _rescaled(edit: Rescale, frames: Frames, values: Values) -> Frames:
    i = chosen(frames, edit.on, lambda f: _fit(edit, f))
    if i is None:
        return frames
    if isinstance(bare := frames[i], F.Clearance) and bare.distance.value == 0.0 and factor_of(edit) > 1.0:
        more = F.Approach(sense="farther", objects=bare.objects, part=bare.part, degree="large", words=bare.words)
        return _put_at(frames, i, more)
    frame = realised(frames[i], i, values)
    open_size = isinstance(frame, F.Figure) and not frames[i].quantities and _main_of(frame) not in frame.quantities
    if open_size or not set(slots(frame)) & set(frame.quantities):
        return _put_at(frames, i, _by_degree(frames[i], edit))
    for slot in _rescaled_slots(frame, edit.on):
        frame = _times(frame, slot, factor_of(edit))
    return _put_at(frames, i, frame)


def factor_of(edit: Rescale) -> float:
    """What an edit multiplies an effect by."""
    if edit.factor is not None:
        return edit.factor
    more = MORE[edit.degree or "moderate"]
    return 1 / more if edit.change == "less" else more


def _rescaled_slots(frame: F.SemanticFrame, on: str) -> Sequence[str]:
    """The slots that "more" is about: the direction that is named, all with a distance, or the main amount."""
    directions = [d for d, q in _offset(frame) if q is not None]
    if directions:
        return [on] if on in directions else directions
    main = next(iter(slots(frame)))
    return [main if main in frame.quantities else next(iter(frame.quantities))]


def _by_degree(frame: F.SemanticFrame, edit: Rescale) -> F.SemanticFrame:
    """More or less of what has no amount: one degree further, or two."""
    order: list[Degree | None] = ["slight", None, "large"]
    more = edit.change == "more" or (edit.factor or 0.0) > 1.0
    at = order.index(None if frame.degree == "moderate" else frame.degree) + (1 if more else -1)
    return replace(frame, degree=order[min(max(at, 0), 2)])


def _times(frame: F.SemanticFrame, slot: str, k: float) -> F.SemanticFrame:
    """A frame with k times the effect of a slot: factors move away from 1, counts stay whole."""
    q = frame.quantities[slot]
    if isinstance(frame, F.Pace) and frame.factor is not None and not _stays_a_share(frame, q, k):
        return replace(frame, change="set", amount=F.Quantity(_rounded(further(frame.factor, k)), "x", "to"))
    if q.unit == "x" or (q.unit == "%" and isinstance(frame, F.Resize) and not frame.change):
        return put(frame, slot, _like(q, further(q.value, k)))
    counts = isinstance(frame, F.Resample) or q.unit == "waypoints" or slot in ("turns", "waves")
    return put(frame, slot, _like(q, _whole(q.value * k, up=k > 1) if counts else q.value * k))


def _stays_a_share(pace: F.Pace, q: F.Quantity, k: float) -> bool:
    """Whether k times so much per cent faster or slower is still said so; slower by nearly all of it is a factor."""
    return q.unit == "%" and q.role == "by" and (pace.change == "faster" or q.value * k <= 0.8)


def _whole(value: float, *, up: bool) -> int:
    return max(ceil(value) if up else floor(value), 1)


def further(factor: float, k: float) -> float:
    """A factor with k times its effect; a slowdown never comes to a standstill by it."""
    linear = 1 + (factor - 1) * k
    return max(linear, factor**k if linear < 0.2 else linear)


def _like(q: F.Quantity, value: float) -> F.Quantity:
    """Another value in the unit that the person used."""
    value = _rounded(value)
    unit = unit_of(q)
    return replace(q, value=value, said=f"{value / scale_of(q):.6g}{unit}" if unit or not q.unit else "")


def unit_of(q: F.Quantity) -> str:
    """The unit as the person wrote it, such as "cm"; "" where none was."""
    return q.said.lstrip("~+-0123456789.,/ ")


def scale_of(q: F.Quantity) -> float:
    """What one of the units that the person used is in SI."""
    unit = unit_of(q)
    try:
        one = quantity(f"1{unit}")
    except InputError:
        return 1.0
    return one.value if unit and one.unit == q.unit else 1.0


def _rounded(value: float) -> float:
    """A value as a person would write it."""
    short = float(f"{value:.2g}")
    return short if abs(short - value) <= 0.02 * abs(value) else float(f"{value:.3g}")


def slot_for(frame: F.SemanticFrame, slot: str, unit: str) -> str:
    """The slot of a frame that an edit means: by its name, or for a role the first that takes the unit; or ""."""
    known = slots(frame)
    if slot in known or slot not in ROLES:
        return slot if unit in known.get(slot, ()) else ""
    taking = [name for name, units in known.items() if unit in units]
    return next((name for name in taking if name in frame.quantities), taking[0] if taking else "")


def _as_distance(edit: Set, frames: Frames) -> Frames | None:
    """A length for how far off, where nobody said how much farther: "make it 1.5 m" after "further from the bed"."""
    i = chosen(frames, edit.on, lambda f: isinstance(f, F.Approach))
    frame = None if i is None or edit.step or edit.quantity.unit != "m" else frames[i]
    farther = isinstance(frame, F.Approach) and frame.sense == "farther"
    if i is None or not isinstance(frame, F.Approach) or not farther or frame.by is not None:
        return None
    bound = replace(edit.quantity, role="at_least")
    return _put_at(frames, i, F.Clearance(objects=frame.objects, distance=bound, part=frame.part, words=frame.words))


def _set(edit: Set, frames: Frames, values: Values) -> Frames:
    if (kept := _as_distance(edit, frames)) is not None:
        return kept
    i = chosen(frames, edit.on, lambda f: _fit(edit, f))
    name = "" if i is None else slot_for(frames[i], edit.slot, edit.quantity.unit)
    if i is None or not name:
        return frames
    q, old = edit.quantity, realised(frames[i], i, values).quantities.get(name)
    if old is not None:
        stated = edit.slot in ROLES and edit.slot != "by"
        q = replace(_in_place_of(old, edit), role=q.role if stated else old.role)
    frame = put(_with(frames[i], degree=None), name, replace(q, unit="") if q.unit == "turns" else q)
    return _put_at(frames, i, _as_pace(frame, q, edit.slot) if isinstance(frame, F.Pace) else frame)


def _in_place_of(old: F.Quantity, edit: Set) -> F.Quantity:
    """A new value, or so much more or less than the old one; a bare number is in the unit of that."""
    q = edit.quantity
    if edit.step:
        by = q.value * (1.0 if q.unit else scale_of(old))
        return _like(old, max(old.value + edit.step * by, 0.0))
    if q.unit:
        return q
    said = f"{q.value:g}{unit_of(old)}" if unit_of(old) else ""
    return replace(q, value=q.value * scale_of(old), unit=old.unit, said=said)


def _as_pace(frame: F.Pace, q: F.Quantity, slot: str) -> F.Pace:
    """The change that fits a new amount of a speed."""
    if slot in ("at_least", "at_most"):
        return replace(frame, change="cap" if slot == "at_most" else "floor")
    if frame.change in ("faster", "slower") and q.unit == "m/s" and slot != "by":
        slot = "to"
    if slot == "to" and frame.change not in ("rampup", "rampdown", "constant"):
        return replace(frame, change="set", amount=replace(q, role="to"))
    return frame


def _flip(frame: F.SemanticFrame) -> F.SemanticFrame:
    """A frame the other way round; the same where it has no other way."""
    if offset := _offset(frame):
        return _with(frame, offset=tuple((OPPOSITE[d], q) for d, q in offset))
    match frame:
        case F.Figure(shape="circle" | "spiral", sense=None) | F.Rotate(sense=None):
            return replace(frame, sense="cw")
        case F.Resample(change="more"):
            return replace(frame, change="fewer")
        case F.Pace(change="set", amount=F.Quantity(unit="x" | "%", value=value) as q) if value > 0.0:
            return replace(frame, amount=replace(q, value=_rounded(1.0 / value), unit="x", said=""))
    flipped = [s for s in ("sense", "direction", "change", "relation") if getattr(frame, s, None) in OPPOSITE]
    return _with(frame, **{slot: OPPOSITE[getattr(frame, slot)] for slot in flipped[:1]})


def _replaced(edit: Replace, frames: Frames, values: Values) -> Frames:
    def change(frame: F.SemanticFrame) -> F.SemanticFrame:
        if edit.direction is not None:
            return _turned(frame, edit.direction)
        return _at_end(frame, edit.end) if edit.end else _about(frame, edit.objects)

    return _changed(frames, edit.on, lambda f: _fit(edit, f), change)


def _turned(frame: F.SemanticFrame, direction: F.Direction) -> F.SemanticFrame:
    """A frame in another direction; of several, the one that is opposite to it, or the last."""
    if offset := _offset(frame):
        old = OPPOSITE[direction] if OPPOSITE[direction] in dict(offset) else offset[-1][0]
        return _with(frame, offset=tuple((direction if d == old else d, q) for d, q in offset))
    if isinstance(frame, F.Side | F.Tilt | F.Arrive):
        return replace(frame, direction=direction)
    if isinstance(frame, F.Visit) and direction in ("up", "down"):
        return replace(frame, relation="over" if direction == "up" else "under")
    return frame


def _at_end(frame: F.SemanticFrame, end: str) -> F.SemanticFrame:
    """A frame about the other end of the path."""
    other = "goal" if end == "start" else "start"
    return _with(frame, **{slot: end for slot in ("end", "what", "place") if getattr(frame, slot, "") == other})


def _about(frame: F.SemanticFrame, objects: tuple[str, ...]) -> F.SemanticFrame:
    """A frame about other objects: those that it acts on, else the place, else the part of the path."""
    if getattr(frame, "objects", ()):
        return _with(frame, objects=objects)
    for slot in F.PLACES:
        place = getattr(frame, slot, "")
        if isinstance(place, str) and place not in ("", *F.SPOTS):
            return _with(frame, **{slot: objects[0]})
    return replace(frame, part=_part_about(frame.part, objects))


def _part_about(part: PathPart, objects: tuple[str, ...]) -> PathPart:
    if part.kind == "near" and len(objects) > 1:
        return any_of([replace(part, places=(name,)) for name in objects])
    parts = tuple(_part_about(inner, objects) for inner in part.parts)
    kept = part.places[: max(len(part.places) - len(objects), 0)]  # of two, the last is what is corrected
    return replace(part, parts=parts, places=(*kept, *objects)[: len(part.places)])


def _dropped(edit: Drop, frames: Frames, values: Values) -> Frames:
    if edit.on not in F.OPPOSITES:
        return tuple(f for f in frames if edit.on and not is_called(f, edit.on))
    without = (_without(frame, edit.on) for frame in frames)
    return tuple(f for f in without if getattr(f, "offset", True) or getattr(f, "relation", ""))


def _without(frame: F.SemanticFrame, direction: str) -> F.SemanticFrame:
    offset = _offset(frame)
    return _with(frame, offset=tuple(pair for pair in offset if pair[0] != direction)) if offset else frame


def _outside(frame: F.SemanticFrame, part: PathPart) -> F.SemanticFrame:
    left = [one for one in frame.part.parts if one.places != part.places]
    if frame.part.kind == "either" and 0 < len(left) < len(frame.part.parts):
        return replace(frame, part=any_of(left))
    rest = outside(part)
    return replace(frame, part=both(frame.part, rest) if frame.part else rest)


def _again(edit: Again, frames: Frames, values: Values) -> Frames:
    i = chosen(frames, edit.on, bool)
    return (*frames, *(frames if not edit.on or i is None else (frames[i],)))


def _also(edit: Also, frames: Frames, values: Values) -> Frames:
    """One more frame; how much and how is as in the last one of its kind, where it does not say so itself."""
    kin = next((f for f in reversed(frames) if name_of(f) == name_of(edit.frame)), None)
    return (*frames, edit.frame if kin is None else inherited(edit.frame, kin))


def inherited(frame: F.SemanticFrame, kin: F.SemanticFrame) -> F.SemanticFrame:
    """A frame whose open amount is that of another one of its kind and sense."""
    alike = all(getattr(frame, slot, None) == getattr(kin, slot, None) for slot in ("change", "sense", "relation"))
    if frame.quantities or frame.degree or not alike:
        return frame
    return _with(frame, **{s: q for s, q in kin.quantities.items() if hasattr(frame, s)}, degree=kin.degree)


_APPLIED: dict[type[Edit], Callable[[Any, Frames, Values], Frames]] = {
    Rescale: _rescaled,
    Set: _set,
    Flip: lambda edit, frames, _: _changed(frames, edit.on, lambda f: _fit(edit, f), _flip),
    Replace: _replaced,
    Restrict: lambda edit, frames, _: _parted(frames, edit.on, lambda f: replace(f, part=_confined(f.part, edit.part))),
    Except: lambda edit, frames, _: _parted(frames, edit.on, lambda f: _outside(f, edit.part)),
    Drop: _dropped,
    Again: _again,
    Also: _also,
    Command: lambda _, frames, __: frames,
}
