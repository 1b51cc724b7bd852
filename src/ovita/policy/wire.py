"""The bytes between ovita and its sandbox: fixed headers, raw float64 and JSON; nothing is ever unpickled."""

from __future__ import annotations

import json
import os
import struct
from typing import Any, NamedTuple

import numpy as np

from ovita.paths.trajectory import Array

MAX_ROWS = 1_000_000
"""Most waypoints that a policy may return."""

MAX_RESULT = 72 << 20
"""Most bytes that the sandbox takes from a policy."""

MAX_JSON = 1 << 20
"""Most bytes of text that come with a result."""

MAX_PRINTS = 16 * 1024
"""Most characters of printed text that are kept."""

MAX_MESSAGE = 2000
"""Most characters of an error message that are kept."""

MAX_EXPECTATIONS = 100
"""Most postconditions, and most contacts, that are kept."""

NOT_PLAIN = "an expectation holds something that is not plain numbers and text"
"""Why a result is refused whose postconditions are no JSON."""

READY = b"H"
"""What a worker writes first, once it has loaded everything."""

ACKNOWLEDGED = b"R"
"""What a child writes first, once it has read the request."""

_HEADER = struct.Struct("<4sIIIIQ")
_END = struct.Struct("<4sIiQ")
_PAYLOAD = struct.Struct("<4sIIQ")
_MAGIC = b"OVTA"

HEADER_SIZE, END_SIZE = _HEADER.size, _END.size


class BadFrame(Exception):
    """The bytes violate the protocol."""


class JobHeader(NamedTuple):
    """Header of a job for a worker; the body follows and only the child reads it.

    Args:
        wall_ms: Time for the policy [ms].
        memory_mb: Memory for the policy [MiB].
        scipy: Parts of scipy to have ready, as `allowed.scipy_parts` counts them.
        flags: Sum of CHECKED and LOCKED.
        length: Of the body [bytes].
    """

    wall_ms: int
    memory_mb: int
    scipy: int
    flags: int
    length: int

    def pack(self) -> bytes:
        """As bytes."""
        return _HEADER.pack(_MAGIC, *self)

    @classmethod
    def unpack(cls, data: bytes | bytearray) -> JobHeader:
        """From bytes.

        Raises:
            BadFrame: If they are none.
        """
        magic, *values = _HEADER.unpack(data)
        if magic != _MAGIC:
            raise BadFrame("header of a job")
        return cls(*values)


CHECKED, LOCKED = 1, 2
"""Flags of a request: run the allowlist check and reduce modules and builtins; lock the kernel's doors."""


class JobEnd(NamedTuple):
    """How a child ended; what it wrote follows.

    Args:
        ended: ENDED, TIMED_OUT, FLOODED or UNREAD.
        code: Its exit code, or minus the signal that killed it.
        length: Of what it wrote [bytes].
        data: What it wrote, which nobody vouches for; it does not travel in the header.
    """

    ended: int
    code: int
    length: int
    data: bytes = b""

    def pack(self) -> bytes:
        """As bytes."""
        return _END.pack(_MAGIC, *self[:-1])

    @classmethod
    def unpack(cls, data: bytes) -> JobEnd:
        """From bytes.

        Raises:
            BadFrame: If they are none.
        """
        magic, *values = _END.unpack(data)
        end = cls(*values)
        if magic != _MAGIC or end.length > MAX_RESULT:
            raise BadFrame("end of a job")
        return end


ENDED, TIMED_OUT, FLOODED, UNREAD = range(4)
"""Ends of a child: by itself or by a signal; by the clock; for writing too much; before it read its request."""


def pack_payload(header: dict[str, Any], rows: Array | None = None) -> bytes:
    """A JSON object and an array (N, D) as bytes."""
    text = json.dumps(header, allow_nan=False).encode()
    table = np.zeros((0, 0)) if rows is None else np.ascontiguousarray(rows, dtype="<f8")
    return _PAYLOAD.pack(_MAGIC, *table.shape, len(text)) + text + table.tobytes()


def payload_length(data: bytes | memoryview) -> int:
    """Length that a payload has by its own account [bytes], or -1 if its beginning does not say."""
    if len(data) < _PAYLOAD.size:
        return -1
    magic, count, width, length = _PAYLOAD.unpack(data[: _PAYLOAD.size])
    return _PAYLOAD.size + length + 8 * count * width if magic == _MAGIC else -1


def unpack_payload(data: bytes | memoryview, *, max_json: int | None = None) -> tuple[dict[str, Any], Array]:
    """A JSON object and an array (N, D) from bytes that nobody vouches for.

    Raises:
        BadFrame: If the lengths do not add up or the text is not a JSON object.
    """
    if len(data) != payload_length(data):
        raise BadFrame("payload lengths")
    _, count, width, length = _PAYLOAD.unpack(data[: _PAYLOAD.size])
    if max_json is not None and length > max_json:
        raise BadFrame("payload text")
    start = _PAYLOAD.size + length
    try:
        header = json.loads(bytes(data[_PAYLOAD.size : start]), parse_constant=_no_constant)
    except (ValueError, RecursionError):
        raise BadFrame("payload text") from None
    if not isinstance(header, dict):
        raise BadFrame("payload text")
    return header, np.frombuffer(data[start:], dtype="<f8").reshape(count, width).astype(float)


def read_exact(descriptor: int, length: int) -> bytearray:
    """Read so many bytes; the process ends if they do not come, since nobody is left to answer."""
    data = bytearray(length)
    done = 0
    while done < length:
        part = os.read(descriptor, min(1 << 20, length - done))
        if not part:
            os._exit(0)
        data[done : done + len(part)] = part
        done += len(part)
    return data


def write_all(descriptor: int, data: bytes | memoryview) -> None:
    """Write all bytes."""
    view = memoryview(data)
    while view:
        view = view[os.write(descriptor, view) :]


def _no_constant(name: str) -> float:
    raise ValueError(name)
