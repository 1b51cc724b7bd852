"""The built-in policy writer: readers that need no key and no network, and a referee over them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ovita.errors import OvitaError
from ovita.instruct import frames as F
from ovita.instruct.reading import read_instruction, standing
from ovita.instruct.steps import compose
from ovita.policy import Policy
from ovita.request import Request
from ovita.units import ambiguous
from ovita.writers.base import Reply, WriterInfo
from ovita.writers.generate import unused
from ovita.writers.prompt import Prompt


@dataclass(frozen=True)
class BuiltinWriter:
    """Writes policies for what its readers understand, and says which words they could not place.

    The clause reader (`instruct.reading`) is exact and knows few turns of phrase. What it does not read, or reads
    without one of its numbers or with a bound turned round, is left to the referee over the rules and the learned
    reader (`instruct.referee`): done where it is sure, else shown first, or declined.
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
        exact = _by_clauses(request, effort)
        left = _lost(request, exact.policy) if exact.policy is not None else ()
        turned = exact.policy is not None and _turned(request, exact.policy)
        certain = exact.kind == "question" or (exact.kind == "policy" and not left and not turned)
        if certain or len(request.instruction.split()) < 2:  # a word alone asks for nothing
            return exact
        found = _by_referee(request, effort)
        if found.kind == "policy" or exact.kind != "policy":
            return found if found.kind == "policy" else exact
        return _declined(left or (request.instruction,))


def _by_clauses(request: Request, effort: int) -> Reply:
    """What the clause reader makes of the instruction."""
    understood = read_instruction(request.instruction, request.scene, request.trajectory.positions)
    draft = compose(understood.intents, request.trajectory, request.scene, understood.radius, effort=effort)
    question = understood.question or standing(understood.intents, request.trajectory) or draft.question
    if understood.unplaced or question:
        return Reply(
            "question" if question else "not_understood",
            plan=tuple(draft.plan),
            question=question,
            unplaced=understood.unplaced,
            writer=WriterInfo("builtin"),
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
        writer=WriterInfo("builtin"),
        policy=Policy(source, "function", tuple(draft.parameters.values()), summary),
    )


def _lost(request: Request, policy: Policy) -> tuple[str, ...]:
    """The numbers of the instruction that a policy does not use, not even as time steps or from an object's centre."""
    step = request.trajectory.timestep
    sizes = [[*item.size, np.linalg.norm(item.size)] for item in request.scene]  # from the surface to the centre
    offsets = {0.0, *(float(edge) / 2 for edges in sizes for edge in edges)}
    values = [p.value for p in policy.parameters if isinstance(p.value, float | int)]

    def used(number: float) -> bool:
        lengths = [number * scale + offset for scale in (1.0, 0.01, 0.001) for offset in offsets]
        told = [(number / step, 0.06), *((length, 1e-3) for length in lengths)]
        return any(math.isclose(abs(value), meant, rel_tol=near) for value in values for meant, near in told)

    return tuple(said for said in unused(request.instruction, policy.source) if not used(float(said)))


def _turned(request: Request, policy: Policy) -> bool:
    """Whether a policy has only a most where a minimum is named, or only a least where a maximum is."""
    roles = {p.role for p in policy.parameters} & {"at_least", "at_most"}
    if len(roles) != 1:
        return False
    from ovita.instruct.chunks import chunks

    kinds = {chunk.kind for chunk in chunks(request.instruction, request.scene, request.trajectory.positions)[0]}
    return bool(kinds & ({"min", "vmin"} if roles == {"at_most"} else {"max", "vmax"}))


def _by_referee(request: Request, effort: int) -> Reply:
    """What the referee makes of the instruction."""
    from ovita.instruct.referee import understand  # what the clause reader reads needs neither table nor network

    verdict = understand(request.instruction, request.scene, request.trajectory)
    refused = verdict.learned is not None and bool(verdict.learned.improper)
    out = refused or verdict.outcome in ("ask", "decline")
    reply = None if out else _of(verdict.reading, request, effort)
    if reply is None:
        return _declined(verdict.unused or (request.instruction,))
    if reply.kind != "policy" or (verdict.outcome == "do" and not any(map(_either_way, verdict.reading.frames))):
        return reply
    return replace(reply, confirm=True, unplaced=verdict.unused, doubts=verdict.doubts)


def _of(reading: F.Reading, request: Request, effort: int) -> Reply | None:
    """The policy for a reading; None where there is none."""
    from ovita.writers.realised import reply_for

    if not reading.frames or reading.question or reading.improper:
        return None
    try:
        reply = reply_for(reading.frames, request, effort=effort, notes=reading.notes)
    except (OvitaError, ValueError, IndexError):  # frames that do not fit together
        return None
    return reply if reply.kind == "policy" or reply.question else None


def _either_way(frame: F.SemanticFrame) -> bool:
    """Whether it is easily read the wrong way round: a distance that is halved or doubled."""
    return isinstance(frame, F.Approach) and frame.by is not None and frame.by.unit in ("x", "%")


def _declined(unplaced: tuple[str, ...]) -> Reply:
    return Reply("not_understood", unplaced=unplaced, writer=WriterInfo("builtin"))
