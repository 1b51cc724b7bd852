"""Judge postconditions on the adapted trajectory."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ovita import text
from ovita.paths.correspondence import Correspondence, correspond
from ovita.paths.geometry import Mask, closest_to_point, lengths, path_distances, runs, spacing, turning_angles
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array, arc_length, interpolate, source_indices
from ovita.toolkit.approach import SURFACE_GAP, extent, nearest, passes_at
from ovita.toolkit.arguments import Target, aimed, core_of, point
from ovita.toolkit.avoidance import shut
from ovita.toolkit.catalogue import Expectation
from ovita.toolkit.postconditions import called, say
from ovita.toolkit.speed import travel_time

TINY, RELATIVE = 1e-6, 1e-3
"""What rounding and interpolation may change: metres (or m/s), and relative to the old value."""

NOTICED = 0.002
"""A path is closer or farther from this difference on [m]: what resampling cuts off corners stays below it."""

SLACK, SLACK_RELATIVE = 0.01, 0.1
"""How far from an amount a repaired trajectory may end up: metres (or m/s), and relative to the amount."""

KEPT_SLACK, KEPT_RELATIVE = 0.002, 0.01
"""How far a least distance may be missed, in metres and relative to it."""

END_SLACK = 0.02
"""How far from its place an end may be [m]."""

SPEED_CHANGE = 0.005
"""A robot is faster or slower from this share of its speed on."""

LONGER = 0.002
"""A path is longer or shorter from this share of its length on: what resampling cuts off corners is mostly less."""

SMOOTHED, OUTER = 0.05, 0.7
"""A path is smoother where its squared bends sum up to that share less,
and its farthest corner out at most so much more."""

MOSTLY = 0.7
"""The share of a part on which an acceleration is what was asked for: limits cut off its ends."""

AT_REST = 1e-3
"""The robot stands still below this speed [m/s]."""


@dataclass(frozen=True)
class Outcome:
    """The outcome of one postcondition.

    Args:
        held: Whether it was kept.
        sentence: What was measured, with numbers.
        change: How far the trajectory went from the original in the sense that was asked for, negative if it went
            the other way; None where no amount can be measured.
        unit: Of the change.
    """

    held: bool
    sentence: str
    change: float | None = None
    unit: str = "m"


def judge(expectation: Expectation, original: Array, adapted: Array, scene: Scene) -> Outcome:
    """Measure whether an expectation holds, on the segments between waypoints too.

    An amount may be missed by 10 % or 1 cm, the place of an end by 2 cm, a least distance by 1 % or 2 mm.

    Args:
        expectation: As a policy stated it.
        original: (N, 4+).
        adapted: (M, 4+); if M differs from N, waypoints correspond as in `correspond`.
        scene: Whose objects and frame the expectation speaks of.

    Raises:
        ValueError: If the kind of expectation is unknown.
    """
    check = _CHECKS.get(expectation.kind)
    if check is None:
        raise ValueError(f"unknown expectation {expectation.kind!r}; known are {', '.join(_CHECKS)}")
    values = expectation.arguments
    if "object" in values and scene.find(values["object"]) is None:
        return Outcome(False, f"the scene has no object {values['object']!r}")
    case = _Case(values, np.asarray(original, dtype=float), np.asarray(adapted, dtype=float), scene)
    if not values.get("where", {}).get("ranges", True):
        return Outcome(expectation.kind == "same_path", "no waypoint is in the part that is meant")
    left = case.paired.any() or (case.new.any() and expectation.kind not in _OF_PAIRS)
    with np.errstate(over="ignore", invalid="ignore"):  # an amount of 1e308 is missed, as any other
        return check(case) if left else Outcome(False, "none of the selected waypoints is left")


_OF_PAIRS = ("moved", "same_speed", "faster", "slower")
"""What is measured on waypoints of the original and the same ones of the result."""


class _Case:
    """One expectation's arguments next to the two trajectories and their correspondence."""

    def __init__(self, values: Mapping[str, Any], original: Array, adapted: Array, scene: Scene) -> None:
        self.values, self.original, self.adapted, self.scene = values, original, adapted, scene
        match = correspond(original, adapted)
        self.kept = match.kept
        self.matched = match.of_original(adapted)
        self.by_index = match.method.startswith("index")
        self.old, self.new = _parts(values.get("where"), match)
        self.paired: Mask = self.old & self.kept

    @property
    def whole(self) -> bool:
        """Whether the expectation is about the whole path."""
        return "where" not in self.values

    @property
    def part(self) -> str:
        """What it is about, as a person counts: "the path", "waypoints 3 to 7", or "the part"."""
        spans = list(runs(self.new))
        return "the path" if self.whole else text.waypoints(*spans[0]) if len(spans) == 1 else "the part"

    def asked(self, *names: str) -> dict[str, float]:
        """The amounts of those names that the expectation states."""
        return {name: float(self.values[name]) for name in names if self.values.get(name) is not None}

    def distances(self) -> tuple[float, float]:
        """How near the part of the old path and of the new one come to the target's core, between waypoints too."""
        core = core_of(self.target, self.original[:, :3])
        old = self.paired if self.paired.any() and not self.whole else np.ones(len(self.original), dtype=bool)
        new = self.new if self.new.any() and not self.whole else np.ones(len(self.adapted), dtype=bool)
        return nearest(self.original[:, :3], old, core), nearest(self.adapted[:, :3], new, core)

    @property
    def target(self) -> Target:
        return self.scene[self.values["object"]] if "object" in self.values else self.values["point"]

    @property
    def named(self) -> bool:
        """Whether the expectation is about an object or a point."""
        return "object" in self.values or "point" in self.values

    @property
    def name(self) -> str:
        return str(self.values["object"]) if "object" in self.values else text.point(self.values["point"])

    def place(self, path: Array) -> Array:
        """The point (3,) [m] that is meant, where a path (N, 3) decides which of a surface is nearest."""
        return aimed(self.target, self.values.get("aim", "centre"), self.scene.frame, path, self.offset)

    @property
    def aimed(self) -> str:
        """The target and what of it is meant, in words."""
        return called(self.name, self.values.get("aim", "centre"))

    @property
    def offset(self) -> Array:
        return self.scene.frame.offset(**self.values.get("offset", {}))

    @property
    def beside(self) -> str:
        """The offset in words, before what it is an offset of; "" where there is none."""
        return f"the place {say(self.values['offset'])} of " if "offset" in self.values else ""

    def anchor(self, axis: Array) -> tuple[Array, float, str]:
        """The target's centre (3,) [m], how far it reaches along an axis [m], and its name; the origin for none."""
        if not self.named:
            return np.zeros(3), 0.0, "the origin"
        return point(self.target), extent(self.target, axis), self.name


def _parts(where: Mapping[str, Any] | None, match: Correspondence) -> tuple[Mask, Mask]:
    """The stored mask of an expectation over the original (N,) and over the adapted waypoints (M,).

    A count that is the adapted and not the original one means adapted waypoints; any other is stretched.
    """
    n, m = len(match.forward), len(match.backward)
    if where is None:
        return np.ones(n, dtype=bool), np.ones(m, dtype=bool)
    selected = np.zeros(int(where["count"]), dtype=bool)
    for first, last in where["ranges"]:
        selected[int(first) : int(last) + 1] = True
    if len(selected) == m != n:
        return match.carried_back(selected), selected
    if len(selected) != n:
        selected = selected[np.rint(np.linspace(0, len(selected) - 1, n)).astype(int)]
    return selected, match.carried(selected)


def _about(asked: float) -> float:
    """How far from an amount a result may end up."""
    return max(SLACK, SLACK_RELATIVE * abs(asked))


def _hardly(asked: float) -> float:
    """How far a bound may be missed."""
    return max(KEPT_SLACK, KEPT_RELATIVE * abs(asked))


def _close(amount: float, asked: float) -> bool:
    return abs(amount - asked) <= _about(asked)


@dataclass(frozen=True)
class _Bound:
    """One bound next to what was and what is: sign +1 for at least, -1 for at most, 0 for just so much."""

    sign: float
    asked: float
    before: float | None
    now: float
    slack: float
    said: str

    def miss(self, value: float) -> float:
        """By how much a value misses the bound."""
        off = self.asked - value
        return max(self.sign * off, 0.0) if self.sign else abs(off)


def _bounded(bounds: Sequence[_Bound], opening: str, closing: str = "", unit: str = "m") -> Outcome:
    """The outcome of all bounds; its change is by how much less they are missed than before."""
    change = sum(abs(b.asked) - b.miss(b.now) if b.before is None else b.miss(b.before) - b.miss(b.now) for b in bounds)
    held = all(b.miss(b.now) <= b.slack for b in bounds)
    return Outcome(held, f"{opening}{' and '.join(b.said for b in bounds)}{closing}", change, unit)


def _approach(case: _Case, sign: float) -> Outcome:
    """Sign +1: farther, -1: closer. The nearest distance decides; if that stays as it was, the average does."""
    core = core_of(case.target, case.original[:, :3])
    old, new = case.distances()
    pairs = np.stack([core.depth(rows[case.paired, :3]) for rows in (case.original, case.matched)])
    means = (float(pairs[0].mean()), float(pairs[1].mean())) if case.paired.any() else (old, new)
    gain, average = sign * (new - old), sign * (means[1] - means[0])
    noticed = NOTICED + RELATIVE * old
    held = gain > noticed or (gain > -noticed and average > NOTICED + RELATIVE * means[0])
    asked = ""
    if "by" in case.values:
        by = float(case.values["by"])
        held = gain >= by - max(SLACK, SLACK_RELATIVE * by) - TINY and gain > 0
        held |= sign < 0 and gain > noticed and _arrived(case)  # nothing comes closer than that
        asked = f" (asked for {by:g} m)"
    sentence = (
        f"the nearest distance to {case.name} went from {old:.3f} to {new:.3f} m{asked}, "
        f"the average from {means[0]:.3f} to {means[1]:.3f} m"
    )
    return Outcome(bool(held), sentence, gain)


def _arrived(case: _Case) -> bool:
    """Whether the path now passes the target at the gap at which closer() ends."""
    if not isinstance(case.target, SceneObject):
        return _surface(case, case.adapted) <= SLACK
    body = case.target.body(case.original[:, :3], SURFACE_GAP)
    return body.closest(case.adapted[:, :3])[0] <= SURFACE_GAP + SLACK


def _surface(case: _Case, rows: Array, part: Mask | None = None) -> float:
    """Distance [m] of a path, or a part of it, to the target's surface; to its centre if it has no dimensions."""
    return passes_at(case.target, rows[:, :3], np.ones(len(rows), dtype=bool) if part is None else part)


def _distance(case: _Case) -> Outcome:
    old = case.paired if case.paired.any() else np.ones(len(case.original), dtype=bool)
    new = case.new if case.new.any() else np.ones(len(case.adapted), dtype=bool)
    pairs = ((case.original, old), (case.adapted, new))
    asked = case.asked("at_least", "nearest", "at_most")
    bounds = []
    if asked.keys() != {"at_most"}:
        before, now = (_surface(case, rows, None if case.whole else part) for rows, part in pairs)
    if (least := asked.get("at_least")) is not None:
        sized = isinstance(case.target, SceneObject) and case.target.dimensions is not None
        said = f"at least {now:.3f} m from {'the surface of ' if sized else ''}{case.name} (asked {least:g} m)"
        bounds.append(_Bound(1.0, least, before, now, _hardly(least), said))
    if (nearest := asked.get("nearest")) is not None:
        said = f"{now:.3f} m from {case.name} at the nearest point (asked {nearest:g} m)"
        bounds.append(_Bound(0.0, nearest, before, now, _about(nearest), said))
    if (most := asked.get("at_most")) is not None:
        centre = point(case.target)
        before, now = (float(lengths(rows[part, :3] - centre).max()) for rows, part in pairs)
        said = f"at most {now:.3f} m from the centre of {case.name} (asked {most:g} m)"
        bounds.append(_Bound(-1.0, most, before, now, max(SLACK, KEPT_RELATIVE * most), said))
    return _bounded(bounds, "the path is ")


def _avoided(case: _Case) -> Outcome:
    """Whether the path keeps out of what is above or below an object, or between two."""
    other, gap = case.values.get("other"), float(case.values["gap"])
    second = None if other is None else case.scene[other["object"]] if "object" in other else other["point"]
    bodies = shut(case.values["way"], case.target, second, 0.0, case.adapted[:, :3], case.scene.frame)
    beside = min(body.closest(case.adapted[:, :3])[0] for body in bodies)
    passes = "passes" if beside < -TINY else f"stays {beside:.3f} m beside what is"
    return Outcome(beside >= gap - _hardly(gap), f"the path {passes} {case.values['way']} {case.name}")


def _moved(case: _Case) -> Outcome:
    shift = case.matched[case.paired, :3] - case.original[case.paired, :3]
    held, parts = True, []
    for word, asked in case.values["offset"].items():
        along = shift @ case.scene.frame.direction(word)
        mean, most = float(along.mean()), float(along.max())
        # Where an end is kept or edges are soft, the average falls short although the middle moves in full.
        held &= _close(mean, asked) or (_close(most, asked) and mean >= asked / 2)
        peak = "" if _close(most, mean) else f", {most:.3f} m at most"
        parts.append(f"{mean:.3f} m {word} on average{peak} (asked {asked:g} m)")
    held |= not case.by_index and _lies_there(case)
    asked_offset = case.offset
    length = float(np.linalg.norm(asked_offset))
    change = float(shift.mean(axis=0) @ asked_offset) / length if length else None
    return Outcome(bool(held), f"{case.part} moved {' and '.join(parts)}", change)


def _lies_there(case: _Case) -> bool:
    """Whether half of the part lies on the new path once it is shifted, but not on the old one.

    Where waypoints were spread anew over a path that grew in places, no waypoint has a counterpart at its own share.
    """
    there = case.original[case.old, :3] + case.offset
    slack = max(SLACK, SLACK_RELATIVE * float(np.linalg.norm(case.offset)))
    shares = [float((path_distances(rows[:, :3], there) <= slack).mean()) for rows in (case.adapted, case.original)]
    return shares[0] >= 0.45 and shares[1] < 0.2


def _same_path(case: _Case) -> Outcome:
    old, new = case.original[:, :3], case.adapted[:, :3]
    part = old[case.old]
    if len(old) == len(new):
        off = float(lengths(new[case.old] - part).max())
    else:
        back = path_distances(old, new[case.new]) if case.new.any() else np.zeros(1)
        off = max(path_distances(new, part).max(), back.max())
    allowed = 0.005 + 0.005 * float(arc_length(part)[-1])
    where = "" if case.whole else " there"
    sentence = f"the path deviates by at most {off:.3f} m{where} (up to {allowed:.3f} m is the same)"
    return Outcome(bool(off <= allowed), sentence)


def _same_speed(case: _Case) -> Outcome:
    old, new = case.original[case.paired, 3], case.matched[case.paired, 3]
    usual, off = max(float(old.mean()), AT_REST), np.abs(new - old)
    # A ramp from rest that limits demand touches a few waypoints only.
    held = abs(float(new.mean() - old.mean())) <= 0.05 * usual and float((off <= 0.1 * usual).mean()) >= 0.9
    sentence = f"the average speed went from {old.mean():.3f} to {new.mean():.3f} m/s, by up to {off.max():.3f} m/s"
    return Outcome(bool(held), sentence, unit="m/s")


def _side(case: _Case) -> Outcome:
    """How far on one side the path lies: from the surface for at_least, from the centre for at_most."""
    word, within = case.values["side"], case.values.get("within")
    axis = case.scene.frame.direction(word)
    centre, half, place = case.anchor(axis)
    parts = (None, None) if case.whole or not (case.paired.any() and case.new.any()) else (case.paired, case.new)
    pairs = zip((case.original, case.adapted), parts, strict=True)
    old, new = (_reaches(rows[:, :3] - centre, part, axis, within) for rows, part in pairs)
    if new is None:
        said = f"the path does not pass within {float(within or 0.0):g} m of {place}, seen along that side"
        return Outcome(False, said, 0.0)
    asked = case.asked("at_least", "at_most")
    amounts = dict.fromkeys(asked.values())
    exact = len(amounts) < len(asked)
    slack = _about if exact or within is not None else _hardly
    bounds = []
    for name, amount in asked.items():
        i, sign, inset = (0, 1.0, 0.0 if exact else half) if name == "at_least" else (1, -1.0, 0.0)
        now, surface = new[i] - inset, "the surface of " if inset else ""
        said = f"{name.replace('_', ' ')} {now:.3f} m {word} of {surface}{place}"
        bounds.append(_Bound(sign, amount, old and old[i] - inset, now, slack(amount), said))
    outcome = _bounded(bounds, "the path is ", f" (asked {' to '.join(f'{amount:g}' for amount in amounts)} m)")
    opposite = case.named and asked.get("at_least", -1.0) >= 0.0 and new[1] < 0.0
    return replace(outcome, change=min(outcome.change or 0.0, 0.0)) if opposite and not outcome.held else outcome


def _reaches(away: Array, part: Mask | None, axis: Array, within: float | None) -> tuple[float, float] | None:
    """The least and the greatest coordinate along an axis of a path (N, 3) [m], or of a part of it.

    With `within`, only of what lies at most so far from the axis, between waypoints too; None if nothing does.
    """
    along = away @ axis
    if within is None:
        chosen = along if part is None else along[part]
        return float(chosen.min()), float(chosen.max())
    aside = away - along[:, None] * axis
    start, step = aside[:-1], np.diff(aside, axis=0)
    # |start + t step| = within
    a, b, c = (step**2).sum(axis=1), (start * step).sum(axis=1), (start**2).sum(axis=1) - within**2
    root = np.sqrt(np.maximum(b**2 - a * c, 0.0))
    moving = a > 1e-18
    safe = np.where(moving, a, 1.0)
    low = np.where(moving, np.clip((-b - root) / safe, 0.0, 1.0), 0.0)
    high = np.where(moving, np.clip((-b + root) / safe, 0.0, 1.0), 1.0)
    middle = start + ((low + high) / 2.0)[:, None] * step
    inside = lengths(middle) <= within + 1e-9
    if part is not None:
        inside &= part[:-1] & part[1:]
    if not inside.any():
        return None
    rise = np.diff(along)
    ends = np.concatenate([(along[:-1] + share * rise)[inside] for share in (low, high)])
    return float(ends.min()), float(ends.max())


def _end(case: _Case, row: int, kind: str) -> Outcome:
    given = case.original[row, :3] + case.offset
    ends = (rows[row, :3] for rows in (case.original, case.adapted))
    old, miss = (float(np.linalg.norm(end - (case.place(end[None]) if case.named else given))) for end in ends)
    held = miss <= max(END_SLACK, SLACK_RELATIVE * float(np.linalg.norm(case.offset)))
    change = old - miss
    if not held and case.named and _beyond(case, case.adapted[[row, row], :3]):
        change = min(change, 0.0)
    offset = say(case.values["offset"]) if "offset" in case.values else ""
    if case.named:
        place = f"{offset} of {case.aimed}" if offset else case.aimed
    else:
        place = f"the place {offset} of the old {kind}" if offset else f"the old {kind}"
    return Outcome(held, f"the {kind} is {miss:.3f} m from {place}", change)


def _visits(case: _Case) -> Outcome:
    within = float(case.values["within"])
    old, distance = (_path_distance(rows, case.place(rows[:, :3])) for rows in (case.original, case.adapted))
    held = distance <= within + max(SLACK / 2.0, SLACK_RELATIVE * within)
    change = max(old - within, 0.0) - max(distance - within, 0.0)
    if not held and _beyond(case, case.adapted[:, :3]):
        change = min(change, 0.0)
    said = f"the path comes within {distance:.3f} m of {case.beside}{case.aimed} (asked {within:g} m)"
    return Outcome(held, said, change)


def _beyond(case: _Case, path: Array) -> bool:
    """Whether a path (N, 3), or an end of it twice, is on the other side of the target than the place that is meant.

    Nothing is left there of what was meant.
    """
    centre = point(case.target)
    _, at = closest_to_point(path, centre)
    nearest, level = interpolate(path, np.array([at]))[0], case.values.get("aim") == "level"
    return bool((nearest - centre) @ (case.place(path) - centre) < 0.0) and not level


def _pace(case: _Case, sign: float) -> Outcome:
    """Sign +1: faster, -1: slower."""
    old, new = float(case.original[case.paired, 3].mean()), float(case.matched[case.paired, 3].mean())
    held = sign * (new - old) > TINY + SPEED_CHANGE * old or (sign < 0 and new <= old <= AT_REST)
    ratio = f", {new / old:.2f} times as fast" if old > AT_REST else ""
    where = "" if case.whole else f" of {case.part}"
    sentence = f"the average speed{where} went from {old:.3f} to {new:.3f} m/s{ratio}"
    return Outcome(bool(held), sentence, sign * (new - old), "m/s")


def _speed(case: _Case) -> Outcome:
    if "value" in case.values:
        return _speed_value(case)
    bounds = []
    for name, asked in case.asked("at_least", "at_most").items():
        sign, which = (1.0, "lowest") if name == "at_least" else (-1.0, "highest")
        before = _extreme(case.original[:, 3], case.old, sign, asked)
        now = _extreme(case.adapted[:, 3], case.new, sign, asked)
        said = f"the {which} speed is {now:.3f} m/s (asked {name.replace('_', ' ')} {asked:g} m/s)"
        bounds.append(_Bound(sign, asked, before, now, max(AT_REST, KEPT_RELATIVE * asked), said))
    return _bounded(bounds, "", unit="m/s")


def _extreme(speeds: Array, part: Mask, sign: float, asked: float) -> float:
    """The lowest speed of a part but for stops (sign +1), or its highest; what was asked where there is none."""
    counted = part & ~_braking(speeds, part, asked) if sign > 0 else part
    counted = counted if counted.any() else part & (speeds > AT_REST)
    return sign * float((sign * speeds[counted]).min()) if counted.any() else asked


def _braking(speeds: Array, part: Mask, least: float) -> Mask:
    """Which waypoints (N,) are slower for a stop, in the part or beyond it."""
    return _stopping(np.where(part, speeds, np.inf), least) | _stopping(speeds, least)


def _stopping(speeds: Array, least: float) -> Mask:
    """Which waypoints (N,) are at rest, or slower than a least speed on the steady way to rest or away from it."""
    found = speeds <= AT_REST
    for a, b in runs(speeds < least):
        rest = a + np.flatnonzero(found[a : b + 1])
        if not len(rest) or (a == 0 and b == len(speeds) - 1):
            continue
        if (np.diff(speeds[a : rest[0] + 1]) <= TINY).all():
            found[a : rest[0]] = True
        if (np.diff(speeds[rest[-1] : b + 1]) >= -TINY).all():
            found[rest[-1] : b + 1] = True
    return found


def _speed_value(case: _Case) -> Outcome:
    asked = float(case.values["value"])
    # Where the robot starts from rest and brakes, the average falls short although most of the path is right.
    steady = case.new & ~_braking(case.adapted[:, 3], case.new, asked)
    rows = steady if 2 * steady.sum() > (case.new & (case.adapted[:, 3] > AT_REST)).sum() else case.new
    speeds = case.adapted[rows, 3] if rows.any() else case.matched[case.paired, 3]
    mean = float(speeds.mean())
    spread = f", from {speeds.min():.3f} to {speeds.max():.3f}" if np.ptp(speeds) > SLACK else ""
    sentence = f"the average speed is {mean:.3f} m/s{spread} (asked {asked:g} m/s)"
    old = float(case.original[case.paired, 3].mean()) if case.paired.any() else None
    change = None if old is None else (mean - old) * (1.0 if asked >= old else -1.0)
    return Outcome(_close(mean, asked) or _close(float(np.median(speeds)), asked), sentence, change, "m/s")


def _duration(case: _Case) -> Outcome:
    before, now = (travel_time(*of) for of in ((case.original, case.old), (case.adapted, case.new)))
    ((name, asked),) = case.asked("value", "at_most").items()
    slack = SLACK_RELATIVE * asked if name == "value" else KEPT_RELATIVE * asked
    said = f"{now:.3g} s (asked {'at most ' if name == 'at_most' else ''}{asked:g} s)"
    sign = 0.0 if name == "value" else -1.0
    return _bounded([_Bound(sign, asked, before, now, slack, said)], "the way takes ", unit="s")


def _stop(case: _Case) -> Outcome:
    speeds = case.adapted[:, 3]
    if not case.named:
        return Outcome(bool(speeds[-1] <= AT_REST), f"the speed at the end is {speeds[-1]:.3f} m/s")
    stopped = speeds <= AT_REST
    if not stopped.any():
        return Outcome(False, f"the robot never stops; its lowest speed is {speeds.min():.3f} m/s")
    if "before" in case.values:
        asked, at_rest = float(case.values["before"]), np.eye(len(speeds), dtype=bool)[stopped]
        gap = min((_surface(case, case.adapted, one) for one in at_rest), key=lambda found: abs(found - asked))
        return Outcome(_close(gap, asked), f"the robot stops {gap:.3f} m from {case.name} (asked {asked:g} m)")
    place = point(case.target) + case.offset
    distance = lengths(case.adapted[:, :3] - place)
    passed = float(distance.min())
    if not case.kept.all():
        # Cut short: the nearest point of the part that is left says nothing about the part that is gone.
        shift = lengths(case.matched[case.kept, :3] - case.original[case.kept, :3]).max()
        passed = min(passed, float(lengths(case.original[:, :3] - place).min() + shift))
    at, slack = float(distance[stopped].min()), max(0.05, 1.5 * spacing(case.adapted[:, :3]))
    # A path that is led on beyond its goal may pass by the place once more, and nearer.
    before = case.original[lengths(case.original[:, :3] - place).argmin(), :3]
    held = at <= passed + slack or bool(lengths(case.adapted[stopped, :3] - before).min() <= slack)
    said = f"the robot stops {at:.3f} m from {case.beside}{case.name} (the path comes within {passed:.3f} m)"
    return Outcome(held, said)


def _no_stop(case: _Case) -> Outcome:
    lowest = float(case.adapted[1:-1, 3][case.new[1:-1]].min(initial=np.inf))
    return Outcome(lowest > AT_REST, f"its lowest speed is {lowest:.3f} m/s")


def _length(case: _Case) -> Outcome:
    old, new = (float(arc_length(rows[:, :3])[-1]) for rows in (case.original, case.adapted))
    said = f"the path is {new:.3f} m long, and was {old:.3f} m"
    if "times" in case.values:
        asked = float(case.values["times"])
        change = (new - old) * (1.0 if asked >= 1.0 else -1.0)
        return Outcome(_close(new, asked * old), f"{said} (asked {asked:g} times as long)", change)
    sign, least = (1.0, "longer_by") if "longer_by" in case.values else (-1.0, "shorter_by")
    asked, gain = float(case.values[least]), sign * (new - old)
    word = least.removesuffix("_by")
    amount = f"{asked:g} m {word}" if asked else word
    return Outcome(gain > LONGER * old + TINY and gain >= asked - _about(asked), f"{said} (asked {amount})", gain)


def _smoother(case: _Case) -> Outcome:
    """The bends squared and summed, and how far out the farthest corner stands; waypoints are spread alike first.

    A corner between two short segments may be sharp and is no kink, so that angles do not decide of the sharpest.
    """
    paths = [(case.original, case.old), (case.adapted, case.new)]
    if len(case.original) != len(case.adapted):
        count = len(case.original)
        paths = [(interpolate(rows, source_indices(rows[:, :3], count, "arc_length")), part) for rows, part in paths]
        paths = [(rows, case.old) for rows, _ in paths]
    (old, was), (new, now) = (_bent(rows[:, :3], part) for rows, part in paths)
    held = new <= (1.0 - SMOOTHED) * old + TINY and now <= (1.0 + OUTER) * was + TINY
    said = f"the sum of squared bends went from {old:.3g} to {new:.3g}, the farthest corner stands out by {now:.3f} m"
    return Outcome(bool(held), f"{said}, and {was:.3f} m before")


def _bent(path: Array, part: Mask) -> tuple[float, float]:
    """The sum of the squared bends of a part of a path (N, 3) [rad^2], and how far a corner stands out at most [m].

    That is the distance of a waypoint to the line between its neighbours.
    """
    angles = turning_angles(path)[part]
    fresh = np.concatenate([[True], np.diff(path, axis=0).any(axis=1)])
    points, inside = path[fresh], part[fresh][1:-1]
    a, b, c = points[:-2][inside], points[1:-1][inside], points[2:][inside]
    chord = c - a
    share = np.clip(((b - a) * chord).sum(axis=1) / np.maximum((chord**2).sum(axis=1), 1e-300), 0.0, 1.0)
    return float((angles**2).sum()), float(lengths(b - a - share[:, None] * chord).max(initial=0.0))


def _waypoints(case: _Case) -> Outcome:
    asked, count = case.values["count"], len(case.adapted)
    return Outcome(count == asked, f"the path has {count} waypoints (asked {asked})")


def _acceleration(case: _Case) -> Outcome:
    """The rate by which the squared speed changes along the path, in the middle of its segments and on most of it."""
    asked, sign = float(case.values["rate"]), 1.0 if case.values["rate"] >= 0.0 else -1.0
    (old, _), (rate, share) = (
        _rates(rows, part, asked) for rows, part in ((case.original, case.old), (case.adapted, case.new))
    )
    if rate is None:
        return Outcome(asked < 0.0 and bool(case.adapted[case.new, 3].min() <= AT_REST), "the robot stands still there")
    said = f"the robot's acceleration is {rate:.3g} m/s^2 (asked {asked:g} m/s^2), on {share:.0%} of the way"
    return Outcome(_close(rate, asked) and share >= MOSTLY, said, sign * (rate - (old or 0.0)), "m/s^2")


def _rates(rows: Array, part: Mask, asked: float) -> tuple[float | None, float]:
    """The median acceleration of the segments in a part [m/s^2], and the share of their length that is near a rate."""
    steps = np.diff(arc_length(rows[:, :3]))
    v = rows[:, 3]
    inside = part[:-1] & part[1:] & (steps > TINY) & (v[1:] > AT_REST) & ((v[:-1] > AT_REST) | (asked > 0.0))
    if not inside.any():
        return None, 0.0
    rates, steps = np.diff(v**2)[inside] / (2.0 * steps[inside]), steps[inside]
    order = np.argsort(rates)
    middle = order[int(np.searchsorted(np.cumsum(steps[order]), steps.sum() / 2.0))]
    near = np.abs(rates - asked) <= max(2.0 * SLACK, 0.25 * abs(asked))
    return float(rates[middle]), float(steps[near].sum() / steps.sum())


def _path_distance(rows: Array, centre: Array) -> float:
    """Distance of a point (3,) to the polyline of rows (N, 3+) [m]."""
    return float(path_distances(rows[:, :3], centre[None])[0])


_CHECKS: dict[str, Callable[[_Case], Outcome]] = {
    "acceleration": _acceleration,
    "avoided": _avoided,
    "closer": lambda case: _approach(case, -1.0),
    "distance": _distance,
    "duration": _duration,
    "farther": lambda case: _approach(case, 1.0),
    "faster": lambda case: _pace(case, 1.0),
    "goal": lambda case: _end(case, -1, "goal"),
    "length": _length,
    "moved": _moved,
    "no_stop": _no_stop,
    "same_path": _same_path,
    "same_speed": _same_speed,
    "side": _side,
    "smoother": _smoother,
    "slower": lambda case: _pace(case, -1.0),
    "speed": _speed,
    "start": lambda case: _end(case, 0, "start"),
    "stop": _stop,
    "visits": _visits,
    "waypoints": _waypoints,
}
