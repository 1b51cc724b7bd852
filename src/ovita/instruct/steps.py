"""From intents to a policy: each step adds lines, knobs and a sentence, in an order in which none disturbs another."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ovita.instruct.draft import IntentDraft, above, argument, mask, suffix
from ovita.instruct.intents import Intent, Region
from ovita.instruct.scale import Degree, nice
from ovita.instruct.shape_steps import SHAPE_STEPS, speed
from ovita.paths.frame import OPPOSITE
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory
from ovita.policy.policy import Role
from ovita.toolkit.approach import extent
from ovita.toolkit.waypoints import smooth


def aim(d: IntentDraft, intent: Intent) -> None:
    """An end that comes closer to an object, goes farther away from it, or comes to a height."""
    d.goal_moved = d.goal_moved or intent.mode == "goal"
    if intent.unit == "level":
        up = d.scene.frame.direction("up")
        end = d.trajectory.positions[0 if intent.mode == "start" else -1]
        offset = _toward(d, intent.mode, up * ((intent.amount or 0.0) - float(end @ up)))
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
    offset = _toward(d, intent.mode, gap / max(distance, 1e-9) * (-reach if away else reach))
    if not offset:
        return
    d.body.append(f"traj = move_{intent.mode}(traj, {offset}, blend=0.5)")
    word = "away from" if away else "toward"
    d.plan.append(f"Move the {intent.mode} {reach:g} m {word} {item.name}; the path bends with it.")


def carry(d: IntentDraft, intent: Intent) -> None:
    """Waypoints brought to an object: "move waypoint 25 to the cup"."""
    item = intent.items[0]
    k = int(np.clip((intent.region.amount or 1) - 1, 0, len(d.positions) - 1))
    offset = _toward(d, "shift", item.position - d.positions[k])
    where, part = mask(d, intent.region)
    name = d.part(where)
    if offset:
        d.contacts.append(item.name)
        d.body.append(f"traj = move(traj, {offset}, where={name})")
    d.promise(f"expect_visits({d.ref(item)}, within={_tolerance(d)})")
    d.plan.append(f"Bring the path to {item.name}{suffix(part)}.")


def back(d: IntentDraft, _: Intent) -> None:
    """Straight on from the goal to where the path starts."""
    d.body.append("traj = continue_to(traj, traj[0, :3], smooth=False)")
    d.plan.append("After the goal, go straight back to the start.")


def _toward(d: IntentDraft, prefix: str, shift: Array) -> str:
    """A shift (3,) [m] as direction words with knobs, or ""."""
    said = []
    for direction, metres in d.scene.frame.words(shift).items():
        value = float(f"{metres:.4g}")
        if value > 1e-6:
            name = d.knob(f"{prefix}_{direction}", value, "by", direction, unit="m", direction=direction)
            said.append(f"{direction}={name}")
    return ", ".join(said)


AIM_STEPS = {"aim": aim, "carry": carry, "return": back}


APPROACH: dict[Degree, float] = {"slight": 0.25, "moderate": 0.5, "large": 0.75}
STRONGEST = 64.0
"""Largest strength of a smoothing that is tried."""

SHARP = 0.7
"""A turn that smoothing must take the edge off [rad]."""

TO_THE = {"left": "to the left", "right": "to the right", "front": "to the front", "back": "back"}


@dataclass(frozen=True)
class _Offset:
    """An intent's directions: knobs by direction, metres by direction, and words such as "0.2 m to the left"."""

    knobs: dict[str, str]
    metres: dict[str, float]
    words: str

    @property
    def code(self) -> str:
        return _arguments(self.knobs)


def _arguments(expressions: dict[str, str]) -> str:
    return ", ".join(f"{direction}={expression}" for direction, expression in expressions.items())


def _offset(d: IntentDraft, intent: Intent, prefix: str = "") -> _Offset:
    knobs, words, amounts = {}, [], {}
    for direction, stated in intent.directions:
        value = stated
        if value is None:
            value = d.scale.step(intent.degree)
            d.assume(f'"{_said(intent, direction)}" is {value:g} m in this scene')
        if value == 0:
            d.ask(f"0 m {TO_THE.get(direction, direction)} moves nothing: how far should it go?")
        amounts[direction] = value
        meaning = f"shift {TO_THE.get(direction, direction)}"
        name = d.knob(f"{prefix}{direction}", value, "by", meaning, unit="m", direction=direction)
        knobs[direction] = name
        words.append(f"{value:g} m {TO_THE.get(direction, direction)}")
    return _Offset(knobs, amounts, " and ".join(words))


def _with_shift(d: IntentDraft, knobs: dict[str, str], *, own: bool) -> dict[str, str]:
    """Where an end lies from its original place: its own directions, and the shift of the whole path.

    With `own`, an end's own direction overrides the shift along that axis; without, the two add up.
    """
    total = {direction: name + ("" if own else d.shifted(direction)) for direction, name in knobs.items()}
    for direction in d.shifts:
        if direction not in total and OPPOSITE[direction] not in total:
            total[direction] = d.shifted(direction).removeprefix(" + ")
    return total


def _negated(shift: str) -> str:
    return shift.replace(" + ", " ~ ").replace(" - ", " + ").replace(" ~ ", " - ")


def _said(intent: Intent, direction: str) -> str:
    return {"slight": "a little ", "moderate": "", "large": "much "}[intent.degree] + direction


def _move(d: IntentDraft, intent: Intent) -> None:
    offset = _offset(d, intent)
    code, words = offset.code, offset.words
    where, part = mask(d, intent.region)
    if not where:
        ends = sorted(d.fixed & {"start", "goal"})
        if ends:
            kept = "both" if len(ends) == 2 else ends[0]
            d.body.append(f"traj = move(traj, {code}, keep={kept!r})")
            d.plan.append(f"Shift the path {words}; the {' and the '.join(ends)} stay{'s' if len(ends) == 1 else ''}.")
            return
        d.body.append(f"traj = move(traj, {code})")
        d.positions = d.positions + d.scene.frame.offset(**offset.metres)
        for direction, name in offset.knobs.items():
            d.shifts.setdefault(direction, []).append(name)
        d.exact |= {direction for direction, stated in intent.directions if stated is not None}
        total = {direction: " + ".join(names) for direction, names in d.shifts.items()}
        d.promise(f"expect_moved({_arguments(total)})", about="the shift of the whole path")
        d.plan.append(f"Shift the whole path {words}.")
        return
    name = d.part(where)
    d.body.append(f"traj = move(traj, {code}, where={name})")
    d.promise(f"expect_moved({code}, where={name})")
    d.plan.append(f"Shift the path {words} {part}.")


def _endpoint(d: IntentDraft, intent: Intent) -> None:
    end = "start" if intent.action == "move_start" else "goal"
    d.goal_moved = d.goal_moved or end == "goal"
    blend = d.knob(f"{end}_blend", 0.5, "share", f"share of the path that bends when the {end} moves")
    if intent.mode == "between":
        a, b = intent.items
        target, words = f"midpoint({d.ref(a)}, {d.ref(b)})", f"the midpoint of {a.name} and {b.name}"
    elif intent.items:
        target, words = d.ref(intent.items[0]), intent.items[0].name
    else:
        own = _offset(d, intent, f"{end}_")
        undone = {direction: name + _negated(d.shifted(direction)) for direction, name in own.knobs.items()}
        d.body.append(f"traj = move_{end}(traj, {_arguments(undone)}, blend={blend})")
        d.promise(f"expect_{end}({_arguments(_with_shift(d, own.knobs, own=True))})", about=end)
        d.plan.append(f"Shift the {end} {own.words}; the path bends towards it.")
        return
    offset = ""
    if intent.directions:
        if intent.directions[0] == ("up", intent.directions[0][1]) and intent.mode == "to":
            intent = replace(intent, directions=(("up", above(d, intent.items[0], intent.directions[0][1])),))
            beside = _offset(d, intent, f"{end}_")
        else:
            beside = _beside(d, intent, _offset(d, intent, f"{end}_"))
        offset, words = f", {beside.code}", f"{beside.words} of {words}"
    d.body.append(f"traj = move_{end}(traj, {target}{offset}, blend={blend})")
    d.promise(f"expect_{end}({target}{offset})", about=end)
    d.plan.append(f"Move the {end} to {words}; the path bends towards it.")


def _beside(d: IntentDraft, intent: Intent, offset: _Offset) -> _Offset:
    """The offset from an object's centre that so much beside it is: counted from its surface."""
    if len(intent.items) != 1 or intent.mode == "between":
        return offset
    item, knobs = intent.items[0], dict(offset.knobs)
    for direction, metres in offset.metres.items():
        half = float(f"{extent(item, d.scene.frame.direction(direction)):.6g}")
        if half:
            knobs[direction] += f" + {half!r}"
            way = f"{metres:g} m {direction} of {item.name}"
            d.assume(f"{way} is counted from its surface, {metres + half:.4g} m from its centre")
    return replace(offset, knobs=knobs)


def _same(d: IntentDraft, intent: Intent) -> None:
    """What is to stay as it is; the other steps leave it alone, and the expectation tells if they do not."""
    if intent.mode == "rest":
        return
    d.fixed.add(intent.mode)
    if intent.mode in ("start", "goal"):
        d.promise(f"expect_{intent.mode}()", about=intent.mode)
    elif intent.mode == "path":
        d.promise("expect_same_path()")
    if intent.mode != "part":
        d.plan.append(f"Leave the {intent.mode} as it is.")
        return
    knobs = dict(d.parameters)
    d.plan.append(f"Change nothing {mask(d, intent.region)[1]}.")
    d.parameters = knobs  # nothing is done there, so nothing can be turned


def _closer(d: IntentDraft, intent: Intent) -> None:
    item = intent.items[0]
    where, part = mask(d, intent.region)
    by = intent.amount
    if intent.unit == "%" and by is not None:
        by = nice(d.distance(item) * by)
    elif intent.unit == "x" and by is not None:
        by = nice(d.distance(item) * (1 - 1 / max(by, 1.01)))
    most = d.distance(item) - item.radius
    if by is None:
        by = d.scale.step("slight")
        if intent.degree != "slight":
            by = APPROACH[intent.degree] * (d.distance(item) + 0.1 * d.scale.extent)
        by = nice(d.effort * by)
        short = ", as far as its surface lets it" if by > most else ""
        d.assume(f'"closer to {item.name}" is {by:g} m closer{short}')
    ref = d.ref(item)
    where = d.part(where)
    if intent.amount is not None and by > most + 1e-9:
        d.assume(f"closer to {item.name} ends at its surface, {max(most, 0.0):.3g} m closer, not {by:g} m")
    meaning = f"how much closer to {item.name}"
    name = d.knob("closer_by", by, "by", meaning, unit="m", about=item.name, direction="closer")
    reach = ""
    if intent.mode == "whole" or where:
        meaning = "how far around the closest point it acts"
        reach = f", reach={d.knob('reach', nice(4 * d.scale.extent), 'radius', meaning, unit='m', about=item.name)}"
    d.body.append(f"traj = closer(traj, {ref}, {name}{reach}{argument(where)}{d.hold()})")
    stated = "" if intent.amount is None or where else f", {name}"
    d.promise(f"expect_closer({ref}{stated}{argument(where)})")
    d.plan.append(f"Bring the path {by:g} m closer to {item.name}{suffix(part)}.")


def _farther(d: IntentDraft, intent: Intent) -> None:
    item = intent.items[0]
    where, part = mask(d, intent.region)
    ref = d.ref(item)
    d.promise(f"expect_farther({ref})")
    if intent.mode == "aside":
        d.exact.add("up")  # around it, not above it
    if intent.unit == "%" and intent.amount is not None:
        intent = replace(intent, amount=1.0 + intent.amount, unit="x")
    if intent.unit == "x" and intent.amount is not None:
        meaning = f"factor on the distance to {item.name}"
        name = d.knob("times", intent.amount, "factor", meaning, about=item.name, direction="away")
        d.body.append(f"traj = farther(traj, {ref}, times={name}{argument(where)})")
        d.plan.append(f"Multiply the distance to {item.name} by {intent.amount:g}{suffix(part)}.")
        return
    now, was = item.distance(d.positions), item.distance(d.trajectory.positions)
    gain = min(float(now.min() - was.min()), float(now.mean() - was.mean()))
    if intent.amount is None and gain >= d.scale.step(intent.degree) and not where:
        d.plan.append(f"This already takes the path {gain:.3g} m farther from {item.name}.")
        return
    by = intent.amount
    if by is None:
        by = d.scale.step(intent.degree)
        d.assume(f'"away from {item.name}" is {by:g} m farther')
        by = nice(d.effort * _push_needed(d, item, by))
    meaning = f"how much farther from {item.name}"
    name = d.knob("farther_by", by, "by", meaning, unit="m", about=item.name, direction="away")
    d.body.append(f"traj = farther(traj, {ref}, {name}{argument(where)}{d.hold()})")
    d.plan.append(f"Take the path {by:g} m farther from {item.name}{suffix(part)}.")


def _push_needed(d: IntentDraft, item: SceneObject, gain: float) -> float:
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


def _keep_distance(d: IntentDraft, intent: Intent) -> None:
    bound = intent.mode
    role: Role = "at_most" if bound == "at_most" else "at_least"
    about = intent.items[0].name if len(intent.items) == 1 else ""
    meaning = f"distance to keep, {bound.replace('_', ' ')}"
    way = "closer" if bound == "at_most" else "away"
    name = d.knob("distance", intent.amount, role, meaning, unit="m", about=about, direction=way)
    refs = [d.ref(item) for item in intent.items]
    target = refs[0] if len(refs) == 1 else f"[{', '.join(refs)}]"
    where, part = mask(d, intent.region)
    where = argument(d.part(where))
    d.body.append(f"traj = keep_distance(traj, {target}, {bound}={name}{where})")
    for ref in refs:
        d.promise(f"expect_distance({ref}, {bound}={name}{where})")
    names = " and ".join(item.name for item in intent.items)
    d.plan.append(f"Keep {bound.replace('_', ' ')} {intent.amount:g} m from {names}{suffix(part)}.")


def _through(d: IntentDraft, intent: Intent) -> None:
    item = intent.items[0]
    if intent.mode == "between":
        other = intent.items[1]
        target = f"midpoint({d.ref(item)}, {d.ref(other)})"
        d.body.append(f"traj = go_through(traj, {target})")
        d.promise(f"expect_visits({target}, within={_tolerance(d)})")
        d.plan.append(f"Bend the path through the midpoint of {item.name} and {other.name}.")
        return
    ref = d.ref(item)
    if intent.mode == "under":
        depth = above(d, item, intent.amount, below=True)
        meaning = f"depth below the centre of {item.name}"
        name = d.knob("depth", depth, "to", meaning, unit="m", about=item.name, direction="down")
        d.body.append(f"traj = go_through(traj, {ref}, down={name})")
        d.plan.append(f"Bend the path under {item.name}, {depth:g} m below its centre.")
        return
    if intent.mode != "over":
        d.body.append(f"traj = go_through(traj, {ref})")
        d.promise(f"expect_visits({ref}, within={_tolerance(d)})")
        d.plan.append(f"Bend the path through {item.name}.")
        return
    height = above(d, item, intent.amount)
    passed = _height_over(d, item)
    if passed > height and intent.unit == "raised":
        d.assume(f"the path passes {passed:.3g} m above the centre of {item.name}, so it rises by that much there")
        region = Region("near", (item,))
        _move(d, Intent("move", (("up", intent.amount),), degree=intent.degree, region=region, text=intent.text))
        return
    if intent.amount is None and passed > height:
        d.do(f"The path already passes {passed:.3g} m above the centre of {item.name}.", holds=True)
        return
    name = d.over("height", height, "centre", item)
    d.body.append(f"traj = go_through(traj, {ref}, up={name})")
    d.plan.append(f"Bend the path over {item.name}, {height:g} m above its centre.")


def _height_over(d: IntentDraft, item: SceneObject) -> float:
    """How high the path passes over an object [m]: above its centre, within its sphere seen from above; else -inf."""
    up = d.scene.frame.direction("up")
    away = d.positions - item.position
    heights = away @ up
    over = np.linalg.norm(away - heights[:, None] * up, axis=1) <= max(item.radius, 0.05 * d.scale.extent)
    return float(heights[over].min()) if over.any() else -np.inf


def _extend(d: IntentDraft, intent: Intent) -> None:
    straight = ", smooth=False" if intent.unit == "straight" else ""
    if intent.mode == "between":
        a, b = intent.items
        target = f"midpoint({d.ref(a)}, {d.ref(b)})"
        d.body.append(f"traj = continue_to(traj, {target}{straight})")
        d.promise(f"expect_goal({target})", about="goal")
        d.plan.append(f"Continue from the goal to the midpoint of {a.name} and {b.name}.")
    elif intent.mode == "to":
        ref = d.ref(intent.items[0])
        d.body.append(f"traj = continue_to(traj, {ref}{straight})")
        d.promise(f"expect_goal({ref})", about="goal")
        d.plan.append(f"Continue from the goal to {intent.items[0].name}.")
    elif intent.directions:
        beyond = _offset(d, intent)
        d.body.append(f"traj = extend(traj, {beyond.code})")
        d.promises.pop("goal", None)
        if not d.goal_moved:
            d.promise(f"expect_goal({_arguments(_with_shift(d, beyond.knobs, own=False))})", about="goal")
        d.goal_moved = True
        d.plan.append(f"After the goal, go on {beyond.words}.")
    else:
        by = intent.amount
        if by is None:
            by = d.scale.step(intent.degree)
            d.assume(f"going on after the goal is {by:g} m in the direction of arrival")
        d.goal_moved = True
        name = d.knob("further", by, "by", "how far to go on after the goal", unit="m")
        d.body.append(f"traj = extend(traj, {name})")
        d.plan.append(f"After the goal, go on for {by:g} m in the same direction.")


def _at(d: IntentDraft, intent: Intent) -> tuple[str, str]:
    if intent.items:
        return d.ref(intent.items[0]), f"closest to {intent.items[0].name}"
    if intent.mode == "middle":
        return "0.5", "in the middle"
    if intent.mode.startswith("#"):
        which = min(int(intent.mode[1:]), len(d.trajectory))
        d.assume("waypoints are counted from 1")
        return str(which - 1), f"at waypoint {which}"
    place = intent.mode or "goal"
    return repr(place), f"at the {place}"


def _stop(d: IntentDraft, intent: Intent) -> None:
    at, words = _at(d, intent)
    d.body.append(f"traj = stop_at(traj, {at})")
    if intent.items:
        d.promise(f"expect_stop(near={at})")
    d.plan.append(f"Slow down and stop {words}; the trajectory ends there.")
    d.assume("to stop means to end there; say 'wait' to go on afterwards")


def _wait(d: IntentDraft, intent: Intent) -> None:
    at, words = _at(d, intent)
    steps = 10.0 if intent.amount is None else intent.amount
    if intent.amount is None:
        d.assume("the wait lasts 10 timesteps")
    if intent.unit == "s":
        steps = steps / d.trajectory.timestep
    count = max(1, round(steps))
    name = d.knob("steps", count, "count", f"timesteps to wait ({d.trajectory.timestep:g} s each)", direction="longer")
    d.body.append(f"traj = dwell(traj, {at}, steps={name})")
    if intent.items:
        d.promise(f"expect_stop(near={at})")
    d.plan.append(f"Wait {count} timesteps {words}.")


def _smooth(d: IntentDraft, intent: Intent) -> None:
    strength = {"slight": 0.3, "moderate": 1.0, "large": 3.0}[intent.degree]
    while strength < STRONGEST and not _is_smoother(d.trajectory.to_array(), strength):
        strength *= 2.0
    name = d.knob("smoothing", strength, "to", "strength of the smoothing")
    d.body.append(f"traj = smooth(traj, {name})")
    d.plan.append("Smooth the path; start and goal stay.")


def _is_smoother(rows: Array, strength: float) -> bool:
    """Whether a smoothing takes out bends without making the sharpest turn sharper."""
    before, after = _turns(rows), _turns(smooth(rows, strength))
    if not before.any():
        return True
    sharp = float(before.max()) > SHARP
    calmer = float(after.max()) <= (0.75 if sharp else 1.0) * float(before.max())
    return calmer and (after**2).sum() < 0.95 * (before**2).sum()


def _turns(rows: Array) -> Array:
    """The angle between each two steps of a path [rad]."""
    steps = np.diff(rows[:, :3], axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    steps = steps[lengths > 1e-9] / lengths[lengths > 1e-9, None]
    return np.asarray(np.arccos(np.clip((steps[:-1] * steps[1:]).sum(axis=1), -1.0, 1.0)))


def _resample(d: IntentDraft, intent: Intent) -> None:
    n = len(d.trajectory)
    amount = intent.amount or 1.0
    count = amount if intent.unit == "waypoints" else n + amount if intent.unit == "more" else n * amount
    count = int(np.clip(round(count or n), 2, 100_000))
    if intent.mode == "assumed":
        d.assume(f"the number of waypoints is {'doubled' if count > n else 'halved'}")
    name = d.knob("waypoints", count, "count", "number of waypoints")
    d.body.append(f"traj = resample(traj, {name})")
    d.plan.append(f"Resample the path to {count} waypoints.")


def _tolerance(d: IntentDraft) -> float:
    return nice(0.02 * d.scale.extent)


STEPS: dict[str, Callable[[IntentDraft, Intent], None]] = {
    **SHAPE_STEPS,
    **AIM_STEPS,
    "same": _same,
    "move": _move,
    "move_start": _endpoint,
    "move_goal": _endpoint,
    "closer": _closer,
    "farther": _farther,
    "keep_distance": _keep_distance,
    "through": _through,
    "extend": _extend,
    "speed": speed,
    "stop": _stop,
    "wait": _wait,
    "smooth": _smooth,
    "resample": _resample,
}


ORDER: tuple[tuple[str, ...], ...] = (
    *(("same",), ("reverse",), ("mirror", "rotate", "tilt"), ("resize", "curve"), ("smooth",), ("straighten",)),
    *(("move",), ("quadrant", "height"), ("closer", "farther"), ("keep_distance",), ("side",)),
    *(
        ("through", "hop"),
        ("bound",),
        ("move_start", "move_goal", "aim", "carry"),
        ("zigzag", "wave", "noise"),
        ("speed",),
    ),
    *(
        ("shortcut", "extend", "return", "circle", "eight", "spiral", "hover", "wait", "stop"),
        ("average",),
        ("trim", "resample"),
    ),
)
"""Path first, from the whole to its parts, so that no step disturbs an exact amount set by another; then speed; then,
in the order of the sentence, what happens at a place and may change the number of waypoints."""

RANK = {action: rank for rank, actions in enumerate(ORDER) for action in actions}


def compose(
    intents: tuple[Intent, ...], trajectory: Trajectory, scene: Scene, radius: float | None = None, *, effort: int = 1
) -> IntentDraft:
    """Write the policy for some intents.

    Args:
        intents: In the order of the sentence.
        trajectory: The trajectory to change.
        scene: Its surroundings.
        radius: A distance that the instruction states for every "near".
        effort: How much to exceed the usual amounts where none is stated; 1 is as usual.
    """
    draft = IntentDraft.of(trajectory, scene)
    if not intents:
        return draft
    draft.effort = effort if sum(intent.action in ("closer", "farther") for intent in intents) <= 2 else 1
    for intent in sorted(intents_once(intents), key=lambda i: RANK[i.action]):
        STEPS[intent.action](draft, intent if radius is None else _with_radius(intent, radius))
    if len(draft.held) == len(intents):
        draft.promise("expect_same_path()")
    return draft


def intents_once(intents: tuple[Intent, ...]) -> list[Intent]:
    """Drop a second smoothing, which would change nothing; any other repetition is intended."""
    kept: list[Intent] = []
    for intent in intents:
        if intent.action != "smooth" or not any(k.action == "smooth" for k in kept):
            kept.append(intent)
    return kept


def _with_radius(intent: Intent, radius: float) -> Intent:
    if intent.region.kind == "near" and intent.region.amount is None:
        return replace(intent, region=replace(intent.region, amount=radius))
    return intent
