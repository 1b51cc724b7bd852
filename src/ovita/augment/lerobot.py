"""Samples as LeRobotDataset v3.0, written with pyarrow alone: one data set for each split, each an own folder.

An episode is the adapted motion, sampled in time at a fixed rate by the trajectory's own time law:

observation.state               where it is: x, y, z [m], speed [m/s]; a quaternion wxyz if a sample has orientations
observation.environment_state   where the original motion is after the same share of its duration
action                          the state of the next frame; at the goal, the goal
task                            the instruction

Layout: lerobot 0.4 to 0.6 (`src/lerobot/datasets`). The workers write Parquet records; when all are there, `finish`
reads them in order, so the bytes do not depend on who wrote which shard, and memory holds one batch of frames and the
distinct instructions.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ovita.augment.records import FOLDER as RECORDS
from ovita.augment.records import ParquetRecords, arrow, rows_of
from ovita.augment.shards import SPLITS, AugmentedSample, ShardFile, Sink
from ovita.io import atomic_write
from ovita.io.files import make_folder
from ovita.io.lerobot import OVITA
from ovita.paths.trajectory import Array, Trajectory

FOLDER = "lerobot"
"""Where the data sets are, below the folder of the dataset."""

VERSION = "v3.0"
FPS = 10
"""Frames a second of an episode."""

FILE_MB, CHUNK = 100, 1000
"""Largest file [MiB, before packing], and most files in a folder: those of lerobot."""

BATCH = 20_000
"""Frames that are held in memory and written as one row group."""

QUANTILES = (0.01, 0.10, 0.50, 0.90, 0.99)
_BINS = 10_000
_NAMES = ("x", "y", "z", "qw", "qx", "qy", "qz", "speed")
_VECTORS = ("observation.state", "observation.environment_state", "action")
_SCALARS = ("timestamp", "frame_index", "episode_index", "index", "task_index")
_KEPT = ("index", "source", "family", "instruction", "paraphrases", "robot", "verdict", "scene", "frames", "check")


@dataclass(frozen=True)
class LeRobotEpisodes(Sink):
    """Writes lerobot/SPLIT, a LeRobotDataset v3.0 of each split, beside the Parquet records that it is made from.

    Args:
        fps: Frames a second.
        language: Whether every frame carries the columns language_persistent (paraphrases as `task_aug`, the meaning as
            `motion`) and language_events; lerobot reads them from version 0.6 on, and fails over them before.
    """

    fps: int = FPS
    language: bool = False

    @property
    def name(self) -> str:  # type: ignore[override]
        """As in `--format`."""
        return "lerobot-language" if self.language else "lerobot"

    def write(self, folder: Path, shard: int, samples: Sequence[AugmentedSample]) -> Sequence[ShardFile]:
        """Write the shard's records, from which `finish` makes the episodes."""
        return ParquetRecords().write(folder, shard, samples)

    def finish(self, folder: Path, manifest: Mapping[str, Any]) -> Sequence[ShardFile]:
        """Make the data set of each split from the records of all shards."""
        done: list[ShardFile] = []
        for split in SPLITS:
            files = sorted(folder.glob(f"{RECORDS}/{split}/*.parquet"))
            target = folder / FOLDER / split
            if files:
                write_dataset(target, files, split, fps=self.fps, language=self.language)
                done += [_described(folder, file) for file in sorted(target.rglob("*")) if file.is_file()]
        return done


def write_dataset(target: Path, records: Sequence[Path], split: str, *, fps: int = FPS, language: bool = False) -> None:
    """Write the samples of record files as one LeRobotDataset; what was there before is replaced once it is whole."""
    part = make_folder(target.parent) / f".{target.name}.part"
    shutil.rmtree(part, ignore_errors=True)
    make_folder(part / "meta")
    writer = _Episodes(part, fps, _oriented(records), language)
    for row in rows_of(records):
        writer.add(row)
    writer.close(split)
    shutil.rmtree(target, ignore_errors=True)
    os.replace(part, target)


def frames_of(trajectory: Trajectory, moments: Array, turned: bool) -> Array:
    """States (M, 4): x, y, z, speed, or (M, 8) with a quaternion wxyz before the speed, at moments (M,) [s]."""
    state = trajectory.at(moments)
    columns = [state.positions]
    if turned:
        still = np.tile([1.0, 0.0, 0.0, 0.0], (len(moments), 1))
        columns.append(still if state.orientations is None else state.orientations)
    return np.column_stack([*columns, state.speeds])


class _Files:
    """Parquet files of one kind, each begun when the one before it is full."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.number, self.size = folder, 0, 0
        self.writer: Any = None
        self.paths: list[Path] = []

    def place(self, table: Any) -> tuple[int, int]:
        """Chunk and file to which a table goes that is written next."""
        if self.size and self.size + table.nbytes > FILE_MB * 2**20:
            self.close()
            self.number, self.size = self.number + 1, 0
        return divmod(self.number, CHUNK)

    def write(self, table: Any) -> None:
        """Write a table as one row group."""
        chunk, number = self.place(table)
        if self.writer is None:
            path = make_folder(self.folder / f"chunk-{chunk:03d}") / f"file-{number:03d}.parquet"
            self.paths.append(path)
            self.writer = arrow()[1].ParquetWriter(path, table.schema, compression="snappy")
        self.writer.write_table(table, row_group_size=max(table.num_rows, 1))
        self.size += table.nbytes

    def close(self) -> None:
        """Finish the file that is open."""
        if self.writer is not None:
            self.writer.close()
            self.writer = None


class _Episodes:
    """Episodes on their way into a data set."""

    def __init__(self, root: Path, fps: int, turned: bool, language: bool) -> None:
        self.root, self.fps, self.turned, self.language = root, fps, turned, language
        self.names = [name for name in _NAMES if turned or not name.startswith("q")]
        self.data, self.meta, self.kept = (_Files(root / where) for where in ("data", "meta/episodes", "/".join(OVITA)))
        self.tasks: dict[str, int] = {}
        self.robots: set[str] = set()
        self.episodes = self.frames = self.waiting = 0
        self.blocks: list[Array] = []
        self.rows: list[Mapping[str, Any]] = []
        self.sums = _Sums()

    def add(self, row: Mapping[str, Any]) -> None:
        """Take the next episode, one of `rows_of`."""
        block = self._frames(row)
        self.blocks.append(block)
        self.rows.append(row)
        self.robots.add(row["robot"] or "")
        self.episodes += 1
        self.frames += len(block)
        self.waiting += len(block)
        if self.waiting >= BATCH:
            self._flush()

    def close(self, split: str) -> None:
        """Write what waits, and what is about the whole."""
        self._flush()
        for files in (self.data, self.meta, self.kept):
            files.close()
        _, parquet = arrow()
        parquet.write_table(_tasks_table(self.tasks), self.root / "meta" / "tasks.parquet")
        atomic_write(self.root / "meta" / "info.json", _json(self._info(split)))
        quantiles = _quantiles(self.data.paths, self.sums, self._columns())
        atomic_write(self.root / "meta" / "stats.json", _json(self._stats(quantiles)))

    def _frames(self, row: Mapping[str, Any]) -> Array:
        """An episode as numbers (T, 3 D + 5): state, reference and action, then the scalars."""
        adapted, original = row["adapted"], row["trajectory"]
        count = max(int(np.ceil(adapted.duration * self.fps - 1e-9)), 1) + 1
        moments = np.arange(count) / self.fps
        shares = np.minimum(moments / adapted.duration, 1.0) if adapted.duration > 0 else np.ones(count)
        state = frames_of(adapted, moments, self.turned)
        reference = frames_of(original, shares * original.duration, self.turned)
        task = self.tasks.setdefault(row["instruction"], len(self.tasks))
        steps = np.arange(count)
        whose = np.tile([self.episodes, 0.0, task], (count, 1))
        whose[:, 1] = self.frames + steps
        return np.column_stack([state, reference, np.vstack([state[1:], state[-1:]]), moments, steps, whose])

    def _columns(self) -> dict[str, slice]:
        """Where each feature stands in a block."""
        width = len(self.names)
        vectors = {name: slice(i * width, (i + 1) * width) for i, name in enumerate(_VECTORS)}
        scalars = {name: slice(3 * width + i, 3 * width + i + 1) for i, name in enumerate(_SCALARS)}
        return vectors | scalars

    def _flush(self) -> None:
        if not self.blocks:
            return
        numbers = np.concatenate(self.blocks)
        self.sums.add(numbers)
        table = self._data_table(numbers)
        place = self.data.place(table)
        self.data.write(table)
        episodes = self._episode_table(place)
        chunk, number = self.meta.place(episodes)
        pyarrow, _ = arrow()
        for name, value in (("meta/episodes/chunk_index", chunk), ("meta/episodes/file_index", number)):
            episodes = episodes.append_column(name, pyarrow.array([value] * len(self.rows), pyarrow.int64()))
        self.meta.write(episodes)
        self.kept.write(self._kept_table())
        self.blocks, self.rows, self.waiting = [], [], 0

    def _data_table(self, numbers: Array) -> Any:
        pyarrow, _ = arrow()
        columns = {}
        for name, where in self._columns().items():
            values = numbers[:, where]
            if name in _VECTORS:
                flat = pyarrow.array(np.ascontiguousarray(values, dtype=np.float32).ravel())
                columns[name] = pyarrow.FixedSizeListArray.from_arrays(flat, len(self.names))
            else:
                columns[name] = pyarrow.array(values[:, 0].astype(np.float32 if name == "timestamp" else np.int64))
        if self.language:
            columns |= _language_columns(self.rows, [len(block) for block in self.blocks])
        return pyarrow.table(columns)

    def _episode_table(self, place: tuple[int, int]) -> Any:
        """What meta/episodes holds of the episodes that wait: where their frames are, and their statistics."""
        pyarrow, _ = arrow()
        lengths = [len(block) for block in self.blocks]
        ends = (self.frames - sum(lengths) + np.cumsum(lengths)).tolist()
        first = self.episodes - len(self.rows)
        integers: dict[str, Sequence[int]] = {
            "episode_index": range(first, self.episodes),
            "length": lengths,
            "dataset_from_index": [end - length for end, length in zip(ends, lengths, strict=True)],
            "dataset_to_index": ends,
            "data/chunk_index": [place[0]] * len(lengths),
            "data/file_index": [place[1]] * len(lengths),
        }
        columns = {name: pyarrow.array(values, pyarrow.int64()) for name, values in integers.items()}
        columns["tasks"] = pyarrow.array([[row["instruction"]] for row in self.rows], pyarrow.list_(pyarrow.string()))
        measured = [_statistics(block) for block in self.blocks]
        for feature, where in self._columns().items():
            for key in measured[0]:
                rows = np.stack([one[key][where] for one in measured])
                columns[f"stats/{feature}/{key}"] = _lists(rows)
            columns[f"stats/{feature}/count"] = _lists(np.array(lengths, dtype=np.int64)[:, None])
        return pyarrow.table(columns)

    def _kept_table(self) -> Any:
        """What lerobot has no column for, by episode: the sample's number, its words, its scene."""
        pyarrow, _ = arrow()
        columns = {name: pyarrow.array([row[name] for row in self.rows]) for name in _KEPT if name != "robot"}
        columns["robot"] = pyarrow.array([row["robot"] for row in self.rows], pyarrow.string())
        first = self.episodes - len(self.rows)
        return pyarrow.table({"episode_index": pyarrow.array(range(first, self.episodes), pyarrow.int64())} | columns)

    def _info(self, split: str) -> dict[str, Any]:
        vector = {"dtype": "float32", "shape": [len(self.names)], "names": self.names}
        features: dict[str, Any] = {name: vector for name in _VECTORS}
        for name in _SCALARS:
            features[name] = {"dtype": "float32" if name == "timestamp" else "int64", "shape": [1], "names": None}
        if self.language:
            spoken = {"dtype": "language", "shape": [1], "names": None}
            features |= {"language_persistent": spoken, "language_events": spoken}
        path = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
        return {
            "codebase_version": VERSION,
            "robot_type": next(iter(self.robots)) or None if len(self.robots) == 1 else None,
            "total_episodes": self.episodes,
            "total_frames": self.frames,
            "total_tasks": len(self.tasks),
            "chunks_size": CHUNK,
            "data_files_size_in_mb": FILE_MB,
            "video_files_size_in_mb": 200,
            "fps": self.fps,
            "splits": {split: f"0:{self.episodes}"},
            "data_path": f"data/{path}",
            "video_path": None,
            "features": features,
        }

    def _stats(self, quantiles: Array) -> dict[str, Any]:
        keys = ("min", "max", "mean", "std")
        values = {key: getattr(self.sums, key) for key in keys} | dict(zip(_quantile_names(), quantiles, strict=True))
        return {
            feature: {key: value[where].tolist() for key, value in values.items()} | {"count": [self.sums.count]}
            for feature, where in self._columns().items()
        }


class _Sums:
    """Least, greatest, mean and standard deviation of columns that come in batches."""

    def __init__(self) -> None:
        self.count = 0
        self.mean = self._squares = np.zeros(1)
        self.min, self.max = np.full(1, np.inf), np.full(1, -np.inf)

    def add(self, rows: Array) -> None:
        """Take more rows (N, D); the means are joined as by Chan, Golub and LeVeque (1979)."""
        n, mean = len(rows), rows.mean(axis=0)
        squares = ((rows - mean) ** 2).sum(axis=0)
        total, gap = self.count + n, mean - self.mean
        self._squares = self._squares + squares + gap**2 * (self.count * n / total)
        self.mean = self.mean + gap * (n / total)
        self.count = total
        self.min, self.max = np.minimum(self.min, rows.min(axis=0)), np.maximum(self.max, rows.max(axis=0))

    @property
    def std(self) -> Array:
        """Standard deviation of the population (D,)."""
        return np.asarray(np.sqrt(self._squares / self.count))


def _quantile_names() -> list[str]:
    return [f"q{round(q * 100):02d}" for q in QUANTILES]


def _statistics(block: Array) -> dict[str, Array]:
    """Statistics of one episode (T, D), each (D,)."""
    found = {key: getattr(block, key)(axis=0) for key in ("min", "max", "mean", "std")}
    return found | dict(zip(_quantile_names(), np.quantile(block, QUANTILES, axis=0), strict=True))


def _quantiles(files: Sequence[Path], sums: _Sums, columns: Mapping[str, slice]) -> Array:
    """Quantiles of all frames (Q, D), to a ten-thousandth of each column's range: counted in a second pass."""
    low, spread = sums.min, np.where(sums.max > sums.min, sums.max - sums.min, 1.0)
    counts = np.zeros((len(low), _BINS), dtype=np.int64)
    offsets = np.arange(len(low)) * _BINS
    for rows in _stored(files, list(columns)):
        bins = np.clip(((rows - low) / spread * _BINS).astype(np.int64), 0, _BINS - 1) + offsets
        counts += np.bincount(bins.ravel(), minlength=counts.size).reshape(counts.shape)
    shares = np.concatenate([np.zeros((len(low), 1)), np.cumsum(counts, axis=1) / max(sums.count, 1)], axis=1)
    edges = np.linspace(0.0, 1.0, _BINS + 1)
    found = np.stack([np.interp(QUANTILES, share, edges) for share in shares], axis=1)
    return np.clip(low + found * spread, sums.min, sums.max)


def _stored(files: Sequence[Path], names: Sequence[str]) -> Iterator[Array]:
    """The numbers of data files, row group by row group (N, D)."""
    _, parquet = arrow()
    for file in files:
        with parquet.ParquetFile(file) as held:
            for batch in held.iter_batches(BATCH, columns=list(names)):
                yield np.column_stack([_matrix(batch.column(name)) for name in names])


def _matrix(column: Any) -> Array:
    flat = column.flatten() if hasattr(column, "flatten") and column.type.num_fields else column
    return np.asarray(flat.to_numpy(zero_copy_only=False), dtype=float).reshape(len(column), -1)


def _lists(rows: Any) -> Any:
    """Rows (N, D) as a column of lists."""
    pyarrow, _ = arrow()
    offsets = np.arange(len(rows) + 1, dtype=np.int32) * rows.shape[1]
    return pyarrow.ListArray.from_arrays(offsets, pyarrow.array(np.ascontiguousarray(rows).ravel()))


def _tasks_table(tasks: Mapping[str, int]) -> Any:
    """The instructions in order of their numbers; the pandas metadata makes them the index, as lerobot expects."""
    pyarrow, _ = arrow()

    def described(name: str | None, kind: str, numpy_kind: str, about: Any = None) -> dict[str, Any]:
        return {"name": name, "field_name": name, "pandas_type": kind, "numpy_type": numpy_kind, "metadata": about}

    about = {
        "index_columns": ["task"],
        "column_indexes": [described(None, "unicode", "object", {"encoding": "UTF-8"})],
        "columns": [described("task_index", "int64", "int64"), described("task", "unicode", "object")],
        "creator": {"library": "pyarrow", "version": pyarrow.__version__},
        "pandas_version": "2.0.0",
    }
    numbers = pyarrow.array(list(tasks.values()), pyarrow.int64())
    table = pyarrow.table({"task_index": numbers, "task": pyarrow.array(list(tasks), pyarrow.string())})
    return table.replace_schema_metadata({"pandas": json.dumps(about)})


def _language_columns(rows: Sequence[Mapping[str, Any]], lengths: Sequence[int]) -> dict[str, Any]:
    """The columns of lerobot 0.6 for language, the same on every frame of an episode."""
    pyarrow, _ = arrow()
    texts = ("role", "content", "style")
    spoken = [_spoken(row) for row in rows]
    said = [line for lines in spoken for line in lines]
    starts = np.concatenate([[0], np.cumsum([len(lines) for lines in spoken])])
    picks = [np.tile(np.arange(a, b), n) for (a, b), n in zip(pairwise(starts.tolist()), lengths, strict=True)]
    taken = pyarrow.array(np.concatenate(picks))
    offsets = np.concatenate([[0], np.cumsum(np.repeat(np.diff(starts), lengths))]).astype(np.int32)
    columns = {
        name: pyarrow.array([line[i] for line in said], pyarrow.string()).take(taken) for i, name in enumerate(texts)
    }
    columns["timestamp"] = pyarrow.array(np.zeros(len(taken), dtype=np.float32))
    none = np.zeros(sum(lengths) + 1, dtype=np.int32)
    events = {name: pyarrow.array([], pyarrow.string()) for name in texts}
    return {
        "language_persistent": pyarrow.ListArray.from_arrays(offsets, _lines(columns)),
        "language_events": pyarrow.ListArray.from_arrays(none, _lines(events)),
    }


def _lines(columns: dict[str, Any]) -> Any:
    """Lines of language with no camera and no calls of tools; which fields may be null is lerobot's choice."""
    pyarrow, _ = arrow()
    json_type = pyarrow.json_() if hasattr(pyarrow, "json_") else pyarrow.string()
    count = len(columns["role"])
    columns = columns | {
        "camera": pyarrow.nulls(count, pyarrow.string()),
        "tool_calls": pyarrow.nulls(count, pyarrow.list_(json_type)),
    }
    fields = [
        pyarrow.field(name, value.type, nullable=name not in ("role", "timestamp")) for name, value in columns.items()
    ]
    return pyarrow.StructArray.from_arrays(list(columns.values()), fields=fields)


def _spoken(row: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """What is said of an episode, as role, content and style: its wordings, and what the motion is."""
    texts = [("user", text, "task_aug") for text in (row["instruction"], *row["paraphrases"])]
    meaning = [("assistant", json.dumps(frame, ensure_ascii=False), "motion") for frame in json.loads(row["frames"])]
    return [*texts, *meaning]


def _oriented(records: Sequence[Path]) -> bool:
    """Whether a motion in some files has orientations; its rows are then longer than 4."""
    _, parquet = arrow()
    for file in records:
        for column in parquet.read_table(file, columns=["adapted", "trajectory"], partitioning=None).columns:
            rows = column.combine_chunks().values
            if len(rows) and int(np.diff(rows.offsets.to_numpy()).max()) > 4:
                return True
    return False


def _described(folder: Path, file: Path) -> ShardFile:
    with open(file, "rb") as stream:
        digest = hashlib.file_digest(stream, "sha256").hexdigest()
    return ShardFile(file.relative_to(folder).as_posix(), digest, file.stat().st_size)


def _json(document: Mapping[str, Any]) -> str:
    return json.dumps(document, indent=4, ensure_ascii=False) + "\n"
