"""How close a path comes to an object, between its waypoints too."""

from __future__ import annotations

import numpy as np

from ovita.measure.matching import dwells
from ovita.measure.report import ObjectChange, Span
from ovita.paths.scene import SceneObject
from ovita.paths.trajectory import Array, Trajectory

NEIGHBOURHOOD = 0.25
"""What counts as near an object: its bounding radius plus this share of the original path's diagonal."""


def object_change(item: SceneObject, original: Trajectory, adapted: Trajectory) -> ObjectChange:
    """Measure how both paths pass one object."""
    neighbourhood = item.radius + NEIGHBOURHOOD * float(np.linalg.norm(np.ptp(original.positions, axis=0)))
    (d0, i0), (d1, i1) = (closest_to_centre(item, t.positions) for t in (original, adapted))
    (c0, j0), (c1, j1) = (closest_to_surface(item, t.positions) for t in (original, adapted))
    speeds: list[float | None] = []
    for trajectory in (original, adapted):
        near = (item.distance(trajectory.positions) <= neighbourhood) & ~dwells(trajectory)
        speeds.append(float(trajectory.speeds[near].mean()) if near.any() else None)
    return ObjectChange(item.name, Span(d0, d1), Span(i0, i1), Span(c0, c1), Span(j0, j1), neighbourhood, *speeds)


def closest_to_centre(item: SceneObject, positions: Array) -> tuple[float, float]:
    """Exact distance [m] of a polyline to an object's centre, and the fractional waypoint where it occurs."""
    start, step = positions[:-1], np.diff(positions, axis=0)
    squared = (step**2).sum(axis=1)
    along = ((item.position - start) * step).sum(axis=1)
    t = np.clip(np.divide(along, squared, out=np.zeros_like(along), where=squared > 0), 0.0, 1.0)
    distances = item.distance(start + t[:, None] * step)
    i = int(np.argmin(distances))
    return float(distances[i]), float(i + t[i])


def closest_to_surface(item: SceneObject, positions: Array) -> tuple[float, float]:
    """Signed distance [m] of a polyline to a cuboid, and the fractional waypoint where it occurs.

    Along a segment the signed distance to a convex body is convex, so that sampling and then refining around
    the lowest sample converges to the minimum. Segments too far away to hold it are left out first.
    """
    at_points = item.clearance(positions)
    lengths = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    bound = np.minimum(at_points[:-1], at_points[1:]) - lengths / 2.0
    segments = np.flatnonzero(bound <= at_points.min())
    lower, upper = np.zeros(len(segments)), np.ones(len(segments))
    for _ in range(5):
        t = np.linspace(lower, upper, 17, axis=1)
        points = positions[segments, None] * (1.0 - t[..., None]) + positions[segments + 1, None] * t[..., None]
        values = item.clearance(points.reshape(-1, 3)).reshape(t.shape)
        best = values.argmin(axis=1)
        rows = np.arange(len(segments))
        lower, upper = t[rows, np.maximum(best - 1, 0)], t[rows, np.minimum(best + 1, 16)]
    lowest = values.min(axis=1)
    k = int(np.argmin(lowest))
    return float(lowest[k]), float(segments[k] + t[k, best[k]])
