"""The trip of one instruction: which files it enters, in which order, and how long it takes.

    python benchmarks/trip.py                      # the trip, and milliseconds by stage
    python benchmarks/trip.py --against ../before   # and the whole process next to an earlier checkout's, interleaved

The trip is that of the command `ovita adapt scene.json "go left by 0.2"` with the built-in writer, in one process whose
imports are done; a file counts once a function of it is called.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import redirect_stdout, suppress
from importlib.resources import files
from pathlib import Path
from typing import Any

INSTRUCTION = "go left by 0.2"

WHERE_MODELS_RUN = "writers/models/catalogue"
"""Entered where the extra `local` is installed alone: is there a model on this machine? It is not counted."""


def files_entered(scene: Path) -> list[str]:
    """The files that the command enters, in order."""
    import ovita
    from ovita.cli.main import cli

    root = str(Path(ovita.__file__).parent)
    entered: dict[str, None] = {}

    def look(frame: Any, event: str, _: Any) -> None:
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(root) and code.co_name not in ("<module>", "__getattr__"):
            entered[code.co_filename[len(root) + 1 : -3].removesuffix("/__init__")] = None

    command = ["adapt", str(scene), INSTRUCTION, "-o", str(scene.with_name("result.json"))]
    usual = sys.getprofile()
    for watched in (False, True):  # the first run imports, which is no part of the trip
        with open(os.devnull, "w") as nowhere, redirect_stdout(nowhere), suppress(SystemExit):
            sys.setprofile(look if watched else usual)
            cli(command, standalone_mode=False)
        sys.setprofile(usual)
    return [name for name in entered if name != WHERE_MODELS_RUN]


def timed(scene: Path) -> tuple[dict[str, float], list[float]]:
    """Milliseconds by stage of a call, and of 60 warm calls at 100 waypoints each."""
    import ovita
    from ovita.io import load_task
    from ovita.paths.trajectory import Trajectory

    task = load_task(str(scene))
    rows = task.trajectory.to_array()
    index = [round(i * (len(rows) - 1) / 99) for i in range(100)]
    request = ovita.Request(INSTRUCTION, Trajectory.from_array(rows[index]), task.scene)
    took, result = [], None
    for _ in range(60):
        started = time.process_time()
        result = ovita.adapt(request, writer="builtin")
        took.append((time.process_time() - started) * 1e3)
    assert result is not None and threading.active_count() == 1
    return dict(result.timings_ms), took


def cold(source: str, scene: Path) -> tuple[float, float]:
    """Wall time and CPU time of the whole command in a process of its own, its children included [s]."""
    environment = {**os.environ, "PYTHONPATH": source}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # compiled, as a package is after it was installed
    command = [sys.executable, "-m", "ovita", "adapt", str(scene), INSTRUCTION, "-o", str(scene.with_name("r.json"))]
    before, started = os.times(), time.perf_counter()
    subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
    after = os.times()
    cpu = after.children_user + after.children_system - before.children_user - before.children_system
    return time.perf_counter() - started, cpu


def main() -> None:
    """Print the trip."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--against", metavar="FOLDER", help="an earlier checkout to compare the whole process with")
    parser.add_argument("--runs", type=int, default=7)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.json"
        scene.write_text((files("ovita") / "data" / "tabletop.json").read_text(encoding="utf-8"), encoding="utf-8")
        entered = files_entered(scene)
        stages, took = timed(scene)
        print(f"{len(entered)} files are entered:\n  {' > '.join(entered)}")
        print("warm, by stage [ms]: " + ", ".join(f"{stage} {ms:.1f}" for stage, ms in stages.items()))
        p95 = statistics.quantiles(took, n=20)[-1]
        print(f"warm, 100 waypoints, CPU time [ms]: median {statistics.median(took):.1f}, p95 {p95:.1f}")
        import ovita

        here = str(Path(ovita.__file__).parents[1])
        checkouts = {"this checkout": here}
        if options.against:
            checkouts[options.against] = str(Path(options.against).resolve() / "src")
        for source in checkouts.values():
            cold(source, scene)
        times = {name: [] for name in checkouts}  # type: dict[str, list[tuple[float, float]]]
        for _ in range(options.runs):
            for name, source in checkouts.items():
                times[name].append(cold(source, scene))
        medians = {}
        for name, found in times.items():
            wall, cpu = (statistics.median(values) for values in zip(*found, strict=True))
            medians[name] = wall, cpu
            print(f"cold, whole process, {name} [s]: wall {wall:.2f}, CPU {cpu:.2f} (median of {len(found)})")
        if options.against:
            (wall, cpu), (before_wall, before_cpu) = medians.values()
            print(f"ratio: wall {wall / before_wall:.2f}, CPU {cpu / before_cpu:.2f}")


if __name__ == "__main__":
    main()
