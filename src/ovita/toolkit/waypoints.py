"""Masks that say which waypoints an edit applies to; smoothing, and the number and order of waypoints.

Combine masks with &, | and ~.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ovita.paths.correspondence import correspond
from ovita.paths.geometry import Mask, runs, within_core
from ovita.paths.scene import RFU, Frame
from ovita.paths.trajectory import Array, interpolate, source_indices
from ovita.toolkit import arguments
from ovita.toolkit.arguments import Place, Target, followed
from ovita.toolkit.catalogue import operation
from ovita.toolkit.insertion import distinct


@operation("Choose waypoints", core=True)
def near(traj: ArrayLike, obj: Target, within: float, of: str = "centre") -> Mask:
    """Mask: waypoints at most so many metres from an object's centre, a wide one's middle, or its surface.

    Where only the line between two waypoints passes so near, the nearer one counts.

    Args:
        within: Distance [m], >= 0.
        of: "centre", or "surface" of an object with dimensions, as for a distance that was said.
    """
    rows = arguments.waypoints(traj)
    radius = arguments.number(within, "within", low=0.0)
    if of not in ("centre", "surface"):
        raise ValueError(f"of must be 'centre' or 'surface', not {of!r}")
    return within_core(rows[:, :3], arguments.core_of(obj, rows[:, :3], of), radius)


@operation("Choose waypoints", core=True)
def first(traj: ArrayLike, n: int | None = None, *, fraction: float | None = None) -> Mask:
    """Mask: the first n waypoints, or a fraction (0..1) of all.

    Args:
        n: Number of waypoints, 1 to N: indices 0 to n - 1.
        fraction: Share of the waypoint count; exactly one of n and fraction is given.
    """
    rows = arguments.waypoints(traj)
    return np.arange(len(rows)) < _count(rows, n, fraction)


@operation("Choose waypoints", core=True)
def last(traj: ArrayLike, n: int | None = None, *, fraction: float | None = None) -> Mask:
    """Mask: the last n waypoints, or a fraction (0..1) of all.

    Args:
        n: Number of waypoints, 1 to N: indices N - n to N - 1.
        fraction: Share of the waypoint count; exactly one of n and fraction is given.
    """
    rows = arguments.waypoints(traj)
    return np.arange(len(rows)) >= len(rows) - _count(rows, n, fraction)


@operation("Choose waypoints")
def between(traj: ArrayLike, a: Place, b: Place) -> Mask:
    """Mask: from PLACE a to PLACE b.

    Args:
        a: Waypoint index from 0 (int), fraction of the path's length (float), "start", "goal", or an object or
            point (3,) [m] that means the waypoint nearest to it.
        b: The other end, in any order; both ends are included.
    """
    rows = arguments.waypoints(traj)
    low, high = sorted((arguments.locate(rows, a, "a"), arguments.locate(rows, b, "b")))
    index = np.arange(len(rows))
    return (index >= low) & (index <= high)


@operation("Choose waypoints")
def where_rising(traj: ArrayLike, direction: str = "up", *, frame: Frame = RFU) -> Mask:
    """Mask: where the path heads up (or another direction word).

    Args:
        direction: A direction word.
    """
    rows = arguments.waypoints(traj)
    axis = arguments.direction(frame, direction)
    steps = np.diff(rows[:, :3], axis=0)
    rising = steps @ axis > 1e-6 * np.linalg.norm(steps, axis=1)
    return np.concatenate([rising, rising[-1:]])


@operation("Choose waypoints")
def every(traj: ArrayLike, k: int, start: int = 0) -> Mask:
    """Mask: every k-th waypoint from index start on.

    Args:
        k: Stride, 1 to N.
        start: Index of the first selected waypoint, from 0.
    """
    n = len(arguments.waypoints(traj))
    stride, begin = arguments.integer(k, "k", 1, n), arguments.integer(start, "start", 0, n - 1)
    selected = np.zeros(n, dtype=bool)
    selected[begin::stride] = True
    return selected


def _count(rows: Array, n: Any, fraction: Any) -> int:
    if (n is None) == (fraction is None):
        raise ValueError("give exactly one of n (a number of waypoints) and fraction (0..1)")
    if fraction is not None:
        share = arguments.number(fraction, "fraction", low=0.0, high=1.0)
        return max(round(share * len(rows)), int(share > 0))
    if isinstance(n, float) and not n.is_integer():
        raise ValueError(f"n counts waypoints and {n:g} is no whole number; did you mean fraction={n:g}?")
    return arguments.integer(n, "n", 1, len(rows))


CUTOFF = 8.0
"""Half-waves per path at which smoothing of strength 1 halves the amplitude."""


@operation("Waypoints")
def smooth(traj: ArrayLike, strength: float = 1.0, *, where: ArrayLike | None = None) -> Array:
    """Take out bends and jitter; strength 0 does nothing, 10 a lot; start and goal stay.

    The deviation from the chord is a sine series; half-wave k is divided by 1 + strength (k / 8)^4, so that
    the bending energy (the sum of squared second differences) falls as strength grows. On a part, those
    beside it follow, a quarter as many waypoints on each side and 2 at least; the rest stays, joined without a kink.

    Args:
        strength: >= 0.
    """
    rows = arguments.waypoints(traj)
    amount = arguments.number(strength, "strength", low=0.0)
    # A dwell repeats a waypoint: it is smoothed as one waypoint, so that it stays a dwell.
    fresh = distinct(rows)
    path, selected = rows[fresh, :3], arguments.mask(where, len(rows))[fresh]
    n = len(path)
    if amount == 0.0 or n < 3:
        return rows
    if selected.all():
        chord = path[0] + np.linspace(0.0, 1.0, n)[:, None] * (path[-1] - path[0])
        inner = (path - chord)[1:-1]
        gain = 1.0 / (1.0 + amount * (np.arange(1, n - 1) / CUTOFF) ** 4)
        path[1:-1] = chord[1:-1] + _sine(_sine(inner) * gain[:, None]) * (2.0 / (n - 1))
    else:
        for a, b in runs(selected):
            beside = max((b - a + 1) // 4, 2)
            a, b = max(a - beside, 1), min(b + beside, n - 2)
            path[a : b + 1] = _relaxed(path, a, b, amount * ((n - 1) / (np.pi * CUTOFF)) ** 4)
    rows[:, :3] = path[np.cumsum(fresh) - 1]
    return rows


def _relaxed(path: Array, a: int, b: int, stiffness: float) -> Array:
    """The stretch (b - a + 1, 3) that minimises its squared deviation and `stiffness` times the bending energy.

    A penalised spline (Eilers and Marx 1996), whose normal equations have five diagonals, solved by elimination.
    """
    free = slice(a, b + 1)
    given = path.copy()
    given[free] = 0.0
    bends = np.diff(given, 2, axis=0)
    pull = np.zeros_like(path)
    for k, c in enumerate((1.0, -2.0, 1.0)):
        pull[k : len(path) - 2 + k] += c * bends
    rhs = path[free] - stiffness * pull[free]
    diagonals = np.zeros((3, len(path)))
    inside = len(path) - 2
    for k, c in enumerate((1.0, 4.0, 1.0)):
        diagonals[0, k : inside + k] += c
    diagonals[1, :inside] -= 2.0
    diagonals[1, 1 : inside + 1] -= 2.0
    diagonals[2, :inside] += 1.0
    main, first, second = stiffness * diagonals[:, free]
    return _solved(main + 1.0, first, second, rhs)


def _solved(main: Array, first: Array, second: Array, rhs: Array) -> Array:
    """The solution (M, 3) of a symmetric system with five diagonals, by an LDL decomposition."""
    m, d, l1, l2 = len(rhs), main.copy(), first.copy(), second.copy()
    x = rhs.copy()
    for i in range(m):
        if i >= 1:
            x[i] -= l1[i - 1] * x[i - 1]
        if i >= 2:
            x[i] -= l2[i - 2] * x[i - 2]
        one, two = l1[i], l2[i]
        l1[i], l2[i] = one / d[i], two / d[i]
        if i + 1 < m:
            d[i + 1] -= l1[i] * one
            l1[i + 1] -= l1[i] * two
        if i + 2 < m:
            d[i + 2] -= l2[i] * two
    x /= d[:, None]
    for i in range(m - 2, -1, -1):
        x[i] -= l1[i] * x[i + 1]
        if i + 2 < m:
            x[i] -= l2[i] * x[i + 2]
    return np.asarray(x)


@operation("Waypoints")
def resample(traj: ArrayLike, n: int, by: Literal["arc_length", "index"] = "arc_length") -> Array:
    """Give the same path n waypoints.

    Args:
        n: Number of waypoints, >= 2.
        by: "arc_length" spaces them evenly along the path, "index" evenly in waypoint count (keeps waits).
    """
    rows = arguments.waypoints(traj)
    count = arguments.integer(n, "n", 2, arguments.MOST_WAYPOINTS)
    if by not in ("arc_length", "index"):
        raise ValueError(f"by must be 'arc_length' or 'index', not {by!r}")
    return interpolate(rows, source_indices(rows[:, :3], count, by))


@operation("Waypoints")
def average(traj: ArrayLike, k: int) -> Array:
    """Merge each k waypoints into one.

    That one is their mean, speed and extra columns included.

    Args:
        traj: (N, 4); the result is (ceil(N / k), 4), its last waypoint the mean of what is left over.
        k: Waypoints a group, from 1 to N - 1.
    """
    rows = arguments.waypoints(traj)
    size = arguments.integer(k, "k", 1, len(rows) - 1)
    starts = np.arange(0, len(rows), size)
    counts = np.diff(np.append(starts, len(rows)))
    return np.asarray(np.add.reduceat(rows, starts, axis=0) / counts[:, None])


@operation("Waypoints")
def reverse(traj: ArrayLike, *, where: ArrayLike | None = None) -> Array:
    """Reverse the waypoints' order.

    Speeds and extra columns go along.

    Args:
        where: Mask (N,), or None for all waypoints; each unbroken run of it is reversed for itself, so the
            path jumps at its edges.
    """
    rows = arguments.waypoints(traj)
    for a, b in runs(arguments.mask(where, len(rows))):
        rows[a : b + 1] = rows[a : b + 1][::-1].copy()
    return rows


@operation("Waypoints")
def keep_unchanged(
    traj: ArrayLike, original: ArrayLike, where: ArrayLike | None = None, *, ease: float | None = None
) -> Array:
    """Put a part back as it was in the original, speeds included; call it last.

    The waypoints beside the part follow, over 3 times the shift at its edge, so that the rest of the edit blends into
    it; waits and curves that were put into the part go. Promise it by expect_same_path and expect_same_speed.

    Args:
        traj: (M, 4).
        original: (N, 4), before the edit, such as the policy was given it.
        where: Mask (N,) over the original waypoints, or None for all.
    """
    rows, before = arguments.waypoints(traj), arguments.waypoints(original)
    if rows.shape[1] != before.shape[1]:
        raise ValueError(f"traj has {rows.shape[1]} columns but original {before.shape[1]}; pass the given trajectory")
    selected = arguments.mask(where, len(before))
    match = correspond(before, rows)
    there = match.of_original(rows)
    there[~match.kept] = before[~match.kept]
    parts, kept, restored, done = [], [], [], 0
    for a, b in runs(selected):
        places = match.forward[: b + 1]
        inside = places[a:][np.isfinite(places[a:])]
        # Of a part that was taken out, the place is behind what is left of the path before it.
        earlier = places[:a][np.isfinite(places[:a])]
        begin = int(np.ceil(inside[0])) if len(inside) else int(earlier[-1]) + 1 if len(earlier) else 0
        end = int(np.floor(inside[-1])) + 1 if len(inside) else begin
        parts += [rows[done:begin], there[a : b + 1]]
        restored += [rows[done:begin], before[a : b + 1]]
        kept += [np.zeros(max(begin - done, 0), dtype=bool), np.ones(b + 1 - a, dtype=bool)]
        done = max(end, done)
    result, moved = (np.concatenate([*some, rows[done:]]) for some in (parts, restored))
    mask = np.concatenate([*kept, np.zeros(len(rows) - done, dtype=bool)])
    result = followed(result, moved[:, :3], mask, arguments.share(ease, "ease"))
    result[mask] = moved[mask]
    return result


def _sine(values: Array) -> Array:
    """Discrete sine transform of the first kind of columns (M, D); its own inverse up to the factor 2 / (M + 1)."""
    zero = np.zeros((1, values.shape[1]))
    odd = np.concatenate([zero, values, zero, -values[::-1]])
    return np.asarray(-np.fft.rfft(odd, axis=0).imag[1 : len(values) + 1] / 2.0)
