"""Steps about objects: nearer and farther, distances to keep, through, over, under, hovering."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import cast

import numpy as np

from ovita.instruct import frames as F
from ovita.instruct.builder import PolicyBuilder, argument, degree, short
from ovita.instruct.degrees import Degree, nice
from ovita.instruct.path_steps import APPROACH, CROWDED, ROOM_LEFT, aimed, is_a_body, steps, usual_gap, waited
from ovita.limits.problem import is_support
from ovita.paths.geometry import closest_to_point, is_level, runs
from ovita.paths.part import PathPart
from ovita.paths.scene import SceneObject
from ovita.paths.trajectory import Array, arc_length
from ovita.policy.source import Role
from ovita.toolkit.approach import STEEPEST, extent, keep_distance, stays
from ovita.toolkit.speed import stands

OVER = {"over": ("up", "above", "top", "height"), "under": ("down", "below", "bottom", "depth")}
"""For each way past an object its direction, where that is, the end of the object there, and a parameter's name."""


def approach(builder: PolicyBuilder, frame: F.Approach) -> None:
    """Nearer to objects, never through the surface, or farther from them."""
    for name in frame.objects:
        (_closer if frame.sense == "closer" else _farther)(builder, frame, builder.scene[name])


def _reach(builder: PolicyBuilder, where: str, frame: F.Approach, item: SceneObject, by: float) -> str:
    """How much farther off than the nearest waypoint others move, too.

    On a part that is named, all of it does. Of several objects each moves only what is not beside another one, so that
    their shifts do not add up.
    """
    if where:
        return f", reach={nice(4 * builder.scale.extent):g}"
    others = [builder.passing(builder.scene[name].position) for name in frame.objects if name != item.name]
    away = item.distance(np.array([builder.passing(item.position), *others]))
    free = float((away[1:] - away[0]).min(initial=np.inf))
    return f", reach={nice(free, up=False):g}" if STEEPEST * by <= free < np.inf else ""


def surface_distance(item: SceneObject, positions: Array) -> float:
    """How near a path comes to an object's surface [m]; to its centre if its size is not known."""
    if item.dimensions is None:
        return closest_to_point(positions, item.position)[0]
    return float(item.cuboid.closest(positions)[0])


def _closer(builder: PolicyBuilder, frame: F.Approach, item: SceneObject) -> None:
    where, part = builder.part(frame.part)
    by = _pull(builder, frame, item)
    ref, meaning = builder.ref(item), f"how much closer to {item.name}"
    name = builder.knob("closer_by", by, "by", meaning, "by", about=item.name, direction="closer")
    stated = "" if frame.by is None or where else f", {name}"
    gap = min(0.01, nice(0.005 * builder.scale.extent))
    further = f", gap={gap:g}{_reach(builder, where, frame, item, by)}{argument(where)}{builder.hold()}"
    builder.add(
        f"traj = closer(traj, {ref}, {name}{further})",
        f"Bring the path {by:g} m closer to {item.name}{part}.",
        f"expect_closer({ref}{stated}{argument(where)})",
    )


def _pull(builder: PolicyBuilder, frame: F.Approach, item: SceneObject) -> float:
    """How much closer to an object [m]: by a length, by a share of the distance or to one, or what suits the scene."""
    now, q = surface_distance(item, builder.positions), frame.by
    if q is None:
        now = closest_to_point(builder.positions, item.position)[0]
        share = APPROACH[degree(frame)] * (now + 0.1 * builder.scale.extent)
        gap, least = surface_distance(item, builder.positions), GAINS["slight"][1] * builder.scale.extent
        share = min(share, max(MOST_OF * gap, least))
        usual = nice(builder.effort * (builder.step(frame) if frame.degree == "slight" else share))
        leeway = builder.leeway(item)
        usual = nice(leeway, up=False) if LEAST_OF * usual < leeway < usual else usual
        return builder.length(None, _not_too_close(builder, item, usual, gap), f'"closer to {item.name}"')
    shares = {"%": q.value, "x": 1 - (1 / q.value if q.value > 1 else q.value)}
    by = nice(now * shares.get(q.unit, 0.0)) or builder.metres(q, now)
    most = max(surface_distance(item, builder.positions), 0.0)
    if by > most + 1e-9:
        builder.assume(f"closer to {item.name} ends at its surface, {most:.3g} m closer, not {by:g} m")
    return by


LEAST_OF = 0.1
"""The least share of a usual change that is worth making; where limits leave less, they say so themselves."""


def _not_too_close(builder: PolicyBuilder, item: SceneObject, by: float, gap: float) -> float:
    """How much closer to an object [m] a word means: less where a level path would come up to it for that."""
    for less in CROWDED:
        path = builder.after(f"closer(traj, {builder.ref(item)}, {by * less:g})")
        if surface_distance(item, path) >= (1.0 - MOST_OF) / 2.0 * gap:
            return nice(by * less)
    return nice(by * CROWDED[-1])


def _farther(builder: PolicyBuilder, frame: F.Approach, item: SceneObject) -> None:
    where, part = builder.part(frame.part)
    ref, q, about = builder.ref(item), frame.by, item.name
    promise, further = f"expect_farther({ref}{argument(where)})", f"{argument(where)}{builder.hold()}"
    times = _times(q)
    if times > 1.0 and not where and q is not None and q.role != "to":
        gap = surface_distance(item, builder.positions)
        q = F.Quantity(float(f"{(times - 1.0) * gap:.3g}"), "m")
        builder.assume(f"{times:g} times the distance to {about} is {times * gap:.3g} m where the path passes it")
    elif times > 1.0:
        meaning = f"factor on the distance to {about}"
        name = builder.knob("times", times, "factor", meaning, "by", unit="", about=about, direction="away")
        call = f"traj = farther(traj, {ref}, times={name}{further})"
        builder.add(call, f"Multiply the distance to {about} by {times:g}{part}.", promise)
        return
    usual = nice(builder.effort * _push_needed(builder, item, _gain(builder, frame)))
    usual = usual if q is not None or where else _without_crowding(builder, item, usual)
    by = builder.length(q, usual, f'"farther from {about}"')
    name = builder.knob("farther_by", by, "by", f"how much farther from {about}", "by", about=about, direction="away")
    reach = _reach(builder, where, frame, item, by)
    if moving := _but_for_stays(builder, item, by, frame.part):
        where = builder.part(moving)[0]
        promise, further = f"expect_farther({ref}{argument(where)})", f"{argument(where)}{builder.hold()}"
    call = f"traj = farther(traj, {ref}, {name}{reach}{further})"
    builder.add(call, f"Take the path {by:g} m farther from {about}{part}.", promise)


def _times(q: F.Quantity | None) -> float:
    """How many times as far as now is asked for; 1 where it is not told by that."""
    if q is None or q.unit not in ("x", "%"):
        return 1.0
    return q.value if q.unit == "x" and q.value > 1 else 1.0 + q.value


def _without_crowding(builder: PolicyBuilder, item: SceneObject, by: float) -> float:
    """How much farther from an object [m] a word means: less where it would come much nearer to another one."""
    others = [other for other in builder.scene if other is not item]
    before = np.array([surface_distance(other, builder.positions) for other in others])
    for less in CROWDED:
        path = builder.after(f"farther(traj, {builder.ref(item)}, {by * less:g})")
        room = np.array([surface_distance(other, path) for other in others])
        if (room >= np.minimum(ROOM_LEFT * before, by * less)).all():
            return nice(by * less)
    return by


def _but_for_stays(builder: PolicyBuilder, item: SceneObject, by: float, part: PathPart) -> PathPart | None:
    """What goes farther from an object, where start, goal or a stop at another one is nearest to it; None elsewhere."""
    rows = builder.rows()
    if len(rows) != len(builder.trajectory):
        return None
    path, s, selected = rows[:, :3], arc_length(rows[:, :3]), builder.waypoints(part)
    distance = np.where(selected, item.core(path).depth(path), np.inf)
    things = [one for one in builder.scene if one is item or not is_support(one)]
    gaps = np.array([one.cuboid.signed(path)[0] for one in things])
    # A place is at what it is the nearest to on the whole path, else at what is nearest there.
    nearest = np.where(gaps <= gaps.min(axis=1, keepdims=True) + 1e-9, gaps, gaps + gaps.max())
    held = np.flatnonzero(stays(rows) & (nearest.argmin(axis=0) != things.index(item)))
    least = float(distance.min())
    if not (distance[held] < least + by).any():
        return None
    free = selected & (np.abs(s[:, None] - s[held]) > STEEP * by).all(axis=1)
    if distance[free].min(initial=np.inf) >= least + by + APPROACHING * builder.scale.extent:
        return None
    builder.assume("start, goal and stops stay")
    return PathPart("indices", ranges=tuple(runs(free)), count=len(rows))


APPROACHING = 0.1
"""How much farther off than a stop the way to it may be to go farther in its place, as a share of the path's extent."""

STEEP = 1.5
"""How many times as far along the path as its push a stop has to be for it to stay."""


def _gain(builder: PolicyBuilder, frame: F.Approach) -> float:
    """How much farther from objects a word of degree means [m]: a step, but in proportion to how near they are."""
    gap = max(surface_distance(builder.scene[name], builder.trajectory.positions) for name in frame.objects)
    share, least = GAINS[degree(frame)]
    step = builder.step(frame)
    return nice(min(step, max(share * gap, least * builder.scale.extent))) if gap > 0.0 else step


MOST_OF = 0.7
"""The share of the distance to a surface that "closer" takes at most."""

GAINS: Mapping[Degree, tuple[float, float]] = {"slight": (0.25, 0.03), "moderate": (0.5, 0.05), "large": (1.0, 0.1)}
"""Shares of the distance to a surface, and of the path's extent, that "farther" is at least for each degree."""


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
    q, items = frame.distance, [builder.scene[name] for name in frame.objects]
    names = " and ".join(item.name for item in items)
    clear = max(usual_gap(builder), *(builder.room(item) for item in items))
    stated = None if q.role == "at_least" and q.value == 0 else q
    metres = builder.length(stated, clear, f"the distance to keep clear of {names}")
    where, part = builder.part(frame.part)
    if q.role in ("at_most", "at") and not frame.along:
        for item in items:
            _come_within(builder, item, metres, q.role, where, part)
    else:
        _hold(builder, items, metres, q.role if q.role in ("at_most", "at") else "at_least", where, part)


def _hold(
    builder: PolicyBuilder, items: Sequence[SceneObject], metres: float, bound: str, where: str, part: str
) -> None:
    """A distance to objects that is kept all along."""
    told, about = bound.replace("_", " "), items[0].name if len(items) == 1 else ""
    meaning, direction = f"distance to keep, {told}", "away" if bound == "at_least" else "closer"
    name = builder.knob("distance", metres, cast(Role, bound), meaning, "distance", about=about, direction=direction)
    if bound != "at_least":
        builder.assume(f"{metres:g} m is measured to the centre of {' and '.join(item.name for item in items)}")
    refs = [builder.ref(item) for item in items]
    code = refs[0] if len(refs) == 1 else f"[{', '.join(refs)}]"
    call = f"traj = keep_distance(traj, {code}, {bound}={name}{argument(where)})"
    if bound == "at_least" and not where:
        builder.distances += [(item, metres, call) for item in items]
    plan = f"Keep {told} {metres:g} m from {' and '.join(item.name for item in items)}{part}."
    before = builder.positions
    builder.add(call, plan, *(f"expect_distance({ref}, {bound}={name}{argument(where)})" for ref in refs))
    if bound == "at_least" and not where:
        _uncrowd(builder, items, before, metres)


def _uncrowd(builder: PolicyBuilder, items: Sequence[SceneObject], before: Array, metres: float) -> None:
    """Keep clear of others that a way around some objects would come much nearer to, as far as there is room."""
    for other in builder.scene:
        if other in items or is_support(other):
            continue
        least = _room_beside(builder, other, items, surface_distance(other, before), metres)
        if least is not None:
            builder.add(f"traj = keep_distance(traj, {builder.ref(other)}, at_least={least:g})")
            builder.assume(f"it stays {least:g} m clear of {other.name} for that")


def _room_beside(
    builder: PolicyBuilder, other: SceneObject, items: Sequence[SceneObject], gap: float, metres: float
) -> float | None:
    """How far from another object a way around some is to be led [m]; None where it is so far off, or there is no room.

    Args:
        builder: With the way around the items, so far from their surfaces as `metres`.
        other: The other object.
        items: Those that are kept away from.
        gap: How far from the other one the path was before [m].
        metres: What is kept from the items [m].
    """
    for less in CROWDED if gap > 0.0 else ():
        least = nice(less * min(ROOM_LEFT * gap, metres / 2.0), up=False)
        if surface_distance(other, builder.positions) >= least:
            return None
        path = keep_distance(builder.rows(), other, at_least=least, frame=builder.scene.frame)[:, :3]
        kept = all(surface_distance(item, path) >= 0.999 * metres for item in items)
        if kept and surface_distance(other, path) >= 0.99 * least:
            return least
    return None


def _come_within(builder: PolicyBuilder, item: SceneObject, metres: float, bound: str, where: str, part: str) -> None:
    """Bring the closest stretch so near to an object's surface; what is nearer stays, or moves out if "at" is asked."""
    ref, exact = builder.ref(item), bound == "at"
    sentence = f"{'Pass' if exact else 'Come within'} {metres:g} m {'from' if exact else 'of'} {item.name}{part}."
    if not exact and not where and surface_distance(item, builder.positions) <= metres + 1e-6:
        builder.add("", sentence, holds=True)
        return
    meaning = f"distance to {item.name}, {'exactly' if exact else 'at most'}"
    name = builder.knob("distance", metres, cast(Role, bound), meaning, "distance", about=item.name, direction="away")
    promise = f"expect_distance({ref}, nearest={name}{argument(where)})"
    builder.add(f"traj = pass_at(traj, {ref}, {name}{argument(where)})", sentence, promise)


def visit(builder: PolicyBuilder, frame: F.Visit) -> None:
    """Through objects in their order, between two, over one or under one."""
    items = [builder.scene[name] for name in frame.objects]
    if frame.relation == "between":
        a, b = (*items, *items)[:2]
        code = f"midpoint({builder.ref(a)}, {builder.ref(b)})"
        flat = is_level(builder.positions, builder.axis("up"))
        level = ", aim='level'" if flat or any(map(F.tells_height, builder.frames)) else ""
        through(builder, code, f"Bend the path through the midpoint of {a.name} and {b.name}.", level)
        return
    for item in items:
        if frame.aim == "beside":
            gap = max(builder.scale.step("slight"), builder.room(item))
            builder.assume(f'"by {item.name}" is {gap:g} m from it')
            _come_within(builder, item, gap, "at", "", "")
        elif not frame.aim and frame.relation == "at" and is_a_body(item):
            gap = max(usual_gap(builder), builder.room(item))
            builder.assume(f'"at {item.name}" is {gap:g} m from its surface')
            _come_within(builder, item, gap, "at_most", "", "")
        elif frame.relation == "at":
            code, words = aimed(builder, item.name, frame.aim)
            through(builder, code, f"Bend the path {'to' if frame.aim else 'through'} {words}.")
        else:
            _over(builder, frame, item)


def through(builder: PolicyBuilder, code: str, plan: str, offset: str = "", promise: str = "", among: str = "") -> None:
    """Bend the path through a place, or a place beside it, and promise that it comes by there.

    The bend is narrower where a smaller one is gentle enough, and where there are several, which might meet.
    """
    most = 0.15 if sum(isinstance(f, F.Side | F.Visit) for f in builder.frames) > 1 else 0.3
    before, call = builder.positions, f"go_through(traj, {code}{offset}{among}, width={most:g})"
    shifts = builder.shifts_by(call)
    width = min(most, max(nice(GENTLE * float(shifts.max()) / max(float(arc_length(before)[-1]), 1e-9)), NARROWEST))
    call = f"traj = go_through(traj, {code}{offset}{among}{f', width={width:g}' if width < 0.3 else ''})"
    promise = promise or f"expect_visits({code}, within={builder.tolerance}{offset})"
    builder.add(call, plan, promise)
    bent, own = builder.positions, builder.frames[builder.frame]
    if any(isinstance(f, F.Approach) and not {*f.named}.isdisjoint(own.named) for f in builder.frames):
        return  # how far off it passes is another wish's
    builder.passed.append((bent[np.linalg.norm(bent - before, axis=1).argmax()], call))


GENTLE, NARROWEST = 3.0, 0.05
"""How many times as long as its shift half a bend is at least, and its least share of the path's length."""


def _over(builder: PolicyBuilder, frame: F.Visit, item: SceneObject) -> None:
    """Over or under an object: past its vertical axis, so far above its top or below its bottom."""
    side, word, end, knob = OVER[frame.relation]
    axis, q, meaning = builder.axis(side), frame.by, f"distance {word} the {end} of {item.name}"
    half, above = extent(item, axis), _passing(builder, item, axis)
    now = float(f"{above - 0.005 * abs(above):.3g}")
    usual = max(nice(item.radius - half + builder.scale.step("slight")), now)
    usual = usual_gap(builder) if frame.degree == "slight" else usual  # close to it, lower than the path is
    gap = builder.length(q, max(usual, builder.room(item)), f"the {meaning}")
    gap = max(gap, now) if q is not None and q.role == "at_least" else gap
    gap = max([gap, *kept_clear(builder, item)]) if q is None else gap
    ref, role = builder.ref(item), "to" if q is None or q.role == "by" else q.role
    name = builder.knob(knob, gap, role, meaning, "by", about=item.name, direction=side)
    plan = f"Bend the path {frame.relation} {item.name}, {gap:g} m {word} its {end}."
    promise = f"expect_side({word!r}, {name}, of={ref}, within={builder.tolerance / 2})"
    through(builder, ref, plan, f", {side}={beyond(name, half)}", promise)
    if q is not None and side == "up" and surface_distance(item, builder.positions) < 0.9 * gap:
        builder.add(f"traj = hop(traj, {ref}, {name})")  # level over all of it, not only over its centre


def kept_clear(builder: PolicyBuilder, item: SceneObject) -> list[float]:
    """The distances to an object that other requests keep [m]."""
    clear = [f.distance for f in builder.frames if isinstance(f, F.Clearance) and item.name in f.objects]
    return [distance.value for distance in clear if distance.role != "at_most"]


def _passing(builder: PolicyBuilder, item: SceneObject, axis: Array) -> float:
    """How far beyond an object's surface along an axis the path passes it [m]."""
    return float((builder.passing(item.position) - item.position) @ axis) - extent(item, axis)


def beyond(name: str, half: float) -> str:
    """Code of a distance from an object's centre that counts from its surface, `half` metres out."""
    return f"{name} + {short(half)!r}" if half else name


def hop(builder: PolicyBuilder, frame: F.Hop) -> None:
    """Over objects and down again: clearly above their tops, and above the path as it is."""
    for item in map(builder.scene.__getitem__, frame.objects):
        up, usual = builder.axis("up"), builder.scale.step("moderate") * 0.8
        name, gap = _height_above(builder, item, frame.by, nice(max(usual, _passing(builder, item, up) + 0.5 * usual)))
        ref = builder.ref(item)
        promise = f"expect_side('above', {name}, of={ref}, within={builder.tolerance / 2})"
        builder.add(f"traj = hop(traj, {ref}, {name})", f"Hop over {item.name}, {gap:g} m above it.", promise)


def _height_above(builder: PolicyBuilder, item: SceneObject, q: F.Quantity | None, usual: float) -> tuple[str, float]:
    """The parameter of a height above an object's top, and its value [m]."""
    meaning = f"height above the top of {item.name}"
    gap = builder.length(q, _below_the_limit(builder, item, usual), f"the {meaning}")
    return builder.knob("height", gap, "to", meaning, "by", about=item.name, direction="up"), gap


def _below_the_limit(builder: PolicyBuilder, item: SceneObject, usual: float) -> float:
    """The usual height above an object, or as much of it as there is below a height that the path is not to exceed."""
    limits = [
        f.level.value for f in builder.frames if isinstance(f, F.Height) and f.level.role == "at_most" and not f.of
    ]
    top = float(item.position @ builder.axis("up")) + extent(item, builder.axis("up"))
    room = short(min(limits, default=math.inf) - top)
    return min(usual, room) if room >= builder.room(item) + builder.tolerance else usual


def hover(builder: PolicyBuilder, frame: F.Hover) -> None:
    """Above an object, and wait there."""
    for item in map(builder.scene.__getitem__, frame.objects):
        top = extent(item, builder.axis("up"))
        if frame.by is None and (_passes_over(builder, item, top) or _walled_in(builder, item, top)):
            _wait_over(builder, frame, item)
            continue
        usual = max(nice(item.radius - top + builder.scale.step("slight")), builder.room(item), _above(builder, item))
        name, gap = _height_above(builder, item, frame.by, usual)
        count, ref, up = steps(builder, frame.duration), builder.ref(item), beyond(name, top)
        builder.add(
            f"traj = hover(traj, {ref}, {up}, steps={count})",
            f"Hover {gap:g} m above {item.name} for {waited(builder, count)}.",
            f"expect_visits({ref}, within={builder.tolerance}, up={up})",
            f"expect_stop(near={ref}, up={up})",
        )


def _passes_over(builder: PolicyBuilder, item: SceneObject, top: float) -> bool:
    """Whether the path passes over an object with a known size already, less than half its extent above it."""
    if item.dimensions is None:
        return False
    up = builder.axis("up")
    away = builder.passing(item.position) - item.position
    rise = float(away @ up)
    aside = float(np.linalg.norm(away - rise * up))
    return -top <= rise <= top + HIGH_UP * builder.scale.extent and aside <= float(np.sort(item.size)[1]) / 2.0


def _walled_in(builder: PolicyBuilder, item: SceneObject, top: float) -> bool:
    """Whether what is right above an object is in another one or at its surface, such as the wall that it hangs on."""
    over = item.position + (top + builder.room(item)) * builder.axis("up")
    bodies = (other.cuboid for other in builder.scene if other is not item and other.dimensions is not None)
    return any(float(body.signed(over[None])[0][0]) < FLAT * float(item.size.min()) for body in bodies)


FLAT = 0.51
"""The share of its least size within which what is above an object is at the surface of another one: about half."""


def _above(builder: PolicyBuilder, item: SceneObject) -> float:
    """How far above an object's top the path passes by it [m], less than half its extent; 0 of others."""
    if item.dimensions is None:
        return 0.0
    up = builder.axis("up")
    now = float((builder.passing(item.position) - item.position) @ up) - extent(item, up)
    return float(f"{now:.3g}") if 0.0 < now <= HIGH_UP * builder.scale.extent else 0.0


HIGH_UP = 0.5
"""How far above an object's top the path may be to stay that high where it hovers, as a share of the path's extent."""


def _wait_over(builder: PolicyBuilder, frame: F.Hover, item: SceneObject) -> None:
    """Wait where the path passes an object; what it waits there already counts."""
    rows, ref = builder.rows(), builder.ref(item)
    first, last = stands(rows, int(np.argmin(item.distance(rows[:, :3]))))
    count = steps(builder, frame.duration)
    in_all, told = (", in_all=True", " in all") if last > first else ("", "")
    plan = f"Wait {waited(builder, count)}{told} where the path passes {item.name}."
    builder.add(f"traj = dwell(traj, {ref}, steps={count}{in_all})", plan, f"expect_stop(near={ref})")


OBJECT_STEPS: Mapping[type[F.SemanticFrame], Callable[..., None]] = {
    F.Approach: approach, F.Clearance: clearance, F.Visit: visit, F.Hop: hop, F.Hover: hover,
}  # fmt: skip
