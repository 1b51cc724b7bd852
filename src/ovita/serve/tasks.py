"""Open tasks: conversations by name, kept on disk, so that a server that was killed goes on with them."""

from __future__ import annotations

import contextlib
import os
import secrets
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from ovita.dialogue.history import ROOT
from ovita.dialogue.session import Session
from ovita.errors import RequestError
from ovita.io.files import make_folder
from ovita.paths.trajectory import Trajectory
from ovita.policy.sandbox import Isolation
from ovita.result import Adaptation
from ovita.serve.access import NotAllowed
from ovita.text import shortened
from ovita.writers.base import PolicyWriter

_ID_LENGTH = 16


class NoSuchTask(RequestError):
    """No open task of this owner bears this name, or it has no such turn."""


@dataclass
class OpenTask:
    """A conversation with its name; `lock` is held while anything is done with it."""

    id: str
    session: Session
    lock: threading.Lock = field(default_factory=threading.Lock)

    @property
    def turn(self) -> int:
        """Number of the turn in force, from 1; 0 before the first."""
        return self.session.history.head - ROOT

    def at(self, turn: int | None) -> int:
        """A turn's number; the one in force without one.

        Raises:
            NoSuchTask: If there is no such turn.
        """
        number, count = self.turn if turn is None else turn, len(self.session.history.steps)
        if not 0 <= number <= count:
            raise NoSuchTask(f"there is no turn {number}; there are {count}, and 0 is the path as it was opened")
        return number

    def result(self, turn: int | None) -> Adaptation:
        """The adaptation of a turn.

        Raises:
            NoSuchTask: If there is no such turn, or nothing was adapted yet.
        """
        number = self.at(turn)
        if number == 0:
            raise NoSuchTask("nothing was adapted yet; call adapt first")
        return self.session.history.steps[number - 1].adaptation

    def path(self, turn: int | None) -> Trajectory:
        """The trajectory after a turn."""
        number = self.at(turn)
        return self.session.original if number == 0 else self.session.history.steps[number - 1].adaptation.adapted


class OpenTasks:
    """The open tasks of all owners.

    A task is named by random bits, and belongs to its owner: to anyone else it does not exist. Its journal bears the
    same name, in the owner's folder; one that nobody used for `idle` seconds is deleted.

    Args:
        most: Open tasks of one owner.
        idle: How long a task stays open without use [s].
    """

    def __init__(
        self, folder: Path, most: int, idle: float, writer: PolicyWriter | str, isolation: Isolation = "auto"
    ) -> None:
        self.folder, self.most, self.idle = folder, most, idle
        self.writer, self.isolation = writer, isolation
        self._lock = threading.Lock()
        self._open: dict[tuple[str, str], OpenTask] = {}
        make_folder(folder, "; name another with --sessions", 0o700)

    def add(self, owner: str, session: Session) -> OpenTask:
        """Open a task.

        Raises:
            NotAllowed: If the owner has too many.
        """
        folder = make_folder(self.folder / owner, mode=0o700)
        with self._lock:
            self._expire()
            if sum(1 for _ in folder.glob("*.jsonl")) >= self.most:
                raise NotAllowed(f"{self.most} tasks are open, the most allowed; close one with close_task")
            task = OpenTask(secrets.token_hex(_ID_LENGTH // 2), session)
            session.keep(str(self._path(owner, task.id)))
            self._open[owner, task.id] = task
        return task

    def find(self, owner: str, name: str) -> OpenTask:
        """The task of a name, from memory or from its journal.

        Raises:
            NoSuchTask: If this owner has none of that name.
        """
        if len(name) != _ID_LENGTH or not set(name) <= set("0123456789abcdef"):
            raise NoSuchTask(f"{shortened(name)} is no name of a task; open_task gives one")
        path = self._path(owner, name)
        with self._lock:
            self._expire()
            if not path.exists():
                raise NoSuchTask(f"there is no open task {name}; it may have been closed, open it again with open_task")
            os.utime(path)
            task = self._open.get((owner, name))
            if task is None:
                session = Session.resume(str(path), writer=self.writer, isolation=self.isolation)
                task = self._open[owner, name] = OpenTask(name, session)
        return task

    @contextlib.contextmanager
    def using(self, owner: str, name: str) -> Iterator[OpenTask]:
        """The task of a name, held so that nobody else changes it inside the block.

        Raises:
            NoSuchTask: If this owner has none of that name, or it was closed in the meantime.
        """
        task = self.find(owner, name)
        with task.lock:
            if self._open.get((owner, name)) is not task:
                raise NoSuchTask(f"the task {name} was closed")
            yield task

    def close(self, owner: str, name: str) -> None:
        """Close a task for good.

        Raises:
            NoSuchTask: If this owner has none of that name.
        """
        with self.using(owner, name), self._lock:
            self._open.pop((owner, name), None)
            self._path(owner, name).unlink(missing_ok=True)

    def _expire(self) -> None:
        """Delete the journals that nobody used for long; no other file of the folder is touched."""
        oldest = time.time() - self.idle
        for path in self.folder.glob("*/*.jsonl"):
            with contextlib.suppress(OSError):
                if len(path.stem) == _ID_LENGTH and path.lstat().st_mtime < oldest:
                    path.unlink()
                    self._open.pop((path.parent.name, path.stem), None)

    def _path(self, owner: str, name: str) -> Path:
        return self.folder / owner / f"{name}.jsonl"
