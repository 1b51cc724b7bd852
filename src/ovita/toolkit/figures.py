"""Draw a spiral, a circle or an eight, let a path swing from side to side, or shake it."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.geometry import Mask, runs, spacing
from ovita.paths.scene import RFU, Frame, SceneObject
from ovita.paths.trajectory import Array, arc_length
from ovita.toolkit import arguments
from ovita.toolkit.arguments import Place, Target, perpendicular, positive, smoothstep
from ovita.toolkit.catalogue import Recorder, operation
from ovita.toolkit.insertion import (
    along_arcs,
    course_headings,
    densified,
    distinct,
    dubins,
    evenly,
    inserted,
    level_heading,
)

PER_TURN = 24
"""The fewest waypoints on one turn of a loop."""

CLEARANCE = 0.05
"""How far a circle of no given radius stays from an object's bounding sphere [m]."""

TANGENTIAL = np.cos(np.radians(15.0))
"""A path that heads along a circle up to this cosine needs no curve onto it."""

CANDIDATES = 48
"""Places of a circle at which a curve onto it is tried."""

CUT = 0.02
"""Share of a circle's radius by which a curve onto it from outside may cut into it."""

MOST_TURNS = 100.0
"""The most turns that one call may ask for."""

MOST_WAVES = 500.0
"""The most waves that one call may ask for."""

PER_ZIGZAG = 4.0
"""The fewest segments on one wave of a zigzag: enough for a waypoint of its own at every corner."""

PER_SINUSOID = 8.0
"""The fewest segments on one wave of a sinusoid."""


@operation("Draw figures")
def spiral(
    traj: ArrayLike,
    at: Place = "goal",
    *,
    radius: float,
    turns: float = 3.0,
    height: float = 0.0,
    clockwise: bool = False,
    frame: Frame = RFU,
) -> Array:
    """Spiral out at a PLACE, rising by height; the path goes on.

    The spiral is Archimedean and level: after the share u of the turns it is u radius away from the waypoint and
    u height above it. It begins with the path's heading. From its end an arc, a line and an arc lead to the next
    waypoint and its heading; at the goal the spiral's end is the new goal.

    Args:
        traj: (N, 4); the result has the new waypoints inserted, no farther apart than the mean spacing
            and 24 a turn at least.
        radius: Distance of the spiral's end from that waypoint [m], > 0.
        turns: > 0, whole or not.
        height: How far the spiral rises [m]; negative: sinks.
        clockwise: Turn clockwise as seen from above.
    """
    rows = arguments.waypoints(traj)
    i = arguments.locate(rows, at)
    size, count = positive(radius, "radius"), positive(turns, "turns", MOST_TURNS)
    rise = arguments.number(height, "height")
    up = frame.direction("up")
    ahead = level_heading(rows, i, up, frame.direction("front"))
    side = _sense(clockwise) * np.cross(up, ahead)
    centre = rows[i, :3].copy()

    def curve(u: Array) -> Array:
        angle = 2.0 * np.pi * count * u[:, None]
        return np.asarray(centre + u[:, None] * (size * (np.cos(angle) * ahead + np.sin(angle) * side) + rise * up))

    step = spacing(rows[:, :3])
    points = evenly(curve, step, int(np.ceil(PER_TURN * count)))
    if i + 1 < len(rows):
        final = curve(np.array([1.0, 1.0 - 1e-6]))
        points = np.concatenate([points, _rejoined(rows, i, points[-1], final[0] - final[1], size / 2.0, frame)])
    return inserted(rows, i, points)


@operation("Draw figures")
def corkscrew(
    traj: ArrayLike,
    radius: float,
    *,
    turns: float = 3.0,
    where: ArrayLike | None = None,
    clockwise: bool = False,
    frame: Frame = RFU,
) -> Array:
    """Wind around the path, or around a part of it, in a helix.

    Start and goal stay: the helix opens over the first fifth of the part and closes over the last.

    Args:
        traj: (N, 4); where the waypoints are too sparse for the turns, more are inserted.
        radius: Of the helix [m], > 0.
        turns: > 0.
        clockwise: Turn clockwise as seen along the path.
    """
    rows = arguments.waypoints(traj)
    size, count = positive(radius, "radius"), positive(turns, "turns", MOST_TURNS)
    rows, stretches = _dense(rows, arguments.mask(where, len(rows)), PER_TURN * count)
    sideways = perpendicular(course_headings(rows)) * frame.direction("up")[2]
    upward = np.cross(sideways, arguments.headings(rows[:, :3]))
    for stretch in stretches:
        s = arc_length(rows[stretch, :3])
        u = s / s[-1]
        angle = 2.0 * np.pi * count * u[:, None] * _sense(clockwise)
        opened = size * smoothstep(np.minimum(u, 1.0 - u) / OPENING)
        rows[stretch, :3] += opened[:, None] * (np.cos(angle) * sideways[stretch] + np.sin(angle) * upward[stretch])
    return rows


OPENING = 0.2
"""The share of its part over which a helix opens, and over which it closes."""


@operation("Draw figures")
def circle(
    traj: ArrayLike,
    obj: Target,
    *,
    radius: float | None = None,
    turns: float = 1.0,
    clockwise: bool | None = None,
    frame: Frame = RFU,
) -> Array:
    """Go around an object from the nearest waypoint and back.

    The circle is level and at that waypoint's height. Where the path does not run into it, an arc, a line and an arc
    lead onto it without a corner, and back, so that the object is gone around so many times in all; after turns that
    are not whole, they lead from where the circle ends to the next waypoint. A circle with a radius at a waypoint
    itself lies beside it, and one around an object within which the path passes begins where the path comes out.

    Args:
        traj: (N, 4); the result has the new waypoints inserted, no farther apart than the mean spacing
            and 24 a turn at least.
        radius: [m], > 0; None for the waypoint's horizontal distance, but 5 cm beyond the object's bounding sphere
            at least.
        turns: > 0.
        clockwise: As seen from above; None for the sense that goes with the path's heading.
    """
    rows = arguments.waypoints(traj)
    centre = arguments.point(obj)
    count = positive(turns, "turns", MOST_TURNS)
    i = arguments.locate(rows, centre, "obj")
    up = frame.direction("up")
    inside = i
    size = obj.radius if isinstance(obj, SceneObject) else 0.0
    beside = np.cross(rows[i, :3] - centre, up)
    ring = positive(radius, "radius") if radius is not None else max(float(np.linalg.norm(beside)), size + CLEARANCE)
    i = _crossing(rows, i, centre, ring, up) if isinstance(obj, SceneObject) else i
    ahead = level_heading(rows, i, up, frame.direction("front"))
    away = rows[i, :3] - centre
    centre += (away @ up) * up
    away -= (away @ up) * up
    if radius is not None and not isinstance(obj, SceneObject) and float(np.linalg.norm(away)) <= 1e-9:
        side = np.cross(ahead, up) if clockwise else np.cross(up, ahead)  # around no thing: it begins on the circle
        centre, away = centre + positive(radius, "radius") * side, -positive(radius, "radius") * side
    distance = float(np.linalg.norm(away))
    outward = away / distance if distance > 1e-9 else np.cross(ahead, up)
    tangent = np.cross(up, outward)
    sense = _sense(tangent @ ahead < 0.0 if clockwise is None else clockwise)
    step, whole, goes_on = spacing(rows[:, :3]), count.is_integer(), i + 1 < len(rows)
    bend = ring / 3.0 if i != inside else ring if distance > ring else ring / 2.0
    # In the plane, with the centre at 0 and the waypoint on the first axis.
    here = np.array([distance, 0.0, _angle(ahead, outward, tangent)])
    straight_in = abs(ring - distance) <= 1e-9 and np.cos(here[2] - sense * np.pi / 2.0) >= TANGENTIAL
    there, begun = (np.zeros((0, 2)), 0.0) if straight_in else _onto_ring(here, ring, sense, bend, step)
    back, ended = there[:0], begun
    if whole and not straight_in:
        back, ended = _onto_ring(here + np.array([0.0, 0.0, np.pi]), ring, -sense, bend, step)
        back = np.concatenate([back[-2::-1], here[None, :2]])
    # What the ways to the circle and back go around the object counts.
    ways = [np.concatenate([here[None, :2], there]), np.concatenate([ring * _on_unit(ended), back])]
    outside = sum(map(_swept, ways)) if distance > CUT * ring else 0.0
    total = 2.0 * np.pi * count
    sweep = total if not whole or straight_in else sense * (ended - begun) % (2.0 * np.pi)
    while sweep + sense * outside < total - np.pi and whole:
        sweep += 2.0 * np.pi

    def curve(u: Array) -> Array:
        return np.asarray(ring * _on_unit(begun + sense * sweep * u))

    arc = evenly(curve, step, int(np.ceil(PER_TURN * sweep / (2.0 * np.pi))))
    points = centre + np.concatenate([there, arc, back]) @ np.stack([outward, tangent])
    if whole:
        points[-1:] = rows[i, :3]
    elif goes_on:
        points = np.concatenate([points, _rejoined(rows, i, points[-1], points[-1] - points[-2], ring / 2.0, frame)])
    return inserted(rows, i, points)


@operation("Draw figures")
def figure_eight(traj: ArrayLike, at: Place, *, size: float, frame: Frame = RFU) -> Array:
    """Drive an 8, size metres long, at a PLACE.

    The curve is Gerono's lemniscate, level and half as wide as long, crossing itself at the waypoint; it leaves and
    comes back with the path's heading.

    Args:
        traj: (N, 4); the result has the new waypoints inserted, no farther apart than the mean spacing
            and 48 at least.
        size: From tip to tip [m], > 0.
    """
    rows = arguments.waypoints(traj)
    i = arguments.locate(rows, at)
    half = positive(size, "size") / 2.0
    up = frame.direction("up")
    ahead = level_heading(rows, i, up, frame.direction("front"))
    side = np.cross(up, ahead)
    along, across = (ahead - side) / np.sqrt(2.0), (ahead + side) / np.sqrt(2.0)
    centre = rows[i, :3].copy()

    def curve(u: Array) -> Array:
        angle = 2.0 * np.pi * u[:, None]
        return np.asarray(centre + half * np.sin(angle) * (along + np.cos(angle) * across))

    points = evenly(curve, spacing(rows[:, :3]), 2 * PER_TURN)
    points[-1] = centre
    return inserted(rows, i, points)


@operation("Draw figures")
def zigzag(
    traj: ArrayLike,
    amplitude: float,
    *,
    waves: float = 6.0,
    where: ArrayLike | None = None,
    direction: str | None = None,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
) -> Array:
    """Zigzag sideways, or along a direction word.

    The displacement is a triangle wave over the path's length, level and perpendicular to the heading, to the right
    first; its corners are at waypoints.

    Args:
        traj: (N, 4); where the waypoints are too sparse for the waves, more are inserted.
    """
    if recorder is not None:
        recorder.corners = True
    return _rippled(traj, amplitude, waves, where, direction, frame, _triangle, PER_ZIGZAG)


@operation("Draw figures")
def wave(
    traj: ArrayLike,
    amplitude: float,
    *,
    waves: float = 4.0,
    where: ArrayLike | None = None,
    direction: str | None = None,
    frame: Frame = RFU,
) -> Array:
    """Swing sideways, or along a direction word, in a sine.

    Args:
        traj: (N, 4); where the waypoints are too sparse for the waves, more are inserted.
    """
    return _rippled(traj, amplitude, waves, where, direction, frame, np.sin, PER_SINUSOID)


@operation("Draw figures")
def noise(
    traj: ArrayLike,
    amount: float,
    *,
    seed: int = 0,
    where: ArrayLike | None = None,
    recorder: Recorder | None = None,
) -> Array:
    """Shake by up to amount metres.

    The displacements are uniform in a ball; the same seed shakes in the same directions, whatever the amount.

    Args:
        amount: [m], >= 0.
        seed: Of the random numbers, >= 0.
        where: Mask (N,), or None for all waypoints, start and goal included; it jumps at its edges.
    """
    rows = arguments.waypoints(traj)
    radius = arguments.number(amount, "amount", low=0.0)
    selected = arguments.mask(where, len(rows)) & (radius > 0.0)
    if recorder is not None:
        recorder.corners = True
    random = np.random.default_rng(arguments.integer(seed, "seed", 0, 2**31 - 1))
    away = random.normal(size=(len(rows), 3))
    away *= (np.cbrt(random.uniform(size=len(rows))) / np.maximum(np.linalg.norm(away, axis=1), 1e-12))[:, None]
    # Each repeat of a waypoint is shaken as the first, so that a dwell stays a dwell.
    away = away[distinct(rows)][np.cumsum(distinct(rows)) - 1]
    rows[selected, :3] += radius * away[selected]
    return rows


def _crossing(rows: Array, i: int, centre: Array, radius: float, up: Array) -> int:
    """Where a path that passes within a circle comes out of it, or into it if it never does; else waypoint i."""
    away = rows[:, :3] - centre
    flat = np.linalg.norm(away - (away @ up)[:, None] * up, axis=1)
    if flat[i] >= WITHIN * radius:
        return i
    behind, before = np.flatnonzero(flat[i:] >= radius), np.flatnonzero(flat[:i] >= radius)
    return int(i + behind[0]) if len(behind) else int(before[-1]) if len(before) else i


WITHIN = 0.9
"""The share of a circle's radius within which a path passes inside it."""


def _rejoined(rows: Array, i: int, end: Array, heading: Array, radius: float, frame: Frame) -> Array:
    """Points (M, 3) from a place and heading to the waypoint after i, which is not one of them, and its heading."""
    up, front = frame.direction("up"), frame.direction("front")
    side = np.cross(up, front)
    goal, onward = rows[i + 1, :3], level_heading(rows, i + 1, up, front)
    begin, target = (
        np.array([place @ front, place @ side, _angle(way, front, side)])
        for place, way in ((end, heading), (goal, onward))
    )
    flat = along_arcs(
        begin, next(dubins(begin, target[None], radius))[1], spacing(rows[:, :3]), 2.0 * np.pi / PER_TURN
    )[:-1]
    share = np.arange(1, len(flat) + 1) / (len(flat) + 1)
    height = (1.0 - share) * (end @ up) + share * (goal @ up)
    return np.asarray(flat @ np.stack([front, side]) + height[:, None] * up)


def _onto_ring(begin: Array, ring: float, sense: float, radius: float, step: float) -> tuple[Array, float]:
    """The shortest way from a pose (3,) onto a circle about 0, driven in a sense: points (M, 2) and its angle there."""
    angles = np.arange(CANDIDATES) * 2.0 * np.pi / CANDIDATES
    ends = np.column_stack([ring * _on_unit(angles), angles + sense * np.pi / 2.0])
    inside, finest = float(np.hypot(*begin[:2])) < ring, 2.0 * np.pi / PER_TURN
    tried: list[tuple[float, int, Array]] = []
    for bend in radius / np.array([1.0, 2.0, 5.0, 10.0, 20.0]):
        for k, parts in islice(dubins(begin, ends, bend), CANDIDATES if inside else None):
            length = float(parts[:, 1].sum())
            rough = np.concatenate([begin[None, :2], along_arcs(begin, parts, max(ring / 4.0, length / 64.0), finest)])
            if not inside and (np.hypot(*rough.T) >= ring * (1.0 - CUT)).all():
                return along_arcs(begin, parts, step, finest), float(angles[k])
            # From inside, the way that goes around least leaves most of the turn to the circle.
            tried.append((length + 2.0 * ring * abs(_swept(rough)), k, parts))
        if inside:
            break
    _, k, parts = min(tried, key=lambda found: found[0])
    return along_arcs(begin, parts, step, finest), float(angles[k])


def _on_unit(angles: Any) -> Array:
    """Points (K, 2) on the unit circle."""
    return np.column_stack([np.cos(angles), np.sin(angles)])


def _angle(vector: Array, first: Array, second: Array) -> float:
    """The angle of a vector in a plane, from the first of its axes to the second."""
    return float(np.arctan2(vector @ second, vector @ first))


def _swept(points: Array) -> float:
    """The angle that points (M, 2) sweep about 0."""
    angles = np.unwrap(np.arctan2(points[:, 1], points[:, 0]))
    return float(angles[-1] - angles[0]) if len(points) > 1 else 0.0


def _sense(clockwise: object) -> float:
    if not isinstance(clockwise, (bool, np.bool_)):
        raise ValueError(f"clockwise must be True or False, not {clockwise!r}")
    return -1.0 if clockwise else 1.0


def _rippled(
    traj: ArrayLike,
    amplitude: float,
    waves: float,
    where: ArrayLike | None,
    direction: str | None,
    frame: Frame,
    shape: Callable[[Array], Array],
    per_wave: float,
) -> Array:
    rows = arguments.waypoints(traj)
    swing = arguments.number(amplitude, "amplitude", low=0.0)
    count = positive(waves, "waves", MOST_WAVES)
    selected = arguments.mask(where, len(rows))
    axis = None if direction is None else arguments.direction(frame, direction)
    if swing == 0.0:
        return rows
    rows, stretches = _dense(rows, selected, per_wave * count)
    if axis is None:
        sideways = perpendicular(course_headings(rows)) * frame.direction("up")[2]
    else:
        sideways = np.tile(axis, (len(rows), 1))
    for stretch in stretches:
        offset = swing * shape(_phase(rows[stretch], count))
        touched = np.abs(offset) > 1e-9 * swing
        rows[stretch, :3][touched] += (offset[:, None] * sideways[stretch])[touched]
    return rows


def _dense(rows: Array, selected: Mask, segments: float) -> tuple[Array, list[slice]]:
    """Rows in which each run of a mask that has a length has so many segments at least, and where these runs are."""
    parts, stretches, done, total = [], [], 0, 0
    for a, b in runs(selected):
        length = float(arc_length(rows[a : b + 1, :3])[-1])
        if length > 0.0:
            part, _ = densified(rows[a : b + 1], np.ones(b + 1 - a, dtype=bool), length / segments)
            begin = total + a - done
            stretches.append(slice(begin, begin + len(part)))
            parts += [rows[done:a], part]
            done, total = b + 1, begin + len(part)
            if total - done > arguments.MOST_WAYPOINTS:
                raise ValueError(f"this would need more than {arguments.MOST_WAYPOINTS} new waypoints; ask for less")
    return np.concatenate([*parts, rows[done:]]), stretches


def _phase(part: Array, waves: float) -> Array:
    """Phase (M,) along a stretch from 0 to 2 pi waves, stretched a little so that each crest is at a waypoint."""
    s = arc_length(part[:, :3])
    crests = np.arange(0.5, 2.0 * waves, 1.0) * np.pi
    wanted = crests / (2.0 * np.pi * waves) * s[-1]
    after = np.clip(np.searchsorted(s, wanted), 1, len(s) - 1)
    nearest = np.where(wanted - s[after - 1] <= s[after] - wanted, s[after - 1], s[after])
    inner = (nearest > 0.0) & (nearest < s[-1]) & (np.diff(nearest, prepend=-1.0) > 0.0)
    knots = np.concatenate([[0.0], nearest[inner], [s[-1]]])
    return np.asarray(np.interp(s, knots, np.concatenate([[0.0], crests[inner], [2.0 * np.pi * waves]])))


def _triangle(phase: Array) -> Array:
    """The triangle wave with the zeros and the crests of the sine."""
    turn = phase / (2.0 * np.pi) + 0.25
    return np.asarray(1.0 - 4.0 * np.abs(turn - np.floor(turn) - 0.5))
