"""Frames and edits as atoms: one choice per head, and the amounts and objects that the network points at.

A frame with several directions is several atoms; `frames_of` joins them again.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.notation import DIRECTIONS, EDITS, FRAMES, name_of
from ovita.paths.part import WHOLE, PathPart, outside

COMMANDS = ("undo", "redo", "restart", "accept", "explain")
ACTIONS = ("none", "ask", "improper", *FRAMES, *(name for name in EDITS if name != "also"))
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
    "on": ("", *FRAMES),
}
"""Every head of the network with its classes: `spot` is the place of the frame, `place` and `toward` are the part's."""

AMOUNTS = ("amount", "duration", "radius", "size", "turns", "rise", "spot", "part", "until")
OBJECTS = ("objects1", "objects2", "objects3", "places1", "places2", "places3")
POINTERS = (*AMOUNTS, *OBJECTS)
"""What each atom may point at: amounts, the objects of the frame, the objects of its part of the path."""

_SLOT_OF = {
    "duration": "duration",
    "radius": "radius",
    "size": "size",
    "turns": "turns",
    "waves": "turns",
    "rise": "rise",
}


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
    labels = {"action": name_of(frame), "degree": frame.degree or ""}
    if labels["degree"] == "moderate":
        labels["degree"] = ""
    amounts: dict[str, F.Quantity] = {}
    objects: tuple[str, ...] = tuple(getattr(frame, "objects", ()))
    for slot, to in _SLOT_OF.items():
        quantity = getattr(value, slot, None)
        if isinstance(quantity, F.Quantity):
            amounts[to] = quantity
    for slot in ("amount", "distance", "level", "by", "angle"):
        quantity = getattr(value, slot, None)
        if isinstance(quantity, F.Quantity):
            amounts["amount"] = quantity
            labels["role"] = quantity.role
    for slot in ("change", "what", "end", "cut", "axis", "number"):
        if hasattr(frame, slot):
            labels["choice"] = str(getattr(value, slot))
    for slot in ("relation", "direction", "sense"):
        said = getattr(value, slot, None)
        labels[slot] = "" if said in (None, "at") else str(said)
    if isinstance(frame, F.Pace) and frame.change == "accelerate" and frame.amount and frame.amount.value < 0:
        labels["choice"] = "brake"
        amounts["amount"] = replace(frame.amount, value=-frame.amount.value, said=frame.amount.said.lstrip("-"))
    for slot in ("place", "about", "of"):
        objects += _spot(getattr(value, slot, "") or "", labels, amounts)
    if isinstance(frame, F.Approach):
        labels["sense"] = ""
    labels, places = _part_atoms(frame.part, labels, amounts)
    if len(objects) > 3:
        raise Unfit("more than three objects")
    atom = Atom(labels, amounts, objects, places)
    offset: F.Offset = getattr(value, "offset", ())
    return [_directed(atom, direction, quantity) for direction, quantity in offset] or [atom]


def _directed(atom: Atom, direction: str, quantity: F.Quantity | None) -> Atom:
    if quantity is not None and quantity.value < 0:
        direction = direction[1:] if direction[0] == "-" else f"-{direction}" if direction in "xyz" else direction
        quantity = replace(quantity, value=-quantity.value, said=quantity.said.lstrip("-"))
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
    places: tuple[Any, ...] = part.places
    kind = part.kind
    if kind == "either" and all(inner.kind == "near" for inner in part.parts):
        kind, places = "near", tuple(inner.places[0] for inner in part.parts)
    elif kind == "heading":
        kind = {"up": "rising", "down": "falling"}[part.direction]
    elif kind == "indices":
        kind = "selection"
    elif kind == "range":
        kind = "from" if part.until is None else "range"
    if kind not in PARTS:
        raise Unfit(f"a part that is {kind}")
    labels["part"] = kind
    unit = {"share": "%", "waypoints": "waypoints"}.get(part.unit, part.unit)
    if kind in ("near", "beyond"):
        unit = "m"
    one = 1 if kind in ("range", "from") and unit == "waypoints" else 0
    if part.amount is not None and not (kind == "beyond" and not part.amount):
        amounts["part"] = F.Quantity(part.amount + one, unit)
    if part.until is not None:
        amounts["until"] = F.Quantity(part.until + one, unit)
    labels["toward"] = part.direction if kind == "beyond" else ""
    if len(places) == 1 and places[0] in ("start", "goal"):
        labels["place"], places = places[0], ()
    elif len(places) == 1 and isinstance(places[0], dict):
        places = tuple(places[0]["between"])
    labels["place"] = labels.get("place") or ("object" if places else "")
    if len(places) > 3 or any(not isinstance(p, str) or p in F.SPOTS for p in places):
        raise Unfit("places of a part")
    return labels, places


def _edit_atoms(edit: E.Edit) -> list[Atom]:
    if isinstance(edit, E.Also):
        return _frame_atoms(edit.frame)
    value: Any = edit
    on = edit.on if edit.on in FRAMES else ""
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


_BARE = {"rotate": "deg", "tilt": "deg", "trim": "waypoints"}
_SPEEDS = ("set", "cap", "floor", "rampup", "rampdown")


def _unit(atom: Atom, pointer: str, quantity: F.Quantity) -> F.Quantity:
    """The quantity with the unit that its slot implies where the sentence names none, and in the units of its slot."""
    action, choice = atom.label("action"), atom.label("choice")
    unit = quantity.unit
    if (pointer in ("turns", "rise", "size", "radius") and unit == "x") or pointer == "turns":
        unit = ""
    if pointer == "spot" and not unit:
        unit = "waypoints"
    if pointer == "amount" and not unit:
        unit = _BARE.get(action, "")
        if action == "pace":
            unit = "m/s" if choice in _SPEEDS else "m/s2" if choice in ("accelerate", "brake") else ""
    if pointer == "amount" and action == "waypoints" and unit == "waypoints" and choice == "to":
        unit = ""
    if pointer == "amount" and action == "pace" and choice in ("set", "cap", "floor") and unit == "m":
        unit = "m/s"
    return replace(quantity, unit=unit)


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
    main = _main_amount(atom, kind)
    slots: dict[str, Any] = {"part": part_of(atom), "degree": atom.label("degree") or None}
    slots |= {slot: choice for slot in ("change", "what", "end", "cut", "axis") if slot in known}
    slots |= {name: _place(atom) for name in ("place", "about", "of") if name in known}
    slots |= {slot: atom.label(slot) for slot in ("direction", "relation") if slot in known}
    for name in ("duration", "radius", "size", "turns", "rise"):
        if name in known and name in atom.amounts:
            slots["waves" if name == "turns" and action == "wave" else name] = _unit(atom, name, atom.amounts[name])
    if "sense" in known:
        slots["sense"] = atom.label("sense") or None
    if "objects" in known:
        slots["objects"] = atom.objects
    slots |= _particular(kind, action, choice, slots)
    target = next((slot for slot in ("amount", "distance", "level", "by", "angle") if slot in known), "")
    if "offset" in known:
        direction: Any = atom.label("direction")
        slots["offset"] = ((direction, main),) if direction else ()
        target = "" if direction else target
    if target and main is not None:
        slots[target] = main
    _check(kind, slots)
    return kind(**slots)


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
        if slot in kind.__dataclass_fields__ and not slots.get(slot):
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
    action, on, choice = atom.label("action"), atom.label("on"), atom.label("choice")
    amount = atom.amounts.get("amount")
    degree: Any = atom.label("degree") or None
    direction: Any = atom.label("direction") or None
    part: Any = None
    if action in COMMANDS:
        command: Any = action
        return E.Command(command=command, steps=int(amount.value) if amount and amount.value >= 1 else 1)
    match action:
        case "scale":
            change: Any = choice
            return E.Rescale(on=on, change=change, factor=amount.value if amount else None, degree=degree)
        case "set":
            if amount is None:
                raise Unfit("set to what")
            slot = direction if choice == "direction" and direction else choice
            role: Any = slot if slot in ("by", "to", "at", "at_least", "at_most", "of") else "by"
            step: Any = int(atom.label("step"))
            return E.Set(on=on, slot=slot, quantity=replace(_inherited(amount, previous), role=role), step=step)
        case "flip":
            return E.Flip(on=on)
        case "replace":
            if choice == "objects" and atom.objects:
                return E.Replace(on=on, objects=atom.objects)
            end: Any = atom.label("spot")
            if choice == "end" and end in ("start", "goal"):
                return E.Replace(on=on, end=end)
            if direction:
                return E.Replace(on=on, direction=direction)
        case "restrict" | "except":
            part = part_of(atom)
            if part:
                return E.Restrict(on=on, part=part) if action == "restrict" else E.Except(on=on, part=part)
        case "drop":
            return E.Drop(on=on)
        case "again":
            return E.Again(on=on)
    raise Unfit(action)


def _inherited(amount: F.Quantity, previous: Sequence[F.SemanticFrame]) -> F.Quantity:
    """A bare number with the unit that the turn before it used: "make it 20" after "10cm" is 20 cm."""
    if amount.unit:
        return amount
    for frame in reversed(previous):
        for quantity in frame.quantities.values():
            said = quantity.said.lstrip("~+-")
            number = said.rstrip("abcdefghijklmnopqrstuvwxyz%/^2") if said else ""
            try:
                factor = quantity.value / float(number) if number and float(number) else 1.0
            except ValueError:
                factor = 1.0
            return replace(amount, value=amount.value * factor, unit=quantity.unit)
    return amount
