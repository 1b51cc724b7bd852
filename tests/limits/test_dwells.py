"""A dwell stays a dwell: repeated waypoints move as one."""

import numpy as np

from ovita.limits import ConstraintOptions, constrain
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory

REPAIR = ConstraintOptions(repair_original=True)
LINE = np.column_stack([np.linspace(0, 2, 41), np.zeros((41, 2)), np.full(41, 0.3)])


def with_dwell(rows, i, steps=10):
    still = np.repeat(rows[i : i + 1], steps + 1, axis=0)
    still[:, 3] = 0.0
    return Trajectory.from_array(np.vstack([rows[:i], still, rows[i + 1 :]]))


def stands(trajectory):
    return int(((np.diff(trajectory.positions, axis=0) == 0).all(axis=1) & (trajectory.speeds[1:] == 0)).sum())


def test_a_dwell_inside_an_obstacle_is_moved_as_a_whole():
    scene = Scene((SceneObject("post", [1.0, 0.01, 0.0], [0.2, 0.2, 0.2]),))
    proposed = with_dwell(LINE, 20)
    before, robot = Trajectory.from_array(LINE), Robot.preset("none")
    left = constrain(proposed, scene, robot, original=before)  # it only stands where the path had led anyway
    assert left.verdict.status == "preexisting" and left.trajectory == proposed
    solution = constrain(proposed, scene, robot, original=before, options=REPAIR)
    assert solution.verdict.status == "repaired"
    assert stands(proposed) == stands(solution.trajectory) == 10
    assert len(solution.trajectory) == len(proposed)


def test_a_dwell_outside_the_workspace_and_a_pinned_one():
    robot = Robot("flat", Box((-5, -5, 0.2), (5, 5, 1.0)))
    proposed = with_dwell(LINE, 20)
    before = Trajectory.from_array(LINE)
    solution = constrain(proposed, Scene(), robot, original=before, options=REPAIR)
    assert solution.verdict.status == "repaired" and stands(solution.trajectory) == 10
    pinned = constrain(
        proposed, Scene(), robot, original=before, options=ConstraintOptions(pinned=(25,), repair_original=True)
    )
    assert pinned.verdict.status == "infeasible" and "waypoint" in " ".join(pinned.verdict.conflicts)
    assert np.array_equal(pinned.trajectory.positions[25], proposed.positions[25])


def test_where_no_robot_is_named_a_path_may_go_on_as_deep_into_a_thing():
    """A reach into a bin had been lifted out of it because the path was bent elsewhere."""
    x = np.linspace(0, 4, 81)
    rows = np.column_stack([x, 0 * x, 0.5 - 0.4 * np.exp(-(((x - 1) / 0.2) ** 2)), 0 * x + 0.3])
    scene = Scene((SceneObject("bin", [1.0, 0.0, 0.15], [0.4, 0.4, 0.3]),))
    moved = rows.copy()
    moved[60:70, 1] += 0.1
    before, proposed = Trajectory.from_array(rows), Trajectory.from_array(moved)
    solution = constrain(proposed, scene, Robot.preset("none"), original=before)
    assert np.allclose(solution.trajectory.positions, proposed.positions)
