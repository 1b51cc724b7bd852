"""Reading clauses that ask for no change: "keep the goal fixed", "without slowing down"."""

from __future__ import annotations

from collections.abc import Sequence

from ovita.instruct.distances import VERBS
from ovita.instruct.intents import Intent
from ovita.instruct.neighbours import DIRECTIONS
from ovita.instruct.reader import Reader
from ovita.instruct.regions import read_region

CHANGING = frozenset(
    "change changing alter altering modify modifying touch touching affect affecting move moving".split()
)
PATH = frozenset("path trajectory route shape course line".split())
STAYING = frozenset("same fixed unchanged unchanging untouched intact alone".split())

PLACES = frozenset("near first last second middle half third quarter waypoints after before start goal".split())

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
    if _only_elsewhere(r):
        r.take("never", "when")
        region = read_region(r, speed=True)
        if region.kind != "whole":
            return [Intent("same", mode="part", region=region)]
    if _keeps_pace(r):
        r.take("never", "slower", "faster", "keep", "speed")
        return [Intent("same", mode="speed")]
    words = {w for t in r.tokens for w in t.text.lower().split()}
    denied = r.has("never") and bool(words & CHANGING) and not words & {"along", "throughout", "ever", "way"}
    stays = bool(words & STAYING) or ("where" in words and bool(words & {"are", "is"}))
    stays = stays or (r.has("keep") and {"in", "place"} <= words)
    stays = stays or r.says("as it is", "as they are", "as is", "the way it is", "the way they are")
    stays = stays and not r.has("constant", "stop", "wait")
    if not (denied or stays) or r.has(*CHANGES) or any(t.items for t in r.tokens) or r.numbers(("m", "m/s", "deg")):
        return []
    targets = [name for name in ("start", "goal", "speed") if r.has(name)]
    if ("start" not in targets and words & {"endpoints", "ends"}) or {"end", "points"} <= words:
        targets = ["start", "goal"]
    if "speed" in targets and not denied and not words & {"unchanged", "untouched", "intact", "alone"}:
        return []  # "the same speed" is one speed everywhere
    if not targets and words & PATH:
        targets = ["path"]
    if not targets and r.take("whole"):
        targets = ["rest"]
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


def _only_elsewhere(r: Reader) -> bool:
    """Whether a clause is nothing but "not near the plate", "but not in the last half"."""
    said = {t.value for t in r.tokens if t.kind == "concept"}
    plain = not any(w in VERBS for t in r.tokens for w in t.text.lower().split())
    return "never" in said and len(said) > 1 and said <= {"never", "when", *PLACES} and plain


def _keeps_pace(r: Reader) -> bool:
    """Whether a clause is nothing but "without slowing down"."""
    said = {t.value or t.kind for i, t in enumerate(r.tokens) if not r.taken[i]}
    return said == {"keep", "speed"} or (said in ({"never", "slower"}, {"never", "faster"}) and r.hears("without"))


def changes(intents: Sequence[Intent]) -> bool:
    """Whether anything at all is asked to change."""
    return not intents or any(intent.action != "same" for intent in intents)
