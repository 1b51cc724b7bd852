"""The built-in policy writer: a clause parser that needs no key, no network and milliseconds."""

from __future__ import annotations

from dataclasses import dataclass

from ovita.language.builtin.compose import compose
from ovita.language.builtin.parse import parse
from ovita.language.request import Prompt, Reply, WriterInfo
from ovita.scene import Scene, canonical


@dataclass(frozen=True)
class BuiltinWriter:
    """Writes policies for the common families of instructions, and says which words it could not place."""

    name: str = "builtin"

    def write(self, prompt: Prompt) -> Reply:
        """Answer with a policy, a question, or the words that could not be placed.

        A policy that already failed would fail again, so after a failed attempt it declines.
        """
        info = WriterInfo("builtin")
        request = prompt.request
        if prompt.attempts:
            return Reply("not_understood", unplaced=(request.instruction,), writer=info)
        understood = parse(request.instruction, request.scene)
        draft = compose(understood.intents, request, understood.radius)
        if understood.unplaced:
            question = _which(understood.unplaced, request.scene)
            return Reply(
                "question" if question else "not_understood",
                plan=tuple(draft.plan),
                question=question,
                unplaced=understood.unplaced,
                writer=info,
            )
        summary = " ".join(draft.plan).replace("\\", "/").replace('"""', "'''").rstrip('"')
        return Reply(
            "policy",
            plan=tuple(draft.plan),
            code=draft.source(summary),
            assumptions=(*understood.notes, *draft.assumptions),
            writer=info,
        )


def _which(words: tuple[str, ...], scene: Scene) -> str:
    """A question back where a word names several objects: "Which cup: 'red cup' or 'blue cup'?"."""
    for word in words:
        fits = [item.name for item in scene if canonical(word) in canonical(item.name).split()]
        if len(fits) > 1:
            return f"Which {word}: {' or '.join(repr(name) for name in fits)}?"
    return ""
