"""Circles in a phrase: "circle it twice", "one lap of the tower at 2 m", "a loop of 50 cm radius half way"."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ovita.instruct.degrees import Degree
from ovita.instruct.frames import Figure, Place, Quantity, Sense
from ovita.instruct.lexicon import is_filler
from ovita.instruct.numerals import Amount, amount_at
from ovita.paths.scene import Scene
from ovita.sources.places import Text, phrase_at, way_words

LAP, ROUND, TIMES, BESIDES, SHARE, MIDDLE, OVERHEAD, END = map(
    way_words, ("lap", "round", "lap times", "lap besides", "lap share", "lap middle", "lap over", "lap end")
)
CLOCKWISE, COUNTER = map(way_words, ("clockwise", "counterclockwise"))
ONCE = {"once": 1.0, "one": 1.0, "twice": 2.0, "double": 2.0, "thrice": 3.0}
PARTS = {"half": 0.5, "third": 1.0 / 3.0, "quarter": 0.25}
DEGREES: dict[str, Degree] = {
    "small": "slight", "little": "slight", "tiny": "slight", "tight": "slight", "large": "large", "big": "large",
    "wide": "large",
}  # fmt: skip
FROM = frozenset(("away", "distance", "clearance", "gap", "off", "from"))
"""Among the words of a circle, these say that an amount is its distance from the object."""


@dataclass(frozen=True)
class Lap:
    """A circle as it was told.

    Args:
        figure: Around an object, or beside the way; its place is "" where the words do not tell it.
        over: Whether it is above the object.
        away: Whether its radius is told as a distance from the object.
        left: What else the phrase says, in its order.
    """

    figure: Figure
    over: bool
    away: bool
    left: str


def lap_in(said: str, scene: Scene) -> Lap | None:
    """The circle that a phrase tells, or None; "go around the tower" without a count is a way past it."""
    spelt = said.lower().split()
    if not any(phrase_at(spelt, k, LAP | ROUND)[1] for k in range(len(spelt))):
        return None
    reader = _LapReader(Text(said, scene))
    return reader.lap()


class _LapReader:
    """Reads the words of a circle one by one.

    Args:
        text: The phrase.
    """

    def __init__(self, text: Text) -> None:
        self.text, self.words = text, text.words
        self.name, self.lapping, self.rounding, self.diameter = "", False, False, False
        self.turns: float | None = None
        self.wide: float | None = None
        self.sense: Sense | None = None
        self.degree: Degree | None = None
        self.share: float | None = None

    def lap(self) -> Lap | None:
        """The circle, or None."""
        words, over, left, k = self.words, False, list[str](), 0
        while k < len(words):
            over = over or phrase_at(words, k, OVERHEAD)[1] > 0
            used = self._turning(k) or self._counted(k) or self._named(k) or self._besides(k)
            if not used:
                begin, end = self.text.pieces[k].span
                left.append(self.text.text[begin:end])
            k += max(used, 1)
        if not (self.lapping or (self.rounding and self.turns is not None and self.name)):
            return None
        single = any(phrase_at(words, k + 1 + (words[k + 1] in DEGREES), LAP)[1] for k in range(len(words) - 1)
                     if words[k] in ("a", "an", "another"))  # fmt: skip
        told = single or self.share is not None or self.turns is not None or self.wide is not None
        if (self.name and self.share is not None) or (not self.name and ("it" in words or not told)):
            return None
        size = None if self.wide is None else Quantity(self.wide / (2.0 if self.diameter else 1.0), "m", "to")
        count = None if self.turns is None else Quantity(self.turns, "turns", "to")
        ended: Place = "goal" if self.share == 1.0 else Quantity(self.share or 0.0, "%", "at")
        where = self.name or ("" if self.share is None else ended)
        figure = Figure(shape="circle", place=where, radius=size, turns=count, sense=self.sense, degree=self.degree)
        away = "radius" not in words and not self.diameter and not FROM.isdisjoint(words)
        return Lap(figure, over and bool(self.name), away, " ".join(left))

    def _turning(self, k: int) -> int:
        """Words at piece k that tell the circle, its sense, or where on the way it is."""
        sense, used = phrase_at(self.words, k, CLOCKWISE | COUNTER)
        if used:
            self.sense = "cw" if sense in CLOCKWISE else "ccw"
            return used
        share, used = phrase_at(self.words, k, SHARE | MIDDLE | END)
        if used:
            self.share = 1.0 if share in END else next((PARTS[word] for word in share.split() if word in PARTS), 0.5)
            return used
        lap, rounding = phrase_at(self.words, k, LAP)[1], phrase_at(self.words, k, ROUND)[1]
        self.lapping, self.rounding = self.lapping or lap > 0, self.rounding or rounding > 0
        return max(lap, rounding)

    def _counted(self, k: int) -> int:
        """Words at piece k that tell how wide the circle is, or how often around."""
        words, amount = self.words, amount_at(self.words, k)
        if amount is not None and self.wide is None and (amount.unit == "m" or self._is_radius(k, amount)):
            self.wide = amount.value
            return amount.used
        if amount is not None and self.turns is None and amount.unit in ("", "x") and self._counts(k, amount):
            self.turns = amount.value
            return amount.used
        if words[k] in ONCE and self.turns is None:
            self.turns = ONCE[words[k]]
            return 1
        if words[k] in PARTS and self.turns is None and phrase_at(words, k + 2, LAP)[1]:
            self.turns = PARTS[words[k]]
            return 2
        return 0

    def _named(self, k: int) -> int:
        """Words at piece k that name the object."""
        thing = self.text.object_at(k)
        if thing is None or thing[0].unclear or self.name not in ("", thing[0].objects[0].name):
            return 0
        self.name = thing[0].objects[0].name
        return thing[1] - k

    def _besides(self, k: int) -> int:
        """A word at piece k that comes with a circle."""
        word = self.words[k]
        self.diameter = self.diameter or word == "diameter"
        self.degree = DEGREES.get(word, self.degree)
        known = word in DEGREES or word in BESIDES | OVERHEAD | TIMES or is_filler(word)
        return int(known or not word[0].isalnum())

    def _is_radius(self, k: int, amount: Amount) -> bool:
        """Whether an amount without a unit is told as a radius or a diameter."""
        return amount.unit == "" and not {"radius", "diameter"}.isdisjoint(self.words[max(k - 2, 0) : k])

    def _counts(self, k: int, amount: Amount) -> bool:
        """Whether an amount counts laps."""
        behind = k + amount.used
        behind += _full(self.words[behind : behind + 1])
        return amount.unit == "x" or phrase_at(self.words, behind, LAP | TIMES)[1] > 0


def _full(words: Sequence[str]) -> bool:
    return words in (["full"], ["complete"], ["whole"])
