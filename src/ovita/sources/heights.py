"""Heights over the ground that a phrase of a way tells: "about two metres up", "climb to 1.2 m", "cruise at 2 m"."""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass

from ovita.instruct.lexicon import term_at
from ovita.instruct.numerals import amount_at
from ovita.instruct.objects import WORD
from ovita.sources.places import phrase_at, way_words

LEVEL, CLIMB, CRUISE, SINK, FLOOR, LEAST = map(way_words, ("level", "climb", "cruise", "sink", "floor", "at least"))
RAISED, HEDGE, BOUND, THROUGHOUT, ARRIVED = map(way_words, ("raised", "hedge", "bound", "throughout", "arrived"))
HALFWAY = way_words("lap middle") - THROUGHOUT
AT = frozenset(("at", "to", "in", "a"))
CLOSED = frozenset(", ; . : ! ? ( ) and then but with".split())
"""What may follow a height that is that of the whole way."""


@dataclass(frozen=True)
class HeightTold:
    """A height over the ground in a phrase.

    Args:
        height: [m].
        least: Whether higher is as good.
        words: That tell it.
        rest: The phrase without them.
        ends: Whether it is that of the goal, by its own words.
        sinks: Whether the way comes down to it.
        halfway: Whether it is that of the middle of the way, and not of all of it.
    """

    height: float
    least: bool
    words: str
    rest: str
    ends: bool
    sinks: bool
    halfway: bool = False


def height_in(said: str, mentions: Callable[[str], bool]) -> HeightTold | None:
    """The height over the ground that a phrase tells, or None.

    A greatest height, a height over a thing and the height of a part of the way are none of these.

    Args:
        said: The phrase.
        mentions: Whether words mention a thing.
    """
    found = list(WORD.finditer(said.lower()))
    words = [piece[0] for piece in found]
    end = 0
    for k in range(len(words)):
        amount = amount_at(words, k) if k >= end else None
        end = k + amount.used if amount is not None else end
        if amount is None or amount.unit != "m":
            continue
        raised = phrase_at(words, end, RAISED)[1]
        halfway = phrase_at(words, end + raised, HALFWAY)[1]
        last, arrived = _closing(words, end + raised + halfway, mentions)
        first = _without(words, k, HEDGE)
        least = _before(words, first, FLOOR) or _before(words, first, LEAST)
        first = _without(words, first - least, HEDGE | AT) if least else first
        leads = [_before(words, first, phrases) for phrases in (LEVEL, CLIMB, CRUISE, SINK)]
        begin = _without(words, first - max(leads), HEDGE | AT)
        alone = begin == 0 and last == len(words) and words[:1] == ["at"]  # "at about one metre thirty"
        told = raised or any(leads) or alone or _before(words, first + least, FLOOR)
        bound = not least and begin > 0 and words[begin - 1] in BOUND
        denied = any(term_at(words, n)[0] == "never" for n in range(begin))
        if told and last and not (bound or denied):
            cut = found[begin].start(), found[last - 1].end()
            rest = f"{said[: cut[0]]} {said[cut[1] :]}".strip(" ,;")
            words_told = said[cut[0] : cut[1]]
            return HeightTold(amount.value, least > 0, words_told, rest, arrived, leads[3] > 0, halfway > 0)
    return None


def _closing(words: Sequence[str], end: int, mentions: Callable[[str], bool]) -> tuple[int, bool]:
    """Where what belongs to a height ends, or 0 where it is one of a part of the way; and whether it is at the goal."""
    arrived = phrase_at(words, end, ARRIVED)[1]
    end += arrived or phrase_at(words, end, THROUGHOUT)[1]
    if end < len(words) and words[end] in ("while", "until", "till"):
        stop = next((n for n in range(end, len(words)) if words[n] in CLOSED - {"with"}), len(words))
        return (0, False) if mentions(" ".join(words[end + 1 : stop])) else (stop, False)
    amount = amount_at(words, end + 1) if words[end : end + 1] == ["at"] and end + 1 < len(words) else None
    closed = end == len(words) or words[end] in CLOSED or amount is not None  # "at 2 m altitude | at 0.2 m/s"
    return (end, arrived > 0) if closed else (0, False)


def _without(words: Sequence[str], end: int, skipped: Container[str]) -> int:
    """Where some words end without those at their end that are skipped."""
    while end > 0 and words[end - 1] in skipped:
        end -= 1
    return end


def _before(words: Sequence[str], end: int, phrases: Container[str]) -> int:
    """How many words before a word the longest of some phrases takes that ends there."""
    tried = (count for count in range(min(6, end), 0, -1) if " ".join(words[end - count : end]) in phrases)
    return next(tried, 0)
