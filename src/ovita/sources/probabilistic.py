"""Movement primitives that are distributions of paths, and pass through via-points: ProMP and KMP.

Sources: Paraschos, Daniel, Peters, Neumann, Probabilistic movement primitives, NeurIPS 2013; Huang, Rozo, Silvério,
Caldwell, Kernelized movement primitives, IJRR 2019.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ovita.paths.trajectory import Array
from ovita.sources.taskframes import PathDistribution, groups

BASES = 25
"""Number of basis functions of a ProMP."""

RIDGE = 1e-6
"""Regularisation of the weights, relative to the data's."""

PRECISION = 1e-3
"""Standard deviation with which a ProMP is asked for a via-point [m, rad]."""

LENGTH = 0.1
"""How far a via-point reaches along the movement, as a standard deviation of the phase."""

STIFFNESS = 25.0
"""How firmly the demonstrated distribution holds the path against via-points: the paper's lambda."""

EXACT = 1e-8
"""Variance of a via-point, as a share of the demonstrated one."""

FREE = 1e6
"""Variance of what a via-point leaves open, as a multiple of the demonstrated one."""

FIRMEST = 0.05
"""A demonstrated variance below this share of the mean one holds the path no more firmly."""


@dataclass(frozen=True, eq=False)
class Via:
    """A pose to pass through.

    Args:
        phase: When, from 0 (start) to 1 (goal).
        value: The pose as a vector (d,).
        known: Which components (d,) are asked for; the others are free.
    """

    phase: float
    value: Array
    known: Array


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


def conditioned(reference: PathDistribution, vias: Sequence[Via]) -> PathDistribution:
    """A KMP: the distribution after it was made to pass through via-points at some of its phases.

    The mean is bent by the kernel's interpolation of what the via-points ask for; the demonstrated covariance shrinks
    at each phase in the ratio in which the kernel's own posterior shrinks; far from a via-point it is unchanged. The
    phases of the via-points differ, and are among those of the reference.
    """
    if not vias:
        return reference
    scale = _scale(reference.covariance)
    near = [int(np.argmin(np.abs(reference.phases - via.phase))) for via in vias]
    relative = reference.covariance / np.multiply.outer(scale, scale)
    noise = STIFFNESS * (relative + FIRMEST * np.eye(len(scale)))
    free = _posterior(reference.phases, noise)[1]
    asked = np.zeros_like(reference.mean)
    for i, via in zip(near, vias, strict=True):
        asked[i] = np.where(via.known, (via.value - reference.mean[i]) / scale, 0.0)
        noise[i] = np.diag(np.where(via.known, EXACT, FREE))
    from scipy.linalg import cho_solve

    factor, bound = _posterior(reference.phases, noise)
    weights = cho_solve(factor, asked.ravel()).reshape(asked.shape)
    bent = _kernel(reference.phases) @ weights * scale
    shrink = (_root(bound) @ _root(free, inverse=True)) * np.divide.outer(scale, scale)
    covariance = shrink @ reference.covariance @ shrink.transpose(0, 2, 1)
    return PathDistribution(reference.phases, reference.mean + bent, covariance, reference.base)


def led(reference: PathDistribution, start: Array, goal: Array) -> PathDistribution:
    """The distribution moved so that its mean runs from one pose (d,) to another: a shear that keeps its shape."""
    before, after = start - reference.mean[0], goal - reference.mean[-1]
    share = reference.phases[:, None]
    mean = reference.mean + (1.0 - share) * before + share * after
    return PathDistribution(reference.phases, mean, reference.covariance, reference.base)


def _scale(covariance: Array) -> Array:
    """Typical deviations (d,), the same for all components of one unit."""
    scale = np.empty(covariance.shape[1])
    for group in groups(len(scale)):
        scale[group] = np.sqrt(np.trace(covariance[:, group, group], axis1=1, axis2=2).mean() / 3.0)
    return scale


def _kernel(phases: Array) -> Array:
    return np.exp(-0.5 * (np.subtract.outer(phases, phases) / LENGTH) ** 2)


def _posterior(phases: Array, noise: Array) -> tuple[tuple[Array, bool], Array]:
    """The factorised system of equation 18 and the posterior covariance (T, d, d), equation 24, for unit kernels."""
    count, d = noise.shape[:2]
    prior = np.kron(_kernel(phases), np.eye(d))
    system = prior.reshape(count, d, count, d).copy()
    every = np.arange(count)
    system[every, :, every, :] += noise
    from scipy.linalg import cho_factor, solve_triangular

    factor = cho_factor(system.reshape(count * d, count * d), lower=True)
    known = solve_triangular(factor[0], prior, lower=True).reshape(count * d, count, d)
    return factor, np.eye(d) - np.einsum("kti,ktj->tij", known, known)


def _root(matrices: Array, *, inverse: bool = False) -> Array:
    """Symmetric square roots (T, d, d) of covariances, or their inverses."""
    values, axes = np.linalg.eigh(matrices)
    roots = np.sqrt(np.maximum(values, 1e-12))
    return np.asarray((axes * (1.0 / roots if inverse else roots)[:, None, :]) @ axes.transpose(0, 2, 1))
