# ruff: noqa: E501
"""From an utterance to chunks: objects of the scene, numbers with units, words by class, and words that nobody knows.

A chunk's class is what the referee looks at; `span` says where it stands.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, TypeAlias

from ovita.instruct.frames import Quantity, Span
from ovita.instruct.lexicon import DETERMINERS, term_at
from ovita.instruct.numerals import ORDINAL_WORDS, amount_at, as_said, is_digits, more_first, unit_apart
from ovita.instruct.objects import WORD, Catalog
from ovita.instruct.spelling import respelt
from ovita.paths.scene import POINT, Scene
from ovita.paths.trajectory import Array
from ovita.units import dimension

SIGNS = ("-", "+", "_", "/")

AXES = ("x", "y", "z")


def cut(sentence: str) -> list[str]:
    """The words, numbers and marks of a sentence."""
    return _without_hyphens([m.group() for m in WORD.finditer(sentence.replace("’", "'"))])


def _without_hyphens(words: list[str]) -> list[str]:
    """Drop the marks inside words ("zig-zag") and the endings of ordinals ("5th"), but keep the sign of a number."""
    kept: list[str] = []
    for before, word, behind in zip(["", *words], words, [*words[1:], ""], strict=False):
        if word.lower() == "nor":
            kept += ["and", "not"]
        elif word in SIGNS:
            kept += _sign_between(word, before, behind)
        elif not (word.lower() in ("st", "nd", "rd", "th") and is_digits(before)):
            kept.append(word)
    return kept


def _sign_between(word: str, before: str, behind: str) -> list[str]:
    """What a mark is between two words: a range, the sign of a number, a fraction of units, a sign of an axis; or []."""
    number = is_digits(behind)
    if number and is_digits(before):
        return ["to" if word == "-" else word]
    if (word == "-" and number) or (word == "/" and dimension(before) == "m"):
        return [word]
    if behind.lower() in AXES and before.lower() not in AXES:
        return ["minus" if word == "-" else word]
    return []


PIECE = re.compile(
    rf"{POINT.pattern}|"
    r"\d+[.,]\d+|\d+(?:st|nd|rd|th)\b|\d+|\.\d+(?=\D|$)|(?:k?m|cm|mm|ft|in|deg)/(?:s(?:ec)?(?:\^?2|²)?|h|min)\b|m/s(?:\^?2|²)"
    r"|[^\W\d_]+(?:['’][^\W\d_]+)*|-{1,2}>|>=|<=|=>|=<|\+=|-=|\+/?-|\.\.+|[%°″′≥≤<>=@&~±×+\-/_.,;:!?()–—→]"
)
CONTRACTION = re.compile(r"(?:i|you|he|she|it|we|they|there|what|who|that|here|how)'?(?:s|re|ve|ll|d|m)")
SYMBOLS = {
    "->": "to", "-->": "to", ">=": "at least", "=>": "at least", "≥": "at least", ">": "at least", "<=": "at most", "=<": "at most",
    "≤": "at most", "<": "at most", "=": "to", "@": "at", "&": "and", "~": "about", "+=": "plus", "-=": "minus", "×": "x",
    "+-": "", "+/-": "", "±": "", "°": "degrees", "_": "", "→": "to", "(": ",", ")": ",", "–": ",", "—": ",", "-": "-",
}  # fmt: skip
BREAKS = frozenset(".,;:!?")
NUMERIC = tuple(".0123456789")


ORDINALS = {"2nd": "second", "3rd": "third", "4th": "fourth", "5th": "fifth", "1st": "first", "6th": "sixth",
            "7th": "seventh", "8th": "eighth", "9th": "ninth", "10th": "tenth"}  # fmt: skip
ORDINAL = re.compile(r"(\d+)(?:st|nd|rd|th)")
ABBREVIATED = frozenset("approx appr ca max min no pls vs incl sec secs deg pos ref traj wp wpt".split())
"""Words that a full stop may shorten."""

AFTER_CM = frozenset(
    "left right up down to from above below away off higher at near of and further forward back".split()
)
"""What goes on behind a "cm." that is shortened: "5 cm. to the left"."""

COUNTED = {"second": 2, "other": 2, "third": 3, "fourth": 4, "quarter": 4, "fifth": 5, "sixth": 6, "seventh": 7,
           "eighth": 8, "ninth": 9, "tenth": 10}  # fmt: skip
COUNTABLE = frozenset("waypoint point wp pt".split())
"""Ordinals, as in "every third", and what they count: "the fifth point"."""

PRONOUNS = frozenset("it him her them that this he she they one theirs".split())
PLACING = frozenset("at by on to from of near around after before over under thru touch toward within for pass".split())
BESIDE = frozenset("near around over under toward past".split())
SHORT = {"pc": "%", "pct": "%", "L": "left", "R": "right", "dz": "z", "dx": "x", "dy": "y", "w": "with"}
SHORT |= {word: f"{number}th" for word, number in ORDINAL_WORDS.items()}


@dataclass(frozen=True)
class Chunk:
    """A meaningful piece of an utterance.

    Args:
        kind: Its class: one of `terms/`, "OBJ", "CHOICE", "Q" and its unit, "comma", "dot", "and", "filler" or "unknown".
        text: As it was written.
        span: Where it stands.
        names: Objects that it means.
        q: The quantity that it is.
    """

    kind: str
    text: str
    span: Span
    names: tuple[str, ...] = ()
    q: Quantity | None = None

    @property
    def number(self) -> Quantity:
        """The quantity that it is; a bare zero if it is none."""
        return self.q or Quantity(0.0)


@dataclass(frozen=True)
class _Word:
    text: str
    span: Span


UNIT_KIND = {"m": "Qm", "m/s": "Qv", "m/s2": "Qa", "s": "Qs", "deg": "Qdeg", "%": "Qpc", "x": "Qx", "step": "Qstep", "": "Qn",
             "Hz": "Qhz"}  # fmt: skip


def chunks(text: str, scene: Scene, positions: Array | None = None) -> tuple[tuple[Chunk, ...], tuple[str, ...]]:
    """Cut an utterance into chunks; also the spellings that were corrected, as notes."""
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
def _cut(text: str, setting: _Setting) -> tuple[tuple[Chunk, ...], tuple[str, ...]]:
    """As `chunks`; each reader cuts an utterance anew, which takes a third of the time of understanding it."""
    scene, positions = setting.scene, setting.positions
    said = _pieces(text)
    order = more_first([w.text.lower() for w in said])
    words = [_Word(said[i].text, w.span) for i, w in zip(order, said, strict=True)]
    catalog = Catalog(scene, positions)
    catalog.add_nicknames()
    lowered, notes = respelt([w.text.lower() for w in words], catalog)
    found: list[Chunk] = []
    i, apart = 0, unit_apart(lowered)
    while i < len(words):
        chunk, used = _chunk(words, lowered, i, catalog, found, apart)
        found.append(chunk)
        i += used
    found = [_chosen(chunk, found) for chunk in found]
    return tuple(_forbidden(chunk, found[i + 1 :]) for i, chunk in enumerate(found)), tuple(notes)


def _chosen(chunk: Chunk, found: Sequence[Chunk]) -> Chunk:
    """One of several objects that is named besides: "our table, it is table 1"."""
    named = {c.names for c in found if c.kind == "OBJ" and len(c.names) == 1 and c.names[0] in chunk.names}
    return replace(chunk, kind="OBJ", names=named.pop()) if chunk.kind == "CHOICE" and len(named) == 1 else chunk


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


def _pieces(text: str) -> list[_Word]:
    """The words and marks of a text, with signs, ranges and symbols as words."""
    found: list[_Word] = []
    matches = [None, *PIECE.finditer(text.replace("’", "'")), None]
    for before, match, behind in zip(matches, matches[1:], matches[2:], strict=False):
        assert match is not None
        (last, glued), (following, joined) = _beside(before, match), _beside(behind, match)
        word = match.group()
        if word in ("-", "+", "/", ".."):
            word = _mark(word, last, following, glued, joined)
        word = _spelled_out(word, last, following)
        multiplies = word in TIMES and joined and following.startswith(NUMERIC)  # "x1.5" is 1.5 times
        if multiplies or (glued and _only_shortens(word, last, following)):
            continue
        parts = [word] if POINT.fullmatch(word) else SYMBOLS.get(word, word).split()
        found += [_Word(part, match.span()) for part in parts]
        if last in TIMES and glued and word.startswith(NUMERIC):
            found.append(_Word("x", match.span()))
    return found


def _beside(other: re.Match[str] | None, match: re.Match[str]) -> tuple[str, bool]:
    """What stands before or behind a piece, and whether no space is between; ("", False) for nothing."""
    return (
        ("", False) if other is None else (other.group(), match.start() == other.end() or match.end() == other.start())
    )


def _spelled_out(word: str, last: str, following: str) -> str:
    """An abbreviation in full, an ordinal in digits: "the second waypoint", but no second that is a time."""
    word = ORDINALS.get(word, SHORT.get(word, word))
    counts = word in COUNTED and word != "other" and last.lower() in DETERMINERS and following.lower() in COUNTABLE
    return f"{COUNTED[word]}th" if counts else word


def _only_shortens(word: str, last: str, following: str) -> bool:
    """Whether a full stop ends no sentence: "approx. 5 cm"."""
    if word != "." or not following or following[0].isupper():
        return False
    return last.lower() in ABBREVIATED or (last.lower() in ("cm", "mm") and following in AFTER_CM)


TIMES = ("x", "X", "×")


def _mark(word: str, last: str, following: str, glued: bool, joined: bool) -> str:
    """What a sign or slash is: a sign, a range, "and", a pause, or nothing inside of a word.

    `last` and `following` stand beside it, and are `glued` and `joined` to it where no space is between.
    """
    number, counted, inside = following.startswith(NUMERIC), last == "%" or last[-1:].isdigit(), glued and joined
    if word == "/":
        return "/" if counted or not inside else "and"
    if word == "+":
        return "plus" if number else "and"
    if word == ".." or (glued and counted and number):
        return "to"
    negates = joined and (number or (not glued and following in AXES))
    return "minus" if negates else _dash(glued, inside, number)


def _dash(glued: bool, inside: bool, number: bool) -> str:
    if inside:
        return ""
    return "to" if glued and not number else ","


def _chunk(
    words: Sequence[_Word], lowered: list[str], i: int, catalog: Catalog, found: Sequence[Chunk], apart: int | None
) -> tuple[Chunk, int]:
    """The chunk that begins at a word, and how many words it takes; `apart` is where a unit is told by itself."""
    word = lowered[i]
    kind, length = ("", 0) if _sign(word) else term_at(lowered, i)
    earlier = next((c.names for c in reversed(found) if c.kind == "OBJ"), ())
    options: tuple[Callable[[], Made], ...] = (
        lambda: _thing(lowered, i, catalog, earlier, kind, length),
        lambda: _sign(word),
        lambda: (_of("filler"), 1) if i == apart else None,
        lambda: _quantity(lowered, i, length),
        lambda: (
            _pronoun(word, earlier or (catalog.person if word in ("her", "him") else ()), found)
            if length <= 1
            else None
        ),
        lambda: _known(word, kind, length),
    )
    chunk, used = next(made for option in options if (made := option()) is not None)
    text, span = " ".join(w.text for w in words[i : i + used]), (words[i].span[0], words[i + used - 1].span[1])
    return replace(chunk, text=text, span=span), used


def _of(kind: str, **more: Any) -> Chunk:
    """A chunk whose words are still to be filled in."""
    return Chunk(kind, "", (0, 0), **more)


Made: TypeAlias = tuple[Chunk, int] | None


def _sign(word: str) -> Made:
    """A mark of punctuation."""
    if word in BREAKS:
        return _of("dot" if word in ".;!?" else "comma"), 1
    return None if word[0].isalnum() or word in "+-=@%" or word[0] == "." else (_of("filler"), 1)


def _thing(words: Sequence[str], i: int, catalog: Catalog, earlier: tuple[str, ...], kind: str, length: int) -> Made:
    """Objects that are named or described, by as many words at least as any class."""
    places = kind in PLACING and DETERMINERS.isdisjoint(words[i - 1 : i])  # not "stop at the tap"
    if not (words[i][0].isalnum() or POINT.fullmatch(words[i])) or places:
        return None
    mention = catalog.mention_at(words, i, tuple(catalog.scene[name] for name in earlier))
    several = mention is not None and kind == "ground" and len(mention.items) > 1  # tables, where there is no ground
    if mention is None or mention.used < length or (mention.unclear and kind and not several):
        return None
    return _of("CHOICE" if mention.unclear else "OBJ", names=tuple(item.name for item in mention.items)), mention.used


def _quantity(words: Sequence[str], i: int, length: int) -> Made:
    """An amount; not the "one" of "the one"."""
    amount = amount_at(words, i)
    pronoun = words[i] == "one" and words[i - 1 : i] in (["the"], ["that"], ["current"], ["present"], ["old"])
    if amount is None or amount.used < length or pronoun:
        return None
    own = amount.used > 1 or not amount.unit  # not where the unit was said before
    said = as_said(words[i : i + amount.used]) if own else ""
    return _of(UNIT_KIND[amount.unit], q=Quantity(amount.value, amount.unit, "by", said)), amount.used


def _pronoun(word: str, earlier: tuple[str, ...], found: Sequence[Chunk]) -> Made:
    """What was named last, a number of a waypoint, or "near it" before anything is named."""
    if ordinal := ORDINAL.fullmatch(word):
        return _of("Qth", q=Quantity(float(ordinal[1]))), 1
    if not found:
        return None
    if earlier:
        placed = found[-1].kind in PLACING or found[-1].text.endswith(" of")
        return (_of("OBJ", names=earlier), 1) if placed and word in PRONOUNS else None
    return (_of("unknown"), 1) if word in ("it", "them") and found[-1].kind in BESIDE else None


def _known(word: str, kind: str, length: int) -> tuple[Chunk, int]:
    """A word or phrase by its class."""
    if not kind:
        joins, plain = word in ("and", "n", "or"), CONTRACTION.fullmatch(word)
        return _of("filler" if plain else "and" if joins else "unknown"), 1
    return _of({"plain": "filler", "join": "and"}.get(kind, kind)), length
