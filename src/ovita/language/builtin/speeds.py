"""Reading clauses about speed."""

from __future__ import annotations

from ovita.language.builtin.clauses import DIRECTIONS
from ovita.language.builtin.intents import WHOLE, Intent, Region
from ovita.language.builtin.reader import Reader
from ovita.language.builtin.regions import read_region
from ovita.language.scale import Degree


def read_speed(r: Reader, *, implied: bool = False) -> list[Intent]:
    """Slow down near the cup; move at a constant speed of 1; accelerate uniformly; twice as fast within 0.3 of it."""
    laws = ("trapezoid", "exponential", "acceleration")
    about_speed = implied or r.has("faster", "slower", "speed", *laws) or bool(r.numbers(("m/s",)))
    about_speed = about_speed or (r.has("constant") and bool(r.numbers(("",))))
    if not about_speed or (r.has("turn") and r.has("faster")) or r.sided():
        return []
    if r.has("height") or (r.has("exponential") and r.has(*DIRECTIONS)):
        return []
    if r.has("constant") and not r.has("speed", "faster", "slower") and r.has("distance", "away"):
        return []
    moves = _shift_first(r)
    law = next((law for law in laws if r.take(law)), "")
    turns = r.has("turn")
    if turns:
        r.take("turn", "before", "when", "pass", "near", "reach")
    region = read_region(r, speed=True)
    slower = r.has("slower") or (r.has("decrease", "fewer") and not r.has("faster"))
    faster = r.has("faster", "increase", "more") and not r.has("slower")
    constant = r.take("constant")
    gradual = r.take("gradual")
    r.take("keep")
    r.take("faster", "slower", "speed", "increase", "decrease", "more", "fewer", "smooth", "when", "reach")
    degree = r.degree()
    stops = r.take("stop")
    set_to = _target(r)
    if stops:
        set_to = 0.0
    intent: Intent | None = None
    if turns:
        return [*moves, Intent("speed", mode="turns", degree=degree, amount=_factor(r), region=region)]
    if law:
        amount = set_to if set_to is not None else r.number("m/s", "")
        mode = f"{law}_down" if slower and not faster else law
        return [*moves, Intent("speed", amount=amount, unit="m/s", mode=mode, region=region)]
    if set_to is not None and (gradual or (slower and set_to == 0.0)):
        intent = Intent("speed", amount=set_to, unit="m/s", mode="ramp", region=region)
    elif gradual and (slower or faster):
        intent = Intent("speed", mode="ramp_down" if slower else "ramp_up", degree=degree, region=region)
    elif set_to is not None:
        intent = Intent("speed", amount=set_to, unit="m/s", mode="set", region=region)
    elif constant and not (slower or faster):
        intent = Intent("speed", mode="constant", region=region)
    elif slower or faster or r.has("double", "half") or r.numbers(("%",)):
        intent = _change(r, slower=slower, degree=degree, region=region)
    return [] if intent is None else [*moves, intent]


def _shift_first(r: Reader) -> list[Intent]:
    """Read the direction in "go right and come to a stop" as a move, unless it says when to change speed."""
    i = next((k for k, t in enumerate(r.tokens) if t.value in DIRECTIONS and not r.taken[k]), None)
    if i is None:
        return []
    j = r.before(i)
    if j is not None and r.tokens[j].value == "when":
        return []
    beside = [k for k in (j, r.after(i)) if k is not None and r.tokens[k].value in ("slight", "large")]
    degree: Degree = "moderate"
    if beside:
        degree = "slight" if r.take_at(beside[0]).value == "slight" else "large"
    return [Intent("move", r.directions(), degree=degree)]


def _target(r: Reader) -> float | None:
    """A speed to reach: "to 0.5", "of 1", "at 0.3 m/s"; not "by 0.2"."""
    for i in r.numbers(("", "m/s")):
        before = r.word_before(i)
        if before in ("to", "of", "at", "is", "be") or (r.tokens[i].unit == "m/s" and before != "by"):
            return r.take_at(i).number
    return None


def _share_kept(r: Reader) -> float | None:
    """Take the share of the speed that is left: "to 30 %", "at 50 % speed", "30 % as fast"."""
    for i in r.numbers(("%",)):
        behind = r.tokens[i + 1].text.lower() if i + 1 < len(r.tokens) else ""
        if r.word_before(i) in ("to", "at", "of") or behind in ("as", "speed"):
            return r.take_at(i).number
    return None


def _factor(r: Reader) -> float | None:
    """A share of the speed: by half, by 30 %."""
    if r.take("half"):
        return 0.5
    share = r.number("%")
    return None if share is None else max(0.0, 1 - share)


def _change(r: Reader, *, slower: bool, degree: Degree, region: Region = WHOLE) -> Intent:
    """A relative change: by half, two times, by 20 %, by 0.2 m/s, or a word of degree."""
    half_at = r.find("half")
    more = half_at is not None and r.word_before(half_at) == "by" and not slower
    double, half = r.take("double"), r.take("half")
    kept = _share_kept(r)
    times, share = r.number("x"), r.number("%")
    steps = [i for i in r.numbers(("m/s", "")) if r.word_before(i) == "by"]
    step = r.take_at(steps[0]).number if steps else None
    factor = kept
    if factor is None and half:
        factor = 1.5 if more else 0.5
    elif factor is None and double:
        factor = 0.5 if slower else 2.0
    elif factor is None and times is not None and times > 0:
        factor = min(times, 1 / times) if slower else times
    elif factor is None and share is not None:
        factor = max(0.0, 1 - share) if slower else 1 + share
    if factor is not None:
        return Intent("speed", amount=factor, unit="x", mode="factor", region=region)
    if step is not None:
        return Intent("speed", amount=-step if slower else step, unit="m/s", mode="add", region=region)
    mode = "slower" if slower else "faster"
    return Intent("speed", mode=mode, degree=degree, region=region)
