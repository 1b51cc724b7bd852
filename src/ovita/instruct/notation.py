"""The notation of frames and edits as text: `move left=20cm up; pace slower @near=cup`.

The corpus is written in it (`training/corpus/NOTATION.md`), `ovita read` prints it, and the learned reader is
trained on it. Numbers keep the person's unit; waypoints count from 1.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from dataclasses import fields
from typing import Any, get_args

from ovita.errors import InputError
from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.paths.part import WHOLE, PathPart, both, outside
from ovita.units import find

DIRECTIONS: tuple[F.Direction, ...] = get_args(F.Direction)
ROLES: tuple[F.Role, ...] = get_args(F.Role)
FRAMES: dict[str, type[F.SemanticFrame]] = {
    "move": F.Shift, "end": F.MoveEnd, "closer": F.Approach, "farther": F.Approach, "clearance": F.Clearance,
    "via": F.Visit, "side": F.Side, "pace": F.Pace, "keep": F.Keep, "stop": F.StopAt, "wait": F.Wait,
    "extend": F.Extend, "smooth": F.Smooth, "waypoints": F.Resample, "circle": F.Figure, "spiral": F.Figure,
    "eight": F.Figure, "zigzag": F.Figure, "wave": F.Figure, "shake": F.Figure, "hop": F.Hop, "hover": F.Hover,
    "mirror": F.Mirror, "rotate": F.Rotate, "tilt": F.Tilt, "resize": F.Resize, "curve": F.Curve,
    "straighten": F.Straighten, "height": F.Height, "bound": F.Bound, "reverse": F.Reverse, "return": F.Return,
    "trim": F.Trim, "quadrant": F.Quadrant,
}  # fmt: skip
"""Each name of the notation and the frame that it is."""

EDITS = {
    "scale": E.Rescale, "set": E.Set, "flip": E.Flip, "replace": E.Replace, "restrict": E.Restrict,
    "except": E.Except, "drop": E.Drop, "again": E.Again, "also": E.Also,
    **dict.fromkeys(("undo", "redo", "restart", "accept", "explain"), E.Command),
}  # fmt: skip

_NUMBER = re.compile(r"[~+]?(-?\d*\.?\d+)(?:-(\d*\.?\d+))?([A-Za-z%/°][\w/^°]*|%)?")
_FIELD_OF = {"for": "duration"}
_KEY_OF = {"duration": "for"}
_AIMS: dict[str, F.Aim] = {"on": "top", "touch": "surface"}
"""Keys that say what of an object is meant; for other frames than these, objects have no such key."""


def parse(text: str, objects: Collection[str] = ()) -> tuple[F.SemanticFrame, ...]:
    """The frames that a text in the notation says.

    Args:
        text: Frames separated by ";".
        objects: Names of the scene's objects; spaces in them are written as "_".

    Raises:
        InputError: If a frame, slot or part is not of the notation.
    """
    if text.strip() in ("undo", "restart"):
        return ()
    return tuple(_frame(said.split(), objects) for said in text.split(";") if said.strip())


def parse_edits(text: str, objects: Collection[str] = ()) -> tuple[E.AnyEdit | E.Edit, ...]:
    """The edits that a text in the notation says; frames among them are `Also`.

    Raises:
        InputError: If an edit is not of the notation.
    """
    return tuple(_edit(said.split(), objects) for said in text.split(";") if said.strip())


def show(frames: Collection[F.SemanticFrame | E.Edit]) -> str:
    """Frames or edits in the notation, as `parse` and `parse_edits` read them."""
    return "; ".join(_shown(f) if isinstance(f, F.SemanticFrame) else _edit_shown(f) for f in frames)


def quantity(said: str, role: F.Role = "by") -> F.Quantity:
    """A number with its unit, such as "10cm", "30%", "2x", "12wp", "5-15cm" (its middle), in SI.

    Raises:
        InputError: If it is no number with a known unit.
    """
    match = _NUMBER.fullmatch(said)
    if match is None:
        raise InputError(f"{said!r} is no quantity; write a number with a unit, such as 10cm, 0.2m/s, 30% or 2x")
    value = float(match[1]) if match[2] is None else (float(match[1]) + float(match[2])) / 2
    unit = match[3] or ""
    if unit in ("wp", "turns", "turn", "laps", "waves"):
        return F.Quantity(value, "waypoints" if unit == "wp" else "turns", role, said)
    known = find({"in": "inch", "in/s": "inch/s"}.get(unit, unit)) if unit else None
    if unit and known is None:
        raise InputError(f"{unit!r} in {said!r} is no unit of measure")
    return F.Quantity(value * (known.factor if known else 1.0), known.dimension if known else "", role, said)


def _object(word: str, objects: Collection[str]) -> str:
    spaced = word.replace("_", " ")
    for name in objects:
        if word == name or spaced == name or word == name.replace(" ", "_"):
            return name
    raise InputError(f"{word!r} is neither an object of the scene nor a word of the notation")


def _place(word: str, objects: Collection[str]) -> F.Place:
    if word in F.SPOTS:
        return word
    if "+" in word:
        first, second = word.split("+", 1)
        return _object(first, objects), _object(second, objects)
    try:
        return _object(word, objects)
    except InputError:
        if word[:1].isdigit() and _NUMBER.fullmatch(word):
            return quantity(word, "at")
        raise


def _objects(word: str, objects: Collection[str]) -> tuple[str, ...]:
    return tuple(_object(name, objects) for name in word.split("+"))


_READERS: dict[str, Callable[[str, Collection[str]], Any]] = {
    "objects": _objects,
    **dict.fromkeys(F.PLACES, _place),
    "number": lambda word, _: int(word),
}
"""What reads the word of a slot that holds no quantity."""

_AMOUNTS = ("amount", "distance", "by", "level", "angle")
_MEASURES = (*_AMOUNTS, "duration", "radius", "size", "turns", "waves", "rise")

_KEYS: dict[tuple[type[F.SemanticFrame], str], tuple[dict[str, Any], str]] = {
    **{(kind, key): ({"aim": aim}, "place") for kind in F.AIMED for key, aim in _AIMS.items()},
    **{(F.MoveEnd, key): ({"aim": aim, "relation": "to"}, "place") for key, aim in _AIMS.items()},
    **{(F.Visit, key): ({"aim": aim}, "objects") for key, aim in _AIMS.items()},
    **{(F.MoveEnd, key): ({"relation": key}, "place") for key in ("to", "toward", "away")},
    **{(F.Visit, key): ({"relation": key}, "objects") for key in ("over", "under", "between")},
    **{(F.Trim, key): ({"cut": key}, "amount") for key in ("first", "last")},
    **{(F.Trim, key): ({"cut": key}, "place") for key in ("before", "after")},
    (F.Resample, "merge"): ({"change": "merge"}, "amount"),
    (F.Extend, "to"): ({}, "place"),
    (F.Hop, "over"): ({}, "objects"),
}
"""Keys that a frame has of its own: the slots that they fill by themselves, and the one that their value goes into."""


def _own(words: str, **renamed: str) -> dict[str, str]:
    return {word: word for word in words.split()} | renamed


_MORE = ("change", _own("more fewer less larger smaller"))
_CHOICES: dict[type[F.SemanticFrame], tuple[str, dict[str, str]]] = {
    F.Pace: ("change", _own("faster slower set constant rampup rampdown turns accelerate")),
    F.Resample: _MORE,
    F.Curve: _MORE,
    F.Resize: _MORE,
    F.Keep: ("what", _own("start goal ends speed path height rest", shape="path")),
    F.MoveEnd: ("end", _own("start goal ends")),
    F.Mirror: ("axis", _own("left front up x y z", right="left", back="front", down="up")),
}
"""The slot of a frame that bare words fill, and what each of them says."""

_BARE: dict[str, str] = {"cw": "sense", "ccw": "sense", "along": "along"}
_BARE |= {way: "direction" for way in DIRECTIONS}
"""Bare words of several frames, and their slots."""


def _frame(words: list[str], objects: Collection[str]) -> F.SemanticFrame:
    name, *rest = words
    kind = FRAMES.get(name)
    if kind is None:
        raise InputError(f"{name!r} is no frame; known are {', '.join(FRAMES)}")
    known = {slot.name for slot in fields(kind)}
    slots: dict[str, Any] = {"sense": name} if kind is F.Approach else {"shape": name} if kind is F.Figure else {}
    parts = [_part(word[1:], objects) for word in rest if word.startswith("@")]
    if parts:
        slots["part"] = both(*parts) if len(parts) > 1 else parts[0]
    offset: list[tuple[Any, F.Quantity | None]] = []
    for word in rest:
        key, _, value = word.partition("=")
        if key in DIRECTIONS and "offset" in known and (value or kind is not F.Bound):
            offset.append((key, quantity(value) if value else None))
        elif not word.startswith("@"):
            slots |= _slot(name, kind, word, known, objects)
    if "offset" in known:
        slots["offset"] = tuple(offset)
    try:
        return kind(**_completed(kind, slots))
    except TypeError:
        raise InputError(f"{' '.join(words)!r} lacks something that {name!r} needs") from None


def _slot(
    name: str, kind: type[F.SemanticFrame], word: str, known: Collection[str], objects: Collection[str]
) -> dict[str, Any]:
    """The slots that a word fills."""
    key, _, value = word.partition("=")
    if key == "deg":
        return {"degree": value}
    found = _slots(kind, key, value, known, objects) if value else _flag(kind, word, known, objects)
    if not found:
        raise InputError(f"{word!r} has no place in {name!r}")
    return found


def _completed(kind: type[F.SemanticFrame], slots: dict[str, Any]) -> dict[str, Any]:
    """Slots with what the notation leaves to the rest of the frame."""
    role = slots["amount"].role if "amount" in slots else None
    if kind is F.Pace and role:
        return {"change": {"at_most": "cap", "at_least": "floor"}.get(role, "set")} | slots
    if kind is F.Resample and role:
        return {"change": role} | slots
    return {"what": "part"} | slots if kind is F.Keep else slots


def _slots(
    kind: type[F.SemanticFrame], key: str, value: str, known: Collection[str], objects: Collection[str]
) -> dict[str, Any]:
    """The slots that "key=value" fills; none where the frame has no place for it."""
    fixed, slot = _KEYS.get((kind, key), ({}, ""))
    if not slot and key in ("at", "of", "about"):
        slot = next((s for s in (["place", key] if key != "about" else [key]) if s in known and s in _READERS), "")
    if slot in _READERS:
        return fixed | {slot: _READERS[slot](value, objects)}
    if not slot and key in ROLES:
        target = next((s for s in _AMOUNTS if s in known), "")
        return {target: quantity(value, key)} if target else {}
    slot = slot or _FIELD_OF.get(key, key)
    return fixed | {slot: quantity(value)} if slot in _MEASURES and slot in known else {}


def _flag(kind: type[F.SemanticFrame], word: str, known: Collection[str], objects: Collection[str]) -> dict[str, Any]:
    """The slot that a bare word fills: a choice, a sense, a direction, a number or objects."""
    slot, choices = _CHOICES.get(kind, ("", {}))
    if word in choices:
        return {slot: choices[word]}
    if _BARE.get(word) in known:
        return {_BARE[word]: word == "along" or word}
    if "angle" in known and _NUMBER.fullmatch(word):
        return {"angle": quantity(word)}
    slot = next((s for s in ("number", "objects", "place") if s in known), "")
    return {slot: _READERS[slot](word, objects)} if slot and (slot != "number" or word.isdigit()) else {}


def _part(word: str, objects: Collection[str]) -> PathPart:
    """A part of the path; `word` is without its "@"."""
    if word.startswith("!"):
        return outside(_part(word[1:], objects))
    key, _, value = word.partition("=")
    if key not in _PARTS:
        raise InputError(f"'@{word}' is no part of a path")
    return _PARTS[key](key, value, objects)


_UNIT: dict[str, Any] = {"%": "share", "x": "share", "m": "m", "s": "s", "waypoints": "waypoints", "": "waypoints"}


def _near(key: str, value: str, objects: Collection[str]) -> PathPart:
    names, _, radius = value.partition(",")
    within = quantity(radius).value if radius else None
    parts = tuple(PathPart("near", (_spot(name, objects),), within) for name in names.split("+"))
    return parts[0] if len(parts) == 1 else PathPart("either", parts=parts)


def _stretch(key: str, value: str, objects: Collection[str]) -> PathPart:
    if not value:
        return PathPart(key, unit="share") if key in ("first", "last") else PathPart(key)
    q = quantity(value)
    return PathPart(key, amount=q.value, unit=_UNIT.get(q.unit, "waypoints"))


def _between(key: str, value: str, objects: Collection[str]) -> PathPart:
    a, b = (_spot(name, objects) for name in value.split("+"))
    return PathPart("between", (a, b))


def _range(key: str, value: str, objects: Collection[str]) -> PathPart:
    low, _, high = re.sub(r"[A-Za-z%]+", "", value).partition("-")
    unit = _UNIT.get(quantity(value.split("-")[-1]).unit if not value[-1].isdigit() else "", "waypoints")
    if unit == "waypoints":
        return PathPart("range", amount=float(low) - 1, until=float(high or low) - 1, unit=unit)
    factor = quantity("1" + re.sub(r"[\d.\-]+", "", value)).value
    return PathPart("range", amount=float(low) * factor, until=float(high) * factor if high else None, unit=unit)


def _beyond(key: str, value: str, objects: Collection[str]) -> PathPart:
    direction, _, by = value.partition(",")
    amount = quantity(by).value if by else 0.0
    # "Below 30 cm" counts from the ground up, against its direction.
    return PathPart("beyond", amount=-amount if direction == "down" else amount, direction=direction)


def _along(key: str, value: str, objects: Collection[str]) -> PathPart:
    """What lies after or before an object, or a waypoint, share, length or time of the path."""
    place = _place(value, objects)
    if isinstance(place, str):
        return PathPart(key, (place,))
    if isinstance(place, tuple):
        return PathPart(key, ({"between": list(place)},))
    unit = _UNIT.get(place.unit, "waypoints")
    at = place.value - (1 if unit == "waypoints" else 0)
    return (
        PathPart("range", amount=at, unit=unit)
        if key == "after"
        else PathPart("range", amount=0.0, until=at, unit=unit)
    )


_PARTS: dict[str, Callable[[str, str, Collection[str]], PathPart]] = {
    "near": _near, **dict.fromkeys(("first", "last", "middle", "turns"), _stretch), "between": _between,
    "after": _along, "before": _along, "range": _range, "beyond": _beyond,
    "rising": lambda *_: PathPart("heading", direction="up"),
    "falling": lambda *_: PathPart("heading", direction="down"),
    "heading": lambda _, value, __: PathPart("heading", direction=value),
    **dict.fromkeys(
        ("start", "goal"), lambda key, value, _: PathPart("near", (key,), quantity(value).value if value else None)
    ),
    "every": lambda _, value, __: PathPart("every", amount=quantity(value).value),
    "selection": lambda *_: PathPart("indices"),
}  # fmt: skip


def _spot(word: str, objects: Collection[str]) -> str:
    place = _place(word, objects)
    if not isinstance(place, str):
        raise InputError(f"{word!r} is no single place")
    return place


def _edit(words: list[str], objects: Collection[str]) -> E.Edit:
    name, *rest = words
    if name in FRAMES:
        return E.Also(frame=_frame(words, objects))
    on = next((word[3:] for word in rest if word.startswith("on=")), "")
    rest = [word for word in rest if not word.startswith("on=")]
    if name in _WITHOUT_MORE:
        return _WITHOUT_MORE[name](rest, on)
    if name in ("undo", "redo", "restart", "accept", "explain"):
        command: Any = name
        return E.Command(command=command, steps=int(rest[0]) if rest and rest[0].isdigit() else 1)
    if name not in _WITH_MORE or not rest:
        raise InputError(f"{' '.join(words)!r} is no edit; known are {', '.join(EDITS)}")
    return _WITH_MORE[name](rest, on, objects)


def _parts(words: list[str], objects: Collection[str]) -> PathPart:
    parts = [_part(word.lstrip("@"), objects) for word in words]
    return both(*parts) if len(parts) > 1 else parts[0]


_WITHOUT_MORE: dict[str, Callable[[list[str], str], E.Edit]] = {
    "scale": lambda rest, on: _rescale(rest, on),
    "drop": lambda rest, on: E.Drop(on=on or (rest[0] if rest else "")),
    "flip": lambda rest, on: E.Flip(on=on),
    "again": lambda rest, on: E.Again(on=on),
}
_WITH_MORE: dict[str, Callable[[list[str], str, Collection[str]], E.Edit]] = {
    "also": lambda rest, on, objects: E.Also(on=on, frame=_frame(rest, objects)),
    "set": lambda rest, on, objects: _set(rest[0], on, objects),
    "replace": lambda rest, on, objects: _replace(rest[0], on, objects),
    "restrict": lambda rest, on, objects: E.Restrict(on=on, part=_parts(rest, objects)),
    "except": lambda rest, on, objects: E.Except(on=on, part=_parts(rest, objects)),
}
"""Edits that stand alone, and those that say what or where."""


def _rescale(words: list[str], on: str) -> E.Rescale:
    degree: Any = next((word[4:] for word in words if word.startswith("deg=")), None)
    change: Any = next((word for word in words if word in ("more", "less")), "")
    number = next((quantity(word) for word in words if word[:1].isdigit() or word[:1] == "."), None)
    return E.Rescale(on=on, change=change, factor=number.value if number else None, degree=degree)


def _set(word: str, on: str, objects: Collection[str]) -> E.Set:
    key, _, value = word.partition("=")
    q = quantity(value.lstrip("+-"), key if key in ROLES else "by")
    step: Any = {"+": 1, "-": -1}.get(value[:1], 0)
    return E.Set(on=on, slot=_FIELD_OF.get(key, key), quantity=q, step=step)


def _replace(word: str, on: str, objects: Collection[str]) -> E.Replace:
    key, _, value = word.partition("=")
    if key in DIRECTIONS:
        return E.Replace(on=on, direction=key)
    if key in ("start", "goal"):
        return E.Replace(on=on, end="start" if key == "start" else "goal")
    return E.Replace(on=on, objects=_objects(value or key, objects))


def _word(name: str) -> str:
    return name.replace(" ", "_")


def _number(q: F.Quantity) -> str:
    if q.said:
        return q.said.replace(" ", "")
    scale, unit = {"%": (100, "%"), "waypoints": (1, "wp"), "turns": (1, "turns"), "m/s2": (1, "m/s^2")}.get(
        q.unit, (1, q.unit.replace("step", "steps"))
    )
    return f"{q.value * scale:.6g}{unit}"


def _put(place: F.Place) -> str:
    if isinstance(place, F.Quantity):
        return _number(place)
    return "+".join(map(_word, place)) if isinstance(place, tuple) else _word(place)


def _shown(frame: F.SemanticFrame) -> str:
    said = [F.name_of(frame)]
    for slot in fields(frame):
        value: Any = getattr(frame, slot.name)
        if slot.name in _SHOWN and value not in ("", None, (), False):
            said.append(_SHOWN[slot.name](frame, value))
        elif isinstance(value, F.Quantity):
            said.append(_slot_shown(frame, slot.name, value))
    sense = getattr(frame, "sense", None)
    said += [str(sense)] if sense in ("cw", "ccw") else []
    said += [f"deg={frame.degree}"] if frame.degree else []
    said += _parts_shown(frame.part)
    return " ".join(word for word in said if word)


def _key_shown(frame: F.SemanticFrame, *slots: str) -> str:
    """The key of a frame's objects or place: what of an object is meant, else the first slot that is filled."""
    aim = next((key for key, value in _AIMS.items() if value == getattr(frame, "aim", "")), "")
    return aim or next((value for slot in slots if (value := getattr(frame, slot, "")) not in ("", "at")), "")


def _objects_shown(frame: F.SemanticFrame, names: tuple[str, ...]) -> str:
    key = _key_shown(frame, "relation")
    return (f"{key}=" if key else "") + "+".join(map(_word, names))


def _place_shown(frame: F.SemanticFrame, place: F.Place) -> str:
    usual = "to" if isinstance(frame, F.Extend) else "" if F.name_of(frame) == "circle" else "at"
    key = _key_shown(frame, "relation", "cut") or usual
    return (f"{key}=" if key else "") + _put(place)


_SHOWN: dict[str, Callable[[F.SemanticFrame, Any], str]] = {
    "offset": lambda _, offset: " ".join(way + (f"={_number(q)}" if q else "") for way, q in offset),
    "objects": _objects_shown,
    "place": _place_shown,
    "along": lambda _, __: "along",
    "about": lambda _, place: f"about={_put(place)}",
    "of": lambda _, place: f"of={_put(place)}",
    **dict.fromkeys(
        ("change", "end", "what", "axis", "direction", "number"),
        lambda _, word: "" if word in ("cap", "floor", "to", "by", "merge", "part") else str(word),
    ),
}
"""How each slot is shown that holds no quantity; one that a frame's name or another key says is not."""


def _slot_shown(frame: F.SemanticFrame, slot: str, q: F.Quantity) -> str:
    if slot == "angle":
        return _number(q)
    own = {"level": "level" if isinstance(frame, F.MoveEnd) else "", "amount": getattr(frame, "cut", "")}.get(slot)
    merging = slot == "amount" and getattr(frame, "change", "") == "merge"
    key = "merge" if merging else own or (q.role if slot in _AMOUNTS else _KEY_OF.get(slot, slot))
    return f"{key}={_number(q)}"


def _parts_shown(part: PathPart) -> list[str]:
    if part == WHOLE:
        return []
    if part.kind == "both":
        return [word for inner in part.parts for word in _parts_shown(inner)]
    if part.kind == "outside":
        return ["@!" + word[1:] for word in _parts_shown(part.parts[0])]
    if part.kind == "either" and all(inner.kind == "near" for inner in part.parts):
        return ["@near=" + "+".join(_word(str(inner.places[0])) for inner in part.parts)]
    return [f"@{_part_shown(part)}"]


def _part_shown(part: PathPart) -> str:
    places = "+".join(_word(p) if isinstance(p, str) else "+".join(map(_word, p["between"])) for p in part.places)
    match part.kind:
        case "near":
            return f"near={places}" + ("" if part.amount is None else f",{part.amount:.6g}m")
        case "first" | "last" | "middle" | "turns" | "range":
            return _stretch_shown(part)
        case "heading":
            return {"up": "rising", "down": "falling"}.get(part.direction, f"heading={part.direction}")
        case "beyond":
            amount = (part.amount or 0.0) * (-1 if part.direction == "down" else 1)
            return f"beyond={part.direction},{amount + 0.0:.6g}m"
        case "every":
            return f"every={part.amount or 1:g}"
        case "indices":
            return "selection"
    return f"{part.kind}={places}"


def _stretch_shown(part: PathPart) -> str:
    """A part that is told by how far along the path it begins and ends; waypoints count from 1."""
    unit = {"share": "%", "m": "m", "s": "s", "waypoints": "wp"}[part.unit]
    scale, first = 100 if part.unit == "share" else 1, 1 if part.unit == "waypoints" else 0
    if part.kind != "range":
        return part.kind + ("" if part.amount is None else f"={part.amount * scale:.6g}{unit}")
    low = (part.amount or 0.0) * scale + first
    if part.until is None:
        return f"after={low:.6g}{unit}"
    return f"range={low:.6g}-{part.until * scale + first:.6g}" + ("" if part.unit == "waypoints" else unit)


def _edit_shown(edit: E.Edit) -> str:
    if isinstance(edit, E.Also):
        return f"also {_shown(edit.frame)}"
    if isinstance(edit, E.Command):
        return edit.command if edit.steps == 1 else f"{edit.command} {edit.steps}"
    on = f"on={edit.on}" if edit.on and not isinstance(edit, E.Drop) else edit.on
    return " ".join(word for word in (edit.NAME, *_change_shown(edit), on) if word)


def _change_shown(edit: E.Edit) -> list[str]:
    """What an edit changes to, in words of the notation."""
    match edit:
        case E.Rescale(change=change, factor=factor, degree=degree):
            return [f"{factor:.6g}x" if factor is not None else change, f"deg={degree}" if degree else ""]
        case E.Set(slot=slot, quantity=q, step=step):
            return [f"{_KEY_OF.get(slot, slot)}={ {1: '+', -1: '-', 0: ''}[step] }{_number(q).lstrip('+-')}"]
        case E.Replace(direction=direction, objects=names, end=end):
            return [direction or end or "obj=" + "+".join(map(_word, names))]
        case E.Restrict(part=part) | E.Except(part=part):
            return _parts_shown(part)
    return []
