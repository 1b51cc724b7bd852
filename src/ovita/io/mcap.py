"""MCAP files whose recording was cut off: what is whole in them (https://mcap.dev/spec)."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path

MAGIC = b"\x89MCAP0\r\n"
_END = b"\x0f" + (4).to_bytes(8, "little") + bytes(4) + b"\x02" + (20).to_bytes(8, "little") + bytes(20) + MAGIC
_CHUNK, _DATA_END, _FOOTER = 0x06, 0x0F, 0x02


@contextmanager
def rescued(path: str | os.PathLike[str]) -> Iterator[tuple[Path, tuple[str, ...]]]:
    """The file itself; or where it is an MCAP that was cut off, a copy of its whole records, and a note on that."""
    whole = Path(path)
    inside = sorted(whole.glob("*.mcap")) if whole.is_dir() else [whole]
    file = inside[-1] if inside else whole
    if file.suffix.lower() != ".mcap" or not file.is_file() or _ended(file):
        yield whole, ()
        return
    data = file.read_bytes()
    end = _whole(data, len(MAGIC))
    inner = _of_chunk(data[end:])
    if end <= len(MAGIC) and not inner:
        yield whole, ()
        return
    note = f"the recording was cut off; what is whole in its {len(data)} bytes was read, and the rest is lost"
    with tempfile.TemporaryDirectory(prefix="ovita-") as folder:
        copy = Path(folder, "whole.mcap")
        copy.write_bytes(data[:end] + inner + _END)
        yield copy, (note,)


def _ended(file: Path) -> bool:
    size = file.stat().st_size
    with open(file, "rb") as stream:
        begins = stream.read(len(MAGIC)) == MAGIC
        stream.seek(max(size - len(MAGIC), 0))
        return not begins or (size > len(MAGIC) and stream.read() == MAGIC)


def _whole(data: bytes, at: int) -> int:
    """Where the last whole record ends, of those before the summary."""
    while at + 9 <= len(data) and data[at] not in (_DATA_END, _FOOTER):
        after = at + 9 + int.from_bytes(data[at + 1 : at + 9], "little")
        if after > len(data):
            break
        at = after
    return at


def _of_chunk(data: bytes) -> bytes:
    """The whole records in the beginning of a chunk, b"" if there are none."""
    if len(data) < 49 or data[0] != _CHUNK:
        return b""
    named = 41 + int.from_bytes(data[37:41], "little")
    records = data[named + 8 :]
    if data[41:named] == b"zstd":
        zstandard = import_module("zstandard")
        try:
            records = zstandard.ZstdDecompressor().decompressobj().decompress(records)
        except zstandard.ZstdError:
            return b""
    elif named > 41:
        return b""
    return records[: _whole(records, 0)]
