"""The phrases of a sentence that tells a way: words that belong together, and what they tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from ovita.instruct.lexicon import PLAIN, concept_at, is_filler, term_at
from ovita.instruct.numerals import Amount, amount_at
from ovita.sources.laps import lap_in
from ovita.sources.places import BEHIND, PHRASES, SEEN, Location, Text, phrase_at, way_words
from ovita.sources.reasons import BIDDING, REASON, ReasonClause, clauses
from ovita.sources.sides import SeenSide, seen_sides
from ovita.sources.tagging import ROLES, Role, seen_with_points, tagger
from ovita.sources.wishes import TIES

GROUND = frozenset(words for words in way_words("raised") if {"ground", "floor", "air", "agl"} & {*words.split()})
SET_OFF, COME_IN = map(way_words, ("set off", "come in"))
CARRIERS, TOUCHING, DISMISSAL = map(way_words, ("carrier", "touching", "dismissal"))

WAY: tuple[Role, ...] = ("start", "via", "goal")
"""The roles of places."""


@dataclass(frozen=True, eq=False)
class WayPhrase:
    """Words of a sentence that belong together, which pieces of the text they are, and whether they only tell why.

    Where they tell on which side of the robot something is to be passed, `seen` is that place.
    """

    role: Role | None
    shares: Mapping[Role, float]
    span: tuple[int, int]
    pieces: range
    words: tuple[str, ...]
    said: str
    why: bool = False
    seen: Location | None = None

    @property
    def nothing(self) -> float:
        """How likely its words ask for nothing."""
        return 1.0 - sum(self.shares.values())

    @cached_property
    def classes(self) -> frozenset[str]:
        """Of its words, see `instruct.lexicon.term_at`."""
        return frozenset(term_at(self.words, k)[0] for k in range(len(self.words)))

    @cached_property
    def amounts(self) -> tuple[tuple[int, Amount], ...]:
        """What is measured, and which word tells it."""
        found, end = list[tuple[int, Amount]](), 0
        for k in range(len(self.words)):
            amount = amount_at(self.words, k) if k >= end else None
            if amount is not None:
                found.append((k, amount))
                end = k + amount.used
        return tuple(found)

    @property
    def measured(self) -> bool:
        """Whether it holds an amount with a unit, or behind a word that says of what."""
        of = ("by", "to", "at", "of")
        return any(amount.unit or (k > 0 and self.words[k - 1] in of) for k, amount in self.amounts)

    @property
    def tells_a_side(self) -> bool:
        """Whether it tells on which side something is: "on the left"."""
        return any(phrase_at(self.words, k, phrases)[1] for k in range(len(self.words)) for phrases in (BEHIND, SEEN))

    @property
    def lasting(self) -> bool:
        """Whether it tells how long something takes."""
        return any(amount.unit == "s" for _, amount in self.amounts)

    @property
    def careful(self) -> bool:
        """Whether it asks for nothing but what a plan does anyway: "without hitting the cup", "no stops"."""
        seen_to = TOUCHING & set(self.words) or self.classes & {"wait", "stop"}
        return self.denies and bool(seen_to) and not self.amounts

    @property
    def reasons(self) -> bool:
        """Whether it tells why: a place in it is none of the way."""
        begins = next((word for word in self.words if word[0].isalnum()), "")
        return self.why or (self.role in WAY and begins in REASON)

    @property
    def denies(self) -> bool:
        """Whether all that it does is to deny something: "on no account drive over the cup"."""
        kinds = ({term_at(self.words, k)[0], concept_at(self.words, k)[0]} for k in range(len(self.words)))
        return any("never" in kind and self._all_from(k) for k, kind in enumerate(kinds))

    @property
    def dismisses(self) -> bool:
        """Whether all that it does is to leave something out: "never mind the cup"."""
        return any(self._all_from(k) for k in range(len(self.words)) if phrase_at(self.words, k, DISMISSAL)[1])

    def _all_from(self, k: int) -> bool:
        """Whether nothing is told before a word, nor behind a comma or a tie that follows it."""
        tied = (n for n in range(k + 1, len(self.words)) if self.words[n] in TYING)
        told = (*self.words[:k], *self.words[next(tied, len(self.words)) :])
        asking = (word for n, word in enumerate(told) if concept_at(told, n)[0] not in ("", PLAIN))
        return all(word in TIES | CARRIERS or is_filler(word) for word in asking)


TYING = (TIES | {","}) - {"or", "having", "been", "please"}
"""Words and marks behind which something else may be asked for."""


def phrases_of(text: Text) -> list[WayPhrase]:
    """The phrases of a sentence, in order."""
    points = [piece.span for piece in text.pieces if piece.point is not None]
    found = []
    for tagged in tagger().read(seen_with_points(text.text, text.scene, points)):
        begin, end = tagged.span
        inside = [k for k, piece in enumerate(text.pieces) if begin <= piece.span[0] < end]
        pieces = range(inside[0], inside[-1] + 1) if inside else range(0)
        words = tuple(text.words[k] for k in pieces)
        phrase = WayPhrase(tagged.role, tagged.shares, tagged.span, pieces, words, text.text[begin:end].strip())
        found.append(phrase)
    found = _with_both_ends(text, _with_laps(text, _with_whole_names(text, found)))
    for clause in clauses(text):
        found = _set_apart(text, found, clause)
    for side in seen_sides(text):
        found = _with_side(text, found, side)
    return [part for phrase in _with_manners(text, found) for part in _with_figure(text, phrase)]


def _with_whole_names(text: Text, phrases: Sequence[WayPhrase]) -> list[WayPhrase]:
    """The phrases with what was cut off at their ends: "avoid the | chimney", "stay please | always 10 cm from it"."""
    found = list[WayPhrase]()
    for phrase in phrases:
        before = found[-1] if found and phrase.pieces else None
        if before is not None and (_begun_by(before, phrase) or _there(before, phrase, found)):
            found[-1] = part_of(text, phrase, range(before.pieces.start, phrase.pieces.stop))
            continue
        cut = 0 if before is None else _cut_off(text, before, phrase)
        if before is not None and cut:
            found[-1] = part_of(text, before, range(before.pieces.start, cut))
            found += [part_of(text, phrase, range(cut, phrase.pieces.stop))] if cut < phrase.pieces.stop else []
        else:
            found.append(phrase)
    return found


def _begun_by(before: WayPhrase, phrase: WayPhrase) -> bool:
    """Whether a wish is only the beginning of the one that follows at once: "stay please | always 10 cm from it"."""
    alike = before.role == phrase.role == "wish" and before.pieces.stop == phrase.pieces.start
    return alike and len(before.words) <= FEW and not before.amounts


def _there(before: WayPhrase, phrase: WayPhrase, earlier: Sequence[WayPhrase]) -> bool:
    """Whether a place that was taken for another goal is where the wish behind it counts: "near the cup | slower"."""
    first = next((k for k, word in enumerate(before.words) if word not in TIES), 0)
    beside = PHRASES.get(phrase_at(before.words, first, PHRASES)[0]) == "beside"
    another = before.role == "goal" and any(one.role == "goal" for one in earlier[:-1])
    return beside and another and phrase.role == "wish" and before.pieces.stop == phrase.pieces.start


FEW = 2
"""Words of a beginning, at most."""


def _cut_off(text: Text, before: WayPhrase, phrase: WayPhrase) -> int:
    """The piece up to which a phrase without a role belongs to the one before it; 0 where it does not."""
    if not before.role or phrase.role or not before.pieces:
        return 0
    first = phrase.pieces.start
    if text.is_article_at(before.pieces[-1]):
        named = text.object_at(first)
        return min(named[1] if named is not None else first + 1, phrase.pieces.stop)
    told = [k for k in phrase.pieces if text.words[k][0].isalnum()]
    short = before.role == "wish" and phrase.shares["wish"] > RATHER and text.words[first] not in TIES | CARRIERS
    return told[-1] + 1 if short and told[:1] == [first] and told[-1] < first + 2 else 0


RATHER = 0.2
"""How likely a word or two behind a wish, with no mark between, have to be a part of it."""


def _with_laps(text: Text, phrases: list[WayPhrase]) -> list[WayPhrase]:
    """The phrases with what is circled so often, and was taken for a place, as a wish: "once right round the cup"."""
    none = dict.fromkeys(ROLES, 0.0) | {"wish": 1.0}
    laps = (p.role == "via" and lap_in(p.said, text.scene) is not None for p in phrases)
    return [replace(p, role="wish", shares=none) if lap else p for p, lap in zip(phrases, laps, strict=True)]


def _with_both_ends(text: Text, phrases: list[WayPhrase]) -> list[WayPhrase]:
    """The phrases with a place that was taken for none of the way as the end that no other one tells, if likely."""
    ends: tuple[Role, ...] = ("start", "goal")
    for end in ends:
        if any(phrase.role == end for phrase in phrases):
            continue
        placed = [p for p in phrases if p.role in ("wish", None) and places_among(text, p.pieces)]
        placed = [p for p in placed if p.shares[end] > POSSIBLE or p.words[0] == LEADING_TO[end]]
        meant = max(placed, key=lambda phrase: phrase.shares[end], default=None)
        phrases = [replace(phrase, role=end) if phrase is meant else phrase for phrase in phrases]
    return phrases


LEADING_TO: Mapping[Role, str] = {"start": "from", "goal": "to"}
"""The word in front of each end."""

POSSIBLE = 0.3
"""How likely a place that was taken for a wish has to be an end of the way to be that, where none is told."""


def _with_manners(text: Text, phrases: Sequence[WayPhrase]) -> list[WayPhrase]:
    """The phrases with words that tell how fast a place is come to as wishes: "then | slowly | to the cup"."""
    found = list[WayPhrase]()
    for phrase in phrases:
        rest = [phrase]
        named = {k for _, pieces in places_among(text, phrase.pieces) for k in pieces}
        manners = [k for k in phrase.pieces if k not in named and term_at(text.words, k)[0] in MANNERS]
        if named and phrase.role in WAY and not phrase.reasons:
            for k in manners:
                *before, last = rest
                if k in last.pieces:
                    rest = [*before, *around(text, last, _manner(text, k))]
            none = dict.fromkeys(ROLES, 0.0) | {"wish": 1.0}
            rest += [part_of(text, replace(phrase, role="wish", shares=none), _manner(text, k)) for k in manners]
        found += rest
    return sorted(found, key=lambda phrase: phrase.span)


def _with_figure(text: Text, phrase: WayPhrase) -> list[WayPhrase]:
    """A phrase without a role as one with a wish for the figure that it names: "now the carpet: | zigzag"."""
    if phrase.role or phrase.reasons or phrase.nothing > NOTHING or "never" in phrase.classes:
        return [phrase]
    terms = ((k, *term_at(text.words, k)) for k in phrase.pieces)
    told = next((range(k, k + used) for k, kind, used in terms if kind in FIGURES), None)
    if told is None or told.stop > phrase.pieces.stop:
        return [phrase]
    none = dict.fromkeys(ROLES, 0.0) | {"wish": 1.0}
    wish = part_of(text, replace(phrase, role="wish", shares=none), told)
    return sorted([*around(text, phrase, told), wish], key=lambda part: part.span)


NOTHING = 0.9
"""How likely words have to ask for nothing to be passed over, whatever they hold: "the floor is wet on the right"."""

FIGURES = frozenset(("zigzag", "wave", "waves", "spiral", "circle", "eight"))
"""Classes of words that ask for a figure, which is passed over by nothing else."""


def _manner(text: Text, k: int) -> range:
    """A word that tells how fast, with the one that says at which end of the way: "start slowly | at the bed"."""
    verbs = (n for n in range(max(k - 3, 0), k) if phrase_at(text.words[:k], n, SET_OFF | COME_IN)[1] == k - n)
    return range(next(verbs, k), k + 1)


MANNERS = frozenset(("slower", "faster", "creep", "zigzag", "waves", "wave"))
"""Classes of words that tell how a place is come to."""


def _with_side(text: Text, phrases: Sequence[WayPhrase], side: SeenSide) -> list[WayPhrase]:
    """The phrases with the words on which side something is to be passed as one of their own."""
    cut = (part for phrase in phrases if not phrase.why for part in around(text, phrase, side.pieces))
    shares = dict.fromkeys(ROLES, 0.0) | {"via": 1.0}
    whole = part_of(text, WayPhrase("via", shares, (0, 0), side.pieces, (), "", seen=side.place), side.pieces)
    return sorted([*cut, *(phrase for phrase in phrases if phrase.why), whole], key=lambda phrase: phrase.span)


def around(text: Text, phrase: WayPhrase, pieces: range) -> list[WayPhrase]:
    """What is left of a phrase before and behind some pieces."""
    if phrase.pieces.start >= pieces.stop or phrase.pieces.stop <= pieces.start:
        return [phrase]
    parts = range(phrase.pieces.start, pieces.start), range(pieces.stop, phrase.pieces.stop)
    return [part_of(text, phrase, part) for part in parts if any(text.words[k][0].isalnum() for k in part)]


def _set_apart(text: Text, phrases: Sequence[WayPhrase], clause: ReasonClause) -> list[WayPhrase]:
    """The phrases with a clause that tells why as one of its own; it ends where something is asked for behind it."""
    certain = (p for p in phrases if p.role and p.shares[p.role] > CERTAIN and p.pieces.start > clause.verb)
    begun = (p.pieces.start for p in certain if p.role in WAY or p.words[0] in BIDDING)
    why = range(clause.pieces.start, min(next(begun, clause.pieces.stop), clause.pieces.stop))
    none = dict.fromkeys(ROLES, 0.0)
    found = [part for phrase in phrases for part in around(text, phrase, why)]
    found.append(part_of(text, WayPhrase(None, none, (0, 0), why, (), "", why=True), why))
    return sorted(found, key=lambda phrase: phrase.span)


CERTAIN = 0.6
"""How likely a phrase behind a reason has to have its role to be none of it."""


def part_of(text: Text, phrase: WayPhrase, pieces: range) -> WayPhrase:
    """Some pieces of a phrase, as a phrase."""
    span = text.pieces[pieces[0]].span[0], text.pieces[pieces[-1]].span[1]
    words = tuple(text.words[k] for k in pieces)
    return replace(phrase, span=span, pieces=pieces, words=words, said=text.text[span[0] : span[1]].strip())


def places_among(text: Text, pieces: range) -> list[tuple[Location, range]]:
    """The places that begin among some pieces, one behind the other."""
    found, k = list[tuple[Location, range]](), pieces.start
    while k < pieces.stop:
        place = text.place_at(k)
        if place is not None:
            found.append((place[0], range(k, place[1])))
        k = k + 1 if place is None else max(place[1], k + 1)
    return found
