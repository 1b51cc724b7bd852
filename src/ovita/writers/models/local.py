"""The writer that runs a small language model inside this process: no server, no key, no network."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cache
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path

from ovita.errors import MissingExtra, RequestError, WriterError
from ovita.writers.models.catalogue import model_file, models_dir
from ovita.writers.models.conversation import ModelWriter
from ovita.writers.models.engine import CONTEXT, Beat, Generated, Heartbeat, check_file, engine_for
from ovita.writers.models.exchange import Ask, Heard, form_note
from ovita.writers.progress import Watch

TOLD_EVERY = 0.2
"""Least time between two lines of progress [s]."""


class LocalWriter(ModelWriter):
    """A GGUF model in this process as a policy writer.

    The model is loaded and reads the rules when it is first asked; both are kept for the next time, the latter in a
    file, so that it also holds for the next process. Neither counts as time for writing.

    Args:
        model: A GGUF file, or the name of a model that `ovita models list` shows.
        temperature: Sampling temperature; with 0, equal requests give equal answers.
        max_tokens: Longest answer [tokens].
        context: How much is read and written at most in one exchange [tokens].
        threads: Processor cores to use; None leaves that to llama.cpp.

    Attributes:
        ready_seconds: Time that loading the model and reading the rules took so far [s].
        last: What the model last wrote, and what it took, or None.

    Raises:
        RequestError: If there is no such model, or an option cannot be used.
        MissingExtra: If xllamacpp is not installed.
    """

    def __init__(
        self,
        model: str,
        *,
        temperature: float = 0.1,
        max_tokens: int = 1200,
        context: int = CONTEXT,
        threads: int | None = None,
    ) -> None:
        if not 0.0 <= temperature <= 2.0:
            raise RequestError(f"the temperature {temperature:g} is out of range; use 0 to 2")
        if max_tokens < 1 or context < 512:
            raise RequestError("max_tokens must be 1 or more and context 512 or more")
        super().__init__(f"llamacpp:{model}", "text", temperature, max_tokens)
        self._path, self._context, self._threads = model_file(model), context, threads
        check_file(self._path)
        if find_spec("xllamacpp") is None:
            raise MissingExtra("xllamacpp", "local")
        self._asked = ""
        self.ready_seconds = 0.0
        self.last: Generated | None = None

    @property
    def path(self) -> Path:
        """The model's file."""
        return self._path

    def hear(self, ask: Ask, watch: Watch) -> Heard:
        """Put a question to the model and return what it answered, whatever that is.

        Raises:
            WriterError: If nothing was answered, also because the watch is over.
        """
        ended = False

        def stop() -> None:
            nonlocal ended
            ended = True

        def work() -> Generated | None:
            return self._generate(ask, watch, lambda: ended)

        try:
            generated = watch.wait_for(work, stop, float("inf"))
        except WriterError as error:
            raise WriterError(f"{self.name}: {error}") from error
        if generated is None or generated.stopped:
            late = "no answer in the time that was left; allow more with --time-limit, or use a smaller model"
            raise WriterError(f"{self.name}: {'stopped on request' if watch.cancelled else late}")
        self.last = generated
        return Heard(
            ask=ask,
            model=self._path.stem,
            text=generated.text,
            arguments=None,
            truncated=generated.truncated,
            refusal=None,
            input_tokens=generated.input_tokens,
            output_tokens=generated.output_tokens,
        )

    def _generate(self, ask: Ask, watch: Watch, ended: Callable[[], bool]) -> Generated | None:
        rules = "\n".join(part.rstrip() for part in (ask.instructions, form_note(ask.form) if ask.structured else ""))
        roles = ("user", "assistant")
        messages = [{"role": "system", "content": rules}]
        messages += [{"role": roles[i % 2], "content": turn} for i, turn in enumerate(ask.turns)]
        started = time.monotonic()
        with watch.pause():
            watch.say(f"{self._path.stem} gets ready")
            engine = engine_for(self._path, models_dir() / "states", context=self._context, threads=self._threads)
            if ask.structured and not self._goes_on(ask):
                engine.read_once(rules, self._beat(watch, ended, "the rules, only this once"))
        self.ready_seconds += time.monotonic() - started
        if ended():
            return None
        # The paper's prompt asks for scripts, which the grammar of functions would rule out.
        held = ask.structured and "def adapt(" in ask.instructions
        return engine.chat(
            messages,
            self._beat(watch, ended, "the request"),
            max_tokens=self._max_tokens if ask.structured else ask.max_tokens,
            temperature=ask.temperature,
            grammar=_grammar(repair=len(ask.turns) > 1) if held else "",
        )

    def _goes_on(self, ask: Ask) -> bool:
        """Whether this is a repair, for which the model goes on from where it stands, with the request still known."""
        before, self._asked = self._asked, ask.turns[0]
        return len(ask.turns) > 1 or (before != "" and before != ask.turns[0] and ask.turns[0].startswith(before))

    def _beat(self, watch: Watch, ended: Callable[[], bool], what: str) -> Beat:
        """Look on while the model works: tell what it does, and say whether it must stop."""
        told = 0.0

        def beat(now: Heartbeat) -> bool:
            nonlocal told
            if time.monotonic() - told > TOLD_EVERY:
                told = time.monotonic()
                who = self._path.stem
                if now.doing == "reads":
                    share = 100 * now.tokens // max(1, now.total)
                    watch.say(f"{who} reads {what}: {share} %, {now.seconds:.0f} s")
                else:
                    rate = now.tokens / now.seconds if now.seconds else 0.0
                    watch.say(f"{who} writes: {now.tokens} tokens, {rate:.0f} tokens/s, {now.seconds:.1f} s")
            return ended()

        return beat


@cache
def _grammar(*, repair: bool) -> str:
    """The grammar that holds answers to the form of the examples; small models give up on a repair too easily."""
    text = (files("ovita.writers") / "prompts" / "answer.gbnf").read_text(encoding="utf-8")
    return text.replace("root ::= answer | refusal", "root ::= answer") if repair else text
