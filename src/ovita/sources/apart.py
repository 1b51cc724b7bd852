"""Clauses beside the way, read as a whole by the reader of instructions: "From A to B. Dawdle by the bowl, though"."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

from ovita.instruct.frames import (
    Approach,
    Clearance,
    Figure,
    Height,
    Hop,
    Hover,
    Pace,
    SemanticFrame,
    Side,
    Visit,
    Wait,
)
from ovita.sources.phrases import WAY, WayPhrase, around, part_of, places_among
from ovita.sources.places import Location, Relation, Text, mentioned_in
from ovita.sources.tagging import ROLES, Role
from ovita.sources.wishes import bare, read_wish

READ = (Approach, Clearance, Figure, Height, Hop, Hover, Pace, Wait)
"""What a clause beside the way may come to; others could as well be told of the way."""

TYING = frozenset((",", "-", "and", "but", "while"))
"""Marks and words between clauses."""

LEADS, LEADING = frozenset(("to", "into", "onto")), 0.4
"""Words that lead to a place, and how likely a phrase with them has to be an end to be one."""

LIKELY = 0.6
"""How likely an end of the way has to be to be kept as one, where two places are told besides."""


def read_apart(text: Text, phrases: Sequence[WayPhrase]) -> list[WayPhrase]:
    """The phrases of a sentence, with each clause that the reader of instructions is sure of as one phrase.

    Only clauses without which a start and a goal are told still; what only goes by something is planned.
    """
    found = list(phrases)
    for pieces in _clauses(text, phrases):
        inside = [phrase for phrase in found if phrase.pieces.start in pieces]
        others = {phrase.role for phrase in found if phrase not in inside}
        lacking = not {"start", "goal"} <= others
        if sum(phrase.role in WAY for phrase in found if phrase not in inside) > 1:
            others |= {phrase.role for phrase in inside if phrase.role and phrase.shares[phrase.role] < LIKELY}
        rest = [phrase for phrase in found if phrase not in inside]
        cut = any(phrase.pieces.stop > pieces.stop or phrase.why or _leads(text, phrase, rest) for phrase in inside)
        if not {"start", "goal"} <= others or cut or not _mixed(inside):
            continue
        whole = _as_a_wish(text, pieces, inside)
        if whole is not None and (whole.seen is not None or not lacking):
            left = [part for phrase in found for part in around(text, phrase, whole.pieces)]
            found = sorted([*left, whole], key=lambda phrase: phrase.span)
    return found


def _clauses(text: Text, phrases: Sequence[WayPhrase]) -> Iterator[range]:
    """The pieces of each clause, the longest first: a sentence, or what commas, ties and reasons set apart in one."""
    marks = [-1, *(k for k, word in enumerate(text.words) if word in ".;!?"), len(text)]
    for before, behind in pairwise(marks):
        yield range(before + 1, behind)
        stops = [p.pieces.start for p in phrases if p.why and before < p.pieces.start < behind]
        commas = [before, *(k for k in range(before + 1, behind) if text.words[k] in TYING), behind]
        for k, comma in enumerate(commas):
            yield from (
                range(comma + 1, end) for end in sorted([*commas[k + 1 :], *stops], reverse=True) if end > comma
            )


def _leads(text: Text, phrase: WayPhrase, rest: Sequence[WayPhrase]) -> bool:
    """Whether a phrase leads to a place that no other names, and is no mere spot of a wish: "on to the raft"."""
    onward = phrase.role == "via" and "on" in phrase.words[:4]
    ends = phrase.role == "goal" and phrase.shares["goal"] > LEADING
    if not (onward or ends) or LEADS.isdisjoint(phrase.words[:4]):
        return False
    elsewhere = [place.objects for other in rest if other.role in WAY for place, _ in places_among(text, other.pieces)]
    return all(place.objects not in elsewhere for place, _ in places_among(text, phrase.pieces))


def _mixed(inside: Sequence[WayPhrase]) -> bool:
    """Whether a clause is more than one wish."""
    roles = [phrase.role for phrase in inside]
    return bool({*roles} & {*WAY}) or roles.count("wish") + roles.count("wait") > 1


def _as_a_wish(text: Text, pieces: range, inside: Sequence[WayPhrase]) -> WayPhrase | None:
    """A clause as one phrase: a wish, or what the way passes; None where it is not certain."""
    said = [k for k in pieces if text.words[k][0].isalnum()]
    told = [place for phrase in inside for place, _ in places_among(text, phrase.pieces)]
    if len(said) < 2 or any(place.seen for place in told):
        return None  # "on my left" is seen from the way, which the reader of instructions does not know
    whole = part_of(text, inside[0], range(said[0], said[-1] + 1))
    wish = read_wish(bare(whole.said), text.scene)
    frames = wish.frames
    if wish.outcome != "do" or not frames or wish.doubts or any(_left(wish.unused, phrase) for phrase in inside):
        return None
    named = {name for frame in frames for name in frame.named}
    if not {*mentioned_in(whole.said, text.scene)} <= named:
        return None
    passed = [place for frame in frames if (place := _passed(text, frame)) is not None]
    none = dict.fromkeys(ROLES, 0.0)
    if len(passed) == len(frames) == 1:
        passing = all(phrase.role == "via" for phrase in inside if phrase.role in WAY)
        if told and passing and all(_alike(place, passed[0]) for place in told):
            return None
        return replace(whole, role="via", shares=none | {"via": 1.0}, seen=passed[0])
    low = any(isinstance(frame, Hover) and frame.by is None for frame in frames)  # a wait over what is passed
    waits = sum(isinstance(frame, Wait) for frame in frames)
    compound = any(frame.part.parts for frame in frames)
    split = any(phrase.role in WAY for phrase in inside) and "," in text.words[said[0] : said[-1]]
    if (
        not (low or compound or split)
        and waits in (0, len(frames))
        and all(isinstance(frame, READ) for frame in frames)
    ):
        role: Role = "wait" if waits else "wish"
        return replace(whole, role=role, shares=none | {role: 1.0})
    return None


def _left(unused: Sequence[str], phrase: WayPhrase) -> bool:
    """Whether a reading uses no word of a phrase that asks for something."""
    words = {word for word in phrase.words if word[0].isalnum()}
    return phrase.role is not None and words <= {*unused}


def _alike(one: Location, other: Location) -> bool:
    return (one.relation, one.objects, one.distance) == (other.relation, other.objects, other.distance)


def _passed(text: Text, frame: SemanticFrame) -> Location | None:
    """What a frame says to pass, or None."""
    if isinstance(frame, Side) and len(frame.objects) == 1:
        relation: Relation | None = next((r for r in ("left", "right", "front", "back") if r == frame.direction), None)
        return Location(relation, (text.scene[frame.objects[0]],)) if relation else None
    if isinstance(frame, Visit) and frame.relation != "at":
        far = None if frame.by is None or frame.by.unit != "m" else frame.by.value
        return Location(frame.relation, tuple(text.scene[name] for name in frame.objects), far)
    return None
