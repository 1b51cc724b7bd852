"""A journal: events in the order in which they happened, one JSON object a line, each on disk before the next.

A process that is killed while it writes leaves at most one line without an end; it is dropped when the journal is read,
and cut off before anything is added.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ovita.errors import FormatError
from ovita.io.files import atomic_write, examine, file_name


class Journal:
    """An append-only file of events.

    Args:
        path: Of the file, which is made when the first event is added; its folder must exist.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)

    def add(self, event: Mapping[str, Any]) -> None:
        """Write one event; it is on disk when this returns.

        Raises:
            FormatError: If the file cannot be written, or the event has no place in JSON.
        """
        line = self._line(event)
        handle = self._open()
        try:
            with os.fdopen(handle, "rb+") as stream:
                stream.seek(_whole(stream))
                stream.truncate()
                stream.write(line.encode("ascii"))
                stream.flush()
                os.fsync(stream.fileno())
        except OSError as error:
            raise FormatError(file_name(self.path), f"cannot be written: {error.strerror}") from None

    def rewrite(self, events: Iterable[Mapping[str, Any]]) -> None:
        """Put these events in the place of all there are, in one step.

        Raises:
            FormatError: If the file cannot be written; the old events are then still there.
        """
        content = "".join(map(self._line, events))
        os.close(self._open())  # so that a new file, too, is for its owner's eyes only
        atomic_write(self.path, content)

    def read(self) -> list[dict[str, Any]]:
        """All events, oldest first; an incomplete last line is skipped.

        Raises:
            FormatError: If the file cannot be read, or a finished line is not a JSON object.
        """
        examine(self.path)
        try:
            lines = self.path.read_bytes().split(b"\n")
        except OSError as error:
            raise FormatError(file_name(self.path), f"cannot be read: {error.strerror}") from None
        events = []
        for number, line in enumerate(lines[:-1]):
            try:
                event = json.loads(line)
            except (ValueError, RecursionError):
                event = None
            if not isinstance(event, dict):
                raise FormatError(file_name(self.path), f"line {number + 1} is not an event; the journal is damaged")
            events.append(event)
        return events

    def _open(self) -> int:
        try:
            return os.open(self.path, os.O_RDWR | os.O_CREAT, 0o600)
        except OSError as error:
            raise FormatError(file_name(self.path), f"cannot be written: {error.strerror}") from None

    def _line(self, event: Mapping[str, Any]) -> str:
        try:
            return json.dumps(event, ensure_ascii=True, allow_nan=False, separators=(",", ":")) + "\n"
        except (TypeError, ValueError) as error:
            raise FormatError(file_name(self.path), f"cannot be written as JSON: {error}") from None


def _whole(stream: Any) -> int:
    """Length of the part that consists of finished lines [bytes]."""
    end = int(stream.seek(0, os.SEEK_END))
    at = end
    while at > 0:
        start = max(at - 65536, 0)
        stream.seek(start)
        found = stream.read(at - start).rfind(b"\n")
        if found >= 0:
            return start + int(found) + 1
        at = start
    return 0
