"""What a person asks: one instruction about one trajectory in its scene."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from ovita.errors import RequestError
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.policy import Parameter

MAX_INSTRUCTION = 2000
"""Longest instruction that is accepted [characters]."""

FeedbackOn = Literal["original", "current"]


@dataclass(frozen=True)
class Turn:
    """An earlier turn of the same session that is still in force, with all corrections made to it since.

    Args:
        instruction: What it does, in words that stand on their own.
        start: The trajectory that it began with.
        parameters: The parameters of its policy with their present values.
        steps: How many steps of the session it took.
        feedback_on: Which trajectory it was about.
        plan: What was done.
        code: Its policy, or "" where a writer need not see it.
        contacts: Names of objects that it means to touch.
    """

    instruction: str
    start: Trajectory
    parameters: tuple[Parameter, ...] = ()
    steps: int = 1
    feedback_on: FeedbackOn = "current"
    plan: tuple[str, ...] = ()
    code: str = ""
    contacts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Request:
    """One instruction about one trajectory.

    Args:
        instruction: The person's instruction.
        trajectory: The trajectory that the instruction is about.
        scene: Its surroundings.
        robot: The limits that will be enforced.
        history: Earlier turns, oldest first.
        origin: How the trajectory came about, such as "planned from above the box to above the plate", or "".

    Raises:
        RequestError: If the instruction is empty or longer than 2000 characters.
    """

    instruction: str
    trajectory: Trajectory
    scene: Scene = field(default_factory=Scene)
    robot: Robot = field(default_factory=lambda: Robot.preset("none"))
    history: tuple[Turn, ...] = ()
    origin: str = ""

    def __post_init__(self) -> None:
        if not self.instruction.strip():
            raise RequestError("the instruction is empty; say what should change, such as 'slow down near the cup'")
        if len(self.instruction) > MAX_INSTRUCTION:
            raise RequestError(
                f"the instruction has {len(self.instruction)} characters; at most {MAX_INSTRUCTION} are read"
            )
