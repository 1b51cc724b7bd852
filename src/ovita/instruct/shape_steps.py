"""Steps that give the path a new shape or another speed: spirals, circles, waves, mirrors, bounds, speed laws."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ovita.instruct.draft import IntentDraft, above, argument, mask, suffix
from ovita.instruct.intents import Intent
from ovita.instruct.scale import END_SHARE, FASTER, SLOWER, Degree, nice
from ovita.paths.frame import OPPOSITE
from ovita.paths.scene import SceneObject
from ovita.policy.policy import Role

SIZE: dict[Degree, float] = {"slight": 0.06, "moderate": 0.12, "large": 0.22}
"""Size of a new shape as a share of the path's extent."""

TURN: dict[Degree, float] = {"slight": 15.0, "moderate": 45.0, "large": 90.0}
RESIZE: dict[Degree, float] = {"slight": 1.2, "moderate": 1.5, "large": 2.0}

STANDSTILL = "A speed of 0 would never arrive: how slow should it be, or where should it stop, and for how long?"

SIDE = {"above": "up", "below": "down"}
"""Sides of an object to the directions that they lie in."""


def _size(d: IntentDraft, intent: Intent, what: str, share: float = 1.0) -> float:
    if intent.amount is not None:
        return intent.amount
    value = nice(share * SIZE[intent.degree] * d.scale.extent)
    d.assume(f"{what} is {value:g} m in this scene")
    return value


def _spot(d: IntentDraft, intent: Intent) -> tuple[str, str]:
    if intent.items:
        return d.ref(intent.items[0]), f"closest to {intent.items[0].name}"
    place = {"middle": "0.5"}.get(intent.mode, repr(intent.mode or "goal"))
    return place, f"at the {intent.mode or 'goal'}"


def spiral(d: IntentDraft, intent: Intent) -> None:
    """A spiral at a place."""
    at, words = _spot(d, intent)
    radius = _size(d, intent, "the radius of the spiral")
    turns = intent.count or 3.0
    r = d.knob("spiral_radius", radius, "to", "largest radius of the spiral", unit="m")
    n = d.knob("turns", turns, "count", "turns of the spiral")
    rise = ""
    if intent.directions:
        word, stated = intent.directions[0]
        height = d.scale.step("moderate") if stated is None else stated
        if stated is None:
            d.assume(f"the spiral goes {height:g} m {word}")
        rises = height if word == "up" else -height
        h = d.knob("spiral_height", rises, "to", "how far the spiral rises", unit="m", direction="up")
        rise, words = f", height={h}", f"that goes {height:g} m {word}, {words}"
    d.body.append(f"traj = spiral(traj, {at}, radius={r}, turns={n}{rise})")
    d.plan.append(f"Make a spiral of {turns:g} turns and radius {radius:g} m {words}.")


def circle(d: IntentDraft, intent: Intent) -> None:
    """Turns around an object."""
    item = intent.items[0]
    turns = intent.count or 1.0
    n = d.knob("turns", turns, "count", f"turns around {item.name}", about=item.name)
    radius = ""
    if intent.mode:
        radius = f", clockwise={intent.mode == 'clockwise'}"
    if intent.amount is not None:
        meaning = f"radius around {item.name}"
        radius += f", radius={d.knob('circle_radius', intent.amount, 'to', meaning, unit='m', about=item.name)}"
    d.body.append(f"traj = circle(traj, {d.ref(item)}{radius}, turns={n})")
    d.plan.append(f"From the point closest to {item.name}, go around it {turns:g} time(s).")


def eight(d: IntentDraft, intent: Intent) -> None:
    """A figure eight at a place."""
    at, words = _spot(d, intent)
    metres = _size(d, intent, "the size of the figure eight")
    size = d.knob("size", metres, "to", "size of the figure eight", unit="m")
    d.body.append(f"traj = figure_eight(traj, {at}, size={size})")
    d.plan.append(f"Fly a figure eight {words}.")


def wave(d: IntentDraft, intent: Intent) -> None:
    """A zigzag or a sinusoid along the path."""
    where, part = mask(d, intent.region)
    amplitude = _size(d, intent, f"the amplitude of the {intent.action}", 0.6)
    waves = round(intent.count or 5)
    a = d.knob("amplitude", amplitude, "to", "to each side", unit="m")
    n = d.knob("waves", waves, "count", "number of waves")
    heading = f", direction={intent.directions[0][0]!r}" if intent.directions else ""
    d.body.append(f"traj = {intent.action}(traj, {a}, waves={n}{argument(where)}{heading})")
    d.plan.append(f"Follow the path in a {intent.action} of {amplitude:g} m to each side{suffix(part)}.")


def hop(d: IntentDraft, intent: Intent) -> None:
    """Over an object and down again."""
    item = intent.items[0]
    height = _size(d, intent, f"the height above {item.name}", 0.8)
    name = d.over("height", height, "top", item)
    d.body.append(f"traj = hop(traj, {d.ref(item)}, {name})")
    d.plan.append(f"Hop over {item.name}, {height:g} m above it.")


def hover(d: IntentDraft, intent: Intent) -> None:
    """Above an object, and wait there."""
    item = intent.items[0]
    height = above(d, item, intent.amount)
    steps = 10.0 if intent.count is None else intent.count
    if intent.unit == "s" and intent.count is not None:
        steps = intent.count / d.trajectory.timestep
    name = d.over("height", height, "centre", item)
    meaning = f"timesteps to wait ({d.trajectory.timestep:g} s each)"
    count = d.knob("steps", max(1, round(steps)), "count", meaning, direction="longer")
    d.body.append(f"traj = hover(traj, {d.ref(item)}, {name}, steps={count})")
    d.plan.append(f"Hover {height:g} m above {item.name} for {max(1, round(steps))} timesteps.")


def mirror(d: IntentDraft, intent: Intent) -> None:
    """A mirrored path or part of it."""
    where, part = mask(d, intent.region)
    axis = intent.mode or (intent.directions[0][0] if intent.directions else "x")
    about = f", about={d.ref(intent.items[0])}" if intent.items else ""
    if not intent.mode and not intent.directions:
        d.assume("it is mirrored around the x axis")
    d.body.append(f"traj = mirror(traj, {axis!r}{about}{argument(where)})")
    d.plan.append(f"Mirror the path ({axis}){suffix(part)}.")


def rotate(d: IntentDraft, intent: Intent) -> None:
    """A rotated or tilted path."""
    where, part = mask(d, intent.region)
    degrees = intent.amount
    if degrees is None:
        degrees = TURN[intent.degree] * (intent.count or 1.0)
        d.assume(f"the angle is {abs(degrees):g} degrees")
    name = d.knob("degrees", degrees, "by", "counter-clockwise", unit="deg")
    axis = {"x": "right", "y": "front", "z": "up"}.get(intent.mode, "")
    if not axis and intent.directions:
        axis = intent.directions[0][0]
    extra = f", axis={axis!r}" if axis else ""
    extra += f", about={d.ref(intent.items[0])}" if intent.items else ""
    extra += argument(where) if intent.action == "rotate" else ""
    d.body.append(f"traj = {intent.action}(traj, {name}{extra})")
    about = f" about the axis that points {axis}" if axis else ""
    turned = "clockwise" if degrees < 0 else "counter-clockwise"
    d.plan.append(f"{intent.action.capitalize()} the path by {abs(degrees):g} degrees {turned}{about}{suffix(part)}.")


def resize(d: IntentDraft, intent: Intent) -> None:
    """A larger or smaller path."""
    factor = intent.amount
    if factor is None:
        factor = RESIZE[intent.degree]
        d.assume(f"the factor is {factor:g}")
    if intent.mode == "smaller" and factor > 1:
        factor = round(1 / factor, 3)
    name = d.knob("factor", factor, "factor", "factor on the size of the path")
    about = f", about={d.ref(intent.items[0])}" if intent.items else ""
    d.body.append(f"traj = scale(traj, {name}{about})")
    d.plan.append(f"Scale the path by {factor:g}.")


def curve(d: IntentDraft, intent: Intent) -> None:
    """More or less curvature."""
    factor = intent.amount or RESIZE[intent.degree]
    factor = round(1 / factor, 3) if intent.mode == "less" and factor > 1 else factor
    name = d.knob("curvature", factor, "factor", "factor on how far the path bends from the straight line")
    d.body.append(f"traj = curve(traj, {name})")
    d.plan.append(f"Make the path {'less' if factor < 1 else 'more'} curved (factor {factor:g}).")


def straighten(d: IntentDraft, intent: Intent) -> None:
    """A straight line between two places."""
    if intent.region.kind in ("first", "last", "middle", "range"):
        where, part = mask(d, intent.region)
        name = d.part(where)
        d.body.append(f"traj = straighten(traj, int(np.flatnonzero({name})[0]), int(np.flatnonzero({name})[-1]))")
        d.plan.append(f"Go in a straight line{suffix(part)}.")
        return
    ends = [d.ref(item) for item in intent.items] or ['"start"', '"goal"']
    names = " and ".join(item.name for item in intent.items) or "start and goal"
    if intent.mode:
        ends, names = [*ends, repr(intent.mode)], f"{names} and {intent.mode}"
    d.body.append(f"traj = straighten(traj, {ends[0]}, {ends[1]})")
    d.plan.append(f"Go in a straight line between {names}.")


def shortcut(d: IntentDraft, intent: Intent) -> None:
    """Follow the path to one object, then go straight to another."""
    a, b = intent.items
    d.body.append(f"traj = shortcut(traj, {d.ref(a)}, {d.ref(b)})")
    d.promise(f"expect_goal({d.ref(b)})", about="goal")
    d.plan.append(f"Follow the path until it is closest to {a.name}, then go straight to {b.name}.")


def average(d: IntentDraft, intent: Intent) -> None:
    """Each group of waypoints replaced by its mean."""
    k = max(1, round(intent.amount or 3))
    name = d.knob("group", k, "count", "waypoints that become one")
    d.body.append(f"traj = average(traj, {name})")
    d.plan.append(f"Replace each group of {k} waypoints by its average.")


def reverse(d: IntentDraft, intent: Intent) -> None:
    """The path, or a part of it, the other way round."""
    where, part = mask(d, intent.region)
    d.body.append(f"traj = reverse(traj{argument(where)})")
    d.plan.append(f"Go along the path in the opposite order{suffix(part)}.")


def noise(d: IntentDraft, intent: Intent) -> None:
    """Random displacements."""
    where, part = mask(d, intent.region)
    amount = _size(d, intent, "the noise", 0.15)
    name = d.knob("noise_amount", amount, "to", "standard deviation", unit="m")
    d.body.append(f"traj = noise(traj, {name}{argument(where)})")
    d.plan.append(f"Add random displacements of {amount:g} m{suffix(part)}.")


def bound(d: IntentDraft, intent: Intent) -> None:
    """Never beyond a coordinate."""
    direction, stated = intent.directions[0]
    limit = stated or 0.0
    name = d.knob("limit", limit, "at_most", f"furthest {direction}", unit="m", direction=direction)
    d.body.append(f"traj = bound(traj, {direction}={name})")
    d.promise(f"expect_side({direction!r}, at_most={name})")
    words = f"Never go further {direction} than {limit:g} m."
    words = f"Stay at least {-limit:g} m {OPPOSITE[direction]}." if limit < 0 else words
    d.do(words, holds=bool((d.positions @ d.scene.frame.direction(direction) <= limit).all()))


def side(d: IntentDraft, intent: Intent) -> None:
    """On one side of an object."""
    item = intent.items[0]
    gap = intent.amount
    words = f"{intent.mode}{'' if intent.mode in ('above', 'below') else ' of'} {item.name}"
    if gap is None:
        gap = d.scale.step("slight")
        d.assume(f"the distance kept {words} is {gap:g} m")
    if intent.unit == "pass":
        axis = d.scene.frame.direction(intent.mode)
        if min(float((d.positions[k] - item.position) @ axis) for k in (0, -1)) < gap:
            _pass_by(d, item, intent.mode, gap, words)
            return
    name = d.knob(
        "gap",
        gap,
        "at_least",
        f"distance {words}",
        unit="m",
        about=item.name,
        direction=SIDE.get(intent.mode, intent.mode),
    )
    d.body.append(f"traj = stay_on(traj, {d.ref(item)}, {intent.mode!r}, gap={name})")
    d.do(f"Stay {words} by at least {gap:g} m.", holds=_is_on_side(d, item, intent.mode, gap))


def _is_on_side(d: IntentDraft, item: SceneObject, word: str, gap: float) -> bool:
    """Whether the whole path lies on one side of an object already, a gap [m] from its surface."""
    axis = d.scene.frame.direction(SIDE.get(word, word))
    half = 0.0 if item.dimensions is None else float(np.abs(item.rotation.T @ axis) @ item.size) / 2
    return bool(((d.positions - item.position) @ axis >= half + gap).all())


def _pass_by(d: IntentDraft, item: SceneObject, word: str, gap: float, words: str) -> None:
    """A bend that passes an object on one side, where an end of the path lies on the other."""
    axis = d.scene.frame.direction(word)
    half = 0.0 if item.dimensions is None else float(np.abs(item.rotation.T @ axis) @ item.size) / 2
    meaning = f"distance {words}, from its centre"
    aside = float(f"{half + gap:.4g}")
    name = d.knob("aside", aside, "to", meaning, unit="m", about=item.name, direction=word)
    up = d.scene.frame.direction("up")
    nearest = d.positions[int(np.argmin(item.distance(d.positions)))]
    rise = float((nearest - item.position) @ up)
    height = "" if abs(rise) < 1e-9 or word in ("up", "down") else f", {'up' if rise > 0 else 'down'}={abs(rise)!r}"
    d.body.append(f"traj = go_through(traj, {d.ref(item)}, {word}={name}{height})")
    d.plan.append(f"Bend the path so that it passes {words}, {gap:g} m from its side; start and goal stay.")


def quadrant(d: IntentDraft, intent: Intent) -> None:
    """In one quadrant of the horizontal plane."""
    which = int(intent.amount or 1)
    d.body.append(f"traj = quadrant(traj, {which})")
    d.plan.append(f"Shift the path so that all of it lies in quadrant {which}.")


def trim(d: IntentDraft, intent: Intent) -> None:
    """Waypoints left out."""
    where, part = mask(d, intent.region)
    d.body.append(f"traj = traj[~{where}]" if "|" not in where else f"traj = traj[~({where})]")
    d.plan.append(f"Leave waypoints out{suffix(part)}.")


def height(d: IntentDraft, intent: Intent) -> None:
    """At a height above the ground."""
    where, part = mask(d, intent.region)
    value = intent.amount or 0.0
    name = d.knob("height", value, "to", "height above the ground, z = 0", unit="m", direction="up")
    d.body.append(f"traj = at_height(traj, {name}{argument(where)})")
    d.promise(f"expect_side('up', {name}, {name}{argument(where)})")
    d.plan.append(f"Stay {value:g} m above the ground{suffix(part)}.")


SHAPE_STEPS: dict[str, Callable[[IntentDraft, Intent], None]] = {
    "spiral": spiral,
    "circle": circle,
    "eight": eight,
    "zigzag": wave,
    "wave": wave,
    "hop": hop,
    "hover": hover,
    "mirror": mirror,
    "rotate": rotate,
    "tilt": rotate,
    "resize": resize,
    "curve": curve,
    "straighten": straighten,
    "shortcut": shortcut,
    "average": average,
    "reverse": reverse,
    "noise": noise,
    "bound": bound,
    "side": side,
    "quadrant": quadrant,
    "height": height,
    "trim": trim,
}


def speed(d: IntentDraft, intent: Intent) -> None:
    """A change of speed, or a speed law."""
    where, part = mask(d, intent.region)
    where = d.part(where)
    speeds = d.trajectory.speeds
    mean = float(speeds[speeds > 0].mean()) if (speeds > 0).any() else 0.0
    arguments = f"where={where}" if where else ""
    if intent.mode in ("slower", "faster", "factor"):
        factor = intent.amount
        if factor is None:
            factor = (SLOWER if intent.mode == "slower" else FASTER)[intent.degree]
            d.assume(f'"{intent.mode}" is {factor:g} times the speed')
        if factor <= 0:
            d.ask(STANDSTILL)
        name, word = ("slowdown", "slower") if factor < 1 else ("speedup", "faster")
        knob = d.knob(name, factor, "factor", "factor on the speed", direction=word)
        d.body.append(f"traj = scale_speed(traj, {knob}{argument(where)})")
        d.promise(f"expect_{'slower' if factor < 1 else 'faster'}({arguments})")
        d.plan.append(f"Multiply the speed by {factor:g}{suffix(part)}.")
    elif intent.mode == "add":
        amount = intent.amount or 0.0
        if speeds.size and float(speeds.max()) + amount <= 0:
            d.ask(f"The speed is at most {speeds.max():.3g} m/s, so {-amount:g} m/s less is a standstill: how slow?")
        knob = d.knob("speed_change", amount, "by", "added to the speed", unit="m/s")
        d.body.append(f"traj = shift_speed(traj, {knob}{argument(where)})")
        d.promise(f"expect_{'slower' if amount < 0 else 'faster'}({arguments})")
        d.plan.append(f"{'Lower' if amount < 0 else 'Raise'} the speed by {abs(amount):g} m/s{suffix(part)}.")
    elif intent.mode in ("set", "constant"):
        value = intent.amount
        if value is None:
            value = float(f"{mean:.3g}")
            d.assume(f"the constant speed is the mean of the original, {value:g} m/s")
        if value <= 0 and mean > 0:
            d.ask(STANDSTILL)
        knob = d.knob("speed", value, "to", unit="m/s")
        d.body.append(f"traj = set_speed(traj, {knob}{argument(where)})")
        d.promise(f"expect_speed({knob}{argument(where)})")
        d.plan.append(f"Set the speed to {value:g} m/s{suffix(part)}.")
    elif intent.mode in ("cap", "floor"):
        value = intent.amount or 0.0
        if value <= 0 and intent.mode == "cap":
            d.ask(STANDSTILL)
        role: Role = "at_most" if intent.mode == "cap" else "at_least"
        meaning = f"{'highest' if intent.mode == 'cap' else 'lowest'} speed"
        name = d.knob("limit", value, role, meaning, unit="m/s")
        beyond = f"traj[:, 3] {'>' if intent.mode == 'cap' else '<'} {name}"
        chosen = f"({where}) & ({beyond})" if where else beyond
        d.body.append(f"traj = set_speed(traj, {name}, where={chosen})")
        d.promise(f"expect_speed({role}={name}{argument(where)})")
        inside = bool((speeds <= value).all() if intent.mode == "cap" else (speeds >= value).all())
        bound = "most" if intent.mode == "cap" else "least"
        d.do(f"Keep the speed at {bound} {value:g} m/s{suffix(part)}.", holds=inside)
    elif intent.mode.startswith("ramp"):
        _ramp(d, intent, where, part, mean)
    else:
        _law(d, intent, where, part, mean)


def _ramp(d: IntentDraft, intent: Intent, where: str, part: str, mean: float) -> None:
    """A speed that changes steadily along the path or a part of it."""
    speeds = d.trajectory.speeds
    if intent.mode == "ramp_from":
        a = d.knob("start_speed", 0.0, "to", "where the change begins", unit="m/s")
        d.body.append(f"traj = ramp_speed(traj, {a}, None{argument(where)})")
        d.plan.append(f"Begin at rest and speed up steadily{suffix(part)}.")
        return
    at_end = intent.region.kind == "last"
    at = {"last": 1.0 - (intent.region.amount or END_SHARE), "middle": 0.33}.get(intent.region.kind, 0.0)
    if intent.region.counted:
        at = 1.0 - (intent.region.amount or 1.0) / len(speeds) if at_end else 0.0
    first = float(speeds[min(round(max(at, 0.0) * len(speeds)), len(speeds) - 1)])
    if intent.mode == "ramp_up":
        begin, end = min(first, 0.5 * mean), 1.5 * float(speeds.max())
    else:
        begin = first if first > 0.2 * mean else mean
        begin = intent.count if intent.count is not None else begin
        end = intent.amount if intent.amount is not None else 0.0 if at_end or not where else 0.25 * mean
        now = float(speeds[round(at * len(speeds)) :].mean())
        if at_end and intent.amount is None and begin + end > 1.5 * now:
            begin = 0.5 * begin  # it falls there already; a lower speed must be clearly lower
    begin, end = float(f"{begin:.3g}"), float(f"{end:.3g}")
    a = d.knob("start_speed", begin, "to", "where the change begins", unit="m/s")
    b = d.knob("end_speed", end, "to", "where the change ends", unit="m/s")
    if intent.amount is None:
        d.assume(f"the speed changes steadily from {begin:g} to {end:g} m/s")
    d.body.append(f"traj = ramp_speed(traj, {a}, {b}{argument(where)})")
    d.plan.append(f"Change the speed steadily from {begin:g} to {end:g} m/s{suffix(part)}.")


def _law(d: IntentDraft, intent: Intent, where: str, part: str, mean: float) -> None:
    """A speed law by name: slow in turns, trapezoidal, exponential, constant acceleration."""
    law, _, falling = intent.mode.partition("_")
    if law == "turns":
        factor = intent.amount if intent.amount is not None else SLOWER[intent.degree]
        name = d.knob("slowdown", factor, "factor", "factor on the speed in turns", direction="slower")
        d.body.append(f"traj = slow_turns(traj, {name})")
        d.plan.append(f"Slow down before and in turns, to {factor:g} times the speed.")
    elif law == "trapezoid":
        cruise = intent.amount if intent.amount is not None else float(f"{mean:.3g}")
        name = d.knob("cruise", cruise, "to", "speed between the ramps", unit="m/s")
        d.body.append(f"traj = trapezoid_speed(traj, {name})")
        d.plan.append(f"Speed up to {cruise:g} m/s, keep it, and slow down again (a trapezoid).")
    elif law == "acceleration":
        rate = intent.amount
        if rate is None:
            rate = float(f"{mean**2 / max(2 * d.trajectory.length, 1e-9):.2g}")
            d.assume(f"the acceleration is {rate:g} m/s^2")
        rate = -abs(rate) if falling else rate
        name = d.knob("acceleration", rate, "to", unit="m/s^2")
        d.body.append(f"traj = accelerate(traj, {name}{argument(where)})")
        d.plan.append(f"Accelerate at a constant {rate:g} m/s^2{suffix(part)}.")
    else:
        low, high = float(f"{0.25 * mean:.3g}"), float(f"{1.5 * mean:.3g}")
        begin, end = (high, low) if falling else (low, high)
        a = d.knob("start_speed", begin, "to", "where the change begins", unit="m/s")
        b = d.knob("end_speed", end, "to", "where the change ends", unit="m/s")
        d.assume(f"the speed changes exponentially from {begin:g} to {end:g} m/s")
        d.body.append(f"traj = exponential_speed(traj, {a}, {b}{argument(where)})")
        d.plan.append(f"Change the speed exponentially from {begin:g} to {end:g} m/s{suffix(part)}.")
