"""Conditions: what is switched off, or varied, to see what it is worth."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace

from ovita.chain import REPAIRS
from ovita.errors import RequestError
from ovita.language.request import Prompt
from ovita.toolkit import describe

ABLATIONS = {
    "examples": "the prompt without its two examples",
    "toolkit": "the prompt without the catalogue of functions, and without the examples, which use it",
    "grounding": "the prompt with the objects' names only, as in the paper: no positions, extents, speeds or limits",
    "repair": "a failing policy does not go back to its writer",
    "constraints": "limits are measured but not enforced",
}
"""What `--ablate` can switch off."""

WITHOUT_MODEL = ("repair", "constraints")
"""The ablations that mean something for a writer that reads no prompt."""


@dataclass(frozen=True)
class Condition:
    """One setting of the chain.

    Args:
        name: "default", or what differs from it.
        without: What is switched off, a key of `ABLATIONS`, or "".
        temperature: Sampling temperature of a model, or None for the run's own.
    """

    name: str = "default"
    without: str = ""
    temperature: float | None = None

    @property
    def examples(self) -> bool:
        """Whether the prompt shows its examples."""
        return self.without not in ("examples", "toolkit")

    @property
    def constraints(self) -> bool:
        """Whether limits are enforced."""
        return self.without != "constraints"

    @property
    def repairs(self) -> int:
        """How often a failing policy goes back."""
        return 0 if self.without == "repair" else REPAIRS

    def applies_to(self, writer: str) -> bool:
        """Whether the condition can make a difference to a writer."""
        return self == DEFAULT or writer != "builtin" or self.without in WITHOUT_MODEL

    def rewrite(self, prompt: Prompt) -> Prompt:
        """The prompt without what the condition switches off."""
        if self.without == "toolkit":
            return replace(prompt, fixed=prompt.fixed.replace(describe(), "None: write numpy only."))
        if self.without == "grounding":
            request = prompt.request
            names = ", ".join(json.dumps(name, ensure_ascii=False) for name in request.scene.names) or "none"
            situation = (
                f"# This scene\nFrame: {request.scene.frame.describe()}. Units: metres, m/s, seconds.\n"
                f"Objects: {names}.\n# Instruction\n{' '.join(request.instruction.split())}\n"
            )
            return replace(prompt, situation=situation)
        return prompt


DEFAULT = Condition()


def conditions_from(text: str) -> tuple[Condition, ...]:
    """The default condition and those that an option such as "examples,temperature=0,0.5" names.

    Raises:
        RequestError: If a name is no ablation, or a temperature is out of range.
    """
    found = [DEFAULT]
    varied = ""
    for part in (p.strip() for p in text.split(",") if p.strip()):
        name, equals, value = part.partition("=")
        if equals:
            varied = name.strip()
        elif varied and _is_number(part):
            value = part
        else:
            varied = ""
            if part not in ABLATIONS:
                raise _unsupported(part)
            found.append(Condition(f"no {part}", without=part))
            continue
        if varied != "temperature":
            raise _unsupported(varied)
        found.append(_at(value))
    return tuple(dict.fromkeys(found))


def _at(value: str) -> Condition:
    if not _is_number(value) or not 0.0 <= float(value) <= 2.0:
        raise RequestError(f"the temperature {value!r} is out of range; write --ablate temperature=0,0.2,0.5,0.7")
    return Condition(f"temperature {float(value):g}", temperature=float(value))


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _unsupported(name: str) -> RequestError:
    return RequestError(
        f"{name!r} cannot be switched off; --ablate takes {', '.join(ABLATIONS)} and temperature=0,0.2,..."
    )
