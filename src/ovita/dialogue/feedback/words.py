"""The words of feedback: lower case, without courtesies, spelt right."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

from ovita.instruct.lexicon import CONNECTIVES, filler, phrases, stems
from ovita.instruct.numbers import NUMBER_WORDS, UNITS
from ovita.instruct.spelling import distance
from ovita.paths.scene import Scene, canonical

SHORT = (
    (r"\b(that|it|what|there)'?s\b(?! (?:own|place))", r"\1 is"),
    (r"\bwon'?t\b", "will not"),
    (r"\b(do|does|did|is|was|were|would|should|could)n'?t\b", r"\1 not"),
    (r"\bi'd\b", "i would"),
    (r"\bi'm\b", "i am"),
    (r"\blet'?s\b", "let us"),
    (r"\bas well\b", "too"),
    (r"[ ,]+for (?:my|our) (?:taste|liking)\b", ""),
)
"""Contractions and what they stand for."""

WORDS = frozenset(
    """more less bit little slightly touch tad somewhat much lot way far further farther even still yet enough quite so
    too half double twice triple times third quarter instead rather only just again undo redo revert restore cancel
    forget discard drop skip without except back start over reset original scratch never mind other way direction
    opposite wrong same also everywhere perfect great good fine nice excellent exactly right correct thanks thank you
    keep leave alone was were before stop slow fast slower faster close closer high higher low lower strong stronger
    weak weaker big bigger small smaller meant mean said not no yes ok okay another one ones that it this as of and
    shift shifting move offset speed pace slowing slowdown last previous everything all first end undone please sorry
    once repeat turn change changes two three reduce increase""".split()
)
"""Words that feedback is made of: a misspelt word is read as the one of these that it resembles most."""

_COURTESY = (
    r"please|pls|kindly|thanks|thank you|thx|could you|can you|would you|will you|i would like(?: you)? to|"
    r"i would like(?: it)?|i would prefer(?: it)?|i want(?: you to| it)?|i think|i guess|i believe|"
    r"hmm+|hm+|um+|uh+|uhm|oh|ah|oops|hey|well|actually|maybe|perhaps|wait|sorry|my mistake|pardon|"
    r"if you (?:do not mind|can|could|would)|if possible|for me|to me|now|let us|then|so|yes|yeah|alright|ok|okay"
)
_LEAD = re.compile(rf"^(?:(?:{_COURTESY})\b[ ,.!?;]*)+")
_TAIL = re.compile(rf"(?:[ ,.!?;]+(?:{_COURTESY.replace('now|', '').replace('|then|so', '')}))+$")
_NO = re.compile(
    r"^(?:no+|nope|nah|not like that|not there|that is (?:not right|wrong)|wrong (?:object|one|place|thing|spot))"
    r"\b[ ,.!?;:]+(?=\S)"
)
_INSTEAD = re.compile(r"(?<=\S)[ ,]+(?:instead|rather)$")
_REST = re.compile(
    r"[ ,.;]+(?:(?:and|but) )?(?:keep|leave) (?:all |everything )?(?:the rest|the other things?|else)"
    r"(?: as it is| the same| unchanged| alone| like that)?$"
)


@dataclass(frozen=True)
class Said:
    """Feedback without what says nothing.

    Args:
        text: The words that are left, lower case, single spaces, commas kept.
        corrects: Whether it began with "no" or the like, or ended with "sorry" or "instead".
        denied: What follows a "no" without a comma, as in "no shift", or "".
    """

    text: str
    corrects: bool = False
    denied: str = ""


def plain(said: str, scene: Scene) -> Said:
    """Strip courtesies and correct spellings; what is left may be empty."""
    text = " ".join(said.lower().replace("’", "'").split())
    for short, full in SHORT:
        text = re.sub(short, full, text)
    corrects = bool(re.search(r"\b(?:sorry|oops|actually)\b", text))
    text = _spelt(text, scene)
    denied = ""
    while True:
        before = text
        text = text.strip(" ,.!?;:-")
        text = _TAIL.sub("", _LEAD.sub("", text)) or text
        text = _REST.sub("", text)
        shorter = _INSTEAD.sub("", _NO.sub("", text))
        denied = shorter if text == f"no {shorter}" else denied
        corrects, text = corrects or shorter != text, shorter
        text = re.sub(r"^(?:but|and)\b(?! near| also| the | at | around)[ ,]*(?=\S)", "", text)
        if text == before:
            return Said(re.sub(r"[!?;:]+", "", text), corrects, denied)


def _spelt(text: str, scene: Scene) -> str:
    known = _known() | {word for item in scene for word in canonical(item.name).split()}
    return re.sub(r"[a-z]{4,}", lambda match: _corrected(match.group(), known), text)


def _corrected(word: str, known: frozenset[str] | set[str]) -> str:
    if any(stem in known for stem in stems(word)):
        return word
    slips = 2 if len(word) >= 8 else 1
    near = [known for known in WORDS if len(known) > 2 and distance(word, known) <= slips]
    return min(near, key=lambda known: (sorted(known) != sorted(word), known[0] != word[0], known), default=word)


@cache
def _known() -> frozenset[str]:
    """Words that are spelt right."""
    listed = {word for phrase in phrases() for word in phrase}
    courtesies = set(re.findall(r"[a-z]+", _COURTESY)) | {"like", "mistake", "mind", "prefer"}
    units = {word for unit in UNITS for word in unit}
    return frozenset({*WORDS, *listed, *filler(), *CONNECTIVES, *units, *NUMBER_WORDS, *courtesies})
