"""A log whose lines are chained: each carries the SHA-256 of the line before it.

A line that is changed, removed or inserted breaks the chain at the next one. The last line has none after it, so its
hash and number also stand in a file beside the log (its name with `.head`). Whoever may write both files can make the
chain anew: note the head elsewhere from time to time where that matters.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from ovita.io.files import Journal, atomic_write, examine, system_errors

PREVIOUS = "previous"
"""Key of a line that holds the hash of the line before it."""

START = "0" * 64
"""What the first line gives as the hash of the line before it."""


@dataclass(frozen=True)
class LedgerCheck:
    """What looking through a log found.

    Args:
        chained: How many of them are in the chain; those before it were written by earlier versions.
        head: Hash of the last line.
        faults: What is wrong, each a sentence; none if the chain is whole.
    """

    lines: int
    chained: int
    head: str
    faults: tuple[str, ...]


class Ledger:
    """A chained log of events at a path; its folder must exist."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self._head = Path(f"{self.path}.head")

    def add(self, event: Mapping[str, Any]) -> None:
        """Write one event; it is on disk when this returns, and other processes wait meanwhile.

        Raises:
            FormatError: If it cannot be written.
        """
        with self._locked():
            lines = self._lines() if self.path.exists() else []
            Journal(self.path).add({**event, PREVIOUS: _hash(lines[-1]) if lines else START})
            last = self._lines()[-1]
            atomic_write(self._head, json.dumps({"lines": len(lines) + 1, "sha256": _hash(last)}) + "\n")

    def events(self) -> list[dict[str, Any]]:
        """All events, oldest first."""
        return Journal(self.path).read()

    def check(self) -> LedgerCheck:
        """Look for lines that were changed, removed or inserted."""
        examine(self.path)
        lines = self._lines()
        hashes, given = [START, *map(_hash, lines)], [*map(_previous, lines)]
        first = next((i for i, previous in enumerate(given) if previous is not None), len(lines))
        why = "does not follow the line before it: one was changed, removed or inserted"
        faults = [f"line {i + 1} {why}" for i in range(first, len(lines)) if given[i] != hashes[i]]
        return LedgerCheck(len(lines), len(lines) - first, hashes[-1], (*faults, *self._end(lines, hashes[-1])))

    def _end(self, lines: list[bytes], head: str) -> list[str]:
        """What the note beside the log says against its end."""
        try:
            kept = json.loads(self._head.read_text())
            count, noted = int(kept["lines"]), str(kept["sha256"])
        except FileNotFoundError:
            return [f"{self._head.name} is missing, so nobody knows whether the last lines are"]
        except (OSError, ValueError, KeyError, TypeError):
            return [f"{self._head.name} cannot be read, so nobody knows whether the last lines are missing"]
        # One line more than noted: the machine stopped between the two writes.
        if noted == head or (len(lines) == count + 1 and len(lines) > 1 and noted == _hash(lines[-2])):
            return []
        if len(lines) < count:
            return [f"{count - len(lines)} of {count} lines are missing at the end"]
        return ["the last line is another than was written"]

    def _lines(self) -> list[bytes]:
        with system_errors(self.path, "read"):
            return self.path.read_bytes().split(b"\n")[:-1]

    @contextlib.contextmanager
    def _locked(self) -> Iterator[None]:
        try:
            import fcntl
        except ImportError:  # a system without it has no other process here either, as far as we know
            yield
            return
        with system_errors(self.path, "written"):
            handle = os.open(f"{self.path}.lock", os.O_RDWR | os.O_CREAT, 0o600)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX)
            yield
        finally:
            os.close(handle)


def _hash(line: bytes) -> str:
    return sha256(line).hexdigest()


def _previous(line: bytes) -> str | None:
    try:
        event = json.loads(line)
    except (ValueError, RecursionError):
        return ""
    return event.get(PREVIOUS) if isinstance(event, dict) else ""
