"""What the words of feedback say that its edits miss: so much more or less, a share of it, and what is dropped."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Literal

from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.chunks import Chunk
from ovita.instruct.editing import OPPOSITE, directions_of, is_called, slots
from ovita.instruct.facts import among
from ovita.instruct.numerals import is_digits
from ovita.instruct.remarks import SENSES, Remark, words_in

Step = Literal[-1, 0, 1]


def revised(edits: tuple[E.Edit, ...], chunks: Sequence[Chunk], said: Remark) -> tuple[E.Edit, ...]:
    """Edits with what their words say besides.

    An amount of which words say that it is so much too much, or missing, is a difference ("3 cm too high", "five
    more"); a share by which something is to be reduced is what is taken off; a bare number is in the unit of the length
    that it takes the place of; a comparative says whether there is to be more; an old value says what it was of.

    Args:
        edits: As they were read.
        chunks: The utterance in chunks.
        said: The utterance against the frames before it.
    """
    numbers = [chunk.number.value for chunk in chunks if chunk.kind == "Qn"]
    edits = tuple(_so_many(_in_its_unit(edit, said.before, numbers), said) for edit in edits)
    edits = tuple(_shared(_stepped(edit, chunks), chunks) for edit in _of_amounts(edits, chunks, said.before))
    return tuple(_at_its_end(_instead(_compared(_aimed(edit, said), said), said), said) for edit in edits)


def _aimed(edit: E.Edit, said: Remark) -> E.Edit:
    """A change of an amount as one of the direction that is named among several: "a bit more to the left"."""
    ways = [way for frame in said.before for way in directions_of(frame)]
    named = {SENSES.get(piece.kind, "") for piece in said.pieces} & {*ways}
    if not isinstance(edit, E.Rescale) or len(ways) < 2 or len(named) != 1 or edit.on in ways:
        return edit
    (way,) = named
    about = [frame for frame in said.before if way in directions_of(frame)]
    return replace(edit, on=way) if not edit.on or any(is_called(frame, edit.on) for frame in about) else edit


COUNTS = {"both": 2, "two": 2, "2": 2, "twice": 2, "three": 3, "3": 3, "four": 4, "4": 4}
"""Words for how many of the turns."""


def _so_many(edit: E.Edit, said: Remark) -> E.Edit:
    """So many steps back or forth as are counted: "undo both", also of what is not among the frames before."""
    plain = [p for p in said.pieces if p.q is None or p.q.unit in ("", "step", "x")]
    counts = [COUNTS[word] for word in words_in(plain) if word in COUNTS]
    if isinstance(edit, E.Command) and edit.command in ("undo", "redo") and edit.steps == 1 and len(counts) == 1:
        return replace(edit, steps=counts[0])
    return edit


def _compared(edit: E.Edit, said: Remark) -> E.Edit:
    """A change as more or less, by the comparative that says it: "lower it again" of what went up."""
    if not isinstance(edit, E.Rescale) or edit.factor is not None:
        return edit
    about = [frame for frame in said.before if not edit.on or is_called(frame, edit.on)]
    if edit.change and not TURNING.isdisjoint(words_in(said.pieces)):
        return edit
    senses = {sense for frame in about for sense in _senses(frame)}
    for sense in (SENSES.get(piece.kind, "") for piece in said.pieces if piece.text.endswith("er")):
        if sense in senses or OPPOSITE.get(sense, sense) in senses:
            return replace(edit, change="more" if sense in senses else "less")
    return edit


TURNING = frozenset("too not less enough so never no much as".split())
"""Words that turn a comparative round: "not so slow"."""


def _senses(frame: F.SemanticFrame) -> set[str]:
    """What there is more of where a frame's amount grows; of a time that the way takes that is slowness."""
    if isinstance(frame, F.Pace) and frame.amount is not None and frame.change in ("set", "cap", "floor"):
        slow = frame.amount.unit == "s" or (frame.amount.unit in ("x", "%") and frame.amount.value < 1.0)
        return {"slower" if slow else "faster"}
    return {*directions_of(frame), str(getattr(frame, "change", "")), str(getattr(frame, "sense", ""))} - {""}


def _instead(edit: E.Edit, said: Remark) -> E.Edit:
    """Another value for the slot whose old value is said beside it: "15 cm instead of 10 cm"."""
    numbers = [piece.q for piece in said.pieces if piece.q]
    if not isinstance(edit, E.Set) or len(numbers) != 2 or edit.step:
        return edit
    had = [(i, slot, q) for i, frame in enumerate(said.before) for slot, q in dict(held_in(frame)).items()]
    old = [
        (i, slot)
        for i, slot, q in had
        if any(math.isclose(q.value, n.value) and n.unit in ("", q.unit) for n in numbers)
    ]
    others = [n for n in numbers if not any(math.isclose(q.value, n.value) for _, _, q in had)]
    if len(old) != 1 or len(others) != 1 or not math.isclose(others[0].value, edit.quantity.value):
        return edit
    return replace(edit, on=said.on(old[0][0]), slot=old[0][1])


def _at_its_end(edit: E.Edit, said: Remark) -> E.Edit:
    """An exception at the end of the path that is named, and a change of the end that is."""
    ends = {piece.kind for piece in said.pieces} & {"start", "goal"}
    if len(ends) != 1 or len(words_in(said.pieces)) > CURT or "ends" in words_in(said.pieces):
        return edit
    (end,) = ends
    if isinstance(edit, E.Except) and edit.part.kind in ("first", "last"):
        return replace(edit, part=replace(edit.part, kind="first" if end == "start" else "last"))
    moved = [i for i, frame in enumerate(said.before) if isinstance(frame, F.MoveEnd) and frame.end == end]
    return replace(edit, on=said.on(moved[0])) if isinstance(edit, E.Rescale) and len(moved) == 1 else edit


CURT = 9
"""Words of an utterance that is so short that an end which it names is what it is about."""


def left_over(words: Sequence[str], edits: Sequence[E.Edit], chunks: Sequence[Chunk], said: Remark) -> tuple[str, ...]:
    """The unread words of feedback that may ask for something: not those that name a frame, or an amount that was said.

    Args:
        words: What no edit was read from.
        edits: What was read.
        chunks: The utterance in chunks.
        said: The utterance against the frames before it.
    """
    held = [q.value for frame in said.before for _, q in held_in(frame)]
    held += [edit.quantity.value for edit in edits if isinstance(edit, E.Set)]
    known = {piece.text.lower() for piece in said.pieces if said.meant([piece])} | {
        n for f in said.before for n in f.named
    }
    stale = [i for value in held for i in _where(chunks, value)]
    old = {word for i in stale for word in chunks[i].text.lower().split()}
    old |= {f"{value:g}" for value in held} | {"back"} | ({"1"} if "one" in words_in(said.pieces) else set())
    old |= {"50"} if "other" in words_in(said.pieces) else set()  # "the other half"
    return tuple(word for word in words if word not in known and not {*word.lower().split()} & old)


def _of_amounts(
    edits: tuple[E.Edit, ...], chunks: Sequence[Chunk], before: Sequence[F.SemanticFrame]
) -> tuple[E.Edit, ...]:
    """Edits with "more" or "less" of the one amount there was as the difference that words say."""
    known = list(slots(before[0])) if len(before) == 1 else []
    match edits:
        case (E.Rescale(change="more" | "less", factor=None),) if len(known) == 1:
            steps = [
                (chunk, step) for i, chunk in enumerate(chunks) if chunk.q and (step := _step(chunks, i, known[0]))
            ]
            if len(steps) == 1 and steps[0][0].q is not None:
                return (E.Set(slot=known[0], quantity=steps[0][0].q, step=steps[0][1]),)
    return edits


def _in_its_unit(edit: E.Edit, before: Sequence[F.SemanticFrame], numbers: Sequence[float]) -> E.Edit:
    """An edit whose bare number is in the unit of the length that it takes the place of: "two is enough" of 3 cm."""
    if not isinstance(edit, E.Set):
        return edit
    guesses = (1.0,) if not edit.quantity.unit else (1.0, 0.01, 0.001)
    bare = next((n for n in numbers for unit in guesses if math.isclose(n * unit, edit.quantity.value)), None)
    stated = (pair for frame in reversed(before) for pair in held_in(frame))
    had = next((q for slot, q in stated if edit.slot in (slot, q.role)), None)
    if bare is None or had is None or had.unit != "m" or had.value <= 0.0:
        return edit
    return replace(edit, quantity=replace(edit.quantity, value=_likelier(bare, had), unit="m", said=""))


def _likelier(bare: float, had: F.Quantity) -> float:
    """A bare number in the unit that a length was said in, or in metres, whichever is nearer to that length [m]."""
    said = had.said.rstrip(UNITS)
    number = float(said) if is_digits(said) else had.value * (100.0 if had.value < 1.0 else 1.0)  # centimetres, if bare
    likely = [value for value in (bare * had.value / (number or 1.0), bare) if value > 0.0]
    return min(likely, key=lambda one: abs(math.log(one / had.value)), default=bare)


def held_in(frame: F.SemanticFrame) -> list[tuple[str, F.Quantity]]:
    """The quantities of a frame by their slots, also those along directions."""
    return [*frame.quantities.items(), *((way, q) for way, q in getattr(frame, "offset", ()) if q is not None)]


UNITS = "abcdefghijklmnopqrstuvwxyz\"'″ "


def _stepped(edit: E.Edit, chunks: Sequence[Chunk]) -> E.Edit:
    """An edit as so much less or more, if words say that of its amount."""
    if not isinstance(edit, E.Set):
        return edit
    steps = (_step(chunks, i, edit.slot) for i in _where(chunks, edit.quantity.value))
    return replace(edit, step=next(filter(None, steps), edit.step))


def _where(chunks: Sequence[Chunk], value: float) -> Iterator[int]:
    """The numbers of the chunks that may say a value."""
    for i, chunk in enumerate(chunks):
        if chunk.q and among((chunk.q.value * unit for unit in (1.0, 0.01, 0.001)), value):
            yield i


def _step(chunks: Sequence[Chunk], i: int, slot: str) -> Step:
    """Whether an amount is one that is to be added (1) or taken off (-1), by the words beside it."""
    before = chunks[i - 1].text.lower() if i else ""
    behind = [word for chunk in chunks[i + 1 : i + 4] for word in chunk.text.lower().split()][:3]
    first, second, *_ = [*behind, "", ""]
    if first == "too":
        return _judged(second, slot)
    if first in COMPARATIVES:
        return 1 if COMPARATIVES[first] == slot else -1 if slot in F.OPPOSITES else 0
    led = [word for chunk in chunks[max(i - 4, 0) : i] for word in chunk.text.lower().split()]
    verbs = {*led} if led[-1:] == ["by"] else set()
    own = chunks[i].text.lower().split()[0]
    if first in MORE or own in ADDING or behind[:2] == ["on", "top"] or before in ADDING or GROW & verbs:
        return 1
    return -1 if first in LESS or SHRINK & verbs or (first == "off" and second in PARTING) else 0


def _judged(word: str, slot: str) -> Step:
    """Whether more or less is wanted of what is so much too high, too short, too much."""
    if word in ("high", "low"):
        return -1 if (word == "low") == (slot == "down") else 1
    return -1 if word in TOO_MUCH else 1 if word in TOO_LITTLE else 0


MORE = frozenset("more extra additional further longer".split())
LESS = frozenset("less fewer shorter".split())
GROW, SHRINK = frozenset(("increase", "raise", "bump", "extend")), frozenset(("reduce", "decrease", "lower", "shorten"))
COMPARATIVES = {"higher": "up", "lower": "down"}
PARTING = ("", ",", ".", "and", "it", "that")
ADDING = frozenset(("another", "additional", "extra", "an extra", "an additional", "add"))
"""Words behind, and before, an amount that is a difference."""

TOO_MUCH, TOO_LITTLE = (
    frozenset(words.split()) for words in ("far much many long big large wide", "short little small few")
)
"""Words behind an amount and "too" for what is so much too much, and for what is missing."""


def _shared(edit: E.Edit, chunks: Sequence[Chunk]) -> E.Edit:
    """A share by which something grows or shrinks as the factor that is left: "reduce by a quarter", "a tenth less"."""
    if not isinstance(edit, E.Rescale) or edit.change or edit.factor is None or not 0.0 < edit.factor < 1.0:
        return edit
    words = {word for chunk in chunks for word in chunk.text.lower().split()}
    for i in _where(chunks, edit.factor):
        before = chunks[i - 1].text.lower() if i else ""
        behind = chunks[i + 1].text.lower().split()[:1] if i + 1 < len(chunks) else []
        if behind == ["less"] or (before == "by" and words & SHRINKING):
            return replace(edit, factor=1.0 - edit.factor)
        if behind == ["more"] or (before == "by" and words & GROWING):
            return replace(edit, factor=1.0 + edit.factor)
    return edit


SHRINKING = frozenset("reduce decrease lower cut shrink less smaller slower shorten down".split())
GROWING = frozenset("increase raise bump more grow larger bigger extend up".split())
"""Words for what is to become less, and more, by a share."""


def given_up(edits: tuple[E.Edit, ...], said: Remark) -> tuple[E.Edit, ...]:
    """What gives up some changes as what gives up those that are named, or all but those that are to stay."""
    if not edits or not all(map(_gives_up, edits)):
        return edits
    goes = _named_with(LOSING, said)
    stays = _named_with(KEEPING, said) - _named_with(AS_IT_WAS, said)
    if stays and goes - stays:  # "keep the shift but not the slowing"
        return _drops(said, goes - stays)
    named = {*said.meant(said.pieces)}
    if edits == (E.Command(command="undo"),) and not named and "everything" in words_in(said.pieces):
        return (E.Command(command="restart"),)
    if not 0 < len(named) < len(said.before):
        return edits
    words, others = {*words_in(said.pieces)}, {*range(len(said.before))} - named
    losing, all_but = words & LOSING, words & {"rest", "else"} or ("but" in words and words & {"all", "everything"})
    if all_but:
        return _drops(said, others if losing or words & KEEPING else named)
    if (stays == named and not goes) or (words & KEEPING and not losing and not words & AS_IT_WAS):
        return _drops(said, others)
    gone = {i for i, frame in enumerate(said.before) for one in edits if not one.on or is_called(frame, one.on)}
    if len(said.before) == 1 or any(isinstance(one, E.Command) and one.steps > 1 for one in edits):
        return edits
    return _drops(said, named) if named < gone or named.isdisjoint(gone) else edits


def _gives_up(edit: E.Edit) -> bool:
    """Whether an edit gives up a change, or takes turns back."""
    return isinstance(edit, E.Drop) or (isinstance(edit, E.Command) and edit.command in ("undo", "restart"))


def _named_with(words: frozenset[str], said: Remark) -> set[int]:
    """The frames that are named in clauses with some words."""
    found = (said.meant(clause) for clause in said.clauses if not words.isdisjoint(words_in(clause)))
    return {i for frames in found for i in frames}


def _drops(said: Remark, frames: set[int]) -> tuple[E.Edit, ...]:
    """Edits that give up some frames."""
    return tuple(E.Drop(on=said.on(i)) for i in sorted(frames))


KEEPING = frozenset("only just keep kept retain stay".split())
AS_IT_WAS = frozenset("was were before original normal".split())
LOSING = frozenset(
    """drop lose forget without remove cancel no not never delete scrap cut out kill away throw skip off rid go goes
    except stop less undo""".split()
)
"""Words for what stays, and for what is given up."""
