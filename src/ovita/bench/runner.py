"""Running a benchmark: every sample, writer and condition once, in parallel, resumable at any moment."""

from __future__ import annotations

import datetime
import os
import platform
import subprocess
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from itertools import product
from pathlib import Path
from typing import Any

import ovita
from ovita.baselines.command import TIMEOUT
from ovita.bench.dataset import Dataset, Sample
from ovita.bench.evaluate import DEFAULT, Condition, Protocol, evaluate, robot_for, waypoints
from ovita.bench.records import Record, RecordLog, ordered, read_manifest, read_records, write_manifest
from ovita.bench.systems import Limiter, ReplayingSystem, System, is_local, open_system, recording
from ovita.errors import RequestError
from ovita.workers import Engine, shared

UNREACHED = 5
"""A writer that could not be reached so many times in a row is not asked any further."""


@dataclass(frozen=True)
class Standing:
    """How far a run is: records there are, will be and pass, the time left [s] (None before the first), all tokens."""

    done: int
    total: int
    passed: int
    left_s: float | None
    tokens: int


Progress = Callable[[Standing], None]


@dataclass(frozen=True)
class RunPlan:
    """What is run.

    Args:
        writers: Names of writers and baselines, see `open_system`.
        base_url: An OpenAI-compatible server for the writers that are models.
        temperature: Of models, unless a condition says otherwise.
        jobs: Samples at a time.
        per_minute: Most requests a minute to each model, or None.
        retries: How often a request that failed in transport is sent again, beyond the writer's own retries.
        budget_tokens: No sample is begun once so many tokens were used, or None.
        prices: Writer to money for a million tokens read and written.
        budget_cost: No sample is begun once so much money was used, or None.
        timeout: Longest time for an answer of a command [s].
        engine: Who does local work: "processes", or "ray" on a machine or a cluster.
    """

    writers: tuple[str, ...] = ("builtin",)
    conditions: tuple[Condition, ...] = (DEFAULT,)
    protocol: Protocol = field(default_factory=Protocol)
    base_url: str | None = None
    temperature: float = 0.1
    jobs: int = 2
    per_minute: float | None = None
    retries: int = 2
    budget_tokens: int | None = None
    prices: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    budget_cost: float | None = None
    timeout: float = TIMEOUT
    engine: Engine = "processes"


class Meter:
    """Counts and shows new records, estimates the time that is left, and watches the budget."""

    def __init__(
        self, log: RecordLog, wanted: set[tuple[str, str, str]], todo: int, plan: RunPlan, show: Progress | None
    ) -> None:
        self._plan, self._show, self._todo, self._new = plan, show, todo, 0
        self._total, self._passed, self._tokens, self._cost = len(wanted), 0, 0, 0.0
        for key in log.records.keys() & wanted:
            self._add(log.records[key])
        self._started = time.monotonic()
        self.notes: list[str] = []

    @property
    def _done(self) -> int:
        return self._total - self._todo + self._new

    def _add(self, record: Record) -> None:
        self._passed += record.last.passed
        self._tokens += record.tokens
        self._cost += record.cost(self._plan.prices)

    @property
    def spent(self) -> bool:
        """Whether a budget is used up; the first time that it is, a note says so."""
        tokens, cost = self._plan.budget_tokens, self._plan.budget_cost
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
        self._add(record)
        if self._show is not None:
            pace = (time.monotonic() - self._started) / self._new
            left = pace * (self._todo - self._new)
            self._show(Standing(self._done, self._total, self._passed, left, self._tokens))


@dataclass(frozen=True)
class RunResult:
    """What a run came to: its records, its manifest, and why it ended early, each reason a sentence."""

    records: tuple[Record, ...]
    manifest: Mapping[str, Any]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Cell:
    sample: Sample
    writer: str
    condition: Condition
    recorded: Record | None = None

    @property
    def key(self) -> tuple[str, str, str]:
        return self.writer, self.condition.name, self.sample.id

    def system(self, plan: RunPlan) -> tuple[str, float]:
        """The system that is asked: its name and temperature."""
        own = self.condition.temperature
        return self.writer, plan.temperature if own is None else own


def run(
    dataset: Dataset,
    out: str | os.PathLike[str],
    plan: RunPlan,
    *,
    replay: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
) -> RunResult:
    """Run the samples missing in the folder, and return all records.

    A record is on disk before the next progress is shown, so that a run that was killed goes on where it was.
    Samples whose writer could not be reached are asked again.

    `replay` is the folder of an earlier run whose replies and times stand in for the writers; `progress` is called
    after each record.

    Raises:
        RequestError: If the folder holds another run, or a writer or option cannot be used.
        MissingExtra: If a writer's packages are not installed.
        IsolationUnavailable: If this machine cannot provide the requested isolation.
    """
    recorded = None
    if replay is not None:
        recorded = {r.key: r for r in read_records(replay)}
        dataset, plan = _restricted(dataset, plan, recorded)
    cells, notes = _cells(dataset, plan, recorded)
    with RecordLog(out) as log:
        manifest = _manifest(dataset, plan, read_manifest(out), read_manifest(replay) if replay is not None else {})
        write_manifest(out, manifest)
        wanted = {cell.key for cell in cells}
        todo = [cell for cell in cells if _open(log.records.get(cell.key), cell.sample)]
        meter = Meter(log, wanted, len(todo), plan, progress)
        if todo:
            notes += _work(todo, plan, log, meter, replaying=recorded is not None)
        ids = {sample.id for sample in dataset.samples}
        records = tuple(record for record in ordered(log.records.values()) if record.sample in ids)
    return RunResult(records, manifest, tuple(notes))


def _restricted(dataset: Dataset, plan: RunPlan, recorded: Collection[tuple[str, str, str]]) -> tuple[Dataset, RunPlan]:
    """The samples and the writers that there are records of."""
    there = {sample for _, _, sample in recorded}
    samples = tuple(sample for sample in dataset.samples if sample.id in there)
    writers = tuple(dict.fromkeys(writer for writer, _, _ in recorded))
    return replace(dataset, samples=samples), replace(plan, writers=writers)


def _cells(
    dataset: Dataset, plan: RunPlan, recorded: Mapping[tuple[str, str, str], Record] | None
) -> tuple[list[_Cell], list[str]]:
    for sample in dataset.samples:
        robot_for(sample, plan.protocol.robot)
    if recorded is not None:
        return _recorded_cells(dataset, plan, recorded), []
    pairs = list(product(plan.writers, plan.conditions))
    idle = [f"{c.name}: makes no difference to {writer}, which reads no prompt; left out."
            for writer, c in pairs if not c.applies_to(writer)]  # fmt: skip
    return [_Cell(s, writer, c) for writer, c in pairs if c.applies_to(writer) for s in dataset.samples], idle


def _recorded_cells(dataset: Dataset, plan: RunPlan, recorded: Mapping[tuple[str, str, str], Record]) -> list[_Cell]:
    names = dict.fromkeys([*(c.name for c in plan.conditions), *(name for _, name, _ in recorded)])
    known = {c.name: c for c in plan.conditions}
    conditions = [known.get(name) or Condition(name) for name in names]
    cells = [_Cell(s, *pair) for pair in product(plan.writers, conditions) for s in dataset.samples]
    found = [replace(cell, recorded=recorded[cell.key]) for cell in cells if cell.key in recorded]
    if not found:
        raise RequestError("the recorded run has none of this dataset's samples; name the dataset that it was made of")
    return found


def _open(record: Record | None, sample: Sample) -> bool:
    """Whether a sample is still to be run: there is no record, its writer was not reached, or the sample changed."""
    if record is None or record.unreached:
        return True
    same = record.check == sample.check.to_dict() and record.instruction == sample.task.instruction
    return not same or record.original != waypoints(sample.task.trajectory)


def _manifest(
    dataset: Dataset, plan: RunPlan, earlier: Mapping[str, Any], replayed: Mapping[str, Any]
) -> dict[str, Any]:
    protocol = plan.protocol
    fixed = {
        "ovita": ovita.__version__,
        "feedback": protocol.feedback,
        "feedback_on": protocol.feedback_on,
        "robot": protocol.robot or "each sample's own",
        "isolation": protocol.isolation,
        "temperature": plan.temperature,
    }
    for key, value in fixed.items():
        if key in earlier and earlier[key] != value:
            raise RequestError(
                f"the folder holds a run with {key} = {earlier[key]!r}, not {value!r}; choose another --out"
            )
    versions = {"python": platform.python_version(), "platform": f"{platform.system()} {platform.machine()}"}
    begun = earlier.get("date") or replayed.get("date") or today()
    # a run that code of two commits took part in is of neither
    same = not earlier or earlier.get("commit") == commit()
    versions |= {"date": begun, "commit": commit() if same else ""}
    return {**fixed, **versions, "dataset": dataset.name, "samples": len(dataset.samples), "digest": dataset.digest}


def _work(todo: Sequence[_Cell], plan: RunPlan, log: RecordLog, meter: Meter, *, replaying: bool) -> list[str]:
    """Run cells in parallel; the notes say why cells were left out."""
    notes: list[str] = []
    in_row: dict[str, int] = {}
    closed: set[str] = set()

    def open_cells() -> Iterator[_Cell]:
        for cell in todo:
            if meter.spent:
                return
            if cell.writer not in closed:
                yield cell

    work, engine = _workers(todo, plan, replaying)
    for record in shared(work, open_cells(), jobs=plan.jobs, engine=engine):
        log.append(record)
        meter.count(record)
        in_row[record.writer] = in_row.get(record.writer, 0) + 1 if record.unreached else 0
        if in_row[record.writer] == UNREACHED:
            closed.add(record.writer)
            notes.append(
                f"{record.writer} could not be reached {UNREACHED} times in a row and was not asked any"
                f" further ({record.last.error}); run the same command again to go on."
            )
    return [*notes, *meter.notes]


def _workers(todo: Sequence[_Cell], plan: RunPlan, replaying: bool) -> tuple[Callable[[_Cell], Record], Engine]:
    """Processes or Ray for local work, threads for remote writers."""
    local = replaying or all(is_local(cell.writer) for cell in todo)
    if local and (plan.engine == "ray" or (plan.jobs > 1 and len(todo) > 2 * plan.jobs)):
        return partial(_run_cell, plan=plan), plan.engine

    wanted = dict.fromkeys(cell.system(plan) for cell in todo if not replaying)
    made = {
        (name, heat): open_system(name, base_url=plan.base_url, temperature=heat, timeout=plan.timeout)
        for name, heat in wanted
    }
    limiters = {name: Limiter(None if is_local(name) else plan.per_minute) for name, _ in made}

    def work(cell: _Cell) -> Record:
        return _run_cell(cell, plan, made.get(cell.system(plan)), limiters.get(cell.writer))

    return work, "threads"


def _run_cell(cell: _Cell, plan: RunPlan, inner: System | None = None, limiter: Limiter | None = None) -> Record:
    """Evaluate a cell; a recorded one keeps its recorded times, so that a replay reports the same."""
    try:
        return _asked(cell, plan, inner, limiter)
    except Exception as error:
        error.add_note(f"while running {cell.writer} ({cell.condition.name}) on the sample {cell.sample.id}")
        raise


def _asked(cell: _Cell, plan: RunPlan, inner: System | None, limiter: Limiter | None) -> Record:
    if cell.recorded is not None:
        replies = [reply for item in cell.recorded.rounds for reply in item.replies]
        record = evaluate(cell.sample, ReplayingSystem(cell.writer, replies), cell.condition, plan.protocol)
        times = [item.ms for item in cell.recorded.rounds]
        rounds = [replace(r, ms=times[i]) if i < len(times) else r for i, r in enumerate(record.rounds)]
        return replace(record, rounds=tuple(rounds))
    writer = recording(inner or open_system(cell.writer), cell.condition, limiter, retries=plan.retries)
    record = evaluate(cell.sample, writer, cell.condition, plan.protocol)
    return replace(record, writer=cell.writer)


CHANGED = "+changed"
"""Follows a commit whose files were changed since."""


@cache
def commit() -> str:
    """The commit that this code was checked out from, or "" if it is installed otherwise."""
    here = Path(__file__).parent
    if not _git(here, "ls-files", "--error-unmatch", Path(__file__).name):
        return ""
    found = _git(here, "rev-parse", "--short=12", "HEAD")
    return found + (CHANGED if _git(here.parent, "status", "--porcelain", "--", ".") else "")


def today() -> str:
    """The date in UTC, ISO 8601."""
    return datetime.datetime.now(datetime.UTC).date().isoformat()


def _git(folder: Path, *arguments: str) -> str:
    command = ["git", "-C", str(folder), *arguments]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=20, check=True)
    except (OSError, subprocess.SubprocessError):
        return ""
    return done.stdout.strip()


def default_jobs() -> int:
    """Default number of samples evaluated in parallel: one per core, four at most."""
    return min(4, os.cpu_count() or 1)
