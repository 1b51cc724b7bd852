"""Postconditions: what a policy promises of its output, checked there and again after the limits have been kept."""

from __future__ import annotations

from typing import Any, Literal, Unpack

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.geometry import runs
from ovita.paths.scene import DIRECTIONS, OPPOSITE, RFU, Frame, SceneObject
from ovita.paths.trajectory import Array
from ovita.text import point
from ovita.toolkit import arguments
from ovita.toolkit.arguments import Aim, Offset, Target
from ovita.toolkit.catalogue import Expectation, Recorder, operation

SIDES = {"above": "up", "below": "down", "behind": "back"}
"""Sides of an object to the direction words that they lie in."""

_BESIDE = dict(zip(DIRECTIONS, ("left of", "right of", "in front of", "behind", "above", "below"), strict=True))


@operation("State what is meant", core=True)
def expect_closer(
    obj: Target, by: float | None = None, *, where: ArrayLike | None = None, recorder: Recorder | None = None
) -> Expectation:
    """The path comes closer.

    The nearest distance to the centre decides, between waypoints too; only if that stays, the average does.

    Args:
        by: At least so much at the nearest point [m], or None for any amount.
    """
    return _approach("closer", "closer to", obj, by, where, recorder)


@operation("State what is meant", core=True)
def expect_farther(
    obj: Target, by: float | None = None, *, where: ArrayLike | None = None, recorder: Recorder | None = None
) -> Expectation:
    """The path stays farther away.

    The nearest distance to the centre decides, between waypoints too; only if that stays, the average does.

    Args:
        by: At least so much at the nearest point [m], or None for any amount.
    """
    return _approach("farther", "farther from", obj, by, where, recorder)


@operation("State what is meant", core=True)
def expect_distance(
    obj: Target,
    at_least: float | None = None,
    at_most: float | None = None,
    *,
    nearest: float | None = None,
    where: ArrayLike | None = None,
    recorder: Recorder | None = None,
) -> Expectation:
    """The path keeps metres at_least from the surface, at_most from the centre.

    Args:
        at_least: [m] from the surface of an object with dimensions, else from the centre; between waypoints too.
        at_most: [m] from the centre.
        nearest: [m] from the surface as for at_least, at the nearest point, within 1 cm or 10 %; as pass_at does.
    """
    limits = _limits(0.0, at_least=at_least, at_most=at_most, nearest=nearest)
    if not limits:
        raise ValueError("give at_least, at_most or nearest in metres")
    kept = " and ".join(f"{name.replace('_', ' ')} {v:g} m" for name, v in limits.items() if name != "nearest")
    passed = f"comes as near as {nearest:g} m to {_name(obj)}" if nearest is not None else ""
    asked = [f"keeps {kept} from {_name(obj)}"] if kept else []
    values = {**_target(obj), **limits, **_where(where)}
    text = f"the path {' and '.join([*asked, *filter(None, [passed])])}{_part(where)}"
    return _note("distance", values, text, recorder)


@operation("State what is meant")
def expect_avoided(
    way: Literal["over", "under", "between"],
    obj: Target,
    other: Target | None = None,
    *,
    gap: float = 0.0,
    recorder: Recorder | None = None,
) -> Expectation:
    """The path passes neither over an object, nor under it, or not between two.

    Args:
        way: "over" and "under" are about obj, "between" about obj and other.
        other: Object or point (3,) [m], for "between".
        gap: How far beside the object, seen from above [m].
    """
    values = {"way": way, **_target(obj), "gap": arguments.number(gap, "gap", low=0.0)}
    about = _name(obj)
    if other is not None:
        values, about = values | {"other": _target(other, "other")}, f"{about} and {_name(other)}"
    return _note("avoided", values, f"the path does not pass {way} {about}", recorder)


@operation("State what is meant", core=True)
def expect_moved(
    *,
    where: ArrayLike | None = None,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
    **offset: Unpack[Offset],
) -> Expectation:
    """Moved by OFFSET, within 10 % or 1 cm."""
    moved = frame.words(arguments.offset(frame, offset))
    if not moved:
        raise ValueError("give a direction and metres, such as left=0.2")
    return _note("moved", {"offset": moved, **_where(where)}, f"the path moves {say(moved)}{_part(where)}", recorder)


@operation("State what is meant")
def expect_same_path(where: ArrayLike | None = None, *, recorder: Recorder | None = None) -> Expectation:
    """The path is as before, or a part of it."""
    return _note("same_path", _where(where), f"the path stays where it was{_part(where)}", recorder)


@operation("State what is meant")
def expect_same_speed(where: ArrayLike | None = None, *, recorder: Recorder | None = None) -> Expectation:
    """The speed is as before, or that on a part of the path."""
    return _note("same_speed", _where(where), f"the speed stays as it was{_part(where)}", recorder)


@operation("State what is meant")
def expect_side(
    side: str,
    at_least: float | None = None,
    at_most: float | None = None,
    *,
    of: Target | None = None,
    within: float | None = None,
    where: ArrayLike | None = None,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
) -> Expectation:
    """The path lies metres at_least or at_most on one side of the origin or of=cup; of=None and "up": a height.

    What stay_on, bound and at_height do is promised by the same numbers: expect_side("left", gap, of=dog) after
    stay_on, expect_side("up", at_most=1.0) after bound(up=1.0), expect_side("up", h, h) after at_height. For a way
    over or under an object, `within` says where it counts: expect_side("above", 0.1, of=vase, within=0.02)
    after hop. Where the path only has to come by at a place beside or above an object, as after go_through and hover,
    use expect_visits with an offset.

    Args:
        side: "left", "right", "front", "back", "up", "down", "above", "below" or "behind".
        at_least: [m] from the surface of an object with dimensions, else from the centre; between waypoints too.
        at_most: [m] from the centre; both the same: just so far, within 1 cm or 10 %.
        of: Object or point (3,) [m], or None for the origin, so that "up" is the height above the ground.
        within: Only where the path passes the centre at most so far aside [m], seen along the side; it has to pass
            there, and may miss 1 cm or 10 %. None for the whole path.
    """
    if at_least is None and at_most is None:
        raise ValueError("give at_least or at_most in metres")
    if within is not None and of is None:
        raise ValueError("within is a distance aside of an object or point; give of=, too")
    word = SIDES.get(side, side) if isinstance(side, str) else side
    arguments.direction(frame, word)
    limits = _limits(at_least=at_least, at_most=at_most)
    low, high = limits.get("at_least", -np.inf), limits.get("at_most", np.inf)
    if of is None and low > high:
        raise ValueError(f"at_least {low:g} m contradicts at_most {high:g} m")
    values: dict[str, Any] = {"side": word, **({} if of is None else _target(of, "of")), **limits}
    passing = ""
    if within is not None:
        values["within"] = arguments.number(within, "within", low=0.0)
        passing = f" where it passes within {values['within']:g} m of it"
    place = _name(of) if of is not None else "the ground" if word in ("up", "down") else "the origin"
    stated = {"": low} if low == high else limits
    asked = " and ".join(_bound(name, value, word, place) for name, value in stated.items())
    return _note("side", {**values, **_where(where)}, f"the path stays {asked}{passing}{_part(where)}", recorder)


@operation("State what is meant")
def expect_start(
    at: Target | None = None,
    *,
    aim: Aim = "centre",
    frame: Frame = RFU,
    recorder: Recorder | None = None,
    **offset: Unpack[Offset],
) -> Expectation:
    """The start is at a point, or moved by OFFSET; given nothing, as before. Within 2 cm or 10 % of the offset.

    Args:
        at: Object or point (3,) [m], or None for the original start.
        offset: Direction words and metres of it, such as left=0.2.
    """
    return _end("start", at, aim, arguments.offset(frame, offset), frame, recorder)


@operation("State what is meant")
def expect_goal(
    at: Target | None = None,
    *,
    aim: Aim = "centre",
    frame: Frame = RFU,
    recorder: Recorder | None = None,
    **offset: Unpack[Offset],
) -> Expectation:
    """The goal is at a point, or moved by OFFSET; given nothing, as before. Within 2 cm or 10 % of the offset.

    Args:
        at: Object or point (3,) [m], or None for the original goal.
        offset: Direction words and metres of it, such as left=0.2.
    """
    return _end("goal", at, aim, arguments.offset(frame, offset), frame, recorder)


@operation("State what is meant")
def expect_visits(
    obj: Target,
    within: float = 0.05,
    *,
    aim: Aim = "centre",
    frame: Frame = RFU,
    recorder: Recorder | None = None,
    **offset: Unpack[Offset],
) -> Expectation:
    """Comes within metres of a centre plus OFFSET.

    What go_through and hover do is promised by the same offset: expect_visits(cup, up=height) after hover or a way
    over, expect_visits(cup, down=depth) after a way under.

    Args:
        within: [m], >= 0.
        offset: Direction words and metres of it, such as up=0.2.
    """
    radius = arguments.number(within, "within", low=0.0)
    shift = arguments.offset(frame, offset)
    beside, aim = frame.words(shift), arguments.taken(obj, aim, frame, shift)
    whole = called(_name(obj), aim)
    place = f"the place {say(beside)} of {whole}" if beside else whole
    values = {**_target(obj), **_aim(aim), "within": radius, **({"offset": beside} if beside else {})}
    return _note("visits", values, f"the path comes within {radius:g} m of {place}", recorder)


@operation("State what is meant", core=True)
def expect_slower(where: ArrayLike | None = None, *, recorder: Recorder | None = None) -> Expectation:
    """The robot is slower."""
    return _note("slower", _where(where), f"the robot moves slower{_part(where)}", recorder)


@operation("State what is meant", core=True)
def expect_faster(where: ArrayLike | None = None, *, recorder: Recorder | None = None) -> Expectation:
    """The robot is faster."""
    return _note("faster", _where(where), f"the robot moves faster{_part(where)}", recorder)


@operation("State what is meant")
def expect_speed(
    value: float | None = None,
    where: ArrayLike | None = None,
    *,
    at_least: float | None = None,
    at_most: float | None = None,
    recorder: Recorder | None = None,
) -> Expectation:
    """The speed is so many m/s, within 10 %, or at_least or at_most so many everywhere, but for stops.

    Args:
        value: [m/s], >= 0.
        at_least: [m/s], >= 0; braking to rest and starting from it do not count.
        at_most: [m/s], >= 0.
    """
    limits = _limits(0.0, value=value, at_least=at_least, at_most=at_most)
    if not limits or (value is not None and len(limits) > 1):
        raise ValueError("give value, or at_least or at_most, in m/s")
    asked = " and ".join(f"{name.replace('_', ' ')} {v:g} m/s".removeprefix("value ") for name, v in limits.items())
    return _note("speed", {**limits, **_where(where)}, f"the speed is {asked}{_part(where)}", recorder)


@operation("State what is meant")
def expect_duration(
    value: float | None = None,
    where: ArrayLike | None = None,
    *,
    at_most: float | None = None,
    recorder: Recorder | None = None,
) -> Expectation:
    """The way takes so many seconds, within 10 %, or at_most so many; standing still is on top.

    Args:
        value: [s], >= 0.
        at_most: [s], >= 0.
    """
    limits = _limits(0.0, value=value, at_most=at_most)
    if len(limits) != 1:
        raise ValueError("give value or at_most, in seconds")
    asked = "".join(f"{name.replace('_', ' ')} {v:g} s".removeprefix("value ") for name, v in limits.items())
    return _note("duration", {**limits, **_where(where)}, f"the way takes {asked}{_part(where)}", recorder)


@operation("State what is meant")
def expect_stop(
    near: Target | None = None,
    *,
    before: float | None = None,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
    **offset: Unpack[Offset],
) -> Expectation:
    """Comes to rest there, or at the end.

    Args:
        near: Object or point (3,) [m]: the stop is at the part of the path nearest to it. None: at the end.
        before: The stop is so many metres before it, from its surface, within 1 cm or 10 %.
        offset: Direction words and metres of it: the stop is nearest to that place beside it, such as up=0.2.
    """
    if near is None:
        return _note("stop", {}, "the robot stops at the end", recorder)
    if before is not None:
        values = {**_target(near), "before": arguments.positive(before, "before")}
        return _note("stop", values, f"the robot stops {before:g} m before {_name(near)}", recorder)
    beside = frame.words(arguments.offset(frame, offset))
    place = f"the place {say(beside)} of {_name(near)}" if beside else _name(near)
    values = {**_target(near), **({"offset": beside} if beside else {})}
    return _note("stop", values, f"the robot stops near {place}", recorder)


@operation("State what is meant")
def expect_no_stop(where: ArrayLike | None = None, *, recorder: Recorder | None = None) -> Expectation:
    """Comes to rest nowhere between the ends, or nowhere on a part of the path."""
    return _note("no_stop", _where(where), f"the robot makes no stop{_part(where)}", recorder)


@operation("State what is meant")
def expect_length(
    *,
    times: float | None = None,
    longer_by: float | None = None,
    shorter_by: float | None = None,
    recorder: Recorder | None = None,
) -> Expectation:
    """The path is so many times as long as it was, within 10 %, or longer or shorter by at least so much.

    Args:
        times: Factor > 0 on its length.
        longer_by: [m], >= 0; 0 for any amount.
        shorter_by: [m], >= 0; 0 for any amount.
    """
    limits = _limits(0.0, times=times, longer_by=longer_by, shorter_by=shorter_by)
    if len(limits) != 1:
        raise ValueError("give one of times (a factor), longer_by and shorter_by (metres)")
    ((name, value),) = limits.items()
    word = name.removesuffix("_by")
    asked = f"{value:g} times as long" if name == "times" else f"{word} by {value:g} m" if value else word
    return _note("length", limits, f"the path becomes {asked}", recorder)


@operation("State what is meant")
def expect_smoother(where: ArrayLike | None = None, *, recorder: Recorder | None = None) -> Expectation:
    """The path has fewer bends: squared and summed by a twentieth at least; no corner stands out far more."""
    return _note("smoother", _where(where), f"the path is smoother{_part(where)}", recorder)


@operation("State what is meant")
def expect_waypoints(count: int, *, recorder: Recorder | None = None) -> Expectation:
    """So many waypoints.

    Args:
        count: Their number, >= 2.
    """
    number = arguments.integer(count, "count", 2, arguments.MOST_WAYPOINTS)
    return _note("waypoints", {"count": number}, f"the path has {number} waypoints", recorder)


@operation("State what is meant")
def expect_acceleration(
    rate: float, where: ArrayLike | None = None, *, recorder: Recorder | None = None
) -> Expectation:
    """Accelerates at rate m/s^2 (negative: brakes), within 10 % or 0.01 m/s^2, but for stops.

    Args:
        rate: [m/s^2].
    """
    values = {"rate": arguments.number(rate, "rate"), **_where(where)}
    word = "speeds up" if values["rate"] >= 0.0 else "brakes"
    return _note("acceleration", values, f"the robot {word} at {abs(values['rate']):g} m/s^2{_part(where)}", recorder)


def _limits(low: float | None = None, **amounts: float | None) -> dict[str, float]:
    """The amounts that are given, checked."""
    return {name: arguments.number(amount, name, low=low) for name, amount in amounts.items() if amount is not None}


def _bound(name: str, value: float, word: str, place: str) -> str:
    """A bound on one side in words; a negative one is said of the other side."""
    if value < 0.0:
        name, value, word = {"at_least": "at_most", "at_most": "at_least"}.get(name, name), -value, OPPOSITE[word]
    return f"{name.replace('_', ' ')} {value:g} m {_BESIDE[word]} {place}".strip()


def say(offset: dict[str, float]) -> str:
    """An offset as words: {"left": 0.2} is "0.2 m left"."""
    return " and ".join(f"{amount:g} m {word}" for word, amount in offset.items())


def _approach(
    kind: str, phrase: str, obj: Target, by: float | None, where: ArrayLike | None, recorder: Recorder | None
) -> Expectation:
    amount = None if by is None else arguments.number(by, "by", low=0.0)
    values = {**_target(obj), **({} if amount is None else {"by": amount}), **_where(where)}
    much = "" if amount is None else f" by {amount:g} m"
    return _note(kind, values, f"the path is {phrase} {_name(obj)}{much}{_part(where)}", recorder)


def _end(kind: str, at: Target | None, aim: Aim, shift: Array, frame: Frame, recorder: Recorder | None) -> Expectation:
    offset, aim = frame.words(shift), arguments.taken(at, aim, frame, shift)
    values: dict[str, Any] = {} if at is None else {**_target(at, "at"), **_aim(aim)}
    if offset:
        values["offset"] = offset
    if at is None:
        text = f"the {kind} moves {say(offset)}" if offset else f"the {kind} stays where it was"
    else:
        place = called(_name(at), aim)
        text = f"the {kind} is {say(offset)} of {place}" if offset else f"the {kind} is at {place}"
    return _note(kind, values, text, recorder)


def _note(kind: str, values: dict[str, Any], text: str, recorder: Recorder | None) -> Expectation:
    expectation = Expectation(kind, values, text)
    if recorder is not None:
        recorder.expectations.append(expectation)
    return expectation


def _target(target: Target, name: str = "obj") -> dict[str, Any]:
    place = arguments.point(target, name)
    return {"object": target.name} if isinstance(target, SceneObject) else {"point": place.tolist()}


def _name(target: Target) -> str:
    if isinstance(target, SceneObject):
        return target.name
    return point(arguments.point(target).tolist())


def _aim(aim: Aim) -> dict[str, Any]:
    return {} if aim == "centre" else {"aim": aim}


def called(name: str, aim: Aim) -> str:
    """A target and what of it is meant, in words."""
    return f"the {aim} of {name}" if aim in ("top", "surface") else name


def _where(where: ArrayLike | None) -> dict[str, Any]:
    if where is None:
        return {}
    selected = arguments.mask(where, int(np.size(np.asarray(where))))
    return {"where": {"count": len(selected), "ranges": [list(run) for run in runs(selected)]}}


def _part(where: ArrayLike | None) -> str:
    """The selected waypoints as a person counts them, from 1 and both ends included, for the end of a sentence."""
    if where is None:
        return ""
    ranges = _where(where)["where"]["ranges"]
    if not ranges:
        return " (at no waypoint)"
    shown = ", ".join(f"{a + 1}" if a == b else f"{a + 1} to {b + 1}" for a, b in ranges[:4])
    return f" (waypoints {shown}{', ...' if len(ranges) > 4 else ''})"
