"""Trajectories: validation, time law, resampling."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from ovita.errors import TrajectoryError
from ovita.paths.trajectory import Trajectory, interpolate

finite = st.floats(-100, 100, allow_nan=False, width=32)


@st.composite
def trajectories(draw):
    n = draw(st.integers(2, 30))
    positions = draw(arrays(float, (n, 3), elements=finite))
    speeds = draw(arrays(float, n, elements=st.floats(0, 50, width=32)))
    return Trajectory(positions, speeds)


def line(speeds, step=1.0):
    n = len(speeds)
    return Trajectory(np.column_stack([np.arange(n) * step, np.zeros(n), np.zeros(n)]), np.array(speeds, float))


def test_arrays_are_copied_and_read_only():
    rows = np.zeros((3, 4))
    trajectory = Trajectory.from_array(rows)
    rows[0, 0] = 5
    assert trajectory.positions[0, 0] == 0
    with pytest.raises(ValueError, match="read-only"):
        trajectory.positions[0, 0] = 1
    with pytest.raises(AttributeError):
        trajectory.timestep = 2


@pytest.mark.parametrize(
    ("positions", "speeds", "said"),
    [
        (np.zeros((1, 3)), [0], "at least 2 waypoints"),
        (np.zeros((3, 2)), [0, 0, 0], r"expected \(N, 3\)"),
        (np.zeros((3, 3)), [0, 0], "one speed per waypoint"),
        (np.zeros((3, 3)), [0, -1, 0], "waypoint 1: speed -1 is negative"),
        ([[0, 0, 0], [0, np.nan, 0]], [0, 0], "waypoint 1: positions .* not finite"),
        ([[0, 0, 0], [0, 0]], [0, 0], "not numbers of one shape"),
        (np.zeros((2, 3)), [0, np.inf], "waypoint 1: speeds"),
    ],
)
def test_malformed_trajectories_are_refused_with_the_waypoint(positions, speeds, said):
    with pytest.raises(TrajectoryError, match=said):
        Trajectory(positions, speeds)


def test_time_law_of_constant_acceleration():
    trajectory = line([0.0, 2.0, 2.0, 0.0])
    assert trajectory.durations == pytest.approx([1.0, 0.5, 1.0])
    assert trajectory.times == pytest.approx([0.0, 1.0, 1.5, 2.5])


def test_dwell_lasts_one_timestep_per_repeat():
    rows = [[0, 0, 0, 1], [1, 0, 0, 0], [1, 0, 0, 0], [1, 0, 0, 0], [2, 0, 0, 1]]
    trajectory = Trajectory.from_array(rows, timestep=0.5)
    assert trajectory.durations == pytest.approx([2.0, 0.5, 0.5, 2.0])


def test_zero_speed_never_divides_by_zero():
    trajectory = line([0.0, 0.0, 0.0])
    assert np.isfinite(trajectory.duration) and trajectory.duration > 0
    assert Trajectory(np.zeros((3, 3)), np.ones(3)).duration == 0.0


@given(trajectories())
def test_times_are_finite_and_never_run_back(trajectory):
    assert np.isfinite(trajectory.times).all() and (np.diff(trajectory.times) >= 0).all()


@given(trajectories(), st.integers(2, 60), st.sampled_from(["arc_length", "index"]))
def test_resampling_keeps_the_ends_and_stays_on_the_path(trajectory, n, by):
    resampled = trajectory.resample(n, by=by)
    assert len(resampled) == n
    assert np.array_equal(resampled.positions[[0, -1]], trajectory.positions[[0, -1]])
    assert resampled.length <= trajectory.length * (1 + 1e-9) + 1e-9
    assert resampled.speeds.min() >= trajectory.speeds.min() - 1e-9
    assert resampled.speeds.max() <= trajectory.speeds.max() + 1e-9


@given(trajectories())
def test_resampling_by_index_to_the_same_count_changes_nothing(trajectory):
    assert trajectory.resample(len(trajectory), by="index") == trajectory


def test_resampling_by_arc_length_is_even():
    trajectory = Trajectory.from_array([[0, 0, 0, 1], [0.1, 0, 0, 1], [1, 0, 0, 1]])
    assert np.diff(trajectory.resample(11).arc_length) == pytest.approx(0.1)


def test_orientations_are_normalised_travel_along_and_are_checked():
    trajectory = Trajectory(np.eye(3)[:2], [1, 1], [[2, 0, 0, 0], [0, 0, 0, 1]])
    assert trajectory.orientations[0] == pytest.approx([1, 0, 0, 0])
    middle = trajectory.resample(3).orientations[1]
    assert middle == pytest.approx([2**-0.5, 0, 0, 2**-0.5])
    with pytest.raises(TrajectoryError, match="waypoint 1: the quaternion"):
        Trajectory(np.zeros((2, 3)), [0, 0], [[1, 0, 0, 0], [0, 0, 0, 0]])
    with pytest.raises(TrajectoryError, match="2 positions but 3 orientations"):
        Trajectory(np.zeros((2, 3)), [0, 0], np.ones((3, 4)))


@given(trajectories())
def test_array_round_trip(trajectory):
    assert Trajectory.from_array(trajectory.to_array()) == trajectory


def test_interpolation_at_whole_indices_is_exact():
    rows = np.array([[0.1, 0.7], [0.3, 1e-300]])
    assert np.array_equal(interpolate(rows, np.array([0.0, 1.0])), rows)


def test_bad_timestep_and_count():
    with pytest.raises(TrajectoryError, match="timestep"):
        Trajectory(np.zeros((2, 3)), [0, 0], timestep=0)
    with pytest.raises(TrajectoryError, match="at least 2"):
        line([1, 1]).resample(1)
