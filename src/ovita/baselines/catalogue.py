"""Baselines by name, and those that every system has to beat.

These are the input itself, and a change of the usual size that reads no instruction.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from zlib import crc32

import numpy as np

from ovita.baselines.base import Baseline, Deformed
from ovita.baselines.command import TIMEOUT, OwnProgram
from ovita.baselines.extract import OVITA, PUBLISHED, Extract
from ovita.baselines.latte import LatteStyle
from ovita.errors import RequestError
from ovita.paths.geometry import extent
from ovita.request import Request

SHIFT = 0.13
"""Largest shift as a share of the path's extent: the median of the built-in writer's right answers that move the path,
on the development half of the public dataset."""

FACTOR = 2.0
"""Largest ratio of speeds: the same median, of those that change speeds."""


@dataclass(frozen=True)
class Copy:
    """Answers with the input."""

    name = "baseline:copy"
    keeps_limits = False

    def deform(self, request: Request) -> Deformed:
        """The request's own trajectory."""
        return Deformed(request.trajectory)


@dataclass(frozen=True)
class Random:
    """Answers with a smooth change of random direction, place and sign, of the usual size; the ends stay.

    The path is shifted by a half sine over a window of at least half of its waypoints, the speeds in the same window
    are divided or multiplied by up to `FACTOR`. The instruction only seeds the draw, so that each sample has its own.

    Args:
        seed: For other draws.
    """

    seed: int = 0
    name = "baseline:random"
    keeps_limits = False

    def deform(self, request: Request) -> Deformed:
        """A trajectory that has nothing to do with what was asked."""
        path = request.trajectory
        said = crc32(request.instruction.encode("utf-8"))
        rng = np.random.default_rng([self.seed, said, crc32(path.to_array().tobytes())])
        direction = rng.normal(size=3)
        size = SHIFT * extent(path.positions) / float(np.linalg.norm(direction))
        begin, end = rng.uniform(0.0, 0.25), rng.uniform(0.75, 1.0)
        along = np.clip((np.linspace(0.0, 1.0, len(path)) - begin) / (end - begin), 0.0, 1.0)
        bump = np.sin(np.pi * along)
        bump[[0, -1]] = 0.0
        power = rng.choice([-1.0, 1.0]) * bump
        return Deformed(
            path.with_(positions=path.positions + size * bump[:, None] * direction, speeds=path.speeds * FACTOR**power)
        )


_EXEC = "exec:"

_MAKERS: dict[str, Callable[[], Baseline]] = {
    Copy.name: Copy,
    Random.name: Random,
    PUBLISHED.name: partial(Extract, PUBLISHED),
    OVITA.name: partial(Extract, OVITA),
    LatteStyle.name: LatteStyle,
}

NAMES = tuple(_MAKERS)
"""The baselines that ovita brings."""

_LABELS: Mapping[str, str] = {LatteStyle.name: f"{LatteStyle.name} (our own model, not LaTTe's weights)"}


def labelled(name: str) -> str:
    """A system's name as it stands in tables, with what must not be mistaken about it."""
    return _LABELS.get(name, name)


def is_baseline(name: str) -> bool:
    """Whether a name is meant for a baseline rather than for a policy writer."""
    return name.startswith(("baseline:", _EXEC))


def brought(name: str) -> bool:
    """Whether ovita brings the baseline itself: it runs in this process and gives the same answer every time."""
    return name in _MAKERS


def baseline_named(name: str, *, timeout: float = TIMEOUT) -> Baseline:
    """The baseline of that name: one of NAMES, or "exec:COMMAND" for a program of one's own.

    `timeout` is the longest time for an answer of a command [s].

    Raises:
        RequestError: If there is no such baseline.
        MissingExtra: If its packages are not installed.
        OvitaError: If its weights are missing.
    """
    if name.startswith(_EXEC):
        return OwnProgram(name.removeprefix(_EXEC), timeout=timeout)
    if name not in _MAKERS:
        raise RequestError(f"there is no baseline {name!r}; there are {', '.join(NAMES)} and {_EXEC}COMMAND")
    return _MAKERS[name]()
