"""Checks of where the path goes: shifted, its ends, its bounds, its clearance from objects, via points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, Unpack

import numpy as np

from ovita.measure.predicates.check import (
    EDGE,
    FEW,
    GONE,
    CheckResult,
    Pair,
    Where,
    predicate,
    said,
    say,
    selected,
    stated,
)
from ovita.paths.geometry import Mask, closest_to_point, fractions, lengths, path_distances, runs
from ovita.paths.scene import DIRECTIONS
from ovita.paths.trajectory import Array
from ovita.toolkit.approach import radius_of
from ovita.toolkit.arguments import OffsetLimits

Amount: TypeAlias = Literal["little", "much"]

BY: Mapping[Amount, str] = {"little": ", but only a little", "much": ", by a lot"}

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
def min_distance(pair: Pair, place: Any, at_least: float, *, where: Where = None) -> CheckResult:
    """The path stays at least so many metres from an object's centre, or from its surface where it has dimensions.

    Measured along the segments; 10 % nearer will do.
    """
    (centre, name), item = pair.place(place), pair.item(place)
    rows = pair.stretch(where)
    sized = item is not None and item.dimensions is not None
    near = float(item.cuboid.closest(rows)[0]) if item and sized else closest_to_point(rows, centre)[0]
    wish = f"keep {at_least:g} m from {name}{said(where)}"
    return say(near >= 0.9 * at_least, wish, f"the path comes within {near:.3f} m of {name}")


@predicate
def max_distance(pair: Pair, place: Any, at_most: float, *, where: Where = None) -> CheckResult:
    """No selected waypoint is farther from a place's centre than so many metres (5 % more will do)."""
    centre, name = pair.place(place)
    rows = pair.part(where)[1]
    most = float(np.linalg.norm(rows[:, :3] - centre, axis=1).max()) if len(rows) else np.inf
    fact = f"the path is up to {most:.3f} m from {name}"
    return say(most <= 1.05 * at_most, f"stay within {at_most:g} m of {name}{said(where)}", fact)


@predicate
def passes_through(pair: Pair, place: Any, *, within: float | None = None) -> CheckResult:
    """The path passes through a place, within some metres (5 % of the extent unless given), or touches the object."""
    centre, name = pair.place(place)
    allowed = EDGE * pair.extent if within is None else within
    distance, item = closest_to_point(pair.adapted[:, :3], centre)[0], pair.item(place)
    if item is not None and item.dimensions is not None:
        gap = item.cuboid.closest(pair.adapted[:, :3])[0]
        distance = max(gap, 0.0) if gap <= pair.noticeable else distance
    fact = f"the path comes within {distance:.3f} m of {name} (at most {allowed:.3f} m)"
    return say(distance <= allowed, f"pass through {name}", fact)


@predicate
def passes_between(pair: Pair, a: Any, b: Any, level: bool = False) -> CheckResult:
    """The path crosses the line between two places in its middle three fifths, or passes it by less than 15 % of it.

    Where it is `level`, heights do not count, unless one place is above the other.
    """
    (p, first), (q, second) = pair.place(a), pair.place(b)
    fine, up = pair.fine, pair.scene.frame.direction("up")
    flat = np.eye(3) - np.outer(up, up)
    if level and np.linalg.norm(flat @ (q - p)) > np.linalg.norm(q - p) / 2.0:
        p, q, fine = flat @ p, flat @ q, fine @ flat
    gap = float(np.linalg.norm(q - p))
    share = (fine - p) @ (q - p) / max(gap**2, 1e-12)
    off = np.linalg.norm(fine - p - share[:, None] * (q - p), axis=1)
    off = np.where((share >= 0.2) & (share <= 0.8), off, np.inf)
    least = float(off.min())
    beside, line = "it passes beside them", f"the path passes {least:.3f} m from the line between them"
    fact = line if np.isfinite(least) else beside
    return say(least <= 0.15 * gap, f"pass between {first} and {second}", fact)


@predicate
def passes_over(pair: Pair, place: Any) -> CheckResult:
    """The path passes above a place: over the footprint of an object, give or take 3 % of the extent, above its top.

    Without dimensions, the footprint's radius is 5 % of the extent and the top 1 % of it above the centre.
    """
    centre, name = pair.place(place)
    up = pair.scene.frame.direction("up")
    item = pair.item(place)
    size = None if item is None else item.dimensions
    if size is None:
        height, footprint = pair.noticeable, EDGE * pair.extent
    else:
        height = float(size @ np.abs(up)) / 2.0
        footprint = float(np.linalg.norm(size * (1.0 - np.abs(up)))) / 2.0
    fine = pair.fine - centre
    rise = fine @ up
    beside = np.linalg.norm(fine - rise[:, None] * up, axis=1)
    above = rise > height
    least = float(beside[above].min()) if above.any() else np.inf
    fact = f"above it the path comes within {least:.3f} m of its vertical" if above.any() else "it is never above it"
    return say(least <= footprint + 3 * pair.noticeable, f"pass over {name}", fact)


@dataclass(frozen=True)
class _Approach:
    """How distances to places change over the masked waypoints, from rows (N, 3); sign +1: farther, -1: closer."""

    pair: Pair
    rows: Array
    mask: Mask
    sign: float
    whole: bool

    def distances(self, centre: Array) -> tuple[tuple[float, float], tuple[float, float]]:
        """Old and new nearest distance, and old and new average over the nearest quarter [m]."""
        now, mask = self.pair.matched[:, :3], self.mask
        old, new = lengths(self.rows - centre), lengths(now - centre)
        part = np.flatnonzero(mask)[np.argsort(old[mask], kind="stable")[: max(3, round(NEAR_SHARE * mask.sum()))]]
        around = float(old[part].mean()), float(new[part].mean())
        if self.whole:
            return (
                closest_to_point(self.rows, centre)[0],
                closest_to_point(self.pair.adapted[:, :3], centre)[0],
            ), around
        return (_part_distance(self.rows, mask, centre), _part_distance(now, mask, centre)), around

    def gains(self, centre: Array) -> tuple[float, float]:
        """By how much the nearest distance and the average of the nearest quarter changed as asked [m]."""
        least, around = self.distances(centre)
        return self.sign * (least[1] - least[0]), self.sign * (around[1] - around[0])

    def changes(self, centre: Array) -> Array:
        """By how much each waypoint's distance changed as asked [m]."""
        change = lengths(self.pair.matched[:, :3] - centre) - lengths(self.rows - centre)
        return np.asarray(self.sign * change[self.mask])

    def held(self, centre: Array, arrived: bool) -> bool:
        """Whether both distances grew, or the nearest point came closer, or its quarter did and nothing went away."""
        nearest, quarter = self.gains(centre)
        least = self.pair.noticeable
        if self.sign > 0:
            return min(nearest, quarter) >= least
        if nearest >= least and quarter >= -least:
            return True
        together = quarter >= least and float(self.changes(centre).mean()) >= -least
        return together and (arrived or nearest >= -0.5 * least)

    def rival(self, centre: Array) -> tuple[str, float]:
        """The other, non-adjacent object with the largest distance change of the same sign, and that change."""
        others = [o for o in self.pair.scene if np.linalg.norm(o.position - centre) > 3 * EDGE * self.pair.extent]
        gains = {"": 0.0} | {o.name: max(self.gains(o.position)) for o in others}
        return max(gains.items(), key=lambda gain: gain[1])


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
    (centre, name), item = pair.place(place), pair.item(place)
    mask = selected(pair, where) & pair.found
    wish = f"come closer to {name}{said(where)}" if sign < 0 else f"stay farther from {name}{said(where)}"
    if not mask.any():
        return say(False, wish, GONE)
    rows = pair.original[:, :3] + pair.scene.frame.offset(**(after or {}))
    measured = _Approach(pair, rows, mask, sign, where is None)
    (least, around), gain = measured.distances(centre), measured.gains(centre)
    fact = f"the nearest distance to {name} went from {least[0]:.3f} to {least[1]:.3f} m"
    if abs(around[0] - least[0]) > pair.noticeable:
        fact += f", the average of its nearest quarter from {around[0]:.3f} to {around[1]:.3f} m"
    size = 0.0 if item is None else item.radius  # that the limits spare; without dimensions that of a small cube
    arrived = sign < 0 and least[1] <= max(EDGE * pair.extent, size + pair.noticeable)
    held = measured.held(centre, arrived)
    if where is not None:
        share = float((measured.changes(centre) > 0).mean())
        held, fact = held and share >= 0.75, f"{fact}; {share:.0%} of these waypoints did"
    rival, more = measured.rival(centre) if aimed and not arrived else ("", 0.0)
    if rival and more > RIVAL * max(gain):
        held, fact = False, f"{fact}, but that to the {rival} changed more, by {more:.3f} m"
    if by is not None:
        wish += f" by {by:g} m"
        reached = sign < 0 and least[1] <= radius_of(item) + pair.noticeable
        held = held and (reached or abs(gain[0] - by) <= max(0.15 * by, 0.5 * pair.noticeable))
    if amount is not None:
        wish += BY[amount]
        held = held and _fits(amount, sign, max(gain), pair.extent, least[0], around[0])
    return say(held, wish, fact)


def _fits(amount: Amount, sign: float, gain: float, extent: float, nearest: float, quarter: float) -> bool:
    """Whether a gain is "little" or "much", by the extent and the old distances of nearest point and quarter [m]."""
    if amount == "little":
        return gain <= (max(0.5 * nearest, 0.15 * extent) if sign < 0 else 0.3 * extent)
    return gain >= (min(0.02 * extent, 0.25 * quarter) if sign < 0 else 0.02 * extent)


def _multiplied(pair: Pair, place: Any, times: float, where: Where) -> CheckResult:
    centre, name = pair.place(place)
    wish = f"multiply the distance to {name} by {times:g}{said(where)}"
    old, new = (np.linalg.norm(rows[:, :3] - centre, axis=1) for rows in pair.part(where))
    if not len(old):
        return say(False, wish, GONE)
    ratio = new / np.maximum(old, 1e-9)
    right = float((np.abs(ratio / times - 1.0) <= 0.15).mean())
    fact = f"the distance became {np.median(ratio):.2f} times as large (median; right for {right:.0%} of the waypoints)"
    return say(right >= 0.8, wish, fact)


def _part_distance(rows: Array, mask: Mask, centre: Array) -> float:
    """Distance [m] of the selected stretches of a path (N, 3) to a point (3,), between waypoints too."""
    return min(closest_to_point(rows[[a, *range(a, b + 1)]], centre)[0] for a, b in runs(mask))


LEAST_SHIFT, MOST_LITTLE, LEAST_MUCH = 0.02, 0.3, 0.08
"""Average shifts as shares of the extent: the least that counts, the most that is "a little", the least for "a lot"."""

STRAY = 0.5
"""How far the path may stray across the asked direction, as a share of the shift along it."""


@predicate
def moved(
    pair: Pair,
    direction: str | None = None,
    *,
    amount: Amount | None = None,
    where: Where = None,
    tolerance: float = 0.1,
    only: bool = True,
    **metres: Unpack[OffsetLimits],
) -> CheckResult:
    """The path moved in a direction (by any amount), or by metres along direction words.

    An amount holds on average, or at most and half of it on average where an end was kept or edges are soft.

    Args:
        direction: A direction word, for any amount of at least 2 % of the extent on average.
        amount: "little": at most 30 % of the extent on average; "much": at least 8 %.
        where: Only these waypoints.
        tolerance: Share of an amount by which it may be missed.
        only: Whether the path must not stray in other directions by more than half as much.
        metres: Metres along direction words, such as left=0.2.
    """
    words = _words(direction, metres)
    mask = selected(pair, where) & pair.found
    wish = f"move the path{said(where)} {_spoken(words)}"
    if not mask.any():
        return say(False, wish, GONE)
    shifts = {word: pair.along(word)[mask] for word in words}
    held = all(_shifted(pair, along, words[word], amount, tolerance) for word, along in shifts.items())
    wish += {"little": BY["little"], "much": " by a lot"}.get(amount or "", "")
    fact = "on average it moved " + " and ".join(f"{along.mean():.3f} m {word}" for word, along in shifts.items())
    if only:
        stray, across = _stray(pair, words, mask)
        limit = max(STRAY * float(np.linalg.norm([s.mean() for s in shifts.values()])), 2 * pair.noticeable)
        if stray > limit:
            held, fact = False, f"{fact}, but also {stray:.3f} m {across}"
    return say(held, wish, fact)


def _shifted(pair: Pair, along: Array, asked: float | None, amount: Amount | None, tolerance: float) -> bool:
    """Whether shifts along a direction [m] are those that were asked for."""
    mean, most = float(along.mean()), float(along.max())
    if asked is not None:
        slack = max(tolerance * abs(asked), 0.5 * pair.noticeable)
        return abs(mean - asked) <= slack or (abs(most - asked) <= slack and mean >= asked / 2.0)
    least = LEAST_MUCH if amount == "much" else LEAST_SHIFT
    most = MOST_LITTLE if amount == "little" else np.inf
    return least * pair.extent <= mean <= most * pair.extent and float((along > -pair.noticeable).mean()) >= 0.9


@predicate
def start_moved(
    pair: Pair, direction: str | None = None, *, only: bool = True, **metres: Unpack[OffsetLimits]
) -> CheckResult:
    """The start moved in a direction, or by metres along direction words; `only`: and in no other."""
    return _end_moved(pair, 0, "start", _words(direction, metres), only)


@predicate
def goal_moved(
    pair: Pair, direction: str | None = None, *, only: bool = True, **metres: Unpack[OffsetLimits]
) -> CheckResult:
    """The goal moved in a direction, or by metres along direction words; `only`: and in no other."""
    return _end_moved(pair, -1, "goal", _words(direction, metres), only)


@predicate
def starts_at(pair: Pair, place: Any, *, within: float | None = None) -> CheckResult:
    """The path starts at a place, within some metres (5 % of the extent unless given), or on the object's surface."""
    return _ends_at(pair, 0, "start", place, within)


@predicate
def ends_at(pair: Pair, place: Any, *, within: float | None = None) -> CheckResult:
    """The path ends at a place, within some metres (5 % of the extent unless given), or on the object's surface."""
    return _ends_at(pair, -1, "end", place, within)


@predicate
def kept(pair: Pair, where: Where = None) -> CheckResult:
    """The selected waypoints are where they were, 95 % of them within 2 % of the extent, but for sparing an object."""
    mask = selected(pair, where)
    off = np.linalg.norm(pair.shift[mask], axis=1)
    off = np.where(np.isfinite(off), off, pair.uncovered[mask])
    off = np.maximum(off - pair.leeway(pair.original[mask, :3]), 0.0)
    share = float((off <= 2 * pair.noticeable).mean()) if len(off) else 1.0
    fact = f"waypoints{said(where)} moved by up to {off.max() if len(off) else 0.0:.3f} m"
    return say(share >= 0.95, f"leave the path{said(where)} as it was", fact)


@predicate
def growing(pair: Pair, direction: str, along: str = "path", *, exponential: bool = False) -> CheckResult:
    """The shift in a direction grows along the path, or along another direction.

    Args:
        direction: A direction word: what grows is the shift along it.
        along: "path", or the direction word towards which it grows.
        exponential: Whether it must grow ever faster: its middle lies below the chord.
    """
    along_path = fractions(pair.original[:, :3])
    toward = along_path if along == "path" else pair.original[:, :3] @ pair.scene.frame.direction(along)
    gain, place = pair.along(direction)[pair.found], toward[pair.found]
    wish = f"move the path {direction} more and more towards {'its goal' if along == 'path' else 'the ' + along}"
    wish += ", ever faster" if exponential else ""
    if len(gain) < 5:
        return say(False, wish, FEW)
    order = np.argsort(place, kind="stable")
    fifth = max(1, len(gain) // 5)
    low, high = float(gain[order[:fifth]].mean()), float(gain[order[-fifth:]].mean())
    rank = _rank_correlation(place, gain)
    held = rank >= 0.7 and high - low >= LEAST_SHIFT * pair.extent and float(gain.mean()) > 0
    fact = f"the shift {direction} grows from {low:.3f} to {high:.3f} m (rank correlation {rank:.2f})"
    if exponential:
        span = np.ptp(place) or 1.0
        share = (place - place.min()) / span
        chord = float((low + (high - low) * share - gain).mean())
        held = held and chord > 0.05 * (high - low)
        fact += f" and is {chord:.3f} m below the straight line"
    return say(held, wish, fact)


@predicate
def never_beyond(pair: Pair, **metres: Unpack[OffsetLimits]) -> CheckResult:
    """No waypoint's coordinate along a direction word exceeds the bound [m]: left=0 means never left of the origin."""
    bounds = stated(metres)
    excess = {w: float((pair.adapted[:, :3] @ pair.scene.frame.direction(w)).max()) - b for w, b in bounds.items()}
    worst = max(excess, key=lambda word: excess[word])
    fact = f"the path goes {max(excess[worst], 0.0):.3f} m beyond its bound on the {worst} side"
    wish = "stay within " + ", ".join(f"{bound:g} m {word}" for word, bound in bounds.items())
    return say(excess[worst] <= pair.noticeable, wish, fact)


@predicate
def level(pair: Pair, height: float, *, direction: str = "up") -> CheckResult:
    """Nine of ten waypoints have one coordinate along a direction: a height [m], within 10 % or 1 % of the extent."""
    heights = pair.adapted[:, :3] @ pair.scene.frame.direction(direction)
    share = float((np.abs(heights - height) <= max(0.1 * abs(height), pair.noticeable)).mean())
    axis = pair.scene.frame.direction(direction)
    old, new = (rows[:, :3] - np.outer(rows[:, :3] @ axis, axis) for rows in (pair.original, pair.adapted))
    stray = float(path_distances(new, old).mean())
    fact = f"{share:.0%} of the waypoints are there; heights run from {heights.min():.3f} to {heights.max():.3f} m"
    if stray > EDGE * pair.extent:
        fact += f", and the path moved {stray:.3f} m sideways"
    return say(share >= 0.9 and stray <= EDGE * pair.extent, f"stay {height:g} m {direction} all the way", fact)


def _words(direction: str | None, metres: OffsetLimits) -> dict[str, float | None]:
    named: dict[str, float | None] = {**({} if direction is None else {direction: None}), **stated(metres)}
    if not named or not set(named) <= set(DIRECTIONS):
        raise ValueError(f"give a direction or metres along one; directions are {', '.join(DIRECTIONS)}")
    return named


def _spoken(words: dict[str, float | None]) -> str:
    return " and ".join(word if amount is None else f"{amount:g} m {word}" for word, amount in words.items())


def _stray(pair: Pair, words: dict[str, float | None], mask: Any) -> tuple[float, str]:
    """The largest mean shift along an axis that was not requested, and its direction word."""
    frame = pair.scene.frame
    free = [w for w in DIRECTIONS if not any(abs(frame.direction(w) @ frame.direction(o)) > 0.5 for o in words)]
    shifts = {word: float(pair.along(word)[mask].mean()) for word in free}
    worst = max(shifts, key=lambda word: shifts[word], default="")
    return (shifts[worst], worst) if worst else (0.0, "")


def _end_moved(pair: Pair, row: int, kind: str, words: dict[str, float | None], only: bool) -> CheckResult:
    shift = pair.adapted[row, :3] - pair.original[row, :3]
    axes = {word: pair.scene.frame.direction(word) for word in words}
    rest = shift - sum((shift @ axis) * axis for axis in axes.values())
    held = all(_shifted(pair, shift[None] @ axis, words[word], None, 0.1) for word, axis in axes.items())
    fact = "it moved " + " and ".join(f"{shift @ axis:.3f} m {word}" for word, axis in axes.items())
    stray = float(np.linalg.norm(rest))
    if only and stray > max(STRAY * float(np.linalg.norm(shift - rest)), 2 * pair.noticeable):
        held, fact = False, f"{fact}, but also {stray:.3f} m in other directions"
    return say(held, f"move the {kind} {_spoken(words)}", f"{fact} (the {kind})")


def _ends_at(pair: Pair, row: int, kind: str, place: Any, within: float | None) -> CheckResult:
    centre, name = pair.place(place)
    allowed = EDGE * pair.extent if within is None else within
    end, item = pair.adapted[row, :3], pair.item(place)
    miss = float(np.linalg.norm(end - centre))
    if item is not None and item.dimensions is not None:
        gap = abs(float(item.cuboid.signed(end[None])[0][0]))
        miss = min(miss, gap) if gap <= pair.noticeable else miss
    fact = f"the {kind} is {miss:.3f} m from {name} (at most {allowed:.3f} m)"
    return say(miss <= allowed, f"{kind} at {name}", fact)


def _rank_correlation(a: Array, b: Array) -> float:
    x, y = (np.argsort(np.argsort(v, kind="stable"), kind="stable") for v in (a, b))
    return 0.0 if min(np.ptp(a), np.ptp(b)) < 1e-9 else float(np.corrcoef(x, y)[0, 1])
