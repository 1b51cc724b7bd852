"""Steps that say where the path goes: shifts, ends, objects, heights and bounds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ovita.instruct import frames as F
from ovita.instruct.builder import PolicyBuilder, argument
from ovita.instruct.scale import Degree, nice
from ovita.paths.frame import OPPOSITE
from ovita.paths.geometry import closest_to_point
from ovita.paths.scene import SceneObject
from ovita.paths.trajectory import Array, interpolate, source_indices
from ovita.policy.policy import Role
from ovita.toolkit.approach import extent

APPROACH: dict[Degree, float] = {"slight": 0.25, "moderate": 0.5, "large": 0.75}
"""Share of the distance to an object by which "closer" comes closer."""

SIZE: dict[Degree, float] = {"slight": 0.06, "moderate": 0.12, "large": 0.22}
"""Size of a new shape as a share of the path's extent."""

MARGIN = 0.02
"""Least distance from the surface of an object at which a path ends beside or on it [m]."""

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


def size(d: PolicyBuilder, frame: F.SemanticFrame, q: F.Quantity | None, what: str, share: float = 1.0) -> float:
    """A length that is stated, or one that suits the scene [m]."""
    if q is not None:
        return d.metres(q, d.scale.extent, f"as {what}")
    value = nice(share * SIZE[degree(frame)] * d.scale.extent)
    d.assume(f"{what} is {value:g} m in this scene")
    return value


def tolerance(d: PolicyBuilder) -> float:
    """How near counts as passing through a place [m]."""
    return nice(0.02 * d.scale.extent)


def spot(d: PolicyBuilder, place: F.Place, default: str = "goal") -> tuple[str, str]:
    """Code of the place of a waypoint, and words for it."""
    if isinstance(place, tuple):
        a, b = (d.scene[name] for name in place)
        return f"midpoint({d.ref(a)}, {d.ref(b)})", f"closest to the midpoint of {a.name} and {b.name}"
    if isinstance(place, F.Quantity):
        return _along(d, place)
    place = place or default
    if place in F.SPOTS:
        return {"middle": "0.5"}.get(place, repr(place)), f"at the {place}" if place != "middle" else "in the middle"
    item = d.scene[place]
    return d.ref(item), f"closest to {item.name}"


def _along(d: PolicyBuilder, q: F.Quantity) -> tuple[str, str]:
    """A waypoint by number, or the one so far along the path."""
    n = len(d.trajectory)
    if q.unit in ("%", "x"):
        return f"{min(max(q.value, 0.0), 1.0):g}", f"at {q.value:.0%} of the path"
    if q.unit in ("m", "s"):
        measured = d.trajectory.arc_length if q.unit == "m" else d.trajectory.times
        return str(int(np.argmin(np.abs(measured - q.value)))), f"{q.value:g} {q.unit} after the start"
    if not 1 <= q.value <= n:
        d.ask(f"The path has {n} waypoints, counted from 1: which one is meant by {q.value:g}?")
    d.assume("waypoints are counted from 1")
    which = int(np.clip(q.value, 1, n))
    return str(which - 1), f"at waypoint {which}"


def target(d: PolicyBuilder, place: F.Place) -> tuple[str, str, Array]:
    """Code of a point to go to, words for it, and the point itself (3,) [m]."""
    rows = d.positions
    if isinstance(place, tuple):
        code, _ = spot(d, place)
        a, b = (d.scene[name] for name in place)
        return code, f"the midpoint of {a.name} and {b.name}", (a.position + b.position) / 2.0
    if isinstance(place, str) and place not in F.SPOTS:
        item = d.scene[place]
        return d.ref(item), item.name, item.position
    code, words = spot(d, place)
    if place in ("start", "goal"):
        i = 0 if place == "start" else len(rows) - 1
        return f"traj[{0 if place == 'start' else -1}, :3]", f"the {place}", rows[i]
    share = place.value if isinstance(place, F.Quantity) and place.unit in ("%", "x") else 0.5
    i = int(code) if code.isdigit() else round(share * (len(rows) - 1))
    return f"traj[{i}, :3]", words.removeprefix("at ").replace("in the middle", "the middle"), rows[i]


def height_of(item: SceneObject, up: Array) -> float:
    """How far an object reaches above its centre [m]; 0 if its size is not known."""
    return extent(item, up)


def _offset(d: PolicyBuilder, frame: F.SemanticFrame, offset: F.Offset, prefix: str = "") -> _Shifted:
    knobs: dict[str, str] = {}
    words, amounts = [], {}
    for said, q in offset:
        direction = d.word(said)
        value = d.scale.step(degree(frame)) if q is None else d.metres(q, d.scale.extent, direction)
        if q is None:
            much = {"slight": "a little ", "moderate": "", "large": "much "}[degree(frame)]
            d.assume(f'"{much}{direction}" is {value:g} m in this scene')
        if value < 0:
            direction, value = OPPOSITE[direction], -value
        if value == 0:
            d.ask(f"0 m {TO_THE.get(direction, direction)} moves nothing: how far should it go?")
        if OPPOSITE[direction] in knobs or direction in knobs:
            d.ask(f"Both {direction} and {OPPOSITE[direction]}: which way should it go?")
        amounts[direction] = value
        meaning = f"shift {TO_THE.get(direction, direction)}"
        knobs[direction] = d.knob(f"{prefix}{direction}", value, "by", meaning, said, direction=direction)
        words.append(f"{value:g} m {TO_THE.get(direction, direction)}")
    return _Shifted(knobs, amounts, " and ".join(words))


def shift(d: PolicyBuilder, frame: F.Shift) -> None:
    """Shift the path or a part of it; ends that are to stay do."""
    if not frame.offset:
        d.ask("Which way should the path go?")
        return
    offset = _offset(d, frame, frame.offset)
    where, part = d.part(frame.part)
    if where:
        d.add(f"traj = move(traj, {offset.code}, where={where})", f"Shift the path {offset.words}{part}.",
              f"expect_moved({offset.code}, where={where})")  # fmt: skip
        return
    ends = sorted(d.kept & {"start", "goal"})
    if ends:
        kept = "both" if len(ends) == 2 else ends[0]
        stay = f"the {' and the '.join(ends)} stay{'s' if len(ends) == 1 else ''}"
        d.add(f"traj = move(traj, {offset.code}, keep={kept!r})", f"Shift the path {offset.words}; {stay}.",
              f"expect_moved({offset.code})")  # fmt: skip
        return
    for direction, name in offset.knobs.items():
        d.shifts.setdefault(direction, []).append(name)
    stated = {d.word(said) for said, q in frame.offset if q is not None}
    d.exact |= {direction for direction in offset.knobs if direction in stated or OPPOSITE[direction] in stated}
    total = {direction: " + ".join(names) for direction, names in d.shifts.items()}
    d.add(f"traj = move(traj, {offset.code})", f"Shift the whole path {offset.words}.",
          ends={"shift": f"expect_moved({_arguments(total)})"})  # fmt: skip


def _with_shift(d: PolicyBuilder, knobs: Mapping[str, str], *, own: bool) -> dict[str, str]:
    """Where an end lies from its original place: its own directions, and the shift of the whole path.

    With `own`, an end's own direction overrides the shift along that axis; without, the two add up.
    """
    total = {direction: name + ("" if own else d.shifted(direction)) for direction, name in knobs.items()}
    for direction in d.shifts:
        if direction not in total and OPPOSITE[direction] not in total:
            total[direction] = d.shifted(direction).removeprefix(" + ")
    return total


def _negated(code: str) -> str:
    return code.replace(" + ", " ~ ").replace(" - ", " + ").replace(" ~ ", " - ")


def move_end(d: PolicyBuilder, frame: F.MoveEnd) -> None:
    """Shift an end, or bring it to, toward or away from a place; the path bends with it."""
    for end in ("start", "goal") if frame.end == "ends" else (frame.end,):
        d.goal_moved = d.goal_moved or end == "goal"
        if frame.relation == "to":
            _end_to(d, frame, end)
        elif frame.relation:
            _end_aimed(d, frame, end)
        elif frame.offset:
            own = _offset(d, frame, frame.offset, f"{end}_")
            undone = {direction: name + _negated(d.shifted(direction)) for direction, name in own.knobs.items()}
            promise = f"expect_{end}({_arguments(_with_shift(d, own.knobs, own=True))})"
            plan = f"Shift the {end} {own.words}; the path bends towards it."
            d.add(f"traj = move_{end}(traj, {_arguments(undone)})", plan, ends={end: "" if d.has(*TURNED) else promise})
        else:
            d.ask(f"Where should the {end} go?")


def _end_to(d: PolicyBuilder, frame: F.MoveEnd, end: str) -> None:
    code, words, _ = target(d, frame.place)
    item = d.scene[frame.place] if isinstance(frame.place, str) and frame.place not in F.SPOTS else None
    beside: dict[str, str] = {}
    for said, q in frame.offset:
        direction = d.word(said)
        half = extent(item, d.scene.frame.direction(direction)) if item is not None else 0.0
        value = half + (nice(max(MARGIN, 0.3 * d.scale.step("slight"))) if q is None else d.metres(q, 1.0, direction))
        value = float(f"{value:.6g}")
        d.assume(f'"{OF[direction]} {words}" is {value:g} m {direction} of its centre')
        beside[direction] = d.knob(
            f"{end}_{direction}", value, "to", f"distance {OF[direction]} {words}", said, direction=direction,
            about=item.name if item else "",
        )  # fmt: skip
        words = f"{value:g} m {OF[direction]} {words}"
    offset = f", {_arguments(beside)}" if beside else ""
    d.add(f"traj = move_{end}(traj, {code}{offset})", f"Move the {end} to {words}; the path bends towards it.",
          ends={end: f"expect_{end}({code}{offset})"})  # fmt: skip


def _end_aimed(d: PolicyBuilder, frame: F.MoveEnd, end: str) -> None:
    _, words, point = target(d, frame.place)
    away = frame.relation == "away"
    here = d.positions[0 if end == "start" else -1]
    distance = float(np.linalg.norm(point - here))
    if frame.by is not None:
        by = d.metres(frame.by, distance, f"{frame.relation} {words}")
    else:
        by = d.scale.step(degree(frame)) if away else nice(APPROACH[degree(frame)] * distance)
        d.assume(f'"{"farther from" if away else "closer to"} {words}" is {by:g} m')
    reach = by if away else min(by, distance)
    if distance < 1e-9 or reach <= 0:
        d.ask(f"The {end} is at {words} already: where should it go?")
        return
    unit = (point - here) / distance * (-1.0 if away else 1.0)
    told = "away from" if away else "toward"
    name = d.knob(f"{end}_by", float(f"{reach:.4g}"), "by", f"how far the {end} moves {told} {words}", "by",
                  direction="away" if away else "closer")  # fmt: skip
    shares = {w: float(f"{share:.6g}") for w, share in d.scene.frame.words(unit).items() if share > 1e-6}
    offset = _arguments({w: name if share == 1.0 else f"{share!r} * {name}" for w, share in shares.items()})
    promise = f"expect_{end}({offset})" if not d.shifts else ""
    d.add(f"traj = move_{end}(traj, {offset})",
          f"Move the {end} {reach:.4g} m {told} {words}; the path bends with it.", ends={end: promise})  # fmt: skip


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
    """At least so far from objects all along; at most so far, or exactly, at the closest approach to each."""
    q = frame.distance
    metres = d.metres(q, 1.0, "from " + " and ".join(frame.objects))
    items = [d.scene[name] for name in frame.objects]
    bound = q.role if q.role in ("at_most", "at") else "at_least"
    where, part = d.part(frame.part)
    names = " and ".join(item.name for item in items)
    if bound == "at_least":
        about = items[0].name if len(items) == 1 else ""
        name = d.knob("distance", metres, "at_least", "distance to keep, at least", "distance", about=about,
                      direction="away")  # fmt: skip
        refs = [d.ref(item) for item in items]
        code = refs[0] if len(refs) == 1 else f"[{', '.join(refs)}]"
        call = f"traj = keep_distance(traj, {code}, at_least={name}{argument(where)})"
        d.distances += [] if where else [(item, metres, call) for item in items]
        d.add(call, f"Keep at least {metres:g} m from {names}{part}.",
              *(f"expect_distance({ref}, at_least={name}{argument(where)})" for ref in refs))  # fmt: skip
        return
    for item in items:
        _come_within(d, item, metres, bound, where, part)


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
        if frame.relation == "at":
            ref = d.ref(item)
            d.add(f"traj = go_through(traj, {ref}{_width(d)})", f"Bend the path through {item.name}.",
                  f"expect_visits({ref}, within={tolerance(d)})")  # fmt: skip
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
    gap = nice(item.radius - half + d.scale.step("slight")) if q is None else d.metres(q, d.scale.extent, word)
    if q is None:
        passing = interpolate(d.positions, np.array([closest_to_point(d.positions, item.position)[1]]))[0]
        gap = max(gap, float(f"{float((passing - item.position) @ axis) - half:.3g}"))  # never nearer than it is
        d.assume(f'"{word} {item.name}" is {gap:g} m {word} its {end}')
    passed = _passes(d, item, axis)
    ref, sentence = d.ref(item), f"Bend the path {'over' if side == 'up' else 'under'} {item.name}, {gap:g} m"
    name = d.knob("height" if side == "up" else "depth", gap, "to" if q is None else q.role if q.role != "by" else "to",
                  f"distance {word} the {end} of {item.name}", "by", about=item.name, direction=side)  # fmt: skip
    centre = f"{name} + {float(f'{half:.6g}')!r}" if half else name
    within = tolerance(d) / 2
    promise = f"expect_side({word!r}, {name}, of={ref}, within={within})"
    loose = q is None or q.role == "at_least"
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
        gap = size(d, frame, frame.by, f"the height above {item.name}", 0.8)
        name = d.knob("height", gap, "to", f"height above the top of {item.name}", "by", about=item.name,
                      direction="up")  # fmt: skip
        ref = d.ref(item)
        d.add(f"traj = hop(traj, {ref}, {name})", f"Hop over {item.name}, {gap:g} m above it.",
              f"expect_side('above', {name}, of={ref}, within={tolerance(d) / 2})")  # fmt: skip


def hover(d: PolicyBuilder, frame: F.Hover) -> None:
    """Above an object, and wait there."""
    for item in map(d.scene.__getitem__, frame.objects):
        top = extent(item, d.scene.frame.direction("up"))
        gap = (nice(item.radius - top + d.scale.step("slight")) if frame.by is None
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
              f"expect_stop(near={ref})" if _distance(d, item) >= top + gap else "")  # fmt: skip


def steps(d: PolicyBuilder, duration: F.Quantity | None) -> str:
    """The parameter of a wait in timesteps."""
    if duration is None:
        d.assume("the wait lasts 10 timesteps")
    seconds = duration is not None and duration.unit in ("s", "")
    count = 10.0 if duration is None else duration.value / (d.trajectory.timestep if seconds else 1.0)
    if duration is not None and duration.unit not in ("s", "", "step", "waypoints"):
        d.ask(f"How many seconds are {duration.said or duration.value}?")
    meaning = f"timesteps to wait ({d.trajectory.timestep:g} s each)"
    return d.knob("steps", max(1, round(count)), "count", meaning, "duration", unit="", direction="longer")


def side(d: PolicyBuilder, frame: F.Side) -> None:
    """Pass objects on one side; stay there where the ends do."""
    word = d.word(frame.direction)
    axis = d.scene.frame.direction(word)
    where, part = d.part(frame.part)
    for item in map(d.scene.__getitem__, frame.objects):
        ref, half, words = d.ref(item), extent(item, axis), f"{OF[word]} {item.name}"
        kept = [f.distance.value for f in d.frames if isinstance(f, F.Clearance) and item.name in f.objects]
        gap = max([d.scale.step("slight"), *(nice(item.radius - half + metres) for metres in kept)])
        d.assume(f"the distance kept {words} is {gap:g} m")
        reach = (d.positions - item.position) @ axis
        name = d.knob("gap", gap, "at_least", f"distance {words}", "by", about=item.name, direction=word)
        if where or min(reach[0], reach[-1]) >= half + gap:
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


def extend(d: PolicyBuilder, frame: F.Extend) -> None:
    """Go on beyond the goal: to a place, in a direction, or straight on."""
    if frame.place:
        code, words, _ = target(d, frame.place)
        d.add(
            f"traj = continue_to(traj, {code})",
            f"Continue from the goal to {words}.",
            ends={"goal": f"expect_goal({code})"},
        )
    elif frame.offset:
        beyond = _offset(d, frame, frame.offset)
        total = _arguments(_with_shift(d, beyond.knobs, own=False))
        d.add(f"traj = extend(traj, {beyond.code})", f"After the goal, go on {beyond.words}.",
              ends={"goal": "" if d.goal_moved else f"expect_goal({total})"})  # fmt: skip
    else:
        by = d.scale.step(degree(frame)) if frame.by is None else d.metres(frame.by, d.trajectory.length, "beyond")
        if frame.by is None:
            d.assume(f"going on after the goal is {by:g} m in the direction of arrival")
        name = d.knob("further", by, "by", "how far to go on after the goal", "by", direction="farther")
        old = "" if d.goal_moved or d.shifts else f"expect_visits(original[-1, :3], within={tolerance(d)})"
        d.add(
            f"traj = extend(traj, {name})",
            f"After the goal, go on for {by:g} m in the same direction.",
            ends={"goal": old},
        )
    d.goal_moved = True


def come_back(d: PolicyBuilder, frame: F.Return) -> None:
    """Straight on from the goal to where the path starts."""
    d.add("traj = continue_to(traj, traj[0, :3], smooth=False)", "After the goal, go straight back to the start.",
          ends={"goal": "expect_goal(traj[0, :3])"})  # fmt: skip


def height(d: PolicyBuilder, frame: F.Height) -> None:
    """At a height above the ground, or above or below one."""
    q = frame.level
    value = d.metres(q, 1.0, "above the ground")
    where, part = d.part(frame.part)
    bounded = q.role in ("at_least", "at_most")
    words = {"at_least": "at or above", "at_most": "at or below"}.get(q.role, "at")
    role: Role = q.role if bounded else "to"
    name = d.knob("height", value, role, "height above the ground, z = 0", "level", direction="up")
    key = f"{q.role}={name}" if bounded else name
    promise = f"{q.role}={name}" if bounded else f"{name}, {name}"
    up = d.positions @ d.scene.frame.direction("up")
    chosen = up[d.waypoints(frame.part)] if where and len(up) == len(d.trajectory) else up
    holds = bool(((chosen >= value) if q.role == "at_least" else (chosen <= value)).all()) and bounded
    d.exact |= set() if where else {"up"}
    d.add(f"traj = at_height(traj, {key}{argument(where)})", f"Stay {words} {value:g} m above the ground{part}.",
          f"expect_side('up', {promise}{argument(where)})", holds=holds)  # fmt: skip


def bound(d: PolicyBuilder, frame: F.Bound) -> None:
    """Within a distance to one side of the origin or of an object."""
    where, part = d.part(frame.part)
    of, about, origin = "", "the origin", np.zeros(3)
    if frame.of:
        code, about, origin = target(d, frame.of)
        of = f", of={code}"
    for said, q in frame.offset:
        direction = d.word(said)
        limit = 0.0 if q is None else d.metres(q, d.scale.extent, direction)
        name = d.knob("limit", limit, "at_most", f"furthest {direction} of {about}", said, direction=direction)
        words = f"Never go further {direction} of {about} than {limit:g} m{part}."
        if limit < 0:
            words = f"Stay at least {-limit:g} m {OPPOSITE[direction]} of {about}{part}."
        holds = bool(((d.positions - origin) @ d.scene.frame.direction(direction) <= limit).all())
        d.add(f"traj = bound(traj, {direction}={name}{of}{argument(where)})", words,
              f"expect_side({direction!r}, at_most={name}{of}{argument(where)})", holds=holds)  # fmt: skip


def quadrant(d: PolicyBuilder, frame: F.Quadrant) -> None:
    """In one quadrant of the horizontal plane."""
    if frame.number not in (1, 2, 3, 4):
        d.ask(f"There are the quadrants 1 to 4: which one is meant by {frame.number}?")
        return
    sides = (("right", "front"), ("left", "front"), ("left", "back"), ("right", "back"))[frame.number - 1]
    plan = f"Shift the path so that all of it lies in quadrant {frame.number}."
    d.add(f"traj = quadrant(traj, {frame.number})", plan, *(f"expect_side({word!r}, 0.0)" for word in sides))


def keep(d: PolicyBuilder, frame: F.Keep) -> None:
    """What is to stay as it is: the other steps leave it alone, and postconditions say so."""
    where, part = d.part(frame.part)
    if frame.what == "part" or (where and frame.what in ("path", "rest")):
        d.kept.add("part")
        d.add("", f"Change nothing{part}.", f"expect_same_path({where})", f"expect_same_speed({where})")
        return
    d.kept |= {"start", "goal"} if frame.what == "ends" else {frame.what}
    for what in sorted(d.kept & {"start", "goal"}):
        d.add("", f"Leave the {what} as it is.", ends={what: f"expect_{what}()"})
    if frame.what in ("path", "speed"):
        d.add("", f"Leave the {frame.what} as it is{part}.", f"expect_same_{frame.what}({where})")
    elif frame.what == "height":
        d.exact.add("up")
        d.add("", f"Leave the height as it is{part}.")


PATH_STEPS: Mapping[type[F.SemanticFrame], Callable[..., None]] = {
    F.Shift: shift, F.MoveEnd: move_end, F.Approach: approach, F.Clearance: clearance, F.Visit: visit, F.Side: side,
    F.Extend: extend, F.Hop: hop, F.Hover: hover, F.Height: height, F.Bound: bound, F.Return: come_back,
    F.Quadrant: quadrant, F.Keep: keep,
}  # fmt: skip
