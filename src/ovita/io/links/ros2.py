"""ROS 2 topics, live: through rclpy where ROS 2 is installed, else over DDS without it (extra `ros`)."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from ovita.errors import MissingExtra
from ovita.io.bags import message_of, task_of
from ovita.io.files import errors_of
from ovita.io.joints import JointMotion, build_joints
from ovita.io.links.address import Address
from ovita.io.messages import JOINTS, TYPES, Maker
from ovita.io.task import Choices, Kind, Task
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory

Build = Callable[[Maker], tuple[str, Any]]
"""Builds the message to send, and the name of its type, with the library's maker."""


def send(
    address: Address, trajectory: Trajectory, scene: Scene, choices: Choices, *, start: int
) -> tuple[bytes, tuple[str, ...]]:
    """Publish a trajectory once a subscriber is there; return its bytes and notes on what is lost.

    Args:
        address: Topic, domain and message type.
        trajectory: In the scene's frame.
        scene: Its frame, and the fields of the ROS message it was read from.
        choices: Overridden by the address.
        start: Time stamp [ns].

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
        data = _backend().publish(address, build)
    return data, tuple(notes)


def send_joints(address: Address, motion: JointMotion, choices: Choices) -> bytes:
    """Publish a motion of joints on a topic once a subscriber is there, to begin at once; its bytes.

    Raises:
        LinkError: If nobody subscribes, or the message is not acknowledged.
        MissingExtra: If neither rclpy nor cyclonedds is installed.
    """
    frame_id = address.options.get("frame_id") or choices.frame_id or ""
    data: bytes = _backend().publish(address, lambda maker: (JOINTS, build_joints(motion, maker, frame_id=frame_id)))
    return data


def receive(address: Address) -> Task:
    """Wait for one message with a path on a topic.

    Raises:
        LinkError: If none comes in time.
        FormatError: If what comes holds no usable path.
        MissingExtra: If neither rclpy nor cyclonedds is installed.
    """
    name, message = _backend().subscribe(address)
    kinds: dict[str, Kind] = {n: kind for kind, n in TYPES.items()}
    with errors_of(str(address)):
        return replace(task_of(kinds[name], message, topic=address.target), path=str(address))


def _backend() -> Any:
    if find_spec("rclpy") is not None:
        # A ROS that is installed but not set up in this shell cannot be imported.
        with suppress(ImportError):
            import_module("rclpy")
            return import_module("ovita.io.links.ros2_rclpy")
    try:
        import_module("cyclonedds")
    except ImportError:
        raise MissingExtra("cyclonedds", "ros") from None
    from ovita.io.links import ros2_dds

    return ros2_dds
