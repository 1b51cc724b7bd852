"""Checks of what a policy passes to the toolkit: what does not fit is a ValueError of one sentence for its writer."""

from __future__ import annotations

import inspect
from typing import Any, Literal, TypeAlias, TypedDict, get_args

import numpy as np
from numpy.typing import ArrayLike

from ovita.errors import SceneError
from ovita.paths.geometry import Mask, fractions
from ovita.paths.scene import DIRECTIONS, Frame, SceneObject
from ovita.paths.trajectory import Array, first_bad, interpolate
from ovita.text import shortened

Target: TypeAlias = SceneObject | ArrayLike
"""An object, meaning its centre, or a point (3,) [m]."""
Place: TypeAlias = SceneObject | ArrayLike | int | float | str
"""A waypoint: its index (int), a fraction of the path's length (float 0..1), "start", "goal", or the one nearest a
target."""


Aim: TypeAlias = Literal["centre", "top", "surface", "level"]
"""What of an object is meant: its centre, its top right above the centre, the point of its surface nearest to the path,
or right above or below the centre at the path's own height. Without dimensions, top and surface are the centre."""


class Offset(TypedDict, total=False):
    """Direction words in metres, which add up; each counts in its direction, so left=-0.1 is right=0.1."""

    left: float
    right: float
    front: float
    back: float
    up: float
    down: float


class OffsetLimits(TypedDict, total=False):
    """Direction words and how far along each is allowed [m]; None is no limit."""

    left: float | None
    right: float | None
    front: float | None
    back: float | None
    up: float | None
    down: float | None


def spelled_out(signature: inspect.Signature) -> inspect.Signature:
    """A signature with its `**offset: Unpack[Offset]` (or `OffsetLimits`) replaced by the six direction words."""
    shown = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
    for words in set(signature.parameters.values()) - set(shown):
        default = None if "OffsetLimits" in str(words.annotation) else 0.0
        first = next((i for i, p in enumerate(shown) if p.kind is p.KEYWORD_ONLY), len(shown))
        shown[first:first] = [inspect.Parameter(w, inspect.Parameter.KEYWORD_ONLY, default=default) for w in DIRECTIONS]
    return signature.replace(parameters=shown)


MOST_WAYPOINTS = 10_000
"""The most waypoints that one call may ask for."""


def waypoints(traj: ArrayLike) -> Array:
    """A fresh copy (N, 4+k) of a trajectory's rows x, y, z [m], speed [m/s], extra columns."""
    try:
        rows = np.array(traj, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError("traj is not an array of numbers (N, 4); pass the trajectory as first argument") from None
    if rows.ndim != 2 or rows.shape[1] < 4:
        raise ValueError(f"traj has shape {rows.shape}, but rows x, y, z, speed (N, 4) are needed; pass it first")
    if len(rows) < 2:
        raise ValueError(f"traj has {len(rows)} waypoint(s), but at least 2 are needed")
    bad = first_bad(rows)
    if bad is not None:
        raise ValueError(f"waypoint {bad} of traj is not finite: {rows[bad].tolist()}")
    return rows


def mask(where: ArrayLike | None, n: int) -> Mask:
    """A mask (n,) of booleans; None selects everything."""
    if where is None:
        return np.ones(n, dtype=bool)
    if isinstance(where, SceneObject):
        raise ValueError("where is an object, but a mask is needed: write where=near(traj, obj, within=0.2)")
    array = np.asarray(where)
    if array.dtype != np.bool_ or array.ndim != 1:
        raise ValueError("where must be a mask, one True or False a waypoint, as near() or first() return")
    if len(array) != n:
        raise ValueError(
            f"the mask has {len(array)} entries but the trajectory has {n} waypoints; "
            "make the mask from the trajectory that you pass"
        )
    return np.array(array, dtype=bool)


def point(target: Target, name: str = "obj") -> Array:
    """The point (3,) [m] that a target means: an object's centre, or the point itself."""
    if isinstance(target, SceneObject):
        return np.array(target.position)
    if isinstance(target, str):
        raise ValueError(f"{name} is the text {target!r}; pass scene[{target!r}], not {target!r}")
    try:
        array = np.array(target, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.zeros(0)
    if array.shape != (3,):
        raise ValueError(f"{name} must be an object of the scene or a point [x, y, z], not {shortened(target)}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} {array.tolist()} is not finite")
    return array


def taken(target: Target | None, aim: Aim, frame: Frame, shift: Array) -> Aim:
    """An aim as it is meant by a robot that keeps its height: beside an object, or at one, is in the robot's plane.

    Args:
        target: Object or point.
        aim: As stated.
        frame: Which says whether the robot keeps its height.
        shift: Where from the target (3,) [m]; a place above or below stays what it is.
    """
    if aim not in get_args(Aim):
        raise ValueError(f"aim must be {', '.join(map(repr, get_args(Aim)))}, not {shortened(aim)}")
    planar = frame.level is not None and isinstance(target, SceneObject) and not shift @ frame.direction("up")
    return "level" if aim == "centre" and planar else aim


def aimed(target: Target, aim: Aim, frame: Frame, path: Array, shift: Array, name: str = "obj") -> Array:
    """The point (3,) [m] that an aim at a target means.

    Args:
        target: Object or point.
        aim: What of it is meant.
        frame: Which way is up, and whether the robot keeps its height.
        path: (N, 3) [m], N >= 1, to which "surface" is nearest and "level" is level.
        shift: Where from there (3,) [m].
        name: Of the argument, for what is wrong with it.
    """
    centre, aim = point(target, name), taken(target, aim, frame, shift)
    return _spot(target, aim, frame, path, centre) + shift


def _spot(target: Target, aim: Aim, frame: Frame, path: Array, centre: Array) -> Array:
    if aim == "level":
        up = frame.direction("up")
        beside = path[np.argmin(np.linalg.norm(path - centre, axis=1))]
        return np.asarray(centre + ((beside - centre) @ up) * up)
    if aim == "centre" or not isinstance(target, SceneObject) or target.dimensions is None:
        return centre
    if aim == "top":
        up = frame.direction("up")
        share = np.abs(up @ target.rotation)
        reach = np.divide(target.size, 2.0 * share, out=np.full(3, np.inf), where=share > 0.0)
        return np.asarray(centre + float(reach.min()) * up)
    nearest = path[0] if len(path) < 2 else interpolate(path, np.array([target.cuboid.closest(path)[1]]))[0]
    return target.cuboid.on_surface(nearest)


def number(value: Any, name: str, *, low: float | None = None, high: float | None = None) -> float:
    """A finite float within [low, high]."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise ValueError(f"{name} must be a number, not {shortened(value)}")
    result = float(value)
    if not np.isfinite(result):
        raise ValueError(f"{name} must be finite, not {result}")
    if (low is not None and result < low) or (high is not None and result > high):
        wanted = f">= {low:g}" if high is None else f"<= {high:g}" if low is None else f"from {low:g} to {high:g}"
        raise ValueError(f"{name} must be {wanted}, not {result:g}")
    return result


def positive(value: Any, name: str, high: float | None = None) -> float:
    """A finite float > 0, and at most `high`."""
    result = number(value, name, low=0.0, high=high)
    if result == 0.0:
        raise ValueError(f"{name} must be > 0")
    return result


def bounds(value: Any, at_least: Any, at_most: Any, name: str, unit: str, low: float = -np.inf) -> tuple[float, float]:
    """The least and the greatest allowed amount: one exact value, or bounds of which the missing is infinite.

    Raises:
        ValueError: If a value is given next to bounds, nothing is given, or the bounds contradict each other.
    """
    given = {
        key: number(amount, key, low=low)
        for key, amount in ((name, value), ("at_least", at_least), ("at_most", at_most))
        if amount is not None
    }
    if not given or (name in given and len(given) > 1):
        raise ValueError(f"give {name + ', or ' if name else ''}at_least or at_most, in {unit}")
    least, most = (given.get(key, given.get(name, end)) for key, end in (("at_least", low), ("at_most", np.inf)))
    if least > most:
        raise ValueError(f"at_least {least:g} {unit} contradicts at_most {most:g} {unit}")
    return least, most


def share(value: Any, name: str) -> float | None:
    """A fraction from 0 to 1, or None."""
    return None if value is None else number(value, name, low=0.0, high=1.0)


def integer(value: Any, name: str, low: int, high: int) -> int:
    """An int within [low, high]; a float without a fraction will do."""
    result = number(value, name)
    if not result.is_integer():
        raise ValueError(f"{name} must be a whole number, not {result:g}")
    if not low <= result <= high:
        raise ValueError(f"{name} must be from {low} to {high}, not {int(result)}")
    return int(result)


def offset(frame: Frame, words: Offset) -> Array:
    """The vector (3,) [m] of direction words times metres in a frame."""
    return frame.offset(**{word: number(amount, word) for word, amount in words.items()})


def direction(frame: Frame, word: Any) -> Array:
    """The unit vector (3,) of a direction word."""
    if not isinstance(word, str):
        raise ValueError(f"direction must be a word such as 'up', not {shortened(word)}")
    try:
        return frame.direction(word)
    except SceneError as error:
        raise ValueError(str(error)) from None


def locate(rows: Array, at: Place, name: str = "at") -> int:
    """The index of the waypoint that a place means."""
    last = len(rows) - 1
    if isinstance(at, str):
        if at in ("start", "goal"):
            return 0 if at == "start" else last
        raise ValueError(f"{name} is the text {at!r}; pass scene[{at!r}], 'start' or 'goal'")
    if isinstance(at, (bool, np.bool_)):
        raise ValueError(f"{name} must be a place, not {at}")
    if isinstance(at, (int, np.integer)):
        index = integer(at, name, -len(rows), last)
        return index % len(rows)
    if isinstance(at, (float, np.floating)):
        fraction = number(at, name, low=0.0, high=1.0)
        return int(np.argmin(np.abs(fractions(rows[:, :3]) - fraction)))
    return int(np.argmin(np.linalg.norm(rows[:, :3] - point(at, name), axis=1)))
