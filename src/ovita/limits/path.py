"""The path's part of the problem, as `route` and `sequential` share it, and the workspace as the solver sees it.

Paper: a box lower + delta <= x_i <= upper - delta, or a spherical shell r_min + delta <= |x_i - c| <= r_max - delta.
The box and the ball of r_max are convex: if two waypoints are inside, so is the segment between them. The ball of
r_min is an obstacle like any other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ovita.limits.custom import Ball, ConvexSet
from ovita.limits.problem import Obstacle
from ovita.limits.qp import Rows, Weights
from ovita.paths.geometry import lengths
from ovita.paths.robot import Box, Robot, Shell
from ovita.paths.trajectory import Array

PAD = 5e-6
"""How much further than asked the solver stays away, so that rounding cannot break a limit [m]."""

RowMaker: TypeAlias = Callable[[Array], Rows]
"""Linearises a constraint: the rows that a path must obey, valid near a path (N, 3)."""

GRAZE = 5e-7
"""A distance this far below the limit still counts as legal, half of what `verify` allows [m]."""


@dataclass(frozen=True, eq=False)
class PathProblem:
    """Where the waypoints may be, and where they would like to be.

    Args:
        reference: x_ref (N, 3) [m].
        weights: Of the objective.
        lower: Lowest legal coordinate (3,) [m].
        upper: Highest legal coordinate (3,) [m].
        bodies: What every segment must stay out of.
        regions: Convex sets that every waypoint must be in.
        pins: Waypoints that stay at the reference, ascending.
        rows: Linearisations of further constraints, each a function of the path (N, 3).
    """

    reference: Array
    weights: Weights
    lower: Array
    upper: Array
    bodies: tuple[Obstacle, ...] = ()
    regions: tuple[ConvexSet, ...] = ()
    pins: tuple[int, ...] = ()
    rows: tuple[RowMaker, ...] = ()

    @property
    def axes(self) -> NDArray[np.bool_]:
        """Which axes a waypoint can move along, (3,): a ground robot has no z."""
        return np.asarray(self.upper > self.lower)

    @property
    def pinned(self) -> NDArray[np.bool_]:
        """(N,) whether a waypoint must stay."""
        mask = np.zeros(len(self.reference), dtype=bool)
        if self.pins:
            mask[list(self.pins)] = True
        return mask

    def project(self, points: Array) -> Array:
        """Points (M, 3) moved into the convex part of the workspace, by alternating projections."""
        for _ in range(50 if len(self.regions) > 1 else 2):
            points = np.clip(points, self.lower, np.maximum(self.lower, self.upper))
            if not any((region.excess(points) > 0).any() for region in self.regions):
                break
            for region in self.regions:
                points = region.project(points)
        return points

    def inside(self, points: Array) -> NDArray[np.bool_]:
        """(M,) whether points are in the workspace, bodies aside."""
        legal = np.asarray(((points >= self.lower - GRAZE) & (points <= self.upper + GRAZE)).all(axis=1))
        for region in self.regions:
            legal &= region.excess(points) <= GRAZE
        for make in self.rows:
            rows = make(points)
            broken = (rows.normals * points[rows.waypoints]).sum(axis=1) < rows.offsets - GRAZE
            legal[rows.waypoints[broken]] = False
        return legal

    def depth(self, points: Array) -> Array:
        """By how much points (M, 3) are inside the worst body, (M,) [m]; negative outside."""
        depths = [-body.signed(points)[0] for body in self.bodies]
        return np.max(depths, axis=0) if depths else np.full(len(points), -np.inf)

    def blocked(self, start: Array, end: Array, pad: float) -> NDArray[np.bool_]:
        """(M,) whether the segment from start (M, 3) or (1, 3) to end (M, 3) comes within `pad` > 0 of a body."""
        hit = np.zeros(len(end), dtype=bool)
        if not self.bodies:
            return hit
        start = np.broadcast_to(start, end.shape)
        centers, reaches = self._spheres
        apart = (start + end)[:, None, :] - 2.0 * centers
        within = lengths(apart) - lengths(end - start)[:, None] < 2.0 * (reaches + pad)
        for k in np.flatnonzero(within.any(axis=0)):
            near = np.flatnonzero(within[:, k] & ~hit)
            if len(near):
                hit[near] = self.bodies[k].hit(start[near], end[near], pad)
        return hit

    @cached_property
    def _spheres(self) -> tuple[Array, Array]:
        """Centres (B, 3) and radii (B,) of the bodies' bounding spheres."""
        return np.array([body.center for body in self.bodies]), np.array([body.reach for body in self.bodies])

    def stuck(self, body: Obstacle) -> NDArray[np.intp]:
        """Pinned waypoints inside a body: the segments at them cannot be helped."""
        pins = np.asarray(self.pins, dtype=np.intp)
        return pins[body.signed(self.reference[pins])[0] < -GRAZE] if len(pins) else pins

    def excused(self, body: Obstacle, segments: NDArray[np.intp]) -> NDArray[np.bool_]:
        """(M,) whether a segment touches a waypoint that is stuck in the body."""
        stuck = self.stuck(body)
        if not len(stuck):
            return np.zeros(len(segments), dtype=bool)
        return np.isin(segments, stuck) | np.isin(segments + 1, stuck)

    def bad(self, x: Array) -> NDArray[np.bool_]:
        """(N-1,) which segments of a path (N, 3) run through a body, as far as it can be helped."""
        bad = np.zeros(len(x) - 1, dtype=bool)
        free = ~self.pinned
        for body in self.bodies:
            near = body.near(x[:-1], x[1:], 0.0)
            if len(near):
                near = near[body.along(x[near], x[near + 1])[0] < -GRAZE]
            if not len(near):
                continue
            excused = self.excused(body, near)
            bad[near[~excused]] = True
            if not excused.any():
                continue
            for end in (near[excused], near[excused] + 1):
                inside = free[end] & (body.signed(x[end])[0] < -GRAZE)
                bad[near[excused][inside]] = True
        return bad

    def part(self, first: int, last: int) -> PathProblem:
        """The problem of the waypoints first..last, those two included."""
        pins = tuple(i - first for i in self.pins if first <= i <= last)
        return replace(self, reference=self.reference[first : last + 1], pins=pins)


def flatten(bodies: Sequence[Obstacle], lower: Array, upper: Array) -> tuple[Obstacle, ...]:
    """Bodies as a robot meets them that cannot move along some axis: exact for spheres and for upright cuboids."""
    flat: list[Obstacle] = []
    for body in bodies:
        kept: Obstacle | None = body
        for axis in np.flatnonzero(lower == upper):
            kept = None if kept is None else _slice(kept, int(axis), float(lower[axis]))
        if kept is not None:
            flat.append(kept)
    return tuple(flat)


def _slice(body: Obstacle, axis: int, level: float) -> Obstacle | None:
    """An upright body with the same section in the plane x[axis] = level; None if there is none."""
    own = np.abs(body.rotation[axis])
    if body.half.any() and own.max() < 1.0 - 1e-12:
        return body
    k = int(own.argmax())
    gap = max(abs(level - float(body.center[axis])) - float(body.half[k]), 0.0)
    if gap >= body.radius > 0:
        return None
    center, half = body.center.copy(), body.half.copy()
    if not half.any():
        center[axis] = level
        return replace(body, center=center, radius=float(np.sqrt(body.radius**2 - gap**2)))
    half[k] += gap + 10.0 * body.reach  # so that the way out is never along the axis that the robot lacks
    return replace(body, half=half, radius=float(np.sqrt(max(body.radius**2 - gap**2, 0.0))))


def bounds(robot: Robot) -> tuple[Array, Array]:
    """Lowest and highest legal coordinate, (3,) and (3,) [m]; infinite where the workspace has no flat wall."""
    if not isinstance(robot.workspace, Box):
        return np.full(3, -np.inf), np.full(3, np.inf)
    lower = np.asarray(robot.workspace.lower) + robot.margin
    upper = np.asarray(robot.workspace.upper) - robot.margin
    flat = np.abs(upper - lower) < 1e-12
    middle = (lower + upper) / 2.0
    return np.where(flat, middle, lower), np.where(flat, middle, upper)


def ball(robot: Robot) -> tuple[Ball, ...]:
    """The ball that the path must stay in, if there is one: a manipulator's reach less the margin."""
    if not isinstance(robot.workspace, Shell):
        return ()
    return (Ball(robot.workspace.center, robot.workspace.r_max - robot.margin, "reach"),)


def keep_out(robot: Robot) -> tuple[Obstacle, ...]:
    """The inner sphere of a shell as an obstacle, if there is one."""
    shell = robot.workspace
    if not isinstance(shell, Shell) or shell.r_min <= 0:
        return ()
    radius = shell.r_min + robot.margin
    return (Obstacle(np.asarray(shell.center), np.eye(3), np.zeros(3), radius, "workspace", "workspace"),)
