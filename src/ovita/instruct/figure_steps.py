"""Steps that give the path another form: figures, mirrors, turns, sizes, bends, waypoints."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ovita.instruct import frames as F
from ovita.instruct.builder import PolicyBuilder, argument, resolved
from ovita.instruct.lexicon import Degree
from ovita.instruct.path_steps import degree, size, spot, target, tolerance
from ovita.paths.geometry import Mask, closest_to_point, runs
from ovita.paths.part import PathPart
from ovita.paths.trajectory import Array, arc_length, interpolate
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


def stay(d: PolicyBuilder) -> dict[str, str]:
    """Postconditions that the ends stay, where no other step moves them."""
    return dict(ENDS_STAY) if d.alone else {}


def _within(d: PolicyBuilder, frame: F.SemanticFrame, call: str, plan: str, *promises: str) -> None:
    """A step that changes the whole path, undone outside the part that it is about."""
    where, part = d.part(frame.part)
    if not where:
        d.add(f"traj = {call}", plan, *promises)
        return
    d.before("given = traj")
    d.add(f"traj = keep_unchanged({call}, given, ~{where})", plan.removesuffix(".") + f"{part}.",
          f"expect_same_path(~{where})" if d.alone else "", *(p for p in promises if where in p))  # fmt: skip


def figure(d: PolicyBuilder, frame: F.Figure) -> None:
    """A figure on the way."""
    if frame.shape in ("zigzag", "wave", "shake"):
        _swing(d, frame)
        return
    place = frame.place or (_middle_of(d, frame.part) if frame.part else "goal")
    if frame.shape == "circle" and not frame.place:
        d.ask("What should it go around?")
        return
    {"circle": _circle, "spiral": _spiral, "eight": _eight}[frame.shape](d, frame, place)


def _middle_of(d: PolicyBuilder, part: PathPart) -> F.Place:
    chosen = np.flatnonzero(d.waypoints(part))
    return F.Quantity(float(chosen[len(chosen) // 2] + 1) if len(chosen) else 1.0, "waypoints", "at")


def _sense(frame: F.Figure) -> str:
    return "" if frame.sense is None else f", clockwise={frame.sense == 'cw'}"


def _turns(d: PolicyBuilder, frame: F.Figure, default: float, words: str) -> tuple[str, float]:
    turns = default if frame.turns is None else frame.turns.value
    if turns <= 0:
        d.ask(f"{turns:g} turns: how many should it be?")
    return d.knob("turns", turns, "count", words, "turns", unit=""), turns


def _circle(d: PolicyBuilder, frame: F.Figure, place: F.Place) -> None:
    code, words, point = target(d, place)
    n, turns = _turns(d, frame, 1.0, f"turns around {words}")
    extra, within = _sense(frame), ""
    gap = float(np.linalg.norm(d.positions - point, axis=1).min())
    radius = frame.radius or frame.size
    if radius is not None or gap < tolerance(d):
        metres = size(d, frame, radius, "the radius of the circle")
        if radius is not None and radius is frame.size:
            metres /= 2
        within = d.knob("circle_radius", metres, "to", f"radius around {words}", "radius", direction="larger")
        extra += f", radius={within}"
    passing = interpolate(d.positions, np.array([closest_to_point(d.positions, point)[1]]))[0] - point
    passing -= (passing @ d.scene.frame.direction("up")) * d.scene.frame.direction("up")
    around = within or f"{np.linalg.norm(passing):.4g}"
    d.add(f"traj = circle(traj, {code}{extra}, turns={n})",
          f"From the point closest to {words}, go around it {turns:g} time(s).",
          f"expect_length(longer_by=5 * {n} * {around})", ends=stay(d))  # fmt: skip


def _spiral(d: PolicyBuilder, frame: F.Figure, place: F.Place) -> None:
    at, words = spot(d, place)
    radius = size(d, frame, frame.radius or frame.size, "the radius of the spiral")
    r = d.knob("spiral_radius", radius, "to", "largest radius of the spiral", "radius", direction="larger")
    n, turns = _turns(d, frame, 3.0, "turns of the spiral")
    rise = ""
    if frame.rise is not None:
        metres = d.metres(frame.rise, d.scale.extent, "up")
        h = d.knob("spiral_height", metres, "to", "how far the spiral rises", "rise", direction="up")
        rise, words = f", height={h}", f"that rises {metres:g} m, {words}"
    promises = {} if at in ("'goal'", "1.0") else stay(d)
    d.goal_moved = d.goal_moved or not promises
    d.add(f"traj = spiral(traj, {at}, radius={r}, turns={n}{rise}{_sense(frame)})",
          f"Make a spiral of {turns:g} turns and radius {radius:g} m {words}.", f"expect_length(longer_by={r})",
          ends=({"start": ENDS_STAY["start"]} if d.alone else {}) | promises)  # fmt: skip


def _eight(d: PolicyBuilder, frame: F.Figure, place: F.Place) -> None:
    at, words = spot(d, place)
    metres = size(d, frame, frame.size or frame.radius, "the size of the figure eight")
    metres *= 4.0 if frame.size is None and frame.radius is not None else 1.0
    name = d.knob("size", metres, "to", "size of the figure eight", "size", direction="larger")
    d.add(f"traj = figure_eight(traj, {at}, size={name})", f"Fly a figure eight {words}.",
          f"expect_length(longer_by={name})", ends=stay(d))  # fmt: skip


def _swing(d: PolicyBuilder, frame: F.Figure) -> None:
    """A zigzag, a sine wave or shaking, along the path or a part of it."""
    part = frame.part or (_around(d, frame.place) if frame.place else frame.part)
    where, words = d.part(part)
    shaking = frame.shape == "shake"
    what = "shaking" if shaking else f"amplitude of the {frame.shape}"
    metres = size(d, frame, frame.size or frame.radius, f"the {what}", 0.15 if shaking else 0.6)
    a = d.knob("amplitude", metres, "to", "to each side", "size", direction="larger")
    alone = ("expect_length(longer_by=0.0)", f"expect_same_path(~{where})" if where else "") if d.alone else ()
    if shaking:
        d.add(f"traj = noise(traj, {a}{argument(where)})", f"Add random displacements of {metres:g} m{words}.", *alone)
        return
    count = frame.waves or frame.turns
    waves = max(1, round(5 if count is None else count.value))
    n = d.knob("waves", waves, "count", "number of waves", "waves", unit="")
    d.add(f"traj = {frame.shape}(traj, {a}, waves={n}{argument(where)})",
          f"Follow the path in a {frame.shape} of {metres:g} m to each side{words}.",
          *alone, ends={} if where else stay(d))  # fmt: skip


def _around(d: PolicyBuilder, place: F.Place) -> PathPart:
    """The part of the path around a place."""
    if isinstance(place, str):
        shares = {"start": "first", "goal": "last", "middle": "middle"}
        return PathPart(shares[place], unit="share") if place in shares else PathPart("near", (place,))
    if isinstance(place, tuple):
        return PathPart("between", place)
    code, _ = spot(d, place)
    n = len(d.trajectory)
    i = int(code) if code.isdigit() else round(float(code) * (n - 1))
    reach = max(1, round(0.1 * n))
    return PathPart("range", amount=max(i - reach, 0), until=min(i + reach, n - 1))


def mirror(d: PolicyBuilder, frame: F.Mirror) -> None:
    """Swap left and right, front and back, or up and down."""
    where, part = d.part(frame.part)
    about = f", about={spot(d, frame.about)[0]}" if frame.about else ""
    d.add(f"traj = mirror(traj, {frame.axis!r}{about}{argument(where)})", f"Mirror the path ({frame.axis}){part}.",
          f"expect_same_path(~{where})" if where and d.alone else "",
          ends={} if where else _as_by(d, f"mirror(original, {frame.axis!r}{about})"))  # fmt: skip


def _as_by(d: PolicyBuilder, call: str) -> dict[str, str]:
    """Postconditions that the ends are where a step alone takes those of the given path."""
    ends = {"start": f"expect_start({call}[0, :3])", "goal": f"expect_goal({call}[-1, :3])"}
    return ends if d.alone and len(d.frames) == 1 else {}


def rotate(d: PolicyBuilder, frame: F.Rotate) -> None:
    """Turn the path about the vertical."""
    where, part = d.part(frame.part)
    angle = _angle(d, frame, frame.angle)
    angle = -angle if frame.sense == "cw" else angle
    name = d.knob("degrees", angle, "by", "counter-clockwise", "angle", unit="deg")
    about = f", about={spot(d, frame.about)[0]}" if frame.about else ""
    turned = "clockwise" if angle < 0 else "counter-clockwise"
    if frame.sense is None:
        d.assume(f"the path turns {turned}, seen from above")
    at_start = {} if where else _as_by(d, f"rotate(original, {name}{about})")
    at_start |= {"start": ENDS_STAY["start"]} if frame.about == "start" and d.alone else {}
    d.add(f"traj = rotate(traj, {name}{about}{argument(where)})",
          f"Rotate the path by {abs(angle):g} degrees {turned}{part}.", ends=at_start)  # fmt: skip


def _angle(d: PolicyBuilder, frame: F.SemanticFrame, q: F.Quantity | None) -> float:
    if q is None:
        d.assume(f"the angle is {TURN[degree(frame)]:g} degrees")
        return TURN[degree(frame)]
    return q.value * {"turns": 360.0, "%": 360.0}.get(q.unit, 1.0)


def tilt(d: PolicyBuilder, frame: F.Tilt) -> None:
    """Lift the path on one side."""
    side = d.word(frame.direction)
    if side not in TILT:
        d.ask("Which side should be lifted: left, right, front or back?")
        return
    angle = _angle(d, frame, frame.angle)
    name = d.knob("degrees", angle, "by", f"by how much the {side} is lifted", "angle", unit="deg", direction=side)
    ends = {} if frame.part else _as_by(d, f"tilt(original, {name}, axis={TILT[side]!r})")
    _within(d, frame, f"tilt(traj, {name}, axis={TILT[side]!r})", f"Tilt the path by {angle:g} degrees, {side} up.",
            *ends.values())  # fmt: skip


def resize(d: PolicyBuilder, frame: F.Resize) -> None:
    """Larger or smaller as a whole."""
    where, part = d.part(frame.part)
    plain = F.canonical(frame)
    factor = plain.by.value if isinstance(plain, F.Resize) and plain.by is not None else RESIZE[degree(frame)]
    if frame.by is None:
        factor = round(1 / factor, 3) if frame.change == "smaller" else factor
        d.assume(f"the factor is {factor:g}")
    elif frame.by.unit in ("m", "s") or factor <= 0:
        d.ask(f"How many times as large should the path be, for {frame.by.said or frame.by.value}?")
    elif frame.by.unit == "%" and not frame.change and frame.by.role == "by":
        d.assume(f"the path becomes {factor:g} times as large")
    name = d.knob("factor", factor, "factor", "factor on the size of the path", "by", unit="", direction="larger")
    about = f", about={spot(d, frame.about)[0]}" if frame.about else ""
    ends = {end: code for end, code in stay(d).items() if end == frame.about}
    d.add(f"traj = scale(traj, {name}{about}{argument(where)})", f"Scale the path by {factor:g}{part}.",
          f"expect_length(times={name})" if d.alone and not where else "", ends=ends)  # fmt: skip


def curve(d: PolicyBuilder, frame: F.Curve) -> None:
    """Bend the path more or less."""
    factor = RESIZE[degree(frame)]
    factor = round(1 / factor, 3) if frame.change == "less" else factor
    name = d.knob("curvature", factor, "factor", "factor on how far the path bends from the straight line", "change",
                  unit="", direction="larger")  # fmt: skip
    more = "more" if frame.change == "more" else "less"
    found = [run for run in runs(d.waypoints(frame.part)) if run[1] - run[0] > 1] if frame.part else []
    if found:
        # Towards the straight line, or away from it, as far as the factor says.
        for a, b in found[:8]:
            d.before(f"traj = traj + (1 - {name}) * (straighten(traj, {a}, {b}) - traj)")
        where, part = d.part(frame.part)
        plan = f"Make the path {more} curved{part} (factor {factor:g})."
        d.add("", plan, f"expect_same_path(~{where})" if d.alone else "")
        return
    _within(
        d,
        frame,
        f"curve(traj, {name})",
        f"Make the path {more} curved (factor {factor:g}).",
        f"expect_length({'longer' if factor > 1 else 'shorter'}_by=0.0)" if d.alone and _winds(d) else "",
        *stay(d).values(),
    )


def _winds(d: PolicyBuilder) -> bool:
    """Whether the path is so much longer than the straight line that bending it more or less is seen in its length."""
    return float(arc_length(d.positions)[-1]) > 1.01 * float(np.linalg.norm(d.positions[-1] - d.positions[0]))


def straighten(d: PolicyBuilder, frame: F.Straighten) -> None:
    """Go straight."""
    if not frame.part:
        d.add(
            "traj = straighten(traj)",
            "Go in a straight line between start and goal.",
            "expect_length(shorter_by=0.0)" if d.alone and _winds(d) else "",
            ends=stay(d),
        )
        return
    part = resolved(d, frame.part)
    chosen = np.flatnonzero(d.waypoints(part))
    if len(chosen) < 2:
        d.ask(f"A straight line needs two waypoints {part.words()}: from where to where?")
        return
    a, b = int(chosen[0]), int(chosen[-1])
    rest = f"expect_same_path(~between(original, {a}, {b}))" if d.alone and b - a + 1 < len(d.trajectory) else ""
    d.add(f"traj = straighten(traj, {a}, {b})", f"Go in a straight line {part.words()}.", rest)


def smooth(d: PolicyBuilder, frame: F.Smooth) -> None:
    """Fewer kinks, less jitter; start and goal stay."""
    strength, rows = {"slight": 0.3, "moderate": 1.0, "large": 3.0}[degree(frame)], d.rows()
    part = d.waypoints(frame.part) if frame.part and len(rows) == len(d.trajectory) else None
    doubled = [strength * 2.0**k for k in range(int(np.ceil(np.log2(STRONGEST / strength))) + 1)]
    weaker = [] if part is None else [strength / 4.0, strength / 16.0]
    strength = next(
        (s for s in (strength, *weaker, *doubled) if _is_smoother(rows, s, part)), doubled[0 if weaker else -1]
    )
    name = d.knob("smoothing", strength, "to", "strength of the smoothing", "degree", unit="", direction="smoother")
    where, _ = d.part(frame.part)
    promise = f"expect_smoother({where})" if d.alone and _bends(d.rows()).any() else ""
    _within(d, frame, f"smooth(traj, {name})", "Smooth the path; start and goal stay.", promise, *stay(d).values())


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


def resample(d: PolicyBuilder, frame: F.Resample) -> None:
    """Another number of waypoints."""
    n, q = len(d.trajectory), frame.amount
    if frame.part:
        d.ask("The number of waypoints can be changed for the whole path only: should it be?")
    if frame.change == "merge":
        k = max(1, round(q.value if q else 3))
        name = d.knob("group", k, "count", "waypoints that become one", "amount", unit="")
        code = f"({len(d.rows())} + {name} - 1) // {name}"
        d.add(f"traj = average(traj, {name})", f"Replace each group of {k} waypoints by its average.",
              ends={} if d.has(F.Trim) else {"waypoints": f"expect_waypoints({code})"})  # fmt: skip
        return
    if q is None:
        d.assume(f"the number of waypoints is {'doubled' if frame.change == 'more' else 'halved'}")
    count = _resampled(frame.change, q, n)
    if count < 2:
        d.ask(f"A path has at least 2 waypoints, this one {n}: how many should be left?")
    count = int(np.clip(round(count), 2, 100_000))
    name = d.knob("waypoints", count, "count", "number of waypoints", "amount", unit="")
    d.add(f"traj = resample(traj, {name})", f"Resample the path to {count} waypoints.",
          "" if d.moving else "expect_same_path()",
          ends={} if d.has(F.Trim) else {"waypoints": f"expect_waypoints({name})"})  # fmt: skip


def _resampled(change: str, q: F.Quantity | None, n: int) -> float:
    """How many waypoints there are after a change of n."""
    if q is None:
        return n * (2.0 if change == "more" else 0.5)
    if q.unit not in ("x", "%"):
        return q.value if change == "to" else n - q.value if change == "fewer" else n + q.value
    if change == "fewer":
        return n * (1 - q.value if q.value < 1 else 1 / q.value)
    return n * (1 + q.value if change == "more" and q.unit == "%" else q.value)


def reverse(d: PolicyBuilder, frame: F.Reverse) -> None:
    """Run the path, or a part of it, backwards."""
    where, part = d.part(frame.part)
    ends = {"start": "expect_start(original[-1, :3])", "goal": "expect_goal(original[0, :3])"}
    d.add(f"traj = reverse(traj{argument(where)})", f"Go along the path in the opposite order{part}.",
          ends=ends if d.alone and not where else {})  # fmt: skip


def trim(d: PolicyBuilder, frame: F.Trim) -> None:
    """Cut off the first or last so much, or what comes before or after a place."""
    n, q = len(d.trajectory), frame.amount
    if q is not None:
        unit = {"m": "m", "s": "s", "%": "share", "x": "share"}.get(q.unit, "waypoints")
        part = PathPart(frame.cut, amount=q.value, unit=unit)  # type: ignore[arg-type]
    elif frame.place and frame.cut in ("before", "after"):
        part = _beside(d, frame)
    else:
        d.ask(f"How much should be cut off at the {'start' if frame.cut in ('first', 'before') else 'end'}?")
        return
    chosen = d.waypoints(part)
    if (~chosen).sum() < 2:
        d.ask(f"The path has {n} waypoints, and that would leave {int((~chosen).sum())}: how much should be cut off?")
        return
    where, words = d.part(part)
    left = np.flatnonzero(~chosen)
    d.goal_moved = True
    ends = {"start": f"expect_start(original[{left[0]}, :3])", "goal": f"expect_goal(original[{left[-1]}, :3])"}
    d.add(f"traj = traj[~{where}]", f"Leave waypoints out{words}.", ends=ends if d.alone else {})


def _beside(d: PolicyBuilder, frame: F.Trim) -> PathPart:
    """What comes before or after a place, without the waypoint there."""
    code, _ = spot(d, frame.place)
    n = len(d.trajectory)
    if isinstance(frame.place, str) and frame.place not in F.SPOTS:
        i = int(np.argmin(d.scene[frame.place].distance(d.trajectory.positions)))
    elif isinstance(frame.place, tuple):
        point = np.mean([d.scene[name].position for name in frame.place], axis=0)
        i = int(np.argmin(np.linalg.norm(d.trajectory.positions - point, axis=1)))
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
