"""Random scenes at the scales of four robots: a path with objects beside it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.interpolate import CubicSpline

from ovita.bench.grammar.lexicon import NAMES, Split
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory
from ovita.toolkit.weights import path_distances


@dataclass(frozen=True)
class Setting:
    """The scale of a robot's scenes.

    Args:
        robot: Preset whose limits hold, or "none".
        center: Middle of the box that the path fills [m].
        half: Half of the box's edges [m]; 0 keeps the path flat.
        waypoints: Fewest and most waypoints.
        speed: Lowest and highest mean speed [m/s].
        sizes: Smallest and largest edge of an object [m], or None for objects without dimensions.
        frames: Frames that occur.
    """

    robot: str
    center: tuple[float, float, float]
    half: tuple[float, float, float]
    waypoints: tuple[int, int]
    speed: tuple[float, float]
    sizes: tuple[float, float] | None
    frames: tuple[str, ...] = ("rfu",)


SETTINGS: Mapping[str, Setting] = {
    "tabletop": Setting("none", (0.0, 0.0, 0.0), (0.3, 0.3, 0.3), (40, 40), (0.1, 0.5), None),
    "drone": Setting("drone", (0.0, 0.0, 1.0), (1.8, 1.8, 0.7), (40, 90), (0.2, 0.6), (0.1, 0.4), ("rfu", "flu")),
    "ground": Setting("ground", (0.0, 0.0, 0.0), (1.8, 1.8, 0.0), (40, 80), (0.15, 0.6), (0.1, 0.4), ("rfu", "flu")),
    "arm": Setting("arm", (0.1, 0.0, 0.6), (0.18, 0.3, 0.25), (40, 100), (0.05, 0.3), (0.03, 0.08), ("rfu", "flu")),
}
"""The robots' scales, with the limits of the presets of the same robots."""


def random_scene(rng: Generator, setting: Setting, split: Split) -> tuple[Trajectory, Scene]:
    """A smooth path with a varying speed, and two to six objects beside it."""
    positions = _path(rng, setting)
    n = len(positions)
    s = np.linspace(0.0, 1.0, n)
    wave = 1.0 + 0.3 * np.sin(2 * np.pi * (rng.uniform(0.5, 1.5) * s + rng.uniform()))
    speeds = np.round(rng.uniform(*setting.speed) * wave, 4)
    names = rng.permutation(np.array(NAMES[split]))[: rng.integers(2, 7)]
    objects: list[SceneObject] = []
    for name in names:
        found = _object(rng, setting, positions, str(name))
        if found is not None:
            objects.append(found)
    frame = Frame(str(rng.choice(np.array(setting.frames))))
    return Trajectory(positions, speeds), Scene(tuple(objects), frame)


def _path(rng: Generator, setting: Setting) -> Array:
    """A spline through a random walk, scaled to fill 60 to 100 % of the box, evenly spaced."""
    knots = np.cumsum(rng.normal(size=(int(rng.integers(4, 8)), 3)), axis=0)
    # A drift keeps the path from curling up, so that most of it is away from any one object.
    knots += np.linspace(0.0, 1.0, len(knots))[:, None] * rng.normal(size=3) * len(knots)
    fine = CubicSpline(np.arange(len(knots)), knots)(np.linspace(0, len(knots) - 1, 600))
    fine -= (fine.min(axis=0) + fine.max(axis=0)) / 2.0
    half = np.asarray(setting.half)
    flat = half == 0.0
    fine[:, flat] = 0.0
    reach = np.abs(fine).max(axis=0)
    fine *= rng.uniform(0.6, 1.0) * float((half[~flat] / reach[~flat]).min())
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))])
    even = np.linspace(0.0, s[-1], int(rng.integers(setting.waypoints[0], setting.waypoints[1] + 1)))
    spaced = np.stack([np.interp(even, s, fine[:, axis]) for axis in range(3)], axis=1)
    return np.asarray(np.round(spaced + np.asarray(setting.center), 5))


def _object(rng: Generator, setting: Setting, positions: Array, name: str) -> SceneObject | None:
    """An object at 8 to 30 % of the extent beside the path, clear of it; None if no place was found."""
    extent = float(np.linalg.norm(np.ptp(positions, axis=0)))
    for _ in range(20):
        size = None if setting.sizes is None else np.round(rng.uniform(*setting.sizes, size=3), 3)
        away = rng.normal(size=3)
        away[np.asarray(setting.half) == 0.0] = 0.0
        away *= rng.uniform(0.08, 0.3) * extent / np.linalg.norm(away)
        place = np.round(positions[rng.integers(len(positions))] + away, 4)
        radius = 0.05 if size is None else float(np.linalg.norm(size)) / 2.0
        if float(path_distances(positions, place[None])[0]) >= radius + 0.05 * extent:
            return SceneObject(name, place, size)
    return None
