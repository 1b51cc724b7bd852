"""The built-in policy writer: readers that need no key and no network, a referee, and policies from the frames read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from ovita.errors import OvitaError
from ovita.instruct.frames import Reading, SemanticFrame, with_selection
from ovita.instruct.numbers import ambiguous
from ovita.policy import Policy
from ovita.request import Request
from ovita.text import listed, quoted
from ovita.writers.base import Reply, WriterInfo
from ovita.writers.prompt import Prompt


@dataclass(frozen=True)
class BuiltinWriter:
    """Writes policies for what its readers understand, and says which words they could not place.

    The referee (`instruct.referee`) decides over what the rules and the learned reader make of an instruction: done at
    once, shown for a yes, asked back, or declined.
    """

    name: str = "builtin"

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
        return _decided(request, effort)


def _decided(request: Request, effort: int) -> Reply:
    """What the referee's verdict on the instruction comes to."""
    from ovita.instruct.referee import understand

    verdict = understand(request.instruction, request.scene, request.trajectory, quick=True)
    if request.selection:
        marked = replace(verdict.reading, frames=with_selection(verdict.reading.frames, request.selection))
        verdict = replace(verdict, reading=marked)
    if verdict.outcome == "ask":
        return _asked(verdict.reading, verdict.unused, request)
    against = bool(verdict.reading.improper)  # what contradicts itself may be asked about
    reply = _of(verdict.reading, request, effort) if verdict.outcome != "decline" or against else None
    if reply is None or (against and not reply.question):
        ignored = verdict.rules.aside if verdict.rules is not None else ()
        return _declined(verdict.unused or ignored or (request.instruction,))
    if reply.kind != "policy":
        return reply
    if verdict.outcome == "do":
        unused = (f"{quoted(verdict.unused)} is not used",) if verdict.unused else ()
        return replace(reply, assumptions=(*reply.assumptions, *unused, *verdict.doubts))
    return replace(reply, confirm=True, unplaced=verdict.unused, doubts=verdict.doubts)


def _of(reading: Reading, request: Request, effort: int) -> Reply | None:
    """The policy for a reading, or the question why there is none; None where its frames do not fit together."""
    if not reading.frames or reading.question:
        return None
    ignored = (f"{quoted(reading.aside)} asks for nothing",) if reading.aside else ()
    try:
        reply = reply_for(reading.frames, request, effort=effort, notes=(*reading.notes, *ignored))
    except (OvitaError, ValueError, IndexError):
        return None
    return reply if reply.kind == "policy" or reply.question else None


def _asked(reading: Reading, unused: tuple[str, ...], request: Request) -> Reply:
    """The question, behind what is said of words that may name what the scene does not have."""
    question, named = reading.question, " ".join(request.scene.names).lower().split()
    strange = [word for word in unused if not {*word.lower().split()} & {*named}]
    if 0 < len(strange) <= FEW and question:
        known = f"the scene holds {listed(map(repr, request.scene.names)) or 'no objects'}"
        question = f"I do not know {quoted(strange)}; {known}. {question}"
    return Reply("question", question=question, unplaced=reading.unread, writer=WriterInfo("builtin"))


FEW = 3
"""Up to so many words that nothing was read from are named in a question."""


def _declined(unplaced: tuple[str, ...]) -> Reply:
    return Reply("not_understood", unplaced=unplaced, writer=WriterInfo("builtin"))


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
        contacts=tuple(draft.contacts),
        holds=tuple(draft.held) if len(draft.held) == len(frames) else (),
        writer=info,
        policy=Policy(source, "function", tuple(draft.parameters.values()), summary),
        frames=tuple(frames),
    )


@dataclass(frozen=True)
class FramesWriter:
    """A writer that realises frames, whatever the words are.

    Args:
        frames: What is asked for.
        unplaced: Words that no frame was read from; then nothing is written.
        name: How it is named.
    """

    frames: tuple[SemanticFrame, ...]
    unplaced: tuple[str, ...] = ()
    name: str = "builtin"

    def write(self, prompt: Prompt) -> Reply:
        """Answer with the policy for the frames; with more effort if the last one did too little."""
        if any(attempt.failure != "broken" for attempt in prompt.attempts):
            return Reply("not_understood", unplaced=(prompt.request.instruction,), writer=WriterInfo("builtin"))
        return reply_for(self.frames, prompt.request, effort=1 + len(prompt.attempts), unplaced=self.unplaced)
