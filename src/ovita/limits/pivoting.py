"""The quadratic program of a short window: its dual, by principal pivoting.

Without limits the optimum is a banded solution x0. A limit n.x_i >= h pushes waypoint i along n with a force m >= 0,
and the window answers to pushes by the inverse K of its tri-diagonal matrix: x = x0 + K N'm. With S = N K N', the
optimum is where

    m >= 0,      S m >= h - N x0,      one of the two with equality for every limit.

Few limits push at once, so block principal pivoting (Judice and Pires 1994, finite) needs a few small dense systems.
An answer that does not prove to be the optimum is none; then `qp.solve_qp` is asked, as it is for long windows.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from ovita.limits import banded
from ovita.limits.qp import Rows, Weights
from ovita.paths.geometry import dots
from ovita.paths.trajectory import Array

LONGEST = 256
"""Most waypoints, and most limits, for which dense algebra is the quicker one."""

EXACT = 1e-9
"""By how much a limit may be missed [m], as with PIQP."""

ROUNDS = 40
"""Most exchanges of the limits that push; it needs a handful."""


class ShortWindow:
    """The program of one window, factorised for any limits.

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
        diagonal, link, pull = banded.system(reference, weights, shape)
        self.optimum = banded.solve(diagonal, link, pull, fixed, lower)
        self.optimum[:, ~self.axes] = lower[:, ~self.axes]
        self.response = banded.solve(diagonal, link, np.eye(len(fixed)), fixed, np.zeros((len(fixed), 1)))

    def solve(self, rows: Rows, most: float) -> Array | None:
        """The optimum (N, 3) under the bounds and rows, or None if it is not found with forces up to `most`."""
        while len(rows) <= LONGEST:
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
