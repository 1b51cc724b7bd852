"""Weights along a path: how strongly each waypoint takes part in an edit."""

from __future__ import annotations

import numpy as np

from ovita.paths.geometry import Mask, runs
from ovita.paths.trajectory import Array, arc_length

ROUNDING = 1e-9
"""Weights nearer than this to 0 or 1 are taken for it."""


def smoothstep(x: Array) -> Array:
    """The cubic 3x^2 - 2x^3 of x clipped to [0, 1]; flat at both ends."""
    t = snapped(x)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def snapped(x: Array) -> Array:
    """Clip x to [0, 1]; what rounding keeps from 0 or 1 becomes exactly that, so that edges are bit-identical."""
    return np.where(x < ROUNDING, 0.0, np.where(x > 1.0 - ROUNDING, 1.0, x))


def eased(mask: Mask, positions: Array, ease: float) -> Array:
    """Weights (N,) that are 0 outside a mask and rise to 1 inside it.

    Args:
        mask: (N,).
        positions: (N, 3) [m].
        ease: Length of a rise as a fraction of the path's length; shortened to half of a short run. The
            start and the goal of the path are no edges of a mask, so there is no rise there.
    """
    weights = mask.astype(np.float64)
    s = arc_length(positions)
    if ease == 0.0 or s[-1] == 0.0:
        return weights
    last = len(mask) - 1
    for a, b in runs(mask):
        before, after = s[max(a - 1, 0)], s[min(b + 1, last)]
        span = min(ease * s[-1], (after - before) / 2.0)
        if span <= 0.0:
            continue
        inside = slice(a, b + 1)
        if a > 0:
            weights[inside] = np.minimum(weights[inside], smoothstep((s[inside] - before) / span))
        if b < last:
            weights[inside] = np.minimum(weights[inside], smoothstep((after - s[inside]) / span))
    return weights


def headings(positions: Array) -> Array:
    """Unit vectors (N, 3) of the local path direction (central difference); zero where the path does not move."""
    n = len(positions)
    i = np.arange(n)
    steps = positions[np.minimum(i + 1, n - 1)] - positions[np.maximum(i - 1, 0)]
    lengths = np.linalg.norm(steps, axis=1, keepdims=True)
    return np.asarray(np.divide(steps, lengths, out=np.zeros_like(steps), where=lengths > 0))


def perpendicular(directions: Array) -> Array:
    """Unit vectors (N, 3) perpendicular to directions (N, 3), horizontal where the direction is not vertical."""
    sideways = np.cross(directions, np.array([0.0, 0.0, 1.0]))
    lengths = np.linalg.norm(sideways, axis=1, keepdims=True)
    usual = np.divide(sideways, lengths, out=np.zeros_like(sideways), where=lengths > 1e-9)
    return np.where(lengths > 1e-9, usual, np.array([1.0, 0.0, 0.0]))


def final_heading(positions: Array) -> Array:
    """Unit vector (3,) of the last segment that has a length.

    Raises:
        ValueError: If the path has no length.
    """
    steps = np.diff(positions, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    moving = np.flatnonzero(lengths > 0)
    if not len(moving):
        raise ValueError("all waypoints of the trajectory are at one point, so it has no heading")
    return np.asarray(steps[moving[-1]] / lengths[moving[-1]])
