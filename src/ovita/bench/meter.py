"""How far a run is, how long it will take, and what it may cost."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from ovita.bench.records import Log, Record


@dataclass(frozen=True)
class Standing:
    """How far a run is.

    Args:
        done: Records that there are, earlier ones of a resumed run included.
        total: Records that there will be.
        passed: Records that pass.
        left_s: Estimated time to the end [s], or None before the first record.
        tokens: Tokens of all records.
    """

    done: int
    total: int
    passed: int
    left_s: float | None
    tokens: int


Progress = Callable[[Standing], None]


@dataclass(frozen=True)
class Budget:
    """What a run may use up.

    Args:
        tokens: Of all writers together, or None.
        cost: Money, or None.
        prices: Writer to money for a million tokens read and written.
    """

    tokens: int | None = None
    cost: float | None = None
    prices: Mapping[str, tuple[float, float]] = field(default_factory=dict)


class Meter:
    """Counts records, estimates the time that is left, and watches the budget.

    Args:
        log: Of the run.
        wanted: Keys of the records that there will be.
        todo: How many of them are still to be made.
        budget: What may be used up.
        show: Called after each record.
    """

    def __init__(
        self, log: Log, wanted: set[tuple[str, str, str]], todo: int, budget: Budget, show: Progress | None
    ) -> None:
        self._budget, self._show, self._todo, self._new = budget, show, todo, 0
        there = [record for key, record in log.records.items() if key in wanted]
        self._total, self._done = len(wanted), len(wanted) - todo
        self._passed = sum(record.last.passed for record in there)
        self._tokens = sum(record.tokens for record in there)
        self._cost = sum(cost_of(record, budget.prices) for record in there)
        self._started = time.monotonic()
        self.notes: list[str] = []

    @property
    def spent(self) -> bool:
        """Whether a budget is used up; the first time that it is, a note says so."""
        tokens, cost = self._budget.tokens, self._budget.cost
        over = ""
        if tokens is not None and self._tokens >= tokens:
            over = f"The budget of {tokens} tokens is used up ({self._tokens})"
        elif cost is not None and self._cost >= cost:
            over = f"The budget of {cost:g} is used up ({self._cost:.4g})"
        if over and not self.notes and self._done < self._total:
            self.notes.append(f"{over}; {self._total - self._done} of {self._total} were not begun or not counted yet.")
        return bool(over)

    def count(self, record: Record) -> None:
        """Take a new record into account, and show how far the run is."""
        self._new += 1
        self._done += 1
        self._passed += record.last.passed
        self._tokens += record.tokens
        self._cost += cost_of(record, self._budget.prices)
        if self._show is not None:
            pace = (time.monotonic() - self._started) / self._new
            left = pace * (self._todo - self._new)
            self._show(Standing(self._done, self._total, self._passed, left, self._tokens))


def cost_of(record: Record, prices: Mapping[str, tuple[float, float]]) -> float:
    """Money that a record cost, by prices for a million tokens read and written."""
    read, written = prices.get(record.writer, (0.0, 0.0))
    return sum(item.input_tokens * read + item.output_tokens * written for item in record.rounds) / 1e6
