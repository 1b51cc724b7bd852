"""Reading clauses about speed."""

from __future__ import annotations

from dataclasses import dataclass

from ovita.instruct.clauses import Reader
from ovita.instruct.intents import Intent, Region
from ovita.instruct.regions import named_heading, read_region
from ovita.instruct.scale import Degree
from ovita.instruct.senses import DIRECTIONS

FRACTIONS = (("half", 0.5), ("third", 1 / 3), ("quarter", 0.25), ("fifth", 0.2), ("tenth", 0.1))

LAWS = ("trapezoid", "exponential", "acceleration")

WORDS = tuple(
    """faster slower speed increase decrease more fewer smooth when reach keep original whole than always multiply
    ramp_up ramp_down""".split()
)
"""Concepts that a clause about speed may hold; each is read before it is taken."""


@dataclass(frozen=True)
class _SpeedClause:
    """The speed words of a clause, before they are combined into intents."""

    region: Region
    slower: bool
    faster: bool
    constant: bool
    gradual: bool
    turns: bool
    law: str
    inverse: bool
    compared: bool
    factor: float | None
    degree: Degree

    def intent(self, mode: str, amount: float | None = None, unit: str = "m/s", count: float | None = None) -> Intent:
        """The intent for this part of the path."""
        return Intent("speed", (), (), amount, unit, count, mode, self.degree, self.region)


def read_speed(r: Reader, *, implied: bool = False) -> list[Intent]:
    """Slow down near the cup; one constant speed of 1; accelerate uniformly; twice as fast within 0.3 of it."""
    if not (implied or _is_about_speed(r)) or _is_otherwise(r):
        return []
    bounded = r.peek("beyond", "than", "over", "under", "at_least", "at_most") and bool(r.numbers(("m/s", "")))
    if r.peek("never") and not bounded:
        return _unchanging(r)
    inverse = r.consume("duration")
    if inverse and r.peek_word("finish", "complete"):
        r.consume("goal")
    both = _between_bounds(r)
    if both:
        return both
    moves = _shift_first(r)
    clause = _speed_clause(r, inverse=inverse)
    for reading in (_turning, _bounded, _between_speeds, _by_law, _reaching, _relative):
        intent = reading(r, clause)
        if intent is not None:
            return [*moves, intent]
    return []


def _is_about_speed(r: Reader) -> bool:
    if r.peek("faster", "slower", "speed", "ramp_up", "ramp_down", *LAWS) or r.numbers(("m/s", "m/s2")):
        return True
    if r.peek("constant"):
        return not r.peek("height", "distance", "away")
    return r.peek("duration") and (r.peek("half", "double", "more", "fewer") or bool(r.numbers(("x",))))


def _is_otherwise(r: Reader) -> bool:
    """Whether words of speed only accompany something else."""
    if (r.peek("turn") and r.peek("faster")) or r.names_a_side() or r.peek("spiral", "circle"):
        return True
    if r.peek("height") and not (r.peek("when") and r.numbers(("m",))):
        return True
    if r.peek("exponential") and r.peek(*DIRECTIONS):
        return True
    return r.peek("constant") and not r.peek("speed", "faster", "slower") and r.peek("distance", "away")


def _speed_clause(r: Reader, *, inverse: bool) -> _SpeedClause:
    """Take the words of a clause about speed."""
    law = next((law for law in LAWS if r.consume(law)), "acceleration" if r.numbers(("m/s2",)) else "")
    turns = r.peek("turn")
    if turns:
        r.consume("turn", "before", "when", "pass", "near", "reach", "every")
    region = read_region(r, speed=True)
    slower = r.peek("slower", "ramp_down") or (r.peek("decrease", "fewer") and not r.peek("faster"))
    faster = r.peek("faster", "increase", "more", "ramp_up") and not r.peek("slower")
    one_speed = r.peek("same") and r.peek("speed") and r.peek_word("same", "fixed", "unchanging", "identical")
    constant = r.consume("constant") or one_speed
    gradual = r.consume("gradual") or r.peek("ramp_up", "ramp_down")
    factor = _multiplied(r)
    compared = r.peek("than") and bool(r.numbers(("m/s",)))
    r.consume(*WORDS, *_idle(r))
    return _SpeedClause(region, slower, faster, constant, gradual, turns, law, inverse, compared, factor, r.degree())


def _turning(r: Reader, clause: _SpeedClause) -> Intent | None:
    """Slow down before the turns."""
    return clause.intent("turns", _factor(r), "") if clause.turns else None


def _between_speeds(r: Reader, clause: _SpeedClause) -> Intent | None:
    """From 0.1 to 0.5 m/s."""
    numbers = r.numbers(("", "m/s"))
    if len(numbers) != 2 or r.word_before(numbers[0]) != "from" or r.word_before(numbers[1]) != "to":
        return None
    first, last = r.consume_at(numbers[0]).number, r.consume_at(numbers[1]).number
    return clause.intent("ramp", last, count=first)


def _by_law(r: Reader, clause: _SpeedClause) -> Intent | None:
    """A trapezoidal profile; accelerate exponentially."""
    if not clause.law:
        return None
    set_to = _target(r, changed=clause.slower or clause.faster)
    amount = set_to if set_to is not None else r.number("m/s2", "m/s", "")
    return clause.intent(f"{clause.law}_down" if clause.slower and not clause.faster else clause.law, amount)


def _reaching(r: Reader, clause: _SpeedClause) -> Intent | None:
    """A speed to reach, at once or steadily, or one speed everywhere."""
    if clause.factor is not None:
        return clause.intent("factor", clause.factor, "x")
    if _from_rest(r):
        r.consume("stop", "wait", "start", "faster")
        return clause.intent("ramp_from", unit="")
    stops = r.consume("stop")
    set_to = _target(r, changed=clause.slower or clause.faster)
    if clause.constant or set_to is not None:
        r.consume("same")
    set_to = 0.0 if stops else set_to
    if set_to is not None:
        steadily = stops or clause.region.kind == "last" or any(t.text.lower().startswith("decel") for t in r.tokens)
        braked = set_to == 0.0 and clause.slower and steadily
        return clause.intent("ramp" if clause.gradual or braked else "set", set_to)
    if clause.gradual and (clause.slower or clause.faster):
        return clause.intent("ramp_down" if clause.slower else "ramp_up", unit="")
    return clause.intent("constant", unit="") if clause.constant and not (clause.slower or clause.faster) else None


def _from_rest(r: Reader) -> bool:
    """Whether the speed begins at 0: "accelerate from standstill", "from a stop"."""
    return any(
        t.value in ("stop", "wait") and "from" in (r.word_before(i), r.word_before(i - 1))
        for i, t in enumerate(r.tokens)
    )


def _relative(r: Reader, clause: _SpeedClause) -> Intent | None:
    """A change relative to the speed as it is."""
    changed = clause.slower or clause.faster or r.peek("double", *(w for w, _ in FRACTIONS)) or r.numbers(("%", "x"))
    return _change(r, clause) if changed else None


def _bounded(r: Reader, clause: _SpeedClause) -> Intent | None:
    """A bound on the speed: "at most 0.3 m/s", "keep the speed below 0.3", "don't exceed 0.5 m/s"."""
    numbers = r.numbers(("m/s",)) or r.numbers(("",))
    never = r.peek("never")
    below = r.peek("under", "at_most") or (clause.compared and clause.slower)
    above = r.peek("over", "at_least", "no_closer") or (clause.compared and clause.faster)
    capped = (above if never else below) or r.peek("limit", "beyond")
    floored = below if never else above
    peak = r.consume("peak")
    capped, floored = (True, False) if peak and clause.slower else (capped, floored)
    if not numbers or capped == floored:
        return None
    r.consume("under", "over", "at_most", "at_least", "limit", "no_closer", "stay", "beyond", "never")
    return clause.intent("cap" if capped else "floor", r.consume_at(numbers[0]).number)


def _between_bounds(r: Reader) -> list[Intent]:
    """A speed between two others: "keep the speed between 0.2 and 0.4 m/s"."""
    numbers = r.numbers(("m/s",))
    if len(numbers) != 2 or not r.consume("between"):
        return []
    low, high = (r.consume_at(i).number for i in numbers)
    region = read_region(r, speed=True)
    r.consume("speed", "keep", "stay", "whole", "always")
    amounts = (("cap", high), ("floor", low))
    return [Intent("speed", amount=amount, unit="m/s", mode=mode, region=region) for mode, amount in amounts]


def _idle(r: Reader) -> tuple[str, ...]:
    """Concepts that say nothing more in a clause about speed: "proceed slowly", "zip through the motion"."""
    if any(t.items and not r.taken[i] for i, t in enumerate(r.tokens)) or r.numbers(("m",)):
        return ()
    return ("extend", "through", "straight", "toward", "around", *(() if r.numbers(("m/s",)) else ("over",)))


def _unchanging(r: Reader) -> list[Intent]:
    """Read "don't change speed", "without speeding up or slowing down": a constant speed."""
    denied = r.peek("slower") and r.peek("faster")
    changed = any(t.text.lower() in ("change", "changing", "vary", "varying", "changes", "alter") for t in r.tokens)
    plain = r.peek("speed") and changed and not r.peek("slower", "faster", "increase", "decrease", "more", "fewer")
    if not (denied or plain) or any(t.items for t in r.tokens):
        return []
    r.consume("never", "slower", "faster", "speed", "whole", "gradual", "keep", "constant", "when", "original")
    return [Intent("speed", mode="constant")]


def _shift_first(r: Reader) -> list[Intent]:
    """Read the direction in "go right and come to a stop" as a move, unless it says when to change speed."""
    i = next((k for k, t in enumerate(r.tokens) if t.value in DIRECTIONS and not r.taken[k]), None)
    if i is None:
        return []
    j = r.before(i)
    if (j is not None and r.tokens[j].value == "when") or named_heading(r.tokens, i):
        return []
    placed = r.find("when")
    if placed is not None and placed < i and r.numbers(("m",)):
        return []  # "when higher than 1 m"
    beside = [k for k in (j, r.after(i)) if k is not None and r.tokens[k].value in ("slight", "large")]
    degree: Degree = "moderate"
    if beside:
        degree = "slight" if r.consume_at(beside[0]).value == "slight" else "large"
    return [Intent("move", r.directions(), degree=degree)]


def _multiplied(r: Reader) -> float | None:
    """A factor: "multiply the speed by 0.5", "0.75 of the current speed"."""
    bare = r.numbers(("",))
    if r.peek("multiply") and bare:
        return r.consume_at(bare[0]).number
    for i in bare:
        behind = r.tokens[i + 1].text.lower() if i + 1 < len(r.tokens) else ""
        if behind == "of" and r.peek("original"):
            return r.consume_at(i).number
    if r.peek("multiply") and r.numbers(("x",)):
        return r.number("x")
    return None


def _target(r: Reader, *, changed: bool) -> float | None:
    """A speed to reach: "to 0.5", "of 1", "at 0.3 m/s"; not "by 0.2"."""
    for i in r.numbers(("", "m/s")):
        before = r.word_before(i)
        if before == "of" and changed and r.tokens[i].unit == "":
            continue
        stated = before in ("to", "of", "at", "is", "be", "equal", "equals", "exactly")
        if stated or (r.tokens[i].unit == "m/s" and before != "by" and not changed):
            return r.consume_at(i).number
    return None


def _share_kept(r: Reader) -> float | None:
    """Take the share of the speed that is left: "to 30 %", "at 50 % speed", "30 % as fast"."""
    for i in r.numbers(("%",)):
        behind = r.tokens[i + 1].text.lower() if i + 1 < len(r.tokens) else ""
        if r.word_before(i) in ("to", "at", "of", "with") or behind in ("as", "of") or behind.endswith("speed"):
            return r.consume_at(i).number
    return None


def _stated_by(r: Reader, word: str) -> bool:
    """Whether a fraction is the size of a change: "by half", "by a third"."""
    i = r.find(word)
    return i is not None and "by" in [r.word_before(i), r.word_before(i - 1) if i > 0 else ""]


def _factor(r: Reader) -> float | None:
    """A share of the speed: by half, by 30 %."""
    if r.consume("half"):
        return 0.5
    share = r.number("%")
    return None if share is None else max(0.0, 1 - share)


def _change(r: Reader, clause: _SpeedClause) -> Intent:
    """A relative change: by half, two times, by 20 %, by 0.2 m/s, or a word of degree; or that of the time taken."""
    factor = _stated_factor(r, clause)
    if factor is not None:
        return clause.intent("factor", 1 / factor if clause.inverse and factor else factor, "x")
    steps = [i for i in r.numbers(("m/s", "")) if r.word_before(i) == "by" or r.tokens[i].unit == "m/s"]
    if steps:
        step = r.consume_at(steps[0]).number
        return clause.intent("add", -step if clause.slower else step)
    return clause.intent("slower" if clause.slower != clause.inverse else "faster", unit="")


def _stated_factor(r: Reader, clause: _SpeedClause) -> float | None:
    """The factor that a clause states, or None."""
    by = any(_stated_by(r, word) for word, _ in FRACTIONS)
    fraction = next((f for w, f in FRACTIONS if r.consume(w)), None)
    double = r.consume("double")
    kept = _share_kept(r)
    times, share = r.number("x"), r.number("%")
    if kept is not None:
        return kept
    if fraction is not None:
        return fraction if not by else 1 - fraction if clause.slower else 1 + fraction
    slower = clause.slower and not clause.inverse
    if double:
        return 0.5 if slower else 2.0
    if times is not None and times > 0:
        return min(times, 1 / times) if slower else times
    if share is not None:
        return max(0.0, 1 - share) if clause.slower else 1 + share
    return None
