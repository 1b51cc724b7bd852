"""Making a dataset: shards in this process, in worker processes or with Ray, resumable, and the same bytes by all.

A shard is a pure function of the job and its number. Workers write the files and then the record of a shard
(`shards`); the driver only hands out numbers and reads records. So whatever is killed, the same command goes on. How
long a dataset of any size takes, how large it gets and what it costs is worked out from a small one made now.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import ovita
from ovita.augment.ground import GroundPool, RandomScenes
from ovita.augment.shards import JsonLines, ShardFile, ShardRecord, Sink
from ovita.augment.verified import Made, Manner, make
from ovita.augment.wording import Wordings, grammar
from ovita.bench.records import lock
from ovita.errors import RequestError
from ovita.io import atomic_write
from ovita.io.files import make_folder, read_text, remove_unfinished
from ovita.workers import Engine, shared

JOB, MANIFEST = "job.json", "manifest.json"

SCHEMA = "ovita.augmented/1"

BLOCK = 16
"""Samples of one scene that follow each other."""


@dataclass(frozen=True)
class Job:
    """What a dataset is made of; it is pickled to the workers.

    Args:
        n: How many samples are tried; a number whose draws all fail stays empty.
        block: Samples of one scene that follow each other.
        wordings: Other words than those of the grammar, or None.
    """

    n: int
    manner: Manner
    pool: GroundPool = field(default_factory=RandomScenes)
    sinks: tuple[Sink, ...] = (JsonLines(),)
    shard: int = 1000
    block: int = BLOCK
    wordings: Wordings | None = None

    def __post_init__(self) -> None:
        for name, value in (("n", self.n), ("shard", self.shard), ("block", self.block)):
            if value < 1:
                raise RequestError(f"{name} must be 1 or more, not {value}")

    @property
    def shards(self) -> int:
        """How many shards there are."""
        return -(-self.n // self.shard)

    def span(self, shard: int) -> range:
        """The numbers of the samples of a shard."""
        return range(shard * self.shard, min((shard + 1) * self.shard, self.n))

    def describe(self) -> dict[str, Any]:
        """All that decides what is in the dataset, as a JSON document."""
        words = hashlib.sha256(repr(self.wordings or grammar()).encode()).hexdigest()
        return {
            "schema": SCHEMA,
            "version": ovita.__version__,
            "n": self.n,
            **json.loads(json.dumps(asdict(self.manner))),
            "block": self.block,
            "shard": self.shard,
            "formats": [sink.name for sink in self.sinks],
            "sources": [dict(one) for one in self.pool.describe()],
            "wordings": words,
        }


@dataclass(frozen=True)
class MadeShard:
    """The samples of a shard, and why draws for it were rejected."""

    made: tuple[Made, ...]
    rejected: Mapping[str, int]


def make_shard(job: Job, shard: int, without: frozenset[int] = frozenset()) -> MadeShard:
    """Make the samples of a shard, but for the numbers in `without`.

    A block of samples of one scene is always made from its first, so that a sample depends on the seed and its number
    alone wherever a shard begins.
    """
    span, wordings = job.span(shard), job.wordings or grammar()
    found: list[Made] = []
    rejected: Counter[str] = Counter()
    for block in range(span.start // job.block, (span.stop - 1) // job.block + 1):
        ground = job.pool.ground(job.manner.seed, block)
        taken: set[str] = set()
        for index in range(block * job.block, min((block + 1) * job.block, span.stop)):
            counts = rejected if index in span else Counter[str]()
            made = make(index, ground, job.manner, wordings, taken, counts)
            if made is not None and index in span and index not in without:
                found.append(made)
    if without:
        rejected["duplicate"] += len(without & set(span))
    return MadeShard(tuple(found), _sums([rejected]))


def write_shard(job: Job, folder: Path, shard: int, without: frozenset[int] = frozenset()) -> ShardRecord:
    """Make a shard, write its files, and then its record."""
    span, done = job.span(shard), make_shard(job, shard, without)
    samples = [made.sample for made in done.made]
    files = tuple(file for sink in job.sinks for file in sink.write(folder, shard, samples))
    record = ShardRecord(
        shard,
        span.start,
        span.stop,
        len(samples),
        files,
        done.rejected,
        counted(done.made),
        tuple((made.sample.index, made.key) for made in done.made) if job.pool.repeats else (),
    )
    record.save(folder)
    return record


def counted(made: Iterable[Made]) -> dict[str, dict[str, int]]:
    """How the samples spread: over families, splits, directions, regions, magnitudes, shifts, scales and verdicts."""
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for one in made:
        sample, seen = one.sample, one.sample.measured
        values = {
            "family": [sample.family],
            "split": [sample.split],
            "verdict": [sample.verdict],
            "direction": seen["directions"] or ["none"],
            "region": [seen["region"]],
            "magnitude": [_bin(seen["magnitude"], seen["unit"])],
            "shift": [_bin(seen["shift"], "m")],
            "robot": [sample.task.robot or "none"],
            "waypoints": [_bin(float(len(sample.adapted)), "")],
            "words": [_bin(float(len(sample.instruction.split())), "")],
        }
        for name, said in values.items():
            counts[name].update(said)
    return {name: _sums([count]) for name, count in sorted(counts.items())}


_EDGES = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0)


def _bin(value: float | None, unit: str) -> str:
    """A number as the bin that it falls into, such as "0.1..0.2 m"."""
    if value is None:
        return "none"
    low = max((edge for edge in _EDGES if edge <= abs(value)), default=0.0)
    high = next((edge for edge in _EDGES if edge > abs(value)), None)
    return f"{low:g}..{'' if high is None else f'{high:g}'} {unit}".strip()


@dataclass(frozen=True)
class Progressed:
    """How far a dataset is: shards and samples done, and shards there will be."""

    done: int
    shards: int
    kept: int


@dataclass(frozen=True)
class AugmentedDataset:
    """A finished dataset.

    Args:
        seconds: How long this run took [s]; shards that were there are not counted.
        made: Shards that this run made.
    """

    folder: Path
    manifest: Mapping[str, Any]
    seconds: float
    made: int

    @property
    def kept(self) -> int:
        """How many samples there are."""
        return int(self.manifest["kept"])


def run(
    job: Job,
    folder: str | os.PathLike[str],
    *,
    jobs: int = 1,
    engine: Engine = "processes",
    progress: Callable[[Progressed], None] | None = None,
) -> AugmentedDataset:
    """Make a dataset, or go on where an earlier run of the same job was stopped or killed.

    Raises:
        RequestError: If the folder holds another dataset, another run writes there, or there is no such engine.
        MissingExtra: If Ray is not installed.
    """
    started = time.perf_counter()
    root = make_folder(folder)
    with open(root / ".lock", "ab") as held:
        lock(held, str(folder))
        _claim(job, root)
        records = {k: record for k in range(job.shards) if (record := ShardRecord.load(root, k))}
        todo = [k for k in range(job.shards) if k not in records]
        kept = sum(record.kept for record in records.values())
        work = partial(_written, job=job, root=root.resolve())
        for record in shared(work, todo, jobs=min(jobs, len(todo)), engine=engine):
            records[record.shard] = record
            kept += record.kept
            if progress is not None:
                progress(Progressed(len(records), job.shards, kept))
        records |= {k: write_shard(job, root, k, without) for k, without in _repeated(job, records.values())}
        manifest = _finished(job, root, [records[k] for k in range(job.shards)])
        remove_unfinished(root)
    return AugmentedDataset(root, manifest, time.perf_counter() - started, len(todo))


def _claim(job: Job, root: Path) -> None:
    """Write what the folder is about, or check that it is about the same."""
    described, file = json.dumps(job.describe(), indent=1, sort_keys=True) + "\n", root / JOB
    if file.exists():
        if read_text(file) != described:
            raise RequestError(
                f"{root} holds another dataset, or one of another version of ovita; choose another --out"
            )
        return
    if any(path.name != ".lock" for path in root.iterdir()):
        raise RequestError(f"{root} is not empty; choose another --out")
    atomic_write(file, described)


def _written(shard: int, job: Job, root: Path) -> ShardRecord:
    return write_shard(job, root, shard)


def _repeated(job: Job, records: Iterable[ShardRecord]) -> Iterator[tuple[int, frozenset[int]]]:
    """Second pass, where grounds come again: of near duplicates the one with the lowest number stays."""
    if not job.pool.repeats:
        return
    seen: set[str] = set()
    for record in sorted(records, key=lambda r: r.shard):
        again = set()
        for index, key in record.keys:
            again |= {index} if key in seen else set()
            seen.add(key)
        if again:
            yield record.shard, frozenset(again)


def _finished(job: Job, root: Path, records: Sequence[ShardRecord]) -> dict[str, Any]:
    """Finish the formats, and write the manifest; it says nothing of who made the shards, nor when."""
    names = sorted(set(chain.from_iterable(record.counts for record in records)))
    manifest = {
        **job.describe(),
        "kept": sum(record.kept for record in records),
        "rejected": _sums(record.rejected for record in records),
        "counts": {name: _sums(r.counts.get(name, {}) for r in records) for name in names},
        "shards": [
            {"shard": r.shard, "first": r.first, "end": r.end, "kept": r.kept, "files": [asdict(f) for f in r.files]}
            for r in records
        ],
    }
    more: list[ShardFile] = [file for sink in job.sinks for file in sink.finish(root, manifest)]
    manifest["files"] = [asdict(file) for file in more]
    atomic_write(root / MANIFEST, json.dumps(manifest, indent=1, sort_keys=True) + "\n")
    return manifest


def _sums(counts: Iterable[Mapping[str, int]]) -> dict[str, int]:
    """The sum of counts, in the order of their names."""
    total: Counter[str] = Counter()
    for count in counts:
        total.update(count)
    return dict(sorted(total.items()))


TRIAL = 320
"""Samples that are made for a plan."""


@dataclass(frozen=True)
class Machine:
    """A kind of machine: its cores, and its price for an hour in any currency."""

    name: str
    cores: int
    price: float

    @classmethod
    def parse(cls, text: str) -> Machine:
        """Read "NAME=CORES,PRICE".

        Raises:
            RequestError: If it is no such thing.
        """
        name, _, numbers = text.partition("=")
        cores, _, price = numbers.partition(",")
        try:
            machine = cls(name.strip(), int(cores), float(price))
        except ValueError:
            machine = cls("", 0, 0.0)
        if not machine.name or machine.cores < 1 or not 0.0 <= machine.price < math.inf:
            raise RequestError(
                f"{text!r} is no machine; write NAME=CORES,PRICE, such as big=64,2.50 (price of an hour)"
            )
        return machine

    def takes(self, n: float, rates: Rates) -> tuple[float, float]:
        """The hours that n verified samples take, all cores busy, and what they cost."""
        hours = n * rates.seconds / self.cores / 3600.0
        return hours, hours * self.price


EXAMPLES = (Machine("laptop", 4, 0.0), Machine("server", 32, 1.5), Machine("10 servers", 320, 15.0))
"""Made up, so that a table shows something; give machines of your own."""


@dataclass(frozen=True)
class Rates:
    """What a small dataset took: CPU time [s] and size [bytes] of a sample, and which share of the numbers got one."""

    seconds: float
    bytes: float
    share: float


def measure(job: Job, trial: int = TRIAL) -> Rates:
    """Make a small dataset of the same kind in a folder that is thrown away, and measure it, caches being warm."""
    small = replace(job, n=2 * trial, shard=trial)
    with tempfile.TemporaryDirectory() as folder:
        write_shard(small, Path(folder), 0)
        started = time.process_time()
        record = write_shard(small, Path(folder), 1)
        seconds = time.process_time() - started
    if not record.kept:
        raise RequestError("no draw passed, so there is nothing to plan with; look at --n 100 first")
    return Rates(seconds / record.kept, sum(file.bytes for file in record.files) / record.kept, record.kept / trial)


def lines(n: float, rates: Rates, machines: Sequence[Machine], shard: int) -> Iterator[str]:
    """The plan as lines of text."""
    yield (
        f"Measured now: {1.0 / rates.seconds:.0f} verified samples a second of CPU time, {rates.bytes:.0f} bytes each;"
        f" {100 * rates.share:.1f} % of the numbers get one."
    )
    hours, size = n * rates.seconds / 3600, _size(n * rates.bytes)
    yield f"{n:.3g} samples: {hours:.3g} core-hours, {size}, {math.ceil(n / shard)} shards."
    yield f"{'machine':<16}{'cores':>7}{'hours':>10}{'cost':>12}"
    for machine in machines or EXAMPLES:
        hours, cost = machine.takes(n, rates)
        yield f"{machine.name:<16}{machine.cores:>7}{hours:>10.3g}{cost:>12.2f}"
    if not machines:
        yield "These machines and prices are examples; give your own: --machine NAME=CORES,PRICE (of an hour)."


def _size(count: float) -> str:
    for unit in ("bytes", "kB", "MB", "GB", "TB"):
        if count < 1000.0 or unit == "TB":
            break
        count /= 1000.0
    return f"{count:.3g} {unit}"
