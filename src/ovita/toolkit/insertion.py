"""New waypoints: their spacing along a curve, their speeds, and their insertion."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ovita.paths.geometry import Mask, fractions
from ovita.paths.trajectory import Array, arc_length, interpolate
from ovita.toolkit import arguments
from ovita.toolkit.arguments import ROUNDING, Place, headings, snapped

SOFT = 0.3
"""Share of a new stretch over which its speed rises from, and falls to, the speeds at its ends."""

BESIDE = 0.1
"""Share of the path's length before and behind a place over which its speed is taken."""


def anchor(rows: Array, at: Place, name: str) -> Array:
    """The point (3,) [m] that a place is: an object's centre or a point itself, else a waypoint's position.

    Raises:
        ValueError: If it is no place.
    """
    if isinstance(at, (str, bool, int, float, np.generic)):
        return np.array(rows[arguments.locate(rows, at, name), :3])
    return arguments.point(at, name)


def distinct(rows: Array) -> Mask:
    """Mask (N,) of the waypoints that are no repeat of the one before; a dwell is one waypoint and its repeats."""
    return np.concatenate([[True], (np.diff(rows[:, :3], axis=0) != 0).any(axis=1)])


def course_headings(rows: Array) -> Array:
    """Unit vectors (N, 3) of the local path direction, the same for all repeats of a waypoint."""
    fresh = distinct(rows)
    return np.asarray(headings(rows[fresh, :3])[np.cumsum(fresh) - 1])


def level_heading(rows: Array, i: int, up: Array, ahead: Array) -> Array:
    """Horizontal unit vector (3,) of the path's direction at waypoint i, or `ahead` where it has none.

    Args:
        rows: (N, 3+) [m].
        i: Index.
        up: Unit vector (3,).
        ahead: Horizontal unit vector (3,).
    """
    heading = course_headings(rows)[i]
    level = heading - (heading @ up) * up
    length = float(np.linalg.norm(level))
    return np.asarray(level / length) if length > 1e-6 else ahead


def evenly(curve: Callable[[Array], Array], step: float, least: int) -> Array:
    """Points (M, 3) on a curve, the end included and the beginning not; none if it has no length.

    Args:
        curve: From parameters (K,) in 0..1 to points (K, 3) [m].
        step: At most so far apart [m]; 0 for no such limit.
        least: At most 1 / least apart in the parameter.
    """
    u = np.linspace(0.0, 1.0, max(16 * least, 256) + 1)
    lengths = np.linalg.norm(np.diff(curve(u), axis=0), axis=1)
    if not lengths.any():
        return np.zeros((0, 3))
    needed = np.maximum(lengths / step if step > 0.0 else 0.0, least * np.diff(u))
    so_far = np.concatenate([[0.0], np.cumsum(needed)])
    # What rounding adds to a whole number of steps needs no further waypoint.
    count = min(int(np.ceil(so_far[-1] - 1e-6)), arguments.MOST_WAYPOINTS)
    even = np.interp(np.linspace(0.0, so_far[-1], count + 1)[1:], so_far, u)
    even[-1] = 1.0
    return curve(even)


def leg(begin: Array, end: Array, step: float) -> Array:
    """Points (M, 3) on a straight line, its end included and its beginning not; none if it has no length.

    Args:
        begin: (3,) [m].
        end: (3,) [m].
        step: At most so far apart [m].
    """
    points = evenly(lambda u: begin + u[:, None] * (end - begin), step, 1)
    points[-1:] = end
    return points


def dubins(begin: Array, ends: Array, radius: float) -> Iterator[tuple[int, Array]]:
    """The curves from one pose to others that are an arc, a line and an arc, the shortest first (Dubins 1957).

    Args:
        begin: x, y [m] and heading [rad], (3,).
        ends: The same, (K, 3).
        radius: Of the arcs [m], > 0.

    Yields:
        Which of the ends is reached, and the curve's three parts: signed curvatures [1/m] and lengths [m], (3, 2).
    """
    dx, dy = ((ends[:, :2] - begin[:2]) / radius).T
    d, course = np.hypot(dx, dy), np.arctan2(dy, dx)
    sizes, senses = [], ((1.0, 1.0), (-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0))
    # The first arc turns left (1) or right (-1), and so does the last; of a turn to the right, the mirror image counts.
    for first, final in senses:
        u, v = first * (begin[2] - course), first * (ends[:, 2] - course)
        if first == final:
            squared = 2.0 + d**2 - 2.0 * np.cos(u - v) + 2.0 * d * (np.sin(u) - np.sin(v))
            middle = np.sqrt(np.maximum(squared, 0.0))
            bearing = np.arctan2(np.cos(v) - np.cos(u), d + np.sin(u) - np.sin(v))
            turns = [bearing - u, v - bearing]
        else:
            squared = d**2 - 2.0 + 2.0 * np.cos(u - v) + 2.0 * d * (np.sin(u) + np.sin(v))
            middle = np.sqrt(np.maximum(squared, 0.0))
            bearing = np.arctan2(-np.cos(u) - np.cos(v), d + np.sin(u) + np.sin(v)) + np.arctan2(2.0, middle)
            turns = [bearing - u, bearing - v]
        # What rounding makes of a turn by nothing is no whole turn.
        begun, ended = (np.maximum((turn + ROUNDING) % (2.0 * np.pi) - ROUNDING, 0.0) for turn in turns)
        sizes.append(np.where(squared >= -ROUNDING, [begun, middle, ended], np.inf))
    total = np.sum(sizes, axis=1)
    for flat in np.argsort(total, axis=None):
        kind, k = divmod(int(flat), len(ends))
        if np.isfinite(total[kind, k]):
            first, final = senses[kind]
            yield k, np.column_stack([[first / radius, 0.0, final / radius], sizes[kind][:, k] * radius])


def along_arcs(begin: Array, parts: Array, step: float, most: float) -> Array:
    """Points (M, 2) on a curve of arcs and lines, its end included and its beginning not.

    Args:
        begin: x, y [m] and heading [rad], (3,).
        parts: Signed curvatures [1/m] and lengths [m], (K, 2).
        step: At most so far apart [m]; 0 for no such limit.
        most: The most that the curve turns from one to the next [rad].
    """
    points, (x, y, heading) = [np.zeros((0, 2))], begin
    for curvature, length in parts:
        if length <= ROUNDING:
            continue
        wanted = max(length / step if step > 0.0 else 1.0, abs(curvature) * length / most)
        pieces = min(max(int(np.ceil(wanted - 1e-6)), 1), arguments.MOST_WAYPOINTS)
        s = np.linspace(0.0, length, pieces + 1)[1:]
        if curvature == 0.0:
            part = np.column_stack([x + s * np.cos(heading), y + s * np.sin(heading)])
        else:
            angle = heading + curvature * s
            part = np.column_stack([np.sin(angle) - np.sin(heading), np.cos(heading) - np.cos(angle)]) / curvature
            part += (x, y)
        points.append(part)
        (x, y), heading = part[-1], heading + curvature * length
    return np.concatenate(points)


def usual_speed(rows: Array) -> float:
    """Median speed of the waypoints that are not at rest [m/s]; 0 if all are."""
    moving = rows[rows[:, 3] > 0.0, 3]
    return float(np.median(moving)) if len(moving) else 0.0


def cruise_speed(rows: Array, i: int) -> float:
    """The speed at which a stretch put in at waypoint i is passed [m/s]: the highest within 10 % of the path around it.

    So a figure is as fast as the path that it leaves and joins, without the path's braking for a stop. Near the start
    and the goal it is the path's usual speed, and nowhere less than a quarter of it.
    """
    fraction = fractions(rows[:, :3])
    beside = float(rows[np.abs(fraction - fraction[i]) <= BESIDE, 3].max())
    at_end = min(fraction[i], 1.0 - fraction[i]) <= BESIDE
    return max(beside, usual_speed(rows) * (1.0 if at_end else 0.25))


def speeds_between(begin: float, cruise: float, end: float, count: int) -> Array:
    """Speeds (count,) of new waypoints after one at speed `begin`; the last of them has speed `end` [m/s].

    Rise and fall have a constant acceleration each, so they take their time even from rest, but no longer.
    """
    u = np.arange(1, count + 1) / count
    rise = begin**2 + (cruise**2 - begin**2) * snapped(u / SOFT)
    fall = end**2 + (cruise**2 - end**2) * snapped((1.0 - u) / SOFT)
    speeds = np.sqrt(np.where(u < 0.5, rise, fall))
    speeds[-1] = end
    return np.asarray(speeds)


def inserted(rows: Array, i: int, points: Array) -> Array:
    """Rows with waypoints at points (M, 3) [m] after waypoint i, whose extra columns they repeat.

    They are passed at the speed of the path around waypoint i, blended with the speeds there and of the next;
    where the path slows down there for an end or stops, it does so before and after the new waypoints too.
    """
    if not len(points):
        return rows
    last = len(rows) - 1
    new = np.repeat(rows[i : i + 1], len(points), axis=0)
    new[:, :3] = points
    following = float(rows[min(i + 1, last), 3])
    if following == 0.0 and i < last:  # it comes to rest there, and not at the new waypoints before it
        following = float(rows[i, 3])
    new[:, 3] = speeds_between(float(rows[i, 3]), cruise_speed(rows, i), following, len(points))
    return np.concatenate([rows[: i + 1], new, rows[i + 1 :]])


def densified(rows: Array, selected: Mask, step: float) -> tuple[Array, Mask]:
    """Rows and mask with waypoints put into the selected segments that are longer than `step`.

    Args:
        rows: (N, 4+k); the old waypoints stay as they are, the new ones are interpolated.
        selected: Mask (N,); a segment is selected if both its ends are.
        step: [m], > 0.
    """
    lengths = np.diff(arc_length(rows[:, :3]))
    # A segment that rounding made longer than the step needs no waypoint.
    needed = np.where(selected[:-1] & selected[1:], np.maximum(np.ceil(lengths / step - 1e-6), 1.0), 1.0)
    if (needed - 1.0).sum() > arguments.MOST_WAYPOINTS:
        raise ValueError(f"this would need more than {arguments.MOST_WAYPOINTS} new waypoints; ask for less")
    pieces = needed.astype(int)
    part = np.arange(pieces.sum()) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    source = np.append(np.repeat(np.arange(len(pieces)), pieces) + part / np.repeat(pieces, pieces), len(rows) - 1.0)
    low, high = np.floor(source).astype(int), np.ceil(source).astype(int)
    return interpolate(rows, source), selected[low] & selected[high]
