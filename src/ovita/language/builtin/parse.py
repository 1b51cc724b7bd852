"""From clauses to intents: the families of instructions that the built-in writer knows.

Each rule looks for the concepts of one family, takes the tokens that it can explain, and leaves the rest; whatever
is left over at the end is reported with the words, never guessed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ovita.language.builtin.clauses import ACTIONS, DIRECTIONS, split
from ovita.language.builtin.intents import Intent, Region, Understood
from ovita.language.builtin.reader import Reader
from ovita.language.builtin.regions import read_region
from ovita.language.builtin.shapes import SHAPES
from ovita.language.builtin.speeds import read_speed
from ovita.language.builtin.tokens import tokenize
from ovita.scene import Scene, SceneObject


def parse(instruction: str, scene: Scene) -> Understood:
    """Read an instruction.

    Returns:
        The intents in the order of the sentence, notes on corrected spellings, and every word without a place.
    """
    tokens, notes = tokenize(instruction, scene)
    intents: list[Intent] = []
    unplaced: list[str] = []
    radius: float | None = None
    for clause in split(tokens):
        r = Reader(clause)
        if r.has("threshold") and not _asks(r) and not any(t.items for t in clause):
            r.take("threshold")
            radius = r.number("", "m")
        else:
            found = _read(r) or _same_again(r, intents)
            if found and r.has("there"):
                found = _located(r, found, intents)
            if found and _goes_on(found, intents):
                found = [replace(intent, action="extend") for intent in found]
            intents += found
        unplaced += r.left_over()
    if not intents and not unplaced:
        unplaced = instruction.split()
    return Understood(tuple(intents), notes, tuple(unplaced), radius)


def _asks(r: Reader) -> bool:
    return r.has("near", "distance", *ACTIONS)


def _same_again(r: Reader, earlier: list[Intent]) -> list[Intent]:
    """Read "double the speed but halve it near the cup": a change of what the clause before was about."""
    if not earlier or earlier[-1].action != "speed" or not r.has("half", "double", "increase", "decrease"):
        return []
    return [replace(intent, text=r.text) for intent in r.attempt(lambda reader: read_speed(reader, implied=True))]


def _goes_on(found: list[Intent], earlier: list[Intent]) -> bool:
    """Read "after the goal go up and then left": the second shift goes on from the first."""
    beyond = bool(earlier) and earlier[-1].action == "extend" and bool(earlier[-1].directions)
    return beyond and earlier[-1].text.lower().startswith("after") and [i.action for i in found] == ["move"]


def _located(r: Reader, found: list[Intent], earlier: list[Intent]) -> list[Intent]:
    """Read "there" as at or near the objects that were named last; where none were, it stays unplaced."""
    items = next((i.items or i.region.items for i in reversed(earlier) if i.items or i.region.items), ())
    if not items:
        return found
    r.take("there")
    placed = []
    for intent in found:
        if intent.action in ("wait", "stop", "spiral", "eight") and not intent.items:
            intent = replace(intent, items=items[:1], mode="")
        elif intent.region.kind == "whole" and intent.action == "speed":
            intent = replace(intent, region=Region("near", items))
        placed.append(intent)
    return placed


def _read(r: Reader) -> list[Intent]:
    for rule in RULES:
        found = r.attempt(rule)
        if found:
            r.take("only", "whole", "stay")
            return [replace(intent, text=r.text) for intent in found]
    return []


def _resample(r: Reader) -> list[Intent]:
    """Double the number of waypoints; fewer waypoints; 80 waypoints."""
    if not r.has("waypoints") or r.has(
        "average", "mirror", "rotate", "first", "last", "every", "distance", "speed", *DIRECTIONS
    ):
        return []
    numbers = r.numbers(("",))
    if not (r.has("count", "more", "fewer", "double", "half") or numbers):
        return []
    relative = bool(numbers) and (r.word_before(numbers[0]) in ("by", "add") or r.has("more", "fewer"))
    number = r.take_at(numbers[0]).number if numbers else None
    if number is not None and not 1 <= number <= 100_000:
        return []
    double, half = r.take("double"), r.take("half")
    less = r.take("decrease", "fewer") or half
    r.take("increase", "more", "count", "waypoints", "keep")
    times = r.number("x")
    if number is not None and relative:
        return [Intent("resample", amount=-number if less else number, unit="more")]
    if number is not None:
        return [Intent("resample", amount=number, unit="waypoints")]
    if times is not None:
        return [Intent("resample", amount=1 / times if less and times else times, unit="x")]
    degree = r.degree()
    factor = 0.5 if less else 2.0
    assumed = not (double or half)
    return [Intent("resample", amount=factor, unit="x", mode="assumed" if assumed else "", degree=degree)]


def _smooth(r: Reader) -> list[Intent]:
    """Smoothen the trajectory; remove sharp turns."""
    if not r.has("smooth") or r.has("extend", "after", "through", "over", "start", "goal", "between"):
        return []
    if r.has("closer", "away", "toward", *DIRECTIONS):
        return []
    r.take("smooth", "spline", "decrease", "more", "whole", "remove", "reach")
    return [Intent("smooth", degree=r.degree())]


def _wait(r: Reader) -> list[Intent]:
    """Stop at the fan for 5 timesteps; wait at the goal; stop when you reach the lamp."""
    if not r.has("stop", "wait"):
        return []
    waits = r.take("wait")
    steps, seconds = r.number("step"), r.number("s")
    region = read_region(r, speed=False)
    if region.kind not in ("whole", "near", "middle") or region.amount is not None:
        return []
    r.take("stop", "near", "reach", "when")
    items = region.items or r.objects()
    place = _place(r) if not items else ""
    if region.kind == "middle":
        place = "middle"
    duration = steps if steps is not None else seconds
    if duration is not None and duration <= 0:
        return []
    unit = "s" if seconds is not None else "step"
    if waits or duration is not None or len(items) > 1:
        spots: list[tuple[SceneObject, ...]] = [(item,) for item in items] if items else [()]
        return [Intent("wait", items=spot, amount=duration, unit=unit, mode=place) for spot in spots]
    if not items and not place and not r.has("there"):
        return []
    return [Intent("stop", items=items, mode=place)]


def _place(r: Reader) -> str:
    place = "goal" if r.has("goal") else "start" if r.has("start") else ""
    if place:
        r.take(place, "after", "before", "reach", "when", "near")
    return place


def _extend(r: Reader) -> list[Intent]:
    """Continue for 0.4 after the goal; after reaching the goal go to the cup; extend it to reach the lamp."""
    after_goal = r.has("after") and r.has("goal")
    if not (r.has("extend") or after_goal) or r.has("speed", "faster", "slower", "constant"):
        return []
    if r.says("away", "avoid"):
        return []
    bare = r.says("continue", "proceed", "go on", "carry on") and not after_goal
    r.take("extend", "after", "goal", "reach", "away", "when", "near", "distance", "toward")
    smooth = r.take("smooth")
    unit = "straight" if r.take("straight") else ""
    if r.take("between"):
        return [Intent("extend", items=r.objects(), mode="between", unit=unit)]
    directions = r.directions()
    items = r.objects()
    if items and directions:
        return []
    if items:
        return [Intent("extend", items=(item,), mode="to", unit=unit) for item in items]
    degree = r.degree()
    amount = None if directions else r.number("m", "")
    if (smooth or bare) and not directions and amount is None and not after_goal:
        return []
    return [Intent("extend", directions=directions, amount=amount, degree=degree)]


def _endpoint(r: Reader) -> list[Intent]:
    """Shift the start right by 0.2; start from the cup; the new goal is the midpoint of the cup and the plate."""
    start, goal = r.has("start"), r.has("goal")
    if not (start or goal) or r.has("before", "after", "closer", "away", "within"):
        return []
    r.take("start", "goal", "smooth", "near", "reach", "toward", "when")
    actions = [a for a, there in (("move_start", start), ("move_goal", goal)) if there]
    between = r.take("between")
    degree = r.degree()
    directions = r.directions()
    items = r.objects()
    if items and len(directions) == 1 and directions[0][1] is None:
        directions = ((directions[0][0], r.number("m", "")),)
    if items and r.take("over"):
        directions = (("up", r.number("m", "")),)
    if len(directions) == 1 and directions[0][1] is None and not items:
        directions = ((directions[0][0], r.number("m", "")),)
    if (between and len(items) != 2) or not (directions or items) or r.has("than"):
        return []
    if not between and len(items) > 1:
        if len(items) != len(actions) or directions:
            return []
        pairs = zip(actions, items, strict=True)
        return [Intent(action, (), (item,), mode="to", degree=degree) for action, item in pairs]  # type: ignore[arg-type]
    mode = "between" if between else "to" if items else ""
    return [
        Intent(action, directions, items, mode=mode, degree=degree)  # type: ignore[arg-type]
        for action in actions
    ]


def _through(r: Reader) -> list[Intent]:
    """Pass through the middle of the cup and the plate; go over the box; touch the bowl."""
    if not r.has("through", "over") and not (r.has("between") and not r.has("when")):
        return []
    over, between = r.has("over"), r.has("between")
    r.take("through", "over", "between", "pass", "middle", "smooth", "raise", *(["up"] if over else []))
    items = r.objects()
    if not items or (between and len(items) != 2):
        return []
    if between:
        return [Intent("through", items=items, mode="between")]
    height = r.number("m", "") if over else None
    return [Intent("through", items=(item,), amount=height, mode="over" if over else "") for item in items]


def _keep_distance(r: Reader) -> list[Intent]:
    """Keep a distance of at least 0.2 from the cup; stay 0.3 away from the plate."""
    numbers = r.numbers(("", "m"))
    if not numbers or not r.has("distance", "away", "keep") or r.has("speed", "faster", "slower", *DIRECTIONS):
        return []
    bounded = r.has("at_least", "at_most")
    stated = r.has("keep") or (r.has("distance") and not r.has("increase", "decrease", "more", "fewer"))
    if not (bounded or stated) or r.word_before(numbers[0]) == "by":
        return []
    at_most = r.take("at_most")
    r.take("keep", "distance", "away", "at_least", "near", "constant")
    amount = r.take_at(numbers[0]).number
    items = r.objects()
    if not items:
        return []
    return [Intent("keep_distance", items=items, amount=amount, mode="at_most" if at_most else "at_least")]


def _approach(r: Reader) -> list[Intent]:
    """Walk closer to the cup; keep a bigger distance from the plate; the first 5 waypoints closer to the fan."""
    distance = r.has("distance")
    nearer = r.has("closer", "toward") or (distance and r.has("fewer", "decrease", "half"))
    further = r.has("away") or (distance and r.has("more", "increase", "double"))
    changed = r.has("half", "double", "increase", "decrease", "more", "fewer")
    lone = r.has("near") and not (distance or changed or r.has(*DIRECTIONS))
    if (nearer == further and not (lone and not nearer)) or r.has("than") or r.sided():
        return []
    region = read_region(r, speed=False) if not lone or nearer or further else Region()
    whole = r.take("whole")
    r.take("closer", "toward", "away", "distance", "fewer", "more", "decrease", "increase", "keep", "near", "pass")
    items = r.objects()
    if not items and region.kind == "near":
        items, region = region.items, Region()
    if not items:
        return []
    times = r.number("x")
    half, double = r.take("half"), r.take("double")
    if half or double:
        times = 2.0
    target = r.target()
    share = r.number("%") if times is None and target is None else None
    amount = r.number("m") if times is None and target is None else times
    directions = r.directions()
    if amount is None and share is None and target is None:
        amount = r.number("")
    degree = r.degree()
    r.take("waypoints", "whole", "smooth", "when", "reach")
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


def _move(r: Reader) -> list[Intent]:
    """Go left by 0.2; go to the top; the first half 0.1 up."""
    if not r.has(*DIRECTIONS):
        return []
    region = read_region(r, speed=False)
    directions = r.directions()
    degree = r.degree()
    r.take("toward", "waypoints", "smooth", "keep", "pass")
    numbers = [i for i in r.numbers(("m", "")) if r.word_before(i) != "to"]
    if len(directions) == 1 and directions[0][1] is None and numbers:
        directions = ((directions[0][0], r.take_at(numbers[0]).number),)
    return [Intent("move", directions, degree=degree, region=region)]


RULES: tuple[Callable[[Reader], list[Intent]], ...] = (
    _resample,
    *SHAPES,
    read_speed,
    _wait,
    _extend,
    _smooth,
    _keep_distance,
    _approach,
    _endpoint,
    _through,
    _move,
)
"""The families, tried in this order; the first that explains a clause reads it."""
