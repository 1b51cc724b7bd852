"""One sample, one writer, one condition: ask, judge, give feedback, judge again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

from ovita.bench.conditions import Condition
from ovita.bench.dataset import Sample
from ovita.bench.records import Record, Round, Rows
from ovita.bench.replies import RecordingWriter, ReplayingWriter
from ovita.chain import Isolation, adapt
from ovita.io import load_robot, scene_dict
from ovita.limits import ConstraintOptions
from ovita.measure.predicates import Check
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.request import MAX_INSTRUCTION, FeedbackOn, Request, Turn
from ovita.result import Adaptation

BY_SUBSET = "by-subset"
"""The robot of a sample is told by the words of its subset: drone, ground robot, arm or manipulator."""

_WORDS = {"drone": "drone", "ground": "ground", "manipulator": "arm", "arm": "arm"}

_TOKENS = ("input_tokens", "output_tokens")

Answering = RecordingWriter | ReplayingWriter


@dataclass(frozen=True)
class Protocol:
    """The evaluation protocol shared by all samples and writers of a run.

    Args:
        feedback: How often a failed check's sentence goes back as feedback, at most.
        feedback_on: The trajectory that feedback is about.
        robot: Whose limits are enforced: a preset, a robot file, or "by-subset"; None takes the sample's own.
        isolation: How policies are isolated.
    """

    feedback: int = 0
    feedback_on: FeedbackOn = "original"
    robot: str | None = None
    isolation: Isolation = "auto"


@dataclass(frozen=True)
class Judged:
    """A verdict with its degree."""

    passed: bool
    score: float
    sentence: str


def judge(check: Check, original: Trajectory, adapted: Trajectory, scene: Scene) -> Judged:
    """Judge a trajectory; the score is the share of the clauses that hold."""
    clauses = check.children if check.kind == "all_of" else (check,)
    verdict = check.judge(original, adapted, scene)
    held = [clause.judge(original, adapted, scene).passed for clause in clauses]
    return Judged(verdict.passed, sum(held) / len(held), verdict.sentence)


def evaluate(sample: Sample, writer: Answering, condition: Condition, protocol: Protocol) -> Record:
    """Put a sample to a writer and judge every answer.

    Raises:
        IsolationUnavailable: If this machine cannot provide the requested isolation.
        InputError: If the robot cannot be used.
    """
    task, robot = sample.task, robot_for(sample, protocol.robot)
    idle = judge(sample.check, task.trajectory, task.trajectory, task.scene)
    rounds: list[Round] = []
    talk = _Conversation(sample, robot, protocol.feedback_on)
    said = task.instruction
    ask = _asker(writer, condition, protocol.isolation)
    for _ in range(protocol.feedback + 1):
        taken, waited = len(writer.replies), writer.waited
        result = ask(talk.request(said))
        done = _round(sample, said, result, idle)
        ms = sum(result.timings_ms.values()) - 1e3 * (writer.waited - waited)
        replies = tuple(writer.replies[taken:])
        tokens = {key: sum(r["reply"]["writer"][key] for r in replies if "reply" in r) for key in _TOKENS}
        rounds.append(replace(done, ms=round(max(ms, 0.0), 3), replies=replies, **tokens))
        talk.record(said, result)
        if done.passed or any(reply.get("unreached") for reply in rounds[-1].replies):
            break
        said = done.sentence
    return Record(
        sample=sample.id,
        subset=sample.subset,
        kind=sample.kind,
        writer=writer.name,
        condition=condition.name,
        instruction=task.instruction,
        robot=robot.name,
        idle=idle.passed,
        original=waypoints(task.trajectory),
        scene=scene_dict(task.scene),
        check=sample.check.to_dict(),
        rounds=tuple(rounds),
        void=sample.void,
    )


def robot_for(sample: Sample, robot: str | None) -> Robot:
    """The robot whose limits apply to a sample."""
    if robot == BY_SUBSET:
        words = f"{sample.subset} {sample.id}".lower()
        return Robot.preset(next((preset for word, preset in _WORDS.items() if word in words), "none"))
    return load_robot(robot or sample.task.robot or "none")


def _asker(writer: Answering, condition: Condition, isolation: Isolation) -> Callable[[Request], Adaptation]:
    options = ConstraintOptions(enabled=condition.constraints)

    def ask(request: Request) -> Adaptation:
        return adapt(
            request,
            writer=writer,
            constraints=options,
            isolation=isolation,
            repairs=condition.repairs,
            examples=condition.examples,
            time_limit=None,
        )

    return ask


class _Conversation:
    """The conversation on one sample so far, from which the next request is built."""

    def __init__(self, sample: Sample, robot: Robot, on: Literal["original", "current"]) -> None:
        self.sample, self.robot, self.on = sample, robot, on
        self.said: list[str] = []
        self.turns: list[Turn] = []
        self.current: Trajectory | None = None

    def request(self, said: str) -> Request:
        task = self.sample.task
        if self.on == "current" and self.current is not None:
            return Request(said[:MAX_INSTRUCTION], self.current, task.scene, self.robot, tuple(self.turns))
        everything = ". ".join([*(s.strip().rstrip(".") for s in self.said), said.strip()])
        return Request(everything[:MAX_INSTRUCTION], task.trajectory, task.scene, self.robot, tuple(self.turns))

    def record(self, said: str, result: Adaptation) -> None:
        self.said.append(said)
        self.turns.append(Turn(said, result.original, feedback_on=self.on, plan=result.plan, code=result.code))
        if result.usable:
            self.current = result.adapted


def _round(sample: Sample, said: str, result: Adaptation, idle: Judged) -> Round:
    task = sample.task
    usable = result.usable
    judged = judge(sample.check, task.trajectory, result.adapted, task.scene) if usable else replace(idle, passed=False)
    proposed = result.proposed
    return Round(
        said=said,
        status=result.status,
        passed=judged.passed,
        score=judged.score if usable else 0.0,
        sentence=judged.sentence,
        executable=usable,
        attempts=result.attempts,
        ms=0.0,
        limits=result.constraints.status if result.constraints else "none",
        proposed_passed=proposed is not None and sample.check.judge(task.trajectory, proposed, task.scene).passed,
        model=result.writer.model,
        plan=result.plan,
        code=result.code,
        explanation=result.explanation,
        error=result.error or result.question,
        adapted=waypoints(result.adapted),
    )


def waypoints(trajectory: Trajectory) -> Rows:
    """The rows x, y, z, speed of a trajectory, for a record."""
    return tuple(tuple(row) for row in trajectory.to_array().tolist())
