"""Samples as Parquet: the full record of each, one file a shard and split, so that no split sees another's rows.

Trajectories are lists of rows [x, y, z, speed(, qw, qx, qy, qz)] in double precision; what is a document (scene,
frames, parameters, check, measured) is text in JSON, since its keys differ from sample to sample.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from ovita.augment.shards import SPLITS, AugmentedSample, ShardFile, Sink, written
from ovita.errors import FormatError, needs
from ovita.io.files import file_name
from ovita.paths.trajectory import Array, Trajectory

FOLDER = "parquet"
"""Where the records are, below the folder of the dataset."""

_INTEGERS = ("index", "seed")
_TEXTS = ("source", "split", "family", "instruction", "robot", "code", "verdict", "version")
_DOCUMENTS = ("scene", "frames", "parameters", "check", "measured")
_TRAJECTORIES = ("trajectory", "adapted")


def arrow() -> tuple[Any, Any]:
    """The modules pyarrow and pyarrow.parquet.

    Raises:
        MissingExtra: If they are not installed.
    """
    with needs("pyarrow", "lerobot"):
        import pyarrow
        from pyarrow import parquet
    return pyarrow, parquet


@dataclass(frozen=True)
class ParquetRecords(Sink):
    """Writes the full record of every sample as Parquet: parquet/SPLIT/SHARD.parquet."""

    name = "parquet"

    def write(self, folder: Path, shard: int, samples: Sequence[AugmentedSample]) -> Sequence[ShardFile]:
        """Write the shard's samples, split by split."""
        return [
            written(folder, f"{FOLDER}/{split}/{shard:06d}.parquet", content_of(mine))
            for split in SPLITS
            if (mine := [sample for sample in samples if sample.split == split])
        ]


def content_of(samples: Sequence[AugmentedSample]) -> bytes:
    """The content of a Parquet file with the records of some samples."""
    _, parquet = arrow()
    stream = io.BytesIO()
    parquet.write_table(_table(samples), stream, compression="zstd")
    return stream.getvalue()


def read_records(folder: Path, shard: str = "*") -> Iterator[AugmentedSample]:
    """The samples that `ParquetRecords` wrote below a folder, in the order of their index.

    Raises:
        FormatError: If a file cannot be read.
        MissingExtra: If pyarrow is not installed.
    """
    return in_order(folder.glob(f"{FOLDER}/*/{shard}.parquet"), lambda file: map(sample_of, rows_of([file])))


def in_order(files: Iterable[Path], read: Callable[[Path], Iterable[AugmentedSample]]) -> Iterator[AugmentedSample]:
    """The samples of files SPLIT/SHARD in the order of their index, one shard at a time."""
    shards: dict[str, list[Path]] = {}
    for file in sorted(files):
        shards.setdefault(file.name, []).append(file)
    for _, mine in sorted(shards.items()):
        yield from sorted(chain.from_iterable(map(read, mine)), key=lambda sample: sample.index)


def rows_of(files: Iterable[Path]) -> Iterator[dict[str, Any]]:
    """The records of some files, one after the other: trajectories are built, documents are still text.

    Raises:
        FormatError: If a file cannot be read.
    """
    pyarrow, parquet = arrow()
    for file in files:
        try:
            table = parquet.read_table(file, partitioning=None)
            names = [name for name in table.column_names if name not in _TRAJECTORIES]
            plain = {name: table[name].to_pylist() for name in names}
            paths = {name: _trajectories(table[name], plain["timestep"]) for name in _TRAJECTORIES}
        except (pyarrow.ArrowException, OSError, ValueError, KeyError) as error:
            raise FormatError(file_name(file), f"holds no records of samples: {str(error).splitlines()[0]}") from None
        columns = plain | paths
        for i in range(table.num_rows):
            yield {name: column[i] for name, column in columns.items()}


def sample_of(row: Mapping[str, Any]) -> AugmentedSample:
    """The sample of one of `rows_of`."""
    return AugmentedSample.from_dict({**row, **{name: json.loads(row[name]) for name in _DOCUMENTS}})


def _table(samples: Sequence[AugmentedSample]) -> Any:
    pyarrow, _ = arrow()
    written = partial(json.dumps, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    facts = [sample.words_and_facts() for sample in samples]
    known = [one | {name: written(one[name]) for name in _DOCUMENTS} for one in facts]
    text = pyarrow.string()
    types = dict.fromkeys(_INTEGERS, pyarrow.int64()) | dict.fromkeys((*_TEXTS, *_DOCUMENTS), text)
    types |= {"paraphrases": pyarrow.list_(text), "timestep": pyarrow.float64()}
    columns = {name: pyarrow.array([one[name] for one in known], kind) for name, kind in types.items()}
    columns["trajectory"] = _rows_column([s.task.trajectory for s in samples])
    columns["adapted"] = _rows_column([s.adapted for s in samples])
    return pyarrow.table(columns)


def _rows_column(trajectories: Sequence[Trajectory]) -> Any:
    """Trajectories as lists of rows, without a Python object for each number."""
    pyarrow, _ = arrow()
    rows = [trajectory.to_numpy() for trajectory in trajectories]
    widths = np.concatenate([np.full(len(one), one.shape[1]) for one in rows])
    inner = np.concatenate([[0], np.cumsum(widths)]).astype(np.int32)
    outer = np.concatenate([[0], np.cumsum([len(one) for one in rows])]).astype(np.int32)
    numbers = pyarrow.array(np.concatenate([one.ravel() for one in rows]))
    return pyarrow.ListArray.from_arrays(outer, pyarrow.ListArray.from_arrays(inner, numbers))


def _trajectories(column: Any, timesteps: Sequence[float]) -> list[Trajectory]:
    """The trajectories of a column of rows."""
    lists = column.combine_chunks()
    inner = lists.values
    numbers: Array = inner.values.to_numpy(zero_copy_only=False)
    starts, cuts = inner.offsets.to_numpy(), lists.offsets.to_numpy()
    found = []
    for i, timestep in enumerate(timesteps):
        first, last = int(cuts[i]), int(cuts[i + 1])
        rows = numbers[starts[first] : starts[last]].reshape(last - first, -1)
        found.append(Trajectory.from_array(rows, timestep=timestep))
    return found
