"""Statistics of a study: tests on people's means, agreement, preferences, questionnaires and the number of people.

Wilson's interval, Wilcoxon's signed-rank test with the matched-pairs rank-biserial correlation, and Holm's correction
are in `ovita.bench.tables`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import softmax
from scipy.stats import bootstrap, friedmanchisquare, mannwhitneyu, norm

from ovita.paths.trajectory import Array

RESAMPLES = 2000
"""Of a bootstrap interval of a mean."""

UNIT_RESAMPLES = 500
"""Of a bootstrap interval of an agreement."""

LEVEL = 0.95
"""Of all intervals."""

DRAWS, BATCH = 20_000, 4_000
"""Simulated studies of a test's power, whose standard error is then at most 0.0036, and how many are drawn at once."""


@dataclass(frozen=True)
class Estimate:
    """A figure with its interval, and the number of people or items that it rests on."""

    value: float
    low: float
    high: float
    n: int

    @property
    def bounded(self) -> bool:
        """Whether there is an interval."""
        return math.isfinite(self.low) and math.isfinite(self.high)

    @property
    def error(self) -> list[list[float]] | None:
        """How far the interval reaches below and above the value, (2, 1), as matplotlib takes it."""
        return [[max(self.value - self.low, 0)], [max(self.high - self.value, 0)]] if self.bounded else None


@dataclass(frozen=True)
class Friedman:
    """Friedman's test of k conditions on n people: chi-squared with its p value, and Kendall's W, 0..1."""

    chi2: float
    p: float
    w: float
    n: int
    k: int


@dataclass(frozen=True)
class Strengths:
    """A Bradley-Terry model of preferences with Davidson's ties.

    i is preferred to j with probability worth_i / D, none with tie * sqrt(worth_i * worth_j) / D, where D is the sum
    of worth_i, worth_j and that last numerator.

    Args:
        worth: Of each, all adding up to 1.
        tie: Weight of "no difference"; 0 where nobody said so.
        n: Comparisons.
    """

    names: tuple[str, ...]
    worth: tuple[float, ...]
    tie: float
    n: int


def mean_of_people(values: Sequence[float], *, seed: int = 0) -> Estimate:
    """The mean over people, one value each, with the bias-corrected bootstrap interval [Efron1987].

    The interval is (-inf, inf) for fewer than two people.
    """
    sample = np.asarray(values, dtype=float)
    if len(sample) < 2:
        return Estimate(float(sample[0]) if len(sample) else math.nan, -math.inf, math.inf, len(sample))
    mean = float(sample.mean())
    if np.ptp(sample) == 0.0:
        return Estimate(mean, mean, mean, len(sample))
    rng = np.random.default_rng(seed)
    drawn = bootstrap((sample,), np.mean, confidence_level=LEVEL, n_resamples=RESAMPLES, method="BCa", random_state=rng)
    return Estimate(mean, float(drawn.confidence_interval.low), float(drawn.confidence_interval.high), len(sample))


def difference_of_groups(a: Sequence[float], b: Sequence[float]) -> Estimate:
    """The mean of b minus that of a, two groups of people, with its percentile bootstrap interval."""
    rng = np.random.default_rng(0)
    first, second = (np.asarray(group, dtype=float) for group in (a, b))
    drawn = rng.choice(second, (RESAMPLES, len(second))).mean(1) - rng.choice(first, (RESAMPLES, len(first))).mean(1)
    low, high = np.quantile(drawn, ((1 - LEVEL) / 2, (1 + LEVEL) / 2))
    return Estimate(float(second.mean() - first.mean()), float(low), float(high), len(first) + len(second))


def friedman(table: Sequence[Sequence[float]]) -> Friedman:
    """Friedman's test on rows of people and columns of conditions, at least three [Friedman1937], corrected for ties.

    Raises:
        ValueError: If there are fewer than three conditions or no people.
    """
    values = np.asarray(table, dtype=float)
    if values.ndim != 2 or values.shape[1] < 3 or not len(values):
        raise ValueError("Friedman's test needs people with three or more conditions each")
    n, k = values.shape
    if not np.ptp(values, axis=1).any():
        return Friedman(0.0, 1.0, 0.0, n, k)
    chi2, p = friedmanchisquare(*values.T)
    return Friedman(float(chi2), float(p), float(chi2) / (n * (k - 1)), n, k)


def rank_sum(a: Sequence[float], b: Sequence[float]) -> tuple[float, float]:
    """The Mann-Whitney test of two groups of people, one value each, two-sided [MannWhitney1947].

    Returns:
        The p value, and the rank-biserial correlation, > 0 if b is higher.
    """
    if not len(a) or not len(b):
        return 1.0, 0.0
    found = mannwhitneyu(b, a, alternative="two-sided")
    return float(found.pvalue), 2.0 * float(found.statistic) / (len(a) * len(b)) - 1.0


def agreement(units: Sequence[Sequence[float]]) -> Estimate:
    """Krippendorff's ordinal alpha of the values that each unit was given [Krippendorff2011].

    1 is perfect agreement, 0 what chance would give; the interval is a 95 % bootstrap over the units. Units with fewer
    than two values do not count; NaN where nothing can be compared or all values are the same.
    """
    counts = _tabulated(units)
    n, rng = len(counts), np.random.default_rng(0)
    draws = [_alpha(counts[rng.integers(0, n, n)]) for _ in range(UNIT_RESAMPLES if n > 1 else 0)]
    found = np.array([draw for draw in draws if not math.isnan(draw)])
    low, high = np.quantile(found, (0.025, 0.975)) if len(found) else (math.nan, math.nan)
    return Estimate(_alpha(counts), float(low), float(high), n)


def bradley_terry(names: Sequence[str], wins: Array, ties: Array | None = None, *, pseudo: float = 0.0) -> Strengths:
    """Fit preferences by maximum likelihood [BradleyTerry1952], with ties as in [Davidson1970], by Newton's method.

    Args:
        names: The k conditions.
        wins: (k, k) how often the one of the row was preferred to the one of the column.
        ties: (k, k), symmetric, how often none was.
        pseudo: Wins and losses of each against an imaginary average condition, which keep the worth finite where one
            always wins; 0 for the likelihood alone, which then has no maximum.
    """
    k = len(names)
    tied = np.zeros((k, k)) if ties is None else np.asarray(ties, dtype=float)
    first, second = np.triu_indices(k, 1)
    rows, pairs = np.arange(len(first)), len(first)
    # by comparison and outcome (the first, the second, none): what adds to its log odds, and how often it was seen
    adds, seen = np.zeros((pairs + k, 3, k + 1)), np.zeros((pairs + k, 3))
    adds[rows, 0, first] = adds[rows, 1, second] = adds[rows, 2, k] = 1.0
    adds[rows, 2, first] = adds[rows, 2, second] = 0.5
    adds[pairs + np.arange(k), 0, np.arange(k)] = 1.0
    seen[:pairs] = np.stack([wins[first, second], wins[second, first], tied[first, second]], axis=1)
    seen[pairs:, :2] = pseudo
    impossible = np.zeros_like(seen)
    impossible[pairs if tied.any() else 0 :, 2] = -np.inf
    log_odds = _newton(adds, seen, impossible)
    worth = softmax(log_odds[:k])
    tie = math.exp(log_odds[k]) if tied.any() else 0.0
    return Strengths(tuple(names), tuple(map(float, worth)), tie, round(float(seen[:pairs].sum())))


def _newton(adds: Array, seen: Array, offset: Array) -> Array:
    """Maximise the likelihood of a conditional logit: adds (m, 3, p), seen and offset (m, 3)."""
    x = np.zeros(adds.shape[2])
    n, flat = seen.sum(axis=1, keepdims=True), adds.reshape(-1, adds.shape[2])
    for _ in range(200):
        expected = n * softmax(adds @ x + offset, axis=1)
        mean = np.einsum("mo,mop->mp", expected, adds)
        information = (flat * expected.reshape(-1, 1)).T @ flat - (mean / np.maximum(n, 1e-12)).T @ mean
        step = np.linalg.pinv(information) @ ((seen - expected).reshape(-1) @ flat)
        x = x + step / max(1.0, float(np.abs(step).max()) / 2.0)
        if np.abs(step).max() < 1e-9:
            break
    return x


def _tabulated(units: Sequence[Sequence[float]]) -> Array:
    """How often each unit with two or more values was given each value that occurs, in ascending order (units, v)."""
    pairable = [np.asarray(unit, dtype=float) for unit in units if len(unit) >= 2]
    values = np.unique(np.concatenate(pairable)) if pairable else np.zeros(0)
    counts = [np.bincount(np.searchsorted(values, unit), minlength=len(values)) for unit in pairable]
    return np.array(counts, dtype=float).reshape(len(pairable), len(values))


def _alpha(counts: Array) -> float:
    weighed = counts / (counts.sum(axis=1, keepdims=True) - 1.0)
    together = counts.T @ weighed - np.diag(weighed.sum(axis=0))
    marginal = together.sum(axis=0)
    middle = np.cumsum(marginal) - marginal / 2
    distance = np.subtract.outer(middle, middle) ** 2
    expected = float((np.outer(marginal, marginal) * distance).sum())
    observed = float((together * distance).sum()) * (marginal.sum() - 1.0)
    return 1.0 - observed / expected if expected > 0 else math.nan


def sus(answers: Sequence[float]) -> float:
    """The System Usability Scale, 0..100, of ten answers 1..5 in the questionnaire's order [Brooke1996]."""
    if len(answers) != 10:
        raise ValueError(f"SUS has ten answers, not {len(answers)}")
    return 2.5 * sum(x - 1 if i % 2 == 0 else 5 - x for i, x in enumerate(answers))


def umux_lite(answers: Sequence[float]) -> float:
    """UMUX-Lite, 0..100, of two answers 1..7 [Lewis2013], without the regression onto SUS."""
    if len(answers) != 2:
        raise ValueError(f"UMUX-Lite has two answers, not {len(answers)}")
    return (sum(answers) - 2) * 100 / 12


def raw_tlx(scales: Mapping[str, float]) -> float:
    """The raw task load index, 0..100: the mean of the six NASA-TLX scales, unweighted [Hart2006]."""
    if len(scales) != 6:
        raise ValueError(f"NASA-TLX has six scales, not {len(scales)}")
    return sum(scales.values()) / 6


def signed_rank_power(n: int, effect: float, *, alpha: float = 0.05) -> float:
    """The chance that Wilcoxon's exact signed-rank test on n people finds an effect, two-sided, by simulation.

    The effect is Cohen's dz: mean difference over its standard deviation, differences being normal.
    """
    critical = critical_rank_sum(n, alpha)
    if critical < 0:
        return 0.0
    found = 0
    rng = np.random.default_rng(0)
    for _ in range(DRAWS // BATCH):
        difference = rng.normal(effect, 1.0, (BATCH, n))
        ranks = np.argsort(np.argsort(np.abs(difference), axis=1), axis=1) + 1
        positive = np.where(difference > 0, ranks, 0).sum(axis=1)
        found += int((np.minimum(positive, n * (n + 1) // 2 - positive) <= critical).sum())
    return found / DRAWS


def critical_rank_sum(n: int, alpha: float = 0.05) -> int:
    """The largest smaller rank sum of n differences that is significant, two-sided; -1 if none is [Wilcoxon1945]."""
    chance = np.ones(1)
    for rank in range(1, n + 1):
        step = np.zeros(rank + 1)
        step[[0, rank]] = 0.5
        chance = np.convolve(chance, step)
    return int(np.searchsorted(np.cumsum(chance), alpha / 2 * (1 + 1e-9), side="right")) - 1


def people_needed(effect: float, *, power: float = 0.8, alpha: float = 0.05, most: int = 2000) -> int:
    """The smallest number of people at which Wilcoxon's signed-rank test finds an effect dz with that chance.

    Raises:
        ValueError: If it takes more than `most`.
    """
    z = float(norm.ppf(1 - alpha / 2) + norm.ppf(power))
    n = max(5, math.floor((z / effect) ** 2 * math.pi / 3) - 3)  # pi / 3: its efficiency for normal differences
    while n <= most and signed_rank_power(n, effect, alpha=alpha) < power:
        n += 1
    if n > most:
        raise ValueError(f"an effect of {effect:g} takes more than {most} people")
    while n > 2 and signed_rank_power(n - 1, effect, alpha=alpha) >= power:
        n -= 1
    return n
