"""The words that the built-in writer knows.

Concepts and the words and phrases that stand for them are in `words/*.txt`, grouped by concept. To teach the writer a
word, add it to the line of its concept. Inflected forms (-s, -ed, -ing, -ly, -er, -est) are found by themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, lru_cache
from importlib.resources import files
from importlib.resources.abc import Traversable

from ovita.errors import OvitaError

PLAIN = "plain"
"""The concept of words that ask for nothing by themselves."""

DETERMINERS = frozenset("the a an your its my our their this that these those some any his her well".split())
"""Words that may stand between the words of a phrase: "keep your distance"."""

CONNECTIVES = frozenset({"and", "then", "but", "also", "plus", "whereas", "finally", "next", "yet"})

COMPARING = frozenset("too so less not no never that once twice".split())
"""Words that turn what follows them round; phrases that begin with one are composed by the reader."""

ALIKE = {"away": "farther", "increase": "inc", "decrease": "dec",
         "through": "thru", "beyond": "after", "fewer": "dec", "remove": "trim"}  # fmt: skip
"""Concepts of `words/` and the classes of `terms/` that they belong to."""

IRREGULAR = {
    "went": "go", "gone": "go", "kept": "keep", "held": "hold", "brought": "bring", "drove": "drive", "driven": "drive",
    "flew": "fly", "flown": "fly", "rose": "rise", "risen": "rise", "sank": "sink", "sunk": "sink", "swung": "swing",
    "spun": "spin", "fell": "fall", "fallen": "fall", "ran": "run", "began": "begin", "begun": "begin", "took": "take",
    "taken": "take", "made": "make", "shrunk": "shrink", "shrank": "shrink", "bent": "bend", "slid": "slide",
    "drew": "draw", "drawn": "draw", "grown": "grow", "stood": "stand", "came": "come", "got": "get", "sped": "speed",
    "dove": "dive", "crept": "creep", "withdrawn": "withdraw", "chosen": "choose", "done": "do", "goes": "go",
    "does": "do",
}  # fmt: skip


FEEDBACK = "feedback.txt"
"""The file of words about what was just done, which `concepts` reads by itself."""


@cache
def concepts(only: str = "", folder: str = "words") -> dict[str, tuple[str, ...]]:
    """Every concept with its phrases; those about earlier turns are in a file that is read only by name.

    Raises:
        OvitaError: If a line of a word file names no concept.
    """
    found: dict[str, str] = {}
    for file in sorted(files("ovita.instruct").joinpath(folder).iterdir(), key=lambda f: f.name):
        if file.name.endswith(".txt") and (file.name == only if only else file.name != FEEDBACK):
            for concept, listed in _lines_of(file):
                found[concept] = f"{found.get(concept, '')} {listed}"
    return {
        concept: tuple(" ".join(p.split()) for p in listed.split(",") if p.strip()) for concept, listed in found.items()
    }


def _lines_of(file: Traversable) -> Iterator[tuple[str, str]]:
    """The lines of a word file, each with its concept: an indented line goes on with the concept before it."""
    concept = ""
    for line in file.read_text(encoding="utf-8").splitlines():
        if not line.strip() or line.startswith("#"):
            continue
        if line[0].isspace():
            yield concept, line
            continue
        concept, colon, listed = line.partition(":")
        if not colon:
            raise OvitaError(f"{file.name}: {line!r} names no concept; write 'concept: word, phrase, ...'")
        yield concept, listed


@cache
def phrases() -> dict[tuple[str, ...], str]:
    """Every phrase, as a tuple of words, to its concept; of words that stand in two concepts the first counts."""
    table: dict[tuple[str, ...], str] = {}
    for concept, listed in concepts().items():
        for phrase in listed:
            if concept != PLAIN or " " in phrase:
                table.setdefault(tuple(phrase.split()), concept)
    return table


@cache
def filler() -> frozenset[str]:
    """The single words that ask for nothing."""
    return frozenset(word for word in concepts()[PLAIN] if " " not in word)


@dataclass
class _Node:
    """A place in the tree of phrases: the words that may follow, and the concept of the phrase that ends here."""

    following: dict[str, _Node] = field(default_factory=dict)
    concept: str = ""


@cache
def _tree(table: Callable[[], Mapping[tuple[str, ...], str]]) -> _Node:
    """A table of phrases as a tree."""
    root = _Node()
    for words, concept in table().items():
        node = root
        for word in words:
            node = node.following.setdefault(word, _Node())
        node.concept = concept
    return root


@cache
def terms() -> dict[tuple[str, ...], str]:
    """Every phrase of the classes of `terms/`, and then those of the concepts of the same meaning."""
    table: dict[tuple[str, ...], str] = {}
    classes = concepts(folder="terms")
    for concept, listed in (*classes.items(), *((ALIKE.get(c, c), said) for c, said in concepts().items())):
        for phrase in listed:
            words = tuple(phrase.split())
            if concept in classes and (phrase in classes[concept] or words[0] not in COMPARING):
                table.setdefault(words, concept)
    return table


def term_at(words: Sequence[str], i: int) -> tuple[str, int]:
    """The class of the longest phrase that begins at word i, and its number of words; ("", 0) for none."""
    return _longest(_tree(terms), words, i, 0, 0)[:2]


@cache
def _cues() -> dict[tuple[str, ...], str]:
    """Every phrase of feedback to its concept."""
    return {tuple(p.split()): concept for concept, listed in concepts(FEEDBACK).items() for p in listed}


def cue_at(words: Sequence[str], i: int) -> str:
    """The concept of the longest phrase of feedback that begins at word i, or ""."""
    return _longest(_tree(_cues), words, i, 0, 0)[0]


def concept_at(words: Sequence[str], i: int) -> tuple[str, int]:
    """The concept of the longest phrase that begins at word i, and its number of words; ("", 0) for none."""
    return _longest(_tree(phrases), words, i, 0, 0)[:2]


def _longest(node: _Node, words: Sequence[str], i: int, used: int, bent: int) -> tuple[str, int, int]:
    """The longest phrase from this node on: concept, words, inflected words (fewer win)."""
    best = (node.concept, used, bent) if node.concept else ("", 0, 0)
    if i + used >= len(words):
        return best
    word = words[i + used]
    for form in _forms_at(node, word, begins=not used):
        found = _longest(node.following[form], words, i, used + 1, bent + (form != word))
        if found[0] and (found[1], -found[2]) > (best[1], -best[2]):
            best = found
    if used and word in DETERMINERS and word not in node.following:
        found = _longest(node, words, i, used + 1, bent)
        if found[0] and found[1] > used + 1 and found[1] > best[1]:
            best = found
    return best


def _forms_at(node: _Node, word: str, *, begins: bool) -> list[str]:
    """The forms of a word with which a phrase goes on; behind its first word only a plural is another form."""
    whole = node.following.get(word)
    if whole is not None and whole.concept:
        return [word]
    return [form for form in stems(word) if form in node.following and (begins or word in (form, form + "s"))]


ENDINGS = {
    "ing": ("", "e"), "ied": ("y",), "ies": ("y",), "ed": ("", "e"), "es": ("", "e"), "s": ("",), "ily": ("y",),
    "ly": ("", "le"), "iest": ("y",), "ier": ("y",), "est": ("", "e"), "er": ("", "e"),
}  # fmt: skip
"""What an inflected form ends in, and what its base form may end in instead."""


@lru_cache(maxsize=4096)
def stems(word: str) -> tuple[str, ...]:
    """The word itself and the base forms that it may be inflected from."""
    found = [word]
    if word in IRREGULAR:
        found.append(IRREGULAR[word])
    for ending, replacements in ENDINGS.items():
        if word.endswith(ending) and len(word) > len(ending) + 2:
            base = word[: -len(ending)]
            found += [base + r for r in replacements]
            if len(base) > 3 and base[-1] == base[-2]:
                found.append(base[:-1])
    return tuple(dict.fromkeys(found))


@cache
def known_words() -> frozenset[str]:
    """Every word of a phrase, and every filler word."""
    return filler() | {word for phrase in phrases() for word in phrase}


def is_known(word: str) -> bool:
    """Whether a word is one of the word files."""
    return not known_words().isdisjoint(stems(word))


def is_filler(word: str) -> bool:
    """Whether a word asks for nothing by itself."""
    return any(form in filler() for form in stems(word))


DEEPEST = 3
"""How far the sorts of sorts are followed: a spaniel is a dog, a dog an animal."""

ITSELF = frozenset(
    "robot arm drone gripper tool tip machine vehicle platform rover boat ship truck car cart plane".split()
)
"""Words that mean the robot wherever no object bears that name."""


@cache
def _sorts_of() -> Mapping[str, frozenset[str]]:
    """The nouns of `sorts/*.txt`, each with the sorts that it is of."""
    found: dict[str, set[str]] = {}
    for sort, nouns in concepts(folder="sorts").items():
        for noun in nouns:
            found.setdefault(noun, set()).add(sort)
    for _ in range(DEEPEST - 1):
        for sorts in found.values():
            sorts |= set().union(*(found.get(sort, set()) for sort in sorts))
    return {noun: frozenset(sorts - {noun} - ITSELF) for noun, sorts in found.items()}


def sorts_of(name: Sequence[str]) -> frozenset[str]:
    """The sorts of a thing, by the longest end of its name that is known; none for an unknown one.

    Args:
        name: The words of its name, in the singular.
    """
    table = _sorts_of()
    return next((table[end] for i in range(len(name)) if (end := " ".join(name[i:])) in table), frozenset())
