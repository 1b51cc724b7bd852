"""Circles in a phrase: "circle it twice", "one lap of the tower at 2 m", "a loop of 50 cm radius half way"."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ovita.instruct.frames import Figure, Place, Quantity, Sense
from ovita.instruct.lexicon import is_filler
from ovita.instruct.lexicon import Amount, Degree, amount_at
from ovita.paths.scene import Scene
from ovita.sources.places import Text, phrase_at, way_words

LAP, ROUND, TIMES, BESIDES, SHARE, MIDDLE, OVERHEAD = map(
    way_words, ("lap", "round", "lap times", "lap besides", "lap share", "lap middle", "lap over")
)
CLOCKWISE, COUNTER = map(way_words, ("clockwise", "counterclockwise"))
ONCE = {"once": 1.0, "one": 1.0, "twice": 2.0, "double": 2.0, "thrice": 3.0}
PARTS = {"half": 0.5, "third": 1.0 / 3.0, "quarter": 0.25}
DEGREES: dict[str, Degree] = {"small": "slight", "little": "slight", "tiny": "slight", "tight": "slight"} | {
    "large": "large", "big": "large", "wide": "large"
}  # fmt: skip


@dataclass(frozen=True)
class Lap:
    """A circle as it was told.

    Args:
        figure: Around an object, or beside the way.
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
    text = Text(said, scene)
    words, taken = text.words, set[int]()
    name, trigger, k, diameter = "", "", 0, False
    turns: float | None = None
    wide: float | None = None
    sense: Sense | None = None
    degree: Degree | None = None
    place: Quantity | None = None
    while k < len(words):
        used = 1
        lap, circling = phrase_at(words, k, LAP)[1], phrase_at(words, k, ROUND)[1]
        thing, amount, share = text.object_at(k), amount_at(words, k), phrase_at(words, k, SHARE | MIDDLE)
        turned = phrase_at(words, k, CLOCKWISE | COUNTER)
        if turned[1]:
            sense, used = ("cw" if turned[0] in CLOCKWISE else "ccw"), turned[1]
        elif share[1]:
            of = next((PARTS[word] for word in share[0].split() if word in PARTS), 0.5)
            place, used = Quantity(of, "%", "at"), share[1]
        elif lap or circling:
            trigger, used = trigger or ("lap" if lap else "round"), max(lap, circling)
        elif amount is not None and wide is None and (amount.unit == "m" or _is_radius(words, k, amount)):
            wide, used = amount.value, amount.used
        elif amount is not None and amount.unit in ("", "x") and turns is None and _counts(words, k, amount):
            turns, used = amount.value, amount.used
        elif words[k] in ONCE and turns is None:
            turns = ONCE[words[k]]
        elif words[k] in PARTS and turns is None and phrase_at(words, k + 2, LAP)[1]:
            turns, used = PARTS[words[k]], 2
        elif words[k] == "diameter":
            diameter = True
        elif thing is not None and not thing[0].unclear and name in ("", thing[0].objects[0].name):
            name, used = thing[0].objects[0].name, thing[1] - k
        elif (degreed := DEGREES.get(words[k])) is not None:
            degree = degreed
        elif not (words[k] in BESIDES | OVERHEAD or words[k] in TIMES or is_filler(words[k]) or not words[k][0].isalnum()):
            k += 1
            continue
        taken |= {*range(k, k + used)}
        k += used
    if not trigger or (not name and "it" in words) or (trigger == "round" and (turns is None or not name)) or (name and place is not None):
        return None
    if not name and (place is None and turns is None and wide is None):
        return None
    begin_end = [text.pieces[n].span for n in range(len(words)) if n not in taken]
    left = " ".join(text.text[begin:end] for begin, end in begin_end)
    size = None if wide is None else Quantity(wide / (2.0 if diameter else 1.0), "m", "to")
    where: Place = name or place or "middle"
    count = None if turns is None else Quantity(turns, "turns", "to")
    over = bool(name) and any(phrase_at(words, n, OVERHEAD)[1] for n in range(len(words)))
    away = "radius" not in words and not diameter and not FROM.isdisjoint(words)
    figure = Figure(shape="circle", place=where, radius=size, turns=count, sense=sense, degree=degree)
    return Lap(figure, over, away, left)


FROM = frozenset(("away", "distance", "clearance", "gap", "off", "from"))
"""Among the words of a circle, these say that an amount is its distance from the object."""


def _is_radius(words: Sequence[str], k: int, amount: Amount) -> bool:
    """Whether an amount without a unit is told as a radius or a diameter."""
    return amount.unit == "" and not {"radius", "diameter"}.isdisjoint(words[max(k - 2, 0) : k])


def _counts(words: Sequence[str], k: int, amount: Amount) -> bool:
    """Whether an amount at word k counts laps."""
    behind = k + amount.used
    behind += words[behind : behind + 1] in (["full"], ["complete"], ["whole"])
    told = phrase_at(words, behind, LAP | TIMES)[1] > 0
    return amount.unit == "x" or told
