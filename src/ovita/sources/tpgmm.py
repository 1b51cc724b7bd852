"""Task-parameterised Gaussian mixtures: one movement seen from several frames at once, by expectation maximisation.

Source: Calinon, A tutorial on task-parameterized movement learning and retrieval, Intelligent Service Robotics 2016.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ovita.paths.trajectory import Array
from ovita.sources.taskframes import PathDistribution

COMPONENTS = 8
"""Number of Gaussians of a mixture."""

ITERATIONS = 100
"""Most steps of expectation maximisation."""

CONVERGED = 1e-4
"""The likelihood of a point grows by less than this share in the last step."""

REGULAR = 1e-4
"""Variance that is added to each Gaussian, as a share of the data's."""


@dataclass(frozen=True, eq=False)
class Mixture:
    """Gaussians over phase and pose, with priors that all task frames share.

    Args:
        priors: (K,), with sum 1.
        means: (J, K, 1 + d): for each of J frames, phase and pose.
        covariances: (J, K, 1 + d, 1 + d).
    """

    priors: Array
    means: Array
    covariances: Array

    @classmethod
    def fitted(cls, phases: Array, views: Sequence[Array], components: int = COMPONENTS) -> Mixture:
        """Fit demonstrations by expectation maximisation, begun with equal stretches of the phases (T,).

        Views are the demonstrations (D, T, d) as seen from each frame; there are at most T components.
        """
        data = np.stack([_with_phase(phases, rows) for rows in views])
        regular = REGULAR * data.var(axis=1)
        shares = np.zeros((data.shape[1], components))
        stretch = np.minimum((np.tile(phases, len(views[0])) * components).astype(int), components - 1)
        shares[np.arange(len(stretch)), stretch] = 1.0
        best = -np.inf
        for _ in range(ITERATIONS):
            mixture = cls(*_maximised(data, shares, regular))
            shares, likelihood = mixture._expected(data)
            if likelihood - best < CONVERGED * max(abs(likelihood), 1.0):
                break
            best = likelihood
        return mixture

    def regressed(self, phases: Array, frame: int, base: Array | None) -> PathDistribution:
        """What a frame's Gaussians say of the pose at phases (M,): Gaussian mixture regression, equations 9 to 13."""
        means, covariances = self.means[frame], self.covariances[frame]
        variance = covariances[:, 0, 0]
        away = np.subtract.outer(phases, means[:, 0])
        logs = np.log(self.priors) - 0.5 * (away**2 / variance + np.log(variance))
        share = np.exp(logs - logs.max(axis=1, keepdims=True))
        share /= share.sum(axis=1, keepdims=True)
        slope = covariances[:, 1:, 0] / variance[:, None]
        guess = means[:, 1:] + away[:, :, None] * slope
        rest = covariances[:, 1:, 1:] - np.einsum("ki,kj->kij", slope, covariances[:, 0, 1:])
        mean = np.einsum("mk,mki->mi", share, guess)
        off = guess - mean[:, None]
        covariance = np.einsum("mk,kij->mij", share, rest) + np.einsum("mk,mki,mkj->mij", share, off, off)
        return PathDistribution(phases, mean, covariance, base)

    def _expected(self, data: Array) -> tuple[Array, float]:
        """Shares (n, K) of the Gaussians in points (J, n, 1 + d), and the mean log likelihood of a point."""
        logs = np.log(self.priors) + np.sum(
            [_log_density(*one) for one in zip(data, self.means, self.covariances, strict=True)], axis=0
        )
        top = logs.max(axis=1, keepdims=True)
        total = np.log(np.exp(logs - top).sum(axis=1, keepdims=True)) + top
        return np.exp(logs - total), float(total.mean())


def _with_phase(phases: Array, rows: Array) -> Array:
    return np.column_stack([np.tile(phases, len(rows)), rows.reshape(-1, rows.shape[2])])


def _maximised(data: Array, shares: Array, regular: Array) -> tuple[Array, Array, Array]:
    """Priors, means and covariances for given shares (n, K) of the points (J, n, 1 + d)."""
    weight = shares / np.maximum(shares.sum(axis=0), 1e-12)
    means = np.einsum("nk,jni->jki", weight, data)
    away = data[:, None] - means[:, :, None]
    covariances = np.einsum("nk,jkni,jknl->jkil", weight, away, away, optimize=True)
    every = np.arange(data.shape[2])
    covariances[:, :, every, every] += regular[:, None] + 1e-12
    return np.maximum(shares.mean(axis=0), 1e-12), means, covariances


def _log_density(points: Array, means: Array, covariances: Array) -> Array:
    """Log densities (n, K) of points (n, d) under Gaussians."""
    factors = np.linalg.cholesky(covariances)
    away = np.linalg.solve(factors, (points[None] - means[:, None]).transpose(0, 2, 1))
    width = 2.0 * np.log(np.diagonal(factors, axis1=1, axis2=2)).sum(axis=1)
    return np.asarray(-0.5 * ((away**2).sum(axis=1) + (width + points.shape[1] * np.log(2.0 * np.pi))[:, None]).T)
