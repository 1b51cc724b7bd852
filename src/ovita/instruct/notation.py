"""The notation of frames and edits as text: `move left=20cm up; pace slower @near=cup`.

The corpus is written in it (`training/corpus/NOTATION.md`), `ovita read` prints it, and the learned reader is
trained on it. Numbers keep the person's unit; waypoints count from 1.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import fields
from typing import Any, get_args

from ovita.errors import InputError
from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.paths.part import WHOLE, PathPart, both, outside
from ovita.units import find

DIRECTIONS: tuple[F.Direction, ...] = get_args(F.Direction)
ROLES: tuple[F.Role, ...] = get_args(F.Role)
ENDS: dict[str, str] = {
    "left": "right", "right": "left", "front": "back", "back": "front", "up": "down", "down": "up",
    "x": "-x", "-x": "x", "y": "-y", "-y": "y", "z": "-z", "-z": "z",
}  # fmt: skip
"""Each direction's opposite."""

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
_FIELD_OF = {"for": "duration", "at": "place", "to": "place", "toward": "place", "away": "place", "level": "level"}
_KEY_OF = {"duration": "for"}
_SIDES = {"over", "under", "between"}
_AIMS: dict[str, F.Aim] = {"on": "top", "touch": "surface"}
"""Keys that say what of an object is meant; for other frames than these, objects have no such key."""


def name_of(frame: F.SemanticFrame) -> str:
    """The notation's name of a frame, such as "farther" or "spiral"."""
    match frame:
        case F.Approach(sense=sense):
            return sense
        case F.Figure(shape=shape):
            return shape
    return frame.NAME


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


def _frame(words: list[str], objects: Collection[str]) -> F.SemanticFrame:
    name, *rest = words
    kind = FRAMES.get(name)
    if kind is None:
        raise InputError(f"{name!r} is no frame; known are {', '.join(FRAMES)}")
    slots: dict[str, Any] = {}
    if name in ("closer", "farther"):
        slots["sense"] = name
    if kind is F.Figure:
        slots["shape"] = name
    known = {slot.name for slot in fields(kind)}
    parts: list[PathPart] = []
    offset: list[tuple[Any, F.Quantity | None]] = []
    for word in rest:
        key, _, value = word.partition("=")
        if word.startswith("@"):
            parts.append(_part(word[1:], objects))
        elif key == "deg":
            slots["degree"] = value
        elif key in DIRECTIONS and "offset" in known and not (kind is F.Bound and not value):
            offset.append((key, quantity(value) if value else None))
        elif not _slot(kind, name, key, value, slots, known, objects):
            raise InputError(f"{word!r} has no place in {name!r}")
    if parts:
        slots["part"] = both(*parts) if len(parts) > 1 else parts[0]
    if "offset" in known:
        slots["offset"] = tuple(offset)
    try:
        return kind(**_completed(kind, slots))
    except TypeError:
        raise InputError(f"{' '.join(words)!r} lacks something that {name!r} needs") from None


def _completed(kind: type[F.SemanticFrame], slots: dict[str, Any]) -> dict[str, Any]:
    """Slots with what the notation leaves to the rest of the frame."""
    if kind is F.Pace and "change" not in slots and "amount" in slots:
        role = slots["amount"].role
        slots["change"] = {"at_most": "cap", "at_least": "floor"}.get(role, "set")
    if kind is F.Keep and "what" not in slots:
        slots["what"] = "part"
    if kind is F.Resample and "change" not in slots and "amount" in slots:
        slots["change"] = slots["amount"].role
    return slots


def _slot(
    kind: type[F.SemanticFrame],
    name: str,
    key: str,
    value: str,
    slots: dict[str, Any],
    known: set[str],
    objects: Collection[str],
) -> bool:
    """Put one word of the notation into its slot; whether there was one."""
    if not value:
        return _flag(kind, key, slots, known, objects)
    if key in _AIMS and kind in F.AIMED:
        slots["aim"] = _AIMS[key]
        if kind is F.Visit:
            slots["objects"] = tuple(_object(word, objects) for word in value.split("+"))
        else:
            slots |= {"place": _place(value, objects)} | ({"relation": "to"} if kind is F.MoveEnd else {})
    elif (kind is F.MoveEnd and key in ("to", "toward", "away")) or (kind is F.Visit and key in _SIDES):
        slots["relation"] = key
        if kind is F.Visit:
            slots["objects"] = tuple(_object(word, objects) for word in value.split("+"))
        else:
            slots["place"] = _place(value, objects)
    elif kind is F.Trim and key in ("first", "last", "after", "before"):
        slots["cut"] = key
        slots |= {"amount": quantity(value)} if key in ("first", "last") else {"place": _place(value, objects)}
    elif kind is F.Resample and key == "merge":
        slots |= {"change": "merge", "amount": quantity(value)}
    elif (kind is F.Extend and key == "to") or ("place" in known and key in ("at", "of")):
        slots["place"] = _place(value, objects)
    elif key in ("about", "of") and key in known:
        slots[key] = _place(value, objects)
    elif kind is F.Hop and key == "over":
        slots["objects"] = (_object(value, objects),)
    elif key in ROLES:
        target = next((slot for slot in ("amount", "distance", "by", "level", "angle") if slot in known), "")
        if not target:
            return False
        slots[target] = quantity(value, key)
    else:
        field = _FIELD_OF.get(key, key)
        if field not in known or field in ("part", "degree", "words", "confidence"):
            return False
        slots[field] = quantity(value)
    return True


def _flag(
    kind: type[F.SemanticFrame], word: str, slots: dict[str, Any], known: set[str], objects: Collection[str]
) -> bool:
    """Put a bare word into its slot: a choice, a sense, a direction, a bare number or objects."""
    if word in ("cw", "ccw") and "sense" in known:
        slots["sense"] = word
    elif kind is F.Pace and word in (
        "faster",
        "slower",
        "set",
        "constant",
        "rampup",
        "rampdown",
        "turns",
        "accelerate",
    ):
        slots["change"] = word
    elif kind in (F.Resample, F.Curve, F.Resize) and word in ("more", "fewer", "less", "larger", "smaller"):
        slots["change"] = word
    elif kind is F.Keep and word in ("start", "goal", "ends", "speed", "path", "shape", "height", "rest"):
        slots["what"] = "path" if word == "shape" else word
    elif kind is F.MoveEnd and word in ("start", "goal", "ends"):
        slots["end"] = word
    elif kind is F.Mirror and word in ("left", "right", "front", "back", "up", "down", "x", "y", "z"):
        slots["axis"] = {"right": "left", "back": "front", "down": "up"}.get(word, word)
    elif word in DIRECTIONS and "direction" in known:
        slots["direction"] = word
    elif word == "along" and word in known:
        slots["along"] = True
    elif kind is F.Quadrant and word.isdigit():
        slots["number"] = int(word)
    elif "angle" in known and _NUMBER.fullmatch(word):
        slots["angle"] = quantity(word)
    elif "objects" in known:
        slots["objects"] = tuple(_object(name, objects) for name in word.split("+"))
    elif "place" in known:
        slots["place"] = _place(word, objects)
    else:
        return False
    return True


def _part(word: str, objects: Collection[str]) -> PathPart:
    """A part of the path; `word` is without its "@"."""
    if word.startswith("!"):
        return outside(_part(word[1:], objects))
    key, _, value = word.partition("=")
    match key:
        case "near":
            names, _, radius = value.partition(",")
            within = quantity(radius).value if radius else None
            parts = tuple(PathPart("near", (_spot(name, objects),), within) for name in names.split("+"))
            return parts[0] if len(parts) == 1 else PathPart("either", parts=parts)
        case "first" | "last" | "middle" | "turns":
            if not value:
                return PathPart(key, unit="share") if key in ("first", "last") else PathPart(key)
            q = quantity(value)
            return PathPart(key, amount=q.value, unit=_UNIT.get(q.unit, "waypoints"))
        case "between":
            a, b = (_spot(name, objects) for name in value.split("+"))
            return PathPart("between", (a, b))
        case "after" | "before":
            return _along(key, _place(value, objects))
        case "range":
            a, _, b = re.sub(r"[A-Za-z%]+", "", value).partition("-")
            unit = _UNIT.get(quantity(value.split("-")[-1]).unit if not value[-1].isdigit() else "", "waypoints")
            factor = quantity("1" + re.sub(r"[\d.\-]+", "", value)).value if unit != "waypoints" else 1.0
            less = 1 if unit == "waypoints" else 0
            until = float(b) * factor - less if b else float(a) * factor - less if unit == "waypoints" else None
            return PathPart("range", amount=float(a) * factor - less, until=until, unit=unit)
        case "rising" | "falling":
            return PathPart("heading", direction="up" if key == "rising" else "down")
        case "heading":
            return PathPart("heading", direction=value)
        case "start" | "goal":
            return PathPart("near", (key,), quantity(value).value if value else None)
        case "every":
            return PathPart("every", amount=quantity(value).value)
        case "beyond":
            direction, _, by = value.partition(",")
            amount = quantity(by).value if by else 0.0
            # "Below 30 cm" counts from the ground up, against its direction.
            return PathPart("beyond", amount=-amount if direction == "down" else amount, direction=direction)
        case "selection":
            return PathPart("indices")
    raise InputError(f"'@{word}' is no part of a path")


_UNIT: dict[str, Any] = {"%": "share", "x": "share", "m": "m", "s": "s", "waypoints": "waypoints", "": "waypoints"}


def _spot(word: str, objects: Collection[str]) -> str:
    place = _place(word, objects)
    if not isinstance(place, str):
        raise InputError(f"{word!r} is no single place")
    return place


def _along(key: str, place: F.Place) -> PathPart:
    """What lies after or before an object, or a waypoint, share, length or time of the path."""
    if isinstance(place, str):
        return PathPart(key, (place,))
    if isinstance(place, tuple):
        return PathPart(key, ({"between": list(place)},))
    unit = _UNIT.get(place.unit, "waypoints")
    value = place.value - (1 if unit == "waypoints" else 0)
    if key == "after":
        return PathPart("range", amount=value, unit=unit)
    return PathPart("range", amount=0.0, until=value, unit=unit)


def _edit(words: list[str], objects: Collection[str]) -> E.Edit:
    name, *rest = words
    if name in FRAMES:
        return E.Also(frame=_frame(words, objects))
    on = next((word[3:] for word in rest if word.startswith("on=")), "")
    rest = [word for word in rest if not word.startswith("on=")]
    match name:
        case "scale":
            degree: Any = next((word[4:] for word in rest if word.startswith("deg=")), None)
            change: Any = next((word for word in rest if word in ("more", "less")), "")
            number = next((quantity(word) for word in rest if word[:1].isdigit() or word[:1] == "."), None)
            return E.Rescale(on=on, change=change, factor=number.value if number else None, degree=degree)
        case "set" if rest:
            key, _, value = rest[0].partition("=")
            role = key if key in ROLES else "by"
            step: Any = {"+": 1, "-": -1}.get(value[:1], 0)
            return E.Set(on=on, slot=_FIELD_OF.get(key, key) if key == "for" else key,
                         quantity=quantity(value.lstrip("+-"), role), step=step)  # fmt: skip
        case "replace" if rest:
            key, _, value = rest[0].partition("=")
            if key in DIRECTIONS:
                return E.Replace(on=on, direction=key)
            if key in ("start", "goal"):
                return E.Replace(on=on, end="start" if key == "start" else "goal")
            return E.Replace(on=on, objects=tuple(_object(word, objects) for word in (value or key).split("+")))
        case "restrict" | "except" if rest:
            parts = [_part(word.lstrip("@"), objects) for word in rest]
            part = both(*parts) if len(parts) > 1 else parts[0]
            return E.Restrict(on=on, part=part) if name == "restrict" else E.Except(on=on, part=part)
        case "drop":
            return E.Drop(on=on or (rest[0] if rest else ""))
        case "flip":
            return E.Flip(on=on)
        case "again":
            return E.Again(on=on)
        case "also" if rest:
            return E.Also(on=on, frame=_frame(rest, objects))
        case "undo" | "redo" | "restart" | "accept" | "explain":
            return E.Command(command=name, steps=int(rest[0]) if rest and rest[0].isdigit() else 1)
    raise InputError(f"{' '.join(words)!r} is no edit; known are {', '.join(EDITS)}")


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
    said = [name_of(frame)]
    aim = next((key for key, value in _AIMS.items() if value == getattr(frame, "aim", "")), "")
    for slot in fields(frame):
        value: Any = getattr(frame, slot.name)
        if (slot.name, value) == ("what", "part"):
            continue
        if slot.name in ("part", "degree", "words", "confidence", "sense") or value in ("", None, (), "at"):
            continue
        if slot.name == "offset":
            said += [direction + (f"={_number(q)}" if q else "") for direction, q in value]
        elif slot.name == "objects":
            names = "+".join(map(_word, value))
            relation = getattr(frame, "relation", "at")
            key = aim or ("" if relation == "at" else relation)
            said.append(f"{key}={names}" if key else names)
        elif slot.name == "place":
            key = aim or getattr(frame, "relation", "") or getattr(frame, "cut", "")
            key = key or {"extend": "to"}.get(frame.NAME, "" if said[0] == "circle" else "at")
            said.append((f"{key}=" if key else "") + _put(value))
        elif slot.name == "along":
            said += ["along"] if value else []
        elif slot.name in ("about", "of"):
            said.append(f"{slot.name}={_put(value)}")
        elif isinstance(value, F.Quantity):
            said.append(_slot_shown(frame, slot.name, value))
        elif slot.name in ("change", "end", "what", "axis", "direction", "number"):
            said += [str(value)] if value not in ("cap", "floor", "to", "by", "merge") else []
    if getattr(frame, "sense", None) in ("cw", "ccw"):
        said.append(frame.sense)  # type: ignore[attr-defined]
    said += [f"deg={frame.degree}"] if frame.degree else []
    said += _parts_shown(frame.part)
    return " ".join(word for word in said if word)


def _slot_shown(frame: F.SemanticFrame, slot: str, q: F.Quantity) -> str:
    if slot == "angle":
        return _number(q)
    if slot == "level" and isinstance(frame, F.MoveEnd):
        return f"level={_number(q)}"
    if slot == "amount" and isinstance(frame, F.Trim):
        return f"{frame.cut}={_number(q)}"
    if slot == "amount" and getattr(frame, "change", "") == "merge":
        return f"merge={_number(q)}"
    key = q.role if slot in ("amount", "distance", "level", "by") else _KEY_OF.get(slot, slot)
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
    along = {"share": "%", "m": "m", "s": "s", "waypoints": "wp"}[part.unit]
    scale = 100 if part.unit == "share" else 1
    places = "+".join(_word(p) if isinstance(p, str) else "+".join(map(_word, p["between"])) for p in part.places)
    match part.kind:
        case "near":
            return f"near={places}" + ("" if part.amount is None else f",{part.amount:.6g}m")
        case "first" | "last" | "middle" | "turns":
            return part.kind + ("" if part.amount is None else f"={part.amount * scale:.6g}{along}")
        case "range":
            low = (part.amount or 0.0) * scale + (1 if part.unit == "waypoints" else 0)
            if part.until is None:
                return f"after={low:.6g}{along}"
            high = part.until * scale + (1 if part.unit == "waypoints" else 0)
            return f"range={low:.6g}-{high:.6g}" + ("" if part.unit == "waypoints" else along)
        case "heading":
            return {"up": "rising", "down": "falling"}.get(part.direction, f"heading={part.direction}")
        case "beyond":
            amount = part.amount or 0.0
            return f"beyond={part.direction},{(-amount if part.direction == 'down' else amount) + 0.0:.6g}m"
        case "every":
            return f"every={part.amount or 1:g}"
        case "indices":
            return "selection"
    return f"{part.kind}={places}"


def _edit_shown(edit: E.Edit) -> str:
    match edit:
        case E.Also(frame=frame):
            return "also " + _shown(frame)
        case E.Command(command=command, steps=steps):
            return command if steps == 1 else f"{command} {steps}"
        case E.Rescale(change=change, factor=factor, degree=degree):
            said = [f"{factor:.6g}x" if factor is not None else change, f"deg={degree}" if degree else ""]
        case E.Set(slot=slot, quantity=q, step=step):
            said = [f"{_KEY_OF.get(slot, slot)}={ {1: '+', -1: '-', 0: ''}[step] }{_number(q).lstrip('+-')}"]
        case E.Replace(direction=direction, objects=names, end=end):
            said = [direction or end or "obj=" + "+".join(map(_word, names))]
        case E.Restrict(part=part) | E.Except(part=part):
            said = _parts_shown(part)
        case _:
            said = []
    said += [f"on={edit.on}"] if edit.on and not isinstance(edit, E.Drop) else [edit.on]
    return " ".join(word for word in [edit.NAME, *said] if word)
