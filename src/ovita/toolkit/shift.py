"""Shift a trajectory or a part of it."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.scene import RFU, Frame
from ovita.paths.trajectory import Array
from ovita.toolkit import arguments
from ovita.toolkit.arguments import Target
from ovita.toolkit.shaping import eased, smoothstep

DEFAULT_EASE = 0.25
"""Fraction of the path over which a shift sets in when an end is kept."""


def move(
    traj: ArrayLike,
    *,
    left: float = 0.0,
    right: float = 0.0,
    front: float = 0.0,
    back: float = 0.0,
    up: float = 0.0,
    down: float = 0.0,
    where: ArrayLike | None = None,
    ease: float = 0.0,
    keep: Literal["start", "goal", "both"] | None = None,
    frame: Frame = RFU,
) -> Array:
    """Shift by OFFSET; keep="start", "goal" or "both" holds ends.

    Args:
        traj: (N, 4).
        left: Metres to the left; the other words likewise.
        right: [m].
        front: [m].
        back: [m].
        up: [m].
        down: [m].
        where: Mask (N,), or None for all waypoints; the others stay as they are.
        ease: Length of a soft edge as a fraction (0..1) of the path's length; 0 shifts exactly.
        keep: End that stays where it is; the shift sets in over `ease`, or a quarter of the path if that is 0.
        frame: Which way is left.
    """
    rows = arguments.waypoints(traj)
    words = {"left": left, "right": right, "front": front, "back": back, "up": up, "down": down}
    shift = arguments.offset(frame, words)
    selected = arguments.mask(where, len(rows))
    rise = arguments.number(ease, "ease", low=0.0, high=1.0)
    if keep not in (None, "start", "goal", "both"):
        raise ValueError(f"keep must be None, 'start', 'goal' or 'both', not {keep!r}")
    weights = eased(selected, rows[:, :3], rise)
    if keep is not None:
        rise = rise or DEFAULT_EASE
        fraction = arguments.fractions(rows[:, :3])
        if keep in ("start", "both"):
            weights *= smoothstep(fraction / (min(rise, 0.5) if keep == "both" else rise))
        if keep in ("goal", "both"):
            weights *= smoothstep((1.0 - fraction) / (min(rise, 0.5) if keep == "both" else rise))
    touched = weights > 0.0
    rows[touched, :3] += weights[touched, None] * shift
    return rows


def midpoint(a: Target, b: Target) -> Array:
    """Point halfway between two objects or points.

    Args:
        a: Object or point (3,) [m].
        b: Object or point (3,) [m].
    """
    return np.asarray((arguments.point(a, "a") + arguments.point(b, "b")) / 2.0)
