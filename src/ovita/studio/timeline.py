"""The timeline below the scene: what it draws, as numbers, and what a person points at in it.

The page draws it itself (`timeline.html`), since the cursor has to be in the scene, in every chart and in the code at
once, which viser's charts, closed boxes inside panels, cannot do.
"""

from __future__ import annotations

import asyncio
import base64
import contextlib
import json
import secrets
import threading
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ovita.dialogue.session import Session
from ovita.errors import OvitaError
from ovita.paths.geometry import runs
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.plots.geometry import corners
from ovita.policy.policy import changed_by_line
from ovita.policy.source import parse_tree
from ovita.studio.playback import Player
from ovita.studio.sessions import Desk

POINTS = 400
"""At most about so many waypoints of a path are drawn; the extremes of every signal are among them."""


def signals(path: Trajectory, scene: Scene) -> Array:
    """What the charts show of a path, one row a signal.

    Returns:
        (8 + K, N): waypoint, time [s], x, y, z [m], speed [m/s], acceleration along the path [m/s^2], curvature [1/m],
        and the distance to the surface of each of K objects [m].
    """
    durations = path.durations
    rate = np.divide(np.diff(path.speeds), durations, out=np.zeros_like(durations), where=durations > 0)
    near = [item.clearance(path.positions) for item in scene]
    return np.stack(
        [np.arange(len(path)), path.times, *path.positions.T, path.speeds, np.append(rate, rate[-1]),
         curvature(path.positions), *near]
    )  # fmt: skip


def curvature(positions: Array) -> Array:
    """Of the circle through each waypoint and its neighbours (N,) [1/m]; 0 at the ends and where the path stands."""
    a, b = positions[1:-1] - positions[:-2], positions[2:] - positions[1:-1]
    sides = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1) * np.linalg.norm(a + b, axis=1)
    twice = np.linalg.norm(np.cross(a, b), axis=1)
    inner = np.divide(2.0 * twice, sides, out=np.zeros_like(sides), where=sides > 1e-15)
    return np.concatenate([[0.0], inner, [0.0]])


def thinned(rows: Array, most: int = POINTS) -> Array:
    """Columns of (K, N) for a drawing: evenly chosen, with the lowest and the highest value of every row."""
    count = rows.shape[1]
    if count <= most:
        return rows
    even = np.linspace(0, count - 1, most).round().astype(int)
    return rows[:, np.unique(np.concatenate([even, rows.argmin(axis=1), rows.argmax(axis=1)]))]


def packed(rows: Array) -> dict[str, Any]:
    """An array (K, N) as the page unpacks it: how many rows, and float32 in base64."""
    return {"rows": len(rows), "data": base64.b64encode(np.ascontiguousarray(rows, dtype="<f4").tobytes()).decode()}


def drawn(path: Trajectory, scene: Scene) -> Mapping[str, Any]:
    """What the timeline shows of one path, as JSON values."""
    return packed(thinned(signals(path, scene))) | {"count": len(path), "duration": path.duration}


def picture(session: Session, original: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """All that the timeline shows of a session, as JSON values; `original` where that path is drawn already."""
    up = session.scene.frame.direction("up")
    return {
        "paths": [
            original or drawn(session.original, session.scene),
            *([drawn(session.current, session.scene)] if session.steps else []),
        ],
        "objects": [item.name for item in session.scene],
        "boxes": [corners(item).round(4).tolist() for item in session.scene],
        "up": up.tolist(),
        "bare": session.bare,
    }


def acting(session: Session) -> list[tuple[int, float, float]]:
    """When which line of the program in force acts: line, from and to [s] of the adapted path."""
    result = session.adaptation
    if result is None or not result.code or len(result.original) > POINTS * 5:
        return []
    times = result.adapted.times
    last = len(times) - 1
    found = changed_by_line(parse_tree(result.code), result.original.to_array(), result.scene)
    spans = []
    for line, mask in found:
        share = last / max(len(mask) - 1, 1)
        spans += [(line, float(times[round(a * share)]), float(times[round(b * share)])) for a, b in runs(mask)]
    return spans


class Timeline:
    """The timeline of one tab.

    Args:
        show: Shows a moment [s] in the scene.
        mark: Marks the part (N, 3) [m] of the current path that is selected in the scene.
        hands: What else the page may ask for, by the message's kind.
    """

    def __init__(
        self,
        wire: Wire,
        desk: Desk,
        show: Callable[[float], None],
        mark: Callable[[Array], None],
        hands: Mapping[str, Callable[[Mapping[str, Any]], None]],
    ) -> None:
        self.wire, self.desk = wire, desk
        self.player = Player(wire.send, show)
        self._mark, self._hands = mark, hands
        self._first: tuple[Trajectory, Scene, Mapping[str, Any]] | None = None  # the original, as drawn
        wire.heard = self._heard

    def refresh(self, *, lines: bool) -> None:
        """Show the session; `lines`: and look anew when which line of its program acts."""
        session = self.desk.controller.session
        if self._first is None or self._first[0] is not session.original or self._first[1] is not session.scene:
            self._first = session.original, session.scene, drawn(session.original, session.scene)
        self.wire.send("paths", picture(session, self._first[2]))
        self.player.set_duration(max(session.original.duration, session.current.duration))
        self.show_selection()
        if lines:
            self.wire.send("acting", {"spans": acting(session)})

    def show_selection(self) -> None:
        """Show which part is selected."""
        controller = self.desk.controller
        with controller.selecting:  # what is shown last is what holds
            ends = controller.selected
            first, last = ends or (0, -1)
            self._mark(controller.session.current.positions[first : last + 1])
            self.wire.send("selected", {"range": ends})

    def show_picked(self, index: int | None) -> None:
        """Show which number the picked waypoint, counted from 0, has on a path that changed."""
        self.wire.send("picked", {"index": index})

    def see(self, camera: Any) -> None:
        """Tell the page from where the scene is seen, so that it finds the line under the pointer."""
        pose = {"position": list(camera.position), "wxyz": list(camera.wxyz)}
        self.wire.send("camera", pose | {"fov": float(camera.fov)})

    def _heard(self, message: Mapping[str, Any]) -> None:
        kind = message["kind"]
        if kind == "select":
            self._select(message["range"])
        elif kind in self._hands:
            self._hands[kind](message)
        else:
            self.player.heard(kind, message)

    def _select(self, ends: Any) -> None:
        controller = self.desk.controller
        last = len(controller.session.current) - 1
        first, end = (None, None) if ends is None else sorted(min(max(int(i), 0), last) for i in ends)
        controller.selected = None if first is None or end is None else (first, end)
        self.show_selection()


PLACE = "/timeline/"
"""Where the page connects to, followed by the name of its line."""

_LARGEST = 200_000  # of a message from the page [characters]

Heard = Callable[[Mapping[str, Any]], None]


class Wire:
    """The connection of one tab's timeline; of several messages of a kind that wait only the last is sent."""

    def __init__(self) -> None:
        self.name = secrets.token_hex(16)
        self.heard: Heard = lambda message: None
        self._waiting: dict[str, Mapping[str, Any]] = {}
        self._last: dict[str, Mapping[str, Any]] = {}
        self._lock = threading.Lock()
        self._wake: tuple[asyncio.AbstractEventLoop, asyncio.Event] | None = None

    def send(self, kind: str, message: Mapping[str, Any]) -> None:
        """Send a message soon, from any thread; one that comes to a page later gets the last of each kind."""
        with self._lock:
            self._waiting[kind] = self._last[kind] = message
            wake = self._wake
        if wake is not None:
            with contextlib.suppress(RuntimeError):  # its loop has ended
                wake[0].call_soon_threadsafe(wake[1].set)

    async def serve(self, connection: Any) -> None:
        """Serve the page's end until it goes."""
        from websockets.exceptions import ConnectionClosed

        woken = asyncio.Event()
        with self._lock:
            self._wake, self._waiting = (asyncio.get_running_loop(), woken), dict(self._last)
        woken.set()
        sending = asyncio.create_task(self._send(connection, woken))
        try:
            with contextlib.suppress(ConnectionClosed):  # the page went, or slept for long
                async for text in connection:
                    self._take(text)
        finally:
            sending.cancel()

    async def _send(self, connection: Any, woken: asyncio.Event) -> None:
        from websockets.exceptions import ConnectionClosed

        with contextlib.suppress(ConnectionClosed):
            while await woken.wait():
                woken.clear()
                with self._lock:
                    waiting, self._waiting = self._waiting, {}
                for kind, message in waiting.items():
                    await connection.send(json.dumps({"kind": kind, **message}, separators=(",", ":")))

    def _take(self, text: Any) -> None:
        if not isinstance(text, str) or len(text) > _LARGEST:
            return
        with contextlib.suppress(ValueError, KeyError, TypeError, IndexError, OvitaError):  # no page of ours wrote it
            self.heard(json.loads(text))


class Wires:
    """The timelines of one studio's tabs, by the names that only their pages know."""

    def __init__(self) -> None:
        self._wires: dict[str, Wire] = {}

    def open(self) -> Wire:
        """A new wire."""
        wire = Wire()
        self._wires[wire.name] = wire
        return wire

    def close(self, wire: Wire) -> None:
        """Forget a wire."""
        self._wires.pop(wire.name, None)

    async def serve(self, connection: Any) -> None:
        """Serve a connection whose address names a wire; close any other."""
        wire = self._wires.get(connection.request.path.partition("?")[0].removeprefix(PLACE))
        if wire is None:
            await connection.close(1008, "there is no such timeline")
        else:
            await wire.serve(connection)
