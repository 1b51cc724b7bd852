"""What speaks against a reading: plain facts of the utterance that the frames do not bear out.

Numbers, objects and parts of the path that are said have to be found in what is read. Each check says, as a sentence,
what is lost; what any of them speaks against is shown first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

from ovita.instruct import frames as F
from ovita.instruct.chunks import Chunk
from ovita.instruct.editing import OPPOSITE
from ovita.instruct.facts import BOUNDS, OPPOSED, Facts, among, clauses, senses
from ovita.instruct.frames import held_by
from ovita.instruct.lexicon import DETERMINERS
from ovita.instruct.numerals import CENTI, FAR
from ovita.instruct.together import MEASURED, UNMEASURED, unit_of
from ovita.instruct.whereabouts import EXCEPT, OTHER_THAN

EXCLUDED = {
    **dict.fromkeys("up raise over farther faster larger inc at_least".split(), "at_most"),
    **dict.fromkeys("down lower under closer slower smaller dec at_most within".split(), "at_least"),
}
"""The bound that is never meant by a comparison: "higher than" is no greatest height, "never higher" no least one."""

NOT = frozenset("clear avoid too max limit vmax ceiling".split())
"""What may turn a comparison round, but for a "never" right before it."""

Check = Callable[[Facts], str]
"""A check of a reading: a sentence that says what is against it, or "" where nothing is."""


def contradictions(
    said: Sequence[Chunk], frames: Iterable[F.SemanticFrame], *, certain: bool = False
) -> tuple[str, ...]:
    """What the words say and a reading does not account for, or says otherwise, as sentences for people.

    Args:
        said: The utterance in chunks.
        frames: What was read.
        certain: Whether the reader is so sure that only what it never sees counts.
    """
    facts = Facts(said, tuple(frames))
    checks = CHECKS if certain and "than" not in facts.words else CHECKS + MINDED
    return tuple(text for check in checks if (text := check(facts)))


def _number_left(it: Facts) -> str:
    """A number that no slot took; "one" alone may be somebody, and the eight a figure."""
    shapes = {getattr(frame, "shape", "") for frame in it.frames}
    names = {"one", *shapes, "8" if "eight" in shapes else ""}
    held = set[float]().union(*map(held_by, it.frames))
    bare = (1.0, CENTI, *(f for kind in ("Qm", "Qs") for c in it.said if (f := unit_of(c, kind))))
    ends = _range_ends(it.said, held)
    for chunk in it.said:
        if chunk.q is None or chunk.text.lower() in names or chunk in ends:
            continue
        if not any(among(held, chunk.q.value * unit) for unit in (bare if chunk.kind == "Qn" else (1.0,))):
            return f"{chunk.text!r} has no place in it."
    return ""


def _sign_left(it: Facts) -> str:
    """A minus that no frame holds, of what has no sign: "scale by -2", "rotate by -30 degrees"."""
    below = [then for chunk, then in pairwise(it.said) if chunk.kind == "minus" and then.q is not None]
    holders = [frame for frame in it.frames if any(among(held_by(frame), then.q.value) for then in below if then.q)]
    unsigned = holders and all(isinstance(frame, UNSIGNED) for frame in holders)
    return f"The minus of {below[0].text!r} has no place in it." if unsigned else ""


UNSIGNED = (F.Resize, F.Rotate, F.Tilt, F.Wait, F.Clearance, F.Approach, F.Height)
"""Frames that hold no sign that a reader passed over."""


def _range_ends(said: Sequence[Chunk], held: Iterable[float]) -> list[Chunk]:
    """Both numbers of ranges whose mean is held; the first may be in the unit of the second: "30-32 cm"."""
    found: list[Chunk] = []
    for one, link, other in zip(said, said[1:], said[2:], strict=False):
        if one.q and other.q and link.kind in ("to", "and"):
            means = [(one.q.value * scale + other.q.value) / 2 for scale in (1.0, 0.01, 0.001)]
            found += [one, other] if any(among(held, mean) for mean in means) else []
    return found


SPARED = (*sorted(EXCEPT), *(" ".join(words) for words in OTHER_THAN))
"""Words before an object that is not meant."""


def _object_left(it: Facts) -> str:
    """An object that no frame is about."""
    named = {name for frame in it.frames for name in frame.named}
    reason = next((i for i, chunk in enumerate(it.row) if chunk.kind == "because"), len(it.row))
    for i, chunk in enumerate(it.row):
        meant = i < reason or any(name.lower() in chunk.text.lower() for name in chunk.names)
        if chunk.kind == "OBJ" and meant and not named.intersection(chunk.names) and not _is_spared(it, i):
            return f"{chunk.text!r} has no part in it."
    return ""


def _is_spared(it: Facts, i: int) -> bool:
    """Whether an object is the one that is left out of what is about several: "all but the lamp"."""
    before = " ".join(one.text.lower() for one in it.row[max(i - 2, 0) : i])
    return before.endswith(SPARED) and any(map(_of_several, it.frames))


def _of_several(frame: F.SemanticFrame) -> bool:
    """Whether a frame is about distances to several objects, as to all but one."""
    return isinstance(frame, F.Approach | F.Clearance) and len(frame.objects) > 1


def _part_left(it: Facts) -> str:
    """A part of the path that is named as one, where all frames are about the whole: "mirror the last part"."""
    if any(frame.part or isinstance(frame, ABOUT_PARTS) for frame in it.frames):
        return ""
    parts = [c for c in it.said if c.kind in PARTS and c.text.lower().split()[-1] in STRETCHES]
    return f"{parts[0].text!r} has no place in it." if parts else ""


ABOUT_PARTS = (F.MoveEnd, F.Keep, F.Extend, F.Trim, F.StopAt, F.Return, F.Wait, F.Figure, F.Arrive)
"""Frames about a part of the path without one of their own."""

PARTS = ("first", "last", "middle", "firsthalf", "secondhalf")
STRETCHES = frozenset("part phase section stretch portion segment half third quarter".split())
"""Kinds of chunks that name a part of the path, and what it is called."""


def _compared(it: Facts) -> str:
    """A bound on the other side than a comparison puts it: "higher than 30 cm" as at most 30 cm."""
    if it.kinds & NOT:
        return ""
    bounds = [(one.role, one.value) for frame in it.frames for one in frame.quantities.values()]
    for word, amount, excluded in _comparisons(it):
        wrong = [value for role, value in bounds if role == excluded]
        if amount.q is not None and among(wrong, amount.q.value):
            return f"{word.text!r} {amount.q.said or amount.text} is a bound on the other side."
    return ""


def _comparisons(it: Facts) -> Iterator[tuple[Chunk, Chunk, str]]:
    """Each word with the one behind it, and the bound that is not meant by it, or ""; a denial turns that round."""
    denied = False
    for word, behind in pairwise(chunk for chunk in it.row if chunk.kind != "than"):
        denied = word.kind == "never" or (denied and word.kind not in ("comma", "dot", "and"))
        excluded = EXCLUDED.get(word.kind, "")
        yield word, behind, OPPOSITE[excluded] if denied and excluded else excluded


def _without_unit(it: Facts) -> str:
    """A length without a unit that is taken for centimetres, or for many metres: "no nearer than 60"."""
    if any(map(unit_of, it.said)):
        return ""  # it is in the unit of the other one
    amounts = [q for frame in it.frames for q in _lengths(frame)]
    stated = [chunk.number.value for chunk in it.said if chunk.q is not None]
    guessed = [abs(q.value) for q in amounts if not among(stated, abs(q.value))]
    bare = [abs(q.value) for q in amounts if q.unit == ""]
    told = (_as_taken(chunk.number.value, guessed, bare) for chunk in it.said if chunk.kind == "Qn")
    return next(filter(None, told), "")


def _as_taken(number: float, guessed: Sequence[float], bare: Sequence[float]) -> str:
    """What a bare number is taken for."""
    if number >= 1.0 and among(guessed, number * CENTI):
        return f"{number:g} has no unit; it is taken as {number:g} cm."
    return f"{number:g} has no unit; it would be {number:g} m." if number >= FAR and number in bare else ""


def _lengths(frame: F.SemanticFrame) -> list[F.Quantity]:
    """The lengths of a frame, also those without a unit."""
    amounts = frame.quantities if isinstance(frame, MEASURED) else {}
    return [q for slot, q in amounts.items() if slot not in UNMEASURED and q.unit in ("", "m")]


def _denied(it: Facts) -> str:
    """A denial which no frame bears out, at the beginning or in few words: "don't go left", "stop slowing down"."""
    first, *behind = it.row or it.said
    turned = behind[:1] and behind[0].kind in it.senses and first.text.lower() in ("stop", "quit", "avoid")
    said = first if turned else next((c for c in it.row[: CURT + 1] if c.kind == "never"), None)
    if said is None or (len(it.row) > CURT and said is not first) or len(clauses(it.said)) > 1:
        return ""
    borne = any(OPPOSED[sense] & it.flipped for sense in it.senses) or any(_limits(f, it.plain) for f in it.frames)
    return f"{said.text!r} may belong to something else." if turned or not borne else ""


CURT = 6
"""Words of an utterance that is so short that a denial in it is about what it asks for."""


def _limits(frame: F.SemanticFrame, kinds: frozenset[str]) -> bool:
    """Whether a negation asks for a frame: it keeps, bounds, excepts, or is the opposite of what is said."""
    if isinstance(frame, F.Keep | F.Clearance | F.Bound | F.Avoid | F.NoStop) or frame.part.kind == "outside":
        return True
    if getattr(frame, "change", "") == "constant" or any(q.role in BOUNDS for q in frame.quantities.values()):
        return True
    turned = {"farther", "slower", "less", "smaller"} & {*senses(frame)}
    return any(kinds & OPPOSED[OPPOSITE[sense]] or not kinds & OPPOSED[sense] for sense in turned)


def _thing_turned(it: Facts) -> str:
    """Something that is to be turned or opened itself: "rotate the cup", "close the fan"."""
    before = ""
    for chunk in it.said:
        if chunk.kind == "OBJ" and before in TURNED:
            return f"{before!r} asks for {chunk.text!r} itself to be moved; only the path can be."
        for word in chunk.text.lower().split():
            before = before if word in DETERMINERS else word
    return ""


TURNED = frozenset("rotate turn tilt spin flip open close shut push lift".split())
"""Verbs whose object is what is moved, not the path."""


def _other_deed(it: Facts) -> str:
    """A wish after an "and" for what is no matter of the path: "and open it", "and say hello"."""
    for clause in clauses(it.said):
        words = [word for chunk in clause for word in chunk.text.lower().split() if word not in ("and", "then", "also")]
        if clause[0].kind == "and" and words[:1] and words[0] in DEEDS:
            return f"{' '.join(chunk.text for chunk in clause[1:])!r} is no matter of the path."
    return ""


DEEDS = frozenset("open close shut say sing press ring grab grip pick pour photograph beep honk dance".split())
"""Verbs for what else a robot may do."""


def _conditional(it: Facts) -> str:
    """A condition, which no frame can hold but as a part of the path: "if nobody is there"."""
    for before, word, then in zip(("", *it.words), it.words, it.words[1:], strict=False):
        if word == "unless" or (word == "if" and then in SOMEBODY and before not in ASKING):
            return f"{word!r} sets a condition, and it would be done always."
    return ""


ASKING = frozenset("see check know tell look notice".split())
"""Verbs before an "if" that is no condition: "so that I can see if it is shut"."""

SOMEBODY = frozenset("nobody somebody someone anybody anyone no there the a an it".split())
"""What follows an "if" that is no mere politeness."""


def _twice(it: Facts) -> str:
    """The same read twice, which nobody says: "from 0.1 to 0.5 m/s"."""
    plain = [replace(frame, words=()) for frame in it.frames]
    return "The same is read twice." if any(frame in plain[:i] for i, frame in enumerate(plain)) else ""


CHECKS: tuple[Check, ...] = (
    _sign_left, _part_left, _compared, _denied, _thing_turned, _other_deed, _conditional, _without_unit, _twice,
)  # fmt: skip
MINDED: tuple[Check, ...] = (_number_left, _object_left)
"""Checks of what the network has not seen, and of what it has: where it is certain, it was right in 88 of 94 sentences
that these doubted; but they count for comparisons ("5 cm farther from the cup than from the lamp")."""
