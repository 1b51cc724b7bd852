"""What asks for nothing beside a way: reasons, remarks, and what is done anyway; and what nothing is done about."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from ovita.instruct.frames import Clearance, Figure, Height, Pace, StopAt
from ovita.instruct.lexicon import PLAIN, concept_at, is_filler, is_known
from ovita.paths.part import WHOLE
from ovita.sources.mentions import WayTold, barred_by
from ovita.sources.phrases import CARRIERS, FIGURES, NOTHING, TOUCHING, WayPhrase
from ovita.sources.places import way_words
from ovita.sources.reasons import BIDDING, ENDING, FINITE
from ovita.sources.stops import TURNING, carries
from ovita.sources.wishes import TIES, bare, wishes_of
from ovita.text import listed, the

(DEMANDS,) = map(way_words, ("demand",))

IDLE = "asking for nothing"
ANYWAY = "what is done anyway"


@dataclass(frozen=True)
class Aside:
    """What is done about words that tell no place: nothing, and if that is as meant, why.

    Args:
        why: As what they are passed over; "" where nothing is done about what they may ask for.
        barred: Names of the objects that they say not to lead over.
        silent: Whether that need not be told.
    """

    why: str = ""
    barred: tuple[str, ...] = ()
    silent: bool = False


UNDONE = Aside()
"""Nothing is done about it."""


def excuse(way: WayTold, phrase: WayPhrase, *, denied: bool) -> Aside | None:
    """Why a phrase is passed over that tells why, what for, or what to leave out; None where it is none of these.

    Args:
        way: That the sentence tells.
        phrase: Of the sentence.
        denied: Whether its place is said to be none of the way.
    """
    if phrase.reasons:
        return UNDONE if _asks_behind_verb(way, phrase) else Aside("a reason")
    besides = phrase.role in (None, "wish", "wait")
    barred = barred_by(way.text, phrase) if denied or besides else []
    if barred:
        return Aside(f"not to lead over {listed(map(the, barred))}", tuple(barred))
    if _denies_another_way(way, phrase):
        return Aside(ANYWAY)
    if phrase.dismisses and not way.is_place(phrase):
        return Aside("what is to be left out")
    if besides and phrase.careful and not denied:
        return Aside("what the limits see to" if TOUCHING & {*phrase.words} else ANYWAY)
    return Aside(IDLE) if _looks(way, phrase) else None


def aside(way: WayTold, phrase: WayPhrase) -> Aside | None:
    """What is done about words without a role; None where they ask for something after all."""
    words = phrase.words
    told = [k for k, w in enumerate(words) if w.isalpha() and w not in TIES and not carries(words, k)]
    turned = phrase.classes & {"never", "correct"} and phrase.classes & {"over", "under", "front", "back", *TURNING}
    if (told or (len(words) > 2 and phrase.nothing <= NOTHING)) and asks_surely(way, phrase):
        return None
    idle = Aside(IDLE, silent=len(words) < 3 or not told)
    if bears(way, phrase) or (phrase.nothing > NOTHING and not phrase.classes & {*FIGURES, "correct"}):
        return idle
    if {"must", "not"} <= {*words} and {concept_at(words, k)[0] for k in range(len(words))} <= {"never", PLAIN, ""}:
        return Aside("a reason")  # "it must not splash"
    wanted = told and _wanted(way, phrase, strange=any(not is_known(words[k]) for k in told))
    return UNDONE if phrase.measured or turned or phrase.tells_a_side or wanted else idle


def _wanted(way: WayTold, phrase: WayPhrase, *, strange: bool) -> bool:
    """Whether words may ask for something that is not understood; `strange` is whether one is unknown."""
    asked = phrase.shares["wish"] + phrase.shares["wait"] > (ASKS_STRANGELY if strange else ASKS)
    said = way.text.words[max(phrase.pieces.start - BEFORE, 0) : phrase.pieces.stop]
    doing = any(one in DOING and other in ("a", "an", "the") for one, other in pairwise(said))
    return asked or bool(DEMANDS & {*phrase.words} or FIGURES & phrase.classes) or (strange and doing)


def asks_surely(way: WayTold, phrase: WayPhrase) -> bool:
    """Whether the reader of instructions is sure of what words that were taken for no wish ask for."""
    heard = wishes_of(bare(way.resolved(phrase)), way.text.scene)
    frames = [frame for wish in heard for frame in wish.frames]
    ending = (StopAt,) if phrase.role == "goal" else ()  # "stopping short of it by 20 cm"
    kinds = all(isinstance(frame, (Clearance, Figure, Height, Pace, *ending)) for frame in frames)
    return bool(frames) and kinds and all(w.outcome == "do" and not w.unused and not w.doubts for w in heard)


def leads(way: WayTold, phrase: WayPhrase) -> bool:
    """Whether a phrase only leads to the place that follows: "pick | it up at the box"."""
    words, lead = phrase.words, way.leads_to_a_place(phrase)
    return (lead and CARRIERS.issuperset(words)) or all(is_filler(word) or word in TIES for word in words)


def bears(way: WayTold, phrase: WayPhrase) -> bool:
    """Whether a phrase says what is carried from or to the place that follows: "take dirty sheets | from the door"."""
    return phrase.words[0] in CARRIERS and way.leads_to_a_place(phrase) and not phrase.amounts


def _looks(way: WayTold, phrase: WayPhrase) -> bool:
    """Whether a phrase tells what for, and no speed: "swing by the tower for a quick look"."""
    stays = phrase.role in ("wait", "wish") and phrase.words[:2] == ("for", "a") and not phrase.amounts
    heard = wishes_of(bare(phrase.said), way.text.scene) if stays else []
    frames = [frame for wish in heard for frame in wish.frames]
    return bool(frames) and all(isinstance(frame, Pace) and frame.part == WHOLE for frame in frames)


def _denies_another_way(way: WayTold, phrase: WayPhrase) -> bool:
    """Whether it only says how not to pass what is passed otherwise: "over the cup, not around it"."""
    before = (stop.place for stop in reversed(way.stops) if stop.place and stop.phrase.span < phrase.span)
    passed = next(before, None)
    if passed is None or passed.relation == "at" or phrase.amounts:
        return False
    other = WAYS & {*phrase.words} - {passed.relation}
    kinds = ((word, concept_at(phrase.words, k)[0]) for k, word in enumerate(phrase.words) if word[0].isalnum())
    only = all(kind in ("never", PLAIN) or word in WAYS | PLACED for word, kind in kinds)
    return phrase.denies and bool(other) and only


def _asks_behind_verb(way: WayTold, phrase: WayPhrase) -> bool:
    """Whether something is asked for in a reason, behind its verb: "as it is full go slowly"."""
    text, stop = way.text, phrase.pieces.stop
    verb = next((k for k, word in enumerate(phrase.words) if word in FINITE), 0)
    more = phrase.words[verb + 1 :] if phrase.why else ()
    closed = stop == len(text) or text.words[stop] in ENDING
    if len(more) < 2 or (closed and not BIDDING & {*more[1:]}):
        return False
    return any(wish.outcome == "do" for wish in wishes_of(" ".join(more), text.scene))


DOING, BEFORE = frozenset(("do", "make", "perform", "execute", "draw")), 3
"""With a word that nobody knows, these ask for something, so many words before it: "do a backflip"."""

WAYS = frozenset("over above around round beside under through".split())
"""Words for how something is passed."""

PLACED = frozenset("it them of in on".split())
"""What may stand beside these words where they are denied."""

ASKS, ASKS_STRANGELY = 0.5, 0.28
"""How likely words without a role may be a wish and yet be passed over; and those with a word that nobody knows."""
