"""Typed frames: what a sentence asks for, as data, before any of it becomes code.

A reader makes frames, a dialogue edits them, `realise` turns them into a policy, and an adaptation keeps them.
Quantities are in SI units; directions are words of the scene's frame; objects go by their scene names.
`notation` prints and reads them as text.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar, Literal, TypeAlias

from ovita.instruct.degrees import Degree
from ovita.paths.part import WHOLE, PathPart

Span: TypeAlias = tuple[int, int]
"""First character and one past the last of a phrase in the utterance."""

Direction = Literal["left", "right", "front", "back", "up", "down", "x", "-x", "y", "-y", "z", "-z"]
OPPOSITES: dict[str, Direction] = {
    "left": "right", "right": "left", "front": "back", "back": "front", "up": "down", "down": "up",
    "x": "-x", "-x": "x", "y": "-y", "-y": "y", "z": "-z", "-z": "z",
}  # fmt: skip
"""Each direction's opposite."""

Role = Literal["by", "to", "at", "at_least", "at_most", "of"]
End = Literal["start", "goal", "ends"]
Sense = Literal["cw", "ccw"]
Axis = Literal["left", "front", "up", "x", "y", "z"]
Aim = Literal["", "top", "surface", "beside", "above", "below", "behind", "short"]
"""Where at an object a path ends, passes or waits: "" its centre, the usual; "top" right on top of it; "surface" where
it is nearest to the path, so that it is touched; "beside" a little off the side that faces the path; "short" a little
before it on the way; "above", "below" and "behind" a little off it in that direction."""


@dataclass(frozen=True)
class Quantity:
    """A number with its unit and the role that it plays.

    Args:
        value: In `unit`; angles in degrees, shares and percentages as fractions (30 % is 0.3).
        unit: SI dimension as in `ovita.units` ("m", "m/s", "m/s2", "s", "deg", "%", "x", "step"), "waypoints",
            "turns", or "" where the sentence names none.
        role: A change by it, a target, a bound, or a share of something.
        said: As the person gave it, such as "10cm"; "" where it was worked out.
    """

    value: float
    unit: str = ""
    role: Role = "by"
    said: str = field(default="", compare=False)


Place: TypeAlias = "str | Quantity | tuple[str, str]"
"""An object's name, "start", "goal" or "middle"; a waypoint (from 1) or a share of the path; the midpoint of two
objects."""

SPOTS = ("start", "goal", "middle")
PLACES = ("place", "about", "of")
"""Places that every path has, and the slots that hold a place."""

MAIN = ("amount", "distance", "by", "level", "angle")
"""Slots that say how much of what a frame asks for; of an end, which has two, `by` comes first."""

Offset: TypeAlias = tuple[tuple[Direction, Quantity | None], ...]
"""Directions, each with its distance, or None where the sentence leaves it open."""


def _in(*units: str) -> Mapping[str, tuple[str, ...]]:
    """What a slot for a quantity is measured in, the unit of a number without one first."""
    return {"units": units}


@dataclass(frozen=True, kw_only=True)
class SemanticFrame:
    """One thing that a sentence asks for.

    Args:
        part: Which part of the path it is about.
        degree: "slight" or "large" where a word says so and no number does.
        words: The phrases of the utterance that it was read from.
    """

    NAME: ClassVar[str] = ""
    part: PathPart = WHOLE
    degree: Degree | None = None
    words: tuple[Span, ...] = field(default=(), compare=False)

    @property
    def quantities(self) -> dict[str, Quantity]:
        """The quantities that the frame holds, by slot: the field's name, or a direction of its offset."""
        found: dict[str, Quantity] = {}
        for slot in fields(self):
            value: Any = getattr(self, slot.name)
            if isinstance(value, Quantity):
                found[slot.name] = value
            elif slot.name == "offset":
                found |= {direction: quantity for direction, quantity in value if quantity is not None}
        return found

    @property
    def named(self) -> tuple[str, ...]:
        """The objects that the frame is about, those of its part of the path included."""
        found: list[str] = []
        for slot in fields(self):
            value: Any = getattr(self, slot.name)
            if slot.name == "objects":
                found += value
            elif slot.name in PLACES:
                found += value if isinstance(value, tuple) else [value] if isinstance(value, str) else []
        found += _of_part(self.part)
        return tuple(dict.fromkeys(name for name in found if name not in ("", *SPOTS)))


def _of_part(part: PathPart) -> list[str]:
    inner = [name for inner in part.parts for name in _of_part(inner)]
    return [place for place in part.places if isinstance(place, str)] + inner


@dataclass(frozen=True, kw_only=True)
class Shift(SemanticFrame):
    """Shift the path or a part of it."""

    NAME = "move"
    offset: Offset


@dataclass(frozen=True, kw_only=True)
class MoveEnd(SemanticFrame):
    """Shift an end of the path, bring it to, toward or away from a place, or to a height above the ground (`level`)."""

    NAME = "end"
    end: End
    offset: Offset = ()
    relation: Literal["", "to", "toward", "away"] = ""
    place: Place = ""
    by: Quantity | None = field(default=None, metadata=_in("m", ""))
    level: Quantity | None = field(default=None, metadata=_in("m", ""))
    aim: Aim = ""


@dataclass(frozen=True, kw_only=True)
class Approach(SemanticFrame):
    """Pass nearer to objects, or farther from them; a `by` in "x" or "%" is of the distance."""

    NAME = "closer"
    sense: Literal["closer", "farther"]
    objects: tuple[str, ...]
    by: Quantity | None = field(default=None, metadata=_in("m", "%", "x", "step", ""))


@dataclass(frozen=True, kw_only=True)
class Clearance(SemanticFrame):
    """Keep a distance to objects; its role is at_least, at_most or at. At least 0 m is to pass clear of them.

    `along` says that "at most" holds all along, and not only where the path comes nearest.
    """

    NAME = "clearance"
    objects: tuple[str, ...]
    distance: Quantity = field(metadata=_in("m", "step", ""))
    along: bool = False


@dataclass(frozen=True, kw_only=True)
class Visit(SemanticFrame):
    """Visit objects in their order, pass between two, over one (closely, if slight) or under one (by so much)."""

    NAME = "via"
    objects: tuple[str, ...]
    relation: Literal["at", "between", "over", "under"] = "at"
    by: Quantity | None = field(default=None, metadata=_in("m", ""))
    aim: Aim = ""


@dataclass(frozen=True, kw_only=True)
class Avoid(SemanticFrame):
    """Pass neither over objects, nor under them, or not between two."""

    NAME = "avoid"
    objects: tuple[str, ...]
    relation: Literal["over", "under", "between"]


@dataclass(frozen=True, kw_only=True)
class Side(SemanticFrame):
    """Pass an object on one side of it, so far from its side, or on the other side than now.

    With `along`, the path stays there.
    """

    NAME = "side"
    objects: tuple[str, ...]
    direction: Direction | Literal["other"]
    by: Quantity | None = field(default=None, metadata=_in("m"))
    along: bool = False


@dataclass(frozen=True, kw_only=True)
class Pace(SemanticFrame):
    """Change the speed: by a factor, an amount, to a value, within a bound, or along a law.

    `amount` has the role by, to, at_least ("floor") or at_most ("cap"); for "accelerate" it is in m/s2. In "s" it is
    the time that the way takes, standing still left out.
    """

    NAME = "pace"
    change: Literal["faster", "slower", "set", "cap", "floor", "constant", "rampup", "rampdown", "turns", "accelerate"]
    amount: Quantity | None = field(default=None, metadata=_in("m/s", "%", "x", "m/s2", "s", ""))

    @property
    def factor(self) -> float | None:
        """The factor on the speed that a share or a multiple amounts to, or None."""
        q = self.amount
        if q is None or q.unit not in ("x", "%") or self.change not in ("faster", "slower", "set"):
            return None
        if q.role == "to" or self.change == "set":
            return q.value
        if q.unit == "x":
            return 1 / q.value if self.change == "slower" and q.value > 1 else q.value
        return 1 - q.value if self.change == "slower" else 1 + q.value


@dataclass(frozen=True, kw_only=True)
class Keep(SemanticFrame):
    """Leave something as it is; "part" is the part of the path."""

    NAME = "keep"
    what: Literal["start", "goal", "ends", "speed", "path", "height", "rest", "part"]


@dataclass(frozen=True, kw_only=True)
class StopAt(SemanticFrame):
    """Come to rest at a place, or so far before an object, and end there."""

    NAME = "stop"
    place: Place = ""
    by: Quantity | None = field(default=None, metadata=_in("m", ""))
    aim: Aim = ""


@dataclass(frozen=True, kw_only=True)
class Wait(SemanticFrame):
    """Stand still at a place, or so far before an object, then go on; `longer` than the path stands there already."""

    NAME = "wait"
    place: Place = ""
    by: Quantity | None = field(default=None, metadata=_in("m", ""))
    duration: Quantity | None = field(default=None, metadata=_in("s", ""))
    longer: bool = False
    aim: Aim = ""


@dataclass(frozen=True, kw_only=True)
class NoStop(SemanticFrame):
    """Make no stop between the ends of the path."""

    NAME = "nonstop"


@dataclass(frozen=True, kw_only=True)
class Extend(SemanticFrame):
    """Go on beyond the goal: by a length (back along the path if < 0), in a direction, or to a place."""

    NAME = "extend"
    by: Quantity | None = field(default=None, metadata=_in("m", "s", "%", "waypoints", ""))
    offset: Offset = ()
    place: Place = ""
    aim: Aim = ""


@dataclass(frozen=True, kw_only=True)
class Smooth(SemanticFrame):
    """Fewer kinks, less jitter."""

    NAME = "smooth"


@dataclass(frozen=True, kw_only=True)
class Resample(SemanticFrame):
    """Another number of waypoints: to so many, by so many or a factor, more, fewer, or averages of k."""

    NAME = "waypoints"
    change: Literal["to", "by", "more", "fewer", "merge"]
    amount: Quantity | None = field(default=None, metadata=_in("waypoints", "", "%", "x"))


@dataclass(frozen=True, kw_only=True)
class Figure(SemanticFrame):
    """A figure on the way: a circle around an object, or a spiral, eight, zigzag, wave or shaking at a place.

    A wave or zigzag goes to each side, `upright` up and down.
    """

    NAME = "circle"
    shape: Literal["circle", "spiral", "eight", "zigzag", "wave", "shake"]
    place: Place = ""
    radius: Quantity | None = field(default=None, metadata=_in("m", ""))
    size: Quantity | None = field(default=None, metadata=_in("m", ""))
    turns: Quantity | None = field(default=None, metadata=_in("turns", ""))
    waves: Quantity | None = field(default=None, metadata=_in("turns", ""))
    rise: Quantity | None = field(default=None, metadata=_in("m", ""))
    sense: Sense | None = None
    upright: bool = False


@dataclass(frozen=True, kw_only=True)
class Hop(SemanticFrame):
    """Jump over an object."""

    NAME = "hop"
    objects: tuple[str, ...]
    by: Quantity | None = field(default=None, metadata=_in("m", ""))


@dataclass(frozen=True, kw_only=True)
class Hover(SemanticFrame):
    """Wait above an object."""

    NAME = "hover"
    objects: tuple[str, ...]
    by: Quantity | None = field(default=None, metadata=_in("m", ""))
    duration: Quantity | None = field(default=None, metadata=_in("s", ""))


@dataclass(frozen=True, kw_only=True)
class Mirror(SemanticFrame):
    """Swap left and right, front and back, or up and down."""

    NAME = "mirror"
    axis: Axis
    about: Place = ""


@dataclass(frozen=True, kw_only=True)
class Rotate(SemanticFrame):
    """Turn the path about the vertical."""

    NAME = "rotate"
    angle: Quantity | None = field(default=None, metadata=_in("deg", ""))
    about: Place = ""
    sense: Sense | None = None


@dataclass(frozen=True, kw_only=True)
class Tilt(SemanticFrame):
    """Lift the path on one side."""

    NAME = "tilt"
    direction: Direction
    angle: Quantity | None = field(default=None, metadata=_in("deg", ""))


@dataclass(frozen=True, kw_only=True)
class Resize(SemanticFrame):
    """Make the path larger or smaller as a whole."""

    NAME = "resize"
    change: Literal["", "larger", "smaller"] = ""
    by: Quantity | None = field(default=None, metadata=_in("x", "%", ""))
    about: Place = ""


@dataclass(frozen=True, kw_only=True)
class Curve(SemanticFrame):
    """Bend the path more or less."""

    NAME = "curve"
    change: Literal["more", "less"]


@dataclass(frozen=True, kw_only=True)
class Straighten(SemanticFrame):
    """Go straight."""

    NAME = "straighten"


@dataclass(frozen=True, kw_only=True)
class Height(SemanticFrame):
    """Come to a height above the ground or an object's centre, or stay above or below one (to, at_least, at_most)."""

    NAME = "height"
    level: Quantity = field(metadata=_in("m", ""))
    of: Place = ""


@dataclass(frozen=True, kw_only=True)
class OneHeight(SemanticFrame):
    """Go at one height."""

    NAME = "level"


@dataclass(frozen=True, kw_only=True)
class Bound(SemanticFrame):
    """Stay within a distance to one side of the origin or of an object."""

    NAME = "bound"
    offset: Offset
    of: Place = ""


@dataclass(frozen=True, kw_only=True)
class Reverse(SemanticFrame):
    """Run the path backwards."""

    NAME = "reverse"


@dataclass(frozen=True, kw_only=True)
class Arrive(SemanticFrame):
    """Reach the goal straight from a direction, over the last so much; `place` is an object that is there."""

    NAME = "arrive"
    direction: Direction
    by: Quantity | None = field(default=None, metadata=_in("m", ""))
    place: Place = ""


@dataclass(frozen=True, kw_only=True)
class Return(SemanticFrame):
    """Come back to the start at the end."""

    NAME = "return"


@dataclass(frozen=True, kw_only=True)
class Trim(SemanticFrame):
    """Cut off the first or last so much, or what comes before or after a place."""

    NAME = "trim"
    cut: Literal["first", "last", "before", "after"]
    amount: Quantity | None = field(default=None, metadata=_in("waypoints", "%", "m", "s", ""))
    place: Place = ""


@dataclass(frozen=True, kw_only=True)
class Quadrant(SemanticFrame):
    """Bring the path into a quadrant of the plane (1 to 4)."""

    NAME = "quadrant"
    number: int


@dataclass(frozen=True)
class Reading:
    """What a reader made of an utterance.

    Args:
        frames: What it asks for, in the order of the sentence.
        edits: What it changes about the frames of earlier turns (`instruct.edits`), in order.
        unread: Content words that no frame was read from.
        question: What has to be asked back, or "".
        improper: Why there is nothing that a path could do about it, or "".
        confidence: How likely all of it is meant (0..1).
        notes: What was corrected or assumed on the way, for people.
        asked: Where the question has alternatives, what could be meant.
        asks: Whether it is a question about the path, which wants nothing changed.
        besides: What is said of a wish beside the others that no frame can say, or "".
    """

    frames: tuple[SemanticFrame, ...] = ()
    edits: tuple[Any, ...] = ()
    unread: tuple[str, ...] = ()
    question: str = ""
    improper: str = ""
    confidence: float = 1.0
    notes: tuple[str, ...] = ()
    asked: tuple[str, ...] = ()
    asks: bool = False
    besides: str = ""


AIMED = (MoveEnd, Visit, StopAt, Wait, Extend)
"""Frames that may aim at an object's top or surface, or beside it."""


def tells_height(frame: SemanticFrame) -> bool:
    """Whether a frame says how high the path is to be."""
    risen = isinstance(frame, Shift) and any(direction in ("up", "down") for direction, _ in frame.offset)
    kept = isinstance(frame, Keep) and frame.what == "height"
    return risen or kept or isinstance(frame, Height | OneHeight)


def unaimed(frame: SemanticFrame) -> SemanticFrame:
    """A frame about its objects as a whole, without what the words alone decide."""
    frame = replace(frame, longer=False) if isinstance(frame, Wait) else frame
    return replace(frame, aim="") if isinstance(frame, AIMED) else frame


def with_selection(frames: Sequence[SemanticFrame], selection: PathPart) -> tuple[SemanticFrame, ...]:
    """Frames whose "here" is a part of the path that was marked by hand."""
    return tuple(replace(frame, part=_selected(frame.part, selection)) for frame in frames)


def _selected(part: PathPart, selection: PathPart) -> PathPart:
    if part.kind == "indices" and not part.ranges:
        return selection
    return replace(part, parts=tuple(_selected(inner, selection) for inner in part.parts))


def frame_objects(frame: SemanticFrame) -> list[str]:
    """The objects that a frame or its part of the path is about."""
    parts = (frame.part, *frame.part.parts, *(inner for part in frame.part.parts for inner in part.parts))
    return [*frame.named, *(place for part in parts for place in part.places if isinstance(place, str))]


def held_by(frame: SemanticFrame) -> set[float]:
    """The numbers that a frame holds, in SI, also as shares, diameters, counts from 1 and means of two."""
    amounts = frame.quantities.values()
    found = [q.value for q in amounts] + _held_by_part(frame.part)
    if isinstance(frame, Quadrant):
        found.append(float(frame.number))
    if isinstance(frame, Figure) and frame.radius is not None:
        found.append(2.0 * frame.radius.value)
    if getattr(frame, "change", "") == "rampdown" and not frame.part:
        found.append(0.0)  # "slow down to zero"
    shares = {1.0 / q.value for q in amounts if q.unit in ("x", "%") and q.value}
    return shares.union(*((value, -value, 1 - value, 1 + value) for value in found))


def _held_by_part(part: PathPart) -> list[float]:
    own = [value for value in (part.amount, part.until) if value is not None]
    own += [p.value for p in part.places if isinstance(p, Quantity)]
    return own + [value for inner in part.parts for value in _held_by_part(inner)]


CALLED = {Approach: "sense", Figure: "shape"}
"""Frames that the notation calls by one of their slots."""


def name_of(frame: SemanticFrame) -> str:
    """The notation's name of a frame, such as "farther" or "spiral"."""
    name: str = getattr(frame, CALLED.get(type(frame), "NAME"))
    return name


def to_json(frames: Sequence[SemanticFrame]) -> list[dict[str, Any]]:
    """Frames as JSON documents, which `from_json` reads; slots that are left open are left out."""
    return [{"frame": type(frame).__name__, **_json(frame)} for frame in frames]


def _json(value: Any) -> Any:
    if isinstance(value, SemanticFrame | Quantity | PathPart):
        said = {slot.name: (getattr(value, slot.name), slot.default) for slot in fields(value) if slot.name != "words"}
        return {name: _json(slot) for name, (slot, default) in said.items() if slot != default}
    return [_json(inner) for inner in value] if isinstance(value, tuple) else value


def from_json(documents: Sequence[Mapping[str, Any]]) -> tuple[SemanticFrame, ...]:
    """The frames that `to_json` wrote.

    Raises:
        ValueError: If a document describes no frame.
    """
    kinds = {kind.__name__: kind for kind in SemanticFrame.__subclasses__()}
    try:
        found = []
        for document in documents:
            slots = {name: _read(name, value) for name, value in document.items() if name != "frame"}
            found.append(kinds[document["frame"]](**slots))
        return tuple(found)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise ValueError(f"this is no frame: {error}") from None


def _read(name: str, value: Any) -> Any:
    if name == "part":
        parts = tuple(_read("part", inner) for inner in value.get("parts", ()))
        ranges = tuple((int(first), int(last)) for first, last in value.get("ranges", ()))
        return PathPart(**{**value, "places": tuple(value.get("places", ())), "parts": parts, "ranges": ranges})
    if isinstance(value, Mapping):
        return Quantity(**{**value, "value": float(value["value"])})
    return tuple(_read("", inner) for inner in value) if isinstance(value, list) else value
