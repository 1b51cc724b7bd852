"""Seeded problems for the constraint module: walks and lines through clusters of objects, in every workspace.

As a script it solves many and checks each: python tests/limits/constraint_scenes.py 2000
"""

import sys
import time
from collections import Counter

import numpy as np

from ovita.limits import ConstraintOptions, constrain
from ovita.limits.path import keep_out
from ovita.limits.problem import obstacles_of
from ovita.paths.robot import Box, Robot, Shell
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory


def path_through(rng, n):
    if rng.random() < 0.4:
        a, b = rng.uniform(-1, 1, (2, 3))
        p = a + (b - a) * np.linspace(0, 1, n)[:, None] + rng.normal(size=(n, 3)) * 0.005 * rng.integers(0, 2)
    else:
        p = rng.normal(size=(n, 3)).cumsum(axis=0) * rng.uniform(0.02, 0.1)
    return p - p.mean(axis=0)


def random_case(seed):
    """Proposed and original trajectory, scene, robot and options."""
    rng = np.random.default_rng(seed)
    n = int(rng.choice([2, 5, 10, 20, 40, 100, 100, 200]))
    p = path_through(rng, n)
    objects = []
    for i in range(int(rng.integers(1, 11))):
        center = p[rng.integers(n)] + rng.normal(size=3) * rng.choice([0, 1e-9, 0.05, 0.2, 0.3, 0.3])
        turned = rng.normal(size=4) if rng.random() < 0.6 else np.array([1.0, 0.0, 0.0, 0.0])
        objects.append(SceneObject(f"o{i}", center, rng.uniform(0.01, 0.4, 3) * rng.choice([0.3, 1.0, 1.0]), turned))
    kind = rng.choice(["none", "box", "shell", "flat"], p=[0.3, 0.3, 0.3, 0.1])
    workspace = None
    if kind == "box":
        workspace = Box((-1.2, -1.2, -1.2), (1.2, 1.2, 1.2))
    elif kind == "shell":
        workspace = Shell(tuple(rng.normal(size=3) * 0.1), 0.15, 1.2)
    elif kind == "flat":
        workspace = Box((-1.5, -1.5, -0.01), (1.5, 1.5, 0.01))
        p = p * [1.0, 1.0, rng.choice([0.0, 1.0])]
    fixed = rng.random(2) < 0.3
    options = ConstraintOptions(
        fix_start=bool(fixed[0]),
        fix_goal=bool(fixed[1]),
        pinned=tuple(int(i) for i in rng.integers(0, n, rng.choice([0, 0, 0, 0, 0, 2]))),
        obstacle_shape=str(rng.choice(["box", "sphere"])),
        lambda_smooth=float(rng.choice([0.0, 0.0, 0.0, 0.1, 3.0])),
        max_acceleration=None if rng.random() < 0.7 else 1.0,
        max_lateral_acceleration=None if rng.random() < 0.7 else 1.0,
    )
    proposed = Trajectory(p, np.abs(rng.normal(size=n)))
    original = Trajectory(p + 0.01, proposed.speeds)
    return proposed, original, Scene(tuple(objects)), Robot(str(kind), workspace), options


def segment_distances(body, x, samples=200):
    """Smallest distance of each segment to a body by brute force, (N-1,); an upper bound of the exact one."""
    t = np.linspace(0, 1, samples)[:, None, None]
    points = x[:-1] + t * np.diff(x, axis=0)
    local = np.abs((points - body.center) @ body.rotation) - body.half
    outside = np.linalg.norm(np.maximum(local, 0), axis=-1) + np.minimum(local.max(axis=-1), 0)
    return outside.min(axis=0) - body.radius


def faults(seed):
    """What is wrong with the answer to a problem, as sentences; and the answer."""
    proposed, original, scene, robot, options = random_case(seed)
    solution = constrain(proposed, scene, robot, original=original, options=options)
    x, verdict, n = solution.trajectory.positions, solution.verdict, len(proposed)
    bodies = (*obstacles_of(scene, robot, shape=options.obstacle_shape), *keep_out(robot))
    pins = list(options.pins(n))
    wrong = []
    if len(solution.trajectory) != n or not np.array_equal(x[pins], proposed.positions[pins]):
        wrong.append("the number of waypoints or a pinned waypoint changed")
    if verdict.status in ("satisfied", "repaired"):
        worst = max([-segment_distances(b, x).min() for b in bodies] + [c.violation_after for c in verdict.checks])
        if worst > 1e-6:
            wrong.append(f"{verdict.status} with a violation of {worst:g}")
    if verdict.status == "infeasible" and not confirmed(x, bodies, robot, pins):
        wrong.append(f"infeasible without a cause: {verdict.conflicts}")
    return wrong, solution


def confirmed(x, bodies, robot, pins):
    """Whether a pinned waypoint, or the line between two pinned neighbours, breaks a limit by itself."""
    if not pins:
        return False
    outside = robot.workspace is not None and (robot.workspace.inside(x[pins]) < robot.margin).any()
    inside = any((body.signed(x[pins])[0] < 0).any() for body in bodies)
    pairs = [i for i in pins if i + 1 in pins]
    between = any((segment_distances(body, x)[pairs] < 0).any() for body in bodies)
    return bool(outside or inside or between)


def main(count):
    status, times, wrong = Counter(), [], 0
    for seed in range(count):
        began = time.process_time()
        found, solution = faults(seed)
        times.append((time.process_time() - began) * 1e3)
        status[solution.verdict.status] += 1
        wrong += len(found)
        for sentence in found:
            print(f"seed {seed}: {sentence}")
    median, high, most = np.percentile(times, [50, 99, 100])
    print(f"{count} problems: {dict(status)}, {wrong} faults")
    print(f"with checks {median:.0f} ms of CPU time median, {high:.0f} ms p99, {most:.0f} ms most")
    return wrong


if __name__ == "__main__":
    sys.exit(bool(main(int(sys.argv[1]) if len(sys.argv) > 1 else 2000)))
