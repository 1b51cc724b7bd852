"""Records counted: success by writer, condition, subset and kind, and comparisons of pairs."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, Literal

import numpy as np
from scipy.stats import binomtest, rankdata, wilcoxon

from ovita.baselines import labelled
from ovita.bench.records import OUTCOMES, Record

By = Literal["all", "subset", "kind"]

Column = tuple[str, str]
"""Writer and condition."""


@dataclass(frozen=True)
class Tally:
    """One group of records of one writer and condition.

    Args:
        writer, condition: Their names.
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


def columns(records: Sequence[Record]) -> list[Column]:
    """Writers and conditions, in the records' order."""
    return list(dict.fromkeys((r.writer, r.condition) for r in records))


def _of(column: Column, records: Sequence[Record]) -> list[Record]:
    return [r for r in records if (r.writer, r.condition) == column]


def named(column: Column) -> str:
    """A column as a heading."""
    writer, condition = labelled(column[0]), column[1]
    return writer if condition == "default" else f"{writer}, {condition}"


def tallies(
    records: Sequence[Record], by: By = "all", prices: Mapping[str, tuple[float, float]] | None = None
) -> list[Tally]:
    """Count records by writer, condition and group."""
    found: list[Tally] = []
    for writer, condition in columns(records):
        mine = _of((writer, condition), records)
        for group in sorted({_group(r, by) for r in mine}):
            part = [r for r in mine if _group(r, by) == group]
            found.append(_tally(part, writer, condition, by, group, prices or {}))
    return found


def idle(records: Sequence[Record]) -> Interval:
    """How many samples pass by doing nothing."""
    by_sample = {r.sample: r.idle for r in records}
    return wilson(sum(by_sample.values()), len(by_sample))


def rounds(records: Sequence[Record], column: Column) -> list[Interval]:
    """Success after 0, 1, 2, ... turns of feedback."""
    mine = _of(column, records)
    most = max((len(r.rounds) for r in mine), default=0)
    return [wilson(sum(any(x.passed for x in r.rounds[: k + 1]) for r in mine), len(mine)) for k in range(most)]


def comparisons(records: Sequence[Record]) -> list[Comparison]:
    """Compare writers, conditions with the default one, and answers with and without feedback.

    Success is compared by McNemar's test; the share of clauses that hold, and the time to the first answer between
    writers, by Wilcoxon's.
    """
    by_column = {column: {r.sample: r for r in _of(column, records)} for column in columns(records)}
    found: list[Comparison] = []
    for a, b in combinations(by_column, 2):
        one_differs = a[1] == b[1] or a[0] == b[0]  # two writers as they are, or a condition and its default one
        if "default" in (a[1], b[1]) and one_differs:
            found += _pair(a, b, by_column[a], by_column[b])
    for column, mine in by_column.items():
        if any(len(r.rounds) > 1 for r in mine.values()):
            paired = mcnemar([r.first.passed for r in mine.values()], [r.last.passed for r in mine.values()])
            found.append(Comparison("success", named(column), f"{named(column)}, with feedback", paired))
    return _corrected(found)


def _corrected(found: Sequence[Comparison]) -> list[Comparison]:
    p = np.array([c.paired.p for c in found])
    for what in dict.fromkeys(c.what for c in found):
        family = [i for i, c in enumerate(found) if c.what == what]
        p[family] = holm(p[family].tolist())
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
    return "all" if by == "all" else record.subset if by == "subset" else record.kind


def _tally(
    part: Sequence[Record], writer: str, condition: str, by: By, group: str, prices: Mapping[str, tuple[float, float]]
) -> Tally:
    n = len(part)
    times = [r.first.ms for r in part]
    return Tally(
        writer=writer,
        condition=condition,
        by=by,
        group=group,
        success=wilson(sum(r.last.passed for r in part), n),
        first=wilson(sum(r.first.passed for r in part), n),
        executable=wilson(sum(r.first.executable for r in part), n),
        score=sum(r.last.score for r in part) / n,
        attempts=sum(r.first.attempts for r in part) / n,
        p50=percentile(times, 0.5),
        p95=percentile(times, 0.95),
        input_tokens=sum(x.input_tokens for r in part for x in r.rounds),
        output_tokens=sum(x.output_tokens for r in part for x in r.rounds),
        cost=sum(r.cost(prices) for r in part),
        limits=dict(sorted(Counter(r.last.limits for r in part).items())),
        outcomes={name: sum(r.outcome == name for r in part) for name in OUTCOMES},
        lost_to_limits=sum(r.last.proposed_passed and not r.last.passed for r in part),
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


def holm(p: Sequence[float]) -> list[float]:
    """P values of several tests, corrected so that the chance of any false alarm is kept [Holm1979], in their order.

    The k-th smallest of m is multiplied by m - k + 1; none is smaller than one before it, none exceeds 1.
    """
    values = np.asarray(p, dtype=float)
    order = np.argsort(values, kind="stable")
    scaled = np.minimum(np.maximum.accumulate(values[order] * np.arange(len(values), 0, -1)), 1.0)
    corrected = np.empty_like(values)
    corrected[order] = scaled
    return [float(value) for value in corrected]


def percentile(values: Sequence[float], share: float) -> float:
    """A percentile (share 0..1), NaN of no values."""
    return float(np.quantile(np.asarray(values, dtype=float), share)) if len(values) else math.nan
