"""Postconditions: what a policy promises of its output, checked there and again after the limits have been kept."""

from __future__ import annotations

from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.frame import RFU, Frame
from ovita.paths.geometry import runs
from ovita.paths.scene import SceneObject
from ovita.paths.trajectory import Array
from ovita.toolkit import arguments
from ovita.toolkit.arguments import Offset, Target
from ovita.toolkit.catalogue import Expectation, Recorder, operation


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
    where: ArrayLike | None = None,
    recorder: Recorder | None = None,
) -> Expectation:
    """The path keeps metres at_least from the surface, at_most from the centre.

    Args:
        at_least: [m] from the surface of an object with dimensions, else from the centre; between waypoints too.
        at_most: [m] from the centre.
    """
    if at_least is None and at_most is None:
        raise ValueError("give at_least or at_most in metres")
    limits = {
        name: arguments.number(value, name, low=0.0)
        for name, value in (("at_least", at_least), ("at_most", at_most))
        if value is not None
    }
    asked = " and ".join(f"{name.replace('_', ' ')} {value:g} m" for name, value in limits.items())
    values = {**_target(obj), **limits, **_where(where)}
    return _note("distance", values, f"the path keeps {asked} from {_name(obj)}{_part(where)}", recorder)


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
def expect_same_path(*, recorder: Recorder | None = None) -> Expectation:
    """The path is as before."""
    return _note("same_path", {}, "the path stays where it was", recorder)


@operation("State what is meant")
def expect_start(
    at: Target | None = None,
    *,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
    **offset: Unpack[Offset],
) -> Expectation:
    """The start is at a point, or moved by OFFSET; given nothing, as before. Within 2 cm or 10 % of the offset.

    Args:
        at: Object or point (3,) [m], or None for the original start.
        offset: Direction words and metres of it, such as left=0.2.
    """
    return _end("start", at, arguments.offset(frame, offset), frame, recorder)


@operation("State what is meant")
def expect_goal(
    at: Target | None = None,
    *,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
    **offset: Unpack[Offset],
) -> Expectation:
    """The goal is at a point, or moved by OFFSET; given nothing, as before. Within 2 cm or 10 % of the offset.

    Args:
        at: Object or point (3,) [m], or None for the original goal.
        offset: Direction words and metres of it, such as left=0.2.
    """
    return _end("goal", at, arguments.offset(frame, offset), frame, recorder)


@operation("State what is meant")
def expect_visits(obj: Target, within: float = 0.05, *, recorder: Recorder | None = None) -> Expectation:
    """Comes within metres of a centre.

    Args:
        within: [m], >= 0.
    """
    radius = arguments.number(within, "within", low=0.0)
    text = f"the path comes within {radius:g} m of {_name(obj)}"
    return _note("visits", {**_target(obj), "within": radius}, text, recorder)


@operation("State what is meant", core=True)
def expect_slower(where: ArrayLike | None = None, *, recorder: Recorder | None = None) -> Expectation:
    """The robot is slower."""
    return _note("slower", _where(where), f"the robot moves slower{_part(where)}", recorder)


@operation("State what is meant", core=True)
def expect_faster(where: ArrayLike | None = None, *, recorder: Recorder | None = None) -> Expectation:
    """The robot is faster."""
    return _note("faster", _where(where), f"the robot moves faster{_part(where)}", recorder)


@operation("State what is meant")
def expect_speed(value: float, where: ArrayLike | None = None, *, recorder: Recorder | None = None) -> Expectation:
    """The speed is so many m/s, within 10 %.

    Args:
        value: [m/s], >= 0.
    """
    speed = arguments.number(value, "value", low=0.0)
    return _note("speed", {"value": speed, **_where(where)}, f"the speed is {speed:g} m/s{_part(where)}", recorder)


@operation("State what is meant")
def expect_stop(near: Target | None = None, *, recorder: Recorder | None = None) -> Expectation:
    """Comes to rest there, or at the end.

    Args:
        near: Object or point (3,) [m]: the stop is at the part of the path nearest to it. None: at the end.
    """
    place = "at the end" if near is None else f"near {_name(near)}"
    return _note("stop", {} if near is None else _target(near), f"the robot stops {place}", recorder)


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


def _end(kind: str, at: Target | None, shift: Array, frame: Frame, recorder: Recorder | None) -> Expectation:
    offset = frame.words(shift)
    values: dict[str, Any] = {} if at is None else _target(at, "at")
    if offset:
        values["offset"] = offset
    base = "" if at is None else f" of {_name(at)}"
    if at is None:
        text = f"the {kind} moves {say(offset)}" if offset else f"the {kind} stays where it was"
    else:
        text = f"the {kind} is {say(offset)}{base}" if offset else f"the {kind} is at {_name(at)}"
    return _note(kind, values, text, recorder)


def _note(kind: str, values: dict[str, Any], text: str, recorder: Recorder | None) -> Expectation:
    expectation = Expectation(kind, values, text)
    if recorder is not None:
        recorder.expectations.append(expectation)
    return expectation


def _target(target: Target, name: str = "obj") -> dict[str, Any]:
    point = arguments.point(target, name)
    return {"object": target.name} if isinstance(target, SceneObject) else {"point": point.tolist()}


def _name(target: Target) -> str:
    if isinstance(target, SceneObject):
        return target.name
    return "[" + ", ".join(f"{value:g}" for value in arguments.point(target)) + "]"


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
