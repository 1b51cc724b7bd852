"""How a path bends and turns."""

from __future__ import annotations

import numpy as np

from ovita.paths.geometry import SAME_PLACE, fractions
from ovita.paths.trajectory import Array, interpolate, source_indices

SAMPLES = 60
"""Points at which two paths are compared for their bends, evenly along each."""

WINDOW = 2
"""A bend is the angle between the chords over so many samples before and after."""

FLAT = 0.05
"""A closed curve whose third extent is below this share of its first is flat, and round if its radius varies less."""


def bends(positions: Array) -> Array:
    """Angles (SAMPLES - 2 WINDOW,) [rad] by which a path (N, 3) turns, sampled evenly along its length."""
    points = interpolate(positions, source_indices(positions, SAMPLES, "arc_length"))
    before = points[WINDOW:-WINDOW] - points[: -2 * WINDOW]
    behind = points[2 * WINDOW :] - points[WINDOW:-WINDOW]
    return _angles(before, behind)


def turns_at(positions: Array) -> Array:
    """The bend (N,) [rad] of a path (N, 3) near each of its waypoints."""
    angles = bends(positions)
    places = (np.arange(len(angles)) + WINDOW) / (SAMPLES - 1)
    return np.interp(fractions(positions), places, angles)


def net_turning(points: Array, normal: Array) -> Array:
    """Turning (K,) [rad] accumulated up to each point (K, 3), seen along a normal (3,), anticlockwise positive."""
    u = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    total = np.zeros(len(points))
    steps = np.diff(points, axis=0)
    flat = np.column_stack([steps @ u, steps @ v])
    moving = np.flatnonzero(np.linalg.norm(flat, axis=1) > SAME_PLACE)
    if len(moving) < 2:
        return total
    heading = np.arctan2(flat[moving, 1], flat[moving, 0])
    turn = (np.diff(heading) + np.pi) % (2.0 * np.pi) - np.pi
    total[moving[1:]] = turn
    return np.cumsum(total)


def normals(points: Array) -> Array:
    """Directions (K, 3) from which to look for loops: the axes, those of the points (N, 3), and 24 more."""
    k = np.arange(24)
    height = 1.0 - (k + 0.5) / 24
    around = k * np.pi * (3.0 - np.sqrt(5.0))
    radius = np.sqrt(1.0 - height**2)
    spread = np.column_stack([radius * np.cos(around), radius * np.sin(around), height])
    return np.concatenate([np.eye(3), principal(points)[1], spread])


def principal(points: Array) -> tuple[Array, Array]:
    """Extents (3,) [m] and directions (3, 3), rows, of points (N, 3), largest first."""
    _, size, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=len(points) < 3)
    extents = np.zeros(3)
    extents[: len(size)] = size
    return extents, axes[:3]


def is_circle(points: Array) -> bool:
    """Whether points (N, 3) lie flat at one distance from one centre."""
    if len(points) < 4:
        return False
    size, axes = principal(points)
    flat = (points - points.mean(axis=0)) @ axes[:2].T
    if size[2] > FLAT * size[0]:
        return False
    system = np.column_stack([2.0 * flat, np.ones(len(flat))])
    solution, *_ = np.linalg.lstsq(system, (flat**2).sum(axis=1), rcond=None)
    radius = np.linalg.norm(flat - solution[:2], axis=1)
    return bool(np.median(np.abs(radius - np.median(radius))) <= FLAT * np.median(radius))


def swept(positions: Array, centre: Array, axis: Array) -> Array:
    """Angle (K,) [rad] of a path (N, 3) around an axis (3,) through a centre (3,), sampled finely."""
    points = interpolate(positions, source_indices(positions, 2000, "arc_length")) - centre
    u = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    u /= np.linalg.norm(u)
    return np.asarray(np.unwrap(np.arctan2(points @ np.cross(axis, u), points @ u)))


def _angles(a: Array, b: Array) -> Array:
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1)))
