"""Changing a clause: on another part of the path, or with other words in it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

from ovita.dialogue.feedback.rewording import Part, Piece, places_of, understood_as
from ovita.instruct.clauses import split
from ovita.instruct.draft import OPPOSITE
from ovita.instruct.intents import WHOLE
from ovita.instruct.reader import Reader
from ovita.instruct.regions import read_region
from ovita.instruct.tokens import Token, tokenize
from ovita.paths.scene import Scene

_REGION_LEADS = ("", "near ", "near the ", "when passing ", "in ", "in the ", "for ", "at ", "at the ")
_REGION_ENDS = (
    (re.compile(r"(?:(?:at|near|towards) )?(?:the )?(?:very )?(?:end|goal)(?: of .*)?"), "in the last quarter"),
    (re.compile(r"(?:(?:at|near) )?(?:the )?(?:very )?(?:start|beginning)(?: of .*)?"), "in the first quarter"),
)
_WORD_OF = {"front": "forward", "back": "backward"}


def moved(part: Part, words: str, scene: Scene) -> Part | None:
    """A clause on another part of the path, or None if it cannot be said so."""
    if len(part.pieces) != 1:
        return None
    piece = part.pieces[0]
    action = _without_region(part, piece, scene)
    phrases = [lead + words for lead in _REGION_LEADS] if words else [""]
    phrases += [phrase for pattern, phrase in _REGION_ENDS if words and pattern.fullmatch(words)]
    for phrase in phrases:
        text = f"{action} {phrase}".strip()
        understood = understood_as(text, scene)
        if understood is None or len(understood.intents) != 1:
            continue
        intent = understood.intents[0]
        placed = intent.region != WHOLE if words else intent.region == WHOLE
        rest = replace(intent, region=piece.intent.region, text=piece.intent.text) == piece.intent
        if placed and rest and intent.region != piece.intent.region:
            return Part(text, (replace(piece, intent=intent),))
    return None


def _without_region(part: Part, piece: Piece, scene: Scene) -> str:
    """The words of a clause without those that name a part of the path."""
    text = part.text
    for begin, end in reversed(_region_places(part, piece, scene)):
        text = text[:begin] + text[end:]
    return " ".join(text.split())


def region_words(part: Part, piece: Piece, scene: Scene) -> str:
    """The words of a clause that name a part of the path."""
    return " ".join(part.text[begin:end] for begin, end in _region_places(part, piece, scene))


def _region_places(part: Part, piece: Piece, scene: Scene) -> list[tuple[int, int]]:
    """Where those words stand."""
    clauses = split(tokenize(part.text, scene)[0])
    if piece.intent.region == WHOLE or len(clauses) != 1:
        return []
    clause = clauses[0]
    reader = Reader(clause)
    before = list(reader.taken)
    read_region(reader, speed=piece.intent.action == "speed")
    gone = [i for i, taken in enumerate(reader.taken) if taken and not before[i]]
    for i in list(gone):
        while i > 0 and clause[i - 1].kind == "filler" and clause[i - 1].text.lower() not in ("it", "go", "move"):
            i -= 1
            gone.append(i)
    places = places_of(part.text, clause)
    return [places[i] for i in sorted(set(gone))] if places else []


def replaced(part: Part, scene: Scene, word_for: Callable[[Token], str | None]) -> Part | None:
    """A clause with other words in place of some tokens; None if there is none, or it would not be understood."""
    text = part.text
    tokens = tokenize(text, scene)[0]
    places = places_of(text, tokens)
    done = False
    for token, (begin, end) in reversed(list(zip(tokens, places, strict=False))):
        word = word_for(token)
        if word is None:
            continue
        head, tail = text[:begin], text[end:]
        if word in OPPOSITE:
            if word not in ("left", "right"):
                head = re.sub(r"\b(?:to|towards|toward) the $", "", head)
            word = _WORD_OF.get(word, word)
        elif word.endswith((" to", " from")):
            tail = re.sub(r"^ (?:to|from|of)\b", "", tail)
        text, done = head + word + tail, True
    understood = understood_as(text, scene)
    if not done or understood is None or len(understood.intents) != len(part.pieces):
        return None
    pieces = [replace(piece, intent=intent) for piece, intent in zip(part.pieces, understood.intents, strict=True)]
    return Part(text, tuple(pieces))


def direction_of(token: Token) -> str:
    """The direction that a token names, or ""."""
    value = {"lower": "down", "raise": "up"}.get(token.value, token.value)
    return value if token.kind == "concept" and value in OPPOSITE else ""
