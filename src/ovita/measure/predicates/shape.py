"""Checks of the path's shape and of its number of waypoints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ovita.measure.predicates.check import CheckResult, predicate, say
from ovita.measure.predicates.pair import EDGE, Pair, Where, feet, said, selected
from ovita.paths.frame import DIRECTIONS
from ovita.paths.geometry import rotation_about, turning_angles
from ovita.paths.part import bends
from ovita.paths.trajectory import Array, interpolate, source_indices

SAME = 0.02
"""Paths deviate by at most this share of the extent if they are the same for a person."""


@predicate
def same_path(pair: Pair, *, tolerance: float = SAME, partly: bool = False) -> CheckResult:
    """The path is untouched: nowhere farther from the original than a share of the extent, nor the other way round.

    Args:
        pair: What is compared.
        tolerance: That share.
        partly: Whether the adapted path may be only a part of the original one, as after a stop.

    Where the original touches an object, it may have been pushed out of it.
    """
    base = feet(pair.original[:, :3], pair.adapted[:, :3])
    off = float((pair.off_path - pair.leeway(base)).max())
    if not partly:
        off = max(off, float((pair.uncovered - pair.leeway(pair.original[:, :3])).max()))
    off = max(off, 0.0)
    fact = f"the path deviates by up to {off:.3f} m (at most {tolerance * pair.extent:.3f} m)"
    return say(off <= tolerance * pair.extent, "leave the path as it was", fact)


@predicate
def shape_kept(pair: Pair) -> CheckResult:
    """The path was shifted as a whole: without the average shift, waypoints are within 5 % of the extent (RMS)."""
    shift = pair.shift[pair.found]
    off = float(np.sqrt(((shift - shift.mean(axis=0)) ** 2).sum(axis=1).mean()))
    return say(off <= EDGE * pair.extent, "keep the shape of the path", f"its shape deviates by {off:.3f} m")


@predicate
def smoother(pair: Pair) -> CheckResult:
    """The path bends less, its sharpest turn does not grow, and it stays.

    The sum of its squared bends falls by 10 %, or that of its squared second differences in an equal number of
    waypoints. The ends stay where they are, and on average the path stays within 15 % of the extent.
    """
    old, new = bends(pair.original[:, :3]), bends(pair.adapted[:, :3])
    count = min(len(pair.original), len(pair.adapted))
    rough = [_roughness(rows[:, :3], count) for rows in (pair.original, pair.adapted)]
    held = _energy(new) <= 0.9 * _energy(old) or rough[1] <= 0.9 * rough[0]
    held = held and bool(new.max() <= old.max() + np.radians(2.0))
    fact = _bends_said(old, new)
    ends = np.linalg.norm(pair.adapted[[0, -1], :3] - pair.original[[0, -1], :3], axis=1).max()
    if float(ends) > EDGE * pair.extent or float(pair.uncovered.mean()) > 0.15 * pair.extent:
        held, fact = False, f"{fact}, but the path left its place by {max(float(ends), pair.uncovered.mean()):.3f} m"
    return say(held, "make the path smoother", fact)


@predicate
def curvier(pair: Pair) -> CheckResult:
    """The path bends more: the sum of its squared bends grows by 10 %."""
    old, new = bends(pair.original[:, :3]), bends(pair.adapted[:, :3])
    return say(_energy(new) >= 1.1 * _energy(old) + 1e-6, "make the path curvier", _bends_said(old, new))


@predicate
def finer(pair: Pair) -> CheckResult:
    """There are more waypoints, and the path turns less at the sharpest one, as a spline does."""
    old, new = float(turning_angles(pair.original[:, :3]).max()), float(turning_angles(pair.adapted[:, :3]).max())
    held = len(pair.adapted) > len(pair.original) and new < old
    fact = f"waypoints went from {len(pair.original)} to {len(pair.adapted)}, the sharpest turn from "
    return say(
        held, "put in waypoints that round the corners", f"{fact}{np.degrees(old):.0f} to {np.degrees(new):.0f} degrees"
    )


@predicate
def straight(pair: Pair, where: Where = None) -> CheckResult:
    """The selected stretch is straight within 3 % of its length; its ends stay within 10 % of the extent."""
    index = np.flatnonzero(selected(pair, where) & pair.found)
    wish = f"go straight{said(where)}"
    if len(index) < 3:
        return say(False, wish, "too few waypoints are left")
    low, high = np.sort(pair.source[[index[0], index[-1]]])
    inner = pair.adapted[int(np.ceil(low)) : int(np.floor(high)) + 1, :3]
    a, b = pair.matched[index[0], :3], pair.matched[index[-1], :3]
    length = max(float(np.linalg.norm(b - a)), 1e-9)
    share = np.clip((inner - a) @ (b - a) / length**2, 0.0, 1.0)
    off = float(np.linalg.norm(inner - a - share[:, None] * (b - a), axis=1).max())
    ends = float(np.linalg.norm(pair.shift[[index[0], index[-1]]], axis=1).max())
    held = off <= 0.03 * length and ends <= 2 * EDGE * pair.extent
    return say(held, wish, f"the path deviates from a straight line by {off:.3f} m over {length:.3f} m")


@predicate
def mirrored(pair: Pair, directions: Sequence[str], *, where: Where = None) -> CheckResult:
    """The selected waypoints are mirrored: their coordinates along each direction word are reversed.

    The mirror may stand anywhere; the other coordinates stay within 5 % of the extent.
    """
    mask = selected(pair, where) & pair.found
    wish = f"mirror the path{said(where)} {' and '.join(directions)}"
    frame = pair.scene.frame
    if mask.sum() < 3:
        return say(False, wish, "too few waypoints are left")
    off, lever = 0.0, 0.0
    for word in DIRECTIONS[1::2]:
        axis = frame.direction(word)
        old, new = pair.original[mask, :3] @ axis, pair.matched[mask, :3] @ axis
        if any(abs(axis @ frame.direction(flipped)) > 0.5 for flipped in directions):
            off = max(off, float((old + new).std()))
            lever = max(lever, float(np.abs(new - old).max()))
        else:
            off = max(off, float(np.abs(new - old).mean()))
    held = off <= 0.03 * pair.extent and lever >= 3 * pair.noticeable
    return say(
        held, wish, f"the waypoints deviate from a mirror image by {off:.3f} m, and moved by {lever:.3f} m at most"
    )


@predicate
def rotated(pair: Pair, degrees: float, axis: str = "up", *, where: Where = None) -> CheckResult:
    """The path is turned about an axis through any point.

    Args:
        pair: What is compared.
        degrees: Anticlockwise seen from the tip of the axis, within 10 degrees.
        axis: A direction word.
        where: Only these waypoints.
    """
    mask = selected(pair, where) & pair.found
    wish = f"turn the path by {degrees:g} degrees about {axis}{said(where)}"
    if mask.sum() < 3:
        return say(False, wish, "too few waypoints are left")
    old, new = pair.original[mask, :3], pair.matched[mask, :3]
    old, new = old - old.mean(axis=0), new - new.mean(axis=0)
    best = float("inf")
    for miss in np.linspace(-10.0, 10.0, 9):
        turned = old @ rotation_about(pair.scene.frame.direction(axis), np.radians(degrees + miss)).T
        best = min(best, float(np.sqrt(((turned - new) ** 2).sum(axis=1).mean())))
    return say(best <= 0.03 * pair.extent, wish, f"waypoints deviate from that by {best:.3f} m (RMS)")


@predicate
def reversed_part(pair: Pair, where: Where = None) -> CheckResult:
    """The selected stretch is travelled the other way round, within 5 % of the extent (RMS)."""
    mask = selected(pair, where) & pair.found
    off = pair.matched[mask, :3] - pair.original[mask, :3][::-1]
    rms = float(np.sqrt((off**2).sum(axis=1).mean())) if mask.any() else float("inf")
    return say(
        rms <= EDGE * pair.extent, f"reverse the path{said(where)}", f"it deviates from that by {rms:.3f} m (RMS)"
    )


@predicate
def more_waypoints(pair: Pair, *, factor: float | None = None) -> CheckResult:
    """There are more waypoints, or so many times as many, give or take 2."""
    return _counted(pair, "more waypoints", len(pair.adapted) > len(pair.original), factor)


@predicate
def fewer_waypoints(pair: Pair, *, factor: float | None = None) -> CheckResult:
    """There are fewer waypoints, or so many times as many, give or take 2."""
    return _counted(pair, "fewer waypoints", len(pair.adapted) < len(pair.original), factor)


@predicate
def group_averages(pair: Pair, size: int) -> CheckResult:
    """Each group of so many consecutive waypoints is replaced by its average, once or in the place of each of them."""
    old, new = pair.original[:, :3], pair.adapted[:, :3]
    means = np.array([old[i : i + size].mean(axis=0) for i in range(0, len(old), size)])
    whole = means[: len(old) // size]
    off = float("inf")
    for wanted in (means, whole, means[np.arange(len(old)) // size]):
        if len(wanted) == len(new):
            off = min(off, float(np.linalg.norm(new - wanted, axis=1).max()))
    wish = f"replace every {size} waypoints by their average"
    fact = f"{len(old)} waypoints became {len(new)}"
    fact += f", up to {off:.3f} m from the averages" if np.isfinite(off) else f", not {len(means)}"
    return say(off <= SAME * pair.extent, wish, fact)


@predicate
def finite(pair: Pair, *, reach: float = 1.5) -> CheckResult:
    """Every number is finite, and no waypoint is farther than `reach` extents outside the box of path and objects."""
    rows = pair.adapted
    if not np.isfinite(rows).all():
        return say(False, "send finite numbers only", "a waypoint is not finite")
    known = np.concatenate([pair.original[:, :3], *[item.position[None] for item in pair.scene]])
    low, high = known.min(axis=0), known.max(axis=0)
    out = float(np.linalg.norm(np.maximum(np.maximum(low - rows[:, :3], rows[:, :3] - high), 0.0), axis=1).max())
    return say(out <= reach * pair.extent, "stay near the scene", f"the path goes {out:.3f} m beyond path and objects")


@predicate
def no_jumps(pair: Pair, *, factor: float = 4.0) -> CheckResult:
    """No step between waypoints is longer than so many times the longest one of the original."""
    old = float(np.linalg.norm(np.diff(pair.original[:, :3], axis=0), axis=1).max())
    new = float(np.linalg.norm(np.diff(pair.adapted[:, :3], axis=0), axis=1).max())
    allowed = factor * old * max(1.0, len(pair.original) / len(pair.adapted))
    return say(new <= allowed, "get there without a jump", f"the longest step went from {old:.3f} to {new:.3f} m")


@predicate
def gradual(pair: Pair) -> CheckResult:
    """The shift sets in gradually: from one waypoint to the next it changes by at most half of the largest shift."""
    shift = pair.shift[pair.found]
    largest = float(np.linalg.norm(shift, axis=1).max(initial=0.0))
    step = float(np.linalg.norm(np.diff(shift, axis=0), axis=1).max(initial=0.0))
    fact = f"of a shift of {largest:.3f} m, {step:.3f} m set in between two neighbouring waypoints"
    return say(step <= max(0.5 * largest, 2 * pair.noticeable), "move there smoothly", fact)


def _counted(pair: Pair, wish: str, held: bool, factor: float | None) -> CheckResult:
    n, m = len(pair.original), len(pair.adapted)
    if factor is not None:
        wish, held = f"{wish}, {factor:g} times as many", held and abs(m - factor * n) <= 2
    return say(held, f"use {wish}", f"waypoints went from {n} to {m}")


def _energy(angles: Array) -> float:
    return float((angles**2).sum())


def _roughness(positions: Array, count: int) -> float:
    even = interpolate(positions, source_indices(positions, count, "index"))
    return float((np.diff(even, n=2, axis=0) ** 2).sum())


def _bends_said(old: Array, new: Array) -> str:
    return (
        f"bends went from {_energy(old):.2f} to {_energy(new):.2f} rad^2 in all, "
        f"the sharpest from {np.degrees(old.max()):.0f} to {np.degrees(new.max()):.0f} degrees"
    )
