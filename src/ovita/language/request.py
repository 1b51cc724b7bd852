"""What a person asks, and what a writer is shown and answers: the data that flows through phases one and two."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

from ovita.errors import RequestError
from ovita.language.watch import Watch
from ovita.robot import Robot
from ovita.scene import Scene
from ovita.trajectory import Trajectory

MAX_INSTRUCTION = 2000
"""Longest instruction that is accepted [characters]."""

FeedbackOn = Literal["original", "current"]


@dataclass(frozen=True)
class Turn:
    """An earlier turn of the same session, as far as a writer needs to know it."""

    instruction: str
    feedback_on: FeedbackOn
    plan: tuple[str, ...] = ()
    code: str = ""


@dataclass(frozen=True)
class Request:
    """One instruction about one trajectory.

    Args:
        instruction: What the person said.
        trajectory: The trajectory that the instruction is about.
        scene: Its surroundings.
        robot: The limits that will be enforced.
        history: Earlier turns, oldest first.

    Raises:
        RequestError: If the instruction is empty or longer than 2000 characters.
    """

    instruction: str
    trajectory: Trajectory
    scene: Scene = field(default_factory=Scene)
    robot: Robot = field(default_factory=lambda: Robot.preset("none"))
    history: tuple[Turn, ...] = ()

    def __post_init__(self) -> None:
        if not self.instruction.strip():
            raise RequestError("the instruction is empty; say what should change, such as 'slow down near the cup'")
        if len(self.instruction) > MAX_INSTRUCTION:
            raise RequestError(
                f"the instruction has {len(self.instruction)} characters; at most {MAX_INSTRUCTION} are read"
            )


@dataclass(frozen=True)
class Attempt:
    """A policy that was refused or failed, and why; it is shown to the writer that repairs it."""

    code: str
    error: str


@dataclass(frozen=True)
class Prompt:
    """What a policy writer is given.

    Args:
        request: The request that was grounded.
        fixed: Role, rules, toolkit and examples: the same for every request, so that prefix caches work.
        situation: Frame, objects, environment, trajectory, limits, history and the instruction.
        attempts: Failed attempts so far, oldest first.
        watch: Who looks on: what is told while a writer writes, and when it must end.
    """

    request: Request
    fixed: str
    situation: str
    attempts: tuple[Attempt, ...] = ()
    watch: Watch = field(default_factory=Watch, compare=False, repr=False)

    def repaired(self, code: str, error: str) -> Prompt:
        """Return the prompt that follows when `code` failed with `error`."""
        return replace(self, attempts=(*self.attempts, Attempt(code, error)))


@dataclass(frozen=True)
class WriterInfo:
    """Which writer answered, and what it cost.

    Args:
        kind: "builtin", "llm", or another writer's kind.
        model: Model name, or "".
        temperature: Sampling temperature, or None where there is none.
        input_tokens: Tokens read over all attempts.
        output_tokens: Tokens written over all attempts.
        reason: Why this writer was chosen.
        tried: Every writer that was asked, in order, with what came of it.
    """

    kind: str
    model: str = ""
    temperature: float | None = None
    input_tokens: int = 0
    output_tokens: int = 0
    reason: str = ""
    tried: tuple[str, ...] = ()


@dataclass(frozen=True)
class Reply:
    """What a policy writer answers: a policy, a question back, or that it did not understand.

    Args:
        kind: "policy", "question" or "not_understood".
        plan: The high-level plan, one step a line.
        code: Python source of the policy; "" unless kind is "policy".
        assumptions: What was assumed because the instruction leaves it open.
        question: The question back; "" unless kind is "question".
        unplaced: The words that could not be placed.
        contacts: Names of objects that the instruction asks to touch or pass through.
        writer: Who answered.
    """

    kind: Literal["policy", "question", "not_understood"]
    plan: tuple[str, ...] = ()
    code: str = ""
    assumptions: tuple[str, ...] = ()
    question: str = ""
    unplaced: tuple[str, ...] = ()
    contacts: tuple[str, ...] = ()
    writer: WriterInfo = field(default_factory=lambda: WriterInfo("unknown"))
