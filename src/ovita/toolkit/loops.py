"""Put a spiral, a circle around an object or a figure eight into a path."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.scene import RFU, Frame, SceneObject
from ovita.paths.trajectory import Array
from ovita.toolkit import arguments
from ovita.toolkit.arguments import Place, Target
from ovita.toolkit.courses import evenly, inserted, leg, level_heading, positive
from ovita.toolkit.shaping import spacing

PER_TURN = 24
"""The fewest waypoints on one turn of a loop."""

CLEARANCE = 0.05
"""How far a circle of no given radius stays from an object's bounding sphere [m]."""

MOST_TURNS = 100.0
"""The most turns that one call may ask for."""


def spiral(
    traj: ArrayLike,
    at: Place = "goal",
    *,
    radius: float,
    turns: float = 3.0,
    height: float = 0.0,
    clockwise: bool = False,
    frame: Frame = RFU,
) -> Array:
    """Spiral out at a PLACE, rising by height; the path goes on.

    The spiral is Archimedean and level: after the share u of the turns it is u radius away from the waypoint and
    u height above it. It begins with the path's heading. From its end the rest of the path, if there is one, is
    reached in a straight line; at the goal the spiral's end is the new goal.

    Args:
        traj: (N, 4); the result has the new waypoints inserted, no farther apart than the mean spacing
            and 24 a turn at least.
        at: The place of a waypoint; an object or point (3,) [m] means the waypoint nearest to it.
        radius: Distance of the spiral's end from that waypoint [m], > 0.
        turns: > 0, whole or not.
        height: How far the spiral rises [m]; negative: sinks.
        clockwise: Turn clockwise as seen from above.
        frame: Which way is up.
    """
    rows = arguments.waypoints(traj)
    i = arguments.locate(rows, at)
    size, count = positive(radius, "radius"), positive(turns, "turns", MOST_TURNS)
    rise = arguments.number(height, "height")
    up = frame.direction("up")
    ahead = level_heading(rows, i, up, frame.direction("front"))
    side = _sense(_flag(clockwise)) * np.cross(up, ahead)
    centre = rows[i, :3].copy()

    def curve(u: Array) -> Array:
        angle = 2.0 * np.pi * count * u[:, None]
        return np.asarray(centre + u[:, None] * (size * (np.cos(angle) * ahead + np.sin(angle) * side) + rise * up))

    step = spacing(rows[:, :3])
    points = evenly(curve, step, int(np.ceil(PER_TURN * count)))
    if i + 1 < len(rows):
        points = np.concatenate([points, leg(points[-1], rows[i + 1, :3], step)[:-1]])
    return inserted(rows, i, points)


def circle(
    traj: ArrayLike,
    obj: Target,
    *,
    radius: float | None = None,
    turns: float = 1.0,
    clockwise: bool | None = None,
    frame: Frame = RFU,
) -> Array:
    """Go around an object from the nearest waypoint and back.

    The circle is level and at that waypoint's height. Where the waypoint is not on it, a straight line leads there and
    back; after turns that are not whole, the path goes on from where the circle ends.

    Args:
        traj: (N, 4); the result has the new waypoints inserted, no farther apart than the mean spacing
            and 24 a turn at least.
        obj: Object or point (3,) [m].
        radius: [m], > 0; None for the waypoint's horizontal distance, but 5 cm beyond the object's bounding sphere
            at least.
        turns: > 0.
        clockwise: As seen from above; None for the sense that goes with the path's heading.
        frame: Which way is up.
    """
    rows = arguments.waypoints(traj)
    centre = arguments.point(obj)
    count = positive(turns, "turns", MOST_TURNS)
    i = arguments.locate(rows, centre, "obj")
    up = frame.direction("up")
    ahead = level_heading(rows, i, up, frame.direction("front"))
    away = rows[i, :3] - centre
    centre += (away @ up) * up
    away -= (away @ up) * up
    distance = float(np.linalg.norm(away))
    outward = away / distance if distance > 1e-9 else np.cross(ahead, up)
    ring = positive(radius, "radius") if radius is not None else max(distance, _size(obj) + CLEARANCE)
    tangent = np.cross(up, outward)
    sense = _sense(_flag(clockwise) if clockwise is not None else bool(tangent @ ahead < 0.0))

    def curve(u: Array) -> Array:
        angle = 2.0 * np.pi * count * sense * u[:, None]
        return np.asarray(centre + ring * (np.cos(angle) * outward + np.sin(angle) * tangent))

    step = spacing(rows[:, :3])
    on_ring = abs(ring - distance) <= 1e-9
    entry = rows[i, :3] if on_ring else centre + ring * outward
    arc = evenly(curve, step, int(np.ceil(PER_TURN * count)))
    if count.is_integer():
        arc[-1] = entry
    there = leg(rows[i, :3], entry, step)
    back = leg(entry, rows[i, :3], step) if count.is_integer() else np.zeros((0, 3))
    return inserted(rows, i, np.concatenate([there, arc, back]))


def figure_eight(traj: ArrayLike, at: Place, *, size: float, frame: Frame = RFU) -> Array:
    """Drive an 8, size metres long, at a PLACE.

    The curve is Gerono's lemniscate, level and half as wide as long, crossing itself at the waypoint; it leaves and
    comes back with the path's heading.

    Args:
        traj: (N, 4); the result has the new waypoints inserted, no farther apart than the mean spacing
            and 48 at least.
        at: The place of a waypoint; an object or point (3,) [m] means the waypoint nearest to it.
        size: From tip to tip [m], > 0.
        frame: Which way is up.
    """
    rows = arguments.waypoints(traj)
    i = arguments.locate(rows, at)
    half = positive(size, "size") / 2.0
    up = frame.direction("up")
    ahead = level_heading(rows, i, up, frame.direction("front"))
    side = np.cross(up, ahead)
    along, across = (ahead - side) / np.sqrt(2.0), (ahead + side) / np.sqrt(2.0)
    centre = rows[i, :3].copy()

    def curve(u: Array) -> Array:
        angle = 2.0 * np.pi * u[:, None]
        return np.asarray(centre + half * np.sin(angle) * (along + np.cos(angle) * across))

    points = evenly(curve, spacing(rows[:, :3]), 2 * PER_TURN)
    points[-1] = centre
    return inserted(rows, i, points)


def _size(obj: Target) -> float:
    return obj.radius if isinstance(obj, SceneObject) else 0.0


def _sense(clockwise: bool) -> float:
    return -1.0 if clockwise else 1.0


def _flag(clockwise: object) -> bool:
    if not isinstance(clockwise, (bool, np.bool_)):
        raise ValueError(f"clockwise must be True or False, not {clockwise!r}")
    return bool(clockwise)
