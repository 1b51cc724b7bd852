"""What is said of turns: the ladder of verdicts, what was asked and what came out of it, and the history."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ovita.dialogue.history import ROOT, Step
from ovita.dialogue.session import Session
from ovita.measure import moved_ends, sentences
from ovita.paths.scene import Scene
from ovita.result import Adaptation
from ovita.studio.html import block, clipped, e
from ovita.studio.html import listed as bullets
from ovita.studio.sessions import LastUtterance, SessionController
from ovita.text import listed, quoted, sentence


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
    "answered": Rung("ask", "answered", "You asked about the path; nothing has changed."),
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


def account(result: Adaptation, turned: str = "") -> str:
    """One line: what was asked, and `turned` by hand since, what came out as measured, and what the limits did."""
    came = [p.outcome for p in result.postconditions if p.change_before or not p.held]
    asked = (result.instruction or "what the program says") + (f", then turned {turned}" if turned else "")
    told = "; ".join([*came, *_ends(result)] if came else _changed(result))
    conflicts = result.constraints.conflicts if result.status == "infeasible" and result.constraints else ()
    did = "; ".join([listed(result.by_limits) or "changed nothing", *conflicts[:1]])
    parts = (("asked", asked), ("came out", told), ("the limits", did))
    lines = "<br>".join(f"<b>{name}:</b> {e(clipped(text, 400))}" for name, text in parts)
    return f'<p class="account">{lines}</p>'


def _changed(result: Adaptation) -> list[str]:
    """What was measured where nothing was promised: the first sentences, and where the ends went."""
    if result.changes is None:
        return []
    told = sentences(result.changes)
    return [text.rstrip(".") for text in dict.fromkeys([*told[:2], *map(sentence, _ends(result))])]


def _ends(result: Adaptation) -> list[str]:
    return [] if result.changes is None else list(moved_ends(result.changes))


def header(controller: SessionController, writer: str) -> str:
    """Name of the open session, the verdict on its line, its writer, and buttons for the view and for help."""
    session = controller.session
    path = session.current
    told = "no trajectory yet" if session.bare else f"{len(path)} waypoints, {path.duration:.1f} s"
    adapted = ' &nbsp;<span class="key" style="background:var(--red)"></span>adapted' if session.steps else ""
    looks = "".join(f'<button class="link" data-do="look {name}">{name}</button>' for name in VIEWS)
    return block(
        f'<div class="brand"><span title="{e(controller.title)}">{e(controller.title)}</span> <small>{told}</small>'
        f" {badge(session)}</div>"
        f'<div class="soft"><span class="key" style="background:var(--blue)"></span>original{adapted}'
        f' &nbsp;&middot;&nbsp; writer: {e(writer)}</div><div class="looks" role="group" aria-label="view">{looks}'
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
    waiting, said, result = controller.session.pending, controller.said, controller.session.adaptation
    if waiting is not None and (said is None or said.result is not waiting):
        asked = said_card(LastUtterance(waiting.instruction, "current", waiting), waiting=True)
        return asked if said is None else said_card(said) + asked
    if said is not None:
        return said_card(said, waiting=waiting is not None)
    return welcome(controller.session.scene) if result is None else _result_card(result, turned(controller.session))


def _result_card(result: Adaptation, turned: str) -> str:
    text = result.message if result.status != "done" or result.lost else " ".join(result.plan[-4:])
    rest = result.warnings[:2] if result.status == "done" else [loss.sentence() for loss in result.lost]
    told = f"<p>{e(text)}</p>" if text else ""
    line = account(result, turned)
    return block(f'<div class="card {rung(result).colour}">{chip(rung(result))}{told}{line}{bullets(rest)}</div>')


def said_card(said: LastUtterance, *, waiting: bool = False) -> str:
    """What was said and did not become a turn, and why, or the reading that waits for a yes."""
    verdict = rung(said.result)
    card = "card waiting" if waiting else f"card {verdict.colour}"
    words = f"&ldquo;{e(clipped(said.text))}&rdquo;"
    return block(f'<div class="{card}">{words} {chip(verdict)}<p>{e(said.message)}</p></div>')


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
    known = step.kind == "knobs" and parent != ROOT
    return (_between(session.history.steps[parent], step) if known else "") or step.said


def turned(session: Session) -> str:
    """What was turned since the words of the turn in force, such as "left 0.2 -> 0.42", or ""."""
    steps = session.steps
    said = next((step for step in reversed(steps) if step.kind != "knobs"), None)
    return _between(said, steps[-1]) if said is not None and steps[-1].kind == "knobs" else ""


def _between(before: Step, after: Step) -> str:
    """Which knobs differ, as a person counts."""
    was = {p.name: p for p in before.adaptation.parameters}
    return ", ".join(
        f"{p.called} {_number(was[p.name].shown)} \u2192 {_number(p.shown)}"
        for p in after.adaptation.parameters
        if p.name in was and was[p.name].value != p.value
    )


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
    if step.adaptation.status == "limited":
        notes += [f"the limits {what}" for what in step.adaptation.by_limits]
    soft = clipped(", ".join(note for note in notes if note), 160)
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
        if writer in ("builtin", "auto")
        else f"What you say is read by {writer}."
    )
    said = bullets([f"{text}" for text in (*tries, "A bit more", "Undo the last", "Only near the end")])
    return block(
        f'<div class="card"><b>What can be said here</b><p>Objects: {e(named)}. {e(who)}</p>{said}'
        '<button class="link" data-do="help">All keys and verdicts (?)</button></div>'
    )
