"""The writer that runs a small language model inside this process, by llama.cpp: no server, no key, no network.

Reading the rules of a prompt takes a small model a minute on a plain processor, and writing a policy a few seconds.
Since the rules are the same for every request, the model's state after them is kept in a file and put back before each
request. That also makes equal requests give equal answers: they always go on from the very same state.
"""

from __future__ import annotations

import atexit
import hashlib
import json
import os
import secrets
import time
import urllib.request
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from threading import Event, Lock, RLock
from typing import Any
from weakref import WeakSet

from ovita.errors import MissingExtra, RequestError, WriterError
from ovita.writers.base import WritingBudget
from ovita.writers.models.catalogue import check_file, model_file, models_dir
from ovita.writers.models.exchange import LARGE_FROM, Exchange, ModelRequest, ModelWriter, billions

CONTEXT = 12288
"""How much a model reads and writes at most in one exchange [tokens]."""

BATCH = 128
"""How much is read between two looks at whether to stop [tokens]."""

KEPT_STATES = 4
"""How many states are kept in files; the oldest goes first."""

Message = Mapping[str, str]


@dataclass(frozen=True)
class Generated:
    """A generated text, whether it was cut off by `max_tokens` or the context, or stopped on the way, and what it took.

    Counts are in tokens, of which `cached_tokens` of the prompt had been read before; times in seconds.
    """

    text: str
    truncated: bool
    stopped: bool
    input_tokens: int
    cached_tokens: int
    output_tokens: int
    read_seconds: float
    write_seconds: float


Beat = Callable[[str], bool]
"""Called at least with every token, with how far the model is in words; it returns True to stop."""


class Engine:
    """A model, loaded; use `engine_for`, which loads each one once. One request at a time is answered.

    Args:
        path: The GGUF file.
        states: Folder for states, made when needed; None keeps them in memory only.
        context: How much is read and written at most in one exchange [tokens].
        threads: Processor cores to use; None leaves that to llama.cpp.

    Raises:
        WriterError: If the file cannot be loaded.
    """

    def __init__(self, path: Path, states: Path | None, *, context: int = CONTEXT, threads: int | None = None) -> None:
        import xllamacpp

        self._path, self._states, self._context = path, states, context
        self._key = secrets.token_hex(16)
        self._lock = RLock()
        parameters = xllamacpp.CommonParams()
        parameters.model.path = str(path)
        parameters.n_ctx = context
        parameters.n_batch = parameters.n_ubatch = BATCH
        parameters.n_parallel = 1
        if threads is not None:
            parameters.cpuparams.n_threads = parameters.cpuparams_batch.n_threads = threads
        parameters.cache_ram_mib = 0
        parameters.verbosity = 0
        parameters.ui = False
        # llama.cpp also listens on a port of this machine; nobody but this object knows the key.
        parameters.hostnames = ["127.0.0.1"]
        parameters.api_keys = [self._key]
        if states is not None:
            try:
                states.mkdir(parents=True, exist_ok=True)
                parameters.slot_save_path = f"{states}{os.sep}"
            except OSError:
                self._states = None
        try:
            self._server = xllamacpp.Server(parameters)
        except Exception as error:
            raise WriterError(
                f"{path.name} cannot be loaded: it is damaged, of an unknown kind, or there is too little memory"
            ) from error
        self._version = xllamacpp.__version__
        _alive.add(self)

    def close(self) -> None:
        """Wait until the last request has ended, and let go of the model."""
        with self._lock:
            del self._server

    def read_once(self, rules: str, beat: Beat) -> None:
        """Fill the KV cache with the rules, the part of the prompt that never changes, or with the saved cache."""
        with self._lock:
            state = self._state(rules)
            if state is not None and state.exists() and self._slot("restore", state.name):
                state.touch()
                return
            messages = [{"role": "system", "content": rules}, {"role": "user", "content": "."}]
            read = self.chat(messages, beat, "the rules, only this once", max_tokens=1, temperature=0.0)
            if state is not None and not read.stopped:
                self._save(state)

    def chat(
        self,
        messages: Sequence[Message],
        beat: Beat,
        what: str = "the request",
        *,
        max_tokens: int,
        temperature: float | None,
        grammar: str = "",
    ) -> Generated:
        """Answer a conversation.

        Args:
            messages: Each with a role and a content.
            beat: Called with the progress.
            what: What the model reads, for the progress.
            max_tokens: Longest answer [tokens].
            temperature: Sampling temperature; 0 always takes the likeliest token.
            grammar: GBNF grammar that the answer is held to; "" leaves it free.

        Raises:
            WriterError: If the messages are longer than the context, or the model failed.
        """
        body: dict[str, Any] = {
            "messages": [dict(message) for message in messages],
            "max_tokens": max_tokens,
            "seed": 1,
            "stream": True,
            "cache_prompt": True,
            "timings_per_token": True,
            "return_progress": True,
            "chat_template_kwargs": {"enable_thinking": False},
        }
        if temperature is not None:
            body["temperature"] = temperature
        if grammar:
            body["grammar"] = grammar
        stream = _Stream(beat, what)
        with self._lock:
            failure = self._server.handle_chat_completions(body, stream)
        error = (failure or {}).get("error") or stream.error
        if error:
            if error.get("type") == "exceed_context_size_error":
                raise WriterError(
                    f"the prompt has {error.get('n_prompt_tokens')} tokens, and it reads at most {self._context}"
                    " here; shorten the instruction or the scene's text, or use another writer"
                )
            raise WriterError(f"the model failed: {' '.join(str(error.get('message', error)).split())[:200]}")
        return stream.result()

    def _state(self, rules: str) -> Path | None:
        """The saved KV cache for these rules, or None if none can be kept."""
        if self._states is None:
            return None
        about = self._path.stat()
        key = f"{self._path.resolve()} {about.st_size} {about.st_mtime_ns} {self._context} {BATCH} {self._version}"
        return self._states / f"{hashlib.sha256(f'{key} {rules}'.encode()).hexdigest()[:24]}.state"

    def _save(self, state: Path) -> None:
        partial = state.with_name(f"{state.name}.{os.getpid()}")
        try:
            if self._slot("save", partial.name):
                partial.replace(state)
            kept = sorted(state.parent.glob("*.state"), key=lambda file: file.stat().st_mtime)
            for old in kept[:-KEPT_STATES]:
                old.unlink(missing_ok=True)
        except OSError:
            partial.unlink(missing_ok=True)

    def _slot(self, action: str, name: str) -> bool:
        request = urllib.request.Request(
            f"{self._server.listening_address}/slots/0?action={action}",
            data=json.dumps({"filename": name}).encode(),
            headers={"Content-Type": "application/json", "Authorization": f"Bearer {self._key}"},
        )
        direct = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        try:
            with direct.open(request, timeout=60.0) as answer:
                return bool(answer.status == 200)
        except OSError:
            return False


class _Stream:
    """Collects a model's output chunk by chunk."""

    def __init__(self, beat: Beat, what: str) -> None:
        self._beat, self._what, self._started = beat, what, time.monotonic()
        self._reading = True
        self._text: list[str] = []
        self._finish, self._stopped = "", False
        self._timings: dict[str, float] = {}
        self.error: dict[str, Any] = {}

    def __call__(self, chunk: dict[str, Any]) -> bool:
        if "error" in chunk:
            self.error = chunk["error"]
            return True
        self._timings = chunk.get("timings") or self._timings
        progress = chunk.get("prompt_progress")
        for choice in chunk.get("choices", ()):
            self._text.append(choice["delta"].get("content") or "")
            self._finish = choice.get("finish_reason") or self._finish
        if bool(progress) != self._reading:
            self._reading, self._started = bool(progress), time.monotonic()
        seconds = time.monotonic() - self._started
        if progress:
            share = 100 * int(progress["processed"]) // max(1, int(progress["total"]))
            said = f"reads {self._what}: {share} %, {seconds:.0f} s"
        else:
            tokens = int(self._timings.get("predicted_n", 0))
            said = f"writes: {tokens} tokens, {tokens / seconds if seconds else 0.0:.0f} tokens/s, {seconds:.1f} s"
        self._stopped = self._beat(said) or _closing.is_set()
        return self._stopped

    def result(self) -> Generated:
        t = self._timings
        cached = int(t.get("cache_n", 0))
        return Generated(
            "".join(self._text),
            self._finish == "length",
            self._stopped,
            cached + int(t.get("prompt_n", 0)),
            cached,
            int(t.get("predicted_n", 0)),
            t.get("prompt_ms", 0.0) / 1e3,
            t.get("predicted_ms", 0.0) / 1e3,
        )


_loaded: dict[tuple[Path, int, int | None], Engine] = {}
_loading = Lock()
_alive: WeakSet[Engine] = WeakSet()
_closing = Event()


@atexit.register
def _close() -> None:
    """Stop what still runs before Python ends: llama.cpp must not call back into a Python that is gone."""
    _closing.set()
    for engine in list(_alive):
        engine.close()


def engine_for(path: Path, states: Path | None, *, context: int = CONTEXT, threads: int | None = None) -> Engine:
    """Return the engine of a model, loaded at the first call; only the last one stays loaded.

    Raises:
        WriterError: If the file cannot be loaded.
    """
    with _loading:
        key = (path.resolve(), context, threads)
        if key not in _loaded:
            _loaded.clear()
            _loaded[key] = Engine(path, states, context=context, threads=threads)
        return _loaded[key]


TOLD_EVERY = 0.2
"""Least time between two lines of progress [s]."""


class LocalWriter(ModelWriter):
    """A GGUF model in this process as a policy writer.

    The model is loaded and reads the rules at the first request; both are kept for the next time, the latter in a
    file, so that it also holds for the next process. Neither counts as time for writing.

    Args:
        model: A GGUF file, or the name of a model that `ovita models list` shows.
        temperature: Sampling temperature; with 0, equal requests give equal answers.
        max_tokens: Longest answer [tokens].
        context: How much is read and written at most in one exchange [tokens].
        threads: Processor cores to use; None leaves that to llama.cpp.

    Attributes:
        path: The model's file.
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
        if max_tokens < 1 or context < 512:
            raise RequestError("max_tokens must be 1 or more and context 512 or more")
        super().__init__(f"llamacpp:{model}", "text", temperature, max_tokens)
        self._large = (billions(model) or 0.0) >= LARGE_FROM
        self.path, self._context, self._threads = model_file(model), context, threads
        check_file(self.path)
        if find_spec("xllamacpp") is None:
            raise MissingExtra("xllamacpp", "local")
        self._asked = ""
        self.ready_seconds = 0.0
        self.last: Generated | None = None

    def exchange(self, ask: ModelRequest, budget: WritingBudget) -> Exchange:
        """Send a request to the model and return its raw answer.

        Raises:
            WriterError: If there was no answer, for example because the time was up.
        """
        ended = Event()
        try:
            generated = budget.wait_for(lambda: self._generate(ask, budget, ended.is_set), ended.set, float("inf"))
        except WriterError as error:
            raise WriterError(f"{self.name}: {error}", error.failure) from error
        if generated is None or generated.stopped:
            late = "no answer in the time that was left; allow more with --time-limit, or use a smaller model"
            raise self._no_answer(late, budget)
        self.last = generated
        counts = generated.input_tokens, generated.output_tokens
        return Exchange(ask, self.path.stem, generated.text, None, generated.truncated, None, *counts)

    def _generate(self, ask: ModelRequest, budget: WritingBudget, ended: Callable[[], bool]) -> Generated | None:
        rules = ask.system
        roles = ("user", "assistant")
        messages = [{"role": "system", "content": rules}]
        messages += [{"role": roles[i % 2], "content": turn} for i, turn in enumerate(ask.turns)]
        started = time.monotonic()
        with budget.pause():
            budget.say(f"{self.path.stem} gets ready")
            engine = engine_for(self.path, models_dir() / "states", context=self._context, threads=self._threads)
            if ask.structured and not self._goes_on(ask):
                engine.read_once(rules, self._beat(budget, ended))
        self.ready_seconds += time.monotonic() - started
        if ended():
            return None
        # The paper's prompt asks for scripts, which the grammar of functions would rule out.
        held = ask.structured and ask.functions
        return engine.chat(
            messages,
            self._beat(budget, ended),
            max_tokens=self._max_tokens if ask.structured else ask.max_tokens,
            temperature=ask.temperature,
            grammar=_grammar(repair=len(ask.turns) > 1) if held else "",
        )

    def _goes_on(self, ask: ModelRequest) -> bool:
        """Whether this is a repair that can continue from the model's current KV cache."""
        before, self._asked = self._asked, ask.turns[0]
        return len(ask.turns) > 1 or (before != "" and before != ask.turns[0] and ask.turns[0].startswith(before))

    def _beat(self, budget: WritingBudget, ended: Callable[[], bool]) -> Beat:
        """A callback that reports progress and returns whether the model must stop."""
        told = 0.0

        def beat(said: str) -> bool:
            nonlocal told
            if time.monotonic() - told > TOLD_EVERY:
                told = time.monotonic()
                budget.say(f"{self.path.stem} {said}")
            return ended()

        return beat


@cache
def _grammar(*, repair: bool) -> str:
    """The grammar that constrains answers to the form of the examples; small models give up on repairs easily."""
    text = (files("ovita.writers") / "prompts" / "answer.gbnf").read_text(encoding="utf-8")
    return text.replace("root ::= answer | refusal", "root ::= answer") if repair else text
