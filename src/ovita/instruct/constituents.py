# ruff: noqa: E501
"""From chunks to constituents: quantities with their roles, objects with their prepositions, parts of the path, ends.

One table of patterns over the chunks' classes, applied in order. A pattern is a row of classes ("a|b" for either, "?",
"*" and "+" as in regular expressions); what it matches becomes one chunk.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, cast

from ovita.instruct.bare_numbers import with_units
from ovita.instruct.chunks import COUNTED, Build, Chunk, merged, numbers
from ovita.instruct.comparisons import COMPARED
from ovita.instruct.frames import Quantity, Role
from ovita.paths.part import PathPart, outside

GROUPS = {
    "LENGTH": "Qm", "ANYQ": "Qm|Qv|Qa|Qs|Qdeg|Qpc|Qx|Qstep|Qn", "SHARE": "Qpc|half|third|quarter|tenth|fifth",
    "SPAN": "Qm|Qs|Qpc|Qstep|half|third|quarter|tenth|fifth", "AT": "at|by|on|in|near|around|over|within|along",
    "HIGHER": "up|raise|over|height", "LOWER": "down|lower|under", "FIRST": "first|1st", "LAST": "last|nth", "END": "start|goal|ends", "LINK": "to|thru|before",
    "DIR": "left|right|front|back|up|down", "BEFORE_OBJ": "at|by|on|in|near|around|over|within|along|to|toward|from|of|off|than|under|thru|with|for",
    "FLIPS": "touch|avoid|left|right|front|back|up|down|closer|near|farther|faster|slower|larger|smaller|raise|lower|wait|"
             "more_curve|less_curve|inc|dec",
}  # fmt: skip
FLIPPED = {
    "touch": "farther", "avoid": "touch", "left": "right", "front": "back", "up": "down", "closer": "farther", "near": "farther", "faster": "slower", "larger": "smaller",
    "raise": "lower", "more_curve": "less_curve", "inc": "dec",
}  # fmt: skip
FLIPPED |= {b: a for a, b in FLIPPED.items() if a not in ("near", "touch", "avoid")}
FRACTION = {"half": 0.5, "third": 1 / 3, "quarter": 0.25, "tenth": 0.1, "fifth": 0.2}
QUANTITIES = frozenset("Qm Qv Qa Qs Qdeg Qpc Qx Qstep Qn".split())


def part(found: Sequence[Chunk], of: PathPart) -> Chunk:
    """A chunk for a part of the path."""
    return merged(found, "part", value=of)


def _fraction(found: Sequence[Chunk]) -> Chunk:
    """A third; two thirds."""
    times = found[0].q.value if found[0].q is not None else 1.0
    share = FRACTION[found[-1].kind] * times
    return merged(found, "Qpc", q=Quantity(round(share, 2) if share not in (0.125,) else share, "%", "by", ""))


def _share_of(found: Chunk) -> Quantity:
    return found.q or Quantity(round(FRACTION[found.kind], 2), "%")


def _and_a_half(found: Sequence[Chunk]) -> Chunk | None:
    """An inch and a half."""
    one = found[0].text.lower().split()[0] in ("a", "an", "one")
    q = found[0].q or Quantity(0.0)
    return merged(found, found[0].kind, q=Quantity(q.value * 1.5, q.unit)) if one else None


def _many_thirds(found: Sequence[Chunk]) -> Chunk | None:
    return _fraction(found) if found[-1].text.lower().endswith("s") or found[0].text.isalpha() else None


def _range_of_points(found: Sequence[Chunk]) -> Chunk:
    a, b = (q.value for q in numbers(found)[:2])
    return part(found, PathPart("range", amount=a - 1, until=b - 1))


def _spread(found: Sequence[Chunk]) -> Chunk:
    """10 to 15 cm: what lies between."""
    a, b = numbers(found)
    figures = re.match(r"\d+(?:[./]\d+)?", b.said)
    low = a.value * b.value / float(Fraction(figures[0])) if figures and not a.unit else a.value
    kind = found[-1].kind
    return merged(found, kind, q=Quantity((low + b.value) / 2, b.unit))


def _point(found: Sequence[Chunk]) -> Chunk:
    q = numbers(found)[0]
    return merged(found, "point", value=Quantity(q.value, "waypoints", "at"))


def _along(kind: str) -> Build:
    """After or before a waypoint, a share, a length or a time."""

    def build(found: Sequence[Chunk]) -> Chunk:
        target = next(c for c in reversed(found) if c.kind in (*QUANTITIES, *FRACTION, "point"))
        if target.kind == "point":
            value, unit = target.value.value - 1, cast(Any, "waypoints")
        elif target.kind in FRACTION:
            value, unit = FRACTION[target.kind], "share"
        else:
            q = target.q or Quantity(0.0)
            value, unit = q.value, {"%": "share", "m": "m", "s": "s"}.get(q.unit, "waypoints")
        if kind == "after":
            return part(found, PathPart("range", amount=value, unit=unit))
        return part(found, PathPart("range", amount=0.0, until=value, unit=unit))

    return build


def _share(kind: str, amount: float) -> Build:
    return lambda found: part(found, PathPart(kind, amount=amount, unit="share"))


def _amount(kind: str) -> Build:
    """The first 10 waypoints, the last third, the final 30 cm."""

    def build(found: Sequence[Chunk]) -> Chunk:
        fraction = next((c for c in found if c.kind in FRACTION), None)
        if fraction is not None:
            share = _fraction([c for c in found if c.kind == "Qn"] + [fraction]).q
            return part(found, PathPart(kind, amount=share.value if share else 0.5, unit="share"))
        q = numbers(found)[0]
        unit: Any = {"%": "share", "m": "m", "s": "s"}.get(q.unit, "share" if q.value < 1 else "waypoints")
        return part(found, PathPart(kind, amount=q.value, unit=unit))

    return build


def _every(found: Sequence[Chunk]) -> Chunk | None:
    inner = found[1]
    k = inner.q.value if inner.q is not None else COUNTED.get(inner.text.lower().split()[-1])
    return None if k is None else part(found, PathPart("every", amount=float(k)))


def _plain(kind: str, **more: Any) -> Build:
    return lambda found: part(found, PathPart(kind, **more))


def _object(found: Sequence[Chunk]) -> Chunk:
    """An object with its preposition, which is the last one before it."""
    said = [c.kind for c in found if c.kind != "OBJ"]
    preposition = (
        "near" if "near" in said else next((kind for kind in reversed(said) if kind != "of"), "of" if said else "")
    )
    return merged([c for c in found if c.kind == "OBJ"], "obj", value=preposition)


def _end(found: Sequence[Chunk]) -> Chunk:
    """An end of the path with its preposition."""
    end = found[-1]
    preposition = found[0].kind if len(found) > 1 else ""
    return merged(found, "end", value=(end.kind, preposition))


def _objects(found: Sequence[Chunk]) -> Chunk:
    return merged([c for c in found if c.kind == "OBJ"], "OBJ")


def _between(found: Sequence[Chunk]) -> Chunk | None:
    names = tuple(dict.fromkeys(n for c in found for n in c.names))
    return merged(found, "pair", names=names[:2]) if len(names) == 2 else None


def _to_or_from_end(found: Sequence[Chunk]) -> Chunk | None:
    """From the start to the cup; from the cup to the goal."""
    name = next(c for c in found if c.kind == "OBJ").names[0]
    end = next(c.kind for c in found if c.kind in ("start", "goal"))
    return part(found, PathPart("before" if end == "start" else "after", (name,)))


def _side_of_object(kind: str) -> Build:
    return lambda found: part(found, PathPart(kind, (next(c for c in reversed(found) if c.kind == "OBJ").names[0],)))


def _for_the(found: Sequence[Chunk]) -> Chunk | None:
    """For the last half: where, not why."""
    return merged(found, "for") if found[0].text.lower() == "for the" else None


def _within(found: Sequence[Chunk]) -> Chunk:
    q = numbers(found)[0]
    return merged(found, "within_of", q=q if q.role == "at_least" else replace(q, role="at_most"))


def _higher_there(found: Sequence[Chunk]) -> list[Chunk] | None:
    """Higher over the cup: to be higher where it passes the cup; "up over the cup" is a way over it."""
    change = next(c for c in found if c.kind not in ("over", "OBJ"))
    thing = next(c for c in found if c.kind == "OBJ")
    higher = change.text.lower().endswith(("higher", "lower"))
    return [change, merged([thing], "obj", value="near")] if higher else None


def _other_side(found: Sequence[Chunk]) -> list[Chunk]:
    """Never to the left of it: to the right of it."""
    k = next(i for i, c in enumerate(found) if c.kind in FLIPPED)
    return [merged(found[: k + 1], FLIPPED[found[k].kind], value="flipped"), *found[k + 1 :]]


def _role(role: str) -> Build:
    def build(found: Sequence[Chunk]) -> Chunk:
        chunk = next(c for c in found if c.q is not None)
        q = replace(chunk.number, role=cast(Role, role))
        return merged(found, chunk.kind, q=q, value=role)

    return build


def _never_near(found: Sequence[Chunk]) -> Chunk:
    """Never nearer the cup than 10 cm."""
    return merged(found, "within_of", q=replace(numbers(found)[0], role="at_least"))


def _gap(found: Sequence[Chunk]) -> Chunk:
    """A distance to an object that never falls below a length."""
    low = any(c.kind in ("under", "down", "lower", "at_most") for c in found)
    least = low is any(c.kind == "never" for c in found)
    return merged(found, "within_of", q=replace(numbers(found)[0], role="at_least" if least else "at_most"))


def _law(found: Sequence[Chunk]) -> list[Chunk] | None:
    """The closer to the cup, the slower: slower near the cup."""
    pace = next((kind for kind in ("slow", "fast", "quick") if kind in found[-1].text.lower()), "")
    if not pace or not found[0].text.lower().startswith(("closer", "near")):
        return None
    near = merged([c for c in found if c.names], "obj", value="near")
    return [merged(found[-1:], "slower" if pace == "slow" else "faster"), near]


def _turned(found: Sequence[Chunk]) -> Chunk:
    """A quarter turn."""
    return merged(found, "Qdeg", q=Quantity(360 * FRACTION[found[0].kind], "deg"))


def _height(role: str) -> Build:
    """A bound on the height."""

    def build(found: Sequence[Chunk]) -> Chunk:
        q = numbers(found)[0]
        return merged(found, "Hq", q=replace(q, unit="m", role=cast(Role, role)))

    return build


def _signed(found: Sequence[Chunk]) -> Chunk:
    chunk = found[-1]
    q = chunk.q or Quantity(0.0)
    sign = -1.0 if found[0].kind == "minus" else 1.0
    return merged(found, chunk.kind, q=replace(q, value=q.value, said=""), value="minus" if sign < 0 else "plus")


def _label(label: str, factor: float = 1.0) -> Build:
    def build(found: Sequence[Chunk]) -> Chunk:
        chunk = next(c for c in found if c.q is not None)
        q = chunk.q or Quantity(0.0)
        q = Quantity(q.value * factor, q.unit, "by", q.said if factor == 1.0 else "")
        return merged(found, label, q=q)

    return build


def _counted(label: str, times: float | None = None) -> Build:
    def build(found: Sequence[Chunk]) -> Chunk:
        value = times if times is not None else numbers(found)[0].value
        return merged(found, label, q=Quantity(value))

    return build


def _flip(found: Sequence[Chunk]) -> Chunk:
    last = found[-1]
    said = {c.kind for c in found} | {found[0].text.lower()}
    sure = last.kind in ("touch", "closer") or not said.isdisjoint("too so as less dec pass without".split())
    return merged(found, FLIPPED.get(last.kind, last.kind), value="flipped" if sure else "denied")


def _except(found: Sequence[Chunk]) -> Chunk | None:
    """Everywhere but in a part, near an object or at an end."""
    inner = [c for c in found[1:] if c.kind in ("part", "obj", "end", "pair", "point")]
    parts = [p for c in inner if (p := as_part(c, any_preposition=True)) is not None]
    if not parts:
        return None
    whole = parts[0] if len(parts) == 1 else PathPart("either", parts=tuple(parts))
    return part(found, outside(whole))


def _beyond(found: Sequence[Chunk]) -> Chunk:
    q = numbers(found)[0]
    low = any(c.kind in ("under", "down", "lower", "at_most") for c in found)
    if any(c.kind in ("at_least", "at_most") for c in found):
        low = q.role == "at_most" or next(c.kind for c in found if c.kind in ("at_least", "at_most")) == "at_most"
    return part(found, PathPart("beyond", amount=-q.value if low else q.value, direction="down" if low else "up"))


def _axis(found: Sequence[Chunk]) -> Chunk:
    """A signed length along an axis: "y -0.05", "z += 0.05"."""
    axis = found[0].text.lower()
    length = found[-1]
    q = length.q or Quantity(0.0)
    minus = length.value == "minus"
    return merged(found, "axis_by", q=Quantity(q.value, "m", "by", q.said), value="-" * minus + axis)


def _along_axis(found: Sequence[Chunk]) -> Chunk | None:
    """A length along an axis: "5 cm in y", "by -5 cm along x", "0.1 to the z coordinate"."""
    axis, length = (next(c for c in found if c.kind in kinds) for kinds in (("axis",), ("Qm", "Qn")))
    if length.kind == "Qn" and "." not in length.text:
        return None
    against = any(c.kind == "minus" for c in found)
    return replace(_axis([axis, replace(length, value="minus") if against else length]), span=merged(found, "").span)


def _no_slower(found: Sequence[Chunk]) -> list[Chunk] | Chunk | None:
    """Without slowing down: the speed stays. "Never slow down" turns nothing round; "don't go fast" does."""
    if found[0].text.lower() == "without":
        return [replace(found[0], kind="and"), replace(found[0], kind="keep"), replace(found[1], kind="speed")]
    last = found[1].text.lower().split()[-1]
    return merged(found, "unknown") if last in ("down", "up", "slower", "faster", "brake", "decelerate") else None


def _bounds(found: Sequence[Chunk]) -> list[Chunk]:
    """Between two speeds: a least and a greatest one."""
    low, high = (c for c in found if c.q is not None)
    bounds = ((low, "at_least"), (high, "at_most"))
    speeds = [
        merged([c], "Qv", q=replace(c.number, unit="m/s", role=cast(Role, role)), value=role) for c, role in bounds
    ]
    return [speeds[0], merged(found[2:3], "and"), speeds[1]]


def as_part(chunk: Chunk, *, any_preposition: bool = False) -> PathPart | None:
    """The part of the path that a constituent may mean."""
    match chunk.kind:
        case "part":
            return cast(PathPart, chunk.value)
        case "pair":
            return PathPart("between", chunk.names)
        case "point":
            at = chunk.value.value - 1
            return PathPart("range", amount=at, until=at)
        case "within_of" if chunk.names:
            return _either(chunk.names, chunk.q.value if chunk.q else None)
        case "end":
            of, point = chunk.value[0], {"goal", "point", "target", "destination"} & {*chunk.text.lower().split()}
            amount = 1 if any_preposition and not chunk.value[1] and point else None  # "all but the goal"
            return None if of == "ends" else PathPart("first" if of == "start" else "last", amount=amount)
        case "obj" if chunk.text.lower().startswith("up to "):
            return PathPart("before", chunk.names[:1])
        case "obj" if any_preposition or chunk.value in NEARBY:
            return _either(chunk.names, None)
        case "halfway":
            return PathPart("middle")
    return None


NEARBY = frozenset({"at", "by", "on", "in", "near", "around", "along", "pass", "over", "with", "for"})
"""Prepositions with which an object says where."""


def _either(names: tuple[str, ...], radius: float | None) -> PathPart:
    parts = tuple(PathPart("near", (name,), radius) for name in names)
    return parts[0] if len(parts) == 1 else PathPart("either", parts=parts)


@dataclass(frozen=True)
class Pattern:
    """A row of classes, what must follow it if it ends in "(?=...)" or "(?!...)", and what it becomes."""

    classes: str
    build: Build
    regex: re.Pattern[str]


def _pattern(classes: str, build: Build) -> Pattern:
    pieces = []
    named, _, ahead = classes.partition(" (?")
    for piece in named.split():
        repeat = piece[-1] if piece[-1] in "?*+" else ""
        names = "|".join(GROUPS.get(name, name) for name in piece.removesuffix(repeat).split("|"))
        pieces.append(f"(?:(?:{names}) ){repeat}")
    return Pattern(classes, build, re.compile(r"(?<!\S)" + "".join(pieces) + ("(?" + ahead if ahead else "")))


PATTERNS: tuple[Pattern, ...] = tuple(
    _pattern(classes, build)
    for classes, build in (
        *COMPARED,
        ("comma|dot never comma", lambda f: merged(f, "correct")),
        ("comma only? never near to|of? OBJ", lambda f: part(f, outside(_either(f[-1].names, None))) if "not" in [c.text.lower() for c in f] else None),
        ("where (?=(?:start|goal|ends|speed|height) keep )", lambda f: merged(f, "and")),
        ("dec|lower|drop|limit faster (?=to )", lambda f: [f[0], merged(f[1:], "vmax")] if "speed" in f[1].text else None),
        ("keep near (?=(?:to |of )*OBJ )", lambda f: merged(f, "closer")),
        ("because (?=(?:firsthalf|secondhalf|first|last|middle|1st|nth|rest|start|goal) )", _for_the),
        ("keep|pass (?=(?:on |at |to |toward |slight |large |too )*(?:left|right|front|back|up|down|closer|farther) (?!of|OBJ|speed|Q|than))", lambda f: merged(f, "filler")),
        ("keep (?=(?:slight |large )*(?:closer|farther) )", lambda f: merged(f, "filler")),
        # numbers
        ("Qm|Qv|Qs and half", _and_a_half),
        ("quarter|half of? turns|laps|rotate|circle", _turned),
        ("up|raise|rising by? Qm rising|up", _label("rise")),
        ("Qn half|third|quarter|tenth|fifth", _many_thirds),
        ("every waypoints (?=from |between )", lambda f: f[1]),
        ("Qth waypoints", _point),
        ("from|between waypoints Qn LINK|and waypoints? Qn", _range_of_points),
        ("waypoints from|between Qn LINK|and Qn", _range_of_points),
        ("waypoints Qn LINK waypoints? Qn", _range_of_points),
        ("from|between Qn LINK|and Qn waypoints", _range_of_points),
        ("Qn LINK Qn waypoints", _range_of_points),
        ("from Qn|Qm|Qv|Qs to Qm|Qv|Qs", lambda f: merged(f, "unknown", q=None)),
        ("between Qn|Qv and|to Qv", _bounds),
        ("between Qn|Qm|Qv|Qs and Qm|Qv|Qs|Qpc|Qdeg", _spread),
        ("Qn|Qm|Qv|Qs to Qm|Qv|Qs|Qpc|Qdeg", _spread),
        ("every Qn|second|third|quarter|fifth|tenth|rest|unknown waypoints", _every),
        ("Qn laps|turns|times|circle", _counted("turns")),
        ("Qn waves|wave", _counted("waves")),
        ("1st|start Qn? SHARE of? path?", _amount("first")),
        ("1st Qn? SPAN of? path?", _amount("first")),
        ("nth|goal Qn? SHARE of? path?", _amount("last")),
        ("nth Qn? SPAN of? path?", _amount("last")),
        ("Qn FIRST waypoints", _amount("first")),
        ("Qn LAST waypoints", _amount("last")),
        ("FIRST Qn waypoints?", _amount("first")),
        ("LAST Qn waypoints?", _amount("last")),
        ("middle third|Qpc", _plain("middle")),
        ("before|for? secondhalf|firsthalf", lambda f: _share("last" if f[-1].kind == "secondhalf" else "first", 0.5)(f)),
        ("AT|from? waypoints|nth|1st Qn to?", _point),
        ("after|from halfway|middle on|front?", lambda f: _share("last", 0.5)(f)),
        ("halfway|middle on|front", lambda f: _share("last", 0.5)(f)),
        ("before touch? halfway|middle", lambda f: _share("first", 0.5)(f)),
        ("point and|comma AT? point", lambda f: merged(f, "unknown")),
        ("from point on|front?", _along("after")),
        ("after|before|from point", lambda f: _along("before" if f[0].kind == "before" else "after")(f)),
        ("point on|front", _along("after")),
        ("after SHARE of? path", _along("after")),
        ("before SHARE of? path", _along("before")),
        ("reverse by? Qm", lambda f: merged(f, "back")),
        ("Qm reverse", lambda f: merged(f, "back")),
        ("rising|falling by? Qm", lambda f: merged(f, "up" if f[0].kind == "rising" else "down")),
        ("AT rising|falling", lambda f: _plain("heading", direction="up" if f[1].kind == "rising" else "down")(f)),
        ("rising|falling", lambda f: _plain("heading", direction="up" if f[0].kind == "rising" else "down")(f)),
        ("where path? left|right|front|back (?!of|by|OBJ|Q)", lambda f: _plain("heading", direction=f[-1].kind)(f)),
        ("never AT? straights", lambda f: part(f, PathPart("turns"))),
        ("AT|only? straights", lambda f: part(f, outside(PathPart("turns")))),
        ("where over|up|after|at_least|raise than? Qm ground?", _beyond),
        ("where height|axis? up|raise? at_least|over|after|under|at_most|down|lower|than up? than? under|down|over? Qm ground?", _beyond),
        ("where height|axis|ground? lower|down under|than|at_most Qm ground?", _beyond),
        ("axis to? plus|minus Qm|Qn", lambda f: _axis([*f[:1], _signed(f[-2:])])),
        ("plus|minus ANYQ", _signed),
        ("by? Qm|Qn in|on|to minus? axis waypoints? of? waypoints?", _along_axis),
        ("plus", lambda f: merged(f, "and")),
        ("threshold to? Qm", lambda f: merged(f, "threshold")),
        ("gap to|from|around", lambda f: merged(f, "distance")),
        # objects and places
        ("after|once pass|touch|near|closer at|to|by? OBJ", _side_of_object("after")),
        ("before pass|touch|near|closer at|to|by? OBJ", _side_of_object("before")),
        ("between and OBJ", lambda f: merged(f[2:], "obj", value="from")),
        ("where|as OBJ near|closer|pass", lambda f: merged(f[1:2], "obj", value="near")),
        ("where|as pass|near|closer|touch|thru at|to|by? OBJ", lambda f: merged(f[-1:], "obj", value="near")),
        ("pass by? OBJ", lambda f: merged(f[-1:], "obj", value="pass")),
        ("OBJ comma|and OBJ comma|and OBJ", _objects),
        ("OBJ and OBJ", _objects),
        ("from start to|before OBJ|goal", lambda f: _to_or_from_end(f) if f[-1].kind == "OBJ" else merged(f, "whole")),
        ("from OBJ to|before goal", _to_or_from_end),
        ("between OBJ and start|goal", _to_or_from_end),
        ("between start|goal and OBJ", _to_or_from_end),
        ("than from|to|of? OBJ", lambda f: merged(f, "unknown")),
        ("from? OBJ to|before|thru OBJ", lambda f: _between(f) if len(f[0].names or f[1].names) == 1 else None),
        ("AT|thru? gap? middle? between OBJ gap?", _between),
        ("thru|in|at|to|on|between? middle of? OBJ", _between),
        ("OBJ gap", _between),
        ("from OBJ on|front", _side_of_object("after")),
        ("where? after OBJ", _side_of_object("after")),
        ("before near? OBJ", _side_of_object("before")),
        ("closer|near to|of? OBJ comma? to? within Qm (?!of|from|to|around|near|OBJ)", _within),
        ("closer to? OBJ comma? to Qm (?!of|from|to|around|near|OBJ)", _within),
        ("raise|lower|up|down over OBJ", _higher_there),
        ("over OBJ raise|lower|up|down", _higher_there),
        ("never within Qm", _role("at_least")),
        ("within Qm of|from|to|around|near OBJ", _within),
        ("in|on|at|by|to|from|near? middle of? path?", _plain("middle")),
        ("except where? over|under|up|down Qm", lambda f: part(f, outside(_beyond(f).value))),
        ("SHARE|Qx as", lambda f: merged(f[:1], "Qpc", q=replace(_share_of(f[0]), role="to"))),
        ("law to? OBJ comma? law", lambda f: _law(f)),
        ("with|keep OBJ on|to|at left|right", lambda f: [merged(f[:1], "pass"), merged(f[1:2], "obj", value="of"), merged(f[2:], FLIPPED[f[3].kind], value="flipped")]),
        ("as FLIPS from|to? OBJ? as", lambda f: merged(f, "unknown")),
        # roles of quantities
        ("distance|gap from|to|around|of? OBJ never? under|over|down|up|lower|at_least|at_most Qm", _gap),
        ("over|under height of? Qm", lambda f: _height("at_least" if f[0].kind == "over" else "at_most")(f)),
        ("Qv squared", lambda f: merged(f, "Qa", q=replace(f[0].number, unit="m/s2"))),
        ("never HIGHER+ than|on|by? Qm|Qn ground?", _height("at_most")),
        ("never lower|drop|down|falling under|at_most Qv|Qn", _role("at_least")),
        ("never path? over|under|at_least|at_most Qv", lambda f: _role("at_least" if {c.kind for c in f} & {"under", "at_most"} else "at_most")(f)),
        ("under|at_most Qv", _role("at_most")),
        ("over|at_least Qv", _role("at_least")),
        ("slower|brake to? stop", lambda f: merged(f, "ramp_down")),
        ("slower|brake to Qn|Qm|Qv", lambda f: merged(f, "ramp_down", q=None) if f[-1].number.value == 0 else None),
        ("never pass? to|on|at? left|right|front|back of OBJ", _other_side),
        ("at_least|at_most Qm size", lambda f: _height(f[0].kind)(f) if f[-1].text.lower() == "high" else None),
        ("rotate path? by? Qdeg to? left|right", lambda f: [*f[:-1], replace(f[-1], kind="anticlockwise" if f[-1].kind == "left" else "clockwise")]),
        ("rotate path? to? left|right by? Qdeg", lambda f: [replace(c, kind={"left": "anticlockwise", "right": "clockwise"}.get(c.kind, c.kind)) for c in f]),
        ("never LOWER+ than|on|by? Qm|Qn ground?", _height("at_least")),
        ("keep? up|raise than Qm|Qn ground?", _height("at_least")),
        ("keep? LOWER than Qm|Qn ground?", _height("at_most")),
        ("never faster|inc|slower|dec than? Qv|Qn", lambda f: _role("at_most" if f[1].kind in ("faster", "inc") else "at_least")(f)),
        ("faster|slower than Qv", lambda f: _role("at_least" if f[0].kind == "faster" else "at_most")(f)),
        ("never closer|near of|to|from|at? OBJ than|by? Qm", _never_near),
        ("never farther|closer|near|within|side than|to? Qm", lambda f: _role("at_least" if f[1].kind in ("closer", "near", "within") else "at_most")(f)),
        ("never at_least|limit|at_most|after ANYQ", lambda f: _role("at_least" if f[1].kind == "at_most" else "at_most")(f)),
        ("keep over|under|up|down Qm ground?", lambda f: _height("at_least" if f[1].kind in ("over", "up") else "at_most")(f)),
        ("keep? over|under Qm ground", lambda f: _height("at_least" if any(c.kind == "over" for c in f) else "at_most")(f)),
        ("over|under Qm", lambda f: _height("at_least" if f[0].kind == "over" else "at_most")(f)),
        ("radius to|of|at? Qm|Qn", _label("radius")),
        ("Qm|Qn of? radius", _label("radius")),
        ("diameter to|of? Qm", _label("radius", 0.5)),
        ("Qm of|in? diameter", _label("radius", 0.5)),
        ("size to|of|by? Qm", _label("size")),
        ("Qm of|in? size", _label("size")),
        ("at_least approx? ANYQ", _role("at_least")),
        ("min of|to|at? ANYQ", _role("at_least")),
        ("ANYQ min", _role("at_least")),
        ("at_most approx? ANYQ", _role("at_most")),
        ("max of|to|at|under? ANYQ", _role("at_most")),
        ("ANYQ max", _role("at_most")),
        ("to approx? ANYQ", _role("to")),
        ("by approx? ANYQ", _role("by")),
        ("at approx? Qv", _role("to")),
        ("goal by stop", lambda f: f[2]),
        ("never stop at|by goal", lambda f: merged(f, "extend")),
        ("never? faster|inc never? slower|dec", lambda f: merged(f, "constant") if f[0].kind == "never" else None),
        ("never slower|faster", _no_slower),
        # what is turned round
        ("stop faster|slower", lambda f: _flip(f) if f[-1].text.lower().endswith("ing") else None),
        ("never keep|pass? slight? so|too|of|as slight|large? FLIPS", _flip),
        ("never pass? slight? slight|large? FLIPS", _flip),
        ("too so? FLIPS", _flip),
        ("less|dec so? FLIPS", lambda f: _flip(f) if f[0].text.lower().endswith("less") else None),
        # ends and objects with their prepositions
        ("where|after|once touch? at? goal", lambda f: merged(f, "end", value=("goal", "after"))),
        ("where? closer|near to? goal", _plain("last")),
        ("straight|ramp_down|ramp_up path? to|before|for goal", lambda f: f[0]),
        ("before turns", lambda f: f[1]),
        ("AT|to|toward|from|of|before|after|where|than? END", _end),
        ("BEFORE_OBJ* OBJ", _object),
        ("keep Qm obj and Qm obj", lambda f: [*f[:4], Chunk("keep", "", f[3].span), *f[4:]]),
        ("from here|there", lambda f: merged(f, f[1].kind)),
        ("AT|over here", _plain("indices")),
        ("here", _plain("indices")),
        ("turns|before turns", lambda f: merged(f, "turns")),
        ("FIRST waypoints", lambda f: merged(f, "end", value=("start", ""))),
        ("LAST waypoints", lambda f: merged(f, "end", value=("goal", ""))),
        ("AT|to|toward|where|only? first", _plain("first", unit="share")),
        ("AT|to|toward|where|only? last", _plain("last", unit="share")),
        ("only? middle", _plain("middle")),
        ("thru|along part|rest", lambda f: f[1]),
        ("except AT|from|to|near? part|obj|end|pair|point and|comma? part?", _except),
        ("never AT part|obj", _except),
    )
)  # fmt: skip


def constituents(found: Sequence[Chunk], reach: float = 1.0) -> list[Chunk]:
    """Chunks put together by the patterns, without the words that ask for nothing.

    Args:
        found: The chunks of an utterance.
        reach: The longest length [m] that a number without a unit may be.
    """
    row = with_units([c for c in found if c.kind not in ("filler", "approx")], reach)
    row = [replace(c, kind=_past(row[:i])) if c.kind == "past" else c for i, c in enumerate(row)]
    for pattern in PATTERNS:
        row = _rewritten(row, pattern)
    return row


def turned(found: Sequence[Chunk]) -> list[Chunk]:
    """The words of an utterance that others turn round, as what they come to: "too close" as farther."""
    return [c for c in constituents(found) if c.value == "flipped"]


def _past(before: Sequence[Chunk]) -> str:
    """Hurrying past something is done beside it, left past it is a side of it; what comes past it comes after it."""
    sided = bool(before) and before[-1].kind in ("left", "right") and all(c.kind != "path" for c in before)
    return "by" if any(c.kind in ("faster", "slower", "pass") for c in before[-2:]) else "pass" if sided else "after"


def _rewritten(row: list[Chunk], pattern: Pattern) -> list[Chunk]:
    text = "".join(c.kind + " " for c in row)
    matches = list(pattern.regex.finditer(text))
    if not matches:
        return row
    made: list[Chunk] = []
    at = 0
    for match in matches:
        begin = text.count(" ", 0, match.start())
        end = text.count(" ", 0, match.end())
        chunk = pattern.build(row[begin:end]) if end > begin >= at else None
        if chunk is not None:
            made += [*row[at:begin], *(chunk if isinstance(chunk, list) else [chunk])]
            at = end
    return made + row[at:]
