"""Text, pictures and the page: suggestions, escaped HTML, small charts as SVG, and the head of viser's client."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from importlib.resources import files
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ovita.dialogue.history import ROOT, Step
from ovita.dialogue.session import Session
from ovita.measure import compare, sentences
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.plots.geometry import COLOURS
from ovita.result import Adaptation
from ovita.studio.sessions import LastUtterance, SessionController

_CHIPS = {
    "done": ("good", "done"),
    "limited": ("warn", "changed by the limits"),
    "not_as_meant": ("warn", "not as meant"),
    "infeasible": ("bad", "best effort"),
    "needs_confirmation": ("warn", "is that meant?"),
    "not_understood": ("bad", "not understood"),
    "needs_clarification": ("warn", "question"),
    "failed": ("bad", "failed"),
}
_LOST = ("warn", "an earlier wish is lost")
_KINDS = {
    "said": "",
    "knobs": "knobs",
    "reworded": "corrected",
    "code": "code",
    "hand": "by hand",
    "drawn": "by hand",
    "limits": "limits",
    "opened": "opened",
}

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


def header(controller: SessionController, writer: str) -> str:
    """Name of the studio, the open session and its writer."""
    session = controller.session
    told = (
        "no trajectory yet" if session.bare else f"{len(session.current)} waypoints, {session.current.duration:.1f} s"
    )
    return block(
        f'<div class="brand">{e(controller.title)} <small>{told}</small></div>'
        f'<div class="soft"><span class="key" style="background:var(--blue)"></span>original'
        f' &nbsp;<span class="key" style="background:var(--red)"></span>adapted &nbsp;&middot;&nbsp;'
        f" writer: {e(writer)}</div>"
    )


def welcome(scene: Scene) -> str:
    """The introduction for a first-time user."""
    objects = ", ".join(f"<b>{e(name)}</b>" for name in scene.names[:6]) or "no objects"
    return block(
        '<div class="card"><b>Change how the robot moves by saying so.</b><ol>'
        "<li>Type what should change and press <b>Enter</b>, or click a suggestion.</li>"
        "<li>Compare the <b style='color:var(--red)'>red</b> line with the "
        "<b style='color:var(--blue)'>blue</b> one, and play both below the scene.</li>"
        "<li>Turn the <b>Parameters</b> on the right, say more, or undo.</li></ol>"
        f'<div class="soft">In this scene: {objects}.</div></div>'
    )


def outcome(controller: SessionController) -> str:
    """How the last words went; "" before any."""
    if controller.busy is not None:
        return ""
    waiting = controller.session.pending
    said = controller.said
    if said is None and waiting is not None:
        said = LastUtterance(waiting.instruction, "current", waiting)
    if said is not None:
        kind, word = _chip(said.result) if said.result else ("bad", "not done")
        card = "card waiting" if waiting is not None else "card"
        return block(
            f'<div class="{card}">&ldquo;{e(clipped(said.text))}&rdquo; <span class="chip {kind}">{word}</span>'
            f"<p>{e(said.message)}</p></div>"
        )
    result = controller.session.adaptation
    if result is None:
        return welcome(controller.session.scene)
    kind, word = _chip(result)
    clean = result.status == "done" and not result.lost
    text = " ".join(result.plan[-4:]) or "Done." if clean else result.message
    warnings = listed(result.warnings[:2]) if result.warnings and result.status == "done" else ""
    return block(f'<div class="card"><span class="chip {kind}">{word}</span> {e(text)}{warnings}</div>')


def _chip(result: Adaptation) -> tuple[str, str]:
    return _LOST if result.status == "done" and result.lost else _CHIPS[result.status]


def turn_name(session: Session, turn: int, limit: int = 46) -> str:
    """A turn in one short line, such as "2. go up by 0.1"."""
    if turn == ROOT:
        return "0. the beginning"
    step = session.history.steps[turn]
    extra = _KINDS[step.kind]
    said = step.said if not extra or step.kind in ("hand", "drawn", "limits", "code") else f"{step.said} ({extra})"
    return f"{turn + 1}. {clipped(said, limit)}"


def history(session: Session) -> str:
    """Every turn, those in force marked; the ones that were undone or branched away from are pale."""
    in_force = set(session.history.path())
    lines = []
    for i, step in enumerate(session.history.steps):
        state = "now" if i == session.history.head else "" if i in in_force else "gone"
        parent = session.history.parents[i]
        after = "" if parent == i - 1 else " from the beginning" if parent == ROOT else f" after {parent + 1}"
        lines.append(
            f'<div class="turn {state}"><b>{i + 1}</b><div>{_turn(step)}<span class="soft">{after}</span></div></div>'
        )
    return block(f'<div class="card">{"".join(lines)}</div>') if lines else ""


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
    return f"{robot.name}: {space}; {robot.obstacle_margin:g} m from objects; {speed}."


def code(source: str, bad_line: int | None = None) -> str:
    """Source with line numbers, one of them marked."""
    lines = []
    for number, line in enumerate(source.rstrip("\n").split("\n"), start=1):
        text = e(line) or " "
        lines.append(f"<i>{number:3d} </i>" + (f"<mark>{text}</mark>" if number == bad_line else text))
    return block("<pre>" + "\n".join(lines) + "</pre>")


def _turn(step: Step) -> str:
    kind, word = _chip(step.adaptation)
    label = _KINDS[step.kind]
    chip = f' <span class="chip">{label}</span>' if label else ""
    if kind != "good":
        chip += f' <span class="chip {kind}">{word}</span>'
    on = ' <span class="soft">on the original</span>' if step.feedback_on == "original" else ""
    return f"{e(clipped(step.said))}{chip}{on}"


_WIDTH, _HEIGHT = 360.0, 126.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 38.0, 8.0, 8.0, 30.0
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
    style = 'font-size="9.5" fill="#5b6b7a" font-family="system-ui,sans-serif"'
    for value in ticks(y_low, y_high, 4):
        y = float(place(np.zeros(1), np.array([value]))[0, 1])
        parts.append(f'<path d="M{_LEFT:g} {y:.1f}H{_WIDTH - _RIGHT:g}" stroke="#e3e9ee"/>')
        parts.append(f'<text x="{_LEFT - 5:g}" y="{y + 3:.1f}" text-anchor="end" {style}>{_short(value)}</text>')
    base = _HEIGHT - _BOTTOM
    for value in ticks(0.0, x_high, 6):
        x = float(place(np.array([value]), np.zeros(1))[0, 0])
        parts.append(f'<text x="{x:.1f}" y="{base + 12:g}" text-anchor="middle" {style}>{_short(value)}</text>')
    parts.append(f'<path d="M{_LEFT:g} {base:g}H{_WIDTH - _RIGHT:g}" stroke="#b9c5cf"/>')
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
        at += 26 + 5.2 * len(line.name)
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


@cache
def page() -> bytes:
    """The page that every browser gets first."""
    import viser

    plain = (Path(viser.__file__).parent / "client" / "build" / "index.html").read_text(encoding="utf-8")
    start, end = plain.index("<head>") + len("<head>"), plain.index("</head>")
    head = plain[start:end]
    for tag, close in (("<title>", "</title>"), ("<link", "/>")):
        if tag in head:
            first = head.index(tag)
            head = head[:first] + head[head.index(close, first) + len(close) :]
    own = "".join((files("ovita.studio") / name).read_text(encoding="utf-8") for name in ("head.html", "timeline.html"))
    return (plain[:start] + head + own + plain[end:]).encode()
