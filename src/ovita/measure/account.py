"""What a path is like, in sentences: how long it takes, how high and fast it is, and how close it comes to objects."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ovita.paths.geometry import closest_to_point
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory
from ovita.text import length, number, sentence, the


def account(trajectory: Trajectory, scene: Scene, names: Sequence[str] = ()) -> tuple[str, ...]:
    """How long, high and fast a path is, and where it comes closest to objects.

    Args:
        trajectory: The path with its speeds.
        scene: With the objects, and which way is up.
        names: The objects that were asked about; of none the one that the path comes closest to.
    """
    heights, speeds = trajectory.positions @ scene.frame.direction("up"), trajectory.speeds
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
    return (*told, *(_of(trajectory, heights, item, *near[item.name]) for item in asked or closest))


def _closest(trajectory: Trajectory, item: SceneObject) -> tuple[float, float]:
    """Least distance [m] of a path to an object's surface, or to the centre of one without a size, and the waypoint."""
    if item.dimensions is None:
        return closest_to_point(trajectory.positions, item.position)
    return item.cuboid.closest(trajectory.positions)


def _of(trajectory: Trajectory, heights: Array, item: SceneObject, gap: float, at: float) -> str:
    """Where a path comes closest to an object: `gap` [m] from it, at the fractional waypoint `at`."""
    steps = np.arange(len(trajectory))
    when, height, speed = (float(np.interp(at, steps, row)) for row in (trajectory.times, heights, trajectory.speeds))
    from_it = "its centre" if item.dimensions is None else "its surface"
    how = f"comes within {length(gap)} of {from_it}" if gap > 0 else "goes through it"
    told = f"the path {how}, after {number(when)} s, {number(height)} m high and at {number(speed)} m/s"
    return sentence(f"{the(item.name)}: {told}")
