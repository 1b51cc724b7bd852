"""All desks: which browser works on which session, and where sessions are kept on disk."""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import threading
import time
from collections.abc import Callable
from pathlib import Path

from ovita.dialogue.session import Session
from ovita.errors import FormatError, OvitaError
from ovita.policy.sandbox import Isolation
from ovita.studio.desk import Desk
from ovita.writers.base import PolicyWriter

KEPT_DAYS = 30
"""How long a session that nobody opens is kept [days]."""

_NAME = re.compile(r"[0-9a-f]{32}")


def default_folder() -> Path:
    """Where sessions are kept unless another folder is named: ~/.local/state/ovita/studio on Linux."""
    state = os.environ.get("XDG_STATE_HOME", "").strip()
    return (Path(state) if state else Path.home() / ".local" / "state") / "ovita" / "studio"


class Desks:
    """The desks of one studio.

    A desk is named by 128 random bits that only its browser knows; the journal bears that name. Journals that nobody
    opened for `KEPT_DAYS` are deleted when the studio starts.

    Args:
        folder: Where journals are kept; it is made if need be.
        first: Makes the session, and its title, for a browser that comes for the first time.
        writer: Of sessions that are resumed.
        isolation: Of sessions that are resumed.

    Raises:
        FormatError: If the folder cannot be made.
    """

    def __init__(
        self,
        folder: Path,
        first: Callable[[], tuple[Session, str]],
        *,
        writer: PolicyWriter | str = "auto",
        isolation: Isolation = "auto",
    ) -> None:
        self.folder, self.writer, self.isolation = folder, writer, isolation
        self._first = first
        self._lock = threading.Lock()
        self._desks: dict[str, Desk] = {}
        self._writers: dict[str, PolicyWriter | str] = {}
        try:
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        except OSError as error:
            raise FormatError(str(folder), f"cannot be made: {error.strerror}; name another with --sessions") from None
        self._clear()

    def find(self, name: str, title: str = "") -> Desk | None:
        """The desk of that name, from memory or from its journal, or None.

        Raises:
            OvitaError: If there is a journal that cannot be read.
        """
        if not _NAME.fullmatch(name):
            return None
        with self._lock:
            if name in self._desks:
                return self._desks[name]
            path = self._path(name)
            if not path.exists():
                return None
            writer = self._writers.get(name, self.writer)
            session = Session.resume(str(path), writer=writer, isolation=self.isolation)
            with contextlib.suppress(OSError):
                os.utime(path)
            desk = self._desks[name] = Desk(session, title)
            return desk

    def new(self, session: Session | None = None, title: str = "") -> tuple[str, Desk]:
        """A new desk and its name; without a session it is the one that newcomers get."""
        if session is None:
            session, title = self._first()
        name = secrets.token_hex(16)
        desk = Desk(session, title)
        try:
            session.keep(str(self._path(name)))
        except OvitaError as error:
            desk.error = f"This session is not kept on disk: {error}"
        with self._lock:
            self._desks[name] = desk
        return name, desk

    def leave(self, name: str) -> None:
        """Put a desk away that nobody looks at any more; its journal stays, and its writer as long as this lives."""
        with self._lock:
            desk = self._desks.get(name)
            if desk is None or desk.watched or desk.busy is not None:
                return
            del self._desks[name]
            if desk.session.writer is not self.writer:
                self._writers[name] = desk.session.writer
        desk.close()

    def __len__(self) -> int:
        return len(self._desks)

    def _clear(self) -> None:
        """Delete the journals that nobody opened for long; no other file of the folder is touched."""
        oldest = time.time() - KEPT_DAYS * 86_400.0
        for path in self.folder.glob("*.jsonl"):
            with contextlib.suppress(OSError):
                if _NAME.fullmatch(path.stem) and path.lstat().st_mtime < oldest:
                    path.unlink()

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}.jsonl"
