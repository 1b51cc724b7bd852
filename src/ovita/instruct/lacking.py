"""What a reading of the network lacks and the sentence says: what a number is of, a thing left, ways up and back."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, Literal

from ovita.instruct.edits import Set
from ovita.instruct.encoder import concepts_of
from ovita.instruct.frames import (
    OPPOSITES,
    Approach,
    Arrive,
    Clearance,
    Extend,
    Figure,
    Height,
    MoveEnd,
    Pace,
    Quantity,
    Resample,
    SemanticFrame,
    Shift,
    Side,
    Visit,
    Wait,
)
from ovita.instruct.lexicon import concept_at
from ovita.instruct.sketch import DETERMINERS, Fragment, Sketch
from ovita.instruct.slots import Atom
from ovita.instruct.whereabouts import placed

NONE = Quantity(0.0, "m")
"""How far above a thing an end is that is as high as it."""

BACKING = ("back up", "backing up", "back off", "back out", "reverse", "retreat", "retract", "back along")
"""How words begin that ask for the way back from where the robot is."""

LONGER = frozenset("longer another extra additional".split())
"""Words with which a wait is to last so much longer."""

SINKING = frozenset("down downward downwards descend descends descending descent sink sinks sinking drop".split())
RISING = frozenset("up upward upwards ascend ascending ascent climb climbing rise rising".split())
UPRIGHT = frozenset("vertical vertically upright".split())
"""Words for where a figure leads."""

UP_AND_DOWN = ("up and down", "up down", "down and up")
"""Phrases for the ways of what goes up and down."""

NO_WAY_DOWN = frozenset("slow slows slowing slowed calm wind it".split())
"""Words behind which a "down" is no direction: "slow down", "slow it down"."""


def each_its_own(atoms: Iterable[Atom], seen: Sketch) -> tuple[Atom, ...]:
    """Atoms without an amount that is only the next one's: "up and 10 cm to the left"."""
    found = [*atoms]
    for i, (one, other) in enumerate(pairwise(found)):
        if one.label("direction") and one.amounts == other.amounts and _is_the_others(one, other, seen):
            found[i] = replace(one, amounts={})
    return tuple(found)


def _is_the_others(one: Atom, other: Atom, seen: Sketch) -> bool:
    """Whether an amount behind an "and" is of the second of two directions only: "up and 10 cm to the left"."""
    if [*one.amounts] != ["amount"]:
        return False
    at = [k for k, p in enumerate(seen.pieces) if p.mention >= 0 and _is(seen, p.mention, one.amounts["amount"])]
    if len(at) != 1 or not at[0] or seen.pieces[at[0] - 1].text.lower() not in ("and", ","):
        return False
    before, behind = (_ways(seen.pieces[part]) for part in (slice(at[0]), slice(at[0], None)))
    return one.label("direction") in before - behind and other.label("direction") in behind - before


def _ways(pieces: Sequence[Fragment]) -> set[str]:
    """The directions that some words say."""
    concepts = concepts_of(pieces)
    return {{"raise": "up", "lower": "down"}.get(concept, concept) for concept in concepts}


def completed(items: Sequence[Any], used: frozenset[int], seen: Sketch) -> tuple[tuple[Any, ...], frozenset[int]]:
    """Items with what the words beside them say: what a number is of, which way, the thing that is left.

    Args:
        items: Frames and edits.
        used: The mentions that they were read from.
        seen: The sentence.

    Returns:
        The items, and the mentions that they were read from then.
    """
    found: list[Any] = []
    for item in items:
        pieces = seen.pieces if len(items) == 1 else _about(item, seen)
        text = " ".join(piece.text.lower() for piece in pieces if piece.text.replace("'", "").isalpha())
        told, mention = _completed(_halved(item, seen), text, _left(used, seen), seen)
        used |= {mention} - {NOWHERE}
        found.append(placed(told, pieces, seen))
    return tuple(found), used


def _about(item: Any, seen: Sketch) -> Sequence[Fragment]:
    """The clauses that name what an item is about; of one that is about no thing, all of them."""
    named = {*item.named} if isinstance(item, SemanticFrame) else set()
    clauses: list[list[Fragment]] = [[]]
    for piece in seen.pieces:
        clauses += [[]] if piece.text.lower() in PAUSES else []
        clauses[-1].append(piece)
    own = [
        clause
        for clause in clauses
        if any(p.mention >= 0 and not named.isdisjoint(seen.mentions[p.mention].items) for p in clause)
    ]
    return [piece for clause in own for piece in clause] or seen.pieces


PAUSES = frozenset(", ; . : and but then".split())
"""Words and signs between which clauses stand."""

NOWHERE = -1
"""Stands for no mention."""


def _left(used: frozenset[int], seen: Sketch) -> list[int]:
    """The mentions that nothing was read from."""
    return [i for i, mention in enumerate(seen.mentions) if mention.words and i not in used]


SKIMMING = frozenset("skim skims skimming graze grazes grazing barely low".split())
"""Words for a pass close over a thing."""


def _completed(item: Any, text: str, left: Sequence[int], seen: Sketch) -> tuple[Any, int]:
    """An item with what it lacks, and the mention that this was read from."""
    words = frozenset(text.split())
    match item:
        case Wait(longer=False, duration=Quantity()) if LONGER & words and not DENYING & words:
            return replace(item, longer=True), NOWHERE
        case Arrive(place="") if len(things := [i for i in left if len(seen.mentions[i].items) == 1]) == 1:
            return replace(item, place=seen.mentions[things[0]].items[0]), things[0]
        case Extend(place="", by=Quantity() as by) if by.value > 0 and _says(text, BACKING):
            return replace(item, by=replace(by, value=-by.value, said="")), NOWHERE
        case Height(of=str() as thing, level=Quantity() as level) if thing and level.value > 0 and _below(thing, seen):
            role = "to" if BOUNDING.isdisjoint(words) else level.role
            return replace(item, level=replace(level, value=-level.value, role=role, said="")), NOWHERE
        case Height(of="", level=Quantity(role="to")) if not item.part and (end := _end_told(seen)):
            return MoveEnd(end=end, level=item.level), NOWHERE
        case Shift() | MoveEnd():
            return _put(item, text, seen), NOWHERE
        case Side(direction="left" | "right" | "front" | "back") if beside := _on_your_side(text) or _kept_off(seen):
            return replace(item, direction=OPPOSITES[beside], along=False), NOWHERE
        case Approach(by=Quantity()) if (nearer := _nearer(item, seen)) is not item:
            return nearer, NOWHERE
        case Approach() | Clearance() if changed := _gap_changed(text):
            return _with_gap(item, changed), NOWHERE
        case Pace():
            return _paced(item, text, seen), NOWHERE
        case Figure():
            return _drawn(item, text), NOWHERE
        case Resample(amount=Quantity()):
            return _counted(item, words), NOWHERE
        case Visit(relation="over" | "under", by=None) if not SKIMMING.isdisjoint(words):
            return replace(item, degree="slight"), NOWHERE
    return item, NOWHERE


def _counted(item: Resample, words: frozenset[str]) -> Resample:
    """A number of waypoints as a count where no word adds or takes away, and a factor as a share where one takes."""
    match item:
        case Resample(change="by", amount=Quantity(unit="waypoints") as n) if MADE_OF & words and not CHANGING & words:
            return replace(item, change="to", amount=replace(n, unit="", role="to"))
        case Resample(change="by", amount=Quantity(unit="x") as n) if n.value > 1 and THINNING & words:
            return replace(item, amount=replace(n, value=1.0 / n.value, said=""))
    return item


MADE_OF = frozenset("by with using as".split())
"""Words before a number of waypoints that the path is to have: "represent the route by 80 waypoints"."""

THINNING = frozenset("thin thinned reduce fewer less halve decimate coarser sparser downsample lower cut".split())
CHANGING = THINNING | {*"add more extra additional another insert increase plus drop remove minus delete".split()}
"""Words with which waypoints are taken away, or change by a number."""


def _paced(pace: Pace, text: str, seen: Sketch) -> Pace:
    """A pace as words say it: down to a stop, times so much, in a share of the time, a floor."""
    match pace:
        case Pace(change="slower", amount=Quantity(value=0.0)) if not pace.part:
            return replace(pace, change="rampdown", amount=None)
        case Pace(change="faster" | "slower", amount=Quantity(unit="x") as by) if _multiplies(text):
            return replace(pace, change="set", amount=replace(by, role="to"))
        case Pace(change="set" | "cap", amount=Quantity(unit="m/s") as by) if bound := _bound_told(by, seen):
            return replace(pace, change=bound, amount=replace(by, role="at_most" if bound == "cap" else "at_least"))
        case Pace(change="slower" | "faster", amount=Quantity(unit="%", role="by") as by) if _led_by_to(by, seen):
            return replace(pace, change="set", amount=replace(by, role="to"))
        case Pace(amount=Quantity(unit="%")):
            return _in_words_of_time(pace, seen)
    return pace


def _bound_told(amount: Quantity, seen: Sketch) -> Literal["", "cap", "floor"]:
    """The bound that the words before a speed call it: "top speed 4 km/h, bottom speed 1 km/h"; "" where none does."""
    at = next((i for i, p in enumerate(seen.pieces) if p.mention >= 0 and _is(seen, p.mention, amount)), 0)
    words = [piece.text.lower() for piece in seen.pieces[max(at - 5, 0) : at]]
    clause = words[max((i + 1 for i, word in enumerate(words) if word in PAUSES), default=0) :]
    told = {one for one, other in pairwise(clause) if other in ("speed", "velocity", "pace")}
    return "cap" if told & GREATEST else "floor" if told & LEAST else ""


GREATEST = frozenset("top max maximum peak highest".split())
LEAST = frozenset("bottom min minimum lowest least".split())
"""Words before "speed" for a greatest and a least one."""


def _multiplies(text: str) -> bool:
    """Whether a factor is one of what there is, and no word says which way: "scale the speed by 1.5"."""
    words = text.split()
    ways = {concept_at((word,), 0)[0] for word in words} & {"faster", "slower"}
    return not ways and not MULTIPLIED.isdisjoint(words)


def _drawn(figure: Figure, text: str) -> Figure:
    """A figure as words say it: a circle and no eight, sinking, upright."""
    words = frozenset(text.split())
    match figure:
        case Figure(shape="eight") if not words.isdisjoint(ROUND) and words.isdisjoint(EIGHTS):
            return replace(figure, shape="circle")
        case Figure(shape="spiral", rise=Quantity() as rise) if _sinks(text):
            return replace(figure, rise=replace(rise, value=-abs(rise.value), said=""))
        case Figure(shape="wave" | "zigzag") if not UPRIGHT.isdisjoint(words) or _says(text, UP_AND_DOWN):
            return replace(figure, upright=True)
    return figure


def _halved(item: Any, seen: Sketch) -> Any:
    """An item whose radius words call a diameter with half of that; any other as it is."""
    match item:
        case Figure(radius=Quantity() as amount) if _is_across(amount, seen):
            return replace(item, radius=replace(amount, value=amount.value / 2.0, said=""))
        case Set(slot="radius", quantity=amount) if _is_across(amount, seen):
            return replace(item, quantity=replace(amount, value=amount.value / 2.0, said=""))
    return item


def _is_across(amount: Quantity, seen: Sketch) -> bool:
    """Whether words call a length a diameter: "20 cm across", "with a diameter of 20 cm"."""
    at = next((i for i, p in enumerate(seen.pieces) if p.mention >= 0 and _is(seen, p.mention, amount)), -1)
    words = [piece.text.lower() for piece in seen.pieces]
    before, behind = words[max(at - 3, 0) : max(at, 0)], words[at + 1 : at + 4]
    return at >= 0 and "radius" not in behind and bool(DIAMETERS & {*before, *behind[:2]} or WIDE & {*behind[:1]})


DIAMETERS, WIDE = frozenset(("diameter", "diam", "dia", "diametre")), frozenset(("across", "wide"))
"""Words near a length that is the diameter of a circle, and right behind it."""

ROUND = frozenset("circle circles ring loop".split())
EIGHTS = frozenset("eight eights figure loops lemniscate infinity".split())
"""Words for figures that the reader takes for each other."""


def _put(item: Shift | MoveEnd, text: str, seen: Sketch) -> SemanticFrame:
    """A move up or down "to" an amount as the height that it is, and an end on top of a thing or as high as it."""
    match item:
        case MoveEnd(relation="to", offset=(), place=str() as thing) if _says(text, HIGH_AS) and thing in item.named:
            return MoveEnd(end=item.end, place=thing, level=replace(NONE, role="to"))
        case MoveEnd(relation="to", offset=(("up", None),)) if "on top of" in text:
            return replace(item, offset=())
        case Shift(offset=((way, by),)) if _is_too_much(way, text) and way in OPPOSITES:
            return replace(item, offset=((OPPOSITES[way], by),))
        case Shift(offset=(("up" | "down", Quantity() as by),)) if _led_by_to(by, seen):
            return Height(level=replace(by, role="to"), part=item.part)
        case MoveEnd(relation="", offset=(("up" | "down", Quantity() as by),)) if _led_by_to(by, seen):
            return MoveEnd(end=item.end, level=replace(by, role="to"))
    return item


def _is_too_much(way: str, text: str) -> bool:
    """Whether words say that there is too much of a direction: "too far to the left near the easel"."""
    high = {"up": "high", "down": "low"}.get(way, way)
    return _says(text, tuple(f"too {far}{high}" for far in ("", "far ", "far to the ", "much to the ", "much ")))


def _led_by_to(amount: Quantity, seen: Sketch) -> bool:
    """Whether a "to" stands before an amount."""
    said = [b.mention for a, b in pairwise(seen.pieces) if a.text.lower() == "to" and b.mention >= 0]
    return any(_is(seen, mention, amount) for mention in said)


def _sinks(text: str) -> bool:
    """Whether words say that it goes down, and none that it goes up."""
    pairs = pairwise(["", *text.split()])
    words = {word for before, word in pairs if word != "down" or before not in NO_WAY_DOWN}
    return not SINKING.isdisjoint(words) and RISING.isdisjoint(words)


def _below(thing: str, seen: Sketch) -> bool:
    """Whether words say that a height is one below a thing: "30 cm lower than the lamp"."""
    pieces = [piece for piece in seen.pieces if piece.text.lower() not in DETERMINERS]
    words = [piece.text.lower() for piece in pieces]
    named = [seen.mentions[piece.mention].items if piece.mention >= 0 else () for piece in pieces]
    return any(
        names == (thing,) and (words[max(k - 1, 0)] in BELOW or words[max(k - 2, 0) : k] == ["lower", "than"])
        for k, names in enumerate(named)
    )


BELOW = frozenset("below under beneath underneath".split())
BOUNDING = frozenset("never always least most not don't stay keep remain must no".split())
"""Words with which a height is one that nothing is to pass."""


def _on_your_side(text: str) -> str:
    """The side on which a thing is to lie, seen from the robot: "with the cup on your left", "leave it to port"."""
    words = text.split()
    left = next((i for i, word in enumerate(words) if word in ("leave", "leaving")), len(words))
    behind = " ".join(words[left : left + NEAR])
    for side, port in (("left", "port"), ("right", "starboard")):
        own = _says(text, (f"on your {side}", f"on my {side}", f"on our {side}")) and not LAID.isdisjoint(words)
        lain = _says(behind, (f"on the {side}", f"on its {side}", f"to {port}"))
        if own or (lain and not _says(text, (f"{side} of", f"{port} of"))):
            return side
    return ""


NEAR = 6
"""Words from "leave" on among which a side is where the thing is left."""


def _kept_off(seen: Sketch) -> str:
    """The side of a thing that is denied: "never go to the left of the vase"; "" where none is."""
    words = [piece.text.lower() for piece in seen.pieces if piece.text.lower() != "side"]
    for i, (word, behind) in enumerate(pairwise(words)):
        clause = max((k + 1 for k in range(i) if words[k] in PAUSES), default=0)
        end = next((k for k in range(i, len(words)) if words[k] in PAUSES), len(words))
        denied = not DENIED.isdisjoint(words[max(i - 5, clause) : i]) or words[end - 1] == "never"
        if word in OPPOSITES and behind == "of" and denied:
            return word
    return ""


DENIED = frozenset("not don't never without no off".split())
"""Words before a side that is not to be passed on: "never in front of it", "stay off the right of it"."""


def _end_told(seen: Sketch) -> Literal["", "start", "goal"]:
    """The end that a height is told of: "the goal should be at a height of 0.5 m"; "" where none is."""
    words = ["", *(piece.text.lower() for piece in seen.pieces if piece.text.lower() not in DETERMINERS)]
    number = next((i for i, word in enumerate(words) if word.startswith("<")), len(words))
    clause = next((i for i in range(number - 1, 0, -1) if words[i] in PAUSES), 0)
    for before, word in pairwise(("", *words[clause + 1 : number])):
        if word in ("goal", "start", "end", "finish", "destination") and before in ("", *PUTTING):
            return "start" if word == "start" else "goal"
    return ""


PUTTING = ("put", "set", "place", "bring", "raise", "lower", "move", "have", "keep", "let")
"""Verbs before what is put somewhere."""

HIGH_AS = ("height of", "level with", "level of", "as high as", "same height")
"""Phrases before a thing whose height is meant, not its place."""

MULTIPLIED = frozenset("multiply multiplied multiplying scale scaled scaling".split())
"""Words with which a factor is one of what there is, and no difference."""


def _says(text: str, phrases: Sequence[str]) -> bool:
    return any(phrase in text for phrase in phrases)


LAID = frozenset("leave leaving keep keeping with have having remain remains stay stays".split())
"""Words with which a thing lies on somebody's side."""


def _nearer(item: Approach, seen: Sketch) -> SemanticFrame:
    """What comes to half its distance, or to so far off, in place of farther by half and closer by so much."""
    match item:
        case Approach(sense="closer", by=Quantity(unit="m") as gap) if _is_left(gap, seen):
            return Clearance(objects=item.objects, distance=replace(gap, role="at"), part=item.part, words=item.words)
        case Approach(sense="farther", by=Quantity(unit="x", value=times)) if times < 1.0:
            return replace(item, sense="closer")
    return item


def _is_left(gap: Quantity, seen: Sketch) -> bool:
    """Whether a length is how far off something comes closer, not by how much: "closer to the shelf, a foot off"."""
    behind = [b.text.lower() for a, b in pairwise(seen.pieces) if a.mention >= 0 and _is(seen, a.mention, gap)]
    return not {"off", "away"}.isdisjoint(behind)


def _gap_changed(text: str) -> str:
    """Whether words ask for a smaller ("less") or a larger ("more") distance; "" where they don't."""
    words = [word for word in text.split() if word not in DETERMINERS]
    if not DENYING.isdisjoint(words):  # "don't widen the gap"
        return ""
    told = [(concept_at((word,), 0)[0], concept_at(words[i + 1 : i + 2], 0)[0]) for i, word in enumerate(words)]
    return next((CHANGES[how] for how, what in told if how in CHANGES and what == "distance"), "")


DENYING = frozenset("not don't never without no".split())
CHANGES = {"decrease": "less", "increase": "more"}


def _with_gap(item: Approach | Clearance, changed: str) -> SemanticFrame:
    """A frame about a distance that is to be larger or smaller as such."""
    if isinstance(item, Approach):
        return replace(item, sense="closer" if changed == "less" else "farther")
    return replace(item, distance=replace(item.distance, role="at_most" if changed == "less" else "at_least"))


def _in_words_of_time(pace: Pace, seen: Sketch) -> Pace:
    """A share of the time as the factor of the speed that it is, and "half as fast" as a share of the speed."""
    at = next((k for k, p in enumerate(seen.pieces) if p.mention >= 0 and _is(seen, p.mention, pace.amount)), None)
    if at is None or pace.amount is None or not 0.0 < pace.amount.value < 1.0:
        return pace
    behind = [piece.text.lower() for piece in seen.pieces[at + 1 : at + 4]]
    if behind[:1] == ["as"] and behind[1:2] and behind[1] in ("fast", "quick", "quickly"):
        return replace(pace, change="set", amount=replace(pace.amount, role="to"))
    told = [word for word in behind if word not in ("of", "the", "that", "its")]
    before = [piece.text.lower() for piece in seen.pieces[max(at - 2, 0) : at]]
    if told[:1] in (["time"], ["duration"]) and not {"by", "save", "off", "cut", "less"} & {*before}:
        by = replace(pace.amount, value=1.0 / pace.amount.value, unit="x", role="by", said="")
        return replace(pace, change="faster", amount=by)
    return pace


def _is(seen: Sketch, mention: int, amount: Quantity | None) -> bool:
    said = seen.mentions[mention]
    return amount is not None and not said.is_object and (said.value, said.unit) == (amount.value, amount.unit)
