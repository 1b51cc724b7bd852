"""TUM trajectory text: `time x y z qx qy qz qw` a line, in seconds and metres; lines that start with # are comments."""

from __future__ import annotations

import numpy as np

from ovita.errors import FormatError
from ovita.io.documents import LARGEST, show
from ovita.io.files import errors_of
from ovita.io.task import Task
from ovita.io.timelaw import timed
from ovita.io.waypoints import from_columns
from ovita.paths.trajectory import Array, Trajectory

_NAMES = ("t", "x", "y", "z", "qx", "qy", "qz", "qw")
START = "start_time"
"""Key of `Task.extra` under which the time of the first line is kept [s]."""


def parse(content: str, file: str) -> Task:
    """Read a trajectory from TUM text; its speeds follow from the times.

    Raises:
        FormatError: If a line is malformed or the times do not increase; names the line.
    """
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
    return Task(trajectory, extra={START: start} if start else {}, path=file, notes=notes)


def dumps(trajectory: Trajectory, start: float = 0.0) -> tuple[str, tuple[str, ...]]:
    """Write a trajectory as TUM text whose first line is at `start` [s], and say what it does not hold."""
    trajectory, times, notes = timed(trajectory)
    said = [*notes, "TUM text holds times instead of speeds; reading it derives the speeds from them"]
    turns = trajectory.orientations
    if turns is None:
        turns = np.tile([1.0, 0.0, 0.0, 0.0], (len(trajectory), 1))
        said.append("there are no orientations; every line got the identity 0 0 0 1")
    table = np.column_stack([times + start, trajectory.positions, turns[:, [1, 2, 3, 0]]])
    lines = [" ".join(map(repr, row)) for row in table.tolist()]
    return "# time x y z qx qy qz qw\n" + "\n".join(lines) + "\n", tuple(said)


def looks_like(content: str) -> bool:
    """Whether the first line that is no comment is eight numbers separated by blanks."""
    for line in content.splitlines():
        cells = line.split("#", 1)[0].split()
        if cells:
            return len(cells) == len(_NAMES) and _number(cells[0]) is not None
    return False


def _row(cells: list[str], line: int, file: str) -> Array:
    if len(cells) != len(_NAMES):
        problem = f"holds {len(cells)} values, expected 8: time x y z qx qy qz qw"
        raise FormatError(file, f"line {line} {problem}")
    values = [_number(cell) for cell in cells]
    for name, cell, value in zip(_NAMES, cells, values, strict=True):
        largest = LARGEST * (1000.0 if name == "t" else 1.0)
        if value is None or not abs(value) <= largest:
            raise FormatError(file, f"line {line}: {name} is {show(cell)}, not a finite number of at most {largest:g}")
    return np.array(values, dtype=float)


def _number(cell: str) -> float | None:
    try:
        return None if "_" in cell else float(cell)
    except ValueError:
        return None
