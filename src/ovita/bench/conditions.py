"""Ablation conditions: what is switched off or varied in a run."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ovita.chain import REPAIRS
from ovita.errors import RequestError
from ovita.writers.prompt import ExampleMode, Prompt

ABLATIONS: dict[str, str] = {
    "examples": "the prompt without examples, and with the paper's two instead of those that are like the instruction",
    "toolkit": "the paper's prompt for scripts, without any function to edit with",
    "grounding": "the prompt with the objects' names only, as in the paper: no positions, extents, speeds or limits",
    "repair": "a failing policy does not go back to its writer",
    "constraints": "limits are measured but not enforced",
}
"""What `--ablate` can switch off."""

PAPER_EXAMPLES = "paper examples"
"""The condition in which the prompt shows the paper's way of two fixed examples."""

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
    def examples(self) -> ExampleMode:
        """Which examples the prompt shows."""
        if self.name == PAPER_EXAMPLES or self.without == "toolkit":
            return "paper"
        return "none" if self.without == "examples" else "retrieved"

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
        """The prompt with the ablation applied."""
        if self.without not in ("toolkit", "grounding"):
            return prompt
        toolkit, scene = self.without != "toolkit", self.without != "grounding"
        return replace(prompt, style=replace(prompt.style, examples=self.examples, toolkit=toolkit, scene=scene))


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
            if part == "examples":
                found.append(Condition(PAPER_EXAMPLES))
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
