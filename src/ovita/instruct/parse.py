"""From clauses to intents: the families of instructions that the built-in writer knows.

Each rule looks for the concepts of one family, takes the tokens that it can explain, and leaves the rest; whatever
is left over at the end is reported with the words, never guessed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ovita.instruct.aims import in_frame, read_aim, read_axis, read_level, read_return
from ovita.instruct.clauses import ACTIONS, split
from ovita.instruct.conflicts import contradiction
from ovita.instruct.distances import read_approach, read_keep_distance
from ovita.instruct.ellipsis import afterwards, completed, located, nothing_more, spared
from ovita.instruct.intents import Intent, Region, Understood
from ovita.instruct.kept import changes, read_kept
from ovita.instruct.places import (
    read_endpoint,
    read_extend,
    read_move,
    read_resample,
    read_smooth,
    read_through,
    read_wait,
)
from ovita.instruct.reader import Reader
from ovita.instruct.shapes import SHAPES
from ovita.instruct.speeds import read_speed
from ovita.instruct.tokens import CHOICE, Token, tokenize
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array

HARMLESS = ("only", "whole", "stay", "original", "always", "afterwards", "keep")
"""Concepts that a clause may hold beside what its rule took."""


def parse(instruction: str, scene: Scene, path: Array | None = None) -> Understood:
    """Read an instruction.

    Args:
        instruction: As written.
        scene: Whose objects it may name.
        path: Positions (N, 3) [m], from which "the object nearest to the goal" is told.

    Returns:
        The intents in the order of the sentence, notes on corrected spellings, and every word without a place.
    """
    tokens, notes = tokenize(instruction, scene, path)
    intents: list[Intent] = []
    unplaced: list[str] = []
    radius: float | None = None
    for clause in split(tokens):
        r = Reader(clause)
        if r.has("threshold") and not _asks(r) and not any(t.items for t in clause):
            r.take("threshold")
            radius = r.number("", "m")
        elif not (intents and nothing_more(r, intents)):
            intents += _clause(r, intents)
        unplaced += r.left_over()
    if not intents and not unplaced:
        unplaced = instruction.split()
    intents = [in_frame(intent, scene.frame) for intent in intents]
    question = _choice(tokens) or ("" if unplaced else contradiction(intents))
    if not (question or unplaced or changes(intents)):
        question = "Everything is to stay as it is: what should change?"
    return Understood(tuple(spared(intents)), notes, tuple(unplaced), radius, question)


def _clause(r: Reader, earlier: list[Intent]) -> list[Intent]:
    found = _read(r) or _same_again(r, earlier)
    if found and r.has("there"):
        found = located(r, found, earlier)
    if found and _goes_on(found, earlier):
        found = [replace(intent, action="extend") for intent in found]
    found = afterwards(r, completed(r, found, earlier), earlier)
    return [_rest(intent, earlier) for intent in found]


def _choice(tokens: tuple[Token, ...]) -> str:
    """A question back where words fit several objects: "Which box: 'red box' or 'blue box'?"."""
    for token in tokens:
        if token.value == CHOICE and len(token.items) > 1:
            noun = token.text.split()[-1].lower()
            return f"Which {noun}: {' or '.join(repr(item.name) for item in token.items)}?"
    return ""


def _asks(r: Reader) -> bool:
    return r.has("near", "distance", *ACTIONS)


def _same_again(r: Reader, earlier: list[Intent]) -> list[Intent]:
    """Read "double the speed but halve it near the cup": a change of what the clause before was about."""
    if not earlier or earlier[-1].action != "speed" or not r.has("half", "double", "increase", "decrease"):
        return []
    return [replace(intent, text=r.text) for intent in r.attempt(lambda reader: read_speed(reader, implied=True))]


def _goes_on(found: list[Intent], earlier: list[Intent]) -> bool:
    """Read "after the goal go up and then left": the second shift goes on from the first."""
    beyond = bool(earlier) and earlier[-1].action == "extend" and bool(earlier[-1].directions)
    return beyond and earlier[-1].text.lower().startswith("after") and [i.action for i in found] == ["move"]


def _rest(intent: Intent, earlier: list[Intent]) -> Intent:
    """Resolve "the rest" and "the second" to what the clause before was not about; else to the second half."""
    if intent.region.kind != "rest":
        return intent
    last = next((i.region for i in reversed(earlier) if i.region.kind in ("first", "last", "after", "before")), None)
    if last is None:
        return replace(intent, region=Region("last", amount=0.5))
    if last.kind in ("after", "before"):
        return replace(intent, region=replace(last, kind="before" if last.kind == "after" else "after"))
    other = "last" if last.kind == "first" else "first"
    if last.counted or last.unit:
        return replace(intent, region=replace(last, kind=f"but_{last.kind}"))
    return replace(intent, region=Region(other, amount=1.0 - (last.amount or 0.5)))


def _read(r: Reader) -> list[Intent]:
    for rule in RULES:
        found = r.attempt(rule)
        if found:
            r.take(*HARMLESS)
            return [replace(intent, text=r.text) for intent in found]
    return []


RULES: tuple[Callable[[Reader], list[Intent]], ...] = (
    read_kept,
    read_aim,
    read_level,
    read_resample,
    *SHAPES,
    read_keep_distance,
    read_speed,
    read_wait,
    read_return,
    read_extend,
    read_smooth,
    read_approach,
    read_endpoint,
    read_through,
    read_axis,
    read_move,
)
"""The families, tried in this order; the first that explains a clause reads it."""
