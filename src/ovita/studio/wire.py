"""The line between a tab's timeline and its page: a WebSocket beside viser's, behind the same gate."""

from __future__ import annotations

import asyncio
import contextlib
import json
import secrets
import threading
from collections.abc import Callable, Mapping
from typing import Any

from ovita.errors import OvitaError

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
