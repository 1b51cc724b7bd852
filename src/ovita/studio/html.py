"""Text and pictures: suggestions, escaped HTML, small charts as SVG."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ovita.dialogue.session import Session
from ovita.measure import compare, sentences
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.plots.geometry import COLOURS
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
    said = []
    if near:
        said.append(f"Slow down near the {near[0].name}")
        said.append(f"Keep a bigger distance from the {near[-1 if len(near) > 1 else 0].name}")
    flat = float(np.ptp(trajectory.positions[:, 2])) == 0.0
    said.append(f"Go left by {amount:g}")
    if not near:
        said.append("Move half as fast")
    if not flat and len(said) < 4:
        said.append(f"Go up by {amount / 2:g} in the middle")
    return said[:3]


def plan(result: Adaptation | None) -> str:
    """Plan, assumptions and warnings."""
    if result is None:
        return block(
            '<p class="soft">What the robot is going to do differently stands here, once you said something.</p>'
        )
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
        return block('<p class="soft">Why the line looks as it does is told here in plain words.</p>')
    warnings = f"<h4>Please look at</h4>{listed(result.cautions)}" if result.cautions else ""
    parts: list[str] = []
    for line in result.explanation.split("\n"):
        if line.startswith("- "):
            parts.append(f"<li>{e(line[2:])}</li>")
        elif line.strip():
            parts.append(f"<p>{e(line)}</p>")
    told = "".join(parts).replace("</p><li>", "</p><ul><li>").replace("</li><p>", "</li></ul><p>")
    return block(warnings + told + ("</ul>" if told.endswith("</li>") else ""))


def changes(before: Trajectory, session: Session) -> str:
    """The measured difference between a trajectory and the current one, as sentences."""
    if session.adaptation is None:
        return block('<p class="soft">Nothing has changed yet.</p>')
    return block(listed([str(s) for s in sentences(compare(before, session.current, session.scene))]))


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
    lines = []
    for number, line in enumerate(source.rstrip("\n").split("\n"), start=1):
        text = e(line) or " "
        lines.append(f"<i>{number:3d} </i>" + (f"<mark>{text}</mark>" if number == bad_line else text))
    return block("<pre>" + "\n".join(lines) + "</pre>")


_WIDTH, _HEIGHT = 360.0, 136.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 40.0, 8.0, 8.0, 36.0
_POINTS = 300


@dataclass(frozen=True)
class Series:
    """One line of a chart: a name for the legend, a CSS colour, x and y (N,), and whether it is dashed."""

    name: str
    colour: str
    x: Array
    y: Array
    dashed: bool = False


def speed_chart(original: Trajectory, adapted: Trajectory | None) -> str:
    """Speed over time [m/s over s]."""
    lines = [Series("before", COLOURS["before"], original.times, original.speeds)]
    if adapted is not None:
        lines.append(Series("after", COLOURS["after"], adapted.times, adapted.speeds))
    return chart(lines, "time [s]", "speed [m/s]", floor=0.0)


def clearance_chart(original: Trajectory, adapted: Trajectory | None, scene: Scene, margin: float) -> str:
    """Distance to the nearest object over the distance travelled [m over m], with the margin; "" without objects."""
    if not len(scene):
        return ""
    lines = [Series("before", COLOURS["before"], original.arc_length, clearance(original.positions, scene))]
    if adapted is not None:
        lines.append(Series("after", COLOURS["after"], adapted.arc_length, clearance(adapted.positions, scene)))
    far = max(float(line.x[-1]) for line in lines)
    lines.append(
        Series(f"margin {margin:g} m", "#8a97a3", np.array([0.0, far]), np.array([margin, margin]), dashed=True)
    )
    return chart(lines, "distance travelled [m]", "clearance [m]")


def clearance(points: Array, scene: Scene) -> Array:
    """Distance of points (N, 3) [m] to the nearest object's surface, (N,) [m]; negative inside."""
    return np.asarray(np.min([item.clearance(points) for item in scene], axis=0))


def chart(lines: Sequence[Series], x_label: str, y_label: str, *, floor: float | None = None) -> str:
    """Lines as one SVG picture with axes and a legend, the last on top; `floor` is where the vertical axis begins."""
    x_high = max(max(float(line.x.max()) for line in lines), 1e-9)
    y_low = min(float(line.y.min()) for line in lines) if floor is None else floor
    y_high = max(max(float(line.y.max()) for line in lines), y_low + 1e-6)
    y_high += 0.06 * (y_high - y_low)
    y_low -= 0.0 if floor is not None else 0.06 * (y_high - y_low)

    def place(x: Array, y: Array) -> Array:
        across = _LEFT + x / x_high * (_WIDTH - _LEFT - _RIGHT)
        return np.stack(
            [across, _HEIGHT - _BOTTOM - (y - y_low) / (y_high - y_low) * (_HEIGHT - _TOP - _BOTTOM)], axis=1
        )

    parts = [f'<svg viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" role="img" aria-label="{escape(y_label)}">']
    style = 'font-size="12" fill="var(--soft)" font-family="system-ui,sans-serif"'
    for value in ticks(y_low, y_high, 4):
        y = float(place(np.zeros(1), np.array([value]))[0, 1])
        parts.append(f'<path d="M{_LEFT:g} {y:.1f}H{_WIDTH - _RIGHT:g}" stroke="var(--line)"/>')
        parts.append(f'<text x="{_LEFT - 5:g}" y="{y + 3:.1f}" text-anchor="end" {style}>{_short(value)}</text>')
    base = _HEIGHT - _BOTTOM
    for value in ticks(0.0, x_high, 6):
        x = float(place(np.array([value]), np.zeros(1))[0, 0])
        parts.append(f'<text x="{x:.1f}" y="{base + 14:g}" text-anchor="middle" {style}>{_short(value)}</text>')
    parts.append(f'<path d="M{_LEFT:g} {base:g}H{_WIDTH - _RIGHT:g}" stroke="var(--soft)"/>')
    for i, line in enumerate(lines):
        kept = thinned(line.y)
        points = place(line.x[kept], line.y[kept])
        path = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
        dash = ' stroke-dasharray="4 3"' if line.dashed else ""
        width = 1.0 if line.dashed else 2.8 if i == 0 and len(lines) > 1 and not lines[1].dashed else 1.6
        parts.append(
            f'<path d="{path}" fill="none" stroke="{line.colour}" stroke-width="{width:g}"'
            f' stroke-linejoin="round"{dash}><title>{escape(line.name)}</title></path>'
        )
    middle = _HEIGHT - 4
    parts.append(f'<text x="{_WIDTH - _RIGHT:g}" y="{middle:g}" text-anchor="end" {style}>{escape(x_label)}</text>')
    at = _LEFT
    for line in lines:
        parts.append(f'<path d="M{at:g} {middle - 3:g}h12" stroke="{line.colour}" stroke-width="2"/>')
        parts.append(f'<text x="{at + 16:g}" y="{middle:g}" {style}>{escape(line.name)}</text>')
        at += 28 + 6.4 * len(line.name)
    return "".join(parts) + "</svg>"


def ticks(low: float, high: float, most: int) -> list[float]:
    """At most `most` round values from `low` to `high`."""
    rough = (high - low) / most
    if not rough > 0:
        return [low]
    power = 10.0 ** np.floor(np.log10(rough))
    step = next(float(s * power) for s in (1, 2, 2.5, 5, 10, 20) if s * power >= rough)
    first = int(np.ceil(low / step - 1e-9))
    return [k * step for k in range(first, int(np.floor(high / step + 1e-9)) + 1)]


def thinned(values: Array) -> NDArray[np.int_]:
    """Indices of at most some hundred values, with the first, the last, the lowest and the highest."""
    if len(values) <= _POINTS:
        return np.arange(len(values))
    even = np.linspace(0, len(values) - 1, _POINTS).round().astype(int)
    return np.unique(np.concatenate([even, [int(values.argmin()), int(values.argmax())]]))


def _short(value: float) -> str:
    return f"{value:.4g}" if abs(value) > 1e-12 else "0"


BRAND = (39, 84, 125)
"""Colour of buttons and sliders (RGB)."""

QUIET = (84, 98, 112)
"""Colour of buttons that take something back (RGB), dark enough for white letters."""
