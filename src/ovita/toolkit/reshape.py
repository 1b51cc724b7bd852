"""Rotate, tilt, mirror, scale and bend a path, and keep it to a region."""

from __future__ import annotations

from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.geometry import Mask, fractions, runs
from ovita.paths.scene import RFU, Frame
from ovita.paths.trajectory import Array
from ovita.toolkit import arguments
from ovita.toolkit.approach import extent
from ovita.toolkit.arguments import OffsetLimits, Place, Target, blended, followed, positive, smoothstep
from ovita.toolkit.catalogue import operation
from ovita.toolkit.insertion import anchor
from ovita.toolkit.postconditions import SIDES

FLIPPED = {"x": 1, "y": 0, "z": 2}
"""The coordinate that changes its sign when a path is mirrored around an axis."""

ROUNDED = 0.02
"""Least distance from a limit at which a path begins to give way [m]."""

END_SHARE = 0.1
"""Fraction of the path near each end where it gives way less, so that a start or goal that complies stays."""

QUADRANTS = {1: ("right", "front"), 2: ("left", "front"), 3: ("left", "back"), 4: ("right", "back")}


@operation("Reshape the whole")
def curve(traj: ArrayLike, factor: float) -> Array:
    """Bend more (>1) or less (<1) off the start-goal line.

    Each waypoint's distance from that line is multiplied by the factor; what lies on the line stays there.

    Args:
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


@operation("Reshape the whole")
def rotate(
    traj: ArrayLike,
    degrees: float,
    *,
    about: Place | None = None,
    axis: str = "up",
    where: ArrayLike | None = None,
    ease: float | None = None,
    frame: Frame = RFU,
) -> Array:
    """Turn counter-clockwise about the centroid or a PLACE.

    On a part it blends at the edges, inside the part, over 3 times the largest shift, at most over half of the part.
    Ends turn with the rest.

    Args:
        about: Object or point (3,) [m] that stays where it is, or a waypoint: "start", "goal", its index (int) or
            fraction of the path (float). None for the mean of the selected waypoints.
        axis: Direction word; "up" turns in the horizontal plane.
    """
    rows = arguments.waypoints(traj)
    angle = arguments.number(degrees, "degrees")
    selected = arguments.mask(where, len(rows))
    centre, tip = _pivot(rows, about, selected), arguments.direction(frame, axis)
    if angle % 360.0 != 0.0:
        away = rows[:, :3] - centre
        turn = np.radians(angle % 360.0)
        along = (away @ tip)[:, None] * tip
        turned = centre + along + np.cos(turn) * (away - along) + np.sin(turn) * np.cross(tip, away)
        return blended(rows, turned, selected, arguments.share(ease, "ease"))
    return rows


@operation("Reshape the whole")
def tilt(
    traj: ArrayLike, degrees: float, *, axis: str = "front", about: Place | None = None, frame: Frame = RFU
) -> Array:
    """Turn about a level axis: "front" lifts the left side, "right" the front.

    Args:
        axis: "left", "right", "front" or "back".
        about: What stays where it is, as for rotate; None for the mean of the waypoints.
    """
    if axis in ("up", "down"):
        raise ValueError(f"axis must be 'left', 'right', 'front' or 'back', not {axis!r}; rotate turns around 'up'")
    return rotate(traj, degrees, about=about, axis=axis, frame=frame)


@operation("Reshape the whole")
def mirror(
    traj: ArrayLike,
    axis: str,
    *,
    about: Place | None = None,
    where: ArrayLike | None = None,
    ease: float | None = None,
    frame: Frame = RFU,
) -> Array:
    """Flip: "left" swaps left and right; "x" keeps x and flips y.

    On a part it blends at the edges, inside the part, over 3 times the largest shift, at most over half of the part.
    Ends flip with the rest.

    Args:
        axis: "x": in the vertical plane along the x axis, so that y changes; "y": along the y axis, so that x changes;
            "z": in the level plane, so that z changes. Or a direction word: what lay that way lies the opposite way.
        about: What lies in the mirror plane, as for rotate; None for the mean of the selected waypoints.
    """
    rows = arguments.waypoints(traj)
    selected = arguments.mask(where, len(rows))
    if isinstance(axis, str) and axis in FLIPPED:
        flipped = FLIPPED[axis]
    else:
        flipped = int(np.argmax(np.abs(arguments.direction(frame, axis))))
    centre = _pivot(rows, about, selected)
    image = rows[:, :3].copy()
    image[:, flipped] = 2.0 * centre[flipped] - image[:, flipped]
    return blended(rows, image, selected, arguments.share(ease, "ease"))


@operation("Reshape the whole")
def scale(
    traj: ArrayLike,
    factor: float,
    *,
    about: Place | None = None,
    horizontally: bool = False,
    where: ArrayLike | None = None,
    ease: float | None = None,
    frame: Frame = RFU,
) -> Array:
    """Enlarge or shrink about a PLACE.

    On a part it blends at the edges, inside the part, over 3 times the largest shift, at most over half of the part.
    Ends move with the rest.

    Args:
        factor: > 0; 2 doubles all distances from `about`, and speeds stay.
        about: What stays where it is, as for rotate; None for the mean of the selected waypoints.
        horizontally: Whether heights stay.
    """
    rows = arguments.waypoints(traj)
    times = positive(factor, "factor")
    selected = arguments.mask(where, len(rows))
    centre = frame.levelled(_pivot(rows, about, selected))
    if times == 1.0:
        return rows
    away, up = rows[:, :3] - centre, frame.direction("up")
    kept = (away @ up)[:, None] * up if horizontally else 0.0
    return blended(rows, centre + kept + times * (away - kept), selected, arguments.share(ease, "ease"))


@operation("Keep to a region")
def bound(
    traj: ArrayLike,
    *,
    of: Place | None = None,
    where: ArrayLike | None = None,
    ease: float | None = None,
    frame: Frame = RFU,
    **offset: Unpack[OffsetLimits],
) -> Array:
    """Stay within so many metres left, up, ... of the origin or of=cup; down=-0.1: at least 0.1 up.

    A limit is a coordinate along its word, so right=-0.1 with of=cup means at least 0.1 m left of the cup's centre.
    Waypoints beyond a limit are moved onto it, start and goal too; the others stay as they are. On a part, those
    beside it follow, over 3 times the shift at its edge.

    Args:
        offset: The farthest allowed along a direction word [m], such as up=0.3.
        of: What the metres count from: object or point (3,) [m], or the place of a waypoint; None for the origin.
    """
    rows = arguments.waypoints(traj)
    limits = {word: arguments.number(value, word) for word, value in offset.items() if value is not None}
    if not limits:
        raise ValueError("give a limit in metres, such as up=0.3")
    for word, opposite in (("left", "right"), ("front", "back"), ("up", "down")):
        if word in limits and opposite in limits and limits[word] < -limits[opposite]:
            raise ValueError(
                f"{word}={limits[word]:g} and {opposite}={limits[opposite]:g} leave no room; "
                f"{opposite}={limits[opposite]:g} means at least {-limits[opposite]:g} m {word}"
            )
    origin = np.zeros(3) if of is None else anchor(rows, of, "of")
    selected, moved = arguments.mask(where, len(rows)), rows[:, :3].copy()
    for word, limit in limits.items():
        axis, sign = _axis(frame.direction(word))
        farthest = origin[axis] + sign * limit
        clip = np.minimum if sign > 0 else np.maximum
        moved[:, axis] = clip(moved[:, axis], farthest)
    return followed(rows, moved, selected, arguments.share(ease, "ease"))


@operation("Keep to a region")
def stay_on(
    traj: ArrayLike,
    obj: Target,
    side: str,
    *,
    gap: float = 0.05,
    where: ArrayLike | None = None,
    ease: float | None = None,
    frame: Frame = RFU,
) -> Array:
    """Keep to one side of an object: left, right, front, back, above or below.

    Waypoints on the wrong side are shifted onto the limit. So that there is no corner, the path gives way already where
    it comes near: a waypoint e before the limit is shifted by (m - e)^2 / 4m, with m the gap but 2 cm at least. A part
    of the path that does not cross the limit stays as it is, and so do a start and a goal that comply.
    On a part, those beside it follow, over 3 times the shift at its edge.

    Args:
        side: "left", "right", "front", "back", "up", "down", "above", "below" or "behind".
        gap: [m], >= 0, from the surface of an object with dimensions, else from the centre.
    """
    rows = arguments.waypoints(traj)
    selected, result = arguments.mask(where, len(rows)), rows[:, :3].copy()
    centre, space = arguments.point(obj), arguments.number(gap, "gap", low=0.0)
    direction = arguments.direction(frame, SIDES.get(side, side) if isinstance(side, str) else side)
    axis, sign = _axis(direction)
    limit = sign * centre[axis] + extent(obj, direction) + space
    coordinate = sign * rows[:, axis]
    missing = limit - coordinate
    margin = max(space, ROUNDED)
    fraction = fractions(rows[:, :3])
    ends = smoothstep(np.minimum(fraction, 1.0 - fraction) / END_SHARE)
    soft = np.where(missing < margin, (missing + margin) ** 2 / (4.0 * margin) - np.maximum(missing, 0.0), 0.0)
    wanted = np.maximum(coordinate + np.maximum(missing, 0.0) + soft * ends, limit)
    for a, b in runs(missing > -margin):
        if (missing[a : b + 1] > 0.0).any():
            part = slice(a, b + 1)
            moved = wanted[part] > coordinate[part]
            result[part, axis] = np.where(moved, sign * wanted[part], rows[part, axis])
    return followed(rows, result, selected, arguments.share(ease, "ease"))


@operation("Keep to a region")
def quadrant(traj: ArrayLike, which: int = 1, *, frame: Frame = RFU) -> Array:
    """Shift into a quadrant: 1 is front right, then counter-clockwise.

    Of the horizontal plane, by the smallest shift that does; the shape stays.

    Args:
        which: 1 (right and front coordinates >= 0), 2 (left, front), 3 (left, back) or 4 (right, back).
    """
    rows = arguments.waypoints(traj)
    for word in QUADRANTS[arguments.integer(which, "which", 1, 4)]:
        axis, sign = _axis(frame.direction(word))
        outside = float((sign * rows[:, axis]).min())
        if outside < 0.0:
            rows[:, axis] -= sign * outside
    return rows


@operation("Keep to a region")
def at_height(
    traj: ArrayLike,
    height: float | None = None,
    *,
    at_least: float | None = None,
    at_most: float | None = None,
    where: ArrayLike | None = None,
    ease: float | None = None,
    frame: Frame = RFU,
) -> Array:
    """Set the height above the ground, or keep it at_least or at_most so many metres.

    On a part, the waypoints beside it follow, over 3 times the shift at its edge; start and goal only if in it.

    Args:
        height: [m], up from the horizontal plane through the origin.
        at_least: Waypoints below are lifted to it [m].
        at_most: Waypoints above are lowered to it [m].
    """
    rows = arguments.waypoints(traj)
    low, high = arguments.bounds(height, at_least, at_most, "height", "m")
    axis, sign = _axis(frame.direction("up"))
    level = rows[:, :3].copy()
    level[:, axis] = sign * np.clip(sign * level[:, axis], low, high)
    return followed(rows, level, arguments.mask(where, len(rows)), arguments.share(ease, "ease"))


def _pivot(rows: Array, about: Place | None, selected: Mask) -> Array:
    if about is not None:
        return anchor(rows, about, "about")
    return np.asarray(rows[selected, :3].mean(axis=0)) if selected.any() else np.zeros(3)


def _axis(direction: Array) -> tuple[int, float]:
    """The coordinate that a direction word means, and its sign; exact, where a dot product would round."""
    axis = int(np.argmax(np.abs(direction)))
    return axis, float(direction[axis])
