"""The formats that augmented data are written in, by name, and reading them back whichever it was.

Two of them are for other tools: scene files, one a sample, and ROS bags, one a shard and split.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from ovita.augment.card import DatasetCard
from ovita.augment.lerobot import LeRobotEpisodes
from ovita.augment.records import ParquetRecords, arrow, in_order, read_records
from ovita.augment.shards import SPLITS, AugmentedSample, JsonLines, ShardFile, Sink, read_samples, written
from ovita.errors import FormatError, RequestError
from ovita.io import Choices, rendered
from ovita.io.bags import bag_maker, bag_of, message_of, opened, text_message
from ovita.io.files import file_name, read_text
from ovita.io.messages import TYPES, Maker, TopicMessage
from ovita.paths.trajectory import Trajectory
from ovita.text import listed

AUGMENTED = "augmented"
"""The key of a scene file under which the whole sample is."""

ORIGINAL, ADAPTED, INSTRUCTION, SAMPLE = "/original", "/adapted", "/instruction", "/sample"
"""Topics of a bag: the two motions, the words, and the whole sample as JSON; message N of each is of one sample."""

_SECOND = 10**9


@dataclass(frozen=True)
class SceneFiles(Sink):
    """Writes each sample as a scene file with the original motion: scenes/SPLIT/SHARD/INDEX.json.

    `ovita adapt` opens it, and `ovita bench run` judges writers by its check; the adapted motion and the rest of the
    sample are under `AUGMENTED`.
    """

    name = "scenes"

    def write(self, folder: Path, shard: int, samples: Sequence[AugmentedSample]) -> Sequence[ShardFile]:
        """Write a file for each sample."""
        return [
            written(folder, f"scenes/{sample.split}/{shard:06d}/{sample.index:08d}.json", _scene_file(sample))
            for sample in samples
        ]


@dataclass(frozen=True)
class RosBags(Sink):
    """Writes the samples of a shard as messages of a bag: mcap/SPLIT/SHARD.mcap, sample by sample, a second apart."""

    name = "mcap"

    def write(self, folder: Path, shard: int, samples: Sequence[AugmentedSample]) -> Sequence[ShardFile]:
        """Write a bag for each split."""
        maker, paths = bag_maker(), {split: f"mcap/{split}/{shard:06d}.mcap" for split in SPLITS}
        mine = {split: [sample for sample in samples if sample.split == split] for split in SPLITS}
        return [
            written(folder, path, bag_of(path, [one for sample in mine[split] for one in _messages(sample, maker)]))
            for split, path in paths.items()
            if mine[split]
        ]


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


def _messages(sample: AugmentedSample, maker: Maker) -> list[TopicMessage]:
    at = sample.index * _SECOND

    def motion(topic: str, trajectory: Trajectory) -> TopicMessage:
        chosen = Choices(topic=topic, kind="multidof")
        name, kind, message, _ = message_of(trajectory, sample.task.scene, chosen, maker)
        return TopicMessage(name, TYPES[kind], message, at)

    whole = json.dumps(sample.to_dict(), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return [
        motion(ORIGINAL, sample.task.trajectory),
        motion(ADAPTED, sample.adapted),
        text_message(maker, INSTRUCTION, sample.instruction, at),
        text_message(maker, SAMPLE, whole, at),
    ]


FORMATS: Mapping[str, Sink] = {
    sink.name: sink
    for sink in (
        JsonLines(),
        ParquetRecords(),
        LeRobotEpisodes(),
        LeRobotEpisodes(language=True),
        SceneFiles(),
        RosBags(),
    )
}
"""Sinks by what `--format` calls them."""

_NEEDED: Mapping[str, Callable[[], object]] = {
    "parquet": arrow,
    "lerobot": arrow,
    "lerobot-language": arrow,
    "mcap": bag_maker,
}
"""What loads the packages that a format needs."""

_READERS: Mapping[str, Callable[[Path, str], Iterator[AugmentedSample]]] = {
    "samples": read_samples,
    "parquet": read_records,
    "scenes": read_scene_files,
    "mcap": read_bags,
}


def sinks_named(names: Sequence[str], licences: tuple[tuple[str, str], ...] = ()) -> tuple[Sink, ...]:
    """The sinks of some formats, each once, and of the dataset's card.

    Raises:
        RequestError: If there is no such format, or none is named.
        MissingExtra: If a format needs a package that is not installed; said now rather than after an hour of work.
    """
    if not names:
        raise RequestError(f"no format is named; the formats are {listed(FORMATS)}")
    for name in names:
        if name not in FORMATS:
            raise RequestError(f"there is no format {name!r}; the formats are {listed(FORMATS)}")
        if name in _NEEDED:
            _NEEDED[name]()
    if {"lerobot", "lerobot-language"} <= set(names):
        raise RequestError("lerobot and lerobot-language are the same data set in two ways; choose one of them")
    return (*(FORMATS[name] for name in dict.fromkeys(names)), DatasetCard(licences))


def read(folder: str | os.PathLike[str], shard: int | None = None) -> Iterator[AugmentedSample]:
    """The samples of a folder in any format, or those of one shard, with everything that is known of them.

    Raises:
        FormatError: If the folder holds none, or a file cannot be read.
        MissingExtra: If the format needs a package that is not installed.
    """
    for name, reader in _READERS.items():
        if Path(folder, name).is_dir():
            return reader(Path(folder), "*" if shard is None else f"{shard:06d}")
    raise FormatError(file_name(folder), f"holds no augmented data; there is no folder {listed(_READERS, 'or')} in it")
