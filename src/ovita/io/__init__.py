"""Files in and out, one module a format; the ending of a file's name chooses it.

.json                     the public OVITA layout, and saved adaptations
.csv, .pose.csv           one waypoint a row; poses only
.tum, .txt                TUM trajectory text
.mcap, .db3, .bag         ROS bags (extra `ros`)
.plan                     QGroundControl plans
.waypoints, .wpl, .txt    QGC WPL 110 missions
others                    by plug-ins (`ovita.plugins`)
a folder                  of a LeRobot data set (extra `lerobot`), which is read episode by episode

Whatever cannot be read or written, here or in a module of this package, is a `FormatError` with the file, the key and
the index at fault (a `TrajectoryError` or `SceneError` where no file is known), a link that fails is a `LinkError`, and
a package that is not installed a `MissingExtra`; each says what to do.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import ovita.plugins as plugins
from ovita.errors import FormatError, RequestError, TrajectoryError
from ovita.io import json_
from ovita.io.documents import NONE, VERDICT, Choices, Task, load_robot, scene_dict, scene_from_dict
from ovita.io.files import (
    BAGS,
    atomic_write,
    errors_of,
    examine,
    file_name,
    is_address,
    is_bag,
    is_data_set,
    read_text,
    suffix,
)
from ovita.io.geodesy import MISSION, ROS
from ovita.io.json_ import is_adaptation_file as is_adaptation
from ovita.io.json_ import is_skill_file as is_skill
from ovita.io.json_ import load_document, save_document
from ovita.io.tables import START, dumps_csv, dumps_poses, dumps_tum, looks_like_tum, parse_csv, parse_tum
from ovita.io.waypoints import excerpt, trajectory_from_rows, trajectory_rows
from ovita.paths.scene import Frame, Scene, transformed
from ovita.paths.trajectory import Trajectory
from ovita.text import called_as, shortened

__all__ = [
    "READ",
    "WRITTEN",
    "Choices",
    "Task",
    "atomic_write",
    "is_adaptation",
    "is_address",
    "is_mission",
    "is_skill",
    "load",
    "load_bare",
    "load_document",
    "load_robot",
    "load_scene",
    "load_task",
    "open_task",
    "rendered",
    "save_document",
    "save_task",
    "save_trajectory",
    "scene_dict",
    "scene_from_dict",
    "trajectory_from_rows",
    "trajectory_rows",
    "with_scene",
    "writable",
]

_MISSIONS = (".waypoints", ".wpl")
_POSES = (".pose.csv", ".poses.csv")

WRITTEN = (".json", ".csv", ".pose.csv", ".tum", ".txt", ".plan", *_MISSIONS, *BAGS)
"""Endings of the files that trajectories are written to."""

READ = WRITTEN
"""Endings of the files that trajectories are read from; so are folders with a ROS 2 bag or a LeRobot data set."""

_EMPTY = Scene()
_PARSED: Mapping[str, Callable[[str, str], Task]] = {".json": json_.parse, ".csv": parse_csv, ".tum": parse_tum}


@called_as('load_task("scene.json")')
def load_task(path: str | os.PathLike[str], choices: Choices = NONE) -> Task:
    """Read a trajectory, with scene and instruction if present, from a file of any known format.

    A saved adaptation gives its adapted trajectory, so that a result can be adapted again.

    Args:
        path: Its ending says the format.
        choices: What the format leaves open: the topic of a bag, the home of a mission.

    Raises:
        FormatError: If the file cannot be read or something in it is malformed; names the file, key and index.
        MissingExtra: If the format needs a package that is not installed.
    """
    task = _load(_named(path, "load_task"), choices)
    task = task if is_bag(path) else _excerpt(task, choices)
    said = (f"the file says of its trajectory: {task.verdict}",) if task.verdict else ()
    return replace(task, notes=(*task.notes, *said)) if said else task


@called_as('load("scene.json")')
def load(
    place: str | os.PathLike[str],
    scene: Scene | str | os.PathLike[str] | None = None,
    *,
    frame: str | None = None,
    choices: Choices = NONE,
) -> Task:
    """Read a trajectory with its surroundings from a file of any known format, or from a robot's address.

    A saved adaptation gives its adapted trajectory; `Adaptation.load` reads all of it.

    Args:
        place: A file, a folder with a ROS 2 bag, or an address such as "ros2:/path".
        scene: A scene, or the JSON file that holds its objects; None for those of the file itself.
        frame: Which way is left: "rfu", "flu" or "ned"; None for what the file says.
        choices: What the format leaves open: the topic of a bag, the home of a mission.

    Raises:
        FormatError: If a file cannot be read or something in it is malformed; names the file, key and index.
        MissingExtra: If the format needs a package that is not installed.
    """
    _named(place, "load")
    if scene is None or isinstance(scene, str | os.PathLike):
        held = None if scene is None else os.fspath(scene)
        return open_task(os.fspath(place), scene_file=held, frame=frame, choices=choices)
    if not isinstance(scene, Scene):
        raise RequestError("the scene is a Scene or the name of a JSON file with its objects")
    return with_scene(open_task(os.fspath(place), frame=frame, choices=choices), scene)


def _named(path: object, function: str) -> str | os.PathLike[str]:
    if not isinstance(path, str | os.PathLike):
        raise RequestError(f"{function} takes the name of a file, not {shortened(path)}")
    return path


def _load(path: str | os.PathLike[str], choices: Choices) -> Task:
    if is_bag(path):
        from ovita.io import bags

        return bags.load(path, choices)
    if is_data_set(path):
        from ovita.io.lerobot import episode

        return episode(path, choices.message)
    examine(path)
    ending, file = suffix(path), file_name(path)
    if ending not in READ:
        return _read_by_a_plugin(path, ending, file)
    content = read_text(path)
    if ending in _PARSED:
        return _PARSED[ending](content, file)
    from ovita.io.mission_files import looks_like_wpl, parse_plan, parse_wpl

    if ending == ".plan":
        return parse_plan(content, file, choices.home, choices.heading)
    if ending != ".txt" or looks_like_wpl(content):
        return parse_wpl(content, file, choices.home, choices.heading)
    if not looks_like_tum(content):
        raise FormatError(file, "this is neither TUM text (time x y z qx qy qz qw) nor a QGC WPL 110 mission")
    return parse_tum(content, file)


def _read_by_a_plugin(path: str | os.PathLike[str], ending: str, file: str) -> Task:
    with errors_of(path):
        parse = _of_a_plugin(ending, "parse")
    if parse is None:
        raise _unknown_suffix(path, "reads")
    content = read_text(path)
    with errors_of(file):
        task = parse(content, file)
    if not isinstance(task, Task):
        raise FormatError(file, f"the plug-in of {ending} gave a {type(task).__name__}, not a Task")
    return task


def open_task(place: str, *, scene_file: str | None = None, frame: str | None = None, choices: Choices = NONE) -> Task:
    """Read a task from a file or an address, optionally with objects of a scene file and in another frame.

    Where the format fixes the axes (a ROS bag, a mission), another frame means turning the waypoints into it; a scene
    file that states no frame is taken to be in that of the waypoints. Elsewhere the frame says how to read the file.

    Raises:
        FormatError: If a file cannot be read.
        LinkError: If the other side of an address does not answer.
        MissingExtra: If a package is not installed.
    """
    task = _receive(place, choices) if is_address(place) else load_task(place, choices)
    if scene_file is not None:
        task = with_scene(task, *load_scene(scene_file), frame)
    if frame is None or task.scene.frame == Frame(frame):
        return task
    if not task.fixed_frame:
        return replace(task, scene=replace(task.scene, frame=Frame(frame)))
    said = f"turned from {task.scene.frame.name} into {frame} ({Frame(frame).describe()})"
    moved = transformed(task.trajectory, task.scene.frame, Frame(frame))
    return replace(task, trajectory=moved, scene=task.scene.in_frame(Frame(frame)), notes=(*task.notes, said))


def _receive(place: str, choices: Choices) -> Task:
    from ovita.io.links import Address, receive

    task = receive(Address.parse(place), choices)
    return task if place.startswith("ros2:") else _excerpt(task, choices)


def _excerpt(task: Task, choices: Choices) -> Task:
    if choices.span is None:
        return task
    with errors_of(task.path):
        if MISSION in task.scene.extra:
            raise TrajectoryError("a mission records no times; leave --from and --to out")
        return replace(task, trajectory=excerpt(task.trajectory, choices))


def with_scene(task: Task, scene: Scene, stated: bool = True, frame: str | None = None) -> Task:
    """The task with the objects of another scene; what its own keeps of a bag or a mission stays.

    Waypoints whose format fixes their axes are turned into the scene's frame. A scene that has not `stated` its frame
    is taken to be in `frame`, or in that of the waypoints.
    """
    if not task.fixed_frame:
        return replace(task, scene=scene)
    others = {key: value for key, value in scene.extra.items() if key not in (MISSION, ROS)}
    kept, notes, trajectory = others | dict(task.scene.extra), task.notes, task.trajectory
    if not stated:
        scene = replace(scene, frame=task.scene.frame if frame is None else Frame(frame))
        notes += (f"the scene file states no frame; its objects were taken to be in {scene.frame.name}",)
    if scene.frame != task.scene.frame:
        trajectory = transformed(trajectory, task.scene.frame, scene.frame)
        notes += (f"turned from {task.scene.frame.name} into the scene's frame {scene.frame.name}",)
    return replace(task, trajectory=trajectory, scene=replace(scene, extra=kept), notes=notes)


def load_scene(path: str | os.PathLike[str]) -> tuple[Scene, bool]:
    """Read a scene from a JSON file that need not hold a trajectory; say whether it states its frame.

    Raises:
        FormatError: If the file cannot be read or something in it is malformed.
    """
    examine(path)
    if suffix(path) != ".json":
        raise FormatError(file_name(path), "scenes are read from .json files")
    return json_.parse_scene(read_text(path), file_name(path))


def load_bare(path: str | os.PathLike[str]) -> Task | None:
    """The task, with a path that stands still, of a JSON file with objects and no trajectory; None for any other file.

    Raises:
        FormatError: If it is such a file and something in it is malformed, or it is not JSON.
    """
    if is_address(os.fspath(path)) or is_bag(path) or suffix(path) != ".json":
        return None
    examine(path)
    return json_.parse_bare(read_text(path), file_name(path))


@called_as('save_task("scene.json", Task(trajectory, scene))')
def save_task(path: str | os.PathLike[str], task: Task, choices: Choices = NONE) -> tuple[str, ...]:
    """Write a task so that `load_task` reads it back, and return notes on what the format cannot hold.

    Raises:
        FormatError: As `save_trajectory` does.
    """
    if not isinstance(task, Task):
        raise RequestError(f"save_task takes the name of a file and a Task, not {shortened(task)}")
    extra = dict(task.extra) if task.robot is None else {**task.extra, "robot": task.robot}
    return save_trajectory(
        path, task.trajectory, task.scene, task.instruction, extra, choices=choices, verdict=task.verdict
    )


@called_as('save_trajectory("path.csv", trajectory)')
def save_trajectory(
    path: str | os.PathLike[str],
    trajectory: Trajectory,
    scene: Scene | None = None,
    instruction: str | None = None,
    extra: Mapping[str, Any] | None = None,
    *,
    choices: Choices = NONE,
    verdict: str = "",
) -> tuple[str, ...]:
    """Write a trajectory atomically, in the format that the file's ending says.

    Args:
        path: Ends in one of `WRITTEN`, or in a slash for the folder of a ROS 2 bag.
        trajectory: The waypoints, in the scene's frame.
        scene: What surrounds them.
        instruction: The request.
        extra: Further top-level keys.
        choices: What the format leaves open: topic and message of a bag, the home of a mission.
        verdict: One line such as "infeasible: ..." that the file carries wherever its format has room; "" for none.

    Returns:
        What the format does not hold, each a sentence.

    Raises:
        FormatError: If the file cannot be written there, something has no place in JSON, or a mission has no home.
        MissingExtra: If the format needs a package that is not installed.
    """
    if not isinstance(trajectory, Trajectory):
        raise RequestError("save_trajectory takes a Trajectory; make one of an array: Trajectory.from_array(array)")
    _named(path, "save_trajectory")
    if os.fspath(path).endswith(("/", os.sep)):
        from ovita.io import bags

        with errors_of(path):
            return bags.save_folder(path, trajectory, scene or _EMPTY, choices, " ".join(verdict.split()))
    content, notes = rendered(path, trajectory, scene, instruction, extra, choices=choices, verdict=verdict)
    atomic_write(path, content)
    return notes


def rendered(
    path: str | os.PathLike[str],
    trajectory: Trajectory,
    scene: Scene | None = None,
    instruction: str | None = None,
    extra: Mapping[str, Any] | None = None,
    *,
    choices: Choices = NONE,
    verdict: str = "",
) -> tuple[str | bytes, tuple[str, ...]]:
    """What `save_trajectory` writes, and its notes, without writing a file."""
    file, ending, scene = file_name(path), suffix(path), scene or _EMPTY
    verdict = " ".join(verdict.split())
    if ending == ".json":
        carried = {**(extra or {}), VERDICT: verdict} if verdict else extra
        try:
            return json_.dumps(json_.document_of(trajectory, scene, instruction, carried), file), ()
        except (TypeError, ValueError, RecursionError) as error:
            raise FormatError(file, f"cannot be written as JSON: {error}") from None
    with errors_of(path):
        if ending in BAGS:
            from ovita.io import bags

            return bags.dumps(path, trajectory, scene, choices, verdict)
        if is_mission(os.fspath(path), scene):
            from ovita.io import mission_files

            return mission_files.dumps(file, trajectory, scene, choices, verdict, plan=ending == ".plan")
        if ending in WRITTEN:
            return _table(file, ending, trajectory, scene, (extra or {}).get(START), verdict)
        return _written_by_a_plugin(path, ending, trajectory, scene), ()


def _written_by_a_plugin(
    path: str | os.PathLike[str], ending: str, trajectory: Trajectory, scene: Scene
) -> str | bytes:
    dumps = _of_a_plugin(ending, "dumps")
    if dumps is None:
        raise _unknown_suffix(path, "writes")
    content = dumps(trajectory, scene)
    if not isinstance(content, str | bytes):
        raise FormatError(file_name(path), f"the plug-in of {ending} gave a {type(content).__name__}, no text or bytes")
    return content


def _table(
    file: str, ending: str, trajectory: Trajectory, scene: Scene, start: object, verdict: str
) -> tuple[str, tuple[str, ...]]:
    """A CSV file or TUM text, and what these do not hold."""
    if ending == ".csv":
        content, notes = (dumps_poses if file.lower().endswith(_POSES) else dumps_csv)(trajectory, verdict)
    else:
        content, notes = dumps_tum(trajectory, start if isinstance(start, int | float) else 0.0, verdict)
    if scene.frame.name != "rfu":
        name = "a CSV file" if ending == ".csv" else "TUM text"
        notes += (f"{name} holds no frame; say --frame {scene.frame.name} when you read {file}",)
    if len(scene):
        notes += (f"{Path(file).name} holds no objects; keep them in a scene file (--scene)",)
    return content, notes


def is_mission(place: str, scene: Scene) -> bool:
    """Whether what is written to a file or sent to an address there is a drone's mission."""
    if is_address(place):
        from ovita.io.links import Address

        return place.startswith("mavlink:") and Address.parse(place).options.get("type") != "setpoints"
    ending = suffix(place)
    return ending in (".plan", *_MISSIONS) or (ending == ".txt" and MISSION in scene.extra)


def writable(path: str | os.PathLike[str]) -> bool:
    """Whether a trajectory can be written to a file of that ending."""
    ending = suffix(path)
    return ending in WRITTEN or _of_a_plugin(ending, "dumps") is not None


def _of_a_plugin(ending: str, function: str) -> Callable[..., Any] | None:
    """What a plug-in reads or writes files of an ending with."""
    name = ending.removeprefix(".")
    found = plugins.load("formats", name, RequestError) if name else None
    return getattr(plugins.Guarded(found, "formats", name), function, None)


def _unknown_suffix(path: str | os.PathLike[str], does: str) -> FormatError:
    ending = suffix(path)
    if does == "writes" and os.fspath(path).endswith(("/", os.sep)):
        return FormatError(file_name(path), "only ovita convert writes a bag as a folder; name a .mcap or .db3 file")
    what = f"the ending {ending}" if ending else "a name without an ending"
    named = (*(READ if does == "reads" else WRITTEN), *(f".{name}" for name in plugins.entries("formats")))
    return FormatError(file_name(path), f"{what} says nothing about the format; ovita {does} {', '.join(named)}")
