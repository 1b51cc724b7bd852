"""What was asked for as a whole, which the check of one frame has to know: what else moves, stays, or ends the path."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ovita.instruct import frames as F
from ovita.instruct.builder import direction_word
from ovita.instruct.stretches import contested, left_out
from ovita.paths.geometry import Mask, extent
from ovita.paths.part import WHOLE, PathPart, both, outside
from ovita.paths.scene import OPPOSITE, Scene
from ovita.paths.trajectory import Trajectory

SHARE_UNITS = ("%", "x")
"""Units of a quantity that is a share or a multiple of something."""

SHARES = {"first": 0.25, "last": 0.25, "middle": 1 / 3, "turns": 0.25}
"""The part of the waypoints that a part of the path means where it is left open."""

PATHLESS = (F.Keep, F.Pace, F.Wait, F.StopAt, F.Resample)
"""Frames that say nothing about where the path goes."""

_SPOTS = {"start": ("first", 0.0), "goal": ("last", 1.0), "middle": ("middle", 0.5)}
"""The part of the path that lies at a spot, and the share of it at which the spot is."""


@dataclass(frozen=True)
class Asked:
    """What was asked for as a whole.

    Args:
        frames: All of it.
        trajectory: The path before it.
        scene: What stands about.
    """

    frames: tuple[F.SemanticFrame, ...]
    trajectory: Trajectory
    scene: Scene

    def alone(self, frame: F.SemanticFrame) -> bool:
        """Whether no other frame moves the path."""
        return not any(other != frame and not isinstance(other, PATHLESS) for other in self.frames)

    def calm(self, frame: F.SemanticFrame) -> PathPart | None:
        """The part that a frame is about, without what ends that move take along."""
        ends = {f.end for f in self.frames if isinstance(f, F.MoveEnd)}
        if frame.part or not ends:
            return self.where(frame)
        return PathPart("last" if ends == {"start"} else "first", amount=0.4, unit="share")

    def beside(self, frame: F.SemanticFrame, *kinds: type[F.SemanticFrame]) -> list[Any]:
        """The other frames of some kinds."""
        return [f for f in self.frames if f is not frame and isinstance(f, kinds)]

    def has(self, *kinds: type[F.SemanticFrame]) -> bool:
        """Whether there are frames of some kinds."""
        return any(isinstance(frame, kinds) for frame in self.frames)

    def where(self, frame: F.SemanticFrame) -> PathPart | None:
        """The part that a frame is about, without what is to stay as it is."""
        kept = [f.part for f in self.frames if isinstance(f, F.Keep) and f.what == "part" and f is not frame]
        stops = [f for f in self.frames if isinstance(f, F.StopAt) and f.place]
        if isinstance(frame, F.Pace) and frame.part.kind == "last" and stops:
            end = stops_at(self, stops[0]) / (len(self.trajectory) - 1)
            return PathPart("range", amount=0.75 * end, until=end, unit="share")
        others = [*left_out(frame.part, self.frames, self.trajectory, self.scene), *self._contested(frame)]
        return self.part(shared(frame.part, *(outside(part) for part in (*kept, *others) if part != frame.part)))

    def _contested(self, frame: F.SemanticFrame) -> list[PathPart]:
        """What other frames have of the part that a frame is about."""
        ranges = contested(frame, self.frames, self.trajectory, self.scene, self._mask) if frame.part else []
        return [PathPart("indices", ranges=tuple(ranges), count=len(self.trajectory))] if ranges else []

    def _mask(self, part: PathPart) -> Mask:
        return (self.part(part) or WHOLE).mask(self.trajectory, self.scene)

    def part(self, part: PathPart | None) -> PathPart | None:
        """A part with what it leaves open filled in; None for the whole path."""
        return self._filled(part) if part else None

    def _filled(self, part: PathPart) -> PathPart:
        if part.parts:
            return replace(part, parts=tuple(map(self._filled, part.parts)))
        place = part.places[0] if part.places else ""
        kind, share = _SPOTS.get(place, ("", 0.0)) if isinstance(place, str) else ("", 0.0)
        if part.kind == "near" and kind:
            unit: Any = "share" if part.amount is None else "m"
            return self._filled(PathPart(kind, amount=part.amount, unit=unit))
        if part.kind in ("after", "before") and kind:
            begin, until = (share, None) if part.kind == "after" else (0.0, share)
            return PathPart("range", amount=begin, until=until, unit="share")
        if part.kind in SHARES and part.amount is None:
            return replace(part, amount=SHARES[part.kind], unit="share")
        if part.kind == "near" and part.amount is not None:
            return replace(part, of=part.of or "surface")
        return replace(part, direction=self.word(part.direction)) if part.direction else part

    def word(self, direction: str) -> str:
        """A direction or an axis as one of the frame's direction words."""
        return direction_word(self.scene.frame, direction)

    def metres(self, q: F.Quantity | None, whole: float | None = None) -> float | None:
        """A quantity in metres, a share being one of the path's extent or of another whole; None stays None."""
        if q is None:
            return None
        return q.value * (self.extent if whole is None else whole) if q.unit in SHARE_UNITS else q.value

    def offset(self, offset: F.Offset) -> dict[str, float | None]:
        """How far each way [m]; None where that is left open."""
        found: dict[str, float | None] = {}
        for said, q in offset:
            word, value = self.word(said), self.metres(q)
            found[OPPOSITE[word] if value is not None and value < 0 else word] = None if value is None else abs(value)
        return found

    @property
    def extent(self) -> float:
        """The diagonal of the path's bounding box [m]."""
        return extent(self.trajectory.positions)

    def distance(self, place: str) -> float:
        """The least distance of the path to an object's surface [m]."""
        fine = self.trajectory.resample(1000).positions
        return float(self.scene[place].distance(fine).min())

    def gap(self, name: str) -> float:
        """How near the path comes to an object's surface [m]; to its centre if its size is not known."""
        item = self.scene[name]
        if item.dimensions is None:
            return self.distance(name)
        return float(item.cuboid.closest(self.trajectory.positions)[0])

    def shift(self) -> dict[str, float]:
        """How far other frames shift the whole path, where they say it."""
        total: dict[str, float] = {}
        for frame in self.frames:
            if isinstance(frame, F.Shift) and not frame.part:
                for word, value in self.offset(frame.offset).items():
                    total[word] = total.get(word, 0.0) + (value or 0.0)
        return total


def shared(*parts: PathPart | None) -> PathPart | None:
    """What belongs to each of the parts that are named; None where there is none."""
    named = [part for part in parts if part]
    return both(*named) if len(named) > 1 else next(iter(named), None)


def place_of(place: F.Place, case: Asked) -> Any:
    """A place as checks take it: a name, an end, two objects that it is between, or a point (3,) [m]."""
    q = F.Quantity(0.5, "%") if place == "middle" else place
    if isinstance(q, F.Quantity):
        path = case.trajectory
        share = path.arc_length / max(path.length, 1e-9)
        by_unit = {"%": share, "x": share, "m": path.arc_length, "s": path.times}
        measured = by_unit.get(q.unit, np.arange(1, len(path) + 1))
        return path.positions[int(np.argmin(np.abs(measured - q.value)))].tolist()
    return {"between": list(q)} if isinstance(q, tuple) else q


def nearest_to(case: Asked, place: F.Place) -> int:
    """The waypoint nearest to a place."""
    path, centre = case.trajectory.positions, place_of(place, case)
    if isinstance(centre, dict):
        centre = sum(case.scene[name].position for name in centre["between"]) / 2
    elif isinstance(centre, str) and centre in case.scene:
        centre = case.scene[centre].position
    elif isinstance(centre, str):
        centre = {"start": path[0], "goal": path[-1]}[centre]
    return int(np.argmin(np.linalg.norm(path - np.asarray(centre), axis=1)))


def stops_at(case: Asked, frame: F.StopAt) -> int:
    """The waypoint at which a path ends that stops at a place, or so far before an object."""
    if frame.by is None or not isinstance(frame.place, str) or frame.place not in case.scene:
        return nearest_to(case, frame.place)
    near = case.scene[frame.place].distance(case.trajectory.positions) <= frame.by.value
    return int(np.argmax(near)) if near.any() else nearest_to(case, frame.place)
