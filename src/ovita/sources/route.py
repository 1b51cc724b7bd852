"""The way that a sentence tells: where it starts, what it passes, where it ends, and what else is wished for.

"From the box to the plate over the bottle, slowly, then a small spiral" has a start, a goal and a via point, and
"slowly" and "a small spiral" are wishes that adapt the planned path. Which words tell what is found by a small network
(see `tagging`), which place they mean by the reader of places, and the wishes are read by the readers of instructions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ovita.instruct.frames import (
    Clearance,
    Extend,
    Figure,
    Height,
    Pace,
    Quantity,
    Reading,
    SemanticFrame,
    Shift,
    Smooth,
    StopAt,
    Wait,
    same,
)
from ovita.instruct.numbers import Amount
from ovita.instruct.referee import DO, Outcome, understand
from ovita.paths.part import WHOLE, PathPart
from ovita.paths.scene import Scene
from ovita.sources.places import PHRASES, SIDES, Location, Text, way_words
from ovita.sources.reasons import FINITE
from ovita.sources.stops import (
    CARRIERS,
    TIES,
    TOUCHING,
    TURNING,
    WayPhrase,
    WayStop,
    carries,
    ordered_way,
    places_among,
    read_stops,
    same_place,
    stops_of,
)
from ovita.sources.tagging import Role
from ovita.text import listed, quoted, the

SURE = 0.6
"""How likely the way has to be, among all that the places might make, to be planned without asking."""

FASTEST, HASTE, POINTING, DEMANDS = map(way_words, ("fastest", "haste", "pointing", "demand"))


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


@dataclass(frozen=True)
class Level:
    """A height over the ground to go at between the ends of the way.

    Args:
        height: [m].
        least: Whether higher is as good.
    """

    height: float
    least: bool


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
        barred: Names of the objects that it is not to lead over.
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
    barred: tuple[str, ...] = ()
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


def read_route(sentence: str, scene: Scene) -> Route:
    """Read the way that a sentence tells, and what else it asks for."""
    text = Text(sentence, scene)
    stops = read_stops(text)
    start, via, goal = ordered_way(stops.placed)
    asked = _Besides(text, stops.placed, start, goal)
    for phrase in stops.phrases:
        asked.hear(phrase, any(stop.phrase is phrase for stop in stops.denied))
    asked.weigh_up(stops.told)
    known: dict[Role | None, bool] = {"start": start is not None, "goal": goal is not None}
    unknown = [stop.lacking for stop in stops.placed if stop.lacking and not known.get(stop.role, False)]
    unsure = ("It is not certain what starts, what is passed and what ends the way.",) if stops.sure < SURE else ()
    return Route(
        start,
        asked.goal,
        tuple(_seen(place, start, goal, scene) for place in via),
        tuple(asked.wishes),
        notes=(*text.notes, *(f"took {words!r} as {why}" for words, why in asked.passed.items())),
        unknown=tuple(dict.fromkeys(unknown)),
        names=tuple(scene.names),
        fastest=asked.fastest,
        level=asked.level,
        barred=tuple(asked.barred),
        doubts=(*unsure, *(f"Nothing is done about {quoted([words])}." for words in asked.left)),
    )


def _seen(place: Location, start: Location | None, goal: Location | None, scene: Scene) -> Location:
    """A side on which an object is seen from the way as the side of the object on which the way passes."""
    ends = [p.point or p.objects[0].position for p in (start, goal) if p is not None and (p.point or p.objects)]
    if not place.seen or len(ends) < 2:
        return place
    heading = np.asarray(ends[1], dtype=float) - np.asarray(ends[0], dtype=float)
    right = np.cross(heading, scene.frame.direction("up"))
    away = right if place.relation == "left" else -right
    return replace(place, relation=max(SIDES, key=lambda side: float(scene.frame.direction(side) @ away)))


class _Besides:
    """What a sentence asks for besides its places: heard phrase by phrase.

    Args:
        text: The sentence.
        stops: The places of the way.
        start: Where it starts.
        goal: Where it ends; a distance that is told apart from it is added.
    """

    def __init__(self, text: Text, stops: Sequence[WayStop], start: Location | None, goal: Location | None) -> None:
        self.text, self.stops, self.start, self.goal = text, stops, start, goal
        self.wishes: list[Wish] = []
        self.level: Level | None = None
        self.fastest = False
        self.passed: dict[str, str] = {}  # what asks for nothing, and why
        self.left: list[str] = []  # what nothing is done about
        self.barred: list[str] = []
        self.onward: dict[int, str] = {}  # behind which object a wish counts that begins at a piece

    def hear(self, phrase: WayPhrase, denied: bool) -> None:
        """Take up one phrase, of which the place may be denied."""
        said = phrase.said.strip(" ,;.:")
        if not any(map(str.isalnum, said)) or self._excused(phrase, said, denied):
            return
        if denied:
            self.left += [said] if phrase.role not in {stop.role for stop in self.stops if stop.place} else []
        elif phrase.role == "wait" or phrase.lasting:
            self._take(phrase, self._wait(phrase))
        elif phrase.role == "wish":
            self._wish(phrase)
        elif phrase.role is None and not any(stop.phrase is phrase for stop in self.stops):
            self._aside(phrase, said)

    def _excused(self, phrase: WayPhrase, said: str, denied: bool) -> bool:
        """Whether a phrase says what to leave out, which is noted."""
        if phrase.reasons:
            asks = phrase.why and any(wish.outcome == "do" for wish in _wishes(_behind_verb(phrase), self.text.scene))
            self.left += [said] if asks else []
            self.passed |= {} if asks else {said: "a reason"}
            return True
        besides = phrase.role in (None, "wish", "wait")
        barred = _barred(self.text, phrase) if denied or besides else []
        self.barred += barred
        why = f"not to lead over {listed(map(the, barred))}" if barred else ""
        if phrase.dismisses and not any(stop.phrase is phrase for stop in self.stops):
            why = why or "what is to be left out"
        elif besides and phrase.careful and not denied:
            why = why or ("what the limits see to" if TOUCHING & {*phrase.words} else "what is done anyway")
        self.passed |= {said: why} if why else {}
        return bool(why)

    def _aside(self, phrase: WayPhrase, said: str) -> None:
        """Words without a role: they ask for nothing, or nothing is done about them."""
        words = phrase.words
        told = [k for k, w in enumerate(words) if w.isalpha() and w not in TIES and not carries(words, k)]
        turned = phrase.classes & {"never", "correct"} and phrase.classes & {"over", "under", "front", "back", *TURNING}
        wanted = DEMANDS & {*words} or phrase.shares["wish"] + phrase.shares["wait"] > ASKS
        if phrase.measured or turned or phrase.tells_a_side or (told and wanted):
            self.left.append(said)
        elif len(words) > 2 and told:
            self.passed[said] = "asking for nothing"

    def _wish(self, phrase: WayPhrase) -> None:
        words = {*phrase.words}
        heard = self._heard(phrase)
        frames = [frame for wish in heard for frame in wish.frames]
        varied = any(isinstance(f, Pace) and (f.part != WHOLE or f.change == "slower") for f in frames)
        if HASTE & words and FASTEST & words and not (phrase.amounts or varied):
            self.fastest = True
            return
        if any(map(_open_ended, frames)):
            self._go_on(phrase)
            frames = [frame for frame in frames if not _open_ended(frame)]
            if not frames:
                return
            heard = [_without_going_on(wish) for wish in heard]
        if (place := self.onward.get(phrase.pieces.start)) is not None:
            heard = [_behind(wish, place) for wish in heard]
        if any(isinstance(f, Figure) for f in frames) and (joined := self._joined(phrase)):
            self.left.append(joined)
        level = _level(heard)
        if level is not None and self.level is None:
            self.level = level
        elif self._leads_on(phrase, frames):
            self.passed[phrase.said] = "how the next place is come to"
        elif not self._short_of(phrase, frames):
            self._take(phrase, heard)

    def _joined(self, phrase: WayPhrase) -> str:
        """The words of an object that a figure is told of besides another: "an eight around the cup and the box"."""
        text, stop = self.text, phrase.pieces.stop
        other = text.object_at(stop + 1) if stop + 1 < len(text) and text.words[stop] in ("and", "&", "n") else None
        named = text.object_at(stop - 1) is not None
        if other is None or not named or other[0].unclear:
            return ""
        begin, end = text.pieces[stop].span[0], text.pieces[other[1] - 1].span[1]
        return text.text[begin:end]

    def _go_on(self, phrase: WayPhrase) -> None:
        """Going on leads to the goal behind a stop on the way; else it would move the goal, which was said."""
        if any(other.phrase.span < phrase.span and other.role == "via" for other in self.stops) or self._waits():
            self.passed[phrase.said] = "going on to the goal"
            before = [s for s in self.stops if s.role == "via" and s.place and s.phrase.span < phrase.span]
            told = (k for k in range(phrase.pieces.stop, len(self.text)) if self.text.words[k][0].isalnum())
            if before and before[-1].place and len(before[-1].place.objects) == 1:
                self.onward[next(told, -1)] = before[-1].place.objects[0].name
        else:
            self.left.append(phrase.said)

    def _waits(self) -> bool:
        """Whether a wait was told before."""
        return any(isinstance(frame, Wait) for wish in self.wishes for frame in wish.frames)

    def _take(self, phrase: WayPhrase, heard: Sequence[Wish]) -> None:
        """Keep what was heard; nothing is done about what comes to nothing, unless it says what is carried."""
        carried = phrase.words[0] in CARRIERS and self._leads_to_a_place(phrase)
        for wish in heard:
            if wish.outcome != "decline":
                self.wishes.append(wish)
            elif carried and not (wish.frames or wish.unused or phrase.amounts):
                self.passed[wish.text] = "asking for nothing"  # "take dirty sheets from the door"
            else:
                self.left.append(wish.text)

    def _leads_to_a_place(self, phrase: WayPhrase) -> bool:
        return any(stop.phrase.pieces.start == phrase.pieces.stop and stop.place for stop in self.stops)

    def _heard(self, phrase: WayPhrase) -> list[Wish]:
        """What a wish comes to; one that lacks an object is about the one that was only mentioned before it."""
        said = _bare(self._resolved(phrase))
        heard = _wishes(said, self.text.scene)
        meant = self.text.meant_at(phrase.pieces.start) if [wish.outcome for wish in heard] == ["ask"] else None
        if meant is None or any(same_place(stop.place, meant) for stop in self.stops):
            return heard
        again = _wishes(f"{said} from {the(meant.objects[0].name)}", self.text.scene)
        return heard if any(wish.outcome == "ask" for wish in again) else again

    def _leads_on(self, phrase: WayPhrase, frames: Sequence[SemanticFrame]) -> bool:
        """Whether a shift without a distance only leads to the place behind it: "come down to 30 cm over the cup"."""
        open_ended = [f for f in frames if isinstance(f, Shift) and all(far is None for _, far in f.offset)]
        return bool(frames) and len(open_ended) == len(frames) and self._leads_to_a_place(phrase)

    def _short_of(self, phrase: WayPhrase, frames: Sequence[SemanticFrame]) -> bool:
        """Whether it tells how far from its object the way ends: "stopping short of it by 20 cm"."""
        far = next((amount.value for _, amount in phrase.amounts if amount.unit == "m"), None)
        goal = self.goal
        if far is None or goal is None or goal.distance is not None or len(goal.objects) != 1:
            return False
        at_goal = [f for f in frames if isinstance(f, StopAt) and f.place == goal.objects[0].name]
        if not at_goal or len(at_goal) < len(frames):
            return False
        self.goal = replace(goal, distance=far)
        return True

    def _resolved(self, phrase: WayPhrase) -> str:
        """The words of a phrase, with the object that is meant for "it": "30 cm clearance from it"."""
        text, said = self.text, ""
        for k in phrase.pieces:
            begin, end = text.pieces[k].span
            pointed = text.words[k] == "it" and k > 0 and text.words[k - 1] in POINTING
            meant = self._it(k) if pointed else None
            gap = text.text[text.pieces[k - 1].span[1] : begin] if said else ""
            said += gap + (the(meant.objects[0].name) if meant else text.text[begin:end])
        return said.strip()

    def _it(self, k: int) -> Location | None:
        """The object that is told before with the word that stands before "it", else the one that was named last."""
        relation = PHRASES.get(self.text.words[k - 1])
        before = [stop.place for stop in self.stops if stop.pieces.stop <= k and stop.place and stop.place.objects]
        alike = [place for place in before if place.relation == relation and relation not in ("at", "beside")]
        return alike[-1] if alike else self.text.meant_at(k)

    def _wait(self, phrase: WayPhrase) -> list[Wish]:
        """The waits that a phrase tells, at the places that it names or that was named last before it."""
        duration = next((amount for _, amount in phrase.amounts if amount.unit == "s"), None)
        own = any(stop.place for stop in stops_of(self.text, phrase))
        frames = [frame for frame in understand(phrase.said, self.text.scene).reading.frames if isinstance(frame, Wait)]
        along = not own and any(frame.place == "middle" or isinstance(frame.place, Quantity) for frame in frames)
        spots = [] if duration is None or along else self._waited_at(phrase)
        if duration is None or not spots:  # "wait 2 s half way" is at a share of the way
            return _wishes(phrase.said, self.text.scene)
        return [_waiting(duration, spot) for spot in dict.fromkeys(spots)]

    def _waited_at(self, phrase: WayPhrase) -> list[str]:
        """Where a phrase says to wait: at its place, at the start, at each place, or at the likeliest one."""
        own = next((stop.place for stop in stops_of(self.text, phrase) if stop.place), None)
        if own is None and "every" in phrase.classes:
            return [self._spot(s.place) for s in self.stops if s.role != "start" and s.place and s.place.objects]
        frames = () if own else understand(phrase.said, self.text.scene).reading.frames
        if any(isinstance(frame, Wait) and frame.place == "start" for frame in frames):
            return ["start"]
        places = [place for place in (own, *self._near_by(phrase)) if place and (place.objects or place is self.goal)]
        return [self._spot(place) for place in places[:1]]

    def _near_by(self, phrase: WayPhrase) -> list[Location | None]:
        """The places that a wait may be at, the likeliest first: what follows at once, was told last, or comes next."""
        others = [stop for stop in self.stops if stop.phrase is not phrase]
        before = [stop.place for stop in others if stop.phrase.span < phrase.span and stop.role != "start"]
        behind = [stop for stop in others if stop.phrase.span > phrase.span and stop.role == "via"]
        at_once = [s.place for s in behind if not self.text.text[phrase.span[1] : s.phrase.span[0]].strip()]
        return [*at_once, *before[::-1], *(stop.place for stop in behind), self.goal]

    def _spot(self, place: Location) -> str:
        """A place as a frame names it: an end of the way that is passed once, or its object."""
        once = [same_place(stop.place, place) for stop in self.stops].count(True) == 1
        ends = {"start": self.start, "goal": self.goal} if once or not place.objects else {}
        end = next((name for name, end in ends.items() if same_place(place, end)), "")
        return end or place.objects[0].name

    def weigh_up(self, told: Sequence[WayStop]) -> None:
        """Add what else nothing is done about: amounts and sides of places, and objects."""
        self.left += [stop.left for stop in self.stops if stop.left and not stop.back]
        places = [*(stop.place for stop in told), self.goal]
        named = {item.name for place in places if place is not None for item in place.objects}
        named |= {name for wish in self.wishes for frame in wish.frames for name in frame.named}
        said = " ".join((*self.left, *self.passed)).lower()
        self.left += [item for item in _mentioned(self.text) if item not in named and item.lower() not in said]


def _behind_verb(phrase: WayPhrase) -> str:
    """What stands behind the verb of a reason, in which something may be asked for: "as it is full go slowly"."""
    verb = next((k for k, word in enumerate(phrase.words) if word in FINITE), 0)
    return " ".join(phrase.words[verb + 1 :])


def _open_ended(frame: SemanticFrame) -> bool:
    """Whether it only goes on, neither so far nor to anywhere."""
    return isinstance(frame, Extend) and not (frame.by or frame.offset or frame.place)


def _without_going_on(wish: Wish) -> Wish:
    kept = tuple(frame for frame in wish.frames if not _open_ended(frame))
    return replace(wish, reading=replace(wish.reading, frames=kept))


def _behind(wish: Wish, place: str) -> Wish:
    """A wish whose speed counts behind an object: "wait at the cup, then move on, faster"."""
    part = PathPart("after", places=(place,))
    frames = (replace(f, part=part) if isinstance(f, Pace) and f.part == WHOLE else f for f in wish.frames)
    return replace(wish, reading=replace(wish.reading, frames=tuple(frames)))


def _barred(text: Text, phrase: WayPhrase) -> list[str]:
    """Names of the objects that a phrase says not to lead over: "on no account drive over the pallet"."""
    if not phrase.denies or phrase.amounts:
        return []
    over = [place for place, _ in places_among(text, phrase.pieces) if place.relation == "over" and place.objects]
    return [place.objects[0].name for place in over]


def _mentioned(text: Text) -> list[str]:
    """The objects that a sentence names, each on its own."""
    names, k = list[str](), 0
    while k < len(text):
        found = text.object_at(k)
        if found is not None and not found[0].unclear:
            names += [item.name for item in found[0].objects]
        k = k + 1 if found is None else found[1]
    return list(dict.fromkeys(names))


def _waiting(duration: Amount, where: str) -> Wish:
    frame = Wait(place=where, duration=Quantity(duration.value, "s", "at"))
    return Wish(f"wait {duration.value:g} s at the {where}", "do", Reading(frames=(frame,)))


def _level(heard: Sequence[Wish]) -> Level | None:
    """The height over the ground at which the whole way is to go, if that is all that is asked for."""
    if len(heard) != 1 or heard[0].outcome != "do" or len(heard[0].frames) != 1:
        return None
    (frame,) = heard[0].frames
    if not isinstance(frame, Height) or frame.of or frame.part != WHOLE or frame.level.role not in ("to", "at_least"):
        return None
    return Level(frame.level.value, frame.level.role == "at_least")


def _bare(said: str) -> str:
    """A wish without the words that tie it to what is before."""
    said = said.strip(" ,;.:")
    first, _, rest = said.partition(" ")
    return _bare(rest) if first.lower().strip(",") in TIES and rest else said


def _wishes(said: str, scene: Scene) -> list[Wish]:
    """What a phrase of wishes comes to: as a whole, or part by part where only that is certain."""
    whole = _wish(said, scene)
    texts = map(_bare, said.replace(";", ",").replace(" and ", ", ").split(", "))
    parts = [_wish(part, scene) for part in texts if part]
    sure = [part for part in parts if part.outcome == "do"]
    if 1 < len(parts) == len(sure) and (whole.outcome != "do" or len(whole.frames) < len(parts)):
        return parts
    if whole.outcome == "needs_confirmation" and _say_all(sure, parts, whole):
        return sure  # "a metre from the nest, she sits on six eggs"
    kinds = {type(frame) for frame in whole.frames}
    lost = (part for part in sure if kinds and kinds.isdisjoint(map(type, part.frames)))
    return [whole, *lost]


def _say_all(sure: Sequence[Wish], parts: Sequence[Wish], whole: Wish) -> bool:
    """Whether the parts that are certain say what the whole does, and the others nothing."""
    if not sure or any(part.frames for part in parts if part not in sure):
        return False
    return same(tuple(frame for part in sure for frame in part.frames), whole.frames)


def _wish(said: str, scene: Scene) -> Wish:
    """What a phrase comes to: within a sentence, a word too many that asks for nothing does not put it in doubt."""
    verdict = understand(said, scene)
    upright = all(isinstance(frame, Figure | Smooth | Clearance) for frame in verdict.reading.frames)
    enough = {"both": DO, "rules": PLAIN, "learned": LEARNED if upright else 2.0}[verdict.by]
    plain = verdict.by == "both" or not verdict.unused
    sure = verdict.confidence >= enough and plain and not verdict.doubts
    outcome: Outcome = "do" if sure and verdict.outcome == "needs_confirmation" else verdict.outcome
    return Wish(said, outcome, verdict.reading, verdict.unused, verdict.doubts)


PLAIN = 0.55
"""How likely a phrase of which the rules read every word has to be meant to be done without asking."""

LEARNED = 0.65
"""The same of one that only the network reads, of a kind that cannot be taken the wrong way round, as a bound can."""

ASKS = 0.5
"""How likely words without a role may be a wish and yet be passed over."""
