"""Units as people write them: one table of spellings with what each means in SI.

Dimensions are named by their SI unit: "m", "m/s", "m/s2", "s", "deg" (angles are in degrees throughout), "%" (a share),
"x" (a factor), "step" (timesteps), "Hz".
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Unit:
    """A unit of measure.

    Args:
        symbol: As ovita writes it, such as "cm".
        dimension: The SI unit it is converted to.
        factor: What one of it is in that SI unit.
        spellings: How people write it, in lower case and in the singular.
    """

    symbol: str
    dimension: str
    factor: float
    spellings: tuple[str, ...]


def _unit(symbol: str, dimension: str, factor: float, spellings: str) -> Unit:
    return Unit(symbol, dimension, factor, tuple(s.strip() for s in spellings.split(",")))


LENGTHS = (
    _unit("m", "m", 1.0, "m, metre, meter, unit"),
    _unit("dm", "m", 0.1, "dm, decimetre, decimeter"),
    _unit("cm", "m", 0.01, "cm, centimetre, centimeter, cms, centi"),
    _unit("mm", "m", 0.001, "mm, millimetre, millimeter, mms, millis"),
    _unit("km", "m", 1000.0, "km, kilometre, kilometer, kms"),
    _unit("in", "m", 0.0254, "inch, inches, in., ″"),
    _unit("ft", "m", 0.3048, "ft, foot, feet, ′"),
    _unit("yd", "m", 0.9144, "yard, yd"),
    _unit("fathom", "m", 1.8288, "fathom"),
    _unit("thou", "m", 2.54e-5, "thou"),
    _unit(
        "hand",
        "m",
        0.1,
        "hand, hand's width, hands width, handwidth, hand width, palm, hand's breadth, handbreadth, handspan",
    ),
    _unit("finger", "m", 0.02, "finger, finger's width, fingers width, finger width, finger's breadth"),
    _unit("arm", "m", 0.7, "arm's length, arms length, armlength"),
)

_RATES = ("{}/s", "{} per second", "{} a second", "{} per sec", "{} / s", "{} per s", "{} / second", "{} each second")
_RATES_OF_RATES = (
    "{}/s2", "{}/s^2", "{}/s²", "{}/s/s", "{} per second squared", "{} a second squared", "{} per s squared",
    "{} per second per second", "{} per second^2", "{} per square second",
)  # fmt: skip
_STEPS = (
    "timestep, time step, step, tick, time tick, frame, cycle, iteration, time unit, clock tick, time instant, "
    "instant, control step, sampling step, beat, time interval, interval, time slot, period, time period, moment, "
    "slot, control cycle, time point, turn of time"
)


def _per(symbol: str, dimension: str, patterns: tuple[str, ...]) -> tuple[Unit, ...]:
    """A unit for each length, such as its speed, whose spellings are patterns of the length's."""
    return tuple(
        Unit(symbol.format(u.symbol), dimension, u.factor, tuple(p.format(w) for w in u.spellings for p in patterns))
        for u in LENGTHS
    )


ACCELERATIONS = _per("{}/s^2", "m/s2", _RATES_OF_RATES)

SPEEDS = (
    *_per("{}/s", "m/s", _RATES),
    _unit("m/s", "m/s", 1.0, "mps, m s"),
    _unit("in/s", "m/s", 0.0254, "in/s, in/sec, in per second, ips"),
    _unit("kt", "m/s", 0.514444, "kt, knot, kts"),
    _unit("mph", "m/s", 0.44704, "mph, mile per hour, mile an hour"),
    _unit("m/min", "m/s", 1 / 60, "m/min, metre per minute, meter per minute, metre a minute, meter a minute"),
    _unit("mm/min", "m/s", 1e-3 / 60, "mm/min, millimetre per minute, millimeter per minute"),
    _unit("km/h", "m/s", 1 / 3.6, "km/h, kph, kmh, kilometre per hour, kilometer per hour, km per hour"),
)

TABLE: tuple[Unit, ...] = (
    *LENGTHS,
    *SPEEDS,
    *ACCELERATIONS,
    _unit("%", "%", 0.01, "%, percent, per cent, percentage, pct, procent, prozent, pourcent"),
    _unit("times", "x", 1.0, "time, x, fold"),
    _unit("timesteps", "step", 1.0, _STEPS),
    _unit("s", "s", 1.0, "s, sec, second"),
    _unit("ms", "s", 0.001, "ms, millisecond"),
    _unit("min", "s", 60.0, "min, minute"),
    _unit("deg", "deg", 1.0, "degree, deg, °"),
    _unit("rad", "deg", math.degrees(1.0), "rad, radian"),
    _unit("Hz", "Hz", 1.0, "hz, hertz"),
)

SPELLINGS: Mapping[str, Unit] = {spelling: unit for unit in TABLE for spelling in unit.spellings}


def find(word: str) -> Unit | None:
    """The unit that a word means, in any case, singular or plural; None if it means none."""
    key = " ".join(word.lower().split())
    for candidate in (key, key.removesuffix("s"), key.replace("metres", "metre").replace("meters", "meter")):
        if candidate in SPELLINGS:
            return SPELLINGS[candidate]
    return None


def symbol(word: str) -> str:
    """How ovita writes the unit that a word means, such as "cm"; "" if it means none."""
    unit = find(word)
    return "" if unit is None else unit.symbol


def dimension(word: str) -> str:
    """The SI unit that a unit is converted to: "m" for "cm"; "" if the word means no unit."""
    unit = find(word)
    return "" if unit is None else unit.dimension


def to_si(value: float, word: str) -> tuple[float, str]:
    """A value in a unit as (value, SI unit): `to_si(5, "cm")` is `(0.05, "m")`.

    Raises:
        ValueError: If the word is no unit.
    """
    unit = find(word)
    if unit is None:
        raise ValueError(f"{word!r} is no unit of measure; write m, cm, mm, km, in, ft, s, m/s, km/h, deg, rad or %")
    return value * unit.factor, unit.dimension
