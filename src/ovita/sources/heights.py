"""Heights over the ground that a phrase of a way tells: "about two metres up", "climb to 1.2 m", "cruise at 2 m"."""

from __future__ import annotations

from collections.abc import Container, Sequence

from ovita.instruct.lexicon import term_at
from ovita.instruct.numbers import amount_at
from ovita.instruct.objects import WORD
from ovita.sources.places import phrase_at, way_words

LEVEL, CLIMB, CRUISE, RAISED, HEDGE, BOUND, THROUGHOUT = map(
    way_words, ("level", "climb", "cruise", "raised", "hedge", "bound", "throughout")
)
AT = frozenset(("at", "to", "in"))
CLOSED = frozenset(", ; . : ! ? ( ) and then but with while".split())
"""What may follow a height that is that of the whole way."""


def height_in(said: str) -> tuple[str, str, float] | None:
    """A phrase without the height that it tells, that height in its words, and in metres; None if it tells none.

    A bound, a height over a thing and the height of a part of the way are none of these.
    """
    found = list(WORD.finditer(said.lower()))
    words = [piece[0] for piece in found]
    if any(term_at(words, k)[0] == "never" for k in range(len(words))):
        return None
    for k in range(len(words)):
        amount = amount_at(words, k)
        if amount is None or amount.unit != "m" or (k > 0 and amount_at(words, k - 1) is not None):
            continue
        first = _without(words, k, HEDGE)
        raised = phrase_at(words, k + amount.used, RAISED)[1]
        end = k + amount.used + raised
        end += phrase_at(words, end, THROUGHOUT)[1]
        leading = {name: _before(words, first, phrases) for name, phrases in LEADS.items()}
        closed = end == len(words) or words[end] in CLOSED
        told = raised or leading["level"] or leading["climb"] or leading["cruise"]
        begin = _without(words, first - max(leading.values()), HEDGE | AT)
        if told and closed and not (begin > 0 and words[begin - 1] in BOUND):
            cut = found[begin].start(), found[end - 1].end()
            return f"{said[: cut[0]]} {said[cut[1] :]}".strip(" ,;"), said[cut[0] : cut[1]], amount.value
    return None


def _without(words: Sequence[str], end: int, skipped: Container[str]) -> int:
    """Where some words end without those at their end that are skipped."""
    while end > 0 and words[end - 1] in skipped:
        end -= 1
    return end


LEADS = {"level": LEVEL, "climb": CLIMB, "cruise": CRUISE}


def _before(words: Sequence[str], end: int, phrases: Container[str]) -> int:
    """How many words before a word the longest of some phrases takes that ends there."""
    tried = (count for count in range(min(6, end), 0, -1) if " ".join(words[end - count : end]) in phrases)
    return next(tried, 0)
