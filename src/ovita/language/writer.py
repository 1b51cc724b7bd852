"""Policy writers: the protocol, and choosing one by name."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

from ovita.errors import RequestError
from ovita.language.request import Prompt, Reply

MODEL_VARIABLE = "OVITA_MODEL"
"""Environment variable that names the configured model, such as "openai:gpt-5"."""

PROVIDERS = ("openai", "anthropic", "google", "ollama")


@runtime_checkable
class PolicyWriter(Protocol):
    """Anything that answers a prompt with a plan and a policy."""

    @property
    def name(self) -> str:
        """How the writer is named on the command line, such as "builtin" or "openai:gpt-5"."""
        ...

    def write(self, prompt: Prompt) -> Reply:
        """Answer a prompt.

        Raises:
            WriterError: If no answer could be had: no key, no connection, an unusable reply.
        """
        ...


@dataclass(frozen=True)
class _Chosen:
    """A writer together with the reason for its choice, which its replies then state."""

    writer: PolicyWriter
    reason: str

    @property
    def name(self) -> str:
        return self.writer.name

    def write(self, prompt: Prompt) -> Reply:
        reply = self.writer.write(prompt)
        return replace(reply, writer=replace(reply.writer, reason=self.reason))


def writer_named(name: str = "auto", *, base_url: str | None = None, temperature: float = 0.1) -> PolicyWriter:
    """Return the writer of that name.

    Args:
        name: "auto" (the model named by OVITA_MODEL, else the built-in writer), "builtin", or
            "PROVIDER:MODEL" with provider openai, anthropic, google or ollama.
        base_url: Address of an OpenAI-compatible server; then `name` is that server's model.
        temperature: Sampling temperature of a model.

    Raises:
        RequestError: If the name is none of these.
        MissingExtra: If the model's packages are not installed.
    """
    from ovita.language.builtin import BuiltinWriter

    if name == "auto" and base_url is None:
        configured = os.environ.get(MODEL_VARIABLE, "").strip()
        if not configured:
            return _Chosen(BuiltinWriter(), f"no model is configured ({MODEL_VARIABLE} is not set)")
        return _Chosen(writer_named(configured, temperature=temperature), f"{MODEL_VARIABLE} names it")
    if name == "builtin":
        return _Chosen(BuiltinWriter(), "asked for by name")
    provider, _, model = name.partition(":")
    if base_url is None and (provider not in PROVIDERS or not model):
        raise RequestError(
            f"unknown writer {name!r}; use auto, builtin, or PROVIDER:MODEL with provider {', '.join(PROVIDERS)}"
            " (or --base-url for an OpenAI-compatible server)"
        )
    from ovita.language.llm import LLMWriter

    reason = "asked for by name"
    return _Chosen(LLMWriter(name, base_url=base_url, temperature=temperature), reason)
