import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from toolkit_paths import modest, paths, paths_and_masks, shares

from ovita.paths.trajectory import Trajectory
from ovita.toolkit import bound_speed, dwell, ramp_speed, scale_speed, set_speed, shift_speed, stop_at

OPERATIONS = {
    "scale": lambda t, m: scale_speed(t, 0.5, where=m),
    "ease": lambda t, m: scale_speed(t, 1.5, where=m, ease=0.2),
    "set": lambda t, m: set_speed(t, 0.3, where=m),
    "shift": lambda t, m: shift_speed(t, -0.1, where=m),
    "ramp": lambda t, m: ramp_speed(t, 0.1, 0.4, where=m),
    "cap": lambda t, m: bound_speed(t, 0.4, where=m),
    "slow": lambda t, m: ramp_speed(t, end=0.0, where=m),
}


@modest
@given(paths_and_masks(extra=2), st.sampled_from(sorted(OPERATIONS)))
def test_only_the_speeds_of_the_selected_waypoints_change(drawn, name):
    rows, mask = drawn
    before = rows.copy()
    out = OPERATIONS[name](rows, mask)
    assert np.array_equal(rows, before) and not np.shares_memory(out, rows)
    assert np.array_equal(out[:, [0, 1, 2, 4, 5]], rows[:, [0, 1, 2, 4, 5]])
    assert np.array_equal(out[~mask], rows[~mask])
    assert np.isfinite(out).all() and (out[:, 3] >= 0).all()


@modest
@given(paths(), st.floats(0, 3), st.floats(0, 3), shares)
def test_a_larger_factor_is_faster(rows, a, b, ease):
    mask = np.arange(len(rows)) < len(rows) / 2
    slow, fast = (scale_speed(rows, f, where=mask, ease=ease)[:, 3] for f in sorted((a, b)))
    assert (slow <= fast + 1e-12).all()


@modest
@given(paths_and_masks(), st.floats(0.01, 1), st.floats(0, 1))
def test_speeds_are_bounded_but_rest_stays_rest(drawn, most, share):
    rows, mask = drawn
    rows[::4, 3] = 0.0
    out = bound_speed(rows, most, share * most, where=mask)[:, 3]
    moving = mask & (rows[:, 3] > 0)
    assert ((out >= share * most) & (out <= most))[moving].all()
    assert np.array_equal(out[~moving], rows[~moving, 3])
    inside = moving & (rows[:, 3] >= share * most) & (rows[:, 3] <= most)
    assert np.array_equal(out[inside], rows[inside, 3])


def test_exact_factors_and_soft_edges(line):
    assert (scale_speed(line, 0.5)[:, 3] == 0.25).all()
    mask = (np.arange(21) >= 5) & (np.arange(21) <= 15)
    speed = scale_speed(line, 0.0, where=mask, ease=0.2)[:, 3]
    assert speed[10] == 0 and 0 < speed[6] < 0.5


def test_shifted_speeds_never_fall_below_zero_and_rest_stays_rest(line):
    line[0, 3] = 0.0
    assert np.allclose(shift_speed(line, 0.2)[:, 3], np.append(0.0, np.full(20, 0.7)))
    assert (shift_speed(line, -0.9)[:, 3] == 0).all()


def test_ramps_are_linear_in_arc_length(line):
    assert np.allclose(ramp_speed(line, 0.0, 1.0)[:, 3], line[:, 0])
    assert np.allclose(ramp_speed(line, end=0.0)[:, 3], 0.5 * (1 - line[:, 0]))
    mask = np.isin(np.arange(21), [2, 3, 4, 9])
    out = ramp_speed(line, 0.2, 0.4, where=mask)[:, 3]
    assert np.allclose(out[[2, 3, 4, 9]], [0.2, 0.3, 0.4, 0.2])
    assert (ramp_speed(line, end=0.1, where=np.arange(21) == 4)[4, 3]) == 0.1


@modest
@given(paths(), st.floats(0, 1), shares)
def test_stop_at_ends_at_rest(rows, at, brake):
    out = stop_at(rows, at, brake=brake)
    assert 2 <= len(out) <= len(rows)
    assert out[-1, 3] == 0
    assert np.array_equal(np.delete(out, 3, axis=1), np.delete(rows[: len(out)], 3, axis=1))
    assert (out[:, 3] <= rows[: len(out), 3]).all()
    resumed = stop_at(rows, at, brake=brake, resume=True)
    assert len(resumed) == len(rows) and (resumed[:, 3] == 0).any()


def test_stop_at_brakes_as_under_constant_deceleration(line, cup):
    out = stop_at(line, cup, brake=0.2)
    assert len(out) == 11
    assert np.array_equal(out[:7], line[:7])
    assert np.allclose(np.diff(out[6:, 3] ** 2), -0.25 / 4)
    through = stop_at(line, 0.5, brake=0.2, resume=True)
    assert np.allclose(through[:, 3], through[::-1, 3])
    assert len(stop_at(line, "start")) == 2
    assert len(stop_at(line, -1)) == 21


@modest
@given(paths(), st.floats(0, 1), st.integers(1, 30))
def test_dwell_repeats_a_waypoint_at_rest(rows, at, steps):
    out = dwell(rows, at, steps)
    assert len(out) == len(rows) + steps
    i = next(j for j in range(len(rows)) if len(np.unique(out[j : j + steps + 1], axis=0)) == 1 and out[j, 3] == 0)
    assert np.array_equal(np.delete(out, range(i, i + steps + 1), axis=0), np.delete(rows, i, axis=0))


def test_a_dwell_lasts_its_steps(line, cup):
    waited = Trajectory.from_array(dwell(line, cup, 7))
    assert waited.durations[10:17].sum() == pytest.approx(0.7)
