"""Editing the path by hand: each edit is a small policy, and so a turn with a name, knobs and an undo."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ovita.dialogue.session import Session
from ovita.errors import RequestError
from ovita.paths.frame import Frame
from ovita.paths.part import PathPart
from ovita.paths.trajectory import Array, interpolate, source_indices
from ovita.text import waypoints

MOST_POINTS = 24
"""Points of a stroke that go into the policy; a hand draws no finer."""


@dataclass(frozen=True)
class HandEdit:
    """What a hand did: its name in the history, the policy that does it, and the plan as a sentence."""

    said: str
    code: str
    plan: str


def drawn(session: Session, edit: HandEdit) -> None:
    """Do a hand edit, as a turn of a session."""
    session.draw(edit.said, edit.code, edit.plan)


def pulled(index: int, by: Array, frame: Frame, count: int) -> HandEdit:
    """A waypoint (counted from 0) of `count` was pulled by (3,) [m]; two neighbours on either side follow it."""
    words = {word: round(amount, 4) for word, amount in frame.words(by).items() if amount >= 5e-4}
    if not words:
        raise RequestError(f"waypoint {index + 1} was moved by less than 1 mm; drag it further")
    told = ", ".join(f"{amount:.2f} m {word}" for word, amount in words.items())
    knobs = "".join(f"    {word}={amount!r},  # [m] {word}\n" for word, amount in words.items())
    width = round(min(3.0 / (count - 1), 0.5), 4)
    knobs += f"    width={width!r},  # share of the path on either side that follows\n"
    passed = ", ".join(f"{word}={word}" for word in words)
    body = f"    return pull_waypoint(traj, {index}, width=width, {passed})\n"
    return HandEdit(
        f"moved waypoint {index + 1} {told}", _policy(knobs, body), f"Pull waypoint {index + 1} {told}, as by hand."
    )


def inserted(after: int) -> HandEdit:
    """A waypoint was put behind one (counted from 0)."""
    between = f"between waypoints {after + 1} and {after + 2}"
    body = f"    return insert_waypoint(traj, {after})\n"
    return HandEdit(f"inserted a waypoint {between}", _policy("", body), f"Put a waypoint {between}.")


def deleted(first: int, last: int) -> HandEdit:
    """The waypoints from one to another (counted from 0) were taken out."""
    which = waypoints(first, last)
    body = f"    return delete_waypoints(traj, {first}, {last})\n"
    return HandEdit(f"deleted {which}", _policy("", body), f"Take out {which}.")


def sketched(line: Array, first: int, last: int) -> HandEdit:
    """The part from one waypoint to another (counted from 0) shall follow a line (M, 3) [m].

    Raises:
        RequestError: If the line is none, or the part is too short to follow it.
    """
    if line.ndim != 2 or line.shape[1] != 3 or len(line) < 2 or not np.isfinite(line).all():
        raise RequestError(
            "the stroke is too short; draw along the path, from where it should leave to where it returns"
        )
    if last - first < 2:
        raise RequestError(
            "the stroke is along less than 3 waypoints; draw along more of the path, or insert waypoints"
        )
    points = interpolate(line, source_indices(line, min(len(line), MOST_POINTS), "arc_length")).round(4)
    part = PathPart("range", amount=first, until=last).words()
    rows = ",\n".join(f"        {row}" for row in points.tolist())
    knobs = "    stiffness=0.2,  # 0 follows the drawn line exactly, 1 keeps the shape of the path\n"
    body = (
        f"    drawn = [\n{rows},\n    ]\n    part = between(traj, {first}, {last})\n"
        "    return follow_stroke(traj, drawn, stiffness=stiffness, where=part, keep_ends=True)\n"
    )
    return HandEdit(f"sketched a new way {part}", _policy(knobs, body), f"Follow the drawn line {part}.")


def _policy(knobs: str, body: str) -> str:
    arguments = f"\n    traj,\n    scene,\n    *,\n{knobs}" if knobs else "traj, scene"
    return f"def adapt({arguments}):\n{body}"
