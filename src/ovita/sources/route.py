"""The way that a sentence tells: where it starts, what it passes, where it ends, and the rest of the sentence.

"From the box to the plate over the bottle, slowly, then a small spiral" has a start, a goal, a via point, and "slowly,
then a small spiral" is left for a policy writer. A place gets its role from the words before it (see `markers`), from a
noun behind it ("the plate is the target"), or from its place in a list ("box -> plate -> bottle").
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from ovita.instruct.numbers import amount_at
from ovita.paths.scene import Scene, SceneObject
from ovita.sources.asides import COURTESIES
from ovita.sources.context import WHERE, Context
from ovita.sources.heights import Level, read_level
from ovita.sources.leftover import JOINTS, SEQUENCERS, Leftover
from ovita.sources.markers import (
    BACK,
    CARRYING,
    COPULAS,
    DETERMINERS,
    FASTEST,
    GOALS,
    MOTION,
    PICKING,
    STARTS,
    STAYING,
    TIMES,
    Marker,
    Role,
    base,
    markers_at,
    role_nouns,
)
from ovita.sources.places import PHRASES, Location, Text
from ovita.text import listed


@dataclass(frozen=True, eq=False)
class Route:
    """What a sentence says of the way.

    Args:
        start: Where it starts, or None.
        goal: Where it ends, or None.
        via: What it passes, in order.
        rest: What else it asks for.
        notes: Spellings that were corrected, and what was taken to ask for nothing.
        unknown: Names of things that are not in the scene.
        names: Of the objects that are.
        fastest: Whether it asks for the robot's highest speed.
        level: The height to go at, or None.
        parts: The parts that the rest is a list of.
        circled: Names of the objects that are to be circled.
    """

    start: Location | None = None
    goal: Location | None = None
    via: tuple[Location, ...] = ()
    rest: str = ""
    notes: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    fastest: bool = False
    level: Level | None = None
    parts: tuple[str, ...] = ()
    circled: tuple[str, ...] = ()

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
    """Read the way that a sentence tells, and leave the rest of it."""
    return _RouteReader(Text(sentence, scene)).read()


@dataclass(eq=False)
class _Leg:
    """A part of the way: what is passed, and where it ends."""

    via: list[Location] = field(default_factory=list)
    goal: Location | None = None


@dataclass(frozen=True, eq=False)
class _Stay:
    """A place where something is or waits, which may turn out to be an end of the way."""

    place: Location
    span: tuple[int, int]
    timed: bool


class _RouteReader(Context):
    """Goes through a sentence once and takes the phrases of a way out of it."""

    def __init__(self, text: Text) -> None:
        super().__init__(text)
        self.start: Location | None = None
        self.legs = [_Leg()]
        self.touring = self.fastest = False
        self.stays: list[_Stay] = []
        self.instead: dict[int, str] = {}
        self.level: Level | None = None
        self.unknown: dict[str, Role] = {}
        self.notes = list(text.notes)

    @property
    def takers(self) -> tuple[Callable[[int], int], ...]:
        """What may begin at a piece, in the order in which it is tried."""
        ways = (self.courtesy, self.both, self.back, self.titled, self.leveled, self.hurry, self.grasped, self.bound)
        return (*ways, self.marked, self.stay, self.waited, self.kept, self.around, self.relation, self.onward)

    @property
    def started(self) -> str:
        """The object that the way begins at, or ""."""
        return self.start.objects[0].name if self.start is not None and self.start.objects else ""

    @property
    def ended(self) -> str:
        """The object that the way ends at, and comes to only there, or ""."""
        named = self.goal.objects[0].name if self.goal is not None and self.goal.objects else ""
        return named if [item.name for item in self.objects()].count(named) == 1 else ""

    @property
    def leg(self) -> _Leg:
        return self.legs[-1]

    @property
    def goal(self) -> Location | None:
        return self.leg.goal

    def read(self) -> Route:
        i = 0
        while i < len(self.text):
            i = self.step(i)
        self.completed()
        left = Leftover(self.text, self.taken, self.instead, self.started, self.ended)
        rest = left.spoken_of_all()
        circled = tuple(left.circled())
        passed = [place for leg in self.legs for place in (*leg.via, leg.goal) if place is not None]
        via, goal = (passed[:-1], passed[-1]) if self.goal is not None else (passed, None)
        notes = tuple(dict.fromkeys((*self.notes, *left.notes)))
        unknown = tuple(name for name, role in self.unknown.items() if self.missing(role))
        names = tuple(self.text.scene.names)
        return Route(
            self.start,
            goal,
            tuple(via),
            rest,
            notes,
            unknown,
            names,
            self.fastest,
            self.level,
            tuple(left.parts),
            circled,
        )

    def missing(self, role: Role) -> bool:
        """Whether a place of a role was named but not found."""
        return role == "via" or (self.start if role == "start" else self.goal) is None

    def step(self, i: int) -> int:
        """Take what begins at piece i; the next piece to look at."""
        for take in self.takers:
            end = take(i)
            if end > i:
                return end
        return i + 1

    def courtesy(self, i: int) -> int:
        """Would you be so kind as to; it would be great if."""
        used = self.text.phrase_at(i, COURTESIES)[1]
        self.taken[i : i + used] = [True] * used
        return i + used

    # places with a role

    def both(self, i: int) -> int:
        """The box to the cup; pad -> tower; well, shed, barn."""
        found = self.text.place_at(i) if self.start is None and self.goal is None and self.carried(i) else None
        if found is None or found[0].relation != "at":
            return i
        place, end = found
        follows = [mark for mark in markers_at(self.words, end) if mark.role == "goal" and not mark.led]
        goes = any(self.text.place_at(mark.end) is not None for mark in follows)
        if not goes and len(self.listed(end)) < 2:
            return i
        self.start = place
        end = self.take(i, end)
        for stop, behind in () if goes else self.listed(end):
            self.legs.append(_Leg(goal=stop))
            end = self.take(end, behind)
        return end

    def listed(self, end: int) -> list[tuple[Location, int]]:
        """The places that follow a place as a list: ", the shed and the barn"."""
        found: list[tuple[Location, int]] = []
        while (place := self.next_of_list(end)) is not None:
            found.append(place)
            end = place[1]
        return found

    def next_of_list(self, end: int) -> tuple[Location, int] | None:
        """The place that follows a place as the next of a list, unless it begins a way: ", A to B"."""
        at = end
        while at < len(self.text) and self.words[at] in _LISTING:
            at += 1
        place = self.text.place_at(at) if at > end and self.words[at : at + 1] != ["at"] else None
        if place is None or place[0].relation not in ("at", "beside") or not self.ends_at(place[1]):
            return None
        begins = self.start is None and any(m.bare and m.role == "goal" for m in markers_at(self.words, place[1]))
        return None if begins else place

    def titled(self, i: int) -> int:
        """The plate is the target; with the cup as the start."""
        found = self.text.place_at(i) if self.carried(i) else None
        if found is None:
            return i
        place, end = found
        told = self.told(end)
        if told is not None:
            place, behind = self.text.sided(place, told[1])
            return self.take(i, behind) if self.assign(Marker(told[0], end), place, i) else i
        for used in (3, 2, 1):
            at = end + used
            if tuple(self.words[end:at]) not in (*COPULAS, ("for",), ("for", "the"), ("as", "the"), ("being", "the")):
                continue
            at += self.words[at : at + 1] != [] and self.words[at] in DETERMINERS
            role, behind = next(role_nouns(self.words, at), (None, at))
            if role is not None and (behind >= len(self.text) or self.words[behind] in JOINTS):
                return self.take(i, behind) if self.assign(Marker(role, at), place, i) else i
        return i

    def told(self, end: int) -> tuple[Role, int] | None:
        """What is said of a place behind it: "is where it ends", "shall be passed"; and where that ends."""
        at = end
        while at < min(len(self.text), end + 6) and self.words[at] in _TELLING:
            at += 1
        said = self.words[end:at]
        if at == len(self.text) or not (set(said) & _BEING):
            return None
        verb = self.words[at]
        roles: tuple[tuple[Role, bool], ...] = (
            ("start", "where" in said and bool(base(verb, STARTS | PICKING))),
            ("goal", "where" in said and bool(base(verb, GOALS))),
            ("via", "where" not in said and verb in ("passed", "visited", "crossed", "overflown")),
        )
        return next(((role, at + 1) for role, fits in roles if fits), None)

    def bound(self, i: int) -> int:
        """Leave the shed for the barn."""
        found = self.text.place_at(i + 1) if self.words[i] == "for" and self.edge == i > 0 else None
        if found is None or self.start is None or self.goal is not None:
            return i
        self.leg.goal = found[0]
        return self.take(i, found[1])

    def kept(self, i: int) -> int:
        """Keep left of the hut; stay to the right of it."""
        if self.words[i] not in _KEEPING or self.denied(i):
            return i
        found = self.text.place_at(i + 1)
        sides = ("left", "right", "front", "back")
        if (
            found is None
            or found[0].relation not in sides
            or found[0].distance is not None
            or not self.ends_at(found[1])
        ):
            return i
        if self.goal is not None and self.after_that(i):
            self.legs.append(_Leg())
        self.leg.via.append(found[0])
        return self.take(i, found[1])

    def waited(self, i: int) -> int:
        """At the shed wait 2 s; four seconds on the truck."""
        timed = self.length_of_time(i)
        at = i + timed
        if at >= len(self.text) or self.words[at] not in _THERE or i != self.fragment(i):
            return i
        found = self.text.place_at(at)
        if found is None or (found[1] >= len(self.text) and not timed):
            return i
        place, end = found
        end += self.words[end : end + 1] == ["to"]
        verb = end < len(self.text) and base(self.words[end], STAYING)
        if not timed and not (verb and self.timed(end, end + 1)):
            return i
        self.stays.append(_Stay(replace(place, relation="at"), (i, end), True))
        if timed:
            self.instead[i] = f"wait {self.words[i]}"
        if self.words[end - 1] == "to":
            self.instead[end - 1] = ""
        return end

    def marked(self, i: int) -> int:
        """From the box; ending at the cup; via the plate."""
        marks = [mark for mark in markers_at(self.words, i) if not self.barred(i, mark)]
        for mark in marks:
            found = self.place(mark)
            if found is None or (mark.stops and self.pauses(i, found[1])) or self.turns_around(mark, found[1]):
                continue
            place, end = found
            if mark.relation and place.relation == "at":
                place = replace(place, relation=mark.relation)
            if not mark.bare or mark.role == "via" or not self.turns_away(i):
                if self.assign(mark, place, i):
                    self.take(i, end)
                    return self.several(mark, end)
        self.stranger(marks)
        return i

    def pauses(self, i: int, end: int) -> bool:
        """Whether a stop on the way is meant and not its end."""
        return self.timed(i, end) or (self.goal is not None and not self.after_that(i))

    def several(self, mark: Marker, end: int) -> int:
        """Take the places that follow as a list: "visit the shed, the barn and the well"."""
        self.touring |= mark.tour
        if mark.role == "start":
            return end
        for place, behind in self.listed(end):
            self.touring |= bool(SEQUENCERS & set(self.words[end:behind]))
            if mark.role == "via":
                self.leg.via.append(place)
            else:
                self.legs.append(_Leg(goal=place))
            end = self.take(end, behind)
        return end

    def assign(self, mark: Marker, place: Location, i: int) -> bool:
        """Give a place its role; whether it has one."""
        if mark.role == "start":
            return self.begins(place, i)
        if mark.role == "goal":
            return self.ends(place, mark, i)
        return self.passes(place, i)

    def begins(self, place: Location, i: int) -> bool:
        if self.start is not None and place.relation in ("over", "between"):
            return self.passes(place, i)  # "lift it over the jar"
        if self.start is None or (_alike(place, self.start) and place.relation != self.start.relation):
            self.start = place if self.start is None or place.relation != "at" else self.start
            return True
        if self.goal is not None and _alike(place, self.goal):
            self.edge = i  # "from the box to the cup, from the cup to the plate"
            self.legs.append(_Leg())
            return True
        if self.goal is not None and self.follows(i):
            self.legs += [_Leg(goal=place), _Leg()]
            return True
        return False

    def ends(self, place: Location, mark: Marker, i: int) -> bool:
        if self.goal is None:
            self.leg.goal = place
            return True
        if _alike(place, self.goal) and place.relation != "at":
            self.leg.goal = place
            return True
        if mark.final or self.follows(i):
            self.legs.append(_Leg(goal=place))
            return True
        return False

    def passes(self, place: Location, i: int) -> bool:
        if not self.carried(i):
            return False
        if self.goal is not None and self.after_that(i):
            self.legs.append(_Leg())
        self.leg.via.append(place)
        return True

    def relation(self, i: int) -> int:
        """Over the bottle; between the posts."""
        found = self.text.place_at(i) if self.carried(i) else None
        if found is None or found[0].point is not None or found[0].relation in ("at", "beside", "under"):
            return i
        if self.goal is not None and self.goal.relation == "at" and self.edge == i and _alike(found[0], self.goal):
            self.leg.goal = found[0]  # "finish at the hut half a metre above it"
            return self.take(i, found[1])
        return self.take(i, found[1]) if self.passes(found[0], i) else i

    def around(self, i: int) -> int:
        """Around the lamp, on the way to somewhere."""
        if self.words[i] not in ("around", "round", "by") or not self.carried(i) or self.rounds(i):
            return i
        found = self.text.place_at(i + (self.words[i] != "by"))
        if found is None or found[0].point is not None or (self.goal is not None and self.words[i] != "by"):
            return i
        place, end = found
        fragment = self.words[self.fragment(i) : end + 3]
        if TIMES & set(fragment) or any(amount_at(self.words, k) for k in range(end, min(end + 2, len(self.text)))):
            return i
        place = replace(place, relation="beside") if place.relation == "at" else place
        return self.take(i, end) if self.passes(place, i) else i

    def onward(self, i: int) -> int:
        """Then the desk: a bare place behind a word of order."""
        if not (self.goal or self.leg.via or self.start or self.stays) or not self.after_that(i) or not self.carried(i):
            return i
        found = self.text.place_at(i)
        if found is None or found[0].relation not in ("at", "beside") or not self.ends_at(found[1]):
            return i
        if self.goal is None:
            self.leg.goal = found[0]
        else:
            self.legs.append(_Leg(goal=found[0]))
        return self.take(i, found[1])

    def hurry(self, i: int) -> int:
        """As fast as possible: the plan may go as fast as the robot."""
        used = self.text.phrase_at(i, FASTEST)[1]
        self.fastest |= bool(used)
        if used:
            self.taken[i : i + used] = [True] * used
        return i + used

    def leveled(self, i: int) -> int:
        """At a height of 40 cm; at least one metre above the ground."""
        if i != self.fragment(i) or self.denied(i + 1):
            return i
        end = next((k for k in range(i, len(self.text)) if self.words[k] in JOINTS or self.leads(k)), len(self.text))
        level = read_level(self.words[i:end])
        if level is None:
            return i
        self.level = level
        self.taken[i:end] = [True] * (end - i)
        return end

    def back(self, i: int) -> int:
        """And back; then return home: the start is the goal."""
        end = i
        while end < len(self.text) and (self.words[end] in BACK or (end > i and self.words[end] in _HOMEWARD)):
            end += 1
        if end == i or self.goal is None or self.start is None or not self.carried(i):
            return i
        if end < len(self.text) and self.words[end] not in JOINTS:
            return i
        self.legs.append(_Leg(goal=self.start))
        return self.take(i, end)

    # being somewhere

    def stay(self, i: int) -> int:
        """You are at the cup; hover above the well; wait 2 s at the plate."""
        if not base(self.words[i], STAYING) or self.denied(i):
            return i
        at = self.behind_still(i + 1)
        found = self.text.place_at(at) if self.text.phrase_at(self.measured(at), PHRASES)[1] else None
        if found is None or any(self.text.object_at(k) for k in range(self.fragment(i), i)):
            return i
        place, end = found
        timed = self.timed(i, end)
        if timed:
            self.instead |= self.said_of_wait(i, at, place)
        if self.start is None and self.goal is None and not timed:
            self.start = place
            return self.take(i, end)
        self.stays.append(_Stay(place, (i, end), timed))
        return i

    def behind_still(self, at: int) -> int:
        """Behind what may stand between a verb of staying and its place from piece `at` on."""
        while at < len(self.text) and (self.words[at] in _STILL or self.length_of_time(at)):
            at += self.length_of_time(at) or 1
        return at

    def said_of_wait(self, i: int, at: int, place: Location) -> dict[int, str]:
        """How a wait is said whose verb is piece i: the way passes its place, so that nothing is added to it."""
        instead = {i: "wait"} if base(self.words[i], frozenset({"hang"})) else {}
        if place.relation != "over":
            return instead
        k = self.measured(at)
        return instead | ({k: "at"} if k == at else {i: "wait", **dict.fromkeys(range(at, k), ""), k: "at"})

    def completed(self) -> None:
        """What is known only at the end of the sentence."""
        for stay in self.stays:
            self.settled(stay)
        via = self.leg.via
        if self.goal is None and self.start is None and len(via) == 1 and via[0].relation == "between":
            first, second = via[0].objects
            self.start, self.legs = Location(objects=(first,)), [_Leg(goal=Location(objects=(second,)))]
        if self.touring:
            self.toured()

    def toured(self) -> None:
        """The last of several places to go to is the goal; "hit the shed first, then the barn" names the start too."""
        via = self.leg.via
        if self.goal is None and via:
            self.leg.goal = via.pop()
        if self.start is None and via and "first" in self.words[:5]:
            self.start = via.pop(0)

    def settled(self, stay: _Stay) -> None:
        """A stay is where the way ends, or somewhere that it has to pass."""
        if self.goal is None:
            self.leg.goal = stay.place
            if not stay.timed:
                self.taken[slice(*stay.span)] = [True] * (stay.span[1] - stay.span[0])
            return
        if not any(item in self.objects() for item in stay.place.objects):
            self.leg.via.append(replace(stay.place, distance=None) if stay.timed else stay.place)
        if not stay.timed and self.words[stay.span[0]] not in ("is", "are", "be"):
            self.taken[slice(*stay.span)] = [True] * (stay.span[1] - stay.span[0])
            self.notes.append(f"it comes to {stay.place.label} without a pause, as no time was said")

    def objects(self) -> list[SceneObject]:
        """What the way is told by so far."""
        places = [self.start, *(place for leg in self.legs for place in (*leg.via, leg.goal))]
        return [item for place in places if place is not None for item in place.objects]

    def grasped(self, i: int) -> int:
        """Take what is at the cup; put the part at the cup onto the plate: where the thing is, the way begins."""
        picks = base(self.words[i], PICKING | STARTS)
        if self.start is not None or not (picks or base(self.words[i], MOTION | GOALS)) or self.denied(i):
            return i
        at = i + 1
        while at < min(len(self.text), i + 7) and self.of_a_thing(at):
            at += 1
        found = self.text.place_at(at) if at > i + 1 and self.words[at : at + 1] and self.words[at] in WHERE else None
        if found is None:
            return self.grasped_object(i)
        goes = any(mark.role == "goal" and not mark.led for mark in markers_at(self.words, found[1]))
        if not picks and not goes:
            return i
        self.start = replace(found[0], relation="at") if self.words[at] in ("on", "in") else found[0]
        return self.take(i, found[1])

    def grasped_object(self, i: int) -> int:
        """Take the cup to the plate: the way begins where what is carried is."""
        at = i + 1 + (self.words[i + 1 : i + 2] in (["up"], ["over"]))
        found = self.text.place_at(at) if base(self.words[i], PICKING | CARRYING) else None
        if found is None or found[0].relation != "at" or found[0].point is not None:
            return i
        begins = {mark.role for mark in markers_at(self.words, found[1]) if not mark.led}
        joined = self.words[found[1] : found[1] + 1] in (["and"], [","], ["then"]) and base(self.words[i], PICKING)
        if "goal" in begins or joined:
            self.start = found[0]
        elif "start" not in begins:
            return i
        self.notes.append(f"took {' '.join(self.words[i : found[1]])!r} as what is carried")
        return self.take(i, found[1])

    # what words mean where they stand

    def stranger(self, marks: list[Marker]) -> None:
        """Note what stands where a place should be and is not in the scene."""
        for mark in marks:
            at = mark.end + (self.words[mark.end : mark.end + 1] != [] and self.words[mark.end] in WHERE)
            begin = at
            while at < len(self.text) and self.words[at] in DETERMINERS:
                at += 1
            name = self.noun_at(at)
            certain = at > begin or (mark.bare and mark.role == "start")
            if name and (certain or mark.role == "goal") and not self.text.place_at(mark.end):
                self.unknown.setdefault(name, mark.role)
                return


_LISTING = frozenset("and , then next finally -".split())
_KEEPING = frozenset("keep keeping stay staying remain remaining stick sticking".split())
_THERE = frozenset("at by on over near above".split())
_BEING = frozenset("is are be was shall should must will has".split())
_TELLING = _BEING | frozenset("where it you we one i the robot arm drone he she to then finally".split())
_HOMEWARD = frozenset("again to the start beginning home there where it you we started began came from origin".split())
_STILL = frozenset("now currently directly for there just still initially first located standing".split())


def _alike(one: Location, other: Location) -> bool:
    """Whether two places are told by the same objects."""
    return bool(one.objects) and [o.name for o in one.objects] == [o.name for o in other.objects]
