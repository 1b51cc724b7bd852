"""Pairs of language and motion at any scale, each verified by a check of its own."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence

from ovita.augment.engine import AugmentedDataset, Job, Progressed, run
from ovita.augment.shards import JsonLines, Sink
from ovita.augment.sources import Given, open_pool
from ovita.augment.verified import Manner
from ovita.augment.wording import families_from, with_voices
from ovita.workers import Engine

__all__ = ["AugmentedDataset", "Job", "augment"]


def augment(
    tasks: Iterable[Given] = (),
    n: int = 1000,
    out: str | os.PathLike[str] = "ovita-augmented",
    *,
    families: Sequence[str] = (),
    paraphrases: int = 4,
    seed: int = 0,
    robot: str | None = None,
    waypoints: int | None = None,
    repairs: float = 0.05,
    voices: str | os.PathLike[str] | None = None,
    shard: int = 1000,
    sinks: Sequence[Sink] = (JsonLines(),),
    jobs: int = 1,
    engine: Engine = "processes",
    progress: Callable[[Progressed], None] | None = None,
) -> AugmentedDataset:
    """Make a dataset of verified pairs of language and motion.

    Sample i depends on the seed, the sources and i alone, whoever works and however large the shards are. The same
    call goes on where an earlier one was stopped.

    Args:
        tasks: What is changed: tasks, trajectories, files, folders, "random" (see `sources.open_pool`).
        n: How many samples are tried; a number whose draws all fail stays empty.
        out: The folder.
        families: Kinds of requests, see `wording.families_from`; all if empty.
        paraphrases: Further sentences of each sample.
        seed: Of everything random.
        robot: Whose limits hold; None takes what each task names.
        waypoints: Of random scenes.
        repairs: Share of the draws whose path breaks a limit that the solver repairs; the others are rejected.
        voices: A folder of what people wrote, whose wordings are used as well (see `wording.with_voices`).
        shard: Samples in a shard.
        sinks: Formats.
        jobs: Workers.
        engine: "processes" or "ray".
        progress: Called after each shard.

    Raises:
        RequestError: If an option or a source cannot be used, or the folder holds another dataset.
        FormatError: If a file cannot be read or written.
    """
    manner = Manner(seed, families_from(families), paraphrases, repairs)
    pool, _ = open_pool(tasks, robot=robot, waypoints=waypoints)
    job = Job(n, manner, pool, tuple(sinks), shard, wordings=None if voices is None else with_voices(voices))
    return run(job, out, jobs=jobs, engine=engine, progress=progress)
