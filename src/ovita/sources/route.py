"""The way that a sentence tells: where it starts, what it passes, where it ends, and the rest of the sentence.

"From the box to the plate over the bottle, slowly, then a small spiral" has a start, a goal, a via point, and "slowly,
then a small spiral" is left for a policy writer. A place gets its role from the words before it (see `markers`), from a
noun behind it ("the plate is the target"), or from its place in a list ("box -> plate -> bottle").
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from ovita.instruct.lexicon import concept_at, is_filler
from ovita.instruct.numbers import amount_at
from ovita.instruct.objects import GENERIC
from ovita.paths.scene import Scene, SceneObject
from ovita.sources.heights import Level, read_level
from ovita.sources.leftover import CARRIERS, DENIALS, JOINTS, SEQUENCERS, Leftover
from ovita.sources.markers import (
    BACK,
    CARRYING,
    COMPARED,
    COPULAS,
    DETERMINERS,
    FASTEST,
    GOALS,
    MOTION,
    NO_NAMES,
    NO_ROUTE,
    PICKING,
    STARTS,
    STAYING,
    TIMES,
    TOURS,
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


class _RouteReader:
    """Goes through a sentence once and takes the phrases of a way out of it."""

    def __init__(self, text: Text) -> None:
        self.text, self.words = text, text.words
        self.taken = [False] * len(text)
        self.start: Location | None = None
        self.legs = [_Leg()]
        self.edge = 0  # behind the last place that was taken
        self.touring = self.fastest = False
        self.stays: list[_Stay] = []
        self.instead: dict[int, str] = {}
        self.level: Level | None = None
        self.unknown: dict[str, Role] = {}
        self.notes = list(text.notes)

    @property
    def takers(self) -> tuple[Callable[[int], int], ...]:
        """What may begin at a piece, in the order in which it is tried."""
        ways = (self.both, self.back, self.titled, self.leveled, self.hurry, self.grasped, self.marked, self.stay)
        return (*ways, self.around, self.relation, self.onward)

    @property
    def started(self) -> str:
        """The object that the way begins at, or ""."""
        return self.start.objects[0].name if self.start is not None and self.start.objects else ""

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
        left = Leftover(self.text, self.taken, self.instead, self.started)
        rest = left.spoken_of_all()
        passed = [place for leg in self.legs for place in (*leg.via, leg.goal) if place is not None]
        via, goal = (passed[:-1], passed[-1]) if self.goal is not None else (passed, None)
        notes = tuple(dict.fromkeys((*self.notes, *left.notes)))
        unknown = tuple(name for name, role in self.unknown.items() if self.missing(role))
        names = tuple(self.text.scene.names)
        return Route(
            self.start, goal, tuple(via), rest, notes, unknown, names, self.fastest, self.level, tuple(left.parts)
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

    def take(self, i: int, end: int) -> int:
        """Take the pieces from i up to an end out of the sentence."""
        self.taken[i:end] = [True] * (end - i)
        self.edge = end
        return end

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
        while end < len(self.text):
            at = end
            while at < len(self.text) and self.words[at] in ("and", ",", "then", "next", "finally", "-"):
                at += 1
            place = self.text.place_at(at) if at > end else None
            if place is None or not self.ends_at(place[1]) or place[0].relation not in ("at", "beside"):
                return found
            found.append(place)
            end = place[1]
        return found

    def ends_at(self, end: int) -> bool:
        """Whether a phrase ends at a piece: at a joint, or where another marker begins."""
        return end >= len(self.text) or self.words[end] in JOINTS or bool(markers_at(self.words, end))

    def titled(self, i: int) -> int:
        """The plate is the target; with the cup as the start."""
        found = self.text.place_at(i) if self.carried(i) else None
        if found is None:
            return i
        place, end = found
        for used in (3, 2, 1):
            at = end + used
            if tuple(self.words[end:at]) not in (*COPULAS, ("for",), ("for", "the"), ("as", "the"), ("being", "the")):
                continue
            at += self.words[at : at + 1] != [] and self.words[at] in DETERMINERS
            role, behind = next(role_nouns(self.words, at), (None, at))
            if role is not None and (behind >= len(self.text) or self.words[behind] in JOINTS):
                return self.take(i, behind) if self.assign(Marker(role, at), place, i) else i
        return i

    def marked(self, i: int) -> int:
        """From the box; ending at the cup; via the plate."""
        marks = [mark for mark in markers_at(self.words, i) if not self.barred(i, mark)]
        for mark in marks:
            found = self.place(mark)
            if found is None or (mark.stops and self.pauses(i, found[1])):
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

    def place(self, mark: Marker) -> tuple[Location, int] | None:
        """The place behind a marker; "through the gate" leads between its posts."""
        through = mark.role == "via" and self.words[mark.end - 1] in ("through", "cross", "crossing")
        return (self.text.between(mark.end) if through else None) or self.text.place_at(mark.end)

    def several(self, mark: Marker, end: int) -> int:
        """Take the places that follow as a list: "visit the shed, the barn and the well"."""
        self.touring |= mark.tour
        if mark.role == "start":
            return end
        for place, behind in self.listed(end):
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
        return self.take(i, found[1]) if self.passes(found[0], i) else i

    def around(self, i: int) -> int:
        """Around the lamp, on the way to somewhere."""
        if self.words[i] not in ("around", "round", "by") or not self.carried(i):
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
        if self.goal is None or not self.after_that(i) or not self.carried(i):
            return i
        found = self.text.place_at(i)
        if found is None or found[0].relation not in ("at", "beside") or not self.ends_at(found[1]):
            return i
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

    def leads(self, k: int) -> bool:
        """Whether a preposition of the way begins at piece k, with its place."""
        return any(mark.bare and self.text.place_at(mark.end) is not None for mark in markers_at(self.words, k))

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
        at = i + 1
        while at < len(self.text) and (self.words[at] in _STILL or self.length_of_time(at)):
            at += self.length_of_time(at) or 1
        if self.text.phrase_at(self.measured(at), PHRASES)[1] == 0:
            return i
        found = self.text.place_at(at)
        if found is None or any(self.text.object_at(k) for k in range(self.fragment(i), i)):
            return i
        place, end = found
        timed = self.timed(i, end)
        if timed and place.relation == "over" and place.distance is None:
            self.instead[self.measured(at)] = "at"  # the way passes there, so that nothing has to be added to it
        if self.start is None and self.goal is None and not timed:
            self.start = place
            return self.take(i, end)
        self.stays.append(_Stay(place, (i, end), timed))
        return i

    def measured(self, i: int) -> int:
        """Behind the distance at piece i, if there is one."""
        amount = amount_at(self.words, i) if i < len(self.text) else None
        return i + amount.used if amount is not None and amount.unit == "m" else i

    def length_of_time(self, i: int) -> int:
        """How many words a time at piece i takes."""
        amount = amount_at(self.words, i)
        return amount.used if amount is not None and amount.unit in ("s", "step") else 0

    def timed(self, i: int, end: int) -> bool:
        """Whether a phrase from piece i to an end has a time in it, right behind it or right before it."""
        before = range(max(self.fragment(i), i - 3), i)
        behind = end + (self.words[end : end + 1] == ["for"])
        return self.words[end : end + 1] == ["for"] or any(
            self.length_of_time(k) for k in (*before, *range(i, end), behind) if k < len(self.text)
        )

    def completed(self) -> None:
        """What is known only at the end of the sentence."""
        for stay in self.stays:
            self.settled(stay)
        between = [place for place in self.leg.via if place.relation == "between"]
        if self.goal is None and self.start is None and len(self.leg.via) == len(between) == 1:
            first, second = between[0].objects
            self.start, self.legs = Location(objects=(first,)), [_Leg(goal=Location(objects=(second,)))]
        if self.goal is None and self.touring and self.leg.via:
            self.leg.goal = self.leg.via.pop()

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
        found = self.text.place_at(at) if at > i + 1 and self.words[at : at + 1] and self.words[at] in _WHERE else None
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

    def of_a_thing(self, k: int) -> bool:
        """Whether a word may be of what is carried: "the thing", "what's"."""
        word = self.words[k]
        if word in DETERMINERS:
            return True
        if word in _WHERE or word in JOINTS or (self.text.object_at(k) is not None and word not in GENERIC):
            return False
        return word.replace("'", "").isalpha() and not any(mark.bare for mark in markers_at(self.words, k))

    # what words mean where they stand

    def carried(self, i: int) -> bool:
        """Whether nothing but carriers stands between piece i and the mark, joint or phrase of the way before it."""
        for k in range(i - 1, -1, -1):
            if self.taken[k] or self.words[k] in JOINTS:
                return True
            if (
                self.words[k] not in CARRIERS
                and not is_filler(self.words[k])
                and not base(self.words[k], MOTION | TOURS)
            ):
                return False
        return True

    def fragment(self, i: int) -> int:
        """Where the fragment begins that piece i stands in."""
        return next((k + 1 for k in range(i - 1, -1, -1) if self.taken[k] or self.words[k] in JOINTS), 0)

    def after_that(self, i: int) -> bool:
        """Whether a word of order stands before piece i in its fragment, or joins that to what was before."""
        begin = self.fragment(i)
        while begin > self.edge and self.words[begin - 1] in JOINTS:
            begin -= 1
        return bool(SEQUENCERS & set(self.words[begin:i])) or self.words[begin:i][-2:] == ["from", "there"]

    def follows(self, i: int) -> bool:
        """Whether the way goes on at piece i from where it was said to end."""
        between = self.words[self.edge : i]
        adjacent = all(word in JOINTS or word in CARRIERS for word in between)
        return self.words[i] == "->" or adjacent or self.after_that(i)

    def barred(self, i: int, mark: Marker) -> bool:
        """Whether words that look like a marker are none here."""
        if mark.role == "via" and not self.carried(i):
            return True
        return self.denied(i) if mark.role != "via" else False

    def denied(self, i: int) -> bool:
        return bool(DENIALS & set(self.words[self.fragment(i) : i]))

    def turns_away(self, i: int) -> bool:
        """Whether a "from" or "to" at piece i is that of "15 cm from the cup" or "clearance to the pillar"."""
        if self.words[i - 1 : i] and self.words[i - 1] in COMPARED:
            return True
        begin = next((k + 1 for k in range(i - 1, -1, -1) if self.parted(k)), 0)
        found = [amount_at(self.words, i - n) for n in range(1, min(4, i) + 1)]
        measured = any(a is not None and a.used == n and a.unit == "m" for n, a in enumerate(found, start=1))
        return measured or bool(NO_ROUTE & set(self.words[begin:i]))

    def parted(self, k: int) -> bool:
        """Whether what is said before piece k, and with it, has nothing to do with what comes behind."""
        return self.taken[k] or self.words[k] in JOINTS or self.text.object_at(k) is not None

    def stranger(self, marks: list[Marker]) -> None:
        """Note what stands where a place should be and is not in the scene."""
        for mark in marks:
            at = mark.end + (self.words[mark.end : mark.end + 1] != [] and self.words[mark.end] in _WHERE)
            begin = at
            while at < len(self.text) and self.words[at] in DETERMINERS:
                at += 1
            name = self.noun_at(at)
            certain = at > begin or (mark.bare and mark.role == "start")
            if name and (certain or mark.role == "goal") and not self.text.place_at(mark.end):
                self.unknown.setdefault(name, mark.role)
                return

    def noun_at(self, i: int) -> str:
        """The words from piece i on that name something unknown, or ""."""
        end = i
        while end < len(self.text) and self.unnamed(end):
            end += 1
        return " ".join(self.words[i : min(end, i + 3)])

    def unnamed(self, k: int) -> bool:
        """Whether a word is none that ovita knows."""
        word = self.words[k]
        if not word.isalpha() or word in NO_NAMES or word in JOINTS or word in CARRIERS or is_filler(word):
            return False
        known = concept_at(self.words, k)[0] or amount_at(self.words, k) or self.text.object_at(k)
        return not known and not markers_at(self.words, k)


_WHERE = frozenset("at in by near beside on inside within".split())
_HOMEWARD = frozenset("again to the start beginning home there where it you we started began came from origin".split())
_STILL = frozenset("now currently directly for there just still initially first located standing".split())


def _alike(one: Location, other: Location) -> bool:
    """Whether two places are told by the same objects."""
    return bool(one.objects) and [o.name for o in one.objects] == [o.name for o in other.objects]
