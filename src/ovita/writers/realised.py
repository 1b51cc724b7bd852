"""Policies from frames: the reply that realises what was read, and a writer for frames that are known already."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ovita.instruct.frames import SemanticFrame
from ovita.instruct.realise import realise
from ovita.policy import Policy
from ovita.request import Request
from ovita.writers.base import Reply, WriterInfo
from ovita.writers.prompt import Prompt


def reply_for(
    frames: Sequence[SemanticFrame],
    request: Request,
    *,
    effort: int = 1,
    notes: Sequence[str] = (),
    question: str = "",
    unplaced: Sequence[str] = (),
) -> Reply:
    """The built-in writer's reply for frames.

    Args:
        frames: What is asked for, in the order of the sentence.
        request: With the trajectory and its scene.
        effort: How much to exceed the usual amounts where none is stated; 1 is as usual.
        notes: What was corrected or assumed in reading, for people.
        question: What the reader has to ask back, or "".
        unplaced: Words that no frame was read from; then there is no policy.
    """
    draft = realise(frames, request.trajectory, request.scene, effort=effort)
    question = question or draft.question
    plan, info = tuple(draft.plan), WriterInfo("builtin")
    if unplaced or question:
        kind = "question" if question else "not_understood"
        return Reply(kind, plan, question=question, unplaced=tuple(unplaced), writer=info)  # type: ignore[arg-type]
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
