import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ovita.io.waypoints import chained_speeds, speeds_from_times, timed
from ovita.paths.trajectory import Trajectory


def inverted(trajectory):
    speeds, timestep, _ = speeds_from_times(trajectory.positions, trajectory.times)
    return Trajectory(trajectory.positions, speeds, None, timestep)


def along(speeds, steps=0.1):
    x = np.concatenate([[0.0], np.cumsum(np.broadcast_to(steps, len(speeds) - 1))])
    return Trajectory(np.column_stack([x, 0 * x, 0 * x]), speeds)


@pytest.mark.parametrize(
    "speeds",
    [
        [0.3] * 30,
        np.linspace(0.1, 0.9, 30),
        [0.3] * 10 + [0.1] * 10 + [0.3] * 10,
        [0.0, *np.linspace(0.05, 0.5, 10), *[0.5] * 10, *np.linspace(0.5, 0.05, 10), 0.0],
        [0.3, 0.3, 0.3, 0.0, 0.3, 0.3, 0.3, 0.3],
    ],
)
def test_speeds_that_are_linear_in_pieces_come_back_exactly(speeds):
    path = along(speeds, np.random.default_rng(0).uniform(0.01, 0.2, len(speeds) - 1))
    np.testing.assert_allclose(inverted(path).speeds, path.speeds, atol=1e-12)


@given(st.integers(4, 60), st.integers(0, 10_000))
@settings(derandomize=True, deadline=None, max_examples=60)
def test_times_of_smooth_speeds_come_back_exactly_and_speeds_closely(n, seed):
    rng = np.random.default_rng(seed)
    u = np.linspace(0, 1, n)
    speeds = 0.4 + 0.3 * np.sin(rng.uniform(0, 6) * u + rng.uniform(0, 6))
    path = along(speeds, rng.uniform(0.05, 0.2, n - 1))
    found = inverted(path)
    np.testing.assert_allclose(found.times, path.times, rtol=1e-9, atol=1e-9)
    assert np.abs(found.speeds - path.speeds).max() < 8.0 / n**2


def test_dwells_and_what_follows_them_are_exact():
    positions = np.repeat(np.column_stack([np.arange(6.0), np.zeros((6, 2))]), [1, 1, 5, 1, 1, 1], axis=0)
    speeds = np.array([0.5, 0.4, 0.2, 0, 0, 0, 0, 0.3, 0.5, 0.4])
    path = Trajectory(positions, speeds, None, 0.25)
    found = inverted(path)
    np.testing.assert_allclose(found.speeds[3:], speeds[3:], atol=1e-12)
    np.testing.assert_allclose(found.times, path.times, atol=1e-9)
    assert found.timestep == pytest.approx(0.25)


def test_noise_and_impossible_times_are_left_to_the_fit():
    assert chained_speeds(np.array([1, 0.1, 0.9, 0.1]), np.ones(4)) is None
    rng = np.random.default_rng(1)
    kept = 0
    for n in (10, 20, 50) * 10:
        times = np.concatenate([[0.0], np.cumsum(0.05 * (1 + 0.03 * rng.normal(size=n)))])
        positions = np.column_stack([np.linspace(0, n / 100, n + 1), np.zeros((n + 1, 2))])
        speeds, _, _ = speeds_from_times(positions, times)
        kept += np.abs(speeds - 0.2).max() > 0.03
    assert kept <= 3


def test_a_waypoint_that_takes_no_time_is_left_out():
    path = Trajectory([[0, 0, 0], [1, 0, 0], [1, 0, 0], [2, 0, 0]], [1, 1, 1, 1])
    kept, times, notes = timed(path)
    assert len(kept) == 3 and (np.diff(times) > 0).all()
    assert notes == ("left out 1 of 4 waypoints, which repeat the one before and take no time",)
    assert timed(kept)[2] == ()
