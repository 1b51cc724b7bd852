import numpy as np
import pytest

from ovita.io.waypoints import speeds_from_times
from ovita.paths.trajectory import Trajectory


def minimum_jerk(n):
    u = np.linspace(0, 1, n)
    s = 10 * u**3 - 15 * u**4 + 6 * u**5
    return np.column_stack([s, 0 * s, np.sin(s)]), 3.0 * u


def rebuilt(positions, times):
    speeds, timestep, remarks = speeds_from_times(positions, times)
    assert (speeds >= 0).all()
    return Trajectory(positions, speeds, None, timestep), remarks


@pytest.mark.parametrize("n", [2, 3, 20, 100, 2000])
def test_smooth_motion_keeps_its_times(n):
    positions, times = minimum_jerk(n)
    trajectory, _ = rebuilt(positions, times)
    assert trajectory.duration == pytest.approx(3.0, rel=1e-6)
    if n >= 20:
        np.testing.assert_allclose(trajectory.times, times, atol=0.01 * 3.0)


@pytest.mark.parametrize(("n", "tolerance"), [(20, 2e-3), (100, 1e-4), (1000, 1e-6)])
def test_the_own_time_law_is_inverted(n, tolerance):
    u = np.linspace(0, 1, n)
    positions = np.column_stack([np.cos(4 * u), np.sin(4 * u), u])
    speeds = 0.3 + 0.2 * np.sin(6 * u)
    found, timestep, remarks = speeds_from_times(positions, Trajectory(positions, speeds).times + 7.0)
    np.testing.assert_allclose(found, speeds, atol=tolerance)
    assert (timestep, remarks) == (0.1, ())


def test_noise_does_not_become_oscillation():
    rng = np.random.default_rng(0)
    u = np.linspace(0, 1, 200)
    positions = np.column_stack([u, 0 * u, 0 * u]) + rng.normal(0, 3e-4, (200, 3))
    speeds, _, _ = speeds_from_times(positions, 5 * u)
    mean = np.linalg.norm(np.diff(positions, axis=0), axis=1) / np.diff(5 * u)
    assert np.abs(speeds - 0.2).max() < 2 * np.abs(mean - 0.2).max()


def test_a_stop_in_the_middle():
    there, _ = minimum_jerk(50)
    positions = np.concatenate([there, np.repeat(there[-1:], 10, axis=0), there[::-1]])
    trajectory, remarks = rebuilt(positions, np.arange(len(positions)) * 0.05)
    assert (trajectory.speeds[50:61] == 0).all()
    assert trajectory.timestep == pytest.approx(0.05)
    assert trajectory.duration == pytest.approx(0.05 * (len(positions) - 1), rel=1e-6)
    assert remarks == ()


def test_a_robot_that_never_moves():
    trajectory, remarks = rebuilt(np.zeros((4, 3)), np.array([0.0, 0.2, 0.4, 0.6]))
    assert (trajectory.speeds == 0).all()
    assert trajectory.duration == pytest.approx(0.6)
    assert remarks == ()


def test_uneven_dwells_share_their_mean():
    positions = np.array([[0, 0, 0], [0, 0, 0], [1, 0, 0], [1, 0, 0], [2.0, 0, 0]])
    trajectory, remarks = rebuilt(positions, np.array([0, 0.1, 1.0, 1.3, 2.0]))
    assert trajectory.duration == pytest.approx(2.0)
    assert "the dwells differ in length" in remarks[0]


def test_times_that_no_smooth_speed_meets_are_remarked():
    positions = np.array([[0, 0, 0], [1, 0, 0], [1.1, 0, 0], [2, 0, 0], [2.1, 0, 0]])
    trajectory, remarks = rebuilt(positions, np.arange(5.0))
    assert trajectory.duration == pytest.approx(4.0)
    assert "too uneven" in remarks[0]
