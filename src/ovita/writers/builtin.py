"""The built-in policy writer: readers that need no key and no network, and a referee over them."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ovita.errors import OvitaError
from ovita.instruct.frames import Reading
from ovita.request import Request
from ovita.text import quoted
from ovita.units import ambiguous
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
    if verdict.outcome == "ask":
        return _asked(verdict.reading)
    against = bool(verdict.reading.improper)  # what contradicts itself may be asked about
    reply = _of(verdict.reading, request, effort) if verdict.outcome != "decline" or against else None
    if reply is None or (against and not reply.question):
        ignored = verdict.rules.aside if verdict.rules is not None else ()
        return _declined(verdict.unused or ignored or (request.instruction,))
    if reply.kind != "policy" or verdict.outcome == "do":
        return reply
    return replace(reply, confirm=True, unplaced=verdict.unused, doubts=verdict.doubts)


def _of(reading: Reading, request: Request, effort: int) -> Reply | None:
    """The policy for a reading, or the question why there is none; None where its frames do not fit together."""
    from ovita.writers.realised import reply_for

    if not reading.frames or reading.question:
        return None
    ignored = (f"{quoted(reading.aside)} asks for nothing",) if reading.aside else ()
    try:
        reply = reply_for(reading.frames, request, effort=effort, notes=(*reading.notes, *ignored))
    except (OvitaError, ValueError, IndexError):
        return None
    return reply if reply.kind == "policy" or reply.question else None


def _asked(reading: Reading) -> Reply:
    return Reply("question", question=reading.question, unplaced=reading.unread, writer=WriterInfo("builtin"))


def _declined(unplaced: tuple[str, ...]) -> Reply:
    return Reply("not_understood", unplaced=unplaced, writer=WriterInfo("builtin"))
