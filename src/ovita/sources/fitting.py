"""Wishes as they fit a way that is planned: shares of a stretch, radii from surfaces, distances, where it passes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ovita.instruct.degrees import Scale
from ovita.instruct.frames import Approach, Clearance, Figure, Quantity, SemanticFrame, Wait
from ovita.paths.trajectory import Trajectory
from ovita.sources.places import Location
from ovita.sources.planner import PlanRequest
from ovita.sources.route import Route
from ovita.sources.stops import same_place
from ovita.sources.wishes import Wish


def fitted(wish: Wish, route: Route, request: PlanRequest, path: Trajectory) -> Wish:
    """A wish as it fits a planned path.

    Args:
        wish: What is asked for besides the way.
        route: The way as it was told.
        request: What was planned.
        path: The plan.
    """
    wish = kept_clear(_on_the_stretch(wish, route, request, path), request)
    return wish.with_frames(_risen(_near_enough(frame, request, path), path) for frame in wish.frames)


def _near_enough(frame: SemanticFrame, request: PlanRequest, path: Trajectory) -> SemanticFrame:
    """A frame near an object with a radius that counts from its surface, where its middle is too far."""
    part = frame.part
    if part.kind != "near" or part.amount is None or part.places[0] not in request.scene.names:
        return frame
    item = request.scene[str(part.places[0])]
    far, gap = item.distance(path.positions), item.clearance(path.positions)
    k = int(far.argmin())
    if far[k] <= part.amount or gap.min() > part.amount:
        return frame
    return replace(frame, part=replace(part, amount=part.amount + float(far[k] - gap[k])))


def _risen(frame: SemanticFrame, path: Trajectory) -> SemanticFrame:
    """A spiral that rises by so much as suits the path, where it is told only that it rises."""
    if not isinstance(frame, Figure) or frame.rise is None or frame.rise.unit != "":
        return frame
    return replace(frame, rise=Quantity(Scale.of(path).step("moderate"), "m", "by"))


def kept_clear(wish: Wish, request: PlanRequest) -> Wish:
    """A wish to keep farther from objects as one for a distance: of a way that is planned there is no nearer one.

    Where no distance is told, it is one that suits the way and leaves its ends where they are.
    """
    robot, ends = request.robot, np.stack([request.start.position, request.goal.position])
    least, scale = robot.radius + robot.obstacle_margin, Scale(float(np.linalg.norm(np.ptp(request.corners, axis=0))))

    def kept(frame: SemanticFrame) -> SemanticFrame:
        if not isinstance(frame, Approach) or frame.sense != "farther":
            return frame
        far = frame.by
        if far is None:
            free = min(float(request.scene[name].clearance(ends).min()) for name in frame.objects)
            wanted = least + scale.step(frame.degree or "moderate")
            far = Quantity(float(f"{min(wanted, max(free, least)):.2g}"), "m")
        if far.unit not in ("m", ""):
            return frame
        return Clearance(part=frame.part, objects=frame.objects, distance=replace(far, role="at_least"))

    return wish.with_frames(map(kept, wish.frames))


def _on_the_stretch(wish: Wish, route: Route, request: PlanRequest, path: Trajectory) -> Wish:
    """A wish whose shares of a stretch are shares of the whole way: "to the cup and half way wait, then to the box"."""
    wish = _where_passed(wish, route, request, path)
    told = [place for place in (route.start, *route.via, route.goal) if place is not None]
    ends = [k for k, place in enumerate(told) if k and same_place(place, wish.stretch)]
    if not ends:
        return wish
    begin = 0.0 if ends[0] == 1 else _share_at(told[ends[0] - 1], request, path)
    end = 1.0 if ends[0] == len(told) - 1 else _share_at(told[ends[0]], request, path)

    def whole(frame: SemanticFrame) -> SemanticFrame:
        if not isinstance(frame, Wait) or not (frame.place == "middle" or isinstance(frame.place, Quantity)):
            return frame
        share = frame.place.value if isinstance(frame.place, Quantity) else 0.5
        return replace(frame, place=Quantity(begin + share * (end - begin), "%", "at"))

    return wish.with_frames(map(whole, wish.frames))


def _where_passed(wish: Wish, route: Route, request: PlanRequest, path: Trajectory) -> Wish:
    """A wish whose waits at an object are where the way passes it as it was told, where it comes nearer elsewhere."""

    def there(frame: SemanticFrame) -> SemanticFrame:
        passed = [p for p in route.via if [item.name for item in p.objects] == [getattr(frame, "place", None)]]
        if not isinstance(frame, Wait) or len(passed) != 1:
            return frame
        share, far = _share_at(passed[0], request, path), passed[0].objects[0].distance(path.positions)
        nearest = float(path.arc_length[int(far.argmin())] / path.arc_length[-1])
        return frame if abs(nearest - share) < SAME else replace(frame, place=Quantity(share, "%", "at"))

    return wish.with_frames(map(there, wish.frames))


SAME = 0.02
"""Shares of a path that are as good as one."""


def _share_at(place: Location, request: PlanRequest, path: Trajectory) -> float:
    """The share of a path's length at which it passes a place."""
    names = tuple(item.name for item in place.objects)
    there = next(a.position for a in request.via if a.objects == names and (names or a.label == place.label))
    return float(path.arc_length[int(np.linalg.norm(path.positions - there, axis=1).argmin())] / path.arc_length[-1])
