"""The studio under load: knobs over its own protocol, with memory and descriptors watched.

Every change goes the whole way on the server: message in, policy in the sandbox, limits, report, lines and texts out.
Run with a number to turn so many knobs at N = 100 (default 1000).
"""

from __future__ import annotations

import gc
import json
import os
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "studio"))

from studio_tab import Tab

from ovita.dialogue.session import Session
from ovita.paths.trajectory import Trajectory
from ovita.studio import Studio, StudioSettings

SAY = "Go left by 0.2 and slow down near the cup"


def scene(folder: Path, n: int) -> str:
    t = np.linspace(0, 1, n)
    rows = np.column_stack([t, 0.1 * np.sin(3 * t), 0.3 + 0.1 * np.cos(5 * t), np.full(n, 0.3)])
    cup = {"name": "cup", "x": 0.5, "y": 0.4, "z": 0.3, "dimensions": [0.1, 0.1, 0.1]}
    path = folder / f"scene-{n}.json"
    path.write_text(json.dumps({"trajectory": rows.tolist(), "objects": [cup]}))
    return str(path)


def studio_for(folder: Path, n: int) -> Studio:
    template = Session(Trajectory(np.array([[0.0, 0, 0], [1.0, 0, 0]]), np.array([0.1, 0.1])), writer="builtin")
    return Studio(StudioSettings(template, (scene(folder, n),), port=0, folder=folder / f"sessions-{n}"))


def adapted(tab: Tab) -> Tab:
    tab.ready()
    tab.say(SAY)
    tab.wait(lambda: tab.points("/lines/adapted") is not None and tab.find("left [m]"), 30)
    return tab


def turn(tab: Tab, value: float) -> float:
    """Turn a knob and wait until the line has come; milliseconds."""
    start = time.perf_counter()
    tab.set("left [m]", value)
    wanted = tab.points("/lines/original")[0, 0, 0] - value
    tab.wait(lambda: abs(tab.points("/lines/adapted")[0, 0, 0] - wanted) < 1e-6, 30)
    return (time.perf_counter() - start) * 1e3


def memory() -> float:
    """Resident memory [MiB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def descriptors() -> int:
    return len(os.listdir("/proc/self/fd"))


def knobs(folder: Path, n: int, count: int) -> bool:
    studio = studio_for(folder, n)
    tab = adapted(Tab(studio.url))
    values = np.random.default_rng(0).uniform(0.05, 0.45, count).round(4)
    for value in values[: count // 5]:
        turn(tab, float(value))
    gc.collect()
    before, opened, threads = memory(), descriptors(), threading.active_count()
    begun = time.process_time()
    took = [turn(tab, float(value)) for value in values]
    spent = (time.process_time() - begun) / count * 1e3
    gc.collect()
    grown, more = memory() - before, descriptors() - opened
    p50, p95 = np.percentile(took, [50, 95])
    limit = 60 if n <= 100 else 150
    print(
        f"N={n:5d}  {count} changes: median {p50:6.1f} ms  p95 {p95:6.1f} ms (limit {limit})  CPU {spent:.1f} ms"
        f"  memory {grown:+.1f} MiB"
        f"  descriptors {more:+d}  threads {threading.active_count() - threads:+d}"
        f"  turns kept {len(studio.views[0].controller.session.history.steps)}"
    )
    tab.close()
    studio.stop()
    return bool(p95 < limit and grown < 20 and more <= 2)


def many(folder: Path, users: int) -> bool:
    """Ten browsers turn knobs at once."""
    studio = studio_for(folder, 100)
    tabs = [adapted(Tab(studio.url)) for _ in range(users)]
    took: list[float] = []

    def busy(tab: Tab, seed: int) -> None:
        for value in np.random.default_rng(seed).uniform(0.05, 0.45, 20).round(4):
            took.append(turn(tab, float(value)))
            time.sleep(0.1)

    threads = [threading.Thread(target=busy, args=(tab, i)) for i, tab in enumerate(tabs)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    p50, p95 = np.percentile(took, [50, 95])
    print(f"{users} browsers at once: median {p50:6.1f} ms  p95 {p95:6.1f} ms, tabs included")
    for tab in tabs:
        tab.close()
    studio.stop()
    return bool(p95 < 1000)


def main() -> int:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        held = [knobs(folder, 100, count), knobs(folder, 5000, max(count // 10, 20)), many(folder, 10)]
    return 0 if all(held) else 1


if __name__ == "__main__":
    raise SystemExit(main())
