"""Statistics agree with published worked examples and with scipy."""

import math

import numpy as np
import pytest
from scipy.stats import norm, ttest_1samp, wilcoxon

from ovita.bench.tables import signed_rank
from ovita.study import statistics as st

# Hollander and Wolfe, Nonparametric Statistical Methods (1973), p. 140: 22 players rounding first base in three ways.
BASES = """5.40 5.50 5.55 5.85 5.70 5.75 5.20 5.60 5.50 5.55 5.50 5.40 5.90 5.85 5.70 5.45 5.55 5.60 5.40 5.40 5.35
5.45 5.50 5.35 5.25 5.15 5.00 5.85 5.80 5.70 5.25 5.20 5.10 5.65 5.55 5.45 5.60 5.35 5.45 5.05 5.00 4.95 5.50 5.50 5.40
5.45 5.55 5.50 5.55 5.55 5.35 5.45 5.50 5.55 5.50 5.45 5.25 5.65 5.60 5.40 5.70 5.65 5.55 6.30 6.30 6.25"""

# Krippendorff, Computing Krippendorff's Alpha-Reliability (2011), example C: 4 observers, 12 units, data missing.
OBSERVERS = """1 2 3 3 2 1 4 1 2 . . .
1 2 3 3 2 2 4 1 2 5 . 3
. 3 3 3 2 3 4 2 2 5 1 .
1 2 3 3 2 4 4 1 2 5 1 ."""

# Davidson, JASA 65 (1970) 317-328: six brands of pudding; i, j, comparisons, i preferred, j preferred, none.
PUDDING = """1 2 57 19 22 16 1 3 47 16 19 12 2 3 48 19 19 10 1 4 54 18 23 13 2 4 51 23 19 9 3 4 54 19 20 15 1 5 50 13 19
18 2 5 48 16 20 12 3 5 48 16 15 17 4 5 47 17 14 16 1 6 51 18 21 12 2 6 54 22 20 12 3 6 41 13 18 10 4 6 51 14 19 18
5 6 44 11 21 12"""


def test_friedmans_test_of_the_textbook():
    # R 4: friedman.test(RoundingTimes): chi-squared 11.143, df 2, p 0.003805
    got = st.friedman(np.array(BASES.split(), dtype=float).reshape(22, 3))
    assert (round(got.chi2, 3), round(got.p, 6)) == (11.143, 0.003805)
    assert (got.n, got.k) == (22, 3) and got.w == pytest.approx(11.142857 / 44, abs=1e-6)


def test_friedman_of_no_difference_and_of_perfect_order():
    assert st.friedman([[3, 3, 3]] * 4) == st.Friedman(0.0, 1.0, 0.0, 4, 3)
    assert st.friedman([[1, 2, 3]] * 5).w == pytest.approx(1.0)
    with pytest.raises(ValueError, match="three or more"):
        st.friedman([[1, 2]])


def test_wilcoxons_test_of_the_textbook():
    # Hollander and Wolfe (1973), p. 29: Hamilton's depression scale of nine patients; R 4: V = 40, p = 0.03906
    before = [1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30]
    after = [0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29]
    got = signed_rank(after, before)
    assert round(got.p, 5) == 0.03906 and got.effect == pytest.approx((40 - 5) / 45)


def test_krippendorffs_own_example():
    rows = [line.split() for line in OBSERVERS.splitlines()]
    units = [[float(row[i]) for row in rows if row[i] != "."] for i in range(12)]
    got = st.agreement(units)
    assert round(got.value, 3) == 0.815
    assert got.low < got.value < got.high and got.n == 11  # one unit has one value


def test_agreement_at_the_edges():
    assert st.agreement([[1, 1], [4, 4], [5, 5]]).value == 1.0
    assert st.agreement([[1, 5], [5, 1], [1, 5]]).value < 0
    assert all(math.isnan(st.agreement(units).value) for units in ([[3, 3], [3, 3]], [[1], []], []))


def pudding():
    wins, ties = np.zeros((6, 6)), np.zeros((6, 6))
    for i, j, _, w, v, t in np.array(PUDDING.split(), dtype=int).reshape(15, 6):
        wins[i - 1, j - 1], wins[j - 1, i - 1], ties[i - 1, j - 1], ties[j - 1, i - 1] = w, v, t, t
    return wins, ties


def test_preferences_with_ties_are_davidsons():
    got = st.bradley_terry("123456", *pudding())
    # as published, and as the R package PlackettLuce gives after seven iterations
    assert got.worth == pytest.approx((0.1388005, 0.1729985, 0.1617420, 0.1653930, 0.1586805, 0.2023855), abs=5e-5)
    assert got.tie == pytest.approx(0.7468147, abs=5e-5) and got.n == 745


def test_preferences_without_ties_are_bradleys_and_terrys():
    # Citations between four journals, Stigler (1994), as in Agresti's Categorical Data Analysis; R's BradleyTerry2
    # gives the log worth 0, -2.9491, -0.4796, 0.2690.
    wins = np.array([[0, 730, 498, 221], [33, 0, 68, 17], [320, 813, 0, 142], [284, 276, 325, 0]], dtype=float)
    got = st.bradley_terry(["Biometrika", "Comm Statist", "JASA", "JRSS-B"], wins)
    assert np.log(np.divide(got.worth, got.worth[0])) == pytest.approx([0, -2.9491, -0.4796, 0.2690], abs=1e-4)
    assert got.tie == 0.0 and got.worth[0] / (got.worth[0] + got.worth[2]) == pytest.approx(
        1 / (1 + math.exp(-0.4796)), abs=1e-4
    )


def test_one_that_always_wins_has_a_finite_worth():
    got = st.bradley_terry("AB", np.array([[0, 8], [0, 0]]), pseudo=0.5)
    assert 0.8 < got.worth[0] < 1.0
    assert st.bradley_terry("AB", np.zeros((2, 2)), np.array([[0, 3], [3, 0]]), pseudo=0.5).worth == (0.5, 0.5)


def test_two_groups():
    # Mann and Whitney's statistic of R: wilcox.test(c(0.80, 0.83, 1.89, 1.04, 1.45, 1.38, 1.91, 1.64, 0.73, 1.46),
    # c(1.15, 0.88, 0.90, 0.74, 1.21)): Hollander and Wolfe (1973), p. 69, W = 35, p = 0.2544
    x, y = [0.80, 0.83, 1.89, 1.04, 1.45, 1.38, 1.91, 1.64, 0.73, 1.46], [1.15, 0.88, 0.90, 0.74, 1.21]
    p, effect = st.rank_sum(y, x)
    assert round(p, 4) == 0.2544 and effect == pytest.approx(2 * 35 / 50 - 1)
    assert st.rank_sum([], x) == (1.0, 0.0)


def test_an_interval_of_a_mean_covers_as_often_as_it_says():
    rng = np.random.default_rng(1)
    covered = 0
    for k in range(120):
        got = st.mean_of_people(rng.normal(3.0, 1.0, 24), seed=k)
        covered += got.low <= 3.0 <= got.high
    assert 0.87 <= covered / 120 <= 0.99
    assert st.mean_of_people([4.0, 4.0, 4.0]) == st.Estimate(4.0, 4.0, 4.0, 3)
    assert st.mean_of_people([4.0]).high == math.inf and math.isnan(st.mean_of_people([]).value)


def test_questionnaires():
    # Brooke (1996), SUS: a "quick and dirty" usability scale, the worked sheet: 22 points, 55
    assert st.sus([5, 4, 2, 1, 2, 3, 2, 4, 5, 2]) == 55.0
    assert st.sus([5, 1] * 5) == 100.0 and st.sus([1, 5] * 5) == 0.0
    assert (st.umux_lite([1, 1]), st.umux_lite([4, 4]), st.umux_lite([7, 7])) == (0.0, 50.0, 100.0)
    assert st.raw_tlx(dict.fromkeys("abcdef", 30.0) | {"f": 90.0}) == 40.0
    for score, wrong in ((st.sus, [3.0] * 9), (st.umux_lite, [3.0]), (st.raw_tlx, {"a": 3.0})):
        with pytest.raises(ValueError, match=r"has (ten|two|six)"):
            score(wrong)


@pytest.mark.parametrize(("n", "critical"), [(5, -1), (6, 0), (10, 8), (20, 52), (30, 137)])
def test_critical_values_are_the_tables(n, critical):
    # two-sided, 0.05: the table in Siegel's Nonparametric Statistics and every textbook since
    assert st.critical_rank_sum(n) == critical


def test_simulated_studies_are_judged_as_scipy_judges_them():
    rng = np.random.default_rng(3)
    rejected = [wilcoxon(rng.normal(0.5, 1.0, 20), method="exact").pvalue < 0.05 for _ in range(400)]
    assert st.signed_rank_power(20, 0.5) == pytest.approx(np.mean(rejected), abs=0.06)
    assert st.signed_rank_power(5, 5.0) == 0.0  # no outcome of five is significant
    assert st.signed_rank_power(40, 0.0) == pytest.approx(0.05, abs=0.006)


def test_how_many_people_are_needed():
    # G*Power 3.1, Wilcoxon signed-rank test for matched pairs, normal parent, dz 0.5, 0.05 two-sided, power 0.8: 35
    assert abs(st.people_needed(0.5) - 35) <= 1
    assert st.people_needed(0.8) < st.people_needed(0.5) < st.people_needed(0.5, alpha=0.05 / 3)
    with pytest.raises(ValueError, match="more than 30 people"):
        st.people_needed(0.3, most=30)


def test_the_power_is_near_the_t_tests_times_its_efficiency():
    rng = np.random.default_rng(0)
    t = np.mean(ttest_1samp(rng.normal(0.6, 1.0, (4000, 25)), 0.0, axis=1).pvalue < 0.05)
    assert st.signed_rank_power(25, 0.6) == pytest.approx(t, abs=0.05) and norm.cdf(0) == 0.5
