"""Constraints: a robot's limits, and the nearest trajectory that satisfies them.

`constrain` is the whole module; `verify` measures without changing anything; `parse_text` reads the constraint text of
a scene file. The solver is imported on first use of `constrain`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ovita.limits.problem import ConstraintCheck, ConstraintOptions, Solution, Verdict
from ovita.limits.stated import TextLimits, parse_text
from ovita.limits.verify import verify

if TYPE_CHECKING:
    from ovita.limits.solve import constrain

__all__ = [
    "ConstraintCheck",
    "ConstraintOptions",
    "Solution",
    "TextLimits",
    "Verdict",
    "constrain",
    "parse_text",
    "verify",
]


def __getattr__(name: str) -> Any:
    if name == "constrain":
        from ovita.limits.solve import constrain

        return constrain
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
