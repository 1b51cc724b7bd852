"""CSV: one waypoint a row, under a header that names the columns."""

from __future__ import annotations

import csv
import io
import re
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from ovita.errors import FormatError
from ovita.io.documents import LARGEST, Task, brief, cell_number, listing, number_problem, show, timestep_of
from ovita.io.files import errors_of
from ovita.io.waypoints import COLUMNS, column_name, from_columns, poses_of, timed, trajectory_table
from ovita.paths.trajectory import TIMESTEP, Array, Trajectory

_DELIMITERS = ",;\t"
_POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
_VERDICT = re.compile(r"^#[ \t]*verdict:(.+)$", re.MULTILINE)
_TIMESTEP = re.compile(r"#\s*timestep\s*[:=]\s*(\S+)\s*", re.IGNORECASE)


def parse_csv(content: str, file: str) -> Task:
    """Read a task from the text of a CSV file.

    The header names x, y, z [m], speed [m/s] or t [s], and qw, qx, qy, qz, in any order and case, separated by commas,
    semicolons or tabs; `velocity` and `v` also mean speed, other columns are ignored with a note. Lines before the
    header that start with # are comments, of which `# timestep: 0.1` is heeded. A file of seven numbers a row may lack
    the header: it then holds poses x, y, z, qx, qy, qz, qw.
    """
    content, remarks = _with_header(content)
    start, timestep = _header_offset(content, file)
    header_line = content[start:].lstrip("# \t").split("\n", 1)[0].split("\r", 1)[0]
    delimiter = max(_DELIMITERS, key=header_line.count)
    body = io.StringIO(content[start:], newline="")
    reader = csv.reader(body, delimiter=delimiter, skipinitialspace=True)
    first_line = content.count("\n", 0, start) - len(remarks)

    def task(columns: dict[str, Array]) -> Task:
        with errors_of(file):
            trajectory, notes = from_columns(columns, timestep=timestep)
        return Task(trajectory, path=file, notes=remarks + notes, verdict=_verdict(content[:start]))

    try:
        header = next(reader)
        numbers = _numbers(content, start, delimiter, len(header))
        rows = [] if numbers is not None else _rows(reader, first_line)
    except csv.Error as error:
        raise FormatError(file, f"this is not CSV: {error} (line {reader.line_num + first_line})") from None
    header[0] = header[0].lstrip("# \t")
    names = [column_name(name) for name in header]
    _check_header(names, header, file)
    if numbers is not None:
        return task(dict(zip(names, numbers.T, strict=True)))
    if not rows:
        raise FormatError(file, "there is a header but no row below it; give at least 2 waypoints")
    return task(_columns(rows, names, file))


def dumps_csv(trajectory: Trajectory, verdict: str = "") -> tuple[str, tuple[str, ...]]:
    """Write the waypoints as CSV text that `parse_csv` turns back exactly; a scene has no place in it."""
    width = 4 if trajectory.orientations is None else 8
    lines = _comment(verdict)
    lines += [] if trajectory.timestep == TIMESTEP else [f"# timestep: {float(trajectory.timestep)!r}"]
    lines.append(",".join(COLUMNS[:width]))
    lines.append(trajectory_table(trajectory).text[2:-2].replace("], [", "\n").replace(", ", ","))
    return "\n".join(lines) + "\n", ()


def dumps_poses(trajectory: Trajectory, verdict: str = "") -> tuple[str, tuple[str, ...]]:
    """Write poses x, y, z, qx, qy, qz, qw as CSV text, with notes on what is lost."""
    poses, own = poses_of(trajectory)
    notes = () if own else ("there are no orientations; every row got the identity 0, 0, 0, 1",)
    lines = [*_comment(verdict), ",".join(_POSE), *(",".join(map(repr, row)) for row in poses.tolist())]
    return "\n".join(lines) + "\n", ("a pose file holds no speeds and no times", *notes)


def _comment(verdict: str) -> list[str]:
    return [f"# verdict: {verdict}"] if verdict else []


def _verdict(comments: str) -> str:
    found = _VERDICT.search(comments)
    return found[1].strip() if found else ""


def _with_header(content: str) -> tuple[str, tuple[str, ...]]:
    """The text with a pose header inserted if it starts with seven numbers."""
    lines = content.splitlines(keepends=True) or [""]
    start = next((i for i, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#")), 0)
    first = lines[start]
    delimiter = max(_DELIMITERS, key=first.count)
    try:
        bare = len(list(map(float, first.split(delimiter)))) == len(_POSE)
    except ValueError:
        bare = False
    if not bare:
        return content, ()
    note = "there is no header; the seven columns were read as x, y, z, qx, qy, qz, qw"
    return "".join([*lines[:start], delimiter.join(_POSE) + "\n", *lines[start:]]), (note,)


def _rows(reader: Any, first_line: int) -> list[tuple[list[str], int]]:
    """The rows of a CSV reader that are not blank, each with its line."""
    return [(row, reader.line_num + first_line) for row in reader if any(cell.strip() for cell in row)]


def _numbers(content: str, start: int, delimiter: str, width: int) -> Array | None:
    """The rows below a header (N, width), read at once; None if anything needs a closer look, or a sentence."""
    head, _, body = content[start:].partition("\n")
    if '"' in head or "\r" in head[:-1] or body.count("\r") > body.count("\r\n") or not _PLAIN.fullmatch(body):
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # of a file without rows
            table = np.loadtxt(io.StringIO(body), delimiter=delimiter, ndmin=2, comments=None)
    except (ValueError, UserWarning):
        return None
    return table if table.shape[1] == width and (np.abs(table) <= LARGEST).all() else None


_PLAIN = re.compile(r"[-+0-9.eE,;\t \r\n]*")
"""Rows of nothing but numbers."""


def _header_offset(content: str, file: str) -> tuple[int, float | None]:
    """Where the header starts, and the timestep of a comment above it."""
    timestep: float | None = None
    offset = 0
    for line in content.splitlines(keepends=True):
        bare = line.strip()
        if bare and not bare.startswith("#"):
            return offset, timestep
        found = _TIMESTEP.fullmatch(bare)
        if found:
            timestep = timestep_of(cell_number(found[1]), file, found[1])
        elif bare and set(COLUMNS[:3]) <= {column_name(cell) for cell in re.split(r"[,;\t]", bare.lstrip("# "))}:
            return offset, timestep
        offset += len(line)
    raise FormatError(file, "there is no header, only comments; name the columns, such as x,y,z,speed")


def _check_header(names: list[str], header: list[str], file: str) -> None:
    if all(name not in names for name in COLUMNS[:3]):
        problem = f"the first line ({listing(header)}) must name the columns, such as x,y,z,speed"
        raise FormatError(file, problem)
    for i, name in enumerate(names):
        if name and name in names[:i]:
            raise FormatError(file, f"repeats the column {name}; keep one of the two", key=brief(header[i].strip()))


def _columns(rows: list[tuple[list[str], int]], names: list[str], file: str) -> dict[str, Array]:
    """The cells as columns (N,) by name; those that no trajectory can carry are zeros."""
    for i, (row, line) in enumerate(rows):
        if len(row) != len(names):
            problem = f"holds {len(row)} values where the header names {len(names)} (line {line})"
            raise FormatError(file, problem, key="row", index=i)
    cells, lines = zip(*(row for row, _ in rows), strict=True), [line for _, line in rows]
    known = (*COLUMNS, "t")
    return {
        name: _column(column, name, lines, file) if name in known else np.zeros(len(rows))
        for name, column in zip(names, cells, strict=True)
    }


def _column(cells: Sequence[str], name: str, lines: Sequence[int], file: str) -> Array:
    try:
        column = np.array(list(map(float, cells)))
    except ValueError:
        column = np.full(len(cells), np.nan)
    if (np.abs(column) <= LARGEST).all() and not any("_" in cell for cell in cells):
        return column
    for i, problem in enumerate(map(_cell_problem, cells)):
        if problem:
            raise FormatError(file, f"{problem} (line {lines[i]})", key=name, index=i)
    return column


def _cell_problem(cell: str) -> str:
    bare = cell.strip()
    if not bare:
        return "is empty, expected a number"
    value = cell_number(bare)
    if value is None:
        comma = "; write decimals with a point" if re.fullmatch(r"[-+]?\d+,\d+", bare) else ""
        return f"is {show(bare)}, not a number{comma}"
    return number_problem(value)


_NAMES = ("t", "x", "y", "z", "qx", "qy", "qz", "qw")
START = "start_time"
"""Key of `Task.extra` under which the time of the first line is kept [s]."""


def parse_tum(content: str, file: str) -> Task:
    """Read a trajectory from TUM text; its speeds follow from the times."""
    lines = [(line.split("#", 1)[0].split(), i) for i, line in enumerate(content.splitlines(), start=1)]
    rows = [(cells, i) for cells, i in lines if cells]
    if not rows:
        raise FormatError(file, "there are only comments; give lines 'time x y z qx qy qz qw'")
    table = np.array([_row(cells, i, file) for cells, i in rows])
    start = float(table[0, 0])
    columns = dict(zip(_NAMES, table.T, strict=True))
    columns["t"] = columns["t"] - start
    columns = {name: columns[name] for name in ("x", "y", "z", "t", "qw", "qx", "qy", "qz")}
    with errors_of(file):
        trajectory, notes = from_columns(columns, timestep=None)
    kept = {START: start} if start else {}
    return Task(trajectory, extra=kept, path=file, notes=notes, verdict=_verdict(content))


def dumps_tum(trajectory: Trajectory, start: float = 0.0, verdict: str = "") -> tuple[str, tuple[str, ...]]:
    """Write a trajectory as TUM text starting at `start` [s], with notes on what is lost."""
    trajectory, times, notes = timed(trajectory)
    said = [*notes, "TUM text holds times instead of speeds; reading it derives the speeds from them"]
    poses, own = poses_of(trajectory)
    if not own:
        said.append("there are no orientations; every line got the identity 0 0 0 1")
    table = np.column_stack([times + start, poses])
    lines = [" ".join(map(repr, row)) for row in table.tolist()]
    return "\n".join([*_comment(verdict), "# time x y z qx qy qz qw", *lines]) + "\n", tuple(said)


def looks_like_tum(content: str) -> bool:
    """Whether the first line that is no comment is eight numbers separated by blanks."""
    lines = (line.split("#", 1)[0].split() for line in content.splitlines())
    first = next(filter(None, lines), [])
    return len(first) == len(_NAMES) and cell_number(first[0]) is not None


def _row(cells: list[str], line: int, file: str) -> Array:
    if len(cells) != len(_NAMES):
        problem = f"holds {len(cells)} values, expected 8: time x y z qx qy qz qw"
        raise FormatError(file, f"line {line} {problem}")
    values = [cell_number(cell) for cell in cells]
    for name, cell, value in zip(_NAMES, cells, values, strict=True):
        largest = LARGEST * (1000.0 if name == "t" else 1.0)
        if value is None or not abs(value) <= largest:
            raise FormatError(file, f"line {line}: {name} is {show(cell)}, not a finite number of at most {largest:g}")
    return np.array(values, dtype=float)
