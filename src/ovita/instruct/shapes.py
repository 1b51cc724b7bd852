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
    if not r.take("spiral") or r.has("never"):
        return []
    turns = _count(r)
    r.take("at_most", "turn", "whole", "increase")
    radius = r.number("m", "") if r.take("threshold") else r.number("m")
    degree = r.degree()
    rising = r.directions() if r.has("up", "down") else ()
    items, place = _spot(r)
    if len(items) > 1:
        return []
    return [Intent("spiral", rising, items[:1], radius, "m", turns, place or "goal", degree)]


def read_circle(r: Reader) -> list[Intent]:
    """Revolve twice around the cup; orbit the fan with a radius of 0.3."""
    turns_about = (
        (r.has("rotate", "turn", "once") or bool(r.numbers(("x",)))) and r.has("around") and not r.numbers(("deg",))
    )
    turns_about = turns_about and any(t.items for t in r.tokens) and not r.has("speed", "slower", "faster")
    if (not r.has("circle") and not turns_about) or r.has("never"):
        return []
    turns = _count(r)
    r.take(
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
    sense = "clockwise" if r.take("clockwise") else "anticlockwise" if r.take("anticlockwise") else ""
    return [Intent("circle", (), (item,), radius, "m", turns, sense, degree) for item in items]


def read_wave(r: Reader) -> list[Intent]:
    """Follow the path in a zigzag; move sinusoidally with an amplitude of 0.1; a figure eight at the cup."""
    action = next((a for a in ("zigzag", "wave", "eight") if r.has(a)), None)
    if action is None or r.has("never", "remove", "fewer", "decrease"):
        return []
    r.take(
        action, "sideways", "increase", "whole", "smooth", "curvature", "goal" if action != "eight" else action, "when"
    )
    waves = _count(r)
    region = read_region(r, speed=True)
    if all(len(t.items) != 1 for t in r.tokens):
        r.objects()  # "dance around the objects" is about no particular place
        r.take("around", "between", "near", "through")
    r.take("turn", "count", "amplitude", "threshold")
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
    action = "hop" if r.has("hop") else "hover" if r.has("hover") else None
    if action is None or r.has("never"):
        return []
    steps, seconds = r.number("step"), r.number("s")
    r.take("hop", "hover", "over", "near", "up", "height")
    height = r.number("m", "")
    degree = r.degree()
    count = steps if steps is not None else seconds
    unit = "s" if seconds is not None else "m"
    return [Intent(action, (), (i,), height, unit, count, "", degree) for i in r.objects()]  # type: ignore[arg-type]


def read_turned(r: Reader) -> list[Intent]:
    """Rotate by 30 degrees; tilt it clockwise; mirror the first half around the x axis; scale by 1.5."""
    if r.has("mirror"):
        sided = any("left" in t.text.lower() for t in r.tokens if t.value in ("mirror", "sideways"))
        axis = r.letter()
        region = read_region(r, speed=False)
        r.take("mirror", "around", "axis", "over", "second", "sideways", "whole")
        directions = r.directions()[:1] or ((("left", None),) if sided and not axis else ())
        r.take("waypoints")
        return [Intent("mirror", directions, r.objects()[:1], mode=axis, region=region)]
    grows = r.has("size") or (r.hears("bigger", "larger", "smaller", "big") and r.hears(*PATH_WORDS))
    grows = grows and not r.has("distance", "speed", "count", "waypoints", "away", "closer", "circle", "spiral")
    if r.has("resize") or grows:
        begins = ("shrink", "compress", "scale down", "contract", "squeeze", "squash", "downscale")
        smaller = any(t.text.lower().startswith(begins) for t in r.tokens)
        smaller = r.take("down", "fewer", "decrease") or smaller
        r.take("resize", "around", "whole", "up", "original", "more", "size", "increase")
        factor = r.share(smaller=smaller)
        if factor is not None:
            return [Intent("resize", (), r.objects()[:1], factor, "x")]
        factor = r.number("x", "")
        double, half = r.take("double"), r.take("half")
        factor = 2.0 if double else 0.5 if half else factor
        r.take(*(["large"] if double or half or factor else []))
        mode = "smaller" if smaller else ""
        return [Intent("resize", (), r.objects()[:1], factor, "x", None, mode, r.degree())]
    action = "tilt" if r.has("tilt") else "rotate" if r.has("rotate") else None
    if action is None:
        return []
    r.take("tilt", "rotate", "anticlockwise", "near")
    axial = r.has("axis", "around", "vertical")
    upright = r.take("vertical")
    r.take("axis", "around", "whole")
    sign = -1.0 if r.take("clockwise") else 1.0
    if action == "rotate" and not axial and r.has("left", "right"):
        sign = -1.0 if r.take("right") else 1.0
        r.take("left")
    degrees = r.number("deg")
    axis = r.letter() or ("z" if upright else "")
    region = read_region(r, speed=False)
    directions = r.directions()[:1]
    r.take("waypoints")
    amount = None if degrees is None else sign * degrees
    items = r.objects()[:1]
    return [Intent(action, directions, items, amount, "deg", sign, axis, r.degree(), region)]  # type: ignore[arg-type]


def read_bend(r: Reader) -> list[Intent]:
    """Go straight between the fan and the chair; more curved; follow it until the cup, then straight to the fan."""
    if r.has("curvature") and not r.has(*DIRECTIONS):
        r.take("curvature")
        less = r.take("fewer", "decrease") or r.take("straight")
        r.take("more", "increase", "turn", "whole")
        factor = r.number("x", "")
        return [Intent("curve", (), (), factor, "x", None, "less" if less else "more", r.degree())]
    if not r.has("straight") or r.has("after", "extend", "stop", "wait"):
        return []
    if not any(t.items for t in r.tokens) and r.has("first", "last", "middle", "waypoints"):
        region = read_region(r, speed=False)
        r.take("straight", "when", "keep", "smooth")
        return [Intent("straighten", region=region)] if region.kind != "whole" else []
    if r.take("before"):
        r.take("straight", "near", "reach", "toward")
        items = r.objects()
        return [Intent("shortcut", items=items)] if len(items) == 2 else []
    if r.has("closer", "away", "toward", *DIRECTIONS, *SPEED):
        return []
    r.take("straight", "when", "pass", "between", "keep", "through")
    items = r.objects()
    if not items:
        r.take("start", "goal", "whole", "toward", "reach")
    end = "goal" if r.has("goal") else "start" if r.has("start") else ""
    if len(items) == 1 and end and r.take(end):
        return [Intent("straighten", items=items, mode=end)]
    if len(items) == 2 or not items:
        return [Intent("straighten", items=items)]
    return []


def read_order(r: Reader) -> list[Intent]:
    """Merge each group of 4 waypoints into its mean; reverse the second half; add some noise."""
    if (
        r.has("remove", "decrease", "drop", "sparser")
        and (r.has("waypoints", "every") or r.says("skip", "omit", "leave out", "cut off", "remove", "delete"))
        and (not any(t.items for t in r.tokens) or (r.has("before", "after") and r.has("waypoints", "whole")))
        and not r.has("smooth", "count", "speed", "turn")
    ):
        every_other = r.has("sparser")
        region = read_region(r, speed=True)
        if region.kind != "whole" and not every_other:
            r.take("remove", "decrease", "waypoints", "drop", "whole")
            return [Intent("trim", region=region)]
        return []
    if r.has("average") and r.has("waypoints"):
        r.take("average", "group", "every", "waypoints")
        number = r.number("")
        return [Intent("average", amount=number or 3.0, unit="waypoints")]
    if r.has("reverse") and not r.has(*SPEED):
        r.take("reverse", "whole", "back")
        if r.has("start") and r.has("goal"):
            r.take("start", "goal")
        region = read_region(r, speed=False)
        r.take("waypoints")
        return [Intent("reverse", region=region)]
    if r.has("noise") and not r.has("remove", "decrease", "fewer", "away", "smooth", "never"):
        r.take("noise", "increase", "more")
        region = read_region(r, speed=False)
        return [Intent("noise", (), (), r.number("m", ""), "m", None, "", r.degree(), region)]
    return []


def read_bounds(r: Reader) -> list[Intent]:
    """Never go above 0.3; stay below 0.5; stay left of the cup; keep to the first quadrant; a height of 0.1."""
    if r.has("quadrant"):
        i = next((k for k, t in enumerate(r.tokens) if t.value in QUADRANTS and not r.taken[k]), None)
        which = QUADRANTS[r.take_at(i).value] if i is not None else 1.0
        r.take("quadrant", "stay", "keep")
        return [Intent("quadrant", amount=which)]
    numbers = [] if r.numbers(("m/s",)) else r.numbers(("m", ""))
    fixed = (
        r.has("height") and numbers and not r.has("under", "never", "limit", "at_most", "at_least", "beyond", "than")
    )
    if fixed and not r.has("up", "down") and r.word_before(numbers[0]) != "by" and not any(t.items for t in r.tokens):
        sign = -1.0 if r.hears("depth") else 1.0
        r.take("height", "stay", "keep", "ground", "constant", "over", "always", "same")
        return [Intent("height", amount=sign * r.take_at(numbers[0]).number, region=read_region(r, speed=False))]
    return _side(r) or _bound(r, numbers)


def _side(r: Reader) -> list[Intent]:
    """Stay above the cup; stay to the left of it."""
    if r.has("start", "goal", "stop", "wait", "extend"):
        return []
    side = next((w for w in ("over", "under", *sorted(DIRECTIONS)) if r.has(w)), None)
    i = r.find(side) if side is not None else None
    beside = i is not None and side in DIRECTIONS and i + 1 < len(r.tokens) and r.tokens[i + 1].text.lower() == "of"
    sided = i is not None and (
        r.word_before(i) == "on" or [t.text.lower() for t in r.tokens[max(i - 2, 0) : i]][:1] == ["on"]
    )
    first = next((k for k, t in enumerate(r.tokens) if t.items), len(r.tokens))
    if side in DIRECTIONS and sided and first < (i or 0) and r.hears(*LEAVING) and not (r.has("when") or beside):
        # "with the cup on your left" is where the cup is; the path passes it on the other side
        for k, token in enumerate(r.tokens):
            r.taken[k] = r.taken[k] or token.text.lower() in LEAVING
        r.take("pass", "keep", "always", "stay", side)
        word = OPPOSITE[side]
        return [Intent("side", (), (item,), r.number("m", ""), "pass", None, word) for item in r.objects()]
    if r.has("pass") and side in DIRECTIONS and sided and not (r.has("when") or r.has("never")):
        r.take("pass", side)
        return [Intent("side", (), (item,), r.number("m", ""), "pass", None, side) for item in r.objects()]
    stays = r.has("stay", "keep", "always") or beside or (r.has("never") and r.has("over", "under"))
    if side is None or not stays or not any(t.items for t in r.tokens) or r.has("distance", "closer", "away", *SPEED):
        return []
    if first < (r.find(side) or 0):
        return []  # "keep the cup on the left" is about where the cup is, not the path
    if r.has("never") and r.says("over", "under", "underneath", "beneath", "on top of", "over the top of"):
        r.take("never", side, "pass")
        return [Intent("farther", (), (item,), mode="aside") for item in r.objects()]
    opposite = {"over": "below", "under": "above", **OPPOSITE}
    word = {"over": "above", "under": "below"}.get(side, side)
    if r.take("never"):
        word = opposite.get(side, word)
    r.take(side, "stay", "keep", "near", "pass", "always", "whole", "at_least")
    gap = r.number("m", "")
    return [Intent("side", (), (item,), gap, "m", None, word) for item in r.objects()]


def _bound(r: Reader, numbers: list[int]) -> list[Intent]:
    """Never go above 0.3: an upper bound up; stay above 0.1: an upper bound down."""
    if not numbers or any(t.items for t in r.tokens):
        return []
    wanted = r.has("never", "stay", "keep", "height", "limit", "at_most", "at_least", "always")
    wanted = wanted or r.hears("must", "should", "shall", "has to", "ought")
    if not wanted or r.has("speed", *MOVING):
        return []
    if r.has(*SPEED) or r.numbers(("m/s",)):
        return []
    lowest = r.says("no lower than", "not below", "never below", "not under", "never under")
    raised = r.has("height", "over") or r.says("high")
    if lowest or (r.has("at_least") and raised and not r.has("never")):
        deep = r.hears("depth")
        r.take("height", "at_least", "stay", "keep", "always", "over", "ground", "up")
        amount = r.take_at(numbers[0]).number
        return [Intent("bound", (("up", -amount) if deep else ("down", -amount),))]
    deep = any(t.text.lower() in ("deeper", "deep", "depth") for t in r.tokens)
    if deep and r.has("stay", "keep", "always") and r.has("than") and not r.has("never", "at_most", "limit"):
        r.take("down", "height", "than", "stay", "keep", "always")
        return [Intent("bound", (("up", -r.take_at(numbers[0]).number),))]
    if deep and r.has("never", "at_most", "limit"):
        r.take("never", "at_most", "limit", "down", "height", "than", "stay", "keep", "beyond", "under")
        return [Intent("bound", (("down", r.take_at(numbers[0]).number),))]
    never = r.has("never", "at_most", "limit")
    r.take("at_least")  # "never more than 0.5 m high"
    if r.has("height") and never and not r.has("under", "down"):
        word, sign = "up", 1.0
    elif r.has("over") or (r.has("up") and never):
        word, sign = ("up", 1.0) if never else ("down", -1.0)
    elif r.has("under") or (r.has("down") and never):
        word, sign = ("down", -1.0) if never else ("up", 1.0)
    elif never and r.has("beyond", "than") and r.has(*DIRECTIONS):
        word, sign = next(w for w in sorted(DIRECTIONS) if r.has(w)), 1.0
    else:
        return []
    amount = r.take_at(numbers[0]).number
    r.take(
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
            return r.take_at(i).number
        if token.text.lower().startswith("once") or token.value == "once":
            r.take("once")
            return 1.0
    return 2.0 if r.take("double") or r.says_phrase("twice") else None


def _spot(r: Reader) -> tuple[tuple, str]:  # type: ignore[type-arg]
    """Take where something happens: near an object, after the goal, at the start."""
    items = r.objects()
    place = "goal" if r.has("goal") else "start" if r.has("start") else "middle" if r.has("middle") else ""
    r.take("goal", "start", "middle", "after", "before", "reach", "when", "near", "around", "over", "closer")
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
