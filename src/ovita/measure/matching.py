"""Which waypoint of the original belongs to which of the adapted trajectory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ovita.measure.report import Matching
from ovita.paths.trajectory import Array, Trajectory, arc_length, interpolate

Mask = NDArray[np.bool_]


def dwells(trajectory: Trajectory) -> Mask:
    """Which waypoints are dwells (they repeat the one before at speed 0), (N,)."""
    repeated = (np.diff(trajectory.positions, axis=0) == 0).all(axis=1) & (trajectory.speeds[1:] == 0)
    return np.concatenate([np.zeros(1, dtype=bool), repeated])


def match(original: Trajectory, adapted: Trajectory) -> tuple[Matching, Array, Mask]:
    """Original rows (M, 4) that belong to the adapted waypoints, and which of these to compare (M,)."""
    rows = original.to_array()
    if len(original) == len(adapted):
        return "waypoint", rows, np.ones(len(adapted), dtype=bool)
    rows, compared = rows[~dwells(original)], ~dwells(adapted)
    kept = adapted.positions[compared]
    owner = np.cumsum(compared) - 1
    if len(rows) == len(kept):
        return "waypoint without dwells", rows[owner], compared
    return "arc length", interpolate(rows, _align(rows[:, :3], kept))[owner], compared


def _align(p: Array, q: Array) -> Array:
    """Fractional index in path p (N, 3) for each point of path q (M, 3)."""
    head, tail = _shared(p, q)
    if head + tail == 0:
        head, tail = (k + 1 if k else 0 for k in _shared(np.diff(p, axis=0), np.diff(q, axis=0)))
        tail = min(tail, min(len(p), len(q)) - head)
    front, back = max(head - 1, 0), max(tail - 1, 0)
    inner_p, inner_q = p[front : len(p) - back], q[front : len(q) - back]
    middle = front + np.interp(fractions(inner_q), fractions(inner_p), np.arange(len(inner_p), dtype=float))
    return np.concatenate([np.arange(front), middle, len(p) - back + np.arange(back)])


def _shared(p: Array, q: Array) -> tuple[int, int]:
    """How many leading rows and how many further trailing rows two arrays share."""
    n = min(len(p), len(q))
    if n == 0:
        return 0, 0
    near = 1e-9 * max(1.0, float(np.abs(p).max()))
    head = int(np.cumprod((np.abs(p[:n] - q[:n]) <= near).all(axis=1)).sum())
    tail = int(np.cumprod((np.abs(p[-n:][::-1] - q[-n:][::-1]) <= near).all(axis=1)).sum())
    return head, min(tail, n - head)


def fractions(positions: Array) -> Array:
    """Share of the path's length travelled up to each point, (N,) from 0 to 1; by index if it has no length."""
    s = arc_length(positions)
    return s / s[-1] if s[-1] > 0 else np.linspace(0.0, 1.0, len(s))
