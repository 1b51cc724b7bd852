"""Baselines by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from ovita.baselines.base import Baseline
from ovita.baselines.command import TIMEOUT, OwnProgram
from ovita.baselines.extract import OVITA, PUBLISHED, Extract
from ovita.baselines.floor import Copy, Random
from ovita.baselines.latte import LatteStyle
from ovita.errors import RequestError

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
