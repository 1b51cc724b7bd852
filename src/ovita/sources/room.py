"""What a way that is told in words asks of planning besides its places: sides, room around objects, a height."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ovita.instruct.degrees import Scale
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array, arc_length
from ovita.sources.places import APPROACH, SIDES, Anchor, Location, sides_of, troubles
from ovita.sources.planner import anchored
from ovita.sources.rings import Ring, ringed
from ovita.sources.route import Route
from ovita.sources.wishes import Level
from ovita.text import number


def around_passed(route: Route, scene: Scene, robot: Robot) -> dict[str, Array]:
    """The room (3,) [m] around objects that are to be passed on one side or so far above, and on no other."""
    up, keep = scene.frame.direction("up"), robot.radius + robot.obstacle_margin
    room: dict[str, Array] = {}
    for place in route.via:
        if place.relation in SIDES and place.away is None:
            side = scene.frame.direction(place.relation)
            room[place.objects[0].name] = _across(place.objects[0], side, place.distance or 0.0, scene)
        elif place.relation == "over" and (place.distance or 0.0) > keep:
            item = place.objects[0]
            more = max((place.distance or 0.0) - keep - SLACK, 0.0)
            room[item.name] = np.where(_vertical(item, up) > 0.0, more, min(more, 2.0 * APPROACH))
    return room


SLACK = 0.001
"""How much less room than told there is above an object that is passed, so that the place to pass is legal [m]."""


def _vertical(item: SceneObject, up: Array) -> Array:
    """One for the axis (3,) of an object that stands upright, else zero."""
    return np.asarray(np.arange(3) == np.argmax(np.abs(item.rotation.T @ up)), dtype=float)


def beneath_barred(route: Route, scene: Scene) -> dict[str, Array]:
    """The room (3,) [m] around objects that the path is not to lead over."""
    up = scene.frame.direction("up")
    return {name: OVER * _vertical(scene[name], up) for name in route.barred}


def _across(item: SceneObject, side: Array, far: float, scene: Scene) -> Array:
    """Room along every axis of an object but the one that leads to a side of it, so far from which it is passed."""
    along = int(np.argmax(np.abs(item.rotation.T @ side)))
    half = item.size / 2.0
    room = np.maximum(half[along] - half, 0.0) + 2.0 * APPROACH + far
    room[_vertical(item, scene.frame.direction("up")) > 0.0] = OVER
    room[along] = 0.0
    return np.asarray(room)


OVER = 1.0
"""Room above an object that is to be passed on a side, so that the path does not lead over it [m]."""


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


def leveled(
    places: Sequence[Location], level: Level | None, scene: Scene, robot: Robot, rings: Sequence[Ring] = ()
) -> list[Anchor] | None:
    """Where the places of a way are that goes at a height between its ends, climbing and coming down where it can.

    Its rings are among them; None if one of these cannot be.

    Raises:
        RequestError: As `places.locate` does.
    """
    anchors = anchored(places, scene, robot)
    if level is None:
        return ringed(anchors, rings, scene, robot)
    up = scene.frame.direction("up")
    level = _over_ground(level, anchors, robot, up)
    if level.halfway:
        return ringed(_with_peak(anchors, level, up), rings, scene, robot)
    for end, other in ((0, 1), (-1, -2)):  # no way leads down on something that is taller than the height
        above = _lifted(anchors[end], level, up)
        if places[end].relation == "at" and places[end].objects and troubles(above.position, scene, robot):
            beside = sides_of(places[end], scene, robot, anchors[other].position)
            raised = (_lifted(Anchor(side, above.label, above.objects), level, up) for side in beside)
            anchors[end] = next((one for one in raised if not troubles(one.position, scene, robot)), anchors[end])
    first, *_, last = anchors
    lifted = ringed([_lifted(anchor, level, up) for anchor in anchors], rings, scene, robot)
    if lifted is None:
        return None
    above, *between, over = lifted
    return [first, *([] if above is first else [above]), *between, *([] if over is last else [over]), last]


def _over_ground(level: Level, anchors: Sequence[Anchor], robot: Robot, up: Array) -> Level:
    """A height that is told by the ends of a way as one over the ground, within the robot's workspace."""
    if level.height is not None and not level.beyond:
        return level
    ends = [float(anchors[k].position @ up) for k in (0, -1)]
    extent = float(np.linalg.norm(np.ptp([anchor.position for anchor in anchors], axis=0)))
    more = Scale(extent).step("moderate") if level.height is None else level.height
    height = max(ends) + more if level.beyond == "up" else min(ends) - more
    if isinstance(robot.workspace, Box) and level.height is None:
        keep = robot.radius + robot.margin
        height = float(np.clip(height, robot.workspace.lower[2] + keep, robot.workspace.upper[2] - keep))
    return replace(level, height=height, beyond="")


def _with_peak(anchors: Sequence[Anchor], level: Level, up: Array) -> list[Anchor]:
    """The places of a way with one in the middle of its length at a height."""
    corners = np.array([anchor.position for anchor in anchors])
    s = arc_length(corners)
    k = int(np.clip(np.searchsorted(s, s[-1] / 2.0), 1, len(corners) - 1))
    here = corners[k - 1] + (s[-1] / 2.0 - s[k - 1]) / (s[k] - s[k - 1]) * (corners[k] - corners[k - 1])
    return [*anchors[:k], _lifted(Anchor(here, "the middle"), level, up), *anchors[k:]]


def _lifted(anchor: Anchor, level: Level, up: Array) -> Anchor:
    height = level.height or 0.0
    more = height - float(anchor.position @ up)
    if abs(more) < 0.02 or (level.least and more < 0.0):
        return anchor
    return Anchor(anchor.position + more * up, f"{number(height)} m above the ground", anchor.objects)
