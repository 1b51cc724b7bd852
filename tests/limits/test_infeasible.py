"""What cannot be is said, with its cause, and everything else is still obeyed."""

import numpy as np
import pytest
from constraint_scenes import segment_distances

from ovita.errors import ConstraintDefinitionError
from ovita.limits import ConstraintOptions, constrain
from ovita.limits.problem import obstacles_of
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory

OPEN = Robot("open", None, max_speed=1.0)
ENDS = ConstraintOptions(fix_start=True, fix_goal=True)


def line(n=41, a=-0.5, b=0.5, speed=0.5):
    return Trajectory(np.column_stack([np.linspace(a, b, n), np.zeros((n, 2))]), np.full(n, speed))


def solve(t, scene, robot=OPEN, options=ENDS):
    return constrain(t, scene, robot, original=line(n=4, b=0.3), options=options)


def text(solution):
    assert solution.verdict.status == "infeasible"
    return " ".join(solution.verdict.conflicts)


def test_a_fixed_start_inside_an_object():
    table = SceneObject("table", [-0.5, 0, 0], [0.4, 0.4, 0.4])
    scene = Scene((table, SceneObject("cup", [0.1, 0.01, 0], [0.1, 0.1, 0.1])))
    t = line(speed=3.0)
    found = solve(t, scene)
    assert "The fixed start lies 0.210 m inside 'table'" in text(found)
    assert "to be touched" in text(found)
    assert "cup" not in text(found)
    x = found.trajectory.positions
    assert np.array_equal(x[0], t.positions[0])
    for body in obstacles_of(scene, OPEN):
        assert segment_distances(body, x[1:]).min() > -1e-6, "only the way out of the table may break a limit"
    assert (found.trajectory.speeds <= 1.0).all()
    free = solve(t, scene, options=ConstraintOptions(fix_goal=True))
    assert free.verdict.status == "repaired"


def test_a_pin_outside_the_workspace():
    robot = Robot("r", Box((-0.3, -1, -1), (1, 1, 1)))
    assert "The fixed start lies 0.210 m outside the workspace" in text(solve(line(), Scene(), robot))


def test_neighbouring_pins_with_an_object_between():
    plate = Scene((SceneObject("plate", [0, 0, 0], [0.01, 1, 1]),))
    found = solve(line(n=2), plate)
    assert "straight line between the fixed start and the fixed goal" in text(found)
    assert "'plate'" in text(found)


def test_too_few_waypoints_to_go_around():
    found = solve(line(n=3), Scene((SceneObject("crate", [0, 0, 0], [0.6, 0.6, 0.6]),)))
    assert "too few" in text(found)
    assert "'crate'" in text(found)
    assert "resample" in text(found)
    assert solve(line(n=8), Scene((SceneObject("crate", [0, 0, 0], [0.6, 0.6, 0.6]),))).verdict.status == "repaired"


def test_a_wall_across_the_workspace_names_only_the_wall():
    robot = Robot("r", Box((-1, -1, -1), (1, 1, 1)))
    scene = Scene((SceneObject("cup", [0.3, 0.3, 0], [0.1, 0.1, 0.1]), SceneObject("wall", [0, 0, 0], [0.1, 3, 3])))
    found = solve(line(), scene, robot)
    assert "No way was found" in text(found)
    assert "'wall'" in text(found)
    assert "'cup'" not in text(found)
    one_side = solve(line(), scene, robot, ConstraintOptions(fix_start=True))
    assert one_side.verdict.status == "repaired", "with a free goal the path can stay on its side"
    assert one_side.trajectory.positions[:, 0].max() < 0


def test_two_walls_that_only_block_together():
    robot = Robot("r", Box((-1, -1, -1), (1, 1, 1)))
    half = [SceneObject("left", [0, -0.6, 0], [0.1, 1.3, 3]), SceneObject("right", [0, 0.6, 0], [0.1, 1.3, 3])]
    said = text(solve(line(), Scene(tuple(half)), robot))
    assert "'left'" in said
    assert "'right'" in said


def test_an_object_that_fills_the_workspace():
    robot = Robot("r", Box((-1, -1, -1), (1, 1, 1)))
    found = solve(line(), Scene((SceneObject("foam", [0, 0, 0], [9, 9, 9]),)), robot, ConstraintOptions())
    assert found.verdict.status == "infeasible"
    assert "'foam'" in text(found)


def test_margins_that_eat_the_workspace():
    robot = Robot("r", Box((-1, -1, -0.01), (1, 1, 0.01)), margin=0.05)
    found = solve(line(), Scene(), robot, ConstraintOptions())
    assert "0.02 m wide along z" in text(found)
    assert (np.abs(found.trajectory.positions[:, 2]) <= 0.01).all()


@pytest.mark.parametrize(
    "bad",
    [
        {"lambda_dev": 0.0},
        {"lambda_smooth": -1.0},
        {"lambda_smooth": float("nan")},
        {"lambda_shape": "much"},
        {"max_acceleration": 0.0},
        {"max_lateral_acceleration": -2.0},
        {"steps": 0},
        {"method": "magic"},
        {"obstacle_shape": "cone"},
    ],
)
def test_senseless_options_are_refused(bad):
    with pytest.raises(ConstraintDefinitionError, match=next(iter(bad))):
        ConstraintOptions(**bad)
