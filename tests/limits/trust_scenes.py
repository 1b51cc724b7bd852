"""Seeded scenes with instructions for robots with a body, each result checked by code of its own.

No result called done may break a limit, and none may be called infeasible for which a sampler finds a legal path.
As a script: python tests/limits/trust_scenes.py COUNT FIRST LOG, where a run that was broken off goes on from its log.
"""

import json
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

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


DOORWAYS = 0.15
"""Share of the scenes with a wall across the path, which has a doorway in it."""


def doorway(x, rng):
    """Two plates across the middle of a path, a doorway of 0.1 to 1 m between them."""
    k = int(np.abs(x[-1, :2] - x[0, :2]).argmax())
    at, aside, wide = (x[0] + x[-1]) / 2, 1 - k, rng.uniform(0.05, 0.5)
    size = np.array([4.0, 4.0, 6.0])
    size[k] = 0.05
    plates = []
    for name, side in (("left plate", -1), ("right plate", 1)):
        centre = np.array(at)
        centre[aside] += side * (wide + 2.0) + rng.normal() * 0.05
        plates.append(SceneObject(name, centre, size))
    return plates


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
    if rng.random() < DOORWAYS:
        objects += doorway(x, rng)
    options = ConstraintOptions(fix_start=bool(rng.random() < 0.2), fix_goal=bool(rng.random() < 0.2))
    text = str(rng.choice(INSTRUCTIONS)).format(names[0])
    return Request(text, Trajectory(x, speeds), Scene(tuple(objects)), robot), options


def turn(item):
    """Rotation matrix (3, 3) of an object; own formula, no code of ovita's."""
    w, x, y, z = item.orientation / np.linalg.norm(item.orientation)
    return np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )


def sized(scene, robot, path):
    """The scene as limits.md says that it is measured: an object without dimensions is a cube of 5 cm.

    Where the path before the change leaves less room, the ball around the cube takes half of the room that is left.
    """
    objects, t = [], np.linspace(0, 1, 400)[:, None, None]
    dense = path.positions[:-1] * (1 - t) + path.positions[1:] * t
    for item in scene:
        if item.dimensions is None:
            centre = np.sqrt(((dense - item.position) ** 2).sum(axis=-1)).min()
            room = max(centre - robot.radius - robot.obstacle_margin, 0.0)
            edge = min(0.05, room / np.sqrt(3))
            item = SceneObject(item.name, item.position, np.full(3, edge), item.orientation, extra={"guessed": True})
        objects.append(item)
    return objects


def distance(points, item):
    """Distance of points (..., 3) to an oriented box, negative inside [m]."""
    half = item.dimensions / 2
    beyond = np.abs((points - item.position) @ turn(item)) - half
    return np.sqrt((np.maximum(beyond, 0) ** 2).sum(axis=-1)) + np.minimum(beyond.max(axis=-1), 0)


def gaps(positions, item, samples=60):
    """Distance of each densely sampled segment to an oriented box, (N-1,) [m]."""
    t = np.linspace(0, 1, samples)[:, None, None]
    return distance(positions[:-1] * (1 - t) + positions[1:] * t, item).min(axis=0)


def wanted(item, robot):
    """Distance that a body keeps from an object's surface [m]."""
    keep = robot.radius + max(robot.obstacle_margin, LARGER.get(item.name, 0.0) * robot.person_margin)
    return keep + (max(ASSUMED.get(item.name, 0.0) - item.dimensions[0], 0.0) / 2 if "guessed" in item.extra else 0.0)


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


class Room:
    """Where a body may be under the limits that a result was judged by, as far as they are about places.

    At rest a path keeps every limit on speed and acceleration, so that a legal path is one that is legal in its places.
    A person may be passed as near as the original path did.
    """

    def __init__(self, result):
        robot, start = result.robot, result.original.positions
        least = robot.radius + robot.obstacle_margin
        self.level = start[0, 2] if robot.planar else None
        self.bodies = []
        for item in sized(result.scene, robot, result.original):
            keep = wanted(item, robot)
            if item.name in LARGER and "guessed" not in item.extra:
                keep = min(keep, max(gaps(start, item).min(), least))
            if item.name not in result.contacts:
                self.bodies.append((item, keep))
        bounds = robot.workspace and (np.array(robot.workspace.lower), np.array(robot.workspace.upper))
        self.bounds = bounds and (bounds[0] + robot.margin, bounds[1] - robot.margin)

    def slack(self, points):
        """How far points (K, 3) are from breaking a limit [m]; it changes by no more than the points move."""
        found = [distance(points, item) - keep for item, keep in self.bodies] or [np.full(points.shape[:-1], 9.0)]
        if self.bounds is not None:
            found.append(np.minimum(points - self.bounds[0], self.bounds[1] - points).min(axis=-1))
        return np.min(found, axis=0)

    def clear(self, starts, ends, finest=0.004):
        """Which segments are legal in every point: halved until the slack in the middle covers each piece."""
        legal, edge = np.ones(len(starts), dtype=bool), np.arange(len(starts))
        while len(edge):
            middle, half = (starts + ends) / 2, np.linalg.norm(ends - starts, axis=1) / 2
            slack = self.slack(middle)
            legal[edge[(slack < 0) | ((slack < half) & (half < finest))]] = False
            open_ = (slack < half) & legal[edge]
            starts, ends = np.concatenate([starts[open_], middle[open_]]), np.concatenate([middle[open_], ends[open_]])
            edge = np.concatenate([edge[open_], edge[open_]])
        return legal

    def places(self, around, rng, scattered=300, beside=50):
        """Legal points (K, 3): some anywhere near, some right beside each body."""
        low, high = around.min(axis=0) - 1.0, around.max(axis=0) + 1.0
        found = [rng.uniform(low, high, (scattered, 3))]
        for item, keep in self.bodies:
            ray = rng.normal(size=(beside, 3)) * (1, 1, self.level is None)
            ray /= np.linalg.norm(ray, axis=1)[:, None]
            origin = item.position if self.level is None else np.array([*item.position[:2], self.level])
            near, far = np.zeros(beside), np.full(beside, 4.0)
            for _ in range(25):
                middle = (near + far) / 2
                inside = distance(origin + middle[:, None] * ray, item) < keep + 0.01
                near, far = np.where(inside, middle, near), np.where(inside, far, middle)
            found.append(origin + far[:, None] * ray)
        points = np.concatenate(found)
        if self.level is not None:
            points[:, 2] = self.level
        return points[self.slack(points) > 0]


def sampled(result, options):
    """Whether a legal path is found: a road map of sampled places, its edges proven, searched from pin to pin."""
    room, rng = Room(result), np.random.default_rng(0)
    path = result.proposed.positions
    pins = path[[i for i, pinned in ((0, options.fix_start), (-1, options.fix_goal)) if pinned]]
    if room.level is not None and len(pins) and np.abs(pins[:, 2] - room.level).max() > 1e-9:
        return False
    if len(pins) and room.slack(pins).min() < 0:
        return False
    places = room.places(np.concatenate([path, [item.position for item, _ in room.bodies] or path]), rng)
    if len(pins) < 2:
        return bool(len(pins) or len(places))  # a path that stays at one place
    points = np.concatenate([pins, places])
    apart = np.linalg.norm(points[:, None] - points[None], axis=-1)
    closest = np.argsort(apart, axis=1)[:, 1:25]
    one, other = np.repeat(np.arange(len(points)), closest.shape[1]), closest.ravel()
    one, other = np.concatenate([one, np.zeros(len(points), int)]), np.concatenate([other, np.arange(len(points))])
    legal = room.clear(points[one], points[other])
    graph = csr_matrix((np.ones(legal.sum()), (one[legal], other[legal])), shape=(len(points),) * 2)
    return bool(dijkstra(graph, directed=False, unweighted=True, indices=0)[1] <= len(path) - 1)


def judge(seed):
    """The result's status, and what is wrong with it as sentences."""
    request, options = problem(seed)
    result = adapt(request, writer="builtin", constraints=options)
    if result.status in ("needs_clarification", "not_understood", "failed"):
        return result.status, []
    wrong = []
    scene = sized(request.scene, request.robot, request.trajectory)
    after = excesses(result.adapted, scene, request.robot, result.contacts)
    before = excesses(request.trajectory, scene, request.robot, result.contacts)
    if result.status == "infeasible":
        return result.status, ["infeasible, but a sampler finds a legal path"] if sampled(result, options) else []
    for name, amount in after.items():
        allowed = SLACK
        if result.status != "done":  # a limited result says that the original broke it already
            allowed = max(SLACK, before[name] + SLACK)
        if amount > allowed:
            wrong.append(f"{result.status}, but {name} is broken by {amount:.2g}: {request.instruction}")
    return result.status, wrong


def main(count, first=0, log=None):
    """Judge seeds one after the other; with a log, a file of one line for each, those in it are not judged again."""
    log = Path(log) if log else None
    known = dict(json.loads(line) for line in log.read_text().splitlines()) if log and log.exists() else {}
    began, judged = time.process_time(), 0
    for seed in range(first, first + count):
        if seed not in known:
            known[seed], judged = judge(seed), judged + 1
            if log:
                with log.open("a") as file:
                    file.write(json.dumps([seed, known[seed]]) + "\n")
    results = {seed: known[seed] for seed in range(first, first + count)}
    faults = [f"seed {seed}: {text}" for seed, (_, wrong) in results.items() for text in wrong]
    print("\n".join(faults[:40]))
    each = (time.process_time() - began) / max(judged, 1) * 1e3
    status = dict(Counter(name for name, _ in results.values()))
    print(f"{count} scenes and instructions: {status}; {len(faults)} faults; {each:.0f} ms of CPU time each")
    return len(faults)


if __name__ == "__main__":
    count, first, log = (sys.argv[1:] + ["2000", "0", ""][len(sys.argv) - 1 :])[:3]
    sys.exit(bool(main(int(count), int(first), log)))
