"""Promises of a policy, checked on its output and again after the constraints have had their say."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.scene import RFU, Frame, SceneObject
from ovita.toolkit import arguments
from ovita.toolkit.arguments import Target
from ovita.toolkit.recorder import Expectation, Recorder
from ovita.toolkit.shaping import runs


def expect_closer(
    obj: Target, by: float | None = None, *, where: ArrayLike | None = None, recorder: Recorder | None = None
) -> Expectation:
    """The path comes closer.

    Args:
        obj: Object or point (3,) [m].
        by: At least so much at the nearest point [m], or None for any amount.
        where: Mask (N,) over the original waypoints, or None.
        recorder: Where the promise is noted.
    """
    return _approach("closer", "closer to", obj, by, where, recorder)


def expect_farther(
    obj: Target, by: float | None = None, *, where: ArrayLike | None = None, recorder: Recorder | None = None
) -> Expectation:
    """The path stays farther away.

    Args:
        obj: Object or point (3,) [m].
        by: At least so much at the nearest point [m], or None for any amount.
        where: Mask (N,) over the original waypoints, or None.
        recorder: Where the promise is noted.
    """
    return _approach("farther", "farther from", obj, by, where, recorder)


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
        obj: Object or point (3,) [m].
        at_least: [m] from the bounding sphere of an object with dimensions, else from the centre.
        at_most: [m] from the centre.
        where: Mask (N,) over the original waypoints, or None.
        recorder: Where the promise is noted.
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


def expect_moved(
    *,
    left: float = 0.0,
    right: float = 0.0,
    front: float = 0.0,
    back: float = 0.0,
    up: float = 0.0,
    down: float = 0.0,
    where: ArrayLike | None = None,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
) -> Expectation:
    """Moved by OFFSET, within 10 % or 1 cm.

    Args:
        left: Metres to the left; the other words likewise.
        right: [m].
        front: [m].
        back: [m].
        up: [m].
        down: [m].
        where: Mask (N,) over the original waypoints, or None.
        frame: Which way is left.
        recorder: Where the promise is noted.
    """
    words = {"left": left, "right": right, "front": front, "back": back, "up": up, "down": down}
    offset = frame.words(arguments.offset(frame, words))
    if not offset:
        raise ValueError("give a direction and metres, such as left=0.2")
    return _note("moved", {"offset": offset, **_where(where)}, f"the path moves {say(offset)}{_part(where)}", recorder)


def expect_same_path(*, recorder: Recorder | None = None) -> Expectation:
    """The path is as before.

    Args:
        recorder: Where the promise is noted.
    """
    return _note("same_path", {}, "the path stays where it was", recorder)


def expect_start(
    at: Target | None = None,
    *,
    left: float = 0.0,
    right: float = 0.0,
    front: float = 0.0,
    back: float = 0.0,
    up: float = 0.0,
    down: float = 0.0,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
) -> Expectation:
    """The start is at a point, or moved by OFFSET; given nothing, as before.

    Args:
        at: Object or point (3,) [m], or None for the original start.
        left: Metres to the left of it; the other words likewise.
        right: [m].
        front: [m].
        back: [m].
        up: [m].
        down: [m].
        frame: Which way is left.
        recorder: Where the promise is noted.
    """
    words = {"left": left, "right": right, "front": front, "back": back, "up": up, "down": down}
    return _end("start", at, frame, words, recorder)


def expect_goal(
    at: Target | None = None,
    *,
    left: float = 0.0,
    right: float = 0.0,
    front: float = 0.0,
    back: float = 0.0,
    up: float = 0.0,
    down: float = 0.0,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
) -> Expectation:
    """The goal is at a point, or moved by OFFSET; given nothing, as before.

    Args:
        at: Object or point (3,) [m], or None for the original goal.
        left: Metres to the left of it; the other words likewise.
        right: [m].
        front: [m].
        back: [m].
        up: [m].
        down: [m].
        frame: Which way is left.
        recorder: Where the promise is noted.
    """
    words = {"left": left, "right": right, "front": front, "back": back, "up": up, "down": down}
    return _end("goal", at, frame, words, recorder)


def expect_visits(obj: Target, within: float = 0.05, *, recorder: Recorder | None = None) -> Expectation:
    """Comes within metres of a centre.

    Args:
        obj: Object or point (3,) [m].
        within: [m], >= 0.
        recorder: Where the promise is noted.
    """
    radius = arguments.number(within, "within", low=0.0)
    text = f"the path comes within {radius:g} m of {_name(obj)}"
    return _note("visits", {**_target(obj), "within": radius}, text, recorder)


def expect_slower(where: ArrayLike | None = None, *, recorder: Recorder | None = None) -> Expectation:
    """The robot is slower.

    Args:
        where: Mask (N,) over the original waypoints, or None.
        recorder: Where the promise is noted.
    """
    return _note("slower", _where(where), f"the robot moves slower{_part(where)}", recorder)


def expect_faster(where: ArrayLike | None = None, *, recorder: Recorder | None = None) -> Expectation:
    """The robot is faster.

    Args:
        where: Mask (N,) over the original waypoints, or None.
        recorder: Where the promise is noted.
    """
    return _note("faster", _where(where), f"the robot moves faster{_part(where)}", recorder)


def expect_speed(value: float, where: ArrayLike | None = None, *, recorder: Recorder | None = None) -> Expectation:
    """The speed is so many m/s, within 10 %.

    Args:
        value: [m/s], >= 0.
        where: Mask (N,) over the original waypoints, or None.
        recorder: Where the promise is noted.
    """
    speed = arguments.number(value, "value", low=0.0)
    return _note("speed", {"value": speed, **_where(where)}, f"the speed is {speed:g} m/s{_part(where)}", recorder)


def expect_stop(near: Target | None = None, *, recorder: Recorder | None = None) -> Expectation:
    """Comes to rest there, or at the end.

    Args:
        near: Object or point (3,) [m]: the stop is at the part of the path nearest to it. None: at the end.
        recorder: Where the promise is noted.
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


def _end(kind: str, at: Target | None, frame: Frame, words: dict[str, float], recorder: Recorder | None) -> Expectation:
    offset = frame.words(arguments.offset(frame, words))
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
    """The selected waypoints in words, for the end of a sentence."""
    if where is None:
        return ""
    ranges = _where(where)["where"]["ranges"]
    if not ranges:
        return " (at no waypoint)"
    shown = ", ".join(f"{a}" if a == b else f"{a} to {b}" for a, b in ranges[:4])
    return f" (waypoints {shown}{', ...' if len(ranges) > 4 else ''})"
