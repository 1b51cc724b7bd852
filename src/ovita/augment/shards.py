"""Shards: runs of finished samples, the sinks that write them, and the record that says a shard is done.

A shard is done once its record is there, and the record is written last, in one step: a worker or a driver that is
killed leaves no record, and the shard is made again, with the same bytes.
"""

from __future__ import annotations

import gzip
import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from ovita.augment.sample import AugmentedSample
from ovita.errors import FormatError
from ovita.io import atomic_write
from ovita.io.files import make_folder, read_text

RECORDS = "shards"
"""The folder of the records, below that of the dataset."""


@dataclass(frozen=True)
class ShardFile:
    """A file of a shard: its path below the dataset's folder, its content's SHA-256, and its size [bytes]."""

    path: str
    sha256: str
    bytes: int


@runtime_checkable
class Sink(Protocol):
    """Writes finished samples; it is pickled to the workers, so it is small, frozen data.

    `write` is called once a shard, in any order and in any process, perhaps again after a kill; it must write the same
    bytes each time, each file in one step. `finish` is called once in the driver when all shards are there.
    """

    @property
    def name(self) -> str:
        """As in `--format`."""
        ...

    def write(self, folder: Path, shard: int, samples: Sequence[AugmentedSample]) -> Sequence[ShardFile]:
        """Write a shard's samples, in the order of their index, below the folder."""
        ...

    def finish(self, folder: Path, manifest: Mapping[str, Any]) -> Sequence[ShardFile]:
        """Write what is about all shards, such as tables of contents and a card; the manifest has everything."""
        ...


@dataclass(frozen=True)
class ShardRecord:
    """What is known of a finished shard.

    Args:
        shard: Its number.
        first, end: Indices of its first sample, and one past its last: its range of seeds.
        kept: How many samples it holds.
        files: Its files.
        rejected: How many draws were rejected, by reason.
        counts: Distributions for the report on diversity: name, value, number of samples.
        keys: For each sample its index and the hash of its scene and rounded frames; near duplicates share it.
    """

    shard: int
    first: int
    end: int
    kept: int
    files: tuple[ShardFile, ...]
    rejected: Mapping[str, int] = field(default_factory=dict)
    counts: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    keys: tuple[tuple[int, str], ...] = ()

    def save(self, folder: Path) -> None:
        """Write the record, which makes the shard count as done."""
        make_folder(folder / RECORDS)
        document = asdict(self)
        atomic_write(record_file(folder, self.shard), json.dumps(document, sort_keys=True, separators=(",", ":")))

    @classmethod
    def load(cls, folder: Path, shard: int) -> ShardRecord | None:
        """The record of a shard, or None if it is not done: there is none, or a file of it is not as it was written."""
        file = record_file(folder, shard)
        if not file.exists():
            return None
        try:
            document = json.loads(read_text(file))
            files = tuple(ShardFile(**one) for one in document.pop("files"))
            record = cls(files=files, keys=tuple(map(tuple, document.pop("keys"))), **document)
        except (ValueError, KeyError, TypeError):
            raise FormatError(
                str(file), "this is no record of a shard; delete it, and the shard is made again"
            ) from None
        return record if all(is_there(folder, one) for one in files) else None


def record_file(folder: Path, shard: int) -> Path:
    """Where the record of a shard is."""
    return folder / RECORDS / f"{shard:06d}.json"


def is_there(folder: Path, file: ShardFile, *, whole: bool = False) -> bool:
    """Whether a file of a shard is there with its size; with `whole`, with its SHA-256 too."""
    path = folder / file.path
    if not path.is_file() or path.stat().st_size != file.bytes:
        return False
    return not whole or hashlib.sha256(path.read_bytes()).hexdigest() == file.sha256


def written(folder: Path, path: str, content: bytes) -> ShardFile:
    """Write a file below the folder in one step, and describe it."""
    make_folder((folder / path).parent)
    atomic_write(folder / path, content)
    return ShardFile(path, hashlib.sha256(content).hexdigest(), len(content))


@dataclass(frozen=True)
class JsonLines:
    """Samples as lines of JSON, one file a shard, packed with gzip."""

    name: str = "jsonl"

    def write(self, folder: Path, shard: int, samples: Sequence[AugmentedSample]) -> Sequence[ShardFile]:
        """Write samples/NNNNNN.jsonl.gz."""
        lines = [json.dumps(s.to_dict(), ensure_ascii=True, allow_nan=False, separators=(",", ":")) for s in samples]
        content = gzip.compress("".join(f"{line}\n" for line in lines).encode("ascii"), compresslevel=1, mtime=0)
        return [written(folder, f"samples/{shard:06d}.jsonl.gz", content)]

    def finish(self, folder: Path, manifest: Mapping[str, Any]) -> Sequence[ShardFile]:
        """Nothing is left to do."""
        return []


def read_samples(folder: Path, shard: str = "*") -> Iterator[AugmentedSample]:
    """The samples that `JsonLines` wrote, or those of one shard, in the order of their index.

    Raises:
        FormatError: If a file cannot be read.
    """
    for file in sorted(folder.glob(f"samples/{shard}.jsonl.gz")):
        try:
            lines = gzip.decompress(file.read_bytes()).splitlines()
            yield from (AugmentedSample.from_dict(json.loads(line)) for line in lines)
        except (OSError, EOFError, ValueError, KeyError) as error:
            raise FormatError(str(file), f"this is no shard of samples: {error}") from None
