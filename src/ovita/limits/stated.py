"""Reading the constraint text of a scene file, where it is simple; saying what was understood and what was not.

Understood are ranges of axes ("x -2 to 2", "z >= 0.1", "the z-coordinate is always 0", "a maximum y of 3"), a reach
("0.8 +- 0.2 m"), a distance to objects or people ("keep 0.1 m from obstacles"), top and least speed ("v_max = 0.5",
"no faster than 30 cm/s") and acceleration. Nothing is guessed: a sentence that asks for something else is handed back.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from ovita.paths.robot import Box, Robot, Shell, Vector
from ovita.units import LENGTHS, SPEEDS, Unit, to_si

FAR = 1e3
"""Stands for no bound on an axis [m]."""

_N = r"([-+\u2212]?\s?(?:\d+(?:\.\d+)?|\.\d+))"


def _spelled(table: Iterable[Unit]) -> str:
    """A pattern for the units of a table, in the singular or plural."""
    words = sorted({word for unit in table for word in unit.spellings}, key=len, reverse=True)
    return r"\s*((?:" + "|".join(map(re.escape, words)) + r")s?)?(?![\w/])"


_UNIT = _spelled(LENGTHS)
_RATE = _spelled(SPEEDS)
_AXIS = r"\b([xyz])(?:[\s-]*(?:axis|coordinates?|values?|direction|position))?"
_BE = r"\s*(?:is|are|(?:must|should|may|has to)(?: be| stay| remain)?|stays?|remains?|be|kept|keep)?\s*"
_AT_LEAST = (
    r"(?:>=|=>|>|\u2265|at least|above|over|no less than|not less than|no lower than|not below|never below|"
    r"not be below|greater than|more than|higher than|larger than|minimum|min\.?)"
)
_AT_MOST = (
    r"(?:<=|=<|<|\u2264|at most|below|under|no more than|not more than|no higher than|not above|never above|"
    r"not be above|never be above|not be over|not be higher than|not exceed|never exceed|less than|smaller than|"
    r"lower than|maximum|max\.?|up to)"
)

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
_COMPARED = _AXIS + _BE + f"(?:({_AT_LEAST})|({_AT_MOST}))" + r"\s*" + _N + _UNIT
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
_DISTANCE = _APART + r"[^.;]*?\b(?:objects?|obstacles?|everything)\b"
_PEOPLE = _APART + r"[^.;]*?\b(?:people|persons?|humans?)\b"
_SPEED = r"(?:speed|velocity|faster|slower|exceed)\b[^.;]*?" + _N + _RATE
_V_MAX = r"\b(?:v[_ ]?max|max[_ ]?v|max[_ ]?(?:speed|velocity))\s*(?:=|:|<=|<|\u2264|is|of|\s)\s*" + _N + _RATE
_V = r"\bv\s*(?:<=|<|\u2264)\s*" + _N + _RATE
_SLOWEST = r"(?:speed|velocity|\bv)\b[^.;]*?(?:at least|minimum|no less than|not below|>=|>|\u2265)\s*" + _N + _RATE
_V_MIN = r"(?:\bv[_ ]?min|\bmin(?:imum)?[_ ]?(?:speed|velocity)|slower than)\s*(?:=|:|is|of|\s)?\s*" + _N + _RATE
_ACCELERATION = (
    r"acceleration\b[^.;]*?" + _N + r"\s*(?:m/s\^?2|m/s\u00b2|metres? per second squared|meters? per second squared)"
)


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
        changed = robot
        if self.ranges:
            old = robot.workspace if isinstance(robot.workspace, Box) else Box((-FAR,) * 3, (FAR,) * 3)
            lower, upper = list(old.lower), list(old.upper)
            for axis, (low, high) in self.ranges.items():
                k, pad = "xyz".index(axis), robot.margin if low == high else 0.0
                lower[k] = low - pad if np.isfinite(low) else lower[k]
                upper[k] = high + pad if np.isfinite(high) else upper[k]
            box = Box((lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2]))
            changed = replace(changed, workspace=box)
        if self.reach is not None:
            shell = robot.workspace if isinstance(robot.workspace, Shell) else None
            center = base or (shell.center if shell else (0.0, 0.0, 0.0))
            inner = min(shell.r_min, self.reach / 2.0) if shell else 0.0
            changed = replace(changed, workspace=Shell(center, inner, self.reach))
        single = ("obstacle_margin", "max_speed", "min_speed", "max_acceleration", "person_margin")
        given = {key: getattr(self, key) for key in single if getattr(self, key) is not None}
        return replace(changed, **given)


def parse_text(text: str) -> TextLimits:
    """Read a constraint text.

    Args:
        text: Free English text, such as `Scene.constraints_text`.
    """
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


def _ranges(sentence: str, found: TextLimits) -> tuple[TextLimits, list[str]]:
    ranges = dict(found.ranges)
    new: dict[str, tuple[float, float]] = {}
    for m in _each(_RANGES, sentence):
        new[m[1]] = _sorted(_si(m[2], m[3] or m[5]), _si(m[4], m[5]))
    for m in _each(_SANDWICH, sentence):
        new[m[2]] = _sorted(_number(m[1]), _number(m[3]))
    for m in _each(_AROUND, sentence):
        new[m[1]] = _sorted(-_si(m[2], m[3]), _si(m[2], m[3]))
    for m in _each(_ONE_SIDED, sentence):
        low, high = new.get(m[2], (-np.inf, np.inf))
        value = _number(m[3])
        new[m[2]] = (low, value) if m[1].startswith("max") else (value, high)
    for m in _each(_FIXED, sentence):
        new.setdefault(m[1], (_si(m[2], m[3]), _si(m[2], m[3])))
    for m in _each(_COMPARED, sentence):
        low, high = new.get(m[1], (-np.inf, np.inf))
        value = _si(m[4], m[5])
        new[m[1]] = (max(low, value), high) if m[2] else (low, min(high, value))
    for m in _each(_TURNED, sentence):
        low, high = new.get(m[5], (-np.inf, np.inf))
        value = _si(m[1], m[2])
        new[m[5]] = (max(low, value), high) if m[3] else (low, min(high, value))
    for axis, (low, high) in new.items():
        before = ranges.get(axis, (-np.inf, np.inf))
        ranges[axis] = (max(before[0], low), min(before[1], high))
    words = [_range(axis, *bounds) for axis, bounds in new.items()]
    return replace(found, ranges=ranges), words


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


def _distance(sentence: str, found: TextLimits) -> tuple[TextLimits, list[str]]:
    said: list[str] = []
    for pattern, things, whom in ((_DISTANCE, True, "object"), (_PEOPLE, False, "person")):
        for m in _each(pattern, sentence):
            margin = _si(m[1], m[2])
            if margin >= 0 and not said:
                found = replace(found, obstacle_margin=margin) if things else replace(found, person_margin=margin)
                said.append(f"the path keeps {margin:g} m from every {whom}")
    return found, said


def _speed(sentence: str, found: TextLimits) -> tuple[TextLimits, list[str]]:
    for pattern in (_SLOWEST, _V_MIN):
        for m in _each(pattern, sentence):
            value = _si(m[1], m[2])
            if value > 0:
                return replace(found, min_speed=value), [f"the speed is at least {value:g} m/s while moving"]
    for pattern in (_V_MAX, _V, _SPEED):
        for m in _each(pattern, sentence):
            value = _si(m[1], m[2])
            if value > 0 and (m[2] or pattern is not _SPEED):
                return replace(found, max_speed=value), [f"the speed is at most {value:g} m/s"]
    return found, []


def _acceleration(sentence: str, found: TextLimits) -> tuple[TextLimits, list[str]]:
    for m in _each(_ACCELERATION, sentence):
        if _number(m[1]) > 0:
            return replace(found, max_acceleration=_number(m[1])), [f"the acceleration is at most {m[1]} m/s^2"]
    return found, []


_JOINT = r",\s*(?:and\s+|but\s+)?|\s+(?:and|but|while)\s+"
_PATTERNS = (
    *(_RANGES, _SANDWICH, _ONE_SIDED, _AROUND, _FIXED, _COMPARED, _TURNED, _RADIUS, _TOLERANCE),
    *(_DISTANCE, _PEOPLE, _SPEED, _V_MAX, _V, _SLOWEST, _V_MIN, _ACCELERATION),
)
_READERS: tuple[_Read, ...] = (_ranges, _reach, _distance, _speed, _acceleration)


def _clauses(sentence: str) -> list[str]:
    """A sentence cut at its commas and conjunctions, except inside what a pattern reads as one limit."""
    taken = [m.span() for pattern in _PATTERNS for m in _each(pattern, sentence)]
    cuts = [m for m in re.finditer(_JOINT, sentence) if not any(a < m.end() and m.start() < b for a, b in taken)]
    ends = [*(m.start() for m in cuts), len(sentence)]
    return [sentence[a:b].strip() for a, b in zip([0, *(m.end() for m in cuts)], ends, strict=True)]


def _asks(sentence: str) -> bool:
    """Whether a sentence asks for something, rather than introducing or describing."""
    words = r"must|should|never|always|avoid|limit|max|min|keep|stay|remain|cannot|not\b|only|within|exceed|faster|"
    words += r"slower|least|most|below|above|more than|less than|\d\S*\s*[cm]?m\b"
    asks = re.search(rf"\b(?:{words})|[<>=\u2264\u2265]", sentence.lower())
    return not sentence.endswith(":") and asks is not None


def _each(pattern: str, sentence: str) -> Iterable[re.Match[str]]:
    return re.finditer(pattern, sentence.lower())


def _number(text: str) -> float:
    return float(text.replace(" ", "").replace("\u2212", "-"))


def _si(text: str, unit: str | None) -> float:
    return _number(text) * (1.0 if unit is None else to_si(1.0, unit)[0])


def _sorted(a: float, b: float) -> tuple[float, float]:
    return (a, b) if a <= b else (b, a)
