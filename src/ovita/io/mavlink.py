"""Missions to and from a vehicle by the MAVLink mission protocol (mavlink.io, "Mission Protocol").

Uploading: MISSION_COUNT, then the vehicle asks for one item after the other (MISSION_REQUEST_INT) and gets it
(MISSION_ITEM_INT), until it acknowledges (MISSION_ACK). Downloading is the same the other way round. What is not
answered is sent again, `RETRIES` times. After an upload the mission is read back and compared.

Positions travel as whole 1e-7 degrees (1.1 cm), heights and parameters as single precision.
"""

from __future__ import annotations

import contextlib
import math
import socket
import struct
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from ovita.errors import LinkError, needs
from ovita.io.documents import NONE, Choices, Task, listing
from ovita.io.files import errors_of, reason
from ovita.io.geodesy import Home
from ovita.io.links import Address
from ovita.io.mission_checks import remarks
from ovita.io.missions import CHANGE_SPEED, WAYPOINTS, Item, Mission, home_of, mission_from, numbered, task_of
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory

RETRIES = 5
"""How often a message is sent again before the vehicle counts as silent."""

RESEND = 1.5
"""Wait for an answer before a message is sent again [s]."""

_SCALED = {0: 1e7, 3: 1e7, 5: 1e7, 6: 1e7, 10: 1e7, 11: 1e7, 1: 1e4, 4: 1e4, 7: 1e4, 8: 1e4, 9: 1e4}
_INT_FRAME = {0: 5, 3: 6, 10: 11}
_PLAIN_FRAME = {number: frame for frame, number in _INT_FRAME.items()}
_RESOLUTION = (2.1e-7, 2.1e-7, 0.011)
_ASKED = ("MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK")
_LARGEST_INT = 2**31 - 1
_HOME_POSITION, _REQUEST_MESSAGE = 242, 512
_MOST_ITEMS = 65535


def upload(
    address: Address, trajectory: Trajectory, scene: Scene, choices: Choices = NONE
) -> tuple[bytes, tuple[str, ...]]:
    """Upload a trajectory as a mission; return its items as bytes and notes on what is lost."""
    with errors_of(str(address)):
        mission, lost = mission_from(trajectory, scene, choices.home, heading=choices.heading, takeoff=choices.takeoff)
        numbered(mission, with_home=True)
        notes = remarks(mission, trajectory.duration, lost, scene)
    with contextlib.closing(Vehicle(address)) as vehicle:
        items = numbered(mission, with_home=vehicle.autopilot == ARDUPILOT)
        if len(items) > _MOST_ITEMS:
            raise LinkError(f"{address}: {len(items)} items are more than a mission can number")
        messages = [_message(vehicle, seq, item) for seq, item in enumerate(items)]
        _send_all(vehicle, messages)
        held = _fetch_all(vehicle)
        notes += _compare(address, messages, held, skip_home=vehicle.autopilot == ARDUPILOT)
    notes += ("read back from the vehicle and compared; positions are held to 1e-7 degrees (1.1 cm)",)
    return b"".join(_content(message) for message in messages), notes


def download(address: Address, home: Home | None, heading: float | None = None) -> Task:
    """Read a vehicle's mission; `home` replaces the vehicle's own, and front points to the `heading`."""
    with contextlib.closing(Vehicle(address)) as vehicle:
        items = [_item(message) for message in _fetch_all(vehicle)]
        listed = items.pop(0) if items and vehicle.autopilot == ARDUPILOT else None
        home = home or home_of(listed) or _home(vehicle)
    if home is None:
        raise LinkError(f"{address}: the vehicle knows no home position; say --home latitude,longitude,altitude")
    with errors_of(str(address)):
        return task_of(Mission(replace(home, heading=heading), tuple(items), listed), str(address))


def _send_all(vehicle: Vehicle, messages: Sequence[Any]) -> None:
    d = vehicle.dialect
    count = d.MAVLink_mission_count_message(vehicle.system, vehicle.component, len(messages), 0)
    pending, tries, repeats, sent = count, 0, 0, 0
    vehicle.send(pending)
    while True:
        answer = vehicle.wait(_ASKED, RESEND)
        if answer is None:
            tries += 1
            if tries > RETRIES:
                raise LinkError(f"{vehicle.address}: the vehicle fell silent after {sent} of {len(messages)} items")
            vehicle.send(pending)
            continue
        if getattr(answer, "mission_type", 0) != 0:
            continue
        if answer.get_type() == "MISSION_ACK":
            if answer.type != 0:
                raise LinkError(f"{vehicle.address}: the vehicle refused the mission: {_refusal(d, answer.type)}")
            if sent == len(messages):
                return
            continue
        if not 0 <= answer.seq < len(messages):
            raise LinkError(f"{vehicle.address}: the vehicle asked for item {answer.seq} of {len(messages)}")
        repeats = repeats + 1 if messages[answer.seq] is pending else 0
        if repeats > 4 * RETRIES:
            raise LinkError(f"{vehicle.address}: the vehicle keeps asking for item {answer.seq}, which was sent to it")
        tries = tries if repeats else 0
        sent, pending = max(sent, answer.seq + 1), messages[answer.seq]
        vehicle.send(pending)


def _fetch_all(vehicle: Vehicle) -> list[Any]:
    d = vehicle.dialect
    target = vehicle.system, vehicle.component
    counted = _ask(vehicle, d.MAVLink_mission_request_list_message(*target, 0), "MISSION_COUNT", None)
    found = []
    for seq in range(counted.count):
        request = d.MAVLink_mission_request_int_message(*target, seq, 0)
        found.append(_ask(vehicle, request, "MISSION_ITEM_INT", seq))
    vehicle.send(d.MAVLink_mission_ack_message(*target, 0, 0))
    return found


def _ask(vehicle: Vehicle, request: Any, name: str, seq: int | None) -> Any:
    for _ in range(RETRIES + 1):
        vehicle.send(request)
        while (answer := vehicle.wait((name, "MISSION_ACK"), RESEND)) is not None:
            if getattr(answer, "mission_type", 0) != 0:
                continue
            if answer.get_type() == "MISSION_ACK":
                if answer.type != 0:
                    problem = f"the vehicle does not give its mission: {_refusal(vehicle.dialect, answer.type)}"
                    raise LinkError(f"{vehicle.address}: {problem}")
            elif seq is None or answer.seq == seq:
                return answer
    what = "its mission" if seq is None else f"item {seq} of its mission"
    raise LinkError(f"{vehicle.address}: the vehicle does not answer when asked for {what}")


def _home(vehicle: Vehicle) -> Home | None:
    for _ in range(2):
        vehicle.send(command_long(vehicle, _REQUEST_MESSAGE, _HOME_POSITION))
        answer = vehicle.wait(("HOME_POSITION",), RESEND)
        if answer is not None:
            return Home(answer.latitude / 1e7, answer.longitude / 1e7, answer.altitude / 1e3)
    return None


def command_long(vehicle: Vehicle, number: int, *params: float) -> Any:
    """A COMMAND_LONG to a vehicle, its further parameters 0."""
    values = [float(value) for value in params] + [0.0] * (7 - len(params))
    return vehicle.dialect.MAVLink_command_long_message(vehicle.system, vehicle.component, number, 0, *values)


def _message(vehicle: Vehicle, seq: int, item: Item) -> Any:
    scale = _SCALED.get(item.frame, 1.0)
    x, y, z = (value or 0.0 for value in item.params[4:])
    whole = [max(-_LARGEST_INT, min(_LARGEST_INT, round(value * scale))) for value in (x, y)]
    numbers = [math.nan if value is None else _single(value) for value in item.params[:4]]
    head = vehicle.system, vehicle.component, seq, _INT_FRAME.get(item.frame, item.frame), item.command
    flags = int(seq == 0), int(item.autocontinue)
    return vehicle.dialect.MAVLink_mission_item_int_message(*head, *flags, *numbers, *whole, _single(z), 0)


def _item(message: Any) -> Item:
    frame = _PLAIN_FRAME.get(message.frame, message.frame)
    scale = _SCALED.get(frame, 1.0)
    params = [message.param1, message.param2, message.param3, message.param4, message.x / scale, message.y / scale]
    values = tuple(None if math.isnan(value) else float(value) for value in (*params, message.z))
    return Item(message.command, frame, values, bool(message.autocontinue), (message.seq,))


def _compare(address: Address, sent: Sequence[Any], held: Sequence[Any], *, skip_home: bool) -> tuple[str, ...]:
    """Verify the uploaded mission; return a note on parameters that the vehicle rounded or dropped."""
    if len(held) != len(sent):
        raise LinkError(f"{address}: {len(sent)} items were sent, but the vehicle holds {len(held)}; do not fly it")
    otherwise = []
    for seq, pair in list(enumerate(zip(sent, held, strict=True)))[int(skip_home) :]:
        mine, theirs = map(_item, pair)
        if not _same(mine, theirs):
            raise LinkError(f"{address}: the vehicle holds another item {seq} than was sent; do not fly this mission")
        params = zip(mine.params[:4], theirs.params[:4], strict=True)
        if not all(math.isclose(a or 0.0, b or 0.0, rel_tol=1e-5, abs_tol=1e-5) for a, b in params):
            otherwise.append(f"{seq} ({mine.name})")
    if not otherwise:
        return ()
    return (f"the vehicle keeps parameters 1 to 4 of some items otherwise, such as holds: {listing(otherwise)}",)


def _same(mine: Item, theirs: Item) -> bool:
    """Whether two items lead to the same place at the same speed, to what vehicles resolve."""
    if mine.command != theirs.command:
        return False
    if mine.command == CHANGE_SPEED:
        return math.isclose(mine.params[1] or 0.0, theirs.params[1] or 0.0, rel_tol=1e-3, abs_tol=0.01)
    if mine.command not in WAYPOINTS:
        return True
    pairs = zip(mine.params[4:], theirs.params[4:], _RESOLUTION, strict=True)
    return mine.frame == theirs.frame and all(abs((a or 0.0) - (b or 0.0)) <= most for a, b, most in pairs)


def _content(message: Any) -> bytes:
    """What an item says, without the numbering of the wire."""
    m = replace(_item(message), ids=(), raw=None)
    values = [math.nan if value is None else value for value in m.params]
    return struct.pack("<HHBB7d", message.seq, m.command, m.frame, m.autocontinue, *values)


def _refusal(dialect: Any, code: int) -> str:
    entry = dialect.enums["MAV_MISSION_RESULT"].get(code)
    if entry is None:
        return f"result {code}"
    said = entry.description.strip().rstrip(".")
    return f"{said[:1].lower()}{said[1:]} ({entry.name})"


def _single(value: float) -> float:
    return float(struct.unpack("<f", struct.pack("<f", value))[0])


ARDUPILOT = 3
"""MAV_AUTOPILOT of ArduPilot, whose mission item 0 is home."""

_SYSTEM, _COMPONENT = 255, 190
_GROUND_STATION, _NO_AUTOPILOT = 6, 8
_POLL = 0.05
_BEAT = 1.0
_CHUNK = 65536


class Vehicle:
    """A vehicle at an address, as the first heartbeat of an autopilot there tells.

    Raises:
        LinkError: If the address cannot be used, or no heartbeat comes in time.
        MissingExtra: If pymavlink is not installed.
    """

    def __init__(self, address: Address) -> None:
        self.address = address
        with needs("pymavlink", "mavlink"):
            from pymavlink.dialects.v20 import common
        self.dialect: Any = common
        self._codec = self.dialect.MAVLink(None, srcSystem=_SYSTEM, srcComponent=_COMPONENT)
        self._codec.robust_parsing = True
        self._peer: tuple[Any, ...] | None = None
        self._waiting: list[Any] = []
        self._last_beat = 0.0
        self._socket = self._connect()
        self.system = self.component = self.autopilot = self.kind = 0
        try:
            beat = self.wait(("HEARTBEAT",), address.timeout, any_sender=True)
            end = time.monotonic() + RESEND
            # A program beside the autopilot, under the same number, says that it is a generic one.
            while beat is not None and beat.autopilot == 0 and (left := end - time.monotonic()) > 0.0:
                beat = self.wait(("HEARTBEAT",), left, any_sender=True) or beat
        except BaseException:
            self.close()
            raise
        if beat is None:
            self.close()
            where = "listening at" if address.endpoint[0] in ("udp", "udpin") else "at"
            problem = f"no vehicle's heartbeat came within {address.timeout:g} s ({where} {address.target})"
            raise LinkError(f"{address}: {problem}; check address, port and that the vehicle is on")
        self.system, self.component = beat.get_srcSystem(), beat.get_srcComponent()
        self.autopilot, self.kind = int(beat.autopilot), int(beat.type)

    def now(self) -> float:
        """A clock that only goes forward [s]."""
        return time.monotonic()

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()

    def send(self, message: Any) -> None:
        """Send a message."""
        self._beat()
        self._send(message.pack(self._codec))

    def wait(self, names: tuple[str, ...], timeout: float, *, any_sender: bool = False) -> Any | None:
        """The next message of these types from the vehicle, or None on timeout."""
        end = time.monotonic() + timeout
        while True:
            while self._waiting:
                message = self._waiting.pop(0)
                if message.get_type() in names and self._counts(message, any_sender):
                    return message
            if time.monotonic() >= end:
                return None
            self._beat()
            self._receive(min(_POLL, max(end - time.monotonic(), 0.001)))

    def _counts(self, message: Any, any_sender: bool) -> bool:
        """Whether a message is from the vehicle to this side, or from any autopilot."""
        if any_sender:
            return bool(message.autopilot != _NO_AUTOPILOT and message.type != _GROUND_STATION)
        from_vehicle = message.get_srcSystem() == self.system and message.get_srcComponent() == self.component
        target = getattr(message, "target_system", _SYSTEM)
        return from_vehicle and target in (_SYSTEM, 0)

    def _connect(self) -> socket.socket:
        way, host, port = self.address.endpoint
        stream = socket.SOCK_STREAM if way == "tcp" else socket.SOCK_DGRAM
        try:
            family, kind, _, _, place = socket.getaddrinfo(host, port, type=stream)[0]
            link = socket.socket(family, kind)
        except OSError as error:
            raise LinkError(f"{self.address}: there is no host {host!r} ({reason(error)})") from None
        try:
            if way == "tcp":
                link.settimeout(self.address.timeout)
                link.connect(place)
            elif way == "udpout":
                self._peer = place
            else:
                link.bind(place)
        except OSError as error:
            link.close()
            what = "connected to" if way == "tcp" else "opened"
            raise LinkError(f"{self.address}: {host}:{port} cannot be {what}: {reason(error)}") from None
        return link

    def _send(self, data: bytes) -> None:
        try:
            if self._socket.type == socket.SOCK_STREAM:
                self._socket.sendall(data)
            elif self._peer is not None:
                self._socket.sendto(data, self._peer)
        except ConnectionRefusedError:
            # A datagram that nobody took says so at the next one; whoever is late may still come.
            return
        except OSError as error:
            raise LinkError(f"{self.address}: the connection broke: {reason(error)}") from None

    def _receive(self, timeout: float) -> None:
        self._socket.settimeout(timeout)
        try:
            data, peer = self._socket.recvfrom(_CHUNK)
        except (TimeoutError, ConnectionRefusedError):
            return
        except OSError as error:
            raise LinkError(f"{self.address}: the connection broke: {reason(error)}") from None
        if self._socket.type == socket.SOCK_STREAM:
            if not data:
                raise LinkError(f"{self.address}: the other side closed the connection")
        elif self._peer is None and data:
            self._peer = peer
        with contextlib.suppress(self.dialect.MAVError):
            parsed = self._codec.parse_buffer(data) or []
            self._waiting += [m for m in parsed if m.get_type() != "BAD_DATA"]

    def _beat(self) -> None:
        """Send a ground station's heartbeat once a second, without which some vehicles do not answer."""
        now = time.monotonic()
        if now - self._last_beat >= _BEAT:
            self._last_beat = now
            beat = self.dialect.MAVLink_heartbeat_message(_GROUND_STATION, _NO_AUTOPILOT, 0, 0, 4, 3)
            self._send(beat.pack(self._codec))
