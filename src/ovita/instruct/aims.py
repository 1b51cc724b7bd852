"""What of an object is meant: "end on the box" is on its top, "touch the box" at its surface.

A frame says that a path ends, goes or waits at an object; which of its points is meant the words before the object say.
They stand in `aiming/aims.txt`, and both readers' frames get their aim here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import TypeAlias

from ovita.instruct import frames as F
from ovita.instruct.lexicon import DETERMINERS, concepts, stems

_LINKS = frozenset({"and", ",", "or", "both"})

_ON: dict[str, F.Aim] = {"on": "top", "resting": "top", "touching": "surface"}
MEANT: Mapping[type[F.SemanticFrame], Mapping[str, F.Aim]] = {
    F.MoveEnd: _ON | {"above": "above", "below": "below", "behind": "behind", "beside": "beside", "by": "beside"},
    F.Extend: _ON,
    F.Visit: {"resting": "top", "touching": "surface", "beside": "beside", "by": "beside"},
    F.StopAt: {"resting": "top"},
    F.Wait: {"resting": "top"},
}
"""What words before an object say of it in each kind of frame; "wait on the table" may be said of a place beside it."""

Word: TypeAlias = tuple[str, F.Span]
"""A word in small letters, and where it stands."""

Named: TypeAlias = tuple[tuple[str, ...], F.Span]
"""Objects, and where they are named in the utterance."""


def aimed(
    frames: Sequence[F.SemanticFrame], words: Sequence[Word], named: Sequence[Named]
) -> tuple[F.SemanticFrame, ...]:
    """Frames with what of an object is meant, where the words before it say so.

    Args:
        frames: As read, by whatever reader.
        words: The utterance that they were read from, word for word.
        named: Every place where it names objects.
    """
    said = [(names, span, concept) for names, span, concept in _said(words, named) if concept]
    if _ending([word for word, _ in words]):
        frames = [_apart(frame, said) for frame in frames]
    return tuple(_aimed(frame, said) for frame in frames) if said else tuple(frames)


def _ending(words: Sequence[str]) -> bool:
    """Whether an utterance tells where to end or begin, and not where to move an end that is named."""
    verbs = {word for phrase in concepts(folder="aiming")["ending"] for word in phrase.split()}
    told = any(word in verbs and before not in DETERMINERS for before, word in zip(("", *words), words, strict=False))
    return told and not {*words} & {word for phrase in concepts(folder="aiming")["amount"] for word in phrase.split()}


def _apart(frame: F.SemanticFrame, said: Sequence[tuple[tuple[str, ...], F.Span, str]]) -> F.SemanticFrame:
    """An end so far from an object, where a reader took the distance for how far the end moves."""
    if not isinstance(frame, F.MoveEnd) or frame.relation not in ("away", "toward") or frame.by is None:
        return frame
    if any(concept == "from" and frame.place in names for names, _, concept in said):
        return replace(frame, relation="to", aim="beside")
    return frame


def _aimed(frame: F.SemanticFrame, said: Sequence[tuple[tuple[str, ...], F.Span, str]]) -> F.SemanticFrame:
    if not isinstance(frame, F.AIMED) or frame.aim or not _free(frame):
        return frame
    own = {frame.place} if not isinstance(frame, F.Visit) else {*frame.objects}
    meant = MEANT[type(frame)]
    for names, span, concept in said:
        within = not frame.words or any(a < span[1] and span[0] < b for a, b in frame.words)
        if concept in meant and within and own & {*names}:
            return replace(frame, aim=meant[concept])
    return frame


def _free(frame: F.SemanticFrame) -> bool:
    """Whether a frame goes to an object as such, not beside it, toward it, over it or between two."""
    match frame:
        case F.MoveEnd(relation=relation, offset=offset, place=place):
            return relation == "to" and not offset and isinstance(place, str)
        case F.Visit(relation=relation):
            return relation == "at"
        case F.StopAt(place=place) | F.Wait(place=place) | F.Extend(place=place):
            return isinstance(place, str) and place not in ("", *F.SPOTS)
    return False


def _said(words: Sequence[Word], named: Sequence[Named]) -> Iterator[tuple[tuple[str, ...], F.Span, str]]:
    """Each naming of objects with the concept of the words right before it, or before those named along with it."""
    spans = [span for _, span in named]
    for names, span in named:
        before = [word for word in words if word[1][1] <= span[0]]
        yield names, span, _before(before, spans)


def _before(words: Sequence[Word], spans: Sequence[F.Span]) -> str:
    """The concept of the phrase that words end with; determiners, and other objects named before, are passed over."""
    rest = list(words)
    listed = False
    while rest:
        bare = [word for word, _ in rest]
        while bare and bare[-1] in DETERMINERS:
            bare.pop()
        concept = next((c for c, phrase in _phrases() if _ends_with(bare, phrase)), "")
        if concept:
            return concept if not listed or concept == "touching" else ""
        word, at = rest.pop()
        inside = any(a <= at[0] < b for a, b in spans)
        listed = listed or inside
        if not (inside or word in DETERMINERS or word in _LINKS):
            return ""
    return ""


@cache
def _phrases() -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Every phrase with its concept, longest first."""
    found = [(concept, tuple(phrase.split())) for concept, said in concepts(folder="aiming").items() for phrase in said]
    return tuple(sorted(found, key=lambda pair: -len(pair[1])))


def _ends_with(words: Sequence[str], phrase: Sequence[str]) -> bool:
    """Whether words end with a phrase, each as it is or inflected."""
    last = words[len(words) - len(phrase) :] if len(words) >= len(phrase) else ()
    return bool(last) and all(one in stems(word) for word, one in zip(last, phrase, strict=True))
