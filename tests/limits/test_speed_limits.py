"""0 <= v <= v_max, acceleration along and across the path: speeds fall where they must, and only there."""

import numpy as np
import pytest

from ovita.limits import ConstraintOptions, constrain
from ovita.limits.solve import limit_speeds
from ovita.limits.verify import Dynamics, curvature
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory


def line(n=101, length=2.0):
    return np.column_stack([np.linspace(0, length, n), np.zeros((n, 2))])


def test_legal_speeds_are_the_same_array():
    speeds = np.full(101, 0.7)
    assert np.array_equal(limit_speeds(speeds, line(), Dynamics(top=1.0, along=1.0)), speeds)


def test_speeds_are_capped_and_never_raised():
    speeds = np.linspace(0, 38, 101)
    assert np.array_equal(limit_speeds(speeds, line(), Dynamics(top=1.0)), np.minimum(speeds, 1.0))


@pytest.mark.parametrize("seed", range(5))
def test_acceleration_is_kept_and_as_fast_as_possible(seed):
    rng = np.random.default_rng(seed)
    speeds = np.abs(rng.normal(size=101))
    x = rng.normal(size=(101, 3)).cumsum(axis=0) * 0.05
    new = limit_speeds(speeds, x, Dynamics(along=0.5))
    ds = np.linalg.norm(np.diff(x, axis=0), axis=1)
    assert (np.abs(np.diff(new**2)) <= 2 * 0.5 * ds + 1e-12).all()
    assert (new <= speeds).all()
    # any higher speed anywhere breaks a limit: each waypoint is at its own cap or as fast as a neighbour allows
    room = np.minimum(np.concatenate([[np.inf], new[:-1] ** 2 + ds]), np.concatenate([new[1:] ** 2 + ds, [np.inf]]))
    assert new == pytest.approx(np.minimum(speeds, np.sqrt(room)), abs=1e-9)


def test_it_brakes_before_a_dwell():
    x = line(11, 1.0)
    x = np.vstack([x[:6], x[5], x[5:]])
    speeds = np.full(len(x), 1.0)
    speeds[5:8] = 0.0
    new = limit_speeds(speeds, x, Dynamics(along=1.0))
    assert new[5] == 0
    assert new[4] == pytest.approx(np.sqrt(2 * 1.0 * 0.1))


def test_curvature_of_a_circle():
    t = np.linspace(0, 2, 50)
    circle = 0.5 * np.column_stack([np.cos(t), np.sin(t), 0 * t])
    assert curvature(circle)[1:-1] == pytest.approx(2.0)
    assert curvature(circle)[[0, -1]] == pytest.approx(0.0)
    repeated = np.repeat(circle, 2, axis=0)
    assert curvature(repeated)[2:-2] == pytest.approx(2.0)
    assert np.isinf(curvature(np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 0]]))[1])


def test_limits_end_to_end():
    t = np.linspace(0, 6, 80)
    path = np.column_stack([np.cos(t), np.sin(t), 0 * t]) * 0.3
    proposed = Trajectory(path, np.full(80, 1.5))
    options = ConstraintOptions(max_acceleration=0.4, max_lateral_acceleration=1.2)
    found = constrain(proposed, Scene(), Robot("r", None), original=proposed, options=options)
    assert found.verdict.status == "repaired"
    assert np.array_equal(found.trajectory.positions, path)
    assert found.trajectory.speeds[40] == pytest.approx(np.sqrt(1.2 * 0.3), rel=1e-3)
    assert {c.name for c in found.verdict.checks} == {"speed", "acceleration", "lateral acceleration"}
    assert any("m/s" in s for s in found.verdict.sentences())
