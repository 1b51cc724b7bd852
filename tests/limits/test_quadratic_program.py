"""The paper's objective, its sparse form, and the banded solution without obstacles."""

import numpy as np
import pytest

from ovita.limits.qp import Rows, Weights, decay, halo, objective, smooth_axes, solve_qp

FREE = np.full(3, np.inf)


def difference_matrix(n, dims=1):
    """D1 = kron(D, I_dims), ((n-1) dims, n dims): the differences of neighbouring waypoints, waypoint-major."""
    return np.kron(np.eye(n - 1, n, 1) - np.eye(n - 1, n), np.eye(dims))


def test_smoothness_is_waypoint_major():
    x = np.random.default_rng(0).normal(size=(5, 4))
    expected = float(((difference_matrix(5, 4) @ x.ravel()) ** 2).sum())
    assert objective(x, x, Weights(1.0, 1.0)) == pytest.approx(expected), "x_0 must be joined to x_1, not to y_0"


def test_a_constant_path_is_left_alone():
    reference = np.tile([1.0, 5.0, 2.0], (30, 1))
    found = solve_qp(
        reference, Weights(1, 1), lower=-FREE + 0 * reference, upper=FREE + 0 * reference, rows=Rows.none()
    )
    assert found == pytest.approx(reference, abs=1e-7)


@pytest.mark.parametrize("weights", [Weights(1, 0.3, 0), Weights(2, 0, 5), Weights(0.5, 2, 7)])
def test_optimum_agrees_with_dense_algebra(weights):
    rng = np.random.default_rng(1)
    reference = rng.normal(size=(20, 3))
    d1 = difference_matrix(20, 3)
    r = reference.ravel()
    hessian = weights.dev * np.eye(60) + (weights.smooth + weights.shape) * d1.T @ d1
    exact = np.linalg.solve(hessian, weights.dev * r + weights.shape * d1.T @ d1 @ r).reshape(20, 3)
    wide = np.full((20, 3), 1e3)
    sparse_ = solve_qp(reference, weights, lower=-wide, upper=wide, rows=Rows.none())
    assert sparse_ == pytest.approx(exact, abs=1e-6)
    assert smooth_axes(reference, weights, -FREE, FREE) == pytest.approx(
        exact if weights.smooth else reference, abs=1e-9
    )
    assert objective(exact, reference, weights) <= objective(reference, reference, weights) + 1e-12


@pytest.mark.parametrize("seed", range(6))
def test_bounds_banded_against_piqp(seed):
    rng = np.random.default_rng(seed)
    reference = rng.normal(size=(40, 2)).cumsum(axis=0) * 0.3
    weights = Weights(1.0, rng.choice([0.0, 0.5]), rng.choice([0.0, 8.0]) + 0.1)
    low, high = np.full(2, -0.4), np.full(2, 0.6)
    fixed = np.zeros(40, dtype=bool)
    fixed[[0, 17]] = True
    quick = smooth_axes(reference, weights, low, high, fixed)
    lower, upper = np.tile(low, (40, 1)), np.tile(high, (40, 1))
    lower[fixed] = upper[fixed] = reference[fixed]
    slow = solve_qp(reference, weights, lower=lower, upper=upper, rows=Rows.none(2))
    assert quick == pytest.approx(slow, abs=1e-5)
    assert np.array_equal(quick[fixed], reference[fixed])
    assert (quick[~fixed] >= low).all()
    assert (quick[~fixed] <= high).all()


def test_rows_hold_and_slack_saves_contradictions():
    reference = np.zeros((5, 3))
    wide = np.full((5, 3), 10.0)
    rows = Rows(np.array([2, 2]), np.array([[1.0, 0, 0], [-1.0, 0, 0]]), np.array([1.0, -3.0]))
    found = solve_qp(reference, Weights(1, 0, 1), lower=-wide, upper=wide, rows=rows)
    assert found[2, 0] == pytest.approx(1.0, abs=1e-6)
    clash = Rows(np.array([2, 2]), np.array([[1.0, 0, 0], [-1.0, 0, 0]]), np.array([1.0, 1.0]))
    assert solve_qp(reference, Weights(), lower=-wide, upper=wide, rows=clash) is None
    soft = solve_qp(reference, Weights(), lower=-wide, upper=wide, rows=clash, slack=1e4)
    assert abs(soft[2, 0]) <= 1.0 + 1e-6


def test_disturbances_fade_as_predicted():
    weights = Weights(1.0, 0.0, 16.0)
    reference = np.zeros((400, 1))
    bound = np.full((400, 1), np.inf)
    low = -bound
    low[200] = 1.0
    x = solve_qp(reference, weights, lower=low, upper=bound, rows=Rows.none(1))[:, 0]
    assert x[205] / x[204] == pytest.approx(decay(weights), rel=1e-4)
    assert abs(x[200 + halo(weights)]) < 1e-6
