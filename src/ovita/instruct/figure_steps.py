"""Steps that give the path another form: figures, mirrors, turns, sizes, bends, waypoints."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ovita.instruct import frames as F
from ovita.instruct.builder import PolicyBuilder, argument, resolved
from ovita.instruct.lexicon import Degree
from ovita.instruct.path_steps import degree, size, spot, target, tolerance
from ovita.paths.geometry import Mask, runs
from ovita.paths.part import PathPart
from ovita.paths.trajectory import Array, arc_length
from ovita.toolkit.waypoints import keep_unchanged
from ovita.toolkit.waypoints import smooth as smoothed

TURN: dict[Degree, float] = {"slight": 15.0, "moderate": 45.0, "large": 90.0}
RESIZE: dict[Degree, float] = {"slight": 1.2, "moderate": 1.5, "large": 2.0}

STRONGEST = 64.0
"""Largest strength of a smoothing that is tried."""

SHARP = 0.7
"""A turn that smoothing must take the edge off [rad]."""

TILT = {"left": "front", "right": "back", "front": "right", "back": "left"}
"""The axis about which a counter-clockwise turn lifts each side."""

ENDS_STAY = {"start": "expect_start()", "goal": "expect_goal()"}


def stay(builder: PolicyBuilder) -> dict[str, str]:
    """Postconditions that the ends stay, where no other step moves them."""
    return dict(ENDS_STAY) if builder.alone else {}


def _within(builder: PolicyBuilder, frame: F.SemanticFrame, call: str, plan: str, *promises: str) -> None:
    """A step that changes the whole path, undone outside the part that it is about."""
    where, part = builder.part(frame.part)
    if not where:
        builder.add(f"traj = {call}", plan, *promises)
        return
    builder.before("given = traj")
    about = (promise for promise in promises if where in promise)
    plan = f"{plan.removesuffix('.')}{part}."
    builder.add(f"traj = keep_unchanged({call}, given, ~{where})", plan, _rest_stays(builder, where), *about)


def figure(builder: PolicyBuilder, frame: F.Figure) -> None:
    """A figure on the way."""
    if frame.shape in ("zigzag", "wave", "shake"):
        _swing(builder, frame)
        return
    place = frame.place or (_middle_of(builder, frame.part) if frame.part else "goal")
    if frame.shape == "circle" and not frame.place:
        builder.ask("What should it go around?")
        return
    {"circle": _circle, "spiral": _spiral, "eight": _eight}[frame.shape](builder, frame, place)


def _middle_of(builder: PolicyBuilder, part: PathPart) -> F.Place:
    chosen = np.flatnonzero(builder.waypoints(part))
    return F.Quantity(float(chosen[len(chosen) // 2] + 1) if len(chosen) else 1.0, "waypoints", "at")


def _sense(frame: F.Figure) -> str:
    return "" if frame.sense is None else f", clockwise={frame.sense == 'cw'}"


def _turns(builder: PolicyBuilder, frame: F.Figure, default: float, words: str) -> tuple[str, float]:
    turns = default if frame.turns is None else frame.turns.value
    if turns <= 0:
        builder.ask(f"{turns:g} turns: how many should it be?")
    return builder.knob("turns", turns, "count", words, "turns", unit=""), turns


def _circle(builder: PolicyBuilder, frame: F.Figure, place: F.Place) -> None:
    code, words, point = target(builder, place)
    n, turns = _turns(builder, frame, 1.0, f"turns around {words}")
    radius = _radius_around(builder, frame, words, point)
    up, passing = builder.axis("up"), builder.passing(point) - point
    around = radius or f"{np.linalg.norm(passing - (passing @ up) * up):.4g}"
    extra = _sense(frame) + (f", radius={radius}" if radius else "")
    plan = f"From the point closest to {words}, go around it {turns:g} time(s)."
    promise = f"expect_length(longer_by=5 * {n} * {around})"
    builder.add(f"traj = circle(traj, {code}{extra}, turns={n})", plan, promise, ends=stay(builder))


def _radius_around(builder: PolicyBuilder, frame: F.Figure, words: str, point: Array) -> str:
    """The parameter of a circle's radius; "" for the distance at which the path passes what it goes around."""
    gap = float(np.linalg.norm(builder.positions - point, axis=1).min())
    stated = frame.radius or frame.size
    if stated is None and gap >= tolerance(builder):
        return ""
    metres = size(builder, frame, stated, "the radius of the circle")
    metres /= 2 if stated is not None and stated is frame.size else 1
    return builder.knob("circle_radius", metres, "to", f"radius around {words}", "radius", direction="larger")


def _spiral(builder: PolicyBuilder, frame: F.Figure, place: F.Place) -> None:
    at, words = spot(builder, place)
    radius = size(builder, frame, frame.radius or frame.size, "the radius of the spiral")
    meaning = "largest radius of the spiral"
    r = builder.knob("spiral_radius", radius, "to", meaning, "radius", direction="larger")
    n, turns = _turns(builder, frame, 3.0, "turns of the spiral")
    rise = ""
    if frame.rise is not None:
        metres = builder.metres(frame.rise, builder.scale.extent, "up")
        h = builder.knob("spiral_height", metres, "to", "how far the spiral rises", "rise", direction="up")
        rise, words = f", height={h}", f"that rises {metres:g} m, {words}"
    ends = stay(builder)
    if at in ("'goal'", "1.0"):
        ends.pop("goal", None)
    builder.goal_moved = builder.goal_moved or "goal" not in ends
    call = f"traj = spiral(traj, {at}, radius={r}, turns={n}{rise}{_sense(frame)})"
    plan = f"Make a spiral of {turns:g} turns and radius {radius:g} m {words}."
    builder.add(call, plan, f"expect_length(longer_by={r})", ends=ends)


def _eight(builder: PolicyBuilder, frame: F.Figure, place: F.Place) -> None:
    at, words = spot(builder, place)
    metres = size(builder, frame, frame.size or frame.radius, "the size of the figure eight")
    metres *= 4.0 if frame.size is None and frame.radius is not None else 1.0
    name = builder.knob("size", metres, "to", "size of the figure eight", "size", direction="larger")
    promise = f"expect_length(longer_by={name})"
    builder.add(
        f"traj = figure_eight(traj, {at}, size={name})", f"Fly a figure eight {words}.", promise, ends=stay(builder)
    )


def _swing(builder: PolicyBuilder, frame: F.Figure) -> None:
    """A zigzag, a sine wave or shaking, along the path or a part of it."""
    part = frame.part or (_around(builder, frame.place) if frame.place else frame.part)
    where, words = builder.part(part)
    shaking = frame.shape == "shake"
    what = "the shaking" if shaking else f"the amplitude of the {frame.shape}"
    metres = size(builder, frame, frame.size or frame.radius, what, 0.15 if shaking else 0.6)
    a = builder.knob("amplitude", metres, "to", "to each side", "size", direction="larger")
    promises = ["expect_length(longer_by=0.0)", _rest_stays(builder, where)] if builder.alone else []
    if shaking:
        plan = f"Add random displacements of {metres:g} m{words}."
        builder.add(f"traj = noise(traj, {a}{argument(where)})", plan, *promises)
        return
    count = frame.waves or frame.turns
    waves = max(1, round(5 if count is None else count.value))
    n = builder.knob("waves", waves, "count", "number of waves", "waves", unit="")
    call = f"traj = {frame.shape}(traj, {a}, waves={n}{argument(where)})"
    plan = f"Follow the path in a {frame.shape} of {metres:g} m to each side{words}."
    builder.add(call, plan, *promises, ends={} if where else stay(builder))


def _rest_stays(builder: PolicyBuilder, where: str) -> str:
    """The postcondition that the path outside a part is as before, where no other step changes it; or ""."""
    return f"expect_same_path(~{where})" if where and builder.alone else ""


def _around(builder: PolicyBuilder, place: F.Place) -> PathPart:
    """The part of the path around a place."""
    if isinstance(place, str):
        shares = {"start": "first", "goal": "last", "middle": "middle"}
        return PathPart(shares[place], unit="share") if place in shares else PathPart("near", (place,))
    if isinstance(place, tuple):
        return PathPart("between", place)
    code, _ = spot(builder, place)
    n = len(builder.trajectory)
    i = int(code) if code.isdigit() else round(float(code) * (n - 1))
    reach = max(1, round(0.1 * n))
    return PathPart("range", amount=max(i - reach, 0), until=min(i + reach, n - 1))


def mirror(builder: PolicyBuilder, frame: F.Mirror) -> None:
    """Swap left and right, front and back, or up and down."""
    where, part = builder.part(frame.part)
    about = _about(builder, frame.about)
    ends = {} if where else _as_by(builder, f"mirror(original, {frame.axis!r}{about})")
    plan, promise = f"Mirror the path ({frame.axis}){part}.", _rest_stays(builder, where)
    builder.add(f"traj = mirror(traj, {frame.axis!r}{about}{argument(where)})", plan, promise, ends=ends)


def _about(builder: PolicyBuilder, place: F.Place) -> str:
    """The argument of what the path turns about, or ""."""
    return f", about={spot(builder, place)[0]}" if place else ""


def _as_by(builder: PolicyBuilder, call: str) -> dict[str, str]:
    """Postconditions that the ends are where a step alone takes those of the given path."""
    ends = {"start": f"expect_start({call}[0, :3])", "goal": f"expect_goal({call}[-1, :3])"}
    return ends if builder.alone and len(builder.frames) == 1 else {}


def rotate(builder: PolicyBuilder, frame: F.Rotate) -> None:
    """Turn the path about the vertical."""
    where, part = builder.part(frame.part)
    angle = _angle(builder, frame, frame.angle) * (-1 if frame.sense == "cw" else 1)
    name = builder.knob("degrees", angle, "by", "counter-clockwise", "angle", unit="deg")
    about = _about(builder, frame.about)
    turned = "clockwise" if angle < 0 else "counter-clockwise"
    if frame.sense is None:
        builder.assume(f"the path turns {turned}, seen from above")
    ends = {} if where else _as_by(builder, f"rotate(original, {name}{about})")
    ends |= {"start": ENDS_STAY["start"]} if frame.about == "start" and builder.alone else {}
    plan = f"Rotate the path by {abs(angle):g} degrees {turned}{part}."
    builder.add(f"traj = rotate(traj, {name}{about}{argument(where)})", plan, ends=ends)


def _angle(builder: PolicyBuilder, frame: F.SemanticFrame, q: F.Quantity | None) -> float:
    if q is None:
        builder.assume(f"the angle is {TURN[degree(frame)]:g} degrees")
        return TURN[degree(frame)]
    return q.value * {"turns": 360.0, "%": 360.0}.get(q.unit, 1.0)


def tilt(builder: PolicyBuilder, frame: F.Tilt) -> None:
    """Lift the path on one side."""
    side = builder.word(frame.direction)
    if side not in TILT:
        builder.ask("Which side should be lifted: left, right, front or back?")
        return
    angle, meaning = _angle(builder, frame, frame.angle), f"by how much the {side} is lifted"
    name = builder.knob("degrees", angle, "by", meaning, "angle", unit="deg", direction=side)
    turn = f"{name}, axis={TILT[side]!r}"
    ends = {} if frame.part else _as_by(builder, f"tilt(original, {turn})")
    plan = f"Tilt the path by {angle:g} degrees, {side} up."
    _within(builder, frame, f"tilt(traj, {turn})", plan, *ends.values())


def resize(builder: PolicyBuilder, frame: F.Resize) -> None:
    """Larger or smaller as a whole."""
    where, part = builder.part(frame.part)
    factor, about = _size_factor(builder, frame), _about(builder, frame.about)
    meaning = "factor on the size of the path"
    name = builder.knob("factor", factor, "factor", meaning, "by", unit="", direction="larger")
    ends = {end: code for end, code in stay(builder).items() if end == frame.about}
    promise = f"expect_length(times={name})" if builder.alone and not where else ""
    call = f"traj = scale(traj, {name}{about}{argument(where)})"
    builder.add(call, f"Scale the path by {factor:g}{part}.", promise, ends=ends)


def _size_factor(builder: PolicyBuilder, frame: F.Resize) -> float:
    """How many times as large the path becomes."""
    if frame.by is None:
        factor = _grown(RESIZE[degree(frame)], frame.change == "smaller")
        builder.assume(f"the factor is {factor:g}")
        return factor
    plain = F.canonical(frame)
    factor = plain.by.value if isinstance(plain, F.Resize) and plain.by is not None else RESIZE[degree(frame)]
    if frame.by.unit in ("m", "s") or factor <= 0:
        builder.ask(f"How many times as large should the path be, for {frame.by.said or frame.by.value}?")
    elif (frame.by.unit, frame.change, frame.by.role) == ("%", "", "by"):
        builder.assume(f"the path becomes {factor:g} times as large")
    return factor


def _grown(factor: float, inverse: bool) -> float:
    return round(1 / factor, 3) if inverse else factor


def curve(builder: PolicyBuilder, frame: F.Curve) -> None:
    """Bend the path more or less."""
    factor = _grown(RESIZE[degree(frame)], frame.change == "less")
    meaning = "factor on how far the path bends from the straight line"
    name = builder.knob("curvature", factor, "factor", meaning, "change", unit="", direction="larger")
    found = [run for run in runs(builder.waypoints(frame.part)) if run[1] - run[0] > 1] if frame.part else []
    if found:
        # Towards the straight line, or away from it, as far as the factor says.
        for a, b in found[:8]:
            builder.before(f"traj = traj + (1 - {name}) * (straighten(traj, {a}, {b}) - traj)")
        where, part = builder.part(frame.part)
        plan = f"Make the path {frame.change} curved{part} (factor {factor:g})."
        builder.add("", plan, _rest_stays(builder, where))
        return
    seen = f"expect_length({'longer' if factor > 1 else 'shorter'}_by=0.0)" if builder.alone and _winds(builder) else ""
    plan = f"Make the path {frame.change} curved (factor {factor:g})."
    _within(builder, frame, f"curve(traj, {name})", plan, seen, *stay(builder).values())


def _winds(builder: PolicyBuilder) -> bool:
    """Whether the path is so much longer than the straight line that bending it more or less is seen in its length."""
    return float(arc_length(builder.positions)[-1]) > 1.01 * float(
        np.linalg.norm(builder.positions[-1] - builder.positions[0])
    )


def straighten(builder: PolicyBuilder, frame: F.Straighten) -> None:
    """Go straight."""
    if not frame.part:
        promise = "expect_length(shorter_by=0.0)" if builder.alone and _winds(builder) else ""
        plan = "Go in a straight line between start and goal."
        builder.add("traj = straighten(traj)", plan, promise, ends=stay(builder))
        return
    part = resolved(builder, frame.part)
    chosen = np.flatnonzero(builder.waypoints(part))
    if len(chosen) < 2:
        builder.ask(f"A straight line needs two waypoints {part.words()}: from where to where?")
        return
    a, b = int(chosen[0]), int(chosen[-1])
    inside = b - a + 1 < len(builder.trajectory)
    rest = f"expect_same_path(~between(original, {a}, {b}))" if builder.alone and inside else ""
    builder.add(f"traj = straighten(traj, {a}, {b})", f"Go in a straight line {part.words()}.", rest)


def smooth(builder: PolicyBuilder, frame: F.Smooth) -> None:
    """Fewer kinks, less jitter; start and goal stay."""
    strength = _smoothing(builder, frame)
    meaning = "strength of the smoothing"
    name = builder.knob("smoothing", strength, "to", meaning, "degree", unit="", direction="smoother")
    where, _ = builder.part(frame.part)
    promise = f"expect_smoother({where})" if builder.alone and _bends(builder.rows()).any() else ""
    plan = "Smooth the path; start and goal stay."
    _within(builder, frame, f"smooth(traj, {name})", plan, promise, *stay(builder).values())


def _smoothing(builder: PolicyBuilder, frame: F.Smooth) -> float:
    """The strength that the word asks for, or the nearest to it that makes the path smoother."""
    usual, rows = {"slight": 0.3, "moderate": 1.0, "large": 3.0}[degree(frame)], builder.rows()
    part = builder.waypoints(frame.part) if frame.part and len(rows) == len(builder.trajectory) else None
    doubled = [usual * 2.0**k for k in range(int(np.ceil(np.log2(STRONGEST / usual))) + 1)]
    weaker = [] if part is None else [usual / 4.0, usual / 16.0]
    tried = (usual, *weaker, *doubled)
    return next((s for s in tried if _is_smoother(rows, s, part)), usual if weaker else doubled[-1])


def _is_smoother(rows: Array, strength: float, part: Mask | None = None) -> bool:
    """Whether a smoothing, of a part or of all, takes out bends without making the sharpest turn sharper."""
    calm = smoothed(rows, strength)
    before, after = _bends(rows), _bends(calm if part is None else keep_unchanged(calm, rows, ~part))
    if not before.any():
        return True
    sharp = float(before.max()) > SHARP
    calmer = float(after.max()) <= (0.75 if sharp else 1.0) * float(before.max())
    return calmer and (after**2).sum() < 0.95 * (before**2).sum()


def _bends(rows: Array) -> Array:
    """The angle between each two steps of a path [rad]."""
    steps = np.diff(rows[:, :3], axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    steps = steps[lengths > 1e-9] / lengths[lengths > 1e-9, None]
    return np.asarray(np.arccos(np.clip((steps[:-1] * steps[1:]).sum(axis=1), -1.0, 1.0)))


def resample(builder: PolicyBuilder, frame: F.Resample) -> None:
    """Another number of waypoints."""
    n, q = len(builder.trajectory), frame.amount
    if frame.part:
        builder.ask("The number of waypoints can be changed for the whole path only: should it be?")
    if frame.change == "merge":
        k = max(1, round(q.value if q else 3))
        name = builder.knob("group", k, "count", "waypoints that become one", "amount", unit="")
        ends = _count_stays(builder, f"({len(builder.rows())} + {name} - 1) // {name}")
        plan = f"Replace each group of {k} waypoints by its average."
        builder.add(f"traj = average(traj, {name})", plan, ends=ends)
        return
    if q is None:
        builder.assume(f"the number of waypoints is {'doubled' if frame.change == 'more' else 'halved'}")
    count = _resampled(frame.change, q, n)
    if count < 2:
        builder.ask(f"A path has at least 2 waypoints, this one {n}: how many should be left?")
    count = int(np.clip(round(count), 2, 100_000))
    name = builder.knob("waypoints", count, "count", "number of waypoints", "amount", unit="")
    same = "" if builder.moving else "expect_same_path()"
    plan = f"Resample the path to {count} waypoints."
    builder.add(f"traj = resample(traj, {name})", plan, same, ends=_count_stays(builder, name))


def _count_stays(builder: PolicyBuilder, count: str) -> dict[str, str]:
    """The postcondition on the number of waypoints, where nothing is cut off."""
    return {} if builder.has(F.Trim) else {"waypoints": f"expect_waypoints({count})"}


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
    n, q = len(builder.trajectory), frame.amount
    if q is not None:
        unit = {"m": "m", "s": "s", "%": "share", "x": "share"}.get(q.unit, "waypoints")
        part = PathPart(frame.cut, amount=q.value, unit=unit)  # type: ignore[arg-type]
    elif frame.place and frame.cut in ("before", "after"):
        part = _beside(builder, frame)
    else:
        builder.ask(f"How much should be cut off at the {'start' if frame.cut in ('first', 'before') else 'end'}?")
        return
    chosen = builder.waypoints(part)
    if (~chosen).sum() < 2:
        builder.ask(
            f"The path has {n} waypoints, and that would leave {int((~chosen).sum())}: how much should be cut off?"
        )
        return
    where, words = builder.part(part)
    left = np.flatnonzero(~chosen)
    builder.goal_moved = True
    ends = {"start": f"expect_start(original[{left[0]}, :3])", "goal": f"expect_goal(original[{left[-1]}, :3])"}
    builder.add(f"traj = traj[~{where}]", f"Leave waypoints out{words}.", ends=ends if builder.alone else {})


def _beside(builder: PolicyBuilder, frame: F.Trim) -> PathPart:
    """What comes before or after a place, without the waypoint there."""
    code, _ = spot(builder, frame.place)
    n = len(builder.trajectory)
    if isinstance(frame.place, str) and frame.place not in F.SPOTS:
        i = int(np.argmin(builder.scene[frame.place].distance(builder.trajectory.positions)))
    elif isinstance(frame.place, tuple):
        point = np.mean([builder.scene[name].position for name in frame.place], axis=0)
        i = int(np.argmin(np.linalg.norm(builder.trajectory.positions - point, axis=1)))
    else:
        share = {"'start'": 0.0, "'goal'": 1.0}.get(code)
        i = int(code) if code.isdigit() else round((float(code) if share is None else share) * (n - 1))
    if frame.cut == "after":
        return PathPart("range", amount=float(min(i + 1, n - 1)), until=float(n - 1))
    return PathPart("range", amount=0.0, until=float(max(i - 1, 0)))


FIGURE_STEPS: Mapping[type[F.SemanticFrame], Callable[..., None]] = {
    F.Figure: figure, F.Mirror: mirror, F.Rotate: rotate, F.Tilt: tilt, F.Resize: resize, F.Curve: curve,
    F.Straighten: straighten, F.Smooth: smooth, F.Resample: resample, F.Reverse: reverse, F.Trim: trim,
}  # fmt: skip
