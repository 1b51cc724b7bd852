"""Where a wish ends: waypoints that two parts of a path share belong to one of them, and stops to what they are at."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ovita.instruct import frames as F
from ovita.instruct.degrees import Scale
from ovita.paths.geometry import Mask, runs
from ovita.paths.part import PathPart, between, near
from ovita.paths.scene import OPPOSITE, Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory, arc_length
from ovita.toolkit.approach import stays


def left_out(
    part: PathPart, frames: Sequence[F.SemanticFrame], trajectory: Trajectory, scene: Scene
) -> Iterator[PathPart]:
    """What is left out of a part because other frames say what happens there.

    "Slow until the cup, fast after it" share the waypoint at the cup, which is where the second begins; "wait at the
    cup, then no stop" and "jump over the cup, then keep one height" do something at the place that the rest follows.

    Args:
        part: A part along the path; nothing is left out of others.
        frames: All that is asked for.
        trajectory: The path, on which the parts are.
        scene: Its surroundings.
    """
    if part.kind not in ("before", "between", "after") or not _among(part, scene):
        return
    about = [frame for frame in frames if frame.part == part]
    if any(isinstance(frame, F.Keep) for frame in about):
        yield from _done_at(part, frames, trajectory, scene)
        return
    if any(isinstance(frame, F.Pace) and _timed(frame) for frame in about):
        return
    mine = np.flatnonzero(part.mask(trajectory, scene))
    changing = (frame.part for frame in frames if not isinstance(frame, F.Keep))
    yield from (other for other in changing if _goes_on(mine, other, trajectory, scene))
    if part.kind == "after":
        paced = any(isinstance(frame, F.Pace | F.NoStop) for frame in about)
        yield from _where_it_begins(str(part.places[0]), frames, trajectory, scene, paced=paced)


def _where_it_begins(
    place: str, frames: Sequence[F.SemanticFrame], trajectory: Trajectory, scene: Scene, *, paced: bool
) -> Iterator[PathPart]:
    """What is done at the place after which a part begins: a jump, hovering, shaking, or a wait before another pace."""
    for frame in frames:
        if (isinstance(frame, F.Hop | F.Hover) and place in frame.objects) or _shaken(frame, place):
            yield near(place, Scale.of(trajectory).near(trajectory.positions, scene[place]))
        elif paced and isinstance(frame, F.Wait) and frame.place == place and frame.by is None:
            yield between(place, place)


def _done_at(
    part: PathPart, frames: Sequence[F.SemanticFrame], trajectory: Trajectory, scene: Scene
) -> Iterator[PathPart]:
    """What is near the places at which a part that is to stay begins or ends, where something is done there."""
    for place in part.places:
        if any(_is_done_at(frame, place) for frame in frames):
            yield near(place, Scale.of(trajectory).near(trajectory.positions, scene[place]))


def _is_done_at(frame: F.SemanticFrame, place: F.Place) -> bool:
    """Whether a frame changes what is near a place."""
    if frame.part:
        return not isinstance(frame, F.Keep) and frame.part.kind == "near" and place in frame.part.places
    return isinstance(frame, ON_THE_SPOT) and place in frame.named


ON_THE_SPOT = (F.Wait, F.StopAt, F.Hover, F.Hop, F.Visit, F.Side, F.Figure)
"""Frames about a place, on the way to which the path or its speed changes already."""


def _shaken(frame: F.SemanticFrame, place: F.Place) -> bool:
    """Whether the path shakes at a place, which bends it on both sides of it."""
    return isinstance(frame, F.Figure) and frame.shape == "shake" and frame.place == place


def _goes_on(mine: np.ndarray, other: PathPart, trajectory: Trajectory, scene: Scene) -> bool:
    """Whether another part begins at the waypoint at which this one (indices) ends."""
    if other.kind not in ("between", "after") or not _among(other, scene):
        return False
    theirs = np.flatnonzero(other.mask(trajectory, scene))
    return len(mine) > 1 and len(theirs) > 1 and bool(mine[-1] == theirs[0])


def _among(part: PathPart, scene: Scene) -> bool:
    """Whether a part is told by objects of the scene alone."""
    return all(isinstance(place, str) and place in scene for place in part.places)


def _timed(frame: F.Pace) -> bool:
    """Whether a pace is so many seconds, which are counted from waypoint to waypoint."""
    return frame.amount is not None and frame.amount.unit == "s"


def contested(
    frame: F.SemanticFrame,
    frames: Sequence[F.SemanticFrame],
    trajectory: Trajectory,
    scene: Scene,
    mask: Callable[[PathPart], Mask],
) -> list[tuple[int, int]]:
    """The waypoints of a frame's part that other frames have, as ranges; none if nothing else of it would be left.

    What is near a thing belongs to it and not to what lies before, after or between things, and what is near two
    things to the nearer one: "crawl past the ramp, then 0.6 m/s", "below 60 cm at the duct, above 1 m at the pallet".

    Args:
        frame: One of the frames, with a part.
        frames: All that is asked for.
        trajectory: The path.
        scene: Its surroundings.
        mask: Which waypoints a part means.
    """
    mine, part = mask(frame.part), frame.part
    theirs = np.zeros_like(mine)
    for other in frames:
        if not _is_near(other.part, scene) or not _at_odds(frame, other):
            continue
        there = mine & mask(other.part)
        if _is_near(part, scene):
            here, beside = (scene[one.places[0]].distance(trajectory.positions) for one in (part, other.part))
            there &= beside < here
        theirs |= there
    return [*runs(theirs)] if (mine & ~theirs).any() else []


def _is_near(part: PathPart, scene: Scene) -> bool:
    """Whether a part is what is near an object of the scene."""
    return part.kind == "near" and _among(part, scene)


def _at_odds(one: F.SemanticFrame, other: F.SemanticFrame) -> bool:
    """Whether two frames cannot both hold at a waypoint: two speeds, two heights, two shifts along an axis."""
    if one.part == other.part or not one.part:
        return False
    match one, other:
        case F.Pace(), F.Pace():
            alike = one.change == other.change and one.change != "set"
            return not (alike or _timed(one) or _timed(other) or one.change.startswith("ramp"))
        case F.Height() | F.OneHeight(), F.Height() | F.OneHeight():
            roles = [frame.level.role if isinstance(frame, F.Height) else "" for frame in (one, other)]
            return roles not in (["at_least"] * 2, ["at_most"] * 2)
        case F.Shift(), F.Shift():
            axes = [{said.lstrip("-") for said, _ in frame.offset} for frame in (one, other)]
            return any({*axes[0]} & {word, OPPOSITE.get(word, word)} for word in axes[1])
    return False


def near_without_stays(
    item: SceneObject, reach: float, trajectory: Trajectory, up: Array
) -> tuple[float, tuple[tuple[int, int], ...]]:
    """How far from an object a shift near it reaches [m], and what it leaves alone there, as ranges.

    That is start, goal and stops that are not at the object, and what is beyond them. Where the path passes over or
    under it, only that is at it.

    Args:
        item: The object.
        reach: How far from it a shift would reach otherwise [m].
        trajectory: The path.
        up: The unit vector (3,) of up.
    """
    rows, path, scale = trajectory.to_array(), trajectory.positions, Scale.of(trajectory)
    level = path - ((path - item.position) @ up)[:, None] * up
    distance, gap = item.core(path).depth(path), item.cuboid.signed(level)[0]
    if gap.min() > 0.0:
        gap = item.cuboid.signed(path)[0]
    at = gap <= BESIDE * max(float(gap.min()), 0.0) + ROOM * scale.extent
    aside = stays(rows) & ~at
    if not (aside & (distance <= reach)).any():
        return reach, ()
    nearer = distance < float(distance[at].min())
    reach = scale.near(path[~nearer], item)
    within = distance <= reach
    left = within & (aside | nearer)
    s = arc_length(path)
    for a, b in runs(nearer):  # on the way from an end to where it passes over the thing, half is enough to get there
        if (a == 0) != (b == len(path) - 1):
            half = (s[a] + s[b]) / 2.0
            left[a : b + 1] &= aside[a : b + 1] | ((s[a : b + 1] <= half) == (a == 0))
    for a, b in runs(within & ~left):
        left[a : b + 1] |= not at[a : b + 1].any()
    return reach, tuple(runs(left))


BESIDE, ROOM = 1.15, 0.003
"""How many times as far off as the nearest, and what share of the path's extent beyond, a stop is not at an object."""
