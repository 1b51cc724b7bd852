"""Phase two: try the writers in order, run their policies, and send failures back for repair; and the built-in writer.

    writer 1 -> policy -> run -> judge -> repair ... -> writer 2 -> ... -> the best of what there is

The built-in writer needs no key and no network: a reader and a referee (`instruct.understanding`), and policies from
the frames.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from ovita.errors import OvitaError, PolicyError, UnusableReply, WriterError
from ovita.instruct.frames import Reading, SemanticFrame, with_selection
from ovita.instruct.numerals import ambiguous
from ovita.measure import account, compare, sentences
from ovita.paths.trajectory import Array
from ovita.policy import Policy
from ovita.policy.sandbox import Isolation as Isolation
from ovita.policy.sandbox import Rollout, run
from ovita.request import Request
from ovita.text import listed, quoted, sentence
from ovita.toolkit import Outcome, judge
from ovita.writers.base import (
    Attempt,
    Failure,
    PolicyWriter,
    Prompt,
    Rank,
    Reply,
    WriterInfo,
    broken_promise,
    flatten,
    with_hint,
)

Lap = Callable[[str], None]
"""Books the time since the last call on a stage: "write" or "run"."""


def write(prompt: Prompt, writer: PolicyWriter, *, isolation: Isolation, repairs: int, lap: Lap) -> Attempt:
    """Try the writers in order until a policy meets its postconditions or a writer asks a question.

    Returns:
        The best result, with every writer tried in `reply.writer.tried`.
    """
    line = flatten(writer)
    done: list[Attempt] = []
    tried: list[str] = []
    for member in line:
        one = replace(_ask(prompt, member, isolation, repairs, lap), by=member)
        done.append(one)
        tried.append(f"{member.name}: {one.summary}")
        if one.rank in (Rank.QUESTION, Rank.AS_MEANT) or prompt.budget.over():
            break
        if len(done) < len(line):
            prompt = with_hint(prompt, one.reply)
    # A policy that promises nothing is no better than one that tried and broke a promise, so the earlier one stays.
    best = max(done, key=lambda one: one.rank if _promises(one) else min(one.rank, Rank.BROKEN))
    if best.rank == Rank.FAILED and len(line) > 1:
        best = replace(best, error=" ".join(f"{said.rstrip('.')}." for said in tried))
    info = replace(best.reply.writer, tried=tuple(tried))
    return replace(best, reply=replace(best.reply, writer=info), count=sum(one.count for one in done))


def _promises(attempt: Attempt) -> bool:
    return attempt.rollout is not None and bool(attempt.rollout.expectations)


def judged(request: Request, rollout: Rollout, result: Array) -> tuple[Outcome, ...]:
    """Judge a rollout's postconditions on a trajectory, (M, 4) array, in their order."""
    original = request.trajectory.to_array()
    return tuple(judge(promise, original, result, request.scene) for promise in rollout.expectations)


def _ask(prompt: Prompt, writer: PolicyWriter, isolation: Isolation, repairs: int, lap: Lap) -> Attempt:
    """Ask one writer, and return failures to it until its policy is right or the repairs are used up."""
    nothing = Reply("not_understood", writer=WriterInfo(writer.name))
    last = Attempt(nothing, failure="unusable", error="it was not asked")
    tokens_in = tokens_out = 0
    for count in range(1, repairs + 2):
        over = prompt.budget.over()
        if over:
            return last if last.policy else replace(last, error=over if count == 1 else f"{over}; {last.error}")
        prompt.budget.say(f"{writer.name} writes a policy" if count == 1 else f"{writer.name} repairs its policy")
        try:
            answer = writer.write(prompt)
        except UnusableReply as failure:
            last = last if last.policy else replace(last, count=count, error=str(failure))
            advice = f"{failure} (answer in the form that is asked for, and more briefly)"
            prompt = prompt.repaired("", advice, "unusable")
            continue
        except WriterError as failure:
            return replace(last, count=count, error=last.error if last.policy else str(failure))
        finally:
            lap("write")
        tokens_in += answer.writer.input_tokens
        tokens_out += answer.writer.output_tokens
        counted = replace(answer, writer=replace(answer.writer, input_tokens=tokens_in, output_tokens=tokens_out))
        if answer.kind != "policy":
            repairing = any(attempt.code for attempt in prompt.attempts)
            return replace(last, count=count) if repairing else Attempt(counted, count=count)
        prompt.budget.say("running the policy")
        now = _run(prompt.request, counted, isolation)
        lap("run")
        last = replace(now if now.policy or not last.policy else last, count=count)
        if not now.failure or any(attempt.error == now.error and now.policy for attempt in prompt.attempts):
            break
        prompt = prompt.after(now)
    return last


def _run(request: Request, reply: Reply, isolation: Isolation) -> Attempt:
    """Check a policy and run it; the error says what must become better."""
    try:
        policy = reply.policy
        if policy is None:
            from ovita.policy.reading import parse

            policy = parse(reply.code)
        rollout = run(policy, request.trajectory, request.scene, isolation=isolation)
    except PolicyError as refusal:
        return Attempt(reply, failure="failed", error=_said(reply, refusal))
    outcomes = judged(request, rollout, rollout.trajectory.to_array())
    failure: Failure = ""
    error = ""
    if not outcomes and rollout.trajectory == request.trajectory:
        failure = "idle"
        error = "it ran, but changed nothing; if nothing is to change, promise it with expect_same_path()"
    elif not all(outcome.held for outcome in outcomes):
        failure, error = "broken", _broken(request, rollout, outcomes)
    left = ", ".join(unused(request.instruction, policy.source)) if reply.writer.kind == "llm" else ""
    if left:
        hint = f"the instruction says {left}, which is nowhere in it; use it, converted to SI units"
        failure, error = failure or "unused", f"{error}\n- {hint}" if error else f"it ran, but {hint}"
        assumed = f"What the instruction says of {left} is meant by other numbers of the policy."
        reply = replace(reply, assumptions=(*reply.assumptions, assumed))
    return Attempt(reply, policy, rollout, outcomes, failure, error)


def _said(reply: Reply, refusal: PolicyError) -> str:
    """Why a policy failed: in terms of its source for a model, in terms of its plan for a person."""
    if reply.writer.kind != "builtin":
        return str(refusal)
    plan = quoted([step.rstrip(".") for step in reply.plan])
    return f"what was understood ({plan}) cannot be done: {refusal.reason}; give another amount or place"


def _broken(request: Request, rollout: Rollout, outcomes: Sequence[Outcome]) -> str:
    """The postconditions with their measurements, and the measured changes."""
    stated = zip(rollout.expectations, outcomes, strict=True)
    lines = [f"- {broken_promise(promise.text, outcome)}" for promise, outcome in stated]
    changes = sentences(compare(request.trajectory, rollout.trajectory, request.scene))
    lines += [f"- measured change: {said}" for said in changes]
    return "\n".join(["it ran, but does not do what it promises:", *lines])


_NUMBER = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?|\.\d+)")
_SCALES = (1.0, 0.01, 0.001, 0.3048, 0.0254, 1 / 3.6, math.pi / 180)
"""What a number may be multiplied by: cm and %, mm, feet, inches, km/h, degrees."""


def unused(instruction: str, code: str) -> tuple[str, ...]:
    """Return the numbers of an instruction that do not occur in a policy in any unit, as they are written.

    0 and 1 are left out, since they are so often no amounts; so are numbers in words.
    """
    used = {float(number) for number in _NUMBER.findall(code)}
    said = dict.fromkeys(_NUMBER.findall(instruction))
    return tuple(number for number in said if float(number) > 1e-9 and float(number) != 1.0 and not _in(number, used))


def _in(number: str, used: set[float]) -> bool:
    """Whether a policy uses a number that was said.

    It counts as used where one of the policy's numbers is the same in another unit (30 cm as 0.3), its inverse (a third
    as 1 / 3), 1 more or less that share (20 % faster as 1.2), or the index that it stands for (waypoint 5 as 4).
    """
    n = float(number)
    meant = [n * scale for scale in _SCALES]
    meant += [1 / n, 1 + n / 100, 1 - n / 100, 1 + n, 1 - n, n - 1]
    return any(math.isclose(abs(value), other, rel_tol=0.01, abs_tol=1e-6) for value in meant for other in used)


@dataclass(frozen=True)
class BuiltinWriter:
    """Writes policies for what its reader understands, and says which words it could not place.

    The referee (`instruct.referee`) decides over what the learned reader makes of an instruction: done at once, shown
    for a yes, asked back, or declined.

    Args:
        refused: The frames of readings that a person did not mean; then another one is shown for a yes.
    """

    name: str = "builtin"
    refused: tuple[tuple[SemanticFrame, ...], ...] = ()

    def write(self, prompt: Prompt) -> Reply:
        """Answer with a policy, a question, or the words that could not be placed.

        A policy that ran but did too little is written again with more effort; one that failed would fail again, so
        then it declines.
        """
        request, effort = prompt.request, 1 + len(prompt.attempts)
        if any(attempt.failure != "broken" for attempt in prompt.attempts):
            return _declined((request.instruction,))
        question = ambiguous(request.instruction)
        if question:
            return Reply("question", question=question, writer=WriterInfo("builtin"))
        return _decided(request, effort, self.refused)


def _decided(request: Request, effort: int, refused: tuple[tuple[SemanticFrame, ...], ...]) -> Reply:
    """What the referee's verdict on the instruction comes to."""
    from ovita.instruct.understanding import otherwise, understand

    if refused:
        verdict = otherwise(request.instruction, request.scene, request.trajectory, refused)
    else:
        verdict = understand(request.instruction, request.scene, request.trajectory)
    if request.selection:
        marked = replace(verdict.reading, frames=with_selection(verdict.reading.frames, request.selection))
        verdict = replace(verdict, reading=marked)
    if verdict.outcome == "ask":
        return _asked(verdict.reading, verdict.unused, request)
    if verdict.outcome == "decline" and verdict.reading.asks:
        return Reply("answer", answer=_answer(request), writer=WriterInfo("builtin"))
    against = bool(verdict.reading.improper)  # what contradicts itself may be asked about
    reply = _of(verdict.reading, request, effort) if verdict.outcome != "decline" or against else None
    if reply is None or (against and not reply.question):
        return _declined(verdict.unused or (request.instruction,), verdict.reading.improper)
    if reply.kind != "policy":
        return reply
    if verdict.outcome == "do":
        unused = (
            (f"{quoted(verdict.unused)} {'is' if len(verdict.unused) == 1 else 'are'} not used",)
            if verdict.unused
            else ()
        )
        return replace(reply, assumptions=(*reply.assumptions, *unused, *verdict.doubts))
    return replace(reply, confirm=True, unplaced=verdict.unused, doubts=verdict.doubts)


def _answer(request: Request) -> str:
    """What a path is like, which somebody asked about, near the objects that they named."""
    from ovita.instruct.sketch import sketch

    mentions = sketch(request.instruction, request.scene, request.trajectory.positions).mentions
    named = [name for mention in mentions for name in mention.items]
    return " ".join(account(request.trajectory, request.scene, named))


def _of(reading: Reading, request: Request, effort: int) -> Reply | None:
    """The policy for a reading, or the question why there is none; None where its frames do not fit together."""
    if not reading.frames or reading.question:
        return None
    try:
        reply = reply_for(reading.frames, request, effort=effort, notes=reading.notes)
    except (OvitaError, ValueError, IndexError):
        return None
    return reply if reply.kind == "policy" or reply.question else None


def _asked(reading: Reading, unused: tuple[str, ...], request: Request) -> Reply:
    """The question, behind what is said of words that may name what the scene does not have."""
    question, named = reading.question, " ".join(request.scene.names).lower().split()
    strange = [word for word in unused if not {*word.lower().split()} & {*named}]
    if 0 < len(strange) <= FEW and question:
        known = f"the scene holds {listed(map(repr, request.scene.names)) or 'no objects'}"
        question = f"I do not know {quoted(strange)}; {known}. {sentence(question)}"
    return Reply("question", question=sentence(question), unplaced=reading.unread, writer=WriterInfo("builtin"))


FEW = 3
"""Up to so many words that nothing was read from are named in a question."""


def _declined(unplaced: tuple[str, ...], why: str = "") -> Reply:
    doubts = (f"{why}; the trajectory is unchanged",) if why else ()
    return Reply("not_understood", unplaced=unplaced, doubts=doubts, writer=WriterInfo("builtin"))


def reply_for(
    frames: Sequence[SemanticFrame],
    request: Request,
    *,
    effort: int = 1,
    notes: Sequence[str] = (),
    unplaced: Sequence[str] = (),
) -> Reply:
    """The built-in writer's reply for frames.

    Args:
        frames: What is asked for, in the order of the sentence.
        request: With the trajectory and its scene.
        effort: How much to exceed the usual amounts where none is stated; 1 is as usual.
        notes: What was corrected or assumed in reading, for people.
        unplaced: Words that no frame was read from; then there is no policy.
    """
    from ovita.instruct.realise import realise

    draft = realise(frames, request.trajectory, request.scene, effort=effort, robot=request.robot)
    plan, info = tuple(draft.plan), WriterInfo("builtin")
    if unplaced or draft.question:
        kind: Literal["question", "not_understood"] = "question" if draft.question else "not_understood"
        return Reply(kind, plan, question=draft.question, unplaced=tuple(unplaced), writer=info)
    summary = " ".join(plan).replace("\\", "/").replace('"""', "'''").rstrip('"')
    source = draft.source(summary)
    return Reply(
        "policy",
        plan=plan,
        code=source,
        assumptions=(*notes, *draft.assumptions),
        holds=tuple(draft.held) if len(draft.held) == len(frames) else (),
        writer=info,
        policy=Policy(source, "function", tuple(draft.parameters.values()), summary),
        frames=tuple(frames),
    )


@dataclass(frozen=True)
class FramesWriter:
    """A writer that realises frames, whatever the words are; nothing where words are unplaced."""

    frames: tuple[SemanticFrame, ...]
    unplaced: tuple[str, ...] = ()
    name: str = "builtin"

    def write(self, prompt: Prompt) -> Reply:
        """Answer with the policy for the frames; with more effort if the last one did too little."""
        if any(attempt.failure != "broken" for attempt in prompt.attempts):
            return Reply("not_understood", unplaced=(prompt.request.instruction,), writer=WriterInfo("builtin"))
        return reply_for(self.frames, prompt.request, effort=1 + len(prompt.attempts), unplaced=self.unplaced)
