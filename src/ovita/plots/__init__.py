"""Figures of an adaptation: `figure` and `save` for print, `interactive` for the browser, `card` for a notebook.

The drawing libraries are imported on first use; without them a `MissingExtra` says what to install.
"""

from __future__ import annotations

import io
from base64 import b64encode
from collections.abc import Mapping, Sequence
from html import escape
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ovita.plots.browser import interactive
    from ovita.plots.static import figure, save

__all__ = ["card", "figure", "interactive", "save"]

_HOMES = {"figure": "static", "interactive": "browser", "save": "static"}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


WIDTH = 560
"""Of the picture in the page [pixels]."""

_STYLE = "font-family:sans-serif;border:1px solid #bbb;border-radius:6px;padding:10px;max-width:1100px"
_COLUMNS = "display:flex;flex-wrap:wrap;gap:16px;align-items:flex-start"


def card(title: str, verdict: str, sections: Mapping[str, Sequence[str]], picture: Figure | None) -> str:
    """A title, a verdict, lines by heading and a picture, as HTML without scripts, links or styles of its own.

    All text is escaped; headings without lines are left out.
    """
    told = "".join(_section(heading, lines) for heading, lines in sections.items() if lines)
    image = _embedded(picture) if picture is not None else ""
    return (
        f'<div style="{_STYLE}"><div><b>{escape(title)}</b></div><div>{escape(verdict)}</div>'
        f'<div style="{_COLUMNS}">{image}<div style="flex:1;min-width:260px">{told}</div></div></div>'
    )


def _section(heading: str, lines: Sequence[str]) -> str:
    rows = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f'<div style="margin-top:8px"><b>{escape(heading)}</b></div><ul style="margin:2px 0">{rows}</ul>'


def _embedded(picture: Figure) -> str:
    stream = io.BytesIO()
    picture.savefig(stream, format="png", dpi=100)
    data = b64encode(stream.getvalue()).decode()
    return f'<div><img width="{WIDTH}" alt="before and after" src="data:image/png;base64,{data}"></div>'
