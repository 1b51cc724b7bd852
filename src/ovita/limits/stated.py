"""Reading the constraint text of a scene file, where it is simple; saying what was understood and what was not.

Understood are ranges of axes ("x -2 to 2", "the z-coordinate is always 0", "a maximum y of 3"), a reach ("a sphere with
the radius of 0.8 m around the base, tolerance +0.2 and -0.2"), a distance to objects ("keep 0.1 m from obstacles") and
a top speed ("at most 0.5 m/s"). Nothing is guessed: a sentence that asks for something else is handed back.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from ovita.paths.robot import Box, Robot, Shell, Vector

FAR = 1e3
"""Stands for no bound on an axis [m]."""

_N = r"([-+\u2212]?\s?(?:\d+(?:\.\d+)?|\.\d+))"
_UNIT = r"\s*(millimet(?:er|re)s?|centimet(?:er|re)s?|met(?:er|re)s?|mm|cm|m)?(?![\w/])"
_AXIS = r"\b([xyz])(?:[\s-]*(?:axis|coordinates?|values?|direction|position))?"
_SCALE = {"mm": 0.001, "mil": 0.001, "cm": 0.01, "cen": 0.01}

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
_RADIUS = r"\bradius\s*(?:of|is|=|:)?\s*" + _N + _UNIT + r"(?:\s*(?:\+/?-|\u00b1)\s*" + _N + _UNIT + ")?"
_TOLERANCE = r"tolerance\s*(?:of|is|=|:)?\s*(?:\+/?-|\u00b1|\+)?\s*" + _N + _UNIT
_DISTANCE = (
    r"(?:distance|clearance|margin|keep|stay|remain)\b[^.;]*?"
    + _N
    + _UNIT
    + r"\s*(?:away\s*)?(?:from|to|of|around)\b[^.;]*?\b(?:objects?|obstacles?)\b"
)
_SPEED = r"(?:speed|velocity)\b[^.;]*?" + _N + r"\s*(?:m/s|meters? per second|metres? per second)"


@dataclass(frozen=True)
class TextLimits:
    """What a constraint text says.

    Args:
        ranges: Per axis "x", "y", "z" its lowest and highest coordinate [m]; infinite where only one is given.
        reach: Greatest distance from the robot's base [m], tolerance included, or None.
        obstacle_margin: Distance to keep from objects [m], or None.
        max_speed: [m/s], or None.
        understood: Sentences on what was understood.
        ignored: Sentences of the text that ask for something that was not understood.
    """

    ranges: dict[str, tuple[float, float]] = field(default_factory=dict)
    reach: float | None = None
    obstacle_margin: float | None = None
    max_speed: float | None = None
    understood: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()

    def apply(self, robot: Robot, base: Vector | None = None) -> Robot:
        """The robot with these limits in place of its own; what the text leaves open stays as it is.

        An axis that must keep one value is given the robot's margin on both sides, so that the margin leaves it.

        Args:
            robot: Whose limits to replace.
            base: Where the robot stands (3,) [m]; by default the centre of its shell, or the origin.
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
        if self.obstacle_margin is not None:
            changed = replace(changed, obstacle_margin=self.obstacle_margin)
        if self.max_speed is not None:
            changed = replace(changed, max_speed=self.max_speed)
        return changed


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
        before = found
        for read in _READERS:
            found, words = read(clean, found)
            said += words
        if found == before and _asks(clean):
            ignored.append(clean)
    return replace(found, understood=tuple(dict.fromkeys(said)), ignored=tuple(ignored))


_Read = Callable[[str, TextLimits], tuple[TextLimits, list[str]]]


def _ranges(sentence: str, found: TextLimits) -> tuple[TextLimits, list[str]]:
    ranges = dict(found.ranges)
    new: dict[str, tuple[float, float]] = {}
    for m in _each(_RANGES, sentence):
        new[m[1]] = _sorted(_length(m[2], m[3] or m[5]), _length(m[4], m[5]))
    for m in _each(_SANDWICH, sentence):
        new[m[2]] = _sorted(_number(m[1]), _number(m[3]))
    for m in _each(_AROUND, sentence):
        new[m[1]] = _sorted(-_length(m[2], m[3]), _length(m[2], m[3]))
    for m in _each(_ONE_SIDED, sentence):
        low, high = new.get(m[2], (-np.inf, np.inf))
        value = _number(m[3])
        new[m[2]] = (low, value) if m[1].startswith("max") else (value, high)
    for m in _each(_FIXED, sentence):
        new.setdefault(m[1], (_length(m[2], m[3]), _length(m[2], m[3])))
    ranges.update(new)
    words = [
        f"{axis} stays at {low:g} m" if low == high else f"{axis} stays within {low:g}..{high:g} m"
        for axis, (low, high) in new.items()
    ]
    return replace(found, ranges=ranges), words


def _reach(sentence: str, found: TextLimits) -> tuple[TextLimits, list[str]]:
    for m in _each(_RADIUS, sentence):
        reach = _length(m[1], m[2]) + (_length(m[3], m[4] or m[2]) if m[3] else 0.0)
        if reach <= 0:
            continue
        return replace(found, reach=reach), [f"the path stays within {reach:g} m of the robot's base"]
    for m in _each(_TOLERANCE, sentence):
        if found.reach is not None:
            reach = found.reach + _length(m[1], m[2])
            return replace(found, reach=reach), [f"with the tolerance, within {reach:g} m of the robot's base"]
    return found, []


def _distance(sentence: str, found: TextLimits) -> tuple[TextLimits, list[str]]:
    for m in _each(_DISTANCE, sentence):
        margin = _length(m[1], m[2])
        if margin >= 0:
            return replace(found, obstacle_margin=margin), [f"the path keeps {margin:g} m from every object"]
    return found, []


def _speed(sentence: str, found: TextLimits) -> tuple[TextLimits, list[str]]:
    for m in _each(_SPEED, sentence):
        if _number(m[1]) > 0:
            return replace(found, max_speed=_number(m[1])), [f"the speed is at most {_number(m[1]):g} m/s"]
    return found, []


_READERS: tuple[_Read, ...] = (_ranges, _reach, _distance, _speed)


def _asks(sentence: str) -> bool:
    """Whether a sentence asks for something, rather than introducing or describing."""
    words = r"must|should|never|always|avoid|limit|max|min|keep|stay|remain|cannot|not\b|only|within|\d\S*\s*[cm]?m\b"
    return not sentence.endswith(":") and re.search(rf"\b(?:{words})", sentence.lower()) is not None


def _each(pattern: str, sentence: str) -> Iterable[re.Match[str]]:
    return re.finditer(pattern, sentence.lower())


def _number(text: str) -> float:
    return float(text.replace(" ", "").replace("\u2212", "-"))


def _length(text: str, unit: str | None) -> float:
    return _number(text) * _SCALE.get((unit or "m")[:3].rstrip(), _SCALE.get((unit or "m")[:2], 1.0))


def _sorted(a: float, b: float) -> tuple[float, float]:
    return (a, b) if a <= b else (b, a)
