"""The process in which policies run, and the only module of ovita that runs text as code.

Started by `ovita.policy.processes` with an environment made from nothing.
"""

from __future__ import annotations
import __future__

import os
import sys
from typing import Any

from ovita.policy import frames, lockdown, runtime
from ovita.policy.frames import CHECKED, LOCKED, Request, read_exact, write_all
from ovita.policy.modules import Modules


def main(mode: str, parent: int) -> None:
    """Run as a worker.

    Args:
        mode: "serve" for a long-lived worker that forks, "once" for a process that runs one policy.
        parent: Process id of ovita.
    """
    if sys.platform == "win32":
        import msvcrt

        for descriptor in (0, 1):
            msvcrt.setmode(descriptor, os.O_BINARY)
    stage = runtime.Stage(Modules())
    stage.warm_up()
    if mode == "once":
        os.write(1, frames.READY)
        head = Request.unpack(read_exact(0, frames.REQUEST_SIZE))
        stage.load_scipy(head.scipy)
        body = read_exact(0, head.length)
        os.write(1, frames.ACKNOWLEDGED)
        _run(head, body, 1, stage, strict=False)
    else:
        from ovita.policy import _server

        def run_child(head: Request, writing: int) -> None:
            body = read_exact(0, head.length)
            os.write(writing, frames.ACKNOWLEDGED)
            _server.close_all_but((writing,))
            _run(head, body, writing, stage, strict=True)

        os.write(1, frames.READY)
        _server.Server(stage, run_child, parent).serve()


def _run(head: Request, body: bytearray, writing: int, stage: runtime.Stage, *, strict: bool) -> None:
    """Lock the door, run the policy, write the result, end. Never returns."""
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
    write_all(writing, outcome.payload(stage.prints))
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
