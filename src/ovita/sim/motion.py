"""The motion of a robot as arrays, to be drawn without a simulator."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ovita.paths.trajectory import Array, nlerp

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Color = tuple[float, float, float, float]


@dataclass(frozen=True)
class Shape:
    """A primitive shape that is fixed to a body.

    Args:
        body: Index of the body in `Motion.bodies`.
        kind: A box; a sphere; or a cylinder, or capsule, along its own z axis.
        size: Box: full edge lengths. Sphere: (radius, 0, 0). Cylinder: (radius, length, 0). Capsule: (radius, length of
            the cylindrical part, 0). All [m].
        position: In the body's frame (3,) [m].
        wxyz: In the body's frame, a unit quaternion.
        rgba: Colour, 0..1 each.
    """

    body: int
    kind: Literal["box", "sphere", "cylinder", "capsule"]
    size: Vector
    position: Vector
    wxyz: Quaternion
    rgba: Color


@dataclass(frozen=True)
class Motion:
    """Poses of a robot's bodies over time, in the scene's own coordinates.

    Args:
        bodies: Their B names.
        times: (T,) of the simulated motion [s], ascending from 0, evenly spaced but for the last.
        positions: (T, B, 3) [m].
        wxyz: (T, B, 4) unit quaternions.
        waypoints: (T,) the place on the trajectory, counted in waypoints: 2.5 is midway between waypoints 2 and 3.
        asked: (T,) the time at which the trajectory itself is at that place [s]; ascending, and the same as `times`
            where the robot keeps up.
        tip: (T, 3) the point of the robot that follows the trajectory [m].
        shapes: What the bodies look like.
    """

    bodies: tuple[str, ...]
    times: Array
    positions: Array
    wxyz: Array
    waypoints: Array
    asked: Array
    tip: Array
    shapes: tuple[Shape, ...]

    @property
    def duration(self) -> float:
        """[s]."""
        return float(self.times[-1])

    def at(self, time: float, *, clock: Literal["robot", "trajectory"] = "robot") -> tuple[Array, Array]:
        """Positions (B, 3) [m] and quaternions (B, 4) wxyz at one time, interpolated; held at both ends.

        Args:
            time: [s].
            clock: "robot" counts the simulated time; "trajectory" counts the time of the trajectory's own law, as a
                playhead on the trajectory does.
        """
        frames = np.arange(len(self.times), dtype=float)
        source = np.interp([time], self.times if clock == "robot" else self.asked, frames)
        low = int(source[0])
        pair = slice(low, min(low + 2, len(frames)))
        share = source - low
        positions = self.positions[pair]
        place = positions[0] + share[0] * (positions[-1] - positions[0])
        turns = np.array([nlerp(self.wxyz[pair, b], share)[0] for b in range(len(self.bodies))])
        return place, turns
