"""How far "slightly" and "near" reach in a given scene: words of degree turned into metres."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ovita.scene import SceneObject
from ovita.trajectory import Trajectory

Degree = Literal["slight", "moderate", "large"]

STEP_SHARE: dict[Degree, float] = {"slight": 0.05, "moderate": 0.12, "large": 0.22}
"""Share of the path's extent that a displacement of each degree covers."""

SPEED_SHARE: dict[Degree, float] = {"slight": 0.2, "moderate": 0.4, "large": 0.6}
"""Share by which a speed changes for each degree."""

NEAR_SHARE = 0.15
"""How far "near an object" reaches beyond the closest approach, as a share of the path's extent."""


@dataclass(frozen=True)
class Scale:
    """Sizes that words of degree stand for.

    Args:
        extent: Diagonal of the path's bounding box [m].
    """

    extent: float

    @classmethod
    def of(cls, trajectory: Trajectory) -> Scale:
        """The scale of a trajectory; a path without extent counts as 1 m."""
        extent = float(np.linalg.norm(np.ptp(trajectory.positions, axis=0)))
        return cls(extent if extent > 1e-9 else 1.0)

    def step(self, degree: Degree) -> float:
        """Displacement for a degree [m], to two digits."""
        return nice(STEP_SHARE[degree] * self.extent)

    def near(self, trajectory: Trajectory, item: SceneObject) -> float:
        """Distance to the object's centre that counts as near [m]: never so small that no waypoint is near."""
        closest = float(item.distance(trajectory.positions).min())
        return nice(closest + NEAR_SHARE * self.extent)


def nice(value: float) -> float:
    """Round up to two significant digits, so that knobs read well."""
    if value <= 0:
        return 0.0
    digits = 1 - math.floor(math.log10(value))
    step = 10.0**digits
    return round(math.ceil(value * step - 1e-9) / step, max(digits, 0))
