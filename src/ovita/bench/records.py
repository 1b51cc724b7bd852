"""What a run leaves in its folder: one JSON line a sample, writer and condition, a manifest, and people's ratings."""

from __future__ import annotations

import csv
import json
import os
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from types import TracebackType
from typing import IO, Any

from pydantic import TypeAdapter, ValidationError

from ovita.bench.dataset import natural
from ovita.errors import FormatError, OvitaError, RequestError
from ovita.io import atomic_write
from ovita.io.files import Journal, read_text, system_errors
from ovita.io.json_ import parse_object

OUTCOMES = ("right", "right after one yes", "asked", "declined", "flagged", "silently wrong")
"""What a first answer amounts to, best first."""

RECORDS, MANIFEST, RATINGS = "records.jsonl", "run.json", "ratings.csv"

Column = tuple[str, str]
"""Writer and condition."""

Rows = tuple[tuple[float, ...], ...]
"""Waypoints: x, y, z [m], speed [m/s]."""


@dataclass(frozen=True)
class Round:
    """One answer to the instruction (the first round) or to feedback.

    Args:
        passed: Whether the check holds after it; `sentence` is what it measured.
        score: Share of the check's clauses that hold, 0..1.
        executable: Whether a policy ran.
        attempts: Policies that were written.
        ms: Time from request to result, pauses for rate limits left out [ms].
        limits: The verdict on the limits, or "none" where nothing ran.
        proposed_passed: Whether what the policy returned passes the check before limits were enforced.
        after_yes: Whether the check holds once a person agrees to what was proposed for confirmation.
        flagged: Whether the result says itself that a person should look at it; a baseline says nothing of itself.
        error: Why there is no result, or "".
        matched, similarity: What a baseline matched the instruction with, and how similar the two are.
        replies: Every reply of the writer, as recorded.
    """

    said: str
    status: str
    passed: bool
    score: float
    sentence: str
    executable: bool
    attempts: int
    ms: float
    input_tokens: int = 0
    output_tokens: int = 0
    limits: str = "none"
    proposed_passed: bool = False
    after_yes: bool = False
    flagged: bool = False
    model: str = ""
    plan: tuple[str, ...] = ()
    code: str = ""
    explanation: str = ""
    error: str = ""
    matched: str = ""
    similarity: float | None = None
    adapted: Rows = ()
    replies: tuple[dict[str, Any], ...] = ()


@dataclass(frozen=True)
class Record:
    """How one writer did on one sample under one condition.

    Args:
        sample, subset, kind, void: As in the sample.
        idle: Whether doing nothing passes the check.
        original: The waypoints that it was about.
        scene, check: As in a scene file and a dataset file.
        rounds: The answer, then the answers to feedback.
    """

    sample: str
    subset: str
    kind: str
    writer: str
    condition: str
    instruction: str
    robot: str
    idle: bool
    original: Rows
    scene: dict[str, Any]
    check: dict[str, Any]
    rounds: tuple[Round, ...]
    void: tuple[str, ...] = field(default=())

    @property
    def key(self) -> tuple[str, str, str]:
        """What a record is about: writer, condition, sample."""
        return *self.column, self.sample

    @property
    def column(self) -> Column:
        """Whose record it is."""
        return self.writer, self.condition

    @property
    def first(self) -> Round:
        """The answer to the instruction."""
        return self.rounds[0]

    @property
    def last(self) -> Round:
        """The answer that counts: the last one with a result, since a turn without one leaves what was there."""
        return next((item for item in reversed(self.rounds) if item.executable), self.rounds[-1])

    @property
    def outcome(self) -> str:
        """What the first answer amounts to, one of OUTCOMES; a proposal that is not meant counts as asked."""
        first = self.first
        if first.executable:
            return "right" if first.passed else "flagged" if first.flagged else "silently wrong"
        if first.status == "needs_confirmation":
            return "right after one yes" if first.after_yes else "asked"
        return "asked" if first.status == "needs_clarification" else "declined"

    @property
    def unreached(self) -> bool:
        """Whether the writer could not be reached, so the record says nothing about its quality."""
        return any(reply.get("unreached") for item in self.rounds for reply in item.replies)

    @property
    def tokens(self) -> int:
        """Tokens read and written."""
        return sum(item.input_tokens + item.output_tokens for item in self.rounds)

    def cost(self, prices: Mapping[str, tuple[float, float]]) -> float:
        """Money, by each writer's prices for a million tokens read and written."""
        read, written = prices.get(self.writer, (0.0, 0.0))
        return sum(item.input_tokens * read + item.output_tokens * written for item in self.rounds) / 1e6


_ADAPTER = TypeAdapter(Record)


class RecordLog:
    """The records of a run's folder; a context manager that holds the folder's lock.

    Args:
        folder: Made if it is missing.

    Raises:
        RequestError: If another run writes there.
        FormatError: If a line that is not the last one cannot be read.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self._journal = Journal(Path(folder) / RECORDS)
        path = self._journal.path
        with system_errors(path, "written"):
            path.parent.mkdir(parents=True, exist_ok=True)
            self._lock: IO[bytes] = open(path, "ab")
        try:
            lock(self._lock, f"{folder}: another run writes there; wait for it, or choose another --out")
            self.records = {record.key: record for record in read_records(path)}
        except OvitaError:
            self._lock.close()
            raise

    def __enter__(self) -> RecordLog:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._lock.close()

    def append(self, record: Record) -> None:
        """Write a record and wait until it is on disk; it replaces an earlier one of the same key."""
        self._journal.add(asdict(record))
        self.records[record.key] = record


def read_records(path: str | os.PathLike[str]) -> list[Record]:
    """Read a run's records, in order; a torn last line is ignored, and the last record of a key counts.

    The path is the file, or the run's folder.

    Raises:
        FormatError: If there is no such file, or a whole line of it is no record.
    """
    file = Path(path)
    if file.is_dir():
        file = file / RECORDS
    if not file.exists():
        raise FormatError(str(path), f"holds no {RECORDS}; name the folder that 'ovita bench run --out' wrote")
    found: dict[tuple[str, str, str], Record] = {}
    for number, event in enumerate(Journal(file).read(), start=1):
        try:
            record = _ADAPTER.validate_python(event)
        except ValidationError as error:
            raise FormatError(str(file), f"line {number} is no record: {error.errors()[0]['msg'].lower()}") from None
        found[record.key] = record
    return ordered(found.values())


def ordered(records: Iterable[Record]) -> list[Record]:
    """Records by writer, condition and sample, "default" first."""
    return sorted(records, key=lambda r: (r.writer, r.condition != "default", r.condition, natural(r.sample)))


def write_manifest(folder: str | os.PathLike[str], manifest: Mapping[str, Any]) -> None:
    """Write the run's manifest."""
    atomic_write(Path(folder) / MANIFEST, json.dumps(dict(manifest), ensure_ascii=False, indent=1) + "\n")


def read_manifest(folder: str | os.PathLike[str]) -> dict[str, Any]:
    """Read the manifest; {} if there is none.

    Raises:
        FormatError: If it is no JSON object.
    """
    file = Path(folder) / MANIFEST
    if not file.exists():
        return {}
    return parse_object(read_text(file), str(file))


def read_ratings(path: str | os.PathLike[str]) -> Mapping[str, tuple[float, ...]]:
    """Read ratings by writer, from columns sample, writer, rating (1 to 5); a folder without the file has none.

    The path is the file, or a run's folder.

    Raises:
        FormatError: If the file lacks a column, or a rating is not between 1 and 5.
    """
    file = Path(path)
    if file.is_dir():
        file = file / RATINGS
        if not file.exists():
            return {}
    found: dict[str, list[float]] = defaultdict(list)
    for number, row in enumerate(csv.DictReader(read_text(file).splitlines()), start=2):
        found[_cell(row, "writer", file, number)].append(_rating(row, file, number))
    return {writer: tuple(values) for writer, values in sorted(found.items())}


def _cell(row: Mapping[str, str | None], key: str, file: Path, number: int) -> str:
    value = row.get(key)
    if not value:
        raise FormatError(str(file), f"line {number} has no value; the columns are sample, writer and rating", key=key)
    return value


def _rating(row: Mapping[str, str | None], file: Path, number: int) -> float:
    text = _cell(row, "rating", file, number)
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 1.0 <= value <= 5.0:
        raise FormatError(str(file), f"line {number} is {text!r}, expected a number from 1 to 5", key="rating")
    return value


def lock(stream: IO[bytes], refusal: str) -> None:
    """Hold an open file for this process until it is closed.

    Raises:
        RequestError: With that refusal, if another process holds it; it is closed then.
    """
    try:
        import fcntl
    except ImportError:  # Windows: two processes in one folder are then the user's concern
        return
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        stream.close()
        raise RequestError(refusal) from None
