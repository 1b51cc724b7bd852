"""Clauses that leave out what they are about: "move the goal 0.1 up and 0.2 left" says "the goal" once."""

from __future__ import annotations

from dataclasses import replace

from ovita.instruct.draft import OPPOSITE
from ovita.instruct.intents import WHOLE, Intent, Region
from ovita.instruct.neighbours import DIRECTIONS
from ovita.instruct.reader import Reader

MOVED = ("move", "move_start", "move_goal", "extend")

OWN = frozenset("path trajectory route whole everything all robot arm drone rover vehicle gripper".split())
"""Words that say what a clause is about."""

DEEDS = frozenset(
    "go move shift fly drive travel walk steer navigate bring take translate head come nudge displace run keep".split()
)

PARTS = ("first", "last", "middle", "range", "every")

GOING_ON = ("wait", "circle", "spiral", "eight", "hover", "hop", "through")
"""What happens at a place, after which the path goes on by itself."""


def completed(r: Reader, found: list[Intent], earlier: list[Intent]) -> list[Intent]:
    """Give a shift that names nothing the end or the part of the path that the clause before was about.

    An end takes the directions too, so its earlier intent in `earlier` is replaced.
    """
    if not earlier or len(found) != 1 or found[0].region != WHOLE:
        return found
    last = earlier[-1]
    if found[0].action == "speed" and last.region.kind in PARTS and "them" in r.text.lower().split():
        return [replace(found[0], region=last.region)]
    if found[0].action != "move":
        return found
    if last.action not in MOVED or not _says_only_where_to(r, last):
        return found
    if last.action == "move":
        if last.region == WHOLE:
            return found
        opposed = {OPPOSITE[d] for d, _ in last.directions} & {d for d, _ in found[0].directions}
        if opposed and last.region.kind in ("before", "first", "after", "last"):
            return [replace(found[0], region=Region("rest"))]  # "lower until the cup, then higher"
        earlier[-1] = replace(last, directions=(*last.directions, *found[0].directions))
        return []
    if last.action == "extend":
        return [replace(found[0], action="extend")]
    for k, intent in enumerate(earlier):
        if intent.text == last.text and intent.action in ("move_start", "move_goal"):
            earlier[k] = replace(intent, directions=(*intent.directions, *found[0].directions))
    return []


def _says_only_where_to(r: Reader, last: Intent) -> bool:
    words = [t.text.lower() for t in r.tokens]
    plain = all(t.kind in ("filler", "join", "break", "number") or t.value in _SAID for t in r.tokens)
    deed = any(w in DEEDS for w in words[:2])
    again = any(w in ("it", "them") for w in words) and (last.action != "move" or last.region.kind in PARTS)
    return plain and not OWN & set(words) and (not deed or again)


_SAID = frozenset({*DIRECTIONS, "slight", "large", "more"})


def located(r: Reader, found: list[Intent], earlier: list[Intent]) -> list[Intent]:
    """Read "there" as at or near the objects, or in the part, that were named last; else it stays unplaced."""
    last = next((i for i in reversed(earlier) if i.items or i.region != WHOLE), None)
    if last is None:
        return found
    items = last.items or last.region.items
    placed = []
    for intent in found:
        if items and intent.action in ("wait", "stop", "spiral", "eight") and not intent.items:
            intent = replace(intent, items=items[:1], mode="")
        elif intent.region == WHOLE and intent.action == "speed":
            intent = replace(intent, region=last.region if last.region != WHOLE else Region("near", items))
        elif intent.region == WHOLE and intent.action == "move" and last.region != WHOLE:
            intent = replace(intent, region=last.region)
        elif intent.action in ("wait", "stop", "spiral", "eight", "speed", "move"):
            return found
        placed.append(intent)
    r.take("there")
    return placed


def nothing_more(r: Reader, earlier: list[Intent]) -> bool:
    """Take what asks for nothing more: "and then carry on", "and go back to the original speed"."""
    said = {t.value or t.text for t in r.tokens if t.kind not in ("filler", "join", "break")}
    last = earlier[-1]
    partly = last.action == "speed" and last.region != WHOLE
    resumed = (said & {"undo", "extend"} and said & {"speed", "original"}) or {"same", "speed"} <= said
    resumed = resumed or (partly and "original" in said and "speed" in said)
    if partly and resumed and said <= {"undo", "extend", "speed", "original", "afterwards", "keep", "same"}:
        return bool(r.take(*said))
    if last.action == "move" and "height" in said and said <= {"hold", "wait", "keep", "stay", "height", "same"}:
        return bool(r.take(*said))
    if last.action in GOING_ON and said and said <= {"extend", "afterwards", "whole"}:
        return bool(r.take(*said))
    return False


def afterwards(r: Reader, found: list[Intent], earlier: list[Intent]) -> list[Intent]:
    """Read "5 m/s until the tree and 3 m/s afterwards": what follows is about the rest of the path."""
    if not earlier or not r.hears("afterwards", "thereafter") or earlier[-1].region.kind not in ("before", "first"):
        return found
    rest = Region("rest")
    return [replace(i, region=rest) if i.action in ("move", "speed") and i.region == WHOLE else i for i in found]


def spared(intents: list[Intent]) -> list[Intent]:
    """Leave a part that is to stay as it is out of the changes of the whole path."""
    kept = [i.region for i in intents if i.action == "same" and i.mode == "part" and not i.region.outside]
    if len(kept) != 1:
        return intents
    rest = replace(kept[0], outside=True)
    return [replace(i, region=rest) if i.action in ("move", "speed") and i.region == WHOLE else i for i in intents]
