"""A sentence as the learned reader sees it: its objects and amounts found and replaced by marks, the rest as words.

What an object is called and how large an amount is says nothing about what is asked for; so the network sees only
"keep <m> from <A>", points at the marks, and the readers of objects and numbers say exactly what stands there.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from ovita.instruct.frames import Quantity, SemanticFrame, Span, unaimed
from ovita.instruct.lexicon import concept_at, is_filler, terms
from ovita.instruct.notation import show
from ovita.instruct.numerals import (
    FRACTIONS,
    NUMBER_WORDS,
    ORDINAL_WORDS,
    amount_at,
    and_a_half,
    as_said,
    more_first,
    unit_at,
)
from ovita.instruct.objects import WORD, Catalog
from ovita.instruct.spelling import respelt
from ovita.paths.scene import POINT, Scene
from ovita.paths.trajectory import Array

LETTERS = tuple(f"<{letter}>" for letter in "ABCDEFGH")
"""Marks of single objects, in the order in which a sentence names them."""

UNITS = {
    "": "<n>", "m": "<m>", "m/s": "<m/s>", "m/s2": "<m/s2>", "s": "<s>", "%": "<%>", "x": "<x>", "step": "<step>",
    "deg": "<deg>", "Hz": "<n>", "waypoints": "<wp>", "turns": "<n>",
}  # fmt: skip
"""Marks of amounts, by unit."""

GROUP, UNCLEAR = "<all>", "<which>"
MARKS = (*LETTERS, *dict.fromkeys(UNITS.values()), GROUP, UNCLEAR)

COUNTED = {
    "once": (1.0, ""), "couple": (2.0, ""), "pair": (2.0, ""), "hundred": (100.0, ""), "dozen": (12.0, ""),
    "twice": (2.0, "x"), "thrice": (3.0, "x"), "double": (2.0, "x"), "doubled": (2.0, "x"), "doubling": (2.0, "x"),
    "triple": (3.0, "x"), "tripled": (3.0, "x"), "treble": (3.0, "x"), "quadruple": (4.0, "x"),
    "quadrupled": (4.0, "x"), "twofold": (2.0, "x"), "threefold": (3.0, "x"), "fourfold": (4.0, "x"),
    "fivefold": (5.0, "x"), "sixfold": (6.0, "x"), "tenfold": (10.0, "x"),
    "halve": (0.5, "%"), "halved": (0.5, "%"), "halving": (0.5, "%"),
    "halfway": (0.5, "%"), "half way": (0.5, "%"), "midway": (0.5, "%"), "midpoint": (0.5, "%"),
    "half turn": (180.0, "deg"), "half revolution": (180.0, "deg"), "half rotation": (180.0, "deg"),
    "quarter turn": (90.0, "deg"), "quarter revolution": (90.0, "deg"), "quarter rotation": (90.0, "deg"),
    "right angle": (90.0, "deg"),
}  # fmt: skip
"""Amounts that are said without a number and a unit."""

WALKING = 1.4
"""How fast people walk [m/s] (Bohannon 1997, comfortable gait)."""

PLAIN_FRACTIONS = {w + s: round(v, 2) for w, v in FRACTIONS.items() for s in ("", "s")} | {"halves": 0.5}
ORDINALS = {
    "other": 2.0, "second": 2.0, "third": 3.0, "fourth": 4.0, "fifth": 5.0, "sixth": 6.0, "seventh": 7.0,
    "eighth": 8.0, "ninth": 9.0, "tenth": 10.0, **{word: float(number) for word, number in ORDINAL_WORDS.items()},
}  # fmt: skip
ENDINGS = ("'s", "'ll", "'d", "'re", "'ve", "'m")
WHOLE_UNIT = frozenset("last first final full whole another".split())
DETERMINERS = frozenset("the that this these those my your our a an".split())
NAMING = frozenset("the these those".split())
WAYPOINT_WORDS = frozenset("waypoint waypoints wp wps point points pts pt".split())

PIECE = re.compile(rf"{WORD.pattern}|\S")
JOINED = re.compile(r"(?<=[^\W\d_])-(?=[^\W\d_])|(?<=[^\W_])_(?=[^\W_])")
"""The sign that joins two words, as in "forty-five"."""

TIMES = re.compile(r"(?<!\S)[xX×](\d+(?:\.\d+)?)(?!\.?\w)")
"""A factor behind its sign, "x2.5", which is as long as "2.5x"."""

MULTIPLYING = frozenset("multiply multiplied multiplying divide divided dividing scale scaled scaling".split())
"""Words with which a bare number behind a "by" is a factor."""

SPELT_OUT = str.maketrans({"_": " ", "=": " ", "+": " and ", "@": " in ", ":": ","})
"""Signs of the notation in words."""


@dataclass(frozen=True)
class Referent:
    """An object or an amount that a sentence mentions.

    Args:
        words: Where it stands in the utterance; None for what was mentioned in the turn before.
        items: Names of the objects; empty for an amount.
        unclear: Whether the words leave the choice among the objects.
        value: The amount in `unit`.
        unit: SI dimension, "waypoints", or "".
        number: The number as it was said, before any unit.
        said: The amount as it was said, "10cm"; "" where it has no unit, or not one in digits.
        weak: Whether it may well mean nothing ("one", "half").
    """

    words: Span | None
    items: tuple[str, ...] = ()
    unclear: bool = False
    value: float = 0.0
    unit: str = ""
    number: float = 0.0
    said: str = ""
    weak: bool = False

    @property
    def is_object(self) -> bool:
        """Whether it is an object, not an amount."""
        return bool(self.items) or self.unclear

    @property
    def quantity(self) -> Quantity:
        """The amount as a quantity."""
        return Quantity(self.value, self.unit, said=self.said)


@dataclass(frozen=True)
class Fragment:
    """A word as it was written, or a mark with the index of its mention."""

    text: str
    words: Span | None
    mention: int = -1


@dataclass(frozen=True)
class Sketch:
    """A sentence in words and marks, then what was done in the turn before.

    Args:
        pieces: Of the sentence.
        before: Of the frames before it, in the notation; None for a first request.
        mentions: What the marks of both stand for.
        names: Of all objects.
        notes: On the spellings that were put right.
    """

    pieces: tuple[Fragment, ...]
    before: tuple[Fragment, ...] | None
    mentions: tuple[Referent, ...]
    names: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def sketch(
    text: str,
    scene: Scene,
    positions: Array | None = None,
    before: Collection[SemanticFrame] | None = None,
    known: Collection[str] = (),
) -> Sketch:
    """Find objects and amounts in a sentence and replace them by marks.

    Args:
        text: As written.
        scene: Whose objects may be named.
        positions: The path (N, 3) [m], for "the object nearest to the goal".
        before: Frames of the turns in force, where the sentence may be about them.
        known: Words that are no misspellings.
    """
    catalog = Catalog(scene, positions)
    letters: dict[str, str] = {}
    pieces, mentions, notes = _marked(text, catalog, letters, known)
    if before is None:
        return Sketch(pieces, None, mentions, scene.names, notes)
    shown = show([unaimed(frame) for frame in before])
    said, more, _ = _marked(shown.translate(SPELT_OUT), catalog, letters, known)
    shifted = tuple(replace(p, words=None, mention=p.mention + len(mentions) if p.mention >= 0 else -1) for p in said)
    return Sketch(pieces, shifted, mentions + tuple(replace(m, words=None) for m in more), scene.names, notes)


def cut(text: str) -> list[tuple[str, Span]]:
    """The words, numbers and signs of a text, with where they stand."""
    text = TIMES.sub(r"\1x", JOINED.sub(" ", text.replace("’", "'").replace("`", "'")))
    return [piece for match in PIECE.finditer(text) for piece in _without_ending(match.group(), match.start())]


def _without_ending(word: str, low: int) -> list[tuple[str, Span]]:
    """Cut the "'s" off "the lathe's" and the "'ll" off "the goat'll"."""
    at, high = low + len(word.partition("'")[0]), low + len(word)
    if word[at - low :].lower() not in ENDINGS:
        return [(word, (low, high))]
    return [(word[: at - low], (low, at)), (word[at - low :], (at, high))]


def _marked(
    text: str, catalog: Catalog, letters: dict[str, str], known: Collection[str]
) -> tuple[tuple[Fragment, ...], tuple[Referent, ...], tuple[str, ...]]:
    """A text in words and marks, what the marks stand for, and notes on its spelling."""
    raw = cut(text)
    words = [word.lower() for word, _ in raw]
    order = more_first(words)
    words, spans = [words[k] for k in order], [raw[k][1] for k in order]
    odd = [word for word in words if word.isalpha() and word not in known]
    right, notes = respelt(odd, catalog)
    spelling = dict(zip(odd, right, strict=True))
    words = [spelling.get(word, word) for word in words]
    pieces: list[Fragment] = []
    mentions: list[Referent] = []
    i = 0
    while i < len(raw):
        mention, used = _mention_at(words, i, catalog, mentions)
        word, (begins, ends) = " ".join(words[i : i + used]), zip(*spans[i : i + used], strict=True)
        span = min(begins), max(ends)
        if mention is None:
            pieces.append(Fragment(word, span))
        else:
            pieces.append(Fragment(_mark(mention, word, letters), span, len(mentions)))
            mentions.append(replace(mention, words=span))
        i += used
    return tuple(pieces), tuple(mentions), tuple(notes)


def _mark(mention: Referent, word: str, letters: dict[str, str]) -> str:
    if mention.unclear:
        return UNCLEAR
    if len(mention.items) > 1:
        return GROUP
    if mention.items:
        return letters.setdefault(mention.items[0], LETTERS[min(len(letters), len(LETTERS) - 1)])
    return word if mention.weak else UNITS[mention.unit]


def _mention_at(
    words: Sequence[str], i: int, catalog: Catalog, earlier: Sequence[Referent]
) -> tuple[Referent | None, int]:
    if _is_nothing(words, i):
        return None, 1
    last = _named_last(words, i, earlier)
    named = catalog.mention_at(words, i, tuple(catalog.scene[name] for name in last))
    if named is not None and len(named.items) == 1 and words[i] == "both":  # "both the cup and the lamp"
        return None, 1
    if named is not None and named.items:
        return Referent(None, tuple(item.name for item in named.items), named.unclear), named.used
    amount, used = _amount(words, i)
    return amount or _partly_named(words, i, catalog), used


def _named_last(words: Sequence[str], i: int, earlier: Sequence[Referent]) -> tuple[str, ...]:
    """The objects that a pronoun may mean: "from the shelf and the lamp, and slower near them"."""
    things = [m.items for m in earlier if m.items]
    last = things[-1] if things else ()
    both = words[i] == "them" and len(last) == 1 and len(things) > 1 and "and" in words[:i]
    return tuple(dict.fromkeys((*things[-2], *last))) if both else last


def _is_nothing(words: Sequence[str], i: int) -> bool:
    """Whether it is a sign, or a word of "a thing" or "the whole thing"."""
    before = _before(words, i)
    pairs = " ".join(words[i : i + 2]), f"{before} {words[i]}"
    if words[i] == "thing" and concept_at((before,), 0)[0]:  # "the speed thing"
        return True
    return not NOTHINGS.isdisjoint(pairs) or not (words[i].lstrip(".")[:1].isalnum() or POINT.fullmatch(words[i]))


NOTHINGS = frozenset(("a thing", "the thing", "whole thing", "entire thing"))
"""Things that are no object: none in particular, the robot, or its path."""


def _before(words: Sequence[str], i: int) -> str:
    """The word before word i, or ""."""
    return words[i - 1] if i else ""


LONG = 4
"""Words of a name of which one alone may stand for the thing; a longer one is a text, and no part of it is a name."""


def _partly_named(words: Sequence[str], i: int, catalog: Catalog) -> Referent | None:
    """The one object that has a word in its name, or begins or ends with it: "the oak" for the oak board."""
    word, before = words[i], _before(words, i)
    if len(word) < 3 or (is_filler(word) and before not in NAMING):
        return None
    determined = before in DETERMINERS and (word,) not in terms()
    fitting = _called_partly(word, catalog) or (_compounds(word, catalog) if determined else [])
    if len(fitting) != 1:
        return None
    is_head = catalog.words[fitting[0]][-1] in _forms(word) and before in DETERMINERS
    meant = is_head or determined or not concept_at((word,), 0)[0]
    return Referent(None, (fitting[0],)) if meant else None


def _forms(word: str) -> set[str]:
    """A noun in the plural, too, as in the singular."""
    return {word, word.removesuffix("s") if len(word) > 4 else word}


def _called_partly(word: str, catalog: Catalog) -> list[str]:
    """The objects that have a word in their name, if that is not long."""
    named = ((name, parts) for name, parts in catalog.words.items() if len(parts) <= LONG)
    return [name for name, parts in named if not _forms(word).isdisjoint(parts)]


def _compounds(word: str, catalog: Catalog) -> list[str]:
    """The objects whose last word begins or ends with another one: the workbench for "the bench"."""
    last = {name: parts[-1] for name, parts in catalog.words.items() if parts and len(word) > 3}
    return [name for name, whole in last.items() if whole.startswith(word) or whole.endswith(word)]


def _amount(words: Sequence[str], i: int) -> tuple[Referent | None, int]:
    for recognise in (_counted_by_word, _whole_unit, _share):
        found, used = recognise(words, i)
        if found is not None:
            return found, used
    amount = amount_at(words, i)
    if amount is None:
        return None, 1
    used, value = amount.used, abs(amount.value)
    number = _number_of(words[i], value)
    if amount.unit:
        said = as_said(words[i : i + used]) if used > 1 else ""
        return Referent(None, value=value, unit=amount.unit, number=number, said=said), used
    ranged = None if _before(words, i) == "between" else _range(words, i + used, value)
    if ranged is not None:
        return replace(ranged[0], number=number), used + ranged[1]
    counted = WAYPOINT_WORDS.intersection(words[i + used : i + used + 1])  # the word stays to be read
    weak = words[i : i + used] == ["one"]
    if not counted and _multiplies(words[max(i - 6, 0) : i]):
        return Referent(None, value=value, unit="x", number=number), used
    return Referent(None, value=value, unit="waypoints" if counted else "", number=number, weak=weak), used


def _multiplies(before: Sequence[str]) -> bool:
    """Whether the number behind some words is a factor: "multiply the speed by 1.5", "by a factor of 2"."""
    told = before[-1:] == ["by"] and not MULTIPLYING.isdisjoint(before)
    return told or before[-1:] == ["times"] or before[-2:] == ["factor", "of"]


def _counted_by_word(words: Sequence[str], i: int) -> tuple[Referent | None, int]:
    """Every third, halfway, a quarter turn, twice, walking pace."""
    if walks := _walking(words, i):
        return Referent(None, value=WALKING, unit="m/s", number=WALKING), walks
    if words[i] in ORDINALS and _before(words, i) == "every":
        return _weak(ORDINALS[words[i]], ""), 1
    if words[i] in ORDINALS and words[i + 1 : i + 2] in (["waypoint"], ["wp"], ["point"]):
        return Referent(None, value=ORDINALS[words[i]], number=ORDINALS[words[i]]), 1
    if words[i] == "half" and "again" in words[i + 1 : i + 4]:
        return _weak(1.5, "x"), words.index("again", i) + 1 - i
    for used in (1, 2):
        amount = COUNTED.get(" ".join(words[i : i + used]))
        if amount is not None and amount_at(words, i) is None:  # not the first word of "couple of inches"
            return _weak(*amount), used
    return None, 1


def _walking(words: Sequence[str], i: int) -> int:
    """How many words say the speed at which people walk: "walking pace", "than walking", "at a walk"; 0 if none do."""
    if words[i] == "walking" and words[i + 1 : i + 2] in (["pace"], ["speed"]):
        return 2
    compared = words[max(i - 2, 0) : i] in (["than", "a"], ["than", "i"], ["at", "a"], ["to", "a"])
    return int((words[i] == "walking" and _before(words, i) == "than") or (words[i] == "walk" and compared))


def _whole_unit(words: Sequence[str], i: int) -> tuple[Referent | None, int]:
    """The last metre, the first minute, "a" minute."""
    if not (_is_a_minute(words, i) or _before(words, i) in WHOLE_UNIT) or len(words[i]) < 4:
        return None, 1
    unit, factor, used = unit_at(words, i)
    if unit not in ("m", "s"):
        return None, 1
    more = and_a_half(words, i + used)
    return Referent(None, value=factor * (1.5 if more else 1), unit=unit, number=1.0), used + more


def _is_a_minute(words: Sequence[str], i: int) -> bool:
    """Whether it is the unit of "a minute", which lasts so long, and of no rate."""
    return words[max(i - 1, 0) : i + 1] == ["a", "minute"] and not unit_at(words, max(i - 2, 0))[0]


def _share(words: Sequence[str], i: int) -> tuple[Referent | None, int]:
    """A third, three quarters; "half a metre" is none."""
    behind = " ".join(words[i + 1 : i + 2])
    if words[i] in PLAIN_FRACTIONS:
        value, used = PLAIN_FRACTIONS[words[i]], 1
    elif words[i] in NUMBER_WORDS and behind in PLAIN_FRACTIONS and behind.endswith("s"):
        value, used = round(NUMBER_WORDS[words[i]] * FRACTIONS.get(behind[:-1], 0.5), 2), 2
    else:
        return None, 1
    measured = amount_at(words, i)
    if measured and (measured.unit in ("m", "m/s", "m/s2", "s") or "dozen" in words[i : i + measured.used]):
        return None, 1
    return _weak(value, "%"), used


def _weak(value: float, unit: str) -> Referent:
    return Referent(None, value=value, unit=unit, number=value, weak=True)


def _number_of(word: str, value: float) -> float:
    try:
        return float(word.replace(",", "."))
    except ValueError:
        return NUMBER_WORDS.get(word, value)


def _range(words: Sequence[str], i: int, low: float) -> tuple[Referent, int] | None:
    """The "to 15 cm" behind a 10: the middle of both."""
    if i + 1 >= len(words) or words[i] not in ("to", "-", "or"):
        return None
    high = amount_at(words, i + 1)
    said = _number_of(words[i + 1], 0.0)
    if high is None or high.unit not in ("m", "m/s") or said <= low:
        return None
    most = abs(high.value)  # the "-" of "30-32 cm" is no sign
    return Referent(None, value=(most + low * most / said) / 2, unit=high.unit), 1 + high.used
