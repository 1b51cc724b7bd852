"""The paper's quadratic program, waypoint-major, solved three ways: sparse, per axis, and by its dual.

With N waypoints of d coordinates stacked waypoint-major, x = (x_0, x_1, ..., x_{N-1}):

    minimise    lambda_dev |x - x_ref|^2 + lambda_smooth |D1 x|^2 + lambda_shape |D1 (x - x_shape)|^2
    subject to  lower <= x <= upper,      normal_k . x_{i_k} >= offset_k

where row i of D1 x is x_{i+1} - x_i. The third term is ours (the paper has lambda_shape = 0); x_shape is x_ref, or the
smoothed x_ref where smoothing is asked for. The Hessian is block tri-diagonal, so the cost grows linearly with N:

- `solve_qp`: PIQP, for any limits.
- `smooth_axes`: bounds only. Every axis is then independent and its Hessian a tri-diagonal M-matrix, so a primal-dual
  active set finds the bounds that bind in a few O(N) solves (LAPACK ptsv).
- `ShortWindow`: few limits on few waypoints, by principal pivoting of the dual.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ovita.paths.geometry import dots
from ovita.paths.trajectory import Array


@dataclass(frozen=True)
class Rows:
    """Linear limits normal_k . x_i >= offset_k, each on one waypoint.

    Args:
        waypoints: (M,) indices i.
        normals: (M, d).
        offsets: (M,).
    """

    waypoints: NDArray[np.intp]
    normals: Array
    offsets: Array

    def __len__(self) -> int:
        return len(self.offsets)

    @classmethod
    def none(cls, dims: int = 3) -> Rows:
        """No limit at all."""
        return cls(np.zeros(0, dtype=np.intp), np.zeros((0, dims)), np.zeros(0))

    @classmethod
    def join(cls, *parts: Rows) -> Rows:
        """The limits of all parts, of which there is at least one."""
        some = [p for p in parts if len(p)] or [parts[0]]
        if len(some) == 1:
            return some[0]
        return cls(
            np.concatenate([p.waypoints for p in some]),
            np.concatenate([p.normals for p in some]),
            np.concatenate([p.offsets for p in some]),
        )


@dataclass(frozen=True)
class Weights:
    """lambda_dev > 0, lambda_smooth >= 0 and lambda_shape >= 0 of the objective."""

    dev: float = 1.0
    smooth: float = 0.0
    shape: float = 0.0


def objective(x: Array, reference: Array, weights: Weights, shape: Array | None = None) -> float:
    """Value of the objective at x (N, d), with x_shape the reference unless given."""
    value = weights.dev * _square(x - reference)
    if weights.smooth:
        value += weights.smooth * _square(x[1:] - x[:-1])
    if weights.shape:
        bent = x - (reference if shape is None else shape)
        value += weights.shape * _square(bent[1:] - bent[:-1])
    return value


def _square(rows: Array) -> float:
    return float(np.vdot(rows, rows))


def laplacian_times(rows: Array) -> Array:
    """D1' D1 x for x (N, d)."""
    steps = rows[1:] - rows[:-1]
    out = np.zeros_like(rows)
    out[:-1] -= steps
    out[1:] += steps
    return out


def solve_qp(
    reference: Array,
    weights: Weights,
    *,
    lower: Array,
    upper: Array,
    rows: Rows,
    shape: Array | None = None,
    slack: float | None = None,
) -> Array | None:
    """Minimise the objective under bounds and linear limits, by PIQP.

    Args:
        reference: x_ref (N, d).
        weights: Of the objective.
        lower: (N, d); -inf for no bound; equal to `upper` where a coordinate is fixed.
        upper: (N, d).
        rows: Linear limits.
        shape: x_shape (N, d), by default the reference.
        slack: If given, a limit may be broken at this price per unit (an exact penalty), so that there is always
            a solution.

    Returns:
        The optimum (N, d), or None if there is none or it was not found.
    """
    import piqp

    n, dims = reference.shape
    fixed = (lower >= upper).ravel()
    free = np.flatnonzero(~fixed)
    x = np.where(fixed & np.isfinite(lower.ravel()), lower.ravel(), 0.0)
    if not len(free):
        return np.asarray(x.reshape(n, dims))
    position = np.full(n * dims, -1)
    position[free] = np.arange(len(free))
    at_fixed = x.reshape(n, dims)
    kept = reference if shape is None else shape
    gradient = -2.0 * (weights.dev * reference + weights.shape * laplacian_times(kept))
    gradient = gradient + 2.0 * (weights.smooth + weights.shape) * laplacian_times(at_fixed)
    low = rows.offsets - (rows.normals * at_fixed[rows.waypoints]).sum(axis=1)
    penalised = len(rows) if slack is not None else 0
    p = _hessian(free, position, n, dims, weights, penalised)
    g = _row_matrix(rows, position, dims, len(free), penalised)
    c = np.concatenate([gradient.ravel()[free], np.full(penalised, slack or 0.0)])
    bound_low = np.concatenate([lower.ravel()[free], np.zeros(penalised)])
    bound_high = np.concatenate([upper.ravel()[free], np.full(penalised, np.inf)])
    solver = piqp.SparseSolver()
    solver.settings.eps_abs, solver.settings.eps_rel = 1e-9, 1e-9
    solver.setup(p, c, None, None, g if len(rows) else None, low if len(rows) else None, None, bound_low, bound_high)
    if solver.solve() != piqp.PIQP_SOLVED:
        return None
    x[free] = np.array(solver.result.x)[: len(free)]
    return np.asarray(np.clip(x.reshape(n, dims), lower, np.maximum(lower, upper)))


def _hessian(free: NDArray[np.intp], position: NDArray[np.intp], n: int, dims: int, weights: Weights, more: int) -> Any:
    """Upper triangle of 2 (lambda_dev I + (lambda_smooth + lambda_shape) D1' D1) on the free unknowns, in CSC form.

    Column j holds the link to the waypoint before it, if that is free, and the diagonal; `more` empty columns follow.
    """
    from scipy import sparse

    link = weights.smooth + weights.shape
    neighbours = np.full(n, 2.0)
    neighbours[[0, -1]] = 1.0 if n > 1 else 0.0
    before = np.where(free >= dims, position[free - dims], -1)
    linked = before >= 0
    starts = np.concatenate([[0], np.cumsum(1 + linked)])
    indices = np.empty(starts[-1], dtype=np.int32)
    data = np.empty(starts[-1])
    indices[starts[1:] - 1] = np.arange(len(free))
    data[starts[1:] - 1] = 2.0 * (weights.dev + link * neighbours[free // dims])
    indices[starts[:-1][linked]] = before[linked]
    data[starts[:-1][linked]] = -2.0 * link
    size = len(free) + more
    starts = np.concatenate([starts, np.full(more, starts[-1])])
    return sparse.csc_matrix((data, indices, starts.astype(np.int32)), shape=(size, size))


def _row_matrix(rows: Rows, position: NDArray[np.intp], dims: int, free: int, more: int) -> Any:
    """The limits on the free unknowns, in CSC form, and an identity for their `more` slacks."""
    from scipy import sparse

    m = len(rows)
    columns = position[(rows.waypoints[:, None] * dims + np.arange(dims)).ravel()]
    columns = np.concatenate([columns, free + np.arange(more)])
    row = np.concatenate([np.repeat(np.arange(m), dims), np.arange(more)])
    data = np.concatenate([rows.normals.ravel(), np.ones(more)])
    keep = np.flatnonzero(columns >= 0)
    order = keep[np.argsort(columns[keep], kind="stable")]
    starts = np.concatenate([[0], np.cumsum(np.bincount(columns[order], minlength=free + more))])
    parts = (data[order], row[order].astype(np.int32), starts.astype(np.int32))
    return sparse.csc_matrix(parts, shape=(m, free + more))


ROUNDS = 60
"""Most changes of an active set; it needs a handful."""


def smooth_axes(
    reference: Array, weights: Weights, lower: Array, upper: Array, fixed: NDArray[np.bool_] | None = None
) -> Array:
    """Minimise the objective under bounds, axis by axis.

    Args:
        reference: x_ref (N, d); returned as it is if it is legal and no smoothing is asked for.
        weights: Of the objective.
        lower: (d,).
        upper: (d,).
        fixed: (N,) waypoints that must stay at the reference, whatever the bounds say.
    """
    fixed = np.zeros(len(reference), dtype=bool) if fixed is None else fixed
    x = reference.copy()
    if weights.smooth:
        still = (reference == reference[0]).all(axis=0)
        x = np.where(still, x, solve_tridiagonal(*tridiagonal(reference, weights), fixed, reference))
    legal = (x >= lower) & (x <= upper)
    if not legal.all():
        for axis in np.flatnonzero(~(legal | fixed[:, None]).all(axis=0)):
            low, high = float(lower[axis]), float(upper[axis])
            x[:, axis] = _axis(reference[:, axis], weights, low, max(low, high), fixed)
    return x


def decay(weights: Weights) -> float:
    """Ratio by which a disturbance fades from one waypoint to the next, in 0..1.

    It is the smaller root of the recurrence r rho^2 - (1 + 2 r) rho + r = 0 with r = (lambda_smooth + lambda_shape)
    / lambda_dev.
    """
    r = (weights.smooth + weights.shape) / weights.dev
    return 0.0 if r == 0 else 2.0 * r / (1.0 + 2.0 * r + math.sqrt(1.0 + 4.0 * r))


def halo(weights: Weights) -> int:
    """Number of waypoints after which a disturbance has faded to a ten-millionth."""
    rho = decay(weights)
    return 2 if rho == 0 else 2 + math.ceil(math.log(1e-7) / math.log(rho))


def tridiagonal(reference: Array, weights: Weights, shape: Array | None = None) -> tuple[Array, float, Array]:
    """Diagonal (N,) and negated side of the tri-diagonal matrix, and the right-hand sides (N, k)."""
    link = weights.smooth + weights.shape
    neighbours = np.full(len(reference), 2.0)
    neighbours[[0, -1]] = 1.0
    pull = weights.dev * reference
    if weights.shape:
        pull = pull + weights.shape * laplacian_times(reference if shape is None else shape)
    return weights.dev + link * neighbours, link, pull


def _axis(ref: Array, weights: Weights, low: float, high: float, fixed: NDArray[np.bool_]) -> Array:
    diagonal, link, pulls = tridiagonal(ref[:, None], weights)
    pull = pulls[:, 0]
    at_low = (ref < low) & ~fixed
    at_high = (ref > high) & ~fixed
    for _ in range(ROUNDS):
        held = fixed | at_low | at_high
        value = np.where(at_low, low, np.where(at_high, high, ref))
        x = solve_tridiagonal(diagonal, link, pulls, held, value[:, None])[:, 0]
        slope = diagonal * x - pull  # half the gradient: what a bound that holds x must push against
        slope[1:] -= link * x[:-1]
        slope[:-1] -= link * x[1:]
        next_low = ~fixed & ((x < low) | (at_low & (slope > 0)))
        next_high = ~fixed & ((x > high) | (at_high & (slope < 0)))
        if np.array_equal(next_low, at_low) and np.array_equal(next_high, at_high):
            return np.where(fixed, ref, np.clip(x, low, high))
        at_low, at_high = next_low, next_high
    bound_low = np.where(fixed, ref, low)[:, None]
    bound_high = np.where(fixed, ref, high)[:, None]
    found = solve_qp(ref[:, None], weights, lower=bound_low, upper=bound_high, rows=Rows.none(1))
    return np.where(fixed, ref, np.clip(ref, low, high)) if found is None else found[:, 0]


def solve_tridiagonal(diagonal: Array, link: float, pull: Array, held: NDArray[np.bool_], value: Array) -> Array:
    """Solve the tri-diagonal system for k right-hand sides (N, k) with some unknowns (N,) held at values (N, k)."""
    from scipy.linalg import lapack  # takes longer to import than most paths to check, and few of those need solving

    if not held.any():
        return np.asarray(lapack.dptsv(diagonal, np.full(len(diagonal) - 1, -link), pull)[2])
    hold = held[:, None]
    side = np.where(held[:-1] | held[1:], 0.0, -link)
    right = np.where(hold, value, pull)
    right[1:] += np.where(hold[:-1] & ~hold[1:], link * value[:-1], 0.0)
    right[:-1] += np.where(hold[1:] & ~hold[:-1], link * value[1:], 0.0)
    x = lapack.dptsv(np.where(held, 1.0, diagonal), side, right)[2]
    return np.where(hold, value, x)


LONGEST = 256
"""Most waypoints of a window for which dense algebra is the quicker one."""

MOST_ROWS = 192
"""Most limits for which it is; at 200 waypoints, 64 cost up to 1.5 times as much around an obstacle, 256 up to twice in
a shell."""

EXACT = 1e-9
"""By how much a limit may be missed [m], as with PIQP."""


class ShortWindow:
    """The program of one short window by its dual, factorised for any limits.

    Without limits the optimum is a banded solution x0. A limit n.x_i >= h pushes waypoint i along n with a force
    m >= 0, and the window answers to pushes by the inverse K of its tri-diagonal matrix: x = x0 + K N'm. With
    S = N K N', the optimum is where m >= 0 and S m >= h - N x0, one of the two with equality for every limit. Few
    limits push at once, so block principal pivoting (Judice and Pires 1994, finite) needs a few small dense systems.
    An answer that does not prove to be the optimum is none; then `solve_qp` is asked, as it is for long windows.

    Args:
        reference: x_ref (N, 3) [m].
        weights: Of the objective.
        lower: (N, 3); equal to `upper` where a coordinate is fixed: at waypoints and along whole axes only.
        upper: (N, 3).
        fixed: (N,) the waypoints that are fixed.
        shape: x_shape (N, 3).
    """

    def __init__(
        self, reference: Array, weights: Weights, lower: Array, upper: Array, fixed: NDArray[np.bool_], shape: Array
    ) -> None:
        self.lower, self.upper = lower, upper
        self.axes = (upper > lower).any(axis=0)
        diagonal, link, pull = tridiagonal(reference, weights, shape)
        self.optimum = solve_tridiagonal(diagonal, link, pull, fixed, lower)
        self.optimum[:, ~self.axes] = lower[:, ~self.axes]
        self.response = solve_tridiagonal(diagonal, link, np.eye(len(fixed)), fixed, np.zeros((len(fixed), 1)))

    def solve(self, rows: Rows, most: float) -> Array | None:
        """The optimum (N, 3) under the bounds and rows, or None if it is not found with forces up to `most`."""
        while len(rows) <= MOST_ROWS:
            force = rows.normals * self.axes
            lack = rows.offsets - dots(rows.normals, self.optimum[rows.waypoints])
            gram = self.response[rows.waypoints[:, None], rows.waypoints] * (force @ force.T)
            push = _pivot(gram, lack)
            if push is None or push.max(initial=0.0) > most:
                return None
            x = self.optimum + self.response[:, rows.waypoints] @ (push[:, None] * force)
            legal = np.minimum(np.maximum(x, self.lower), self.upper)
            way_in = legal - x
            waypoint, axis = (np.abs(way_in) > EXACT).nonzero()
            if not len(waypoint):
                return legal
            normals = np.eye(3)[axis] * np.sign(way_in[waypoint, axis])[:, None]
            rows = Rows.join(rows, Rows(waypoint, normals, (normals * legal[waypoint]).sum(axis=1)))
        return None


def _pivot(gram: Array, lack: Array) -> Array | None:
    """The m >= 0 with gram m >= lack and m (gram m - lack) = 0, for a positive semidefinite gram (M, M), or None."""
    pushing = lack > EXACT / 10.0
    if not pushing.any():
        return np.zeros(len(lack))
    from scipy.linalg import lapack

    fewest, patience = len(lack) + 1, 3
    for _ in range(ROUNDS):
        on = np.flatnonzero(pushing)
        force = np.zeros(len(lack))
        if len(on):
            part = gram[on[:, None], on]
            part.ravel()[:: len(on) + 1] *= 1.0 + 1e-11
            _, force[on], failed = lapack.dposv(part, lack[on])
            if failed:
                return None
        beyond = gram @ force - lack
        wrong = np.flatnonzero(np.where(pushing, force < 0.0, beyond < -EXACT / 10.0))
        if not len(wrong):
            return force if not len(on) or np.abs(beyond[on]).max() <= EXACT else None
        if len(wrong) < fewest:
            fewest, patience = len(wrong), 3
        else:
            patience -= 1
        if patience < 0:
            wrong = wrong[-1:]
        pushing[wrong] = ~pushing[wrong]
    return None
