"""The report of changes in plain words, for people who do not program robots."""

from __future__ import annotations

from collections.abc import Mapping

from ovita.measure.report import Changes, Endpoint, ObjectChange, Span, SpeedRange

_VISIBLE = 1e-3
"""Smaller differences are not worth a sentence of their own [m, m/s, s]."""

_MOST = 3
"""Speed ranges and objects told one by one."""


def sentences(changes: Changes) -> list[str]:
    """Say in plain words what changed, the most important first.

    Numbers carry about three significant digits; differences below a millimetre, 1 mm/s or a millisecond
    are summed up rather than listed.
    """
    if changes.nothing_changed:
        return ["Nothing changed: the path and the speeds are exactly as before."]
    path, speed = _path(changes), [*_speeds(changes), *_stops(changes)]
    told = [
        *path,
        *speed,
        *_objects(changes),
        *_total("It takes", changes.duration, "s", ("longer", "less time")),
        *_total("The path is", changes.length, "m", ("longer", "shorter")),
    ]
    if not path:
        told.append(_still(changes))
    elif not speed:
        exact = "exactly" if changes.speed.count == 0 else "practically"
        told.append(f"The speed along the path is {exact} as before.")
    if changes.waypoints.change:
        counts = changes.waypoints
        told.append(f"The number of waypoints went from {int(counts.before)} to {int(counts.after)}.")
    if not changes.orientations_unchanged:
        told.append("The orientation along the path changed.")
    return told


def number(value: float) -> str:
    """A number with about three significant digits and at least two decimals below 10: 0.2 to "0.20"."""
    size = abs(value)
    if size >= 1e5 or 0 < size < 1e-3:
        return f"{value:.3g}"
    if size >= 100:
        return f"{value:.0f}"
    if size >= 10:
        return f"{value:.1f}"
    text = f"{value:.2f}" if size >= 1 else f"{value:.3f}"
    return text[:-1] if size < 1 and text.endswith("0") else text


def directions(words: Mapping[str, float]) -> str:
    """Direction words with metres, largest first: "0.20 m left and 0.05 m up"; parts that hardly count are left out."""
    least = max(_VISIBLE, 0.05 * max(words.values(), default=0.0))
    parts = [
        f"{number(v)} m {_PHRASES.get(k, k)}" for k, v in sorted(words.items(), key=lambda kv: -kv[1]) if v >= least
    ]
    return _listed(parts)


_PHRASES = {"front": "forward", "back": "backward"}


def _path(changes: Changes) -> list[str]:
    moved = changes.displacement
    ends = [("start", changes.start), ("goal", changes.goal)]
    shifted = [(name, end) for name, end in ends if end.shift >= _VISIBLE]
    if moved.max < _VISIBLE or moved.first is None or moved.last is None:
        return [_end(name, end) for name, end in shifted]
    mean = sum(part**2 for part in moved.vector) ** 0.5
    if moved.spread <= max(_VISIBLE, 0.01 * mean):
        return [f"The whole path moved {directions(moved.words)}."]
    before, after = int(changes.waypoints.before), int(changes.waypoints.after)
    added = moved.last - moved.first + 1
    if changes.matching == "arc length" and added == after - before and moved.last == after - 1:
        return [f"The path goes on beyond its old goal: the goal moved {directions(changes.goal.words)}."]
    where = f"The path between waypoints {moved.first} and {moved.last}"
    if (moved.first, moved.last) == (0, after - 1):
        where = "The path"
    elif moved.first == moved.last:
        where = f"The path at waypoint {moved.first}"
    told = [
        f"{where} moved by up to {number(moved.max)} m (waypoint {moved.index}: {directions(moved.max_words)}), "
        f"{number(moved.mean)} m on average over all waypoints."
    ]
    told += [_end(name, end) for name, end in shifted]
    if not shifted:
        told.append("The start and the goal stay where they were.")
    elif len(shifted) == 1:
        told.append(f"The {'goal' if shifted[0][0] == 'start' else 'start'} stays where it was.")
    return told


def _end(name: str, end: Endpoint) -> str:
    return f"The {name} moved {directions(end.words)}."


def _still(changes: Changes) -> str:
    moved = changes.displacement
    if changes.path_unchanged or moved.count == 0:
        return "The path is exactly as before."
    return f"The path is practically as before (moved by at most {number(moved.max * 1000)} mm)."


def _speeds(changes: Changes) -> list[str]:
    speed = changes.speed
    halts = {(stop.first, stop.last) for stop in speed.stopped}
    ranges = [
        r
        for r in speed.ranges
        if (abs(r.speed.change) >= _VISIBLE or _relative(r.speed) >= 0.01)
        and not (r.speed.after == 0 and any(first <= r.first and r.last <= last for first, last in halts))
    ]
    if not ranges:
        return []
    low, high = speed.ratio_min, speed.ratio_max
    if speed.max.after - speed.min.after < _VISIBLE <= speed.max.before - speed.min.before:
        before = f"{number(speed.min.before)} to {number(speed.max.before)} m/s"
        return [f"Speed is now {number(speed.mean.after)} m/s everywhere (before: {before})."]
    if len(speed.ranges) == 1 and low is not None and high is not None and low < 1 < high:
        return [f"Speed changes at {speed.count} waypoints, to {number(low)} ... {number(high)} times that before."]
    if speed.everywhere and len({r.speed.change > 0 for r in ranges}) == 1:
        same = low is not None and high is not None and high - low < 0.01 * high
        factor = f", {number(high)} times that before" if same and high is not None else ""
        return [f"Speed is {_higher(speed.mean)} everywhere: {_span(speed.mean, 'm/s')} on average{factor}."]
    told = sorted(ranges, key=lambda r: -abs(r.speed.change) * (r.last - r.first + 1))[:_MOST]
    told.sort(key=lambda r: r.first)
    rest = len(ranges) - len(told)
    tail = "" if speed.everywhere else "; unchanged elsewhere"
    if rest:
        tail = f"; it changes on {rest} more {'stretch' if rest == 1 else 'stretches'}"
    return [_stretch(r) + (tail if r is told[-1] else "") + "." for r in told]


def _stretch(item: SpeedRange) -> str:
    where = (
        f"at waypoint {item.first}" if item.first == item.last else f"between waypoints {item.first} and {item.last}"
    )
    return f"Speed is {_higher(item.speed)}{_near(item.near)}: {_span(item.speed, 'm/s')} {where}"


def _stops(changes: Changes) -> list[str]:
    speed = changes.speed
    if speed.stops.change == 0 and abs(speed.dwell.change) < _VISIBLE:
        return []
    if not speed.stopped:
        return ["It no longer stops on the way."]
    told = []
    for stop in speed.stopped[:_MOST]:
        waits = f" and waits {number(stop.seconds)} s" if stop.seconds else ""
        told.append(f"It stops at waypoint {stop.first}{_near(stop.near)}{waits}.")
    if len(speed.stopped) > _MOST:
        told.append(f"It stops {len(speed.stopped)} times in all (before: {int(speed.stops.before)}).")
    return told


def _objects(changes: Changes) -> list[str]:
    told: list[str] = []
    listed = []
    for item in changes.objects:
        if item.clearance.after <= 0 < item.clearance.before:
            deep = f", {number(-item.clearance.after)} m deep" if item.clearance.after <= -_VISIBLE else ""
            told.append(f"It now runs into {_the(item.name)}{deep}.")
        elif item.clearance.before <= 0 < item.clearance.after:
            told.append(f"It no longer runs into {_the(item.name)}; {number(item.clearance.after)} m are left.")
        elif abs(item.distance.change) >= _VISIBLE and _relative(item.distance) >= 0.02:
            listed.append(item)
    listed.sort(key=lambda item: -_relative(item.distance))
    told += [_passes(item) for item in listed[:_MOST]]
    rest = listed[_MOST:]
    for word, closer in (("closer to", True), ("farther from", False)):
        names = [_the(item.name) for item in rest if (item.distance.change < 0) == closer]
        if names:
            told.append(f"It also passes {word} {_listed(names)}.")
    return told


def _passes(item: ObjectChange) -> str:
    amount = number(abs(item.distance.change))
    word = "closer to" if item.distance.change < 0 else "farther from"
    return f"It now passes {amount} m {word} {_the(item.name)} ({_span(item.distance, 'm')} to its centre)."


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
    return " near " + _listed([_the(name) for name in names]) if names else ""


def _the(name: str) -> str:
    return name if name.lower().startswith(("the ", "a ", "an ")) else f"the {name}"


def _listed(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else ", ".join(parts[:-1]) + " and " + parts[-1] if parts else ""
