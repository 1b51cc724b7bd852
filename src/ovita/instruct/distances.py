"""Reading clauses about the distance to objects: closer, farther, at least so far."""

from __future__ import annotations

from ovita.instruct.clauses import Reader
from ovita.instruct.intents import Intent, Region
from ovita.instruct.regions import read_region
from ovita.instruct.senses import DIRECTIONS, SPEED

SPARED = (
    "avoid",
    "steer clear",
    "steer clear of",
    "clear of",
    "stay clear",
    "keep clear",
    "bypass",
    "skirt",
    "dodge",
    "evade",
)
"""Words after which "by 0.3" is the distance to keep."""

FURTHER_THAN = ("further than", "farther than", "further away than", "farther away than")
"""Words that bound a distance from below, and with a negation from above."""

VERBS = frozenset(
    "go get come move pass drive fly be stay travel head approach hit touch collide crash bump brush cross".split()
)
VERBS |= {"going", "getting", "coming", "moving", "passing", "touching", "hitting", "driving", "flying", "approaching"}
"""Words that make a deed of a negation: "don't go near the cup", which is more than "not near the cup"."""

EXTRAS = (
    "waypoints",
    "whole",
    "smooth",
    "when",
    "reach",
    "original",
    "more",
    "pass",
    "keep",
    "near",
    "around",
    "stay",
    "always",
)


def read_keep_distance(r: Reader) -> list[Intent]:
    """Keep at least 0.2 away from the cup; never come within 0.3 of it; stay 0.3 away from the plate."""
    numbers = r.numbers(("", "m"))
    if not numbers or r.peek("speed", "faster", "slower") or r.numbers(("m/s",)) or not any(t.items for t in r.tokens):
        return []
    if r.peek("more") and r.peek("than") and sum(bool(t.items) for t in r.tokens) > 1:
        return []  # "more distance from the plate than from the fan"
    if r.peek("over", "under") and not r.peek("never", "distance", "away"):
        return []
    if len(numbers) == 2 and r.peek("keep", "stay", "distance"):
        return _between_distances(r, numbers)
    directed = r.peek(*DIRECTIONS)
    spared = r.peek_word(*SPARED)
    never = r.peek("never") and r.peek("closer", "near", "within", "at_most", "collide")
    never = (
        never
        or (r.peek("never") and r.peek("distance") and r.peek("under", "decrease"))
        or (spared and r.peek("within"))
    )
    capped = r.peek("never") and (r.peek("at_least") or r.peek_word(*FURTHER_THAN))  # "never more than 0.5 m away"
    barred = (never or r.peek("no_closer")) and not capped
    reached = _reached(r) if (r.peek("within") and not barred) or r.peek_word("as close as") else False
    bounded = r.peek("at_least", "at_most") or barred or capped or reached
    changed = r.peek("increase", "decrease", "more", "fewer", "double", "half")
    stated = (r.peek("keep", "stay", "wait") and r.peek("distance", "away", "near", "within")) or (
        r.peek("distance") and not changed
    )
    stated = stated or ((r.peek("keep") or spared) and not changed)
    apart = r.peek("keep", "stay") and any(t.items and "from" in _two_before(r, i) for i, t in enumerate(r.tokens))
    stated = stated or apart
    related = (
        r.peek("at_least")
        or reached
        or apart
        or r.peek("distance", "away", "keep", "near", "within", "stay", "closer")
        or barred
        or capped
    )
    if directed or not (bounded or stated) or not related:
        return []
    if r.word_before(numbers[0]) == "by" and not spared:
        return []
    within = r.peek("within") and not barred
    at_most = (
        (r.peek("at_most") and not barred)
        or capped
        or within
        or reached
        or (r.peek("near") and not r.peek("at_least") and not barred)
    )
    at_most = at_most and not (barred and not capped)
    if within and not (reached or r.peek("stay", "keep", "wait", "near", "always")):
        return []
    region = Region()
    if r.peek("first", "last", "second", "middle", "goal", "start") and not r.peek("stop", "wait"):
        free = list(r.taken)
        r.taken = [taken or t.value not in PLACING for taken, t in zip(r.taken, r.tokens, strict=True)]
        region = read_region(r, speed=True)
        r.taken = [a or (b and t.value in PLACING) for a, b, t in zip(free, r.taken, r.tokens, strict=True)]
    r.consume(
        "keep", "distance", "away", "at_least", "at_most", "near", "constant", "never", "within", "closer", "no_closer"
    )
    r.consume(
        "than",
        "stay",
        "always",
        "pass",
        "whole",
        "when",
        "around",
        "wait",
        "threshold",
        "more",
        "original",
        "collide",
        "large",
        "between",
        "reach",
        "under",
        "decrease",
    )
    amount = r.consume_at(numbers[0]).number
    r.consume("toward", "advance")
    items = r.objects()
    mode = "at_most" if at_most else "at_least"
    return [Intent("keep_distance", items=items, amount=amount, mode=mode, region=region)]


def _two_before(r: Reader, i: int) -> list[str]:
    return [t.text.lower() for t in r.tokens[max(i - 2, 0) : i]]


PLACING = frozenset("first last second middle goal start half third quarter waypoints".split())


def _reached(r: Reader) -> bool:
    """Whether "within" is a distance to come to, "get within 2 m of it", rather than a part of the path."""
    said = {t.value for i, t in enumerate(r.tokens) if t.kind == "concept" and not r.taken[i]}
    return said <= {"within", "at_most", "closer", "toward", "reach", "pass", "near", *PLACING}


def _between_distances(r: Reader, numbers: list[int]) -> list[Intent]:
    """Keep between 0.1 and 0.2 m away from the cup."""
    low, high = (r.tokens[i].number for i in numbers)
    if not r.peek("between") and r.word_before(numbers[1]) != "to":
        return []
    if not low < high or r.peek("closer", *DIRECTIONS):
        return []
    for i in numbers:
        r.consume_at(i)
    r.consume("between", "keep", "stay", "distance", "away", "near", "always", "whole")
    found = []
    for item in r.objects():
        sphere = (
            0.0 if item.dimensions is None else item.radius
        )  # both are counted from it, but at_most from the centre
        found.append(Intent("keep_distance", items=(item,), amount=round(high + sphere, 4), mode="at_most"))
        found.append(Intent("keep_distance", items=(item,), amount=low, mode="at_least"))
    return found


def read_approach(r: Reader) -> list[Intent]:
    """Walk closer to the cup; keep a bigger distance from the plate; the first 5 waypoints closer to the fan."""
    distance = r.peek("distance")
    if not any(t.items for t in r.tokens) or (r.peek(*SPEED) and not distance):
        return []
    denied = (
        r.peek("never")
        and any(w in VERBS for t in r.tokens for w in t.text.lower().split())
        and r.peek("closer", "near", "collide", "through", "over", "pass", "toward", "reach")
        and not r.peek("away")
    )
    spared = r.peek("away") and r.peek("collide", "through", "pass", "near", "closer", "over", "reach")
    nearer = not denied and (r.peek("closer", "toward") or (distance and r.peek("fewer", "decrease", "half")))
    further = denied or r.peek("away") or (distance and r.peek("more", "increase", "double"))
    further = further or (distance and not nearer and r.peek("large", "keep", "slight"))
    if denied or spared:
        nearer = False
        r.consume("never", "collide", "through", "over", "reach")
    changed = r.peek("half", "double", "increase", "decrease", "more", "fewer")
    nearer = nearer or _brought_to(r)
    lone = (
        r.peek("near")
        and not r.peek("goal", "start", "stop", "wait", "only")
        and not (distance or changed or r.peek(*DIRECTIONS) or denied or spared)
    )
    if sum(t.text.lower() == "as" for t in r.tokens) > 1:
        return []  # "as far from the fan as from the cup"
    if (nearer == further and not (lone and not nearer)) or r.peek("than") or r.names_a_side() or r.peek("never"):
        return []
    region = read_region(r, speed=False) if not lone or nearer or further else Region()
    whole = r.consume("whole")
    r.consume(
        "closer",
        "toward",
        "away",
        "distance",
        "fewer",
        "more",
        "decrease",
        "increase",
        "keep",
        "near",
        "pass",
        "around",
        "stay",
    )
    r.consume("always")
    items = r.objects()
    if not items and region.kind == "near":
        items, region = region.items, Region()
    if not items:
        return []
    times = r.number("x")
    half, double = r.consume("half"), r.consume("double")
    if half or double:
        times = 2.0
    target = r.target()
    share = r.number("%") if times is None and target is None else None
    amount = r.number("m") if times is None and target is None else times
    directions = r.directions()
    if amount is None and share is None and target is None:
        amount = r.number("")
    degree = r.degree()
    r.consume(*EXTRAS)
    shifts = [Intent("move", directions)] if directions else []
    action = "farther" if further else "closer"
    if target is not None:
        mode = "at_least" if further else "at_most"
        return [*shifts, Intent("keep_distance", items=items, amount=target, mode=mode)]
    unit = "x" if times is not None else "m" if share is None else "%"
    amount = share if share is not None else amount
    return [
        *shifts,
        *(
            Intent(action, (), (i,), amount, unit, None, "whole" if whole else "", degree, region)  # type: ignore[arg-type]
            for i in items
        ),
    ]


def _brought_to(r: Reader) -> bool:
    """Whether the path itself is to be brought to an object: "shift the trajectory to the cup"."""
    words = " ".join(t.text.lower() for t in r.tokens).split()
    moved = any(w in BRINGING for w in words) and any(w in PATH for w in words)
    to = any(
        t.items and "to" in (r.word_before(i), r.tokens[i - 2].text.lower() if i > 1 else "")
        for i, t in enumerate(r.tokens)
    )
    return moved and to and not r.peek("start", "goal", "extend", *DIRECTIONS)


BRINGING = frozenset("shift move bring translate pull displace relocate push take carry".split())
PATH = frozenset("trajectory path route motion waypoints waypoint points track course".split())
