"""From what a person names to a pool of grounds: random scenes, files of tasks, data sets, skills, bare scenes."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from itertools import chain, islice, permutations
from pathlib import Path

from ovita.augment.ground import GroundPool, Mixed, RandomScenes, Tasks
from ovita.bench.generate import SETTINGS
from ovita.errors import FormatError, OvitaError, RequestError
from ovita.io import Task, load_bare, load_robot, load_task
from ovita.io.files import is_bag, suffix
from ovita.io.json_ import is_skill_file
from ovita.limits import verify
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory

RANDOM = "random"

ENDINGS = (".json", ".csv", ".tum", ".waypoints", ".wpl", ".plan", ".mcap", ".db3", ".bag")
"""Endings of the files of a folder that are taken."""

WAYS = 12
"""At most so many trajectories are planned in a scene that has none, from object to object."""

Given = str | os.PathLike[str] | Task | Trajectory
"""A source: a name as on the command line, or a task or trajectory in memory."""


def open_pool(
    sources: Iterable[Given] = (), *, robot: str | None = None, waypoints: int | None = None
) -> tuple[GroundPool, tuple[str, ...]]:
    """The pool of some sources, taken in turn, and notes on those that were left out.

    Args:
        sources: "random" or "random:SCALE"; files of trajectories of any known format; folders of them; folders of
            LeRobot data sets; skills; scenes without a trajectory, in which ways from object to object are planned;
            tasks and trajectories. None means random scenes of every scale.
        robot: Whose limits hold in all that is given; None takes what each file names, else none.
        waypoints: Of random scenes and generated trajectories; None leaves it to them.

    Raises:
        RequestError: If nothing can be used.
        FormatError: If a file that was named cannot be read; in a folder such a file is left out, with a note.
        RobotError: If there is no such robot.
    """
    given = list(sources) or [RANDOM]
    if robot is not None:
        load_robot(robot)
    scales = dict.fromkeys(scale for one in given if isinstance(one, str) for scale in _scales(one))
    notes: list[str] = []
    of_file = partial(_of_file, robot=robot, waypoints=waypoints)
    named = chain.from_iterable(_of_source(source, number, notes, of_file) for number, source in enumerate(given))
    found = tuple(_usable(named, robot, notes))
    pools: list[GroundPool] = [RandomScenes(tuple(scales), waypoints)] if scales else []
    pools += [Tasks(found)] if found else []
    if not pools:
        said = [*(f"{note}." for note in notes), "No source is left; name files, folders, or random"]
        raise RequestError(" ".join(said))
    return (pools[0] if len(pools) == 1 else Mixed(tuple(pools))), tuple(notes)


def _scales(name: str) -> tuple[str, ...]:
    """The scales of random scenes that a source names; () for any other source."""
    head, _, scale = name.partition(":")
    if head != RANDOM:
        return ()
    if scale and scale not in SETTINGS:
        raise RequestError(f"{name!r}: there are random scenes for {', '.join(SETTINGS)}")
    return (scale,) if scale else tuple(SETTINGS)


Named = Iterator[tuple[str, Task, str]]
"""Tasks, each with the name of its source and what identifies its content."""


def _usable(named: Named, robot: str | None, notes: list[str]) -> Named:
    """The tasks that go somewhere and keep the limits of their robot; notes say why others do not."""
    for name, task, what in named:
        task = task if robot is None else replace(task, robot=robot)
        why = _obstacle(name, task)
        if why:
            notes.append(f"left out: {name} {why}")
        else:
            yield name, task, what


def _obstacle(name: str, task: Task) -> str:
    try:
        robot = load_robot(task.robot or "none")
    except OvitaError as error:
        raise RequestError(f"{name}: {error}; give --robot") from None
    path = task.trajectory
    if path.length <= 0.0:
        return "stands still"
    checks = verify(path, task.scene, robot, proposed=path, original=path)
    broken = ", ".join(dict.fromkeys(c.name for c in checks if c.unit == "m" and not c.held))
    return f"itself breaks limits of the robot {robot.name} ({broken}); see --robot" if broken else ""


def _of_source(source: Given, number: int, notes: list[str], of_file: Callable[[Path, str], Named]) -> Named:
    if isinstance(source, Task | Trajectory):
        task = source if isinstance(source, Task) else Task(source)
        yield f"task:{number:05d}", task, _digest(task.trajectory.to_array().tobytes())
    elif not _scales(os.fspath(source)):
        yield from _of_path(Path(source), notes, of_file)


def _of_path(path: Path, notes: list[str], of_file: Callable[[Path, str], Named]) -> Named:
    if not path.exists():
        raise RequestError(f"{path}: there is no such file or folder; random means random scenes")
    if path.is_dir() and not is_bag(path):
        yield from _of_folder(path, notes, of_file)
    else:
        yield from of_file(path, path.name)


def _of_folder(folder: Path, notes: list[str], of_file: Callable[[Path, str], Named]) -> Named:
    if (folder / "meta" / "info.json").is_file():
        from ovita.io.lerobot import episodes

        what = _digest((folder / "meta" / "info.json").read_bytes())
        yield from (_named(f"{folder.name}#{i:06d}", task, what) for i, task in enumerate(episodes(folder)))
        return
    for file in sorted(path for path in folder.rglob("*") if suffix(path) in ENDINGS and path.is_file()):
        name = file.relative_to(folder.parent).as_posix()
        try:
            yield from list(of_file(file, name))
        except (FormatError, RequestError) as error:
            notes.append(f"left out: {error}")


def _of_file(file: Path, name: str, *, robot: str | None, waypoints: int | None) -> Named:
    what = _digest(file.read_bytes()) if file.is_file() else "a folder"
    if suffix(file) == ".json" and is_skill_file(file):
        from ovita.sources.skills import Skill

        made = Skill.load(file).generate(waypoints=waypoints)
        yield _named(f"skill:{name}", made.task(), what)
        return
    bare = load_bare(file)
    if bare is None:
        yield _named(f"file:{name}", load_task(file), what)
        return
    ways = islice(_planned(bare.scene, robot or bare.robot, waypoints), WAYS)
    yield from (_named(f"plan:{name}#{i:02d}", task, what) for i, task in enumerate(ways))


def _planned(scene: Scene, robot: str | None, waypoints: int | None) -> Iterator[Task]:
    """Ways from object to object that are legal, in the order of the objects."""
    from ovita.sources.planner import WAYPOINTS, plan

    for start, goal in permutations(scene.names, 2):
        way = plan(scene, start=start, goal=goal, robot=robot or "none", waypoints=waypoints or WAYPOINTS)
        if way.ok:
            yield way.task(robot)


def _named(name: str, task: Task, what: str) -> tuple[str, Task, str]:
    return name, replace(task, path="", notes=(), verdict=""), what


def _digest(content: bytes) -> str:
    return f"sha256:{hashlib.sha256(content).hexdigest()}"
