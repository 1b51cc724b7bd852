"""Checks of the path's shape and number of waypoints, and of figures: extensions, spirals, circles, zigzags."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Unpack

import numpy as np

from ovita.measure.predicates.check import (
    EDGE,
    FEW,
    CheckResult,
    Pair,
    Where,
    feet,
    predicate,
    said,
    say,
    selected,
    stated,
)
from ovita.paths.geometry import SAME_PLACE, Mask, rotation_about, runs, turning_angles
from ovita.paths.part import bends
from ovita.paths.scene import DIRECTIONS
from ovita.paths.trajectory import Array, arc_length, interpolate, source_indices
from ovita.toolkit.arguments import OffsetLimits

SAME = 0.02
"""Paths deviate by at most this share of the extent if they are the same for a person."""


@predicate
def same_path(pair: Pair, *, tolerance: float = SAME, partly: bool = False) -> CheckResult:
    """The path is untouched: nowhere farther from the original than a share of the extent, nor the other way round.

    Args:
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
        return say(False, wish, FEW)
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
    parts = pair.part(where)
    wish = f"mirror the path{said(where)} {' and '.join(directions)}"
    frame = pair.scene.frame
    if len(parts[0]) < 3:
        return say(False, wish, FEW)
    off, lever = 0.0, 0.0
    for word in DIRECTIONS[1::2]:
        axis = frame.direction(word)
        old, new = (rows[:, :3] @ axis for rows in parts)
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
        degrees: Anticlockwise seen from the tip of the axis, within 10 degrees.
        axis: A direction word.
        where: Only these waypoints.
    """
    wish = f"turn the path by {degrees:g} degrees about {axis}{said(where)}"
    old, new = (rows[:, :3] for rows in pair.part(where))
    if len(old) < 3:
        return say(False, wish, FEW)
    old, new = old - old.mean(axis=0), new - new.mean(axis=0)
    best = float("inf")
    for miss in np.linspace(-10.0, 10.0, 9):
        turned = old @ rotation_about(pair.scene.frame.direction(axis), np.radians(degrees + miss)).T
        best = min(best, float(np.sqrt(((turned - new) ** 2).sum(axis=1).mean())))
    return say(best <= 0.03 * pair.extent, wish, f"waypoints deviate from that by {best:.3f} m (RMS)")


@predicate
def reversed_part(pair: Pair, where: Where = None) -> CheckResult:
    """The selected stretch is travelled the other way round, within 5 % of the extent (RMS)."""
    old, new = (rows[:, :3] for rows in pair.part(where))
    rms = float(np.sqrt(((new - old[::-1]) ** 2).sum(axis=1).mean())) if len(old) else float("inf")
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


FULL = 2.0 * np.pi

WHOLE = 0.85
"""The share of a turn that counts as a whole one."""

FLAT = 0.05
"""A closed curve whose third extent is below this share of its first is flat, and round if its radius varies less."""


@predicate
def extended(pair: Pair, *, by: float | None = None, **metres: Unpack[OffsetLimits]) -> CheckResult:
    """The path goes on beyond the old goal, by metres in all or along direction words, and covers the old path.

    An amount may be missed by 10 %. Without any, 3 % of the extent will do.
    """
    asked = stated(metres)
    tail = pair.tail[:, :3]
    length, added = float(arc_length(tail)[-1]), tail[-1] - pair.original[-1, :3]
    away = float(np.linalg.norm(tail - pair.original[-1, :3], axis=1).max())
    covered = float((pair.uncovered <= EDGE * pair.extent).mean())
    held = covered >= 0.95 and away >= 3 * pair.noticeable
    fact = f"the path goes on for {length:.3f} m" if length > pair.noticeable else "the path ends where it did"
    if by is not None:
        held = held and abs(length - by) <= max(0.1 * by, 0.5 * pair.noticeable)
    if asked:
        wanted = pair.scene.frame.offset(**asked)
        miss = float(np.linalg.norm(added - wanted))
        held = held and miss <= max(0.15 * float(np.linalg.norm(wanted)), pair.noticeable)
        fact += f", and its end is {miss:.3f} m from where it should be"
    if covered < 0.95:
        fact += f", and {1.0 - covered:.0%} of the old path are lost"
    amount = f" by {by:g} m" if by is not None else "".join(f" {amount:g} m {word}" for word, amount in asked.items())
    return say(held, f"go on after the goal{amount}", fact)


@predicate
def spiral(pair: Pair, *, near: Any = None, turns: float | None = None, max_radius: float | None = None) -> CheckResult:
    """The path winds in a spiral or a helix, after the old goal or near a place; a plain circle is none.

    Args:
        near: The place near which it winds; None: after the old goal.
        turns: So many turns, give or take a half; None for one or more.
        max_radius: Its largest radius [m]; 30 % more will do. Without it, half of the extent.
    """
    limit = 1.3 * max_radius if max_radius is not None else 0.5 * pair.extent
    wish = "wind in a spiral" + (f" of {turns:g} turns" if turns is not None else "")
    if near is not None:
        centre, name = pair.place(near)
        wish += f" near {name}"
        stretch, wound = _local_loop(pair, centre)
    else:
        wish += " after the goal"
        stretch, wound = _wound(pair.tail[:, :3])
    if max_radius is not None:
        wish += f" of at most {max_radius:g} m radius"
    radius = _radius(stretch)
    held = wound >= WHOLE and radius <= limit and not is_circle(stretch)
    if turns is not None:
        held = held and abs(wound - turns) <= 0.5
    fact = f"it makes {wound:.1f} turns of up to {radius:.3f} m radius"
    if wound >= WHOLE and is_circle(stretch):
        fact += " in a plain circle"
    return say(held, wish, fact)


@predicate
def circles(pair: Pair, around: Any, *, turns: float = 1.0, axis: str = "up") -> CheckResult:
    """The path goes around a place so many times more than before, by its winding number about a direction word."""
    centre, name = pair.place(around)
    direction = pair.scene.frame.direction(axis)
    old, new = swept(pair.original[:, :3], centre, direction), swept(pair.adapted[:, :3], centre, direction)
    more = abs(float((new[-1] - new[0]) - (old[-1] - old[0]))) / FULL
    most, before = float(np.ptp(new)) / FULL, float(np.ptp(old)) / FULL
    held = abs(more - turns) <= 0.3 or (turns - 0.15 <= most <= turns + 0.5 and before < turns - 0.3)
    fact = f"the path sweeps {most:.2f} turns around {name} (before: {before:.2f})"
    return say(held, f"go {turns:g} times around {name}", fact)


@predicate
def zigzags(pair: Pair, least: int = 4, *, amplitude: float | None = None) -> CheckResult:
    """The path swings from one side of the original to the other, at least so many times.

    Args:
        least: Number of crossings.
        amplitude: The largest deviation [m], within 30 %; None for any above 1 % of the extent.
    """
    if len(pair.adapted) == len(pair.original):
        sideways = pair.shift
    else:
        sideways = pair.adapted[:, :3] - feet(pair.original[:, :3], pair.adapted[:, :3])
    size = np.linalg.norm(sideways, axis=1)
    swings = sideways[size > pair.noticeable]
    crossings = int(((swings[1:] * swings[:-1]).sum(axis=1) < 0).sum()) if len(swings) > 1 else 0
    largest = float(size.max())
    held = crossings >= least and largest <= 0.5 * pair.extent
    wish = f"swing from side to side at least {least} times"
    if amplitude is not None:
        wish, held = f"{wish} by {amplitude:g} m", held and abs(largest / amplitude - 1.0) <= 0.3
    return say(held, wish, f"the path changes sides {crossings} times and deviates by up to {largest:.3f} m")


def _wound(points: Array) -> tuple[Array, float]:
    """The points, and how often they wind around in the view in which they do most."""
    if len(points) < 4:
        return points, 0.0
    most = max(float(np.ptp(net_turning(points, normal))) for normal in normals(points))
    return points, most / FULL


def _local_loop(pair: Pair, centre: Array) -> tuple[Array, float]:
    """The part (K, 3) that departs from the original at its closest approach to a centre, and its added turns."""
    old, new = pair.original[:, :3], pair.adapted[:, :3]
    nearest, around = old[int(np.argmin(np.linalg.norm(old - centre, axis=1)))], 0.3 * pair.extent
    inside = np.linalg.norm(new - nearest, axis=1) <= around
    off = np.where(inside, pair.off_path, 0.0)
    left = np.flatnonzero(off > 0.2 * off.max())
    if off.max() <= 0.5 * pair.noticeable:
        return new[:1], 0.0
    added = _most_turns(new, inside) - _most_turns(old, np.linalg.norm(old - nearest, axis=1) <= around)
    return new[left[0] : left[-1] + 1], max(added, 0.0)


def _most_turns(rows: Array, inside: Mask) -> float:
    """How often an unbroken stretch of the selected rows (N, 3) winds around in the view in which it does most."""
    return max((_wound(rows[a : b + 1])[1] for a, b in runs(inside)), default=0.0)


def _radius(points: Array) -> float:
    """Half of the width of points (N, 3) across the direction in which they wind [m]."""
    if len(points) < 4:
        return 0.0
    views = normals(points)
    turns = [float(np.ptp(net_turning(points, normal))) for normal in views]
    # Of the views that see all the winding, the narrowest looks along the axis.
    widths = [
        float(np.ptp(points - np.outer(points @ normal, normal), axis=0).max()) / 2.0
        for normal, turn in zip(views, turns, strict=True)
        if turn >= 0.9 * max(turns)
    ]
    return min(widths)


def net_turning(points: Array, normal: Array) -> Array:
    """Turning (K,) [rad] accumulated up to each point (K, 3), seen along a normal (3,), anticlockwise positive."""
    u = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    total = np.zeros(len(points))
    steps = np.diff(points, axis=0)
    flat = np.column_stack([steps @ u, steps @ v])
    moving = np.flatnonzero(np.linalg.norm(flat, axis=1) > SAME_PLACE)
    if len(moving) < 2:
        return total
    heading = np.arctan2(flat[moving, 1], flat[moving, 0])
    turn = (np.diff(heading) + np.pi) % (2.0 * np.pi) - np.pi
    total[moving[1:]] = turn
    return np.cumsum(total)


def normals(points: Array) -> Array:
    """Directions (K, 3) from which to look for loops: the axes, those of the points (N, 3), and 24 more."""
    k = np.arange(24)
    height = 1.0 - (k + 0.5) / 24
    around = k * np.pi * (3.0 - np.sqrt(5.0))
    radius = np.sqrt(1.0 - height**2)
    spread = np.column_stack([radius * np.cos(around), radius * np.sin(around), height])
    return np.concatenate([np.eye(3), principal(points)[1], spread])


def principal(points: Array) -> tuple[Array, Array]:
    """Extents (3,) [m] and directions (3, 3), rows, of points (N, 3), largest first."""
    _, size, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=len(points) < 3)
    extents = np.zeros(3)
    extents[: len(size)] = size
    return extents, axes[:3]


def is_circle(points: Array) -> bool:
    """Whether points (N, 3) lie flat at one distance from one centre."""
    if len(points) < 4:
        return False
    size, axes = principal(points)
    flat = (points - points.mean(axis=0)) @ axes[:2].T
    if size[2] > FLAT * size[0]:
        return False
    system = np.column_stack([2.0 * flat, np.ones(len(flat))])
    solution, *_ = np.linalg.lstsq(system, (flat**2).sum(axis=1), rcond=None)
    radius = np.linalg.norm(flat - solution[:2], axis=1)
    return bool(np.median(np.abs(radius - np.median(radius))) <= FLAT * np.median(radius))


def swept(positions: Array, centre: Array, axis: Array) -> Array:
    """Angle (K,) [rad] of a path (N, 3) around an axis (3,) through a centre (3,), sampled finely."""
    points = interpolate(positions, source_indices(positions, 2000, "arc_length")) - centre
    u = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    u /= np.linalg.norm(u)
    return np.asarray(np.unwrap(np.arctan2(points @ np.cross(axis, u), points @ u)))
