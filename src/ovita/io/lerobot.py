"""Episodes of LeRobot data sets, versions 2 and 3: folders of Parquet files with a description of their columns.

Only what a tool does in space can be read: a state (or an action) with components x, y, z, such as "x" or "ee.x", and
perhaps a quaternion or roll, pitch, yaw beside it. Joints are no positions.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ovita.errors import FormatError, needs
from ovita.io.documents import Task, listing, scene_from_dict, validated
from ovita.io.files import DATA_SET_INFO, errors_of, examine, file_name, read_text
from ovita.io.json_ import parse_object
from ovita.io.waypoints import from_columns
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array
from ovita.text import counted

OVITA = ("meta", "ovita")
"""Where data that ovita wrote keeps what lerobot has no column for, below the folder of the data set."""

_XYZ, _QUATERNION, _ANGLES = ("x", "y", "z"), ("qw", "qx", "qy", "qz"), ("roll", "pitch", "yaw")
_FIRST = ("observation.state", "observation.state.ee", "observation.ee_pose", "action")


def episodes(folder: str | os.PathLike[str]) -> tuple[Task, ...]:
    """Read every episode of a data set as a task, named "FOLDER: episode 3", with what it was told to do.

    Speeds are those of a component "speed"; without one they follow from the timestamps. The scene and the robot are
    known of data that ovita wrote.

    Raises:
        FormatError: If the folder is no data set, or none of its features holds positions.
        MissingExtra: If pyarrow is not installed.
    """
    return tuple(_read(folder, None))


def episode(folder: str | os.PathLike[str], number: int | None = None) -> Task:
    """Read one episode of a data set as a task.

    Episodes are counted from 0, negative numbers from the end; None is the last.

    Raises:
        FormatError: As `episodes` does, or if there is no such episode.
        MissingExtra: If pyarrow is not installed.
    """
    file, info = file_name(folder), file_name(os.path.join(folder, *DATA_SET_INFO))
    count = validated(int, _info(folder).get("total_episodes"), info, "total_episodes")
    chosen = -1 if number is None else number
    if not -count <= chosen < count:
        raise FormatError(file, f"there is no episode {chosen}; it holds {counted(count, 'episode')}, counted from 0")
    found = _read(folder, chosen % count)
    if not found:
        raise FormatError(file, f"no file under data/ holds episode {chosen % count}; fetch the data set's files first")
    several = number is None and count > 1
    notes = (f"it holds {count} episodes; read the last (--message picks another)",) if several else ()
    return replace(found[0], notes=(*notes, *found[0].notes))


def _read(folder: str | os.PathLike[str], only: int | None) -> list[Task]:
    """All episodes, or only one."""
    file = file_name(folder)
    column, names = _feature(folder)
    table = _table(folder, column, only)
    if not table.num_rows:
        return []
    rows = _matrix(table[column], file, column, len(names))
    times, numbers = (_matrix(table[name], file, name, 1)[:, 0] for name in ("timestamp", "episode_index"))
    told, around = _instructions(folder, table), _surroundings(folder, only)
    order = np.argsort(numbers, kind="stable")
    tasks = []
    for mine in np.split(order, np.flatnonzero(np.diff(numbers[order])) + 1):
        number = int(numbers[mine[0]])
        columns, step = _columns(rows[mine], names), None
        if "speed" not in columns:
            columns["t"] = times[mine] - times[mine][0]
        elif len(mine) > 1:
            step = float(np.median(np.diff(times[mine])))
        place = f"{file}: episode {number}"
        scene, robot = around.get(number, (Scene(), None))
        with errors_of(place):
            trajectory, notes = from_columns(columns, timestep=step)
        said = told[mine[0]] if told else ""
        tasks.append(Task(trajectory, scene, said, path=place, robot=robot, notes=notes))
    return tasks


def _info(folder: str | os.PathLike[str]) -> dict[str, Any]:
    path = os.path.join(folder, *DATA_SET_INFO)
    examine(path)
    return parse_object(read_text(path), file_name(path))


def _instructions(folder: str | os.PathLike[str], table: Any) -> list[str]:
    """What was to be done, by row of a table of frames; empty where the data set does not say."""
    known = _tasks(folder) if "task_index" in table.column_names else {}
    return [known.get(index, "") for index in table["task_index"].to_pylist()] if known else []


def _tasks(folder: str | os.PathLike[str]) -> dict[Any, str]:
    """What is to be done, by its number; empty where the data set does not say."""
    path, lines = Path(folder, "meta", "tasks.parquet"), Path(folder, "meta", "tasks.jsonl")
    if path.is_file():
        rows = [{"task": row.get("__index_level_0__"), **row} for row in _parquet(path, None).to_pylist()]
        return {row["task_index"]: str(row["task"]) for row in rows if "task_index" in row and row["task"] is not None}
    written = read_text(lines).splitlines() if lines.is_file() else []
    parsed = [parse_object(line, file_name(lines)) for line in written if line.strip()]
    return {one.get("task_index"): str(one.get("task") or "") for one in parsed}


def _surroundings(folder: str | os.PathLike[str], only: int | None) -> dict[int, tuple[Scene, str | None]]:
    """Scene and robot by episode, where ovita wrote the data set."""
    found: dict[int, tuple[Scene, str | None]] = {}
    for path in sorted(Path(folder, *OVITA).rglob("*.parquet")):
        table = _parquet(path, ["episode_index", "scene", "robot"], only)
        with errors_of(path):
            for row in table.to_pylist():
                scene = scene_from_dict(parse_object(row["scene"], file_name(path)))
                found[row["episode_index"]] = scene, row["robot"]
    return found


def _feature(folder: str | os.PathLike[str]) -> tuple[str, tuple[str, ...]]:
    """The feature that holds positions, and the names of its components without what they have in common."""
    file, document = file_name(os.path.join(folder, *DATA_SET_INFO)), _info(folder)
    features = validated(dict[str, dict[str, Any]], document.get("features"), file, "features")
    named = {name: _names(feature.get("names")) for name, feature in features.items()}
    order = [*(name for name in _FIRST if name in named), *sorted(named.keys() - _FIRST)]
    for name, short in ((name, _shortened(named[name])) for name in order):
        if set(_XYZ) <= set(short):
            return name, short
    states = [name for name in order if named[name] and "image" not in name]
    said = f"{states[0]} holds {listing(named[states[0]])}" if states else "no feature names its components"
    raise FormatError(file, f"no feature holds the positions x, y, z ({said}); joints cannot be read", key="features")


def _names(value: object) -> tuple[str, ...]:
    """The names of a feature's components: a list, or an object whose only value is one."""
    if isinstance(value, Mapping) and len(value) == 1:
        value = next(iter(value.values()))
    return tuple(map(str, value)) if isinstance(value, Sequence) and not isinstance(value, str) else ()


def _shortened(names: Sequence[str]) -> tuple[str, ...]:
    """The names with the prefix of x, y, z cut off where all three share one: "ee.x" to "x"; others as they are."""
    for name in names:
        prefix = name[:-1]
        if name.endswith("x") and not prefix[-1:].isalnum() and {prefix + axis for axis in _XYZ} <= set(names):
            return tuple(other.removeprefix(prefix) for other in names)
    return tuple(names)


def _columns(rows: Array, names: Sequence[str]) -> dict[str, Array]:
    kept = (*_XYZ, *(_QUATERNION if set(_QUATERNION) <= set(names) else ()), *(n for n in names if n == "speed"))
    columns = {name: rows[:, names.index(name)] for name in kept}
    if set(_ANGLES) <= set(names) and not set(_QUATERNION) <= set(kept):
        from scipy.spatial.transform import Rotation

        turns = Rotation.from_euler("xyz", rows[:, [names.index(name) for name in _ANGLES]]).as_quat()
        columns |= dict(zip(_QUATERNION, np.roll(turns, 1, axis=1).T, strict=True))
    return columns


def _table(folder: str | os.PathLike[str], column: str, only: int | None) -> Any:
    """The frames of all files, or of one episode."""
    files = sorted(Path(folder, "data").rglob("*.parquet"))
    if not files:
        raise FormatError(file_name(folder), "there is no .parquet file under data/; fetch the data set's files first")
    needed = [column, "timestamp", "episode_index"]
    tables = []
    for path in files:
        table = _parquet(path, [*needed, "task_index"], only)
        if not set(needed) <= set(table.column_names):
            raise FormatError(file_name(path), f"lacks one of the columns {', '.join(needed)}")
        tables.append(table)
    shared = [name for name in (*needed, "task_index") if all(name in table.column_names for table in tables)]
    return _arrow().concat_tables([table.select(shared) for table in tables])


def _parquet(path: Path, columns: list[str] | None, only: int | None = None) -> Any:
    """The columns of a file that it has, all rows or those of one episode."""
    pyarrow = _arrow()
    from pyarrow import parquet

    try:
        known = parquet.read_schema(path).names
        there = None if columns is None else [name for name in columns if name in known]
        chosen = None if only is None or "episode_index" not in known else [("episode_index", "=", only)]
        return parquet.read_table(path, columns=there, partitioning=None, filters=chosen)
    except (pyarrow.ArrowException, OSError, ValueError) as error:
        raise FormatError(file_name(path), f"cannot be read as Parquet: {str(error).splitlines()[0]}") from None


def _arrow() -> Any:
    with needs("pyarrow", "lerobot"):
        import pyarrow
    return pyarrow


def _matrix(column: Any, file: str, name: str, width: int) -> Array:
    """A column of numbers, or of lists of one length, as rows (N, D)."""
    values = column.combine_chunks()
    nested = bool(values.type.num_fields)
    if nested and len(set(values.value_lengths().to_pylist())) > 1:
        raise FormatError(file, f"{name} has rows of different lengths, expected {width} numbers")
    flat = values.flatten() if nested else values
    rows = np.asarray(flat.to_numpy(zero_copy_only=False), dtype=float).reshape(len(values), -1)
    if rows.shape[1] < width:
        raise FormatError(file, f"{name} has rows of shape {rows.shape[1:]}, expected {width} numbers")
    return rows
