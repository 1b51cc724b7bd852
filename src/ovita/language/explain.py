"""Phase four: the explanation, in plain words for people who never program.

The template writer needs no model; every number in it comes from the change report and the parameters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ovita.policy import Parameter


@dataclass(frozen=True)
class Facts:
    """Everything that an explanation may say; each entry is a sentence or a short list of sentences."""

    instruction: str
    plan: Sequence[str] = ()
    parameters: Sequence[Parameter] = ()
    changes: Sequence[str] = ()
    limits: Sequence[str] = ()
    promises: Sequence[str] = ()
    assumptions: Sequence[str] = ()

    def as_text(self) -> Mapping[str, str]:
        """The facts by topic, for a writer that explains in its own words."""
        return {
            "instruction": self.instruction,
            "plan": "\n".join(self.plan),
            "parameters": "\n".join(knob(p) for p in self.parameters),
            "changes": "\n".join(self.changes),
            "limits": "\n".join(self.limits),
            "promises that do not hold": "\n".join(self.promises),
            "assumptions": "\n".join(self.assumptions),
        }


def explain(facts: Facts) -> str:
    """Write the explanation from a template: what was done, what changed, the limits, the knobs, the assumptions."""
    parts = [f'You asked: "{" ".join(facts.instruction.split())}".']
    if facts.plan:
        parts.append("What was done:\n" + _bullets(facts.plan))
    if facts.changes:
        parts.append("What changed:\n" + _bullets(facts.changes))
    if facts.promises:
        parts.append("What did not come out as meant:\n" + _bullets(facts.promises))
    if facts.limits:
        parts.append("Limits:\n" + _bullets(facts.limits))
    if facts.assumptions:
        parts.append("What was assumed:\n" + _bullets(facts.assumptions))
    if facts.parameters:
        parts.append("What you can turn:\n" + _bullets([knob(p) for p in facts.parameters]))
    return "\n".join(parts)


def knob(parameter: Parameter) -> str:
    """A parameter as a line: "left = 0.2 m: shift to the left"."""
    value = f"{parameter.value:g}" if isinstance(parameter.value, float) else str(parameter.value)
    unit = f" {parameter.unit}" if parameter.unit else ""
    meaning = f": {parameter.meaning}" if parameter.meaning else ""
    return f"{parameter.name} = {value}{unit}{meaning}"


def _bullets(lines: Sequence[str]) -> str:
    return "\n".join(f"- {line}" for line in lines)
