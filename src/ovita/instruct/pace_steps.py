"""Steps that change the speed, or make the robot stop or wait."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import cast

import numpy as np

from ovita.instruct import frames as F
from ovita.instruct.builder import PolicyBuilder, aiming, argument, short
from ovita.instruct.lexicon import FASTER, SLOWER
from ovita.instruct.object_steps import surface_distance
from ovita.instruct.path_steps import aimed_at, degree, spot, steps, tolerance
from ovita.paths.scene import SceneObject
from ovita.policy.source import Role
from ovita.toolkit.speed import slow_turns

STANDSTILL = "A speed of 0 would never arrive: how slow should it be, or where should it stop, and for how long?"


class _Speed:
    """What a change of speed is about: its part of the path and the speeds there."""

    def __init__(self, builder: PolicyBuilder, frame: F.Pace) -> None:
        self.builder, self.frame, self.q = builder, frame, frame.amount
        self.where, self.part = builder.part(frame.part)
        self.argument = argument(self.where)
        self.all = speeds = builder.trajectory.speeds
        chosen = speeds[builder.waypoints(frame.part)] if self.where else speeds
        self.chosen = chosen if len(chosen) else speeds
        self.mean = float(speeds[speeds > 0].mean()) if (speeds > 0).any() else 0.0

    def add(self, call: str, plan: str, *promises: str, holds: bool = False) -> None:
        self.builder.add(f"traj = {call}", f"{plan}{self.part}.", *promises, holds=holds)

    def promise(self, word: str) -> str:
        """The postcondition that the robot is slower or faster there."""
        return f"expect_{word}({self.argument.removeprefix(', ')})"

    def against(self, slower: bool, faster: bool) -> bool:
        """Whether it is to be slower and this makes it no slower, or faster and this makes it no faster."""
        return {"slower": slower, "faster": faster}.get(self.frame.change, False)

    def value(self, whole: float) -> float:
        """The amount as a speed [m/s]; shares and multiples are of a speed."""
        q = self.q
        if q is None:
            self.builder.ask("How fast should it be?")
            return whole
        if q.unit not in ("m/s", "", "x", "%"):
            self.builder.ask(f"How fast is {q.said or q.value}, in m/s?")
        return q.value * (whole if q.unit in ("x", "%") else 1.0)


def pace(builder: PolicyBuilder, frame: F.Pace) -> None:
    """Change the speed: by a factor, an amount, to a value, within a bound, or along a law."""
    s = _Speed(builder, frame)
    if frame.change in ("faster", "slower", "set"):
        _change(s)
    else:
        _LAWS[frame.change](s)


def _change(s: _Speed) -> None:
    change, q, factor = s.frame.change, s.q, s.frame.factor
    if factor is None and q is None:
        if change == "set":
            s.builder.ask("How fast should it be?")
        factor = (SLOWER if change == "slower" else FASTER)[degree(s.frame)]
        s.builder.assume(f'"{change}" is {factor:g} times the speed')
    if factor is not None:
        _scale(s, factor)
    elif q is not None and q.role in ("by", "of") and change != "set":
        _shift(s, s.value(s.mean) * (-1.0 if change == "slower" else 1.0))
    else:
        _set(s, s.value(s.mean))


def _scale(s: _Speed, factor: float) -> None:
    if factor <= 0:
        s.builder.ask(STANDSTILL)
    if s.mean == 0:
        s.builder.ask("The speed is 0 everywhere: how fast should it be, in m/s?")
    if s.against(factor >= 1, factor <= 1):
        s.builder.ask(f"{factor:g} times the speed is not {s.frame.change}: which is meant?")
    name, word = ("slowdown", "slower") if factor < 1 else ("speedup", "faster")
    factor = short(factor)
    knob = s.builder.knob(name, factor, "factor", "factor on the speed", "amount", unit="", direction=word)
    promise = s.promise(word) if factor != 1 else ""
    s.add(f"scale_speed(traj, {knob}{s.argument})", f"Multiply the speed by {factor:g}", promise)


def _shift(s: _Speed, amount: float) -> None:
    if s.chosen.size and float(s.chosen.max()) + amount <= 0:
        most = s.chosen.max()
        s.builder.ask(f"The speed is at most {most:.3g} m/s, so {-amount:g} m/s less is a standstill: how slow?")
    verb, word = ("Lower", "slower") if amount < 0 else ("Raise", "faster")
    knob = s.builder.knob("speed_change", amount, "by", "added to the speed", "amount", unit="m/s", direction="faster")
    plan = f"{verb} the speed by {abs(amount):g} m/s"
    s.add(f"shift_speed(traj, {knob}{s.argument})", plan, s.promise(word))


def _set(s: _Speed, value: float) -> None:
    if value <= 0 and s.mean > 0:
        s.builder.ask(STANDSTILL)
    now = float(s.chosen.mean())
    if s.against(value > now, value < now):
        s.builder.assume(f"{value:g} m/s is not {s.frame.change} than the {now:.3g} m/s there now")
    knob = s.builder.knob("speed", value, "to", "", "amount", unit="m/s", direction="faster")
    promise = f"expect_speed({knob}{s.argument})"
    s.add(f"set_speed(traj, {knob}{s.argument})", f"Set the speed to {value:g} m/s", promise)


def _constant(s: _Speed) -> None:
    if s.q is None:
        moving = s.chosen[s.chosen > 0]
        value = float(f"{moving.mean() if len(moving) else s.mean:.3g}")
        s.builder.assume(f"the constant speed is the mean of the original, {value:g} m/s")
    else:
        value = s.value(s.mean)
    _set(s, value)


def _bound(s: _Speed) -> None:
    if s.frame.change == "cap":
        key, which, sign, whole = "at_most", "highest", 1.0, float(s.chosen.max())
    else:
        key, which, sign, whole = "at_least", "lowest", -1.0, s.mean
    value = short(s.value(whole))
    if value <= 0 and s.frame.change == "cap":
        s.builder.ask(STANDSTILL)
    holds = bool((sign * s.chosen[s.chosen > 0] <= sign * value).all())
    name = s.builder.knob("limit", value, cast(Role, key), f"{which} speed", "amount", unit="m/s")
    plan, promise = f"Keep the speed {key.replace('_', ' ')} {value:g} m/s", f"expect_speed({key}={name}{s.argument})"
    s.add(f"bound_speed(traj, {key}={name}{s.argument})", plan, promise, holds=holds)


def _ramp(s: _Speed) -> None:
    """A speed that changes steadily along the path or a part of it."""
    index = np.flatnonzero(s.builder.waypoints(s.frame.part)) if s.where else np.arange(len(s.all))
    first = float(s.all[index[0]]) if len(index) else s.mean
    begin, end = _rising(s, first) if s.frame.change == "rampup" else _falling(s, first)
    begin, end = float(f"{begin:.3g}"), float(f"{end:.3g}")
    a = s.builder.knob("start_speed", begin, "to", "where the change begins", "begin", unit="m/s")
    b = s.builder.knob("end_speed", end, "to", "where the change ends", "amount", unit="m/s")
    s.builder.assume(f"the speed changes steadily from {begin:g} to {end:g} m/s")
    stops = end == 0.0 and len(index) and index[-1] == len(s.all) - 1
    promises = ["expect_stop()"] if stops else []
    if not s.where:
        promises.append(f"expect_speed({a}, first(traj, 1))")
        promises += [f"expect_speed({b}, last(traj, 1))"] if end else []
    plan = f"Change the speed steadily from {begin:g} to {end:g} m/s"
    s.add(f"ramp_speed(traj, {a}, {b}{s.argument})", plan, *promises)


def _rising(s: _Speed, first: float) -> tuple[float, float]:
    """From where and to where the speed rises [m/s], given the speed where it begins."""
    begin = min(first, 0.5 * s.mean)
    end = 1.5 * float(s.all.max()) if s.q is None else s.value(s.mean)
    return min(begin, 0.5 * end), end


def _falling(s: _Speed, first: float) -> tuple[float, float]:
    """From where and to where the speed falls [m/s]; at the goal to a standstill where nothing else is said."""
    begin = first if first > 0.2 * s.mean else s.mean
    if s.q is None:
        at_goal = s.frame.part.kind in ("last", "after") or not s.where
        end = 0.0 if at_goal else 0.25 * s.mean
        if s.where and begin + end > 1.5 * float(s.chosen.mean()):
            begin = 0.5 * begin  # it falls there already; a lower speed must be clearly lower
    else:
        end = s.value(s.mean)
    return (max(begin, 2 * end) if begin <= end else begin), end


def _turns(s: _Speed) -> None:
    q, rows = s.q, s.builder.rows()
    factor = SLOWER[degree(s.frame)] if q is None else q.value
    if q is not None and (q.unit, q.role) == ("%", "by"):
        factor = 1.0 - factor

    def slows(factor: float, angle: int) -> bool:
        return bool((slow_turns(rows, factor, angle=angle) != rows).any())

    name = s.builder.knob(
        "slowdown", factor, "factor", "factor on the speed in turns", "amount", unit="", direction="slower"
    )
    angle = next((a for a in ANGLES if slows(0.5, a)), ANGLES[0])
    call = f"slow_turns(traj, {name}{'' if angle == ANGLES[0] else f', angle={angle}'})"
    if s.where:
        s.builder.before("given = traj")
        call = f"keep_unchanged({call}, given, ~{s.where})"
    plan = f"Slow down before and in turns, to {factor:g} times the speed"
    slower = factor < 1 and slows(factor, angle)
    s.add(call, plan, "" if s.builder.moving else "expect_same_path()", "expect_slower()" if slower else "")


ANGLES = (30, 20, 10, 5, 2)
"""How sharp a turn is at least [degrees]: the first of these that the path has."""


def _accelerate(s: _Speed) -> None:
    if s.q is None:
        rate = float(f"{s.mean**2 / max(2 * s.builder.trajectory.length, 1e-9):.2g}")
        s.builder.assume(f"the acceleration is {rate:g} m/s^2")
    else:
        rate = s.q.value
        if s.q.unit not in ("m/s2", ""):
            s.builder.ask(f"How much is {s.q.said or s.q.value}, in m/s^2?")
    name = s.builder.knob("acceleration", rate, "to", "", "amount", unit="m/s^2", direction="faster")
    plan = f"{'Accelerate' if rate > 0 else 'Brake'} at a constant {abs(rate):g} m/s^2"
    same = "" if s.builder.moving else "expect_same_path()"
    s.add(f"accelerate(traj, {name}{s.argument})", plan, f"expect_acceleration({name}{s.argument})", same)


_LAWS: Mapping[str, Callable[[_Speed], None]] = {
    "cap": _bound, "floor": _bound, "constant": _constant, "rampup": _ramp, "rampdown": _ramp, "turns": _turns,
    "accelerate": _accelerate,
}  # fmt: skip


def stop(builder: PolicyBuilder, frame: F.StopAt) -> None:
    """Come to rest at a place; the trajectory ends there."""
    at, words = spot(builder, frame.place)
    item = builder.item(frame.place)
    builder.assume("to stop means to end there; say 'wait' to go on afterwards")
    if item is None:
        _end_at(builder, f"stop_at(traj, {at})", words, "expect_stop()")
    elif frame.by is not None:
        _stop_short(builder, item, frame.by)
    elif frame.aim:
        place, words = at + aiming(frame.aim), aimed_at(builder, item.name, frame.aim, item)
        builder.goal_moved = True
        plan = f"Slow down and stop at {words}; the path ends there."
        goal = {"goal": f"expect_goal({place})"}
        builder.add(f"traj = move_goal(stop_at(traj, {at}), {place})", plan, "expect_stop()", ends=goal)
    else:
        _end_at(builder, f"stop_at(traj, {at})", words, f"expect_stop(near={at})")


def _end_at(builder: PolicyBuilder, call: str, words: str, promise: str) -> None:
    builder.add(f"traj = {call}", f"Slow down and stop {words}; the trajectory ends there.", promise)


def _stop_short(builder: PolicyBuilder, item: SceneObject, q: F.Quantity) -> None:
    """Come to rest so far from an object's surface, where the path first comes so near."""
    by = builder.metres(q, 1.0, f"before {item.name}")
    first = surface_distance(item, builder.positions[:2])
    if first <= by:
        builder.ask(f"The path starts {first:.3g} m from {item.name}: how far before it should it stop?")
    ref, meaning = builder.ref(item), f"distance at which to stop before {item.name}"
    name = builder.knob("short", by, "at", meaning, "by", about=item.name, direction="away")
    builder.goal_moved = True
    plan = f"Slow down and stop {by:g} m before {item.name}; the path ends there."
    promise = f"expect_distance({ref}, nearest={name})"
    builder.add(f"traj = stop_before(traj, {ref}, {name})", plan, promise, "expect_stop()")


def wait(builder: PolicyBuilder, frame: F.Wait) -> None:
    """Stand still at a place, then go on."""
    place = frame.place
    if not place and frame.part.kind in ("near", "after") and isinstance(frame.part.places[0], str):
        place = frame.part.places[0]
    at, words = spot(builder, place)
    name, item = steps(builder, frame.duration), builder.item(place)
    timesteps = f"{builder.parameters[name].value} timesteps"
    if item is not None and frame.aim:
        aim, words = aiming(frame.aim), aimed_at(builder, item.name, frame.aim, item)
        builder.add(
            f"traj = hover(traj, {at}, 0.0{aim}, steps={name})",
            f"Bend the path to {words} and wait {timesteps} there.",
            f"expect_visits({at}, within={tolerance(builder)}{aim})",
            f"expect_stop(near={at})",
        )
        return
    promise = f"expect_stop(near={at})" if item is not None else "expect_stop()" if place in ("", "goal") else ""
    builder.add(f"traj = dwell(traj, {at}, steps={name})", f"Wait {timesteps} {words}.", promise)


PACE_STEPS: Mapping[type[F.SemanticFrame], Callable[..., None]] = {F.Pace: pace, F.StopAt: stop, F.Wait: wait}
