"""Clauses about the path: shifts, endpoints, via points, stops and invariants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ovita.instruct.clauses import Reader
from ovita.instruct.distances import VERBS
from ovita.instruct.intents import Intent
from ovita.instruct.regions import read_region
from ovita.instruct.senses import DIRECTIONS, SPEED
from ovita.instruct.tokens import AXES
from ovita.paths.frame import Frame
from ovita.paths.scene import SceneObject

CHANGING = frozenset(
    "change changing alter altering modify modifying touch touching affect affecting move moving".split()
)
PATH_WORDS = frozenset("path trajectory route shape course line".split())
STAYING = frozenset("same fixed unchanged unchanging untouched intact alone".split())

PLACES = frozenset("near first last second middle half third quarter waypoints after before start goal".split())

CHANGES = (
    "faster",
    "slower",
    "closer",
    "away",
    "more",
    "fewer",
    "increase",
    "decrease",
    "stop",
    "through",
    "over",
    *DIRECTIONS,
)


def read_kept(r: Reader) -> list[Intent]:
    """Keep the start and the goal where they are; don't change the speed; leave the first half untouched."""
    if _only_elsewhere(r):
        r.consume("never", "when", "only")
        region = read_region(r, speed=True)
        if region.kind != "whole":
            return [Intent("same", mode="part", region=region)]
    if _keeps_pace(r):
        r.consume("never", "slower", "faster", "keep", "speed")
        return [Intent("same", mode="speed")]
    words = {w for t in r.tokens for w in t.text.lower().split()}
    denied = r.peek("never") and bool(words & CHANGING) and not words & {"along", "throughout", "ever", "way"}
    stays = bool(words & STAYING) or ("where" in words and bool(words & {"are", "is"}))
    stays = stays or (r.peek("keep") and {"in", "place"} <= words)
    stays = stays or r.peek_word("as it is", "as they are", "as is", "the way it is", "the way they are")
    stays = stays and not r.peek("constant", "stop", "wait")
    if not (denied or stays) or r.peek(*CHANGES) or any(t.items for t in r.tokens) or r.numbers(("m", "m/s", "deg")):
        return []
    targets = [name for name in ("start", "goal", "speed") if r.peek(name)]
    if ("start" not in targets and words & {"endpoints", "ends"}) or {"end", "points"} <= words:
        targets = ["start", "goal"]
    if "speed" in targets and not denied and not words & {"unchanged", "untouched", "intact", "alone"}:
        return []  # "the same speed" is one speed everywhere
    if not targets and words & PATH_WORDS:
        targets = ["path"]
    if not targets and r.consume("whole"):
        targets = ["rest"]
    r.consume(
        "start",
        "goal",
        "speed",
        "never",
        "same",
        "keep",
        "when",
        "stay",
        "through",
        "original",
        "whole",
        "only",
        "constant",
    )
    for i, token in enumerate(r.tokens):
        r.taken[i] = r.taken[i] or token.text.lower() in STAYING | CHANGING
    if not targets:
        region = read_region(r, speed=True)
        return [] if region.kind == "whole" else [Intent("same", mode="part", region=region)]
    return [Intent("same", mode=target) for target in targets]


def _only_elsewhere(r: Reader) -> bool:
    """Whether a clause is nothing but "not near the plate", "but not in the last half"."""
    said = {t.value for t in r.tokens if t.kind == "concept"}
    plain = not any(w in VERBS for t in r.tokens for w in t.text.lower().split())
    return "never" in said and len(said) > 1 and said <= {"never", "when", "only", *PLACES} and plain


def _keeps_pace(r: Reader) -> bool:
    """Whether a clause is nothing but "without slowing down"."""
    said = {t.value or t.kind for i, t in enumerate(r.tokens) if not r.taken[i]}
    return said == {"keep", "speed"} or (said in ({"never", "slower"}, {"never", "faster"}) and r.any_word("without"))


def changes(intents: Sequence[Intent]) -> bool:
    """Whether the clause requests any change."""
    return not intents or any(intent.action != "same" for intent in intents)


PLACING = frozenset("at near toward towards in by until till from to before after over".split())
"""Words before "the goal" that make a part of the path of it."""

CARRYING = frozenset("move shift bring put place pull set drag relocate".split())


def read_aim(r: Reader) -> list[Intent]:
    """Move the goal 0.1 closer to the cup; move waypoint 25 to the buoy."""
    items = [i for i, t in enumerate(r.tokens) if t.items and not r.taken[i]]
    if len(items) != 1 or len(r.tokens[items[0]].items) != 1 or r.peek(*SPEED, *DIRECTIONS, "never", "stop", "wait"):
        return []
    return _end_aim(r, items[0]) or _carried(r, items[0])


def read_level(r: Reader) -> list[Intent]:
    """Descend to 9 m depth at the end; the goal should be at a height of 0.5 m."""
    ends = [name for name in ("start", "goal") if r.peek(name)]
    numbers = r.numbers(("m", ""))
    if (
        len(ends) != 1
        or len(numbers) != 1
        or any(t.items for t in r.tokens)
        or r.peek(*SPEED, "never", "left", "right")
    ):
        return []
    reached = r.word_before(numbers[0]) == "to" and r.peek("up", "down", "height", "ground")
    if not (reached or (r.peek("height") and r.word_before(numbers[0]) in ("of", "at"))) or r.peek(
        "at_least", "at_most"
    ):
        return []
    deep = any(t.text.lower() in ("depth", "deep") for t in r.tokens)
    r.consume(
        "up", "down", "height", "over", "ground", "gradual", ends[0], "toward", "when", "keep", "stay", "near", "reach"
    )
    amount = r.consume_at(numbers[0]).number
    return [Intent("aim", (), (), -amount if deep else amount, "level", None, ends[0])]


def _end_aim(r: Reader, item: int) -> list[Intent]:
    ends = [name for name in ("start", "goal") if r.peek(name)]
    if len(ends) != 1 or not r.peek("closer", "away") or r.peek("distance", "at_least", "half", "double"):
        return []
    i = r.find(ends[0]) or 0
    words = [t.text.lower() for t in r.tokens[max(i - 2, 0) : i]]
    if i > item or PLACING & set(words) or r.numbers(("x", "%", "s", "step")) or r.target() is not None:
        return []
    away = r.consume("away") and not r.peek("closer")
    r.consume(ends[0], "closer", "away", "more", "near", "toward")
    degree = r.degree()
    amount = r.number("m", "")
    return [Intent("aim", (), r.objects(), amount, "away" if away else "closer", None, ends[0], degree)]


def _carried(r: Reader, item: int) -> list[Intent]:
    first = r.tokens[0].text.lower() if r.tokens else ""
    to = "to" in (r.word_before(item), r.word_before(item - 1))
    if not (first in CARRYING and to and r.peek("waypoints")) or r.peek("closer", "away", "near", "through"):
        return []
    region = read_region(r, speed=False)
    if region.kind != "range" or region.until != region.amount:
        return []
    return [Intent("carry", (), r.objects(), region=region)]


def read_return(r: Reader) -> list[Intent]:
    """Return to the start at the end; go back to the start after reaching the goal."""
    start = r.find("start")
    if not r.peek("undo") or start is None or any(t.items for t in r.tokens) or r.peek(*SPEED, *DIRECTIONS):
        return []
    if not r.peek_word("return", "return to", "go back to", "come back to", "returning", "returning to"):
        return []
    r.consume("undo", "start", "after", "goal", "reach", "when", "straight")
    return [Intent("return")]


def read_axis(r: Reader) -> list[Intent]:
    """Shift it by 0.3 in y; 0.1 m along the negative x axis; increase z by 0.2."""
    letters = [i for i, t in enumerate(r.tokens) if t.text.lower() in AXES and not r.taken[i]]
    if len(letters) != 1 or r.peek(*DIRECTIONS, *SPEED, "never", "start", "goal") or any(t.items for t in r.tokens):
        return []
    amount = r.number("m", "")
    if amount is None:
        return []
    against = r.consume("decrease", "fewer") or r.peek_word("negative", "minus", "subtract")
    for i, token in enumerate(r.tokens):
        r.taken[i] = r.taken[i] or token.text.lower() in ("negative", "minus", "positive", "plus", "subtract")
    axis = r.letter()
    region = read_region(r, speed=False)
    r.consume("increase", "waypoints", "axis", "whole", "more")
    return [Intent("move", ((axis, -amount if against else amount),), region=region)]


def in_frame(intent: Intent, frame: Frame) -> Intent:
    """Name the axes of a move by the direction words of a frame; a shift against a direction goes the other way."""
    if not any(word in AXES for word, _ in intent.directions):
        return intent
    directions: list[tuple[str, float | None]] = []
    for word, amount in intent.directions:
        if word in AXES and amount is not None:
            vector = [amount if axis == word else 0.0 for axis in AXES]
            directions += list(frame.words(np.array(vector)).items())
        else:
            directions.append((word, amount))
    return replace(intent, directions=tuple(directions))


ENDING = frozenset("end finish conclude terminate complete wind finishing ending".split())


def read_resample(r: Reader) -> list[Intent]:
    """Double the number of waypoints; fewer waypoints; 80 waypoints; a finer sampling."""
    finer, coarser = r.peek("denser"), r.peek("sparser")
    others = (
        "average",
        "mirror",
        "rotate",
        "first",
        "last",
        "distance",
        "speed",
        "smooth",
        "wait",
        "between",
        *DIRECTIONS,
    )
    if (
        not (r.peek("waypoints", "count") or finer or coarser)
        or r.peek("slower", "faster", *others)
        or (r.peek("every") and not coarser)
    ):
        return []
    numbers = r.numbers(("",))
    if any(t.items for t in r.tokens):
        return []
    if not (r.peek("count", "more", "fewer", "double", "half", "increase", "decrease") or numbers or finer or coarser):
        return []
    relative = bool(numbers) and (r.word_before(numbers[0]) in ("by", "add") or r.peek("more", "fewer"))
    number = r.consume_at(numbers[0]).number if numbers else None
    if number is not None and not 1 <= number <= 100_000:
        return []
    double, half = r.consume("double"), r.consume("half")
    less = r.consume("decrease", "fewer", "sparser") or half
    r.consume(
        "increase",
        "more",
        "count",
        "waypoints",
        "keep",
        "denser",
        "every",
        "second",
        "whole",
        "original",
        "remove",
        "than",
    )
    times, share = r.number("x"), r.number("%")
    if number is not None and relative:
        return [Intent("resample", amount=-number if less else number, unit="more")]
    if number is not None:
        return [Intent("resample", amount=number, unit="waypoints")]
    if share is not None:
        times, less = (max(1 - share, 0.01) if less else 1 + share), False
    if times is not None:
        return [Intent("resample", amount=1 / times if less and times else times, unit="x")]
    degree = r.degree()
    factor = 0.5 if less else 2.0
    assumed = not (double or half)
    return [Intent("resample", amount=factor, unit="x", mode="assumed" if assumed else "", degree=degree)]


def read_smooth(r: Reader) -> list[Intent]:
    """Smoothen the trajectory; remove sharp turns."""
    calmed = r.peek("noise") and r.peek("remove", "decrease", "fewer", "away", "never")
    if not (r.peek("smooth") or calmed) or r.peek("extend", "after", "through", "over", "between", *SPEED):
        return []
    items = any(t.items for t in r.tokens)
    if r.peek("closer", "toward", *DIRECTIONS) or (r.peek("away") and items) or (r.peek("start", "goal") and items):
        return []
    if r.peek("start", "goal") and r.numbers(("m", "")):
        return []
    r.consume(
        "smooth",
        "spline",
        "decrease",
        "more",
        "whole",
        "remove",
        "reach",
        "away",
        "turn",
        "fewer",
        "noise",
        "never",
        "increase",
    )
    return [Intent("smooth", degree=r.degree())]


def read_wait(r: Reader) -> list[Intent]:
    """Stop at the fan for 5 timesteps; wait at the goal; stop when you reach the lamp."""
    ends = any(t.value == "goal" and _is_deed(r, i) for i, t in enumerate(r.tokens))
    ends = ends and r.peek("near") and any(t.items for t in r.tokens)
    if not (r.peek("stop", "wait") or ends) or r.peek("never"):
        return []
    if any(t.value in ("stop", "wait") and r.word_before(i) == "from" for i, t in enumerate(r.tokens)):
        return []  # "begin from rest"
    if any(r.word_before(i) in ("after", "before") for i in r.numbers(("s", "step"))):
        return []  # "stop after 3 s"
    if r.peek("hover", "spiral", "speed", *DIRECTIONS):
        return []
    waits = r.consume("wait")
    steps, seconds = r.number("step"), r.number("s")
    bare = r.numbers(("",))
    if waits and steps is None and seconds is None and bare and r.tokens[r.after(bare[0]) or 0].value == "waypoints":
        steps = r.consume_at(bare[0]).number
        r.consume("waypoints", "count")
    waypoint = ""
    region = read_region(r, speed=False)
    if region.kind == "after" and len(region.items) == 1:
        region = replace(region, kind="near")  # "halt once you get to the cup"
    if region.kind == "range" and region.until == region.amount and not r.peek("start", "goal"):
        waypoint = f"#{round(region.amount or 1)}"
    elif region.kind not in ("whole", "near", "middle") or (region.amount is not None and region.kind == "near"):
        return []
    r.consume("stop", "near", "reach", "when", "after", "pass", "slight", "around", "away", "every")
    items = region.items or r.objects()
    place = waypoint or (_place(r) if not items else "")
    if items:
        r.consume("goal")
    if region.kind == "middle":
        place = "middle"
    duration = steps if steps is not None else seconds
    if duration is not None and duration <= 0:
        return []
    unit = "s" if seconds is not None else "step"
    if waits or duration is not None or len(items) > 1:
        spots: list[tuple[SceneObject, ...]] = [(item,) for item in items] if items else [()]
        return [Intent("wait", items=spot, amount=duration, unit=unit, mode=place) for spot in spots]
    if not items and not place and not r.peek("there"):
        return []
    return [Intent("stop", items=items, mode=place)]


def _is_deed(r: Reader, i: int) -> bool:
    """Whether a word for the end is something to do, "finish near the cup", rather than a place, "the finish"."""
    words = r.tokens[i].text.lower().split()
    return words[0] in ENDING and r.word_before(i) not in ("the", "new", "its", "my", "your", "a")


def _place(r: Reader) -> str:
    place = "goal" if r.peek("goal") else "start" if r.peek("start") else ""
    if place:
        r.consume(place, "after", "before", "reach", "when", "near")
    return place


def read_extend(r: Reader) -> list[Intent]:
    """Continue for 0.4 after the goal; after reaching the goal go to the cup; extend it to reach the lamp."""
    done = any(t.value == "goal" and t.text.lower().endswith("ed") for t in r.tokens)
    passed = r.peek("when") and (r.peek("reach") or done) and not any(t.items for t in r.tokens)
    beyond = (
        r.peek("beyond")
        or (r.peek("pass") and not r.peek("when"))
        or (r.peek_word("away", "further", "farther") and bool(r.numbers(("m",))))
    )
    adds = r.peek_word("add", "append") and r.peek("goal")
    after_goal = (r.peek("after") or passed or beyond or adds) and r.peek("goal")
    if not (r.peek("extend") or after_goal) or r.peek("speed", "faster", "slower", "constant", "never", "start"):
        return []
    if r.peek_word("away", "avoid"):
        return []
    bare = r.peek_word("continue", "proceed", "go on", "carry on") and not after_goal
    r.consume(
        "extend",
        "after",
        "goal",
        "reach",
        "away",
        "when",
        "near",
        "distance",
        "toward",
        "beyond",
        "more",
        "pass",
        "original",
    )
    r.consume("whole", "increase")
    smooth = r.consume("smooth")
    unit = "straight" if r.consume("straight") else ""
    if r.consume("between"):
        return [Intent("extend", items=r.objects(), mode="between", unit=unit)]
    directions = r.directions()
    items = r.objects()
    if items and directions:
        return []
    if items:
        return [Intent("extend", items=(item,), mode="to", unit=unit) for item in items]
    degree = r.degree()
    if len(directions) == 1 and directions[0][1] is None:
        directions = ((directions[0][0], r.number("m", "")),)
    amount = None if directions else r.number("m", "")
    if (smooth or bare) and not directions and amount is None and not after_goal:
        return []
    if r.word_before(0) and not directions and amount is None and r.numbers(("%", "x")):
        return []
    return [Intent("extend", directions=directions, amount=amount, degree=degree)]


def read_endpoint(r: Reader) -> list[Intent]:
    """Shift the start right by 0.2; start from the cup; the new goal is the midpoint of the cup and the plate."""
    start, goal = r.peek("start"), r.peek("goal")
    if any(t.text.lower() in ("endpoints", "end points", "ends") and t.value == "goal" for t in r.tokens):
        start = goal = True
    if (
        not (start or goal)
        or r.target_ahead()
        or r.peek("before", "after", "closer", "away", "within", "never", *SPEED)
    ):
        return []
    r.consume(
        "start",
        "goal",
        "smooth",
        "near",
        "reach",
        "toward",
        "when",
        "more",
        "only",
        "original",
        "over" if r.peek("up", "down") else "only",
    )
    r.consume(
        "waypoints", "there" if any(t.items for t in r.tokens) else "only", "middle" if r.peek("between") else "only"
    )
    actions = [a for a, there in (("move_start", start), ("move_goal", goal)) if there]
    between = r.consume("between")
    degree = r.degree()
    directions = r.directions()
    items = r.objects()
    if items and len(directions) == 1 and directions[0][1] is None:
        directions = ((directions[0][0], r.number("m", "")),)
    if items and r.consume("over"):
        directions = (("up", r.number("m", "")),)
    if items and r.consume("under"):
        directions = (("down", r.number("m", "")),)
    if len(directions) == 1 and directions[0][1] is None and not items:
        directions = ((directions[0][0], r.number("m", "")),)
    if (between and len(items) != 2) or not (directions or items) or r.peek("than"):
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


def read_through(r: Reader) -> list[Intent]:
    """Pass between the cup and the plate; go over the box; touch the bowl."""
    if not r.peek("through", "over", "under") and not (r.peek("between") and not r.peek("when")):
        return []
    if r.peek("stay", "always", "keep", "around") or (r.peek("under") and r.peek("down") and r.numbers(("m",))):
        return []
    if r.peek("never", "away", *SPEED):
        return []
    if r.peek("between") and r.peek(*DIRECTIONS):
        return []
    over_it = r.peek("over")
    lengths = r.numbers(("m", ""))
    by = bool(lengths) and r.word_before(lengths[0]) == "by"
    if (r.peek("up") and (by or not r.peek_word("up", "lift", "raise", "climb", "rise"))) or (
        r.peek("down") and over_it
    ):
        return []  # "5 cm higher over the plate", "lift it by 5 cm over the plate", "lower over the plate"
    raised = "raised" if r.peek("up") and lengths else ""
    over, between, under = r.peek("over"), r.peek("between"), r.peek("under")
    r.consume("through", "over", "under", "between", "pass", "middle", "smooth", "raise", "distance", "whole", "height")
    r.consume("increase" if r.peek_word("add") else "through")
    r.consume(*(["up", "near"] if over else ["down"] if under else []))
    items = r.objects()
    r.consume("when")
    if not items or (between and len(items) != 2):
        return []
    if between:
        return [Intent("through", items=items, mode="between")]
    r.consume("at_least")
    height = r.number("m", "") if over or under else None
    mode = "over" if over else "under" if under else ""
    unit = raised if over else ""
    return [Intent("through", items=(item,), amount=height, unit=unit, mode=mode) for item in items]


def read_move(r: Reader) -> list[Intent]:
    """Go left by 0.2; go to the top; the first half 0.1 up."""
    if not r.peek(*DIRECTIONS) or r.peek("never"):
        return []
    local = any(t.items for t in r.tokens) and (r.peek("between", "over") or r.any_word("at"))
    region = read_region(r, speed=local)
    directions = r.directions()
    if not directions:
        return []
    degree = r.degree()
    r.consume(
        "toward",
        "waypoints",
        "smooth",
        "keep",
        "pass",
        "original",
        "stay",
        "more",
        "only",
        "whole",
        "always",
        "over",
        "distance",
    )
    numbers = [i for i in r.numbers(("m", "")) if r.word_before(i) != "to"]
    if len(directions) == 1 and directions[0][1] is None and numbers:
        directions = ((directions[0][0], r.consume_at(numbers[0]).number),)
    return [Intent("move", directions, degree=degree, region=region)]
