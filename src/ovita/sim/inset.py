"""The inset of a video that shows a small robot from near, in a corner where it hides as little as possible."""

from __future__ import annotations

from typing import Any

import numpy as np

from ovita.paths.trajectory import Array

SMALL = 0.08
"""A robot smaller than this share of the camera's distance is also shown from near, in an inset."""

INSET = 0.3
"""Size of the inset, as a share of the pane."""

_HALF_VIEW = np.tan(np.radians(22.5))
"""Of MuJoCo's camera, whose field of view is 45 degrees high."""


def close_up(camera: Any, extent: float) -> Any:
    """A camera that looks the same way from near."""
    import mujoco

    near = mujoco.MjvCamera()
    near.type, near.azimuth, near.elevation = camera.type, camera.azimuth, camera.elevation
    near.distance = 2.2 * extent
    return near


def corner(camera: Any, points: Array, size: tuple[int, int]) -> tuple[int, int]:
    """The corner in which an inset hides the fewest points: 1 or -1 for right or left, and for top or bottom.

    Args:
        camera: A free one.
        points: (N, 3) in the simulator's coordinates [m].
        size: Width and height of the picture.
    """
    turn, tilt = np.radians([camera.azimuth, camera.elevation])
    ahead = np.array([np.cos(tilt) * np.cos(turn), np.cos(tilt) * np.sin(turn), np.sin(tilt)])
    right = np.array([np.sin(turn), -np.cos(turn), 0.0])
    away = points - (camera.lookat - camera.distance * ahead)
    scale = (away @ ahead) * _HALF_VIEW
    x, y = (away @ right) / scale * size[1] / size[0], (away @ np.cross(right, ahead)) / scale
    edge = 1.0 - 2.0 * INSET - 0.05
    corners = [(1, 1), (-1, 1), (1, -1), (-1, -1)]
    return min(corners, key=lambda at: int(((at[0] * x > edge) & (at[1] * y > edge)).sum()))
