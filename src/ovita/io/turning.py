"""Where a trajectory lies on the Earth: metres east, north and up from what its scene says of its origin."""

from __future__ import annotations

from collections.abc import Mapping

from ovita.paths.frame import RFU, Frame, transformed
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory

MISSION = "mission"
"""Key of `Scene.extra` that keeps the mission a trajectory came from; its local metres are those about a home."""

ROS = "ros"
"""Key of `Scene.extra` that keeps what the ROS message a trajectory came from says besides its path."""

_FLU = Frame("flu")


def on_earth(trajectory: Trajectory, scene: Scene) -> Trajectory:
    """The trajectory in metres east, north and up: front is north, but in ROS, by REP-103, x is east."""
    kept = scene.extra.get(ROS)
    in_ros = MISSION not in scene.extra and isinstance(kept, Mapping)
    if in_ros and not str((kept or {}).get("frame_id")).endswith("_ned"):
        return transformed(trajectory, scene.frame, _FLU)
    return transformed(trajectory, scene.frame, RFU)
