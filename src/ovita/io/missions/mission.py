"""A drone's mission: its items as MAVLink numbers them, and the home that its local metres are about.

Commands and frames are those of the MAVLink common message set (MAV_CMD, MAV_FRAME).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ovita.errors import FormatError, TrajectoryError
from ovita.io.documents import plain, validated
from ovita.io.geodesy import Home
from ovita.io.turning import MISSION

WAYPOINT, LOITER_TIME, SPLINE = 16, 19, 82
CHANGE_SPEED, JUMP = 178, 177

STATIONS = (WAYPOINT, LOITER_TIME, SPLINE)
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
        return {**plain(self), "home": [self.home.latitude, self.home.longitude, self.home.altitude]}

    @classmethod
    def from_dict(cls, document: Any) -> Mission:
        """A mission from `to_dict`'s output.

        Raises:
            TrajectoryError: If it is something else.
        """
        try:
            home = dict(zip(("latitude", "longitude", "altitude"), document["home"], strict=True))
            read = validated(cls, {**document, "home": home}, MISSION)
        except (KeyError, TypeError, ValueError, FormatError) as error:
            problem = f"is not a mission that ovita kept ({type(error).__name__}: {error})"
            raise TrajectoryError(problem, key=MISSION) from None
        if not any(item.command in STATIONS for item in read.items):
            raise TrajectoryError("is not a mission that ovita kept (it has no waypoint)", key=MISSION)
        return read


def numbered(mission: Mission, *, with_home: bool) -> list[Item]:
    """The items in the order of their sequence numbers, with jumps pointing at these.

    Args:
        mission: Its items.
        with_home: Whether number 0 is home, as ArduPilot and QGC WPL files have it.

    Raises:
        TrajectoryError: If there is a pattern, which only QGroundControl can unfold.
    """
    items = list(mission.items)
    for i, item in enumerate(items):
        if item.command < 0:
            problem = f"item {i + 1} is a pattern ({_pattern(item)}) that only QGroundControl unfolds; write a .plan"
            raise TrajectoryError(problem)
    if with_home:
        h = mission.home
        home = Item(WAYPOINT, GLOBAL, (0.0, 0.0, 0.0, 0.0, h.latitude, h.longitude, h.altitude))
        listed = mission.home_item
        if listed is not None and listed.params[4:] != home.params[4:]:
            listed = None
        items.insert(0, listed or home)
    places = {i: seq for seq, item in enumerate(items) for i in item.ids}
    return [_pointed(item, places) for item in items]


def _pointed(item: Item, places: Mapping[int, int]) -> Item:
    target = item.params[0]
    if item.command != JUMP or target is None or int(target) not in places:
        return item
    return Item(
        item.command, item.frame, (float(places[int(target)]), *item.params[1:]), item.autocontinue, item.ids, item.raw
    )


def _pattern(item: Item) -> str:
    return str((item.raw or {}).get("complexItemType", "complex item"))[:30]
