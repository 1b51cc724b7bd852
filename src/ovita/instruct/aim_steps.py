"""Steps that bring an end or a waypoint to, toward or away from an object, and the way back to the start."""

from __future__ import annotations

import numpy as np

from ovita.instruct.draft import Draft, mask, suffix
from ovita.instruct.intents import Intent
from ovita.instruct.scale import nice
from ovita.paths.trajectory import Array


def aim(d: Draft, intent: Intent) -> None:
    """An end that comes closer to an object, goes farther away from it, or comes to a height."""
    if intent.unit == "level":
        up = d.request.scene.frame.direction("up")
        end = d.request.trajectory.positions[0 if intent.mode == "start" else -1]
        offset = _arguments(d, intent.mode, up * ((intent.amount or 0.0) - float(end @ up)))
        if offset:
            d.body.append(f"traj = move_{intent.mode}(traj, {offset}, blend=0.5)")
        d.plan.append(f"Bring the {intent.mode} to a height of {intent.amount:g} m; the path bends with it.")
        return
    item = intent.items[0]
    away = intent.unit == "away"
    gap = item.position - d.positions[0 if intent.mode == "start" else -1]
    distance = float(np.linalg.norm(gap))
    by = intent.amount
    if by is None:
        by = d.scale.step(intent.degree) if away else nice(0.5 * distance)
        d.assume(f'"{"farther from" if away else "closer to"} {item.name}" is {by:g} m')
    reach = by if away else min(by, distance)
    offset = _arguments(d, intent.mode, gap / max(distance, 1e-9) * (-reach if away else reach))
    if not offset:
        return
    d.body.append(f"traj = move_{intent.mode}(traj, {offset}, blend=0.5)")
    word = "away from" if away else "toward"
    d.plan.append(f"Move the {intent.mode} {reach:g} m {word} {item.name}; the path bends with it.")


def carry(d: Draft, intent: Intent) -> None:
    """Waypoints brought to an object: "move waypoint 25 to the cup"."""
    item = intent.items[0]
    k = int(np.clip((intent.region.amount or 1) - 1, 0, len(d.positions) - 1))
    offset = _arguments(d, "shift", item.position - d.positions[k])
    where, part = mask(d, intent.region)
    name = d.part(where)
    ease = d.knob("ease", 0.05, "share of the path over which a partial shift fades in")
    if offset:
        d.contacts.append(item.name)
        d.body.append(f"traj = move(traj, {offset}, where={name}, ease={ease})")
    d.plan.append(f"Bring the path to {item.name}{suffix(part)}.")


def back(d: Draft, _: Intent) -> None:
    """Straight on from the goal to where the path starts."""
    d.body.append("traj = continue_to(traj, traj[0, :3], smooth=False)")
    d.plan.append("After the goal, go straight back to the start.")


def _arguments(d: Draft, prefix: str, shift: Array) -> str:
    """A shift (3,) [m] as direction words with knobs, or ""."""
    said = []
    for direction, metres in d.request.scene.frame.words(shift).items():
        value = float(f"{metres:.4g}")
        if value > 1e-6:
            said.append(f"{direction}={d.knob(f'{prefix}_{direction}', value, f'[m] {direction}')}")
    return ", ".join(said)


AIM_STEPS = {"aim": aim, "carry": carry, "return": back}
