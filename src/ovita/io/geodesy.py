"""Geodetic coordinates and local metres about a home position, on the WGS-84 ellipsoid.

Local metres are the tangent plane at home: x east, y north, z up, by pymap3d. Heights are taken as heights above the
ellipsoid; a height above mean sea level differs from it by the geoid's undulation (at most about 100 m), which
stretches local metres by less than 2 cm in a kilometre.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ovita.errors import RequestError
from ovita.paths.scene import RFU, Frame, Scene, rotated, transformed
from ovita.paths.trajectory import Array, Trajectory


@dataclass(frozen=True)
class Home:
    """The place on earth where local metres have their origin, and where their front points.

    Args:
        latitude: [degrees], -90..90.
        longitude: [degrees], -180..180.
        altitude: [m], or None where nobody said it: heights above home need none, those above the sea do.
        heading: Of the front, clockwise from north [degrees]; None where nobody said it, which is north.

    Raises:
        RequestError: On values that are no place on earth.
    """

    latitude: float
    longitude: float
    altitude: float | None = None
    heading: float | None = None

    def __post_init__(self) -> None:
        for name, largest in (("latitude", 90.0), ("longitude", 180.0), ("altitude", 1e6), ("heading", 360.0)):
            value = getattr(self, name)
            if value is not None and not abs(value) <= largest:
                raise RequestError(f"the home's {name} {value:g} is not within {-largest:g}..{largest:g}")

    @classmethod
    def parse(cls, text: str) -> Home:
        """A home from "latitude,longitude,altitude" in degrees and metres; the altitude may be left out."""
        try:
            values = [float(part) for part in text.split(",")]
        except ValueError:
            values = []
        if len(values) not in (2, 3):
            raise RequestError(f"the home {text!r} is not latitude,longitude,altitude, such as 47.3977,8.5456,488")
        return cls(*values)

    @property
    def height(self) -> float:
        """The altitude [m], 0 where nobody said it."""
        return self.altitude or 0.0

    def describe(self) -> str:
        """One line for people."""
        height = "no altitude given" if self.altitude is None else f"{self.altitude:g} m"
        return f"{self.latitude:.7f}, {self.longitude:.7f}, {height}"

    def axes(self, *, ros: bool = False) -> str:
        """Where the axes point, in words; of a ROS frame, unless a heading says it, REP-103 does."""
        if self.heading:
            return f"front is {self.heading:g} degrees clockwise from north"
        return "x of the ROS frame is east, y north" if ros and self.heading is None else "front is north"


def to_local(geodetic: Array, home: Home) -> Array:
    """Geodetic rows (N, 3) [degrees, degrees, m] as local metres (N, 3): east, north, up of home."""
    from pymap3d import geodetic2enu

    return np.column_stack(geodetic2enu(*geodetic.T, home.latitude, home.longitude, home.height))


def to_geodetic(local: Array, home: Home) -> Array:
    """Local metres (N, 3), east, north and up of home, as rows latitude, longitude [degrees], altitude [m]."""
    from pymap3d import enu2geodetic

    return np.column_stack(enu2geodetic(*local.T, home.latitude, home.longitude, home.height))


MISSION = "mission"
"""Key of `Scene.extra` that keeps the mission a trajectory came from; its local metres are those about a home."""

ROS = "ros"
"""Key of `Scene.extra` that keeps what the ROS message a trajectory came from says besides its path."""

_FLU = Frame("flu")


def yaw(degrees: float | None) -> Array:
    """The matrix (3, 3) that turns counterclockwise from above; minus a heading turns local metres into the earth's."""
    c, s = np.cos(np.radians(degrees or 0.0)), np.sin(np.radians(degrees or 0.0))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def about_home(trajectory: Trajectory, scene: Scene, heading: float | None = None) -> Trajectory:
    """The trajectory in metres right, front and up; of a ROS frame, unless a heading is given, east, north and up."""
    kept = scene.extra.get(ROS)
    in_ros = heading is None and MISSION not in scene.extra and isinstance(kept, Mapping)
    if in_ros and not str((kept or {}).get("frame_id")).endswith("_ned"):
        return transformed(trajectory, scene.frame, _FLU)
    return transformed(trajectory, scene.frame, RFU)


def on_earth(trajectory: Trajectory, scene: Scene, heading: float | None = None) -> Trajectory:
    """The trajectory in metres east, north and up.

    Front points to the heading [degrees clockwise from north], else to that of the mission that the scene keeps, else
    north; but in ROS, by REP-103, x is east.
    """
    mission = scene.extra.get(MISSION)
    home = mission.get("home") if isinstance(mission, Mapping) else None
    if heading is None and isinstance(home, Sequence) and len(home) > 3 and isinstance(home[3], int | float):
        heading = home[3]
    local = about_home(trajectory, scene, heading)
    return rotated(local, yaw(-heading)) if heading else local
