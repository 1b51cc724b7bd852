"""What a vehicle makes of a mission: how long it is commanded to take, and what its autopilot does otherwise.

Sources: ArduPilot Copter's parameters WPNAV_RADIUS, WPNAV_SPEED and WPNAV_ACCEL; PX4's NAV_ACC_RAD and MPC_ACC_HOR.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ovita.io.documents import listing
from ovita.io.missions import LEAST_SPEED, Mission, MissionWaypoint, waypoints_of
from ovita.paths.trajectory import Array

RADIUS = 2.0
"""Distance at which ArduPilot counts a waypoint as reached [m]; PX4 takes 10 m where an item does not say."""

LEAST_HEIGHT = 1.0
"""Below this height over home a mission's waypoint is pointed out [m]: GPS and barometers are no better."""

ACCELERATION = 2.5
"""Acceleration of a vehicle in a mission where none is said [m/s^2]: the default of ArduPilot's WPNAV_ACCEL."""

AGREEMENT = 0.05
"""Durations that differ by a smaller share agree."""


def commanded_duration(mission: Mission) -> float:
    """Time from the first waypoint to the last at the commanded speeds, with holds [s]."""
    lengths, speeds, holds = _legs(waypoints_of(mission)[0])
    return float((lengths / speeds).sum() + holds.sum())


def remarks(mission: Mission, told: float) -> tuple[str, ...]:
    """What a person should know of a mission before it is flown, each a sentence.

    Args:
        mission: As it is written or uploaded.
        told: Duration of the path that it stands for [s].
    """
    waypoints, _ = waypoints_of(mission)
    if len(waypoints) < 2:
        return ()
    lengths, speeds, holds = _legs(waypoints)
    commanded = float((lengths / speeds).sum() + holds.sum())
    ramps = _ramps(speeds, holds)
    said = [f"commanded: {commanded:.1f} s from the first waypoint to the last, holds included"]
    if abs(commanded - told) > AGREEMENT * max(told, 1e-9):
        said[0] += f"; the path says {told:.1f} s"
    if ramps > AGREEMENT * commanded:
        said.append(
            f"speeding up and slowing down at {ACCELERATION:g} m/s^2 adds about {ramps:.1f} s; turning adds more"
        )
    return (*said, *_slow(speeds), *_low(waypoints), *_close(lengths))


def _legs(waypoints: Sequence[MissionWaypoint]) -> tuple[Array, Array, Array]:
    """Length [m] and commanded speed [m/s] of each leg (N-1,), and the hold at each waypoint (N,) [s]."""
    places = np.array([waypoint.position for waypoint in waypoints])
    speeds = np.array([waypoint.speed for waypoint in waypoints[1:]])
    return np.linalg.norm(np.diff(places, axis=0), axis=1), speeds, np.array([w.hold for w in waypoints])


def _ramps(speeds: Array, holds: Array) -> float:
    """Time that a vehicle loses by changing its speed no faster than `ACCELERATION` [s].

    From speed a to b it takes |b - a| / acc at their mean, where b is commanded: (b - a) |b - a| / (2 acc b) longer.
    """
    rest = np.concatenate([[True], holds[1:-1] > 0])
    before = np.where(rest, 0.0, np.concatenate([[0.0], speeds[:-1]]))
    stops = speeds[np.concatenate([rest[1:], [True]])]
    change = speeds - before
    return float((change * np.abs(change) / speeds).sum() + stops.sum()) / (2.0 * ACCELERATION)


def _slow(speeds: Array) -> list[str]:
    slow = np.flatnonzero(speeds <= LEAST_SPEED)
    if not len(slow):
        return []
    legs = listing(str(i + 2) for i in slow)
    return [
        f"the way to waypoint {legs} is commanded at {LEAST_SPEED:g} m/s, the slowest that autopilots take, or less"
    ]


def _low(waypoints: Sequence[MissionWaypoint]) -> list[str]:
    heights = np.array([waypoint.position[2] for waypoint in waypoints])
    low = np.flatnonzero(heights < LEAST_HEIGHT)
    if not len(low):
        return []
    where = f"waypoint {listing(str(i + 1) for i in low)}"
    worst = f"{heights.min():.2f} m above home"
    return [
        f"{where} is lower than {LEAST_HEIGHT:g} m ({worst}), where GPS heights are too coarse: fly it as setpoints"
    ]


def _close(lengths: Array) -> list[str]:
    close = int(np.count_nonzero(lengths < RADIUS))
    if not close:
        return []
    legs = f"{close} of {len(lengths)} legs are shorter than the {RADIUS:g} m"
    return [
        f"{legs} at which ArduPilot counts a waypoint as reached (PX4 up to 10 m): corners are cut; fly it as setpoints"
    ]
