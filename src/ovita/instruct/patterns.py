# ruff: noqa: E501
"""What becomes of chunks that stand side by side: quantities with roles, objects with prepositions, parts of the path.

Each pattern is a row of classes and what they become together; `constituents` applies them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any, cast

from ovita.instruct.chunks import COUNTED, Build, Chunk, in_role, kinds, merged, numbers
from ovita.instruct.frames import Quantity, Role
from ovita.instruct.numerals import unit_at
from ovita.instruct.senses import BACKING
from ovita.paths.part import PathPart, any_of, outside

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


def _many_thirds(found: Sequence[Chunk]) -> Chunk | None:
    return _fraction(found) if found[-1].text.lower().endswith("s") or found[0].text.isalpha() else None


def _range_of_points(found: Sequence[Chunk]) -> Chunk:
    a, b = (q.value for q in numbers(found)[:2])
    return part(found, PathPart("range", amount=a - 1, until=b - 1))


def _spread(found: Sequence[Chunk]) -> Chunk:
    """10 to 15 cm: what lies between."""
    a, b = numbers(found)
    words = found[-1].text.lower().split()
    factor = next((f for k in range(1, len(words)) for unit, f, _ in (unit_at(words, k),) if unit), 1.0)
    low = a.value if a.unit else a.value * factor
    return merged(found, found[-1].kind, q=Quantity((low + b.value) / 2, b.unit))


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
            q = target.number
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
    pair = merged(found, "pair")
    return pair if len(pair.names) == 2 else None


def _to_or_from_end(found: Sequence[Chunk]) -> Chunk | None:
    """From the start to the cup; from the cup to the goal."""
    name = next(c for c in found if c.kind == "OBJ").names[0]
    end = next(c.kind for c in found if c.kind in ("start", "goal"))
    return part(found, PathPart("before" if end == "start" else "after", (name,)))


def _side_of_object(kind: str) -> Build:
    return lambda found: part(found, PathPart(kind, (next(c for c in reversed(found) if c.kind == "OBJ").names[0],)))


def _distance(role: str) -> Build:
    """A distance to objects as a bound."""
    return lambda found: merged(found, "within_of", q=replace(numbers(found)[0], role=cast(Role, role)))


def _within(found: Sequence[Chunk]) -> Chunk | list[Chunk] | None:
    return _distance("at_least" if numbers(found)[0].role == "at_least" else "at_most")(found)


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


def _bounding(found: Sequence[Chunk]) -> str:
    """Whether "over", "not slower than" and the like are a least or a greatest value."""
    least = next(how for c in found if (how := BOUNDING.get(c.kind))) == "at_least"
    return "at_least" if least is not ("never" in kinds(found)) else "at_most"


def _bounded(found: Sequence[Chunk]) -> Chunk | list[Chunk] | None:
    return in_role(_bounding(found), found)


def _high(found: Sequence[Chunk]) -> Chunk | list[Chunk] | None:
    """A bound on the height, by the word for it."""
    return _height(_bounding(found))(found)


def _gap(found: Sequence[Chunk]) -> Chunk | list[Chunk] | None:
    """A distance to an object that never falls below a length."""
    low = not LOW.isdisjoint(kinds(found))
    return _distance("at_least" if low is ("never" in kinds(found)) else "at_most")(found)


LOW = frozenset(("under", "down", "lower", "at_most"))
"""Words that make what they stand before a greatest value."""


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
    return lambda found: merged(found, "Hq", q=replace(numbers(found)[0], unit="m", role=cast(Role, role)))


def _signed(found: Sequence[Chunk]) -> Chunk:
    chunk, sign = found[-1], found[-2].kind
    q = chunk.number
    value = -q.value if (sign, chunk.kind) == ("minus", "Qa") else q.value  # of a length `value` tells the sign
    return merged(found, chunk.kind, q=replace(q, value=value, said=""), value=sign)


def _label(label: str, factor: float = 1.0) -> Build:
    def build(found: Sequence[Chunk]) -> Chunk:
        q = numbers(found)[0]
        return merged(found, label, q=Quantity(q.value * factor, q.unit, "by", q.said if factor == 1.0 else ""))

    return build


def _counted(label: str, times: float | None = None) -> Build:
    def build(found: Sequence[Chunk]) -> Chunk:
        value = times if times is not None else numbers(found)[0].value
        return merged(found, label, q=Quantity(value))

    return build


def _shut(found: Sequence[Chunk]) -> Chunk | None:
    """A way that is not to be taken: "never over the cup", "not between the two"."""
    way = "between" if found[-1].kind == "pair" else found[-1].value
    return merged(found, "shut", value=way) if way in ("over", "under", "between") else None


def _left_on(found: Sequence[Chunk]) -> list[Chunk]:
    """An object that is left on one side is passed on the other: "with the cup on your left", "leave it to port"."""
    side = FLIPPED[found[-1].kind]
    return [merged(found[:1], "pass"), merged(found[1:2], "obj", value="of"), merged(found[2:], side, value="flipped")]


def _flip(found: Sequence[Chunk]) -> Chunk:
    last = found[-1]
    said = {*kinds(found), found[0].text.lower()}
    sure = last.kind in ("touch", "closer") or not said.isdisjoint("too so as less dec pass without".split())
    return merged(found, FLIPPED.get(last.kind, last.kind), value="flipped" if sure else "denied")


def _except(found: Sequence[Chunk]) -> Chunk | None:
    """Everywhere but in a part, near an object or at an end."""
    inner = [c for c in found[1:] if c.kind in ("part", "obj", "end", "pair", "point")]
    parts = [p for c in inner if (p := as_part(c, any_preposition=True)) is not None]
    return part(found, outside(any_of(parts))) if parts else None


def _beyond(found: Sequence[Chunk]) -> Chunk:
    q = numbers(found)[0]
    low = not LOW.isdisjoint(kinds(found))
    if bounds := [kind for kind in kinds(found) if kind in ("at_least", "at_most")]:
        low = "at_most" in (q.role, bounds[0])
    return part(found, PathPart("beyond", amount=-q.value if low else q.value, direction="down" if low else "up"))


def _axis(found: Sequence[Chunk]) -> Chunk | None:
    """A signed length along an axis: "y -0.05", "z += 0.05"."""
    axis = found[0].text.lower()
    if axis == "axis":
        return None
    q, minus = found[-1].number, found[-1].value == "minus"
    return merged(found, "axis_by", q=Quantity(q.value, "m", "by", q.said), value="-" * minus + axis)


def _along_axis(found: Sequence[Chunk]) -> Chunk | None:
    """A length along an axis: "5 cm in y", "by -5 cm along x", "0.1 to the z coordinate"."""
    axis, length = (next(c for c in found if c.kind in kinds) for kinds in (("axis",), ("Qm", "Qn")))
    if length.kind == "Qn" and "." not in length.text:
        return None
    made = _axis([axis, replace(length, value="minus") if "minus" in kinds(found) else length])
    return made and replace(made, span=merged(found, "").span)


def _no_slower(found: Sequence[Chunk]) -> list[Chunk] | Chunk | None:
    """Without slowing down: the speed stays. "Never slow down" turns nothing round; "don't go fast" does."""
    if found[0].text.lower() == "without":
        return [replace(found[0], kind="and"), replace(found[0], kind="keep"), replace(found[1], kind="speed")]
    last = found[1].text.lower().split()[-1]
    return merged(found, "unknown") if last in ("down", "up", "slower", "faster", "brake", "decelerate") else None


OTHER = {"left": "right", "front": "back", "up": "down", "over": "under"}
OTHER |= {b: a for a, b in OTHER.items()}
HOW = dict.fromkeys("over up faster raise".split(), "at_least") | dict.fromkeys(
    "under down lower slower".split(), "at_most"
)
BOUNDING = HOW | dict.fromkeys(("height", "inc", "at_least"), "at_least")
BOUNDING |= dict.fromkeys(("dec", "drop", "falling", "at_most"), "at_most")
"""Words that make what they stand before a least or a greatest value."""


def _bound(chunk: Chunk, role: str, kind: str = "", **more: str) -> Chunk:
    q = replace(chunk.number, role=cast(Role, role), **more)  # type: ignore[arg-type]
    return replace(chunk, kind=kind or chunk.kind, q=q, value=role)


def _one_side(found: Sequence[Chunk]) -> list[Chunk] | None:
    """Left of it, not right of it: the other side that is denied says nothing more."""
    one, other = (c for c in found if c.kind in OTHER)
    last = next((i for i, c in enumerate(found) if c.kind == "OBJ"), found.index(one))
    said = merged(found[last:], found[last].kind, names=found[last].names)
    return [*found[:last], said] if OTHER[one.kind] == other.kind else None


def _two_speeds(found: Sequence[Chunk]) -> list[Chunk]:
    """Speed above this and below that."""
    ways = [HOW.get(c.kind, c.kind) for c in found if c.kind in (*HOW, "at_most", "at_least")]
    speeds = [c for c in found if c.q is not None]
    one, other = (_bound(speed, way, "Qv", unit="m/s") for way, speed in zip(ways, speeds, strict=True))
    return [found[0], one, Chunk("and", "", found[0].span), found[0], other]


def _back_along(found: Sequence[Chunk]) -> list[Chunk] | None:
    """Back up by 30 cm at the end: back along the path."""
    back = next(c for c in found if c.kind in ("back", "reverse"))
    q = numbers(found)[0]
    meant = back.text.lower().startswith(BACKING)
    return [merged([back], "extend"), merged(found, "Qm", q=replace(q, value=-q.value, said=""))] if meant else None


def _height_of(found: Sequence[Chunk]) -> Chunk:
    """A height measured by a thing: as high as it, at least, or so much lower than it."""
    q = next((c.q for c in found if c.q is not None), Quantity(0.0, "m", "to"))
    how = next((HOW[c.kind] for c in found if c.kind in HOW), "")
    if "never" in kinds(found):
        return merged(found, "Hof", q=replace(q, role="at_least" if how == "at_most" else "at_most"))
    return merged(found, "Hof", q=_measured(found, how, q.value))


def _measured(found: Sequence[Chunk], how: str, by: float) -> Quantity:
    """By how much above or below a thing, or the bound that it is."""
    bound = next((c.kind for c in found if c.kind in ("at_least", "at_most")), "" if by else how)
    return Quantity(-by if how == "at_most" else by, "m", cast(Role, bound or "to"))


def _size_to_come_to(found: Sequence[Chunk]) -> list[Chunk] | None:
    """Smaller, 80 %: the size that it is to have, and not how much is taken off; "bigger, 10 %" is how much is added."""
    share = found[-1].number.value
    least = 1.0 if found[0].kind == "larger" else 0.5
    return [merged(found[:1], "resize"), merged(found[-1:], "Qx", q=Quantity(share, "x"))] if share >= least else None


def _clear(found: Sequence[Chunk]) -> list[Chunk]:
    """What is not to be touched."""
    return [merged(found[:-1], "clear", value="flipped"), merged(found[-1:], "obj", value="")]


def _behind(found: Sequence[Chunk]) -> list[Chunk] | None:
    """Higher behind the shelf: after it on the way."""
    behind = found[-1].text.lower() in ("behind", "in back of")
    return [*found[:-1], merged(found[-1:], "after")] if behind else None


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
            return _at_end(chunk, alone=any_preposition and not chunk.value[1])
        case "obj" if chunk.text.lower().startswith("up to "):
            return PathPart("before", chunk.names[:1])
        case "obj" if any_preposition or chunk.value in NEARBY:
            return _either(chunk.names, None)
        case "halfway":
            return PathPart("middle")
    return None


def _at_end(chunk: Chunk, *, alone: bool) -> PathPart | None:
    """The stretch at an end; of "all but the goal" that point alone."""
    end, point = chunk.value[0], {"goal", "point", "target", "destination"} & {*chunk.text.lower().split()}
    kind = {"start": "first", "ends": ""}.get(end, "last")
    return PathPart(kind, amount=1 if alone and point else None) if kind else None


NEARBY = frozenset({"at", "by", "on", "in", "near", "around", "along", "pass", "over", "with", "for"})
"""Prepositions with which an object says where."""


def _either(names: tuple[str, ...], radius: float | None) -> PathPart:
    return any_of([PathPart("near", (name,), radius) for name in names])


PATTERNS: tuple[tuple[str, Build], ...] = (
    ("speed keep? over|under|up|down|raise|lower|faster|slower than? Qn|Qv and|comma keep|speed? over|under|up|down|raise|lower|faster|slower than? Qn|Qv", _two_speeds),
    ("DIR|over|under of|to|from? OBJ comma|and? never pass? on|to|at|in? DIR|over|under of|to|from? OBJ?", _one_side),
    ("left|right|front|back comma|and? never pass? on|to|at|in? left|right|front|back (?!of|OBJ)", _one_side),
    ("back|reverse by? Qm once? at|on|in|near|after goal", _back_along),
    ("at|on|in|near|after goal comma? back|reverse by? Qm", _back_along),
    ("up|down|raise|lower|slower|faster by? Qm|Qn? once? back (?=OBJ)", _behind),
    ("back (?=OBJ (?:comma )?(?:Qm (?:up|down) |raise |lower |slower |faster |up |down ))", _behind),
    ("stop|endup|goal Qm before pass|touch? to|of? OBJ", lambda f: [merged(f[:1], "stop"), merged(f[1:], "short")]),
    ("wait Qm before pass|touch? to|of? OBJ", lambda f: [f[0], merged(f[1:], "short")]),
    ("stop Qm from|in? front? of|to? OBJ", lambda f: [f[0], merged(f[1:], "short")]),
    ("up|raise Qm before pass|touch? to|of? OBJ", lambda f: [merged(f[:1], "stop"), merged(f[1:], "short")] if f[0].text.lower() == "pull up" else None),
    ("whole and part|last|first", lambda f: [merged(f[:1], "except"), *f[2:]] if f[1].text.lower() == "but" else None),
    ("never keep? up|down|raise|lower than OBJ", _height_of),
    ("Qm? up|down|raise|lower than OBJ", _height_of),
    ("at_least|at_most? level|height of|with|to? OBJ", _height_of),
    ("never|avoid touch|collide to|on|at|by|with|over? OBJ", _clear),
    ("keep OBJ", lambda f: _clear(f) if "touch" in f[0].text.lower() else None),
    ("Qm farther OBJ", lambda f: [merged(f[:1], "Qm", q=replace(f[0].number, role="at_least")), merged(f[2:], "obj", value="from")] if "clear" in f[1].text.lower() else None),
    ("SHARE from", lambda f: [merged(f[1:], "slower"), merged(f[:1], "Qpc", q=_share_of(f[0]))] if f[1].text.lower() == "off" else None),
    ("smaller|larger comma approx? Qpc", _size_to_come_to),
    ("Qpc of size", lambda f: [merged(f[1:], "resize"), merged(f[:1], "Qx", q=Quantity(f[0].number.value, "x"))]),
    ("start Qpc", lambda f: [merged(f[:1], "dec"), f[1]] if f[0].text.lower().startswith("take off") else None),
    ("keep constant", lambda f: [f[0], merged(f[1:], "speed")] if f[1].text.lower().endswith("speed the same") else None),
    ("farther of|from|to? OBJ by? at_least? Qm", lambda f: _distance("at_least")(f) if "clear" in f[0].text.lower() else None),
    ("comma only? never near to|of? OBJ", lambda f: part(f, outside(_either(f[-1].names, None))) if "not" in [c.text.lower() for c in f] else None),
    ("where (?=(?:start|goal|ends|speed|height) keep )", lambda f: merged(f, "and")),
    ("dec|lower|drop|limit faster (?=to )", lambda f: [f[0], merged(f[1:], "vmax")] if "speed" in f[1].text else None),
    ("keep|pass (?=(?:on |at |to |toward |slight |large |too )*(?:left|right|front|back|up|down|closer|farther) (?!of|OBJ|speed|Q|than))", lambda f: merged(f, "filler")),
    ("speed inc|faster|up constant (?=to )", lambda f: merged(f, "ramp_up")),
    ("speed dec|slower|drop|down|lower constant (?=to )", lambda f: merged(f, "ramp_down")),
    ("height plus|minus Qm", lambda f: [merged(f[:2], "up" if f[1].kind == "plus" else "down"), f[2]]),
    ("Qv from", lambda f: [merged(f[1:], "slower"), replace(f[0], value="by")] if f[1].text.lower() == "off" else None),
    ("Qm to height", lambda f: [merged(f[1:], "up"), f[0]] if f[1].text.lower() == "onto" else None),
    ("END|endup|startat back OBJ", lambda f: [*f[:2], merged(f[2:], "obj", value="of")] if f[1].text.lower() == "behind" else None),
    ("extend (?=OBJ (?:comma |dot |and |$))", lambda f: merged(f, "pass") if f[0].text.lower().endswith("past") else None),
    ("keep (?=farther Qm from )", lambda f: merged(f, "filler")),
    # numbers
    ("by? Qs faster|slower", lambda f: [f[-1], merged(f[:-1], "Qdt", q=numbers(f)[0])]),
    ("Qs from", lambda f: [merged(f[1:], "faster"), merged(f[:1], "Qdt", q=f[0].q)] if f[1].text.lower() == "off" else None),
    ("axis axis", lambda f: merged(f, "axis", text=f[0].text)),
    ("within approx? Qv", partial(in_role, "at_most")),
    ("quarter|half of? turns|laps|rotate|circle", _turned),
    ("Qn half|third|quarter|tenth|fifth", _many_thirds),
    ("Qth waypoints", _point),
    ("from|between waypoints Qn LINK|and waypoints? Qn", _range_of_points),
    ("waypoints from|between Qn LINK|and Qn", _range_of_points),
    ("waypoints Qn LINK waypoints? Qn", _range_of_points),
    ("from|between Qn LINK|and Qn waypoints", _range_of_points),
    ("from Qn|Qm|Qv|Qs to Qm|Qv|Qs", lambda f: merged(f, "unknown", q=None)),
    ("between Qn|Qm|Qv|Qs and Qm|Qv|Qs|Qpc|Qdeg", _spread),
    ("Qn|Qm|Qv|Qs to Qm|Qv|Qs|Qpc|Qdeg", _spread),
    ("every Qn|second|third|quarter|fifth|tenth|rest|unknown waypoints", _every),
    ("Qn laps|turns|times|circle", _counted("turns")),
    ("laps (?=(?:at|near|by|in|around|before|halfway|middle) )", lambda f: merged(f, "circle")),
    ("Qn waves|wave", _counted("waves")),
    ("1st|start Qn? SHARE of? path?", _amount("first")),
    ("1st Qn? SPAN of? path?", _amount("first")),
    ("nth|goal Qn? SHARE of? path?", _amount("last")),
    ("nth Qn? SPAN of? path?", _amount("last")),
    ("Qn FIRST waypoints", _amount("first")),
    ("Qn LAST waypoints", _amount("last")),
    ("FIRST Qn waypoints?", _amount("first")),
    ("LAST Qn waypoints?", _amount("last")),
    ("before|for? secondhalf|firsthalf", lambda f: _share("last" if f[-1].kind == "secondhalf" else "first", 0.5)(f)),
    ("AT|from? waypoints|nth|1st Qn to?", _point),
    ("halfway|middle on|front", lambda f: _share("last", 0.5)(f)),
    ("after|from touch|pass? halfway|middle (?!to|and)", lambda f: _share("last", 0.5)(f)),
    ("before touch? halfway|middle", lambda f: _share("first", 0.5)(f)),
    ("from point on|front?", _along("after")),
    ("after|before|from point", lambda f: _along("before" if f[0].kind == "before" else "after")(f)),
    ("point on|front", _along("after")),
    ("after SHARE of? path", _along("after")),
    ("before SHARE of? path", _along("before")),
    ("rising|falling by? Qm", lambda f: merged(f, "up" if f[0].kind == "rising" else "down")),
    ("AT rising|falling", lambda f: _plain("heading", direction="up" if f[1].kind == "rising" else "down")(f)),
    ("rising|falling", lambda f: _plain("heading", direction="up" if f[0].kind == "rising" else "down")(f)),
    ("where path? left|right|front|back (?!of|by|OBJ|Q)", lambda f: _plain("heading", direction=f[-1].kind)(f)),
    ("where over|up|after|at_least|raise than? Qm ground?", _beyond),
    ("axis to? plus|minus Qm|Qn", lambda f: _axis([*f[:1], _signed(f[-2:])])),
    ("to plus|minus Qpc", _signed),
    ("by minus Qm", _signed),
    ("plus|minus ANYQ", _signed),
    ("by? Qm|Qn in|on|to minus? axis waypoints? of? waypoints?", _along_axis),
    ("threshold to? Qm", lambda f: merged(f, "threshold")),
    # objects and places
    ("after OBJ on|to|at left|right|front|back", lambda f: [merged(f[:1], "pass"), *f[1:]] if f[0].text.lower() == "past" else None),
    ("after|once pass|touch|near|closer at|to|by? OBJ", _side_of_object("after")),
    ("before pass|touch|near|closer at|to|by? OBJ", _side_of_object("before")),
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
    ("from OBJ on|front", _side_of_object("after")),
    ("where? after OBJ", _side_of_object("after")),
    ("before near? OBJ", _side_of_object("before")),
    ("closer|near to|of? OBJ comma? to? within Qm (?!of|from|to|around|near|OBJ)", _within),
    ("closer to? OBJ comma? to Qm (?!of|from|to|around|near|OBJ)", _within),
    ("raise|lower|up|down over OBJ", _higher_there),
    ("over OBJ raise|lower|up|down", _higher_there),
    ("in (?=Qm of OBJ)", lambda f: merged(f, "within")),
    ("never pass? within Qm", partial(in_role, "at_least")),
    ("within Qm of|from|to|around|near OBJ", _within),
    ("in|on|at|by|to|from|near? middle of? path?", _plain("middle")),
    ("SHARE|Qx as", lambda f: f[0] if f[0].kind == "Qx" and f[0].number.value > 1 else merged(f[:1], "Qpc", q=replace(_share_of(f[0]), role="to"))),
    ("law to? OBJ comma? law", lambda f: _law(f)),
    ("with|keep OBJ on|to|at left|right", _left_on),
    ("keep OBJ left|right", lambda f: _left_on(f) if f[2].text.lower().startswith("to ") else None),
    ("as FLIPS from|to? OBJ? as", lambda f: merged(f, "unknown")),
    ("keep for|with|to OBJ", lambda f: merged(f, "unknown") if "same" in f[0].text.lower() else None),
    ("by keep", lambda f: merged(f, "unknown") if "same" in f[1].text.lower() else None),
    ("too large? shake|zigzag|wave", lambda f: merged(f, "smooth")),
    # roles of quantities
    ("distance|gap from|to|around|of? OBJ never? under|over|down|up|lower|at_least|at_most Qm", _gap),
    ("over|under height of? Qm", _high),
    ("never HIGHER+ than|on|by? Qm|Qn ground?", _high),
    ("never lower|drop|down|falling under|at_most Qv|Qn", _bounded),
    ("never path? over|under|at_least|at_most Qv", _bounded),
    ("under|at_most|over|at_least Qv", _bounded),
    ("slower|brake to? stop", lambda f: merged(f, "ramp_down")),
    ("slower|brake to Qn|Qm|Qv", lambda f: merged(f, "ramp_down", q=None) if f[-1].number.value == 0 else None),
    ("never pass? to|on|at|in? left|right|front|back of OBJ", _other_side),
    ("rotate path? by? Qdeg to? left|right", lambda f: [*f[:-1], replace(f[-1], kind="anticlockwise" if f[-1].kind == "left" else "clockwise")]),
    ("never pass? LOWER+ than|on|by? Qm|Qn ground?", _high),
    ("keep? up|raise|LOWER than Qm|Qn ground?", _high),
    ("never faster|inc|slower|dec than? Qv|Qn", _bounded),
    ("faster|slower than Qv", _bounded),
    ("never closer|near of|to|from|at? OBJ than|by? Qm", _distance("at_least")),
    ("never farther|closer|near|within|side than|to? Qm", lambda f: in_role("at_least" if f[1].kind in ("closer", "near", "within") else "at_most", f)),
    ("never at_least|limit|at_most|after ANYQ", lambda f: in_role("at_least" if f[1].kind == "at_most" else "at_most", f)),
    ("keep over|under|up|down Qm ground?", _high),
    ("keep? over|under Qm ground", _high),
    ("over|under Qm", _high),
    ("radius to|of|at? Qm|Qn", _label("radius")),
    ("Qm|Qn of? radius", _label("radius")),
    ("diameter to|of? Qm", _label("radius", 0.5)),
    ("Qm of|in? diameter", _label("radius", 0.5)),
    ("size to|of|by? Qm", _label("size")),
    ("Qm of|in? size", _label("size")),
    ("at_least approx? ANYQ", partial(in_role, "at_least")),
    ("min of|to|at? ANYQ", partial(in_role, "at_least")),
    ("ANYQ min", partial(in_role, "at_least")),
    ("at_most approx? ANYQ", partial(in_role, "at_most")),
    ("max of|to|at|under? ANYQ", partial(in_role, "at_most")),
    ("ANYQ max", partial(in_role, "at_most")),
    ("to approx? ANYQ", partial(in_role, "to")),
    ("to half|third|quarter|tenth|fifth (?!waypoints)", lambda f: merged(f, "Qpc", q=replace(_share_of(f[-1]), role="to"))),
    ("by approx? ANYQ", partial(in_role, "by")),
    ("at approx? Qv", partial(in_role, "to")),
    ("never stop at|by goal", lambda f: merged(f, "extend")),
    ("never? faster|inc never? slower|dec", lambda f: merged(f, "constant") if f[0].kind == "never" else None),
    ("never slower|faster", _no_slower),
    # what is turned round
    ("never keep|pass? slight? so|too|of|as slight|large? FLIPS", _flip),
    ("never pass? slight? slight|large? FLIPS", _flip),
    ("too farther to|at? left|right|front|back|up|down", _flip),
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
    ("except AT? turns|between turns", lambda f: merged(f, "straights")),
    ("turns|before turns", lambda f: merged(f, "turns")),
    ("FIRST waypoints", lambda f: merged(f, "end", value=("start", ""))),
    ("LAST waypoints", lambda f: merged(f, "end", value=("goal", ""))),
    ("AT|to|toward|where|only? first", _plain("first", unit="share")),
    ("AT|to|toward|where|only? last", _plain("last", unit="share")),
    ("except AT|from|to|near? part|obj|end|pair|point and|comma? part?", _except),
    ("never AT part|obj", _except),
    ("never|avoid pass|extend|up|down? obj|pair", _shut),
)  # fmt: skip
"""Rows of classes as `constituents` reads them, in the order in which they are applied, and what becomes of them."""
