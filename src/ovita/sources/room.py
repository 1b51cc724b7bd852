"""What a way that is told in words asks of planning besides its places: sides, room around objects, a height."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory
from ovita.sources.heights import Level
from ovita.sources.places import APPROACH, Anchor
from ovita.sources.route import Route
from ovita.text import number, the

SIDES = {"left": "left", "right": "right", "front": "front", "back": "back"}
"""Relations that are a side, as the frame names them."""


def beside_sides(route: Route, scene: Scene) -> dict[str, Array]:
    """The room (3,) [m] around objects that are to be passed on one side, so that the path is nearest there."""
    return {
        place.objects[0].name: _across(place.objects[0], scene.frame.direction(SIDES[place.relation]), scene)
        for place in route.via
        if place.relation in SIDES
    }


def around_circled(route: Route, scene: Scene) -> dict[str, Array]:
    """The room (3,) [m] around objects that are to be circled, so that a circle is clear of their corners."""
    up = scene.frame.direction("up")
    return {name: _to_corners(scene[name], up) for name in route.circled}


def _to_corners(item: SceneObject, up: Array) -> Array:
    half = item.size / 2.0
    vertical = int(np.argmax(np.abs(item.rotation.T @ up)))
    level = np.delete(half, vertical)
    room = float(np.linalg.norm(level)) - half + APPROACH
    room[vertical] = 0.0
    return np.maximum(room, 0.0)


def _across(item: SceneObject, side: Array, scene: Scene) -> Array:
    """Room along every axis of an object but the one that leads to a side of it."""
    along = int(np.argmax(np.abs(item.rotation.T @ side)))
    half = item.size / 2.0
    room = np.maximum(half[along] - half, 0.0) + 2.0 * APPROACH
    room[int(np.argmax(np.abs(item.rotation.T @ scene.frame.direction("up"))))] = OVER
    room[along] = 0.0
    return np.asarray(room)


OVER = 1.0
"""Room above an object that is to be passed on a side, so that the path does not lead over it [m]."""


def other_sides(route: Route, path: Trajectory, scene: Scene) -> tuple[str, ...]:
    """What a path passes on another side than was said, as sentences."""
    level = path.resample(500, by="arc_length").positions
    level = level - np.outer(level @ (up := scene.frame.direction("up")), up)
    found = []
    for place in (place for place in route.via if place.relation in SIDES):
        item = place.objects[0]
        away = level - (item.position - (item.position @ up) * up)
        nearest = away[int(np.linalg.norm(away, axis=1).argmin())]
        beside = float(nearest @ scene.frame.direction(SIDES[place.relation]))
        if beside < 0.5 * float(np.linalg.norm(nearest)) or beside <= 0.0:
            found.append(f"It would also pass {the(item.name)} on another side.")
    return tuple(found)


def enlarged(scene: Scene, robot: Robot, room: Mapping[str, Array]) -> Scene:
    """A scene whose objects are larger on each side by some room (3,) [m] along their axes."""
    return replace(scene, objects=tuple(_enlarged(item, robot, room) for item in scene))


def _enlarged(item: SceneObject, robot: Robot, room: Mapping[str, Array]) -> SceneObject:
    if item.name not in room:
        return item
    size = np.full(3, robot.object_size) if item.dimensions is None else item.dimensions
    return replace(item, dimensions=size + 2.0 * room[item.name])


def capped(robot: Robot, ceiling: float | None) -> Robot:
    """A robot whose workspace ends at a height that a way is not to exceed [m]; as it is where that leaves nothing."""
    box = robot.workspace
    if ceiling is None or not isinstance(box, Box) or not box.lower[2] + 2.0 * robot.margin < ceiling < box.upper[2]:
        return robot
    return replace(robot, workspace=Box(box.lower, (box.upper[0], box.upper[1], ceiling + robot.margin)))


def leveled(anchors: Sequence[Anchor], level: Level | None, scene: Scene) -> list[Anchor]:
    """Places of a way that goes at a height between its ends: it climbs above the first and comes down on the last."""
    if level is None:
        return list(anchors)
    up = scene.frame.direction("up")
    first, *_, last = anchors
    above, *lifted, over = (_lifted(anchor, level, up) for anchor in anchors)
    return [first, *([] if above is first else [above]), *lifted, *([] if over is last else [over]), last]


def _lifted(anchor: Anchor, level: Level, up: Array) -> Anchor:
    more = level.height - float(anchor.position @ up)
    if abs(more) < 0.02 or (level.least and more < 0.0):
        return anchor
    return Anchor(anchor.position + more * up, f"{number(level.height)} m above the ground", anchor.objects)
