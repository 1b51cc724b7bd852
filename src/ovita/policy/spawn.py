"""Degraded isolation: a process started for one policy, on any system."""

from __future__ import annotations

import io
import subprocess
import sys
import threading
import time

from ovita.policy.frames import ENDED, FLOODED, MAX_RESULT, TIMED_OUT, UNREAD, Reply, Request
from ovita.policy.job import confine
from ovita.policy.processes import SCIPY_GRACE_S, Answer, end, hello, start


def once(head: Request, body: bytes) -> Answer:
    """Run one policy in a process of its own, started for it: slower than a worker, and possible everywhere.

    Raises:
        IsolationUnavailable: If the process cannot be started or confined.
    """
    process = start("once")
    job = None
    try:
        hello(process)
        job = confine(process.pid, head.memory_mb << 20) if sys.platform == "win32" else None
        return _communicate(process, head, body)
    finally:
        end(process)
        if job is not None:
            job.close()


class _Received:
    """What a process writes, collected by a thread up to a cap."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        self.data = bytearray()
        self.begun = threading.Event()
        self.thread = threading.Thread(target=self._collect, args=(process,), daemon=True)
        self.thread.start()

    def _collect(self, process: subprocess.Popen[bytes]) -> None:
        stream = process.stdout
        assert isinstance(stream, io.BufferedReader)
        while len(self.data) <= MAX_RESULT:
            part = stream.read1(1 << 16)
            if not part:
                break
            self.data += part
            self.begun.set()
        self.begun.set()


def _communicate(process: subprocess.Popen[bytes], head: Request, body: bytes) -> Answer:
    received = _Received(process)
    threading.Thread(target=_feed, args=(process, head.pack() + body), daemon=True).start()
    received.begun.wait(SCIPY_GRACE_S)  # the process acknowledges once everything is loaded and read
    started = time.monotonic()
    received.thread.join(head.wall_ms / 1000.0)
    timed_out = received.thread.is_alive()
    flooded = len(received.data) > MAX_RESULT
    if timed_out or flooded:
        process.kill()
    code = process.wait()
    received.thread.join(1.0)
    ended = TIMED_OUT if timed_out else FLOODED if flooded else ENDED if received.data else UNREAD
    data = bytes(received.data[1:]) if ended == ENDED else b""
    return Answer(Reply(ended, code, int((time.monotonic() - started) * 1e6), len(data)), data)


def _feed(process: subprocess.Popen[bytes], data: bytes) -> None:
    assert process.stdin is not None
    try:
        process.stdin.write(data)
        process.stdin.close()
    except OSError:
        pass
