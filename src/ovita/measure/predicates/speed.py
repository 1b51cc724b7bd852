"""Checks of how fast the robot moves, where it stops and how long it waits."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from ovita.measure.predicates.check import FEW, GONE, CheckResult, Pair, Where, predicate, said, say, selected
from ovita.measure.predicates.places import BY, Amount
from ovita.paths.geometry import SAME_PLACE, Mask, fractions
from ovita.paths.part import PathPart, outside
from ovita.paths.trajectory import Array

LEAST_CHANGE = 0.05
"""A change of speed counts from this share on."""

LOCAL = 0.5
"""A change is local if elsewhere it is at most this share of it."""

AROUND = 0.15
"""A stop "near" an object is at most this share of the extent farther from it than the original comes."""

AT_REST = 0.03
"""The robot stands below this share of the original's median speed."""

Sense = Literal["rising", "falling"]


@predicate
def slower(
    pair: Pair, *, where: Where = None, factor: float | None = None, amount: Amount | None = None, only: bool = False
) -> CheckResult:
    """The average speed is lower, by at least 5 %.

    Args:
        where: Only these waypoints.
        factor: New over old speed, below 1, within 10 % of it.
        amount: "little": no slower than 0.4 times; "much": at most 0.8 times as fast.
        only: Whether the speed elsewhere must change less than half as much, and no farther object be meant.
    """
    return _pace(pair, -1.0, PathPart.from_json(where), factor, amount, only)


@predicate
def faster(
    pair: Pair, *, where: Where = None, factor: float | None = None, amount: Amount | None = None, only: bool = False
) -> CheckResult:
    """The average speed is higher, by at least 5 %.

    Args:
        where: Only these waypoints.
        factor: New over old speed, above 1, within 10 % of it.
        amount: "little": at most 2 times as fast; "much": at least 1.25 times.
        only: Whether the speed elsewhere must change less than half as much, and no farther object be meant.
    """
    return _pace(pair, 1.0, PathPart.from_json(where), factor, amount, only)


@predicate
def speeds_kept(pair: Pair, where: Where = None) -> CheckResult:
    """The average speed of the selected waypoints changed by less than 5 %, nine of ten by less than a fifth of it."""
    wish = f"leave the speed{said(where)} as it was"
    old, new = (rows[:, 3] for rows in pair.part(where))
    if not len(old):
        return say(True, wish, "there are no such waypoints")
    usual = max(float(old.mean()), 1e-9)
    off = np.abs(new - old) / usual
    mean = abs(float(new.mean()) - float(old.mean())) / usual
    fact = f"the average speed{said(where)} went from {old.mean():.3f} to {new.mean():.3f} m/s"
    return say(mean <= LEAST_CHANGE and float((off <= 0.2).mean()) >= 0.9, wish, fact)


@predicate
def constant_speed(pair: Pair, value: float | None = None, *, where: Where = None) -> CheckResult:
    """Nine of ten selected waypoints have one speed: the value [m/s], or their median; within 5 %."""
    speeds = _speeds(pair, where)
    wish = f"keep a constant speed{'' if value is None else f' of {value:g} m/s'}{said(where)}"
    if not len(speeds):
        return say(False, wish, GONE)
    aim = float(np.median(speeds)) if value is None else value
    share = float((np.abs(speeds - aim) <= 0.05 * max(aim, 1e-9)).mean())
    fact = f"speeds{said(where)} run from {speeds.min():.3f} to {speeds.max():.3f} m/s, {share:.0%} near {aim:.3f}"
    return say(share >= 0.9 and aim > 0, wish, fact)


@predicate
def monotone_speed(
    pair: Pair, sense: Sense, *, to: float | None = None, where: Where = None, final: float | None = None
) -> CheckResult:
    """The speed only rises, or only falls, by at least a tenth of its maximum; its wrong changes sum to at most 10 %.

    Args:
        sense: "rising" or "falling".
        to: The last speed [m/s], within 5 % of the highest.
        where: Only these waypoints.
        final: Only this last share of the adapted waypoints.
    """
    speeds = _speeds(pair, where)
    if final is not None:
        speeds = speeds[-max(3, round(final * len(speeds))) :]
    wish = _wish(sense, to, where)
    if len(speeds) < 3:
        return say(False, wish, FEW)
    return say(_only(speeds, sense, to), wish, _course(speeds))


@predicate
def uniform_acceleration(pair: Pair, sense: Sense, *, to: float | None = None, where: Where = None) -> CheckResult:
    """The speed rises or falls steadily: it is a straight line over waypoints, length or time (R^2 >= 0.95)."""
    rows = pair.adapted if where is None else pair.part(where)[1]
    wish = f"{_wish(sense, to, where)}, steadily"
    if len(rows) < 3:
        return say(False, wish, FEW)
    speeds, s = rows[:, 3], fractions(rows[:, :3])
    # Constant acceleration makes v^2 linear over length, which is v linear over time.
    fit = max(_fit(np.arange(len(speeds), dtype=float), speeds), _fit(s, speeds), _fit(s, speeds**2))
    held = fit >= 0.95 and _only(speeds, sense, to)
    return say(held, wish, f"{_course(speeds)} (straight to R^2 = {fit:.2f})")


@predicate
def exponential_speed(pair: Pair, sense: Sense, *, where: Where = None) -> CheckResult:
    """The logarithm of the speed is a straight line (R^2 >= 0.95), a better one than the speed itself."""
    speeds = _speeds(pair, where)
    wish = f"{_wish(sense, None, where)}, exponentially"
    moving = speeds > 1e-3 * max(float(speeds.max(initial=0.0)), 1e-9)
    if moving.sum() < 4:
        return say(False, wish, "too few waypoints move")
    k = np.arange(len(speeds), dtype=float)
    logarithmic, straight = _fit(k[moving], np.log(speeds[moving])), _fit(k, speeds)
    held = logarithmic >= 0.95 and logarithmic > straight and _only(speeds, sense)
    return say(held, wish, f"{_course(speeds)} (exponential to R^2 = {logarithmic:.2f}, straight to {straight:.2f})")


@predicate
def trapezoidal_speed(pair: Pair, *, where: Where = None) -> CheckResult:
    """The speed rises, is constant for at least a fifth of the waypoints, and falls."""
    speeds = _speeds(pair, where)
    wish = f"speed up, keep the speed and slow down again{said(where)}"
    if len(speeds) < 5:
        return say(False, wish, FEW)
    top = float(speeds.max())
    flat = np.flatnonzero(speeds >= 0.99 * top)
    a, b = int(flat[0]), int(flat[-1])
    whole = len(flat) == b - a + 1
    ends = max(float(speeds[0]), float(speeds[-1]))
    rises, falls = _wrong(speeds[: a + 1], 1.0), _wrong(speeds[b:], -1.0)
    held = whole and b - a + 1 >= 0.2 * len(speeds) and ends <= 0.7 * top and max(rises, falls) <= 0.1 * top
    fact = (
        f"the speed is {speeds[0]:.3f} at first, {top:.3f} from waypoint {a} to {b}, and {speeds[-1]:.3f} m/s at last"
    )
    return say(held, wish, fact)


@predicate
def stops(pair: Pair, near: Any = None) -> CheckResult:
    """The robot stops where it did not before: near a place, or at the end.

    A path that ends there will do, as will a stop after which the robot goes on.
    """
    still = pair.adapted[:, 3] <= _rest(pair)
    if near is None:
        fact = f"the speed at the end is {pair.adapted[-1, 3]:.3f} m/s"
        return say(bool(still[-1]), "stop at the end", fact)
    centre, name = pair.place(near)
    distance, limit = _around(pair, centre)
    cut = bool(np.linalg.norm(pair.adapted[-1, :3] - pair.original[-1, :3]) > 2 * pair.noticeable)
    if cut:
        still[-1] = True
    else:
        # Where the original stands already, standing is no answer.
        old = pair.original[pair.original[:, 3] <= _rest(pair), :3]
        for place in old:
            still &= np.linalg.norm(pair.adapted[:, :3] - place, axis=1) > 2 * pair.noticeable
    nearest = float(distance[still].min()) if still.any() else np.inf
    fact = f"it stops {nearest:.3f} m from {name} (at most {limit:.3f} m)" if still.any() else "it does not stop"
    return say(nearest <= limit, f"stop near {name}", fact)


@predicate
def never_stops(pair: Pair, *, where: Where = None) -> CheckResult:
    """The robot stands still nowhere between the ends, or on a part of the path."""
    rows = pair.adapted
    still = rows[:, 3] <= _rest(pair)
    for a, b in _waits(rows, pair):
        still[a : b + 1] = True
    stops = rows[still, :3]
    stops = stops[~(stops == rows[[0, -1], None, :3]).all(axis=2).any(axis=0)]
    there = rows[:, :3] if where is None else pair.part(where)[1][:, :3]
    count = int((np.linalg.norm(stops[:, None] - there, axis=2).min(axis=1, initial=np.inf) <= pair.noticeable).sum())
    return say(count == 0, f"make no stop{said(where)}", f"it stands still at {count} waypoints")


@predicate
def dwells(pair: Pair, steps: int, *, near: Any = None) -> CheckResult:
    """The robot waits for so many timesteps: repeated waypoints, or waypoints at rest, in one place; one may differ.

    Args:
        steps: Timesteps.
        near: The place where it waits; None for anywhere.
    """
    waiting = _waits(pair.adapted, pair)
    name = ""
    if near is not None:
        centre, name = pair.place(near)
        distance, limit = _around(pair, centre)
        waiting = [(a, b) for a, b in waiting if distance[a] <= limit]
    longest = max((b - a for a, b in waiting), default=0)
    before = max((b - a for a, b in _waits(pair.original, pair)), default=0)
    there = f" near {name}" if name else ""
    held = abs(longest - steps) <= max(1, round(0.1 * steps)) and longest > before
    return say(held, f"wait for {steps} timesteps{there}", f"the longest wait{there} has {longest} timesteps")


def _pace(
    pair: Pair, sign: float, where: PathPart, factor: float | None, amount: Amount | None, only: bool
) -> CheckResult:
    """Sign +1: faster, -1: slower; what is near before and what is near after an edit of the path both count."""
    now, *later = (_pace_at(pair, view, sign, where, factor, amount, only) for view in _views(pair, where))
    return next((verdict for verdict in later if verdict.passed and not now.passed), now)


def _views(pair: Pair, where: PathPart) -> tuple[Pair, ...]:
    return (pair, pair.seen_after) if where else (pair,)


def _pace_at(
    pair: Pair, view: Pair, sign: float, where: PathPart, factor: float | None, amount: Amount | None, only: bool
) -> CheckResult:
    wish = f"go {'faster' if sign > 0 else 'slower'}{said(where)}"
    mask = selected(view, where) & pair.found
    if not mask.any():
        return say(False, wish, GONE)
    wish += "" if factor is None else f", {factor:g} times as fast"
    wish += BY[amount] if amount else ""
    ratio, fact = _ratio(pair, mask, where)
    held = sign * (ratio - 1.0) >= LEAST_CHANGE and (factor is None or abs(ratio / factor - 1.0) <= 0.1)
    held = held and _fits(ratio, sign, amount)
    for objection in (_untouched(pair, where, mask, sign), _spread(pair, view, where, sign, ratio) if only else ""):
        if objection:
            held, fact = False, f"{fact}; {objection}"
    return say(held, wish, fact)


def _fits(ratio: float, sign: float, amount: Amount | None) -> bool:
    if amount == "little":
        return 0.4 <= ratio <= 2.0
    return amount is None or (ratio >= 1.25 if sign > 0 else ratio <= 0.8)


def _untouched(pair: Pair, where: PathPart, mask: Mask, sign: float) -> str:
    """Where a radius was stated, whether less than three quarters of what lies within it changed."""
    moving = mask & (pair.original[:, 3] > 1e-6)
    if where.kind != "near" or where.amount is None or not moving.any():
        return ""
    changed = float((sign * (pair.matched[moving, 3] / pair.original[moving, 3] - 1.0) >= LEAST_CHANGE / 2.0).mean())
    return "" if changed >= 0.75 else f"only {changed:.0%} of these waypoints changed"


def _spread(pair: Pair, view: Pair, where: PathPart, sign: float, ratio: float) -> str:
    """Whether the speed changed elsewhere too, or was changed near another part of the path."""
    if not where:
        return ""
    elsewhere = selected(view, outside(where)) & pair.found
    if elsewhere.any():
        other, told = _ratio(pair, elsewhere, outside(where))
        # Twice as fast and half as fast are changes of one size.
        here, there = abs(np.log(max(ratio, 0.05))), abs(np.log(max(other, 0.05)))
        if there > max(LOCAL * here, LEAST_CHANGE):
            return f"not only there: {told}"
    return _off_centre(pair, view, where, sign)


def _off_centre(pair: Pair, view: Pair, where: PathPart, sign: float) -> str:
    """Whether the change is centred on another part of the path than a vague "near": what to say, or ""."""
    if where.kind != "near" or where.amount is not None:
        return ""
    found = pair.found & (pair.original[:, 3] > 1e-6)
    change = np.zeros(len(found))
    change[found] = np.maximum(sign * np.log(np.maximum(pair.matched[found, 3] / pair.original[found, 3], 0.05)), 0.0)
    distance = np.linalg.norm(view.original[:, :3] - pair.place(where.places[0])[0], axis=1)
    if change.sum() < 1e-9:
        return ""
    centred, usual = float((change * distance).sum() / change.sum()), float(distance.mean())
    return "" if centred <= usual else f"where the speed changed, the path is {centred:.3f} m away on average"


def _ratio(pair: Pair, mask: Mask, where: PathPart) -> tuple[float, str]:
    old, new = float(pair.original[mask, 3].mean()), float(pair.matched[mask, 3].mean())
    ratio = new / old if old > 1e-6 else (1.0 if new <= 1e-6 else np.inf)
    return ratio, f"the average speed{said(where)} went from {old:.3f} to {new:.3f} m/s ({ratio:.2f} times)"


def _speeds(pair: Pair, where: Where) -> Array:
    return (pair.adapted if where is None else pair.part(where)[1])[:, 3]


def _wrong(speeds: Array, sign: float) -> float:
    """Sum of the changes against a sense [m/s]."""
    return float(np.maximum(-sign * np.diff(speeds), 0.0).sum())


def _only(speeds: Array, sense: Sense, to: float | None = None) -> bool:
    """Whether speeds change in one sense only, and end at a speed [m/s]."""
    sign, top = 1.0 if sense == "rising" else -1.0, float(speeds.max())
    change = sign * float(speeds[-1] - speeds[0])
    arrived = to is None or abs(float(speeds[-1]) - to) <= 0.05 * max(top, to)
    return change >= 0.1 * top and change > 1e-6 and _wrong(speeds, sign) <= 0.1 * change and arrived


def _fit(x: Array, y: Array) -> float:
    """R^2 of the best straight line."""
    if np.ptp(x) < 1e-12 or np.ptp(y) < 1e-9:
        return 0.0
    return float(np.corrcoef(x, y)[0, 1] ** 2)


def _wish(sense: Sense, to: float | None, where: Where) -> str:
    verb = "speed up" if sense == "rising" else "slow down"
    return f"{verb} all the time{said(where)}" + ("" if to is None else f" to {to:g} m/s")


def _course(speeds: Array) -> str:
    return (
        f"the speed goes from {speeds[0]:.3f} to {speeds[-1]:.3f} m/s, rising by {_wrong(speeds, -1.0):.3f} "
        f"and falling by {_wrong(speeds, 1.0):.3f} in all"
    )


def _rest(pair: Pair) -> float:
    return max(AT_REST * float(np.median(pair.original[:, 3])), 1e-6)


def _around(pair: Pair, centre: Array) -> tuple[Array, float]:
    distance = np.linalg.norm(pair.adapted[:, :3] - centre, axis=1)
    old = float(np.linalg.norm(pair.original[:, :3] - centre, axis=1).min())
    return distance, old + AROUND * pair.extent


def _waits(rows: Array, pair: Pair) -> list[tuple[int, int]]:
    """First and last index of each run of waypoints at one place; at rest, a small shift of them does not count."""
    still, runs, a = rows[:, 3] <= _rest(pair), [], 0
    for i in range(1, len(rows) + 1):
        if i < len(rows):
            step = float(np.linalg.norm(rows[i, :3] - rows[i - 1, :3]))
            away = float(np.linalg.norm(rows[i, :3] - rows[a, :3]))
            if step <= SAME_PLACE or (still[i] and still[i - 1] and away <= pair.noticeable):
                continue
        if i - 1 > a:
            runs.append((a, i - 1))
        a = i
    return runs
