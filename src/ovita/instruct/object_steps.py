"""Steps about objects: nearer and farther, distances to keep, through, over, under, on one side, hovering."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ovita.instruct import frames as F
from ovita.instruct.builder import PolicyBuilder, aiming, argument
from ovita.instruct.lexicon import nice
from ovita.instruct.path_steps import APPROACH, OF, aimed_at, degree, size, steps, tolerance, usual_gap
from ovita.paths.geometry import closest_to_point
from ovita.paths.scene import SceneObject
from ovita.paths.trajectory import Array, interpolate, source_indices
from ovita.policy.source import Role
from ovita.toolkit.approach import extent


def approach(d: PolicyBuilder, frame: F.Approach) -> None:
    """Nearer to objects, never through the surface, or farther from them."""
    for name in frame.objects:
        (_closer if frame.sense == "closer" else _farther)(d, frame, d.scene[name])


def _gap_metres(d: PolicyBuilder) -> float:
    """The least distance to a surface [m]: a centimetre, or less in a small scene."""
    return min(0.01, nice(0.005 * d.scale.extent))


def _gap(d: PolicyBuilder) -> str:
    return "" if _gap_metres(d) == 0.01 else f", gap={_gap_metres(d):g}"


def _reach(d: PolicyBuilder, where: str) -> str:
    """On a part that is named, all of it comes closer or goes farther, not only what is nearest."""
    return f", reach={nice(4 * d.scale.extent):g}" if where else ""


def _distance(d: PolicyBuilder, item: SceneObject) -> float:
    return closest_to_point(d.positions, item.position)[0]


def surface_distance(item: SceneObject, positions: Array) -> float:
    """How near a path comes to an object's surface [m]; to its centre if its size is not known."""
    if item.dimensions is None:
        return closest_to_point(positions, item.position)[0]
    return float(item.cuboid.closest(positions)[0])


def _closer(d: PolicyBuilder, frame: F.Approach, item: SceneObject) -> None:
    where, part = d.part(frame.part)
    now, q = _distance(d, item), frame.by
    if q is None:
        by = d.scale.step("slight")
        if frame.degree != "slight":
            by = APPROACH[degree(frame)] * (now + 0.1 * d.scale.extent)
        by = nice(d.effort * by)
        d.assume(f'"closer to {item.name}" is {by:g} m closer')
    else:
        share = 1 - 1 / max(q.value, 1.01) if q.unit == "x" and q.value > 1 else q.value
        by = nice(now * (1 - share if q.unit == "x" and q.value <= 1 else share)) if q.unit in ("x", "%") else 0.0
        by = by or d.metres(q, now, f"closer to {item.name}")
        most = surface_distance(item, d.positions)
        if by > most + 1e-9:
            d.assume(f"closer to {item.name} ends at its surface, {max(most, 0.0):.3g} m closer, not {by:g} m")
    ref = d.ref(item)
    name = d.knob("closer_by", by, "by", f"how much closer to {item.name}", "by", about=item.name, direction="closer")
    stated = "" if q is None or where else f", {name}"
    d.add(f"traj = closer(traj, {ref}, {name}{_gap(d)}{_reach(d, where)}{argument(where)}{d.hold()})",
          f"Bring the path {by:g} m closer to {item.name}{part}.",
          f"expect_closer({ref}{stated}{argument(where)})")  # fmt: skip


def _farther(d: PolicyBuilder, frame: F.Approach, item: SceneObject) -> None:
    where, part = d.part(frame.part)
    ref, q = d.ref(item), frame.by
    promise = f"expect_farther({ref}{argument(where)})"
    if q is not None and q.unit in ("x", "%"):
        times = q.value if q.unit == "x" and q.value > 1 else 1.0 + q.value
        meaning = f"factor on the distance to {item.name}"
        name = d.knob("times", times, "factor", meaning, "by", unit="", about=item.name, direction="away")
        d.add(f"traj = farther(traj, {ref}, times={name}{argument(where)}{d.hold()})",
              f"Multiply the distance to {item.name} by {times:g}{part}.", promise)  # fmt: skip
        return
    if q is None:
        by = d.scale.step(degree(frame))
        now, was = item.distance(d.positions), item.distance(d.trajectory.positions)
        gain = min(float(now.min() - was.min()), float(now.mean() - was.mean()))
        if gain >= by and not where:
            d.add("", f"This already takes the path {gain:.3g} m farther from {item.name}.", promise)
            return
        d.assume(f'"away from {item.name}" is {by:g} m farther')
        by = nice(d.effort * _push_needed(d, item, by))
    else:
        by = d.metres(q, 1.0, f"farther from {item.name}")
    name = d.knob("farther_by", by, "by", f"how much farther from {item.name}", "by", about=item.name, direction="away")
    d.add(f"traj = farther(traj, {ref}, {name}{_reach(d, where)}{argument(where)}{d.hold()})",
          f"Take the path {by:g} m farther from {item.name}{part}.", promise)  # fmt: skip


def _push_needed(d: PolicyBuilder, item: SceneObject, gain: float) -> float:
    """The push that takes the closest waypoint `gain` metres farther than it was at first [m].

    Shifts before may have brought it closer, and along the directions that are held the push does not act.
    """
    away = d.positions - item.position
    i = int(np.argmin(np.linalg.norm(away, axis=1)))
    free = away[i].copy()
    for word in d.exact:
        axis = d.scene.frame.direction(word)
        free -= float(free @ axis) * axis
    now, length = float(np.linalg.norm(away[i])), float(np.linalg.norm(free))
    wanted = float(item.distance(d.trajectory.positions).min()) + gain
    across = max(now**2 - length**2, 0.0)
    needed = (max(wanted**2 - across, 0.0) ** 0.5 - length) * now / max(length, 0.05 * now, 1e-9)
    return float(np.clip(needed, gain, 2.5 * gain))


def clearance(d: PolicyBuilder, frame: F.Clearance) -> None:
    """At least so far from objects, or at most so far all along; else so near at the closest approach to each."""
    q = frame.distance
    items = [d.scene[name] for name in frame.objects]
    if q.role == "at_least" and q.value == 0:
        metres = max(usual_gap(d), *(d.room(item) for item in items))
        d.assume(f"clear of {' and '.join(frame.objects)} is at least {metres:g} m from the surface")
    else:
        metres = d.metres(q, 1.0, "from " + " and ".join(frame.objects))
    where, part = d.part(frame.part)
    if q.role in ("at_most", "at") and not frame.along:
        for item in items:
            _come_within(d, item, metres, q.role, where, part)
    else:
        _hold(d, items, metres, q.role if q.role in ("at_most", "at") else "at_least", where, part)


def _hold(d: PolicyBuilder, items: Sequence[SceneObject], metres: float, bound: str, where: str, part: str) -> None:
    """A distance to objects that is kept all along."""
    least, told = bound == "at_least", bound.replace("_", " ")
    name = d.knob("distance", metres, "at_least" if least else "at_most", f"distance to keep, {told}", "distance",
                  about=items[0].name if len(items) == 1 else "", direction="away" if least else "closer")  # fmt: skip
    for item in () if least else items:
        _reached(d, item, metres)
    refs = [d.ref(item) for item in items]
    code = refs[0] if len(refs) == 1 else f"[{', '.join(refs)}]"
    call = f"traj = keep_distance(traj, {code}, {bound}={name}{argument(where)})"
    d.distances += [(item, metres, call) for item in items] if least and not where else []
    d.add(call, f"Keep {told} {metres:g} m from {' and '.join(item.name for item in items)}{part}.",
          *(f"expect_distance({ref}, {bound}={name}{argument(where)})" for ref in refs))  # fmt: skip


def _reached(d: PolicyBuilder, item: SceneObject, metres: float) -> None:
    """A greatest distance is measured to the centre, which must not lie farther in than that."""
    d.assume(f"{metres:g} m from {item.name} is measured to its centre")
    if item.radius > metres:
        d.ask(f"{item.name} itself reaches {item.radius:.3g} m from its centre: how far from that may the path be?")


def _come_within(d: PolicyBuilder, item: SceneObject, metres: float, bound: str, where: str, part: str) -> None:
    """Bring the closest stretch so near to an object's surface; what is nearer stays, or moves out if "at" is asked."""
    ref, exact = d.ref(item), bound == "at"
    now = surface_distance(item, d.positions)
    sentence = f"{'Pass' if exact else 'Come within'} {metres:g} m {'from' if exact else 'of'} {item.name}{part}."
    meaning = f"distance to {item.name}, {'exactly' if exact else 'at most'}"
    role: Role = "at" if exact else "at_most"
    name = d.knob("distance", metres, role, meaning, "distance", about=item.name, direction="away")
    if not exact and not where and now <= metres + 1e-6:
        within = closest_to_point(d.positions, item.position)[0] - now
        d.add("", sentence, f"expect_visits({ref}, within={name} + {within:.4g})", holds=True)
        return
    promise = f"expect_distance({ref}, nearest={name}{argument(where)})"
    d.add(f"traj = pass_at(traj, {ref}, {name}{argument(where)})", sentence, promise)


def visit(d: PolicyBuilder, frame: F.Visit) -> None:
    """Through objects in their order, between two, over one or under one."""
    if frame.relation == "between":
        a, b = (d.scene[name] for name in (*frame.objects, *frame.objects)[:2])
        code = f"midpoint({d.ref(a)}, {d.ref(b)})"
        plan = f"Bend the path through the midpoint of {a.name} and {b.name}."
        d.add(f"traj = go_through(traj, {code}{_width(d)})", plan, f"expect_visits({code}, within={tolerance(d)})")
        return
    items = [d.scene[name] for name in frame.objects]
    for item in items:
        if frame.aim == "beside":
            gap = max(d.scale.step("slight"), d.room(item))
            d.assume(f'"by {item.name}" is {gap:g} m from it')
            _come_within(d, item, gap, "at", "", "")
        elif frame.relation == "at":
            ref = d.ref(item)
            aim, words = aiming(frame.aim), aimed_at(d, item.name, frame.aim, item)
            d.add(f"traj = go_through(traj, {ref}{aim}{_width(d)})",
                  f"Bend the path {'to' if aim else 'through'} {words}.",
                  f"expect_visits({ref}, within={tolerance(d)}{aim})")  # fmt: skip
        else:
            _over(d, frame, item, "up" if frame.relation == "over" else "down")
    places = [closest_to_point(d.positions, item.position)[1] for item in items]
    if places != sorted(places):
        d.assume("the objects are visited in the order in which the path comes by them")


def _width(d: PolicyBuilder) -> str:
    """A narrower bend where there are several, so that they do not disturb each other."""
    return ", width=0.15" if sum(isinstance(f, F.Side | F.Visit) for f in d.frames) > 1 else ""


def _over(d: PolicyBuilder, frame: F.Visit | F.Hop, item: SceneObject, side: str) -> None:
    """Over or under an object: past its vertical axis, so far above its top or below its bottom."""
    axis = d.scene.frame.direction(side)
    half, q = extent(item, axis), frame.by
    word, end = ("above", "top") if side == "up" else ("below", "bottom")
    close = frame.degree == "slight"
    usual = usual_gap(d) if close else nice(item.radius - half + d.scale.step("slight"))
    gap = max(usual, d.room(item)) if q is None else d.metres(q, d.scale.extent, word)
    if close:
        d.assume(f"close {word} {item.name} is {gap:g} m {word} its {end}")
    elif q is None:
        passing = interpolate(d.positions, np.array([closest_to_point(d.positions, item.position)[1]]))[0]
        above = float((passing - item.position) @ axis) - half
        gap = max(gap, float(f"{above - 0.005 * abs(above):.3g}"))  # never nearer than it is
        d.assume(f'"{word} {item.name}" is {gap:g} m {word} its {end}')
    passed = _passes(d, item, axis)
    ref, sentence = d.ref(item), f"Bend the path {'over' if side == 'up' else 'under'} {item.name}, {gap:g} m"
    name = d.knob("height" if side == "up" else "depth", gap, "to" if q is None else q.role if q.role != "by" else "to",
                  f"distance {word} the {end} of {item.name}", "by", about=item.name, direction=side)  # fmt: skip
    centre = f"{name} + {float(f'{half:.6g}')!r}" if half else name
    within = tolerance(d) / 2
    promise = f"expect_side({word!r}, {name}, of={ref}, within={within})"
    loose = (q is None and not close) or (q is not None and q.role == "at_least")
    if passed >= half + gap - 1e-6 and (loose or passed <= half + gap + within):
        said = f"The path already passes {passed - half:.3g} m {word} the {end} of {item.name}."
        d.add("", said, promise, holds=True)
        return
    d.add(f"traj = go_through(traj, {ref}, {side}={centre}{_width(d)})", f"{sentence} {word} its {end}.", promise)


def _passes(d: PolicyBuilder, item: SceneObject, axis: Array) -> float:
    """How far beyond an object's centre along an axis the path passes over its footprint [m]; -inf if beside it."""
    path = d.positions
    fine = interpolate(path, source_indices(path, 500, "arc_length")) - item.position
    along = fine @ axis
    aside = np.linalg.norm(fine - along[:, None] * axis, axis=1)
    inside = aside <= max(tolerance(d), 0.5 * item.radius if item.dimensions is not None else 0.0)
    return float(along[inside].min()) if inside.any() and aside.min() <= tolerance(d) / 2 else -np.inf


def hop(d: PolicyBuilder, frame: F.Hop) -> None:
    """Over objects and down again."""
    for item in map(d.scene.__getitem__, frame.objects):
        gap = size(d, frame, frame.by, f"the height above {item.name}", 0.8) if frame.by else _leap(d, frame, item)
        name = d.knob("height", gap, "to", f"height above the top of {item.name}", "by", about=item.name,
                      direction="up")  # fmt: skip
        ref = d.ref(item)
        d.add(f"traj = hop(traj, {ref}, {name})", f"Hop over {item.name}, {gap:g} m above it.",
              f"expect_side('above', {name}, of={ref}, within={tolerance(d) / 2})")  # fmt: skip


def _leap(d: PolicyBuilder, frame: F.Hop, item: SceneObject) -> float:
    """How high to jump over an object: clearly above its top, and above the path as it is."""
    up = d.scene.frame.direction("up")
    usual = d.scale.step("moderate") * 0.8
    passing = interpolate(d.positions, np.array([closest_to_point(d.positions, item.position)[1]]))[0]
    above = float((passing - item.position) @ up) - extent(item, up)
    gap = nice(max(usual, above + 0.5 * usual))
    d.assume(f"the height above {item.name} is {gap:g} m")
    return gap


def hover(d: PolicyBuilder, frame: F.Hover) -> None:
    """Above an object, and wait there."""
    for item in map(d.scene.__getitem__, frame.objects):
        top = extent(item, d.scene.frame.direction("up"))
        gap = (max(nice(item.radius - top + d.scale.step("slight")), d.room(item)) if frame.by is None
               else d.metres(frame.by, d.scale.extent, f"above {item.name}"))  # fmt: skip
        if frame.by is None:
            d.assume(f'"above {item.name}" is {gap:g} m above its top')
        name = d.knob("height", gap, "to", f"height above the top of {item.name}", "by", about=item.name,
                      direction="up")  # fmt: skip
        count = steps(d, frame.duration)
        ref, up = d.ref(item), f"{name} + {float(f'{top:.6g}')!r}" if top else name
        d.add(f"traj = hover(traj, {ref}, {up}, steps={count})",
              f"Hover {gap:g} m above {item.name} for {d.parameters[count].value} timesteps.",
              f"expect_visits({ref}, within={tolerance(d)}, up={up})",
              f"expect_stop(near={ref}, up={up})")  # fmt: skip


def side(d: PolicyBuilder, frame: F.Side) -> None:
    """Pass objects on one side; stay there where the ends do."""
    word = d.word(frame.direction)
    axis = d.scene.frame.direction(word)
    where, part = d.part(frame.part)
    for item in map(d.scene.__getitem__, frame.objects):
        ref, half, words = d.ref(item), extent(item, axis), f"{OF[word]} {item.name}"
        kept = [f.distance.value for f in d.frames if isinstance(f, F.Clearance) and item.name in f.objects]
        gap = max([d.scale.step("slight"), d.room(item), *(nice(item.radius - half + metres) for metres in kept)])
        d.assume(f"the distance kept {words} is {gap:g} m")
        reach = (d.positions - item.position) @ axis
        name = d.knob("gap", gap, "at_least", f"distance {words}", "by", about=item.name, direction=word)
        if where or frame.along or min(reach[0], reach[-1]) >= half + gap:
            d.add(f"traj = stay_on(traj, {ref}, {word!r}, gap={name}{argument(where)})",
                  f"Stay {words} by at least {gap:g} m{part}.",
                  f"expect_side({word!r}, {name}, of={ref}{argument(where)})",
                  holds=not where and bool((reach >= half + gap).all()))  # fmt: skip
        else:
            _pass_by(d, item, word, name, half)


def _pass_by(d: PolicyBuilder, item: SceneObject, word: str, name: str, half: float) -> None:
    """A bend that passes an object on one side, where an end of the path lies on the other."""
    up = d.scene.frame.direction("up")
    share, ref = closest_to_point(d.positions, item.position)[1], d.ref(item)
    rise = float((interpolate(d.positions, np.array([share]))[0] - item.position) @ up)
    aside = f"{name} + {float(f'{half:.6g}')!r}" if half else name
    level = "" if abs(rise) < 1e-6 or word in ("up", "down") else f", {'up' if rise > 0 else 'down'}={abs(rise):.6g}"
    d.add(f"traj = go_through(traj, {ref}, {word}={aside}{level}{_width(d)})",
          f"Bend the path so that it passes {OF[word]} {item.name}, {d.parameters[name].value} m from its side; start"
          " and goal stay.",
          f"expect_visits({ref}, within={tolerance(d)}, {word}={aside}{level})")  # fmt: skip


OBJECT_STEPS: Mapping[type[F.SemanticFrame], Callable[..., None]] = {
    F.Approach: approach, F.Clearance: clearance, F.Visit: visit, F.Side: side, F.Hop: hop, F.Hover: hover,
}  # fmt: skip
