"""Obstacles: oriented cuboids with rounded edges, and their exact distance to segments.

An `Obstacle` is all points closer than `radius` to an oriented cuboid, its core. With a core of no size that is a
sphere: the bounding sphere of the paper, |x_i - o|^2 >= R^2 (there R^2 = R_obs^2 + delta^2; here R = R_obs + delta,
the distance that is really kept).

Its signed distance is a convex function. So along a segment it has one minimum, found exactly below; and for every
unit vector n the half-space {x : n.x >= support(n)} is free of the obstacle. Imposed on both ends of a segment it
keeps the whole segment out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ovita.paths.geometry import Cuboid
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene, SceneObject


@dataclass(frozen=True, eq=False)
class Obstacle(Cuboid):
    """A cuboid that the path keeps clear of; `radius` is the distance to keep from its core.

    Args:
        name: The object's name.
        what: "obstacle", or "workspace" for the inner sphere of a shell.
    """

    name: str = ""
    what: Literal["obstacle", "workspace"] = "obstacle"


def build(
    scene: Scene, robot: Robot, *, contacts: Sequence[str] = (), shape: Literal["box", "sphere"] = "box"
) -> tuple[Obstacle, ...]:
    """The scene's objects as obstacles, without those in `contacts`.

    Args:
        scene: Whose objects.
        robot: Its `obstacle_margin` is the distance to keep, its `object_size` the edge of an object of unknown size.
        contacts: Names of objects that are meant to be touched.
        shape: "box" keeps the cuboid, "sphere" replaces it by its bounding sphere (the paper).

    Raises:
        UnknownObject: If a contact is not in the scene.
    """
    touched = {scene[name].name for name in contacts}
    return tuple(from_object(item, robot, shape) for item in scene if item.name not in touched)


def from_object(item: SceneObject, robot: Robot, shape: Literal["box", "sphere"]) -> Obstacle:
    """One object as an obstacle that is to be kept clear of by the robot's `obstacle_margin`."""
    size = np.full(3, robot.object_size) if item.dimensions is None else np.asarray(item.dimensions)
    half, radius = size / 2.0, robot.obstacle_margin
    if shape == "sphere":
        half, radius = np.zeros(3), float(np.linalg.norm(half)) + radius
    return Obstacle(np.asarray(item.position), item.rotation, half, radius, item.name)
