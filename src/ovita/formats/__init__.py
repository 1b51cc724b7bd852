"""Files in and out, one module a format; the ending of a file's name chooses it."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import Any

from ovita.errors import FormatError
from ovita.formats import csv_, json_
from ovita.formats.adaptation import is_adaptation, load_document, save_document
from ovita.formats.files import atomic_write, examine, file_name, read_text, suffix
from ovita.formats.robot_ import load_robot
from ovita.formats.scenes import scene_dict, scene_from_dict
from ovita.formats.task import Task
from ovita.formats.waypoints import trajectory_from_rows, trajectory_rows
from ovita.scene import Scene
from ovita.trajectory import Trajectory

__all__ = [
    "Task",
    "atomic_write",
    "is_adaptation",
    "load_document",
    "load_robot",
    "load_task",
    "save_document",
    "save_task",
    "save_trajectory",
    "scene_dict",
    "scene_from_dict",
    "trajectory_from_rows",
    "trajectory_rows",
]

_READERS: Mapping[str, Callable[[str, str], Task]] = {".json": json_.parse, ".csv": csv_.parse}


def load_task(path: str | os.PathLike[str]) -> Task:
    """Read a trajectory, and the scene and instruction where the format has them, from a .json or .csv file.

    A saved adaptation gives its adapted trajectory, so that a result can be adapted again.

    Raises:
        FormatError: If the file cannot be read or something in it is malformed; names the file, key and index.
    """
    examine(path)
    reader = _READERS.get(suffix(path))
    if reader is None:
        raise _unknown_suffix(path)
    return reader(read_text(path), file_name(path))


def save_task(path: str | os.PathLike[str], task: Task) -> None:
    """Write a task so that `load_task` reads it back exactly; CSV holds the waypoints only.

    Raises:
        FormatError: As `save_trajectory` does.
    """
    extra = dict(task.extra) if task.robot is None else {**task.extra, "robot": task.robot}
    save_trajectory(path, task.trajectory, task.scene, task.instruction, extra)


def save_trajectory(
    path: str | os.PathLike[str],
    trajectory: Trajectory,
    scene: Scene | None = None,
    instruction: str | None = None,
    extra: Mapping[str, Any] | None = None,
) -> None:
    """Write a trajectory atomically, as the public OVITA JSON or as CSV, which holds the waypoints only.

    Args:
        path: Ends in .json or .csv.
        trajectory: The waypoints.
        scene: What surrounds them.
        instruction: The request.
        extra: Further top-level keys.

    Raises:
        FormatError: If the file cannot be written there, or something has no place in JSON.
    """
    file = file_name(path)
    if suffix(path) == ".csv":
        content = csv_.dumps(trajectory)
    elif suffix(path) == ".json":
        try:
            document = json_.document_of(trajectory, scene, instruction, extra)
        except (TypeError, ValueError, RecursionError) as error:
            raise FormatError(file, f"cannot be written as JSON: {error}") from None
        content = json_.dumps(document, file)
    else:
        raise _unknown_suffix(path)
    atomic_write(path, content)


def _unknown_suffix(path: str | os.PathLike[str]) -> FormatError:
    ending = suffix(path)
    what = f"the ending {ending}" if ending else "a name without an ending"
    return FormatError(file_name(path), f"{what} says nothing about the format; ovita reads and writes .json and .csv")
