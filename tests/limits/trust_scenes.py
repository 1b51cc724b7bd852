"""Seeded scenes with instructions for robots with a body, each result checked by code of its own.

No result called done may break a limit, and none may be called infeasible for which a sampler finds a legal path.
As a script: python tests/limits/trust_scenes.py 2000
"""

import sys
import time
from collections import Counter

import numpy as np

from ovita import Request, adapt
from ovita.limits import ConstraintOptions
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory

INSTRUCTIONS = (
    "go left by 0.2",
    "go up by 0.1 and slow down near the {0}",
    "move 0.15 closer to the {0}",
    "get closer to the {0}",
    "keep 0.2 m away from the {0}",
    "move forward by 0.3 in the second half",
    "speed up by 50 percent",
    "stay farther from the {0}",
    "lower the whole path by 0.1",
    "make the path smoother",
    "go right by 0.4 near the {0}",
    "pass above the {0}",
)
NAMES = ("cup", "box", "plate", "person", "bottle", "dog", "chair", "laptop")
LARGER = {"person": 1.0, "dog": 0.3333}
ASSUMED = {"person": 0.5}
SLACK = 1e-5


def problem(seed):
    """A request and the options of one seed."""
    rng = np.random.default_rng(seed)
    n = int(rng.choice([15, 40, 80]))
    planar = bool(rng.random() < 0.25)
    a, b = rng.uniform(-1, 1, (2, 3))
    s = np.linspace(0, 1, n)[:, None]
    x = a + (b - a) * s + np.sin(np.pi * s * rng.integers(1, 3)) * rng.normal(size=3) * 0.2
    if planar:
        x[:, 2] = 0.0
    speeds = np.abs(np.sin(np.linspace(0.3, 2.8, n))) * rng.uniform(0.2, 0.9)
    names = rng.permutation(NAMES)[: rng.integers(1, 5)]
    objects = []
    for name in names:
        at = x[rng.integers(n)] + rng.normal(size=3) * rng.choice([0.1, 0.3, 0.5])
        size = None if rng.random() < 0.2 else rng.uniform(0.03, 0.3, 3)
        turn = rng.normal(size=4) if rng.random() < 0.5 else np.array([1.0, 0, 0, 0])
        objects.append(SceneObject(str(name), at, size, turn))
    robot = Robot(
        "random",
        Box((-2, -2, -2), (2, 2, 2)) if rng.random() < 0.5 else None,
        radius=float(rng.choice([0.03, 0.1, 0.2, 0.33])),
        max_speed=1.0,
        max_acceleration=None if rng.random() < 0.5 else 3.0,
        max_lateral_acceleration=None if rng.random() < 0.5 else 3.0,
        planar=planar,
    )
    options = ConstraintOptions(fix_start=bool(rng.random() < 0.2), fix_goal=bool(rng.random() < 0.2))
    text = str(rng.choice(INSTRUCTIONS)).format(names[0])
    return Request(text, Trajectory(x, speeds), Scene(tuple(objects)), robot), options


def gaps(positions, item, samples=60):
    """Distance of each densely sampled segment to an oriented box, (N-1,) [m]; own formula, no code of ovita's."""
    w, x, y, z = item.orientation / np.linalg.norm(item.orientation)
    turn = np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )
    half = np.full(3, 0.025) if item.dimensions is None else item.dimensions / 2
    t = np.linspace(0, 1, samples)[:, None, None]
    points = positions[:-1] * (1 - t) + positions[1:] * t
    beyond = np.abs((points - item.position) @ turn) - half
    outside = np.sqrt((np.maximum(beyond, 0) ** 2).sum(axis=-1))
    return (outside + np.minimum(beyond.max(axis=-1), 0)).min(axis=0)


def wanted(item, robot):
    """Distance that a body keeps from an object's surface [m]."""
    keep = robot.radius + max(robot.obstacle_margin, LARGER.get(item.name, 0.0) * robot.person_margin)
    return keep + (max(ASSUMED.get(item.name, 0.05) - 0.05, 0) / 2 if item.dimensions is None else 0.0)


def excesses(path, scene, robot, contacts=()):
    """By how much a path breaks each limit at its worst."""
    x, v = path.positions, path.speeds
    found = {o.name: wanted(o, robot) - gaps(x, o).min() for o in scene if o.name not in contacts}
    if robot.workspace is not None:
        lower, upper = np.array(robot.workspace.lower), np.array(robot.workspace.upper)
        found["workspace"] = robot.margin - np.minimum(x - lower, upper - x).min()
    found["speed"] = v.max() - robot.max_speed
    step = np.diff(x, axis=0)
    ds = np.sqrt((step**2).sum(axis=1))
    if robot.max_acceleration:
        moving = ds > 1e-9
        along = np.abs(np.diff(v**2))[moving] / (2 * ds[moving])
        found["acceleration"] = (along - robot.max_acceleration).max(initial=0.0)
    if robot.max_lateral_acceleration:
        a, b, c = ds[:-1], ds[1:], np.sqrt(((x[2:] - x[:-2]) ** 2).sum(axis=1))
        area = np.sqrt((np.cross(step[:-1], step[1:]) ** 2).sum(axis=1))
        bend = np.where(a * b * c > 1e-12, 2 * area / np.maximum(a * b * c, 1e-12), 0.0)
        found["across"] = (v[1:-1] ** 2 * bend - robot.max_lateral_acceleration).max(initial=0.0)
    if robot.planar:
        found["plane"] = np.ptp(x[:, 2])
    return found


def sampled(result, options, tries=300):
    """Whether random polylines between the pinned ends, or anywhere, hold a legal path."""
    rng = np.random.default_rng(0)
    n, robot = len(result.proposed), result.robot
    pins = [i for i, pinned in ((0, options.fix_start), (-1, options.fix_goal)) if pinned]
    there = Trajectory(result.proposed.positions[pins * 2], np.zeros(len(pins) * 2)) if pins else None
    still = there is None or len(pins) == 2  # one pinned point, as a path that stays there
    if not still and max(excesses(there, result.scene, robot, result.contacts).values()) > 0:
        return False
    reach = result.proposed.positions.min(axis=0) - 0.7, result.proposed.positions.max(axis=0) + 0.7
    for _ in range(tries):
        corners = rng.uniform(*reach, (int(rng.integers(2, 5)), 3))
        if robot.planar:
            corners[:, 2] = result.original.positions[0, 2]
        if options.fix_start:
            corners[0] = result.proposed.positions[0]
        if options.fix_goal:
            corners[-1] = result.proposed.positions[-1]
        at = np.linspace(0, len(corners) - 1, n)
        x = np.column_stack([np.interp(at, np.arange(len(corners)), corners[:, k]) for k in range(3)])
        path = Trajectory(x, np.zeros(n))
        if max(excesses(path, result.scene, robot, result.contacts).values()) <= 0:
            return True
    return False


def judge(seed):
    """The result's status, and what is wrong with it as sentences."""
    request, options = problem(seed)
    result = adapt(request, writer="builtin", constraints=options)
    if result.status in ("needs_clarification", "not_understood", "failed"):
        return result.status, []
    wrong = []
    after = excesses(result.adapted, request.scene, request.robot, result.contacts)
    before = excesses(request.trajectory, request.scene, request.robot, result.contacts)
    if result.status == "infeasible":
        return result.status, ["infeasible, but a sampler finds a legal path"] if sampled(result, options) else []
    for name, amount in after.items():
        allowed = SLACK
        if result.status != "done":  # a limited result says that the original broke it already
            allowed = max(SLACK, before[name] + SLACK)
        if amount > allowed:
            wrong.append(f"{result.status}, but {name} is broken by {amount:.2g}: {request.instruction}")
    return result.status, wrong


def main(count, first=0):
    status, faults, began = Counter(), [], time.process_time()
    for seed in range(first, first + count):
        name, wrong = judge(seed)
        status[name] += 1
        faults += [f"seed {seed}: {text}" for text in wrong]
    print("\n".join(faults[:40]))
    each = (time.process_time() - began) / count * 1e3
    print(f"{count} scenes and instructions: {dict(status)}; {len(faults)} faults; {each:.0f} ms of CPU time each")
    return len(faults)


if __name__ == "__main__":
    sys.exit(bool(main(*map(int, sys.argv[1:] or ["2000"]))))
