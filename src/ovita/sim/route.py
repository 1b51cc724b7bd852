"""The way a robot goes: the path of a trajectory with rounded corners, cut where the robot comes to rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ovita.paths.trajectory import REST, Array, Trajectory

SAMPLES = 2000
"""Most samples of a whole route that even spacing adds."""


@dataclass(frozen=True)
class Hold:
    """A dwell.

    Args:
        where: The waypoints (first, last) that it lasts from and to; they share one position.
        duration: [s].
    """

    where: tuple[int, int]
    duration: float


@dataclass(frozen=True)
class Move:
    """A stretch of the path that begins and ends at rest.

    Args:
        arc: (M,) distance along the path without rounding, ascending from 0 [m].
        points: (M, 3) samples of the rounded path [m].
        where: (M,) the place of each sample, counted in waypoints: 2.5 is midway between waypoints 2 and 3.
        speeds: (M,) what the time law allows there [m/s].
    """

    arc: Array
    points: Array
    where: Array
    speeds: Array

    @property
    def tangents(self) -> Array:
        """(M, 3) direction of the path at each sample, not normalised."""
        return np.asarray(np.gradient(self.points, self.arc, axis=0, edge_order=2))


def route(trajectory: Trajectory, *, corner: float, stop_angle: float, spacing: float) -> list[Move | Hold]:
    """Split a trajectory into moves and dwells.

    A robot rests at the start, at the goal, at waypoints with speed 0 and where the path turns by more than
    `stop_angle`. Every other corner is rounded so that the path stays within about `corner` of it.

    Args:
        trajectory: In any frame.
        corner: Greatest distance from the path at a corner [m].
        stop_angle: [rad].
        spacing: Of the samples, at most [m]; wider on paths that are very long.
    """
    positions, speeds, durations = trajectory.positions, trajectory.speeds, trajectory.durations
    lengths = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    even = max(spacing, float(lengths.sum()) / SAMPLES)
    pieces: list[Move | Hold] = []
    legs: list[int] = []

    def close() -> None:
        if legs:
            pieces.append(_move(trajectory, legs, corner, even, 0.1 * spacing))
            legs.clear()

    for i, length in enumerate(lengths):
        if length == 0.0:
            if durations[i] > 0.0:
                close()
                last = pieces[-1] if pieces else None
                if isinstance(last, Hold) and last.where[1] == i:
                    pieces[-1] = Hold((last.where[0], i + 1), last.duration + float(durations[i]))
                else:
                    pieces.append(Hold((i, i + 1), float(durations[i])))
            continue
        if legs and (speeds[i] <= REST or _turn(positions, legs[-1], i) > stop_angle):
            close()
        legs.append(i)
    close()
    return pieces


def _spread(knots: Array, wished: Array, gap: float) -> Array:
    """All knots (K,) and those of the other values (M,) that keep `gap` from the knots and from one another, sorted."""
    after = np.searchsorted(knots, wished).clip(1, len(knots) - 1)
    free = np.minimum(np.abs(wished - knots[after - 1]), np.abs(knots[after] - wished)) >= gap
    kept: list[float] = []
    for value in wished[free].tolist():
        if not kept or value - kept[-1] >= gap:
            kept.append(value)
    return np.sort(np.concatenate([knots, kept]))


def _turn(positions: Array, before: int, after: int) -> float:
    a, b = positions[before + 1] - positions[before], positions[after + 1] - positions[after]
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b)))


def _move(trajectory: Trajectory, legs: list[int], corner: float, spacing: float, gap: float) -> Move:
    """Sample the legs (segments that have a length) between two rests, with rounded corners.

    A corner that turns the direction by d is rounded over a width w on both sides of it: at the distance x along the
    path from the corner, the path is shifted by d (w - |x|)^3 / (6 w^2). This is the mean of the path under a triangle,
    and its curvature has no jumps; at the corner itself the shift is |d| w / 6.
    """
    positions, speeds = trajectory.positions, trajectory.speeds
    starts, ends = positions[legs], positions[np.array(legs) + 1]
    lengths = np.linalg.norm(ends - starts, axis=1)
    directions = (ends - starts) / lengths[:, None]
    knots = np.concatenate([[0.0], np.cumsum(lengths)])
    bends = np.diff(directions, axis=0)
    sharp = np.linalg.norm(bends, axis=1)
    widths = np.minimum(6.0 * corner / np.maximum(sharp, 1e-9), np.minimum(lengths[:-1], lengths[1:]))

    near = (knots[1:-1, None] + widths[:, None] * np.linspace(-1.5, 1.5, 13)).clip(0.0, knots[-1])
    even = np.linspace(0.0, knots[-1], max(8, int(np.ceil(knots[-1] / spacing))) + 1)
    arc = _spread(knots, np.sort(np.concatenate([even, near.ravel()])), min(gap, knots[-1] / 10.0))
    leg = np.clip(np.searchsorted(knots, arc, side="right") - 1, 0, len(legs) - 1)
    share = np.clip((arc - knots[leg]) / lengths[leg], 0.0, 1.0)
    points = starts[leg] + (arc - knots[leg])[:, None] * directions[leg]
    for knot, width, bend in zip(knots[1:-1], widths, bends, strict=True):
        inside = slice(*np.searchsorted(arc, [knot - width, knot + width]))
        points[inside] += ((width - np.abs(arc[inside] - knot)).clip(0.0) ** 3 / (6.0 * width**2))[:, None] * bend
    first = np.array(legs)[leg]
    allowed = np.sqrt(speeds[first] ** 2 * (1 - share) + speeds[first + 1] ** 2 * share)
    if len(legs) == 1 and speeds[legs[0]] + speeds[legs[0] + 1] <= REST:
        allowed = np.full(len(arc), lengths[0] / trajectory.timestep)
    return Move(arc, points, first + share, allowed)
