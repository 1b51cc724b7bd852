"""Paths flown by setpoints: what is sent, what is refused, and where the vehicle is left when something goes wrong."""

import signal
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

pytest.importorskip("pymavlink")

from flown import Copter
from walked import made, served, walk

from ovita.chain import adapt
from ovita.cli.transfer_ import send
from ovita.errors import LinkError, RequestError
from ovita.io import Choices
from ovita.io.links import Address, deliver
from ovita.io.setpoints import Course, Pilot
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Frame, Scene
from ovita.paths.trajectory import Trajectory
from ovita.request import Request

ROOM = Robot("room", Box((-3, -3, 0), (3, 3, 3)), max_speed=2.0)
# 2 m to the north (front), a stop of half a second, 1 m to the east (right), half a metre up.
PATH = Trajectory(
    [[0, 0, 1], [0, 1, 1], [0, 2, 1], *[[0, 2, 1]] * 5, [1, 2, 1], [1, 2, 1.5]], [0.0, 1.0, 1.0, *[0.0] * 5, 1.0, 0.0]
)


def pilot(copter, path=PATH, scene=None, robot=ROOM, rate=20.0):
    return Pilot(copter, Course.of(path, Scene() if scene is None else scene, robot, rate))


@pytest.mark.parametrize("px4", [True, False])
def test_a_path_is_flown_and_the_vehicle_holds_at_its_end(px4):
    copter = Copter(px4=px4, armed=False)
    notes = pilot(copter).fly()
    np.testing.assert_allclose(copter.place, [2, 1, -1.5], atol=0.3)
    assert copter.state == "hold" and copter.states == ["hold", "fly", "hold"] and copter.armed
    assert "the vehicle holds" in notes[0] and "at most 0." in notes[1]
    corner = min(np.linalg.norm(np.array(row[1:]) - [2, 0, -1]) for row in copter.track)
    assert corner < 0.1
    flown = [t for t, state in copter.accepted if state == "fly"]
    assert len(flown) >= 20 * PATH.duration and max(np.diff(flown)) <= 62


def test_setpoints_are_the_path_in_every_frame():
    for name, scene_path in (
        ("rfu", PATH.positions),
        ("flu", PATH.positions[:, [1, 0, 2]] * [1, -1, 1]),
        ("ned", PATH.positions[:, [1, 0, 2]] * [1, 1, -1]),
    ):
        course = Course.of(Trajectory(scene_path, PATH.speeds), Scene(frame=Frame(name)), Robot("any"), 20.0)
        place, velocity = course.at(float(PATH.times[1]))
        np.testing.assert_allclose(place, [1, 0, -1], atol=1e-9)
        np.testing.assert_allclose(velocity, [1, 0, 0], atol=1e-9)
        np.testing.assert_allclose(course.to_scene.T @ place, scene_path[1], atol=1e-9)
    assert np.abs(Course.of(PATH, Scene(), ROOM, 20.0).at(PATH.times[4] + 0.01)[1]).max() == 0.0


@pytest.mark.parametrize("px4", [True, False])
def test_ctrl_c_leaves_it_holding(px4):
    copter = Copter(px4=px4)

    def interrupt(_):
        raise KeyboardInterrupt

    copter.at.append((4.0, interrupt))
    with pytest.raises(LinkError, match="stopped by Ctrl-C; the vehicle acknowledged HOLD"):
        pilot(copter).fly()
    assert copter.state == "hold"


def test_a_silent_vehicle_ends_the_flight():
    copter = Copter()
    copter.at.append((4.0, lambda c: setattr(c, "loss", 1.0)))
    with pytest.raises(LinkError, match="fell silent; HOLD was commanded, not acknowledged; the vehicle's own"):
        pilot(copter).fly()
    assert copter.state == "hold"  # by its own failsafe


def test_a_pilot_who_takes_over_is_left_in_command():
    copter = Copter()
    copter.at.append((4.0, lambda c: c._become("land")))
    with pytest.raises(
        LinkError, match="a pilot or a failsafe changed the mode to LAND, which is in command now; nothing"
    ):
        pilot(copter).fly()
    assert copter.states[-1] == "land"


@pytest.mark.parametrize("px4", [True, False])
@pytest.mark.parametrize("text", ["Low battery", "Geofence breached"])
def test_what_the_vehicle_says_is_told(px4, text):
    copter = Copter(px4=px4)

    def failsafe(c):
        for severity, said in ((6, "All is well"), (2, text), (2, text)):
            c.say_text(severity, said)
        c._become("land")

    copter.at.append((4.0, failsafe))
    with pytest.raises(LinkError) as caught:
        pilot(copter).fly()
    said = str(caught.value)
    assert (
        f'changed the mode to LAND, which is in command now; nothing more was sent; the vehicle said "{text}" (' in said
    )
    copter = Copter(px4=px4)
    copter.at.append((3.0, lambda c: c.say_text(4, text)))
    assert f'on the way the vehicle said "{text}"' in pilot(copter).fly()[-1] and copter.state == "hold"


def test_a_second_ctrl_c_ends_the_wait_and_the_state_is_said():
    copter = Copter()

    def interrupt(_):
        raise KeyboardInterrupt

    copter.at += [(4.0, lambda c: c.deaf.add("COMMAND_LONG")), (4.01, interrupt), (4.6, interrupt)]
    with pytest.raises(LinkError, match="stopped by Ctrl-C; HOLD was commanded, not acknowledged; the vehicle's own"):
        pilot(copter).fly()
    copter.run(1.5)
    assert copter.state == "hold"


@pytest.mark.parametrize(
    ("wind", "problem"),
    [
        ((3.0, 0, 0), "from where it is due; the vehicle acknowledged HOLD"),
        ((0, 0, 1.2), "left the robot's work"),
    ],
)
def test_a_vehicle_that_strays_is_stopped(wind, problem):
    copter = Copter()
    copter.at.append((3.0, lambda c: setattr(c, "wind", np.array(wind))))
    with pytest.raises(LinkError, match=problem):
        pilot(copter, robot=Robot("room", Box((-3, -3, 0.9), (3, 3, 3)), margin=0.0)).fly()
    assert copter.state == "hold"


@pytest.mark.parametrize(
    ("copter", "problem"),
    [
        (
            {"place": (0.0, 2.0, -1.0)},
            r"2.00 m from the path's start .*bring it there first$",
        ),
        ({"place": (0.0, 0.0, 0.0)}, "or say --takeoff"),
        ({"kind": 1}, "multicopters of PX4 or ArduPilot only"),
        ({"deaf": {511}}, "does not say where it is"),
        ({"deaf": {176}}, r"refused the mode OFFBOARD \(MAV_RESULT_DENIED\); the vehicle stays in the mode HOLD"),
        ({"deaf": {400}, "armed": False}, r"refused arming \(MAV_RESULT_DENIED\); the vehicle acknowledged HOLD"),
    ],
)
def test_what_is_refused(copter, problem):
    vehicle = Copter(**copter)
    with pytest.raises(LinkError, match=problem):
        pilot(vehicle).fly()
    assert vehicle.state == "hold" and np.linalg.norm(vehicle.velocity) == 0.0


def test_a_path_beyond_the_fence_is_not_begun():
    copter = Copter()
    with pytest.raises(LinkError, match="leaves the robot's workspace"):
        pilot(copter, robot=Robot("small", Box((-1, -1, 0), (1, 1, 3)))).fly()
    assert copter.states == ["hold"] and not copter.accepted


@pytest.mark.parametrize("px4", [True, False])
def test_takeoff_and_landing(px4):
    copter = Copter((0.0, 0.0, 0.0), px4=px4, armed=False)
    pilot(copter).fly(takeoff=True, land=True)
    assert copter.state == "land"
    copter.run(5)
    assert copter.place[2] >= -0.01


@pytest.mark.parametrize("seed", range(2))
def test_a_lossy_slow_link(seed):
    copter = Copter(loss=0.2, delay=0.08, jitter=0.1, seed=seed, armed=False)
    pilot(copter).fly()
    np.testing.assert_allclose(copter.place, [2, 1, -1.5], atol=0.4)
    assert copter.state == "hold"


@pytest.mark.parametrize("moment", [0.5, 1.2, 2.0, 3.7, 5.1])
def test_a_station_that_is_killed_leaves_it_holding(moment):
    class Killed(BaseException):
        pass

    def kill(_):
        raise Killed

    copter = Copter()
    copter.at.append((moment, kill))
    with pytest.raises(Killed):
        pilot(copter).fly()
    copter.run(1.5)
    assert copter.state == "hold" and np.linalg.norm(copter.velocity) == 0.0


def test_addresses_of_setpoints():
    address = Address.parse("mavlink:udp:127.0.0.1:14540?type=setpoints&rate=30&end=land")
    assert address.rate == 30.0
    for text, problem in (
        ("?type=path", "the type is mission or setpoints"),
        ("?end=crash", "the end is hold or land"),
        ("?rate=1", "the rate '1' is not a number of setpoints a second"),
    ):
        with pytest.raises(RequestError, match=problem):
            Address.parse(f"mavlink:udp:127.0.0.1:14540{text}")
    with pytest.raises(RequestError, match="only within the limits of a robot"):
        deliver(str(address), PATH, Scene(), choices=Choices())


def test_a_result_is_flown_over_udp_through_the_gate(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    short = Trajectory([[0, 0, 1], [0, 0.3, 1], [0, 0.6, 1]], [0.0, 1.0, 0.0])
    room = replace(ROOM, max_acceleration=4.0)
    result = adapt(Request("go slower", short, Scene(), room), writer="builtin")
    result.save(str(tmp_path / "r.json"))
    copter = Copter(armed=False)
    with served(copter) as place:
        done = CliRunner().invoke(send, [str(tmp_path / "r.json"), "--to", place, "--yes"])
    assert done.exit_code == 0, done.output + str(done.exception)
    assert "the vehicle holds" in done.output and copter.state == "hold" and copter.states.count("fly") == 1
    np.testing.assert_allclose(copter.place, [0.6, 0, -1], atol=0.4)


def test_send_as_a_process_of_its_own_leaves_the_vehicle_in_a_stated_state(tmp_path):
    wanted = {
        "20 % lost, some overtake others": (0, "Sent to mavlink:"),
        "the sender is killed (SIGKILL)": (-signal.SIGKILL, ""),
        "Ctrl-C": (2, "stopped by Ctrl-C; the vehicle acknowledged HOLD (after"),
    }
    file = made(tmp_path)
    # One after the other: on a busy machine the processes of all three would be late.
    for seen in (walk(case, file, seed=seed) for seed, case in enumerate(wanted)):
        code, said = wanted[seen.case]
        assert seen.code == code and said in seen.sentence and "Traceback" not in seen.said, seen.said
        assert seen.copter.states == ["hold", "fly", "hold"] and seen.state == "hold, still", seen.case
