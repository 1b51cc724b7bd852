"""The toolkit: what a policy may call to select waypoints, edit a trajectory and state what it promises.

Every edit takes an array (N, 4+k) with rows x, y, z [m], speed [m/s] and extra columns, and returns a new one; the
extra columns travel along. Wherever an object is asked for, a point (3,) [m] will do. Waypoints are counted from 0, as
numpy does; a mask (N,) of booleans says which, and None means all. Only numpy is needed, so that the toolkit can run
inside the sandbox. Every operation of the catalogue is an attribute of this package: `from ovita.toolkit import move`.
"""

from collections.abc import Callable
from typing import Any

# The order of these imports is the order in which a prompt and the page show operations of one group.
from ovita.toolkit import approach, avoidance, by_hand, figures, moves, postconditions, reshape, speed, waypoints  # noqa: F401
from ovita.toolkit.catalogue import CATALOGUE, Expectation, Recorder, describe, extended, namespace
from ovita.toolkit.judging import Outcome, judge

__all__ = ["CATALOGUE", "Expectation", "Outcome", "Recorder", "describe", "extended", "judge", "namespace"]


def __getattr__(name: str) -> Callable[..., Any]:
    if name in CATALOGUE or (not name.startswith("_") and name in extended()):
        return CATALOGUE[name]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*__all__, *CATALOGUE})
