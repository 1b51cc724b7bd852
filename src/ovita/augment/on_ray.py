"""Shards by Ray Data, for more than one machine; all of them see the dataset's folder.

Only functions are mapped, never a pool of actors: a pool as large as the number of CPUs waits for ever (ray #44687).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ovita.augment.engine import Job, write_shard
from ovita.augment.shards import ShardRecord
from ovita.errors import MissingExtra


@dataclass(frozen=True)
class _Mapped:
    """The function that a Ray task calls with the numbers of some shards."""

    job: Job
    root: str

    def __call__(self, batch: dict[str, Any]) -> dict[str, Any]:
        done = [int(number) for number in batch["id"]]
        for number in done:
            write_shard(self.job, Path(self.root), number)
        return {"shard": done}


def shards_by_ray(job: Job, root: Path, todo: Sequence[int], jobs: int) -> Iterator[ShardRecord]:
    """Make shards with Ray, one task a shard, `jobs` at a time where Ray is started here.

    Raises:
        MissingExtra: If Ray is not installed.
    """
    try:
        import ray
        import ray.data
    except ImportError:
        raise MissingExtra("ray[data]", "ray") from None
    if not todo:
        return
    begun = not ray.is_initialized()
    if begun:
        ray.init(num_cpus=jobs, include_dashboard=False, log_to_driver=False, logging_level="ERROR")
    try:
        ray.data.DataContext.get_current().enable_progress_bars = False
        made = _Mapped(job, str(root.resolve()))
        numbers = ray.data.from_items([{"id": k} for k in todo], override_num_blocks=len(todo))
        for row in numbers.map_batches(lambda batch: made(batch), batch_size=1, num_cpus=1).iter_rows():
            record = ShardRecord.load(root, int(row["shard"]))
            assert record is not None, "a Ray task ends once its shard is on disk"
            yield record
    finally:
        if begun:
            ray.shutdown()
