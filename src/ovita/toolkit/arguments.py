"""What a policy passes to the toolkit: how a call looks, its checks, and the weights that a part gives its waypoints.

What does not fit is a ValueError of one sentence for the policy's writer.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypedDict, get_args

import numpy as np
from numpy.typing import ArrayLike

from ovita.errors import SceneError
from ovita.paths.geometry import Cuboid, Mask, fractions, runs
from ovita.paths.scene import DIRECTIONS, Frame, SceneObject
from ovita.paths.trajectory import Array, arc_length, first_bad, interpolate
from ovita.text import shortened

if TYPE_CHECKING:
    from ovita.toolkit.catalogue import Recorder

HIDDEN = frozenset({"frame", "recorder"})
"""Parameters that the runtime fills in and a policy never sees."""

RARE = frozenset({"angle", "blend", "brake", "ease", "hold", "nearest", "ramp", "reach", "seed", "smooth", "width"})
"""Parameters with defaults that a prompt leaves out to stay short; the page has them all."""

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


def is_shipped(function: Callable[..., Any]) -> bool:
    """Whether an operation is ovita's own, not that of a plug-in."""
    return function.__module__.startswith("ovita.")


@functools.cache
def public(function: Callable[..., Any]) -> inspect.Signature:
    """An operation's signature with the direction words spelled out, and without what the runtime fills in."""
    whole = spelled_out(inspect.signature(function))
    return whole.replace(parameters=[p for p in whole.parameters.values() if p.name not in HIDDEN])


@functools.cache
def _taken(function: Callable[..., Any]) -> tuple[tuple[str, ...], frozenset[str]]:
    """Which of a function's parameters the runtime fills in, and the names of the others."""
    return tuple(HIDDEN & inspect.signature(function).parameters.keys()), frozenset(public(function).parameters)


def _plain(default: Any) -> str:
    return f"{default:g}" if isinstance(default, float) else repr(default)


def invoked(
    function: Callable[..., Any], args: Sequence[Any], kwargs: Mapping[str, Any], frame: Frame, recorder: Recorder
) -> Any:
    """What an operation returns that knows the frame and the recorder.

    Raises:
        ValueError: If the call does not fit the operation's signature, which it shows; and whatever it raises itself.
    """
    hidden, known = _taken(function)
    if not kwargs.keys() <= known:
        _bind(function, args, kwargs)
    context = {"frame": frame, "recorder": recorder}
    try:
        return function(*args, **kwargs, **{name: context[name] for name in hidden})
    except TypeError:
        _bind(function, args, kwargs)
        raise


def _bind(function: Callable[..., Any], args: Sequence[Any], kwargs: Mapping[str, Any]) -> None:
    """Check that a call fits a signature, which takes long; what does not is a ValueError that shows it."""
    try:
        public(function).bind(*args, **kwargs)
    except TypeError as error:
        raise ValueError(f"{function.__name__}: {error}; call it as {written(function, spelled=True)}") from None


def written(function: Callable[..., Any], *, spelled: bool = False, brief: bool = False, short: bool = False) -> str:
    """A call as a policy writes it, such as "move(traj, *, OFFSET, where=None, ...)".

    Args:
        function: An operation.
        spelled: Write the direction words out, instead of one OFFSET for all.
        brief: For a prompt: optional parameters are marked with "?" and rare ones left out.
        short: Write "name?" where the default is None, and no "*".
    """
    parts: list[str] = []
    for parameter in public(function).parameters.values():
        optional = parameter.default is not parameter.empty
        if brief and optional and parameter.name in RARE:
            continue
        if not (brief or short) and parameter.kind is parameter.KEYWORD_ONLY and "*" not in parts:
            parts.append("*")
        if parameter.name in DIRECTIONS and not spelled:
            if "OFFSET" not in parts:
                parts.append("OFFSET")
        elif not optional:
            parts.append(parameter.name)
        else:
            bare = brief or (short and parameter.default is None)
            parts.append(f"{parameter.name}?" if bare else f"{parameter.name}={_plain(parameter.default)}")
    return f"{function.__name__}({', '.join(parts)})"


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


def core_of(target: Target, positions: Array, of: str = "centre") -> Cuboid:
    """What a path (N, 3) is closer to or farther from: a point, an object's centre, or the middle of a wide one."""
    if isinstance(target, SceneObject):
        return target.core(positions, of)
    return Cuboid(point(target), np.eye(3), np.zeros(3))


ROUNDING = 1e-9
"""Weights nearer than this to 0 or 1 are taken for it."""

GENTLE = 3.0
"""Length of a blend per metre of shift. As smoothstep is at most 1.5 times as steep as a line, a path that is pushed
back along its own heading still goes forward, and one that is pushed aside turns by no more than 27 degrees."""


def smoothstep(x: Array) -> Array:
    """The cubic 3x^2 - 2x^3 of x clipped to [0, 1]; flat at both ends."""
    t = snapped(x)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def snapped(x: Array) -> Array:
    """Clip x to [0, 1]; what rounding keeps from 0 or 1 becomes exactly that, so that edges are bit-identical."""
    return np.where(x < ROUNDING, 0.0, np.where(x > 1.0 - ROUNDING, 1.0, x))


def eased(mask: Mask, positions: Array, ease: float | None, shift: float = 0.0) -> Array:
    """Weights (N,) that are 0 outside a mask and rise to 1 inside it; each unbroken run has a waypoint of weight 1.

    Args:
        mask: (N,).
        positions: (N, 3) [m].
        ease: Length of a rise as a fraction of the path's length, shortened to half of a short run; 0 for a jump. None
            for 3 times the shift, shortened so that at least half of the run has weight 1. The start and the goal of
            the path are no edges of a mask, so there is no rise there.
        shift: How far the edit moves a waypoint [m].
    """
    weights = mask.astype(np.float64)
    s = arc_length(positions)
    if ease == 0.0 or s[-1] == 0.0:
        return weights
    last = len(mask) - 1
    for a, b in runs(mask):
        before, after = s[max(a - 1, 0)], s[min(b + 1, last)]
        edges = int(a > 0) + int(b < last)
        wanted, most = (GENTLE * shift, 2 * max(edges, 1)) if ease is None else (ease * s[-1], 2)
        span = min(wanted, (after - before) / most)
        if span <= 0.0:
            continue
        inside = slice(a, b + 1)
        if a > 0:
            weights[inside] = np.minimum(weights[inside], smoothstep((s[inside] - before) / span))
        if b < last:
            weights[inside] = np.minimum(weights[inside], smoothstep((after - s[inside]) / span))
        peak = float(weights[inside].max())
        # Between repeats of a waypoint there is no room for a rise.
        weights[inside] = weights[inside] / peak if peak > 0.0 else 1.0
    return weights


def blended(rows: Array, target: Array, selected: Mask, ease: float | None) -> Array:
    """Rows whose selected waypoints go to a target (N, 3) [m], in full inside a run and less toward its edges.

    Args:
        rows: (N, 3+); what is not selected stays as it is.
        target: (N, 3) [m].
        selected: (N,).
        ease: As for `eased`.
    """
    shift = target - rows[:, :3]
    most = float(np.linalg.norm(shift[selected], axis=1).max()) if selected.any() else 0.0
    weights = eased(selected, rows[:, :3], ease, most)
    full, part = weights == 1.0, (weights > 0.0) & (weights < 1.0)
    rows[full, :3] = target[full]
    rows[part, :3] += weights[part, None] * shift[part]
    return rows


def followed(rows: Array, moved: Array, selected: Mask, ease: float | None) -> Array:
    """Rows of which a part went elsewhere, with the neighbours of that part following; start and goal never follow.

    Args:
        rows: (N, 3+) before; they are changed.
        moved: (N, 3) [m] where the selected waypoints are now; they get there in full.
        selected: (N,).
        ease: Length over which the shift at an edge of the part fades out, as a fraction of the path's length; 0 for a
            jump, None for 3 times the shift.
    """
    s, last = arc_length(rows[:, :3]), len(rows) - 1
    shift, edges = moved - rows[:, :3], list(runs(selected))
    borders = [0, *(index for edge in edges for index in edge), last]
    follow = np.zeros_like(shift)
    for k, (a, b) in enumerate(edges):
        for edge, border in ((a, borders[2 * k]), (b, borders[2 * k + 3])):
            size = float(np.linalg.norm(shift[edge]))
            # Between two parts, each has half of the way for its fading.
            room = abs(s[edge] - s[border]) * (1.0 if border in (0, last) and not selected[border] else 0.5)
            span = min(GENTLE * size if ease is None else ease * s[-1], room)
            if span <= 0.0 or size == 0.0:
                continue
            low, high = (border, edge) if border < edge else (edge + 1, border + 1)
            outside = np.arange(low, high)
            follow[outside] += smoothstep(1.0 - np.abs(s[outside] - s[edge]) / span)[:, None] * shift[edge]
    beside = ~selected & (follow != 0.0).any(axis=1)
    beside[[0, last]] = False
    rows[beside, :3] += follow[beside]
    rows[selected, :3] = moved[selected]
    return rows


def headings(positions: Array) -> Array:
    """Unit vectors (N, 3) of the local path direction (central difference); zero where the path does not move."""
    n = len(positions)
    i = np.arange(n)
    steps = positions[np.minimum(i + 1, n - 1)] - positions[np.maximum(i - 1, 0)]
    lengths = np.linalg.norm(steps, axis=1, keepdims=True)
    return np.asarray(np.divide(steps, lengths, out=np.zeros_like(steps), where=lengths > 0))


def perpendicular(directions: Array) -> Array:
    """Unit vectors (N, 3) perpendicular to directions (N, 3), horizontal where the direction is not vertical."""
    sideways = np.cross(directions, np.array([0.0, 0.0, 1.0]))
    lengths = np.linalg.norm(sideways, axis=1, keepdims=True)
    usual = np.divide(sideways, lengths, out=np.zeros_like(sideways), where=lengths > 1e-9)
    return np.where(lengths > 1e-9, usual, np.array([1.0, 0.0, 0.0]))


def final_heading(positions: Array) -> Array:
    """Unit vector (3,) of the last segment that has a length.

    Raises:
        ValueError: If the path has no length.
    """
    steps = np.diff(positions, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    moving = np.flatnonzero(lengths > 0)
    if not len(moving):
        raise ValueError("all waypoints of the trajectory are at one point, so it has no heading")
    return np.asarray(steps[moving[-1]] / lengths[moving[-1]])
