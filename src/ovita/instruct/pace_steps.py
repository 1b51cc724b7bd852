"""Steps that change the speed, or make the robot stop or wait."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ovita.instruct import frames as F
from ovita.instruct.builder import PolicyBuilder, aiming, argument
from ovita.instruct.lexicon import FASTER, SLOWER
from ovita.instruct.object_steps import surface_distance
from ovita.instruct.path_steps import aimed_at, degree, spot, steps, tolerance
from ovita.paths.scene import SceneObject
from ovita.toolkit.speed import slow_turns

STANDSTILL = "A speed of 0 would never arrive: how slow should it be, or where should it stop, and for how long?"


class _Speed:
    """What a change of speed is about: its part of the path and the speeds there."""

    def __init__(self, d: PolicyBuilder, frame: F.Pace) -> None:
        self.d, self.frame, self.q = d, frame, frame.amount
        self.where, self.part = d.part(frame.part)
        self.argument = argument(self.where)
        speeds = d.trajectory.speeds
        self.all = speeds
        self.chosen = speeds[d.waypoints(frame.part)] if self.where else speeds
        self.chosen = self.chosen if len(self.chosen) else speeds
        self.mean = float(speeds[speeds > 0].mean()) if (speeds > 0).any() else 0.0

    def add(self, call: str, plan: str, *promises: str, holds: bool = False) -> None:
        self.d.add(f"traj = {call}", f"{plan}{self.part}.", *promises, holds=holds)

    def value(self, whole: float) -> float:
        """The amount as a speed [m/s]; shares and multiples are of a speed."""
        q = self.q
        if q is None:
            self.d.ask("How fast should it be?")
            return whole
        if q.unit not in ("m/s", "", "x", "%"):
            self.d.ask(f"How fast is {q.said or q.value}, in m/s?")
        return q.value * (whole if q.unit in ("x", "%") else 1.0)


def pace(d: PolicyBuilder, frame: F.Pace) -> None:
    """Change the speed: by a factor, an amount, to a value, within a bound, or along a law."""
    s = _Speed(d, frame)
    if frame.change in ("faster", "slower", "set"):
        _change(s)
    else:
        _LAWS[frame.change](s)


def _change(s: _Speed) -> None:
    change, q, factor = s.frame.change, s.q, s.frame.factor
    if factor is None and q is None:
        if change == "set":
            s.d.ask("How fast should it be?")
        factor = (SLOWER if change == "slower" else FASTER)[degree(s.frame)]
        s.d.assume(f'"{change}" is {factor:g} times the speed')
    if factor is not None:
        _scale(s, factor)
    elif q is not None and q.role in ("by", "of") and change != "set":
        _shift(s, s.value(s.mean) * (-1.0 if change == "slower" else 1.0))
    else:
        _set(s, s.value(s.mean))


def _scale(s: _Speed, factor: float) -> None:
    if factor <= 0:
        s.d.ask(STANDSTILL)
    if s.mean == 0:
        s.d.ask("The speed is 0 everywhere: how fast should it be, in m/s?")
    if (s.frame.change == "slower" and factor >= 1) or (s.frame.change == "faster" and factor <= 1):
        s.d.ask(f"{factor:g} times the speed is not {s.frame.change}: which is meant?")
    name, word = ("slowdown", "slower") if factor < 1 else ("speedup", "faster")
    factor = float(f"{factor:.6g}")
    knob = s.d.knob(name, factor, "factor", "factor on the speed", "amount", unit="", direction=word)
    promise = f"expect_{word}({s.argument.removeprefix(', ')})" if factor != 1 else ""
    s.add(f"scale_speed(traj, {knob}{s.argument})", f"Multiply the speed by {factor:g}", promise)


def _shift(s: _Speed, amount: float) -> None:
    if s.chosen.size and float(s.chosen.max()) + amount <= 0:
        most = s.chosen.max()
        s.d.ask(f"The speed is at most {most:.3g} m/s, so {-amount:g} m/s less is a standstill: how slow?")
    word = "slower" if amount < 0 else "faster"
    knob = s.d.knob("speed_change", amount, "by", "added to the speed", "amount", unit="m/s", direction="faster")
    s.add(f"shift_speed(traj, {knob}{s.argument})",
          f"{'Lower' if amount < 0 else 'Raise'} the speed by {abs(amount):g} m/s",
          f"expect_{word}({s.argument.removeprefix(', ')})")  # fmt: skip


def _set(s: _Speed, value: float) -> None:
    if value <= 0 and s.mean > 0:
        s.d.ask(STANDSTILL)
    now = float(s.chosen.mean())
    if (s.frame.change == "slower" and value > now) or (s.frame.change == "faster" and value < now):
        s.d.assume(f"{value:g} m/s is not {s.frame.change} than the {now:.3g} m/s there now")
    knob = s.d.knob("speed", value, "to", "", "amount", unit="m/s", direction="faster")
    s.add(f"set_speed(traj, {knob}{s.argument})", f"Set the speed to {value:g} m/s",
          f"expect_speed({knob}{s.argument})")  # fmt: skip


def _constant(s: _Speed) -> None:
    if s.q is None:
        moving = s.chosen[s.chosen > 0]
        value = float(f"{moving.mean() if len(moving) else s.mean:.3g}")
        s.d.assume(f"the constant speed is the mean of the original, {value:g} m/s")
    else:
        value = s.value(s.mean)
    _set(s, value)


def _bound(s: _Speed) -> None:
    cap = s.frame.change == "cap"
    value = float(f"{s.value(float(s.chosen.max()) if cap else s.mean):.6g}")
    if value <= 0 and cap:
        s.d.ask(STANDSTILL)
    key, which = ("at_most", "highest") if cap else ("at_least", "lowest")
    moving = s.chosen[s.chosen > 0]
    holds = bool((moving <= value).all() if cap else (moving >= value).all())
    name = s.d.knob("limit", value, "at_most" if cap else "at_least", f"{which} speed", "amount", unit="m/s")
    s.add(f"bound_speed(traj, {key}={name}{s.argument})", f"Keep the speed {key.replace('_', ' ')} {value:g} m/s",
          f"expect_speed({key}={name}{s.argument})", holds=holds)  # fmt: skip


def _ramp(s: _Speed) -> None:
    """A speed that changes steadily along the path or a part of it."""
    rising, at_goal = s.frame.change == "rampup", s.frame.part.kind in ("last", "after") or not s.where
    index = np.flatnonzero(s.d.waypoints(s.frame.part)) if s.where else np.arange(len(s.all))
    first = float(s.all[index[0]]) if len(index) else s.mean
    if rising:
        begin = min(first, 0.5 * s.mean)
        end = 1.5 * float(s.all.max()) if s.q is None else s.value(s.mean)
        begin = min(begin, 0.5 * end)
    else:
        begin = first if first > 0.2 * s.mean else s.mean
        end = (0.0 if at_goal else 0.25 * s.mean) if s.q is None else s.value(s.mean)
        now = float(s.chosen.mean())
        if s.q is None and s.where and begin + end > 1.5 * now:
            begin = 0.5 * begin  # it falls there already; a lower speed must be clearly lower
        begin = max(begin, 2 * end) if begin <= end else begin
    begin, end = float(f"{begin:.3g}"), float(f"{end:.3g}")
    a = s.d.knob("start_speed", begin, "to", "where the change begins", "begin", unit="m/s")
    b = s.d.knob("end_speed", end, "to", "where the change ends", "amount", unit="m/s")
    s.d.assume(f"the speed changes steadily from {begin:g} to {end:g} m/s")
    at_end = len(index) and index[-1] == len(s.all) - 1
    s.add(f"ramp_speed(traj, {a}, {b}{s.argument})", f"Change the speed steadily from {begin:g} to {end:g} m/s",
          "expect_stop()" if end == 0.0 and at_end else "",
          "" if s.where else f"expect_speed({a}, first(traj, 1))",
          "" if s.where or end == 0.0 else f"expect_speed({b}, last(traj, 1))")  # fmt: skip


def _turns(s: _Speed) -> None:
    factor = s.frame.amount.value if s.frame.amount is not None else SLOWER[degree(s.frame)]
    if s.frame.amount is not None and s.frame.amount.unit == "%" and s.frame.amount.role == "by":
        factor = 1.0 - factor
    name = s.d.knob("slowdown", factor, "factor", "factor on the speed in turns", "amount", unit="", direction="slower")
    angle = next((a for a in (30, 20, 10, 5, 2) if (slow_turns(s.d.rows(), 0.5, angle=a) != s.d.rows()).any()), 30)
    call = f"slow_turns(traj, {name}{'' if angle == 30 else f', angle={angle}'})"
    if s.where:
        s.d.before("given = traj")
        call = f"keep_unchanged({call}, given, ~{s.where})"
    s.add(
        call,
        f"Slow down before and in turns, to {factor:g} times the speed",
        "" if s.d.moving else "expect_same_path()",
        "expect_slower()" if factor < 1 and (slow_turns(s.d.rows(), factor, angle=angle) != s.d.rows()).any() else "",
    )


def _accelerate(s: _Speed) -> None:
    rate = s.q.value if s.q is not None else 0.0
    if s.q is None:
        rate = float(f"{s.mean**2 / max(2 * s.d.trajectory.length, 1e-9):.2g}")
        s.d.assume(f"the acceleration is {rate:g} m/s^2")
    elif s.q.unit not in ("m/s2", ""):
        s.d.ask(f"How much is {s.q.said or s.q.value}, in m/s^2?")
    name = s.d.knob("acceleration", rate, "to", "", "amount", unit="m/s^2", direction="faster")
    word = "Accelerate" if rate > 0 else "Brake"
    s.add(f"accelerate(traj, {name}{s.argument})", f"{word} at a constant {abs(rate):g} m/s^2",
          f"expect_acceleration({name}{s.argument})", "" if s.d.moving else "expect_same_path()")  # fmt: skip


_LAWS: Mapping[str, Callable[[_Speed], None]] = {
    "cap": _bound, "floor": _bound, "constant": _constant, "rampup": _ramp, "rampdown": _ramp, "turns": _turns,
    "accelerate": _accelerate,
}  # fmt: skip


def stop(d: PolicyBuilder, frame: F.StopAt) -> None:
    """Come to rest at a place; the trajectory ends there."""
    at, words = spot(d, frame.place)
    item = isinstance(frame.place, str) and frame.place not in ("", *F.SPOTS)
    d.assume("to stop means to end there; say 'wait' to go on afterwards")
    if item and frame.by is not None:
        _stop_short(d, d.scene[str(frame.place)], frame.by)
        return
    if item and frame.aim:
        thing = d.scene[str(frame.place)]
        place, words = at + aiming(frame.aim), aimed_at(d, thing.name, frame.aim, thing)
        d.goal_moved = True
        d.add(f"traj = move_goal(stop_at(traj, {at}), {place})", f"Slow down and stop at {words}; the path ends there.",
              "expect_stop()", ends={"goal": f"expect_goal({place})"})  # fmt: skip
        return
    d.add(f"traj = stop_at(traj, {at})", f"Slow down and stop {words}; the trajectory ends there.",
          f"expect_stop(near={at})" if item else "expect_stop()")  # fmt: skip


def _stop_short(d: PolicyBuilder, thing: SceneObject, q: F.Quantity) -> None:
    """Come to rest so far from an object's surface, where the path first comes so near."""
    by = d.metres(q, 1.0, f"before {thing.name}")
    first = surface_distance(thing, d.positions[:2])
    if first <= by:
        d.ask(f"The path starts {first:.3g} m from {thing.name}: how far before it should it stop?")
    ref = d.ref(thing)
    name = d.knob("short", by, "at", f"distance at which to stop before {thing.name}", "by", about=thing.name,
                  direction="away")  # fmt: skip
    d.goal_moved = True
    d.add(f"traj = stop_before(traj, {ref}, {name})",
          f"Slow down and stop {by:g} m before {thing.name}; the path ends there.",
          f"expect_distance({ref}, nearest={name})", "expect_stop()")  # fmt: skip


def wait(d: PolicyBuilder, frame: F.Wait) -> None:
    """Stand still at a place, then go on."""
    place = frame.place
    if not place and frame.part.kind in ("near", "after") and isinstance(frame.part.places[0], str):
        place = frame.part.places[0]
    at, words = spot(d, place)
    name = steps(d, frame.duration)
    item = isinstance(place, str) and place not in ("", *F.SPOTS)
    if item and frame.aim:
        thing = d.scene[str(place)]
        aim, words = aiming(frame.aim), aimed_at(d, thing.name, frame.aim, thing)
        d.add(f"traj = hover(traj, {at}, 0.0{aim}, steps={name})",
              f"Bend the path to {words} and wait {d.parameters[name].value} timesteps there.",
              f"expect_visits({at}, within={tolerance(d)}{aim})", f"expect_stop(near={at})")  # fmt: skip
        return
    d.add(f"traj = dwell(traj, {at}, steps={name})", f"Wait {d.parameters[name].value} timesteps {words}.",
          f"expect_stop(near={at})" if item else "expect_stop()" if place in ("", "goal") else "")  # fmt: skip


PACE_STEPS: Mapping[type[F.SemanticFrame], Callable[..., None]] = {F.Pace: pace, F.StopAt: stop, F.Wait: wait}
