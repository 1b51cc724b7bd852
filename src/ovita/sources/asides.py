"""What is said beside the way and asks for nothing: what carries it, courtesies, reasons, remarks, needless bans."""

from __future__ import annotations

from collections.abc import Sequence

from ovita.instruct.lexicon import concept_at, is_filler
from ovita.instruct.numbers import amount_at
from ovita.instruct.rules import read
from ovita.sources.markers import GOAL_NOUNS, GOALS, MOTION, START_NOUNS, STARTS, TOURS, VIAS, base
from ovita.sources.places import Text

CARRIERS = frozenset(
    """take bring move go goes going run fly flying travel drive carry make draw plan generate create compute
    produce give show send lead guide route path trajectory traj way movement motion line course it that which this
    one let have want would like could can you i we please be is should must need to with on by at sort kind of
    swing climb climbing climbs head heading proceed continue along so okay ok well right basically obviously think
    thinking was were am maybe perhaps just now then and me us my your the a an new some there know lets let's see
    up over from start starting do does need needs um uh hey hi hello robot drone arm oh also first sweep swinging
    glide slide shift pass passes passing firstly secondly thirdly next here leg trip journey task job possible able
    wondering mind helpful great cool happy glad kindly try manage help if will ask asking asked about how what
    where get getting gets it's i'd i'll you'd don't mission flight drop pick use using via point end stop order
    reach reaching back home same n dear when scan second third return returning""".split()
) - {"don't"}
"""Words that carry a route and ask for nothing else."""

COURTESIES = frozenset(
    " ".join(phrase.split())
    for phrase in """would you be so kind as to, be so kind as to, would you be so good as to, be so good as to,
    would you mind, it would be great if, it would be good if, it would be nice if, it would be lovely if, it'd be
    great if, i was wondering if, i wonder if, i'd appreciate it if, we'd appreciate it if, i would appreciate it
    if, we would appreciate it if, i'd be grateful if, we'd be grateful if, i'd like you to, i would like you to,
    i'd like it to, i would like it to, i would have it, i want you to, i need you to, do me a favour and, do me a
    favor and, is it possible to, would it be possible to, as discussed, as agreed, as usual, as always, many thanks
    in advance, thanks in advance, thank you in advance, many thanks, best regards, kind regards, hi team, hi there,
    hello there, good morning, good evening, fyi, btw, for your information, if you don't mind, if that is ok, if
    that's ok, if you would, no pressure, en route, hihi, if you could, i beg you, pray, well then, for the record,
    this time""".split(",")
)
"""Phrases of politeness; what follows them is what is asked."""

LEADING = frozenset("through past via towards between while during before after as whether".split())
"""Words that tie a fragment to the phrase of the way behind it: "one lap between | leaving the pad"."""

DENIALS = frozenset("don't not never without avoid avoiding nor no".split())
TOUCHING = frozenset("hit hitting knock knocking touch touching bump bumping crash crashing collide colliding".split())
"""Words that ask not to touch something, which the limits see to."""

THROUGH = frozenset("through thru into".split())

STATES = frozenset("is are was were isn't aren't looks seems".split())
"""Verbs of a remark that tells how something is: "the ward is asleep"."""

TELLERS = frozenset(
    """the a an they he she we i there there's this that my our his her their these those everyone everybody someone
    somebody nobody people they're we're i'm he's she's i've we've it's that's""".split()
)
"""Words with which somebody tells something."""

WISHES = frozenset(
    """want wants need needs like should must shall ought prefer could can may might will let please make keep stay
    robot drone arm path it you gripper speed""".split()
)
"""Words of what may be a wish after all."""

REASONS = tuple(
    tuple(phrase.split())
    for phrase in """because, cause, 'cause, cos, coz, cuz, bc, since, so that, so she, so he, so they, so the, so
    we, so i, so it, so you, so nobody, so no one, so my, so our, so her, so his, in case, as if, as though, as
    seen, as we, as they, as he, as she, as there, as it's, until she, until he, until they, until we, until
    someone, until i, till she, till he, till they, till we, till i, for fear, due to, owing to, given that, while
    she, while he, while they, while i, in order to, although, though""".split(",")
)
"""How a reason begins, which is not something to do."""


def reason_at(text: Text, i: int, end: int) -> bool:
    """Whether a reason, and no more, is given from piece i on, up to an end."""
    words = text.words
    long = next((len(p) for p in REASONS if tuple(words[i : i + len(p)]) == p), 0)
    if words[i] == "for" and words[i + 1 : i + 2] and words[i + 1] in TELLERS:  # "for the photo"
        known = any(concept_at(words, k)[0] or text.object_at(k) or amount_at(words, k) for k in range(i + 2, end))
        return 0 < end - i - 2 <= 3 and not known
    if not long or i + long >= end or _measured(text, i, end):
        return False
    told = read(_said(text, i + 1, end), text.scene)
    return not told.frames or words[i] in ("because", "cos", "since")


def needless(text: Text, first: int, last: int, behind: bool = False) -> str | None:
    """Why a fragment from a piece to another asks for nothing, "" where that needs no note; None where it may ask.

    Args:
        text: The sentence.
        first: Where the fragment begins.
        last: Where it ends.
        behind: Whether it stands right behind a phrase of the way.
    """
    words = text.words[first:last]
    if _carries(words):
        return "" if not _measured(text, first, last) else None
    if _measured(text, first, last):
        return None
    if behind and words[0] in STATES:  # "between the posts | is the way I would go"
        return REMARK
    found = (why(text, first, last) for why in (_prevented, _remarked, _empty))
    return next((why for why in found if why is not None), None)


def _carries(words: Sequence[str]) -> bool:
    """Whether words only carry the way, or tie something to it."""
    verbs = MOTION | STARTS | GOALS | VIAS | TOURS
    idle = CARRIERS | LEADING | START_NOUNS | GOAL_NOUNS
    return all(word in idle or is_filler(word) or base(word, verbs) for word in words)


def _measured(text: Text, first: int, last: int) -> bool:
    """Whether an amount with a unit is said."""
    found = (amount_at(text.words, k) for k in range(first, last))
    return any(amount is not None and amount.unit for amount in found)


def _prevented(text: Text, first: int, last: int) -> str | None:
    """Why words that forbid what is never done need not be followed."""
    words = text.words[first:last]
    denied = next((k for k, word in enumerate(words) if word in DENIALS), len(words))
    touch = next((k for k, word in enumerate(words) if word in TOUCHING), -1)
    crossed = next((k for k, word in enumerate(words) if word in THROUGH and words[k + 1 : k + 2] == ["it"]), -1)
    return "what the limits see to" if max(touch, crossed) > denied else None


def _remarked(text: Text, first: int, last: int) -> str | None:
    """What a fragment is that only tells how things are."""
    words = text.words[first:last]
    if _shows(text, first, last):
        return ""
    return REMARK if words[:2] == ["never", "mind"] or _tells(text, first, last) else None


def _shows(text: Text, first: int, last: int) -> bool:
    """Whether a fragment only points to one object: "you know the box?"."""
    at = next((k for k in range(first, last) if text.words[k] not in SHOWING), last)
    found = text.object_at(at) if first < at < last else None
    return found is not None and found[1] == last and not found[0].unclear


def _tells(text: Text, first: int, last: int) -> bool:
    """Whether a fragment tells how something is that the way has nothing to do with: "the edges are soft"."""
    words = text.words[first:last]
    if words[0] not in TELLERS | {"it", "you"} or any(text.object_at(k) is not None for k in range(first, last)):
        return False
    if not (STATES & set(words[1:4]) or words[0] in CONTRACTED):
        return False
    about = words[0] in TELLERS and len(words) > 2 and words[1] not in STATES and not is_filler(words[1])
    return about or not any(concept_at(text.words, k)[0] for k in range(first, last) if text.words[k] not in STATES)


CONTRACTED = frozenset("it's that's there's they're we're i'm".split())
SHOWING = frozenset("you know ya see remember there is this that here there's here's that's the a an".split())
"""Words that only point to a thing."""

REMARK = "a remark, not as something to do"


def _empty(text: Text, first: int, last: int) -> str | None:
    """What the rules find nothing to do in: a courtesy, or what somebody tells."""
    words = text.words[first:last]
    told = read(_said(text, first, last), text.scene)
    if told.frames or told.unread or told.question or told.improper:
        return None
    if not told.aside:
        return ""
    return REMARK if words[0] in TELLERS and not WISHES & set(words[1:]) else None


def _said(text: Text, first: int, last: int) -> str:
    return text.text[text.pieces[first].span[0] : text.pieces[last - 1].span[1]]
