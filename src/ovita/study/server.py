"""The server of a study: the standard library's, a thread for each connection, and nothing that has to be installed.

A study has some tens of people, who ask for a page every half minute; a thread for each is plenty, and every answer is
on disk before its reply is sent, so there is nothing that a faster server could gain.
"""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Callable, Iterator, Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import IO
from urllib.parse import parse_qsl, urlsplit

from ovita.bench.records import lock
from ovita.errors import OvitaError, RequestError
from ovita.study import pages
from ovita.study.desk import DeskAnswer, StudyDesk
from ovita.study.folder import StudyFolder

MAX_BODY = 64 * 1024
"""Largest form that is read [bytes]."""

PATIENCE_S = 30.0
"""How long a connection may be silent [s]."""

POLICY = (
    "default-src 'none'; script-src 'self' 'unsafe-eval'; style-src 'unsafe-inline'; img-src data: blob:;"
    " font-src data:; form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
)
"""Pages load nothing but this server's two scripts; the drawing library makes functions for its shaders by `eval`."""

_SAFE = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": POLICY,
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


class _Visit(BaseHTTPRequestHandler):
    """One connection. Nothing is logged: an address would say who answered what."""

    protocol_version = "HTTP/1.1"
    timeout = PATIENCE_S
    desk: StudyDesk

    def do_GET(self) -> None:
        """A script, a page, or the advice to use one's link."""
        path = urlsplit(self.path).path
        script = pages.scripts().get(path)
        if script is not None:
            self._script(*script)
        else:
            self._reply(lambda: self.desk.show(_token(path)))

    def do_POST(self) -> None:
        """What a page sends."""
        length = self.headers.get("Content-Length", "")
        if not length.isdigit() or int(length) > MAX_BODY:
            self.close_connection = True
            self._send(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, b"", {})
            return
        form = _form(self.rfile.read(int(length)))
        path = urlsplit(self.path).path
        self._reply(lambda: self.desk.take(_token(path), form))

    def version_string(self) -> str:
        """No versions are told."""
        return "ovita"

    def log_message(self, format: str, *args: object) -> None:
        """Keep no log."""

    def _reply(self, work: Callable[[], DeskAnswer]) -> None:
        try:
            answer = work()
        except OvitaError:
            trouble = pages.document("A problem", pages.message(*pages.TROUBLE), pilot=False, drawn=False)
            answer = DeskAnswer(trouble, HTTPStatus.INTERNAL_SERVER_ERROR)
        if answer.page:
            kind = {"Content-Type": "text/html; charset=utf-8"}
            self._send(HTTPStatus(answer.status), answer.page.encode(), kind)
        else:
            self._send(HTTPStatus.SEE_OTHER, b"", {"Location": urlsplit(self.path).path})

    def _script(self, body: bytes, packed: bytes) -> None:
        kind = {"Content-Type": "text/javascript; charset=utf-8", "Cache-Control": "max-age=3600"}
        if "gzip" in self.headers.get("Accept-Encoding", ""):
            body, kind = packed, {**kind, "Content-Encoding": "gzip"}
        self._send(HTTPStatus.OK, body, kind)

    def _send(self, status: HTTPStatus, body: bytes, headers: Mapping[str, str]) -> None:
        self.send_response(status)
        for name, value in {**_SAFE, **headers, "Content-Length": str(len(body))}.items():
            self.send_header(name, value)
        self.end_headers()
        with contextlib.suppress(ConnectionError, TimeoutError):
            self.wfile.write(body)


class StudyServer(ThreadingHTTPServer):
    """A study's pages at an address.

    Args:
        study: On disk; no other server may have it open.
        host: The address; "0.0.0.0" lets other machines in.
        port: 0 for any that is free.

    Raises:
        RequestError: If the address is taken, or the study is being served already.
    """

    daemon_threads = True
    request_queue_size = 128

    def __init__(self, study: StudyFolder, host: str = "127.0.0.1", port: int = 0) -> None:
        self.address_family = socket.AF_INET6 if ":" in host else socket.AF_INET
        visit = type("Visit", (_Visit,), {"desk": StudyDesk(study)})
        self._held: IO[bytes] = _hold(study.path)
        try:
            super().__init__((host, port), visit)
        except OSError as error:
            self._held.close()
            raise RequestError(f"{host}:{port} cannot be served: {error.strerror}; choose another --port") from None

    @property
    def url(self) -> str:
        """Its address, without a slash at the end."""
        host, port = str(self.server_address[0]), self.server_address[1]
        return f"http://{f'[{host}]' if ':' in host else host}:{port}"

    def handle_error(self, request: object, client_address: object) -> None:
        """A browser that went away is nobody's concern, and its address is not written down."""

    def server_close(self) -> None:
        """Close it, and let others serve the study."""
        super().server_close()
        self._held.close()


@contextlib.contextmanager
def serving(server: StudyServer) -> Iterator[StudyServer]:
    """Serve on a thread inside the block."""
    import threading

    worker = threading.Thread(target=server.serve_forever, name="ovita-study", daemon=True)
    worker.start()
    try:
        yield server
    finally:
        server.shutdown()
        server.server_close()
        worker.join()


def _token(path: str) -> str:
    return path[3:] if path.startswith("/s/") else ""


def _form(body: bytes) -> dict[str, str]:
    try:
        return dict(parse_qsl(body.decode("utf-8", "replace"), max_num_fields=100))
    except ValueError:
        return {}


def _hold(folder: Path) -> IO[bytes]:
    """Hold a study's folder, so that two servers never write the same answers."""
    stream = open(folder / ".serving", "ab")
    lock(stream, f"{folder}: is being served already; stop that server first")
    return stream
