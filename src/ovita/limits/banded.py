"""The paper's objective without obstacles: one tri-diagonal system per axis.

Speed and every axis are independent of each other until an obstacle or a sphere couples them:

    minimise  lambda_dev |x - x_ref|^2 + lambda_smooth |D x|^2 + lambda_shape |D (x - x_ref)|^2,   lower <= x <= upper

The Hessian is a tri-diagonal M-matrix, so a primal-dual active set finds the bounds that bind in a few O(N) solves
(LAPACK ptsv).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from ovita.limits.qp import Rows, Weights, laplacian_times, solve_qp
from ovita.paths.trajectory import Array

ROUNDS = 60
"""Most changes of the active set; it needs a handful."""


def smooth(
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
        x = np.where(still, x, solve(*system(reference, weights), fixed, reference))
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


def halo(weights: Weights, remaining: float = 1e-7) -> int:
    """Number of waypoints after which a disturbance has faded to a share of `remaining`."""
    rho = decay(weights)
    return 2 if rho == 0 else 2 + math.ceil(math.log(remaining) / math.log(rho))


def system(reference: Array, weights: Weights, shape: Array | None = None) -> tuple[Array, float, Array]:
    """Diagonal (N,) and negated side of the tri-diagonal matrix, and the right-hand sides (N, k); see `solve`."""
    link = weights.smooth + weights.shape
    neighbours = np.full(len(reference), 2.0)
    neighbours[[0, -1]] = 1.0
    pull = weights.dev * reference
    if weights.shape:
        pull = pull + weights.shape * laplacian_times(reference if shape is None else shape)
    return weights.dev + link * neighbours, link, pull


def _axis(ref: Array, weights: Weights, low: float, high: float, fixed: NDArray[np.bool_]) -> Array:
    diagonal, link, pulls = system(ref[:, None], weights)
    pull = pulls[:, 0]
    at_low = (ref < low) & ~fixed
    at_high = (ref > high) & ~fixed
    for _ in range(ROUNDS):
        held = fixed | at_low | at_high
        value = np.where(at_low, low, np.where(at_high, high, ref))
        x = solve(diagonal, link, pulls, held, value[:, None])[:, 0]
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
    return np.where(fixed, ref, np.clip(ref, low, high)) if found.x is None else found.x[:, 0]


def solve(diagonal: Array, link: float, pull: Array, held: NDArray[np.bool_], value: Array) -> Array:
    """Solve the tri-diagonal system for k right-hand sides (N, k) with some unknowns (N,) held at values (N, k)."""
    if not held.any():
        return np.asarray(lapack.dptsv(diagonal, np.full(len(diagonal) - 1, -link), pull)[2])
    hold = held[:, None]
    side = np.where(held[:-1] | held[1:], 0.0, -link)
    right = np.where(hold, value, pull)
    right[1:] += np.where(hold[:-1] & ~hold[1:], link * value[:-1], 0.0)
    right[:-1] += np.where(hold[1:] & ~hold[:-1], link * value[1:], 0.0)
    x = lapack.dptsv(np.where(held, 1.0, diagonal), side, right)[2]
    return np.where(hold, value, x)
