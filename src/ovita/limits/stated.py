"""Reading the constraint text of a scene file, where it is simple; saying what was understood and what was not.

Understood are ranges of axes ("x -2 to 2", "z >= 0.1", "the z-coordinate is always 0", "a maximum y of 3"), a reach
("0.8 +- 0.2 m"), a distance to objects or people ("keep 0.1 m from obstacles"), top and least speed ("v_max = 0.5",
"no faster than 30 cm/s") and acceleration. Nothing is guessed: a sentence that asks for something else is handed back.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from ovita.paths.robot import Box, Robot, Shell, Vector
from ovita.units import LENGTHS, SPEEDS, Unit, to_si

FAR = 1e3
"""The bound of an axis that has none [m]."""

_N = r"([-+\u2212]?\s?(?:\d+(?:\.\d+)?|\.\d+))"


def _spelled(table: Iterable[Unit]) -> str:
    """A pattern for the units of a table, in the singular or plural, or none before a word that is no unit."""
    words = sorted({word for unit in table for word in unit.spellings}, key=len, reverse=True)
    return (
        r"\s*(?:((?:"
        + "|".join(map(re.escape, words))
        + rf")s?)(?![\w/])|(?![\w/%\u00b0])(?!\s+(?!{_NO_UNIT}\b)[a-z%]))"
    )


_NO_UNIT = (
    r"(?:to|and|or|but|from|away|of|around|in|at|on|for|with|while|along|all|every\w*|always|is|are|was|must|should|may|"
    r"[xyz]|respectively|over|under|above|below|between|within|when\w*|where\w*|unless|until|if|as|so|the|an?|each|any|by)"
)
"""Words that may follow a number without its being their unit."""


_UNIT = _spelled(LENGTHS)
_RATE = _spelled(SPEEDS)
_AXIS = r"\b([xyz])(?:[\s-]*(?:axis|coordinates?|values?|direction|position))?"
_BE = r"\s*(?:is|are|(?:must|should|may|has to)(?: be| stay| remain)?|stays?|remains?|be|kept|keep)?\s*"
_NOT = (
    r"(?:\b(?:no|not|never|cannot)|n't)"
    r"(?:\s+(?:be|go|get|move|drive|travel|fly|stay|come|drop|fall|rise|run|ever|to))*\s+"
)
_MORE = r"(?:above|over|beyond|greater than|more than|higher than|larger than|exceed(?:ing|s)?)"
_LESS = r"(?:below|under|less than|smaller than|lower than)"
_AT_LEAST = rf"(?:>=|=>|>|\u2265|at least|{_NOT}{_LESS}|{_MORE}|minimum|min\.?)"
_AT_MOST = rf"(?:<=|=<|<|\u2264|at most|{_NOT}{_MORE}|{_LESS}|maximum|max\.?|up to)"

_RANGES = (
    _AXIS
    + r"\s*(?:range)?s?\s*(?:is|are|must be|must stay|stays?|should be|=|:|in)?"
    + r"\s*(?:limited to)?\s*(?:between|from|within|in)?"
    + r"\s*[\[(]?\s*"
    + _N
    + _UNIT
    + r"\s*(?:to|and|\.\.+|,|;|\u2013|-)\s*"
    + _N
    + _UNIT
)
_SANDWICH = _N + r"\s*(?:<=|<|\u2264)\s*([xyz])\s*(?:<=|<|\u2264)\s*" + _N
_ONE_SIDED = (
    r"\b(max(?:imum)?|min(?:imum)?)\.?\s+(?:value of\s+)?([xyz])\b[\s-]*(?:coordinate|value|axis)?"
    r"\s*(?:of|is|=|:)?\s*" + _N
)
_AROUND = _AXIS + r"\s*(?:is|in|=|:)?\s*(?:\+/?-|\u00b1)\s*" + _N + _UNIT
_FIXED = (
    _AXIS
    + r"\s*(?:is|=|remains?|stays?|must be|must stay)\s*(?:always|fixed|constant|at|to|equal|\s)*\s*"
    + _N
    + _UNIT
    + r"(?!\s*(?:to|\.\.|and\s*[-+]?\d))"
)
_COMPARISON = f"(?:({_AT_LEAST})|({_AT_MOST}))" + r"\s*(?:of\s*)?"
_COMPARED = _AXIS + _BE + _COMPARISON + _N + _UNIT
_AND_COMPARED = _COMPARED + r"\s*(?:and|but)\s+" + _BE + _COMPARISON + _N + _UNIT
_TURNED = _N + _UNIT + r"\s*(?:(<=|<|\u2264)|(>=|>|\u2265))\s*([xyz])\b(?!\s*[<>=\u2264\u2265])"
_RADIUS = (
    r"\b(?:radius|reach)\s*(?:of|is|=|:|<=|at most|up to|limited to|within|\s)*\s*"
    + _N
    + _UNIT
    + r"(?:\s*(?:\+/?-|\u00b1)\s*"
    + _N
    + _UNIT
    + ")?"
)
_TOLERANCE = r"tolerance\s*(?:of|is|=|:)?\s*(?:\+/?-|\u00b1|\+)?\s*" + _N + _UNIT
_APART = (
    r"(?:distance|clearance|margin|keep|stay|remain)\b[^.;]*?" + _N + _UNIT + r"\s*(?:away\s*)?(?:from|to|of|around)\b"
)
_DISTANCE = _APART + r"[^.;\d]*?\b(?:objects?|obstacles?|everything)\b"
_PEOPLE = _APART + r"[^.;\d]*?\b(?:people|persons?|humans?)\b"
_PACE = r"(?:speed|velocity)"
_PACE_COMPARED = rf"\b(?:{_PACE}|v)\b[^.;]*?(?:({_AT_LEAST})|({_AT_MOST}|limited to))\s*(?:of\s*)?" + _N + _RATE
_PACE_NAMED = (
    r"\b(?:v[_ ]?(max|min)|(max|min|top)(?:imum|imal)?\.?[_ ]?(?:v\b|speed|velocity)|speed (limit))"
    r"\s*(?:=|:|<=|>=|<|>|\u2264|\u2265|is|of|at|\s)*" + _N + _RATE
)
_FASTER = rf"({_NOT})?(faster|quicker|slower) than\s*" + _N + _RATE
_RATED = _COMPARISON + _N + _RATE
_PACE_STATED = _PACE + r"\b[^.;]*?" + _N + _RATE
_A = r"(?:\s*(m/s\^?2|m/s\u00b2|met(?:re|er)s? per second squared)|(?!\s*(?!and\b|but\b|while\b)[a-z/\d]))"
_ACCELERATION = r"\b(?:acceleration\b[^.;]*?|a[_ ]?max\s*(?:=|:|<=|is|of)?\s*)" + _N + _A


@dataclass(frozen=True)
class TextLimits:
    """What a constraint text says.

    Args:
        ranges: Per axis "x", "y", "z" its lowest and highest coordinate [m]; infinite where only one is given.
        reach: Greatest distance from the robot's base [m], tolerance included, or None.
        obstacle_margin: Distance to keep from objects [m], or None.
        max_speed: [m/s], or None.
        min_speed: [m/s], or None.
        max_acceleration: Along the path [m/s^2], or None.
        person_margin: Distance to keep from people [m], or None.
        understood: Sentences on what was understood.
        ignored: Sentences and clauses of the text that ask for something that was not understood.
    """

    ranges: dict[str, tuple[float, float]] = field(default_factory=dict)
    reach: float | None = None
    obstacle_margin: float | None = None
    max_speed: float | None = None
    min_speed: float | None = None
    max_acceleration: float | None = None
    person_margin: float | None = None
    understood: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()

    def apply(self, robot: Robot, base: Vector | None = None) -> Robot:
        """The robot with these limits replacing its own; unstated ones are unchanged.

        An axis that must keep one value is given the robot's margin on both sides, so that the margin leaves it.

        Args:
            robot: Whose limits to replace.
            base: Position of the robot's base (3,) [m]; by default the centre of its shell, or the origin.
        """
        given = {key: getattr(self, key) for key in _SAID if getattr(self, key) is not None}
        if self.reach is not None:
            shell = robot.workspace if isinstance(robot.workspace, Shell) else Shell((0.0, 0.0, 0.0), 0.0, self.reach)
            given["workspace"] = Shell(base or shell.center, min(shell.r_min, self.reach / 2.0), self.reach)
        elif self.ranges:
            given["workspace"] = self._box(robot)
        return replace(robot, **given)

    def _box(self, robot: Robot) -> Box:
        old = robot.workspace if isinstance(robot.workspace, Box) else Box((-FAR,) * 3, (FAR,) * 3)
        corners = dict(zip("xyz", zip(old.lower, old.upper, strict=True), strict=True))
        for axis, (low, high) in self.ranges.items():
            pad = robot.margin if low == high else 0.0
            before = corners[axis]
            corners[axis] = low - pad if np.isfinite(low) else before[0], high + pad if np.isfinite(high) else before[1]
        (x0, x1), (y0, y1), (z0, z1) = corners.values()
        return Box((x0, y0, z0), (x1, y1, z1))


def parse_text(text: str) -> TextLimits:
    """Read a constraint text."""
    found = TextLimits()
    said: list[str] = []
    ignored: list[str] = []
    for sentence in re.split(r"(?<!\d)[.](?!\d)\s*|(?<=\d)[.](?=\s|$)|[;\n]+", text):
        clean = re.sub(r"^[-*\u2022]\s+", "", sentence.strip())
        known = 0
        for read in _READERS:
            found, words = read(clean, found)
            said += words
            known += bool(words)
        for part in _clauses(clean) if known else [clean]:
            if _asks(part) and not any(read(part, found)[1] for read in _READERS):
                ignored.append(part)
    return replace(found, understood=tuple(dict.fromkeys(said)), ignored=tuple(ignored))


_Read = Callable[[str, TextLimits], tuple[TextLimits, list[str]]]


def _each(pattern: str, sentence: str) -> Iterable[re.Match[str]]:
    return re.finditer(pattern, sentence.lower())


def _number(text: str) -> float:
    return float(text.replace(" ", "").replace("\u2212", "-"))


def _si(text: str, unit: str | None) -> float:
    return _number(text) * (1.0 if unit is None else to_si(1.0, unit)[0])


def _within(axis: str, a: float, b: float) -> tuple[str, float, float]:
    return axis, min(a, b), max(a, b)


def _beyond(axis: str, value: float, *, least: bool) -> tuple[str, float, float]:
    return (axis, value, np.inf) if least else (axis, -np.inf, value)


_AXIS_LIMITS: tuple[tuple[str, Callable[[re.Match[str]], tuple[str, float, float]]], ...] = (
    (_RANGES, lambda m: _within(m[1], _si(m[2], m[3] or m[5]), _si(m[4], m[5]))),
    (_SANDWICH, lambda m: _within(m[2], _number(m[1]), _number(m[3]))),
    (_AROUND, lambda m: _within(m[1], -_si(m[2], m[3]), _si(m[2], m[3]))),
    (_ONE_SIDED, lambda m: _beyond(m[2], _number(m[3]), least=m[1].startswith("min"))),
    (_FIXED, lambda m: _within(m[1], _si(m[2], m[3]), _si(m[2], m[3]))),
    (_COMPARED, lambda m: _beyond(m[1], _si(m[4], m[5]), least=bool(m[2]))),
    (_AND_COMPARED, lambda m: _beyond(m[1], _si(m[8], m[9]), least=bool(m[6]))),
    (_TURNED, lambda m: _beyond(m[5], _si(m[1], m[2]), least=bool(m[3]))),
)
"""Patterns of limits on one axis, and how each gives the axis and its lowest and highest coordinate [m]."""


def _ranges(sentence: str, found: TextLimits) -> tuple[TextLimits, list[str]]:
    new: dict[str, tuple[float, float]] = {}
    for pattern, read in _AXIS_LIMITS:
        for axis, low, high in map(read, _each(pattern, sentence)):
            if axis not in new or pattern is not _FIXED:
                new[axis] = _narrowed(new.get(axis), low, high)
    ranges = {**found.ranges, **{axis: _narrowed(found.ranges.get(axis), *limits) for axis, limits in new.items()}}
    return replace(found, ranges=ranges), [_range(axis, *limits) for axis, limits in new.items()]


def _narrowed(before: tuple[float, float] | None, low: float, high: float) -> tuple[float, float]:
    return (low, high) if before is None else (max(before[0], low), min(before[1], high))


def _range(axis: str, low: float, high: float) -> str:
    if low == high:
        return f"{axis} stays at {low:g} m"
    if np.isinf(high):
        return f"{axis} is at least {low:g} m"
    return f"{axis} is at most {high:g} m" if np.isinf(low) else f"{axis} stays within {low:g}..{high:g} m"


def _reach(sentence: str, found: TextLimits) -> tuple[TextLimits, list[str]]:
    for m in _each(_RADIUS, sentence):
        reach = _si(m[1], m[2] or m[4]) + (_si(m[3], m[4] or m[2]) if m[3] else 0.0)
        if reach <= 0:
            continue
        return replace(found, reach=reach), [f"the path stays within {reach:g} m of the robot's base"]
    for m in _each(_TOLERANCE, sentence):
        if found.reach is not None:
            reach = found.reach + _si(m[1], m[2])
            return replace(found, reach=reach), [f"with the tolerance, within {reach:g} m of the robot's base"]
    return found, []


_Found = Iterable[tuple[str, float]]


def _speeds(sentence: str) -> _Found:
    """Least and top speeds; without a unit only where the words are about speed."""
    found = [(bool(m[1]), _si(m[3], m[4])) for m in _each(_PACE_COMPARED, sentence)]
    found += [("min" in (m[1], m[2]), _si(m[4], m[5])) for m in _each(_PACE_NAMED, sentence)]
    found += [((m[2] == "slower") == bool(m[1]), _si(m[3], m[4])) for m in _each(_FASTER, sentence)]
    found += [(bool(m[1]), _si(m[3], m[4])) for m in _each(_RATED, sentence) if m[4]]
    found = found or [(False, _si(m[1], m[2])) for m in _each(_PACE_STATED, sentence) if m[2]]
    return [("min_speed" if least else "max_speed", value) for least, value in found if value > 0]


def _margins(sentence: str) -> _Found:
    patterns = {"obstacle_margin": _DISTANCE, "person_margin": _PEOPLE}
    return [(key, _si(m[1], m[2])) for key, pattern in patterns.items() for m in _each(pattern, sentence)]


def _accelerations(sentence: str) -> _Found:
    return [("max_acceleration", _number(m[1])) for m in _each(_ACCELERATION, sentence) if _number(m[1]) > 0]


_SAID = {
    "obstacle_margin": "the path keeps {:g} m from every object",
    "person_margin": "the path keeps {:g} m from every person",
    "min_speed": "the speed is at least {:g} m/s while moving",
    "max_speed": "the speed is at most {:g} m/s",
    "max_acceleration": "the acceleration is at most {:g} m/s^2",
}
"""Limits with one value each, and how they are confirmed."""


def _strictest(read: Callable[[str], _Found], sentence: str, found: TextLimits) -> tuple[TextLimits, list[str]]:
    """The limits of a sentence with those before it: of two that are about the same, the stricter one."""
    said = {}
    for key, value in read(sentence):
        before = getattr(found, key)
        pick = min if key.startswith("max") else max
        strictest: dict[str, Any] = {key: value if before is None else pick(before, value)}
        found = replace(found, **strictest)
        said[key] = _SAID[key].format(getattr(found, key))
    return found, list(said.values())


_JOINT = r",\s*(?:and\s+|but\s+)?|\s+(?:and|but|while)\s+"
_READERS: tuple[_Read, ...] = (
    _ranges,
    _reach,
    *(partial(_strictest, read) for read in (_speeds, _margins, _accelerations)),
)
_PATTERNS = (
    *(pattern for pattern, _ in _AXIS_LIMITS),
    *(_RADIUS, _TOLERANCE, _DISTANCE, _PEOPLE, _PACE_COMPARED, _PACE_NAMED, _FASTER, _RATED, _ACCELERATION),
)


def _clauses(sentence: str) -> list[str]:
    """A sentence cut at its commas and conjunctions, except inside what a pattern reads as one limit."""
    taken = [m.span() for pattern in _PATTERNS for m in _each(pattern, sentence)]
    cuts = [m for m in re.finditer(_JOINT, sentence) if not any(a < m.end() and m.start() < b for a, b in taken)]
    ends = [*(m.start() for m in cuts), len(sentence)]
    return [sentence[a:b].strip() for a, b in zip([0, *(m.end() for m in cuts)], ends, strict=True)]


def _asks(sentence: str) -> bool:
    """Whether a sentence asks for something, rather than introducing or describing."""
    words = r"must|should|never|always|avoid|limit|max|min|keep|stay|remain|cannot|not\b|only|within|exceed|faster|"
    words += r"slower|least|most|below|above|more than|less than|\d\S*\s*[cm]?m\b|"
    words += r"(?:speed|velocity|acceleration|clearance|margin|distance|height|altitude|jerk|tilt|angle)\b.*\d"
    asks = re.search(rf"\b(?:{words})|[<>=\u2264\u2265]", sentence.lower())
    return not sentence.endswith(":") and asks is not None
