"""The report of changes in plain words, for people who do not program robots; waypoints count from 1 here."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ovita.measure.changes import REVERSAL, Changes, Insertion, Jump, Kink, ObjectChange, Span, SpeedChange, SpeedRange
from ovita.text import counted, listed, number, the, waypoints

_VISIBLE = 1e-3
"""Smaller differences are not worth a sentence of their own [m, m/s, s]."""

_MOST = 3
"""Speed ranges and objects that are named one by one."""


def sentences(changes: Changes) -> list[str]:
    """Say in plain words what changed, the most important first.

    Numbers carry about three significant digits; differences below a millimetre, 1 mm/s or a millisecond
    are summed up rather than listed.
    """
    if changes.nothing_changed:
        return ["Nothing changed: the path and the speeds are exactly as before."]
    path, speed = [*_path(changes), *_moved_stops(changes)], [*_speeds(changes), *_stops(changes)]
    told = [*path, *speed, *_objects(changes), *_duration(changes)]
    told += _total("The path is", changes.length, "m", ("longer", "shorter"))
    put = bool(changes.removed or changes.added)
    if not path or (put and changes.displacement.max < _VISIBLE):
        told.append(_still(changes, "The rest of the path" if put else "The path"))
    return told + _same_speed(changes, path, speed) + _counts(changes)


def _same_speed(changes: Changes, path: list[str], speed: list[str]) -> list[str]:
    exact = "exactly" if changes.speed.count == 0 else "practically"
    return [f"The speed along the path is {exact} as before."] if path and not speed else []


def _counts(changes: Changes) -> list[str]:
    old, new = int(changes.waypoints.before), int(changes.waypoints.after)
    told = [f"The number of waypoints went from {old} to {new}."] if old != new else []
    return told if changes.orientations_unchanged else [*told, "The orientation along the path changed."]


def moved_ends(changes: Changes, verb: str = "moved") -> list[str]:
    """Where the ends went, such as "the goal moved 0.30 m up", with another verb where it is not done."""
    ends = {"the start": changes.start, "the goal": changes.goal}
    ways = {name: directions(end.words) for name, end in ends.items() if end.shift >= _VISIBLE}
    together = len(ways) == 2 and len(set(ways.values())) == 1
    names = [" and ".join(ways)] if together else [*ways]
    return [f"{name} {verb} {way}" for name, way in zip(names, ways.values(), strict=False)]


def directions(words: Mapping[str, float]) -> str:
    """Direction words with metres, largest first: "0.20 m left and 0.05 m up"; negligible parts are omitted."""
    least = max(_VISIBLE, 0.05 * max(words.values(), default=0.0))
    ranked = sorted(words.items(), key=lambda item: -item[1])
    parts = [(word, v) for word, v in ranked if v >= least] or ranked[:1]
    return listed([f"{number(v)} m {_PHRASES.get(word, word)}" for word, v in parts])


_PHRASES = {"front": "forward", "back": "backward"}


def shape_warnings(changes: Changes) -> list[str]:
    """Say which kinks, reversals and jumps the adaptation brought; empty if the path stays as smooth as it was."""
    kinks, jumps = changes.shape.kinks, changes.shape.jumps
    told = [_kink(kink) for kink in kinks]
    if len(kinks) > _MOST:
        sharpest = max(kink.degrees for kink in kinks)
        told = [f"The path now turns sharply at {len(kinks)} waypoints, by up to {sharpest:.0f} degrees."]
    return told + [_jump(jump) for jump in sorted(jumps, key=lambda j: -j.step)[:_MOST]]


def _kink(kink: Kink) -> str:
    word = "turns back on itself" if kink.degrees > REVERSAL else f"turns sharply, by {kink.degrees:.0f} degrees,"
    return f"The path now {word} at waypoint {kink.waypoint + 1} ({kink.before:.0f} degrees there before)."


def _jump(jump: Jump) -> str:
    where = f"waypoints {jump.waypoint + 1} and {jump.waypoint + 2}"
    return f"The path jumps by {number(jump.step)} m between {where} (at most {number(jump.before)} m before)."


def _path(changes: Changes) -> list[str]:
    n, m = int(changes.waypoints.before), int(changes.waypoints.after)
    beyond = next((put for put in changes.added if put.last == m - 1), None)
    leading, trailing = (_cut(changes, end) for end in (0, n - 1))
    told = _moved(changes, bool(leading), bool(trailing or beyond))
    ends = ("first", "start", leading, changes.start), ("last", "goal", 0 if beyond else trailing, changes.goal)
    for side, name, count, end in ends:
        if count:
            told.append(f"The {side} {_waypoints(count)} taken out: the {name} moved {directions(end.words)}.")
    inner = [(a, b) for a, b in changes.removed[: _MOST + 2] if a > 0 and b < n - 1]
    told += [f"The old {waypoints(a, b)} {'was' if a == b else 'were'} taken out." for a, b in inner]
    return told + _put_in(changes, beyond)


def _put_in(changes: Changes, beyond: Insertion | None) -> list[str]:
    put, told = changes.added[: _MOST + 2], []
    if beyond and changes.goal.shift >= _VISIBLE:
        told = [f"The path goes on beyond its old goal: the goal moved {directions(changes.goal.words)}."]
        put = tuple(each for each in put if each is not beyond)
    return told + [_insertion(each, each is beyond) for each in put]


def _insertion(put: Insertion, at_the_end: bool) -> str:
    where = "after the old goal" if at_the_end else f"as {waypoints(put.first, put.last)}"
    off = f", up to {number(put.off)} m off the old path" if put.off >= _VISIBLE else " along the old path"
    return f"{_waypoints(put.last - put.first + 1).capitalize()} put in {where}{off}."


def _cut(changes: Changes, end: int) -> int:
    """How many waypoints were taken out at an end of the original."""
    return next((b - a + 1 for a, b in changes.removed if a <= end <= b), 0)


def _waypoints(count: int) -> str:
    return f"{counted(count, 'waypoint')} {'was' if count == 1 else 'were'}"


def _moved(changes: Changes, cut: bool, grown: bool) -> list[str]:
    """How the corresponding waypoints moved, and the ends unless waypoints were removed or inserted there."""
    moved = changes.displacement
    ends = {"start": changes.start, "goal": changes.goal}
    ends = {name: end for (name, end), other in zip(ends.items(), (cut, grown), strict=True) if not other}
    shifted = [f"The {name} moved {directions(end.words)}." for name, end in ends.items() if end.shift >= _VISIBLE]
    if moved.max < _VISIBLE or moved.first is None or moved.last is None:
        return shifted
    if moved.spread <= max(_VISIBLE, 0.01 * math.hypot(*moved.vector)):
        return [f"The whole path moved {directions(moved.words)}."]
    where = "" if moved.last - moved.first + 1 == int(changes.waypoints.after) else _between(moved.first, moved.last)
    told = (
        f"The path{where} moved by up to {number(moved.max)} m "
        f"(waypoint {moved.index + 1}: {directions(moved.max_words)}), "
        f"{number(moved.mean)} m on average over all waypoints."
    )
    return [told, *shifted, *_stay([name for name, end in ends.items() if end.shift < _VISIBLE])]


def _stay(ends: list[str]) -> list[str]:
    stays = "stay where they were" if len(ends) == 2 else "stays where it was"
    return [f"The {' and the '.join(ends)} {stays}."] if ends else []


def _still(changes: Changes, what: str) -> str:
    moved = changes.displacement
    if changes.path_unchanged or moved.count == 0:
        return f"{what} is exactly as before."
    return f"{what} is practically as before (moved by at most {number(moved.max * 1000)} mm)."


def _speeds(changes: Changes) -> list[str]:
    ranges = _noticed(changes.speed)
    return (_everywhere(changes.speed, ranges) or _stretches(changes.speed, ranges)) if ranges else []


def _noticed(speed: SpeedChange) -> list[SpeedRange]:
    """The ranges worth a sentence: those of a stop are said with the stop."""

    def stands(r: SpeedRange) -> bool:
        return r.speed.after == 0 and any(stop.first <= r.first and r.last <= stop.last for stop in speed.stopped)

    changed = [r for r in speed.ranges if abs(r.speed.change) >= _VISIBLE or _relative(r.speed) >= 0.01]
    return [r for r in changed if not stands(r)]


def _everywhere(speed: SpeedChange, ranges: list[SpeedRange]) -> list[str]:
    """One sentence on the whole path, where one says it all."""
    low, high = speed.ratio_min or 0.0, speed.ratio_max or 0.0
    if speed.max.after - speed.min.after < _VISIBLE <= speed.max.before - speed.min.before:
        before = f"{number(speed.min.before)} to {number(speed.max.before)} m/s"
        return [f"Speed is now {number(speed.mean.after)} m/s everywhere (before: {before})."]
    if len(speed.ranges) == 1 and low < 1 < high:
        return [f"Speed changes at {speed.count} waypoints, to {number(low)} ... {number(high)} times that before."]
    if speed.everywhere and len({r.speed.change > 0 for r in ranges}) == 1:
        factor = f", {number(high)} times that before" if high - low < 0.01 * high else ""
        return [f"Speed is {_higher(speed.mean)} everywhere: {_span(speed.mean, 'm/s')} on average{factor}."]
    return []


def _stretches(speed: SpeedChange, ranges: list[SpeedRange]) -> list[str]:
    """A sentence each on the stretches that changed most, in their order."""
    most = sorted(ranges, key=lambda r: -abs(r.speed.change) * (r.last - r.first + 1))[:_MOST]
    most.sort(key=lambda r: r.first)
    tail = "" if speed.everywhere else "; unchanged elsewhere"
    if rest := len(ranges) - len(most):
        tail = f"; it changes on {counted(rest, 'more stretch', 'more stretches')}"
    return [_stretch(r) + (tail if r is most[-1] else "") + "." for r in most]


def _stretch(item: SpeedRange) -> str:
    where = _between(item.first, item.last)
    return f"Speed is {_higher(item.speed)}{_near(item.near)}: {_span(item.speed, 'm/s')}{where}"


def _between(first: int, last: int) -> str:
    return f" at waypoint {first + 1}" if first == last else f" between waypoints {first + 1} and {last + 1}"


def _moved_stops(changes: Changes) -> list[str]:
    """Where stops went with what is around them; nothing where the whole path did."""
    moved = [stop for stop in changes.speed.stopped if math.hypot(*stop.words.values()) >= _VISIBLE]
    whole = changes.displacement.spread < _VISIBLE
    return [
        f"The stop at waypoint {stop.first + 1}{_near(stop.near)} moved {directions(stop.words)}."
        for stop in ([] if whole else moved)[:_MOST]
    ]


def _stops(changes: Changes) -> list[str]:
    speed = changes.speed
    if speed.stops.change == 0 and abs(speed.dwell.change) < _VISIBLE:
        return []
    if not speed.stopped:
        return ["It no longer stops on the way."]
    told = []
    for stop in speed.stopped[:_MOST]:
        waits = f" and waits {number(stop.seconds)} s" if stop.seconds else ""
        told.append(f"It stops at waypoint {stop.first + 1}{_near(stop.near)}{waits}.")
    if len(speed.stopped) > _MOST:
        told.append(f"It stops {len(speed.stopped)} times in all (before: {int(speed.stops.before)}).")
    return told


def _objects(changes: Changes) -> list[str]:
    told = [said for item in changes.objects if (said := _touched(item))]
    gaps = {item.name: _gap(item) for item in changes.objects if not _touched(item)}
    noticed = [name for name, gap in gaps.items() if abs(gap.change) >= _VISIBLE and _relative(gap) >= 0.02]
    noticed.sort(key=lambda name: -_relative(gaps[name]))
    sized = {item.name: item.clearance for item in changes.objects}
    for name in noticed[:_MOST]:
        gap, what = gaps[name], "surface" if gaps[name] is sized[name] else "centre"
        way = f"{number(abs(gap.change))} m {_closer(gap)} {the(name)}"
        told.append(f"It now passes {way} ({_span(gap, 'm')} to its {what}).")
    for word in ("closer to", "farther from"):
        names = [the(name) for name in noticed[_MOST:] if _closer(gaps[name]) == word]
        told += [f"It also passes {word} {listed(names)}."] if names else []
    return told


def _touched(item: ObjectChange) -> str:
    """What there is to say of an object that the path runs into, or did before."""
    before, after = item.clearance.before, item.clearance.after
    if after <= 0 < before:
        deep = f", {number(-after)} m deep" if after <= -_VISIBLE else ""
        return f"It now runs into {the(item.name)}{deep}."
    return f"It no longer runs into {the(item.name)}; {number(after)} m are left." if before <= 0 < after else ""


def _closer(gap: Span) -> str:
    return "closer to" if gap.change < 0 else "farther from"


def _gap(item: ObjectChange) -> Span:
    """The distance that people mean: to the surface, or to the centre inside of it or where no size is known."""
    return item.clearance if item.sized and min(item.clearance.before, item.clearance.after) > 0 else item.distance


def _duration(changes: Changes) -> list[str]:
    if changes.stalled:
        return ["It does not arrive: the speed is 0 on the way."]
    return _total("It takes", changes.duration, "s", ("longer", "less time"))


def _total(opening: str, span: Span, unit: str, words: tuple[str, str]) -> list[str]:
    if abs(span.change) < _VISIBLE or _relative(span) < 0.005:
        return []
    word = words[0] if span.change > 0 else words[1]
    return [f"{opening} {number(abs(span.change))} {unit} {word} ({_span(span, unit)})."]


def _span(span: Span, unit: str) -> str:
    return f"{number(span.before)} -> {number(span.after)} {unit}"


def _relative(span: Span) -> float:
    largest = max(abs(span.before), abs(span.after))
    return abs(span.change) / largest if largest > 0 else 0.0


def _higher(span: Span) -> str:
    return "higher" if span.change > 0 else "lower"


def _near(names: tuple[str, ...]) -> str:
    return " near " + listed([the(name) for name in names]) if names else ""
