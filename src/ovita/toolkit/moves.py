"""Shift a path or an end of it, go on beyond the goal, and take the straight way."""

from __future__ import annotations

from typing import Literal, Unpack

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.geometry import fractions, spacing, turning_angles
from ovita.paths.scene import RFU, Frame, SceneObject
from ovita.paths.trajectory import Array, arc_length, interpolate, source_indices
from ovita.toolkit import arguments
from ovita.toolkit.arguments import (
    GENTLE,
    ROUNDING,
    Aim,
    Offset,
    Place,
    Target,
    eased,
    final_heading,
    perpendicular,
    smoothstep,
)
from ovita.toolkit.catalogue import Recorder, note_contact, operation
from ovita.toolkit.insertion import along_arcs, anchor, distinct, dubins, leg, speeds_between, usual_speed
from ovita.toolkit.speed import stop_at

SMOOTH = np.radians(15.0)
"""How far a curve that goes on beyond the goal turns from one waypoint to the next, half of it being straight."""

DEFAULT_EASE = 0.25
"""Fraction of the path over which a shift sets in when an end is kept."""


@operation("Shift the path and its ends", core=True)
def move(
    traj: ArrayLike,
    *,
    where: ArrayLike | None = None,
    ease: float | None = None,
    keep: Literal["start", "goal", "both"] | None = None,
    frame: Frame = RFU,
    **offset: Unpack[Offset],
) -> Array:
    """Shift by OFFSET; keep="start", "goal" or "both" holds ends.

    On a part, the shift sets in at its edges over 3 times its length, at most over half of the part, and is reached in
    full there; the others stay as they are. Ends in the part move, unless they are kept.

    Args:
        ease: Length of the soft edge inside the part as a fraction (0..1) of the path's length; 0 for a jump.
        keep: End that stays where it is; the shift sets in over `ease`, or if that is not given over 3 times its
            length, at most over a quarter of the path.
    """
    rows = arguments.waypoints(traj)
    shift = arguments.offset(frame, offset)
    selected = arguments.mask(where, len(rows))
    rise = arguments.share(ease, "ease")
    if keep not in (None, "start", "goal", "both"):
        raise ValueError(f"keep must be None, 'start', 'goal' or 'both', not {keep!r}")
    weights = eased(selected, rows[:, :3], rise, float(np.linalg.norm(shift)))
    if keep is not None:
        usual = GENTLE * float(np.linalg.norm(shift)) / max(float(arc_length(rows[:, :3])[-1]), 1e-12)
        rise = min(rise or min(usual or DEFAULT_EASE, DEFAULT_EASE), 0.5 if keep == "both" else 1.0)
        fraction = fractions(rows[:, :3])
        for end, away in (("start", fraction), ("goal", 1.0 - fraction)):
            if keep in (end, "both"):
                weights *= smoothstep(away / rise)
    touched = weights > 0.0
    rows[touched, :3] += weights[touched, None] * shift
    return rows


@operation("Shift the path and its ends")
def move_start(
    traj: ArrayLike,
    to: Target | None = None,
    *,
    aim: Aim = "centre",
    blend: float = 0.5,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
    **offset: Unpack[Offset],
) -> Array:
    """Move the start to an object or point plus OFFSET, or just by OFFSET; the path follows.

    OFFSET stands for the six direction words; the other end stays exactly where it is.
    """
    rows = arguments.waypoints(traj)
    _move_first(rows, to, aim, arguments.offset(frame, offset), blend, frame, recorder)
    return rows


@operation("Shift the path and its ends")
def move_goal(
    traj: ArrayLike,
    to: Target | None = None,
    *,
    aim: Aim = "centre",
    blend: float = 0.5,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
    **offset: Unpack[Offset],
) -> Array:
    """Move the goal to an object or point plus OFFSET, or just by OFFSET; the path follows.

    OFFSET stands for the six direction words; the other end stays exactly where it is.
    """
    rows = arguments.waypoints(traj)
    _move_first(rows[::-1], to, aim, arguments.offset(frame, offset), blend, frame, recorder)
    return rows


@operation("Shift the path and its ends")
def midpoint(a: Target, b: Target, *, frame: Frame = RFU) -> Array:
    """Point halfway between two objects or points; for a robot on the ground, at its height.

    Args:
        a: Object or point (3,) [m].
        b: Object or point (3,) [m].
    """
    return frame.levelled((arguments.point(a, "a") + arguments.point(b, "b")) / 2.0)


@operation("Go on, or go straight")
def extend(
    traj: ArrayLike,
    by: float | None = None,
    *,
    frame: Frame = RFU,
    **offset: Unpack[Offset],
) -> Array:
    """Go on beyond the goal by metres in the final heading, or by OFFSET.

    The speed rises from the goal's to the median speed and comes back to the goal's at the end.

    Args:
        traj: (N, 4); the result is (N + M, 4) with new waypoints at the mean spacing.
        by: [m]; < 0 goes back along the path, as a vehicle that reverses; None if an offset is given.
    """
    rows = arguments.waypoints(traj)
    shift = arguments.offset(frame, offset)
    if (by is None) == (not shift.any()):
        raise ValueError("give either by (metres along the final heading) or an offset such as left=0.2")
    if by is not None and arguments.number(by, "by") < 0.0:
        return _backed_up(rows, -by)
    if by is not None:
        shift = arguments.number(by, "by") * final_heading(rows[:, :3])
    return _appended(rows, rows[-1, :3] + np.array([[0.0], [1.0]]) * shift)


@operation("Go on, or go straight")
def shorten(traj: ArrayLike, by: float) -> Array:
    """Cut the last so many metres off, between waypoints if need be.

    Toward the new end the speed falls as it did toward the old one, so that a robot that came to rest still does.

    Args:
        traj: (N, 4); the result is (M, 4) with M <= N.
        by: [m], > 0 and less than the path's length.
    """
    rows = arguments.waypoints(traj)
    s, cut = arc_length(rows[:, :3]), arguments.positive(by, "by")
    end = float(s[-1]) - cut
    if end <= ROUNDING:
        raise ValueError(f"by {cut:g} m is not less than the path's length, {s[-1]:.3g} m")
    whole = int(np.searchsorted(s, end - ROUNDING, side="left"))
    at = whole - 1 + (end - s[whole - 1]) / (s[whole] - s[whole - 1])
    left = np.concatenate([rows[:whole], interpolate(rows, np.array([at]))])
    k = len(rows) - 1
    while k > 0 and rows[k - 1, 3] > rows[k, 3]:
        k -= 1
    if k == len(rows) - 1:
        return left
    braking = cut + arc_length(left[:, :3])
    late = braking > s[k]
    left[late, 3] = np.minimum(left[late, 3], np.interp(braking[late], s[k:], rows[k:, 3]))
    return left


@operation("Go on, or go straight")
def continue_to(
    traj: ArrayLike,
    to: Target,
    *,
    aim: Aim = "centre",
    smooth: bool = True,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
    **offset: Unpack[Offset],
) -> Array:
    """Go on from the goal to an object or point plus OFFSET.

    The curve is the cubic Hermite spline that begins with the final heading and ends with the direction of its chord;
    where that turns by more than 60 degrees, an arc with a quarter of the chord as radius and a straight line.

    Args:
        traj: (N, 4); the result is (N + M, 4) with new waypoints at the mean spacing.
        to: Object or point (3,) [m].
        offset: Direction words and metres of it, such as left=0.2.
        smooth: Keep the heading at the old goal.
    """
    rows = arguments.waypoints(traj)
    shift = arguments.offset(frame, offset)
    goal, target = rows[-1, :3], arguments.aimed(to, aim, frame, rows[-1:, :3], shift, "to")
    note_contact(recorder, to, shift)
    chord = target - goal
    if not smooth or spacing(rows[:, :3]) == 0.0 or not chord.any():
        return _appended(rows, np.stack([goal, target]))
    heading, length = final_heading(rows[:, :3]), float(np.linalg.norm(chord))
    if heading @ chord < 0.5 * length:
        return _appended(rows, np.concatenate([goal[None], goal + _turned(heading, chord)]))
    u = np.linspace(0.0, 1.0, 257)[:, None]
    leave = heading * length
    curve = goal + (u**3 - 2 * u**2 + u) * leave + (3 * u**2 - 2 * u**3) * chord + (u**3 - u**2) * chord
    curve[-1] = target
    return _appended(rows, curve)


@operation("Go on, or go straight")
def shortcut(
    traj: ArrayLike,
    a: Place,
    b: Place,
    *,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
    **offset: Unpack[Offset],
) -> Array:
    """Follow to PLACE a, then end straight at b plus OFFSET.

    Args:
        traj: (N, 4); what came after a is dropped, new waypoints are no farther apart than the mean spacing.
        a: The place of a waypoint; an object or point (3,) [m] means the waypoint nearest to it.
        b: Object or point (3,) [m] itself, or the place of a waypoint.
        offset: Direction words and metres of b, such as left=0.2.
    """
    rows = arguments.waypoints(traj)
    shift = arguments.offset(frame, offset)
    i = arguments.locate(rows, a, "a")
    target = (frame.levelled(anchor(rows, b, "b")) if isinstance(b, SceneObject) else anchor(rows, b, "b")) + shift
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


@operation("Go on, or go straight")
def straighten(traj: ArrayLike, a: Place = "start", b: Place = "goal") -> Array:
    """Go straight from PLACE a to b.

    The waypoints between keep their number and their speeds and lie evenly on the line; a dwell stays one.

    Args:
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


def _turned(heading: Array, chord: Array) -> Array:
    """Points (M, 3) on an arc that begins with a heading, and on the line from there to the end of a chord."""
    along = float(chord @ heading)
    aside = chord - along * heading
    away = float(np.linalg.norm(aside))
    # Straight back, any side will do: a level one.
    side = aside / away if away > 1e-9 else perpendicular(heading[None])[0]
    angles = np.linspace(-np.pi, np.pi, 120, endpoint=False)
    ends = np.column_stack([np.full(120, along), np.full(120, away), angles])
    begin = np.zeros(3)
    _, parts = next(dubins(begin, ends, float(np.linalg.norm(chord)) / 4.0))
    return np.asarray(along_arcs(begin, parts, 0.0, np.pi / 90.0) @ np.stack([heading, side]))


def _move_first(
    rows: Array, to: Target | None, aim: Aim, shift: Array, blend: float, frame: Frame, recorder: Recorder | None
) -> None:
    """Move the first row of a view to a target; the shift fades out along the path, before its end."""
    note_contact(recorder, to, shift)
    target = rows[0, :3] + shift if to is None else arguments.aimed(to, aim, frame, rows[:1, :3], shift, "to")
    share = arguments.number(blend, "blend", low=0.0, high=1.0)
    fraction = fractions(rows[:, :3])
    if share == 0.0:
        rows[0, :3] = target
        return
    weights = smoothstep(1.0 - fraction / share)
    weights[-1] = 0.0
    touched = (weights > 0.0) & (fraction > 0.0)
    rows[touched, :3] += weights[touched, None] * (target - rows[0, :3])
    rows[fraction == 0.0, :3] = target


def _backed_up(rows: Array, by: float) -> Array:
    """Rows that stop at the goal and then go back along the path for some metres."""
    rows = stop_at(rows, "goal")
    ahead = arc_length(rows[:, :3])
    back = max(float(ahead[-1]) - by, 0.0)
    end = np.array([[np.interp(back, ahead, rows[:, k]) for k in range(3)]])
    return _appended(rows, np.concatenate([rows[ahead > back, :3][::-1], end]))


def _appended(rows: Array, curve: Array) -> Array:
    """Rows followed by waypoints at the rows' mean spacing along a curve (M, 3) that starts at the last row."""
    length = float(arc_length(curve)[-1])
    if length == 0.0:
        return rows
    step = spacing(rows[:, :3]) or length / 10.0
    # A polyline has its corners; what is finer is a curve, and stays one.
    turned = float(turning_angles(curve).sum()) if len(curve) > 10 else 0.0
    count = min(max(round(length / step), 2, round(2.0 * turned / SMOOTH)), arguments.MOST_WAYPOINTS)
    source = source_indices(curve, count + 1, "arc_length")
    tail = np.repeat(rows[-1:], count, axis=0)
    tail[:, :3] = interpolate(curve, source)[1:]
    tail[:, 3] = speeds_between(float(rows[-1, 3]), usual_speed(rows), float(rows[-1, 3]), count)
    return np.concatenate([rows, tail])
