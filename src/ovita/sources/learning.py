"""Learning: demonstrations in, a skill out."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np

from ovita.errors import RequestError
from ovita.io import Task
from ovita.paths.geometry import extent
from ovita.paths.trajectory import Array, Trajectory
from ovita.sources import demonstrations
from ovita.sources.demonstrations import Aligned, Alignment, read_demonstrations
from ovita.sources.dmp import Dmp
from ovita.sources.probabilistic import Promp
from ovita.sources.skills import FINEST, FRAMED, KINDS, Model, Moments, Skill, SkillKind
from ovita.sources.taskframes import (
    GOAL,
    START,
    TaskFrame,
    frames_of,
    local,
    mean_orientation,
    moments,
    off_the_way,
    vectors,
)
from ovita.sources.tpgmm import COMPONENTS, Mixture
from ovita.text import called_as


@called_as('learn(["a.csv", "b.csv"], "promp")')
def learn(
    demos: Sequence[Task | Trajectory | str | os.PathLike[str]],
    kind: SkillKind = "kmp",
    *,
    frames: Sequence[str] = (),
    align: Alignment = "dtw",
    components: int = COMPONENTS,
) -> Skill:
    """Learn a skill from demonstrations of one movement.

    Args:
        demos: Trajectories, tasks (whose scenes hold the objects) or files.
        kind: The kind of primitive.
        frames: Names of the objects, or "start" and "goal", that the movement is relative to; a "tpgmm" without names
            takes its start and its goal.
        align: How moments of the demonstrations are matched.
        components: Number of Gaussians of a "tpgmm".

    Raises:
        RequestError: If the kind does not exist, or there are too few demonstrations for it.
        FormatError: If a file cannot be read, or demonstrations differ in frame, unit or direction.
        UnknownObject: If a demonstration lacks a task frame's object.
    """
    if kind not in KINDS:
        raise RequestError(f"there is no kind of skill {kind!r}; the kinds are {', '.join(KINDS)}")
    if frames and kind not in FRAMED:
        raise RequestError(f"a {kind} has no task frames; use --kind {' or '.join(FRAMED)}")
    tasks = demonstrations.named([task for demo in demos for task in _tasks(demo)])
    said = demonstrations.too_few(len(tasks), kind)
    frames = tuple(frames) or ((START, GOAL) if kind == "tpgmm" else ())
    around = [_frames(frames, task) for task in tasks]
    agreeing = [_agreeing(some) for some in around]
    seen = [local(one, t.trajectory.positions, None)[0] for one, t in zip(agreeing, tasks, strict=True)]
    said += demonstrations.compared(tasks, seen) + demonstrations.without_orientations(tasks)
    said += demonstrations.pauses(tasks)
    together = demonstrations.aligned([task.trajectory for task in tasks], seen, align)
    views, bases = _views(together, around)
    size = float(np.mean([extent(one) for one in together.positions]))
    return Skill(
        kind,
        _fitted(kind, together.phases, views, together.positions, size, components),
        frames,
        bases,
        together.speeds.mean(axis=0),
        together.positions[:, 0].mean(axis=0),
        together.positions[:, -1].mean(axis=0),
        size,
        len(tasks),
        tasks[0].scene,
        notes=said,
        timestep=tasks[0].trajectory.timestep,
    )


def _tasks(demo: Task | Trajectory | str | os.PathLike[str]) -> Sequence[Task]:
    if isinstance(demo, Task):
        return (demo,)
    return (Task(demo),) if isinstance(demo, Trajectory) else read_demonstrations([demo])


def _frames(names: Sequence[str], task: Task) -> tuple[TaskFrame, ...]:
    ends = task.trajectory.positions
    return frames_of(names, task.scene, ends[0], ends[-1])


def _agreeing(frames: Sequence[TaskFrame]) -> TaskFrame:
    """The frame in which demonstrations should look alike: that of the first object, else the world."""
    return next((one for one in frames if one.name not in (START, GOAL)), TaskFrame())


def _views(together: Aligned, around: Sequence[Sequence[TaskFrame]]) -> tuple[list[Array], Array | None]:
    """The demonstrations as vectors (D, T, d) as seen from each frame, and the orientations (J, 4) they are about."""
    views: list[Array] = []
    bases: list[Array] = []
    for frames in zip(*around, strict=True):
        turns = together.orientations
        poses = [
            local(frame, together.positions[i], None if turns is None else turns[i]) for i, frame in enumerate(frames)
        ]
        turned = [one for _, one in poses if one is not None]
        base = mean_orientation(np.stack(turned)) if turned else None
        views.append(np.stack([vectors(positions, orientations, base) for positions, orientations in poses]))
        bases += [] if base is None else [base]
    return views, np.stack(bases) if bases else None


def _fitted(
    kind: SkillKind, phases: Array, views: Sequence[Array], positions: Array, size: float, components: int
) -> Model:
    if kind == "dmp":
        return Dmp.fitted(phases, views[0].mean(axis=0))
    if kind == "promp":
        return Promp.fitted(phases, views[0])
    if kind == "tpgmm":
        return Mixture.fitted(phases, views, components)
    means, covariances = zip(*(moments(rows, _floor(rows.shape[2], size)) for rows in views), strict=True)
    way, about = moments(off_the_way(positions, phases), _floor(3, size))
    return Moments(np.stack(means), np.stack(covariances), way, about)


def _floor(d: int, size: float) -> Array:
    """Variances (d,) below which demonstrations are taken to agree."""
    return np.array([FINEST * size] * 3 + [FINEST * 3.0] * (d - 3)) ** 2
