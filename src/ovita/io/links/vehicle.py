"""The wire to a MAVLink vehicle: datagrams or a stream, heartbeats both ways, and messages of the common set."""

from __future__ import annotations

import contextlib
import socket
import time
from collections.abc import Iterator
from typing import Any

from ovita.errors import LinkError, MissingExtra
from ovita.io.links.address import Address

ARDUPILOT = 3
"""MAV_AUTOPILOT of ArduPilot, whose mission item 0 is home."""

_SYSTEM, _COMPONENT = 255, 190
_GROUND_STATION, _NO_AUTOPILOT = 6, 8
_AUTOPILOT_COMPONENT = 1
_POLL = 0.05
_BEAT = 1.0
_CHUNK = 65536


class Vehicle:
    """A vehicle at an address, as the first heartbeat of an autopilot there tells.

    Args:
        address: Where it is, and how long to wait for it.

    Raises:
        LinkError: If the address cannot be used, or no heartbeat comes in time.
        MissingExtra: If pymavlink is not installed.
    """

    def __init__(self, address: Address) -> None:
        self.address = address
        self.dialect = _dialect()
        self._codec = self.dialect.MAVLink(None, srcSystem=_SYSTEM, srcComponent=_COMPONENT)
        self._codec.robust_parsing = True
        self._peer: tuple[Any, ...] | None = None
        self._waiting: list[Any] = []
        self._last_beat = 0.0
        self._socket = self._connect()
        self.system = self.component = self.autopilot = 0
        try:
            beat = self.wait(("HEARTBEAT",), address.timeout, any_sender=True)
        except BaseException:
            self.close()
            raise
        if beat is None:
            self.close()
            where = "listening at" if address.endpoint[0] in ("udp", "udpin") else "at"
            problem = f"no vehicle's heartbeat came within {address.timeout:g} s ({where} {address.target})"
            raise LinkError(f"{address}: {problem}; check address, port and that the vehicle is on")
        self.system, self.component = beat.get_srcSystem(), beat.get_srcComponent()
        self.autopilot = int(beat.autopilot)

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()

    def send(self, message: Any) -> None:
        """Send a message.

        Raises:
            LinkError: If the connection is gone.
        """
        self._beat()
        self._send(message.pack(self._codec))

    def wait(self, names: tuple[str, ...], timeout: float, *, any_sender: bool = False) -> Any | None:
        """The next message of these names from the vehicle, or None if none comes in time.

        Raises:
            LinkError: If the connection is gone.
        """
        end = time.monotonic() + timeout
        while True:
            while self._waiting:
                message = self._waiting.pop(0)
                if message.get_type() in names and (self._is_autopilot(message) if any_sender else self._mine(message)):
                    return message
            if time.monotonic() >= end:
                return None
            self._beat()
            self._receive(min(_POLL, max(end - time.monotonic(), 0.001)))

    def _is_autopilot(self, message: Any) -> bool:
        return bool(message.autopilot != _NO_AUTOPILOT and message.type != _GROUND_STATION)

    def _mine(self, message: Any) -> bool:
        from_vehicle = message.get_srcSystem() == self.system and message.get_srcComponent() == self.component
        target = getattr(message, "target_system", _SYSTEM)
        return from_vehicle and target in (_SYSTEM, 0)

    def _connect(self) -> socket.socket:
        way, host, port = self.address.endpoint
        try:
            family, kind, _, _, place = socket.getaddrinfo(
                host, port, type=socket.SOCK_STREAM if way == "tcp" else socket.SOCK_DGRAM
            )[0]
            link = socket.socket(family, kind)
        except OSError as error:
            raise LinkError(f"{self.address}: there is no host {host!r} ({_reason(error)})") from None
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
            raise LinkError(f"{self.address}: {host}:{port} cannot be {what}: {_reason(error)}") from None
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
            raise LinkError(f"{self.address}: the connection broke: {_reason(error)}") from None

    def _receive(self, timeout: float) -> None:
        self._socket.settimeout(timeout)
        try:
            data, peer = self._socket.recvfrom(_CHUNK)
        except (TimeoutError, ConnectionRefusedError):
            return
        except OSError as error:
            raise LinkError(f"{self.address}: the connection broke: {_reason(error)}") from None
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


@contextlib.contextmanager
def vehicle_at(address: Address) -> Iterator[Vehicle]:
    """The vehicle at an address, for the time of a block.

    Raises:
        LinkError: If there is none.
        MissingExtra: If pymavlink is not installed.
    """
    vehicle = Vehicle(address)
    try:
        yield vehicle
    finally:
        vehicle.close()


def _dialect() -> Any:
    try:
        from pymavlink.dialects.v20 import common
    except ImportError:
        raise MissingExtra("pymavlink", "mavlink") from None
    return common


def _reason(error: OSError) -> str:
    text = error.strerror or str(error) or type(error).__name__
    return text[:1].lower() + text[1:]
