"""What words of degree, such as "a bit" and "much", come to in a given scene."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from ovita.paths.geometry import Cuboid, runs
from ovita.paths.scene import SceneObject
from ovita.paths.trajectory import Array, Trajectory

Degree = Literal["slight", "moderate", "large"]

DEGREES: tuple[Degree, ...] = ("slight", "moderate", "large")

STEP_SHARE: dict[Degree, float] = {"slight": 0.05, "moderate": 0.12, "large": 0.22}
"""Share of the path's extent that a displacement of each degree covers."""

SLOWER: dict[Degree, float] = {"slight": 0.75, "moderate": 0.5, "large": 0.25}
FASTER: dict[Degree, float] = {"slight": 1.25, "moderate": 1.5, "large": 2.0}
"""Factors on the speed where an instruction gives a degree and no amount."""

NEAR_SHARE = 0.15
"""Half the length of the stretch that is "near an object" on a straight path, as a share of the path's extent."""


AT_HAND, SOON = 3.0, 4.0
"""How far [m], or how many seconds at the mean speed, that stretch is at most, whichever is more, in large scenes."""

AT_ONCE = 0.6
"""The most that a shift without an amount is [m], or how far it goes in as many seconds, whichever is more."""

END_SHARE = 0.25
"""Share of the waypoints that "at the start" or "at the end" means."""

NEAR_WAYPOINTS, FEW = 0.1, 4
"""Least share of the waypoints that are "near an object", so that sparse waypoints have some too, and how many at
most."""


def extent_of(positions: Array | None) -> float | None:
    """Diagonal of the bounding box of a path (N, 3) [m]; None without a path."""
    return float(np.linalg.norm(np.ptp(positions, axis=0))) if positions is not None and len(positions) else None


@dataclass(frozen=True)
class Scale:
    """Sizes that words of degree stand for.

    Args:
        extent: Diagonal of the path's bounding box [m].
        pace: Mean speed of the path where it moves [m/s].
    """

    extent: float
    pace: float = math.inf

    @classmethod
    def of(cls, trajectory: Trajectory) -> Scale:
        """The scale of a trajectory; a path without extent counts as 1 m."""
        extent = extent_of(trajectory.positions)
        moving = trajectory.speeds[trajectory.speeds > 0.0]
        pace = float(moving.mean()) if len(moving) else math.inf
        return cls(extent if extent and extent > 1e-9 else 1.0, pace)

    def step(self, degree: Degree) -> float:
        """Displacement for a degree [m], to two digits."""
        whole = max(AT_ONCE, AT_ONCE * self.pace) / STEP_SHARE["moderate"] if self.pace < math.inf else math.inf
        return nice(STEP_SHARE[degree] * min(self.extent, whole))

    def describe(self) -> str:
        """What words of degree amount to, as a prompt says it."""
        shift, slower, faster = (
            "/".join(f"{of[degree]:g}" for degree in DEGREES)
            for of in ({degree: self.step(degree) for degree in DEGREES}, SLOWER, FASTER)
        )
        return f"slightly/plain/much: {shift} m, slower x{slower}, faster x{faster}."

    def end(self, positions: Array) -> float | None:
        """How much of a large path (N, 3) [m] is its start or its end [m]; None where the usual share is less."""
        most = 2.0 * max(AT_HAND, SOON * self.pace)
        usual = END_SHARE * float(np.linalg.norm(np.diff(positions, axis=0), axis=1).sum())
        return nice(most) if most < usual else None

    def near(self, positions: Array, item: SceneObject, kept: float = 0.0) -> float:
        """Distance to the object's centre that counts as near a path [m].

        On a straight path that passes at distance d, the sphere of radius sqrt(d^2 + h^2) holds a stretch of length 2h;
        so the radius is never so small that no waypoint is near, nor so large that all are.

        Args:
            positions: The path, (N, 3) [m].
            item: The object.
            kept: Distance [m] to its centre to which the path is pushed out before it is asked what is near.
        """
        core = item.core(positions)
        apart = np.maximum(core.depth(positions), kept)
        at, count = int(apart.argmin()), min(max(math.ceil(NEAR_WAYPOINTS * len(apart)), 1), FEW)
        around = np.sort(apart[max(at - count, 0) : at + count + 1])  # of the nearest pass, not of another
        least, few = around[0], around[min(count, len(around)) - 1]
        # The stretch along a wide object is long by itself.
        stretch = min(NEAR_SHARE * self.extent, max(AT_HAND, SOON * self.pace))
        beyond = max(stretch - float(core.half.max()), min(stretch, WIDER * least))
        reach = nice(max(math.hypot(least, beyond), float(few), _alongside(positions, core, apart)))
        reach = max(reach, nice(_gap(apart, reach)))
        passes = [float(apart[a : b + 1].min()) for a, b in runs(apart <= reach)]
        other = min((one for one in passes if one > max(AGAIN * least, reach / 2.0)), default=math.inf)
        second = float(around[:2][-1])  # so that two waypoints are near even so
        return max(nice(ASIDE * other, up=False), nice(second)) if other < reach else reach


def _alongside(positions: Array, core: Cuboid, apart: Array) -> float:
    """How far off the path passes along a wide thing, to and fro [m]; 0 of others.

    Args:
        positions: The path, (N, 3) [m].
        core: The middle of the thing's body.
        apart: The distance of each waypoint to it, (N,) [m].
    """
    longest = int(core.half.argmax())
    along = np.abs((positions - core.center) @ core.rotation[:, longest]) <= core.half[longest]
    beside = along & (apart <= TO_AND_FRO * float(apart.min()))
    return float(apart[beside].max(initial=0.0)) if core.half[longest] > 0.0 else 0.0


def _gap(apart: Array, reach: float) -> float:
    """How far off a path is between two stretches that are near, where it hardly leaves what is near; else 0."""
    between = [float(apart[b : c + 1].max()) for (_, b), (c, _) in pairwise(runs(apart <= reach))]
    return max((far for far in between if far <= HARDLY * reach), default=0.0)


HARDLY = 1.15
"""How many times as far off as what is near a path may be between two stretches for all of it to be near."""

TO_AND_FRO = 1.5
"""How many times as far off as the nearest another pass along a long thing is that is near it, too."""

WIDER = 0.25
"""How far beyond the ends of a wide object is near it at least, as a share of its distance to the path."""

AGAIN, ASIDE = 1.8, 0.98
"""How many times as far off as the nearest another pass is that is not near an object, and what share of it is."""


def nice(value: float, *, up: bool = True) -> float:
    """Round up, or down, to two significant digits, so that knobs read well."""
    if value <= 0:
        return 0.0
    digits = 1 - math.floor(math.log10(value))
    step = 10.0**digits
    rounded = math.ceil(value * step - 1e-9) if up else math.floor(value * step + 1e-9)
    return round(rounded / step, max(digits, 0))
