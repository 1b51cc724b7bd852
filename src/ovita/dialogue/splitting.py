"""A step back, or what is to be dropped, and what to do instead, said in one breath: two turns."""

from __future__ import annotations

from collections.abc import Iterator

from ovita.dialogue.interpretation import frames_in
from ovita.dialogue.reframing import DialogueState, is_certain
from ovita.instruct.chunks import chunks
from ovita.instruct.edits import Command, Drop, Edit
from ovita.instruct.feedback import DENYING, read_feedback
from ovita.instruct.frames import name_of


def split_in_turns(said: str, state: DialogueState) -> tuple[str, str]:
    """A step back that an utterance asks for first, and what after that; "" and all of it where it is one turn.

    "Undo that and go left by 0.1". A correction and a further wish ("make that 4 seconds, and slow down there as
    well") are one turn, whose edits the network reads together.
    """
    if not state.results:
        return "", said
    said = state.named(said)
    return next(
        (two for two in _halves(said, state) if _steps_back(two[0], state) and _asks_anew(two[1], state)), ("", said)
    )


def _halves(said: str, state: DialogueState) -> Iterator[tuple[str, str]]:
    """An utterance cut at each of its pauses, but between numbers."""
    found, _ = chunks(said, state.now.scene, state.current.positions)
    for before, pause, after in zip(found, found[1:], found[2:], strict=False):
        pauses = pause.kind in PAUSES and before.kind not in PAUSES and pause.text != ":"
        if pauses and not (before.q and after.q):
            yield said[: pause.span[0]], said[pause.span[1] :].lstrip(" ,.;").removeprefix("and ")


PAUSES = ("and", "comma", "dot")
"""Classes of what stands between two turns that are said as one."""

BACK = ("undo", "restart")
"""Commands that take steps back."""


def _by_rules(said: str, state: DialogueState) -> tuple[Edit, ...]:
    """The edits of an utterance that the rules read in full as feedback on the last turn."""
    frames = frames_in(state.results[-1:])
    found = read_feedback(said, state.now.scene, frames, state.current.positions)
    return () if found is None or found.unread or found.question else found.edits


def _steps_back(said: str, state: DialogueState) -> bool:
    """Whether an utterance only takes steps back, or drops some; "no" before something else only corrects."""
    edits = _by_rules(said, state)
    goes = edits and all(isinstance(one, Drop) or (isinstance(one, Command) and one.command in BACK) for one in edits)
    return bool(goes) and not DENYING.issuperset(said.lower().replace(",", " ").split())


def _asks_anew(said: str, state: DialogueState) -> bool:
    """Whether an utterance is an instruction; "back to how it was" says no more than a step back."""
    wish = state.read(said)
    return is_certain(wish) and any(name_of(frame) != "return" for frame in wish.frames)
