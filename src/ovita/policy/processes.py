"""The parent's side of the sandbox's processes: starting them, talking to them, ending them."""

from __future__ import annotations

import atexit
import os
import select
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

import ovita.plugins as plugins
from ovita.errors import IsolationUnavailable, PolicyCrashed
from ovita.policy import wire

START_LIMIT_S = 60.0
"""How long a worker may take to come up [s]; scipy on a loaded machine takes a few."""

GRACE_S = 5.0
"""How long a worker may take beyond a policy's wall clock before it is given up [s]."""

SCIPY_GRACE_S = 60.0
"""The same when parts of scipy may have to be loaded first [s]."""

_THREADS = ("OPENBLAS", "OMP", "MKL", "BLIS", "NUMEXPR", "VECLIB_MAXIMUM")

_BOOT = """\
import sys
at = next((i for i, p in enumerate(sys.path) if p.endswith("-packages")), len(sys.path))
sys.path[at:at] = [p for p in sys.argv[3:] if p not in sys.path]
from ovita.policy._worker import main
main(sys.argv[1], int(sys.argv[2]))
"""


class WorkerLost(Exception):
    """The worker ended or fell silent in the middle of a conversation."""


class Worker:
    """A worker process: a long-lived one that answers request after request, or one that runs a single policy.

    Args:
        mode: "serve" or "once", as in `_worker.main`.

    Raises:
        IsolationUnavailable: If it cannot be started.
    """

    def __init__(self, mode: str = "serve") -> None:
        self.process = _start(mode)
        assert self.process.stdin is not None and self.process.stdout is not None
        self.writing, self.reading = self.process.stdin.fileno(), self.process.stdout.fileno()
        os.set_blocking(self.writing, False)
        os.set_blocking(self.reading, False)
        try:
            greeting = self._read(1, time.monotonic() + START_LIMIT_S)
        except WorkerLost:
            greeting = b""
        if greeting != wire.READY:
            self.stop()
            raise IsolationUnavailable(
                f"the sandbox's worker did not start (exit code {self.process.returncode}); "
                f"try: {sys.executable} -s -P -c 'import numpy, ovita'"
            )

    def ask(self, head: wire.JobHeader, body: bytes) -> wire.JobEnd:
        """Send a request and wait for its answer.

        Raises:
            WorkerLost: If the worker ends or does not answer in time.
        """
        grace = SCIPY_GRACE_S if head.scipy else GRACE_S
        deadline = time.monotonic() + head.wall_ms / 1000.0 + grace
        try:
            self._write(head.pack() + body, deadline)
            ended = wire.JobEnd.unpack(self._read(wire.END_SIZE, deadline))
            return ended._replace(data=self._read(ended.length, deadline))
        except (OSError, wire.BadFrame) as error:
            raise WorkerLost(str(error)) from None

    def run(self, head: wire.JobHeader, body: bytes) -> wire.JobEnd:
        """Have the one policy of this process run, and take what it writes until it ends."""
        data, ended = bytearray(), wire.UNREAD
        try:
            loaded = time.monotonic() + SCIPY_GRACE_S
            self._write(head.pack() + body, loaded)
            self._read(1, loaded)  # it acknowledges once everything is loaded and read
            ended, deadline = wire.TIMED_OUT, time.monotonic() + head.wall_ms / 1000.0
            while len(data) <= wire.MAX_RESULT and (part := self._part(1 << 16, deadline)):
                data += part
            ended = wire.ENDED if len(data) <= wire.MAX_RESULT else wire.FLOODED
        except (OSError, WorkerLost):
            pass
        if ended != wire.ENDED:
            self.process.kill()
        result = bytes(data) if ended == wire.ENDED else b""
        return wire.JobEnd(ended, self.process.wait(), len(result), result)

    def _write(self, data: bytes, deadline: float) -> None:
        view = memoryview(data)
        while view:
            self._wait(self.writing, select.POLLOUT, deadline)
            view = view[os.write(self.writing, view) :]

    def _read(self, length: int, deadline: float) -> bytes:
        data = bytearray()
        while len(data) < length:
            part = self._part(length - len(data), deadline)
            if not part:
                raise WorkerLost("the worker ended")
            data += part
        return bytes(data)

    def _part(self, most: int, deadline: float) -> bytes:
        """What there is to read; nothing once the worker has ended."""
        self._wait(self.reading, select.POLLIN, deadline)
        return os.read(self.reading, min(1 << 20, most))

    def _wait(self, descriptor: int, event: int, deadline: float) -> None:
        poll = select.poll()
        poll.register(descriptor, event)
        if not poll.poll(max(0.0, deadline - time.monotonic()) * 1000.0):
            raise WorkerLost("the worker does not answer")

    def stop(self) -> None:
        """Kill the worker, and with it the policy that it may be running; wait for it and close its pipes."""
        self.process.kill()
        self.process.wait()
        self._close_pipes()

    def forget(self) -> None:
        """Let go of a worker that belongs to the process this one was forked from."""
        self.process.returncode = 0  # or its destructor would wait for a process that is not ours
        self._close_pipes()

    def _close_pipes(self) -> None:
        for pipe in (self.process.stdin, self.process.stdout):
            with suppress(OSError):
                if pipe is not None:
                    pipe.close()


class Pool:
    """The workers of this process: one with numpy, and one with scipy once a policy asks for it."""

    def __init__(self) -> None:
        self._workers: dict[bool, Worker] = {}
        self._locks = {False: threading.Lock(), True: threading.Lock()}
        self._ended = False

    def ask(self, head: wire.JobHeader, body: bytes) -> wire.JobEnd:
        """Have a request answered by the worker that fits, started if need be and restarted once if it was lost.

        Raises:
            IsolationUnavailable: If no worker can be started, or the machine cannot lock a policy in.
            PolicyCrashed: If the worker is lost twice over the same request.
        """
        kind = bool(head.scipy)
        with self._locks[kind]:
            for _ in range(2):
                worker = self._worker(kind)
                try:
                    return worker.ask(head, body)
                except WorkerLost:
                    self._discard(kind)
                except BaseException:
                    self._discard(kind)  # interrupted in the middle of a conversation
                    raise
            raise PolicyCrashed("the sandbox's worker ended while it ran the policy")

    def pids(self) -> tuple[int, ...]:
        """Process ids of the running workers."""
        return tuple(worker.process.pid for worker in self._workers.values())

    def _worker(self, kind: bool) -> Worker:
        if self._ended:
            raise IsolationUnavailable("this process is ending, and its sandbox with it")
        worker = self._workers.get(kind)
        if worker is not None and worker.process.poll() is not None:
            self._discard(kind)
            worker = None
        if worker is None:
            worker = self._workers[kind] = Worker()
        return worker

    def _discard(self, kind: bool) -> None:
        worker = self._workers.pop(kind, None)
        if worker is not None:
            worker.stop()

    def close(self) -> None:
        """Stop all workers; the next request starts a new one."""
        for kind in list(self._workers):
            with self._locks[kind]:
                self._discard(kind)

    def end(self) -> None:
        """Kill all workers immediately and start no more."""
        self._ended = True
        for worker in list(self._workers.values()):
            worker.process.kill()
            worker.process.wait()

    def after_fork(self) -> None:
        """Start afresh in a forked child: the workers answer to the parent."""
        for worker in self._workers.values():
            worker.forget()
        self.__init__()  # type: ignore[misc]


POOL = Pool()
atexit.register(POOL.end)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=POOL.after_fork)


def _start(mode: str) -> subprocess.Popen[bytes]:
    """Start a worker with an environment made from nothing.

    The flags are those of `-I`, except that it would ignore PYTHONHASHSEED too, and with it sets of texts would
    come in another order in every process.

    Raises:
        IsolationUnavailable: If Python cannot be started.
    """
    if not sys.executable:
        raise IsolationUnavailable("the sandbox needs a Python to start (sys.executable is empty)")
    command = [sys.executable, "-s", "-P", "-c", _BOOT, mode, str(os.getpid()), *_paths()]
    environment = {"PYTHONHASHSEED": "0", "LANG": "C.UTF-8", "PATH": os.defpath}
    environment |= {f"{name}_NUM_THREADS": "1" for name in _THREADS}
    environment |= {name: os.environ[name] for name in ("LD_LIBRARY_PATH", "SYSTEMROOT") if name in os.environ}
    try:
        return subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            cwd=Path(sys.executable).anchor or None,
            env=environment,
            start_new_session=True,
        )
    except OSError as error:
        raise IsolationUnavailable(f"the sandbox's Python could not be started: {error}") from None


def _paths() -> Sequence[str]:
    """Import paths of ovita, numpy, scipy and of plug-ins with operations for the worker."""
    found = []
    for package in ("ovita", "numpy", "scipy"):
        spec = find_spec(package)
        if spec is not None and spec.origin:
            found.append(str(Path(spec.origin).parent.parent))
    return list(dict.fromkeys([*found, *plugins.folders("operations")]))


def once(head: wire.JobHeader, body: bytes) -> wire.JobEnd:
    """Run one policy in a process of its own, started for it: slower than a worker, and possible everywhere.

    Raises:
        IsolationUnavailable: If the process cannot be started or confined.
    """
    if sys.platform == "win32":
        raise IsolationUnavailable("nothing bounds a policy's memory on Windows; run ovita in WSL")
    worker = Worker("once")
    try:
        return worker.run(head, body)
    finally:
        worker.stop()
