"""Live links to robots: ROS 2 topics over DDS, and MAVLink vehicles, by their addresses.

ros2:/TOPIC[?domain=N&type=path|poses|multidof&frame_id=NAME&local=1&timeout=SECONDS&for=SECONDS]
mavlink:udp:HOST:PORT[?type=mission|setpoints&rate=HZ&end=hold|land&timeout=SECONDS]
                                               also udpin (the same: listen), udpout and tcp (connect)
"""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from urllib.parse import parse_qsl

from ovita.errors import RequestError
from ovita.io import Choices, Task, atomic_write, bags, rendered
from ovita.io.documents import NONE, listing
from ovita.io.files import is_address
from ovita.io.messages import JointMotion
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.text import listed

_OPTIONS: Mapping[str, tuple[str, ...]] = {
    "ros2": ("domain", "type", "frame_id", "local", "timeout", "for"),
    "mavlink": ("type", "rate", "end", "timeout"),
}
_VALUES: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "ros2": {"type": ("path", "poses", "multidof")},
    "mavlink": {"type": ("mission", "setpoints"), "end": ("hold", "land")},
}
_TOPIC = re.compile(r"/[A-Za-z_~{][A-Za-z0-9_/~{}]*")
_DOMAINS = 232
_WAYS = ("udp", "udpin", "udpout", "tcp")
TIMEOUT = 10.0
"""Longest wait for the other side where nothing is said [s]."""

RATE = 20.0
"""Setpoints a second where nothing is said."""


@dataclass(frozen=True)
class Address:
    """Where on a bus a trajectory comes from or goes to.

    Args:
        bus: "ros2" or "mavlink".
        target: A topic, or WAY:HOST:PORT.
        options: What follows the question mark.

    Raises:
        RequestError: If a part of it makes no sense.
    """

    bus: str
    target: str
    options: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        unknown = [key for key in self.options if key not in _OPTIONS[self.bus]]
        if unknown:
            raise RequestError(f"{self}: unknown option {unknown[0]!r}; known are {listing(_OPTIONS[self.bus])}")
        on_ros = self.bus == "ros2"
        if on_ros and (not _TOPIC.fullmatch(self.target) or self.target.endswith("/") or "//" in self.target):
            raise RequestError(f"{self}: {self.target!r} is no topic; write it as ros2:/name")
        for key, known in _VALUES[self.bus].items():
            if self.options.get(key, known[0]) not in known:
                raise RequestError(f"{self}: the {key} is {listed(known, 'or')}")
        _ = self.domain if on_ros else (self.endpoint, self.rate)
        _ = self.timeout, self.recording

    @classmethod
    def parse(cls, text: str) -> Address:
        """An address from its text."""
        bus, _, rest = text.partition(":")
        target, _, query = rest.partition("?")
        if not is_address(text):
            raise RequestError(f"{text!r} is no address; write ros2:/topic or mavlink:udp:HOST:PORT")
        pairs = parse_qsl(query, keep_blank_values=True)
        if query and len(dict(pairs)) != query.count("&") + 1:
            raise RequestError(f"{text!r}: options are written ?name=value&name=value, each once")
        return cls(bus, target, dict(pairs))

    def __str__(self) -> str:
        query = "&".join(f"{key}={value}" for key, value in self.options.items())
        return f"{self.bus}:{self.target}" + (f"?{query}" if query else "")

    @property
    def domain(self) -> int:
        """The DDS domain: the option, else ROS_DOMAIN_ID, else 0."""
        text = self.options.get("domain", os.environ.get("ROS_DOMAIN_ID") or "0")
        if not text.isdecimal() or int(text) > _DOMAINS:
            raise RequestError(f"{self}: the domain {text!r} is not a whole number 0..{_DOMAINS}")
        return int(text)

    @property
    def local(self) -> bool:
        """Whether ROS 2 traffic must stay on this machine: the option, else ROS's own environment variables."""
        if "local" in self.options:
            return self.options["local"] not in ("0", "no", "false", "")
        alone = os.environ.get("ROS_LOCALHOST_ONLY") == "1"
        return alone or os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper() == "LOCALHOST"

    @property
    def timeout(self) -> float:
        """Longest wait for the other side [s]."""
        return self._number("timeout", TIMEOUT, 0.0, 86400.0, "a time > 0 in seconds")

    @property
    def recording(self) -> float:
        """How long is recorded what a robot says of its pose or joints [s]."""
        return self._number("for", TIMEOUT, 0.0, 86400.0, "a time > 0 in seconds")

    @property
    def rate(self) -> float:
        """Setpoints a second; PX4 wants more than 2."""
        return self._number("rate", RATE, 4.0, 100.0, "a number of setpoints a second, from 4 to 100")

    def _number(self, key: str, default: float, least: float, most: float, what: str) -> float:
        text = self.options.get(key, str(default))
        try:
            value = float(text)
        except ValueError:
            value = -1.0
        if not (0 < value and least <= value <= most):
            raise RequestError(f"{self}: the {key} {text!r} is not {what}")
        return value

    @property
    def endpoint(self) -> tuple[str, str, int]:
        """Way, host and port of a MAVLink address."""
        way, _, rest = self.target.partition(":")
        host, _, port = rest.rpartition(":")
        if way not in _WAYS or not host or not port.isdecimal() or not 0 < int(port) < 65536:
            wanted = f"WAY:HOST:PORT with one of {', '.join(_WAYS)}, such as udp:127.0.0.1:14550"
            raise RequestError(f"{self}: {self.target!r} is not {wanted}")
        return way, host.strip("[]"), int(port)


@dataclass(frozen=True)
class Receipt:
    """What was delivered: the SHA-256 and the number of its bytes, and notes for a person."""

    sha256: str
    size: int
    notes: tuple[str, ...] = ()

    @classmethod
    def of(cls, data: bytes, notes: tuple[str, ...] = ()) -> Receipt:
        """Of what was delivered."""
        return cls(sha256(data).hexdigest(), len(data), notes)


def receive(address: Address, choices: Choices = NONE) -> Task:
    """Read one trajectory from a live link."""
    if address.bus == "ros2":
        from ovita.io import ros2

        return ros2.receive(address, choices)
    from ovita.io import mavlink

    return mavlink.download(address, choices.home, choices.heading)


def deliver(
    place: str,
    trajectory: Trajectory,
    scene: Scene,
    *,
    instruction: str = "",
    choices: Choices = NONE,
    verdict: str = "",
    robot: Robot | None = None,
) -> Receipt:
    """Send a trajectory to an address, or write it to a file; a `robot` is needed to fly setpoints."""
    if not is_address(place):
        content, notes = rendered(place, trajectory, scene, instruction, choices=choices, verdict=verdict)
        atomic_write(place, content)
        return Receipt.of(content.encode() if isinstance(content, str) else content, notes)
    address = Address.parse(place)
    if address.bus == "ros2":
        from ovita.io import ros2

        data, notes = ros2.send(address, trajectory, scene, choices, start=time.time_ns())
    elif address.options.get("type") == "setpoints":
        from ovita.io import setpoints

        if robot is None:
            raise RequestError(f"{place}: setpoints are flown only within the limits of a robot")
        data, notes = setpoints.fly(address, trajectory, scene, robot, choices)
    else:
        from ovita.io import mavlink

        data, notes = mavlink.upload(address, trajectory, scene, choices)
    return Receipt.of(data, notes)


def deliver_joints(
    place: str, motion: JointMotion, choices: Choices = NONE, told: Callable[[str], None] | None = None
) -> Receipt:
    """Send a motion of joints to a controller's action or topic in ROS 2, or write it to a bag.

    A name that ends in follow_joint_trajectory is an action, which is waited for; `told` hears how far it is.
    """
    if not is_address(place):
        data = bags.dumps_joints(place, motion, choices)
        atomic_write(place, data)
        return Receipt.of(data)
    address = Address.parse(place)
    if address.bus != "ros2":
        raise RequestError(f"{place}: motions of joints go to ROS 2 topics or bags only")
    from ovita.io import controllers, ros2

    if address.target.endswith("follow_joint_trajectory"):
        frame_id = address.options.get("frame_id") or choices.frame_id or ""
        data = controllers.follow(address, motion, told, frame_id)
    else:
        data = ros2.send_joints(address, motion, choices)
    return Receipt.of(data)
