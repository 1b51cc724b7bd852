"""What a baseline is, and an adaptation by one."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

from ovita.chain import enforced
from ovita.errors import WriterError
from ovita.limits import ConstraintOptions
from ovita.paths.trajectory import Trajectory
from ovita.request import Request
from ovita.result import Adaptation, explain
from ovita.writers.base import WriterInfo

KIND = "baseline"
"""The kind of writer that a result by a baseline names."""


@dataclass(frozen=True)
class Deformed:
    """A baseline's answer.

    Args:
        trajectory: After the change.
        matched: What the instruction was matched with, such as "move closer to the cup"; "" if nothing is matched.
        similarity: Of the instruction and what it was matched with, or None where none is measured.
    """

    trajectory: Trajectory
    matched: str = ""
    similarity: float | None = None


@runtime_checkable
class Baseline(Protocol):
    """Anything that deforms a request's trajectory."""

    @property
    def name(self) -> str:
        """How it is named on the command line, such as "baseline:extract"."""
        ...

    @property
    def keeps_limits(self) -> bool:
        """Whether the method ends with an optimiser that enforces the robot's limits; else they are only measured."""
        ...

    def deform(self, request: Request) -> Deformed:
        """Answer a request.

        Raises:
            WriterError: If no answer could be had.
        """
        ...


def adapted_by(baseline: Baseline, request: Request, constraints: ConstraintOptions | None = None) -> Adaptation:
    """Adapt a trajectory by a baseline; limits are enforced where they are part of its method, and measured always.

    A baseline has no policy and promises nothing: the result's plan says what was matched.
    """
    started = time.perf_counter()
    try:
        deformed = baseline.deform(request)
    except WriterError as failure:
        return _failed(request, baseline.name, str(failure), started)
    deforming = _since(started)
    options = constraints or ConstraintOptions()
    result = enforced(
        request.instruction,
        deformed.trajectory,
        request.scene,
        request.robot,
        constraints=replace(options, enabled=options.enabled and baseline.keeps_limits),
        original=request.trajectory,
    )
    likeness = "" if deformed.similarity is None else f" (similarity {deformed.similarity:.2f})"
    result = replace(
        result,
        plan=(f"Matched: {deformed.matched}{likeness}",) if deformed.matched else (),
        code="",
        attempts=1,
        writer=WriterInfo(KIND, baseline.name),
        timings_ms={"deform": deforming, **result.timings_ms},
    )
    return replace(result, explanation=explain(result))


def _failed(request: Request, name: str, error: str, started: float) -> Adaptation:
    return Adaptation(
        instruction=request.instruction,
        status="failed",
        original=request.trajectory,
        adapted=request.trajectory,
        scene=request.scene,
        robot=request.robot,
        explanation=error,
        error=error,
        attempts=1,
        writer=WriterInfo(KIND, name),
        timings_ms={"deform": _since(started)},
    )


def _since(started: float) -> float:
    return round((time.perf_counter() - started) * 1e3, 3)
