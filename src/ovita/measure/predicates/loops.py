"""Checks of figures around or after a path: extensions, spirals, circles, zigzags."""

from __future__ import annotations

from typing import Any

import numpy as np

from ovita.measure.predicates.check import CheckResult, predicate, say
from ovita.measure.predicates.pair import EDGE, Pair, feet
from ovita.paths.frame import DIRECTIONS
from ovita.paths.geometry import SAME_PLACE, Mask, runs
from ovita.paths.trajectory import Array, arc_length, interpolate, source_indices

FULL = 2.0 * np.pi

WHOLE = 0.85
"""The share of a turn that counts as a whole one."""

FLAT = 0.05
"""A closed curve whose third extent is below this share of its first is flat, and round if its radius varies less."""


@predicate
def extended(
    pair: Pair,
    *,
    by: float | None = None,
    left: float | None = None,
    right: float | None = None,
    front: float | None = None,
    back: float | None = None,
    up: float | None = None,
    down: float | None = None,
) -> CheckResult:
    """The path goes on beyond the old goal, by metres in all or along direction words, and covers the old path.

    An amount may be missed by 10 %. Without any, 3 % of the extent will do.
    """
    words = dict(zip(DIRECTIONS, (left, right, front, back, up, down), strict=True))
    asked = {word: amount for word, amount in words.items() if amount is not None}
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
        pair: What is compared.
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
        pair: What is compared.
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
