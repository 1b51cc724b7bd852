"""What people say besides what they want: reasons and stories, which no reader need see."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from ovita.instruct.chunks import chunks
from ovita.instruct.lexicon import DETERMINERS
from ovita.paths.scene import Scene

_SOMEBODY = (
    r"(?:I(?!\.)|she|he|they|nobody|no one|somebody|someone|people|everyone|everybody"
    r"|we(?= (?:only|never|already)|'ve|'re(?! done| there| good)))"
)
_TELLING = re.compile(rf"^\W*(?:(?:and|but|because|since|as) )?{_SOMEBODY}(?:'\w+)?\b", re.IGNORECASE)
_NAMING = re.compile(r"^\W*(?:the|my|our|your|their|his|her|these|those)\s+(?=\w)", re.IGNORECASE)
_WISHING = re.compile(
    r"\b(?:should|shall|must|needs?|needed|(?:has|have|had|got) to|wants?|wanted|wanna|would|wish|like|love|prefer"
    r"|please|let|let's|can you|could|rather|better|too|means?|meant|says?|said|told|asked|think|expect|supposed|may"
    r"|might|instead|happy|glad|feel|hope|ok|okay|fine|won't have|accept|agree|return|rescind|undo|redo|withdraw|cancel"
    r"|retract|regret|take|choose|pick|confirm|approve|reject|refuse|in mind)\b|'d\b|\bnot\b.*\bbut\b",
    re.IGNORECASE,
)
_FEARING = re.compile(
    r"\b(?:don'?t|do not|wouldn'?t) want (?:it|them|those|these|that|him|her|any\w*|the \w+)(?: to)?"
    r" (?=\w+ed\b|get|wak|hurt|spill|break|hit|broken|wet|dirty)",
    re.IGNORECASE,
)
_SO = r"so\b(?! (?:that|as|far|long|much|close|fast|slow|high|low|many|to)\b)"
_BREAKS = re.compile(rf"((?<=[\w)])[,;:]\s+|(?<=[.!?])\s+|(?<=\w)\s+(?={_SO}))", re.IGNORECASE)
_PRAISE = re.compile(
    r"^\W*(?:(?:good|nice|great|lovely|fine|ok|okay|perfect|thanks|thank you|right|alright|cool|super)[.!,] ?)+"
    r"(?=\w+ \w+ \w)",
    re.IGNORECASE,
)
_POINTING = re.compile(r"\b(?:it|its|them|him|her|there|that|this|those|these|one|ones)\b", re.IGNORECASE)


def without_asides(text: str, scene: Scene, *, first: bool) -> str:
    """An utterance without clauses that only tell how things are: "the stretchers come through on the left".

    Somebody does something in them, or a thing that nobody knows is somehow, and nothing is wished. One that names an
    object stays where the rest may point at it, and so do all where nothing else is said.

    Args:
        text: As it was said or typed.
        scene: With the names of objects.
        first: Whether it is the first about a path; what follows may tell of what came of that ("the sign is wrong").
    """
    text = text if first else _PRAISE.sub("", text)
    clauses = [*_clauses(text, scene, first)]
    rest = "".join(clause.left for clause in clauses)
    rest = _HANGING.sub("", re.sub(r"(?<=[.!?])[.!?]+", "", rest))
    told = [clause for clause in clauses if clause.tells]
    points = _POINTING.search(rest) and any(_names(clause.said, scene) for clause in told)
    return text if not told or points or not re.search(r"\w{2}", rest) else rest


_HANGING = re.compile(r"^[\W_]*(?:so\b,?\s*)?", re.IGNORECASE)
"""What is left before the first word, or before what follows from a reason."""


@dataclass(frozen=True)
class _Clause:
    """A clause, what stands before it, and whether it only tells how things are."""

    before: str
    said: str
    tells: bool

    @property
    def left(self) -> str:
        """What is left of it: all of it, or what ends a sentence with one that only tells."""
        return (self.said[-1:] if self.said[-1:] in (".", "!", "?") else "") if self.tells else self.before + self.said


def _clauses(text: str, scene: Scene, first: bool) -> Iterator[_Clause]:
    """The clauses of an utterance; what feedback begins with is none but before a "so"."""
    begun, *more = _BREAKS.split(text)
    reason = first or bool(more and re.match(_SO, more[1], re.IGNORECASE))
    yield _Clause("", begun, reason and _tells(begun, True, scene))
    for before, said in zip(more[::2], more[1::2], strict=True):
        yield _Clause(before, said, _tells(said, first and "," not in before, scene))


def _tells(clause: str, begins: bool, scene: Scene) -> bool:
    """Whether a clause tells what somebody does, or begins one about what is neither an object nor the path."""
    if _WISHING.search(_FEARING.sub("", clause)):
        return False
    if _TELLING.search(clause):
        return not any(chunk.kind in AMOUNTS for chunk in chunks(clause, scene)[0])  # "I'm talking twenty feet"
    if not begins or not _NAMING.search(clause) or len(clause.split()) < 4:
        return False
    plain = re.sub(r"'(?:s|re|ve|ll)\b", "", clause)
    said = [chunk for chunk in chunks(plain, scene)[0] if chunk.text.lower() not in DETERMINERS]
    return bool(said) and said[0].kind == "unknown"


AMOUNTS = ("Qm", "Qv", "Qpc", "Qx")


def _names(clause: str, scene: Scene) -> bool:
    return any(chunk.kind == "OBJ" for chunk in chunks(clause, scene)[0])
