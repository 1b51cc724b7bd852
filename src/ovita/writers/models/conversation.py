"""A chat model as a policy writer: the turns that it is shown, and reading its reply, wherever the model runs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace

from ovita.errors import UnusableReply, WriterError
from ovita.writers.base import Reply, WriterInfo
from ovita.writers.models.answer import Answer, answer_from, read_answer
from ovita.writers.models.exchange import Ask, Form, Heard
from ovita.writers.progress import Watch
from ovita.writers.prompt import Prompt
from ovita.writers.safe_text import harmless


class ModelWriter(ABC):
    """A chat model as a policy writer.

    Args:
        name: As on the command line, such as "openai:gpt-5".
        form: How answers are asked for at first.
        temperature: Sampling temperature.
        max_tokens: Longest answer [tokens].
    """

    def __init__(self, name: str, form: Form, temperature: float, max_tokens: int) -> None:
        self._name, self._form, self._temperature, self._max_tokens = name, form, temperature, max_tokens

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._name!r})"

    @property
    def name(self) -> str:
        """The writer as it was named, such as "openai:gpt-5"."""
        return self._name

    @abstractmethod
    def hear(self, ask: Ask, watch: Watch) -> Heard:
        """Put a question to the model and return what it answered, whatever that is.

        Raises:
            WriterError: If nothing was answered, also because the watch is over.
        """

    def write(self, prompt: Prompt) -> Reply:
        """Answer a prompt; earlier attempts are shown to the model as its own, each with its error.

        Raises:
            MissingKey: If the provider needs a key and none is set; nothing was sent.
            UnusableReply: If the answer is empty, cut off, or has neither a policy nor a question.
            WriterError: If no answer could be had.
        """
        turns = [prompt.situation]
        for attempt in prompt.attempts:
            error = harmless(attempt.error)
            if attempt.code.strip():
                turns.append(f"```python\n{attempt.code.strip()}\n```")
                turns.append(f"Your policy failed: {error}\nAnswer again with the whole corrected policy.")
            else:
                turns[-1] += f"\nYour last answer could not be used: {error}"
        ask = Ask(prompt.fixed, tuple(turns), self._form, True, self._temperature, self._max_tokens)
        heard = self.hear(ask, prompt.watch)
        info = WriterInfo("llm", heard.model, heard.ask.temperature, heard.input_tokens, heard.output_tokens)
        answer = None if heard.refusal is not None else _read(heard)
        reply = answer.reply(info) if answer is not None else None
        if reply is None:
            raise self._unusable(heard)
        scene = prompt.request.scene
        return replace(reply, contacts=tuple(name for name in reply.contacts if name in scene))

    def complete(
        self, instructions: str, question: str, *, temperature: float, max_tokens: int, watch: Watch | None = None
    ) -> str:
        """Return the model's plain-text answer to one question.

        Raises:
            MissingKey: If the provider needs a key and none is set.
            WriterError: If no complete answer could be had.
        """
        heard = self.hear(Ask(instructions, (question,), "text", False, temperature, max_tokens), watch or Watch())
        if heard.text.strip() and not heard.truncated and heard.refusal is None:
            return heard.text.strip()
        raise self._unusable(heard)

    def shown(self, text: str) -> str:
        """Return what a model said as it may be shown to a person: on one line, shortened."""
        line = " ".join(text.split())
        return line if len(line) <= 200 else line[:197] + "..."

    def _unusable(self, heard: Heard) -> WriterError:
        if heard.refusal is not None:
            said = self.shown(heard.refusal)
            why = f"the model refused to answer{f' ({said})' if said else ''}; rephrase the instruction"
            return WriterError(f"{self._name}: {why}")
        if heard.truncated:
            why = f"the answer was cut off after {heard.output_tokens} tokens; raise max_tokens or use another model"
        elif not heard.text.strip():
            why = "the model gave an empty answer; try again or use another model"
        else:
            said = self.shown(heard.text)
            why = f"the answer has neither a policy nor a question; try again or use another model (it began: {said!r})"
        return UnusableReply(f"{self._name}: {why}")


def _read(heard: Heard) -> Answer | None:
    if heard.arguments is not None and not heard.truncated:
        answer = answer_from(heard.arguments)
        if answer is not None and answer.reply(WriterInfo("")) is not None:
            return answer
    return read_answer(heard.text, truncated=heard.truncated)
