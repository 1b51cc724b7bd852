"""Keep a path within limits, on one side of an object, in a quadrant or at a height."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.scene import RFU, Frame
from ovita.paths.trajectory import Array
from ovita.toolkit import arguments
from ovita.toolkit.arguments import Place, Target
from ovita.toolkit.courses import anchor
from ovita.toolkit.overhead import extent
from ovita.toolkit.shaping import runs, smoothstep

ROUNDED = 0.02
"""Least distance from a limit at which a path begins to give way [m]."""

END_SHARE = 0.1
"""Fraction of the path near each end where it gives way less, so that a start or goal that complies stays."""

SIDES = {"above": "up", "below": "down", "behind": "back"}
QUADRANTS = {1: ("right", "front"), 2: ("left", "front"), 3: ("left", "back"), 4: ("right", "back")}


def bound(
    traj: ArrayLike,
    *,
    left: float | None = None,
    right: float | None = None,
    front: float | None = None,
    back: float | None = None,
    up: float | None = None,
    down: float | None = None,
    of: Place | None = None,
    where: ArrayLike | None = None,
    frame: Frame = RFU,
) -> Array:
    """Stay within so many metres left, up, ... of the origin or of=cup; down=-0.1: at least 0.1 up.

    A limit is a coordinate along its word, so right=-0.1 with of=cup means at least 0.1 m left of the cup's centre.
    Waypoints beyond a limit are moved onto it, the others stay as they are.

    Args:
        traj: (N, 4).
        left: The farthest left allowed [m], or None for no limit; the other words likewise.
        right: [m].
        front: [m].
        back: [m].
        up: [m].
        down: [m].
        of: What the metres count from: object or point (3,) [m], or the place of a waypoint; None for the origin.
        where: Mask (N,), or None for all waypoints.
        frame: Which way is left.
    """
    rows = arguments.waypoints(traj)
    words = {"left": left, "right": right, "front": front, "back": back, "up": up, "down": down}
    limits = {word: arguments.number(value, word) for word, value in words.items() if value is not None}
    if not limits:
        raise ValueError("give a limit in metres, such as up=0.3")
    for word, opposite in (("left", "right"), ("front", "back"), ("up", "down")):
        if word in limits and opposite in limits and limits[word] < -limits[opposite]:
            raise ValueError(
                f"{word}={limits[word]:g} and {opposite}={limits[opposite]:g} leave no room; "
                f"{opposite}={limits[opposite]:g} means at least {-limits[opposite]:g} m {word}"
            )
    origin = np.zeros(3) if of is None else anchor(rows, of, "of")
    selected = arguments.mask(where, len(rows))
    for word, limit in limits.items():
        axis, sign = _axis(frame.direction(word))
        farthest = origin[axis] + sign * limit
        clip = np.minimum if sign > 0 else np.maximum
        rows[selected, axis] = clip(rows[selected, axis], farthest)
    return rows


def stay_on(traj: ArrayLike, obj: Target, side: str, *, gap: float = 0.05, frame: Frame = RFU) -> Array:
    """Keep to one side of an object: left, right, front, back, above or below.

    Waypoints on the wrong side are shifted onto the limit. So that there is no corner, the path gives way already where
    it comes near: a waypoint e before the limit is shifted by (m - e)^2 / 4m, with m the gap but 2 cm at least. A part
    of the path that does not cross the limit stays as it is, and so do a start and a goal that comply.

    Args:
        traj: (N, 4).
        obj: Object or point (3,) [m].
        side: "left", "right", "front", "back", "up", "down", "above", "below" or "behind".
        gap: [m], >= 0, from the surface of an object with dimensions, else from the centre.
        frame: Which way is left.
    """
    rows = arguments.waypoints(traj)
    centre, space = arguments.point(obj), arguments.number(gap, "gap", low=0.0)
    direction = arguments.direction(frame, SIDES.get(side, side) if isinstance(side, str) else side)
    axis, sign = _axis(direction)
    limit = sign * centre[axis] + extent(obj, direction) + space
    coordinate = sign * rows[:, axis]
    missing = limit - coordinate
    margin = max(space, ROUNDED)
    fraction = arguments.fractions(rows[:, :3])
    ends = smoothstep(np.minimum(fraction, 1.0 - fraction) / END_SHARE)
    soft = np.where(missing < margin, (missing + margin) ** 2 / (4.0 * margin) - np.maximum(missing, 0.0), 0.0)
    wanted = np.maximum(coordinate + np.maximum(missing, 0.0) + soft * ends, limit)
    for a, b in runs(missing > -margin):
        if (missing[a : b + 1] > 0.0).any():
            part = slice(a, b + 1)
            moved = wanted[part] > coordinate[part]
            rows[part, axis] = np.where(moved, sign * wanted[part], rows[part, axis])
    return rows


def quadrant(traj: ArrayLike, which: int = 1, *, frame: Frame = RFU) -> Array:
    """Shift into a quadrant: 1 is front right, then counter-clockwise.

    Of the horizontal plane, by the smallest shift that does; the shape stays.

    Args:
        traj: (N, 4).
        which: 1 (right and front coordinates >= 0), 2 (left, front), 3 (left, back) or 4 (right, back).
        frame: Which way is left.
    """
    rows = arguments.waypoints(traj)
    for word in QUADRANTS[arguments.integer(which, "which", 1, 4)]:
        axis, sign = _axis(frame.direction(word))
        outside = float((sign * rows[:, axis]).min())
        if outside < 0.0:
            rows[:, axis] -= sign * outside
    return rows


def at_height(traj: ArrayLike, height: float, *, where: ArrayLike | None = None, frame: Frame = RFU) -> Array:
    """Set the height above the ground.

    Args:
        traj: (N, 4).
        height: [m], up from the horizontal plane through the origin.
        where: Mask (N,), or None for all waypoints.
        frame: Which way is up.
    """
    rows = arguments.waypoints(traj)
    axis, sign = _axis(frame.direction("up"))
    rows[arguments.mask(where, len(rows)), axis] = sign * arguments.number(height, "height")
    return rows


def _axis(direction: Array) -> tuple[int, float]:
    """The coordinate that a direction word means, and its sign; exact, where a dot product would round."""
    axis = int(np.argmax(np.abs(direction)))
    return axis, float(direction[axis])
