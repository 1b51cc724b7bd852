"""The systems that a benchmark measures: opened by name, recorded as they answer, and answering again from a record."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter, ValidationError

from ovita.baselines import Baseline, Deformed, baseline_named, is_baseline
from ovita.baselines.catalogue import NAMES, brought
from ovita.baselines.command import TIMEOUT
from ovita.errors import OvitaError, RequestError, TrajectoryError, UnusableReply, WriterError
from ovita.io import trajectory_rows
from ovita.io.waypoints import trajectory_from_rows
from ovita.request import Request
from ovita.writers.base import MODEL_VARIABLE, PolicyWriter, Prompt, Reply, configured_model, writer_named

if TYPE_CHECKING:
    from ovita.bench.evaluate import Condition

PAUSE = 5.0
"""Pause before a request that failed in transport is sent again; it doubles with each one [s]."""


class Limiter:
    """Spaces requests evenly, `per_minute` at most; safe to share between threads. None sets no limit."""

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
        condition: What is left out of its prompts.
        retries: How often a request that failed in transport is sent again.
    """

    def __init__(self, inner: PolicyWriter, condition: Condition, limiter: Limiter | None, retries: int) -> None:
        self._inner, self._condition, self._limiter = inner, condition, limiter or Limiter()
        self._retries, self.name = retries, inner.name
        self.replies: list[dict[str, Any]] = []
        self.waited = 0.0

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
                    time.sleep(PAUSE * 2**tries)
                    self.waited += time.perf_counter() - asked
                    continue
                again = {"again": True} if isinstance(error, UnusableReply) else {}
                self.replies.append({"error": str(error), "unreached": error.unreached, **again})
                raise
            self.replies.append({"reply": json.loads(json.dumps(asdict(reply)))})
            return reply
        raise AssertionError("unreachable")


class RecordingBaseline:
    """A baseline that delegates to another and records every answer and failure."""

    def __init__(self, inner: Baseline) -> None:
        self._inner = inner
        self.name, self.keeps_limits = inner.name, inner.keeps_limits
        self.replies: list[dict[str, Any]] = []
        self.waited = 0.0

    def deform(self, request: Request) -> Deformed:
        """Answer as the inner baseline does.

        Raises:
            WriterError: As the inner baseline does.
        """
        limits = {"keeps_limits": self.keeps_limits}
        try:
            answer = self._inner.deform(request)
        except WriterError as error:
            self.replies.append({"error": str(error), "unreached": error.unreached, **limits})
            raise
        said = {"matched": answer.matched, "similarity": answer.similarity}
        self.replies.append({"trajectory": trajectory_rows(answer.trajectory), **said, **limits})
        return answer


class ReplayingSystem:
    """Answers as the system of that name did, with replies as `recording` left them, in their order."""

    def __init__(self, name: str, replies: Sequence[Mapping[str, Any]]) -> None:
        self.name, self._left = name, list(replies)
        self.keeps_limits = any(reply.get("keeps_limits") for reply in replies)
        self.replies: list[dict[str, Any]] = []
        self.waited = 0.0

    def write(self, prompt: Prompt) -> Reply:
        """Give the next recorded reply of a writer.

        Raises:
            WriterError: If that was a failure, or there is none left.
        """
        try:
            return TypeAdapter(Reply).validate_python(self._next()["reply"])
        except ValidationError:
            raise WriterError(f"{self.name}: the recorded reply cannot be read; run it again") from None

    def deform(self, request: Request) -> Deformed:
        """Give the next recorded answer of a baseline.

        Raises:
            WriterError: If that was a failure, or there is none left.
        """
        kept = self._next()
        try:
            path = trajectory_from_rows(kept.get("trajectory"), timestep=request.trajectory.timestep)
        except TrajectoryError:
            raise WriterError(f"{self.name}: the recorded answer cannot be read; run it again") from None
        return Deformed(path, kept.get("matched", ""), kept.get("similarity"))

    def _next(self) -> dict[str, Any]:
        none = f"{self.name}: the record holds no further answer; run it again without --replay"
        kept = dict(self._left.pop(0)) if self._left else {"error": none, "unreached": False}
        self.replies.append(kept)
        if "error" in kept:
            failure = UnusableReply if kept.get("again") else WriterError
            raise failure(str(kept["error"]), "no_answer" if kept.get("unreached") else "other")
        return kept


Answering = RecordingWriter | RecordingBaseline | ReplayingSystem


def recording(system: System, condition: Condition, limiter: Limiter | None = None, *, retries: int = 2) -> Answering:
    """A system that records its answers."""
    if isinstance(system, Baseline):
        return RecordingBaseline(system)
    return RecordingWriter(system, condition, limiter, retries)


def open_writer(name: str, *, base_url: str | None = None, temperature: float = 0.1) -> PolicyWriter:
    """The writer of that name; "python:MODULE:NAME" calls NAME of an importable module to make one.

    Raises:
        RequestError: If there is no such writer.
        MissingExtra: If its packages are not installed.
    """
    if not name.startswith("python:"):
        return writer_named(name, base_url=None if name == "builtin" else base_url, temperature=temperature)
    module, _, attribute = name.removeprefix("python:").partition(":")
    try:
        made = getattr(import_module(module), attribute)()
    except (ImportError, AttributeError, ValueError, TypeError) as error:
        raise RequestError(f"{name!r} makes no writer: {error}; write python:MODULE:CLASS") from None
    if not isinstance(made, PolicyWriter):
        raise RequestError(f"{name!r} makes no writer: it needs a name and a method write(prompt)")
    return made


System = PolicyWriter | Baseline
"""What a benchmark measures."""


def open_system(
    name: str, *, base_url: str | None = None, temperature: float = 0.1, timeout: float = TIMEOUT
) -> System:
    """The writer or baseline of that name; the timeout [s] is that of a command.

    Raises:
        RequestError: If there is no such system.
        MissingExtra: If its packages are not installed.
    """
    if is_baseline(name):
        return baseline_named(name, timeout=timeout)
    return open_writer(name, base_url=base_url, temperature=temperature)


def is_local(name: str) -> bool:
    """Whether a system answers in this process, without a server or a program, and the same every time."""
    return name == "builtin" or brought(name)


EVERYTHING = "all"
"""The name that stands for every system that can run here."""


@dataclass(frozen=True)
class SystemsHere:
    """Systems that can run here by name, and why others cannot."""

    names: tuple[str, ...]
    missing: Mapping[str, str]


def systems_here() -> SystemsHere:
    """The built-in writer, the configured or local model, and every baseline that ovita brings."""
    names, missing = ["builtin"], {}
    model = [name for name in configured_model() if name][:1]
    if not model:
        missing["a language model"] = f"{MODEL_VARIABLE} is not set, and no local model is present (ovita models)"
    for name in (*model, *NAMES):
        try:
            (baseline_named if name in NAMES else writer_named)(name)
        except OvitaError as error:
            missing[name] = str(error)
        else:
            names.append(name)
    return SystemsHere(tuple(dict.fromkeys(names)), missing)
