"""Move the start or the goal, go on beyond the goal, or pass through a point."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.scene import RFU, Frame
from ovita.paths.trajectory import Array, arc_length, interpolate, source_indices
from ovita.toolkit import arguments
from ovita.toolkit.arguments import Target
from ovita.toolkit.recorder import Recorder, note_contact
from ovita.toolkit.shaping import final_heading, smoothstep, spacing


def move_start(
    traj: ArrayLike,
    to: Target | None = None,
    *,
    left: float = 0.0,
    right: float = 0.0,
    front: float = 0.0,
    back: float = 0.0,
    up: float = 0.0,
    down: float = 0.0,
    blend: float = 0.5,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
) -> Array:
    """Move the start to an object or point plus OFFSET, or just by OFFSET; the path follows.

    OFFSET stands for the six direction words; the other end stays exactly where it is.

    Args:
        traj: (N, 4).
        to: Object or point (3,) [m], or None to move by the offset alone.
        left: Metres to the left; the other words likewise.
        right: [m].
        front: [m].
        back: [m].
        up: [m].
        down: [m].
        blend: Fraction (0..1) of the path's length over which the shift fades out; 0 moves one waypoint.
        frame: Which way is left.
        recorder: Notes that the object is to be touched.
    """
    rows = arguments.waypoints(traj)
    words = {"left": left, "right": right, "front": front, "back": back, "up": up, "down": down}
    shift = arguments.offset(frame, words)
    note_contact(recorder, to, shift)
    _move_first(rows, (rows[0, :3] if to is None else arguments.point(to, "to")) + shift, blend)
    return rows


def move_goal(
    traj: ArrayLike,
    to: Target | None = None,
    *,
    left: float = 0.0,
    right: float = 0.0,
    front: float = 0.0,
    back: float = 0.0,
    up: float = 0.0,
    down: float = 0.0,
    blend: float = 0.5,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
) -> Array:
    """Move the goal to an object or point plus OFFSET, or just by OFFSET; the path follows.

    OFFSET stands for the six direction words; the other end stays exactly where it is.

    Args:
        traj: (N, 4).
        to: Object or point (3,) [m], or None to move by the offset alone.
        left: Metres to the left; the other words likewise.
        right: [m].
        front: [m].
        back: [m].
        up: [m].
        down: [m].
        blend: Fraction (0..1) of the path's length over which the shift fades in; 0 moves one waypoint.
        frame: Which way is left.
        recorder: Notes that the object is to be touched.
    """
    rows = arguments.waypoints(traj)
    words = {"left": left, "right": right, "front": front, "back": back, "up": up, "down": down}
    shift = arguments.offset(frame, words)
    note_contact(recorder, to, shift)
    _move_first(rows[::-1], (rows[-1, :3] if to is None else arguments.point(to, "to")) + shift, blend)
    return rows


def extend(
    traj: ArrayLike,
    by: float | None = None,
    *,
    left: float = 0.0,
    right: float = 0.0,
    front: float = 0.0,
    back: float = 0.0,
    up: float = 0.0,
    down: float = 0.0,
    frame: Frame = RFU,
) -> Array:
    """Go on beyond the goal by metres in the final heading, or by OFFSET.

    The speed rises from the goal's to the median speed and comes back to the goal's at the end.

    Args:
        traj: (N, 4); the result is (N + M, 4) with new waypoints at the mean spacing.
        by: [m], >= 0; None if an offset is given.
        left: Metres to the left; the other words likewise.
        right: [m].
        front: [m].
        back: [m].
        up: [m].
        down: [m].
        frame: Which way is left.
    """
    rows = arguments.waypoints(traj)
    words = {"left": left, "right": right, "front": front, "back": back, "up": up, "down": down}
    shift = arguments.offset(frame, words)
    if (by is None) == (not shift.any()):
        raise ValueError("give either by (metres along the final heading) or an offset such as left=0.2")
    if by is not None:
        shift = arguments.number(by, "by", low=0.0) * final_heading(rows[:, :3])
    return _appended(rows, rows[-1, :3] + np.array([[0.0], [1.0]]) * shift)


def continue_to(
    traj: ArrayLike,
    to: Target,
    *,
    left: float = 0.0,
    right: float = 0.0,
    front: float = 0.0,
    back: float = 0.0,
    up: float = 0.0,
    down: float = 0.0,
    smooth: bool = True,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
) -> Array:
    """Go on from the goal to an object or point plus OFFSET.

    The curve is the cubic Hermite spline that begins with the final heading and ends with the direction of
    its chord.

    Args:
        traj: (N, 4); the result is (N + M, 4) with new waypoints at the mean spacing.
        to: Object or point (3,) [m].
        left: Metres to the left of it; the other words likewise.
        right: [m].
        front: [m].
        back: [m].
        up: [m].
        down: [m].
        smooth: Keep the heading at the old goal.
        frame: Which way is left.
        recorder: Notes that the object is to be touched.
    """
    rows = arguments.waypoints(traj)
    words = {"left": left, "right": right, "front": front, "back": back, "up": up, "down": down}
    shift = arguments.offset(frame, words)
    goal, target = rows[-1, :3], arguments.point(to, "to") + shift
    note_contact(recorder, to, shift)
    chord = target - goal
    if not smooth or spacing(rows[:, :3]) == 0.0 or not chord.any():
        return _appended(rows, np.stack([goal, target]))
    u = np.linspace(0.0, 1.0, 257)[:, None]
    leave = final_heading(rows[:, :3]) * np.linalg.norm(chord)
    curve = goal + (u**3 - 2 * u**2 + u) * leave + (3 * u**2 - 2 * u**3) * chord + (u**3 - u**2) * chord
    curve[-1] = target
    return _appended(rows, curve)


def go_through(
    traj: ArrayLike,
    at: Target,
    *,
    left: float = 0.0,
    right: float = 0.0,
    front: float = 0.0,
    back: float = 0.0,
    up: float = 0.0,
    down: float = 0.0,
    width: float = 0.3,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
) -> Array:
    """Bend the path through an object or point plus OFFSET; start and goal stay.

    Args:
        traj: (N, 4).
        at: Object or point (3,) [m].
        left: Metres to the left of it; the other words likewise.
        right: [m].
        front: [m].
        back: [m].
        up: [m].
        down: [m].
        width: Fraction (0..1) of the path's length on either side that is bent.
        frame: Which way is left.
        recorder: Notes that the object is to be touched.
    """
    rows = arguments.waypoints(traj)
    words = {"left": left, "right": right, "front": front, "back": back, "up": up, "down": down}
    shift = arguments.offset(frame, words)
    target = arguments.point(at, "at") + shift
    window = arguments.number(width, "width", low=0.0, high=1.0)
    note_contact(recorder, at, shift)
    fraction = arguments.fractions(rows[:, :3])
    inner = np.flatnonzero((fraction > 0.0) & (fraction < 1.0))
    if not len(inner):
        raise ValueError("no waypoint lies between start and goal; call resample(traj, 20) before go_through")
    i = int(inner[np.argmin(np.linalg.norm(rows[inner, :3] - target, axis=1))])
    gap = fraction - fraction[i]
    reach = np.where(gap < 0, min(window, float(fraction[i])), min(window, float(1.0 - fraction[i])))
    weights = smoothstep(1.0 - np.divide(np.abs(gap), reach, out=np.ones_like(gap), where=reach > 0))
    weights[gap == 0.0] = 1.0
    weights[(fraction == 0.0) | (fraction == 1.0)] = 0.0
    touched = weights > 0.0
    rows[touched, :3] += weights[touched, None] * (target - rows[i, :3])
    rows[gap == 0.0, :3] = target
    return rows


def _move_first(rows: Array, target: Array, blend: float) -> None:
    """Move the first row of a view onto a target; the shift fades out along the path and never reaches its end."""
    share = arguments.number(blend, "blend", low=0.0, high=1.0)
    fraction = arguments.fractions(rows[:, :3])
    if share == 0.0:
        rows[0, :3] = target
        return
    weights = smoothstep(1.0 - fraction / share)
    weights[-1] = 0.0
    touched = (weights > 0.0) & (fraction > 0.0)
    rows[touched, :3] += weights[touched, None] * (target - rows[0, :3])
    rows[fraction == 0.0, :3] = target


def _appended(rows: Array, curve: Array) -> Array:
    """Rows followed by waypoints at the rows' mean spacing along a curve (M, 3) that starts at the last row."""
    length = float(arc_length(curve)[-1])
    if length == 0.0:
        return rows
    step = spacing(rows[:, :3]) or length / 10.0
    count = min(max(round(length / step), 2), arguments.MOST_WAYPOINTS)
    source = source_indices(curve, count + 1, "arc_length")
    tail = np.repeat(rows[-1:], count, axis=0)
    tail[:, :3] = interpolate(curve, source)[1:]
    speeds, end = rows[:, 3], rows[-1, 3]
    usual = float(np.median(speeds[speeds > 0])) if (speeds > 0).any() else 0.0
    u = np.arange(1, count + 1) / count
    tail[:, 3] = end + (usual - end) * smoothstep(np.minimum(u, 1.0 - u) / 0.3)
    tail[-1, 3] = end
    return np.concatenate([rows, tail])
