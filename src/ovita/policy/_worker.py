"""The process in which policies run: it forks a child for each, locks it in and reports how it ended.

Started by `ovita.policy.processes` with an environment made from nothing. It never reads a request's body, so
that no child inherits anything of an earlier policy; and it forks the child for the next policy ahead of time, so that
nobody waits for that. This is the only module of ovita that runs text as code.
"""

from __future__ import annotations
import __future__

import json
import os
import struct
import sys
import time
from typing import Any

from ovita.policy import frames, lockdown, runtime
from ovita.policy.frames import CHECKED, ENDED, FLOODED, LOCKED, TIMED_OUT, UNREAD, Reply, Request
from ovita.policy.modules import Modules

if sys.platform != "win32":
    import mmap
    import resource
    import select

READ_LIMIT_S = 30.0
"""How long a child may take to receive its request [s]."""


def main(mode: str, parent: int) -> None:
    """Run as a worker.

    Args:
        mode: "serve" for a long-lived worker that forks, "once" for a process that runs one policy.
        parent: Process id of ovita.
    """
    stage = runtime.Stage(Modules())
    if mode == "once":
        _say({"missing": []})
        head = Request.unpack(_read_exact(0, frames.REQUEST_SIZE))
        stage.load_scipy(head.scipy)
        _run(head, 0, 1, stage, strict=False)
    else:
        stage.prepare_to_fork()
        _say({"missing": lockdown.missing_locks(), "landlock": lockdown.landlock_version()})
        _Server(stage, parent).serve()


class _Spare:
    """A child that was forked ahead of time and waits for the header of its request."""

    def __init__(self, stage: runtime.Stage, max_fd: int) -> None:
        self.reading, writing = os.pipe()
        control, self.control = os.pipe()
        worker = os.getpid()
        self.pid = os.fork()
        if self.pid == 0:
            try:
                lockdown.die_with(worker)
                _close_all_but((0, control, writing), max_fd)
                for step in stage.rehearsal():
                    if _is_ready(control):
                        break
                    step()
                head = Request.unpack(_read_exact(control, frames.REQUEST_SIZE))
                _run(head, 0, writing, stage, strict=True, max_fd=max_fd)
            finally:
                os._exit(70)
        os.close(writing)
        os.close(control)

    def end(self, grace_s: float = 0.0) -> int:
        """Kill the child unless it ends by itself in time; its exit code, or minus the signal that ended it."""
        os.close(self.reading)
        os.close(self.control)
        if grace_s:
            descriptor = os.pidfd_open(self.pid)
            _is_ready(descriptor, grace_s)
            os.close(descriptor)
        os.kill(self.pid, 9)
        return os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])


def _close_all_but(kept: tuple[int, ...], max_fd: int) -> None:
    first = 0
    for descriptor in [*sorted(kept), max_fd]:
        if first < descriptor:  # closerange(0, 0) closes everything
            os.closerange(first, descriptor)
        first = descriptor + 1


def _is_ready(descriptor: int, timeout_s: float = 0.0) -> bool:
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    return bool(poll.poll(timeout_s * 1000.0))


class _Server:
    """The loop of a long-lived worker."""

    def __init__(self, stage: runtime.Stage, parent: int) -> None:
        self.stage, self.parent, self.scipy = stage, parent, 0
        hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
        self.max_fd = 64 if hard == resource.RLIM_INFINITY else min(64, hard)
        resource.setrlimit(resource.RLIMIT_NOFILE, (self.max_fd, self.max_fd))
        # Private, never inherited and emptied after each policy: results do not meet.
        self.buffer = mmap.mmap(-1, frames.MAX_RESULT + 4096, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
        self.buffer.madvise(mmap.MADV_DONTFORK)
        self.view = memoryview(self.buffer)
        self.alive = self._watch_parent()

    def _watch_parent(self) -> int:
        """A descriptor that becomes readable when ovita ends, however it ends; -1 if the kernel has none."""
        try:
            descriptor = os.pidfd_open(self.parent)
        except OSError:
            return -1
        if os.getppid() != self.parent:
            os._exit(0)
        return descriptor

    def serve(self) -> None:
        """Answer requests until ovita ends."""
        spare = _Spare(self.stage, self.max_fd)
        while True:
            data = self._next_header()
            head = Request.unpack(data)
            if head.scipy & ~self.scipy:
                spare.end()
                self.scipy |= head.scipy
                self.stage.load_scipy(head.scipy)
                spare = _Spare(self.stage, self.max_fd)
            child = spare
            started = time.monotonic()
            os.write(child.control, data)
            spare = _Spare(self.stage, self.max_fd)
            ended, length = self._listen(head, child.reading)
            complete = ended == ENDED and length == self._announced(length)
            if complete:
                os.kill(child.pid, 9)
            code = 0 if complete else child.end(grace_s=0.1 if ended == ENDED else 0.0)
            _write_all(1, Reply(ended, code, int((time.monotonic() - started) * 1e6), length).pack())
            _write_all(1, self.view[:length])
            if complete:
                child.end()
            if ended == UNREAD:
                os._exit(3)  # the rest of the body is still in the pipe
            self.buffer.madvise(mmap.MADV_DONTNEED)

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
        poll = select.poll()
        poll.register(descriptor, select.POLLIN)
        if descriptor != 0:
            poll.register(0, 0)
        if self.alive >= 0:
            poll.register(self.alive, select.POLLIN)
        events = dict(poll.poll(None if timeout_s is None else max(0.0, timeout_s * 1000.0)))
        if self.alive in events or (descriptor != 0 and 0 in events):
            os._exit(0)  # the child dies with this process
        return descriptor in events

    def _listen(self, head: Request, reading: int) -> tuple[int, int]:
        """Collect what the child writes until it has written its result or ends; how that went, and how much."""
        deadline = time.monotonic() + READ_LIMIT_S
        acknowledged, length = False, 0
        while True:
            if not self._wait(reading, deadline - time.monotonic()):
                return (TIMED_OUT if acknowledged else UNREAD), 0
            if not acknowledged:
                if os.read(reading, 1) != frames.ACKNOWLEDGED:
                    return UNREAD, 0
                acknowledged = True
                deadline = time.monotonic() + head.wall_ms / 1000.0
                continue
            got = os.readv(reading, [self.view[length : frames.MAX_RESULT + 1]])
            length += got
            if length > frames.MAX_RESULT:
                return FLOODED, 0
            if got == 0 or length == self._announced(length):
                return ENDED, length

    def _announced(self, length: int) -> int:
        """Length of the result by its own account, or -1 while that is unknown."""
        return frames.payload_length(self.view[:length])


def _run(head: Request, reading: int, writing: int, stage: runtime.Stage, *, strict: bool, max_fd: int = 0) -> None:
    """Read the body, lock the door, run the policy, write the result, end. Never returns."""
    body = _read_exact(reading, head.length)
    os.write(writing, frames.ACKNOWLEDGED)
    if strict:
        _close_all_but((writing,), max_fd)
    sys.stdin = None
    sys.stdout = sys.stderr = stage.prints
    sys.__stdin__ = sys.__stdout__ = sys.__stderr__ = None  # type: ignore[misc]
    try:
        outcome = stage.prepare(body, checked=bool(head.flags & CHECKED))
        if outcome.failure is None:
            _lock(head, writing, strict=strict)
            outcome.run(_execute)
    except lockdown.LockFailed as failed:
        outcome = runtime.Outcome.failed("isolation", str(failed))
    except BaseException as error:
        outcome = runtime.Outcome.failed("crashed", f"{type(error).__name__}: {error}")
    _write_all(writing, outcome.payload(stage.prints))
    os._exit(0)


def _lock(head: Request, writing: int, *, strict: bool) -> None:
    """Close what the kernel can close; outside strict isolation, as much as there is."""
    memory, cpu_s = head.memory_mb << 20, head.wall_ms // 1000 + 2
    if sys.platform == "win32":
        return  # a job object around this process holds the limits
    base = lockdown.address_space()
    if sys.platform == "linux" and (strict or head.flags & LOCKED):
        best_effort = not strict
        lockdown.attempt(lockdown.drop_privileges, best_effort)
        lockdown.attempt(lockdown.landlock, best_effort)
        lockdown.limit_resources(memory, cpu_s, base=base)
        if strict or lockdown.has_seccomp():
            lockdown.seccomp(writing)
        return
    runtime.watch_memory(memory)
    lockdown.limit_resources(memory, cpu_s, base=base)


def _execute(source: str, namespace: dict[str, Any]) -> None:
    code = compile(source, runtime.FILENAME, "exec", flags=__future__.annotations.compiler_flag, dont_inherit=True)
    exec(code, namespace)


def _say(hello: dict[str, Any]) -> None:
    data = json.dumps(hello).encode()
    _write_all(1, struct.pack("<I", len(data)) + data)


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
