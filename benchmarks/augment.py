"""Verified samples a second, path by path and stage by stage, and how two workers compare with one.

    python benchmarks/augment.py [--n 1600] [--workers]

CPU time of this process, so that other work on the machine counts little; but a machine whose cores are shared runs
slower by itself, so the last line has the CPU time of a plain loop to compare machines by. With `--workers` it also
makes the same dataset with one worker and with two, and prints wall times, which mean something on an idle machine.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from ovita.augment.engine import Job, make_shard, run
from ovita.augment.ground import Legality, RandomScenes
from ovita.augment.shards import JsonLines
from ovita.augment.verified import Manner
from ovita.augment.wording import families_from
from ovita.chain import adapt
from ovita.instruct.frames import from_json
from ovita.policy import policy
from ovita.writers.generate import FramesWriter

POOL = RandomScenes(waypoints=50)
MANNER = Manner(0, families_from(()))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--n", type=int, default=1600, help="samples that are measured [1600]")
    parser.add_argument("--workers", action="store_true", help="also one worker against two")
    options = parser.parse_args()
    job = Job(2 * options.n, MANNER, POOL, shard=options.n)
    make_shard(job, 0)  # warms the caches
    print(f"{'path':<58}{'samples/s of CPU':>17}")
    made = make_shard(job, 1).made
    few = [one.sample for one in made[: max(options.n // 10, 20)]]
    robots = {one.source: POOL.ground(0, one.index // job.block).robot for one in few}

    def whole(sample: Any, **options: Any) -> None:
        adapt(sample.task, sample.instruction, robot=robots[sample.source], **options)

    _row("adapt: reads the sentence, reports", lambda: [whole(s, writer="builtin") for s in few], len(few))
    frames = [FramesWriter(from_json(s.frames)) for s in few]
    _row(
        "adapt with the frames given: no reading",
        lambda: [whole(s, writer=w) for s, w in zip(few, frames, strict=True)],
        len(few),
    )
    with _slow():
        _row("augment, every statement and every limit anew", lambda: make_shard(job, 1), len(made))
    _row("augment", lambda: make_shard(job, 1), len(made))
    solving = replace(job, manner=replace(MANNER, repairs=1.0))
    count = len(make_shard(replace(solving, shard=len(few)), 1).made)
    _row(
        "augment, every draw that breaks a limit is repaired",
        lambda: make_shard(replace(solving, shard=len(few)), 1),
        count,
    )
    with tempfile.TemporaryDirectory() as folder:
        samples = [one.sample for one in made]
        _row("writing JSON lines alone", lambda: JsonLines().write(Path(folder), 0, samples), len(made))
    print("\nby family")
    for family in MANNER.families:
        own = replace(job, manner=replace(MANNER, families=(family,)), n=2 * len(few), shard=len(few))
        count = len(make_shard(own, 1).made)
        _row(f"  {family}", lambda own=own: make_shard(own, 1), count)  # type: ignore[misc]
    if options.workers:
        _workers(job)
    started = time.process_time()
    total = 0
    for i in range(10_000_000):
        total += i
    print(f"\na loop of 10 million additions took {time.process_time() - started:.2f} s of CPU here")


def _row(name: str, do: Callable[[], Any], count: int) -> None:
    started = time.process_time()
    do()
    print(f"{name:<58}{count / (time.process_time() - started):>17.0f}", flush=True)


@contextmanager
def _slow() -> Iterator[None]:
    """Without what was made faster: each statement is read again, and `constrain` measures every limit each time."""
    kept = policy._read, Legality.steady
    policy._read = policy._read.__wrapped__  # type: ignore[assignment]
    Legality.steady = lambda self, proposed: False  # type: ignore[method-assign, assignment]
    try:
        yield
    finally:
        policy._read, Legality.steady = kept  # type: ignore[method-assign]


def _workers(job: Job) -> None:
    print()
    for jobs in (1, 2):
        with tempfile.TemporaryDirectory() as folder:
            done = run(replace(job, n=4 * job.shard), Path(folder) / "data", jobs=jobs)
            print(f"{jobs} worker{'s' * (jobs > 1)}: {done.kept / done.seconds:.0f} samples a second of wall time")


if __name__ == "__main__":
    main()
