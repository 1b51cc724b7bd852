"""The server: runs viser behind the access gate and gives each browser its view and session."""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import secrets
import socket
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ovita.dialogue.session import Session
from ovita.errors import FormatError, OvitaError, RequestError, needs
from ovita.studio.files import offered_files, open_file
from ovita.studio.guide import page
from ovita.studio.look import lookable
from ovita.studio.security import Gate, gate_for, guarded, is_local, limit_uploads
from ovita.studio.sessions import SessionController, Sessions, default_folder
from ovita.studio.tab import Tab
from ovita.studio.timeline import PLACE, Wires

PORT = 8765
"""Where the studio listens unless another port is named."""

_PLACES_S = 6.0
_EVERY = "ovita-sessions"  # under which a browser keeps the sessions of every file


@dataclass(frozen=True)
class StudioSettings:
    """How a studio is started.

    Args:
        paths: Files and folders that can be opened; newcomers get the first file.
        template: A session whose limits, writer and isolation newcomers get.
        port: Port to listen on; 0 takes any free one.
        token: What a browser must bring; "auto" makes one; "" where none is needed.
        folder: Where sessions are kept.
    """

    template: Session
    paths: tuple[str, ...] = ()
    host: str = "127.0.0.1"
    port: int = PORT
    token: str = ""
    folder: Path = field(default_factory=default_folder)


class Studio:
    """A running studio.

    Raises:
        MissingExtra: If viser is not installed.
        OvitaError: If it would let strangers in, a file cannot be opened, or the port is taken.
    """

    def __init__(self, settings: StudioSettings) -> None:
        with needs("viser", "studio"):
            import viser
        token = secrets.token_urlsafe(24) if settings.token == "auto" else settings.token
        gate_for(settings.host, token, page)
        port = _free_port(settings.host, settings.port)
        self.gate: Gate = gate_for(settings.host, token, page, port)
        self._local = is_local(settings.host)
        given = offered_files(settings.paths)
        self._template, self._offered = settings.template, given | {f"shipped: {p.stem}": str(p) for p in _shipped()}
        self._lookable = lookable(settings.paths)
        self._first = next(iter(given.values()), "")
        self._open_first()
        self.controllers = Sessions(
            settings.folder, self._open_first, writer=settings.template.writer, isolation=settings.template.isolation
        )
        self._key = f"ovita-session-{_digest(self._first)}"
        self._views: dict[int, tuple[Tab, list[str]]] = {}
        self._lock, self._stopped = threading.Lock(), False
        self.wires = Wires()
        with _quiet(), guarded(self.gate, {PLACE: self.wires.serve}):
            self.server: Any = viser.ViserServer(settings.host, port, label="ovita studio", verbose=False)
        # viser's client may ask its server to open a tunnel to the outside; this one never does
        setattr(self.server, "request_share_url", lambda verbose=True: None)  # noqa: B010
        self.server.scene.set_up_direction("+z")
        self.server.scene.world_axes.visible = False
        self.server.on_client_connect(self._came)
        self.server.on_client_disconnect(self._left)
        threading.Thread(target=warm_icons, name="ovita-icons", daemon=True).start()
        self.port: int = self.server.get_port()
        shown = "127.0.0.1" if settings.host in ("0.0.0.0", "::") else settings.host
        self.url = f"http://{shown}:{self.port}/" + (f"?token={self.gate.token}" if self.gate.token else "")

    @property
    def views(self) -> list[Tab]:
        """The tabs that are open."""
        with self._lock:
            return [view for view, _ in self._views.values()]

    def stop(self) -> None:
        """Stop the server and write down what is open."""
        with self._lock:
            self._stopped = True
            gone, self._views = list(self._views.items()), {}
        for _, (view, used) in gone:
            self._put_away(view, used)
        with _quiet():
            self.server.stop()
            # it waits for its thread for a second only, and what a busy machine's thread says later would be printed
            thread = getattr(getattr(self.server, "_websock_server", None), "_server_thread", None)
            if isinstance(thread, threading.Thread):
                thread.join(STOPPING_S)

    def wait(self) -> None:
        """Block until the process is interrupted."""
        threading.Event().wait()

    def _open_first(self) -> tuple[Session, str]:
        opened = open_file(self._first or str(_shipped()[-1]), self._template)
        return opened.session, opened.title

    def _came(self, client: Any) -> None:
        """Give a browser its view: on the session that it had, or on a new one."""
        # what still runs for a tab that was closed may write to it; that is no news for the terminal
        client._websock_connection.get_message_buffer()._sanctioned_dead_writes += 1
        limit_uploads(client)
        note, had = "", self._remembered(client)
        if self._gone(client):
            return
        before = self._remembered(client, _EVERY)
        used, controller = [had[0][0]] if had else [], None
        try:
            controller = self.controllers.find(*had[0]) if had else None
        except OvitaError as error:
            note = f"The session that this browser had cannot be read, so this is a new one: {error}"

        def remember(name: str, title: str) -> None:
            nonlocal had
            had = self._remember(client, name, title)

        def new(session: Session | None = None, title: str = "") -> SessionController:
            name, fresh = self.controllers.new(session, title)
            used.append(name)
            remember(name, fresh.title)
            return fresh

        def returned(name: str) -> SessionController:
            found = self.controllers.find(name, dict([*before, *self._remembered(client)]).get(name, ""))
            if found is None:
                raise RequestError("that session is not on this machine any more")
            used.append(name)
            remember(name, found.title)
            return found

        if controller is None:
            controller = new()
            note = note or controller.error
        view = Tab(
            client,
            controller,
            offered=self._offered,
            opened=lambda opened: new(opened.session, opened.title),
            again=new,
            earlier=lambda: _listed(used, [*had, *before]),
            returned=returned,
            limits=self._template.robot,
            local=self._local,
            lookable=self._lookable,
            wire=self.wires.open(),
        )
        if note:
            view.tell(note)
        with self._lock:
            self._views[client.client_id] = (view, used)
        if self._gone(client):
            self._left(client)

    def _gone(self, client: Any) -> bool:
        return self._stopped or client.client_id not in self.server.get_clients()

    def _left(self, client: Any) -> None:
        with self._lock:
            view, used = self._views.pop(client.client_id, (None, []))
        if view is not None:
            self._put_away(view, used)

    def _put_away(self, view: Tab, used: list[str]) -> None:
        view.close()
        self.wires.close(view.timeline.wire)
        view.controller.close()
        for name in used:
            self.controllers.leave(name)

    def _remembered(self, client: Any, key: str = "") -> list[tuple[str, str]]:
        """Name and title of the sessions that a browser had, the last first; its own storage keeps them.

        They are those of the file that the studio was started with, unless another `key` names those of all.
        """
        with contextlib.suppress(RuntimeError, TimeoutError, ValueError, TypeError):
            kept = json.loads(client.local_storage.get_item(key or self._key, timeout=_PLACES_S) or "[]")
            return [(str(name), str(title)[:80]) for name, title in kept]
        return []

    def _remember(self, client: Any, name: str, title: str) -> list[tuple[str, str]]:
        """Put a session at the front of those that a browser had, and return them."""
        found = []
        for key in (_EVERY, self._key):
            others = [(other, told) for other, told in self._remembered(client, key) if other != name]
            found = [(name, title), *others][:10]
            client.local_storage.set_item(key, json.dumps(found))
        return found


def _listed(used: list[str], had: list[tuple[str, str]]) -> dict[str, str]:
    """The sessions that are not the one in use, each once, by a numbered title."""
    others = {name: title for name, title in had if name != used[-1]}
    return {f"{i}. {title}": name for i, (name, title) in enumerate(others.items(), start=1)}


def _shipped() -> list[Path]:
    """The scenes that come with the package: for an arm, a drone, a rover, and last a table for any."""
    return sorted((Path(__file__).parents[1] / "data").glob("*.json"))


ICONS = (
    "adjustments arrow-back-up bulb camera chart-line check code download eraser eye folder folder-open hand-move"
    " history list-numbers message pencil photo pin pinned-off player-play refresh robot school send settings"
    " shield-check upload x"
).split()
"""The symbols on the page; viser keeps 32 of them."""


def warm_icons() -> None:
    """Read the symbols before anyone comes: viser finds each in an archive of thousands, which takes 50 ms of work."""
    from viser._icons import svg_from_icon

    for name in ICONS:
        svg_from_icon(name)


def _free_port(host: str, port: int) -> int:
    """The port, once it is sure that it can be listened on: viser would silently take another."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host.strip("[]"), port))
            return int(probe.getsockname()[1])
    except (OSError, OverflowError) as error:
        why = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise RequestError(f"the studio cannot listen on {host}:{port}: {why.lower()}; choose another --port") from None


STOPPING_S = 10.0
"""How long the server's thread may take to end [s]."""


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    with contextlib.redirect_stdout(io.StringIO()):
        yield


def _digest(path: str) -> str:
    """A short name for a file as it is now, under which browsers remember their session."""
    if not path:
        return "demo"
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise FormatError(path, f"cannot be read: {error.strerror}") from None
    return hashlib.sha256(str(Path(path).resolve()).encode() + b"\0" + content).hexdigest()[:16]
