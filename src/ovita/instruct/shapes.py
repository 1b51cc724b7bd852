"""Reading clauses that ask for a new shape: spirals, circles, waves, mirrored and rotated paths, bounds."""

from __future__ import annotations

from collections.abc import Callable

from ovita.instruct.clauses import Reader
from ovita.instruct.intents import Intent
from ovita.instruct.regions import read_region
from ovita.instruct.senses import DIRECTIONS, SPEED
from ovita.paths.frame import OPPOSITE

MOVING = ("first", "last", "closer", "away", "start", "goal", "extend", "waypoints")
"""Concepts that make a clause with a number something else than a bound."""

LEAVING = ("with", "keep", "keeping", "leave", "leaving", "having", "have")
"""Words after which "the cup on the left" says where the cup is."""

PATH_WORDS = ("path", "trajectory", "route", "it", "motion", "whole", "whole thing", "everything", "shape")

QUADRANTS = {"first": 1.0, "second": 2.0, "third": 3.0}


def read_spiral(r: Reader) -> list[Intent]:
    """A small spiral, 3 turns, at the goal; a spiral of radius 0.1 near the cup."""
    if not r.consume("spiral") or r.peek("never"):
        return []
    turns = _count(r)
    r.consume("at_most", "turn", "whole", "increase")
    radius = r.number("m", "") if r.consume("threshold") else r.number("m")
    degree = r.degree()
    rising = r.directions() if r.peek("up", "down") else ()
    items, place = _spot(r)
    if len(items) > 1:
        return []
    return [Intent("spiral", rising, items[:1], radius, "m", turns, place or "goal", degree)]


def read_circle(r: Reader) -> list[Intent]:
    """Revolve twice around the cup; orbit the fan with a radius of 0.3."""
    turns_about = (
        (r.peek("rotate", "turn", "once") or bool(r.numbers(("x",)))) and r.peek("around") and not r.numbers(("deg",))
    )
    turns_about = turns_about and any(t.items for t in r.tokens) and not r.peek("speed", "slower", "faster")
    if (not r.peek("circle") and not turns_about) or r.peek("never"):
        return []
    turns = _count(r)
    r.consume(
        "circle",
        "rotate",
        "around",
        "threshold",
        "turn",
        "before",
        "after",
        "reach",
        "goal",
        "near",
        "whole",
        "over",
        "increase",
        "away",
        "distance",
    )
    radius = r.number("m", "")
    degree = r.degree()
    items = r.objects()
    sense = "clockwise" if r.consume("clockwise") else "anticlockwise" if r.consume("anticlockwise") else ""
    return [Intent("circle", (), (item,), radius, "m", turns, sense, degree) for item in items]


def read_wave(r: Reader) -> list[Intent]:
    """Follow the path in a zigzag; move sinusoidally with an amplitude of 0.1; a figure eight at the cup."""
    action = next((a for a in ("zigzag", "wave", "eight") if r.peek(a)), None)
    if action is None or r.peek("never", "remove", "fewer", "decrease"):
        return []
    r.consume(
        action, "sideways", "increase", "whole", "smooth", "curvature", "goal" if action != "eight" else action, "when"
    )
    waves = _count(r)
    region = read_region(r, speed=True)
    if all(len(t.items) != 1 for t in r.tokens):
        r.objects()  # "dance around the objects" is about no particular place
        r.consume("around", "between", "near", "through")
    r.consume("turn", "count", "amplitude", "threshold")
    amplitude = r.number("m", "")
    degree = r.degree()
    directions = r.directions()[:1]
    if action == "eight":
        items, place = (region.items, "") if region.items else _spot(r)
        if len(items) > 1:
            return []
        return [Intent("eight", (), items[:1], amplitude, "m", None, place or "goal", degree)]
    return [Intent(action, directions, (), amplitude, "m", waves, "", degree, region)]  # type: ignore[arg-type]


def read_hop(r: Reader) -> list[Intent]:
    """Hop over the cup; hover 0.1 above the plate for 10 steps."""
    action = "hop" if r.peek("hop") else "hover" if r.peek("hover") else None
    if action is None or r.peek("never"):
        return []
    steps, seconds = r.number("step"), r.number("s")
    r.consume("hop", "hover", "over", "near", "up", "height")
    height = r.number("m", "")
    degree = r.degree()
    count = steps if steps is not None else seconds
    unit = "s" if seconds is not None else "m"
    return [Intent(action, (), (i,), height, unit, count, "", degree) for i in r.objects()]  # type: ignore[arg-type]


def read_turned(r: Reader) -> list[Intent]:
    """Rotate by 30 degrees; tilt it clockwise; mirror the first half around the x axis; scale by 1.5."""
    if r.peek("mirror"):
        sided = any("left" in t.text.lower() for t in r.tokens if t.value in ("mirror", "sideways"))
        axis = r.letter()
        region = read_region(r, speed=False)
        r.consume("mirror", "around", "axis", "over", "second", "sideways", "whole")
        directions = r.directions()[:1] or ((("left", None),) if sided and not axis else ())
        r.consume("waypoints")
        return [Intent("mirror", directions, r.objects()[:1], mode=axis, region=region)]
    grows = r.peek("size") or (r.any_word("bigger", "larger", "smaller", "big") and r.any_word(*PATH_WORDS))
    grows = grows and not r.peek("distance", "speed", "count", "waypoints", "away", "closer", "circle", "spiral")
    if r.peek("resize") or grows:
        begins = ("shrink", "compress", "scale down", "contract", "squeeze", "squash", "downscale")
        smaller = any(t.text.lower().startswith(begins) for t in r.tokens)
        smaller = r.consume("down", "fewer", "decrease") or smaller
        r.consume("resize", "around", "whole", "up", "original", "more", "size", "increase")
        factor = r.share(smaller=smaller)
        if factor is not None:
            return [Intent("resize", (), r.objects()[:1], factor, "x")]
        factor = r.number("x", "")
        double, half = r.consume("double"), r.consume("half")
        factor = 2.0 if double else 0.5 if half else factor
        r.consume(*(["large"] if double or half or factor else []))
        mode = "smaller" if smaller else ""
        return [Intent("resize", (), r.objects()[:1], factor, "x", None, mode, r.degree())]
    action = "tilt" if r.peek("tilt") else "rotate" if r.peek("rotate") else None
    if action is None:
        return []
    r.consume("tilt", "rotate", "anticlockwise", "near")
    axial = r.peek("axis", "around", "vertical")
    upright = r.consume("vertical")
    r.consume("axis", "around", "whole")
    sign = -1.0 if r.consume("clockwise") else 1.0
    if action == "rotate" and not axial and r.peek("left", "right"):
        sign = -1.0 if r.consume("right") else 1.0
        r.consume("left")
    degrees = r.number("deg")
    axis = r.letter() or ("z" if upright else "")
    region = read_region(r, speed=False)
    directions = r.directions()[:1]
    r.consume("waypoints")
    amount = None if degrees is None else sign * degrees
    items = r.objects()[:1]
    return [Intent(action, directions, items, amount, "deg", sign, axis, r.degree(), region)]  # type: ignore[arg-type]


def read_bend(r: Reader) -> list[Intent]:
    """Go straight between the fan and the chair; more curved; follow it until the cup, then straight to the fan."""
    if r.peek("curvature") and not r.peek(*DIRECTIONS):
        r.consume("curvature")
        less = r.consume("fewer", "decrease") or r.consume("straight")
        r.consume("more", "increase", "turn", "whole")
        factor = r.number("x", "")
        return [Intent("curve", (), (), factor, "x", None, "less" if less else "more", r.degree())]
    if not r.peek("straight") or r.peek("after", "extend", "stop", "wait"):
        return []
    if not any(t.items for t in r.tokens) and r.peek("first", "last", "middle", "waypoints"):
        region = read_region(r, speed=False)
        r.consume("straight", "when", "keep", "smooth")
        return [Intent("straighten", region=region)] if region.kind != "whole" else []
    if r.consume("before"):
        r.consume("straight", "near", "reach", "toward")
        items = r.objects()
        return [Intent("shortcut", items=items)] if len(items) == 2 else []
    if r.peek("closer", "away", "toward", *DIRECTIONS, *SPEED):
        return []
    r.consume("straight", "when", "pass", "between", "keep", "through")
    items = r.objects()
    if not items:
        r.consume("start", "goal", "whole", "toward", "reach")
    end = "goal" if r.peek("goal") else "start" if r.peek("start") else ""
    if len(items) == 1 and end and r.consume(end):
        return [Intent("straighten", items=items, mode=end)]
    if len(items) == 2 or not items:
        return [Intent("straighten", items=items)]
    return []


def read_order(r: Reader) -> list[Intent]:
    """Merge each group of 4 waypoints into its mean; reverse the second half; add some noise."""
    if (
        r.peek("remove", "decrease", "drop", "sparser")
        and (r.peek("waypoints", "every") or r.peek_word("skip", "omit", "leave out", "cut off", "remove", "delete"))
        and (not any(t.items for t in r.tokens) or (r.peek("before", "after") and r.peek("waypoints", "whole")))
        and not r.peek("smooth", "count", "speed", "turn")
    ):
        every_other = r.peek("sparser")
        region = read_region(r, speed=True)
        if region.kind != "whole" and not every_other:
            r.consume("remove", "decrease", "waypoints", "drop", "whole")
            return [Intent("trim", region=region)]
        return []
    if r.peek("average") and r.peek("waypoints"):
        r.consume("average", "group", "every", "waypoints")
        number = r.number("")
        return [Intent("average", amount=number or 3.0, unit="waypoints")]
    if r.peek("reverse") and not r.peek(*SPEED):
        r.consume("reverse", "whole", "back")
        if r.peek("start") and r.peek("goal"):
            r.consume("start", "goal")
        region = read_region(r, speed=False)
        r.consume("waypoints")
        return [Intent("reverse", region=region)]
    if r.peek("noise") and not r.peek("remove", "decrease", "fewer", "away", "smooth", "never"):
        r.consume("noise", "increase", "more")
        region = read_region(r, speed=False)
        return [Intent("noise", (), (), r.number("m", ""), "m", None, "", r.degree(), region)]
    return []


def read_bounds(r: Reader) -> list[Intent]:
    """Never go above 0.3; stay below 0.5; stay left of the cup; keep to the first quadrant; a height of 0.1."""
    if r.peek("quadrant"):
        i = next((k for k, t in enumerate(r.tokens) if t.value in QUADRANTS and not r.taken[k]), None)
        which = QUADRANTS[r.consume_at(i).value] if i is not None else 1.0
        r.consume("quadrant", "stay", "keep")
        return [Intent("quadrant", amount=which)]
    numbers = [] if r.numbers(("m/s",)) else r.numbers(("m", ""))
    fixed = (
        r.peek("height") and numbers and not r.peek("under", "never", "limit", "at_most", "at_least", "beyond", "than")
    )
    if fixed and not r.peek("up", "down") and r.word_before(numbers[0]) != "by" and not any(t.items for t in r.tokens):
        sign = -1.0 if r.any_word("depth") else 1.0
        r.consume("height", "stay", "keep", "ground", "constant", "over", "always", "same")
        return [Intent("height", amount=sign * r.consume_at(numbers[0]).number, region=read_region(r, speed=False))]
    return _side(r) or _bound(r, numbers)


def _side(r: Reader) -> list[Intent]:
    """Stay above the cup; stay to the left of it."""
    if r.peek("start", "goal", "stop", "wait", "extend"):
        return []
    side = next((w for w in ("over", "under", *sorted(DIRECTIONS)) if r.peek(w)), None)
    i = r.find(side) if side is not None else None
    beside = i is not None and side in DIRECTIONS and i + 1 < len(r.tokens) and r.tokens[i + 1].text.lower() == "of"
    sided = i is not None and (
        r.word_before(i) == "on" or [t.text.lower() for t in r.tokens[max(i - 2, 0) : i]][:1] == ["on"]
    )
    first = next((k for k, t in enumerate(r.tokens) if t.items), len(r.tokens))
    if side in DIRECTIONS and sided and first < (i or 0) and r.any_word(*LEAVING) and not (r.peek("when") or beside):
        # "with the cup on your left" is where the cup is; the path passes it on the other side
        for k, token in enumerate(r.tokens):
            r.taken[k] = r.taken[k] or token.text.lower() in LEAVING
        r.consume("pass", "keep", "always", "stay", side)
        word = OPPOSITE[side]
        return [Intent("side", (), (item,), r.number("m", ""), "pass", None, word) for item in r.objects()]
    if r.peek("pass") and side in DIRECTIONS and sided and not (r.peek("when") or r.peek("never")):
        r.consume("pass", side)
        return [Intent("side", (), (item,), r.number("m", ""), "pass", None, side) for item in r.objects()]
    stays = r.peek("stay", "keep", "always") or beside or (r.peek("never") and r.peek("over", "under"))
    if side is None or not stays or not any(t.items for t in r.tokens) or r.peek("distance", "closer", "away", *SPEED):
        return []
    if first < (r.find(side) or 0):
        return []  # "keep the cup on the left" is about where the cup is, not the path
    if r.peek("never") and r.peek_word("over", "under", "underneath", "beneath", "on top of", "over the top of"):
        r.consume("never", side, "pass")
        return [Intent("farther", (), (item,), mode="aside") for item in r.objects()]
    opposite = {"over": "below", "under": "above", **OPPOSITE}
    word = {"over": "above", "under": "below"}.get(side, side)
    if r.consume("never"):
        word = opposite.get(side, word)
    r.consume(side, "stay", "keep", "near", "pass", "always", "whole", "at_least")
    gap = r.number("m", "")
    return [Intent("side", (), (item,), gap, "m", None, word) for item in r.objects()]


def _bound(r: Reader, numbers: list[int]) -> list[Intent]:
    """Never go above 0.3: an upper bound up; stay above 0.1: an upper bound down."""
    if not numbers or any(t.items for t in r.tokens):
        return []
    wanted = r.peek("never", "stay", "keep", "height", "limit", "at_most", "at_least", "always")
    wanted = wanted or r.any_word("must", "should", "shall", "has to", "ought")
    if not wanted or r.peek("speed", *MOVING):
        return []
    if r.peek(*SPEED) or r.numbers(("m/s",)):
        return []
    lowest = r.peek_word("no lower than", "not below", "never below", "not under", "never under")
    raised = r.peek("height", "over") or r.peek_word("high")
    if lowest or (r.peek("at_least") and raised and not r.peek("never")):
        deep = r.any_word("depth")
        r.consume("height", "at_least", "stay", "keep", "always", "over", "ground", "up")
        amount = r.consume_at(numbers[0]).number
        return [Intent("bound", (("up", -amount) if deep else ("down", -amount),))]
    deep = any(t.text.lower() in ("deeper", "deep", "depth") for t in r.tokens)
    if deep and r.peek("stay", "keep", "always") and r.peek("than") and not r.peek("never", "at_most", "limit"):
        r.consume("down", "height", "than", "stay", "keep", "always")
        return [Intent("bound", (("up", -r.consume_at(numbers[0]).number),))]
    if deep and r.peek("never", "at_most", "limit"):
        r.consume("never", "at_most", "limit", "down", "height", "than", "stay", "keep", "beyond", "under")
        return [Intent("bound", (("down", r.consume_at(numbers[0]).number),))]
    never = r.peek("never", "at_most", "limit")
    r.consume("at_least")  # "never more than 0.5 m high"
    if r.peek("height") and never and not r.peek("under", "down"):
        word, sign = "up", 1.0
    elif r.peek("over") or (r.peek("up") and never):
        word, sign = ("up", 1.0) if never else ("down", -1.0)
    elif r.peek("under") or (r.peek("down") and never):
        word, sign = ("down", -1.0) if never else ("up", 1.0)
    elif never and r.peek("beyond", "than") and r.peek(*DIRECTIONS):
        word, sign = next(w for w in sorted(DIRECTIONS) if r.peek(w)), 1.0
    else:
        return []
    amount = r.consume_at(numbers[0]).number
    r.consume(
        "never",
        "stay",
        "keep",
        "over",
        "under",
        "beyond",
        "height",
        "ground",
        "at_most",
        "than",
        "limit",
        "always",
        *DIRECTIONS,
    )
    return [Intent("bound", ((word, sign * amount),))]


def _count(r: Reader) -> float | None:
    """Take how often: 3 turns, twice, once, 4 times."""
    for i, token in enumerate(r.tokens):
        j = r.after(i)
        while j is not None and r.tokens[j].value in ("clockwise", "anticlockwise", "slight", "large", "whole"):
            j = r.after(j)
        followed = j is not None and r.tokens[j].value in ("turn", "zigzag", "wave", "circle")
        cycles = token.unit == "step" and token.text.lower().endswith(("periods", "period", "cycles", "cycle"))
        if (
            token.kind == "number"
            and not r.taken[i]
            and (token.unit == "x" or cycles or (token.unit == "" and followed))
        ):
            return r.consume_at(i).number
        if token.text.lower().startswith("once") or token.value == "once":
            r.consume("once")
            return 1.0
    return 2.0 if r.consume("double") or r.peek_phrase("twice") else None


def _spot(r: Reader) -> tuple[tuple, str]:  # type: ignore[type-arg]
    """Take where something happens: near an object, after the goal, at the start."""
    items = r.objects()
    place = "goal" if r.peek("goal") else "start" if r.peek("start") else "middle" if r.peek("middle") else ""
    r.consume("goal", "start", "middle", "after", "before", "reach", "when", "near", "around", "over", "closer")
    return items, "" if items else place


SHAPES: tuple[Callable[[Reader], list[Intent]], ...] = (
    read_spiral,
    read_circle,
    read_wave,
    read_hop,
    read_turned,
    read_order,
    read_bounds,
    read_bend,
)
