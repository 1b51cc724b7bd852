"""Phase five: feedback. A session keeps every turn, so that nothing a person says is lost and all can be undone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ovita.adaptation import Adaptation
from ovita.chain import Isolation, adapt, rerun
from ovita.constraints import ConstraintOptions
from ovita.errors import RequestError
from ovita.language.request import FeedbackOn, Request, Turn
from ovita.language.writer import PolicyWriter
from ovita.robot import Robot
from ovita.scene import Scene
from ovita.trajectory import Trajectory

USABLE = ("ok", "infeasible")
"""Statuses whose trajectory becomes the current one."""


@dataclass(frozen=True)
class Step:
    """One turn of a session.

    Args:
        said: What the person said.
        feedback_on: Which trajectory it was about.
        adaptation: What came of it. Its instruction is `said`, or for feedback on the original everything said
            since the original, since that is what was applied.
        tuned: Whether only knobs were turned.
    """

    said: str
    feedback_on: FeedbackOn
    adaptation: Adaptation
    tuned: bool = False


@dataclass
class Session:
    """A conversation about one trajectory.

    Args:
        original: The trajectory that it began with.
        scene: Its surroundings.
        robot: The limits.
        writer: A policy writer or its name.
        constraints: How limits are enforced.
        isolation: How policies must be isolated.
    """

    original: Trajectory
    scene: Scene = field(default_factory=Scene)
    robot: Robot = field(default_factory=lambda: Robot.preset("none"))
    writer: PolicyWriter | str = "auto"
    constraints: ConstraintOptions = field(default_factory=ConstraintOptions)
    isolation: Isolation = "strict"
    _done: list[Step] = field(default_factory=list, init=False)
    _undone: list[Step] = field(default_factory=list, init=False)

    @property
    def steps(self) -> tuple[Step, ...]:
        """The turns that are in force, oldest first."""
        return tuple(self._done)

    @property
    def current(self) -> Trajectory:
        """The trajectory as it stands."""
        return self._done[-1].adaptation.adapted if self._done else self.original

    @property
    def adaptation(self) -> Adaptation | None:
        """The last turn's adaptation, or None before the first."""
        return self._done[-1].adaptation if self._done else None

    def say(self, instruction: str, *, on: FeedbackOn = "current") -> Adaptation:
        """Adapt the current or the original trajectory.

        On "current" the instruction is applied to what there is now. On "original", as in the paper, it is added to
        what was said so far and all of it is applied to the original again. A turn that is not understood, or that
        fails, changes nothing and is not kept.

        Raises:
            InputError: If the instruction is empty or too long.
        """
        if not instruction.strip():
            raise RequestError("the instruction is empty; say what should change, such as 'slow down near the cup'")
        asked = instruction
        if on == "original" and self._done:
            said = [step.said.strip().rstrip(".") for step in self._done if not step.tuned]
            asked = ". ".join([*said, instruction.strip()])
        request = Request(
            asked,
            self.original if on == "original" else self.current,
            self.scene,
            self.robot,
            tuple(Turn(s.said, s.feedback_on, s.adaptation.plan, s.adaptation.code) for s in self._done),
        )
        result = adapt(request, writer=self.writer, constraints=self.constraints, isolation=self.isolation)
        if result.status in USABLE:
            self._done.append(Step(instruction, on, result))
            self._undone.clear()
        return result

    def tune(self, parameters: Mapping[str, Any]) -> Adaptation:
        """Turn knobs of the last turn's policy, values by name, and run it again; no writer is asked.

        Raises:
            RequestError: If there is no turn yet.
            PolicyError: If a parameter does not exist or the policy fails with it; the turn stays as it was.
        """
        if not self._done:
            raise RequestError("there is no policy yet; say what should change first")
        last = self._done[-1]
        result = rerun(last.adaptation, parameters, constraints=self.constraints, isolation=self.isolation)
        self._done.append(Step(last.said, last.feedback_on, result, tuned=True))
        self._undone.clear()
        return result

    def undo(self) -> bool:
        """Take the last turn back; say whether there was one."""
        if not self._done:
            return False
        self._undone.append(self._done.pop())
        return True

    def redo(self) -> bool:
        """Bring the turn that was last taken back again; say whether there was one."""
        if not self._undone:
            return False
        self._done.append(self._undone.pop())
        return True
