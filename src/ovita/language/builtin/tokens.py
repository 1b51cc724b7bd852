"""From a sentence to tokens: objects of the scene, numbers with units, concepts, fillers, and unknown words."""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass
from functools import cache

from ovita.language.builtin.lexicon import (
    CONNECTIVES,
    FILLER,
    LONGEST_PHRASE,
    NUMBER_WORDS,
    UNITS,
    phrases,
    stems,
)
from ovita.scene import Scene, SceneObject, canonical


@dataclass(frozen=True)
class Token:
    """One meaningful piece of a sentence.

    Args:
        kind: "object", "number", "concept", "filler", "join" (and, then), "break" (punctuation) or "unknown".
        text: The words as the person wrote them.
        value: The concept, or the connective, or "".
        items: The object, or all objects ("every obstacle"), where kind is "object".
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

_WORD = re.compile(r"\d+(?:\.\d+)?|\.\d+|m/s|cm/s|[^\W\d_]+(?:['’][^\W\d_]+)?|%|[.,;:!?()]|[-+_/]")


def tokenize(sentence: str, scene: Scene) -> tuple[tuple[Token, ...], tuple[str, ...]]:
    """Split a sentence into tokens; also return the spellings that were corrected, as notes."""
    words = _without_hyphens([m.group() for m in _WORD.finditer(sentence)])
    lowered = [w.lower() for w in words]
    names = _name_table(scene)
    tokens: list[Token] = []
    notes: list[str] = []
    i = 0
    while i < len(words):
        token, used = _match(words, lowered, i, names, scene)
        if token.kind == "unknown":
            token, note = _corrected(token, scene)
            notes += [note] if note else []
        tokens.append(token)
        i += used
    tokens = [t for t in tokens if t.text not in SIGNS]
    reason = _reason(tokens)
    if reason:
        notes.append(f"took {' '.join(t.text for t in tokens[reason])!r} as the reason, not as something to do")
        tokens[reason] = []
    return tuple(tokens), tuple(notes)


def _reason(tokens: list[Token]) -> slice | None:
    """The words that only say why, up to the next mark: "to prevent skidding", "so that nobody is hurt".

    Words that name an object, a number or something to do are never a mere reason.
    """
    words = [t.text.lower() for t in tokens]
    for i in range(len(words)):
        opening = next((o for o in REASONS if words[i : i + len(o)] == list(o)), None)
        if opening is None:
            continue
        end = next((k for k in range(i, len(tokens)) if tokens[k].kind in ("break", "join")), len(tokens))
        rest = tokens[i + len(opening) : end]
        if rest and all(t.kind in ("unknown", "filler") for t in rest):
            return slice(i, end)
    return None


def _without_hyphens(words: list[str]) -> list[str]:
    """Drop the marks inside words ("zig-zag") and the endings of ordinals ("5th"), but keep the sign of a number."""
    return [
        word
        for i, word in enumerate(words)
        if (word not in SIGNS and not (word.lower() in ("st", "nd", "rd", "th") and i > 0 and _is_digits(words[i - 1])))
        or (word == "-" and i + 1 < len(words) and _is_digits(words[i + 1]))
    ]


def _is_digits(word: str) -> bool:
    return re.fullmatch(r"\d+(?:\.\d+)?|\.\d+", word) is not None


def _match(
    words: list[str], lowered: list[str], i: int, names: dict[tuple[str, ...], SceneObject], scene: Scene
) -> tuple[Token, int]:
    longest = max((len(n) for n in names), default=0)
    name, used = _object_at(lowered, i, names, longest)
    concept, length = _concept_at(lowered, i)
    if name is not None and used >= length:
        return Token("object", " ".join(words[i : i + used]), items=(name,)), used
    every = _all_objects_at(lowered, i)
    if every and scene.objects:
        return Token("object", " ".join(words[i : i + every]), items=scene.objects), every
    number = _number_at(lowered, i)
    if number is not None and number[1] >= length:
        token, count = number
        return Token("number", " ".join(words[i : i + count]), number=token[0], unit=token[1]), count
    word = lowered[i]
    if concept:
        return Token("concept", " ".join(words[i : i + length]), value=concept), length
    if word in ".,;:!?()":
        return Token("break", word, value=word), 1
    if word in CONNECTIVES:
        return Token("join", words[i], value=word), 1
    if word in SIGNS or any(s in FILLER for s in stems(word)):
        return Token("filler", words[i]), 1
    return Token("unknown", words[i]), 1


def _object_at(
    lowered: list[str], i: int, names: dict[tuple[str, ...], SceneObject], longest: int
) -> tuple[SceneObject | None, int]:
    span = [w for w in lowered[i:]]
    best: tuple[SceneObject | None, int] = (None, 0)
    collected: list[str] = []
    for used, word in enumerate(span, start=1):
        if not word[0].isalnum():
            break
        collected.append(word)
        if len(collected) > longest:
            break
        for form in (tuple(collected), (*collected[:-1], *_singular(collected[-1]))):
            if form in names:
                best = (names[form], used)
    return best


def _all_objects_at(lowered: list[str], i: int) -> int:
    """How many words from i on mean all objects: "objects", "all the obstacles", "every object"; 0 for none."""
    quantified = lowered[i] in ("all", "every", "each", "any")
    rest = [w for w in lowered[i + quantified : i + quantified + 3] if w not in ("of", "the")]
    skipped = next((k for k, w in enumerate(lowered[i + quantified :]) if w not in ("of", "the")), 0)
    if skipped and not quantified:
        return 0
    plural = rest[:1] in (["objects"], ["obstacles"])
    single = quantified and rest[:1] in (["object"], ["obstacle"])
    return quantified + skipped + 1 if plural or single else 0


def _singular(word: str) -> tuple[str, ...]:
    return (word[:-1] if len(word) > 3 and word.endswith("s") else word,)


def _concept_at(lowered: list[str], i: int) -> tuple[str, int]:
    table = phrases()
    for length in range(min(LONGEST_PHRASE, len(lowered) - i), 0, -1):
        span = lowered[i : i + length]
        for last in stems(span[-1]):
            for head in stems(span[0]) if length > 1 else [last]:
                key = (last,) if length == 1 else (head, *span[1:-1], last)
                if key in table:
                    return table[key], length
    return "", 0


def _number_at(lowered: list[str], i: int) -> tuple[tuple[float, str], int] | None:
    word = lowered[i]
    if _is_digits(word):
        value, used = float(word), 1
    elif word in NUMBER_WORDS:
        value, used = NUMBER_WORDS[word], 1
    else:
        return None
    if i > 0 and lowered[i - 1] == "-":
        value = -value
    if i + used < len(lowered):
        for unit in stems(lowered[i + used]):
            if unit in UNITS:
                name, factor = UNITS[unit]
                return (value * factor, name), used + 1
    return (value, ""), used


def _name_table(scene: Scene) -> dict[tuple[str, ...], SceneObject]:
    """Every way to name an object: its whole name, and each word of it that no other object and no concept bears."""
    table: dict[tuple[str, ...], SceneObject] = {}
    owners: dict[str, list[SceneObject]] = {}
    for item in scene.objects:
        parts = _parts(item)
        table[parts] = item
        for word in set(parts):
            owners.setdefault(word, []).append(item)
    for item in scene.objects:
        head = (_parts(item) or ("",))[-1]
        if len(owners.get(head, ())) == 1 and (head,) not in phrases() and head not in FILLER:
            table.setdefault((head,), item)
    return table


def _parts(item: SceneObject) -> tuple[str, ...]:
    """The words of an object's name, cut as a sentence is cut."""
    return tuple(w for w in _WORD.findall(canonical(item.name)) if w[0].isalnum())


@cache
def _vocabulary() -> tuple[str, ...]:
    single = [p[0] for p in phrases() if len(p) == 1 and len(p[0]) > 4]
    return tuple(dict.fromkeys([*single, *(w for w in FILLER if len(w) > 4)]))


def _corrected(token: Token, scene: Scene) -> tuple[Token, str]:
    """Read a misspelt word as the one known word close to it."""
    word = token.text.lower()
    if len(word) < 4:
        return token, ""
    heads = {canonical(item.name): item for item in scene.objects}
    close = difflib.get_close_matches(word, heads, 1, 0.8)
    if close:
        item = heads[close[0]]
        return Token("object", token.text, items=(item,)), f"read {token.text!r} as {item.name!r}"
    for form in stems(word):
        near = difflib.get_close_matches(form, _vocabulary(), 1, 0.84)
        if near and len(form) > 4:
            concept = phrases().get((near[0],), "")
            kind = "concept" if concept else "filler"
            return Token(kind, token.text, value=concept), f"read {token.text!r} as {near[0]!r}"
    return token, ""
