"""How long paths are loaded, adapted and saved: CPU time and memory by their number of waypoints.

    python benchmarks/many_waypoints.py                # 10,000 to 1,000,000 waypoints, each in a process of its own
    python benchmarks/many_waypoints.py --points 5000

The path is a CSV file of x, y, z, t without objects; the instruction is "go left by 0.1". CPU time is of this process
and of the worker of the sandbox together.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

POINTS = (10_000, 100_000, 1_000_000)


def cpu() -> float:
    """CPU time of this process and of those that it has waited for [s]."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def measured(points: int) -> str:
    """One line of the table."""
    import ovita as ov
    from ovita.policy.sandbox import close

    with tempfile.TemporaryDirectory() as folder:
        path, t = Path(folder) / "path.csv", np.linspace(0.0, 600.0, points)
        columns = [0.5 * np.sin(t / 50), 0.3 * np.cos(t / 70), 0.3 + 0.05 * np.sin(t / 5), t]
        np.savetxt(path, np.column_stack(columns), delimiter=",", header="x,y,z,t", comments="", fmt="%.9g")
        ov.adapt(np.eye(3), "go left by 0.1", writer="builtin")  # imports and the reader's weights
        laps, started = [], cpu()

        def lap() -> None:
            laps.append(cpu() - started - sum(laps))

        task = ov.load(path)
        lap()
        result = ov.adapt(task, "go left by 0.1", writer="builtin")
        close()  # so that the worker's time counts
        time.sleep(0.5)
        lap()
        ov.save_trajectory(Path(folder) / "out.csv", result.adapted)
        lap()
        result.save(str(Path(folder) / "out.json"))
        lap()
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        seconds = " | ".join(f"{value:.1f}" for value in (*laps, sum(laps)))
        return f"| {points:,} | {result.status} | {seconds} | {peak:.0f} |"


def main() -> None:
    """Do it."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--points", type=int, nargs="*", default=POINTS)
    options.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    given = options.parse_args()
    if given.one:
        print(measured(given.points[0]))
        return
    print("| waypoints | | load, s | adapt, s | save CSV, s | save the result, s | all, s | peak, MB |")
    print("|---|---|---|---|---|---|---|---|")
    for points in given.points:
        subprocess.run([sys.executable, __file__, "--one", "--points", str(points)], check=True)


if __name__ == "__main__":
    main()
