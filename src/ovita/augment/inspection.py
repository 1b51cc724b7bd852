"""Looking into a finished dataset: its manifest, single samples, a few from all over, and everything checked anew."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ovita.augment.engine import MANIFEST
from ovita.augment.formats import read
from ovita.augment.shards import AugmentedSample, ShardFile, is_there
from ovita.chain import adapt
from ovita.errors import FormatError, RequestError
from ovita.instruct.frames import from_json
from ovita.io import load_robot
from ovita.io.files import file_name, read_text
from ovita.io.json_ import parse_object
from ovita.request import Request
from ovita.result import Adaptation
from ovita.text import counted
from ovita.writers.generate import FramesWriter

SAME = 1e-6
"""How far two motions may be apart that are called the same [m, m/s]."""


def open_manifest(folder: Path) -> Mapping[str, Any]:
    """What is in a finished dataset.

    Raises:
        FormatError: If the folder holds no dataset, or one that is not finished.
    """
    file = folder / MANIFEST
    if not file.is_file():
        begun = (folder / "job.json").is_file()
        why = "is not finished; run the same ovita augment again to go on" if begun else "holds no augmented dataset"
        raise FormatError(file_name(folder), f"{why} (there is no {MANIFEST})")
    manifest = parse_object(read_text(file), file_name(file))
    missing = [key for key in ("n", "kept", "shards", "counts", "rejected", "formats") if key not in manifest]
    if missing:
        raise FormatError(file_name(file), "is no manifest of ovita augment", key=missing[0])
    return manifest


def files_of(manifest: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Every file of a dataset, with its "path", its "sha256" and its size, "bytes"."""
    return [file for part in (*manifest["shards"], manifest) for file in part["files"]]


def sample_at(folder: Path, manifest: Mapping[str, Any], index: int) -> AugmentedSample:
    """One sample by its index.

    Raises:
        RequestError: If there is none with this index.
        FormatError: If its shard cannot be read.
    """
    shard = next((s["shard"] for s in manifest["shards"] if s["first"] <= index < s["end"]), None)
    if shard is None:
        raise RequestError(f"there is no sample {index}; they are numbered from 0 to {manifest['n'] - 1}")
    found = next((sample for sample in read(folder, shard) if sample.index == index), None)
    if found is None:
        raise RequestError(f"sample {index} was not kept: all its draws were rejected, or it was a near duplicate")
    return found


def samples_from_all_over(folder: Path, manifest: Mapping[str, Any], count: int) -> tuple[AugmentedSample, ...]:
    """At most so many samples, spread evenly over the shards and inside of each."""
    shards = [shard for shard in manifest["shards"] if shard["kept"]]
    chosen = [shards[i] for i in _evenly(len(shards), min(count, len(shards)))]
    found: list[AugmentedSample] = []
    for place, shard in enumerate(chosen):
        mine = (count - len(found)) // (len(chosen) - place)
        wanted = set(_evenly(shard["kept"], min(mine, shard["kept"])))
        found += [sample for i, sample in enumerate(read(folder, shard["shard"])) if i in wanted]
    return tuple(found)


def _evenly(total: int, count: int) -> list[int]:
    """Indices of `count` things out of `total`, the first and the last among them."""
    if count <= 1:
        return [total // 2] * min(count, total)
    return sorted({round(i * (total - 1) / (count - 1)) for i in range(count)})


def result_of(sample: AugmentedSample) -> tuple[Adaptation, bool]:
    """A sample as a whole result, made anew from its frames, and whether its motion is the recorded one."""
    task = sample.task
    request = Request(sample.instruction, task.trajectory, task.scene, load_robot(task.robot or "none"))
    result = adapt(request, writer=FramesWriter(from_json(sample.frames)), repairs=0)
    made, recorded = result.adapted.to_numpy(), sample.adapted.to_numpy()
    return result, made.shape == recorded.shape and bool(np.abs(made - recorded).max() < SAME)


@dataclass(frozen=True)
class Findings:
    """What a second look at a dataset found.

    Args:
        damaged: Those that are not as they were written, or are not there.
        failed: Indices of samples whose check does not pass.
        astray: Scenes' names with samples in more than one split.
    """

    files: int
    damaged: tuple[str, ...]
    samples: int
    failed: tuple[int, ...]
    astray: tuple[str, ...]

    @property
    def sound(self) -> bool:
        """Whether nothing is wrong."""
        return not (self.damaged or self.failed or self.astray)

    def sentences(self) -> list[str]:
        """What was found, for a person."""
        said = [f"{counted(self.files, 'file')}: {_or_all(self.damaged, 'as they were written', 'damaged or missing')}"]
        passed = _or_all(list(map(str, self.failed)), "each passes its own check", "do not pass their check")
        said.append(f"{counted(self.samples, 'sample')}: {passed}")
        return [*said, f"splits: {_or_all(self.astray, 'no scene is in two', 'scenes in several splits')}"]


def verify(folder: Path, manifest: Mapping[str, Any], progress: Callable[[str], None] = lambda text: None) -> Findings:
    """Look at every file of a dataset and judge every sample anew."""
    files = [ShardFile(**file) for file in files_of(manifest)]
    damaged = tuple(file.path for file in files if not is_there(folder, file, whole=True))
    if damaged:
        return Findings(len(files), damaged, 0, (), ())
    failed: list[int] = []
    splits: dict[str, set[str]] = {}
    judged = 0
    for sample in read(folder):
        judged += 1
        splits.setdefault(sample.source, set()).add(sample.split)
        if not sample.holds():
            failed.append(sample.index)
        if judged % 1000 == 0:
            progress(f"{judged} of {manifest['kept']} samples")
    astray = tuple(sorted(source for source, seen in splits.items() if len(seen) > 1))
    return Findings(len(files), damaged, judged, tuple(failed), astray)


def _or_all(found: Sequence[str], well: str, ill: str) -> str:
    more = f" and {len(found) - 5} more" if len(found) > 5 else ""
    return f"{len(found)} {ill}: {', '.join(found[:5])}{more}" if found else well
