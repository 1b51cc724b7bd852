"""Samples: the files of a dataset, each with the check that decides whether an adaptation of it is right."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ovita.errors import FormatError, InputError, RequestError
from ovita.io import Task, load_task
from ovita.measure.predicates import Check


@dataclass(frozen=True)
class Sample:
    """One instruction about one trajectory, and how an answer is judged.

    Args:
        id: The file's path below the dataset's folder, without its ending, such as "latte_subset/latte_0".
        subset: The part of the dataset that it belongs to.
        kind: The kind of instruction, such as "distance".
        task: Trajectory, scene and instruction.
        check: What a right adaptation passes.
        void: Clauses of the instruction that nothing can fulfil and that are not judged.
    """

    id: str
    subset: str
    kind: str
    task: Task
    check: Check
    void: tuple[str, ...] = ()


@dataclass(frozen=True)
class Dataset:
    """A folder of samples.

    Args:
        name: The folder's name.
        samples: In natural order of their ids.
        skipped: Files without a check, by id.
    """

    name: str
    samples: tuple[Sample, ...]
    skipped: tuple[str, ...] = ()

    @property
    def digest(self) -> str:
        """A fingerprint of trajectories, scenes, instructions and checks."""
        parts = hashlib.sha256()
        for sample in self.samples:
            check = json.dumps(sample.check.to_dict(), sort_keys=True)
            task = sample.task
            objects = [(o.name, o.position.tolist(), o.size.tolist()) for o in task.scene]
            parts.update(repr((sample.id, task.instruction, check, objects, task.robot)).encode())
            parts.update(task.trajectory.to_array().tobytes())
        return parts.hexdigest()[:16]


def load_dataset(folder: str | os.PathLike[str], *, limit: int | None = None) -> Dataset:
    """Read every .json file below a folder that holds a trajectory with a check, or that the shipped cases know.

    Args:
        folder: The dataset's folder, or one of its files.
        limit: At most so many samples, spread evenly over all of them.

    Raises:
        FormatError: If a file cannot be read, or its check makes no sense in its scene.
        RequestError: If the folder holds no sample.
    """
    root = Path(folder)
    if not root.exists():
        raise RequestError(f"{root}: there is no such folder; 'ovita bench fetch' says where datasets come from")
    files = [root] if root.is_file() else sorted(root.rglob("*.json"), key=lambda p: natural(p.as_posix()))
    base = root.parent if root.is_file() else root
    samples: list[Sample] = []
    skipped: list[str] = []
    for file in files:
        name = file.relative_to(base).with_suffix("").as_posix()
        sample = _sample(file, name)
        if sample is None:
            skipped.append(name)
        else:
            samples.append(sample)
    if not samples:
        raise RequestError(
            f"{root}: none of its {len(files)} .json files is a sample; a sample is a scene file with an instruction"
            " and a key 'check', or a file of the public dataset that the shipped cases know"
        )
    return Dataset(root.resolve().name, spread(samples, limit), tuple(skipped))


def spread(samples: Sequence[Sample], limit: int | None) -> tuple[Sample, ...]:
    """At most `limit` samples, evenly spread over all."""
    if limit is None or limit >= len(samples):
        return tuple(samples)
    return tuple(samples[i * len(samples) // limit] for i in range(limit))


def natural(text: str) -> list[tuple[int, str]]:
    """A key that sorts latte_2 before latte_10."""
    return [(int(part), "") if part.isdigit() else (0, part) for part in re.split(r"(\d+)", text)]


def _sample(file: Path, name: str) -> Sample | None:
    document = _document(file)
    if "check" in document:
        task = load_task(file)
        try:
            check = Check.from_dict(task.extra["check"])
        except ValueError as error:
            raise FormatError(str(file), str(error), key="check") from None
        subset = task.extra.get("subset") or (name.rpartition("/")[0] or "all")
        sample = Sample(name, str(subset), str(task.extra.get("kind") or "other"), task, check)
    else:
        from ovita.bench.cases import case_for

        case = case_for(name)
        if case is None:
            return None
        sample = Sample(name, case.subset, case.kind, load_task(file), case.check, case.void)
    if not sample.task.instruction.strip():
        raise FormatError(str(file), "a sample needs an instruction", key="instruction")
    try:
        sample.check.judge(sample.task.trajectory, sample.task.trajectory, sample.task.scene)
    except (InputError, ValueError) as error:
        raise FormatError(str(file), f"the check cannot be applied: {error}", key="check") from None
    return sample


def _document(file: Path) -> dict[str, object]:
    try:
        document = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise FormatError(str(file), f"cannot be read: {error}") from None
    return document if isinstance(document, dict) else {}
