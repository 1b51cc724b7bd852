"""How fast and how large augmented data are in each format, written and read back, side by side.

    python benchmarks/augment_formats.py --n 10000

The samples come from random scenes; making them is not counted. Times are CPU time of one process but for "wall", which
has the waiting for the disk and for other programs in it.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from ovita.augment.engine import Job, make_shard
from ovita.augment.formats import FORMATS, read
from ovita.augment.shards import AugmentedSample
from ovita.augment.verified import Manner
from ovita.augment.wording import families_from

SHARD = 1000


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--n", type=int, default=10_000)
    parser.add_argument("--formats", default=",".join(FORMATS))
    parser.add_argument("--folder", help="Where to write. [the system's temporary folder]")
    given = parser.parse_args()
    job = Job(given.n, Manner(0, families_from([])), shard=SHARD)
    shards = [[made.sample for made in make_shard(job, shard).made] for shard in range(job.shards)]
    kept = sum(map(len, shards))
    frames = sum(one.adapted.duration * 10 for shard in shards for one in shard) / kept
    waypoints = sum(len(one.adapted) for shard in shards for one in shard) / kept
    print(f"{kept} samples of {waypoints:.0f} waypoints, {frames:.0f} frames at 10 fps on average\n")
    print(f"{'format':18}{'write':>9}{'finish':>9}{'wall':>9}{'read':>9}   {'bytes':>7}")
    print(f"{'':18}{'ms':>9}{'ms':>9}{'ms':>9}{'ms':>9}   a sample")
    for name in given.formats.split(","):
        with tempfile.TemporaryDirectory(dir=given.folder) as folder:
            print(measured(name, Path(folder), shards, kept), flush=True)


def measured(name: str, folder: Path, shards: list[list[AugmentedSample]], kept: int) -> str:
    sink, begun = FORMATS[name], time.perf_counter()
    started = time.process_time()
    for number, samples in enumerate(shards):
        sink.write(folder, number, samples)
    written = time.process_time()
    sink.finish(folder, {})
    finished, wall = time.process_time(), time.perf_counter() - begun
    size = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
    again = time.process_time()
    count = sum(1 for _ in counted(read(folder)))
    assert count == kept, f"{name}: {count} of {kept} samples came back"
    spent = (written - started, finished - written, wall, time.process_time() - again)
    return f"{name:18}" + "".join(f"{1e3 * seconds / kept:9.2f}" for seconds in spent) + f"   {size / kept:7.0f}"


def counted(samples: Iterator[AugmentedSample]) -> Iterator[int]:
    last = -1
    for sample in samples:
        assert sample.index > last, "samples come in order"
        last = sample.index
        yield last


if __name__ == "__main__":
    main()
