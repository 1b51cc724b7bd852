"""A path flown point by point over MAVLink, for indoors: position and velocity, 20 times a second.

SET_POSITION_TARGET_LOCAL_NED is streamed in PX4's mode OFFBOARD or ArduPilot Copter's GUIDED. The vehicle's own metres
(LOCAL_POSITION_NED) are taken to be those of the path. What happens when something goes wrong is stated:

- This side commands the mode HOLD (PX4: AUTO.LOITER; ArduPilot: BRAKE) and ends with an error where the vehicle leaves
  the fence or its path, falls silent, refuses a command, or a person presses Ctrl-C. Where a pilot changes the mode,
  it only falls silent, for the pilot is in command.
- The vehicle's side, where this one is silent: PX4 leaves OFFBOARD after COM_OF_LOSS_T (1 s) for what COM_OBL_RC_ACT
  says, which is to hold or to land; ArduPilot stops and holds after GUID_TIMEOUT (3 s).
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ovita.errors import LinkError
from ovita.io.documents import NONE, Choices
from ovita.io.geodesy import on_earth
from ovita.io.links import Address
from ovita.io.mavlink import ARDUPILOT, RESEND, RETRIES, Vehicle, command_long
from ovita.paths.robot import Robot
from ovita.paths.scene import RFU, Frame, Scene, transformed
from ovita.paths.trajectory import Array, Trajectory
from ovita.text import clean_text, point

START_GAP = 0.5
"""How far from the path's first waypoint the vehicle may be when it starts [m]."""

ASTRAY = 1.0
"""How far from where it is due the vehicle may be, besides `LAG` at its speed [m]."""

LAG = 0.5
"""Age that a report of the vehicle's position may have [s]."""

SILENCE = 5.0
"""No heartbeat for this long counts as a lost link [s]."""

BLIND = 1.0
"""No position for this long counts as a lost link [s]."""

CLIMB = 0.5
"""Speed of a takeoff [m/s]."""

_PX4 = 12
_COPTERS = (2, 3, 4, 13, 14, 15, 29)
_WARM_UP, _SETTLED = 1.0, 0.3
_SET_MODE, _ARM, _TAKEOFF, _INTERVAL = 176, 400, 22, 511
_POSITION_ID, _LOCAL_NED, _ARMED = 32, 1, 128
_POSITION_AND_VELOCITY = 64 | 128 | 256 | 1024 | 2048
_HEARD = ("HEARTBEAT", "LOCAL_POSITION_NED", "COMMAND_ACK", "STATUSTEXT")
_WARNING, _MOST_TEXTS = 4, 3
_MODES: Mapping[int, Mapping[str, tuple[int, int]]] = {
    _PX4: {"fly": (6, 0), "hold": (4, 3), "land": (4, 6)},
    ARDUPILOT: {"fly": (4, 0), "hold": (17, 0), "land": (9, 0)},
}

_OTHER_MODES: Mapping[int, Mapping[tuple[int, int], str]] = {
    _PX4: {(1, 0): "MANUAL", (2, 0): "ALTCTL", (3, 0): "POSCTL", (4, 3): "HOLD", (4, 5): "RTL", (4, 6): "LAND",
           (6, 0): "OFFBOARD"},
    ARDUPILOT: {(0, 0): "STABILIZE", (2, 0): "ALT_HOLD", (4, 0): "GUIDED", (5, 0): "LOITER", (6, 0): "RTL",
                (9, 0): "LAND", (16, 0): "POSHOLD", (17, 0): "BRAKE"},
}  # fmt: skip


class _StoppedError(Exception):
    """Why the vehicle is to hold."""


class _TakenOverError(Exception):
    """A pilot changed the mode."""


@dataclass(frozen=True, eq=False)
class Course:
    """A path in the vehicle's frame.

    Args:
        path: In metres north, east, down.
        to_scene: From there to the scene's frame (3, 3).
        robot: Whose workspace is the fence, in the scene's frame.
    """

    path: Trajectory
    to_scene: Array
    robot: Robot
    rate: float

    @classmethod
    def of(
        cls, trajectory: Trajectory, scene: Scene, robot: Robot, rate: float, heading: float | None = None
    ) -> Course:
        """The course of a trajectory in the scene's frame: front is north or the heading, and in ROS x is east."""
        axes = Trajectory(np.eye(3), np.zeros(3))
        path, turned = (transformed(on_earth(t, scene, heading), RFU, Frame("ned")) for t in (trajectory, axes))
        return cls(path, turned.positions.T, robot, rate)

    def at(self, t: float) -> tuple[Array, Array]:
        """Position [m] and velocity [m/s] that are due at a time [s], north, east, down."""
        state = self.path.at(t)
        i = min(int(state.where[0]), len(self.path) - 2)
        step = self.path.positions[i + 1] - self.path.positions[i]
        length = float(np.linalg.norm(step))
        speed = float(state.speeds[0]) if t < self.path.duration else 0.0
        return state.positions[0], step * (speed / length if length > 0.0 else 0.0)

    def outside(self, position: Array) -> bool:
        """Whether a place (north, east, down) is beyond the fence."""
        space = self.robot.workspace
        return space is not None and bool(space.inside((self.to_scene.T @ position)[None, :])[0] < 0.0)


def fly(
    address: Address, trajectory: Trajectory, scene: Scene, robot: Robot, choices: Choices = NONE
) -> tuple[bytes, tuple[str, ...]]:
    """Fly a path at an address; return its setpoints as bytes, and notes.

    Raises:
        LinkError: If it was not flown to its end; says in which state the vehicle is left.
    """
    course = Course.of(trajectory, scene, robot, address.rate, choices.heading)
    with contextlib.closing(Vehicle(address)) as vehicle:
        notes = Pilot(vehicle, course).fly(takeoff=choices.takeoff, land=address.options.get("end") == "land")
    moments = np.arange(0.0, trajectory.duration, 1.0 / course.rate)
    return np.array([np.concatenate(course.at(float(t))) for t in moments]).astype("<f4").tobytes(), notes


class Pilot:
    """Flies one course on one vehicle."""

    def __init__(self, vehicle: Vehicle, course: Course) -> None:
        self.vehicle, self.course = vehicle, course
        self.sent, self.worst = 0, 0.0
        self._began = self._due = self._beat_at = self._place_at = vehicle.now()
        self._mode = self._armed = -1
        self._place: Array | None = None
        self._acks: dict[int, int] = {}
        self._texts: dict[str, None] = {}
        self._asked = self._led = False
        self._target = (np.zeros(3), np.zeros(3))
        if vehicle.autopilot not in _MODES or vehicle.kind not in _COPTERS:
            problem = f"autopilot {vehicle.autopilot}, type {vehicle.kind}"
            raise LinkError(f"{vehicle.address}: setpoints go to multicopters of PX4 or ArduPilot only ({problem})")

    def fly(self, *, takeoff: bool = False, land: bool = False) -> tuple[str, ...]:
        """Fly the course from where the vehicle is, and leave it holding or landing; notes on how it went.

        Raises:
            LinkError: If it was not flown to its end; says in which state the vehicle is left.
        """
        self._get_ready(takeoff)
        try:
            self._take_command(takeoff)
            self._follow()
            self._switch("land" if land else "hold")
        except _TakenOverError:
            problem = f"a pilot or a failsafe changed the mode to {self._mode_name()}, which is in command now"
            raise self._error(f"{problem}; nothing more was sent") from None
        except KeyboardInterrupt:
            raise self._error(f"stopped by Ctrl-C; {self._leave()}") from None
        except (_StoppedError, LinkError) as error:
            raise self._error(f"{error}; {self._leave()}") from None
        state = "lands" if land else "holds"
        return (
            f"{self.sent} setpoints were sent at {self.course.rate:g} a second; the vehicle {state}",
            f"it was at most {self.worst:.2f} m from where it was due, by its own account",
            *([f'on the way the vehicle said "{self._heard()}"'] if self._texts else []),
        )

    def _error(self, text: str) -> LinkError:
        heard = f'; the vehicle said "{self._heard()}"' if self._texts else ""
        return LinkError(f"{self.vehicle.address}: {text}{heard} (after {self.sent} setpoints)")

    def _heard(self) -> str:
        return '", "'.join([*self._texts][-_MOST_TEXTS:])

    def _mode_name(self) -> str:
        main, sub = (self._mode >> 16 & 255, self._mode >> 24) if self.vehicle.autopilot == _PX4 else (self._mode, 0)
        return _OTHER_MODES[self.vehicle.autopilot].get((main, sub), f"number {self._mode}")

    def _get_ready(self, takeoff: bool) -> None:
        """Learn where the vehicle is, and check that it may start; nothing was commanded until here."""
        request = command_long(self.vehicle, _INTERVAL, _POSITION_ID, 1e6 / self.course.rate)
        end = self.vehicle.now() + self.vehicle.address.timeout
        while self._place is None or self._mode < 0:
            if self.vehicle.now() > end:
                raise LinkError(f"{self.vehicle.address}: the vehicle does not say where it is (LOCAL_POSITION_NED)")
            self.vehicle.send(request)
            self._listen(self.vehicle.now() + 0.5)
        first = self.course.path.positions[0]
        away = first - self._place
        gap = float(np.linalg.norm(away[:2] if takeoff else away))
        if gap > START_GAP or (takeoff and away[2] > START_GAP):
            hint = "" if takeoff or np.linalg.norm(away[:2]) > START_GAP else ", or say --takeoff"
            here, there = point(self._place), point(first)
            problem = f"the vehicle is at {here}, {np.linalg.norm(away):.2f} m from the path's start {there} (NED)"
            raise LinkError(f"{self.vehicle.address}: {problem}; bring it there first{hint}")
        if any(self.course.outside(place) for place in self.course.path.positions):
            raise LinkError(f"{self.vehicle.address}: the path leaves the robot's workspace, which is the fence")

    def _take_command(self, takeoff: bool) -> None:
        assert self._place is not None
        self._due = self.vehicle.now()
        self._target = (self._place, np.zeros(3))
        end = self.vehicle.now() + _WARM_UP  # PX4 takes the mode only while setpoints come
        while self.vehicle.now() < end:
            self._turn()
        self._asked = True
        self._switch("fly")
        self._led = True
        self._command(command_long(self.vehicle, _ARM, 1.0), lambda: self._armed > 0, "arming")
        if takeoff:
            self._climb()

    def _climb(self) -> None:
        assert self._place is not None
        start, first = self._place, self.course.path.positions[0]
        height = float(start[2] - first[2])
        if height <= _SETTLED:
            return
        if self.vehicle.autopilot == ARDUPILOT:
            self.vehicle.send(command_long(self.vehicle, _TAKEOFF, 0, 0, 0, 0, 0, 0, height))
        began, lasts = self.vehicle.now(), height / CLIMB
        while self.vehicle.now() < began + lasts + 2.0 * SILENCE:
            share = min((self.vehicle.now() - began) / lasts, 1.0)
            rising = np.array([0.0, 0.0, -CLIMB if share < 1.0 else 0.0])
            self._target = (start + share * (first - start), rising)
            self._turn(guarded=True)
            if share == 1.0 and self._error_now() < START_GAP:
                return
        raise _StoppedError("the vehicle did not climb to the path's first waypoint")

    def _follow(self) -> None:
        began, duration = self.vehicle.now(), self.course.path.duration
        while (t := self.vehicle.now() - began) < duration:
            self._target = self.course.at(t)
            self._turn(guarded=True)
        self._target = self.course.at(duration)
        while self.vehicle.now() < began + duration + SILENCE:
            self._turn(guarded=True)
            if self._error_now() < _SETTLED:
                return
        raise _StoppedError("the vehicle did not come to the path's end")

    def _turn(self, *, guarded: bool = False) -> None:
        """Send what is due, and listen until the next is; `guarded` looks whether the vehicle flies as it should."""
        d, (place, velocity) = self.vehicle.dialect, self._target
        moment = int((self.vehicle.now() - self._began) * 1e3) % 2**32
        to = self.vehicle.system, self.vehicle.component, _LOCAL_NED, _POSITION_AND_VELOCITY
        values = (float(value) for value in (*place, *velocity))
        self.vehicle.send(d.MAVLink_set_position_target_local_ned_message(moment, *to, *values, 0, 0, 0, 0, 0))
        self.sent += 1
        self._due = max(self._due, self.vehicle.now() - 1.0 / self.course.rate) + 1.0 / self.course.rate
        self._listen(self._due)
        if guarded:
            self._guard()

    def _listen(self, until: float) -> None:
        while (left := until - self.vehicle.now()) > 0.0:
            heard = self.vehicle.wait(_HEARD, left)
            if heard is not None:
                self._hear(heard)

    def _hear(self, message: Any) -> None:
        name = message.get_type()
        if name == "HEARTBEAT":
            if int(message.autopilot) != self.vehicle.autopilot:  # another program under the same number
                return
            self._mode, self._armed = int(message.custom_mode), int(bool(message.base_mode & _ARMED))
            self._beat_at = self.vehicle.now()
        elif name == "STATUSTEXT":
            if int(message.severity) <= _WARNING and (text := clean_text(message.text, 60)):
                self._texts[text] = None
        elif name == "COMMAND_ACK":
            self._acks[int(message.command)] = int(message.result)
        elif math.isfinite(message.x + message.y + message.z):
            self._place = np.array([message.x, message.y, message.z])
            self._place_at = self.vehicle.now()

    def _guard(self) -> None:
        now = self.vehicle.now()
        if now - self._beat_at > SILENCE or now - self._place_at > BLIND:
            raise _StoppedError("the vehicle fell silent")
        if self._mode != self._number("fly"):
            raise _TakenOverError
        if not self._armed:
            raise _StoppedError("the vehicle disarmed on the way")
        assert self._place is not None
        if self.course.outside(self._place):
            raise _StoppedError(f"the vehicle left the robot's workspace, at {point(self._place)} (NED)")
        error = self._error_now()
        self.worst = max(self.worst, error)
        if error > ASTRAY + LAG * float(np.linalg.norm(self._target[1])):
            raise _StoppedError(f"the vehicle is {error:.2f} m from where it is due")

    def _error_now(self) -> float:
        """Distance from where the vehicle says it is to where it is due [m]."""
        assert self._place is not None
        return float(np.linalg.norm(self._place - self._target[0]))

    def _leave(self) -> str:
        """Command the vehicle to hold, and say what is known of it then."""
        if not self._asked:
            return "nothing was commanded"
        if self._led and self._mode not in (self._number("fly"), self._number("hold")):
            return f"a pilot or a failsafe changed the mode to {self._mode_name()}, which is in command now"
        try:
            self._switch("hold")
        except (LinkError, _StoppedError, KeyboardInterrupt):  # a second Ctrl-C ends the wait, not the command
            if not self._led and self._mode != self._number("fly"):
                return f"the vehicle stays in the mode {self._mode_name()}"
            return "HOLD was commanded, not acknowledged; the vehicle's own failsafe now stops it"
        return "the vehicle acknowledged HOLD"

    def _switch(self, mode: str) -> None:
        main, sub = _MODES[self.vehicle.autopilot][mode]
        wanted = self._number(mode)
        name = {"fly": "OFFBOARD" if self.vehicle.autopilot == _PX4 else "GUIDED"}.get(mode, mode.upper())
        self._command(
            command_long(self.vehicle, _SET_MODE, 1.0, main, sub), lambda: self._mode == wanted, f"the mode {name}"
        )

    def _number(self, mode: str) -> int:
        """How a heartbeat gives a mode."""
        main, sub = _MODES[self.vehicle.autopilot][mode]
        return main << 16 | sub << 24 if self.vehicle.autopilot == _PX4 else main

    def _command(self, message: Any, done: Callable[[], bool], what: str) -> None:
        """Send a command until a heartbeat shows that it is done, while setpoints go on."""
        for _ in range(RETRIES + 1):
            self._acks.pop(message.command, None)
            self.vehicle.send(message)
            began = self.vehicle.now()
            while self.vehicle.now() < began + RESEND:
                self._turn()
                result = self._acks.get(message.command)
                # A heartbeat alone counts where it cannot be from before the command.
                if done() and (result == 0 or self._beat_at > began + LAG):
                    return
                if result not in (None, 0, 1, 5):
                    entry = self.vehicle.dialect.enums["MAV_RESULT"].get(result)
                    raise LinkError(f"the vehicle refused {what} ({entry.name if entry else result})")
        raise LinkError(f"the vehicle did not take {what}")
