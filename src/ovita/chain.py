"""The chain, and nothing else: ground, write, run, constrain, verify, report.

    request -> prompt -> reply -> policy -> rollout -> solution -> adaptation

What a model causes, or limits that cannot all hold, is a `status` of the adaptation. Only a caller's mistake raises.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from ovita.adaptation import Adaptation, Postcondition, Status
from ovita.changes import measure, sentences
from ovita.constraints import ConstraintOptions, constrain
from ovita.errors import PolicyError, PolicyRejected, WriterError
from ovita.language.explain import Facts, explain
from ovita.language.grounding import ground
from ovita.language.request import Prompt, Reply, Request, WriterInfo
from ovita.language.writer import PolicyWriter, writer_named
from ovita.policy import Policy
from ovita.policy.sandbox import Rollout, run
from ovita.policy.source import parse
from ovita.toolkit import Outcome, judge
from ovita.trajectory import Trajectory

REPAIRS = 2
"""How often a failing policy goes back to its writer, at most."""

Isolation = Literal["strict", "degraded"]


@dataclass
class _Clock:
    """Milliseconds by stage."""

    timings: dict[str, float] = field(default_factory=dict)
    started: float = field(default_factory=time.perf_counter)

    def lap(self, stage: str) -> None:
        now = time.perf_counter()
        self.timings[stage] = round(self.timings.get(stage, 0.0) + (now - self.started) * 1e3, 3)
        self.started = now


@dataclass(frozen=True)
class _Written:
    """Phase two, done: the last reply, and the policy with its rollout if one ran."""

    reply: Reply
    policy: Policy | None
    rollout: Rollout | None
    attempts: int
    error: str


def adapt(
    request: Request,
    *,
    writer: PolicyWriter | str = "auto",
    constraints: ConstraintOptions | None = None,
    isolation: Isolation = "strict",
    repairs: int = REPAIRS,
    examples: bool = True,
) -> Adaptation:
    """Adapt a trajectory to an instruction.

    Args:
        request: Instruction, trajectory, scene, robot and history.
        writer: A policy writer or its name, see `writer_named`.
        constraints: How limits are enforced.
        isolation: How a policy must be isolated while it runs.
        repairs: How often a failing policy goes back to its writer.
        examples: Whether the prompt shows the two examples of the answer format.

    Raises:
        InputError: If the request or an option cannot be used.
        MissingExtra: If the writer's packages are not installed.
        IsolationUnavailable: If this machine cannot isolate a policy as asked.
    """
    clock = _Clock()
    chosen = writer_named(writer) if isinstance(writer, str) else writer
    prompt = ground(request, examples=examples)
    clock.lap("ground")
    written = _write(prompt, chosen, isolation, repairs, clock)
    if written.policy is None or written.rollout is None:
        return _declined(request, written, clock)
    result = _finish(request, written.policy, written.rollout, written.reply, constraints, clock)
    result = replace(result, attempts=written.attempts)
    if result.writer.kind == "llm":
        result = _explained_by_model(result, chosen, clock)
    return result


def rerun(
    adaptation: Adaptation,
    parameters: Mapping[str, Any],
    *,
    constraints: ConstraintOptions | None = None,
    isolation: Isolation = "strict",
) -> Adaptation:
    """Run an adaptation's policy again with other parameters; no writer is asked.

    Args:
        adaptation: With a policy.
        parameters: New values by name; the others stay.
        constraints: How limits are enforced; give those of the first run again where they were not the default.
        isolation: How the policy must be isolated while it runs.

    Raises:
        PolicyError: If the adaptation has no policy, a parameter does not exist, or the policy fails with it.
    """
    clock = _Clock()
    before = {p.name: p.value for p in adaptation.parameters}
    unknown = [name for name in parameters if name not in before]
    if unknown:
        raise PolicyRejected(f"there is no parameter {unknown[0]!r}; there are {', '.join(before) or 'none'}")
    policy = parse(adaptation.code).with_parameters(**parameters)
    request = Request(adaptation.instruction, adaptation.original, adaptation.scene, adaptation.robot)
    rollout = run(policy, request.trajectory, request.scene, isolation=isolation)
    clock.lap("run")
    reply = Reply(
        "policy",
        plan=(*adaptation.plan, *(f"Turned {n} from {before[n]} to {v}." for n, v in parameters.items())),
        code=policy.source,
        assumptions=adaptation.assumptions,
        contacts=adaptation.contacts,
        writer=adaptation.writer,
    )
    return replace(_finish(request, policy, rollout, reply, constraints, clock), attempts=adaptation.attempts)


def _write(prompt: Prompt, writer: PolicyWriter, isolation: Isolation, repairs: int, clock: _Clock) -> _Written:
    """Phase two: ask for a policy, run it, and show a failing one back to its writer."""
    reply = Reply("not_understood", writer=WriterInfo(writer.name))
    best: tuple[Reply, Policy, Rollout] | None = None
    error, tokens_in, tokens_out, attempts = "", 0, 0, 0
    for attempts in range(1, repairs + 2):
        try:
            answer = writer.write(prompt)
        except WriterError as failure:
            error = str(failure)
            clock.lap("write")
            break
        clock.lap("write")
        tokens_in += answer.writer.input_tokens
        tokens_out += answer.writer.output_tokens
        counted = replace(answer.writer, input_tokens=tokens_in, output_tokens=tokens_out)
        if answer.kind != "policy" and (best or prompt.attempts):
            break
        reply = replace(answer, writer=counted)
        if answer.kind != "policy":
            return _Written(reply, None, None, attempts, "")
        policy: Policy | None = None
        try:
            policy = parse(answer.code)
            rollout = run(policy, prompt.request.trajectory, prompt.request.scene, isolation=isolation)
        except PolicyError as failure:
            error = str(failure)
            clock.lap("run")
            prompt = prompt.repaired(policy.source if policy else answer.code, error)
            continue
        clock.lap("run")
        best = (reply, policy, rollout)
        broken = _broken_promises(prompt.request, rollout)
        if not broken:
            return _Written(reply, policy, rollout, attempts, "")
        error = "it ran, but does not do what it promises: " + "; ".join(broken)
        prompt = prompt.repaired(policy.source, error)
    if best is not None:
        reply, policy, rollout = best
        return _Written(reply, policy, rollout, attempts, "")
    return _Written(reply, None, None, attempts, error)


def _broken_promises(request: Request, rollout: Rollout) -> list[str]:
    return [o.sentence for o in _judged(request, rollout, rollout.trajectory.to_array()) if not o.held]


def _judged(request: Request, rollout: Rollout, result: object) -> list[Outcome]:
    original = request.trajectory.to_array()
    return [judge(e, original, result, request.scene) for e in rollout.expectations]  # type: ignore[arg-type]


def _declined(request: Request, written: _Written, clock: _Clock) -> Adaptation:
    """The adaptation where no policy could be run: the trajectory stays as it was."""
    reply = written.reply
    status: Status = "failed"
    error = written.error
    if not error and reply.kind == "question":
        status = "needs_clarification"
    elif not error:
        status, error = "not_understood", _not_understood(reply, request)
    return Adaptation(
        instruction=request.instruction,
        status=status,
        original=request.trajectory,
        adapted=request.trajectory,
        scene=request.scene,
        robot=request.robot,
        plan=reply.plan,
        code=reply.code,
        assumptions=reply.assumptions,
        explanation=reply.question or error,
        writer=reply.writer,
        attempts=written.attempts,
        question=reply.question,
        unplaced=reply.unplaced,
        error=error,
        timings_ms=clock.timings,
    )


def _not_understood(reply: Reply, request: Request) -> str:
    words = ", ".join(repr(word) for word in reply.unplaced) or "the instruction"
    known = ", ".join(repr(name) for name in request.scene.names) or "none"
    return f"I could not place {words}; the trajectory is unchanged. The scene's objects are: {known}."


def _finish(
    request: Request,
    policy: Policy,
    rollout: Rollout,
    reply: Reply,
    constraints: ConstraintOptions | None,
    clock: _Clock,
) -> Adaptation:
    """Phases three and four: constrain, verify, measure, explain."""
    named = [request.scene[name].name for name in reply.contacts if name in request.scene]
    contacts = tuple(dict.fromkeys([*rollout.contacts, *named]))
    solution = constrain(
        rollout.trajectory,
        request.scene,
        request.robot,
        original=request.trajectory,
        contacts=contacts,
        options=constraints or ConstraintOptions(),
    )
    clock.lap("constrain")
    verdict, adapted = solution.verdict, solution.trajectory
    changes = measure(request.trajectory, adapted, request.scene)
    before = _judged(request, rollout, rollout.trajectory.to_array())
    after = _judged(request, rollout, adapted.to_array())
    postconditions = tuple(
        Postcondition(e.text, b.held, a.held, a.sentence)
        for e, b, a in zip(rollout.expectations, before, after, strict=True)
    )
    broken = [p.outcome for p in postconditions if not p.held]
    warnings = [f"Not as meant: {text}" for text in broken]
    if verdict.status != "satisfied":
        warnings += verdict.sentences()
    stuck = _standing(adapted)
    if stuck is not None:
        warnings.append(f"From waypoint {stuck} on the path goes on at speed 0; a robot would stand still there.")
    if changes.path_unchanged and changes.speeds_unchanged:
        warnings.append("Nothing changed: the trajectory is the same as before.")
    result = Adaptation(
        instruction=request.instruction,
        status="infeasible" if verdict.status == "infeasible" else "ok",
        original=request.trajectory,
        adapted=adapted,
        proposed=rollout.trajectory,
        scene=request.scene,
        robot=request.robot,
        plan=reply.plan,
        code=policy.source,
        parameters=policy.parameters,
        assumptions=reply.assumptions,
        changes=changes,
        constraints=verdict,
        postconditions=postconditions,
        contacts=contacts,
        writer=reply.writer,
        isolation=rollout.isolation,
        warnings=tuple(warnings),
        timings_ms=clock.timings,
    )
    result = replace(result, explanation=explain(_facts(result)))
    clock.lap("report")
    return replace(result, timings_ms=dict(clock.timings))


def _facts(result: Adaptation) -> Facts:
    """What an explanation may say."""
    return Facts(
        result.instruction,
        result.plan,
        result.parameters,
        sentences(result.changes) if result.changes else (),
        result.constraints.sentences() if result.constraints else (),
        [p.outcome for p in result.postconditions if not p.held],
        result.assumptions,
    )


def _standing(trajectory: Trajectory) -> int | None:
    """The first waypoint from which the path goes on without any speed, or None."""
    moves = np.diff(trajectory.arc_length) > 0
    stuck = moves & (trajectory.speeds[:-1] == 0) & (trajectory.speeds[1:] == 0)
    return int(np.argmax(stuck)) if stuck.any() else None


def _explained_by_model(result: Adaptation, writer: PolicyWriter, clock: _Clock) -> Adaptation:
    """Let the model explain in its own words; the template's explanation stays where it cannot."""
    from ovita.language.llm import explain as explain_by_model

    try:
        text = explain_by_model(writer, _facts(result).as_text())
    except WriterError:
        return result
    finally:
        clock.lap("explain")
    return replace(result, explanation=text, timings_ms=clock.timings)
