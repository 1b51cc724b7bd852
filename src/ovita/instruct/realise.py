"""From frames to a policy: the order of the steps, what stays, and what cannot be done together."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any, Literal

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
    builder = PolicyBuilder(trajectory, scene, 1 if many else effort, robot, once)
    keeps = [frame for frame in once if isinstance(frame, F.Keep)]
    for question in conflicts(once, scene.frame):
        builder.ask(question)
    if keeps and len(keeps) == len(once):
        builder.ask("All of that is to stay as it is: what should change?")
    for number, frame in sorted(enumerate(once), key=lambda pair: _rank(pair[1], once)):
        builder.frame = number
        STEPS[type(frame)](builder, _sparing(frame, keeps))
        if builder.question:
            return builder
    _settle(builder)
    if keeps:
        _restore(builder, once, keeps)
    if once and len(builder.held) == len(once):
        builder.add("", "", "expect_same_path()")
    return builder


def _kept_parts(keeps: Sequence[F.Keep]) -> list[PathPart]:
    return [frame.part for frame in keeps if frame.what == "part" and frame.part]


def _sparing(frame: F.SemanticFrame, keeps: Sequence[F.Keep]) -> F.SemanticFrame:
    """A frame that leaves alone what is to stay: parts of the path, and for a shift of a part the ends."""
    kept, ends = _kept_parts(keeps), [part for keep in keeps for part in _KEPT_ENDS.get(keep.what, ())]
    if not isinstance(frame, PLACED) or not (kept or (ends and frame.part)):
        return frame
    still = ends if frame.part and not isinstance(frame, F.Pace) else []
    return replace(frame, part=_apart(frame.part, [*kept, *still]))


_FIRST, _LAST = PathPart("first", amount=1), PathPart("last", amount=1)
_ALL_BUT: dict[PathPart, Literal["start", "goal"]] = {outside(_FIRST): "start", outside(_LAST): "goal"}
_KEPT_ENDS = {"start": (_FIRST,), "goal": (_LAST,), "ends": (_FIRST, _LAST)}


def _rank(frame: F.SemanticFrame, frames: Sequence[F.SemanticFrame]) -> float:
    """When a frame's turn comes; an end that moves is the one that is left after a cut."""
    moved = {f.end for f in frames if isinstance(f, F.MoveEnd)}
    match frame:
        case F.Trim(cut=cut) if moved & {"start" if cut in ("first", "before") else "goal", "ends"}:
            return RANK["end"] - 0.5
        case F.Straighten() if moved:
            return RANK["end"] + 0.5
        case F.Height(part=part, level=level) if part or level.role in ("at_least", "at_most"):
            return RANK["bound"]
    return RANK[name_of(frame)]


def _settle(builder: PolicyBuilder) -> None:
    """Keep every distance again where keeping another one has spoilt it."""
    for _ in range(3 if len(builder.distances) > 1 else 0):
        for item, metres, code in builder.distances:
            if surface_distance(item, builder.positions) < 0.99 * metres:
                builder.add(code)


def _once(frames: Sequence[F.SemanticFrame]) -> list[F.SemanticFrame]:
    """Drop a second smoothing, and a constant speed beside the one that it is to be; other repetitions are intended."""
    set_to = [f.part for f in frames if isinstance(f, F.Pace) and f.change == "set" and f.factor is None]
    kept: list[F.SemanticFrame] = []
    for frame in frames:
        smoothed = any(isinstance(known, F.Smooth) for known in kept)
        if (smoothed and isinstance(frame, F.Smooth)) or (_is_bare_constant(frame) and frame.part in set_to):
            continue
        kept += _without_end(frame)
    return kept


def _without_end(frame: F.SemanticFrame) -> Sequence[F.SemanticFrame]:
    """A shift of everything but an end as a shift of the whole, and the end stays."""
    end = _ALL_BUT.get(frame.part) if isinstance(frame, F.Shift) else None
    return (F.Keep(what=end), replace(frame, part=WHOLE)) if end else (frame,)


def _is_bare_constant(frame: F.SemanticFrame) -> bool:
    return isinstance(frame, F.Pace) and frame.change == "constant" and not frame.quantities


def _apart(part: PathPart, kept: Sequence[PathPart]) -> PathPart:
    """A part of the path without what is to stay as it is."""
    rest = [outside(other) for other in kept if other != part]
    parts = [*([part] if part else []), *rest]
    return parts[0] if len(parts) == 1 else both(*parts) if parts else WHOLE


def _restore(builder: PolicyBuilder, frames: Sequence[F.SemanticFrame], keeps: Sequence[F.Keep]) -> None:
    """Put back what is to stay as it is where a step has changed it all the same."""
    builder.frame = len(frames)
    rows, given = builder.rows(), builder.trajectory.to_array()
    blended = all(isinstance(frame, BLENDED) for frame in frames)
    masks = [] if blended else [builder.part(part)[0] for part in _kept_parts(keeps)]
    still = builder.kept - ({"goal"} if builder.goal_moved else set())
    for end, row, mask in (("start", 0, "first(original, 1)"), ("goal", -1, "last(original, 1)")):
        if end in still and abs(rows[row, :3] - given[row, :3]).max() > 1e-6:
            masks.append(mask)
    for mask in masks:
        builder.add(f"traj = keep_unchanged(traj, original, {mask})")


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
    contrary = _CONTRARY.get(type(one))
    return contrary is not None and type(one) is type(other) and contrary(one, other, axes)


def _opposed_ends(one: F.MoveEnd, other: F.MoveEnd, axes: Frame) -> bool:
    if one.end != other.end or one.relation != other.relation:
        return False
    if one.relation == "to":
        return not one.part and one.place != other.place
    return not one.relation and _against(axes, one.offset, other.offset)


def _opposed_paces(one: F.Pace, other: F.Pace, axes: Frame) -> bool:
    if one.amount is not None and other.amount is not None and _no_room(one.amount, other.amount):
        return True
    return {one.change, other.change} in ({"faster", "slower"}, {"rampup", "rampdown"})


def _common(one: Any, other: Any) -> bool:
    """Whether two frames are about the same object."""
    return not {*one.objects}.isdisjoint(other.objects)


def _opposed_sides(one: F.Side, other: F.Side, axes: Frame) -> bool:
    side, facing = direction_word(axes, one.direction), direction_word(axes, other.direction)
    return _common(one, other) and side == OPPOSITE[facing]


_CONTRARY: dict[type[F.SemanticFrame], Callable[[Any, Any, Frame], bool]] = {
    F.Shift: lambda one, other, axes: _against(axes, one.offset, other.offset),
    F.MoveEnd: _opposed_ends,
    F.Approach: lambda one, other, axes: one.sense != other.sense and _common(one, other),
    F.Clearance: lambda one, other, axes: _common(one, other) and _no_room(one.distance, other.distance),
    F.Height: lambda one, other, axes: one.of == other.of and _no_room(one.level, other.level),
    F.Pace: _opposed_paces,
    F.Side: _opposed_sides,
    F.Curve: lambda one, other, axes: one.change != other.change,
    F.Resize: lambda one, other, axes: {one.change, other.change} == {"larger", "smaller"},
}
"""When two frames of a kind, about the same part, ask for opposite things."""


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
    if keep.what == "part":
        return isinstance(frame, F.Shift | F.Pace) and keep.part == frame.part
    if isinstance(frame, F.MoveEnd):
        return keep.what in _KEPT_ENDS and (keep.what == frame.end or "ends" in (keep.what, frame.end))
    if frame.part or (keep.part and keep.what not in _KEPT_ENDS):
        return False
    if keep.what == "height":
        return isinstance(frame, F.Shift) and any(_way(axes, w, q) in ("up", "down") for w, q in frame.offset)
    return isinstance(frame, _CHANGES.get(keep.what, ()))


_MOVING = (F.Shift, F.Approach, F.Reverse, F.Mirror, F.Rotate, F.Tilt, F.Resize)
_CHANGES: dict[str, tuple[type[F.SemanticFrame], ...]] = {
    **dict.fromkeys(_KEPT_ENDS, (F.Reverse,)), "path": _MOVING, "speed": (F.Pace,),
}  # fmt: skip
"""The frames that change, on the whole path, what is to stay."""
