"""`exec:COMMAND`: a program of one's own as a baseline, in its own environment.

The program reads a request as one line of JSON from standard input and writes its answer as one line to standard
output; it may go on with the next line, or end, and is then started again. What it writes to standard error is shown
if it fails.
"""

from __future__ import annotations

import json
import os
import shlex
import signal
import subprocess
import tempfile
import threading
import weakref
from collections.abc import Callable
from dataclasses import dataclass
from typing import IO, Any

from ovita.baselines.base import Deformed
from ovita.errors import RequestError, TrajectoryError, WriterError, WriterFailure
from ovita.io import scene_dict, trajectory_rows
from ovita.io.waypoints import trajectory_from_rows
from ovita.paths.trajectory import Trajectory
from ovita.request import Request

TIMEOUT = 300.0
"""Longest time for an answer, the start included [s]."""

SHOWN = 200
"""Characters of a program's own words that are shown."""


class OwnProgram:
    """A program that answers requests; safe to share between threads, which then wait for one another.

    Args:
        command: As on a command line; it is split like a shell's, and no shell runs it.
        timeout: Longest time for an answer [s].

    Raises:
        RequestError: If there is no command, or it cannot be split.
    """

    keeps_limits = False

    def __init__(self, command: str, *, timeout: float = TIMEOUT) -> None:
        try:
            self._words = shlex.split(command)
        except ValueError as error:
            raise RequestError(f"exec:{command} cannot be read: {error}") from None
        if not self._words:
            raise RequestError("exec: names no command; write --writer 'exec:python my_baseline.py'")
        self.name = f"exec:{command}"
        self._timeout = timeout
        self._lock = threading.Lock()
        self._running: _Running | None = None
        self._end: Callable[[], object] = _nothing

    def deform(self, request: Request) -> Deformed:
        """The program's answer.

        Raises:
            WriterError: If it cannot be started, ends or takes too long without an answer, or answers something else.
        """
        with self._lock:
            try:
                return self._read(self._answer(json.dumps(question(request), allow_nan=False)), request.trajectory)
            except WriterError:
                self.close()
                raise

    def close(self) -> None:
        """End the program."""
        self._end()
        self._running, self._end = None, _nothing

    def _answer(self, line: str) -> str:
        """The line that a request's line is answered with; a program that ended after its last answer is started."""
        again = self._running is not None
        running = self._running = self._running or self._start()
        answer = running.ask(line, self._timeout)
        if not answer and again and not running.late:
            self.close()
            running = self._running = self._start()
            answer = running.ask(line, self._timeout)
        if not answer:
            raise self._failed(running.failure(self._timeout))
        return answer

    def _start(self) -> _Running:
        log = tempfile.TemporaryFile()
        try:
            process = subprocess.Popen(
                self._words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log, start_new_session=True
            )
        except OSError as error:
            log.close()
            raise self._failed(f"cannot be started: {error.strerror}", "no_access") from None
        running = _Running(process, log)
        self._end = weakref.finalize(self, running.end)
        return running

    def _read(self, line: str, path: Trajectory) -> Deformed:
        try:
            answer = json.loads(line)
        except ValueError:
            raise self._failed(f"answered {_cut(line)!r}, which is no JSON; print anything else to stderr") from None
        if not isinstance(answer, dict):
            raise self._failed("answered JSON that is no object; write one with the key trajectory")
        if "error" in answer:
            raise self._failed(f"says: {_cut(str(answer['error']))}")
        try:
            trajectory = trajectory_from_rows(answer.get("trajectory"), timestep=path.timestep)
        except TrajectoryError as error:
            raise self._failed(f"answered no trajectory: {error}") from None
        similarity = answer.get("similarity")
        if similarity is not None and (isinstance(similarity, bool) or not isinstance(similarity, int | float)):
            raise self._failed(f"answered the similarity {similarity!r}, which is no number")
        return Deformed(trajectory, str(answer.get("matched", "")), None if similarity is None else float(similarity))

    def _failed(self, problem: str, failure: WriterFailure = "other") -> WriterError:
        return WriterError(f"{self.name} {problem}", failure)


def question(request: Request) -> dict[str, Any]:
    """A request as a program reads it: a scene file's content (docs/conventions.md)."""
    return {
        "instruction": request.instruction,
        "trajectory": trajectory_rows(request.trajectory),
        "timestep": request.trajectory.timestep,
        **scene_dict(request.scene),
        "frame": request.scene.frame.name,
    }


@dataclass
class _Running:
    """A started program with what it writes to standard error; `late` once it was ended for taking too long."""

    process: subprocess.Popen[bytes]
    log: IO[bytes]
    late: bool = False

    def ask(self, line: str, seconds: float) -> str:
        """Write a line and read one; "" if the program ended or took longer."""
        assert self.process.stdin is not None and self.process.stdout is not None
        timer = threading.Timer(seconds, self._expire)
        timer.daemon = True
        timer.start()
        try:
            self.process.stdin.write(line.encode() + b"\n")
            self.process.stdin.flush()
            return self.process.stdout.readline().decode("utf-8", "replace")
        except OSError:
            return ""
        finally:
            timer.cancel()

    def failure(self, seconds: float) -> str:
        """Why there was no answer."""
        if self.late:
            return f"gave no answer within {seconds:g} s"
        code = self.process.wait()
        self.log.seek(0)
        said = self.log.read().decode("utf-8", "replace").strip().splitlines()
        return f"ended with exit code {code} and no answer" + (f": {_cut(said[-1])}" if said else "")

    def end(self) -> None:
        """Kill the program and its children, and close the files."""
        self._kill()
        self.process.wait()
        for file in (self.process.stdin, self.process.stdout, self.log):
            try:
                if file is not None:
                    file.close()
            except OSError:
                pass

    def _expire(self) -> None:
        self.late = True
        self._kill()

    def _kill(self) -> None:
        if self.process.returncode is not None:
            return  # its number may be another's by now
        try:
            os.killpg(self.process.pid, signal.SIGKILL)
        except (AttributeError, ProcessLookupError, PermissionError):
            self.process.kill()


def _nothing() -> None:
    """There is no program to end."""


def _cut(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= SHOWN else f"{text[: SHOWN - 1]}…"
