"""From an utterance to chunks: objects of the scene, amounts, words by class, and words that nobody knows.

A chunk's class is what the referee looks at; `span` says where it stands. Objects and amounts are those of the sketch
(`instruct/sketch.py`) that the network reads.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from ovita.instruct.frames import Quantity, Span
from ovita.instruct.lexicon import cue_at, term_at
from ovita.instruct.numerals import is_digits, unit_apart
from ovita.instruct.sketch import Fragment, Referent, Sketch, sketch
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array

SIGNS = {
    **dict.fromkeys(".;!?", "dot"), **dict.fromkeys(",:()–—", "comma"), "&": "and", "+": "and", "=": "to", "@": "at",
    "~": "approx", ">": "at_least", "≥": "at_least", "<": "at_most", "≤": "at_most", "→": "to",
}  # fmt: skip
"""The classes of signs; others say nothing."""

BOUNDS = frozenset("<>")
ORDINAL_ENDINGS = frozenset("st nd rd th".split())
"""Signs of a bound, and what stands behind the digits of an ordinal: "every 3rd waypoint"."""

UNIT_KIND = {
    "m": "Qm", "m/s": "Qv", "m/s2": "Qa", "s": "Qs", "deg": "Qdeg", "%": "Qpc", "x": "Qx", "step": "Qstep",
    "": "Qn", "waypoints": "Qn", "turns": "Qn", "Hz": "Qhz",
}  # fmt: skip
"""The classes of amounts, by unit."""


@dataclass(frozen=True)
class Chunk:
    """A meaningful piece of an utterance.

    Args:
        kind: Its class: one of `terms/`, "OBJ", "CHOICE", "Q" and its unit, "comma", "dot", "filler" or "unknown".
        text: As it was written.
        span: Where it stands.
        names: Objects that it means.
        q: The quantity that it is.
        cue: The concept of the first phrase of feedback that begins in it, or "".
    """

    kind: str
    text: str
    span: Span
    names: tuple[str, ...] = ()
    q: Quantity | None = None
    cue: str = ""

    @property
    def number(self) -> Quantity:
        """The quantity that it is; a bare zero if it is none."""
        return self.q or Quantity(0.0)


def chunks(text: str, scene: Scene, positions: Array | None = None) -> tuple[Chunk, ...]:
    """Cut an utterance into chunks.

    Args:
        text: As it was said or typed.
        scene: Whose objects it may name.
        positions: The path (N, 3) [m], for "the object nearest to the goal", or None.
    """
    return _cut(text, _Setting(scene, positions))


@dataclass(frozen=True, eq=False)
class _Setting:
    """A scene and a path (N, 3) [m] or None, which are the same only as themselves, for `_cut` to know them again."""

    scene: Scene
    positions: Array | None

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Setting) and self.scene is other.scene and self.positions is other.positions

    def __hash__(self) -> int:
        return hash((id(self.scene), id(self.positions)))


@lru_cache(maxsize=16)
def _cut(text: str, setting: _Setting) -> tuple[Chunk, ...]:
    """As `chunks`, of which each reader of an utterance asks anew."""
    seen = sketch(text, setting.scene, setting.positions)
    pieces = seen.pieces
    words = [_word(piece, seen, text) for piece in pieces]
    apart = unit_apart([piece.text.lower() if piece.mention < 0 else "1" for piece in pieces])
    found: list[Chunk] = []
    i = 0
    while i < len(pieces):
        mention = _meant(pieces[i], seen)
        kind, used = ("filler", 1) if i == apart or mention else _class_at(words, i, pieces)
        span = _span(pieces[i : i + used])
        chunk = Chunk(kind, text[slice(*span)], span) if mention is None else _mentioned(mention, text)
        cues = (cue_at(words, k) for k in range(i, i + used))
        found.append(replace(chunk, cue=next(filter(None, cues), "")))
        i += used
    return tuple(_forbidden(chunk, found[k + 1 :]) for k, chunk in enumerate(found))


def _meant(piece: Fragment, seen: Sketch) -> Referent | None:
    """The object or the amount that a piece is; None for a word, also for one that may be an amount ("half")."""
    mention = seen.mentions[piece.mention] if piece.mention >= 0 else None
    words = piece.text.lower().split()
    weak = mention is not None and mention.weak and (words == ["one"] or term_at(words, 0)[1] == len(words))
    return None if weak else mention


def _word(piece: Fragment, seen: Sketch, text: str) -> str:
    """A piece as it may stand in a phrase: the number of "figure of eight", but no object and no length."""
    mention = _meant(piece, seen)
    if mention is None:
        return piece.text.lower()
    return "<>" if mention.unit or mention.is_object else text[slice(*(mention.words or (0, 0)))].lower()


def _mentioned(mention: Referent, text: str) -> Chunk:
    """An object or an amount as a chunk."""
    span = mention.words or (0, 0)
    said = text[slice(*span)]
    if mention.is_object:
        return Chunk("CHOICE" if mention.unclear else "OBJ", said, span, mention.items)
    return Chunk(UNIT_KIND[mention.unit], said, span, q=mention.quantity)


def _class_at(words: Sequence[str], i: int, pieces: Sequence[Fragment]) -> tuple[str, int]:
    """The class of the sign, the word or the phrase that begins at a piece, and how many pieces it takes."""
    if words[i] in "-−+" and _signs(pieces, i):
        return "plus" if words[i] == "+" else "minus", 1
    if not words[i][0].isalnum():
        return _class_of_sign(words, i), 1
    if words[i] in ORDINAL_ENDINGS and i and is_digits(words[i - 1]):
        return "filler", 1
    kind, used = term_at(words, i)
    if kind:
        return {"plain": "filler", "join": "and"}.get(kind, kind), used
    return "and" if words[i] in ("and", "n", "or", "nor") else "unknown", 1


def _class_of_sign(words: Sequence[str], i: int) -> str:
    """The class of a sign; the "=" of ">=" says no more than the ">"."""
    said = words[i] == "=" and not BOUNDS.isdisjoint(words[i - 1 : i])
    return "filler" if said else SIGNS.get(words[i], "filler")


def _signs(pieces: Sequence[Fragment], i: int) -> bool:
    """Whether a mark is the sign of the number behind it, not the mark of a range."""
    before, own, behind = (_span(pieces[k : k + 1]) if k >= 0 else (-1, -1) for k in (i - 1, i, i + 1))
    return before[1] < own[0] and own[1] == behind[0] and pieces[i + 1].mention >= 0


def _span(pieces: Sequence[Fragment]) -> Span:
    """Where some pieces stand."""
    spans = [piece.words for piece in pieces if piece.words is not None]
    return (spans[0][0], spans[-1][1]) if spans else (0, 0)


MANNERS = frozenset(
    "faster slower farther closer near toward left right front back up down raise lower over under thru".split()
)
"""Classes of words that say how something moves."""


def _forbidden(chunk: Chunk, behind: Sequence[Chunk]) -> Chunk:
    """A "do not move" that goes on with how: "do not move faster than" forbids that, and not every change."""
    if chunk.kind != "keep" or not chunk.text.lower().endswith((" move", " moving")) or not behind:
        return chunk
    away = behind[0].kind == "from" and behind[0].text.lower().startswith("away")
    how = behind[1 if behind[0].kind == "filler" and len(behind) > 1 else 0]
    return replace(chunk, kind="never") if away or how.kind in MANNERS else chunk
