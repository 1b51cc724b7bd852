"""Parameters in a dialogue: as frames where another writer wrote the policy, by name, and in words."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from ovita.instruct import frames as F
from ovita.instruct.editing import chosen, factor_of, further, quantity_of, slots
from ovita.instruct.edits import Drop, Edit, Rescale
from ovita.instruct.notation import DIRECTIONS
from ovita.instruct.remarks import stated
from ovita.paths.part import PathPart
from ovita.paths.scene import Scene, canonical
from ovita.policy import Parameter
from ovita.policy.source import Role
from ovita.result import Adaptation
from ovita.text import listed
from ovita.units import dimension

_PLACING = re.compile(
    r"\b(radius|within|reach|ease|easing|blend|fade|share|fraction|portion|window|tolerance|margin|sigma|width|range|"
    r"threshold|falloff|influence|iterations|waypoints?|index|count\w* as|how far around)\b"
)
_FACTOR = re.compile(r"\b(factor|times|ratio|multipl\w*|scale|slowdown|speedup|fraction of)\b")
_WORDS = (
    ("faster", re.compile(r"\b(speedup|fast\w*|acceler\w*)\b")),
    ("slower", re.compile(r"\b(speed|slow\w*|velocity|brake|decel\w*|cruise)\b")),
    ("closer", re.compile(r"\b(closer|nearer|toward\w*|approach|at most)\b")),
    ("away", re.compile(r"\b(farther|further|away|distance|clearance|gap|push|pull|keep)\b")),
    ("longer", re.compile(r"\b(wait|dwell|pause|stop)\b")),
)
_SHIFT = re.compile(r"\b(shift|offset|move|displace\w*|lift|translate|translation|height|lateral|raise)\b")
_HEADINGS: dict[str, str] = {word: word for word in DIRECTIONS if len(word) > 1}
_HEADINGS |= {"forward": "front", "backward": "back", "upward": "up", "downward": "down", "height": "up", "lift": "up"}


def described(parameter: Parameter, scene: Scene) -> Parameter:
    """A parameter of a policy that someone else wrote, with what its unit, its name and their words for it say."""
    if parameter.role is not None:
        return parameter
    text = f"{parameter.name.replace('_', ' ')} {parameter.meaning}".lower()
    words = re.findall(r"[a-z]+", text)
    heading = next((_HEADINGS[word] for word in words if word in _HEADINGS), "")
    direction = next((word for word, pattern in _WORDS if pattern.search(text)), "")
    speed = direction in ("faster", "slower") or dimension(parameter.unit) == "m/s"
    names = [item.name for item in scene if set(canonical(item.name).split()) <= set(words)]
    role = _role(parameter.unit, text, steady=speed and "added" not in words, turned=bool(direction or heading))
    direction = direction or heading if speed else heading or direction
    return replace(parameter, role=role, about=max(names, key=len, default=""), direction=direction)


def _role(unit: str, text: str, *, steady: bool, turned: bool) -> Role:
    """What a parameter is for by its words: `steady` if it is a speed to keep, `turned` if they name a direction."""
    if _PLACING.search(text):
        return "other"
    if unit in ("", "x", "factor", "ratio") and _FACTOR.search(f"{text} {unit}"):
        return "factor"
    return "by" if not steady and (turned or _SHIFT.search(text)) else "to"


def frames_of(parameters: Sequence[Parameter], scene: Scene) -> tuple[F.SemanticFrame, ...]:
    """Frames that parameters of another writer's policy seem to stand for; shifts are one frame."""
    return tuple(frame for frame, _ in _filled(parameters, scene))


Filled = list[tuple[F.SemanticFrame, dict[str, str]]]
"""Frames, each with the names of the parameters that fill its slots."""


def _filled(parameters: Sequence[Parameter], scene: Scene) -> Filled:
    found: Filled = []
    shifts: dict[F.Direction, tuple[F.Quantity, str]] = {}
    for parameter in parameters:
        known = described(parameter, scene)
        q = quantity_of(known)
        frame = None if q is None or known.role == "other" else _frame(known, q)
        if isinstance(frame, F.Shift):
            ((direction, q),) = frame.offset
            shifts[direction] = F.Quantity(q.value if q else 0.0, "m"), parameter.name
        elif frame is not None:
            found.append((frame, {next(iter(slots(frame))): parameter.name}))
    if shifts:
        whole = F.Shift(offset=tuple((direction, q) for direction, (q, _) in shifts.items()))
        found.append((whole, {direction: name for direction, (_, name) in shifts.items()}))
    return found


def _frame(p: Parameter, q: F.Quantity) -> F.SemanticFrame | None:
    near, is_speed = PathPart("near", (p.about,)) if p.about else PathPart(), dimension(p.unit) == "m/s"
    if p.role == "factor" or (is_speed and p.role == "to"):
        return F.Pace(change="set", amount=replace(q, role="to"), part=near)
    if is_speed:
        return F.Pace(change="faster" if q.value > 0 else "slower", amount=q, part=near)
    if p.direction in DIRECTIONS:
        return F.Shift(offset=((p.direction, q),))
    if p.direction in ("closer", "away") and p.about:
        if p.role in ("at_least", "at_most"):
            return F.Clearance(objects=(p.about,), distance=q)
        return F.Approach(sense="closer" if p.direction == "closer" else "farther", objects=(p.about,), by=q)
    if p.direction == "longer":
        return F.Wait(duration=q)
    return F.Shift(offset=(("left", q),)) if p.role == "by" and dimension(p.unit) in ("", "m") else None


def values_after(
    parameters: Sequence[Parameter], scene: Scene, edits: Sequence[Edit], after: Sequence[F.SemanticFrame]
) -> dict[str, float | int] | None:
    """The values of another writer's parameters that do what edited frames say; None if values cannot say it.

    Dropped frames get the value with which they do nothing.
    """
    before = _filled(parameters, scene)
    if any(isinstance(edit, Drop) for edit in edits):
        return _without_effect([(frame, names) for frame, names in before if frame not in after])
    if len(after) != len(before):
        return None
    present = {p.name: p.value for p in parameters}
    pairs = zip(before, after, strict=True)
    values = _known({name: _value(was, now, slot) for (was, names), now in pairs for slot, name in names.items()})
    changed = {name: value for name, value in (values or {}).items() if present[name] != value}
    return {n: round(v) if isinstance(present[n], int) else v for n, v in changed.items()} or None


def _without_effect(gone: Filled) -> dict[str, float] | None:
    """The values with which dropped frames do nothing; None if there is none, or nothing was dropped."""
    return _known({name: _neutral(frame) for frame, names in gone for name in names.values()}) or None


def _known(values: dict[str, float | None]) -> dict[str, float] | None:
    """Values, or None if one of them is not known."""
    known = {name: value for name, value in values.items() if value is not None}
    return known if len(known) == len(values) else None


def _neutral(frame: F.SemanticFrame) -> float | None:
    match frame:
        case F.Pace(amount=F.Quantity(unit="x")):
            return 1.0
        case F.Pace(change="set") | F.Clearance():
            return None
    return 0.0


def _value(was: F.SemanticFrame, now: F.SemanticFrame, slot: str) -> float | None:
    """A parameter's value after an edit of its frame; None if anything but an amount or a direction changed."""
    if type(was) is not type(now) or was.part != now.part or getattr(was, "objects", ()) != getattr(now, "objects", ()):
        return None
    if isinstance(now, F.Shift) and slot not in now.quantities:
        back = now.quantities.get(F.OPPOSITES[slot])
        return None if back is None else -back.value
    q, old = now.quantities.get(slot), was.quantities.get(slot)
    return q.value if q is not None and old is not None and q.unit == old.unit else None


CHANGING = frozenset("higher lower left right faster slower closer nearer farther further longer wait stop".split())
"""Words with which a number is another change, not the value of a parameter that is near what they name."""


ZONE = frozenset("zone area radius within around circle range".split())
"""Words for how far from a thing counts as near it."""


ENDS = frozenset("start beginning goal end finish".split())
"""Words for places that are no things, which have a zone of their own."""


def names_zone(said: str) -> bool:
    """Whether an utterance speaks of such a distance by name: "extend the zone to 400 mm"."""
    return not {"zone", "radius"}.isdisjoint(said.lower().split())


def called(said: str, result: Adaptation, scene: Scene) -> dict[str, float]:
    """The new value of a parameter that an utterance calls by its name: "set the influence radius to 1.2"."""
    q, words = stated(said, scene)
    if q is None or not CHANGING.isdisjoint(words):
        return {}
    fitting = [p for p in result.parameters if isinstance(p.value, int | float) and q.unit in ("", dimension(p.unit))]
    shared = {p.name: len({w for w in p.name.lower().split("_") if len(w) > 2} & words) for p in fitting}
    most = max(shared.values(), default=0)
    names = [name for name, count in shared.items() if count == most]
    if not most:
        return {p.name: q.value for p in fitting if p.role == "radius"} if _is_zone(q, words) else {}
    return {names[0]: q.value} if len(names) == 1 else {}


def _is_zone(q: F.Quantity, words: set[str]) -> bool:
    """Whether a length is how far from a thing counts as near it."""
    return dimension(q.unit) == "m" and not ZONE.isdisjoint(words) and ENDS.isdisjoint(words)


def scaled(edit: Rescale, frames: Sequence[F.SemanticFrame], parameters: Sequence[Parameter]) -> dict[str, float | int]:
    """More or less of what a frame holds no amount of, by its parameter: smoothing, bending."""
    i = chosen(frames, edit.on, lambda frame: bool(slots(frame)) or isinstance(frame, F.Smooth | F.Curve))
    if i is None or not isinstance(frames[i], F.Smooth | F.Curve):
        return {}
    k, found = factor_of(edit), dict[str, float | int]()
    for p in parameters:
        q = quantity_of(p) if p.slot.startswith(f"{i}.") else None
        if q is not None:
            value = further(q.value, k) if p.role == "factor" else q.value * k
            found[p.name] = max(round(value), 1) if isinstance(p.value, int) else float(f"{value:.3g}")
    return found


def shown(parameter: Parameter, *, named: bool = True) -> str:
    """A parameter's value with its unit."""
    value = f"{parameter.value:g}" if isinstance(parameter.value, int | float) else str(parameter.value)
    unit = f" {parameter.unit}" if parameter.unit else ""
    return f"{parameter.name} {value}{unit}" if named else f"{value}{unit}"


def which(asked: Sequence[str], frames: Sequence[F.SemanticFrame], parameters: Sequence[Parameter]) -> str:
    """A question of which change is meant, with the parameters as they are."""
    first: dict[str, Parameter] = {}
    for p in parameters:
        if not p.slot.endswith(".part"):
            first.setdefault(p.slot.partition(".")[0], p)
    found = [first[str(i)] for i, frame in enumerate(frames) if F.name_of(frame) in asked and str(i) in first]
    known = [f"{p.name} ({p.meaning or 'now'}, now {shown(p, named=False)})" for p in found]
    return f"Which do you mean: {listed(known if len(known) > 1 else asked, 'or')}?"
