"""The stops of a way that a sentence tells: which places it names, and what starts, is passed and ends the way."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product

from ovita.instruct.lexicon import DETERMINERS, concept_at, is_filler, term_at
from ovita.instruct.numerals import amount_at
from ovita.sources.apart import read_apart
from ovita.sources.phrases import (
    CARRIERS,
    DISMISSAL,
    WAY,
    WayPhrase,
    phrases_of,
    places_among,
)
from ovita.sources.places import SIDES, Location, Text, phrase_at, way_words
from ovita.sources.tagging import Role
from ovita.sources.wishes import TIES

BACK, FIRST, FINAL = map(way_words, ("again", "starting", "final"))


@dataclass(frozen=True, eq=False)
class WayStop:
    """A place of the way, or the words of one that the scene lacks; which pieces tell it, and what they leave out."""

    phrase: WayPhrase
    role: Role | None
    place: Location | None
    pieces: range
    lacking: str = ""
    left: str = ""
    waits: bool = False
    back: bool = False


@dataclass(frozen=True, eq=False)
class WayStops:
    """What the phrases of a sentence tell of its way.

    Args:
        phrases: All phrases, in order.
        told: All places, those that are taken back included.
        denied: Those that are said to be none of the way.
        placed: Those that make the way, in order, with the roles that are likeliest together.
        sure: How likely the way is that these make (0..1).
    """

    phrases: Sequence[WayPhrase]
    told: Sequence[WayStop]
    denied: Sequence[WayStop]
    placed: Sequence[WayStop]
    sure: float


def read_stops(text: Text) -> WayStops:
    """Read which places a sentence names, and what each is for its way."""
    phrases = read_apart(text, phrases_of(text))
    told = _told(text, phrases)
    denied = [stop for stop in told if stop.place is not None and _denied(text, phrases, stop)]
    kept = _repaired(text, [stop for stop in told if stop not in denied])
    return WayStops(phrases, told, denied, *_weighed(text, kept + _waited(text, phrases, kept)))


def _told(text: Text, phrases: Sequence[WayPhrase]) -> list[WayStop]:
    """The stops of the phrases of the way, each place once, and one without a role where an end is missing."""
    found: list[WayStop] = []
    for phrase in (phrase for phrase in phrases if phrase.role in WAY and not phrase.reasons):
        taken = {k for stop in found for k in stop.pieces}
        for stop in stops_of(text, phrase):
            if taken.isdisjoint(stop.pieces if stop.place else phrase.pieces):
                found.append(stop)
    if len({"start", "goal"} - {stop.role for stop in found}) == 1:
        beside = (p for before, p in pairwise(phrases) if before.role in ("start", "goal") or p.words[:1] == ("->",))
        found += (stop for phrase in beside if phrase.role is None and not phrase.why for stop in _bare(text, phrase))
    return found


def _bare(text: Text, phrase: WayPhrase) -> list[WayStop]:
    """The place that is all that a phrase holds: "box plate"."""
    words = [k for k in phrase.pieces if text.words[k][0].isalnum()]
    return [stop for stop in stops_of(text, phrase) if stop.place and len(stop.pieces) == len(words)]


def stops_of(text: Text, phrase: WayPhrase) -> list[WayStop]:
    """The places that a phrase names: one, or several in a row; without any, that it leads back or what is lacking."""
    if phrase.seen is not None:
        return [WayStop(phrase, "via", phrase.seen, phrase.pieces)]
    found = places_among(text, phrase.pieces)
    if found:
        return _row(text, phrase, found)
    if BACK & {*phrase.words} and {("back", "of"), ("back", "side")}.isdisjoint(pairwise(phrase.words)):
        onward = text.words[phrase.pieces.start : phrase.pieces.stop + 4]  # "then back to normal speed"
        paced = ("back", "to") in pairwise(onward) and not PACES.isdisjoint(onward)
        return [WayStop(phrase, phrase.role, None, phrase.pieces, back=not paced)]
    lacking = _lacking(text, phrase)
    left = phrase.said if phrase.measured else ""
    return [WayStop(phrase, phrase.role, None, phrase.pieces, lacking, left)]


def _lacking(text: Text, phrase: WayPhrase) -> str:
    """The last words of a phrase without a place that may be the name of a thing, or ""."""
    named = [k for k in phrase.pieces if text.words[k].isalpha() and not carries(text.words, k)]
    named = [k for k in named if len(text.words[k]) > 2 and text.words[k] not in TIES]
    last = [k for k in named if k == named[-1] or all(n in named for n in range(k, named[-1]))]
    if phrase.role == "via" and last and text.words[max(last[0] - 1, 0)] not in DETERMINERS:
        return ""  # "sittin right there" is no thing that is lacking
    return " ".join(text.words[k] for k in last)


def _row(text: Text, phrase: WayPhrase, found: Sequence[tuple[Location, range]]) -> list[WayStop]:
    """The first place of a phrase, and those that are joined to it: "via the mast and the pad", "box plate"."""
    rows = [[found[0]]]
    for (_, before), (place, pieces) in pairwise(found):
        joined = JOINING.issuperset(text.words[before.stop : pieces.start])
        if joined and not same_place(place, rows[-1][0][0]):
            rows.append([])
        rows[-1].append((place, pieces))
    until = [*(row[0][1].start for row in rows[1:]), phrase.pieces.stop]
    stops = []
    for ((first, pieces), *others), end in zip(rows, until, strict=True):
        alike = [place for place, _ in others if same_place(place, first)]
        place = _detailed(text, first, alike, range(pieces.stop, end))
        past = phrase.role == "via" and not PAST.isdisjoint(text.words[max(pieces.start - 1, 0) : pieces.start + 1])
        if past and place.relation == "at" and place.objects:
            place = replace(place, relation="beside")  # "pass the cup" leads by it, and not over it
        stops.append(WayStop(phrase, phrase.role, place, pieces))
    return [*stops[:-1], replace(stops[-1], left=_left(text, phrase, stops[-1], found))]


PACES = frozenset(("speed", "pace", "velocity"))
"""What the way does not lead back to."""

PAST = frozenset(("past", "pass", "passing", "passes"))

JOINING = frozenset(("and", "&", "n", "plus", "+", ",", "->", "then"))
"""Words between places that are passed one after the other."""


def _detailed(text: Text, first: Location, alike: Sequence[Location], behind: range) -> Location:
    """A place with the distance or the side that is told behind it, perhaps with its object once more."""
    for place in alike:
        if place.distance is not None:  # "finish at the plate half a metre above it"
            return place
    sides = (text.sided(first, k)[0] for k in behind)  # "the bottle shall be passed on the left"
    place = next((place for place in sides if place.relation != first.relation), first)
    if place.distance is not None or place.relation in ("at", "between"):
        return place
    return replace(place, distance=_metres(text.words, behind))  # "above the vase with 10 cm to spare"


def _metres(words: Sequence[str], pieces: Iterable[int]) -> float | None:
    """The first distance [m] that is told among some words, or None."""
    amounts = (amount_at(words, k) for k in pieces)
    return next((amount.value for amount in amounts if amount is not None and amount.unit == "m"), None)


def _left(text: Text, phrase: WayPhrase, stop: WayStop, found: Sequence[tuple[Location, range]]) -> str:
    """The words of a phrase if they tell a distance or a side that its place does not hold, else ""."""
    place, taken = stop.place, {k for _, pieces in found for k in pieces}
    if place is None or place.point is not None:
        return ""
    over = [k for k in phrase.pieces if k not in taken]
    far = place.distance is None and _metres(text.words, over) is not None
    turned = any(term_at(text.words, k)[0] in TURNING or text.words[k] == "side" for k in over)
    widely = any(text.words[k] in WIDELY and k + 1 in taken for k in over) and place.distance is None
    aside = turned and place.relation not in SIDES
    return phrase.said if far or widely or aside else ""


TURNING = frozenset(("left", "right"))
WIDELY = frozenset(("well", "high", "far"))
"""In front of a relation, these ask for more than a place by itself: "well above the statue"."""


def carries(words: Sequence[str], k: int) -> bool:
    """Whether a word only carries the way."""
    return is_filler(words[k]) or bool(concept_at(words, k)[0]) or words[k] in CARRIERS


def same_place(one: Location | None, other: Location | None) -> bool:
    """Whether two places are at the same objects or point."""
    return one is not None and other is not None and one.objects == other.objects and one.point == other.point


def _waited(text: Text, phrases: Sequence[WayPhrase], stops: Sequence[WayStop]) -> list[WayStop]:
    """Places that are named only for a wait at them."""
    waits = [stops_of(text, phrase)[0] for phrase in phrases if phrase.role == "wait"]
    return [
        replace(stop, role="via", waits=True, left="")
        for stop in waits
        if stop.place is not None and not any(same_place(stop.place, other.place) for other in stops)
    ]


def _denied(text: Text, phrases: Sequence[WayPhrase], stop: WayStop) -> bool:
    """Whether a place is said to be none of the way: "do not start from the box", "never mind the box"."""
    first = stop.pieces.start
    wished = {k for phrase in phrases if phrase.role in ("wish", "wait") for k in phrase.pieces}
    begun = (k + 1 for k in range(first - 1, -1, -1) if not text.words[k][0].isalnum() or k in wished)
    before = range(max(next(begun, 0), first - 6), first)
    return any(term_at(text.words, k)[0] == "never" or phrase_at(text.words, k, DISMISSAL)[1] for k in before)


PASSING = frozenset((*SIDES, "over", "under", "between"))
"""Relations with which a place that follows a goal at once is passed on the way there."""

STARTS, GOALS = (0.08, 0.9, 0.03), (0.02, 1.0, 0.2, 0.1)
"""How likely a sentence tells so many starts, and so many goals."""

MOST = 7
"""Places whose roles are weighed together."""

MEANT = 0.3
"""How likely a place behind a word that takes back what was said has to have the role of the one before it."""

PASSED = frozenset(("past", "thru"))
"""Classes of words with which a place is passed, and neither start nor goal."""

EPS = 1e-4
"""Roles that are so much less likely than the likeliest do not count."""

UNLIKELY = 0.02
"""How likely a role is against what arrows and such words tell."""


def _repaired(text: Text, stops: Sequence[WayStop]) -> list[WayStop]:
    """The stops without those that were taken back at once: "from the box, sorry, from the cup"."""
    found, gone = sorted(stops, key=_where), set[WayStop]()
    for k, (one, other) in enumerate(pairwise(found)):
        between = range(one.phrase.pieces.stop, other.phrase.pieces.start)
        taken = any(term_at(text.words, n)[0] == "correct" for n in between)
        if taken and one.role is not None and other.place is not None and other.phrase.shares[one.role] > MEANT:
            gone.add(one)
            found[k + 1] = replace(other, role=one.role)
    return [stop for stop in found if stop not in gone]


def _where(stop: WayStop) -> int:
    return stop.pieces.start


def _without_rivals(text: Text, stops: Sequence[WayStop], found: Sequence[set[Role]]) -> None:
    """Add to the roles that each place cannot well have the end that another one is by its words: "finish at"."""
    for stop, unlike in zip(stops, found, strict=True):
        unlike |= {"goal"} if _halts(text, stop) and any(s.role == "goal" for s in stops if s is not stop) else set()
    ends: tuple[tuple[Role, frozenset[str]], ...] = (("start", FIRST), ("goal", FINAL))
    for end, marks in ends:
        said = [not marks.isdisjoint(text.words[stop.phrase.pieces.start : stop.pieces.start]) for stop in stops]
        if said.count(True) == 1:
            for unlike, told_so in zip(found, said, strict=True):
                unlike |= set() if told_so else {end}


def _against(text: Text, stops: Sequence[WayStop]) -> list[set[Role]]:
    """The roles that each place cannot well have: "past the cup" is no goal, and what an arrow leads to no start."""
    found: list[set[Role]] = []

    def told(role: Role) -> bool:
        return any(stop.role == role for stop in stops)

    for stop in stops:
        cues = range(min(stop.phrase.pieces.start, stop.pieces.start), stop.pieces.start + 1)
        passed = any(term_at(text.words, k)[0] in PASSED for k in cues)
        left = text.words[cues.start] == "from" and stop.place is not None and stop.place.distance is None
        found.append({"start", "goal"} if passed else {"goal"} if left else set())
    _without_rivals(text, stops, found)
    for k, ((one, first), (two, second)) in enumerate(pairwise(zip(stops, found, strict=True))):
        between = {*text.words[one.pieces.stop : two.pieces.start]}
        onward = pairwise(text.words[one.pieces.stop : two.pieces.stop])
        between |= {"then"} if ("on", "to") in onward else set()
        listed_alike = one.phrase is two.phrase and one.role != "via"
        if "->" in between or listed_alike or "then" in between:
            first.add("goal")
            second.add("start")
            if not between and two.place is not None and two.place.relation in PASSING:
                first.discard("goal")  # "to the gate left of the tower"
                second.add("goal")
            if "->" not in between:  # of a mere list, the ends are the first and the last
                first |= {"via"} if k == 0 and not told("start") else set()
                second |= {"via"} if k == len(stops) - 2 and not told("goal") else set()
    return found


def _halts(text: Text, stop: WayStop) -> bool:
    """Whether a place is told for a stop of so long: "stop at the pallet for 5 s"."""
    behind = text.words[stop.pieces.stop : stop.pieces.stop + 5]
    halts = any(term_at(stop.phrase.words, k)[0] in ("stop", "wait") for k in range(len(stop.phrase.words)))
    return halts and any(amount.unit == "s" for k in range(len(behind)) if (amount := amount_at(behind, k)) is not None)


def _weighed(text: Text, stops: Sequence[WayStop]) -> tuple[list[WayStop], float]:
    """The stops in order with the likeliest roles together, and how likely the way is that these make."""
    found = sorted(stops, key=_where)
    placed = [stop for stop in found if stop.place is not None and not stop.waits][:MOST]
    told = [stop.role for stop in found if stop.back]
    against = _against(text, placed)

    def likely(roles: Sequence[Role]) -> float:
        starts, goals = (sum(role == end for role in (*roles, *told)) for end in ("start", "goal"))
        prior = STARTS[min(starts, 2)] * GOALS[min(goals, 3)]
        shares = (max(s.phrase.shares[r], 1e-3) for s, r in zip(placed, roles, strict=True))
        odd = sum(role in unlike for role, unlike in zip(roles, against, strict=True))
        return prior * UNLIKELY**odd * math.prod(shares)

    def given(roles: Sequence[Role]) -> list[WayStop]:
        of = dict(zip(placed, roles, strict=True))
        return [replace(stop, role=of[stop]) if stop in of else stop for stop in found]

    weighed = [(likely(roles), roles) for roles in product(WAY, repeat=len(placed))]
    most, roles = max(weighed, key=lambda one: one[0])
    likeliest = given(roles)
    way = ordered_way(likeliest)
    alike = sum(share for share, roles in weighed if share > EPS * most and ordered_way(given(roles)) == way)
    if likeliest and likeliest[0].waits and not any(stop.role == "start" for stop in likeliest):
        likeliest[0] = replace(likeliest[0], role="start")  # "wait at the box for 2 s, then go to the plate"
    return likeliest, alike / sum(share for share, _ in weighed)


Way = tuple[Location | None, tuple[Location, ...], Location | None]
"""The start, what is passed in order, and the goal."""


def ordered_way(stops: Sequence[WayStop]) -> Way:
    """The way that stops with these roles make; a goal before the last one is passed."""
    stops = _corrected([stop for stop in stops if stop.place or stop.back])
    start = next((stop.place for stop in stops if stop.role == "start" and stop.place), None)
    last = next((stop for stop in reversed(stops) if stop.role == "goal"), None)
    goal = None if last is None else start if last.back else last.place
    passed = [stop.place for stop in stops if stop.place and stop.role != "start" and stop is not last]
    if passed and same_place(passed[-1], goal) and passed[-1].relation == "at":
        passed.pop()
    if goal is not None and goal.relation == "between" and not (start or passed):
        one, other = goal.objects  # "two laps of the cup between the box and the plate"
        return Location(objects=(one,)), (), Location(objects=(other,))
    return start, tuple(passed), goal


def _corrected(stops: Sequence[WayStop]) -> Sequence[WayStop]:
    """The stops that count: "the box to the cup, no, the box to the plate" starts anew."""
    starts = [k for k, stop in enumerate(stops) if stop.role == "start" and stop.place is not None]
    if len(starts) < 2 or not any(stop.role == "goal" for stop in stops[starts[-1] :]):
        return stops
    again = starts[-1]
    if any(same_place(stop.place, stops[again].place) for stop in stops[:again] if stop.role != "start"):
        return stops  # "from A to B, then from B to C"
    return [stop for k, stop in enumerate(stops) if k >= again or stop.role == "via"]
