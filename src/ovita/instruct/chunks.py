# ruff: noqa: E501
"""From an utterance to chunks: objects of the scene, numbers with units, words by class, and words that nobody knows.

A chunk's class is what the constituents, the table of frames and the referee look at; `span` says where it stands.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

from ovita.instruct.frames import Quantity, Span
from ovita.instruct.lexicon import DETERMINERS, term_at, terms
from ovita.instruct.numbers import amount_at, is_digits, unit_at
from ovita.instruct.objects import Catalog
from ovita.instruct.spelling import respelt
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array

PIECE = re.compile(
    r"\d+[.,]\d+|\d+(?:st|nd|rd|th)\b|\d+|\.\d+(?=\D|$)|(?:k?m|cm|mm|ft|in|deg)/(?:s(?:ec)?(?:\^?2|²)?|h|min)\b|m/s(?:\^?2|²)"
    r"|[^\W\d_]+(?:['’][^\W\d_]+)*|>=|<=|=>|=<|\+=|-=|\+/?-|\.\.+|[%°≥≤<>=@&~±×+\-/_.,;:!?()–—→]"
)
CONTRACTION = re.compile(r"(?:i|you|he|she|it|we|they|there|what|who|that|here|how)'?(?:s|re|ve|ll|d|m)")
SYMBOLS = {
    ">=": "at least", "=>": "at least", "≥": "at least", ">": "at least", "<=": "at most", "=<": "at most",
    "≤": "at most", "<": "at most", "=": "to", "@": "at", "&": "and", "~": "about", "+=": "plus", "-=": "minus", "×": "x",
    "+-": "", "+/-": "", "±": "", "°": "degrees", "_": "", "→": "to", "(": ",", ")": ",", "–": ",", "—": ",", "-": "-",
}  # fmt: skip
BREAKS = frozenset(".,;:!?")
NUMERIC = tuple(".0123456789")


ORDINALS = {"2nd": "second", "3rd": "third", "4th": "fourth", "5th": "fifth", "1st": "first", "6th": "sixth",
            "7th": "seventh", "8th": "eighth", "10th": "tenth"}  # fmt: skip
ORDINAL = re.compile(r"(\d+)(?:st|nd|rd|th)")
ABBREVIATED = frozenset("approx appr ca max min no pls vs incl sec secs deg pos ref traj wp wpt cm mm".split())
"""Words that a full stop may shorten."""

COUNTED = {"second": 2, "other": 2, "third": 3, "fourth": 4, "quarter": 4, "fifth": 5, "sixth": 6, "seventh": 7,
           "eighth": 8, "tenth": 10}  # fmt: skip
"""Ordinals, as in "every third"."""

BARE = {
    "first": "1st",
    "initial": "1st",
    "last": "nth",
    "final": "nth",
    "opening": "1st",
    "closing": "nth",
    "1st": "1st",
    "final stretch": "nth",
}
"""Words that name a part of the path only with what follows: "the last 10 cm", but "last, go up"."""

PRONOUNS = frozenset("it him her them that this he she they one theirs".split())
PLACING = frozenset("at by on to from of near around after before over under thru touch toward within for".split())
BESIDE = frozenset("near around over under toward past".split())
COMPARED = frozenset("closer near farther faster slower up down raise lower".split())
NAMED = 3
"""Words of a name whose single words may stand for it; more words are a text."""

DOING = frozenset(
    "plain farther closer faster slower raise lower drop up down left right touch wait stop keep avoid".split()
)
"""Classes of words that may begin what is to be done."""

SIDEWAYS = frozenset("left right front back".split())

SHORT = {"pc": "%", "pct": "%", "L": "left", "R": "right", "dz": "z", "dx": "x", "dy": "y", "w": "with"}


@dataclass(frozen=True)
class Chunk:
    """A meaningful piece of an utterance.

    Args:
        kind: Its class: one of `terms/`, "OBJ", "CHOICE", "Q" and its unit, "comma", "dot", "and", "filler" or "unknown".
        text: As it was written.
        span: Where it stands.
        names: Objects that it means.
        q: The quantity that it is.
        value: What else a constituent knows.
    """

    kind: str
    text: str
    span: Span
    names: tuple[str, ...] = ()
    q: Quantity | None = None
    value: Any = field(default=None)

    @property
    def number(self) -> Quantity:
        """The quantity that it is; a bare zero if it is none."""
        return self.q or Quantity(0.0)


def merged(found: Sequence[Chunk], kind: str, **more: Any) -> Chunk:
    """One chunk of several."""
    text = " ".join(c.text for c in found)
    names = tuple(dict.fromkeys(name for c in found for name in c.names))
    q = next((c.q for c in reversed(found) if c.q is not None), None)
    made = Chunk(kind, text, (found[0].span[0], found[-1].span[1]), names, q)
    return replace(made, **more)


def kinds(found: Sequence[Chunk]) -> list[str]:
    """The classes of chunks."""
    return [c.kind for c in found]


def numbers(found: Sequence[Chunk]) -> list[Quantity]:
    """The quantities of chunks."""
    return [c.q for c in found if c.q is not None]


Build: TypeAlias = "Callable[[Sequence[Chunk]], Chunk | list[Chunk] | None]"
"""What becomes of chunks that a pattern matches; None leaves them as they are."""


@dataclass(frozen=True)
class _Word:
    text: str
    span: Span


UNIT_KIND = {"m": "Qm", "m/s": "Qv", "m/s2": "Qa", "s": "Qs", "deg": "Qdeg", "%": "Qpc", "x": "Qx", "step": "Qstep", "": "Qn",
             "Hz": "Qhz"}  # fmt: skip


def chunks(text: str, scene: Scene, positions: Array | None = None) -> tuple[tuple[Chunk, ...], tuple[str, ...]]:
    """Cut an utterance into chunks; also the spellings that were corrected, as notes."""
    words = _more_of_them(_pieces(text))
    catalog = Catalog(scene, positions)
    _nicknames(catalog)
    lowered, notes = respelt([w.text.lower() for w in words], catalog)
    found: list[Chunk] = []
    i = 0
    while i < len(words):
        chunk, used = _chunk(words, lowered, i, catalog, found)
        found.append(chunk)
        i += used
    return tuple(_forbidden(chunk, found[i + 1 :]) for i, chunk in enumerate(found)), tuple(notes)


def _more_of_them(words: list[_Word]) -> list[_Word]:
    """The words with "ten more centimetres" as "more ten centimetres"."""
    lowered = [w.text.lower() for w in words]
    for at, word in enumerate(lowered):
        before = next((i for i in range(max(at - 3, 0), at) if (a := amount_at(lowered, i)) and a.used == at - i), None)
        if word in MORE and before is not None and at + 1 < len(words) and unit_at(lowered, at + 1)[2]:
            order = [at, *range(before, at)]
            spans = [w.span for w in words[before : at + 1]]
            words[before : at + 1] = [_Word(words[i].text, span) for i, span in zip(order, spans, strict=True)]
    return words


MORE = frozenset("more extra additional further".split())

MANNERS = frozenset(
    "faster slower farther closer near toward left right front back up down raise lower over under thru".split()
)
"""Classes of words that say how something moves."""


def _forbidden(chunk: Chunk, behind: Sequence[Chunk]) -> Chunk:
    """A "do not move" that goes on with how: "do not move faster than" forbids that, and not every change."""
    if chunk.kind != "keep" or not chunk.text.lower().endswith((" move", " moving")) or not behind:
        return chunk
    away = behind[0].kind == "from" and behind[0].text.lower().startswith("away")
    to = 1 if behind[0].kind == "filler" and len(behind) > 1 else 0
    return replace(chunk, kind="never") if away or behind[to].kind in MANNERS else chunk


def _term(lowered: Sequence[str], i: int) -> tuple[str, int]:
    """The class of the words at i, where what stands beside them settles which of their senses it is."""
    kind, length = term_at(lowered, i)
    word, before, behind = (
        lowered[i],
        lowered[i - 1] if i else "",
        lowered[i + length] if i + length < len(lowered) else "",
    )
    counted = bool(behind) and amount_at(lowered, i + length) is not None
    if length > 1 and lowered[i + length - 1] == "half" and (half := amount_at(lowered, i + length - 1)) and half.unit:
        return term_at(lowered[: i + length - 1], i)  # "right" half a metre
    if length > 1 and counted and lowered[i + length - 1] == "by" and kind not in ("by", "at_least", "at_most"):
        return term_at(lowered[: i + length - 1], i)  # "up by" 10 cm
    if word == "right" and i and term_at(lowered, i - 1)[0] in ("stop", "wait"):
        return "plain", 1
    if word in ("stop", "quit") and behind.endswith("ing") and length == 1 and _goes_on(lowered, i + 1):
        return "never", 1  # "stop getting so close"
    if word in ("while", "whilst", "when") and behind in ("going", "moving", "heading") and length == 1:
        if term_at(lowered, i + 2)[0] in SIDEWAYS and (i + 3 >= len(lowered) or amount_at(lowered, i + 3) is None):
            return "where", 1  # "while going left"
    if word in ("after", "before", "while", "whilst") and behind.endswith("ing") and length == 1:
        if term_at(lowered, i + 1)[0] in ("plain", "path", "speed", "keep", "faster", "slower"):
            return "join", 1  # "while going faster"
    if (settled := _settled(lowered, i, kind, length, counted)) is not None:
        return settled
    if word == "then" and counted:
        return "than", 1
    if (
        kind in COMPARED
        and before == "the"
        and sum(term_at(lowered, j + 1)[0] in COMPARED for j in range(len(lowered) - 1) if _compares(lowered, j)) > 1
    ):
        return "law", length  # "the closer ..., the slower"
    if (
        word in ("first", "second", "third")
        and length <= 1
        and before not in DETERMINERS | {"last", "final", "first", "middle"}
        and term_at(lowered, i + 1)[0] in DOING
    ):
        return "plain", 1  # "first shift ..., then"
    if (
        kind == "rest"
        and word == "rest"
        and length == 1
        and before not in (*DETERMINERS, "to")
        and behind in ("at", "on", "by", "above", "near", "for")
    ):
        return "wait", 1
    return kind, length


def _settled(lowered: Sequence[str], i: int, kind: str, length: int, counted: bool) -> tuple[str, int] | None:
    """The class of words of which what stands behind them settles the sense, or None."""
    word, before, behind = lowered[i], lowered[i - 1] if i else "", lowered[i + 1 : i + 2]
    if kind == "level" and counted:
        return term_at(lowered[: i + length - 1], i)  # "at a height of" 50 cm
    if word == "another" and counted and "of" in lowered[i + 2 : i + 4]:
        return "inc", 1  # "another 5 cm of room"
    if word == "that" and before in ("not", "quite", "be") and behind and term_at(lowered, i + 1)[0] in COMPARED:
        return "so", 1  # "not quite that slow"
    if word in ("bend", "curve") and length == 1 and behind in (["the"], ["it"]):
        sideways = any(term_at(lowered, j)[0] in SIDEWAYS for j in range(i + 1, len(lowered)))
        return ("plain", 1) if sideways else None  # "bend the second half to the right"
    return None


def _goes_on(lowered: Sequence[str], i: int) -> bool:
    """Whether a participle at i says more than that something moves: "slowing down", "getting so close"."""
    if term_at(lowered, i)[0] != "plain":
        return bool(term_at(lowered, i)[0])
    return any(term_at(lowered, j)[0] in COMPARED | {"left", "right"} for j in range(i + 1, min(i + 4, len(lowered))))


def _compares(lowered: Sequence[str], j: int) -> bool:
    """Whether "the closer", "the more" begins at j."""
    return lowered[j] == "the" and lowered[j + 1].endswith(("er", "more", "less"))


def _nicknames(catalog: Catalog) -> None:
    """Names that leave out the last word: "the pine" for the pine board, where only one object has that word."""
    owners: dict[str, list[str]] = {}
    for item in catalog.scene:
        words = catalog.words[item.name]
        for word in words[:-1] if len(words) <= NAMED else ():
            owners.setdefault(word, []).append(item.name)
    for word, names in owners.items():
        plain = len(word) > 2 and word != "and" and (word,) not in terms()
        if len(names) == 1 and plain and (word,) not in catalog.names:
            catalog.names[(word,)] = catalog.scene[names[0]]


def spoken(text: str) -> list[tuple[str, Span]]:
    """The words and marks of an utterance in small letters, each with where it stands."""
    return [(word.text.lower(), word.span) for word in _pieces(text)]


def _pieces(text: str) -> list[_Word]:
    """The words and marks of a text, with signs, ranges and symbols as words."""
    found: list[_Word] = []
    matches = list(PIECE.finditer(text.replace("’", "'")))
    for i, match in enumerate(matches):
        before, behind = matches[i - 1] if i else None, matches[i + 1] if i + 1 < len(matches) else None
        word = match.group()
        if word in ("-", "+", "/", ".."):
            word = _mark(word, match, before, behind)
        word = ORDINALS.get(word, SHORT.get(word, word))
        if word == "." and behind is not None and before is not None and before.end() == match.start():
            if before.group().lower() in ABBREVIATED and not behind.group()[0].isupper():
                continue  # "approx. 5 cm"
        if (
            word in ("x", "X", "×")
            and behind is not None
            and behind.start() == match.end()
            and behind.group().startswith(NUMERIC)
        ):
            continue  # "x1.5" is 1.5 times
        found += [_Word(part, match.span()) for part in SYMBOLS.get(word, word).split()]
        if (
            before is not None
            and before.group() in ("x", "X", "×")
            and before.end() == match.start()
            and word.startswith(NUMERIC)
        ):
            found.append(_Word("x", match.span()))
    return found


def _mark(word: str, match: re.Match[str], before: re.Match[str] | None, behind: re.Match[str] | None) -> str:
    """What a sign or slash is: a sign, a range, "and", a pause, or nothing inside of a word."""
    glued = before is not None and before.end() == match.start()
    joined = behind is not None and behind.start() == match.end()
    number = behind is not None and behind.group().startswith(NUMERIC)
    counted = before is not None and (before.group()[-1].isdigit() or before.group() == "%")
    if word == "/":
        return "/" if counted or not (glued and joined) else "and"
    if word == ".." or (word == "-" and glued and counted and number):
        return "to"
    if word == "+":
        return "plus" if number else "and"
    if number and joined:
        return "minus"
    if joined and not glued and behind is not None and behind.group() in ("x", "y", "z"):
        return "minus"
    return "" if glued and joined else "to" if not number and glued else ","


def _least(lowered: Sequence[str], i: int, found: Sequence[Chunk], kind: str, length: int) -> tuple[str, int]:
    """The class of the words at i, where "a good 20 cm" and "0.2 m and up" are a least, "good" and "and up" are not."""
    if kind != "min" or lowered[i] not in ("good", "and"):
        return kind, length
    behind = lowered[i + length] if i + length < len(lowered) else ""
    counted = bool(behind) and amount_at(lowered, i + length) is not None
    if lowered[i] == "good":
        return (kind, length) if counted else ("plain", 1)
    after = bool(found) and found[-1].q is not None
    goes_on = not after or counted or behind in ("by", "to", "a", "slightly", "then")
    return ("", 0) if goes_on else (kind, length)


def _nowhere(word: str, earlier: tuple[str, ...], found: Sequence[Chunk]) -> bool:
    """Whether "near it" is said before anything is named."""
    return word in ("it", "them") and not earlier and bool(found) and found[-1].kind in BESIDE


def _chunk(
    words: Sequence[_Word], lowered: list[str], i: int, catalog: Catalog, found: Sequence[Chunk]
) -> tuple[Chunk, int]:
    def made(kind: str, used: int, **more: object) -> tuple[Chunk, int]:
        span = words[i].span[0], words[i + used - 1].span[1]
        return Chunk(kind, " ".join(w.text for w in words[i : i + used]), span, **more), used  # type: ignore[arg-type]

    word = lowered[i]
    if word in BREAKS:
        return made("dot" if word in ".;!?" else "comma", 1)
    if not word[0].isalnum() and word not in "+-=@%" and word[0] != ".":
        return made("filler", 1)
    earlier = next((c.names for c in reversed(found) if c.kind == "OBJ"), ())
    kind, length = _least(lowered, i, found, *_term(lowered, i))
    named = word[0].isalnum() and kind not in PLACING
    mention = catalog.mention_at(lowered, i, tuple(catalog.scene[n] for n in earlier)) if named else None
    if mention is not None and mention.used >= length and (not mention.unclear or not kind):
        names = tuple(item.name for item in mention.items)
        return made("CHOICE" if mention.unclear else "OBJ", mention.used, names=names)
    amount = amount_at(lowered, i)
    if (
        amount is not None
        and amount.used >= length
        and not (word == "one" and lowered[i - 1 : i] in (["the"], ["that"], ["current"], ["present"], ["old"]))
    ):
        said = "".join(lowered[i : i + amount.used])
        q = Quantity(amount.value, amount.unit, "by", said if is_digits(word) else "")
        return made(UNIT_KIND[amount.unit], amount.used, q=q)
    if (
        word in PRONOUNS
        and length <= 1
        and earlier
        and found
        and (found[-1].kind in PLACING or found[-1].text.endswith(" of"))
    ):
        return made("OBJ", 1, names=earlier)
    if ordinal := ORDINAL.fullmatch(word):
        return made("Qth", 1, q=Quantity(float(ordinal[1])))
    if length <= 1 and _nowhere(word, earlier, found):
        return made("unknown", 1)
    if kind == "plain":
        return made("filler", length)
    if kind == "join":
        return made("and", length)
    if kind:
        return made(BARE.get(word, kind) if length == 1 else kind, length)
    if CONTRACTION.fullmatch(word):
        return made("filler", 1)
    if word in ("and", "n", "or"):
        return made("and", 1)
    return made("unknown", 1)
