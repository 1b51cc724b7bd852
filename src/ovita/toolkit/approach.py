"""Bring a path closer to an object, take it farther away, or keep it at a distance."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ovita.scene import SceneObject
from ovita.toolkit import arguments
from ovita.toolkit.arguments import Mask, Target
from ovita.toolkit.shaping import headings, perpendicular, runs, smoothstep
from ovita.trajectory import Array

SHALLOW = 0.05
"""How deep a segment between two waypoints outside a sphere may dip into it, as a fraction of its radius."""


def closer(
    traj: ArrayLike, obj: Target, by: float, *, reach: float | None = None, where: ArrayLike | None = None
) -> Array:
    """Pull the part of the path nearest to an object toward it by up to `by` metres.

    The pull is `by` at the nearest waypoint and fades to 0 where the distance is `reach` larger; it ends at
    the bounding sphere of an object with dimensions.

    Args:
        traj: (N, 4).
        obj: Object or point (3,) [m].
        by: [m], >= 0.
        reach: [m], > 0; by default half of the spread of the waypoints' distances.
        where: Mask (N,), or None for all waypoints.
    """
    rows = arguments.waypoints(traj)
    centre, pull = arguments.point(obj), arguments.number(by, "by", low=0.0)
    away, distance = _polar(rows, centre)
    weights = _nearness(distance, arguments.mask(where, len(rows)), reach)
    aim = np.maximum(distance - pull * weights, np.minimum(distance, radius_of(obj)))
    touched = aim < distance
    ratio = np.divide(aim, distance, out=np.ones_like(aim), where=touched)[:, None]
    rows[touched, :3] = (centre + away * ratio)[touched]
    return rows


def farther(
    traj: ArrayLike,
    obj: Target,
    by: float | None = None,
    *,
    times: float | None = None,
    reach: float | None = None,
    where: ArrayLike | None = None,
) -> Array:
    """Push the part nearest to an object away by up to `by` metres, or times=2: double all distances.

    Args:
        traj: (N, 4).
        obj: Object or point (3,) [m].
        by: [m], >= 0, at the nearest waypoint; it fades to 0 where the distance is `reach` larger.
        times: Factor >= 1 on the distance of every selected waypoint; exactly one of by and times is given.
        reach: [m], > 0; by default half of the spread of the waypoints' distances.
        where: Mask (N,), or None for all waypoints.
    """
    rows = arguments.waypoints(traj)
    centre, selected = arguments.point(obj), arguments.mask(where, len(rows))
    if (by is None) == (times is None):
        raise ValueError("give exactly one of by (metres) and times (a factor)")
    away, distance = _polar(rows, centre)
    if times is not None:
        factor = arguments.number(times, "times", low=1.0)
        if factor > 1.0:
            rows[selected, :3] = (centre + factor * away)[selected]
        return rows
    push = arguments.number(by, "by", low=0.0) * _nearness(distance, selected, reach)
    outward = np.divide(away, distance[:, None], out=np.zeros_like(away), where=distance[:, None] > 1e-9)
    outward = np.where(distance[:, None] > 1e-9, outward, perpendicular(headings(rows[:, :3])))
    touched = push > 0.0
    rows[touched, :3] += (push[:, None] * outward)[touched]
    return rows


def keep_distance(
    traj: ArrayLike,
    obj: Target,
    at_least: float | None = None,
    at_most: float | None = None,
    *,
    where: ArrayLike | None = None,
) -> Array:
    """Bend the path around an object: metres at_least from its surface, at_most from its centre.

    A waypoint q from the centre inside the sphere of radius R is pushed along the lateral direction n of the
    closest approach by t = -(q.n) + sqrt((q.n)^2 - |q|^2 + R^2), which puts it on the sphere. Where waypoints are so
    sparse that a segment crosses the sphere with both ends outside, these ends move in parallel until it is clear.

    Args:
        traj: (N, 4).
        obj: Object or point (3,) [m].
        at_least: [m], >= 0, from the bounding sphere of an object with dimensions, else from the centre.
        at_most: [m], >= 0, from the centre.
        where: Mask (N,), or None for all waypoints; waypoints that already comply stay as they are.
    """
    rows = arguments.waypoints(traj)
    centre, selected = arguments.point(obj), arguments.mask(where, len(rows))
    if at_least is None and at_most is None:
        raise ValueError("give at_least or at_most in metres")
    inner = 0.0 if at_least is None else arguments.number(at_least, "at_least", low=0.0) + radius_of(obj)
    if at_most is not None:
        outer = arguments.number(at_most, "at_most", low=0.0)
        if outer < inner:
            raise ValueError(f"at_most {outer:g} m from the centre contradicts at_least, which needs {inner:g} m")
        away, distance = _polar(rows, centre)
        beyond = selected & (distance > outer)
        rows[beyond, :3] = centre + away[beyond] * (outer / distance[beyond])[:, None]
    if inner > 0.0:
        away, distance = _polar(rows, centre)
        for a, b in runs(distance < inner):
            part = slice(a, b + 1)
            q = away[part]
            lateral = _lateral(away, a, b)
            along = q @ lateral
            t = -along + np.sqrt(np.maximum(along**2 - (q**2).sum(axis=1) + inner**2, 0.0))
            pushed = selected[part]
            rows[part, :3][pushed] = (centre + q + t[:, None] * lateral)[pushed]
        _clear_segments(rows, centre, inner, selected)
    return rows


def radius_of(obj: Any) -> float:
    """Radius of an object's bounding sphere [m]; 0 for a point and for an object without dimensions."""
    return obj.radius if isinstance(obj, SceneObject) and obj.dimensions is not None else 0.0


def _polar(rows: Array, centre: Array) -> tuple[Array, Array]:
    away = rows[:, :3] - centre
    return away, np.asarray(np.linalg.norm(away, axis=1))


def _nearness(distance: Array, selected: Mask, reach: float | None) -> Array:
    weights = np.zeros(len(distance))
    if reach is not None and arguments.number(reach, "reach", low=0.0) == 0.0:
        raise ValueError("reach must be > 0")
    if not selected.any():
        return weights
    inside = distance[selected]
    span = max(float(np.ptp(inside)) / 2.0, 1e-9) if reach is None else float(reach)
    weights[selected] = smoothstep(1.0 - (inside - inside.min()) / span)
    return weights


def _clear_segments(rows: Array, centre: Array, radius: float, selected: Mask) -> None:
    """Move segments that cross a sphere far from both of their ends sideways, out of it."""
    away = rows[:, :3] - centre
    outside = (away**2).sum(axis=1) > (radius * (1.0 + 1e-9)) ** 2
    both = outside[:-1] & outside[1:] & selected[:-1] & selected[1:]
    for i in np.flatnonzero(both):
        a, step = rows[i, :3] - centre, rows[i + 1, :3] - rows[i, :3]
        share = float(np.clip(-(a @ step) / max(float(step @ step), 1e-300), 0.0, 1.0))
        depth = radius - float(np.linalg.norm(a + share * step))
        if depth > SHALLOW * radius:
            rows[i : i + 2, :3] += depth * _lateral(rows[:, :3] - centre, i, i + 1, margin=0)


def _lateral(away: Array, a: int, b: int, margin: int = 1) -> Array:
    """Unit vector (3,) from the centre to the closest approach of waypoints a..b, perpendicular to the path there."""
    low, high = max(a - margin, 0), min(b + margin, len(away) - 1)
    start, step = away[low:high], np.diff(away[low : high + 1], axis=0)
    squared = (step**2).sum(axis=1)
    share = np.divide(-(start * step).sum(axis=1), squared, out=np.zeros_like(squared), where=squared > 0)
    closest = start + np.clip(share, 0.0, 1.0)[:, None] * step
    i = int(np.argmin((closest**2).sum(axis=1)))
    heading = step[i] / max(float(np.sqrt(squared[i])), 1e-12)
    side = closest[i] - (closest[i] @ heading) * heading
    length = float(np.linalg.norm(side))
    if length > 1e-9:
        return np.asarray(side / length)
    return np.asarray(perpendicular(heading[None])[0])
