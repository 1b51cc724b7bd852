"""Features of a path that no object names, as waypoints: its highest point, its stops, its rows, its way back.

"At its highest", "after the second stop", "on the last two lanes", "on the way home"; and points of the compass. In the
scene's frame y is north, as in REP 103; in NED x is north.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from ovita.instruct.chunks import chunks
from ovita.instruct.numerals import NUMBER_WORDS, written_out
from ovita.paths.geometry import runs
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, arc_length, interpolate

POINTS = {"north": (0.0, 1.0), "south": (0.0, -1.0), "east": (1.0, 0.0), "west": (-1.0, 0.0)}
"""Each point of the compass in x and y."""

_POINT = re.compile(rf"\b({'|'.join(POINTS)})(?:ern|erly|wards?|bound)?\b", re.IGNORECASE)


def on_axes(text: str, scene: Scene) -> tuple[str, str]:
    """An utterance with the scene's direction words for points of the compass, and what they were taken for, or "".

    Words in the names of objects ("north gate") stay, and so do all of them where there is such an object.
    """
    if any(_POINT.search(item.name) for item in scene.objects):
        return text, ""
    taken: dict[str, str] = {}
    north = "x" if scene.frame.name == "ned" else "y"

    def direction(found: re.Match[str]) -> str:
        point = found[1].lower()
        along = POINTS[point][:: -1 if north == "x" else 1]
        word = next(iter(scene.frame.words(np.array([*along, 0.0]))))
        taken[point] = word
        return word

    turned = _POINT.sub(direction, text)
    told = " and ".join(f"{point} is {word}" for point, word in taken.items())
    return turned, f"It is taken that {told}, as {north} points north." if told else ""


NUMBERS = {word: i for i, word in enumerate("first second third fourth fifth sixth seventh eighth ninth tenth".split())}
NUMBERS |= {"1st": 0, "2nd": 1, "3rd": 2, "4th": 3, "5th": 4, "last": -1, "final": -1}
HIGHER = {"top": 1.0, "upper": 1.0, "highest": 1.0, "bottom": -1.0, "lower": -1.0, "lowest": -1.0}
"""Which of several is meant: its index, or the sign of its height."""

EXTREMES = {
    **dict.fromkeys(("highest", "topmost", "uppermost", "top", "peak", "apex", "summit", "crest"), "up"),
    **dict.fromkeys(("lowest", "deepest", "bottommost", "bottom"), "down"),
    "leftmost": "left", "rightmost": "right",
}  # fmt: skip
"""Words for the outermost point of a path, and the direction in which it is."""

_NTH, _COUNT = "|".join(NUMBERS), r"(?:\d+|one|two|three|four|five|six|seven|eight|nine|ten)"
_OWN = r"(?:path|trajectory|route|way|run|flight|trip|motion|movement|arc|curve|bow|loop|swing|climb|lift)"
_EXTREME = re.compile(
    r"\b(?P<link>at|after|past|before|until|till|from|near|around|over|when|where|while|lower|raise|lift|drop) "
    r"(?:(?:it|he|she|you|the (?:robot|arm|drone))(?:'s|'re| is| are) (?:at )?)?(?:the |its |your )?(?:very )?"
    rf"(?P<which>{'|'.join(EXTREMES)})(?P<noun> (?:point|spot|place|position|waypoint))?"
    rf"(?: of (?:the |its |your )?(?:\w+ )?{_OWN})?(?: on\b)?"
    r"(?(noun)\b|(?=$|\s*[.,;!?]| (?:and|or|for|by|to|then|but|so|with|in|at|it|you|please|again|while|like|\d)))",
    re.IGNORECASE,
)
_STOP = re.compile(
    rf"\b(?P<link>at|after|past|before|until|till|from) (?:the|its) (?:(?P<nth>{_NTH}|only) )?"
    r"(?:stop|pause|wait|hover|hold|halt)\b(?! (?:at|by|near|of|in|on|over)\b)",
    re.IGNORECASE,
)
_BETWEEN = re.compile(r"\bbetween the (?:two |2 )?(?:stops|pauses|holds|halts|waits)\b", re.IGNORECASE)
_BACK = re.compile(
    r"\b(?:(?:on|in|during|for|along) )?(?:(?:the|its|your) (?:way (?:back|home)"
    r"|(?:trip|leg|journey|flight|drive) (?:back|home)"
    r"|return (?:trip|leg|way|flight|run|journey))|the return)\b(?! (?:to|stroke)\b)",
    re.IGNORECASE,
)
_OUT = re.compile(
    r"\b(?:(?:on|in|during|for|along) )?(?:(?:the|its|your) (?:way (?:out|there)|(?:trip|leg|journey|flight) out"
    r"|out(?:bound|ward) (?:\w+ )?(?:trip|leg|way|flight|run|journey|stretch)))\b(?! to\b)",
    re.IGNORECASE,
)
_ROW = "(?:row|lane|strip|swath|stroke|corridor|aisle)"
_STRAIGHT = f"(?:{_ROW}|pass|line|leg|straight)"
"""What is a row wherever it is said, and what only behind "the", "in" and the like: not "first pass the cup"."""
_NO_UNIT = r"(?!\.\d| ?(?:%|c?m\b|mm\b|m/s|(?:centi|milli)?met(?:er|re)|sec|in\b|inch|f(?:oo|ee)?t\b|per ?cent|times))"
_ROWS = re.compile(
    r"\b(?P<the>the |(?<=\bin )|(?<=\bon )|(?<=\balong ))?(?:"
    rf"(?P<nth>{_NTH}|middle|{'|'.join(HIGHER)}) (?:(?P<count>{_COUNT}) )?(?(the){_STRAIGHT}|{_ROW})(?(count)e?s)"
    rf"(?! {_COUNT}\b{_NO_UNIT})"
    rf"|(?(the){_STRAIGHT}|{_ROW})e?s? (?P<one>{_COUNT})(?:(?: to | through |-)(?P<two>{_COUNT}))?"
    rf")\b{_NO_UNIT}"
    r"|\b(?:all (?:of )?)?the (?:rows|lanes|strips|swaths|strokes)\b",
    re.IGNORECASE,
)
_LEFT_OUT = re.compile(
    r"\b(?:leave out|skip|omit|drop|cut(?: out)?|miss out) waypoints (?P<a>\d+) to (?P<b>\d+)\b", re.IGNORECASE
)


def by_feature(text: str, scene: Scene, positions: Array | None) -> tuple[str, str]:
    """An utterance with waypoints for the features of the path that it names, and which rows were taken, or "".

    A word that is in the name of an object, and a feature that the path has not, stay as they are.

    Args:
        text: As it was said or typed.
        scene: Whose objects may be called so.
        positions: The path (N, 3) [m], or None.
    """
    if positions is None or len(positions) < SHORTEST:
        return text, ""
    named = {word for item in scene for word in item.name.lower().split()}
    path, taken = _Features(scene, positions), dict[str, str]()

    def put(pattern: re.Pattern[str], by: Callable[[re.Match[str]], str], tell: bool = False) -> None:
        def waypoints(found: re.Match[str]) -> str:
            said = by(found) if named.isdisjoint(found[0].lower().split()) else ""
            if tell and (said or found["count"] or found["one"]):
                taken[f"'{found[0].lower().removeprefix('the ')}'"] = said or "no part of this path"
            return said or found[0]

        nonlocal text
        text = pattern.sub(waypoints, text)

    put(_BACK, lambda _: path.home(back=True))
    put(_OUT, lambda _: path.home(back=False))
    if _EXTREME.search(text):
        halts = any(chunk.kind in HALTING for chunk in chunks(text, scene, positions))
        put(_EXTREME, lambda found: path.extreme(found["which"].lower(), found["link"].lower(), halts))
    put(_BETWEEN, lambda _: path.between_stops())
    put(_STOP, lambda found: path.stop((found["nth"] or "only").lower(), found["link"].lower()))
    put(_ROWS, path.rows, tell=True)
    text = _LEFT_OUT.sub(lambda found: _without(int(found["a"]), int(found["b"]), len(positions)), text)
    return text, f"It is taken that {' and '.join(f'{k} is {v}' for k, v in taken.items())}." if taken else ""


HALTING = ("wait", "hover", "stop")
"""Classes of words for standing still, for which an extreme is a point, and not what is about as high."""

MOVING = ("lower", "raise", "lift", "drop")
"""Verbs whose object may be an extreme: "lower the highest point"."""

SHORTEST = 4
"""Waypoints of a path that is too short to have features."""


def _linked(link: str, first: int, last: int) -> str:
    """What lies before, after or at waypoints, counted from 0, in words."""
    if link in ("after", "past", "from"):
        return f"from waypoint {last + 1} on"
    if link in ("before", "until", "till"):
        return f"up to waypoint {first + 1}"
    verb = f"{link} it " if link in MOVING else ""
    return verb + (f"at waypoint {first + 1}" if first == last else f"from waypoint {first + 1} to waypoint {last + 1}")


def _without(first: int, last: int, count: int) -> str:
    """Waypoints that are left out, counted from 1: cut off, or gone past straight."""
    if last >= count - 1:
        return f"cut off the last {count - first + 1} waypoints"
    return f"cut off the first {last} waypoints" if first <= 2 else f"go straight from waypoint {first} to {last}"


@dataclass(frozen=True)
class _Features:
    """What a path (N, 3) [m] has: each method says in words where that is, "" if nowhere or in several places."""

    scene: Scene
    positions: Array

    @cached_property
    def up(self) -> Array:
        """Its heights (N,) [m]."""
        return np.asarray(self.positions @ self.scene.frame.direction("up"))

    @cached_property
    def stops(self) -> list[tuple[int, int]]:
        """The first and the last waypoint of each stop on the way."""
        still = runs((np.diff(self.positions, axis=0) == 0.0).all(axis=1))
        return [(a, b + 1) for a, b in still if a > 0 and b + 2 < len(self.positions)]

    def extreme(self, which: str, link: str, halts: bool) -> str:
        """Where it is outermost: for a halt that waypoint, else what is about as far out; nowhere on a level path."""
        along = self.positions @ self.scene.frame.direction(EXTREMES[which])
        if float(np.ptp(along)) < LEVEL * float(np.ptp(self.positions, axis=0).max()):
            return ""
        there = np.flatnonzero(along >= along.max() - 1e-9)
        at = int(there[len(there) // 2])
        if halts or link in ("after", "past", "from", "before", "until", "till"):
            return _linked(link, at, at)
        first, last = next(r for r in runs(along >= along.max() - AROUND * float(np.ptp(along))) if r[0] <= at <= r[1])
        return _linked(link, first, last)

    def stop(self, nth: str, link: str) -> str:
        """Its only stop, or one by its number."""
        number = 0 if nth == "only" else NUMBERS[nth]
        if not -len(self.stops) <= number < len(self.stops) or (nth == "only" and len(self.stops) > 1):
            return ""
        first, last = self.stops[number]
        return _linked(link, first, first if link == "at" else last)

    def between_stops(self) -> str:
        """From its first stop to its second, where it has no more."""
        return _linked("", self.stops[0][1], self.stops[1][0]) if len(self.stops) == 2 else ""

    def home(self, *, back: bool) -> str:
        """Its way back to where it began, without the goal, which stays; or its way out."""
        away = np.linalg.norm(self.positions - self.positions[0], axis=1)
        far = max([int(away.argmax()), *(stop for stop, _ in self.stops if away[stop] >= FAR * away.max())])
        if away[-1] >= HALFWAY * away.max():
            return ""
        return _linked("", far, len(away) - 2) if back else f"up to waypoint {far + 1}"

    def rows(self, found: re.Match[str]) -> str:
        """Its straight stretches by number, by height, or all of them."""
        rows = parallel(straights(self.positions), self.positions)
        chosen = self._numbers(found, rows) if len(rows) > 1 else ()
        if not chosen or not 0 <= chosen[0] <= chosen[-1] < len(rows):
            return ""
        if chosen[-1] - chosen[0] + 1 == len(chosen):
            return f"waypoints {rows[chosen[0]][0] + 1} to {rows[chosen[-1]][1] + 1}"
        return " and ".join(f"waypoints {rows[i][0] + 1} to {rows[i][1] + 1}" for i in chosen)

    def _numbers(self, found: re.Match[str], rows: Sequence[tuple[int, int]]) -> Sequence[int]:
        """The numbers of the rows that are meant, counted from 0."""
        nth, many = (found["nth"] or "").lower(), range(len(rows))
        if found["one"]:
            first = _count(found["one"]) - 1
            return range(first, _count(found["two"]) if found["two"] else first + 1)
        if not nth:
            return many
        count = _count(found["count"]) if found["count"] else 1
        if nth in HIGHER:
            heights = [-HIGHER[nth] * float(self.up[a : b + 1].mean()) for a, b in rows]
            level = max(heights) - min(heights) <= LEVEL * float(np.ptp(self.positions, axis=0).max())
            return () if level or count >= len(rows) else sorted(np.argsort(heights, kind="stable")[:count].tolist())
        if nth == "middle":
            return [len(rows) // 2] if len(rows) % 2 else ()
        first = NUMBERS[nth] if NUMBERS[nth] >= 0 else len(rows) - count
        return range(first, first + count)


def _count(said: str) -> int:
    return int(NUMBER_WORDS.get(said.lower()) or said)


LEVEL, AROUND = 0.05, 0.25
"""Shares of a path's extent by which it rises if it is not level, and of how far it rises that are its top."""

FAR, HALFWAY = 0.9, 0.5
"""Shares of the greatest distance from the start: of a stop that is the farthest place, and of a goal that is home."""

SAMPLES, LOOK = 240, 8
"""Points at which a path is looked at, evenly along it, and how many of them make a chord."""

TURNING, LEAVING = np.radians(25.0), np.radians(12.0)
"""The angle between two chords from which on a path turns, and that by which it leaves the direction of a stretch."""

LONG = 0.4
"""The share of the longest straight stretch that the others are at least as long as; what is shorter leads to one."""

ROWS = 3
"""How many stretches are rows where they are parallel and of one length, so that others lead to them, or home."""


def straights(positions: Array) -> list[tuple[int, int]]:
    """The first and last waypoints of the long stretches of a path (N, 3) between its turns, in their order."""
    s = arc_length(positions)
    if len(positions) < 3 or s[-1] == 0.0:
        return []
    fresh = np.concatenate([[True], np.diff(s) > 0.0])
    along = np.linspace(0.0, s[-1], SAMPLES)
    points = interpolate(positions[fresh], np.interp(along, s[fresh], np.arange(fresh.sum())))
    straight = np.ones(SAMPLES, dtype=bool)
    straight[LOOK:-LOOK] = _angles(_ways(points, LOOK)[:-LOOK], _ways(points, LOOK)[LOOK:]) < TURNING
    steps = _ways(points, 1)
    found = []
    for a, b in runs(straight):
        # A turn begins where the path leaves the direction of the stretch, nearer to it than half a chord.
        aside = _angles(steps, _ways(points[[a, b]], 1)) > LEAVING
        before, behind = np.flatnonzero(aside[: (a + b) // 2]), np.flatnonzero(aside[(a + b) // 2 :])
        first = before[-1] + 1 if len(before) else 0
        last = behind[0] + (a + b) // 2 if len(behind) else SAMPLES - 1
        found.append((along[min(first, a)], along[max(last, b)]))
    least = LONG * max((b - a for a, b in found), default=0.0)
    spans = [np.flatnonzero((s >= a - 1e-9) & (s <= b + 1e-9)) for a, b in found if b - a >= least]
    return [(int(inside[0]), int(inside[-1])) for inside in spans if len(inside) > 1]


def _ways(points: Array, look: int) -> Array:
    """Unit vectors (N - look, 3) from points (N, 3) to those so many behind them."""
    chords = points[look:] - points[:-look]
    return np.asarray(chords / np.maximum(np.linalg.norm(chords, axis=1), 1e-12)[:, None])


def _angles(one: Array, other: Array) -> Array:
    """Angles (N,) [rad] between unit vectors (N, 3)."""
    return np.asarray(np.arccos(np.clip((one * other).sum(axis=1), -1.0, 1.0)))


def parallel(stretches: Sequence[tuple[int, int]], positions: Array) -> list[tuple[int, int]]:
    """The rows among the stretches of a path (N, 3) [m]: those of one direction and length, if these are many."""
    ends = np.array([positions[[a, b]] for a, b in stretches]).reshape(-1, 2, 3)
    along = ends[:, 1] - ends[:, 0]
    size = np.linalg.norm(along, axis=1)
    way = along / np.maximum(size, 1e-12)[:, None]
    alike = (np.abs(way @ way.T) > np.cos(TURNING)) & (np.abs(size[:, None] - size) < LONG * size[:, None])
    best = alike[alike.sum(axis=1).argmax()] if len(stretches) else np.zeros(0, dtype=bool)
    return [s for s, row in zip(stretches, best, strict=True) if row] if best.sum() >= ROWS else [*stretches]


def with_landmarks(text: str, scene: Scene, positions: Array | None) -> tuple[str, str]:
    """An utterance with waypoints for features of the path, and what was taken for what.

    Args:
        text: As it was said or typed.
        scene: Whose objects it may name.
        positions: The path (N, 3) [m], or None.
    """
    text, points = on_axes(written_out(text), scene)
    text, rows = by_feature(text, scene, positions)
    return _marked(text), " ".join(filter(None, (points, rows)))


def _marked(text: str) -> str:
    """An utterance that begins with "this part" with "here" in its place, which is what was marked by hand."""
    words = text.split()
    for i, (word, thing) in enumerate(pairwise(words[:EARLY])):
        if word.lower() == "this" and thing.lower().strip(",:") in STRETCHES:
            return " ".join((*words[:i], "here", *words[i + 2 :]))
    return text


EARLY = 4
"""Words of an utterance among which "this part" is no part that was named before it."""

STRETCHES = frozenset("part bit section stretch segment".split())
