"""How much: other values for slots, more or less of what was done, or a factor on it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.degrees import Degree
from ovita.instruct.editing import OPPOSITE, directions_of, scale_of, slots
from ovita.instruct.frames import name_of
from ovita.instruct.remarks import (
    ADJECTIVES,
    DIRECTIONS,
    FACTORS,
    JUDGING,
    SENSES,
    Candidate,
    Phrase,
    Remark,
    cues_in,
    heading,
    names,
    senses_of,
)

NAMED = frozenset(("radius", "turns", "size", "duration"))
"""Cues that are names of slots."""

ORDINALS = ("first", "last", "middle", "second")

COUNTS = {"once": 1.0, "twice": 2.0, "thrice": 3.0}
"""Words for numbers of turns."""

_Where: TypeAlias = tuple[int, str]
"""The number of a frame, and one of its slots."""


def numbers(said: Remark) -> Iterator[Candidate]:
    """Other values for slots."""
    stated = {p: p.number for p in said.active if p.number} or _turn_words(said)
    if asks_for_limit(said):
        return
    old = _repeated(stated, said)
    places = {p: where for p in stated if p not in old and (where := _place_of(p, stated, old, said)) is not None}
    found = {where: _value(p, stated[p], where, said) for p, where in places.items()}
    if found:
        named = [p for p in said.active if any(names(p, said.before[i]) for i, _ in found)]
        cued = said.cued("more", "less", "enough", "meant", "not", "only", *NAMED)
        extra = [p for p in cued if SENSES.get(p.concept) not in DIRECTIONS]
        yield Candidate(tuple(found.values()), (*named, *extra, *old, *places))


def asks_for_limit(said: Remark) -> bool:
    """Whether a bound on the height is asked for, and no other shift: "limit the altitude to 2 metres instead"."""
    shifted = any(isinstance(frame, F.Shift) for frame in said.before)
    return shifted and not LIMITING.isdisjoint(word for p in said.pieces for word in p.text.split())


LIMITING = frozenset("limit maximum max cap".split())
"""Words of a bound."""


def _place_of(
    piece: Phrase, stated: Mapping[Phrase, F.Quantity], old: Mapping[Phrase, _Where], said: Remark
) -> _Where | None:
    """Where a number belongs: instead of the one that is taken back beside it, else where it fits best."""
    alone = len(stated) == len(old) + 1
    instead = [where for p, where in old.items() if p.clause == piece.clause or alone]
    return instead[0] if len(old) == len(instead) == 1 else _slot_of(piece, stated[piece], said)


def _value(piece: Phrase, q: F.Quantity, where: _Where, said: Remark) -> E.Edit:
    """A slot's other value; five "times" are turns."""
    on, slot = said.on(where[0]), where[1]
    frame = said.before[where[0]]
    step: Any = _step(piece, said) if slot in frame.quantities or isinstance(frame, F.Approach) else 0
    q = replace(q, unit="") if (slot, q.unit) == ("turns", "x") else q
    return E.Set(on=on, slot=slot, quantity=q, step=step)


def _repeated(stated: Mapping[Phrase, F.Quantity], said: Remark) -> dict[Phrase, _Where]:
    """The numbers that hold already and are to be others, with where: the second of "15 cm instead of 10 cm"."""
    known = [(i, slot, had) for i, frame in enumerate(said.before) for slot, had in frame.quantities.items()]
    told = stated if len(stated) > 1 else stated.keys() - set(said.wanted)
    return {piece: (i, slot) for piece in told for i, slot, had in known if _alike(stated[piece], had)}


def _alike(q: F.Quantity, had: F.Quantity) -> bool:
    values = (had.value,) if q.unit else (had.value / scale_of(had), had.value, had.value * 100)
    return any(abs(q.value - v) <= 1e-6 * max(1.0, abs(v)) for v in values) and q.unit in ("", had.unit)


def _turn_words(said: Remark) -> dict[Phrase, F.Quantity]:
    """Once and twice as numbers of turns."""
    counting = said.turning and said.texts.isdisjoint(("as", "of"))
    return {p: F.Quantity(COUNTS[p.text], "turns") for p in said.active if counting and p.text in COUNTS}


def _slot_of(piece: Phrase, q: F.Quantity, said: Remark) -> _Where | None:
    """The frame and slot that a number fits best: named, of its unit, already filled, in the last frame."""
    named = _named_slots(piece, q, said)
    scores: dict[_Where, float] = {}
    counted = ("turns",) if not q.unit and q.value in range(1, 11) else ()
    for i in _fitting(q, said):
        held = said.before[i].quantities
        for rank, (slot, units) in enumerate(slots(said.before[i]).items()):
            if slot in held and _surely(q.unit, slot, held[slot].unit):
                return i, slot
            if q.unit in units and not _another_measure(q.unit, held.get(slot)):
                known = (2.0 + 0.5 * (slot in counted)) * (slot in held)
                scores[i, slot] = 3.0 * (slot in named) + known - 0.1 * rank + 0.01 * i
    return max(scores, key=lambda where: scores[where], default=None)


def _fitting(q: F.Quantity, said: Remark) -> Sequence[int]:
    """The frames that a number may be for: those that it is said of and that hold its unit, else any that do or may."""
    held = [{one.unit for one in frame.quantities.values()} for frame in said.before]
    taken = [set[str]().union(*slots(frame).values()) for frame in said.before]
    holds, takes = _having(q.unit, held), _having(q.unit, taken)
    said_of = {*said.targets}
    return sorted(said_of & holds or (holds if q.unit else said_of & takes) or said_of & takes or said_of or takes)


def _having(unit: str, of: Sequence[Collection[str]]) -> set[int]:
    return {i for i, units in enumerate(of) if unit in units}


def _named_slots(piece: Phrase, q: F.Quantity, said: Remark) -> set[str]:
    """The slots that the words beside a number name; those of all clauses where it has no unit."""
    behind = cues_in(said.active[said.active.index(piece) + 1 :][:1]) & NAMED
    if q.unit == "" and behind:
        return behind
    around = [p for p in said.active if p.clause == piece.clause or not q.unit]
    return cues_in(around) & NAMED | {SENSES.get(p.concept, "") for p in around}


def _surely(unit: str, slot: str, had: str) -> bool:
    """Whether a number can only be for a slot: metres for metres a second, times for turns."""
    return (unit, had) == ("m", "m/s") or (unit == "x" and slot == "turns")


def _another_measure(unit: str, had: F.Quantity | None) -> bool:
    """Whether a share or multiple would take the place of an amount that is none."""
    return unit in FACTORED and had is not None and had.unit not in FACTORED


FACTORED = ("%", "x")
"""Units of shares and multiples."""


def _step(piece: Phrase, said: Remark) -> int:
    """1 or -1 if a number is more or less than before ("5 cm higher", "increase it by 0.1"), 0 if it is the value."""
    i = said.active.index(piece)
    if step := _step_before([p for p in said.active[:i] if p.clause == piece.clause]):
        return step
    behind = next((p for p in said.active[i + 1 : i + 3] if "turns" not in p.cues), Phrase("", 0))
    if behind.text in STEPS or not behind.text.endswith("er"):
        return STEPS.get(behind.text, 0)
    return _along(behind, set().union(*(senses_of(said.before[k]) for k in said.targets)))


def _step_before(before: Sequence[Phrase]) -> int:
    """What the words before a number say of its being more or less than before."""
    last, cues = before[-1].text if before else "", cues_in(before)
    if last in ("another", "extra") or (last == "by" and "more" in cues):
        return 1
    return -1 if last == "by" and "less" in cues else 0


STEPS = {"more": 1, "further": 1, "extra": 1, "farther": 1, "less": -1, "fewer": -1}
"""Words behind a number that is how much more or less."""


def amounts(said: Remark) -> Iterator[Candidate]:
    """More, less, or a factor on it."""
    sized = [i for i in said.targets if slots(said.before[i]) or isinstance(said.before[i], F.Smooth | F.Curve)]
    named = said.cued("more", "less", "weak", "slight", "large", "enough", "not", "same", "again")
    used = (*named, *_naming(said, sized))
    factor = _factor(said)
    share = None if factor is None else _share_of_speed(said, sized, factor[0])
    if share is not None and factor is not None:
        yield Candidate((share,), (*used, *factor[1], *said.of("original", "around", "slower")), sure=True)
    elif sized and factor is not None:
        yield _scaled(said, sized, lambda on: E.Rescale(on=on, factor=factor[0]), (*used, *factor[1]))
    elif signs := _signs(said, sized):
        yield _more_or_less(said, signs, used)


def _naming(said: Remark, sized: Sequence[int]) -> list[Phrase]:
    """The pieces that name one of some frames, also by its object: "not so slow at the cup"."""
    fitting = [p for p in said.active if any(names(p, said.before[i]) for i in sized)]
    placed = [p for p in fitting if p.items] if said.cued("less", "not") else []
    return [*(p for p in fitting if p.cues), *placed, *(said.of("near", "at") if placed else ())]


def _share_of_speed(said: Remark, sized: Sequence[int], factor: float) -> E.Edit | None:
    """So much of the speed itself where it is to be still slower: "even slower, a third of what it was"."""
    slower = [i for i in sized if "slower" in senses_of(said.before[i]) and _slower_still(said)]
    if factor >= 1.0 or not slower:
        return None
    return E.Set(on=said.on(slower[-1]), slot="amount", quantity=F.Quantity(round(factor, 2), "x", "to"))


def _slower_still(said: Remark) -> bool:
    """Whether "slower" is said, and what a share is of: "of what it was", "the speed"."""
    texts = {word for p in said.active for word in p.text.split()}
    return "slower" in texts and not texts.isdisjoint(("was", "original", "speed", "normal"))


def _signs(said: Remark, sized: Sequence[int]) -> dict[int, tuple[int, tuple[Phrase, ...]]]:
    """Of which frames more (1) or less (-1) is wanted, with the words for it; of all where no word says of which."""
    signs = {i: sensed for i in sized if (sensed := _sensed(said, said.before[i]))}
    generic = -1 if said.cued("less") else 1 if said.cued("more", "weak") else 0
    return signs or ({i: (generic, ()) for i in sized} if generic else {})


def _more_or_less(
    said: Remark, signs: Mapping[int, tuple[int, tuple[Phrase, ...]]], used: Sequence[Phrase]
) -> Candidate:
    """More of some frames and less of others where each has words of its own; else of the last one."""
    degree = _degree(said)
    changes: dict[int, Any] = {i: "more" if sign > 0 else "less" for i, (sign, _) in signs.items()}
    used = (*used, *(p for _, sensed in signs.values() for p in sensed))
    if len({p for _, sensed in signs.values() for p in sensed[:1]}) == len(signs) > 1:
        edits = tuple(E.Rescale(on=_way(said, i), change=change, degree=degree) for i, change in changes.items())
        return Candidate(edits, used)
    last = changes[list(signs)[-1]]
    return _scaled(said, list(signs), lambda on: E.Rescale(on=on, change=last, degree=degree), used)


def _degree(said: Remark) -> Degree | None:
    """How much more or less: "a bit", "a lot", "more, more, more!"."""
    cues = cues_in(p for p in said.active if not said.judged(p))
    if "slight" in cues:
        return "slight"
    return "large" if "large" in cues or [p.text for p in said.active].count("more") > 2 else None


def _way(said: Remark, i: int) -> str:
    """How an edit names a frame, or the one of its directions that is said."""
    known = directions_of(said.before[i])
    ways = [w for p in said.active if (w := SENSES.get(p.concept, "") or heading(p)) in known]
    return ways[-1] if len(known) > 1 and ways else said.on(i)


def _scaled(said: Remark, where: list[int], edit: Callable[[str], E.Edit], used: tuple[Phrase, ...]) -> Candidate:
    """One edit of the last of some frames; a question where they are of several kinds."""
    kinds = tuple(dict.fromkeys(name_of(said.before[i]) for i in where))
    if len(kinds) > 1:
        return Candidate((), used, "Which do you mean: " + " or ".join(kinds) + "?", kinds)
    return Candidate((edit(_way(said, where[-1])),), used)


_Factor: TypeAlias = tuple[float, tuple[Phrase, ...]]
"""A factor, and the pieces that it is read from."""


def _factor(said: Remark) -> _Factor | None:
    """A factor on what was done: half of that, three times as much, 50 % more."""
    found = (read(said, i) for i in range(len(said.active)) for read in (_factor_word, _factor_number))
    return next((factor for factor in found if factor is not None), None)


def _factor_word(said: Remark, i: int) -> _Factor | None:
    """Half, twice, a third; not in "the second half" and "go round twice"."""
    piece = said.active[i]
    word = next((cue for cue in FACTORS if cue in piece.cues), "")
    part = any(p.concept in ORDINALS for p in said.active[max(i - 1, 0) : i])
    turns = word == "twice" and bool(_turn_words(said))
    return (FACTORS[word], (piece,)) if word and not (part or turns) else None


def _factor_number(said: Remark, i: int) -> _Factor | None:
    """Three times, 50 % more."""
    piece, q = said.active[i], said.active[i].number
    if q is None:
        return None
    if q.unit == "x" and not said.counted(q):
        return q.value, said.active[i : i + 2]
    near = [p for p in said.active[max(i - 3, 0) : i + 2] if p.cues & {"more", "less"}]
    if near and q.unit == "%":
        return 1 - q.value if "less" in cues_in(near) else 1 + q.value, (piece, *near)
    return None


def _sensed(said: Remark, frame: F.SemanticFrame) -> tuple[int, tuple[Phrase, ...]] | None:
    """1 if more of a frame is wanted, -1 if less, by words that say which way: "slower", "too close", "not so high"."""
    senses = senses_of(frame)
    found = (_sensed_at(said, i, senses) for i in range(len(said.active)))
    return next((sensed for sensed in found if sensed is not None), None)


def _sensed_at(said: Remark, i: int, senses: Collection[str]) -> tuple[int, tuple[Phrase, ...]] | None:
    """What a word says of it, with the pieces that it is read from; None where it says nothing of that kind."""
    piece = said.active[i]
    along = _along(piece, senses)
    before = [p for p in said.active[max(i - 2, 0) : i] if p.clause == piece.clause]
    judged, settled = _judgement(said, piece, before, said.active[i + 1 : i + 3])
    amount = piece.cues & {"slight", "large"} and not (judged or piece.text.endswith("er"))
    if not along or amount:
        return None
    if settled:
        return (-along if judged and not _resolved(piece) else along), (piece, *before)
    if said.cued("less"):
        return -1, (piece,)
    graded = said.cued("more", "weak") or (_sense(piece) not in DIRECTIONS and said.cued("slight", "large"))
    return (along, (piece,)) if graded else None


def _sense(piece: Phrase) -> str:
    return ADJECTIVES.get(piece.text) or SENSES.get(piece.concept, "")


def _along(piece: Phrase, senses: Collection[str]) -> int:
    """1 if a piece says what more of something is, -1 if what less of it is, else 0."""
    if piece.text in ("further", "farther"):
        return 0
    sense = _sense(piece)
    return 1 if sense in senses else -1 if OPPOSITE.get(sense) in senses else 0


def _resolved(piece: Phrase) -> bool:
    """Whether a phrase of several words turns its adjective round by itself: "too close"."""
    return piece.text.startswith(("too ", "so ", "less ", "that "))


def _judgement(said: Remark, piece: Phrase, before: Sequence[Phrase], behind: Sequence[Phrase]) -> tuple[bool, bool]:
    """Whether words beside a piece say that it is too much of it; and whether it says which way by itself."""
    enough = "enough" in cues_in(behind[:1])
    against = any(p.text in JUDGING or p.cues & {"less", "not"} for p in before)
    judged = (against and not enough) or "less" in cues_in(behind)
    graded = piece.text in ADJECTIVES and bool(judged or enough or said.cued("more", "weak"))
    return judged, graded or _resolved(piece) or any(word.endswith("er") for word in piece.text.split())
