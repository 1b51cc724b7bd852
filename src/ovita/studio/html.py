"""Text: suggestions and escaped HTML."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from html import escape
from itertools import pairwise
from typing import Any

import numpy as np

from ovita.dialogue.session import Session
from ovita.measure import compare, sentences
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.result import Adaptation

_SHORT = 20

MEANING = {
    "current": "<b>Current</b>: the next words change the red line as it is now.",
    "original": "<b>Original</b>: the next words are added to all you said, and all of it is applied to the blue line.",
}
"""What feedback on each trajectory means, as in the paper."""


def e(text: object) -> str:
    """Any text, safe inside HTML."""
    return escape(str(text), quote=True)


def clipped(text: str, limit: int = 300) -> str:
    """A text of at most `limit` characters."""
    return text if len(text) <= limit else text[: limit - 1].rstrip() + "\u2026"


def block(content: str) -> str:
    """HTML in the page's own style."""
    return f'<div class="ov">{content}</div>'


def section(title: str, about: str) -> str:
    """The beginning of a part of a panel: its title, and what can be done with it."""
    return block(f'<h4>{e(title)}</h4><p class="soft">{e(about)}</p>')


def soft(text: str) -> str:
    """A sentence that is good to know, in pale letters."""
    return block(f'<p class="soft">{e(text)}</p>')


@contextmanager
def busy(button: Any, label: str) -> Iterator[None]:
    """Inside the block, a button of viser's bears another label and cannot be pressed."""
    if button.disabled:
        yield
        return
    before, button.disabled, button.label = button.label, True, label
    try:
        yield
    finally:
        button.disabled, button.label = False, before


def listed(items: Sequence[str], tag: str = "ul") -> str:
    """Escaped lines as a list; "" without any."""
    lines = "".join(f"<li>{e(item)}</li>" for item in items if item.strip())
    return f"<{tag}>{lines}</{tag}>" if lines else ""


def suggestions(trajectory: Trajectory, scene: Scene) -> list[str]:
    """Instructions that make sense in this scene, each about what the path passes."""
    short = [item for item in scene if len(item.name) <= _SHORT]
    if trajectory.length == 0.0:
        return [f"From the {a.name} to the {b.name}, slowly" for a, b in pairwise(short)][:3]
    near = sorted(short, key=lambda item: float(item.clearance(trajectory.positions).min()))
    amount = max(round(0.15 * float(np.ptp(trajectory.positions, axis=0).max()), 1), 0.1)
    left = f"Go left by {amount:g}"
    if near:
        return [f"Slow down near the {near[0].name}", f"Keep a bigger distance from the {near[-1].name}", left]
    flat = float(np.ptp(trajectory.positions[:, 2])) == 0.0
    return [left, "Move half as fast", *([] if flat else [f"Go up by {amount / 2:g} in the middle"])]


def plan(result: Adaptation | None) -> str:
    """Plan, assumptions and warnings."""
    if result is None:
        return soft("What the robot is going to do differently stands here, once you said something.")
    parts = ["<h4>Plan</h4>", listed(result.plan, "ol")]
    if result.assumed:
        parts += ["<h4>Assumed, because you left it open</h4>", listed(result.assumed)]
    if result.postconditions:
        kept = [f"{'kept' if p.held else 'NOT kept'}: {p.outcome}" for p in result.postconditions]
        parts += ["<h4>Promises of the program, measured</h4>", listed(kept)]
    return block("".join(parts))


def explanation(result: Adaptation | None) -> str:
    """The explanation in plain words, with warnings first."""
    if result is None:
        return soft("Why the line looks as it does is told here in plain words.")
    warnings = f"<h4>Please look at</h4>{listed(result.cautions)}" if result.cautions else ""
    lines = [line for line in result.explanation.split("\n") if line.strip()]
    parts = [f"<li>{e(line[2:])}</li>" if line.startswith("- ") else f"<p>{e(line)}</p>" for line in lines]
    told = "".join(parts).replace("</p><li>", "</p><ul><li>").replace("</li><p>", "</li></ul><p>")
    return block(warnings + told + ("</ul>" if told.endswith("</li>") else ""))


def changes(before: Trajectory, session: Session) -> str:
    """The measured difference between a trajectory and the current one, as sentences."""
    if session.adaptation is None:
        return soft("Nothing has changed yet.")
    found = session.adaptation.changes if session.adaptation.original is before else None
    return block(listed([str(s) for s in sentences(found or compare(before, session.current, session.scene))]))


def verdict(session: Session) -> str:
    """The limits and whether each holds."""
    result = session.adaptation
    limits = f'<p class="soft">{e(limits_of(session.robot))}</p>'
    if result is None or result.constraints is None:
        return block(limits + "<p>Limits are checked whenever something changes.</p>")
    found = result.constraints
    chip = {"satisfied": "good", "infeasible": "bad"}.get(found.status, "warn")
    return block(f'<p><span class="chip {chip}">{e(found.status)}</span></p>{listed(found.sentences())}{limits}')


def limits_of(robot: Robot) -> str:
    """A robot's limits in one sentence."""
    space = robot.workspace.describe() if robot.workspace else "no workspace limit"
    speed = f"at most {robot.max_speed:g} m/s" if robot.max_speed is not None else "no speed limit"
    body = f"its body, {robot.radius:g} m around the path, stays" if robot.radius else "the path, without a body, stays"
    return f"{robot.name}: {space}; {body} {robot.obstacle_margin:g} m from objects; {speed}."


def code(source: str, bad_line: int | None = None) -> str:
    """Source with line numbers, one of them marked."""
    lines = [e(line) or " " for line in source.rstrip("\n").split("\n")]
    marked = [f"<mark>{line}</mark>" if i == bad_line else line for i, line in enumerate(lines, start=1)]
    numbered = "\n".join(f"<i>{i:3d} </i>{line}" for i, line in enumerate(marked, start=1))
    return block(f"<pre>{numbered}</pre>")


BRAND = (39, 84, 125)
"""Colour of buttons and sliders (RGB)."""

QUIET = (84, 98, 112)
"""Colour of buttons that take something back (RGB), dark enough for white letters."""
