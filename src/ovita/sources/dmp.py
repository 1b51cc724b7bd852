"""Dynamic movement primitives: a spring that is pulled to the goal, and a learned force that gives the shape.

Source: Ijspeert, Nakanishi, Hoffmann, Pastor, Schaal, Dynamical movement primitives, Neural Computation 2013, with the
forces of Hoffmann, Pastor, Park, Schaal, ICRA 2009, which need no start that differs from the goal.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from ovita.paths.trajectory import Array

BASES = 40
"""Number of basis functions of the force."""

SPRING = 40.0
"""Natural frequency of the critically damped spring, per duration of the movement."""

DECAY = float(np.log(200.0))
"""Decay of the canonical system over the movement: the force ends at half a percent of its strength."""

RIDGE = 1e-9
"""Regularisation of the weights, relative to the data's."""

_FINE = 1001


@dataclass(frozen=True, eq=False)
class Dmp:
    """A spring with a learned force, for every component of a pose.

    Args:
        weights: Of the force (K, d).
        start: First pose shown (d,).
        goal: Last pose shown (d,).
        speed: Initial speed of each component (d,), per duration of the movement.
    """

    weights: Array
    start: Array
    goal: Array
    speed: Array

    @classmethod
    def fitted(cls, phases: Array, mean: Array) -> Dmp:
        """Fit one movement (T, d) at phases (T,).

        The system is linear in its force, so the weights are fitted to the movement itself by least squares, not to
        accelerations, which would have to be had by differentiating twice.
        """
        start, goal = mean[0], mean[-1]
        speed = (mean[1] - mean[0]) / (phases[1] - phases[0])
        response = _responses(phases)
        force = response[:, 4:]
        system = force.T @ force
        ridge = RIDGE * np.trace(system) / BASES * np.eye(BASES)
        weights = np.linalg.solve(system + ridge, force.T @ (mean - _unforced(response, start, goal, speed)))
        return cls(weights, start, goal, speed)

    def generated(self, phases: Array, start: Array | None = None, goal: Array | None = None) -> Array:
        """The movement (T, d) at phases (T,) between two poses (d,); those shown by default."""
        response = _responses(phases)
        start, goal = self.start if start is None else start, self.goal if goal is None else goal
        return np.asarray(_unforced(response, start, goal, self.speed) + response[:, 4:] @ self.weights)


def _unforced(response: Array, start: Array, goal: Array, speed: Array) -> Array:
    return np.asarray(response[:, :4] @ np.stack([start, speed, goal, goal - start]))


def _responses(phases: Array) -> Array:
    """What the start, its speed, the goal, the way between them and each basis' unit force lead to (T, 4 + K)."""
    fine = _fine_responses()
    times = np.linspace(0.0, 1.0, _FINE)
    return np.stack([np.interp(phases, times, column) for column in fine.T], axis=1)


@cache
def _fine_responses() -> Array:
    t = np.linspace(0.0, 1.0, _FINE)
    canonical = np.exp(-DECAY * t)
    centres = np.exp(-DECAY * np.linspace(0.0, 1.0, BASES))
    width = np.abs(np.gradient(centres))
    basis = np.exp(-0.5 * (np.subtract.outer(canonical, centres) / width) ** 2)
    force = basis / basis.sum(axis=1, keepdims=True) * canonical[:, None]
    inputs = np.column_stack([np.ones_like(t), -canonical, force])
    decay = np.exp(-SPRING * t)
    impulse = SPRING**2 * t * decay / (_FINE - 1)
    since = np.subtract.outer(np.arange(_FINE), np.arange(_FINE))
    convolution = np.where(since >= 0, impulse[np.maximum(since, 0)], 0.0)
    convolution[:, 0] *= 0.5
    return np.column_stack([decay * (1.0 + SPRING * t), decay * t, convolution @ inputs])
