"""Jump over an object, or wait above it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.scene import RFU, Frame, SceneObject
from ovita.paths.trajectory import Array, arc_length
from ovita.toolkit import arguments
from ovita.toolkit.arguments import Mask, Target
from ovita.toolkit.courses import densified
from ovita.toolkit.ends import go_through
from ovita.toolkit.recorder import Recorder
from ovita.toolkit.shaping import ROUNDING, smoothstep
from ovita.toolkit.speed import dwell

PER_SLOPE = 4.0
"""The fewest segments on the rise or the fall of a jump."""

SHORTEST = 0.01
"""Share of the path's length below which no segment is divided for a jump."""


def hop(traj: ArrayLike, obj: Target, height: float, *, width: float = 0.2, frame: Frame = RFU) -> Array:
    """Jump over an object, so many metres above its top.

    The start and the goal stay. The waypoint nearest to the object comes to lie above it; the path rises smoothly, is
    level over the bounding sphere, and falls. What is higher already is not lowered.

    Args:
        traj: (N, 4); where the waypoints are too sparse for the jump, more are inserted.
        obj: Object or point (3,) [m]; without dimensions its top is its centre.
        height: [m], >= 0.
        width: Length of the rise and of the fall as a fraction (0..1) of the path's length.
        frame: Which way is up.
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
    fraction = arguments.fractions(rows[:, :3])
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

    The path bends to pass exactly there; start and goal stay.

    Args:
        traj: (N, 4); the result is (N + steps, 4).
        obj: Object or point (3,) [m].
        height: [m]; negative: below.
        steps: Timesteps of 0.1 s to wait, >= 1.
        frame: Which way is up.
        recorder: Notes that the object is to be touched, if the height is 0.
    """
    above = arguments.number(height, "height")
    rows = go_through(traj, obj, up=above, frame=frame, recorder=recorder)
    return dwell(rows, arguments.point(obj) + above * frame.direction("up"), steps)


def extent(obj: Target, direction: Array) -> float:
    """How far an object reaches beyond its centre along a unit vector (3,) [m]; 0 if it has no dimensions."""
    if not isinstance(obj, SceneObject) or obj.dimensions is None:
        return 0.0
    return float(np.abs(direction @ obj.rotation) @ obj.dimensions) / 2.0


def _window(rows: Array, centre: Array, share: float) -> Mask:
    """Mask of the waypoints within a share of the path's length of the one nearest to a point, and one more each."""
    fraction = arguments.fractions(rows[:, :3])
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
