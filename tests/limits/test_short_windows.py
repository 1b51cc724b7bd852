"""The dual of a short window against PIQP: the same optimum, or no answer at all."""

import numpy as np
import pytest

from ovita.limits.qp import MOST_ROWS, Rows, ShortWindow, Weights, objective, solve_qp

PRICE = 1e4


def random_window(seed):
    """Reference, weights, bounds, fixed waypoints, shape and limits that can all hold."""
    rng = np.random.default_rng(seed)
    n = int(rng.choice([2, 6, 12, 20]))
    reference = rng.normal(size=(n, 3)).cumsum(axis=0) * 0.1
    weights = Weights(rng.choice([0.5, 1.0]), rng.choice([0.0, 0.1]), rng.choice([0.0, 16.0]))
    wide = rng.choice([0.3, 10.0])
    lower, upper = np.full((n, 3), -wide), np.full((n, 3), wide)
    if rng.random() < 0.3:
        lower[:, 2] = upper[:, 2] = 0.05
    fixed = rng.random(n) < 0.2
    inside = np.clip(reference * 0.9, lower, upper)
    lower[fixed] = upper[fixed] = inside[fixed]
    waypoints = rng.integers(0, n, 2 * n)
    normals = rng.normal(size=(2 * n, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    offsets = (inside[waypoints] * normals).sum(axis=1) - rng.choice([0.0, 0.05], 2 * n)
    return (
        reference,
        weights,
        lower,
        upper,
        fixed,
        reference + rng.normal(size=(n, 3)) * 0.01,
        waypoints,
        normals,
        offsets,
    )


@pytest.mark.parametrize("seed", range(40))
def test_same_optimum_as_piqp(seed):
    reference, weights, lower, upper, fixed, shape, *limits = random_window(seed)
    rows = Rows(*limits)
    quick = ShortWindow(reference, weights, lower, upper, fixed, shape).solve(rows, PRICE)
    slow = solve_qp(reference, weights, lower=lower, upper=upper, rows=rows, shape=shape)
    assert quick is not None
    assert np.array_equal(quick[fixed], lower[fixed])
    assert (quick >= lower).all() and (quick <= upper).all()
    assert ((rows.normals * quick[rows.waypoints]).sum(axis=1) >= rows.offsets - 1e-8).all()
    assert quick == pytest.approx(slow, abs=1e-4)
    best = objective(slow, reference, weights, shape)
    assert objective(quick, reference, weights, shape) <= best + 1e-7 * max(best, 1.0)


def test_limits_given_twice_do_no_harm():
    reference, weights, lower, upper, fixed, shape, *limits = random_window(5)
    window = ShortWindow(reference, weights, lower, upper, fixed, shape)
    once = window.solve(Rows(*limits), PRICE)
    assert window.solve(Rows.join(Rows(*limits), Rows(*limits)), PRICE) == pytest.approx(once, abs=1e-7)


def test_without_limits_it_is_the_banded_optimum():
    reference, weights, lower, upper, fixed, shape, *_ = random_window(1)
    window = ShortWindow(reference, weights, lower - 5, upper + 5, np.zeros(len(fixed), dtype=bool), shape)
    assert np.array_equal(window.solve(Rows.none(), PRICE), window.optimum)


def test_no_answer_where_limits_clash_or_cost_more_than_the_price_or_are_too_many():
    reference = np.zeros((6, 3))
    wide = np.full((6, 3), 9.0)
    window = ShortWindow(reference, Weights(), -wide, wide, np.zeros(6, dtype=bool), reference)
    x = np.array([[1.0, 0.0, 0.0]])
    clash = Rows(np.array([2, 2]), np.concatenate([x, -x]), np.array([1.0, 1.0]))
    assert window.solve(clash, PRICE) is None
    dear = Rows(np.array([2]), x, np.array([5.0]))
    assert window.solve(dear, 4.9) is None
    assert window.solve(dear, 5.1)[2] == pytest.approx([5, 0, 0])
    beyond_the_bound = Rows(np.array([2]), x, np.array([9.1]))
    assert window.solve(beyond_the_bound, PRICE) is None
    many = MOST_ROWS + 1
    assert window.solve(Rows(np.zeros(many, dtype=int), np.repeat(x, many, axis=0), np.zeros(many)), PRICE) is None
