"""The scenes in which the examples of the bank are run."""

from __future__ import annotations

import numpy as np

from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Trajectory, interpolate, source_indices
from ovita.toolkit import stop_at


def _path(corners, count, speeds, *, soft=True):
    points = np.array(corners, dtype=float)
    if soft:
        for _ in range(4):  # Chaikin's corner cutting
            a, b = 0.75 * points[:-1] + 0.25 * points[1:], 0.25 * points[:-1] + 0.75 * points[1:]
            points = np.vstack([points[:1], np.stack([a, b], axis=1).reshape(-1, 3), points[-1:]])
    positions = interpolate(points, source_indices(points, count, "arc_length"))
    speed = np.interp(np.linspace(0, 1, count), np.linspace(0, 1, len(speeds)), speeds)
    return Trajectory.from_array(np.column_stack([positions, speed]))


def _scene(frame, objects, environment=""):
    items = tuple(SceneObject(name, position, size) for name, (position, size) in objects.items())
    return Scene(items, Frame(frame), environment)


TABLE = _path(
    [[-0.45, 0.25, 0.2], [-0.2, 0.1, 0.22], [0.05, 0.2, 0.3], [0.25, 0.45, 0.26], [0.45, 0.4, 0.2]],
    60,
    [0.2, 0.35, 0.3],
)
TABLE_OBJECTS = {
    "cup": ([-0.2, 0.28, 0.1], [0.08, 0.08, 0.1]),
    "vase": ([0.1, 0.42, 0.12], [0.1, 0.1, 0.24]),
    "plate": ([0.35, 0.25, 0.01], [0.2, 0.2, 0.02]),
    "bowl": ([0.6, 0.55, 0.04], [0.15, 0.15, 0.08]),
    "book": ([-0.35, 0.15, 0.02], [0.2, 0.15, 0.04]),
    "lamp": ([0.15, 0.1, 0.2], [0.1, 0.1, 0.4]),
}
YARD = _path([[0, 0, 1], [1.5, -0.3, 1.2], [3, 0.2, 1.6], [4.5, -0.2, 1.4], [6, 0.2, 1.2]], 80, [0.5, 0.8, 0.6])
YARD_OBJECTS = {
    "tree": ([2.0, 1.0, 1.0], [0.6, 0.6, 2.0]),
    "mast": ([4.0, -0.8, 1.5], [0.1, 0.1, 3.0]),
    "fountain": ([3.0, 1.1, 0.4], [0.8, 0.8, 0.8]),
    "balloon": ([5.0, 0.7, 1.6], None),
    "pad": ([7.0, 0.5, 0.05], [0.6, 0.6, 0.1]),
}
HALL = _path([[0, 0, 0], [0, 3, 0], [2, 3, 0], [2, 5, 0]], 70, [0.4, 0.4], soft=False)
HALL_OBJECTS = {"pillar": ([0.8, 2.0, 0.0], [0.3, 0.3, 1.0]), "crate": ([1.2, 3.6, 0.0], [0.4, 0.4, 0.4])}
HALTING = Trajectory.from_array(stop_at(HALL.to_array(), HALL_OBJECTS["crate"][0], resume=True))
POND = _path([[0, 0, 2], [2, 0.6, 2.5], [4, -0.4, 2.2], [6, 0, 2]], 60, [0.3, 0.5, 0.4])
POND_OBJECTS = {"rock": ([3.0, 0.2, 2.6], [0.6, 0.5, 0.8]), "buoy": ([5.0, 1.0, 0.0], [0.3, 0.3, 0.3])}
STORE_OBJECTS = {"red box": ([0.2, 0.5, 0.1], [0.1, 0.1, 0.1]), "blue box": ([-0.2, 0.5, 0.1], [0.1, 0.1, 0.1])}

SCENES = {
    "table": (TABLE, _scene("rfu", TABLE_OBJECTS, "A table with a cup, a vase, a plate, a bowl, a book and a lamp.")),
    "yard": (YARD, _scene("flu", YARD_OBJECTS, "A yard that a drone crosses.")),
    "hall": (HALL, _scene("rfu", HALL_OBJECTS, "A hall with a pillar and a crate.")),
    "halting": (HALTING, _scene("rfu", HALL_OBJECTS, "A hall with a pillar and a crate at which the robot stops.")),
    "pond": (POND, _scene("ned", POND_OBJECTS, "A pond with a rock and a buoy.")),
    "store": (TABLE, _scene("rfu", STORE_OBJECTS)),
}
