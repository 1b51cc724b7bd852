"""Records counted: success by writer, condition, subset and kind, and comparisons of pairs."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, groupby
from typing import Any, Literal

import numpy as np
from scipy.stats import binomtest, rankdata, wilcoxon

from ovita.baselines import labelled
from ovita.bench.records import OUTCOMES, Column, Record, Round
from ovita.paths.trajectory import Array

By = Literal["all", "subset", "kind"]


@dataclass(frozen=True)
class Tally:
    """One group of records of one writer and condition.

    Args:
        by, group: What groups are made by, and the group's name; "all" for all.
        success, first, executable: Records whose last answer passes, whose first one does, whose first one ran.
        score: Mean share of the check's clauses that hold.
        attempts: Mean number of policies written for the first answer.
        p50, p95: Percentiles of the time to the first answer [ms].
        input_tokens, output_tokens, cost: Of all answers, feedback included.
        limits: How often each verdict on the limits occurred.
        outcomes: How many first answers were right, right after one yes, asked, declined, flagged or silently wrong.
        lost_to_limits: Records whose policy's own output passes, but not the result once limits were enforced.
        unreached: Records whose writer could not be reached; they count as failures.
    """

    writer: str
    condition: str
    by: By
    group: str
    success: Interval
    first: Interval
    executable: Interval
    score: float
    attempts: float
    p50: float
    p95: float
    input_tokens: int
    output_tokens: int
    cost: float
    limits: Mapping[str, int]
    outcomes: Mapping[str, int]
    lost_to_limits: int
    unreached: int

    @property
    def name(self) -> str:
        """Writer and condition as a heading."""
        return named((self.writer, self.condition))


@dataclass(frozen=True)
class Comparison:
    """A paired comparison of two columns on their common samples: what, a, b, and the test.

    `holm` is the test's p value corrected for all comparisons of the same thing.
    """

    what: str
    a: str
    b: str
    paired: Paired
    holm: float = math.nan


def by_column(records: Iterable[Record]) -> dict[Column, list[Record]]:
    """Records by writer and condition, in their order."""
    found: dict[Column, list[Record]] = defaultdict(list)
    for record in records:
        found[record.column].append(record)
    return found


def named(column: Column) -> str:
    """A column as a heading."""
    writer, condition = labelled(column[0]), column[1]
    return writer if condition == "default" else f"{writer}, {condition}"


def tallies(
    records: Sequence[Record], by: By = "all", prices: Mapping[str, tuple[float, float]] | None = None
) -> list[Tally]:
    """Count records by writer, condition and group."""
    found = []
    for mine in by_column(records).values():
        ordered = sorted(mine, key=lambda r: _group(r, by))
        found += [
            _tally(list(part), by, group, prices or {}) for group, part in groupby(ordered, lambda r: _group(r, by))
        ]
    return found


def idle(records: Sequence[Record]) -> Interval:
    """How many samples pass by doing nothing."""
    by_sample = {r.sample: r.idle for r in records}
    return wilson(sum(by_sample.values()), len(by_sample))


def rounds(mine: Sequence[Record]) -> list[Interval]:
    """Success of one writer and condition after 0, 1, 2, ... turns of feedback."""
    most = max((len(r.rounds) for r in mine), default=0)
    return [wilson(sum(any(x.passed for x in r.rounds[: k + 1]) for r in mine), len(mine)) for k in range(most)]


def comparisons(records: Sequence[Record]) -> list[Comparison]:
    """Compare writers, conditions with the default one, and answers with and without feedback.

    Success is compared by McNemar's test; the share of clauses that hold, and the time to the first answer between
    writers, by Wilcoxon's.
    """
    columns = {column: {r.sample: r for r in mine} for column, mine in by_column(records).items()}
    found: list[Comparison] = []
    for a, b in combinations(columns, 2):
        one_differs = a[1] == b[1] or a[0] == b[0]  # two writers as they are, or a condition and its default one
        if "default" in (a[1], b[1]) and one_differs:
            found += _pair(a, b, columns[a], columns[b])
    return _corrected([*found, *_with_feedback(by_column(records))])


def _with_feedback(columns: Mapping[Column, Sequence[Record]]) -> Iterator[Comparison]:
    for column, mine in columns.items():
        if any(len(r.rounds) > 1 for r in mine):
            paired = mcnemar([r.first.passed for r in mine], [r.last.passed for r in mine])
            yield Comparison("success", named(column), f"{named(column)}, with feedback", paired)


def _corrected(found: Sequence[Comparison]) -> list[Comparison]:
    p = np.array([c.paired.p for c in found])
    for what in dict.fromkeys(c.what for c in found):
        family = [i for i, c in enumerate(found) if c.what == what]
        p[family] = holm(p[family])
    return [replace(c, holm=float(value)) for c, value in zip(found, p, strict=True)]


def _pair(a: Column, b: Column, left: Mapping[str, Record], right: Mapping[str, Record]) -> list[Comparison]:
    """Two columns on their common samples; how long they took where the writers differ."""
    common = [sample for sample in left if sample in right]
    if not common:
        return []

    def both(value: Callable[[Record], Any]) -> tuple[list[Any], list[Any]]:
        return [value(left[sample]) for sample in common], [value(right[sample]) for sample in common]

    tests = {
        "success": mcnemar(*both(lambda r: r.last.passed)),
        "clauses": signed_rank(*both(lambda r: r.last.score)),
        **({"time": signed_rank(*both(lambda r: r.first.ms))} if a[0] != b[0] else {}),
    }
    return [Comparison(what, named(a), named(b), paired) for what, paired in tests.items()]


def _group(record: Record, by: By) -> str:
    return "all" if by == "all" else str(getattr(record, by))


def _tally(part: Sequence[Record], by: By, group: str, prices: Mapping[str, tuple[float, float]]) -> Tally:
    n = len(part)
    first, last = [r.first for r in part], [r.last for r in part]
    rounds, times = [x for r in part for x in r.rounds], [x.ms for x in first]

    def total(of: Sequence[Round], what: str) -> Any:
        return sum(getattr(x, what) for x in of)

    return Tally(
        *part[0].column,
        by=by,
        group=group,
        success=wilson(total(last, "passed"), n),
        first=wilson(total(first, "passed"), n),
        executable=wilson(total(first, "executable"), n),
        score=total(last, "score") / n,
        attempts=total(first, "attempts") / n,
        p50=percentile(times, 0.5),
        p95=percentile(times, 0.95),
        input_tokens=total(rounds, "input_tokens"),
        output_tokens=total(rounds, "output_tokens"),
        cost=sum(r.cost(prices) for r in part),
        limits=dict(sorted(Counter(x.limits for x in last).items())),
        outcomes=dict.fromkeys(OUTCOMES, 0) | Counter(r.outcome for r in part),
        lost_to_limits=sum(x.proposed_passed and not x.passed for x in last),
        unreached=sum(r.unreached for r in part),
    )


@dataclass(frozen=True)
class Interval:
    """A share with its confidence interval; `rate` is NaN where n is 0."""

    successes: int
    n: int
    rate: float
    low: float
    high: float

    @property
    def error(self) -> tuple[float, float]:
        """How far the interval reaches below and above the rate."""
        return max(self.rate - self.low, 0.0), max(self.high - self.rate, 0.0)


@dataclass(frozen=True)
class Paired:
    """A paired comparison of b with a.

    Args:
        test: "McNemar" or "Wilcoxon".
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


def wilson(successes: int, n: int) -> Interval:
    """Wilson's 95 % score interval of `successes` out of `n` [Wilson1927]; 0..1 where n is 0.

    Raises:
        ValueError: If the counts make no sense.
    """
    if not 0 <= successes <= n:
        raise ValueError(f"{successes} successes of {n} trials make no sense")
    if n == 0:
        return Interval(0, 0, math.nan, 0.0, 1.0)
    low, high = binomtest(successes, n).proportion_ci(0.95, method="wilson")
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
    better = int((np.asarray(b) > np.asarray(a)).sum())
    changed = better + int((np.asarray(a) > np.asarray(b)).sum())
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


def holm(p: Sequence[float] | Array) -> Array:
    """P values of several tests, corrected so that the chance of any false alarm is kept [Holm1979], in their order.

    The k-th smallest of m is multiplied by m - k + 1; none is smaller than one before it, none exceeds 1.
    """
    values = np.asarray(p, dtype=float)
    order = np.argsort(values, kind="stable")
    corrected = np.empty_like(values)
    corrected[order] = np.minimum(np.maximum.accumulate(values[order] * np.arange(len(values), 0, -1)), 1.0)
    return corrected


def percentile(values: Sequence[float], share: float) -> float:
    """A percentile (share 0..1), NaN of no values."""
    return float(np.quantile(np.asarray(values, dtype=float), share)) if len(values) else math.nan
