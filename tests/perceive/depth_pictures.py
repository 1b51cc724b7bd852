"""Depth pictures of boxes, cylinders and balls on a table, cast exactly, with no renderer."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ovita.perceive import View

COLOURS = {"red": (200, 30, 30), "blue": (30, 60, 200), "green": (30, 150, 50), "yellow": (220, 200, 30)}
TABLE = (150, 140, 130)


@dataclass(frozen=True)
class Thing:
    """A solid with ground truth."""

    kind: str
    position: tuple[float, float, float]
    size: tuple[float, float, float]
    yaw: float = 0.0
    colour: str = "red"
    turn: np.ndarray | None = None

    @property
    def rotation(self) -> np.ndarray:
        c, s = np.cos(self.yaw), np.sin(self.yaw)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) if self.turn is None else self.turn


def camera(eye, target=(0.0, 0.0, 0.0)):
    """Camera to world, looking at a target, the picture's bottom down."""
    z = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
    x = np.cross(z, (0.0, 0.0, 1.0))
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    pose[:3, 3] = eye
    return pose


def picture(things, eye=(-0.7, 0.0, 0.6), target=(0.0, 0.0, 0.0), size=(160, 120), noise=0.0, seed=0, table=True):
    """What a camera at `eye` sees of things on the table z = 0."""
    wide, high = size
    f = 0.95 * wide
    k = np.array([[f, 0.0, (wide - 1) / 2], [0.0, f, (high - 1) / 2], [0.0, 0.0, 1.0]])
    blank = View(np.ones((high, wide)), k, camera(eye, target))
    rays, eye = (blank.points - blank.center).reshape(-1, 3), np.asarray(eye, dtype=float)
    depth, rgb = np.full(len(rays), np.nan), np.zeros((len(rays), 3), dtype=np.uint8)
    if table:
        with np.errstate(divide="ignore"):
            t = -eye[2] / rays[:, 2]
        hit = (t > 0) & (np.abs(eye[:2] + t[:, None] * rays[:, :2]).max(axis=1) < 1.5)
        depth[hit], rgb[hit] = t[hit], TABLE
    for thing in things:
        t = cast(thing, eye, rays)
        near = t < np.where(np.isnan(depth), np.inf, depth)
        shade = 0.6 + 0.4 * np.linspace(0, 1, len(rays))[:, None]
        depth[near], rgb[near] = t[near], (shade * COLOURS[thing.colour]).astype(np.uint8)[near]
    if noise:
        depth += noise * depth**2 * np.random.default_rng(seed).standard_normal(len(depth))
    return View(depth.reshape(high, wide), k, blank.pose, rgb.reshape(high, wide, 3), "a picture")


def cast(thing, eye, rays):
    """Depth at which rays hit a solid, infinite where they miss."""
    a, d = (eye - thing.position) @ thing.rotation, rays @ thing.rotation
    half = np.array(thing.size) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        if thing.kind == "box":
            low, high = (-half - a) / d, (half - a) / d
            into, out = np.minimum(low, high).max(axis=1), np.maximum(low, high).min(axis=1)
            return np.where((into <= out) & (into > 0), into, np.inf)
        n = 3 if thing.kind == "sphere" else 2
        aa, ab = (d[:, :n] ** 2).sum(axis=1), d[:, :n] @ a[:n]
        under = ab**2 - aa * (a[:n] @ a[:n] - half[0] ** 2)
        root = np.sqrt(np.maximum(under, 0.0))
        into, out = (-ab - root) / aa, (-ab + root) / aa
        if n == 2:
            low, high = (-half[2] - a[2]) / d[:, 2], (half[2] - a[2]) / d[:, 2]
            into, out = np.maximum(into, np.minimum(low, high)), np.minimum(out, np.maximum(low, high))
        return np.where((under > 0) & (into <= out) & (into > 0), into, np.inf)


def tilted(axis, degrees):
    """A rotation about a world axis."""
    return Rotation.from_euler(axis, degrees, degrees=True).as_matrix()
