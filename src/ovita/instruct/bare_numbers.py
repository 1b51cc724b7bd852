"""What a number without a unit counts, by what stands beside it: metres, metres per second, times, or waypoints."""

from __future__ import annotations

import re
from dataclasses import replace

from ovita.instruct.chunks import Chunk
from ovita.instruct.frames import Quantity

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
        before, behind = (" ".join(["", *(c.kind for c in part), ""]) for part in (made[:i], row[i + 1 :]))
        kind = next((k for k, b, a in COUNTED_UNITS if b.match(before) and a.match(behind.lstrip())), "Qn")
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
