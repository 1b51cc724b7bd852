"""Steps that say where the path goes: shifts, ends, heights and bounds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ovita.instruct import frames as F
from ovita.instruct.builder import PolicyBuilder, aiming, argument, short
from ovita.instruct.lexicon import Degree, nice
from ovita.paths.scene import OPPOSITE, SceneObject
from ovita.paths.trajectory import Array
from ovita.policy.source import Role
from ovita.toolkit.approach import extent

APPROACH: dict[Degree, float] = {"slight": 0.25, "moderate": 0.5, "large": 0.75}
"""Share of the distance to an object by which "closer" comes closer."""

SIZE: dict[Degree, float] = {"slight": 0.06, "moderate": 0.12, "large": 0.22}
"""Size of a new shape as a share of the path's extent."""

MARGIN = 0.05
"""Least distance from the surface of an object at which a path ends beside or on it [m]."""

BESIDE: Mapping[str, F.Direction | None] = {"above": "up", "below": "down", "behind": "back", "beside": None}
"""Where beside an object an end is, by a frame's aim; None for the side that is nearest."""

TURNED = (F.Mirror, F.Rotate, F.Tilt, F.Resize, F.Quadrant, F.Reverse, F.Trim, F.Height)
"""Frames after which an end is no longer where shifts alone would take it."""

TO_THE = {"left": "to the left", "right": "to the right", "front": "to the front", "back": "back"}
OF = {"left": "left of", "right": "right of", "front": "in front of", "back": "behind", "up": "above", "down": "below"}


@dataclass(frozen=True)
class _Shifted:
    """An offset's parameters and metres by direction word, and words such as "0.2 m to the left"."""

    knobs: Mapping[str, str]
    metres: Mapping[str, float]
    words: str

    @property
    def code(self) -> str:
        return _arguments(self.knobs)


def _arguments(expressions: Mapping[str, str]) -> str:
    return ", ".join(f"{direction}={expression}" for direction, expression in expressions.items())


def degree(frame: F.SemanticFrame) -> Degree:
    """How much, where no number says so."""
    return frame.degree or "moderate"


def size(builder: PolicyBuilder, frame: F.SemanticFrame, q: F.Quantity | None, what: str, share: float = 1.0) -> float:
    """A length that is stated, or one that suits the scene [m]."""
    if q is not None:
        return builder.metres(q, builder.scale.extent, f"as {what}")
    value = nice(share * SIZE[degree(frame)] * builder.scale.extent)
    builder.assume(f"{what} is {value:g} m in this scene")
    return value


def tolerance(builder: PolicyBuilder) -> float:
    """How near counts as passing through a place [m]."""
    return nice(0.02 * builder.scale.extent)


def usual_gap(builder: PolicyBuilder) -> float:
    """How far beside or above a thing is close to it [m]."""
    return nice(max(MARGIN, 0.3 * builder.scale.step("slight")))


def spot(builder: PolicyBuilder, place: F.Place, default: str = "goal") -> tuple[str, str]:
    """Code of the place of a waypoint, and words for it."""
    if isinstance(place, tuple):
        a, b = (builder.scene[name] for name in place)
        return f"midpoint({builder.ref(a)}, {builder.ref(b)})", f"closest to the midpoint of {a.name} and {b.name}"
    if isinstance(place, F.Quantity):
        return _along(builder, place)
    place = place or default
    if place in F.SPOTS:
        return {"middle": "0.5"}.get(place, repr(place)), f"at the {place}" if place != "middle" else "in the middle"
    item = builder.scene[place]
    return builder.ref(item), f"closest to {item.name}"


def _along(builder: PolicyBuilder, q: F.Quantity) -> tuple[str, str]:
    """A waypoint by number, or the one so far along the path."""
    n = len(builder.trajectory)
    if q.unit in ("%", "x"):
        return f"{min(max(q.value, 0.0), 1.0):g}", f"at {q.value:.0%} of the path"
    if q.unit in ("m", "s"):
        measured = builder.trajectory.arc_length if q.unit == "m" else builder.trajectory.times
        return str(int(np.argmin(np.abs(measured - q.value)))), f"{q.value:g} {q.unit} after the start"
    if not 1 <= q.value <= n:
        builder.ask(f"The path has {n} waypoints, counted from 1: which one is meant by {q.value:g}?")
    builder.assume("waypoints are counted from 1")
    which = int(np.clip(q.value, 1, n))
    return str(which - 1), f"at waypoint {which}"


def target(builder: PolicyBuilder, place: F.Place) -> tuple[str, str, Array]:
    """Code of a point to go to, words for it, and the point itself (3,) [m]."""
    code, words = spot(builder, place)
    if isinstance(place, tuple):
        a, b = (builder.scene[name] for name in place)
        return code, f"the midpoint of {a.name} and {b.name}", (a.position + b.position) / 2.0
    if (item := builder.item(place)) is not None:
        return code, item.name, item.position
    rows = builder.positions
    if place in ("start", "goal"):
        row = 0 if place == "start" else -1
        return f"traj[{row}, :3]", f"the {place}", rows[row]
    share = place.value if isinstance(place, F.Quantity) and place.unit in ("%", "x") else 0.5
    i = int(code) if code.isdigit() else round(share * (len(rows) - 1))
    return f"traj[{i}, :3]", words.removeprefix("at ").replace("in the middle", "the middle"), rows[i]


def aimed_target(builder: PolicyBuilder, place: F.Place, aim: F.Aim) -> tuple[str, str]:
    """Code of a point to go to and words for it, with what of an object is meant."""
    code, words, _ = target(builder, place)
    return code + aiming(aim), aimed_at(builder, words, aim, builder.item(place))


def aimed_at(builder: PolicyBuilder, words: str, aim: F.Aim, item: SceneObject | None) -> str:
    """Words for what of an object is meant; without its dimensions there is the centre only."""
    if aim and item is not None and item.dimensions is None:
        builder.assume(f"the size of {item.name} is not known, so its position stands for its {aim}")
    return f"the {aim} of {words}" if aim else words


def _offset(builder: PolicyBuilder, frame: F.SemanticFrame, offset: F.Offset, prefix: str = "") -> _Shifted:
    knobs: dict[str, str] = {}
    words, amounts = [], {}
    for said, q in offset:
        direction, value = _way(builder, frame, said, q)
        if OPPOSITE[direction] in knobs or direction in knobs:
            builder.ask(f"Both {direction} and {OPPOSITE[direction]}: which way should it go?")
        amounts[direction], toward = value, TO_THE.get(direction, direction)
        knobs[direction] = builder.knob(
            f"{prefix}{direction}", value, "by", f"shift {toward}", said, direction=direction
        )
        words.append(f"{value:g} m {toward}")
    return _Shifted(knobs, amounts, " and ".join(words))


def _way(builder: PolicyBuilder, frame: F.SemanticFrame, said: str, q: F.Quantity | None) -> tuple[str, float]:
    """A direction and how far along it [m], stated or as far as suits the scene; never less than 0."""
    direction = builder.word(said)
    if q is None:
        value = builder.scale.step(degree(frame))
        much = {"slight": "a little ", "moderate": "", "large": "much "}[degree(frame)]
        builder.assume(f'"{much}{direction}" is {value:g} m in this scene')
    else:
        value = builder.metres(q, builder.scale.extent, direction)
    if value < 0:
        direction, value = OPPOSITE[direction], -value
    if value == 0:
        builder.ask(f"0 m {TO_THE.get(direction, direction)} moves nothing: how far should it go?")
    return direction, value


def shift(builder: PolicyBuilder, frame: F.Shift) -> None:
    """Shift the path or a part of it; ends that are to stay do."""
    if not frame.offset:
        builder.ask("Which way should the path go?")
        return
    offset = _offset(builder, frame, frame.offset)
    where, part = builder.part(frame.part)
    ends = sorted(builder.kept & {"start", "goal"})
    if where:
        builder.add(
            f"traj = move(traj, {offset.code}, where={where})",
            f"Shift the path {offset.words}{part}.",
            f"expect_moved({offset.code}, where={where})",
        )
    elif ends:
        kept = "both" if len(ends) == 2 else ends[0]
        stay = f"the {' and the '.join(ends)} stay{'s' if len(ends) == 1 else ''}"
        builder.add(
            f"traj = move(traj, {offset.code}, keep={kept!r})",
            f"Shift the path {offset.words}; {stay}.",
            f"expect_moved({offset.code})",
        )
    else:
        _shift_all(builder, offset, {builder.word(said) for said, q in frame.offset if q is not None})


def _shift_all(builder: PolicyBuilder, offset: _Shifted, stated: set[str]) -> None:
    """Shift the whole path; later steps leave the directions alone whose amounts are stated."""
    for direction, name in offset.knobs.items():
        builder.shifts.setdefault(direction, []).append(name)
    builder.exact |= {direction for direction in offset.knobs if stated & {direction, OPPOSITE[direction]}}
    total = {direction: " + ".join(names) for direction, names in builder.shifts.items()}
    promise = f"expect_moved({_arguments(total)})"
    builder.add(f"traj = move(traj, {offset.code})", f"Shift the whole path {offset.words}.", ends={"shift": promise})


def _with_shift(builder: PolicyBuilder, knobs: Mapping[str, str], *, own: bool) -> dict[str, str]:
    """Where an end lies from its original place: its own directions, and the shift of the whole path.

    With `own`, an end's own direction overrides the shift along that axis; without, the two add up.
    """
    total = {direction: name + ("" if own else builder.shifted(direction)) for direction, name in knobs.items()}
    for direction in builder.shifts:
        if direction not in total and OPPOSITE[direction] not in total:
            total[direction] = builder.shifted(direction).removeprefix(" + ")
    return total


def _negated(code: str) -> str:
    return code.replace(" + ", " ~ ").replace(" - ", " + ").replace(" ~ ", " - ")


def move_end(builder: PolicyBuilder, frame: F.MoveEnd) -> None:
    """Shift an end, or bring it to, toward or away from a place; the path bends with it."""
    for end in ("start", "goal") if frame.end == "ends" else (frame.end,):
        builder.goal_moved = builder.goal_moved or end == "goal"
        if frame.relation == "to":
            _end_to(builder, frame, end)
        elif frame.relation:
            _end_aimed(builder, frame, end)
        elif frame.level is not None:
            _end_level(builder, frame, frame.level, end)
        elif frame.offset:
            _end_shifted(builder, frame, end)
        else:
            builder.ask(f"Where should the {end} go?")


def _move_end(builder: PolicyBuilder, end: str, arguments: str, plan: str, promise: str) -> None:
    """The step that moves an end, and its promise, by the arguments of expect_start or expect_goal, or ""."""
    builder.add(
        f"traj = move_{end}(traj, {arguments})", plan, ends={end: f"expect_{end}({promise})" if promise else ""}
    )


def _end_shifted(builder: PolicyBuilder, frame: F.MoveEnd, end: str) -> None:
    """Shift an end by its own offset, which overrides what the whole path was shifted by along the same axis."""
    own = _offset(builder, frame, frame.offset, f"{end}_")
    undone = {direction: name + _negated(builder.shifted(direction)) for direction, name in own.knobs.items()}
    promise = "" if builder.has(*TURNED) else _arguments(_with_shift(builder, own.knobs, own=True))
    plan = f"Shift the {end} {own.words}; the path bends towards it."
    _move_end(builder, end, _arguments(undone), plan, promise)


def _level(builder: PolicyBuilder, q: F.Quantity, of: F.Place) -> float:
    """A height above the ground [m], or so far above an object's top, below its bottom, or that of its centre."""
    value = builder.metres(q, 1.0, "above the ground")
    if not of:
        return value
    _, words, point = target(builder, of)
    up, item = builder.axis("up"), builder.item(of)
    bound = q.role in ("at_least", "at_most")
    at, sign = ("top", 1.0) if bound or value > 0 else ("bottom", -1.0) if value < 0 else ("centre", 0.0)
    half = extent(item, up) if item is not None else 0.0
    value = short(value + float(point @ up) + sign * half)
    builder.assume(f"the height of {words} is that of its {at}, which makes it {value:.4g} m above the ground")
    return value


def _end_level(builder: PolicyBuilder, frame: F.MoveEnd, q: F.Quantity, end: str) -> None:
    """Bring an end to a height above the ground."""
    up, row = builder.axis("up"), 0 if end == "start" else -1
    value = _level(builder, q, frame.place)
    meaning = f"height of the {end} above the ground, z = 0"
    name = builder.knob(f"{end}_height", value, "to", meaning, "level", direction="up")
    now, given = (short(float(rows[row] @ up)) for rows in (builder.positions, builder.trajectory.positions))
    plan = f"Move the {end} to {value:g} m above the ground; the path bends towards it."
    _move_end(builder, end, f"up={name} - {now:.6g}", plan, "" if builder.has(*TURNED) else f"up={name} - {given:.6g}")


def _facing(builder: PolicyBuilder, item: SceneObject) -> F.Direction:
    """The level side of an object that faces the middle of the path, from where an end that moves is reached."""
    away = builder.positions[len(builder.positions) // 2] - item.position
    sides: tuple[F.Direction, ...] = ("left", "right", "front", "back")
    axes = {word: builder.axis(word) for word in sides}
    return max(axes, key=lambda word: float(away @ axes[word]) - extent(item, axes[word]))


def _end_to(builder: PolicyBuilder, frame: F.MoveEnd, end: str) -> None:
    """Bring an end to a place, or so far beside an object."""
    item = builder.item(frame.place)
    if frame.aim in BESIDE and item is not None:
        side = BESIDE[frame.aim] or _facing(builder, item)
        frame = replace(frame, aim="", offset=((side, frame.by),))
    code, words = aimed_target(builder, frame.place, frame.aim)
    beside: dict[str, str] = {}
    for said, q in frame.offset:
        direction = builder.word(said)
        value = _beside(builder, words, item, direction, q)
        beside[direction] = builder.knob(
            f"{end}_{direction}", value, "to", f"distance {OF[direction]} {words}", said, direction=direction,
            about=item.name if item else "",
        )  # fmt: skip
        words = f"{value:g} m {OF[direction]} {words}"
    place = f"{code}, {_arguments(beside)}" if beside else code
    _move_end(builder, end, place, f"Move the {end} to {words}; the path bends towards it.", place)


def _beside(
    builder: PolicyBuilder, words: str, item: SceneObject | None, direction: str, q: F.Quantity | None
) -> float:
    """How far beside a place an end lies, from its centre [m]; what is stated counts from an object's surface."""
    half, room = (extent(item, builder.axis(direction)), builder.room(item)) if item is not None else (0.0, 0.0)
    value = short(half + (max(usual_gap(builder), room) if q is None else builder.metres(q, 1.0, direction)))
    if q is not None and half:
        builder.assume(f"{OF[direction]} {words}, counted from its surface, {value:g} m from its centre")
    else:
        builder.assume(f'"{direction}" is {value:g} m {OF[direction]} the centre of {words}')
    return value


def _end_aimed(builder: PolicyBuilder, frame: F.MoveEnd, end: str) -> None:
    """Bring an end toward a place or away from it."""
    _, words, point = target(builder, frame.place)
    away = frame.relation == "away"
    to_place = builder.scene.frame.levelled(point) - builder.positions[0 if end == "start" else -1]
    distance = float(np.linalg.norm(to_place))
    by = _way_to(builder, frame, words, distance)
    reach = by if away else min(by, distance)
    if distance < 1e-9 or reach <= 0:
        builder.ask(f"The {end} is at {words} already: where should it go?")
        return
    told, direction = ("away from", "away") if away else ("toward", "closer")
    meaning = f"how far the {end} moves {told} {words}"
    name = builder.knob(f"{end}_by", float(f"{reach:.4g}"), "by", meaning, "by", direction=direction)
    heading = builder.scene.frame.words(to_place / distance * (-1.0 if away else 1.0))
    shares = {word: short(share) for word, share in heading.items() if share > 1e-6}
    offset = _arguments({word: name if share == 1.0 else f"{share!r} * {name}" for word, share in shares.items()})
    plan = f"Move the {end} {reach:.4g} m {told} {words}; the path bends with it."
    _move_end(builder, end, offset, plan, "" if builder.shifts else offset)


def _way_to(builder: PolicyBuilder, frame: F.MoveEnd, words: str, distance: float) -> float:
    """How far an end moves toward a place or away from it [m], stated or as far as suits the scene."""
    if frame.by is not None:
        return builder.metres(frame.by, distance, f"{frame.relation} {words}")
    away = frame.relation == "away"
    by = builder.scale.step(degree(frame)) if away else nice(APPROACH[degree(frame)] * distance)
    builder.assume(f'"{"farther from" if away else "closer to"} {words}" is {by:g} m')
    return by


def steps(builder: PolicyBuilder, duration: F.Quantity | None) -> str:
    """The parameter of a wait in timesteps."""
    count, timestep = 10.0, builder.trajectory.timestep
    if duration is None:
        builder.assume("the wait lasts 10 timesteps")
    else:
        count = duration.value / (timestep if duration.unit in ("s", "") else 1.0)
        if duration.unit not in ("s", "", "step", "waypoints"):
            builder.ask(f"How many seconds are {duration.said or duration.value}?")
    meaning = f"timesteps to wait ({timestep:g} s each)"
    return builder.knob("steps", max(1, round(count)), "count", meaning, "duration", unit="", direction="longer")


def extend(builder: PolicyBuilder, frame: F.Extend) -> None:
    """Go on beyond the goal: to a place, in a direction, or straight on."""
    if frame.place:
        code, words = aimed_target(builder, frame.place, frame.aim)
        plan, goal = f"Continue from the goal to {words}.", f"expect_goal({code})"
        builder.add(f"traj = continue_to(traj, {code})", plan, ends={"goal": goal})
    elif frame.offset:
        beyond = _offset(builder, frame, frame.offset)
        total = _arguments(_with_shift(builder, beyond.knobs, own=False))
        goal = "" if builder.goal_moved else f"expect_goal({total})"
        builder.add(
            f"traj = extend(traj, {beyond.code})", f"After the goal, go on {beyond.words}.", ends={"goal": goal}
        )
    else:
        _extend_straight(builder, frame)
    builder.goal_moved = True


def _extend_straight(builder: PolicyBuilder, frame: F.Extend) -> None:
    """Go on in the direction of arrival, or back along the path."""
    if frame.by is None:
        by = builder.scale.step(degree(frame))
        builder.assume(f"going on after the goal is {by:g} m in the direction of arrival")
    else:
        by = builder.metres(frame.by, builder.trajectory.length, "beyond")
    sign, on, way = ("", "on", "in the same direction") if by >= 0 else ("-", "back", "back along the path")
    name = builder.knob("further", abs(by), "by", f"how far to go {on} after the goal", "by", direction="farther")
    passed = f"expect_visits(original[-1, :3], within={tolerance(builder)})"
    builder.add(
        f"traj = extend(traj, {sign}{name})",
        f"After the goal, go on for {abs(by):g} m {way}.",
        f"expect_length(longer_by={name})" if builder.alone else "",
        ends={"goal": "" if builder.goal_moved or builder.shifts else passed},
    )


def come_back(builder: PolicyBuilder, frame: F.Return) -> None:
    """Straight on from the goal to where the path starts."""
    plan, goal = "After the goal, go straight back to the start.", {"goal": "expect_goal(traj[0, :3])"}
    builder.add("traj = continue_to(traj, traj[0, :3], smooth=False)", plan, ends=goal)


def height(builder: PolicyBuilder, frame: F.Height) -> None:
    """At a height above the ground, or above or below one."""
    bound = frame.level.role if frame.level.role in ("at_least", "at_most") else ""
    value = _level(builder, frame.level, frame.of)
    where, part = builder.part(frame.part)
    words = {"at_least": "at or above", "at_most": "at or below"}.get(bound, "at")
    role: Role = frame.level.role if bound else "to"
    name = builder.knob("height", value, role, "height above the ground, z = 0", "level", direction="up")
    limit, promise = (f"{bound}={name}",) * 2 if bound else (name, f"{name}, {name}")
    up = builder.positions @ builder.axis("up")
    chosen = up[builder.waypoints(frame.part)] if where and len(up) == len(builder.trajectory) else up
    holds = {"at_least": chosen >= value, "at_most": chosen <= value}.get(bound, np.zeros(1, dtype=bool)).all()
    builder.exact |= set() if where else {"up"}
    builder.add(
        f"traj = at_height(traj, {limit}{argument(where)})",
        f"Stay {words} {value:g} m above the ground{part}.",
        f"expect_side('up', {promise}{argument(where)})",
        holds=bool(holds),
    )


def bound(builder: PolicyBuilder, frame: F.Bound) -> None:
    """Within a distance to one side of the origin or of an object."""
    where, part = builder.part(frame.part)
    of, about, origin = "", "the origin", np.zeros(3)
    if frame.of:
        code, about, origin = target(builder, frame.of)
        of = f", of={code}"
    for said, q in frame.offset:
        direction = builder.word(said)
        limit = 0.0 if q is None else builder.metres(q, builder.scale.extent, direction)
        name = builder.knob("limit", limit, "at_most", f"furthest {direction} of {about}", said, direction=direction)
        words = f"Never go further {direction} of {about} than {limit:g} m{part}."
        if limit < 0:
            words = f"Stay at least {-limit:g} m {OPPOSITE[direction]} of {about}{part}."
        builder.add(
            f"traj = bound(traj, {direction}={name}{of}{argument(where)})",
            words,
            f"expect_side({direction!r}, at_most={name}{of}{argument(where)})",
            holds=bool(((builder.positions - origin) @ builder.axis(direction) <= limit).all()),
        )


def quadrant(builder: PolicyBuilder, frame: F.Quadrant) -> None:
    """In one quadrant of the horizontal plane."""
    if frame.number not in (1, 2, 3, 4):
        builder.ask(f"There are the quadrants 1 to 4: which one is meant by {frame.number}?")
        return
    sides = (("right", "front"), ("left", "front"), ("left", "back"), ("right", "back"))[frame.number - 1]
    plan = f"Shift the path so that all of it lies in quadrant {frame.number}."
    builder.add(f"traj = quadrant(traj, {frame.number})", plan, *(f"expect_side({word!r}, 0.0)" for word in sides))


def keep(builder: PolicyBuilder, frame: F.Keep) -> None:
    """What is to stay as it is: the other steps leave it alone, and postconditions say so."""
    where, part = builder.part(frame.part)
    if frame.what == "part" or (where and frame.what in ("path", "rest")):
        builder.kept.add("part")
        builder.add("", f"Change nothing{part}.", f"expect_same_path({where})", f"expect_same_speed({where})")
        return
    builder.kept |= {"start", "goal"} if frame.what == "ends" else {frame.what}
    for what in sorted(builder.kept & {"start", "goal"}):
        builder.add("", f"Leave the {what} as it is.", ends={what: f"expect_{what}()"})
    if frame.what in ("path", "speed"):
        builder.add("", f"Leave the {frame.what} as it is{part}.", f"expect_same_{frame.what}({where})")
    elif frame.what == "height":
        builder.exact.add("up")
        builder.add("", f"Leave the height as it is{part}.")


PATH_STEPS: Mapping[type[F.SemanticFrame], Callable[..., None]] = {
    F.Shift: shift, F.MoveEnd: move_end, F.Extend: extend, F.Height: height, F.Bound: bound, F.Return: come_back,
    F.Quadrant: quadrant, F.Keep: keep,
}  # fmt: skip
