"""When frames mean the same: each in the one form that all of the same meaning share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

from ovita.instruct.frames import (
    OPPOSITES,
    Axis,
    Clearance,
    Direction,
    Figure,
    Mirror,
    Pace,
    Quantity,
    Resize,
    SemanticFrame,
    Side,
    StopAt,
    Trim,
    Wait,
    unaimed,
)
from ovita.paths.part import PathPart


def same(one: Sequence[SemanticFrame], other: Sequence[SemanticFrame]) -> bool:
    """Whether two lists of frames mean the same, in any order and however they are joined.

    "farther cup+box" is "farther cup; farther box", "move left up" is "move left; move up", "keep ends" is both ends.
    """
    left, right = ({repr(canonical(f)) for frame in frames for f in _split(frame)} for frames in (one, other))
    return left == right


def _split(frame: SemanticFrame) -> list[SemanticFrame]:
    """A frame as one frame for each direction, object and end."""
    value: Any = frame
    split: list[Any] = [frame]
    if len(getattr(value, "offset", ())) > 1:
        split = [replace(value, offset=(pair,)) for pair in value.offset]
    if len(getattr(value, "objects", ())) > 1 and getattr(value, "relation", "at") == "at":
        split = [replace(value, objects=(name,)) for name in value.objects]
    for slot in ("end", "what"):
        if getattr(value, slot, "") == "ends":
            split = [replace(f, **{slot: end}) for f in split for end in ("start", "goal")]
    return split


def canonical(frame: SemanticFrame) -> SemanticFrame:
    """A frame in the one form that frames of the same meaning share, so that two readings can be compared.

    Factors on the speed become "set"; circles and stops at the goal lose what they imply; halfway is the middle;
    numbers are rounded to six digits; what of an object is aimed at, which the words alone decide, is left out.
    """
    frame = _plain(replace(unaimed(frame), part=canonical_part(frame.part)))
    changed: dict[str, Any] = {}
    for slot in fields(frame):
        value: Any = getattr(frame, slot.name)
        if isinstance(value, Quantity):
            changed[slot.name] = _rounded(value, slot.metadata.get("units", ("",))[0])
        elif slot.name == "offset":
            changed["offset"] = tuple(_forward(direction, quantity) for direction, quantity in value)
    return replace(frame, words=(), degree=None if frame.quantities else frame.degree, **changed)


def _plain(frame: SemanticFrame) -> SemanticFrame:
    """A frame without what it implies."""
    match frame:
        case Pace(factor=float() as factor):
            return replace(frame, change="set", amount=Quantity(factor, "x", "to"))
        case Pace(change="faster" | "slower" | "constant", amount=Quantity(role="to")):
            return replace(frame, change="set")
        case Resize(by=Quantity(unit="x" | "%") as by):
            return replace(frame, change="", by=Quantity(_size_factor(by, frame.change), "x"))
        case Trim(cut="after", place=str() as place) | StopAt(place="" as place):
            return StopAt(place=place or "goal", part=frame.part)
        case Figure(shape="circle", turns=Quantity(value=1)):
            return replace(frame, turns=None)
        case Clearance() | Side():
            return replace(frame, along=False)
        case Wait(place=Quantity(value=0.5, unit="%")) | StopAt(place=Quantity(value=0.5, unit="%")):
            return replace(frame, place="middle")
        case Mirror(axis="x" | "y" | "z" as axis):
            return replace(frame, axis=_AXES[axis])
    return frame


_AXES: dict[str, Axis] = {"x": "front", "y": "left", "z": "up"}


def _size_factor(by: Quantity, change: str) -> float:
    """How many times as large "20 % larger", "half the size" and "3 times smaller" make the path."""
    grown = {"": by.value, "smaller": 1 - by.value}.get(change, 1 + by.value)
    factor = grown if by.unit == "%" else by.value
    return 1 / factor if change == "smaller" and factor > 1 else factor


def canonical_part(part: PathPart) -> PathPart:
    """A part of the path in the one form that equal parts share."""
    match part:
        case PathPart(kind="range", until=None, unit="share", amount=begin) if begin is not None:
            part = PathPart("last", amount=1 - begin, unit="share")
        case PathPart(kind="range", amount=None | 0, until=until, unit=unit) if until is not None:
            part = PathPart("first", amount=until + (unit == "waypoints"), unit=unit)
        case PathPart(kind="between"):
            part = replace(part, places=tuple(sorted(part.places, key=str)))
        case PathPart(kind="near", places=("start" | "goal" as end,), amount=None):
            part = PathPart("first" if end == "start" else "last")
    parts = tuple(sorted(map(canonical_part, part.parts), key=repr))
    unit = "waypoints" if part.amount is None and part.until is None else part.unit
    return replace(part, parts=parts, amount=_six(part.amount), until=_six(part.until), unit=unit, of="")


THIRDS = {0.33: 1 / 3, 0.67: 2 / 3, 0.66: 2 / 3}
"""What people write for a third."""


def _six(value: float | None) -> float | None:
    if value is None:
        return None
    six = float(f"{value:.6g}")
    return THIRDS.get(round(value, 2), six) if value < 1 else six


def _rounded(quantity: Quantity, usual: str) -> Quantity:
    return Quantity(_six(quantity.value) or 0.0, quantity.unit or usual, quantity.role)


_RISING: dict[str, Direction] = {"z": "up", "-z": "down"}


def _forward(direction: Direction, quantity: Quantity | None) -> tuple[Direction, Quantity | None]:
    """A direction with its distance, without a sign: -5 cm along y is 5 cm along -y."""
    direction = _RISING.get(direction, direction)
    if quantity is None:
        return direction, None
    towards = OPPOSITES[direction] if quantity.value < 0 else direction
    return towards, _rounded(Quantity(abs(quantity.value), quantity.unit), "m")
