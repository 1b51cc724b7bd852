"""A drone's mission: its items as MAVLink numbers them, and the home that its local metres are about.

Commands and frames are those of the MAVLink common message set (MAV_CMD, MAV_FRAME).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import SequenceMatcher
from typing import Any

import numpy as np

from ovita.errors import FormatError, TrajectoryError
from ovita.io.documents import Task, listing, plain, validated
from ovita.io.geodesy import MISSION, Home, about_home, to_geodetic, to_local, yaw
from ovita.paths.scene import RFU, Scene
from ovita.paths.trajectory import TIMESTEP, Array, Trajectory, arc_length
from ovita.text import listed

WAYPOINT, LOITER_TIME, SPLINE = 16, 19, 82
CHANGE_SPEED, JUMP = 178, 177
TAKEOFF, TAKEOFFS = 22, (22, 84)

WAYPOINTS = (WAYPOINT, LOITER_TIME, SPLINE)
"""Commands that are the waypoints of a trajectory; every other item is kept as it is, in its place."""

NAMES: Mapping[int, str] = {
    16: "NAV_WAYPOINT", 17: "NAV_LOITER_UNLIM", 18: "NAV_LOITER_TURNS", 19: "NAV_LOITER_TIME",
    20: "NAV_RETURN_TO_LAUNCH", 21: "NAV_LAND", 22: "NAV_TAKEOFF", 31: "NAV_LOITER_TO_ALT", 82: "NAV_SPLINE_WAYPOINT",
    84: "NAV_VTOL_TAKEOFF", 85: "NAV_VTOL_LAND", 93: "NAV_DELAY", 112: "CONDITION_DELAY", 115: "CONDITION_YAW",
    177: "DO_JUMP", 178: "DO_CHANGE_SPEED", 181: "DO_SET_RELAY", 183: "DO_SET_SERVO", 195: "DO_SET_ROI_LOCATION",
    197: "DO_SET_ROI_NONE", 203: "DO_DIGICAM_CONTROL", 205: "DO_MOUNT_CONTROL", 206: "DO_SET_CAM_TRIGG_DIST",
    2000: "IMAGE_START_CAPTURE", 2001: "IMAGE_STOP_CAPTURE", 2500: "VIDEO_START_CAPTURE", 2501: "VIDEO_STOP_CAPTURE",
}  # fmt: skip
"""Names of the commands that missions hold most."""

GLOBAL, RELATIVE = 0, 3
"""MAV_FRAME of heights above mean sea level, and of heights above home."""

DEFAULT_SPEED = 5.0
"""Speed of a mission that says none [m/s]; the default of PX4 and of QGroundControl's plans."""

LEAST_SPEED = 0.2
"""Slowest speed that a mission is made to command [m/s]: the least that ArduPilot's WPNAV_SPEED may be."""


@dataclass(frozen=True)
class Item:
    """One item of a mission.

    Args:
        command: MAV_CMD, or -1 for a pattern that only QGroundControl unfolds.
        frame: MAV_FRAME.
        params: The seven parameters; None where not set (NaN).
        autocontinue: Whether the vehicle goes on by itself.
        ids: What DO_JUMP calls the item, in the numbering of its file.
        raw: The item as its file has it, where that holds more.
    """

    command: int
    frame: int = RELATIVE
    params: tuple[float | None, ...] = (None,) * 7
    autocontinue: bool = True
    ids: tuple[int, ...] = ()
    raw: Mapping[str, Any] | None = None

    @property
    def name(self) -> str:
        """The command's name."""
        return "pattern" if self.command < 0 else NAMES.get(self.command, f"command {self.command}")


_HOME = ("latitude", "longitude", "altitude", "heading")


@dataclass(frozen=True)
class Mission:
    """A mission and the place on earth that it is about.

    Args:
        home: Origin of the local metres, and of heights above home.
        items: Without the home that some files list first.
        home_item: That item, or None.
        speed: In force before the first speed command [m/s].
        rest: What else the file holds.
    """

    home: Home
    items: tuple[Item, ...] = ()
    home_item: Item | None = None
    speed: float = DEFAULT_SPEED
    rest: Mapping[str, Any] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """The mission as JSON values."""
        home = [self.home.latitude, self.home.longitude, self.home.altitude]
        return {**plain(self), "home": home if self.home.heading is None else [*home, self.home.heading]}

    @classmethod
    def from_dict(cls, document: Any) -> Mission:
        """A mission from `to_dict`'s output."""
        try:
            values = document["home"]
            home = dict(zip(_HOME[: max(len(values), 3)], values, strict=True))
            read = validated(cls, {**document, "home": home}, MISSION)
        except (KeyError, TypeError, ValueError, FormatError) as error:
            problem = f"is not a mission that ovita kept ({type(error).__name__}: {error})"
            raise TrajectoryError(problem, key=MISSION) from None
        if not any(item.command in WAYPOINTS for item in read.items):
            raise TrajectoryError("is not a mission that ovita kept (it has no waypoint)", key=MISSION)
        return read


def numbered(mission: Mission, *, with_home: bool) -> list[Item]:
    """The items in the order of their sequence numbers, with jumps pointing at these.

    Number 0 is home in ArduPilot and in QGC WPL files.
    """
    items = list(mission.items)
    for i, item in enumerate(items):
        if item.command < 0:
            kind = str((item.raw or {}).get("complexItemType", "complex item"))[:30]
            problem = f"item {i + 1} is a pattern ({kind}) that only QGroundControl unfolds; write a .plan"
            raise TrajectoryError(problem)
    if with_home:
        h, listed = mission.home, mission.home_item
        home = Item(WAYPOINT, GLOBAL, (0.0, 0.0, 0.0, 0.0, h.latitude, h.longitude, h.height))
        items.insert(0, listed if listed is not None and listed.params[4:] == home.params[4:] else home)
    places = {i: seq for seq, item in enumerate(items) for i in item.ids}
    return [_renumbered(item, places) for item in items]


def home_of(listed: Item | None) -> Home | None:
    """The home in the item that some files and vehicles list first, or None where it says none."""
    latitude, longitude, altitude = listed.params[4:] if listed else (None, None, None)
    if latitude is None or longitude is None or latitude == longitude == 0.0:
        return None
    return Home(latitude, longitude, altitude)


def _renumbered(item: Item, places: Mapping[int, int]) -> Item:
    """The item; a jump points at the sequence number of what it named."""
    target = item.params[0]
    if item.command != JUMP or target is None or int(target) not in places:
        return item
    return replace(item, params=(float(places[int(target)]), *item.params[1:]))


_ABOVE_SEA = (GLOBAL, 5)
_ABOVE_HOME = (RELATIVE, 6)
_TERRAIN = (10, 11)
_LOCAL_NED, _LOCAL_ENU = 1, 4
_MOST_DWELLS = 20_000
_HERE = 1e-9
_SAME_SPEED = 0.005
_SCALED_WITHIN = 0.02
_LEAST_TAKEOFF = 1.0
_AIR_OR_GROUND = (0.0, 1.0)


@dataclass(frozen=True)
class MissionWaypoint:
    """One waypoint of a mission: position (3,) right, front, up [m], speed on the way to it [m/s], hold [s]."""

    position: Array
    speed: float
    hold: float = 0.0


def waypoints_of(mission: Mission) -> tuple[list[MissionWaypoint], list[int]]:
    """The waypoints of a mission, and the item of each."""
    chosen = [i for i, item in enumerate(mission.items) if item.command in WAYPOINTS]
    for i in chosen:
        _check(mission.items[i], i)
    positions = _positions([mission.items[i] for i in chosen], mission.home)
    found, speed, place = [], mission.speed, iter(positions)
    for item in mission.items:
        speed = commanded_speed(item, mission.speed) or speed
        if item.command in WAYPOINTS:
            found.append(MissionWaypoint(next(place), speed, max(item.params[0] or 0.0, 0.0)))
    return found, chosen


def commanded_speed(item: Item, default: float) -> float | None:
    """The speed along the path that an item commands [m/s], or None; -2 asks for the default again."""
    kind, speed = item.params[0], item.params[1]
    if item.command != CHANGE_SPEED or kind not in _AIR_OR_GROUND or speed is None:
        return None
    return default if speed == -2.0 else speed if speed > 0 else None


def task_of(mission: Mission, file: str, setting: str = "") -> Task:
    """The task in a mission file; its scene keeps the mission. The file's `setting` gave the mission's speed."""
    waypoints, chosen = waypoints_of(mission)
    if len(waypoints) < 2:
        known = listing(NAMES[command] for command in WAYPOINTS)
        what = f"holds {len(waypoints)} waypoint{'s' * (len(waypoints) != 1)} ({known})"
        raise TrajectoryError(f"{what}; a trajectory needs at least 2", key="mission")
    trajectory, remarks = expanded(waypoints)
    paced = any(item.command == CHANGE_SPEED for item in mission.items)
    said = [] if paced else [f"no speed is commanded; assumed {setting}{mission.speed:g} m/s"]
    said += [f"metres are right, front and up of home ({mission.home.describe()}); {mission.home.axes()}", *remarks]
    others = {i: item for i, item in enumerate(mission.items) if i not in chosen and commanded_speed(item, 1.0) is None}
    kept = [f"{item.name} (item {i + 1})" for i, item in others.items()]
    if kept:
        said.append(f"kept untouched, in their places: {listing(kept)}")
    scene = Scene(frame=RFU, extra={MISSION: mission.to_dict()})
    return Task(trajectory, scene, path=file, notes=tuple(said), fixed_frame=True)


def expanded(waypoints: Sequence[MissionWaypoint]) -> tuple[Trajectory, tuple[str, ...]]:
    """A trajectory that takes as long as the mission is commanded to, and remarks.

    A hold is a dwell for each of its timesteps, and one more waypoint from which the path goes on at speed. Where the
    commanded speed changes, the waypoint's speed lies between the two, so that both legs together last as long.
    """
    holds = [waypoint.hold for waypoint in waypoints]
    timestep = _timestep(holds)
    counts = [round(hold / timestep) for hold in holds]
    off = max(abs(n * timestep - hold) for n, hold in zip(counts, holds, strict=True))
    notes = (f"holds were rounded to {timestep:g} s",) if off > 1e-6 else ()
    arrivals, departures = _speeds(waypoints, counts)
    last = len(waypoints) - 1
    repeats = [1 + n + (n > 0 and j < last) for j, n in enumerate(counts)]
    positions = np.repeat(np.array([waypoint.position for waypoint in waypoints]), repeats, axis=0)
    rows = zip(arrivals, counts, departures, repeats, strict=True)
    speeds = np.concatenate([[a, *[0.0] * n, d][:rows_] for a, n, d, rows_ in rows])
    return Trajectory(positions, speeds, None, timestep), notes


def legs_of(waypoints: Sequence[MissionWaypoint]) -> Array:
    """Lengths of the legs between waypoints (N-1,) [m]."""
    places = np.array([waypoint.position for waypoint in waypoints]).reshape(-1, 3)
    return np.asarray(np.linalg.norm(np.diff(places, axis=0), axis=1))


def _speeds(waypoints: Sequence[MissionWaypoint], counts: Sequence[int]) -> tuple[list[float], list[float]]:
    """Speeds of arrival at each waypoint, and of departure [m/s]; they differ only at holds."""
    commanded = [waypoint.speed for waypoint in waypoints[1:]]
    lengths = legs_of(waypoints).tolist()
    arrivals, departures, owed = [commanded[0]], [commanded[0]], 0.0
    for j, (a, b) in enumerate(zip(commanded, [*commanded[1:], commanded[-1]], strict=True), start=1):
        before, after = lengths[j - 1], lengths[j] if j < len(lengths) else 0.0
        together = a == b or counts[j] or before * after == 0.0
        time = owed + before / a + after / b
        arrivals.append(a if together else _between(departures[-1], a, b, before, after, time))
        owed += before / a - 2.0 * before / (departures[-1] + arrivals[-1])
        departures.append(b if together else arrivals[-1])
    return arrivals, departures


def _between(start: float, a: float, b: float, before: float, after: float, time: float) -> float:
    """The speed [m/s], from a to b, between two legs that makes them last a time [s] together.

    The first begins at `start`, the second ends at b; `before` and `after` are their lengths [m].
    """
    half = (time * (start + b) - 2.0 * (before + after)) / (2.0 * time)
    product = start * b - 2.0 * (before * b + after * start) / time
    return min(max(math.sqrt(max(half * half - product, 0.0)) - half, min(a, b)), max(a, b))


def gathered(trajectory: Trajectory) -> list[MissionWaypoint]:
    """The waypoints of a trajectory in metres about home: dwells become holds, legs have their mean speeds.

    The speed of a leg that asks for no time, since it is at rest at both ends, is 0.
    """
    here = np.linalg.norm(np.diff(trajectory.positions, axis=0), axis=1) <= _HERE
    slow = trajectory.speeds <= _HERE
    stays = np.concatenate([[False], here & (slow[1:] | slow[:-1])])
    starts = np.flatnonzero(~stays)
    ends = np.append(starts[1:], len(trajectory)) - 1
    times, places = trajectory.times, trajectory.positions
    found = [MissionWaypoint(places[0], 0.0, _hold(trajectory, 0, int(ends[0])))]
    for last, i, end in zip(ends, starts[1:], ends[1:], strict=False):
        length = float(np.linalg.norm(places[i] - places[last]))
        rests = trajectory.speeds[last] + trajectory.speeds[i] <= _HERE
        speed = 0.0 if rests else length / float(times[i] - times[last]) if length else float(trajectory.speeds[i])
        found.append(MissionWaypoint(places[i], speed, _hold(trajectory, int(i), int(end))))
    first = next((waypoint.speed for waypoint in found if waypoint.speed > 0), 0.0)
    return [replace(found[0], speed=first), *found[1:]]


def _hold(trajectory: Trajectory, first: int, last: int) -> float:
    return int(np.count_nonzero(trajectory.speeds[first + 1 : last + 1] <= _HERE)) * trajectory.timestep


def moved(item: Item, position: Array, home: Home) -> Item:
    """The item with another position (3,) right, front, up of home [m], its height in the item's own frame."""
    position = yaw(-home.heading) @ position if home.heading else position
    if item.frame in (_LOCAL_NED, _LOCAL_ENU):
        east, north, up = map(float, position)
        place = (north, east, -up) if item.frame == _LOCAL_NED else (east, north, up)
    else:
        latitude, longitude, altitude = map(float, to_geodetic(position[None, :], home)[0])
        place = (latitude, longitude, altitude - (home.height if item.frame in _ABOVE_HOME else 0.0))
    return replace(item, params=(*item.params[:4], *place))


def _positions(items: Sequence[Item], home: Home) -> Array:
    rows = np.array([item.params[4:] for item in items], dtype=float).reshape(-1, 3)
    frames = np.array([item.frame for item in items], dtype=int)
    relative = np.isin(frames, _ABOVE_HOME)
    if home.altitude is None and np.isin(frames, _ABOVE_SEA).any():
        need = "its heights above sea level need the home's, too: --home latitude,longitude,altitude"
        raise TrajectoryError(f"the home has no altitude; {need}", key="mission")
    geodetic = rows + np.outer(relative, [0.0, 0.0, home.height])
    positions = to_local(geodetic, home) if len(rows) else rows
    positions = np.where((frames == _LOCAL_ENU)[:, None], rows, positions)
    positions = np.where((frames == _LOCAL_NED)[:, None], rows[:, [1, 0, 2]] * [1.0, 1.0, -1.0], positions)
    return positions @ yaw(home.heading).T if home.heading else positions


def _check(item: Item, i: int) -> None:
    what = f"item {i + 1} ({item.name})"
    if item.frame in _TERRAIN or (item.raw or {}).get("AltitudeMode") in (3, 4):
        remedy = "set heights above home or above sea level in the ground station"
        raise TrajectoryError(f"{what} is at a height above the terrain, of which ovita has no map; {remedy}")
    on_earth = item.frame in (*_ABOVE_SEA, *_ABOVE_HOME)
    if not on_earth and item.frame not in (_LOCAL_NED, _LOCAL_ENU):
        known = "0 and 5 (above sea level), 3 and 6 (above home), 1 and 4 (local)"
        raise TrajectoryError(f"{what} has the frame {item.frame}; known are {known}")
    latitude, longitude, altitude = item.params[4:]
    if latitude is None or longitude is None or altitude is None:
        raise TrajectoryError(f"{what} has no position; give latitude, longitude and altitude")
    if on_earth and (abs(latitude) > 90 or abs(longitude) > 180):
        raise TrajectoryError(f"{what} is at {latitude:g}, {longitude:g}, which is no place on earth")


def _timestep(holds: Sequence[float]) -> float:
    """The default timestep if all holds are whole numbers of it, else their largest common part, from 1 ms on."""
    if sum(holds) / TIMESTEP <= _MOST_DWELLS and all(abs(round(h / TIMESTEP) * TIMESTEP - h) < 1e-6 for h in holds):
        return TIMESTEP
    milliseconds = math.gcd(*(round(hold * 1e3) for hold in holds))
    return max(milliseconds / 1e3, sum(holds) / _MOST_DWELLS, 1e-3)


_FRESH = Item(WAYPOINT, RELATIVE, (0.0, 0.0, 0.0, None, 0.0, 0.0, 0.0))


def mission_from(
    trajectory: Trajectory, scene: Scene, home: Home | None, *, heading: float | None = None, takeoff: bool = False
) -> tuple[Mission, tuple[str, ...]]:
    """The mission for a trajectory in the scene's frame, and what is not as the path says, each a clause.

    The scene keeps the mission that the trajectory came from; without one, local metres have their origin at `home`,
    and front points to the `heading` [degrees clockwise from north]. A `takeoff` is put before all else where the
    mission has none.
    """
    kept = scene.extra.get(MISSION)
    before = None if kept is None else Mission.from_dict(kept)
    if before is None and home is None:
        raise TrajectoryError("there is no home position; say where it is: --home latitude,longitude,altitude")
    waypoints = gathered(about_home(trajectory, scene, heading))
    notes = _lost(trajectory, scene, waypoints)
    if before is None:
        assert home is not None
        before = Mission(replace(home, heading=heading))
    else:
        before, moved_home = _moved_home(before, home, heading)
        notes += moved_home
    merged, said_too = _merged(waypoints, before)
    if takeoff and not any(item.command in TAKEOFFS for item in merged):
        merged.insert(0, _takeoff(waypoints[0], before.home))
    return replace(before, items=tuple(merged)), (*notes, *said_too)


def _lost(trajectory: Trajectory, scene: Scene, waypoints: Sequence[MissionWaypoint]) -> list[str]:
    """What of a path no mission holds."""
    lost = ["objects"] * bool(len(scene)) + ["orientations"] * (trajectory.orientations is not None)
    notes = [f"it holds no {listed(lost, 'or')}"] if lost else []
    if any(waypoint.speed == 0.0 for waypoint in waypoints):
        notes.append("no mission can command a speed of 0: a leg at rest from end to end keeps the speed in force")
    if MISSION not in scene.extra and np.ptp(trajectory.speeds) > _SAME_SPEED:
        notes.append("each leg has its mean speed")
    return notes


def _moved_home(before: Mission, home: Home | None, heading: float | None) -> tuple[Mission, list[str]]:
    if heading is not None and heading != (before.home.heading or 0.0):
        there = "in the mission it came from"
        raise TrajectoryError(f"where front points is said {there} ({before.home.axes()}); leave --heading out")
    moved_to = before.home if home is None else replace(home, heading=before.home.heading)
    if moved_to == before.home:
        return before, []
    said = f"home was moved to {moved_to.describe()}, and the waypoints with it; other items stay where they are"
    return replace(before, home=moved_to), [said]


def _takeoff(first: MissionWaypoint, home: Home) -> Item:
    """A takeoff at home, to the height of the first waypoint, at least `_LEAST_TAKEOFF`.

    PX4 flies to a takeoff's latitude and longitude where it has them, so 0, 0 will not do; ArduPilot ignores them.
    """
    height = max(float(first.position[2]), _LEAST_TAKEOFF)
    return moved(replace(_FRESH, command=TAKEOFF), np.array([0.0, 0.0, height]), home)


def _merged(waypoints: Sequence[MissionWaypoint], before: Mission) -> tuple[list[Item], list[str]]:
    """The items with the waypoints' positions, speeds and holds; all else unchanged."""
    old, chosen = waypoints_of(before)
    places, same = _matched(old, waypoints)
    notes = []
    if old and len(old) != len(waypoints):
        notes.append(f"the mission has {len(waypoints)} waypoints instead of {len(old)}; other items moved along")
    others = _others(before, places, len(waypoints))
    kept = {places[k]: k for k in reversed(range(len(old)))} | {places[k]: k for k in same}
    items: list[Item] = []
    in_force, frame = (before.speed, before.items[chosen[0]].frame) if chosen else (None, RELATIVE)
    for j, (waypoint, command) in enumerate(zip(waypoints, _commands(waypoints, old, kept), strict=True)):
        speed = _in_force(command, in_force)
        items += _at_speed(others[j], speed, in_force, before.speed)
        in_force = speed
        if j in kept:
            ids = tuple(i for k, place in enumerate(places) if place == j for i in before.items[chosen[k]].ids)
            item = replace(before.items[chosen[kept[j]]], ids=ids)
            items.append(_changed(item, old[kept[j]], waypoint, before.home))
            frame = item.frame
        else:
            fresh = moved(replace(_FRESH, frame=frame), waypoint.position, before.home)
            items.append(_with_hold(fresh, waypoint.hold))
    return [*items, *others[len(waypoints)]], notes


def _in_force(command: float | None, before: float | None) -> float:
    """The speed that holds from a command on [m/s]: that before it, where there is none or it is hardly another."""
    speed = command or before or DEFAULT_SPEED
    return before if before and abs(speed - before) <= _SAME_SPEED * before else speed


def _at_speed(others: Sequence[Item], speed: float, in_force: float | None, default: float) -> list[Item]:
    """The items before a waypoint, the last of them that commands a speed, or a new one, commanding this one [m/s]."""
    asks = [k for k, item in enumerate(others) if commanded_speed(item, default) is not None]
    if not asks:
        return [*others, *([] if in_force == speed else [_speed_item(speed)])]
    last = others[asks[-1]]
    if commanded_speed(last, default) != speed:
        last = replace(last, params=(last.params[0], speed, *last.params[2:]))
    return [*others[: asks[-1]], last, *others[asks[-1] + 1 :]]


def _others(before: Mission, places: Sequence[int], n: int) -> list[list[Item]]:
    """The items that are no waypoints: those before each of n new ones, and those after the last."""
    found: list[list[Item]] = [[] for _ in range(n + 1)]
    passed = 0
    for item in before.items:
        if item.command in WAYPOINTS:
            passed += 1
        else:
            found[places[passed] if passed < len(places) else n].append(item)
    return found


def _changed(item: Item, was: MissionWaypoint, now: MissionWaypoint, home: Home) -> Item:
    if not np.array_equal(was.position, now.position):
        item = moved(item, now.position, home)
    return item if abs(was.hold - now.hold) < 1e-6 else _with_hold(item, now.hold)


def _matched(old: Sequence[MissionWaypoint], new: Sequence[MissionWaypoint]) -> tuple[list[int], set[int]]:
    """Match each old mission waypoint to its new one, in ascending order, and mark those that did not move.

    Stations whose place is unchanged pair up first, the others by path length between these.
    """
    if not old or len(old) == len(new):
        return list(range(len(old))), set(range(len(old)))
    before, after = ([tuple(s.position.tolist()) for s in waypoints] for waypoints in (old, new))
    blocks = SequenceMatcher(None, before, after, autojunk=False).get_matching_blocks()
    same = {block.a + i: block.b + i for block in blocks for i in range(block.size)}
    was, now = _shares(old), _shares(new)
    places: list[int] = []
    last, place = len(new) - 1, -1
    for k in range(len(old)):
        lowest = min(place + 1, last)
        ahead = min((at for i, at in same.items() if i >= k), default=len(new))
        if k in same or lowest >= ahead:
            place = min(ahead, last)
        else:
            place = lowest + int(np.argmin(np.abs(now[lowest:ahead] - was[k])))
        places.append(place)
    return places, set(same)


def _shares(waypoints: Sequence[MissionWaypoint]) -> Array:
    """Share of the path length at each waypoint, 0..1."""
    s = arc_length(np.array([waypoint.position for waypoint in waypoints]))
    return np.asarray(s / max(float(s[-1]), 1e-12))


def _commands(
    waypoints: Sequence[MissionWaypoint], old: Sequence[MissionWaypoint], kept: Mapping[int, int]
) -> list[float | None]:
    """The speed to command on the way to each waypoint [m/s]; None for that in force.

    A leg between two waypoints of the old mission scales its command as its mean speed changed. Where that does not
    last as long as the path, since neighbours made up for each other, each leg is commanded its own mean speed.
    """
    found = _scaled(waypoints, old, kept)
    means = [round(max(waypoint.speed, LEAST_SPEED), 6) if waypoint.speed > 0.0 else None for waypoint in waypoints]
    scaled, exact = (_off(waypoints, commands) for commands in (found, means))
    if exact < scaled and scaled > _SCALED_WITHIN:
        found = means
    # The way to the first waypoint is no part of the path.
    separate = bool(old) and kept.get(0) == 0 and old[0].speed != old[1].speed
    return [old[0].speed if separate else found[:2][-1], *found[1:]]


def _scaled(
    waypoints: Sequence[MissionWaypoint], old: Sequence[MissionWaypoint], kept: Mapping[int, int]
) -> list[float | None]:
    """The speeds of the old mission [m/s], scaled as the mean speeds of their legs changed."""
    told = gathered(expanded(old)[0]) if len(old) > 1 else []
    found: list[float | None] = []
    for j, waypoint in enumerate(waypoints):
        k = kept.get(j, 0)
        was = told[k].speed if 0 < k < len(told) and kept.get(j - 1) == k - 1 else 0.0
        if was > 0.0 and abs(waypoint.speed - was) <= 1e-9 * was:
            found.append(old[k].speed)
        elif waypoint.speed > 0.0:
            wanted = waypoint.speed * (old[k].speed / was if was > 0.0 else 1.0)
            found.append(round(max(wanted, LEAST_SPEED), 6))
        else:
            found.append(None)
    return found


def _off(waypoints: Sequence[MissionWaypoint], commands: Sequence[float | None]) -> float:
    """How far the legs' durations as commanded are from those of the path, as a share."""
    pairs = zip(legs_of(waypoints), waypoints[1:], commands[1:], strict=True)
    times = np.array([(length / w.speed, length / speed) for length, w, speed in pairs if w.speed > 0.0 and speed])
    told, commanded = times.reshape(-1, 2).sum(axis=0)
    return float(abs(commanded - told) / max(told, 1e-9))


def _speed_item(speed: float) -> Item:
    """A DO_CHANGE_SPEED over ground, with the throttle left alone."""
    return Item(CHANGE_SPEED, 2, (1.0, speed, -1.0, 0.0, 0.0, 0.0, 0.0))


def _with_hold(item: Item, hold: float) -> Item:
    return replace(item, params=(round(hold, 9), *item.params[1:]))
