"""References in feedback, and the results of resolving it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from ovita.instruct.tokens import Token
from ovita.paths.frame import OPPOSITE
from ovita.paths.scene import SceneObject


@dataclass(frozen=True)
class Resolution:
    """What feedback comes to.

    Args:
        kind: "tune" (turn knobs of the last policy), "rewrite" (another instruction), "again" (the last policy once
            more on the result), "undo", "redo", "restart", "accept", or "ask" (a question back).
        taken: What the words were taken to mean, as a sentence.
        values: New values of knobs by name: of the last policy, or of the one that is written for `instruction`.
        instruction: The instruction of a "rewrite", in words that stand on their own.
        begins: Which trajectory a "rewrite" is applied to: the one that the last turn began with, the current one, or
            the original (then the instruction holds all turns).
        steps: How many steps of the session "undo" takes back.
        question: What is asked back.
    """

    kind: Literal["tune", "rewrite", "again", "undo", "redo", "restart", "accept", "ask"]
    taken: str = ""
    values: Mapping[str, float | int] = field(default_factory=dict)
    instruction: str = ""
    begins: Literal["start", "current", "original"] = "start"
    steps: int = 0
    question: str = ""

    @property
    def certain(self) -> bool:
        """Whether it is valid with any writer: everything except rewordings and questions."""
        return self.kind not in ("rewrite", "ask")


FAMILY: dict[str, str] = {
    **dict.fromkeys(("speed", "pace", "velocity", "slowdown", "braking", "acceleration", "constant"), "speed"),
    **dict.fromkeys(("shift", "shifting", "offset", "displacement", "translation", "movement"), "shift"),
    **dict.fromkeys(("distance", "gap", "clearance", "detour", "approach", "avoidance"), "distance"),
    **dict.fromkeys(("wait", "waiting", "pause", "stop", "stopping", "halt"), "wait"),
    **dict.fromkeys(("extension", "continuation", "extend"), "extend"),
    **dict.fromkeys(("smooth", "smoothing"), "smooth"),
    **dict.fromkeys(("start", "goal"), ""),
}
"""Words and concepts to the family of changes that they mean."""

SENSE = {"slower": "slower", "faster": "faster", "closer": "closer", "near": "closer", "away": "away"}
"""Concepts that say which way a change of speed or distance goes."""

FAMILY_OF_ACTION: dict[str, str] = {
    "move": "shift",
    "closer": "distance",
    "farther": "distance",
    "keep_distance": "distance",
    "side": "distance",
    "stop": "wait",
    "move_start": "start",
    "move_goal": "goal",
}
"""Actions whose family does not bear their own name."""

SHAPES = frozenset("spiral circle eight zigzag wave hop hover mirror rotate tilt noise reverse average".split())
VAGUE = frozenset("it that this these those them the a an of to in by is was were be as one do did on at for".split())


@dataclass(frozen=True)
class Reference:
    """The referent of feedback: a conjunction of its non-empty fields.

    Args:
        families: Families of changes.
        sense: "slower", "faster", "closer", "away", or "".
        directions: Direction words.
        items: Objects.
        names: Words that must be part of a knob's name or meaning.
    """

    families: frozenset[str] = frozenset()
    sense: str = ""
    directions: frozenset[str] = frozenset()
    items: tuple[SceneObject, ...] = ()
    names: frozenset[str] = frozenset()

    def __bool__(self) -> bool:
        return bool(self.families or self.sense or self.directions or self.items or self.names)

    def fits(self, family: str, directions: frozenset[str], items: Sequence[SceneObject], *, sense: str = "") -> bool:
        """Whether a change of that family, in these directions, about these objects and of that sense, can be meant."""
        wanted = self.families | ({"speed"} if self.sense in ("slower", "faster") else set())
        if self.sense in ("closer", "away"):
            wanted = wanted | {"distance"}
        if not (wanted or self.directions or self.items):
            return False
        ends = wanted & {"start", "goal"}
        return (
            (not wanted or family in (ends or wanted))
            and (not self.directions or bool(self.directions & directions))
            and (not self.items or any(item is mine for item in items for mine in self.items))
            and not (self.sense and sense and self.sense != sense)
        )


def read_reference(tokens: Sequence[Token], known: frozenset[str] = frozenset()) -> Reference | None:
    """Read what tokens refer to.

    Args:
        tokens: As the built-in writer cuts them.
        known: Words that knobs are named by.

    Returns:
        The reference, or None if a word has no place in one.
    """
    families: set[str] = set()
    directions: set[str] = set()
    names: set[str] = set()
    items: list[SceneObject] = []
    sense = ""
    for token in tokens:
        word = token.text.lower()
        family = FAMILY.get(word, FAMILY.get(token.value, ""))
        if token.items:
            items += token.items
        elif word in known and not family:
            names.add(word)
            directions |= {word} & OPPOSITE.keys()
        elif token.kind == "concept" and token.value in ("start", "goal"):
            families.add(token.value)
        elif family:
            families.add(family)
        elif token.kind == "concept" and token.value in SHAPES:
            families.add(token.value)
        elif token.kind == "concept" and _direction(token.value):
            directions.add(_direction(token.value))
        elif token.kind == "concept" and token.value in SENSE:
            sense = SENSE[token.value] if token.value != "near" or not sense else sense
        elif token.kind not in ("filler", "join", "break") and word not in VAGUE:
            return None
    if items and sense == "closer" and not any(t.value == "closer" for t in tokens):
        sense = ""  # "near the cup" names a place
    return Reference(frozenset(families), sense, frozenset(directions), tuple(items), frozenset(names))


def _direction(concept: str) -> str:
    settled = {"lower": "down", "raise": "up"}.get(concept, concept)
    return settled if settled in OPPOSITE else ""
