import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from toolkit_paths import modest, paths, paths_and_masks, shares

from ovita.paths.trajectory import Trajectory, arc_length
from ovita.toolkit import (
    accelerate,
    bound_speed,
    dwell,
    exponential_speed,
    keep_moving,
    ramp_speed,
    scale_speed,
    set_duration,
    set_speed,
    shift_speed,
    slow_turns,
    stop_at,
    trapezoid_speed,
)
from ovita.toolkit.speed import travel_time

OPERATIONS = {
    "scale": lambda t, m: scale_speed(t, 0.5, where=m),
    "ease": lambda t, m: scale_speed(t, 1.5, where=m, ease=0.2),
    "set": lambda t, m: set_speed(t, 0.3, where=m),
    "shift": lambda t, m: shift_speed(t, -0.1, where=m),
    "ramp": lambda t, m: ramp_speed(t, 0.1, 0.4, where=m),
    "cap": lambda t, m: bound_speed(t, 0.4, where=m),
    "slow": lambda t, m: ramp_speed(t, end=0.0, where=m),
    "exponential": lambda t, m: exponential_speed(t, 0.1, 0.8, where=m),
    "to rest": lambda t, m: exponential_speed(t, end=0.0, where=m),
    "accelerate": lambda t, m: accelerate(t, 0.5, where=m),
    "brake": lambda t, m: accelerate(t, -0.5, where=m),
    "trapezoid": lambda t, _: trapezoid_speed(t, 0.7),
    "turns": lambda t, _: slow_turns(t, 0.3),
}
OPERATIONS["duration"] = lambda t, m: set_duration(t, 3.0, where=m) if travel_time(t, m) else t.copy()
WHOLE = ("trapezoid", "turns")
speeds = st.floats(0, 2).map(lambda v: round(v, 3))


@modest
@given(paths_and_masks(extra=2), st.sampled_from(sorted(OPERATIONS)))
def test_only_the_speeds_of_the_selected_waypoints_change(drawn, name):
    rows, mask = drawn
    before = rows.copy()
    rows.flags.writeable = False
    out = OPERATIONS[name](rows, mask)
    assert np.array_equal(rows, before) and not np.shares_memory(out, rows)
    assert np.isfinite(out).all() and (out[:, 3] >= 0).all()
    assert len(out) == len(rows) or name == "trapezoid"
    if len(out) == len(rows):
        assert np.array_equal(out[:, [0, 1, 2, 4, 5]], rows[:, [0, 1, 2, 4, 5]])
    if name not in WHOLE:
        assert np.array_equal(out[~mask], rows[~mask])


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
    assert np.allclose(ramp_speed(line, 0.2, 1.0)[:, 3], 0.2 + 0.8 * line[:, 0])
    assert np.allclose(ramp_speed(line, end=0.0)[:, 3], 0.5 * np.sqrt(1 - line[:, 0]))  # constant deceleration
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


@modest
@given(paths(smallest=3), speeds, st.floats(0, 0.5))
def test_a_trapezoid_rises_from_rest_and_falls_to_rest(rows, cruise, ramp):
    out = trapezoid_speed(rows, cruise, ramp=ramp)
    s = arc_length(out[:, :3])
    speed = out[:, 3]
    assert speed.max() <= cruise
    if s[-1] == 0.0:
        return
    assert speed[0] == 0 and speed[-1] == 0
    assert arc_length(rows[:, :3])[-1] == pytest.approx(s[-1])
    flat = (s >= (ramp + 1e-6) * s[-1]) & (s <= (1 - ramp - 1e-6) * s[-1])
    moving = (np.diff(out[:, :3], axis=0) != 0).any(axis=1)
    assert (speed[1:][flat[1:] & moving] == cruise).all()
    rising = s < (ramp - 1e-6) * s[-1]
    assert np.allclose(speed[rising] ** 2, cruise**2 * s[rising] / max(ramp * s[-1], 1e-12))


def test_a_trapezoid_has_constant_acceleration_in_time(line):
    out = Trajectory.from_array(trapezoid_speed(line, 0.4, ramp=0.5))
    acceleration = np.diff(out.speeds) / out.durations
    assert np.allclose(acceleration[:10], acceleration[0]) and np.allclose(acceleration[10:], -acceleration[0])
    assert np.array_equal(trapezoid_speed(line)[5:16, 3], np.full(11, 0.5))


def test_a_trapezoid_of_two_waypoints_gets_some_in_between(line):
    out = trapezoid_speed(line[[0, 20]])
    assert len(out) == 5 and out[:, 3].max() == 0.5


@modest
@given(paths(smallest=3), speeds, speeds)
def test_an_exponential_has_its_ends_and_constant_ratios(rows, start, end):
    out = exponential_speed(rows, start, end)[:, 3]
    s = arc_length(rows[:, :3])
    if s[-1] == 0.0:
        return
    assert out[0] == start
    assert out[-1] == end or rows[-1, 3] == 0
    assert (out <= max(start, end) + 1e-12).all()
    inner = (s > 0) & (s < s[-1])
    if start > 0 and end > 0.02 * start and start > 0.02 * end and (rows[:, 3] > 0).all():
        assert np.allclose(np.log(out[inner] / start), np.log(end / start) * s[inner] / s[-1])


def test_an_exponential_keeps_an_end_that_is_not_given(line):
    line[0, 3] = 0.0
    out = exponential_speed(line, end=1.0)[:, 3]
    assert out[0] == 0 and out[-1] == 1 and (np.diff(out) > 0).all()
    assert out[10] == pytest.approx(0.1)
    assert (exponential_speed(line, 0.0, 0.0)[:, 3] == 0).all()


@modest
@given(paths(), st.floats(-3, 3), st.floats(-3, 3))
def test_acceleration_follows_the_law_and_more_is_faster(rows, a, b):
    rows[:, 3] += 0.01
    slow, fast = (accelerate(rows, rate)[:, 3] for rate in sorted((a, b)))
    if a and b:
        assert (slow <= fast + 1e-12).all()
        s = arc_length(rows[:, :3])
        assert np.allclose(slow**2, np.maximum(rows[0, 3] ** 2 + 2 * min(a, b) * s, 0))


def test_acceleration_in_a_part_and_from_rest(line):
    mask = np.arange(21) >= 10
    out = accelerate(line, 1.0, where=mask)
    assert np.allclose(out[10:, 3] ** 2, 0.25 + 2 * (line[10:, 0] - 0.5))
    line[0, 3] = 0.0
    assert accelerate(line, 0.5)[-1, 3] == pytest.approx(1.0)
    braked = accelerate(line, -0.125)[:, 3]
    assert braked[0] == 0 and braked[1] == 0.5 and (np.diff(braked[1:]) < 0).all()
    assert accelerate(line, -1.0)[-1, 3] == 0
    line[:, 3] = 0.0
    assert np.array_equal(accelerate(line, -1.0), line)


def corner(n=101):
    """Ahead for 1 m and then to the left for 1 m."""
    t = np.linspace(0.0, 2.0, n)
    return np.column_stack([np.minimum(t, 1.0), np.maximum(t - 1.0, 0.0), 0 * t, np.full(n, 0.5)])


def test_turns_are_slow_smoothly_and_straights_are_not():
    rows = corner()
    out = slow_turns(rows, 0.4)
    assert out[50, 3] == 0.2 and out[:, 3].min() == 0.2
    assert (np.diff(out[:51, 3]) <= 0).all() and (np.diff(out[50:, 3]) >= 0).all()
    assert np.abs(np.diff(out[:, 3])).max() < 0.1
    assert np.array_equal(out[:34], rows[:34]) and np.array_equal(out[63:], rows[63:])
    assert out[42, 3] < out[58, 3]


def test_gentle_bends_are_no_turns(line):
    angle = np.linspace(0, np.pi, 101)
    arc = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle, np.ones(101)])
    assert np.array_equal(slow_turns(arc), arc)
    assert (slow_turns(arc, angle=5)[20:80, 3] == 0.5).all()
    assert np.array_equal(slow_turns(line), line)


@modest
@given(paths(), st.floats(0, 1), st.floats(0, 1), st.floats(0, 180), st.floats(0, 180))
def test_slower_turns_are_slower_and_a_smaller_angle_finds_more(rows, a, b, small, large):
    slow, fast = (slow_turns(rows, factor)[:, 3] for factor in sorted((a, b)))
    assert (slow <= fast + 1e-12).all() and (fast <= rows[:, 3] + 1e-12).all()
    more, fewer = (slow_turns(rows, 0.5, angle=angle)[:, 3] for angle in sorted((small, large)))
    turning = fewer <= 0.5 * rows[:, 3] + 1e-12  # more turns leave less room before and after each
    assert (more <= fewer + 1e-12)[turning].all()


def test_a_law_leaves_a_dwell_at_rest(line):
    rows = dwell(line, 10, 6)
    for out in (trapezoid_speed(rows), exponential_speed(rows, 0.2, 0.6), accelerate(rows, 1.0), slow_turns(rows)):
        assert (out[10:17, 3] == 0).all() and out[9, 3] > 0
        assert Trajectory.from_array(out).durations[10:16].sum() == pytest.approx(0.6)


@modest
@given(paths_and_masks(), st.floats(0.1, 100))
def test_a_part_takes_so_many_seconds(drawn, seconds):
    rows, mask = drawn
    if travel_time(rows, mask) > 1e-6:
        assert travel_time(set_duration(rows, seconds, where=mask), mask) == pytest.approx(seconds)


def test_what_has_no_length_takes_no_time():
    rows = np.array([[0, 0, 0, 1.0], [1, 0, 0, 1.0]])
    with pytest.raises(ValueError, match="no length"):
        set_duration(rows, 2.0, where=[True, False])
    with pytest.raises(ValueError, match="seconds"):
        set_duration(rows, 0.0)


def test_no_stop_is_left_between_the_ends_and_the_path_stays(line):
    waiting = dwell(stop_at(line, 0.5, resume=True), 0.5, 7)
    moving = keep_moving(waiting)
    assert np.array_equal(moving[:, :3], line[:, :3]) and np.allclose(moving[:, 3], line[:, 3])
    assert np.array_equal(keep_moving(line), line)


def test_only_stops_on_the_part_go(line):
    both = stop_at(stop_at(line, 0.3, brake=0.05, resume=True), 0.7, brake=0.05, resume=True)
    left = keep_moving(both, where=np.arange(len(line)) < len(line) // 2)
    assert (left[:, 3] == 0.0).sum() == 1 and np.flatnonzero(left[:, 3] == 0.0)[0] > len(line) // 2


@given(paths())
def test_without_stops_the_ends_and_the_places_stay(traj):
    moving = keep_moving(traj)
    assert np.array_equal(moving[[0, -1], :3], traj[[0, -1], :3])
    assert {*map(tuple, moving[:, :3])} == {*map(tuple, traj[:, :3])}
    assert (moving[:, 3] >= 0.0).all() and np.array_equal(keep_moving(moving), moving)


def test_a_wait_in_all_counts_the_steps_that_are_there():
    x = np.linspace(0.0, 1.0, 11)
    rows = dwell(np.column_stack([x, 0 * x, 0 * x, np.full(11, 0.5)]), 0.5, 4)
    for steps in (6, 2):
        out = dwell(rows, 0.5, steps, in_all=True)
        assert (out[:, 0] == 0.5).sum() == steps + 1 and len(out) == 11 + steps
    assert len(dwell(rows, 0.5, 3)) == 18


def test_the_straights_between_the_turns_of_a_long_path_keep_their_speed():
    row = np.linspace(0.0, 20.0, 41)
    lanes = [np.column_stack([row if k % 2 == 0 else row[::-1], np.full(41, 3.0 * k)]) for k in range(4)]
    rows = np.column_stack([np.concatenate(lanes), np.zeros(164), np.full(164, 0.9)])
    slow = slow_turns(rows, 0.5)[:, 3]
    assert slow[41] == 0.45 and (slow[5:21] == 0.9).all() and (slow[55:66] == 0.9).all()
