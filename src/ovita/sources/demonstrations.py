"""Demonstrations: several recordings of one movement, read from files, compared and aligned in time."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ovita.errors import FormatError, RequestError
from ovita.io import Choices, Task, open_task
from ovita.io.documents import NONE
from ovita.io.files import is_data_set
from ovita.io.lerobot import episodes
from ovita.paths.geometry import extent
from ovita.paths.trajectory import Array, Trajectory, interpolate, nlerp, source_indices
from ovita.sources.taskframes import logarithm
from ovita.text import counted, length, listed

Alignment = Literal["dtw", "arc_length", "time"]
"""Moments of two demonstrations belong together by what is near in space (dynamic time warping of the paths), after the
same share of the path, or after the same share of the time."""

SAMPLES = 101
"""Number of moments at which demonstrations are compared."""

UNEQUAL = 8.0
"""A demonstration so many times larger or smaller than the others is taken to be in another unit."""

BACKWARDS = 0.5
"""A demonstration fits so much better when reversed that it is taken to run the other way."""

APART = 6.0
"""A demonstration so many times farther from the middle one than usual is pointed out."""

BAND = 0.15
"""Dynamic time warping shifts moments by at most this share of the movement."""

DETOUR = 0.1
"""What a step off the diagonal costs more in dynamic time warping, as a share."""

_OF_TWO = {
    "kmp": "it is taken to be the same in all directions",
    "promp": "the movement varies only along the way from one to the other",
}

LEVER = 0.1
"""Turning by a radian counts in an alignment as so many metres."""


@dataclass(frozen=True, eq=False)
class Aligned:
    """Demonstrations at the same phases.

    Args:
        phases: (T,), evenly from 0 to 1.
        positions: (D, T, 3) [m].
        orientations: (D, T, 4) unit quaternions wxyz, or None.
        speeds: (D, T) [m/s].
    """

    phases: Array
    positions: Array
    orientations: Array | None
    speeds: Array

    def __len__(self) -> int:
        return len(self.positions)


def read_demonstrations(
    places: Iterable[str | os.PathLike[str]],
    *,
    scene_file: str | None = None,
    frame: str | None = None,
    choices: Choices = NONE,
) -> tuple[Task, ...]:
    """Read demonstrations, one a file of any format, or a folder of LeRobot episodes; options as in `open_task`.

    Raises:
        FormatError: If a file cannot be read.
        MissingExtra: If a format needs a package that is not installed.
    """
    tasks: list[Task] = []
    for place in [os.fspath(place) for place in places]:
        if is_data_set(place):
            tasks += episodes(place)
        else:
            tasks.append(open_task(place, scene_file=scene_file, frame=frame, choices=choices))
    return tuple(tasks)


def named(tasks: Sequence[Task]) -> tuple[Task, ...]:
    """Demonstrations that all have a name to be spoken of: that of their file, else their number."""
    return tuple(t if t.path else replace(t, path=f"demonstration {i}") for i, t in enumerate(tasks, start=1))


def compared(tasks: Sequence[Task], seen: Sequence[Array]) -> tuple[str, ...]:
    """Check that demonstrations show one movement, and say what is doubtful about them.

    They should agree in the task frame in which their positions (N, 3) [m] are seen.

    Raises:
        FormatError: If one is in another frame or unit, or runs the other way, than the others.
    """
    _same_frame(tasks)
    sizes = np.array([extent(positions) for positions in seen])
    _same_unit(tasks, sizes)
    paths = np.stack([_even(positions) for positions in seen])
    forward, backward = _gaps(paths, paths), _gaps(paths, paths[:, ::-1])
    middle = int(np.argmin(np.minimum(forward, backward).sum(axis=1)))
    _same_direction(tasks, backward[middle] < BACKWARDS * forward[middle])
    usual = max(float(np.median(np.delete(forward[middle], middle))) if len(tasks) > 1 else 0.0, 0.02 * sizes.max())
    far = [(task, gap) for task, gap in zip(tasks, forward[middle], strict=True) if gap > APART * usual]
    return tuple(
        f"{task.path} lies {length(gap)} from {tasks[middle].path} on average, {gap / usual:.0f} times as far as is "
        "usual; leave it out if it shows something else"
        for task, gap in far
    )


def aligned(trajectories: Sequence[Trajectory], seen: Sequence[Array], by: Alignment = "dtw") -> Aligned:
    """Bring demonstrations to common phases.

    "dtw" and "arc_length" go by the path, so that a demonstrator's pace does not matter; the speeds are those shown at
    each place.

    The trajectories are in the world, and seen (N, 3) [m] in the task frame in which they should agree.
    """
    if any(one.orientations is None for one in trajectories):
        trajectories = [replace(one, orientations=None) for one in trajectories]
    sources = [_sources(one, by) for one in trajectories]
    if by == "dtw":
        views = [one.with_(positions=positions) for one, positions in zip(trajectories, seen, strict=True)]
        sources = _warped(views, sources)
    pairs = list(zip(trajectories, sources, strict=True))
    positions = np.stack([interpolate(one.positions, at) for one, at in pairs])
    speeds = np.stack([interpolate(one.speeds[:, None], at)[:, 0] for one, at in pairs])
    turns = [nlerp(one.orientations, at) for one, at in pairs if one.orientations is not None]
    return Aligned(np.linspace(0.0, 1.0, SAMPLES), positions, np.stack(turns) if turns else None, speeds)


def without_orientations(tasks: Sequence[Task]) -> tuple[str, ...]:
    """Say that orientations are left out where only some demonstrations have them."""
    have = [task.path for task in tasks if task.trajectory.orientations is not None]
    if not have or len(have) == len(tasks):
        return ()
    return (f"only {listed(have)} of {counted(len(tasks), 'demonstration')} has orientations; they are left out",)


def pauses(tasks: Sequence[Task]) -> tuple[str, ...]:
    """Say that pauses are left out: at a phase, a skill is somewhere, and goes on."""
    waits = [(task.path, int(task.trajectory.dwells.sum())) for task in tasks]
    who = [path for path, count in waits if count]
    return (f"the pauses of {listed(who)} are left out; a skill keeps none",) if who else ()


def _same_frame(tasks: Sequence[Task]) -> None:
    first = tasks[0]
    for task in tasks[1:]:
        if task.scene.frame != first.scene.frame:
            usual = first.scene.frame.name
            odd = f"is in the frame {task.scene.frame.name}, but {first.path} in {usual}"
            raise FormatError(task.path, f"{odd}; name the one that holds for all: --frame {usual}")


def _same_unit(tasks: Sequence[Task], sizes: Array) -> None:
    for task, size in zip(tasks, sizes, strict=True):
        if size == 0.0:
            raise FormatError(task.path, "never leaves its place; a demonstration shows a movement")
    # With two, the one that is larger than any robot's way is more likely to be the one in millimetres.
    usual = float(np.median(sizes)) if len(sizes) > 2 else float(sizes.min())
    times = np.maximum(sizes / usual, usual / sizes)
    i = int(np.argmax(times))
    if times[i] > UNEQUAL:
        odd = f"is {times[i]:.3g} times {'as large as' if sizes[i] > usual else 'smaller than'} the others"
        raise FormatError(tasks[i].path, f"{odd} ({length(sizes[i])} across); is it in metres?")


def _same_direction(tasks: Sequence[Task], flipped: NDArray[np.bool_]) -> None:
    """Refuse demonstrations of which some run the other way than one of them; the fewer are at fault."""
    odd = ~flipped if 2 * int(flipped.sum()) > len(tasks) else flipped
    if odd.any():
        wrong, right = tasks[int(np.argmax(odd))].path, tasks[int(np.argmin(odd))].path
        raise FormatError(wrong, f"runs the other way than {right}; reverse it or leave it out")


def _even(positions: Array) -> Array:
    return interpolate(positions, source_indices(positions, SAMPLES, "arc_length"))


def _gaps(paths: Array, others: Array) -> Array:
    """Mean distances (D, D) [m] between paths (D, T, 3), moment by moment."""
    return np.asarray(np.linalg.norm(paths[:, None] - others[None], axis=3).mean(axis=2))


def _sources(trajectory: Trajectory, by: Alignment) -> Array:
    """Fractional waypoints (T,) of a demonstration at even phases."""
    if by == "time":
        return trajectory.at(np.linspace(0.0, trajectory.duration, SAMPLES)).where
    return source_indices(trajectory.positions, SAMPLES, "arc_length")


def _warped(trajectories: Sequence[Trajectory], sources: Sequence[Array]) -> list[Array]:
    """The fractional waypoints (T,) after every demonstration was warped to the middle one."""
    rows = np.stack([_signature(one, at) for one, at in zip(trajectories, sources, strict=True)])
    gaps = np.linalg.norm(rows[:, None] - rows[None], axis=3).sum(axis=(1, 2))
    template = rows[int(np.argmin(gaps))]
    every = np.arange(SAMPLES, dtype=float)
    return [np.interp(warp(template, own), every, at) for own, at in zip(rows, sources, strict=True)]


def _signature(trajectory: Trajectory, at: Array) -> Array:
    """What an alignment compares (T, 3 or 6) [m]: position from the start on, and how far it has turned."""
    positions = interpolate(trajectory.positions, at)
    moved = positions - positions[0]
    if trajectory.orientations is None:
        return np.asarray(moved)
    turns = nlerp(trajectory.orientations, at)
    return np.column_stack([moved, LEVER * logarithm(turns[0], turns)])


def warp(template: Array, rows: Array) -> Array:
    """Where in rows (T, k) each row of a template (T, k) is found again, as fractional indices (T,), ends at the ends.

    Dynamic time warping within a band, made strictly increasing by averaging over a few neighbours.

    Source: Sakoe, Chiba, Dynamic programming algorithm optimization for spoken word recognition, 1978.
    """
    count = len(template)
    cost = np.linalg.norm(template[:, None] - rows[None], axis=2)
    every = np.arange(count)
    cost[np.abs(np.subtract.outer(every, every)) > max(BAND * count, 1.0)] = np.inf
    i, j = _cheapest(cost + 1e-9)
    found = np.bincount(i, j, count) / np.bincount(i, minlength=count)
    found[0], found[-1] = 0.0, count - 1.0
    reach = max(count // 25, 1)
    kernel = np.ones(2 * reach + 1) / (2 * reach + 1)
    # Mirrored through the ends, the mean there is the end itself.
    before, after = 2.0 * found[0] - found[reach:0:-1], 2.0 * found[-1] - found[-2 : -reach - 2 : -1]
    return np.asarray(np.convolve(np.concatenate([before, found, after]), kernel, mode="valid"))


def _cheapest(cost: Array) -> tuple[Array, Array]:
    """The cheapest way through a matrix (T, T) from corner to corner, as row and column indices."""
    count = len(cost)
    total = np.full((count + 1, count + 1), np.inf)
    total[0, 0] = 0.0
    for k in range(2, 2 * count + 1):  # anti-diagonals, each from the two before
        row = np.arange(max(1, k - count), min(count, k - 1) + 1)
        column = k - row
        here = cost[row - 1, column - 1]
        aside = np.minimum(total[row - 1, column], total[row, column - 1]) + (1.0 + DETOUR) * here
        total[row, column] = np.minimum(total[row - 1, column - 1] + here, aside)
    way = [(count, count)]
    while way[-1] != (1, 1):
        i, j = way[-1]
        here = cost[i - 1, j - 1]
        options = {(i - 1, j - 1): here, (i - 1, j): (1.0 + DETOUR) * here, (i, j - 1): (1.0 + DETOUR) * here}
        way.append(min(options, key=lambda place: total[place] + options[place]))
    rows, columns = np.array(way[::-1]).T - 1
    return rows, columns


def too_few(count: int, kind: str) -> tuple[str, ...]:
    """Say what so few demonstrations mean for a covariance.

    Raises:
        RequestError: If there are none, or one for a kind that needs a spread.
    """
    if count == 0:
        raise RequestError("there is no demonstration; name at least one file")
    if kind == "dmp" or count > 2:
        return ()
    if count == 1:
        lack = f"one demonstration shows no variance, which a {kind} is made of"
        raise RequestError(f"{lack}; show more, or use --kind dmp")
    return (f"two demonstrations are too few for a covariance; {_OF_TWO.get(kind, 'it is a guess')}",)
