# ruff: noqa: E501
"""From chunks to constituents: the patterns applied in order, and numbers with the units that stand beside them.

A pattern is a row of classes ("a|b" for either, "?", "*" and "+" as in regular expressions); what it matches becomes
one chunk, or several.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from ovita.instruct.chunks import Build, Chunk
from ovita.instruct.frames import Quantity
from ovita.instruct.patterns import PATTERNS

GROUPS = {
    "LENGTH": "Qm", "ANYQ": "Qm|Qv|Qa|Qs|Qdeg|Qpc|Qx|Qstep|Qn", "SHARE": "Qpc|half|third|quarter|tenth|fifth",
    "SPAN": "Qm|Qs|Qpc|Qstep|half|third|quarter|tenth|fifth", "AT": "at|by|on|in|near|around|over|within|along",
    "HIGHER": "up|raise|over|height", "LOWER": "down|lower|under", "FIRST": "first|1st", "LAST": "last|nth", "END": "start|goal|ends", "LINK": "to|thru|before",
    "DIR": "left|right|front|back|up|down", "BEFORE_OBJ": "at|by|on|in|near|around|over|within|along|to|toward|from|of|off|than|under|thru|with|for",
    "FLIPS": "touch|avoid|left|right|front|back|up|down|closer|near|farther|faster|slower|larger|smaller|raise|lower|wait|"
             "more_curve|less_curve|inc|dec",
}  # fmt: skip


@dataclass(frozen=True)
class Pattern:
    """A row of classes, what must follow it if it ends in "(?=...)" or "(?!...)", and what it becomes."""

    build: Build
    regex: re.Pattern[str]


def _pattern(classes: str, build: Build) -> Pattern:
    pieces = []
    named, _, ahead = classes.partition(" (?")
    for piece in named.split():
        repeat = piece[-1] if piece[-1] in "?*+" else ""
        names = "|".join(GROUPS.get(name, name) for name in piece.removesuffix(repeat).split("|"))
        pieces.append(f"(?:(?:{names}) ){repeat}")
    return Pattern(build, re.compile(r"(?<!\S)" + "".join(pieces) + ("(?" + ahead if ahead else "")))


_PATTERNS = tuple(_pattern(classes, build) for classes, build in PATTERNS)


def constituents(found: Sequence[Chunk], reach: float = 1.0) -> list[Chunk]:
    """Chunks put together by the patterns, without the words that ask for nothing.

    Args:
        found: The chunks of an utterance.
        reach: The longest length [m] that a number without a unit may be.
    """
    row = with_units([c for c in found if c.kind not in ("filler", "approx")], reach)
    row = [replace(c, kind=_past(row[:i])) if c.kind == "past" else c for i, c in enumerate(row)]
    for pattern in _PATTERNS:
        row = _rewritten(row, pattern)
    return row


def turned(found: Sequence[Chunk]) -> list[Chunk]:
    """The words of an utterance that others turn round, as what they come to: "too close" as farther."""
    return [c for c in constituents(found) if c.value == "flipped"]


def _past(before: Sequence[Chunk]) -> str:
    """Hurrying past something is done beside it, left past it is a side of it; what comes past it comes after it."""
    sided = bool(before) and before[-1].kind in ("left", "right") and all(c.kind != "path" for c in before)
    return "by" if any(c.kind in ("faster", "slower", "pass") for c in before[-2:]) else "pass" if sided else "after"


def _counted_unit(before: Sequence[Chunk], behind: Sequence[Chunk]) -> str:
    """The class of a bare number by what stands before and behind it."""
    early, late = (" ".join(["", *(c.kind for c in part), ""]) for part in (before, behind))
    return next((kind for kind, b, a in COUNTED_UNITS if b.match(early) and a.match(late.lstrip())), "Qn")


def _rewritten(row: list[Chunk], pattern: Pattern) -> list[Chunk]:
    text = "".join(c.kind + " " for c in row)
    matches = list(pattern.regex.finditer(text))
    if not matches:
        return row
    made: list[Chunk] = []
    at = 0
    for match in matches:
        begin = text.count(" ", 0, match.start())
        end = text.count(" ", 0, match.end())
        chunk = pattern.build(row[begin:end]) if end > begin >= at else None
        if chunk is not None:
            made += [*row[at:begin], *(chunk if isinstance(chunk, list) else [chunk])]
            at = end
    return made + row[at:]


LENGTHS = (
    "within|left|right|front|back|up|down|raise|lower|closer|"
    "farther|distance|gap|threshold|extend|hop|hover|height|radius|size|plus|minus"
)
NO_COUNT = "(?!waypoints|times|turns|laps|waves|double)"
COUNTED_UNITS = tuple(
    (kind, re.compile(rf"(?:.* )?(?:{before}) $"), re.compile(after))
    for kind, before, after in (
        ("Qn", r"first|1st|last|nth|every|waypoints|(?:waypoints|from|between) Qn (?:to|and|thru|before)", ""),
        ("Qx", r"(?:multiply|resize)(?: \S+){0,4} by", ""),
        ("Qm", r"(?:keep|never|wait) (?:over|under|up|down)", NO_COUNT),
        ("Qv", r"(?:speed|vmax|vmin|constant)(?: (?:of|to|at|max|min|at_most|at_least|limit))*", NO_COUNT),
        ("Qm", rf"(?:{LENGTHS})(?: (?:of|by|to|at|with|in|path|whole|max|min|at_most|at_least|distance))*", NO_COUNT),
        ("Qv", ".*", "speed"),
        ("Qm", ".*", rf"(?:from|off|ground|{LENGTHS})"),
    )
)
"""What a number without a unit counts, by what stands before and behind it: "left by 0.2", "0.3 away from it"."""


def with_units(row: list[Chunk], reach: float) -> list[Chunk]:
    """Give bare numbers the unit that what stands beside them calls for: that of the other lengths, or metres."""
    known = next((c for c in row if c.kind == "Qm" and c.text[0].isdigit() and c.number.value), None)
    factor = known.number.value / float(known.text.split()[0].replace(",", ".")) if known is not None else 1.0
    made = list(row)
    for i, item in enumerate(row):
        if item.kind != "Qn" or item.q is None or not (item.q.said or known):
            continue
        kind = _counted_unit(made[:i], row[i + 1 :])
        if kind in ("Qm", "Qv") and item.q.value * factor > reach:
            continue
        said = "" if known else item.q.said + "m"
        q = {
            "Qm": Quantity(item.q.value * factor, "m", "by", said),
            "Qv": replace(item.q, unit="m/s", said=item.q.said + "m/s"),
            "Qx": replace(item.q, unit="x", said=item.q.said + "x"),
        }
        made[i] = replace(item, kind=kind, q=q.get(kind, item.q))
    return made
