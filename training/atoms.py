"""Frames and edits as atoms, which the learned reader is trained to say; `instruct/slots.items_of` is the way back.

A frame with several directions is several atoms.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields, replace
from typing import Any

from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.frames import name_of
from ovita.instruct.meaning import canonical_part
from ovita.instruct.notation import DIRECTIONS, where_of
from ovita.instruct.slots import CHOICES, CHOOSING, HEADS, PARTS, Atom, Unfit
from ovita.paths.part import PathPart

_POINTER_OF = {
    **dict.fromkeys(F.MAIN, "amount"),
    **{slot: slot for slot in ("duration", "radius", "size", "turns", "rise")},
    "waves": "turns",
}
"""The pointer of each slot that holds a quantity."""


def atoms_of(items: Iterable[F.SemanticFrame | E.Edit]) -> tuple[Atom, ...]:
    """Frames and edits as atoms.

    Raises:
        Unfit: If atoms cannot say one of them.
    """
    found: list[Atom] = []
    for item in items:
        frame = item.frame if isinstance(item, E.Also) else item
        found += _frame_atoms(frame) if isinstance(frame, F.SemanticFrame) else [_edit_atom(frame)]
    return tuple(found)


def _frame_atoms(frame: F.SemanticFrame) -> list[Atom]:
    said = {slot.name: value for slot in fields(frame) if (value := getattr(frame, slot.name)) is not None}
    labels = {"action": name_of(frame)} | _labels(said)
    amounts = {to: said[slot] for slot, to in _POINTER_OF.items() if isinstance(said.get(slot), F.Quantity)}
    main = amounts.get("amount")
    if main is not None:
        labels["role"] = main.role
        if isinstance(frame, F.Pace) and main.value < 0:
            labels["choice"], amounts["amount"] = "brake", _positive(main)
    for pointer in ("amount", "rise"):
        if pointer in amounts and amounts[pointer].value < 0:
            labels["step"], amounts[pointer] = "-1", _positive(amounts[pointer])
    atom = Atom(labels, amounts, said.get("objects", ()))
    atom = _joined(atom, _spot(next((said[slot] for slot in F.PLACES if slot in said), "")), _part_atom(frame.part))
    if len(atom.objects) > 3:
        raise Unfit("more than three objects")
    return [_directed(atom, direction, quantity) for direction, quantity in said.get("offset", ())] or [atom]


def _labels(said: Mapping[str, Any]) -> dict[str, str]:
    """What the slots of a frame choose."""
    chosen = {
        head: said[head] for head in ("degree", "sense", "relation", "direction") if said.get(head) in HEADS[head]
    }
    flags = {"step": "1"} if said.get("longer") else {"direction": "up"} if said.get("upright") else {}
    return chosen | flags | {"choice": next((str(said[slot]) for slot in CHOOSING if slot in said), "")}


def _spot(place: F.Place) -> Atom:
    """What an atom says of the place of a frame."""
    if isinstance(place, F.Quantity):
        return Atom({"spot": "amount"}, {"spot": place})
    if isinstance(place, tuple):
        return Atom({"spot": "objects"}, objects=place)
    if place in ("", *F.SPOTS):
        return Atom({"spot": place})
    return Atom({"spot": "object"}, objects=(place,))


def _positive(quantity: F.Quantity) -> F.Quantity:
    return replace(quantity, value=abs(quantity.value), said=quantity.said.lstrip("-"))


def _directed(atom: Atom, direction: F.Direction, quantity: F.Quantity | None) -> Atom:
    if quantity is None:
        return replace(atom, labels=atom.labels | {"direction": direction})
    way = F.OPPOSITES[direction] if quantity.value < 0 else direction
    return replace(
        atom, labels=atom.labels | {"direction": way}, amounts=atom.amounts | {"amount": _positive(quantity)}
    )


def _part_atom(part: PathPart) -> Atom:
    """What an atom says of a part of the path."""
    inside = part.parts[0] if part.kind == "outside" else part
    where = where_of(canonical_part(inside))
    if where.kind not in PARTS:
        raise Unfit(f"a part that is {where.kind}")
    labels = {"part": where.kind, "outside": "" if inside is part else "outside"}
    if where.kind == "beyond":
        labels["toward"] = where.direction
    pointed = {"part": where.amount, "until": where.until}
    amounts = {name: quantity for name, quantity in pointed.items() if quantity is not None}
    if where.places in (("start",), ("goal",)):
        return Atom(labels | {"place": where.places[0]}, amounts)
    if len(where.places) > 3 or any(not isinstance(place, str) or place in F.SPOTS for place in where.places):
        raise Unfit("places of a part")
    return Atom(labels | {"place": "object" if where.places else ""}, amounts, places=where.places)


def _edit_atom(edit: E.Edit) -> Atom:
    labels = {"action": edit.NAME, "on": edit.on if edit.on in HEADS["on"] else ""}
    match edit:
        case E.Rescale(change=change, factor=factor, degree=degree):
            amounts = {} if factor is None else {"amount": F.Quantity(factor, "x", said=f"{factor:g}x")}
            return Atom(labels | {"choice": change, "degree": degree or ""}, amounts)
        case E.Set(slot=slot, quantity=quantity, step=step):
            return Atom(labels | _slot_labels(slot) | {"step": str(step)}, {"amount": quantity})
        case E.Replace(direction=direction, objects=objects, end=end):
            choice = "direction" if direction else "end" if end else "objects"
            return Atom(labels | {"choice": choice, "direction": direction or "", "spot": end}, objects=objects)
        case E.Restrict(part=part) | E.Except(part=part):
            where = _part_atom(part)
            return replace(where, labels=labels | where.labels)
        case E.Command(command=command, steps=steps):
            if (many := str(steps) if steps > 1 else "") not in CHOICES["undo"]:
                raise Unfit(f"{command} {steps}")
            return Atom(labels | {"action": command, "choice": many})
    return Atom(labels)


def _slot_labels(slot: str) -> dict[str, str]:
    """What heads say of the slot that an edit sets."""
    if slot in DIRECTIONS:
        return {"choice": "direction", "direction": slot}
    if slot not in CHOICES["set"]:
        raise Unfit(f"set {slot}")
    return {"choice": slot}


def _joined(*atoms: Atom) -> Atom:
    """One atom of several that say other things of a frame."""
    labels: dict[str, str] = {}
    amounts: dict[str, F.Quantity] = {}
    for atom in atoms:
        labels |= atom.labels
        amounts |= atom.amounts
    return Atom(labels, amounts, sum((a.objects for a in atoms), ()), sum((a.places for a in atoms), ()))
