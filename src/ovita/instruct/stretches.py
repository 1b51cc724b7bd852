"""Where one wish ends and the next begins: waypoints that two parts of a path share belong to one of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ovita.instruct import frames as F
from ovita.instruct.degrees import Scale
from ovita.paths.part import PathPart, between, near
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory


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
    if any(isinstance(frame, F.Keep) or (isinstance(frame, F.Pace) and _timed(frame)) for frame in about):
        return
    paced = any(isinstance(frame, F.Pace | F.NoStop) for frame in about)
    mine = np.flatnonzero(part.mask(trajectory, scene))
    for frame in frames:
        if not isinstance(frame, F.Keep) and _goes_on(mine, frame.part, trajectory, scene):
            yield frame.part
    if part.kind == "after":
        place = part.places[0]
        for frame in frames:
            if (isinstance(frame, F.Hop | F.Hover) and place in frame.objects) or _shaken(frame, place):
                yield near(place, Scale.of(trajectory).near(trajectory.positions, scene[place]))
            elif paced and isinstance(frame, F.Wait) and frame.place == place and frame.by is None:
                yield between(place, place)


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
