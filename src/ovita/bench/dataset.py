"""Datasets: samples and the checks that judge them, the shipped cases of the public dataset, and where to get it.

The instructions and trajectories of the public dataset belong to the repository MarkusKnauer/OVITA, which states no
licence for them: each user downloads them; ovita ships only their fingerprints (public.sha256) and its own checks
(cases.toml).
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import tomllib
import urllib.error
import urllib.request
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import quote

from ovita.errors import FormatError, InputError, OvitaError, RequestError
from ovita.io import Task, atomic_write, load_task
from ovita.io.files import make_folder
from ovita.measure.predicates import Check, all_of, finite

T = TypeVar("T")

REPOSITORY = "MarkusKnauer/OVITA"
COMMIT = "8a67e79b617a5d215a356f5204c7a8a3e6a10436"
FOLDER = "dataset"
BASE_URL = f"https://raw.githubusercontent.com/{REPOSITORY}/{COMMIT}/{FOLDER}"
"""Where the files lie: BASE_URL/latte_subset/latte_0.json, ..."""

MAX_BYTES = 4 * 1024 * 1024
"""No file of the dataset is nearly as large [bytes]."""


@dataclass(frozen=True)
class Case:
    """What an instruction is about, and the check that a right adaptation passes.

    Args:
        id: Path of its file below the dataset's folder, with / and without .json, such as "latte_subset/latte_0".
        subset: The part of the dataset; of the public one "latte", "extended", "drone", "ground" or "arm".
        kind: "distance", "speed", "cartesian", "ends", "shape", "waypoints", "stop", "bounds", or "several" clauses.
        void: Clauses that nothing can fulfil, such as on an object that is not there, and that are not judged.
    """

    id: str
    subset: str
    kind: str
    check: Check
    void: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Sample(Case):
    """One instruction about one trajectory and its scene, and how an answer is judged."""

    task: Task


@dataclass(frozen=True)
class Dataset:
    """The samples of a folder in natural order of their ids, and the ids of files without a check."""

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
    """Read every .json file below a folder that holds a trajectory with a check, or with a shipped case.

    The folder may be one of its files; `limit` samples at most are taken, spread evenly over all of them.

    Raises:
        FormatError: If a file cannot be read, or its check makes no sense in its scene.
        RequestError: If the folder holds no sample.
    """
    root = Path(folder)
    if not root.exists():
        raise RequestError(f"{root}: there is no such folder; 'ovita bench fetch' says where datasets come from")
    files = [root] if root.is_file() else sorted(root.rglob("*.json"), key=lambda p: natural(p.as_posix()))
    base = root.parent if root.is_file() else root
    names = {file.relative_to(base).with_suffix("").as_posix(): file for file in files}
    found = {name: _sample(file, name) for name, file in names.items()}
    samples = [sample for sample in found.values() if sample is not None]
    if not samples:
        raise RequestError(
            f"{root}: none of its {len(files)} .json files is a sample; a sample is a scene file with an instruction"
            " and a key 'check', or a file of the public dataset with a shipped case"
        )
    return Dataset(root.resolve().name, spread(samples, limit), tuple(name for name in found if found[name] is None))


def spread(samples: Sequence[T], limit: int | None) -> tuple[T, ...]:
    """At most `limit` of some, evenly spread over all."""
    count = len(samples) if limit is None else min(limit, len(samples))
    return tuple(samples[i * len(samples) // count] for i in range(count))


def natural(text: str) -> list[tuple[int, str]]:
    """A key that sorts latte_2 before latte_10."""
    return [(int(part), "") if part.isdigit() else (0, part) for part in re.split(r"(\d+)", text)]


@cache
def shipped_cases() -> Mapping[str, Case]:
    """The shipped cases of the public dataset by sample id, in the order of their subsets and numbers."""
    tables = tomllib.loads((files("ovita.bench") / "cases.toml").read_text(encoding="utf-8"))
    found: dict[str, Case] = {}
    for subset, table in tables.items():
        for row in table["cases"]:
            id = f"{table['prefix']}{row['id']}"
            check = all_of(*map(_check, row["checks"]), finite())
            found[id] = Case(id, subset, row["kind"], check, tuple(row.get("void", ())))
    return found


def _check(row: Mapping[str, Any]) -> Check:
    """A check written as { kind = arguments }, or { any_of = [checks] }."""
    ((kind, content),) = row.items()
    return Check(kind, {}, tuple(map(_check, content))) if isinstance(content, list) else Check(kind, content)


def _sample(file: Path, name: str) -> Sample | None:
    document = _document(file)
    case = None if "check" in document else shipped_cases().get(name)
    if case is None and "check" not in document:
        return None
    task = load_task(file)
    sample = Sample(**vars(case or _own_case(name, task, str(file))), task=task)
    if not sample.task.instruction.strip():
        raise FormatError(str(file), "a sample needs an instruction", key="instruction")
    try:
        sample.check.judge(sample.task.trajectory, sample.task.trajectory, sample.task.scene)
    except (InputError, ValueError) as error:
        raise FormatError(str(file), f"the check cannot be applied: {error}", key="check") from None
    return sample


def _own_case(name: str, task: Task, file: str) -> Case:
    """The case that a scene file states itself."""
    try:
        check = Check.from_dict(task.extra["check"])
    except ValueError as error:
        raise FormatError(file, str(error), key="check") from None
    subset = task.extra.get("subset") or (name.rpartition("/")[0] or "all")
    return Case(name, str(subset), str(task.extra.get("kind") or "other"), check)


def _document(file: Path) -> dict[str, object]:
    try:
        document = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise FormatError(str(file), f"cannot be read: {error}") from None
    return document if isinstance(document, dict) else {}


class FetchError(OvitaError):
    """A dataset could not be downloaded; the message says how to supply it by hand."""


@dataclass(frozen=True)
class Fetched:
    """What a download came to: files that are there and whole, and how many of them were new."""

    folder: Path
    whole: int
    downloaded: int


@cache
def checksums() -> Mapping[str, str]:
    """SHA-256 of each file of the dataset for which there are checks, by sample id."""
    text = (files("ovita.bench") / "public.sha256").read_text(encoding="ascii")
    pairs = (line.split() for line in text.splitlines() if line and not line.startswith("#"))
    return {name: digest for digest, name in pairs}


def fetch(folder: str | os.PathLike[str], *, base_url: str = BASE_URL, timeout: float = 30.0) -> Fetched:
    """Download missing files to a folder, and verify all.

    Files that are there and whole are kept. `timeout` is for each file [s].

    Raises:
        FetchError: If a file cannot be had, or differs from what was published.
        FormatError: If a file cannot be written.
    """
    root, wanted = Path(folder), checksums()
    missing, differing = verify(root)
    new = missing + differing
    for name in new:
        data = _download(f"{base_url.rstrip('/')}/{quote(name)}.json", timeout, root)
        if _digest(data) != wanted[name]:
            raise FetchError(
                f"{name}.json arrived, but differs from the published file (SHA-256 {_digest(data)[:12]}...,"
                f" expected {wanted[name][:12]}...); it was not saved. Is {base_url} the commit {COMMIT[:7]}?"
            )
        file = root / f"{name}.json"
        make_folder(file.parent)
        atomic_write(file, data)
    return Fetched(root, len(wanted), len(new))


def verify(folder: str | os.PathLike[str]) -> tuple[list[str], list[str]]:
    """The ids of the dataset's files that are missing in a folder, and of those that differ."""
    wanted = {name: Path(folder) / f"{name}.json" for name in checksums()}
    there = {name: _digest(file.read_bytes()) for name, file in wanted.items() if file.is_file()}
    differing = [name for name, digest in there.items() if digest != checksums()[name]]
    return [name for name in wanted if name not in there], differing


def by_hand(folder: str | os.PathLike[str]) -> str:
    """What to do on a machine without internet, as one sentence."""
    return (
        f"without internet, take the folder '{FOLDER}' of https://github.com/{REPOSITORY} (commit {COMMIT[:7]}) from a"
        f" machine that has it and put its latte_subset, extended_subset and robot_subset into {folder}; then"
        f" 'ovita bench fetch --out {folder}' checks them"
    )


def _download(url: str, timeout: float, root: Path) -> bytes:
    if not url.startswith(("https://", "http://")):
        raise FetchError(f"{url} is no web address; give one that begins with https://")
    try:
        with urllib.request.urlopen(url, timeout=timeout) as answer:
            data: bytes = answer.read(MAX_BYTES + 1)
    except urllib.error.HTTPError as error:
        error.close()
        raise FetchError(f"{url} answers {error.code}; {by_hand(root)}.") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "reason", error)
        raise FetchError(f"{url} cannot be reached ({reason}); {by_hand(root)}.") from None
    if len(data) > MAX_BYTES:
        raise FetchError(f"{url} is larger than any file of the dataset; is the address right?")
    return data


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
