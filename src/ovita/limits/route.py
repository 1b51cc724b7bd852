"""Detours around obstacles: a feasible initial path where the reference runs through one.

Each blocked stretch is replaced by a route around (`legal_path`), from the last legal waypoint before it to the first
one behind it, with the waypoints spread along the route so that whole segments are legal; `sequential` then pulls the
path back towards the reference. A route is the shortest polyline between two points that keeps clear of every body.

The corners of the polyline are taken from a cloud of points around the bodies (a visibility graph), refined in levels
if it is too coarse for a narrow gap. Edges are tested exactly, and only when the search asks for them. Deterministic.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, product
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ovita.limits.path import GRAZE, PAD, PathProblem
from ovita.limits.problem import Obstacle
from ovita.paths.geometry import lengths
from ovita.paths.trajectory import Array, arc_length

LEVELS = 4
"""How often the cloud of corners is refined before the search gives up."""

_SIGNS = np.array([s for s in product((-1.0, 0.0, 1.0), repeat=3) if any(s)])


def find_route(
    problem: PathProblem, start: Array, goal: Array, *, room: int | None = None
) -> Array | Literal["no route", "too few waypoints"]:
    """The shortest legal polyline from start (3,) to goal (3,).

    Args:
        problem: Whose bodies and workspace.
        start: A point [m]; bodies that it lies in do not block the way out of it, only the rest of the way.
        goal: A point [m]; likewise.
        room: Most corners that the polyline may have, or None for any number.

    Returns:
        The corners between the two, (K, 3) [m], or why there are none.
    """
    graph = _Graph(problem, start, goal)
    if not graph.blocked_direct:
        return np.zeros((0, 3))
    if room == 0:
        return "too few waypoints"
    known = False
    in_between = [body for body in problem.bodies if body.hit(start[None], goal[None], PAD)[0]]
    for level, bodies in [(0, in_between), *((level, problem.bodies) for level in range(LEVELS))]:
        cloud = corners(problem, level, np.stack([start, goal]), bodies)
        points = np.concatenate([start[None], goal[None], cloud])
        route = graph.search(points)
        if route is not None and room is not None and len(route) > room:
            known = True
            route = graph.search(points, room)
        if route is not None:
            return points[route]
        if known and level >= 1:
            break
    return "too few waypoints" if known else "no route"


def corners(problem: PathProblem, level: int, around: Array, bodies: Sequence[Obstacle] | None = None) -> Array:
    """Legal points (K, 3) near the bodies, more of them at each level; at the last ones also anywhere near."""
    clouds = [_around(body, level) for body in (problem.bodies if bodies is None else bodies)]
    if level >= 2:
        clouds.append(_scatter(problem, around, 150 * 4 ** (level - 2)))
    if not clouds:
        return np.zeros((0, 3))
    points = problem.project(np.concatenate(clouds))
    points[:, ~problem.axes] = problem.lower[~problem.axes]
    points = points[(problem.depth(points) < -PAD) & problem.inside(points)]
    return np.asarray(np.unique(np.round(points, 9), axis=0) if not problem.axes.all() else points)


def nearest_legal(problem: PathProblem, point: Array, count: int = 1) -> Array:
    """The legal points (K, 3), K <= count, nearest to a point (3,), nearest first."""
    pushed = push_out(problem, point)
    found = [] if pushed is None else [pushed]
    for level in (1, 2, 3):
        cloud = corners(problem, level, point[None])
        found += list(cloud[np.argsort(np.linalg.norm(cloud - point, axis=1))[:count]])
        if found:
            break
    found.sort(key=lambda p: float(np.linalg.norm(p - point)))
    return np.array(found[:count]).reshape(-1, 3)


def push_out(problem: PathProblem, point: Array) -> Array | None:
    """A legal point reached from a point (3,) by leaving the worst body again and again, or None."""
    moved = problem.project(point[None])[0]
    for _ in range(30):
        depths = [float(-body.signed(moved[None])[0][0]) for body in problem.bodies]
        worst = int(np.argmax(depths)) if depths else -1
        if worst < 0 or depths[worst] < -PAD:
            return np.asarray(moved)
        normal = problem.bodies[worst].signed(moved[None])[1][0] * problem.axes
        length = float(np.linalg.norm(normal))
        if length < 1e-6:
            return None
        moved = problem.project((moved + normal * ((depths[worst] + 2.0 * PAD) / length))[None])[0]
    return None


def _around(body: Obstacle, level: int) -> Array:
    """Points (K, 3) around one body, just far enough that the edges between neighbours pass it."""
    if body.half.any():
        gaps = (1.02,) if level == 0 else (1.0 + 1e-3, 1.3)
        local = np.concatenate([_SIGNS * (body.half + body.radius * gap + 2.0 * PAD) for gap in gaps])
        if level >= 1:
            long = np.maximum(body.half, 1e-9)
            local = np.concatenate([local, _sphere(80 * level) * (np.sqrt(3.0) * long + 1.1 * body.radius)])
    else:
        units = _SIGNS / np.linalg.norm(_SIGNS, axis=1, keepdims=True)
        local = units * (body.radius * 1.15 + PAD)
        if level >= 1:
            local = np.concatenate([local, *(_sphere(80 * level) * (body.radius * gap) for gap in (1.03, 1.4))])
    return np.asarray(body.center + local @ body.rotation.T)


def _sphere(count: int) -> Array:
    """Evenly spread unit vectors (count, 3): the golden spiral."""
    k = np.arange(count) + 0.5
    polar, azimuth = np.arccos(1.0 - 2.0 * k / count), np.pi * (1.0 + 5.0**0.5) * k
    return np.stack([np.cos(azimuth) * np.sin(polar), np.sin(azimuth) * np.sin(polar), np.cos(polar)], axis=1)


def _scatter(problem: PathProblem, around: Array, count: int) -> Array:
    """Quasi-random points (count, 3) over the region of the bodies and of the points (M, 3) around."""
    known = np.concatenate([around, *(body.center + body.reach * _SIGNS for body in problem.bodies)])
    low, high = known.min(axis=0), known.max(axis=0)
    steps = np.array([0.8191725133961645, 0.6710436067037893, 0.5497004779019703])
    return np.asarray(low + (0.5 + np.arange(1, count + 1)[:, None] * steps) % 1.0 * (high - low))


class _Graph:
    """The visibility graph on a cloud whose points 0 and 1 are start and goal."""

    def __init__(self, problem: PathProblem, start: Array, goal: Array) -> None:
        self.problem, self.start, self.goal = problem, start, goal
        self.leaving = self._without(problem, start)
        self.arriving = self._without(problem, goal)

    @staticmethod
    def _without(problem: PathProblem, point: Array) -> PathProblem:
        bodies = tuple(b for b in problem.bodies if b.signed(point[None])[0][0] >= -PAD)
        return problem if len(bodies) == len(problem.bodies) else replace(problem, bodies=bodies)

    @cached_property
    def blocked_direct(self) -> bool:
        """Whether the straight line from start to goal is blocked."""
        both = self._without(self.leaving, self.goal)
        return bool(both.blocked(self.start[None], self.goal[None], PAD)[0])

    def blocked(self, points: Array, i: int, others: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Whether the edges from point i to others are blocked."""
        here = points[i][None]
        hit = (self.leaving if i == 0 else self.problem).blocked(here, points[others], PAD)
        if i == 0:
            hit[others == 1] = self.blocked_direct
        elif self.arriving is not self.problem and (others == 1).any():
            hit[others == 1] = self.arriving.blocked(here, points[[1]], PAD)
        return hit

    def search(self, points: Array, room: int | None = None) -> list[int] | None:
        """A* from point 0 to point 1 by length, or with at most `room` points between by their number, then length."""
        ahead = lengths(points - points[1])
        price = 0.0 if room is None else 1e3 * max(float(ahead.max()), 1e-9)
        most = np.inf if room is None else price * (room + 1.5)
        cost = np.full(len(points), np.inf)
        cost[0] = 0.0
        parent = np.full(len(points), -1)
        done = np.zeros(len(points), dtype=bool)
        queue: list[tuple[float, int]] = [(float(ahead[0]), 0)]
        while queue:
            _, i = heapq.heappop(queue)
            if done[i]:
                continue
            done[i] = True
            if i == 1:
                return _trace(parent)
            reached = cost[i] + lengths(points - points[i]) + price
            better = np.flatnonzero(~done & (reached < np.minimum(cost, most)))
            better = better[~self.blocked(points, i, better)]
            cost[better] = reached[better]
            parent[better] = i
            for item in zip((cost[better] + ahead[better]).tolist(), better.tolist(), strict=True):
                heapq.heappush(queue, item)
        return None


def _trace(parent: NDArray[np.intp]) -> list[int]:
    route, i = [], int(parent[1])
    while i > 0:
        route.append(i)
        i = int(parent[i])
    return route[::-1]


Trouble = Literal["no route", "too few waypoints", "no legal point"]


@dataclass(frozen=True)
class Blocked:
    """A stretch between waypoints `first` and `last` for which there is no way.

    Args:
        first: Waypoint, pinned.
        last: Waypoint, pinned.
        why: "no route" between the two, "too few waypoints" to follow it, or "no legal point" at all.
    """

    first: int
    last: int
    why: Trouble


def legal_path(problem: PathProblem, x: Array) -> tuple[Array, tuple[Blocked, ...]]:
    """Move a path (N, 3) [m] out of every body.

    Returns:
        The path, and the stretches that stay blocked.
    """
    blocked: list[Blocked] = []
    runs = _runs(problem, x)
    if not runs:
        return x, ()
    x = x.copy()
    padded = replace(problem, bodies=tuple(replace(b, radius=b.radius + PAD) for b in problem.bodies))
    for _ in range(3):
        runs = [run for run in runs if not any(b.first <= run[0] and run[1] <= b.last for b in blocked)]
        if not runs:
            break
        for first, last in runs:
            trouble = _bypass(problem, padded, x, first, last)
            if trouble is not None:
                blocked.append(trouble)
        runs = _runs(problem, x)
    return x, tuple(blocked)


def _runs(problem: PathProblem, x: Array) -> list[tuple[int, int]]:
    """Blocked stretches as pairs of the waypoints around them, split where a waypoint is pinned."""
    bad = problem.bad(x)
    if not bad.any():
        return []
    runs = []
    hit = np.flatnonzero(bad)
    for run in np.split(hit, np.flatnonzero(np.diff(hit) > 1) + 1):
        ends = [int(run[0]), *(p for p in problem.pins if run[0] < p < run[-1] + 1), int(run[-1]) + 1]
        runs += [(a, b) for a, b in pairwise(ends) if bad[a:b].any()]
    return runs


def _bypass(problem: PathProblem, padded: PathProblem, x: Array, first: int, last: int) -> Blocked | None:
    """Reroute the waypoints of a run in place, reaching further out on both sides as far as it takes."""
    n = len(x)
    low = max((p for p in problem.pins if p <= first), default=0)
    high = min((p for p in problem.pins if p >= last), default=n - 1)
    why: Trouble = "no route"
    for reach in (0, 1, 3, 8, 20, 60, n):
        a, b = max(low, first - reach), min(high, last + reach)
        for start, goal in _ends(padded, x, a, b):
            # a pinned end may graze a body: there the pad is what it leaves of it
            route = find_route(_lenient(padded, start, goal), start, goal, room=b - a - 1)
            if not isinstance(route, str):
                x[a : b + 1] = _along(padded, start, route, goal, b - a + 1)
                return None
            why = route
        if (a == low and b == high) or why == "no route":
            break
    trouble = _give_way(problem, padded, x, low, high, why)
    if trouble is not None:
        for i in range(low + 1, high):
            pushed = push_out(padded, x[i]) if padded.depth(x[i][None])[0] > PAD + GRAZE else None
            x[i] = x[i] if pushed is None else pushed
    return trouble


def _ends(padded: PathProblem, x: Array, a: int, b: int) -> list[tuple[Array, Array]]:
    """Pairs of points to join: the waypoints a and b if they are legal or pinned, else legal points near them."""
    pinned = padded.pinned
    choices = []
    for i in (a, b):
        depth = float(padded.depth(x[i][None])[0])
        pushed = push_out(padded, x[i]) if 0.0 <= depth <= PAD + GRAZE and not pinned[i] else None
        if pushed is not None:
            choices.append(pushed[None])
        elif pinned[i] or (depth < 0.0 and padded.inside(x[i][None])[0]):
            choices.append(x[i][None])
        else:
            choices.append(nearest_legal(padded, x[i], 4))
    if not len(choices[0]) or not len(choices[1]):
        return []
    count = max(len(choices[0]), len(choices[1]))
    pairs = [(min(k, len(choices[0]) - 1), min(k, len(choices[1]) - 1)) for k in range(count)]
    return [(choices[0][i], choices[1][j]) for i, j in pairs]


def _lenient(padded: PathProblem, start: Array, goal: Array) -> PathProblem:
    """The problem with each body's pad reduced to what start and goal leave of it."""
    ends = np.stack([start, goal])
    bodies = []
    for body in padded.bodies:
        depth = -body.signed(ends)[0]
        short = float(np.where(depth <= PAD + GRAZE, depth + PAD, 0.0).max(initial=0.0))
        bodies.append(replace(body, radius=body.radius - short - 1e-9) if body.radius > short > 0.0 else body)
    return replace(padded, bodies=tuple(bodies))


def _along(padded: PathProblem, start: Array, route: Array, goal: Array, count: int) -> Array:
    """`count` waypoints from start over the corners of a route (K, 3) to goal; none on the way out of a body."""
    depth = padded.depth(np.stack([start, goal])) > PAD + GRAZE
    leaving, arriving = bool(depth[0]), bool(depth[1])
    if not len(route) and count > 2 and (leaving or arriving):
        spot = nearest_legal(padded, start) if leaving and arriving else (goal if leaving else start)[None]
        route = spot[:1] if len(spot) else start[None]
    return _spread(np.concatenate([start[None], route, goal[None]]), count, leaving, arriving)


def _spread(corner: Array, count: int, leaving: bool = False, arriving: bool = False) -> Array:
    """`count` waypoints along a polyline (K, 3), K <= count: one at each corner, the others evenly on its edges.

    With `leaving` none is put on the first edge but all that is left over at its end; `arriving` likewise.
    """
    if leaving or arriving:
        first, last = int(leaving), len(corner) - int(arriving)
        inner = _spread(corner[first:last], count - leaving - arriving)
        return np.concatenate([corner[:first], inner, corner[last:]])
    if len(corner) <= 1:
        return np.repeat(corner, count, axis=0)
    edges = np.linalg.norm(np.diff(corner, axis=0), axis=1)
    extra = count - len(corner)
    share = edges / edges.sum() * extra if edges.sum() > 0 else np.full(len(edges), extra / len(edges))
    whole = np.floor(share).astype(int)
    whole[np.argsort(whole - share, kind="stable")[: extra - whole.sum()]] += 1
    parts = [corner[i] + np.arange(k + 1)[:, None] / (k + 1) * (corner[i + 1] - corner[i]) for i, k in enumerate(whole)]
    return np.concatenate([*parts, corner[-1:]])


def _give_way(
    problem: PathProblem,
    padded: PathProblem,
    x: Array,
    low: int,
    high: int,
    why: Trouble,
) -> Blocked | None:
    """Where there is no way around, stay on this side of a body; as a last resort stay in one place."""
    free_low, free_high = not problem.pinned[low], not problem.pinned[high]
    if not (free_low or free_high):
        return Blocked(low, high, why)
    best: tuple[float, Array] | None = None
    for candidate in _sides(padded, x[low : high + 1], problem.pinned[low : high + 1]):
        trial = x.copy()
        trial[low : high + 1] = candidate
        if problem.bad(trial)[max(low - 1, 0) : high + 1].any():
            continue
        price = float(((candidate - x[low : high + 1]) ** 2).sum())
        if best is None or price < best[0]:
            best = (price, candidate)
    if best is None:
        return Blocked(low, high, "no legal point")
    x[low : high + 1] = best[1]
    return None


def _sides(padded: PathProblem, x: Array, pinned: NDArray[np.bool_]) -> list[Array]:
    """Candidates for a stretch with a free end: all of it beyond one plane of a body, or all of it in one place."""
    found = []
    for body in padded.bodies:
        for axis in body.rotation.T:
            for normal in (axis * padded.axes, -axis * padded.axes):
                length = float(np.linalg.norm(normal))
                if length < 1e-6:
                    continue
                unit = normal / length
                lack = body.support(unit[None])[0] - x @ unit
                if (lack <= 0).all():
                    continue
                moved = padded.project(x + np.maximum(lack, 0.0)[:, None] * unit)
                found.append(np.where(pinned[:, None], x, moved))
    anchor = x[pinned] if pinned.any() else nearest_legal(padded, x[np.argmax(arc_length(x) >= arc_length(x)[-1] / 2)])
    for spot in anchor[:2]:
        legal = nearest_legal(padded, spot) if padded.depth(spot[None])[0] > PAD else spot[None]
        found += [np.where(pinned[:, None], x, place) for place in legal[:1]]
    return found
