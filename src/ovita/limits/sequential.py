"""Sequential convexification: from a legal path to the nearest one, through legal paths only.

At a legal path every segment near a body has a separating plane, the tangent plane at its point nearest to the body.
Imposed on both ends of the segment it is a convex limit inside the free space, which the present path obeys. So the
quadratic program with these planes is feasible, its solution is legal again and no worse, and the loop can stop at
any time. Balls and other convex regions are approached by cuts. Only windows around what has to move are solved; a
disturbance fades geometrically (see `qp.decay`), so outside them the banded solution stands.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ovita.limits.path import GRAZE, PAD, PathProblem
from ovita.limits.problem import Obstacle
from ovita.limits.qp import LONGEST, Rows, ShortWindow, halo, objective, solve_qp
from ovita.paths.geometry import dots, lengths
from ovita.paths.trajectory import Array

STILL = 1e-8
"""A waypoint that moved less than this did not move [m]."""

PRICE = 1e4
"""Price of breaking a limit by 1 m, in units of lambda_dev: exact for all but absurd problems."""


STEEP = 0.05
"""A plane whose normal has less than this along the robot's axes is turned upright."""

LEAD = 1.0
"""Most steps that a linearisation anticipates."""


STEPS = 12
"""Most linearisations in a row, unless it is said; each iterate is legal, so fewer only cost optimality."""

GAIN = 2e-2
"""It ends when a step gains less than this share of what could be gained at all."""


def improve(problem: PathProblem, base: Array, x: Array, steps: int = STEPS) -> Array:
    """Pull a path back towards the optimum.

    Args:
        problem: What to minimise under what.
        base: The optimum without bodies and regions (N, 3) [m]: it stands wherever x equals it.
        x: The path to start from (N, 3) [m], legal where the problem can be solved at all.
        steps: Most linearisations in a row.

    Returns:
        A path (N, 3) [m], legal if x is.
    """
    out = x.copy()
    for first, last in _windows(problem, base, x):
        part = problem.part(first, last)
        ends = [i for i in (first, last) if 0 < i < len(x) - 1]
        fixed = part.pinned
        fixed[[i - first for i in ends]] = True
        window = slice(first, last + 1)
        found = _Window(part, fixed, base[window], out[window]).solve(steps)
        still = np.abs(found - base[window]).max(axis=1) < STILL
        out[window] = np.where(still[:, None], base[window], found)
    return out


def _windows(problem: PathProblem, base: Array, x: Array) -> list[tuple[int, int]]:
    """Stretches (first and last waypoint) that must be solved: what moved, and a halo on both sides."""
    n = len(x)
    if problem.rows:
        return [(0, n - 1)]
    moved = np.flatnonzero((x != base).any(axis=1))
    reach = halo(problem.weights)
    windows: list[tuple[int, int]] = []
    for group in np.split(moved, np.flatnonzero(np.diff(moved) > 2 * reach) + 1):
        if len(group):
            windows.append((max(int(group[0]) - reach, 0), min(int(group[-1]) + reach, n - 1)))
    return windows


class _Window:
    """One stretch of the path with its own quadratic programs."""

    def __init__(self, problem: PathProblem, fixed: NDArray[np.bool_], base: Array, x: Array) -> None:
        self.problem, self.fixed, self.base, self.x = problem, fixed, base, x
        n = len(x)
        # fixed waypoints stay at x, which is the base outside of what moved
        self.lower = np.where(fixed[:, None], x, np.broadcast_to(problem.lower, (n, 3)))
        self.upper = np.where(fixed[:, None], x, np.broadcast_to(np.maximum(problem.lower, problem.upper), (n, 3)))
        self.shape = base if problem.weights.smooth else problem.reference
        self.cuts = Rows.none()
        self.short = None
        if n <= LONGEST:
            self.short = ShortWindow(problem.reference, problem.weights, self.lower, self.upper, fixed, self.shape)

    def solve(self, steps: int) -> Array:
        x = self.x
        soft = bool(self.problem.rows) or not self._legal(x)
        value = self._value(x)
        bottom = self._value(self.base)
        step: Array | None = None
        gained = enough = 0.0
        lead = 1.0  # how many further such steps the next linearisation anticipates
        for _ in range(steps):
            new = None if step is None or soft else self._step(x, soft, x + lead * step)
            there = value if new is None else self._value(new)
            if new is None or there >= value:
                if step is not None and gained <= 4.0 * enough:
                    break
                new, step, lead = self._step(x, soft), None, 1.0
                if new is None:
                    break
                there = self._value(new)
            gained, value = value - there, there
            if step is not None:  # steps that shrink by a ratio r add up to r / (1 - r) more
                ratio = min(_size(new - x) / max(_size(step), 1e-300), LEAD / (1.0 + LEAD))
                lead = ratio / (1.0 - ratio)
            step, x = new - x, new
            enough = GAIN * max(value - bottom, 1e-15)
            if _size(step) < 1e-7 or (not soft and gained <= enough):
                break
        return x

    def _step(self, x: Array, soft: bool, ahead: Array | None = None) -> Array | None:
        """One linearisation: solve, and solve again with the limits that turn out to be missing.

        Every solution is legal, since every plane separates; linearised at x there is one that is no worse than x.
        Linearised further `ahead` there may be none, or a much better one.
        """
        within = float(lengths(x - self.base).max()) + 10.0 * PAD
        bodies = self.problem.bodies
        near = [body.near(x[:-1], x[1:], within) for body in bodies]
        planes = [self._plane_rows(body, x, n, ahead) for body, n in zip(bodies, near, strict=True)]
        self._cut(x, within)
        own = [self._free(make(x)) for make in self.problem.rows]
        new, clean = x, False
        for _ in range(10):
            found = self._optimum(Rows.join(self.cuts, *own, *planes), soft)
            if found is None:
                return None
            new = found
            missing = self._cut(new, 0.0)
            clean = not missing
            for k, body in enumerate(bodies):
                hit = self._hit(body, new)
                clean = clean and not len(hit)
                hit = np.setdiff1d(hit, near[k]) if len(hit) else hit
                if len(hit):
                    missing = True
                    near[k] = np.concatenate([near[k], hit])
                    planes[k] = Rows.join(planes[k], self._plane_rows(body, x, hit, ahead))
            if not missing:
                break
        if soft or clean:
            return new
        if ahead is not None:
            return new if self._legal(new) else None
        return self._back_off(x, new)

    def _optimum(self, rows: Rows, soft: bool) -> Array | None:
        """The optimum under linear limits, which may be broken at a price if `soft`."""
        price = PRICE * self.problem.weights.dev
        quick = None if self.short is None else self.short.solve(rows, price / 2.0)
        if quick is not None:
            return quick
        return solve_qp(
            self.problem.reference,
            self.problem.weights,
            lower=self.lower,
            upper=self.upper,
            rows=rows,
            shape=self.shape,
            slack=price if soft else None,
        )

    def _back_off(self, x: Array, new: Array) -> Array:
        """The furthest of a few points between a legal path and a new one that is legal."""
        share = 1.0
        while share > 1e-3:
            trial = new if share == 1.0 else x + share * (new - x)
            if self._legal(trial):
                return trial
            share /= 2.0
        return x

    def _legal(self, x: Array) -> bool:
        free = x[~self.fixed]
        if any((region.excess(free) > PAD / 2.0 + GRAZE).any() for region in self.problem.regions):
            return False
        return not self.problem.bad(x).any()

    def _value(self, x: Array) -> float:
        return objective(x, self.problem.reference, self.problem.weights, self.shape)

    def _hit(self, body: Obstacle, x: Array) -> NDArray[np.intp]:
        near = body.near(x[:-1], x[1:], 0.0)
        return near[body.along(x[near], x[near + 1])[0] < 0.0] if len(near) else near

    def _plane_rows(self, body: Obstacle, x: Array, segments: NDArray[np.intp], ahead: Array | None) -> Rows:
        """Separating planes of segments, each on both ends.

        They touch the body where it is nearest to the segments of `ahead`, if those are clear of it, else to those of
        the legal path x; a plane that x is closer to than PAD asks for no more than x has.
        """
        if not len(segments):
            return Rows.none()
        start, end = x[segments], x[segments + 1]
        point, clear = _nearest(body, x if ahead is None else ahead, segments)
        if ahead is not None and not clear.all():
            point[~clear] = _nearest(body, x, segments[~clear])[0]
        excused = self.problem.excused(body, segments)
        if excused.any():
            stuck = np.isin(segments, self.problem.stuck(body))
            other = np.where(stuck[:, None], end, start)
            point = np.where(excused[:, None], other, point)
        normals = body.signed(point)[1]
        flat = normals * self.problem.axes  # what is left of them for a robot that cannot move along some axis
        length = lengths(flat)
        sound = length > 1e-3
        steep = length < STEEP
        if steep.any():
            normals[steep] = flat[steep] / np.where(sound[steep], length[steep], 1.0)[:, None]
        support = body.support(normals)
        have = np.minimum(dots(start, normals), dots(end, normals)) - support
        if excused.any():
            have = np.where(excused, body.signed(other)[0], have)
        offsets = support + np.where((have < PAD) & (have > -PAD), have, PAD)
        usable = sound if ahead is not None else sound & (have > -PAD)
        waypoints = np.concatenate([segments, segments + 1])
        keep = (np.concatenate([usable, usable]) & ~self.fixed[waypoints]).nonzero()[0]
        which = keep % len(segments)
        return Rows(waypoints[keep], normals[which], offsets[which])

    def _free(self, rows: Rows) -> Rows:
        keep = ~self.fixed[rows.waypoints]
        return rows if keep.all() else Rows(rows.waypoints[keep], rows.normals[keep], rows.offsets[keep])

    def _cut(self, x: Array, within: float) -> bool:
        """Add cuts of the convex regions where x is outside of them, or nearly; whether there was any."""
        added = False
        for region in self.problem.regions:
            excess = region.excess(x)
            near = np.flatnonzero((excess > (-within if within else PAD / 2.0)) & ~self.fixed)
            if not len(near):
                continue
            normals, offsets = region.cut(x[near])
            self.cuts = Rows.join(self.cuts, Rows(near, normals, offsets))
            added = True
        return added


def _nearest(body: Obstacle, x: Array, segments: NDArray[np.intp]) -> tuple[Array, NDArray[np.bool_]]:
    """Where segments of a path are nearest to a body, (M, 3), and whether they are clear of it, (M,)."""
    start, end = x[segments], x[segments + 1]
    gap, t = body.along(start, end)
    return start + t[:, None] * (end - start), gap > PAD


def _size(step: Array) -> float:
    return float(np.linalg.norm(step))
