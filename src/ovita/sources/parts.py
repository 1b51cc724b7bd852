"""The rest of a sentence read part by part, where the built-in writer is not sure of all of it at once.

The rest of such a sentence is a list, "at most 0.3 m/s, clearance to the pillar at least 0.4 m", whose parts do not
modify each other; where each part by itself is read with certainty, what they ask for is realised together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ovita.chain import adapt
from ovita.request import Request
from ovita.result import Adaptation
from ovita.writers.base import Reply, WriterInfo
from ovita.writers.builtin import BuiltinWriter, reply_for
from ovita.writers.prompt import Prompt


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
    """The built-in writer, asked for each part of an instruction; what they ask for is realised together."""

    parts: tuple[str, ...]
    name: str = "builtin"

    def write(self, prompt: Prompt) -> Reply:
        """Answer with a policy for all parts, or not at all where one of them is not certain."""
        writer, asked = BuiltinWriter(), prompt.request
        replies = [writer.write(replace(prompt, request=replace(asked, instruction=part))) for part in self.parts]
        if not all(reply.kind == "policy" and not reply.confirm for reply in replies):
            return Reply("not_understood", unplaced=(asked.instruction,), writer=WriterInfo("builtin"))
        frames = [frame for reply in replies for frame in reply.frames]
        whole = reply_for(frames, asked, effort=1 + len(prompt.attempts))
        assumed = [text for reply in (whole, *replies) for text in reply.assumptions]
        return replace(whole, assumptions=tuple(dict.fromkeys(assumed)))
