"""Phase two: writers are asked in line, their policies run, and a failing one goes back with what came out.

writer 1 -> policy -> run -> judge -> repair ... -> writer 2 -> ... -> the best of what there is
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ovita.errors import PolicyError, UnusableReply, WriterError
from ovita.measure import compare, sentences
from ovita.paths.trajectory import Array
from ovita.policy import Policy
from ovita.policy.reading import parse
from ovita.policy.sandbox import Isolation as Isolation
from ovita.policy.sandbox import Rollout, run
from ovita.request import Request
from ovita.toolkit import Outcome, judge
from ovita.writers.base import PolicyWriter, Prompt, Reply, WriterInfo, in_line, told
from ovita.writers.unused_numbers import unused

Lap = Callable[[str], None]
"""Books the time since the last call on a stage: "write" or "run"."""


@dataclass(frozen=True)
class Written:
    """What came of asking a writer, or all of them.

    Args:
        reply: The last reply that counts.
        policy: The policy, if one ran.
        rollout: What it returned.
        attempts: How many answers were asked for.
        error: Why there is no policy, or what is wrong with it; "" if it ran and keeps its promises.
        by: The writer.
    """

    reply: Reply
    policy: Policy | None = None
    rollout: Rollout | None = None
    attempts: int = 0
    error: str = ""
    by: PolicyWriter | None = None

    @property
    def rank(self) -> int:
        """How much it is worth: a policy that is as meant, another policy, a question, a refusal, a failure."""
        if self.policy is not None:
            return 3 if self.error else 4
        return 0 if self.error else {"question": 2, "not_understood": 1}[self.reply.kind]

    @property
    def outcome(self) -> str:
        """What came of it, in a few words."""
        if self.error or self.policy is not None:
            first, *more = self.error.splitlines() or ["its policy ran as meant"]
            return " ".join([first, *(line.removeprefix("- ") for line in more if "; broken, measured: " in line)])
        if self.reply.kind == "question":
            return f"asks: {self.reply.question}"
        return f"could not place {quoted(self.reply.unplaced) or 'the instruction'}"


def write(prompt: Prompt, writer: PolicyWriter, *, isolation: Isolation, repairs: int, lap: Lap) -> Written:
    """Ask the writers in line until a policy ran and kept its promises, or one asks a question back.

    Args:
        prompt: The grounded request; its watch bounds the time, tells what goes on, and may stop it all.
        writer: A writer, or a line of them.
        isolation: How policies must be isolated while they run.
        repairs: How often a failing policy goes back to its writer.
        lap: Books the time of the stages.

    Returns:
        The best that came of it, with every writer that was asked in `reply.writer.tried`.
    """
    line = in_line(writer)
    done: list[Written] = []
    tried: list[str] = []
    for member in line:
        one = replace(_ask(prompt, member, isolation, repairs, lap), by=member)
        done.append(one)
        tried.append(f"{member.name}: {one.outcome}")
        if one.rank in (2, 4) or prompt.watch.over():
            break
        if len(done) < len(line):
            prompt = told(prompt, one.reply)
    # A policy that promises nothing is no better than one that tried and broke a promise, so the earlier one stays.
    best = max(done, key=lambda one: one.rank if one.rollout and one.rollout.expectations else min(one.rank, 3))
    if best.rank == 0 and len(line) > 1:
        best = replace(best, error=" ".join(f"{said.rstrip('.')}." for said in tried))
    info = replace(best.reply.writer, tried=tuple(tried))
    return replace(best, reply=replace(best.reply, writer=info), attempts=sum(one.attempts for one in done))


def judged(request: Request, rollout: Rollout, result: Array) -> list[Outcome]:
    """Judge a rollout's promises on a trajectory, (M, 4) array, in their order."""
    original = request.trajectory.to_array()
    return [judge(promise, original, result, request.scene) for promise in rollout.expectations]


def quoted(words: Sequence[str]) -> str:
    """Words as 'one', 'two'."""
    return ", ".join(repr(word) for word in words)


def _ask(prompt: Prompt, writer: PolicyWriter, isolation: Isolation, repairs: int, lap: Lap) -> Written:
    """Ask one writer, and show it what is wrong with its policy until it is right or the repairs are used up."""
    last = Written(Reply("not_understood", writer=WriterInfo(writer.name)), error="it was not asked")
    tokens_in = tokens_out = 0
    for attempts in range(1, repairs + 2):
        over = prompt.watch.over()
        if over:
            return last if last.policy else replace(last, error=over if attempts == 1 else f"{over}; {last.error}")
        prompt.watch.say(f"{writer.name} writes a policy" if attempts == 1 else f"{writer.name} repairs its policy")
        try:
            answer = writer.write(prompt)
        except UnusableReply as failure:
            lap("write")
            last = last if last.policy else replace(last, attempts=attempts, error=str(failure))
            prompt = prompt.repaired("", f"{failure} (answer in the form that is asked for, and more briefly)")
            continue
        except WriterError as failure:
            lap("write")
            return replace(last, attempts=attempts, error=last.error if last.policy else str(failure))
        lap("write")
        tokens_in += answer.writer.input_tokens
        tokens_out += answer.writer.output_tokens
        counted = replace(answer, writer=replace(answer.writer, input_tokens=tokens_in, output_tokens=tokens_out))
        if answer.kind != "policy":
            repairing = any(attempt.code for attempt in prompt.attempts)
            return replace(last, attempts=attempts) if repairing else Written(counted, attempts=attempts)
        prompt.watch.say("running the policy")
        now = _run(prompt.request, counted, isolation)
        lap("run")
        last = replace(now if now.policy or not last.policy else last, attempts=attempts)
        if not now.error or any(attempt.error == now.error and now.policy for attempt in prompt.attempts):
            break
        prompt = prompt.repaired(now.policy.source if now.policy else answer.code, now.error)
    return last


def _run(request: Request, reply: Reply, isolation: Isolation) -> Written:
    """Check a policy and run it; the error says what must become better."""
    try:
        policy = parse(reply.code)
        rollout = run(policy, request.trajectory, request.scene, isolation=isolation)
    except PolicyError as failure:
        return Written(reply, error=str(failure))
    error = _wanting(request, rollout)
    left = ", ".join(unused(request.instruction, policy.source)) if reply.writer.kind == "llm" else ""
    if left:
        hint = f"the instruction says {left}, which is nowhere in it; use it, converted to SI units"
        error = f"{error}\n- {hint}" if error else f"it ran, but {hint}"
        assumed = f"What the instruction says of {left} is meant by other numbers of the policy."
        reply = replace(reply, assumptions=(*reply.assumptions, assumed))
    return Written(reply, policy, rollout, error=error)


def _wanting(request: Request, rollout: Rollout) -> str:
    """What a policy's result lacks: each broken promise next to what was measured, and what did change."""
    outcomes = judged(request, rollout, rollout.trajectory.to_array())
    if not outcomes and rollout.trajectory == request.trajectory:
        return "it ran, but changed nothing; if nothing is to change, promise it with expect_same_path()"
    if all(outcome.held for outcome in outcomes):
        return ""
    lines = [
        f"- promised: {promise.text}; {'kept' if outcome.held else 'broken'}, measured: {outcome.sentence}"
        for promise, outcome in zip(rollout.expectations, outcomes, strict=True)
    ]
    changes = sentences(compare(request.trajectory, rollout.trajectory, request.scene))
    lines += [f"- measured change: {said}" for said in changes]
    return "\n".join(["it ran, but does not do what it promises:", *lines])
