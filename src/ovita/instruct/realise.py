"""From frames to a policy: the order of the steps, what stays, and what cannot be done together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Literal

from ovita.instruct import frames as F
from ovita.instruct.builder import PolicyBuilder, direction_word
from ovita.instruct.figure_steps import FIGURE_STEPS
from ovita.instruct.frames import name_of
from ovita.instruct.notation import show
from ovita.instruct.object_steps import OBJECT_STEPS, surface_distance
from ovita.instruct.pace_steps import PACE_STEPS
from ovita.instruct.path_steps import PATH_STEPS
from ovita.paths.part import WHOLE, PathPart, both, outside
from ovita.paths.robot import Robot
from ovita.paths.scene import OPPOSITE, Frame, Scene
from ovita.paths.trajectory import Trajectory

STEPS = {**PATH_STEPS, **OBJECT_STEPS, **FIGURE_STEPS, **PACE_STEPS}

ORDER = (
    *("keep", "reverse", "mirror rotate tilt", "resize curve", "smooth", "straighten", "move", "quadrant height"),
    *("side", "closer farther", "clearance", "via hop", "bound", "end", "zigzag wave shake", "pace"),
    *("extend return circle eight spiral hover wait stop", "trim waypoints"),
)
"""Path first, from the whole to its parts, so that no step disturbs an exact amount set by another; then speed; then,
in the order of the sentence, what happens at a place and may change the number of waypoints."""

RANK = {name: rank for rank, names in enumerate(ORDER) for name in names.split()}

PLACED = (F.Shift, F.Pace, F.Approach, F.Clearance, F.Height, F.Bound, F.Mirror, F.Rotate, F.Resize, F.Smooth, F.Curve)
"""Frames that leave alone what is to stay as it is."""

BLENDED = (F.Keep, F.Shift, F.Pace, F.Mirror, F.Rotate, F.Resize)
"""Frames that change nothing outside the part that they are about."""


def realise(
    frames: Sequence[F.SemanticFrame],
    trajectory: Trajectory,
    scene: Scene,
    *,
    effort: int = 1,
    robot: Robot | None = None,
) -> PolicyBuilder:
    """Compose the policy for some frames.

    Args:
        frames: In the order of the sentence.
        trajectory: The trajectory to change.
        scene: Its surroundings.
        effort: How much to exceed the usual amounts where none is stated; 1 is as usual.
        robot: Whose body needs room beside objects where no distance is stated.

    Returns:
        The policy with its plan, parameters and assumptions; or `question`, where it cannot be done as it is said.

    Raises:
        UnknownObject: If a frame names an object that the scene does not have.
    """
    once = _once(frames)
    many = sum(isinstance(frame, F.Approach) for frame in once) > 2
    d = PolicyBuilder(trajectory, scene, 1 if many else effort, robot, once)
    for question in conflicts(once, scene.frame):
        d.ask(question)
    if once and all(isinstance(frame, F.Keep) for frame in once):
        d.ask("All of that is to stay as it is: what should change?")
    kept = [frame.part for frame in once if isinstance(frame, F.Keep) and frame.what == "part" and frame.part]
    ends = [part for f in once if isinstance(f, F.Keep) for part in _KEPT_ENDS.get(f.what, ())]
    for d.frame, frame in sorted(enumerate(once), key=lambda pair: _rank(pair[1], once)):
        if isinstance(frame, PLACED) and (kept or (ends and frame.part)):
            still = ends if frame.part and not isinstance(frame, F.Pace) else []
            frame = replace(frame, part=_apart(frame.part, [*kept, *still]))
        STEPS[type(frame)](d, frame)
        if d.question:
            return d
    _settle(d)
    _restore(d, once, kept)
    if once and len(d.held) == len(once):
        d.add("", "", "expect_same_path()")
    return d


_FIRST, _LAST = PathPart("first", amount=1), PathPart("last", amount=1)
_ALL_BUT: dict[PathPart, Literal["start", "goal"]] = {outside(_FIRST): "start", outside(_LAST): "goal"}
_KEPT_ENDS = {"start": (_FIRST,), "goal": (_LAST,), "ends": (_FIRST, _LAST)}


def _rank(frame: F.SemanticFrame, frames: Sequence[F.SemanticFrame]) -> float:
    """When a frame's turn comes; an end that moves is the one that is left after a cut."""
    cut = {"first": "start", "before": "start"}.get(frame.cut, "goal") if isinstance(frame, F.Trim) else ""
    if cut and any(isinstance(f, F.MoveEnd) and f.end in (cut, "ends") for f in frames):
        return RANK["end"] - 0.5
    if isinstance(frame, F.Straighten) and any(isinstance(f, F.MoveEnd) for f in frames):
        return RANK["end"] + 0.5
    if isinstance(frame, F.Height) and (frame.part or frame.level.role in ("at_least", "at_most")):
        return RANK["bound"]
    return RANK[name_of(frame)]


def _settle(d: PolicyBuilder) -> None:
    """Keep every distance again where keeping another one has spoilt it."""
    for _ in range(3 if len(d.distances) > 1 else 0):
        for item, metres, code in d.distances:
            if surface_distance(item, d.positions) < 0.99 * metres:
                d.add(code)


def _once(frames: Sequence[F.SemanticFrame]) -> list[F.SemanticFrame]:
    """Drop a second smoothing, and a constant speed beside the one that it is to be; other repetitions are intended."""
    set_to = [f.part for f in frames if isinstance(f, F.Pace) and f.change == "set" and f.factor is None]
    kept: list[F.SemanticFrame] = []
    for frame in frames:
        end = _ALL_BUT.get(frame.part) if isinstance(frame, F.Shift) else None
        if end:  # everything but the goal goes there
            kept.append(F.Keep(what=end))
            frame = replace(frame, part=WHOLE)
        again = isinstance(frame, F.Smooth) and any(isinstance(k, F.Smooth) for k in kept)
        stated = isinstance(frame, F.Pace) and frame.change == "constant" and frame.part in set_to
        if not again and not (stated and not frame.quantities):
            kept.append(frame)
    return kept


def _apart(part: PathPart, kept: Sequence[PathPart]) -> PathPart:
    """A part of the path without what is to stay as it is."""
    rest = [outside(other) for other in kept if other != part]
    parts = [*([part] if part else []), *rest]
    return parts[0] if len(parts) == 1 else both(*parts) if parts else WHOLE


def _restore(d: PolicyBuilder, frames: Sequence[F.SemanticFrame], kept: Sequence[PathPart]) -> None:
    """Put back what is to stay as it is where a step has changed it all the same."""
    d.frame = len(frames)
    if not any(isinstance(frame, F.Keep) for frame in frames):
        return
    rows, given = d.rows(), d.trajectory.to_array()
    masks = [d.part(part)[0] for part in kept if not all(isinstance(f, BLENDED) for f in frames)]
    if not d.goal_moved or "start" in d.kept:
        for end, i, mask in (("start", 0, "first(original, 1)"), ("goal", -1, "last(original, 1)")):
            if end in d.kept and abs(rows[i, :3] - given[i, :3]).max() > 1e-6 and not (end == "goal" and d.goal_moved):
                masks.append(mask)
    for mask in masks:
        d.add(f"traj = keep_unchanged(traj, original, {mask})")


def conflicts(frames: Sequence[F.SemanticFrame], axes: Frame) -> Iterator[str]:
    """Questions about frames that cannot both be met."""
    for one, other in combinations(frames, 2):
        if one.part == other.part and _opposed(one, other, axes):
            yield f"{show([one])!r} and {show([other])!r} contradict each other: which one is meant?"
    for frame in frames:
        for keep in frames:
            if isinstance(keep, F.Keep) and _kept_from(keep, frame, axes):
                yield f"{show([keep])!r} and {show([frame])!r} contradict each other: which one is meant?"


def _opposed(one: F.SemanticFrame, other: F.SemanticFrame, axes: Frame) -> bool:
    """Whether two frames about the same part ask for opposite things."""
    match one, other:
        case F.Shift(offset=ways), F.Shift(offset=others):
            return _against(axes, ways, others)
        case F.MoveEnd(offset=ways, relation=""), F.MoveEnd(offset=others, relation="") if one.end == other.end:
            return _against(axes, ways, others)
        case F.MoveEnd(relation="to"), F.MoveEnd(relation="to") if one.end == other.end and not one.part:
            return one.place != other.place
        case F.Approach(), F.Approach():
            return one.sense != other.sense and bool({*one.objects} & {*other.objects})
        case F.Clearance(), F.Clearance():
            return bool({*one.objects} & {*other.objects}) and _no_room(one.distance, other.distance)
        case F.Height(), F.Height() if one.of == other.of:
            return _no_room(one.level, other.level)
        case F.Pace(), F.Pace():
            if one.amount is not None and other.amount is not None and _no_room(one.amount, other.amount):
                return True
            return {one.change, other.change} in ({"faster", "slower"}, {"rampup", "rampdown"})
        case (F.Side(), F.Side()) if {*one.objects} & {*other.objects}:
            return direction_word(axes, one.direction) == OPPOSITE[direction_word(axes, other.direction)]
        case F.Curve(change=a), F.Curve(change=b):
            return a != b
        case F.Resize(change=a), F.Resize(change=b):
            return {a, b} == {"larger", "smaller"}
    return False


def _against(axes: Frame, ways: F.Offset, others: F.Offset) -> bool:
    against = {OPPOSITE[_way(axes, word, q)] for word, q in others}
    return any(_way(axes, word, q) in against for word, q in ways)


def _way(axes: Frame, word: str, q: F.Quantity | None) -> str:
    word = direction_word(axes, word)
    return OPPOSITE[word] if q is not None and q.value < 0 else word


def _no_room(one: F.Quantity, other: F.Quantity) -> bool:
    """Whether one of two bounds of the same unit rules out the other; a least and a greatest may be equal."""
    if one.unit != other.unit or not {one.role, other.role} & {"at_least", "at_most"}:
        return False
    low, high = sorted((one, other), key=lambda q: ("at_least", "to", "at", "by", "of", "at_most").index(q.role))
    return low.role != high.role and low.value > high.value + 1e-9


def _kept_from(keep: F.Keep, frame: F.SemanticFrame, axes: Frame) -> bool:
    """Whether what is to stay is what a frame changes."""
    whole = not frame.part
    match keep.what, frame:
        case (("start" | "goal" | "ends"), F.MoveEnd(end=end)):
            return keep.what == end or "ends" in (keep.what, end)
        case (("start" | "goal" | "ends"), F.Reverse()):
            return whole
        case "path", F.Shift() | F.Approach() | F.Reverse() | F.Mirror() | F.Rotate() | F.Tilt() | F.Resize():
            return whole and not keep.part
        case "speed", F.Pace():
            return whole and not keep.part
        case "height", F.Shift(offset=offset):
            return whole and not keep.part and any(_way(axes, w, q) in ("up", "down") for w, q in offset)
        case "part", F.Shift() | F.Pace():
            return keep.part == frame.part
    return False
