"""Slips of the fingers: words put right by the words and the names of objects that are known."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, lru_cache
from importlib.resources import files

from ovita.instruct.lexicon import CONNECTIVES, FEEDBACK, concepts, known_words, stems
from ovita.instruct.numerals import NUMBER_WORDS, UNITS
from ovita.instruct.objects import GENERIC, Catalog, singular

SHORTEST = 5
"""Letters that a word must have to be corrected; shorter ones are too often other words."""

OTHERS = frozenset(
    {
        *CONNECTIVES,
        *NUMBER_WORDS,
        *GENERIC,
        *(w for phrase in UNITS for w in phrase),
        *(w for listed in concepts(FEEDBACK).values() for phrase in listed for w in phrase.split()),
    }
)
"""Words that stand in no word file of requests and are right all the same."""


def respelt(words: Sequence[str], catalog: Catalog) -> tuple[list[str], list[str]]:
    """Replace misspelt words by the known words that they are close to; also return a note on each."""
    named = {word for name in catalog.words.values() for word in name}
    found: list[str] = []
    notes: list[str] = []
    for word in words:
        right = word
        if len(word) >= 3 and word.isalpha() and not _is_known(word, named, catalog):
            right = _known_spelling(word, named)
        if right != word:
            notes.append(f"read {word!r} as {right!r}")
        found.append(right)
    return found, notes


def _is_known(word: str, named: set[str], catalog: Catalog) -> bool:
    if singular(word) in named or word in named or word in catalog.vocabulary or singular(word) in catalog.sorts:
        return True
    return any(form in known_words() or form in OTHERS for form in (*stems(word), singular(word))) or word in _rightly()


@cache
def _rightly() -> frozenset[str]:
    """Words that are no slips though they are close to known ones, from `rightly/spelt.txt`."""
    lines = files("ovita.instruct").joinpath("rightly/spelt.txt").read_text(encoding="utf-8").splitlines()
    return frozenset(" ".join(line for line in lines if not line.startswith("#")).split())


def _known_spelling(word: str, named: set[str]) -> str:
    names = [n for n in sorted(named) if close(word, n) or (len(n) == len(word) + 1 and n.startswith(word))]
    names = names or [
        n for n in sorted(named) if len(word) > 3 and (n.endswith(word) or (len(n) >= SHORTEST and word.endswith(n)))
    ]
    return names[0] if len(names) == 1 else _known_for(word)


@lru_cache(maxsize=4096)
def _known_for(word: str) -> str:
    """The word of the word files that a word is a slip of, else the word."""
    single = _unswapped(word) if len(word) < SHORTEST and word[-1] != word[-2] else _undoubled(word)
    if single != word or len(word) < SHORTEST:
        return single
    for ending in ("", "s", "ed", "ing", "ly", "er"):
        form = word.removesuffix(ending)
        if len(form) >= SHORTEST and word.endswith(ending) and (near := _close_to(form)):
            return min(near, key=lambda k: (distance(form, k), abs(len(k) - len(form)), k))
    return word


def _close_to(form: str) -> list[str]:
    """The known words that a word may be a slip of."""
    known = _by_letter()
    likely = dict.fromkeys((*known.get(form[0], ()), *known.get("_" + form[0], ())))
    return [word for word in likely if close(form, word)]


@cache
def _all_known() -> frozenset[str]:
    return known_words() | OTHERS


def _unswapped(word: str) -> str:
    """The one known word that two neighbouring letters of a short word were swapped in: "mvoe", "teh"."""
    swapped = {word[:i] + word[i + 1] + word[i] + word[i + 2 :] for i in range(len(word) - 1)}
    found = sorted(swapped & _all_known())
    return found[0] if len(found) == 1 else word


def _undoubled(word: str) -> str:
    """The known word of three or four letters in which one was typed twice: "lefft", "bitt"."""
    if len(word) not in (4, 5):
        return word
    found = {word[:i] + word[i + 1 :] for i in range(len(word) - 1) if word[i] == word[i + 1]} & _all_known()
    return min(found) if len(found) == 1 else word


@cache
def _by_letter() -> dict[str, tuple[str, ...]]:
    """The known words by their first letter, and by their second one ("_x") for words that lost the first."""
    groups: dict[str, list[str]] = {}
    for word in sorted(known_words() | OTHERS | {g + "s" for g in GENERIC}):
        if len(word) >= SHORTEST and word.isalpha():
            groups.setdefault(word[0], []).append(word)
            groups.setdefault("_" + word[1], []).append(word)
    return {letter: tuple(words) for letter, words in groups.items()}


def close(a: str, b: str) -> bool:
    """Whether two words differ by one slip, or by two in words of eight letters and more."""
    shorter = min(len(a), len(b))
    allowed = 2 if shorter >= 8 else 1 if shorter >= 4 else 0
    if len(a) == len(b) < 7 and sorted(a) != sorted(b):
        return False  # one letter for another makes too many short words of others: "abort", "about"
    return a != b and abs(len(a) - len(b)) <= allowed and distance(a, b) <= allowed


def distance(a: str, b: str) -> int:
    """Letters to insert, drop, replace or swap with their neighbour to make b of a (optimal string alignment)."""
    rows = [list(range(len(b) + 1))]
    for i, x in enumerate(a, start=1):
        row = [i]
        for j, y in enumerate(b, start=1):
            cost = min(rows[-1][j] + 1, row[-1] + 1, rows[-1][j - 1] + (x != y))
            if i > 1 and j > 1 and x == b[j - 2] and a[i - 2] == y:
                cost = min(cost, rows[-2][j - 2] + 1)
            row.append(cost)
        rows.append(row)
    return rows[-1][-1]
