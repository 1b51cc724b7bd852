"""Figures of an adaptation: `figure` and `save` for print, `interactive` for the browser, `card` for a notebook.

The drawing libraries are imported on first use; without them a `MissingExtra` says what to install.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ovita.plots.browser import interactive
    from ovita.plots.notebook import card
    from ovita.plots.static import figure, save

__all__ = ["card", "figure", "interactive", "save"]

_HOMES = {"card": "notebook", "figure": "static", "interactive": "browser", "save": "static"}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value
