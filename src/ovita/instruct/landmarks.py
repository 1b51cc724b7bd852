"""Parts of a path that no object names: by points of the compass, and straight stretches by their number.

"Further north", "the second row", "on the middle pass", "after the corner". In the scene's frame y is north, as in REP
103; in NED x is north.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from ovita.instruct.objects import head_of
from ovita.paths.geometry import runs
from ovita.paths.scene import Scene, SceneObject
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


SAMPLES, LOOK = 240, 8
"""Points at which a path is looked at, evenly along it, and how many of them make a chord."""

TURNING, LEAVING = np.radians(25.0), np.radians(12.0)
"""The angle between two chords from which on a path turns, and that by which it leaves the direction of a stretch."""

LONG = 0.4
"""The share of the longest straight stretch that the others are at least as long as; what is shorter leads to one."""

_NUMBERS = {"first": 0, "1st": 0, "second": 1, "2nd": 1, "third": 2, "3rd": 2, "fourth": 3, "4th": 3, "fifth": 4,
            "5th": 4, "last": -1, "final": -1}  # fmt: skip

_STRETCH = "pass|row|line|lane|leg|corridor|hallway|aisle|swath|straight|stretch|run|stroke"
_HIGHER = {"top": 1.0, "upper": 1.0, "highest": 1.0, "bottom": -1.0, "lower": -1.0, "lowest": -1.0}
_NUMBER = rf"({'|'.join((*_NUMBERS, *_HIGHER))}|middle)"
_NUMBERED = re.compile(  # not "first pass the cup"
    rf"\b(?:the\s+|(?<=in )|(?<=on )){_NUMBER}\s+(?:{_STRETCH})\b"
    rf"|\b{_NUMBER}\s+(?:{_STRETCH})"
    r"(?=\s+(?:is|was|should|needs?|has|half|at|slower|faster|higher|lower|deeper|closer|farther|further|\d+(?:\.\d+)?)\b)",
    re.IGNORECASE,
)
_COUNTS = {"two": 2, "2": 2, "three": 3, "3": 3, "four": 4, "4": 4}
_SEVERAL = re.compile(
    rf"\bthe\s+({'|'.join((*_HIGHER, 'first', 'last', 'final'))})\s+({'|'.join(_COUNTS)})\s+(?:{_STRETCH})s\b"
    r"|\b(?:all\s+(?:of\s+)?)?the\s+(?:strokes|rows|swaths)\b",
    re.IGNORECASE,
)
_CORNER = re.compile(
    rf"\b(after|behind|past|before)\s+the\s+(?:({'|'.join(_NUMBERS)})\s+)?(?:corner|turn|bend)\b(?!\s+of\b)",
    re.IGNORECASE,
)


def by_number(text: str, scene: Scene, positions: Array | None) -> tuple[str, str]:
    """An utterance with waypoints for the straight stretches and corners that it names, and what was taken, or "".

    Nothing is taken where the path has one such stretch, or fewer than are named, or where an object is called so.

    Args:
        text: As it was said or typed.
        scene: Whose objects may be called so.
        positions: The path (N, 3) [m], or None.
    """
    words = {word.lower() for item in scene for word in item.name.split()}
    named = [found for pattern in (_NUMBERED, _SEVERAL, _CORNER) for found in pattern.finditer(text)]
    if positions is None or not named or any(not words.isdisjoint(one[0].lower().split()) for one in named):
        return text, ""
    stretches = straights(positions)
    taken: dict[str, str] = {}

    def stretch(found: re.Match[str]) -> str:
        number = _which(stretches, (found[1] or found[2]).lower(), positions @ scene.frame.direction("up"))
        if not -len(stretches) <= number < len(stretches):
            return found[0]
        first, last = stretches[number]
        said = f"waypoints {first + 1} to {last + 1}"
        taken[f"'{found[0].lower().removeprefix('the ')}'"] = said
        return said

    def several(found: re.Match[str]) -> str:
        chosen = _which_of(stretches, found[1], _COUNTS.get(found[2] or "", 0), positions @ scene.frame.direction("up"))
        if not chosen:
            return found[0]
        said = " and ".join(f"waypoints {first + 1} to {last + 1}" for first, last in chosen)
        taken[f"'{found[0].lower().removeprefix('the ')}'"] = said
        return said

    def corner(found: re.Match[str]) -> str:
        number = _NUMBERS.get((found[2] or "first").lower(), 0)
        between = list(pairwise(stretches))
        if not -len(between) <= number < len(between) or (found[2] is None and len(between) > MANY):
            return found[0]
        (_, before), (behind, _) = between[number]
        early = found[1].lower() == "before"
        taken[f"'{found[0].lower()}'"] = said = (
            f"{'up to' if early else 'from'} waypoint {(before if early else behind) + 1}"
        )
        return said if early else f"{said} on"

    if len(stretches) < 2:
        return text, ""
    text = _CORNER.sub(corner, _NUMBERED.sub(stretch, _SEVERAL.sub(several, text)))
    text = _LEFT_OUT.sub(lambda found: _without(int(found["a"]), int(found["b"]), len(positions)), text)
    return text, f"It is taken that {' and '.join(f'{k} is {v}' for k, v in taken.items())}." if taken else ""


_LEFT_OUT = re.compile(
    r"\b(?:leave out|skip|omit|drop|cut out|miss out) (?:the )?waypoints (?P<a>\d+) to (?P<b>\d+)\b", re.IGNORECASE
)


def _without(first: int, last: int, count: int) -> str:
    """A stretch that is left out, from one waypoint to another, counted from 1: cut off, or gone past straight."""
    if last >= count - 1:
        return f"cut off the last {count - first + 1} waypoints"
    return f"cut off the first {last} waypoints" if first <= 2 else f"go straight from waypoint {first} to {last}"


def _which(stretches: Sequence[tuple[int, int]], said: str, up: Array) -> int:
    """The number of a stretch by its place in their order or by its height; that of none where there is no such.

    Args:
        stretches: The first and last waypoint of each.
        said: "second", "middle" or "top".
        up: The height of each waypoint (N,) [m].
    """
    if said in _HIGHER:
        heights = [_HIGHER[said] * float(up[a : b + 1].mean()) for a, b in stretches]
        level = len(stretches) < 2 or max(heights) - min(heights) < LEVEL * float(np.ptp(up))
        return len(stretches) if level else int(np.argmax(heights))
    return _NUMBERS.get(said, len(stretches) // 2 if len(stretches) % 2 else len(stretches))


def _which_of(
    stretches: Sequence[tuple[int, int]], said: str | None, count: int, up: Array
) -> Sequence[tuple[int, int]]:
    """Several stretches by their order or by their height, or all of them; those that follow each other as one.

    Args:
        stretches: The first and last waypoint of each.
        said: "first", "last" or "top"; None for all.
        count: How many.
        up: The height of each waypoint (N,) [m].
    """
    if said is None:
        return [(stretches[0][0], stretches[-1][1])]
    if count >= len(stretches):
        return ()
    if (way := _HIGHER.get(said.lower())) is not None:
        heights = [-way * float(up[a : b + 1].mean()) for a, b in stretches]
        chosen = sorted(np.argsort(heights, kind="stable")[:count].tolist())
    else:
        chosen = [*range(len(stretches))][:count] if said.lower() == "first" else [*range(len(stretches))][-count:]
    if chosen[-1] - chosen[0] + 1 == count:
        return [(stretches[chosen[0]][0], stretches[chosen[-1]][1])]
    return [stretches[i] for i in chosen]


_STOP = re.compile(
    rf"\b(after|behind|past|until|till)\s+the\s+(?:({'|'.join(_NUMBERS)})\s+)?(?:stop|pause|wait|hover|hold|halt)\b"
    r"(?!\s+(?:at|by|near|of|in|on|before|over))",
    re.IGNORECASE,
)
_BETWEEN = re.compile(r"\bbetween the (?:two |2 )?(?:stops|pauses|holds|halts|waits)\b", re.IGNORECASE)
_OVER = re.compile(
    r"\b(?:on the way over|in transit|(?:during|on|in) (?:the )?(?:transfer|transport)"
    r"|while (?:it (?:is )?|you (?:are )?)?carr(?:ying|ies|y)(?: (?:it|the \w+))?)\b",
    re.IGNORECASE,
)
_TRANSFER = re.compile(
    r"\bthe (?:transfer|transport)(?: (?:segment|part|move|leg|path|motion))?\b(?! between\b)", re.IGNORECASE
)
_PICK = r"(?:the )?(?:pick(?:[- ]?up)?|grasp|drop(?:[- ]?off)|put[- ]?down|place|stops?|pauses?|holds?)(?: points?)?"
_KEPT = re.compile(
    rf"\b(?:leave|keep) {_PICK}(?: and {_PICK})? "
    r"(?:alone|unchanged|untouched|as (?:they are|it is|is)|where (?:they are|it is))\b",
    re.IGNORECASE,
)
_LASTS = (
    r"\b(?:(?:wait|pause|hold|stay|hover|stop|spend) (?P<as>half|twice|three times) as long"
    r"|(?:don'?t|do not) (?:wait|pause|hold|stay|hover|stop) (?P<less>so|that|as|quite so) long"
    r"|(?P<times>double|halve|half|triple) the (?:pause|wait|stop|hold|hover)(?: time)?)"
    r"(?: (?:at|by|near|over|in|above) (?:(?P<all>(?:all|both|each|every)(?: of)?(?: the)? \w+)"
    r"|(?:the )?(?P<at>%s)))?\b"
    r"(?! at| by| near| over| in| above)"
)
TIMES = {"half": 0.5, "halve": 0.5, "twice": 2.0, "double": 2.0, "three": 3.0, "triple": 3.0}
"""What words for how long a stop is to last are to how long it lasts."""

_EXTREME = re.compile(
    r"\b(?P<link>at|after|behind|past|before|until|till|from) (?:the |its )(?:very )?"
    r"(?P<which>highest|lowest|leftmost|rightmost|topmost) (?:point|spot|place|position|waypoint)\b"
    r"(?: of (?:the |its |your )?(?:\w+ )?(?:path|flight|trajectory|route|way|run|movement|motion|trip))?(?: on)?",
    re.IGNORECASE,
)
_EXTREMES = {"highest": "up", "topmost": "up", "lowest": "down", "leftmost": "left", "rightmost": "right"}

_NOT_SO = re.compile(
    r"\b(?:don'?t|do not|not|needn'?t|shouldn'?t|never)(?: (?:have|need) to)?"
    r"(?: (?:go|fly|come|get|swing|reach|rise|lift|climb|dip|sink|drop|be|move))?(?: it)?"
    r"(?: quite| all| nearly)? (?:so|as|that|too|this) (?P<way>high|low)(?: up| down)?"
    r"(?=\s*(?:$|[.,;!?]|\b(?:and|but|or|please|because)\b))",
    re.IGNORECASE,
)
_TOP = re.compile(
    r"\b(?:at|near|around|over|in) (?:the |its )?(?:very )?(?P<which>top|peak|apex|summit|bottom)\b(?! of\b|,? no\b)",
    re.IGNORECASE,
)
BULGE, TOP, LEVEL = 0.3, 0.25, 0.05
"""Shares of how far a path rises, by which it is higher than its ends to bulge, and how much of it is the top; and the
share of its extent by which a path rises that is not level."""

_PUT_DOWN = re.compile(r"\bat the put-down\b", re.IGNORECASE)
_BEFORE_DOWN = re.compile(r"\bbefore the put-down\b", re.IGNORECASE)
_RETURNS = re.compile(
    r"\b(?P<go>fly|drive|do|make|take|run|go|travel) the (?:way (?:back|home)|return(?: trip| leg| flight)?)\b",
    re.IGNORECASE,
)
_LITTLE_SHORT = re.compile(
    r"\b(?:stop|end|finish|park|halt)(?: it| the \w+)? (?:a (?:little|bit|touch|tad)|slightly|somewhat) "
    r"(?:earlier|sooner|(?:short of|before) (?:the (?:end|goal)|where (?:it|you|he|she) "
    r"(?:ends?|stops?|finish(?:es)?)(?: now)?))(?=\s*(?:$|[.,;!?]|and\b))",
    re.IGNORECASE,
)
LITTLE = 0.05
"""The share of a path that "stop a little earlier" takes off."""

_PICK_UP = re.compile(r"\bat the pick-up\b", re.IGNORECASE)
_START_HEIGHT = re.compile(
    r"\b(?:at|to) (?:the )?(?:same )?(?:height|level) (?:where|at which|it is at where|as where|of where) "
    r"(?:it|you|he|she|the path) (?:starts|start|begins|begin)\b"
    r"|\b(?:at|to) (?:the )?height (?:of|at) the (?:start|beginning)\b|\b(?:at|to) its start(?:ing)? height\b",
    re.IGNORECASE,
)
_PUT_ASIDE = re.compile(r"\bput-down (?P<by>.+?) further (?P<way>left|right|lower|higher)\b", re.IGNORECASE)
_WAITS = re.compile(r"\b(?:wait|pause|hold|hover|stop|stay)", re.IGNORECASE)
DRAWN_BACK, LAST_OF = 0.25, 0.25
"""The most of a path that is no more than its drawing back, and what share of the way to a stop is coming down."""

_SLOPE = (
    r"\b(?:on|during) (?:the|its) (?:way (?P<way>down|up)|(?P<noun>descent|climb|ascent))"
    r" (?P<link>to|into|onto|in|on|at|from|off|out of)(?: the)? (?P<at>%s)\b"
)

_LONGER = re.compile(
    r"\b(?:wait|hold|pause|stay)(?: for)?(?: [\d.]+ ?\w+)? longer\b"
    r"(?!\s+(?:at|in|on|over|above|near|by|there|before|with|than)\b)",
    re.IGNORECASE,
)
_SKIP = re.compile(
    r"^(?P<lead>\W*(?:(?:please|just|and|also|you can|you may|we can|let's|today) )*)"
    r"(?:skip|leave out|omit|drop) (?:the )?"
    r"(?P<name>[\w' -]+?)(?=\s*(?:$|[.,;!?]|and\b|today\b|this time\b|for now\b))",
    re.IGNORECASE,
)


def by_stops(text: str, scene: Scene, positions: Array | None) -> str:
    """An utterance with waypoints for the path's stops and its way back, and no stop for an object to be skipped.

    "After the stop", "until the second pause", "double the pause", "skip the west pier", "on the way home".

    Args:
        text: As it was said or typed.
        scene: With the names of objects.
        positions: The path (N, 3) [m], or None.
    """
    if positions is None:
        text = _PUT_DOWN.sub("at the end", _BEFORE_DOWN.sub("at the end", text))
        return _PUT_ASIDE.sub(r"end \g<by> further \g<way>", text)
    text = _LITTLE_SHORT.sub(f"stop {LITTLE * float(arc_length(positions)[-1]):.2g} m earlier", text)
    text = _RETURNS.sub(r"\g<go> on the way back", text)
    text = _EXTREME.sub(lambda found: _extreme(found, scene, positions), text)
    text = _TOP.sub(lambda found: _top(found, scene, positions), text)
    still = runs((np.diff(positions, axis=0) == 0.0).all(axis=1))
    stops = _Stops(scene, positions, tuple((a, b + 1) for a, b in still if a > 0 and b + 2 < len(positions)))
    if (turn := turning_back(positions, [a for a, _ in stops.at])) is not None:
        home = len(positions) - 1  # the goal stays where it is
        text = _BACK.sub(f"from waypoint {turn + 1} to waypoint {home}", _OUT.sub(f"up to waypoint {turn + 1}", text))
    called = "|".join([*map(re.escape, stops.called), "$"])
    text = re.sub(_LASTS % called, stops.lasting, text, flags=re.IGNORECASE)
    text = _KEPT.sub(stops.kept, text)
    text = _PICK_UP.sub(f"at waypoint {stops.at[0][0] + 1}" if stops.at else "at the start", text)
    if (high := float(positions[0] @ scene.frame.direction("up"))) >= 0.0:
        text = _START_HEIGHT.sub(f"to a height of {high:.4g} m", text)
    text = _BEFORE_DOWN.sub(stops.before_down, text)
    text = _PUT_DOWN.sub(lambda found: stops.put_down(bool(_WAITS.search(found.string))), text)
    text = _PUT_ASIDE.sub(stops.put_aside, text)
    text = re.sub(_SLOPE % called, stops.slope, text, flags=re.IGNORECASE)
    if len(stops.at) == 1:
        text = _LONGER.sub(r"\g<0> at the stop", text)
    if len(stops.at) == 2:
        (_, first), (last, _) = stops.at
        between = f"from waypoint {first + 1} to waypoint {last + 1}"
        text = _BETWEEN.sub(between, _TRANSFER.sub(f"the path {between}", _OVER.sub(between, text)))
    return _SKIP.sub(stops.skipped, _STOP.sub(stops.numbered, text))


@dataclass(frozen=True)
class _Stops:
    """Where a path stands still on the way, and what words for that are as waypoints.

    Args:
        scene: With the names of objects.
        positions: The path (N, 3) [m].
        at: The first and the last waypoint of each stop.
    """

    scene: Scene
    positions: Array
    at: tuple[tuple[int, int], ...]

    @cached_property
    def called(self) -> dict[str, SceneObject]:
        """The objects by their names, longest first, and by the noun of a name that no other has."""
        nouns = [head_of(name.lower().split()) for name in self.scene.names]
        found = {noun: item for noun, item in zip(nouns, self.scene, strict=True) if nouns.count(noun) == 1}
        words = [word for name in self.scene.names for word in name.lower().split() if len(word) > LONG_WORD]
        first = {item.name.lower().split()[0]: item for item in self.scene}
        found |= {word: item for word, item in first.items() if words.count(word) == 1 and word not in found}
        found |= {item.name.lower(): item for item in self.scene}
        return dict(sorted(found.items(), key=lambda pair: -len(pair[0])))

    def by(self, stop: tuple[int, int]) -> str:
        """The object that is nearest to a stop."""
        place = self.positions[[stop[0]]]
        return min(self.scene, key=lambda one: float(one.core(self.positions).depth(place)[0])).name.lower()

    def numbered(self, found: re.Match[str]) -> str:
        """What is after a stop, or up to one: the only one, or one by its number."""
        number = _NUMBERS.get((found[2] or "first").lower(), 0)
        if not -len(self.at) <= number < len(self.at) or (found[2] is None and len(self.at) > 1):
            return found[0]
        first, last = self.at[number]
        after = found[1].lower() in ("after", "behind", "past")
        return f"from waypoint {last + 1} on" if after else f"up to waypoint {first + 1}"

    def skipped(self, found: re.Match[str]) -> str:
        """No stop at an object where the path has one."""
        there = [self.by(stop) for stop in self.at]
        return f"{found['lead']}make no stop at the {found['name']}" if found["name"].lower() in there else found[0]

    def lasting(self, found: re.Match[str]) -> str:
        """A stop that is to last half or twice as long as it does."""
        said, name = (found["times"] or found["as"] or "half").lower(), (found["at"] or "").lower()
        times = TIMES[said.split()[0]]
        if found["all"] and self.at:
            waits = (f"{max(round(times * (b - a)), 1)} timesteps at waypoint {a + 1}" for a, b in self.at)
            return " and ".join(f"wait {wait}" for wait in waits)
        if not self.at or (not name and len(self.at) > 1):
            return found[0]
        away = self.called[name].cuboid.signed(self.positions)[0] if name else np.zeros(len(self.positions))
        first, last = min(self.at, key=lambda stop: float(away[stop[0]]))
        steps = max(round(times * (last - first)), 1)
        return f"wait {steps} timesteps at {f'the {name}' if name else f'waypoint {first + 1}'}"

    @property
    def draws_back(self) -> bool:
        """Whether the path but draws back upwards from its last stop."""
        s, path = arc_length(self.positions), self.positions
        last = self.at[-1][1] if self.at else 0
        back = path[-1] - path[last]
        rise = float(back @ self.scene.frame.direction("up"))
        return last > 0 and s[-1] - s[last] <= DRAWN_BACK * s[-1] and rise >= np.linalg.norm(back) / np.sqrt(2.0)

    def put_aside(self, found: re.Match[str]) -> str:
        """That something is set down further aside: the stop, half the way to it and what draws back from there."""
        aside = f"{found['by']} further {found['way']}"
        if not self.draws_back and len(self.at) < 2:
            return f"end {aside}"
        if found["way"].lower() in ("lower", "higher"):  # what is above it stays
            return f"go {aside} {self.put_down(waits=False)}"
        s, before = arc_length(self.positions), self.at[-2][1] if len(self.at) > 1 else 0
        begin = int(np.searchsorted(s, (s[before] + s[self.at[-1][0]]) / 2.0))
        if self.draws_back:
            return f"go {aside} from waypoint {begin + 1} on"
        end = int(np.searchsorted(s, (s[self.at[-1][1]] + s[-1]) / 2.0))
        return f"go {aside} from waypoint {begin + 1} to waypoint {end + 1}"

    def put_down(self, waits: bool) -> str:
        """Where something is set down: the end, or the last stop if the path but draws back from it upwards.

        Args:
            waits: Whether it is to wait there, so that the place is meant and not the way down to it.
        """
        if not self.draws_back and (len(self.at) < 2 or self.at[-1][1] + 2 > len(self.positions) - 1):
            return "at the end"
        first = self.at[-1][0]
        after = self.at[-2][1] if len(self.at) > 1 else 0
        down = first - round(LAST_OF * (first - after))
        return f"at waypoint {first + 1}" if waits else f"from waypoint {down + 1} to waypoint {first + 1}"

    def before_down(self, _: re.Match[str]) -> str:
        """Where the way down begins on which something is set down; the end of a level path."""
        last = self.at[-1][0] if self.draws_back else len(self.positions) - 1
        up = self.positions @ self.scene.frame.direction("up")
        at = last
        while at > 0 and up[at - 1] > up[at] + 1e-9:
            at -= 1
        return f"at waypoint {at + 1}" if at < last else "at the end"

    def slope(self, found: re.Match[str]) -> str:
        """The way down to an object, or up from it: as far as the path falls before it stands there, or rises after."""
        falls = (found["way"] or found["noun"]).lower() in ("down", "descent")
        if falls == (found["link"].lower() in ("from", "off", "out of")):
            return found[0]
        away = self.called[found["at"].lower()].cuboid.signed(self.positions)[0]
        up = self.positions @ self.scene.frame.direction("up")
        first, last = min(self.at, key=lambda stop: float(away[stop[0]]), default=(int(away.argmin()),) * 2)
        at, step, end = (first, -1, 0) if falls else (last, 1, len(up) - 1)
        while at != end and up[at + step] > up[at] + 1e-9:
            at += step
        low, high = sorted((at, first if falls else last))
        return f"from waypoint {low + 1} to waypoint {high + 1}" if low < high else found[0]

    def kept(self, _: re.Match[str]) -> str:
        """What is picked and placed, and stays: the stops, or the ends of a path without any."""
        ranges = " and ".join(f"waypoints {a + 1} to {b + 1}" for a, b in self.at)
        return f"keep {ranges} as they are" if ranges else "keep the start and the end"


def _extreme(found: re.Match[str], scene: Scene, positions: Array) -> str:
    """Where a path (N, 3) [m] is highest, or farthest left, and what is after or before that, as waypoints."""
    along = positions @ scene.frame.direction(_EXTREMES[found["which"].lower()])
    there = np.flatnonzero(along >= along.max() - 1e-9)
    at, link = int(there[len(there) // 2]) + 1, found["link"].lower()
    if link == "at":
        return f"at waypoint {at}"
    return f"up to waypoint {at}" if link in ("before", "until", "till") else f"from waypoint {at} on"


def _bulge(up: Array) -> bool:
    """Whether a path of heights (N,) is higher on the way than at both its ends."""
    return float(up.max() - max(up[0], up[-1])) > BULGE * float(up.max() - up.min())


def _top(found: re.Match[str], scene: Scene, positions: Array) -> str:
    """The top or the bottom of a path (N, 3) [m] that is not level, as waypoints; of a wait, its highest one."""
    up = positions @ scene.frame.direction("down" if found["which"].lower() == "bottom" else "up")
    rise, wide = float(np.ptp(up)), float(np.ptp(positions, axis=0).max())
    if rise < LEVEL * wide or any(found["which"].lower() in name.lower().split() for name in scene.names):
        return found[0]
    if _WAITS.search(found.string):
        return f"at waypoint {int(up.argmax()) + 1}"
    high = up >= up.max() - TOP * rise
    first, last = next(run for run in runs(high) if run[0] <= up.argmax() <= run[1])
    return f"at waypoints {first + 1} to {last + 1}"


def not_so_high(text: str, scene: Scene, positions: Array | None) -> str:
    """A first instruction with "lower" for "not so high": but for the ends, if these are lower anyway.

    Args:
        text: As it was said or typed.
        scene: With the frame of the directions.
        positions: The path (N, 3) [m], or None.
    """

    def lower(found: re.Match[str]) -> str:
        way, change = ("up", "lower") if found["way"].lower() == "high" else ("down", "higher")
        bulges = positions is not None and _bulge(positions @ scene.frame.direction(way))
        return f"go {change}{', keep the start and the end' if bulges else ''}"

    return _NOT_SO.sub(lower, text)


def turning_back(positions: Array, stops: Sequence[int]) -> int | None:
    """The waypoint at which a path (N, 3) [m] turns back to where it began; None where it does not come back.

    It is the one farthest from the start, or a stop about as far.
    """
    away = np.linalg.norm(positions - positions[0], axis=1)
    far = max([int(away.argmax()), *(stop for stop in stops if away[stop] >= FAR * away.max())])
    return far if away[-1] < HALFWAY * away.max() else None


FAR, HALFWAY = 0.9, 0.5
"""Shares of the greatest distance from the start: of a stop that is the farthest place, and of a goal that is home."""

_BACK = re.compile(
    r"\bon (?:the|its|your) (?:way (?:back|home)|return(?: (?:trip|leg|way))?)\b(?! to\b)", re.IGNORECASE
)
_OUT = re.compile(
    r"\b(?:on (?:the|its|your) way (?:out|there)\b(?! to\b)"
    r"|(?:(?:on|in|during) )?the (?:outbound|outward) (?:\w+ )?(?:leg|segment|part|trip|way|run|stretch)\b)",
    re.IGNORECASE,
)

LONG_WORD = 3
"""Words of a name that are longer stand for it where no other name has them: "the lavender"."""

MANY = 2
"""The most corners of a path of which "the corner" without a number means the first."""


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
