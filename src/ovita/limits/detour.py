"""A legal path to start from, wherever the reference runs through something.

Each stretch that is blocked is replaced by a route around, from the last legal waypoint before it to the first one
behind it, with the waypoints spread along the route so that whole segments are legal. `sequential` then pulls the
path back towards the reference.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ovita.limits.path import GRAZE, PAD, PathProblem
from ovita.limits.route import find_route, nearest_legal, push_out
from ovita.paths.trajectory import Array, arc_length

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
