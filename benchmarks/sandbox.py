"""What the sandbox costs: first call, warm calls, a fresh process per policy, memory.

python benchmarks/sandbox.py [--runs 200] [--many 0] [--json]
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.policy import Policy, sandbox
from ovita.policy.processes import POOL
from ovita.policy.sandbox import run

WAYPOINTS = 100

TOOLKIT = Policy(
    "def adapt(traj, scene, *, distance=0.2, slowdown=0.5, radius=0.15):\n"
    "    cup = scene['cup']\n"
    "    traj = move(traj, left=distance)\n"
    "    return scale_speed(traj, slowdown, where=near(traj, cup, within=radius))\n"
)
NUMPY = Policy(
    "def adapt(traj, scene, *, push=0.1, sigma=0.3):\n"
    "    for obj in scene:\n"
    "        away = traj[:, :3] - obj.position\n"
    "        d = np.linalg.norm(away, axis=1, keepdims=True)\n"
    "        traj[:, :3] += push * np.exp(-((d / sigma) ** 2)) * away / np.maximum(d, 1e-9)\n"
    "    traj[:, 3] = np.clip(traj[:, 3] * 0.8, 0.05, None)\n"
    "    return traj\n"
)
SCIPY = Policy(
    "from scipy.ndimage import gaussian_filter1d\n"
    "def adapt(traj, scene, *, sigma=2.0):\n"
    "    return gaussian_filter1d(traj, sigma, axis=0, mode='nearest')\n"
)


def timed(call: Callable[[], object], runs: int) -> list[float]:
    """Durations of so many calls [ms]."""
    times = []
    for _ in range(runs):
        started = time.perf_counter()
        call()
        times.append((time.perf_counter() - started) * 1000.0)
    return times


def memory(pid: int, key: str) -> float:
    """Memory of a process [MB]: "Rss", or "Pss", in which shared pages count by their share."""
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    return next(int(line.split()[1]) / 1024.0 for line in lines if line.startswith(key + ":"))


def children(pid: int) -> list[int]:
    """Process ids of a process's children."""
    return [int(p) for p in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def measure(runs: int, many: int) -> dict[str, float]:
    """All measurements, as name to value."""
    line = Trajectory(np.linspace([0.0, 0, 0], [1.0, 0.5, 0.2], WAYPOINTS), np.full(WAYPOINTS, 0.2))
    scene = Scene((SceneObject("cup", np.array([0.5, 0.25, 0.1])), SceneObject("box", np.array([0.9, 0, 0]))))
    sandbox.close()
    results = {"first call [ms]": timed(lambda: run(NUMPY, line, scene), 1)[0]}
    for name, policy in (("numpy", NUMPY), ("toolkit", TOOLKIT)):
        times = timed(lambda policy=policy: run(policy, line, scene), runs)  # type: ignore[misc]
        results[f"warm, {name}, median [ms]"] = statistics.median(times)
        results[f"warm, {name}, 95 % [ms]"] = float(np.percentile(times, 95))
    spaced = [timed(lambda: run(NUMPY, line, scene), 1)[0] for _ in range(min(runs, 50)) if time.sleep(0.03) is None]
    results["warm, numpy, 30 ms apart, median [ms]"] = statistics.median(spaced)
    spawn = timed(lambda: run(NUMPY, line, scene, isolation="degraded"), max(5, runs // 20))
    results["a process per policy, median [ms]"] = statistics.median(spawn)
    results["times faster than a process per policy"] = statistics.median(spawn) / results["warm, numpy, median [ms]"]
    (worker,) = POOL.pids()
    results["worker, resident [MB]"] = memory(worker, "Rss")
    results["worker and child, proportional [MB]"] = sum(memory(p, "Pss") for p in (worker, *children(worker)))
    if many:
        before, descriptors = memory(worker, "Rss"), len(os.listdir(f"/proc/{worker}/fd"))
        timed(lambda: run(NUMPY, line, scene), many)
        results[f"growth of the worker over {many} policies [MB]"] = memory(worker, "Rss") - before
        results["growth of its descriptors"] = len(os.listdir(f"/proc/{worker}/fd")) - descriptors
        results["children at the end"] = len(children(worker))
    results["first call with scipy [ms]"] = timed(lambda: run(SCIPY, line, scene), 1)[0]
    results["warm, scipy, median [ms]"] = statistics.median(timed(lambda: run(SCIPY, line, scene), max(10, runs // 4)))
    return results


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure what the sandbox costs.")
    parser.add_argument("--runs", type=int, default=200, help="calls to take the median of")
    parser.add_argument("--many", type=int, default=0, help="also run so many policies and look for what is left")
    parser.add_argument("--json", action="store_true", help="print JSON")
    options = parser.parse_args()
    results = measure(options.runs, options.many)
    if options.json:
        print(json.dumps(results, indent=1))
        return
    print(
        f"{WAYPOINTS} waypoints, {os.cpu_count()} cores, Linux {platform.release()}, Python {platform.python_version()}"
    )
    for name, value in results.items():
        print(f"  {name:<45} {value:8.1f}")


if __name__ == "__main__":
    main()
