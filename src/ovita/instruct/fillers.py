# ruff: noqa: E501
"""What fills the slots of a frame: each filler takes constituents of a clause and returns a value, or nothing."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

from ovita.instruct import frames as F
from ovita.instruct.chunks import COUNTED, Chunk
from ovita.instruct.patterns import FRACTION, QUANTITIES, as_part
from ovita.paths.part import PathPart, any_of, both, outside

Filler = Callable[["Constituents"], Any]

DIRECTIONS = {"left": "left", "right": "right", "front": "front", "back": "back", "up": "up", "down": "down",
              "raise": "up", "lower": "down", "drop": "down"}  # fmt: skip

FREE = frozenset(
    """comma dot and so where only whole path to of with for as at by on in from than around over approx then_on onward because
    correct too toward side more filler bare within off here inc near along min max between""".split()
)
"""Classes that may be left over: they shape what stands beside them."""

MILD = {"speed": 4, "keep": 2, "distance": 6, "there": 3, "slight": 3, "large": 2, "rest": 8, "ground": 3, "height": 4,
        "duration": 1, "pass": 1, "touch": 6, "thru": 3, "times": 2, "once": 3, "gap": 2, "origin": 6, "1st": 1, "nth": 1, "limit": 3, "bound": 4, "obj": 9,
        "end": 9, "radius": 5, "size": 5, "straights": 4, "laps": 2, "waves": 3, "dec": 5, "raise": 9}  # fmt: skip
CONTENT = 10


def weight(item: Chunk) -> float:
    """What it costs to leave a constituent over."""
    return 0.0 if item.kind in FREE else MILD.get(item.kind, CONTENT)


SLOTTED = QUANTITIES.union(FRACTION, DIRECTIONS, """Hq once ceiling floorlimit obj end pair point within_of axis_by part
    double triple halve clockwise anticlockwise halfway""".split())  # fmt: skip
"""Classes that fill slots."""


class Constituents:
    """The constituents of a clause, and which of them a row of the table has taken."""

    def __init__(self, items: Sequence[Chunk]) -> None:
        self.items = items
        self.kinds = frozenset(c.kind for c in items)
        self.used: set[int] = set()

    def take(self, *kinds: str, where: Callable[[Chunk], bool] | None = None) -> Chunk | None:
        """The first constituent of these classes that is still free."""
        for i, item in enumerate(self.items):
            if i not in self.used and item.kind in kinds and (where is None or where(item)):
                self.used.add(i)
                return item
        return None

    def quantity(self, *kinds: str, where: Callable[[Chunk], bool] | None = None) -> F.Quantity | None:
        """The quantity of the first free constituent of these classes."""
        found = self.take(*kinds, where=where)
        return None if found is None else found.q

    def worded(self, values: Mapping[str, float]) -> float | None:
        """The value of the first of some words that is free and no quantity."""
        return next((v for kind, v in values.items() if self.take(kind, where=lambda c: c.q is None)), None)

    def every(self, *kinds: str, where: Callable[[Chunk], bool] | None = None) -> list[Chunk]:
        """All free constituents of these classes."""
        free = [i for i, c in enumerate(self.items) if i not in self.used and c.kind in kinds]
        found = [i for i in free if where is None or where(self.items[i])]
        self.used.update(found)
        return [self.items[i] for i in found]

    def has(self, *kinds: str) -> bool:
        """Whether any constituent is of these classes."""
        return not self.kinds.isdisjoint(kinds)

    def left(self) -> list[Chunk]:
        """What nobody has taken."""
        return [c for i, c in enumerate(self.items) if i not in self.used]


CLEAR = F.Quantity(0.0, "m", "at_least")
"""Passing clear of something, by no distance that is stated."""

REST = PathPart("every", amount=-1.0)
"""Stands for "the rest" until the sentence has been read."""

THERE = PathPart("every", amount=-2.0)
"""Stands for "there" until the sentence has been read."""


def parts(clause: Constituents, bounds: bool = False) -> PathPart:
    """The part of the path that the clause names."""
    found: list[PathPart] = []
    for i, item in enumerate(clause.items):
        verb = i == 0 and item.text.lower() == "turn"
        of = None if verb or i in clause.used else _part_named(item, bounds)
        if of is not None:
            clause.used.add(i)
            found.append(of)
    return joined(found)


def _part_named(item: Chunk, bounds: bool) -> PathPart | None:
    """The part of the path that a constituent names; with `bounds` also where it passes by, or is at some height."""
    if not bounds and item.kind == "obj" and item.value == "pass":
        return None
    if bounds and item.kind == "Hq":
        return _bounded_part(item)
    return {"rest": REST, "there": THERE}.get(item.kind) or _part_of(item)


def _narrower(one: PathPart, other: PathPart) -> bool:
    """Whether a part is another one with its size: within 10 cm of the cup, near the cup."""
    return other.amount is None and one.amount is not None and replace(one, amount=None, unit=other.unit) == other


def joined(parts: Sequence[PathPart]) -> PathPart:
    """What belongs to all of the parts that a frame was given; near one thing and near another is near either."""
    plain = dict.fromkeys(replace(p, unit="waypoints") if p.amount is None else p for p in parts)
    kept = [p for p in plain if not any(_narrower(other, p) for other in plain)]
    around = [p for p in kept if p.kind == "near"]
    kept = [*([any_of(around)] if around else []), *(p for p in kept if p not in around)]
    return PathPart() if not kept else kept[0] if len(kept) == 1 else both(*kept)


def _bounded_part(item: Chunk) -> PathPart:
    """Where the path is above or below a height."""
    high = item.number.role == "at_least"
    return PathPart("beyond", amount=item.number.value * (1 if high else -1), direction="up" if high else "down")


def _part_of(item: Chunk) -> PathPart | None:
    if item.kind == "end" and not item.value[1]:
        return None
    turns = PathPart("turns")
    return {"turns": turns, "straights": outside(turns)}.get(item.kind) or as_part(item)


# What fills slots


def objects(*prepositions: str) -> Filler:
    """Objects with one of these prepositions ("" for none); all where none is given."""

    def fill(clause: Constituents) -> tuple[str, ...]:
        test = (lambda c: c.value in prepositions) if prepositions else None
        found = clause.every("obj", where=test) or [c for c in clause.items if c.kind == "within_of"]
        return tuple(dict.fromkeys(name for c in found for name in c.names))

    return fill


def pair(clause: Constituents) -> tuple[str, ...]:
    """Two objects with a gap between them."""
    found = clause.take("pair")
    return found.names if found else ()


def place_of_object(clause: Constituents) -> F.Place | None:
    """An object."""
    found = clause.take("obj")
    return found.names[0] if found else None


def place(*prepositions: str) -> Filler:
    """An object, an end, a waypoint, a share of the path or its middle."""

    def fill(clause: Constituents) -> F.Place | None:
        found = clause.take(
            "obj", "end", "point", "halfway",
            where=lambda c: c.kind != "obj" or not prepositions or c.value in prepositions,
        )  # fmt: skip
        if found is None:
            pivot = prepositions == ("around", "of", "at")
            found = (None if pivot else clause.take("Qpc", "half")) or clause.take(
                "part", where=lambda c: _is_place(c, prepositions)
            )
        return None if found is None else _place_of(found)

    return fill


def _is_place(item: Chunk, prepositions: tuple[str, ...]) -> bool:
    """Whether a part of the path stands for a point on it; the middle alone for what something turns about."""
    of: Any = item.value
    if prepositions == ("around", "of", "at"):
        return bool(of.kind == "middle" and of.amount is None)
    return (of.kind in ("middle", "first", "last") and of.amount is None) or of.kind == "after" or of.kind == "before"


def _place_of(found: Chunk) -> F.Place | None:
    match found.kind:
        case "obj":
            return found.names[0]
        case "end":
            end = found.value[0]
            return None if end == "ends" else str(end)
        case "point":
            return cast(F.Quantity, found.value)
        case "halfway":
            return "middle"
        case "Qpc":
            return replace(found.q, role="at") if found.q else None
        case "half":
            return F.Quantity(0.5, "%", "at")
    of: Any = found.value
    if of.kind in ("after", "before"):
        return str(of.places[0])
    return {"first": "start", "last": "goal"}.get(of.kind, "middle")


def amount(*kinds: str, role: str = "by") -> Filler:
    """A quantity of these classes, in a role."""
    implied = "m/s" if "Qv" in kinds else "m" if "Qm" in kinds else ""

    def fill(clause: Constituents) -> F.Quantity | None:
        q = clause.quantity(*kinds) or (clause.quantity("Qn", where=_small) if implied else None)
        if q is None:
            return _fraction(clause) if "Qpc" in kinds else None
        return replace(q, unit=q.unit or implied, role=cast(F.Role, role or q.role))

    return fill


def _small(item: Chunk) -> bool:
    """Whether a number without a unit can only be metres: 0.05."""
    return item.q is not None and (("." in item.text and item.q.value < 10) or item.q.value == 0)


def _fraction(clause: Constituents) -> F.Quantity | None:
    found = clause.take(*FRACTION)
    return None if found is None else F.Quantity(round(FRACTION[found.kind], 2), "%")


UPPER = ("max", "limit", "at_most", "vmax", "ceiling", "within")
LOWER = ("min", "at_least", "vmin", "floorlimit")
"""Classes of words that make a quantity an upper or a lower bound."""


def bounded(*kinds: str, default: str = "at_least") -> Filler:
    """A quantity with the role at_least or at_most, by the words beside it."""

    def fill(clause: Constituents) -> F.Quantity | None:
        q: F.Quantity | None = amount(*kinds, role="")(clause)
        if q is None:
            return None
        if q.role not in ("at_least", "at_most"):
            high, low = clause.has(*UPPER), clause.has(*LOWER)
            clause.every(*UPPER, *LOWER)
            role = "at_most" if high else "at_least" if low else default
            q = replace(q, role=cast(F.Role, role))
        return q

    return fill


def labelled(*kinds: str) -> Filler:
    """A quantity that a word beside it names: radius, size, turns."""

    def fill(clause: Constituents) -> F.Quantity | None:
        q = clause.quantity(*kinds, where=lambda c: c.q is not None)
        return None if q is None else replace(q, role="by", unit=q.unit or "m")

    return fill


def turns(clause: Constituents) -> F.Quantity | None:
    """How often: "twice", "3 laps", "one full circle"."""
    times = clause.worded({"once": 1.0, "double": 2.0, "triple": 3.0})
    if times is not None:
        return F.Quantity(times)
    q = clause.quantity("turns", "waves", "Qx", where=lambda c: c.q is not None) or clause.quantity("Qn")
    clause.every("times", "laps", "turns", "waves")
    return None if q is None else F.Quantity(q.value)


def offset(clause: Constituents) -> F.Offset:
    """Directions with their distances, in order."""
    found: list[tuple[Any, F.Quantity | None]] = []
    waiting: int | None = None  # a length that no direction has taken yet
    for i, item in enumerate(clause.items):
        if item.kind in DIRECTIONS or (item.kind == "axis_by" and i not in clause.used):
            clause.used.add(i)
            way = DIRECTIONS.get(item.kind) or item.value
            if way not in dict(found):
                found.append((way, item.q if waiting is None else _length(clause.items[waiting])))
            waiting = None
        elif i not in clause.used and _is_distance(item):
            clause.used.add(i)
            if found and _takes(found[-1], item, clause.items[i + 1 :]):
                found[-1] = (found[-1][0], _length(item))
            else:
                clause.used -= set() if waiting is None else {waiting}
                waiting = i
    left = None if waiting is None else clause.items[waiting]
    return ((found[0][0], _length(left)),) if left and _is_open(found) else tuple(found)


def _is_open(found: Sequence[tuple[Any, F.Quantity | None]]) -> bool:
    """Whether there is one direction, without a distance."""
    return len(found) == 1 and found[0][1] is None


def _takes(last: tuple[Any, F.Quantity | None], item: Chunk, behind: Sequence[Chunk]) -> bool:
    """Whether a distance belongs to the direction before it."""
    return last[1] is None and not (item.apart and _has_its_own(behind, last[0]))


def _has_its_own(behind: Sequence[Chunk], way: str) -> bool:
    """Whether behind a distance stands a direction of its own, and not the way before it: "up and 10 cm to the left"."""
    first = next((item for item in behind if item.kind != "to"), None)
    return first is not None and not first.apart and DIRECTIONS.get(first.kind, way) != way


def _is_distance(item: Chunk) -> bool:
    """Whether a constituent says how far something moves, not where to, nor a bound."""
    metres = item.kind == "Qm" or (item.kind == "Qn" and _small(item))
    return metres and item.number.role not in ("at_least", "at_most", "to")


def _length(item: Chunk) -> F.Quantity | None:
    if item.q is None:
        return None
    q = replace(item.q, unit="m", role="by")
    return replace(q, value=-q.value, said="") if item.value == "minus" else q


def direction(clause: Constituents) -> str | None:
    """A direction without a distance."""
    found = clause.take(*DIRECTIONS)
    clause.every("side")
    return None if found is None else DIRECTIONS[found.kind]


def sense(clause: Constituents) -> str | None:
    """Clockwise or counterclockwise."""
    found = clause.every("anticlockwise", "clockwise")
    return None if not found else "cw" if found[0].kind == "clockwise" else "ccw"


BARE_END = ("", "of", "from", "where", "on", "with", "for")


def end(*values: str) -> Filler:
    """Which end; not the ends that only say where."""

    def fill(clause: Constituents) -> str | None:
        found = clause.take("end", where=lambda c: c.value[1] in (values or BARE_END))
        return None if found is None else str(found.value[0])

    return fill


def share(clause: Constituents) -> F.Quantity | None:
    """A factor or a share: "half", "twice", "by 30 %", "1.5 times"."""
    times = clause.worded({"double": 2.0, "triple": 3.0, "halve": 0.5, "half_again": 1.5})
    if times is not None:
        clause.every("times")
        return F.Quantity(times, "x")
    return clause.quantity("Qx", "Qpc") or _fraction(clause)


def speed_amount(clause: Constituents) -> F.Quantity | None:
    """How much faster or slower."""
    q: F.Quantity | None = share(clause)
    found: Chunk | None = None
    if q is None:
        found = clause.take("Qv") or clause.take("Qn", where=_small)
        q = None if found is None or found.q is None else replace(found.q, unit="m/s")
    return q if q is None else replace(q, role="to" if q.role == "to" or _apposed(clause, found) else "by")


def _apposed(clause: Constituents, found: Chunk | None) -> bool:
    """Whether a speed stands behind "slower" without "by": what it is slowed to."""
    if found is None or found.kind != "Qv" or found.value in ("by", "plus", "minus"):
        return False
    return any(c.kind in ("slower", "creep") and c.span < found.span for c in clause.items)


def waypoints(clause: Constituents) -> F.Quantity | None:
    """A number of waypoints."""
    found = clause.take("Qn", "Qpc", "Qx")
    if found is None or found.q is None:
        return share(clause)
    said = {"plus": "+", "minus": "-"}.get(str(found.value), found.q.said)
    role = cast(F.Role, "by" if found.q.role == "at" else found.q.role)
    return replace(found.q, unit=found.q.unit or "waypoints", role=role, said=said)


def level(clause: Constituents) -> F.Quantity | None:
    """A bound on the height, or a height to come to."""
    if bound := clause.quantity("Hq"):
        return bound
    roles = {"ceiling": "at_most", "floorlimit": "at_least"}
    taken = [role for kind, role in roles.items() if clause.take(kind)]
    q: F.Quantity | None = bounded("Qm", default=(*taken, "to")[0])(clause)
    return q


def angle(clause: Constituents) -> F.Quantity | None:
    """How far to turn."""
    if q := clause.quantity("Qdeg"):
        return replace(q, role="by")
    part = clause.worded({"quarter": 90.0, "half": 180.0})
    return None if part is None else F.Quantity(part, "deg")


def count(clause: Constituents) -> F.Quantity | None:
    """How many are put together."""
    if q := clause.quantity("Qn"):
        return replace(q, unit="", role="by")
    part = clause.take("part", where=lambda c: getattr(c.value, "kind", "") == "every")
    return None if part is None else F.Quantity(float(part.value.amount))


def quadrant(clause: Constituents) -> int | None:
    """Which quadrant."""
    if q := clause.quantity("Qn"):
        return int(q.value)
    if second := clause.take("unknown", where=lambda c: c.text.lower() in COUNTED):
        return COUNTED[second.text.lower()]
    number = clause.worded({"1st": 1, "first": 1, "second": 2, "secondhalf": 2, "third": 3, "quarter": 4})
    return None if number is None else int(number)


LIMITING = frozenset(
    """never not no don't dont can't cannot mustn't max maximum most limit limited always throughout whole entire along
    any everywhere keep stay remain kept staying keeping farther further exceed hug""".split()
)
"""Words with which a greatest distance is one that holds all along: "stay within 30 cm", not "come within 30 cm"."""

NEGATIONS = frozenset("never not no don't dont can't cannot mustn't".split())
"""Those of them that may deny something else."""

COMPARED_TO = frozenset("than more further farther beyond exceed".split())
"""Words with which a negation is about the distance: "not more than 30 cm away"."""

TOUCHES = frozenset("touch touching hit hitting bump bumping knock knocking brush scratch".split())
"""Words for what a negation may deny beside a distance: "come within 10 cm, but don't touch it"."""


ALWAYS = frozenset(
    "never not don't always throughout whole entire everywhere stay stays staying remain remaining".split()
)
"""Words with which all of a path stays on one side of an object."""


def held_along(frame: F.SemanticFrame, words: Collection[str]) -> F.SemanticFrame:
    """A greatest distance, or a side to stay on, as one that holds all along, where the words around it say so."""
    if isinstance(frame, F.Side) and {frame.direction, F.OPPOSITES.get(frame.direction)} <= {*words}:
        return frame  # "on the left, not on the right"
    if isinstance(frame, F.Side) and (not ALWAYS.isdisjoint(words) or ("keep" in words and "on" not in words)):
        return replace(frame, along=True)
    only_touch = not TOUCHES.isdisjoint(words) and COMPARED_TO.isdisjoint(words)
    limiting = LIMITING - (NEGATIONS if only_touch else frozenset())
    if isinstance(frame, F.Clearance) and frame.distance.role == "at_most" and not limiting.isdisjoint(words):
        return replace(frame, along=True)
    return frame
