"""A trajectory put back into the mission that it came from: what did not change stays as it was, digit by digit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from difflib import SequenceMatcher

import numpy as np

from ovita.errors import TrajectoryError
from ovita.io.geodesy import Home
from ovita.io.missions.mission import CHANGE_SPEED, DEFAULT_SPEED, RELATIVE, STATIONS, WAYPOINT, Item, Mission
from ovita.io.missions.stations import Station, asked_speed, gathered, moved, stations_of
from ovita.io.turning import MISSION, ROS, on_earth
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory, arc_length

_FRESH = Item(WAYPOINT, RELATIVE, (0.0, 0.0, 0.0, None, 0.0, 0.0, 0.0))


def mission_from(trajectory: Trajectory, scene: Scene, home: Home | None) -> tuple[Mission, tuple[str, ...]]:
    """The mission of a trajectory, and what it does not hold, each a sentence.

    Args:
        trajectory: In the scene's frame.
        scene: Keeps the mission that the trajectory came from, if there was one.
        home: Where the local metres have their origin, for a trajectory that came from none.

    Raises:
        TrajectoryError: If no home is known, or the mission that the scene keeps is damaged.
    """
    kept = scene.extra.get(MISSION)
    before = None if kept is None else Mission.from_dict(kept)
    if before is None and home is None:
        raise TrajectoryError("there is no home position; say where it is: --home latitude,longitude,altitude")
    stations = gathered(on_earth(trajectory, scene))
    notes = ["a mission holds no objects and no instruction"] if len(scene) else []
    if trajectory.orientations is not None:
        notes.append("a mission holds no orientations")
    if any(s.speed == 0.0 for s in stations[1:]):
        notes.append("no mission can command a speed of 0; a leg that ends at rest got its mean speed")
    if before is None:
        assert home is not None
        axes = "x of the ROS frame is east, y north" if ROS in scene.extra else "front is north, right is east"
        notes.append(f"metres are those about home ({home.describe()}): {axes}")
        notes.append("it holds waypoints only; add takeoff and landing in the ground station")
        return Mission(home, tuple(_fresh(stations, home))), tuple(notes)
    if home is not None and home != before.home:
        before = replace(before, home=home)
        notes.append(f"home was moved to {home.describe()}, and the waypoints with it; other items stay where they are")
    merged, said_too = _merged(stations, before)
    return replace(before, items=tuple(merged)), (*notes, *said_too)


def _fresh(stations: Sequence[Station], home: Home) -> list[Item]:
    items: list[Item] = []
    in_force: float | None = None
    for j, station in enumerate(stations):
        speed = _commanded(stations, j) or in_force or next((s.speed for s in stations if s.speed > 0), DEFAULT_SPEED)
        if speed != in_force:
            items.append(_speed_item(speed))
            in_force = speed
        items.append(_with_hold(moved(_FRESH, station.position, home), station.hold))
    return items


def _merged(stations: Sequence[Station], before: Mission) -> tuple[list[Item], list[str]]:
    """The items with the stations' positions, speeds and holds; everything else in its place."""
    old, chosen = stations_of(before)
    places, same = _matched(old, stations)
    notes = []
    if len(old) != len(stations):
        notes.append(f"the mission has {len(stations)} waypoints instead of {len(old)}; other items moved along")
    others = _others(before, places, len(stations))
    kept = {places[k]: k for k in reversed(range(len(old)))} | {places[k]: k for k in same}
    items: list[Item] = []
    in_force, frame = before.speed, before.items[chosen[0]].frame
    for j, station in enumerate(stations):
        speed = _commanded(stations, j) or in_force
        asks = [k for k, item in enumerate(others[j]) if asked_speed(item, before.speed) is not None]
        for k, item in enumerate(others[j]):
            asked = asked_speed(item, before.speed)
            if asks and k == asks[-1] and asked != speed:
                item = replace(item, params=(item.params[0], speed, *item.params[2:]))
                asked = speed
            in_force = in_force if asked is None else asked
            items.append(item)
        if in_force != speed:
            items.append(_speed_item(speed))
            in_force = speed
        if j in kept:
            ids = tuple(i for k, place in enumerate(places) if place == j for i in before.items[chosen[k]].ids)
            item = replace(before.items[chosen[kept[j]]], ids=ids)
            items.append(_changed(item, old[kept[j]], station, before.home))
            frame = item.frame
        else:
            fresh = moved(replace(_FRESH, frame=frame), station.position, before.home)
            items.append(_with_hold(fresh, station.hold))
    return [*items, *others[len(stations)]], notes


def _others(before: Mission, places: Sequence[int], n: int) -> list[list[Item]]:
    """The items that are no stations: those before each of n new stations, and those after the last."""
    found: list[list[Item]] = [[] for _ in range(n + 1)]
    passed = 0
    for item in before.items:
        if item.command in STATIONS:
            passed += 1
        else:
            found[places[passed] if passed < len(places) else n].append(item)
    return found


def _changed(item: Item, was: Station, now: Station, home: Home) -> Item:
    """The item with what differs between two stations."""
    if not np.array_equal(was.position, now.position):
        item = moved(item, now.position, home)
    return item if abs(was.hold - now.hold) < 1e-6 else _with_hold(item, now.hold)


def _matched(old: Sequence[Station], new: Sequence[Station]) -> tuple[list[int], set[int]]:
    """For every old station the new one that stands for it, ascending; and the old ones that are still in place.

    Stations whose place is unchanged pair up first, the others by path length between these.
    """
    if len(old) == len(new):
        return list(range(len(new))), set(range(len(old)))
    before, after = ([tuple(s.position.tolist()) for s in stations] for stations in (old, new))
    blocks = SequenceMatcher(None, before, after, autojunk=False).get_matching_blocks()
    same = {block.a + i: block.b + i for block in blocks for i in range(block.size)}
    shares = [_shares(stations) for stations in (old, new)]
    places: list[int] = []
    last = len(new) - 1
    for k in range(len(old)):
        lowest = min(places[-1] + 1, last) if places else 0
        ahead = next((same[i] for i in range(k, len(old)) if i in same), len(new))
        if k in same or lowest >= ahead:
            places.append(min(same.get(k, ahead), last))
        else:
            places.append(lowest + int(np.argmin(np.abs(shares[1][lowest:ahead] - shares[0][k]))))
    return places, set(same)


def _shares(stations: Sequence[Station]) -> Array:
    """Share of the path length at each station, 0..1."""
    s = arc_length(np.array([station.position for station in stations]))
    return np.asarray(s / max(float(s[-1]), 1e-12))


def _commanded(stations: Sequence[Station], j: int) -> float | None:
    """The speed to command on the way to a station [m/s]: its own, or the leg's mean where it ends at rest.

    None keeps the speed in force, where a leg is at rest at both ends.
    """
    speed = stations[j].speed
    if speed > 0.0:
        return speed
    if j == 0:
        return stations[1].speed if len(stations) > 1 and stations[1].speed > 0.0 else None
    return stations[j - 1].speed / 2.0 if stations[j - 1].hold == 0.0 and stations[j - 1].speed > 0.0 else None


def _speed_item(speed: float) -> Item:
    """A DO_CHANGE_SPEED over ground, with the throttle left alone."""
    return Item(CHANGE_SPEED, 2, (1.0, speed, -1.0, 0.0, 0.0, 0.0, 0.0))


def _with_hold(item: Item, hold: float) -> Item:
    return replace(item, params=(round(hold, 9), *item.params[1:]))
