"""Steps about objects: nearer and farther, distances to keep, through, over, under, on one side, hovering."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import cast

import numpy as np

from ovita.instruct import frames as F
from ovita.instruct.builder import PolicyBuilder, aiming, argument, short
from ovita.instruct.lexicon import nice
from ovita.instruct.path_steps import APPROACH, OF, aimed_at, degree, size, steps, tolerance, usual_gap
from ovita.paths.geometry import closest_to_point
from ovita.paths.scene import SceneObject
from ovita.paths.trajectory import Array, interpolate, source_indices
from ovita.policy.source import Role
from ovita.toolkit.approach import extent


def approach(builder: PolicyBuilder, frame: F.Approach) -> None:
    """Nearer to objects, never through the surface, or farther from them."""
    for name in frame.objects:
        (_closer if frame.sense == "closer" else _farther)(builder, frame, builder.scene[name])


def _gap_metres(builder: PolicyBuilder) -> float:
    """The least distance to a surface [m]: a centimetre, or less in a small scene."""
    return min(0.01, nice(0.005 * builder.scale.extent))


def _gap(builder: PolicyBuilder) -> str:
    return "" if _gap_metres(builder) == 0.01 else f", gap={_gap_metres(builder):g}"


def _reach(builder: PolicyBuilder, where: str) -> str:
    """On a part that is named, all of it comes closer or goes farther, not only what is nearest."""
    return f", reach={nice(4 * builder.scale.extent):g}" if where else ""


def surface_distance(item: SceneObject, positions: Array) -> float:
    """How near a path comes to an object's surface [m]; to its centre if its size is not known."""
    if item.dimensions is None:
        return closest_to_point(positions, item.position)[0]
    return float(item.cuboid.closest(positions)[0])


def _closer(builder: PolicyBuilder, frame: F.Approach, item: SceneObject) -> None:
    where, part = builder.part(frame.part)
    by = _usual_pull(builder, frame, item) if frame.by is None else _stated_pull(builder, frame.by, item)
    ref, meaning = builder.ref(item), f"how much closer to {item.name}"
    name = builder.knob("closer_by", by, "by", meaning, "by", about=item.name, direction="closer")
    stated = "" if frame.by is None or where else f", {name}"
    further = f"{_gap(builder)}{_reach(builder, where)}{argument(where)}{builder.hold()}"
    builder.add(
        f"traj = closer(traj, {ref}, {name}{further})",
        f"Bring the path {by:g} m closer to {item.name}{part}.",
        f"expect_closer({ref}{stated}{argument(where)})",
    )


def _usual_pull(builder: PolicyBuilder, frame: F.Approach, item: SceneObject) -> float:
    """How much closer to an object suits the scene [m]."""
    if frame.degree == "slight":
        by = builder.scale.step("slight")
    else:
        now = closest_to_point(builder.positions, item.position)[0]
        by = APPROACH[degree(frame)] * (now + 0.1 * builder.scale.extent)
    by = nice(builder.effort * by)
    builder.assume(f'"closer to {item.name}" is {by:g} m closer')
    return by


def _stated_pull(builder: PolicyBuilder, q: F.Quantity, item: SceneObject) -> float:
    """How much closer to an object is said [m]: by a length, by a share of the distance, or to a share of it."""
    now, most = closest_to_point(builder.positions, item.position)[0], surface_distance(item, builder.positions)
    left = {"%": 1 - q.value, "x": 1 / max(q.value, 1.01) if q.value > 1 else q.value}.get(q.unit, 1.0)
    by = nice(now * (1 - left)) or builder.metres(q, now, f"closer to {item.name}")
    if by > most + 1e-9:
        builder.assume(f"closer to {item.name} ends at its surface, {max(most, 0.0):.3g} m closer, not {by:g} m")
    return by


def _farther(builder: PolicyBuilder, frame: F.Approach, item: SceneObject) -> None:
    where, part = builder.part(frame.part)
    ref, q, about = builder.ref(item), frame.by, item.name
    promise = f"expect_farther({ref}{argument(where)})"
    if q is not None and q.unit in ("x", "%"):
        times = q.value if q.unit == "x" and q.value > 1 else 1.0 + q.value
        meaning = f"factor on the distance to {about}"
        name = builder.knob("times", times, "factor", meaning, "by", unit="", about=about, direction="away")
        call = f"traj = farther(traj, {ref}, times={name}{argument(where)}{builder.hold()})"
        builder.add(call, f"Multiply the distance to {about} by {times:g}{part}.", promise)
        return
    if q is None:
        by, gain = builder.scale.step(degree(frame)), _gained(builder, item)
        if gain >= by and not where:
            builder.add("", f"This already takes the path {gain:.3g} m farther from {about}.", promise)
            return
        builder.assume(f'"away from {about}" is {by:g} m farther')
        by = nice(builder.effort * _push_needed(builder, item, by))
    else:
        by = builder.metres(q, 1.0, f"farther from {about}")
    name = builder.knob("farther_by", by, "by", f"how much farther from {about}", "by", about=about, direction="away")
    call = f"traj = farther(traj, {ref}, {name}{_reach(builder, where)}{argument(where)}{builder.hold()})"
    builder.add(call, f"Take the path {by:g} m farther from {about}{part}.", promise)


def _gained(builder: PolicyBuilder, item: SceneObject) -> float:
    """How much farther from an object the steps before have taken the path, at its nearest and on average [m]."""
    now, was = item.distance(builder.positions), item.distance(builder.trajectory.positions)
    return min(float(now.min() - was.min()), float(now.mean() - was.mean()))


def _push_needed(builder: PolicyBuilder, item: SceneObject, gain: float) -> float:
    """The push that takes the closest waypoint `gain` metres farther than it was at first [m].

    Shifts before may have brought it closer, and along the directions that are held the push does not act.
    """
    away = builder.positions - item.position
    i = int(np.argmin(np.linalg.norm(away, axis=1)))
    free = away[i].copy()
    for word in builder.exact:
        axis = builder.axis(word)
        free -= float(free @ axis) * axis
    now, length = float(np.linalg.norm(away[i])), float(np.linalg.norm(free))
    wanted = float(item.distance(builder.trajectory.positions).min()) + gain
    across = max(now**2 - length**2, 0.0)
    needed = (max(wanted**2 - across, 0.0) ** 0.5 - length) * now / max(length, 0.05 * now, 1e-9)
    return float(np.clip(needed, gain, 2.5 * gain))


def clearance(builder: PolicyBuilder, frame: F.Clearance) -> None:
    """At least so far from objects, or at most so far all along; else so near at the closest approach to each."""
    q, names = frame.distance, " and ".join(frame.objects)
    items = [builder.scene[name] for name in frame.objects]
    if q.role == "at_least" and q.value == 0:
        metres = max(usual_gap(builder), *(builder.room(item) for item in items))
        builder.assume(f"clear of {names} is at least {metres:g} m from the surface")
    else:
        metres = builder.metres(q, 1.0, f"from {names}")
    where, part = builder.part(frame.part)
    nearing = q.role in ("at_most", "at")
    if not nearing or frame.along:
        _hold(builder, items, metres, q.role if nearing else "at_least", where, part)
        return
    for item in items:
        _come_within(builder, item, metres, q.role, where, part)


def _hold(
    builder: PolicyBuilder, items: Sequence[SceneObject], metres: float, bound: str, where: str, part: str
) -> None:
    """A distance to objects that is kept all along."""
    told, about = bound.replace("_", " "), items[0].name if len(items) == 1 else ""
    role, direction = ("at_least", "away") if bound == "at_least" else ("at_most", "closer")
    meaning = f"distance to keep, {told}"
    name = builder.knob("distance", metres, cast(Role, role), meaning, "distance", about=about, direction=direction)
    if role == "at_most":
        _reached(builder, items, metres)
    refs = [builder.ref(item) for item in items]
    code = refs[0] if len(refs) == 1 else f"[{', '.join(refs)}]"
    call = f"traj = keep_distance(traj, {code}, {bound}={name}{argument(where)})"
    if role == "at_least" and not where:
        builder.distances += [(item, metres, call) for item in items]
    plan = f"Keep {told} {metres:g} m from {' and '.join(item.name for item in items)}{part}."
    builder.add(call, plan, *(f"expect_distance({ref}, {bound}={name}{argument(where)})" for ref in refs))


def _reached(builder: PolicyBuilder, items: Sequence[SceneObject], metres: float) -> None:
    """A greatest distance is measured to the centres, which must not lie farther in than that."""
    for item in items:
        builder.assume(f"{metres:g} m from {item.name} is measured to its centre")
        if item.radius > metres:
            builder.ask(
                f"{item.name} itself reaches {item.radius:.3g} m from its centre: how far from that may the path be?"
            )


def _come_within(builder: PolicyBuilder, item: SceneObject, metres: float, bound: str, where: str, part: str) -> None:
    """Bring the closest stretch so near to an object's surface; what is nearer stays, or moves out if "at" is asked."""
    ref, exact = builder.ref(item), bound == "at"
    now = surface_distance(item, builder.positions)
    sentence = f"{'Pass' if exact else 'Come within'} {metres:g} m {'from' if exact else 'of'} {item.name}{part}."
    meaning = f"distance to {item.name}, {'exactly' if exact else 'at most'}"
    role: Role = "at" if exact else "at_most"
    name = builder.knob("distance", metres, role, meaning, "distance", about=item.name, direction="away")
    if not exact and not where and now <= metres + 1e-6:
        within = closest_to_point(builder.positions, item.position)[0] - now
        builder.add("", sentence, f"expect_visits({ref}, within={name} + {within:.4g})", holds=True)
        return
    promise = f"expect_distance({ref}, nearest={name}{argument(where)})"
    builder.add(f"traj = pass_at(traj, {ref}, {name}{argument(where)})", sentence, promise)


def visit(builder: PolicyBuilder, frame: F.Visit) -> None:
    """Through objects in their order, between two, over one or under one."""
    items = [builder.scene[name] for name in frame.objects]
    if frame.relation == "between":
        a, b = (*items, *items)[:2]
        code = f"midpoint({builder.ref(a)}, {builder.ref(b)})"
        _through(builder, code, f"Bend the path through the midpoint of {a.name} and {b.name}.")
        return
    for item in items:
        _visit_one(builder, frame, item)
    places = [closest_to_point(builder.positions, item.position)[1] for item in items]
    if places != sorted(places):
        builder.assume("the objects are visited in the order in which the path comes by them")


def _visit_one(builder: PolicyBuilder, frame: F.Visit, item: SceneObject) -> None:
    if frame.aim == "beside":
        gap = max(builder.scale.step("slight"), builder.room(item))
        builder.assume(f'"by {item.name}" is {gap:g} m from it')
        _come_within(builder, item, gap, "at", "", "")
    elif frame.relation == "at":
        aim, words = aiming(frame.aim), aimed_at(builder, item.name, frame.aim, item)
        _through(builder, builder.ref(item), f"Bend the path {'to' if aim else 'through'} {words}.", aim)
    else:
        _over(builder, frame, item, "up" if frame.relation == "over" else "down")


def _through(builder: PolicyBuilder, code: str, plan: str, offset: str = "") -> None:
    """Bend the path through a place, or a place beside it, and promise that it comes by there."""
    promise = f"expect_visits({code}, within={tolerance(builder)}{offset})"
    builder.add(f"traj = go_through(traj, {code}{offset}{_width(builder)})", plan, promise)


def _width(builder: PolicyBuilder) -> str:
    """A narrower bend where there are several, so that they do not disturb each other."""
    return ", width=0.15" if sum(isinstance(f, F.Side | F.Visit) for f in builder.frames) > 1 else ""


def _over(builder: PolicyBuilder, frame: F.Visit, item: SceneObject, side: str) -> None:
    """Over or under an object: past its vertical axis, so far above its top or below its bottom."""
    axis, q, close = builder.axis(side), frame.by, frame.degree == "slight"
    half = extent(item, axis)
    over, word, end, knob = (
        ("over", "above", "top", "height") if side == "up" else ("under", "below", "bottom", "depth")
    )
    gap = _gap_over(builder, frame, item, axis) if q is None or close else builder.metres(q, builder.scale.extent, word)
    if close:
        builder.assume(f"close {word} {item.name} is {gap:g} m {word} its {end}")
    elif q is None:
        builder.assume(f'"{word} {item.name}" is {gap:g} m {word} its {end}')
    passed = _passes(builder, item, axis)
    ref, role = builder.ref(item), "to" if q is None or q.role == "by" else q.role
    meaning = f"distance {word} the {end} of {item.name}"
    name = builder.knob(knob, gap, cast(Role, role), meaning, "by", about=item.name, direction=side)
    within = tolerance(builder) / 2
    promise = f"expect_side({word!r}, {name}, of={ref}, within={within})"
    loose = not close if q is None else q.role == "at_least"
    if passed >= half + gap - 1e-6 and (loose or passed <= half + gap + within):
        said = f"The path already passes {passed - half:.3g} m {word} the {end} of {item.name}."
        builder.add("", said, promise, holds=True)
        return
    call = f"traj = go_through(traj, {ref}, {side}={_beyond(name, half)}{_width(builder)})"
    builder.add(call, f"Bend the path {over} {item.name}, {gap:g} m {word} its {end}.", promise)


def _beyond(name: str, half: float) -> str:
    """Code of a distance from an object's centre that counts from its surface, `half` metres out."""
    return f"{name} + {short(half)!r}" if half else name


def _gap_over(builder: PolicyBuilder, frame: F.Visit, item: SceneObject, axis: Array) -> float:
    """How far above or below an object suits the scene [m]: close to it, or no nearer than the path is."""
    half = extent(item, axis)
    close = frame.degree == "slight"
    usual = usual_gap(builder) if close else nice(item.radius - half + builder.scale.step("slight"))
    gap = max(usual, builder.room(item))
    above = float((builder.passing(item.position) - item.position) @ axis) - half
    return gap if close else max(gap, float(f"{above - 0.005 * abs(above):.3g}"))


def _passes(builder: PolicyBuilder, item: SceneObject, axis: Array) -> float:
    """How far beyond an object's centre along an axis the path passes over its footprint [m]; -inf if beside it."""
    path = builder.positions
    fine = interpolate(path, source_indices(path, 500, "arc_length")) - item.position
    along = fine @ axis
    aside = np.linalg.norm(fine - along[:, None] * axis, axis=1)
    inside = aside <= max(tolerance(builder), 0.5 * item.radius if item.dimensions is not None else 0.0)
    return float(along[inside].min()) if inside.any() and aside.min() <= tolerance(builder) / 2 else -np.inf


def hop(builder: PolicyBuilder, frame: F.Hop) -> None:
    """Over objects and down again."""
    for item in map(builder.scene.__getitem__, frame.objects):
        told = f"the height above {item.name}"
        gap = size(builder, frame, frame.by, told, 0.8) if frame.by else _leap(builder, item)
        name, ref = _height_above(builder, item, gap), builder.ref(item)
        promise = f"expect_side('above', {name}, of={ref}, within={tolerance(builder) / 2})"
        builder.add(f"traj = hop(traj, {ref}, {name})", f"Hop over {item.name}, {gap:g} m above it.", promise)


def _height_above(builder: PolicyBuilder, item: SceneObject, gap: float) -> str:
    meaning = f"height above the top of {item.name}"
    return builder.knob("height", gap, "to", meaning, "by", about=item.name, direction="up")


def _leap(builder: PolicyBuilder, item: SceneObject) -> float:
    """How high to jump over an object: clearly above its top, and above the path as it is."""
    up, usual = builder.axis("up"), builder.scale.step("moderate") * 0.8
    above = float((builder.passing(item.position) - item.position) @ up) - extent(item, up)
    gap = nice(max(usual, above + 0.5 * usual))
    builder.assume(f"the height above {item.name} is {gap:g} m")
    return gap


def hover(builder: PolicyBuilder, frame: F.Hover) -> None:
    """Above an object, and wait there."""
    for item in map(builder.scene.__getitem__, frame.objects):
        top = extent(item, builder.axis("up"))
        if frame.by is None:
            gap = max(nice(item.radius - top + builder.scale.step("slight")), builder.room(item))
            builder.assume(f'"above {item.name}" is {gap:g} m above its top')
        else:
            gap = builder.metres(frame.by, builder.scale.extent, f"above {item.name}")
        name, count = _height_above(builder, item, gap), steps(builder, frame.duration)
        ref, up = builder.ref(item), _beyond(name, top)
        builder.add(
            f"traj = hover(traj, {ref}, {up}, steps={count})",
            f"Hover {gap:g} m above {item.name} for {builder.parameters[count].value} timesteps.",
            f"expect_visits({ref}, within={tolerance(builder)}, up={up})",
            f"expect_stop(near={ref}, up={up})",
        )


def side(builder: PolicyBuilder, frame: F.Side) -> None:
    """Pass objects on one side; stay there where the ends do."""
    word = builder.word(frame.direction)
    axis = builder.axis(word)
    where, part = builder.part(frame.part)
    for item in map(builder.scene.__getitem__, frame.objects):
        half, gap = extent(item, axis), _gap_beside(builder, item, axis)
        words = f"{OF[word]} {item.name}"
        builder.assume(f"the distance kept {words} is {gap:g} m")
        reach = (builder.positions - item.position) @ axis
        name = builder.knob("gap", gap, "at_least", f"distance {words}", "by", about=item.name, direction=word)
        if not (where or frame.along or min(reach[0], reach[-1]) >= half + gap):
            _pass_by(builder, item, word, name, half)
            continue
        ref = builder.ref(item)
        builder.add(
            f"traj = stay_on(traj, {ref}, {word!r}, gap={name}{argument(where)})",
            f"Stay {words} by at least {gap:g} m{part}.",
            f"expect_side({word!r}, {name}, of={ref}{argument(where)})",
            holds=not where and bool((reach >= half + gap).all()),
        )


def _gap_beside(builder: PolicyBuilder, item: SceneObject, axis: Array) -> float:
    """How far on one side of an object to pass it [m], no nearer than a distance to keep from it that is told."""
    told = [f.distance.value for f in builder.frames if isinstance(f, F.Clearance) and item.name in f.objects]
    kept = (nice(item.radius - extent(item, axis) + metres) for metres in told)
    return max(builder.scale.step("slight"), builder.room(item), *kept)


def _pass_by(builder: PolicyBuilder, item: SceneObject, word: str, name: str, half: float) -> None:
    """A bend that passes an object on one side, where an end of the path lies on the other."""
    rise = float((builder.passing(item.position) - item.position) @ builder.axis("up"))
    level = "" if abs(rise) < 1e-6 or word in ("up", "down") else f", {'up' if rise > 0 else 'down'}={abs(rise):.6g}"
    plan = f"Bend the path so that it passes {OF[word]} {item.name}, {builder.parameters[name].value} m from its side;"
    _through(builder, builder.ref(item), f"{plan} start and goal stay.", f", {word}={_beyond(name, half)}{level}")


OBJECT_STEPS: Mapping[type[F.SemanticFrame], Callable[..., None]] = {
    F.Approach: approach, F.Clearance: clearance, F.Visit: visit, F.Side: side, F.Hop: hop, F.Hover: hover,
}  # fmt: skip
