"""Steps that say where the path goes: shifts, ends, heights and bounds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ovita.instruct import frames as F
from ovita.instruct.builder import PolicyBuilder, aiming, argument
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


def usual_gap(d: PolicyBuilder) -> float:
    """How far beside or above a thing is close to it [m]."""
    return nice(max(MARGIN, 0.3 * d.scale.step("slight")))


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


def aimed_at(d: PolicyBuilder, words: str, aim: F.Aim, item: SceneObject | None) -> str:
    """Words for what of an object is meant; without its dimensions there is the centre only."""
    if aim and item is not None and item.dimensions is None:
        d.assume(f"the size of {item.name} is not known, so its position stands for its {aim}")
    return f"the {aim} of {words}" if aim else words


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
        elif frame.level is not None:
            _end_level(d, frame, frame.level, end)
        elif frame.offset:
            own = _offset(d, frame, frame.offset, f"{end}_")
            undone = {direction: name + _negated(d.shifted(direction)) for direction, name in own.knobs.items()}
            promise = f"expect_{end}({_arguments(_with_shift(d, own.knobs, own=True))})"
            plan = f"Shift the {end} {own.words}; the path bends towards it."
            d.add(f"traj = move_{end}(traj, {_arguments(undone)})", plan, ends={end: "" if d.has(*TURNED) else promise})
        else:
            d.ask(f"Where should the {end} go?")


def _level(d: PolicyBuilder, q: F.Quantity, of: F.Place) -> float:
    """A height above the ground [m], or so far above an object's top, below its bottom, or that of its centre."""
    value = d.metres(q, 1.0, "above the ground")
    if not of:
        return value
    _, words, point = target(d, of)
    up = d.scene.frame.direction("up")
    bound = q.role in ("at_least", "at_most")
    at, sign = ("top", 1.0) if bound or value > 0 else ("bottom", -1.0) if value < 0 else ("centre", 0.0)
    half = extent(d.scene[of], up) if isinstance(of, str) and of not in F.SPOTS else 0.0
    value = float(f"{value + float(point @ up) + sign * half:.6g}")
    d.assume(f"the height of {words} is that of its {at}, which makes it {value:.4g} m above the ground")
    return value


def _end_level(d: PolicyBuilder, frame: F.MoveEnd, q: F.Quantity, end: str) -> None:
    """Bring an end to a height above the ground."""
    up, row = d.scene.frame.direction("up"), 0 if end == "start" else -1
    value = _level(d, q, frame.place)
    name = d.knob(f"{end}_height", value, "to", f"height of the {end} above the ground, z = 0", "level", direction="up")
    now, given = (f"{float(rows[row] @ up):.6g}" for rows in (d.positions, d.trajectory.positions))
    d.add(f"traj = move_{end}(traj, up={name} - {now})",
          f"Move the {end} to {value:g} m above the ground; the path bends towards it.",
          ends={end: "" if d.has(*TURNED) else f"expect_{end}(up={name} - {given})"})  # fmt: skip


def _facing(d: PolicyBuilder, item: SceneObject) -> F.Direction:
    """The level side of an object that faces the middle of the path, from where an end that moves is reached."""
    away = d.positions[len(d.positions) // 2] - item.position
    sides: tuple[F.Direction, ...] = ("left", "right", "front", "back")
    axes = {word: d.scene.frame.direction(word) for word in sides}
    return max(axes, key=lambda word: float(away @ axes[word]) - extent(item, axes[word]))


def _end_to(d: PolicyBuilder, frame: F.MoveEnd, end: str) -> None:
    code, words, _ = target(d, frame.place)
    item = d.scene[frame.place] if isinstance(frame.place, str) and frame.place not in F.SPOTS else None
    if frame.aim in BESIDE and item is not None:
        side = BESIDE[frame.aim] or _facing(d, item)
        frame = replace(frame, aim="", offset=((side, frame.by),))
    code, words = code + aiming(frame.aim), aimed_at(d, words, frame.aim, item)
    beside: dict[str, str] = {}
    for said, q in frame.offset:
        direction = d.word(said)
        half = extent(item, d.scene.frame.direction(direction)) if item is not None else 0.0
        usual = max(usual_gap(d), d.room(item) if item is not None else 0.0)
        value = half + (usual if q is None else d.metres(q, 1.0, direction))
        value = float(f"{value:.6g}")
        surface = "" if q is None or not half else f", counted from its surface, {value:g} m from its centre"
        d.assume(f'"{direction}" is {value:g} m {OF[direction]} the centre of {words}' if not surface else
                 f"{OF[direction]} {words}{surface}")  # fmt: skip
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
    point = d.scene.frame.levelled(point)
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


def extend(d: PolicyBuilder, frame: F.Extend) -> None:
    """Go on beyond the goal: to a place, in a direction, or straight on."""
    if frame.place:
        code, words, _ = target(d, frame.place)
        item = d.scene[frame.place] if isinstance(frame.place, str) and frame.place not in F.SPOTS else None
        code, words = code + aiming(frame.aim), aimed_at(d, words, frame.aim, item)
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
        way = "in the same direction" if by >= 0 else "back along the path"
        name = d.knob("further", abs(by), "by", f"how far to go {'on' if by >= 0 else 'back'} after the goal", "by",
                      direction="farther")  # fmt: skip
        old = "" if d.goal_moved or d.shifts else f"expect_visits(original[-1, :3], within={tolerance(d)})"
        d.add(
            f"traj = extend(traj, {name if by >= 0 else f'-{name}'})",
            f"After the goal, go on for {abs(by):g} m {way}.",
            f"expect_length(longer_by={name})" if d.alone else "",
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
    value = _level(d, q, frame.of)
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
    F.Shift: shift, F.MoveEnd: move_end, F.Extend: extend, F.Height: height, F.Bound: bound, F.Return: come_back,
    F.Quadrant: quadrant, F.Keep: keep,
}  # fmt: skip
