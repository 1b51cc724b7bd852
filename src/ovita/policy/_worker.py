"""The process in which policies run, and the only module of ovita that runs text as code.

Started by `ovita.policy.processes` with an environment made from nothing.
"""

from __future__ import annotations
import __future__

import mmap
import os
import select
import sys
import time
from collections.abc import Callable
from typing import Any

from ovita.policy import lockdown, wire
from ovita.policy.environment import FILENAME, Environment, Modules, PolicyRun, watch_memory

if sys.platform != "win32":
    import resource


READ_LIMIT_S = 30.0
"""How long a child may take to receive its request [s]."""

MAX_FD = 64
"""Descriptors that a worker may have."""

RunChild = Callable[[wire.JobHeader, int], None]
"""Runs the policy of a request and writes its result to a descriptor; never returns."""


class _Spare:
    """A child that was forked ahead of time and waits for the header of its request."""

    def __init__(self, environment: Environment, run: RunChild, max_fd: int) -> None:
        self.reading, writing = os.pipe()
        control, self.control = os.pipe()
        worker = os.getpid()
        self.pid = os.fork()
        if self.pid == 0:
            try:
                lockdown.die_with(worker)
                close_all_but((0, control, writing), max_fd)
                for step in environment.rehearsal():
                    if _is_ready(control):
                        break
                    step()
                head = wire.JobHeader.unpack(wire.read_exact(control, wire.HEADER_SIZE))
                run(head, writing)
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


def close_all_but(kept: tuple[int, ...], max_fd: int = MAX_FD) -> None:
    """Close every descriptor below max_fd other than these."""
    first = 0
    for descriptor in [*sorted(kept), max_fd]:
        if first < descriptor:  # closerange(0, 0) closes everything
            os.closerange(first, descriptor)
        first = descriptor + 1


def _is_ready(descriptor: int, timeout_s: float = 0.0) -> bool:
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    return bool(poll.poll(timeout_s * 1000.0))


class Server:
    """The loop of a long-lived worker."""

    def __init__(self, environment: Environment, run: RunChild, parent: int) -> None:
        self.environment, self.run, self.parent, self.scipy = environment, run, parent, 0
        hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
        self.max_fd = MAX_FD if hard == resource.RLIM_INFINITY else min(MAX_FD, hard)
        resource.setrlimit(resource.RLIMIT_NOFILE, (self.max_fd, self.max_fd))
        # Private, never inherited and emptied after each policy: results do not meet.
        self.buffer = mmap.mmap(-1, wire.MAX_RESULT + 4096, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
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
        spare = _Spare(self.environment, self.run, self.max_fd)
        while True:
            data = self._next_header()
            head = wire.JobHeader.unpack(data)
            if head.scipy & ~self.scipy:
                spare.end()
                self.scipy |= head.scipy
                self.environment.load_scipy(head.scipy)
                spare = _Spare(self.environment, self.run, self.max_fd)
            child = spare
            os.write(child.control, data)
            spare = _Spare(self.environment, self.run, self.max_fd)
            ended, length = self._listen(head, child.reading)
            complete = ended == wire.ENDED and length == self._announced(length)
            if complete:
                os.kill(child.pid, 9)
            code = 0 if complete else child.end(grace_s=0.1 if ended == wire.ENDED else 0.0)
            wire.write_all(1, wire.JobEnd(ended, code, length).pack())
            wire.write_all(1, self.view[:length])
            if complete:
                child.end()
            if ended == wire.UNREAD:
                os._exit(3)  # the rest of the body is still in the pipe
            self.buffer.madvise(mmap.MADV_DONTNEED)

    def _next_header(self) -> bytes:
        data = b""
        while len(data) < wire.HEADER_SIZE:
            self._wait(0, None)
            part = os.read(0, wire.HEADER_SIZE - len(data))
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

    def _listen(self, head: wire.JobHeader, reading: int) -> tuple[int, int]:
        """Collect what the child writes until it has written its result or ends; how that went, and how much."""
        deadline = time.monotonic() + READ_LIMIT_S
        acknowledged, length = False, 0
        while True:
            if not self._wait(reading, deadline - time.monotonic()):
                return (wire.TIMED_OUT if acknowledged else wire.UNREAD), 0
            if not acknowledged:
                if os.read(reading, 1) != wire.ACKNOWLEDGED:
                    return wire.UNREAD, 0
                acknowledged = True
                deadline = time.monotonic() + head.wall_ms / 1000.0
                continue
            got = os.readv(reading, [self.view[length : wire.MAX_RESULT + 1]])
            length += got
            if length > wire.MAX_RESULT:
                return wire.FLOODED, 0
            if got == 0 or length == self._announced(length):
                return wire.ENDED, length

    def _announced(self, length: int) -> int:
        """Length of the result by its own account, or -1 while that is unknown."""
        return wire.payload_length(self.view[:length])


def main(mode: str, parent: int) -> None:
    """Run as a worker of ovita's process: "serve" forks one policy after another, "once" runs one."""
    environment = Environment(Modules())
    environment.warm_up()
    if mode == "once":
        os.write(1, wire.READY)
        head = wire.JobHeader.unpack(wire.read_exact(0, wire.HEADER_SIZE))
        environment.load_scipy(head.scipy)
        body = wire.read_exact(0, head.length)
        os.write(1, wire.ACKNOWLEDGED)
        _run(head, body, 1, environment, strict=False)
    else:

        def run_child(head: wire.JobHeader, writing: int) -> None:
            body = wire.read_exact(0, head.length)
            os.write(writing, wire.ACKNOWLEDGED)
            close_all_but((writing,))
            _run(head, body, writing, environment, strict=True)

        os.write(1, wire.READY)
        Server(environment, run_child, parent).serve()


def _run(head: wire.JobHeader, body: bytearray, writing: int, environment: Environment, *, strict: bool) -> None:
    """Lock the door, run the policy, write the result, end. Never returns."""
    sys.stdin = None
    sys.stdout = sys.stderr = environment.prints
    sys.__stdin__ = sys.__stdout__ = sys.__stderr__ = None  # type: ignore[misc]
    try:
        job = environment.prepare(body, checked=bool(head.flags & wire.CHECKED))
        if job.failure is None:
            _lock(head, writing, strict=strict)
            job.run(_execute)
    except lockdown.LockFailed as failed:
        job = PolicyRun.failed("isolation", str(failed))
    except BaseException as error:
        job = PolicyRun.failed("crashed", f"{type(error).__name__}: {error}")
    wire.write_all(writing, job.payload(environment.prints))
    os._exit(0)


def _lock(head: wire.JobHeader, writing: int, *, strict: bool) -> None:
    """Apply the kernel's restrictions; outside strict isolation, those available."""
    memory, cpu_s = head.memory_mb << 20, head.wall_ms // 1000 + 2
    base = lockdown.address_space()
    if sys.platform == "linux" and (strict or head.flags & wire.LOCKED):
        best_effort = not strict
        lockdown.attempt(lockdown.drop_privileges, best_effort)
        lockdown.attempt(lockdown.landlock, best_effort)
        lockdown.limit_resources(memory, cpu_s, base=base)
        if strict or lockdown.has_seccomp():
            lockdown.seccomp(writing)
        return
    watch_memory(memory)
    lockdown.limit_resources(memory, cpu_s, base=base)


def _execute(source: str, namespace: dict[str, Any]) -> None:
    code = compile(source, FILENAME, "exec", flags=__future__.annotations.compiler_flag, dont_inherit=True)
    exec(code, namespace)
