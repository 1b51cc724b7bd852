"""Take another route along the same waypoints: straight, shortened, thinned out or backwards."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.scene import RFU, Frame, SceneObject
from ovita.paths.trajectory import Array
from ovita.toolkit import arguments
from ovita.toolkit.arguments import Place
from ovita.toolkit.courses import anchor, distinct, leg, speeds_between, usual_speed
from ovita.toolkit.recorder import Recorder, note_contact
from ovita.toolkit.shaping import runs, spacing


def straighten(traj: ArrayLike, a: Place = "start", b: Place = "goal") -> Array:
    """Go straight from PLACE a to b.

    The waypoints between keep their number and their speeds and lie evenly on the line; a dwell stays one.

    Args:
        traj: (N, 4).
        a: The place of a waypoint; an object or point (3,) [m] means the waypoint nearest to it.
        b: The other end, in any order; not the same waypoint.
    """
    rows = arguments.waypoints(traj)
    low, high = sorted((arguments.locate(rows, a, "a"), arguments.locate(rows, b, "b")))
    if low == high:
        raise ValueError(f"a and b are both waypoint {low}, so there is nothing to straighten; give two places")
    part = rows[low : high + 1, :3]
    order = np.cumsum(distinct(part)) - 1
    if order[-1] > 0:
        begin, end = part[0].copy(), part[-1].copy()
        inner = (order > 0) & (order < order[-1])
        part[inner] = begin + (order[inner] / order[-1])[:, None] * (end - begin)
    return rows


def shortcut(
    traj: ArrayLike,
    a: Place,
    b: Place,
    *,
    left: float = 0.0,
    right: float = 0.0,
    front: float = 0.0,
    back: float = 0.0,
    up: float = 0.0,
    down: float = 0.0,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
) -> Array:
    """Follow to PLACE a, then end straight at b plus OFFSET.

    Args:
        traj: (N, 4); what came after a is dropped, new waypoints are no farther apart than the mean spacing.
        a: The place of a waypoint; an object or point (3,) [m] means the waypoint nearest to it.
        b: Object or point (3,) [m] itself, or the place of a waypoint.
        left: Metres to the left of b; the other words likewise.
        right: [m].
        front: [m].
        back: [m].
        up: [m].
        down: [m].
        frame: Which way is left.
        recorder: Notes that the object b is to be touched.
    """
    rows = arguments.waypoints(traj)
    words = {"left": left, "right": right, "front": front, "back": back, "up": up, "down": down}
    shift = arguments.offset(frame, words)
    i = arguments.locate(rows, a, "a")
    target = anchor(rows, b, "b") + shift
    note_contact(recorder, b if isinstance(b, SceneObject) else None, shift)
    points = leg(rows[i, :3], target, spacing(rows[:, :3]))
    head, goal_speed = rows[: i + 1].copy(), float(rows[-1, 3])
    if not len(points):
        if i == 0:
            raise ValueError("a and b are both at the start, so no path is left; give two places")
        head[-1, 3] = goal_speed
        return head
    tail = np.repeat(head[-1:], len(points), axis=0)
    tail[:, :3] = points
    tail[:, 3] = speeds_between(float(head[-1, 3]), usual_speed(rows), goal_speed, len(points))
    return np.concatenate([head, tail])


def average(traj: ArrayLike, k: int) -> Array:
    """Merge each k waypoints into one.

    That one is their mean, speed and extra columns included.

    Args:
        traj: (N, 4); the result is (ceil(N / k), 4), its last waypoint the mean of what is left over.
        k: Waypoints a group, from 1 to N - 1.
    """
    rows = arguments.waypoints(traj)
    size = arguments.integer(k, "k", 1, len(rows) - 1)
    starts = np.arange(0, len(rows), size)
    counts = np.diff(np.append(starts, len(rows)))
    return np.asarray(np.add.reduceat(rows, starts, axis=0) / counts[:, None])


def reverse(traj: ArrayLike, *, where: ArrayLike | None = None) -> Array:
    """Reverse the waypoints' order.

    Speeds and extra columns go along.

    Args:
        traj: (N, 4).
        where: Mask (N,), or None for all waypoints; each unbroken run of it is reversed for itself.
    """
    rows = arguments.waypoints(traj)
    for a, b in runs(arguments.mask(where, len(rows))):
        rows[a : b + 1] = rows[a : b + 1][::-1].copy()
    return rows
