# ruff: noqa: E501
"""Which of its senses a word has, by what stands beside it: "rest" at the cup, but the "rest" of the path."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from ovita.instruct.lexicon import DETERMINERS, term_at
from ovita.instruct.numerals import amount_at

COMPARED = frozenset("closer near farther faster slower up down raise lower".split())

DOING = frozenset(
    "plain farther closer faster slower raise lower drop up down left right touch wait stop keep avoid".split()
)
"""Classes of words that may begin what is to be done."""

BACKING = ("back up", "backing up", "back off", "back out", "reverse", "retreat", "retract", "back along")
"""How words begin that ask for the way back from where the robot is."""

SIDEWAYS = frozenset("left right front back".split())


@dataclass(frozen=True)
class InContext:
    """A word of an utterance with what stands beside it, which settles which of its senses it has."""

    words: Sequence[str]
    i: int
    kind: str
    length: int

    @property
    def word(self) -> str:
        """The first word of the phrase."""
        return self.words[self.i]

    @property
    def before(self) -> str:
        """The word before the phrase."""
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


def _measured_half(at: InContext) -> bool:
    return at.last == "half" and amount_at(at.words, at.i + at.length - 1) is not None


def _goes_on(at: InContext) -> bool:
    """Whether the participle behind says more than that something moves: "slowing down", "getting so close"."""
    first, *more = at.classes(1, 5)
    return bool(first) if first != "plain" else not COMPARED.union(("left", "right")).isdisjoint(more)


def _law(at: InContext) -> bool:
    """Whether it is one of two comparatives that go together."""
    pairs = pairwise(at.words)
    compares = [j for j, (the, word) in enumerate(pairs) if the == "the" and word.endswith(("er", "more", "less"))]
    return at.before == "the" and sum(term_at(at.words, j + 1)[0] in COMPARED for j in compares) > 1


SHORTER = ("", -1)
"""Stands for the class of the phrase without its last word."""

_MOVING = ("plain", "path", "speed", "keep", "faster", "slower")
_NO_NUMBER = frozenset({*DETERMINERS, "last", "final", "first", "middle"})


def _is_short_by(at: InContext) -> bool:
    """Whether the amount takes the "by": "up by" 10 cm."""
    return at.last == "by" and at.counted and at.kind not in ("by", "at_least", "at_most")


def _is_right_there(at: InContext) -> bool:
    """Whether "right" is no direction: stop "right" at the cup; "right" after the cup, go up."""
    begins = at.classes(-1, 0) in ([], ["comma"], ["dot"], ["and"]) and at.classes(1, 2)[:1] in _WHERE_RIGHT
    return at.word == "right" and (begins or not {"stop", "wait"}.isdisjoint(at.classes(-1, 0)))


_WHERE_RIGHT = (["after"], ["before"], ["between"], ["near"], ["by"])


def _is_forbidding(at: InContext) -> bool:
    """Whether a "stop" forbids: "stop" going so close."""
    return at.is_word("stop", "quit") and at.behind.endswith("ing") and _goes_on(at)


def _is_where_it_goes(at: InContext) -> bool:
    """Whether a "when" is where the path heads: "when" moving left, without how far."""
    if not at.is_word("while", "whilst", "when") or at.behind not in ("going", "moving", "heading"):
        return False
    far = at.i + 3 < len(at.words) and amount_at(at.words, at.i + 3) is not None
    return not far and not SIDEWAYS.isdisjoint(at.classes(2, 3))


def _is_joining(at: InContext) -> bool:
    """Whether a "while" joins: "while" going faster."""
    gerund = at.is_word("after", "before", "while", "whilst") and at.behind.endswith("ing")
    return gerund and at.classes(1, 2)[0] in _MOVING


def _is_one_more(at: InContext) -> bool:
    """Whether it asks for so much more: "another" 5 cm of room."""
    return at.word == "another" and at.counted and "of" in at.words[at.i + 2 : at.i + 4]


def _is_that_much(at: InContext) -> bool:
    """Whether a "that" grades: not "that" close."""
    return at.word == "that" and at.before in ("not", "quite", "be") and not COMPARED.isdisjoint(at.classes(1, 2))


def _is_bent_aside(at: InContext) -> bool:
    """Whether to bend is to shift: "bend" the second half to the right."""
    bends = at.is_word("bend", "curve") and at.behind in ("the", "it")
    return bends and not SIDEWAYS.isdisjoint(at.classes(1, len(at.words)))


def _is_pairing(at: InContext) -> bool:
    """Whether a "both" says no more than the "and" behind it: "both" the cup and the box."""
    return at.word == "both" and "and" in at.words[at.i + 2 : at.i + 8]


def _is_in_order(at: InContext) -> bool:
    """Whether an ordinal is of the order of steps: "first" go up."""
    ordinal = at.bare("first", "second", "third") and at.before not in _NO_NUMBER
    return ordinal and not DOING.isdisjoint(at.classes(1, 2))


def _is_resting(at: InContext) -> bool:
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


def _is_careful_there(at: InContext) -> bool:
    """Whether care is slow: "be careful" at the cup, but "be careful" alone is an aside."""
    return at.word == "be" and at.last == "careful" and at.behind in ("at", "near", "around", "by", "beside", "with")


def _is_lasting(at: InContext) -> bool:
    """Whether it says how long the way takes: "take" 20 s, finish "in" 10 s, it should "last" half a minute."""
    within = at.bare("in", "within") and at.before in ENDING
    lasts = at.word == "last" and at.before in ("should", "must", "to", "it", "will", "shall")
    return _in_seconds(at.words, at.i + 1) if at.bare(*LASTING) or within or lasts else False


def _ends_in(at: InContext) -> bool:
    """The same of two words: "finish in" 10 s."""
    ends = at.word in ENDING and at.last in ("in", "within")
    return ends and _in_seconds(at.words, at.i + at.length)


def _in_seconds(words: Sequence[str], begin: int) -> bool:
    """Whether the amount that follows, or follows words such as "at most", is a time."""
    amount = next((j for j in range(begin, min(begin + 5, len(words))) if words[j] not in ABOUT), 0)
    found = [q for j in (amount, amount - 1) if amount and (q := amount_at(words, j))]
    return bool(found) and found[0].unit == "s"


_SENSES: tuple[tuple[Callable[[InContext], bool], tuple[str, int]], ...] = (
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
    (_is_pairing, ("plain", 1)),
    (_is_resting, ("wait", 1)),
)
"""When a word or phrase has another sense than by itself, and which class, of how many words (0 for all of it)."""


def sense_at(words: Sequence[str], i: int) -> tuple[str, int]:
    """The class of the words at i, where what stands beside them settles which of their senses it is."""
    at = InContext(words, i, *term_at(words, i))
    found = next((sense for fits, sense in _SENSES if fits(at)), (at.kind, at.length))
    if found == SHORTER:
        return term_at(words[: i + at.length - 1], i)
    return found[0], found[1] or at.length
