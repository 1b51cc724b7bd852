"""Bring a path closer to an object or take it farther away, pass through it, jump over it, wait above it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.geometry import Cuboid, Mask, fractions, is_level, lengths, on_the_ground, runs
from ovita.paths.scene import RFU, Frame, SceneObject
from ovita.paths.trajectory import Array, arc_length, interpolate
from ovita.toolkit import arguments
from ovita.toolkit.arguments import ROUNDING, Aim, Offset, Target, followed, headings, perpendicular, smoothstep
from ovita.toolkit.catalogue import Recorder, note_contact, operation
from ovita.toolkit.insertion import densified
from ovita.toolkit.speed import dwell, stop_at
from ovita.toolkit.ways_around import kept_out, pushed_out

GENTLEST = 3.0
"""Reach per metre of push, unless another reach is asked for: what is farther off has no part in it."""

NEAREST = 0.25
"""The share of a path that is near a place, and so goes farther from it, however small the push."""

STEEPEST = 1.125
"""Reach per metre of push above which no waypoint overtakes the nearest: the maximum of smoothstep(x) / x."""

SURFACE_GAP = 0.01
"""How near "closer" comes to an object's surface, unless another gap is asked for [m]: the limits' standard margin."""

PER_SLOPE = 4.0
"""The fewest segments on the rise or the fall of a jump."""

HOVER_BRAKE = 0.05
"""Share of the path's length over which the robot brakes to wait above an object, and speeds up again."""

SHORTEST = 0.01
"""Share of the path's length below which no segment is divided for a jump."""

LEAST_ROOM = 0.25
"""Share of the path's length from both ends at which there is always room for a jump."""


@operation("Objects: come closer, stay away, pass", core=True)
def closer(
    traj: ArrayLike,
    obj: Target,
    by: float,
    *,
    reach: float | None = None,
    gap: float = SURFACE_GAP,
    where: ArrayLike | None = None,
    ease: float | None = None,
    hold: str | Sequence[str] | None = None,
    frame: Frame = RFU,
) -> Array:
    """Pull the nearest part of the path toward an object by so many metres, never into it.

    The pull is `by` at the nearest waypoint and fades to 0 where the distance to the centre is `reach` larger. If a
    segment would come nearer to an object's surface than the gap, the whole pull is less. A level path stays level as
    long as it can come so close in its plane, and always on the ground. Start, goal and stops move only if they are
    about the nearest, or right beside it. On a part, the waypoints beside it follow, over 3 times the shift at its
    edge.

    Args:
        obj: Object or point (3,) [m], whose centre counts; of a wide object, and of an upright one beside a level
            path, the middle of its body. Without dimensions it is a cube of 5 cm, or less where the path is so near.
        by: [m], >= 0.
        reach: [m], > 0; by default half of the spread of the waypoints' distances, at least the object's radius.
        gap: Least distance to the object's surface [m], >= 0; to touch it, use go_through, move_goal or continue_to.
    """
    rows = arguments.waypoints(traj)
    core, pull = arguments.core_of(obj, rows[:, :3]), arguments.number(by, "by", low=0.0)
    space, selected = arguments.number(gap, "gap", low=0.0), arguments.mask(where, len(rows))
    away, distance = _polar(rows, core)
    weights = _nearness(distance, selected, reach, shortest=radius_of(obj))
    beside = (distance > distance[selected].min(initial=np.inf) + ABOUT_NEAREST * pull) & (where is None)
    up = frame.direction("up")
    across = np.abs(away @ up)
    least = np.zeros(len(rows))
    if isinstance(obj, SceneObject) and (frame.level is not None or on_the_ground(rows[:, :3], up)):
        least = np.minimum(across, distance)
    if not is_level(rows[:, :3], up) or (np.maximum(distance - pull * weights, least) < across).any():
        aim = np.maximum(distance - pull * weights * _between_stays(rows, weights, beside, pull), least)
        ratio = np.divide(aim, distance, out=np.ones_like(aim), where=distance > 0.0)
        shift = away * (ratio - 1.0)[:, None]
    else:
        # Under or over the object a little of the distance is a long way in the plane: it fades as that way does.
        flat = np.sqrt(np.maximum(distance**2 - across**2, 0.0))
        i = int(np.argmin(np.where(selected, distance, np.inf)))
        way = flat[i] - np.sqrt(max(max(distance[i] - pull * weights[i], least[i]) ** 2 - across[i] ** 2, 0.0))
        faded = way * weights * _between_stays(rows, weights, beside, float(way))
        aim = np.hypot(np.maximum(flat - faded, 0.0), across)
        shift = _level_shift(away, aim, up, rows)
    shift[aim >= distance * (1.0 - ROUNDING)] = 0.0
    shift = _held(shift, hold, frame)
    if isinstance(obj, SceneObject):
        shift *= _short_of(obj.body(rows[:, :3], space), rows[:, :3], shift, space)
    return followed(rows, rows[:, :3] + shift, selected, arguments.share(ease, "ease"))


@operation("Objects: come closer, stay away, pass", core=True)
def farther(
    traj: ArrayLike,
    obj: Target,
    by: float | None = None,
    *,
    times: float | None = None,
    reach: float | None = None,
    where: ArrayLike | None = None,
    ease: float | None = None,
    hold: str | Sequence[str] | None = None,
    frame: Frame = RFU,
) -> Array:
    """Push the nearest part away from an object by metres, or times=2: double all distances.

    The push is `by` at the nearest part, between waypoints too, and fades to 0 where the distance is `reach` larger. A
    level path stays level, and none goes under the ground, z = 0: it is pushed aside only, then. Start, goal and stops
    move only if they are about the nearest. On a part, those beside it follow, over 3 times the shift at its edge.

    Args:
        obj: Object or point (3,) [m]; distances are to its centre, or as for closer to the middle of its body.
        by: [m], >= 0.
        times: Factor >= 1 on the distance of every selected waypoint; exactly one of by and times is given.
        reach: [m], > 0; by default 3 times `by`, or as far as the nearest quarter of the path, but no less than 1.125
            `by`, so that no waypoint ends up nearer than `by` beyond the nearest, nor than the object's radius.
    """
    rows = arguments.waypoints(traj)
    core, selected = arguments.core_of(obj, rows[:, :3]), arguments.mask(where, len(rows))
    if (by is None) == (times is None):
        raise ValueError("give exactly one of by (metres) and times (a factor)")
    away, distance = _polar(rows, core)
    up = frame.direction("up")
    level = is_level(rows[:, :3], up)
    if times is not None:
        aim = distance * arguments.number(times, "times", low=1.0)
    else:
        amount = arguments.number(by, "by", low=0.0)
        weights = _nearness(distance, selected, reach, GENTLEST * amount, max(STEEPEST * amount, radius_of(obj)))
        if where is None:
            about = distance <= distance[selected].min(initial=np.inf) + ABOUT_NEAREST * amount
            weights *= _between_stays(rows, weights, ~about)
        aim = distance + amount * weights

    def pushed(level: bool) -> Array:
        if level:
            shift = _level_shift(away, aim, up, rows)
        else:
            outward = np.divide(away, distance[:, None], out=np.zeros_like(away), where=distance[:, None] > 1e-9)
            outward = np.where(distance[:, None] > 1e-9, outward, perpendicular(headings(rows[:, :3])))
            shift = outward * (aim - distance)[:, None]
        shift[aim <= distance] = 0.0
        moved = rows[:, :3] + _held(shift, hold, frame)
        if times is None and not hold and selected.any():
            least = nearest(rows[:, :3], selected, core) + amount
            moved = pushed_out(moved, [replace(core, radius=least)], selected, up if level else None)
        return moved

    moved = pushed(level)
    under = float((moved @ up).min()) < -ROUNDING <= float((rows[:, :3] @ up).min())
    moved = pushed(True) if under and not level else moved
    return followed(rows, moved, selected, arguments.share(ease, "ease"))


@operation("Objects: come closer, stay away, pass", core=True)
def keep_distance(
    traj: ArrayLike,
    obj: Target | Sequence[Target],
    at_least: float | None = None,
    at_most: float | None = None,
    *,
    where: ArrayLike | None = None,
    ease: float | None = None,
    frame: Frame = RFU,
) -> Array:
    """Bend the path around an object or a list of them: metres at_least from the surface, at_most from the centre.

    The distance holds on the whole path, between waypoints too, and no more than that is kept: a stretch that comes too
    near is shifted in the direction in which it is out soonest, clear of all the objects, until it passes at just that
    distance. The path before and behind it follows, over about 3 times the shift; where an end is too near for that, it
    goes straight for the object and lies against it, as a rubber band. A level path stays level, and none goes under
    the ground, z = 0. A start or goal that is too near moves too. On a part, the waypoints beside it follow in the same
    way.

    Args:
        obj: Object or point (3,) [m], or a list of them.
        at_least: [m], >= 0, from the surface of an object with dimensions, else from the centre.
        at_most: [m], >= 0, from the centre.
        where: Mask (N,), or None for all waypoints; waypoints that already comply move only to follow.
    """
    rows = arguments.waypoints(traj)
    targets = _targets(obj)
    selected = arguments.mask(where, len(rows))
    if at_least is None and at_most is None:
        raise ValueError("give at_least or at_most in metres")
    gap = 0.0 if at_least is None else arguments.number(at_least, "at_least", low=0.0)
    up, moved = frame.direction("up"), rows[:, :3].copy()
    level = is_level(moved, up)
    if at_most is not None:
        outer = arguments.number(at_most, "at_most", low=0.0)
        for target in targets:
            inner = gap + _thickness(target) if at_least is not None else 0.0
            if outer < inner:
                raise ValueError(f"at_most {outer:g} m from the centre contradicts at_least, which needs {inner:g} m")
            away, distance = _polar(rows, arguments.core_of(arguments.point(target), rows[:, :3]))
            level &= bool((np.abs(away @ up) <= outer).all())
            beyond = selected & (distance > outer)
            shift = away * (np.minimum(outer / np.maximum(distance, 1e-300), 1.0) - 1.0)[:, None]
            if level:
                shift = _level_shift(away, np.minimum(distance, outer), up, rows)
            moved[beyond] = rows[beyond, :3] + shift[beyond]
    if at_least is not None and not all(_clear(target, moved, selected, gap) for target in targets):
        bodies = [around(target, gap) for target in targets]
        around_them = kept_out(moved, bodies, selected, up if level else None)
        under = float((around_them @ up).min()) < -ROUNDING <= float((moved @ up).min())
        moved = kept_out(moved, bodies, selected, up) if under else around_them
    return followed(rows, moved, selected, arguments.share(ease, "ease"))


@operation("Objects: come closer, stay away, pass")
def pass_at(
    traj: ArrayLike,
    obj: Target,
    distance: float,
    *,
    reach: float | None = None,
    where: ArrayLike | None = None,
    ease: float | None = None,
    frame: Frame = RFU,
) -> Array:
    """Pass an object at just so many metres at the nearest point: pull or push only the nearest part.

    Which waypoints move, and how they are followed, is as in closer and farther. Promise it by expect_distance with
    the same number as nearest.

    Args:
        distance: [m], > 0, from the surface of an object with dimensions, else from the centre.
        reach: [m], > 0; how much farther than the nearest waypoint the others may be to move, too; by default as there.
    """
    rows = arguments.waypoints(traj)
    asked, selected = arguments.positive(distance, "distance"), arguments.mask(where, len(rows))
    if not selected.any():
        return rows
    now = passes_at(obj, rows[:, :3], selected)
    if abs(now - asked) <= ROUNDING:
        return rows

    def passed(by: float) -> Array:
        if now > asked:
            return closer(rows, obj, by, reach=reach, gap=0.0, where=where, ease=ease, frame=frame)
        return farther(rows, obj, by, reach=reach, where=where, ease=ease, frame=frame)

    # A pull ends in the centre; a push by the whole distance, and by the size of the object, is enough.
    low, high = 0.0, now + radius_of(obj) if now > asked else asked + 2.0 * radius_of(obj)
    for _ in range(40):
        middle = (low + high) / 2.0
        enough = (passes_at(obj, passed(middle)[:, :3], selected) - asked) * (now - asked) <= 0.0
        low, high = (low, middle) if enough else (middle, high)
    return passed(high)


@operation("Objects: come closer, stay away, pass")
def stop_before(traj: ArrayLike, obj: Target, distance: float, *, brake: float = 0.15, frame: Frame = RFU) -> Array:
    """Stop so many metres before an object and end there.

    It is where the path first comes so near; one that passes farther off is pulled so near before, as by pass_at.
    Promise it by expect_distance with the same number as nearest, and expect_stop.

    Args:
        traj: (N, 4); what comes after the stop is left out.
        distance: [m], > 0, from the surface of an object with dimensions, else from the centre.
        brake: Braking distance as a fraction (0..1) of the path's length.
    """
    before, _ = _parted(arguments.waypoints(traj), obj, arguments.positive(distance, "distance"), frame)
    return stop_at(before, "goal", brake=brake)


@operation("Objects: come closer, stay away, pass")
def wait_before(traj: ArrayLike, obj: Target, distance: float, steps: int = 10, *, frame: Frame = RFU) -> Array:
    """Wait so many metres before an object for so many steps of 0.1 s, then go on.

    It is where the path first comes so near; one that passes farther off is pulled so near before, as by pass_at.
    Promise it by expect_stop with the same number as before.

    Args:
        traj: (N, 4); the result has a waypoint more and one for each step.
        distance: [m], > 0, from the surface of an object with dimensions, else from the centre.
        steps: Timesteps to wait, >= 1.
    """
    before, behind = _parted(arguments.waypoints(traj), obj, arguments.positive(distance, "distance"), frame)
    return dwell(np.concatenate([before, behind]), len(before) - 1, steps)


def _parted(rows: Array, obj: Target, asked: float, frame: Frame) -> tuple[Array, Array]:
    """A path up to where it first comes so near to an object, a waypoint there included, and what is left of it."""

    def until(at: float) -> Array:
        whole = int(at)
        return np.concatenate([rows[: whole + 1], interpolate(rows, np.array([at]))[: int(at > whole)]])

    def near(at: float) -> bool:
        path = until(at)[:, :3]
        return passes_at(obj, path, np.ones(len(path), dtype=bool)) <= asked + ROUNDING

    if near(0.0):
        raise ValueError(f"the path starts within {asked:g} m already: it cannot stop before that")
    low, high = 0.0, float(len(rows) - 1)
    if not near(high):
        rows = pass_at(rows, obj, asked, frame=frame)
    for _ in range(40):
        middle = (low + high) / 2.0
        low, high = (low, middle) if near(middle) else (middle, high)
    return until(high), rows[int(high) + 1 :]


def passes_at(target: Target, positions: Array, selected: Mask) -> float:
    """How near a path (N, 3) or a part of it comes to a surface, or to a centre without dimensions [m]; < 0 inside."""
    if not isinstance(target, SceneObject) or target.dimensions is None:
        return nearest(positions, selected, arguments.core_of(arguments.point(target), positions))
    inner = np.flatnonzero(selected[:-1] & selected[1:])
    between = target.cuboid.along(positions[inner], positions[inner + 1])[0] if len(inner) else np.array([np.inf])
    return float(min(target.cuboid.signed(positions[selected])[0].min(), between.min()))


def _clear(target: Target, positions: Array, selected: Mask, gap: float) -> bool:
    """Whether a path, or a part of it, keeps a gap [m] already."""
    return not selected.any() or passes_at(target, positions, selected) >= gap - ROUNDING


def around(target: Target, gap: float) -> Cuboid:
    """All that is nearer than a gap [m] to an object's surface, or to a centre without dimensions."""
    if not isinstance(target, SceneObject) or target.dimensions is None:
        return Cuboid(arguments.point(target), np.eye(3), np.zeros(3), gap)
    return replace(target.cuboid, radius=gap)


def _thickness(target: Target) -> float:
    """The least distance of an object's centre to its surface [m]; 0 for what has no dimensions."""
    return float(target.size.min()) / 2.0 if isinstance(target, SceneObject) and target.dimensions is not None else 0.0


def _level_shift(away: Array, aim: Array, up: Array, rows: Array) -> Array:
    """Horizontal displacements (N, 3) that bring waypoints `away` from a centre to distances `aim` (N,) [m]."""
    height = away @ up
    flat = away - height[:, None] * up
    distance = lengths(flat)[:, None]
    course = perpendicular(headings(rows[:, :3]))
    course -= (course @ up)[:, None] * up
    outward = np.where(distance > 1e-9, flat / np.maximum(distance, 1e-9), course)
    wanted = np.sqrt(np.maximum(aim**2 - height**2, 0.0))
    return np.asarray((wanted[:, None] - distance) * outward)


def _short_of(body: Cuboid, positions: Array, shift: Array, gap: float) -> float:
    """Share of the shifts that a path (N, 3) can make with no segment nearer to a body than a gap [m].

    What is nearer already does not come nearer still. All waypoints make the same share, so that the shape is kept.
    """
    least = np.minimum(body.along(positions[:-1], positions[1:])[0], gap) - 1e-9

    def fits(share: float) -> bool:
        moved = positions + share * shift
        return bool((body.along(moved[:-1], moved[1:])[0] >= least).all())

    low, high = 0.0, 1.0
    if fits(high):
        return high
    for _ in range(30):
        middle = (low + high) / 2.0
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low


def nearest(positions: Array, selected: Mask, core: Cuboid) -> float:
    """Distance [m] of a core to the segments between selected waypoints, and to these."""
    least = float(core.depth(positions[selected]).min())
    for a, b in runs(selected):
        if b > a:
            least = min(least, core.closest(positions[a : b + 1])[0])
    return least


def _held(shift: Array, hold: str | Sequence[str] | None, frame: Frame) -> Array:
    """Displacements (M, 3) without their parts along the held direction words."""
    for word in [hold] if isinstance(hold, str) else (hold or ()):
        axis = arguments.direction(frame, word)
        shift = shift - (shift @ axis)[:, None] * axis
    return shift


@operation("Objects: come closer, stay away, pass")
def go_through(
    traj: ArrayLike,
    at: Target,
    *,
    aim: Aim = "centre",
    width: float = 0.3,
    among: ArrayLike | None = None,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
    **offset: Unpack[Offset],
) -> Array:
    """Bend the path through an object or point plus OFFSET; start and goal stay.

    Args:
        at: Object or point (3,) [m].
        offset: Direction words and metres of it, such as left=0.2.
        width: Fraction (0..1) of the path's length on either side that is bent.
        among: Mask (N,) of the waypoints of which the nearest goes there, or None for all waypoints.
    """
    rows = arguments.waypoints(traj)
    shift = arguments.offset(frame, offset)
    target = arguments.aimed(at, aim, frame, rows[:, :3], shift, "at")
    window = arguments.number(width, "width", low=0.0, high=1.0)
    note_contact(recorder, at, shift)
    i, weights = _jump(rows, target, window, 0.0, "go_through", arguments.mask(among, len(rows)))
    touched = weights > 0.0
    fraction = fractions(rows[:, :3])
    same = fraction == fraction[i]
    rows[touched, :3] += weights[touched, None] * (target - rows[i, :3])
    rows[same, :3] = target
    return rows


@operation("Objects: come closer, stay away, pass")
def hop(traj: ArrayLike, obj: Target, height: float, *, width: float = 0.2, frame: Frame = RFU) -> Array:
    """Jump over an object, so many metres above its top.

    The start and the goal stay. The waypoint nearest to the object comes to lie above it, or, where the object is
    beside an end, the nearest that leaves room to rise and fall; the path rises smoothly, is level over the bounding
    sphere, and falls. What is higher already is not lowered.

    Args:
        traj: (N, 4); where the waypoints are too sparse for the jump, more are inserted.
        obj: Object or point (3,) [m]; without dimensions its top is its centre.
        height: [m], >= 0.
        width: Length of the rise and of the fall as a fraction (0..1) of the path's length.
    """
    rows = arguments.waypoints(traj)
    centre, lift = arguments.point(obj), arguments.number(height, "height", low=0.0)
    share = arguments.number(width, "width", low=0.0, high=1.0)
    up = frame.direction("up")
    top = float(centre @ up) + extent(obj, up) + lift
    length = float(arc_length(rows[:, :3])[-1])
    level = obj.radius / length if isinstance(obj, SceneObject) and length > 0.0 else 0.0
    if length > 0.0:
        step = float(np.clip((share + level) / PER_SLOPE, SHORTEST, 0.25)) * length
        rows, _ = densified(rows, _window(rows, centre, share + level), step)
    i, weights = _jump(rows, centre, share, level, "hop")
    sideways = centre - rows[i, :3]
    sideways -= (sideways @ up) * up
    missing = np.maximum(top - rows[:, :3] @ up, 0.0)
    touched = weights > 0.0
    rows[touched, :3] += (weights[:, None] * (sideways + missing[:, None] * up))[touched]
    return rows


@operation("Objects: come closer, stay away, pass")
def hover(
    traj: ArrayLike,
    obj: Target,
    height: float,
    *,
    aim: Aim = "centre",
    steps: int = 10,
    frame: Frame = RFU,
    recorder: Recorder | None = None,
) -> Array:
    """Bend the path over an object and wait there, so many metres above its centre, or above what aim says.

    The path bends to pass exactly there, and the robot brakes and speeds up again over 5 % of the path; start and goal
    stay. With a height above its centre smaller than the path's, the path goes down there.

    Args:
        traj: (N, 4); the result is (N + steps, 4).
        height: [m]; negative: below.
        steps: Timesteps of 0.1 s to wait, >= 1.
    """
    above = arguments.number(height, "height")
    rows = arguments.waypoints(traj)
    place = arguments.aimed(obj, aim, frame, rows[:, :3], above * frame.direction("up"))
    rows = go_through(rows, obj, up=above, aim=aim, frame=frame, recorder=recorder)
    return dwell(stop_at(rows, place, brake=HOVER_BRAKE, resume=True), place, steps)


def _targets(obj: Any) -> list[Any]:
    """The targets of a list, or the one target; a list of three numbers is a point."""
    listed = isinstance(obj, list | tuple) and any(not isinstance(item, int | float) for item in obj)
    return list(obj) if listed else [obj]


def radius_of(obj: Any) -> float:
    """Radius of an object's bounding sphere [m]; 0 for a point and for an object without dimensions."""
    return obj.radius if isinstance(obj, SceneObject) and obj.dimensions is not None else 0.0


def _polar(rows: Array, core: Cuboid) -> tuple[Array, Array]:
    """Vectors (N, 3) from a core to the waypoints, and their lengths (N,) [m]."""
    distance, outward = core.signed(rows[:, :3])
    return outward * distance[:, None], np.asarray(np.maximum(distance, 0.0))


def _nearness(
    distance: Array, selected: Mask, reach: float | None, longest: float = np.inf, shortest: float = 0.0
) -> Array:
    """Weights (N,) that are 1 at the waypoint nearest to a place, and fade to 0 as far as a pull or push reaches.

    Unless a reach [m] is given, that is `longest`, or as far as the nearest quarter of the path if that is more, at
    most half of the spread of the distances (N,), and at least `shortest`.
    """
    weights = np.zeros(len(distance))
    if reach is not None and arguments.number(reach, "reach", low=0.0) == 0.0:
        raise ValueError("reach must be > 0")
    if not selected.any():
        return weights
    inside = distance[selected]
    wide = max(longest, float(np.quantile(inside, NEAREST) - inside.min()))
    span = max(min(float(np.ptp(inside)) / 2.0, wide), shortest, 1e-9) if reach is None else float(reach)
    weights[selected] = smoothstep(1.0 - (inside - inside.min()) / span)
    return weights


def stays(rows: Array) -> Mask:
    """Mask (N,) of start, goal and stops: waypoints on the way that are repeated at rest."""
    repeats = (np.diff(rows[:, :3], axis=0) == 0.0).all(axis=1)
    repeated = np.concatenate([[False], repeats]) | np.concatenate([repeats, [False]])
    repeated[[0, -1]] = True
    return np.asarray(repeated)


def _between_stays(rows: Array, weights: Array, fixed: Mask, shift: float = 0.0) -> Array:
    """Factors (N,) on weights that let start, goal and stops stay, where a mask (N,) says so.

    Those from which the way to where the shift is full is not longer than the shift [m] go along with it.
    """
    s, factors = arc_length(rows[:, :3]), np.ones(len(rows))
    full = s[weights >= ALL_BUT * weights.max()]
    for place in np.unique(s[stays(rows) & fixed]):
        way = float(np.abs(full - place).min())
        factors *= smoothstep(np.abs(s - place) / max(way, 1e-9)) if way > shift else 1.0
    return factors


ALL_BUT = 0.99
"""The share of the largest weight from which on a waypoint is to have its weight in full."""


ABOUT_NEAREST = 0.25
"""How much farther off than the nearest, as a share of a push, an end or a stop may be to count as the nearest too."""


def extent(obj: Target, direction: Array) -> float:
    """How far an object reaches beyond its centre along a unit vector (3,) [m]; 0 if it has no dimensions."""
    if not isinstance(obj, SceneObject) or obj.dimensions is None:
        return 0.0
    return float(np.abs(direction @ obj.rotation) @ obj.dimensions) / 2.0


def _window(rows: Array, centre: Array, share: float) -> Mask:
    """Mask of the waypoints within a share of the path's length of the one nearest to a point, and one more each."""
    fraction = fractions(rows[:, :3])
    i = int(np.argmin(np.linalg.norm(rows[:, :3] - centre, axis=1)))
    inside = np.flatnonzero(np.abs(fraction - fraction[i]) <= share)
    index = np.arange(len(rows))
    return np.asarray((index >= inside[0] - 1) & (index <= inside[-1] + 1))


def _jump(
    rows: Array, centre: Array, share: float, level: float, name: str, among: Mask | None = None
) -> tuple[int, Array]:
    """The waypoint nearest to a point, of some, ends aside, and the weights (N,) of a jump there.

    They are 1 within `level` of that waypoint, and 0 beyond `share` more, at both ends of the path, and from a stop on
    that is no nearer along the path than the point is to it. The waypoint is twice `level` from both ends, where there
    is one, so that the level part has room.
    """
    fraction = fractions(rows[:, :3])
    inner = np.flatnonzero((fraction > 0.0) & (fraction < 1.0))
    if not len(inner):
        raise ValueError(f"no waypoint lies between start and goal; call resample(traj, 20) before {name}")
    from_end = np.minimum(fraction[inner], 1.0 - fraction[inner])
    roomy = inner[from_end >= min(2.0 * level, LEAST_ROOM)]
    inner = roomy if len(roomy) else inner
    if among is not None and among[inner].any():
        inner = inner[among[inner]]
    i = int(inner[np.argmin(lengths(rows[inner, :3] - centre))])
    gap = fraction - fraction[i]
    aside = float(lengths(centre - rows[i, :3])) / max(float(arc_length(rows[:, :3])[-1]), ROUNDING)
    stops = gap[stays(rows) & (np.abs(gap) >= aside)]
    before, behind = -stops[stops < 0.0].max(initial=-fraction[i]), stops[stops > 0.0].min(initial=1.0 - fraction[i])
    reach = np.minimum(share + level, np.where(gap < 0.0, before, behind))
    flat = np.minimum(level, reach / 2.0)
    slope = reach - flat
    weights = smoothstep(np.divide(reach - np.abs(gap), slope, out=np.zeros_like(gap), where=slope > ROUNDING))
    weights[gap == 0.0] = 1.0
    weights[(fraction == 0.0) | (fraction == 1.0)] = 0.0
    return i, weights
