"""Why something is asked for: clauses such as "since the cup is full", which ask for nothing themselves."""

from __future__ import annotations

from dataclasses import dataclass

from ovita.instruct.frames import Clearance, Figure, Height, Pace
from ovita.instruct.numerals import amount_at
from ovita.sources.places import Text, phrase_at, way_words
from ovita.sources.wishes import TIES, bare, read_wish

GROUND, FINITE, MEANWHILE, BIDDING = map(way_words, ("ground", "finite", "meanwhile", "bidding"))
SPEAKER, TELLING, DEMANDS = map(way_words, ("speaker", "telling", "demand"))
REASON, WANTING, PERCEIVING, MODAL = map(way_words, ("reason", "wanting", "perceiving", "modal"))

ENDING = frozenset(", ; . : ! ? ( )".split())
"""Marks at which a clause ends."""

INTENT = frozenset(("want", "need", "to"))
"""Words of what the speaker is about to do."""

BIDDEN = TIES | {"do", "don't", "dont"}
"""Words with which a clause that only denies begins, which asks for something."""

LINKING = frozenset(("to", "be", "been"))
"""Words with which a way is told only where a place is named."""

PERSONS = frozenset("i we you they he she".split())
"""Subjects with which a ground may be said together."""

SUBJECT = 7
"""Words in front of the verb of a clause, at most."""


@dataclass(frozen=True)
class ReasonClause:
    """A clause that tells why.

    Args:
        pieces: Of the text.
        verb: The piece of its verb.
    """

    pieces: range
    verb: int


def clauses(text: Text) -> list[ReasonClause]:
    """The clauses that begin with "since", "as" and the like and hold a verb, which the words alone tell."""
    found: list[ReasonClause] = []
    for k in range(len(text)):
        told = found and k in found[-1].pieces
        clause = None if told else _clause(text, k)
        found += [] if clause is None else [clause]
    return found


def _clause(text: Text, k: int) -> ReasonClause | None:
    """The clause that begins at piece k, or None."""
    said, used = phrase_at(text.words, k, GROUND)
    end = next((n for n in range(k, len(text)) if text.words[n] in ENDING), len(text))
    if text.words[k] in REASON and k + 1 < end:
        return ReasonClause(range(k, end), k)
    if text.words[k] == "like" and k > 0 and text.words[k - 1] in ENDING and not _asks_like(text, k, end):
        return ReasonClause(range(k, end), k)
    if (purpose := _purpose(text, range(k, end), used if said in ("so", "so that") else 0)) is not None:
        return purpose
    if not used or said in ("so", "so that"):
        return _statement(text, k, k + used, end)
    if said == "as" and _compares(text, k, end):
        return None
    begin = k + used
    if said.split()[-1] in PERSONS:  # "while I read it"
        return ReasonClause(range(k, end), begin) if begin < end and TELLING.isdisjoint(text.words[begin:end]) else None
    verb = _verb(text, begin, end)
    if verb is None or (verb == begin and "'" not in text.words[verb]):
        return None  # without a subject: "as is"
    meanwhile = text.words[verb + 1 : verb + 2] and text.words[verb + 1] in MEANWHILE
    return None if said == "as" and meanwhile else ReasonClause(range(k, end), verb)


def _purpose(text: Text, pieces: range, so: int) -> ReasonClause | None:
    """A clause that tells what for: "I want to see if it leaks", or what somebody can do then: "so Kevin can count".

    Args:
        text: The sentence.
        pieces: From where the clause would begin to where it ends.
        so: How many pieces its "so" or "so that" is; 0 where it begins otherwise.
    """
    if not LEADING.isdisjoint(text.words[n] for n in pieces):
        return None
    begin = pieces.start + so
    who = next((n for n in range(begin + 1, min(pieces.stop, begin + SUBJECT)) if text.words[n] in MODAL), None)
    if so and who is not None:
        return ReasonClause(pieces, who)
    asking = begin < pieces.stop and text.words[begin] in ("i", "we")
    wanting = phrase_at(text.words, begin + 1, WANTING)[1] if asking else 0
    doing = begin + 1 + wanting
    perceives = wanting > 0 and not PERCEIVING.isdisjoint(text.words[doing : doing + 1])
    return ReasonClause(pieces, doing) if perceives else None


LEADING = frozenset(("from", "via", "over", "past", "through", "between", "around", "round"))
"""Words with which a clause tells a way after all."""


def _statement(text: Text, k: int, begin: int, end: int) -> ReasonClause | None:
    """A clause of its own, or behind "so", that states something and asks for nothing: "..., it tips over easily".

    One that holds an amount, or a word with which a way is told, may ask for something; in front of a colon, it may say
    what the speaker wants: "I want to check the tank: start at the gate".
    """
    if _is_a_wish(text, k, end):
        return None
    closed = text.words[end] if end < len(text) else ""
    own = closed in (":", ".", "!") if k == 0 else text.words[k - 1] in ENDING
    told = text.words[begin:end]
    telling = TELLING - INTENT if k == 0 and closed == ":" and told[:1] in (["i"], ["we"]) else TELLING
    if all(text.place_at(n) is None for n in range(k, end)):
        telling = telling - LINKING  # "it is full to the brim"
    if (begin == k and not own) or not told or not telling.isdisjoint(told) or not DEMANDS.isdisjoint(told):
        return None
    if any(amount_at(text.words, n) is not None for n in range(begin, end)):
        return None
    first = begin + (told[0] == "that")
    cut = REASON | {"-"}
    grounds = (n for n in range(first, end) if text.words[n] in cut or phrase_at(text.words, n, GROUND)[1])
    end = next(grounds, end)
    verb = _verb(text, first, end)
    if text.words[first] in SPEAKER and first + 1 < end and verb is None:
        verb = first + 1  # "it tips over easily"
    named = verb is not None and verb + 1 < end and text.words[verb] in FINITE
    place = text.place_at(verb + 1) if verb is not None and named else None
    if place is not None and place[1] >= end:
        return None  # "the arrival is the oven"
    stated = verb is not None and (verb > first or text.words[verb].partition("'")[0] in SPEAKER)
    stated = stated and not (verb is not None and BIDDEN.issuperset(text.words[first : verb + 1]))  # "and don't dawdle"
    return ReasonClause(range(k, end), verb) if stated and verb is not None else None


def _verb(text: Text, begin: int, end: int) -> int | None:
    """The verb of a clause, which no word of a name is, as in "watering can", nor the "its" of "on its left"."""
    told = range(begin, min(end, begin + SUBJECT))
    names = ((k, text.object_at(k)) for k in told)
    inside = {n for k, named in names if named is not None for n in range(k, named[1])}
    inside |= {n for n in told if text.words[n] == "its" and text.words[n - 1] in OWNING}
    return next((n for n in told if text.words[n] in FINITE and n not in inside), None)


OWNING = frozenset("at on by to of from in past with".split())
"""Words behind which "its" is no verb."""


def _asks_like(text: Text, k: int, end: int) -> bool:
    """Whether a comparison asks for a figure or a pace after all: "like a zigzag", "like, slowly"."""
    said = text.text[text.pieces[k].span[0] : text.pieces[end - 1].span[1]]
    return any(isinstance(frame, Figure | Pace | Height | Clearance) for frame in read_wish(said, text.scene).frames)


def _is_a_wish(text: Text, k: int, end: int) -> bool:
    """Whether a clause of its own asks for something after all: "there is no rush"."""
    if text.words[k] not in ("there", "there's", "theres") or (k > 0 and text.words[k - 1] not in ENDING):
        return False
    said = text.text[text.pieces[k].span[0] : text.pieces[end - 1].span[1]]
    return end > k + 1 and read_wish(bare(said), text.scene).outcome == "do"


def _compares(text: Text, k: int, end: int) -> bool:
    """Whether an "as" compares or tells how: "as fast as you can", "the same as", "drive as you would a car"."""
    twice = "as" in text.words[max(k - 4, 0) : k] or "as" in text.words[k + 1 : min(k + 4, end)]
    return twice or text.words[k - 1 : k] in (["same"], ["such"]) or text.words[k + 1 : k + 2] in (["you"], ["if"])
