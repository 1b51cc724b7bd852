"""Where robots stand, and scenes whose z points down."""

import numpy as np
import pytest

from ovita import sim
from ovita.errors import RequestError
from ovita.paths.robot import Robot, Shell
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.sim.placement import arm_base, floor_under

LINE = np.linspace([0.4, -0.3, 0.5], [0.4, 0.3, 0.5], 20)


@pytest.mark.parametrize("text", ["", "1,2", "1,2,3,4,5", "a,b,c", "1;2;3"])
def test_a_base_that_is_no_base_says_what_one_looks_like(text):
    with pytest.raises(RequestError, match=r"is not x,y,z,yaw; give metres and radians, such as --base 0.5,0,0,1.57"):
        sim.Base.parse(text)


def test_a_base_is_read_and_must_be_finite():
    assert sim.Base.parse("1, 2,3") == sim.Base(1, 2, 3) and sim.Base.parse("1,2,3,-0.5").yaw == -0.5
    with pytest.raises(RequestError, match="is not finite"):
        sim.Base.parse("1,2,nan,0")


def test_ned_scenes_are_turned_and_not_mirrored():
    world = sim.WorldTransform(Frame("ned"))
    turn = np.array([np.cos(0.3), 0.0, 0.0, np.sin(0.3)])
    item = SceneObject("crate", np.array([1.0, 2.0, -3.0]), np.array([0.1, 0.2, 0.3]), turn)
    (moved,) = world.scene(Scene((item,), Frame("ned")))
    assert moved.position.tolist() == [1.0, -2.0, 3.0]
    assert np.allclose(moved.rotation, np.diag([1, -1, -1]) @ item.rotation)
    assert np.linalg.det(moved.rotation) == pytest.approx(1.0)
    assert np.allclose(np.abs(world.turned(world.turned(turn)) @ turn), 1.0)
    assert world.base(sim.Base(1, 2, -3, 0.4)) == sim.Base(1, -2, 3, -0.4)
    assert world.base(world.base(sim.Base(1, 2, -3, 0.4))) == sim.Base(1, 2, -3, 0.4)


@pytest.mark.parametrize("frame", ["rfu", "flu"])
def test_other_frames_are_taken_over(frame):
    assert sim.WorldTransform(Frame(frame)).signs.tolist() == [1, 1, 1]


def test_an_arm_is_placed_where_it_reaches_everything_and_stands_clear():
    box = SceneObject("box", np.array([0.0, 0.0, 0.5]), np.array([0.3, 0.3, 1.0]))
    chosen = arm_base([LINE], Scene((box,)), None, 0.36, 0.946)
    distance = np.linalg.norm(LINE - chosen.position - [0, 0, 0.36], axis=1)
    assert distance.max() < 0.946 and box.clearance(chosen.position[None])[0] > 0.15
    assert chosen == arm_base([LINE], Scene((box,)), None, 0.36, 0.946)
    assert chosen == arm_base([LINE, LINE[::-1]], Scene((box,)), None, 0.36, 0.946)


def test_an_arm_is_placed_in_the_middle_of_the_workspace_that_the_limits_state():
    robot = Robot("arm", Shell((-0.2, 0.1, 0.2), 0.1, 1.0))
    assert arm_base([LINE], Scene(), robot, 0.36, 0.946).position == pytest.approx([-0.2, 0.1, 0.2])


def test_robots_that_move_about_are_not_placed():
    path = Trajectory(LINE, np.full(20, 0.2))
    assert sim.place([path], Scene(), "jackal") is None and sim.place([path], Scene(), "crazyflie") is None
    assert sim.place([path], Scene(), "iiwa") is not None


@pytest.mark.parametrize("base", [None, sim.Base(-0.1, 0.0, 0.7)])
def test_no_floor_is_made_up_where_the_path_of_an_arm_goes(base):
    path = Trajectory(LINE[::19] * [1.0, 0.3, 1.0], np.full(2, 0.4))
    report = sim.simulate(path, Scene(), "iiwa", base=base).report
    assert report.status == "followed" and not report.contacts


def test_the_floor_is_what_the_objects_stand_on():
    crate = SceneObject("crate", np.array([0.9, 0.0, 0.2]), np.array([0.2, 0.2, 0.4]))
    assert floor_under(0.1, Scene((crate,))) == pytest.approx(0.0)
    assert floor_under(-0.1, Scene((crate,))) == pytest.approx(-0.3)
    assert floor_under(0.5, Scene()) == pytest.approx(0.3)


def test_where_a_drone_starts_is_told_in_the_coordinates_of_the_scene():
    path = Trajectory([[0.5, -0.3, -0.2], [0.5, 0.3, -0.2]], [0.2, 0.2])
    with pytest.raises(RequestError, match=r"give --base 0\.500,-0\.300,z,yaw"):
        sim.simulate(path, Scene(frame=Frame("ned")), "crazyflie", base=sim.Base())
