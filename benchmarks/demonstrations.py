"""Skills from demonstrations, beside public implementations fed with the same aligned demonstrations.

    python benchmarks/demonstrations.py [--references PYTHON] [--small]

Shapes in the manner of the LASA handwriting set, but of our own making: a curve that is known, shown seven times with
other paces, smooth ways off it, starts that differ, and the noise of a hand. Since the curve is known, errors are
against it, in percent of its extent.

PYTHON is an interpreter that has gmr, movement-primitives (with pytransform3d, tqdm) and lc-ns-kmp; without it, only
ours are measured.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ovita.io import Task
from ovita.paths.geometry import extent
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory
from ovita.sources.demonstrations import aligned
from ovita.sources.learning import learn
from ovita.sources.skills import KINDS, SkillKind

SHOWN = 7
VIA, ENDS = 0.10, 0.15
"""How far via-points and ends are moved, as shares of the shape's extent."""

Curve = Callable[[Array], Array]
Paths = dict[str, Any]
"""Rows of positions by question, None where a method has no answer."""


def _bent(*points: tuple[float, float, float]) -> Curve:
    """A Bezier curve through control points."""

    def curve(s: Array) -> Array:
        rows = [np.tile(np.array(point), (len(s), 1)) for point in points]
        while len(rows) > 1:
            rows = [a + s[:, None] * (b - a) for a, b in pairwise(rows)]
        return rows[0]

    return curve


SHAPES: dict[str, Curve] = {
    "sine": lambda s: np.stack([0.6 * s, 0.15 * np.sin(2 * np.pi * s), 0.2 + 0 * s], axis=1),
    "swing": lambda s: np.stack([0.6 * s, 0.15 * np.sin(2 * np.pi * s), 0.2 + 0.1 * np.sin(np.pi * s)], axis=1),
    "arc": lambda s: 0.3 * np.stack([np.cos(np.pi * s), np.sin(np.pi * s), 0.5 * s], axis=1),
    "spiral": lambda s: (0.1 + 0.2 * s)[:, None] * np.stack([np.cos(7 * s), np.sin(7 * s), s], axis=1),
    "angle": lambda s: np.stack([0.5 * s, 0.4 * (1.0 - np.sqrt((2 * s - 1) ** 2 + 0.01)), 0.1 * s], axis=1),
    "hook": _bent((0, 0, 0.1), (0.5, 0, 0.4), (0.7, 0.5, 0.3), (0.1, 0.5, 0.2), (0.2, 0.2, 0.1)),
    "loop": _bent((0, 0, 0.2), (0.9, 0.1, 0.3), (0.5, 0.7, 0.4), (-0.3, 0.3, 0.2), (0.6, 0, 0.1)),
    "reach": _bent((0, 0, 0.05), (0, 0, 0.4), (0.5, 0.3, 0.4), (0.5, 0.3, 0.05)),
}


def demonstrations(curve: Curve, seed: int) -> list[Trajectory]:
    """The shape shown several times."""
    rng = np.random.default_rng(seed)
    size = extent(curve(np.linspace(0, 1, 201)))
    shown = []
    for _ in range(SHOWN):
        t = np.linspace(0.0, 1.0, int(rng.integers(70, 130)))
        s = t ** rng.uniform(0.75, 1.35)
        ways = np.sin(np.pi * np.outer(s, [0.5, 1, 2, 3]))
        ways[:, 0] = np.cos(0.5 * np.pi * s)  # demonstrations end together, and start apart
        off = ways @ rng.normal(0.0, 0.025 * size, (4, 3)) + rng.normal(0.0, 0.001 * size, (len(s), 3))
        speeds = np.full(len(s), 0.2)
        shown.append(Trajectory(curve(s) + off, speeds))
    return shown


def even(positions: Array, count: int = 201) -> Array:
    """A path as evenly spaced points, so that paces do not count."""
    return Trajectory(positions, np.ones(len(positions))).resample(count).positions


def gap(path: Array, truth: Array, size: float) -> float:
    """Mean distance of two paths at the same share of their lengths, in percent of a size."""
    return float(100.0 * np.linalg.norm(even(path) - even(truth), axis=1).mean() / size)


def measured(paths: Paths, wanted: dict[str, Array], size: float) -> dict[str, float]:
    """Errors in percent: of the mean, at and away from the via-point, at other ends and of the shape between them."""
    got = {name: None if path is None else np.array(path) for name, path in paths.items()}
    found = dict.fromkeys(("mean", "via", "beside", "ends", "shape"), np.nan)
    mean = got["mean"]
    assert mean is not None
    found["mean"] = gap(mean, wanted["mean"], size)
    if (bent := got["via"]) is not None:
        found["via"] = 100.0 * float(np.linalg.norm(bent - wanted["via"], axis=1).min()) / size
        away = np.abs(np.linspace(0.0, 1.0, len(bent)) - 0.5) > 0.3
        found["beside"] = 100.0 * float(np.linalg.norm(bent - mean, axis=1)[away].mean()) / size
    if (led := got["ends"]) is not None:
        found["ends"] = 100.0 * float(np.linalg.norm(led[[0, -1]] - wanted["ends"][[0, -1]], axis=1).max()) / size
        found["shape"] = gap(led, wanted["ends"], size)
    return found


def questions(curve: Curve, seed: int, phases: Array, mean: Array) -> dict[str, Array]:
    """What is asked of every method: the curve, a via-point off the mean at half time, the curve between other ends."""
    rng = np.random.default_rng(seed + 1000)
    fine = np.linspace(0.0, 1.0, 201)
    truth = curve(fine)
    size = extent(truth)
    by = [direction / np.linalg.norm(direction) * size for direction in rng.normal(size=(3, 3))]
    start, goal = ENDS * by[0], ENDS * by[1]
    moved = truth + (1.0 - fine)[:, None] * start + fine[:, None] * goal
    return {"mean": truth, "via": mean[len(phases) // 2] + VIA * by[2], "ends": moved}


def ours(kind: SkillKind, shown: Sequence[Trajectory], wanted: dict[str, Array]) -> Paths:
    """What our skills generate."""
    skill = learn(list(shown), kind)
    ends = skill.generate(start=wanted["ends"][0], goal=wanted["ends"][-1])
    via = None if kind == "dmp" else skill.generate(via={0.5: wanted["via"]}).trajectory.positions.tolist()
    mean = skill.generate().trajectory.positions.tolist()
    return {"mean": mean, "via": via, "ends": ends.trajectory.positions.tolist()}


def theirs(python: str, cases: list[dict[str, object]]) -> list[dict[str, Paths]]:
    """What the public implementations generate, in an interpreter of their own."""
    script = Path(__file__).with_name("reference_primitives.py")
    with tempfile.TemporaryDirectory() as folder:
        asked, answered = Path(folder, "asked.json"), Path(folder, "answered.json")
        asked.write_text(json.dumps(cases))
        environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        subprocess.run([python, str(script), str(asked), str(answered)], check=True, env=environment, timeout=900)
        return list(json.loads(answered.read_text()))


def shapes(names: Sequence[str], references: str | None) -> dict[str, dict[str, float]]:
    """Mean errors of every method over the shapes, and CPU time of learning and generating [ms]."""
    rows: dict[str, list[dict[str, float]]] = {}
    cases: list[dict[str, object]] = []
    asked = []
    for seed, name in enumerate(names):
        shown = demonstrations(SHAPES[name], seed)
        together = aligned(shown, [one.positions for one in shown])
        wanted = questions(SHAPES[name], seed, together.phases, together.positions.mean(axis=0))
        size = extent(wanted["mean"])
        asked.append((wanted, size))
        for kind in KINDS:
            began = time.process_time()
            paths = ours(kind, shown, wanted)
            took = 1e3 * (time.process_time() - began)
            rows.setdefault(f"ovita {kind}", []).append({**measured(paths, wanted, size), "ms": took})
        cases.append(
            {
                "phases": together.phases.tolist(),
                "rows": together.positions.tolist(),
                "via": wanted["via"].tolist(),
                "start": wanted["ends"][0].tolist(),
                "goal": wanted["ends"][-1].tolist(),
            }
        )
    if references:
        for answer, (wanted, size) in zip(theirs(references, cases), asked, strict=True):
            for method, paths in answer.items():
                took = paths.pop("ms")
                rows.setdefault(method, []).append({**measured(paths, wanted, size), "ms": took})
    return {
        name: {key: float(np.mean([one[key] for one in found])) for key in found[0]} for name, found in rows.items()
    }


def reaching(seed: int, turned: float) -> Task:
    """From a cup, out of its side, over and down to a plate, wherever these stand and however they are turned [rad]."""
    rng = np.random.default_rng(seed)
    places = {"cup": rng.uniform([-0.1, -0.1, 0], [0.1, 0.1, 0]), "plate": rng.uniform([0.5, 0.2, 0], [0.7, 0.5, 0])}
    objects, points = [], []
    for (name, place), out in zip(places.items(), ((0.0, -0.1, 0.0), (0.0, 0.0, 0.15)), strict=True):
        yaw = rng.uniform(-turned, turned)
        c, s = np.cos(yaw), np.sin(yaw)
        points += [place, place + np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array(out)]
        objects.append(SceneObject(name, place, orientation=np.array([np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)])))
    path = _bent(*(tuple(points[i]) for i in (0, 1, 3, 2)))(np.linspace(0.0, 1.0, 80))
    ways = np.sin(np.pi * np.outer(np.linspace(0, 1, 80), [1, 2, 3])) @ rng.normal(0.0, 0.004, (3, 3))
    return Task(Trajectory(path + ways, np.full(80, 0.2)), Scene(tuple(objects)))


def moved_frames(scenes: int, turned: float) -> dict[str, tuple[float, float]]:
    """Mean and largest error [mm] on scenes that were not shown."""
    shown = [reaching(seed, turned) for seed in range(8)]
    skills = {
        "ovita kmp, frames": (learn(shown, "kmp", frames=("cup", "plate")), False),
        "ovita tpgmm, frames": (learn(shown, "tpgmm", frames=("cup", "plate")), False),
        "ovita kmp, told its ends": (learn(shown, "kmp"), True),
        "ovita dmp, told its ends": (learn(shown, "dmp"), True),
        "ovita kmp, as shown": (learn(shown, "kmp"), False),
    }
    found: dict[str, list[float]] = {name: [] for name in skills}
    for seed in range(100, 100 + scenes):
        there = reaching(seed, turned)
        truth = there.trajectory.positions
        for name, (skill, told) in skills.items():
            ends = {"start": truth[0], "goal": truth[-1]} if told else {}
            path = skill.generate(scene=there.scene, **ends).trajectory.positions
            found[name].append(10.0 * gap(path, truth, 1.0))
    return {name: (float(np.mean(errors)), float(np.max(errors))) for name, errors in found.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--references", metavar="PYTHON", help="interpreter with the public implementations")
    parser.add_argument("--small", action="store_true", help="two shapes and three scenes")
    options = parser.parse_args()
    names = list(SHAPES)[:2] if options.small else list(SHAPES)
    print(f"{len(names)} shapes, {SHOWN} demonstrations each; errors in % of the shape's extent, means over shapes\n")
    print("| method | mean path | via-point | 0.3 away from it | other ends | shape between them | CPU [ms] |")
    print("|---|---|---|---|---|---|---|")
    for name, row in shapes(names, options.references).items():
        cells = [
            f"{row[key]:.2f}" if np.isfinite(row[key]) else "" for key in ("mean", "via", "beside", "ends", "shape")
        ]
        print(f"| {name} | {' | '.join(cells)} | {row['ms']:.0f} |")
    scenes = 3 if options.small else 20
    for turned in (0.0, 0.7):
        print(f"\nA cup and a plate that moved, turned by up to {turned:g} rad: {scenes} new scenes; error [mm]\n")
        print("| skill | mean | largest |\n|---|---|---|")
        for name, (mean, largest) in moved_frames(scenes, turned).items():
            print(f"| {name} | {mean:.1f} | {largest:.1f} |")


if __name__ == "__main__":
    sys.exit(main())
