"""Ordinary policies, as a model writes them: what the sandbox must run and the check must not refuse."""

# ruff: noqa: E501

FUNCTIONS: dict[str, str] = {
    "toolkit": '''
def adapt(traj, scene, *, distance=0.2, slowdown=0.5, radius=0.3):
    """Shift left, then slow down near the cup."""
    cup = scene["cup"]
    traj = move(traj, left=distance)
    return scale_speed(traj, slowdown, where=near(traj, cup, within=radius))
''',
    "in_place_slices": """
def adapt(traj, scene, *, up=0.1, factor=1.5):
    traj[:, 2] += up
    traj[10:20, 3] *= factor
    traj[-1, :2] = traj[0, :2]
    traj[::2, 0] -= 0.01
    return traj
""",
    "annotations": """
from __future__ import annotations
from typing import Any, Optional
import numpy.typing as npt

def adapt(traj: npt.NDArray[np.float64], scene: Scene, *, gain: float = 0.3) -> np.ndarray:
    result: np.ndarray = traj.copy()
    center: Optional[Any] = None
    center = scene["cup"].position
    result[:, :3] += gain * (center - result[:, :3])
    return result
""",
    "boolean_masks": """
def adapt(traj, scene, *, radius=0.45):
    d = np.linalg.norm(traj[:, :3] - scene["laptop"].position, axis=1)
    mask = (d < radius) & (traj[:, 3] > 0.1) | (d > 1.0)
    traj[mask, 3] = np.clip(traj[mask, 3] * 0.4, 0.05, None)
    return traj
""",
    "gaussian_push": """
import numpy as np
import math

def adapt(traj, scene, *, push=0.2, sigma=0.3):
    for obj in scene:
        away = traj[:, :3] - obj.position
        d = np.linalg.norm(away, axis=1, keepdims=True)
        traj[:, :3] += push * np.exp(-(d / sigma) ** 2 / 2) * away / np.maximum(d, 1e-9)
    return traj * np.array([1, 1, 1, math.sqrt(0.5)])
""",
    "while_loop": """
def adapt(traj, scene, *, step=0.02):
    shift = 0.0
    while np.min(scene["cup"].distance(traj[:, :3] + [0, 0, shift])) < 0.4 and shift < 2:
        shift += step
    traj[:, 2] += shift
    return traj
""",
    "try_except": """
def adapt(traj, scene, *, name="mug"):
    try:
        target = scene[name]
    except Exception as error:
        message = f"no {name}: {error}"
        target = next(iter(scene))
    finally:
        done = True
    assert done
    traj[-1, :3] = target.position
    return traj
""",
    "closures": """
def adapt(traj, scene, *, width=0.2):
    center = scene["cup"].position
    calls = 0

    def weight(p):
        nonlocal calls
        calls += 1
        return float(np.exp(-np.sum((p - center) ** 2) / width**2))

    weights = np.array([weight(p) for p in traj[:, :3]])
    traj[:, 2] += 0.1 * weights
    return traj if calls == len(traj) else None
""",
    "classes": """
from dataclasses import dataclass, field

@dataclass(frozen=True)
class Bump:
    center: np.ndarray
    height: float = 0.1
    notes: list = field(default_factory=list)

    @property
    def top(self) -> float:
        return self.height * 2

    def __call__(self, points):
        d = np.linalg.norm(points - self.center, axis=1)
        return self.height * (d < self.top * 2)

class Shifter:
    scale = 2

    def __init__(self, amount):
        super().__init__()
        self._amount = amount
        self.__secret = 1

    def __add__(self, other):
        return other + self._amount * self.scale * self.__secret

    @staticmethod
    def half(x):
        return x / 2

    @classmethod
    def one(cls):
        return cls(1.0)

def adapt(traj, scene):
    traj[:, 2] += Bump(scene["cup"].position)(traj[:, :3])
    traj[:, 0] = Shifter(0.1) + Shifter.half(traj[:, 0])
    return traj
""",
    "match_statement": """
def adapt(traj, scene, *, mode="lift", amount=0.1):
    match (mode, amount):
        case ("lift", float(a)) if a > 0:
            traj[:, 2] += a
        case ("lower", _):
            traj[:, 2] -= amount
        case {"x": x, **rest}:
            traj[:, 0] += x
        case [first, *others]:
            pass
    return traj
""",
    "f_strings": """
def adapt(traj, scene, *, digits=3):
    words = {f"{o.name.lower():>10}": f"{o.position[0]:.{digits}f}" for o in scene}
    text = "{:.3f} and {}".format(0.5, "x") + "%.2f" % 0.25
    traj[:, 0] += sum(float(v) for v in words.values()) + len(text) + len(f"{traj.shape!r}")
    return traj
""",
    "lambdas_and_sorting": """
def adapt(traj, scene):
    nearest = min(scene, key=lambda o: o.distance(traj[:, :3]).min())
    order = sorted(scene.names, key=str.lower, reverse=True)
    ramp = list(map(lambda i: i / len(traj), range(len(traj))))
    traj[:, 1] += np.array(ramp) * nearest.position[1] + order.index("laptop")
    return traj
""",
    "comprehensions": """
def adapt(traj, scene):
    near_ones = {o.name for o in scene if any(d < 0.5 for d in o.distance(traj[:, :3]))}
    pairs = [(i, j) for i in range(3) for j in range(i) if i != j]
    grid = {k: [v for v in range(k)] for k in range(4)}
    gen = (x * x for x in range(5))
    return traj * (1 + 0.01 * (len(near_ones) + len(pairs) + len(grid) + sum(gen)))
""",
    "insert_waypoints": """
def adapt(traj, scene, *, extra=5):
    rows = []
    for a, b in zip(traj[:-1], traj[1:]):
        rows.append(a)
        for t in np.linspace(0, 1, extra, endpoint=False)[1:]:
            rows.append((1 - t) * a + t * b)
    rows.append(traj[-1])
    return np.vstack(rows)
""",
    "delete_and_stack": """
def adapt(traj, scene):
    start, rest = traj[:1], np.delete(traj, [1, 2, 3], axis=0)[1:]
    loop = np.column_stack([np.cos(np.arange(8)), np.sin(np.arange(8)), np.zeros(8), np.full(8, 0.2)])
    return np.concatenate([start, loop, rest])
""",
    "rotation": """
def adapt(traj, scene, *, angle=30):
    c, s = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    center = traj[:, :3].mean(axis=0)
    traj[:, :3] = (traj[:, :3] - center) @ R.T + center
    return traj
""",
    "interpolation": """
def adapt(traj, scene, *, n=150):
    s = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(traj[:, :3], axis=0), axis=1))])
    u = np.linspace(0, s[-1], n)
    return np.stack([np.interp(u, s, traj[:, k]) for k in range(4)], axis=1)
""",
    "convolution": """
def adapt(traj, scene, *, width=7):
    kernel = np.hanning(width + 2)[1:-1]
    kernel /= kernel.sum()
    padded = np.pad(traj[:, :3], ((width // 2, width // 2), (0, 0)), mode="edge")
    smooth = np.apply_along_axis(lambda c: np.convolve(c, kernel, mode="valid"), 0, padded)
    out = traj.copy()
    out[1:-1, :3] = smooth[1:-1]
    return out
""",
    "polynomials": """
def adapt(traj, scene):
    x = np.linspace(-1, 1, len(traj))
    for k in range(3):
        c = np.polyfit(x, traj[:, k], 3)
        traj[:, k] = np.polyval(c, x)
    p = np.polynomial.Polynomial([0, 0.1, 0.2])
    traj[:, 2] += p(x)
    return traj
""",
    "linear_algebra": """
def adapt(traj, scene):
    centered = traj[:, :3] - traj[:, :3].mean(axis=0)
    u, s, vt = np.linalg.svd(centered, full_matrices=False)
    A = np.eye(3) * 2 + 0.1
    traj[:, :3] += 0.01 * np.abs(np.linalg.solve(A, np.abs(vt[0])))
    traj[:, 3] *= np.linalg.det(A) / 8
    return traj
""",
    "random_with_seed": """
import random

def adapt(traj, scene, *, seed=4):
    rng = np.random.default_rng(seed)
    random.seed(seed)
    np.random.seed(seed)
    return traj + 0.01 * rng.normal(size=traj.shape) + 0.001 * random.random() + 0.001 * np.random.rand(*traj.shape)
""",
    "itertools_functools": """
import itertools, functools, operator, collections, heapq, bisect, copy, statistics, fractions
from collections import defaultdict, namedtuple, deque, Counter, OrderedDict

Pair = namedtuple("Pair", "a b")

@functools.lru_cache(maxsize=None)
def fib(n):
    return n if n < 2 else fib(n - 1) + fib(n - 2)

def logged(f):
    @functools.wraps(f)
    def inner(*args, **kwargs):
        return f(*args, **kwargs)
    return inner

@logged
def adapt(traj, scene):
    total = functools.reduce(operator.add, itertools.chain(range(3), itertools.repeat(1, 2)))
    groups = defaultdict(list)
    for i, k in enumerate(itertools.islice(itertools.cycle("ab"), 6)):
        groups[k].append(i)
    window = deque(maxlen=3)
    for v in traj[:, 3]:
        window.append(v)
    p = Pair(1, 2)._replace(a=3)
    heap = [3, 1, 2]
    heapq.heapify(heap)
    extra = bisect.bisect([1, 2, 3], 2) + statistics.mean([1, 2]) + float(fractions.Fraction(1, 3)) + heap[0]
    count = Counter("hello").most_common(1)[0][1]
    other = copy.deepcopy(traj)
    other[:, 0] += total + len(groups["a"]) + sum(window) + p.a + fib(10) + extra + count
    return other
""",
    "errstate_and_nan": """
def adapt(traj, scene):
    with np.errstate(divide="ignore", invalid="ignore"):
        r = traj[:, :3] / np.linalg.norm(traj[:, :3], axis=1, keepdims=True)
    r = np.where(np.isfinite(r), r, 0.0)
    traj[:, :3] += 0.1 * np.nan_to_num(r)
    return traj
""",
    "lists_of_lists": """
def adapt(traj, scene):
    out = []
    for x, y, z, v in traj.tolist():
        out.append([x + 0.1, y, max(z, 0.05), min(v, 0.3)])
    return out
""",
    "tuples_without_speed": """
def adapt(traj, scene):
    return [(x, y, z + 0.2) for x, y, z, _ in traj]
""",
    "type_and_getattr": """
def adapt(traj, scene):
    for obj in scene:
        size = getattr(obj, "dimensions", None)
        if hasattr(obj, "radius") and isinstance(size, np.ndarray) and type(size).__name__ == "ndarray":
            traj[:, 2] += obj.radius if type(obj.name) is str else 0
    return traj
""",
    "slow_down_ramp": """
def adapt(traj, scene, *, share=0.2):
    n = len(traj)
    k = max(2, int(round(share * n)))
    profile = np.ones(n)
    profile[-k:] = 0.5 * (1 + np.cos(np.linspace(0, np.pi, k)))
    traj[:, 3] = traj[:, 3] * profile + 1e-3
    traj[n // 2 : n // 2 + 3, 3] = 0.0
    return traj
""",
    "scipy_filters": """
from scipy.ndimage import gaussian_filter1d
from scipy.signal import savgol_filter

def adapt(traj, scene, *, sigma=2.0):
    traj[:, :3] = gaussian_filter1d(traj[:, :3], sigma, axis=0, mode="nearest")
    traj[:, 3] = np.abs(savgol_filter(traj[:, 3], 9, 2))
    return traj
""",
    "scipy_splines": """
from scipy.interpolate import CubicSpline, interp1d, splprep, splev
import scipy.interpolate as si
from scipy.spatial.transform import Rotation as R
from scipy.spatial.distance import cdist
from scipy.optimize import minimize

def adapt(traj, scene):
    t = np.linspace(0, 1, len(traj))
    out = np.column_stack([CubicSpline(t, traj[:, :3])(t), interp1d(t, traj[:, 3], kind="linear")(t)])
    tck, u = splprep(traj[:, :3].T, s=0.001)
    out[:, :3] = 0.5 * out[:, :3] + 0.5 * np.array(splev(t, tck)).T
    out[:, :3] = R.from_euler("z", 10, degrees=True).apply(out[:, :3])
    d = cdist(out[:, :3], [o.position for o in scene])
    best = minimize(lambda p: float((p[0] - 0.3) ** 2), [0.0]).x[0]
    out[:, 2] += 0.01 * d.min(axis=1) + best
    return out
""",
}

SCRIPTS: dict[str, str] = {
    "shift_right": """
import numpy as np

# Get the trajectory and shift it
trajectory = get_trajectory()
OFFSET = 0.1  # metres
modified_trajectory = []
for wp in trajectory:
    new = dict(wp)
    new["x"] = wp["x"] + OFFSET
    modified_trajectory.append(new)
""",
    "closest_object": """
trajectory = get_trajectory()
objects = detect_objects()
target = next((o for o in objects if "cup" in o["name"]), None)
modified_trajectory = [
    {"x": p["x"], "y": p["y"], "z": p["z"], "velocity": p["velocity"] * (0.5 if abs(p["x"] - target["x"]) < 0.2 else 1.0)}
    for p in trajectory
]
""",
    "named_object": """
cup = detect_objects("cup")[0]
points = np.array([[w["x"], w["y"], w["z"], w["velocity"]] for w in get_trajectory()])
points[:, 2] += cup["dimensions"][2]
modified_trajectory = points
""",
    "deepcopy_in_place": """
import copy
modified_trajectory = copy.deepcopy(get_trajectory())
for i, waypoint in enumerate(modified_trajectory):
    waypoint["z"] += 0.1 * math.sin(math.pi * i / len(modified_trajectory))
    waypoint["velocity"] *= 0.8
""",
    "functions_and_main": """
import numpy as np
from typing import Dict, List


def distance(a: Dict[str, float], b: Dict[str, float]) -> float:
    return math.sqrt(sum((a[k] - b[k]) ** 2 for k in "xyz"))


def modify(trajectory: List[Dict[str, float]], objects: List[Dict]) -> List[Dict[str, float]]:
    result = []
    for p in trajectory:
        d = min(distance(p, o) for o in objects)
        result.append({**p, "speed": p["velocity"] / (1 + np.exp(-d))})
    return result


def main():
    return modify(get_trajectory(), detect_objects())


if __name__ == "__main__":
    modified_trajectory = main()
""",
    "tuples_without_speed": """
modified_trajectory = [(w["x"], w["y"] * 2, w["z"]) for w in get_trajectory()]
""",
    "dicts_without_speed": """
modified_trajectory = [{"x": w["x"], "y": w["y"] - 0.3, "z": w["z"]} for w in get_trajectory()]
""",
    "stop_and_go": """
trajectory = get_trajectory()
n = len(trajectory)
middle = n // 2
modified_trajectory = trajectory[:middle]
for _ in range(5):
    stop = dict(trajectory[middle])
    stop["velocity"] = 0.0
    modified_trajectory.append(stop)
modified_trajectory += trajectory[middle:]
""",
    "circle_around": """
objects = {o["name"]: o for o in detect_objects()}
c = objects["red cup"]
angles = np.linspace(0, 2 * np.pi, 40)
loop = [dict(x=c["x"] + 0.2 * np.cos(a), y=c["y"] + 0.2 * np.sin(a), z=c["z"], velocity=0.2) for a in angles]
path = get_trajectory()
k = int(np.argmin([(p["x"] - c["x"]) ** 2 + (p["y"] - c["y"]) ** 2 for p in path]))
modified_trajectory = path[:k] + loop + path[k:]
""",
    "array_columns": """
data = np.asarray([list(p.values()) for p in get_trajectory()])
x, y, z, v = data.T
scale = np.linspace(1.0, 0.5, len(x))
modified_trajectory = np.c_[x * scale, y * scale, z, np.maximum(v, 0.15)]
""",
    "toolkit_in_script": """
points = np.array([[w["x"], w["y"], w["z"], w["velocity"]] for w in get_trajectory()])
modified_trajectory = scale_speed(move(points, up=0.1), 0.5)
""",
    "class_in_script": """
class Editor:
    def __init__(self, waypoints):
        self.waypoints = waypoints

    def lift(self, amount):
        for w in self.waypoints:
            w["z"] = w["z"] + amount
        return self

    def result(self):
        return self.waypoints


modified_trajectory = Editor(get_trajectory()).lift(0.25).result()
""",
    "while_and_index": """
trajectory = get_trajectory()
modified_trajectory = []
i = 0
while i < len(trajectory):
    w = trajectory[i]
    modified_trajectory.append([w["x"], w["y"], w["z"] if i % 2 else w["z"] + 0.001, w["velocity"]])
    i += 1
""",
    "try_and_globals": """
factor = 1.0
def adjust(amount):
    global factor
    factor = amount
try:
    adjust(0.5)
    missing = detect_objects("unicorn")[0]
except IndexError:
    adjust(0.25)
modified_trajectory = [{**w, "velocity": w["velocity"] * factor} for w in get_trajectory()]
""",
}

SCRIPTS["main_sets_a_global"] = """
import numpy as np

def main():
    global modified_trajectory
    trajectory = get_trajectory()
    for waypoint in trajectory:
        waypoint["z"] += 0.05
    modified_trajectory = trajectory

if __name__ == "__main__":
    main()
"""

FUNCTIONS["harmless_modules"] = """
import collections
import enum
import functools
import itertools
import json
import statistics
from dataclasses import dataclass
from enum import Enum, auto
from typing import Literal, NamedTuple, Protocol

class Way(Enum):
    UP = auto()
    DOWN = auto()

class Level(enum.IntEnum):
    LOW = 1
    HIGH = 2

class Kind(enum.Flag):
    A = auto()
    B = auto()

class Point(NamedTuple):
    x: float
    y: float

@dataclass(frozen=True)
class Step:
    way: Way
    size: float

@functools.lru_cache(maxsize=None)
def sign(way):
    return 1.0 if way is Way.UP else -1.0

def adapt(traj, scene):
    step = Step(Way(1), json.loads('{"size": 0.05}')["size"])
    counts = collections.Counter(itertools.chain("ab", "a"))
    mean = statistics.fmean([0.0, step.size * Level(2)]) + Point(0.0, 0.01).y + (Kind.A | Kind.B).value * 0.0
    traj[:, 2] += sign(step.way) * mean * counts["a"] + len(json.dumps({"a": [Way.UP.name]})) * 0.001
    return traj
"""
