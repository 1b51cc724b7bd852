"""From intents to a policy: the steps in an order in which none disturbs another."""

from __future__ import annotations

from dataclasses import replace

from ovita.instruct.draft import Draft
from ovita.instruct.intents import Intent
from ovita.instruct.steps import STEPS
from ovita.request import Request

ORDER: tuple[tuple[str, ...], ...] = (
    *(("same",), ("reverse",), ("mirror", "rotate", "tilt"), ("resize", "curve"), ("smooth",), ("straighten",)),
    *(("move",), ("quadrant", "height"), ("closer", "farther"), ("keep_distance",), ("side",)),
    *(
        ("through", "hop"),
        ("bound",),
        ("move_start", "move_goal", "aim", "carry"),
        ("zigzag", "wave", "noise"),
        ("speed",),
    ),
    *(
        ("shortcut", "extend", "return", "circle", "eight", "spiral", "hover", "wait", "stop"),
        ("average",),
        ("trim", "resample"),
    ),
)
"""Path first, from the whole to its parts, so that no step disturbs an exact amount set by another; then speed; then,
in the order of the sentence, what happens at a place and may change the number of waypoints."""

RANK = {action: rank for rank, actions in enumerate(ORDER) for action in actions}


def compose(intents: tuple[Intent, ...], request: Request, radius: float | None = None, *, effort: int = 1) -> Draft:
    """Write the policy for some intents.

    Args:
        intents: In the order of the sentence.
        request: What was asked, about which trajectory.
        radius: A distance that the instruction states for every "near".
        effort: How much to exceed the usual amounts where none is stated; 1 is as usual.
    """
    draft = Draft.of(request)
    draft.effort = effort if sum(intent.action in ("closer", "farther") for intent in intents) <= 2 else 1
    for intent in sorted(intents_once(intents), key=lambda i: RANK[i.action]):
        STEPS[intent.action](draft, intent if radius is None else _with_radius(intent, radius))
    return draft


def intents_once(intents: tuple[Intent, ...]) -> list[Intent]:
    """Drop a second smoothing, which would do nothing new; whatever else is said twice is meant twice."""
    kept: list[Intent] = []
    for intent in intents:
        if intent.action != "smooth" or not any(k.action == "smooth" for k in kept):
            kept.append(intent)
    return kept


def _with_radius(intent: Intent, radius: float) -> Intent:
    if intent.region.kind == "near" and intent.region.amount is None:
        return replace(intent, region=replace(intent.region, amount=radius))
    return intent
