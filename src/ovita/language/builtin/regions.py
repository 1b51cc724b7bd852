"""Reading the part of the path that a clause is about: near the cup, the first 5 waypoints, after the fan."""

from __future__ import annotations

from ovita.language.builtin.intents import WHOLE, Region
from ovita.language.builtin.neighbours import DIRECTIONS
from ovita.language.builtin.reader import Reader

SHARES = {"half": 0.5, "third": 1 / 3, "quarter": 0.25, "fifth": 0.2, "tenth": 0.1}
END_SHARE = 0.25
"""Share of the waypoints that "at the end" or "at the start" means."""

LINKING = ("reach", "pass", "near", "when", "around")


def read_region(r: Reader, *, speed: bool) -> Region:
    """Take the words that name a part of the path.

    Args:
        r: The clause.
        speed: Whether the clause is about speed; then "near the goal" and "when going up" are parts of the path.
    """
    readings = (_every, _range, _count, _share, _near if not speed else _at_or_near, _order, _middle)
    for reading in readings:
        before = list(r.taken)
        region = reading(r)
        if region is not None:
            return region
        r.taken = before
    between = _between(r, needs_when=not speed)
    if between is not None or not speed:
        return between or WHOLE
    return _heading(r) or _end(r) or WHOLE


def _every(r: Reader) -> Region | None:
    i = r.find("every")
    j = r.after(i) if i is not None else None
    if i is None or j is None:
        return None
    token = r.tokens[j]
    k: float | None = token.number if token.kind == "number" else {"second": 2.0, "third": 3.0}.get(token.value)
    if k is None or not r.has("waypoints"):
        return None
    r.take_at(i), r.take_at(j)
    r.take("waypoints")
    return Region("every", amount=k, counted=True)


def _range(r: Reader) -> Region | None:
    """Between waypoint 10 and 30; waypoints 31 to 40; from waypoint 12 on."""
    i = r.find("waypoints")
    numbers = [k for k in r.numbers(("",)) if i is not None and k > i]
    if i is None or not numbers or r.after(i) != numbers[0] or r.has("count", "increase", "decrease"):
        return None
    counted = r.before(i)
    if counted is not None and r.tokens[counted].kind == "number" and r.tokens[counted].unit == "":
        return None
    if r.word_before(numbers[0]) in ("by", "to", "of", "be", "go"):
        return None
    first = r.take_at(numbers[0]).number
    rest = numbers[1:]
    r.take("waypoints", "between", "start", "before", "through") if rest else r.take("waypoints")
    if rest:
        return Region("range", amount=first, counted=True, until=r.take_at(rest[0]).number)
    if r.take("before"):
        return Region("first", amount=first, counted=True)
    if r.take("after", "onwards") or r.says("onwards", "onward", "on"):
        for k, token in enumerate(r.tokens):
            r.taken[k] = r.taken[k] or token.text.lower() in ("onwards", "onward", "on")
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
            if j < i and not plural and (not r.has("waypoints") or r.after(i) != r.find("waypoints")):
                continue
            unit = r.tokens[j].unit
            points = unit == "" and (r.has("waypoints") or plural)
            if not (unit == "%" or points or (word in ("first", "last") and unit in ("m", "s", "step") and j == i + 1)):
                continue
            r.take_at(i)
            number = r.take_at(j).number
            r.take("waypoints", "when")
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
        r.take_at(i)
        share = SHARES[r.take_at(j).value]
        r.take("before", "after", "waypoints", "when")
        if word == "middle":
            return Region("middle", amount=share)
        return Region("first" if word in ("first", "start") else "last", amount=share)
    i = r.find("second")
    if i is not None and {"second", "rest", "remaining", "remainder", "latter"} & set(r.tokens[i].text.lower().split()):
        r.take_at(i)
        r.take("waypoints")
        return Region("rest")
    for word in ("first", "last"):
        i = r.find(word)
        if i is None or (word == "first" and r.has("start")):
            continue
        j = r.after(i)
        if j is not None and not r.taken[j] and r.tokens[j].kind == "number":
            continue
        single = j is not None and r.tokens[j].text.lower() in ("waypoint", "point")
        r.take_at(i)
        r.take("waypoints")
        return Region(word, amount=1.0, counted=True) if single else Region(word, amount=END_SHARE)
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
                r.take_at(j)
                return Region("near", r.objects_from(i))
    return None


def _near(r: Reader) -> Region | None:
    """Near the cup; within 0.3 of the cup; when passing the cup."""
    found = _within(r)
    if found is not None:
        return found
    i = r.find("near")
    if i is None and r.has("pass") and r.has("when"):
        i = r.find("pass")
    if i is None and r.has("when"):
        i = r.find("reach")
    if i is None and r.has("when"):
        i = next((k for k, t in enumerate(r.tokens) if t.value == "closer" and not r.taken[k]), None)
    j = r.after(i) if i is not None else None
    while j is not None and r.tokens[j].value in ("reach", "near", "pass"):
        j = r.after(j)
    if i is not None and (j is None or not r.tokens[j].items) and r.has("when"):
        j = r.before(i)  # "when the cup is near"
    if i is None or j is None or not r.tokens[j].items:
        return None
    items = r.objects_from(j)
    r.take_at(i)
    r.take("near", "pass", "when", "reach", "only", "after" if r.find("after") == r.before(i) else "only")
    stated = r.number("m", "") if r.take("threshold") else None
    if stated is None:
        beside = [n for n in r.numbers(("m",)) if n < j and r.word_before(n) not in ("by", "to", "of", "at")]
        stated = r.take_at(beside[0]).number if beside and r.has("slower", "faster") else None
    return Region("near", items, stated)


def _within(r: Reader) -> Region | None:
    """Within 0.3 of the cup; less than 30 cm from it; in a 0.3 m radius around it."""
    numbers = r.numbers(("", "m"))
    for word in ("within", "at_most", "threshold", "under"):
        i = r.find(word)
        if i is None or (word == "under" and not r.has("distance")):
            continue
        beside = [n for n in numbers if n > i] or [n for n in numbers if word == "threshold" and n < i]
        if not beside or (
            word == "at_most" and not r.has("away", "distance", "near", "when") and r.word_before(i) == "to"
        ):
            continue
        r.take_at(i)
        radius = r.take_at(beside[0]).number
        r.take(
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
            r.take(word, *LINKING)
            return Region(word, r.objects_from(j))
        if r.tokens[j].value == "middle":
            r.take(word, "middle", "reach", "pass", "when")
            return Region("last" if word == "after" else "first", amount=0.5)
        if r.tokens[j].value in SHARES and r.tokens[j].text.lower() == "half":
            continue
    for i, token in enumerate(r.tokens):
        behind = r.after(i)
        later = r.tokens[behind].text.lower() if behind is not None else ""
        if (
            token.items
            and not r.taken[i]
            and r.word_before(i) in ("from", "the")
            and later in ("onwards", "onward", "on")
        ):
            r.taken[behind or 0] = True
            return Region("after", r.objects_from(i))
    return None


def _between(r: Reader, *, needs_when: bool) -> Region | None:
    """Between the fan and the chair, as a part of the path; as a place it is read by the action."""
    i = r.find("between")
    if i is None or (needs_when and not r.has("when", "pass")):
        return None
    items = r.objects_from(r.after(i))
    if len(items) != 2:
        return None
    r.take("between", "when", "pass")
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
        r.take("middle")
        r.taken[onwards[0]] = True
        return Region("last", amount=0.5)
    r.take("middle")
    r.take("when", "reach", "waypoints")
    return Region("first", amount=0.5) if until else Region("middle")


def _heading(r: Reader) -> Region | None:
    i = r.find("when")
    j = r.after(i) if i is not None else None
    if i is None or j is None or r.taken[j] or r.tokens[j].value not in DIRECTIONS:
        return None
    r.take_at(i)
    return Region("heading", direction=r.take_at(j).value)


def _end(r: Reader) -> Region | None:
    i = r.find("goal")
    if i is not None and {"until", "till", "til"} & {t.text.lower() for t in r.tokens[:i]}:
        r.take("goal", "before", "reach")
        return WHOLE
    for word, kind in (("goal", "last"), ("start", "first")):
        if r.take(word):
            r.take("near", "when", "reach", "before", "toward", "closer")
            return Region(kind, amount=END_SHARE)
    if r.has("reach") and not any(t.items for t in r.tokens) and not r.has("stop"):
        r.take("reach", "when", "before")
        return Region("last", amount=END_SHARE)
    return None
