"""Robots in simulation follow trajectories in true time, and say what they cannot do."""

import json
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from ovita import sim
from ovita.errors import MissingExtra, RequestError, TrajectoryError
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Trajectory

pytest.importorskip("mujoco", reason="the extra sim is not installed")

ROBOTS = ("iiwa", "jackal", "crazyflie")
TOLERANCE = {"iiwa": 0.002, "jackal": 0.05, "crazyflie": 0.05}
BASE = {"iiwa": sim.Base()}


def wave(robot, speed=0.2, n=25):
    """A gentle curve in front of an arm at the origin, on the ground for a rover."""
    s = np.linspace(0, 1, n)
    points = np.column_stack([0.5 + 0.05 * np.sin(5 * s), -0.3 + 0.6 * s, 0.5 + 0.08 * np.cos(4 * s)])
    return Trajectory(points * ([4, 4, 0] if robot == "jackal" else [1, 1, 1]), np.full(n, speed))


def with_dwell(trajectory, at, steps):
    rows = trajectory.to_array()
    pause = np.repeat(rows[at : at + 1], steps, axis=0)
    pause[:, 3] = 0.0
    return Trajectory.from_array(np.concatenate([rows[: at + 1], pause, rows[at + 1 :]]))


@pytest.fixture(scope="module")
def followed():
    return {robot: sim.simulate(wave(robot), robot=robot, base=BASE.get(robot)) for robot in ROBOTS}


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_robot_follows_within_its_tolerance_and_in_the_time_asked(followed, robot):
    report = followed[robot].report
    assert report.status == "followed" and not report.unreachable and not report.contacts
    assert report.tracking.rms < TOLERANCE[robot]
    assert report.achieved == pytest.approx(report.asked, abs=0.5)


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_speed_instruction_changes_the_duration(followed, robot):
    slower = sim.simulate(wave(robot, speed=0.1), robot=robot, base=BASE.get(robot)).report
    assert slower.achieved == pytest.approx(2 * followed[robot].report.achieved, abs=0.6)


@pytest.mark.parametrize("robot", ROBOTS)
def test_stopping_for_ten_timesteps_stands_still_for_one_second(followed, robot):
    trajectory = with_dwell(wave(robot), 12, 10)
    motion = sim.simulate(trajectory, robot=robot, base=BASE.get(robot)).motion
    standing = (motion.waypoints >= 12) & (motion.waypoints <= 22)
    assert np.ptp(motion.times[standing]) == pytest.approx(1.0, abs=0.05)
    last_half = np.nonzero(standing)[0][standing.sum() // 2 :]
    assert np.ptp(motion.tip[last_half], axis=0).max() < 0.005
    moving = np.linalg.norm(np.diff(motion.tip, axis=0), axis=1)[: np.argmax(standing) - 10]
    assert moving[10:].min() > 0.001


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_report_is_plain_json_and_sentences(followed, robot):
    report = followed[robot].report
    document = json.loads(json.dumps(report.to_dict()))
    assert document["status"] == "followed" and document["tracking"]["rms"] == report.tracking.rms
    assert any("Tracking error" in text for text in report.sentences()) and "Base at" in report.sentences()[0]


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_motion_has_poses_of_every_body_and_ends_at_the_goal(followed, robot):
    motion = followed[robot].motion
    frames, bodies = len(motion.times), len(motion.bodies)
    assert motion.positions.shape == (frames, bodies, 3) and motion.wxyz.shape == (frames, bodies, 4)
    assert np.allclose(np.linalg.norm(motion.wxyz, axis=2), 1.0)
    assert (np.diff(motion.times) > 0).all() and (np.diff(motion.asked) >= 0).all()
    assert np.linalg.norm(motion.tip[-1] - wave(robot).positions[-1]) < TOLERANCE[robot]
    assert {shape.body for shape in motion.shapes} == set(range(bodies))
    place, turn = motion.at(-1.0)
    assert np.array_equal(place, motion.positions[0]) and np.allclose(turn, motion.wxyz[0])
    late, _ = motion.at(1e9, clock="trajectory")
    assert np.array_equal(late, motion.positions[-1])


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_preview_is_the_simulation_without_its_errors(followed, robot):
    quick, full = sim.preview(wave(robot), robot=robot, base=BASE.get(robot)), followed[robot].motion
    assert quick.bodies == full.bodies and np.allclose(quick.times, full.times)
    assert np.abs(quick.positions - full.positions).max() < 0.06
    assert np.linalg.norm(quick.tip - full.tip, axis=1).max() < 0.06


def test_simulating_twice_gives_the_same():
    one, two = (sim.simulate(wave("iiwa"), robot="iiwa", base=sim.Base()) for _ in range(2))
    assert np.array_equal(one.motion.positions, two.motion.positions) and one.report == two.report


def test_a_ned_scene_moves_as_the_same_scene_with_z_up():
    up = wave("crazyflie")
    down = up.with_(positions=up.positions * [1, -1, -1])
    one = sim.simulate(up, robot="crazyflie")
    two = sim.simulate(down, Scene(frame=Frame("ned")), "crazyflie")
    assert np.allclose(one.motion.tip, two.motion.tip * [1, -1, -1])
    assert one.report.base.z == pytest.approx(-two.report.base.z)


def test_an_arm_is_slowed_where_a_joint_would_be_too_fast_and_says_which():
    run = sim.simulate(wave("iiwa", speed=5.0), robot="iiwa", base=sim.Base())
    report = run.report
    assert report.status == "slowed" and report.slowdown > 2 and report.tracking.rms < 0.002
    assert any("times as long" in text for text in report.sentences())
    assert any(limit.limit.endswith("speed") for limit in report.limits)


def test_waypoints_out_of_reach_are_named_with_the_reason():
    path = Trajectory(np.linspace([0.5, 0, 0.5], [1.5, 0, 0.5], 21), np.full(21, 0.3))
    report = sim.simulate(path, robot="iiwa", base=sim.Base()).report
    assert report.status == "unreachable"
    assert [item.waypoint for item in report.unreachable] == list(range(9, 21))
    assert "m from the shoulder and the arm is 0.946 m long" in report.unreachable[-1].reason
    assert report.tracking.rms < 0.002
    assert "12 waypoints cannot be reached (10-21); the worst is waypoint 21," in report.sentences()[1]


def test_a_base_out_of_reach_of_everything_is_refused_with_the_distance():
    with pytest.raises(
        RequestError, match=r"no waypoint is within reach of the KUKA LBR iiwa 14 at \(5, 0, 0\) m.*--base"
    ):
        sim.simulate(wave("iiwa", n=4), robot="iiwa", base=sim.Base(5, 0, 0))


def test_a_rover_or_drone_stands_where_the_trajectory_starts():
    with pytest.raises(RequestError, match="m from the start of the trajectory; a rover starts there"):
        sim.simulate(wave("jackal"), robot="jackal", base=sim.Base(5, 0, 0))


def test_a_rover_cannot_leave_the_ground():
    points = np.linspace([0, 0, 0], [2, 0, 0], 9)
    points[4, 2] = 0.5
    report = sim.simulate(Trajectory(points, np.full(9, 0.5)), robot="jackal").report
    assert report.status == "unreachable" and report.unreachable[0].waypoint == 4
    assert report.unreachable[0].reason == "it is 0.50 m above the ground"


def test_a_rover_turns_on_the_spot_at_a_sharp_corner():
    corner = Trajectory(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.0]]), np.full(3, 0.5))
    run = sim.simulate(corner, robot="jackal")
    assert run.report.tracking.rms < 0.05 and run.report.status == "slowed"
    near = np.linalg.norm(run.motion.tip[:, :2] - [1, 0], axis=1).min()
    assert near < 0.03


def test_a_drone_that_is_asked_for_too_much_speed_says_so_and_flies_slower():
    fast = Trajectory(np.linspace([0, 0, 1], [40, 0, 1], 30), np.full(30, 12.0))
    report = sim.simulate(fast, robot="crazyflie").report
    assert report.status == "slowed" and report.tracking.rms < 0.05
    assert "asks for 12 m/s; this drone flies at most 2.5 m/s" in " ".join(report.sentences())


def test_contact_is_reported_by_the_objects_name_and_whether_it_was_meant():
    cup = SceneObject("cup", np.array([0.5, 0.0, 0.45]), np.array([0.1, 0.1, 0.1]))
    far = SceneObject("plate", np.array([-0.6, 0.6, 0.1]), np.array([0.1, 0.1, 0.1]))
    scene = Scene((cup, far))
    one = sim.simulate(wave("iiwa"), scene, "iiwa", base=sim.Base()).report
    assert [contact.name for contact in one.contacts] == ["cup"] and not one.contacts[0].meant
    assert one.contacts[0].depth > 0.005 and one.tracking.rms < 0.002
    two = sim.simulate(wave("iiwa"), scene, "iiwa", base=sim.Base(), contacts=["cup"]).report
    assert two.contacts[0].meant and any("Contact with cup, as meant" in text for text in two.sentences())
    assert one.status == "contact" and one.status in sim.FAILED and two.status == "followed"
    pushed = sim.simulate(wave("iiwa"), scene, "iiwa", base=sim.Base(), solid=True).report
    assert pushed.tracking.max > 0.005


def test_one_large_error_is_off_course_however_small_the_mean(followed):
    peak = followed["jackal"].report.tracking.max
    strict = replace(sim.load_model("jackal"), peak_tolerance=0.9 * peak)
    report = sim.simulate(wave("jackal"), robot=strict).report
    assert report.status == "off course" and report.tracking.rms < report.tolerance
    assert any("beyond the tolerance" in text for text in report.sentences())


def test_orientation_is_free_given_or_kept():
    path = wave("iiwa")
    down = np.tile([0.0, 1.0, 0.0, 0.0], (len(path), 1))
    given = Trajectory(path.positions, path.speeds, down)
    report = sim.simulate(given, robot="iiwa", base=sim.Base()).report
    assert report.orientation_error < 0.02 and report.tracking.rms < 0.002
    assert sim.simulate(given, robot="iiwa", base=sim.Base(), orientation="free").report.orientation_error is None
    motion = sim.simulate(path, robot="iiwa", base=sim.Base(), orientation="keep").motion
    hand = motion.wxyz[:, motion.bodies.index("link7")]
    assert np.abs(hand @ hand[0]).min() > 0.9999


def test_a_trajectory_that_goes_nowhere_is_refused():
    with pytest.raises(TrajectoryError, match="goes nowhere"):
        sim.simulate(Trajectory(np.ones((3, 3)), np.ones(3)), robot="iiwa")


def test_values_that_are_not_finite_are_refused_before_anything_runs():
    with pytest.raises(TrajectoryError, match=r"waypoint 1: positions .* not finite"):
        Trajectory(np.array([[0, 0, 0], [np.nan, 0, 0]]), np.ones(2))


def test_a_missing_package_is_named_with_its_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "toppra", None)
    with pytest.raises(MissingExtra, match=r"this needs toppra: pip install 'ovita\[sim\]'"):
        sim.simulate(wave("iiwa"), robot="iiwa")


def test_a_hundred_waypoints_of_inverse_kinematics_take_a_tenth_of_a_second():
    from ovita.sim.arm import Kinematics
    from ovita.sim.world import build

    model = sim.load_model("iiwa")
    stage = build(model, Scene(), sim.Base(), 0.0)
    kinematics = Kinematics(stage, model.limits, wave("iiwa", n=100), "auto")
    best = np.inf
    for _ in range(3):
        begun = time.process_time()
        kinematics.choose()
        best = min(best, time.process_time() - begun)
    assert best < 0.2
