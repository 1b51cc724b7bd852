"""No result called done breaks a limit by an independent measure; none is called infeasible that a sampler finds."""

import numpy as np
import pytest
import trust_scenes

from ovita.limits.obstacles import from_object
from ovita.paths.robot import Robot
from ovita.paths.scene import SceneObject


@pytest.mark.parametrize("block", range(4))
def test_results_hold_what_they_say(block):
    found = [trust_scenes.judge(seed) for seed in range(10 * block, 10 * block + 10)]
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
    assert trust_scenes.wanted(item, robot) == pytest.approx(from_object(item, robot, "box").keep)
