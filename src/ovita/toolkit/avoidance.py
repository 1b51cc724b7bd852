"""Ways that are not to be taken, over an object, under it, or between two, and ways around it on a side."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.geometry import Cuboid, Mask, fractions, lengths
from ovita.paths.scene import RFU, Frame
from ovita.paths.trajectory import Array, arc_length
from ovita.toolkit import arguments
from ovita.toolkit.approach import around, stays
from ovita.toolkit.arguments import GENTLE, ROUNDING, Target, followed, smoothstep
from ovita.toolkit.catalogue import operation
from ovita.toolkit.ways_around import kept_out

Way = Literal["over", "under", "between"]

UPRIGHT = 0.999
"""Cosine of the tilt up to which a box counts as upright."""


@operation("Objects: come closer, stay away, pass")
def avoid(
    traj: ArrayLike,
    way: Way,
    obj: Target,
    other: Target | None = None,
    *,
    gap: float = 0.0,
    ease: float | None = None,
    frame: Frame = RFU,
) -> Array:
    """Bend the path sideways so that it passes neither over an object, nor under it, or not between two.

    It goes around on the side where it is out soonest, at about its own height, as keep_distance does. A start or goal
    that is over the object, or between the two, moves too.

    Args:
        way: "over" and "under" are about obj, "between" about obj and other.
        other: Object or point (3,) [m], for "between".
        gap: How far beside the object, seen from above, it passes at least [m], >= 0.
    """
    rows = arguments.waypoints(traj)
    bodies = shut(way, obj, other, arguments.number(gap, "gap", low=0.0), rows[:, :3], frame)
    moved, everywhere = rows[:, :3].copy(), np.ones(len(rows), dtype=bool)
    if way == "between":
        wall, *bodies = bodies
        moved = _around_ends(moved, wall, bodies)
    if min(body.closest(moved)[0] for body in bodies) < -ROUNDING:
        moved = kept_out(moved, bodies, everywhere, frame.direction("up"))
    return followed(rows, moved, everywhere, arguments.share(ease, "ease"))


def _around_ends(path: Array, wall: Cuboid, bodies: Sequence[Cuboid]) -> Array:
    """A path (N, 3) [m] that crosses the line of a wall beside it, and beside the bodies at its ends.

    Where it crosses the wall it is shifted along it, with what is before and behind; so it crosses nowhere else.
    """
    ahead, across = wall.rotation[:, 0], wall.rotation[:, 1]
    least, most = (float(sense * body.support(sense * ahead[None])[0] - wall.center @ ahead)
                   for sense, body in zip((-1.0, 1.0), bodies, strict=True))  # fmt: skip
    for _ in range(len(path)):
        side, place = (path - wall.center) @ across, (path - wall.center) @ ahead
        share = side[:-1] / np.where(np.diff(side) == 0.0, 1.0, -np.diff(side))
        where = place[:-1] + share * np.diff(place)
        crossed = np.flatnonzero((side[:-1] * side[1:] <= 0.0) & (where > least + ROUNDING) & (where < most - ROUNDING))
        if not len(crossed):
            break
        i = int(crossed[0])
        shift = min(most - where[i], least - where[i], key=abs)
        s = arc_length(path)
        at = s[i] + share[i] * (s[i + 1] - s[i])
        begin, end = (min(GENTLE * abs(shift), max(room, ROUNDING)) for room in (at, s[-1] - at))
        away = np.where(s < at, (at - s) / begin, (s - at) / end)
        path = path + (shift * smoothstep(1.0 - np.maximum(away - 1.0 / 3.0, 0.0) * 1.5))[:, None] * ahead
    return path


def shut(way: Way, obj: Target, other: Target | None, gap: float, path: Array, frame: Frame) -> list[Cuboid]:
    """The bodies that shut a way to a path (N, 3) [m]: what is above or below an object, or a wall between two.

    Raises:
        ValueError: If there is no such way.
    """
    if way not in ("over", "under", "between"):
        raise ValueError(f"way must be 'over', 'under' or 'between', not {way!r}")
    if (way == "between") != (other is not None):
        raise ValueError("give the other object for 'between', and for nothing else")
    up, tall = frame.direction("up"), 2.0 * float(lengths(path - arguments.point(obj)).max()) + 1.0
    if other is None:
        return [_column(obj, gap, up, tall, 1.0 if way == "over" else -1.0)]
    a, b = arguments.point(obj), arguments.point(other, "other")
    along = (b - a) - ((b - a) @ up) * up
    length = float(lengths(along))
    if length < ROUNDING:
        raise ValueError("one of the two is above the other; nothing passes between them")
    ahead = along / length
    axes = np.column_stack([ahead, np.cross(up, ahead), up])
    wall = Cuboid((a + b) / 2.0, axes, np.array([length / 2.0, 0.0, tall]), max(gap, ROUNDING))
    return [wall, *(_column(one, gap, up, tall, 0.0) for one in (obj, other))]


def _column(target: Target, gap: float, up: Array, tall: float, sense: float) -> Cuboid:
    """An object with all that is above it (sense 1), below it (-1), or both (0), and a gap beside."""
    body = around(target, gap)
    upright = np.abs(up @ body.rotation)
    rotation, half = body.rotation, body.half.copy()
    if upright.max() < UPRIGHT:
        rotation, half = np.eye(3), np.abs(rotation) @ half
        upright = np.abs(up)
    i = int(upright.argmax())
    rise = (tall - half[i]) / 2.0 * abs(sense)
    half[i] = tall if sense == 0.0 else (tall + half[i]) / 2.0
    return replace(body, center=body.center + sense * rise * up, rotation=rotation, half=half)


@operation("Objects: come closer, stay away, pass")
def go_round(
    traj: ArrayLike, obj: Target, side: str, *, gap: float = 0.1, ease: float | None = None, frame: Frame = RFU
) -> Array:
    """Replace the stretch that passes an object by a taut way around it on a side; heights stay.

    It leaves the path and comes back to it where that is shortest and turns least, between the stops on either side,
    and keeps so far from the object, seen from above. Only the nearest pass is led around. Where that is on the side
    already, or no way leads around with the waypoints that there are, all stays.

    Args:
        side: Direction word of the side on which to pass, seen from the object: "left", "right", "front" or "back".
        gap: How far beside the object, seen from above, it passes at least [m], >= 0.
    """
    rows = arguments.waypoints(traj)
    path, up, aside = rows[:, :3], frame.direction("up"), arguments.direction(frame, side)
    if abs(aside @ up) > ROUNDING:
        raise ValueError(f"side must be level, not {side!r}: go_through(traj, obj, up=...) passes above it")
    body = around(obj, arguments.number(gap, "gap", low=0.0))
    plane = np.array([np.cross(aside, up), aside])  # seen from above, towards the side
    nearest = int(body.depth(path).argmin())
    first, last = _between_stops(rows, nearest)
    stretch, centre = path[first : last + 1], body.center @ plane.T
    flat, outline = stretch @ plane.T, _outline(body, plane)
    if _clear_of(outline, flat) and _passes_above(flat - centre):
        return rows
    for wider in WIDER:  # chords between few waypoints cut corners
        grown = replace(body, radius=body.radius + wider * _reach(body))
        way = _way_round(flat, nearest - first, _outline(grown, plane), centre)
        if way is None:
            break
        a, b, rope = way
        count, length = b - a + 1, arc_length(rope)
        even = np.linspace(0.0, length[-1], count)
        level = np.column_stack([np.interp(even, length, rope[:, k]) for k in range(2)])
        if _clear_of(outline, level) and _passes_above(level - centre):
            heights = np.interp(np.linspace(0.0, 1.0, count), fractions(stretch[a : b + 1]), stretch[a : b + 1] @ up)
            moved = path.copy()
            moved[first + a + 1 : first + b] = (level @ plane + heights[:, None] * up)[1:-1]
            return followed(rows, moved, np.ones(len(rows), dtype=bool), arguments.share(ease, "ease"))
    return rows


WIDER = (0.0, 0.05, 0.15, 0.4, 1.0)
"""Shares of an object's size by which a way goes farther around it, until none of its segments comes too near."""

SAMPLES = np.linspace(0.0, 1.0, 9)[:, None, None]
"""Where each segment of a way is looked at."""


def _reach(body: Cuboid) -> float:
    """The size of a body [m]."""
    return float(2.0 * body.half.max() + body.radius)


def _clear_of(outline: Array, way: Array) -> bool:
    """Whether no segment of a way (C, 2) comes into an outline (K, 2)."""
    points = ((1.0 - SAMPLES) * way[:-1] + SAMPLES * way[1:]).reshape(-1, 2)
    return not _within(outline, points, NICKED * float(np.ptp(outline, axis=0).mean())).any()


NICKED = 0.01
"""How far a way may come into an outline, as a share of its size."""


def _within(outline: Array, points: Array, by: float = 0.0) -> Mask:
    """Which points (M, 2) are in a convex outline (K, 2), counterclockwise, by more than so much [m]."""
    edges = np.roll(outline, -1, axis=0) - outline
    sizes = np.linalg.norm(edges, axis=1)
    real = sizes > ROUNDING  # at a corner that is not rounded, several points are one
    beyond = _cross(edges[real] / sizes[real, None], points[:, None] - outline[real])
    return np.asarray((beyond > by).all(axis=1) & real.any())


ROUND = 64
"""Points with which an outline is drawn."""

CANDIDATES = 32
"""Places of the path at which a way around an object may leave it or come back to it."""

MOST_ROUND = 0.75
"""The share of an outline that a way around it follows at most."""

OWN, CORNERS = 0.25, 0.3
"""What a metre of the path that is left out counts, and a radian of a corner where a way leaves it, in outlines."""

_SIGNS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
"""The corners of a cuboid, in half edges."""


def _outline(body: Cuboid, plane: Array) -> Array:
    """The convex outline (K, 2) [m] of all that is near a body, seen along a plane's normal, counterclockwise."""
    turns = np.linspace(0.0, 2.0 * np.pi, ROUND, endpoint=False)
    ways = np.column_stack([np.cos(turns), np.sin(turns)])
    corners = (body.center + (_SIGNS * body.half) @ body.rotation.T) @ plane.T
    outmost = corners[(corners @ ways.T).argmax(axis=0)]
    return np.asarray(outmost + body.radius / np.cos(np.pi / ROUND) * ways)


def _between_stops(rows: Array, nearest: int) -> tuple[int, int]:
    """The first and the last waypoint of the stretch without a stop that passes an object at a waypoint."""
    fixed = np.flatnonzero(stays(rows))
    return int(fixed[fixed <= nearest].max(initial=0)), int(fixed[fixed >= nearest].min(initial=len(rows) - 1))


def _way_round(path: Array, nearest: int, outline: Array, centre: Array) -> tuple[int, int, Array] | None:
    """The best way around an outline on the side of +y: its first and last waypoint, and its corners (C, 2).

    Args:
        path: (N, 2) [m].
        nearest: The waypoint that passes the object.
        outline: Convex, counterclockwise (K, 2) [m].
        centre: Of the object, (2,) [m].
    """
    least, found = np.inf, None
    for mirror in (np.ones(2), np.array([-1.0, 1.0])):  # past the top against x, then along it
        corners = outline if mirror[0] > 0.0 else outline[::-1] * mirror
        for cost, a, b, rope in _ropes(path * mirror, nearest, corners):
            if cost < least and _passes_above(rope - centre * mirror):
                least, found = cost, (a, b, rope * mirror)
    return found


def _ropes(path: Array, nearest: int, outline: Array) -> Iterator[tuple[float, int, int, Array]]:
    """Taut ways past a waypoint of a path (N, 2) [m] that keep an outline (K, 2) to their left, each with its cost."""
    free = np.flatnonzero(~_within(outline, path))
    tried = free[np.unique(np.linspace(0, len(free) - 1, CANDIDATES).round().astype(int))] if len(free) else free
    seen, ahead = outline - path[tried, None], outline.mean(axis=0) - path[tried]
    angles = np.arctan2(_cross(ahead[:, None], seen), (ahead[:, None] * seen).sum(axis=2))
    onto, off = angles.argmin(axis=1), angles.argmax(axis=1)  # where a rope touches the outline, and where it leaves it
    s, size = arc_length(path), float(np.ptp(outline, axis=0).mean())
    for i, j in product(np.flatnonzero(tried <= nearest), np.flatnonzero(tried >= nearest)):
        a, b = int(tried[i]), int(tried[j])
        if a == b:
            continue
        rope = _rope(path[a], path[b], outline, int(onto[i]), int(off[j]))
        if rope is not None:
            corners = _turn(path, a, rope[1] - rope[0]) + _turn(path, b, rope[-1] - rope[-2])
            yield arc_length(rope)[-1] + OWN * (s[b] - s[a]) + CORNERS * size * corners, a, b, rope


def _rope(begin: Array, end: Array, outline: Array, onto: int, off: int) -> Array | None:
    """A taut way (C, 2) from one point to another with an outline to its left; None if it would wind around it."""
    if (_cross(end - begin, outline - begin) >= 0.0).all():
        return np.array([begin, end])
    count = (off - onto) % len(outline) + 1
    if count > MOST_ROUND * len(outline):
        return None
    return np.vstack([begin, outline[(onto + np.arange(count)) % len(outline)], end])


def _turn(path: Array, at: int, way: Array) -> float:
    """The angle between the path (N, 2) at a waypoint and a way that leaves or meets it there [rad]; 0 at its ends."""
    if at in (0, len(path) - 1):
        return 0.0
    heading = path[at + 1] - path[at - 1]
    return float(abs(np.arctan2(_cross(heading, way), heading @ way)))


def _passes_above(aside: Array) -> bool:
    """Whether a way (C, 2) crosses the vertical through the origin above it, and nowhere below."""
    crossing = np.flatnonzero((aside[:-1, 0] <= 0.0) != (aside[1:, 0] <= 0.0))
    if not len(crossing):
        return False
    one, other = aside[crossing], aside[crossing + 1]
    heights = one[:, 1] - one[:, 0] * (other[:, 1] - one[:, 1]) / (other[:, 0] - one[:, 0])
    return bool((heights > 0.0).all())


def _cross(a: Array, b: Array) -> Array:
    """The cross products of plane vectors (..., 2)."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
