"""Checks of single requests: passing objects at a side or a distance, ends beside them, bounds, sizes, counts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from ovita.measure.predicates.check import FEW, GONE, CheckResult, Pair, Where, predicate, said, say, selected
from ovita.measure.predicates.shape import net_turning, swept
from ovita.paths.geometry import closest_to_point, fractions, lengths, path_distances, project, runs
from ovita.paths.part import PathPart, outside
from ovita.paths.trajectory import Array, arc_length, interpolate

End = Literal["start", "goal"]
Nearing = Literal["closer", "farther"]

AIM = 0.15
"""Share of an amount by which a distance or a size may be missed."""


@predicate
def passes_at(pair: Pair, place: Any, at_most: float, *, at_least: float = 0.0, where: Where = None) -> CheckResult:
    """The closest approach to a place's centre or surface is within some metres (5 % more will do)."""
    centre, name = pair.place(place)
    rows = pair.stretch(where)
    to_centre = closest_to_point(rows, centre)[0]
    item = pair.item(place)
    surface = float(item.cuboid.closest(rows)[0]) if item is not None else to_centre
    slack = max(0.05 * at_most, 0.5 * pair.noticeable)
    held = surface <= at_most + slack and to_centre >= at_least - slack
    fact = f"the path comes within {to_centre:.3f} m of the centre of {name}, {surface:.3f} m of its surface"
    return say(held, f"pass {name} within {at_most:g} m{said(where)}", fact)


@predicate
def part_approached(pair: Pair, place: Any, sense: Nearing, *, where: Where = None) -> CheckResult:
    """A part of the path comes closer to a place, or stays farther from it, at its closest point."""
    centre, name = pair.place(place)
    wish, parts = f"come {sense} to {name}{said(where)}", pair.part(where)
    if not len(parts[0]):
        return say(False, wish, GONE)
    old, new = (float(lengths(rows[:, :3] - centre).min()) for rows in parts)
    held = (new - old) * (1.0 if sense == "farther" else -1.0) >= 0.5 * pair.noticeable
    return say(held, wish, f"the distance went from {old:.3f} to {new:.3f} m")


@predicate
def passes_beyond(
    pair: Pair, place: Any, direction: str, *, by: float | None = None, exactly: bool = False
) -> CheckResult:
    """The path passes a place along a direction, as over it or under it: beyond its surface at its axis.

    Args:
        direction: "up" for over, "down" for under, and any other direction word.
        by: At least so far beyond the surface [m], 15 % less will do.
        exactly: Nor farther, but for 15 %.
    """
    centre, name = pair.place(place)
    axis = pair.scene.frame.direction(direction)
    fine = pair.fine - centre
    along, aside = fine @ axis, _aside(fine, axis)
    beam = aside <= max(2 * pair.noticeable, 1.05 * float(aside.min()))
    reach = float(along[beam].min()) - pair.reach(place, axis)
    slack = max(AIM * (by or 0.0), 0.5 * pair.noticeable)
    held = aside.min() <= 2 * pair.noticeable and reach >= (by or 0.0) - slack
    held = held and (not exactly or by is None or reach <= by + slack)
    wish = f"pass {direction} of {name}" + ("" if by is None else f" by {by:g} m")
    return say(held, wish, f"at {aside.min():.3f} m from its axis the path is {reach:.3f} m {direction} of it")


@predicate
def not_beyond(pair: Pair, place: Any, direction: str) -> CheckResult:
    """The path is nowhere straight beyond a place along a direction, as over it or under it."""
    centre, name = pair.place(place)
    axis = pair.scene.frame.direction(direction)
    fine, half = pair.fine - centre, pair.reach(place, axis)
    across = [axis for axis in np.eye(3) if abs(axis @ pair.scene.frame.direction("up")) < 0.5]
    inside = np.all([np.abs(fine @ one) < 0.9 * pair.reach(place, one) for one in across], axis=0)
    beyond = inside & (fine @ axis > -half)
    fact = f"{beyond.mean():.0%} of the path are {direction} of it"
    return say(not beyond.any(), f"never pass {direction} of {name}", fact)


@predicate
def not_between(pair: Pair, a: Any, b: Any) -> CheckResult:
    """Seen from above, the path nowhere crosses the line between two places."""
    (p, first), (q, second) = pair.place(a), pair.place(b)
    level = [axis for axis in np.eye(3) if abs(axis @ pair.scene.frame.direction("up")) < 0.5]
    ahead, offset = (np.array([vector @ axis for axis in level]) for vector in (q - p, p))
    fine = np.column_stack([pair.fine @ axis for axis in level]) - offset
    beside = fine @ np.array([-ahead[1], ahead[0]])
    share = fine @ ahead / max(float(ahead @ ahead), 1e-12)
    crossing = (beside[1:] * beside[:-1] <= 0) & (share[1:] > 0.0) & (share[1:] < 1.0)
    fact = f"it crosses the line between them {int(crossing.sum())} times"
    return say(not crossing.any(), f"never pass between {first} and {second}", fact)


@predicate
def passes_beside(pair: Pair, place: Any, direction: str) -> CheckResult:
    """Where the path is abreast of a place, or closest to it if it never is, it is on one side of it."""
    centre, name = pair.place(place)
    axis, up = pair.scene.frame.direction(direction), pair.scene.frame.direction("up")
    fine, sideways = pair.fine - centre, direction not in ("up", "down")
    gap = _aside(fine, up) if sideways else lengths(fine)
    near = fine[gap <= gap.min() + pair.noticeable]
    across = fine @ np.cross(axis, up)
    passing = np.flatnonzero(across[1:] * across[:-1] <= 0)
    if len(passing) and sideways:
        near = fine[passing[[int(np.argmin(np.abs(fine[passing] @ axis)))]]]
    reach = float(np.median(near @ axis))
    held = reach >= max(0.8 * pair.reach(place, axis), 0.5 * pair.noticeable)
    return say(held, f"pass {direction} of {name}", f"where it is closest it is {reach:.3f} m {direction} of {name}")


@predicate
def end_beside(pair: Pair, end: End, place: Any, direction: str, *, by: float | None = None) -> CheckResult:
    """An end lies outside a place along a direction, by so many metres from its surface or centre."""
    centre, name = pair.place(place)
    axis = pair.scene.frame.direction(direction)
    away = pair.adapted[0 if end == "start" else -1, :3] - centre
    reach, half = float(away @ axis), pair.reach(place, axis)
    aside = float(np.linalg.norm(away - reach * axis))
    slack = max(AIM * (by or 0.0), pair.noticeable)
    right = 0.0 < reach - half <= 0.25 * pair.extent if by is None else min(abs(reach - by), abs(reach - half - by))
    held = aside <= max(half, 5 * pair.noticeable) and (bool(right) if by is None else float(right) <= slack)
    fact = f"the {end} is {reach:.3f} m {direction} of {name} and {aside:.3f} m aside"
    return say(held, f"put the {end} {direction} of {name}", fact)


@predicate
def end_aimed(pair: Pair, end: End, place: Any, sense: Nearing, *, by: float | None = None) -> CheckResult:
    """An end came nearer to a place or went farther from it, by so many metres or as far as it goes."""
    centre, name = pair.place(place)
    row = 0 if end == "start" else -1
    old, new = (float(np.linalg.norm(rows[row, :3] - centre)) for rows in (pair.original, pair.adapted))
    gain = (new - old) * (1.0 if sense == "farther" else -1.0)
    held = gain >= pair.noticeable
    if by is not None:
        wanted = by if sense == "farther" else min(by, old)
        held = abs(gain - wanted) <= max(AIM * wanted, 0.5 * pair.noticeable)
    return say(held, f"bring the {end} {sense} to {name}", f"its distance went from {old:.3f} to {new:.3f} m")


@predicate
def within_bound(
    pair: Pair,
    direction: str,
    at_most: float,
    *,
    of: Any = None,
    where: Where = None,
    exactly: bool = False,
    otherwise: bool = True,
) -> CheckResult:
    """The coordinate along a direction stays within a bound, from the origin or a place, and others do not change.

    Args:
        at_most: [m].
        of: What it counts from, None for the origin.
        where: Only this part of the path.
        exactly: The coordinate is that everywhere, within 10 % or 1 % of the extent.
        otherwise: Whether the coordinates across must stay within 5 % of the extent.
    """
    axis = pair.scene.frame.direction(direction)
    origin = np.zeros(3) if of is None else pair.place(of)[0]
    rows = pair.adapted if where is None else pair.part(where)[1]
    wish = f"stay within {at_most:g} m {direction}{said(where)}"
    if not len(rows):
        return say(False, wish, GONE)
    along = (rows[:, :3] - origin) @ axis
    most = float(along.max())
    held = most <= at_most + 0.5 * pair.noticeable
    if exactly:
        slack = max(0.1 * abs(at_most), pair.noticeable)
        held = float((np.abs(along - at_most) <= slack).mean()) >= 0.9
    fact = f"the path reaches {along.min():.3f} to {most:.3f} m {direction}"
    if otherwise:
        shift = pair.shift[pair.found]
        across = float(_aside(shift, axis).mean())
        held = held and across <= 5 * pair.noticeable
        fact += f", and moved {across:.3f} m sideways on average"
    return say(held, wish, fact)


@predicate
def height_kept(pair: Pair, *, where: Where = None) -> CheckResult:
    """Nine of ten waypoints, all along or in a part of the path, have the height that they had."""
    old, new = (rows[:, :3] @ pair.scene.frame.direction("up") for rows in pair.part(where))
    wish = f"keep the height{said(where)}"
    if not len(old):
        return say(False, wish, GONE)
    off = np.abs(new - old)
    share = float((off <= pair.noticeable).mean())
    return say(share >= 0.9, wish, f"heights changed by up to {off.max():.3f} m")


@predicate
def one_height(pair: Pair, *, where: Where = None) -> CheckResult:
    """Nine of ten waypoints, all along or in a part of the path, have one height."""
    up = pair.part(where)[1][:, :3] @ pair.scene.frame.direction("up")
    wish = f"go at one height{said(where)}"
    if not len(up):
        return say(False, wish, GONE)
    share = float((np.abs(up - np.median(up)) <= pair.noticeable).mean())
    return say(share >= 0.9, wish, f"heights run from {up.min():.3f} to {up.max():.3f} m")


@predicate
def speed_within(
    pair: Pair,
    *,
    at_least: float | None = None,
    at_most: float | None = None,
    where: Where = None,
    otherwise: bool = True,
    slack: float = 0.02,
) -> CheckResult:
    """Nowhere faster or slower than a bound [m/s], but for standing and braking to a stand.

    Args:
        at_least: [m/s].
        at_most: [m/s].
        where: Only this part of the path.
        otherwise: Whether speeds within the bounds must be as before.
        slack: Share of the bound by which it may be missed.
    """
    old, new = (rows[:, 3] for rows in pair.part(where))
    bottom, top = at_least or 0.0, at_most or np.inf
    wish = f"keep the speed within {bottom:g} and {top:g} m/s{said(where)}"
    moving = (new > 0.05 * float(pair.original[:, 3].mean())) & (old > 0)
    if not moving.any():
        return say(False, wish, "the robot does not move there")
    low, high = float(np.quantile(new[moving], 0.05)), float(new[moving].max())
    held = high <= (1 + slack) * top and low >= (1 - slack) * bottom
    inside = moving & (old <= top) & (old >= bottom)
    if otherwise and inside.any():
        held = held and float(np.median(np.abs(new - old)[inside] / old[inside])) <= 0.1
    return say(held, wish, f"the speed runs from {low:.3f} to {high:.3f} m/s")


@predicate
def speed_is(pair: Pair, value: float, *, where: Where = None) -> CheckResult:
    """Three of four original waypoints are passed at one speed [m/s], within 5 %."""
    speeds = pair.part(where)[1][:, 3]
    share = float((np.abs(speeds - value) <= 0.05 * value).mean()) if len(speeds) else 0.0
    return say(share >= 0.75, f"go at {value:g} m/s{said(where)}", f"{share:.0%} of the waypoints do")


@predicate
def speed_changed(pair: Pair, by: float, *, where: Where = None) -> CheckResult:
    """The average speed changed by so many m/s, within 15 %."""
    old, new = (rows[:, 3] for rows in pair.part(where))
    change = float((new - old).mean()) if len(old) else 0.0
    held = len(old) > 0 and abs(change - by) <= AIM * abs(by)
    return say(held, f"change the speed by {by:g} m/s{said(where)}", f"it changed by {change:.3f} m/s")


@predicate
def lasts(
    pair: Pair, seconds: float | None = None, *, at_most: float | None = None, by: float = 0.0, where: Where = None
) -> CheckResult:
    """The way takes so long, within 10 %, at most so long, or by so much longer than before, dwells left out."""
    old, new = map(_moving_time, (pair.original, pair.adapted) if where is None else pair.part(where))
    aim = old + by if seconds is None else seconds
    slack = AIM * abs(by) if seconds is None else 0.1 * seconds
    least, most = (0.0, 1.02 * at_most) if at_most is not None else (aim - slack, aim + slack)
    return say(
        least <= new <= most, f"take {most:.3g} s at most{said(where)}", f"it takes {new:.3g} s, {old:.3g} before"
    )


def _moving_time(rows: Array) -> float:
    """The time in which a trajectory (N, 4) moves [s]."""
    ds, pace = lengths(np.diff(rows[:, :3], axis=0)), (rows[1:, 3] + rows[:-1, 3]) / 2.0
    moves = (ds > 0) & (pace > 0)
    return float((ds[moves] / pace[moves]).sum())


@predicate
def accelerates(pair: Pair, rate: float, *, where: Where = None) -> CheckResult:
    """The squared speed rises or falls over the length by twice a rate [m/s^2], until it reaches 0; within 20 %."""
    _, rows = pair.part(where)
    wish = f"accelerate by {rate:g} m/s^2{said(where)}"
    s, squares = arc_length(rows[:, :3]), rows[:, 3] ** 2
    moving = rows[:, 3] > 1e-4
    if moving.sum() < 3 or np.ptp(s[moving]) < 1e-9:
        stopped = rate < 0 and not moving[len(moving) // 2 :].any()
        return say(bool(stopped), wish, "the robot hardly moves there")
    slope = float(np.polyfit(s[moving], squares[moving], 1)[0]) / 2.0
    return say(abs(slope - rate) <= 0.2 * abs(rate), wish, f"it accelerates by {slope:.3f} m/s^2")


@predicate
def scaled(pair: Pair, factor: float, *, where: Where = None, about: Any = None) -> CheckResult:
    """Distances within the path are so many times as large, within 10 %, and a fixed point stays."""
    wish = f"scale the path by {factor:g}{said(where)}"
    old, new = (rows[:, :3] for rows in pair.part(where))
    if not len(old):
        return say(False, wish, GONE)
    sizes = [float(lengths(rows - rows.mean(axis=0)).mean()) for rows in (old, new)]
    ratio = sizes[1] / max(sizes[0], 1e-12)
    held, fact = abs(ratio / factor - 1.0) <= 0.1, f"the path is {ratio:.2f} times as large"
    if about is not None:
        centre, name = pair.place(about)
        off = float(np.abs(new - centre - factor * (old - centre)).max())
        held, fact = held and off <= 3 * pair.noticeable, f"{fact}, up to {off:.3f} m off that about {name}"
    return say(held, wish, fact)


@predicate
def trimmed(pair: Pair, first: int, last: int) -> CheckResult:
    """So many waypoints are missing at the start and at the goal, one more or less, and the others are as before."""
    n = len(pair.original)
    left = pair.original[first : n - last, :3]
    off = float(path_distances(pair.adapted[:, :3], left).max()) if len(left) else np.inf
    back = float(path_distances(left, pair.adapted[:, :3]).max()) if len(left) > 1 else 0.0
    step = float(np.linalg.norm(np.diff(pair.original[:, :3], axis=0), axis=1).max())
    held = max(off, back) <= 1.5 * step + 1e-6 and abs(len(pair.adapted) - len(left)) <= 1
    wish = f"leave out {first} waypoints at the start and {last} at the goal"
    return say(held, wish, f"of {n} waypoints {len(pair.adapted)} are left, up to {max(off, back):.3f} m elsewhere")


@predicate
def counted(pair: Pair, count: int) -> CheckResult:
    """There are so many waypoints, give or take one."""
    n = len(pair.adapted)
    return say(abs(n - count) <= 1, f"use {count} waypoints", f"there are {n} waypoints")


@predicate
def winds(pair: Pair, around: Any, turns: float, *, radius: float | None = None, sense: str = "") -> CheckResult:
    """The path goes around a place so many times more, at a radius [m] and clockwise ("cw") or not ("ccw")."""
    centre, name = pair.place(around)
    up = pair.scene.frame.direction("up")
    old, new = swept(pair.original[:, :3], centre, up), swept(pair.adapted[:, :3], centre, up)
    added = pair.adapted[~pair.match.old, :3] if (~pair.match.old).sum() > 8 else pair.adapted[:, :3]
    ring = float(np.median(_aside(added - centre, up)))
    total = float((new[-1] - new[0]) - (old[-1] - old[0])) / (2 * np.pi)
    held = abs(abs(total) - turns) <= (0.35 if turns == round(turns) else 0.55) and bool(
        _aside(pair.fine - centre, up).any()
    )
    held = held and (radius is None or abs(ring - radius) <= max(AIM * radius, pair.noticeable))
    held = held and (not sense or (total < 0) == (sense == "cw"))
    fact = f"the path winds {total:.2f} turns more around {name}, at {ring:.3f} m"
    return say(held, f"go {turns:g} times around {name}", fact)


@predicate
def figure_eight(pair: Pair, *, size: float | None = None, near: Any = None) -> CheckResult:
    """The inserted stretch winds one way and then the other, at least 0.6 turns each, at a place and of a size [m]."""
    added = pair.adapted[~pair.match.old, :3]
    if len(added) < 8:
        return say(False, "make a figure eight", "nothing was inserted")
    turning = net_turning(added, pair.scene.frame.direction("up")) / (2 * np.pi)
    way = float(np.ptp(turning))
    long = float(np.linalg.norm(added - added.mean(axis=0), axis=1).max()) * 2
    held = way >= 0.5 and abs(float(turning[-1])) <= 0.5
    held = held and (size is None or abs(long - size) <= 0.2 * size)
    off = 0.0
    if near is not None:
        centre, _ = pair.place(near)
        off = float(np.linalg.norm(added.mean(axis=0) - centre))
        off -= closest_to_point(pair.original[:, :3], centre)[0]
        held = held and off <= 5 * pair.noticeable + 0.5 * long
    fact = f"the inserted stretch winds {way:.2f} turns, {turning[-1]:.2f} in all, over {long:.3f} m"
    return say(held, "make a figure eight", fact)


@predicate
def bends(pair: Pair, change: Literal["more", "less"], *, where: Where = None, straight: bool = False) -> CheckResult:
    """A part of the path bends more or less: its sagitta changes by 5 %, or its sum of squared bends by a tenth.

    Args:
        change: Which.
        where: Only this part of the path, whose surroundings stay.
        straight: Whether kinks count and not the sagitta, as for a smoother path.
    """
    wish = f"bend {change}{said(where)}"
    old, new = (rows[:, :3] for rows in pair.part(where))
    if len(old) < 3:
        return say(False, wish, FEW)
    values = [_kinks(old), _kinks(new)] if straight else [_sagitta(old), _sagitta(new)]
    ratio = values[1] / max(values[0], 1e-9)
    held = ratio >= 1.05 if change == "more" else ratio <= (0.95 if values[0] > 1e-6 else 1.0)
    return say(held, wish, f"its bend went from {values[0]:.4f} to {values[1]:.4f}")


@predicate
def swings(
    pair: Pair, least: int, *, amplitude: float | None = None, where: Where = None, irregular: bool = False
) -> CheckResult:
    """The path swings about the original in one part of it and nowhere else.

    Args:
        least: How often it changes sides, at least.
        amplitude: The largest deviation [m], within 30 %.
        where: The part of the path.
        irregular: Whether it shakes: the deviations of neighbours have nothing in common.
    """
    source = project(pair.original[:, :3], pair.adapted[:, :3])[1]
    off = pair.adapted[:, :3] - interpolate(pair.original[:, :3], source)
    size = np.linalg.norm(off, axis=1)
    inside, elsewhere = np.ones(len(size), dtype=bool), np.zeros(len(size), dtype=bool)
    if where is not None:
        matched = pair.match.backward
        place = np.where(np.isfinite(matched), matched, source)
        index = np.clip(np.rint(place).astype(int), 0, len(pair.original) - 1)
        inside, elsewhere = selected(pair, where)[index], selected(pair, outside(PathPart.from_json(where)))[index]
    wish = f"{'shake' if irregular else 'swing'}{said(where)}"
    clear = np.flatnonzero(size > 0.25 * max(float(size.max()), 1e-12))
    turns = int(((off[clear[1:]] * off[clear[:-1]]).sum(axis=1) < 0).sum()) if len(clear) > 1 else 0
    largest = float(size[inside].max(initial=0.0))
    outer = float(size[elsewhere].max(initial=0.0))
    held = turns >= least and largest >= 1e-4 and outer <= max(0.35 * largest, pair.noticeable)
    held = held and (amplitude is None or abs(largest / amplitude - 1.0) <= 0.3)
    fact = f"the path changes sides {turns} times, {largest:.3f} m off there and {outer:.3f} m elsewhere"
    return say(held, wish, fact)


@predicate
def corkscrews(pair: Pair, turns: float | None = None, *, where: Where = None) -> CheckResult:
    """The path winds around the original, so many times give or take a third (None: at least once).

    Args:
        where: The part of the path in which it does.
    """
    source = project(pair.original[:, :3], pair.adapted[:, :3])[1]
    off = pair.adapted[:, :3] - interpolate(pair.original[:, :3], source)
    index = np.clip(np.rint(source).astype(int), 0, len(pair.original) - 1)
    size = np.linalg.norm(off, axis=1)
    clear = (size > 0.25 * max(float(size.max()), 1e-12)) & (True if where is None else selected(pair, where)[index])
    one, other = off[clear][:-1], off[clear][1:]
    ahead = np.gradient(pair.original[:, :3], axis=0)[index[clear]][:-1]
    ahead = ahead / np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-12)
    angles = np.arctan2((np.cross(one, other) * ahead).sum(axis=1), (one * other).sum(axis=1))
    wound = abs(float(angles.sum())) / (2.0 * np.pi)
    held = wound >= 0.75 if turns is None else abs(wound - turns) <= max(turns / 3.0, 0.5)
    held = held and bool((np.abs(angles) < 2.0).all())  # a zigzag changes sides at once
    fact = f"it winds {wound:.1f} times around the old path, {size.max():.3f} m off at most"
    return say(held and size.max() > pair.noticeable, f"wind around the path{said(where)}", fact)


@predicate
def rests_at(pair: Pair, place: Any, *, steps: int | None = None, ends: bool = False) -> CheckResult:
    """The robot stands where the original comes closest to a place, within 4 % of the path's length.

    Args:
        place: An object's name, a point, "start" or "goal"; the goal may have moved.
        steps: It waits for so many timesteps there, give or take a tenth.
        ends: The path ends there.
    """
    centre, name = pair.place(place)
    still = pair.adapted[:, 3] <= 0.03 * float(np.median(pair.original[:, 3]))
    index = np.flatnonzero(still)
    wish = f"stand at {name}"
    if ends and not len(index):
        index = np.array([len(pair.adapted) - 1])
    if not len(index):
        return say(False, wish, "it never stands")
    old, new = (rows[:, :3] for rows in (pair.original, pair.adapted))
    if place == "goal":
        away = np.where(index >= len(new) - 2 - (steps or 0), 0.0, np.linalg.norm(new[index] - centre, axis=1))
    else:
        nearest = fractions(old)[int(np.argmin(np.linalg.norm(old - centre, axis=1)))]
        source = pair.match.backward[index]
        source = np.where(np.isfinite(source), source, project(old, new[index])[1])
        share = np.interp(source, np.arange(len(old)), fractions(old))
        distance = np.linalg.norm(new - centre, axis=1)
        away = np.minimum(np.abs(share - nearest), (distance[index] - distance.min()) / pair.extent + 0.01)
    here = index[away <= 0.04]
    longest = max((b - a + 1 for a, b in runs(np.isin(np.arange(len(new)), here))), default=0)
    held = longest > 0 and (steps is None or abs(longest - 1 - steps) <= max(1, round(0.1 * steps)))
    held = held and (not ends or len(pair.adapted) - 1 in here)
    return say(held, wish, f"it stands for {longest} waypoints there and {len(index)} in all")


@predicate
def rests_before(pair: Pair, place: Any, by: float, *, steps: int | None = None) -> CheckResult:
    """The robot stands so many metres before a place, from its surface, within 1 cm or 10 %, and then goes on.

    Args:
        place: An object's name.
        steps: It waits for so many timesteps there, give or take a tenth.
    """
    still = pair.adapted[:, 3] <= 0.03 * float(np.median(pair.original[:, 3]))
    wish, item = f"stand {by:g} m before {pair.place(place)[1]}", pair.item(place)
    for a, b in runs(still[:-1]):
        point = pair.adapted[[a, a], :3]
        gap = closest_to_point(point, pair.place(place)[0])[0] if item is None else float(item.cuboid.closest(point)[0])
        if abs(gap - by) <= max(0.01, 0.1 * by) and (steps is None or abs(b - a - steps) <= max(1, round(0.1 * steps))):
            return say(True, wish, f"it stands {gap:.3f} m off for {b - a} timesteps")
    return say(False, wish, "it does not")


@predicate
def arrives_from(pair: Pair, direction: str, by: float | None = None) -> CheckResult:
    """The path ends along the opposite of a direction, within 10 degrees, over so much or a fiftieth of its length."""
    path = pair.adapted[:, :3]
    s = arc_length(path)
    asked = by if by is not None else 0.02 * float(s[-1])
    before = interpolate(path, np.array([np.interp(s[-1] - 0.9 * asked, s, np.arange(len(s)))]))[0]
    way = before - path[-1]
    along = float(way @ pair.scene.frame.direction(direction)) / max(float(np.linalg.norm(way)), 1e-9)
    straight = float(np.linalg.norm(way)) >= 0.99 * 0.9 * asked
    angle = float(np.degrees(np.arccos(np.clip(along, -1.0, 1.0))))
    wish = f"come to the goal from {direction} over {asked:.3g} m"
    return say(straight and angle <= 10.0, wish, f"it comes {angle:.0f} degrees off that")


@predicate
def lifted(pair: Pair, direction: str, degrees: float) -> CheckResult:
    """What lies on one side is lifted in proportion: by an angle, within 2 degrees or a fifth of it."""
    axis, up = pair.scene.frame.direction(direction), pair.scene.frame.direction("up")
    old, new = (rows[:, :3] for rows in pair.part(None))
    slope = float(np.polyfit(old @ axis, (new - old) @ up, 1)[0])
    angle = float(np.degrees(np.arctan(slope)))
    held = angle > 0.3 * degrees and abs(angle - degrees) <= max(2.0, 0.4 * degrees)
    return say(held, f"lift the {direction} by {degrees:g} degrees", f"it rises by {angle:.1f} degrees to that side")


@predicate
def flipped(pair: Pair, directions: Sequence[str], *, where: Where = None) -> CheckResult:
    """Mirrored along direction words, and perhaps shifted: coordinates change their sign but for a constant."""
    old, new = (rows[:, :3] for rows in pair.part(where))
    off = 0.0
    for word in ("right", "front", "up"):
        axis = pair.scene.frame.direction(word)
        sign = 1.0 if any(abs(axis @ pair.scene.frame.direction(w)) > 0.5 for w in directions) else -1.0
        off = max(off, float(((old + sign * new) @ axis).std()))
    held = off <= 5 * pair.noticeable
    return say(held, f"mirror the path {' and '.join(directions)}", f"it deviates from that by {off:.3f} m")


def _aside(vectors: Array, axis: Array) -> Array:
    """Lengths (N,) of vectors (N, 3) across a unit vector (3,)."""
    return lengths(vectors - (vectors @ axis)[:, None] * axis)


def _sagitta(rows: Array) -> float:
    """Mean distance of a stretch (K, 3) from its chord [m]."""
    chord = rows[-1] - rows[0]
    length = max(float(np.linalg.norm(chord)), 1e-9)
    share = (rows - rows[0]) @ chord / length**2
    return float(np.linalg.norm(rows - rows[0] - share[:, None] * chord, axis=1).mean())


def _kinks(rows: Array) -> float:
    """Jitter of a stretch (K, 3): the sum of its squared second differences over that of its squared steps."""
    steps = np.diff(rows, axis=0)
    return float((np.diff(steps, axis=0) ** 2).sum() / max(float((steps**2).sum()), 1e-12))
