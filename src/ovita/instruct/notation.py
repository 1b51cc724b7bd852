"""The notation of frames and edits as text: `move left=20cm up; pace slower @near=cup`.

The corpus is written in it (`training/corpus/NOTATION.md`), `ovita read` prints it, and the learned reader is
trained on it. Numbers keep the person's unit; waypoints count from 1.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Any, Literal, get_args, get_origin, get_type_hints

from ovita.errors import InputError
from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.paths.part import WHOLE, PathPart, Unit, any_of, both, outside
from ovita.units import find


def _choices(hint: Any) -> tuple[str, ...]:
    """The words that a slot of a type chooses among, if it does."""
    inner = get_args(hint)
    if get_origin(hint) is Literal:
        return inner
    return tuple(word for kind in inner if get_origin(kind) is Literal for word in get_args(kind))


DIRECTIONS: tuple[F.Direction, ...] = get_args(F.Direction)
ROLES: tuple[F.Role, ...] = get_args(F.Role)
COMMANDS: tuple[str, ...] = _choices(get_type_hints(E.Command)["command"])
_HINTS = {kind: get_type_hints(kind) for kind in F.SemanticFrame.__subclasses__()}
FRAMES: dict[str, type[F.SemanticFrame]] = {
    name: kind
    for kind, hints in _HINTS.items()
    for name in (_choices(hints[F.CALLED[kind]]) if kind in F.CALLED else (kind.NAME,))
}
"""Each name of the notation and the frame that it is."""

EDITS: dict[str, type[E.Edit]] = {
    name: kind for kind in E.Edit.__subclasses__() for name in (COMMANDS if kind is E.Command else (kind.NAME,))
}

_SLOT_OF = {
    kind: {word: slot for slot, hint in hints.items() if slot not in ("aim", "degree") for word in _choices(hint)}
    for kind, hints in _HINTS.items()
}
"""The slot that each choice of a frame is one of: `pace slower` fills `change`."""

_MEASURES = {kind: tuple(slot.name for slot in fields(kind) if slot.metadata) for kind in _HINTS}
_AIMS: dict[str, F.Aim] = {"on": "top", "touch": "surface"}
"""Keys that say what of an object is meant; for other frames than these, objects have no such key."""

_AIM_KEYS = {aim: key for key, aim in _AIMS.items()}
_KEYS = {"duration": "for"}
_SLOTS = {"for": "duration"}
_UNSAID = ("cap", "floor", "to", "by", "merge", "part", "at", "", None)
"""Choices that another key says or implies."""

_COUNTS = {"": "", "wp": "waypoints", "turns": "turns", "turn": "turns", "laps": "turns", "waves": "turns"}
"""What is counted, not measured."""

_NUMBER = re.compile(r"[~+]?(-?\d*\.?\d+)(?:-(\d*\.?\d+))?([A-Za-z%/°][\w/^°]*|%)?")


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
    return tuple(_Words(objects).frame(said.split()) for said in text.split(";") if said.strip())


def parse_edits(text: str, objects: Collection[str] = ()) -> tuple[E.Edit, ...]:
    """The edits that a text in the notation says; frames among them are `Also`.

    Raises:
        InputError: If an edit is not of the notation.
    """
    return tuple(_Words(objects).edit(said.split()) for said in text.split(";") if said.strip())


def show(frames: Collection[F.SemanticFrame | E.Edit]) -> str:
    """Frames or edits in the notation, as `parse` and `parse_edits` read them."""
    return "; ".join(_frame_shown(f) if isinstance(f, F.SemanticFrame) else _edit_shown(f) for f in frames)


def quantity(said: str, role: F.Role = "by") -> F.Quantity:
    """A number with its unit, such as "10cm", "30%", "2x", "12wp", "5-15cm" (its middle), in SI.

    Raises:
        InputError: If it is no number with a known unit.
    """
    match = _NUMBER.fullmatch(said)
    if match is None:
        raise InputError(f"{said!r} is no quantity; write a number with a unit, such as 10cm, 0.2m/s, 30% or 2x")
    value = (float(match[1]) + float(match[2] or match[1])) / 2
    unit = match[3] or ""
    if unit in _COUNTS:
        return F.Quantity(value, _COUNTS[unit], role, said)
    known = find({"in": "inch", "in/s": "inch/s"}.get(unit, unit))
    if known is None:
        raise InputError(f"{unit!r} in {said!r} is no unit of measure")
    return F.Quantity(value * known.factor, known.dimension, role, said)


def main_slot(kind: type[F.SemanticFrame]) -> str:
    """The slot of a kind of frame that says how much of what it asks for; "" where it has none."""
    return next((slot for slot in _MEASURES[kind] if slot in F.MAIN), "")


@dataclass(frozen=True)
class Where:
    """A part of the path as people tell it, with waypoints counted from 1.

    Args:
        kind: That of a `PathPart`, but for "rising" and "falling", the "selection", what begins "from" or goes "upto"
            so much, and "near" several places.
        places: What it is near, between, after or before.
        amount: How much, how near, from where or every how many.
        until: A range's end.
        direction: Of what is beyond so much along it.
    """

    kind: str
    places: tuple[Any, ...] = ()
    amount: F.Quantity | None = None
    until: F.Quantity | None = None
    direction: str = ""


_UNITS: dict[str, Unit] = {"%": "share", "x": "share", "m": "m", "s": "s"}


def where_of(part: PathPart) -> Where:
    """A part of the path as people tell it."""
    kind = part.kind
    unit = "m" if _kind(part) in ("near", "beyond") else {"share": "%"}.get(part.unit, part.unit)
    first = 1 if kind == "range" and unit == "waypoints" else 0
    reach = {inner.amount for inner in part.parts} if _kind(part) == "near" and part.parts else {part.amount}
    begin = reach.pop() if len(reach) == 1 else None  # near one thing and another, within as much of each
    begin = begin or (0.0 if kind == "range" else None)
    amount, until = (None if v is None else F.Quantity(v + first, unit) for v in (begin, part.until))
    return Where(_kind(part), _places_told(part), amount, until, part.direction)


def _places_told(part: PathPart) -> tuple[Any, ...]:
    """The places of a part, or the first of each of several parts; a place between two is these two."""
    places = part.places or tuple(inner.places[0] for inner in part.parts if inner.places)
    if len(places) == 1 and isinstance(places[0], dict):
        return tuple(places[0]["between"])
    return places


def _kind(part: PathPart) -> str:
    match part:
        case PathPart(kind="either", parts=parts) if all(inner.kind == "near" for inner in parts):
            return "near"
        case PathPart(kind="heading", direction="up" | "down" as direction):
            return "rising" if direction == "up" else "falling"
        case PathPart(kind="range", until=None):
            return "from"
        case PathPart(kind="indices"):
            return "selection"
    return part.kind


def part_told(where: Where) -> PathPart:
    """The part of the path that is told so."""
    kind, places, amount = where.kind, where.places, where.amount.value if where.amount else None
    match kind:
        case "near":
            return any_of([PathPart(kind, (place,), amount) for place in places])
        case "between":
            return any_of([PathPart(kind, pair) for pair in pairwise(places)])
        case "after" | "before":
            return PathPart(kind, ({"between": list(places)} if len(places) == 2 else places[0],))
        case "rising" | "falling":
            return PathPart("heading", direction="up" if kind == "rising" else "down")
        case "heading":
            return PathPart(kind, direction=where.direction)
        case "beyond":
            return PathPart(kind, amount=amount or 0.0, direction=where.direction)
    return _stretch(where)


def _stretch(where: Where) -> PathPart:
    """A part that is told by how far along the path it begins and ends."""
    q = where.amount or where.until
    unit: Unit = "share" if where.kind in ("first", "last") else "waypoints"
    unit = _UNITS.get(q.unit, "waypoints") if q else unit
    first = 1 if unit == "waypoints" else 0
    match where.kind:
        case "range" | "from" | "upto":
            begin = where.amount.value - first if where.amount else 0.0
            until = where.until.value - first if where.until else None
            return PathPart("range", amount=begin, until=until, unit=unit)
        case "selection":
            return PathPart("indices")
        case "every":
            return PathPart("every", amount=q.value if q else 2)
    return PathPart(where.kind, amount=q.value if q else None, unit=unit)


@dataclass(frozen=True)
class _Words:
    """Reads words of the notation about a scene's objects."""

    objects: Collection[str]

    def frame(self, words: Sequence[str]) -> F.SemanticFrame:
        name, *rest = words
        kind = FRAMES.get(name)
        if kind is None:
            raise InputError(f"{name!r} is no frame; known are {', '.join(FRAMES)}")
        slots: dict[str, Any] = {"part": self.parts([word for word in rest if word.startswith("@")])}
        slots |= {F.CALLED[kind]: name} if kind in F.CALLED else {}
        slots |= {"offset": ()} if "offset" in _HINTS[kind] else {}
        for word in rest:
            found = {} if word.startswith("@") else self.slots(kind, word)
            slots |= found | ({"offset": slots["offset"] + found["offset"]} if "offset" in found else {})
        try:
            return kind(**_implied(kind, slots) | slots)
        except TypeError:
            raise InputError(f"{' '.join(words)!r} lacks something that {name!r} needs") from None

    def slots(self, kind: type[F.SemanticFrame], word: str) -> dict[str, Any]:
        """The slots of a frame that a word fills."""
        key, _, value = word.partition("=")
        if key == "deg":
            return {"degree": value}
        found = self.keyed(kind, key, value) if value else self.bare(kind, word)
        if not found:
            raise InputError(f"{word!r} has no place in {kind.NAME!r}")
        return found

    def keyed(self, kind: type[F.SemanticFrame], key: str, value: str) -> dict[str, Any]:
        """The slots that "key=value" fills; none where the frame has no place for it."""
        known, choice = _HINTS[kind], _SLOT_OF[kind].get(key, "")
        if key in DIRECTIONS and "offset" in known:
            return {"offset": ((key, quantity(value)),)}
        if choice and key in ("first", "last", "merge"):
            return {choice: key, "amount": quantity(value)}
        if choice in ("relation", "cut"):
            return {choice: key} | self.about(known, value)
        if placed := self.placed(kind, key, value):
            return placed
        slot, role = (main_slot(kind), key) if key in ROLES else (_SLOTS.get(key, key), "by")
        return {slot: quantity(value, role)} if slot in _MEASURES[kind] else {}

    def placed(self, kind: type[F.SemanticFrame], key: str, value: str) -> dict[str, Any]:
        """The slots that "key=value" fills with a place; none where it is no place."""
        known = _HINTS[kind]
        if key in _AIMS and "aim" in known:
            return {"aim": _AIMS[key]} | ({"relation": "to"} if kind is F.MoveEnd else {}) | self.about(known, value)
        if key in F.PLACES and key in known:
            return {key: self.place(value)}
        at = (key in ("at", "of") and "place" in known) or (kind, key) in ((F.Extend, "to"), (F.Hop, "over"))
        return self.about(known, value) if at else {}

    def bare(self, kind: type[F.SemanticFrame], word: str) -> dict[str, Any]:
        """The slot that a word without a key fills: a choice, a number, or objects."""
        known = _HINTS[kind]
        word = "path" if (kind, word) == (F.Keep, "shape") else word
        if word in DIRECTIONS and "offset" in known and kind is not F.Bound:
            return {"offset": ((word, None),)}
        if word in _SLOT_OF[kind]:
            return {_SLOT_OF[kind][word]: word}
        if word in ("along", "longer", "upright") and word in known:
            return {word: True}
        if "angle" in known and _NUMBER.fullmatch(word):
            return {"angle": quantity(word)}
        if "number" in known:
            return {"number": int(word)} if word.isdigit() else {}
        return self.about(known, word)

    def about(self, known: Collection[str], word: str) -> dict[str, Any]:
        """The objects or the place of a frame."""
        if "objects" in known:
            return {"objects": self.named(word)}
        return {"place": self.place(word)} if "place" in known else {}

    def parts(self, words: Sequence[str]) -> PathPart:
        parts = [self.part(word.lstrip("@")) for word in words]
        return both(*parts) if len(parts) > 1 else next(iter(parts), WHOLE)

    def part(self, word: str) -> PathPart:
        """A part of the path; `word` is without its "@"."""
        if word.startswith("!"):
            return outside(self.part(word[1:]))
        key, _, value = word.partition("=")
        return part_told(self.where(key, value))

    def where(self, key: str, value: str) -> Where:
        """A part of the path by its key."""
        if key in ("near", "between"):
            places, _, within = value.partition(",")
            return Where(key, tuple(map(self.spot, places.split("+"))), _if_said(within))
        if key not in ("after", "before"):
            return _where(key, value)
        place = self.place(value)
        if isinstance(place, F.Quantity):
            return Where("from", amount=place) if key == "after" else Where("upto", until=place)
        return Where(key, place if isinstance(place, tuple) else (place,))

    def object(self, word: str) -> str:
        if word.startswith("("):
            return word.replace(":", ", ")  # a point by its coordinates
        for name in self.objects:
            if word.replace("_", " ") == name.replace("_", " "):
                return name
        raise InputError(f"{word!r} is neither an object of the scene nor a word of the notation")

    def named(self, word: str) -> tuple[str, ...]:
        return tuple(map(self.object, word.split("+")))

    def place(self, word: str) -> F.Place:
        if "+" in word:
            first, second = word.split("+", 1)
            return self.object(first), self.object(second)
        try:
            return self.spot(word)
        except InputError:
            if word[:1].isdigit() and _NUMBER.fullmatch(word):
                return quantity(word, "at")
            raise

    def spot(self, word: str) -> str:
        return word if word in F.SPOTS else self.object(word)

    def edit(self, words: Sequence[str]) -> E.Edit:
        name, *rest = words
        on = self.called(next((word[3:] for word in rest if word.startswith("on=")), ""))
        rest = [word for word in rest if not word.startswith("on=")]
        kind: Any = EDITS.get(name)
        match name, rest:
            case "scale", _:
                return _rescale(rest, on)
            case "drop" | "flip" | "again", _:
                return EDITS[name](on=on or self.called(" ".join(rest)))
            case "also", [_, *_]:
                return E.Also(on=on, frame=self.frame(rest))
            case "set", [change]:
                return _set(change, on)
            case "replace", [change]:
                return self.replaced(change, on)
            case (("restrict" | "except"), [_, *_]):
                edit: E.Restrict | E.Except = kind(on=on, part=self.parts(rest))
                return edit
        return E.Also(frame=self.frame(words)) if name in FRAMES else _command(words)

    def called(self, on: str) -> str:
        """What an edit names, with the object's own name: a kind of frame, a direction, "box" or "pace_box"."""
        said = on.replace("_", " ")
        kind, _, rest = said.partition(" ")
        plain = {name.replace("_", " "): name for name in self.objects}
        if said in plain:
            return plain[said]
        return f"{kind} {plain[rest]}" if rest in plain else on

    def replaced(self, word: str, on: str) -> E.Replace:
        key, _, value = word.partition("=")
        if key in DIRECTIONS:
            return E.Replace(on=on, direction=key)
        end: Any = key
        if end in ("start", "goal"):
            return E.Replace(on=on, end=end)
        return E.Replace(on=on, objects=self.named(value or key))


def _implied(kind: type[F.SemanticFrame], slots: dict[str, Any]) -> dict[str, Any]:
    """What the notation leaves to the rest of a frame."""
    if kind is F.Keep:
        return {"what": "part"}
    if kind not in (F.Pace, F.Resample) or "amount" not in slots:
        return {}
    role: str = slots["amount"].role
    return {"change": {"at_most": "cap", "at_least": "floor"}.get(role, "set") if kind is F.Pace else role}


def _where(key: str, value: str) -> Where:
    """A part of the path that no objects tell, by its key."""
    match key:
        case "start" | "goal":
            return Where("near", (key,), _if_said(value))
        case "range":
            low, _, high = value.partition("-")
            unit = value.lstrip("0123456789.-")
            return Where(key, (), quantity(low.removesuffix(unit) + unit), quantity(high or low))
        case "beyond":
            direction, _, amount = value.partition(",")
            return Where(key, (), _from_ground(direction, _if_said(amount)), direction=direction)
        case "heading":
            return Where(key, direction=value)
        case "first" | "last" | "middle" | "turns" | "every" | "rising" | "falling" | "selection" | "whole":
            return Where(key, amount=_if_said(value))
    raise InputError(f"'@{key}' is no part of a path")


def _if_said(amount: str) -> F.Quantity | None:
    return quantity(amount) if amount else None


def _from_ground(direction: str, q: F.Quantity | None) -> F.Quantity:
    """What lies beyond so much: "below 30 cm" counts from the ground up, against its direction."""
    value = q.value if q else 0.0
    return F.Quantity(-value + 0.0 if direction == "down" else value, "m")


def _command(words: Sequence[str]) -> E.Command:
    name: Any = words[0]
    if name not in COMMANDS:
        raise InputError(f"{' '.join(words)!r} is no edit; known are {', '.join(EDITS)}")
    return E.Command(command=name, steps=int(words[1]) if words[1:] and words[1].isdigit() else 1)


def _rescale(words: Sequence[str], on: str) -> E.Rescale:
    slots: dict[str, Any] = {}
    for word in words:
        if word.startswith("deg="):
            slots["degree"] = word.removeprefix("deg=")
        elif word in ("more", "less"):
            slots["change"] = word
        else:
            slots["factor"] = quantity(word).value
    return E.Rescale(on=on, **slots)


def _set(word: str, on: str) -> E.Set:
    key, _, value = word.partition("=")
    q = quantity(value.lstrip("+-"), key if key in ROLES else "by")
    step: Any = {"+": 1, "-": -1}.get(value[:1], 0)
    return E.Set(on=on, slot=_SLOTS.get(key, key), quantity=q, step=step)


def _joined(names: Sequence[Any]) -> str:
    return "+".join(name.replace(", ", ":").replace(" ", "_") for name in names)


def _number(q: F.Quantity) -> str:
    if q.said:
        return q.said.replace(" ", "")
    unit = {"waypoints": "wp", "m/s2": "m/s^2", "step": "steps"}.get(q.unit, q.unit)
    return f"{q.value * (100 if unit == '%' else 1):.6g}{unit}"


def _place_shown(place: F.Place) -> str:
    if isinstance(place, F.Quantity):
        return _number(place)
    return _joined(place if isinstance(place, tuple) else (place,))


def _frame_shown(frame: F.SemanticFrame) -> str:
    own = [_slot_shown(frame, slot.name) for slot in fields(frame)]
    said = [F.name_of(frame), *own, f"deg={frame.degree}" if frame.degree else "", *_parts_shown(frame.part)]
    return " ".join(filter(None, said))


def _slot_shown(frame: F.SemanticFrame, slot: str) -> str:
    """A slot of a frame in words of the notation; "" where it is open, or where the name or another slot says it."""
    value: Any = getattr(frame, slot)
    if isinstance(value, F.Quantity) and slot not in F.PLACES:
        return _amount_shown(frame, slot, value)
    match slot:
        case "offset":
            return " ".join(way + (f"={_number(q)}" if q else "") for way, q in value)
        case "objects" | "place" if value:
            return f"{_key_shown(frame)}={_place_shown(value)}".removeprefix("=")
        case "about" | "of" if value:
            return f"{slot}={_place_shown(value)}"
        case "along" | "longer" | "upright" if value:
            return slot
        case "change" | "end" | "what" | "axis" | "direction" | "number" | "sense":
            return "" if value in (*_UNSAID, F.name_of(frame)) else str(value)
    return ""


def _key_shown(frame: F.SemanticFrame) -> str:
    """The key of a frame's objects or place: what of an object is meant, else the choice that it belongs to."""
    aim = _AIM_KEYS.get(getattr(frame, "aim", ""), "")
    key: str = aim or getattr(frame, "relation", "") or getattr(frame, "cut", "")
    if key:
        return "" if key == "at" else key
    usual = "" if hasattr(frame, "objects") or F.name_of(frame) == "circle" else "at"
    return "to" if isinstance(frame, F.Extend) else usual


def _amount_shown(frame: F.SemanticFrame, slot: str, q: F.Quantity) -> str:
    if slot == "angle":
        return _number(q)
    if slot != main_slot(type(frame)):
        return f"{_KEYS.get(slot, slot)}={_number(q)}"
    merge = "merge" if getattr(frame, "change", "") == "merge" else ""
    return f"{getattr(frame, 'cut', '') or merge or q.role}={_number(q)}"


def _parts_shown(part: PathPart) -> Iterator[str]:
    if part.kind == "both":
        for inner in part.parts:
            yield from _parts_shown(inner)
    elif part.kind == "outside":
        yield from ("@!" + word[1:] for word in _parts_shown(part.parts[0]))
    elif part != WHOLE:
        yield f"@{_where_shown(where_of(part))}"


def _where_shown(where: Where) -> str:
    much = _number(where.amount) if where.amount else ""
    match where.kind:
        case "from":
            return f"after={much}"
        case "range" if where.until:
            return f"range={much.rstrip('wpms%')}-{_number(where.until).removesuffix('wp')}"
        case "every":
            return f"every={much.removesuffix('wp')}"
        case "heading":
            return f"heading={where.direction}"
        case "beyond":
            return f"beyond={where.direction},{_number(_from_ground(where.direction, where.amount))}"
    told = ",".join(filter(None, (_joined(where.places), much)))
    return f"{where.kind}={told}".removesuffix("=")


def _edit_shown(edit: E.Edit) -> str:
    match edit:
        case E.Also(frame=frame):
            return f"also {_frame_shown(frame)}"
        case E.Command(command=command, steps=steps):
            return command if steps == 1 else f"{command} {steps}"
        case E.Drop(on=what):
            return f"drop {what}".rstrip()
    on = f"on={_joined([edit.on])}" if edit.on else ""
    return " ".join(filter(None, (edit.NAME, *_change_shown(edit), on)))


def _change_shown(edit: E.Edit) -> Sequence[str]:
    """What an edit asks for of the frame that it is about."""
    match edit:
        case E.Rescale(change=change, factor=factor, degree=degree):
            return change if factor is None else f"{factor:.6g}x", f"deg={degree}" if degree else ""
        case E.Set(slot=slot, quantity=q, step=step):
            return (f"{_KEYS.get(slot, slot)}={ {1: '+', -1: '-', 0: ''}[step] }{_number(q).lstrip('+-')}",)
        case E.Replace(direction=direction, objects=names, end=end):
            return (direction or end or f"obj={_joined(names)}",)
        case E.Restrict(part=part) | E.Except(part=part):
            return tuple(_parts_shown(part)) or ("@whole",)
    return ()
