# ruff: noqa: E501
"""From an utterance to chunks: objects of the scene, numbers with units, words by class, and words that nobody knows.

A chunk's class is what the constituents, the table of frames and the referee look at; `span` says where it stands.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import pairwise
from typing import Any, TypeAlias, cast

from ovita.instruct.frames import Quantity, Role, Span
from ovita.instruct.lexicon import DETERMINERS, term_at
from ovita.instruct.numerals import ORDINAL_WORDS, amount_at, is_digits, more_first, unit_apart
from ovita.instruct.objects import WORD, Catalog
from ovita.instruct.spelling import respelt
from ovita.paths.scene import POINT, Scene
from ovita.paths.trajectory import Array

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
    if (word == "-" and number) or (word == "/" and before.lower() in ("m", "cm", "mm", "km")):
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

BARE = {
    **dict.fromkeys(("first", "initial", "opening", "1st"), "1st"),
    **dict.fromkeys(("last", "final", "closing", "final stretch"), "nth"),
}
"""Words that name a part of the path only with what follows: "the last 10 cm", but "last, go up"."""

PRONOUNS = frozenset("it him her them that this he she they one theirs".split())
PLACING = frozenset("at by on to from of near around after before over under thru touch toward within for pass".split())
BESIDE = frozenset("near around over under toward past".split())
COMPARED = frozenset("closer near farther faster slower up down raise lower".split())

DOING = frozenset(
    "plain farther closer faster slower raise lower drop up down left right touch wait stop keep avoid".split()
)
"""Classes of words that may begin what is to be done."""

SIDEWAYS = frozenset("left right front back".split())

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
        value: What else a constituent knows.
        apart: Whether a pause stands before it.
    """

    kind: str
    text: str
    span: Span
    names: tuple[str, ...] = ()
    q: Quantity | None = None
    value: Any = field(default=None)
    apart: bool = False

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


def in_role(role: str, found: Sequence[Chunk]) -> Chunk:
    """Chunks about one quantity as that quantity, in a role."""
    chunk = next(c for c in found if c.q is not None)
    return merged(found, chunk.kind, q=replace(chunk.number, role=cast(Role, role)), value=role)


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


@dataclass(frozen=True)
class _Place:
    """A word of an utterance with what stands beside it, which settles which of its senses it has."""

    words: Sequence[str]
    i: int
    kind: str
    length: int

    @property
    def word(self) -> str:
        return self.words[self.i]

    @property
    def before(self) -> str:
        return self.words[self.i - 1] if self.i else ""

    @property
    def behind(self) -> str:
        """The word behind the phrase."""
        return "".join(self.words[self.i + self.length : self.i + self.length + 1])

    @property
    def last(self) -> str:
        """The last word of a phrase of several."""
        return self.words[self.i + self.length - 1] if self.length > 1 else ""

    @property
    def counted(self) -> bool:
        """Whether an amount stands behind the phrase."""
        return bool(self.behind) and amount_at(self.words, self.i + self.length) is not None

    def classes(self, low: int, high: int) -> list[str]:
        """The classes of the words from so many behind this one."""
        return [term_at(self.words, j)[0] for j in range(max(self.i + low, 0), min(self.i + high, len(self.words)))]

    def is_word(self, *words: str) -> bool:
        """Whether it is one of these words, and of one word."""
        return self.length == 1 and self.word in words

    def bare(self, *words: str) -> bool:
        """Whether it is one of these words, and begins no phrase."""
        return self.length <= 1 and self.word in words


def _measured_half(at: _Place) -> bool:
    return at.last == "half" and amount_at(at.words, at.i + at.length - 1) is not None


def _goes_on(at: _Place) -> bool:
    """Whether the participle behind says more than that something moves: "slowing down", "getting so close"."""
    first, *more = at.classes(1, 5)
    return bool(first) if first != "plain" else not COMPARED.union(("left", "right")).isdisjoint(more)


def _law(at: _Place) -> bool:
    """Whether it is one of two comparatives that go together."""
    pairs = pairwise(at.words)
    compares = [j for j, (the, word) in enumerate(pairs) if the == "the" and word.endswith(("er", "more", "less"))]
    return at.before == "the" and sum(term_at(at.words, j + 1)[0] in COMPARED for j in compares) > 1


SHORTER = ("", -1)
"""Stands for the class of the phrase without its last word."""

_MOVING = ("plain", "path", "speed", "keep", "faster", "slower")
_NO_NUMBER = frozenset({*DETERMINERS, "last", "final", "first", "middle"})


def _is_short_by(at: _Place) -> bool:
    """Whether the amount takes the "by": "up by" 10 cm."""
    return at.last == "by" and at.counted and at.kind not in ("by", "at_least", "at_most")


def _is_right_there(at: _Place) -> bool:
    """Whether "right" is no direction: stop "right" at the cup; "right" after the cup, go up."""
    begins = at.classes(-1, 0) in ([], ["comma"], ["dot"], ["and"]) and at.classes(1, 2)[:1] in _WHERE_RIGHT
    return at.word == "right" and (begins or not {"stop", "wait"}.isdisjoint(at.classes(-1, 0)))


_WHERE_RIGHT = (["after"], ["before"], ["between"], ["near"], ["by"])


def _is_forbidding(at: _Place) -> bool:
    """Whether a "stop" forbids: "stop" going so close."""
    return at.is_word("stop", "quit") and at.behind.endswith("ing") and _goes_on(at)


def _is_where_it_goes(at: _Place) -> bool:
    """Whether a "when" is where the path heads: "when" moving left, without how far."""
    if not at.is_word("while", "whilst", "when") or at.behind not in ("going", "moving", "heading"):
        return False
    far = at.i + 3 < len(at.words) and amount_at(at.words, at.i + 3) is not None
    return not far and not SIDEWAYS.isdisjoint(at.classes(2, 3))


def _is_joining(at: _Place) -> bool:
    """Whether a "while" joins: "while" going faster."""
    gerund = at.is_word("after", "before", "while", "whilst") and at.behind.endswith("ing")
    return gerund and at.classes(1, 2)[0] in _MOVING


def _is_one_more(at: _Place) -> bool:
    """Whether it asks for so much more: "another" 5 cm of room."""
    return at.word == "another" and at.counted and "of" in at.words[at.i + 2 : at.i + 4]


def _is_that_much(at: _Place) -> bool:
    """Whether a "that" grades: not "that" close."""
    return at.word == "that" and at.before in ("not", "quite", "be") and not COMPARED.isdisjoint(at.classes(1, 2))


def _is_bent_aside(at: _Place) -> bool:
    """Whether to bend is to shift: "bend" the second half to the right."""
    bends = at.is_word("bend", "curve") and at.behind in ("the", "it")
    return bends and not SIDEWAYS.isdisjoint(at.classes(1, len(at.words)))


def _is_in_order(at: _Place) -> bool:
    """Whether an ordinal is of the order of steps: "first" go up."""
    ordinal = at.bare("first", "second", "third") and at.before not in _NO_NUMBER
    return ordinal and not DOING.isdisjoint(at.classes(1, 2))


def _is_resting(at: _Place) -> bool:
    """Whether to rest is to wait: "rest" at the cup, but the "rest" of the path."""
    rests = at.kind == "rest" and at.bare("rest") and at.before not in (*DETERMINERS, "to")
    return rests and at.behind in ("at", "on", "by", "above", "near", "for")


LASTING = frozenset("take takes taking lasting lasts duration".split())
ENDING = frozenset(
    """finish finished finishes done complete completed there arrive arrived over it thing all path trajectory run way trip
    motion route half third part leg stretch""".split()
)
ABOUT = frozenset(
    "at most least no not more longer less than under about exactly only just up to a total of max".split()
)


def _is_careful_there(at: _Place) -> bool:
    """Whether care is slow: "be careful" at the cup, but "be careful" alone is an aside."""
    return at.word == "be" and at.last == "careful" and at.behind in ("at", "near", "around", "by", "beside", "with")


def _is_lasting(at: _Place) -> bool:
    """Whether it says how long the way takes: "take" 20 s, finish "in" 10 s, it should "last" half a minute."""
    within = at.bare("in", "within") and at.before in ENDING
    lasts = at.word == "last" and at.before in ("should", "must", "to", "it", "will", "shall")
    return _in_seconds(at.words, at.i + 1) if at.bare(*LASTING) or within or lasts else False


def _ends_in(at: _Place) -> bool:
    """The same of two words: "finish in" 10 s."""
    ends = at.word in ENDING and at.last in ("in", "within")
    return ends and _in_seconds(at.words, at.i + at.length)


def _in_seconds(words: Sequence[str], begin: int) -> bool:
    """Whether the amount that follows, or follows words such as "at most", is a time."""
    amount = next((j for j in range(begin, min(begin + 5, len(words))) if words[j] not in ABOUT), 0)
    found = [q for j in (amount, amount - 1) if amount and (q := amount_at(words, j))]
    return bool(found) and found[0].unit == "s"


_SENSES: tuple[tuple[Callable[[_Place], bool], tuple[str, int]], ...] = (
    (_is_lasting, ("lasting", 1)),
    (_ends_in, ("lasting", 0)),
    (_is_careful_there, SHORTER),
    (_measured_half, SHORTER),  # "right" half a metre, "first" half-dozen
    (_is_short_by, SHORTER),
    (_is_right_there, ("plain", 1)),
    (_is_forbidding, ("never", 1)),
    (_is_where_it_goes, ("where", 1)),
    (_is_joining, ("join", 1)),
    (lambda at: at.kind == "level" and at.counted, SHORTER),  # "at a height of" 50 cm
    (_is_one_more, ("inc", 1)),
    (_is_that_much, ("so", 1)),
    (_is_bent_aside, ("plain", 1)),
    (lambda at: at.word == "then" and at.counted, ("than", 1)),
    (lambda at: at.kind in COMPARED and _law(at), ("law", 0)),  # "the closer ..., the slower"
    (_is_in_order, ("plain", 1)),
    (
        lambda at: at.word == "both" and "and" in at.words[at.i + 2 : at.i + 8],
        ("plain", 1),
    ),  # "both" the cup and the box
    (_is_resting, ("wait", 1)),
)
"""When a word or phrase has another sense than by itself, and which class, of how many words (0 for all of it)."""


def _term(words: Sequence[str], i: int) -> tuple[str, int]:
    """The class of the words at i, where what stands beside them settles which of their senses it is."""
    at = _Place(words, i, *term_at(words, i))
    found = next((sense for fits, sense in _SENSES if fits(at)), (at.kind, at.length))
    if found == SHORTER:
        return term_at(words[: i + at.length - 1], i)
    return found[0], found[1] or at.length


def spoken(text: str) -> list[tuple[str, Span]]:
    """The words and marks of an utterance in small letters, each with where it stands."""
    return [(word.text.lower(), word.span) for word in _pieces(text)]


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


def _least(at: _Place, found: Sequence[Chunk]) -> tuple[str, int]:
    """The class of a phrase, where "a good 20 cm" and "0.2 m and up" are a least, "good" and "and up" are not."""
    if at.kind != "min" or at.word not in ("good", "and"):
        return at.kind, at.length
    if at.word == "good":
        return ("min", at.length) if at.counted else ("plain", 1)
    after = bool(found) and found[-1].q is not None
    goes_on = not after or at.counted or at.behind in ("by", "to", "a", "slightly", "then")
    return ("", 0) if goes_on else ("min", at.length)


def _chunk(
    words: Sequence[_Word], lowered: list[str], i: int, catalog: Catalog, found: Sequence[Chunk], apart: int | None
) -> tuple[Chunk, int]:
    """The chunk that begins at a word, and how many words it takes; `apart` is where a unit is told by itself."""
    word = lowered[i]
    kind, length = ("", 0) if _sign(word) else _least(_Place(lowered, i, *_term(lowered, i)), found)
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
    mixed = is_digits("".join(words[i + 1 : i + 2]))  # "2 1/2"
    said = "".join(words[i : i + amount.used]).replace("″", "in") if own and is_digits(words[i]) and not mixed else ""
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
    kind = BARE.get(word, kind) if length == 1 and kind not in ("plain", "join", "lasting") else kind
    return _of({"plain": "filler", "join": "and"}.get(kind, kind)), length
