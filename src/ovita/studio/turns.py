"""What is said of turns: the ladder of verdicts, what was asked and what came out of it, and the history."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ovita.dialogue.history import ROOT, Step
from ovita.dialogue.session import Session
from ovita.paths.scene import Scene
from ovita.result import Adaptation
from ovita.studio.html import block, clipped, e, listed
from ovita.studio.sessions import LastUtterance, SessionController
from ovita.text import quoted


@dataclass(frozen=True)
class Rung:
    """One verdict as the page shows it: the class of its colour in the style sheet, a word, and a sentence."""

    colour: str
    word: str
    meaning: str


LADDER = {
    "done": Rung("good", "done", "It is as asked, and the limits that are known hold."),
    "limited": Rung("warn", "changed by the limits", "It is done, but the limits changed it or are not all kept."),
    "not_as_meant": Rung("wrong", "not as meant", "Something that was asked did not come out."),
    "infeasible": Rung("bad", "infeasible", "The limits cannot all hold; the line is the best effort. Do not run it."),
    "needs_confirmation": Rung("ask", "is that meant?", "A reading waits for your yes; nothing has changed."),
    "needs_clarification": Rung("ask", "question", "Something has to be known first; nothing has changed."),
    "not_understood": Rung("bad", "not understood", "It was not understood; nothing has changed."),
    "failed": Rung("bad", "failed", "It did not work; nothing has changed."),
}
"""By status of a result, best first; what is no result of words has no rung."""

LOST = Rung("wrong", "an earlier wish is lost", "It is done, but something that was asked before no longer holds.")
VIEWS = ("fit", "top", "front", "side", "follow")
"""How the scene can be looked at: everything, from above, from the front, from the right, and after what moves."""

_NOT_DONE = Rung("bad", "not done", "Nothing has changed.")
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


def rung(result: Adaptation | None) -> Rung:
    """The verdict on a result; on none, that nothing was done."""
    if result is None:
        return _NOT_DONE
    return LOST if result.status == "done" and result.lost else LADDER[result.status]


def chip(verdict: Rung) -> str:
    """A verdict as a small coloured word."""
    return f'<span class="chip {verdict.colour}" title="{e(verdict.meaning)}">{e(verdict.word)}</span>'


def account(result: Adaptation) -> str:
    """One line: what was asked, what came out as measured, and what the limits took back."""
    came = [p.outcome for p in result.postconditions if p.change_before or not p.held] or _moved(result)
    back = [f"{p.undone:.0%} of '{p.text}'" for p in result.postconditions if p.undone and p.undone > 0.005]
    if not back and result.status in ("limited", "infeasible") and result.constraints is not None:
        back = [*result.constraints.conflicts[:1]] or ["the path was moved to keep them"] * result.constraints.ok
    took = "; ".join(back) or "nothing"
    asked = result.instruction or "what the program says"
    parts = (("asked", asked), ("came out", "; ".join(came)), ("taken back by the limits", took))
    return '<p class="account">' + " ".join(f"<b>{name}</b> {e(clipped(text, 240))}" for name, text in parts) + "</p>"


def _moved(result: Adaptation) -> list[str]:
    from ovita.measure import sentences

    return [] if result.changes is None else [str(text).rstrip(".") for text in sentences(result.changes)[:2]]


def header(controller: SessionController, writer: str) -> str:
    """Name of the open session, the verdict on its line, its writer, and buttons for the view and for help."""
    session = controller.session
    told = (
        "no trajectory yet" if session.bare else f"{len(session.current)} waypoints, {session.current.duration:.1f} s"
    )
    looks = "".join(f'<button class="link" data-do="look {name}">{name}</button>' for name in VIEWS)
    return block(
        f'<div class="brand">{e(controller.title)} <small>{told}</small> {badge(session)}</div>'
        f'<div class="soft"><span class="key" style="background:var(--blue)"></span>original'
        f' &nbsp;<span class="key" style="background:var(--red)"></span>adapted &nbsp;&middot;&nbsp;'
        f' writer: {e(writer)}</div><div class="looks" role="group" aria-label="view">{looks}'
        '<button class="link" data-do="dark">dark</button>'
        '<button class="link" data-do="help" aria-label="keys and help">?</button></div>'
    )


def badge(session: Session) -> str:
    """The verdict on the line in force."""
    result = session.adaptation
    return "" if result is None else chip(rung(result))


def outcome(controller: SessionController) -> str:
    """How the last words went; the introduction before any."""
    if controller.busy is not None:
        return ""
    waiting, said = controller.session.pending, controller.said
    if waiting is not None and (said is None or said.result is not waiting):
        asked = said_card(LastUtterance(waiting.instruction, "current", waiting), waiting=True)
        return asked if said is None else said_card(said) + asked
    if said is not None:
        return said_card(said, waiting=waiting is not None)
    result = controller.session.adaptation
    if result is None:
        return welcome(controller.session.scene)
    text = result.message if result.status != "done" or result.lost else " ".join(result.plan[-4:])
    warnings = listed(result.warnings[:2]) if result.status == "done" else ""
    told = f"<p>{e(text)}</p>" if text else ""
    return block(f'<div class="card {rung(result).colour}">{chip(rung(result))}{told}{account(result)}{warnings}</div>')


def said_card(said: LastUtterance, *, waiting: bool = False) -> str:
    """What was said and did not become a turn, and why, or the reading that waits for a yes."""
    verdict = rung(said.result)
    card = "card waiting" if waiting else f"card {verdict.colour}"
    return block(
        f'<div class="{card}">&ldquo;{e(clipped(said.text))}&rdquo; {chip(verdict)}<p>{e(said.message)}</p></div>'
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
        f'<div class="soft">In this scene: {objects}. <button class="link" data-do="help">Keys and help (?)</button>'
        "</div></div>"
    )


def label(session: Session, turn: int) -> str:
    """A turn in a few words, such as "go up by 0.1" or, where knobs were turned, "left 0.2 -> 0.42"."""
    if turn == ROOT:
        return "the beginning"
    step, parent = session.history.steps[turn], session.history.parents[turn]
    if step.kind == "knobs" and parent != ROOT:
        before = {p.name: p.value for p in session.history.steps[parent].adaptation.parameters}
        turned = [
            f"{p.name.replace('_', ' ')} {_number(before[p.name])} \u2192 {_number(p.value)}"
            for p in step.adaptation.parameters
            if p.name in before and before[p.name] != p.value
        ]
        if turned:
            return ", ".join(turned)
    return step.said


def _number(value: Any) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def history(session: Session) -> str:
    """Every turn, the newest first, each a button that goes on from it; those that are out of force say so."""
    past = session.history
    if not past.steps:
        return ""
    in_force = set(past.path())
    lines = [_row(session, i, i in in_force) for i in range(len(past.steps) - 1, -1, -1)]
    lines.append(_line(ROOT, past.head == ROOT, "the beginning", ""))
    return block(f'<div class="card turns">{"".join(lines)}</div>')


def _row(session: Session, turn: int, in_force: bool) -> str:
    step, parent = session.history.steps[turn], session.history.parents[turn]
    after = "" if parent == turn - 1 else "from the beginning" if parent == ROOT else f"after {parent + 1}"
    notes = [after, "" if in_force else "undone", "on the original" if step.feedback_on == "original" else ""]
    soft = ", ".join(note for note in notes if note)
    told = f'{_kind(step)}{chip(rung(step.adaptation))} <span class="soft">{soft}</span>'
    return _line(turn, turn == session.history.head, clipped(label(session, turn)), told)


def _kind(step: Step) -> str:
    return f'<span class="chip">{_KINDS[step.kind]}</span> ' if _KINDS[step.kind] else ""


def _line(turn: int, now: bool, text: str, told: str) -> str:
    state = ' aria-current="step"' if now else ""
    return (
        f'<button class="turn" data-do="go {turn + 1}"{state} title="Go on from here"><b>{turn + 1}</b>'
        f"<span>{e(text)} {told}</span></button>"
    )


HELP_WORDS = frozenset({"help", "?", "help me", "what can i say", "what can i do", "how does this work", "hilfe"})


def is_help(text: str) -> bool:
    """Whether someone asks how to use the studio, rather than for a change."""
    return " ".join(text.lower().strip(" ?!.").split()) in HELP_WORDS or text.strip() == "?"


def helping(session: Session, tries: tuple[str, ...], writer: str) -> str:
    """The answer to "help": what can be said in this scene, and who reads it."""
    named = quoted(session.scene.names[:6]) if len(session.scene) else "no objects"
    who = (
        "The built-in reader knows directions, distances, speeds, shapes and ends; a language model, chosen under Set"
        " up, understands more."
        if writer == "builtin"
        else f"What you say is read by {writer}."
    )
    said = listed([f"{text}" for text in (*tries, "A bit more", "Undo the last", "Only near the end")])
    return block(
        f'<div class="card"><b>What can be said here</b><p>Objects: {e(named)}. {e(who)}</p>{said}'
        '<button class="link" data-do="help">All keys and verdicts (?)</button></div>'
    )
