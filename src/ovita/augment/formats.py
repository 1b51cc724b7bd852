"""The formats that augmented data are written in, by name, and reading them back whichever it was."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from ovita.augment.card import DatasetCard
from ovita.augment.files import RosBags, SceneFiles, read_bags, read_scene_files
from ovita.augment.lerobot import LeRobotEpisodes
from ovita.augment.records import ParquetRecords, arrow, read_records
from ovita.augment.sample import AugmentedSample
from ovita.augment.shards import JsonLines, Sink, read_samples
from ovita.errors import FormatError, RequestError
from ovita.io.bags import bag_maker
from ovita.io.files import file_name
from ovita.text import listed

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

    Args:
        names: Of the formats.
        licences: Names of sources with their licences, for the card.

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
