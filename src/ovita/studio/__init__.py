"""The studio: see a trajectory, say what should change, turn the knobs. One page in the browser, served by viser.

    Studio    the server; every browser that comes gets a Tab on a SessionController
    SessionController      one session with its lock, its worker threads and its journal; two tabs of a browser share it
    Tab      what one tab shows: panels on the left and right, the scene in the middle

Only `Session` does work; everything here shows it and passes wishes on.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ovita.studio.app import Studio, StudioSettings

__all__ = ["Studio", "StudioSettings"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.app"), name)
