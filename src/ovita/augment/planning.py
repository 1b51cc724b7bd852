"""How long a dataset of any size takes, how large it gets and what it costs: worked out from a small one made now."""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ovita.augment.engine import Job, write_shard
from ovita.errors import RequestError

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


@dataclass(frozen=True)
class MachineTime:
    """What a dataset takes on a machine: hours of it, money, and room on disk [bytes]."""

    machine: Machine
    hours: float
    cost: float
    bytes: float


def estimates(n: float, rates: Rates, machines: Sequence[Machine]) -> Iterator[MachineTime]:
    """What n verified samples take on each machine, all cores busy."""
    for machine in machines:
        hours = n * rates.seconds / machine.cores / 3600.0
        yield MachineTime(machine, hours, hours * machine.price, n * rates.bytes)


def lines(n: float, rates: Rates, machines: Sequence[Machine], shard: int) -> Iterator[str]:
    """The plan as lines of text."""
    yield (
        f"Measured now: {1.0 / rates.seconds:.0f} verified samples a second of CPU time, {rates.bytes:.0f} bytes each;"
        f" {100 * rates.share:.1f} % of the numbers get one."
    )
    hours, size = n * rates.seconds / 3600, _size(n * rates.bytes)
    yield f"{n:.3g} samples: {hours:.3g} core-hours, {size}, {math.ceil(n / shard)} shards."
    yield f"{'machine':<16}{'cores':>7}{'hours':>10}{'cost':>12}"
    for one in estimates(n, rates, machines or EXAMPLES):
        yield f"{one.machine.name:<16}{one.machine.cores:>7}{one.hours:>10.3g}{one.cost:>12.2f}"
    if not machines:
        yield "These machines and prices are examples; give your own: --machine NAME=CORES,PRICE (of an hour)."


def _size(count: float) -> str:
    for unit in ("bytes", "kB", "MB", "GB", "TB"):
        if count < 1000.0 or unit == "TB":
            break
        count /= 1000.0
    return f"{count:.3g} {unit}"
