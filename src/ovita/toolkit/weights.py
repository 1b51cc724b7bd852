"""Weights of waypoints in an edit."""

from __future__ import annotations

import numpy as np

from ovita.paths.geometry import Mask, runs
from ovita.paths.trajectory import Array, arc_length

ROUNDING = 1e-9
"""Weights nearer than this to 0 or 1 are taken for it."""

GENTLE = 3.0
"""Length of a blend per metre of shift. As smoothstep is at most 1.5 times as steep as a line, a path that is pushed
back along its own heading still goes forward, and one that is pushed aside turns by no more than 27 degrees."""


def smoothstep(x: Array) -> Array:
    """The cubic 3x^2 - 2x^3 of x clipped to [0, 1]; flat at both ends."""
    t = snapped(x)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def snapped(x: Array) -> Array:
    """Clip x to [0, 1]; what rounding keeps from 0 or 1 becomes exactly that, so that edges are bit-identical."""
    return np.where(x < ROUNDING, 0.0, np.where(x > 1.0 - ROUNDING, 1.0, x))


def eased(mask: Mask, positions: Array, ease: float | None, shift: float = 0.0) -> Array:
    """Weights (N,) that are 0 outside a mask and rise to 1 inside it; each unbroken run has a waypoint of weight 1.

    Args:
        mask: (N,).
        positions: (N, 3) [m].
        ease: Length of a rise as a fraction of the path's length, shortened to half of a short run; 0 for a jump. None
            for 3 times the shift, shortened so that at least half of the run has weight 1. The start and the goal of
            the path are no edges of a mask, so there is no rise there.
        shift: How far the edit moves a waypoint [m].
    """
    weights = mask.astype(np.float64)
    s = arc_length(positions)
    if ease == 0.0 or s[-1] == 0.0:
        return weights
    last = len(mask) - 1
    for a, b in runs(mask):
        before, after = s[max(a - 1, 0)], s[min(b + 1, last)]
        edges = int(a > 0) + int(b < last)
        wanted, most = (GENTLE * shift, 2 * max(edges, 1)) if ease is None else (ease * s[-1], 2)
        span = min(wanted, (after - before) / most)
        if span <= 0.0:
            continue
        inside = slice(a, b + 1)
        if a > 0:
            weights[inside] = np.minimum(weights[inside], smoothstep((s[inside] - before) / span))
        if b < last:
            weights[inside] = np.minimum(weights[inside], smoothstep((after - s[inside]) / span))
        peak = float(weights[inside].max())
        # Between repeats of a waypoint there is no room for a rise.
        weights[inside] = weights[inside] / peak if peak > 0.0 else 1.0
    return weights


def blended(rows: Array, target: Array, selected: Mask, ease: float | None) -> Array:
    """Rows whose selected waypoints go to a target (N, 3) [m], in full inside a run and less toward its edges.

    Args:
        rows: (N, 3+); what is not selected stays as it is.
        target: (N, 3) [m].
        selected: (N,).
        ease: As for `eased`.
    """
    shift = target - rows[:, :3]
    most = float(np.linalg.norm(shift[selected], axis=1).max()) if selected.any() else 0.0
    weights = eased(selected, rows[:, :3], ease, most)
    full, part = weights == 1.0, (weights > 0.0) & (weights < 1.0)
    rows[full, :3] = target[full]
    rows[part, :3] += weights[part, None] * shift[part]
    return rows


def followed(rows: Array, moved: Array, selected: Mask, ease: float | None) -> Array:
    """Rows of which a part went elsewhere, with the neighbours of that part following; start and goal never follow.

    Args:
        rows: (N, 3+) before; they are changed.
        moved: (N, 3) [m] where the selected waypoints are now; they get there in full.
        selected: (N,).
        ease: Length over which the shift at an edge of the part fades out, as a fraction of the path's length; 0 for a
            jump, None for 3 times the shift.
    """
    s, last = arc_length(rows[:, :3]), len(rows) - 1
    shift, edges = moved - rows[:, :3], list(runs(selected))
    borders = [0, *(index for edge in edges for index in edge), last]
    follow = np.zeros_like(shift)
    for k, (a, b) in enumerate(edges):
        for edge, border in ((a, borders[2 * k]), (b, borders[2 * k + 3])):
            size = float(np.linalg.norm(shift[edge]))
            # Between two parts, each has half of the way for its fading.
            room = abs(s[edge] - s[border]) * (1.0 if border in (0, last) and not selected[border] else 0.5)
            span = min(GENTLE * size if ease is None else ease * s[-1], room)
            if span <= 0.0 or size == 0.0:
                continue
            low, high = (border, edge) if border < edge else (edge + 1, border + 1)
            outside = np.arange(low, high)
            follow[outside] += smoothstep(1.0 - np.abs(s[outside] - s[edge]) / span)[:, None] * shift[edge]
    beside = ~selected & (follow != 0.0).any(axis=1)
    beside[[0, last]] = False
    rows[beside, :3] += follow[beside]
    rows[selected, :3] = moved[selected]
    return rows


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
