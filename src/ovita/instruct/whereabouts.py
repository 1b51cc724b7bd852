"""Which part of the path and which objects words mean that the network's places cannot say, or says by halves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

from ovita.instruct.frames import Approach, Clearance, SemanticFrame
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


def placed(item: Any, pieces: Sequence[Fragment], seen: Sketch) -> Any:
    """An item with its part and its objects as the words say them.

    Args:
        item: A frame, or an edit, which stays.
        pieces: The clauses that it is said in.
        seen: The sentence.
    """
    if not isinstance(item, SemanticFrame):
        return item
    if isinstance(item, Approach | Clearance) and (rest := _all_but(item.objects, seen)):
        spared = item.part.parts[0].places if item.part.kind == "outside" else ()
        item = replace(item, objects=rest, part=WHOLE if {*spared} & {*item.objects} else item.part)
    words = [piece.text.lower() for piece in pieces]
    part = _placed(item.part, words, seen)
    return item if part is item.part else replace(item, part=part)


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
    for i, mention in enumerate(marks):
        if mention < 0 or {*seen.mentions[mention].items} != {*objects}:
            continue
        left_out = words[i - 1] in EXCEPT if i else False
        phrase = tuple(words[max(i - 2, 0) : i]) in OTHER_THAN
        whole = words[max(i - 5, 0) : i - 1]
        if (left_out or phrase) and any(word in ALL or word.startswith("<all") for word in whole):
            return tuple(name for name in seen.names if name not in objects)
    return ()
