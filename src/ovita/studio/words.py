"""Words for the page: suggestions that fit the scene, and what the session holds as escaped HTML."""

from __future__ import annotations

import html
from collections.abc import Sequence

import numpy as np

from ovita.dialogue.history import ROOT, Step
from ovita.dialogue.session import Session
from ovita.measure import sentences
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.result import Adaptation
from ovita.studio.desk import Desk

_CHIPS = {
    "done": ("good", "done"),
    "limited": ("warn", "changed by the limits"),
    "not_as_meant": ("warn", "not as meant"),
    "infeasible": ("bad", "best effort"),
    "not_understood": ("bad", "not understood"),
    "needs_clarification": ("warn", "question"),
    "failed": ("bad", "failed"),
}
_KINDS = {
    "said": "",
    "knobs": "knobs",
    "reworded": "corrected",
    "code": "code",
    "hand": "by hand",
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
    return html.escape(str(text), quote=True)


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


def header(desk: Desk, writer: str) -> str:
    """Name of the studio, of what is open, and of who writes."""
    session = desk.session
    told = f"{len(session.current)} waypoints, {session.current.duration:.1f} s"
    return block(
        f'<div class="brand">{e(desk.title)} <small>{told}</small></div>'
        f'<div class="soft"><span class="key" style="background:var(--blue)"></span>original'
        f' &nbsp;<span class="key" style="background:var(--red)"></span>adapted &nbsp;&middot;&nbsp;'
        f" writer: {e(writer)}</div>"
    )


def welcome(scene: Scene) -> str:
    """What to do, for a person who sees the page for the first time."""
    objects = ", ".join(f"<b>{e(name)}</b>" for name in scene.names[:6]) or "no objects"
    return block(
        '<div class="card"><b>Change how the robot moves by saying so.</b><ol>'
        "<li>Type what should change and press <b>Enter</b>, or click a suggestion.</li>"
        "<li>Compare the <b style='color:var(--red)'>red</b> line with the "
        "<b style='color:var(--blue)'>blue</b> one, and play both below the scene.</li>"
        "<li>Turn the <b>Parameters</b> on the right, say more, or undo.</li></ol>"
        f'<div class="soft">In this scene: {objects}.</div></div>'
    )


def outcome(desk: Desk) -> str:
    """How the last words went; "" before any."""
    if desk.busy is not None:
        return ""
    if desk.said is not None:
        said = desk.said
        kind, word = _CHIPS[said.result.status] if said.result else ("bad", "not done")
        return block(
            f'<div class="card">&ldquo;{e(clipped(said.text))}&rdquo; <span class="chip {kind}">{word}</span>'
            f"<p>{e(said.message)}</p></div>"
        )
    result = desk.session.adaptation
    if result is None:
        return welcome(desk.session.scene)
    kind, word = _CHIPS[result.status]
    text = result.message if result.status != "done" else " ".join(result.plan[-4:]) or "Done."
    warnings = listed(result.warnings[:2]) if result.warnings and result.status == "done" else ""
    return block(f'<div class="card"><span class="chip {kind}">{word}</span> {e(text)}{warnings}</div>')


def turn_name(session: Session, turn: int, limit: int = 46) -> str:
    """A turn in one short line, such as "2. go up by 0.1"."""
    if turn == ROOT:
        return "0. the beginning"
    step = session.history.steps[turn]
    extra = _KINDS[step.kind]
    said = step.said if not extra or step.kind in ("hand", "limits", "code") else f"{step.said} ({extra})"
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
    warnings = f"<h4>Please look at</h4>{listed(result.warnings)}" if result.warnings else ""
    parts: list[str] = []
    for line in result.explanation.split("\n"):
        if line.startswith("- "):
            parts.append(f"<li>{e(line[2:])}</li>")
        elif line.strip():
            parts.append(f"<p>{e(line)}</p>")
    told = "".join(parts).replace("</p><li>", "</p><ul><li>").replace("</li><p>", "</li></ul><p>")
    return block(warnings + told + ("</ul>" if told.endswith("</li>") else ""))


def changes(session: Session) -> str:
    """The measured difference, as sentences."""
    result = session.adaptation
    if result is None or result.changes is None:
        return block('<p class="soft">Nothing has changed yet.</p>')
    return block(listed([str(s) for s in sentences(result.changes)]))


def verdict(session: Session) -> str:
    """The limits and what became of each."""
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
    kind, word = _CHIPS[step.adaptation.status]
    label = _KINDS[step.kind]
    chip = f' <span class="chip">{label}</span>' if label else ""
    if step.adaptation.status != "done":
        chip += f' <span class="chip {kind}">{word}</span>'
    on = ' <span class="soft">on the original</span>' if step.feedback_on == "original" else ""
    return f"{e(clipped(step.said))}{chip}{on}"
