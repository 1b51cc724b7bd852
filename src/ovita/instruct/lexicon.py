"""The words that the built-in writer knows, and how much they say.

Concepts and the words and phrases that stand for them are in `words/*.txt`, grouped by concept. To teach the writer a
word, add it to the line of its concept. Inflected forms (-s, -ed, -ing, -ly, -er, -est) are found by themselves.
How much: digits and number words with their units, in SI, and what words of degree come to in a given scene.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, lru_cache
from importlib.resources import files
from itertools import takewhile
from typing import Literal

import numpy as np

from ovita.errors import OvitaError
from ovita.paths.scene import SceneObject
from ovita.paths.trajectory import Array, Trajectory
from ovita.units import LENGTHS, SPELLINGS

PLAIN = "plain"
"""The concept of words that ask for nothing by themselves."""

DETERMINERS = frozenset("the a an your its my our their this that these those some any his her well".split())
"""Words that may stand between the words of a phrase: "keep your distance"."""

CONNECTIVES = frozenset({"and", "then", "but", "also", "plus", "whereas", "finally", "next", "yet"})

COMPARING = frozenset("too so less not no never that once twice".split())
"""Words that turn what follows them round; phrases that begin with one are composed by the reader."""

ALIKE = {"away": "farther", "increase": "inc", "decrease": "dec",
         "through": "thru", "beyond": "after", "fewer": "dec", "pass": "pass", "remove": "trim"}  # fmt: skip
"""Concepts of `words/` and the classes of `terms/` that they belong to."""

IRREGULAR = {
    "went": "go", "gone": "go", "kept": "keep", "held": "hold", "brought": "bring", "drove": "drive", "driven": "drive",
    "flew": "fly", "flown": "fly", "rose": "rise", "risen": "rise", "sank": "sink", "sunk": "sink", "swung": "swing",
    "spun": "spin", "fell": "fall", "fallen": "fall", "ran": "run", "began": "begin", "begun": "begin", "took": "take",
    "taken": "take", "made": "make", "shrunk": "shrink", "shrank": "shrink", "bent": "bend", "slid": "slide",
    "drew": "draw", "drawn": "draw", "grown": "grow", "stood": "stand", "came": "come", "got": "get", "sped": "speed",
    "dove": "dive", "crept": "creep", "withdrawn": "withdraw", "chosen": "choose", "done": "do", "goes": "go",
    "does": "do",
}  # fmt: skip


FEEDBACK = "feedback.txt"
"""The file of words about what was just done, which `concepts` reads by itself."""


@cache
def concepts(only: str = "", folder: str = "words") -> dict[str, tuple[str, ...]]:
    """Every concept with its phrases; those about earlier turns are in a file that is read only by name.

    Raises:
        OvitaError: If a line of a word file names no concept.
    """
    found: dict[str, str] = {}
    for file in sorted(files("ovita.instruct").joinpath(folder).iterdir(), key=lambda f: f.name):
        if not file.name.endswith(".txt") or (file.name != only if only else file.name == FEEDBACK):
            continue
        concept = ""
        for line in file.read_text(encoding="utf-8").splitlines():
            if not line.strip() or line.startswith("#"):
                continue
            rest = line
            if not line[0].isspace():
                concept, colon, rest = line.partition(":")
                if not colon:
                    raise OvitaError(f"{file.name}: {line!r} names no concept; write 'concept: word, phrase, ...'")
            found[concept] = f"{found[concept]} {rest}" if concept in found else rest
    return {
        concept: tuple(" ".join(p.split()) for p in listed.split(",") if p.strip()) for concept, listed in found.items()
    }


@cache
def phrases() -> dict[tuple[str, ...], str]:
    """Every phrase, as a tuple of words, to its concept; of words that stand in two concepts the first counts."""
    table: dict[tuple[str, ...], str] = {}
    for concept, listed in concepts().items():
        for phrase in listed:
            if concept != PLAIN or " " in phrase:
                table.setdefault(tuple(phrase.split()), concept)
    return table


@cache
def filler() -> frozenset[str]:
    """The single words that ask for nothing."""
    return frozenset(word for word in concepts()[PLAIN] if " " not in word)


@dataclass
class _Node:
    """A place in the tree of phrases: the words that may follow, and the concept of the phrase that ends here."""

    following: dict[str, _Node] = field(default_factory=dict)
    concept: str = ""


@cache
def _tree() -> _Node:
    return _planted(phrases())


@cache
def terms() -> dict[tuple[str, ...], str]:
    """Every phrase of the classes of `terms/`, and then those of the concepts of the same meaning."""
    table: dict[tuple[str, ...], str] = {}
    classes = concepts(folder="terms")
    for concept, listed in (*classes.items(), *((ALIKE.get(c, c), said) for c, said in concepts().items())):
        for phrase in listed:
            words = tuple(phrase.split())
            if concept in classes and (phrase in classes[concept] or words[0] not in COMPARING):
                table.setdefault(words, concept)
    return table


@cache
def _terms() -> _Node:
    return _planted(terms())


def term_at(words: Sequence[str], i: int) -> tuple[str, int]:
    """The class of the longest phrase that begins at word i, and its number of words; ("", 0) for none."""
    return _longest(_terms(), words, i, 0, 0)[:2]


def _planted(table: Mapping[tuple[str, ...], str]) -> _Node:
    root = _Node()
    for words, concept in table.items():
        node = root
        for word in words:
            node = node.following.setdefault(word, _Node())
        node.concept = concept
    return root


def concept_at(words: Sequence[str], i: int) -> tuple[str, int]:
    """The concept of the longest phrase that begins at word i, and its number of words; ("", 0) for none."""
    concept, used, _ = _longest(_tree(), words, i, 0, 0)
    return concept, used


def _longest(node: _Node, words: Sequence[str], i: int, used: int, bent: int) -> tuple[str, int, int]:
    """The longest phrase from this node on: concept, words, inflected words (fewer win)."""
    best = (node.concept, used, bent) if node.concept else ("", 0, 0)
    if i + used >= len(words):
        return best
    word = words[i + used]
    whole = node.following.get(word)
    forms = stems(word) if not used else (word, *(w for w in stems(word) if word == w + "s"))
    for form in (word,) if whole is not None and whole.concept else forms:
        child = node.following.get(form)
        if child is not None:
            found = _longest(child, words, i, used + 1, bent + (form != word))
            if found[0] and (found[1], -found[2]) > (best[1], -best[2]):
                best = found
    if used and word in DETERMINERS and word not in node.following:
        found = _longest(node, words, i, used + 1, bent)
        if found[0] and found[1] > used + 1 and found[1] > best[1]:
            best = found
    return best


ENDINGS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("ing", ("", "e")),
    ("ied", ("y",)),
    ("ies", ("y",)),
    ("ed", ("", "e")),
    ("es", ("", "e")),
    ("s", ("",)),
    ("ily", ("y",)),
    ("ly", ("", "le")),
    ("iest", ("y",)),
    ("ier", ("y",)),
    ("est", ("", "e")),
    ("er", ("", "e")),
)


@lru_cache(maxsize=4096)
def stems(word: str) -> tuple[str, ...]:
    """The word itself and the base forms that it may be inflected from."""
    found = [word]
    if word in IRREGULAR:
        found.append(IRREGULAR[word])
    for ending, replacements in ENDINGS:
        if word.endswith(ending) and len(word) > len(ending) + 2:
            base = word[: -len(ending)]
            found += [base + r for r in replacements]
            if len(base) > 3 and base[-1] == base[-2]:
                found.append(base[:-1])
    return tuple(dict.fromkeys(found))


@cache
def known_words() -> frozenset[str]:
    """Every word of a phrase, and every filler word."""
    return filler() | {word for phrase in phrases() for word in phrase}


def is_known(word: str) -> bool:
    """Whether a word is one of the word files."""
    return not known_words().isdisjoint(stems(word))


def is_filler(word: str) -> bool:
    """Whether a word asks for nothing by itself."""
    return any(form in filler() for form in stems(word))


UNITS: Mapping[tuple[str, ...], tuple[str, float]] = {
    tuple(spelling.split()): (unit.dimension, unit.factor) for spelling, unit in SPELLINGS.items()
}
"""Unit words in the singular to (dimension, factor to SI)."""

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


def is_digits(word: str) -> bool:
    """Whether a word is a number in digits."""
    return _DIGITS.fullmatch(word) is not None


_PRODUCT = re.compile(r"\*=?\s*(\d+(?:\.\d+)?|\.\d+)(?![\d.]|\s*(?:k?m|cm|mm|s|%)\b)")


_HALF = re.compile(r"[- ](?:and|an'|'n')[- ]a[- ]half\b", re.IGNORECASE)


def written_out(text: str) -> str:
    """A text as long as it was with "v *= 0.5" as "v 0.5x", and with "foot-and-a-half" as "foot and a half"."""
    text = _PRODUCT.sub(lambda found: f"{found[1]}x".rjust(len(found[0])), text)
    return _HALF.sub(" and a half", text)


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
    used += and_a_half(words, i + used) if used else 0
    value += 0.5 if words[i + used - 1] == "half" else 0.0
    if i > 0 and words[i - 1] == "-":
        value = -value
    fraction = _fraction_behind(words, i, used)
    if fraction is not None:
        value, used = value * fraction[0], used + fraction[1]
    unit, factor, more = unit_at(words, i + used)
    if not more:
        unit, factor = _unit_elsewhere(words, i, i + used)
        if not unit and value >= 1.0:
            unit, factor = _unit_before(words, i, i + used)
    cents = _centimetres_behind(words, i + used, more) if (unit, factor) == ("m", 1.0) and more else None
    if cents is not None:
        return Amount(value + cents[0], unit, used + more + cents[1])
    return Amount(value * factor, unit, used + more)


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
    beside = {*words[max(i - 1, 0) : i], *words[behind : behind + 1]}
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
    if i + used + 2 >= len(words) or words[i] not in NUMBER_WORDS:
        return None
    share = next((FRACTIONS[f] for f in stems(words[i + used]) if f in FRACTIONS), None)
    skipped = 1 + (words[i + used + 1] == "of") + (words[i + used + 2] in ("a", "an"))
    if share is None or unit_at(words, i + used + skipped)[0] != "m":
        return None
    return share, skipped


def unit_at(words: Sequence[str], i: int) -> tuple[str, float, int]:
    """The unit that begins at word i: dimension, factor and words taken; ("", 1.0, 0) for none."""
    for length in range(min(LONGEST_UNIT, len(words) - i), 0, -1):
        for last in stems(words[i + length - 1]):
            for first in stems(words[i]) if length > 1 else (last,):
                key = (last,) if length == 1 else (first, *words[i + 1 : i + length - 1], last)
                if key in UNITS:
                    return (*UNITS[key], length)
    return "", 1.0, 0


def _plain(words: Sequence[str], i: int) -> tuple[float, int] | None:
    """A number without its unit, and how many words it takes."""
    word, behind = words[i], list(words[i + 1 : i + 3])
    if is_digits(word):
        return _in_digits(word, behind)
    if word in ("a", "the") and behind == ["couple", "of"]:
        return 2.0, 3
    if word == "a" and behind[:1] in (["dozen"], ["hundred"]):
        return NUMBER_WORDS[behind[0]], 2
    if word == "half" and "dozen" in behind and behind[0] in ("a", "dozen"):
        return 6.0, 2 + behind.index("dozen")
    if word == "point" and behind and behind[0] in NUMBER_WORDS:
        decimals, used = _decimals(words, i + 1)
        a_waypoint = (
            NUMBER_WORDS[behind[0]] > 9.0 and words[i - 1 : i] and words[i - 1] in ("at", "from", "to", "until")
        )
        return None if a_waypoint and not unit_at(words, i + used + 1)[2] else (decimals, used + 1)
    return _in_words(words, i) if word in NUMBER_WORDS else None


def _in_digits(word: str, behind: Sequence[str]) -> tuple[float, int]:
    """A number in digits, or the first of two as in "3/4"."""
    thousands = re.fullmatch(r"[1-9]\d*,\d{3}", word)
    value = float(word.replace(",", "" if thousands else "."))
    if len(behind) == 2 and behind[0] == "/" and is_digits(behind[1]) and float(behind[1]) > 0:
        return value / float(behind[1]), 3
    return value, 1


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
        elif step == 100.0 and value < 100:
            value, used = value * 100.0, used + 1
        elif step is not None and 0 < step < 10 and value >= 20 and value % 10 == 0:
            value, used = value + step, used + 1
        else:
            break
    return value, used


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
        begin = next((k for k in range(at + 1, len(words)) if words[k] not in ("of", "a", "an", "one")), len(words))
        unit, factor, used = unit_at(words, begin)
        timed = unit == "s" and begin > at + 1
        measured = timed or unit in ("m", "m/s", "m/s2")
        return Amount(share * factor, unit, begin + used - i) if used and measured else None
    if at >= len(words) or words[i] not in ("a", "an"):
        return None
    at = i + 1 + any(word in FULL for word in words[i + 1 : i + 2])
    unit, factor, used = unit_at(words, at)
    timed = unit == "s" and i > 0 and words[i - 1] in ("for", "wait", "pause", "about", "than")
    measured = unit in ("m", "m/s") and words[at] not in ("m", "unit", "units")
    return Amount(factor, unit, at - i + used) if used and (timed or measured) else None


FULL = frozenset("good full whole solid clear generous decent".split())
"""What may stand before a unit: "a good foot"."""


Degree = Literal["slight", "moderate", "large"]

DEGREES: tuple[Degree, ...] = ("slight", "moderate", "large")

STEP_SHARE: dict[Degree, float] = {"slight": 0.05, "moderate": 0.12, "large": 0.22}
"""Share of the path's extent that a displacement of each degree covers."""

SLOWER: dict[Degree, float] = {"slight": 0.75, "moderate": 0.5, "large": 0.25}
FASTER: dict[Degree, float] = {"slight": 1.25, "moderate": 1.5, "large": 2.0}
"""Factors on the speed where an instruction gives a degree and no amount."""

NEAR_SHARE = 0.15
"""Half the length of the stretch that is "near an object" on a straight path, as a share of the path's extent."""


END_SHARE = 0.25
"""Share of the waypoints that "at the start" or "at the end" means."""

NEAR_WAYPOINTS = 0.1
"""Least share of the waypoints that are "near an object", so that sparse waypoints have some too."""


def extent_of(positions: Array | None) -> float | None:
    """Diagonal of the bounding box of a path (N, 3) [m]; None without a path."""
    return float(np.linalg.norm(np.ptp(positions, axis=0))) if positions is not None and len(positions) else None


@dataclass(frozen=True)
class Scale:
    """Sizes that words of degree stand for.

    Args:
        extent: Diagonal of the path's bounding box [m].
    """

    extent: float

    @classmethod
    def of(cls, trajectory: Trajectory) -> Scale:
        """The scale of a trajectory; a path without extent counts as 1 m."""
        extent = extent_of(trajectory.positions)
        return cls(extent if extent and extent > 1e-9 else 1.0)

    def step(self, degree: Degree) -> float:
        """Displacement for a degree [m], to two digits."""
        return nice(STEP_SHARE[degree] * self.extent)

    def describe(self) -> str:
        """What words of degree amount to, as a prompt says it."""
        shift, slower, faster = (
            "/".join(f"{of[degree]:g}" for degree in DEGREES)
            for of in ({degree: self.step(degree) for degree in DEGREES}, SLOWER, FASTER)
        )
        return f"slightly/plain/much: {shift} m, slower x{slower}, faster x{faster}."

    def near(self, positions: Array, item: SceneObject, kept: float = 0.0) -> float:
        """Distance to the object's centre that counts as near a path [m].

        On a straight path that passes at distance d, the sphere of radius sqrt(d^2 + h^2) holds a stretch of length 2h;
        so the radius is never so small that no waypoint is near, nor so large that all are.

        Args:
            positions: The path, (N, 3) [m].
            item: The object.
            kept: Distance [m] to its centre to which the path is pushed out before it is asked what is near.
        """
        distances = np.maximum(np.sort(item.distance(positions)), kept)
        few = distances[min(math.ceil(NEAR_WAYPOINTS * len(distances)), len(distances)) - 1]
        return nice(max(math.hypot(float(distances[0]), NEAR_SHARE * self.extent), float(few)))


def nice(value: float) -> float:
    """Round up to two significant digits, so that knobs read well."""
    if value <= 0:
        return 0.0
    digits = 1 - math.floor(math.log10(value))
    step = 10.0**digits
    return round(math.ceil(value * step - 1e-9) / step, max(digits, 0))
