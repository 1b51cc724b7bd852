"""A step back, or what is to be dropped, and what to do instead, said in one breath: two turns."""

from __future__ import annotations

from collections.abc import Iterator

from ovita.dialogue.interpretation import frames_in
from ovita.dialogue.reframing import DialogueState, is_certain
from ovita.instruct.chunks import chunks
from ovita.instruct.edits import Command, Drop
from ovita.instruct.frames import name_of
from ovita.instruct.understanding import feedback


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
    found = chunks(said, state.now.scene, state.current.positions)
    for before, pause, after in zip(found, found[1:], found[2:], strict=False):
        pauses = pause.kind in PAUSES and before.kind not in PAUSES and pause.text != ":"
        if pauses and not (before.q and after.q):
            yield said[: pause.span[0]], said[pause.span[1] :].lstrip(" ,.;").removeprefix("and ")


PAUSES = ("and", "comma", "dot")
"""Classes of what stands between two turns that are said as one."""

BACK = ("undo", "restart")
"""Commands that take steps back."""


DENYING = frozenset("no nope nah do not please".split())
"""All words of an utterance that only says no."""


def _steps_back(said: str, state: DialogueState) -> bool:
    """Whether an utterance only takes steps back, or drops some; "no" before something else only corrects."""
    found = feedback(said, state.now.scene, frames_in(state.results[-1:]), state.current.positions)
    edits = () if found is None or found.unread else found.edits
    goes = edits and all(isinstance(one, Drop) or (isinstance(one, Command) and one.command in BACK) for one in edits)
    return bool(goes) and not DENYING.issuperset(said.lower().replace(",", " ").split())


def _asks_anew(said: str, state: DialogueState) -> bool:
    """Whether an utterance is an instruction; "back to how it was" and "keep the shift" are none."""
    wish = state.read(said)
    return is_certain(wish) and any(name_of(frame) not in ("return", "keep") for frame in wish.frames)
