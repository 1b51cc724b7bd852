"""Steps past objects: on which side, or neither over them, nor under them, nor between two."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ovita.instruct import frames as F
from ovita.instruct.builder import PolicyBuilder, argument, short
from ovita.instruct.degrees import nice
from ovita.instruct.object_steps import beyond, kept_clear, surface_distance, through
from ovita.instruct.path_steps import OF
from ovita.paths.geometry import closest_to_point, runs
from ovita.paths.scene import OPPOSITE, SceneObject, side_passed
from ovita.paths.trajectory import Array, arc_length
from ovita.toolkit.approach import extent
from ovita.toolkit.avoidance import shut


def avoid(builder: PolicyBuilder, frame: F.Avoid) -> None:
    """Neither over objects, nor under them, or not between two."""
    items = [builder.scene[name] for name in frame.objects]
    if frame.relation == "between":
        first, second = items[:2]
        _avoid(builder, frame, f"{first.name} and {second.name}", first, second)
        return
    for item in items:
        _avoid(builder, frame, item.name, item)


def _avoid(
    builder: PolicyBuilder, frame: F.Avoid, names: str, item: SceneObject, other: SceneObject | None = None
) -> None:
    """Around what a path must not pass over or under, or between."""
    both = [item] if other is None else [item, other]
    wide = builder.scale.step("moderate") if other is None and item.dimensions is None else 0.0  # a size as is usual
    usual = max(builder.tolerance, wide, *map(builder.room, both))
    gap = builder.length(None, usual, f"the distance kept beside {names}")
    name = builder.knob("gap", gap, "at_least", f"distance beside {names}", "by", direction="away")
    bodies = shut(frame.relation, item, other, gap, builder.positions, builder.scene.frame)
    way = f"{frame.relation!r}, {', '.join(map(builder.ref, both))}, gap={name}"
    builder.add(
        f"traj = avoid(traj, {way})",
        f"Pass beside {names}, {gap:g} m off, instead of {frame.relation}.",
        f"expect_avoided({way})",
        holds=min(body.closest(builder.positions)[0] for body in bodies) >= 0.0,
    )


def side(builder: PolicyBuilder, frame: F.Side) -> None:
    """Pass objects on one side; stay there where the ends do, unless another request leads the path elsewhere."""
    where, part = builder.part(frame.part)
    for item in map(builder.scene.__getitem__, frame.objects):
        word = _other_side(builder, item) if frame.direction == "other" else builder.word(frame.direction)
        axis = builder.axis(word)
        half, ref, words = extent(item, axis), builder.ref(item), f"{OF[word]} {item.name}"
        if word in ("front", "back") and frame.direction != "other":
            builder.assume(f"{words} is {_axis_name(axis)} of it, by the scene's frame")
        reach, gap = (builder.positions - item.position) @ axis, _side_gap(builder, item)
        stays = frame.direction != "other" and min(reach[0], reach[-1]) >= half + gap and builder.moving <= 1
        passes = not where and (frame.direction == "other" or not (frame.along or stays))
        if passes:  # no nearer than it passes now, as far as that goes
            gap = max(gap, nice(min(_clear_now(builder, item), builder.scale.step("moderate"))))
        gap = builder.length(frame.by, gap, f"the distance kept {words}")
        name = builder.knob("gap", gap, "at_least", f"distance {words}", "by", about=item.name, direction=word)
        if passes:
            _pass_beside(builder, item, word, gap, name)
            continue
        builder.add(
            f"traj = stay_on(traj, {ref}, {word!r}, gap={name}{argument(where)})",
            f"Stay {words} by at least {gap:g} m{part}.",
            f"expect_side({word!r}, {name}, of={ref}{argument(where)})",
            holds=not where and bool((reach >= half + gap).all()),
        )


def _clear_now(builder: PolicyBuilder, item: SceneObject) -> float:
    """How far from an object the path passes, or what is clear of it at least [m]."""
    return max(surface_distance(item, builder.positions), CLEAR * builder.scale.extent)


def _side_gap(builder: PolicyBuilder, item: SceneObject) -> float:
    """The usual distance from the side of an object on which a path passes or stays [m]."""
    least = min(builder.scale.step("slight"), nice(_clear_now(builder, item)))
    return max(least, builder.room(item), *_kept_from(builder, item))


def _pass_beside(builder: PolicyBuilder, item: SceneObject, word: str, gap: float, name: str) -> None:
    """Bend the path past an object on one side, so far from it; `name` is the parameter of that.

    Where a bend would cut through the object, or be a detour, it goes around it by the shortest way there is.
    """
    axis, ref, before = builder.axis(word), builder.ref(item), builder.positions
    half, level = extent(item, axis), _level(builder, item, word)
    plan = f"Bend the path so that it passes {OF[word]} {item.name}, {gap} m from its side; start and goal stay."
    place = f", {word}={beyond(name, half)}{level}"
    there = _nearest_pass(builder, item, axis * (half + gap))
    room = nice(gap / 2) if _kept_from(builder, item) else 0.0  # it may be pushed further out
    within = max(builder.tolerance, room)
    bent = builder.after(f"go_through(traj, {ref}, {word}={half + gap:g}{level}{there})")
    if word not in ("up", "down") and builder.moving <= 1 and _is_poor(bent, before, item):
        taut = builder.after(f"go_round(traj, {ref}, {word!r}, gap={gap:g})")
        rise = (builder.passing(item.position) - item.position) @ builder.axis("up")
        beside = item.position + axis * (half + gap) + rise * builder.axis("up")
        if _is_better(taut, bent, before, item, gap) and closest_to_point(taut, beside)[0] <= gap:
            plan = f"Go around {item.name}, {OF[word]} it and {gap:g} m off; start and goal stay."
            promise = f"expect_visits({ref}, within={name}{place})"
            builder.add(f"traj = go_round(traj, {ref}, {word!r}, gap={name})", plan, promise, ends=builder.stay())
            return
    through(builder, ref, plan, place, f"expect_visits({ref}, within={within}{place})", there)
    if 0.0 < surface_distance(item, builder.positions) < NIPPED * gap:  # a long thing's corner
        builder.add(f"traj = keep_distance(traj, {ref}, at_least={short(NIPPED * gap):g})")


def _is_poor(bent: Array, before: Array, item: SceneObject) -> bool:
    """Whether a bend (N, 3) of a path (N, 3) past an object may be worse than a way around: longer, or through it."""
    return surface_distance(item, bent) <= 0.0 or _is_detour(bent, before)


def _is_better(taut: Array, bent: Array, before: Array, item: SceneObject, gap: float) -> bool:
    """Whether a taut way (N, 3) around an object is there, and a bend (N, 3) cuts through it or is a detour."""
    there = not np.array_equal(taut, before) and surface_distance(item, taut) >= NIPPED * gap
    return there and (surface_distance(item, bent) <= 0.0 or _is_detour(bent, taut))


def _is_detour(path: Array, other: Array) -> bool:
    """Whether a path (N, 3) is much longer than another one."""
    return float(arc_length(path)[-1]) > DETOUR * float(arc_length(other)[-1])


DETOUR = 1.15
"""How many times as long as another way a detour is."""


def _axis_name(axis: Array) -> str:
    """A direction along an axis of the scene: "+y"."""
    k = int(np.abs(axis).argmax())
    return f"{'+' if axis[k] > 0 else '-'}{'xyz'[k]}"


def _nearest_pass(builder: PolicyBuilder, item: SceneObject, aside: Array) -> str:
    """The argument that has the path's nearest pass by an object go aside (3,) [m] of it; "" where that would go."""
    path = builder.positions
    gap, level = item.distance(path), item.position + aside
    up = builder.axis("up")
    there = int(np.argmin(np.linalg.norm((path - level) - ((path - level) @ up)[:, None] * up, axis=1)))
    near = gap <= BY_IT * gap.min()
    if near[there]:
        return ""
    first, last = next(run for run in runs(near) if run[0] <= gap.argmin() <= run[1])
    return f", among=between(traj, {first}, {last})"


BY_IT = 1.25
"""How many times as far off as the nearest a waypoint may be to belong to a pass by an object."""

NIPPED = 0.75
"""The share of the gap beside a thing that the path keeps from its corners."""

CLEAR = 0.03
"""The least share of the path's extent that it keeps beside what it is to pass."""


def _other_side(builder: PolicyBuilder, item: SceneObject) -> str:
    """The direction word of the side of an object on which the path does not pass; asks where it passes over it."""
    now = side_passed(builder.scene.frame, builder.positions, item.position)
    if not now:
        builder.ask(f"The path passes right over {item.name}: on which side of it should it pass?")
        return "left"
    builder.assume(f"the other side of {item.name} is {OF[OPPOSITE[now]]} it; the path passes {OF[now]} it now")
    return OPPOSITE[now]


def _kept_from(builder: PolicyBuilder, item: SceneObject) -> list[float]:
    """What other requests keep from an object, and as much again by a quarter for the bend around it [m]."""
    return [nice(1.25 * distance) for distance in kept_clear(builder, item)]


def _level(builder: PolicyBuilder, item: SceneObject, word: str) -> str:
    """The arguments of an offset that keep the height at which the path passes an object."""
    rise = float((builder.passing(item.position) - item.position) @ builder.axis("up"))
    return "" if abs(rise) < 1e-6 or word in ("up", "down") else f", {'up' if rise > 0 else 'down'}={abs(rise):.6g}"


SIDE_STEPS: Mapping[type[F.SemanticFrame], Callable[..., None]] = {F.Side: side, F.Avoid: avoid}
