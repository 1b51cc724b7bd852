"""Parameters in a dialogue: as frames where another writer wrote the policy, by name, and in words."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from ovita.instruct import frames as F
from ovita.instruct.editing import MORE, chosen, further, quantity_of, slots
from ovita.instruct.edits import Drop, Edit, Rescale
from ovita.instruct.feedback import stated
from ovita.instruct.frames import (
    Approach,
    Clearance,
    Curve,
    Offset,
    Pace,
    Quantity,
    SemanticFrame,
    Shift,
    Smooth,
    Wait,
    name_of,
)
from ovita.instruct.notation import DIRECTIONS
from ovita.paths.part import PathPart
from ovita.paths.scene import Scene, canonical
from ovita.policy import Parameter
from ovita.policy.policy import Role
from ovita.result import Adaptation
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
_TURNED = {"forward": "front", "backward": "back", "upward": "up", "downward": "down", "height": "up", "lift": "up"}


def described(parameter: Parameter, scene: Scene) -> Parameter:
    """A parameter of a policy that someone else wrote, with what its unit, its name and their words for it say."""
    if parameter.role is not None:
        return parameter
    text = f"{parameter.name.replace('_', ' ')} {parameter.meaning}".lower()
    words = re.findall(r"[a-z]+", text)
    heading = next((w for w in (_TURNED.get(word, word) for word in words) if w in DIRECTIONS and len(w) > 1), "")
    direction = next((word for word, pattern in _WORDS if pattern.search(text)), "")
    speed = direction in ("faster", "slower") or dimension(parameter.unit) == "m/s"
    names = [item.name for item in scene if set(canonical(item.name).split()) <= set(words)]
    role = _role(parameter.unit, text, steady=speed and "added" not in words, turned=bool(direction or heading))
    direction = heading if heading and not speed else direction or heading
    return replace(parameter, role=role, about=max(names, key=len, default=""), direction=direction)


def _role(unit: str, text: str, *, steady: bool, turned: bool) -> Role:
    """What a parameter is for by its words: `steady` if it is a speed to keep, `turned` if they name a direction."""
    if _PLACING.search(text):
        return "other"
    if unit in ("", "x", "factor", "ratio") and _FACTOR.search(f"{text} {unit}"):
        return "factor"
    return "by" if not steady and (turned or _SHIFT.search(text)) else "to"


def frames_of(parameters: Sequence[Parameter], scene: Scene) -> tuple[SemanticFrame, ...]:
    """Frames that parameters of another writer's policy seem to stand for; shifts are one frame."""
    return tuple(frame for frame, _ in _standing(parameters, scene))


Standing = list[tuple[SemanticFrame, dict[str, str]]]
"""Frames, each with the names of the parameters that stand for its slots."""


def _standing(parameters: Sequence[Parameter], scene: Scene) -> Standing:
    found: Standing = []
    shifts: dict[str, tuple[Quantity, str]] = {}
    for parameter in parameters:
        known = described(parameter, scene)
        q = quantity_of(known)
        frame = None if q is None or known.role == "other" else _frame(known, q)
        if isinstance(frame, Shift):
            shifts[frame.offset[0][0]] = Quantity(q.value if q else 0.0, "m"), parameter.name
        elif frame is not None:
            found.append((frame, {next(iter(slots(frame))): parameter.name}))
    if shifts:
        offset: Offset = tuple((d, q) for d, (q, _) in shifts.items())  # type: ignore[misc]
        found.append((Shift(offset=offset), {d: name for d, (_, name) in shifts.items()}))
    return found


def _frame(p: Parameter, q: Quantity) -> SemanticFrame | None:
    near = PathPart("near", (p.about,)) if p.about else PathPart()
    if p.role == "factor" or (dimension(p.unit) == "m/s" and p.role == "to"):
        return Pace(change="set", amount=replace(q, role="to"), part=near)
    if dimension(p.unit) == "m/s":
        return Pace(change="faster" if q.value > 0 else "slower", amount=q, part=near)
    if p.direction in DIRECTIONS:
        return Shift(offset=((p.direction, q),))
    if p.direction in ("closer", "away") and p.about:
        if p.role in ("at_least", "at_most"):
            return Clearance(objects=(p.about,), distance=q)
        return Approach(sense="closer" if p.direction == "closer" else "farther", objects=(p.about,), by=q)
    if p.direction == "longer":
        return Wait(duration=q)
    return Shift(offset=(("left", q),)) if p.role == "by" and dimension(p.unit) in ("", "m") else None


def values_after(
    parameters: Sequence[Parameter], scene: Scene, edits: Sequence[Edit], after: Sequence[SemanticFrame]
) -> dict[str, float | int] | None:
    """The values of another writer's parameters that do what edited frames say; None if values cannot say it.

    Dropped frames get the value with which they do nothing.
    """
    before = _standing(parameters, scene)
    if any(isinstance(edit, Drop) for edit in edits):
        return _without_effect([(frame, names) for frame, names in before if frame not in after])
    if len(after) != len(before):
        return None
    found: dict[str, float | int] = {}
    for (was, names), now in zip(before, after, strict=True):
        for slot, name in names.items():
            value = _value(was, now, slot)
            if value is None:
                return None
            found[name] = value
    present = {p.name: p.value for p in parameters}
    found = {n: (round(v) if isinstance(present[n], int) else v) for n, v in found.items() if present[n] != v}
    return found or None


def _without_effect(gone: Standing) -> dict[str, float | int] | None:
    """The values with which dropped frames do nothing; None if there is none, or nothing was dropped."""
    values = {name: _neutral(frame) for frame, names in gone for name in names.values()}
    return {n: v for n, v in values.items() if v is not None} if gone and None not in values.values() else None


def _neutral(frame: SemanticFrame) -> float | None:
    match frame:
        case Pace(amount=Quantity(unit="x")):
            return 1.0
        case Pace(change="set") | Clearance():
            return None
    return 0.0


def _value(was: SemanticFrame, now: SemanticFrame, slot: str) -> float | None:
    """A parameter's value after an edit of its frame; None if anything but an amount or a direction changed."""
    if type(was) is not type(now) or was.part != now.part or getattr(was, "objects", ()) != getattr(now, "objects", ()):
        return None
    if isinstance(now, Shift) and slot not in now.quantities:
        back = now.quantities.get(F.OPPOSITES[slot])
        return None if back is None else -back.value
    q, old = now.quantities.get(slot), was.quantities.get(slot)
    return q.value if q is not None and old is not None and q.unit == old.unit else None


def called(said: str, result: Adaptation, scene: Scene) -> dict[str, float]:
    """The new value of a parameter that an utterance calls by its name: "set the influence radius to 1.2"."""
    q, words = stated(said, scene)
    if q is None:
        return {}
    best: dict[str, set[str]] = {}
    for p in result.parameters:
        name = {w for w in p.name.lower().split("_") if len(w) > 2}
        if isinstance(p.value, int | float) and name & words and q.unit in ("", dimension(p.unit)):
            best[p.name] = name & words
    if not best:
        return {}
    most = max(map(len, best.values()))
    names = [name for name, found in best.items() if len(found) == most]
    return {names[0]: q.value} if len(names) == 1 else {}


def scaled(edit: Rescale, frames: Sequence[SemanticFrame], parameters: Sequence[Parameter]) -> dict[str, float | int]:
    """More or less of what a frame holds no amount of, by its parameter: smoothing, bending."""
    i = chosen(frames, edit.on, lambda frame: bool(slots(frame)) or isinstance(frame, Smooth | Curve))
    if i is None or not isinstance(frames[i], Smooth | Curve):
        return {}
    k = edit.factor if edit.factor is not None else MORE[edit.degree or "moderate"]
    k = 1 / k if edit.factor is None and edit.change == "less" else k
    found: dict[str, float | int] = {}
    for p in parameters:
        if p.slot.startswith(f"{i}.") and isinstance(p.value, int | float) and not isinstance(p.value, bool):
            value = further(p.value, k) if p.role == "factor" else p.value * k
            found[p.name] = max(round(value), 1) if isinstance(p.value, int) else float(f"{value:.3g}")
    return found


def shown(parameter: Parameter, *, named: bool = True) -> str:
    """A parameter's value with its unit."""
    value = f"{parameter.value:g}" if isinstance(parameter.value, int | float) else str(parameter.value)
    unit = f" {parameter.unit}" if parameter.unit else ""
    return f"{parameter.name} {value}{unit}" if named else f"{value}{unit}"


def which(asked: Sequence[str], frames: Sequence[SemanticFrame], parameters: Sequence[Parameter]) -> str:
    """A question of which change is meant, with the parameters as they are."""
    numbers = [i for i, frame in enumerate(frames) if name_of(frame) in asked]
    listed = [
        f"{p.name} ({p.meaning or 'now'}, now {shown(p, named=False)})"
        for i in numbers
        for p in [q for q in parameters if q.slot.startswith(f"{i}.") and not q.slot.endswith(".part")][:1]
    ]
    listed = listed if len(listed) > 1 else list(asked)
    return f"Which do you mean: {', '.join(listed[:-1])} or {listed[-1]}?"
