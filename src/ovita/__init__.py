"""ovita: change how a robot moves by saying so.

The chain is `adapt(Request(instruction, trajectory, scene, robot))`, which returns an `Adaptation`; a conversation is
a `Session`; files are read with `load_task`. Names are imported on first use, so that `import ovita` is instant.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ovita.adaptation import Adaptation
    from ovita.chain import adapt, rerun
    from ovita.changes import Changes, measure
    from ovita.constraints import ConstraintOptions, Verdict, constrain, verify
    from ovita.errors import OvitaError
    from ovita.formats import load_robot, load_task, save_trajectory
    from ovita.language.grounding import ground
    from ovita.language.request import Prompt, Reply, Request
    from ovita.language.writer import PolicyWriter, writer_named
    from ovita.policy import Policy
    from ovita.robot import Robot
    from ovita.scene import Frame, Scene, SceneObject
    from ovita.session import Session
    from ovita.trajectory import Trajectory

__version__ = "0.1.0"

_HOMES = {
    "Adaptation": "adaptation",
    "Changes": "changes",
    "ConstraintOptions": "constraints",
    "Frame": "scene",
    "OvitaError": "errors",
    "Policy": "policy",
    "PolicyWriter": "language.writer",
    "Prompt": "language.request",
    "Reply": "language.request",
    "Request": "language.request",
    "Robot": "robot",
    "Scene": "scene",
    "SceneObject": "scene",
    "Session": "session",
    "Trajectory": "trajectory",
    "Verdict": "constraints",
    "adapt": "chain",
    "constrain": "constraints",
    "ground": "language.grounding",
    "load_robot": "formats",
    "load_task": "formats",
    "measure": "changes",
    "rerun": "chain",
    "save_trajectory": "formats",
    "verify": "constraints",
    "writer_named": "language.writer",
}

__all__ = [
    "Adaptation",
    "Changes",
    "ConstraintOptions",
    "Frame",
    "OvitaError",
    "Policy",
    "PolicyWriter",
    "Prompt",
    "Reply",
    "Request",
    "Robot",
    "Scene",
    "SceneObject",
    "Session",
    "Trajectory",
    "Verdict",
    "adapt",
    "constrain",
    "ground",
    "load_robot",
    "load_task",
    "measure",
    "rerun",
    "save_trajectory",
    "verify",
    "writer_named",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'ovita' has no attribute {name!r}")
    value = getattr(import_module(f"ovita.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
