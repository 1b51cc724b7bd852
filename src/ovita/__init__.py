"""ovita: change how a robot moves by saying so.

    import ovita as ov

    result = ov.adapt(ov.load("scene.json"), "go left by 0.1 and slow down near the cup", robot="drone")

`adapt` takes tasks, trajectories, arrays and files, and returns an `Adaptation`; a conversation is a `Session`, many
files a `batch`. Names are imported on first use, so that `import ovita` is instant.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ovita.chain import adapt, batch, rerun
    from ovita.dialogue.session import Session
    from ovita.errors import OvitaError
    from ovita.io import Task, load, load_robot, load_task, save_task, save_trajectory
    from ovita.limits import ConstraintOptions, Verdict, constrain, verify
    from ovita.measure import Changes, compare
    from ovita.paths.robot import Robot
    from ovita.paths.scene import Frame, Scene, SceneObject
    from ovita.paths.trajectory import Trajectory
    from ovita.policy import Policy
    from ovita.request import Request
    from ovita.result import Adaptation, accept
    from ovita.sources.learning import learn
    from ovita.sources.planner import Plan, plan
    from ovita.sources.skills import Skill
    from ovita.sources.words import Generation, from_words
    from ovita.writers.base import PolicyWriter, Prompt, Reply, ground, writer_named

__version__ = "0.1.0"

_HOMES = {
    "Adaptation": "result",
    "Changes": "measure",
    "ConstraintOptions": "limits",
    "Frame": "paths.scene",
    "Generation": "sources.words",
    "OvitaError": "errors",
    "Plan": "sources.planner",
    "Policy": "policy",
    "PolicyWriter": "writers.base",
    "Prompt": "writers.base",
    "Reply": "writers.base",
    "Request": "request",
    "Robot": "paths.robot",
    "Scene": "paths.scene",
    "SceneObject": "paths.scene",
    "Session": "dialogue.session",
    "Skill": "sources.skills",
    "Task": "io",
    "Trajectory": "paths.trajectory",
    "Verdict": "limits",
    "accept": "result",
    "adapt": "chain",
    "batch": "chain",
    "compare": "measure",
    "constrain": "limits",
    "from_words": "sources.words",
    "ground": "writers.base",
    "learn": "sources.learning",
    "load": "io",
    "load_robot": "io",
    "load_task": "io",
    "plan": "sources.planner",
    "rerun": "chain",
    "save_task": "io",
    "save_trajectory": "io",
    "verify": "limits",
    "writer_named": "writers.base",
}

__all__ = [
    "Adaptation",
    "Changes",
    "ConstraintOptions",
    "Frame",
    "Generation",
    "OvitaError",
    "Plan",
    "Policy",
    "PolicyWriter",
    "Prompt",
    "Reply",
    "Request",
    "Robot",
    "Scene",
    "SceneObject",
    "Session",
    "Skill",
    "Task",
    "Trajectory",
    "Verdict",
    "accept",
    "adapt",
    "batch",
    "compare",
    "constrain",
    "from_words",
    "ground",
    "learn",
    "load",
    "load_robot",
    "load_task",
    "plan",
    "rerun",
    "save_task",
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
