"""What is said in one breath and is two turns: a correction and a further wish, a step back and what to do instead."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ovita.dialogue.interpretation import Feedback, frames_in
from ovita.dialogue.reframing import DialogueState, is_certain
from ovita.instruct.chunks import chunks
from ovita.instruct.edits import Also, Command, Drop, Edit, Rescale, Set
from ovita.instruct.feedback import DENYING, read_feedback
from ovita.instruct.frames import SemanticFrame, name_of
from ovita.instruct.understanding import understand


def split_in_turns(said: str, state: DialogueState) -> tuple[str, str]:
    """What an utterance asks for first, and after that; "" and all of it where it is one turn.

    "Undo that and go left by 0.1", "make that 4 seconds, and slow down there as well": the first is feedback that takes
    a step back, or that only by itself is read in full. Nothing is split behind a first part that is read by itself
    while what follows is not: that would lose words of it.
    """
    if not state.results:
        return "", said
    said = state.named(said)
    for first, rest in _halves(said, state):
        if _steps_back(first, state) and _asks_anew(rest, state):
            return first, rest
        one = _kinds(() if _denies(first) else _by_rules(first, state))
        if one and one <= BY_ITSELF:
            return (first, rest) if _is_another(rest, one, said, state) else ("", said)
    return "", said


def _halves(said: str, state: DialogueState) -> Iterator[tuple[str, str]]:
    """An utterance cut at each of its pauses, but between numbers."""
    found, _ = chunks(said, state.now.scene, state.current.positions)
    for before, pause, after in zip(found, found[1:], found[2:], strict=False):
        pauses = pause.kind in PAUSES and before.kind not in PAUSES and pause.text != ":"
        if pauses and not (before.q and after.q):
            yield said[: pause.span[0]], said[pause.span[1] :].lstrip(" ,.;").removeprefix("and ")


def _is_another(rest: str, one: set[str], said: str, state: DialogueState) -> bool:
    """Whether the rest of an utterance is a wish of its own, which the whole of it is not read as."""
    asked = _asked_for(rest, state)
    two = _kinds(asked)
    if not two or not two.isdisjoint(one | {"Command", "Again"}):
        return False
    whole = _kinds(_asked_for(said, state))
    return whole != one | two and not (whole and _says_no_more(asked, state.results[-1].frames))


PAUSES = ("and", "comma", "dot")
"""Classes of what stands between two turns that are said as one."""

BY_ITSELF = frozenset(("amount", "Restrict", "Drop"))
"""Kinds of feedback that are a turn by themselves before another: how much, where, and what goes."""

SURE = 0.7
"""How sure it has to be that part of an utterance is feedback, for it to be a turn of its own."""


def _says_no_more(asked: Sequence[Edit | SemanticFrame], before: Sequence[SemanticFrame]) -> bool:
    """Whether frames say nothing that those before do not, and not where: "slower, like a snail"."""
    known = {type(frame) for frame in before}
    return bool(asked) and all(type(one) in known and _is_bare(one) for one in asked)


def _is_bare(one: Edit | SemanticFrame) -> bool:
    """Whether a frame says neither where nor how much."""
    return isinstance(one, SemanticFrame) and not (one.part or one.named or one.quantities)


def _asked_for(said: str, state: DialogueState) -> tuple[Edit | SemanticFrame, ...]:
    """The edits, or the frames, of an utterance, where it is read in full as feedback, or as an instruction."""
    if not said.strip(" ,."):
        return ()
    found = state.feedback(said)
    if found is not None:
        return found.edits if _is_sure(found, said, state) else ()
    if not state.offline:
        wish = state.read(said)
        return wish.frames if is_certain(wish) else ()
    verdict = understand(said, state.now.scene, state.current)
    open_ = verdict.outcome != "do" or verdict.doubts or verdict.unused
    return () if open_ else verdict.reading.frames


def _is_sure(found: Feedback, said: str, state: DialogueState) -> bool:
    """Whether all of an utterance is feedback that corrects nothing; what is dropped the rules have to read so, too."""
    reading = found.reading
    if found.parameters is not None or reading.unread or reading.question or reading.confidence < SURE:
        return False
    if _denies(said):
        return False
    return not any(isinstance(edit, Drop) for edit in found.edits) or _by_rules(said, state) == found.edits


def _denies(said: str) -> bool:
    """Whether an utterance corrects what was said, so that it is one turn with what follows."""
    return not DENIED.isdisjoint(said.lower().replace(",", " ").replace(".", " ").split())


DENIED = frozenset(("not", "wrong", "don't", "didn't", "never", "no"))
"""Words with which feedback is corrected, so that it is one turn with what follows."""


def _by_rules(said: str, state: DialogueState) -> tuple[Edit, ...]:
    """The edits of an utterance that the rules read in full as feedback on the last turn."""
    frames = frames_in(state.results[-1:])
    found = read_feedback(said, state.now.scene, frames, state.current.positions)
    return () if found is None or found.unread or found.question else found.edits


def _kinds(asked: Sequence[Edit | SemanticFrame]) -> set[str]:
    """What edits and frames are about: amounts are of one kind, and a further frame is as one of an instruction."""
    about = [one.frame if isinstance(one, Also) else one for one in asked]
    return {"amount" if isinstance(one, Rescale | Set) else type(one).__name__ for one in about}


def _steps_back(said: str, state: DialogueState) -> bool:
    """Whether an utterance only takes steps back; "no" before something else only corrects."""
    edits = _by_rules(said, state)
    goes = edits and all(isinstance(one, Command) and one.command in ("undo", "restart") for one in edits)
    return bool(goes) and not DENYING.issuperset(said.lower().replace(",", " ").split())


def _asks_anew(said: str, state: DialogueState) -> bool:
    """Whether an utterance is an instruction; "back to how it was" says no more than a step back."""
    wish = state.read(said)
    return is_certain(wish) and any(name_of(frame) != "return" for frame in wish.frames)
