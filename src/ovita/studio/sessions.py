"""Sessions of the studio: one that tabs work on, one turn at a time, and all of them by name, kept on disk."""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from ovita.dialogue.session import Session
from ovita.errors import OvitaError, RequestError
from ovita.instruct.remarks import named_objects
from ovita.io.files import make_folder, state_folder
from ovita.paths.correspondence import carried_over
from ovita.paths.part import WHOLE, PathPart
from ovita.paths.trajectory import Trajectory
from ovita.policy.sandbox import Isolation
from ovita.request import MAX_INSTRUCTION, FeedbackOn
from ovita.result import Adaptation
from ovita.sources.words import begun
from ovita.writers.base import PolicyWriter

SETTLE_S, REST_S, TOLD_S = 0.6, 0.1, 0.5
"""How long knobs must rest until what they did is written down, and until the texts are made; while they do not, texts
are made as seldom as the last [s]."""

News = Literal["turn", "line", "knobs", "busy", "said", "error"]
"""What changed: the turn in force, the line of a knob that moves, all that knobs did, whether a writer is at work, what
was said last, a wish that failed."""


@dataclass
class PendingTurn:
    """A turn that is being written, and how far it is; `started` is on the clock of `time.monotonic` [s]."""

    said: str
    on: FeedbackOn
    selection: PathPart = WHOLE
    cancel: threading.Event = field(default_factory=threading.Event)
    started: float = field(default_factory=time.monotonic)
    stage: str = "reading the instruction"

    @property
    def elapsed(self) -> float:
        """Since it began [s]."""
        return time.monotonic() - self.started


@dataclass(frozen=True)
class LastUtterance:
    """The last utterance, with its result or error if it did not become a turn."""

    text: str
    on: FeedbackOn
    result: Adaptation | None = None
    error: str = ""

    @property
    def question(self) -> str:
        """The question back, or ""."""
        return self.result.question if self.result is not None else ""

    @property
    def message(self) -> str:
        """One sentence that says how it went."""
        return self.error or (self.result.message if self.result is not None else "")


class SessionController:
    """A session and what happens to it; from now on only the controller changes the session."""

    def __init__(self, session: Session, title: str = "") -> None:
        self.session, self.title = session, title
        self.busy: PendingTurn | None = None
        self.said: LastUtterance | None = None
        self.error = ""
        self._selected: tuple[tuple[int, int], Trajectory] | None = None
        self.selecting = threading.RLock()  # a turn carries the selection over while the person may take it away
        self.lock = threading.RLock()
        self._watchers: list[Callable[[News], None]] = []
        self._knobs = threading.Condition()
        self._wanted: dict[str, Any] = {}
        self._turning = False

    def watch(self, watcher: Callable[[News], None]) -> Callable[[], None]:
        """Call `watcher` on every change, on the thread that changed it; the returned function unsubscribes."""
        with self.lock:
            self._watchers.append(watcher)

        def leave() -> None:
            with self.lock:
                if watcher in self._watchers:
                    self._watchers.remove(watcher)

        return leave

    @property
    def selected(self) -> tuple[int, int] | None:
        """The first and the last of the waypoints that a person selected, wherever they are by now; None once gone."""
        with self.selecting:
            if self._selected is not None and self._selected[1] is not self.session.current:
                ends, path = self._selected
                self.selected = carried_over(path.positions, self.session.current.positions, *ends)
            return None if self._selected is None else self._selected[0]

    @selected.setter
    def selected(self, ends: tuple[int, int] | None) -> None:
        with self.selecting:
            self._selected = None if ends is None else (ends, self.session.current)

    @property
    def selection(self) -> PathPart:
        """The part that is selected, which "here" and "this part" mean."""
        ends = self.selected
        return WHOLE if ends is None else PathPart("range", amount=ends[0], until=ends[1])

    @property
    def watched(self) -> bool:
        """Whether a tab shows this session."""
        return bool(self._watchers)

    def say(self, text: str, on: FeedbackOn) -> threading.Thread:
        """Adapt to an instruction on a thread of its own.

        Raises:
            RequestError: If the instruction is empty or too long, or another is being written.
        """
        text = text.strip()
        with self.lock:
            if self.busy is not None:
                raise RequestError("the last instruction is still being worked on; wait for it or cancel it")
            if not text:
                raise RequestError("say what should change, such as 'slow down near the cup'")
            if len(text) > MAX_INSTRUCTION:
                raise RequestError(f"that is {len(text)} letters; an instruction has at most {MAX_INSTRUCTION}")
            self._rest()
            busy = self.busy = PendingTurn(text, on, self.selection)
            self.said = None
            draft = self.session.draft()
        worker = threading.Thread(target=self._write, args=(draft, busy), name="ovita-writer", daemon=True)
        worker.start()
        self._tell("busy")
        return worker

    def answer(self, text: str) -> threading.Thread:
        """Answer the pending question; if the session cannot apply the answer, restate the instruction with it.

        Raises:
            RequestError: If nothing was asked or the answer is empty.
        """
        if self.said is None or not self.said.question or not text.strip():
            raise RequestError("there is no question to answer" if not text.strip() else "nothing was asked")
        whole = f"{self.said.text.rstrip('.')}. {text.strip()}"
        return self.say(text if self._applies(text, self.said.result) else whole, self.said.on)

    def _applies(self, answer: str, asked: Adaptation | None) -> bool:
        """Whether the session can apply an answer by itself."""
        kind = "" if asked is None else asked.writer.kind
        if self.session.bare or (self.session.steps and kind not in ("", "llm")):
            return True
        named = named_objects(answer, self.session.scene)
        return kind == "builtin" and bool(self.session.asked) and len(named) == 1

    def cancel(self) -> None:
        """Cancel the pending turn and discard any late reply of its writer."""
        with self.lock:
            busy = self.busy
            if busy is None:
                return
            busy.cancel.set()
            self.busy = None
            self.said = LastUtterance(busy.said, busy.on, error="Cancelled; nothing changed.")
        self._tell("said")

    def turn(self, name: str, value: Any) -> None:
        """Turn a knob soon; of several values for one knob only the last counts, so that dragging never queues up."""
        with self._knobs:
            self._wanted[name] = value
            self._knobs.notify_all()
            if self._turning:
                return
            self._turning = True
        threading.Thread(target=self._turn_all, name="ovita-knobs", daemon=True).start()

    def act(self, work: Callable[[Session], object]) -> bool:
        """Apply an edit to the session and return whether it succeeded; a failure is shown and changes nothing."""
        try:
            with self.lock:
                self._free()
                self._rest()
                work(self.session)
                self.said, self.error = None, ""
        except OvitaError as error:
            self.error = str(error)
            self._tell("turn")
            self._tell("error")
            return False
        self._tell("turn")
        return True

    def close(self) -> None:
        """Write down what is open."""
        with self.lock:
            self._rest()
            self._kept(self.session.settle)

    def _write(self, draft: Session, busy: PendingTurn) -> None:
        said = LastUtterance(busy.said, busy.on, error="This should not have happened; nothing changed.")
        result: Adaptation | None = None
        before, kept = (draft.history.head, len(draft.history.steps)), False

        def stage(text: str) -> None:
            busy.stage = text
            self._tell("busy")

        try:
            if draft.bare:
                result = begun(draft, busy.said, progress=stage, cancel=busy.cancel)
            else:
                result = draft.say(busy.said, on=busy.on, selection=busy.selection, progress=stage, cancel=busy.cancel)
            said = LastUtterance(busy.said, busy.on, result)
        except OvitaError as error:
            said = LastUtterance(busy.said, busy.on, error=str(error))
        finally:
            with self.lock:
                wanted = self.busy is busy
                if wanted:
                    self.busy, self.error = None, ""
                    kept = (draft.history.head, len(draft.history.steps)) != before
                    if result is not None:
                        self._kept(lambda: self._take_over(draft, result))
                    self.said = None if kept else said
            if wanted:
                self._tell("turn" if kept else "said")
                if self.error:
                    self._tell("error")

    def _take_over(self, draft: Session, result: Adaptation) -> None:
        """Take over what a draft came to; the first trajectory of a session that had none is its original."""
        if self.session.bare and not draft.bare:
            self.session.begin(result)
        else:
            self.session.adopt(draft)

    def _turn_all(self) -> None:
        """Apply pending parameter values until none are left; after a pause, record the result as a turn."""
        due: float | None = None  # until when the texts wait; None once they are made
        while True:
            with self._knobs:
                more = self._knobs.wait_for(lambda: bool(self._wanted), timeout=SETTLE_S if due is None else REST_S)
                if not more and due is None:
                    self._turning = False
                    break
            if more:
                self._turn_once()
                due = due or time.monotonic() + TOLD_S
            if due is not None and (not more or time.monotonic() > due):
                due = None
                self._tell("knobs")
        with self.lock:
            kept = self._kept(self.session.settle)
        if not kept:
            self._tell("error")

    def _kept(self, work: Callable[[], None]) -> bool:
        """Do what also writes to the journal; a disk that is full costs the journal, not the session."""
        try:
            work()
        except OvitaError as error:
            self.error = str(error)
            return False
        return True

    def _turn_once(self) -> None:
        try:
            with self.lock:
                with self._knobs:
                    values, self._wanted = self._wanted, {}
                if not values:
                    return
                self._free()
                self.session.tune(values, merge=True)
                self.error = ""
        except OvitaError as error:
            self.error = str(error)
            self._tell("error")
            return
        self._tell("line")

    def _free(self) -> None:
        if self.busy is not None:
            raise RequestError("an instruction is being worked on; wait for it or cancel it")

    def _rest(self) -> None:
        """Forget knobs that were not turned yet, so that they do not reach another turn's policy."""
        with self._knobs:
            self._wanted.clear()

    def _tell(self, news: News) -> None:
        with self.lock:
            watchers = list(self._watchers)
        for watcher in watchers:
            watcher(news)


class Latest:
    """Works on a thread of its own; of several wishes that come while it works only the last counts."""

    def __init__(self, work: Callable[[Any], None], name: str) -> None:
        self._work, self._name = work, name
        self._wish: Any = None
        self._busy = False
        self._lock = threading.Lock()

    def want(self, wish: Any) -> None:
        """Work on a wish, which is not None, soon."""
        with self._lock:
            self._wish = wish
            if self._busy:
                return
            self._busy = True
        threading.Thread(target=self._run, name=self._name, daemon=True).start()

    def forget(self) -> None:
        """Forget a wish that is not worked on yet."""
        with self._lock:
            self._wish = None

    def _run(self) -> None:
        while True:
            with self._lock:
                wish, self._wish = self._wish, None
                if wish is None:
                    self._busy = False
                    return
            self._work(wish)


class Desk:
    """What all panels of one tab share: viser's handle of it, and a controller, another once a file is opened."""

    def __init__(self, client: Any, controller: SessionController) -> None:
        self.client, self.controller = client, controller

    def tell(self, text: str) -> None:
        """Show a sentence that is good to know."""
        self.client.add_notification("Good to know", text, auto_close_seconds=9.0, color="blue")

    def complain(self, text: str) -> None:
        """Show a sentence about something that did not work."""
        self.client.add_notification("That did not work", text, auto_close_seconds=9.0, color="red")

    @contextlib.contextmanager
    def complaining(self) -> Iterator[None]:
        """Complain of an error inside the block, which ends there."""
        try:
            yield
        except OvitaError as error:
            self.complain(str(error))


KEPT_DAYS = 30
"""How long a session that nobody opens is kept [days]."""

_NAME = re.compile(r"[0-9a-f]{32}")


def default_folder() -> Path:
    """Where sessions are kept unless another folder is named: ~/.local/state/ovita/studio on Linux."""
    return state_folder() / "studio"


class Sessions:
    """The sessions of one studio.

    A session is named by 128 random bits that only its browser knows; the journal bears that name. Journals that nobody
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
        self._controllers: dict[str, SessionController] = {}
        self._writers: dict[str, PolicyWriter | str] = {}
        make_folder(folder, "; name another with --sessions", 0o700)
        self._clear()

    def find(self, name: str, title: str = "") -> SessionController | None:
        """The session of that name, from memory or from its journal, or None.

        Raises:
            OvitaError: If there is a journal that cannot be read.
        """
        if not _NAME.fullmatch(name):
            return None
        with self._lock:
            if name in self._controllers:
                return self._controllers[name]
            path = self._path(name)
            if not path.exists():
                return None
            writer = self._writers.get(name, self.writer)
            session = Session.resume(str(path), writer=writer, isolation=self.isolation)
            with contextlib.suppress(OSError):
                os.utime(path)
            controller = self._controllers[name] = SessionController(session, title)
            return controller

    def new(self, session: Session | None = None, title: str = "") -> tuple[str, SessionController]:
        """A new session and its name; without a session it is the one that newcomers get."""
        if session is None:
            session, title = self._first()
        name = secrets.token_hex(16)
        controller = SessionController(session, title)
        try:
            session.keep(str(self._path(name)))
        except OvitaError as error:
            controller.error = f"This session is not kept on disk: {error}"
        with self._lock:
            self._controllers[name] = controller
        return name, controller

    def leave(self, name: str) -> None:
        """Close a session that no tab shows; its journal stays, and its writer as long as this lives."""
        with self._lock:
            controller = self._controllers.get(name)
            if controller is None or controller.watched or controller.busy is not None:
                return
            del self._controllers[name]
            if controller.session.writer is not self.writer:
                self._writers[name] = controller.session.writer
        controller.close()

    def __len__(self) -> int:
        return len(self._controllers)

    def _clear(self) -> None:
        """Delete the journals that nobody opened for long; no other file of the folder is touched."""
        oldest = time.time() - KEPT_DAYS * 86_400.0
        for path in self.folder.glob("*.jsonl"):
            with contextlib.suppress(OSError):
                if _NAME.fullmatch(path.stem) and path.lstat().st_mtime < oldest:
                    path.unlink()

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}.jsonl"
