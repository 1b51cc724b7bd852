"""What people answered, one row an answer, and the long CSV file that holds it."""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, Literal

from ovita.bench.report import csv_text
from ovita.errors import FormatError
from ovita.io.files import file_name, read_text

Phase = Literal["adapt", "rate"]

LIKERT = ("correctness", "interpretability")
"""Questions from 1 (completely wrong) to 5 (completely correct)."""

TEXTS = ("preference", "comment")
"""Questions whose answer is a text; of all others it is a number."""

NONE = "none"
"""The answer to "preference" of a person who sees no difference."""


@dataclass(frozen=True)
class Rating:
    """One answer of one person to one question.

    Args:
        participant: A random id.
        group: The person's stratum, such as "expert".
        phase: Whether the person adapted the trajectory ("adapt") or judges another's ("rate").
        item: The instruction and scene that it is about; "" for questions on the whole.
        condition: The system that answered; "A|B" for a preference between two; "" for questions on the whole.
        question: "correctness", "interpretability" (1..5), "preference" (the condition that is preferred, or "none"),
            "tlx_..." (0..100), "umux_1".."umux_2" (1..7), "sus_1".."sus_10" (1..5), "attention" (1 passed, 0 failed),
            "comment" (a text).
        position: Which page of this person it was, from 1.
        seconds: Time to the answer [s].
        when: Date and time, ISO 8601.
        pilot: Whether it is a trial of the study and no data.
        adapter: Who adapted what is judged, where that was another participant, else "".
    """

    participant: str
    group: str
    phase: Phase
    item: str
    condition: str
    explanation: bool
    question: str
    value: float | str
    position: int
    seconds: float
    when: str
    pilot: bool
    adapter: str = ""


COLUMNS = tuple(field.name for field in fields(Rating))
_FLAGS = {"1": True, "true": True, "yes": True, "0": False, "false": False, "no": False}
_RANGES = {
    **dict.fromkeys((*LIKERT, "sus_"), (1.0, 5.0)),
    "attention": (0.0, 1.0),
    "tlx_": (0.0, 100.0),
    "umux_": (1.0, 7.0),
}
"""The smallest and the largest answer, by how a question begins."""


def answers_csv(ratings: Iterable[Rating]) -> str:
    """The ratings as CSV, one line each, with a line of names on top."""
    return csv_text([COLUMNS, *map(written_row, ratings)])


def written_row(rating: Rating) -> list[object]:
    """A rating as a row of `COLUMNS`."""
    value = rating.value if isinstance(rating.value, str) else f"{rating.value:g}"
    flags = {"explanation": int(rating.explanation), "pilot": int(rating.pilot)}
    return list({**asdict(rating), **flags, "value": value}.values())


def read_answers(path: str | os.PathLike[str]) -> tuple[Rating, ...]:
    """Read ratings from CSV; columns may come in any order, and `adapter` may be missing.

    Raises:
        FormatError: If the file cannot be read, lacks a column, or holds a value that its question does not have.
    """
    file = file_name(path)
    rows = csv.DictReader(io.StringIO(read_text(path)))
    missing = [name for name in COLUMNS[:-1] if name not in (rows.fieldnames or ())]
    if missing:
        raise FormatError(file, f"the column {missing[0]!r} is missing; the columns are {', '.join(COLUMNS)}")
    return tuple(_rating(row, file, number) for number, row in enumerate(rows, start=2))


def allowed(question: str) -> tuple[float, float]:
    """The smallest and the largest answer to a question that is answered by a number."""
    spans = (span for prefix, span in _RANGES.items() if question.startswith(prefix))
    return next(spans, (-math.inf, math.inf))


def _rating(row: Mapping[str, str | None], file: str, line: int) -> Rating:
    cells = {name: (row.get(name) or "").strip() for name in COLUMNS}
    for name in ("participant", "question", "value"):
        if not cells[name] and cells["question"] != "comment":
            raise FormatError(file, f"line {line} has no {name}")
    if cells["phase"] not in ("adapt", "rate"):
        raise FormatError(file, f"line {line} has the phase {cells['phase']!r}; it is 'adapt' or 'rate'")
    values: dict[str, Any] = {**cells, **{name: _flag(cells, name, file, line) for name in ("explanation", "pilot")}}
    if cells["question"] not in TEXTS:
        values["value"] = _number(cells, "value", file, line, allowed(cells["question"]))
    values["position"] = int(_number(cells, "position", file, line, (0, math.inf)))
    return Rating(**{**values, "seconds": _number(cells, "seconds", file, line, (0, math.inf))})


def _flag(cells: Mapping[str, str], name: str, file: str, line: int) -> bool:
    try:
        return _FLAGS[cells[name].lower()]
    except KeyError:
        raise FormatError(file, f"line {line} has the {name} {cells[name]!r}; it is 1 or 0") from None


def _number(cells: Mapping[str, str], name: str, file: str, line: int, span: tuple[float, float]) -> float:
    try:
        value = float(cells[name])
    except ValueError:
        value = math.nan
    if not span[0] <= value <= span[1] or math.isinf(value):
        limits = f" from {span[0]:g} to {span[1]:g}" if math.isfinite(span[1]) else ""
        raise FormatError(file, f"line {line} has the {name} {cells[name]!r}, expected a number{limits}")
    return value
