"""What frames must bring about, as checks that measure the outcome and know nothing of how a policy is written."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Literal

import numpy as np

from ovita.bench.asked_for import PATHLESS, SHARE_UNITS, SHARES, Asked, nearest_to, place_of, shared
from ovita.instruct import frames as F
from ovita.instruct.meaning import canonical
from ovita.measure import predicates as P
from ovita.measure.predicates import Check, asked
from ovita.paths.part import PathPart, both, outside
from ovita.paths.scene import OPPOSITE, Scene, side_passed
from ovita.paths.trajectory import Trajectory
from ovita.toolkit.approach import extent

RECOUNTED = (F.Resample, F.Trim, F.Figure, F.Extend, F.Return, F.Hover)
"""Frames that change which waypoints there are, other than by stopping at one."""

PACING = (F.Pace, F.Wait, F.StopAt, F.Hover)
"""Frames that change the speed."""

LIFTING = (F.Height, F.OneHeight, F.Hop, F.Hover, F.Tilt, F.Trim, F.Extend, F.Smooth, F.Resample)
"""Frames that change heights, or which waypoints there are to compare them at."""


def expected(frames: Sequence[F.SemanticFrame], trajectory: Trajectory, scene: Scene) -> Check:
    """The check that an adaptation does what all frames ask for."""
    case = Asked(tuple(frames), trajectory, scene)
    checks = [check for frame in frames for check in (_CHECKS[type(frame)](case, frame),) if check is not None]
    return P.all_of(*checks) if checks else P.all_of(P.not_(P.same_path(tolerance=-1.0)))


def _amount(frame: F.SemanticFrame) -> Any:
    return {"slight": "little", "large": "much"}.get(frame.degree or "")


def _sorted(words: Mapping[str, float | None]) -> tuple[dict[str, Any], list[str]]:
    """The direction words with their metres, and those without."""
    return {w: v for w, v in words.items() if v is not None}, [w for w, v in words.items() if v is None]


def _ends(case: Asked, frame: F.SemanticFrame) -> list[Check]:
    """That both ends stay, where no other frame moves the path."""
    return [P.starts_at("start"), P.ends_at("goal")] if case.alone(frame) else []


def _each(names: Sequence[str], check: Callable[[str], Check]) -> Check:
    return P.all_of(*map(check, names))


def _shift(case: Asked, frame: F.Shift) -> Check:
    if case.has(F.Rotate):
        return P.not_(P.same_path())
    words, where = case.offset(frame.offset), case.where(frame)
    only = case.alone(frame) and not case.has(*RECOUNTED)
    if where is not None and case.has(F.MoveEnd):
        words = dict.fromkeys(words)  # an end that moves takes the path beside it along
    stated, free = _sorted(words)
    open_ = [P.moved(w, amount=_amount(frame), where=where, only=only and len(words) == 1) for w in free]
    if not stated:
        return P.all_of(*open_)
    stated = {word: case.frames.count(frame) * value for word, value in stated.items()}
    return P.all_of(P.moved(where=where, only=only and not open_, tolerance=0.1 if only else 0.25, **stated), *open_)


def _one_end(case: Asked, frame: F.MoveEnd, end: Any) -> Check:
    place, words = place_of(frame.place, case), case.offset(frame.offset)
    if frame.relation == "to":
        if end == "goal" and case.has(F.Return):
            return P.passes_through(place)
        beside = [asked.end_beside(end, place, word, by=value) for word, value in words.items()]
        return P.all_of(*beside) if beside else P.starts_at(place) if end == "start" else P.ends_at(place)
    if frame.relation:
        by = case.metres(frame.by) if frame.by and frame.by.unit not in SHARE_UNITS else None
        return asked.end_aimed(end, place, "farther" if frame.relation == "away" else "closer", by=by)
    if frame.level is not None and not case.has(F.Shift, F.Rotate, F.Resize):
        return _end_levelled(case, frame, frame.level, end)
    return P.not_(P.same_path()) if case.has(F.Trim, F.StopAt) or frame.level else _end_moved(case, frame, end)


def _end_levelled(case: Asked, frame: F.MoveEnd, level: F.Quantity, end: Any) -> Check:
    """That an end moves up or down to a height: above the ground, an object's top or centre, or below its bottom."""
    up, height = case.scene.frame.direction("up"), case.metres(level) or 0.0
    now = float(case.trajectory.positions[0 if end == "start" else -1] @ up)
    if isinstance(frame.place, str) and frame.place in case.scene.names:
        item = case.scene[frame.place]
        height += float(item.position @ up) + np.sign(height) * extent(item, up)
    return (P.start_moved if end == "start" else P.goal_moved)(up=height - now, only=case.alone(frame))


def _end_moved(case: Asked, frame: F.MoveEnd, end: Any) -> Check:
    moved, alone = P.start_moved if end == "start" else P.goal_moved, case.alone(frame)
    stated, free = _sorted(case.offset(frame.offset))
    open_ = [moved(word, only=alone and not stated and len(free) == 1) for word in free]
    return P.all_of(*open_, *([moved(only=alone and not open_, **stated)] if stated else []))


def _approached(case: Asked, frame: F.Approach, name: str) -> Check:
    where, alone = case.where(frame), case.alone(frame)
    share = frame.by if frame.by and frame.by.unit in SHARE_UNITS else None
    if share and frame.sense == "farther":
        times = share.value if share.unit == "x" and share.value > 1 else 1.0 + share.value
        if where is not None or share.role == "to":
            return P.farther(name, times=times, where=where)
        return P.all_of(P.farther(name), P.min_distance(name, times * case.gap(name)))
    if where is not None:
        return asked.part_approached(name, frame.sense, where=where)
    by, amount = case.metres(frame.by), _amount(frame) if alone else None
    if share:
        by = _nearer(share) * case.gap(name)
    aimed = alone and len(frame.objects) == 1
    judged = P.closer if frame.sense == "closer" else P.farther
    exactly = aimed and case.frames.count(frame) == 1
    return judged(name, by=by if exactly else None, amount=amount, after=case.shift() or None, aimed=aimed)


def _nearer(q: F.Quantity) -> float:
    """The share of a distance that "by 30 %", "half as far" and "twice as near" take away."""
    if q.unit == "%":
        return q.value
    return 1 - 1 / q.value if q.value > 1 else 1 - q.value


def _clearance(case: Asked, frame: F.Clearance) -> Check:
    value, where = frame.distance.value, case.where(frame)
    passes = {
        "at_most": partial(asked.passes_at, at_most=value, where=where),
        "at": partial(asked.passes_at, at_most=value, at_least=value, where=where),
    }
    return _each(frame.objects, passes.get(frame.distance.role, partial(P.min_distance, at_least=value, where=where)))


def _visit(case: Asked, frame: F.Visit) -> Check:
    if frame.relation == "between":
        return P.passes_between(*frame.objects[:2], level=any(map(F.tells_height, case.frames)))
    if frame.relation == "at":
        return _each(frame.objects, P.passes_through)
    word, q = ("up" if frame.relation == "over" else "down"), frame.by
    exactly = q is not None and q.role != "at_least"
    return _each(frame.objects, partial(asked.passes_beyond, direction=word, by=case.metres(q), exactly=exactly))


def _avoid(case: Asked, frame: F.Avoid) -> Check:
    if frame.relation == "between":
        return asked.not_between(*frame.objects[:2])
    return _each(frame.objects, partial(asked.not_beyond, direction="up" if frame.relation == "over" else "down"))


def _beside(case: Asked, frame: F.Side, name: str) -> Check:
    """On the side that is named, or on the other one than now."""
    if frame.direction != "other":
        return asked.passes_beside(name, case.word(frame.direction))
    now = side_passed(case.scene.frame, case.trajectory.positions, case.scene[name].position)
    return asked.passes_beside(name, OPPOSITE.get(now, "left"))


def _hop(case: Asked, frame: F.Hop) -> Check:
    over = partial(asked.passes_beyond, direction="up", by=case.metres(frame.by))
    return P.all_of(_each(frame.objects, over), *([] if case.has(F.StopAt) else _ends(case, frame)))


def _hover(case: Asked, frame: F.Hover) -> Check:
    by, steps = case.metres(frame.by), _steps(case, frame.duration)
    over = [asked.passes_beyond(name, "up", by=by, exactly=by is not None) for name in frame.objects]
    return P.all_of(*over, *(P.dwells(steps, near=name) for name in frame.objects))


def _steps(case: Asked, q: F.Quantity | None) -> int:
    return max(1, 10 if q is None else round(q.value / (case.trajectory.timestep if q.unit in ("s", "") else 1.0)))


def _arrive(case: Asked, frame: F.Arrive) -> Check:
    there = [] if case.has(F.MoveEnd, F.Shift) else [P.ends_at("goal", within=0.01 * case.extent)]
    return P.all_of(asked.arrives_from(frame.direction, frame.by.value if frame.by else None), *there)


def _wait(case: Asked, frame: F.Wait) -> Check:
    place, steps = place_of(frame.place or "goal", case), _steps(case, frame.duration)
    return asked.rests_before(place, frame.by.value, steps=steps) if frame.by else asked.rests_at(place, steps=steps)


def _stop(case: Asked, frame: F.StopAt) -> Check:
    if frame.place in ("", "goal"):
        return P.stops()
    place = place_of(frame.place, case)
    if frame.by is not None:
        return P.all_of(P.stops(), asked.passes_at(place, at_most=frame.by.value, at_least=frame.by.value))
    stopped = asked.rests_at(place, ends=True)
    return P.all_of(stopped, P.same_path(partly=True)) if case.alone(frame) else stopped


def _pace(case: Asked, frame: F.Pace) -> Check | None:
    if frame.amount is not None and frame.amount.unit == "s":
        return _lasting(case, frame, frame.amount)
    return _PACES[frame.change](case, frame)


def _lasting(case: Asked, frame: F.Pace, q: F.Quantity) -> Check:
    """So many seconds, at most so many, or so many more or less."""
    where = case.part(frame.part)
    if q.role == "at_most":
        return asked.lasts(at_most=q.value, where=where)
    if frame.change in ("faster", "slower") and q.role == "by":
        return asked.lasts(by=-q.value if frame.change == "faster" else q.value, where=where)
    return asked.lasts(q.value, where=where)


def _set(case: Asked, frame: F.Pace) -> Check | None:
    """So many times as fast, so many m/s more or less, or just so many."""
    q = frame.amount
    if q is None or frame.factor is not None:
        return _factor(case, frame)
    if frame.change != "set" and q.role in ("by", "of"):
        return asked.speed_changed(q.value if frame.change == "faster" else -q.value, where=case.where(frame))
    judged = asked.speed_is if case.beside(frame, *PACING) else P.constant_speed
    return judged(q.value, where=case.part(frame.part))


def _ramp(case: Asked, frame: F.Pace, sense: Literal["rising", "falling"]) -> Check:
    to = None if frame.amount is None or case.beside(frame, *PACING) else frame.amount.value
    halts = case.has(F.Wait, F.StopAt, F.Hover) and sense == "rising"
    where = PathPart("first", amount=0.9, unit="share") if halts and not frame.part else case.where(frame)
    return P.monotone_speed(sense, where=where, to=to)


def _bounded(case: Asked, frame: F.Pace, bound: str) -> Check:
    slack, otherwise = 0.1 if case.has(F.Resample) else 0.02, not case.beside(frame, *PACING, F.Reverse)
    value = {bound: frame.amount.value if frame.amount else 0.0}
    return asked.speed_within(**value, where=case.where(frame), otherwise=otherwise, slack=slack)


def _constant(case: Asked, frame: F.Pace) -> Check:
    return P.constant_speed(frame.amount.value if frame.amount else None, where=case.part(frame.part))


def _in_turns(case: Asked, frame: F.Pace) -> Check:
    return P.slower(where=shared(PathPart("turns", amount=SHARES["turns"]), case.part(frame.part)))


def _accelerated(case: Asked, frame: F.Pace) -> Check:
    return asked.accelerates(frame.amount.value if frame.amount else 0.0, where=case.where(frame))


def _factor(case: Asked, frame: F.Pace) -> Check | None:
    """So many times as fast, where no other request says more of the speed."""
    factor, where, others = frame.factor, case.where(frame), case.beside(frame, F.Pace)
    alike = others if where is None else [f for f in others if f.part == frame.part]
    if alike and any(f.change in ("cap", "floor", "constant", "turns") for f in others):
        return None
    elsewhere = [outside(part) for f in others if f.part != frame.part and (part := case.part(f.part))]
    if elsewhere:
        where = both(*filter(None, [where]), *elsewhere)
        if not where.mask(case.trajectory, case.scene).any():
            return None
    judged = P.slower if frame.change == "slower" or (factor or 1.0) < 1 else P.faster
    only = where is not None and where.kind == "near" and len(case.frames) == 1
    return judged(where=where, factor=factor, amount=_amount(frame) if factor is None else None, only=only)


_PACES: Mapping[str, Callable[[Asked, Any], Check | None]] = {
    **dict.fromkeys(("faster", "slower", "set"), _set),
    "rampup": partial(_ramp, sense="rising"),
    "rampdown": partial(_ramp, sense="falling"),
    "cap": partial(_bounded, bound="at_most"),
    "floor": partial(_bounded, bound="at_least"),
    "constant": _constant,
    "turns": _in_turns,
    "accelerate": _accelerated,
}


def _keep(case: Asked, frame: F.Keep) -> Check | None:
    return _KEPT[frame.what](case, case.where(frame))


def _path_kept(case: Asked, where: PathPart | None) -> Check | None:
    if where is not None:
        return P.kept(where)
    return P.same_path() if all(isinstance(f, PATHLESS) for f in case.frames) else None


def _part_kept(case: Asked, where: PathPart | None) -> Check | None:
    return P.all_of(P.kept(where), P.speeds_kept(where)) if where is not None else _path_kept(case, where)


def _ends_kept(case: Asked, where: PathPart | None, what: str) -> Check | None:
    near = 0.01 * case.extent
    checks = [P.starts_at("start", within=near)] if what != "goal" else []
    checks += [P.ends_at("goal", within=near)] if what != "start" and not case.has(F.Extend, F.Return) else []
    return P.all_of(*checks) if checks else None


def _rest_kept(case: Asked, where: PathPart | None) -> Check | None:
    """Where parts are named, the path keeps its place outside of them."""
    parts = [case.part(f.part) for f in case.frames if not isinstance(f, F.Keep)]
    if not parts or not all(parts) or case.has(F.Approach, F.Clearance):
        return None
    return P.kept(shared(*(outside(part) for part in parts if part)))


_KEPT: Mapping[str, Callable[[Asked, PathPart | None], Check | None]] = {
    **{what: partial(_ends_kept, what=what) for what in ("start", "goal", "ends")},
    "speed": lambda case, where: None if case.has(*PACING, F.Reverse) else P.speeds_kept(where),
    "height": lambda case, where: None if case.has(*LIFTING) else asked.height_kept(where=where),
    "rest": _rest_kept,
    "path": _path_kept,
    "part": _part_kept,
}


def _extend(case: Asked, frame: F.Extend) -> Check:
    if frame.place:
        there = P.passes_through if case.has(F.Return) else P.ends_at
        return P.all_of(there(place_of(frame.place, case)), P.extended())
    words, _ = _sorted(case.offset(frame.offset))
    by = case.metres(frame.by, case.trajectory.length)
    return P.extended(by=by if by is None else abs(by), **words) if case.alone(frame) else P.extended()


def _return(case: Asked, frame: F.Return) -> Check:
    return P.all_of(P.ends_at("start"), P.extended()) if case.alone(frame) else P.ends_at("start", within=case.extent)


def _smooth(case: Asked, frame: F.Smooth) -> Check:
    where = case.where(frame)
    if where is None and case.alone(frame):
        return P.smoother()
    return asked.bends("less", where=where, straight=True)


def _curve(case: Asked, frame: F.Curve) -> Check:
    where = case.where(frame)
    return P.all_of(asked.bends(frame.change, where=where), *_ends(case, frame))


def _resample(case: Asked, frame: F.Resample) -> Check:
    n, q = len(case.trajectory), frame.amount
    if frame.change == "merge":
        return P.group_averages(round(q.value if q else 3))
    same = [P.same_path()] if case.alone(frame) else []
    if q is None:
        return P.all_of(P.more_waypoints() if frame.change == "more" else P.fewer_waypoints(), *same)
    share = q.unit in SHARE_UNITS
    value = n * q.value if share else q.value
    grown = {"more": n + value, "fewer": n - value, "by": value if share else n + value}
    count = value if q.unit == "x" else grown.get(frame.change, value)
    return P.all_of(asked.counted(round(count)), *same)


def _figure(case: Asked, frame: F.Figure) -> Check:
    where, size = case.where(frame) if frame.part else None, case.metres(frame.size or frame.radius)
    place = place_of(frame.place or "goal", case)
    if frame.shape == "spiral" and where and not frame.place:
        return asked.corkscrews(frame.turns.value if frame.turns else None, where=where)
    if frame.shape in ("circle", "spiral"):
        return _wound(case, frame, place)
    if frame.shape == "eight":
        long = 4 * size if size is not None and frame.size is None else size
        return asked.figure_eight(size=long, near=None if where else place)
    if frame.shape == "shake":
        return asked.swings(3, where=where or case.part(_around(frame.place)), irregular=True)
    waves = frame.waves or frame.turns
    least = 3 if waves is None else max(1, round(2 * waves.value) - 2)
    if case.has(F.Return):
        return asked.swings(least)
    return asked.swings(least, amplitude=size, where=where)


def _wound(case: Asked, frame: F.Figure, place: Any) -> Check:
    """So many turns: once on a circle, three times on a spiral where they are not counted."""
    turns, radius = frame.turns.value if frame.turns else 0.0, case.metres(frame.radius)
    if frame.shape == "circle":
        wound = asked.winds(place, turns or 1.0, radius=radius, sense=frame.sense or "")
        return P.not_(P.same_path()) if case.has(F.Return) else wound
    counts, near = [turns or 3.0], None if place == "goal" else place
    if near is not None:  # the way on may add one
        counts.append(counts[0] + 1)
    return P.any_of(*(P.spiral(near=near, turns=count, max_radius=radius) for count in counts))


def _around(place: F.Place) -> PathPart:
    """Where a path shakes: around a place; what is near an object is what is closest to it."""
    if place in ("", "goal"):
        return PathPart("last")
    return PathPart("near", (place if isinstance(place, str) else "middle",))


def _mirror(case: Asked, frame: F.Mirror) -> Check:
    flipped = {"x": "y", "y": "x", "z": "z"}.get(frame.axis, "")
    if case.has(F.Reverse, F.Resize, F.Curve, F.Return):
        return P.not_(P.same_path())
    mirrored = P.mirrored if case.alone(frame) else asked.flipped
    return mirrored([case.word(flipped or frame.axis)], where=case.calm(frame))


_ENDS = ("start", "goal", "ends")


def _rotate(case: Asked, frame: F.Rotate) -> Check:
    if case.has(F.Resize, F.Curve, F.Trim) or any(f.what in _ENDS for f in case.beside(frame, F.Keep)):
        return P.not_(P.same_path())
    angle = 45.0 if frame.angle is None else frame.angle.value * {"turns": 360.0}.get(frame.angle.unit, 1.0)
    where = case.calm(frame)
    ways = [-angle] if frame.sense == "cw" else [angle] if frame.sense else [angle, -angle]
    fixed = []
    if frame.about == "start" and case.alone(frame):
        fixed = [P.starts_at("start", within=0.02 * case.extent)]
    return P.all_of(P.any_of(*(P.rotated(way, where=where) for way in ways)), *fixed)


def _tilt(case: Asked, frame: F.Tilt) -> Check:
    side = case.word(frame.direction)
    axis = {"left": "front", "right": "back", "front": "right", "back": "left"}[side]
    angle = 45.0 if frame.angle is None else frame.angle.value
    turned = [P.rotated(angle, axis, where=case.where(frame))] if case.alone(frame) else []
    return P.all_of(asked.lifted(side, angle), *turned)


def _resize(case: Asked, frame: F.Resize) -> Check:
    plain = canonical(frame)
    assert isinstance(plain, F.Resize)
    if any(f.what in _ENDS for f in case.beside(frame, F.Keep)):
        return P.not_(P.same_path())
    usual = {"slight": 1.2, "large": 2.0}.get(frame.degree or "", 1.5)
    factor = plain.by.value if plain.by else 1 / usual if frame.change == "smaller" else usual
    about = place_of(frame.about, case) if frame.about and case.alone(frame) else None
    return asked.scaled(factor, where=case.calm(frame), about=about)


def _height(case: Asked, frame: F.Height) -> Check:
    level, where, alone = frame.level.value, case.where(frame), case.alone(frame)
    of = place_of(frame.of, case) if frame.of else None
    if frame.level.role == "at_least":
        return asked.within_bound("down", -level, of=of, where=where, otherwise=alone)
    exactly = frame.level.role != "at_most"
    return asked.within_bound("up", level, of=of, where=where, exactly=exactly, otherwise=alone)


def _bound(case: Asked, frame: F.Bound) -> Check:
    of, where = place_of(frame.of, case) if frame.of else None, case.where(frame)
    limits = [(case.word(said), case.metres(q) or 0.0) for said, q in frame.offset]
    otherwise = case.alone(frame) and len(limits) == 1
    return P.all_of(*(asked.within_bound(word, limit, of=of, where=where, otherwise=otherwise)
                      for word, limit in limits))  # fmt: skip


def _trim(case: Asked, frame: F.Trim) -> Check | None:
    if case.has(F.Extend, F.Return):
        return None
    n, q = len(case.trajectory), frame.amount
    unit: Any = {"m": "m", "s": "s", "%": "share", "x": "share"}.get(q.unit if q else "", "waypoints")
    count = int(PathPart(frame.cut, amount=q.value, unit=unit).mask(case.trajectory, case.scene).sum()) if q else 0
    if not case.alone(frame) or case.has(F.Resample, F.Wait, F.StopAt):
        recounted = q is None or case.beside(frame, *RECOUNTED, F.Wait, F.StopAt)
        return P.not_(P.extended()) if recounted else asked.counted(n - count)
    if q is not None:
        return asked.trimmed(count if frame.cut == "first" else 0, count if frame.cut == "last" else 0)
    nearest = nearest_to(case, frame.place)
    return asked.trimmed(nearest, 0) if frame.cut == "before" else asked.trimmed(0, n - 1 - nearest)


def _quadrant(case: Asked, frame: F.Quadrant) -> Check:
    sides = (("left", "back"), ("right", "back"), ("right", "front"), ("left", "front"))[frame.number - 1]
    bounds: Any = dict.fromkeys(sides, 0.0)
    return P.all_of(P.never_beyond(**bounds), *([P.shape_kept()] if case.alone(frame) else []))


_CHECKS: Mapping[type[F.SemanticFrame], Callable[..., Check | None]] = {
    F.MoveEnd: lambda case, f: _each(("start", "goal") if f.end == "ends" else (f.end,), partial(_one_end, case, f)),
    F.Approach: lambda case, f: _each(f.objects, partial(_approached, case, f)),
    F.Side: lambda case, f: _each(f.objects, partial(_beside, case, f)),
    F.Wait: _wait,
    F.Straighten: lambda case, f: P.straight(case.where(f)),
    F.NoStop: lambda case, f: P.never_stops(where=case.where(f)),
    F.OneHeight: lambda case, f: asked.one_height(where=case.where(f)),
    F.Reverse: lambda case, f: P.reversed_part(case.where(f)) if case.alone(f) else None,
    F.Shift: _shift, F.Clearance: _clearance, F.Visit: _visit, F.Pace: _pace, F.Keep: _keep, F.StopAt: _stop,
    F.Extend: _extend, F.Smooth: _smooth, F.Resample: _resample, F.Figure: _figure, F.Hop: _hop, F.Hover: _hover,
    F.Mirror: _mirror, F.Rotate: _rotate, F.Tilt: _tilt, F.Resize: _resize, F.Curve: _curve, F.Height: _height,
    F.Bound: _bound, F.Return: _return, F.Trim: _trim, F.Quadrant: _quadrant, F.Avoid: _avoid, F.Arrive: _arrive,
}  # fmt: skip
