"""Missions up and down a MAVLink link, also one that loses, repeats, swaps and refuses."""

import random
import socket
import struct
import sys
import threading
from contextlib import closing

import numpy as np
import pytest

pytest.importorskip("pymavlink")

from responder import Responder

from ovita.errors import FormatError, LinkError, MissingExtra, RequestError
from ovita.io import Choices, mavlink, open_task
from ovita.io.geodesy import Home
from ovita.io.links import Address, deliver
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory

HOME = Home(47.3977419, 8.5455938, 488.2)
CHOICES = Choices(home=HOME)
PATH = Trajectory(
    [[0, 0, 20], [30, 10, 25], [30, 10, 25], [30, 10, 25], [30, 10, 25], [60, 40.5, 25], [0, 40, 20.25]],
    [4, 4, 0, 0, 2.5, 2.5, 2.5],
)


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(mavlink, "RESEND", 0.25)


def at(responder, way="udpout", timeout=3):
    return f"mavlink:{way}:127.0.0.1:{responder.port}?timeout={timeout}"


def unlucky(seed, loss=0.2, twice=0.1):
    chance = random.Random(seed)
    return lambda name, n: chance.choices([0, 1, 2], [loss, 1 - loss - twice, twice])[0]


def check(task):
    np.testing.assert_allclose(task.trajectory.positions, PATH.positions, atol=0.02)
    np.testing.assert_allclose(task.trajectory.speeds, PATH.speeds, rtol=1e-6)


@pytest.mark.parametrize("ardupilot", [False, True])
@pytest.mark.parametrize("tcp", [False, True])
def test_up_and_down(tcp, ardupilot):
    way = "tcp" if tcp else "udpout"
    with Responder(tcp=tcp, ardupilot=ardupilot, home=None if ardupilot else (47.3977419, 8.5455938, 488.2)) as vehicle:
        receipt = deliver(at(vehicle, way), PATH, Scene(), choices=CHOICES)
    assert len(receipt.sha256) == 64 and receipt.size > 100 and "read back" in receipt.notes[-1]
    commands = [item.command for item in vehicle.items]
    assert commands == [16] * ardupilot + [178, 16, 16, 178, 16, 16]
    assert vehicle.items[0].current == 1 and vehicle.items[-1].frame == 6
    assert [item.seq for item in vehicle.items] == list(range(len(commands)))
    with Responder(tcp=tcp, ardupilot=ardupilot, home=vehicle.home) as again:
        again.items = vehicle.items
        task = open_task(at(again, way))
    check(task)
    assert task.scene.extra["mission"]["home"][:2] == pytest.approx([47.3977419, 8.5455938], abs=1e-7)


def test_a_station_that_listens():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with Responder().call(port) as vehicle:
        deliver(f"mavlink:udp:127.0.0.1:{port}?timeout=3", PATH, Scene(), choices=CHOICES)
    assert len(vehicle.items) == 6


@pytest.mark.parametrize("seed", range(4))
def test_loss_and_repetition_both_ways(seed):
    with Responder(incoming=unlucky(seed), outgoing=unlucky(seed + 100)) as vehicle:
        deliver(at(vehicle, timeout=6), PATH, Scene(), choices=CHOICES)
    assert [item.command for item in vehicle.items] == [178, 16, 16, 178, 16, 16]


def test_messages_out_of_order_old_requests_and_garbage():
    swapped = [("MISSION_REQUEST", 2), ("MISSION_ITEM_INT", 1), ("MISSION_ITEM_INT", 4)]
    with Responder(swap=swapped, old_requests=True, garbage=b"\xfd\x09noise\x00\xfe", outgoing=unlucky(3, 0, 0.5)) as v:
        deliver(at(v), PATH, Scene(), choices=CHOICES)
        check(open_task(at(v), choices=CHOICES))
    assert v.sent["MISSION_REQUEST"] >= 6


@pytest.mark.parametrize(
    ("faults", "problem"),
    [
        ({"refuse": (2, 4)}, r"refused the mission: mission items exceed storage space \(MAV_MISSION_NO_SPACE\)"),
        ({"refuse": (0, 14)}, r"refused the mission.*MAV_MISSION_DENIED"),
        ({"refuse": (0, 99)}, "refused the mission: result 99"),
        ({"incoming": lambda name, n: int(name != "MISSION_ITEM_INT" or n < 3)}, "fell silent after 4 of 6 items"),
        ({"outgoing": lambda name, n: int(name != "MISSION_REQUEST_INT")}, "fell silent after 0 of 6 items"),
        ({"outgoing": lambda name, n: int(name != "MISSION_ACK")}, "fell silent after 6 of 6 items"),
        ({"spoil": lambda items: items.pop()}, "6 items were sent, but the vehicle holds 5; do not fly"),
        ({"spoil": lambda items: setattr(items[1], "z", 2.0)}, "holds another item 1 than was sent; do not fly"),
        ({"spoil": lambda items: setattr(items[0], "param2", 9.0)}, "holds another item 0 than was sent; do not fly"),
        ({"spoil": lambda items: setattr(items[2], "command", 21)}, "holds another item 2 than was sent; do not fly"),
        ({"outgoing": lambda name, n: int(name != "MISSION_COUNT")}, "does not answer when asked for its mission"),
        ({"outgoing": lambda name, n: int(name != "MISSION_ITEM_INT")}, "does not answer when asked for item 0"),
        (
            {
                "outgoing": lambda name, n: 30 if name == "MISSION_REQUEST_INT" else 1,
                "incoming": lambda name, n: int(name != "MISSION_ITEM_INT"),
            },
            "keeps asking for item 0",
        ),
    ],
)
def test_what_goes_wrong_is_said(faults, problem, monkeypatch):
    monkeypatch.setattr(mavlink, "RESEND", 0.08)
    with Responder(**faults) as vehicle, pytest.raises(LinkError, match=problem) as caught:
        deliver(at(vehicle), PATH, Scene(), choices=CHOICES)
    assert "\n" not in str(caught.value)


def test_what_a_vehicle_rounds_is_told():
    def rounded(items):
        items[2].param1, items[1].z = 0.0, items[1].z + 0.004

    with Responder(spoil=rounded) as vehicle:
        receipt = deliver(at(vehicle), PATH, Scene(), choices=CHOICES)
    assert any("keeps parameters 1 to 4 of some items otherwise, such as holds: 2 (NAV_" in n for n in receipt.notes)


def test_without_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "pymavlink.dialects.v20", None)
    with pytest.raises(MissingExtra, match=r"pip install 'ovita\[mavlink\]'"):
        open_task("mavlink:tcp:127.0.0.1:1")


def test_nobody_there(monkeypatch):
    with Responder(silent=True) as vehicle, pytest.raises(LinkError, match="no vehicle's heartbeat came within"):
        open_task(at(vehicle, timeout=0.3))
    with pytest.raises(LinkError, match=r"127.0.0.1:1 cannot be connected to: connection refused"):
        open_task("mavlink:tcp:127.0.0.1:1")
    with Responder() as vehicle, pytest.raises(LinkError, match="cannot be opened: address already in use"):
        open_task(at(vehicle, "udpin"))
    monkeypatch.setattr(socket, "getaddrinfo", lambda *a, **k: (_ for _ in ()).throw(socket.gaierror(-2, "unknown")))
    with pytest.raises(LinkError, match="there is no host"):
        open_task("mavlink:tcp:nowhere.invalid:5760")


def test_a_stream_that_ends():
    server = socket.create_server(("127.0.0.1", 0))
    server.settimeout(3)
    with server, pytest.raises(LinkError, match=r"the other side closed the connection|the connection broke"):

        def hang_up():
            link, _ = server.accept()
            link.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 0, 0))
            link.close()

        threading.Thread(target=hang_up).start()
        open_task(f"mavlink:tcp:127.0.0.1:{server.getsockname()[1]}?timeout=2")


def test_no_home_and_no_waypoints():
    with Responder() as vehicle:
        with pytest.raises(FormatError, match=r"there is no home position.*--home"):
            deliver(at(vehicle), PATH, Scene())
        with pytest.raises(LinkError, match="the vehicle knows no home position; say --home"):
            open_task(at(vehicle))
        with pytest.raises(FormatError, match="holds 0 waypoints"):
            open_task(at(vehicle), choices=CHOICES)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("mavlink:serial:/dev/tty", "is not WAY:HOST:PORT"),
        ("mavlink:udp:127.0.0.1", "is not WAY:HOST:PORT"),
        ("mavlink:udp:127.0.0.1:99999", "is not WAY:HOST:PORT"),
        ("mavlink:udp:127.0.0.1:1?wait=3", "unknown option 'wait'; known are type, rate, end, timeout"),
        ("mavlink:udp:127.0.0.1:1?timeout=0", "is not a time > 0"),
        ("ros2:plan", "'plan' is no topic"),
        ("ros2:/plan/", "is no topic"),
        ("ros2:/plan?domain=233", "whole number 0..232"),
        ("ros2:/plan?domain=x", "whole number 0..232"),
        ("ros2:/plan?type=joints", "the type is path, poses or multidof"),
        ("ros2:/plan?domain=1&domain=2", "each once"),
        ("http://x", "is no address"),
    ],
)
def test_addresses_that_make_no_sense(text, problem):
    with pytest.raises(RequestError, match=problem):
        Address.parse(text)


def test_addresses(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "17")
    monkeypatch.setenv("ROS_LOCALHOST_ONLY", "1")
    address = Address.parse("ros2:/plan?type=multidof&timeout=2.5")
    assert (address.domain, address.local, address.timeout, address.target) == (17, True, 2.5, "/plan")
    assert str(address) == "ros2:/plan?type=multidof&timeout=2.5"
    assert Address.parse("ros2:/plan?domain=3&local=0").domain == 3
    assert Address.parse("mavlink:tcp:[::1]:5760").endpoint == ("tcp", "::1", 5760)


def test_a_program_beside_the_autopilot_is_not_taken_for_it():
    from pymavlink.dialects.v20 import common as d

    class Noisy(Responder):
        def _send(self, message):
            if message.get_type() == "HEARTBEAT":
                self._raw(d.MAVLink_heartbeat_message(0, 0, 0, 0, 0, 3).pack(self.codec))
            super()._send(message)

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = Address.parse(f"mavlink:udp:127.0.0.1:{port}?timeout=3")
    with Noisy().call(port), closing(mavlink.Vehicle(address)) as found:
        assert (found.system, found.autopilot, found.kind) == (1, 12, 2)
