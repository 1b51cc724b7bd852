"""What feedback is resolved against, and what it can come to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from ovita.paths.trajectory import Trajectory
from ovita.policy import Parameter


@dataclass(frozen=True)
class Past:
    """A turn that is in force, with all corrections made to it since.

    Args:
        instruction: What it does, in words that stand on their own.
        start: The trajectory that it began with.
        parameters: The knobs of its policy with their present values.
        steps: How many steps of the session it took.
    """

    instruction: str
    start: Trajectory
    parameters: tuple[Parameter, ...] = ()
    steps: int = 1


@dataclass(frozen=True)
class Resolution:
    """What feedback comes to.

    Args:
        kind: "tune" (turn knobs of the last policy), "rewrite" (another instruction), "again" (the last policy once
            more on the result), "undo", "redo", "restart", "accept", or "ask" (a question back).
        taken: What the words were taken to mean, as a sentence.
        values: New values of knobs by name: of the last policy, or of the one that is written for `instruction`.
        instruction: The instruction of a "rewrite", in words that stand on their own.
        begins: Which trajectory a "rewrite" is applied to: the one that the last turn began with, the current one, or
            the original (then the instruction holds all turns).
        steps: How many steps of the session "undo" takes back.
        question: What is asked back.
    """

    kind: Literal["tune", "rewrite", "again", "undo", "redo", "restart", "accept", "ask"]
    taken: str = ""
    values: Mapping[str, float | int] = field(default_factory=dict)
    instruction: str = ""
    begins: Literal["start", "current", "original"] = "start"
    steps: int = 0
    question: str = ""

    @property
    def certain(self) -> bool:
        """Whether it holds whatever language model writes the policies: all but other words and questions."""
        return self.kind not in ("rewrite", "ask")
