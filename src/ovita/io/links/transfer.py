"""Opening tasks from files and live links alike, and delivering trajectories to them."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from hashlib import sha256
from typing import Any

from ovita.errors import RequestError
from ovita.io import Choices, Task, atomic_write, joints, load_scene, load_task, rendered
from ovita.io.geodesy import MISSION, ROS
from ovita.io.joints import JointMotion
from ovita.io.links.address import Address, is_address
from ovita.io.task import NONE
from ovita.paths.frame import Frame, transformed
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory


@dataclass(frozen=True)
class Receipt:
    """What was delivered.

    Args:
        sha256: Of the bytes that were sent or written.
        size: Their number.
        notes: What a person should know about it, each a sentence.
    """

    sha256: str
    size: int
    notes: tuple[str, ...] = ()


def open_task(place: str, *, scene_file: str | None = None, frame: str | None = None, choices: Choices = NONE) -> Task:
    """Read a task from a file or an address, optionally with objects of a scene file and in another frame.

    Where the format fixes the axes (a ROS bag, a mission), another frame means turning the waypoints into it; a scene
    file that states no frame is taken to be in that of the waypoints. Elsewhere the frame says how to read the file.

    Raises:
        FormatError: If a file cannot be read.
        LinkError: If the other side of an address does not answer.
        MissingExtra: If a package is not installed.
    """
    task = receive(Address.parse(place), choices) if is_address(place) else load_task(place, choices)
    if scene_file is not None:
        task = with_scene(task, *load_scene(scene_file), frame)
    if frame is None or task.scene.frame == Frame(frame):
        return task
    if not task.fixed_frame:
        return replace(task, scene=replace(task.scene, frame=Frame(frame)))
    said = f"turned from {task.scene.frame.name} into {frame} ({Frame(frame).describe()})"
    moved = transformed(task.trajectory, task.scene.frame, Frame(frame))
    return replace(task, trajectory=moved, scene=task.scene.in_frame(Frame(frame)), notes=(*task.notes, said))


def receive(address: Address, choices: Choices = NONE) -> Task:
    """Read one trajectory from a live link.

    Raises:
        LinkError: If nothing comes within the address's timeout.
        MissingExtra: If a package is not installed.
    """
    if address.bus == "ros2":
        from ovita.io.links import ros2

        return ros2.receive(address)
    from ovita.io.links import mavlink

    return mavlink.download(address, choices.home)


def deliver(
    place: str,
    trajectory: Trajectory,
    scene: Scene,
    *,
    instruction: str = "",
    extra: Mapping[str, Any] | None = None,
    choices: Choices = NONE,
    verdict: str = "",
) -> Receipt:
    """Send a trajectory to an address, or write it to a file.

    Raises:
        FormatError: If a file cannot be written.
        LinkError: If the other side does not take it.
        MissingExtra: If a package is not installed.
    """
    if not is_address(place):
        content, notes = rendered(place, trajectory, scene, instruction, extra, choices=choices, verdict=verdict)
        atomic_write(place, content)
        data = content.encode() if isinstance(content, str) else content
        return Receipt(sha256(data).hexdigest(), len(data), notes)
    address = Address.parse(place)
    if address.bus == "ros2":
        from ovita.io.links import ros2

        data, notes = ros2.send(address, trajectory, scene, choices, start=time.time_ns())
    else:
        from ovita.io.links import mavlink

        data, notes = mavlink.upload(address, trajectory, scene, choices.home)
    return Receipt(sha256(data).hexdigest(), len(data), notes)


def deliver_joints(place: str, motion: JointMotion, choices: Choices = NONE) -> Receipt:
    """Send a motion of joints to a ROS 2 topic, or write it to a bag.

    Raises:
        FormatError: If the bag cannot be written.
        LinkError: If the other side does not take it.
        RequestError: If the address is none of ROS 2.
        MissingExtra: If a package is not installed.
    """
    if not is_address(place):
        data = joints.dumps(place, motion, choices)
        atomic_write(place, data)
    else:
        address = Address.parse(place)
        if address.bus != "ros2":
            raise RequestError(f"{place}: motions of joints go to ROS 2 topics or bags only")
        from ovita.io.links import ros2

        data = ros2.send_joints(address, motion, choices)
    return Receipt(sha256(data).hexdigest(), len(data))


def with_scene(task: Task, scene: Scene, stated: bool = True, frame: str | None = None) -> Task:
    """The task with the objects of another scene; what its own keeps of a bag or a mission stays.

    Args:
        task: Whose waypoints are turned into the scene's frame where their format fixes their axes.
        scene: With the objects.
        stated: Whether the scene states its frame; if not, it is taken to be in `frame`, or that of the waypoints.
        frame: A frame's name, or None.
    """
    if not task.fixed_frame:
        return replace(task, scene=scene)
    others = {key: value for key, value in scene.extra.items() if key not in (MISSION, ROS)}
    kept, notes, trajectory = others | dict(task.scene.extra), task.notes, task.trajectory
    if not stated:
        scene = replace(scene, frame=task.scene.frame if frame is None else Frame(frame))
        notes += (f"the scene file states no frame; its objects were taken to be in {scene.frame.name}",)
    if scene.frame != task.scene.frame:
        trajectory = transformed(trajectory, task.scene.frame, scene.frame)
        notes += (f"turned from {task.scene.frame.name} into the scene's frame {scene.frame.name}",)
    return replace(task, trajectory=trajectory, scene=replace(scene, extra=kept), notes=notes)
