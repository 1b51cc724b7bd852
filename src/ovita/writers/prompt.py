"""The text of a prompt: everything that a policy writer needs to know of a request.

The fixed part (role, rules, the core of the toolkit) comes first and is the same for every request, so that servers can
keep it in their cache. Behind it comes what depends on the request: further functions and examples that are like the
instruction, frame, objects, extents, speeds, limits, and what "slightly" and "near" amount to in this scene.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np

from ovita.paths.part import PathPart
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.request import Request, Turn
from ovita.text import as_data, one_line
from ovita.units import to_si
from ovita.writers.base import ExampleMode, PromptStyle, Sections

if TYPE_CHECKING:
    from ovita.instruct.degrees import Scale
    from ovita.writers.examples import Example

EXAMPLES, FUNCTIONS = 2, 4
"""How many examples of the bank a prompt shows, and how many functions beyond the core and those that they call."""

EXAMPLES_OF_WHOLE = 3
"""How many examples a prompt shows that lists the whole toolkit."""

ROOM = 890
"""How much text functions and examples may take together, so that prompts stay short [characters]."""

STEPS = 10
"""Timesteps in a second, as policies count them."""

_MEASURE = re.compile(
    r"(?<![\w.])(\d{1,9}(?:\.\d{1,9})?|\.\d{1,9})[ -]?"
    r"(cm|centimet(?:re|er)s?|mm|millimet(?:re|er)s?|inch(?:es)?|feet|foot|ft|s|secs?|seconds?)(?![\w/²^])",
    re.IGNORECASE,
)

MAX_NAME, MAX_ENVIRONMENT, MAX_LIMITS = 80, 1200, 400
"""Longest name, environment text and constraints text that go into a prompt [characters]."""


def sections_of(request: Request, style: PromptStyle) -> Sections:
    """The text of a prompt by section."""
    helpful = _helpful(request, style.whole) if style.toolkit and style.examples == "retrieved" else []
    scene = _scene_lines(request) if style.scene else _names(request.scene)
    history = [_turn_lines(i, turn) for i, turn in enumerate(request.history, start=1)]
    return Sections(
        rules=_fixed(style.examples, style.toolkit, style.whole),
        help="".join(f"{part}\n" for part in helpful),
        scene="".join(f"{line}\n" for line in ("# This scene", *scene)),
        history="".join(f"{turn}\n" for turn in history),
        instruction=f"# Instruction\n{_in_units(one_line(request.instruction))}\n",
    )


@cache
def _fixed(mode: ExampleMode, toolkit: bool, whole: bool = False) -> str:
    from ovita.toolkit.catalogue import core_names, describe, extended

    extended()
    if not toolkit:
        return "\n\n".join([_read("script.md"), *([] if mode == "none" else [_read("script-examples.md")])]) + "\n"
    # Without retrieval nothing says which functions an instruction may need, so all are listed.
    shown = describe(core_names() if mode == "retrieved" and not whole else None, defaults=whole)
    text = _read("policy.md").replace("{{toolkit}}", shown)
    text = f"{text}\n\n{_read('details.md')}" if whole else text
    return "\n\n".join([text, *([_read("paper.md")] if mode == "paper" else [])]) + "\n"


@cache
def _read(name: str) -> str:
    return (files("ovita.writers") / "prompts" / name).read_text(encoding="utf-8").strip()


def _helpful(request: Request, whole: bool = False) -> list[str]:
    """The functions and the examples that an instruction calls for: always one example, more of both while they fit.

    Beside the whole toolkit there are only examples.
    """
    from ovita.toolkit.catalogue import core_names
    from ovita.writers.examples import functions_like, similar

    names = request.scene.names
    if whole:
        found = similar(request.instruction, EXAMPLES_OF_WHOLE, names)
        return [f"# Example {i}\n{example.text()}" for i, example in enumerate(found, start=1)]
    likely = functions_like(request.instruction, FUNCTIONS, names, without=core_names())
    shown: list[Example] = []
    for example in similar(request.instruction, 2 * EXAMPLES, names):
        fits = len(shown) < EXAMPLES and example.code != "" and _fits(_help((*shown, example), likely[:1]))
        if not shown or fits:
            shown.append(example)
    helps = (_help(shown, likely[:count]) for count in range(len(likely), 1, -1))
    return next(filter(_fits, helps), _help(shown, likely[:1]))


def _fits(parts: Sequence[str]) -> bool:
    return sum(map(len, parts)) <= ROOM


def _help(shown: Sequence[Example], likely: Sequence[str]) -> list[str]:
    from ovita.toolkit.catalogue import core_names, describe

    further = [name for name in (*(call for e in shown for call in e.calls), *likely) if name not in core_names()]
    functions = ["# More functions\n" + describe(further, known_notes=("OFFSET",))] if further else []
    return functions + [f"# Example {i}\n{example.text()}" for i, example in enumerate(shown, start=1)]


def _names(scene: Scene) -> list[str]:
    names = ", ".join(as_data(name, MAX_NAME) for name in scene.names) or "none"
    return [f"Frame: {scene.frame.describe()}. Units: metres, m/s, seconds.", f"Objects: {names}."]


def _scene_lines(request: Request) -> list[str]:
    from ovita.instruct.degrees import Scale

    scene, scale = request.scene, Scale.of(request.trajectory)
    lines = [
        f"Frame: {scene.frame.describe()}.",
        _trajectory_line(request.trajectory),
        *([f"It was {one_line(request.origin)}, so it goes that way already."] if request.origin else []),
        *([f"'Here' and 'this part' mean {_marked(request.selection)}."] if request.selection else []),
        *_object_lines(scene, request.trajectory, scale),
        _limits_line(request),
        f"Sizes: {scale.describe()}",
    ]
    for title, text, limit in (
        ("Environment", scene.environment, MAX_ENVIRONMENT),
        ("Limits", scene.constraints_text, MAX_LIMITS),
    ):
        if text.strip():
            lines.append(f"{title} (data): {as_data(text, limit)}")
    return lines


def _marked(part: PathPart) -> str:
    """A part that is marked by hand, in words and as a mask that a policy can make."""
    ends = (part.amount, part.until) if part.kind == "range" and part.unit == "waypoints" else (None, None)
    mask = "" if None in ends else f": where=between(traj, {ends[0]:g}, {ends[1]:g})"
    return f"the part of the path that is marked by hand, {part.words()}{mask}"


def _in_units(instruction: str) -> str:
    """The instruction with its lengths in metres and its times in timesteps behind them: "8 cm (0.08 m)"."""

    def in_si(found: re.Match[str]) -> str:
        amount, unit = to_si(float(found[1]), found[2])
        return f"{found[0]} ({amount:.4g} m)" if unit == "m" else f"{found[0]} ({amount * STEPS:.4g} timesteps)"

    return _MEASURE.sub(in_si, instruction)


def _trajectory_line(trajectory: Trajectory) -> str:
    low, high = trajectory.positions.min(axis=0), trajectory.positions.max(axis=0)
    ranges = ", ".join(f"{axis} {short(a)}..{short(b)}" for axis, a, b in zip("xyz", low, high, strict=True))
    v = trajectory.speeds
    return (
        f"Path: {len(trajectory)} waypoints, {short(trajectory.length)} m, {short(trajectory.duration)} s,"
        f" start {point(trajectory.positions[0])}, goal {point(trajectory.positions[-1])}, {ranges},"
        f" speed {short(v.min())}..{short(v.max())} m/s."
    )


def _object_lines(scene: Scene, trajectory: Trajectory, scale: Scale) -> Sequence[str]:
    if not scene.objects:
        return ["Objects: none."]
    lines = ["Objects (name: centre; size; distance at closest waypoint; what counts as near):"]
    for item in scene.objects:
        d = item.distance(trajectory.positions)
        i = int(np.argmin(d))
        size = "?" if item.dimensions is None else " ".join(short(s) for s in item.size)
        near = scale.near(trajectory.positions, item)
        lines.append(f"{as_data(item.name, MAX_NAME)}: {point(item.position)}; {size}; {short(d[i])} at {i}; {near:g}")
    return lines


def _limits_line(request: Request) -> str:
    robot = request.robot
    where = "" if robot.workspace is None else f"{robot.workspace.describe()}, "
    speed = "" if robot.max_speed is None else f"at most {robot.max_speed:g} m/s, "
    return f"Enforced afterwards: {where}{speed}{robot.obstacle_margin:g} m from obstacles."


def _turn_lines(number: int, turn: Turn) -> str:
    plan = "; ".join(one_line(step) for step in turn.plan) or "no plan"
    code = turn.code.strip().replace("```", "'''")
    shown = f"\n```python\n{code}\n```" if code else ""
    about = f"# Earlier turn {number}, about the {turn.feedback_on} trajectory"
    return f"{about}\nInstruction: {one_line(turn.instruction)}\nIt did: {plan}{shown}"


def point(position: Array) -> str:
    """A position as text: (0.1, 0.2, 0.3)."""
    return "(" + ", ".join(short(x) for x in position) + ")"


def short(value: float) -> str:
    """A number with three digits and at most two decimals unless it is tiny."""
    value = float(value)
    return f"{round(value, 2) + 0.0 if abs(value) >= 0.02 else value:.3g}" if abs(value) >= 5e-4 else "0"
