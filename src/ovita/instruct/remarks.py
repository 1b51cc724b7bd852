"""An utterance about what was just done in pieces: phrases of feedback, objects, numbers, and what they name."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, TypeAlias

from ovita.instruct import frames as F
from ovita.instruct.chunks import cut
from ovita.instruct.editing import directions_of, name_among
from ovita.instruct.frames import name_of
from ovita.instruct.lexicon import FEEDBACK, concept_at, concepts, stems
from ovita.instruct.numerals import amount_at, is_digits
from ovita.instruct.objects import GENERIC, Catalog, Mention, singular
from ovita.instruct.spelling import respelt
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array
from ovita.units import symbol

SKIPPED = frozenset(
    """the a an it that this these those them my your its his her our please pls really very quite thing things bloody
    damn ever""".split()
)
"""Words that phrases of feedback are matched without."""

GAPS = SKIPPED | {"all", "back", "right"}

SHORT = (
    ("’", "'"), ("n't", " not"), ("'s ", " is "), ("'ll", " "), ("'d ", " "), ("'re", " "), ("'ve", " "), ("'m ", " "),
)  # fmt: skip
SENSES = {
    "faster": "faster", "slower": "slower", "closer": "closer", "away": "farther", "withdraw": "farther", "up": "up",
    "raise": "up", "down": "down", "lower": "down", "left": "left", "right": "right", "front": "front", "back": "back",
    "longer": "longer", "curvature": "bent", "stretch": "larger", "shrink": "smaller",
}  # fmt: skip
DIRECTIONS = ("left", "right", "front", "back", "up", "down")
SAME_AS = {"slight": "slight", "more": "more", "fewer": "less", "double": "twice", "half": "halve", "undo": "undo"}
"""Concepts of the other word files that are cues of feedback too."""

NOUNS: dict[str, tuple[str, ...]] = {
    "of_pace": ("pace",), "of_move": ("move", "end"), "of_farther": ("farther", "closer", "clearance"),
    "of_wait": ("wait", "hover", "stop"), "of_smooth": ("smooth",), "of_return": ("return",),
    "of_circle": ("circle",),
    "faster": ("pace",), "slower": ("pace",), "speed": ("pace",), "constant": ("pace",), "wait": ("wait",),
    "hop": ("hop",), "hover": ("hover",), "mirror": ("mirror",), "rotate": ("rotate",), "tilt": ("tilt",),
    "spiral": ("spiral",),
    "circle": ("circle",), "eight": ("eight",), "zigzag": ("zigzag",), "wave": ("wave",), "extend": ("extend",),
    "straight": ("straighten",), "resize": ("resize",), "curvature": ("curve",), "smooth": ("smooth",),
    "reverse": ("reverse",), "height": ("height", "move", "hover"), "distance": ("farther", "closer", "clearance"),
    "away": ("farther", "clearance"), "closer": ("closer",), "waypoints": ("waypoints",),
    "noise": ("shake",),
}  # fmt: skip
"""The frames that a word of feedback, or a concept, can mean."""


@dataclass(frozen=True, eq=False)
class Phrase:
    """Some words of an utterance: an object, a number, a phrase of feedback, a concept, or a word that is unknown."""

    text: str
    clause: int
    cues: frozenset[str] = frozenset()
    concept: str = ""
    items: tuple[str, ...] = ()
    number: F.Quantity | None = None

    @property
    def content(self) -> bool:
        """Whether it says something that should be read."""
        return bool(self.items or self.number or self.cues or self.concept)


def words_in(pieces: Iterable[Phrase]) -> list[str]:
    """The words of some pieces, in order."""
    return [word for piece in pieces for word in piece.text.split()]


@cache
def _phrases() -> dict[str, list[tuple[tuple[str, ...], str]]]:
    """The phrases of feedback without skipped words, by their first word, each with its concept."""
    found: dict[str, list[tuple[tuple[str, ...], str]]] = {}
    for concept, listed in concepts(FEEDBACK).items():
        for phrase in listed:
            words = tuple(w for w in phrase.replace("'t", "t").split() if w not in SKIPPED) or tuple(phrase.split())
            found.setdefault(words[0], []).append((words, concept))
    return found


def _forms(word: str) -> tuple[str, ...]:
    """A word and what it is inflected from, comparatives aside."""
    return (word, *(s for s in stems(word) if len(s) > 3)) if word.endswith(("s", "ed", "ing", "in")) else (word,)


def _cues_at(words: Sequence[str], i: int) -> tuple[frozenset[str], int]:
    """The concepts of the longest phrase of feedback at a word, and how many words it takes."""
    found: set[str] = set()
    most = taken = 0
    for first in _forms(words[i]):
        for phrase, concept in _phrases().get(first, ()):
            used = _matched(phrase, words, i)
            if used and len(phrase) >= most:
                found = found | {concept} if len(phrase) == most else {concept}
                most, taken = len(phrase), used
    return frozenset(found), taken


def _matched(phrase: Sequence[str], words: Sequence[str], i: int) -> int:
    at = i + 1
    for wanted in phrase[1:]:
        while at < len(words) and words[at] in GAPS and words[at] != wanted:
            at += 1
        if at >= len(words) or wanted not in _forms(words[at]):
            return 0
        at += 1
    return at - i


def pieces_of(
    text: str, scene: Scene, before: Sequence[F.SemanticFrame], positions: Array | None
) -> tuple[Phrase, ...]:
    """An utterance in pieces, each the longest phrase that begins there."""
    for short, full in SHORT:
        text = f" {text.lower()} ".replace(short, full)
    catalog = Catalog(scene, positions)
    words, _ = respelt([word.lower() for word in cut(text)], catalog)
    earlier = tuple(item for frame in before for item in scene if item.name in frame.named)
    found: list[Phrase] = []
    i = clause = 0
    while i < len(words):
        clause += words[i] in ("but", "although", "though")
        piece, used = _piece(words, i, catalog, earlier, clause)
        clause += piece.text in (".", ",", ";", ":", "!", "?")
        found.append(piece)
        i += used
    return tuple(found)


def _piece(
    words: Sequence[str], i: int, catalog: Catalog, earlier: tuple[SceneObject, ...], clause: int
) -> tuple[Phrase, int]:
    """The phrase that begins at a word, and how many words it takes."""
    cues, cued = _cues_at(words, i)
    concept, length = concept_at(words, i)
    if concept == "reverse" and length > cued and {"other", "opposite"} & {*words[i : i + length]}:
        cues, cued, concept = frozenset({"flip"}), length, ""
    least, senseless = max(cued, length), not (cued or concept)
    what, used = _thing_at(words, i, catalog, earlier, least, senseless) or _number_at(words, i, least, cued) or ({}, 0)
    if not what:
        what, used = _sense_at(words[i : i + length], (cues, cued), concept)
    text = " ".join(words[i : i + used]) if what else words[i]  # of what says nothing the first word is enough
    return Phrase(text, clause, **what), used


_Read: TypeAlias = tuple[dict[str, Any], int]
"""What a phrase is, and how many words it takes."""


def _thing_at(
    words: Sequence[str], i: int, catalog: Catalog, earlier: tuple[SceneObject, ...], least: int, senseless: bool
) -> _Read | None:
    """Objects, in as many words at least as anything else; unclear ones only where the words have no other sense."""
    mention = _mention(words, i, catalog, earlier)
    if mention is None or mention.used < least or (mention.unclear and not senseless):
        return None
    return {"items": tuple(item.name for item in mention.items)}, mention.used


def _number_at(words: Sequence[str], i: int, least: int, cued: int) -> _Read | None:
    """A number, in as many words at least as anything else; but "a third more" and the like are cues."""
    number, used = _amount(words, i) or (None, 0)
    return None if number is None or used < least or cued == used > 1 else ({"number": number}, used)


def _sense_at(phrase: Sequence[str], cued: tuple[frozenset[str], int], concept: str) -> _Read:
    """The cues of feedback, with how many words they take, or the concept of a phrase, whichever is longer."""
    (cues, used), length, same = cued, len(phrase), _same(concept, phrase)
    told = "" if _says_nothing(concept, phrase) else concept
    if length >= used and same:
        return {"cues": cues | same, "concept": told}, length
    if used and (used >= length or not told):
        return {"cues": cues, "concept": told if used == length else ""}, used
    return {"concept": told} if told else {}, max(length, 1)


def _says_nothing(concept: str, phrase: Sequence[str]) -> bool:
    """Whether the concept of a phrase asks for nothing in feedback: "more than" and "less than" compare."""
    compares = concept in ("at_least", "at_most") and phrase[0] in ("more", "less", "fewer")
    return compares or concept in ("plain", "join")


def _same(concept: str, words: Sequence[str]) -> frozenset[str]:
    """The cues of feedback that a phrase of the other word files is."""
    found = {SAME_AS[concept]} if concept in SAME_AS else set()
    if concept in ("large", "slight"):
        kept = {"large", "more", "less"} if concept == "large" and words[0] != "too" else {"more", "less"}
        found |= {cue for word in words for cue in _cues_at([word], 0)[0] & kept}
        found |= {concept} if len(words) > 1 and not found & {"more", "less"} else set()
    return frozenset(found)


COUNTED = frozenset("first second third last".split())


def _mention(words: Sequence[str], i: int, catalog: Catalog, earlier: tuple[SceneObject, ...]) -> Mention | None:
    """The objects that are named; "that one" and "another thing" name none."""
    found = catalog.mention_at(words, i, earlier) if words[i][0].isalnum() else None
    if found is not None and len(earlier) < 2 and COUNTED & set(words[i : i + found.used]):
        return None
    if found is None or singular(words[i + found.used - 1]) not in GENERIC:
        return found
    return None if found.unclear or len(found.items) == len(catalog.scene) else found


def _amount(words: Sequence[str], i: int) -> tuple[F.Quantity, int] | None:
    """The quantity that begins at a word, in the person's unit, and how many words it takes."""
    amount = amount_at(words, i)
    if amount is None or (amount.used == 1 and words[i] == "one" and not _counts(words[i + 1 : i + 2])):
        return None
    unit, used, value = amount.unit, amount.used, abs(amount.value)
    said = words[i : i + used]
    factor = "x" in (*words[max(i - 1, 0) : i], *words[i + used : i + used + 1])
    if factor and not unit:
        return F.Quantity(value, "x"), used
    unit = "x" if not unit and "/" in said else unit
    return F.Quantity(value, unit, said=_as_written(said)), used


def _as_written(said: Sequence[str]) -> str:
    """A number in digits with its unit, as it was written; "" for other amounts."""
    plain = is_digits(said[0]) and "/" not in said and len(said) <= 2
    return f"{said[0]}{symbol(' '.join(said[1:]))}" if plain else ""


def _counts(behind: Sequence[str]) -> bool:
    """Whether a "one" before some words is a number: "one lap", "one is enough"."""
    return bool(behind) and "turns" in _cues_at(behind, 0)[0]


@dataclass(frozen=True)
class Remark:
    """What was said, against the frames before it."""

    pieces: tuple[Phrase, ...]
    before: tuple[F.SemanticFrame, ...]

    @cached_property
    def elsewhere(self) -> bool:
        """Whether it names kinds of change, and none of those before."""
        plain = [p for p in self.pieces if p.text != "move" and p.concept not in ("away", "closer")]
        naming = any(NOUNS.get(cue) for p in plain for cue in (*p.cues, p.concept))
        return naming and not self.meant(self.pieces)

    @property
    def adds(self) -> bool:
        """Whether something further is asked for: "and near the bottle too"."""
        return bool(self.cued("also")) or any(p.text in ("and", "now", "n") for p in self.pieces[:1])

    def cued(self, *names: str) -> list[Phrase]:
        """The pieces with one of these cues."""
        return [p for p in self.pieces if p.cues & set(names)]

    def meant(self, pieces: Sequence[Phrase]) -> list[int]:
        """Numbers of the frames that pieces name by a noun, a direction or an object; by all of these if one fits."""
        named = [{i for i, frame in enumerate(self.before) if names(p, frame)} for p in pieces]
        found = [frames for frames in named if frames]
        return sorted(set.intersection(*found) or set.union(*found)) if found else []

    def on(self, i: int) -> str:
        """How an edit names a frame: by its kind, or a direction or object of its own; "" where there is only one."""
        return "" if len(self.before) == 1 else name_among(self.before, i)


def remark(text: str, scene: Scene, before: Sequence[F.SemanticFrame], positions: Array | None = None) -> Remark:
    """An utterance in pieces, against the frames before it."""
    return Remark(pieces_of(text, scene, before, positions), tuple(before))


def named_frames(text: str, scene: Scene, before: Sequence[F.SemanticFrame]) -> list[int]:
    """Numbers of the frames that an answer such as "the shift" names."""
    said = remark(text, scene, before)
    return said.meant(said.pieces)


def named_objects(text: str, scene: Scene) -> tuple[SceneObject, ...]:
    """The objects that an answer such as "the blue one" names."""
    names_ = {name for piece in pieces_of(text, scene, (), None) for name in piece.items}
    return tuple(item for item in scene if item.name in names_)


def vaguely_where(text: str, scene: Scene) -> tuple[str, ...]:
    """The vague words of an utterance that says only where: "somewhere between the cup and the bottle only"; or ()."""
    said = remark(text, scene, ())
    vague = said.cued("vague") if said.cued("only") else []
    return tuple(piece.text for piece in vague)


def stated(text: str, scene: Scene) -> tuple[F.Quantity | None, set[str]]:
    """The one quantity of an utterance, or None, and its words."""
    pieces = pieces_of(text, scene, (), None)
    numbers = [piece.number for piece in pieces if piece.number]
    return (numbers[0] if len(numbers) == 1 else None), {*words_in(pieces)}


def names(piece: Phrase, frame: F.SemanticFrame) -> bool:
    """Whether a piece names a frame, by its kind, a direction or an object."""
    kinds = {kind for cue in (*piece.cues, piece.concept) for kind in NOUNS.get(cue, ())}
    called = {name_of(frame), frame.NAME} & kinds or {*piece.items} & {*frame.named}
    return bool(called) or SENSES.get(piece.concept) in directions_of(frame)


def heading(piece: Phrase) -> str:
    """The direction that a piece names, or ""."""
    sense = SENSES.get(piece.concept, "")
    words = sense if sense in DIRECTIONS else next((d for d in DIRECTIONS if d in piece.cues), "")
    return "" if piece.text.endswith("er") else words
