"""From a sentence to tokens: objects of the scene, numbers with units, concepts, fillers, and unknown words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

from ovita.instruct.lexicon import (
    CONNECTIVES,
    FEEDBACK,
    JOIN,
    PLAIN,
    concept_at,
    concepts,
    is_filler,
    known_words,
    stems,
)
from ovita.instruct.numbers import NUMBER_WORDS, UNITS, amount_at, is_digits
from ovita.instruct.objects import GENERIC, WORD, Catalog, Mention, singular
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array

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


def respelt(words: Sequence[str], catalog: Catalog) -> tuple[list[str], list[str]]:
    """Replace misspelt words by the known words that they are close to; also return a note on each."""
    named = {word for name in catalog.words.values() for word in name}
    found: list[str] = []
    notes: list[str] = []
    for word in words:
        right = word
        if len(word) >= 3 and word.isalpha() and not _is_known(word, named, catalog):
            right = _corrected(word, named)
        if right != word:
            notes.append(f"read {word!r} as {right!r}")
        found.append(right)
    return found, notes


def _is_known(word: str, named: set[str], catalog: Catalog) -> bool:
    if singular(word) in named or word in named or word in catalog.vocabulary:
        return True
    return any(form in known_words() or form in OTHERS for form in (*stems(word), singular(word)))


def _corrected(word: str, named: set[str]) -> str:
    names = [n for n in sorted(named) if close(word, n) or (len(n) == len(word) + 1 and n.startswith(word))]
    if len(names) == 1:
        return names[0]
    single = _unswapped(word) if len(word) < SHORTEST and word[-1] != word[-2] else _undoubled(word)
    if single != word or len(word) < SHORTEST:
        return single
    known = _by_letter()
    for ending in ("", "s", "ed", "ing", "ly", "er"):
        form = word.removesuffix(ending)
        if len(form) < SHORTEST or not word.endswith(ending):
            continue
        near = [k for k in dict.fromkeys((*known.get(form[0], ()), *known.get("_" + form[0], ()))) if close(form, k)]
        if near:
            return min(near, key=lambda k: (distance(form, k), abs(len(k) - len(form)), k))
    return word


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


@dataclass(frozen=True)
class Token:
    """One meaningful piece of a sentence.

    Args:
        kind: "object", "number", "concept", "filler", "join" (and, then), "break" (punctuation) or "unknown".
        text: The words as the person wrote them.
        value: The concept, or the connective, or "".
        items: The object, or all objects ("every obstacle"), where kind is "object"; where it is "unknown", the objects
            among which the words leave the choice.
        number: In SI units (a share for %), where kind is "number".
        unit: "", "m", "m/s", "%", "x" (times), "step", "s" or "deg".
    """

    kind: str
    text: str
    value: str = ""
    items: tuple[SceneObject, ...] = ()
    number: float = 0.0
    unit: str = ""


REASONS = (("to", "prevent"), ("to", "ensure"), ("so", "that"), ("in", "order", "to"), ("because",), ("since",))
"""How a clause begins that says why."""

SIGNS = ("-", "+", "_", "/")

AXES = ("x", "y", "z")

CHOICE = "choice"
"""Value of an unknown token that leaves the choice among several objects."""


def tokenize(sentence: str, scene: Scene, path: Array | None = None) -> tuple[tuple[Token, ...], tuple[str, ...]]:
    """Split a sentence into tokens; also return the spellings that were corrected, as notes.

    Args:
        sentence: As written.
        scene: Whose objects may be named.
        path: Positions (N, 3) [m], for phrases such as "the object nearest to the goal".
    """
    words = cut(sentence)
    catalog = Catalog(scene, path)
    lowered, notes = respelt([w.lower() for w in words], catalog)
    tokens: list[Token] = []
    i = 0
    while i < len(words):
        token, used = _match(words, lowered, i, catalog, _named_last(tokens))
        tokens.append(token)
        i += used
    tokens = _with_units([t for t in tokens if t.text not in SIGNS])
    replaced = _replaced(tokens)
    if replaced:
        notes.append(f"took {' '.join(t.text for t in tokens[replaced])!r} as what was so far")
        tokens[replaced] = []
    reason = _reason(tokens)
    if reason:
        notes.append(f"took {' '.join(t.text for t in tokens[reason])!r} as the reason, not as something to do")
        tokens[reason] = []
    return tuple(tokens), tuple(notes)


def cut(sentence: str) -> list[str]:
    """The words, numbers and marks of a sentence."""
    return _without_hyphens([m.group() for m in WORD.finditer(sentence.replace("’", "'"))])


def _with_units(tokens: list[Token]) -> list[Token]:
    """Give the first of two numbers the unit behind the second: "10 to 15 cm", "between 0.1 and 0.2 m/s"."""
    for i in range(len(tokens) - 2):
        one, link, two = tokens[i : i + 3]
        if one.kind == "number" == two.kind and not one.unit and two.unit in ("m", "m/s", "s", "deg"):
            said = float(two.text.split()[0].replace(",", ".")) if is_digits(two.text.split()[0]) else 0.0
            if link.text.lower() in ("to", "and", "or") and said > 0:
                tokens[i] = replace(one, number=one.number * two.number / said, unit=two.unit)
    return tokens


def _named_last(tokens: list[Token]) -> tuple[SceneObject, ...]:
    return next((t.items for t in reversed(tokens) if t.kind == "object"), ())


def _replaced(tokens: list[Token]) -> slice | None:
    """The words up to the next mark of an "instead of" phrase: "instead of around it"."""
    for i in range(1, len(tokens) - 1):
        pair = tokens[i].text.lower(), tokens[i + 1].text.lower()
        if pair in (("instead", "of"), ("rather", "than")) or pair[0] in ("instead of", "rather than"):
            end = next((j for j in range(i, len(tokens)) if tokens[j].kind in ("break", "join")), len(tokens))
            return slice(i, end)
    return None


def _reason(tokens: list[Token]) -> slice | None:
    """The words that only say why, up to the next mark: "to prevent skidding", "so that nobody is hurt".

    Words that name an object, a number or something to do are never a mere reason.
    """
    words = [w for t in tokens for w in t.text.lower().split()]
    owner = [i for i, t in enumerate(tokens) for _ in t.text.split()]
    for k in range(len(words)):
        opening = next((o for o in REASONS if tuple(words[k : k + len(o)]) == o), None)
        if opening is None or (k > 0 and owner[k - 1] == owner[k]):
            continue
        begin, inside = owner[k], owner[min(k + len(opening) - 1, len(owner) - 1)] + 1
        end = next((j for j in range(begin, len(tokens)) if tokens[j].kind in ("break", "join")), len(tokens))
        rest = tokens[inside:end]
        if rest and all(t.kind in ("unknown", "filler") for t in rest):
            return slice(begin, end)
    return None


def _without_hyphens(words: list[str]) -> list[str]:
    """Drop the marks inside words ("zig-zag") and the endings of ordinals ("5th"), but keep the sign of a number."""
    kept: list[str] = []
    for i, word in enumerate(words):
        before, behind = words[i - 1] if i else "", words[i + 1] if i + 1 < len(words) else ""
        if word.lower() == "nor":
            kept += ["and", "not"]
        elif word in SIGNS:
            if is_digits(behind) and is_digits(before):
                kept.append("to" if word == "-" else word)
            elif word == "-" and is_digits(behind):
                kept.append(word)
            elif word == "/" and before.lower() in ("m", "cm", "mm", "km"):
                kept.append(word)
            elif behind.lower() in AXES and before.lower() not in AXES:
                kept.append("minus" if word == "-" else word)
        elif not (word.lower() in ("st", "nd", "rd", "th") and is_digits(before)):
            kept.append(word)
    return kept


def _match(
    words: list[str], lowered: list[str], i: int, catalog: Catalog, earlier: tuple[SceneObject, ...]
) -> tuple[Token, int]:
    if lowered[i] == "next" and lowered[i + 1 : i + 2] and lowered[i + 1] in ("half", "part", "third", "quarter"):
        return Token("concept", words[i], value="second"), 1
    mention = catalog.mention_at(lowered, i, earlier) if lowered[i][0].isalnum() else None
    concept, length = concept_at(lowered, i)
    if mention is not None and mention.used >= length and (not mention.unclear or not concept):
        return _object(words, i, mention), mention.used
    amount = amount_at(lowered, i)
    if amount is not None and amount.used >= length and not _is_ordinal(lowered, i):
        text = " ".join(words[i : i + amount.used])
        return Token("number", text, number=amount.value, unit=amount.unit), amount.used
    word = lowered[i]
    if concept in (PLAIN, JOIN):
        text = " ".join(words[i : i + length])
        return (Token("filler", text) if concept == PLAIN else Token("join", text, value="and")), length
    if concept:
        return Token("concept", " ".join(words[i : i + length]), value=concept), length
    if word in ".,;:!?()":
        return Token("break", word, value=word), 1
    if word in CONNECTIVES:
        return Token("join", words[i], value=word), 1
    if word in SIGNS or is_filler(word):
        return Token("filler", words[i]), 1
    return Token("unknown", words[i]), 1


def _is_ordinal(lowered: list[str], i: int) -> bool:
    """Whether a number word is none: "the one", "at one", "once"."""
    return lowered[i] == "one" and lowered[i - 1 : i] in (["the"], ["this"], ["that"])


def _object(words: list[str], i: int, mention: Mention) -> Token:
    text = " ".join(words[i : i + mention.used])
    if mention.unclear:
        return Token("unknown", text, value=CHOICE, items=mention.items)
    return Token("object", text, items=mention.items)
