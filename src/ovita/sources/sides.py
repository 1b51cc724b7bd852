"""Sides of the robot that a sentence tells: "with the tower on my right", "keep the lamp to the left"."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ovita.sources.places import BEHIND, HAVING, SEEN, TURNED, Location, Relation, Text, phrase_at, way_words

BEING = way_words("being")
"""What may stand between a thing and its side."""

KEPT: dict[str, Relation] = {**BEHIND, "to the left": "left", "to the right": "right"}
"""Sides that are the robot's where a thing is to be kept on them."""

BEFORE = 3
"""Words between the word for keeping and the thing."""


@dataclass(frozen=True, eq=False)
class SeenSide:
    """A thing with the side of the robot on which it is to be passed, and the pieces of the text that tell it."""

    place: Location
    pieces: range


def seen_sides(text: Text) -> list[SeenSide]:
    """The things that a text says to pass on a side of the robot."""
    found: list[SeenSide] = []
    for k in range(len(text)):
        named = text.object_at(k)
        if named is None or named[0].unclear or (found and k in found[-1].pieces):
            continue
        end = named[1]
        between = next((n for n in range(end, min(end + 4, len(text))) if text.words[n] not in BEING), len(text))
        having = next((n for n in range(k - 1, max(k - 1 - BEFORE, -1), -1) if text.words[n] in HAVING), None)
        having = having if having is not None and all(map(text.is_article_at, range(having + 1, k))) else None
        kept = having is not None or not HAVING.isdisjoint(text.words[end:between])
        side, used = _side_at(text, between, kept)
        if side is not None:
            begin = _without_verbs(text, k if having is None else having)
            place = replace(named[0], relation=side, seen=True)
            found.append(SeenSide(place, range(begin, between + used)))
    return found


def _side_at(text: Text, k: int, kept: bool) -> tuple[Relation | None, int]:
    """The side of the robot that is told from piece k on, and how many words it takes."""
    said, used = phrase_at(text.words, k, SEEN)
    side = SEEN.get(said)
    if kept and not used:
        said, used = phrase_at(text.words, k, KEPT)
        side = KEPT.get(said)
    closed = text.words[k + used : k + used + 1] not in (["of"], ["side"], ["from"])
    return (side, used) if used and closed and side in TURNED else (None, 0)


def _without_verbs(text: Text, k: int) -> int:
    """Where the words begin that only carry a thing and its side: "pass so that you keep the tower"."""
    while k > 0 and text.words[k - 1] in ("and", "pass", "passing", "pass it", "please", "always", "but"):
        k -= 1
    return k
