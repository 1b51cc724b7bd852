"""Writers around writers: one that records every reply, and one that answers from a record."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib import import_module
from typing import Any

from pydantic import TypeAdapter, ValidationError

from ovita.bench.conditions import Condition
from ovita.errors import RequestError, UnusableReply, WriterError, WriterFailure
from ovita.writers.base import PolicyWriter, Reply, writer_named
from ovita.writers.prompt import Prompt

PAUSE = 5.0
"""Pause before a request that failed in transport is sent again; it doubles with each one [s]."""


class Limiter:
    """Spaces requests evenly; safe to share between threads.

    Args:
        per_minute: Most requests in a minute, or None for no limit.
    """

    def __init__(self, per_minute: float | None = None) -> None:
        self._gap = 60.0 / per_minute if per_minute else 0.0
        self._next = 0.0
        self._lock = threading.Lock()

    def wait(self) -> None:
        """Sleep until the next request may be sent."""
        if not self._gap:
            return
        with self._lock:
            now = time.monotonic()
            turn = max(now, self._next)
            self._next = turn + self._gap
        time.sleep(max(0.0, turn - now))


class RecordingWriter:
    """A writer that delegates to another and records every reply and failure.

    It has no explanations of its own, so that a benchmark never pays for them: the template explains.

    Args:
        inner: The writer to delegate to.
        condition: What is left out of its prompts.
        limiter: Rate limiter for its requests.
        retries: How often a request that failed in transport is sent again.
        pause: Before the first such retry [s].
    """

    def __init__(
        self,
        inner: PolicyWriter,
        condition: Condition,
        limiter: Limiter | None = None,
        *,
        retries: int = 2,
        pause: float = PAUSE,
    ) -> None:
        self._inner, self._condition, self._limiter = inner, condition, limiter or Limiter()
        self._retries, self._pause = retries, pause
        self.replies: list[dict[str, Any]] = []
        self.waited = 0.0

    @property
    def name(self) -> str:
        """As the inner writer is named."""
        return self._inner.name

    def write(self, prompt: Prompt) -> Reply:
        """Answer as the inner writer does.

        Raises:
            WriterError: As the inner writer does, once no retry is left.
        """
        prompt = self._condition.rewrite(prompt)
        for tries in range(self._retries + 1):
            started = time.perf_counter()
            self._limiter.wait()
            self.waited += time.perf_counter() - started
            asked = time.perf_counter()
            try:
                reply = self._inner.write(prompt)
            except WriterError as error:
                if tries < self._retries and error.passing:
                    time.sleep(self._pause * 2**tries)
                    self.waited += time.perf_counter() - asked
                    continue
                again = {"again": True} if isinstance(error, UnusableReply) else {}
                self.replies.append({"error": str(error), "unreached": error.unreached, **again})
                raise
            self.replies.append({"reply": json.loads(json.dumps(asdict(reply)))})
            return reply
        raise AssertionError("unreachable")


class ReplayingWriter:
    """Answers with recorded replies, in their order.

    Args:
        name: Of the writer that gave them.
        replies: As `RecordingWriter.replies` holds them.
    """

    def __init__(self, name: str, replies: Sequence[Mapping[str, Any]]) -> None:
        self._name, self._left = name, list(replies)
        self.replies: list[dict[str, Any]] = []
        self.waited = 0.0

    @property
    def name(self) -> str:
        """The recorded writer's name."""
        return self._name

    def write(self, prompt: Prompt) -> Reply:
        """Give the next recorded reply.

        Raises:
            WriterError: If that was a failure, or there is none left.
        """
        if not self._left:
            message = f"{self._name}: the record holds no further reply; run it again without --replay"
            self.replies.append({"error": message, "unreached": False})
            raise WriterError(message)
        kept = dict(self._left.pop(0))
        self.replies.append(kept)
        if "reply" not in kept:
            failure: WriterFailure = "no_answer" if kept.get("unreached") else "other"
            raise (UnusableReply if kept.get("again") else WriterError)(str(kept.get("error", "")), failure)
        try:
            return TypeAdapter(Reply).validate_python(kept["reply"])
        except ValidationError:
            raise WriterError(f"{self._name}: the recorded reply cannot be read; run it again") from None


def open_writer(name: str, *, base_url: str | None = None, temperature: float = 0.1) -> PolicyWriter:
    """The writer of that name; "python:MODULE:NAME" calls NAME of an importable module to make one.

    Raises:
        RequestError: If there is no such writer.
        MissingExtra: If its packages are not installed.
    """
    if not name.startswith("python:"):
        return writer_named(name, base_url=None if name == "builtin" else base_url, temperature=temperature)
    _, _, rest = name.partition(":")
    module, _, attribute = rest.partition(":")
    try:
        made = getattr(import_module(module), attribute)()
    except (ImportError, AttributeError, ValueError, TypeError) as error:
        raise RequestError(f"{name!r} makes no writer: {error}; write python:MODULE:CLASS") from None
    if not isinstance(made, PolicyWriter):
        raise RequestError(f"{name!r} makes no writer: it needs a name and a method write(prompt)")
    return made
