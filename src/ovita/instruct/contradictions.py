"""What speaks against a reading: plain facts of the utterance that the frames do not bear out.

Numbers, objects, directions, negations and bounds that are said have to be found in what is read; each check says, as a
sentence, which is not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise

from ovita.instruct import frames as F
from ovita.instruct.chunks import Chunk
from ovita.instruct.editing import OPPOSITE
from ovita.instruct.facts import BOUNDS, OPPOSED, Facts, among, clauses, elsewhere, senses
from ovita.instruct.frames import held_by
from ovita.instruct.lost import LOST
from ovita.instruct.numerals import CENTI, FRACTIONS
from ovita.instruct.together import unit_of

EXCLUDED = {
    **dict.fromkeys("up raise over farther faster larger inc".split(), "at_most"),
    **dict.fromkeys("down lower under closer slower smaller dec".split(), "at_least"),
}
"""The bound that is never meant by a comparison: "higher than" is no greatest height."""

DENIED = {word: BOUNDS[role == "at_least"] for word, role in EXCLUDED.items()}
"""The same for one that is denied: "never higher than" is no least height."""

UPPER = frozenset("at_most max limit vmax ceiling".split())

LOWER = frozenset("at_least min vmin floorlimit".split())

NOT = frozenset("never clear avoid too".split()) | UPPER
"""What may turn a comparison round: "never higher than"."""

Check = Callable[[Facts], str]
"""A check of a reading: a sentence that says what is against it, or "" where nothing is."""


def contradictions(
    said: Sequence[Chunk], frames: Iterable[F.SemanticFrame], checks: Sequence[Check] | None = None
) -> tuple[str, ...]:
    """What the words say and a reading does not account for, or says otherwise, as sentences for people."""
    facts = Facts(said, tuple(frames))
    return tuple(text for check in checks or CHECKS if (text := check(facts)))


def _turned(it: Facts) -> str:
    """Left is read where only right is said, slower where only faster is."""
    for sense in sorted(it.senses):
        other = OPPOSITE[sense]
        said_otherwise = it.kinds & OPPOSED[other] - OPPOSED[sense] and not it.kinds & OPPOSED[sense]
        if said_otherwise and other not in it.senses:
            return f"It is read as {sense!r}, but says {it.word(OPPOSED[other])}."
    return ""


def _negated(it: Facts) -> str:
    """A "not" that no frame comes from."""
    denials = {"never", "clear"}
    if not it.plain & denials or any(OPPOSED[sense] & it.flipped for sense in it.senses):
        return ""
    denied = [clause for clause in clauses(it.said) if {c.kind for c in clause} & denials]
    if _borne_out(it, denied):
        return ""
    return f"{it.word({'never'} & it.plain or {'keep'})} may belong to something else."


def _borne_out(it: Facts, denied: Sequence[Sequence[Chunk]]) -> bool:
    """Whether a frame is what the clauses that deny something ask for, or all frames come from other ones."""
    limits = any(_limits(frame, it.plain) for frame in it.frames)
    return limits or (bool(it.frames) and all(elsewhere(frame, denied) for frame in it.frames))


def _unbounded(it: Facts) -> str:
    """A "maximum" or "at least" that is read as something else."""
    if any(isinstance(frame, F.Bound | F.Figure) for frame in it.frames):
        return ""  # "a radius of at most 1 m" is 1 m
    roles = {q.role for frame in it.frames for q in frame.quantities.values()}
    for words, role in ((UPPER, "at_most"), (LOWER, "at_least")):
        borne_out = roles & ({*BOUNDS} if "never" in it.kinds else {role})
        if it.kinds & words and roles & {"by", "to", "at", *BOUNDS} and not borne_out:
            return f"{it.word(words)} asks for a limit that the reading does not have."
    return ""


def _compared(it: Facts) -> str:
    """A bound on the other side than a comparison puts it: "higher than 30 cm" as at most 30 cm."""
    return "" if it.kinds & NOT else _other_bound(it, it.row, EXCLUDED)


def _compared_in_denial(it: Facts) -> str:
    """A bound on the other side than a denied comparison puts it: "never below 15 cm" as at most 15 cm."""
    if it.kinds & NOT - {"never"}:
        return ""
    denied = [clause for clause in clauses(it.row) if any(chunk.kind == "never" for chunk in clause)]
    return next(filter(None, (_other_bound(it, clause, DENIED) for clause in denied)), "")


def _other_bound(it: Facts, row: Sequence[Chunk], excluded: Mapping[str, str]) -> str:
    """What is said of a number behind a word of comparison that is read as the bound that this word excludes."""
    bounds = [(one.role, one.value) for frame in it.frames for one in frame.quantities.values()]
    for word, amount in pairwise(chunk for chunk in row if chunk.kind != "than"):
        wrong = [value for role, value in bounds if role == excluded.get(word.kind)]
        if amount.q is not None and among(wrong, amount.q.value):
            return f"{word.text!r} {amount.q.said or amount.text} is a bound on the other side."
    return ""


def _number_left(it: Facts) -> str:
    """A number that no slot took; "one" alone may be somebody, and the eight a figure."""
    names = {"one", *(getattr(frame, "shape", "") for frame in it.frames)}
    held = set[float]().union(*map(held_by, it.frames))
    units = {"Qn": (1.0, CENTI, *filter(None, map(unit_of, it.said)))}
    ends = _range_ends(it.said, held)
    for k, chunk in enumerate(it.said):
        if chunk.q is None or chunk.text.lower() in names or chunk in ends:
            continue
        amounts = _amounts(chunk.q.value, it.said[k + 1 : k + 5])
        if not any(among(held, value * unit) for value in amounts for unit in units.get(chunk.kind, (1.0,))):
            return f"{chunk.text!r} has no place in it."
    return ""


def _sign_left(it: Facts) -> str:
    """A minus that no frame holds, of what has no sign: "scale by -2", "rotate by -30 degrees"."""
    below = [then for chunk, then in pairwise(it.said) if chunk.kind == "minus" and then.q is not None]
    holders = [frame for frame in it.frames if any(among(held_by(frame), then.q.value) for then in below if then.q)]
    unsigned = holders and all(isinstance(frame, UNSIGNED) for frame in holders)
    return f"The minus of {below[0].text!r} has no place in it." if unsigned else ""


UNSIGNED = (F.Resize, F.Rotate, F.Tilt, F.Wait, F.Clearance, F.Approach)
"""Frames whose amounts have no sign."""


def _amounts(value: float, behind: Sequence[Chunk]) -> tuple[float, ...]:
    """What a number may come to with the words behind it: "three-quarter", "seven tenths"."""
    words = " ".join(chunk.text.lower() for chunk in behind).replace("-", " ").split()
    share = FRACTIONS.get(words[0], FRACTIONS.get(words[0].removesuffix("s"), 1.0)) if words else 1.0
    return value, value * share


def _range_ends(said: Sequence[Chunk], held: Iterable[float]) -> list[Chunk]:
    """Both numbers of ranges whose mean is held; the first may be in the unit of the second: "30-32 cm"."""
    found: list[Chunk] = []
    for one, link, other in zip(said, said[1:], said[2:], strict=False):
        if one.q and other.q and link.kind in ("to", "and"):
            means = [(one.q.value * scale + other.q.value) / 2 for scale in (1.0, 0.01, 0.001)]
            found += [one, other] if any(among(held, mean) for mean in means) else []
    return found


def _object_left(it: Facts) -> str:
    """An object that no frame is about."""
    named = {name for frame in it.frames for name in frame.named}
    reason = next((i for i, chunk in enumerate(it.said) if chunk.kind == "because"), len(it.said))
    for i, chunk in enumerate(it.said):
        meant = i < reason or any(name.lower() in chunk.text.lower() for name in chunk.names)
        if chunk.kind == "OBJ" and meant and not named.intersection(chunk.names):
            return f"{chunk.text!r} has no part in it."
    return ""


NEVER = (*LOST, _compared)
"""What is never done at once, however likely its reading is."""


def _denied(it: Facts) -> str:
    """A way past, over or through something, where only that is denied: "do not fly over the cup"."""
    passed = it.names(F.Visit | F.Hop | F.Hover | F.StopAt | F.Wait)
    row = [chunk for chunk in it.row if chunk.kind not in PASSING]
    named = [chunk.names for chunk in row]
    for no, thing in pairwise(row):
        if no.kind in DENYING and passed.intersection(thing.names) and named.count(thing.names) == 1:
            return f"{no.text!r} denies it."
    return ""


def _side_denied(it: Facts) -> str:
    """A side on which to pass, where only that is denied: "not in front of the chairs"."""
    sides = {frame.direction for frame in it.frames_of(F.Side)}
    kinds = [chunk.kind for chunk in it.row if chunk.kind not in PASSING]
    denied = any(no == "never" and side in sides and kinds.count(side) == 1 for no, side in pairwise(kinds))
    return f"{it.word({'never'})} denies that side." if denied else ""


DENYING = ("never", "avoid", "farther", "withdraw")
"""Classes of words that deny a way to what is right behind them."""

PASSING = frozenset(
    "pass over under through thru touch to at by near stop wait hover between gap distance of in on from".split()
)
"""Classes of words that lead to an object."""


def _one_of_two(it: Facts) -> str:
    """One of two opposite sides that are both asked for: "go left and right"."""
    one_side = any(len({*senses(frame)} & {"left", "right"}) == 1 for frame in it.frames)
    swapped = "mirror" not in it.plain and any(isinstance(frame, F.Mirror) for frame in it.frames)
    return f"{it.word({'sideways'})} is both sides." if (one_side or swapped) and "sideways" in it.plain else ""


def _nowhere(it: Facts) -> str:
    """The start and the end of the path at once, which are no part of it."""
    parts = (frame.part.parts for frame in it.frames if frame.part.kind == "both")
    ends = any({"first", "last"} <= {part.kind for part in both} for both in parts)
    return "No part of the path is at its start and at its end." if ends else ""


REFUSED = (_denied, _side_denied, _one_of_two, _compared_in_denial, _nowhere)
"""Where what is read is the opposite of what is said, and not even shown."""

LEFT = (_number_left, _sign_left, _object_left)
"""What is left of an utterance though it was said to be used."""

CHECKS = (_turned, _negated, _unbounded, *LEFT, *NEVER)


def _limits(frame: F.SemanticFrame, kinds: frozenset[str]) -> bool:
    """Whether a negation asks for a frame: it keeps, bounds, excepts, or is the opposite of what is said."""
    if isinstance(frame, F.Keep | F.Clearance | F.Bound | F.Avoid) or frame.part.kind == "outside":
        return True
    if getattr(frame, "change", "") == "constant" or any(q.role in BOUNDS for q in frame.quantities.values()):
        return True
    turned = {"farther", "slower", "less", "smaller"} & {*senses(frame)}
    return any(kinds & OPPOSED[OPPOSITE[sense]] or not kinds & OPPOSED[sense] for sense in turned)
