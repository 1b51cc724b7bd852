"""Checks of where the path went: shifted, its ends moved, its height, its bounds."""

from __future__ import annotations

from typing import Any

import numpy as np

from ovita.measure.predicates.check import CheckResult, predicate, say
from ovita.measure.predicates.distance import Amount
from ovita.measure.predicates.pair import EDGE, Pair, Where, said, selected
from ovita.paths.frame import DIRECTIONS
from ovita.paths.geometry import fractions, path_distances
from ovita.paths.trajectory import Array

LEAST_SHIFT, MOST_LITTLE, LEAST_MUCH = 0.02, 0.3, 0.08
"""Average shifts as shares of the extent: the least that counts, the most that is "a little", the least for "a lot"."""

STRAY = 0.5
"""How far the path may stray across the asked direction, as a share of the shift along it."""


@predicate
def moved(
    pair: Pair,
    direction: str | None = None,
    *,
    left: float | None = None,
    right: float | None = None,
    front: float | None = None,
    back: float | None = None,
    up: float | None = None,
    down: float | None = None,
    amount: Amount | None = None,
    where: Where = None,
    tolerance: float = 0.1,
    only: bool = True,
) -> CheckResult:
    """The path moved in a direction (by any amount), or by metres along direction words.

    An amount holds on average, or at most and half of it on average where an end was kept or edges are soft.

    Args:
        pair: What is compared.
        direction: A direction word, for any amount of at least 2 % of the extent on average.
        left: Metres to the left; the other words likewise.
        right: [m].
        front: [m].
        back: [m].
        up: [m].
        down: [m].
        amount: "little": at most 30 % of the extent on average; "much": at least 8 %.
        where: Only these waypoints.
        tolerance: Share of an amount by which it may be missed.
        only: Whether the path must not stray in other directions by more than half as much.
    """
    words = _words(direction, left, right, front, back, up, down)
    mask = selected(pair, where) & pair.found
    wish = f"move the path{said(where)} {_spoken(words)}"
    if not mask.any():
        return say(False, wish, "none of those waypoints is left")
    held, parts = True, []
    for word, asked in words.items():
        along = pair.along(word)[mask]
        mean, most = float(along.mean()), float(along.max())
        if asked is None:
            held &= mean >= LEAST_SHIFT * pair.extent and float((along > -pair.noticeable).mean()) >= 0.9
            held &= amount != "little" or mean <= MOST_LITTLE * pair.extent
            held &= amount != "much" or mean >= LEAST_MUCH * pair.extent
        else:
            slack = max(tolerance * abs(asked), 0.5 * pair.noticeable)
            held &= abs(mean - asked) <= slack or (abs(most - asked) <= slack and mean >= asked / 2.0)
        parts.append(f"{mean:.3f} m {word}")
    if amount is not None:
        wish += ", but only a little" if amount == "little" else " by a lot"
    fact = "on average it moved " + " and ".join(parts)
    if only:
        stray, across = _stray(pair, words, mask)
        limit = max(STRAY * float(np.linalg.norm([pair.along(w)[mask].mean() for w in words])), 2 * pair.noticeable)
        if stray > limit:
            held, fact = False, f"{fact}, but also {stray:.3f} m {across}"
    return say(held, wish, fact)


@predicate
def start_moved(
    pair: Pair,
    direction: str | None = None,
    *,
    left: float | None = None,
    right: float | None = None,
    front: float | None = None,
    back: float | None = None,
    up: float | None = None,
    down: float | None = None,
    only: bool = True,
) -> CheckResult:
    """The start moved in a direction, or by metres along direction words; `only`: and in no other."""
    return _end_moved(pair, 0, "start", _words(direction, left, right, front, back, up, down), only)


@predicate
def goal_moved(
    pair: Pair,
    direction: str | None = None,
    *,
    left: float | None = None,
    right: float | None = None,
    front: float | None = None,
    back: float | None = None,
    up: float | None = None,
    down: float | None = None,
    only: bool = True,
) -> CheckResult:
    """The goal moved in a direction, or by metres along direction words; `only`: and in no other."""
    return _end_moved(pair, -1, "goal", _words(direction, left, right, front, back, up, down), only)


@predicate
def starts_at(pair: Pair, place: Any, *, within: float | None = None) -> CheckResult:
    """The path starts at a place, within some metres (5 % of the extent unless given)."""
    return _ends_at(pair, 0, "start", place, within)


@predicate
def ends_at(pair: Pair, place: Any, *, within: float | None = None) -> CheckResult:
    """The path ends at a place, within some metres (5 % of the extent unless given)."""
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
        pair: What is compared.
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
        return say(False, wish, "too few waypoints are left")
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
def never_beyond(
    pair: Pair,
    *,
    left: float | None = None,
    right: float | None = None,
    front: float | None = None,
    back: float | None = None,
    up: float | None = None,
    down: float | None = None,
) -> CheckResult:
    """No waypoint's coordinate along a direction word exceeds the bound [m]: left=0 means never left of the origin."""
    bounds = {
        word: b for word, b in zip(DIRECTIONS, (left, right, front, back, up, down), strict=True) if b is not None
    }
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


def _words(direction: str | None, *amounts: float | None) -> dict[str, float | None]:
    named = {word: amount for word, amount in zip(DIRECTIONS, amounts, strict=True) if amount is not None}
    words: dict[str, float | None] = {**named}
    if direction is not None:
        words = {direction: None, **named}
    if not words or not set(words) <= set(DIRECTIONS):
        raise ValueError(f"give a direction or metres along one; directions are {', '.join(DIRECTIONS)}")
    return words


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
    held, parts = True, []
    rest = shift.copy()
    for word, asked in words.items():
        axis = pair.scene.frame.direction(word)
        along = float(shift @ axis)
        rest -= (shift @ axis) * axis
        enough = LEAST_SHIFT * pair.extent
        held &= along >= enough if asked is None else abs(along - asked) <= max(0.1 * abs(asked), 0.5 * pair.noticeable)
        parts.append(f"{along:.3f} m {word}")
    fact = f"it moved {' and '.join(parts)}"
    stray = float(np.linalg.norm(rest))
    if only and stray > max(STRAY * float(np.linalg.norm(shift - rest)), 2 * pair.noticeable):
        held, fact = False, f"{fact}, but also {stray:.3f} m in other directions"
    return say(held, f"move the {kind} {_spoken(words)}", f"{fact} (the {kind})")


def _ends_at(pair: Pair, row: int, kind: str, place: Any, within: float | None) -> CheckResult:
    centre, name = pair.place(place)
    allowed = EDGE * pair.extent if within is None else within
    miss = float(np.linalg.norm(pair.adapted[row, :3] - centre))
    return say(
        miss <= allowed, f"{kind} at {name}", f"the {kind} is {miss:.3f} m from {name} (at most {allowed:.3f} m)"
    )


def _rank_correlation(a: Array, b: Array) -> float:
    x, y = (np.argsort(np.argsort(v, kind="stable"), kind="stable").astype(float) for v in (a, b))
    if np.ptp(b) < 1e-9 or np.ptp(a) < 1e-9:
        return 0.0
    return float(np.corrcoef(x, y)[0, 1])
