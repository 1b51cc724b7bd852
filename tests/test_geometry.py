"""Polylines and cuboids: exact distances against dense sampling."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ovita.paths import geometry
from ovita.paths.geometry import Cuboid
from ovita.paths.trajectory import Trajectory, interpolate

DENSE = 4001


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_distances_of_a_polyline_are_exact(seed):
    rng = np.random.default_rng(seed)
    path, point = rng.normal(size=(5, 3)), rng.normal(size=3)
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    body = Cuboid(rng.normal(size=3), rotation, rng.uniform(0.05, 0.8, 3))
    dense = interpolate(path, np.linspace(0, 4, DENSE))
    slack = np.linalg.norm(np.diff(path, axis=0), axis=1).max() * 4 / (DENSE - 1)
    cases = [
        (geometry.closest_to_point(path, point), lambda p: geometry.lengths(p - point)),
        (body.closest(path), lambda p: body.signed(p)[0]),
    ]
    for (found, where), exact in cases:
        assert exact(dense).min() - slack <= found <= exact(dense).min() + 1e-12
        assert exact(interpolate(path, np.array([where]))) == pytest.approx(found, abs=1e-9)


def test_near_means_the_path_between_waypoints_too():
    path = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    assert geometry.within(path, np.array([0.4, 0.05, 0]), 0.1).tolist() == [True, False, False]
    assert geometry.within(path, np.array([1.6, 0.05, 0]), 0.1).tolist() == [False, False, True]
    assert geometry.within(path, np.array([1.0, 0.05, 0]), 0.1).tolist() == [False, True, False]
    assert not geometry.within(path, np.array([0.4, 0.2, 0]), 0.1).any()


def test_turning_angles_pass_over_repeated_waypoints():
    path = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 0], [1, 1, 0], [1, 0, 0]])
    assert np.degrees(geometry.turning_angles(path)) == pytest.approx([0, 90, 0, 180, 0])


def test_projection_finds_distance_and_place():
    path = np.array([[0.0, 0, 0], [1, 0, 0], [1, 2, 0]])
    distance, place = geometry.project(path, np.array([[0.25, 1, 0], [2, 1, 0], [-1, 0, 0]]))
    assert distance == pytest.approx([0.75, 1, 1]) and place == pytest.approx([1.5, 1.5, 0])


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_time_law_and_its_inverse_agree(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 9))
    speeds = np.where(rng.random(n) < 0.3, 0.0, rng.uniform(0.01, 2, n))
    path = Trajectory(rng.normal(size=(n, 3)), speeds)
    moments = np.linspace(0, path.duration, 57)
    state = path.at(moments)
    assert path.time_at(state.where) == pytest.approx(moments, abs=1e-6)
    assert path.at(path.times).where == pytest.approx(np.arange(n), abs=1e-5)
    steps = np.linalg.norm(np.diff(path.at(np.linspace(0, path.duration, 2001)).positions, axis=0), axis=1)
    assert steps.sum() <= path.length * (1 + 1e-9)


def test_before_the_start_and_after_the_goal_it_rests_and_a_dwell_stays():
    path = Trajectory([[0, 0, 0], [1, 0, 0], [1, 0, 0], [2, 0, 0]], [1, 1, 0, 1], timestep=0.5)
    state = path.at([-1.0, 0.5, 1.25, 100.0])
    assert state.positions[:, 0] == pytest.approx([0, 0.5, 1, 2]) and state.where[-1] == 3.0
    assert path.dwells.tolist() == [False, False, True, False]
