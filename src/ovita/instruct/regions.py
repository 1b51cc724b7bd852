"""Reading the part of the path that a clause is about: near the cup, the first 5 waypoints, after the fan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ovita.instruct.clauses import Reader
from ovita.instruct.intents import WHOLE, Region
from ovita.instruct.senses import DIRECTIONS
from ovita.instruct.tokens import Token

ORDINALS = "first second third fourth fifth sixth seventh eighth ninth tenth".split()
NOUNS = {"descent": "down", "ascent": "up", "climb": "up"}
"""Words that name a part of the path by where it heads."""

SHARES = {"half": 0.5, "third": 1 / 3, "quarter": 0.25, "fifth": 0.2, "tenth": 0.1}

LINKING = ("reach", "pass", "near", "when", "around")


def read_region(r: Reader, *, speed: bool) -> Region:
    """Take the words that name a part of the path.

    Args:
        r: The clause.
        speed: Whether the clause is about speed; then "near the goal" and "when going up" are parts of the path.
    """
    outside = r.consume("except")
    readings = (_beyond, _single, _every, _range, _count, _share, _near if not speed else _at_or_near, _order, _middle)
    for reading in readings:
        before = list(r.taken)
        region = reading(r)
        if region is not None:
            if outside:
                r.consume("whole")
            return replace(region, outside=outside)
        r.taken = before
    if outside:
        r.release("except")
    between = _between(r, needs_when=not speed)
    if between is not None or not speed:
        return between or WHOLE
    return _heading(r) or _end(r) or WHOLE


def _beyond(r: Reader) -> Region | None:
    """When you are higher than 1 m; while below 0.5 m; where it is more than 2 m to the left."""
    i = r.find("when")
    sides = [k for k, t in enumerate(r.tokens) if t.value in (*DIRECTIONS, "over", "under") and not r.taken[k]]
    side = next((k for k in sides if i is not None and k > i), None)
    number = next((k for k in r.numbers(("m", "")) if side is not None and i is not None and k > i), None)
    if i is None or side is None or number is None or any(t.items for t in r.tokens[i:]):
        return None
    token = r.tokens[side]
    compared = token.value in ("over", "under") or r.find("than") is not None or r.find("at_least") is not None
    if not compared or any(t.kind == "concept" and t.value not in BEYOND for t in r.tokens[i + 1 : number]):
        return None
    for k in range(i, number + 1):
        r.taken[k] = True
    r.consume("ground", "height")
    word = {"over": "up", "under": "down"}.get(token.value, token.value)
    amount = r.tokens[number].number
    sunk = token.text.lower().startswith("deep")
    return Region("beyond", amount=-amount if word == "down" and not sunk else amount, direction=word)


def _single(r: Reader) -> Region | None:
    """The third waypoint; the 12th point."""
    i = next((k for k, t in enumerate(r.tokens) if t.value == "waypoints" and not r.taken[k]), None)
    j = r.before(i) if i is not None else None
    if i is None or j is None or r.taken[j] or r.tokens[i].text.lower().endswith("s"):
        return None
    text = r.tokens[j].text.lower()
    if text in ORDINALS[1:] and r.word_before(j) != "every" and not r.peek("every"):
        which = float(ORDINALS.index(text) + 1)
    elif r.tokens[j].kind == "number" and not r.tokens[j].unit and r.word_before(j) == "the":
        which = r.tokens[j].number
    else:
        return None
    r.consume_at(i), r.consume_at(j)
    return Region("range", amount=which, counted=True, until=which)


BEYOND = frozenset({*DIRECTIONS, "over", "under", "than", "at_least", "height", "more", "ground", "away", "no_closer"})
"""Concepts that may stand between "when" and the number of a place along a direction."""


def _every(r: Reader) -> Region | None:
    i = r.find("every")
    j = r.after(i) if i is not None else None
    if i is None or j is None:
        return None
    token = r.tokens[j]
    k: float | None = token.number if token.kind == "number" else {"second": 2.0, "third": 3.0}.get(token.value)
    if k is None or not r.peek("waypoints"):
        return None
    r.consume_at(i), r.consume_at(j)
    r.consume("waypoints")
    return Region("every", amount=k, counted=True)


def _range(r: Reader) -> Region | None:
    """Between waypoint 10 and 30; waypoints 31 to 40; from waypoint 12 on."""
    i = r.find("waypoints")
    numbers = [k for k in r.numbers(("",)) if i is not None and k > i]
    if i is None or not numbers or r.after(i) != numbers[0] or r.peek("count", "increase", "decrease"):
        return None
    counted = r.before(i)
    if counted is not None and r.tokens[counted].kind == "number" and r.tokens[counted].unit == "":
        return None
    if r.word_before(numbers[0]) in ("by", "to", "of", "be", "go"):
        return None
    first = r.consume_at(numbers[0]).number
    rest = numbers[1:]
    r.consume("waypoints", "between", "start", "before", "through", "every") if rest else r.consume("waypoints")
    if rest:
        link = r.tokens[numbers[0] + 1 : rest[0]]
        ranged = any(t.text.lower() in ("to", "through", "thru", "until", "till", "up to") for t in link)
        if not (ranged or r.any_word("between")) and r.tokens[rest[0]].number != first + 1:
            return None  # "waypoints 5 and 10" are two of them
        return Region("range", amount=first, counted=True, until=r.consume_at(rest[0]).number)
    if r.consume("before"):
        return Region("first", amount=first, counted=True)
    if r.consume("after", "onwards") or r.peek_word("onwards", "onward", "on"):
        for k, token in enumerate(r.tokens):
            r.taken[k] = r.taken[k] or token.text.lower() in ("onwards", "onward", "on")
        r.consume("start")
        return Region("range", amount=first, counted=True)
    return Region("range", amount=first, counted=True, until=first)


def _count(r: Reader) -> Region | None:
    """The first 5 waypoints; the 12 last ones; the first 30 %; the last 0.4 m; the first two seconds."""
    for word in ("first", "last", "goal", "start"):
        i = r.find(word)
        for j in (r.after(i), r.before(i)) if i is not None else ():
            if i is None or j is None or r.taken[j] or r.tokens[j].kind != "number":
                continue
            plural = r.tokens[i].text.lower().endswith(("points", "samples"))  # "the 10 last waypoints"
            if j < i and not plural and (not r.peek("waypoints") or r.after(i) != r.find("waypoints")):
                continue
            unit = r.tokens[j].unit
            points = unit == "" and (r.peek("waypoints") or plural)
            if not (unit == "%" or points or (word in ("first", "last") and unit in ("m", "s", "step") and j == i + 1)):
                continue
            r.consume_at(i)
            number = r.consume_at(j).number
            r.consume("waypoints", "when")
            kind = {"goal": "last", "start": "first"}.get(word, word)
            length = unit if unit in ("m", "s") else ""
            return Region(kind, amount=number, counted=points or unit == "step", unit=length)
    return None


def _share(r: Reader) -> Region | None:
    """The first half; the last third; the middle quarter; the second half; the rest."""
    for word in ("first", "second", "last", "middle", "start", "goal"):
        i = r.find(word)
        j = r.after(i) if i is not None else None
        if i is None or j is None or r.taken[j] or r.tokens[j].value not in SHARES:
            continue
        if word == "second" and r.tokens[j].value != "half":
            continue
        r.consume_at(i)
        share = SHARES[r.consume_at(j).value]
        r.consume("before", "after", "waypoints", "when")
        if word == "middle":
            return Region("middle", amount=share)
        return Region("first" if word in ("first", "start") else "last", amount=share)
    i = r.find("second")
    if i is not None and {"second", "rest", "remaining", "remainder", "latter"} & set(r.tokens[i].text.lower().split()):
        r.consume_at(i)
        r.consume("waypoints")
        return Region("rest")
    for word in ("first", "last"):
        i = r.find(word)
        if i is None or (word == "first" and r.peek("start")):
            continue
        j = r.after(i)
        if j is not None and not r.taken[j] and r.tokens[j].kind == "number":
            continue
        single = j is not None and r.tokens[j].text.lower() in ("waypoint", "point")
        r.consume_at(i)
        r.consume("waypoints")
        return Region(word, amount=1.0, counted=True) if single else Region(word)
    return None


def _at_or_near(r: Reader) -> Region | None:
    """Near the cup, or at the cup, or by it."""
    region = _near(r)
    if region is not None:
        return region
    for i, token in enumerate(r.tokens):
        if not token.items or r.taken[i]:
            continue
        before = [t.text.lower() for t in r.tokens[max(i - 2, 0) : i]]
        if before and (before[-1] in ("at", "by") or before[-2:] in (["at", "the"], ["by", "the"])):
            return Region("near", r.objects_from(i))
        j = r.before(i)
        k = r.before(j) if j is not None else None
        if j is not None and r.tokens[j].value in ("around", "over", "pass", "under", "toward", "reach"):
            if k is None or r.tokens[k].value not in ("after", "before"):
                r.consume_at(j)
                return Region("near", r.objects_from(i))
    return None


def _near(r: Reader) -> Region | None:
    """Near the cup; within 0.3 of the cup; when passing the cup."""
    found = _within(r)
    if found is not None:
        return found
    i = r.find("near")
    if i is None and r.peek("pass") and r.peek("when"):
        i = r.find("pass")
    if i is None and r.peek("when"):
        i = r.find("reach")
    if i is None and r.peek("when"):
        i = next((k for k, t in enumerate(r.tokens) if t.value == "closer" and not r.taken[k]), None)
    j = r.after(i) if i is not None else None
    while j is not None and r.tokens[j].value in ("reach", "near", "pass"):
        j = r.after(j)
    if i is not None and (j is None or not r.tokens[j].items) and r.peek("when"):
        j = r.before(i)  # "when the cup is near"
    if i is None or j is None or not r.tokens[j].items:
        return None
    items = r.objects_from(j)
    r.consume_at(i)
    r.consume("near", "pass", "when", "reach", "only", "after" if r.find("after") == r.before(i) else "only")
    stated = r.number("m", "") if r.consume("threshold") else None
    if stated is None:
        beside = [n for n in r.numbers(("m",)) if n < j and r.word_before(n) not in ("by", "to", "of", "at")]
        stated = r.consume_at(beside[0]).number if beside and r.peek("slower", "faster") else None
    return Region("near", items, stated)


def _within(r: Reader) -> Region | None:
    """Within 0.3 of the cup; less than 30 cm from it; in a 0.3 m radius around it."""
    numbers = r.numbers(("", "m"))
    for word in ("within", "at_most", "threshold", "under"):
        i = r.find(word)
        if i is None or (word == "under" and not r.peek("distance")):
            continue
        beside = [n for n in numbers if n > i] or [n for n in numbers if word == "threshold" and n < i]
        if not beside or (
            word == "at_most" and not r.peek("away", "distance", "near", "when") and r.word_before(i) == "to"
        ):
            continue
        r.consume_at(i)
        radius = r.consume_at(beside[0]).number
        r.consume(
            "near",
            "when",
            "pass",
            "reach",
            "only",
            "distance",
            "threshold",
            "around",
            "away",
            "closer",
            "within",
            "than",
            "after",
        )
        items = r.objects_from(r.after(beside[0])) or r.objects()
        return Region("near", items, radius) if items else None
    return None


def _order(r: Reader) -> Region | None:
    """After the plate; before the cup; until the fan; from the cup onwards."""
    for word in ("after", "before"):
        i = r.find(word)
        if i is None:
            continue
        j = r.after(i)
        while j is not None and r.tokens[j].value in LINKING:
            j = r.after(j)
        if j is None:
            continue
        if r.tokens[j].items and not r.taken[j]:
            r.consume(word, *LINKING)
            return Region(word, r.objects_from(j))
        if r.tokens[j].value == "middle":
            r.consume(word, "middle", "reach", "pass", "when")
            return Region("last" if word == "after" else "first", amount=0.5)
        if r.tokens[j].value in SHARES and r.tokens[j].text.lower() == "half":
            continue
    for i, token in enumerate(r.tokens):
        behind = i + 1 if i + 1 < len(r.tokens) else None
        later = r.tokens[behind].text.lower() if behind is not None else ""
        if (
            token.items
            and not r.taken[i]
            and r.word_before(i) in ("from", "the")
            and (later in ("onwards", "onward") or (later == "on" and "from" in _two_before(r, i)))
        ):
            r.taken[behind or 0] = True
            return Region("after", r.objects_from(i))
    return None


def _two_before(r: Reader, i: int) -> list[str]:
    return [t.text.lower() for t in r.tokens[max(i - 2, 0) : i]]


def _between(r: Reader, *, needs_when: bool) -> Region | None:
    """Between the fan and the chair, as a part of the path; as a place it is read by the action."""
    i = r.find("between")
    if i is None or (needs_when and not r.peek("when", "pass")):
        return None
    end = next((word for word in ("start", "goal") if r.peek(word)), "")
    items = r.objects_from(next((k for k in range(i, len(r.tokens)) if r.tokens[k].items), None))
    if len(items) == 1 and end:
        r.consume("between", "when", "pass", end)
        return Region("before" if end == "start" else "after", items)
    if len(items) != 2:
        return None
    r.consume("between", "when", "pass")
    return Region("between", items)


def _middle(r: Reader) -> Region | None:
    i = r.find("middle")
    if i is None:
        return None
    until = r.word_before(i) in ("until", "till", "to")
    onwards = [
        k for k in (i + 1, i + 2) if k < len(r.tokens) and r.tokens[k].text.lower() in ("on", "onwards", "onward")
    ]
    if onwards and r.tokens[max(i - 2, 0)].text.lower() == "from":
        r.consume("middle")
        r.taken[onwards[0]] = True
        return Region("last", amount=0.5)
    r.consume("middle")
    r.consume("when", "reach", "waypoints")
    return Region("first", amount=0.5) if until else Region("middle")


def _heading(r: Reader) -> Region | None:
    noun = next((k for k, t in enumerate(r.tokens) if named_heading(r.tokens, k) and not r.taken[k]), None)
    if noun is not None:
        r.consume("when")
        return Region("heading", direction=NOUNS[r.consume_at(noun).text.lower()])
    i = r.find("when")
    j = r.after(i) if i is not None else None
    if i is None or j is None or r.taken[j] or r.tokens[j].value not in DIRECTIONS:
        return None
    r.consume_at(i)
    return Region("heading", direction=r.consume_at(j).value)


def named_heading(tokens: Sequence[Token], i: int) -> bool:
    """Whether a noun such as "the descent" names the part of the path that heads there."""
    return tokens[i].text.lower() in NOUNS and i > 0 and tokens[i - 1].text.lower() in ("the", "its", "your", "during")


def _end(r: Reader) -> Region | None:
    i = r.find("goal")
    if i is not None and {"until", "till", "til"} & {t.text.lower() for t in r.tokens[:i]}:
        r.consume("goal", "before", "reach")
        return WHOLE
    for word, kind in (("goal", "last"), ("start", "first")):
        if r.consume(word):
            r.consume("near", "when", "reach", "before", "toward", "closer")
            return Region(kind)
    if r.peek("reach") and not any(t.items for t in r.tokens) and not r.peek("stop"):
        r.consume("reach", "when", "before")
        return Region("last")
    return None
