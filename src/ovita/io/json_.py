"""JSON: the public OVITA layout, and a parser and writer that are stricter than Python's own."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import asdict, replace
from hashlib import sha256
from typing import Any

from ovita.errors import FormatError
from ovita.io import documents
from ovita.io.files import atomic_write, errors_of, examine, file_name, is_address, read_text, suffix
from ovita.io.waypoints import read_rows, trajectory_rows
from ovita.paths.robot import PRESETS
from ovita.paths.scene import Scene
from ovita.paths.trajectory import TIMESTEP, Trajectory, standing_still

ADAPTATION_SCHEMA = "ovita.adaptation/1"
"""Value of `schema` in a file that holds an adaptation."""

SKILL_SCHEMA = "ovita.skill/1"
"""Value of `schema` in a file that holds a skill; the first key, so that the file's beginning tells."""

_BEGINNING = 4096

TASK_KEYS = ("trajectory", "instruction", "timestep", *documents.SCENE_KEYS)
"""Top-level keys that ovita gives a meaning to, besides `robot`."""

MAX_DEPTH = 64
"""Deepest nesting of lists and objects in a file."""

_CARRIED = {"mission": "home", "ros": "frame_id"}
_LINE = 110
_HALF_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")


def parse(content: str, file: str) -> documents.Task:
    """Read a task from the text of a JSON file.

    A file that holds an adaptation gives its adapted trajectory, its scene and its instruction.
    """
    document = parse_object(content, file)
    task = _adaptation(document, file) if is_adaptation(document) else _task(document, file)
    return replace(task, path=file, verdict=" ".join(task.verdict.split()))


def _task(document: Mapping[str, Any], file: str) -> documents.Task:
    others = {k: v for k, v in document.items() if k != "trajectory"}
    check_values(others, file)
    trajectory, notes = _trajectory(document, "trajectory", file)
    # A mission or a ROS message that ovita kept, not the user's own key of that name.
    ours = [k for k, inner in _CARRIED.items() if isinstance(others.get(k), dict) and inner in others[k]]
    scene = _scene(_only(others, (*documents.SCENE_KEYS, *ours)), file)
    kept = {k: v for k, v in others.items() if k not in (*TASK_KEYS, *ours)}
    robot, remarks = _named(others.get("robot"))
    if robot is not None:
        del kept["robot"]
    verdict = kept.pop(documents.VERDICT) if isinstance(kept.get(documents.VERDICT), str) else ""
    said: dict[str, Any] = {"notes": notes + remarks, "fixed_frame": bool(ours), "verdict": verdict}
    return documents.Task(trajectory, scene, _instruction(others, file), kept, robot=robot, **said)


def _adaptation(document: Mapping[str, Any], file: str) -> documents.Task:
    check_schema(document, file)
    check_values(_only(document, ("scene", "instruction", "timestep", "robot")), file)
    trajectory, notes = _trajectory(document, "adapted", file)
    scene = _scene(_scene_part(document, file), file)
    robot, remarks = _robot_of_adaptation(document.get("robot"))
    status, fixed = document.get("status"), any(key in scene.extra for key in _CARRIED)
    verdict = f"{status}: {document.get('message')}" if status in ("limited", "not_as_meant", "infeasible") else ""
    said: dict[str, Any] = {"notes": notes + remarks, "fixed_frame": fixed, "verdict": verdict}
    name = robot if robot and robot.strip() else None
    return documents.Task(trajectory, scene, _instruction(document, file), robot=name, **said)


def parse_scene(content: str, file: str) -> tuple[Scene, bool]:
    """Read only the scene from the text of a JSON file, and whether it states its frame."""
    document = parse_object(content, file)
    if is_adaptation(document):
        document = dict(_scene_part(document, file))
    check_values({key: value for key, value in document.items() if key != "trajectory"}, file)
    return _scene(_only(document, documents.SCENE_KEYS), file), document.get("frame") is not None


def parse_bare(content: str, file: str) -> documents.Task | None:
    """Read a task, whose path stands still, from the text of a JSON file with objects and no trajectory.

    None if the file holds a trajectory, an adaptation, or no objects.
    """
    document = parse_object(content, file)
    objects = document.get("objects")
    if is_adaptation(document) or "trajectory" in document or not (isinstance(objects, list) and objects):
        return None
    check_values(document, file)
    scene, (robot, _) = _scene(_only(document, documents.SCENE_KEYS), file), _named(document.get("robot"))
    return documents.Task(standing_still(), scene, _instruction(document, file), path=file, robot=robot)


def document_of(
    trajectory: Trajectory,
    scene: Scene | None = None,
    instruction: str | None = None,
    extra: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """The document of the public OVITA layout that `parse` turns back exactly."""
    for key in [key for key in extra or {} if key in TASK_KEYS]:
        raise ValueError(f"extra may not hold {key!r}, which the file already has")
    document: dict[str, Any] = {"trajectory": trajectory_rows(trajectory), "instruction": instruction or ""}
    if trajectory.timestep != TIMESTEP:
        document["timestep"] = float(trajectory.timestep)
    surroundings = documents.scene_dict(Scene() if scene is None else scene)
    around = {key: value for key, value in surroundings.items() if key not in ("trajectory", "instruction", "timestep")}
    return {**document, **around, **documents.plain(extra or {})}


def dumps(document: Mapping[str, Any], file: str) -> str:
    """Write a document as canonical JSON: one waypoint or object a line, floats so that they read back exactly."""
    try:
        return _layout(documents.plain(document), "") + "\n"
    except (TypeError, ValueError, OverflowError) as error:
        raise FormatError(file, f"cannot be written as JSON: {error}") from None
    except RecursionError:
        raise FormatError(file, "cannot be written as JSON: nested too deeply") from None


def parse_object(content: str, file: str) -> dict[str, Any]:
    """Parse the text of a JSON file whose top level is an object.

    Unlike Python's parser it refuses an object that repeats a key, and text that is not valid Unicode.
    """
    try:
        document = json.loads(content, object_pairs_hook=_unique)
        if _HALF_SURROGATE.search(content):
            json.dumps(document, ensure_ascii=False).encode("utf-8")
    except json.JSONDecodeError as error:
        what = error.msg[:1].lower() + error.msg[1:]
        raise FormatError(file, f"this is not JSON: {what} (line {error.lineno}, column {error.colno})") from None
    except _RepeatedKeyError as error:
        raise FormatError(file, "stands twice in one JSON object; keep one of the two", key=error.key) from None
    except tuple(_UNREADABLE) as error:
        raise FormatError(file, next(why for kind, why in _UNREADABLE.items() if isinstance(error, kind))) from None
    if not isinstance(document, dict):
        raise FormatError(file, f"the top level is {documents.show(document)}, expected an object")
    return document


_UNREADABLE: Mapping[type[Exception], str] = {
    UnicodeEncodeError: "a text holds half of a surrogate pair (\\ud800-\\udfff); write the character",
    RecursionError: f"nested too deeply; ovita reads up to {MAX_DEPTH} levels",
    MemoryError: "the file is too large for the memory of this machine",
    ValueError: "a whole number in it has thousands of digits; shorten it",
}


def check_values(document: Mapping[str, Any], file: str) -> None:
    """Check that every number in a parsed document is finite, and that it is not nested too deeply."""
    stack: list[tuple[Any, str, int]] = [(document, "", 0)]
    while stack:
        value, path, depth = stack.pop()
        if depth > MAX_DEPTH:
            raise FormatError(file, f"nested too deeply; ovita reads up to {MAX_DEPTH} levels")
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            if isinstance(item, float):
                if not math.isfinite(item):
                    raise FormatError(file, f"is {item}, not a finite number", key=_join(path, key))
            elif isinstance(item, (dict, list)):
                stack.append((item, _join(path, key), depth + 1))


def is_adaptation(document: Mapping[str, Any]) -> bool:
    """Whether a parsed document is marked as a saved adaptation, of any version."""
    schema = document.get("schema")
    return isinstance(schema, str) and schema.startswith("ovita.adaptation/")


def check_schema(document: Mapping[str, Any], file: str) -> None:
    """Check that a parsed document is an adaptation of the version that ovita reads."""
    schema = document.get("schema")
    if schema == ADAPTATION_SCHEMA:
        return
    if schema is None:
        raise FormatError(file, f"no schema is given, expected {ADAPTATION_SCHEMA!r}; this is not a saved adaptation")
    raise FormatError(
        file, f"is {documents.show(schema)}; this version of ovita reads {ADAPTATION_SCHEMA!r}", key="schema"
    )


def _join(path: str, key: str | int) -> str:
    if isinstance(key, int):
        return f"{path}[{key}]"
    return f"{path}.{documents.brief(key)}" if path else documents.brief(key)


class _RepeatedKeyError(Exception):
    def __init__(self, key: str) -> None:
        self.key = documents.brief(key)


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        seen: set[str] = set()
        raise _RepeatedKeyError(next(key for key, _ in pairs if key in seen or seen.add(key)))  # type: ignore[func-returns-value]
    return found


def _only(document: Mapping[str, Any], keys: Collection[str]) -> dict[str, Any]:
    return {key: document[key] for key in keys if key in document}


def _scene(document: Mapping[str, Any], file: str) -> Scene:
    with errors_of(file):
        return documents.scene_from_dict(document)


def _named(robot: object) -> tuple[str | None, tuple[str, ...]]:
    """The robot's name in a file, or None and a note where what stands there is none."""
    if robot is None or (isinstance(robot, str) and robot.strip()):
        return robot, ()
    return None, (f"robot is {documents.show(robot)}, which names no robot; no limits of a robot are enforced",)


def _scene_part(document: Mapping[str, Any], file: str) -> Mapping[str, Any]:
    scene = document.get("scene")
    if not isinstance(scene, (dict, type(None))):
        raise FormatError(file, f"is {documents.show(scene)}, expected an object with 'objects'", key="scene")
    return scene or {}


def _robot_of_adaptation(robot: object) -> tuple[str | None, tuple[str, ...]]:
    """The preset that an adaptation was made for; its limits are those of the file, so others are only remarked."""
    if not isinstance(robot, Mapping):
        return (robot, ()) if isinstance(robot, str) else (None, ())
    name = robot.get("name")
    if not isinstance(name, str):
        return None, ()
    if name in PRESETS and documents.plain(asdict(PRESETS[name])) == robot:
        return name, ()
    return None, (f"the limits of the robot {documents.brief(name)!r} are not taken over; name its file again",)


def _trajectory(document: Mapping[str, Any], key: str, file: str) -> tuple[Trajectory, tuple[str, ...]]:
    if document.get(key) is None:
        raise FormatError(file, _no_trajectory(document, key))
    given = document.get("timestep")
    with errors_of(file):
        return read_rows(
            document[key], key=key, timestep=TIMESTEP if given is None else documents.timestep_of(given, file)
        )


def _instruction(document: Mapping[str, Any], file: str) -> str:
    return str(documents.validated(str, document.get("instruction") or "", file, "instruction"))


def _no_trajectory(document: Mapping[str, Any], key: str) -> str:
    if str(document.get("schema")).startswith("ovita.skill/"):
        return "this is a skill, not a trajectory; make one of it: ovita generate"
    if key == "adapted":
        return f"this adaptation has no adapted trajectory (its status is {documents.show(document.get('status'))})"
    if key in document:
        return "the trajectory is null; give a list of rows [x, y, z, speed]"
    guess = documents.nearest(key, list(document))
    hint = f"rename {documents.brief(guess)!r} to 'trajectory'" if guess else "give a list of rows [x, y, z, speed]"
    if not document:
        return f"the object is empty; {hint} under the key 'trajectory'"
    return f"there is no key 'trajectory', only {documents.listing(document)}; {hint}"


def _layout(value: Any, indent: str) -> str:
    if isinstance(value, documents.Table):
        return _lines(value.text, indent)
    if not value or _is_flat(value):
        return _compact(value)
    deeper = indent + " "
    if isinstance(value, dict):
        lines = (f"{_compact(key)}: {_layout(item, deeper)}" for key, item in value.items())
        return _short(value, indent) or _block("{}", lines, indent)
    if documents.is_table(value):
        return _lines(_compact(value), indent)
    return _block("[]", (_layout(item, deeper) for item in value), indent)


def _short(value: dict[str, Any], indent: str) -> str:
    """A small object inside another as one line; "" where it is too long."""
    small = bool(indent) and len(value) <= 12 and all(map(_is_flat, value.values()))
    line = _compact(value) if small else ""
    return line if len(line) <= _LINE else ""


def _block(brackets: str, lines: Iterable[str], indent: str) -> str:
    return f"{brackets[0]}\n{indent} " + f",\n{indent} ".join(lines) + f"\n{indent}{brackets[1]}"


def _lines(table: str, indent: str) -> str:
    """The text of a table with a row a line."""
    return _block("[]", [table[1:-1].replace("], [", f"],\n{indent} [")], indent)


def _is_flat(value: Any) -> bool:
    """Whether a value is a scalar or a list of scalars."""
    return not isinstance(value, (list, dict, documents.Table)) or (
        isinstance(value, list) and not any(isinstance(item, (list, dict)) for item in value)
    )


def _compact(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


_SEALED = (
    *("schema", "instruction", "status", "original", "adapted", "timestep"),
    *("scene", "robot", "contacts", "constraints", "options"),
)


def seal(document: Mapping[str, Any]) -> str:
    """SHA-256 of trajectories, scene, limits and verdict.

    It tells whether a saved adaptation was edited; it is no signature, since anyone can compute it.
    """
    content = (f'"{key}": {_sorted(documents.plain(document.get(key)))}' for key in sorted(_SEALED))
    return sha256(f"{{{', '.join(content)}}}".encode()).hexdigest()


def _sorted(value: Any) -> str:
    return value.text if isinstance(value, documents.Table) else json.dumps(value, sort_keys=True, allow_nan=False)


def save_document(path: str | os.PathLike[str], document: Mapping[str, Any]) -> None:
    """Write an adaptation atomically as JSON, with its schema as the first key.

    Raises:
        FormatError: If it cannot be written there, holds NaN or what JSON does not know, or has another schema.
    """
    file = file_name(path)
    complete = {"schema": ADAPTATION_SCHEMA, **document}
    check_schema(complete, file)
    atomic_write(path, dumps(complete, file))


def load_document(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read an adaptation that `save_document` wrote.

    Raises:
        FormatError: If the file cannot be read, is not JSON, has another schema, or holds a number that is not finite.
    """
    file = file_name(path)
    document = parse_object(read_text(path), file)
    if "schema" not in document and "trajectory" in document:
        raise FormatError(file, "this is a task, not a saved adaptation; run `ovita adapt` on it first")
    check_schema(document, file)
    check_values(document, file)
    return document


def is_adaptation_file(path: str | os.PathLike[str]) -> bool:
    """Whether a file is marked as a saved adaptation; False for any other JSON or format, and for an address."""
    if is_address(os.fspath(path)) or (suffix(path) != ".json" and os.path.exists(path)):
        return False
    examine(path)
    return is_adaptation(parse_object(read_text(path), file_name(path)))


def is_skill_file(path: str | os.PathLike[str]) -> bool:
    """Whether a file begins as a saved skill does, of any version; False for any other JSON or format."""
    if suffix(path) != ".json" or not os.path.isfile(path):
        return False
    with open(path, "rb") as stream:
        return b'"ovita.skill/' in stream.read(_BEGINNING)
