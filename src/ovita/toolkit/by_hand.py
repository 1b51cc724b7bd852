"""What a hand does to a path: pull a waypoint, put one in, take some out, draw where it should go."""

from __future__ import annotations

from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.geometry import fractions, runs
from ovita.paths.scene import RFU, Frame
from ovita.paths.trajectory import Array, arc_length, interpolate, source_indices
from ovita.toolkit import arguments
from ovita.toolkit.arguments import Offset, smoothstep
from ovita.toolkit.catalogue import operation

_KNOTS = 60
"""So many points of a part are fitted to a stroke; what lies between them follows."""


@operation("Waypoints", core=False)
def pull_waypoint(
    traj: ArrayLike, at: int, *, width: float = 0.1, frame: Frame = RFU, **offset: Unpack[Offset]
) -> Array:
    """Pull one waypoint by OFFSET.

    Its neighbours follow, less and less; start and goal stay.

    Args:
        at: Index of the waypoint.
        offset: Direction words and metres of it, such as left=0.2.
        width: Fraction (0..1) of the path's length on either side that follows; 0 for that waypoint alone.
    """
    rows = arguments.waypoints(traj)
    index = arguments.locate(rows, arguments.integer(at, "at", -len(rows), len(rows) - 1))
    span = arguments.number(width, "width", low=0.0, high=1.0)
    away = np.abs(fractions(rows[:, :3]) - fractions(rows[:, :3])[index])
    weights = smoothstep(1.0 - away / span) if span > 0.0 else np.zeros(len(rows))
    weights[[0, -1]] = 0.0
    weights[index] = 1.0
    rows[:, :3] += weights[:, None] * arguments.offset(frame, offset)
    return rows


@operation("Waypoints", core=False)
def insert_waypoint(traj: ArrayLike, after: int) -> Array:
    """Put a waypoint in.

    It lies midway between the one before it and the one behind it.

    Args:
        traj: (N, 4); the result is (N + 1, 4).
        after: Index of the waypoint before it, from 0 to N - 2.
    """
    rows = arguments.waypoints(traj)
    index = arguments.integer(after, "after", 0, len(rows) - 2)
    return np.insert(rows, index + 1, (rows[index] + rows[index + 1]) / 2.0, axis=0)


@operation("Waypoints", core=False)
def delete_waypoints(traj: ArrayLike, first: int, last: int) -> Array:
    """Take waypoints out.

    The path goes straight over the gap.

    Args:
        traj: (N, 4); at least 2 waypoints stay.
        first: Index of the first that goes.
        last: Index of the last that goes.
    """
    rows = arguments.waypoints(traj)
    begin, end = (arguments.integer(i, name, 0, len(rows) - 1) for i, name in ((first, "first"), (last, "last")))
    kept = np.delete(rows, np.arange(begin, end + 1), axis=0)
    if len(kept) < 2 or end < begin:
        raise ValueError(f"waypoints {begin} to {end} of {len(rows)} cannot go: at least 2 stay, in this order")
    return np.asarray(kept)


@operation("Waypoints", core=False)
def follow_stroke(
    traj: ArrayLike,
    stroke: ArrayLike,
    *,
    stiffness: float = 0.2,
    where: ArrayLike | None = None,
    keep_ends: bool = False,
) -> Array:
    """Follow a drawn line.

    The stiffer the path, the more it keeps of its shape: of all displacements it takes the one with the least
    (1 - stiffness) times the squared distance to the stroke plus stiffness times the squared bending. It blends into
    the rest: an end of the part that lies inside the path stays.

    Args:
        stroke: Points (M, 3) [m], M >= 2, from the part's first waypoint to its last; only its shape counts.
        stiffness: 0 follows the line exactly, 1 only as a whole.
        where: Mask (N,) of the part, None for the whole path; of several runs the longest.
        keep_ends: Whether the start and the goal of the path stay, too.
    """
    rows = arguments.waypoints(traj)
    line = np.array(stroke, dtype=np.float64)
    if line.ndim != 2 or line.shape[1] != 3 or len(line) < 2 or not np.isfinite(line).all():
        raise ValueError("stroke must be points (M, 3) in metres, at least 2")
    stiff = arguments.number(stiffness, "stiffness", low=0.0, high=1.0)
    parts = sorted(runs(arguments.mask(where, len(rows))), key=lambda run: run[1] - run[0])
    if not parts or parts[-1][1] - parts[-1][0] < 2:
        raise ValueError("the part that follows the stroke needs at least 3 waypoints; choose a longer one")
    a, b = parts[-1]
    part = rows[a : b + 1, :3]
    count = min(len(part), _KNOTS)
    wanted = interpolate(line, source_indices(line, count, "arc_length"))
    knots = interpolate(part, source_indices(part, count, "arc_length"))
    shift = _bent(wanted - knots, stiff, fixed=(keep_ends or a > 0, keep_ends or b < len(rows) - 1))
    along = arc_length(part) / max(arc_length(part)[-1], 1e-12)
    places = np.linspace(0.0, 1.0, count)
    rows[a : b + 1, :3] += np.stack([np.interp(along, places, column) for column in shift.T], axis=1)
    return rows


def _bent(wanted: Array, stiffness: float, fixed: tuple[bool, bool]) -> Array:
    """The displacements (M, 3) nearest to those wanted that bend little; a fixed end does not move."""
    count = len(wanted)
    bend = np.diff(np.eye(count), 2, axis=0) * (count / 6.0) ** 2  # a sixth of the part is what 0.5 smooths away
    matrix = max(1.0 - stiffness, 1e-6) * np.eye(count) + stiffness * bend.T @ bend
    inner = slice(int(fixed[0]), count - int(fixed[1]))
    found = np.zeros_like(wanted)
    found[inner] = np.linalg.solve(matrix[inner, inner], max(1.0 - stiffness, 1e-6) * wanted[inner])
    return found
