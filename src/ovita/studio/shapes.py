"""Shapes of the scene as arrays: lines as segments, colours of speeds, violated segments, the first camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ovita.limits.problem import TOLERANCE
from ovita.paths.frame import Frame
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.plots import geometry
from ovita.result import Adaptation

Colours = NDArray[np.uint8]

_RAMP = np.array([[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 200, 37]], dtype=float)
_FILL = 0.9
RAMP_CSS = "linear-gradient(90deg," + ",".join(f"rgb({r:.0f},{g:.0f},{b:.0f})" for r, g, b in _RAMP) + ")"
"""The colours of speeds, slow to fast."""


def rgb(colour: str) -> tuple[int, int, int]:
    """A colour such as "#1f5fbf" as three numbers."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def segments(points: Array) -> NDArray[np.float32]:
    """A polyline (N, 3) as segments (N-1, 2, 3)."""
    return np.asarray(np.stack([points[:-1], points[1:]], axis=1), dtype=np.float32)


def plain_colours(count: int, colour: str) -> Colours:
    """One colour for segments, (count, 2, 3)."""
    return np.broadcast_to(_linear(np.array(rgb(colour), dtype=float)), (count, 2, 3)).copy()


def speed_colours(speeds: Array, lowest: float, highest: float) -> Colours:
    """Colours of segments by the speeds (N,) of their ends, (N-1, 2, 3)."""
    share = np.clip((speeds - lowest) / max(highest - lowest, 1e-9), 0.0, 1.0) * (len(_RAMP) - 1)
    low = np.minimum(share.astype(int), len(_RAMP) - 2)
    t = (share - low)[:, None]
    colours = _linear(_RAMP[low] * (1 - t) + _RAMP[low + 1] * t)
    return np.stack([colours[:-1], colours[1:]], axis=1)


def _linear(colours: Array) -> Colours:
    """Colours as the page's renderer takes them at the ends of lines: as amounts of light."""
    return np.asarray(np.round((colours / 255.0) ** 2.2 * 255.0), dtype=np.uint8)


def arrows(path: Trajectory, length: float, count: int = 6) -> NDArray[np.float32]:
    """Short arrows (K, 2, 3) along a path, spread evenly over its length; none where it has no length."""
    if path.length <= 0.0:
        return np.zeros((0, 2, 3), dtype=np.float32)
    s = path.arc_length
    middle = (np.arange(count) + 0.5) / count * s[-1]
    ahead = np.minimum(middle + min(length, 0.5 * s[-1] / count), s[-1])
    ends = [np.stack([np.interp(at, s, path.positions[:, k]) for k in range(3)], axis=1) for at in (middle, ahead)]
    pairs = np.stack(ends, axis=1)
    return np.asarray(pairs[np.linalg.norm(pairs[:, 1] - pairs[:, 0], axis=1) > 1e-9], dtype=np.float32)


def violated(result: Adaptation) -> NDArray[np.float32]:
    """Segments (K, 2, 3) of the proposal that broke a limit before the constraints had their say."""
    path = result.proposed
    if path is None:
        return np.zeros((0, 2, 3), dtype=np.float32)
    exempt = set(result.constraints.exempt) if result.constraints else set()
    bad = broken(path, result.scene, result.robot, exempt)
    return segments(path.positions)[bad[:-1] | bad[1:]]


def broken(path: Trajectory, scene: Scene, robot: Robot, exempt: set[str]) -> NDArray[np.bool_]:
    """Which waypoints (N,) break a limit of the robot."""
    bad = np.zeros(len(path), dtype=bool)
    if robot.workspace is not None:
        bad |= robot.workspace.inside(path.positions) < robot.margin - TOLERANCE
    if robot.max_speed is not None:
        bad |= path.speeds > robot.max_speed + TOLERANCE
    for item in scene:
        if item.name not in exempt:
            bad |= item.clearance(path.positions) < robot.obstacle_margin - TOLERANCE
    return bad


@dataclass
class Shown:
    """What a person wants to see."""

    speeds: bool = False
    waypoints: bool = False
    ghost: bool = True
    margins: bool = False
    workspace: bool = True
    labels: bool = True


@dataclass(frozen=True)
class Stage:
    """The part of the world that the page shows.

    Args:
        lower: Lower corner (3,) [m].
        upper: Upper corner (3,) [m].
        up: The direction up (3,).
    """

    lower: Array
    upper: Array
    up: Array

    @classmethod
    def of(cls, paths: list[Trajectory], scene: Scene) -> Stage:
        """The paths, and the objects that are not far away from them."""
        shown = geometry.extent(paths, scene)
        points = [path.positions for path in paths] + [geometry.corners(item) for item in shown.shown]
        everything = np.concatenate(points)
        return cls(everything.min(axis=0), everything.max(axis=0), scene.frame.direction("up"))

    @property
    def middle(self) -> Array:
        """Centre (3,) [m]."""
        return np.asarray((self.lower + self.upper) / 2.0)

    @property
    def size(self) -> float:
        """Longest edge [m], at least 0.2."""
        return max(float((self.upper - self.lower).max()), 0.2)

    @property
    def ground(self) -> float:
        """Height of the floor: that of the lowest thing, or 0 where that is just below [m]."""
        lowest = float(self.lower[2]) if self.up[2] > 0 else float(self.upper[2])
        return 0.0 if 0.0 < lowest * float(self.up[2]) < 0.3 * self.size else lowest

    def corner(self, frame: Frame) -> Array:
        """Where the axes stand: on the floor, behind and to the left of everything, (3,) [m]."""
        front, right = frame.direction("front"), frame.direction("right")
        back = min(float(self.lower @ front), float(self.upper @ front))
        left = min(float(self.lower @ right), float(self.upper @ right))
        place = (back - 0.1 * self.size) * front + (left - 0.1 * self.size) * right
        place[2] = self.ground
        return np.asarray(place)

    def camera(self, frame: Frame, aspect: float, fov: float) -> tuple[Array, Array]:
        """Where a camera sees everything from behind the robot, somewhat from the right and above; and its target.

        Args:
            frame: Which way is front.
            aspect: Width by height of the free part of the picture.
            fov: Vertical field of view [rad].
        """
        up = frame.direction("up")
        view = -1.0 * frame.direction("front") + 0.36 * frame.direction("right") + 0.68 * up
        view = view / np.linalg.norm(view)
        right = np.cross(up, view) / np.linalg.norm(np.cross(up, view))
        lower, upper = np.minimum(self.lower, self.corner(frame)), np.maximum(self.upper, self.corner(frame))
        middle = (lower + upper) / 2.0
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        points = signs * np.maximum(upper - lower, 0.1 * self.size) / 2.0
        across, high, near = points @ right, points @ np.cross(view, right), points @ view
        tall = float(np.tan(fov / 2.0))
        wide = tall * aspect * _FILL
        needed = near + np.maximum(np.abs(across) / wide, np.where(high > 0, high / 0.85, -high / 0.6) / tall)
        return middle + view * float(needed.max()), middle


def grid_step(size: float) -> float:
    """A round edge length for the cells of the ground grid [m]."""
    power = 10.0 ** np.floor(np.log10(size / 8.0))
    return float(next(s * power for s in (1, 2, 5, 10) if s * power >= size / 12.0))


def edges(size: Any) -> NDArray[np.float32]:
    """The 12 edges (12, 2, 3) of a cuboid with edge lengths (3,) around the origin."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float32)
    pairs = [(i, j) for i in range(8) for j in range(i + 1, 8) if np.abs(signs[i] - signs[j]).sum() == 2]
    points = signs * np.asarray(size, dtype=np.float32) / 2.0
    return np.array([[points[i], points[j]] for i, j in pairs], dtype=np.float32)
