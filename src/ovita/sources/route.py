"""The way that a sentence tells: where it starts, what it passes, where it ends, and what else is wished for.

"From the box to the plate over the bottle, slowly, then a small spiral" has a start, a goal and a via point, and
"slowly" and "a small spiral" are wishes that adapt the planned path. Which words tell what is found by a small network
(see `tagging`), which place they mean by the reader of places, and the wishes are read by the readers of instructions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product

from ovita.instruct.frames import Height, Quantity, Reading, SemanticFrame, Wait, same
from ovita.instruct.lexicon import DETERMINERS, concept_at, is_filler, term_at
from ovita.instruct.numbers import amount_at
from ovita.instruct.referee import DO, Outcome, understand
from ovita.paths.part import WHOLE
from ovita.paths.scene import Scene
from ovita.sources.heights import Level, read_level
from ovita.sources.places import Location, Text
from ovita.sources.tagging import Role, TaggedPhrase, seen_with_points, tagger
from ovita.text import listed, quoted, the

SURE = 0.6
"""How likely the roles of the places have to be, among all that they might have, to be planned without asking."""

BACK = frozenset("back return returning returns home again".split())
FASTEST = frozenset("possible can allowed asap throttle flat top full maximum max".split())
"""With a word of haste, these ask for the robot's highest speed."""

HASTE = frozenset("fast quick quickly fastest soon speed asap throttle flat".split())


@dataclass(frozen=True)
class Wish:
    """What is asked for besides the way.

    Args:
        text: In the words of the sentence.
        outcome: What is to be done about it: do it, show it first, ask back, or decline.
        reading: The frames that it comes to, or its question.
        unused: Words that ask for something and that the reading leaves out.
        doubts: What speaks against the reading, as sentences.
    """

    text: str
    outcome: Outcome
    reading: Reading
    unused: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()

    @property
    def frames(self) -> tuple[SemanticFrame, ...]:
        """What it comes to."""
        return self.reading.frames


@dataclass(frozen=True, eq=False)
class Route:
    """What a sentence says of the way.

    Args:
        start: Where it starts, or None.
        goal: Where it ends, or None.
        via: What it passes, in order.
        wishes: What else it asks for, in order.
        notes: Spellings that were corrected, and what was taken to ask for nothing.
        unknown: Names of things that are not in the scene.
        names: Of the objects that are.
        fastest: Whether it asks for the robot's highest speed.
        level: The height to go at, or None.
        doubts: Why the way should be shown before it counts, as sentences.
    """

    start: Location | None = None
    goal: Location | None = None
    via: tuple[Location, ...] = ()
    wishes: tuple[Wish, ...] = ()
    notes: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    fastest: bool = False
    level: Level | None = None
    doubts: tuple[str, ...] = ()

    @property
    def rest(self) -> str:
        """What else it asks for, in words."""
        return ", ".join(wish.text for wish in self.wishes)

    @property
    def circled(self) -> tuple[str, ...]:
        """Names of the objects that are to be circled."""
        frames = (frame for wish in self.wishes for frame in wish.frames)
        return tuple(name for f in frames if getattr(f, "shape", "") == "circle" for name in f.named)

    @property
    def ceiling(self) -> float | None:
        """The height above the ground that the whole way is not to exceed [m], or None."""
        frames = (frame for wish in self.wishes for frame in wish.frames if frame.part == WHOLE)
        levels = [f.level.value for f in frames if isinstance(f, Height) and f.level.role == "at_most"]
        return min(levels, default=None)

    @property
    def question(self) -> str:
        """What is not known of the way, as a question, or ""."""
        said = (place for place in (self.start, *self.via, self.goal) if place is not None)
        unclear = next((place.unclear for place in said if place.unclear), "")
        asked = unclear or UNKNOWN[self.start is not None, self.goal is not None]
        if not self.unknown:
            return asked
        known = f"the objects are {listed(map(repr, self.names))}" if self.names else "it holds no objects"
        return f"There is no {listed(map(repr, self.unknown), 'or')} in the scene; {known}. {asked}".strip()


UNKNOWN = {
    (False, False): "From where to where? There is no trajectory yet: say for instance 'from the box to the plate'.",
    (False, True): "Where does it start? There is no trajectory yet: say for instance 'from the box'.",
    (True, False): "Where does it end? Say for instance 'to the plate'.",
    (True, True): "",
}
"""What to ask, by whether start and goal are known."""


@dataclass(frozen=True, eq=False)
class _Said:
    """A phrase of the way, with the place that it names, or else the words of one that the scene lacks."""

    phrase: TaggedPhrase
    place: Location | None
    lacking: str = ""
    waits: bool = False
    back: bool = False


def read_route(sentence: str, scene: Scene) -> Route:
    """Read the way that a sentence tells, and what else it asks for."""
    text = Text(sentence, scene)
    points = [piece.span for piece in text.pieces if piece.point is not None]
    phrases = tagger().read(seen_with_points(text.text, scene, points))
    told = [_said(text, phrase) for phrase in phrases if phrase.role in ("start", "via", "goal")]
    denied = [stop for stop in told if stop.place is not None and _denied(text, stop)]
    kept = _repaired(text, [stop for stop in told if stop not in denied])
    stops, sure = _completed(text, kept + _waited(text, phrases, kept))
    start, via, goal = _ordered(_corrected(stops))
    heard, level, fastest = _asked(text, phrases, stops, goal)
    wishes = tuple(wish for wish in heard if wish.outcome != "decline")
    passed, left = _passed_over(text, phrases)
    left += [wish.text for wish in heard if wish.outcome == "decline"]
    named = {item.name for stop in told if stop.place is not None for item in stop.place.objects}
    named |= {name for wish in wishes for frame in wish.frames for name in frame.named}
    unplaced = [s for s in kept if s.place is None and not (s.back or s.lacking) and _measured(_words(text, s.phrase))]
    roles = {stop.phrase.role for stop in kept if stop.place is not None}
    left += [_text(text, stop.phrase) for stop in (*unplaced, *(s for s in denied if s.phrase.role not in roles))]
    said = " ".join((*left, *passed)).lower()
    left += [item for item in _mentioned(text) if item not in named and item.lower() not in said]
    doubts = ["It is not certain what starts, what is passed and what ends the way."] if sure < SURE else []
    known: dict[Role | None, bool] = {"start": start is not None, "goal": goal is not None}
    unknown = [stop.lacking for stop in stops if stop.lacking and not known.get(stop.phrase.role, False)]
    return Route(
        start,
        goal,
        via,
        wishes,
        notes=(*text.notes, *(f"took {words!r} as {why}" for words, why in passed.items())),
        unknown=tuple(dict.fromkeys(unknown)),
        names=tuple(scene.names),
        fastest=fastest,
        level=level,
        doubts=(*doubts, *(f"Nothing is done about {quoted([words])}." for words in left)),
    )


def _asked(
    text: Text, phrases: Sequence[TaggedPhrase], stops: Sequence[_Said], goal: Location | None
) -> tuple[tuple[Wish, ...], Level | None, bool]:
    """What is asked for besides the places: wishes and waits, a height to plan at, and whether to go at full speed."""
    wishes: list[Wish] = []
    level: Level | None = None
    fastest = False
    for phrase in (one for one in phrases if one.role in ("wish", "wait")):
        words = _words(text, phrase)
        height = read_level(words) if phrase.role == "wish" and level is None else None
        if phrase.role == "wait":
            wishes += _wait(text, phrase, stops, goal)
        elif height is not None:
            level = height
        elif HASTE & set(words) and FASTEST & set(words) and not _amounts(words):
            fastest = True
        elif any(map(str.isalnum, "".join(words))) and not _careful(words):
            wishes += _wishes(_bare(_resolved(text, phrase)), text.scene)
    return tuple(wishes), level, fastest


def _mentioned(text: Text) -> list[str]:
    """The objects that a sentence names, each on its own."""
    names, k = list[str](), 0
    while k < len(text):
        found = text.object_at(k)
        if found is not None and not found[0].unclear:
            names += [item.name for item in found[0].objects]
        k = k + 1 if found is None else found[1]
    return list(dict.fromkeys(names))


def _pieces(text: Text, phrase: TaggedPhrase) -> range:
    """The pieces of a text that a phrase covers."""
    inside = [k for k, p in enumerate(text.pieces) if phrase.span[0] <= p.span[0] < phrase.span[1]]
    return range(inside[0], inside[-1] + 1) if inside else range(0)


def _words(text: Text, phrase: TaggedPhrase) -> list[str]:
    return [text.words[k] for k in _pieces(text, phrase)]


def _text(text: Text, phrase: TaggedPhrase) -> str:
    return text.text[slice(*phrase.span)].strip()


def _resolved(text: Text, phrase: TaggedPhrase) -> str:
    """The words of a phrase, with the object that was named last before for "it": "30 cm clearance from it"."""
    said = ""
    for k in _pieces(text, phrase):
        begin, end = text.pieces[k].span
        meant = text.words[k] == "it" and k > 0 and text.words[k - 1] in POINTING and text.meant_at(k)
        gap = text.text[text.pieces[k - 1].span[1] : begin] if said else ""
        said += gap + (the(meant.objects[0].name) if meant else text.text[begin:end])
    return said.strip()


POINTING = frozenset("from of near to around round over above by at behind past under below beside".split())
"""Words behind which "it" is the object that was named last."""


def _amounts(words: Sequence[str]) -> bool:
    return any(amount_at(words, k) is not None for k in range(len(words)))


def _said(text: Text, phrase: TaggedPhrase) -> _Said:
    """The first place that a phrase names."""
    inside = _pieces(text, phrase)
    found = [place for k in inside if (place := text.place_at(k)) is not None]
    if found:
        return _Said(phrase, _told(text, [place for place, _ in found], range(found[0][1], inside[-1] + 1)))
    if BACK & set(_words(text, phrase)):
        return _Said(phrase, None, back=True)
    named = [k for k in inside if text.words[k].isalpha() and not _carries(text.words, k)]
    named = [k for k in named if len(text.words[k]) > 2 and text.words[k] not in TIES]
    last = [k for k in named if k == named[-1] or all(n in named for n in range(k, named[-1]))]
    if phrase.role == "via" and last and text.words[max(last[0] - 1, 0)] not in DETERMINERS:
        return _Said(phrase, None)  # "sittin right there" is no thing that is lacking
    return _Said(phrase, None, " ".join(text.words[k] for k in last))


def _told(text: Text, places: Sequence[Location], behind: range) -> Location:
    """The first place of a phrase, with the distance or the side that is told behind it."""
    first = places[0]
    nearer = next((p for p in places if p.objects == first.objects and p.distance is not None), None)
    if nearer is not None:  # "finish at the plate half a metre above it"
        return nearer
    sides = (text.sided(first, k)[0] for k in behind)  # "the bottle shall be passed on the left"
    return next((place for place in sides if place.relation != first.relation), first)


def _carries(words: Sequence[str], k: int) -> bool:
    """Whether a word only carries the way."""
    return is_filler(words[k]) or bool(concept_at(words, k)[0]) or words[k] in CARRIERS


CARRIERS = frozenset(
    """start starting starts begin beginning end ending ends finish finishing stop stopping arrive arriving leave
    leaving go going goes head heading land landing take off pick drop put bring carry fly drive move travel pass
    passing via by at in on to from the a an with where it is wherever whatever there here this that out up over down
    away point destination origin goal target depart departing proceed return place call visit visiting reach
    reaching come coming""".split()
)
"""Words around a place that are no name."""


def _corrected(stops: Sequence[_Said]) -> list[_Said]:
    """The stops that count: "the box to the cup, no, the box to the plate" starts anew."""
    starts = [k for k, stop in enumerate(stops) if stop.phrase.role == "start" and stop.place is not None]
    again = starts[-1] if len(starts) > 1 and any(s.phrase.role == "goal" for s in stops[starts[-1] :]) else 0
    kept = [s for k, s in enumerate(stops) if k >= again or s.phrase.role == "via"]
    same = len(starts) > 1 and _continues(stops, again)
    return list(stops) if same else kept


def _continues(stops: Sequence[_Said], again: int) -> bool:
    """Whether a second start is where the way had come to: "from A to B, then from B to C"."""
    return any(_same(stop.place, stops[again].place) for stop in stops[:again] if stop.phrase.role != "start")


def _same(one: Location | None, other: Location | None) -> bool:
    return one is not None and other is not None and one.objects == other.objects and one.point == other.point


def _waited(text: Text, phrases: Sequence[TaggedPhrase], stops: Sequence[_Said]) -> list[_Said]:
    """Places that are named only for a wait at them."""
    waits = [_said(text, phrase) for phrase in phrases if phrase.role == "wait"]
    return [
        replace(s, phrase=replace(s.phrase, role="via"), waits=True)
        for s in waits
        if s.place is not None and not any(_near(s.place, stop.place) for stop in stops)
    ]


def _near(one: Location | None, other: Location | None) -> bool:
    return one is not None and other is not None and one.objects == other.objects


STARTS, GOALS = (0.08, 0.9, 0.03), (0.02, 1.0, 0.2, 0.1)
"""How likely a sentence tells so many starts, and so many goals."""

MOST = 7
"""Places whose roles are weighed together."""


def _denied(text: Text, stop: _Said) -> bool:
    """Whether a place is said to be none of the way: "do not start from the box"."""
    inside = _pieces(text, stop.phrase)
    before = next((k + 1 for k in range(inside[0] - 1, -1, -1) if not text.words[k][0].isalnum()), 0)
    first = next(k for k in inside if text.place_at(k) is not None)
    return any(term_at(text.words, k)[0] == "never" for k in range(max(before, first - 6), first))


def _repaired(text: Text, stops: Sequence[_Said]) -> list[_Said]:
    """The stops without those that were taken back at once: "from the box, sorry, from the cup"."""
    found, gone = sorted(stops, key=lambda stop: stop.phrase.span), set[_Said]()
    for k, (one, other) in enumerate(pairwise(found)):
        between = range(_pieces(text, one.phrase)[-1] + 1, _pieces(text, other.phrase)[0])
        role = one.phrase.role
        taken = any(term_at(text.words, n)[0] == "correct" for n in between) and role is not None
        if taken and role is not None and other.place is not None and other.phrase.shares[role] > MEANT:
            gone.add(one)
            found[k + 1] = replace(other, phrase=replace(other.phrase, role=role))
    return [stop for stop in found if stop not in gone]


MEANT = 0.3
"""How likely a place behind a word that takes back what was said has to have the role of the one before it."""

PASSED = frozenset(("past", "thru"))
"""Classes of words with which a place is passed, and neither start nor goal."""

UNLIKELY = 0.02
"""How likely a role is against what arrows and such words tell."""


def _against(text: Text, stops: Sequence[_Said]) -> list[set[Role]]:
    """The roles that each place cannot well have: "past the cup" is no goal, and what an arrow leads to no start."""
    found: list[set[Role]] = []
    at = [next((k for k in _pieces(text, stop.phrase) if text.place_at(k) is not None), 0) for stop in stops]
    for stop, place in zip(stops, at, strict=True):
        cues = range(_pieces(text, stop.phrase)[0], place + 1)
        passed = any(term_at(text.words, k)[0] in PASSED for k in cues)
        found.append({"start", "goal"} if passed else set())
    for (one, first), (other, second) in pairwise(zip(at, found, strict=True)):
        if "->" in text.words[one:other]:
            first.add("goal")
            second.add("start")
    return found


def _completed(text: Text, stops: Sequence[_Said]) -> tuple[list[_Said], float]:
    """The stops in order with the likeliest roles together, and how likely these are."""
    found = sorted(stops, key=lambda stop: stop.phrase.span)
    placed = [stop for stop in found if stop.place is not None and not stop.waits][:MOST]
    told = [stop.phrase.role for stop in found if stop.back]
    against = _against(text, placed)

    def likely(roles: Sequence[Role]) -> float:
        starts, goals = (sum(role == end for role in (*roles, *told)) for end in ("start", "goal"))
        prior = STARTS[min(starts, 2)] * GOALS[min(goals, 3)]
        shares = (max(s.phrase.shares[r], 1e-3) for s, r in zip(placed, roles, strict=True))
        odd = sum(role in unlike for role, unlike in zip(roles, against, strict=True))
        return prior * UNLIKELY**odd * math.prod(shares)

    ways: tuple[Role, ...] = ("start", "via", "goal")
    weighed = {roles: likely(roles) for roles in product(ways, repeat=len(placed))}
    likeliest = max(weighed, key=lambda roles: weighed[roles])
    best = dict(zip(placed, likeliest, strict=True))
    sure = weighed[likeliest] / sum(weighed.values())
    return [replace(s, phrase=replace(s.phrase, role=best[s])) if s in best else s for s in found], sure


def _ordered(stops: Sequence[_Said]) -> tuple[Location | None, tuple[Location, ...], Location | None]:
    """The start, what is passed in order, and the goal; a goal before the last one is passed."""
    start = next((s.place for s in stops if s.phrase.role == "start" and s.place is not None), None)
    goals = [s for s in stops if s.phrase.role == "goal" and (s.place is not None or s.back)]
    last = goals[-1] if goals else None
    goal = None if last is None else start if last.back else last.place
    passed = [s.place for s in stops if s.phrase.role in ("via", "goal") and s is not last and s.place is not None]
    if goal is not None and passed and _same(passed[-1], goal) and passed[-1].relation == "at":
        passed = passed[:-1]
    return start, tuple(place for place in passed if place is not None), goal


def _wait(text: Text, phrase: TaggedPhrase, stops: Sequence[_Said], goal: Location | None) -> list[Wish]:
    """The wait that a phrase tells, at the place that it names or that was named last before it."""
    words = _words(text, phrase)
    amounts = (amount_at(words, k) for k in range(len(words)))
    duration = next((amount for amount in amounts if amount is not None and amount.unit == "s"), None)
    own = _said(text, phrase).place
    before = [s.place for s in stops if s.phrase.span[0] < phrase.span[0] and s.phrase.role != "start"]
    behind = [s for s in stops if s.phrase.span[0] > phrase.span[0] and s.phrase.role == "via"]
    at_once = [s.place for s in behind if not text.text[phrase.span[1] : s.phrase.span[0]].strip()]
    likely = (own, *at_once, *before[::-1], *(s.place for s in behind), goal)
    place = next((p for p in likely if p is not None and p.objects), None)
    said = _text(text, phrase)
    if duration is None or place is None:
        return _wishes(said, text.scene)
    at_end = goal is not None and _same(place, goal) and [_same(s.place, goal) for s in stops].count(True) == 1
    where = "goal" if at_end else place.objects[0].name
    frame = Wait(place=where, duration=Quantity(duration.value, "s", "at"))
    told = f"wait {duration.value:g} s at the {where}"
    return [Wish(told, "do", Reading(frames=(frame,)))]


def _bare(said: str) -> str:
    """A wish without the words that tie it to what is before."""
    said = said.strip(" ,;.:")
    first, _, rest = said.partition(" ")
    return _bare(rest) if first.lower().strip(",") in TIES and rest else said


TIES = frozenset("and n but then also so please or having been".split())


def _wishes(said: str, scene: Scene) -> list[Wish]:
    """What a phrase of wishes comes to: as a whole, or part by part where only that is certain."""
    whole = _wish(said, scene)
    parts = [
        _wish(part, scene)
        for text in said.replace(";", ",").replace(" and ", ", ").split(", ")
        if (part := _bare(text))
    ]
    certain = len(parts) > 1 and all(part.outcome == "do" for part in parts)
    if certain and (whole.outcome != "do" or len(whole.frames) < len(parts)):
        return parts
    sure = [part for part in parts if part.outcome == "do"]
    if whole.outcome == "needs_confirmation" and sure and not any(p.frames for p in parts if p not in sure):
        told = tuple(frame for part in sure for frame in part.frames)
        if same(told, whole.frames):  # "a metre from the nest, she sits on six eggs"
            return sure
    kinds = {type(frame) for frame in whole.frames}
    lost = (part for part in parts if part.outcome == "do" and not kinds & {type(frame) for frame in part.frames})
    return [whole, *(lost if kinds else ())]


def _wish(said: str, scene: Scene) -> Wish:
    """What a phrase comes to: within a sentence, a word too many that asks for nothing does not put it in doubt."""
    verdict = understand(said, scene)
    enough = {"both": DO, "rules": PLAIN, "learned": 2.0}[verdict.by]
    plain = verdict.by == "both" or not verdict.unused
    sure = verdict.confidence >= enough and plain and not verdict.doubts
    outcome: Outcome = "do" if sure and verdict.outcome == "needs_confirmation" else verdict.outcome
    return Wish(said, outcome, verdict.reading, verdict.unused, verdict.doubts)


PLAIN = 0.55
"""How likely a phrase of which the rules read every word has to be meant to be done without asking."""


def _passed_over(text: Text, phrases: Sequence[TaggedPhrase]) -> tuple[dict[str, str], list[str]]:
    """Words without a role that tell something: those that ask for nothing and why, and those that may ask."""
    passed, left = dict[str, str](), list[str]()
    for phrase in phrases:
        words = _words(text, phrase)
        if phrase.role is not None or not any(map(str.isalnum, "".join(words))):
            continue
        said = _text(text, phrase).strip(" ,;.:")
        if _careful(words):
            passed[said] = "what the limits see to"
            continue
        told = [k for k, word in enumerate(words) if word.isalpha() and word not in TIES and not _carries(words, k)]
        terms = {term_at(words, k)[0] for k in range(len(words))}
        turned = bool(terms & {"never", "correct"} and terms & {"left", "right", "front", "back", "over", "under"})
        wanted = bool(DEMANDS & set(words)) or phrase.shares["wish"] + phrase.shares["wait"] > ASKS
        if _measured(words) or turned or (told and wanted):
            left.append(said)
        elif len(words) > 2 and told:
            passed[said] = "asking for nothing"
    return passed, left


def _careful(words: Sequence[str]) -> bool:
    """Whether words ask for nothing but what the limits see to: "without hitting the cup"."""
    denied = any(term_at(words, k)[0] == "never" for k in range(len(words)))
    return denied and bool(TOUCHING & set(words)) and not _amounts(words)


def _measured(words: Sequence[str]) -> bool:
    """Whether words hold an amount: with a unit, or behind a word that says of what."""
    amounts = ((k, amount_at(words, k)) for k in range(len(words)))
    return any(a.unit or (k > 0 and words[k - 1] in ("by", "to", "at", "of")) for k, a in amounts if a is not None)


TOUCHING = frozenset("hit hitting knock knocking touch touching bump bumping crash crashing collide colliding".split())
"""Words that ask not to touch something, which the limits see to."""

DEMANDS = frozenset("must shall should never avoid keep".split())

ASKS = 0.5
"""How likely words without a role may be a wish and yet be passed over."""
