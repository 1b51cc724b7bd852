"""ROS 2 topics through rclpy, where ROS 2 is installed; the same as `ros2_dds`, with ROS's own client library."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from ovita.errors import LinkError
from ovita.io.links.address import Address
from ovita.io.messages import TYPES, Maker, listed_names

_PAUSE = 0.05


def publish(address: Address, build: Any) -> bytes:
    """As `ros2_dds.publish`."""
    from rclpy.duration import Duration
    from rclpy.serialization import serialize_message

    name, message = build(Maker(lambda kind, **fields: _message_class(kind)(**fields)))
    with _node(address) as node:
        publisher = node.create_publisher(_message_class(name), address.target, _profile(latched=True))
        if not _wait(node, lambda: publisher.get_subscription_count() > 0, address.timeout):
            problem = f"nobody subscribed to {address.target} in domain {address.domain} within {address.timeout:g} s"
            raise LinkError(f"{address}: {problem}; nothing was sent")
        publisher.publish(message)
        if not publisher.wait_for_all_acked(Duration(seconds=address.timeout)):
            raise LinkError(f"{address}: it was sent, but not acknowledged within {address.timeout:g} s")
    return bytes(serialize_message(message))


def subscribe(address: Address) -> tuple[str, Any]:
    """As `ros2_dds.subscribe`."""
    with _node(address) as node:
        offered: list[str] = []

        def published() -> bool:
            offered[:] = [
                kind for topic, kinds in node.get_topic_names_and_types() if topic == address.target for kind in kinds
            ]
            return bool(offered)

        _wait(node, published, address.timeout)
        wanted = address.options.get("type")
        fits = [name for kind, name in TYPES.items() if name in offered and wanted in (None, kind)]
        if not offered:
            problem = f"nobody publishes {address.target} in domain {address.domain}"
            raise LinkError(f"{address}: {problem} within {address.timeout:g} s")
        if not fits:
            raise LinkError(f"{address}: {address.target} carries {listed_names(offered)}, which is no path that fits")
        messages: list[Any] = []
        for latched in (True, False):
            profile = _profile(latched=latched)
            node.create_subscription(_message_class(fits[0]), address.target, messages.append, profile)
        if not _wait(node, lambda: bool(messages), address.timeout):
            raise LinkError(f"{address}: {address.target} is there, but no message came within {address.timeout:g} s")
    return fits[0], messages[0]


def _message_class(name: str) -> Any:
    return import_module("rosidl_runtime_py.utilities").get_message(name)


def _profile(*, latched: bool) -> Any:
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

    durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
    return QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=durability)


@contextmanager
def _node(address: Address) -> Iterator[Any]:
    import rclpy

    context = rclpy.Context()
    rclpy.init(context=context, domain_id=address.domain)
    node = rclpy.create_node("ovita", context=context)
    try:
        yield node
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


def _wait(node: Any, ready: Any, timeout: float) -> bool:
    from rclpy.executors import SingleThreadedExecutor

    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    end = time.monotonic() + timeout
    try:
        while not ready():
            if time.monotonic() > end:
                return False
            executor.spin_once(timeout_sec=_PAUSE)
        return True
    finally:
        executor.remove_node(node)
