"""Finished samples, the sinks that write them in shards, and the record that says a shard is done.

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
from typing import Any

from pydantic import TypeAdapter, ValidationError

from ovita.errors import FormatError
from ovita.io import Task, atomic_write, scene_dict, trajectory_rows
from ovita.io.documents import plain, scene_from_dict
from ovita.io.files import make_folder, read_text
from ovita.io.waypoints import trajectory_from_rows
from ovita.measure.predicates import Check
from ovita.paths.trajectory import Trajectory

SPLITS = ("train", "val", "test")
"""Where a sample belongs; all samples of a scene are in the same."""

RECORDS = "shards"
"""The folder of the records, below that of the dataset."""


@dataclass(frozen=True)
class AugmentedSample:
    """A sentence, what it means, and a motion that does it: kept only since its own check passed after the limits.

    Args:
        index: Its number; with the seed it determines everything else.
        source: Where trajectory and scene come from, such as "random:drone/00012" or "file:scene.json"; samples of
            one source share their split.
        task: The original trajectory with its scene, robot and instruction.
        instruction: The sentence; that of the task.
        paraphrases: Other sentences of the same meaning.
        frames: What the sentence means, as JSON documents (`instruct.frames.from_json` reads them).
        adapted: The trajectory after the limits.
        verdict: "done", or "limited" where the limits changed the proposal.
        check: What had to hold, as a JSON document (`Check.from_dict` reads it).
        measured: What the check measured, and of what kind and size the change is: "sentence", "directions", "region",
            "magnitude" [m, or a factor on the speed] and "shift" [m], the largest displacement.
        split: Of SPLITS.
    """

    index: int
    seed: int
    source: str
    task: Task
    instruction: str
    paraphrases: tuple[str, ...]
    frames: tuple[Mapping[str, Any], ...]
    adapted: Trajectory
    code: str
    parameters: tuple[Mapping[str, Any], ...]
    verdict: str
    check: Mapping[str, Any]
    measured: Mapping[str, Any]
    family: str
    split: str
    version: str

    def holds(self) -> bool:
        """Whether the sample's check passes on its motion, judged anew."""
        check = Check.from_dict(self.check)
        return check.judge(self.task.trajectory, self.adapted, self.task.scene).passed

    def words_and_facts(self) -> dict[str, Any]:
        """The sample as a JSON document, but for its two motions."""
        task = self.task
        facts = {"robot": task.robot, "scene": scene_dict(task.scene), "timestep": task.trajectory.timestep}
        return {name: facts[name] if name in facts else plain(getattr(self, name)) for name in _FACTS}

    def to_dict(self) -> dict[str, Any]:
        """The sample as a JSON document, which `from_dict` reads."""
        rows = {"trajectory": trajectory_rows(self.task.trajectory), "adapted": trajectory_rows(self.adapted)}
        return self.words_and_facts() | rows

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> AugmentedSample:
        """The sample that `to_dict` wrote; its motions may be trajectories already.

        Raises:
            FormatError: If its trajectories or its scene cannot be read.
        """
        scene = scene_from_dict(document["scene"])
        said = document["instruction"]
        task = Task(_trajectory(document, "trajectory"), scene, said, robot=document["robot"])
        values: dict[str, Any] = {key: document[key] for key in _FACTS if key not in ("robot", "scene", "timestep")}
        values |= {key: tuple(document[key]) for key in ("paraphrases", "frames", "parameters")}
        return cls(task=task, adapted=_trajectory(document, "adapted"), **values)


_FACTS = (
    *("index", "seed", "source", "split", "family", "instruction", "paraphrases", "frames", "robot", "scene"),
    *("timestep", "code", "parameters", "verdict", "check", "measured", "version"),
)
"""The keys of a sample's document, but for its motions."""


def _trajectory(document: Mapping[str, Any], key: str) -> Trajectory:
    rows = document[key]
    if isinstance(rows, Trajectory):
        return rows
    return trajectory_from_rows(rows, key=key, timestep=document["timestep"])


@dataclass(frozen=True)
class ShardFile:
    """A file of a shard: its path below the dataset's folder, its content's SHA-256, and its size [bytes]."""

    path: str
    sha256: str
    bytes: int


class Sink:
    """Writes finished samples; it is pickled to the workers, so it is small, frozen data."""

    name = ""
    """As in `--format`."""

    def write(self, folder: Path, shard: int, samples: Sequence[AugmentedSample]) -> Sequence[ShardFile]:
        """Write a shard's samples, in the order of their index, below the folder.

        It is called once a shard, in any order and in any process, perhaps again after a kill: the same bytes each
        time, each file in one step.
        """
        return []

    def finish(self, folder: Path, manifest: Mapping[str, Any]) -> Sequence[ShardFile]:
        """Write what is about all shards, once all are there, in the driver; the manifest has everything."""
        return []


@dataclass(frozen=True)
class ShardRecord:
    """What is known of a finished shard.

    Args:
        first, end: Indices of its first sample, and one past its last: its range of seeds.
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
            record = TypeAdapter(cls).validate_json(read_text(file))
        except ValidationError:
            problem = "this is no record of a shard; delete it, and the shard is made again"
            raise FormatError(str(file), problem) from None
        return record if all(is_there(folder, one) for one in record.files) else None


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
class JsonLines(Sink):
    """Samples as lines of JSON, one file a shard, packed with gzip."""

    name = "jsonl"

    def write(self, folder: Path, shard: int, samples: Sequence[AugmentedSample]) -> Sequence[ShardFile]:
        """Write samples/NNNNNN.jsonl.gz."""
        lines = [json.dumps(s.to_dict(), ensure_ascii=True, allow_nan=False, separators=(",", ":")) for s in samples]
        content = gzip.compress("".join(f"{line}\n" for line in lines).encode("ascii"), compresslevel=1, mtime=0)
        return [written(folder, f"samples/{shard:06d}.jsonl.gz", content)]


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
