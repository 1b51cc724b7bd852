"""Statistics agree with published values and with scipy, also at the edges."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest, wilcoxon

from ovita.bench.tables import holm, mcnemar, percentile, signed_rank, wilson


@given(st.integers(1, 400).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_wilson_is_scipys_interval(counts):
    k, n = counts
    expected = binomtest(k, n).proportion_ci(method="wilson")
    got = wilson(k, n)
    assert got.rate == k / n
    assert (got.low, got.high) == pytest.approx((expected.low, expected.high), abs=1e-9)
    assert 0.0 <= got.low <= got.rate <= got.high <= 1.0


def test_wilson_of_nothing_says_nothing():
    got = wilson(0, 0)
    assert math.isnan(got.rate) and (got.low, got.high) == (0.0, 1.0)
    with pytest.raises(ValueError, match="make no sense"):
        wilson(3, 2)


def test_mcnemar_counts_only_pairs_that_differ():
    a = [True] * 5 + [False] * 10 + [True, False]
    b = [True] * 5 + [True] * 10 + [False, False]
    got = mcnemar(a, b)
    assert (got.n, got.changed, got.better) == (17, 11, 10)
    assert got.p == pytest.approx(binomtest(10, 11).pvalue) and got.p < 0.05
    assert got.effect == pytest.approx(10 / 11 - 0.5)
    assert mcnemar(b, a).effect == pytest.approx(-got.effect)


def test_no_difference_is_no_evidence():
    assert (mcnemar([True, False], [True, False]).p, mcnemar([], []).p) == (1.0, 1.0)
    assert (signed_rank([1.0, 2.0], [1.0, 2.0]).p, signed_rank([], []).p) == (1.0, 1.0)
    with pytest.raises(ValueError, match="cannot be paired"):
        mcnemar([True], [])
    with pytest.raises(ValueError, match="cannot be paired"):
        signed_rank([1.0], [])


def test_signed_rank_is_scipys_and_its_effect_has_the_right_sign():
    rng = np.random.default_rng(0)
    a = rng.normal(size=30)
    b = a + rng.normal(0.5, 1.0, size=30)
    got = signed_rank(a.tolist(), b.tolist())
    assert got.p == pytest.approx(wilcoxon(b - a).pvalue)
    assert 0 < got.effect < 1 and signed_rank(b.tolist(), a.tolist()).effect == pytest.approx(-got.effect)
    assert signed_rank([0.0] * 6, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).effect == 1.0


def test_ties_give_no_warning_and_a_finite_p():
    got = signed_rank([0.5] * 8, [1.0, 1.0, 1.0, 1.0, 0.0, 0.5, 1.0, 1.0])
    assert got.changed == 7 and 0.0 < got.p < 1.0


@pytest.mark.parametrize(
    ("p", "corrected"),
    [
        # The worked example of Wikipedia's article on the Holm-Bonferroni method.
        ([0.01, 0.04, 0.03, 0.005], [0.03, 0.06, 0.06, 0.02]),
        # R 4: p.adjust(c(0.01, 0.02, 0.03, 0.04, 0.05), "holm")
        ([0.01, 0.02, 0.03, 0.04, 0.05], [0.05, 0.08, 0.09, 0.09, 0.09]),
        ([0.6, 0.5], [1.0, 1.0]),
        ([], []),
    ],
)
def test_holm_is_the_published_correction(p, corrected):
    assert holm(p) == pytest.approx(corrected)


def test_percentile_of_nothing():
    assert math.isnan(percentile([], 0.5))
    assert percentile([1.0, 2.0, 3.0], 0.5) == 2.0
