"""Which of the original's waypoints a check looks at, as JSON-able data."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np

from ovita.measure.predicates.pair import Pair
from ovita.measure.predicates.turning import turns_at
from ovita.paths.geometry import Mask

Where: TypeAlias = Mapping[str, Any]
"""A selection of waypoints, made by the functions of this module."""

NEAREST = 0.15
"""Without a radius, "near" is this share of the waypoints, the nearest ones ..."""

FARTHEST = 1 / 3
"""... and "away from" this share, the farthest ones."""

BEYOND = 1.25
"""With a radius, "away from" begins at so many radii, so that speeds may change gently at the border."""


def near(place: Any, within: float | None = None) -> Where:
    """Waypoints at most `within` metres from a place's centre; without it, the nearest 15 % of them."""
    return {"near": place} if within is None else {"near": place, "within": within}


def first(n: int | None = None, *, fraction: float | None = None) -> Where:
    """The first n waypoints, or the first fraction (0..1) of them."""
    return {"first": n} if fraction is None else {"first": fraction, "fraction": True}


def last(n: int | None = None, *, fraction: float | None = None) -> Where:
    """The last n waypoints, or the last fraction (0..1) of them."""
    return {"last": n} if fraction is None else {"last": fraction, "fraction": True}


def middle(fraction: float) -> Where:
    """A fraction (0..1) of the waypoints around the middle one."""
    return {"middle": fraction}


def after(place: Any) -> Where:
    """From the waypoint nearest to a place to the goal."""
    return {"after": place}


def before(place: Any) -> Where:
    """From the start to the waypoint nearest to a place."""
    return {"before": place}


def between(a: Any, b: Any) -> Where:
    """From the waypoint nearest to one place to the one nearest to another, in any order."""
    return {"from": a, "to": b}


def turns(fraction: float = 0.25) -> Where:
    """The fraction (0..1) of the waypoints at which the original path bends most."""
    return {"turns": fraction}


def outside(where: Where) -> Where:
    """What is clearly outside a selection: beyond 1.25 of its radius; for the nearest waypoints, the farthest third."""
    return {"outside": dict(where)}


def both(*parts: Where) -> Where:
    """What is part of every selection."""
    return {"both": [dict(part) for part in parts]}


def selected(pair: Pair, where: Where | None) -> Mask:
    """Which original waypoints a selection means, (N,); None means all.

    Raises:
        ValueError: If `where` is no selection.
        UnknownObject: If it names an object that the scene does not have.
    """
    n = len(pair.original)
    if where is None:
        return np.ones(n, dtype=bool)
    for key, select in _SELECTIONS.items():
        if key in where:
            return select(pair, where)
    raise ValueError(f"{dict(where)!r} selects no waypoints; use near, first, last, middle, after, between or turns")


def said(where: Where | None) -> str:
    """A selection in words, beginning with a blank; "" for everything."""
    if where is None:
        return ""
    if "both" in where:
        return " and".join(said(part) for part in where["both"])
    if "outside" in where:
        return " except" + said(where["outside"])
    if "near" in where:
        radius = f" (within {where['within']:g} m)" if "within" in where else ""
        return f" near {_named(where['near'])}{radius}"
    for key in ("first", "last"):
        if key in where:
            amount = where[key]
            return f" in the {key} {amount:.0%}" if "fraction" in where else f" in the {key} {amount} waypoints"
    if "middle" in where:
        return " in the middle"
    if "turns" in where:
        return " in turns"
    if "from" in where:
        return f" between {_named(where['from'])} and {_named(where['to'])}"
    key = "after" if "after" in where else "before"
    return f" {key} {_named(where[key])}"


def _named(place: Any) -> str:
    if isinstance(place, Mapping):
        return "the midpoint of " + " and ".join(_named(part) for part in place["between"])
    return f"the {place}" if isinstance(place, str) else "[" + ", ".join(f"{value:g}" for value in place) + "]"


def _distance(pair: Pair, place: Any) -> Any:
    return np.linalg.norm(pair.original[:, :3] - pair.place(place)[0], axis=1)


def _nearest(pair: Pair, place: Any) -> int:
    return int(np.argmin(_distance(pair, place)))


def _share(values: Any, fraction: float) -> Mask:
    """The given share of the smallest values, at least 3 of them."""
    count = min(len(values), max(3, round(fraction * len(values))))
    mask = np.zeros(len(values), dtype=bool)
    mask[np.argsort(values, kind="stable")[:count]] = True
    return mask


def _near(pair: Pair, where: Where) -> Mask:
    distance = _distance(pair, where["near"])
    return np.asarray(distance <= where["within"]) if "within" in where else _share(distance, NEAREST)


def _count(where: Where, key: str, n: int) -> int:
    return max(1, round(where[key] * n)) if "fraction" in where else int(where[key])


def _middle(pair: Pair, where: Where) -> Mask:
    n = len(pair.original)
    return np.asarray(np.abs(np.arange(n) - (n - 1) / 2.0) <= max(where["middle"] * n / 2.0, 1.0))


def _between(pair: Pair, where: Where) -> Mask:
    low, high = sorted((_nearest(pair, where["from"]), _nearest(pair, where["to"])))
    index = np.arange(len(pair.original))
    return (index >= low) & (index <= high)


def _outside(pair: Pair, where: Where) -> Mask:
    inner = where["outside"]
    if "both" in inner or "near" not in inner:
        return ~selected(pair, inner)
    distance = _distance(pair, inner["near"])
    if "within" in inner:
        return np.asarray(distance > BEYOND * inner["within"])
    return _share(-distance, FARTHEST)


_SELECTIONS: dict[str, Callable[[Pair, Where], Mask]] = {
    "both": lambda pair, where: np.logical_and.reduce([selected(pair, part) for part in where["both"]]),
    "outside": _outside,
    "near": _near,
    "first": lambda pair, where: np.arange(len(pair.original)) < _count(where, "first", len(pair.original)),
    "last": lambda pair, where: (
        np.arange(len(pair.original)) >= len(pair.original) - _count(where, "last", len(pair.original))
    ),
    "middle": _middle,
    "after": lambda pair, where: np.arange(len(pair.original)) >= _nearest(pair, where["after"]),
    "before": lambda pair, where: np.arange(len(pair.original)) <= _nearest(pair, where["before"]),
    "from": _between,
    "turns": lambda pair, where: _share(-turns_at(pair.original[:, :3]), where["turns"]),
}
