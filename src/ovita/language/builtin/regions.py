"""Reading the part of the path that a clause is about: near the cup, the first 5 waypoints, after the fan."""

from __future__ import annotations

from ovita.language.builtin.clauses import DIRECTIONS
from ovita.language.builtin.intents import WHOLE, Region
from ovita.language.builtin.reader import Reader

SHARES = {"half": 0.5, "third": 1 / 3, "quarter": 0.25}
END_SHARE = 0.25
"""Share of the waypoints that "at the end" or "at the start" means."""


def read_region(r: Reader, *, speed: bool) -> Region:
    """Take the words that name a part of the path.

    Args:
        r: The clause.
        speed: Whether the clause is about speed; then "near the goal" and "when going up" are parts of the path.
    """
    for reading in (_every, _count, _share, _near if not speed else _at_or_near, _order, _middle):
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


def _count(r: Reader) -> Region | None:
    """The first 5 waypoints; the last 12; the first 30 %."""
    for word in ("first", "last", "goal"):
        i = r.find(word)
        j = r.after(i) if i is not None else None
        if i is None or j is None or r.taken[j] or r.tokens[j].kind != "number":
            continue
        percent = r.tokens[j].unit == "%"
        if not percent and not (r.tokens[j].unit == "" and r.has("waypoints")):
            continue
        r.take_at(i)
        number = r.take_at(j).number
        r.take("waypoints")
        return Region("last" if word == "goal" else word, amount=number, counted=not percent)
    return None


def _share(r: Reader) -> Region | None:
    """The first half; the last third; the second half."""
    for word in ("first", "second", "last"):
        i = r.find(word)
        j = r.after(i) if i is not None else None
        if i is None or j is None or r.taken[j] or r.tokens[j].value not in SHARES:
            continue
        if word == "second" and r.tokens[j].value != "half":
            continue
        r.take_at(i)
        share = SHARES[r.take_at(j).value]
        r.take("before", "after", "waypoints")
        return Region("first" if word == "first" else "last", amount=share)
    for word in ("first", "last"):
        i = r.find(word)
        if i is None or (word == "first" and r.has("start")):
            continue
        j = r.after(i)
        if j is not None and not r.taken[j] and r.tokens[j].kind == "number":
            continue  # "the last 0.5 m" is a length, which is no share
        single = j is not None and r.tokens[j].text.lower() in ("waypoint", "point")
        r.take_at(i)
        r.take("waypoints")
        return Region(word, amount=1.0, counted=True) if single else Region(word, amount=END_SHARE)
    return None


def _at_or_near(r: Reader) -> Region | None:
    """Near the cup, or at the cup."""
    region = _near(r)
    if region is not None:
        return region
    i = next((k for k, t in enumerate(r.tokens) if t.items and not r.taken[k]), None)
    before = [t.text.lower() for t in r.tokens[max((i or 0) - 2, 0) : i]] if i is not None else []
    return Region("near", r.objects_from(i)) if "at" in before else None


def _near(r: Reader) -> Region | None:
    """Near the cup; within 0.3 of the cup; when passing the cup."""
    i = r.find("within")
    if i is not None:
        numbers = r.numbers(("", "m"))
        behind = [n for n in numbers if n > i]
        if behind:
            r.take_at(i)
            radius = r.take_at(behind[0]).number
            r.take("near", "when", "pass", "reach", "only", "distance", "threshold")
            items = r.objects_from(r.after(behind[0])) or r.objects()
            return Region("near", items, radius) if items else None
    i = r.find("near")
    if i is None and r.has("pass") and r.has("when"):
        i = r.find("pass")
    if i is None and r.has("when"):
        i = r.find("reach")
    if i is None and r.has("when"):
        i = next((k for k, t in enumerate(r.tokens) if t.text.lower() == "approaching" and not r.taken[k]), None)
    j = r.after(i) if i is not None else None
    while j is not None and r.tokens[j].value in ("reach", "near", "pass"):
        j = r.after(j)
    if i is None or j is None or not r.tokens[j].items:
        return None
    items = r.objects_from(j)
    r.take_at(i)
    r.take("near", "pass", "when", "reach", "only", "after" if r.find("after") == r.before(i) else "only")
    stated = r.number("m", "") if r.take("threshold") else None
    return Region("near", items, stated)


def _order(r: Reader) -> Region | None:
    """After the plate; before the cup; until the fan."""
    for word in ("after", "before"):
        i = r.find(word)
        if i is None:
            continue
        j = r.after(i)
        while j is not None and r.tokens[j].value in ("reach", "pass", "near", "when"):
            j = r.after(j)
        if j is None:
            continue
        if r.tokens[j].items and not r.taken[j]:
            r.take(word, "reach", "pass", "near", "when")
            return Region(word, r.objects_from(j))
        if r.tokens[j].value == "middle":
            r.take(word, "middle", "reach", "pass", "when")
            return Region("last" if word == "after" else "first", amount=0.5)
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
    if not r.take("middle"):
        return None
    r.take("when", "reach")
    return Region("middle")


def _heading(r: Reader) -> Region | None:
    i = r.find("when")
    j = r.after(i) if i is not None else None
    if i is None or j is None or r.taken[j] or r.tokens[j].value not in DIRECTIONS:
        return None
    r.take_at(i)
    return Region("heading", direction=r.take_at(j).value)


def _end(r: Reader) -> Region | None:
    for word, kind in (("goal", "last"), ("start", "first")):
        if r.take(word):
            r.take("near", "when", "reach", "before", "toward", "closer")
            return Region(kind, amount=END_SHARE)
    return None
