"""Wishes that cancel each other: a question back, rather than a path that silently stays as it was."""

from __future__ import annotations

from collections.abc import Sequence

from ovita.instruct.draft import OPPOSITE
from ovita.instruct.intents import Intent
from ovita.paths.trajectory import Trajectory


def contradiction(intents: Sequence[Intent]) -> str:
    """A question about two wishes that cannot both be meant, or "".

    Shifts count only where both are about the same part of the path.
    """
    for i, one in enumerate(intents):
        words = [d for d, _ in one.directions]
        own = next((d for d in words if OPPOSITE[d] in words), None) if one.action in ("move", "extend") else None
        if own is not None:
            return f"Both {own} and {OPPOSITE[own]}: which way should the path go?"
        for other in intents[i + 1 :]:
            question = _between(one, other)
            if question:
                return question
    return ""


def _between(one: Intent, other: Intent) -> str:
    same_part = one.region == other.region
    if one.action == other.action and one.action in ("move", "move_start", "move_goal") and same_part:
        opposed = [d for d, _ in one.directions if OPPOSITE[d] in [word for word, _ in other.directions]]
        if opposed:
            return f"Both {opposed[0]} and {OPPOSITE[opposed[0]]}: which way should the path go?"
    if {one.action, other.action} == {"closer", "farther"} and same_part and one.items[0] is other.items[0]:
        return f"Both closer to {one.items[0].name} and farther from it: which of the two?"
    if one.action == other.action == "speed" and same_part and {one.mode, other.mode} == {"slower", "faster"}:
        return "Both slower and faster: which of the two?"
    return ""


def standing(intents: Sequence[Intent], trajectory: Trajectory) -> str:
    """A question where a change relative to the speed is asked of a robot that has none, or ""."""
    relative = any(i.action == "speed" and i.mode in ("slower", "faster", "factor", "turns") for i in intents)
    if relative and not (trajectory.speeds > 0).any():
        return "All speeds of this trajectory are 0, so slower or faster means nothing here: how many m/s should it be?"
    return ""
