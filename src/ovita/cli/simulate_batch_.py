"""`ovita simulate DIR --report FILE`: every trajectory and result of a folder in simulation, and a table of it."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import click

from ovita import sim
from ovita.cli.common import EXIT_OF, plain
from ovita.errors import OvitaError, RequestError
from ovita.io import READ, atomic_write
from ovita.io.files import suffix
from ovita.workers import Engine, shared

FORMATS = (".csv", ".md", ".json")


@dataclass(frozen=True)
class Simulated:
    """A row of the table: how one trajectory of one file went; lengths in metres, times in seconds."""

    file: str
    which: str
    robot: str
    status: str
    rms: float | None = None
    peak: float | None = None
    asked: float | None = None
    achieved: float | None = None
    unreachable: int = 0
    contacts: str = ""
    problem: str = ""

    @property
    def failed(self) -> bool:
        """Whether nobody should run it on a robot."""
        return self.status in (*sim.FAILED, "not simulated")


def simulate_all(folder: str, report: str, jobs: int, engine: Engine, options: dict[str, Any]) -> int:
    """Simulate what a folder holds, print a line for each, write the table; the exit code.

    Raises:
        RequestError: If the folder holds nothing to simulate, or the table has no known ending.
    """
    if suffix(report) not in FORMATS:
        raise RequestError(f"--report {report}: tables are written as {', '.join(FORMATS)}")
    root = Path(folder)
    if not root.is_dir():
        raise RequestError(f"--report wants a folder of trajectories and results; {folder} is none")
    files = [p for p in sorted(root.iterdir()) if p.is_file() and suffix(p) in READ]
    files = [p for p in files if p.resolve() != Path(report).resolve()]
    if not files:
        raise RequestError(f"{folder} holds no file of a known format ({', '.join(READ)})")
    rows: list[Simulated] = []
    work = partial(rows_of, options=options)
    for several in shared(work, map(str, files), jobs=min(jobs, len(files)), engine=engine):
        rows += several
        for row in several:
            click.echo(plain(_line(row)))
    rows.sort(key=lambda row: row.file)
    atomic_write(report, table(rows, suffix(report)))
    failed = sum(row.failed for row in rows)
    click.echo(plain(f"\n{len(rows)} simulations of {len(files)} files, {failed} failed; wrote {report}"))
    return EXIT_OF["infeasible"] if failed else 0


def rows_of(file: str, options: dict[str, Any]) -> list[Simulated]:
    """How the trajectories of one file went; one row that says why where there is none."""
    from ovita.cli.simulate_ import simulated

    name = Path(file).name
    try:
        panes, *_, model = simulated(file, options)
    except (OvitaError, click.UsageError) as error:
        said = error.message if isinstance(error, click.UsageError) else str(error)
        return [Simulated(name, options["which"], options["robot"] or "", "not simulated", problem=said)]
    return [_row(name, pane.label, model.name, pane.simulation.report) for pane in panes]


def _row(file: str, which: str, robot: str, report: sim.Report) -> Simulated:
    t = report.tracking
    struck = "; ".join(contact.told for contact in report.contacts if not contact.meant)
    return Simulated(
        file,
        which,
        robot,
        report.status,
        round(t.rms, 6),
        round(t.max, 6),
        round(report.asked, 3),
        round(report.achieved, 3),
        len(report.unreachable),
        struck,
    )


def _line(row: Simulated) -> str:
    if row.rms is None or row.peak is None:
        return f"{row.file} {row.which}: {row.status}: {row.problem}"
    more = f", touches {row.contacts}" if row.contacts else ""
    return f"{row.file} {row.which}: {row.status}, {1e3 * row.rms:.1f} mm rms, at most {1e3 * row.peak:.1f} mm{more}"


def table(rows: Sequence[Simulated], ending: str) -> str:
    """The rows as a document of that ending."""
    cells = [asdict(row) for row in rows]
    names = list(cells[0])
    if ending == ".json":
        return json.dumps(cells, indent=1) + "\n"
    shown = [["" if cell[name] is None else str(cell[name]) for name in names] for cell in cells]
    if ending == ".md":
        lines = [names, ["---"] * len(names), *([text.replace("|", "\\|") for text in row] for row in shown)]
        return "".join(f"| {' | '.join(line)} |\n" for line in lines)
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([names, *shown])
    return out.getvalue()
