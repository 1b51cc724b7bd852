"""Who may talk to the studio, and how much they may send: every request passes the gate before anything is served."""

from __future__ import annotations

import asyncio
import hmac
import http
import inspect
import ipaddress
import logging
import re
from collections.abc import Awaitable, Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from importlib.resources import files
from types import MappingProxyType
from typing import Any
from urllib.parse import parse_qs, urlsplit

from ovita.errors import OvitaError
from ovita.studio.files import MAX_UPLOAD, too_large

SHORTEST_TOKEN = 12
"""Fewest characters of a token."""

LOCAL = frozenset({"localhost", "127.0.0.1", "::1", "[::1]"})
"""Names of this machine that need no token."""

MAX_MESSAGE = 16 * 1024 * 1024
"""Largest message that a browser may send [bytes]."""

_log = logging.getLogger("ovita.studio.connections")  # for those who ask: a visitor's bad request is no news otherwise
_log.addHandler(logging.NullHandler())
_log.propagate = False

_WRONG_TOKEN_DELAY = 0.5
_TOKEN = re.compile(rf"[A-Za-z0-9._-]{{{SHORTEST_TOKEN},200}}")
_HOST = re.compile(r"[A-Za-z0-9.\-_:\[\]]{1,255}")


_SAFE = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
}


class StudioUnsafe(OvitaError):
    """The requested server settings would give strangers access."""


@dataclass(frozen=True)
class Gate:
    """The checks on every request.

    Args:
        token: What a request must bring, or "" where none is needed.
        names: Host names that the studio answers to; empty for any, which needs a token.
        page: The page that is served, by the gate itself.
        cookie: Name of the cookie that holds the token.

    Raises:
        StudioUnsafe: If strangers could come in.
    """

    token: str
    names: frozenset[str]
    page: Callable[[], bytes]
    cookie: str = "ovita-studio"

    def __post_init__(self) -> None:
        if self.token and not _TOKEN.fullmatch(self.token):
            raise StudioUnsafe(f"a token is {SHORTEST_TOKEN} or more letters, digits, '-', '_' and '.'")
        if not self.names and not self.token:
            raise StudioUnsafe("a studio that answers to any name needs a token")

    def wrap(self, inner: Callable[[Any, Any], Any] | None) -> Callable[[Any, Any], Any]:
        """The handler that viser's server is given in place of its own."""

        async def process(connection: Any, request: Any) -> Any:
            refused = self._refusal(connection, request)
            if refused is not None:
                if refused.status_code == http.HTTPStatus.UNAUTHORIZED:
                    await asyncio.sleep(_WRONG_TOKEN_DELAY)
                return refused
            if request.headers.get("Upgrade", "").lower() == "websocket":
                return None
            path = urlsplit(request.path).path
            if path == "/alive":  # the page asks now and then whether the studio is still there
                return self._answer(connection, http.HTTPStatus.OK, b"")
            if path in ("/", "/index.html"):
                return self._answer(connection, http.HTTPStatus.OK, self.page(), request)
            found = inner(connection, request) if inner is not None else None
            return await found if inspect.isawaitable(found) else found

        return process

    def _refusal(self, connection: Any, request: Any) -> Any:
        host = request.headers.get("Host", "")
        if not _HOST.fullmatch(host) or (self.names and _name_of(host) not in self.names):
            return self._answer(connection, http.HTTPStatus.FORBIDDEN, b"The studio does not answer to this name.\n")
        origin = request.headers.get("Origin")
        if origin is not None and urlsplit(origin).netloc.lower() != host.lower():
            return self._answer(connection, http.HTTPStatus.FORBIDDEN, b"This request comes from another page.\n")
        return self._token_refusal(connection, request) if self.token else None

    def _token_refusal(self, connection: Any, request: Any) -> Any:
        parts = urlsplit(request.path)
        given = parse_qs(parts.query).get("token", [""])[-1]
        if given and hmac.compare_digest(given.encode(), self.token.encode()):
            answer = self._answer(connection, http.HTTPStatus.SEE_OTHER, b"")
            answer.headers["Location"] = parts.path or "/"
            answer.headers["Set-Cookie"] = f"{self.cookie}={self.token}; HttpOnly; SameSite=Lax; Path=/"
            return answer
        cookies: SimpleCookie = SimpleCookie()
        try:
            cookies.load(request.headers.get("Cookie", ""))
        except (CookieError, KeyError):
            cookies.clear()
        brought = cookies[self.cookie].value if self.cookie in cookies else ""
        if hmac.compare_digest(brought.encode(), self.token.encode()):
            return None
        locked = (files("ovita.studio") / "locked.html").read_bytes()
        return self._answer(connection, http.HTTPStatus.UNAUTHORIZED, locked, request)

    def _answer(self, connection: Any, status: http.HTTPStatus, body: bytes, request: Any = None) -> Any:
        answer = connection.respond(status, "")
        answer.body = body
        headers = {"Content-Length": str(len(body)), **_SAFE}
        if request is not None:
            headers["Content-Type"] = "text/html; charset=utf-8"
            headers["Content-Security-Policy"] = policy(request.headers.get("Host", ""))
        for name, value in headers.items():
            answer.headers.pop(name, None)
            answer.headers[name] = value
        return answer


def policy(host: str) -> str:
    """The content security policy of the page: it may load nothing from anywhere and talk to this server only."""
    return (
        "default-src 'none'; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob: data:;"
        " worker-src 'self' blob: data:; style-src 'unsafe-inline'; img-src 'self' data: blob:; font-src data:;"
        f" connect-src 'self' data: blob: ws://{host} wss://{host}; form-action 'self'; base-uri 'none';"
        " frame-ancestors 'none'"
    )


def gate_for(host: str, token: str, page: Callable[[], bytes], port: int = 0) -> Gate:
    """The gate of a studio that is bound to an address and a port, of which each has a cookie of its own."""
    if is_local(host):
        return Gate(token, frozenset({*LOCAL, host.lower()}), page, f"ovita-studio-{port}")
    if not token:
        raise StudioUnsafe(
            f"--host {host} lets other machines in: set a token with --token (or OVITA_STUDIO_TOKEN), 'auto' makes one"
        )
    return Gate(token, frozenset(), page, f"ovita-studio-{port}")


def is_local(host: str) -> bool:
    """Whether an address can be reached from this machine only."""
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


Socket = Callable[[Any], Awaitable[None]]
"""Serves the connection of one web socket."""


@contextmanager
def guarded(gate: Gate, beside: Mapping[str, Socket] = MappingProxyType({})) -> Iterator[None]:
    """Put a gate before every server that viser starts inside the block, and web sockets of our own beside viser's."""
    import websockets.asyncio.server as sockets

    genuine = sockets.serve
    gates = []

    def serve(handler: Any, *args: Any, process_request: Any = None, **options: Any) -> Any:
        async def handle(connection: Any) -> None:
            found = next((ours for path, ours in beside.items() if connection.request.path.startswith(path)), handler)
            await found(connection)

        gates.append(gate)
        options |= {"max_size": MAX_MESSAGE, "logger": _log}
        return genuine(handle, *args, process_request=gate.wrap(process_request), **options)

    sockets.serve = serve  # type: ignore[assignment,misc]
    try:
        yield
    finally:
        sockets.serve = genuine  # type: ignore[misc]
    if not gates:
        raise StudioUnsafe("this version of viser starts its server in another way; install the version that is pinned")


def _name_of(host: str) -> str:
    name = host.lower()
    if name.startswith("["):
        return name.partition("]")[0] + "]"
    return name.partition(":")[0]


def limit_uploads(client: Any) -> None:
    """Refuse files above `MAX_UPLOAD` from a tab, by viser's handle of it, before their content is taken."""
    from viser import _messages as messages

    gui, connection = client.gui, client._websock_connection
    start, part = gui._handle_file_transfer_start, gui._handle_file_transfer_part
    running = gui._current_file_upload_states

    def refuse(size: int, message: Any) -> None:
        running.pop(message.transfer_uuid, None)
        # the client shows its progress until it hears that all of it came
        whose = {"source_component_uuid": message.source_component_uuid, "transfer_uuid": message.transfer_uuid}
        connection.queue_message(messages.FileTransferPartAck(**whose, transferred_bytes=size, total_bytes=size))
        told = f"The file {too_large(size)}."
        client.add_notification("That did not work", told, auto_close_seconds=9.0, color="red")

    def started(client_id: Any, message: Any) -> None:
        if message.size_bytes > MAX_UPLOAD or message.part_count > MAX_UPLOAD // 1024 or len(running) >= 4:
            refuse(max(int(message.size_bytes), 1), message)
        else:
            start(client_id, message)

    def arrived(client_id: Any, message: Any) -> None:
        state = running.get(message.transfer_uuid)
        if state is not None and state["transferred_bytes"] + len(message.content) > state["total_bytes"]:
            running.pop(message.transfer_uuid, None)
            return
        part(client_id, message)

    for kind, old, new in (
        (messages.FileTransferStartUpload, start, started),
        (messages.FileTransferPart, part, arrived),
    ):
        connection.unregister_handler(kind, old)
        connection.register_handler(kind, new)
