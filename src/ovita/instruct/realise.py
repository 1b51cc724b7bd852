"""From frames to a policy: the order of the steps, what stays, and what cannot be done together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np

from ovita.errors import OvitaError
from ovita.instruct import frames as F
from ovita.instruct.builder import UNMOVED, PolicyBuilder, direction_word, mask_code
from ovita.instruct.figure_steps import FIGURE_STEPS
from ovita.instruct.frames import name_of
from ovita.instruct.object_steps import OBJECT_STEPS, surface_distance
from ovita.instruct.pace_steps import PACE_STEPS, on_the_way, stop_by
from ovita.instruct.path_steps import PATH_STEPS
from ovita.instruct.side_steps import SIDE_STEPS
from ovita.paths.geometry import closest_to_point
from ovita.paths.part import WHOLE, PathPart, both, outside
from ovita.paths.robot import Robot
from ovita.paths.scene import OPPOSITE, Frame, Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory
from ovita.policy.policy import TooMuch
from ovita.toolkit import judge

STEPS = {**PATH_STEPS, **OBJECT_STEPS, **SIDE_STEPS, **FIGURE_STEPS, **PACE_STEPS}

ORDER = (
    *("keep", "reverse", "mirror rotate tilt", "resize curve", "smooth", "straighten", "move", "quadrant height level"),
    *("side", "closer farther", "clearance", "via hop", "bound", "end", "avoid", "arrive", "zigzag wave shake"),
    *("pace", "cap floor", "nonstop"),
    *("extend return circle eight spiral hover wait stop", "trim waypoints"),
)
"""Path first, from the whole to its parts, so that no step disturbs an exact amount set by another; then speed; then,
in the order of the sentence, what happens at a place and may change the number of waypoints."""

RANK = {name: rank for rank, names in enumerate(ORDER) for name in names.split()}

PLACED = (F.Shift, F.Pace, F.Approach, F.Clearance, F.Height, F.Bound, F.Mirror, F.Rotate, F.Resize, F.Smooth, F.Curve)
"""Frames that leave alone what is to stay as it is."""

BLENDED = (F.Keep, F.Shift, F.Pace, F.Mirror, F.Rotate, F.Resize, F.Wait)
"""Frames that change nothing outside the part that they are about."""


_FIRST, _LAST = PathPart("first", amount=1), PathPart("last", amount=1)
_KEPT_ENDS = {"start": (_FIRST,), "goal": (_LAST,), "ends": (_FIRST, _LAST)}

CHANGING: dict[str, tuple[type[F.SemanticFrame], ...]] = {
    "speed": (F.Pace,), "path": (F.Shift, F.Approach, F.Reverse, F.Mirror, F.Rotate, F.Tilt, F.Resize),
}  # fmt: skip
"""The frames that change, on the whole path, what is to stay."""

PAIRS = ("faster slower", "rampup rampdown", "larger smaller", "more less", "closer farther")
CONTRARY = {**OPPOSITE, **{a: b for pair in PAIRS for a, b in permutations(pair.split())}}
"""Directions and changes of the same thing that rule each other out."""


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
    builder = PolicyBuilder(trajectory, scene, effort, robot, frames)
    keeps = [frame for frame in frames if isinstance(frame, F.Keep)]
    for one, other in conflicts(frames, scene.frame):
        first, second = (realise((frame,), trajectory, scene).plan for frame in (one, other))
        builder.ask(f"{' '.join(first)!r} and {' '.join(second)!r} contradict each other: which one is meant?")
    for number, frame in sorted(enumerate(frames), key=lambda pair: _rank(pair[1], builder)):
        builder.frame = number
        for one in _there(builder, frame):
            STEPS[type(one)](builder, _sparing(builder, one, keeps))
        if builder.question:
            return builder
    _settle(builder)
    if keeps:
        _restore(builder, keeps)
    if len(frames) > 1:
        _leave_to_later(builder)
    if frames:
        _leave_as_it_is(builder, all_stays=len(keeps) == len(frames))
    return builder


def _leave_as_it_is(builder: PolicyBuilder, *, all_stays: bool) -> None:
    """Promise that a path of which all is to stay, or which fulfils all that is asked for, is as before."""
    if all_stays:
        builder.add("", "" if builder.plan else "Leave the path as it is.", "expect_same_speed()")
        builder.held = builder.plan[: len(builder.frames)]
    if len(builder.frames) == len(builder.held):
        builder.add("", "", "expect_same_path()")


def _there(builder: PolicyBuilder, frame: F.SemanticFrame) -> Sequence[F.SemanticFrame]:
    """A frame as what it is on this path: where it stands still, passes over things, or is nowhere above the ground."""
    match frame:
        case F.Height(of="", level=F.Quantity(role="to") as level) if level.value > 0.0:
            return (_above_the_bottom(builder, frame, level),)
        case F.MoveEnd(offset=(), aim="", relation="to") if _ends_there_backwards(builder, frame):
            return ()
        case F.MoveEnd(end="goal", offset=(), aim="", relation="to") | F.StopAt(by=F.Quantity()):
            return (_at_its_stop(builder, frame),)
        case F.Hover(by=None):
            return _hovering(builder, frame)
        case F.Figure(place="", shape="circle" | "eight", part=PathPart(kind="after", places=(str(),))):
            return (_where_it_is_past(builder, frame),)
    return (frame,)


def _where_it_is_past(builder: PolicyBuilder, frame: F.Figure) -> F.SemanticFrame:
    """A figure after an object as one at the place where the path leaves what is near it."""
    item, path = builder.scene[frame.part.places[0]], builder.trajectory.positions
    apart, last = item.core(path).depth(path), len(path) - 1
    at = int(apart.argmin())
    clear = np.flatnonzero(apart[at:] > builder.scale.near(path, item))
    index = at + int(clear[0]) if len(clear) else (at + last) // 2
    return replace(frame, place=F.Quantity(float(index + 1), "waypoints", "at"), part=WHOLE)


def _above_the_bottom(builder: PolicyBuilder, frame: F.Height, level: F.Quantity) -> F.SemanticFrame:
    """A height above the ground of a path that is all below z = 0, where that is no ground: so much higher."""
    if float((builder.trajectory.positions @ builder.axis("up")).max()) >= 0.0:
        return frame
    builder.assume("z = 0 is above the path, so that it is so much higher than now")
    return F.Shift(offset=(("up", replace(level, role="by")),), part=frame.part, words=frame.words)


def _ends_there_backwards(builder: PolicyBuilder, frame: F.MoveEnd) -> bool:
    """Whether a path run backwards begins or ends by an object anyway: "the other way about, begin at the dock"."""
    item = builder.item(frame.place)
    if item is None or not any(isinstance(one, F.Reverse) and not one.part for one in builder.frames):
        return False
    path = builder.trajectory.positions
    away = item.distance(path[[0, -1]])
    end = 1 if frame.end == "start" else 0
    return bool(away[end] <= min(away[1 - end], builder.scale.near(path, item)))


def _at_its_stop(builder: PolicyBuilder, frame: F.MoveEnd | F.StopAt) -> F.SemanticFrame:
    """A goal at an object by which the path stands on the way is that stop; to stop short of it keeps so far away."""
    item = builder.item(frame.place)
    stop = stop_by(builder, item) if item is not None else ""
    if item is None or not stop or int(stop) >= len(builder.trajectory) - 2 or builder.has(F.Visit, F.Side):
        return frame
    if isinstance(frame, F.MoveEnd):
        builder.assume(f"the path stops at {item.name} on the way, and ends there")
        return F.StopAt(place=item.name, words=frame.words)
    builder.assume(f"the path stops at {item.name} and goes on, so that it stays that far away")
    far = replace(frame.by or F.Quantity(0.0), role="at_least")
    return F.Clearance(objects=(item.name,), distance=far, words=frame.words)


def _hovering(builder: PolicyBuilder, frame: F.Hover) -> Sequence[F.SemanticFrame]:
    """Waits in place of hovering above objects, where the path stands by them or passes over them."""
    items = [builder.scene[name] for name in frame.objects]
    if all(stop_by(builder, item) for item in items):
        return [F.Wait(place=item.name, duration=frame.duration, words=frame.words) for item in items]
    over = {item.name: passed_over(builder.trajectory.positions, item, builder.axis("up")) for item in items}
    known = {name: at for name, at in over.items() if at is not None}
    if len(known) < len(items):
        return (frame,)
    waits = []
    for name, at in sorted(known.items(), key=lambda pair: -pair[1]):  # those behind first: a wait adds waypoints
        builder.assume(f"the path passes over {name} at waypoint {at + 1}")
        place = F.Quantity(float(at + 1), "waypoints", "at")
        waits.append(F.Wait(place=place, duration=frame.duration, words=frame.words))
    return waits


def passed_over(path: Array, item: SceneObject, up: Array) -> int | None:
    """The waypoint of a path (N, 3) [m] on the way that is right over an object which is nearest elsewhere; or None."""
    rise = (path - item.position) @ up
    level = path - rise[:, None] * up
    aside = np.linalg.norm(level - item.position, axis=1)
    over = (item.cuboid.signed(level)[0] <= 0.0) & (rise > float(np.abs(up @ item.rotation) @ item.size) / 2.0)
    if item.dimensions is None or over[int(item.distance(path).argmin())]:
        return None
    over[[0, -1]] = False
    if not over.any():
        return None
    return int(np.where(over, aside, np.inf).argmin())


def _rank(frame: F.SemanticFrame, builder: PolicyBuilder) -> float:
    """When a frame's turn comes; what is straight, or slower at the end, is so on the path that a cut leaves."""
    match frame:
        case F.Pace():
            return _rank_of_pace(frame, builder)
        case F.Straighten() if not frame.part and builder.has(F.Trim):
            return RANK["trim"]
        case F.MoveEnd(relation="to") | F.Extend() if _is_cut(builder, frame):
            return RANK["trim"] + 0.5  # what is left of the path ends there
        case F.Straighten() if _is_led_through(frame.part, builder):
            return RANK["avoid"]  # from where it is once the path leads through there
        case F.MoveEnd(relation="to", aim="") if _is_passed_on_the_way(builder):
            return RANK["side"]  # what is passed on the way leaves the ends alone
        case F.Height() if frame.part or frame.level.role in ("at_least", "at_most"):
            return RANK["bound"]
        case F.Wait(place=F.Quantity(unit="waypoints") as number):
            return RANK["wait"] - number.value / (number.value + 1.0)  # those behind first: a wait adds waypoints
        case F.StopAt(place="" | "goal") if builder.has(F.Trim):
            return RANK["trim"] + 0.5
    return RANK[name_of(frame)]


def _rank_of_pace(frame: F.Pace, builder: PolicyBuilder) -> float:
    """When the turn of a change of speed comes."""
    if frame.amount is not None and frame.amount.unit == "s" and not (frame.part and builder.has(F.Return)):
        return len(ORDER)  # how long the way takes depends on all of it, but not on the way back
    if frame.change != "set" and builder.has(F.StopAt, F.Trim) and _at_the_end(frame.part):
        return len(ORDER)
    if frame.change in ("set", "constant") and not frame.part:
        return RANK["pace"] - 0.5  # what is said of a part holds there
    return RANK.get(frame.change, RANK["pace"])  # what another pace leaves beside a part holds, too


def _is_cut(builder: PolicyBuilder, frame: F.SemanticFrame) -> bool:
    """Whether the end of the path that a frame places is cut off."""
    cuts = ("first", "before") if isinstance(frame, F.MoveEnd) and frame.end == "start" else ("last", "after")
    return any(isinstance(one, F.Trim) and one.cut in cuts for one in builder.frames)


def _is_led_through(part: PathPart, builder: PolicyBuilder) -> bool:
    """Whether a part begins or ends where a path is led through."""
    return any(isinstance(f, F.Visit) and {*f.named} & {*part.places} for f in builder.frames)


def _is_passed_on_the_way(builder: PolicyBuilder) -> bool:
    """Whether objects are only passed, so that nothing but the ends moves the ends."""
    return builder.has(F.Side, F.Visit) and not builder.has(F.Approach, F.Clearance)


def _at_the_end(part: PathPart) -> bool:
    """Whether a part of the path is its end, but for waypoints, which keep the numbers that they had."""
    return part.kind == "last" and (part.amount is None or part.unit != "waypoints")


def _sparing(builder: PolicyBuilder, frame: F.SemanticFrame, keeps: Sequence[F.Keep]) -> F.SemanticFrame:
    """A frame that leaves alone what is to stay: parts of the path, and for a shift of a part the ends."""
    if not isinstance(frame, PLACED):
        return frame
    behind = PathPart("after", frame.part.places) if frame.part.kind == "before" else None
    frame = on_the_way(builder, frame) if isinstance(frame, F.Pace | F.Shift) else frame
    told = (frame.part, *frame.part.parts)
    kept = [part for part in _kept(frame, keeps) if part not in (*told, behind) and not _beside(part, frame.part)]
    rest = [left for part in kept if (left := outside(part)) not in told]
    parts = [*filter(None, (frame.part, *rest))]
    return replace(frame, part=both(*parts) if len(parts) > 1 else parts[0]) if rest else frame


def _kept(frame: F.SemanticFrame, keeps: Sequence[F.Keep]) -> list[PathPart]:
    """The parts of the path that a frame leaves alone: of a shift of a part also the ends."""
    paced = isinstance(frame, F.Pace)
    kept = _kept_parts(keeps, "part", *(("speed",) if paced and frame.part else ()))
    if frame.part and not paced:
        kept += [end for keep in keeps for end in _KEPT_ENDS.get(keep.what, ())]
    return kept


def _beside(kept: PathPart, part: PathPart) -> bool:
    """Whether what is to stay is what is not near the thing that a part is near, however near that is."""
    inner = kept.parts[0] if kept.kind == "outside" else WHOLE
    return inner.kind == part.kind == "near" and inner.places == part.places


def _kept_parts(keeps: Sequence[F.Keep], *what: str) -> list[PathPart]:
    """The parts of the path in which something is to stay."""
    return [keep.part for keep in keeps if keep.what in what and keep.part]


def _settle(builder: PolicyBuilder) -> None:
    """Keep every distance, pass every place and obey every height again where a later step has spoilt it."""
    passed = [] if builder.has(*CUTTING) else builder.passed
    for _ in range(3 if builder.moving > 1 else 0):
        _settle_once(builder, passed)
    for value, role, code in builder.limits:
        heights = builder.positions @ builder.axis("up")
        over = heights.max() - value if role == "at_most" else value - heights.min()
        if UNMOVED < over < builder.tolerance:  # more of it is another wish's
            builder.add(code)


def _settle_once(builder: PolicyBuilder, passed: Sequence[tuple[Array, str]]) -> None:
    for place, code in passed:
        if closest_to_point(builder.positions, place)[0] > builder.tolerance:
            builder.add(code)
    for item, metres, code in builder.distances:
        if surface_distance(item, builder.positions) < 0.99 * metres:
            builder.add(code)


CUTTING = (F.Trim, F.StopAt, F.Figure, F.Height, F.Bound)
"""Frames after which a place may rightly be passed no more, or which another bend would undo."""


def _restore(builder: PolicyBuilder, keeps: Sequence[F.Keep]) -> None:
    """Put back what is to stay as it is where a step has changed it all the same."""
    builder.frame = len(builder.frames)
    rows, given = builder.rows(), builder.trajectory.to_array()
    blended = all(isinstance(frame, BLENDED) for frame in builder.frames)
    masks = [] if blended else [mask_code(builder, part, "original") for part in _kept_parts(keeps, "part")]
    still = builder.kept - ({"goal"} if builder.goal_moved else set())
    for end, row, mask in (("start", 0, "first(original, 1)"), ("goal", -1, "last(original, 1)")):
        if end in still and abs(rows[row, :3] - given[row, :3]).max() > 1e-6:
            masks.append(mask)
    for mask in masks:
        builder.add(f"traj = keep_unchanged(traj, original, {mask})")


RELATIVE = ("moved", "length", "same_path")
"""Postconditions about so much more or less than before, by which a step can be judged alone."""


def _leave_to_later(builder: PolicyBuilder) -> None:
    """Promise no change that its step makes in full and the other steps change again; it is told."""
    try:
        rows, recorder = builder.run()
        for about, promise in zip(tuple(builder.promises), recorder.expectations, strict=True):
            if judge(promise, builder.trajectory.to_array(), np.asarray(rows), builder.scene).held:
                continue
            before, after = (np.asarray(builder.run(builder.steps[about] - back)[0]) for back in (1, 0))
            relative = promise.kind in RELATIVE or "offset" in promise.arguments
            if relative and judge(promise, before, after, builder.scene).held:
                builder.assume(f"{promise.text} by its own step; others change the path there, too")
                del builder.promises[about]
    except (TooMuch, OvitaError, ValueError, IndexError):
        return  # what does not run here is tried in the sandbox


def conflicts(frames: Sequence[F.SemanticFrame], axes: Frame) -> Iterator[tuple[F.SemanticFrame, F.SemanticFrame]]:
    """Pairs of frames that cannot both be met."""
    for one, other in permutations(frames, 2):
        if (
            (isinstance(one, F.Keep) and _kept_from(one, other, axes))
            or _opposed(one, other, axes)
            or _shunned(one, other)
            or _unbent(one, other)
        ):
            yield one, other


def _shunned(one: F.SemanticFrame, other: F.SemanticFrame) -> bool:
    """Whether a distance is to be kept all along from what is to be touched or passed through."""
    match one, other:
        case F.Clearance(distance=F.Quantity(role="at_least", value=least)), F.Visit(
            relation="at", aim="" | "surface" | "top"
        ):
            return least > 0 and not one.part and not _things(one).isdisjoint(_things(other))
    return False


def _unbent(one: F.SemanticFrame, other: F.SemanticFrame) -> bool:
    """Whether one makes a part straight that the other bends to and fro."""
    bent = isinstance(other, F.Figure) and other.shape in ("zigzag", "wave", "shake")
    return isinstance(one, F.Straighten) and bent and one.part == other.part


def _opposed(one: F.SemanticFrame, other: F.SemanticFrame, axes: Frame) -> bool:
    """Whether two frames of a kind, about the same thing and the same part, ask for opposite things."""
    if type(one) is not type(other) or one.part != other.part or _things(one).isdisjoint(_things(other)):
        return False
    if getattr(one, "place", "") != getattr(other, "place", ""):
        return getattr(one, "relation", "") == getattr(other, "relation", "") == "to"
    against = {CONTRARY.get(wish) for wish in _wishes(other, axes)}
    mine, theirs = one.quantities, other.quantities
    crowded = any(_no_room(mine[slot], theirs[slot]) for slot in mine.keys() & theirs.keys())
    return crowded or not against.isdisjoint(_wishes(one, axes))


def _things(frame: F.SemanticFrame) -> set[F.Place]:
    """The objects that a frame is about, or the end of the path, or what a height counts from."""
    return {*getattr(frame, "objects", (getattr(frame, "end", getattr(frame, "of", "")),))}


def _wishes(frame: F.SemanticFrame, axes: Frame) -> set[str]:
    """The change that a frame asks for, and the direction words of a shift or a side."""
    found = {str(getattr(frame, slot, "")) for slot in ("change", "sense")}
    if isinstance(frame, F.Side) and frame.direction != "other":
        found.add(direction_word(axes, frame.direction))
    for said, q in frame.offset if isinstance(frame, F.Shift | F.MoveEnd) else ():
        word = direction_word(axes, said)
        found.add(OPPOSITE[word] if q is not None and q.value < 0 else word)
    return found


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
    if keep.what in _KEPT_ENDS:
        return isinstance(frame, F.MoveEnd) and (keep.what == frame.end or "ends" in (keep.what, frame.end))
    if frame.part != keep.part:
        return False
    if keep.what == "height":
        return isinstance(frame, F.Shift) and not {"up", "down"}.isdisjoint(_wishes(frame, axes))
    return isinstance(frame, CHANGING.get(keep.what, ()))
