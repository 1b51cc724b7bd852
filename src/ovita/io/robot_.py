"""Robot files: the limits of a robot in TOML or JSON.

name = "my arm"
margin = 0.02            # m to the border of the workspace
obstacle_margin = 0.05   # m to every object
max_speed = 0.5          # m/s; without it there is no limit
object_size = 0.05       # m, for objects without dimensions
radius = 0.03            # m, the body around the path's point; margins to objects count from it
person_margin = 0.3      # m to every person
max_acceleration = 2.0   # m/s^2 along the path; without it there is no limit
max_lateral_acceleration = 2.0  # m/s^2 across the path; without it there is no limit
min_speed = 0.01         # m/s while moving
planar = false           # true: the robot stays on the plane of its path

[workspace]              # without it the path may go anywhere
kind = "shell"           # center, r_min, r_max; or "box": lower, upper
center = [0.0, 0.0, 0.3]
r_min = 0.1
r_max = 0.8
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from ovita.errors import FormatError
from ovita.io import json_
from ovita.io.files import errors_of, examine, file_name, read_text, suffix
from ovita.io.values import brief, listing, nearest, number, show, vector
from ovita.paths.robot import Box, Robot, Shell, Vector

_NUMBERS = tuple(f.name for f in fields(Robot) if f.name not in ("name", "workspace", "planar"))
_KEYS = tuple(f.name for f in fields(Robot))
_WORKSPACES: Mapping[str, Sequence[str]] = {"box": ("lower", "upper"), "shell": ("center", "r_min", "r_max")}


def load_robot(name_or_path: str | os.PathLike[str]) -> Robot:
    """A shipped robot by its name, or a robot from a .toml or .json file.

    Raises:
        RobotError: If it is neither a preset nor looks like a file.
        FormatError: If the file cannot be read or a value in it is malformed.
    """
    if isinstance(name_or_path, str) and not _looks_like_path(name_or_path):
        return Robot.preset(name_or_path)
    examine(name_or_path)
    readers: dict[str, Callable[[str, str], dict[str, Any]]] = {".toml": _parse_toml, ".json": json_.parse_object}
    reader = readers.get(suffix(name_or_path))
    file = file_name(name_or_path)
    if reader is None:
        raise FormatError(file, "a robot is a .toml or a .json file; rename it or name a preset")
    return robot_from_dict(reader(read_text(name_or_path), file), file)


def robot_from_dict(document: Mapping[str, Any], file: str) -> Robot:
    """Build a robot from the parsed content of a robot file, laid out as shown at the top of this module.

    Raises:
        FormatError: On an unknown key or a malformed value; names the key.
    """
    _check_keys(document, _KEYS, "", file)
    name = document.get("name", Path(file).stem)
    if not isinstance(name, str) or not name.strip():
        raise FormatError(file, f"is {show(name)}, expected text", key="name")
    given = [key for key in _NUMBERS if key in document and not (document[key] is None and key.startswith("max_"))]
    values: dict[str, Any] = {key: _number(document[key], key, file) for key in given}
    workspace, planar = document.get("workspace"), document.get("planar", False)
    if not isinstance(planar, bool):
        raise FormatError(file, f"is {show(planar)}, expected true or false", key="planar")
    values.setdefault("max_speed", None)
    with errors_of(file):
        return Robot(
            name=name, workspace=None if workspace is None else _workspace(workspace, file), planar=planar, **values
        )


def _looks_like_path(name: str) -> bool:
    return suffix(name) in (".toml", ".json") or os.sep in name or "/" in name


def _parse_toml(content: str, file: str) -> dict[str, Any]:
    try:
        return tomllib.loads(content)
    except RecursionError:
        raise FormatError(file, "nested too deeply for a robot file") from None
    except tomllib.TOMLDecodeError as error:
        what = str(error)
        raise FormatError(file, f"this is not TOML: {what[:1].lower()}{what[1:]}") from None
    except ValueError:
        raise FormatError(file, "this is not TOML: a number or date in it is out of range") from None


def _workspace(document: object, file: str) -> Box | Shell:
    if not isinstance(document, Mapping):
        problem = f"is {show(document)}, expected a table with lower and upper, or center, r_min and r_max"
        raise FormatError(file, problem, key="workspace")
    kind = document.get("kind", "shell" if any(key in document for key in _WORKSPACES["shell"]) else "box")
    if not isinstance(kind, str) or kind not in _WORKSPACES:
        raise FormatError(file, f"is {show(kind)}, expected 'box' or 'shell'", key="workspace.kind")
    keys = _WORKSPACES[kind]
    _check_keys(document, ("kind", *keys), "workspace.", file)
    missing = [key for key in keys if key not in document]
    if missing:
        raise FormatError(file, f"a {kind} needs {', '.join(keys)}; {missing[0]} is missing", key="workspace")
    if kind == "box":
        return Box(_point(document["lower"], "lower", file), _point(document["upper"], "upper", file))
    r_min, r_max = (_number(document[key], f"workspace.{key}", file) for key in ("r_min", "r_max"))
    return Shell(_point(document["center"], "center", file), r_min, r_max)


def _point(value: object, key: str, file: str) -> Vector:
    try:
        x, y, z = vector(value, "it", ("x", "y", "z"))
    except ValueError as error:
        raise FormatError(file, _without_it(error), key=f"workspace.{key}") from None
    return x, y, z


def _number(value: object, key: str, file: str) -> float:
    try:
        return number(value, "it")
    except ValueError as error:
        raise FormatError(file, _without_it(error), key=key) from None


def _without_it(error: ValueError) -> str:
    return str(error).removeprefix("it ")


def _check_keys(document: Mapping[str, Any], known: Sequence[str], prefix: str, file: str) -> None:
    for key in document:
        if key not in known:
            guess = nearest(key, known)
            hint = f"did you mean {guess!r}?" if guess else f"known keys are {listing(known)}"
            raise FormatError(file, f"is an unknown key; {hint}", key=f"{prefix}{brief(key)}")
