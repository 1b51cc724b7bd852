"""Geodetic coordinates and local metres about a home position, on the WGS-84 ellipsoid.

Local metres are the tangent plane at home: x east, y north, z up, by pymap3d. Heights are taken as heights above the
ellipsoid; a height above mean sea level differs from it by the geoid's undulation (at most about 100 m), which
stretches local metres by less than 2 cm in a kilometre.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ovita.errors import RequestError
from ovita.paths.frame import RFU, Frame, transformed
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory


@dataclass(frozen=True)
class Home:
    """The place on earth where local metres have their origin.

    Args:
        latitude: [degrees], -90..90.
        longitude: [degrees], -180..180.
        altitude: [m].

    Raises:
        RequestError: On values that are no place on earth.
    """

    latitude: float
    longitude: float
    altitude: float = 0.0

    def __post_init__(self) -> None:
        for name, largest in (("latitude", 90.0), ("longitude", 180.0), ("altitude", 1e6)):
            value = getattr(self, name)
            if not abs(value) <= largest:
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

    def describe(self) -> str:
        """One line for people."""
        return f"{self.latitude:.7f}, {self.longitude:.7f}, {self.altitude:g} m"


def to_local(geodetic: Array, home: Home) -> Array:
    """Geodetic rows (N, 3) [degrees, degrees, m] as local metres (N, 3): east, north, up of home."""
    from pymap3d import geodetic2enu

    return np.column_stack(geodetic2enu(*geodetic.T, home.latitude, home.longitude, home.altitude))


def to_geodetic(local: Array, home: Home) -> Array:
    """Local metres (N, 3), east, north and up of home, as rows latitude, longitude [degrees], altitude [m]."""
    from pymap3d import enu2geodetic

    return np.column_stack(enu2geodetic(*local.T, home.latitude, home.longitude, home.altitude))


MISSION = "mission"
"""Key of `Scene.extra` that keeps the mission a trajectory came from; its local metres are those about a home."""

ROS = "ros"
"""Key of `Scene.extra` that keeps what the ROS message a trajectory came from says besides its path."""

_FLU = Frame("flu")


def on_earth(trajectory: Trajectory, scene: Scene) -> Trajectory:
    """The trajectory in metres east, north and up: front is north, but in ROS, by REP-103, x is east."""
    kept = scene.extra.get(ROS)
    in_ros = MISSION not in scene.extra and isinstance(kept, Mapping)
    if in_ros and not str((kept or {}).get("frame_id")).endswith("_ned"):
        return transformed(trajectory, scene.frame, _FLU)
    return transformed(trajectory, scene.frame, RFU)
