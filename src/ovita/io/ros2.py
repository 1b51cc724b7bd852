"""ROS 2 topics, live: paths and motions of joints sent and heard, recordings taken, topics listed.

What is published is reliable and latched (transient-local), which fits every subscriber of ROS 2, late ones too; what
is read is read as each publisher offers it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ovita.errors import LinkError
from ovita.io.bags import JOINT_PLANS, message_of, motion_of, recorded_task, task_of
from ovita.io.bus import WAYS, Bus, BusEndpoint, Take, Way, joined, wait
from ovita.io.documents import NONE, Choices, Kind, Task, listing
from ovita.io.files import errors_of
from ovita.io.links import Address
from ovita.io.messages import JOINTS, TYPES, JointMotion, Maker, TopicMessage, build_joints, listed_names
from ovita.io.recorded import JOINT_STATE, RECORDED, TRANSFORMS, StampedMessage
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory

Build = Callable[[Maker], tuple[str, Any]]
"""Builds the message to send, and the name of its type, with the library's maker."""

_SETTLE = 0.5


def send(
    address: Address, trajectory: Trajectory, scene: Scene, choices: Choices, *, start: int
) -> tuple[bytes, tuple[str, ...]]:
    """Publish a trajectory once a subscriber is there; return its bytes and notes on what is lost.

    It is stamped `start` [ns]. The address overrides the choices of topic and message; the scene keeps the fields of
    the ROS message that the trajectory was read from.

    Raises:
        LinkError: If nobody subscribes, or the message is not acknowledged.
        MissingExtra: If neither rclpy nor cyclonedds is installed.
    """
    kind = next((known for known in TYPES if known == address.options.get("type")), choices.kind)
    frame_id = address.options.get("frame_id") or choices.frame_id
    asked = replace(choices, topic=address.target, kind=kind, frame_id=frame_id)
    notes: list[str] = []

    def build(maker: Maker) -> tuple[str, Any]:
        _, chosen, message, said = message_of(trajectory, scene, asked, maker, start=start)
        notes.extend(said)
        return TYPES[chosen], message

    with errors_of(str(address)):
        data = publish(address, build)
    return data, tuple(notes)


def send_joints(address: Address, motion: JointMotion, choices: Choices) -> bytes:
    """Publish a motion of joints on a topic once a subscriber is there, to begin at once; its bytes."""
    frame_id = address.options.get("frame_id") or choices.frame_id or ""
    return publish(address, lambda maker: (JOINTS, build_joints(motion, maker, frame_id=frame_id)))


def publish(address: Address, build: Build) -> bytes:
    """Publish a message once a subscriber is there, and wait until it has arrived; its bytes as CDR."""
    with joined(address) as bus:
        name, message = build(bus.maker)
        publisher = bus.publisher(address.target, name)
        if not wait(publisher.matched, address.timeout, bus.rest):
            others = _types(bus.others(publishing=False), address.target)
            problem = f"nobody subscribed to {address.target} in domain {address.domain} within {address.timeout:g} s"
            there = f"; those there take {listed_names(others)}, not {name}" if others else ""
            raise LinkError(f"{address}: {problem}{there}; nothing was sent")
        data = publisher.write(message)
        if not publisher.acknowledged(address.timeout):
            raise LinkError(f"{address}: it was sent, but not acknowledged within {address.timeout:g} s")
    return data


def receive(address: Address, choices: Choices) -> Task:
    """Wait for one message with a path on a topic, or record what a robot says of its pose there.

    The address's option `for` says how many seconds are recorded; 10 where it does not.
    """
    wanted = [name for kind, name in TYPES.items() if address.options.get("type") in (None, kind)]
    if "type" not in address.options:
        wanted += RECORDED
    name, came = _heard(address, wanted, RECORDED)
    kinds: dict[str, Kind] = {n: kind for kind, n in TYPES.items()}
    with errors_of(str(address)):
        if name in RECORDED:
            task = recorded_task(name, came, choices, topic=address.target)
        else:
            task = task_of(kinds[name], came[0].message, choices, topic=address.target)
    return replace(task, path=str(address))


def receive_joints(address: Address, choices: Choices = NONE) -> tuple[JointMotion, tuple[str, ...]]:
    """Wait for a motion of joints on a topic, a JointTrajectory or a plan of MoveIt, or record the joints' states."""
    name, came = _heard(address, [*JOINT_PLANS, JOINT_STATE], [JOINT_STATE])
    with errors_of(str(address)):
        return motion_of(name, came, choices)


def _heard(address: Address, wanted: Sequence[str], series: Sequence[str]) -> tuple[str, list[StampedMessage]]:
    """What comes on a topic: one message, or all of a while where its type is recorded as a series."""
    with joined(address) as bus:
        there = wait(lambda: _on(bus, address.target), address.timeout, bus.rest)
        name = _fitting(address, _types(there, address.target), wanted, bus)
        fixed = {e.topic for e in bus.others(publishing=True) if e.topic.endswith("tf_static")}
        others = sorted(fixed) if name in TRANSFORMS else ()
        takes = [_reader(bus, address.target, name), *(_reader(bus, topic, name) for topic in others)]
        came = list[StampedMessage]()

        def more() -> bool:
            came.extend(StampedMessage(time.time_ns(), message) for take in takes for message in take())
            return bool(came)

        if not wait(more, address.timeout, bus.rest):
            raise LinkError(f"{address}: {address.target} is there, but no message came within {address.timeout:g} s")
        if name in series:
            wait(lambda: more() and False, address.recording, bus.rest)
    return name, came


def _on(bus: Bus, topic: str) -> list[BusEndpoint]:
    return [endpoint for endpoint in bus.others(publishing=True) if endpoint.topic == topic]


def _types(endpoints: Iterable[BusEndpoint], topic: str) -> list[str]:
    return sorted({endpoint.type for endpoint in endpoints if endpoint.topic == topic})


def _reader(bus: Bus, topic: str, kind: str) -> Take:
    """Hear a topic in the ways in which it is offered now; latched but not reliable is heard as if it were neither."""
    ways = {endpoint.way if endpoint.way in WAYS else (False, False) for endpoint in _on(bus, topic)}
    return bus.subscribe(topic, kind, sorted(ways) or WAYS)


def _fitting(address: Address, offered: Sequence[str], wanted: Sequence[str], bus: Bus) -> str:
    """The first type that is published on a topic and holds what is wanted."""
    if not offered:
        topics = {endpoint.topic for endpoint in bus.others(publishing=True)}
        others = f"; topics there: {listed_names(topics)}" if topics else ""
        problem = f"nobody publishes {address.target} in domain {address.domain}"
        raise LinkError(f"{address}: {problem} within {address.timeout:g} s{others}")
    fits = [name for name in offered if name in wanted]
    if not fits:
        raise LinkError(f"{address}: {address.target} carries {listed_names(offered)}, not {listed_names(wanted)}")
    return fits[0]


def capture(
    address: Address,
    choose: Callable[[Mapping[str, str]], Iterable[str]],
    enough: Callable[[Sequence[TopicMessage]], bool],
) -> tuple[TopicMessage, ...]:
    """Listen to several topics until there is enough, or the address's time is up.

    The address's topic must be published; `choose` picks the topics to listen to from all that are, with their types,
    and `enough` says whether what came so far will do.

    Raises:
        LinkError: If nobody publishes the address's topic.
        MissingExtra: If neither rclpy nor cyclonedds is installed.
    """
    end = time.monotonic() + address.timeout
    with joined(address) as bus:
        if not wait(lambda: _on(bus, address.target), address.timeout, bus.rest):
            _fitting(address, [], [], bus)
        wait(lambda: False, min(_SETTLE, address.timeout), bus.rest)  # the others become known a little later
        there = {endpoint.topic: endpoint.type for endpoint in bus.others(publishing=True)}
        takes = {topic: (there[topic], _reader(bus, topic, there[topic])) for topic in choose(there)}
        came: list[TopicMessage] = []

        def more() -> bool:
            for topic, (name, take) in takes.items():
                came.extend(TopicMessage(topic, name, message, time.time_ns()) for message in take())
            return enough(came)

        wait(more, max(end - time.monotonic(), 0.0), bus.rest)
    return tuple(came)


@dataclass(frozen=True)
class TopicRow:
    """A topic as a list shows it: its types, how many publish and subscribe, and how it is offered."""

    topic: str
    types: tuple[str, ...]
    publishers: int
    subscribers: int
    offered: str


def topics(address: Address) -> list[TopicRow]:
    """Every topic that others publish or subscribe to, after a look of the address's timeout."""
    with joined(address) as bus:
        wait(lambda: False, address.timeout, bus.rest)
        published, heard = bus.others(publishing=True), bus.others(publishing=False)

    def row(name: str) -> TopicRow:
        offers, asks = ([e for e in there if e.topic == name] for there in (published, heard))
        ways = listing(sorted({_words(e.way) for e in offers}))
        return TopicRow(name, tuple(_types([*offers, *asks], name)), len(offers), len(asks), ways)

    return [row(name) for name in sorted({endpoint.topic for endpoint in (*published, *heard)})]


def _words(way: Way) -> str:
    return ("reliable" if way[0] else "best effort") + (" and latched" if way[1] else "")


def echoed(address: Address, count: int) -> Iterator[dict[str, Any]]:
    """Messages on a topic of any known type, as plain data, until there are that many or the time is up between two."""
    with joined(address) as bus:
        there = wait(lambda: _on(bus, address.target), address.timeout, bus.rest)
        offered = _types(there, address.target)
        take = _reader(bus, address.target, _fitting(address, offered, offered, bus))
        given = 0
        while given < count:
            came = wait(take, address.timeout, bus.rest)
            if not came:
                raise LinkError(f"{address}: no message came within {address.timeout:g} s")
            for message in came[: count - given]:
                given += 1
                yield plain_message(message)


def plain_message(value: Any) -> Any:
    """A message of any library as dicts, lists and scalars."""
    if isinstance(value, str | int | float | None):
        return value
    if hasattr(value, "tolist"):
        return value.tolist()
    if hasattr(value, "__iter__"):
        return [plain_message(item) for item in value]
    described = hasattr(value, "get_fields_and_field_types")
    names = value.get_fields_and_field_types() if described else vars(value)
    shown = [name for name in names if not name.startswith("_") and name != "sample_info"]
    return {name: plain_message(getattr(value, name)) for name in shown}
