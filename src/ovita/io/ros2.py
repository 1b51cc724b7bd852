"""ROS 2 topics, live: through rclpy where ROS 2 is installed, else over DDS without it (extra `ros`).

ROS 2 calls the DDS topic of `/plan` `rt/plan`, and the DDS type of `nav_msgs/msg/Path` `nav_msgs::msg::dds_::Path_`;
its structures are final and travel as plain CDR. What is published over DDS is reliable and transient-local, which fits
every subscriber of ROS 2, late ones too; what is read is read reliably where the publisher offers it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from ovita.errors import LinkError, MissingExtra
from ovita.io.bags import message_of, task_of
from ovita.io.documents import Choices, Kind, Task
from ovita.io.files import errors_of
from ovita.io.links import Address
from ovita.io.messages import JOINTS, TYPES, JointMotion, Maker, build_joints, listed_names
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory

Build = Callable[[Maker], tuple[str, Any]]
"""Builds the message to send, and the name of its type, with the library's maker."""

_PAUSE = 0.02
_SETTLE = 0.5
_LOOPBACK = """<CycloneDDS><Domain>
<General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>50</MaxAutoParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""


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
        data = _backend()[0](address, build)
    return data, tuple(notes)


def send_joints(address: Address, motion: JointMotion, choices: Choices) -> bytes:
    """Publish a motion of joints on a topic once a subscriber is there, to begin at once; its bytes."""
    frame_id = address.options.get("frame_id") or choices.frame_id or ""
    return _backend()[0](address, lambda maker: (JOINTS, build_joints(motion, maker, frame_id=frame_id)))


def receive(address: Address) -> Task:
    """Wait for one message with a path on a topic."""
    name, message = _backend()[1](address)
    kinds: dict[str, Kind] = {n: kind for kind, n in TYPES.items()}
    with errors_of(str(address)):
        return replace(task_of(kinds[name], message, topic=address.target), path=str(address))


def _backend() -> tuple[Callable[[Address, Build], bytes], Callable[[Address], tuple[str, Any]]]:
    """How to publish a message once a subscriber is there, and how to wait for the first one on a topic."""
    if find_spec("rclpy") is not None:
        # A ROS that is installed but not set up in this shell cannot be imported.
        with suppress(ImportError):
            import_module("rclpy")
            return publish_rclpy, subscribe_rclpy
    try:
        import_module("cyclonedds")
    except ImportError:
        raise MissingExtra("cyclonedds", "ros") from None
    return publish_dds, subscribe_dds


def _check_sent(address: Address, subscribed: object, others: Iterable[str], name: str) -> None:
    if not subscribed:
        problem = f"nobody subscribed to {address.target} in domain {address.domain} within {address.timeout:g} s"
        there = f"; those there take {listed_names(others)}, not {name}" if others else ""
        raise LinkError(f"{address}: {problem}{there}; nothing was sent")


def _check_acknowledged(address: Address, acknowledged: object) -> None:
    if not acknowledged:
        raise LinkError(f"{address}: it was sent, but not acknowledged within {address.timeout:g} s")


def _fitting(address: Address, offered: list[str], topics: Iterable[str] = ()) -> str:
    """The first type that is published on a topic and holds a path of the requested kind."""
    if not offered:
        others = f"; topics there: {listed_names(topics)}" if topics else ""
        problem = f"nobody publishes {address.target} in domain {address.domain}"
        raise LinkError(f"{address}: {problem} within {address.timeout:g} s{others}")
    wanted = [name for kind, name in TYPES.items() if address.options.get("type") in (None, kind)]
    fits = [name for name in offered if name in wanted]
    if not fits:
        raise LinkError(f"{address}: {address.target} carries {listed_names(offered)}, not {listed_names(wanted)}")
    return fits[0]


def _first(address: Address, messages: list[Any]) -> Any:
    if not messages:
        raise LinkError(f"{address}: {address.target} is there, but no message came within {address.timeout:g} s")
    return messages[0]


def _wait(ready: Callable[[], Any], timeout: float, rest: Callable[[], None] = lambda: time.sleep(_PAUSE)) -> Any:
    """Poll `ready` until it returns a true value or time is up; return its last value."""
    end = time.monotonic() + timeout
    while True:
        found = ready()
        if found or time.monotonic() > end:
            return found
        rest()


def publish_dds(address: Address, build: Build) -> bytes:
    """Publish a message over DDS and wait until it has arrived; its bytes as CDR."""
    from cyclonedds.pub import DataWriter
    from cyclonedds.topic import Topic
    from cyclonedds.util import duration

    name, message = build(Maker(lambda kind, **fields: idl_type(kind)(**fields)))
    with _participant(address) as participant:
        writer = DataWriter(participant, Topic(participant, f"rt{address.target}", type(message)), qos=_qos(True, True))
        subscribed = _wait(lambda: writer.get_matched_subscriptions(), address.timeout)
        _check_sent(address, subscribed, () if subscribed else _types(participant, address, publications=False), name)
        data = bytes(message.serialize())
        writer.write(message)
        _check_acknowledged(address, writer.wait_for_acks(duration(seconds=address.timeout)))
    return data


def subscribe_dds(address: Address) -> tuple[str, Any]:
    """The type name and the first message on a topic, over DDS."""
    end = time.monotonic() + address.timeout
    with _participant(address) as participant:
        found = _wait(lambda: _types(participant, address, publications=True), address.timeout)
        name = _fitting(address, found, () if found else _topics(participant))
        readers = _readers(participant, address.target, name)
        samples = _wait(
            lambda: [sample for reader in readers for sample in reader.take(N=1) if hasattr(sample, "header")],
            max(end - time.monotonic(), _PAUSE),
        )
    return name, _first(address, samples)


@dataclass(frozen=True)
class LiveMessage:
    """A message that came on a topic: its type, when it came [ns, on this machine's clock], and itself."""

    topic: str
    type: str
    stamp: int
    message: Any


def capture(
    address: Address,
    choose: Callable[[Mapping[str, str]], Iterable[str]],
    enough: Callable[[Sequence[LiveMessage]], bool],
) -> tuple[LiveMessage, ...]:
    """Listen to several topics over DDS until there is enough, or the address's time is up.

    Args:
        address: Its topic must be published; the rest are those that go with it.
        choose: Picks the topics to listen to from all that are published, with their types.
        enough: Whether what came so far will do.

    Raises:
        LinkError: If nobody publishes the address's topic.
        MissingExtra: If cyclonedds is not installed.
    """
    end = time.monotonic() + address.timeout
    with _participant(address) as participant:
        there = _wait(lambda: _published(participant, address.target), address.timeout)
        if not there:
            _fitting(address, [], _topics(participant))
        _wait(lambda: False, min(_SETTLE, address.timeout))  # the others become known a little later
        there = _published(participant, address.target) or there
        readers = {topic: (there[topic], _readers(participant, topic, there[topic])) for topic in choose(there)}
        came: list[LiveMessage] = []

        def more() -> bool:
            for topic, (name, several) in readers.items():
                samples = [sample for reader in several for sample in reader.take(N=10)]
                known = [sample for sample in samples if type(sample).__name__ == name.rpartition("/")[2]]
                came.extend(LiveMessage(topic, name, time.time_ns(), sample) for sample in known)
            return enough(came)

        _wait(more, max(end - time.monotonic(), _PAUSE))
    return tuple(came)


def _published(participant: Any, wanted: str) -> dict[str, str]:
    """Every topic of ROS that others publish, with the name of its type; nothing while the wanted one is not there."""
    found = _discovered(participant, True)
    topics = {e.topic_name.removeprefix("rt"): plain_type(e.type_name) for e in found if e.topic_name.startswith("rt/")}
    return topics if wanted in topics else {}


def _readers(participant: Any, topic: str, name: str) -> list[Any]:
    """A reader for each way in which a publisher may offer a topic: it must not ask for more."""
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic

    kind = Topic(participant, f"rt{topic}", idl_type(name))
    ways = ((True, True), (True, False), (False, False))
    return [DataReader(participant, kind, qos=_qos(reliable, latched)) for reliable, latched in ways]


def ros_type(name: str) -> str:
    """The DDS name of a ROS type: "nav_msgs/msg/Path" to "nav_msgs::msg::dds_::Path_"."""
    package, _, kind = name.partition("/msg/")
    return f"{package}::msg::dds_::{kind}_"


def plain_type(name: str) -> str:
    """The ROS name of a DDS type, or the name itself if it is not a ROS type."""
    package, found, kind = name.partition("::msg::dds_::")
    return f"{package}/msg/{kind.removesuffix('_')}" if found else name


@cache
def idl_type(name: str) -> Any:
    """The structure of a ROS message as cyclonedds describes it, from the definitions that rosbags brings."""
    try:
        from cyclonedds.idl import annotations, make_idl_struct, types
        from rosbags.interfaces import Nodetype
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise MissingExtra((error.name or "cyclonedds").partition(".")[0], "ros") from None
    definitions = get_typestore(Stores.ROS2_HUMBLE).fielddefs

    def kind_of(described: Any) -> Any:
        node, what = described
        if node == Nodetype.BASE:
            known = {"string": str, "bool": bool, "byte": types.uint8, "char": types.uint8}
            return known.get(what[0]) or getattr(types, what[0])
        if node == Nodetype.NAME:
            return idl_type(what)
        if node == Nodetype.ARRAY:
            fixed: Any = types.array
            return fixed[kind_of(what[0]), what[1]]
        sequence: Any = types.sequence
        return sequence[kind_of(what[0])]

    fields = {field: kind_of(described) for field, described in definitions[name][1]}
    made = make_idl_struct(name.rpartition("/")[2], ros_type(name).replace("::", "."), fields)
    return annotations.final(annotations.autoid("sequential")(made))


def _qos(reliable: bool, latched: bool) -> Any:
    from cyclonedds.core import Policy, Qos
    from cyclonedds.util import duration

    return Qos(
        Policy.Reliability.Reliable(duration(seconds=1)) if reliable else Policy.Reliability.BestEffort,
        Policy.Durability.TransientLocal if latched else Policy.Durability.Volatile,
        Policy.History.KeepLast(1),
        Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),
    )


@contextmanager
def _participant(address: Address) -> Iterator[Any]:
    """A DDS participant in the address's domain, restricted to this machine if requested."""
    try:
        from cyclonedds.core import DDSException
        from cyclonedds.domain import Domain, DomainParticipant
    except ImportError:
        raise MissingExtra("cyclonedds", "ros") from None
    try:
        domain = Domain(address.domain, _LOOPBACK) if address.local else None
        participant = DomainParticipant(address.domain)
    except DDSException as error:
        what = " ".join(str(error).split())
        raise LinkError(f"{address}: DDS cannot start here ({what}); check CYCLONEDDS_URI and the network") from None
    try:
        yield participant
    except DDSException as error:
        raise LinkError(f"{address}: DDS failed ({' '.join(str(error).split())})") from None
    finally:
        del participant, domain


def _types(participant: Any, address: Address, *, publications: bool) -> list[str]:
    """ROS names of the types that others publish on a topic, or subscribe to."""
    found = {e.type_name for e in _discovered(participant, publications) if e.topic_name == f"rt{address.target}"}
    return [plain_type(name) for name in sorted(found)]


def _topics(participant: Any) -> set[str]:
    """ROS names of the topics that others publish."""
    names = (endpoint.topic_name for endpoint in _discovered(participant, True))
    return {name.removeprefix("rt") for name in names if name.startswith("rt/")}


def _discovered(participant: Any, publications: bool) -> list[Any]:
    from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription

    kind = BuiltinTopicDcpsPublication if publications else BuiltinTopicDcpsSubscription
    endpoints = BuiltinDataReader(participant, kind).read(N=1000)
    return [e for e in endpoints if getattr(e, "topic_name", None) and e.participant_key != participant.guid]


def publish_rclpy(address: Address, build: Build) -> bytes:
    """As `publish_dds`, with ROS's own client library."""
    from rclpy.duration import Duration
    from rclpy.serialization import serialize_message

    name, message = build(Maker(lambda kind, **fields: _message_class(kind)(**fields)))
    with _node(address) as (node, spin):
        publisher = node.create_publisher(_message_class(name), address.target, _profile(latched=True))
        subscribed = _wait(lambda: publisher.get_subscription_count() > 0, address.timeout, spin)
        _check_sent(address, subscribed, (), name)
        publisher.publish(message)
        _check_acknowledged(address, publisher.wait_for_all_acked(Duration(seconds=address.timeout)))
    return bytes(serialize_message(message))


def subscribe_rclpy(address: Address) -> tuple[str, Any]:
    """As `subscribe_dds`, with ROS's own client library."""
    with _node(address) as (node, spin):

        def published() -> list[str]:
            return [
                kind for name, kinds in node.get_topic_names_and_types() if name == address.target for kind in kinds
            ]

        name = _fitting(address, _wait(published, address.timeout, spin))
        messages: list[Any] = []
        for latched in (True, False):
            node.create_subscription(_message_class(name), address.target, messages.append, _profile(latched=latched))
        _wait(lambda: messages, address.timeout, spin)
    return name, _first(address, messages)


def _message_class(name: str) -> Any:
    return import_module("rosidl_runtime_py.utilities").get_message(name)


def _profile(*, latched: bool) -> Any:
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

    durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
    return QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=durability)


@contextmanager
def _node(address: Address) -> Iterator[tuple[Any, Callable[[], None]]]:
    """A ROS node, and how to let it work while something is waited for."""
    import rclpy
    from rclpy.executors import SingleThreadedExecutor

    context = rclpy.Context()
    rclpy.init(context=context, domain_id=address.domain)
    node = rclpy.create_node("ovita", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    try:
        yield node, lambda: executor.spin_once(timeout_sec=_PAUSE)
    finally:
        executor.remove_node(node)
        node.destroy_node()
        rclpy.shutdown(context=context)
