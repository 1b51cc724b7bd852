"""Missions before judges that ovita did not write: pymavlink's mavwp, MAVProxy and MAVSDK.

OVITA_MAVLINK_JUDGES names the Python of a virtual environment with `pip install MAVProxy mavsdk`; they do not share one
with everything else.
"""

import json
import os
import socket
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pymavlink")

from responder import Responder

from ovita.io import Choices, load_task, save_trajectory
from ovita.io.geodesy import Home
from ovita.io.links import deliver
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory

JUDGES = os.environ.get("OVITA_MAVLINK_JUDGES", "")
needs_judges = pytest.mark.skipif(not JUDGES, reason="OVITA_MAVLINK_JUDGES names no Python with MAVProxy and mavsdk")
HOME = Home(47.3977419, 8.5455938, 488.2)
PATH = Trajectory([[0, 0, 20], [0, 30, 22], [0, 30, 22], [0, 30, 22], [20, 30, 25], [20, 60, 25]], [5, 5, 0, 0, 3, 6])


def written(tmp_path, ending):
    file = tmp_path / f"a{ending}"
    save_trajectory(file, PATH, choices=Choices(home=HOME, takeoff=True))
    return file


def test_mavwp_loads_it(tmp_path):
    mavwp = pytest.importorskip("pymavlink.mavwp")
    file = written(tmp_path, ".waypoints")
    loader = mavwp.MAVWPLoader()
    assert loader.load(str(file)) == 9
    commands = [loader.wp(i).command for i in range(loader.count())]
    assert commands == [16, 22, 178, 16, 16, 178, 16, 178, 16]
    assert loader.wp(4).param1 == pytest.approx(0.2) and loader.wp(4).z == pytest.approx(22.0, abs=1e-3)
    loader.save(str(tmp_path / "b.waypoints"))
    again = load_task(tmp_path / "b.waypoints").trajectory
    np.testing.assert_allclose(again.positions, load_task(file).trajectory.positions, atol=0.1)
    assert again.duration == pytest.approx(PATH.duration, rel=0.01)


@needs_judges
def test_mavproxy_loads_it(tmp_path):
    file = written(tmp_path, ".waypoints")
    script = Path(JUDGES).parent / "mavproxy.py"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        master = f"--master=udpin:127.0.0.1:{free.getsockname()[1]}"
    commands = f"--cmd=wp load {file}; wp savelocal {tmp_path / 'b.waypoints'}"
    process = subprocess.Popen(
        [JUDGES, str(script), master, "--non-interactive", commands, f"--state-basedir={tmp_path}"],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    for _ in range(300):
        if (tmp_path / "b.waypoints").exists() or process.poll() is not None:
            break
        time.sleep(0.1)
    time.sleep(0.5)
    process.terminate()
    assert "Loaded 9 waypoints" in process.communicate()[0]
    again = load_task(tmp_path / "b.waypoints").trajectory
    np.testing.assert_allclose(again.positions, load_task(file).trajectory.positions, atol=0.1)
    assert again.duration == pytest.approx(PATH.duration, rel=0.01)


def eventually(happens, seconds=30):
    end = time.monotonic() + seconds
    while not happens() and time.monotonic() < end:
        time.sleep(0.05)
    return happens()


@needs_judges
def test_mavproxy_uploads_it_to_a_vehicle_as_we_do_and_lists_it(tmp_path):
    file = written(tmp_path, ".waypoints")
    with Responder(ardupilot=True) as ours:
        deliver(f"mavlink:udpout:127.0.0.1:{ours.port}", PATH, Scene(), choices=Choices(home=HOME, takeoff=True))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [JUDGES, str(Path(JUDGES).parent / "mavproxy.py"), f"--master=udpin:127.0.0.1:{port}"]
    with Responder(ardupilot=True).call(port) as theirs:
        process = subprocess.Popen(
            [*command, f"--state-basedir={tmp_path}", "--default-modules=wp,link"], cwd=tmp_path, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        try:
            assert eventually(lambda: theirs.seen.get("HEARTBEAT", 0) > 1)
            process.stdin.write(f"wp load {file}\n")
            process.stdin.flush()
            assert eventually(lambda: len(theirs.items) == 9)
            process.stdin.write("wp list\n")
            process.stdin.flush()
            assert eventually((tmp_path / "way.txt").exists)
            time.sleep(0.5)
        finally:
            process.terminate()
            said = process.communicate()[0]
    assert "Sent all 9 waypoints" in said and "Got MISSION_ACK: TYPE_MISSION: ACCEPTED" in said
    listed = [line.split() for line in said.splitlines() if " p1=" in line]
    assert [int(line[0]) for line in listed] == [item.command for item in ours.items]
    for mine, other in zip(ours.items, theirs.items, strict=True):
        assert (mine.seq, mine.command) == (other.seq, other.command)
        assert (mine.param1, mine.param2) == pytest.approx((other.param1, other.param2), abs=1e-6)
        assert abs(mine.x - other.x) <= 1 and abs(mine.y - other.y) <= 1 and abs(mine.z - other.z) < 1e-4
    places = load_task(tmp_path / "way.txt").trajectory
    np.testing.assert_allclose(places.positions, load_task(file).trajectory.positions, atol=0.1)
    assert places.duration == pytest.approx(PATH.duration, rel=0.01)


def judged(*arguments):
    judge = str(Path(__file__).parent / "mavsdk_judge.py")
    return subprocess.Popen([JUDGES, judge, *map(str, arguments)], stdout=subprocess.PIPE, text=True)


@needs_judges
def test_mavsdk_takes_it_as_a_vehicle():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    process = judged("vehicle", port)
    try:
        receipt = deliver(
            f"mavlink:udp:127.0.0.1:{port}?timeout=20", PATH, Scene(), choices=Choices(home=HOME, takeoff=True)
        )
        items = json.loads(process.stdout.readline())
    finally:
        process.terminate()
        process.communicate()
    assert "read back from the vehicle and compared" in receipt.notes[-1]
    assert [item["command"] for item in items] == [22, 178, 16, 16, 178, 16, 178, 16]
    assert [item["param2"] for item in items if item["command"] == 178] == pytest.approx([5.0, 1.5, 4.5], abs=0.01)


@needs_judges
def test_mavsdk_reads_the_plan(tmp_path):
    process = judged("plan", written(tmp_path, ".plan"))
    items = json.loads(process.communicate(timeout=60)[0].splitlines()[-1])
    assert [item["command"] for item in items] == [22, 178, 16, 16, 178, 16, 178, 16]
    assert items[3]["param1"] == pytest.approx(0.2) and items[3]["z"] == pytest.approx(22.0, abs=1e-3)


@needs_judges
def test_mavsdk_flies_setpoints_as_a_vehicle():
    path = Trajectory([[0, 0, 1], [0, 0.6, 1], [0.5, 0.6, 1.2]], [0.0, 0.8, 0.0])
    room = Robot("room", Box((-3, -3, 0), (3, 3, 3)))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    process = judged("copter", port)
    try:
        receipt = deliver(f"mavlink:udp:127.0.0.1:{port}?type=setpoints&timeout=20", path, Scene(), robot=room)
        seen = json.loads(process.stdout.readline())
    finally:
        process.terminate()
        process.communicate()
    assert "the vehicle holds" in receipt.notes[0]
    assert seen["modes"][0] == 6 << 16 and seen["modes"][-1] == 4 << 16 | 3 << 24
    np.testing.assert_allclose(seen["place"], [0.6, 0.5, -1.2], atol=1e-6)
    told = np.array(seen["told"])
    assert set(told[:, 6]) == {64 | 128 | 256 | 1024 | 2048} and set(told[:, 7]) == {1}
    flown = told[np.linalg.norm(told[:, 3:6], axis=1) > 0]
    assert len(flown) >= 0.8 * 20 * path.duration and np.linalg.norm(flown[:, 3:6], axis=1).max() <= 0.8 + 1e-6
