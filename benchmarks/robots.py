"""Two tables of docs/robots.md: gaps at the start of an arm's motion, and 30 simulations, calm and disturbed.

python benchmarks/robots.py starts --n 10
python benchmarks/robots.py disturbed --n 10
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import numpy as np

from ovita import sim
from ovita.errors import RequestError
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory
from ovita.sim.joints import joint_motion, start_problem, tool_path
from ovita.sim.simulate import simulate

ROBOT = Robot("cell", Box((-2.0, -2.0, 0.02), (2.0, 2.0, 2.0)), max_speed=0.5)
POST = SceneObject("post", [0.3, 0.45, 0.3], [0.05, 0.05, 0.6])
SCENE = Scene((POST,), Frame("flu"))
GAPS = (0.0, 0.005, 0.02, 0.3, 1.2)
"""Of the joint that is farthest from the start [rad]."""

DISTURBED = {
    "iiwa": ("1 mrad, 10 ms delay, 1 kg", sim.Disturbances(noise=0.001, delay=0.01, payload=1.0)),
    "jackal": ("1 cm, 20 ms delay, 50 ms lag", sim.Disturbances(noise=0.01, delay=0.02, lag=0.05)),
    "crazyflie": (
        "5 mm, 10 ms delay, 20 ms lag, wind 1 m/s, gusts 0.5 m/s",
        sim.Disturbances(noise=0.005, delay=0.01, lag=0.02, wind=(1.0, 0.0, 0.0), gust=0.5),
    ),
}


def paths(n: int, flat: bool = False) -> Iterator[Trajectory]:
    """Gentle random curves in front of an arm, or on the ground."""
    rng = np.random.default_rng(3)
    for _ in range(n):
        turn = rng.uniform(-np.pi, np.pi, 3)
        s = np.linspace(0.0, 1.0, 20)[:, None]
        points = np.array([0.5, 0.0, 0.45]) + 0.06 * np.sin(2.0 * s + turn) + s * rng.uniform(-0.1, 0.1, 3)
        yield Trajectory(points * ([6.0, 6.0, 0.0] if flat else [1.0, 1.0, 1.0]), np.full(20, 0.3 if flat else 0.15))


def starts(n: int) -> None:
    """Print what becomes of each gap: accepted, refused, bridged, and how the bridge keeps its limits."""
    from ovita.sources.approach import approach

    model, base, rng = sim.load_model("iiwa"), sim.Base(), np.random.default_rng(4)
    motions = [joint_motion(path, SCENE, model, base=base)[0] for path in paths(n)]
    print("| gap [rad] | starts at once | refused | approach found | joint speed / limit | tip [m/s] | post [mm] |")
    print("|---|---|---|---|---|---|---|")
    limits = np.array(model.limits.velocity)  # type: ignore[union-attr]
    for gap in GAPS:
        refused, found, share, speed, near = 0, 0, 0.0, 0.0, np.inf
        for motion in motions:
            off = rng.uniform(-1.0, 1.0, 7)
            state: Array = motion.positions[0] + gap * off / np.abs(off).max()
            if start_problem(motion, state) is None:
                continue
            refused += 1
            try:
                whole = approach(motion, state, model, SCENE, base, ROBOT)
            except RequestError:
                continue
            found += 1
            steps = len(whole.times) - len(motion.times)
            rates = np.abs(np.diff(whole.positions[: steps + 1], axis=0)) / np.diff(whole.times[: steps + 1])[:, None]
            tips = tool_path(whole, model, base=base).positions[: steps + 1]
            moved = np.linalg.norm(np.diff(tips, axis=0), axis=1) / np.diff(whole.times[: steps + 1])
            share, speed = max(share, float((rates / limits).max())), max(speed, float(moved.max()))
            near = min(near, float(POST.clearance(tips).min()))
        tail = f"{share:.2f} | {speed:.2f} | {1e3 * near:.0f}" if found else "| |"
        print(f"| {gap:g} | {n - refused} of {n} | {refused} | {found} of {refused} | {tail} |")


def disturbed(n: int) -> None:
    """Print how n motions of each robot go, calm and disturbed."""
    print("| robot | disturbed by | followed | rms, median and worst [mm] | largest error [mm] |")
    print("|---|---|---|---|---|")
    for robot, (told, wanted) in DISTURBED.items():
        base = sim.Base() if robot == "iiwa" else None
        for name, what in (("nothing", sim.Disturbances()), (told, wanted)):
            found = [
                simulate(path, Scene(frame=Frame("flu")), robot, base=base, disturbances=what).report
                for path in paths(n, flat=robot == "jackal")
            ]
            rms = 1e3 * np.array([report.tracking.rms for report in found])
            worst = 1e3 * max(report.tracking.max for report in found)
            good = sum(report.status not in sim.FAILED for report in found)
            print(f"| {robot} | {name} | {good} of {n} | {np.median(rms):.2g}, {rms.max():.2g} | {worst:.2g} |")


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", choices=["starts", "disturbed"])
    parser.add_argument("--n", type=int, default=10)
    asked = parser.parse_args()
    (starts if asked.table == "starts" else disturbed)(asked.n)


if __name__ == "__main__":
    main()
