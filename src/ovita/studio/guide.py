"""The page that a browser gets: viser's client with our head, the keys, and the overlay that lists them."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from ovita.studio.html import e
from ovita.studio.turns import LADDER, LOST, chip


@dataclass(frozen=True)
class Key:
    """A key or a gesture.

    Args:
        shown: How the overlay writes it; "" for another way to what is listed already.
        wish: What is asked for with it, of the tab or of the page.
        hotkey: Its name for viser's client, which then hears it.
        keys: Else its names for our own page, as `KeyboardEvent.key`; "drag" and the like are gestures.
        where: Where our page hears it: anywhere, while the timeline has the focus, or in the scene.
    """

    shown: str
    does: str
    wish: str = ""
    held: Any = None
    hotkey: Any = None
    keys: tuple[str, ...] = ()
    where: str = "page"


_TIME, _SCENE = "timeline", "scene"
KEYS = {
    "Everywhere": (
        Key("Space", "play or pause", "play", hotkey="space"),
        Key("Ctrl Z", "undo", "undo", "cmd/ctrl", "Z"),
        Key("Ctrl Shift Z, Ctrl Y", "redo", "redo", "cmd/ctrl+shift", "Z"),
        Key("", "redo ", "redo", "cmd/ctrl", "Y"),
        Key("H", "look at everything", "look fit", hotkey="H"),
        Key("1", "look from above", "look top", hotkey="1"),
        Key("2", "look from the front", "look front", hotkey="2"),
        Key("3", "look from the right side", "look side", hotkey="3"),
        Key("4", "follow what moves, or stop following", "look follow", hotkey="4"),
        Key("/", "to the field that asks what should change", "say", keys=("/",)),
        Key("T", "to the timeline", "timeline", keys=("t", "T")),
        Key("Del", "delete the selected waypoints", "delete", keys=("Delete",)),
        Key("Esc", "leave a field; select nothing, sketch nothing", "nothing", keys=("Escape",)),
        Key("?", "this list", "help", keys=("?",)),
        Key("Ctrl K", "find one of these by its name"),
        Key("Tab, Shift Tab", "from control to control; Enter or Space presses it, arrows turn a knob"),
        Key("Arrows, W A S D Q E", "turn and move the view, while no control has the focus"),
    ),
    "In the timeline": (
        Key("Shift Left, Right, Home, End", "select a part, from the moment on", "extend", "shift",
            keys=("ArrowLeft", "ArrowRight", "Home", "End"), where=_TIME),
        Key("Left, Right", "from waypoint to waypoint", "step", keys=("ArrowLeft", "ArrowRight"), where=_TIME),
        Key("Home, End", "to the start, to the goal", "step", keys=("Home", "End"), where=_TIME),
        Key("Enter", "choose the waypoint at the moment", "pick", keys=("Enter",), where=_TIME),
        Key("+, -, 0, wheel, double click", "nearer, farther, all", "zoom",
            keys=("+", "-", "0", "wheel", "dblclick"), where=_TIME),
        Key("Alt drag", "shift what is shown", "pan", "alt", keys=("drag",), where=_TIME),
        Key("Drag", "select a part; on the ruler: move the moment", "brush", keys=("drag",), where=_TIME),
    ),
    "In the scene": (
        Key("Shift drag", "select a part, along the line", "part", "shift", keys=("drag",), where=_SCENE),
        Key("Click", "choose a waypoint or an object", "pick", keys=("click",), where=_SCENE),
        Key("Drag, right drag, wheel", "turn, shift, zoom the view"),
    ),
}  # fmt: skip
"""Every key and gesture, by where it is heard: the page's handlers and the overlay are made of this table."""

HOTKEYS = tuple(key for keys in KEYS.values() for key in keys if key.hotkey)
"""Those that viser's client hears."""


def table() -> str:
    """The keys as the page's handlers read them: a script."""
    known = [asdict(key) for keys in KEYS.values() for key in keys if key.wish]
    return f"<script>window.ovitaKeys = {json.dumps(known)};</script>"


def overlay() -> str:
    """The `?` overlay: keys, and what the verdicts mean."""
    keys = "".join(
        f"<section><h4>{e(where)}</h4><table>"
        + "".join(f"<tr><td><kbd>{e(key.shown)}</kbd></td><td>{e(key.does)}</td></tr>" for key in found if key.shown)
        + "</table></section>"
        for where, found in KEYS.items()
    )
    rungs = (*LADDER.values(), LOST)
    verdicts = "".join(f"<tr><td>{chip(rung)}</td><td>{e(rung.meaning)}</td></tr>" for rung in rungs)
    return (
        '<dialog id="ovita-help" class="ov" aria-label="Keys and verdicts"><form method="dialog">'
        '<button class="link" autofocus>Close (Esc)</button></form>'
        f"<div>{keys}<section><h4>Verdicts</h4><table>{verdicts}</table></section>"
        '<p class="soft">Say \u201chelp\u201d to see what can be said in this scene.</p></div></dialog>'
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
    own = table() + "".join((files("ovita.studio") / name).read_text(encoding="utf-8") for name in parts)
    own += f'<template id="ovita-overlay">{overlay()}</template>'
    return (plain[:start] + head + own + plain[end:]).encode()
