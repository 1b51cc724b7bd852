"""Deadline, cancellation and progress reports while a policy is being written."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from threading import Event, Thread
from typing import TypeVar

T = TypeVar("T")

Progress = Callable[[str], None]
"""Called with one short line, such as "llamacpp:qwen writes: 40 tokens"; it may be called from another thread."""


@dataclass
class WritingBudget:
    """Deadline, cancellation and progress.

    Args:
        progress: Called with each progress line, or None.
        cancel: Once it is set, writers stop as soon as they can; None never stops them.
        deadline: When the time for writing is over, on the clock of `time.monotonic` [s].
    """

    progress: Progress | None = None
    cancel: Event | None = None
    deadline: float = math.inf
    _paused: bool = field(default=False, init=False)

    @classmethod
    def lasting(
        cls, seconds: float | None, progress: Progress | None = None, cancel: Event | None = None
    ) -> WritingBudget:
        """Return a budget with a deadline in so many seconds; None for no deadline."""
        return cls(progress, cancel, math.inf if seconds is None else time.monotonic() + seconds)

    def say(self, text: str) -> None:
        """Report progress."""
        if self.progress is not None:
            self.progress(text)

    @property
    def cancelled(self) -> bool:
        """Whether writing was cancelled."""
        return self.cancel is not None and self.cancel.is_set()

    @property
    def left(self) -> float:
        """Seconds until the time for writing is over, at least 0."""
        return max(0.0, self.deadline - time.monotonic())

    @contextmanager
    def pause(self) -> Iterator[None]:
        """Stop the clock during one-time preparation: extend the deadline by the time spent in this context."""
        started = time.monotonic()
        self._paused = True
        try:
            yield
        finally:
            self.deadline += time.monotonic() - started
            self._paused = False

    def over(self) -> str:
        """Return why writing must end now, or ""."""
        if self.cancelled:
            return "stopped on request"
        return "" if self.left > 0.0 else "no time was left"

    def wait_for(self, work: Callable[[], T], stop: Callable[[], None], seconds: float, waiting: str = "") -> T | None:
        """Run `work` in its own thread until it returns, the time is up or writing is cancelled.

        Args:
            work: Runs to its end, or until `stop` was called.
            stop: Makes `work` end soon; called from another thread.
            seconds: Longest wait [s].
            waiting: Progress text reported each second with the elapsed time; "" for none.

        Returns:
            What `work` returned, or None if it was stopped.
        """
        outcome: Future[T] = Future()

        def run() -> None:
            try:
                outcome.set_result(work())
            except BaseException as error:
                outcome.set_exception(error)

        started = time.monotonic()
        Thread(target=run, name="ovita-writer", daemon=True).start()
        said = 0
        try:
            while not wait([outcome], timeout=0.05).done:
                now = time.monotonic()
                if self.cancelled or (now >= min(started + seconds, self.deadline) and not self._paused):
                    stop()
                    return None
                if waiting and int(now - started) > said:
                    said = int(now - started)
                    self.say(f"{waiting}, {said} s")
        except KeyboardInterrupt:
            stop()
            wait([outcome], timeout=2.0)
            raise
        return outcome.result()
