"""Work shared out to workers: threads, processes of this machine, or Ray; whoever dies, each piece is done once."""

from __future__ import annotations

import os
import pickle
import threading
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from typing import TYPE_CHECKING, Any, Literal, TypeVar, get_args

from ovita.errors import OvitaError, RequestError, needs

if TYPE_CHECKING:
    from concurrent.futures import Executor

Engine = Literal["processes", "threads", "ray"]
"""Who works: processes or threads of this machine, or Ray, on this machine or on a cluster."""

RESTARTS = 3
"""How often worker processes that were ended from outside are started again."""

T = TypeVar("T")
R = TypeVar("R")


def shared(work: Callable[[T], R], items: Iterable[T], *, jobs: int, engine: Engine = "processes") -> Iterator[R]:
    """The results of some work on items, as they come, in no order; two items a worker are at hand.

    Args:
        work: Can be pickled for processes and Ray; it is sent to each worker once.
        items: Drawn one by one as workers come free (Ray draws all at first).
        jobs: Workers; 1 works in this process, unless it is Ray that works.
        engine: Who works.

    Raises:
        OvitaError: If worker processes are ended from outside again and again.
        MissingExtra: If Ray is not installed.
        RequestError: If there is no such engine.
    """
    if engine not in get_args(Engine):
        raise RequestError(f"there is no engine {engine!r}; choose processes or ray")
    if engine == "ray":
        yield from _by_ray(work, items, jobs)
    elif jobs <= 1:
        yield from map(work, items)
    else:
        yield from _by_pools(work, iter(items), jobs, engine)


def _by_pools(work: Callable[[T], R], items: Iterator[T], jobs: int, engine: Engine) -> Iterator[R]:
    """Results of executors; where one breaks, the next begins with what was at hand."""
    from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait

    at_hand: list[T] = []
    for _ in range(RESTARTS + 1):
        executor = _executor(work, jobs, engine)
        running = dict[Future[R], T]()
        try:
            while True:
                at_hand += islice(items, max(2 * jobs - len(running) - len(at_hand), 0))
                while at_hand:
                    running[_submitted(executor, work, at_hand[0], engine)] = at_hand[0]
                    del at_hand[0]
                if not running:
                    return
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    result = future.result()
                    del running[future]
                    yield result
        except BrokenExecutor:
            at_hand += running.values()
        finally:
            executor.shutdown(wait=True, cancel_futures=True)
    raise OvitaError(
        "worker processes were ended from outside again and again, perhaps for want of memory; run the same command"
        " again to go on, with fewer --jobs"
    )


def _executor(work: Callable[[Any], Any], jobs: int, engine: Engine) -> Executor:
    from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
    from multiprocessing import get_context

    if engine == "threads":
        return ThreadPoolExecutor(jobs, thread_name_prefix="ovita-worker")
    return ProcessPoolExecutor(jobs, mp_context=get_context("spawn"), initializer=_begin, initargs=(work,))


def _submitted(executor: Executor, work: Callable[[T], R], item: T, engine: Engine) -> Any:
    return executor.submit(work, item) if engine == "threads" else executor.submit(_worked, item)


_HERE: dict[str, Callable[[Any], Any]] = {}
"""The work of a worker process, which is sent once."""


def _begin(work: Callable[[Any], Any]) -> None:
    """Begin a worker process; it ends if its parent is killed, instead of waiting for ever."""
    from multiprocessing import parent_process

    _HERE["work"] = work
    parent = parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _worked(item: Any) -> Any:
    return _HERE["work"](item)


def _by_ray(work: Callable[[T], R], items: Iterable[T], jobs: int) -> Iterator[R]:
    """Results of Ray Data, one task an item, `jobs` at a time where Ray is started here.

    Only functions are mapped, never a pool of actors: a pool as large as the number of CPUs waits for ever (ray
    #44687).
    """
    with needs("ray[data]", "ray"):
        import ray
        import ray.data
    rows = [{"item": pickle.dumps(item)} for item in items]
    if not rows:
        return

    def worked(batch: dict[str, Any]) -> dict[str, Any]:
        return {"result": [pickle.dumps(work(pickle.loads(item))) for item in batch["item"]]}

    begun = not ray.is_initialized()
    if begun:
        ray.init(num_cpus=jobs, include_dashboard=False, log_to_driver=False, logging_level="ERROR")
    try:
        ray.data.DataContext.get_current().enable_progress_bars = False
        asked = ray.data.from_items(rows, override_num_blocks=len(rows))
        for row in asked.map_batches(worked, batch_size=1, num_cpus=1).iter_rows():
            yield pickle.loads(row["result"])
    finally:
        if begun:
            ray.shutdown()
