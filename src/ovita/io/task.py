"""A task: what a file asks for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory


@dataclass(frozen=True)
class Task:
    """What a file holds: a trajectory, and what is to be done with it.

    Args:
        trajectory: The waypoints.
        scene: What surrounds them; empty if the file does not say.
        instruction: The request, or "".
        extra: Other top-level keys of the file, kept as they were.
        path: The file as it was named.
        robot: Name of a robot preset or path of a robot file, or None.
        notes: What had to be assumed or ignored, each a sentence for a person.
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
