"""From an instruction to intents, clause by clause, with ellipsis."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Literal

from ovita.instruct.clauses import ACTIONS, Reader, split
from ovita.instruct.distances import read_approach, read_keep_distance
from ovita.instruct.intents import WHOLE, Intent, Region, Understood
from ovita.instruct.places import (
    changes,
    in_frame,
    read_aim,
    read_axis,
    read_endpoint,
    read_extend,
    read_kept,
    read_level,
    read_move,
    read_resample,
    read_return,
    read_smooth,
    read_through,
    read_wait,
)
from ovita.instruct.senses import DIRECTIONS
from ovita.instruct.shapes import SHAPES
from ovita.instruct.speeds import read_speed
from ovita.instruct.tokens import CHOICE, Token, tokenize
from ovita.paths.frame import OPPOSITE
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory

MOVED = ("move", "move_start", "move_goal", "extend")

OWN = frozenset("path trajectory route whole everything all robot arm drone rover vehicle gripper".split())
"""Words that say what a clause is about."""

DEEDS = frozenset(
    "go move shift fly drive travel walk steer navigate bring take translate head come nudge displace run keep".split()
)

STRETCHES = ("first", "last", "middle", "range", "every")

ALL_OVER = ("everywhere", "everything", "overall", "whole", "all", "altogether", "path")

GOING_ON = ("wait", "circle", "spiral", "eight", "hover", "hop", "through")
"""What happens at a place, after which the path goes on by itself."""


def completed(r: Reader, found: list[Intent], earlier: list[Intent]) -> list[Intent]:
    """Give a shift that names nothing the end or the part of the path that the clause before was about.

    An end takes the directions too, so its earlier intent in `earlier` is replaced.
    """
    if not earlier or len(found) != 1 or found[0].region != WHOLE:
        return found
    last = earlier[-1]
    if found[0].action == "speed" and last.region.kind in STRETCHES and "them" in r.text.lower().split():
        return [replace(found[0], region=last.region)]
    if found[0].action == last.action == "speed" and last.region.kind in ("before", "first", "after", "last"):
        turned = {_pace(found[0]), _pace(last)} == {"slower", "faster"} and not r.any_word(*ALL_OVER)
        return [replace(found[0], region=Region("rest"))] if turned else found  # "speed up until the cup, then slow"
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


def _pace(intent: Intent) -> str:
    """Whether a change of speed is "slower" or "faster", or "" where it does not say."""
    neutral = {"factor": 1.0, "add": 0.0}.get(intent.mode)
    if neutral is not None and intent.amount is not None:
        return "slower" if intent.amount < neutral else "faster"
    return {"ramp_down": "slower", "ramp_up": "faster"}.get(
        intent.mode, intent.mode if intent.mode in ("slower", "faster") else ""
    )


def _says_only_where_to(r: Reader, last: Intent) -> bool:
    words = [t.text.lower() for t in r.tokens]
    plain = all(t.kind in ("filler", "join", "break", "number") or t.value in _SAID for t in r.tokens)
    deed = any(w in DEEDS for w in words[:2])
    again = any(w in ("it", "them") for w in words) and (last.action != "move" or last.region.kind in STRETCHES)
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
    r.consume("there")
    return placed


def nothing_more(r: Reader, earlier: list[Intent]) -> bool:
    """Take what asks for nothing more: "and then carry on", "and go back to the original speed"."""
    said = {t.value or t.text for t in r.tokens if t.kind not in ("filler", "join", "break")}
    last = earlier[-1]
    partly = last.action == "speed" and last.region != WHOLE
    resumed = (said & {"undo", "extend"} and said & {"speed", "original"}) or {"same", "speed"} <= said
    resumed = resumed or (partly and "original" in said and "speed" in said)
    if partly and resumed and said <= {"undo", "extend", "speed", "original", "afterwards", "keep", "same"}:
        return bool(r.consume(*said))
    if last.action == "move" and "height" in said and said <= {"hold", "wait", "keep", "stay", "height", "same"}:
        return bool(r.consume(*said))
    if last.action in GOING_ON and said and said <= {"extend", "afterwards", "whole"}:
        return bool(r.consume(*said))
    return False


def afterwards(r: Reader, found: list[Intent], earlier: list[Intent]) -> list[Intent]:
    """Read "5 m/s until the tree and 3 m/s afterwards": what follows is about the rest of the path."""
    if not earlier or not r.any_word("afterwards", "thereafter") or earlier[-1].region.kind not in ("before", "first"):
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


def contradiction(intents: Sequence[Intent]) -> str:
    """A question about two contradictory requests, or "".

    Shifts count only where both are about the same part of the path.
    """
    for i, one in enumerate(intents):
        words = [d for d, _ in one.directions]
        own = next((d for d in words if OPPOSITE[d] in words), None) if one.action in ("move", "extend") else None
        if own is not None:
            return f"Both {own} and {OPPOSITE[own]}: which way should the path go?"
        for other in intents[i + 1 :]:
            question = _between(one, other)
            if question:
                return question
    return ""


def _between(one: Intent, other: Intent) -> str:
    same_part = one.region == other.region
    if one.action == other.action and one.action in ("move", "move_start", "move_goal") and same_part:
        opposed = [d for d, _ in one.directions if OPPOSITE[d] in [word for word, _ in other.directions]]
        if opposed:
            return f"Both {opposed[0]} and {OPPOSITE[opposed[0]]}: which way should the path go?"
    if {one.action, other.action} == {"closer", "farther"} and same_part and one.items[0] is other.items[0]:
        return f"Both closer to {one.items[0].name} and farther from it: which of the two?"
    if one.action == other.action == "speed" and same_part and {one.mode, other.mode} == {"slower", "faster"}:
        return "Both slower and faster: which of the two?"
    return _no_room(one, other)


def _no_room(one: Intent, other: Intent) -> str:
    """A question about two bounds that leave nothing between them: "above 0.2 and never higher than 0.15"."""
    for low, high in ((one, other), (other, one)):
        least, most = _bound_of(low, "least"), _bound_of(high, "most")
        if least and most and least[0] == most[0] and least[1] > most[1] + 1e-9:
            return f"At least {least[1]:g} and at most {most[1]:g} {least[2]} leave nothing between: which of the two?"
    return ""


def _bound_of(intent: Intent, side: Literal["least", "most"]) -> tuple[object, float, str] | None:
    """What an intent bounds from below ("least") or above ("most"): the quantity, its limit, and its unit."""
    if intent.action == "bound" and intent.directions:
        word, limit = intent.directions[0]
        axis = ("left", "front", "down").index(word) if word in ("left", "front", "down") else -1
        word, kind = (OPPOSITE[word], "least") if axis >= 0 else (word, "most")
        value = (limit or 0.0) * (-1.0 if axis >= 0 else 1.0)
        return (word, value, "m") if kind == side else None
    if intent.action == "height" and intent.amount is not None and intent.region == WHOLE:
        return "up", intent.amount, "m"
    if intent.action == "speed" and intent.amount is not None and intent.mode in ("cap", "floor", "set"):
        counts = intent.mode != ("cap" if side == "least" else "floor")
        return (("speed", intent.region), intent.amount, "m/s") if counts else None
    if intent.action == "keep_distance" and intent.amount is not None and len(intent.items) == 1:
        counts = intent.mode == f"at_{side}"
        return (("distance", intent.items[0].name, intent.region), intent.amount, "m") if counts else None
    return None


def standing(intents: Sequence[Intent], trajectory: Trajectory) -> str:
    """The question to ask when a relative speed change meets a trajectory without speeds, or ""."""
    relative = any(i.action == "speed" and i.mode in ("slower", "faster", "factor", "turns") for i in intents)
    if relative and not (trajectory.speeds > 0).any():
        return "All speeds of this trajectory are 0, so slower or faster means nothing here: how many m/s should it be?"
    return ""


REMAINING = ("rest", "the rest", "remainder", "rest of", "remaining")

HARMLESS = ("only", "whole", "stay", "original", "always", "afterwards", "keep")
"""Concepts that a clause may hold beside what its rule took."""


def read_instruction(instruction: str, scene: Scene, path: Array | None = None) -> Understood:
    """Read an instruction.

    Args:
        instruction: As written.
        scene: Whose objects it may name.
        path: Positions (N, 3) [m], for phrases such as "the object nearest to the goal".

    Returns:
        The intents in the order of the sentence, notes on corrected spellings, and every word without a place.
    """
    tokens, notes = tokenize(instruction, scene, path)
    tokens, notes = _graded(tokens, notes)
    intents: list[Intent] = []
    unplaced: list[str] = []
    radius: float | None = None
    for clause in split(tokens):
        r = Reader(clause)
        if r.peek("threshold") and not _names_action(r) and not any(t.items for t in clause):
            r.consume("threshold")
            radius = r.number("", "m")
        elif not (intents and nothing_more(r, intents)):
            intents += _clause(r, intents)
        unplaced += r.left_over()
    if not intents and not unplaced:
        unplaced = instruction.split()
    intents = [in_frame(intent, scene.frame) for intent in intents]
    question = _choice(tokens) or ("" if unplaced else contradiction(intents))
    if not (question or unplaced or changes(intents)):
        question = "Everything is to stay as it is: what should change?"
    return Understood(tuple(spared(intents)), notes, tuple(unplaced), radius, question)


def _graded(tokens: tuple[Token, ...], notes: tuple[str, ...]) -> tuple[tuple[Token, ...], tuple[str, ...]]:
    """Read "the closer to the cup, the slower" as slower near the cup, and say so."""
    said = [t.text.lower() for t in tokens]
    mark = next((i for i, t in enumerate(tokens) if t.kind == "break" and said[i + 1 : i + 2] == ["the"]), None)
    if mark is None or said[:1] != ["the"] or tokens[1].value not in ("closer", "away") or len(tokens) < mark + 3:
        return tokens, notes
    if tokens[mark + 2].value not in ("slower", "faster") or not any(t.items for t in tokens[2:mark]):
        return tokens, notes
    place = [replace(tokens[1], value="near")]
    if tokens[1].value == "away":
        place = [Token("concept", tokens[0].text, value="except"), *place]
    near = tuple(t for t in tokens[2:mark] if t.kind == "filler" or t.items)
    note = f"took {' '.join(said).rstrip(' .')!r} as two speeds, near it and elsewhere, with nothing between"
    return (*tokens[mark + 2 :], *place, *near), (*notes, note)


def _clause(r: Reader, earlier: list[Intent]) -> list[Intent]:
    found = _read(r) or _same_again(r, earlier)
    if found and r.peek("there"):
        found = located(r, found, earlier)
    if found and _goes_on(found, earlier):
        found = [replace(intent, action="extend") for intent in found]
    found = afterwards(r, completed(r, found, earlier), earlier)
    return [_the_rest(r, intent, earlier) for intent in found]


def _choice(tokens: tuple[Token, ...]) -> str:
    """A clarification question where words fit several objects: "Which box: 'red box' or 'blue box'?"."""
    for token in tokens:
        if token.value == CHOICE and len(token.items) > 1:
            noun = token.text.split()[-1].lower()
            return f"Which {noun}: {' or '.join(repr(item.name) for item in token.items)}?"
    return ""


def _names_action(r: Reader) -> bool:
    return r.peek("near", "distance", *ACTIONS)


def _same_again(r: Reader, earlier: list[Intent]) -> list[Intent]:
    """Read "double the speed but halve it near the cup": a change of what the clause before was about."""
    if not earlier or earlier[-1].action != "speed" or not r.peek("half", "double", "increase", "decrease"):
        return []
    return [replace(intent, text=r.text) for intent in r.attempt(lambda reader: read_speed(reader, implied=True))]


def _goes_on(found: list[Intent], earlier: list[Intent]) -> bool:
    """Read "after the goal go up and then left": the second shift goes on from the first."""
    beyond = bool(earlier) and earlier[-1].action == "extend" and bool(earlier[-1].directions)
    return beyond and earlier[-1].text.lower().startswith("after") and [i.action for i in found] == ["move"]


def _the_rest(r: Reader, intent: Intent, earlier: list[Intent]) -> Intent:
    """Resolve "the rest" and "the second" to what the clause before was not about; else to the second half."""
    if intent.region.kind != "rest":
        return intent
    last = next((i.region for i in reversed(earlier) if i.region.kind in ("first", "last", "after", "before")), None)
    kept = [i for i in earlier if i.action == "same" and i.mode in ("start", "goal")]
    if last is None and kept and r.any_word(*REMAINING):
        return replace(intent, region=WHOLE)  # "keep the goal, but shift the rest": the goal stays by itself
    if last is None:
        return replace(intent, region=Region("last", amount=0.5))
    if last.kind in ("after", "before"):
        return replace(intent, region=replace(last, kind="before" if last.kind == "after" else "after"))
    other = "last" if last.kind == "first" else "first"
    if last.counted or last.unit:
        return replace(intent, region=replace(last, kind=f"but_{last.kind}"))
    return replace(intent, region=Region(other, amount=1.0 - (last.amount or 0.5)))


def _read(r: Reader) -> list[Intent]:
    for rule in RULES:
        found = r.attempt(rule)
        if found:
            r.consume(*HARMLESS)
            return [replace(intent, text=r.text) for intent in found]
    return []


RULES: tuple[Callable[[Reader], list[Intent]], ...] = (
    read_kept,
    read_aim,
    read_level,
    read_resample,
    *SHAPES,
    read_keep_distance,
    read_speed,
    read_wait,
    read_return,
    read_extend,
    read_smooth,
    read_approach,
    read_endpoint,
    read_through,
    read_axis,
    read_move,
)
"""The families, tried in this order; the first that explains a clause reads it."""
