"""The chain, and nothing else: ground, write, run, constrain, verify, report.

    request -> prompt -> reply -> policy -> rollout -> solution -> adaptation

What a model causes, or limits that cannot all hold, is a `status` of the adaptation. Only a caller's mistake raises.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from threading import Event
from typing import Any

from numpy.typing import ArrayLike

from ovita.errors import InputError, PolicyError, PolicyRejected, RequestError, WriterError
from ovita.instruct.editing import by_hand
from ovita.limits import ConstraintOptions, Solution, Verdict, constrain
from ovita.measure import compare, shape_warnings
from ovita.paths.part import WHOLE, PathPart
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.policy import Policy
from ovita.policy.sandbox import Rollout, known_isolation, run
from ovita.request import Adaptable, Request, requested, scene_of
from ovita.result import Adaptation, Postcondition, Status, explain, facts, judged_status
from ovita.text import called_as, number, quoted, sentence, the
from ovita.toolkit import Outcome
from ovita.toolkit.moves import move_goal, move_start
from ovita.writers.base import (
    Attempt,
    ExampleMode,
    PolicyWriter,
    Progress,
    Reply,
    WriterInfo,
    WritingBudget,
    ground,
    writer_named,
)
from ovita.writers.explain import reworded
from ovita.writers.generate import BuiltinWriter, judged, write
from ovita.writers.generate import Isolation as Isolation

RESTORED = 0.3
"""Share of the path that bends when an end is brought back that was to stay."""

REPAIRS = 2
"""How often a failing policy goes back to its writer, at most."""

TIME_LIMIT = 60.0
"""Longest time for writing a policy, all writers and repairs together [s]."""


UNCHANGED = "def adapt(traj, scene):\n    return traj\n"
"""The policy that leaves everything as it is: for hand edits before anything was said."""


@dataclass
class _Clock:
    """Milliseconds by stage."""

    timings: dict[str, float] = field(default_factory=dict)
    started: float = field(default_factory=time.perf_counter)

    def lap(self, stage: str) -> None:
        now = time.perf_counter()
        self.timings[stage] = round(self.timings.get(stage, 0.0) + (now - self.started) * 1e3, 3)
        self.started = now


@called_as('adapt(trajectory, "go left by 0.1", robot="drone")')
def adapt(
    request: Request | Adaptable,
    instruction: str | None = None,
    *,
    scene: Scene | Iterable[SceneObject] | None = None,
    robot: Robot | str | None = None,
    times: ArrayLike | None = None,
    selection: PathPart = WHOLE,
    writer: PolicyWriter | str = "auto",
    constraints: ConstraintOptions | None = None,
    isolation: Isolation = "auto",
    repairs: int = REPAIRS,
    examples: ExampleMode | bool = "retrieved",
    time_limit: float | None = TIME_LIMIT,
    explain_with_model: bool = False,
    progress: Progress | None = None,
    cancel: Event | None = None,
) -> Adaptation:
    """Adapt a trajectory to an instruction.

    Args:
        request: A task, a trajectory, an array (N, 3) [m] or (N, 4) with speeds [m/s], the name of a file; or a whole
            request with instruction, scene, robot and history.
        instruction: What should change; None takes the one of the task, file or request.
        scene: What surrounds the trajectory, or its objects; None takes that of the task or file.
        robot: Whose limits are enforced, or its name or file; None takes the one that the task names, else none.
        times: When the waypoints of an array (N, 3) are reached (N,) [s]; without, it gets a speed of 0.1 m/s.
        selection: The part of the path that "here" and "this part" mean, such as `between("cup", "box")`.
        writer: A policy writer or its name, see `writer_named`.
        constraints: How limits are enforced.
        isolation: How a policy must be isolated while it runs.
        repairs: How often a failing policy goes back to its writer.
        examples: Which examples the prompt shows: "retrieved" ones that are like the instruction, the "paper"'s two, or
            "none"; True is "retrieved", False is "none".
        time_limit: Longest time for writing, all writers and repairs together [s]; None sets no limit.
        explain_with_model: Whether a model that wrote the policy also words the explanation; numbers that are in no
            fact are never let through.
        progress: Called with a short line at every stage, and while a model writes; perhaps from another thread.
        cancel: Once it is set, the adaptation ends soon, with status "failed" and the trajectory unchanged.

    Raises:
        InputError: If the request or an option cannot be used.
        MissingExtra: If the writer's packages are not installed.
        IsolationUnavailable: If this machine cannot provide the requested isolation.
    """
    if repairs < 0 or (time_limit is not None and not 0.0 < time_limit < math.inf):
        raise RequestError("repairs must be 0 or more, and the time limit a positive number of seconds")
    known_isolation(isolation)
    clock = _Clock()
    chosen = _chosen(writer)
    request = requested(request, instruction, scene=scene, robot=robot, times=times, selection=selection)
    budget = WritingBudget.lasting(time_limit, progress, cancel)
    prompt = replace(ground(request, examples=examples), budget=budget)
    clock.lap("ground")
    last = write(prompt, chosen, isolation=isolation, repairs=repairs, lap=clock.lap)
    if budget.cancelled:
        last = replace(last, policy=None, error="stopped on request; the trajectory is unchanged")
    if last.policy is None:
        return _declined(request, last, clock)
    budget.say("enforcing the limits")
    result = _finish(request, last, constraints, clock)
    if last.reply.confirm:
        return to_confirm(result, last.reply.unplaced, last.reply.doubts)
    if explain_with_model and last.by is not None:
        result = _explained_by_model(result, last.by, budget, clock)
    return result


@called_as('batch(files, "go left by 0.1")')
def batch(
    tasks: Iterable[Request | Adaptable],
    instructions: str | Sequence[str] | None = None,
    *,
    scene: Scene | Iterable[SceneObject] | None = None,
    robot: Robot | str | None = None,
    writer: PolicyWriter | str = "auto",
    workers: int = 1,
    **options: Any,
) -> list[Adaptation]:
    """Adapt many trajectories, in their order; every one is looked at before the first is adapted.

    Args:
        tasks: What `adapt` takes: tasks, trajectories, arrays, names of files.
        instructions: One for all, one for each, or None for those of the tasks.
        scene: Of all; None takes that of each task.
        robot: Of all; None takes the one that each task names.
        writer: A policy writer or its name.
        workers: How many are adapted at a time; more than 1 helps where a model writes.
        options: Of `adapt`.

    Raises:
        InputError: If a task or an option cannot be used; names the task's number, from 0.
    """
    if isinstance(tasks, str) or not isinstance(tasks, Iterable):
        raise RequestError("batch takes a list of tasks, trajectories, arrays or names of files")
    if not isinstance(workers, int) or workers < 1:
        raise RequestError("workers must be a whole number of 1 or more")
    items = list(tasks)
    said = [instructions] * len(items) if instructions is None or isinstance(instructions, str) else [*instructions]
    if len(said) != len(items):
        raise RequestError(f"there are {len(items)} tasks but {len(said)} instructions; give one, or one for each")
    surroundings, requests = None if scene is None else scene_of(scene), []
    for i, (about, instruction) in enumerate(zip(items, said, strict=True)):
        try:
            requests.append(requested(about, instruction, scene=surroundings, robot=robot))
        except InputError as error:
            raise RequestError(f"task {i}: {error}") from None
    chosen = _chosen(writer)

    def one(request: Request) -> Adaptation:
        return adapt(request, writer=chosen, **options)

    if workers == 1:
        return [one(request) for request in requests]
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(one, requests))


def _chosen(writer: PolicyWriter | str) -> PolicyWriter:
    if isinstance(writer, str):
        return writer_named(writer)
    if not isinstance(writer, PolicyWriter):
        raise RequestError(f"a writer is a name such as 'builtin', or has a name and write(prompt); {writer!r} has not")
    return writer


@called_as('rerun(result, {"left": 0.2})')
def rerun(
    adaptation: Adaptation,
    parameters: Mapping[str, Any],
    *,
    constraints: ConstraintOptions | None = None,
    isolation: Isolation = "auto",
) -> Adaptation:
    """Run an adaptation's policy again with other parameters, without calling a writer.

    Args:
        adaptation: With a policy.
        parameters: New values by name; the others stay.
        constraints: How limits are enforced; None takes the adaptation's own options.
        isolation: How the policy must be isolated while it runs.

    Raises:
        PolicyError: If the adaptation has no policy, a parameter does not exist, or the policy fails with it.
    """
    known_isolation(isolation)
    if not isinstance(adaptation, Adaptation) or not isinstance(parameters, Mapping):
        raise RequestError("rerun takes an adaptation and its new values by name, such as rerun(result, {'up': 0.2})")
    clock = _Clock()
    before = {p.name: p.value for p in adaptation.parameters}
    policy = _turned(adaptation, parameters, before)
    request = Request(adaptation.instruction, adaptation.original, adaptation.scene, adaptation.robot)
    try:
        rollout = run(policy, request.trajectory, request.scene, isolation=isolation)
    except PolicyError as refusal:
        if not parameters or adaptation.writer.kind != "builtin":
            raise
        turned = ", ".join(f"{name} = {value}" for name, value in parameters.items())
        raise PolicyRejected(f"{turned} cannot be used: {refusal.reason}") from None
    clock.lap("run")
    reply = Reply(
        "policy",
        plan=(*adaptation.plan, *(f"Turned {n} from {before[n]} to {v}." for n, v in parameters.items())),
        code=policy.source,
        assumptions=adaptation.assumptions,
        contacts=adaptation.contacts,
        writer=adaptation.writer,
        frames=by_hand(adaptation.frames, adaptation.parameters, parameters),
    )
    outcomes = judged(request, rollout, rollout.trajectory.to_array())
    attempt = Attempt(reply, policy, rollout, outcomes, count=adaptation.attempts)
    return _finish(request, attempt, constraints or adaptation.options, clock)


def _turned(adaptation: Adaptation, values: Mapping[str, Any], before: Mapping[str, Any]) -> Policy:
    """The adaptation's policy with other values of its parameters."""
    from ovita.policy.reading import parse

    unknown = [name for name in values if name not in before]
    if unknown:
        raise PolicyRejected(f"there is no parameter {unknown[0]!r}; there are {', '.join(before) or 'none'}")
    return parse(adaptation.code).described_by(adaptation.parameters).with_parameters(**values)


def enforced(
    said: str,
    trajectory: Trajectory,
    scene: Scene,
    robot: Robot,
    *,
    constraints: ConstraintOptions,
    original: Trajectory | None = None,
) -> Adaptation:
    """Enforce the limits on a trajectory that was made without a policy, such as by hand; its policy changes nothing.

    Changes are measured from `original`, or from the trajectory itself; `said` is recorded as the instruction.
    """
    request = Request(said, original or trajectory, scene, robot)
    made = Attempt(Reply("policy", writer=WriterInfo("none")), Policy(UNCHANGED), Rollout(trajectory))
    return _finish(request, made, constraints, _Clock(), by_hand=True)


def _declined(request: Request, last: Attempt, clock: _Clock) -> Adaptation:
    """The adaptation if no policy ran: the trajectory is unchanged."""
    reply, error = last.reply, last.error
    kinds: dict[str, Status] = {"question": "needs_clarification", "answer": "answered"}
    status: Status = "failed" if error else kinds.get(reply.kind, "not_understood")
    if status == "not_understood":
        error = _not_understood(reply, request)
    return Adaptation(
        instruction=request.instruction,
        status=status,
        original=request.trajectory,
        adapted=request.trajectory,
        scene=request.scene,
        robot=request.robot,
        plan=reply.plan,
        code=reply.code,
        assumptions=(*request.assumed, *reply.assumptions),
        explanation=reply.question or reply.answer or error,
        writer=reply.writer,
        attempts=last.count,
        question=reply.question,
        unplaced=reply.unplaced,
        error=error,
        timings_ms=clock.timings,
    )


def to_confirm(result: Adaptation, unplaced: tuple[str, ...] = (), doubts: tuple[str, ...] = ()) -> Adaptation:
    """A result that a person has to agree to: the trajectory stays, and the result waits as the proposal.

    Nothing is done about the words in `unplaced`; `doubts` are sentences that speak against it.
    """
    unused = (f"Nothing is done about {quoted(unplaced)}.",) if unplaced else ()
    waiting = Adaptation(
        instruction=result.instruction,
        status="needs_confirmation",
        original=result.original,
        adapted=result.original,
        scene=result.scene,
        robot=result.robot,
        options=result.options,
        unplaced=unplaced,
        proposal=replace(result, assumptions=(*result.assumptions, *unused)),
        writer=result.writer,
        attempts=result.attempts,
        warnings=doubts,
        timings_ms=result.timings_ms,
    )
    return replace(waiting, explanation=waiting.message)


def another(refused: Sequence[Adaptation], *, isolation: Isolation = "auto") -> Adaptation | None:
    """Another reading of an instruction whose proposals were refused, to be agreed to; None if there is none.

    Only the built-in writer knows others.

    Args:
        refused: Results with a proposal each, of the same instruction and trajectory, the first one first.
        isolation: How a policy must be isolated while it runs.
    """
    first = refused[0]
    frames = tuple(one.proposal.frames for one in refused if one.proposal is not None)
    if not all(frames) or first.writer.kind != "builtin":
        return None
    request = Request(first.instruction, first.original, first.scene, first.robot)
    result = adapt(request, writer=BuiltinWriter(refused=frames), constraints=first.options, isolation=isolation)
    if result.proposal is None:
        return None
    return replace(result, explanation=f"Then perhaps otherwise. {result.message}")


_A_MODEL = "; a language model understands more: 'ovita models' gets a local one, --writer or OVITA_MODEL names one"


def _not_understood(reply: Reply, request: Request) -> str:
    names, tried = request.scene.names, reply.writer.tried
    near, more = "in the second half", "make the path smoother"
    if names:
        near, more = f"near {the(names[0])}", f"keep at least 0.2 from {the(names[-1])}"
    hint = f"Try 'go left by 0.2', 'slow down {near}' or '{more}'"
    hint += _A_MODEL if reply.writer.kind == "builtin" and len(tried) < 2 else ""
    others = "".join(f" Also asked: {said.rstrip('.')}." for said in tried[1:])
    why = " ".join(map(sentence, reply.doubts)) or f"I could not place {_unplaced(reply, names)}"
    return f"{why} The scene's objects are: {quoted(names) or 'none'}. {hint}.{others}"


def _unplaced(reply: Reply, names: Sequence[str]) -> str:
    strange = [word for word in reply.unplaced if word not in names]
    known = f"what to do with {quoted(reply.unplaced)}" if reply.unplaced else "the instruction"
    return f"{quoted(strange) or known}; the trajectory is unchanged."


def _finish(
    request: Request, attempt: Attempt, constraints: ConstraintOptions | None, clock: _Clock, by_hand: bool = False
) -> Adaptation:
    """Phases three and four: constrain, verify, measure, explain."""
    reply, policy = attempt.reply, attempt.policy
    assert policy is not None and attempt.rollout is not None, "a policy that ran"
    rollout, before, restored = _with_ends_restored(request, attempt.rollout, attempt.outcomes)
    contacts = _contacts(request, rollout, reply)
    options = constraints or ConstraintOptions()
    solution = _enforced(request, rollout, before, contacts, options)
    clock.lap("constrain")
    verdict, adapted = solution.verdict, solution.trajectory
    changes = compare(request.trajectory, adapted, request.scene)
    after = before if adapted is rollout.trajectory else judged(request, rollout, adapted.to_array())
    postconditions = tuple(
        Postcondition(e.text, b.held, a.held, a.sentence, b.change, a.change, a.unit, e.kind, e.arguments)
        for e, b, a in zip(rollout.expectations, before, after, strict=True)
    )
    idle = changes.path_unchanged and changes.speeds_unchanged and not by_hand
    done = _nothing_to_do(reply, postconditions) if idle else ""
    stalls = adapted.stall is not None and request.trajectory.stall is None
    warnings = _warnings(verdict, postconditions, adapted) + restored
    warnings += [] if rollout.corners else shape_warnings(changes)
    if idle:
        warnings.append(done or "Nothing changed: the trajectory is the same as before.")
    result = Adaptation(
        instruction=request.instruction,
        status=judged_status(verdict, postconditions, vain=stalls or (idle and not done)),
        original=request.trajectory,
        adapted=adapted,
        proposed=rollout.trajectory,
        scene=request.scene,
        robot=request.robot,
        options=options,
        frames=reply.frames,
        plan=reply.plan,
        code=policy.source,
        parameters=policy.parameters,
        assumptions=(*request.assumed, *reply.assumptions),
        changes=changes,
        constraints=verdict,
        postconditions=postconditions,
        contacts=contacts,
        writer=reply.writer,
        attempts=attempt.count,
        isolation=rollout.isolation,
        warnings=tuple(warnings),
        timings_ms=clock.timings,
    )
    result = replace(result, explanation=explain(result))
    clock.lap("report")
    return replace(result, timings_ms=dict(clock.timings))


def _contacts(request: Request, rollout: Rollout, reply: Reply) -> tuple[str, ...]:
    """The objects that are meant to be touched, by this turn or an earlier one."""
    meant = [*reply.contacts, *(name for turn in request.history for name in turn.contacts)]
    named = [request.scene[name].name for name in meant if name in request.scene]
    return tuple(dict.fromkeys([*rollout.contacts, *named]))


_ENDS = {"start": (0, move_start), "goal": (-1, move_goal)}


def _with_ends_restored(
    request: Request, rollout: Rollout, outcomes: Sequence[Outcome]
) -> tuple[Rollout, Sequence[Outcome], list[str]]:
    """The rollout with the ends brought back that were to stay but that the policy moved, and what to say of it."""
    rows = rollout.trajectory.to_array()
    said: list[str] = []
    for expectation, outcome in zip(rollout.expectations, outcomes, strict=True):
        if expectation.kind in _ENDS and not expectation.arguments and not outcome.held:
            end, bring = _ENDS[expectation.kind]
            place = request.trajectory.positions[end]
            away = number(math.dist(rows[end, :3], place))
            rows = bring(rows, place, blend=RESTORED)
            what = f"The {expectation.kind} is to stay, but the policy had moved it by {away} m"
            said.append(f"{what}: it was brought back.")
    if not said:
        return rollout, outcomes, []
    restored = replace(rollout, trajectory=rollout.trajectory.with_(positions=rows[:, :3]))
    return restored, judged(request, restored, restored.trajectory.to_array()), said


def _enforced(
    request: Request,
    rollout: Rollout,
    outcomes: Sequence[Outcome],
    contacts: tuple[str, ...],
    options: ConstraintOptions,
) -> Solution:
    """The rollout within the limits; ends that the policy promises to keep stay, if they can."""
    enforce = partial(
        constrain, rollout.trajectory, request.scene, request.robot, original=request.trajectory, contacts=contacts
    )
    pairs = zip(rollout.expectations, outcomes, strict=True)
    kept = {e.kind for e, outcome in pairs if outcome.held and not e.arguments}
    start, goal = options.fix_start or "start" in kept, options.fix_goal or "goal" in kept
    pinned = replace(options, fix_start=start, fix_goal=goal)
    solution = enforce(options=pinned)
    if pinned != options and solution.verdict.status == "infeasible":
        return enforce(options=options)  # what is to stay cannot; the postcondition says by how much it moved
    return solution


def _nothing_to_do(reply: Reply, postconditions: Sequence[Postcondition]) -> str:
    """Why a result that equals the original is what was asked for, or "" if it is not."""
    held = [*(p.outcome for p in postconditions if p.held and p.states), *(text.rstrip(".") for text in reply.holds)]
    kept = all(p.held for p in postconditions)
    return f"Nothing had to change: {'; '.join(held)}." if held and kept else ""


def _warnings(verdict: Verdict, postconditions: Sequence[Postcondition], adapted: Trajectory) -> list[str]:
    """What a person should look at in a result, each as a sentence."""
    broken = [p for p in postconditions if not p.held]
    warnings = [f"{'Changed by the limits' if p.held_before else 'Not as meant'}: {p.outcome}" for p in broken]
    if verdict.status != "satisfied":
        warnings += [*verdict.sentences(), *(text for p in postconditions for text in p.sentences())]
    if adapted.stall is not None:
        where = adapted.stall + 1
        warnings.append(f"From waypoint {where} on the path goes on at speed 0; a robot would stand still there.")
    return warnings


def _explained_by_model(result: Adaptation, writer: PolicyWriter, budget: WritingBudget, clock: _Clock) -> Adaptation:
    """Have the model write the explanation; the template's remains if it cannot."""
    budget.say("explaining")
    try:
        text = reworded(writer, {topic: "\n".join(lines) for topic, lines in facts(result).items()}, budget=budget)
    except WriterError:
        return result
    finally:
        clock.lap("explain")
    return replace(result, explanation=text, timings_ms=clock.timings)
