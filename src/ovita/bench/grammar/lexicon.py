"""Words: how each kind of clause can be said, in two splits that share no phrase.

The train split holds the public grammar of LaTTe (Bucker et al., ICRA 2023) and plain ways to say the numeric clauses.
Every phrase of the held-out split has at least one word that occurs nowhere in the train split.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Literal

Split = Literal["train", "heldout"]

Phrases = Mapping[Split, tuple[str, ...]]

DEGREES: Mapping[str, Phrases] = {
    "little": {"train": ("a bit", "a little"), "heldout": ("slightly", "a tad", "marginally")},
    "much": {"train": ("much", "a lot", "very much"), "heldout": ("considerably", "noticeably", "substantially")},
}

SIDES: Mapping[str, Phrases] = {
    "left": {"train": ("left",), "heldout": ("leftward", "leftwards")},
    "right": {"train": ("right",), "heldout": ("rightward", "rightwards")},
    "front": {"train": ("forward", "to the front"), "heldout": ("ahead", "frontwards")},
    "back": {"train": ("backward", "to the back"), "heldout": ("rearward", "rearwards")},
    "up": {"train": ("up",), "heldout": ("upward", "higher")},
    "down": {"train": ("down",), "heldout": ("downward", "lower")},
}

PLACES: Mapping[str, Phrases] = {
    "left": {"train": ("left",), "heldout": ("left-hand side",)},
    "right": {"train": ("right",), "heldout": ("right-hand side",)},
    "front": {"train": ("front",), "heldout": ("fore",)},
    "back": {"train": ("back",), "heldout": ("rear",)},
    "up": {"train": ("top", "upper part"), "heldout": ("uppermost region",)},
    "down": {"train": ("bottom", "bottom part"), "heldout": ("lowermost region",)},
}

NAMES: Phrases = {
    "train": (
        "cup", "plate", "bottle", "lamp", "chair", "table", "plant", "laptop", "basket", "bowl", "book", "ball",
        "kettle", "printer", "sofa", "door", "vase", "keyboard", "backpack", "helmet", "red mug", "toy car",
        "wooden crate", "coffee machine", "tool box",
    ),
    "heldout": (
        "teapot", "saucer", "thermos", "lantern", "stool", "bench", "cactus", "tablet", "bucket", "ladle", "notebook",
        "balloon", "toaster", "scanner", "armchair", "gate", "urn", "guitar", "suitcase", "drum", "green jug",
        "model train", "steel barrel", "wicker hamper", "fire extinguisher",
    ),
}  # fmt: skip

CLAUSES: Mapping[str, Phrases] = {
    "closer": {
        "train": (
            "walk {degree} closer to the {obj}",
            "drive {degree} closer to the {obj}",
            "pass {degree} closer to the {obj}",
            "stay {degree} closer to the {obj}",
            "keep a smaller distance from the {obj}",
        ),
        "heldout": (
            "approach the {obj} {degree}",
            "come {degree} nearer to the {obj}",
            "reduce the gap to the {obj} {degree}",
            "shrink the separation from the {obj} {degree}",
        ),
    },
    "farther": {
        "train": (
            "walk {degree} further away from the {obj}",
            "drive {degree} further away from the {obj}",
            "pass {degree} further away from the {obj}",
            "stay {degree} further away from the {obj}",
            "keep a bigger distance from the {obj}",
        ),
        "heldout": (
            "give the {obj} a {degree} wider berth",
            "shy away from the {obj} {degree}",
            "increase the clearance to the {obj} {degree}",
            "steer {degree} clear of the {obj}",
        ),
    },
    "slower": {
        "train": (
            "walk {degree} slower when passing close to the {obj}",
            "go {degree} slower while passing next to the {obj}",
            "drive {degree} slower in the proximity of the {obj}",
            "reduce the speed {degree} when passing nearby the {obj}",
            "go {degree} slower near the {obj}",
        ),
        "heldout": (
            "decelerate {degree} around the {obj}",
            "ease off {degree} beside the {obj}",
            "dawdle {degree} alongside the {obj}",
        ),
    },
    "faster": {
        "train": (
            "walk {degree} faster when passing close to the {obj}",
            "go {degree} faster while passing next to the {obj}",
            "drive {degree} faster in the surrounding of the {obj}",
            "increase the speed {degree} when passing nearby the {obj}",
            "go {degree} faster near the {obj}",
        ),
        "heldout": (
            "accelerate {degree} around the {obj}",
            "hurry {degree} past the {obj}",
            "quicken {degree} alongside the {obj}",
        ),
    },
    "slower_all": {"train": ("go {degree} slower", "walk {degree} slower"), "heldout": ("take it {degree} easier",)},
    "faster_all": {"train": ("go {degree} faster", "walk {degree} faster"), "heldout": ("hasten {degree}",)},
    "toward": {
        "train": ("go to the {place}", "stay on the {place}"),
        "heldout": ("head for the {place}", "favour the {place}"),
    },
    "shift": {
        "train": ("go {side} by {n}", "move {side} by {n}", "shift the trajectory {side} by {n}"),
        "heldout": ("displace everything {n} {side}", "translate the route {n} {side}", "offset the path {side} {n}"),
    },
    "shift_part": {
        "train": ("move the {part} {k} waypoints {side} by {n}", "shift the {part} {k} waypoints {side} by {n}"),
        "heldout": ("nudge the {part} {k} points {n} {side}",),
    },
    "keep_away": {
        "train": ("keep a distance of at least {n} from the {obj}", "stay at least {n} away from the {obj}"),
        "heldout": ("never get within {n} of the {obj}", "maintain a buffer of {n} from the {obj}"),
    },
    "constant": {
        "train": ("move at a constant speed of {v}", "keep a constant speed of {v}"),
        "heldout": ("cruise uniformly at {v}", "hold a steady pace of {v}"),
    },
    "scale_speed": {
        "train": ("go {factor} times as fast", "change the speed to {factor} times of what it is"),
        "heldout": ("multiply your velocity by {factor}", "scale the velocity by {factor}"),
    },
    "slower_within": {
        "train": ("go slower when within {n} of the {obj}", "reduce the speed within {n} of the {obj}"),
        "heldout": ("decelerate inside a radius of {n} around the {obj}",),
    },
    "faster_within": {
        "train": ("go faster when within {n} of the {obj}", "increase the speed within {n} of the {obj}"),
        "heldout": ("accelerate inside a radius of {n} around the {obj}",),
    },
    "stop": {
        "train": ("stop when you are near the {obj}", "stop near the {obj}"),
        "heldout": ("come to a halt beside the {obj}", "finish the journey beside the {obj}"),
    },
    "wait": {
        "train": ("wait for {k} timesteps near the {obj}", "stop near the {obj} for {k} timesteps"),
        "heldout": ("pause {k} timesteps beside the {obj}", "linger {k} timesteps beside the {obj}"),
    },
    "goal": {
        "train": ("shift the goal position {side} by {n}", "move the goal {side} by {n}"),
        "heldout": ("relocate the destination {n} {side}", "put the endpoint {n} {side}"),
    },
    "start": {
        "train": ("shift the start position {side} by {n}", "move the start {side} by {n}"),
        "heldout": ("relocate the departure point {n} {side}", "begin {n} {side}"),
    },
    "extend": {
        "train": ("go on for {n} after reaching the goal", "continue by {n} after the goal"),
        "heldout": ("overshoot the destination by {n}", "prolong the motion {n} beyond its end"),
    },
    "denser": {
        "train": ("increase the number of waypoints", "use more waypoints"),
        "heldout": ("sample the path denser", "refine the discretisation"),
    },
    "sparser": {
        "train": ("decrease the number of waypoints", "use fewer waypoints"),
        "heldout": ("thin out the samples", "coarsen the discretisation"),
    },
    "first": {"train": ("first",), "heldout": ("initial", "earliest")},
    "last": {"train": ("last",), "heldout": ("final", "closing")},
}

JOINS: Phrases = {"train": (" and ", ", then "), "heldout": (" and ", "; also ", ", plus ")}

METRES: Phrases = {"train": ("{:g}", "{:g} m"), "heldout": ("{:g} m", "{:g} metres")}

SPEEDS: Phrases = {"train": ("{:g}", "{:g} m/s"), "heldout": ("{:g} m/s", "{:g} metres per second")}


def words(text: str) -> frozenset[str]:
    """The words of a phrase, lower case, without placeholders and numbers."""
    return frozenset(re.findall(r"[a-z]+(?:-[a-z]+)*", re.sub(r"\{[^}]*\}", " ", text.lower())))


def vocabulary(split: Split) -> frozenset[str]:
    """Every word that an instruction of a split can have, objects' names left out."""
    tables = (*DEGREES.values(), *SIDES.values(), *PLACES.values(), *CLAUSES.values(), JOINS, METRES, SPEEDS)
    return frozenset().union(*(words(phrase) for table in tables for phrase in table[split]))
