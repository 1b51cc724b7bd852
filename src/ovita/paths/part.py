"""Which part of a path: by waypoints, arc length, time, direction or object; as a mask, as words and as JSON.

Waypoint indices count from 0, both ends included, as numpy counts; the words that a person reads count from 1.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np

from ovita import text
from ovita.paths.geometry import Cuboid, Mask, fractions, within_core
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory, interpolate, source_indices

Place: TypeAlias = Any
"""An object's name, coordinates [x, y, z] [m], "start", "goal", or {"between": [a, b]}: the midpoint of two places."""

Unit = Literal["waypoints", "share", "m", "s"]

NEAREST = 0.15
"""Without a radius, "near" is this share of the waypoints, the nearest ones ..."""

FARTHEST = 1 / 3
"""... and "away from" this share, the farthest ones."""

BEYOND = 1.25
"""With a radius, "away from" begins at so many radii, so that speeds may change gently at the border."""

BEND_SAMPLES = 60
"""Points at which a path is looked at for its bends, evenly along it."""

BEND_WINDOW = 2
"""A bend is the angle between the chords over so many samples before and after."""


@dataclass(frozen=True)
class PathPart:
    """A part of a path, as data; `mask` says which waypoints it means on a trajectory.

    Args:
        kind: "whole"; "near" a place; "first" or "last" so much; the "middle"; "after" or "before" a place; "between"
            two places; a "range" of waypoints, metres or seconds; "every" k-th waypoint; where the path is "heading" in
            a direction or is "beyond" so many metres along one; the "turns"; listed "indices"; or "outside", "both"
            and "either" of other parts.
        places: One for near, after and before, two for between.
        amount: Radius [m] of near; how much of first, last, middle and turns; a range's begin; the k of every; the
            metres of beyond [m]. None where it is left open.
        unit: What `amount` and `until` of first, last and range count.
        until: A range's end; None for the goal.
        direction: Direction word of heading and beyond.
        ranges: First and last waypoint of each run of indices.
        count: Number of waypoints of the path that indices were made for.
        parts: What outside, both and either are made of.
        of: What of an object the radius of near is measured from: its surface, or its centre, also if left open; of a
            wide object the middle of its body.
    """

    kind: str = "whole"
    places: tuple[Place, ...] = ()
    amount: float | None = None
    unit: Unit = "waypoints"
    until: float | None = None
    direction: str = ""
    ranges: tuple[tuple[int, int], ...] = ()
    count: int = 0
    parts: tuple[PathPart, ...] = ()
    of: Literal["", "centre", "surface"] = ""

    def __post_init__(self) -> None:
        if self.kind != "whole" and self.kind not in _MASKS:
            raise ValueError(f"{self.kind!r} is no part of a path; known are whole, {', '.join(_MASKS)}")
        if self.of not in ("", "centre", "surface"):
            raise ValueError(f"of must be 'centre' or 'surface', not {self.of!r}")

    def __bool__(self) -> bool:
        return self.kind != "whole"

    def mask(self, trajectory: Trajectory, scene: Scene) -> Mask:
        """Which waypoints of a trajectory this means, (N,); near an object, the segments between them count too.

        Raises:
            UnknownObject: If it names an object that the scene does not have.
        """
        if self.kind == "whole":
            return np.ones(len(trajectory), dtype=bool)
        return np.asarray(_MASKS[self.kind](self, trajectory, scene), dtype=bool)

    def words(self) -> str:
        """The part as a phrase, such as "in the first 10 waypoints"; "" for the whole path."""
        return _WORDS[self.kind](self) if self.kind in _WORDS else ""

    def to_json(self) -> dict[str, Any]:
        """The part as a JSON document, which `from_json` reads."""
        return _DOCUMENTS[self.kind](self) if self.kind in _DOCUMENTS else {}

    @classmethod
    def from_json(cls, document: PathPart | Mapping[str, Any] | None) -> PathPart:
        """The part that `to_json` wrote; None and {} mean the whole path.

        Raises:
            ValueError: If the document describes no part of a path.
        """
        if isinstance(document, PathPart):
            return document
        if not document:
            return WHOLE
        try:
            return _read(document)
        except (KeyError, TypeError, IndexError):
            known = "near, first, last, middle, after, before, between, range, every, heading, beyond or turns"
            raise ValueError(f"{dict(document)!r} selects no waypoints; use {known}") from None


WHOLE = PathPart()


def near(place: Place, within: float | None = None) -> PathPart:
    """The part within a radius [m] of a place's centre; by default the nearest 15 % of the waypoints."""
    return PathPart("near", (place,), within)


def first(n: float | None = None, *, fraction: float | None = None, unit: Unit = "waypoints") -> PathPart:
    """The first n waypoints (or metres, or seconds), or the first fraction (0..1) of the waypoints."""
    return PathPart("first", amount=n, unit=unit) if fraction is None else PathPart("first", (), fraction, "share")


def last(n: float | None = None, *, fraction: float | None = None, unit: Unit = "waypoints") -> PathPart:
    """The last n waypoints (or metres, or seconds), or the last fraction (0..1) of the waypoints."""
    return PathPart("last", amount=n, unit=unit) if fraction is None else PathPart("last", (), fraction, "share")


def middle(fraction: float) -> PathPart:
    """A fraction (0..1) of the waypoints around the middle one."""
    return PathPart("middle", amount=fraction)


def after(place: Place) -> PathPart:
    """From the waypoint nearest to a place to the goal."""
    return PathPart("after", (place,))


def before(place: Place) -> PathPart:
    """From the start to the waypoint nearest to a place."""
    return PathPart("before", (place,))


def between(a: Place, b: Place) -> PathPart:
    """From the waypoint nearest to one place to the one nearest to another, in any order."""
    return PathPart("between", (a, b))


def turns(fraction: float = 0.25) -> PathPart:
    """The fraction (0..1) of the waypoints at which the path bends most."""
    return PathPart("turns", amount=fraction)


def outside(part: PathPart) -> PathPart:
    """What is clearly outside a part: beyond 1.25 of its radius; for the nearest waypoints, the farthest third."""
    inner = part.parts[0] if part.kind == "outside" else WHOLE
    return PathPart("outside", parts=(part,)) if inner.kind in ("whole", "near") else inner


def both(*parts: PathPart) -> PathPart:
    """What belongs to every one of the parts."""
    return PathPart("both", parts=parts)


def any_of(parts: Sequence[PathPart]) -> PathPart:
    """What belongs to any of some parts."""
    return parts[0] if len(parts) == 1 else PathPart("either", parts=tuple(parts))


def locate(what: Place, trajectory: Trajectory, scene: Scene) -> Array:
    """The point (3,) [m] that a place means; "start" and "goal" are those of the trajectory.

    Raises:
        UnknownObject: If the scene has no such object.
    """
    if isinstance(what, Mapping):
        a, b = (locate(part, trajectory, scene) for part in what["between"])
        return (a + b) / 2.0
    if what in ("start", "goal") if isinstance(what, str) else False:
        return np.array(trajectory.positions[0 if what == "start" else -1])
    return np.array(scene[what].position if isinstance(what, str) else what, dtype=float)


def named(what: Place) -> str:
    """A place in words: "the cup", "the midpoint of the cup and the box", "[0, 0.1, 0]"."""
    if isinstance(what, Mapping):
        return "the midpoint of " + " and ".join(named(part) for part in what["between"])
    return text.the(what) if isinstance(what, str) else text.point(what)


def bends(positions: Array) -> Array:
    """Angles (BEND_SAMPLES - 2 BEND_WINDOW,) [rad] by which a path (N, 3) turns, sampled evenly along its length."""
    points = interpolate(positions, source_indices(positions, BEND_SAMPLES, "arc_length"))
    before = points[BEND_WINDOW:-BEND_WINDOW] - points[: -2 * BEND_WINDOW]
    behind = points[2 * BEND_WINDOW :] - points[BEND_WINDOW:-BEND_WINDOW]
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(before, behind), axis=1), (before * behind).sum(axis=1)))


def bends_at(positions: Array) -> Array:
    """The bend (N,) [rad] of a path (N, 3) around each of its waypoints."""
    angles = bends(positions)
    places = (np.arange(len(angles)) + BEND_WINDOW) / (BEND_SAMPLES - 1)
    return np.interp(fractions(positions), places, angles)


def _counted(unit: Unit) -> dict[str, Any]:
    return {"fraction": True} if unit == "share" else {} if unit == "waypoints" else {"unit": unit}


_DOCUMENTS: Mapping[str, Callable[[PathPart], dict[str, Any]]] = {
    "near": lambda p: (
        {"near": p.places[0]} | ({} if p.amount is None else {"within": p.amount}) | ({"of": p.of} if p.of else {})
    ),
    **dict.fromkeys(("first", "last"), lambda p: {p.kind: p.amount} | _counted(p.unit)),
    **dict.fromkeys(("middle", "turns", "every"), lambda p: {p.kind: p.amount}),
    **dict.fromkeys(("after", "before"), lambda p: {p.kind: p.places[0]}),
    "between": lambda p: {"from": p.places[0], "to": p.places[1]},
    "range": lambda p: {"range": [p.amount, p.until]} | ({} if p.unit == "waypoints" else {"unit": p.unit}),
    "heading": lambda p: {"heading": p.direction},
    "beyond": lambda p: {"beyond": p.direction, "by": p.amount},
    "indices": lambda p: {"count": p.count, "ranges": [list(pair) for pair in p.ranges]},
    "outside": lambda p: {"outside": p.parts[0].to_json()},
    **dict.fromkeys(("both", "either"), lambda p: {p.kind: [part.to_json() for part in p.parts]}),
}

_FIELDS: Mapping[str, Callable[[Any, Mapping[str, Any]], dict[str, Any]]] = {
    "near": lambda value, more: {"places": (value,), "amount": more.get("within"), "of": more.get("of", "")},
    **dict.fromkeys(("after", "before"), lambda value, _: {"places": (value,)}),
    "range": lambda value, more: {"amount": value[0], "until": value[1], "unit": _unit(more)},
    **dict.fromkeys(("heading", "beyond"), lambda value, more: {"direction": value, "amount": more.get("by")}),
    "outside": lambda value, _: {"parts": (PathPart.from_json(value),)},
    **dict.fromkeys(("both", "either"), lambda value, _: {"parts": tuple(map(PathPart.from_json, value))}),
}
"""What a part's value and the other keys of its document stand for; any other value is an amount."""


def _unit(document: Mapping[str, Any]) -> Unit:
    return "share" if document.get("fraction") else document.get("unit", "waypoints")


def _read(document: Mapping[str, Any]) -> PathPart:
    if "ranges" in document:
        pairs = tuple((int(a), int(b)) for a, b in document["ranges"])
        return PathPart("indices", ranges=pairs, count=int(document["count"]))
    if "from" in document:
        return between(document["from"], document["to"])
    kind = next((key for key in document if key in _MASKS), "")
    value = document[kind]
    if kind in _FIELDS:
        return PathPart(kind, **_FIELDS[kind](value, document))
    unit = _unit(document)
    return PathPart(kind, amount=float(value) if unit != "waypoints" else value, unit=unit)


def _distances(part: PathPart, trajectory: Trajectory, scene: Scene, i: int = 0) -> Array:
    return _core(part.places[i], trajectory, scene).depth(trajectory.positions)


def _core(what: Place, trajectory: Trajectory, scene: Scene, of: str = "centre") -> Cuboid:
    """What distances to a place are measured from: a point, or what `SceneObject.core` says of an object."""
    if isinstance(what, str) and what not in ("start", "goal"):
        return scene[what].core(trajectory.positions, of)
    return Cuboid(locate(what, trajectory, scene), np.eye(3), np.zeros(3))


def _nearest(part: PathPart, trajectory: Trajectory, scene: Scene, i: int = 0) -> int:
    return int(np.argmin(_distances(part, trajectory, scene, i)))


def _smallest(values: Array, share: float) -> Mask:
    """The given share of the smallest values, at least 3 of them."""
    count = min(len(values), max(3, round(share * len(values))))
    mask = np.zeros(len(values), dtype=bool)
    mask[np.argsort(values, kind="stable")[:count]] = True
    return mask


def _measure(trajectory: Trajectory, unit: Unit) -> Array:
    """How far each waypoint is from the start, in a unit, (N,)."""
    n = len(trajectory)
    if unit == "m":
        return trajectory.arc_length
    if unit == "s":
        return trajectory.times
    return np.arange(n, dtype=float) / (n - 1 if unit == "share" else 1)


def _near(part: PathPart, trajectory: Trajectory, scene: Scene) -> Mask:
    if part.amount is None:
        return _smallest(_distances(part, trajectory, scene), NEAREST)
    return within_core(trajectory.positions, _core(part.places[0], trajectory, scene, part.of), part.amount)


def _end(part: PathPart, trajectory: Trajectory, scene: Scene) -> Mask:
    """The first or the last so much."""
    n, amount, is_first = len(trajectory), part.amount or 0.0, part.kind == "first"
    if part.unit in ("m", "s"):
        along = _measure(trajectory, part.unit)
        return np.asarray((along if is_first else along[-1] - along) <= amount + 1e-9)
    count = max(1, round(amount * n)) if part.unit == "share" else int(amount)
    return np.asarray((np.arange(n) if is_first else np.arange(n)[::-1]) < count)


def _middle(part: PathPart, trajectory: Trajectory, scene: Scene) -> Mask:
    n = len(trajectory)
    return np.asarray(np.abs(np.arange(n) - (n - 1) / 2.0) <= max((part.amount or 0.0) * n / 2.0, 1.0))


def _range(part: PathPart, trajectory: Trajectory, scene: Scene) -> Mask:
    along = _measure(trajectory, part.unit)
    begin, end = part.amount or 0.0, along[-1] if part.until is None else part.until
    return np.asarray((along >= begin - 1e-9) & (along <= end + 1e-9))


def _between(part: PathPart, trajectory: Trajectory, scene: Scene) -> Mask:
    low, high = sorted(_nearest(part, trajectory, scene, i) for i in (0, 1))
    index = np.arange(len(trajectory))
    return (index >= low) & (index <= high)


def _heading(part: PathPart, trajectory: Trajectory, scene: Scene) -> Mask:
    steps = np.diff(trajectory.positions, axis=0)
    rising = steps @ scene.frame.direction(part.direction) > 1e-6 * np.linalg.norm(steps, axis=1)
    return np.concatenate([rising, rising[-1:]])


def _indices(part: PathPart, trajectory: Trajectory, scene: Scene) -> Mask:
    selected = np.zeros(part.count, dtype=bool)
    for a, b in part.ranges:
        selected[a : b + 1] = True
    n = len(trajectory)
    return selected if part.count == n else selected[np.rint(np.linspace(0, part.count - 1, n)).astype(int)]


def _outside(part: PathPart, trajectory: Trajectory, scene: Scene) -> Mask:
    (inner,) = part.parts
    if inner.kind != "near":
        return ~inner.mask(trajectory, scene)
    distance = _distances(inner, trajectory, scene)
    if inner.amount is None:
        return _smallest(-distance, FARTHEST)
    return np.asarray(distance > BEYOND * inner.amount)


def _every(part: PathPart, path: Trajectory, scene: Scene) -> Mask:
    step = int(part.amount or 1)
    if step < 1:
        raise ValueError(f"every {part.amount:g} waypoints is no part of a path; give a whole number of 1 or more")
    return np.asarray(np.arange(len(path)) % step == 0)


_MASKS: Mapping[str, Callable[[PathPart, Trajectory, Scene], Mask]] = {
    "near": _near,
    "first": _end,
    "last": _end,
    "middle": _middle,
    "after": lambda part, path, scene: np.arange(len(path)) >= _nearest(part, path, scene),
    "before": lambda part, path, scene: np.arange(len(path)) <= _nearest(part, path, scene),
    "between": _between,
    "range": _range,
    "every": _every,
    "heading": _heading,
    "beyond": lambda part, path, scene: path.positions @ scene.frame.direction(part.direction) > (part.amount or 0.0),
    "turns": lambda part, path, scene: _smallest(-bends_at(path.positions), part.amount or 0.0),
    "indices": _indices,
    "outside": _outside,
    "both": lambda part, path, scene: np.logical_and.reduce([p.mask(path, scene) for p in part.parts]),
    "either": lambda part, path, scene: np.logical_or.reduce([p.mask(path, scene) for p in part.parts]),
}


def _beyond_words(direction: str, metres: float) -> str:
    if direction in ("up", "down"):
        return f"where it is higher than {metres:g} m" if direction == "up" else f"where it is lower than {-metres:g} m"
    return f"further {direction} than {metres:g} m"


def _amount_words(part: PathPart) -> str:
    amount = part.amount or 0.0
    end = "in the " + part.kind
    if (part.unit, amount) == ("waypoints", 1.0):
        return f"at the {part.kind} waypoint"
    if part.unit == "share":
        return f"{end} {amount:.0%}"
    return f"{end} {amount:g} {'waypoints' if part.unit == 'waypoints' else part.unit}"


def _range_words(part: PathPart) -> str:
    begin = part.amount or 0.0
    if part.unit == "waypoints":
        if part.until is None:
            return f"from waypoint {begin + 1:g} on"
        return (
            "at waypoint " + f"{begin + 1:g}"
            if begin == part.until
            else f"from waypoint {begin + 1:g} to {part.until + 1:g}"
        )
    return f"from {begin:g} {part.unit} on" if part.until is None else f"from {begin:g} to {part.until:g} {part.unit}"


def _joined(parts: Sequence[PathPart], word: str) -> str:
    return text.listed([part.words() for part in parts], word)


_WORDS: Mapping[str, Callable[[PathPart], str]] = {
    "near": lambda p: f"near {named(p.places[0])}" + ("" if p.amount is None else f" (within {p.amount:g} m)"),
    "first": _amount_words,
    "last": _amount_words,
    "middle": lambda p: "in the middle",
    "after": lambda p: f"after {named(p.places[0])}",
    "before": lambda p: f"before {named(p.places[0])}",
    "between": lambda p: f"between {named(p.places[0])} and {named(p.places[1])}",
    "range": _range_words,
    "every": lambda p: (
        f"at every {text.counted(p.amount or 1, 'waypoint')}" if p.amount == 1 else f"at one waypoint in {p.amount:g}"
    ),
    "heading": lambda p: f"where it heads {p.direction}",
    "beyond": lambda p: _beyond_words(p.direction, p.amount or 0.0),
    "turns": lambda p: "in turns",
    "indices": lambda p: "at " + text.listed([text.waypoints(a, b) for a, b in p.ranges]),
    "outside": lambda p: f"except {p.parts[0].words()}",
    "both": lambda p: _joined(p.parts, "and"),
    "either": lambda p: _joined(p.parts, "or"),
}
