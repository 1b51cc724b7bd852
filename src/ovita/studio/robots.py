"""A simulated robot that moves along the playhead; `ovita.sim` says where its bodies are, this draws them."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from ovita.errors import OvitaError
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory

if TYPE_CHECKING:
    from ovita.sim import Motion

NOBODY = "none"
ROBOTS = {NOBODY: "", "arm": "iiwa", "rover": "jackal", "drone": "crazyflie"}
"""Robots to choose from, and how `ovita.sim` names them."""


class Puppet:
    """The robot of one tab.

    Args:
        api: viser's scene of the tab.
        complain: Shows a sentence to the person.
    """

    def __init__(self, api: Any, complain: Callable[[str], None]) -> None:
        self.api, self._complain = api, complain
        self.name = NOBODY
        self._motion: Motion | None = None
        self._bodies: list[Any] = []
        self._moment = 0.0
        self._wanted: tuple[Trajectory, Scene, Robot] | None = None
        self._thinking = False
        self._lock = threading.RLock()

    def choose(self, name: str) -> None:
        """Take another robot, one of `ROBOTS`; `follow` has it move."""
        with self._lock:
            self.name = name if name in ROBOTS else NOBODY
            self.clear()

    def follow(self, trajectory: Trajectory, scene: Scene, limits: Robot) -> None:
        """Have the robot follow a trajectory, as soon as it is known how; of several wishes only the last counts."""
        with self._lock:
            if self.name == NOBODY:
                return
            self._wanted = (trajectory, scene, limits)
            if self._thinking:
                return
            self._thinking = True
        threading.Thread(target=self._think, name="ovita-robot", daemon=True).start()

    def show(self, moment: float) -> None:
        """Put the robot where it is at a time of the trajectory's own law [s]."""
        with self._lock:
            self._moment = moment
            if self._motion is None:
                return
            places, turns = self._motion.at(moment, clock="trajectory")
            for node, place, turn in zip(self._bodies, places, turns, strict=True):
                node.position, node.wxyz = place, turn

    def clear(self) -> None:
        """Take the robot off the page."""
        with self._lock:
            for node in self._bodies:
                node.remove()
            self._bodies, self._motion = [], None

    def _think(self) -> None:
        while True:
            with self._lock:
                wanted, self._wanted = self._wanted, None
                name = ROBOTS[self.name]
                if wanted is None or not name:
                    self._thinking = False
                    return
            try:
                motion = preview(name, *wanted)
            except OvitaError as error:
                self.clear()
                self._complain(f"The robot cannot be shown: {error}")
                continue
            with self._lock:
                if ROBOTS[self.name] == name:
                    if self._motion is None or self._motion.shapes != motion.shapes:
                        self.clear()
                        self._build(motion)
                    self._motion = motion
                    self.show(self._moment)

    def _build(self, motion: Motion) -> None:
        self._bodies = [self.api.add_frame(f"/robot/{i}", show_axes=False) for i in range(len(motion.bodies))]
        for i, shape in enumerate(motion.shapes):
            name, (a, b, c) = f"/robot/{shape.body}/{i}", shape.size
            look = {
                "color": tuple(round(255 * v) for v in shape.rgba[:3]),
                "opacity": shape.rgba[3] if shape.rgba[3] < 1.0 else None,
                "position": shape.position,
                "wxyz": shape.wxyz,
            }
            if shape.kind == "box":
                self.api.add_box(name, dimensions=(a, b, c), **look)
            elif shape.kind == "sphere":
                self.api.add_icosphere(name, a, **look)
            else:
                self.api.add_cylinder(name, a, b, **look)
                if shape.kind == "capsule":
                    for end in (-b / 2, b / 2):
                        self.api.add_icosphere(f"{name}/{end}", a, look["color"], position=(0.0, 0.0, end))


def preview(name: str, trajectory: Trajectory, scene: Scene, limits: Robot) -> Motion:
    """How a robot means to follow a trajectory.

    Raises:
        OvitaError: If it cannot, or the simulator is not installed.
    """
    from ovita import sim

    return sim.preview(trajectory, scene, name, limits=limits)
