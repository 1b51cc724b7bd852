"""Why feedback may mean something else than it was taken for: odd numbers, and giving up more than it names."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from ovita.dialogue.interpretation import Feedback, frames_in, numbers_of
from ovita.instruct.chunks import Chunk, chunks
from ovita.instruct.edits import Command, Drop, Set
from ovita.instruct.looking_back import EVEN
from ovita.instruct.remarks import named_frames
from ovita.result import Adaptation
from ovita.text import number

FURTHER = frozenset("also n plus too besides".split())
"""Words at the beginning with which something more is asked for."""

FAR = 3.0
"""How many times as much, or as little, a bare number among unknown words may ask for without being shown first."""


def gives_up_more(feedback: Feedback, turns: Sequence[Adaptation]) -> bool:
    """Whether all of some turns would be taken back though the words name some of it only, or another change."""
    kept = _stays(feedback, turns)
    if kept is None or not turns:
        return False
    frames = frames_in(turns)
    named = {*named_frames(feedback.said, turns[-1].scene, frames)}
    return bool(named) and named != {*range(kept, len(frames))}


def _stays(feedback: Feedback, turns: Sequence[Adaptation]) -> int | None:
    """How many frames stay where turns are taken back as a whole; None where none are."""
    steps = [edit.command for edit in feedback.edits if isinstance(edit, Command) and edit.command in GOING_BACK]
    if any(isinstance(edit, Drop) and not edit.on for edit in feedback.edits):
        return 0 if steps[:1] == ["restart"] else len(frames_in(turns[: feedback.first]))
    if not steps:
        return None
    return 0 if steps[0] == "restart" else len(frames_in(turns[:-1]))


GOING_BACK = ("undo", "restart")
"""Commands that take turns back."""


def doubted(feedback: Feedback, before: Sequence[Adaptation], result: Adaptation) -> str:
    """Why what feedback comes to should be shown first, as a sentence; "" where nothing speaks against it.

    Args:
        feedback: As it was read.
        before: The turn that it is about, if there is one.
        result: What comes of it.
    """
    edit = feedback.edits[0] if len(feedback.edits) == 1 else None
    doubt = _odd_number(feedback, edit, before, result) if isinstance(edit, Set) else ""
    return doubt or ("" if feedback.reading.confidence >= EVEN else "Something else may be meant.")


def _odd_number(feedback: Feedback, edit: Set, before: Sequence[Adaptation], result: Adaptation) -> str:
    """Why a number that sets an amount may mean something else: "the cup is 4 cm tall"."""
    asked = edit.quantity.value
    said = chunks(feedback.said, result.scene, result.original.positions)
    after_never = [b.q.value for a, b in pairwise(said) if a.kind == "never" and b.q is not None]
    about = {name for frame in (*feedback.frames, *result.frames) for name in frame.named}
    things = [chunk for chunk in said if chunk.kind == "OBJ"]
    grounds = (
        (bool(said) and said[0].text.lower() in FURTHER, "It may be a further change."),
        (asked in after_never, f"{number(asked)} is what it should not be."),
        (not all(about & {*c.names} for c in things), "It may be about the object, not about the change."),
        (feedback.said.rstrip().endswith("?"), "It is a question."),
    )
    return next((why for speaks, why in grounds if speaks), _far(said, before, result))


def _far(said: Sequence[Chunk], before: Sequence[Adaptation], result: Adaptation) -> str:
    """That a bare number among unknown words is far from what it was, or ""."""
    stated = any(chunk.q is not None and chunk.q.unit for chunk in said)
    if stated or all(chunk.kind != "unknown" for chunk in said):
        return ""
    old = numbers_of(before[-1]) if before else {}
    far = (new for name, new in numbers_of(result).items() if _is_far(new, old.get(name, 0.0)))
    return next((f"{number(new)} is far from what it was." for new in far), "")


def _is_far(new: float, old: float) -> bool:
    """Whether a number is many times as much as another one, or as little."""
    return bool(new and old) and not 1 / FAR <= abs(new / old) <= FAR
