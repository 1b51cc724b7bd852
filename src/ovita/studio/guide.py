"""The page that a browser gets: viser's client with our head, the keys, and the overlay that lists them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from ovita.studio.html import e
from ovita.studio.turns import LADDER, LOST, chip


@dataclass(frozen=True)
class Key:
    """A key: how it is shown, what it does, and as the page knows it; `wish` is what it asks the tab for."""

    shown: str
    does: str
    wish: str = ""
    hotkey: Any = None
    held: Any = None


KEYS = (
    Key("Space", "play or pause", "play", "space"),
    Key("Ctrl Z", "undo", "undo", "Z", "cmd/ctrl"),
    Key("Ctrl Shift Z, Ctrl Y", "redo", "redo", "Z", "cmd/ctrl+shift"),
    Key("", "redo ", "redo", "Y", "cmd/ctrl"),
    Key("H", "look at everything", "look fit", "H"),
    Key("1", "look from above", "look top", "1"),
    Key("2", "look from the front", "look front", "2"),
    Key("3", "look from the right side", "look side", "3"),
    Key("4", "follow what moves, or stop following", "look follow", "4"),
    Key("/", "to the field that asks what should change"),
    Key("?", "this list"),
    Key("Tab, Shift Tab", "from control to control; Enter or Space presses it, arrows turn a knob"),
    Key("Arrows, W A S D Q E", "turn and move the view, while no control has the focus"),
)


def overlay() -> str:
    """The `?` overlay: keys, and what the verdicts mean."""
    keys = "".join(f"<tr><td><kbd>{e(key.shown)}</kbd></td><td>{e(key.does)}</td></tr>" for key in KEYS if key.shown)
    rungs = (*LADDER.values(), LOST)
    verdicts = "".join(f"<tr><td>{chip(rung)}</td><td>{e(rung.meaning)}</td></tr>" for rung in rungs)
    return (
        '<dialog id="ovita-help" class="ov" aria-label="Keys and verdicts"><form method="dialog">'
        '<button class="link" autofocus>Close (Esc)</button></form>'
        f"<h4>Keys</h4><table>{keys}</table><h4>Verdicts</h4><table>{verdicts}</table>"
        '<p class="soft">Say \u201chelp\u201d to see what can be said in this scene.</p></dialog>'
    )


@cache
def page() -> bytes:
    """The page that every browser gets first."""
    import viser

    plain = (Path(viser.__file__).parent / "client" / "build" / "index.html").read_text(encoding="utf-8")
    start, end = plain.index("<head>") + len("<head>"), plain.index("</head>")
    head = plain[start:end]
    for tag, close in (("<title>", "</title>"), ("<link", "/>")):
        if tag in head:
            first = head.index(tag)
            head = head[:first] + head[head.index(close, first) + len(close) :]
    parts = ("head.html", "page.html", "timeline.html")
    own = "".join((files("ovita.studio") / name).read_text(encoding="utf-8") for name in parts)
    own += f'<template id="ovita-overlay">{overlay()}</template>'
    return (plain[:start] + head + own + plain[end:]).encode()
