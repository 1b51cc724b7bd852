"""What a vehicle makes of a mission: how it is commanded to fly, and what its autopilot does otherwise.

Sources: ArduPilot Copter's parameters WPNAV_RADIUS, WPNAV_SPEED and WPNAV_ACCEL; PX4's NAV_ACC_RAD and MPC_ACC_HOR.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ovita.io.documents import Choices, listing
from ovita.io.geodesy import MISSION, ROS, Home
from ovita.io.missions import LEAST_SPEED, TAKEOFFS, Mission, legs_of, mission_from, waypoints_of
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.text import counted

RADIUS = 2.0
"""Distance at which ArduPilot counts a waypoint as reached [m]; PX4 takes 10 m where an item does not say."""

LEAST_HEIGHT = 1.0
"""Below this height over home a mission's waypoint is pointed out [m]: GPS and barometers are no better."""

ACCELERATION = 2.5
"""Acceleration of a vehicle in a mission where none is said [m/s^2]: the default of ArduPilot's WPNAV_ACCEL."""

AGREEMENT = 0.05
"""Durations that differ by a smaller share agree."""

_SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Flight:
    """How a mission is commanded to be flown, from its first waypoint to its last.

    Args:
        told: Duration of the path that it stands for [s].
        lengths: Of each leg (N-1,) [m].
        speeds: Commanded on the way to each waypoint (N,) [m/s].
        holds: At each waypoint (N,) [s].
        heights: Of each waypoint above home (N,) [m].
    """

    told: float
    lengths: Array
    speeds: Array
    holds: Array
    heights: Array
    home: Home

    @classmethod
    def of(cls, mission: Mission, told: float) -> Flight:
        """The flight of a mission that stands for a path of a duration [s]."""
        waypoints, _ = waypoints_of(mission)
        rows = np.array([(w.speed, w.hold, w.position[2]) for w in waypoints]).reshape(-1, 3)
        speeds, holds, heights = rows.T
        return cls(told, legs_of(waypoints), speeds, holds, heights, mission.home)

    @property
    def duration(self) -> float:
        """Time at the commanded speeds, with holds [s]."""
        return float((self.lengths / self.speeds[1:]).sum() + self.holds.sum())

    @property
    def agrees(self) -> bool:
        """Whether it lasts as long as the path says."""
        return abs(self.duration - self.told) <= AGREEMENT * max(self.told, 1e-9)

    @property
    def ramps(self) -> float:
        """Time that a vehicle loses by changing its speed no faster than `ACCELERATION` [s].

        From speed a to b it takes |b - a| / acc at their mean, where b is commanded: (b - a) |b - a| / (2 acc b) more.
        """
        speeds = self.speeds[1:]
        rest = np.concatenate([[True], self.holds[1:-1] > 0])
        before = np.where(rest, 0.0, np.concatenate([[0.0], speeds[:-1]]))
        stops = speeds[np.concatenate([rest[1:], [True]])]
        change = speeds - before
        return float((change * np.abs(change) / speeds).sum() + stops.sum()) / (2.0 * ACCELERATION)

    def __str__(self) -> str:
        slow, fast = self.speeds[1:].min(), self.speeds[1:].max()
        pace = f"{fast:.3g}" if fast - slow < 0.005 * fast else f"{slow:.3g} to {fast:.3g}"
        return f"{self.duration:.1f} s at {pace} m/s" + ("" if self.agrees else f", NOT the path's {self.told:.1f} s")

    def against(self, robot: Robot | None) -> list[str]:
        """Why it is not what was verified, or beyond a robot's speeds, each a sentence."""
        said = []
        if not self.agrees:
            why = f"none commands less than {LEAST_SPEED:g} m/s"
            hint = "fly it as setpoints, or speed up its slowest part"
            said.append(f"As a mission it flies {self.duration:.1f} s, not {self.told:.1f} s, for {why}: {hint}.")
        limit = np.inf if robot is None or robot.max_speed is None else robot.max_speed
        fast = np.flatnonzero(~(self.speeds <= limit * (1.0 + _SAME)))
        if len(fast):
            where, most = listing(str(i + 1) for i in fast), f"at most {limit:g} m/s"
            said.append(f"The mission commands {self.speeds[fast].max():.3g} m/s to waypoint {where} ({most}).")
        return said


def flight_of(trajectory: Trajectory, scene: Scene, choices: Choices) -> tuple[Flight, tuple[str, ...]]:
    """How the mission for a trajectory is commanded to be flown, and what a person should know of it.

    Raises:
        TrajectoryError: If there is no mission for it, such as without a home.
    """
    mission, lost = mission_from(trajectory, scene, choices.home, heading=choices.heading, takeoff=choices.takeoff)
    told = trajectory.duration
    return Flight.of(mission, told), remarks(mission, told, lost, scene)


def remarks(mission: Mission, told: float, lost: Sequence[str], scene: Scene) -> tuple[str, ...]:
    """What a person should know of a mission before it is flown: how it flies, what is otherwise, what is to do.

    `told` is the duration of the path that it stands for [s], `lost` what else is not as the path says, each a clause.
    """
    flight = Flight.of(mission, told)
    if len(flight.speeds) < 2:
        return ()
    said = f"it flies {flight}"
    if flight.ramps > AGREEMENT * flight.duration:
        said += f" (and about {flight.ramps:.1f} s for speeding up and slowing down at {ACCELERATION:g} m/s^2)"
    axes = flight.home.axes(ros=ROS in scene.extra and MISSION not in scene.extra)
    said += f", about home ({flight.home.describe()}): {axes}"
    otherwise = [*_otherwise(flight), *lost]
    to_do = _to_do(mission, scene, float(flight.lengths.max()) < RADIUS)
    notes = [said, f"not as the path: {'; '.join(otherwise)}" if otherwise else "", f"to do: {to_do}" if to_do else ""]
    return tuple(note for note in notes if note)


def _to_do(mission: Mission, scene: Scene, small: bool) -> str:
    """What is left to a person; `small` where a vehicle counts each waypoint as reached before it leaves the last."""
    commands = {item.command for item in mission.items}
    takeoff = "landing" if commands & set(TAKEOFFS) else "takeoff (or say --takeoff) and landing"
    said = [] if MISSION in scene.extra else [f"add {takeoff} in the ground station"]
    if mission.home.altitude is None:
        said.append("nobody said home's altitude, so the file says 0 m; its heights are above home")
    if small:
        said.insert(0, "fly a path as small as this as setpoints (mavlink:...?type=setpoints)")
    return "; ".join(said)


def _otherwise(flight: Flight) -> list[str]:
    """What a vehicle makes of slow legs, low waypoints and short legs."""
    slow = np.flatnonzero(flight.speeds[1:] <= LEAST_SPEED) + 2
    low = np.flatnonzero(flight.heights < LEAST_HEIGHT) + 1
    close = int(np.count_nonzero(flight.lengths < RADIUS))
    said = []
    if len(slow):
        what = f"{LEAST_SPEED:g} m/s, the slowest that autopilots take, or less is commanded on"
        said.append(f"{what} {counted(len(slow), 'leg')} (to waypoint {listing(map(str, slow))})")
    if len(low):
        where = f"as low as {flight.heights.min():.2f} m above home (waypoint {listing(map(str, low))})"
        said.append(f"{where} GPS is too coarse for heights")
    if close:
        legs = f"{close} of {len(flight.lengths)} legs are shorter than the {RADIUS:g} m"
        said.append(f"corners are cut, for {legs} at which ArduPilot counts a waypoint as reached (PX4 up to 10 m)")
    return said
