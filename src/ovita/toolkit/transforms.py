"""Rotate, tilt, mirror and scale a path, and bend it more or less."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.scene import RFU, Frame
from ovita.paths.trajectory import Array
from ovita.toolkit import arguments
from ovita.toolkit.arguments import Mask, Place
from ovita.toolkit.courses import anchor, positive

FLIPPED = {"x": 1, "y": 0, "z": 2}
"""The coordinate that changes its sign when a path is mirrored around an axis."""


def rotate(
    traj: ArrayLike,
    degrees: float,
    *,
    about: Place | None = None,
    axis: str = "up",
    where: ArrayLike | None = None,
    frame: Frame = RFU,
) -> Array:
    """Turn counter-clockwise about the centroid or a PLACE.

    Args:
        traj: (N, 4).
        degrees: Counter-clockwise as seen from the tip of the axis; negative: clockwise.
        about: Object or point (3,) [m] that stays where it is, or a waypoint: "start", "goal", its index (int) or
            fraction of the path (float). None for the mean of the selected waypoints.
        axis: Direction word; "up" turns in the horizontal plane.
        where: Mask (N,), or None for all waypoints.
        frame: Which way is up.
    """
    rows = arguments.waypoints(traj)
    angle = arguments.number(degrees, "degrees")
    selected = arguments.mask(where, len(rows))
    centre, tip = _pivot(rows, about, selected), arguments.direction(frame, axis)
    if angle % 360.0 != 0.0:
        away = rows[selected, :3] - centre
        turn = np.radians(angle % 360.0)
        along = (away @ tip)[:, None] * tip
        rows[selected, :3] = centre + along + np.cos(turn) * (away - along) + np.sin(turn) * np.cross(tip, away)
    return rows


def tilt(
    traj: ArrayLike, degrees: float, *, axis: str = "front", about: Place | None = None, frame: Frame = RFU
) -> Array:
    """Turn about a level axis: "front" lifts the left side, "right" the front.

    Args:
        traj: (N, 4).
        degrees: Counter-clockwise as seen from the tip of the axis; negative: clockwise.
        axis: "left", "right", "front" or "back".
        about: What stays where it is, as for rotate; None for the mean of the waypoints.
        frame: Which way is left.
    """
    if axis in ("up", "down"):
        raise ValueError(f"axis must be 'left', 'right', 'front' or 'back', not {axis!r}; rotate turns around 'up'")
    return rotate(traj, degrees, about=about, axis=axis, frame=frame)


def mirror(
    traj: ArrayLike, axis: str, *, about: Place | None = None, where: ArrayLike | None = None, frame: Frame = RFU
) -> Array:
    """Flip: "left" swaps left and right; "x" keeps x and flips y.

    Args:
        traj: (N, 4).
        axis: "x": in the vertical plane along the x axis, so that y changes; "y": along the y axis, so that x changes;
            "z": in the level plane, so that z changes. Or a direction word: what lay that way lies the opposite way.
        about: What lies in the mirror plane, as for rotate; None for the mean of the selected waypoints.
        where: Mask (N,), or None for all waypoints.
        frame: Which way is left.
    """
    rows = arguments.waypoints(traj)
    selected = arguments.mask(where, len(rows))
    if isinstance(axis, str) and axis in FLIPPED:
        flipped = FLIPPED[axis]
    else:
        flipped = int(np.argmax(np.abs(arguments.direction(frame, axis))))
    centre = _pivot(rows, about, selected)
    rows[selected, flipped] = 2.0 * centre[flipped] - rows[selected, flipped]
    return rows


def scale(traj: ArrayLike, factor: float, *, about: Place | None = None, where: ArrayLike | None = None) -> Array:
    """Enlarge or shrink about a PLACE.

    Args:
        traj: (N, 4).
        factor: > 0; 2 doubles all distances from `about`, and speeds stay.
        about: What stays where it is, as for rotate; None for the mean of the selected waypoints.
        where: Mask (N,), or None for all waypoints.
    """
    rows = arguments.waypoints(traj)
    times = positive(factor, "factor")
    selected = arguments.mask(where, len(rows))
    centre = _pivot(rows, about, selected)
    if times != 1.0:
        rows[selected, :3] = centre + times * (rows[selected, :3] - centre)
    return rows


def curve(traj: ArrayLike, factor: float) -> Array:
    """Bend more (>1) or less (<1) off the start-goal line.

    Each waypoint's distance from that line is multiplied by the factor; what lies on the line stays there.

    Args:
        traj: (N, 4).
        factor: 0 makes the path straight, a negative factor bends it to the other side.
    """
    rows = arguments.waypoints(traj)
    times = arguments.number(factor, "factor")
    if times == 1.0:
        return rows
    start, goal = rows[0, :3].copy(), rows[-1, :3].copy()
    chord = goal - start
    squared = float(chord @ chord)
    away = rows[:, :3] - start
    along = away @ chord / squared if squared > 0.0 else np.zeros(len(rows))
    # Repeats of an end (a dwell there) stay as exactly as the end itself.
    free = (rows[:, :3] != start).any(axis=1) & (rows[:, :3] != goal).any(axis=1)
    rows[free, :3] += (times - 1.0) * (away - along[:, None] * chord)[free]
    return rows


def _pivot(rows: Array, about: Place | None, selected: Mask) -> Array:
    if about is not None:
        return anchor(rows, about, "about")
    return np.asarray(rows[selected, :3].mean(axis=0)) if selected.any() else np.zeros(3)
