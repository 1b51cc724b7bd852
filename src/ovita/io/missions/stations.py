"""Stations: the waypoints of a mission in local metres, each with the speed at which it is flown to and its hold.

A station becomes a waypoint of a trajectory, followed by as many dwells as its hold takes. Local metres are east,
north, up of home, the axes of the frame `rfu` whose front is north.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ovita.errors import TrajectoryError
from ovita.io.documents import listing
from ovita.io.geodesy import Home, to_geodetic, to_local
from ovita.io.missions.mission import CHANGE_SPEED, GLOBAL, NAMES, RELATIVE, STATIONS, Item, Mission
from ovita.io.task import Task
from ovita.io.turning import MISSION
from ovita.paths.frame import RFU
from ovita.paths.scene import Scene
from ovita.paths.trajectory import TIMESTEP, Array, Trajectory

_ABOVE_SEA = (GLOBAL, 5)
_ABOVE_HOME = (RELATIVE, 6)
_TERRAIN = (10, 11)
_LOCAL_NED, _LOCAL_ENU = 1, 4
_MOST_DWELLS = 20_000
_AIR_OR_GROUND = (0.0, 1.0)


@dataclass(frozen=True)
class Station:
    """One waypoint of a mission: position (3,) east, north, up [m], speed on the way to it [m/s], hold [s]."""

    position: Array
    speed: float
    hold: float = 0.0


def stations_of(mission: Mission) -> tuple[list[Station], list[int]]:
    """The stations of a mission, and the item of each.

    Raises:
        TrajectoryError: If an item's position or height cannot be read; names the item, counted from 1.
    """
    chosen = [i for i, item in enumerate(mission.items) if item.command in STATIONS]
    for i in chosen:
        _check(mission.items[i], i)
    positions = _positions([mission.items[i] for i in chosen], mission.home)
    speeds, speed = {}, mission.speed
    for i, item in enumerate(mission.items):
        asked = asked_speed(item, mission.speed)
        speed = speed if asked is None else asked
        speeds[i] = speed
    found = [
        Station(position, speeds[i], max(mission.items[i].params[0] or 0.0, 0.0))
        for i, position in zip(chosen, positions, strict=True)
    ]
    return found, chosen


def asked_speed(item: Item, default: float) -> float | None:
    """The speed along the path that an item commands [m/s], or None; -2 asks for the default again."""
    kind, speed = item.params[0], item.params[1]
    if item.command != CHANGE_SPEED or kind not in _AIR_OR_GROUND or speed is None:
        return None
    return default if speed == -2.0 else speed if speed > 0 else None


def task_of(mission: Mission, file: str, notes: Sequence[str] = ()) -> Task:
    """The task that a mission stands for; its scene keeps the mission.

    Raises:
        TrajectoryError: If it has fewer than two stations, or one that cannot be read.
    """
    stations, chosen = stations_of(mission)
    if len(stations) < 2:
        known = listing(NAMES[command] for command in STATIONS)
        what = f"holds {len(stations)} waypoint{'s' * (len(stations) != 1)} ({known})"
        raise TrajectoryError(f"{what}; a trajectory needs at least 2", key="mission")
    trajectory, remarks = expanded(stations)
    said = [*notes, f"metres are east, north and up of home ({mission.home.describe()}); front is north", *remarks]
    kept = [f"{item.name} (item {i + 1})" for i, item in enumerate(mission.items) if _other(item, i, chosen)]
    if kept:
        said.append(f"kept untouched, in their places: {listing(kept)}")
    scene = Scene(frame=RFU, extra={MISSION: mission.to_dict()})
    return Task(trajectory, scene, path=file, notes=tuple(said), fixed_frame=True)


def expanded(stations: Sequence[Station]) -> tuple[Trajectory, tuple[str, ...]]:
    """A trajectory with a dwell for every timestep of a hold, and remarks."""
    holds = [station.hold for station in stations]
    timestep = _timestep(holds)
    counts = [round(hold / timestep) for hold in holds]
    off = max(abs(n * timestep - hold) for n, hold in zip(counts, holds, strict=True))
    notes = (f"holds were rounded to {timestep:g} s",) if off > 1e-6 else ()
    repeats = [n + 1 for n in counts]
    positions = np.repeat(np.array([station.position for station in stations]), repeats, axis=0)
    speeds = np.concatenate([[s.speed, *[0.0] * n] for s, n in zip(stations, counts, strict=True)])
    return Trajectory(positions, speeds, None, timestep), notes


def gathered(trajectory: Trajectory) -> list[Station]:
    """The stations of a trajectory in metres east, north, up: every waypoint that is no dwell."""
    ds = np.diff(trajectory.positions, axis=0)
    dwell = np.concatenate([[False], (ds == 0).all(axis=1) & (trajectory.speeds[1:] == 0)])
    starts = np.flatnonzero(~dwell)
    counts = np.diff(np.concatenate([starts, [len(trajectory)]])) - 1
    return [
        Station(trajectory.positions[i], float(trajectory.speeds[i]), int(n) * trajectory.timestep)
        for i, n in zip(starts, counts, strict=True)
    ]


def moved(item: Item, position: Array, home: Home) -> Item:
    """The item with another position (3,) east, north, up of home [m], its height in the item's own frame."""
    if item.frame in (_LOCAL_NED, _LOCAL_ENU):
        east, north, up = map(float, position)
        place = (north, east, -up) if item.frame == _LOCAL_NED else (east, north, up)
    else:
        latitude, longitude, altitude = map(float, to_geodetic(position[None, :], home)[0])
        place = (latitude, longitude, altitude - (home.altitude if item.frame in _ABOVE_HOME else 0.0))
    return replace(item, params=(*item.params[:4], *place))


def _positions(items: Sequence[Item], home: Home) -> Array:
    rows = np.array([item.params[4:] for item in items], dtype=float).reshape(-1, 3)
    frames = np.array([item.frame for item in items], dtype=int)
    relative = np.isin(frames, _ABOVE_HOME)
    geodetic = rows + np.outer(relative, [0.0, 0.0, home.altitude])
    positions = to_local(geodetic, home) if len(rows) else rows
    positions = np.where((frames == _LOCAL_ENU)[:, None], rows, positions)
    return np.where((frames == _LOCAL_NED)[:, None], rows[:, [1, 0, 2]] * [1.0, 1.0, -1.0], positions)


def _check(item: Item, i: int) -> None:
    what = f"item {i + 1} ({item.name})"
    if item.frame in _TERRAIN or (item.raw or {}).get("AltitudeMode") in (3, 4):
        remedy = "set heights above home or above sea level in the ground station"
        raise TrajectoryError(f"{what} is at a height above the terrain, of which ovita has no map; {remedy}")
    if item.frame not in (*_ABOVE_SEA, *_ABOVE_HOME, _LOCAL_NED, _LOCAL_ENU):
        known = "0 and 5 (above sea level), 3 and 6 (above home), 1 and 4 (local)"
        raise TrajectoryError(f"{what} has the frame {item.frame}; known are {known}")
    if any(value is None for value in item.params[4:]):
        raise TrajectoryError(f"{what} has no position; give latitude, longitude and altitude")
    if item.frame not in (_LOCAL_NED, _LOCAL_ENU):
        latitude, longitude = item.params[4] or 0.0, item.params[5] or 0.0
        if abs(latitude) > 90 or abs(longitude) > 180:
            raise TrajectoryError(f"{what} is at {latitude:g}, {longitude:g}, which is no place on earth")


def _other(item: Item, i: int, chosen: Sequence[int]) -> bool:
    return i not in chosen and asked_speed(item, 1.0) is None


def _timestep(holds: Sequence[float]) -> float:
    """The default timestep if all holds are whole numbers of it, else their largest common part, from 1 ms on."""
    if sum(holds) / TIMESTEP <= _MOST_DWELLS and all(abs(round(h / TIMESTEP) * TIMESTEP - h) < 1e-6 for h in holds):
        return TIMESTEP
    milliseconds = math.gcd(*(round(hold * 1e3) for hold in holds))
    return max(milliseconds / 1e3, sum(holds) / _MOST_DWELLS, 1e-3)
