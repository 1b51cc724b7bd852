"""Reading amounts: digits and number words, with their units, in SI."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ovita.instruct.lexicon import stems
from ovita.units import SPELLINGS

UNITS: Mapping[tuple[str, ...], tuple[str, float]] = {
    tuple(spelling.split()): (unit.dimension, unit.factor) for spelling, unit in SPELLINGS.items()
}
"""Unit words in the singular to (dimension, factor to SI)."""

_ONES = (
    "zero one two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen sixteen seventeen"
)
_TENS = "twenty thirty forty fifty sixty seventy eighty ninety"
NUMBER_WORDS: dict[str, float] = {
    **{w: float(i) for i, w in enumerate(f"{_ONES} eighteen nineteen".split())},
    **{w: 20.0 + 10.0 * i for i, w in enumerate(_TENS.split())},
    "nought": 0.0,
    "hundred": 100.0,
    "dozen": 12.0,
}

FRACTIONS = {
    "half": 0.5,
    "third": 1 / 3,
    "quarter": 0.25,
    "fourth": 0.25,
    "fifth": 0.2,
    "sixth": 1 / 6,
    "eighth": 0.125,
}
FRACTIONS |= {"tenth": 0.1, "hundredth": 0.01}

_DIGITS = re.compile(r"\d+(?:[.,]\d+)?|\.\d+")


@dataclass(frozen=True)
class Amount:
    """A number that begins at a word.

    Args:
        value: In SI units, a share for %.
        unit: "", "m", "m/s", "%", "x" (times), "step", "s" or "deg".
        used: How many words it takes.
    """

    value: float
    unit: str
    used: int


def is_digits(word: str) -> bool:
    """Whether a word is a number in digits."""
    return _DIGITS.fullmatch(word) is not None


def amount_at(words: Sequence[str], i: int) -> Amount | None:
    """The amount that begins at word i ("20 cm", "thirty five percent", "half a metre", "a couple of seconds")."""
    if words[i] in ("factor", "times"):
        at = i + 1 + (words[i + 1 : i + 2] == ["of"])
        times = _plain(words, at) if at < len(words) else None
        return None if times is None else Amount(times[0], "x", at - i + times[1])
    found = _plain(words, i)
    if found is None:
        return _of_a_unit(words, i)
    value, used = found
    used += _and_a_half(words, i + used) if used else 0
    value += 0.5 if words[i + used - 1] == "half" else 0.0
    if i > 0 and words[i - 1] == "-":
        value = -value
    fraction = _fraction_behind(words, i, used)
    if fraction is not None:
        value, used = value * fraction[0], used + fraction[1]
    unit, factor, more = unit_at(words, i + used)
    return Amount(value * factor, unit, used + more)


def _fraction_behind(words: Sequence[str], i: int, used: int) -> tuple[float, int] | None:
    """The "quarters of" in "three quarters of a metre"."""
    if i + used + 2 >= len(words) or words[i] not in NUMBER_WORDS:
        return None
    share = next((FRACTIONS[f] for f in stems(words[i + used]) if f in FRACTIONS), None)
    skipped = 1 + (words[i + used + 1] == "of") + (words[i + used + 2] in ("a", "an"))
    if share is None or unit_at(words, i + used + skipped)[0] != "m":
        return None
    return share, skipped


def unit_at(words: Sequence[str], i: int) -> tuple[str, float, int]:
    """The unit that begins at word i: dimension, factor and words taken; ("", 1.0, 0) for none."""
    for length in range(min(3, len(words) - i), 0, -1):
        for last in stems(words[i + length - 1]):
            for first in stems(words[i]) if length > 1 else (last,):
                key = (last,) if length == 1 else (first, *words[i + 1 : i + length - 1], last)
                if key in UNITS:
                    return (*UNITS[key], length)
    return "", 1.0, 0


def _plain(words: Sequence[str], i: int) -> tuple[float, int] | None:
    """A number without its unit."""
    word = words[i]
    if is_digits(word):
        thousands = re.fullmatch(r"[1-9]\d*,\d{3}", word)
        value = float(word.replace(",", "" if thousands else "."))
        if i + 2 < len(words) and words[i + 1] == "/" and is_digits(words[i + 2]) and float(words[i + 2]) > 0:
            return value / float(words[i + 2]), 3
        return value, 1
    if word in ("a", "the") and words[i + 1 : i + 3] == ["couple", "of"]:
        return 2.0, 3
    if word == "a" and words[i + 1 : i + 2] in (["dozen"], ["hundred"]):
        return NUMBER_WORDS[words[i + 1]], 2
    if word == "point" and i + 1 < len(words) and words[i + 1] in NUMBER_WORDS:
        decimals, used = _decimals(words, i + 1)
        return decimals, used + 1
    if word not in NUMBER_WORDS:
        return None
    value, used = NUMBER_WORDS[word], 1
    while i + used < len(words):
        following = words[i + used]
        step = NUMBER_WORDS.get(following)
        if following == "and" and value >= 100 and words[i + used + 1 : i + used + 2] != []:
            step = NUMBER_WORDS.get(words[i + used + 1])
            if step is None or step >= 100:
                break
            value, used = value + step, used + 2
        elif step == 100.0 and value < 100:
            value, used = value * 100.0, used + 1
        elif step is not None and step < 10 and value >= 20 and value % 10 == 0 and step > 0:
            value, used = value + step, used + 1
        elif following == "point" and i + used + 1 < len(words) and words[i + used + 1] in NUMBER_WORDS:
            decimals, more = _decimals(words, i + used + 1)
            return value + decimals, used + 1 + more
        else:
            break
    return value, used


def _decimals(words: Sequence[str], i: int) -> tuple[float, int]:
    digits, used = "", 0
    while i + used < len(words) and words[i + used] in NUMBER_WORDS and NUMBER_WORDS[words[i + used]] < 100:
        digits += f"{NUMBER_WORDS[words[i + used]]:g}"
        used += 1
    return float(f"0.{digits}"), used


def _and_a_half(words: Sequence[str], i: int) -> int:
    return 3 if list(words[i : i + 3]) == ["and", "a", "half"] else 0


def _of_a_unit(words: Sequence[str], i: int) -> Amount | None:
    """Half a metre, a quarter of a metre, a metre, for a second."""
    at = i + (words[i] in ("a", "one"))
    if at >= len(words):
        return None
    share = FRACTIONS.get(words[at])
    if share is not None:
        skipped = 1
        while at + skipped < len(words) and words[at + skipped] in ("of", "a", "an", "one"):
            skipped += 1
        unit, factor, used = unit_at(words, at + skipped)
        if used and (unit in ("m", "m/s") or (unit == "s" and skipped > 1)):
            return Amount(share * factor, unit, at + skipped + used - i)
        return None
    if words[i] in ("a", "an"):
        unit, factor, used = unit_at(words, i + 1)
        before = words[i - 1] if i > 0 else ""
        timed = unit == "s" and before in ("for", "wait", "pause", "about", "than")
        if used and (timed or (unit in ("m", "m/s") and words[i + 1] not in ("m", "unit", "units"))):
            return Amount(factor, unit, 1 + used)
    return None
