"""Checks of clearance from objects and of via points."""

from __future__ import annotations

from typing import Any, Literal, TypeAlias

import numpy as np

from ovita.measure.predicates.check import CheckResult, predicate, say
from ovita.measure.predicates.pair import EDGE, Pair, Where, said, selected
from ovita.paths.geometry import Mask, closest_to_point, runs
from ovita.paths.trajectory import Array, interpolate, source_indices
from ovita.toolkit.approach import radius_of

Amount: TypeAlias = Literal["little", "much"]

RIVAL = 1.5
"""If the distance to another object changes so many times as much, that object was meant."""

NEAR_SHARE = 0.25
"""The part of the waypoints that "the path near an object" means."""


@predicate
def closer(
    pair: Pair,
    place: Any,
    *,
    by: float | None = None,
    amount: Amount | None = None,
    where: Where = None,
    after: dict[str, float] | None = None,
    aimed: bool = True,
) -> CheckResult:
    """The path comes closer to a place: its nearest point or its nearest quarter, and neither recedes.

    Args:
        pair: What is compared.
        place: An object's name, a point [m], "start", "goal" or {"between": [a, b]}.
        by: So much at the nearest point [m]; reaching the object's bounding sphere will do.
        amount: "little": by at most half of the distance or 15 % of the extent; "much": by at least 2 % of the
            extent or a quarter of the distance.
        where: Only these waypoints, and three quarters of them.
        after: Measured against the original shifted by these direction words in metres, where another clause
            of the instruction shifts the path.
        aimed: Whether the path must not come 1.5 times as much closer to another object.
    """
    return _approach(pair, place, -1.0, by, amount, where, after, aimed)


@predicate
def farther(
    pair: Pair,
    place: Any,
    *,
    by: float | None = None,
    times: float | None = None,
    amount: Amount | None = None,
    where: Where = None,
    after: dict[str, float] | None = None,
    aimed: bool = True,
) -> CheckResult:
    """The path stays farther from a place: its nearest point and its nearest quarter are farther away.

    Args:
        pair: What is compared.
        place: An object's name, a point [m], "start", "goal" or {"between": [a, b]}.
        by: So much at the nearest point [m].
        times: Every waypoint's distance is multiplied by this factor.
        amount: "little": by at most 30 % of the extent; "much": by at least 2 % of it.
        where: Only these waypoints.
        after: As for `closer`.
        aimed: Whether the path must not go 1.5 times as much away from another object.
    """
    if times is not None:
        return _multiplied(pair, place, times, where)
    return _approach(pair, place, 1.0, by, amount, where, after, aimed)


@predicate
def min_distance(pair: Pair, place: Any, at_least: float) -> CheckResult:
    """The path stays at least so many metres from an object's centre, or from its surface where it has dimensions.

    Measured along the segments; 10 % nearer will do.
    """
    centre, name = pair.place(place)
    item = pair.scene[place] if isinstance(place, str) and place in pair.scene else None
    if item is not None and item.dimensions is not None:
        surface = item.cuboid.closest(pair.adapted[:, :3])[0]
    else:
        surface = _path_distance(pair.adapted, centre)
    fact = f"the path comes within {surface:.3f} m of {name}"
    return say(surface >= 0.9 * at_least, f"keep {at_least:g} m from {name}", fact)


@predicate
def max_distance(pair: Pair, place: Any, at_most: float, *, where: Where = None) -> CheckResult:
    """No selected waypoint is farther from a place's centre than so many metres (5 % more will do)."""
    centre, name = pair.place(place)
    rows = pair.matched[selected(pair, where) & pair.found]
    most = float(np.linalg.norm(rows[:, :3] - centre, axis=1).max()) if len(rows) else np.inf
    fact = f"the path is up to {most:.3f} m from {name}"
    return say(most <= 1.05 * at_most, f"stay within {at_most:g} m of {name}{said(where)}", fact)


@predicate
def passes_through(pair: Pair, place: Any, *, within: float | None = None) -> CheckResult:
    """The path passes through a place, within some metres (5 % of the extent unless given)."""
    centre, name = pair.place(place)
    allowed = EDGE * pair.extent if within is None else within
    distance = _path_distance(pair.adapted, centre)
    return say(
        distance <= allowed,
        f"pass through {name}",
        f"the path comes within {distance:.3f} m of {name} (at most {allowed:.3f} m)",
    )


@predicate
def passes_between(pair: Pair, a: Any, b: Any) -> CheckResult:
    """The path crosses the line between two places in its middle three fifths, or passes it by less than 15 % of it."""
    (p, first), (q, second) = pair.place(a), pair.place(b)
    gap = float(np.linalg.norm(q - p))
    fine = interpolate(pair.adapted[:, :3], source_indices(pair.adapted[:, :3], 2000, "arc_length"))
    share = (fine - p) @ (q - p) / max(gap**2, 1e-12)
    off = np.linalg.norm(fine - p - share[:, None] * (q - p), axis=1)
    off = np.where((share >= 0.2) & (share <= 0.8), off, np.inf)
    least = float(off.min())
    fact = (
        f"the path passes {least:.3f} m from the line between them" if np.isfinite(least) else "it passes beside them"
    )
    return say(least <= 0.15 * gap, f"pass between {first} and {second}", fact)


@predicate
def passes_over(pair: Pair, place: Any) -> CheckResult:
    """The path passes above a place: over the footprint of an object, give or take 3 % of the extent, above its top.

    Without dimensions, the footprint's radius is 5 % of the extent and the top 1 % of it above the centre.
    """
    centre, name = pair.place(place)
    up = pair.scene.frame.direction("up")
    size = pair.scene[place].dimensions if isinstance(place, str) and place in pair.scene else None
    if size is None:
        height, footprint = pair.noticeable, EDGE * pair.extent
    else:
        height = float(size @ np.abs(up)) / 2.0
        footprint = float(np.linalg.norm(size * (1.0 - np.abs(up)))) / 2.0
    fine = interpolate(pair.adapted[:, :3], source_indices(pair.adapted[:, :3], 2000, "arc_length")) - centre
    rise = fine @ up
    beside = np.linalg.norm(fine - rise[:, None] * up, axis=1)
    above = rise > height
    least = float(beside[above].min()) if above.any() else np.inf
    fact = f"above it the path comes within {least:.3f} m of its vertical" if above.any() else "it is never above it"
    return say(least <= footprint + 3 * pair.noticeable, f"pass over {name}", fact)


def _approach(
    pair: Pair,
    place: Any,
    sign: float,
    by: float | None,
    amount: Amount | None,
    where: Where,
    after: dict[str, float] | None,
    aimed: bool,
) -> CheckResult:
    """Sign +1: farther, -1: closer."""
    centre, name = pair.place(place)
    rows = pair.original[:, :3] + (pair.scene.frame.offset(**after) if after else 0.0)
    mask = selected(pair, where) & pair.found
    wish = f"come closer to {name}{said(where)}" if sign < 0 else f"stay farther from {name}{said(where)}"
    if not mask.any():
        return say(False, wish, "none of those waypoints is left")
    least, around = _distances(pair, rows, centre, mask, whole=where is None)
    gain = sign * (least[1] - least[0]), sign * (around[1] - around[0])
    fact = f"the nearest distance to {name} went from {least[0]:.3f} to {least[1]:.3f} m"
    if abs(around[0] - least[0]) > pair.noticeable:
        fact += f", the average of its nearest quarter from {around[0]:.3f} to {around[1]:.3f} m"
    if sign < 0:
        arrived = least[1] <= max(EDGE * pair.extent, _size(pair, place) + pair.noticeable)
        every = float(
            (np.linalg.norm(rows - centre, axis=1) - np.linalg.norm(pair.matched[:, :3] - centre, axis=1))[mask].mean()
        )
        nearer = gain[0] >= pair.noticeable and gain[1] >= -pair.noticeable
        quarter = gain[1] >= pair.noticeable and every >= -pair.noticeable
        held = nearer or (quarter and (arrived or gain[0] >= -0.5 * pair.noticeable))
    else:
        arrived, held = False, min(gain) >= pair.noticeable
    if where is not None:
        change = np.linalg.norm(pair.matched[:, :3] - centre, axis=1) - np.linalg.norm(rows - centre, axis=1)
        share = float((sign * change[mask] > 0).mean())
        held, fact = held and share >= 0.75, f"{fact}; {share:.0%} of these waypoints did"
    if aimed and not arrived:
        rival, more = _rival(pair, rows, centre, mask, sign, whole=where is None)
        if more > RIVAL * max(gain):
            held, fact = False, f"{fact}, but that to the {rival} changed more, by {more:.3f} m"
    if by is not None:
        wish += f" by {by:g} m"
        reached = sign < 0 and least[1] <= _radius(pair, place) + pair.noticeable
        held = held and (reached or abs(gain[0] - by) <= max(0.15 * by, 0.5 * pair.noticeable))
    if amount == "little":
        limit = max(0.5 * least[0], 0.15 * pair.extent) if sign < 0 else 0.3 * pair.extent
        wish, held = f"{wish}, but only a little", held and max(gain) <= limit
    elif amount == "much":
        limit = min(0.02 * pair.extent, 0.25 * around[0]) if sign < 0 else 0.02 * pair.extent
        wish, held = f"{wish}, by a lot", held and max(gain) >= limit
    return say(held, wish, fact)


def _distances(
    pair: Pair, rows: Array, centre: Array, mask: Mask, *, whole: bool
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Old and new nearest distance, and old and new average over the nearest quarter [m]."""
    old, new = np.linalg.norm(rows - centre, axis=1), np.linalg.norm(pair.matched[:, :3] - centre, axis=1)
    part = np.flatnonzero(mask)[np.argsort(old[mask], kind="stable")[: max(3, round(NEAR_SHARE * mask.sum()))]]
    if whole:
        least = _path_distance(rows, centre), _path_distance(pair.adapted, centre)
    else:
        least = _part_distance(rows, mask, centre), _part_distance(pair.matched[:, :3], mask, centre)
    return least, (float(old[part].mean()), float(new[part].mean()))


def _rival(pair: Pair, rows: Array, centre: Array, mask: Mask, sign: float, *, whole: bool) -> tuple[str, float]:
    """The other, non-adjacent object with the largest distance change of the same sign, and that change."""
    gains = {"": 0.0}
    for item in pair.scene:
        if np.linalg.norm(item.position - centre) > 3 * EDGE * pair.extent:
            least, around = _distances(pair, rows, item.position, mask, whole=whole)
            gains[item.name] = max(sign * (least[1] - least[0]), sign * (around[1] - around[0]))
    name = max(gains, key=lambda one: gains[one])
    return name, gains[name]


def _size(pair: Pair, place: Any) -> float:
    """Radius of the bounding sphere that the limits spare; an object without dimensions is a small cube [m]."""
    return pair.scene[place].radius if isinstance(place, str) and place in pair.scene else 0.0


def _radius(pair: Pair, place: Any) -> float:
    return radius_of(pair.scene[place]) if isinstance(place, str) and place in pair.scene else 0.0


def _multiplied(pair: Pair, place: Any, times: float, where: Where) -> CheckResult:
    centre, name = pair.place(place)
    mask = selected(pair, where) & pair.found
    wish = f"multiply the distance to {name} by {times:g}{said(where)}"
    if not mask.any():
        return say(False, wish, "none of those waypoints is left")
    old = np.linalg.norm(pair.original[mask, :3] - centre, axis=1)
    ratio = np.linalg.norm(pair.matched[mask, :3] - centre, axis=1) / np.maximum(old, 1e-9)
    right = float((np.abs(ratio / times - 1.0) <= 0.15).mean())
    fact = f"the distance became {np.median(ratio):.2f} times as large (median; right for {right:.0%} of the waypoints)"
    return say(right >= 0.8, wish, fact)


def _path_distance(rows: Array, centre: Array) -> float:
    return closest_to_point(rows[:, :3], centre)[0]


def _part_distance(rows: Array, mask: Mask, centre: Array) -> float:
    """Distance [m] of the selected stretches of a path (N, 3) to a point (3,), between waypoints too."""
    return min(closest_to_point(rows[[a, *range(a, b + 1)]], centre)[0] for a, b in runs(mask))
