"""The two ways onto ROS 2's bus, behind one face: ROS's own client library rclpy, and plain DDS (extra `ros`).

ROS 2 calls the DDS topic of `/plan` `rt/plan`, and the DDS type of `nav_msgs/msg/Path` `nav_msgs::msg::dds_::Path_`;
its structures are final and travel as plain CDR. A *way* is a quality of service: (reliable, latched), latched being
DDS's transient-local, which gives late subscribers the last message.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from typing import Any, TypeAlias

import numpy as np

from ovita.errors import LinkError, needs
from ovita.io.links import Address
from ovita.io.messages import Maker, typestore

Way = tuple[bool, bool]
"""A quality of service: whether it is reliable, and whether it is latched."""

WAYS: tuple[Way, ...] = ((True, True), (True, False), (False, False))
"""All there are in ROS; a reader of each hears every publisher."""

PAUSE = 0.02
"""Between two looks at the bus [s]."""

_DEPTH = 5000
_REMEMBERED = 20_000

# eProsima's vendor number; from Kilted on, Fast DDS describes types in a way that Cyclone DDS takes for damaged, so
# that neither hears the other. Without the descriptions the names of the types decide, as in every earlier release.
_COMPATIBLE = "<Compatibility><IgnoreTypeInformation>1.15</IgnoreTypeInformation></Compatibility>"
_LOOPBACK = """<General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>50</MaxAutoParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery>"""


@dataclass(frozen=True)
class BusEndpoint:
    """A publisher or subscriber of somebody else: its topic, the type of its messages, and its way."""

    topic: str
    type: str
    way: Way


@dataclass(frozen=True, eq=False)
class Publisher:
    """Publishes on one topic, reliably.

    Args:
        matched: How many subscribe.
        write: Publishes a message; its bytes as CDR.
        acknowledged: Waits until every subscriber has what was written, at most so many seconds.
    """

    matched: Callable[[], int]
    write: Callable[[Any], bytes]
    acknowledged: Callable[[float], bool]


Take = Callable[[], list[Any]]
"""Gives the messages that came since it was last called, each once, oldest first."""


def wait(ready: Callable[[], Any], timeout: float, rest: Callable[[], None]) -> Any:
    """Poll `ready` until it returns a true value or time is up; return its last value."""
    end = time.monotonic() + timeout
    while True:
        found = ready()
        if found or time.monotonic() > end:
            return found
        rest()


@contextmanager
def joined(address: Address) -> Iterator[Bus]:
    """The bus of an address's domain: through rclpy where it is installed and set up, else over DDS.

    Raises:
        LinkError: If it cannot be joined.
        MissingExtra: If neither rclpy nor cyclonedds is installed.
    """
    if has_rclpy():
        with ros_node(address) as (node, spin):
            yield _RclpyBus(node, spin)
    else:
        with dds_bus(address) as bus:
            yield bus


def has_rclpy() -> bool:
    """Whether rclpy is there; a ROS that is installed but not set up in this shell cannot be imported."""
    if find_spec("rclpy") is None:
        return False
    with suppress(ImportError):
        import_module("rclpy")
        return True
    return False


class _Heard:
    """Messages of several readers of one topic; what more than one of them hears counts once."""

    def __init__(self) -> None:
        self._known: dict[Any, None] = {}
        self._came: list[tuple[int, Any]] = []

    def add(self, source: Any, stamp: int, message: Any) -> None:
        if (source, stamp) in self._known:
            return
        self._known[source, stamp] = None
        if len(self._known) > _REMEMBERED:
            del self._known[next(iter(self._known))]
        self._came.append((stamp, message))

    def take(self) -> list[Any]:
        came, self._came = sorted(self._came, key=lambda pair: pair[0]), []
        return [message for _, message in came]


# Over DDS


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
    """The structure of a ROS message as cyclonedds describes it, from the definitions that rosbags brings.

    Raises:
        LinkError: If there is no definition of it.
    """
    definitions = typestore().fielddefs
    with needs("cyclonedds", "ros"):
        from cyclonedds.idl import annotations, make_idl_struct, types
    from rosbags.interfaces import Nodetype

    if name not in definitions:
        hint = "set up ROS 2 in this shell, so that rclpy is used"
        raise LinkError(f"messages of type {name} are not known here; {hint}")

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


def _qos(way: Way, depth: int) -> Any:
    from cyclonedds.core import Policy, Qos
    from cyclonedds.util import duration

    reliable, latched = way
    return Qos(
        Policy.Reliability.Reliable(duration(seconds=1)) if reliable else Policy.Reliability.BestEffort,
        Policy.Durability.TransientLocal if latched else Policy.Durability.Volatile,
        Policy.History.KeepLast(depth),
        Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),
    )


@contextmanager
def dds_bus(address: Address) -> Iterator[Bus]:
    """The bus over DDS, restricted to this machine if the address asks for that."""
    with needs("cyclonedds", "ros"):
        import_module("cyclonedds")
        from cyclonedds.core import DDSException
        from cyclonedds.domain import Domain, DomainParticipant
    own = "" if address.local else os.environ.get("CYCLONEDDS_URI", "")
    more = f"<CycloneDDS><Domain>{_LOOPBACK if address.local else ''}{_COMPATIBLE}</Domain></CycloneDDS>"
    try:
        domain = Domain(address.domain, f"{own},{more}" if own else more)
        participant = DomainParticipant(address.domain)
    except DDSException as error:
        what = " ".join(str(error).split())
        raise LinkError(f"{address}: DDS cannot start here ({what}); check CYCLONEDDS_URI and the network") from None
    try:
        yield _DdsBus(participant)
    except DDSException as error:
        raise LinkError(f"{address}: DDS failed ({' '.join(str(error).split())})") from None
    finally:
        del participant, domain


class _DdsBus:
    def __init__(self, participant: Any) -> None:
        self._participant = participant
        self.maker = Maker(lambda kind, /, **fields: idl_type(kind)(**fields))

    def others(self, *, publishing: bool) -> list[BusEndpoint]:
        from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
        from cyclonedds.core import Policy

        def endpoint(e: Any) -> BusEndpoint:
            reliable = isinstance(e.qos[Policy.Reliability], Policy.Reliability.Reliable)
            way = reliable, e.qos[Policy.Durability] != Policy.Durability.Volatile
            return BusEndpoint(e.topic_name.removeprefix("rt"), plain_type(e.type_name), way)

        kind = BuiltinTopicDcpsPublication if publishing else BuiltinTopicDcpsSubscription
        there = BuiltinDataReader(self._participant, kind).read(N=5000)
        topics = [e for e in there if (getattr(e, "topic_name", None) or "").startswith("rt/")]
        return [endpoint(e) for e in topics if e.participant_key != self._participant.guid]

    def publisher(self, topic: str, kind: str, *, latched: bool = True) -> Publisher:
        from cyclonedds.pub import DataWriter
        from cyclonedds.util import duration

        writer = DataWriter(self._participant, self._topic(topic, kind), qos=_qos((True, latched), 1))

        def write(message: Any) -> bytes:
            writer.write(message)
            return bytes(message.serialize())

        def acknowledged(timeout: float) -> bool:
            return bool(writer.wait_for_acks(duration(seconds=timeout)))

        return Publisher(lambda: len(writer.get_matched_subscriptions()), write, acknowledged)

    def subscribe(self, topic: str, kind: str, ways: Iterable[Way] = WAYS) -> Take:
        from cyclonedds.sub import DataReader

        described = self._topic(topic, kind)
        readers = [DataReader(self._participant, described, qos=_qos(way, _DEPTH)) for way in ways]
        heard = _Heard()

        def take() -> list[Any]:
            for reader in readers:
                for sample in reader.take(N=_DEPTH):
                    info = sample.sample_info
                    if info.valid_data:
                        heard.add(info.publication_handle, info.source_timestamp, sample)
            return heard.take()

        return take

    def offer(self, name: str, action: Callable[[], tuple[bool, str]]) -> bool:
        return False

    def rest(self) -> None:
        time.sleep(PAUSE)

    def _topic(self, topic: str, kind: str) -> Any:
        from cyclonedds.topic import Topic

        return Topic(self._participant, f"rt{topic}", idl_type(kind))


# Through rclpy


def message_class(name: str) -> Any:
    """ROS's class of a message, service or action, such as nav_msgs/msg/Path.

    Raises:
        LinkError: If its package is not installed.
    """
    package, part, kind = name.split("/")
    try:
        return getattr(import_module(f"{package}.{part}"), kind)
    except (ImportError, AttributeError):
        raise LinkError(f"{name} is not installed beside rclpy; install the ROS package {package}") from None


@contextmanager
def ros_node(address: Address) -> Iterator[tuple[Any, Callable[[], None]]]:
    """A ROS node, and how to let it work while something is waited for."""
    import rclpy
    from rclpy.executors import SingleThreadedExecutor

    context = rclpy.Context()
    with _local_only(address):
        rclpy.init(context=context, domain_id=address.domain)
        node = rclpy.create_node("ovita", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    try:
        yield node, lambda: executor.spin_once(timeout_sec=PAUSE)
    finally:
        executor.remove_node(node)
        node.destroy_node()
        rclpy.shutdown(context=context)


@contextmanager
def _local_only(address: Address) -> Iterator[None]:
    """ROS's own variable for traffic on this machine alone, while a node is made, if the address asks for that."""
    variable = "ROS_AUTOMATIC_DISCOVERY_RANGE"
    before = {variable: os.environ[variable]} if variable in os.environ else {}
    if address.local:
        os.environ[variable] = "LOCALHOST"
    try:
        yield
    finally:
        os.environ.pop(variable, None)
        os.environ.update(before)


def _profile(way: Way, depth: int) -> Any:
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

    reliable, latched = way
    return QoSProfile(
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


class _RclpyBus:
    def __init__(self, node: Any, spin: Callable[[], None]) -> None:
        self.node, self.rest = node, spin
        self.maker = Maker(lambda kind, /, **fields: message_class(kind)(**fields), floats=np.ndarray.tolist)

    def others(self, *, publishing: bool) -> list[BusEndpoint]:
        from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

        def way(qos: Any) -> Way:
            reliable, latched = ReliabilityPolicy.RELIABLE, DurabilityPolicy.TRANSIENT_LOCAL
            return qos.reliability == reliable, qos.durability == latched

        ask = self.node.get_publishers_info_by_topic if publishing else self.node.get_subscriptions_info_by_topic
        there = [(topic, info) for topic, _ in self.node.get_topic_names_and_types() for info in ask(topic)]
        others = [(topic, info) for topic, info in there if info.node_name != self.node.get_name()]
        return [BusEndpoint(topic, info.topic_type, way(info.qos_profile)) for topic, info in others]

    def publisher(self, topic: str, kind: str, *, latched: bool = True) -> Publisher:
        from rclpy.duration import Duration
        from rclpy.serialization import serialize_message

        publisher = self.node.create_publisher(message_class(kind), topic, _profile((True, latched), 1))

        def write(message: Any) -> bytes:
            publisher.publish(message)
            return bytes(serialize_message(message))

        def acknowledged(timeout: float) -> bool:
            return bool(publisher.wait_for_all_acked(Duration(seconds=timeout)))

        return Publisher(lambda: int(publisher.get_subscription_count()), write, acknowledged)

    def subscribe(self, topic: str, kind: str, ways: Iterable[Way] = WAYS) -> Take:
        heard = _Heard()

        def came(message: Any, info: Any) -> None:
            heard.add(None, info["source_timestamp"], message)

        for way in ways:
            self.node.create_subscription(message_class(kind), topic, came, _profile(way, _DEPTH))
        return heard.take

    def offer(self, name: str, action: Callable[[], tuple[bool, str]]) -> bool:
        def answer(_: Any, response: Any) -> Any:
            response.success, response.message = action()
            return response

        self.node.create_service(message_class("std_srvs/srv/Trigger"), name, answer)
        return True


Bus: TypeAlias = _DdsBus | _RclpyBus
"""A participant on ROS 2's bus.

Its `maker` builds messages; `others` is what others publish or subscribe to; `publisher` and `subscribe` name a topic,
a type and ways; `offer` offers a std_srvs/Trigger, and says whether this bus has services; `rest` lets it work.
"""
