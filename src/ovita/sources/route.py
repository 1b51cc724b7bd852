"""The way that a sentence tells: where it starts, what it passes, where it ends, and the rest of the sentence.

"From the box to the plate over the bottle, slowly, then a small spiral" has a start, a goal, a via point, and "slowly,
then a small spiral" is left for a policy writer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from ovita.instruct.lexicon import concept_at, is_filler
from ovita.instruct.numbers import amount_at
from ovita.instruct.objects import BEFORE_IT
from ovita.paths.scene import Scene
from ovita.sources.places import Location, Text
from ovita.text import the

GRASPS = frozenset(
    f"{verb}{what}{up}{where}"
    for verb in ("pick", "grab", "take", "fetch", "collect", "get", "lift", "picking", "grabbing")
    for what in ("", " it", " them", " that", " this")
    for up in ("", " up")
    for where in ("", " from", " at")
    if (verb, what, up, where) not in (("take", "", "", ""), ("get", "", "", ""), ("lift", "", "", ""))
)
"""How the thing that is carried gets into the gripper: that is where the way starts."""


def _phrases(text: str) -> frozenset[str]:
    return frozenset(" ".join(phrase.split()) for phrase in text.split(","))


FROM = (
    _phrases(
        """from, starting from, start from, starts from, begin from, beginning from, begins from, coming from, start,
    starts, starting, begin, begins, beginning, commence, commences, commencing, start over, start off, starting
    off, the start is, start is, the beginning is, depart, departs, departing, depart from, departing from, take
    off from, taking off from, takes off from, leave, leaves, leaving, pick it up, pick up, picking it up, picks
    it up, set off from, set out from, setting off from, origin, out of"""
    )
    | GRASPS
)
TO = _phrases(
    """to, until, till, up to, over to, down to, on to, onto, across to, all the way to, end, ends, ending, end up,
    ends up, ending up, finish, finishes, finishing, finish up, terminate, terminates, terminating, conclude,
    concludes, concluding, land, lands, landing, goal, the goal is, goal is, the end is, end is, arrive, arrives,
    arriving, head to, heading to, heads to, proceed to, go to, goes to, direct to, directly to, straight to,
    destination, touch down, ->, then to, finally to, towards, toward"""
)
STOP = _phrases(
    "stop, stops, stopping, park, parks, parking, come to rest, come to a rest, come to a halt, coming to rest, halt"
) | frozenset(
    f"{verb}{what}{off}"
    for verb in ("drop", "put", "place", "set", "lay", "stick", "leave", "deliver", "deposit", "release")
    for what in ("", " it", " them", " that", " this")
    for off in ("", " off", " down")
    if what or verb != "leave"
)
"""As `TO` unless a time follows, which makes a pause of it."""

VIA = _phrases(
    """via, by way of, through, past, visiting, visit, visits, calling, call, passing, pass, passes, passing by, pass
    by, going by, going via, by passing, going past, going through, and through, crossing, touching, by"""
)
BACK = _phrases(
    """and back, and back again, there and back, and return, and then back, and come back, and go back, and back to
    the start, and return to the start, then back, and then return, and back home, and comes back"""
)
JOINTS = frozenset(", ; . : ! ? and then after afterwards but next finally while -".split())
CARRIERS = frozenset(
    """take bring move go goes going run fly flying travel drive carry make draw plan generate create compute produce
    give show send lead guide route path trajectory way movement motion line course it that which this one let
    have want would like could can you i we please be is should must need to with on by at sort kind of swing
    climb climbing climbs head heading proceed continue along so okay ok well right basically obviously think
    thinking was were am maybe perhaps just now then and me us my your the a an new some there know lets let's see
    up over from start starting do does need needs um uh hey hi hello robot drone arm oh also first sweep swinging
    glide slide shift pass passes passing next here
    n""".split()
)
"""Words that carry a route and ask for nothing else."""

LINKS = frozenset("please oh with that which having and so".split())
"""Words that tie what follows to the way before it."""

TAILS = frozenset(("about it", "on the way", "along the way", "on its way", "will you", "would you", "for me"))
"""Phrases at the end of a request that ask for nothing more where there is only one way."""

DENIALS, TOUCHING = (
    frozenset("don't not never without avoid".split()),
    frozenset("hit hitting knock knocking touch touching bump bumping crash crashing collide colliding".split()),
)
"""Words that ask not to touch something, which the limits see to."""

SUBJECTS, STATES = frozenset("the it they he she this that my our".split()), frozenset("is are was were".split())
"""How a remark begins, and its verbs: "the ward is asleep"."""

NO_ROUTE = frozenset(
    """keep keeping keeps stay stays staying clear clearance away distance far off least close closer near nearer gap
    margin clearances distances room berth""".split()
)
"""Words after which "from" and "to" tell a distance."""


@dataclass(frozen=True, eq=False)
class Route:
    """What a sentence says of the way.

    Args:
        start: Where it starts, or None.
        goal: Where it ends, or None.
        via: What it passes, in order.
        rest: What else it asks for.
        notes: Spellings that were corrected, and what was taken to ask for nothing.
    """

    start: Location | None = None
    goal: Location | None = None
    via: tuple[Location, ...] = ()
    rest: str = ""
    notes: tuple[str, ...] = ()

    @property
    def question(self) -> str:
        """What is not known of the way, as a question, or ""."""
        said = (place for place in (self.start, *self.via, self.goal) if place is not None)
        unclear = (place.unclear for place in said if place.unclear)
        return next(unclear, UNKNOWN[self.start is not None, self.goal is not None])


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


class _RouteReader:
    """Goes through a sentence once and takes the phrases of a way out of it."""

    def __init__(self, text: Text) -> None:
        self.text, self.words = text, text.words
        self.taken = [False] * len(text)
        self.route = Route()
        self.notes = list(text.notes)

    def read(self) -> Route:
        i = 0
        while i < len(self.text):
            i = self.step(i)
        rest = self.rest()
        return replace(self.route, rest=rest, notes=tuple(self.notes))

    def step(self, i: int) -> int:
        """Take what begins at piece i; the next piece to look at."""
        for take in (self.both, self.back, self.begin, self.end, self.stop, self.passing, self.relation):
            end = take(i)
            if end > i:
                self.taken[i:end] = [True] * (end - i)
                return end
        return i + 1

    def marked(self, i: int, markers: frozenset[str]) -> tuple[Location, int] | None:
        """The place behind the longest marker at piece i that a place follows, and where it ends."""
        for used in range(self.text.phrase_at(i, markers)[1], 0, -1):
            found = self.text.place_at(i + used) if " ".join(self.words[i : i + used]) in markers else None
            if found is not None:
                return found
        return None

    def both(self, i: int) -> int:
        """The box to the cup; pad -> tower."""
        found = self.text.place_at(i) if self.route.start is None and self.carried(i) else None
        if found is None or found[0].relation != "at":
            return i
        goal = self.marked(found[1], TO)
        if goal is None:
            return i
        self.route = replace(self.route, start=found[0], goal=goal[0])
        return goal[1]

    def back(self, i: int) -> int:
        """And back: what was the goal is passed, and the start is the goal."""
        _, used = self.text.phrase_at(i, BACK)
        route = self.route
        behind = self.words[i + used : i + used + 1]
        if not used or route.goal is None or route.start is None or (behind and behind[0] not in JOINTS):
            return i
        self.route = replace(route, via=(*route.via, route.goal), goal=route.start)
        return i + used

    def begin(self, i: int) -> int:
        if self.route.start is not None or self.tells_distance(i):
            return i
        found = self.marked(i, FROM)
        if found is None:
            return i
        self.route = replace(self.route, start=found[0])
        return found[1]

    def end(self, i: int) -> int:
        if self.tells_distance(i):
            return i
        found = self.marked(i, TO)
        if found is None or (self.route.goal is not None and self.words[i] != "->"):
            return i
        goes_on = (*self.route.via, self.route.goal) if self.route.goal is not None else self.route.via
        self.route = replace(self.route, goal=found[0], via=goes_on)
        return found[1]

    def stop(self, i: int) -> int:
        found = self.marked(i, STOP) if self.route.goal is None else None
        if found is None or self.words[found[1] : found[1] + 1] == ["for"]:
            return i
        self.route = replace(self.route, goal=found[0])
        return found[1]

    def passing(self, i: int) -> int:
        """Via the cup; passing on the right of the bottle."""
        found = self.marked(i, VIA) if self.carried(i) else None
        return self.passed(found, i)

    def relation(self, i: int) -> int:
        """Over the bottle; between the posts."""
        found = self.text.place_at(i) if self.carried(i) else None
        if found is not None and (found[0].point is not None or found[0].relation in ("at", "beside", "under")):
            found = None
        return self.passed(found, i)

    def passed(self, found: tuple[Location, int] | None, i: int) -> int:
        if found is None:
            return i
        self.route = replace(self.route, via=(*self.route.via, found[0]))
        return found[1]

    def carried(self, i: int) -> bool:
        """Whether nothing but carriers stands between piece i and the mark, joint or phrase of the way before it."""
        for k in range(i - 1, -1, -1):
            if self.taken[k] or self.words[k] in JOINTS:
                return True
            if self.words[k] not in CARRIERS and not is_filler(self.words[k]):
                return False
        return True

    def tells_distance(self, i: int) -> bool:
        """Whether a "from" or "to" at piece i is that of "15 cm from the cup" or "clearance to the pillar"."""
        if self.words[i] not in ("from", "to", "by", "at", "off"):
            return False
        begin = next((k + 1 for k in range(i - 1, -1, -1) if self.parted(k)), 0)
        found = [amount_at(self.words, i - n) for n in range(1, min(4, i) + 1)]
        measured = any(a is not None and a.used == n and a.unit for n, a in enumerate(found, start=1))
        return measured or bool(NO_ROUTE & set(self.words[begin:i]))

    def parted(self, k: int) -> bool:
        """Whether what is said before piece k, and with it, has nothing to do with what comes behind."""
        return self.taken[k] or self.words[k] in JOINTS or self.text.object_at(k) is not None

    def rest(self) -> str:
        """What was not taken, without what only carried the way."""
        parts: list[str] = []
        for first, last in self.stretches():
            first, last = self.trimmed(first, last)
            if first < last:
                parts.append(self.spoken(first, last))
        return ", ".join(parts)

    def stretches(self) -> list[tuple[int, int]]:
        """The runs of pieces that were not taken."""
        edges = [0, *(k for k in range(1, len(self.taken)) if self.taken[k] != self.taken[k - 1]), len(self.taken)]
        return [(a, b) for a, b in pairwise(edges) if a < b and not self.taken[a]]

    def trimmed(self, first: int, last: int) -> tuple[int, int]:
        """A stretch without the carriers and marks at its edges."""
        fragments = self.fragments(first, last)
        while fragments and self.idle(*fragments[0]):
            fragments.pop(0)
        while len(fragments) > 1 and self.idle(*fragments[-1]):
            fragments.pop()
        if not fragments:
            return first, first
        begin, end = fragments[0][0], fragments[-1][1]
        if end == last < len(self.taken):  # "generate a trajectory | from the box"
            end = begin + len(_without_last(self.words[begin:end], CARRIERS))
        begin = end - len(_without_last(self.words[begin:end][::-1], LINKS))
        tail = next((n for n in (3, 2) if " ".join(self.words[end - n : end]) in TAILS), 0)
        return begin, max(end - tail, begin)

    def fragments(self, first: int, last: int) -> list[tuple[int, int]]:
        """The runs of words between the joints of a stretch."""
        joints = [first - 1, *(k for k in range(first, last) if self.words[k] in JOINTS), last]
        return [(a + 1, b) for a, b in pairwise(joints) if a + 1 < b]

    def idle(self, first: int, last: int) -> bool:
        """Whether a fragment asks for nothing: it carries the way, is a remark, or says what the limits see to."""
        words = self.words[first:last]
        if all(word in CARRIERS or is_filler(word) for word in words):
            return True
        if any(amount_at(self.words, k) is not None for k in range(first, last)):
            return False
        why = self.needless(words) or self.remarked(first, last)
        if why:
            text, pieces = self.text.text, self.text.pieces
            self.notes.append(f"took {text[pieces[first].span[0] : pieces[last - 1].span[1]]!r} as {why}")
        return bool(why)

    def needless(self, words: Sequence[str]) -> str:
        """Why words that forbid what is never done need not be followed, or ""."""
        denied = next((k for k, word in enumerate(words) if word in DENIALS), len(words))
        touch = next((k for k, word in enumerate(words) if word in TOUCHING), -1)
        return "what the limits see to" if touch > denied else ""

    def remarked(self, first: int, last: int) -> str:
        """What a fragment is that only tells how things are, or ""."""
        words = self.words[first:last]
        states = words[0] in SUBJECTS and bool(STATES & set(words)) and self.tells_nothing(first, last)
        return "a remark, not as something to do" if states or list(words[:2]) == ["never", "mind"] else ""

    def tells_nothing(self, first: int, last: int) -> bool:
        """Whether a fragment names no object and nothing to do."""
        known = [concept_at(self.words, k)[0] for k in range(first, last) if self.words[k] not in STATES]
        objects = [self.text.object_at(k) for k in range(first, last)]
        return not any(known) and not any(objects)

    def spoken(self, first: int, last: int) -> str:
        """A stretch as it was said, with "there" and "around it" as what they mean where that was named before it."""
        meant = self.meant_before(first)
        text, at, out = self.text.text, self.text.pieces[first].span[0], ""
        for k in range(first, last):
            begin, end = self.text.pieces[k].span
            refers = self.words[k] == "there" or (self.words[k] == "it" and self.words[k - 1] in BEFORE_IT)
            if self.text.object_at(k) is not None:
                meant = ""
            if refers and meant:
                out += text[at:begin] + (f"at {the(meant)}" if self.words[k] == "there" else the(meant))
                at = end
        return out + text[at : self.text.pieces[last - 1].span[1]]

    def meant_before(self, first: int) -> str:
        """The object that was named last before a piece, or ""."""
        found = (self.text.object_at(k) for k in range(first - 1, -1, -1))
        last = next((place for place in found if place is not None and not place[0].unclear), None)
        return last[0].objects[-1].name if last is not None else ""


def _without_last(words: Sequence[str], of: frozenset[str]) -> Sequence[str]:
    """Words without those at the end that are of a set."""
    count = len(words)
    while count and words[count - 1] in of:
        count -= 1
    return words[:count]
