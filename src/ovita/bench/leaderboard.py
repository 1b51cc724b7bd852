"""The leaderboard: what every run that was entered came to, one JSON file a run, and a page of them all.

A file holds figures, intervals, versions and fingerprints, and no sentence, scene or trajectory of a dataset.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path, PurePath

from ovita.baselines.catalogue import labelled
from ovita.bench import tables
from ovita.bench.page import template_of
from ovita.bench.records import OUTCOMES, RECORDS, Record, read_manifest, read_records
from ovita.bench.tables import Interval
from ovita.errors import FormatError, RequestError
from ovita.io import atomic_write
from ovita.io.documents import validated
from ovita.io.files import make_folder, read_text
from ovita.io.json_ import parse_object

SCHEMA = "ovita-leaderboard-1"
FOLDER, PAGE = "leaderboard", "index.html"


@dataclass(frozen=True)
class Passed:
    """How often a system's answers pass in one part of the samples: the part's name, passed, n, Wilson's 95 %."""

    group: str
    passed: int
    n: int
    low: float
    high: float


@dataclass(frozen=True)
class EnteredSystem:
    """One system of a run; a program is named without the path that it lay at.

    Args:
        clauses: Mean share of the checks' clauses that hold.
        p50_ms, p95_ms: Time to the first answer.
        tokens: Read and written.
        outcomes: How many first answers were right, asked and so on.
    """

    system: str
    condition: str
    success: Passed
    executable: Passed
    clauses: float
    p50_ms: float
    p95_ms: float
    tokens: int
    outcomes: Mapping[str, int]
    subsets: tuple[Passed, ...]
    kinds: tuple[Passed, ...]


@dataclass(frozen=True)
class EnteredRun:
    """A run as the leaderboard keeps it.

    Args:
        dataset, digest: Name and fingerprint of the dataset's content; only runs of one digest can be compared.
        samples, samples_sha256: How many, and the fingerprint of the list of their ids.
        records_sha256: Of the run's records.jsonl, for whoever replays it.
        date: When the run began.
        commit: Of the code, "" where that is not known; "+changed" if files were changed.
        ovita, python, platform: Versions, and the machine's kind.
        protocol: Robot, feedback, temperature and isolation.
        note: What else must be known, such as that the machine was busy, so that times say little.
    """

    schema: str
    dataset: str
    digest: str
    samples: int
    samples_sha256: str
    records_sha256: str
    date: str
    commit: str
    ovita: str
    python: str
    platform: str
    protocol: Mapping[str, str]
    systems: tuple[EnteredSystem, ...]
    note: str = ""

    @property
    def file(self) -> str:
        """The name of its file: the same for the same run, so that entering it again replaces it."""
        names = [(s.system, s.condition) for s in self.systems]
        key = repr((self.digest, self.samples_sha256, self.commit, dict(sorted(self.protocol.items())), names))
        return f"{self.date}-{self.digest[:6]}-{hashlib.sha256(key.encode()).hexdigest()[:8]}.json"


def entered(run: str | os.PathLike[str], note: str = "") -> EnteredRun:
    """Read a run's folder as an entry, with a note on it.

    Raises:
        FormatError: If it holds no records.
        RequestError: If it lacks what an entry needs, or is not whole.
    """
    records, manifest = read_records(run), read_manifest(run)
    if not records or "digest" not in manifest:
        raise RequestError(f"{run}: holds no run to enter; name a folder that 'ovita bench run --out' wrote")
    ids = sorted({r.sample for r in records})
    _whole(str(run), records, len(ids))
    data = (Path(run) / RECORDS).read_bytes()
    stated = {key: str(manifest.get(key, "")) for key in (*_PROTOCOL, *_STATED)}
    return EnteredRun(
        schema=SCHEMA,
        samples=len(ids),
        samples_sha256=hashlib.sha256("\n".join(ids).encode()).hexdigest()[:16],
        records_sha256=hashlib.sha256(data).hexdigest()[:16],
        date=str(manifest.get("date", "")) or "unknown",
        protocol={key: stated[key] for key in _PROTOCOL},
        systems=tuple(_standings(records)),
        note=note,
        **{key: stated[key] for key in _STATED},
    )


_PROTOCOL = ("robot", "feedback", "feedback_on", "temperature", "isolation")
_STATED = ("dataset", "digest", "commit", "ovita", "python", "platform")


def add(run: str | os.PathLike[str], folder: str | os.PathLike[str] = FOLDER, note: str = "") -> Path:
    """Enter a run into a leaderboard's folder, which is made if it is missing; return the new file."""
    entry = entered(run, note)
    file = make_folder(folder) / entry.file
    atomic_write(file, json.dumps(asdict(entry), ensure_ascii=False, indent=1, allow_nan=False) + "\n")
    return file


def read_leaderboard(folder: str | os.PathLike[str] = FOLDER) -> list[EnteredRun]:
    """Read all entries of a folder, newest first.

    Raises:
        RequestError: If there is none.
        FormatError: If a file is no entry.
    """
    files = sorted(Path(folder).glob("*.json"))
    if not files:
        raise RequestError(f"{folder}: holds no entries yet; enter a run with 'ovita bench leaderboard --add RUN'")
    found = [_read(file) for file in files]
    return sorted(found, key=lambda entry: (entry.date, entry.file), reverse=True)


def page(entries: Sequence[EnteredRun]) -> str:
    """The leaderboard as one HTML file without scripts, a table for each dataset, best first.

    Raises:
        MissingExtra: If Jinja2 is not installed.
    """
    boards: dict[str, list[tuple[EnteredRun, EnteredSystem]]] = {}
    for entry in entries:
        boards.setdefault(entry.digest, []).extend((entry, standing) for standing in entry.systems)
    for rows in boards.values():
        rows.sort(key=lambda row: (-row[1].success.passed / row[1].success.n, row[1].system, row[0].date))
    ordered = sorted(boards.items(), key=lambda item: (-item[1][0][0].samples, item[0]))
    return template_of("ovita.bench", "leaderboard.html.j2").render(boards=ordered, outcomes=OUTCOMES)


def text(entries: Sequence[EnteredRun]) -> list[list[str]]:
    """The same as rows for a terminal, the first one naming the columns."""
    rows = [["dataset", "samples", "system", "success", "95 % interval", "executable", "p50 ms", "date", "commit"]]
    for entry in entries:
        for s in sorted(entry.systems, key=lambda s: -s.success.passed / s.success.n):
            span = f"{s.success.low:.1%} to {s.success.high:.1%}"
            shown = (
                tables.named((s.system, s.condition)),
                _share(s.success),
                span,
                _share(s.executable),
                f"{s.p50_ms:.0f}",
            )
            dataset = f"{entry.dataset} {entry.digest[:6]}", str(entry.samples)
            rows.append([*dataset, *shown, entry.date, entry.commit or "-"])
    return rows


def shown_name(system: str) -> str:
    """A system's name without paths of the machine it ran on."""
    kind, colon, rest = system.partition(":")
    if kind not in ("exec", "llamacpp"):
        return system
    return kind + colon + " ".join(PurePath(word).name if "/" in word else word for word in rest.split())


def _share(part: Passed) -> str:
    return f"{part.passed / part.n:.1%}"


def _read(file: Path) -> EnteredRun:
    entry: EnteredRun = validated(EnteredRun, parse_object(read_text(file), str(file)), str(file))
    if entry.schema != SCHEMA:
        raise FormatError(str(file), f"is {entry.schema!r}, expected {SCHEMA!r}", key="schema")
    if not entry.systems or any(s.success.n < 1 for s in entry.systems):
        raise FormatError(str(file), "holds no system with samples", key="systems")
    return entry


def _whole(run: str, records: Sequence[Record], samples: int) -> None:
    for column, mine in tables.by_column(records).items():
        name = tables.named(column)
        if len(mine) != samples:
            raise RequestError(f"{run}: {name} has {len(mine)} of {samples} samples; let the run end first")
        if any(r.unreached for r in mine):
            raise RequestError(f"{run}: {name} could not be reached on some samples; run it again first")


def _standings(records: Sequence[Record]) -> Iterable[EnteredSystem]:
    for mine in tables.by_column(records).values():
        (x,) = tables.tallies(mine)
        subsets, kinds = (tuple(_part(y.group, y.success) for y in tables.tallies(mine, by)) for by in _PARTS)
        yield EnteredSystem(
            system=labelled(shown_name(x.writer)),
            condition=x.condition,
            success=_part("all", x.success),
            executable=_part("all", x.executable),
            clauses=round(x.score, 6),
            p50_ms=round(x.p50, 1),
            p95_ms=round(x.p95, 1),
            tokens=x.input_tokens + x.output_tokens,
            outcomes=dict(x.outcomes),
            subsets=subsets,
            kinds=kinds,
        )


_PARTS: tuple[tables.By, ...] = ("subset", "kind")


def _part(group: str, share: Interval) -> Passed:
    return Passed(group, share.successes, share.n, round(share.low, 6), round(share.high, 6))
