"""Words that mean different things in different company: "lower the speed" and "go lower"."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ovita.instruct.neighbours import DIRECTIONS, PLAIN, UNKNOWN, Place, by_neighbours
from ovita.instruct.tokens import Token

__all__ = ["CHANGES", "DIRECTIONS", "SENSES", "SPEED", "settle"]

SPEED = frozenset({"speed", "faster", "slower", "constant", "m/s", "duration"})
"""Concepts, and the unit, that make a clause one about speed."""

CHANGES = frozenset({"increase", "decrease", "more", "fewer", "faster", "slower", "lower", "raise", "acceleration"})

SENSES: tuple[tuple[str, frozenset[str], str], ...] = (
    ("lower", frozenset({"speed", "m/s", "count", "distance"}), "decrease"),
    ("lower", frozenset(), "down"),
    ("raise", frozenset({"speed", "m/s", "count"}), "increase"),
    ("raise", frozenset(), "up"),
    ("drop", frozenset({"m"}), "down"),
    ("drop", frozenset({"speed", "m/s", "count", "distance", "waypoints"}), "decrease"),
    ("drop", frozenset(), "down"),
    ("shrink", frozenset({"distance", "speed", "count"}), "decrease"),
    ("shrink", frozenset(), "resize"),
    ("stretch", frozenset({"distance", "object"}), "increase"),
    ("stretch", frozenset({"goal", "m"}), "extend"),
    ("stretch", frozenset(), "resize"),
    ("longer", frozenset({"distance"}), "more"),
    ("longer", frozenset({"m", "whole"}), "extend"),
    ("longer", frozenset(), "more"),
    ("resize", frozenset({"speed", "m/s"}), "multiply"),
    ("withdraw", frozenset({"object"}), "away"),
    ("withdraw", frozenset(), "back"),
    ("hold", frozenset({"s", "step"}), "wait"),
    ("hold", frozenset({*DIRECTIONS}), "stay"),
    ("hold", frozenset({"speed", "constant", "steady", "distance", "height", "m/s", "away", "near", "closer"}), "keep"),
    ("hold", frozenset(), "wait"),
    ("remain", frozenset({"step", "s"}), "wait"),
    ("remain", frozenset(), "stay"),
    ("steady", CHANGES | {"gradual"}, "gradual"),
    ("steady", frozenset(), "constant"),
    ("advance", frozenset({"goal", "closer", "object", "near", *DIRECTIONS}), ""),
    ("advance", frozenset(), "front"),
    ("creep", frozenset({"closer", "away", "toward", *DIRECTIONS}), "slight"),
    ("creep", frozenset(), "slower"),
    ("around", SPEED, "near"),
    ("count", frozenset({"speed", "m/s"}), ""),
)
"""Concept, what must stand in its clause (any of these concepts, units or "object"; nothing: in all other cases), and
the concept that it then is ("": a filler). The first that fits counts."""


def settle(clause: Sequence[Token]) -> list[Token]:
    """Give each word of a clause the sense that it has there."""
    present = {t.value for t in clause if t.kind == "concept"}
    present |= {t.unit for t in clause if t.kind == "number" and t.unit} | {"object" for t in clause if t.items}
    settled = []
    for i, token in enumerate(clause):
        sense = by_neighbours(Place(clause, i, frozenset(present)))
        token = token if sense is None else _as(token, sense)
        for concept, company, becomes in SENSES:
            if token.kind == "concept" and token.value == concept and (not company or company & present):
                token = _as(token, becomes)
        settled.append(token)
    return _with_height(settled)


def _as(token: Token, concept: str) -> Token:
    if concept in (UNKNOWN, PLAIN):
        return Token("unknown" if concept == UNKNOWN else "filler", token.text)
    return replace(token, value=concept)


def _with_height(clause: list[Token]) -> list[Token]:
    """Turn "increase the altitude" into up; the word height itself says nothing more."""
    turned = {"increase": "up", "decrease": "down", "more": "up", "fewer": "down"}
    concepts = {t.value for t in clause if t.kind == "concept"}
    if "height" not in concepts or not concepts & {*turned, "up", "down"}:
        return clause
    return [
        Token("filler", t.text)
        if t.value == "height"
        else _as(t, turned[t.value])
        if t.kind == "concept" and t.value in turned
        else t
        for t in clause
    ]
