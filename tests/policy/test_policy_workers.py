"""The life of the sandbox's workers: crashes, forks, threads, memory, descriptors, and the end of their parent."""

import asyncio
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from ovita.errors import PolicyTimeout
from ovita.policy import Policy, sandbox
from ovita.policy.processes import POOL
from ovita.policy.sandbox import SandboxLimits

run = partial(sandbox.run, isolation="strict")  # so that proven policies need a worker too

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="strict isolation needs Linux")

SHIFT = Policy("def adapt(traj, scene, *, by=1.0):\n    return traj + by\n")
SCIPY = Policy(
    "from scipy.ndimage import gaussian_filter1d\ndef adapt(traj, scene):\n    return gaussian_filter1d(traj, 1.0)\n"
)
HANG = Policy("def adapt(traj, scene):\n    while True:\n        pass\n")


def status(pid: int, key: str) -> str:
    text = Path(f"/proc/{pid}/status").read_text()
    return next(line.split(":")[1].strip() for line in text.splitlines() if line.startswith(key + ":"))


def gone(pid: int, within_s: float = 3.0) -> bool:
    deadline = time.monotonic() + within_s
    while time.monotonic() < deadline:
        try:
            if status(pid, "State").startswith("Z"):
                return True  # ended; whoever its parent is now will bury it
        except (OSError, StopIteration):
            return True
        time.sleep(0.01)
    return False


def children(pid: int) -> list[int]:
    return [int(p) for p in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def test_one_worker_serves_many(line, table):
    run(SHIFT, line, table)
    pids = POOL.pids()
    for _ in range(5):
        run(SHIFT, line, table)
    assert POOL.pids() == pids


def test_the_worker_holds_no_secret(line, table, monkeypatch):
    monkeypatch.setenv("OVITA_TEST_KEY", "secret-value")
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "4")
    sandbox.close()
    run(SHIFT, line, table)
    (pid,) = POOL.pids()
    environment = Path(f"/proc/{pid}/environ").read_bytes()
    assert b"secret-value" not in environment
    assert b"OPENBLAS_NUM_THREADS=1" in environment
    assert status(pid, "Threads") == "1"
    assert int(status(pid, "VmRSS").split()[0]) < 60 * 1024


def test_a_dead_worker_is_replaced(line, table):
    run(SHIFT, line, table)
    (first,) = POOL.pids()
    os.kill(first, signal.SIGKILL)
    assert run(SHIFT, line, table).trajectory.positions[0, 0] == 1.0
    assert POOL.pids() != (first,)
    assert gone(first)


def test_a_worker_that_dies_in_the_middle_is_replaced(line, table):
    run(SHIFT, line, table)
    (first,) = POOL.pids()
    killer = threading.Timer(0.2, os.kill, (first, signal.SIGKILL))
    killer.start()
    with pytest.raises(PolicyTimeout):
        run(HANG, line, table, limits=SandboxLimits(wall_s=0.6))
    killer.join()
    assert POOL.pids() != (first,)


def test_a_stopped_worker_is_given_up(line, table, monkeypatch):
    monkeypatch.setattr("ovita.policy.processes.GRACE_S", 0.2)
    run(SHIFT, line, table)
    (first,) = POOL.pids()
    os.kill(first, signal.SIGSTOP)
    assert run(SHIFT, line, table, limits=SandboxLimits(wall_s=0.1)).trajectory.positions[0, 0] == 1.0
    assert gone(first)


def test_threads_share_a_worker(line, table):
    def one(i: int) -> float:
        policy = SHIFT.with_parameters(by=float(i)) if i % 4 else SCIPY
        return float(run(policy, line, table).trajectory.positions[0, 0])

    with ThreadPoolExecutor(8) as pool:
        results = list(pool.map(one, range(40)))
    assert [r for i, r in enumerate(results) if i % 4] == [float(i) for i in range(40) if i % 4]
    assert len(POOL.pids()) == 2


def test_a_worker_outlives_the_thread_that_started_it(line, table):
    sandbox.close()
    thread = threading.Thread(target=run, args=(SHIFT, line, table))
    thread.start()
    thread.join()
    pids = POOL.pids()
    time.sleep(0.05)
    run(SHIFT, line, table)
    assert POOL.pids() == pids


def test_asyncio_can_wait_for_policies(line, table):
    async def main() -> list[float]:
        calls = [asyncio.to_thread(run, SHIFT.with_parameters(by=float(i)), line, table) for i in range(6)]
        return [float(r.trajectory.positions[0, 0]) for r in await asyncio.gather(*calls)]

    assert asyncio.run(main()) == [float(i) for i in range(6)]


def test_an_interrupted_call_leaves_no_confusion(line, table):
    class Stop(BaseException):
        pass

    def interrupt(number, frame):
        raise Stop

    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, 0.2)
    try:
        with pytest.raises(Stop):
            run(HANG, line, table)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert run(SHIFT, line, table).trajectory.positions[0, 0] == 1.0


def test_a_forked_process_gets_its_own_worker(line, table):
    run(SHIFT, line, table)
    mine = POOL.pids()
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        answer = b"failed"
        try:
            ok = POOL.pids() == () and run(SHIFT, line, table).trajectory.positions[0, 0] == 1.0
            answer = b"%d" % POOL.pids()[0] if ok else b"wrong"
        finally:
            os.write(writing, answer)
            os._exit(0)
    os.close(writing)
    os.waitpid(child, 0)
    theirs = int(os.read(reading, 100))
    os.close(reading)
    assert theirs not in mine
    assert gone(theirs)
    assert run(SHIFT, line, table).trajectory.positions[0, 0] == 1.0
    assert POOL.pids() == mine


PARENT = """
import os, sys, threading, time
import numpy as np
from ovita.policy import Policy
from ovita.policy.processes import POOL
from ovita.policy.sandbox import run, SandboxLimits
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory

line = Trajectory(np.zeros((3, 3)), np.ones(3))
run(Policy("def adapt(traj, scene):\\n    return traj\\n"), line, Scene(), isolation="strict")
hang = Policy("def adapt(traj, scene):\\n    while True:\\n        pass\\n")
if sys.argv[1] == "busy":
    limits = SandboxLimits(wall_s=60.0)
    threading.Thread(target=run, args=(hang, line, Scene()), kwargs={"limits": limits}, daemon=True).start()
    time.sleep(0.3)
(worker,) = POOL.pids()
print(worker, *open(f"/proc/{worker}/task/{worker}/children").read().split(), flush=True)
if sys.argv[2] == "wait":
    time.sleep(60)
"""


@pytest.mark.parametrize("state", ["idle", "busy"])
@pytest.mark.parametrize("end", ["kill", "wait-not"])
def test_workers_and_policies_end_with_their_parent(state, end):
    command = [sys.executable, "-c", textwrap.dedent(PARENT), state, "wait" if end == "kill" else "leave"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as parent:
        pids = [int(p) for p in parent.stdout.readline().split()]
        assert len(pids) >= 2
        if end == "kill":
            parent.kill()
        parent.wait(10)
    assert all(gone(pid) for pid in pids)


def open_files(pid):
    return len(os.listdir(f"/proc/{pid}/fd"))


def test_many_policies_leave_nothing_behind(line, table):
    for _ in range(20):
        run(SHIFT, line, table)
    (worker, *_) = POOL.pids()
    descriptors = [open_files(os.getpid()), open_files(worker)]
    memory = int(status(worker, "VmRSS").split()[0])
    broken = Policy("def adapt(traj, scene):\n    return traj[:, :2]\n")
    for i in range(100):
        try:
            run(broken if i % 5 == 0 else SHIFT, line, table)
        except sandbox.PolicyOutputInvalid:
            pass
    # the worker forks the next policy's process ahead of time, so its count settles a moment later
    deadline = time.monotonic() + 5.0
    while (open_files(worker) > descriptors[1] or len(children(worker)) > 1) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert open_files(os.getpid()) <= descriptors[0] and open_files(worker) <= descriptors[1] + 2
    assert int(status(worker, "VmRSS").split()[0]) - memory < 1024
    assert len(children(worker)) == 1
    assert not any(status(pid, "State").startswith("Z") for pid in children(worker))


def test_a_large_result_is_forgotten(line, table):
    big = Policy("def adapt(traj, scene):\n    return np.resize(traj, (190000, 4))\n")
    assert len(run(big, line, table).trajectory) == 190_000
    (worker, *_) = POOL.pids()
    run(SHIFT, line, table)
    assert int(status(worker, "VmRSS").split()[0]) < 60 * 1024


def test_closing_is_no_end(line, table):
    run(SHIFT, line, table)
    sandbox.close()
    assert POOL.pids() == ()
    assert np.isfinite(run(SHIFT, line, table).trajectory.speeds).all()
