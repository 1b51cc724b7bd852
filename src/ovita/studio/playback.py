"""Playing trajectories in true time: the playheads, the clock, and a simulated robot that follows."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ovita.errors import OvitaError
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.studio.scene_view import SceneView, ViewBounds, rgb
from ovita.studio.sessions import Latest

_TICK_S, _TELL_S = 1 / 25, 0.5


class Playheads:
    """The balls that move along the lines."""

    def __init__(self, space: SceneView) -> None:
        self._space = space
        self._nodes: list[Any] = []
        self._lock = threading.Lock()

    def place(self, places: Sequence[Array]) -> None:
        """Put the ball of each line somewhere, (3,) each [m]; none takes them away."""
        stage = self._space.stage
        radius = 0.022 * (stage.size if stage is not None else 1.0)
        with self._lock:
            while len(self._nodes) > len(places):
                self._nodes.pop().remove()
            for i in range(len(self._nodes), len(places)):
                colour = rgb(self._space.palette[("before", "after")[i]])
                self._nodes.append(self._space.api.add_icosphere(f"/playhead/{i}", radius, colour, subdivisions=2))
            for node, place in zip(self._nodes, places, strict=True):
                node.position = place


class Player:
    """The clock of a tab; it calls `show` with the moment [s] to show, and tells the page, which runs along by itself.

    The page draws between two messages with a clock of its own, so neither a slow line nor a slow picture slows time.
    """

    def __init__(self, send: Callable[[str, Mapping[str, Any]], None], show: Callable[[float], None]) -> None:
        self._send, self._show = send, show
        self.duration, self.moment, self.pace = 1.0, 0.0, 1.0
        self._playing = threading.Event()
        self._closed = False

    def set_duration(self, seconds: float) -> None:
        """Set how long the longer of the two trajectories takes [s]."""
        self.duration = max(seconds, 0.01)
        self.moment = min(self.moment, self.duration)
        self._show(self.moment)
        self._tell()

    def toggle(self) -> None:
        """Play or pause; at the end it begins again."""
        if self._playing.is_set():
            self._playing.clear()
            self._tell()
            return
        if self.moment >= self.duration - 1e-6:
            self.moment = 0.0
        self._playing.set()
        threading.Thread(target=self._run, name="ovita-player", daemon=True).start()

    def heard(self, kind: str, message: Mapping[str, Any]) -> None:
        """Do what the page asks for: play or pause, another pace, another moment, or a look at one in passing."""
        if kind == "play":
            self.toggle()
        elif kind == "pace":
            self.pace = min(max(float(message["pace"]), 0.1), 10.0)
            self._tell()
        elif kind in ("moment", "glance") and not self._playing.is_set():
            at = min(max(float(message["at"]), 0.0), self.duration)
            self.moment = at if kind == "moment" else self.moment
            self._show(at)

    def close(self) -> None:
        """Stop for good."""
        self._closed = True
        self._playing.clear()

    def _tell(self) -> None:
        self._send("clock", {"at": self.moment, "playing": self._playing.is_set(), "pace": self.pace})

    def _run(self) -> None:
        last, told = time.monotonic(), -1.0
        while self._playing.is_set() and not self._closed:
            now = time.monotonic()
            self.moment = min(self.moment + (now - last) * self.pace, self.duration)
            last = now
            if now - told > _TELL_S:
                told = now
                self._tell()
            self._show(self.moment)
            if self.moment >= self.duration:
                self._playing.clear()
                break
            time.sleep(_TICK_S)
        self._tell()


if TYPE_CHECKING:
    from ovita.sim import Motion

NOBODY = "none"
ROBOTS = {NOBODY: "", "arm": "iiwa", "ground": "jackal", "drone": "crazyflie"}
"""Robots to choose from, named as their limits are, and how `ovita.sim` names them."""


def floor(trajectory: Trajectory, scene: Scene) -> float:
    """Height of the floor that is drawn [m]."""
    return ViewBounds.of([trajectory], scene).ground


class RobotView:
    """The robot of one tab, in viser's scene."""

    def __init__(self, api: Any, complain: Callable[[str], None]) -> None:
        self.api, self._complain = api, complain
        self.name = NOBODY
        self._motion: Motion | None = None
        self._bodies: list[Any] = []
        self._moment = 0.0
        self._plans = Latest(self._plan, "ovita-robot")
        self._lock = threading.RLock()

    def choose(self, name: str) -> None:
        """Take another robot, one of `ROBOTS`; `follow` has it move."""
        with self._lock:
            self.name = name if name in ROBOTS else NOBODY
            self.clear()

    def follow(self, trajectory: Trajectory, scene: Scene, limits: Robot) -> None:
        """Have the robot follow a trajectory, as soon as it is known how; of several wishes only the last counts."""
        if self.name != NOBODY:
            self._plans.want((trajectory, scene, limits))

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

    def _plan(self, wanted: tuple[Trajectory, Scene, Robot]) -> None:
        from ovita import sim

        trajectory, scene, limits = wanted
        name = ROBOTS[self.name]
        if not name:
            return
        if name == "jackal":  # a rover stays on the floor, however high the line is
            places = trajectory.positions.copy()
            places[:, 2] = floor(trajectory, scene)
            trajectory = trajectory.with_(positions=places)
        try:
            motion = sim.preview(trajectory, scene, name, limits=limits)
        except OvitaError as error:
            self.clear()
            self._complain(f"The robot cannot be shown: {error}")
            return
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
            colour, opacity = tuple(round(255 * v) for v in shape.rgba[:3]), shape.rgba[3]
            look: dict[str, Any] = {"color": colour, "opacity": opacity if opacity < 1.0 else None}
            look |= {"position": shape.position, "wxyz": shape.wxyz}
            if shape.kind == "box":
                self.api.add_box(name, dimensions=(a, b, c), **look)
            elif shape.kind == "sphere":
                self.api.add_icosphere(name, a, **look)
            else:
                self.api.add_cylinder(name, a, b, **look)
                if shape.kind == "capsule":
                    for end in (-b / 2, b / 2):
                        self.api.add_icosphere(f"{name}/{end}", a, look["color"], position=(0.0, 0.0, end))
