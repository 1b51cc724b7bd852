"""The paper's quadratic program, sparse and waypoint-major, solved with PIQP.

With N waypoints of d coordinates stacked waypoint-major, x = (x_0, x_1, ..., x_{N-1}):

    minimise    lambda_dev |x - x_ref|^2 + lambda_smooth |D1 x|^2 + lambda_shape |D1 (x - x_shape)|^2
    subject to  lower <= x <= upper,      normal_k . x_{i_k} >= offset_k

where D1 = kron(D, I_d) and D is the (N-1, N) difference matrix: row i of D1 x is x_{i+1} - x_i. The third term is
ours (the paper has lambda_shape = 0); x_shape is x_ref, or the smoothed x_ref where smoothing is asked for. The
Hessian is block tri-diagonal, so the cost grows linearly with N.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import piqp
from numpy.typing import NDArray
from scipy import sparse

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


@dataclass(frozen=True)
class QPSolution:
    """What the solver found.

    Args:
        x: (N, d); None unless solved.
        status: "solved", "infeasible" or "failed" (iteration limit, numerics).
    """

    x: Array | None
    status: Literal["solved", "infeasible", "failed"]


def difference_matrix(n: int, dims: int = 1) -> Any:
    """D1 = kron(D, I_dims), sparse ((n-1) dims, n dims): the differences of neighbouring waypoints, waypoint-major."""
    d = sparse.diags([-np.ones(n - 1), np.ones(n - 1)], [0, 1], shape=(n - 1, n))
    return sparse.kron(d, sparse.identity(dims), format="csc")


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
) -> QPSolution:
    """Minimise the objective under bounds and linear limits.

    Args:
        reference: x_ref (N, d).
        weights: Of the objective.
        lower: (N, d); -inf for no bound; equal to `upper` where a coordinate is fixed.
        upper: (N, d).
        rows: Linear limits.
        shape: x_shape (N, d), by default the reference.
        slack: If given, a limit may be broken at this price per unit (an exact penalty), so that there is always
            a solution.
    """
    n, dims = reference.shape
    fixed = (lower >= upper).ravel()
    free = np.flatnonzero(~fixed)
    x = np.where(fixed & np.isfinite(lower.ravel()), lower.ravel(), 0.0)
    if not len(free):
        return QPSolution(x.reshape(n, dims), "solved")
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
    solution, status = solve_sparse(p, c, g, low, bound_low, bound_high)
    if status != "solved":
        return QPSolution(None, status)
    x[free] = solution[: len(free)]
    return QPSolution(np.clip(x.reshape(n, dims), lower, np.maximum(lower, upper)), "solved")


def solve_sparse(
    p: Any, c: Array, g: Any, low: Array, bound_low: Array, bound_high: Array
) -> tuple[Array, Literal["solved", "infeasible", "failed"]]:
    """Minimise x'Px/2 + c'x subject to G x >= low and bounds, with PIQP; of P the upper triangle is enough."""
    solver = piqp.SparseSolver()
    solver.settings.eps_abs, solver.settings.eps_rel = 1e-9, 1e-9
    rows, floor = (None, None) if g.shape[0] == 0 else (g, low)
    solver.setup(p, c, None, None, rows, floor, None, bound_low, bound_high)
    status = solver.solve()
    if status == piqp.PIQP_SOLVED:
        return np.array(solver.result.x), "solved"
    return np.zeros(len(c)), "infeasible" if status == piqp.PIQP_PRIMAL_INFEASIBLE else "failed"


def _hessian(free: NDArray[np.intp], position: NDArray[np.intp], n: int, dims: int, weights: Weights, more: int) -> Any:
    """Upper triangle of 2 (lambda_dev I + (lambda_smooth + lambda_shape) D1' D1) on the free unknowns, in CSC form.

    Column j holds the link to the waypoint before it, if that is free, and the diagonal; `more` empty columns follow.
    """
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
