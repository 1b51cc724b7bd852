"""Steps that change how fast the robot moves."""

from __future__ import annotations

from ovita.instruct.draft import Draft, argument, mask, suffix
from ovita.instruct.intents import Intent
from ovita.instruct.scale import FASTER, SLOWER


def speed(d: Draft, intent: Intent) -> None:
    """A change of speed, or a speed law."""
    where, part = mask(d, intent.region)
    where = d.part(where)
    speeds = d.request.trajectory.speeds
    mean = float(speeds[speeds > 0].mean()) if (speeds > 0).any() else 0.0
    arguments = f"where={where}" if where else ""
    if intent.mode in ("slower", "faster", "factor"):
        factor = intent.amount
        if factor is None:
            factor = (SLOWER if intent.mode == "slower" else FASTER)[intent.degree]
            d.assume(f'"{intent.mode}" is {factor:g} times the speed')
        knob = d.knob("slowdown" if factor < 1 else "speedup", factor, "factor on the speed")
        d.body.append(f"traj = scale_speed(traj, {knob}{argument(where)})")
        d.expectations.append(f"expect_{'slower' if factor < 1 else 'faster'}({arguments})")
        d.plan.append(f"Multiply the speed by {factor:g}{suffix(part)}.")
    elif intent.mode == "add":
        amount = intent.amount or 0.0
        knob = d.knob("speed_change", amount, "[m/s] added to the speed")
        d.body.append(f"traj = shift_speed(traj, {knob}{argument(where)})")
        d.expectations.append(f"expect_{'slower' if amount < 0 else 'faster'}({arguments})")
        d.plan.append(f"{'Lower' if amount < 0 else 'Raise'} the speed by {abs(amount):g} m/s{suffix(part)}.")
    elif intent.mode in ("set", "constant"):
        value = intent.amount
        if value is None:
            value = float(f"{mean:.3g}")
            d.assume(f"the constant speed is the mean of the original, {value:g} m/s")
        knob = d.knob("speed", value, "[m/s]")
        d.body.append(f"traj = set_speed(traj, {knob}{argument(where)})")
        d.expectations.append(f"expect_speed({knob}{argument(where)})")
        d.plan.append(f"Set the speed to {value:g} m/s{suffix(part)}.")
    elif intent.mode in ("cap", "floor"):
        value = intent.amount or 0.0
        name = d.knob("limit", value, f"[m/s] {'highest' if intent.mode == 'cap' else 'lowest'} speed")
        beyond = f"traj[:, 3] {'>' if intent.mode == 'cap' else '<'} {name}"
        chosen = f"({where}) & ({beyond})" if where else beyond
        d.body.append(f"traj = set_speed(traj, {name}, where={chosen})")
        d.plan.append(f"Keep the speed at {'most' if intent.mode == 'cap' else 'least'} {value:g} m/s{suffix(part)}.")
    elif intent.mode.startswith("ramp"):
        _ramp(d, intent, where, part, mean)
    else:
        _law(d, intent, where, part, mean)


def _ramp(d: Draft, intent: Intent, where: str, part: str, mean: float) -> None:
    """A speed that changes steadily along the path or a part of it."""
    speeds = d.request.trajectory.speeds
    if intent.mode == "ramp_from":
        a = d.knob("start_speed", 0.0, "[m/s] where the change begins")
        d.body.append(f"traj = ramp_speed(traj, {a}, None{argument(where)})")
        d.plan.append(f"Begin at rest and speed up steadily{suffix(part)}.")
        return
    at_end = intent.region.kind == "last"
    at = {"last": 1.0 - (intent.region.amount or 0.25), "middle": 0.33}.get(intent.region.kind, 0.0)
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
    a = d.knob("start_speed", begin, "[m/s] where the change begins")
    b = d.knob("end_speed", end, "[m/s] where the change ends")
    if intent.amount is None:
        d.assume(f"the speed changes steadily from {begin:g} to {end:g} m/s")
    d.body.append(f"traj = ramp_speed(traj, {a}, {b}{argument(where)})")
    d.plan.append(f"Change the speed steadily from {begin:g} to {end:g} m/s{suffix(part)}.")


def _law(d: Draft, intent: Intent, where: str, part: str, mean: float) -> None:
    """A speed law by name: slow in turns, trapezoidal, exponential, constant acceleration."""
    law, _, falling = intent.mode.partition("_")
    if law == "turns":
        factor = intent.amount if intent.amount is not None else SLOWER[intent.degree]
        name = d.knob("slowdown", factor, "factor on the speed in turns")
        d.body.append(f"traj = slow_turns(traj, {name})")
        d.plan.append(f"Slow down before and in turns, to {factor:g} times the speed.")
    elif law == "trapezoid":
        cruise = intent.amount if intent.amount is not None else float(f"{mean:.3g}")
        name = d.knob("cruise", cruise, "[m/s] speed between the ramps")
        d.body.append(f"traj = trapezoid_speed(traj, {name})")
        d.plan.append(f"Speed up to {cruise:g} m/s, keep it, and slow down again (a trapezoid).")
    elif law == "acceleration":
        rate = intent.amount
        if rate is None:
            rate = float(f"{mean**2 / max(2 * d.request.trajectory.length, 1e-9):.2g}")
            d.assume(f"the acceleration is {rate:g} m/s^2")
        rate = -abs(rate) if falling else rate
        name = d.knob("acceleration", rate, "[m/s^2]")
        d.body.append(f"traj = accelerate(traj, {name}{argument(where)})")
        d.plan.append(f"Accelerate at a constant {rate:g} m/s^2{suffix(part)}.")
    else:
        low, high = float(f"{0.25 * mean:.3g}"), float(f"{1.5 * mean:.3g}")
        begin, end = (high, low) if falling else (low, high)
        a = d.knob("start_speed", begin, "[m/s] where the change begins")
        b = d.knob("end_speed", end, "[m/s] where the change ends")
        d.assume(f"the speed changes exponentially from {begin:g} to {end:g} m/s")
        d.body.append(f"traj = exponential_speed(traj, {a}, {b}{argument(where)})")
        d.plan.append(f"Change the speed exponentially from {begin:g} to {end:g} m/s{suffix(part)}.")
