"""What a phrase means by what is told around it: "it", the place that follows, and what is mentioned besides."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from ovita.instruct.lexicon import DETERMINERS
from ovita.sources.phrases import WayPhrase, places_among
from ovita.sources.places import PHRASES, SIDES, Location, Text, phrase_at, way_words
from ovita.sources.stops import WayStop, same_place
from ovita.sources.wishes import TIES
from ovita.text import the

POINTING, THEREAFTER, PARTS, ONWARD = map(way_words, ("pointing", "thereafter", "part", "onward"))


@dataclass(frozen=True, eq=False)
class WayTold:
    """The way that a sentence tells.

    Args:
        text: The sentence.
        stops: The places of the way, in the order of the sentence.
        start: Where it starts.
        goal: Where it ends.
    """

    text: Text
    stops: tuple[WayStop, ...]
    start: Location | None
    goal: Location | None

    def is_place(self, phrase: WayPhrase) -> bool:
        """Whether a phrase tells a place of the way, or was to."""
        return any(stop.phrase is phrase for stop in self.stops)

    def leads_to_a_place(self, phrase: WayPhrase) -> bool:
        """Whether a place of the way follows a phrase at once."""
        return any(stop.phrase.pieces.start == phrase.pieces.stop and stop.place for stop in self.stops)

    def passed_before(self, phrase: WayPhrase) -> list[WayStop]:
        """What the way passes that is told before a phrase; of several goals, only the last is not passed."""
        goals = [stop for stop in self.stops if stop.role == "goal"][:-1]
        passed = (stop for stop in self.stops if stop.role == "via" or stop in goals)
        return [stop for stop in passed if stop.phrase.span < phrase.span]

    def ends_at(self, names: Collection[str]) -> bool:
        """Whether the way begins or ends at one of some objects, so that it cannot keep clear of it."""
        ends = (place for place in (self.start, self.goal) if place is not None)
        return any(item.name in names for place in ends for item in place.objects)

    def resolved(self, phrase: WayPhrase, *, passed: bool = False, circled: str | None = None) -> str:
        """The words of a phrase, with the object that is meant for "it": "30 cm clearance from it".

        Args:
            phrase: Of the sentence.
            passed: Whether it is what the way passes that is meant, where that is one object.
            circled: The object that is circled, which is meant then where nothing else is passed.
        """
        text, said = self.text, ""
        one = self.passed_alone(phrase) if passed else None
        one = Location(objects=(text.scene[circled],)) if passed and one is None and circled else one
        taken = -1
        for k in phrase.pieces:
            begin, end = text.pieces[k].span
            if k < taken:
                continue
            before = text.words[max(k - 2, 0) : k]
            pointed = text.words[k] == "it" and k > 0 and before[-1] in POINTING
            pointed = pointed and not (before[-1] == "of" and before[0] in PARTS)
            meant = (one or self.it_at(k, PHRASES.get(text.words[k - 1], "at"))) if pointed else None
            if (again := text.named_again(k)) is not None:
                meant, taken = again
            gap = text.text[text.pieces[k - 1].span[1] : begin] if said else ""
            name = the(meant.objects[0].name) if meant else text.text[begin:end]
            said += gap + (name.removeprefix("the ") if meant and said and text.words[k - 1] in DETERMINERS else name)
        return said.strip()

    def passed_alone(self, phrase: WayPhrase) -> Location | None:
        """The one object that the way passes and that is told before a phrase, or None."""
        places = [stop.place for stop in self.passed_before(phrase) if stop.place and len(stop.place.objects) == 1]
        return places[0] if places and all(same_place(place, places[0]) for place in places) else None

    def it_at(self, k: int, relation: str) -> Location | None:
        """The object that is told before piece k by the same relation, else the one that was named last.

        What is passed on a side is beside the way too: "left of the cup, and wait when you are next to it".
        """
        fitting = {"at": (), "beside": ("beside", *SIDES)}.get(relation, (relation,))
        before = [stop.place for stop in self.stops if stop.pieces.stop <= k and stop.place and stop.place.objects]
        alike = [place for place in before if place.relation in fitting]
        return alike[-1] if alike else self.text.meant_at(k)

    def thereafter(self, phrase: WayPhrase, circled: str | None = None) -> str | None:
        """The object behind which a wish counts: "0.1 m/s up to the cup and 0.2 m/s from then on", "then faster".

        Args:
            phrase: Of the wish.
            circled: The object that is circled before it, or None.
        """
        text, first = self.text, phrase.pieces.start
        told = any(phrase_at(phrase.words, k, THEREAFTER)[1] for k in range(len(phrase.words)))
        place = text.meant_at(first) if told else None
        begun = next((k for k, word in enumerate(phrase.words) if word not in TIES), 0)
        onward = phrase_at(phrase.words, begun, ONWARD)[1] > 0
        then = onward or "then" in text.words[max(first - 2, 0) : first + 2]
        passed = [stop.place for stop in self.passed_before(phrase) if stop.place and stop.place.objects]
        if then and place is None and circled:
            return circled
        if then and place is None and passed:
            place = passed[-1]
        there = place is not None and any(same_place(one, place) for one in passed)
        return place.objects[0].name if place is not None and there else None

    def joined(self, phrase: WayPhrase) -> str:
        """The words of an object that a figure is told of besides another: "an eight around the cup and the box"."""
        text, stop = self.text, phrase.pieces.stop
        other = text.object_at(stop + 1) if stop + 1 < len(text) and text.words[stop] in ("and", "&", "n") else None
        named = text.object_at(stop - 1) is not None
        if other is None or not named or other[0].unclear:
            return ""
        begin, end = text.pieces[stop].span[0], text.pieces[other[1] - 1].span[1]
        return text.text[begin:end]


def barred_by(text: Text, phrase: WayPhrase) -> list[str]:
    """Names of the objects that a phrase says not to lead over: "on no account drive over the pallet"."""
    if not phrase.denies or phrase.amounts:
        return []
    over = [place for place, _ in places_among(text, phrase.pieces) if place.relation == "over" and place.objects]
    return [place.objects[0].name for place in over]


def mentioned(text: Text) -> list[tuple[str, str]]:
    """The objects that a sentence names, each on its own, with the words that name it first."""
    found, k = dict[str, str](), 0
    while k < len(text):
        named = text.object_at(k)
        if named is not None and not named[0].unclear:
            words = text.text[text.pieces[named[1] - 1].span[0] : text.pieces[named[1] - 1].span[1]].lower()
            found |= {item.name: words for item in named[0].objects if item.name not in found}
        k = k + 1 if named is None else named[1]
    return list(found.items())
