"""The process in which policies run: it forks a child for each, locks it in and reports how it ended.

Started by `ovita.policy.processes` with an environment made from nothing. It never reads a request's body, so
that no child inherits anything of an earlier policy. This is the only module of ovita that runs text as code.
"""

from __future__ import annotations

import gc
import json
import os
import struct
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from ovita.policy import frames, lockdown, runtime
from ovita.policy.allowed import MODULES, SCIPY_PARTS
from ovita.policy.frames import CHECKED, ENDED, FLOODED, LOCKED, TIMED_OUT, UNREAD, Reply, Request
from ovita.policy.modules import Modules

READ_LIMIT_S = 30.0
"""How long a child may take to receive its request [s]."""


def main(mode: str, parent: int) -> None:
    """Run as a worker.

    Args:
        mode: "serve" for a long-lived worker that forks, "once" for a process that runs one policy.
        parent: Process id of ovita.
    """
    modules = _prepare()
    if mode == "once":
        _say(json.dumps({"missing": []}).encode())
        head = Request.unpack(_read_exact(0, frames.REQUEST_SIZE))
        _load_scipy(modules, head.scipy)
        _run(head, 0, 1, modules, strict=False)
    else:
        _say(json.dumps({"missing": lockdown.missing_locks(), "landlock": lockdown.landlock_version()}).encode())
        _Server(modules, parent).serve()


def _prepare() -> Modules:
    """Import what policies use, so that a child finds it without opening a file."""
    modules = Modules()
    for name in sorted(MODULES):
        if not name.startswith("scipy"):
            modules.load(name)
    runtime.make_deterministic()
    runtime.warm_up()
    gc.collect()
    gc.freeze()
    return modules


def _load_scipy(modules: Modules, mask: int) -> None:
    if mask:
        modules.load("scipy")
        for i, part in enumerate(SCIPY_PARTS):
            if mask & (1 << i):
                modules.load(part)
        runtime.warm_up_scipy(mask)
        gc.collect()
        gc.freeze()


class _Server:
    """The loop of a long-lived worker."""

    def __init__(self, modules: Modules, parent: int) -> None:
        import mmap
        import resource
        import select

        self.modules = modules
        self.parent = parent
        hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
        limit = 64 if hard == resource.RLIM_INFINITY else min(64, hard)
        resource.setrlimit(resource.RLIMIT_NOFILE, (limit, limit))
        self.max_fd = limit
        # Private, never inherited and emptied after each policy: results do not meet.
        self.buffer = mmap.mmap(-1, frames.MAX_RESULT + 4096, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
        self.buffer.madvise(getattr(mmap, "MADV_DONTFORK", 10))
        self.forget: Callable[[], None] = lambda: self.buffer.madvise(mmap.MADV_DONTNEED)
        self.poll = select.poll
        self.alive = self._watch_parent()

    def _watch_parent(self) -> int:
        """A descriptor that becomes readable when ovita ends, or -1."""
        try:
            descriptor = os.pidfd_open(self.parent)
        except (OSError, AttributeError):
            return -1
        if os.getppid() != self.parent:
            os._exit(0)
        return descriptor

    def serve(self) -> None:
        while True:
            head = Request.unpack(self._next_header())
            _load_scipy(self.modules, head.scipy)
            reply = self._one(head)
            _write_all(1, reply.pack())
            _write_all(1, memoryview(self.buffer)[: reply.length])
            if reply.length:
                self.forget()
            if reply.ended == UNREAD:
                os._exit(3)  # the rest of the body is still in the pipe

    def _next_header(self) -> bytes:
        data = b""
        while len(data) < frames.REQUEST_SIZE:
            self._wait(0, None)
            part = os.read(0, frames.REQUEST_SIZE - len(data))
            if not part:
                os._exit(0)
            data += part
        return data

    def _wait(self, descriptor: int, timeout_s: float | None) -> bool:
        """Wait until there is something to read; leave when ovita does."""
        import select

        poll = self.poll()
        poll.register(descriptor, select.POLLIN)
        if descriptor != 0:
            poll.register(0, 0)
        if self.alive >= 0:
            poll.register(self.alive, select.POLLIN)
        events = dict(poll.poll(None if timeout_s is None else max(0.0, timeout_s * 1000.0)))
        if self.alive in events or (descriptor != 0 and 0 in events):
            os._exit(0)  # the child dies with this process
        return descriptor in events

    def _one(self, head: Request) -> Reply:
        started = time.monotonic()
        reading, writing = os.pipe()
        child = os.fork()
        if child == 0:
            try:
                os.close(reading)
                _run(head, 0, writing, self.modules, strict=True, max_fd=self.max_fd)
            finally:
                os._exit(70)
        os.close(writing)
        try:
            ended, length = self._listen(head, reading)
        finally:
            os.close(reading)
            if _still_runs(child):
                os.kill(child, 9)
            status = os.waitpid(child, 0)[1]
        code = os.waitstatus_to_exitcode(status)
        return Reply(ended, code, int((time.monotonic() - started) * 1e6), length)

    def _listen(self, head: Request, reading: int) -> tuple[int, int]:
        """Collect what the child writes until it ends; how it ended, and how much it wrote."""
        deadline = time.monotonic() + READ_LIMIT_S
        acknowledged = False
        view = memoryview(self.buffer)
        length = 0
        while True:
            if not self._wait(reading, deadline - time.monotonic()):
                return (TIMED_OUT if acknowledged else UNREAD), length
            if not acknowledged:
                if os.read(reading, 1) != frames.ACKNOWLEDGED:
                    return UNREAD, 0
                acknowledged = True
                deadline = time.monotonic() + head.wall_ms / 1000.0
                continue
            got = os.readv(reading, [view[length : frames.MAX_RESULT + 1]])
            if got == 0:
                return ENDED, length
            length += got
            if length > frames.MAX_RESULT:
                return FLOODED, 0


def _still_runs(child: int) -> bool:
    """Whether a child has not ended, leaving it to be waited for; an ending one gets a moment to do so."""
    for _ in range(20):
        if os.waitid(os.P_PID, child, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None:
            return False
        time.sleep(0.0005)
    return True


def _run(head: Request, reading: int, writing: int, modules: Modules, *, strict: bool, max_fd: int = 0) -> None:
    """Read the body, lock the door, run the policy, write the result, end. Never returns."""
    body = _read_exact(reading, head.length)
    os.write(writing, frames.ACKNOWLEDGED)
    if strict:
        os.closerange(0, writing)
        os.closerange(writing + 1, max_fd)
    prints = runtime.Prints()
    sys.stdin = None  # type: ignore[assignment]
    sys.stdout = sys.stderr = prints  # type: ignore[assignment]
    sys.__stdin__ = sys.__stdout__ = sys.__stderr__ = None  # type: ignore[misc,assignment]
    checked = bool(head.flags & CHECKED)
    try:
        outcome = runtime.prepare(body, prints, modules, checked=checked)
        if outcome.failure is None:
            _lock(head, writing, strict=strict)
            outcome.run(_execute)
    except lockdown.LockFailed as failed:
        outcome = runtime.Outcome.failed("isolation", str(failed))
    except BaseException as error:
        outcome = runtime.Outcome.failed("crashed", f"{type(error).__name__}: {error}")
    _write_all(writing, outcome.payload(prints))
    os._exit(0)


def _lock(head: Request, writing: int, *, strict: bool) -> None:
    """Close what the kernel can close; outside strict isolation, as much as there is."""
    memory, cpu_s = head.memory_mb << 20, head.wall_ms // 1000 + 2
    if strict:
        base = lockdown.address_space()
        lockdown.drop_privileges()
        lockdown.landlock()
        lockdown.limit_resources(memory, cpu_s, base=base)
        lockdown.seccomp(writing)
        return
    if sys.platform == "win32":
        return
    if sys.platform == "linux" and head.flags & LOCKED:
        base = lockdown.address_space()
        for step in (lockdown.drop_privileges, lockdown.landlock):
            try:
                step()
            except lockdown.LockFailed:
                pass
        lockdown.limit_resources(memory, cpu_s, base=base)
        if lockdown.has_seccomp():
            lockdown.seccomp(writing)
        return
    runtime.watch_memory(memory)
    lockdown.limit_resources(memory, cpu_s)


def _execute(source: str, namespace: dict[str, Any]) -> None:
    import __future__

    code = compile(source, runtime.FILENAME, "exec", flags=__future__.annotations.compiler_flag, dont_inherit=True)
    exec(code, namespace)


def _say(hello: bytes) -> None:
    _write_all(1, struct.pack("<I", len(hello)) + hello)


def _read_exact(descriptor: int, length: int) -> bytearray:
    data = bytearray(length)
    view, done = memoryview(data), 0
    while done < length:
        part = os.read(descriptor, min(1 << 20, length - done))
        if not part:
            os._exit(0)
        view[done : done + len(part)] = part
        done += len(part)
    view.release()
    return data


def _write_all(descriptor: int, data: bytes | memoryview) -> None:
    view = memoryview(data)
    while view:
        view = view[os.write(descriptor, view) :]


_ = np
