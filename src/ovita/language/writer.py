"""Policy writers: the protocol, writers in line, and choosing them by name."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

from ovita.errors import RequestError, WriterError
from ovita.language.quoting import quoted
from ovita.language.request import Prompt, Reply

MODEL_VARIABLE = "OVITA_MODEL"
"""Environment variable that names the configured model, such as "openai:gpt-5", or a line of them with commas."""

MAX_TOLD = 200
"""Longest step, or run of words, that one writer is told of another [characters]."""

PROVIDERS = ("llamacpp", "openai", "anthropic", "google", "ollama")


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
    otherwise: str = ""
    """The reason for a reply without a policy, where it differs."""

    @property
    def name(self) -> str:
        return self.writer.name

    def write(self, prompt: Prompt) -> Reply:
        reply = self.writer.write(prompt)
        reason = self.reason if reply.kind == "policy" else self.otherwise or self.reason
        return replace(reply, writer=replace(reply.writer, reason=reason))


@dataclass(frozen=True)
class Line:
    """Writers in line: each one is asked where those before it had no answer.

    The chain asks the writers of a line itself, since it also sees whether a policy runs and keeps its promises.

    Args:
        writers: In the order in which they are asked; at least one.
        name: How the line was named, such as "auto".
    """

    writers: tuple[PolicyWriter, ...]
    name: str

    def write(self, prompt: Prompt) -> Reply:
        """Answer as the first writer that has a policy or a question; else as the first that understood anything.

        Raises:
            WriterError: If none of them could answer.
        """
        refusal: Reply | None = None
        tried: list[str] = []
        for writer in self.writers:
            try:
                reply = writer.write(prompt)
            except WriterError as error:
                tried.append(f"{writer.name}: {error}")
                continue
            tried.append(f"{writer.name}: {reply.kind.replace('_', ' ')}")
            reply = replace(reply, writer=replace(reply.writer, tried=tuple(tried)))
            if reply.kind != "not_understood":
                return reply
            refusal = refusal or reply
            prompt = prompt if prompt.attempts else told(prompt, reply)
        if refusal is None:
            raise WriterError(" ".join(f"{said.rstrip('.')}." for said in tried))
        return replace(refusal, writer=replace(refusal.writer, tried=tuple(tried)))


def in_line(writer: PolicyWriter) -> tuple[PolicyWriter, ...]:
    """Return the writers of a line, or the one writer."""
    return writer.writers if isinstance(writer, Line) else (writer,)


def told(prompt: Prompt, reply: Reply) -> Prompt:
    """Return the prompt for the next writer in line: it ends with what the last one understood and what not."""
    if reply.kind != "not_understood" or not (reply.plan or reply.unplaced):
        return prompt
    placed = ", ".join(quoted(step, MAX_TOLD) for step in reply.plan) or "nothing"
    words = ", ".join(quoted(word, MAX_TOLD) for word in reply.unplaced) or "nothing in particular"
    note = (
        "# What a simpler reader made of the instruction\n"
        f"Understood: {placed}\nNot understood: {words}\n"
        "It may be wrong. Write one policy for the whole instruction.\n"
    )
    return replace(prompt, situation=f"{prompt.situation.rstrip()}\n{note}")


def writer_named(name: str = "auto", *, base_url: str | None = None, temperature: float = 0.1) -> PolicyWriter:
    """Return the writer of that name.

    Args:
        name: "auto" (the built-in writer, and where it did not understand every clause the model named by OVITA_MODEL,
            else a local model that is present), "builtin", "llamacpp:FILE.gguf" or "llamacpp:NAME", "PROVIDER:MODEL"
            with provider openai, anthropic, google or ollama, or several of them in line, with commas.
        base_url: Address of an OpenAI-compatible server; then `name` is that server's model.
        temperature: Sampling temperature of a model.

    Raises:
        RequestError: If the name is none of these, or the temperature is not between 0 and 2.
        MissingExtra: If the model's packages are not installed.
    """
    if not 0.0 <= temperature <= 2.0:
        raise RequestError(f"the temperature {temperature:g} is out of range; use 0 to 2")
    if name == "auto" and base_url is None:
        return Line(_auto(temperature), "auto")
    names = [part.strip() for part in name.split(",")]
    writers = [_Chosen(_one(part, base_url, temperature), "asked for by name") for part in names]
    return writers[0] if len(writers) == 1 else Line(tuple(writers), ",".join(names))


def _auto(temperature: float) -> tuple[PolicyWriter, ...]:
    """The built-in writer first, then the configured models, or else a local model that is present."""
    from ovita.language.models import default_model

    configured = os.environ.get(MODEL_VARIABLE, "").strip()
    present = "" if configured else default_model()
    if configured:
        reason = f"{MODEL_VARIABLE} names it, for what the built-in writer does not understand"
    elif present:
        reason = "a local model that is present, for what the built-in writer does not understand"
    else:
        reason = f"no model is configured ({MODEL_VARIABLE} is not set) and no local one is present (ovita models)"
    names = [part.strip() for part in (configured or present).split(",") if part.strip()]
    models = [_Chosen(_one(part, None, temperature), reason) for part in names if part != "builtin"]
    builtin = _one("builtin", None, temperature)
    if not models:
        return (_Chosen(builtin, reason),)
    return (_Chosen(builtin, "it understood every clause", "no model had a better answer"), *models)


def _one(name: str, base_url: str | None, temperature: float) -> PolicyWriter:
    if name == "builtin":
        from ovita.language.builtin import BuiltinWriter

        return BuiltinWriter()
    provider, _, model = name.partition(":")
    if base_url is None and (provider not in PROVIDERS or not model):
        raise RequestError(
            f"unknown writer {name!r}; use auto, builtin, llamacpp:FILE.gguf, or PROVIDER:MODEL with provider"
            f" {', '.join(PROVIDERS[1:])} (or --base-url for an OpenAI-compatible server), with commas for several"
        )
    if base_url is None and provider == "llamacpp":
        from ovita.language.local import LocalWriter

        return LocalWriter(model, temperature=temperature)
    from ovita.language.llm import LLMWriter

    return LLMWriter(name, base_url=base_url, temperature=temperature)
