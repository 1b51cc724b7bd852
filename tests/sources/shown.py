"""Demonstrations for tests: a swing over a table, shown several times with other paces and other ways."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ovita.io import Task
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory

Curve = Callable[[Array], Array]


def swing(s: Array) -> Array:
    """A path (N, 3) [m] that rises, turns and comes down again."""
    return np.stack([0.6 * s, 0.15 * np.sin(2 * np.pi * s), 0.2 + 0.1 * np.sin(np.pi * s)], axis=1)


def demonstration(curve: Curve = swing, *, seed: int = 0, spread: float = 0.02, turning: bool = False) -> Trajectory:
    """One demonstration: at its own pace, and off the curve by some smooth way that vanishes at the ends."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, 60 + int(rng.integers(40)))
    s = t ** rng.uniform(0.8, 1.25)
    ways = np.sin(np.pi * np.outer(s, [1, 2, 3])) @ rng.normal(0.0, spread, (3, 3))
    angle = 0.8 * s + rng.normal(0.0, 0.05)
    turns = np.stack([np.cos(angle / 2), 0 * s, 0 * s, np.sin(angle / 2)], axis=1) if turning else None
    return Trajectory(curve(s) + ways, 0.3 * np.sin(np.pi * np.clip(t, 0.05, 0.95)), turns)


def demonstrations(count: int = 6, **options: object) -> list[Trajectory]:
    """Several of them."""
    return [demonstration(seed=seed, **options) for seed in range(count)]  # type: ignore[arg-type]


def reaching(seed: int) -> Task:
    """From the cup to the plate, wherever these stand and however turned: out of the cup's side, over, down."""
    rng = np.random.default_rng(seed)
    places = {"cup": rng.uniform([-0.1, -0.1, 0], [0.1, 0.1, 0]), "plate": rng.uniform([0.5, 0.2, 0], [0.7, 0.5, 0])}
    yaws = {name: rng.uniform(-0.7, 0.7) for name in places}
    return reach(places, yaws, rng.normal(0.0, 0.004, (3, 3)))


def reach(places: dict[str, Array], yaws: dict[str, float], ways: Array | None = None) -> Task:
    """The task of `reaching` for given places and yaws."""
    ends = []
    for name, out in (("cup", (0.0, -0.1, 0.0)), ("plate", (0.0, 0.0, 0.15))):
        c, s = np.cos(yaws[name]), np.sin(yaws[name])
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        ends.append((places[name], places[name] + turn @ np.array(out)))
    (a, b), (d, c) = ends
    t = np.linspace(0.0, 1.0, 80)[:, None]
    path = (1 - t) ** 3 * a + 3 * (1 - t) ** 2 * t * b + 3 * (1 - t) * t**2 * c + t**3 * d
    if ways is not None:
        path = path + np.sin(np.pi * t * [1, 2, 3]) @ ways
    objects = tuple(
        SceneObject(name, places[name], orientation=np.array([np.cos(y / 2), 0, 0, np.sin(y / 2)]))
        for name, y in yaws.items()
    )
    return Task(Trajectory(path, np.full(80, 0.2)), Scene(objects))
