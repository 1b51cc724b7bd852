"""Statistics of success: intervals, paired tests and their effect sizes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binomtest, rankdata, wilcoxon


@dataclass(frozen=True)
class Interval:
    """A share with its confidence interval; `rate` is NaN where n is 0."""

    successes: int
    n: int
    rate: float
    low: float
    high: float


@dataclass(frozen=True)
class Paired:
    """A paired comparison of b with a.

    Args:
        test: "McNemar" or "Wilcoxon".
        n: Number of pairs.
        changed: Pairs that differ.
        better: Pairs in which b is higher.
        p: Two-sided p value; 1 where no pair differs.
        effect: > 0 if b is higher. McNemar: Cohen's g, -0.5..0.5. Wilcoxon: rank-biserial correlation, -1..1.
    """

    test: str
    n: int
    changed: int
    better: int
    p: float
    effect: float


def wilson(successes: int, n: int, *, level: float = 0.95) -> Interval:
    """Wilson's score interval of a share [Wilson1927].

    Args:
        successes: 0..n.
        n: Number of trials; 0 gives the interval 0..1.
        level: Confidence.

    Raises:
        ValueError: If the counts make no sense.
    """
    if not 0 <= successes <= n:
        raise ValueError(f"{successes} successes of {n} trials make no sense")
    if n == 0:
        return Interval(0, 0, math.nan, 0.0, 1.0)
    low, high = binomtest(successes, n).proportion_ci(level, method="wilson")
    return Interval(successes, n, successes / n, float(low), float(high))


def mcnemar(a: Sequence[bool], b: Sequence[bool]) -> Paired:
    """McNemar's exact test of two yes/no outcomes on the same samples [McNemar1947].

    With m pairs that differ, of which k favour b, k is binomial(m, 1/2) if neither is better; the effect is Cohen's
    g = k/m - 1/2.

    Raises:
        ValueError: If the lengths differ.
    """
    if len(a) != len(b):
        raise ValueError(f"{len(a)} and {len(b)} outcomes cannot be paired")
    better = sum(bool(y) and not x for x, y in zip(a, b, strict=True))
    changed = better + sum(bool(x) and not y for x, y in zip(a, b, strict=True))
    if not changed:
        return Paired("McNemar", len(a), 0, 0, 1.0, 0.0)
    p = float(binomtest(better, changed, 0.5).pvalue)
    return Paired("McNemar", len(a), changed, better, min(p, 1.0), better / changed - 0.5)


def signed_rank(a: Sequence[float], b: Sequence[float]) -> Paired:
    """Wilcoxon's signed-rank test of two measurements on the same samples [Wilcoxon1945].

    Pairs without a difference are left out. With W+ the sum of the ranks of |b - a| where b is higher, W- where it is
    lower, the effect is the matched-pairs rank-biserial correlation (W+ - W-) / (W+ + W-) [Kerby2014].

    Raises:
        ValueError: If the lengths differ.
    """
    if len(a) != len(b):
        raise ValueError(f"{len(a)} and {len(b)} measurements cannot be paired")
    # Rounded, so that equal shares of different sums tie.
    difference = np.round(np.asarray(b, dtype=float) - np.asarray(a, dtype=float), 12)
    difference = difference[difference != 0.0]
    if not len(difference):
        return Paired("Wilcoxon", len(a), 0, 0, 1.0, 0.0)
    ranks = rankdata(np.abs(difference))
    up, total = float(ranks[difference > 0].sum()), float(ranks.sum())
    # Exact where it can be: few pairs without ties.
    exact = len(difference) <= 50 and len(np.unique(np.abs(difference))) == len(difference)
    p = float(wilcoxon(difference, method="exact" if exact else "approx").pvalue)
    better = int((difference > 0).sum())
    return Paired("Wilcoxon", len(a), len(difference), better, min(p, 1.0), (2 * up - total) / total)


def percentile(values: Sequence[float], share: float) -> float:
    """A percentile (share 0..1), NaN of no values."""
    return float(np.quantile(np.asarray(values, dtype=float), share)) if len(values) else math.nan
