"""Numbers and amounts with their units, in digits and in words, in SI."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile

from ovita.instruct.lexicon import stems
from ovita.units import LENGTHS, SPELLINGS

UNITS: Mapping[tuple[str, ...], tuple[str, float]] = {
    tuple(words.split()): (unit.dimension, unit.factor)
    for spelling, unit in SPELLINGS.items()
    for words in (spelling, spelling.replace("/", " / "))
}
"""Unit words in the singular, also those that a slash joins one by one, to (dimension, factor to SI)."""

LONGEST_UNIT = max(map(len, UNITS))

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
    "twos": 2.0,
    "threes": 3.0,
    "fours": 4.0,
    "fives": 5.0,
}

ORDINAL_WORDS = {
    "ninth": 9, "eleventh": 11, "twelfth": 12, "thirteenth": 13, "fourteenth": 14, "fifteenth": 15, "sixteenth": 16,
    "seventeenth": 17, "eighteenth": 18, "nineteenth": 19, "twentieth": 20, "thirtieth": 30, "fortieth": 40,
    "fiftieth": 50, "sixtieth": 60, "seventieth": 70, "eightieth": 80, "ninetieth": 90,
}  # fmt: skip
"""Ordinals that are no fraction anybody says: "the twentieth waypoint"."""

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


AMBIGUOUS = {"mil": "millimetres (mm) or thousandths of an inch (thou)"}
"""Words that people use for units of very different sizes, in the singular, and which ones; they are no unit."""


def ambiguous(text: str) -> str:
    """A question back where a text measures in a word that means very different units; else ""."""
    said = [word.strip(".,;:!?()") for word in text.lower().split()]
    for before, word in zip(["", *said], said, strict=False):
        unit = word.lstrip("0123456789.,").removesuffix("s")
        if unit in AMBIGUOUS and (word[:1].isdigit() or before[-1:].isdigit() or before in NUMBER_WORDS):
            return f"{unit!r} can be {AMBIGUOUS[unit]}: which is meant?"
    return ""


FAR = 5.0
"""Metres that are hardly meant where no unit is said and no path is known."""

CENTI = 0.01


def bare_unit(value: float, known: float | None, extent: float | None) -> float:
    """What one of the unit that a bare length is meant in is [m]: that of another length, centimetres, or metres.

    Args:
        value: As said.
        known: The unit of another length that is said [m], or None.
        extent: Diagonal of the path's bounding box [m], or None.
    """
    if known is not None and abs(value) >= 1.0:
        return known
    return CENTI if abs(value) >= 1.0 and abs(value) > (FAR if extent is None else extent) else 1.0


def as_said(words: Sequence[str]) -> str:
    """An amount in digits as it was said, "10cm"; "" for one in words, or in several numbers ("2 1/2")."""
    plain = is_digits(words[0]) and not any(map(is_digits, words[1:]))
    return "".join(words).replace("″", "in") if plain else ""


def is_digits(word: str) -> bool:
    """Whether a word is a number in digits."""
    return _DIGITS.fullmatch(word) is not None


_QUOTED, _INCHES = re.compile(r"(?<![\d ])[\"”]|(?<!\d) [\"”]"), re.compile(r"(?<=\d)[\"”]")
_RANGE = re.compile(r"(?<=\d)(?: ?[–—…] ?| ?\.{2,} ?)(?=\d)")
_PRODUCT = re.compile(r"\*=?\s*(\d+(?:\.\d+)?|\.\d+)(?![\d.]|\s*(?:k?m|cm|mm|s|%)\b)")


_SIGNED = r"([-−]?(?:\d+\.?\d*|\.\d+))"
_TRIPLE = re.compile(rf"[(\[] ?{_SIGNED}, ?{_SIGNED}, ?{_SIGNED} ?[)\]]")
_AXES = re.compile(
    rf"\bx ?[=:] ?{_SIGNED}[,;]? (?:and )?y ?[=:] ?{_SIGNED}[,;]? (?:and )?z ?[=:] ?{_SIGNED}(?! ?[\w%])"
)
_STEP = re.compile(rf"\b(?:by|offset|shift|translation|vector)(?: it)?(?: by| of)? {_TRIPLE.pattern}")


def _steps(found: re.Match[str]) -> str:
    """A step along the axes, where there is room for it in words."""
    values = zip("xyz", found.groups(), strict=True)
    along = " ".join(
        f"{axis}{'' if value[0] in '-−' else '+'}{value}" for axis, value in values if float(value.replace("−", "-"))
    )
    return along.ljust(len(found[0])) if along and len(along) <= len(found[0]) else found[0]


_HALF = re.compile(r"[- ](?:and|an'|'n')[- ]a[- ]half\b", re.IGNORECASE)


_LENGTH = r"(?: [\w.,]+){0,2} ?(?:(?:centi|milli)?met(?:re|er)s?|[cm]?m|feet|foot|ft|inch(?:es)?)"
_FROM = rf"(?={_LENGTH} (?:away|clear|off|from)\b)"
_KEEPING = "|".join(rf"(?<=\b{verb} )" for verb in ("keep", "stay", "stays", "remain", "be", "is", "always"))
_FAR_OFF = {
    re.compile(rf"(?:{_KEEPING}){word}{_FROM}", re.IGNORECASE): sign for word, sign in (("over", ">"), ("under", "<"))
}


def written_out(text: str) -> str:
    """A text as long as it was, with what says the same in other signs.

    "v *= 0.5" is "v 0.5x", "stay over 1 m from" "stay > 1 m from", "8..14" "8-14", 3" 3″, "foot-and-a-half"
    "foot and a half", "x=1, y=2, z=3" and "[1, 2, 3]" "(1, 2, 3)", and "by (0.1, 0, 0.2)" "x+0.1 z+0.2".
    """
    text = _STEP.sub(_steps, text)
    for point in (_AXES, _TRIPLE):
        text = point.sub(lambda found: f"({','.join(found.groups())})".replace("−", "-").ljust(len(found[0])), text)
    for pattern, sign in _FAR_OFF.items():
        text = pattern.sub(sign, text)
    if not _QUOTED.search(text):
        text = _INCHES.sub("″", text)
    text = _RANGE.sub(lambda found: "-".ljust(len(found[0])), text)
    text = _PRODUCT.sub(lambda found: f"{found[1]}x".rjust(len(found[0])), text)
    return _HALF.sub(" and a half", text)


def amount_at(words: Sequence[str], i: int) -> Amount | None:
    """The amount that begins at word i: "20 cm", "thirty five percent", "half a metre", "a metre and a half"."""
    amount, unit = _stated(words, i), unit_at(words, i)
    if amount is None and unit[0] in ("m", "s") and and_a_half(words, i + unit[2]):
        amount = Amount(unit[1], unit[0], unit[2])
    if amount is None or amount.unit not in ("m", "s") or not (words[i] in ONE or unit[2]):
        return amount
    half = and_a_half(words, i + amount.used)
    if half:
        return Amount(1.5 * amount.value, amount.unit, amount.used + half)
    cents = _centimetres_behind(words, i + amount.used - 1, 1) if amount.value == 1.0 else None
    return amount if cents is None else Amount(1.0 + cents[0], "m", amount.used + cents[1])


ONE = frozenset(("a", "an", "one", "1"))
"""What one of a unit is said by."""


def _stated(words: Sequence[str], i: int) -> Amount | None:
    """A number with its unit, or one of a unit."""
    if words[i] in ("factor", "times"):
        return _times(words, i)
    found = _plain(words, i)
    if found is None:
        return _of_a_unit(words, i)
    value, used = found
    used += and_a_half(words, i + used) if used else 0
    value += 0.5 if words[i + used - 1] == "half" else 0.0
    if i > 0 and words[i - 1] == "-":
        value = -value
    fraction = _fraction_behind(words, i, used)
    if fraction is not None:
        value, used = value * fraction[0], used + fraction[1]
    unit, factor, more = unit_behind(words, i + used)
    if not more:
        unit, factor = _unit_elsewhere(words, i, i + used)
        if not unit and value >= 1.0:
            unit, factor = _unit_before(words, i, i + used)
    cents = _centimetres_behind(words, i + used, more) if (unit, factor) == ("m", 1.0) and more else None
    if cents is not None:
        return Amount(value + cents[0], unit, used + more + cents[1])
    return Amount(value * factor, unit, used + more)


def _times(words: Sequence[str], i: int) -> Amount | None:
    """A factor behind its word: "a factor of two", "times three"."""
    at = i + 1 + (words[i + 1 : i + 2] == ["of"])
    times = _plain(words, at) if at < len(words) else None
    return None if times is None else Amount(times[0], "x", at - i + times[1])


def _centimetres_behind(words: Sequence[str], at: int, more: int) -> tuple[float, int] | None:
    """The "thirty" of "one metre thirty" [m] and its words, where it is no number of its own."""
    found = _plain(words, at + more) if words[at].startswith(("metre", "meter")) and at + more < len(words) else None
    if found is None or not 10.0 <= found[0] <= 99.0 or found[0] % 1.0:
        return None
    behind = "".join(words[at + more + found[1] : at + more + found[1] + 1])
    counted = unit_at(words, at + more + found[1])[2] or behind in COUNTED | TIMES
    return None if counted else (found[0] * 0.01, found[1])


STRAY = frozenset(
    word for unit in LENGTHS if unit.symbol in ("m", "dm", "cm", "mm", "in", "ft")
    for word in unit.spellings if len(word) > 1 and word not in ("unit", "in.", "foot", "millis", "centi")
)  # fmt: skip
"""Words that are surely a unit of length, even where no number stands before them."""

ANNOUNCING = frozenset(". , ; : - – — ( ) ! ? in are is mean meant".split())
"""What stands before a unit that is told apart from its number: "fifteen, centimetres", "all in mm"."""


def stray_unit(words: Sequence[str]) -> int | None:
    """Where the one unit of length stands that is told apart from its numbers ("right 15. Millimetres."), or None."""
    apart = [
        k for k, word in enumerate(words) if not STRAY.isdisjoint(stems(word)) and (not k or words[k - 1] in ANNOUNCING)
    ]
    return apart[0] if len(apart) == 1 else None


def unit_apart(words: Sequence[str]) -> int | None:
    """Where the unit of bare numbers is told by itself, or None."""
    at = stray_unit(words)
    return (
        at if at is not None and any((a := amount_at(words, i)) and a.unit == "m" for i in range(len(words))) else None
    )


def _unit_elsewhere(words: Sequence[str], i: int, behind: int) -> tuple[str, float]:
    """The unit of a bare number at i that counts nothing, where one is told apart from its number."""
    at = stray_unit(words)
    first = i - 3 if words[i - 1 : i] in (["to"], ["through"], ["and"]) else i - 1
    beside = {*words[max(first, 0) : i], *words[behind : behind + 1]}
    return unit_at(words, at)[:2] if at is not None and beside.isdisjoint(COUNTED | TIMES) else ("", 1.0)


WAYS = frozenset(
    """left right up down forward forwards back backward backwards upward upwards downward downwards leftward rightward
    higher lower ahead sideways from off""".split()
)
"""Words beside a number that make it a length where a length was said before."""

COUNTED = frozenset(
    "point points waypoint waypoints wp wps number step steps segment sample samples last first".split()
)
TIMES = frozenset("turn turns time times loop loops circle circles lap laps round rounds wave waves x %".split())
"""Words beside a number that counts something."""


def _unit_before(words: Sequence[str], i: int, behind: int) -> tuple[str, float]:
    """The unit of the length before a bare number at i that is one, too: "4 cm down and three to the left"."""
    after = [word for word in words[behind : behind + 3] if word not in ("to", "the", "more", "further")][:1]
    before = [word for word in words[max(i - 2, 0) : i] if word != "by"][-1:]
    if not WAYS & {*after, *before} or COUNTED & {*after, *before}:
        return "", 1.0
    for k in range(i - 1, 0, -1):
        unit, factor, used = unit_at(words, k)
        if used and unit == "m" and (is_digits(words[k - 1]) or words[k - 1] in NUMBER_WORDS):
            return unit, factor
    return "", 1.0


def _fraction_behind(words: Sequence[str], i: int, used: int) -> tuple[float, int] | None:
    """The "quarters of" in "three quarters of a metre"."""
    at = i + used + (words[i + used : i + used + 1] == ["-"])
    if at + 2 >= len(words) or words[i] not in NUMBER_WORDS:
        return None
    share = next((FRACTIONS[f] for f in stems(words[at]) if f in FRACTIONS), None)
    behind = at + 1 + (words[at + 1] == "of")
    behind += words[behind] in ("a", "an")
    if share is None or unit_at(words, behind)[0] != "m":
        return None
    return share, behind - i - used


def unit_at(words: Sequence[str], i: int) -> tuple[str, float, int]:
    """The unit that begins at word i: dimension, factor and words taken; ("", 1.0, 0) for none."""
    for length in range(min(LONGEST_UNIT, len(words) - i), 0, -1):
        for last in stems(words[i + length - 1]):
            for first in stems(words[i]) if length > 1 else (last,):
                key = (last,) if length == 1 else (first, *words[i + 1 : i + length - 1], last)
                if key in UNITS:
                    return (*UNITS[key], length)
    return "", 1.0, 0


def more_first(words: Sequence[str]) -> list[int]:
    """The order of words in which "ten more centimetres" is "more ten centimetres"."""
    order = list(range(len(words)))
    for at in range(len(words) - 1):
        before = _number_before(words, at) if words[at] in MORE and unit_at(words, at + 1)[2] else None
        if before is not None:
            order[before : at + 1] = [at, *range(before, at)]
    return order


def _number_before(words: Sequence[str], at: int) -> int | None:
    """Where an amount of up to three words begins that ends right before a word."""
    begins = range(max(at - 3, 0), at)
    return next((i for i in begins if (amount := amount_at(words, i)) and amount.used == at - i), None)


MORE = frozenset("more extra additional further".split())


def unit_behind(words: Sequence[str], i: int) -> tuple[str, float, int]:
    """The unit of length or time at word i, also behind a word such as in "two whole feet", with all words taken."""
    if words[i : i + 1] == ["in"] and ABOUT_INCHES.issuperset(words[i + 1 : i + 2]) and words[i + 2 : i + 3] != ["out"]:
        return "m", 0.0254, 1
    unit, factor, used = unit_at(words, i)
    if used or not FURTHER.issuperset(words[i : i + 1]):
        return unit, factor, used
    unit, factor, used = unit_at(words, i + 1)
    return (unit, factor, used + 1) if used and unit in ("m", "s") and words[i + 1] not in COUNTED else ("", 1.0, 0)


ABOUT_INCHES = frozenset(
    """. , ; : ! ? ) higher lower up down left right to toward towards away off from above below over clear closer
    nearer further farther wide high long deep radius swing swings amplitude gap clearance distance forward forwards
    back ahead and of""".split()
)
"""What stands behind an "in" that means inches: "3 in up", not "3 in the middle"."""

FURTHER = frozenset("whole full good solid clear generous decent".split())
"""What may stand between a number, or "a", and its unit: "two whole feet", "a good foot"."""


def _plain(words: Sequence[str], i: int) -> tuple[float, int] | None:
    """A number without its unit, and how many words it takes."""
    word, behind = words[i], list(words[i + 1 : i + 4])
    if is_digits(word):
        return _in_digits(word, behind)
    for vague, number in (("couple", 2.0), ("few", 3.0)):
        if used := _couple(words, i, vague):
            return number, used
    if dozens := _dozens(word, behind):
        return dozens
    if word == "point" and behind and behind[0] in NUMBER_WORDS and words[max(i - 1, 0)] not in POINTS:
        return _point_something(words, i)
    return _in_words(words, i) if word in NUMBER_WORDS else None


def _dozens(word: str, behind: Sequence[str]) -> tuple[float, int] | None:
    """A dozen, a hundred, half a dozen."""
    if word == "a" and behind[:1] in (["dozen"], ["hundred"]):
        return NUMBER_WORDS[behind[0]], 2
    if word == "half" and "dozen" in behind[:2] and behind[0] in ("a", "dozen"):
        return 6.0, 2 + list(behind).index("dozen")
    return None


def _point_something(words: Sequence[str], i: int) -> tuple[float, int] | None:
    """Five tenths of "point five"; None for a waypoint: "from point twelve"."""
    decimals, used = _decimals(words, i + 1)
    placed = bool(words[i - 1 : i]) and words[i - 1] in ("at", "from", "to", "until")
    a_waypoint = placed and NUMBER_WORDS[words[i + 1]] > 9.0
    return None if a_waypoint and not unit_at(words, i + used + 1)[2] else (decimals, used + 1)


def _couple(words: Sequence[str], i: int, vague: str) -> int:
    """The words of "a couple of", or "a few", also without "a" or "of" where a unit follows; 0 where it is not said."""
    at = i + (words[i] in ("a", "the"))
    behind = at + 1 + (words[at + 1 : at + 2] == ["of"])
    counts = words[at : at + 1] == [vague] and (behind - i == 3 or unit_behind(words, behind)[2])
    return behind - i if counts else 0


def _in_digits(word: str, behind: Sequence[str]) -> tuple[float, int]:
    """A number in digits, also the first of two or three as in "3/4" and "2 1/2"."""
    thousands = re.fullmatch(r"[1-9]\d*,\d{3}", word)
    value = float(word.replace(",", "" if thousands else "."))
    match behind:
        case ["/", below, *_] if is_digits(below) and float(below) > 0:
            return value / float(below), 3
        case [above, "/", below] if above.isdigit() and below.isdigit() and 0 < int(above) < int(below):
            return value + int(above) / int(below), 4
    return value, 1


POINTS = frozenset("end start starting goal drop way touchdown landing set target pick final turning".split())
"""Words of which a "point" behind them is one: "the end point two inches lower"."""


def _in_words(words: Sequence[str], i: int) -> tuple[float, int]:
    """Number words put together: "two hundred and thirty five", "two point five"."""
    value, used = _digit_by_digit(words, i) or (NUMBER_WORDS[words[i]], 1)
    while i + used < len(words):
        word, behind = words[i + used], "".join(words[i + used + 1 : i + used + 2])
        step, further = NUMBER_WORDS.get(word), NUMBER_WORDS.get(behind)
        if word == "point" and further is not None:
            decimals, more = _decimals(words, i + used + 1)
            return value + decimals, used + 1 + more
        if word == "and" and value >= 100 and further is not None and further < 100:
            value, used = value + further, used + 2
        elif (larger := _with_a_word(value, step)) is not None:
            value, used = larger, used + 1
        else:
            break
    return value, used


def _with_a_word(value: float, step: float | None) -> float | None:
    """A number with one more word: "two hundred", "twenty five"; None where the two do not go together."""
    if step == 100.0 and value < 100:
        return value * 100.0
    return value + step if step is not None and 0 < step < 10 and value >= 20 and value % 10 == 0 else None


def _digit_by_digit(words: Sequence[str], i: int) -> tuple[float, int] | None:
    """A number that is spelled: "one zero", as pilots do; None for fewer than two digits."""
    said = [f"{NUMBER_WORDS[w]:g}" for w in takewhile(lambda w: NUMBER_WORDS.get(w, 10.0) < 10.0, words[i:])]
    return (float("".join(said)), len(said)) if len(said) > 1 else None


def _decimals(words: Sequence[str], i: int) -> tuple[float, int]:
    digits, used = "", 0
    while i + used < len(words) and words[i + used] in NUMBER_WORDS and NUMBER_WORDS[words[i + used]] < 100:
        digits += f"{NUMBER_WORDS[words[i + used]]:g}"
        used += 1
    return float(f"0.{digits}"), used


def and_a_half(words: Sequence[str], i: int) -> int:
    """The words of "and a half" or "and half" at word i: 3 or 2, or 0 where it is not said."""
    return next((n for n, said in ((3, "and a half"), (2, "and half")) if " ".join(words[i : i + n]) == said), 0)


def _of_a_unit(words: Sequence[str], i: int) -> Amount | None:
    """Half a metre, a quarter of a metre, a metre, for a second."""
    at = i + (words[i] in ("a", "one"))
    share = FRACTIONS.get(words[at]) if at < len(words) else None
    if share is not None:
        return _share_of_a_unit(words, i, at, share)
    if at >= len(words) or words[i] not in ("a", "an"):
        return None
    at = i + 1 + any(word in FURTHER for word in words[i + 1 : i + 2])
    unit, factor, used = unit_at(words, at)
    timed = unit == "s" and i > 0 and words[i - 1] in ("for", "wait", "pause", "about", "than")
    measured = unit in ("m", "m/s") and words[at] not in ("m", "unit", "units")
    return Amount(factor, unit, at - i + used) if used and (timed or measured) else None


def _share_of_a_unit(words: Sequence[str], i: int, at: int, share: float) -> Amount | None:
    """A quarter of a metre: from word i on, with the share at word `at`."""
    begin = next((k for k in range(at + 1, len(words)) if words[k] not in ("of", "a", "an", "one")), len(words))
    unit, factor, used = unit_at(words, begin)
    measured = unit in ("m", "m/s", "m/s2") or (unit == "s" and begin > at + 1)
    return Amount(share * factor, unit, begin + used - i) if used and measured else None
