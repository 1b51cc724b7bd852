"""Fits: the cuboid, cylinder or ball that explains the pixels of one thing best."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ovita.paths.trajectory import Array

Kind = Literal["box", "cylinder", "sphere"]


@dataclass(frozen=True, eq=False)
class Solid:
    """A primitive shape in the world.

    Args:
        kind: A box; a cylinder along its own z axis; a sphere.
        center: (3,) [m].
        rotation: (3, 3), columns are its axes in the world.
        size: Full edge lengths of the cuboid around it (3,) [m].
        spread: Median distance of the pixels to its surface [m].
    """

    kind: Kind
    center: Array
    rotation: Array
    size: Array
    spread: float


def upright_box(points: Array, axes: Array, floor: float) -> Solid:
    """The box on a support of least footprint.

    Args:
        points: (N, 3) [m].
        axes: (3, 3), rows are two level unit vectors and the support's normal.
        floor: Height of the support along the normal [m].
    """
    local = points @ axes.T
    yaws = np.radians(np.arange(0.0, 90.0, 1.0))
    c, s = np.cos(yaws), np.sin(yaws)
    u = local[:, :1] * c + local[:, 1:2] * s
    v = local[:, 1:2] * c - local[:, :1] * s
    low = np.percentile([u, v], 1.0, axis=1)
    high = np.percentile([u, v], 99.0, axis=1)
    best = int(np.prod(high - low, axis=0).argmin())
    yaw, top = yaws[best], float(np.percentile(local[:, 2], 98.0))
    middle = 0.5 * (low + high)[:, best]
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0.0], [np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
    center = turn @ np.array([*middle, 0.5 * (floor + top)])
    size = np.array([*(high - low)[:, best], top - floor])
    return Solid("box", axes.T @ center, axes.T @ turn, size, float("nan"))
