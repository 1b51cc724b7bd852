"""Ways around: waypoints and segments pushed out of spheres, as little as can be."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ovita.paths.geometry import Mask, dots, fractions, lengths, path_distances, runs
from ovita.paths.trajectory import Array
from ovita.toolkit.weights import perpendicular

SHALLOW = 0.05
"""How deep a path may dip into a sphere between its waypoints, in radii, before another way out is tried."""

ROUNDS = 60
"""How often segments are moved out of a sphere at most; each move may bring a neighbour in."""


def pushed_out(away: Array, a: int, b: int, radius: float) -> Array:
    """Where waypoints a..b inside a sphere go: points (b - a + 1, 3) on it, from its centre [m].

    The sideways push is the rule; if the path then dips into the sphere between waypoints, the first of a radial
    push and an arc from entry to exit that does not is taken, or the one that dips least.

    Args:
        away: All waypoints (N, 3) from the centre [m].
        a: First waypoint inside.
        b: Last waypoint inside, with everything between.
        radius: [m].
    """
    before, after = away[max(a - 1, 0) : a], away[b + 1 : b + 2]
    best, deepest = away[a : b + 1], np.inf
    for points in _ways_out(away, a, b, radius):
        path = np.concatenate([before, points, after])
        depth = radius - float(path_distances(path, np.zeros((1, 3)))[0]) if len(path) > 1 else 0.0
        if depth < deepest:
            best, deepest = points, depth
        if depth <= SHALLOW * radius:
            break
    return best


def pushed_out_of_all(positions: Array, centres: Array, radii: Array, selected: Mask, level: bool) -> Array:
    """Positions (N, 3) [m] with each stretch inside one of several spheres pushed aside until it is outside all.

    A stretch moves along one direction, as a ray leaves each sphere once: of eight directions around it, or of the two
    level ones, the one that needs the shortest push is taken.

    Args:
        positions: (N, 3) [m].
        centres: (K, 3) [m].
        radii: (K,) [m].
        selected: Mask (N,) of the waypoints that may move.
        level: Only to the left and to the right.
    """
    result = positions.copy()
    inside = (np.linalg.norm(positions[:, None] - centres, axis=2) < radii).any(axis=1) & selected
    for a, b in runs(inside):
        part = positions[a : b + 1]
        chord = positions[min(b + 1, len(positions) - 1)] - positions[max(a - 1, 0)]
        first = perpendicular(chord[None])[0]
        second = np.cross(chord, first) / max(float(np.linalg.norm(chord)), 1e-12)
        angles = np.array([0.0, np.pi]) if level else np.arange(8) * np.pi / 4
        directions = np.cos(angles)[:, None] * first + np.sin(angles)[:, None] * second
        pushes = [_exit(part, centres, radii, direction) for direction in directions]
        best = int(np.argmin([push.max() for push in pushes]))
        result[a : b + 1] = part + pushes[best][:, None] * directions[best]
    return result


def _exit(points: Array, centres: Array, radii: Array, direction: Array) -> Array:
    """How far each point (M, 3) must go along a direction to be outside all spheres, (M,) [m]."""
    t = np.zeros(len(points))
    for _ in range(len(centres)):
        away = (points + t[:, None] * direction)[:, None] - centres
        deep = np.linalg.norm(away, axis=2) < radii * (1.0 - 1e-12)
        along = away @ direction
        leave = -along + np.sqrt(np.maximum(along**2 - (away**2).sum(axis=2) + radii**2, 0.0))
        step = np.where(deep, leave, 0.0).max(axis=1)
        if not step.any():
            break
        t += step
    return t


def cleared(positions: Array, centres: Array, radii: Array, selected: Mask, fixed: Mask) -> Array:
    """Positions (N, 3) [m] of which no selected segment comes into a sphere any more.

    A segment that does is shifted aside with both its waypoints until it touches the sphere; as that may bring a
    neighbour in, it is repeated. Where waypoints are dense this moves them by the sagitta of their chord; where they
    are sparse it takes a whole segment aside. Where one waypoint is fixed, the other moves farther.

    Args:
        positions: (N, 3) [m].
        centres: (K, 3) [m].
        radii: (K,) [m].
        selected: Mask (N,) of the waypoints that may move; a segment counts if both its ends may.
        fixed: Mask (N,) of those that stay all the same, such as a start that is far enough away.
    """
    result, counts, free = positions.copy(), selected[:-1] & selected[1:], selected & ~fixed
    for turn in range(ROUNDS):
        cut = False
        for centre, radius in zip(centres, radii, strict=True):
            closest, share = _closest(result - centre)
            distance = lengths(closest)
            deep = np.flatnonzero(counts & (distance < radius * (1.0 - 1e-9)))
            if not len(deep):
                continue
            cut = True
            away = distance[deep, None]
            side = perpendicular(result[deep + 1] - result[deep])
            aside = np.where(away > 1e-9, closest[deep] / np.maximum(away, 1e-9), side)
            # Between overlapping spheres a segment would go to and fro without growing strides.
            shift = (radius * (1.0 + 1e-9) - away) * (1.0 + 0.1 * max(turn - 10, 0)) * aside
            moves = np.zeros((2, *result.shape))
            for k, (ends, others) in enumerate(((deep, deep + 1), (deep + 1, deep))):
                lever = np.abs(1.0 - k - share[deep])
                moves[k, ends] = shift * np.where(free[others], 1.0, 1.0 / np.maximum(lever, 0.1))[:, None]
            longer = lengths(moves[1]) > lengths(moves[0])
            result[free] += np.where(longer[:, None], moves[1], moves[0])[free]
        if not cut:
            break
    return result


def _closest(path: Array) -> tuple[Array, Array]:
    """The point of each segment (M, 3) of a path (M + 1, 3) that is closest to the origin, and its share of it (M,)."""
    start, step = path[:-1], np.diff(path, axis=0)
    share = np.clip(-dots(start, step) / np.maximum(dots(step, step), 1e-300), 0.0, 1.0)
    return start + share[:, None] * step, share


def _ways_out(away: Array, a: int, b: int, radius: float) -> Iterator[Array]:
    q = away[a : b + 1]
    lateral = _lateral(away[max(a - 1, 0) : b + 2])
    along = q @ lateral
    t = -along + np.sqrt(np.maximum(along**2 - (q**2).sum(axis=1) + radius**2, 0.0))
    yield q + t[:, None] * lateral
    distance = np.linalg.norm(q, axis=1, keepdims=True)
    outward = np.divide(q, distance, out=np.tile(lateral, (len(q), 1)), where=distance > 1e-9)
    yield radius * outward
    start, end = outward[0], outward[-1]
    angle = float(np.arccos(np.clip(start @ end, -1.0, 1.0)))
    side = end - (end @ start) * start
    length = float(np.linalg.norm(side))
    side = side / length if length > 1e-6 else perpendicular(start[None])[0]
    turn = (fractions(q) * angle)[:, None] if len(q) > 1 else np.zeros((1, 1))
    yield radius * (np.cos(turn) * start + np.sin(turn) * side)


def _lateral(path: Array) -> Array:
    """Unit vector (3,) from the origin to the closest approach of a path (M, 3), perpendicular to the path there."""
    closest, _ = _closest(path)
    i = int(np.argmin(dots(closest, closest)))
    step = path[i + 1] - path[i]
    heading = step / max(float(np.linalg.norm(step)), 1e-12)
    side = closest[i] - (closest[i] @ heading) * heading
    length = float(np.linalg.norm(side))
    return np.asarray(side / length) if length > 1e-9 else np.asarray(perpendicular(heading[None])[0])
