"""What a path is like, in sentences: how long it takes, how high and fast it is, and how close it comes to objects."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.text import length, number, the

FINE = 10
"""Places that are looked at on each segment."""


def account(trajectory: Trajectory, scene: Scene, names: Sequence[str] = ()) -> tuple[str, ...]:
    """How long, high and fast a path is, and where it comes closest to objects.

    Args:
        trajectory: The path with its speeds.
        scene: With the objects.
        names: The objects that were asked about; of none the one that the path comes closest to.
    """
    heights, speeds = trajectory.positions[:, 2], trajectory.speeds
    low, high = heights.min(), heights.max()
    told = [
        f"The path is {length(trajectory.length)} long and takes {number(trajectory.duration)} s, at "
        f"{number(speeds.min())} to {number(speeds.max())} m/s (fastest at waypoint {speeds.argmax() + 1}).",
        f"Its height is {number(low)} m throughout."
        if high - low < 1e-6
        else f"Its height is {number(low)} to {number(high)} m (highest at waypoint {heights.argmax() + 1}).",
    ]
    near = {item.name: _closest(trajectory, item) for item in scene}
    asked = [item for item in scene if item.name in names]
    closest = sorted(scene, key=lambda item: near[item.name][0])[:1]
    return (*told, *(_of(trajectory, item, *near[item.name]) for item in asked or closest))


def _closest(trajectory: Trajectory, item: SceneObject) -> tuple[float, float]:
    """Least distance [m] of a path to an object's surface, or to the centre of one without a size, and the waypoint."""
    at = np.linspace(0, len(trajectory) - 1, FINE * (len(trajectory) - 1) + 1)
    points = np.stack([np.interp(at, np.arange(len(trajectory)), axis) for axis in trajectory.positions.T], axis=1)
    gaps = item.distance(points) if item.dimensions is None else item.clearance(points)
    best = int(gaps.argmin())
    return float(gaps[best]), float(at[best])


def _of(trajectory: Trajectory, item: SceneObject, gap: float, at: float) -> str:
    steps = np.arange(len(trajectory))
    rows = (trajectory.times, trajectory.positions[:, 2], trajectory.speeds)
    when, height, speed = (float(np.interp(at, steps, row)) for row in rows)
    from_it = "its centre" if item.dimensions is None else "its surface"
    how = f"comes within {length(gap)} of {from_it}" if gap > 0 else "goes through it"
    return (
        f"{the(item.name).capitalize()}: the path {how}, after {number(when)} s, {number(height)} m high and at "
        f"{number(speed)} m/s."
    )
