# ruff: noqa: E501
"""The table of frames: for each what calls for it, what it needs and what it may take, and into which slot."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cache
from typing import Any

from ovita.instruct import frames as F
from ovita.instruct.chunks import Chunk
from ovita.instruct.fillers import (
    CLEAR,
    FREE,
    SLOTTED,
    Constituents,
    Filler,
    amount,
    angle,
    bounded,
    count,
    direction,
    end,
    held_along,
    labelled,
    level,
    objects,
    offset,
    pair,
    parts,
    place,
    place_of_object,
    quadrant,
    sense,
    share,
    speed_amount,
    turns,
    waypoints,
    weight,
)
from ovita.instruct.patterns import QUANTITIES
from ovita.paths.part import WHOLE, PathPart


@dataclass(frozen=True)
class Row:
    """A row of the table.

    Args:
        kind: The frame.
        calls: What calls for it: each entry lists classes ("a|b" for either, "obj:over" for a preposition) that must
            all be there; "!x" must not be.
        slots: Each slot and what fills it.
        fixed: Slots that the row itself fills.
        needs: Slots without which it stands only with those of the clause before it.
        also: Classes that it may take without a slot.
        rank: Ties go to the lower one.
        takes_part: Whether it may be bound to a part of the path.
        check: Sees the frame's slots and settles what hangs together; None drops the reading.
    """

    kind: type[F.SemanticFrame]
    calls: tuple[str, ...]
    slots: Mapping[str, Filler] = field(default_factory=dict)
    fixed: Mapping[str, Any] = field(default_factory=dict)
    needs: tuple[str, ...] = ()
    also: str = ""
    rank: float = 0.0
    takes_part: bool = True
    check: Callable[[dict[str, Any]], dict[str, Any] | None] | None = None


@dataclass(frozen=True)
class Match:
    """A clause read by a row."""

    row: Row
    slots: Mapping[str, Any]
    missing: tuple[str, ...]
    unread: tuple[Chunk, ...]
    cost: float


def _called(call: str, clause: Constituents) -> bool:
    """Take what a call names; whether all of it was there."""
    for word in call.split():
        if word.startswith("!"):
            there = not clause.has(*word[1:].split("|"))
        else:
            there = any(_one_called(alternative, clause) for alternative in word.split("|"))
        if not there:
            return False
    return True


def _one_called(name: str, clause: Constituents) -> bool:
    """Whether a class is there; what fills slots is left for them, other words are taken."""
    kind, colon, value = name.partition(":")
    values = value.split(",")
    test = (lambda c: _value(c) in values) if colon else None
    if kind in SLOTTED:
        return any(c.kind == kind and (test is None or test(c)) for c in clause.items)
    if any(c.kind == kind and c.q is not None for c in clause.items):
        return True
    return clause.take(kind, where=test) is not None


def _value(item: Chunk) -> str:
    """What tells constituents of one class apart: an object's preposition, a quantity's role, an end's."""
    if item.kind == "end":
        return str(item.value[0]) + "/" + str(item.value[1])
    return item.q.role if item.q is not None and item.kind in QUANTITIES else str(item.value or "")


def match(row: Row, items: Sequence[Chunk], kinds: frozenset[str]) -> Match | None:
    """Read a clause by a row, or None if nothing calls for it."""
    for call in row.calls:
        if _possible(call, kinds):
            clause = Constituents(items)
            if _called(call, clause) and (found := _filled(row, clause)) is not None:
                return found
    return None


def _possible(call: str, kinds: frozenset[str]) -> bool:
    return not any(map(kinds.isdisjoint, _needed(call)))


@cache
def _needed(call: str) -> tuple[frozenset[str], ...]:
    """The classes of each word of a call, one of which is to be there; asked for every row and every clause."""
    words = [word for word in call.split() if word[0] != "!"]
    return tuple(frozenset(name.partition(":")[0] for name in word.split("|")) for word in words)


def _filled(row: Row, clause: Constituents) -> Match | None:
    """A row with its slots filled from a clause; None where they do not go together."""
    slots = _slots(row, clause)
    checked = slots if row.check is None else row.check(slots)
    if checked is None:
        return None
    missing = tuple(name for name in row.needs if not checked.get(name))
    unread = tuple(c for c in clause.left() if c.kind not in FREE)
    cost = sum(map(weight, unread)) + MISSING * len(missing) + OF_A_ROW + row.rank
    return Match(row, checked, missing, unread, cost)


def _slots(row: Row, clause: Constituents) -> dict[str, Any]:
    """The slots of a row that a clause fills, and those that the row itself does."""
    slots: dict[str, Any] = dict(row.fixed)
    for name, filler in row.slots.items():
        value = filler(clause)
        if value not in (None, ()) and not slots.get(name):
            slots[name] = value
    if row.takes_part:
        slots["part"] = parts(clause, row.kind in (F.Pace, F.Smooth))
    if (degree := _degree(clause, drawn=slots.get("shape", "shake") != "shake")) is not None:
        slots["degree"] = degree
    clause.every(*row.also.split())
    if not clause.has("Qn", "inc", "dec", "more", "less", "double", "halve"):
        clause.every("waypoints")  # the path by another name
    return slots


def _degree(clause: Constituents, *, drawn: bool) -> str | None:
    """The word of degree that a clause takes; that of a figure that is drawn is its size."""
    found = clause.take("large", "slight")
    if drawn:
        found = clause.take("larger", "smaller")
    return None if found is None else {"larger": "large", "smaller": "slight"}.get(found.kind, found.kind)


MISSING, OF_A_ROW = 4, 0.5
"""What a slot costs that a row needs and does not find, and what any row costs."""


GRADED = (F.Shift, F.MoveEnd, F.Approach, F.Pace, F.Smooth, F.Curve, F.Resize, F.Figure)
"""Frames that words of degree grade."""


def frame_of(match: Match, slots: Mapping[str, Any], items: Sequence[Chunk]) -> F.SemanticFrame | None:
    """The frame of a row with these slots; None where they do not make one."""
    kind = match.row.kind
    known = {slot.name for slot in fields(kind)}
    given = {k: v for k, v in slots.items() if k in known and v is not None and (k, v) != ("place", "")}
    if kind in _ELSEWHERE:
        slot, find = _ELSEWHERE[kind]
        given.setdefault(slot, find(items))
    if kind is F.Pace:
        given |= _in_turns(given)
    if kind not in GRADED and "degree" not in match.row.fixed:
        given.pop("degree", None)
    try:
        made = kind(**given, words=tuple(c.span for c in items))
    except TypeError:
        return None
    return held_along(made, {word for c in items for word in c.text.lower().split()})


def _in_turns(slots: Mapping[str, Any]) -> Mapping[str, Any]:
    """What changes of a pace's slots where it slows down in turns."""
    turns = slots["part"].kind == "turns" and "amount" not in slots and slots["change"] in ("turns", "slower")
    return {"change": "turns", "part": WHOLE} if turns else {}


def _axis(items: Sequence[Chunk]) -> str:
    """The axis along which something is mirrored: left and right, where nothing else is said."""
    return next((axis for item in items if (axis := _axis_of(item))), "left")


def _axis_of(item: Chunk) -> str:
    text = item.text.lower()
    if item.kind == "axis":
        return text if text in ("x", "y", "z") else "left"
    kinds = {*text.split()} if item.kind == "sideways" else {item.kind}
    if kinds & {"front", "back", "fore"}:
        return "front"
    return "up" if kinds & {"up", "down"} else ""


_ELSEWHERE: Mapping[type[F.SemanticFrame], tuple[str, Callable[[Sequence[Chunk]], Any]]] = {
    F.Mirror: ("axis", _axis),
    F.MoveEnd: ("end", lambda items: next((c.value[0] for c in items if c.kind == "end"), None)),
    F.Visit: ("objects", lambda items: tuple(n for c in items if c.kind == "obj" for n in c.names)),
}
"""Slots that are found anywhere in a clause where no filler has filled them."""


# What settles slots that hang together


def _ways(slots: dict[str, Any]) -> dict[str, Any] | None:
    """Opposite ways are two shifts, not one."""
    said = {direction for direction, _ in slots.get("offset", ())}
    return None if any({a, b} <= said for a, b in OPPOSITE_WAYS) else slots


OPPOSITE_WAYS = (("left", "right"), ("front", "back"), ("up", "down"))


def _resize(slots: dict[str, Any]) -> dict[str, Any]:
    """To 80 % is a factor itself."""
    q = slots.get("by")
    if q is None:
        return slots
    return slots | {"change": "" if q.role == "to" else slots.get("change", ""), "by": replace(q, role="by")}


def _pace(slots: dict[str, Any]) -> dict[str, Any]:
    """A factor below one makes it no faster ("0.75 times as fast"); slower to a standstill comes down steadily."""
    q = slots.get("amount")
    if q is None:
        return slots
    if slots["change"] == "slower":
        return slots | {"change": "rampdown"} if (q.role, q.value) == ("to", 0) else slots
    less = slots["change"] == "faster" and q.unit == "x" and q.value < 1
    return slots | {"change": "set", "amount": replace(q, role="to")} if less else slots


def _set_pace(slots: dict[str, Any]) -> dict[str, Any] | None:
    """A bare speed is a target, and so is a share of it; "+20 %" is a change."""
    q = slots.get("amount")
    if q is None:
        return None
    if q.role in ("at_most", "at_least"):
        return slots | {"change": "cap" if q.role == "at_most" else "floor"}
    change, role = ("slower", "by") if (q.unit, q.value) == ("%", 0.5) else ("set", "to")
    return slots | {"change": change, "amount": replace(q, role=role)}


def _lasting(slots: dict[str, Any]) -> dict[str, Any]:
    """How long the way takes, or takes at most."""
    q = slots["amount"]
    change, role = ("cap", "at_most") if q.role == "at_most" else ("set", "to")
    return slots | {"change": change, "amount": replace(q, role=role)}


def _signed_pace(slots: dict[str, Any]) -> dict[str, Any] | None:
    return None if slots.get("amount") is None else slots


def _braking(slots: dict[str, Any]) -> dict[str, Any] | None:
    q = slots.get("amount")
    return None if q is None else slots | {"amount": replace(q, value=-abs(q.value), said="")}


def _resample(slots: dict[str, Any]) -> dict[str, Any]:
    """How many waypoints: a count is a target unless "more" or a sign says by how many."""
    q, change = slots.get("amount"), slots["change"]
    if q is None:
        return slots
    sign = {"+": 1, "-": -1}.get(q.said) or {"more": 1, "fewer": -1}.get(change if q.role != "to" else "")
    if q.said not in ("+", "-") and q.unit in ("%", "x"):
        amount = F.Quantity(round(_of_all(q, change), 6), q.unit if change == "" else "x", "by")
    elif sign:
        amount = F.Quantity(sign * q.value, "waypoints", "by")
    else:
        return slots | {"change": "to", "amount": replace(q, role="to", unit="")}
    return slots | {"change": "by", "amount": amount}


def _of_all(q: F.Quantity, change: str) -> float:
    """The share of all waypoints that "half as many", "30 % more" or "three times fewer" leaves."""
    if change == "fewer" and q.value > 1:
        return 1 / q.value
    grown = {"fewer": 1 - q.value, "more": 1 + q.value} if q.unit == "%" else {}
    return float(grown.get(change, q.value))


def _keep(slots: dict[str, Any]) -> dict[str, Any] | None:
    """A part alone is what stays."""
    if slots.get("what"):
        return slots
    return slots | {"what": "part"} if slots.get("part") else None


def _trim_place(slots: dict[str, Any]) -> dict[str, Any] | None:
    """What comes after or before an object, or the first or last so much."""
    of: PathPart = slots.pop("part", PathPart())
    unit = {"share": "%"}.get(of.unit, of.unit)
    match of:
        case PathPart(kind="first" | "last" as cut, amount=float() | int() as amount) if amount:
            return slots | {"cut": cut, "amount": F.Quantity(amount, unit)}
        case PathPart(kind="after" | "before" as cut, places=(place, *_)):
            return slots | {"cut": cut, "place": place}
        case PathPart(kind="range", amount=float() | int() as amount, until=None):
            return slots | {"cut": "after", "place": F.Quantity(amount + (of.unit == "waypoints"), unit, "at")}
    return None


def _extend(slots: dict[str, Any]) -> dict[str, Any]:
    """Going on to the goal, the start or the middle is going on."""
    return {k: v for k, v in slots.items() if k != "place" or v not in F.SPOTS}


def _or_length(label: str) -> Filler:
    """A quantity that a word beside it names, else a bare length."""
    return lambda clause: labelled(label)(clause) or LENGTH(clause)


# fmt: off
LENGTH = amount("Qm")
AROUND = place("around", "at", "", "by", "over", "near", "on", "of", "in", "with", "to")
RADIUS, SWING = _or_length("radius"), _or_length("size")


def _beside(clause: Constituents) -> F.Offset:
    """How far to which side of an object."""
    over = next((c.value for c in clause.items if c.kind == "obj" and c.value in ("over", "under")), "")
    return (("up" if over == "over" else "down", LENGTH(clause)),) if over else offset(clause)


def _waiting(clause: Constituents) -> F.Place | None:
    """Where to wait; "wait there, then on to the cup" names what comes after it."""
    after = () if clause.has("there", "then_on") else ("to", "on", "with", "for")
    return place("at", "by", "in", "near", "over", "", "around", "touch", "of", "pass", *after)(clause)  # type: ignore[no-any-return]


ROWS: tuple[Row, ...] = (
    # where the path runs
    Row(F.Shift, ("up|down|left|right|front|back|raise|lower|drop|axis_by",),
        {"offset": offset}, needs=("offset",), also="height ground axis inc whole path farther pass", rank=0.2, check=_ways),
    Row(F.Shift, ("keep up|down|left|right|front|back !Qm|height|speed|rest|obj",),
        {"offset": offset}, needs=("offset",), also="inc whole path farther keep size", rank=0.3),
    Row(F.Shift, ("inc|more height|ground !obj", ), {"offset": lambda c: (("up", LENGTH(c)),)}, also="height ground more keep than whole path", rank=0.3),
    Row(F.Shift, ("dec|less height !obj", ), {"offset": lambda c: (("down", LENGTH(c)),)}, also="height than whole path", rank=0.3),
    Row(F.Shift, ("withdraw !obj|pair",), {"offset": lambda c: (("back", LENGTH(c)),)}, also="whole path", rank=0.3),
    Row(F.Shift, ("advance !obj|pair",), {"offset": lambda c: (("front", LENGTH(c)),)}, also="whole path", rank=0.3),
    Row(F.MoveEnd, ("end up|down|left|right|front|back|raise|lower|axis_by",),
        {"end": end(), "offset": offset}, needs=("end", "offset"), also="height path farther", rank=0.1, takes_part=False),
    Row(F.MoveEnd, ("end closer|toward|near", "end obj:toward", "end dec distance", "end farther obj:to,toward"),
        {"end": end(), "place": place_of_object, "by": amount("Qm", "Qpc")}, {"relation": "toward"}, ("end", "place"), "farther closer distance near toward", 0.1, takes_part=False),
    Row(F.MoveEnd, ("end farther|withdraw !obj:to", "end obj:from", "end inc distance"),
        {"end": end(), "place": place_of_object, "by": amount("Qm", "Qpc", "Qx")}, {"relation": "away"}, ("end", "place"), "farther distance inc keep never withdraw", 0.15, takes_part=False),
    Row(F.MoveEnd, ("end obj", ), {"end": end(), "place": place("to", "at", "on", "by", "in", "near", "over", "", "with")},
        {"relation": "to"}, ("end", "place"), "touch on over pass", 0.25, takes_part=False),
    Row(F.MoveEnd, ("end pair", ), {"end": end(), "place": pair}, {"relation": "to"}, ("end", "place"), "touch on pass between", 0.1, takes_part=False),
    Row(F.MoveEnd, ("end Hq", "end height Qm", "endup height Qm", "endup Hq"), {"end": lambda c: end()(c) or (c.has("endup") and "goal") or None, "level": level}, {}, ("end", "level"), "height ground at up endup", 0.1, takes_part=False),
    Row(F.MoveEnd, ("endup pair",), {"place": pair}, {"end": "goal", "relation": "to"}, ("place",), "end", 0.0, takes_part=False),
    Row(F.MoveEnd, ("startat pair",), {"place": pair}, {"end": "start", "relation": "to"}, ("place",), "end", 0.0, takes_part=False),
    Row(F.MoveEnd, ("endup", ), {"place": place()}, {"end": "goal", "relation": "to"}, ("place",), "end near", 0.0, takes_part=False),
    Row(F.MoveEnd, ("startat", ), {"place": place()}, {"end": "start", "relation": "to"}, ("place",), "end near", 0.0, takes_part=False),
    *(Row(F.MoveEnd, (f"{word} Qm|Qn obj:over,under", f"{word} left|right|front|back obj:of"), {"offset": _beside, "place": place_of_object}, {"end": name, "relation": "to"}, ("offset", "place"), "end start goal", 0.0, takes_part=False)
      for word, name in (("endup|goal|end:goal/", "goal"), ("startat|end:start/", "start"))),
    *(Row(F.MoveEnd, (f"{word} Qm up|down|left|right|front|back !obj|wait",), {"offset": offset}, {"end": name}, ("offset",), "farther", 0.05, takes_part=False)
      for word, name in (("endup", "goal"), ("startat", "start"))),
    # objects
    Row(F.Approach, ("closer", "near", "dec|less|smaller|trim|halve|half distance|gap"), {"objects": objects("to", "by", "", "at", "of", "on", "in", "near", "for", "with", "over", "around", "toward", "than", "along", "touch", "from", "pass", "toward"),
        "by": lambda c: amount("Qm", "Qx")(c) or share(c)}, {"sense": "closer"}, ("objects",), "distance gap path pass closer near trim creep toward advance keep touch", 0.25),
    Row(F.Approach, ("obj:toward",), {"objects": objects("toward"), "by": amount("Qm")}, {"sense": "closer"}, ("objects",), "path whole creep toward advance keep", 0.3),
    Row(F.Approach, ("farther|avoid", "inc|more|larger distance|gap", "inc farther", "double|triple distance|farther", "Qx distance|farther", "farther around", "withdraw obj", "keep large obj:from"),
        {"objects": objects(), "by": lambda c: amount("Qm", "Qx")(c) or share(c)}, {"sense": "farther"}, ("objects",), "distance path pass farther avoid times inc keep gap than larger multiply", 0.25),
    Row(F.Approach, ("inc|more Qm:by distance|gap obj", "inc|more Qm:by farther obj", "inc|more Qm:by obj:from"), {"objects": objects(), "by": LENGTH}, {"sense": "farther"}, ("objects", "by"), "inc more distance gap farther keep", -0.1),
    Row(F.Approach, ("large distance|gap !Qm|dec|less|smaller|keep",), {"objects": objects()}, {"sense": "farther", "degree": "large"}, ("objects",), "distance path pass keep gap", 0.25),
    Row(F.Approach, ("distance obj !Qm|dec|less|smaller|keep|constant|halve|half",), {"objects": objects()}, {"sense": "farther"}, ("objects",), "distance", 0.4),
    Row(F.Approach, ("halve|half farther", "farther Qpc:to"), {"objects": objects(), "by": share}, {"sense": "closer"}, ("objects",), "farther keep pass", 0.2),
    Row(F.Approach, ("inc Qm obj !speed",), {"objects": objects(), "by": LENGTH}, {"sense": "farther"}, ("objects",), "inc", 2.0),
    Row(F.Clearance, ("Qm:at_least,at_most obj|within_of", "min|at_least|max|at_most|keep|distance Qm", "keep within_of", "distance Qm", "min|max distance Qn", "keep Qm obj:from", "within_of !speed|faster|slower",
                      "Qm:at_least,at_most distance|farther|near|closer", "Qm:at_least,at_most !left|right|front|back|height|up|ground|axis|over|under"),
        {"distance": bounded("Qm", "within_of", "Qn"), "objects": lambda c: objects()(c) or tuple(n for i in c.items if i.kind == "within_of" for n in i.names)}, {}, ("objects", "distance"), "distance keep farther near closer at_least at_most min max pass whole gap dec inc", 0.2),
    *(Row(F.Clearance, (f"{call} Qm:to", ), {"distance": amount("Qm", role=role), "objects": objects()}, {}, ("objects", "distance"), "inc dec more less larger smaller distance gap farther closer near keep pass", -0.1)
      for role, calls in (("at_least", ("farther", "inc|larger distance|gap")), ("at_most", ("closer", "dec|smaller distance|gap"))) for call in calls),
    Row(F.Clearance, ("clear obj",), {"objects": objects(), "distance": lambda c: bounded("Qm")(c) or CLEAR}, {}, ("objects",), "clear whole path", 0.0, takes_part=False),
    Row(F.Visit, ("skim obj:over,along,by, !never",), {"objects": objects("over", "along", "by", "")}, {"relation": "over", "degree": "slight"}, ("objects",), "skim over pass", 0.0, takes_part=False),
    Row(F.Visit, ("touch obj", "thru obj"), {"objects": objects("", "to", "at", "on", "by", "thru", "with", "in", "touch", "of")}, {}, ("objects",), "touch pass", 0.1, takes_part=False),
    Row(F.Visit, ("obj:thru,touch",), {"objects": objects("thru", "touch", "", "at")}, {}, ("objects",), "touch pass", 0.3, takes_part=False),
    Row(F.Visit, ("pair !only",), {"objects": pair}, {"relation": "between"}, ("objects",), "thru touch pass gap middle around", 0.35, takes_part=False),
    Row(F.Shift, ("raise|lower|drop|up|down Qm:by obj:over !at_least|at_most",), {"offset": offset}, {}, ("offset",), "height path whole", 0.0),
    Row(F.Visit, ("obj:over !slight|large", "over obj !slight|large"), {"objects": objects("over", ""), "by": LENGTH}, {"relation": "over"}, ("objects",), "over up raise pass at_least farther distance gap", 0.1, takes_part=False),
    Row(F.Visit, ("obj:under", "under obj"), {"objects": objects("under", ""), "by": LENGTH}, {"relation": "under"}, ("objects",), "under down lower pass", 0.3, takes_part=False),
    *(Row(F.Avoid, (f"shut:{way}",), {"objects": lambda c: tuple(n for i in c.items if i.kind == "shut" for n in i.names)}, {"relation": way}, ("objects",), "shut pass whole path keep", -0.3, takes_part=False) for way in ("over", "under", "between")),
    Row(F.Side, ("other_side obj !faster|slower|up|down|wait",), {"objects": objects("", "of", "at", "from", "by")}, {"direction": "other"}, ("objects",), "other_side side pass keep around on to path whole", 0.05, takes_part=False),
    Row(F.Side, ("left|right|front|back obj:of,from,on,around,to,by,at !Qm", "left|right|front|back pass|side|around|keep obj", "left|right|front|back obj:pass", "left|right|front|back Qm obj:of"),
        {"objects": objects("", "of", "from", "on", "around", "to", "by", "at", "pass", "with", "touch"), "direction": direction, "by": LENGTH}, {}, ("objects", "direction"), "side pass keep around near touch path whole", 0.15, takes_part=False),
    # speed
    Row(F.Pace, ("faster", "more speed", "inc Qv"), {"amount": speed_amount}, {"change": "faster"}, (), "speed path whole keep pass inc more times faster thru as", 0.1, check=_pace),
    Row(F.Pace, ("inc|raise|up speed",), {"amount": speed_amount}, {"change": "faster"}, (), "speed path whole keep pass inc up raise more times faster thru as", 0.1, check=_pace),
    Row(F.Pace, ("multiply speed Qn|Qx|Qpc",), {"amount": lambda c: (lambda q: q and F.Quantity(q.value, "x", "to"))(c.quantity("Qn", "Qx", "Qpc"))}, {"change": "set"}, ("amount",), "speed", 0.0),
    Row(F.Pace, ("lasting Qs !obj|extend",), {"amount": amount("Qs", role="")}, {}, ("amount",), "lasting path whole endup stop there", 0.0, check=_lasting),
    *(Row(F.Pace, (f"{change} Qdt",), {"amount": amount("Qdt")}, {"change": change}, ("amount",), f"path whole {change}", -0.1) for change in ("faster", "slower")),
    Row(F.Pace, ("slower_time",), {}, {"change": "set", "amount": F.Quantity(0.5, "x", "to")}, (), "speed path whole in endup", 0.1),
    Row(F.Pace, ("faster_time",), {}, {"change": "set", "amount": F.Quantity(2.0, "x", "to")}, (), "speed path whole in endup", 0.1),
    Row(F.Pace, ("slower", "less speed", "brake", "creep", "Qpc|Qv from speed"), {"amount": speed_amount}, {"change": "slower"}, (), "speed path whole keep pass dec times slower brake trim creep thru", 0.1, check=_pace),
    Row(F.Pace, ("dec|lower|drop|down|trim speed",), {"amount": speed_amount}, {"change": "slower"}, (), "speed path whole keep pass dec lower drop down times slower brake trim creep thru", 0.1, check=_pace),
    Row(F.Pace, ("double|triple speed", "speed double|triple"), {"amount": share}, {"change": "faster"}, (), "speed times", 0.1),
    Row(F.Pace, ("speed Qpc:by", "Qv"), {"amount": lambda c: c.quantity("Qpc", "Qv", where=lambda x: x.value == "plus")}, {"change": "faster"}, ("amount",), "speed", 0.05, check=_signed_pace),
    Row(F.Pace, ("speed Qpc|Qv", "Qpc|Qv:by speed", "Qv"), {"amount": lambda c: c.quantity("Qpc", "Qv", where=lambda x: x.value == "minus")}, {"change": "slower"}, ("amount",), "speed", 0.05, check=_signed_pace),
    Row(F.Pace, ("Qv", "speed|vmax|vmin Qv|Qn", "half speed", "halve speed", "speed Qpc|Qx|half|third|quarter", "Qpc|quarter|third|fifth|tenth speed"),
        {"amount": lambda c: amount("Qv", "Qpc", "Qx", role="")(c) or share(c)}, {}, ("amount",), "speed path whole keep max limit at_most at_least min vmax vmin faster slower brake raise lower extend pass multiply resize", 0.3, check=_set_pace),
    Row(F.Pace, ("vmax|limit|max|at_most Qv", "vmax Qn", "speed max|at_most|limit Qv|Qn"), {"amount": amount("Qv", role="at_most")}, {"change": "cap"}, ("amount",), "speed whole path max limit at_most faster vmax up keep dec lower drop down", 0.1),
    Row(F.Pace, ("vmin|min|at_least Qv", "vmin Qn", "speed min|at_least Qv|Qn"), {"amount": amount("Qv", role="at_least")}, {"change": "floor"}, ("amount",), "speed whole path min at_least slower vmin keep inc raise up", 0.1),
    Row(F.Pace, ("constant",), {"amount": amount("Qv", role="to")}, {"change": "constant"}, (), "speed path whole keep pass constant waypoints", 0.2),
    Row(F.Pace, ("ramp_up", "gradual faster", "gradual inc|raise speed", "faster faster", "accel constant|gradual !Qa"), {"amount": amount("Qv", role="to")}, {"change": "rampup"}, (), "speed path whole gradual faster constant ramp_up accel", 0.0),
    Row(F.Pace, ("ramp_down", "gradual slower", "gradual dec|lower speed", "slower|brake constant|gradual"), {"amount": amount("Qv", role="to")}, {"change": "rampdown"}, (), "speed path whole gradual slower constant stop ramp_down brake", 0.0),
    Row(F.Pace, ("inc Qpc|Qx|third|quarter|half|fifth|tenth !speed",), {"amount": speed_amount}, {"change": "faster"}, ("amount",), "up inc raise times", 0.6),
    Row(F.Pace, ("dec Qpc|Qx|third|quarter|half|fifth|tenth !speed",), {"amount": speed_amount}, {"change": "slower"}, ("amount",), "down dec lower times", 0.6),
    Row(F.Pace, ("turns slower", "slower part:turns"), {}, {"change": "turns"}, (), "turns speed path whole slower", -0.2),
    Row(F.Pace, ("accel|brake Qa:minus", "brake Qa", "slower Qa !accel"), {"amount": amount("Qa")}, {"change": "accelerate"}, ("amount",), "accel brake speed constant gradual", -0.1, check=_braking),
    Row(F.Pace, ("accel", "faster|speed|inc Qa", "Qa"), {"amount": amount("Qa")}, {"change": "accelerate"}, ("amount",), "accel speed constant gradual inc faster", 0.0),
    Row(F.Pace, ("accel !Qa",), {"amount": speed_amount}, {"change": "faster"}, (), "speed path whole", 0.3),
    # what stays
    Row(F.Keep, ("keep end",), {"what": end("", "of", "at", "with", "for", "on", "from", "to", "where")}, {}, ("what",), "keep path only where never whole touch", 0.1, takes_part=False),
    Row(F.Keep, ("keep speed", "never speed"), {}, {"what": "speed"}, (), "keep whole speed never", 0.1),
    Row(F.Keep, ("keep height", "never height"), {}, {"what": "height"}, (), "keep whole height never path", 0.1),
    Row(F.Keep, ("keep rest", "keep whole keep"), {}, {"what": "rest"}, (), "keep whole rest never path", 0.1, takes_part=False),
    Row(F.Keep, ("keep path",), {}, {"what": "path"}, (), "keep whole path never", 0.3, takes_part=False),
    Row(F.Keep, ("keep !within_of",), {}, {}, (), "keep whole path never", 0.15, check=_keep),
    # standing still
    Row(F.MoveEnd, ("stop obj:to",), {"place": place("to")}, {"end": "goal", "relation": "to"}, ("place",), "stop end there", 0.1, takes_part=False),
    Row(F.Wait, ("wait short",), {"place": lambda c: next(i.names[0] for i in c.items if i.kind == "short"), "by": lambda c: next(i.number for i in c.items if i.kind == "short"), "duration": amount("Qs", "Qstep")}, {}, (), "short wait for there then_on", -0.2, takes_part=False),
    Row(F.StopAt, ("short",), {"place": lambda c: next(i.names[0] for i in c.items if i.kind == "short"), "by": lambda c: next(i.number for i in c.items if i.kind == "short")}, {}, (), "short stop end there", -0.1, takes_part=False),
    Row(F.StopAt, ("stop there",), {"place": lambda c: place()(c)}, {}, ("place",), "stop there", 0.1, takes_part=False),
    Row(F.StopAt, ("stop !there",), {"place": lambda c: place()(c)}, {}, (), "stop end touch there whole path", 0.2, takes_part=False),
    Row(F.Wait, ("wait", "hover !obj", "stop|keep Qs|Qstep", "obj:at,by,near Qs", "Qs point|end"), {"duration": amount("Qs", "Qstep"), "place": _waiting}, {}, ("place",), "wait hover stop keep duration for there then_on slight", 0.1, takes_part=False),
    Row(F.Hover, ("hover", "wait obj:over", "keep obj:over Qs"), {"duration": amount("Qs", "Qstep"), "by": LENGTH, "objects": objects("over", "", "at", "near", "by", "on")}, {}, ("objects",), "hover wait over up keep raise touch", 0.0, takes_part=False),
    Row(F.Hop, ("hop",), {"by": LENGTH, "objects": objects("over", "", "to", "on", "by")}, {}, ("objects",), "hop over up down raise at_least distance min", 0.0, takes_part=False),
    # ends and waypoints
    Row(F.Extend, ("extend", "inc end:goal/after,goal/over,goal/to Qm"), {"by": LENGTH, "place": place("to", "", "at", "toward", "before", "on")}, {}, (), "extend end path after part whole inc double farther distance smooth touch straight", 0.2, takes_part=False, check=_extend),
    Row(F.Extend, ("extend up|down|left|right|front|back|raise|lower", "end:goal/after up|down|left|right|front|back|raise|lower", "inc end:goal/at up|down|left|right|front|back|raise|lower"), {"offset": offset}, {}, ("offset",), "extend end path after part inc", 0.1, takes_part=False),
    Row(F.Extend, ("end:goal/after obj:to,toward,by,at,near !wait|stop|hover", "end:goal/after pair"), {"place": lambda c: c.take("end") and (pair(c) or place("to", "toward", "by", "at", "near")(c))}, {}, ("place",), "end path straight smooth touch extend", 0.0, takes_part=False),
    Row(F.Extend, ("return obj:to,by,at,near",), {"place": place("to", "by", "at", "near")}, {}, ("place",), "return end path stop straight", -0.1, takes_part=False),
    Row(F.Return, ("return",), {}, {}, (), "return end start path stop reverse", 0.0, takes_part=False),
    Row(F.Reverse, ("reverse",), {}, {}, (), "reverse path whole end back", 0.1, takes_part=False),
    Row(F.Trim, ("trim", "drop part !Qm|by"), {}, {}, (), "trim drop path whole", 0.1, check=_trim_place),
    Row(F.Resample, ("inc|more|denser waypoints", "denser"), {"amount": waypoints}, {"change": "more"}, (), "inc more denser waypoints path whole", 0.1, takes_part=False, check=_resample),
    Row(F.Resample, ("dec|less|sparser waypoints", "sparser", "too waypoints", "halve waypoints"), {"amount": waypoints}, {"change": "fewer"}, (), "dec less sparser waypoints path whole too drop trim", 0.1, takes_part=False, check=_resample),
    Row(F.Resample, ("merge",), {"amount": count}, {"change": "merge"}, ("amount",), "waypoints merge every of", 0.0, takes_part=False),
    Row(F.Resample, ("Qn waypoints", "double|Qx|halve|Qpc|half|third waypoints"), {"amount": waypoints}, {"change": ""}, ("amount",), "waypoints path whole inc at_most keep", 0.3, takes_part=False, check=_resample),
    # form
    Row(F.Smooth, ("smooth !dec|less|inc|more", "smooth turns", "dec|less turns"), {}, {}, (), "smooth path whole turns avoid dec less touch", 0.25),
    Row(F.Straighten, ("straight",), {}, {}, (), "straight path whole curvature turns", 0.25),
    Row(F.OneHeight, ("flat",), {}, {}, (), "flat path whole keep", 0.1),
    Row(F.Curve, ("more_curve", "inc|more|large curvature !too"), {}, {"change": "more"}, (), "curvature more path inc whole", 0.0),
    Row(F.Curve, ("less_curve", "dec|less|too curvature"), {}, {"change": "less"}, (), "curvature less dec too path whole", 0.0),
    Row(F.Resize, ("larger", "inc size", "resize up"), {"by": share, "about": place("around", "of", "at")}, {"change": "larger"}, (), "resize larger path whole size inc times up", 0.3, takes_part=False, check=_resize),
    Row(F.Resize, ("smaller", "dec size", "resize down"), {"by": share, "about": place("around", "of", "at")}, {"change": "smaller"}, (), "resize smaller path whole size dec times down", 0.3, takes_part=False, check=_resize),
    Row(F.Resize, ("resize Qn:by",), {"by": lambda c: (lambda q: q and replace(q, unit="x"))(amount("Qn")(c))}, {}, ("by",), "resize path whole", 0.1, takes_part=False),
    Row(F.Resize, ("resize", "Qx|double size", "Qx|double larger"), {"by": share, "about": place("around", "of", "at")}, {}, ("by",), "resize path whole times size inc larger", 0.2, takes_part=False, check=_resize),
    Row(F.Mirror, ("mirror left|right|front|back|up|down|sideways|axis", "mirror"), {"about": place("around", "of", "at")}, {}, (), "mirror path whole left right front back up down sideways axis", 0.1),
    Row(F.Rotate, ("rotate", "turns Qdeg", "clockwise|anticlockwise Qdeg", "tilt clockwise|anticlockwise"), {"angle": angle, "sense": sense, "about": place("around", "of", "at", "on", "with", "from")}, {}, (), "rotate path whole turns quarter tilt axis", 0.05, takes_part=False),
    Row(F.Tilt, ("tilt",), {"angle": amount("Qdeg"), "direction": direction}, {}, ("direction",), "tilt path whole side up raise higher", 0.0, takes_part=False),
    # figures
    *(Row(F.Figure, calls, {"rise": labelled("rise"), "size": size, "radius": radius, "waves" if shape == "wave" else "turns": turns, "sense": sense, "place": where},
          {"shape": shape}, ("place",) if shape == "circle" else (), f"{shape} path whole laps once around circle pass turns size times", -0.1)
      for shape, calls, size, radius, where in (
        ("circle", ("circle", "once|double|triple|turns|laps|Qx obj:around", "once|double|triple|turns|laps around obj", "turns:by obj !slower|faster"), labelled("size"), RADIUS, AROUND),
        ("spiral", ("spiral",), labelled("size"), RADIUS, AROUND), ("eight", ("eight",), SWING, labelled("radius"), AROUND),
        ("zigzag", ("zigzag",), SWING, labelled("radius"), place_of_object), ("wave", ("wave", "waves"), SWING, labelled("radius"), place_of_object),
        ("shake", ("shake",), SWING, labelled("radius"), AROUND))),
    # bounds
    Row(F.Height, ("Hof !never",), {"of": lambda c: next(i.names[0] for i in c.items if i.kind == "Hof"), "level": lambda c: next(i.q for i in c.items if i.kind == "Hof")}, {}, (), "Hof height keep raise lower up down drop path whole", 0.0),
    Row(F.MoveEnd, ("end Hof", "endup Hof"), {"end": lambda c: end()(c) or (c.has("endup") and "goal") or None, "place": lambda c: next(i.names[0] for i in c.items if i.kind == "Hof")}, {"level": F.Quantity(0.0, "m", "to")}, ("end",), "Hof endup height at up", -0.1, takes_part=False),
    Row(F.Height, ("Hq", "Qm:at_least,at_most height|up|ground|axis", "height Qm:at_least,at_most", "ceiling|floorlimit Qm", "height min|max|limit|at_least|at_most Qm", "up|ground max|min|at_most|at_least Qm"),
        {"level": level}, {}, ("level",), "height ground axis up keep wait whole path limit max min at_most at_least raise lower down touch", 0.2),
    Row(F.Height, ("raise|lower|up|down|drop Qm:to",), {"level": amount("Qm", role="to")}, {}, ("level",), "height ground keep raise lower up down drop path whole", 0.15),
    Row(F.Height, ("height Qm !inc|dec|more|less|limit|max|min", "flat Qm", "Qm ground", "height axis_by", "axis Qm:to"), {"level": amount("Qm", role="to")}, {}, ("level",), "flat height ground axis keep wait up raise over lower", 0.25),
    Row(F.Bound, ("left|right|front|back origin Qm", "bound left|right|front|back Qm", "Qm:at_most left|right|front|back", "within left|right|front|back Qm", "keep left|right|front|back Qm:at_most", "keep within_of left|right|front|back"),
        {"offset": offset, "of": place()}, {}, ("offset",), "origin bound keep at_most max within limit whole", 0.1, takes_part=False),
    Row(F.Quadrant, ("quadrant",), {"number": quadrant}, {}, ("number",), "quadrant keep whole path only third second 1st quarter", -0.1, takes_part=False),
)
# fmt: on
