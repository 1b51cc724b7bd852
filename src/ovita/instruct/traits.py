"""What is known of the objects of a scene from their names and from its description: the cup is red."""

from __future__ import annotations

import re
from collections.abc import Mapping

from ovita.instruct.lexicon import concept_at, is_filler
from ovita.paths.scene import Scene, SceneObject, canonical

WORD = re.compile(
    r"\d+[.,]\d+|\d+|\.\d+|m/s(?:\^?2|²)|m/s|cm/s|mm/s|km/h|[^\W\d_]+(?:['’][^\W\d_]+)?|%|°|[.,;:!?()]|[-+_/]"
)  # the pieces that a sentence, a name and a description are cut into


SKIPPED = frozenset("the a an this that these those of our my".split())
SAME: tuple[frozenset[str], ...] = tuple(
    frozenset(words.split())
    for words in (
        "round circular spherical ball circle sphere",
        "grey gray",
        "big large",
        "small little tiny",
        "metal metallic steel iron",
        "wooden wood",
        "rectangular square boxy cubic cube box",
    )
)
"""Words that describe the same."""


def traits(scene: Scene, words: Mapping[str, tuple[str, ...]]) -> dict[str, set[str]]:
    """What is said of each object: by its name, by a line "name: ..." of the description, and by its phrases."""
    found = {item.name: set(words[item.name][:-1]) for item in scene}
    for line in scene.environment.lower().splitlines():
        subject, colon, told = line.partition(":")
        named = _named_in(_pieces(subject), scene, words) if colon else []
        if len(named) == 1:
            found[named[0].name] |= {w for w in _pieces(told) if len(w) > 2 and _describes(w)}
            continue
        for phrase in re.split(r"[.;,]|\band (?=the )|\bwhile\b|\bwhereas\b", line):
            pieces = _pieces(phrase)
            about = _named_in(pieces, scene, words)
            if len(about) == 1:
                told_here = _said_of(pieces, pieces.index(words[about[0].name][-1]))
                found[about[0].name] |= {w for w in told_here if len(w) > 2 and _describes(w)}
    return {name: told - set(words[name][-1:]) for name, told in found.items()}


def _pieces(text: str) -> list[str]:
    return [singular(w) for w in WORD.findall(text) if w[0].isalnum()]


def _named_in(pieces: list[str], scene: Scene, words: Mapping[str, tuple[str, ...]]) -> list[SceneObject]:
    """The objects that a phrase names: by their whole names, else by their heads."""
    about = [item for item in scene if words[item.name] and words[item.name][-1] in pieces]
    return [item for item in about if set(words[item.name]) <= set(pieces)] or about


def _said_of(pieces: list[str], head: int) -> list[str]:
    """The words right before a noun, up to an article, and those behind its "is" or "with"."""
    before: list[str] = []
    for word in reversed(pieces[max(head - 3, 0) : head]):
        if word in SKIPPED or is_filler(word):
            break
        before.append(word)
    behind = pieces[head + 1 :]
    return before + (
        behind[1:] if behind and behind[0] in ("is", "are", "was", "has", "look", "looks", "with", "of", "made") else []
    )


def _describes(word: str) -> bool:
    """Whether a word of a description is a trait, rather than a word of the grammar or of motion."""
    if any(word in same for same in SAME):
        return True
    return word != "and" and not is_filler(word) and not concept_at((word,), 0)[0]


def name_words(item: SceneObject) -> tuple[str, ...]:
    """The words of an object's name, cut as a sentence is cut."""
    return tuple(w for w in WORD.findall(canonical(item.name)) if w[0].isalnum())


def singular(word: str) -> str:
    """A noun without its plural s and without a possessive."""
    word = re.sub(r"['’]s?$", "", word)
    if len(word) > 4 and word.endswith(("xes", "ches", "shes", "sses")):
        return word[:-2]
    return word[:-1] if len(word) > 3 and word.endswith("s") and not word.endswith("ss") else word
