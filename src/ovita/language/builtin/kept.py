"""Reading clauses that ask for no change: "keep the goal fixed", "without changing the speed"."""

from __future__ import annotations

from collections.abc import Sequence

from ovita.language.builtin.intents import Intent
from ovita.language.builtin.neighbours import DIRECTIONS
from ovita.language.builtin.reader import Reader
from ovita.language.builtin.regions import read_region

CHANGING = frozenset(
    "change changing alter altering modify modifying touch touching affect affecting move moving".split()
)
PATH = frozenset("path trajectory route shape course line".split())
STAYING = frozenset("same fixed unchanged unchanging untouched intact alone".split())

CHANGES = (
    "faster",
    "slower",
    "closer",
    "away",
    "more",
    "fewer",
    "increase",
    "decrease",
    "stop",
    "through",
    "over",
    *DIRECTIONS,
)


def read_kept(r: Reader) -> list[Intent]:
    """Keep the start and the goal where they are; don't change the speed; leave the first half untouched."""
    words = {w for t in r.tokens for w in t.text.lower().split()}
    denied = r.has("never") and bool(words & CHANGING) and not words & {"along", "throughout", "ever", "way"}
    stays = bool(words & STAYING) or ("where" in words and bool(words & {"are", "is"}))
    stays = stays or (r.has("keep") and {"in", "place"} <= words)
    stays = stays and not r.has("constant", "stop", "wait")
    if not (denied or stays) or r.has(*CHANGES) or any(t.items for t in r.tokens) or r.numbers(("m", "m/s", "deg")):
        return []
    targets = [name for name in ("start", "goal", "speed") if r.has(name)]
    if "speed" in targets and not denied and not words & {"unchanged", "untouched", "intact", "alone"}:
        return []  # "the same speed" is one speed everywhere
    if not targets and words & PATH:
        targets = ["path"]
    r.take(
        "start",
        "goal",
        "speed",
        "never",
        "same",
        "keep",
        "when",
        "stay",
        "through",
        "original",
        "whole",
        "only",
        "constant",
    )
    for i, token in enumerate(r.tokens):
        r.taken[i] = r.taken[i] or token.text.lower() in STAYING | CHANGING
    if not targets:
        region = read_region(r, speed=True)
        return [] if region.kind == "whole" else [Intent("same", mode="part", region=region)]
    return [Intent("same", mode=target) for target in targets]


def changes(intents: Sequence[Intent]) -> bool:
    """Whether anything at all is asked to change."""
    return not intents or any(intent.action != "same" for intent in intents)
