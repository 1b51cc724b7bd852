"""A node of ROS 2 that adapts paths: a path and words come in on topics, the adapted path and a status go out.

Below the node's name, `ovita` by default, in messages that every ROS 2 has:

    /ovita/path         nav_msgs/Path     in   the path to adapt; a new one begins anew
    /ovita/instruction  std_msgs/String   in   words, or JSON {"instruction": "...", "id": "...", "on": "original"}
    /ovita/adapted      nav_msgs/Path     out  latched; what was done and may be followed
    /ovita/status       std_msgs/String   out  latched; JSON, one for every path and every instruction
    /ovita/accept, /ovita/undo            std_srvs/Trigger, where rclpy is installed

A reading that needs confirmation is offered in the status and not taken: "yes" as the next instruction takes it. With a
robot named, only what the gate releases is published as adapted.
"""

from __future__ import annotations

import json
import tempfile
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ovita import gate
from ovita.dialogue.session import Session
from ovita.errors import OvitaError, RequestError
from ovita.io import Choices, with_scene
from ovita.io.bags import STRING, message_of, task_of
from ovita.io.bus import Bus, Publisher, joined
from ovita.io.links import Address
from ovita.io.messages import TYPES
from ovita.measure import sentences
from ovita.paths.robot import UNLIMITED, Robot
from ovita.paths.scene import Scene
from ovita.policy.sandbox import Isolation
from ovita.result import Adaptation
from ovita.text import clean_text
from ovita.writers.base import PolicyWriter

Status = dict[str, Any]
"""What the status topic says, as JSON."""

Told = tuple[Status, Adaptation | None]
"""A status, and the result if its path may be followed."""

ARRIVAL = 1.0
"""Longest wait for subscribers to have what was published [s]."""

LONGEST = 4000
"""Most characters of an instruction."""


@dataclass
class PathNode:
    """What the node does, whatever carries its messages: it keeps one session about the last path that came.

    Args:
        scene: With the objects, and whether it states its frame; None for none.
        robot: Whose limits hold; "none" for none, and then nothing is verified.
    """

    scene: tuple[Scene, bool] | None = None
    robot: Robot = UNLIMITED
    writer: PolicyWriter | str = "builtin"
    isolation: Isolation = "auto"
    session: Session | None = field(default=None, init=False)

    def take_path(self, message: Any) -> Status:
        """Begin with a nav_msgs/Path."""

        def begin() -> Told:
            self.session = None
            task = task_of("path", message, topic="/path")
            if self.scene is not None:
                task = with_scene(task, *self.scene)
            self.session = Session(task.trajectory, task.scene, self.robot, self.writer, isolation=self.isolation)
            path = task.trajectory
            about = f"a path of {len(path)} waypoints, {path.length:.3g} m in {path.duration:.3g} s"
            return {"status": "ready", "message": about, "notes": list(task.notes)}, None

        return _reported({"about": "path"}, begin)[0]

    def take_words(self, text: str) -> Told:
        """Adapt to an instruction."""
        about: Status = {"about": "instruction"}

        def adapt() -> Told:
            said = _said(text)
            about.update({key: said[key] for key in ("id", "instruction") if key in said})
            if said.get("on", "current") not in ("current", "original"):
                raise RequestError('"on" is "current" or "original"')
            result = self._open().say(said["instruction"], on=said.get("on", "current"))
            return self._judged(result)

        return _reported(about, adapt)

    def accept(self) -> Told:
        """Take the reading that is offered."""
        return _reported({"about": "accept"}, lambda: self._judged(self._open().accept()))

    def undo(self) -> Told:
        """Take the last turn back."""

        def back() -> Told:
            session = self._open()
            if not session.undo():
                raise RequestError("there is nothing to undo")
            path = session.original
            first = Adaptation("", "done", path, path, scene=session.scene, robot=session.robot)
            return self._judged(session.adaptation or first)

        return _reported({"about": "undo"}, back)

    def _open(self) -> Session:
        if self.session is None:
            raise RequestError("there is no path yet; publish a nav_msgs/Path first")
        return self.session

    def _judged(self, result: Adaptation) -> Told:
        refusals, verified = self._refusals(result)
        followed = result.usable and not refusals
        said = {
            "status": result.status,
            "message": result.message,
            "published": followed,
            "verified": verified,
            "refusals": refusals,
            "plan": list(result.plan),
            "changes": _changes(result),
            "assumptions": list(result.assumed),
            "warnings": list(result.cautions),
            "question": result.question,
        }
        if result.proposal is not None:
            offered = result.proposal
            said["proposal"] = {"plan": list(offered.plan), "changes": _changes(offered), "accept": "say yes"}
        return said, result if followed else None

    def _refusals(self, result: Adaptation) -> tuple[list[str], bool]:
        """What speaks against following a result, and whether its limits were measured for that."""
        if not result.usable:
            return [], False
        if self.robot.name == "none":
            said = [] if result.status in ("done", "limited") else [result.message]
            return said + gate.against(result.adapted, result.scene, None), False
        if not result.code:
            return gate.against(result.adapted, result.scene, self.robot), True
        with tempfile.TemporaryDirectory(prefix="ovita-ros-") as folder:
            file = str(Path(folder) / "result.json")
            result.save(file)
            return list(gate.review(file).refusals), True


def _said(text: str) -> Mapping[str, Any]:
    """The words in a String, or the fields of a JSON object in it."""
    if len(text) > LONGEST:
        raise RequestError(f"the instruction has {len(text)} characters; shorten it to {LONGEST}")
    if not text.lstrip().startswith("{"):
        return {"instruction": text}
    try:
        said = json.loads(text)
    except (ValueError, RecursionError):
        raise RequestError(
            'this is not JSON; say {"instruction": "go left by 0.1", "id": "1"}, or plain words'
        ) from None
    unknown = set(said) - {"instruction", "id", "on"}
    if unknown or not isinstance(said.get("instruction"), str):
        raise RequestError('say {"instruction": "go left by 0.1"}, with "id" and "on" if you like')
    return {**said, **({"id": clean_text(str(said["id"]), 200)} if "id" in said else {})}


def _changes(result: Adaptation) -> list[str]:
    return [str(text) for text in sentences(result.changes)] if result.changes else []


def _reported(about: Status, action: Callable[[], Told]) -> Told:
    """What came of an action; an error is a status, too."""
    try:
        done, result = action()
        return about | done, result
    except OvitaError as error:
        problem = str(error)
    except Exception as error:  # a node that adapts for others goes on whatever one message holds
        traceback.print_exc()
        problem = f"this failed inside ovita ({type(error).__name__}); its log has more"
    return about | {"status": "error", "message": problem}, None


def serve(address: Address, node: PathNode, ready: Callable[[str], None]) -> None:
    """Serve a node on the bus until the process is interrupted.

    The address's topic is the name under which the node's own lie, such as ros2:/ovita?domain=3; `ready` is told once
    it listens.

    Raises:
        LinkError: If the bus cannot be joined.
        MissingExtra: If neither rclpy nor cyclonedds is installed.
    """
    name = address.target
    with joined(address) as bus:
        out = _Out(bus, bus.publisher(f"{name}/adapted", TYPES["path"]), bus.publisher(f"{name}/status", STRING))
        paths = bus.subscribe(f"{name}/path", TYPES["path"])
        words = bus.subscribe(f"{name}/instruction", STRING)
        services = bus.offer(f"{name}/accept", lambda: out.answer(node.accept))
        services = services and bus.offer(f"{name}/undo", lambda: out.answer(node.undo))
        more = f", services {name}/accept and {name}/undo" if services else ""
        ready(f"serving {name}/path and {name}/instruction{more}")
        while True:
            for message in paths():
                out.tell(node.take_path(message), None)
            for message in words():
                out.tell(*node.take_words(str(message.data)))
            bus.rest()


@dataclass(frozen=True, eq=False)
class _Out:
    bus: Bus
    adapted: Publisher
    status: Publisher

    def tell(self, status: Status, result: Adaptation | None) -> None:
        """Publish a status, after the path that it is about."""
        if result is not None:
            choices = Choices(topic="/adapted", kind="path")
            message = message_of(result.adapted, result.scene, choices, self.bus.maker, start=time.time_ns())[2]
            _publish(self.adapted, message)
        _publish(self.status, self.bus.maker.new(STRING, data=json.dumps(status)))

    def answer(self, action: Callable[[], Told]) -> tuple[bool, str]:
        """Do what a service asks for; whether there is a path to follow, and the status as JSON."""
        status, result = action()
        self.tell(status, result)
        return result is not None, json.dumps(status)


def _publish(publisher: Publisher, message: Any) -> None:
    """Publish, and let it arrive before the next message takes its place."""
    publisher.write(message)
    if publisher.matched():
        publisher.acknowledged(ARRIVAL)
