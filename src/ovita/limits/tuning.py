"""How much to smooth, when nobody says: only the ratio lambda_smooth / lambda_dev matters.

The paper searches both weights with Optuna, 50 trials in 1e-3..1e1, for the smallest deviation from the proposal. But
less smoothing always deviates less, so that search only ever finds the smallest ratio in its range: no smoothing. We
state a criterion that has an optimum, each term without unit:

    |x - x_ref|^2 / |D1 x_ref|^2  +  |D2 x|^2 / |D2 x_ref|^2  +  sum of squared depths in obstacles / |D1 x_ref|^2

deviation in units of a step, roughness D2 (differences of steps) as a share of what it was, and what the obstacles
will undo. It is evaluated for the banded solution, which costs microseconds, on a logarithmic grid; then the full
problem is solved once.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from ovita.errors import MissingExtra
from ovita.limits import banded
from ovita.limits.path import PathProblem
from ovita.limits.problem import ConstraintOptions
from ovita.limits.qp import Weights
from ovita.paths.trajectory import Trajectory

RANGE = (1e-3, 1e1)
"""Of the ratio lambda_smooth / lambda_dev; the paper's range."""


def choose(
    proposed: Trajectory, problem: PathProblem, options: ConstraintOptions
) -> tuple[ConstraintOptions, tuple[str, ...]]:
    """The options with lambda_smooth chosen by `options.trials` evaluations of the criterion, and a note.

    Raises:
        MissingExtra: If Optuna is asked for and not installed.
    """
    score, trials = criterion(proposed, problem), max(options.trials, 2)
    if options.tuner == "optuna":
        best = search(score, trials=trials, seed=options.seed)
    else:
        best = float(min(np.geomspace(*RANGE, trials), key=score))
    note = f"Smoothing was chosen: lambda_smooth / lambda_dev = {best:.3g}, the best of {trials}."
    return replace(options, lambda_smooth=best * options.lambda_dev), (note,)


def criterion(proposed: Trajectory, problem: PathProblem) -> Callable[[float], float]:
    """The score of a ratio lambda_smooth / lambda_dev, lower is better; see the module."""
    reference = proposed.to_array()
    steps = float((np.diff(reference, axis=0) ** 2).sum()) or 1.0
    bends = float((np.diff(reference, 2, axis=0) ** 2).sum()) or 1.0
    lower, upper = np.append(problem.lower, 0.0), np.append(problem.upper, np.inf)

    def score(ratio: float) -> float:
        x = banded.smooth(reference, Weights(1.0, float(ratio), 0.0), lower, upper)
        depth = np.maximum(problem.depth(x[:, :3]), 0.0)
        deviation = float(((x - reference) ** 2).sum()) / steps
        roughness = float((np.diff(x, 2, axis=0) ** 2).sum()) / bends
        return deviation + roughness + float((depth**2).sum()) / steps

    return score


def search(score: Callable[[float], float], *, trials: int = 50, seed: int = 0) -> float:
    """The best ratio by Optuna's TPE sampler instead of a grid.

    Raises:
        MissingExtra: If optuna is not installed.
    """
    study = new_study(seed)
    study.optimize(lambda trial: score(trial.suggest_float("ratio", *RANGE, log=True)), n_trials=trials)
    return float(study.best_params["ratio"])


class Trial(Protocol):
    """What is used of an Optuna trial."""

    def suggest_float(self, name: str, low: float, high: float, *, log: bool) -> float:
        """The next value to try."""


def new_study(seed: int) -> Any:
    """A silent Optuna study that minimises, with a seeded TPE sampler.

    Raises:
        MissingExtra: If optuna is not installed.
    """
    try:
        optuna = importlib.import_module("optuna")
    except ImportError:
        raise MissingExtra("optuna", "tuning") from None
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    return optuna.create_study(direction="minimize", sampler=optuna.samplers.TPESampler(seed=seed))
