"""What a clause asks for, before it becomes code."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ovita.instruct.scale import Degree
from ovita.paths.scene import SceneObject

Action = Literal[
    "move",
    "move_start",
    "move_goal",
    "closer",
    "farther",
    "keep_distance",
    "through",
    "extend",
    "speed",
    "stop",
    "wait",
    "smooth",
    "resample",
    "spiral",
    "circle",
    "eight",
    "zigzag",
    "wave",
    "hop",
    "hover",
    "mirror",
    "rotate",
    "tilt",
    "resize",
    "curve",
    "straighten",
    "shortcut",
    "average",
    "reverse",
    "noise",
    "bound",
    "side",
    "quadrant",
    "height",
    "same",
    "trim",
    "aim",
    "carry",
    "return",
]


@dataclass(frozen=True)
class Region:
    """The part of the path that an intent is about.

    Args:
        kind: "whole", "near" (objects), "first" or "last" (a count, share, length or time), "middle", "between" (two
            objects), "after" or "before" (an object), "range" (waypoints), "heading" (a direction), "beyond" (further
            than `amount` along a direction from the origin), "every" (k-th waypoint), or "rest" (what the clause
            before was not about).
        items: Objects of "near", "between", "after" and "before".
        amount: Radius [m], waypoint count, share of the waypoints, length [m], time [s], k, or a range's first
            waypoint.
        counted: Whether `amount` is a number of waypoints rather than a share.
        direction: Word of "heading" and "beyond".
        unit: "m" or "s" where `amount` is a length or a time of the path.
        until: Last waypoint of a range; a range without one goes to the goal.
        outside: Whether everywhere else is meant.
    """

    kind: str = "whole"
    items: tuple[SceneObject, ...] = ()
    amount: float | None = None
    counted: bool = False
    direction: str = ""
    unit: str = ""
    until: float | None = None
    outside: bool = False


WHOLE = Region()


@dataclass(frozen=True)
class Intent:
    """One action to take.

    Args:
        action: What.
        directions: Direction words, each with metres or None where the instruction leaves it open.
        items: The objects it is about.
        amount: The number that goes with the action, in `unit`.
        unit: "m", "x" (factor), "m/s", "step", "s", "waypoints", or "".
        count: A second number, such as the turns of a spiral, or None.
        mode: A variant of the action, such as "set", "add", "factor", "ramp" and "constant" for speeds.
        degree: How much, where no number says so.
        region: Where on the path.
        text: The clause, for the plan.
    """

    action: Action
    directions: tuple[tuple[str, float | None], ...] = ()
    items: tuple[SceneObject, ...] = ()
    amount: float | None = None
    unit: str = ""
    count: float | None = None
    mode: str = ""
    degree: Degree = "moderate"
    region: Region = WHOLE
    text: str = ""


@dataclass(frozen=True)
class Understood:
    """What the parser made of a sentence: intents, notes, the words that it could not place, and a question back."""

    intents: tuple[Intent, ...] = ()
    notes: tuple[str, ...] = ()
    unplaced: tuple[str, ...] = ()
    radius: float | None = None
    question: str = ""
