"""Frames and edits as atoms: one choice per head, and the amounts and objects that the network points at.

A frame with several directions is several atoms; `items_of` joins them again. The way there, which only training needs,
is `training/atoms.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import MISSING, dataclass, field, fields, replace
from typing import Any, TypeAlias

from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.editing import scale_of
from ovita.instruct.notation import COMMANDS, DIRECTIONS, EDITS, FRAMES, Where, main_slot, part_told
from ovita.paths.part import WHOLE, PathPart, outside

TRAINED = (
    "move", "end", "closer", "farther", "clearance", "via", "side", "pace", "keep", "stop", "wait", "extend", "smooth",
    "waypoints", "circle", "spiral", "eight", "zigzag", "wave", "shake", "hop", "hover", "mirror", "rotate", "tilt",
    "resize", "curve", "straighten", "height", "bound", "reverse", "return", "trim", "quadrant", "avoid",
    "level", "nonstop", "arrive",
)  # fmt: skip
"""The frames that the network was trained on, in the order of its classes."""
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
    "improper": ("unrelated", "object", "contradiction", "nonsense", "cannot", "question"),
    "ask": ("which", "where", "how much", "what"),
    **dict.fromkeys(("undo", "redo"), ("", "2", "3", "4")),
}  # fmt: skip
"""What the choice of each action is among."""

TURNS = ("turn 1", "turn 2", "turn 3", "turn 4")
"""What is given up where a turn is told by its number."""

RELATIONS = ("", "to", "toward", "away", "over", "under", "between")
PARTS = (
    "whole", "near", "first", "last", "middle", "between", "after", "before", "range", "from", "upto", "rising",
    "falling", "every", "beyond", "turns", "selection",
)  # fmt: skip
HEADS: dict[str, tuple[str, ...]] = {
    "action": ACTIONS,
    "choice": tuple(dict.fromkeys(["", *(word for words in CHOICES.values() for word in words)])),
    "relation": RELATIONS,
    "direction": ("", *DIRECTIONS, "other"),
    "role": ("by", "to", "at", "at_least", "at_most"),
    "degree": ("", "slight", "large"),
    "sense": ("", "cw", "ccw"),
    "spot": ("", "object", "start", "goal", "middle", "amount", "objects"),
    "part": PARTS,
    "outside": ("", "outside"),
    "place": ("", "object", "start", "goal"),
    "toward": ("", *DIRECTIONS),
    "step": ("0", "1", "-1"),
    "on": ("", *TRAINED, *DIRECTIONS, *TURNS),
}
"""Every head of the network with its classes: `spot` is the place of the frame, `place` and `toward` are the part's."""

AMOUNTS = ("amount", "duration", "radius", "size", "turns", "rise", "spot", "part", "until")
OBJECTS = ("objects1", "objects2", "objects3", "places1", "places2", "places3")
POINTERS = (*AMOUNTS, *OBJECTS)
"""What each atom may point at: amounts, the objects of the frame, the objects of its part of the path."""

CHOOSING = ("change", "what", "end", "cut", "axis", "number")


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


def items_of(atoms: Sequence[Atom], previous: Sequence[F.SemanticFrame] = ()) -> tuple[F.SemanticFrame | E.Edit, ...]:
    """The frames and edits that atoms say; the directions of neighbouring atoms are joined.

    Raises:
        Unfit: If an atom lacks what its frame needs.
    """
    found: list[F.SemanticFrame | E.Edit] = []
    for atom in (one for several in atoms for one in _at_each(several)):
        item: Any = _frame(atom) if atom.label("action") in FRAMES else _edit(atom, previous)
        last: Any = found[-1] if found else None
        if type(last) is type(item) and _joins(last, item):
            found[-1] = replace(last, offset=last.offset + item.offset)
        else:
            found.append(item)
    return tuple(found)


def _at_each(atom: Atom) -> list[Atom]:
    """An atom about one place, for each of the objects at which it is: "wait 2 s at each room"."""
    if atom.label("action") not in DONE_AT or atom.label("spot") != "object" or len(atom.objects) < 2:
        return [atom]
    return [replace(atom, objects=(name,)) for name in atom.objects]


DONE_AT = ("wait", "circle", "spiral", "eight", "zigzag", "wave", "shake")
"""What is done at one place, and at each of several."""


def _joins(last: Any, item: Any) -> bool:
    """Whether two frames differ by nothing but their directions."""
    if not getattr(item, "offset", ()) or not last.offset or replace(last, offset=item.offset) != item:
        return False
    return not {direction for direction, _ in last.offset} & {direction for direction, _ in item.offset}


def _frame(atom: Atom) -> F.SemanticFrame:
    action, choice = atom.label("action"), atom.label("choice")
    kind = FRAMES[action]
    said: dict[str, Any] = {
        **dict.fromkeys(CHOOSING, "accelerate" if choice == "brake" else choice),
        **dict.fromkeys(F.PLACES, _place(atom)),
        "number": int(choice) if choice.isdigit() else 1,
        "shape": action,
        "sense": action if kind is F.Approach else atom.label("sense") or None,
        "relation": atom.label("relation") or ("at" if kind is F.Visit else ""),
        "direction": atom.label("direction"),
        "objects": atom.objects,
        "part": part_of(atom),
        "degree": atom.label("degree") or None,
        "longer": atom.label("step") == "1",
        "upright": atom.label("direction") == "up",
        **_amounts(atom, kind),
    }
    slots = {slot.name: said[slot.name] for slot in fields(kind) if slot.name in said}
    _check(kind, slots)
    return kind(**slots)


def _place(atom: Atom) -> F.Place:
    spot = atom.label("spot")
    if spot == "amount" and "spot" in atom.amounts:
        quantity = atom.amounts["spot"]
        return replace(quantity, role="at", unit=quantity.unit or "waypoints")
    if spot == "objects" and len(atom.objects) >= 2:
        return atom.objects[0], atom.objects[1]
    if spot in F.SPOTS:
        return spot
    return atom.objects[0] if spot == "object" and atom.objects else ""


def _turned(quantity: F.Quantity) -> F.Quantity:
    return replace(quantity, value=-quantity.value, said="")


def _sizes(atom: Atom) -> dict[str, F.Quantity]:
    """How long a wait is, and how large a figure."""
    found: dict[str, F.Quantity] = {}
    for pointer in ("duration", "radius", "size", "turns", "rise"):
        quantity = atom.amounts.get(pointer)
        if quantity is not None:
            counted = pointer == "turns" or (pointer != "duration" and quantity.unit == "x")
            slot = "waves" if pointer == "turns" and atom.label("action") in ("wave", "zigzag") else pointer
            found[slot] = replace(quantity, unit="", said="") if counted else quantity
    return found


def _amounts(atom: Atom, kind: type[F.SemanticFrame]) -> dict[str, Any]:
    """The quantities of a frame by slot, and its offset."""
    found: dict[str, Any] = {**_sizes(atom)}
    main, direction = _main_amount(atom, kind), atom.label("direction")
    if atom.label("step") == "-1" and kind not in INVERTED:
        main, found = main and _turned(main), {slot: _turned(q) if slot == "rise" else q for slot, q in found.items()}
    if direction and "offset" in kind.__dataclass_fields__:
        return found | {"offset": ((direction, main),)}
    if kind is F.MoveEnd and not atom.label("relation"):  # an end that goes no way goes to a height
        level = main or (F.Quantity(0.0, "m") if atom.label("spot") == "object" else None)
        return found | {"offset": (), "level": level and replace(level, role="to")}
    return found | {"offset": (), main_slot(kind): main}


_IMPLIED = {
    ("rotate", ""): "deg",
    ("tilt", ""): "deg",
    **{("trim", cut): "waypoints" for cut in CHOICES["trim"]},
    **{("pace", change): "m/s" for change in ("set", "cap", "floor", "rampup", "rampdown")},
    **{("pace", change): "m/s2" for change in ("accelerate", "brake")},
}
"""The unit of a number without one, by action and choice."""

_ROLES: dict[tuple[str, str], F.Role] = {
    ("pace", "cap"): "at_most", ("pace", "floor"): "at_least", ("pace", "set"): "to", ("waypoints", "to"): "to",
}  # fmt: skip
_AT_NONE = (F.Clearance, F.Height)
"""Frames whose distance is none where none is said: not to touch a thing, or as high as it."""

INVERTED = (F.Pace, F.Resample)
"""Frames whose amount may be said as what the time or the number is divided by: "half the time", "thinned by two"."""

_WITH_ROLE = (F.Clearance, F.Height, F.Pace, F.Visit, F.Approach)


def _main_amount(atom: Atom, kind: type[F.SemanticFrame]) -> F.Quantity | None:
    """How much, in the unit that is implied where the sentence names none, and in the role that it plays."""
    quantity, choice = atom.amounts.get("amount"), atom.label("choice")
    if quantity is None and kind in _AT_NONE:
        if not atom.objects:
            raise Unfit("How high is that, in metres")
        quantity = F.Quantity(0.0, "m")
    if quantity is None:
        return None
    said = (kind.NAME, choice)
    role: Any = _ROLES.get(said, atom.label("role") if kind in _WITH_ROLE else "by")
    if kind in INVERTED and atom.label("step") == "-1" and quantity.value:
        quantity = replace(quantity, value=round(1.0 / quantity.value, 2), unit="x", said="")
    quantity = _turned(quantity) if said == ("pace", "brake") else quantity
    return replace(_in_implied_unit(quantity, said), role=role)


def _in_implied_unit(quantity: F.Quantity, said: tuple[str, str]) -> F.Quantity:
    """An amount in the unit that its action and choice imply, where it has none, or a speed in metres."""
    implied = _IMPLIED.get(said, _IMPLIED.get((said[0], ""), ""))
    unit = "m/s" if (quantity.unit, implied) == ("m", "m/s") else quantity.unit or implied
    number = "" if unit != quantity.unit else quantity.said
    return replace(quantity, said=number, unit="" if (*said, unit) == ("waypoints", "to", "waypoints") else unit)


def _check(kind: type[F.SemanticFrame], slots: dict[str, Any]) -> None:
    """Refuse a frame that lacks what it needs."""
    for slot in fields(kind):
        if slot.default is MISSING and not slots[slot.name] and slot.name not in CHOOSING:
            raise Unfit("which object is meant" if slot.name == "objects" else "how much is meant")
    told = slots.get("level") or (slots.get("relation") and slots.get("place"))
    if kind is F.MoveEnd and not slots["offset"] and not told:
        raise Unfit("which way or to which place should the end go")
    if slots.get("relation") == "between" and len(slots["objects"]) != 2:
        raise Unfit("between which two objects")


def part_of(atom: Atom) -> PathPart:
    """The part of the path that an atom is about.

    Raises:
        Unfit: If what the part needs is not pointed at.
    """
    kind, place = atom.label("part"), atom.label("place")
    if kind == "whole":
        return WHOLE
    if kind == "between" and place in ("start", "goal") and atom.places:  # "between the cup and the goal"
        kind, place = ("after" if place == "goal" else "before"), "object"
    amount, until = _from_where_to_where(atom, kind)
    part = part_told(Where(kind, _places_of(atom, kind, place), amount, until, atom.label("toward") or "up"))
    return outside(part) if atom.label("outside") else part


def _from_where_to_where(atom: Atom, kind: str) -> tuple[F.Quantity | None, F.Quantity | None]:
    """How much of a part, or from where, and to where; of one waypoint, its number is both."""
    amount, until = _begun(atom, kind), atom.amounts.get("until")
    if kind == "range":
        amount, until = amount or until, until or amount
    ends = kind in ("range", "upto")
    if (kind == "from" and amount is None) or (ends and until is None):
        raise Unfit("from where to where on the path")
    return amount, until if ends else None


def _begun(atom: Atom, kind: str) -> F.Quantity | None:
    """How much of a part or from where; "below 30 cm" counts from the ground up, against its direction."""
    amount = atom.amounts.get("part")
    below = (kind, atom.label("toward")) == ("beyond", "down")
    return replace(amount, value=-abs(amount.value)) if amount and below else amount


def _places_of(atom: Atom, kind: str, place: str) -> tuple[str, ...]:
    """The places of a part of the path; none where its kind has none."""
    least = {"near": 1, "between": 2, "after": 1, "before": 1}.get(kind, 0)
    places = (place,) if place in ("start", "goal") else atom.places
    if len(places) < least:
        raise Unfit(f"{kind} what")
    return places if least else ()


Previous: TypeAlias = Sequence[F.SemanticFrame]
"""The frames of the turns before."""


def _edit(atom: Atom, previous: Previous) -> E.Edit:
    action = atom.label("action")
    kind: Any = EDITS[action]
    said = _SAID[action](atom, previous) if action in _SAID else {}
    edit: E.Edit = kind(on=atom.label("on"), **said)
    return edit


def _command(atom: Atom, previous: Previous) -> dict[str, Any]:
    return {"command": atom.label("action"), "steps": int(atom.label("choice") or 1)}


def _rescaled(atom: Atom, previous: Previous) -> dict[str, Any]:
    change, amount = atom.label("choice"), atom.amounts.get("amount")
    if change and amount is not None and amount.unit == "%":
        return {"factor": max(1 + (amount.value if change == "more" else -amount.value), LEAST)}
    return {
        "change": change,
        "factor": None if amount is None else amount.value,
        "degree": atom.label("degree") or None,
    }


LEAST = 0.05
"""What is left of a change at least where so much less of it is asked for."""


def _set(atom: Atom, previous: Previous) -> dict[str, Any]:
    choice, amount = atom.label("choice"), atom.amounts.get("amount")
    if amount is None:
        raise Unfit("set to what")
    slot = atom.label("direction") or choice if choice == "direction" else choice
    if slot == "size" and any(isinstance(frame, F.Figure) and frame.radius for frame in previous):  # "30 cm across"
        slot, amount = "radius", replace(amount, value=amount.value / 2.0, said="")
    role: Any = slot if slot in HEADS["role"] else "by"
    if slot in ("turns", "waves"):
        amount = replace(amount, unit="", said="")
    return {
        "slot": slot,
        "quantity": replace(_inherited(amount, previous, slot), role=role),
        "step": int(atom.label("step")),
    }


def _replaced(atom: Atom, previous: Previous) -> dict[str, Any]:
    choice, end, direction = atom.label("choice"), atom.label("spot"), atom.label("direction")
    if choice == "end" and end in ("start", "goal"):
        return {"end": end}
    if direction and (choice == "direction" or not atom.objects):
        return {"direction": direction}
    if not atom.objects:
        raise Unfit("replace what")
    return {"objects": atom.objects}


def _where(atom: Atom, previous: Previous) -> dict[str, Any]:
    part = part_of(atom)
    if not part and atom.label("action") == "except":
        raise Unfit("which part")
    return {"part": part}


_SAID: dict[str, Callable[[Atom, Previous], dict[str, Any]]] = {
    **dict.fromkeys(COMMANDS, _command),
    "scale": _rescaled,
    "set": _set,
    "replace": _replaced,
    "restrict": _where,
    "except": _where,
}
"""What atoms say of edits that hold more than what they are about."""


def _inherited(amount: F.Quantity, previous: Sequence[F.SemanticFrame], slot: str) -> F.Quantity:
    """A bare number with the unit that the turn before it used: "make it 20" after "10cm" is 20 cm."""
    known = [q for frame in reversed(previous) for q in [frame.quantities.get(slot), *frame.quantities.values()] if q]
    if amount.unit or slot in ("turns", "waves") or not known:
        return amount
    return replace(amount, value=amount.value * scale_of(known[0]), unit=known[0].unit)
