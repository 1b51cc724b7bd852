"""The built-in policy writer: readers that need no key and no network, and a referee over them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ovita.errors import OvitaError
from ovita.instruct import frames as F
from ovita.instruct.reading import read_instruction, standing
from ovita.instruct.referee import Understanding, doubts_about, understand
from ovita.instruct.steps import compose
from ovita.paths.trajectory import Trajectory
from ovita.policy import Policy
from ovita.policy.direct import run_proven
from ovita.policy.syntax import parse_tree
from ovita.request import Request
from ovita.units import ambiguous
from ovita.writers.base import Reply, WriterInfo
from ovita.writers.prompt import Prompt
from ovita.writers.realised import reply_for

SURE = 0.9
"""Confidence of the learned reader from which a reading is done that the rules come to as well."""

NEAR = (0.005, 0.02)
"""Two policies come to the same if no waypoint differs by more than this share of the path's extent, nor any speed by
more than this share of the highest."""


@dataclass(frozen=True)
class BuiltinWriter:
    """Writes policies for what its readers understand, and says which words they could not place.

    The clause reader (`instruct.reading`) is exact and knows few turns of phrase. What it does not read is left to the
    referee over the rules and the learned reader (`instruct.referee`): done where both are sure and come to the same,
    else shown first, asked back, or declined.
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
        if exact.kind != "not_understood" or len(request.instruction.split()) < 2:  # a word alone asks for nothing
            return exact
        found = _judged(request, _understood(request), effort)
        return found if found.kind == "policy" else exact


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


def _understood(request: Request) -> Understanding:
    return understand(request.instruction, request.scene, request.trajectory)


def _of(reading: F.Reading | None, request: Request, effort: int) -> Reply | None:
    """The policy for a reading; None where there is none."""
    if reading is None or not reading.frames or reading.question or reading.improper:
        return None
    try:
        reply = reply_for(reading.frames, request, effort=effort, notes=reading.notes)
    except (OvitaError, ValueError, IndexError):  # frames that do not fit together
        return None
    return reply if reply.kind == "policy" or reply.question else None


def _judged(request: Request, verdict: Understanding, effort: int) -> Reply:
    """What the verdict on a sentence that the clause reader does not read comes to."""
    refused = verdict.learned is not None and bool(verdict.learned.improper)
    reply = None if refused or verdict.outcome in ("ask", "decline") else _of(verdict.reading, request, effort)
    if reply is None:
        return _declined(verdict.unused or (request.instruction,))
    if reply.kind != "policy":
        return reply
    sure = _sure(request, verdict)
    return sure or replace(reply, confirm=True, unplaced=verdict.unused, doubts=verdict.doubts)


def _sure(request: Request, verdict: Understanding) -> Reply | None:
    """The learned reading's policy where it may be done without asking."""
    learned = verdict.learned
    if (
        learned is None
        or learned.confidence < SURE
        or doubts_about(learned, request.instruction, request.scene, request.trajectory)
    ):
        return None
    if any(isinstance(f, F.Approach) and f.by is not None and f.by.unit in ("x", "%") for f in learned.frames):
        return None  # whether a distance is halved or doubled is easily read the wrong way round
    reply = _of(learned, request, 1)
    if reply is None or reply.kind != "policy":
        return None
    agreed = verdict.rules is not None and _same_effect(reply, _of(verdict.rules, request, 1), request)
    return reply if agreed else None


def _declined(unplaced: tuple[str, ...]) -> Reply:
    return Reply("not_understood", unplaced=unplaced, writer=WriterInfo("builtin"))


def _same_effect(one: Reply, other: Reply | None, request: Request) -> bool:
    """Whether two policies come to about the same trajectory."""
    if other is None or other.kind != "policy":
        return False
    try:
        first, second = (_rollout(reply, request) for reply in (one, other))
    except (OvitaError, ValueError, IndexError, KeyError):
        return False
    if len(first) != len(second):
        return False
    extent = float(np.ptp(request.trajectory.positions, axis=0).max())
    moved = float(np.abs(first.positions - second.positions).max())
    paced = float(np.abs(first.speeds - second.speeds).max())
    return moved <= NEAR[0] * extent and paced <= NEAR[1] * max(float(request.trajectory.speeds.max()), 1e-9)


def _rollout(reply: Reply, request: Request) -> Trajectory:
    rows, _ = run_proven(parse_tree(reply.code), request.trajectory.to_array(), request.scene)
    return Trajectory.from_array(rows)
