"""Ways around bodies: where a path comes too near one, it is bent aside, smoothly and by as little as it takes."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ovita.paths.geometry import Cuboid, Mask, crosses, dots, lengths, path_distances, runs, turning_angles
from ovita.paths.trajectory import Array, arc_length
from ovita.toolkit.arguments import GENTLE, ROUNDING, perpendicular, smoothstep

BENDS = 8
"""How often a path is bent at most; a bend may bring another stretch too near something else."""

ROUNDS = 60
"""How often segments are moved out of a body at most; each move may bring a neighbour in."""

FLAT = (0.0, 0.5, 1.0)
"""Shares of a stretch that a bend may shift in full; the more, the wider it is, and the less it overshoots."""

CLOSE_ENOUGH = 1.02
"""Overshoot of a bend from which no flatter one is tried."""

NEWTON = 20
"""Steps in the search for where a point leaves a body, at most; most take three."""

STRIDES: Array = 1.15 ** np.arange(10.0)
"""Factors by which a shift is made larger until it is enough."""

CUTS, PARTS = 3, np.arange(1, 13) / 12
"""How often the last stride is cut to find the smallest shift, and where."""

SLOW, HAIR = 3, 1e-6
"""Rounds of moving segments out of bodies after which they go a hair farther than they must [m]."""

CORNER = np.radians(20.0)
"""From this turn on a way around has a corner."""

FARTHER = 2.0
"""How much farther an end may go than it is deep in a body."""

STRAYS = 2.0
"""How many times as far from the path a way around that is drawn taut may go as one that is bent."""

PULLS, COARSE = 60, 16
"""How often a band is pulled taut, first with at most so many points."""

SETTLED, TOUCHING = 2e-5, 1e-9
"""Moves of a band below which it lies still, and depths that count as touching [m]."""

SAMPLES = np.linspace(0.0, 1.0, 5)[:-1]
"""Where each segment is sampled for how far it has to go."""


def kept_out(positions: Array, bodies: Sequence[Cuboid], selected: Mask, up: Array | None) -> Array:
    """A path (N, 3) [m] bent around bodies; it passes each stretch that was in one by just touching it.

    A stretch is shifted along one direction, the one in which it is out soonest, and what is before and behind it
    follows, over about three times the shift. A start, a goal or a dwell that is in no body stays.

    Args:
        positions: (N, 3) [m].
        bodies: With the distance to keep as their radius.
        selected: Mask (N,) of the waypoints that may move; a segment counts if both its ends may.
        up: Where the path is to keep its height, the unit vector (3,) that points up.
    """
    fresh = _distinct(positions)  # a dwell is one place, and its repeats stay with it
    if np.count_nonzero(fresh) == 1:  # a path that stands still has no course to leave
        return _cleared(positions, bodies, selected, np.zeros(len(fresh), dtype=bool), up)
    path, free = positions[fresh], selected[fresh]
    fixed = _staying(path, bodies, _dwells(fresh))
    return np.asarray(_kept_out(path, bodies, free, fixed, up)[np.cumsum(fresh) - 1])


def _kept_out(path: Array, bodies: Sequence[Cuboid], selected: Mask, fixed: Mask, up: Array | None) -> Array:
    """As `kept_out`, of a path without repeats and a mask (N,) of what stays."""
    bent = _bent_out(path, bodies, selected, fixed, up)
    if not selected.all() or _calm(bent, path, bodies):
        return bent
    taut = _taut(bent, path, bodies, up)
    legal = (_gaps(taut, bodies) >= -1e-6).all() and (lengths(taut[fixed] - path[fixed]) <= ROUNDING).all()
    legal &= _strays(taut, path) <= STRAYS * _strays(bent, path)  # else it draws out turns that are the path's own
    return taut if legal and _unrest(taut, path) < _unrest(bent, path) else bent


def _strays(moved: Array, path: Array) -> float:
    """How far what was moved of a path (N, 3) leaves the stretch that it was moved from [m]."""
    at = np.flatnonzero(lengths(moved - path) > ROUNDING)
    if not len(at):
        return 0.0
    stretch = slice(max(int(at[0]) - 1, 0), int(at[-1]) + 2)
    return float(path_distances(moved[stretch], path[stretch]).max())


def _distinct(positions: Array) -> Mask:
    """Mask (N,) of the waypoints that are no repeat of the one before."""
    return np.concatenate([[True], (np.diff(positions, axis=0) != 0.0).any(axis=1)])


def _dwells(fresh: Mask) -> Mask:
    """Which of the waypoints (M,) that are no repeats are repeated behind."""
    return np.asarray(np.diff(np.flatnonzero([*fresh, True])) > 1)


def _bent_out(positions: Array, bodies: Sequence[Cuboid], selected: Mask, fixed: Mask, up: Array | None) -> Array:
    """A path (N, 3) bent around bodies stretch by stretch, by the smallest shift of each."""
    result = positions.copy()
    for _ in range(BENDS):
        inside = _inside(result, bodies, selected)
        stretch = next(runs(inside), None)
        if stretch is None:
            return result
        bent = _bent(result, bodies, selected, fixed, stretch, up)
        if bent is None:
            break
        result = bent
    return _cleared(result, bodies, selected, fixed, up)


def _unrest(path: Array, original: Array) -> float:
    """The sharpest turn of a path [rad], and how far its ends went [m]: a metre counts as much as a radian."""
    return float(turning_angles(path).max()) + float(lengths(path[[0, -1]] - original[[0, -1]]).sum())


def _calm(path: Array, original: Array, bodies: Sequence[Cuboid]) -> bool:
    """Whether a path has no corner that the original had not, and its ends went no farther than they had to."""
    deep = np.maximum(-_depth(original[[0, -1]], bodies), 0.0)
    far = lengths(path[[0, -1]] - original[[0, -1]])
    turns = turning_angles(path).max(), turning_angles(original).max()
    return bool(turns[0] <= max(turns[1], CORNER) and (far <= FARTHER * deep + ROUNDING).all())


def _taut(bent: Array, original: Array, bodies: Sequence[Cuboid], up: Array | None) -> Array:
    """A way around drawn taut, as a rubber band round the bodies, between what of the original stays as it is.

    Where an end is near a body there is no room for a bend that sets in gently; a band leaves the end straight for the
    body and lies against it. Ends that are in a body go to the nearest place outside.
    """
    moved = np.flatnonzero(lengths(bent - original) > ROUNDING)
    if not len(moved):
        return bent
    path = bent.copy()
    path[[0, -1]] = _aside(original[[0, -1]], bodies, up)
    s, beside = arc_length(original), float(lengths(bent - original).max()) / 2.0
    first = int(np.searchsorted(s, s[moved[0]] - beside, "right")) - 1
    first, last = max(first, 0), min(int(np.searchsorted(s, s[moved[-1]] + beside)), len(path) - 1)
    band = path[first : last + 1]
    for count in (min(len(band), COARSE), len(band)):  # what many points would take long to settle, few settle soon
        even = np.linspace(0.0, 1.0, count)
        for _ in range(PULLS):
            # Even spacing lets the band slide along itself; without it, it would bunch up where it began.
            s = arc_length(band)
            pulled = np.column_stack([np.interp(s[-1] * even, s, coordinate) for coordinate in band.T])
            pulled[1:-1] = _aside((2.0 * pulled[:-2] + pulled[1:-1] + 2.0 * pulled[2:]) / 5.0, bodies, up)
            settled = len(band) == count and float(np.abs(pulled - band).max()) < SETTLED
            band = pulled
            if settled:
                break
    path[first : last + 1] = band
    fixed = np.zeros(len(path), dtype=bool)
    fixed[[0, -1]] = True
    return _cleared(path, bodies, np.ones(len(path), dtype=bool), fixed, up)


def _aside(points: Array, bodies: Sequence[Cuboid], up: Array | None) -> Array:
    """Points (M, 3) moved out of bodies by the shortest way, level where `up` is given."""
    points = points.copy()
    for _ in range(ROUNDS // 10):
        moved = False
        for body in bodies:
            inside = np.flatnonzero(body.depth(points) < -TOUCHING)
            if len(inside):
                distance, normals = body.signed(points[inside])
                aside = normals if up is None else normals - (normals @ up)[:, None] * up
                points[inside] -= (distance / np.maximum(lengths(aside), 0.2) ** 2)[:, None] * aside
                moved = True
        if not moved or (up is None and len(bodies) == 1):  # the shortest way out of one body is found at once
            break
    return points


def pushed_out(positions: Array, bodies: Sequence[Cuboid], selected: Mask, up: Array | None) -> Array:
    """As `kept_out`, but each waypoint goes only as far as it must by itself, and nothing follows."""
    fresh = _distinct(positions)
    if not fresh.all():
        return np.asarray(pushed_out(positions[fresh], bodies, selected[fresh], up)[np.cumsum(fresh) - 1])
    result, fixed = positions.copy(), _staying(positions, bodies, np.zeros(len(positions), dtype=bool))
    for a, b in runs(selected & (_depth(positions, bodies) < -ROUNDING)):
        ways = _ways(result, bodies, a, b, up)
        exits = _exits(result[a : b + 1], bodies, np.array(ways))
        best = int(np.argmin(np.round(exits.max(axis=1), 4)))
        result[a : b + 1] += exits[best][:, None] * ways[best]
    return _cleared(result, bodies, selected, fixed, up)


def _staying(positions: Array, bodies: Sequence[Cuboid], dwells: Mask) -> Mask:
    """Mask (N,) of start, goal and dwells of a path (N, 3) that are in no body; of two waypoints none stays."""
    fixed = dwells.copy()
    fixed[[0, -1]] = True
    return fixed & (_depth(positions, bodies) >= 0.0) if len(positions) > 2 else fixed & False


def _depth(points: Array, bodies: Sequence[Cuboid]) -> Array:
    """Signed distance of points (M, 3) to the nearest of some bodies, (M,) [m]."""
    return np.asarray(np.min([body.depth(points) for body in bodies], axis=0))


def _gaps(positions: Array, bodies: Sequence[Cuboid]) -> Array:
    """Signed distance of each segment of a path (N, 3) to the nearest of some bodies, (N - 1,) [m]."""
    return np.asarray(np.min([body.along(positions[:-1], positions[1:])[0] for body in bodies], axis=0))


def _inside(positions: Array, bodies: Sequence[Cuboid], selected: Mask) -> Mask:
    """Mask (N,) of the waypoints that are in a body, or whose segment passes through one."""
    inside = selected & (_depth(positions, bodies) < -ROUNDING)
    cut = selected[:-1] & selected[1:] & (_gaps(positions, bodies) < -ROUNDING)
    inside[:-1] |= cut
    inside[1:] |= cut
    return inside


def _bent(
    path: Array, bodies: Sequence[Cuboid], selected: Mask, fixed: Mask, stretch: tuple[int, int], up: Array | None
) -> Array | None:
    """The path with one stretch bent out of all bodies by the smallest shift; None where no shift does."""
    a, b = stretch
    samples = path[a:b, None] + SAMPLES[:, None] * (path[a + 1 : b + 1] - path[a:b])[:, None]
    points = np.concatenate([samples.reshape(-1, 3), path[b : b + 1]])
    places = np.concatenate([(np.arange(a, b)[:, None] + SAMPLES).ravel(), [float(b)]])
    ways = np.array(_ways(path, bodies, a, b, up))
    out = _exits(points, bodies, ways)
    order = np.argsort(np.round(out.max(axis=1), 4), kind="stable")
    best, least = None, np.inf
    own = selected & ~_others(_inside(path, bodies, selected), stretch)
    shallow = -float(min(_depth(path[a : b + 1], bodies).min(), _gaps(path[max(a - 1, 0) : b + 2], bodies).min()))
    for exits, way in zip(out[order], ways[order], strict=True):
        most = max(float(exits.max()), shallow)
        if least <= most:
            break
        peak = float(np.interp(places[int(exits.argmax())], np.arange(len(path)), arc_length(path)))
        for flat in FLAT:
            weights = _weights(path, selected, fixed, stretch, peak, most, flat)
            shift = _least_shift(path, bodies, own, weights[:, None] * way, most)
            if shift < least:
                best, least = path + shift * weights[:, None] * way, shift
            if shift <= CLOSE_ENOUGH * most:
                break
    return best


def _others(inside: Mask, stretch: tuple[int, int]) -> Mask:
    """Waypoints (N,) of other stretches, whose turn comes later."""
    rest = inside.copy()
    rest[stretch[0] : stretch[1] + 1] = False
    return rest


def _ways(path: Array, bodies: Sequence[Cuboid], a: int, b: int, up: Array | None) -> list[Array]:
    """Unit vectors (3,) along which a stretch may leave: to the side where it is already, and all around it."""
    before, after = max(a - 1, 0), min(b + 1, len(path) - 1)
    chord = path[after] - path[before]
    chord = chord if lengths(chord) > ROUNDING else path[min(before + 1, after)] - path[before]
    body = min(bodies, key=lambda one: one.closest(path[before : after + 1])[0])
    _, place = body.closest(path[before : after + 1])
    k = min(int(place), after - before - 1)
    nearest = path[before + k] + (place - k) * (path[before + k + 1] - path[before + k])
    first = perpendicular(chord[None])[0]
    second = crosses(chord, first) / max(float(lengths(chord)), 1e-12)
    angles = np.array([0.0, np.pi]) if up is not None else np.arange(8) * np.pi / 4
    around = np.cos(angles)[:, None] * first + np.sin(angles)[:, None] * second
    found = []
    for way in (nearest - body.center, body.signed(nearest[None])[1][0], *around):
        heading = chord / max(float(lengths(chord)), 1e-12)
        way = way - (way @ heading) * heading
        way = way if up is None else way - (way @ up) * up
        length = float(lengths(way))
        found += [way / length] if length > 1e-9 else []
    return found


def _exits(points: Array, bodies: Sequence[Cuboid], ways: Array) -> Array:
    """How far each point (M, 3) must go along each direction (W, 3) to be outside all bodies, (W, M) [m]."""
    start = np.tile(points, (len(ways), 1))
    along = np.repeat(ways, len(points), axis=0)
    t = np.zeros(len(start))
    for _ in bodies:
        for body in bodies:
            inside = np.flatnonzero(body.depth(start + t[:, None] * along) < -ROUNDING)
            if len(inside):
                t[inside] += _exit(body, start[inside] + t[inside, None] * along[inside], along[inside])
    return t.reshape(len(ways), len(points))


def _exit(body: Cuboid, points: Array, along: Array) -> Array:
    """How far points (M, 3) in a body must go along directions (M, 3) to leave it, (M,) [m].

    The signed distance is convex along a ray, so that Newton's steps from beyond the body never go too far.
    """
    t = np.full(len(points), 2.0 * body.reach)
    for _ in range(NEWTON):
        distance, normals = body.signed(points + t[:, None] * along)
        step = distance / dots(normals, along)
        t -= step
        if float(step.max()) < ROUNDING:
            break
    return t


def _weights(
    path: Array, selected: Mask, fixed: Mask, stretch: tuple[int, int], peak: float, shift: float, flat: float
) -> Array:
    """Weights (N,) of a bend: 1 at its peak and over a share of the stretch, 0 from some way off and at fixed ends.

    Args:
        path: (N, 3) [m].
        selected: Mask (N,) of the waypoints that may move.
        fixed: Mask (N,) of those that stay.
        stretch: Its first and its last waypoint.
        peak: Where it has farthest to go, as arc length [m].
        shift: How far that is [m].
        flat: Share of the stretch that is shifted in full.
    """
    s = arc_length(path)
    weights = np.zeros(len(path))
    for side, edge in ((-1.0, s[stretch[0]]), (1.0, s[stretch[1]])):
        half, away = side * (edge - peak), side * (s - peak)
        length = max(2.0 * half, GENTLE * shift + flat * half)
        length = min(length, float(away[fixed & (away > 0.0)].min(initial=np.inf)))
        level = min(flat * half, length / 2.0)
        here = away >= 0.0
        rise = smoothstep((length - away) / max(length - level, 1e-12))
        weights[here] = rise[here]
    weights[fixed | ~selected] = 0.0
    return weights


def _least_shift(path: Array, bodies: Sequence[Cuboid], own: Mask, along: Array, least: float) -> float:
    """The smallest factor on displacements (N, 3) with which nothing that counts is in a body; inf if there is none."""
    moving = np.flatnonzero(lengths(along) > 0.0)
    if not len(moving):
        return np.inf
    window = slice(max(int(moving[0]) - 1, 0), int(moving[-1]) + 2)
    rows, steps, points = path[window], along[window], own[window]
    segments = np.flatnonzero(points[:-1] & points[1:])
    alone = points.copy()
    alone[segments] = alone[segments + 1] = False
    single = bool(alone.any())

    def first_clear(factors: Array) -> int:
        """Which of some factors (K,) is the first with which nothing is in a body; K if none is."""
        moved = rows + factors[:, None, None] * steps
        starts, ends = (moved[:, segments + k].reshape(-1, 3) for k in (0, 1))
        cut = np.zeros(len(factors), dtype=bool)
        for body in bodies:
            cut |= body.hit(starts, ends, -ROUNDING).reshape(len(factors), -1).any(axis=1)
        if single:
            deep = _depth(moved[:, alone].reshape(-1, 3), bodies) < -ROUNDING
            cut |= deep.reshape(len(factors), -1).any(axis=1)
        return len(factors) if cut.all() else int(cut.argmin())

    tried: Array = np.asarray(least * (1.0 + 1e-9) * STRIDES)
    found = 0
    for begin, end in pairwise((0, 1, 3, len(tried))):  # the first is enough more often than not
        found = begin + first_clear(tried[begin:end])
        if found < end:
            break
    if found in (0, len(tried)):
        return np.inf if found else float(tried[0])
    low, high = tried[found - 1], tried[found]
    for _ in range(CUTS):
        tried = low + (high - low) * PARTS
        found = min(first_clear(tried[:-1]), len(tried) - 1)
        low, high = tried[found - 1] if found else low, tried[found]
    return float(high)


def _cleared(path: Array, bodies: Sequence[Cuboid], selected: Mask, fixed: Mask, up: Array | None) -> Array:
    """A path (N, 3) [m] of which no selected segment comes into a body any more.

    A segment that does is shifted aside with both its waypoints until it touches the body; as that may bring a
    neighbour in, it is repeated. Where one waypoint is fixed, the other moves farther.
    """
    result, counts, free = path.copy(), selected[:-1] & selected[1:], selected & ~fixed
    for turn in range(ROUNDS):
        cut = False
        for body in bodies:
            distance, share = body.along(result[:-1], result[1:])
            deep = np.flatnonzero(counts & (distance < -ROUNDING))
            if not len(deep):
                continue
            cut = True
            steps = result[deep + 1] - result[deep]
            normals = body.signed(result[deep] + share[deep, None] * steps)[1]
            aside = normals if up is None else normals - (normals @ up)[:, None] * up
            size = lengths(aside)[:, None]
            aside = np.where(size > 1e-6, aside / np.maximum(size, 1e-12), perpendicular(steps))
            # Between overlapping bodies a segment would go to and fro without growing strides.
            stride = (1.0 + 0.1 * max(turn - 10, 0)) / np.maximum(np.abs(dots(aside, normals)), 0.2)
            # Where pushes draw near the surface ever more slowly, a hair beyond it ends them.
            spare = ROUNDING if turn < SLOW else HAIR
            shift = (spare - distance[deep])[:, None] * stride[:, None] * aside
            moves = np.zeros((2, *result.shape))
            for k, (ends, others) in enumerate(((deep, deep + 1), (deep + 1, deep))):
                lever = np.abs(1.0 - k - share[deep])
                moves[k, ends] = shift * np.where(free[others], 1.0, 1.0 / np.maximum(lever, 0.1))[:, None]
            longer = lengths(moves[1]) > lengths(moves[0])
            result[free] += np.where(longer[:, None], moves[1], moves[0])[free]
        if not cut:
            break
    return result
