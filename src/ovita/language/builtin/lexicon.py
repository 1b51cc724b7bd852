"""The built-in writer's words: concepts, and the words and phrases that stand for them.

To teach it a word, add it to the line of its concept. Inflected forms (-s, -ed, -ing, -ly) are found by themselves.
"""

from __future__ import annotations

from functools import cache

CONCEPTS: dict[str, str] = {
    # directions; "lower" and "raise" are settled by context in clauses.py
    "left": "left, leftward, leftwards, left side, left hand side, leftmost",
    "right": "right, rightward, rightwards, right side, right hand side, rightmost",
    "front": "front, forward, forwards, ahead, frontward, frontwards, front side",
    "back": "back, backward, backwards, rear, rearward, rearwards, back side",
    "up": "up, upward, upwards, top, upper, upper part, top part, higher, ascend, rise, climb, lift, elevate, skyward",
    "down": "down, downward, downwards, bottom, bottom part, lower part, descend, sink, dip, ground level",
    "lower": "lower",
    "raise": "raise",
    "height": "height, altitude, elevation",
    # change of speed
    "faster": "faster, quicker, quickly, fast, accelerate, speed up, hurry, hasten, rush, speedier, pick up speed",
    "slower": "slower, slow down, slowly, slow, decelerate, brake, slow up, ease off",
    "speed": "speed, velocity, pace, rate of motion, speeds",
    "constant": "constant, steady, steadily, even",
    "same": "same, fixed, unchanged, unchanging",
    "gradual": "gradually, uniformly, linearly, steadily increasing, progressively, uniform",
    "increase": "increase, grow, boost, add",
    "decrease": "decrease, reduce, lessen, cut, diminish, drop",
    "more": "more, greater, larger, bigger",
    "fewer": "fewer, less, smaller",
    "double": "double, twice, doubled",
    "half": "half, halve, halved, half of",
    "third": "third",
    "quarter": "quarter",
    # relation to an object
    "closer": "closer, nearer, approach, get close, come close, closely",
    "away": "away, further, farther, further away, farther away, avoid, steer clear, clear of, far, distant, far away",
    "toward": "towards, toward, in the direction of",
    "distance": "distance, clearance, gap, separation, space",
    "near": "near, nearby, nearest, nearest to, closest, closest to, close, close to, next to, vicinity,"
    " close vicinity, proximity, close proximity, surrounding, surroundings, neighbourhood, neighborhood, beside,"
    " alongside, adjacent to, in the area of",
    "pass": "pass, cross, traverse, encounter",
    "within": "within, inside",
    "at_least": "at least, minimum, no less than, not less than, more than, min, minimum of",
    "at_most": "at most, maximum, no more than, not more than, less than, max, maximum of",
    "threshold": "threshold, radius, range",
    "between": "between, in between, midpoint, midpoint of, middle of, halfway between",
    "through": "through, via, touch, hit, visit",
    "over": "over, above, on top of, over the top of",
    # parts of the path
    "first": "first, initial, beginning, starting phase, initial phase",
    "last": "last, final phase, ending phase",
    "second": "second, next, other, remaining, latter",
    "middle": "middle, midway, mid, centre, center, halfway",
    "start": "start, starting, starting position, start position, starting point, start point, initial position,"
    " origin, begin, starting location, initial point",
    "goal": "goal, end, ending, destination, finish, goal position, end position, final position, final point,"
    " end point, endpoint, goal point, final goal, target position, final waypoint",
    "whole": "whole, entire, complete, overall, full, all, everything, everywhere, throughout",
    "waypoints": "waypoint, waypoints, point, points, sample, samples, way point, way points",
    "count": "number, count, amount, density, resolution",
    "every": "every, each",
    # what else a path can do
    "stop": "stop, halt, come to rest, come to a stop, come to a halt, standstill",
    "wait": "wait, pause, dwell, hold, remain still, rest, stand still",
    "extend": "extend, continue, prolong, proceed, carry on, go on, lengthen, go further",
    "than": "than",
    "afterwards": "afterwards, thereafter",
    "smooth": "smooth, smoothen, smoothly, smoother, remove sharp turns, less jerky, softer, soften, sharp turns",
    "straight": "straight, directly, in a straight line",
    "remove": "remove, eliminate, get rid of, avoid any",
    "spline": "cubic, spline, function, interpolation, filter, using",
    "keep": "keep, maintain, hold, preserve",
    # order and condition
    "after": "after, once, past, following",
    "before": "before, until, till, prior to",
    "when": "when, while, whenever, during, as",
    "reach": "reach, arrive, get to, hit, reaching",
    "only": "only, just",
    "around": "around, round, about",
    "amplitude": "amplitude",
    "there": "there",
    "ground": "ground, floor, table top",
    "stay": "stay, remain, always, constantly stay",
    "never": "never, do not, don't, dont, not, must not, should not, without",
    "under": "under, below, beneath, underneath",
    "beyond": "exceed, beyond, past the",
    # shapes
    "spiral": "spiral, helix, corkscrew",
    "circle": "circle, revolve, orbit, encircle, circulate, loop around, revolution around",
    "eight": "figure eight, figure of eight, eight shape",
    "zigzag": "zigzag, zig zag, zigzagging, zig zagging",
    "wave": "wave, sinusoid, sinusoidal, sine, sine wave, sinusoidally, wavy, oscillate, undulate, sinewave",
    "hop": "hop over, hop over the top of, jump over, leap over, hop, jump",
    "hover": "hover",
    "turn": "turn, turns, corner, corners, revolutions, loops, rounds, bends, curves, rotations",
    "mirror": "mirror, reflect, flip",
    "rotate": "rotate, rotation",
    "tilt": "tilt, incline, lean",
    "clockwise": "clockwise",
    "anticlockwise": "anticlockwise, counterclockwise, anti clockwise, counter clockwise",
    "axis": "axis",
    "resize": "scale, resize, stretch, expand, enlarge, magnify, shrink, compress, scale up, scale down",
    "curvature": "curvature, curved, curvy, curvier, bendy, bendier, curve",
    "average": "average, mean, centroid",
    "group": "group, groups, batch, block",
    "reverse": "reverse, invert, in reverse order, backwards order, the other way round",
    "noise": "noise, jitter, randomness, random, perturb, perturbation, shake",
    "quadrant": "quadrant",
    "trapezoid": "trapezoid, trapezoidal",
    "exponential": "exponential, exponentially",
    "acceleration": "acceleration, deceleration",
    # how much
    "slight": "slightly, a little, little, a bit, bit, a touch, small, somewhat, a tad, minor, a little bit, tiny",
    "large": "much, a lot, lot, very, far more, significantly, considerably, strongly, a great deal, big, drastically,"
    " way more, substantially, large",
}

FILLER = frozenset(
    """a an the to of by in on at it its is be as for from with this that so into onto towards's
    go move walk drive fly travel run shift translate transfer displace make draw let have get do take bring change
    replace modify adjust set perform execute follow put navigate come push pull traverse steer relocate head aim adapt
    alter update trajectory path route motion movement robot drone arm rover gripper effector vehicle agent course way
    please use can could would you i we me us my your their want like should need to will must shall
    position location place side part region area phase portion rest section zone new value direction itself
    unit units metre metres meter meters m
    are was were am look respectively fashion pattern manner shape shaped style reached profile law
    also too even keeping going such any some certain bit own""".split()
) - {"rest"}

CONNECTIVES = frozenset({"and", "then", "but", "also", "plus", "whereas", "finally"})

UNITS: dict[str, tuple[str, float]] = {
    "m": ("m", 1.0),
    "metre": ("m", 1.0),
    "meter": ("m", 1.0),
    "unit": ("m", 1.0),
    "cm": ("m", 0.01),
    "centimetre": ("m", 0.01),
    "centimeter": ("m", 0.01),
    "mm": ("m", 0.001),
    "millimetre": ("m", 0.001),
    "millimeter": ("m", 0.001),
    "m/s": ("m/s", 1.0),
    "cm/s": ("m/s", 0.01),
    "mps": ("m/s", 1.0),
    "%": ("%", 0.01),
    "percent": ("%", 0.01),
    "time": ("x", 1.0),
    "x": ("x", 1.0),
    "timestep": ("step", 1.0),
    "step": ("step", 1.0),
    "s": ("s", 1.0),
    "sec": ("s", 1.0),
    "second": ("s", 1.0),
    "degree": ("deg", 1.0),
    "deg": ("deg", 1.0),
}
"""Unit word in the singular to (dimension, factor)."""

NUMBER_WORDS: dict[str, float] = {
    **{w: float(i) for i, w in enumerate("zero one two three four five six seven eight nine ten".split())},
    **{w: float(11 + i) for i, w in enumerate("eleven twelve thirteen fourteen fifteen sixteen".split())},
    "twenty": 20.0,
    "thirty": 30.0,
    "forty": 40.0,
    "fifty": 50.0,
    "hundred": 100.0,
}


@cache
def phrases() -> dict[tuple[str, ...], str]:
    """Every phrase, as a tuple of words, to its concept."""
    table: dict[tuple[str, ...], str] = {}
    for concept, listed in CONCEPTS.items():
        for phrase in listed.split(","):
            table.setdefault(tuple(phrase.split()), concept)
    return table


LONGEST_PHRASE = 6


def stems(word: str) -> list[str]:
    """The word itself and the base forms that it may be inflected from."""
    found = [word]
    for ending, replacements in (
        ("ing", ("", "e")),
        ("ed", ("", "e")),
        ("es", ("", "e")),
        ("s", ("",)),
        ("ly", ("",)),
    ):
        if word.endswith(ending) and len(word) > len(ending) + 2:
            base = word[: -len(ending)]
            found += [base + r for r in replacements]
            if len(base) > 3 and base[-1] == base[-2]:
                found.append(base[:-1])
    return found
