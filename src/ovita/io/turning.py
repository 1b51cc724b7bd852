"""Turning trajectories and scenes from one frame into another: the same place, other axes.

The frames differ by quarter and half turns, so that positions are exchanged and negated, never rounded.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ovita.paths.scene import RFU, Frame, Scene
from ovita.paths.trajectory import Array, Trajectory

MISSION = "mission"
"""Key of `Scene.extra` that keeps the mission a trajectory came from; its local metres are those about a home."""

ROS = "ros"
"""Key of `Scene.extra` that keeps what the ROS message a trajectory came from says besides its path."""

_FLU = Frame("flu")
_WORDS = ("right", "front", "up")


def rotation(source: Frame, target: Frame) -> Array:
    """The matrix (3, 3) that takes coordinates in `source` to those in `target`."""
    there = np.column_stack([target.direction(word) for word in _WORDS])
    here = np.column_stack([source.direction(word) for word in _WORDS])
    return np.asarray(there @ here.T)


def turned(trajectory: Trajectory, source: Frame, target: Frame) -> Trajectory:
    """The trajectory with its positions and orientations written in another frame."""
    if source == target:
        return trajectory
    turn = rotation(source, target)
    orientations = trajectory.orientations
    if orientations is not None:
        orientations = _product(_quaternion(turn), orientations)
    return replace(trajectory, positions=trajectory.positions @ turn.T + 0.0, orientations=orientations)


def on_earth(trajectory: Trajectory, scene: Scene) -> Trajectory:
    """The trajectory in metres east, north and up: front is north, but in ROS, by REP-103, x is east."""
    kept = scene.extra.get(ROS)
    in_ros = MISSION not in scene.extra and isinstance(kept, Mapping)
    if in_ros and not str((kept or {}).get("frame_id")).endswith("_ned"):
        return turned(trajectory, scene.frame, _FLU)
    return turned(trajectory, scene.frame, RFU)


def turned_scene(scene: Scene, target: Frame) -> Scene:
    """The scene with its objects written in another frame, which becomes its own."""
    if scene.frame == target:
        return scene
    turn = rotation(scene.frame, target)
    quaternion = _quaternion(turn)
    objects = tuple(
        replace(
            item, position=turn @ item.position + 0.0, orientation=_product(quaternion, item.orientation[None, :])[0]
        )
        for item in scene
    )
    return replace(scene, objects=objects, frame=target)


def _quaternion(turn: Array) -> Array:
    """Unit quaternion wxyz of a rotation matrix (3, 3), by its largest component."""
    m = turn
    squares = np.array(
        [
            1 + m[0, 0] + m[1, 1] + m[2, 2],
            1 + m[0, 0] - m[1, 1] - m[2, 2],
            1 - m[0, 0] + m[1, 1] - m[2, 2],
            1 - m[0, 0] - m[1, 1] + m[2, 2],
        ]
    )
    a, b, c = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    d, e, f = m[0, 1] + m[1, 0], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1]
    rows = np.array([[squares[0], a, b, c], [a, squares[1], d, e], [b, d, squares[2], f], [c, e, f, squares[3]]])
    row = rows[int(np.argmax(squares))]
    return np.asarray(row / np.linalg.norm(row))


def _product(left: Array, right: Array) -> Array:
    """Quaternion product of one (4,) with many (N, 4), wxyz."""
    w, x, y, z = left
    matrix = np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])
    return np.asarray(right @ matrix.T)
