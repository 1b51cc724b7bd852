"""What is shown: items with the answer of each condition, taken from the records of bench runs."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

from ovita.bench.dataset import natural, spread
from ovita.bench.records import Record, Rows, read_records
from ovita.errors import RequestError
from ovita.io.documents import listing


@dataclass(frozen=True)
class ConditionResult:
    """What one condition made of an item.

    Args:
        adapted: Waypoints; those of the item where the system changed nothing.
        told: What the system says of it, a line each.
    """

    adapted: Rows
    changed: bool
    told: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class StudyItem:
    """A sample with what each condition made of it; equal only to itself, so that its pictures can be kept.

    Args:
        scene: As in a scene file.
        original: Waypoints: x, y, z [m], speed [m/s].
    """

    sample: str
    instruction: str
    robot: str
    scene: dict[str, Any]
    original: Rows
    results: dict[str, ConditionResult]


HIDDEN = "the system"
"""What stands in place of a name that could tell conditions apart."""


def gather(runs: Sequence[str], conditions: Mapping[str, str], limit: int | None = None) -> tuple[StudyItem, ...]:
    """The items that all conditions of some runs share.

    Args:
        runs: Folders that `ovita bench run` wrote.
        conditions: Name -> "WRITER" or "WRITER/CONDITION"; empty for all that there are, by their own names.
        limit: At most so many items, spread evenly.

    Raises:
        FormatError: If a folder is no run.
        RequestError: If a condition is missing, or no item has a record of each.
    """
    found = _by_condition(runs, conditions)
    shared = set.intersection(*(set(records) for records in found.values()))
    items = [{name: records[s] for name, records in found.items()} for s in sorted(shared, key=natural)]
    alike = [records for records in items if _same(list(records.values()))]
    if not alike:
        told = listing(f"{name} ({len(records)} samples)" for name, records in found.items())
        raise RequestError(f"no sample has a record of every condition: {told}; run them on the same dataset")
    secret = secrets_of(found)
    return tuple(_item(records, secret) for records in spread(alike, limit))


def secrets_of(found: Mapping[str, Mapping[str, Record]]) -> tuple[str, ...]:
    """The names that no page may show: of conditions, writers and models; longest first."""
    records = list(chain.from_iterable(mine.values() for mine in found.values()))
    models = {done.model for done in chain.from_iterable(record.rounds for record in records)}
    names = {*found, *models, *(record.writer for record in records)}
    parts = {part for name in names for part in name.split(":")}
    names |= {part for part in parts if len(part) > 3 and part.casefold() not in _WORDS}
    return tuple(sorted(filter(None, names), key=len, reverse=True))


_WORDS = frozenset({"copy", "random", "extract", "baseline", "exec", "python"})
"""Parts of writers' names that are ordinary words, which an instruction may hold too."""


def hidden(text: str, secret: Iterable[str]) -> str:
    """A text without names that could tell conditions apart, in whatever case they are written."""
    for name in secret:
        text = re.sub(rf"(?<!\w){re.escape(name)}(?!\w)", HIDDEN, text, flags=re.IGNORECASE)
    return text


def shown(lines: Iterable[str], secret: Iterable[str]) -> tuple[str, ...]:
    """Lines that a person may read, each once."""
    return tuple(dict.fromkeys(hidden(line.strip(), secret) for line in lines if line.strip()))


def _by_condition(runs: Sequence[str], conditions: Mapping[str, str]) -> dict[str, dict[str, Record]]:
    by_run = {run: _by_name(read_records(run)) for run in dict.fromkeys(runs)}
    times = Counter(chain.from_iterable(by_run.values()))
    found = {
        name if times[name] == 1 else f"{name} in {Path(run).name}": records
        for run, groups in by_run.items()
        for name, records in groups.items()
    }
    if conditions:
        found = {name: _wanted(wanted, found) for name, wanted in conditions.items()}
    if not found:
        raise RequestError("the runs hold no records; run `ovita bench run` first")
    return {name.replace("|", "/"): found[name] for name in sorted(found)}


def _by_name(records: Iterable[Record]) -> dict[str, dict[str, Record]]:
    """Records by the name of their condition, and by sample."""
    found: dict[str, dict[str, Record]] = defaultdict(dict)
    for record in records:
        name = record.writer if record.condition == "default" else f"{record.writer}/{record.condition}"
        found[name][record.sample] = record
    return found


def _wanted(name: str, found: Mapping[str, dict[str, Record]]) -> dict[str, Record]:
    if name not in found:
        raise RequestError(f"conditions: the runs hold no {name!r}; they hold {listing(found)}")
    return found[name]


def _same(records: Sequence[Record]) -> bool:
    """Whether records are about the same path and sentence, and all of them were reached."""
    first = records[0]
    alike = all((r.original, r.instruction) == (first.original, first.instruction) for r in records)
    return alike and bool(first.original) and not any(r.unreached for r in records)


def _item(records: Mapping[str, Record], secret: Sequence[str]) -> StudyItem:
    first = next(iter(records.values()))
    results = {name: _result(record, secret) for name, record in records.items()}
    return StudyItem(first.sample, first.instruction, first.robot, first.scene, first.original, results)


def _result(record: Record, secret: Sequence[str]) -> ConditionResult:
    done = record.last
    if not done.executable:
        asked = done.error if done.status == "needs_clarification" else ""
        return ConditionResult(record.original, False, tuple(filter(None, [hidden(asked, secret)])))
    return ConditionResult(done.adapted, True, shown(done.explanation.splitlines() or done.plan, secret))
