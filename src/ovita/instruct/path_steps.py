"""Steps that say where the path goes: shifts, ends, heights and bounds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from ovita.instruct import frames as F
from ovita.instruct.builder import PolicyBuilder, argument, degree, short
from ovita.instruct.degrees import Degree, nice
from ovita.paths.geometry import is_level, on_the_ground, turning_angles
from ovita.paths.part import PathPart, both
from ovita.paths.scene import OPPOSITE, SceneObject
from ovita.paths.trajectory import Array, arc_length
from ovita.policy.source import Role
from ovita.toolkit.approach import extent, stays

APPROACH: dict[Degree, float] = {"slight": 0.25, "moderate": 0.5, "large": 0.75}
"""Share of the distance to an object by which "closer" comes closer."""

MARGIN = 0.05
"""Least distance from the surface of an object at which a path ends beside or on it [m]."""

BESIDE: Mapping[str, F.Direction | None] = {"above": "up", "below": "down", "behind": "back", "beside": None}
"""Where beside an object an end is, by a frame's aim; None for the side that is nearest."""

TURNED = (F.Mirror, F.Rotate, F.Tilt, F.Resize, F.Quadrant, F.Reverse, F.Trim, F.Height)
"""Frames after which an end is no longer where shifts alone would take it."""

MUCH: dict[Degree, str] = {"slight": "a little ", "moderate": "", "large": "much "}
TO_THE = {"left": "to the left", "right": "to the right", "front": "to the front", "back": "back"}
OF = {"left": "left of", "right": "right of", "front": "in front of", "back": "behind", "up": "above", "down": "below"}
QUADRANTS = (("right", "front"), ("left", "front"), ("left", "back"), ("right", "back"))


def arguments(expressions: Mapping[str, str]) -> str:
    """Expressions by direction as the arguments of a call."""
    return ", ".join(f"{direction}={expression}" for direction, expression in expressions.items())


def usual_gap(builder: PolicyBuilder) -> float:
    """How far beside or above a thing is close to it [m]."""
    return nice(max(MARGIN, 0.3 * builder.scale.step("slight")))


def spot(builder: PolicyBuilder, place: F.Place) -> tuple[str, str]:
    """Code of the place of a waypoint, and words for it; the goal where no place is named."""
    if isinstance(place, F.Quantity):
        return _along(builder, place)
    if place == "middle":
        return "0.5", "in the middle"
    if place in ("start", "goal", ""):
        return repr(place or "goal"), f"at the {place or 'goal'}"
    code, words, _ = target(builder, place)
    return code, f"closest to {words}"


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
    return str(int(q.value) - 1), f"at waypoint {q.value:g}"


def target(builder: PolicyBuilder, place: F.Place) -> tuple[str, str, Array]:
    """Code of a point to go to, words for it, and the point itself (3,) [m]."""
    if isinstance(place, tuple):
        a, b = (builder.scene[name] for name in place)
        code = f"midpoint({builder.ref(a)}, {builder.ref(b)})"
        return code, f"the midpoint of {a.name} and {b.name}", (a.position + b.position) / 2.0
    if isinstance(place, F.Quantity) or place in F.SPOTS:
        code, words = spot(builder, place)
        n = len(builder.positions)
        row = {"'start'": 0, "'goal'": n - 1}.get(code)
        row = row if row is not None else int(code) if code.isdigit() else round(float(code) * (n - 1))
        return f"traj[{row}, :3]", words.removeprefix("at ").removeprefix("in "), builder.positions[row]
    item = builder.scene[place]
    return builder.ref(item), item.name, item.position


def aimed(builder: PolicyBuilder, place: F.Place, aim: F.Aim) -> tuple[str, str]:
    """Code of a point to go to and words for it, with what of an object is meant; its centre if its size is unknown."""
    code, words, _ = target(builder, place)
    if not aim:
        return code, words
    item = builder.item(place)
    if item is not None and item.dimensions is None:
        builder.assume(f"the size of {item.name} is not known, so its position stands for its {aim}")
    return f"{code}, aim={aim!r}", f"the {aim} of {words}"


def _offset(
    builder: PolicyBuilder, frame: F.SemanticFrame, offset: F.Offset, prefix: str = ""
) -> tuple[dict[str, str], str]:
    """The parameters of an offset by direction word, and words such as "0.2 m to the left"."""
    knobs: dict[str, str] = {}
    words = []
    for said, q in offset:
        direction = builder.word(said)
        step = _without_crowding(builder, frame, direction, _step(builder, frame, direction))
        value = builder.length(q, step, f'"{MUCH[degree(frame)]}{direction}"')
        direction, value = (direction, value) if value >= 0 else (OPPOSITE[direction], -value)
        if value == 0 or not {direction, OPPOSITE[direction]}.isdisjoint(knobs):
            builder.ask(f"Which way should it go, and how far {direction}?")
        meaning = f"shift {TO_THE.get(direction, direction)}"
        knobs[direction] = builder.knob(prefix + direction, value, "by", meaning, said, direction=direction)
        words.append(f"{value:g} m {TO_THE.get(direction, direction)}")
    return knobs, " and ".join(words)


def _step(builder: PolicyBuilder, frame: F.SemanticFrame, direction: str) -> float:
    """How far a word of degree reaches in a direction [m]; above the ground no farther than suits its height."""
    step, height = builder.step(frame), float((builder.positions @ builder.axis("up")).min())
    if direction not in ("up", "down"):
        room = _room_beside(builder)
        return step if step <= room else nice(step / 2.0)
    if height <= 0.0 or (direction == "down" and step < height):
        return step
    return nice(min(step, max(height / 2.0, TALL if direction == "up" else 0.0)))


def _without_crowding(builder: PolicyBuilder, frame: F.SemanticFrame, direction: str, step: float) -> float:
    """How far a word shifts a part [m]: less where most of the room beside an object of known size would be gone."""
    moving = builder.waypoints(frame.part) if isinstance(frame, F.Shift) and frame.part else np.zeros(0, dtype=bool)
    path = builder.positions
    things = [item for item in builder.scene if item.dimensions is not None]
    if len(moving) != len(path) or not moving.any() or not things or frame.degree == "large":
        return step  # "a good way" is meant so
    before = np.array([float(item.cuboid.closest(path)[0]) for item in things])
    for less in CROWDED:
        shifted = path + less * step * moving[:, None] * builder.axis(direction)
        room = np.array([float(item.cuboid.closest(shifted)[0]) for item in things])
        if ((room >= ROOM_LEFT * before) | (room >= less * step) | (before <= 0.0)).all():
            break
    return nice(less * step)


CROWDED, ROOM_LEFT = (1.0, 0.7, 0.5, 0.35, 0.2), 0.5
"""Shares of a shift or push that are tried, and what share of the room beside an object has to be left."""


def _room_beside(builder: PolicyBuilder) -> float:
    """The distance of the path to the nearest object [m]."""
    return max(min((float(item.clearance(builder.positions).min()) for item in builder.scene), default=np.inf), 0.0)


TALL = 1.0
"""How far a path may rise by a word of degree alone, however low it is [m]."""


def shift(builder: PolicyBuilder, frame: F.Shift) -> None:
    """Shift the path or a part of it; ends that are to stay do."""
    if not frame.offset:
        builder.ask("Which way should the path go?")
    knobs, words = _offset(builder, frame, frame.offset)
    where, part = builder.part(_above_ground(builder, frame, knobs))
    ends = sorted(builder.kept & {"start", "goal"})
    offset = arguments(knobs)
    if where or ends:
        kept = "" if where else f", keep={('both' if len(ends) == 2 else ends[0])!r}"
        stays = part if where else "; " + " and ".join(f"the {end} stays" for end in ends)
        call = builder.eased(frame.part, f"move(traj, {offset}{argument(where)}{kept})")
        builder.add(f"traj = {call}", f"Shift the path {words}{stays}.", f"expect_moved({offset}{argument(where)})")
        return
    _shift_all(builder, knobs, words, {builder.word(said) for said, q in frame.offset if q is not None})


def _above_ground(builder: PolicyBuilder, frame: F.Shift, knobs: Mapping[str, str]) -> PathPart:
    """The part of a shift; one down by more than the path's ends are high leaves alone what would go underground."""
    drop = builder.parameters[knobs["down"]].value if "down" in knobs else 0.0
    heights = builder.positions @ builder.axis("up")
    low = float(heights.min())
    if not isinstance(drop, int | float) or not 0.0 <= low < drop or (heights >= low + drop).mean() < MOSTLY:
        return frame.part
    builder.assume(f"what is less than {low + drop:.3g} m above the ground stays")
    above = PathPart("beyond", amount=short(low + drop), direction="up")
    return both(frame.part, above) if frame.part else above


MOSTLY = 0.5
"""The share of a path that has to be so high that only its ends would go underground."""


def _shift_all(builder: PolicyBuilder, knobs: Mapping[str, str], words: str, stated: set[str]) -> None:
    """Shift the whole path; later steps leave the directions alone whose amounts are stated."""
    builder.exact |= {direction for direction in knobs if stated & {direction, OPPOSITE[direction]}}
    for direction, name in knobs.items():
        builder.shifts.setdefault(direction, []).append(name)
    total = {direction: " + ".join(names) for direction, names in builder.shifts.items()}
    ends = {"shift": f"expect_moved({arguments(total)})"}
    builder.add(f"traj = move(traj, {arguments(knobs)})", f"Shift the whole path {words}.", ends=ends)


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


def _move_end(builder: PolicyBuilder, end: str, to: str, plan: str, promise: str) -> None:
    """The step that moves an end, and its promise, by the arguments of expect_start or expect_goal, or ""."""
    ends = {end: f"expect_{end}({promise})" if promise else ""}
    call = f"traj = move_{end}(traj, {to}{_bend(builder, end, to)})"
    builder.add(call, f"{plan}; the path bends towards it.", ends=ends)


def _bend(builder: PolicyBuilder, end: str, to: str) -> str:
    """The argument that lets no more of the path follow an end than is gentle, and no stop; "" for half of it.

    A leg behind a corner follows alone, if it is about as long as the shift: drawing back from a rim bends no rim. It
    is half of the path, too, if that leaves more room beside the objects.
    """
    call, rows = f"move_{end}(traj, {to})", builder.rows()
    shift, s = float(builder.shifts_by(call).max()), arc_length(rows[:, :3])
    ahead = (s if end == "start" else s[-1] - s)[stays(rows)]
    corners = (s if end == "start" else s[-1] - s)[turning_angles(rows[:, :3]) > CORNER]
    room, leg = (float(way.min(initial=s[-1])) for way in (ahead[ahead > shift], corners[corners > LEG * shift]))
    blend = max(nice(min(FOLLOWING * shift, room) / max(float(s[-1]), 1e-9)), LEAST)
    blend = min(blend, short(leg / max(float(s[-1]), 1e-9)))
    bent = f", blend={blend:g}"
    paths = builder.after(call), builder.after(f"{call[:-1]}{bent})"), rows[:, :3]
    wide, narrow, now = (min((i.cuboid.closest(path)[0] for i in builder.scene), default=0.0) for path in paths)
    return bent if blend < HALF and narrow >= min(wide, usual_gap(builder), now) else ""


CORNER, LEG = 0.8, 0.8
"""The turn that ends a leg [rad], and how long one is at least that follows alone, as a share of the end's shift."""

FOLLOWING, LEAST, HALF = 3.0, 0.05, 0.5
"""How many times its shift of the path follows an end, and the least and the most share of the path that does."""


def _end_shifted(builder: PolicyBuilder, frame: F.MoveEnd, end: str) -> None:
    """Shift an end from where it was, whatever the whole path was shifted by along the same axis."""
    knobs, words = _offset(builder, frame, frame.offset, f"{end}_")
    own = {direction: name + _without_shifts(builder, direction) for direction, name in knobs.items()}
    beside = {way: " + ".join(names) for way, names in builder.shifts.items() if not {way, OPPOSITE[way]} & {*knobs}}
    promise = "" if builder.has(*TURNED) else arguments(knobs | beside)
    _move_end(builder, end, arguments(own), f"Shift the {end} {words}", promise)


def _without_shifts(builder: PolicyBuilder, direction: str) -> str:
    """What takes back the shifts of the whole path along a direction, as the end of an expression."""
    along, against = (builder.shifts.get(way, []) for way in (direction, OPPOSITE[direction]))
    return "".join([*(f" - {name}" for name in along), *(f" + {name}" for name in against)])


def _end_level(builder: PolicyBuilder, frame: F.MoveEnd, q: F.Quantity, end: str) -> None:
    """Bring an end to a height above the ground."""
    row, value = 0 if end == "start" else -1, _level(builder, q, frame.place)
    meaning = f"height of the {end} above the ground, z = 0"
    name = builder.knob(f"{end}_height", value, "to", meaning, "level", direction="up")
    up = short(float(builder.positions[row] @ builder.axis("up")))
    promise = "" if builder.shifts or builder.has(*TURNED) else f"up={name} - {up:.6g}"
    _move_end(builder, end, f"up={name} - {up:.6g}", f"Move the {end} to {value:g} m above the ground", promise)


def _level(builder: PolicyBuilder, q: F.Quantity, of: F.Place) -> float:
    """A height above the ground [m], or so far above an object's top, below its bottom, or that of its centre."""
    value = builder.metres(q)
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


def _facing(builder: PolicyBuilder, item: SceneObject) -> F.Direction:
    """The level side of an object on which most of the path lies, else that which faces its middle waypoint."""
    away = builder.positions - item.position
    sides: tuple[F.Direction, ...] = ("left", "right", "front", "back")
    beyond = {word: away @ builder.axis(word) - extent(item, builder.axis(word)) for word in sides}
    return max(sides, key=lambda word: ((beyond[word] > 0.0).mean().round(1), beyond[word][len(away) // 2]))


def _end_to(builder: PolicyBuilder, frame: F.MoveEnd, end: str) -> None:
    """Bring an end to a place, or so far beside an object."""
    item, level = builder.item(frame.place), ""
    if item is not None:
        frame, level = _end_at(builder, frame, item, end)
    place, words = aimed(builder, frame.place, frame.aim)
    for said, q in frame.offset:
        direction = builder.word(said)
        half, room = (extent(item, builder.axis(direction)), builder.room(item)) if item else (0.0, 0.0)
        meaning = f"distance {OF[direction]} {words}"
        value = short(half + (max(usual_gap(builder), room) if q is None else builder.metres(q)))
        builder.assume(f"{OF[direction]} {words} is counted from its surface, {value:g} m from its centre")
        about = item.name if item else ""
        name = builder.knob(f"{end}_{direction}", value, "to", meaning, said, about=about, direction=direction)
        place, words = f"{place}, {direction}={name}", f"{value:g} m {OF[direction]} {words}"
    _move_end(builder, end, f"{place}{level}", f"Move the {end} to {words}", f"{place}{level}")


def _end_at(builder: PolicyBuilder, frame: F.MoveEnd, item: SceneObject, end: str) -> tuple[F.MoveEnd, str]:
    """An end at an object as one beside it or at its own height, with the arguments that say the height."""
    level = ""
    if not frame.offset and any(_keeps_height(one) for one in builder.frames):
        frame, level = replace(frame, aim=""), _at_own_level(builder, item, end)
    elif not (frame.aim or frame.offset) and _is_in_the_way(builder, item):
        frame, level = replace(frame, aim="beside"), _at_its_level(builder, item)
    if frame.aim in BESIDE:
        side = BESIDE[frame.aim] or _facing(builder, item)
        frame = replace(frame, aim="", offset=((side, frame.by),))
    return frame, level


def _keeps_height(frame: F.SemanticFrame) -> bool:
    return isinstance(frame, F.Keep) and frame.what == "height" and not frame.part


def _at_own_level(builder: PolicyBuilder, item: SceneObject, end: str) -> str:
    """The argument of an offset from an object that leaves an end as high as it is."""
    rise = float((builder.positions[0 if end == "start" else -1] - item.position) @ builder.axis("up"))
    return f", {'up' if rise > 0.0 else 'down'}={short(abs(rise)):g}"


def _at_its_level(builder: PolicyBuilder, item: SceneObject) -> str:
    """The arguments of an offset from an object that keep the height of a level path; "" for any other."""
    up = builder.axis("up")
    rise = float((builder.positions[0] - item.position) @ up)
    if not is_level(builder.positions, up) or abs(rise) <= MARGIN:
        return ""
    return f", {'up' if rise > 0.0 else 'down'}={short(abs(rise)):g}"


def is_a_body(item: SceneObject) -> bool:
    """Whether an object is so large on all sides that to be at it is to be beside it: a building, no cup or mat."""
    solid = HOLLOW.isdisjoint(item.name.lower().split())
    return solid and item.dimensions is not None and float(item.size.min()) >= LARGE


def _is_in_the_way(builder: PolicyBuilder, item: SceneObject) -> bool:
    """Whether to end at an object is to end beside it: a body, and for what rolls on the floor what stands on it."""
    up = builder.axis("up")
    middle, half = float(item.position @ up), extent(item, up)
    stands = item.dimensions is not None and middle - half <= STEP < middle + half
    hollow = not HOLLOW.isdisjoint(item.name.lower().split())
    return is_a_body(item) or (stands and not hollow and on_the_ground(builder.positions, up))


STEP = 0.03
"""Height above the floor to which what rolls may go over an object [m]."""

LARGE = 0.5
"""Edges from which on a solid object has no place in its middle to be at [m]."""

HOLLOW = frozenset("area zone room tunnel hall gate arch hoop ring doorway corridor field region cloud box".split())
"""Names of what has a place in its middle, however large."""


def _end_aimed(builder: PolicyBuilder, frame: F.MoveEnd, end: str) -> None:
    """Bring an end toward a place or away from it."""
    _, words, point = target(builder, frame.place)
    away = frame.relation == "away"
    way = builder.scene.frame.levelled(point) - builder.positions[0 if end == "start" else -1]
    way = _level_way(builder, way) if away else way
    distance = float(np.linalg.norm(way))
    usual = builder.step(frame) if away else nice(APPROACH[degree(frame)] * distance)
    told, direction = ("away from", "away") if away else ("toward", "closer")
    by = builder.length(frame.by, usual, f'"{told} {words}"', distance)
    reach = by if away else min(by, distance)
    if distance < 1e-9 or reach <= 0:
        builder.ask(f"The {end} is at {words} already: where should it go?")
        return
    meaning = f"how far the {end} moves {told} {words}"
    name = builder.knob(f"{end}_by", float(f"{reach:.4g}"), "by", meaning, "by", direction=direction)
    heading = builder.scene.frame.words(way / distance * (-1.0 if away else 1.0))
    shares = {word: short(share) for word, share in heading.items() if share > 1e-6}
    offset = arguments({word: name if share == 1.0 else f"{share!r} * {name}" for word, share in shares.items()})
    _move_end(builder, end, offset, f"Move the {end} {reach:.4g} m {told} {words}", "" if builder.shifts else offset)


def _level_way(builder: PolicyBuilder, way: Array) -> Array:
    """A way (3,) [m] in the plane where most of it lies there, so that an end stays at its height."""
    up = builder.axis("up")
    flat = way - float(way @ up) * up
    return np.asarray(flat if np.linalg.norm(flat) > LEVEL * np.linalg.norm(way) else way)


LEVEL = 0.3
"""The share of the way to a place that lies in the plane from which on an end goes away from it in the plane."""


def steps(builder: PolicyBuilder, duration: F.Quantity | None) -> str:
    """The parameter of a wait in timesteps."""
    count, timestep = 10.0, builder.trajectory.timestep
    if duration is None:
        builder.assume(f"the wait lasts {count * timestep:g} s")
    else:
        count = duration.value / (timestep if duration.unit in ("s", "") else 1.0)
        if duration.unit not in ("s", "", "step", "waypoints"):
            builder.ask(f"How many seconds are {duration.said or duration.value}?")
    meaning = f"timesteps to wait ({timestep:g} s each)"
    return builder.knob("steps", max(1, round(count)), "count", meaning, "duration", unit="", direction="longer")


def waited(builder: PolicyBuilder, name: str) -> str:
    """How long a wait of `steps` lasts, in words."""
    count = builder.parameters[name].value
    assert isinstance(count, int | float), "a number of timesteps"
    return f"{count * builder.trajectory.timestep:g} s ({count} timesteps)"


def extend(builder: PolicyBuilder, frame: F.Extend) -> None:
    """Go on beyond the goal: to a place, in a direction, or straight on."""
    item = builder.item(frame.place)
    path = builder.trajectory.positions
    if item is not None and item.core(path).depth(path[:1])[0] <= builder.scale.near(path, item):
        builder.assume(f"the path starts at {item.name}")
        come_back(builder, F.Return(words=frame.words))
    elif frame.place:
        code, words = aimed(builder, frame.place, frame.aim)
        plan, goal = f"Continue from the goal to {words}.", f"expect_goal({code})"
        builder.add(f"traj = continue_to(traj, {code})", plan, ends={"goal": goal})
    elif frame.offset:
        knobs, words = _offset(builder, frame, frame.offset)
        goal = "" if builder.goal_moved or builder.shifts else f"expect_goal({arguments(knobs)})"
        plan = f"After the goal, go on {words}."
        builder.add(f"traj = extend(traj, {arguments(knobs)})", plan, ends={"goal": goal})
    else:
        _extend_straight(builder, frame)
    builder.goal_moved = True


def _extend_straight(builder: PolicyBuilder, frame: F.Extend) -> None:
    """Go on in the direction of arrival, or back along the path."""
    by = builder.length(frame.by, builder.step(frame), "the way on beyond the goal")
    sign, on, way = ("", "on", "in the same direction") if by >= 0 else ("-", "back", "back along the path")
    name = builder.knob("further", abs(by), "by", f"how far to go {on} after the goal", "by", direction="farther")
    passed = f"expect_visits(original[-1, :3], within={builder.tolerance})"
    builder.add(
        f"traj = extend(traj, {sign}{name})",
        f"After the goal, go on for {abs(by):g} m {way}.",
        f"expect_length(longer_by={name})" if by > 0 or builder.alone else "",
        ends={"goal": "" if builder.goal_moved or builder.moving > 1 else passed},
    )


def arrive(builder: PolicyBuilder, frame: F.Arrive) -> None:
    """Straight to the goal from a direction."""
    item = builder.item(frame.place)
    if item is not None and not builder.has(F.MoveEnd):
        gap, size = float(item.distance(builder.positions[-1:])[0]), item.dimensions
        if gap > NEAR_GOAL * builder.scale.extent + (0.0 if size is None else float(np.max(size))):
            builder.ask(f"The path ends {gap:.3g} m from {item.name}: should it end there?")
    way = builder.word(frame.direction)
    value = builder.length(frame.by, builder.step(frame), f'"from {FROM[way]}"')
    name = builder.knob("approach", value, "by", f"length of the approach from {FROM[way]}", "by", direction=way)
    code = f"traj = continue_to(move_goal(traj, {way}={name}), traj[-1, :3], smooth=False)"
    plan = f"Reach the goal straight from {FROM[way]}, over the last {value:g} m."
    builder.add(code, plan, f"expect_visits(traj[-1, :3], {way}={name}, within={builder.tolerance})")


NEAR_GOAL = 0.1
"""An object is at the goal if it is nearer than this share of the path's extent, and its own size."""

FROM = {"up": "above", "down": "below", "left": "the left", "right": "the right", "front": "in front", "back": "behind"}
"""Each direction word as where something comes from."""


def come_back(builder: PolicyBuilder, frame: F.Return) -> None:
    """Straight on from the goal to where the path starts."""
    plan, goal = "After the goal, go straight back to the start.", {"goal": "expect_goal(traj[0, :3])"}
    builder.add("traj = continue_to(traj, traj[0, :3], smooth=False)", plan, ends=goal)


def height(builder: PolicyBuilder, frame: F.Height) -> None:
    """At a height above the ground, or above or below one."""
    _at(builder, frame, _level(builder, frame.level, frame.of), frame.level.role)


def level(builder: PolicyBuilder, frame: F.OneHeight) -> None:
    """At one height: the mean of those that it has there."""
    value = round(float(_heights(builder, frame).mean()), 3)
    builder.assume(f"the one height is the mean of those that it had, {value:.4g} m")
    _at(builder, frame, value, "to")


def _heights(builder: PolicyBuilder, frame: F.SemanticFrame) -> Array:
    """The heights that a frame is about, (N,) [m]."""
    up = builder.positions @ builder.axis("up")
    return up[builder.waypoints(frame.part)] if len(up) == len(builder.trajectory) else up


def _at(builder: PolicyBuilder, frame: F.SemanticFrame, value: float, role: Role) -> None:
    """At a height above the ground [m], or above or below it."""
    limited = role in ("at_least", "at_most")
    where, part = builder.part(frame.part)
    words = {"at_least": "at or above", "at_most": "at or below"}.get(role, "at")
    kind: Role = role if limited else "to"
    name = builder.knob("height", value, kind, "height above the ground, z = 0", "level", direction="up")
    limit, promise = (f"{role}={name}",) * 2 if limited else (name, f"{name}, {name}")
    up = _heights(builder, frame)
    kept = up >= value if role == "at_least" else up <= value
    builder.exact |= set() if where else {"up"}
    call = f"traj = {builder.eased(frame.part, f'at_height(traj, {limit}{argument(where)})')}"
    if limited and not where:
        builder.limits.append((value, role, call))
    builder.add(
        call,
        f"Stay {words} {value:g} m above the ground{part}.",
        f"expect_side('up', {promise}{argument(where)})",
        holds=limited and bool(kept.all()),
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
        limit = 0.0 if q is None else builder.metres(q)
        name = builder.knob("limit", limit, "at_most", f"furthest {direction} of {about}", said, direction=direction)
        builder.add(
            f"traj = bound(traj, {direction}={name}{of}{argument(where)})",
            f"Never go further {direction} of {about} than {limit:g} m{part}.",
            f"expect_side({direction!r}, at_most={name}{of}{argument(where)})",
            holds=bool(((builder.positions - origin) @ builder.axis(direction) <= limit).all()),
        )


def quadrant(builder: PolicyBuilder, frame: F.Quadrant) -> None:
    """In one quadrant of the horizontal plane."""
    if not 1 <= frame.number <= len(QUADRANTS):
        builder.ask(f"There are the quadrants 1 to 4: which one is meant by {frame.number}?")
        return
    plan = f"Shift the path so that all of it lies in quadrant {frame.number}."
    promises = (f"expect_side({word!r}, 0.0)" for word in QUADRANTS[frame.number - 1])
    builder.add(f"traj = quadrant(traj, {frame.number})", plan, *promises)


def keep(builder: PolicyBuilder, frame: F.Keep) -> None:
    """What is to stay as it is: the other steps leave it alone, and postconditions say so."""
    where, part = builder.part(frame.part)
    if frame.what == "part" or (where and frame.what in ("path", "rest")):
        builder.kept.add("part")
        builder.add("", f"Change nothing{part}.", f"expect_same_path({where})", f"expect_same_speed({where})")
        return
    told = builder.kept & {"start", "goal"}
    builder.kept |= {"start", "goal"} if frame.what == "ends" else {frame.what}
    for what in sorted(builder.kept & {"start", "goal"} - told):
        builder.add("", f"Leave the {what} as it is.", ends={what: f"expect_{what}()"})
    if frame.what in ("path", "speed"):
        builder.add("", f"Leave the {frame.what} as it is{part}.", f"expect_same_{frame.what}({where})")
    elif frame.what == "height":
        builder.exact.add("up")
        builder.add("", f"Leave the height as it is{part}.")


PATH_STEPS: Mapping[type[F.SemanticFrame], Callable[..., None]] = {
    F.Shift: shift, F.MoveEnd: move_end, F.Extend: extend, F.Arrive: arrive, F.Height: height, F.OneHeight: level,
    F.Bound: bound, F.Return: come_back, F.Quadrant: quadrant, F.Keep: keep,
}  # fmt: skip
