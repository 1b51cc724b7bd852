"""Reports of a run: Markdown, CSV, Parquet, figures and one HTML page."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from importlib import import_module
from itertools import product
from pathlib import Path
from typing import Any

from ovita.bench import tables
from ovita.bench.page import html
from ovita.bench.records import OUTCOMES, Record
from ovita.bench.tables import Interval, Tally
from ovita.errors import MissingExtra, RequestError, needs
from ovita.io import atomic_write
from ovita.io.files import make_folder

Table = list[list[str]]


def write_report(
    folder: str | os.PathLike[str],
    records: Sequence[Record],
    manifest: Mapping[str, Any],
    *,
    ratings: Mapping[str, Sequence[float]] | None = None,
    prices: Mapping[str, tuple[float, float]] | None = None,
    notes: Sequence[str] = (),
    figures: bool = True,
    parquet: bool = False,
) -> list[Path]:
    """Write report.md, records.csv, summary.csv, report.html and the panel; return the files.

    The same records and manifest give the same files.

    `ratings` are people's by writer, 1 to 5; `prices` are money for a million tokens read and written by writer;
    `notes` belong on top.

    Raises:
        RequestError: If there are no records.
        MissingExtra: If Parquet is wanted and pyarrow is not installed.
        FormatError: If a file cannot be written.
    """
    if not records:
        raise RequestError("there is nothing to report yet: the run has no records")
    out = make_folder(folder)
    notes = list(notes)
    files: dict[str, str | bytes] = {}
    panel = ""
    if figures:
        try:
            files |= _panel(records, ratings)
            panel = str(files["panel.svg"])
        except MissingExtra as missing:
            notes.append(f"No figures: {missing}")
    found = report_tables(records, ratings, prices)
    title = f"ovita bench: {manifest.get('dataset', 'a run')}"
    files["summary.csv"] = _csv(summary_rows(records, prices))
    files["records.csv"] = _csv(flat(records))
    try:
        files["report.html"] = html(title, [("Run", _run_table(manifest, notes)), *found], panel, records)
    except MissingExtra as missing:
        notes.append(f"No page: {missing}")
    files["report.md"] = markdown(title, found, manifest, notes, panel=bool(panel))
    if parquet:
        files["records.parquet"] = _parquet(flat(records))
    for name, content in files.items():
        atomic_write(out / name, content)
    return [out / name for name in files]


def report_tables(
    records: Sequence[Record],
    ratings: Mapping[str, Sequence[float]] | None = None,
    prices: Mapping[str, tuple[float, float]] | None = None,
) -> list[tuple[str, Table]]:
    """The report's tables with their headings."""
    found = [("Success", success_table(records, prices)), ("First answers", outcome_table(records))]
    for by, heading in _PARTS.items():
        shown = "writer", by, "success", "95 % interval", "n", "executable", "clauses"
        found.append((heading, _table(tables.tallies(records, by), *shown)))
    found += [
        ("Limits", _table(tables.tallies(records), "writer", *_VERDICTS, "lost to the limits")),
        ("Feedback", _feedback(records)),
        ("Comparisons", _comparisons(records)),
        ("Similarity with what was matched", _similarities(records)),
        ("Interpretability", _interpretability(ratings or {})),
    ]
    return [(heading, rows) for heading, rows in found if len(rows) > 1]


def success_table(records: Sequence[Record], prices: Mapping[str, tuple[float, float]] | None = None) -> Table:
    """The main table: one row a writer and condition, and a row for doing nothing."""
    shown = [
        "writer",
        "success",
        "95 % interval",
        "n",
        "executable",
        "clauses",
        "attempts",
        "p50 ms",
        "p95 ms",
        "tokens",
    ]
    rows = _table(tables.tallies(records, prices=prices), *shown, *(["cost"] if prices else []))
    nothing = tables.idle(records)
    return [*rows, ["doing nothing", _rate(nothing), _span(nothing), str(nothing.n)] + ["-"] * (len(rows[0]) - 4)]


def outcome_table(records: Sequence[Record]) -> Table:
    """What the first answers amount to: one row a writer and condition, one column an outcome."""
    return _table(tables.tallies(records), "writer", *OUTCOMES, "n")


def markdown(
    title: str, found: Sequence[tuple[str, Table]], manifest: Mapping[str, Any], notes: Sequence[str], *, panel: bool
) -> str:
    """The report as Markdown."""
    parts = [f"# {cell(title)}", *(f"> {cell(note)}" for note in notes)]
    parts += [pipes(_run_table(manifest, ()))]
    for heading, rows in found:
        parts += [f"## {heading}", pipes(rows)]
    if panel:
        parts += ["## Figures", "![Figures A to G](panel.svg)"]
    parts.append(
        "Intervals are Wilson's. Success is compared by McNemar's exact test (effect: Cohen's g, -0.5 to 0.5), clauses"
        " and times by Wilcoxon's signed-rank test (effect: rank-biserial correlation, -1 to 1); positive means that"
        " the second is higher. p (Holm) is corrected for all comparisons of the same measure."
        " `report.html` shows each sample."
    )
    return "\n\n".join(parts) + "\n"


def _of(item: object, *names: str) -> dict[str, Any]:
    return {name: getattr(item, name) for name in names}


def flat(records: Sequence[Record]) -> list[dict[str, Any]]:
    """One flat row a record."""
    return [
        {
            **_of(r, "sample", "subset", "kind", "writer", "condition"),
            "model": r.last.model,
            "robot": r.robot,
            "instruction": r.instruction,
            "passed": r.last.passed,
            "passed_first": r.first.passed,
            "clauses": r.last.score,
            "executable": r.first.executable,
            **_of(r.last, "status", "limits", "proposed_passed"),
            "idle_passes": r.idle,
            "rounds": len(r.rounds),
            **_of(r.first, "attempts", "ms"),
            "input_tokens": sum(x.input_tokens for x in r.rounds),
            "output_tokens": sum(x.output_tokens for x in r.rounds),
            **_of(r.last, "sentence", "error", "matched", "similarity"),
            "void": "; ".join(r.void),
            "check": json.dumps(r.check, ensure_ascii=False),
        }
        for r in records
    ]


def summary_rows(
    records: Sequence[Record], prices: Mapping[str, tuple[float, float]] | None = None
) -> list[dict[str, Any]]:
    """One flat row a writer, condition and group."""
    groups: tuple[tables.By, ...] = ("all", *_PARTS)
    return [
        {
            **_of(x, "by", "group", "writer", "condition"),
            "n": x.success.n,
            "passed": x.success.successes,
            "success": x.success.rate,
            **_of(x.success, "low", "high"),
            "passed_first": x.first.successes,
            "executable": x.executable.rate,
            "clauses": x.score,
            "attempts": x.attempts,
            "p50_ms": x.p50,
            "p95_ms": x.p95,
            **_of(x, "input_tokens", "output_tokens", "cost", "lost_to_limits", "unreached"),
            **{f"limits_{k}": x.limits.get(k, 0) for k in _VERDICTS},
        }
        for by in groups
        for x in tables.tallies(records, by, prices)
    ]


_VERDICTS = ("satisfied", "repaired", "infeasible", "preexisting", "off", "none")


_PARTS: Mapping[tables.By, str] = {"subset": "By subset", "kind": "By kind of instruction"}


def _outcome(name: str, x: Tally) -> str:
    return f"{x.outcomes[name] / x.success.n:.1%}"


def _limit(name: str, x: Tally) -> str:
    return str(x.limits.get(name, 0))


_CELLS: Mapping[str, Callable[[Tally], str]] = {
    "writer": lambda x: x.name,
    **dict.fromkeys(_PARTS, lambda x: x.group),
    "success": lambda x: _rate(x.success),
    "95 % interval": lambda x: _span(x.success),
    "n": lambda x: str(x.success.n),
    "executable": lambda x: _rate(x.executable),
    "clauses": lambda x: f"{x.score:.1%}",
    "attempts": lambda x: f"{x.attempts:.2f}",
    "p50 ms": lambda x: f"{x.p50:.0f}",
    "p95 ms": lambda x: f"{x.p95:.0f}",
    "tokens": lambda x: str(x.input_tokens + x.output_tokens),
    "cost": lambda x: f"{x.cost:.4g}",
    **{name: partial(_outcome, name) for name in OUTCOMES},
    **{name: partial(_limit, name) for name in _VERDICTS},
    "lost to the limits": lambda x: str(x.lost_to_limits),
}
"""What the columns of tables hold."""


def _table(found: Iterable[Tally], *shown: str) -> Table:
    return [[*shown], *([_CELLS[name](x) for name in shown] for x in found)]


def _feedback(records: Sequence[Record]) -> Table:
    rows = [["writer", "turns of feedback", "success", "95 % interval"]]
    for column, mine in tables.by_column(records).items():
        shares = tables.rounds(mine)
        rows += [[tables.named(column), str(i), _rate(s), _span(s)] for i, s in enumerate(shares) if len(shares) > 1]
    return rows


def _comparisons(records: Sequence[Record]) -> Table:
    rows = [["measure", "of", "against", "test", "n", "differ", "second higher", "p", "p (Holm)", "effect"]]
    for c in tables.comparisons(records):
        p = c.paired
        counts = map(str, (p.n, p.changed, p.better))
        rows.append([c.what, c.a, c.b, p.test, *counts, f"{p.p:.3g}", f"{c.holm:.3g}", f"{p.effect:+.2f}"])
    return rows


def _similarities(records: Sequence[Record]) -> Table:
    """How similar instructions were to what a baseline matched them with, where the answer was right and where not."""
    rows = [["writer", "answer", "n", "median", "5 %", "95 %"]]
    for (column, mine), passed in product(tables.by_column(records).items(), (True, False)):
        found = [r.first.similarity for r in mine if r.first.similarity is not None and r.first.passed == passed]
        spread = [f"{tables.percentile(found, share):.2f}" for share in (0.5, 0.05, 0.95)]
        rows += [[tables.named(column), "right" if passed else "wrong", str(len(found)), *spread]] if found else []
    return rows


def _interpretability(ratings: Mapping[str, Sequence[float]]) -> Table:
    rows = [["writer", "mean", "4 or 5", "n"]]
    for writer, values in ratings.items():
        n = len(values)
        rows.append([writer, f"{sum(values) / n:.2f}", f"{sum(v >= 4 for v in values) / n:.1%}", str(n)])
    return rows


def _run_table(manifest: Mapping[str, Any], notes: Sequence[str]) -> Table:
    rows = [["", ""], *([str(key).replace("_", " "), str(value)] for key, value in manifest.items())]
    return [*rows, *(["note", note] for note in notes)]


def _rate(share: Interval) -> str:
    return "-" if math.isnan(share.rate) else f"{share.rate:.1%}"


def _span(share: Interval) -> str:
    return f"{share.low:.1%} to {share.high:.1%}"


def pipes(rows: Table) -> str:
    """Rows as a Markdown table, the first one its heading."""
    lines = ["| " + " | ".join(map(cell, row)) + " |" for row in rows]
    lines.insert(1, "|" + "---|" * len(rows[0]))
    return "\n".join(lines)


def cell(text: str) -> str:
    """A text that can stand in a Markdown table, where it is no markup."""
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    """Rows as CSV, the first one the names of the columns."""
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(rows)
    return out.getvalue()


def _csv(rows: Sequence[Mapping[str, Any]]) -> str:
    return csv_text([rows[0], *(row.values() for row in rows)])


def _panel(records: Sequence[Record], ratings: Mapping[str, Sequence[float]] | None) -> dict[str, str | bytes]:
    from ovita.bench.figures import image, panel

    figure = panel(records, ratings)
    return {"panel.png": image(figure, "png"), "panel.svg": image(figure, "svg").decode("utf-8")}


def _parquet(rows: Sequence[Mapping[str, Any]]) -> bytes:
    with needs("pyarrow", "bench"):
        arrow, parquet = import_module("pyarrow"), import_module("pyarrow.parquet")
    out = io.BytesIO()
    parquet.write_table(arrow.Table.from_pylist([dict(row) for row in rows]), out)
    return out.getvalue()
