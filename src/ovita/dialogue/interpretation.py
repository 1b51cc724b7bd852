"""What an utterance comes to in a dialogue: what it does to a session, and feedback as it was read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ovita.dialogue.history import Kind
from ovita.instruct.edits import Edit
from ovita.instruct.frames import Quantity, Reading, SemanticFrame
from ovita.instruct.numerals import amount_at
from ovita.request import FeedbackOn
from ovita.result import Adaptation


@dataclass(frozen=True)
class Interpretation:
    """What an utterance does to a session: it adds a step of a kind, goes to another, or (None and None) does neither.

    `asked` is the utterance, where the result is a question; `same_utterance`, as for a step, says
    that it was said in one utterance with the turn before.
    """

    result: Adaptation
    kind: Kind | None = "said"
    on: FeedbackOn = "current"
    goto: int | None = None
    asked: str = ""
    same_utterance: bool = False


@dataclass(frozen=True)
class Feedback:
    """Feedback as it was read: edits of the frames of the turns in force from `first` on, or a question.

    `values` are what was realised for these frames; `parameters` are new values, where the words name a parameter.
    """

    said: str
    reading: Reading
    frames: tuple[SemanticFrame, ...] = ()
    first: int = 0
    values: Mapping[str, Quantity] | None = None
    parameters: Mapping[str, float] | None = None

    @property
    def edits(self) -> tuple[Edit, ...]:
        """What is to be changed."""
        return self.reading.edits

    @property
    def left_over(self) -> tuple[str, ...]:
        """The unread words, where they hold an amount, are several, or are a wish by itself ("and dance")."""
        words, said = self.reading.unread, self.said.lower()
        counts = any(amount_at(w.split(), 0) is not None or f"and {w.lower()}" in said for w in words)
        return words if len(words) > 1 or counts else ()


def frames_in(turns: Sequence[Adaptation]) -> tuple[SemanticFrame, ...]:
    """The frames of some turns, in order."""
    return tuple(frame for turn in turns for frame in turn.frames)


def numbers_of(turn: Adaptation) -> dict[str, float]:
    """The parameters of a turn that are numbers."""
    return {p.name: p.value for p in turn.parameters if isinstance(p.value, int | float)}
