"""Samples as files that other tools open: scene files, one a sample, and ROS bags, one a shard and split."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ovita.augment.records import in_order
from ovita.augment.sample import SPLITS, AugmentedSample
from ovita.augment.shards import ShardFile, written
from ovita.errors import FormatError
from ovita.io import Choices, rendered
from ovita.io.bags import LoggedMessage, bag_maker, bag_of, message_of, opened, text_message
from ovita.io.files import file_name, read_text
from ovita.io.messages import TYPES, Maker
from ovita.paths.trajectory import Trajectory

AUGMENTED = "augmented"
"""The key of a scene file under which the whole sample is."""

ORIGINAL, ADAPTED, INSTRUCTION, SAMPLE = "/original", "/adapted", "/instruction", "/sample"
"""Topics of a bag: the two motions, the words, and the whole sample as JSON; message N of each is of one sample."""

_SECOND = 10**9


@dataclass(frozen=True)
class SceneFiles:
    """Writes each sample as a scene file with the original motion: scenes/SPLIT/SHARD/INDEX.json.

    `ovita adapt` opens it, and `ovita bench run` judges writers by its check; the adapted motion and the rest of the
    sample are under `AUGMENTED`.
    """

    name: str = "scenes"

    def write(self, folder: Path, shard: int, samples: Sequence[AugmentedSample]) -> Sequence[ShardFile]:
        """Write a file for each sample."""
        return [
            written(folder, f"scenes/{sample.split}/{shard:06d}/{sample.index:08d}.json", _scene_file(sample))
            for sample in samples
        ]

    def finish(self, folder: Path, manifest: Mapping[str, Any]) -> Sequence[ShardFile]:
        """Nothing is left to do."""
        return []


@dataclass(frozen=True)
class RosBags:
    """Writes the samples of a shard as messages of a bag: mcap/SPLIT/SHARD.mcap, sample by sample, a second apart."""

    name: str = "mcap"

    def write(self, folder: Path, shard: int, samples: Sequence[AugmentedSample]) -> Sequence[ShardFile]:
        """Write a bag for each split."""
        done, maker = [], bag_maker()
        for split in SPLITS:
            path = f"mcap/{split}/{shard:06d}.mcap"
            messages = [one for sample in samples if sample.split == split for one in _messages(sample, maker)]
            if messages:
                done.append(written(folder, path, bag_of(path, messages)))
        return done

    def finish(self, folder: Path, manifest: Mapping[str, Any]) -> Sequence[ShardFile]:
        """Nothing is left to do."""
        return []


def read_scene_files(folder: Path, shard: str = "*") -> Iterator[AugmentedSample]:
    """The samples that `SceneFiles` wrote below a folder, in the order of their index.

    Raises:
        FormatError: If a file cannot be read.
    """
    for file in sorted(folder.glob(f"scenes/*/{shard}/*.json"), key=lambda path: path.name):
        with _damage(file):
            document = json.loads(read_text(file))
            yield AugmentedSample.from_dict({"robot": None, **document, **document[AUGMENTED]})


def read_bags(folder: Path, shard: str = "*") -> Iterator[AugmentedSample]:
    """The samples that `RosBags` wrote below a folder, in the order of their index.

    Raises:
        FormatError: If a bag cannot be read.
        MissingExtra: If rosbags is not installed.
    """
    return in_order(folder.glob(f"mcap/*/{shard}.mcap"), _samples_of_bag)


def _samples_of_bag(file: Path) -> Iterator[AugmentedSample]:
    with opened(file) as bag, _damage(file):
        connections = [c for c in bag.connections if c.topic == SAMPLE]
        for connection, _, data in bag.messages(connections=connections):
            yield AugmentedSample.from_dict(json.loads(bag.deserialize(data, connection.msgtype).data))


@contextmanager
def _damage(file: Path) -> Iterator[None]:
    """Turn what a damaged document raises into an error that names the file."""
    try:
        yield
    except (ValueError, KeyError, TypeError) as error:
        raise FormatError(file_name(file), f"holds no sample of ovita augment: {error}") from None


def _scene_file(sample: AugmentedSample) -> bytes:
    task, whole = sample.task, sample.to_dict()
    rest = {key: value for key, value in whole.items() if key not in ("trajectory", "instruction", "robot")}
    extra = {"check": whole["check"], "kind": sample.family, AUGMENTED: rest}
    extra |= {"robot": task.robot} if task.robot else {}
    content, _ = rendered("sample.json", task.trajectory, task.scene, sample.instruction, extra)
    return content.encode() if isinstance(content, str) else content


def _messages(sample: AugmentedSample, maker: Maker) -> list[LoggedMessage]:
    at = sample.index * _SECOND

    def motion(topic: str, trajectory: Trajectory) -> LoggedMessage:
        chosen = Choices(topic=topic, kind="multidof")
        name, kind, message, _ = message_of(trajectory, sample.task.scene, chosen, maker)
        return LoggedMessage(name, TYPES[kind], message, at)

    whole = json.dumps(sample.to_dict(), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return [
        motion(ORIGINAL, sample.task.trajectory),
        motion(ADAPTED, sample.adapted),
        text_message(maker, INSTRUCTION, sample.instruction, at),
        text_message(maker, SAMPLE, whole, at),
    ]
