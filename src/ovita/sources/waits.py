"""Waits that a sentence tells: how long, and at which place or share of which stretch of the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ovita.instruct.frames import Hover, Quantity, Reading, Wait
from ovita.instruct.numerals import Amount
from ovita.sources.mentions import WayTold
from ovita.sources.phrases import WayPhrase
from ovita.sources.places import Location, phrase_at, way_words
from ovita.sources.stops import WayStop, same_place, stops_of
from ovita.sources.wishes import Wish, wishes_of

TOWARD = way_words("toward")
VIA_POINT = frozenset(("via", "point"))
ENDS = (("start", way_words("before leaving")), ("goal", way_words("arrived") - {"there"}))
"""The ends of a way, with the words that say that a wait is there."""


@dataclass(frozen=True, eq=False)
class Waits:
    """Reads the phrases that tell waits.

    Args:
        way: That the sentence tells.
    """

    way: WayTold

    def told(self, phrase: WayPhrase, following: WayPhrase | None) -> tuple[list[Wish], bool]:
        """The waits of a phrase, and whether the phrase that follows belongs to them.

        "With a 3 s stop" and "a third of the way in" may be two phrases for the network.
        """
        text = self.way.text
        own = next((stop for stop in stops_of(text, phrase) if stop.place), None)
        heard = wishes_of(phrase.said, text.scene)
        if phrase.role == "wish" and heard and all(map(_complete, heard)):
            return heard, False  # "half speed for the first 3 seconds"
        free = following is not None and not following.reasons and not self.way.is_place(following)
        if following is not None and free and own is None and not _shared(heard):
            longer = wishes_of(text.text[phrase.span[0] : following.span[1]].strip(" ,;."), text.scene)
            if len(longer) == 1 and _shared(longer) and len(longer[0].frames) == 1:
                return self._at_a_share(phrase, None, longer), True
        return self._of_one(phrase, own, heard), False

    def _of_one(self, phrase: WayPhrase, own: WayStop | None, heard: Sequence[Wish]) -> list[Wish]:
        """The waits that a phrase tells by itself, at the places that it names or that was named last before it."""
        duration = next((amount for _, amount in phrase.amounts if amount.unit == "s"), None)
        if _shared(heard) and (own is None or self._ends_a_stretch(own)):
            return self._at_a_share(phrase, own, heard)
        spots = [] if duration is None else self._spots(phrase, own, heard)
        waits = [_waiting(duration, spot) for spot in dict.fromkeys(spots)] if duration and spots else list(heard)
        waits += [] if waits == list(heard) else [wish for wish in map(_without_waits, heard) if wish.frames]
        more = [words for words in _durations(phrase)[1:] if waits and duration is not None]
        return [*waits, *(Wish(words, "decline", Reading()) for words in more)]

    def _at_a_share(self, phrase: WayPhrase, own: WayStop | None, heard: Sequence[Wish]) -> list[Wish]:
        """Waits at a share of the way, or of a stretch of it: "to the cup and half way wait, then to the box"."""
        before = [stop for stop in self.way.stops if stop.phrase.span < phrase.span and stop.place]
        here = own or (before[-1] if before else None)
        if here is None or here.role == "start" or same_place(here.place, self.way.goal):
            return list(heard)
        return [replace(wish, stretch=here.place) if self._ends_a_stretch(here) else wish for wish in heard]

    def _ends_a_stretch(self, stop: WayStop) -> bool:
        """Whether a way leads to a place, and not merely past it."""
        first = min(stop.phrase.pieces.start, stop.pieces.start)
        words = self.way.text.words[max(first - 1, 0) : stop.pieces.start + 1]
        return stop.phrase.role == "goal" or not TOWARD.isdisjoint(words)

    def _spots(self, phrase: WayPhrase, own: WayStop | None, heard: Sequence[Wish]) -> list[str]:
        """Where a phrase says to wait: at its place, at the start, at each place, or at the likeliest one."""
        way = self.way
        if own is None and "every" in phrase.classes:
            return [self._spot(s.place) for s in way.stops if s.role != "start" and s.place and s.place.objects]
        if own is None or way.text.words[own.pieces.stop - 1] == "it":  # "before it sets off"
            words = self._until_a_mark(phrase)
            said = {end for end, phrases in ENDS for k in range(len(words)) if phrase_at(words, k, phrases)[1]}
            if len(said) == 1:
                return [*said]
        passed = [stop.place for stop in way.stops if stop.role == "via" and stop.place and stop.place.objects]
        if own is None and VIA_POINT <= {*phrase.words} and len(passed) == 1:
            return [self._spot(passed[0])]
        told = [f.place for wish in heard for f in wish.frames if isinstance(f, Wait)]
        if own is None and "there" not in phrase.words and {"start", "goal"} & {*map(str, told)}:
            return [str(place) for place in told if place in ("start", "goal")][:1]
        places = [place for place in (self._meant(own), *self._near_by(phrase)) if place]
        return [self._spot(place) for place in places if place.objects or place is way.goal][:1]

    def _until_a_mark(self, phrase: WayPhrase) -> Sequence[str]:
        """The words of a phrase, and those behind it up to the next mark."""
        words, begin = self.way.text.words, phrase.pieces.start
        marks = (k for k in range(phrase.pieces.stop, len(words)) if not words[k][0].isalnum() or words[k] == "and")
        return words[begin : next(marks, len(words))]

    def _meant(self, own: WayStop | None) -> Location | None:
        """The place that a wait names; "it" is what was told by the same relation before."""
        if own is None or own.place is None or self.way.text.words[own.pieces.stop - 1] != "it":
            return None if own is None else own.place
        return self.way.it_at(own.pieces.stop - 1, own.place.relation)

    def _near_by(self, phrase: WayPhrase) -> list[Location | None]:
        """The places that a wait may be at, the likeliest first: what follows at once, was told last, or comes next."""
        others = [stop for stop in self.way.stops if stop.phrase is not phrase]
        told = [stop for stop in others if stop.phrase.span < phrase.span]
        ahead = [stop for stop in others if stop.phrase.span > phrase.span]
        behind = [stop for stop in ahead if stop.role == "via"]
        sets_off = any(stop.role == "goal" for stop in ahead)  # "start at A, wait there, then on to B"
        before = [stop.place for k, stop in enumerate(told, 1) if stop.role != "start" or (sets_off and k == len(told))]
        text = self.way.text.text
        at_once = [s.place for s in behind if not text[phrase.span[1] : s.phrase.span[0]].strip()]
        return [*at_once, *before[::-1], *(stop.place for stop in behind), self.way.goal]

    def _spot(self, place: Location) -> str:
        """A place as a frame names it: an end of the way that is passed once, or its object."""
        once = [same_place(stop.place, place) for stop in self.way.stops].count(True) == 1
        ends = {"start": self.way.start, "goal": self.way.goal} if once or not place.objects else {}
        end = next((name for name, end in ends.items() if same_place(place, end)), "")
        return end or place.objects[0].name


def _shared(heard: Sequence[Wish]) -> bool:
    """Whether it comes to a wait at a share of the way."""
    waits = [frame for wish in heard for frame in wish.frames if isinstance(frame, Wait)]
    return any(frame.place == "middle" or isinstance(frame.place, Quantity) for frame in waits)


def _complete(wish: Wish) -> bool:
    """Whether a wish is certain, and no wait: "half speed for the first 3 seconds"."""
    return wish.outcome == "do" and bool(wish.frames) and not any(isinstance(frame, Wait) for frame in wish.frames)


def _without_waits(wish: Wish) -> Wish:
    return wish.without([frame for frame in wish.frames if isinstance(frame, Wait | Hover)])


def _durations(phrase: WayPhrase) -> list[str]:
    """What is said to last how long, each in its words: "2 s", "for 3"."""
    words = phrase.words
    lasting = [(k, one) for k, one in phrase.amounts if one.unit == "s" or (not one.unit and words[k - 1] == "for")]
    return [" ".join(words[max(k - 1, 0) : k + one.used]) for k, one in lasting]


def _waiting(duration: Amount, where: str) -> Wish:
    frame = Wait(place=where, duration=Quantity(duration.value, "s", "at"))
    return Wish(f"wait {duration.value:g} s at the {where}", "do", Reading(frames=(frame,)))
