"""Whether an utterance looks back at what was done, or is an instruction of its own.

The rules read all of it as feedback, or nothing. Where the network is asked too, a few grounds count points for each
way to take it; their sums say how likely it is meant.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from types import UnionType
from typing import TypeAlias

from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.amounts import asks_for_limit
from ovita.instruct.editing import apply, directions_of, is_called
from ovita.instruct.frames import frame_objects
from ovita.instruct.lexicon import DETERMINERS
from ovita.instruct.meaning import canonical_part, same
from ovita.instruct.referee import DO
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
        return bool(self.fresh.frames) and self.fresh.confidence >= DO

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
    gives_up = _gives_up(edits) and not _some(edits, E.Also) and (it.places or bool(it.said.cued("keep")))
    return gives_up or _guesses(edits, it.said)


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
    known = {way for frame in said.before for way in directions_of(frame)}
    return bool(ways - said_ways - known) and not any(p.unknown for p in said.active)


UNSURE = 0.4
"""How likely risky edits of the network are held to be at most."""

PLACED = frozenset("start goal first last middle before after between near".split())
"""Concepts of places on the path."""


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
    if not edits or not (_only(edits, E.Rescale) or _gives_up(edits)):
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
    mere = (_only(edits, E.Also) and it.whole and not it.said.adds) or (_only(edits, E.Set) and asks_for_limit(it.said))
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
        "both agree": (3.0, lambda it, heard: _agree(it, heard)),
        "plain": (1.5, lambda it, heard: is_plain(it)),
        "counts turns": (4.5, lambda it, heard: _counts_turns(it.best.edits)),
    },
    "network": {"confidence": (1.35, lambda it, heard: _odds(heard.edits.confidence))},
}
"""What speaks for taking an utterance as an instruction, or as the feedback that the rules or the network read, and
how much, as logarithms of odds; `training/feedback_points.py` fits them on voices that the network had not seen."""
