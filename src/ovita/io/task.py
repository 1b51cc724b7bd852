"""A task read from a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from ovita.io.geodesy import Home
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory

VERDICT = "verdict"
"""What a file calls the verdict on its trajectory, in one line."""


@dataclass(frozen=True)
class Task:
    """A trajectory, its scene and an instruction, read from a file.

    Args:
        trajectory: The waypoints.
        scene: What surrounds them; empty if the file does not say.
        instruction: The request, or "".
        extra: Other top-level keys of the file, kept as they were.
        path: The file as it was named.
        robot: Name of a robot preset or path of a robot file, or None.
        notes: What had to be assumed or ignored, each a sentence for a person.
        verdict: What the file says of its own trajectory, such as "infeasible: ...", or "".
        fixed_frame: Whether the format itself fixes the axes (a ROS bag, a mission), so that another frame means
            turning the waypoints rather than reading them otherwise.
    """

    trajectory: Trajectory
    scene: Scene = field(default_factory=Scene)
    instruction: str = ""
    extra: Mapping[str, Any] = field(default_factory=dict)
    path: str = ""
    robot: str | None = None
    notes: tuple[str, ...] = ()
    fixed_frame: bool = False
    verdict: str = ""


Kind = Literal["path", "poses", "multidof"]
"""ROS messages that hold a path: nav_msgs/Path, geometry_msgs/PoseArray, trajectory_msgs/MultiDOFJointTrajectory."""


@dataclass(frozen=True)
class Choices:
    """Options that a file's name does not determine.

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
