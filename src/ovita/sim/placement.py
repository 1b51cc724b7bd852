"""Base poses of robots, and the transform between scene and simulator coordinates (z up)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ovita.errors import RequestError
from ovita.limits.problem import is_support, top_of
from ovita.paths.robot import Robot, Shell
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory

ROOM = 0.2
"""Height of the lowest waypoint above a floor that nothing tells of [m]."""

TOUCH = 0.01
"""A path that goes less than this beneath the objects is taken to touch what they stand on [m]."""


@dataclass(frozen=True)
class Base:
    """Pose of a robot's base in scene coordinates.

    Args:
        x, y, z: [m].
        yaw: Heading of the robot's own x axis, turned from the scene's x axis towards its y axis [rad].
    """

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    yaw: float = 0.0
    how: str = "as given"

    def __post_init__(self) -> None:
        if not np.isfinite([self.x, self.y, self.z, self.yaw]).all():
            raise RequestError(f"the base {self.describe()} is not finite; give x,y,z,yaw in metres and radians")

    @classmethod
    def parse(cls, text: str) -> Base:
        """Read "x,y,z,yaw" or "x,y,z" [m, rad].

        Raises:
            RequestError: If it is something else.
        """
        try:
            values = [float(part) for part in text.split(",")]
        except ValueError:
            values = []
        if len(values) not in (3, 4):
            hint = "give metres and radians, such as --base 0.5,0,0,1.57"
            raise RequestError(f"--base {text!r} is not x,y,z,yaw; {hint}")
        x, y, z, yaw = (*values, 0.0)[:4]
        if abs(yaw) > 2.0 * np.pi:
            meant = f"{yaw:g} degrees are {np.radians(yaw):.4g}"
            raise RequestError(f"--base {text!r}: the yaw {yaw:g} is more than a turn; give radians ({meant})")
        return cls(x, y, z, yaw)

    @property
    def position(self) -> Array:
        """(3,) [m]."""
        return np.array([self.x, self.y, self.z])

    def describe(self) -> str:
        """One line for people."""
        return f"({self.x:.4g}, {self.y:.4g}, {self.z:.4g}) m, heading {np.degrees(self.yaw):.0f} degrees"


@dataclass(frozen=True)
class WorldTransform:
    """The simulator's coordinates for a scene: x and y as in the scene, z up.

    "rfu" and "flu" scenes are taken over as they are; "ned" scenes are turned by half a turn about x, so that y and z
    change their sign. Both are rotations, so nothing is mirrored.
    """

    frame: Frame

    @property
    def signs(self) -> Array:
        """(3,) by which coordinates are multiplied; the way back is the same."""
        return np.array([1.0, -1.0, -1.0]) if self.frame.name == "ned" else np.ones(3)

    def turned(self, wxyz: Array) -> Array:
        """Quaternions (..., 4) of one side as quaternions of the other, up to their sign."""
        if self.frame.name != "ned":
            return wxyz
        w, x, y, z = np.moveaxis(wxyz, -1, 0)
        return np.stack([-x, w, -z, y], axis=-1)

    def trajectory(self, trajectory: Trajectory) -> Trajectory:
        """A trajectory in the simulator's coordinates."""
        quaternions = None if trajectory.orientations is None else self.turned(trajectory.orientations)
        return replace(trajectory, positions=trajectory.positions * self.signs, orientations=quaternions)

    def scene(self, scene: Scene) -> Scene:
        """A scene in the simulator's coordinates."""
        turned = [(o, o.position * self.signs, self.turned(o.orientation)) for o in scene]
        objects = tuple(SceneObject(o.name, place, o.size, turn, o.extra) for o, place, turn in turned)
        return replace(scene, objects=objects, frame=Frame("flu"))

    def base(self, base: Base) -> Base:
        """A base of one side in the coordinates of the other."""
        x, y, z = base.position * self.signs
        return replace(base, x=float(x), y=float(y), z=float(z), yaw=base.yaw * float(self.signs[2]))


def floor_under(low: float, scene: Scene) -> float:
    """Height of the floor [m]: what the objects stand on, unless there are none or the path goes on beneath them.

    Of a table or floor among the objects that is its upper side.
    `low` is the height of the lowest waypoint [m], in the simulator's coordinates as the scene is.
    """
    below = [item.position[2] - 0.5 * np.abs(item.rotation[2]) @ item.size for item in scene]
    bottoms = [float(top_of(item)[2] if is_support(item) else z) for item, z in zip(scene, below, strict=True)]
    return min(low, *bottoms) if bottoms and min(bottoms) < low + TOUCH else low - ROOM


def arm_base(paths: list[Array], scene: Scene, robot: Robot | None, shoulder: float, reach: float) -> Base:
    """Where an arm reaches most waypoints, chosen from a fixed set of places; deterministic.

    The centre of the robot's spherical workspace is taken if the arm reaches every waypoint from there. Otherwise
    places on a grid around the paths are compared, at three heights: by the waypoints in reach, then by standing clear
    of the paths and the objects, then by standing on what the objects stand on, then by how far the waypoints are from
    the middle of the reach.

    Paths (N, 3) [m] and scene are in the simulator's coordinates; the shoulder is so high above the base [m], and the
    tip reaches so far from it [m].
    """
    points = np.unique(np.concatenate(paths), axis=0)
    low, high = points.min(axis=0), points.max(axis=0)
    middle = 0.5 * (low + high)
    if robot is not None and isinstance(robot.workspace, Shell):
        center = np.array(robot.workspace.center)
        if _in_reach(points, center, shoulder, reach).all():
            return _facing(center, middle)
    grid = reach * np.linspace(-1.0, 1.0, 17)
    surface = floor_under(float(low[2]), scene)
    heights = (surface, low[2] - 0.5 * shoulder, middle[2] - shoulder)

    def score(place: Array) -> tuple[float, ...]:
        near = _in_reach(points, place, shoulder, reach).sum()
        off = float(np.abs(np.linalg.norm(points - place - [0, 0, shoulder], axis=1) - 0.65 * reach).max())
        return float(near), float(_clear(place, shoulder, points, scene)), float(place[2] == surface), -round(off, 6)

    places = [np.array([middle[0] + dx, middle[1] + dy, z]) for z, dx, dy in product(heights, grid, grid)]
    return _facing(max(places, key=score), middle)


def start_base(positions: Array, ground: float) -> Base:
    """Where a rover or drone begins on a path (N, 3): at its start, on the ground, facing along it."""
    x, y = positions[0, :2]
    steps = np.diff(positions[:, :2], axis=0)
    moving = np.linalg.norm(steps, axis=1) > 1e-9
    dx, dy = steps[np.argmax(moving)] if moving.any() else (1.0, 0.0)
    how = "at the start of the trajectory, facing along it"
    return Base(float(x), float(y), ground, float(np.arctan2(dy, dx)), how)


def _in_reach(points: Array, place: Array, shoulder: float, reach: float) -> Array:
    distance = np.linalg.norm(points - place - [0.0, 0.0, shoulder], axis=1)
    return np.asarray((distance <= 0.98 * reach) & (distance >= 0.25 * reach))


def _clear(place: Array, shoulder: float, points: Array, scene: Scene) -> bool:
    """Whether a column of 15 cm radius, up to the shoulder, is free of waypoints and objects."""
    column = place + np.linspace(0.0, shoulder, 5)[:, None] * [0.0, 0.0, 1.0]
    flat = np.linalg.norm(points[:, :2] - place[:2], axis=1)
    beside = (points[:, 2] > place[2] - 0.1) & (points[:, 2] < place[2] + shoulder + 0.1)
    if (beside & (flat < 0.25)).any():
        return False
    beneath = place[2] + TOUCH
    around = (item for item in scene if not (is_support(item) and float(top_of(item)[2]) <= beneath))
    return all(item.clearance(column).min() > 0.15 for item in around)


def _facing(place: Array, middle: Array) -> Base:
    x, y, z = (round(float(v), 3) for v in place)
    yaw = float(np.arctan2(middle[1] - y, middle[0] - x))
    return Base(x, y, z, round(yaw, 3), "placed where most waypoints are in reach")
