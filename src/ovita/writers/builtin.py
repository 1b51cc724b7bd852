"""The built-in policy writer: a clause parser that needs no key, no network and milliseconds."""

from __future__ import annotations

from dataclasses import dataclass

from ovita.instruct.reading import read_instruction, standing
from ovita.instruct.steps import compose
from ovita.policy import Policy
from ovita.writers.base import Reply, WriterInfo
from ovita.writers.prompt import Prompt


@dataclass(frozen=True)
class BuiltinWriter:
    """Writes policies for the common families of instructions, and says which words it could not place."""

    name: str = "builtin"

    def write(self, prompt: Prompt) -> Reply:
        """Answer with a policy, a question, or the words that could not be placed.

        A policy that ran but did too little is written again with more effort; one that failed would fail again, so
        then it declines.
        """
        info = WriterInfo("builtin")
        request = prompt.request
        if any(attempt.failure != "broken" for attempt in prompt.attempts):
            return Reply("not_understood", unplaced=(request.instruction,), writer=info)
        understood = read_instruction(request.instruction, request.scene, request.trajectory.positions)
        draft = compose(
            understood.intents, request.trajectory, request.scene, understood.radius, effort=1 + len(prompt.attempts)
        )
        question = understood.question or standing(understood.intents, request.trajectory) or draft.question
        if understood.unplaced or question:
            return Reply(
                "question" if question else "not_understood",
                plan=tuple(draft.plan),
                question=question,
                unplaced=understood.unplaced,
                writer=info,
            )
        summary = " ".join(draft.plan).replace("\\", "/").replace('"""', "'''").rstrip('"')
        source = draft.source(summary)
        return Reply(
            "policy",
            plan=tuple(draft.plan),
            code=source,
            assumptions=(*understood.notes, *draft.assumptions),
            contacts=tuple(draft.contacts),
            holds=tuple(draft.held) if len(draft.held) == len(understood.intents) else (),
            writer=info,
            policy=Policy(source, "function", tuple(draft.parameters.values()), summary),
        )
