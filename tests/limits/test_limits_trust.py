"""No result called done breaks a limit by an independent measure; none is called infeasible that a sampler finds."""

from dataclasses import replace

import numpy as np
import pytest
import trust_scenes

from ovita import Adaptation
from ovita.limits import ConstraintOptions
from ovita.limits.problem import from_object
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory


@pytest.mark.parametrize("block", range(3))
def test_results_hold_what_they_say(block):
    found = [trust_scenes.judge(seed) for seed in range(15 * block, 15 * block + 15)]
    assert not [text for _, wrong in found for text in wrong]
    assert any(status in ("done", "limited") for status, _ in found)


def test_the_judge_can_fail():
    item = SceneObject("person", [0, 0.2, 0], [0.1, 0.1, 0.1])
    through = np.array([[-1.0, 0, 0], [1, 0, 0]])
    assert trust_scenes.wanted(item, Robot("r", radius=0.1)) - trust_scenes.gaps(through, item).min() > 0.2
    assert trust_scenes.gaps(through, item)[0] == pytest.approx(0.15, abs=1e-3)


@pytest.mark.parametrize("name", ["person", "dog", "cup"])
@pytest.mark.parametrize("size", [None, [0.1, 0.2, 0.3]])
def test_the_judge_and_the_solver_keep_the_same_distance(name, size):
    robot = Robot("r", radius=0.1)
    item = SceneObject(name, [0, 0, 0], size)
    far = Trajectory([[5.0, 5.0, 5.0], [6.0, 5.0, 5.0]], [0.1, 0.1])
    (measured,) = trust_scenes.sized(Scene((item,)), robot, far)
    assert trust_scenes.wanted(measured, robot) == pytest.approx(from_object(item, robot, "box").keep)


def infeasible(gap, *, planar=False, pinned=2):
    """A result called infeasible before a wall with a doorway, with the waypoints that it was about."""
    x = np.column_stack([np.linspace(-1, 1, 20), np.zeros(20), np.zeros(20)])
    plates = [
        SceneObject(name, [0, side * (2 + gap / 2) + 0.9, 0], [0.05, 4, 9] if pinned else [9, 9, 9])
        for name, side in (("left plate", 1), ("right plate", -1))
    ]
    robot = Robot("r", Box((-2, -2, -2), (2, 2, 2)), radius=0.2, planar=planar)
    path = Trajectory(x, np.zeros(20))
    ends = ConstraintOptions(fix_start=pinned > 0, fix_goal=pinned > 1)
    return Adaptation("", "infeasible", path, path, path, Scene(tuple(plates)), robot), ends


@pytest.mark.parametrize("planar", [False, True])
@pytest.mark.parametrize(("gap", "pinned", "way"), [(0.6, 2, True), (0.3, 2, False), (0.3, 1, True), (0.3, 0, False)])
def test_the_sampler_finds_a_doorway_that_a_body_fits_through_and_no_other(gap, pinned, way, planar):
    assert trust_scenes.sampled(*infeasible(gap, planar=planar, pinned=pinned)) is way


def test_the_sampler_needs_as_many_waypoints_as_its_way_has_corners():
    result, ends = infeasible(0.6)
    few = Trajectory(result.proposed.positions[[0, -1]], np.zeros(2))
    assert not trust_scenes.sampled(replace(result, proposed=few), ends)
