"""ROS 2 over DDS without ROS: its names of topics and types, its wire format, and compatible quality of service.

ROS 2 calls the DDS topic of `/plan` `rt/plan`, and the DDS type of `nav_msgs/msg/Path` `nav_msgs::msg::dds_::Path_`;
its structures are final and travel as plain CDR. What is published here is reliable and transient-local, which fits
every subscriber of ROS 2, late ones too; what is read is read reliably where the publisher offers it.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from ovita.errors import LinkError, MissingExtra
from ovita.io.links.address import Address
from ovita.io.messages import TYPES, Maker, listed_names

_PAUSE = 0.02
_LOOPBACK = """<CycloneDDS><Domain>
<General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>50</MaxAutoParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""


def publish(address: Address, build: Any) -> bytes:
    """Publish a message on a topic once a subscriber is there, and wait until it has arrived.

    Args:
        address: Topic and domain.
        build: Builds the message with a maker, see `ros2.Build`.

    Returns:
        The message as CDR.

    Raises:
        LinkError: If nobody subscribes in time, or the message is not acknowledged.
    """
    from cyclonedds.pub import DataWriter
    from cyclonedds.topic import Topic
    from cyclonedds.util import duration

    name, message = build(Maker(lambda kind, **fields: idl_type(kind)(**fields)))
    with _participant(address) as participant:
        writer = DataWriter(participant, Topic(participant, f"rt{address.target}", type(message)), qos=_qos(True, True))
        if not _wait(lambda: writer.get_matched_subscriptions(), address.timeout):
            found = _endpoints(participant, address, publications=False)
            others = f"; those there take {listed_names(map(plain_type, found))}, not {name}" if found else ""
            problem = f"nobody subscribed to {address.target} in domain {address.domain} within {address.timeout:g} s"
            raise LinkError(f"{address}: {problem}{others}; nothing was sent")
        data = bytes(message.serialize())
        writer.write(message)
        if not writer.wait_for_acks(duration(seconds=address.timeout)):
            raise LinkError(f"{address}: it was sent, but not acknowledged within {address.timeout:g} s")
    return data


def subscribe(address: Address) -> tuple[str, Any]:
    """The type name and the first message on a topic.

    Raises:
        LinkError: If none comes in time, or the topic carries no path.
    """
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic

    end = time.monotonic() + address.timeout
    with _participant(address) as participant:
        wanted = address.options.get("type")
        names = {ros_type(TYPES[k]): TYPES[k] for k in TYPES if wanted in (None, k)}
        found = _wait(lambda: _endpoints(participant, address, publications=True), address.timeout)
        if not found:
            there = _topics(participant)
            others = f"; topics there: {listed_names(there)}" if there else ""
            problem = f"nobody publishes {address.target} in domain {address.domain}"
            raise LinkError(f"{address}: {problem} within {address.timeout:g} s{others}")
        fits = [names[name] for name in found if name in names]
        if not fits:
            offered = listed_names(map(plain_type, found))
            raise LinkError(f"{address}: {address.target} carries {offered}, not {listed_names(names.values())}")
        topic = Topic(participant, f"rt{address.target}", idl_type(fits[0]))
        # A reader must not ask for more than the publisher offers, which is known only after asking.
        ways = ((True, True), (True, False), (False, False))
        readers = [DataReader(participant, topic, qos=_qos(reliable, latched)) for reliable, latched in ways]
        samples = _wait(
            lambda: [sample for reader in readers for sample in reader.take(N=1) if hasattr(sample, "header")],
            max(end - time.monotonic(), _PAUSE),
        )
    if not samples:
        raise LinkError(f"{address}: {address.target} is there, but no message came within {address.timeout:g} s")
    return fits[0], samples[0]


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
        MissingExtra: If rosbags or cyclonedds is not installed.
    """
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
            return str if what[0] == "string" else getattr(types, what[0])
        if node == Nodetype.NAME:
            return idl_type(what)
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


def _endpoints(participant: Any, address: Address, *, publications: bool) -> list[str]:
    """DDS names of the types that others publish on a topic, or subscribe to."""
    return sorted(
        {e.type_name for e in _discovered(participant, publications) if e.topic_name == f"rt{address.target}"}
    )


def _topics(participant: Any) -> set[str]:
    """ROS names of the topics that others publish."""
    names = (endpoint.topic_name for endpoint in _discovered(participant, True))
    return {name.removeprefix("rt") for name in names if name.startswith("rt/")}


def _discovered(participant: Any, publications: bool) -> list[Any]:
    from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription

    kind = BuiltinTopicDcpsPublication if publications else BuiltinTopicDcpsSubscription
    endpoints = BuiltinDataReader(participant, kind).read(N=1000)
    return [e for e in endpoints if getattr(e, "topic_name", None) and e.participant_key != participant.guid]


def _wait(ready: Any, timeout: float) -> Any:
    """Poll `ready` until it returns a true value or time is up; return its last value."""
    end = time.monotonic() + timeout
    while True:
        found = ready()
        if found or time.monotonic() > end:
            return found
        time.sleep(_PAUSE)
