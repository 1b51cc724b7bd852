"""The example bank: instructions with the policies that answer them, and choosing those that are like an instruction.

The examples are data, in `examples/*.toml`, one file a family. Each is run and measured by the tests. Which of many
short texts are most like a sentence is told by their words: offline, deterministic, a little numpy.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from importlib.resources import files
from itertools import pairwise
from typing import Any

import numpy as np

from ovita.instruct.lexicon import PLAIN, concept_at, is_filler, stems
from ovita.paths.scene import DIRECTIONS
from ovita.paths.trajectory import Array
from ovita.toolkit import CATALOGUE, extended
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


DOC_WEIGHT = 0.6
"""What a word in a function's own description counts, next to one in an example that calls it."""

ALIKE, SERVED = 0.5, 2.0
"""A further example is shown if it scores this share of the first one's score, times that power of how much of the
instruction the first one serves: one that leaves half of the instruction open needs company."""

ENOUGH = 0.35
"""A function is worth showing if it scores this share of the best function's score."""

_CLAUSE = re.compile(r"[,;:]|[.!?](?:\s|$)|\b(?:and|then|but|while|afterwards)\b", re.IGNORECASE)


@dataclass(frozen=True)
class Example:
    """An instruction and the answer to it, whose parts are as in a reply.

    Args:
        family: The file it is in, such as "distance".
        say: The instruction.
        also: Other wordings of the same request; they help to find the example and are not shown.
        code: The policy; "" where the answer is a question or words that cannot be placed.
        scene: Name of the scene in which the tests run it.
        check: What the tests measure, in the words of the benchmark's checks.
    """

    family: str
    say: str
    also: tuple[str, ...] = ()
    plan: tuple[str, ...] = ()
    code: str = ""
    assumptions: tuple[str, ...] = ()
    contacts: tuple[str, ...] = ()
    question: str = ""
    not_understood: tuple[str, ...] = ()
    scene: str = ""
    check: str = ""

    @property
    def objects(self) -> tuple[str, ...]:
        """The names of the objects that the policy looks up."""
        return tuple(dict.fromkeys(re.findall(r'scene\["([^"]+)"\]', self.code)))

    @cached_property
    def calls(self) -> tuple[str, ...]:
        """The toolkit's functions that the policy calls."""
        return tuple(n for n in dict.fromkeys(re.findall(r"\b([a-z_]+)\(", self.code)) if n in CATALOGUE)

    def text(self) -> str:
        """The example as a prompt shows it: the answer's parts one below the other."""
        lines = [f"Instruction: {self.say}"]
        if self.plan:
            lines += ["Plan:", *(f"{i}. {step}" for i, step in enumerate(self.plan, start=1))]
        if self.code:
            lines += ["```python", self.code, "```"]
        lines += [f"{title}: {text}" for title, text in self._rest() if text]
        return "\n".join(lines)

    def _rest(self) -> Sequence[tuple[str, str]]:
        return (
            ("Assumptions", "; ".join(self.assumptions)),
            ("Contacts", ", ".join(self.contacts)),
            ("Question", self.question),
            ("Not understood", ", ".join(self.not_understood)),
        )


@cache
def examples() -> tuple[Example, ...]:
    """Every example, by family and in the order of its file."""
    folder = files("ovita.writers") / "bank"
    found: list[Example] = []
    for file in sorted(folder.iterdir(), key=lambda item: item.name):
        if file.name.endswith(".toml"):
            document = tomllib.loads(file.read_text(encoding="utf-8"))
            family = file.name.removesuffix(".toml")
            found += [_example(family, document.get("scene", ""), entry) for entry in document["example"]]
    return tuple(found)


def similar(instruction: str, count: int, objects: Sequence[str] = ()) -> tuple[Example, ...]:
    """At most `count` examples that are most like an instruction and share a word with it, best first.

    Each after the first is chosen for what the ones before it leave open, so that a sentence with several clauses gets
    an example for each. Names of the scene's objects count as objects even if named like an ordinary word.
    """
    index, owners = _wordings()
    query = terms(instruction, objects)
    weights: dict[str, float] = {}
    chosen: list[int] = []
    least = 0.0
    while len(chosen) < count:
        scores = index.scores(query, weights)
        scores[np.isin(owners, chosen)] = 0.0
        best = int(np.argmax(scores))
        if scores[best] <= least:
            break
        chosen.append(int(owners[best]))
        covered = frozenset().union(*(index.texts[i] for i in np.flatnonzero(owners == owners[best])))
        if len(chosen) == 1:
            served = index.worth(covered.intersection(query)) / index.worth(query)
            least = ALIKE * served**SERVED * float(scores[best])
        weights |= {term: COVERED for term in query if term in covered}
    return tuple(examples()[i] for i in chosen)


def functions_like(
    instruction: str, count: int, objects: Sequence[str] = (), *, without: Sequence[str] = ()
) -> tuple[str, ...]:
    """The names of at most `count` toolkit functions that an instruction seems to need, best first.

    A function is found by its own description and by the examples that call it, for the whole instruction and for each
    of its clauses; those in `without` are known already.
    """
    extended()
    index, owners = _wordings()
    worth = dict.fromkeys(CATALOGUE, 0.0)
    for part in dict.fromkeys([instruction, *_CLAUSE.split(instruction)]):
        query = terms(part, objects)
        found = dict(zip(CATALOGUE, DOC_WEIGHT * _descriptions().scores(query), strict=True))
        best = np.zeros(len(examples()))
        np.maximum.at(best, owners, index.scores(query))
        for example, score in zip(examples(), best.tolist(), strict=True):
            for name in example.calls if score > 0 else ():
                found[name] = max(found[name], score)
        top = max(found.values()) or 1.0
        worth = {name: max(worth[name], found[name] / top) for name in CATALOGUE}
    ranked = sorted((name for name in worth if name not in without), key=lambda name: -worth[name])
    return tuple(name for name in ranked[:count] if worth[name] > ENOUGH)


def use_of(name: str) -> tuple[str, str] | None:
    """A short example that calls a function: its instruction, and the line with the call; None if no example does."""
    found = [(e, line.strip()) for e in examples() for line in e.code.splitlines() if re.search(rf"\b{name}\(", line)]
    if not found:
        return None
    example, line = min(found, key=lambda use: (re.match(rf"(\w+ = )?{name}\(", use[1]) is None, len(use[0].code)))
    return example.say, line


@cache
def _wordings() -> tuple[Index, Any]:
    """Every wording of every example, and its example."""
    pairs = [(i, terms(w, e.objects)) for i, e in enumerate(examples()) for w in (e.say, *e.also)]
    return Index([text for _, text in pairs]), np.array([i for i, _ in pairs])


@cache
def _descriptions() -> Index:
    """The toolkit's functions by name and description."""
    docs = (f"{name.replace('_', ' ')} {(f.__doc__ or '').partition('Args:')[0]}" for name, f in CATALOGUE.items())
    return Index([terms(text) for text in docs])


def _example(family: str, scene: str, entry: Mapping[str, Any]) -> Example:
    fields: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v.strip() for k, v in entry.items()}
    return Example(**{"family": family, "scene": scene, **fields})
