"""The rest of a sentence read part by part, where the built-in writer is not sure of all of it at once.

The rest of such a sentence is a list, "at most 0.3 m/s, clearance to the pillar at least 0.4 m", whose parts do not
modify each other; where each part by itself is read with certainty, the policies follow each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ovita.chain import adapt
from ovita.request import Request
from ovita.result import Adaptation
from ovita.writers.base import Reply, WriterInfo
from ovita.writers.builtin import BuiltinWriter
from ovita.writers.prompt import Prompt

BEGIN, SIGNATURE_END, RETURN = "    *,\n", "):\n", "    return traj"


def by_parts(result: Adaptation, asked: Request, parts: Sequence[str], stages: dict[str, object]) -> Adaptation:
    """The adaptation by the parts of an instruction where that is done, and where the whole was not certain.

    Nor is it where every part has a number and the whole made fewer steps of them: it read two limits as one.
    """
    measured = all(any(letter.isdigit() for letter in part) for part in parts)
    certain = result.status in ("done", "limited") and not (measured and len(result.plan) < len(parts))
    if certain or result.writer.kind != "builtin" or len(parts) < 2:
        return result
    again = adapt(asked, **(stages | {"writer": _PartsWriter(tuple(parts))}))  # type: ignore[arg-type]
    return again if again.status in ("done", "limited") else result


@dataclass(frozen=True)
class _PartsWriter:
    """The built-in writer, asked for each part of an instruction."""

    parts: tuple[str, ...]
    name: str = "builtin"

    def write(self, prompt: Prompt) -> Reply:
        """Answer with a policy for all parts, or not at all where one of them is not certain."""
        writer, asked = BuiltinWriter(), prompt.request
        replies = [writer.write(replace(prompt, request=replace(asked, instruction=part))) for part in self.parts]
        sources = [_Source.of(reply.code) for reply in replies]
        names = [name for source in sources for name in source.names]
        certain = all(reply.kind == "policy" and not reply.confirm for reply in replies)
        if not certain or len(set(names)) < len(names):
            return Reply("not_understood", unplaced=(asked.instruction,), writer=WriterInfo("builtin"))
        plan = tuple(step for reply in replies for step in reply.plan)
        return Reply(
            "policy",
            plan=plan,
            code=_joined(sources, " ".join(reply.code.split('"""')[1] for reply in replies)),
            assumptions=tuple(text for reply in replies for text in reply.assumptions),
            contacts=tuple(name for reply in replies for name in reply.contacts),
            writer=WriterInfo("builtin"),
        )


@dataclass(frozen=True)
class _Source:
    """The lines of a policy that the built-in writer wrote: its parameters and its body."""

    parameters: tuple[str, ...]
    body: tuple[str, ...]

    @classmethod
    def of(cls, code: str) -> _Source:
        head, _, rest = code.partition(SIGNATURE_END)
        parameters = head.partition(BEGIN)[2].splitlines()
        body = [line for line in rest.splitlines()[1:] if line.strip() and line != RETURN]
        return cls(tuple(parameters), tuple(body))

    @property
    def names(self) -> list[str]:
        return [line.partition("=")[0].strip() for line in self.parameters]


def _joined(sources: Sequence[_Source], summary: str) -> str:
    """One policy that does what several do, in their order."""
    parameters = [line for source in sources for line in source.parameters]
    head = ["def adapt(", "    traj,", "    scene,", *(["    *,"] if parameters else []), *parameters, "):"]
    body = [line for source in sources for line in source.body]
    return "\n".join([*head, f'    """{summary}"""', *body, RETURN, ""])
