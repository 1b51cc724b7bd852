"""Bring a path closer to an object or take it farther away, pass through it, jump over it, wait above it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.frame import RFU, Frame
from ovita.paths.geometry import Mask, fractions, runs
from ovita.paths.scene import SceneObject
from ovita.paths.trajectory import Array, arc_length
from ovita.toolkit import arguments
from ovita.toolkit.arguments import Offset, Target
from ovita.toolkit.around import clear_segments, pushed_out, pushed_out_of_all
from ovita.toolkit.catalogue import Recorder, note_contact, operation
from ovita.toolkit.insertion import densified
from ovita.toolkit.speed import dwell, stop_at
from ovita.toolkit.weights import ROUNDING, headings, perpendicular, smoothstep

STEEPEST = 1.125
"""Reach per metre of push above which no waypoint overtakes the nearest: the maximum of smoothstep(x) / x."""

PER_SLOPE = 4.0
"""The fewest segments on the rise or the fall of a jump."""

HOVER_BRAKE = 0.05
"""Share of the path's length over which the robot brakes to wait above an object, and speeds up again."""

SHORTEST = 0.01
"""Share of the path's length below which no segment is divided for a jump."""


@operation("Objects: come closer, stay away, pass", core=True)
def closer(
    traj: ArrayLike,
    obj: Target,
    by: float,
    *,
    reach: float | None = None,
    where: ArrayLike | None = None,
    hold: str | Sequence[str] | None = None,
    frame: Frame = RFU,
) -> Array:
    """Pull the nearest part of the path toward an object by so many metres.

    The pull is `by` at the nearest waypoint and fades to 0 where the distance is `reach` larger; it ends at
    the bounding sphere of an object with dimensions.

    Args:
        traj: (N, 4).
        obj: Object or point (3,) [m].
        by: [m], >= 0.
        reach: [m], > 0; by default half of the spread of the waypoints' distances.
        where: Mask (N,), or None for all waypoints.
        hold: Direction word or words along which nothing moves, such as "up" after an exact shift upwards.
    """
    rows = arguments.waypoints(traj)
    centre, pull = arguments.point(obj), arguments.number(by, "by", low=0.0)
    away, distance = _polar(rows, centre)
    weights = _nearness(distance, arguments.mask(where, len(rows)), reach)
    aim = np.maximum(distance - pull * weights, np.minimum(distance, radius_of(obj)))
    touched = aim < distance
    ratio = np.divide(aim, distance, out=np.ones_like(aim), where=touched)[:, None]
    shift = _held((centre + away * ratio)[touched] - rows[touched, :3], hold, frame)
    rows[touched, :3] += shift
    return rows


@operation("Objects: come closer, stay away, pass", core=True)
def farther(
    traj: ArrayLike,
    obj: Target,
    by: float | None = None,
    *,
    times: float | None = None,
    reach: float | None = None,
    where: ArrayLike | None = None,
    hold: str | Sequence[str] | None = None,
    frame: Frame = RFU,
) -> Array:
    """Push the nearest part away from an object by metres, or times=2: double all distances.

    Args:
        traj: (N, 4).
        obj: Object or point (3,) [m].
        by: [m], >= 0, at the nearest waypoint; it fades to 0 where the distance is `reach` larger.
        times: Factor >= 1 on the distance of every selected waypoint; exactly one of by and times is given.
        reach: [m], > 0; by default half of the spread of the waypoints' distances, but no less than 1.125 `by`, so
            that no waypoint ends up nearer than `by` beyond the nearest.
        where: Mask (N,), or None for all waypoints.
        hold: Direction word or words along which nothing moves, such as "up" after an exact shift upwards.
    """
    rows = arguments.waypoints(traj)
    centre, selected = arguments.point(obj), arguments.mask(where, len(rows))
    if (by is None) == (times is None):
        raise ValueError("give exactly one of by (metres) and times (a factor)")
    away, distance = _polar(rows, centre)
    if times is not None:
        factor = arguments.number(times, "times", low=1.0)
        if factor > 1.0:
            rows[selected, :3] += _held((factor - 1.0) * away[selected], hold, frame)
        return rows
    amount = arguments.number(by, "by", low=0.0)
    push = amount * _nearness(distance, selected, reach, STEEPEST * amount)
    outward = np.divide(away, distance[:, None], out=np.zeros_like(away), where=distance[:, None] > 1e-9)
    outward = np.where(distance[:, None] > 1e-9, outward, perpendicular(headings(rows[:, :3])))
    touched = push > 0.0
    rows[touched, :3] += _held((push[:, None] * outward)[touched], hold, frame)
    return rows


@operation("Objects: come closer, stay away, pass", core=True)
def keep_distance(
    traj: ArrayLike,
    obj: Target | Sequence[Target],
    at_least: float | None = None,
    at_most: float | None = None,
    *,
    where: ArrayLike | None = None,
) -> Array:
    """Bend the path around an object or a list of them: metres at_least from the surface, at_most from the centre.

    A waypoint q from the centre inside the sphere of radius R is pushed along the lateral direction n of the
    closest approach by t = -(q.n) + sqrt((q.n)^2 - |q|^2 + R^2), which puts it on the sphere; on a path that turns
    inside the sphere, radially or along an arc. Where waypoints are so sparse that a segment crosses the sphere with
    both ends outside, these ends move in parallel until it is clear. With several objects, whose spheres may overlap,
    each stretch inside them is pushed aside until it is outside all.

    Args:
        traj: (N, 4).
        obj: Object or point (3,) [m], or a list of them.
        at_least: [m], >= 0, from the bounding sphere of an object with dimensions, else from the centre.
        at_most: [m], >= 0, from the centre.
        where: Mask (N,), or None for all waypoints; waypoints that already comply stay as they are.
    """
    rows = arguments.waypoints(traj)
    targets = _targets(obj)
    centres = np.array([arguments.point(target) for target in targets])
    selected = arguments.mask(where, len(rows))
    if at_least is None and at_most is None:
        raise ValueError("give at_least or at_most in metres")
    gap = None if at_least is None else arguments.number(at_least, "at_least", low=0.0)
    radii = np.array([0.0 if gap is None else gap + radius_of(target) for target in targets])
    if at_most is not None:
        outer = arguments.number(at_most, "at_most", low=0.0)
        if outer < radii.max():
            raise ValueError(f"at_most {outer:g} m from the centre contradicts at_least, which needs {radii.max():g} m")
        for centre in centres:
            away, distance = _polar(rows, centre)
            beyond = selected & (distance > outer)
            rows[beyond, :3] = centre + away[beyond] * (outer / distance[beyond])[:, None]
    if len(targets) > 1:
        rows[:, :3] = pushed_out_of_all(rows[:, :3], centres, radii, selected)
    elif radii[0] > 0.0:
        _bend_around(rows, centres[0], float(radii[0]), selected)
    return rows


@operation("Objects: come closer, stay away, pass")
def go_through(
    traj: ArrayLike,
    at: Target,
    *,
    width: float = 0.3,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
    **offset: Unpack[Offset],
) -> Array:
    """Bend the path through an object or point plus OFFSET; start and goal stay.

    Args:
        traj: (N, 4).
        at: Object or point (3,) [m].
        offset: Direction words and metres of it, such as left=0.2.
        width: Fraction (0..1) of the path's length on either side that is bent.
    """
    rows = arguments.waypoints(traj)
    shift = arguments.offset(frame, offset)
    target = arguments.point(at, "at") + shift
    window = arguments.number(width, "width", low=0.0, high=1.0)
    note_contact(recorder, at, shift)
    fraction = fractions(rows[:, :3])
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


@operation("Objects: come closer, stay away, pass")
def hop(traj: ArrayLike, obj: Target, height: float, *, width: float = 0.2, frame: Frame = RFU) -> Array:
    """Jump over an object, so many metres above its top.

    The start and the goal stay. The waypoint nearest to the object comes to lie above it; the path rises smoothly, is
    level over the bounding sphere, and falls. What is higher already is not lowered.

    Args:
        traj: (N, 4); where the waypoints are too sparse for the jump, more are inserted.
        obj: Object or point (3,) [m]; without dimensions its top is its centre.
        height: [m], >= 0.
        width: Length of the rise and of the fall as a fraction (0..1) of the path's length.
    """
    rows = arguments.waypoints(traj)
    centre, lift = arguments.point(obj), arguments.number(height, "height", low=0.0)
    share = arguments.number(width, "width", low=0.0, high=1.0)
    up = frame.direction("up")
    top = float(centre @ up) + extent(obj, up) + lift
    length = float(arc_length(rows[:, :3])[-1])
    level = obj.radius / length if isinstance(obj, SceneObject) and length > 0.0 else 0.0
    if length > 0.0:
        step = float(np.clip((share + level) / PER_SLOPE, SHORTEST, 0.25)) * length
        rows, _ = densified(rows, _window(rows, centre, share + level), step)
    fraction = fractions(rows[:, :3])
    inner = np.flatnonzero((fraction > 0.0) & (fraction < 1.0))
    if not len(inner):
        raise ValueError("no waypoint lies between start and goal; call resample(traj, 20) before hop")
    i = int(inner[np.argmin(np.linalg.norm(rows[inner, :3] - centre, axis=1))])
    weights = _jump(fraction, i, share, level)
    sideways = centre - rows[i, :3]
    sideways -= (sideways @ up) * up
    missing = np.maximum(top - rows[:, :3] @ up, 0.0)
    touched = weights > 0.0
    rows[touched, :3] += (weights[:, None] * (sideways + missing[:, None] * up))[touched]
    return rows


@operation("Objects: come closer, stay away, pass")
def hover(
    traj: ArrayLike,
    obj: Target,
    height: float,
    *,
    steps: int = 10,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
) -> Array:
    """Bend the path over an object and wait there, so many metres above its centre.

    The path bends to pass exactly there, and the robot brakes and speeds up again over 5 % of the path; start and goal
    stay. With a height above its centre smaller than the path's, the path goes down there.

    Args:
        traj: (N, 4); the result is (N + steps, 4).
        obj: Object or point (3,) [m].
        height: [m]; negative: below.
        steps: Timesteps of 0.1 s to wait, >= 1.
    """
    above = arguments.number(height, "height")
    rows = go_through(traj, obj, up=above, frame=frame, recorder=recorder)
    place = arguments.point(obj) + above * frame.direction("up")
    return dwell(stop_at(rows, place, brake=HOVER_BRAKE, resume=True), place, steps)


def _bend_around(rows: Array, centre: Array, radius: float, selected: Mask) -> None:
    """Push what is inside one sphere out of it, in place."""
    away, distance = _polar(rows, centre)
    for a, b in runs(distance < radius):
        part, pushed = slice(a, b + 1), selected[a : b + 1]
        rows[part, :3][pushed] = (centre + pushed_out(away, a, b, radius))[pushed]
    clear_segments(rows, centre, radius, selected)


def _held(shift: Array, hold: str | Sequence[str] | None, frame: Frame) -> Array:
    """Displacements (M, 3) without their parts along the held direction words."""
    for word in [hold] if isinstance(hold, str) else (hold or ()):
        axis = arguments.direction(frame, word)
        shift = shift - (shift @ axis)[:, None] * axis
    return shift


def _targets(obj: Any) -> list[Any]:
    """The targets of a list, or the one target; a list of three numbers is a point."""
    listed = isinstance(obj, list | tuple) and any(not isinstance(item, int | float) for item in obj)
    return list(obj) if listed else [obj]


def radius_of(obj: Any) -> float:
    """Radius of an object's bounding sphere [m]; 0 for a point and for an object without dimensions."""
    return obj.radius if isinstance(obj, SceneObject) and obj.dimensions is not None else 0.0


def _polar(rows: Array, centre: Array) -> tuple[Array, Array]:
    away = rows[:, :3] - centre
    return away, np.asarray(np.linalg.norm(away, axis=1))


def _nearness(distance: Array, selected: Mask, reach: float | None, shortest: float = 0.0) -> Array:
    weights = np.zeros(len(distance))
    if reach is not None and arguments.number(reach, "reach", low=0.0) == 0.0:
        raise ValueError("reach must be > 0")
    if not selected.any():
        return weights
    inside = distance[selected]
    span = max(float(np.ptp(inside)) / 2.0, shortest, 1e-9) if reach is None else float(reach)
    weights[selected] = smoothstep(1.0 - (inside - inside.min()) / span)
    return weights


def extent(obj: Target, direction: Array) -> float:
    """How far an object reaches beyond its centre along a unit vector (3,) [m]; 0 if it has no dimensions."""
    if not isinstance(obj, SceneObject) or obj.dimensions is None:
        return 0.0
    return float(np.abs(direction @ obj.rotation) @ obj.dimensions) / 2.0


def _window(rows: Array, centre: Array, share: float) -> Mask:
    """Mask of the waypoints within a share of the path's length of the one nearest to a point, and one more each."""
    fraction = fractions(rows[:, :3])
    i = int(np.argmin(np.linalg.norm(rows[:, :3] - centre, axis=1)))
    inside = np.flatnonzero(np.abs(fraction - fraction[i]) <= share)
    index = np.arange(len(rows))
    return np.asarray((index >= inside[0] - 1) & (index <= inside[-1] + 1))


def _jump(fraction: Array, i: int, share: float, level: float) -> Array:
    """Weights (N,) of a jump: 1 within `level` of waypoint i, 0 beyond `share` more and at both ends of the path."""
    gap = fraction - fraction[i]
    reach = np.minimum(share + level, np.where(gap < 0.0, fraction[i], 1.0 - fraction[i]))
    flat = np.minimum(level, reach / 2.0)
    slope = reach - flat
    weights = smoothstep(np.divide(reach - np.abs(gap), slope, out=np.zeros_like(gap), where=slope > ROUNDING))
    weights[gap == 0.0] = 1.0
    weights[(fraction == 0.0) | (fraction == 1.0)] = 0.0
    return weights
