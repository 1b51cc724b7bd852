"""How language marks the ends of a way: what role a place has by the words before it.

"Pick it up at the mug" and "starting from the mug" begin a way, "come down on the tray" and "set it down on the tray"
end it, "by way of the bowl" passes. A marker is a preposition ("from"), a verb with what belongs to it ("set it
down"), or a noun ("starting point:"); which of these there are is closed-class grammar, so that whole sentences need
not be listed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from ovita.instruct.lexicon import is_filler, stems

Role = Literal["start", "goal", "via"]


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


def _phrases(text: str) -> frozenset[tuple[str, ...]]:
    return frozenset(tuple(phrase.split()) for phrase in text.split(","))


PREPOSITIONS: dict[tuple[str, ...], Role] = {
    **dict.fromkeys(_phrases("from, out of, away from, off of"), "start"),
    **dict.fromkeys(
        _phrases("to, until, till, onto, into, toward, towards, as far as, ->, in to, on to, up until"), "goal"
    ),
    **dict.fromkeys(_phrases("unto, upon, back to, back onto, back at, over to, on towards"), "goal"),
    **dict.fromkeys(_phrases("via, by way of, through, past, by means of"), "via"),
}
"""Prepositions that tell a role by themselves."""

AFTER_VERBS: dict[tuple[str, ...], Role] = {("for",): "goal", ("off",): "start", ("by",): "via"}
"""Prepositions that tell one behind a verb of motion: "head for", "off the shelf", "go by the mast"."""

BOUND_FOR: dict[tuple[str, ...], Role] = {("for",): "goal"}
"""Those behind a verb with a role: "leave for"."""

STARTS = _words(
    """start begin commence depart leave launch originate pick grab fetch collect grasp retrieve embark exit
    initiate init initialise initialize"""
)
GOALS = _words(
    """end finish terminate conclude land arrive reach stop park halt approach deliver drop put place lay stick deposit
    release dock settle unload culminate destine"""
)
VIAS = _words(
    "pass visit cross overfly overflies overflying touch skirt call swing round detour inspect survey scan hit"
)
MOTION = _words(
    """go move travel run drive fly come carry bring take get head proceed continue return transfer transport convey
    guide lead send navigate roll glide slide cruise sweep climb ascend rise descend lower swing make route walk advance
    drift steer shift push pull haul ferry journey ride bind aim trek wander zip hop step pull set reverse retreat back
    zoom traverse trundle nip pop scoot yeet jog trot pilot relay shuttle direct drag
    taxi join duck"""
)
"""Verbs, in their base form, that tell where a way begins, ends or passes, or carry it."""

PARTICLES = _words(
    """up down over across back on along straight directly off away out in right around round together forth forward
    onward onwards upward downward direct all the way then again gently softly"""
)
"""What may stand between a verb and the place: "set down", "all the way to"."""

AROUND, OVER = _words("round around skirt detour"), _words("overfly overflies overflying")
PRONOUNS = _words("it them that this me us him her one everything")
RESTS: Mapping[tuple[str, ...], Role] = {
    **dict.fromkeys(
        _phrases(
            """come to rest, come to a rest, come to a halt, coming to rest, coming to a halt, comes to rest,
        comes to a halt, come to a stop, coming to a stop, touch down, touching down, touches down, come down, coming
        down, knock off, knocking off, set down, setting down, wind up, winding up, end up, ending up, ends up"""
        ),
        "goal",
    ),
    **dict.fromkeys(
        _phrases(
            """take off, taking off, takes off, set off, setting off, sets off, set out, setting out, lift off, kick
            off, pull away, get up, push off, start off, starting off, starts off, start out,
            starting out, starts out, set forth, setting forth, sets forth"""
        ),
        "start",
    ),
    **dict.fromkeys(
        _phrases(
            """call at, calling at, calls at, call in at, calling in at, stop by, stopping by, stops by, drop by,
            dropping by, drop in at, swing by, swinging by, go by, going by, goes by, pass by, passing by, passes by,
            come by, coming by"""
        ),
        "via",
    ),
}
"""Verbs of several words."""

PICKING = _words("take get pull grab pick fetch lift collect grasp")
"""Verbs that begin a way where what is taken is named: "take it at the mug"."""

SETTING = _words("set leave rest hand stack")
"""Verbs that end one where what is put is named: "set it on the tray"."""

START_NOUNS = _words("start origin source src beginning departure pickup base home")
GOAL_NOUNS = _words("goal target destination dest dst end finish arrival endpoint dropoff sink terminus")
VIA_NOUNS = _words("waypoint via stopover checkpoint intermediate")
COMPOUNDS: Mapping[tuple[str, ...], Role] = {
    **dict.fromkeys(_phrases("pick up, starting, initial, take off, first, departure"), "start"),
    **dict.fromkeys(_phrases("drop off, ending, final, end, landing, last"), "goal"),
    **dict.fromkeys(_phrases("via, intermediate, middle"), "via"),
}
"""What makes a noun of a role together with `POINTS`: "drop off point"."""

POINTS = _words("point position place location pose spot station site")
COPULAS = _phrases(
    """is, are, as, being, will be, should be, shall be, must be, would be, is at, should be at, be, was, becomes,
    is on, is above, is by, is over, is the, at, equals, is located at"""
)
DETERMINERS = _words("the a an my your its our their his her this of first final")
"""After these a verb is a noun: "the start", "a stop"."""

STOPPING = _words("stop park halt rest")
"""Verbs that end a way unless a time says that it is a pause."""

STAYING = _words(
    """hover wait stand sit stay rest be is are am locate position park situate currently stop halt hold pause linger
    dwell tarry loiter hang idle"""
)
"""Verbs of being somewhere: where one is before the way, it begins."""

FINAL = _words("end finish terminate conclude land arrive culminate dock settle")
"""Verbs whose place is the last of the way."""

TOURS = _words("visit patrol tour call inspect survey scan stop hit")
"""Verbs of going to several places, the last of which ends the way."""


NO_ROUTE = frozenset(
    """keep keeping keeps stay stays staying clear clearance away distance far off least close closer near nearer gap
    margin clearances distances room berth""".split()
)
"""Words after which "from" and "to" tell a distance."""

COMPARED = frozenset(
    """next close near due according parallel similar relative compared perpendicular equal attention respect regard
    heed thanks""".split()
)
"""Words whose "to" goes nowhere."""

CARRYING = frozenset("carry move bring take transport transfer deliver haul ferry convey put place get fetch".split())
"""Verbs whose object is carried."""

TIMES = frozenset("once twice thrice times time circle circles loop loops lap laps orbit".split())
"""Words that make a figure of "around the lamp"."""

NO_NAMES = frozenset(
    """left right start end goal top bottom front back side way path other same beginning middle ground floor there here
    left-hand right-hand point rest it that this where which what whatever wherever up down above below within time now
    then one home be you me start""".split()
)
"""Nouns that are no objects, and other words that may stand where an object is named."""

FASTEST = frozenset(
    ("as fast as possible", "as fast as you can", "as quickly as possible", "as quickly as you can", "asap", "flat out",
     "at top speed", "at full speed", "at maximum speed", "at max speed", "as fast as it can", "as soon as possible",
     "as fast as allowed", "at full throttle", "as quick as possible", "as quick as you can")
)  # fmt: skip
"""What lets the plan go as fast as the robot."""

BACK = frozenset("back return returning returns home".split())


@dataclass(frozen=True)
class Marker:
    """Words before a place that tell its role.

    Args:
        role: Of the place.
        end: The word behind the marker.
        bare: Whether it is a preposition alone, without a verb or noun of the way.
        led: Whether it is a verb without a preposition, so that a particle may belong to the place: "land on".
        relation: What the marker says of an object besides: "overfly", "swing around".
        stops: Whether a time behind makes a pause of it.
        final: Whether nothing can come after the place.
        tour: Whether it may be one of several, the last of which ends the way.
    """

    role: Role
    end: int
    bare: bool = False
    led: bool = False
    relation: Literal["", "over", "beside"] = ""
    stops: bool = False
    final: bool = False
    tour: bool = False


def base(word: str, of: frozenset[str]) -> str:
    """The base form of a word that is of a set, or ""."""
    return next((form for form in stems(word) if form in of), "")


def marks(word: str) -> bool:
    """Whether a word may be of a marker, so that it is spelt as it is meant."""
    return bool(base(word, STARTS | GOALS | VIAS | MOTION | STAYING)) or word in START_NOUNS | GOAL_NOUNS | VIA_NOUNS


def markers_at(words: Sequence[str], i: int) -> list[Marker]:
    """The markers that begin at word i, the longest first; none behind the last word."""
    if i >= len(words):
        return []
    noun = i > 0 and words[i - 1] in DETERMINERS
    found = [*_nouns(words, i), *_bare(words, i), *(() if noun else _verbs(words, i))]
    return sorted(found, key=lambda marker: (marker.led, -marker.end if not marker.led else marker.end))


def _bare(words: Sequence[str], i: int) -> Iterator[Marker]:
    for at in _tail(words, i):
        for role, end in _prepositions(words, at, PREPOSITIONS):
            yield Marker(role, end, bare=at == i)


def _tail(words: Sequence[str], i: int) -> range:
    """Every word from i on that a preposition may begin at, behind pronouns and particles."""
    end = i + (words[i : i + 1] == [":"])
    while end < min(len(words), i + 5) and (words[end] in PARTICLES or (end == i and words[end] in PRONOUNS)):
        end += 1
    return range(i, end + 1)


def _prepositions(words: Sequence[str], i: int, among: Mapping[tuple[str, ...], Role]) -> Iterator[tuple[Role, int]]:
    for used in (3, 2, 1):
        role = among.get(tuple(words[i : i + used])) if i + used <= len(words) else None
        if role is not None:
            yield role, i + used


def _verbs(words: Sequence[str], i: int) -> Iterator[Marker]:
    """What a verb at word i tells, with or without a preposition behind it."""
    told, end = next(_prepositions(words, i, RESTS), (None, i))
    if told is not None:
        yield from _led(words, end, told, words[end - 1])
        return
    word = words[i]
    role = _role_of(word)
    if role is not None or base(word, MOTION):
        yield from _led(words, i + 1, role, word)
    if words[i + 1 : i + 2] and words[i + 1] in PRONOUNS:
        yield from _handled(words, i, role)


def _handled(words: Sequence[str], i: int, role: Role | None) -> Iterator[Marker]:
    """What a verb tells of what it takes or puts: "grab it at the mug", "leave it on the tray"."""
    word = words[i]
    if role is None and (base(word, PICKING | SETTING | MOTION) or is_filler(word)):
        taken: Role | None = "start" if base(word, PICKING) else "goal" if base(word, SETTING) else None
        yield from _led(words, i + 2, taken, word)
    if base(word, STARTS) == "leave":
        yield from _led(words, i + 2, "goal", word)


def _role_of(word: str) -> Role | None:
    among: tuple[tuple[frozenset[str], Role], ...] = ((STARTS, "start"), (GOALS, "goal"), (VIAS, "via"))
    return next((role for of, role in among if base(word, of)), None)


def _led(words: Sequence[str], i: int, role: Role | None, verb: str) -> Iterator[Marker]:
    """Markers of a verb whose pronouns, particles and prepositions begin at word i."""
    stops, final, tour = (bool(base(verb, of)) for of in (STOPPING, FINAL, TOURS))
    for at in _tail(words, i):
        if role is not None:
            around = role == "via" and bool(AROUND & set(words[i - 1 : at]))
            relation: Literal["", "over", "beside"] = "over" if base(verb, OVER) else "beside" if around else ""
            yield Marker(role, at, led=True, relation=relation, stops=stops, final=final, tour=tour)
        among = PREPOSITIONS | (AFTER_VERBS if role is None or role == "via" else BOUND_FOR)
        for said, end in _prepositions(words, at, among):
            yield Marker("via" if role == "via" and said == "goal" else said, end, final=final)


def _nouns(words: Sequence[str], i: int) -> Iterator[Marker]:
    """Start: X; the drop off point is X; with destination X."""
    for role, end in role_nouns(words, i):
        for used in (3, 2, 1, 0):
            linked = tuple(words[end : end + used])
            if not used or linked in COPULAS or linked == (":",):
                yield Marker(role, end + used)


def role_nouns(words: Sequence[str], i: int) -> Iterator[tuple[Role, int]]:
    """The nouns at word i that name a role, and the word behind each."""
    if i >= len(words):
        return
    for role, end in _prepositions(words, i, COMPOUNDS):
        if words[end : end + 1] and words[end].rstrip("s") in POINTS:
            yield role, end + 1
    among: tuple[tuple[frozenset[str], Role], ...] = (
        (START_NOUNS, "start"),
        (GOAL_NOUNS, "goal"),
        (VIA_NOUNS, "via"),
    )
    for of, role in among:
        if words[i] in of:
            pointed = words[i + 1 : i + 2] and words[i + 1] in POINTS
            yield role, i + 1 + bool(pointed)
