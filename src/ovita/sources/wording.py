"""What is asked for besides the way in words that its readers know: "ceiling 1.8 m", "d(wall) >= 0.1", "a lap of it".

Each rule looks at one piece of a sentence and gives the words that are said instead of some pieces, by their numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ovita.instruct.lexicon import concept_at
from ovita.instruct.numbers import Amount, amount_at
from ovita.sources.markers import MOTION, STAYING, base
from ovita.sources.places import Text

Instead = dict[int, str]
Rule = Callable[[Text, int], Instead]

LOWER = frozenset("lower less smaller".split())
CIRCLES = {"laps": "circles", "orbits": "circles", "circles": "circles", "twice": "two circles"}
SPEAKERS = frozenset("you we i it he she they one".split())
LAPS = frozenset("once twice lap laps loop orbit orbits circuit tour turn revolution round 360 circle circles".split())
ABOUT = frozenset("around round about of".split())
SOFT = frozenset("gentle soft light lazy subtle mild".split())
FIGURES = frozenset("wave zigzag spiral circle eight".split())
DISTANCES, HEIGHTS = frozenset("d dist distance clearance".split()), frozenset("z height altitude".split())
SPEEDS = frozenset("v vel velocity speed vmax".split())


def reworded(text: Text, taken: Sequence[bool]) -> tuple[Instead, list[str]]:
    """What is said instead of pieces that the way did not take, and notes on units that were assumed."""
    found: Instead = {}
    notes: list[str] = []
    for k in range(len(text) - 1):
        if taken[k]:
            continue
        for rule in RULES:
            found |= rule(text, k)
        for rule in UNITS:
            given = rule(text, k)
            found |= given
            notes += [f"took {text.words[k + 1]} as {given[k + 1].split()[-1]}"] if given else []
    return found, notes


def amount_in(words: Sequence[str], first: int, last: int) -> tuple[int, Amount | None]:
    """The first amount with a unit between two pieces, and where it begins."""
    found = ((k, amount_at(words, k)) for k in range(first, last))
    return next(((k, amount) for k, amount in found if amount is not None and amount.unit), (first, None))


def _bare(words: Sequence[str], k: int) -> Amount | None:
    """The number at a piece, if it has no unit."""
    amount = amount_at(words, k)
    return amount if amount is not None and not amount.unit and amount.used == 1 else None


def _speed(text: Text, k: int) -> Instead:
    """V = 0.2."""
    words = text.words
    amount = _bare(words, k + 1) if words[k] in SPEEDS else None
    if amount is None:
        return {}
    most = words[k] == "vmax" or words[k - 1 : k] in (["max"], ["maximum"])
    return {k: "at most" if most else "at", k + 1: f"{amount.value:g} m/s"}


def _height(text: Text, k: int) -> Instead:
    """Z <= 0.5."""
    amount = _bare(text.words, k + 1) if text.words[k] in HEIGHTS else None
    return {} if amount is None else {k + 1: f"{amount.value:g} m"}


def _ceiling(text: Text, k: int) -> Instead:
    """Ceiling 1.8 m."""
    words = text.words
    behind = k + 1 + (words[k + 1] in ("of", ":"))
    amount = amount_at(words, behind) if words[k] == "ceiling" and behind < len(words) else None
    return _never_higher(range(k, behind)) if amount is not None and amount.unit == "m" else {}


def _lower(text: Text, k: int) -> Instead:
    """The height should be lower than 1.8 m."""
    words = text.words
    at, amount = amount_in(words, k, min(k + 7, len(words))) if words[k] in HEIGHTS else (k, None)
    if amount is None or amount.unit != "m" or not _bounds(words[k + 1 : at]):
        return {}
    return _never_higher(range(k - (words[k - 1 : k] == ["the"]), at))


def _bounds(words: Sequence[str]) -> bool:
    """Whether words end with those of an upper bound."""
    return words[-1:] in (["below"], ["under"]) or (words[-1:] == ["than"] and bool(LOWER & set(words[-2:])))


def _never_higher(pieces: range) -> Instead:
    return {k: "" for k in pieces} | {pieces[0]: "never higher than"}


def _distance(text: Text, k: int) -> Instead:
    """d(wall) >= 0.1 m."""
    words = text.words
    named = text.object_at(k + 2) if words[k] in DISTANCES and words[k + 1] == "(" and k + 2 < len(words) else None
    if named is None or words[named[1] : named[1] + 1] != [")"]:
        return {}
    return {k: "distance to", k + 1: "", named[1]: ""}


def _avoided(text: Text, k: int) -> Instead:
    """Avoid the wall at least 12 cm."""
    avoided = text.object_at(k + 1) if text.words[k] in ("avoid", "avoiding") else None
    if avoided is None or amount_in(text.words, avoided[1], min(avoided[1] + 4, len(text)))[1] is None:
        return {}
    return {k: "distance to"}


def _lap(text: Text, k: int) -> Instead:
    """A lap of the pond; a little tour around it."""
    words = text.words
    if words[k] not in LAPS or words[k + 1] not in ABOUT:
        return {}
    named = words[k + 2 : k + 3] == ["it"] or text.object_at(k + 2) is not None
    return {k: CIRCLES.get(words[k], "circle"), k + 1: "around"} if named else {}


def _once(text: Text, k: int) -> Instead:
    """Go round it one time."""
    return {k: "once", k + 1: ""} if text.words[k : k + 2] == ["one", "time"] else {}


def _small(text: Text, k: int) -> Instead:
    """A gentle wave."""
    return {k: "small"} if text.words[k] in SOFT and concept_at(text.words, k + 1)[0] in FIGURES else {}


def _speaker(text: Text, k: int) -> Instead:
    """For the last third you go more slowly; and one waits there."""
    words = text.words
    if words[k] not in SPEAKERS:
        return {}
    if words[k] == "one" and base(words[k + 1], STAYING):
        return {k: ""}
    plain = base(words[k + 1], STAYING | MOTION) and not concept_at(words, k + 1)[0]
    return {k: "", k + 1: ""} if plain and k and words[k - 1].isalpha() and words[k - 1] not in OPENING else {}


OPENING = frozenset("and then but while finally next afterwards after".split())
RULES: tuple[Rule, ...] = (_distance, _avoided, _lap, _once, _small, _speaker, _lower, _ceiling)
UNITS: tuple[Rule, ...] = (_speed, _height)
