"""The way that a sentence tells: where it starts, what it passes, where it ends, and what else is wished for.

"From the box to the plate over the bottle, slowly, then a small spiral" has a start, a goal and a via point, and
"slowly" and "a small spiral" are wishes that adapt the planned path. Which words tell what is found by a small network
(see `tagging`), which place they mean by the reader of places, and the wishes are read by the reader of instructions.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest

import numpy as np

from ovita.instruct.frames import (
    Clearance,
    Figure,
    Height,
    Pace,
    Quantity,
    Reading,
    Resample,
    SemanticFrame,
    Smooth,
    StopAt,
    Straighten,
    Trim,
    Wait,
)
from ovita.paths.part import WHOLE
from ovita.paths.scene import Scene
from ovita.sources.asides import Aside, aside, asks_surely, bears, excuse, leads
from ovita.sources.mentions import WayTold, mentioned
from ovita.sources.phrases import WAY, WayPhrase, places_among
from ovita.sources.places import SIDES, Location, Text, way_words
from ovita.sources.rings import Ring, ring_of
from ovita.sources.selfrepair import repaired
from ovita.sources.stops import (
    TURNING,
    WayStop,
    ordered_way,
    read_stops,
    same_place,
)
from ovita.sources.tagging import Role
from ovita.sources.waits import Waits
from ovita.sources.wishes import (
    ONWARD,
    Level,
    Wish,
    bare,
    level_apart,
    level_of,
    on_part,
    open_ended,
    wishes_of,
    without_going_on,
    without_twins,
)
from ovita.text import listed, quoted, the

SURE = 0.6
"""How likely the way has to be, among all that the places might make, to be planned without asking."""

STARTING, FINISHING = map(way_words, ("starting", "finishing"))
FASTEST, HASTE, AGAIN = map(way_words, ("fastest", "haste", "as before"))
APART, EVERYTHING = map(way_words, ("apart", "everything"))
DISTANCE = frozenset(("clearance", "separation", "closer", "nearer", "distance", "standoff", "margin", "gap"))
"""Words that say that an amount is a distance to keep, from all where no object is meant."""


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
        rings: The circles to go in.
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
    rings: tuple[Ring, ...] = ()
    barred: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()

    @property
    def rest(self) -> str:
        """What else it asks for, in words."""
        return ", ".join(wish.text for wish in self.wishes)

    def with_rings(self) -> Route:
        """The route as its rings are planned: they are no wishes, and their objects are none of the way otherwise."""
        figures = [ring.figure for ring in self.rings]
        wishes = (wish.without(figures) for wish in self.wishes)
        kept = tuple(wish for wish in wishes if wish.frames or (wish.outcome != "do" and not wish.lap))
        via = tuple(place for place in self.via if not any(circles(figure, place) for figure in figures))
        return replace(self, wishes=kept, via=via)

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
    text = _without_slips(Text(sentence, scene))
    stops = read_stops(text)
    start, via, goal = ordered_way(stops.placed)
    asked = _Besides(WayTold(text, tuple(stops.placed), start, goal))
    asked.hear(stops.phrases, [stop.phrase for stop in stops.denied])
    asked.weigh_up(stops.told)
    known: dict[Role | None, bool] = {"start": start is not None, "goal": goal is not None}
    unknown = [stop.lacking for stop in stops.placed if stop.lacking and not known.get(stop.role, False)]
    unsure = ("It is not certain what starts, what is passed and what ends the way.",) if stops.sure < SURE else ()
    return Route(
        asked.start,
        asked.goal,
        tuple(_apart(_seen(place, start, asked.goal, scene), asked.wishes) for place in (*via, *asked.via)),
        tuple(without_twins(asked.wishes)),
        notes=(*text.notes, *(f"took {words!r} as {why}" for words, why in asked.passed.items())),
        unknown=tuple(dict.fromkeys(unknown)),
        names=tuple(scene.names),
        fastest=asked.fastest,
        level=asked.level,
        rings=tuple(_kept_off(ring, asked.wishes) for ring in asked.rings),
        barred=tuple(asked.barred),
        doubts=(*unsure, *(f"Nothing is done about {quoted([words])}." for words in asked.left)),
    )


def _without_slips(text: Text) -> Text:
    """A sentence without the sides and amounts that its speaker takes back; places are weighed, see `read_stops`."""
    without = repaired(text.text, text.scene)
    if without == text.text:
        return text
    kept = Text(without, text.scene)
    both = [len(places_among(one, range(len(one)))) for one in (text, kept)]
    return kept if both[0] == both[1] else text


def circles(figure: Figure, place: Location | None) -> bool:
    """Whether a figure leads around the object that a place is at, for which going there stands."""
    at = place is not None and place.relation in ("at", "beside") and place.distance is None
    return at and place is not None and [item.name for item in place.objects] == [figure.place]


def _seen(place: Location, start: Location | None, goal: Location | None, scene: Scene) -> Location:
    """A side on which an object is seen from the way as the side of the object on which the way passes."""
    ends = [p.point or p.objects[0].position for p in (start, goal) if p is not None and (p.point or p.objects)]
    if not place.seen or len(ends) < 2:
        return place
    heading = np.asarray(ends[1], dtype=float) - np.asarray(ends[0], dtype=float)
    right = np.cross(heading, scene.frame.direction("up"))
    away = right if place.relation == "left" else -right
    side = max(SIDES, key=lambda side: float(scene.frame.direction(side) @ away))
    length = float(np.linalg.norm(away))
    if length < 1e-9 or float(scene.frame.direction(side) @ away) > ALONG * length:
        return replace(place, relation=side)
    x, y, z = (away / length).tolist()
    return replace(place, relation=side, away=(x, y, z))


ALONG = 0.98
"""A direction is one of the scene's up to this cosine."""


def _apart(place: Location, wishes: Sequence[Wish]) -> Location:
    """A place beside or over an object as far from it as is to be kept: "left of the cup, 20 cm away from it"."""
    kept = (frame for frame in _frames(wishes) if isinstance(frame, Clearance) and frame.part == WHOLE)
    least = [f.distance.value for f in kept if [*f.objects] == [o.name for o in place.objects]
             and f.distance.role == "at_least" and f.distance.unit == "m"]  # fmt: skip
    if not least or place.distance is not None or place.relation not in (*SIDES, "over"):
        return place
    return replace(place, distance=least[0])


def _kept_off(ring: Ring, wishes: Sequence[Wish]) -> Ring:
    """A ring of no width around an object as far from it as is to be kept: "circle the mast, half a metre from it"."""
    kept = (frame for frame in _frames(wishes) if isinstance(frame, Clearance) and frame.part == WHOLE)
    least = [f.distance.value for f in kept if ring.figure.place in f.objects and f.distance.role == "at_least"]
    return replace(ring, gap=max(least)) if least and ring.radius is None and ring.gap is None else ring


class _Besides:
    """What a sentence asks for besides its places: heard phrase by phrase.

    Args:
        way: That it tells.
    """

    def __init__(self, way: WayTold) -> None:
        self.way, self.waits, self.start, self.goal = way, Waits(way), way.start, way.goal
        self.via: tuple[Location, ...] = ()  # what is passed besides, as the goal turned out to be farther
        self.wishes: list[Wish] = []
        self.level: Level | None = None
        self.rings: list[Ring] = []
        self.fastest = False
        self.passed: dict[str, str] = {}  # what asks for nothing, and why
        self.left: list[str] = []  # what nothing is done about
        self.barred: list[str] = []
        self.placeless: list[WayPhrase] = []  # what was taken for a place, names none, and asks for something
        self.onward: dict[int, str] = {}  # behind which object a wish counts that begins at a piece

    def hear(self, phrases: Sequence[WayPhrase], denied: Collection[WayPhrase]) -> None:
        """Take up all phrases, of which the places of some may be denied."""
        heard: WayPhrase | None = None  # together with the one before
        for phrase, following in zip_longest(phrases, phrases[1:]):
            if phrase is not heard and any(map(str.isalnum, phrase.said)):
                heard = following if self._hear(phrase, following, phrase in denied) else None

    def _hear(self, phrase: WayPhrase, following: WayPhrase | None, denied: bool) -> bool:
        """Take up one phrase; whether the one behind it was heard with it."""
        said, joined = phrase.said.strip(" ,;.:"), False
        excused = excuse(self.way, phrase, denied=denied)
        if excused is not None:
            self._note(said, excused)
        elif denied:
            self.left += [said] if phrase.role not in {stop.role for stop in self.way.stops if stop.place} else []
        elif bare(said).lower() in ONWARD:
            self._go_on(phrase)
        elif phrase.role == "wait" or phrase.lasting:
            heard, joined = self.waits.told(phrase, following)
            self._take(phrase, heard)
        elif phrase.role == "wish" and (asks_surely(self.way, phrase) or not leads(self.way, phrase)):
            self._wish(phrase)
        elif phrase.role is None and not self.way.is_place(phrase):
            told = aside(self.way, phrase)
            self._wish(phrase) if told is None else self._note(said, told)
        elif phrase.role in WAY and not self._tells_a_stop(phrase):
            if asks_surely(self.way, phrase):
                self.placeless.append(phrase)  # "one and a half metres up in between"
                self._wish(phrase)
            elif phrase.classes & {*TURNING, "front", "back"} and not self._lacks(phrase):
                self.left.append(said)  # "one orbit of the mast, left hand"
        return joined

    def _tells_a_stop(self, phrase: WayPhrase) -> bool:
        """Whether a phrase tells a place, or that the way leads back."""
        return any(stop.place or stop.back for stop in self.way.stops if stop.phrase is phrase)

    def _lacks(self, phrase: WayPhrase) -> bool:
        """Whether a phrase tells a place that the scene lacks."""
        return any(stop.lacking for stop in self.way.stops if stop.phrase is phrase)

    def _note(self, said: str, aside: Aside) -> None:
        """Note why words are passed over, or that nothing is done about them."""
        self.barred += aside.barred
        if not aside.why:
            self.left.append(said)
        elif not aside.silent:
            self.passed[said] = aside.why

    def _wish(self, phrase: WayPhrase) -> None:
        """A wish as any instruction, where it is not about planning: a pace, a height, how a place is come to."""
        heard = self._heard(phrase)
        place = self.onward.get(phrase.pieces.start) or self.way.thereafter(phrase, self._circled())
        if place is None and self._asks_for_the_fastest(phrase, heard):
            self.fastest = True
            return
        if self._as_before(phrase, heard):
            self.passed[phrase.said] = "the speed as planned"
            return
        if any(map(open_ended, _frames(heard))):
            self._go_on(phrase)
            heard = list(map(without_going_on, heard))
            if not _frames(heard):
                return
        if place is not None:
            heard = [on_part(wish, "after", place) for wish in heard]
            if any(isinstance(frame, Pace) for frame in _frames(heard)):
                self.wishes = [on_part(wish, "before", place) for wish in self.wishes]
        heard = self._with_places(phrase, heard)
        frames = _frames(heard)
        if any(isinstance(f, Figure) for f in frames) and (joined := self.way.joined(phrase)):
            self.left.append(joined)
        heard = self._without_levels(phrase, heard)
        if frames and not heard:
            return
        if not self._ends_there(phrase, frames):
            self._take(phrase, heard)

    def _without_levels(self, phrase: WayPhrase, heard: Sequence[Wish]) -> list[Wish]:
        """The wishes but for a height of the way, which is planned, or that of a ring, which is planned with it."""
        heard = [part for wish in heard for part in level_apart(wish) if not self._of_an_end(phrase, part)]
        levels = {id(wish): level for wish in heard if (level := level_of([wish])) is not None}
        height = next((level.height for level in levels.values() if not level.beyond), None)
        rings = [ring for w in heard for f in w.frames if (ring := self._ring(phrase, w, f, height)) is not None]
        self.rings += rings
        if not levels or (self.level is not None and not rings):
            return heard
        if not rings:
            self.level = next(iter(levels.values()))
        return [wish for wish in heard if id(wish) not in levels]

    def _with_places(self, phrase: WayPhrase, heard: Sequence[Wish]) -> list[Wish]:
        """The wishes with where a figure is that tells no place: "then" behind all places makes it the goal."""
        first, words = phrase.pieces.start, self.way.text.words
        then = "then" in words[max(first - 2, 0) : first + 2]
        last = then and all(stop.phrase.span < phrase.span for stop in self.way.stops if stop.place)

        def placed(frame: SemanticFrame) -> SemanticFrame:
            if not isinstance(frame, Figure) or frame.place or frame.part != WHOLE or frame.shape in ("zigzag", "wave"):
                return frame
            middle = "middle" if frame.shape == "circle" else ""
            return replace(frame, place="goal" if last else middle)

        return [wish.with_frames(map(placed, wish.frames)) for wish in heard]

    def _of_an_end(self, phrase: WayPhrase, wish: Wish) -> bool:
        """Whether a height is that of an end of the way: "and end in front of the cup at a height of 1.5 m"."""
        told, text = wish.height, self.way.text
        if told is None or told.least:
            return False
        before = [stop for stop in self.way.stops if stop.place and stop.phrase.span < phrase.span]
        if not before:
            return False
        begun = before[-1].phrase
        at_once = "," not in text.words[begun.pieces.stop - 1 : phrase.pieces.start]
        whole = len(before) == len([stop for stop in self.way.stops if stop.place])
        if before[-1].role == "start" and at_once and not STARTING.isdisjoint(begun.words):
            self.start = replace(before[-1].place, height=told.height) if before[-1].place else None
            return True
        then = "then" in text.words[max(phrase.pieces.start - 2, 0) : phrase.pieces.start + 1]
        last = self.goal is not None and before[-1].role == "goal" and whole
        if last and (told.ends or told.sinks or then or (at_once and not FINISHING.isdisjoint(begun.words))):
            self.goal = replace(self.goal, height=told.height) if self.goal else None
            return True
        return False

    def _ring(self, phrase: WayPhrase, wish: Wish, frame: SemanticFrame, height: float | None) -> Ring | None:
        """The ring that a frame is; where something is told before and behind it, it is between these."""
        if not isinstance(frame, Figure):
            return None
        before = [stop for stop in self.way.stops if stop.phrase.span < phrase.span and stop.place]
        behind = [stop for stop in self.way.stops if stop.phrase.span > phrase.span and stop.place]
        passed = [stop for stop in before if stop.role == "via" and not circles(frame, stop.place)]
        first = phrase.pieces.start
        then = bool(before) and "then" in self.way.text.words[max(first - 2, 0) : first + 2]
        ordered = then or (any(s.role == "start" for s in before) and any(s.role in ("via", "goal") for s in behind))
        return ring_of(frame, wish.lap, height, len(passed) if ordered else None)

    def _asks_for_the_fastest(self, phrase: WayPhrase, heard: Sequence[Wish]) -> bool:
        """Whether it is for the highest speed, and neither for an amount nor for the speed of a part."""
        paces = [frame for frame in _frames(heard) if isinstance(frame, Pace)]
        varied = any(f.part != WHOLE or f.change == "slower" or f.amount is not None for f in paces)
        words = {*phrase.words}
        return bool(HASTE & words and FASTEST & words) and not (phrase.amounts or varied)

    def _circled(self) -> str | None:
        """The object that was circled last, or None."""
        return next((name for ring in reversed(self.rings) for name in ring.figure.named), None)

    def _as_before(self, phrase: WayPhrase, heard: Sequence[Wish]) -> bool:
        """Whether it ends a slower part: "slow past the cup, then speed up again"."""
        paces = [frame for frame in _frames(self.wishes) if isinstance(frame, Pace) and frame.part != WHOLE]
        faster = all(isinstance(f, Pace) and f.change == "faster" and f.part == WHOLE for f in _frames(heard))
        return bool(paces) and faster and not (phrase.amounts or AGAIN.isdisjoint(phrase.words))

    def _go_on(self, phrase: WayPhrase) -> None:
        """Going on leads to the goal behind a stop on the way; else it would move the goal, which was said."""
        before, text = self.way.passed_before(phrase), self.way.text
        if not before and not any(isinstance(frame, Wait) for frame in _frames(self.wishes)):
            self.left.append(phrase.said)
            return
        self.passed[phrase.said] = "going on to the goal"
        places = [stop.place for stop in before if stop.place]
        told = (k for k in range(phrase.pieces.stop, len(text)) if text.words[k][0].isalnum())
        if places and len(places[-1].objects) == 1:
            self.onward[next(told, -1)] = places[-1].objects[0].name

    def _take(self, phrase: WayPhrase, heard: Sequence[Wish]) -> None:
        """Keep what was heard; nothing is done about what comes to nothing, unless it says what is carried."""
        for whole in heard:
            wish = self._not_seen_to(phrase, whole)
            if wish is None:
                self.passed[whole.text] = "what is done anyway"
            elif wish.outcome not in ("decline", "ask") or (wish.outcome == "ask" and not self._says_little(phrase)):
                self.wishes.append(wish)
            elif bears(self.way, phrase) and not (wish.frames or wish.unused):
                self.passed[wish.text] = "asking for nothing"
            elif not leads(self.way, phrase):
                self.left.append(wish.text)

    def _says_little(self, phrase: WayPhrase) -> bool:
        """Whether a wish of which nothing is read holds nothing to ask about: "do a round trip"."""
        named = any(self.way.text.object_at(k) is not None for k in phrase.pieces)
        return not (phrase.amounts or named) and len(phrase.words) <= SHORT and len(self.way.stops) > 1

    def _not_seen_to(self, phrase: WayPhrase, wish: Wish) -> Wish | None:
        """A wish without what a plan does anyway, as going straight, and without waypoints left out beside a speed."""
        passing = any(stop.role == "via" for stop in self.way.stops)
        sure = wish.outcome == "do" or "never" in phrase.classes  # "no sudden moves"
        paced = any(isinstance(frame, Pace) for frame in wish.frames)

        def idle(frame: SemanticFrame) -> bool:
            anyway = isinstance(frame, Straighten) or (isinstance(frame, Smooth) and not passing)
            return (anyway and sure and frame.part == WHOLE) or (paced and isinstance(frame, Trim | Resample))

        kept = [frame for frame in wish.frames if not idle(frame)]
        if kept and all(isinstance(frame, Smooth) for frame in kept) and "never" in phrase.classes:
            wish = replace(wish, outcome="do", doubts=())  # "over the tray without any jerks"
        return wish.with_frames(kept) if kept or not wish.frames else None

    def _heard(self, phrase: WayPhrase) -> list[Wish]:
        """What a wish comes to; one that lacks an object is about the one that was only mentioned before it."""
        text = self.way.text
        said = bare(self.way.resolved(phrase))
        if (kept := self._kept_alone(phrase)) is not None:
            return [kept]
        heard = [self._without_ends(wish) for wish in wishes_of(said, text.scene)]
        if any(isinstance(frame, Clearance) and self.way.ends_at(frame.named) for frame in _frames(heard)):
            heard = wishes_of(bare(self.way.resolved(phrase, passed=True, circled=self._circled())), text.scene)
        meant = text.meant_at(phrase.pieces.start) if [wish.outcome for wish in heard] == ["ask"] else None
        if (spot := self._spotted(phrase)) and not all(wish.outcome == "do" for wish in heard):
            return wishes_of(bare(spot), text.scene)
        if meant is None or not self._passed_or_aside(meant):
            return heard
        again = wishes_of(f"{said} from {the(meant.objects[0].name)}", text.scene)
        return heard if any(wish.outcome == "ask" for wish in again) else again

    def _spotted(self, phrase: WayPhrase) -> str:
        """The words of a phrase with the thing that is meant by "there" at its end: "under the lamp, slow there"."""
        meant = self.way.text.meant_at(phrase.pieces.start) if phrase.words[-1] == "there" else None
        return f"{phrase.said[: -len('there')]}near {the(meant.objects[0].name)}" if meant is not None else ""

    def _without_ends(self, wish: Wish) -> Wish:
        """A distance from everything as one from all but where the way begins and ends."""

        def kept(frame: SemanticFrame) -> SemanticFrame:
            if not isinstance(frame, Clearance) or len(frame.objects) < 2:
                return frame
            others = tuple(name for name in frame.objects if not self.way.ends_at([name]))
            return replace(frame, objects=others or frame.objects)

        return wish.with_frames(map(kept, wish.frames))

    def _kept_alone(self, phrase: WayPhrase) -> Wish | None:
        """The distance that is all that a phrase tells, kept from its object, or from what is passed: "50 cm away"."""
        text = self.way.text
        told = [amount for _, amount in phrase.amounts if amount.unit == "m"]
        taken = {k + n for k, amount in phrase.amounts for n in range(amount.used)}
        named = ((k, text.object_at(k)) for k in phrase.pieces)
        own = next(((k, *found) for k, found in named if found is not None), None)
        if own is not None:
            taken |= {*range(own[0] - phrase.pieces.start, own[2] - phrase.pieces.start)}
        meant = text.meant_at(phrase.pieces.start) if own is None else own[1]
        others = [word for k, word in enumerate(phrase.words) if k not in taken and word[0].isalnum()]
        if len(told) != 1 or not (APART | EVERYTHING).issuperset(others):
            return None
        if own is None and not EVERYTHING.isdisjoint(others):
            return self._kept_from_all(phrase, Quantity(told[0].value, "m", "at_least"))
        if not APART.issuperset(others) or (meant is not None and meant.unclear):
            return None
        if meant is None or not self._passed_or_aside(meant):
            circled = self._circled()
            meant = Location(objects=(text.scene[circled],)) if circled else self.way.passed_alone(phrase)
        if meant is None or not self._passed_or_aside(meant):
            far_from_all = own is None and not DISTANCE.isdisjoint(others)
            return self._kept_from_all(phrase, Quantity(told[0].value, "m", "at_least")) if far_from_all else None
        name, far = meant.objects[0].name, Quantity(told[0].value, "m", "at_least")
        said = bare(self.way.resolved(phrase)) if own is not None else f"{bare(phrase.said)} from {the(name)}"
        return Wish(said, "do", Reading(frames=(Clearance(objects=(name,), distance=far),)))

    def _kept_from_all(self, phrase: WayPhrase, far: Quantity) -> Wish | None:
        """A distance from each object that is none of the way: "nothing closer than 30 cm"."""
        ways = {item.name for stop in self.way.stops if stop.place for item in stop.place.objects}
        names = tuple(name for name in self.way.text.scene.names if name not in ways)
        frames = (Clearance(objects=names, distance=far),)
        return Wish(bare(phrase.said), "do", Reading(frames=frames)) if names else None

    def _passed_or_aside(self, place: Location) -> bool:
        """Whether a place is only passed, or mentioned and none of the way."""
        roles = {stop.role for stop in self.way.stops if same_place(stop.place, place)}
        return roles <= {"via"} and not self.way.ends_at([item.name for item in place.objects])

    def _ends_there(self, phrase: WayPhrase, frames: Sequence[SemanticFrame]) -> bool:
        """Whether it tells how far from its object the way ends: "stopping short of it by 20 cm".

        Where the object is none of the way and all else was told before, the way ends there, and not before.
        """
        far = next((amount.value for _, amount in phrase.amounts if amount.unit == "m"), None)
        goal, scene = self.goal, self.way.text.scene
        ends = [str(f.place) for f in frames if isinstance(f, StopAt)]
        if goal is None or len(ends) != 1 or len(frames) != 1 or scene.find(ends[0]) is None:
            return False
        item = scene[ends[0]]
        named = {thing.name for stop in self.way.stops if stop.place for thing in stop.place.objects}
        if goal.objects == (item,) and goal.distance is None:
            self.goal = goal if far is None else replace(goal, distance=far)
        elif item.name not in named and not far and ends:
            self.via = (Location(objects=(item,)),)
        elif item.name not in named and far and all(stop.phrase.span < phrase.span for stop in self.way.stops):
            self.goal, self.via = Location(objects=(item,), distance=far), (goal,)
        else:
            return False
        return True

    def weigh_up(self, told: Sequence[WayStop]) -> None:
        """Add what else nothing is done about: amounts and sides of places, objects, and questions beside wishes."""
        left = (stop for stop in self.way.stops if stop.left and not stop.back)
        self.left += [stop.left for stop in left if stop.phrase not in self.placeless]
        places = [*(stop.place for stop in (*told, *self.way.stops)), *self.via, self.goal]
        named = {item.name for place in places if place is not None for item in place.objects}
        named |= {name for frame in _frames(self.wishes) for name in frame.named}
        said = " ".join((*self.left, *self.passed)).lower()
        self.left += [item for item, words in mentioned(self.way.text) if item not in named and words not in said]
        asking = [wish.text for wish in self.wishes if wish.outcome == "ask" and len(self.wishes) > 1]
        self.left += [text for text in asking if len(text.split()) > MANNER]


def _frames(heard: Sequence[Wish]) -> list[SemanticFrame]:
    return [frame for wish in heard for frame in wish.frames]


SHORT = 5
"""Words of a wish that may be passed over with a doubt, rather than asked about."""

MANNER = 2
"""Words that may only tell how one goes, and whose question is left to the reader of all wishes: "push in"."""
