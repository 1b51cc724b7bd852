"""Whether an utterance looks back at what was done, or is an instruction of its own.

The reader reads it both ways; a few grounds beside how sure it is say which one is meant.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import UnionType

from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.editing import apply
from ovita.instruct.facts import UNKNOWN
from ovita.instruct.frames import frame_objects, name_of
from ovita.instruct.lexicon import DETERMINERS
from ovita.instruct.referee import DO
from ovita.instruct.remarks import Remark, heading, words_in
from ovita.paths.scene import Scene

EVEN = 0.5
"""How likely feedback has to be meant, among the ways to take it, to be done without being shown first."""

SHORT = 6
"""Words of an utterance that is so short that a comparative in it looks back."""

BACKWARD = frozenset(
    """again that that's those these too not only just instead than still yet even enough same also was were
    been had did said meant mean sorry alone other opposite wrong change part thing no nope nah never rather as so fine
    ok okay good better further another undo redo forget cancel scrap drop kill lose remove yes original""".split()
)
"""Words that speak of what was done, or of what is meant instead."""


@dataclass(frozen=True)
class Hearing:
    """An utterance as the reader hears it after a turn.

    Args:
        said: The utterance.
        edits: As feedback.
        alone: As an instruction of its own.
    """

    said: Remark
    edits: F.Reading
    alone: F.Reading

    @property
    def whole(self) -> bool:
        """Whether it reads surely as an instruction."""
        return bool(self.alone.frames) and self.alone.confidence >= DO

    @property
    def recalls(self) -> bool:
        """Whether a word speaks of what was done, or it is little more than a comparative."""
        words, edits = words_in(self.said.pieces), self.edits.edits
        scaled = "it" in words and any(isinstance(edit, E.Rescale) and edit.factor for edit in edits)
        known = _some(edits, E.Command | E.Again | E.Flip) or ("without" in words and _some(edits, E.Drop))
        return scaled or known or not BACKWARD.isdisjoint(words) or self._compares(words)

    def _compares(self, words: Sequence[str]) -> bool:
        """Whether words are little more than a comparative: "a bit slower"."""
        first = next((piece for piece in self.said.pieces if piece.text.lower() not in LEADING), None)
        short = len(words) <= SHORT and first is not None and first.kind not in UNKNOWN
        return short and any(word.endswith("er") or word in ("more", "less") for word in words)


LEADING = DETERMINERS | {"haha", "hehe", "lol", "even", "still"}
"""Words before a comparative that say nothing of what it is about."""

EXPLAINING = E.Command(command="explain")
EXPLAINED = frozenset("why did done change changed changes altered happened explain explanation reason clarify".split())
"""Words of a question of what was done, or why, and not of what the path is like."""


def _some(edits: Sequence[E.Edit], kinds: type[E.Edit] | UnionType) -> bool:
    """Whether some edits are of some kinds."""
    return any(isinstance(edit, kinds) for edit in edits)


def _only(edits: Sequence[E.Edit], kind: type[E.Edit] | UnionType) -> bool:
    """Whether all edits are of a kind."""
    return all(isinstance(edit, kind) for edit in edits)


def weighed(heard: Hearing) -> F.Reading | None:
    """The feedback that an utterance is, with how likely it is meant; None if an instruction is likelier.

    A question of what the path is like is none, but one of what was done or why.
    """
    said, edits = heard.said, heard.edits.edits
    if heard.alone.asks and all(edit == EXPLAINING for edit in edits) and EXPLAINED.isdisjoint(words_in(said.pieces)):
        return None
    likely = _feedback(heard)
    meant = bool(edits) and likely >= EVEN and not _is_odd(heard)
    if (asked := _asked_back(heard, meant=meant)) is not None:
        return asked
    if not meant:
        return None
    return replace(heard.edits, confidence=min(likely, UNSURE) if _is_risky(edits, said) else likely)


def _asked_back(heard: Hearing, *, meant: bool) -> F.Reading | None:
    """The question where it is open which change is meant, or from where on it should be so; else None."""
    said, edits = heard.said, heard.edits.edits
    if len(said.before) > 1 and not edits and heard.edits.question and said.cued("more", "less"):
        kinds = tuple(name_of(frame) for frame in said.before)
        return F.Reading(question="Which do you mean: " + " or ".join(kinds) + "?", asked=kinds)
    if _earlier(edits if meant and heard.edits.confidence >= DO else (), said):
        return F.Reading(question="From where on should it be so: from how far before, or from which waypoint?")
    return None


def grounds(heard: Hearing) -> dict[str, float]:
    """What speaks for an instruction or against it, by the names of GROUNDS."""
    words, alone = words_in(heard.said.pieces), heard.alone
    return {
        "always": 1.0,
        "whole": float(heard.whole),
        "looks back": float(heard.recalls),
        "other kinds": float(heard.said.elsewhere),
        "alone": _odds(alone.confidence) if alone.frames else 0.0,
        "points": float(not POINTING.isdisjoint(words)),
        "moves": float(_moves(heard.said)),
        "long": max(len(words) - SHORT, 0) / SHORT,
        "edits": -_odds(heard.edits.confidence),
        "only new": float(_only(heard.edits.edits, E.Also)),
    }


POINTING = frozenset("it that this there them those these".split())
"""Words for what was spoken of before."""

GROUNDS = {
    "always": -2.9, "whole": -0.37, "looks back": -1.88, "other kinds": 1.36, "alone": 0.73, "points": -0.27,
    "moves": 0.59, "long": 1.62, "edits": 1.0, "only new": 2.75,
}  # fmt: skip
"""How much each ground counts for taking an utterance as an instruction, as logarithms of odds;
`training/feedback_points.py` fits them on voices that the network had not seen."""


def _feedback(heard: Hearing) -> float:
    """How likely an utterance is meant as feedback."""
    facts = grounds(heard)
    return 1.0 / (1.0 + math.exp(sum(points * facts[name] for name, points in GROUNDS.items())))


def _is_risky(edits: Sequence[E.Edit], said: Remark) -> bool:
    """Whether edits take all back where a place is named or something is to stay."""
    places = any(p.names or p.kind in PLACED for p in said.pieces)
    return _gives_up(edits) and not _some(edits, E.Also) and (places or bool(said.cued("keep")))


def _earlier(edits: Sequence[E.Edit], said: Remark) -> bool:
    """Whether more of a speed, or nothing, was read where it is to begin earlier."""
    paced = bool(said.before) and all(isinstance(frame, F.Pace) for frame in said.before)
    earlier = not {"earlier", "sooner"}.isdisjoint(words_in(said.pieces)) and not _names_others(said)
    whole = any(isinstance(edit, E.Restrict) and not edit.part for edit in edits)
    return paced and earlier and (not edits or _some(edits, E.Rescale) or whole)


def _gives_up(edits: Sequence[E.Edit]) -> bool:
    """Whether edits take back all that was done."""
    back = ("undo", "restart")
    return any(e.command in back if isinstance(e, E.Command) else isinstance(e, E.Drop) and not e.on for e in edits)


UNSURE = 0.4
"""How likely risky edits of the network are held to be at most."""

PLACED = frozenset("start goal first last middle before after between near".split())
"""Concepts of places on the path."""


def _names_others(said: Remark) -> bool:
    """Whether a remark names objects, and none that a change is about."""
    named = {name for piece in said.pieces for name in piece.names}
    return bool(named) and named.isdisjoint(name for frame in said.before for name in frame_objects(frame))


def _is_odd(heard: Hearing) -> bool:
    """Whether edits are hardly meant: they add a mere instruction, set a bound, reverse, or change nothing."""
    said, edits = heard.said, heard.edits.edits
    odd = (
        _only(edits, E.Also) and heard.whole and not said.adds and _added(edits) == heard.alone.frames,
        _only(edits, E.Set) and _asks_for_limit(said),
        _some(edits, E.Flip) and REVERSING.issuperset(words_in(said.pieces)),
        _only(edits, E.Set | E.Replace) and heard.whole and not heard.recalls and _moves(said),
    )
    return any(odd) or _leaves_an_amount(edits, said) or _idle(edits, said.before)


def _added(edits: Sequence[E.Edit]) -> tuple[F.SemanticFrame, ...]:
    """The frames that edits add."""
    return tuple(edit.frame for edit in edits if isinstance(edit, E.Also))


def _moves(said: Remark) -> bool:
    """Whether an utterance begins as one that moves the path, whatever was done before: "go left by 5 cm"."""
    words = [word for word in words_in(said.pieces) if word not in LEADING]
    return words[:1] != [] and words[0] in MOVING and any(map(heading, said.pieces))


MOVING = frozenset("go move shift slide fly travel drive steer head nudge push pull stay keep pass walk drift".split())
"""Verbs with which what moves the path begins."""

REVERSING = frozenset("reverse it that this the path route way please now then".split())
"""All words of an utterance that asks for the way back, not for the other direction of a change."""


def _asks_for_limit(said: Remark) -> bool:
    """Whether a bound on the height is asked for, and no other shift: "limit the altitude to 2 metres instead"."""
    shifted = any(isinstance(frame, F.Shift) for frame in said.before)
    return shifted and not LIMITING.isdisjoint(words_in(said.pieces))


LIMITING = frozenset("limit maximum max cap".split())
"""Words of a bound."""


def _leaves_an_amount(edits: Sequence[E.Edit], said: Remark) -> bool:
    """Whether a step back leaves out how far: "go back by 0.1"."""
    numbers = [p.q for p in said.pieces if p.q]
    return _only(edits, E.Command) and any(q.unit not in ("", "step", "x") or q.value % 1.0 for q in numbers)


def _idle(edits: Sequence[E.Edit], before: tuple[F.SemanticFrame, ...]) -> bool:
    """Whether edits change nothing: a number for a slot that takes none of its unit."""
    whole = _some(edits, E.Command | E.Again | E.Rescale) or any(edit.on.startswith("turn ") for edit in edits)
    return not whole and apply(edits, before, Scene()) == before


def _odds(likely: float) -> float:
    likely = min(max(likely, 0.02), 0.98)
    return math.log(likely / (1 - likely))
