"""Waits beside things, ways back, and distances: what is read of it, and what is done of it on the path."""

import numpy as np
import pytest

from ovita.chain import adapt
from ovita.instruct import frames as F
from ovita.instruct.degrees import Scale
from ovita.instruct.understanding import understand
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory, arc_length

S = np.linspace(0.0, 1.0, 61)
PATH = Trajectory(
    np.column_stack([4.0 * S - 2.0, 0.3 * np.sin(3.0 * S), 0.6 + 0.1 * np.sin(6.0 * S)]), np.full(61, 0.4)
)
THINGS = Scene(
    (
        SceneObject("fan", np.array([-1.0, 0.7, 0.5]), [0.3, 0.3, 1.0]),
        SceneObject("bed", np.array([0.6, -0.7, 0.3]), [1.2, 0.8, 0.6]),
    )
)


def frames_of(said):
    return understand(said, THINGS, PATH).reading.frames


def done(said, path=PATH, scene=THINGS, robot=None):
    result = adapt(path, said, scene=scene, robot=robot, writer="builtin")
    return result.proposal or result


@pytest.mark.parametrize("said", ["hover 3 seconds beside the fan", "hover next to the fan for 3 seconds"])
def test_to_hover_beside_a_thing_is_to_wait_there(said):
    assert [type(frame) for frame in frames_of(said)] == [F.Wait]


@pytest.mark.parametrize("said", ["hover 3 seconds over the fan", "hover above the fan for 3 seconds"])
def test_to_hover_over_a_thing_stays_so(said):
    assert [type(frame) for frame in frames_of(said)] == [F.Hover]


@pytest.mark.parametrize(
    ("said", "home"),
    [
        ("go left by 10 cm before the bed, then back on course", False),
        ("slower near the fan, then back to the usual route", False),
        ("go left by 10 cm, then go back home", True),
        ("return to the start, no matter how it is done", True),
        ("slow down near the fan and come back to where you started", True),
    ],
)
def test_back_on_course_is_no_way_home(said, home):
    assert any(isinstance(frame, F.Return) for frame in frames_of(said)) is home


@pytest.mark.parametrize(
    ("said", "along"),
    [
        ("come within 30 cm of the fan, but don't touch it", False),
        ("stay within 80 cm of the fan", True),
        ("don't go more than 80 cm away from the fan and don't bump it", True),
    ],
)
def test_a_greatest_distance_holds_all_along_only_where_that_is_said(said, along):
    bounds = [frame for frame in frames_of(said) if isinstance(frame, F.Clearance)]
    (near,) = (frame for frame in bounds if frame.distance.role == "at_most")
    assert near.along is along


def test_a_speed_for_all_is_set_before_what_is_said_of_a_part():
    speeds = done("ramp the speed up in the first 25 %, and set the speed to 0.3 m/s").adapted.speeds
    assert speeds[0] < 0.25 < speeds[12] <= 0.3 + 1e-9 and speeds[-1] == pytest.approx(0.3)


def test_a_wait_outlives_what_stays_as_it_is():
    result = done("leave the first third as it is, half speed in the middle third, and wait 2 seconds at the start")
    still = np.linalg.norm(np.diff(result.adapted.positions, axis=0), axis=1) == 0.0
    assert np.diff(result.adapted.times)[still].sum() == pytest.approx(2.0, abs=0.11)


@pytest.mark.parametrize("said", ["up 20 cm on the whole route apart from takeoff and landing"])
def test_an_exception_that_no_frame_holds_is_shown_first(said):
    assert adapt(PATH, said, scene=THINGS, writer="builtin").status == "needs_confirmation"


def test_near_is_one_stretch_where_the_path_hardly_leaves_it():
    angles = np.linspace(np.pi, 0.0, 41)
    bump = 0.3 + 0.02 * np.exp(-((angles - np.pi / 2) ** 2) / 0.1)
    arc = np.column_stack([bump * np.cos(angles), bump * np.sin(angles), np.full(41, 0.5)])
    vase = SceneObject("vase", np.array([0.0, 0.0, 0.5]))
    assert Scale.of(Trajectory(arc, np.full(41, 0.2))).near(arc, vase) >= bump.max()


def test_no_nearer_to_an_animal_than_the_limits_allow():
    hen = SceneObject("hen", np.array([0.0, 0.55, 0.5]))
    result = done("go really close to the hen", scene=Scene((hen,)))
    assert result.status == "done" and 0.1 < hen.distance(result.adapted.positions).min() < 0.3


def test_a_way_around_one_thing_keeps_clear_of_another():
    line = Trajectory(np.column_stack([4.0 * S - 2.0, 0.0 * S, 0.5 + 0.0 * S]), np.full(61, 0.4))
    pole, lamp = (
        SceneObject(name, np.array(at)) for name, at in (("pole", [0.0, 0.3, 0.5]), ("lamp", [0.5, -0.2, 0.5]))
    )
    alone, both = (done("keep 0.6 m from the pole", line, Scene(things)).adapted for things in ((pole,), (pole, lamp)))
    assert lamp.distance(alone.positions).min() + 0.03 < lamp.distance(both.positions).min()
    assert pole.distance(both.positions).min() > 0.59


def test_the_other_side_at_a_corner_is_gone_round():
    corner = np.concatenate([np.linspace((-1.4, -1.0), (0.8, -0.9), 30), np.linspace((0.8, -0.8), (0.9, 0.9), 25)])
    path = Trajectory(np.column_stack([corner, np.zeros(55)]), np.full(55, 0.4))
    pallet = SceneObject("pallet", np.array([-0.35, 0.1, 0.07]), [0.8, 0.6, 0.14])
    result = done("go round the other side of the pallet", path, Scene((pallet,)))
    assert "go_round" in result.code and "expect_visits" in result.code and result.status == "done"
    assert arc_length(result.adapted.positions)[-1] < 4.5 and pallet.distance(result.adapted.positions).min() > 0.2


def test_the_limits_push_nothing_underground_but_a_workspace_below_it_holds():
    low = Trajectory(np.column_stack([4.0 * S - 2.0, 0.0 * S, 0.02 + 0.0 * S]), np.full(61, 0.4))
    person = SceneObject("person", np.array([0.0, 0.2, 0.35]))
    assert done("go left by 0.1", low, Scene((person,))).adapted.positions[:, 2].min() >= -1e-9
    sunk = Robot("boat", Box((-3, -3, -10), (3, 3, -0.2)))
    deep = low.with_(positions=low.positions - np.array([0.0, 0.0, 0.5]))
    result = adapt(deep, "up by 0.6", scene=Scene(), robot=sunk, writer="builtin")
    assert result.status == "limited" and result.adapted.positions[:, 2].max() <= -0.2 + 1e-6


@pytest.mark.parametrize(
    "said", ["stop 20 cm before the fan, then continue", "stop 20 cm before the fan and wait 5 seconds"]
)
def test_a_stop_short_of_a_thing_before_it_goes_on_is_a_wait(said):
    (frame,) = frames_of(said)
    assert isinstance(frame, F.Wait) and frame.by.value == pytest.approx(0.2 if frame.by.unit == "m" else 20)


def test_a_stop_before_it_goes_on_does_not_end_the_path():
    result = done("stop at the fan, then go on")
    assert np.allclose(result.adapted.positions[-1], PATH.positions[-1]) and (result.adapted.speeds[1:-1] == 0.0).any()
    assert not np.allclose(done("stop at the fan for good").adapted.positions[-1], PATH.positions[-1])
