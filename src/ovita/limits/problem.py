"""Input and output of the constraint solver: options, obstacles, and the verdict.

The problem is that of the paper (OVITA, arXiv 2508.17260): with the waypoints x_i = (x, y, z, v) stacked
waypoint-major and x_ref what the policy proposed,

    minimise    lambda_dev |x - x_ref|^2 + lambda_smooth |D1 x|^2,        D1 x = (x_1 - x_0, x_2 - x_1, ...)
    subject to  x_i in the workspace, shrunk by a margin                  (box or spherical shell)
                dist(x_i, object) >= margin for every object              (paper: its bounding sphere)
                0 <= v_i <= v_max
                x_0, x_{N-1} as proposed                                  (if fixed)

ovita asks more: the limits hold along whole segments, not only at waypoints, and the result is measured by
`verify`, which knows nothing of how it was found.

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
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache
from importlib.resources import files
from typing import Any, Literal

import numpy as np

from ovita.errors import ConstraintDefinitionError
from ovita.paths.geometry import Cuboid
from ovita.paths.robot import UNLIMITED, Box, Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory, is_real
from ovita.text import counted, listed, sentence

_WANTED: Mapping[str, tuple[Callable[[Any], bool], str]] = {
    "method": (lambda value: value in ("verified", "paper"), "one of verified, paper"),
    "lambda_dev": (lambda value: is_real(value) and value >= 1e-12, "a weight > 0"),
    "lambda_smooth": (lambda value: value == "auto" or (is_real(value) and value >= 0), "a weight >= 0"),
    "lambda_shape": (lambda value: is_real(value) and value >= 0, "a weight >= 0"),
    "obstacle_shape": (lambda value: value in ("box", "sphere"), "one of box, sphere"),
    **dict.fromkeys(
        ("max_acceleration", "max_lateral_acceleration"),
        (lambda value: value is None or (is_real(value) and value > 0), "> 0 m/s^2; leave it out for no limit"),
    ),
    "steps": (lambda value: is_real(value) and value >= 1, "a number >= 1"),
}
"""What each option has to be."""

TOLERANCE = 1e-6
"""A violation up to this counts as none [m, m/s, ...]."""

Status = Literal["satisfied", "repaired", "infeasible", "preexisting", "off"]
Place = Literal["waypoint", "segment"]


@dataclass(frozen=True)
class ConstraintOptions:
    """How limits are enforced; the limits themselves belong to the `Robot`.

    Args:
        method: "verified" (sequential convex, whole segments) or "paper" (the published module: one linearised
            QP, weights searched by Optuna).
        lambda_dev: Weight of the distance to the proposed trajectory, > 0.
        lambda_smooth: Weight of the squared differences of neighbouring waypoints, >= 0; 0 asks for no smoothing
            and then leaves a legal trajectory bit by bit as it is. "auto" chooses it (see `solve.choose_smoothing`).
        lambda_shape: Weight of the squared differences of neighbouring *displacements*, >= 0: spreads a repair
            over its surroundings so that the shape of the path survives. It is zero wherever nothing is moved.
        fix_start: Whether the first waypoint must stay where it was proposed.
        fix_goal: Whether the last waypoint must stay where it was proposed.
        pinned: Waypoints that must stay where they were proposed, counted from 0; negative from the end.
        obstacles: Whether the objects of the scene are obstacles.
        obstacle_shape: "box" (the oriented cuboid) or "sphere" (its bounding sphere, as in the paper).
        repair_original: Whether to move a path that the policy left untouched but that breaks a limit.
        enabled: False only measures.
        max_acceleration: Along the path [m/s^2], or None for no limit.
        max_lateral_acceleration: Across the path, v^2 times curvature [m/s^2], or None for no limit.
        custom: Further constraints, see `custom.Constraint`.
        steps: Most linearisations in a row, >= 1; every one of them gives a legal path, more give a nearer one.
        trials: Trials of any search for weights; with method "paper" 0 takes the weights as they are.
        seed: Of that search.

    Raises:
        ConstraintDefinitionError: On weights or limits that make no sense.
    """

    method: Literal["verified", "paper"] = "verified"
    lambda_dev: float = 1.0
    lambda_smooth: float | Literal["auto"] = 0.0
    lambda_shape: float = 16.0
    fix_start: bool = False
    fix_goal: bool = False
    pinned: tuple[int, ...] = ()
    obstacles: bool = True
    obstacle_shape: Literal["box", "sphere"] = "box"
    repair_original: bool = False
    enabled: bool = True
    max_acceleration: float | None = None
    max_lateral_acceleration: float | None = None
    custom: tuple[Any, ...] = ()
    steps: int = 12
    trials: int = 50
    seed: int = 0

    def __post_init__(self) -> None:
        for key, (fits, what) in _WANTED.items():
            if not fits(getattr(self, key)):
                raise ConstraintDefinitionError(f"{key} {getattr(self, key)!r} is not {what}")

    def pins(self, n: int) -> tuple[int, ...]:
        """The waypoints of a trajectory with n waypoints that must not move, ascending.

        Raises:
            ConstraintDefinitionError: If a pinned waypoint does not exist.
        """
        chosen = set()
        for i in self.pinned:
            if not -n <= i < n:
                which = f"{i + 1} (index {i})" if i >= 0 else f"{i}"
                raise ConstraintDefinitionError(f"pinned waypoint {which} does not exist; there are {n} waypoints")
            chosen.add(i % n)
        return tuple(sorted(chosen | ({0} if self.fix_start else set()) | ({n - 1} if self.fix_goal else set())))


def about_path(unit: str) -> bool:
    """Whether a limit in this unit is about the path rather than about speed."""
    return "/s" not in unit


@dataclass(frozen=True)
class ConstraintCheck:
    """One limit, measured on the trajectory before and after the constraint module.

    Args:
        name: "workspace", "plane", "obstacle", "speed", "least speed", "acceleration", "lateral acceleration", "start",
            "goal", "pinned" or the name of a custom constraint.
        subject: The object's name, or "".
        limit: The limit in words.
        violation_before: Worst violation of the proposed trajectory, >= 0.
        violation_after: Worst violation of the result, >= 0.
        unit: Of both, such as "m".
        where_before: Waypoint or segment of the former, or None.
        where_after: Waypoint or segment of the latter, or None.
        place: Whether the two count waypoints or segments.
        violation_original: Worst violation of the trajectory before any change, >= 0; None where neither the
            proposal nor the result breaks the limit: then it is not measured.
    """

    name: str
    subject: str
    limit: str
    violation_before: float
    violation_after: float
    unit: str = "m"
    where_before: int | None = None
    where_after: int | None = None
    place: Place = "waypoint"
    violation_original: float | None = None

    @property
    def held_before(self) -> bool:
        """Whether the proposed trajectory kept the limit."""
        return self.violation_before <= TOLERANCE

    @property
    def held(self) -> bool:
        """Whether the result keeps the limit."""
        return self.violation_after <= TOLERANCE

    @property
    def geometric(self) -> bool:
        """Whether the limit is about the path rather than about speed."""
        return about_path(self.unit)


@dataclass(frozen=True)
class Verdict:
    """The outcome of every limit check.

    Args:
        status: "satisfied" (every limit held as proposed), "repaired" (every limit holds now), "preexisting" (only
            limits are broken that the original path already broke, and no worse), "infeasible" (a limit is broken; the
            result is the best effort) or "off" (only measured).
        checks: One per limit.
        exempt: Objects that the change is meant to touch, which are therefore no obstacles.
        conflicts: Sentences that name the limits that cannot hold together, and what to relax.
        max_shift: Largest distance between a proposed waypoint and its result [m].
        waypoints_changed: Waypoints whose position or speed differs from what was proposed.
        undone: Share of the requested displacement that the limits took back (0 none, 1 all), or None if no
            displacement was requested or the number of waypoints changed.
        notes: Further sentences, such as a choice of weights.
    """

    status: Status
    checks: tuple[ConstraintCheck, ...] = ()
    exempt: tuple[str, ...] = ()
    conflicts: tuple[str, ...] = ()
    max_shift: float = 0.0
    waypoints_changed: int = 0
    undone: float | None = None
    notes: tuple[str, ...] = field(default=())

    @property
    def ok(self) -> bool:
        """Whether every limit holds."""
        return all(check.held for check in self.checks)

    @property
    def did(self) -> tuple[str, ...]:
        """What was done to the proposal for the limits, as phrases such as "moved the path by up to 0.010 m"."""
        if self.max_shift > 0:
            return (f"moved the path by up to {amount(self.max_shift)} m",)
        return (f"changed the speed at {counted(self.waypoints_changed, 'waypoint')}",) * bool(self.waypoints_changed)

    def sentences(self) -> list[str]:
        """The verdict in plain words."""
        said: list[str] = []
        if self.status == "off":
            said.append("The limits were measured, not enforced.")
        elif self.status == "satisfied":
            said += self._satisfied()
        elif self.status == "infeasible":
            said.append("Not every limit can hold; this is the best effort.")
        said += [f"The limits {what}." for what in self.did]
        said += [line for check in self.checks for line in _tell(check, self.status, self.max_shift > 0)]
        said += [f"'{name}' is meant to be touched and was no obstacle." for name in self.exempt]
        return said + list(self.conflicts) + list(self.notes)

    def _satisfied(self) -> list[str]:
        """That every limit holds, which ones there are, and whether the robot's are among them."""
        own = list(dict.fromkeys(check.name for check in self.checks if check.name != "obstacle"))
        near = [check.subject for check in self.checks if check.name == "obstacle"]
        objects = listed(f"'{name}'" for name in near) if len(near) < 4 else f"{len(near)} objects"
        checked = [*own, *([f"the distance to {objects}"] if near else [])]
        said = [f"Every limit holds as proposed: {listed(checked)}."] if checked else []
        if not {"workspace", "speed", "acceleration"} & set(own):
            said.append("No limits of a robot are known, so workspace, speed and acceleration were not checked.")
        return said


@dataclass(frozen=True)
class Solution:
    """A trajectory with the same number of waypoints as proposed, and its verdict."""

    trajectory: Trajectory
    verdict: Verdict


def at(place: Place, where: int | None) -> str:
    """Where a limit is broken, as a person counts: " at waypoint 3", " between waypoints 3 and 4", or ""."""
    if where is None:
        return ""
    return f" at waypoint {where + 1}" if place == "waypoint" else f" between waypoints {where + 1} and {where + 2}"


def _tell(check: ConstraintCheck, status: Status, moved: bool) -> list[str]:
    """A sentence on a limit that was broken, before or after."""
    if check.held and check.held_before:
        return []
    subject = f"'{check.subject}'" if check.subject else f"the {check.name} limit ({check.limit})"
    if check.held:
        text = f"{amount(check.violation_before)} {check.unit}{at(check.place, check.where_before)}"
        if check.name == "obstacle":
            return [f"It had passed {text} too close to {subject}; now it keeps its distance."]
        return [sentence(f"{subject} holds now; the proposal had exceeded it by {text}")]
    text = f"{amount(check.violation_after)} {check.unit}"
    where = at(check.place, check.where_after)
    if status == "preexisting":
        how = f"passes {text} too close to {subject}" if check.name == "obstacle" else f"breaks {subject} by {text}"
        if (original := check.violation_original) is not None and original > check.violation_after + 1e-3:
            was = how.replace(text, f"{amount(original)} {check.unit}", 1)
            return [f"The original path already {was}; now that is {text}{where}."]
        kept = "no worse than before" if moved or not check.geometric else "the path as it was"
        return [f"The original path already {how}{where}; this change leaves {kept}."]
    if check.name == "obstacle":
        return [f"The path passes {text} too close to {subject}{where}."]
    return [sentence(f"{subject} is exceeded by {text}{where}")]


def amount(value: float) -> str:
    """A violation for people: to the millimetre, smaller ones by their first digit."""
    return f"{value:.3f}" if value >= 0.001 else f"{value:.1g}"


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


def obstacles_of(
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


def solid_of(item: SceneObject, robot: Robot) -> SceneObject:
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
    """One object as an obstacle, see `obstacles_of`; without `granted`, people are kept off by the whole margin."""
    kind = kind_of(item.name, item.extra)
    least = robot.radius + robot.obstacle_margin
    item, support = solid_of(item, robot), is_support(item)
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
    elif original is not None and granted and 0.0 < (nearest := keep + body.closest(original)[0]) < keep:
        works = _works_on(body, original, nearest > robot.radius)
        if works or robot == UNLIMITED:  # where no robot is named, nobody asked for a margin: no nearer than before
            body = replace(body, radius=core + nearest, keep=nearest)
            notes.append("at which the path works" if works else "as near as the original path")
    elif original is not None and granted and kind is None and robot == UNLIMITED and not support:
        deep = -(keep + body.closest(original)[0])
        if deep >= 0.0:  # into a bin, say: no deeper than before
            body = replace(body, half=np.maximum(half - deep - 1e-6, 1e-6), radius=core, keep=0.0)
            notes.append("as deep as the original path")
    return replace(body, note=", ".join(notes))


def _works_on(body: Obstacle, path: Array, along: bool) -> bool:
    """Whether a path (N, 3) [m] stands still too near to an object, or a good part of it runs along there."""
    near = body.depth(path) < 0.0
    repeats = (np.diff(path, axis=0) == 0.0).all(axis=1)
    stands = near[:-1][repeats].any()
    return bool(stands) or (along and float(near.mean()) >= WORKED_ON)


WORKED_ON = 0.25
"""The share of a path that is too near to an object from which on it works along it, and may go on to do so."""
