"""Frames and edits as atoms: one choice per head, and the amounts and objects that the network points at.

A frame with several directions is several atoms; `frames_of` joins them again.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from dataclasses import MISSING, dataclass, field, replace
from typing import Any

from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.editing import scale_of
from ovita.instruct.frames import name_of
from ovita.instruct.notation import DIRECTIONS, EDITS, FRAMES
from ovita.paths.part import WHOLE, PathPart, outside

COMMANDS = ("undo", "redo", "restart", "accept", "explain")
TRAINED = (
    "move", "end", "closer", "farther", "clearance", "via", "side", "pace", "keep", "stop", "wait", "extend", "smooth",
    "waypoints", "circle", "spiral", "eight", "zigzag", "wave", "shake", "hop", "hover", "mirror", "rotate", "tilt",
    "resize", "curve", "straighten", "height", "bound", "reverse", "return", "trim", "quadrant",
)  # fmt: skip
"""The frames that the network was trained on, in the order of its classes; the rules alone read any other."""
ACTIONS = ("none", "ask", "improper", *TRAINED, *(name for name in EDITS if name != "also"))
CHOICES: dict[str, tuple[str, ...]] = {
    "pace": ("faster", "slower", "set", "cap", "floor", "constant", "rampup", "rampdown", "turns", "accelerate",
             "brake"),
    "keep": ("start", "goal", "ends", "speed", "path", "height", "rest", "part"),
    "end": ("start", "goal", "ends"),
    "waypoints": ("to", "by", "more", "fewer", "merge"),
    "resize": ("", "larger", "smaller"),
    "curve": ("more", "less"),
    "trim": ("first", "last", "before", "after"),
    "mirror": ("left", "front", "up", "x", "y", "z"),
    "scale": ("", "more", "less"),
    "set": ("by", "to", "at_least", "at_most", "at", "of", "duration", "radius", "size", "turns", "waves", "rise",
            "angle", "within", "direction"),
    "replace": ("direction", "objects", "end"),
    "quadrant": ("1", "2", "3", "4"),
    "improper": ("unrelated", "object", "contradiction", "nonsense"),
    "ask": ("which", "where", "how much", "what"),
}  # fmt: skip
"""What the choice of each action is among."""

RELATIONS = ("", "to", "toward", "away", "over", "under", "between")
PARTS = (
    "whole", "near", "first", "last", "middle", "between", "after", "before", "range", "from", "upto", "rising",
    "falling", "every", "beyond", "turns", "selection",
)  # fmt: skip
HEADS: dict[str, tuple[str, ...]] = {
    "action": ACTIONS,
    "choice": tuple(dict.fromkeys(["", *(word for words in CHOICES.values() for word in words)])),
    "relation": RELATIONS,
    "direction": ("", *DIRECTIONS),
    "role": ("by", "to", "at", "at_least", "at_most"),
    "degree": ("", "slight", "large"),
    "sense": ("", "cw", "ccw"),
    "spot": ("", "object", "start", "goal", "middle", "amount", "objects"),
    "part": PARTS,
    "outside": ("", "outside"),
    "place": ("", "object", "start", "goal"),
    "toward": ("", *DIRECTIONS),
    "step": ("0", "1", "-1"),
    "on": ("", *TRAINED),
}
"""Every head of the network with its classes: `spot` is the place of the frame, `place` and `toward` are the part's."""

AMOUNTS = ("amount", "duration", "radius", "size", "turns", "rise", "spot", "part", "until")
OBJECTS = ("objects1", "objects2", "objects3", "places1", "places2", "places3")
POINTERS = (*AMOUNTS, *OBJECTS)
"""What each atom may point at: amounts, the objects of the frame, the objects of its part of the path."""

_MAIN = ("amount", "distance", "by", "level", "angle")
_SLOT_OF = {
    **dict.fromkeys(_MAIN, "amount"), "duration": "duration", "radius": "radius", "size": "size", "turns": "turns",
    "waves": "turns", "rise": "rise",
}  # fmt: skip
CHOOSING = ("change", "what", "end", "cut", "axis", "number")
PLACES = ("place", "about", "of")


class Unfit(ValueError):
    """Something that atoms cannot say."""


@dataclass(frozen=True)
class Atom:
    """A frame with at most one direction, or an edit.

    Args:
        labels: Head to class; a head that is missing has its first class.
        amounts: Pointer to quantity.
        objects: The frame's objects.
        places: The objects of its part of the path.
    """

    labels: dict[str, str] = field(default_factory=dict)
    amounts: dict[str, F.Quantity] = field(default_factory=dict)
    objects: tuple[str, ...] = ()
    places: tuple[str, ...] = ()

    def label(self, head: str) -> str:
        """The class of a head."""
        return self.labels.get(head, HEADS[head][0])


def atoms_of(items: Iterable[F.SemanticFrame | E.Edit]) -> tuple[Atom, ...]:
    """Frames and edits as atoms.

    Raises:
        Unfit: If atoms cannot say one of them.
    """
    return tuple(
        atom
        for item in items
        for atom in (_frame_atoms(item) if isinstance(item, F.SemanticFrame) else _edit_atoms(item))
    )


def _frame_atoms(frame: F.SemanticFrame) -> list[Atom]:
    value: Any = frame
    labels = {"action": name_of(frame), "degree": frame.degree if frame.degree in HEADS["degree"] else ""}
    said = {slot: getattr(value, slot) for slot in value.__dataclass_fields__ if getattr(value, slot) is not None}
    amounts = {to: said[slot] for slot, to in _SLOT_OF.items() if isinstance(said.get(slot), F.Quantity)}
    if "amount" in amounts:
        labels["role"] = amounts["amount"].role
    labels["choice"] = next((str(said[slot]) for slot in CHOOSING if slot in said), "")
    labels |= {slot: said[slot] for slot in ("relation", "direction", "sense") if said.get(slot, "at") != "at"}
    if isinstance(frame, F.Approach):
        labels["sense"] = ""
    if isinstance(frame, F.Pace) and frame.amount and frame.amount.value < 0:
        labels["choice"] = "brake"
        amounts["amount"] = _positive(frame.amount)
    objects: tuple[str, ...] = said.get("objects", ())
    for slot in PLACES:
        objects += _spot(said.get(slot, ""), labels, amounts)
    labels, places = _part_atoms(frame.part, labels, amounts)
    if len(objects) > 3:
        raise Unfit("more than three objects")
    atom = Atom(labels, amounts, objects, places)
    return [_directed(atom, direction, quantity) for direction, quantity in said.get("offset", ())] or [atom]


def _positive(quantity: F.Quantity) -> F.Quantity:
    return replace(quantity, value=abs(quantity.value), said=quantity.said.lstrip("-"))


def _directed(atom: Atom, direction: str, quantity: F.Quantity | None) -> Atom:
    if quantity is not None and quantity.value < 0:
        direction = direction[1:] if direction[0] == "-" else f"-{direction}" if direction in "xyz" else direction
        quantity = _positive(quantity)
    more = {} if quantity is None else {"amount": quantity}
    return replace(atom, labels=atom.labels | {"direction": direction}, amounts=atom.amounts | more)


def _spot(place: F.Place, labels: dict[str, str], amounts: dict[str, F.Quantity]) -> tuple[str, ...]:
    if isinstance(place, F.Quantity):
        labels["spot"] = "amount"
        amounts["spot"] = place
        return ()
    if isinstance(place, tuple):
        labels["spot"] = "objects"
        return place
    if place:
        labels["spot"] = place if place in F.SPOTS else "object"
    return (place,) if labels.get("spot") == "object" and place else ()


def _part_atoms(
    part: PathPart, labels: dict[str, str], amounts: dict[str, F.Quantity]
) -> tuple[dict[str, str], tuple[str, ...]]:
    if part.kind == "outside":
        labels["outside"] = "outside"
        part = part.parts[0]
    part = F.canonical_part(part)
    labels["part"] = kind = _kind(part)
    if kind not in PARTS:
        raise Unfit(f"a part that is {kind}")
    unit = "m" if kind in ("near", "beyond") else {"share": "%"}.get(part.unit, str(part.unit))
    one = 1 if kind in ("range", "from") and unit == "waypoints" else 0
    for name, value in (("part", part.amount), ("until", part.until)):
        if value is not None and (value or kind != "beyond"):
            amounts[name] = F.Quantity(value + one, unit)
    if kind == "beyond":
        labels["toward"] = part.direction
    return labels, _part_places(part, labels)


def _kind(part: PathPart) -> str:
    match part:
        case PathPart(kind="either", parts=parts) if all(inner.kind == "near" for inner in parts):
            return "near"
        case PathPart(kind="heading", direction="up" | "down" as direction):
            return "rising" if direction == "up" else "falling"
        case PathPart(kind="range", until=None):
            return "from"
    return {"indices": "selection"}.get(part.kind, part.kind)


def _part_places(part: PathPart, labels: dict[str, str]) -> tuple[str, ...]:
    places: tuple[Any, ...] = part.places or tuple(inner.places[0] for inner in part.parts if inner.places)
    if len(places) == 1 and places[0] in ("start", "goal"):
        labels["place"] = places[0]
        return ()
    if len(places) == 1 and isinstance(places[0], dict):
        places = tuple(places[0]["between"])
    if len(places) > 3 or any(not isinstance(p, str) or p in F.SPOTS for p in places):
        raise Unfit("places of a part")
    labels["place"] = "object" if places else ""
    return places


def _edit_atoms(edit: E.Edit) -> list[Atom]:
    if isinstance(edit, E.Also):
        return _frame_atoms(edit.frame)
    value: Any = edit
    on = edit.on if edit.on in TRAINED else ""
    labels = {"action": value.command if isinstance(edit, E.Command) else edit.NAME, "on": on}
    amounts: dict[str, F.Quantity] = {}
    places: tuple[str, ...] = ()
    objects: tuple[str, ...] = ()
    match edit:
        case E.Rescale(change=change, factor=factor, degree=degree):
            labels |= {"choice": change, "degree": degree or ""}
            if factor is not None:
                amounts["amount"] = F.Quantity(factor, "x", said=f"{factor:g}x")
        case E.Set(slot=slot, quantity=quantity, step=step):
            labels |= {"choice": slot, "step": str(step)}
            if slot in DIRECTIONS:
                labels |= {"choice": "direction", "direction": slot}
            elif slot not in CHOICES["set"]:
                raise Unfit(f"set {slot}")
            amounts["amount"] = quantity
        case E.Replace(direction=direction, objects=objects, end=end):
            labels |= {"direction": direction or "", "spot": end or ""}
            labels["choice"] = "direction" if direction else "end" if end else "objects"
        case E.Restrict(part=part) | E.Except(part=part):
            labels, places = _part_atoms(part, labels, amounts)
        case E.Command(steps=steps) if steps > 1:
            amounts["amount"] = F.Quantity(float(steps))
    return [Atom(labels, amounts, objects, places)]


_BARE = {
    ("rotate", ""): "deg",
    ("tilt", ""): "deg",
    **{("trim", cut): "waypoints" for cut in CHOICES["trim"]},
    **{("pace", change): "m/s" for change in ("set", "cap", "floor", "rampup", "rampdown")},
    **{("pace", change): "m/s2" for change in ("accelerate", "brake")},
}
"""The unit of a number without one, by action and choice."""


def _unit(atom: Atom, pointer: str, quantity: F.Quantity) -> F.Quantity:
    """The quantity with the unit that its slot implies where the sentence names none, and in the units of its slot."""
    action, choice = atom.label("action"), atom.label("choice")
    unit = quantity.unit
    if pointer == "turns" or (pointer in ("rise", "size", "radius") and unit == "x"):
        return replace(quantity, unit="")
    if pointer == "spot":
        return replace(quantity, unit=unit or "waypoints")
    if pointer != "amount":
        return quantity
    implied = _BARE.get((action, choice), _BARE.get((action, ""), ""))
    if implied == "m/s" and unit == "m":
        unit = "m/s"
    if (action, choice, unit) == ("waypoints", "to", "waypoints"):
        return replace(quantity, unit="")
    return replace(quantity, unit=unit or implied)


def items_of(atoms: Sequence[Atom], previous: Sequence[F.SemanticFrame] = ()) -> tuple[F.SemanticFrame | E.Edit, ...]:
    """The frames and edits that atoms say; the directions of neighbouring atoms are joined.

    Raises:
        Unfit: If an atom lacks what its frame needs.
    """
    found: list[F.SemanticFrame | E.Edit] = []
    for atom in atoms:
        action = atom.label("action")
        item: Any = _frame(atom) if action in FRAMES else _edit(atom, previous)
        last: Any = found[-1] if found else None
        if type(last) is type(item) and _joins(last, item):
            found[-1] = replace(last, offset=last.offset + item.offset)
        else:
            found.append(item)
    return tuple(found)


def _joins(last: Any, item: Any) -> bool:
    """Whether two frames differ by nothing but their directions."""
    if not getattr(item, "offset", ()) or not last.offset or replace(last, offset=item.offset) != item:
        return False
    return not {direction for direction, _ in last.offset} & {direction for direction, _ in item.offset}


def _place(atom: Atom) -> F.Place:
    spot = atom.label("spot")
    if spot == "amount" and "spot" in atom.amounts:
        return _unit(atom, "spot", replace(atom.amounts["spot"], role="at"))
    if spot == "objects" and len(atom.objects) >= 2:
        return atom.objects[0], atom.objects[1]
    if spot in F.SPOTS:
        return spot
    return atom.objects[0] if spot == "object" and atom.objects else ""


def _frame(atom: Atom) -> F.SemanticFrame:
    action, choice = atom.label("action"), atom.label("choice")
    kind = FRAMES[action]
    known = kind.__dataclass_fields__
    slots: dict[str, Any] = {slot: choice for slot in CHOOSING if slot in known}
    slots |= {slot: atom.label(slot) for slot in ("direction", "relation") if slot in known}
    slots |= {name: _place(atom) for name in PLACES if name in known}
    slots |= {"objects": atom.objects} if "objects" in known else {}
    slots |= {"sense": atom.label("sense") or None} if "sense" in known else {}
    slots |= {"part": part_of(atom), "degree": atom.label("degree") or None}
    slots |= _particular(kind, action, choice, slots) | _amounts(atom, kind, known)
    _check(kind, slots)
    return kind(**slots)


def _amounts(atom: Atom, kind: type[F.SemanticFrame], known: Container[str]) -> dict[str, Any]:
    """The quantities of a frame by slot, and its offset."""
    found: dict[str, Any] = {}
    for name in ("duration", "radius", "size", "turns", "rise"):
        slot = "waves" if name == "turns" and atom.label("action") == "wave" else name
        if slot in known and name in atom.amounts:
            found[slot] = _unit(atom, name, atom.amounts[name])
    main, direction = _main_amount(atom, kind), atom.label("direction")
    if "offset" in known:
        found["offset"] = ((direction, main),) if direction else ()
        main = None if direction else main
    target = next((slot for slot in _MAIN if slot in known), "")
    return found | ({target: main} if target and main is not None else {})


def _particular(kind: type[F.SemanticFrame], action: str, choice: str, slots: dict[str, Any]) -> dict[str, Any]:
    """What single kinds of frames call otherwise."""
    particular: dict[Any, dict[str, Any]] = {
        F.Figure: {"shape": action},
        F.Approach: {"sense": action},
        F.Quadrant: {"number": int(choice) if choice.isdigit() else 1},
        F.Visit: {"relation": slots.get("relation") or "at"},
        F.Pace: {"change": "accelerate" if choice == "brake" else choice},
    }
    return particular.get(kind, {})


_ROLES = {
    "pace": {"cap": "at_most", "floor": "at_least", "set": "to"},
    "waypoints": {"to": "to"},
}
_WITH_ROLE = (F.Clearance, F.Height, F.Pace, F.Visit, F.Approach)


def _main_amount(atom: Atom, kind: type[F.SemanticFrame]) -> F.Quantity | None:
    if "amount" not in atom.amounts:
        return None
    quantity = _unit(atom, "amount", atom.amounts["amount"])
    choice = atom.label("choice")
    role: Any = _ROLES.get(kind.NAME, {}).get(choice, atom.label("role") if kind in _WITH_ROLE else "by")
    value = -quantity.value if kind is F.Pace and choice == "brake" else quantity.value
    return replace(quantity, role=role, value=value)


def _check(kind: type[F.SemanticFrame], slots: dict[str, Any]) -> None:
    """Refuse a frame that lacks what it needs."""
    for slot in ("objects", "distance", "level", "direction"):
        needed = slot in kind.__dataclass_fields__ and kind.__dataclass_fields__[slot].default is MISSING
        if needed and not slots.get(slot):
            raise Unfit(f"{kind.NAME} without {slot}")
    if kind in (F.Shift, F.Bound) and not slots["offset"]:
        raise Unfit(f"{kind.NAME} without a direction")
    if kind is F.MoveEnd and not slots["offset"] and not (slots["relation"] and slots["place"]):
        raise Unfit("an end without a direction or a place")
    if slots.get("relation") == "between" and len(slots["objects"]) != 2:
        raise Unfit("between needs two objects")


def part_of(atom: Atom) -> PathPart:
    """The part of the path that an atom is about.

    Raises:
        Unfit: If what the part needs is not pointed at.
    """
    kind = atom.label("part")
    if kind == "whole":
        return WHOLE
    part = _inner(kind, atom)
    return outside(part) if atom.label("outside") else part


def _inner(kind: str, atom: Atom) -> PathPart:
    place = atom.label("place")
    places: tuple[Any, ...] = (place,) if place in ("start", "goal") else atom.places
    if kind in ("near", "between", "after", "before"):
        if not places or (kind == "between" and len(places) == 1 and not place):
            raise Unfit(f"{kind} what")
        return _at_places(kind, places, atom.amounts.get("part"))
    if kind in ("rising", "falling"):
        return PathPart("heading", direction="up" if kind == "rising" else "down")
    if kind == "selection":
        return PathPart("indices")
    return _measured(kind, atom)


def _at_places(kind: str, places: tuple[Any, ...], within: F.Quantity | None) -> PathPart:
    if kind == "between":
        return PathPart(kind, places[:2])
    if kind == "near":
        inner = tuple(PathPart("near", (name,), within.value if within else None) for name in places)
        return inner[0] if len(inner) == 1 else PathPart("either", parts=inner)
    return PathPart(kind, ({"between": list(places[:2])} if len(places) == 2 else places[0],))


def _measured(kind: str, atom: Atom) -> PathPart:
    amount, until = atom.amounts.get("part"), atom.amounts.get("until")
    value = None if amount is None else amount.value
    unit: Any = {"%": "share", "x": "share", "m": "m", "s": "s"}.get(amount.unit if amount else "%", "waypoints")
    if kind in ("range", "from"):
        if value is None or (kind == "range" and until is None):
            raise Unfit("a range without its ends")
        one = 1 if unit == "waypoints" else 0
        return PathPart("range", amount=value - one, until=None if until is None else until.value - one, unit=unit)
    if kind == "every":
        return PathPart("every", amount=value or 2)
    if kind == "beyond":
        return PathPart("beyond", amount=value or 0.0, direction=atom.label("toward") or "up")
    return PathPart(kind, amount=value, unit=unit if value is not None or kind in ("first", "last") else "waypoints")


def _edit(atom: Atom, previous: Sequence[F.SemanticFrame]) -> E.Edit:
    action, on = atom.label("action"), atom.label("on")
    amount = atom.amounts.get("amount")
    if action in COMMANDS:
        command: Any = action
        return E.Command(command=command, steps=int(amount.value) if amount and amount.value >= 1 else 1)
    plain = {"flip": E.Flip, "drop": E.Drop, "again": E.Again}.get(action)
    if plain is not None:
        return plain(on=on)
    if action in ("restrict", "except"):
        part = part_of(atom)
        if not part:
            raise Unfit("which part")
        return E.Restrict(on=on, part=part) if action == "restrict" else E.Except(on=on, part=part)
    if action == "scale":
        change: Any = atom.label("choice")
        degree: Any = atom.label("degree") or None
        return E.Rescale(on=on, change=change, factor=amount.value if amount else None, degree=degree)
    return _set(atom, on, amount, previous) if action == "set" else _replace(atom, on)


def _set(atom: Atom, on: str, amount: F.Quantity | None, previous: Sequence[F.SemanticFrame]) -> E.Set:
    if amount is None:
        raise Unfit("set to what")
    choice, direction = atom.label("choice"), atom.label("direction")
    slot = direction if choice == "direction" and direction else choice
    role: Any = slot if slot in HEADS["role"] else "by"
    step: Any = int(atom.label("step"))
    return E.Set(on=on, slot=slot, quantity=replace(_inherited(amount, previous, slot), role=role), step=step)


def _replace(atom: Atom, on: str) -> E.Replace:
    choice, end, direction = atom.label("choice"), atom.label("spot"), atom.label("direction")
    said: dict[str, Any] = {}
    if choice == "objects" and atom.objects:
        said["objects"] = atom.objects
    elif choice == "end" and end in ("start", "goal"):
        said["end"] = end
    elif direction:
        said["direction"] = direction
    else:
        raise Unfit("replace what")
    return E.Replace(on=on, **said)


def _inherited(amount: F.Quantity, previous: Sequence[F.SemanticFrame], slot: str) -> F.Quantity:
    """A bare number with the unit that the turn before it used: "make it 20" after "10cm" is 20 cm."""
    if amount.unit or slot in ("turns", "waves"):
        return amount
    known = [q for frame in reversed(previous) for q in [frame.quantities.get(slot), *frame.quantities.values()] if q]
    if not known:
        return amount
    return replace(amount, value=amount.value * scale_of(known[0]), unit=known[0].unit)
