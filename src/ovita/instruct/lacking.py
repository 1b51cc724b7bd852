"""What a reading of the network lacks and the sentence says: amounts without a number, mentions left over, ways up."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

from ovita.instruct.frames import (
    Clearance,
    Extend,
    Figure,
    Height,
    Pace,
    Quantity,
    SemanticFrame,
    StopAt,
    Wait,
    held_by,
)
from ovita.instruct.senses import BACKING
from ovita.instruct.sketch import Sketch
from ovita.instruct.slots import Atom, Unfit

NONE = Quantity(0.0, "m")
"""The distance of what is not touched, and the height over a thing of what is as high as it."""

SHORT_OF = frozenset("short before shy off away front ahead close nearer".split())
"""Words with which a length is left to what a path stops at."""

SINKING = frozenset("down downward downwards descend descends descending descent sink sinks sinking drop".split())
RISING = frozenset("up upward upwards ascend ascending ascent climb climbing rise rising".split())
UPRIGHT = frozenset("vertical vertically upright".split())
"""Words for where a figure leads."""

UP_AND_DOWN = ("up and down", "up down", "down and up")
"""Phrases for the ways of what goes up and down."""

NO_WAY_DOWN = frozenset("slow slows slowing slowed calm wind it".split())
"""Words behind which a "down" is no direction: "slow down", "slow it down"."""


def without_amounts(atoms: Iterable[Atom], seen: Sketch) -> tuple[Atom, ...]:
    """Atoms with the amounts that go without a number: not to touch something, or a height that is a thing's."""
    said = _lengths_said(seen)
    return tuple(_with_none(atom) if not said and "amount" not in atom.amounts else atom for atom in atoms)


def _lengths_said(seen: Sketch) -> bool:
    return any(m.unit in ("m", "") and not m.is_object for m in seen.mentions)


def _with_none(atom: Atom) -> Atom:
    action = atom.label("action")
    apart = action == "clearance" and atom.label("role") == "at_least"
    return replace(atom, amounts={**atom.amounts, "amount": NONE}) if apart or action == "height" else atom


def completed(items: Sequence[Any], used: frozenset[int], seen: Sketch) -> tuple[tuple[Any, ...], frozenset[int]]:
    """Items with what nothing points at: the distance left to a stop, whose height is meant, how far back.

    Args:
        items: Frames and edits.
        used: The mentions that they were read from.
        seen: The sentence.

    Returns:
        The items, and the mentions that they were read from then.

    Raises:
        Unfit: If a height is neither said nor that of one thing.
    """
    text = " ".join(piece.text.lower() for piece in seen.pieces if piece.text.isalpha())
    found: list[Any] = []
    for item in items:
        told, mention = _completed(_untouched(item, items, text), text, _left(used, seen), seen)
        used |= {mention} - {NOWHERE}
        found.append(told)
    return tuple(found), used


NOWHERE = -1
"""Stands for no mention."""


def _left(used: frozenset[int], seen: Sketch) -> list[int]:
    """The mentions that nothing was read from."""
    return [i for i, mention in enumerate(seen.mentions) if mention.words and i not in used]


def _untouched(item: Any, items: Sequence[Any], text: str) -> Any:
    """A clearance whose distance is another wish's as one of none: "go left by 0.2 and do not touch the kettle"."""
    if not isinstance(item, Clearance) or "touch" not in text.split():
        return item
    others = [one for one in items if isinstance(one, SemanticFrame) and one is not item]
    shared = any(item.distance.value in held_by(other) for other in others)
    return replace(item, distance=replace(NONE, role="at_least")) if shared else item


def _completed(item: Any, text: str, left: Sequence[int], seen: Sketch) -> tuple[Any, int]:
    """An item with what it lacks, and the mention that this was read from."""
    words = frozenset(text.split())
    match item:
        case StopAt(by=None) | Wait(by=None) if item.named and not SHORT_OF.isdisjoint(words):
            return _stopped_short(item, left, seen)
        case Height(of="", level=Quantity(value=0.0)) if not _lengths_said(seen):
            return _as_high_as(item, left, seen)
        case Extend(place="", by=Quantity() as by) if by.value > 0 and any(phrase in text for phrase in BACKING):
            return replace(item, by=replace(by, value=-by.value, said="")), NOWHERE
        case Pace(change="slower", amount=Quantity(value=0.0)) if not item.part:
            return replace(item, change="rampdown", amount=None), NOWHERE
        case Figure(shape="spiral", rise=Quantity() as rise) if _sinks(text):
            return replace(item, rise=replace(rise, value=-abs(rise.value), said="")), NOWHERE
        case Figure(shape="wave" | "zigzag") if not UPRIGHT.isdisjoint(words) or any(
            phrase in text for phrase in UP_AND_DOWN
        ):
            return replace(item, upright=True), NOWHERE
    return item, NOWHERE


def _sinks(text: str) -> bool:
    """Whether words say that it goes down, and none that it goes up."""
    pairs = pairwise(["", *text.split()])
    words = {word for before, word in pairs if word != "down" or before not in NO_WAY_DOWN}
    return not SINKING.isdisjoint(words) and RISING.isdisjoint(words)


def _stopped_short(stop: StopAt | Wait, left: Sequence[int], seen: Sketch) -> tuple[StopAt | Wait, int]:
    """A stop or a wait at the one length that is left from its place, unless that is denied."""
    denied = {b.mention for a, b in pairwise(seen.pieces) if a.text.lower() == "not"}
    lengths = [i for i in left if seen.mentions[i].unit == "m" and i not in denied]
    return (replace(stop, by=seen.mentions[lengths[0]].quantity), lengths[0]) if len(lengths) == 1 else (stop, NOWHERE)


def _as_high_as(height: Height, left: Sequence[int], seen: Sketch) -> tuple[Height, int]:
    """The height of the one thing that is left."""
    things = [i for i in left if len(seen.mentions[i].items) == 1]
    if len(things) != 1:
        raise Unfit("How high is that, in metres")
    return replace(height, of=seen.mentions[things[0]].items[0]), things[0]
