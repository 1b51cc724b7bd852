"""What words mean that the network cannot say, or says by halves: a part of the path, objects, a side, some kinds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

from ovita.instruct.frames import OPPOSITES, Approach, Clearance, Figure, Pace, Quantity, SemanticFrame, Side, Visit
from ovita.instruct.sketch import DETERMINERS, Fragment, Sketch
from ovita.paths.part import WHOLE, PathPart

COUNTED = {word: k + 1 for k, word in enumerate("first second third fourth fifth sixth".split())}
"""Which share of a path a word before it counts: "the second quarter"."""

MIDDLES = frozenset("middle midpoint halfway midway".split())
SINCE = frozenset("from after past beyond since behind".split())
UNTIL = frozenset("until till to before".split())
"""Words before the middle of a path, where a part begins or ends that is half of it."""

SIDES = {"left": "left", "right": "right", "front": "front", "forward": "front", "back": "back", "behind": "back"}
HEIGHTS = frozenset("above below higher lower up down high low deep deeper over under height altitude".split())
"""Words for the side beyond which a part lies, and for that it is about heights."""

ALL = frozenset("all everything everyone anything everywhere".split())
EXCEPT = frozenset("but bar except excepting excluding save besides barring".split())
OTHER_THAN = (("other", "than"), ("apart", "from"), ("aside", "from"), ("except", "for"), ("with", "exception"))
"""Words and phrases between what means all things and the ones that are left out."""


PAUSES = frozenset(", ; . : and but then".split())
"""Words and signs between which clauses stand."""

LAID = frozenset("leave leaving keep keeping with have having remain remains stay stays".split())
"""Words with which a thing lies on somebody's side."""

DENIED = frozenset("not don't never without no off".split())
"""Words before a side that is not to be passed on: "never in front of it", "stay off the right of it"."""

NEAR = 6
"""Words from "leave" on among which a side is where the thing is left."""


def placed(items: Sequence[Any], seen: Sketch) -> tuple[Any, ...]:
    """Frames with their part, their objects and their side as the words say them; edits stay.

    Args:
        items: What was read.
        seen: The sentence.
    """
    about = (seen.pieces if len(items) == 1 else _about(item, seen) for item in items)
    return tuple(
        _told(item, pieces, seen) if isinstance(item, SemanticFrame) else item
        for item, pieces in zip(items, about, strict=True)
    )


def _about(item: Any, seen: Sketch) -> Sequence[Fragment]:
    """The clauses that name what an item is about; of one that is about no thing, all of them."""
    named = {*item.named} if isinstance(item, SemanticFrame) else set()
    clauses: list[list[Fragment]] = [[]]
    for piece in seen.pieces:
        clauses += [[]] if piece.text.lower() in PAUSES else []
        clauses[-1].append(piece)
    held = [{name for p in clause if p.mention >= 0 for name in seen.mentions[p.mention].items} for clause in clauses]
    own = (clause for clause, names in zip(clauses, held, strict=True) if not named.isdisjoint(names))
    return [piece for clause in own for piece in clause] or seen.pieces


def _told(item: SemanticFrame, pieces: Sequence[Fragment], seen: Sketch) -> SemanticFrame:
    """A frame with what the clauses say that it is said in."""
    words = [piece.text.lower() for piece in pieces]
    if isinstance(item, Side) and item.direction in SIDES.values() and (beside := _lies_on(words) or _kept_off(words)):
        item = replace(item, direction=OPPOSITES[beside], along=False)
    item = _called(item, frozenset(words))
    if isinstance(item, Approach | Clearance) and (rest := _all_but(item.objects, seen)):
        spared = item.part.parts[0].places if item.part.kind == "outside" else ()
        item = replace(item, objects=rest, part=WHOLE if {*spared} & {*item.objects} else item.part)
    part = _placed(item.part, words, seen)
    return item if part is item.part else replace(item, part=part)


def _called(item: SemanticFrame, words: frozenset[str]) -> SemanticFrame:
    """A circle that is called one and no eight, a pass that skims, a speed to slow down to and not steadily."""
    match item:
        case Figure(shape="eight") if ROUND & words and not EIGHTS & words:
            return replace(item, shape="circle")
        case Visit(relation="over" | "under", by=None) if SKIMMING & words:
            return replace(item, degree="slight")
        case Pace(change="rampdown", amount=Quantity(value=speed)) if speed > 0.0 and not STEADILY & words:
            return replace(item, change="slower")
    return item


ROUND = frozenset("circle circles ring loop".split())
EIGHTS = frozenset("eight eights figure loops lemniscate infinity".split())
"""Words for figures that are taken for each other."""

SKIMMING = frozenset("skim skims skimming graze grazes grazing barely low".split())
STEADILY = frozenset(
    "gradually gradual steadily steady progressively slowly ramp taper ease linearly evenly towards end bit".split()
)
"""Words for a close pass over a thing, and for a speed that sinks all along."""


def _lies_on(words: Sequence[str]) -> str:
    """The side on which a thing is to lie, seen from the robot: "with the cup on your left", "leave it to port"."""
    left = next((i for i, word in enumerate(words) if word in ("leave", "leaving")), len(words))
    text, behind = " ".join(words), " ".join(words[left : left + NEAR])
    for side, port in (("left", "port"), ("right", "starboard")):
        own = any(f"on {whose} {side}" in text for whose in ("your", "my", "our")) and not LAID.isdisjoint(words)
        lain = any(phrase in behind for phrase in (f"on the {side}", f"on its {side}", f"to {port}"))
        if own or (lain and f"{side} of" not in text and f"{port} of" not in text):
            return side
    return ""


def _kept_off(words: Sequence[str]) -> str:
    """The side of a thing that is denied: "never go to the left of the vase"; "" where none is."""
    words = [word for word in words if word != "side"]
    for i, (word, behind) in enumerate(pairwise(words)):
        clause = max((k + 1 for k in range(i) if words[k] in PAUSES), default=0)
        end = next((k for k in range(i, len(words)) if words[k] in PAUSES), len(words))
        denied = not DENIED.isdisjoint(words[max(i - 5, clause) : i]) or words[end - 1] == "never"
        if word in SIDES and behind == "of" and denied:
            return SIDES[word]
    return ""


def _placed(part: PathPart, words: Sequence[str], seen: Sketch) -> PathPart:
    match part:
        case PathPart(kind="beyond", direction="up" | "down") if HEIGHTS.isdisjoint(words):
            sides = {SIDES[word] for word in words if word in SIDES}
            amount = None if part.amount is None else abs(part.amount)  # lower than 20 cm is more than -20 cm down
            return replace(part, direction=sides.pop(), amount=amount) if len(sides) == 1 else part
        case PathPart(kind="first" | "last" | "middle", unit="share", amount=float() as share):
            return _counted(part, share, seen)
        case PathPart(kind="first" | "last", amount=None):
            return _half(part, words)
    return part


def _counted(part: PathPart, share: float, seen: Sketch) -> PathPart:
    """The second, third ... of equal shares of the path, and what comes after a share of it."""
    pieces = seen.pieces
    for i, piece in enumerate(pieces):
        mention = seen.mentions[piece.mention] if piece.mention >= 0 else None
        if i and mention is not None and mention.unit == "%" and mention.value == share:
            before, behind = (pieces[k].text.lower() if 0 <= k < len(pieces) else "" for k in (i - 1, i + 1))
            k, n = COUNTED.get(before, 0), round(1.0 / share)
            if 1 < k < n:
                return PathPart("range", amount=(k - 1) / n, until=k / n, unit="share")
            if part.kind == "last" and before == "from" and behind in ("on", "onward", "onwards"):
                return PathPart("range", amount=share, unit="share")
    return part


def _half(part: PathPart, words: Sequence[str]) -> PathPart:
    """The half of the path that begins or ends in the middle: "from halfway on", "until the midpoint"."""
    plain = [word for word in words if word not in DETERMINERS and word != "half"]
    ahead = {before for before, word in pairwise(plain) if word in MIDDLES}
    if part.kind == "last" and ahead & SINCE:
        return PathPart("range", amount=0.5, unit="share")
    return PathPart("range", amount=0.0, until=0.5, unit="share") if part.kind == "first" and ahead & UNTIL else part


def _all_but(objects: Sequence[str], seen: Sketch) -> tuple[str, ...]:
    """All objects but these, where words say that they alone are left out; () elsewhere."""
    words = [piece.text.lower() for piece in seen.pieces if piece.text.lower() not in DETERMINERS]
    marks = [piece.mention for piece in seen.pieces if piece.text.lower() not in DETERMINERS]
    named = [i for i, mention in enumerate(marks) if mention >= 0 and {*seen.mentions[mention].items} == {*objects}]
    left_out = any(_are_left_out(words, i) for i in named)
    return tuple(name for name in seen.names if name not in objects) if left_out else ()


def _are_left_out(words: Sequence[str], i: int) -> bool:
    """Whether words right before word i leave it out of all: "all but", "everything other than"."""
    spared = words[i - 1 : i] and words[i - 1] in EXCEPT
    phrase = tuple(words[max(i - 2, 0) : i]) in OTHER_THAN
    whole = words[max(i - 5, 0) : max(i - 1, 0)]
    return bool(spared or phrase) and any(word in ALL or word.startswith("<all") for word in whole)
