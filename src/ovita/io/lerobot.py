"""Episodes of LeRobot data sets, versions 2 and 3: folders of Parquet files with a description of their columns.

Only what a tool does in space can be read: a state (or an action) with components x, y, z, such as "x" or "ee.x", and
perhaps a quaternion or roll, pitch, yaw beside it. Joints are no positions.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ovita.errors import FormatError, MissingExtra
from ovita.io.documents import Task, listing, validated
from ovita.io.files import errors_of, examine, file_name, read_text
from ovita.io.json_ import parse_object
from ovita.io.waypoints import from_columns
from ovita.paths.trajectory import Array

_XYZ, _QUATERNION, _ANGLES = ("x", "y", "z"), ("qw", "qx", "qy", "qz"), ("roll", "pitch", "yaw")
_FIRST = ("observation.state", "observation.state.ee", "observation.ee_pose", "action")


def episodes(folder: str | os.PathLike[str]) -> tuple[Task, ...]:
    """Read every episode of a data set as a task, named "FOLDER: episode 3".

    Speeds follow from the timestamps.

    Raises:
        FormatError: If the folder is no data set, or none of its features holds positions.
        MissingExtra: If pyarrow is not installed.
    """
    file = file_name(folder)
    column, names = _feature(folder)
    table = _table(folder, column)
    rows = np.array(table[column].to_pylist(), dtype=float)
    if rows.ndim != 2 or rows.shape[1] < len(names):
        raise FormatError(file, f"{column} has rows of shape {rows.shape[1:]}, expected {len(names)} numbers")
    times, numbers = (np.array(table[name].to_pylist(), dtype=float).ravel() for name in ("timestamp", "episode_index"))
    tasks = []
    for number in np.unique(numbers):
        mine = numbers == number
        columns = _columns(rows[mine], names)
        columns["t"] = times[mine] - times[mine][0]
        place = f"{file}: episode {number:.0f}"
        with errors_of(place):
            trajectory, notes = from_columns(columns, timestep=None)
        tasks.append(Task(trajectory, path=place, notes=notes))
    return tuple(tasks)


def _feature(folder: str | os.PathLike[str]) -> tuple[str, tuple[str, ...]]:
    """The feature that holds positions, and the names of its components without what they have in common."""
    path = os.path.join(folder, "meta", "info.json")
    examine(path)
    file = file_name(path)
    document = parse_object(read_text(path), file)
    features = validated(dict[str, dict[str, Any]], document.get("features"), file, "features")
    named = {name: _names(feature.get("names")) for name, feature in features.items()}
    order = sorted(named, key=lambda name: (name not in _FIRST, _FIRST.index(name) if name in _FIRST else 0, name))
    for name in order:
        short = _shortened(named[name])
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
    kept = (*_XYZ, *(_QUATERNION if set(_QUATERNION) <= set(names) else ()))
    columns = {name: rows[:, names.index(name)] for name in kept}
    if set(_ANGLES) <= set(names) and len(kept) == 3:
        from scipy.spatial.transform import Rotation

        turns = Rotation.from_euler("xyz", rows[:, [names.index(name) for name in _ANGLES]]).as_quat()
        columns |= dict(zip(_QUATERNION, np.roll(turns, 1, axis=1).T, strict=True))
    return columns


def _table(folder: str | os.PathLike[str], column: str) -> Any:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise MissingExtra("pyarrow", "lerobot") from None
    files = sorted(Path(folder, "data").rglob("*.parquet"))
    if not files:
        raise FormatError(file_name(folder), "there is no .parquet file under data/; fetch the data set's files first")
    tables = []
    for path in files:
        try:
            tables.append(parquet.read_table(path, columns=[column, "timestamp", "episode_index"], partitioning=None))
        except (pyarrow.ArrowException, OSError, ValueError) as error:
            raise FormatError(file_name(path), f"cannot be read as Parquet: {str(error).splitlines()[0]}") from None
        if len(tables[-1].column_names) < 3:
            raise FormatError(file_name(path), f"lacks one of the columns {column}, timestamp, episode_index")
    return pyarrow.concat_tables(tables)
