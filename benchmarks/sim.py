"""How well simulated robots follow original and adapted trajectories of a dataset, and how fast the simulation runs.

    python benchmarks/sim.py --dataset PATH [--each 10]

PATH holds the folders Manipulator, Ground_robot and Drone in the public OVITA layout. The first `--each` files of each
folder are adapted by the built-in writer to the limits of the matching preset, and both trajectories are simulated from
one base. Times are CPU times.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
from ovita.sim.stage import build

from ovita import sim
from ovita.chain import adapt
from ovita.io import load_task
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.request import Request
from ovita.sim.arm import Kinematics
from ovita.sim.models import ArmLimits

KINDS = {"Manipulator": ("arm", "iiwa"), "Ground_robot": ("ground", "jackal"), "Drone": ("drone", "crazyflie")}
TARGET = {"iiwa": 0.002, "jackal": 0.05, "crazyflie": 0.05}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dataset", type=Path, required=True)
    parser.add_argument("--each", type=int, default=10, help="files of each folder")
    options = parser.parse_args()
    for folder, (preset, name) in KINDS.items():
        files = sorted(options.dataset.rglob(f"{folder}/*.json"))[: options.each]
        if not files:
            raise SystemExit(f"{options.dataset}: has no files in a folder {folder}")
        table(files, preset, name)
    print(f"\ninverse kinematics of 100 waypoints: {1e3 * kinematics():.1f} ms")


def table(files: list[Path], preset: str, name: str) -> None:
    """Print a line for each trajectory, and the worst of all."""
    print(f"\n### {sim.load_model(name).title}\n")
    print("| file | trajectory | status | rms | max | out of reach | touches | asked | took | real-time factor |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    errors, factors = [], []
    sim.simulate(load_task(files[0]).trajectory, robot=name)
    for file in files:
        task = load_task(file)
        result = adapt(Request(task.instruction, task.trajectory, task.scene, Robot.preset(preset)), writer="builtin")
        paths = {"original": result.original, "adapted": result.adapted}
        base = sim.place(list(paths.values()), result.scene, name, result.robot)
        for label, path in paths.items():
            begun = time.process_time()
            run = sim.simulate(path, result.scene, name, base=base, limits=result.robot, contacts=result.contacts)
            spent = time.process_time() - begun
            report = run.report
            errors.append(report.tracking.rms)
            factors.append(run.motion.duration / spent)
            touched = ", ".join(contact.name for contact in report.contacts) or "-"
            label = label if result.status == "done" else f"{label} ({result.status})"
            print(
                f"| {file.stem} | {label} | {report.status} | {1e3 * report.tracking.rms:.2f} mm "
                f"| {1e3 * report.tracking.max:.1f} mm | {len(report.unreachable)} | {touched} "
                f"| {report.asked:.2f} s | {report.achieved:.2f} s | {factors[-1]:.0f} |"
            )
    within = sum(error <= TARGET[name] for error in errors)
    print(
        f"\n{within} of {len(errors)} within {1e3 * TARGET[name]:g} mm rms; worst {1e3 * max(errors):.2f} mm; "
        f"real-time factor at least {min(factors):.1f}, median {np.median(factors):.0f}"
    )


def kinematics() -> float:
    """CPU time for inverse kinematics of 100 waypoints along a curve, the posture included, best of many [s]."""
    model = sim.load_model("iiwa")
    s = np.linspace(0, 1, 100)
    points = np.column_stack([0.5 + 0.05 * np.sin(5 * s), -0.3 + 0.6 * s, 0.5 + 0.08 * np.cos(4 * s)])
    assert isinstance(model.limits, ArmLimits)
    solver = Kinematics(
        build(model, Scene(), sim.Base(), 0.0), model.limits, Trajectory(points, np.full(100, 0.2)), "auto"
    )
    best = np.inf
    for _ in range(20):
        begun = time.process_time()
        solver.choose()
        best = min(best, time.process_time() - begun)
    return best


if __name__ == "__main__":
    main()
