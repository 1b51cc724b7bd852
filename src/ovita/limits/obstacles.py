"""Obstacles: the scene's objects with the distance that the path keeps from them.

An `Obstacle` is all points closer than `radius` to an oriented cuboid, its core. With a core of no size that is a
sphere: the bounding sphere of the paper, |x_i - o|^2 >= R^2 (there R^2 = R_obs^2 + delta^2; here R = R_obs + delta,
the distance that is really kept). Its signed distance is convex: for every unit vector n the half-space
{x : n.x >= support(n)} is free of it, and imposed on both ends of a segment it keeps the whole segment out.

A support, a table or floor that robots land, stand and grasp on (`"kind": "support"`), counts from above as it is: a
path may come down to its upper side, on its own +z, and not go through. From beside and from below it counts as any
object, and where its thickness was only assumed, nothing goes beneath it.

The distance kept is the robot's body radius and a margin. The margin is larger for people and animals (`kinds.toml`);
where the original path passes nearer to them than that, the change may come no nearer than the original does. The size
assumed for an object without dimensions is smaller where the original path passes that near to its centre.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from importlib.resources import files
from typing import Literal

import numpy as np

from ovita.paths.geometry import Cuboid
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array

SUPPORT = "support"
"""The kind of tables and floors, in the `extra` of an object."""

RESTING = 1e-6
"""How near a waypoint is to the side of an object on which it rests [m]."""

SETTLED = 0.01
"""How far an original path may go into a support that was measured too high [m]: cameras err by that much."""

BENEATH = 2.0
"""How far a support goes down whose underside nobody saw [m]."""

_AFTER_THE_HEAD = re.compile(r"\b(?:with|in|on|at|near|of|by|next|behind|from|who|that|holding|wearing)\b.*|[^a-z -]")


@dataclass(frozen=True, eq=False)
class Obstacle(Cuboid):
    """A cuboid that the path keeps clear of; `radius` is the distance to keep from its core.

    Args:
        name: The object's name.
        what: "obstacle", or "workspace" for the inner sphere of a shell.
        keep: Distance to keep from the object's own surface [m].
        note: What was assumed or granted, in words, or "".
    """

    name: str = ""
    what: Literal["obstacle", "workspace"] = "obstacle"
    keep: float = 0.0
    note: str = ""


@dataclass(frozen=True)
class Kind:
    """A kind of objects: share of the robot's `person_margin`, and the edge assumed without dimensions [m] or None."""

    name: str
    share: float
    size: float | None
    words: tuple[str, ...]


@cache
def kinds() -> tuple[Kind, ...]:
    """The kinds of `kinds.toml`."""
    table = tomllib.loads(files("ovita.limits").joinpath("kinds.toml").read_text(encoding="utf-8"))
    return tuple(Kind(name, float(k["share"]), k.get("size"), tuple(k["words"])) for name, k in table.items())


def kind_of(name: str, extra: Mapping[str, object] | None = None) -> Kind | None:
    """The kind of an object by its name's head noun or the scene file's "kind"; None for an ordinary object."""
    given = (extra or {}).get("kind")
    if isinstance(given, str):
        return next((kind for kind in kinds() if kind.name == given.strip().lower()), None)
    return _named(name)


@lru_cache(maxsize=1024)
def _named(name: str) -> Kind | None:
    head = " ".join(_AFTER_THE_HEAD.sub(" ", name.lower().replace("_", " ")).split())
    for kind in kinds():
        if any(head == word or head.endswith((f" {word}", f" {word}s")) or head == f"{word}s" for word in kind.words):
            return kind
    return None


def build(
    scene: Scene,
    robot: Robot,
    *,
    contacts: Sequence[str] = (),
    path: Array | None = None,
    shape: Literal["box", "sphere"] = "box",
    original: Array | None = None,
) -> tuple[Obstacle, ...]:
    """The scene's objects as obstacles, without those in `contacts`.

    Args:
        scene: Whose objects.
        robot: Its radius and margins are the distance to keep, its `object_size` the edge of an object of unknown size.
        contacts: Objects to be touched.
        path: Waypoints (N, 3) [m] of the proposal; see `in_the_way`.
        shape: "box" keeps the cuboid, "sphere" replaces it by its bounding sphere (the paper).
        original: Waypoints (N, 3) [m] of the path before the change, which limits the sizes assumed and how far people
            are kept off.

    Raises:
        UnknownObject: If a contact is not in the scene.
    """
    return tuple(from_object(item, robot, shape, original) for item in in_the_way(scene, robot, contacts, path))


def in_the_way(
    scene: Scene, robot: Robot, contacts: Sequence[str] = (), path: Array | None = None
) -> tuple[SceneObject, ...]:
    """The objects that are obstacles: not those in `contacts`, nor the support that a planar robot drives on.

    An object in `contacts` on whose upper side the path (N, 3) [m] rests is a support: it is come down to, not entered.

    Raises:
        UnknownObject: If a contact is not in the scene.
    """
    touched = {scene[name].name for name in contacts}
    landed = {name for name in touched if path is not None and not robot.planar and rests_on(path, scene[name])}
    own = (replace(item, extra={**item.extra, "kind": SUPPORT}) if item.name in landed else item for item in scene)
    return tuple(item for item in own if item.name not in touched - landed and not _carries(item, robot))


def rests_on(path: Array, item: SceneObject) -> bool:
    """Whether a waypoint of a path (N, 3) [m] lies on an object's upper side, that on its own +z."""
    if item.dimensions is None:
        return False
    off = np.abs((path - item.position) @ item.rotation - [0.0, 0.0, item.size[2] / 2.0])
    return bool((off <= [*(item.size[:2] / 2.0), RESTING]).all(axis=1).any())


def is_support(item: SceneObject) -> bool:
    """Whether an object is a table or floor that things stand on."""
    return item.extra.get("kind") == SUPPORT


def top_of(item: SceneObject) -> Array:
    """The middle of a support's upper side (3,) [m]."""
    return np.asarray(item.position + 0.5 * item.size[2] * item.rotation[:, 2])


def _carries(item: SceneObject, robot: Robot) -> bool:
    """Whether a support is what a planar robot drives on, by the plane of its workspace."""
    if not (robot.planar and is_support(item) and isinstance(robot.workspace, Box)):
        return False
    return abs(float(top_of(item)[2]) - robot.workspace.lower[2]) < robot.radius


def counted(item: SceneObject, robot: Robot) -> SceneObject:
    """The body whose distance counts: an object as it is, a support sunk by the distance that is kept from it."""
    if not is_support(item):
        return item
    deep = robot.radius + robot.obstacle_margin
    unseen = item.extra.get("assumed") == "thickness"
    thick = BENEATH if unseen else max(float(item.size[2]) - deep, 0.0)
    center = top_of(item) - (deep + 0.5 * thick) * item.rotation[:, 2]
    return replace(item, position=center, dimensions=np.array([item.size[0], item.size[1], thick]))


def from_object(
    item: SceneObject,
    robot: Robot,
    shape: Literal["box", "sphere"],
    original: Array | None = None,
    granted: bool = True,
) -> Obstacle:
    """One object as an obstacle; see `build`. Where nothing is `granted`, people are kept off by the whole margin."""
    kind = kind_of(item.name, item.extra)
    least = robot.radius + robot.obstacle_margin
    item, support = counted(item, robot), is_support(item)
    keep = least if kind is None else max(least, robot.radius + kind.share * robot.person_margin)
    notes = [] if kind is None else [kind.name]
    if item.dimensions is None:
        own = robot.object_size if original is None else item.assumed_edge(original, least, robot.object_size)
        size = np.full(3, own)
        edge = own if kind is None or kind.size is None else max(kind.size, robot.object_size)
        keep += (edge - own) / 2.0
        notes.append(
            f"its size was assumed: {edge:.3g} m" + (", as the path passes so near" if edge < robot.object_size else "")
        )
    else:
        size = np.asarray(item.dimensions)
    half, core = size / 2.0, 0.0
    if shape == "sphere" and not support:
        half, core = np.zeros(3), float(np.linalg.norm(half))
    body = Obstacle(np.asarray(item.position), item.rotation, half, core + keep, item.name, keep=keep)
    if original is not None and kind is not None and (granted or support):
        nearest = keep + body.closest(original)[0]
        if nearest < keep:
            keep = max(nearest, least - SETTLED if support else least)
            body = replace(body, radius=core + keep, keep=keep)
    return replace(body, note=", ".join(notes))
