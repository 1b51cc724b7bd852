"""What speaks against a reading: plain facts of the utterance that the frames do not bear out.

Numbers, objects, directions, negations and bounds that are said have to be found in what is read; each check says, as a
sentence, which is not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields
from functools import lru_cache
from itertools import pairwise

from ovita.instruct import frames as F
from ovita.instruct.chunks import Chunk
from ovita.instruct.lexicon import CENTI, DETERMINERS, FAR, FRACTIONS
from ovita.instruct.rules import PAUSES, constituents, turned
from ovita.instruct.together import MEASURED, UNMEASURED, unit_of
from ovita.paths.part import WHOLE, PathPart
from ovita.text import quoted

Check = Callable[[Sequence[Chunk], frozenset[str], tuple[F.SemanticFrame, ...]], str]
"""A check of an utterance, its classes of words, and what was read: a sentence, or "" where it finds nothing."""

UNKNOWN = frozenset("unknown filler comma dot and".split())
"""Classes of chunks that say nothing: what a reader sees in them alone is a guess."""

OPPOSED = {
    "left": {"left"}, "right": {"right"}, "front": {"front"}, "back": {"back"},
    "up": {"up", "raise", "over", "rising", "height"}, "down": {"down", "lower", "under", "falling", "height"},
    "closer": {"closer", "near", "toward", "touch", "at_most", "within", "distance", "gap"},
    "farther": {"farther", "from", "at_least", "distance", "gap", "avoid", "withdraw"},
    "faster": {"faster", "inc", "double", "triple"}, "slower": {"slower", "dec", "halve", "half", "brake"},
    "larger": {"larger", "inc", "double", "triple"}, "smaller": {"smaller", "dec", "halve", "half"},
    "more": {"more_curve", "larger", "inc"}, "less": {"less_curve", "smaller", "straight", "dec"},
    "cw": {"clockwise", "right"}, "ccw": {"anticlockwise", "left"},
}  # fmt: skip
"""What a frame may hold, and the classes of words that ask for it."""

PAIRS = (
    ("left", "right"), ("front", "back"), ("up", "down"), ("closer", "farther"), ("faster", "slower"),
    ("larger", "smaller"), ("more", "less"), ("cw", "ccw"),
)  # fmt: skip
_OTHER = {a: b for pair in PAIRS for a, b in (pair, pair[::-1])}
UPPER = frozenset("at_most max limit vmax ceiling".split())
LOWER = frozenset("at_least min vmin floorlimit".split())
RISING = frozenset("up raise over farther faster larger inc".split())
FALLING = frozenset("down lower under closer slower smaller dec".split())
NOT = frozenset("never clear avoid too".split()) | UPPER
"""What may turn a comparison round: "never higher than"."""
BOUNDS = ("at_least", "at_most")


def contradictions(
    said: Sequence[Chunk], frames: Iterable[F.SemanticFrame], checks: Sequence[Check] | None = None
) -> tuple[str, ...]:
    """What the words say and a reading does not account for, or says otherwise, as sentences for people."""
    frames = tuple(frames)
    kinds = frozenset(chunk.kind for chunk in said) | frozenset(chunk.kind for chunk in _flipped(tuple(said)))
    return tuple(text for check in checks or CHECKS if (text := check(said, kinds, frames)))


@lru_cache(maxsize=16)
def _flipped(said: tuple[Chunk, ...]) -> tuple[Chunk, ...]:
    return tuple(turned(said))


def _turned(said: Sequence[Chunk], kinds: frozenset[str], frames: tuple[F.SemanticFrame, ...]) -> str:
    """Left is read where only right is said, slower where only faster is."""
    held = {sense for frame in frames for sense in _senses(frame)}
    for sense in sorted(held):
        other = _OTHER[sense]
        if kinds & OPPOSED[other] - OPPOSED[sense] and not kinds & OPPOSED[sense] and other not in held:
            return f"It is read as {sense!r}, but says {_said(said, OPPOSED[other])}."
    return ""


def _negated(said: Sequence[Chunk], kinds: frozenset[str], frames: tuple[F.SemanticFrame, ...]) -> str:
    """A "not" that no frame comes from."""
    held = {sense for frame in frames for sense in _senses(frame)}
    if any(OPPOSED.get(sense, set()) & {chunk.kind for chunk in _flipped(tuple(said))} for sense in held):
        return ""
    plain = frozenset(chunk.kind for chunk in said)  # "too fast" counts as fast
    if kinds & {"never", "clear"} and not any(_limits(frame, plain) for frame in frames):
        denied = [clause for clause in clauses(said) if {c.kind for c in clause} & {"never", "clear"}]
        if not frames or not denied or not all(elsewhere(frame, denied) for frame in frames):
            return f"{_said(said, {'never'} & kinds or {'keep'})} turns round what it belongs to."
    return ""


def clauses(said: Sequence[Chunk]) -> list[list[Chunk]]:
    """The chunks between pauses."""
    found: list[list[Chunk]] = [[]]
    for chunk in said:
        found += [[]] if chunk.kind in PAUSES else []
        found[-1].append(chunk)
    return [clause for clause in found if clause]


def elsewhere(frame: F.SemanticFrame, clauses: Sequence[Sequence[Chunk]], *, wholly: bool = False) -> bool:
    """Whether a frame was read from words outside of some clauses, or wholly so: "pass behind it, never in front"."""
    spans = [(clause[0].span[0], clause[-1].span[1]) for clause in clauses]
    outside = [not any(low < end and begin < high for low, high in spans) for begin, end in frame.words]
    return bool(outside) and (all if wholly else any)(outside)


def _unbounded(said: Sequence[Chunk], kinds: frozenset[str], frames: tuple[F.SemanticFrame, ...]) -> str:
    """A "maximum" or "at least" that is read as something else."""
    roles: set[str] = {q.role for frame in frames for q in frame.quantities.values()}
    roles |= {{"cap": "at_most", "floor": "at_least"}.get(str(getattr(frame, "change", "")), "") for frame in frames}
    bound = any(isinstance(frame, F.Bound | F.Figure) for frame in frames)  # "a radius of at most 1 m" is 1 m
    for words, role, wrong in ((UPPER, "at_most", "at_least"), (LOWER, "at_least", "at_most")):
        turned_round = "never" in kinds and wrong in roles
        if (
            kinds & words
            and not (bound or turned_round)
            and role not in roles
            and (wrong in roles or roles & {"by", "to", "at"})
        ):
            return f"{_said(said, words)} asks for a limit that the reading does not have."
    return ""


def _compared(said: Sequence[Chunk], kinds: frozenset[str], frames: tuple[F.SemanticFrame, ...]) -> str:
    """A bound on the other side than a comparison puts it: "higher than 30 cm" as at most 30 cm."""
    if kinds & NOT:
        return ""
    row = [chunk for chunk in said if chunk.kind not in ("filler", "approx")]
    for word, than, amount in zip(row, row[1:], row[2:] + row[-1:], strict=False):
        q = than.q if word.kind in ("over", "under") and than.q is not None else amount.q
        wrong = "at_most" if word.kind in RISING else "at_least" if word.kind in FALLING else ""
        if q is None or not wrong or not (than.kind == "than" or than.q is q):
            continue
        held = [one.value for frame in frames for one in frame.quantities.values() if one.role == wrong]
        if any(_near(q.value, value) for value in held):
            return f"{word.text!r} {q.said or amount.text} is a bound on the other side."
    return ""


def _bounded_otherwise(said: Sequence[Chunk], kinds: frozenset[str], frames: tuple[F.SemanticFrame, ...]) -> str:
    """A bound on the other side than a denial puts it: "not within 30 cm" as at most 30 cm."""
    bounds = [(q.role, q.value) for frame in frames for q in frame.quantities.values() if q.role in BOUNDS]
    for chunk in constituents(said) if bounds and "never" in kinds else ():
        if chunk.q is not None and chunk.q.role in BOUNDS and (chunk.q.role, chunk.q.value) not in bounds:
            if any(_near(chunk.q.value, value) for role, value in bounds if role != chunk.q.role):
                return f"{chunk.text!r} is a bound on the other side."
    return ""


def _number_left(said: Sequence[Chunk], kinds: frozenset[str], frames: tuple[F.SemanticFrame, ...]) -> str:
    """A number that no slot took; "one" alone may be somebody, and the eight a figure."""
    names = {"one", *(f.shape for f in frames if isinstance(f, F.Figure))}
    held = {value for frame in frames for value in _values(frame)}
    ranged = [c for one, to, other in zip(said, said[1:], said[2:], strict=False) if to.kind in ("to", "and")
              for c in (one, other) if any(_near(v, mean) for v in held for mean in _means(one, other))]  # fmt: skip
    for k, chunk in enumerate(said):
        units = (1.0, CENTI, *filter(None, map(unit_of, said))) if chunk.kind == "Qn" else (1.0,)
        counts = chunk.q is not None and not (chunk.kind == "Qn" and chunk.text.lower() in names)
        amounts = _amounts(chunk.q.value, said[k + 1 : k + 5]) if chunk.q is not None and counts else ()
        means = [value * unit for value in amounts for unit in units]
        if means and not any(_near(v, value) for v in held for value in means) and chunk not in ranged:
            return f"{chunk.text!r} has no place in it."
    return ""


def _amounts(value: float, behind: Sequence[Chunk]) -> tuple[float, ...]:
    """What a number may come to with the words behind it: "a metre and a half", "three-quarter", "seven tenths"."""
    words = " ".join(chunk.text.lower() for chunk in behind).replace("-", " ").split()
    share = FRACTIONS.get(words[0], FRACTIONS.get(words[0].removesuffix("s"), 1.0)) if words else 1.0
    return value, value * (1.5 if words[:3] == ["and", "a", "half"] else share)


def _near(one: float, other: float) -> bool:
    return abs(one - other) <= 1e-6 + 0.02 * abs(one)


def _means(one: Chunk, other: Chunk) -> list[float]:
    """What lies between two numbers, the first in its own unit or in that of the second: "30-32 cm"."""
    if one.q is None or other.q is None:
        return []
    return [(one.q.value * scale + other.q.value) / 2 for scale in ((1.0,) if one.q.unit else (1.0, 0.01, 0.001))]


def _object_left(said: Sequence[Chunk], kinds: frozenset[str], frames: tuple[F.SemanticFrame, ...]) -> str:
    """An object that no frame is about."""
    named = {name for frame in frames for name in frame.named}
    for chunk in said:
        if chunk.kind == "OBJ" and not named.intersection(chunk.names):
            return f"{chunk.text!r} has no part in it."
    return ""


def _conditional(said: Sequence[Chunk], kinds: frozenset[str], frames: tuple[F.SemanticFrame, ...]) -> str:
    """A condition, which no frame can hold."""
    words = " ".join(chunk.text.lower() for chunk in said).split()
    for before, word, after in zip(["", *words], words, [*words[1:], ""], strict=False):
        if word == "unless" or (word == "if" and after not in COURTESY and before not in WISHING):
            return f"{word!r} sets a condition, and it would be done always."
    return ""


def _two_waypoints(said: Sequence[Chunk], kinds: frozenset[str], frames: tuple[F.SemanticFrame, ...]) -> str:
    """Two single waypoints that are read as all from one to the other."""
    if not any(frame.part.kind == "range" for frame in frames) or kinds & {"between", "from"}:
        return ""
    row = [chunk for chunk in said if chunk.kind not in ("filler", "waypoints")]
    for one, link, other in zip(row, row[1:], row[2:], strict=False):
        if (one.kind, link.kind, other.kind) == ("Qn", "and", "Qn"):
            return f"{one.text!r} and {other.text!r} are two waypoints, not a range."
    return ""


def _by_for_to(said: Sequence[Chunk], kinds: frozenset[str], frames: tuple[F.SemanticFrame, ...]) -> str:
    """A "to 10 cm" that is read as so much more or less, or a "by 10 cm" that is read as a height."""
    heights = [f.level.value for f in frames if isinstance(f, F.Height) and f.level.role == "to"]
    for by, chunk in pairwise(said):
        if by.text.lower() == "by" and chunk.q is not None and any(_near(one, chunk.q.value) for one in heights):
            return f"'by {chunk.text}' is read as a height."
    steps = [f.by.value for f in frames if isinstance(f, F.Approach) and f.by is not None and f.by.unit == "m"]
    for before, to, chunk in zip([None, *said], said, said[1:], strict=False):
        after_number = before is not None and before.q is not None  # "5 to 10 cm"
        if to.text.lower() == "to" and chunk.q is not None and not after_number:
            if any(_near(step, chunk.q.value) for step in steps):
                return f"'to {chunk.text}' is read as by how much."
    return ""


def _kept_for_farther(said: Sequence[Chunk], kinds: frozenset[str], frames: tuple[F.SemanticFrame, ...]) -> str:
    """A distance that is to be kept ("stay 20 cm away from it"), read as so much farther than before."""
    more = [f.by.value for f in frames if isinstance(f, F.Approach) and f.sense == "farther" and f.by is not None]
    row = [chunk for chunk in said if chunk.kind not in ("filler", "approx")]
    for keep, chunk, away in zip(row, row[1:], row[2:], strict=False):
        if keep.kind == "keep" and chunk.q is not None and away.kind in ("from", "farther"):
            if any(_near(value, chunk.q.value * unit) for value in more for unit in (1.0, CENTI)):
                return f"'{keep.text} {chunk.text} {away.text}' is a distance to keep."
    return ""


COURTESY = frozenset("you i we possible need needed necessary anything at so".split())
"""What follows an "if" that is mere politeness."""

WISHING = frozenset("what glad happy happier better obliged grateful nice nicer lovely great good".split())
"""What is before an "if" that is: "I would be glad if"."""


def _once_near(said: Sequence[Chunk], kinds: frozenset[str], frames: tuple[F.SemanticFrame, ...]) -> str:
    """What is to hold all along, a greatest distance or a side that is kept to, read as so for once."""
    words = {"never", "max"} if any(map(_met_once, frames)) else {"keep"} if any(map(_passed_once, frames)) else set()
    if kinds & words:
        return f"{_said(said, words)} asks for it all along, not only where the path comes nearest."
    return ""


def _anywhere(said: Sequence[Chunk], kinds: frozenset[str], frames: tuple[F.SemanticFrame, ...]) -> str:
    """All of the path is spoken of, and what is read is near something."""
    word = next((c.text for c in said if c.kind == "whole" and c.text.lower() in EVERYWHERE), "")
    if word and len(frames) == 1 and frames[0].part.kind == "near":
        return f"{word!r} speaks of all of the path, and it would be done in a part of it."
    return ""


EVERYWHERE = frozenset(("anywhere", "everywhere", "at all times", "throughout", "always"))


def _met_once(frame: F.SemanticFrame) -> bool:
    return isinstance(frame, F.Clearance) and frame.distance.role == "at_most" and not frame.along


def _passed_once(frame: F.SemanticFrame) -> bool:
    return isinstance(frame, F.Visit) and frame.relation in ("over", "under")


def _thing_moved(said: Sequence[Chunk], kinds: frozenset[str], frames: tuple[F.SemanticFrame, ...]) -> str:
    """Something that is to be moved itself: "push the cup to the left", "turn the gripper"."""
    before: list[str] = []
    for chunk in said:
        words = [word for word in chunk.text.lower().split() if word not in DETERMINERS]
        tool = next((k for k, word in enumerate(words) if word in TOOLS), None)
        handled = (before + words[:tool])[-1:] if tool is not None else before[-1:]
        verbs = HANDLING if tool is None else TURNING
        if (chunk.kind == "OBJ" or tool is not None) and handled and handled[0] in verbs:
            return f"{handled[0]!r} asks for {chunk.text!r} itself to be moved; only the path can be."
        before += words
    return ""


def _wish_left(said: Sequence[Chunk], kinds: frozenset[str], frames: tuple[F.SemanticFrame, ...]) -> str:
    """A wish after an "and" of which no word is known: "and frobnicate it"."""
    opened, words = False, list[Chunk]()
    for chunk in (*said, Chunk("dot", "", (0, 0))):
        if chunk.kind not in ("and", "dot", "comma"):
            words.append(chunk)
            continue
        if opened and any(map(_is_wish, words)) and all(c.kind in UNKNOWN | {"OBJ", "path", "slight"} for c in words):
            return f"{' '.join(c.text for c in words)!r} has no place in it."
        opened, words = chunk.kind == "and", []
    return ""


def _is_wish(chunk: Chunk) -> bool:
    """Whether a word may ask for something that no frame holds: one that is unknown, or "dance"."""
    return chunk.kind == "unknown" or (chunk.kind == "path" and chunk.text.lower().split()[-1] not in OWN_NAMES)


def _end_lost(said: Sequence[Chunk], kinds: frozenset[str], frames: tuple[F.SemanticFrame, ...]) -> str:
    """An end that is to be where it was, on a path that is reversed: "and end where it ended"."""
    row = [chunk for chunk in said if chunk.kind != "filler"]
    for end, where in pairwise(row):
        if end.kind in ("goal", "start", "stop") and where.text.lower().startswith("where"):
            if any(isinstance(frame, F.Reverse) for frame in frames):
                return f"A path that is reversed cannot {end.text} {where.text} before."
    return ""


def _above_lost(said: Sequence[Chunk], kinds: frozenset[str], frames: tuple[F.SemanticFrame, ...]) -> str:
    """A place above or below something, where what is read is about the thing itself."""
    row = [chunk for chunk in said if chunk.kind != "filler"]
    for word, thing in pairwise(row):
        about = [frame for frame in frames if {*thing.names} & {*frame.named}]
        level = about and all(isinstance(frame, F.Figure | F.Clearance) for frame in about)
        if word.kind in ("over", "under") and thing.kind == "OBJ" and level:
            return f"{word.text!r} {thing.text} has no place in it."
    return ""


def _height_lost(said: Sequence[Chunk], kinds: frozenset[str], frames: tuple[F.SemanticFrame, ...]) -> str:
    """So far up or down, where nothing that is read has to do with heights: "no, 30 cm up left of the table"."""
    row = [chunk for chunk in said if chunk.kind != "filler"]
    asked = [way for q, way in pairwise(row) if q.kind == "Qm" and way.kind in ("up", "down", "raise", "lower")]
    asked += [way for way, q in pairwise(row) if q.kind == "Qm" and way.kind in ("raise", "lower")]
    level = all(isinstance(f, F.Shift) and not {way for way, _ in f.offset} & {"up", "down"} for f in frames)
    return f"{asked[0].text!r} has no place in it." if asked and frames and level else ""


def _pointed(said: Sequence[Chunk], kinds: frozenset[str], frames: tuple[F.SemanticFrame, ...]) -> str:
    """A place that is only pointed at, where the whole path is changed: "speed up over there"."""
    local = F.Pace | F.Shift | F.Height | F.Smooth | F.Approach
    placed = any(frame.named or frame.part != WHOLE or not isinstance(frame, local) for frame in frames)
    return f"{_said(said, {'there'})} points at a place that nothing names." if "there" in kinds and not placed else ""


def _without_unit(said: Sequence[Chunk], kinds: frozenset[str], frames: tuple[F.SemanticFrame, ...]) -> str:
    """A length without a unit that is taken for centimetres, or for many metres: "no nearer than 60"."""
    measured = [frame for frame in frames if isinstance(frame, MEASURED)]
    amounts = [q for frame in measured for slot, q in frame.quantities.items() if slot not in UNMEASURED]
    lengths = [abs(q.value) for q in amounts if q.unit in ("", "m")]
    bare = [abs(q.value) for q in amounts if q.unit == ""]
    stated = [chunk.number.value for chunk in said if chunk.q is not None]
    guessed = [length for length in lengths if not any(_near(length, value) for value in stated)]
    for number in (chunk.number.value for chunk in said if chunk.kind == "Qn"):
        if number >= 1.0 and any(_near(number * CENTI, length) for length in guessed):
            return f"{number:g} has no unit; it is taken as {number:g} cm."
        if number >= FAR and number in bare:
            return f"{number:g} has no unit; it would be {number:g} m."
    return ""


OWN_NAMES = frozenset("path trajectory route way track line course motion movement it waypoints points".split())
"""What the path is called, which asks for nothing by itself."""

TURNING = frozenset("rotate turn tilt spin flip open close point".split())
HANDLING = TURNING | frozenset(
    "move shift push pull put place bring take carry lift raise lower drop throw grab pick paint clean fill".split()
)
"""Verbs whose object is what is moved; the tool goes with the path unless it is to be turned."""

TOOLS = frozenset("gripper hand wrist camera tool head".split())

NEVER = (
    _compared,
    _bounded_otherwise,
    _conditional,
    _thing_moved,
    _wish_left,
    _end_lost,
    _above_lost,
    _height_lost,
    _pointed,
    _without_unit,
)
"""What is never done at once, however likely its reading is."""

CHECKS = (
    _turned,
    _negated,
    _unbounded,
    _number_left,
    _object_left,
    _two_waypoints,
    _by_for_to,
    _kept_for_farther,
    _once_near,
    _anywhere,
    *NEVER,
)


def _said(said: Sequence[Chunk], kinds: frozenset[str] | set[str]) -> str:
    return quoted([next((chunk.text for chunk in said if chunk.kind in kinds), "")])


def _senses(frame: F.SemanticFrame) -> list[str]:
    """The senses of a frame that have an opposite."""
    found = [direction for direction, _ in getattr(frame, "offset", ())]
    found += [str(getattr(frame, slot, "")) for slot in ("direction", "sense", "change")]
    return [sense for sense in found if sense in _OTHER]


def opposed(one: Iterable[F.SemanticFrame], other: Iterable[F.SemanticFrame]) -> bool:
    """Whether two readings hold opposite senses, such as left and right."""
    mine, theirs = ({sense for frame in frames for sense in _senses(frame) + _paced(frame)} for frames in (one, other))
    return any(_OTHER[sense] in theirs for sense in mine)


def _paced(frame: F.SemanticFrame) -> list[str]:
    """Whether a multiple of the speed is slower or faster: "speed x0.5"."""
    amount = frame.amount if isinstance(frame, F.Pace) and frame.change == "set" else None
    if amount is None or amount.unit not in ("x", "%") or amount.value == 1.0:
        return []
    return ["slower" if amount.value < 1.0 else "faster"]


def _limits(frame: F.SemanticFrame, kinds: frozenset[str]) -> bool:
    """Whether a negation asks for a frame: it keeps, bounds, excepts, or is the opposite of what is said."""
    if isinstance(frame, F.Keep | F.Clearance | F.Bound) or frame.part.kind == "outside":
        return True
    change = getattr(frame, "change", "")
    roles = {q.role for q in frame.quantities.values()}
    if roles & {"at_least", "at_most"} or change in ("cap", "floor", "constant"):
        return True
    turned = {"farther", "slower", "less", "smaller"} & {change, *_senses(frame)}
    return any(kinds & OPPOSED[_OTHER[sense]] or not kinds & OPPOSED[sense] for sense in turned)


def _values(frame: F.SemanticFrame) -> set[float]:
    """The numbers that a frame holds, in SI, also as shares, counts from 1 and means of two."""
    found = [q.value for q in frame.quantities.values()] + _of_part(frame.part)
    number = getattr(frame, "number", None)
    found += [] if number is None else [float(number)]
    brakes = isinstance(frame, F.Pace) and frame.change == "rampdown" and not frame.part
    found += [0.0] if brakes else []  # "slow down to zero"
    for slot in fields(frame):
        value = getattr(frame, slot.name)
        found += [value.value] if isinstance(value, F.Quantity) else []
    shares = [1.0 / q.value for q in frame.quantities.values() if q.unit in ("x", "%") and q.value]
    return {v for value in found for v in (value, -value, 1 - value, 1 + value)} | {*shares}


def _of_part(part: PathPart) -> list[float]:
    own = [value for value in (part.amount, part.until) if value is not None]
    own += [value + 1 for value in own if part.unit == "waypoints"]
    own += [p.value for p in part.places if isinstance(p, F.Quantity)]
    return own + [value for inner in part.parts for value in _of_part(inner)]
