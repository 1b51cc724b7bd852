"""Probabilistic movement primitives: a Gaussian over the weights of radial basis functions.

Source: Paraschos, Daniel, Peters, Neumann, Probabilistic movement primitives, NeurIPS 2013.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ovita.paths.trajectory import Array
from ovita.sources.kmp import Via
from ovita.sources.taskframes import PathDistribution

BASES = 25
"""Number of basis functions."""

RIDGE = 1e-6
"""Regularisation of the weights, relative to the data's."""

PRECISION = 1e-3
"""Standard deviation with which a via-point is asked for [m, rad]."""


@dataclass(frozen=True, eq=False)
class Promp:
    """Weights that demonstrations were fitted with; their mean and sample covariance are the primitive.

    Args:
        weights: (D, K, d), one set a demonstration.
    """

    weights: Array

    @classmethod
    def fitted(cls, phases: Array, rows: Array) -> Promp:
        """Fit demonstrations (D, T, d) given at the same phases (T,), by ridge regression."""
        basis = bases(phases)
        system = basis.T @ basis
        ridge = RIDGE * np.trace(system) / BASES * np.eye(BASES)
        return cls(np.linalg.solve(system + ridge, basis.T @ rows))

    def generated(self, phases: Array, vias: Sequence[Via], base: Array | None) -> PathDistribution:
        """Mean and covariance at phases (T,) once the weights are conditioned on via-points, equations 5 and 6."""
        count, _, d = self.weights.shape
        mean = self.weights.mean(axis=0).ravel()
        # The covariance of the weights is spread @ spread.T; that of a path stays in the span of the demonstrations.
        spread = (self.weights.reshape(count, -1) - mean).T / np.sqrt(count - 1)
        for via in vias:
            row = np.kron(bases(np.array([via.phase])), np.eye(d))[via.known]
            seen = row @ spread
            gain = np.linalg.solve(seen @ seen.T + PRECISION**2 * np.eye(len(seen)), seen).T
            mean = mean + spread @ gain @ (via.value[via.known] - row @ mean)
            left = np.eye(spread.shape[1]) - gain @ seen
            values, axes = np.linalg.eigh((left + left.T) / 2.0)
            spread = spread @ (axes * np.sqrt(np.maximum(values, 0.0)))
        basis = bases(phases)
        ways = np.einsum("tk,kdn->tdn", basis, spread.reshape(BASES, d, -1))
        return PathDistribution(phases, basis @ mean.reshape(BASES, d), ways @ ways.transpose(0, 2, 1), base)


def bases(phases: Array) -> Array:
    """Normalised radial basis functions (T, K) at phases (T,)."""
    centres = np.linspace(-0.05, 1.05, BASES)
    width = centres[1] - centres[0]
    values = np.exp(-0.5 * (np.subtract.outer(phases, centres) / width) ** 2)
    return np.asarray(values / values.sum(axis=1, keepdims=True))
