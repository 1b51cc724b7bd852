"""Adapting a skill by instruction: its mean is adapted as any trajectory, and the skill follows with its variance."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ovita.chain import adapt
from ovita.limits import ConstraintOptions
from ovita.paths.correspondence import correspond
from ovita.paths.geometry import path_distances
from ovita.paths.robot import UNLIMITED, Robot
from ovita.paths.trajectory import Trajectory, interpolate, nlerp
from ovita.request import FeedbackOn, Request
from ovita.result import Adaptation, accept
from ovita.sources.skills import REACHED, Skill
from ovita.sources.taskframes import logarithm
from ovita.text import counted, length
from ovita.writers.base import PolicyWriter


@dataclass(frozen=True, eq=False)
class AdaptedSkill:
    """A skill after an instruction.

    Args:
        skill: With its mean where the instruction put it; as it was where nothing was done.
        notes: What a skill cannot keep of it, each a sentence.
    """

    skill: Skill
    result: Adaptation
    notes: tuple[str, ...] = ()


def adapt_skill(
    skill: Skill,
    instruction: str,
    *,
    on: FeedbackOn = "current",
    robot: Robot | None = None,
    writer: PolicyWriter | str = "auto",
    constraints: ConstraintOptions | None = None,
    accepting: bool = False,
) -> AdaptedSkill:
    """Adapt the mean of a skill to an instruction, and move the skill there.

    What was learned stays as it is, so covariance, task frames, and what generating does with ends and via-points are
    kept exactly. Each phase is moved by as much as the instruction moved its waypoint, in the world's axes, and gets
    its new speed. The limits are enforced on the mean as it was shown, not on what is generated later.

    The instruction is about the skill as it is now, or on "original" about what was shown; with `accepting`, a reading
    that is not certain is done without asking.

    Raises:
        RequestError: If the instruction is empty or too long.
    """
    before = skill if on == "current" else replace(skill, offset=None, pace=None, edits=())
    mean = before.generate().trajectory
    limits = UNLIMITED if robot is None else robot
    result = adapt(Request(instruction, mean, skill.scene, limits), writer=writer, constraints=constraints)
    if accepting and result.proposal is not None:
        result = accept(result)
    if not result.usable:
        return AdaptedSkill(skill, result)
    return AdaptedSkill(*moved(before, mean, result))


def moved(skill: Skill, mean: Trajectory, result: Adaptation) -> tuple[Skill, Adaptation, tuple[str, ...]]:
    """The skill with its mean where an adaptation of that mean put it, and what could not be kept."""
    adapted, notes, most = result.adapted, [], REACHED * skill.size
    there, spread = _matched(mean, adapted), adapted.resample(len(mean))
    gap, other = (float(path_distances(one.positions, adapted.positions).max()) for one in (there, spread))
    if gap > most and other < gap:
        there, gap = spread, other
        notes.append("the path was drawn anew, so the variance now belongs to shares of its length")
    if gap > most:
        notes.append(f"{counted(len(mean), 'phase')} do not hold every turn of it: it is off by up to {length(gap)}")
    if adapted.dwells.sum() > mean.dwells.sum():
        notes.append("a skill keeps no pauses; they are left out")
    by, base = there.positions - mean.positions, skill.base()
    if base is not None and mean.orientations is not None and there.orientations is not None:
        by = np.column_stack([by, logarithm(base, there.orientations) - logarithm(base, mean.orientations)])
    offset = by if skill.offset is None else skill.offset + by
    doubts = (*skill.notes, result.verdict) if result.verdict else skill.notes
    edits = (*skill.edits, result.instruction)
    edited = replace(skill, offset=offset, pace=there.speeds, edits=edits, notes=doubts)
    return edited, result, tuple(notes)


def _matched(mean: Trajectory, adapted: Trajectory) -> Trajectory:
    """For each waypoint of the mean its counterpart in the adapted path; those taken out lie between the others."""
    found = correspond(mean.positions, adapted.positions).forward
    every = np.arange(len(mean), dtype=float)
    kept = np.isfinite(found)
    where = np.interp(every, every[kept], found[kept])
    where[0], where[-1] = 0.0, len(adapted) - 1.0
    turns = None if adapted.orientations is None else nlerp(adapted.orientations, where)
    speeds = interpolate(adapted.speeds[:, None], where)[:, 0]
    return Trajectory(interpolate(adapted.positions, where), speeds, turns, adapted.timestep)
