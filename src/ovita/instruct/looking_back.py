"""Whether an utterance looks back at what was done, or is an instruction of its own.

The rules read all of it as feedback, or nothing. Where the network is asked too, a few grounds count points for each
way to take it; their sums say how likely it is meant.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from types import UnionType
from typing import Literal, TypeAlias

from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.amounts import asks_for_limit
from ovita.instruct.chunks import Chunk
from ovita.instruct.editing import apply, directions_of, is_called, slots
from ovita.instruct.frames import frame_objects
from ovita.instruct.lexicon import DETERMINERS
from ovita.instruct.meaning import canonical_part, same
from ovita.instruct.numerals import is_digits
from ovita.instruct.remarks import SENSES, Candidate, Remark, heading, words_in
from ovita.paths.scene import Scene

EVEN = 0.5
"""How likely feedback has to be meant, among the ways to take it, to be done without being shown first."""

FEW, SHORT = 10, 6
"""Words and marks of feedback that is so short that the rules' reading counts more; words of an utterance that is so
short that a comparative in it looks back."""

BACKWARD = frozenset(
    """again that that's those these too not only just instead than still yet even enough same also was were
    been had did said meant mean sorry alone other opposite wrong change part thing no nope nah never rather as so fine
    ok okay good better further another undo redo forget cancel scrap drop kill lose remove yes original""".split()
)
"""Words that speak of what was done, or of what is meant instead."""


TOO_MUCH, TOO_LITTLE = (frozenset(words.split()) for words in ("far much long big large wide", "short little small"))
"""Words behind an amount and "too" for what is so much too much, and for what is missing."""


def in_excess(
    edits: tuple[E.Edit, ...], said: Sequence[Chunk], before: Sequence[F.SemanticFrame]
) -> tuple[E.Edit, ...]:
    """Edits with an amount that is too much or missing as so much less or more: "3 cm too high", "take 3 cm off".

    A bare number is in the unit of the length that it takes the place of, and what is given up of several changes is
    what was done about the one object that is named.
    """
    numbers = [chunk.number.value for chunk in said if chunk.kind == "Qn"]
    things = {name for chunk in said if chunk.kind == "OBJ" for name in chunk.names}
    edits = tuple(_about_named(_in_its_unit(edit, before, numbers), before, things) for edit in edits)
    words = {chunk.q.value: _excess(*[*said[i + 1 : i + 3], END, END][:2]) for i, chunk in enumerate(said) if chunk.q}
    return _exceeding(edits, said, before, words) if any(words.values()) else edits


def _exceeding(
    edits: tuple[E.Edit, ...], said: Sequence[Chunk], before: Sequence[F.SemanticFrame], words: Mapping[float, str]
) -> tuple[E.Edit, ...]:
    """Edits with amounts behind which words say that so much is too much or missing."""
    known = list(slots(before[0])) if len(before) == 1 else []
    match edits:
        case (E.Rescale(change="more" | "less" as change, factor=None),) if len(known) == 1:
            amount = next(chunk.q for chunk in said if chunk.q and words[chunk.q.value])
            return (E.Set(slot=known[0], quantity=amount, step=1 if change == "more" else -1),)
    return tuple(_stepped(edit, words) for edit in edits)


def _in_its_unit(edit: E.Edit, before: Sequence[F.SemanticFrame], numbers: Sequence[float]) -> E.Edit:
    """An edit whose bare number is in the unit of the length that it takes the place of: "two is enough" of 3 cm."""
    if not isinstance(edit, E.Set):
        return edit
    guesses = (1.0,) if not edit.quantity.unit else (1.0, 0.01, 0.001)
    bare = next((n for n in numbers for unit in guesses if math.isclose(n * unit, edit.quantity.value)), None)
    stated = (pair for frame in reversed(before) for pair in _stated(frame))
    had = next((q for slot, q in stated if edit.slot in (slot, q.role)), None)
    if bare is None or had is None or had.unit != "m" or had.value <= 0.0:
        return edit
    return replace(edit, quantity=replace(edit.quantity, value=_likelier(bare, had), unit="m", said=""))


def _about_named(edit: E.Edit, before: Sequence[F.SemanticFrame], things: Collection[str]) -> E.Edit:
    """What gives up several changes as what gives up those at the one object that is named."""
    if not isinstance(edit, E.Drop) or len(things) != 1:
        return edit
    gone = [frame for frame in before if not edit.on or is_called(frame, edit.on)]
    about = [frame for frame in gone if not {*frame.named, *frame.part.places}.isdisjoint(things)]
    (thing,) = things
    return replace(edit, on=f"{edit.on} {thing}".strip()) if 0 < len(about) < len(gone) else edit


def _likelier(bare: float, had: F.Quantity) -> float:
    """A bare number in the unit that a length was said in, or in metres, whichever is nearer to that length [m]."""
    said = had.said.rstrip(UNITS)
    number = float(said) if is_digits(said) else had.value * (100.0 if had.value < 1.0 else 1.0)  # centimetres, if bare
    likely = [value for value in (bare * had.value / (number or 1.0), bare) if value > 0.0]
    return min(likely, key=lambda one: abs(math.log(one / had.value)), default=bare)


def _stated(frame: F.SemanticFrame) -> list[tuple[str, F.Quantity]]:
    """The quantities of a frame by their slots, also those along directions."""
    return [*frame.quantities.items(), *((way, q) for way, q in getattr(frame, "offset", ()) if q is not None)]


UNITS = "abcdefghijklmnopqrstuvwxyz\"'″ "


def _stepped(edit: E.Edit, words: Mapping[float, str]) -> E.Edit:
    """An edit as so much less or more, if words say that of its amount."""
    if not isinstance(edit, E.Set) or edit.step:
        return edit
    return replace(edit, step=_less_or_more(edit, words.get(edit.quantity.value, "")))


END = Chunk("dot", "", (0, 0))
"""Stands behind the last chunk."""


def _excess(behind: Chunk, then: Chunk) -> str:
    """The word behind an amount for what is too much, or missing; "" where there is none."""
    word = behind.text.lower()
    if (word == "off" and then.kind in ("dot", "comma", "and")) or word == "shorter":
        return "much"
    return "short" if word == "longer" else then.text.lower() if behind.kind == "too" else ""


def _less_or_more(edit: E.Set, word: str) -> Literal[-1, 0, 1]:
    """Whether so much less (-1) or more (1) is wanted of what is too much or missing."""
    if word in ("high", "low"):
        return -1 if (word == "low") == (edit.slot == "down") else 1
    return -1 if word in TOO_MUCH else int(word in TOO_LITTLE)  # type: ignore[return-value]


@dataclass(frozen=True)
class Retrospect:
    """An utterance as feedback, beside the instruction that it would be.

    Args:
        said: The utterance.
        best: How all of it is read as feedback; without edits and question if it is not.
        fresh: What it is as an instruction.
    """

    said: Remark
    best: Candidate
    fresh: F.Reading

    @property
    def reading(self) -> F.Reading:
        """The feedback."""
        return F.Reading(edits=self.best.edits, question=self.best.question, asked=self.best.asked)

    @property
    def found(self) -> bool:
        """Whether it can be read as feedback."""
        return bool(self.best.edits or self.best.question)

    @property
    def whole(self) -> bool:
        """Whether it reads whole as an instruction."""
        return bool(self.fresh.frames) and not (self.fresh.unread or self.fresh.question or self.fresh.improper)

    @property
    def places(self) -> bool:
        """Whether an object or a place on the path is named."""
        return any(p.items or p.concept in PLACED for p in self.said.active)

    @property
    def recalls(self) -> bool:
        """Whether a word speaks of what was done, or it is little more than a comparative."""
        words, edits = words_in(self.said.active), self.best.edits
        scaled = "it" in words and any(isinstance(edit, E.Rescale) and edit.factor for edit in edits)
        known = _some(edits, E.Command | E.Again | E.Flip) or ("without" in words and _some(edits, E.Drop))
        return scaled or known or not BACKWARD.isdisjoint(words) or self._compares(words)

    def _compares(self, words: Sequence[str]) -> bool:
        """Whether words are little more than a comparative: "a bit slower"."""
        first = next((piece for piece in self.said.active if piece.text not in LEADING), None)
        short = len(words) <= SHORT and first is not None and first.content
        return short and any(word.endswith("er") or word in ("more", "less") for word in words)


LEADING = DETERMINERS | {"haha", "hehe", "lol"}
"""Words before a comparative that say nothing of what it is about."""

EXPLAINING = E.Command(command="explain")


def _some(edits: Sequence[E.Edit], kinds: type[E.Edit] | UnionType) -> bool:
    """Whether some edits are of some kinds."""
    return any(isinstance(edit, kinds) for edit in edits)


def _only(edits: Sequence[E.Edit], kind: type[E.Edit] | UnionType) -> bool:
    """Whether all edits are of a kind."""
    return all(isinstance(edit, kind) for edit in edits)


def looks_back(it: Retrospect) -> bool:
    """Whether the rules alone take an utterance as feedback rather than as an instruction."""
    return EXPLAINING in it.best.edits or (it.found and not it.said.elsewhere and (it.recalls or not it.whole))


def is_plain(it: Retrospect) -> bool:
    """Whether it is feedback of few words, which the rules hardly ever misread."""
    return len(it.said.pieces) <= FEW and looks_back(it)


@dataclass(frozen=True)
class Hearing:
    """What the network says of an utterance.

    Args:
        edits: As feedback.
        alone: As an instruction of its own.
    """

    edits: F.Reading
    alone: F.Reading


def weighed(it: Retrospect, heard: Hearing) -> F.Reading | None:
    """The feedback of the rules or of the network, with how likely it is meant; None if an instruction is likelier.

    A question of what the path is like is none, but one of what was done or why.
    """
    explains = all(edit == EXPLAINING for edit in it.best.edits)
    if heard.alone.asks and explains and not it.said.cued("explain"):
        return None
    readings = ways(it, heard)
    points = {who: sum(worth * float(fact(it, heard)) for worth, fact in GROUNDS[who].values()) for who in readings}
    best = max(points, key=lambda who: points[who])
    reading = readings[best]
    likely = 1 / sum(math.exp(value - points[best]) for value in points.values())
    if _earlier(() if reading is None else reading.edits, it.said):
        return F.Reading(question="From where on should it be so: from how far before, or from which waypoint?")
    if reading is None:
        return heard.edits if _goes_on_there(heard.edits.edits, it.said) else None
    if best == "network" and _is_risky(reading.edits, it):
        likely = min(likely, UNSURE)
    return replace(reading, edits=_of_the_wait(reading.edits, it.said), confidence=likely)


def _of_the_wait(edits: tuple[E.Edit, ...], said: Remark) -> tuple[E.Edit, ...]:
    """Edits in which how long is about the one wait among other changes: "stay there twice as long"."""
    waits = [i for i, frame in enumerate(said.before) if isinstance(frame, F.Wait)]
    if len(waits) != 1 or {"long", "longer"}.isdisjoint(words_in(said.pieces)):
        return edits
    on = said.on(waits[0])
    return tuple(replace(edit, on=on) if isinstance(edit, E.Rescale) else edit for edit in edits)


def _is_risky(edits: Sequence[E.Edit], it: Retrospect) -> bool:
    """Whether the network's edits guess, or take all back where a place is named or something is to stay."""
    flips = _some(edits, E.Flip) and bool(it.said.cued("meant")) and not it.said.cued("flip")
    gives_up = _gives_up(edits) and (it.places or bool(it.said.cued("keep")))
    return gives_up or flips or _guesses(edits, it.said) or _is_everywhere(edits, it.said)


def _is_everywhere(edits: Sequence[E.Edit], said: Remark) -> bool:
    """Whether edits change an amount all along where a part of it is named: "make that 0.3 for the second half"."""
    parts = [frame.part for frame in said.before if frame.part]
    return not parts and _only(edits, E.Set | E.Rescale) and any(p.concept in PARTS for p in said.active)


def _goes_on_there(edits: Sequence[E.Edit], said: Remark) -> bool:
    """Whether an instruction is about the part of the path that was changed before: "and slower there"."""
    parts = [canonical_part(frame.part) for frame in said.before if frame.part]
    there = [canonical_part(edit.frame.part) in parts for edit in edits if isinstance(edit, E.Also)]
    return "there" in words_in(said.pieces) and len(there) == len(edits) > 0 and all(there)


def _earlier(edits: Sequence[E.Edit], said: Remark) -> bool:
    """Whether more of a speed, or nothing, was read where it is to begin earlier."""
    paced = bool(said.before) and all(isinstance(frame, F.Pace) for frame in said.before)
    earlier = not {"earlier", "sooner"}.isdisjoint(words_in(said.pieces)) and not _names_others(said)
    return paced and earlier and (not edits or _some(edits, E.Rescale))


def _counts_turns(edits: Sequence[E.Edit]) -> bool:
    """Whether edits are about so many turns, of which the network knows nothing."""
    return any(
        edit.on.startswith("turn ") if isinstance(edit, E.Drop) else isinstance(edit, E.Command) and edit.steps > 1
        for edit in edits
    )


def _gives_up(edits: Sequence[E.Edit]) -> bool:
    """Whether edits take back all that was done."""
    back = ("undo", "restart")
    return any(e.command in back if isinstance(e, E.Command) else isinstance(e, E.Drop) and not e.on for e in edits)


def _guesses(edits: Sequence[E.Edit], said: Remark) -> bool:
    """Whether edits add a direction that no word says: "plus 4 cm"."""
    offsets = [getattr(edit.frame, "offset", ()) for edit in edits if isinstance(edit, E.Also)]
    ways = {way for offset in offsets for way, _ in offset}
    said_ways = {SENSES.get(p.concept, "") or heading(p) for p in said.active}
    return bool(ways - said_ways) and not any(p.unknown for p in said.active)


UNSURE = 0.4
"""How likely risky edits of the network are held to be at most."""

PLACED = frozenset("start goal first last middle before after between near".split())
"""Concepts of places on the path."""

PARTS = (PLACED | {"second"}) - {"start", "goal", "near"}
"""Concepts of parts of the path."""


def ways(it: Retrospect, heard: Hearing) -> dict[str, F.Reading | None]:
    """The ways to take an utterance, by the names of GROUNDS: the feedback that each is, None for an instruction."""
    if it.best.sure:
        return {"rules": it.reading}
    found: dict[str, F.Reading | None] = {"instruction": None}
    if _of_nothing_done(it, heard):
        return found
    if it.best.question or not (_idle(it.best.edits, it.said.before) or _anew(it, heard)):
        found["rules"] = it.reading
    if not (heard.edits.question or _is_odd(it, heard.edits.edits) or _agree(it, heard)):
        found["network"] = heard.edits
    return found


def _of_nothing_done(it: Retrospect, heard: Hearing) -> bool:
    """Whether words are about a kind of change that was not made: "a little higher" after a change of speed alone.

    To give up all is about nothing that was done, too, where an object is named that no change is about.
    """
    edits = (*it.best.edits, *heard.edits.edits)
    if not edits or not (_only(edits, E.Rescale | E.Set) or _gives_up(edits)):
        return False
    if _gives_up(edits) and _names_others(it.said):
        return True
    words = {*words_in(piece for piece in it.said.pieces if piece.concept != "near")}
    meant = [kind for kind, called in KINDS.items() if not words.isdisjoint(called)]
    return bool(meant) and not any(_is_of(kind, frame) for kind in meant for frame in it.said.before)


def _names_others(said: Remark) -> bool:
    """Whether a remark names objects, and none that a change is about."""
    named = {name for piece in said.active for name in piece.items}
    return bool(named) and named.isdisjoint(name for frame in said.before for name in frame_objects(frame))


def _is_of(kind: str, frame: F.SemanticFrame) -> bool:
    """Whether a frame is a change of a kind."""
    match frame:
        case F.Pace(amount=F.Quantity(unit="s")):
            return kind in ("pace", "time")
        case F.Pace():
            return kind == "pace"
        case F.Wait() | F.NoStop() | F.StopAt():
            return kind != "pace" and (kind != "height" or (isinstance(frame, F.Wait) and bool(frame.aim)))
        case F.Shift() | F.MoveEnd(offset=[_, *_]) | F.Bound() | F.Side():
            upright = not {"up", "down"}.isdisjoint(directions_of(frame))
            return (kind == "height" and upright) or kind == "room" or isinstance(frame, F.MoveEnd)
        case F.Approach() | F.Clearance() | F.Avoid():
            return kind == "room"
        case F.Keep():
            return False
    return kind != "pace"


KINDS = {
    "pace": frozenset("speed pace fast faster slow slower quick quicker boost slowdown slowing".split()),
    "height": frozenset("high higher low lower height".split()),
    "time": frozenset("long longer wait waiting seconds".split()),
    "room": frozenset("close closer near nearer far farther wide wider distance room".split()),
}
"""What people say changes of a kind are about."""


def _is_odd(it: Retrospect, edits: Sequence[E.Edit]) -> bool:
    """Whether edits of the network are hardly meant: they only add, go against the rules, or change nothing."""
    mere = (_only(edits, E.Also) and not it.said.adds) or (_only(edits, E.Set) and asks_for_limit(it.said))
    against = _turns_round(it.best.edits, edits) or _leaves_an_amount(edits, it.said) or _drops_unnamed(edits, it.said)
    repeats = _some(edits, E.Again) and bool(it.best.edits) and not _some(it.best.edits, E.Again)  # "lower it again"
    return mere or against or repeats or _idle(edits, it.said.before)


def _drops_unnamed(edits: Sequence[E.Edit], said: Remark) -> bool:
    """Whether a change is given up that no word names."""
    named = [said.before[i] for i in said.meant(said.naming)]
    dropped = [edit.on for edit in edits if isinstance(edit, E.Drop) and edit.on]
    return any(not any(is_called(frame, on) for frame in named) for on in dropped)


def _anew(it: Retrospect, heard: Hearing) -> bool:
    """Whether a whole instruction that looks back at nothing only sets a number: "go left by 5 cm" after "up"."""
    sets = it.whole and not it.recalls and _only(it.best.edits, E.Set)
    return sets and not (_agree(it, heard) and heard.edits.confidence > heard.alone.confidence)


def _turns_round(one: Sequence[E.Edit], other: Sequence[E.Edit]) -> bool:
    """Whether edits are less of something where others are more of it."""
    changes = [{_sense(edit) for edit in edits if isinstance(edit, E.Rescale)} for edits in (one, other)]
    return any({a, b} == {"more", "less"} for a in changes[0] for b in changes[1])


def _sense(edit: E.Rescale) -> str:
    """Whether a change is to more or to less of something."""
    return edit.change or ("more" if (edit.factor or 1.0) > 1.0 else "less")


def _leaves_an_amount(edits: Sequence[E.Edit], said: Remark) -> bool:
    """Whether a step back leaves out how far: "go back by 0.1"."""
    numbers = [p.number for p in said.pieces if p.number]
    told = any(q.unit not in ("", "step") or q.value % 1.0 or any(map(heading, said.pieces)) for q in numbers)
    return told and _only(edits, E.Command)


def _idle(edits: Sequence[E.Edit], before: tuple[F.SemanticFrame, ...]) -> bool:
    """Whether edits change nothing: a number for a slot that takes none of its unit."""
    sure = _counts_turns(edits) or _some(edits, E.Command | E.Again | E.Rescale)
    return not sure and apply(edits, before, Scene()) == before


def _agree(it: Retrospect, heard: Hearing) -> bool:
    """Whether the feedback of the rules and of the network comes to the same, but for numbers, which the rules read."""
    one, other = it.best.edits, heard.edits.edits
    if not (one and other) or _commands(one) != _commands(other):
        return False
    alike = _only(one, E.Set) and _slots_set(one) == _slots_set(other)
    return alike or same(*(apply(edits, it.said.before, Scene()) for edits in (one, other)))


def _commands(edits: Sequence[E.Edit]) -> list[E.Edit]:
    return [edit for edit in edits if isinstance(edit, E.Command)]


def _slots_set(edits: Sequence[E.Edit]) -> list[str]:
    """The slot that each edit sets; "" for other edits."""
    return [edit.slot if isinstance(edit, E.Set) else "" for edit in edits]


def _odds(likely: float) -> float:
    likely = min(max(likely, 0.02), 0.98)
    return math.log(likely / (1 - likely))


Ground: TypeAlias = Callable[[Retrospect, Hearing], float | bool]

GROUNDS: dict[str, dict[str, tuple[float, Ground]]] = {
    "instruction": {
        "whole": (0.33, lambda it, heard: it.whole),
        "looks back": (-1.30, lambda it, heard: it.recalls),
        "other kinds of change": (1.09, lambda it, heard: it.said.elsewhere),
        "to the network": (0.36, lambda it, heard: _odds(heard.alone.confidence) if heard.alone.frames else 0.0),
    },
    "rules": {
        "both agree": (1.96, lambda it, heard: _agree(it, heard)),
        "plain": (4.5, lambda it, heard: is_plain(it)),
        "counts turns": (4.5, lambda it, heard: _counts_turns(it.best.edits)),
    },
    "network": {"confidence": (1.35, lambda it, heard: _odds(heard.edits.confidence))},
}
"""What speaks for taking an utterance as an instruction, or as the feedback that the rules or the network read, and
how much, as logarithms of odds; `training/feedback_points.py` fits them on voices that the network had not seen."""
