"""Reading clauses about an end or a waypoint and an object, about the way back, and about coordinate axes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ovita.instruct.intents import Intent
from ovita.instruct.neighbours import DIRECTIONS
from ovita.instruct.reader import Reader
from ovita.instruct.regions import read_region
from ovita.instruct.senses import SPEED
from ovita.instruct.tokens import AXES
from ovita.paths.scene import Frame

PLACING = frozenset("at near toward towards in by until till from to before after over".split())
"""Words before "the goal" that make a part of the path of it."""

CARRYING = frozenset("move shift bring put place pull set drag relocate".split())


def read_aim(r: Reader) -> list[Intent]:
    """Move the goal 0.1 closer to the cup; move waypoint 25 to the buoy."""
    items = [i for i, t in enumerate(r.tokens) if t.items and not r.taken[i]]
    if len(items) != 1 or len(r.tokens[items[0]].items) != 1 or r.has(*SPEED, *DIRECTIONS, "never", "stop", "wait"):
        return []
    return _end(r, items[0]) or _waypoint(r, items[0])


def read_level(r: Reader) -> list[Intent]:
    """Descend to 9 m depth at the end; the goal should be at a height of 0.5 m."""
    ends = [name for name in ("start", "goal") if r.has(name)]
    numbers = r.numbers(("m", ""))
    if len(ends) != 1 or len(numbers) != 1 or any(t.items for t in r.tokens) or r.has(*SPEED, "never", "left", "right"):
        return []
    reached = r.word_before(numbers[0]) == "to" and r.has("up", "down", "height", "ground")
    if not (reached or (r.has("height") and r.word_before(numbers[0]) in ("of", "at"))) or r.has("at_least", "at_most"):
        return []
    deep = any(t.text.lower() in ("depth", "deep") for t in r.tokens)
    r.take(
        "up", "down", "height", "over", "ground", "gradual", ends[0], "toward", "when", "keep", "stay", "near", "reach"
    )
    amount = r.take_at(numbers[0]).number
    return [Intent("aim", (), (), -amount if deep else amount, "level", None, ends[0])]


def _end(r: Reader, item: int) -> list[Intent]:
    ends = [name for name in ("start", "goal") if r.has(name)]
    if len(ends) != 1 or not r.has("closer", "away") or r.has("distance", "at_least", "half", "double"):
        return []
    i = r.find(ends[0]) or 0
    words = [t.text.lower() for t in r.tokens[max(i - 2, 0) : i]]
    if i > item or PLACING & set(words) or r.numbers(("x", "%", "s", "step")) or r.target() is not None:
        return []
    away = r.take("away") and not r.has("closer")
    r.take(ends[0], "closer", "away", "more", "near", "toward")
    degree = r.degree()
    amount = r.number("m", "")
    return [Intent("aim", (), r.objects(), amount, "away" if away else "closer", None, ends[0], degree)]


def _waypoint(r: Reader, item: int) -> list[Intent]:
    first = r.tokens[0].text.lower() if r.tokens else ""
    to = "to" in (r.word_before(item), r.word_before(item - 1))
    if not (first in CARRYING and to and r.has("waypoints")) or r.has("closer", "away", "near", "through"):
        return []
    region = read_region(r, speed=False)
    if region.kind != "range" or region.until != region.amount:
        return []
    return [Intent("carry", (), r.objects(), region=region)]


def read_return(r: Reader) -> list[Intent]:
    """Return to the start at the end; go back to the start after reaching the goal."""
    start = r.find("start")
    if not r.has("undo") or start is None or any(t.items for t in r.tokens) or r.has(*SPEED, *DIRECTIONS):
        return []
    if not r.says("return", "return to", "go back to", "come back to", "returning", "returning to"):
        return []
    r.take("undo", "start", "after", "goal", "reach", "when", "straight")
    return [Intent("return")]


def read_axis(r: Reader) -> list[Intent]:
    """Shift it by 0.3 in y; 0.1 m along the negative x axis; increase z by 0.2."""
    letters = [i for i, t in enumerate(r.tokens) if t.text.lower() in AXES and not r.taken[i]]
    if len(letters) != 1 or r.has(*DIRECTIONS, *SPEED, "never", "start", "goal") or any(t.items for t in r.tokens):
        return []
    amount = r.number("m", "")
    if amount is None:
        return []
    against = r.take("decrease", "fewer") or r.says("negative", "minus", "subtract")
    for i, token in enumerate(r.tokens):
        r.taken[i] = r.taken[i] or token.text.lower() in ("negative", "minus", "positive", "plus", "subtract")
    axis = r.letter()
    region = read_region(r, speed=False)
    r.take("increase", "waypoints", "axis", "whole", "more")
    return [Intent("move", ((axis, -amount if against else amount),), region=region)]


def in_frame(intent: Intent, frame: Frame) -> Intent:
    """Name the axes of a move by the direction words of a frame; a shift against a direction goes the other way."""
    if not any(word in AXES for word, _ in intent.directions):
        return intent
    directions: list[tuple[str, float | None]] = []
    for word, amount in intent.directions:
        if word in AXES and amount is not None:
            vector = [amount if axis == word else 0.0 for axis in AXES]
            directions += list(frame.words(np.array(vector)).items())
        else:
            directions.append((word, amount))
    return replace(intent, directions=tuple(directions))
