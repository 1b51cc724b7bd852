"""Adaptations made by hand for the public samples, keyed by id: right ones (each a fair reading) and wrong ones.

They use numpy and the toolkit and know nothing of the writers; rows are (N, 4): x, y, z [m], speed [m/s].
Frame of the data set: +x right, +y front, +z up.
"""

from collections.abc import Callable

import numpy as np

from ovita import toolkit as tk
from ovita.paths.scene import Scene

Rows = np.ndarray
Edit = Callable[[Rows, Scene], Rows]
RIGHT: dict[str, list[Edit]] = {}
WRONG: dict[str, list[tuple[str, Edit]]] = {}
AXES = {
    "left": (-1, 0, 0),
    "right": (1, 0, 0),
    "back": (0, -1, 0),
    "front": (0, 1, 0),
    "down": (0, 0, -1),
    "up": (0, 0, 1),
}
OPPOSITE = {"left": "right", "right": "left", "front": "back", "back": "front", "up": "down", "down": "up"}


def size(rows: Rows) -> float:
    return float(np.linalg.norm(np.ptp(rows[:, :3], axis=0)))


def at(scene: Scene, place) -> np.ndarray:
    return np.array(scene[place].position if isinstance(place, str) else place, dtype=float)


def reach(rows: Rows, point: np.ndarray) -> np.ndarray:
    return np.linalg.norm(rows[:, :3] - point, axis=1)


def shifted(rows: Rows, vector, weights=1.0) -> Rows:
    new = rows.copy()
    new[:, :3] += np.multiply.outer(np.broadcast_to(weights, len(rows)), np.asarray(vector, float))
    return new


def shift(word: str, share: float = 0.08, metres: float | None = None) -> Edit:
    return lambda rows, scene: shifted(rows, np.array(AXES[word]) * (share * size(rows) if metres is None else metres))


def pull(place, share: float, sign: float = 1.0, metres: float | None = None) -> Edit:
    """Towards (+) or away from (-) a place, most where the path is nearest."""

    def edit(rows: Rows, scene: Scene) -> Rows:
        point, amount = at(scene, place), share * size(rows) if metres is None else metres
        distance = reach(rows, point)
        weight = np.exp(-(((distance - distance.min()) / (0.3 * size(rows))) ** 2))
        step = amount * weight
        if sign > 0:
            step = np.minimum(step, 0.8 * distance)
        outward = (rows[:, :3] - point) / np.maximum(distance, 1e-9)[:, None]
        new = rows.copy()
        new[:, :3] -= sign * step[:, None] * outward
        return new

    return edit


def drag(place, share: float, sign: float = 1.0) -> Edit:
    """The whole path, by the direction from its nearest point to the place (or the other way)."""

    def edit(rows: Rows, scene: Scene) -> Rows:
        point = at(scene, place)
        nearest = rows[reach(rows, point).argmin(), :3]
        gap = point - nearest
        length = np.linalg.norm(gap)
        amount = share * size(rows) if sign < 0 else min(share * size(rows), 0.8 * length)
        return shifted(rows, sign * amount * gap / max(length, 1e-9))

    return edit


def pace(factor: float, place=None, radius: float | None = None, outer: bool = False) -> Edit:
    """Speeds times a factor, everywhere or within a radius (a fifth of the extent beyond the nearest point)."""

    def edit(rows: Rows, scene: Scene) -> Rows:
        new = rows.copy()
        if place is None:
            new[:, 3] *= factor
            return new
        distance = reach(rows, at(scene, place))
        mask = distance <= (distance.min() + 0.2 * size(rows) if radius is None else radius)
        new[mask != outer, 3] *= factor
        return new

    return edit


def fading(factor: float, place) -> Edit:
    """Speeds times a factor that fades out with the distance."""

    def edit(rows: Rows, scene: Scene) -> Rows:
        distance = reach(rows, at(scene, place))
        weight = np.clip(1.0 - (distance - distance.min()) / (0.4 * size(rows)), 0.0, 1.0)
        new = rows.copy()
        new[:, 3] *= 1.0 + (factor - 1.0) * weight
        return new

    return edit


def then(*edits: Edit) -> Edit:
    def edit(rows: Rows, scene: Scene) -> Rows:
        for one in edits:
            rows = one(rows, scene)
        return rows

    return edit


def same(rows: Rows, scene: Scene) -> Rows:
    return rows.copy()


def end(vector, row: int = -1, share: float = 0.3, to=None) -> Edit:
    """One end moved by a vector [m] or to a place; the shift fades out along a share of the waypoints."""

    def edit(rows: Rows, scene: Scene) -> Rows:
        goal = np.asarray(vector, float) if to is None else at(scene, to(scene) if callable(to) else to) - rows[row, :3]
        index = np.arange(len(rows)) if row == 0 else np.arange(len(rows))[::-1]
        return shifted(rows, goal, np.clip(1.0 - index / (share * len(rows)), 0.0, 1.0))

    return edit


def append(curve: Callable[[Rows, Scene], np.ndarray]) -> Edit:
    """Points after the goal, at the goal's speed or the mean one."""

    def edit(rows: Rows, scene: Scene) -> Rows:
        points = curve(rows, scene)
        speed = max(float(rows[-1, 3]), 0.5 * float(rows[:, 3].mean()))
        return np.concatenate([rows, np.column_stack([points, np.full(len(points), speed)])])

    return edit


def line(vector, count: int = 10) -> Edit:
    return append(lambda rows, scene: rows[-1, :3] + np.linspace(0, 1, count + 1)[1:, None] * np.asarray(vector, float))


def go_to(place, count: int = 10) -> Edit:
    def curve(rows: Rows, scene: Scene) -> np.ndarray:
        point = at(scene, place(scene) if callable(place) else place)
        return rows[-1, :3] + np.linspace(0, 1, count + 1)[1:, None] * (point - rows[-1, :3])

    return append(curve)


def helix(turns: float, radius: float, grows: bool = False, rise: float | None = None) -> Edit:
    """A spiral after the goal: a rising helix, or a flat one whose radius grows."""

    def curve(rows: Rows, scene: Scene) -> np.ndarray:
        t = np.linspace(0, 1, int(16 * turns) + 1)[1:]
        r = radius * size(rows)
        angle = 2 * np.pi * turns * t
        if grows:
            offset = np.column_stack([r * t * np.cos(angle), r * t * np.sin(angle), 0 * t])
        else:
            height = r if rise is None else rise
            offset = np.column_stack([r * (np.cos(angle) - 1), r * np.sin(angle), height * t])
        return rows[-1, :3] + offset

    return append(curve)


def ramp(start: float | None, finish: float, share: float = 1.0) -> Edit:
    """The speed on the last share of the waypoints goes linearly from a value (or the present one) to another."""

    def edit(rows: Rows, scene: Scene) -> Rows:
        new = rows.copy()
        count = max(2, round(share * len(rows)))
        begin = new[-count, 3] if start is None else start
        new[-count:, 3] = np.linspace(begin, finish, count)
        return new

    return edit


def constant(value: float, place=None, radius: float | None = None) -> Edit:
    def edit(rows: Rows, scene: Scene) -> Rows:
        new = rows.copy()
        new[slice(None) if place is None else reach(rows, at(scene, place)) <= radius, 3] = value
        return new

    return edit


def stop(place, cut: bool) -> Edit:
    def edit(rows: Rows, scene: Scene) -> Rows:
        i = int(reach(rows, at(scene, place)).argmin()) if place != "goal" else len(rows) - 1
        new = rows[: i + 1].copy() if cut else rows.copy()
        new[i, 3] = 0.0
        return new

    return edit


def wait(place, steps: int) -> Edit:
    def edit(rows: Rows, scene: Scene) -> Rows:
        i = 0 if place == "start" else int(reach(rows, at(scene, place)).argmin())
        still = np.repeat(rows[i : i + 1], steps, axis=0)
        still[:, 3] = 0.0
        return np.concatenate([rows[: i + 1], still, rows[i + 1 :]])

    return edit


def avoid(radius: float, *names: str) -> Edit:
    return lambda rows, scene: tk.keep_distance(rows, [scene[name] for name in names], at_least=radius)


def zigzag(share: float, period: int, word: str = "up") -> Edit:
    def edit(rows: Rows, scene: Scene) -> Rows:
        k = np.arange(len(rows))
        return shifted(rows, share * size(rows) * np.array(AXES[word]), np.sin(2 * np.pi * k / period + 0.3))

    return edit


def resampled(count: int) -> Edit:
    return lambda rows, scene: tk.resample(rows, count)


def turned(degrees: float, axis: int) -> Edit:
    def edit(rows: Rows, scene: Scene) -> Rows:
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        a, b = [(1, 2), (2, 0), (0, 1)][axis]
        new, centre = rows.copy(), rows[:, :3].mean(axis=0)
        x, y = rows[:, a] - centre[a], rows[:, b] - centre[b]
        new[:, a], new[:, b] = centre[a] + c * x - s * y, centre[b] + s * x + c * y
        return new

    return edit


def flipped(axes: tuple[int, ...], count: int, about_start: bool) -> Edit:
    def edit(rows: Rows, scene: Scene) -> Rows:
        new = rows.copy()
        for axis in axes:
            mirror = rows[0, axis] if about_start else 0.0
            new[:count, axis] = 2 * mirror - new[:count, axis]
        return new

    return edit


def through(*points: Callable[[Scene], np.ndarray]) -> Edit:
    def edit(rows: Rows, scene: Scene) -> Rows:
        for point in points:
            rows = tk.go_through(rows, point(scene), width=0.15)
        return rows

    return edit


def over(name: str, height: float) -> Callable[[Scene], np.ndarray]:
    return lambda scene: at(scene, name) + np.array([0, 0, height])


def mid(a: str, b: str) -> Callable[[Scene], np.ndarray]:
    return lambda scene: (at(scene, a) + at(scene, b)) / 2


def other(name: str) -> Callable[[Scene], str]:
    """The object that is farthest from the named one."""
    return lambda scene: (
        max(
            (item for item in scene if item.name != name),
            key=lambda item: np.linalg.norm(item.position - at(scene, name)),
        ).name
    )


def with_other(name: str, make: Callable[[str], Edit]) -> Edit:
    return lambda rows, scene: make(other(name)(scene))(rows, scene)


LATTE, EXTENDED = "latte_subset/latte_", "extended_subset/extended_"
DRONE = "robot_subset/Drone/drone_trajectory_"
GROUND, ARM = "robot_subset/Ground_robot/trajectory_", "robot_subset/Manipulator/trajectory_"


def sample(id: str, *right: Edit, **wrong: Edit) -> None:
    RIGHT[id] = list(right)
    WRONG[id] = [(name.replace("_", " "), edit) for name, edit in wrong.items()]


def nearer(id: str, name: str, share: float = 0.08) -> None:
    sample(
        id,
        pull(name, share),
        drag(name, share),
        opposite=pull(name, share, -1.0),
        wrong_object=with_other(name, lambda one: pull(one, share)),
        speed_instead=pace(0.5, name),
    )


def away(id: str, name: str, share: float = 0.08) -> None:
    sample(
        id,
        pull(name, share, -1.0),
        opposite=pull(name, share),
        wrong_object=with_other(name, lambda one: pull(one, share, -1.0)),
        speed_instead=pace(0.5, name),
    )


def speed_near(id: str, name: str, factor: float, moving: Edit = same) -> None:
    sample(
        id,
        then(pace(factor, name), moving),
        then(fading(factor, name), moving),
        opposite=then(pace(1 / factor, name), moving),
        wrong_object=with_other(name, lambda one: then(pace(factor, one), moving)),
        everywhere=then(pace(factor), moving),
        elsewhere=then(pace(factor, name, outer=True), moving),
        path_instead=pull(name, 0.08),
    )


def toward(id: str, word: str, share: float = 0.08) -> None:
    across = {"left": "front", "right": "back", "front": "up", "back": "down", "up": "left", "down": "right"}[word]
    sample(
        id,
        shift(word, share),
        line(0.3 * np.array(AXES[word])),
        end(0.3 * np.array(AXES[word]), share=0.8),
        opposite=shift(OPPOSITE[word], share),
        across=shift(across, share),
        speed_instead=pace(0.5),
    )


for number, name, share in (
    (0, "labyrinth", 0.06), (19, "bagel", 0.05), (27, "crossword", 0.1), (35, "panda", 0.04), (38, "Siamese cat", 0.1),
    (41, "stoplight", 0.05), (45, "trifle", 0.2), (50, "marmoset", 0.15), (63, "terrace", 0.04),
    (65, "Gordon setter", 0.06), (68, "shako", 0.1),
):  # fmt: skip
    nearer(f"{LATTE}{number}", name, share)
for number, name, share in (
    (9, "cardoon", 0.1), (14, "pretzel", 0.2), (22, "mower", 0.05), (48, "Tringa totanus", 0.1),
    (59, "fiddler crab", 0.1), (74, "curly-coated retriever", 0.15),
):  # fmt: skip
    away(f"{LATTE}{number}", name, share)
for number, name, factor in (
    (1, "orang", 0.7), (6, "shopping basket", 2.0), (10, "damselfly", 0.3), (16, "Irish water spaniel", 1.6),
    (25, "space shuttle", 0.7), (33, "icecream", 0.4), (43, "half track", 1.6), (52, "ladybird beetle", 1.4),
    (56, "prairie wolf", 1.6), (62, "African chameleon", 1.6), (70, "confectionery", 1.4),
):  # fmt: skip
    speed_near(f"{LATTE}{number}", name, factor)
for number, word in (
    (3, "down"), (15, "up"), (23, "left"), (30, "down"), (32, "left"), (36, "down"), (51, "front"), (57, "left"),
    (67, "up"),
):  # fmt: skip
    toward(f"{LATTE}{number}", word)
