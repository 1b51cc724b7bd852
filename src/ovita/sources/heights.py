"""A height that a way is told to keep over the ground: "at a height of 40 cm", "at least one metre above the floor"."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ovita.instruct.numbers import amount_at

HIGH = frozenset("height altitude high elevation".split())
GROUND = frozenset("ground floor table surface tabletop".split())
ABOVE = frozenset("above over off from".split())
LOWEST = frozenset("least minimum min".split())
NO, LOWER = frozenset("no not never".split()), frozenset("lower below under".split())
AROUND = frozenset(
    """at of the a constant steady cruise cruising stay staying keep keeping hold holding maintain maintaining remain
    remaining level air in all times always your its travelling flying about with go fly be it that is and please
    by on""".split()
)
"""Words that stand around a height and tell nothing else."""


@dataclass(frozen=True)
class Level:
    """A height over the ground to go at between the ends of the way.

    Args:
        height: [m].
        least: Whether higher is as good.
    """

    height: float
    least: bool


def read_level(words: Sequence[str]) -> Level | None:
    """The height that some words tell, if they tell nothing else; a height not to exceed is none."""
    said = set(words)
    found = [(k, amount) for k in range(len(words)) if (amount := amount_at(words, k)) is not None]
    if not found or found[0][1].unit != "m" or not (said & HIGH or (said & GROUND and said & ABOVE)):
        return None
    k, amount = found[0]
    least = bool(said & LOWEST or (said & NO and said & LOWER))
    bounding = LOWEST | NO | LOWER | {"than"} if least else frozenset[str]()
    others = {*words[:k], *words[k + amount.used :]}
    return Level(amount.value, least) if others <= HIGH | GROUND | ABOVE | AROUND | bounding else None
