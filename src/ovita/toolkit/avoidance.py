"""Ways that are not to be taken: over an object, under it, or between two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.geometry import Cuboid, lengths
from ovita.paths.scene import RFU, Frame
from ovita.paths.trajectory import Array, arc_length
from ovita.toolkit import arguments
from ovita.toolkit.approach import around
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
    for _ in range(len(path)):
        side, place = (path - wall.center) @ across, (path - wall.center) @ ahead
        share = side[:-1] / np.where(np.diff(side) == 0.0, 1.0, -np.diff(side))
        where = place[:-1] + share * np.diff(place)
        crossed = np.flatnonzero((side[:-1] * side[1:] <= 0.0) & (np.abs(where) < wall.half[0]))
        if not len(crossed):
            break
        i = int(crossed[0])
        reach = [float(body.support(sense * ahead[None])[0] - sense * wall.center @ ahead)
                 for sense, body in zip((-1.0, 1.0), bodies, strict=True)]  # fmt: skip
        shift = min(reach[1] - where[i], -reach[0] - where[i], key=abs)
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
