"""The way a robot goes: rounded corners, dwells, the time law, and timing under limits."""

import numpy as np
import pytest

from ovita.errors import TrajectoryError
from ovita.paths.trajectory import Trajectory, interpolate
from ovita.sim.timing import Hold, Move, joined, route, still, timed

SQUARE = Trajectory(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]), np.full(4, 0.5))


def split(trajectory, corner=0.01, stop=100.0, spacing=0.02):
    return route(trajectory, corner=corner, stop_angle=np.radians(stop), spacing=spacing)


def test_a_corner_is_rounded_by_no_more_than_asked_and_the_rest_stays_on_the_path():
    (move,) = split(SQUARE, corner=0.01)
    asked = interpolate(SQUARE.positions, move.where)
    off = np.linalg.norm(move.points - asked, axis=1)
    assert 0.009 < off.max() <= 0.0100001
    far = np.abs(move.where - np.round(move.where)) > 0.2
    assert off[far].max() < 1e-12
    assert np.allclose(move.points[0], SQUARE.positions[0]) and np.allclose(move.points[-1], SQUARE.positions[-1])


def test_the_rounded_path_bends_without_jumps():
    (move,) = split(SQUARE, corner=0.05, spacing=0.005)
    steps = np.linalg.norm(np.diff(move.tangents, axis=0), axis=1)
    assert steps.max() < 0.2 and (np.diff(move.where) > 0).all() and (np.diff(move.arc) > 0).all()


def test_sharp_corners_and_waypoints_without_speed_are_stops():
    assert len(split(SQUARE, stop=45.0)) == 3
    stopped = SQUARE.with_(speeds=[0.5, 0.5, 0.0, 0.5])
    assert [piece.where[-1] for piece in split(stopped)] == [2.0, 3.0]


def test_repeated_waypoints_at_speed_zero_become_one_hold_of_their_timesteps():
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 0], [1, 0, 0], [2, 0, 0.0]])
    pieces = split(Trajectory(points, np.array([0.5, 0.5, 0.0, 0.0, 0.5])))
    assert [type(piece) for piece in pieces] == [Move, Hold, Move]
    assert pieces[1].where == (1, 3) and pieces[1].duration == pytest.approx(0.2)


def test_a_mission_of_kilometres_keeps_its_corners():
    mission = Trajectory(1000.0 * SQUARE.positions, np.full(4, 2.0))
    (move,) = split(mission)
    assert len(move.arc) < 3000
    plan = joined([timed(move.arc, move.where, move.points, move.speeds, np.full(3, 9.0), np.full(3, 3.0))], 0.05)
    asked = interpolate(mission.positions, plan.where)
    assert np.linalg.norm(plan.coordinates - asked, axis=1).max() < 0.05


def test_a_motion_of_days_is_refused():
    slow = Trajectory(SQUARE.positions, np.full(4, 1e-6))
    (move,) = split(slow)
    with pytest.raises(TrajectoryError, match=r"would take 8.. h, and at most 2 h can be simulated"):
        joined([timed(move.arc, move.where, move.points, move.speeds, np.ones(3), np.ones(3))], 0.01)


def test_the_time_at_a_place_is_that_of_the_time_law():
    trajectory = Trajectory(np.array([[0, 0, 0], [1, 0, 0], [1, 0, 0], [3, 0, 0.0]]), np.array([0.0, 1.0, 0.0, 2.0]))
    times = trajectory.time_at(np.array([0.0, 1.0, 2.0, 3.0]))
    assert np.allclose(times, trajectory.times)
    (quarter,) = trajectory.time_at(np.array([0.25]))
    assert quarter == pytest.approx(1.0)


def test_motion_from_rest_is_as_fast_as_the_law_where_limits_allow_it_and_no_faster():
    arc = np.linspace(0, 2, 201)
    free = timed(arc, arc, arc[:, None], np.full(201, 0.5), np.array([9.0]), np.array([50.0]))
    assert free.duration == pytest.approx(4.0, rel=0.02) and free.speeds.max() <= 0.5 + 1e-9
    ramped = timed(arc, arc, arc[:, None], np.full(201, 0.5), np.array([9.0]), np.array([0.5]))
    assert ramped.duration == pytest.approx(5.0, rel=0.02)
    slow = timed(arc, arc, arc[:, None], np.full(201, 0.5), np.array([0.25]), np.array([50.0]))
    assert slow.duration == pytest.approx(8.0, rel=0.02)


def test_where_no_fastest_motion_is_found_a_slow_one_keeps_the_limits(monkeypatch):
    from toppra import algorithm

    monkeypatch.setattr(algorithm.TOPPRA, "compute_parameterization", lambda self, *ends: None)
    arc = np.linspace(0, 1, 101)
    path = np.column_stack([np.cos(arc), np.sin(arc)])
    piece = timed(arc, arc, path, np.full(101, 0.5), np.full(2, 0.4), np.full(2, 0.3))
    plan = joined([piece], 0.01)
    assert np.abs(plan.rates).max() <= 0.4001 and np.abs(plan.accelerations[1:-1]).max() <= 0.31
    assert np.allclose(plan.coordinates[-1], path[-1]) and 1.0 < piece.duration < 20


def test_pieces_are_joined_at_even_times():
    arc = np.linspace(0, 1, 50)
    move = timed(arc, arc, arc[:, None], np.full(50, 1.0), np.array([9.0]), np.array([5.0]))
    plan = joined([move, still(0.5, (1, 3), np.array([1.0]))], 0.01)
    assert plan.times[-1] == pytest.approx(move.duration + 0.5, abs=0.011)
    assert (np.diff(plan.where) >= -1e-12).all() and plan.where[-1] == 3.0
    standing = plan.times > move.duration
    assert (plan.coordinates[standing] == 1.0).all() and (plan.rates[standing] == 0.0).all()
    assert np.allclose(np.gradient(plan.coordinates[:, 0], 0.01)[5:-5], plan.rates[5:-5, 0], atol=0.06)
