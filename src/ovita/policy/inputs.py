"""What a policy is given to read: the scene, and the functions of the paper's script form."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ovita.paths.frame import Frame
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array


class Waypoint(dict[str, float]):
    """A waypoint of the script form: x, y, z and velocity; `speed` may be read too."""

    def __missing__(self, key: str) -> float:
        if key == "speed":
            return self["velocity"]
        raise KeyError(key)


def scene_to_json(scene: Scene) -> dict[str, Any]:
    """A scene as plain JSON values; what else the scene file says of an object goes along if it is plain too."""
    return {
        "frame": scene.frame.name,
        "environment": scene.environment,
        "objects": [
            {
                "name": item.name,
                "position": item.position.tolist(),
                "dimensions": None if item.dimensions is None else item.dimensions.tolist(),
                "orientation": item.orientation.tolist(),
            }
            for item in scene
        ],
    }


def scene_from_json(value: dict[str, Any]) -> Scene:
    """The inverse of `scene_to_json`."""
    objects = (
        SceneObject(o["name"], np.array(o["position"]), _array(o["dimensions"]), np.array(o["orientation"]))
        for o in value["objects"]
    )
    return Scene(tuple(objects), Frame(value["frame"]), value["environment"])


def _array(value: list[float] | None) -> Array | None:
    return None if value is None else np.array(value, dtype=float)


def trajectory_getter(original: Array) -> Callable[[], list[Waypoint]]:
    """The script form's `get_trajectory` for rows x, y, z, speed (N, 4)."""

    def get_trajectory() -> list[Waypoint]:
        """All waypoints of the trajectory, as dicts x, y, z [m], velocity [m/s]."""
        return [Waypoint(x=x, y=y, z=z, velocity=v) for x, y, z, v in original.tolist()]

    return get_trajectory


def object_detector(scene: Scene) -> Callable[..., list[dict[str, Any]]]:
    """The script form's `detect_objects` for a scene."""

    def detect_objects(name: str | None = None) -> list[dict[str, Any]]:
        """The objects of the scene, or those that a name can mean, as dicts name, x, y, z, dimensions [m]."""
        found = list(scene)
        if name is not None:
            one = scene.find(str(name))
            found = [one] if one else [item for item in scene if str(name).lower() in item.name.lower()]
        return [
            {
                "name": item.name.lower(),
                **dict(zip("xyz", item.position.tolist(), strict=True)),
                "dimensions": item.size.tolist(),
            }
            for item in found
        ]

    return detect_objects
