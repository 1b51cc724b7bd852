"""Steps that change the speed, or make the robot stop or wait."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import cast

import numpy as np

from ovita.instruct import frames as F
from ovita.instruct.builder import PolicyBuilder, argument, degree, short
from ovita.instruct.degrees import FASTER, SLOWER, nice
from ovita.instruct.object_steps import surface_distance
from ovita.instruct.path_steps import aimed, spot, steps, waited
from ovita.paths.geometry import runs, spacing
from ovita.paths.part import PathPart, both, outside
from ovita.paths.scene import SceneObject
from ovita.paths.trajectory import Array, arc_length
from ovita.policy.source import Role
from ovita.toolkit.speed import slow_turns, stands, travel_time

STANDSTILL = "A speed of 0 would never arrive: how slow should it be, or where should it stop, and for how long?"

ANGLES = (30, 20, 10, 5, 2)
"""How sharp a turn is at least [degrees]: the first of these that the path has."""


class _Speed:
    """What a change of speed is about: its part of the path and the speeds there."""

    def __init__(self, builder: PolicyBuilder, frame: F.Pace) -> None:
        self.builder, self.frame, self.q = builder, frame, frame.amount
        where, self.part = builder.part(frame.part)
        self.argument, self.promised = argument(where), f"where={where}" if where else ""
        self.mask, self.all = builder.waypoints(frame.part), builder.trajectory.speeds
        if frame.change in ("rampup", "rampdown") and len(rows := builder.rows()) == len(self.all):
            self.all = rows[:, 3]  # from and to what another step has made of it
        self.chosen = self.all[self.mask] if self.mask.any() else self.all
        moving = self.all[self.all > 0]
        self.mean = float(moving.mean()) if len(moving) else 0.0

    def add(self, call: str, plan: str, *promises: str, holds: bool = False) -> None:
        self.builder.add(f"traj = {call}", f"{plan}{self.part}.", *promises, holds=holds)

    def knob(self, name: str, value: float, role: Role, meaning: str, slot: str = "amount", way: str = "") -> str:
        return self.builder.knob(name, value, role, meaning, slot, unit="m/s", direction=way)

    def value(self, whole: float) -> float:
        """The amount as a speed [m/s]; shares and multiples are of a speed."""
        if self.q is None or self.q.unit not in ("m/s", "", "x", "%"):
            self.builder.ask("How fast should it be, in m/s?")
            return whole
        return self.q.value * (whole if self.q.unit in ("x", "%") else 1.0)

    def arrives(self, highest: float) -> None:
        """Ask where no speed would be left."""
        if highest <= 0:
            self.builder.ask(STANDSTILL)


def pace(builder: PolicyBuilder, frame: F.Pace) -> None:
    """Change the speed: by a factor, an amount, to a value, within a bound, or along a law."""
    lasts = frame.amount is not None and frame.amount.unit == "s"
    (_last if lasts else _LAWS.get(frame.change, _change))(_Speed(builder, frame))


def on_the_way(builder: PolicyBuilder, frame: F.Pace | F.Shift) -> F.SemanticFrame:
    """A change of speed or place with the part that is meant by what is before a thing."""
    told = [one for one in frame.part.parts if frame.part.kind == "both" and one.kind == "before"]
    if told and frame.part == both(told[0], outside(PathPart("after", told[0].places))):  # "until the cup, then ..."
        frame = replace(frame, part=told[0])
    frame = replace(frame, part=_on_the_way(builder, frame))
    return _unshared(builder, frame) if isinstance(frame, F.Pace) else frame


def _unshared(builder: PolicyBuilder, frame: F.Pace) -> F.Pace:
    """Slower near one thing and near another one is not slower twice where both are near: the stronger holds there.

    After a thing near which there is another speed begins behind what is near it, and before it ends there.
    """
    about = PathPart("near", frame.part.places)
    others = [one for one in builder.frames if isinstance(one, F.Pace) and one.part != frame.part]
    if frame.part.kind in ("after", "before"):
        beside = any(one.part == about and one.change != frame.change for one in others)
        return replace(frame, part=both(frame.part, outside(about))) if beside else frame
    mask = builder.waypoints(frame.part)
    for other in filter(lambda one: _is_weaker(builder, frame, one), others):
        shared = builder.waypoints(other.part) & mask
        if shared.any() and not shared[mask].all():
            frame = replace(frame, part=both(frame.part, outside(other.part)))
    return frame


def _is_weaker(builder: PolicyBuilder, frame: F.Pace, other: F.Pace) -> bool:
    """Whether as much or more of the same change is asked for near another thing, of two that are the same before."""
    mine, theirs = _factor_near(frame), _factor_near(other)
    if mine is None or theirs is None or other.change != frame.change:
        return False
    before = [one.part for one in builder.frames].index(other.part) < builder.frame
    return abs(theirs - 1.0) > abs(mine - 1.0) or (before and theirs == mine)


def _factor_near(frame: F.Pace) -> float | None:
    """The factor on the speed that is asked for near a thing; None of other changes and other parts."""
    if frame.change not in ("faster", "slower") or frame.part.kind != "near":
        return None
    return frame.factor if frame.amount is not None else (SLOWER if frame.change == "slower" else FASTER)[degree(frame)]


def _named(part: PathPart) -> bool:
    return isinstance(part.places[0], str)


def _on_the_way(builder: PolicyBuilder, frame: F.Pace | F.Shift) -> PathPart:
    """The part of a change, where what it is before says less than all that is before.

    On the way to a thing is behind the last stop before it. To slow down before a thing is to do so near it, unless it
    is told from after, or the path ends there.
    """
    part, change = frame.part, frame.change if isinstance(frame, F.Pace) else ""
    stated = isinstance(frame, F.Pace) and frame.amount is not None
    if change not in ("faster", "slower", "") or stated or part.kind != "before" or not _named(part):
        return part
    item = builder.item(part.places[0])
    told = (other.part for other in builder.frames if isinstance(other, F.Pace))
    if item is None or any(other.kind == "after" and other.places == part.places for other in told):
        return part
    near = builder.scale.near(builder.trajectory.positions, item)
    since = _since_the_stop(builder, item, near, slower=change == "slower")
    if since is not None or change != "slower":
        return since or part
    builder.assume(f'"before {item.name}" begins {nice(BRAKING * near):g} m from its centre')
    return both(part, PathPart("near", part.places, nice(BRAKING * near)))


def _since_the_stop(builder: PolicyBuilder, item: SceneObject, near: float, *, slower: bool) -> PathPart | None:
    """The way to a thing from the stop before it on; None of a path that does not stop before."""
    path = builder.trajectory.positions
    still, away = np.flatnonzero(builder.trajectory.speeds[1:-1] <= 0.0) + 1, item.core(path).depth(path)
    there = still[away[still] <= away.min() + builder.tolerance]
    ends = not len(there) and away[-1] <= near
    to = len(path) if ends else there[0] if len(there) else int(away.argmin()) + 1
    earlier = still[still < to]
    if not len(earlier) or (slower and not ends):
        return None
    builder.assume(f"on the way to {item.name} is from the stop before it on")
    return PathPart("range", amount=float(earlier[-1] + 1), until=None if ends else float(to - 1))


BRAKING = 2.0
"""How many times as far as near a thing it is slow before it."""


def _last(s: _Speed) -> None:
    """Take so long for the way, or so much longer or less long."""
    q, rows = s.q or F.Quantity(0.0), s.builder.rows()
    part = s.mask if len(rows) == len(s.mask) else np.ones(len(rows), dtype=bool)
    now, cap = travel_time(rows, part), s.frame.change == "cap"
    was = _before(s, now)
    change = {"faster": was - q.value, "slower": was + q.value}.get(s.frame.change, q.value)
    lasts = short(change if q.role == "by" else q.value - _standing(s))
    if lasts <= 0 or now == 0 or s.frame.change == "floor":
        s.builder.ask(f"It takes {now:.3g} s now: how long should it take?")
    name = s.builder.knob("duration", lasts, "at_most" if cap else "to", "time for the way", "amount", unit="s")
    call, promise = f"set_duration(traj, {name}{s.argument})", f"{'at_most=' if cap else ''}{name}{s.argument}"
    s.add(call if now > lasts or not cap else "traj", f"Take {'at most ' if cap else ''}{lasts:g} s for the way",
          f"expect_duration({promise})", holds=cap and now <= lasts)  # fmt: skip


def _standing(s: _Speed) -> float:
    """How long the robot stands still on the given path [s], which the whole of it takes too."""
    still = (np.diff(s.builder.trajectory.positions, axis=0) == 0.0).all(axis=1)
    seconds = short(float(still.sum()) * s.builder.trajectory.timestep) if not s.frame.part else 0.0
    if seconds:
        s.builder.assume(f"{seconds:g} s of it the robot stands still")
    return seconds


def _before(s: _Speed, now: float) -> float:
    """How long the way takes before all steps [s]; with halts or of a part, as the steps so far leave it."""
    rows = s.builder.trajectory.to_array()
    return now if s.frame.part or s.builder.has(F.Wait, F.Hover) else travel_time(rows, np.ones(len(rows), dtype=bool))


def _change(s: _Speed) -> None:
    change, q, factor = s.frame.change, s.q, s.frame.factor
    if q is None and change != "set":
        factor = (SLOWER if change == "slower" else FASTER)[degree(s.frame)]
        s.builder.assume(f'"{change}" is {factor:g} times the speed')
    if factor is not None:
        _scale(s, factor)
    elif q is not None and q.role in ("by", "of") and change != "set":
        _shift(s, s.value(s.mean) * (-1.0 if change == "slower" else 1.0))
    else:
        _set(s, s.value(s.mean))


def _scale(s: _Speed, factor: float) -> None:
    s.arrives(factor)
    if s.mean == 0:
        s.builder.ask("The speed is 0 everywhere: how fast should it be, in m/s?")
    if not {"slower": factor < 1, "faster": factor > 1}.get(s.frame.change, True):
        s.builder.ask(f"{factor:g} times the speed is not {s.frame.change}: which is meant?")
    name, word = ("slowdown", "slower") if factor < 1 else ("speedup", "faster")
    factor = short(factor)
    knob = s.builder.knob(name, factor, "factor", "factor on the speed", "amount", unit="", direction=word)
    promise = f"expect_{word}({s.promised})" if factor != 1 else ""
    s.add(f"scale_speed(traj, {knob}{s.argument})", f"Multiply the speed by {factor:g}", promise)


def _shift(s: _Speed, amount: float) -> None:
    s.arrives(float(s.chosen.max()) + amount)
    verb, word = ("Lower", "slower") if amount < 0 else ("Raise", "faster")
    knob = s.knob("speed_change", amount, "by", "added to the speed", way="faster")
    plan = f"{verb} the speed by {abs(amount):g} m/s"
    s.add(f"shift_speed(traj, {knob}{s.argument})", plan, f"expect_{word}({s.promised})")


def _set(s: _Speed, value: float) -> None:
    s.arrives(value)
    now = float(s.chosen.mean())
    if {"slower": value > now, "faster": value < now}.get(s.frame.change):
        s.builder.assume(f"{value:g} m/s is not {s.frame.change} than the {now:.3g} m/s there now")
    if s.mask.all():
        _without_halts(s, value)
    knob = s.knob("speed", value, "to", "", way="faster")
    promise = f"expect_speed({knob}{s.argument})"
    s.add(f"set_speed(traj, {knob}{s.argument})", f"Set the speed to {value:g} m/s", promise)


def _constant(s: _Speed) -> None:
    """One speed all along: the one that is stated, by this frame or by another one, or the mean."""
    others = [f for f in s.builder.frames if isinstance(f, F.Pace) and f.change == "set" and f.part == s.frame.part]
    if s.q is None and any(other.factor is None for other in others):
        return
    if s.q is not None:
        _set(s, s.value(s.mean))
        return
    moving = s.chosen[s.chosen > 0]
    value = float(f"{moving.mean() if len(moving) else s.mean:.3g}")
    s.builder.assume(f"the constant speed is the mean of the original, {value:g} m/s")
    _set(s, value)


def _bound(s: _Speed) -> None:
    value = short(s.value(float(s.chosen.max()) if s.frame.change == "cap" else s.mean))
    moving = s.chosen[s.chosen > 0]
    if s.frame.change == "cap":
        s.arrives(value)
        key, which, holds = "at_most", "highest", (moving <= value).all()
    else:
        key, which, holds = "at_least", "lowest", (moving >= value).all()
        _without_halts(s, value)
    name = s.knob("limit", value, cast(Role, key), f"{which} speed")
    plan, promise = f"Keep the speed {key.replace('_', ' ')} {value:g} m/s", f"expect_speed({key}={name}{s.argument})"
    s.add(f"bound_speed(traj, {key}={name}{s.argument})", plan, promise, holds=bool(holds))


def _without_halts(s: _Speed, value: float) -> None:
    """So fast also at waypoints on the way at which the speed but touches 0."""
    path = s.builder.trajectory.positions
    still = (np.diff(path, axis=0) == 0.0).all(axis=1)
    halts = [i for i in range(1, len(path) - 1) if s.all[i] <= 0.0 and s.mask[i] and not (still[i - 1] or still[i])]
    if halts:
        where, words = s.builder.part(PathPart("indices", ranges=tuple((i, i) for i in halts), count=len(path)))
        s.builder.add(
            f"traj = set_speed(traj, {short(value):g}, where={where})", f"Go on{words}, where it stops short."
        )


def _ramp(s: _Speed) -> None:
    """A speed that changes steadily along the path or a part of it."""
    begin, end = _from_to(s)
    if s.frame.change == "rampup" and s.q is None and s.frame.part.kind == "first":
        if 2.0 * float(s.chosen.mean()) < begin + end:  # it is slower there than it would become
            _change(_Speed(s.builder, replace(s.frame, change="slower")))
            return
    a = s.knob("start_speed", begin, "to", "where the change begins", "begin")
    b = s.knob("end_speed", end, "to", "where the change ends")
    s.builder.assume(f"the speed changes steadily from {begin:g} to {end:g} m/s")
    promises = ["expect_stop()"] if end == 0.0 and s.mask[-1] else []
    if s.mask.all():
        promises.append(f"expect_speed({a}, first(traj, 1))")
        promises += [f"expect_speed({b}, last(traj, 1))"] if end else []
    plan = f"Change the speed steadily from {begin:g} to {end:g} m/s"
    s.add(f"ramp_speed(traj, {a}, {b}{s.argument})", plan, *promises)


def _from_to(s: _Speed) -> tuple[float, float]:
    """From where and to where the speed changes [m/s]; at the goal to a standstill where nothing else is said."""
    rises = s.frame.change == "rampup"
    end = s.value(s.mean) if s.q is not None else _risen(s) if rises else _fallen(s)
    if rises:
        caps = [one.amount.value for one in s.builder.frames if isinstance(one, F.Pace) and _is_cap(one) and one.amount]
        end = min(end, *caps) if caps else end
    begin = min(float(s.chosen[0]), 0.5 * s.mean, 0.5 * end) if rises else _falls_from(s, end)
    return float(f"{begin:.3g}"), float(f"{end:.3g}")


def _risen(s: _Speed) -> float:
    """The speed that it rises to: that of the path behind the part, else half as much again as its highest [m/s]."""
    behind = s.all[int(np.flatnonzero(s.mask)[-1]) + 1 :] if s.mask.any() else s.all[:0]
    return float(behind[0]) if len(behind) and behind[0] > 0.0 else 1.5 * float(s.all.max())


def _fallen(s: _Speed) -> float:
    """The speed that it falls to: none at the goal, a quarter elsewhere [m/s]."""
    return 0.0 if s.mask.all() or s.frame.part.kind in ("last", "after") else 0.25 * s.mean


def _falls_from(s: _Speed, end: float) -> float:
    """The speed from which it falls to another [m/s]."""
    first = float(s.chosen[0])
    begin = first if first > 0.2 * s.mean else s.mean
    begin = begin if begin > end else 2 * end
    falls_already = s.q is None and not s.mask.all() and begin + end > 1.5 * float(s.chosen.mean())
    return begin * 0.5 if falls_already else begin  # a lower speed must be clearly lower


def _is_cap(frame: F.Pace) -> bool:
    """Whether it is a highest speed [m/s] for all of the path."""
    return frame.change == "cap" and not frame.part and frame.amount is not None and frame.amount.unit in ("m/s", "")


def _sharpness(rows: Array) -> int:
    """The angle [degrees] from which on a path turns: the largest by which no gentle turn is missed; 0 for none."""
    slow = {angle: slow_turns(rows, 0.5, angle=angle)[:, 3] < 0.51 * rows[:, 3] for angle in ANGLES}
    sharpest = next((angle for angle, turning in slow.items() if turning.any()), 0)
    angles = [a for a in (sharpest, *GENTLE) if a and a <= sharpest and slow[a].mean() <= MOST]
    return max(angles, key=lambda angle: (len(list(runs(slow[angle]))), angle), default=sharpest)


GENTLE, MOST = (20, 10), 0.4
"""Angles of gentler turns, and the largest share of a path that its turns may be for these to count."""


def _turns(s: _Speed) -> None:
    q, rows = s.q, s.builder.rows()
    factor = SLOWER[degree(s.frame)] if q is None else 1.0 - q.value if (q.unit, q.role) == ("%", "by") else q.value
    angle = _sharpness(rows)
    meaning = "factor on the speed in turns"
    name = s.builder.knob("slowdown", factor, "factor", meaning, "amount", unit="", direction="slower")
    call, plan = f"slow_turns(traj, {name}, angle={angle or ANGLES[0]})", "Slow down before and in turns, to "
    s.builder.add_within(s.frame.part, call, f"{plan}{factor:g} times the speed", "expect_slower()" if angle else "")


def _accelerate(s: _Speed) -> None:
    if s.q is None or s.q.unit not in ("m/s2", ""):
        s.builder.ask("How much is it to accelerate, in m/s^2?")
    rate = s.q.value if s.q is not None else 0.0
    name = s.builder.knob("acceleration", rate, "to", "", "amount", unit="m/s^2", direction="faster")
    plan = f"{'Accelerate' if rate > 0 else 'Brake'} at a constant {abs(rate):g} m/s^2"
    s.add(f"accelerate(traj, {name}{s.argument})", plan, f"expect_acceleration({name}{s.argument})")


_LAWS: Mapping[str, Callable[[_Speed], None]] = {
    "cap": _bound, "floor": _bound, "constant": _constant, "rampup": _ramp, "rampdown": _ramp, "turns": _turns,
    "accelerate": _accelerate,
}  # fmt: skip


def stop(builder: PolicyBuilder, frame: F.StopAt) -> None:
    """Come to rest at a place; the trajectory ends there."""
    at, words = spot(builder, frame.place)
    item = builder.item(frame.place)
    builder.assume("to stop means to end there; say 'wait' to go on afterwards")
    if item is not None and (short_of := _short_of(builder, item, frame)) is not None:
        _stop_short(builder, item, short_of)
    elif item is not None and frame.aim:
        place, words = aimed(builder, item.name, frame.aim)
        builder.goal_moved = True
        plan, goal = f"Slow down and stop at {words}; the path ends there.", f"expect_goal({place})"
        call = f"traj = move_goal(stop_at(traj, {at}{_brake(builder, item)}), {place})"
        builder.add(call, plan, "expect_stop()", ends={"goal": goal})
    else:
        plan, promise = f"Slow down and stop {words}; the trajectory ends there.", f"near={at}" if item else ""
        there = _after_its_rounds(builder, item) or at
        builder.add(f"traj = stop_at(traj, {there}{_brake(builder, item)})", plan, f"expect_stop({promise})")


def _after_its_rounds(builder: PolicyBuilder, item: SceneObject | None) -> str:
    """The last waypoint of a figure around an object at which the path is to stop then; "" where there is none."""
    if item is None or not any(isinstance(f, F.Figure) and f.place == item.name for f in builder.frames):
        return ""
    away = item.distance(builder.positions)
    return str(int(np.flatnonzero(away <= away.min() + builder.tolerance)[-1]))


def _brake(builder: PolicyBuilder, item: SceneObject | None = None) -> str:
    """The argument that shortens the braking distance to what the speed needs, or to a part of the way to it; or ""."""
    rows = builder.rows()
    s = arc_length(rows[:, :3])
    to = s[item.distance(rows[:, :3]).argmin()] if item is not None else s[-1]
    way = float(min(rows[:, 3].max() ** 2 / (2.0 * GENTLY), BRAKES_OVER * to) / max(s[-1], 1e-9))
    return f", brake={nice(way):g}" if 0.0 < way < 0.1 else ""


GENTLY, BRAKES_OVER = 0.25, 0.3
"""A deceleration that nobody minds [m/s^2], and the share of the way to a stop that braking takes at most."""


def _short_of(builder: PolicyBuilder, item: SceneObject | None, frame: F.StopAt | F.Wait) -> F.Quantity | None:
    """How far before an object to stop: as it is said, or a little before it; None at it."""
    if item is None or frame.by is not None or frame.aim != "short":
        return frame.by
    nearest = surface_distance(item, builder.positions)
    by = nice(max(builder.scale.step("slight"), 1.2 * nearest))
    builder.assume(f"before {item.name} is {by:g} m before it")
    return F.Quantity(by, "m")


def _stop_short(builder: PolicyBuilder, item: SceneObject, q: F.Quantity) -> None:
    """Come to rest so far from an object's surface, where the path first comes so near."""
    by, ref = builder.metres(q), builder.ref(item)
    name = _short(builder, item, q)
    builder.goal_moved = True
    plan = f"Slow down and stop {by:g} m before {item.name}; the path ends there."
    promise = f"expect_distance({ref}, nearest={name})"
    builder.add(f"traj = stop_before(traj, {ref}, {name}{_brake(builder, item)})", plan, promise, "expect_stop()")


def _short(builder: PolicyBuilder, item: SceneObject, q: F.Quantity) -> str:
    """The parameter of how far before an object to stop."""
    by, first = builder.metres(q), surface_distance(item, builder.positions[:2])
    if first <= by:
        builder.ask(f"The path starts {first:.3g} m from {item.name}: how far before it should it stop?")
    meaning = f"distance at which to stop before {item.name}"
    return builder.knob("short", by, "at", meaning, "by", about=item.name, direction="away")


def _wait_short(builder: PolicyBuilder, item: SceneObject, q: F.Quantity, steps: str, lasting: str) -> None:
    """Stand still so far from an object's surface, where the path first comes so near, then go on."""
    nearest = surface_distance(item, builder.positions)
    if nearest > builder.metres(q):
        builder.ask(f"The path comes no nearer than {nearest:.3g} m to {item.name}: where should it wait?")
    name, ref = _short(builder, item, q), builder.ref(item)
    plan = f"Wait {lasting} {builder.metres(q):g} m before {item.name}."
    builder.add(f"traj = wait_before(traj, {ref}, {name}, {steps})", plan, f"expect_stop({ref}, before={name})")


def wait(builder: PolicyBuilder, frame: F.Wait) -> None:
    """Stand still at a place, then go on."""
    frame = _lingering(builder, frame)
    near, words = spot(builder, frame.place)
    item, stood = builder.item(frame.place), _stands_for(builder, frame)
    name = steps(builder, _as_long_again(builder, stood) if frame.longer and not frame.duration else frame.duration)
    lasting = waited(builder, name) + (" longer" if stood and frame.longer else "")
    in_all, told = (", in_all=True", " in all") if stood and not frame.longer else ("", "")
    if item is None:
        promise = "expect_stop()" if frame.place in ("", "goal") else ""
        builder.add(f"traj = dwell(traj, {near}, steps={name}{in_all})", f"Wait {lasting}{told} {words}.", promise)
    elif (short_of := _short_of(builder, item, frame)) is not None:
        _wait_short(builder, item, short_of, name, lasting)
    elif frame.aim:
        _wait_beside(builder, item, frame, name, lasting, near)
    else:
        call = f"dwell(traj, {stop_by(builder, item) or near}, steps={name}{in_all})"
        builder.add(f"traj = {call}", f"Wait {lasting}{told} {words}.", f"expect_stop(near={near})")


def _lingering(builder: PolicyBuilder, frame: F.Wait) -> F.Wait:
    """A wait that is to be longer at the stop that is meant; to linger where it stands already is that, too."""
    if not (frame.duration or frame.longer or frame.aim or frame.by):
        frame = replace(frame, longer=_stands_for(builder, frame) >= USUAL_WAIT)
    return replace(frame, place=_stop_meant(builder, frame.place)) if frame.longer else frame


def _wait_beside(builder: PolicyBuilder, item: SceneObject, frame: F.Wait, name: str, lasting: str, near: str) -> None:
    """Wait at what is meant of an object, where the path is led to."""
    place, words = aimed(builder, item.name, frame.aim)
    plan = f"Bend the path to {words} and wait {lasting} there."
    promises = f"expect_visits({place}, within={builder.tolerance})", f"expect_stop(near={near})"
    builder.add(f"traj = hover(traj, {place}, height=0.0, steps={name})", plan, *promises)


def stop_by(builder: PolicyBuilder, item: SceneObject, *, roughly: bool = False) -> str:
    """The index of a waypoint at which the path stands still about where it is nearest to an object; "" for none.

    A stop to which another object is nearer is one at that. Roughly, it is the object's own wherever that is near it.
    """
    rows = builder.rows()
    away, still = item.cuboid.signed(rows[:, :3])[0], _stops(rows)
    if not still:
        return ""
    nearest = min(still, key=lambda i: float(away[i]))
    own = away[nearest] <= _nearest_thing(builder, rows[[nearest], :3]) + 1e-9
    about = away.min() + (max(ABOUT, 1.5 * spacing(rows[:, :3])) if own else 0.5 * spacing(rows[:, :3]))
    if roughly and own:
        about = max(about, ITS_OWN * builder.scale.near(rows[:, :3], item))
    return str(nearest) if away[nearest] <= about else ""


def _nearest_thing(builder: PolicyBuilder, place: Array) -> float:
    """The distance of a place (1, 3) [m] from the surface of the nearest object [m]."""
    return min(float(item.cuboid.signed(place)[0][0]) for item in builder.scene)


ABOUT = 0.05
"""How much farther off than the nearest waypoint a stop may be to be the one that is meant, at least [m]."""


def _stops(rows: Array) -> list[int]:
    """The first waypoint of each stop before the goal at which the path stands still for a while."""
    found = {stands(rows, int(i)) for i in np.flatnonzero(rows[:-1, 3] <= 0.0)}
    return sorted(first for first, last in found if first < last)


def _stop_meant(builder: PolicyBuilder, place: F.Place) -> F.Place:
    """Where it is to stand still for longer: the stop there, or the only one; the place itself where it has none."""
    rows = builder.rows()
    still, item = _stops(rows), builder.item(place)
    if place in ("", "goal"):
        at = still[0] if len(still) == 1 else -1
    elif place == "middle":
        s = arc_length(rows[:, :3])
        at = min(still, key=lambda i: abs(float(s[i] / s[-1]) - 0.5), default=-1)
        at = at if at >= 0 and abs(float(s[at] / s[-1]) - 0.5) <= MIDDLE else -1
    else:
        at = int(stop_by(builder, item, roughly=True) or -1) if item is not None else -1
    if at < 0:
        return place or "goal"
    return F.Quantity(float(at + 1), "waypoints", "at")


USUAL_WAIT = 10
"""Timesteps that a wait lasts if nothing is said."""

MIDDLE = 0.2
"""How far from the middle a stop "in the middle" may be, as a share of the path's length."""


def _as_long_again(builder: PolicyBuilder, stood: int) -> F.Quantity | None:
    """How much longer "longer" is: as long as it waits there already."""
    if not stood:
        return None
    builder.assume(f"longer is twice the {stood * builder.trajectory.timestep:g} s that it waits there")
    return F.Quantity(stood, "step")


def _stands_for(builder: PolicyBuilder, frame: F.Wait) -> int:
    """For how many timesteps the path stands still already where a wait is asked for."""
    item, rows = builder.item(frame.place), builder.rows()
    at = {"start": 0, "goal": len(rows) - 1, "": len(rows) - 1}.get(str(frame.place), -1)
    if item is not None:
        at = int(stop_by(builder, item) or np.argmin(item.distance(rows[:, :3])))
    elif isinstance(frame.place, F.Quantity) and frame.place.unit == "waypoints":
        at = int(frame.place.value) - 1
    first, last = stands(rows, at) if at >= 0 else (0, 0)
    return last - first


def nonstop(builder: PolicyBuilder, frame: F.NoStop) -> None:
    """No stop between the ends, or on a part of the path; nothing changes where there is none."""
    own = _own_stops(builder, frame.part)
    frame = replace(frame, part=own or _with_its_stop(builder, frame.part))
    where, part = builder.part(frame.part)
    mask = builder.waypoints(frame.part).copy()
    mask[[0, -1]] = False
    moves = bool((builder.trajectory.speeds[mask] > 0).all())
    call = "traj" if moves else f"keep_moving(traj{argument(where)})"
    promise = f"expect_no_stop({f'where={where}' if where else ''})"
    builder.add(f"traj = {call}", f"Make no stop{part}.", promise, holds=moves)


def _own_stops(builder: PolicyBuilder, part: PathPart) -> PathPart | None:
    """The stops near an object to which no other object is nearer, where another's stop is near it, too."""
    if part.kind != "near" or part.amount is not None or part.places[0] in F.SPOTS:
        return None
    path, rows = builder.trajectory.positions, builder.trajectory.to_array()
    item = builder.scene[part.places[0]]
    reach = ITS_OWN * builder.scale.near(path, item)
    near = [a for a in _stops(rows) if item.core(path).depth(path[[a]])[0] <= reach]
    away = np.array([one.cuboid.signed(path[near])[0] for one in (item, *builder.scene)])
    own = [a for a, is_nearest in zip(near, away[0] <= away.min(axis=0) + 1e-9, strict=True) if is_nearest]
    if not own or len(own) == len(near):
        return None
    return PathPart("indices", ranges=tuple(stands(rows, a) for a in own), count=len(path))


def _with_its_stop(builder: PolicyBuilder, part: PathPart) -> PathPart:
    """What is near an object, as far as the stop that is nearest to it, where that is not much farther than near."""
    rests = builder.trajectory.speeds[1:-1] <= 0.0
    if part.kind != "near" or part.amount is not None or part.places[0] in F.SPOTS or not rests.any():
        return part
    item, path = builder.scene[part.places[0]], builder.trajectory.positions
    reach, to_stop = builder.scale.near(path, item), float(item.core(path).depth(path[1:-1][rests]).min())
    if not reach < to_stop <= ITS_OWN * reach:
        return part
    builder.assume(f"the stop near {item.name} is the one that is {to_stop:.3g} m from its centre")
    return replace(part, amount=nice(to_stop))


ITS_OWN = 2.5
"""How much farther off than near an object a stop may be that is said to be near it."""

PACE_STEPS: Mapping[type[F.SemanticFrame], Callable[..., None]] = {
    F.Pace: pace, F.StopAt: stop, F.Wait: wait, F.NoStop: nonstop,
}  # fmt: skip
