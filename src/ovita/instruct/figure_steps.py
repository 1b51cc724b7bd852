"""Steps that give the path another form: figures, mirrors, turns, sizes, bends, waypoints."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from ovita.instruct import frames as F
from ovita.instruct.builder import PolicyBuilder, argument, degree, resolved, short
from ovita.instruct.degrees import Degree, nice
from ovita.instruct.meaning import canonical
from ovita.instruct.object_steps import surface_distance
from ovita.instruct.path_steps import spot, target
from ovita.paths.geometry import runs, turning_angles
from ovita.paths.part import WHOLE, PathPart, Unit
from ovita.paths.trajectory import Array, arc_length

SIZE: dict[Degree, float] = {"slight": 0.06, "moderate": 0.12, "large": 0.22}
"""Size of a new shape as a share of the path's extent."""

TURN: dict[Degree, float] = {"slight": 15.0, "moderate": 45.0, "large": 90.0}
RESIZE: dict[Degree, float] = {"slight": 1.2, "moderate": 1.5, "large": 2.0}
WIDE: dict[Degree, float] = {"slight": 0.7, "large": 1.5}
"""How many times the distance at which the path passes a thing a small or a large circle around it is."""
SMOOTH: dict[Degree, float] = {"slight": 0.3, "moderate": 1.0, "large": 3.0}

TILT = {"left": "front", "right": "back", "front": "right", "back": "left"}
"""The axis about which a counter-clockwise turn lifts each side."""


def _size(builder: PolicyBuilder, frame: F.Figure, what: str, share: float = 1.0, room: float = float("inf")) -> float:
    """How large a figure is, stated or as it suits the scene and the room beside the path [m]."""
    usual = min(share * SIZE[degree(frame)] * builder.scale.extent, room)
    return builder.length(frame.radius or frame.size, nice(usual), what)


def _room(builder: PolicyBuilder, part: PathPart) -> float:
    """How far a path can swing to its sides and keep well clear of what stands there [m]; no less than is seen."""
    path = builder.trajectory.positions[builder.waypoints(resolved(builder, part))]
    gaps = [surface_distance(item, path) for item in builder.scene] if len(path) > 1 else []
    return max(0.5 * min(gaps, default=float("inf")), SEEN * builder.scale.extent)


SEEN = 0.02
"""The least share of the path's extent that a swing to the sides is."""


def figure(builder: PolicyBuilder, frame: F.Figure) -> None:
    """A figure on the way."""
    if frame.shape == "circle" and not frame.place:
        builder.ask("What should it go around?")
        return
    {"circle": _circle, "spiral": _spiral, "eight": _eight}.get(frame.shape, _swing)(builder, frame)


def _sense(frame: F.Figure) -> str:
    return "" if frame.sense is None else f", clockwise={frame.sense == 'cw'}"


def _turns(builder: PolicyBuilder, frame: F.Figure, usual: float, words: str) -> tuple[str, float]:
    turns = usual if frame.turns is None else frame.turns.value
    if turns >= 180.0 and turns % 90.0 == 0.0:
        builder.assume(f'"{turns:g}" is in degrees')  # "do a 360 around it"
        turns /= 360.0
    if turns <= 0:
        builder.ask(f"{turns:g} turns: how many should it be?")
    return builder.knob("turns", turns, "count", words, "turns", unit=""), turns


def _circle(builder: PolicyBuilder, frame: F.Figure) -> None:
    code, words, point = target(builder, frame.place)
    n, turns = _turns(builder, frame, 1.0, f"turns around {words}")
    rounds = _rounds(builder, point)
    if rounds >= ALREADY:
        besides = turns - round(rounds) if turns > round(rounds) >= 1 else turns
        builder.assume(f"the path goes round {words} {rounds:.1f} times already, so that it is {besides:g} more")
        n, turns = _turns(builder, replace(frame, turns=F.Quantity(besides, "turns")), 1.0, f"turns around {words}")
    radius = _radius_around(builder, frame, words, point)
    up, passing = builder.axis("up"), builder.passing(point) - point
    around = radius or f"{np.linalg.norm(passing - (passing @ up) * up):.4g}"
    extra = _sense(frame) + (f", radius={radius}" if radius else "")
    plan = f"From the point closest to {words}, go around it {'once' if turns == 1 else f'{turns:g} times'}."
    promise = f"expect_length(longer_by=5 * {n} * {around})"
    builder.add(f"traj = circle(traj, {code}{extra}, turns={n})", plan, promise, ends=builder.stay())


def _rounds(builder: PolicyBuilder, point: Array) -> float:
    """How often the given path goes round a point (3,), seen from above."""
    up = builder.axis("up")
    across = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
    away = builder.trajectory.positions - point
    angles = np.unwrap(np.arctan2(away @ np.cross(up, across), away @ across))
    return float(np.ptp(angles)) / (2.0 * np.pi)


ALREADY = 0.95
"""Rounds of a path about a thing from which on it has to be asked what a further one means."""


def _radius_around(builder: PolicyBuilder, frame: F.Figure, words: str, point: Array) -> str:
    """The parameter of a circle's radius; "" for the distance at which the path passes what it goes around."""
    gap = float(np.linalg.norm(builder.positions - point, axis=1).min())
    open_, wide = frame.radius is None and frame.size is None, WIDE.get(degree(frame))
    if open_ and gap >= builder.tolerance:
        if wide is None:
            return ""
        metres = nice(wide * gap)
    else:
        metres = _size(builder, frame, "the radius of the circle")
        metres /= 1 if frame.radius or not frame.size else 2
    return builder.knob("circle_radius", metres, "to", f"radius around {words}", "radius", direction="larger")


def _corkscrew(builder: PolicyBuilder, frame: F.Figure) -> None:
    """A spiral of a part of the path, which winds around it."""
    where, words = builder.part(frame.part)
    metres = _size(builder, frame, "the radius of the corkscrew", 0.6, _room(builder, frame.part))
    r = builder.knob("radius", metres, "to", "radius of the helix around the path", "radius", direction="larger")
    n, turns = _turns(builder, frame, 3.0, "turns of the corkscrew")
    call = f"traj = corkscrew(traj, {r}, turns={n}{argument(where)}{_sense(frame)})"
    plan = f"Wind around the path in {turns:g} turns of radius {metres:g} m{words}."
    promises = [f"expect_length(longer_by={r})", builder.rest_stays(where)] if builder.alone else []
    builder.add(call, plan, *promises, ends=builder.stay())


def _spiral(builder: PolicyBuilder, frame: F.Figure) -> None:
    if frame.part and not frame.place and frame.rise is None:
        _corkscrew(builder, frame)
        return
    at, words = spot(builder, frame.place)
    radius, meaning = _size(builder, frame, "the radius of the spiral"), "largest radius of the spiral"
    radius /= 1 if frame.radius or not frame.size else 2
    r = builder.knob("spiral_radius", radius, "to", meaning, "radius", direction="larger")
    n, turns = _turns(builder, frame, 3.0, "turns of the spiral")
    rise = ""
    if frame.rise is not None:
        metres = builder.metres(frame.rise)
        h = builder.knob("spiral_height", metres, "to", "how far the spiral rises", "rise", direction="up")
        rise, words = f", height={h}", f"that rises {metres:g} m, {words}"
    ends = builder.stay()
    if at == "'goal'":
        ends.pop("goal", None)
        builder.goal_moved = True
    call = f"traj = spiral(traj, {at}, radius={r}, turns={n}{rise}{_sense(frame)})"
    plan = f"Make a spiral of {turns:g} turns and radius {radius:g} m {words}."
    builder.add(call, plan, f"expect_length(longer_by={r})", ends=ends)


def _eight(builder: PolicyBuilder, frame: F.Figure) -> None:
    at, words = spot(builder, frame.place)
    metres = _size(builder, frame, "the size of the figure eight")
    metres *= 4.0 if frame.radius and not frame.size else 1.0
    name = builder.knob("size", metres, "to", "size of the figure eight", "size", direction="larger")
    call, promise = f"traj = figure_eight(traj, {at}, size={name})", f"expect_length(longer_by={name})"
    builder.add(call, f"Fly a figure eight {words}.", promise, ends=builder.stay())


def _swing(builder: PolicyBuilder, frame: F.Figure) -> None:
    """A zigzag, a sine wave or shaking, along the path or a part of it."""
    around = PathPart("near", (frame.place,)) if frame.place and isinstance(frame.place, str) else WHOLE
    where, words = builder.part(frame.part or around)
    shaking = frame.shape == "shake"
    what = "the shaking" if shaking else f"the amplitude of the {frame.shape}"
    metres = _size(builder, frame, what, 0.15 if shaking else 0.6, _room(builder, frame.part or around))
    side = "up and down" if frame.upright else "to each side"
    a = builder.knob("amplitude", metres, "to", side, "size", direction="larger")
    promises = ["expect_length(longer_by=0.0)", builder.rest_stays(where)] if builder.alone else []
    if shaking:
        plan = f"Add random displacements of {metres:g} m{words}."
        builder.add(f"traj = noise(traj, {a}{argument(where)})", plan, *promises)
        return
    count = frame.waves or frame.turns
    n = builder.knob("waves", max(1, round(count.value)) if count else 5, "count", "number of waves", "waves", unit="")
    along = ", direction='up'" if frame.upright else ""
    call = f"traj = {frame.shape}(traj, {a}, waves={n}{along}{argument(where)})"
    plan = f"Follow the path in a {frame.shape} of {metres:g} m {side}{words}."
    builder.add(call, plan, *promises, ends={} if where else builder.stay())


def _about(builder: PolicyBuilder, place: F.Place) -> str:
    """The argument of what the path turns about, or ""."""
    return f", about={spot(builder, place)[0]}" if place else ""


def _as_by(builder: PolicyBuilder, call: str) -> dict[str, str]:
    """Postconditions that the ends are where a step alone takes those of the given path."""
    ends = {"start": f"expect_start({call}[0, :3])", "goal": f"expect_goal({call}[-1, :3])"}
    return ends if builder.alone and len(builder.frames) == 1 else {}


def mirror(builder: PolicyBuilder, frame: F.Mirror) -> None:
    """Swap left and right, front and back, or up and down."""
    where, part = builder.part(frame.part)
    about = _about(builder, frame.about)
    ends = {} if where else _as_by(builder, f"mirror(original, {frame.axis!r}{about})")
    call, plan = f"mirror(traj, {frame.axis!r}{about}{argument(where)})", f"Mirror the path ({frame.axis}){part}."
    builder.add(f"traj = {call}", plan, builder.rest_stays(where), ends=ends)


def rotate(builder: PolicyBuilder, frame: F.Rotate) -> None:
    """Turn the path about the vertical."""
    where, part = builder.part(frame.part)
    angle = _angle(builder, frame) * (-1 if frame.sense == "cw" else 1)
    name = builder.knob("degrees", angle, "by", "counter-clockwise", "angle", unit="deg")
    about = _about(builder, frame.about)
    turned = "clockwise" if angle < 0 else "counter-clockwise"
    if frame.sense is None:
        builder.assume(f"the path turns {turned}, seen from above")
    ends = {} if where else _as_by(builder, f"rotate(original, {name}{about})")
    ends |= {"start": "expect_start()"} if frame.about == "start" and builder.alone else {}
    plan = f"Rotate the path by {abs(angle):g} degrees {turned}{part}."
    builder.add(f"traj = rotate(traj, {name}{about}{argument(where)})", plan, ends=ends)


def _angle(builder: PolicyBuilder, frame: F.Rotate | F.Tilt) -> float:
    if frame.angle is None:
        builder.assume(f"the angle is {TURN[degree(frame)]:g} degrees")
        return TURN[degree(frame)]
    return frame.angle.value * {"turns": 360.0, "%": 360.0}.get(frame.angle.unit, 1.0)


def tilt(builder: PolicyBuilder, frame: F.Tilt) -> None:
    """Lift the path on one side."""
    side = builder.word(frame.direction)
    if side not in TILT:
        builder.ask("Which side should be lifted: left, right, front or back?")
        return
    angle, meaning = _angle(builder, frame), f"by how much the {side} is lifted"
    name = builder.knob("degrees", angle, "by", meaning, "angle", unit="deg", direction=side)
    turn, plan = f"{name}, axis={TILT[side]!r}", f"Tilt the path by {angle:g} degrees, {side} up"
    ends = _as_by(builder, f"tilt(original, {turn})")
    builder.add_within(frame.part, f"tilt(traj, {turn})", plan, ends=ends)


def resize(builder: PolicyBuilder, frame: F.Resize) -> None:
    """Larger or smaller as a whole."""
    where, part = builder.part(frame.part)
    frame = _about_its_end(builder, frame)
    factor, about = _size_factor(builder, frame), _about(builder, frame.about)
    meaning = "factor on the size of the path"
    name = builder.knob("factor", factor, "factor", meaning, "by", unit="", direction="larger")
    ends = {end: code for end, code in builder.stay().items() if end == frame.about}
    level = any(isinstance(one, F.Keep) and one.what == "height" and not one.part for one in builder.frames)
    promise = f"expect_length(times={name})" if builder.alone and not where and not level else ""
    flat, words = (", horizontally=True", " horizontally") if level else ("", "")
    call = f"traj = scale(traj, {name}{about}{flat}{argument(where)})"
    builder.add(call, f"Scale the path{words} by {factor:g}{part}.", promise, ends=ends)


def _about_its_end(builder: PolicyBuilder, frame: F.Resize) -> F.Resize:
    """A resizing of the whole path about the one end that is to stay, if nothing is said of that."""
    kept = [one.what for one in builder.frames if isinstance(one, F.Keep) and one.what in ("start", "goal")]
    return replace(frame, about=kept[0]) if len(kept) == 1 and not (frame.about or frame.part) else frame


def _size_factor(builder: PolicyBuilder, frame: F.Resize) -> float:
    """How many times as large the path becomes."""
    plain = canonical(frame)
    if not isinstance(plain, F.Resize) or plain.by is None:
        return _usual(builder, frame, frame.change == "smaller")
    if plain.by.unit not in ("x", "") or plain.by.value <= 0:
        builder.ask(f"How many times as large should the path be, for {plain.by.said or plain.by.value}?")
    return plain.by.value


def _usual(builder: PolicyBuilder, frame: F.Resize | F.Curve, less: bool) -> float:
    """The factor that a word of degree stands for."""
    factor = RESIZE[degree(frame)]
    factor = round(1 / factor, 3) if less else factor
    builder.assume(f"the factor is {factor:g}")
    return factor


def curve(builder: PolicyBuilder, frame: F.Curve) -> None:
    """Bend the path more or less."""
    factor = _usual(builder, frame, frame.change == "less")
    meaning = "factor on how far the path bends from the straight line"
    name = builder.knob("curvature", factor, "factor", meaning, "change", unit="", direction="larger")
    where, part = builder.part(frame.part)
    plan = f"Make the path {frame.change} curved{part} (factor {factor:g})."
    if not where:
        seen = f"expect_length({'longer' if factor > 1 else 'shorter'}_by=0.0)" if _is_seen(builder) else ""
        builder.add(f"traj = curve(traj, {name})", plan, seen, ends=builder.stay())
        return
    for a, b in runs(builder.waypoints(frame.part)):
        if a < b:  # as far from the straight line between the ends of the part as the factor says
            builder.code.append(f"traj = traj + (1 - {name}) * (straighten(traj, {a}, {b}) - traj)")
    builder.add("", plan, builder.rest_stays(where))


def straighten(builder: PolicyBuilder, frame: F.Straighten) -> None:
    """Go straight."""
    if not frame.part:
        promise = "expect_length(shorter_by=0.0)" if _is_seen(builder) else ""
        plan = "Go in a straight line between start and goal."
        builder.add("traj = straighten(traj)", plan, promise, ends=builder.stay())
        return
    part = _from_to(builder, frame.part)
    chosen = np.flatnonzero(builder.waypoints(part))
    if len(chosen) < 2:
        builder.ask(f"A straight line needs two waypoints {part.words()}: from where to where?")
        return
    a, b = int(chosen[0]), int(chosen[-1])
    inside = b - a + 1 < len(builder.trajectory)
    rest = builder.rest_stays(f"between(original, {a}, {b})") if inside else ""
    builder.add(f"traj = straighten(traj, {a}, {b})", f"Go in a straight line {part.words()}.", rest)


def _from_to(builder: PolicyBuilder, part: PathPart) -> PathPart:
    """A part to go straight in; from one object to another, it is from where the path is nearest to the one."""
    items = [builder.item(place) for place in part.places if isinstance(place, str)]
    path = builder.trajectory.positions
    ends = sorted(int(item.core(path).depth(path).argmin()) for item in items if item is not None)
    if part.kind != "between" or len(ends) != 2 or ends[1] - ends[0] < 2:
        return resolved(builder, part)
    return PathPart("range", amount=float(ends[0]), until=float(ends[1]))


def _is_seen(builder: PolicyBuilder) -> bool:
    """Whether a step is the only one, and is seen in the length of the path, as that is not straight."""
    positions = builder.positions
    straight = float(np.linalg.norm(positions[-1] - positions[0]))
    return builder.alone and float(arc_length(positions)[-1]) > 1.01 * straight


def smooth(builder: PolicyBuilder, frame: F.Smooth) -> None:
    """Fewer kinks, less jitter; start and goal stay."""
    where, part = builder.part(frame.part)
    strength, meaning = SMOOTH[degree(frame)] * 8.0 ** (builder.effort - 1), "strength of the smoothing"
    name = builder.knob("smoothing", strength, "to", meaning, "degree", unit="", direction="smoother")
    bends = builder.alone and turning_angles(builder.positions).any()
    promise, plan = f"expect_smoother({where})" if bends else "", f"Smooth the path{part}; start and goal stay."
    builder.add(f"traj = smooth(traj, {name}{argument(where)})", plan, promise, ends=builder.stay())


def resample(builder: PolicyBuilder, frame: F.Resample) -> None:
    """Another number of waypoints."""
    n, q = len(builder.trajectory), frame.amount
    if frame.part:
        builder.ask("The number of waypoints can be changed for the whole path only: should it be?")
    if frame.change == "merge":
        k = max(1, round(q.value if q else 3))
        name = builder.knob("group", k, "count", "waypoints that become one", "amount", unit="")
        call, count = f"average(traj, {name})", f"({len(builder.rows())} + {name} - 1) // {name}"
        plan = f"Replace each group of {k} waypoints by its average."
    else:
        left = _resampled(frame.change, q, n)
        if left < 2:
            builder.ask(f"A path has at least 2 waypoints, this one {n}: how many should be left?")
        count = builder.knob("waypoints", round(left), "count", "number of waypoints", "amount", unit="")
        call, plan = f"resample(traj, {count})", f"Resample the path to {round(left)} waypoints."
    same = "" if builder.moving or frame.change == "merge" else "expect_same_path()"
    builder.add(f"traj = {call}", plan, same, ends={"waypoints": f"expect_waypoints({count})"})


def _resampled(change: str, q: F.Quantity | None, n: int) -> float:
    """How many waypoints there are after a change of n."""
    if q is None:
        return n * (2.0 if change == "more" else 0.5)
    if q.unit not in ("x", "%"):
        return q.value if change == "to" else n - q.value if change == "fewer" else n + q.value
    if change == "fewer":
        return n * (1 - q.value if q.value < 1 else 1 / q.value)
    return n * (1 + q.value if change == "more" and q.unit == "%" else q.value)


def reverse(builder: PolicyBuilder, frame: F.Reverse) -> None:
    """Run the path, or a part of it, backwards."""
    where, part = builder.part(frame.part)
    ends = {"start": "expect_start(original[-1, :3])", "goal": "expect_goal(original[0, :3])"}
    plan = f"Go along the path in the opposite order{part}."
    builder.add(f"traj = reverse(traj{argument(where)})", plan, ends=ends if builder.alone and not where else {})


def trim(builder: PolicyBuilder, frame: F.Trim) -> None:
    """Cut off the first or last so much, or what comes before or after a place."""
    whole = _cut_at_once(builder, frame)
    if whole is None:
        return
    frame = whole
    n, part = len(builder.trajectory), _cut(builder, frame)
    if part is None:
        builder.ask(f"How much should be cut off at the {'start' if frame.cut in ('first', 'before') else 'end'}?")
        return
    left = np.flatnonzero(~builder.waypoints(part))
    if len(left) < 2:
        builder.ask(f"The path has {n} waypoints, and that would leave {len(left)}: how much should be cut off?")
        return
    builder.goal_moved = True
    if part.kind == "last" and part.unit == "m" and part.amount:
        _shorten(builder, part.amount)
        return
    where, words = builder.part(part)
    ends = {"start": f"expect_start(original[{left[0]}, :3])", "goal": f"expect_goal(original[{left[-1]}, :3])"}
    what = words.removeprefix(" in") if words.endswith("waypoints") else f" the waypoints{words}"
    plan, ends = f"Leave out{what}.", ends if builder.alone else {}
    builder.add(f"traj = traj[~{where}]", plan, ends=ends | {"waypoints": ""})


def _cut_at_once(builder: PolicyBuilder, frame: F.Trim) -> F.Trim | None:
    """A cut with all that is cut off there, at the last of them: "cut that much off again"; None at the others."""
    alike = [(i, f.amount) for i, f in enumerate(builder.frames) if isinstance(f, F.Trim) and f.cut == frame.cut]
    amounts = [q for _, q in alike if q is not None and frame.amount is not None and q.unit == frame.amount.unit]
    if not len(alike) == len(amounts) > 1:
        return frame
    if builder.frame != alike[-1][0]:
        return None
    return replace(frame, amount=replace(amounts[0], value=sum(q.value for q in amounts)))


def _shorten(builder: PolicyBuilder, metres: float) -> None:
    """Cut the last so many metres off."""
    name = builder.knob("shorter_by", short(metres), "by", "how much sooner the path ends", "amount")
    promise = f"expect_length(shorter_by={name})" if builder.alone else ""
    builder.add(f"traj = shorten(traj, {name})", f"Leave out the last {metres:g} m.", promise, ends={"waypoints": ""})


def _cut(builder: PolicyBuilder, frame: F.Trim) -> PathPart | None:
    """The part of the path to cut off, without the waypoint at the place that it is told by; None if none is."""
    units: dict[str, Unit] = {"m": "m", "s": "s", "%": "share", "x": "share"}
    if frame.amount is not None and frame.cut in ("first", "last"):
        return PathPart(frame.cut, amount=frame.amount.value, unit=units.get(frame.amount.unit, "waypoints"))
    if not isinstance(frame.place, str) or not frame.place or frame.cut not in ("before", "after"):
        return None
    chosen = np.flatnonzero(builder.waypoints(PathPart(frame.cut, (frame.place,))))
    begin, end = chosen[[0, -1]] + ((1, 0) if frame.cut == "after" else (0, -1))
    return PathPart("range", amount=float(begin), until=float(end))


FIGURE_STEPS: Mapping[type[F.SemanticFrame], Callable[..., None]] = {
    F.Figure: figure, F.Mirror: mirror, F.Rotate: rotate, F.Tilt: tilt, F.Resize: resize, F.Curve: curve,
    F.Straighten: straighten, F.Smooth: smooth, F.Resample: resample, F.Reverse: reverse, F.Trim: trim,
}  # fmt: skip
