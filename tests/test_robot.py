"""Robots: presets and validation."""

import numpy as np
import pytest

from ovita.errors import RobotError
from ovita.paths.robot import Box, Robot, Shell


def test_presets_have_the_figures_of_the_release():
    drone, arm, ground, none = (Robot.preset(n) for n in ("drone", "arm", "ground", "none"))
    assert drone.workspace == Box((-3, -3, -1), (3, 3, 3))
    assert arm.workspace == Shell((-0.5, 0, 0.6), 0.15, 1.2)
    assert ground.workspace == Box((-3, -3, -0.01), (3, 3, 0.01))
    assert none.workspace is None and none.max_speed is None
    for robot in (drone, arm, ground):
        assert (robot.margin, robot.obstacle_margin, robot.max_speed) == (0.01, 0.01, 1.0)


def test_distance_inside_a_workspace():
    box = Box((0, 0, 0), (1, 1, 1))
    assert box.inside(np.array([[0.5, 0.5, 0.5], [1.2, 0.5, 0.5]])) == pytest.approx([0.5, -0.2])
    shell = Shell((0, 0, 0), 0.5, 1.0)
    assert shell.inside(np.array([[0.75, 0, 0], [0.4, 0, 0], [0, 0, 2]])) == pytest.approx([0.25, -0.1, -1.0])


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Robot.preset("submarine"), "unknown robot 'submarine'; presets are drone, arm, ground, none"),
        (lambda: Box((0, 0, 0), (-1, 1, 1)), "exceeds upper"),
        (lambda: Box((0, 0), (1, 1, 1)), "3 numbers"),
        (lambda: Shell((0, 0, 0), 1, 0.5), "r_min < r_max"),
        (lambda: Robot(max_speed=0), "max_speed"),
        (lambda: Robot(margin=-1), "margin"),
        (lambda: Robot(workspace=Shell((0, 0, 0), 0.1, 0.2), margin=0.1), "leaves nothing"),
    ],
)
def test_nonsense_is_refused(make, said):
    with pytest.raises(RobotError, match=said):
        make()


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"radius": -0.1}, "radius -0.1 is not a length"),
        ({"radius": "0.1"}, "radius '0.1' is not a length"),
        ({"person_margin": float("nan")}, "person_margin nan is not a length"),
        ({"max_acceleration": 0}, "max_acceleration 0 is not an acceleration"),
        ({"max_lateral_acceleration": True}, "max_lateral_acceleration True is not an acceleration"),
        ({"min_speed": -1}, "min_speed -1 is not a speed"),
        ({"min_speed": 0.5, "max_speed": 0.4}, "min_speed 0.5 m/s exceeds max_speed 0.4 m/s"),
        ({"planar": 1}, "planar 1 is neither true nor false"),
    ],
)
def test_a_body_and_its_dynamics_are_checked(values, said):
    with pytest.raises(RobotError, match=said):
        Robot(**values)


def test_presets_have_a_body_and_limits_on_acceleration():
    for name in ("drone", "arm", "ground"):
        robot = Robot.preset(name)
        assert robot.radius > 0 and robot.max_acceleration and robot.max_lateral_acceleration
    assert Robot.preset("ground").planar and not Robot.preset("drone").planar
    none = Robot.preset("none")
    assert none.radius == 0 and none.max_acceleration is None and none.max_lateral_acceleration is None


@pytest.mark.parametrize(
    ("alias", "name"), [("crazyflie", "drone"), ("iiwa", "arm"), ("Jackal", "ground"), ("rover", "ground")]
)
def test_a_robot_has_one_set_of_names_for_limits_and_simulation(alias, name):
    from ovita.sim.models import load_model

    assert Robot.preset(alias) is Robot.preset(name)
    assert load_model(alias).name == load_model(name).name
