"""Lexical retrieval: which of many short texts are most like a sentence. Offline, deterministic, a little numpy."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise

import numpy as np

from ovita.instruct.lexicon import PLAIN, concept_at, is_filler, stems
from ovita.paths.scene import DIRECTIONS
from ovita.paths.trajectory import Array
from ovita.units import LENGTHS, symbol

WEIGHTS = {" ": 0.3, "~": 0.1}
"""What two neighbours in a row count, next to one term, and what a word counts besides its concept."""

COVERED = 0.6
"""What a term still counts once a chosen text has it, so that the next choice serves the rest of the sentence."""

NUMBER, OBJECT, DIRECTION = "<number>", "<object>", "<direction>"

_LENGTHS = frozenset(unit.symbol for unit in LENGTHS)
"""Units of length say nothing about what is asked."""

_WORD = re.compile(r"<\w+>|\d+(?:\.\d+)?|\.\d+|[^\W\d_]+(?:'[^\W\d_]+)?|%|°")


def terms(text: str, objects: Iterable[str] = ()) -> list[str]:
    """The terms of a text: the concepts of the built-in writer's lexicon, other words, and pairs of neighbours.

    All numbers are alike, and so are all objects and all directions. Words that ask for nothing are left out.

    Args:
        text: A sentence.
        objects: Names of objects that it may mention, whole or by their last word.
    """
    words = _words(_with_objects_alike(" ".join(text.lower().split()), objects))
    main: list[str] = []
    besides: list[str] = []
    i = 0
    while i < len(words):
        concept, used = concept_at(words, i)
        if not used and not is_filler(words[i]):
            main.append(words[i] if words[i][0] == "<" else _stem(words[i]))
        elif used and concept != PLAIN:
            main.append(DIRECTION if concept in DIRECTIONS else f"={concept}")
            besides += [f"~{_stem(word)}" for word in words[i : i + used] if not is_filler(word)]
        i += max(used, 1)
    return [*main, *besides, *(f"{a} {b}" for a, b in pairwise(main))]


def _with_objects_alike(text: str, objects: Iterable[str]) -> str:
    names = {" ".join(re.sub(r"[\W_]+", " ", name.lower()).split()) for name in objects}
    names |= {name.rpartition(" ")[2] for name in names}
    for name in sorted(filter(_telling, names), key=lambda n: (-len(n), n)):
        text = re.sub(rf"(?<!\w){name.replace(' ', '[ _-]')}(?:e?s)?(?!\w)", OBJECT, text)
    return text


def _words(text: str) -> list[str]:
    """The words of a text, numbers alike and without the unit of length behind them."""
    words = [NUMBER if word[0].isdigit() or word[0] == "." else word for word in _WORD.findall(text)]
    return [w for i, w in enumerate(words) if not (i and words[i - 1] == NUMBER and symbol(w) in _LENGTHS)]


class Index:
    """Texts that can be ranked by their likeness to a sentence: by the rare terms they share, as in TF-IDF.

    Args:
        texts: The terms of each text.
    """

    def __init__(self, texts: Sequence[Sequence[str]]) -> None:
        self.texts = [frozenset(text) for text in texts]
        found: dict[str, list[int]] = {}
        for number, text in enumerate(texts):
            for term in dict.fromkeys(text):
                found.setdefault(term, []).append(number)
        self._holders = {term: np.array(numbers) for term, numbers in found.items()}
        self._worth: dict[str, float] = {}
        self._whole = np.full(len(texts), 1e-9)
        for term, holders in self._holders.items():
            kind = " " if " " in term else term[0]
            self._worth[term] = WEIGHTS.get(kind, 1.0) * float(np.log(1 + len(texts) / len(holders)))
            self._whole[holders] += self._worth[term]

    def worth(self, terms: Iterable[str]) -> float:
        """How telling some terms are in all."""
        return sum(self._worth.get(term, 0.0) for term in dict.fromkeys(terms))

    def scores(self, query: Sequence[str], weights: Mapping[str, float] | None = None) -> Array:
        """How much each text is like a sentence, (number of texts,): the worth of the terms that both have.

        It is multiplied by these terms' share of the text, so that a text that speaks of little else comes first; 0
        where they share no term.

        Args:
            query: The sentence's terms.
            weights: What a term counts instead of 1.
        """
        result, common = np.zeros(len(self.texts)), np.zeros(len(self.texts))
        for term in dict.fromkeys(query):
            if term in self._holders:
                result[self._holders[term]] += self._worth[term] * (weights or {}).get(term, 1.0)
                common[self._holders[term]] += self._worth[term]
        return np.asarray(result * common / self._whole)


def _telling(name: str) -> bool:
    """Whether a name has a word that is neither a concept nor a filler, so that an object "near" masks nothing."""
    words = name.split()
    return any(not word.isdigit() and not concept_at([word], 0)[1] and not is_filler(word) for word in words)


def _stem(word: str) -> str:
    return min(stems(word), key=len)
