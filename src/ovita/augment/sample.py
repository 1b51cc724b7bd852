"""One augmented sample: words, a motion before and after, and what was measured of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ovita.io import Task, scene_dict, trajectory_rows
from ovita.io.documents import scene_from_dict
from ovita.io.waypoints import trajectory_from_rows
from ovita.measure.predicates import Check
from ovita.paths.trajectory import Trajectory

SPLITS = ("train", "val", "test")
"""Where a sample belongs; all samples of a scene are in the same."""


@dataclass(frozen=True)
class AugmentedSample:
    """A sentence, what it means, and a motion that does it: kept only since its own check passed after the limits.

    Args:
        index: Its number; with the seed it determines everything else.
        seed: Of the dataset.
        source: Where trajectory and scene come from, such as "random:drone/00012" or "file:scene.json"; samples of
            one source share their split.
        task: The original trajectory with its scene, robot and instruction.
        instruction: The sentence; that of the task.
        paraphrases: Other sentences of the same meaning.
        frames: What the sentence means, as JSON documents (`instruct.frames.from_json` reads them).
        adapted: The trajectory after the limits.
        code: The policy that made it.
        parameters: The policy's parameters, as JSON documents.
        verdict: "done", or "limited" where the limits changed the proposal.
        check: What had to hold, as a JSON document (`Check.from_dict` reads it).
        measured: What the check measured, and of what kind and size the change is: "sentence", "directions", "region",
            "magnitude" [m, or a factor on the speed] and "shift" [m], the largest displacement.
        family: The kind of request.
        split: Of SPLITS.
        version: Of ovita.
    """

    index: int
    seed: int
    source: str
    task: Task
    instruction: str
    paraphrases: tuple[str, ...]
    frames: tuple[Mapping[str, Any], ...]
    adapted: Trajectory
    code: str
    parameters: tuple[Mapping[str, Any], ...]
    verdict: str
    check: Mapping[str, Any]
    measured: Mapping[str, Any]
    family: str
    split: str
    version: str

    def holds(self) -> bool:
        """Whether the sample's check passes on its motion, judged anew."""
        check = Check.from_dict(self.check)
        return check.judge(self.task.trajectory, self.adapted, self.task.scene).passed

    def to_dict(self) -> dict[str, Any]:
        """The sample as a JSON document, which `from_dict` reads."""
        task = self.task
        return {
            "index": self.index,
            "seed": self.seed,
            "source": self.source,
            "split": self.split,
            "family": self.family,
            "instruction": self.instruction,
            "paraphrases": list(self.paraphrases),
            "frames": [dict(frame) for frame in self.frames],
            "robot": task.robot,
            "scene": scene_dict(task.scene),
            "timestep": task.trajectory.timestep,
            "trajectory": trajectory_rows(task.trajectory),
            "adapted": trajectory_rows(self.adapted),
            "code": self.code,
            "parameters": [dict(parameter) for parameter in self.parameters],
            "verdict": self.verdict,
            "check": dict(self.check),
            "measured": dict(self.measured),
            "version": self.version,
        }

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> AugmentedSample:
        """The sample that `to_dict` wrote.

        Raises:
            FormatError: If its trajectories or its scene cannot be read.
        """
        scene = scene_from_dict(document["scene"])
        said = document["instruction"]
        task = Task(_trajectory(document, "trajectory"), scene, said, robot=document["robot"])
        plain = ("index", "seed", "source", "code", "verdict", "check", "measured", "family", "split", "version")
        listed = {key: tuple(document[key]) for key in ("paraphrases", "frames", "parameters")}
        values: dict[str, Any] = {key: document[key] for key in plain} | listed
        return cls(task=task, instruction=said, adapted=_trajectory(document, "adapted"), **values)


def _trajectory(document: Mapping[str, Any], key: str) -> Trajectory:
    return trajectory_from_rows(document[key], key=key, timestep=document["timestep"])
