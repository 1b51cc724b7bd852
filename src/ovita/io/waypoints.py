"""Waypoints as plain rows and named columns, in the layout of the public OVITA files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from typing import Any

import numpy as np

from ovita.errors import TrajectoryError
from ovita.io.documents import LARGEST, listing, number_problem, show
from ovita.io.times import speeds_from_times
from ovita.paths.trajectory import TIMESTEP, Array, Trajectory, first_bad

DEFAULT_SPEED = 0.1
"""Speed of every waypoint of a file that gives neither speeds nor times [m/s]."""

COLUMNS = ("x", "y", "z", "speed", "qw", "qx", "qy", "qz")
"""A waypoint: position [m], speed [m/s], orientation as a unit quaternion wxyz."""

_ALIASES = {"velocity": "speed", "v": "speed", "time": "t"}
_QUATERNION = COLUMNS[4:]
_WIDTHS = {3: COLUMNS[:3], 4: COLUMNS[:4], 8: COLUMNS}


def trajectory_rows(trajectory: Trajectory) -> list[list[float]]:
    """Rows [x, y, z, speed] or, with orientations, [x, y, z, speed, qw, qx, qy, qz]; floats are kept exactly."""
    if trajectory.orientations is None:
        return trajectory.to_array().tolist()  # type: ignore[no-any-return]
    return np.column_stack([trajectory.to_array(), trajectory.orientations]).tolist()  # type: ignore[no-any-return]


def trajectory_from_rows(rows: object, *, key: str = "trajectory", timestep: float = TIMESTEP) -> Trajectory:
    """Build a trajectory from parsed rows, as `read_rows` does, without the notes.

    Raises:
        TrajectoryError: If a row is malformed; names the row.
    """
    return read_rows(rows, key=key, timestep=timestep)[0]


def read_rows(
    rows: object, *, key: str | None = "trajectory", timestep: float = TIMESTEP
) -> tuple[Trajectory, tuple[str, ...]]:
    """Build a trajectory from parsed rows, and say what had to be assumed.

    A row is [x, y, z], [x, y, z, speed], [x, y, z, speed, qw, qx, qy, qz], or an object with these names
    (`velocity` and `v` also mean speed; `t` [s] may stand for it).

    Args:
        rows: The list as parsed from JSON.
        key: What the list is called in its file.
        timestep: Duration of one dwell waypoint [s].

    Raises:
        TrajectoryError: If a row is malformed; names the row.
    """
    if not isinstance(rows, (list, tuple)):
        raise TrajectoryError(f"is {show(rows)}, expected a list of rows [x, y, z, speed]", key=key)
    if not rows:
        raise TrajectoryError("is empty; give at least 2 rows [x, y, z, speed]", key=key)
    first = rows[0]
    if isinstance(first, Mapping):
        names, lists = _of_dicts(rows, key)
    elif isinstance(first, (list, tuple)):
        names, lists = _of_lists(rows, key)
    else:
        raise TrajectoryError(f"is {show(first)}, expected a row [x, y, z, speed]", key=key, index=0)
    table = _table(lists, names, key)
    return from_columns(dict(zip(names, table.T, strict=True)), key=key, timestep=timestep)


def column_name(name: str) -> str:
    """The canonical name of a column: lower case, without blanks, `velocity` and `v` as speed, `time` as t."""
    plain = name.strip().lower()
    return _ALIASES.get(plain, plain)


def from_columns(
    columns: Mapping[str, Array], *, key: str | None = None, timestep: float | None = TIMESTEP
) -> tuple[Trajectory, tuple[str, ...]]:
    """Build a trajectory from columns (N,) under their canonical names, and say what had to be assumed.

    Args:
        columns: x, y, z [m]; speed [m/s] or t [s] or neither; qw, qx, qy, qz or none of them. Others are ignored.
        key: What a message calls the waypoints; by default, the column at fault.
        timestep: Duration of one dwell waypoint [s]; None takes it from the dwells if there are times.

    Raises:
        TrajectoryError: If a column is missing or a value is illegal; names the waypoint.
    """
    names = listing(columns)
    missing = [name for name in COLUMNS[:3] if name not in columns]
    if missing:
        raise TrajectoryError(f"has no {', '.join(missing)}, only {names}; x, y and z are needed", key=key)
    turns = [name for name in _QUATERNION if name in columns]
    if turns and len(turns) < 4:
        raise TrajectoryError(
            f"has only {', '.join(turns)} of the quaternion qw, qx, qy, qz; give all or none", key=key
        )
    positions = np.column_stack([columns[name] for name in COLUMNS[:3]])
    for name in [name for name in (*COLUMNS, "t") if name in columns]:
        bad = first_bad(columns[name])
        if bad is not None:
            raise TrajectoryError(f"{name} is {columns[name][bad]}, not a finite number", key=key or name, index=bad)
    if len(positions) < 2:
        raise TrajectoryError(f"has {len(positions) or 'no'} waypoint; a trajectory needs at least 2", key=key)
    notes = []
    unknown = [name or "(without a name)" for name in columns if name not in (*COLUMNS, "t")]
    if unknown:
        notes.append(f"ignored what no trajectory can carry: {listing(unknown)}")
    if "speed" in columns:
        speeds = columns["speed"]
        if "t" in columns:
            notes.append("ignored the times t, because speeds are given")
    elif "t" in columns:
        speeds, dwell, remarks = speeds_from_times(positions, columns["t"], key or "t")
        timestep = dwell if timestep is None else timestep
        notes.append("derived the speeds from the times t")
        notes.extend(remarks)
    else:
        speeds = np.full(len(positions), DEFAULT_SPEED)
        notes.append(f"no speeds are given; assumed {DEFAULT_SPEED:g} m/s at every waypoint")
    orientations = np.column_stack([columns[name] for name in _QUATERNION]) if turns else None
    try:
        built = Trajectory(positions, speeds, orientations, TIMESTEP if timestep is None else timestep)
    except TrajectoryError as error:
        of_column = {"speeds": "speed", "orientations": "qw"}.get(error.key or "", error.key)
        raise TrajectoryError(error.problem, key=key or of_column, index=error.index) from None
    return built, tuple(notes)


def _of_lists(rows: Sequence[Any], key: str | None) -> tuple[tuple[str, ...], Iterable[Sequence[object]]]:
    width = len(rows[0])
    if not set(map(type, rows)) <= {list, tuple}:
        i = next(i for i, row in enumerate(rows) if not isinstance(row, (list, tuple)))
        raise TrajectoryError(f"is {show(rows[i])}, expected a row of {width} numbers like the first", key=key, index=i)
    if width not in _WIDTHS:
        layouts = "3 (x, y, z), 4 (x, y, z, speed) or 8 (x, y, z, speed, qw, qx, qy, qz)"
        raise TrajectoryError(f"holds {_count(width)}, expected {layouts}", key=key, index=0)
    if set(map(len, rows)) != {width}:
        i = next(i for i, row in enumerate(rows) if len(row) != width)
        problem = f"holds {_count(len(rows[i]))} where the first row holds {width}; give every row the same"
        raise TrajectoryError(problem, key=key, index=i)
    return _WIDTHS[width], rows


def _of_dicts(rows: Sequence[Any], key: str | None) -> tuple[tuple[str, ...], Iterable[Sequence[object]]]:
    keys = tuple(rows[0])
    names = tuple(column_name(str(name)) for name in keys)
    twice = [name for i, name in enumerate(names) if name in names[:i]]
    if twice:
        raise TrajectoryError(f"gives {twice[0]} twice; its keys are {listing(map(str, keys))}", key=key, index=0)
    expected = set(keys)
    for i, row in enumerate(rows):
        if not isinstance(row, Mapping):
            raise TrajectoryError(f"is {show(row)}, expected an object like the first row", key=key, index=i)
        if row.keys() != expected:
            lacks, more = sorted(expected - row.keys()), sorted(row.keys() - expected)
            what = f"lacks {listing(lacks)}" if lacks else f"has {listing(more)}"
            raise TrajectoryError(f"{what}, unlike the first row; give every row the same keys", key=key, index=i)
    known = [(k, n) for k, n in zip(keys, names, strict=True) if n in (*COLUMNS, "t")]
    ignored = [(k, n) for k, n in zip(keys, names, strict=True) if n not in (*COLUMNS, "t")]
    # What is ignored may be anything, so it becomes a column of zeros that only lends its name to the note.
    zero = [0.0] * len(ignored)
    values = ([row[k] for k, _ in known] + zero for row in rows)
    return tuple(n for _, n in known + ignored), list(values)


def _table(rows: Iterable[Sequence[object]], names: Sequence[str], key: str | None) -> Array:
    """Rows of equal length as an array (N, D); only if that fails are they walked one by one to find the culprit."""
    rows = list(rows)
    flat: list[Any] = list(chain.from_iterable(rows))
    if set(map(type, flat)) <= {int, float}:
        try:
            table = np.array(flat, dtype=np.float64).reshape(len(rows), len(names))
        except OverflowError:
            pass
        else:
            if (np.abs(table) <= LARGEST).all():
                return table
    for i, row in enumerate(rows):
        for name, value in zip(names, row, strict=True):
            problem = number_problem(value)
            if problem:
                raise TrajectoryError(f"{name} {problem}", key=key, index=i)
    return np.array([[float(value) for value in row] for row in rows])  # type: ignore[arg-type]


def _count(n: int) -> str:
    return "1 number" if n == 1 else f"{n} numbers"
