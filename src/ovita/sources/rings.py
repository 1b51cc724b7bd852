"""Circles that a way goes in: full turns around an object, or beside the way at a share of it, with ways in and out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from ovita.instruct.degrees import Degree
from ovita.instruct.frames import Figure, Quantity
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array, arc_length
from ovita.sources.laps import Lap
from ovita.sources.places import APPROACH, Anchor, obstacles, troubles
from ovita.text import number, the

PER_TURN = 36
"""Points of one turn."""

NO_TURN = 0.1
"""So little more than full turns, or less, is none at all [rad]."""

LOOPS: dict[Degree, float] = {"slight": 0.05, "moderate": 0.1, "large": 0.15}
"""Radius of a loop beside the way where none is said, as a share of the way's length."""

ABOUT_HALF = (0.5, 0.45, 0.55, 0.4, 0.6, 0.35, 0.65, 0.3, 0.7)
"""Shares of the way at which a loop in its middle may be."""


@dataclass(frozen=True)
class Ring:
    """A circle that a way is to go in.

    Args:
        figure: What was read of it.
        turns: How often around.
        radius: [m], or None where it is left open.
        gap: Distance from the object's corners that is told instead [m], or None.
        height: Over the ground [m], or None.
        over: Whether it is above the object, which its radius has not to keep clear of.
        index: How many of the places on the way come before it, or None where the words do not tell.
    """

    figure: Figure
    turns: float = 1.0
    radius: float | None = None
    gap: float | None = None
    height: float | None = None
    over: bool = False
    index: int | None = None


def ring_of(figure: Figure, lap: Lap | None, height: float | None, index: int | None) -> Ring | None:
    """The ring that a figure is, or None if it is none that can be planned.

    Args:
        figure: As it was read.
        lap: How it was told, if that is known.
        height: Over the ground [m], or None.
        index: See `Ring`.
    """
    wide, away = figure.radius or figure.size, lap is not None and lap.away
    turns = 1.0 if figure.turns is None else figure.turns.value
    if figure.shape != "circle" or turns <= 0.0 or (wide is not None and wide.unit != "m"):
        return None
    far = None if wide is None else wide.value / (2.0 if figure.radius is None else 1.0)
    over = lap is not None and lap.over
    return Ring(figure, turns, None if away else far, far if away else None, height, over, index)


def ringed(anchors: Sequence[Anchor], rings: Sequence[Ring], scene: Scene, robot: Robot) -> list[Anchor] | None:
    """A way's places with the points of its rings among them, or None if a ring cannot be there."""
    found = list(anchors)
    for ring in sorted(rings, key=lambda ring: -1 if ring.index is None else ring.index, reverse=True):
        name = str(ring.figure.place)
        around = _around(ring, scene[name], found, scene, robot) if name in scene.names else None
        beside = _beside(ring, found, scene, robot) if around is None and not ring.figure.named else None
        placed = around or beside
        if placed is None:
            return None
        k, points = placed
        found[k:k] = points
    return found


def _around(
    ring: Ring, item: SceneObject, anchors: Sequence[Anchor], scene: Scene, robot: Robot
) -> tuple[int, list[Anchor]] | None:
    """The points of a ring around an object and which place comes behind them, the shortest way; None if none is."""
    right, front, up = (scene.frame.direction(word) for word in ("right", "front", "up"))
    plane = np.stack([right, front])
    corners = item.rotation @ (np.array(list(product((-0.5, 0.5), repeat=3))) * item.size).T
    corner = float(np.linalg.norm(plane @ corners, axis=0).max())
    keep = max((body.keep for body in obstacles(scene, robot) if body.name == item.name), default=0.0)
    least = corner + max(keep, robot.radius + robot.obstacle_margin)
    radius = least + APPROACH if ring.gap is None else max(corner + ring.gap, least)
    if ring.radius is not None and ring.over:
        radius = ring.radius
    elif ring.radius is not None:  # what is less than the object needs is told from its surface
        radius = ring.radius if ring.radius >= least else corner + ring.radius
    legs = [ring.index + 1] if ring.index is not None else range(1, len(anchors))
    middle, best = plane @ item.position, None
    for k in legs:
        apart = float(np.linalg.norm(anchors[k].position - anchors[k - 1].position))
        if anchors[k - 1].label == anchors[k].label and apart > 0.0:  # within another ring
            continue
        one, other = (plane @ anchors[n].position - middle for n in (k - 1, k))
        for sense in _senses(ring):
            angles, length = _turning(one, other, radius, ring.turns, sense)
            more = length - float(np.linalg.norm(other - one))
            if best is None or more < best[0] - 1e-9:
                best = (more, k, angles)
    if best is None:
        return None
    _, k, angles = best
    height = ring.height
    if ring.over and height is None:
        height = float(item.position @ up + (up @ corners).max()) + least - corner + APPROACH
    if height is None or robot.planar:
        height = float((anchors[k - 1].position + anchors[k].position) @ up) / 2.0
    level = item.position + (height - item.position @ up) * up
    points = level + radius * (np.cos(angles)[:, None] * right + np.sin(angles)[:, None] * front)
    label = f"{_times(ring.turns)} around {the(item.name)} at a radius of {number(radius)} m"
    return _legal(k, points, Anchor(level, label, (item.name,)), scene, robot)


def _senses(ring: Ring) -> tuple[float, ...]:
    return {"ccw": (1.0,), "cw": (-1.0,)}.get(str(ring.figure.sense), (1.0, -1.0))


def _turning(one: Array, other: Array, radius: float, turns: float, sense: float) -> tuple[Array, float]:
    """The angles (M,) of a ring's points about its middle [rad], and how long the way from one place to another is [m].

    The ways in and out touch the ring; from a place inside it, they lead straight outward.
    """
    far = [max(float(np.linalg.norm(place)), 1e-9) for place in (one, other)]
    touching = [float(np.arccos(min(radius / d, 1.0))) for d in far]
    at = [float(np.arctan2(place[1], place[0])) for place in (one, other)]
    begin, end = at[0] + sense * touching[0], at[1] - sense * touching[1]
    onward = (sense * (end - begin) + NO_TURN) % (2.0 * np.pi) - NO_TURN if turns >= 1.0 else 0.0
    sweep = 2.0 * np.pi * turns + max(onward, 0.0)
    angles = begin + sense * np.linspace(0.0, sweep, int(np.ceil(PER_TURN * sweep / (2.0 * np.pi))) + 1)
    ends = radius * np.array([np.cos(angles[[0, -1]]), np.sin(angles[[0, -1]])]).T
    ways = np.linalg.norm(ends - np.stack([one, other]), axis=1).sum()
    return angles, float(ways) + radius * sweep


def _beside(ring: Ring, anchors: Sequence[Anchor], scene: Scene, robot: Robot) -> tuple[int, list[Anchor]] | None:
    """The points of a loop that touches the way at a share of it, and which place comes behind them."""
    place, told = ring.figure.place, 0.5
    if isinstance(place, Quantity) and place.unit in ("%", "x"):
        told = place.value
    elif place == "goal":
        told = 1.0
    elif place not in ("", "middle"):
        return None
    shares = ABOUT_HALF if told == 0.5 else (told,)
    tried = product(_widths(ring, anchors), shares, (0.0, 1.0) if told == 1.0 else (0.0,), _senses(ring))
    loops = (_loop(ring, radius, share, across, sense, anchors, scene) for radius, share, across, sense in tried)
    placed = (_legal(k, points, alike, scene, robot) for k, points, alike in filter(None, loops))
    return next((found for found in placed if found is not None), None)


def _widths(ring: Ring, anchors: Sequence[Anchor]) -> tuple[float, ...]:
    """The radii of a loop beside the way [m]: the one that is told, or what suits the way and, where need be, less."""
    length = float(arc_length(np.array([anchor.position for anchor in anchors]))[-1])
    wanted = LOOPS[ring.figure.degree or "moderate"]
    shares = (wanted, *(share for share in reversed(LOOPS.values()) if share < wanted))
    return tuple(share * length for share in shares) if ring.radius is None else (ring.radius,)


def _loop(
    ring: Ring, radius: float, share: float, across: float, sense: float, anchors: Sequence[Anchor], scene: Scene
) -> tuple[int, Array, Anchor] | None:
    """Which place comes behind a loop, its points, and how it is told; None where the way is upright.

    It goes along the way at first, or across it, where something stands behind the way's end.
    """
    corners, up = np.array([anchor.position for anchor in anchors]), scene.frame.direction("up")
    s = arc_length(corners)
    k = int(np.clip(np.searchsorted(s, share * s[-1]), 1, len(corners) - 1))
    leg = corners[k] - corners[k - 1]
    here = corners[k - 1] + (share * s[-1] - s[k - 1]) / (s[k] - s[k - 1]) * leg
    ahead = leg - (leg @ up) * up
    if np.linalg.norm(ahead) < 1e-9:
        return None
    ahead /= np.linalg.norm(ahead)
    ahead = np.cross(up, ahead) * sense if across else ahead
    angles = np.linspace(0.0, 2.0 * np.pi * ring.turns, int(np.ceil(PER_TURN * ring.turns)) + 1)[:, None]
    points = here + radius * (np.sin(angles) * ahead + (1.0 - np.cos(angles)) * sense * np.cross(up, ahead))
    return k, points, Anchor(here, f"{_times(ring.turns)} around a loop of radius {number(radius)} m")


def _legal(k: int, points: Array, alike: Anchor, scene: Scene, robot: Robot) -> tuple[int, list[Anchor]] | None:
    """The anchors at some points, unless the robot cannot be at one of them."""
    if any(troubles(point, scene, robot) for point in points):
        return None
    return k, [Anchor(point, alike.label, alike.objects) for point in points]


def _times(turns: float) -> str:
    return {1.0: "once", 2.0: "twice"}.get(turns, f"{turns:g} times")
