"""One sample, one writer, one condition: ask, judge, give feedback, judge again.

The writer is one that records every reply, or that answers from a record; the condition is what an ablation leaves out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from ovita.baselines import adapted_by, is_baseline
from ovita.baselines.base import KIND
from ovita.bench.dataset import Sample
from ovita.bench.records import Record, Round, Rows
from ovita.bench.systems import Answering, RecordingBaseline, RecordingWriter
from ovita.chain import REPAIRS, Isolation, adapt
from ovita.errors import RequestError
from ovita.io import load_robot, scene_dict
from ovita.limits import ConstraintOptions
from ovita.measure.predicates import Check, CheckResult
from ovita.paths.robot import Robot
from ovita.paths.trajectory import Trajectory
from ovita.request import MAX_INSTRUCTION, FeedbackOn, Request, Turn
from ovita.result import Adaptation
from ovita.writers.base import ExampleMode, Prompt

ABLATIONS: dict[str, str] = {
    "examples": "the prompt without examples, and with the paper's two instead of those that are like the instruction",
    "toolkit": "the paper's prompt for scripts, without any function to edit with",
    "grounding": "the prompt with the objects' names only, as in the paper: no positions, extents, speeds or limits",
    "repair": "a failing policy does not go back to its writer",
    "constraints": "limits are measured but not enforced",
}
"""What `--ablate` can switch off."""

PAPER_EXAMPLES = "paper examples"
"""The condition in which the prompt shows the paper's way of two fixed examples."""

WITHOUT_MODEL = ("repair", "constraints")
"""The ablations that mean something for a writer that reads no prompt."""


@dataclass(frozen=True)
class Condition:
    """One setting of the chain: "default", or what differs from it.

    Args:
        without: What is switched off, a key of `ABLATIONS`, or "".
        temperature: Of a model, or None for the run's own.
    """

    name: str = "default"
    without: str = ""
    temperature: float | None = None

    @property
    def examples(self) -> ExampleMode:
        """Which examples the prompt shows."""
        if self.name == PAPER_EXAMPLES or self.without == "toolkit":
            return "paper"
        return "none" if self.without == "examples" else "retrieved"

    @property
    def constraints(self) -> bool:
        """Whether limits are enforced."""
        return self.without != "constraints"

    @property
    def repairs(self) -> int:
        """How often a failing policy goes back."""
        return 0 if self.without == "repair" else REPAIRS

    def applies_to(self, writer: str) -> bool:
        """Whether the condition can make a difference to a writer."""
        if is_baseline(writer):
            return self == DEFAULT or self.without == "constraints"
        return self == DEFAULT or writer != "builtin" or self.without in WITHOUT_MODEL

    def rewrite(self, prompt: Prompt) -> Prompt:
        """The prompt with the ablation applied."""
        if self.without not in ("toolkit", "grounding"):
            return prompt
        toolkit, scene = self.without != "toolkit", self.without != "grounding"
        return replace(prompt, style=replace(prompt.style, examples=self.examples, toolkit=toolkit, scene=scene))


DEFAULT = Condition()


def conditions_from(text: str) -> tuple[Condition, ...]:
    """The default condition and those that an option such as "examples,temperature=0,0.5" names.

    Raises:
        RequestError: If a name is no ablation, or a temperature is out of range.
    """
    found, varied = [DEFAULT], ""
    for part in (p.strip() for p in text.split(",") if p.strip()):
        name, equals, value = part.partition("=")
        varied = name.strip() if equals else varied if _number(part) is not None else ""
        found += [_at(value if equals else part)] if varied == "temperature" else _without(part, varied)
    return tuple(dict.fromkeys(found))


def _without(part: str, varied: str) -> list[Condition]:
    if varied or part not in ABLATIONS:
        known = f"--ablate takes {', '.join(ABLATIONS)} and temperature=0,0.2,..."
        raise RequestError(f"{varied or part!r} cannot be switched off; {known}")
    paper = [Condition(PAPER_EXAMPLES)] if part == "examples" else []
    return [Condition(f"no {part}", without=part), *paper]


def _at(value: str) -> Condition:
    number = _number(value)
    if number is None or not 0.0 <= number <= 2.0:
        raise RequestError(f"the temperature {value!r} is out of range; write --ablate temperature=0,0.2,0.5,0.7")
    return Condition(f"temperature {number:g}", temperature=number)


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


BY_SUBSET = "by-subset"
"""The robot of a sample is told by the words of its subset: drone, ground robot, arm or manipulator."""

_WORDS = {"drone": "drone", "ground": "ground", "manipulator": "arm", "arm": "arm"}

_TOKENS = ("input_tokens", "output_tokens")


@dataclass(frozen=True)
class Protocol:
    """The evaluation protocol shared by all samples and writers of a run.

    Args:
        feedback: How often a failed check's sentence goes back as feedback, at most.
        feedback_on: The trajectory that feedback is about.
        robot: Whose limits are enforced: a preset, a robot file, or "by-subset"; None takes the sample's own.
    """

    feedback: int = 0
    feedback_on: FeedbackOn = "original"
    robot: str | None = None
    isolation: Isolation = "auto"


def evaluate(sample: Sample, writer: Answering, condition: Condition, protocol: Protocol) -> Record:
    """Put a sample to a writer and judge every answer.

    Raises:
        IsolationUnavailable: If this machine cannot provide the requested isolation.
        InputError: If the robot cannot be used.
    """
    task, robot = sample.task, robot_for(sample, protocol.robot)
    idle = sample.check.judge(task.trajectory, task.trajectory, task.scene)
    rounds: list[Round] = []
    talk = _Conversation(sample, robot, protocol.feedback_on)
    said = task.instruction
    for _ in range(protocol.feedback + 1):
        taken, waited = len(writer.replies), writer.waited
        result = _answered(talk.request(said), writer, condition, protocol)
        done = _round(sample, said, result, idle.sentence)
        ms = sum(result.timings_ms.values()) - 1e3 * (writer.waited - waited)
        replies = tuple(writer.replies[taken:])
        tokens = {key: sum(r["reply"]["writer"][key] for r in replies if "reply" in r) for key in _TOKENS}
        match = {key: replies[-1][key] for key in ("matched", "similarity") if replies and key in replies[-1]}
        rounds.append(replace(done, ms=round(max(ms, 0.0), 3), replies=replies, **tokens, **match))
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


def _answered(request: Request, system: Answering, condition: Condition, protocol: Protocol) -> Adaptation:
    constraints = ConstraintOptions(enabled=condition.constraints)
    if is_baseline(system.name):
        assert not isinstance(system, RecordingWriter)
        return adapted_by(system, request, constraints)
    assert not isinstance(system, RecordingBaseline)
    return adapt(
        request,
        writer=system,
        constraints=constraints,
        isolation=protocol.isolation,
        repairs=condition.repairs,
        examples=condition.examples,
        time_limit=None,
    )


def robot_for(sample: Sample, robot: str | None) -> Robot:
    """The robot whose limits apply to a sample."""
    if robot == BY_SUBSET:
        words = f"{sample.subset} {sample.id}".lower()
        return Robot.preset(next((preset for word, preset in _WORDS.items() if word in words), "none"))
    return load_robot(robot or sample.task.robot or "none")


class _Conversation:
    """The conversation on one sample so far, from which the next request is built."""

    def __init__(self, sample: Sample, robot: Robot, on: Literal["original", "current"]) -> None:
        self.sample, self.robot, self.on = sample, robot, on
        self.turns: list[Turn] = []
        self.current: Trajectory | None = None

    def request(self, said: str) -> Request:
        path, scene = self.sample.task.trajectory, self.sample.task.scene
        if self.on == "current" and self.current is not None:
            path = self.current
        else:
            said = ". ".join([*(turn.instruction.strip().rstrip(".") for turn in self.turns), said.strip()])
        return Request(said[:MAX_INSTRUCTION], path, scene, self.robot, tuple(self.turns))

    def record(self, said: str, result: Adaptation) -> None:
        self.turns.append(Turn(said, result.original, feedback_on=self.on, plan=result.plan, code=result.code))
        if result.usable:
            self.current = result.adapted


def _round(sample: Sample, said: str, result: Adaptation, idle: str) -> Round:
    """A result judged; where there is none, the sentence of doing nothing stands."""

    def judged(answer: Trajectory | None, check: Check = sample.check) -> CheckResult:
        if answer is None:
            return CheckResult(False, idle)
        return check.judge(sample.task.trajectory, answer, sample.task.scene)

    answer, waiting = result.adapted if result.usable else None, result.proposal
    clauses = sample.check.children if sample.check.kind == "all_of" else (sample.check,)
    verdict = judged(answer)
    return Round(
        said=said,
        status=result.status,
        passed=verdict.passed,
        score=sum(judged(answer, clause).passed for clause in clauses) / len(clauses),
        sentence=verdict.sentence,
        executable=result.usable,
        attempts=result.attempts,
        ms=0.0,
        limits=result.constraints.status if result.constraints else "none",
        proposed_passed=judged(result.proposed).passed,
        after_yes=judged(waiting.adapted if waiting else None).passed,
        flagged=result.usable and result.writer.kind != KIND and (result.status != "done" or bool(result.cautions)),
        model=result.writer.model,
        plan=(waiting or result).plan,
        code=(waiting or result).code,
        explanation=result.explanation,
        error=result.error or result.question,
        adapted=waypoints(result.adapted),
    )


def waypoints(trajectory: Trajectory) -> Rows:
    """The rows x, y, z, speed of a trajectory, for a record."""
    return tuple(tuple(row) for row in trajectory.to_array().tolist())
