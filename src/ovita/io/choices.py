"""What a person may choose where a format leaves it open."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ovita.io.geodesy import Home

Kind = Literal["path", "poses", "multidof"]
"""ROS messages that hold a path: nav_msgs/Path, geometry_msgs/PoseArray, trajectory_msgs/MultiDOFJointTrajectory."""


@dataclass(frozen=True)
class Choices:
    """What is not said by a file's name.

    Args:
        topic: The topic of a bag, or None for the only one that fits.
        message: Which message on that topic, counted from 0, negative from the end; None for the last.
        kind: The message to write to a bag, or None for that of the file it came from, else a path.
        frame_id: The ROS frame to write, or None for that of the file it came from, else "map".
        home: Where the local metres of a mission have their origin, or None for the file's own.
    """

    topic: str | None = None
    message: int | None = None
    kind: Kind | None = None
    frame_id: str | None = None
    home: Home | None = None


NONE = Choices()
"""No choice made."""
