"""One sample: drawn, realised, brought within the limits, and kept only if its own check passes then.

No sentence is read on the way: the meaning is drawn as frames, and its sentences are made from it. The check measures
the outcome (`bench.expected`) and knows nothing of the policy or of what the policy promises.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import accumulate
from random import Random
from typing import Any

import numpy as np

import ovita
from ovita.augment.ground import Ground
from ovita.augment.shards import SPLITS, AugmentedSample
from ovita.augment.wording import Drawing, NotOffered, Wordings, draw, sentences
from ovita.bench.expected import expected
from ovita.errors import OvitaError, PolicyError
from ovita.instruct.builder import PolicyBuilder
from ovita.instruct.frames import Clearance, SemanticFrame, Shift, to_json
from ovita.instruct.realise import realise
from ovita.limits import constrain
from ovita.measure.predicates import Check
from ovita.measure.predicates.check import CheckResult, Pair
from ovita.paths.geometry import lengths
from ovita.paths.trajectory import Trajectory, interpolate
from ovita.policy.policy import TooMuch
from ovita.policy.sandbox import to_trajectory
from ovita.policy.source import to_rows

TRIES = 12
"""Draws for a sample before its number stays empty."""

OWN = 6
"""Draws within a sample's own family before any family will do."""

REASONS = {
    "unfit": "the scene has not what was drawn, such as an object",
    "duplicate": "an earlier sample of the scene says nearly the same",
    "question": "it cannot be realised as it is, such as a part of the path with no waypoint",
    "policy": "the policy failed",
    "limits": "the limits cannot hold",
    "repair": "the path leaves the workspace or comes too near to an object, and few such draws are repaired",
    "preexisting": "the limits are broken as the original breaks them",
    "idle": "doing nothing passes the check as well",
    "check": "the check does not pass after the limits",
    "exhausted": "no draw for this number passed",
}
"""Why draws are rejected."""


class Rejected(Exception):
    """A draw that makes no sample; its argument is one of `REASONS`."""


@dataclass(frozen=True)
class Manner:
    """How samples are drawn.

    Args:
        families: Taken in turn.
        paraphrases: Further sentences for each sample.
        repairs: Share of the draws that break a limit with their path which go to the solver; the others are rejected.
        shares: Of the sources that go to `SPLITS`.
    """

    seed: int
    families: tuple[str, ...]
    paraphrases: int = 4
    repairs: float = 0.05
    shares: tuple[float, float, float] = (0.8, 0.1, 0.1)


@lru_cache(maxsize=64)
def split_of(source: str, shares: tuple[float, ...]) -> str:
    """The split of a source, by the hash of its name alone."""
    at = int.from_bytes(hashlib.sha256(source.encode()).digest()[:6], "big") / 2**48
    passed = sum(at >= bound for bound in accumulate(shares))
    return SPLITS[min(passed, len(SPLITS) - 1)]


@dataclass(frozen=True)
class Made:
    """A sample with the hash that near duplicates share."""

    sample: AugmentedSample
    key: str


def make(
    index: int, ground: Ground, manner: Manner, wordings: Wordings, taken: set[str], no: Counter[str]
) -> Made | None:
    """The sample of a number, or None if no draw passed; `taken` holds the keys of the scene's earlier samples."""
    for attempt in range(TRIES):
        rng = Random(f"{manner.seed}/{index}/{attempt}")
        own = manner.families[index % len(manner.families)]
        family = own if attempt < OWN else manner.families[int(rng.random() * len(manner.families))]
        try:
            made = _attempt(index, rng, family, ground, manner, wordings, taken)
        except Rejected as rejected:
            no[str(rejected)] += 1
        else:
            taken.add(made.key)
            return made
    no["exhausted"] += 1
    return None


def _attempt(
    index: int, rng: Random, family: str, ground: Ground, manner: Manner, wordings: Wordings, taken: set[str]
) -> Made:
    try:
        drawing = draw(rng, ground, family, wordings)
    except NotOffered:
        raise Rejected("unfit") from None
    frames = tuple(to_json(drawing.frames))
    key = key_of(ground.name, frames)
    if key in taken:
        raise Rejected("duplicate")
    may_repair = rng.random() < manner.repairs
    if not may_repair and not _roomy(drawing.frames, ground):
        raise Rejected("repair")
    task = ground.task
    check = _expected(drawing, ground)
    policy, proposed, contacts = _proposed(drawing, ground)
    adapted, status = _within_limits(proposed, contacts, ground, may_repair)
    judged = _judged(check, drawing.frames, adapted, ground)
    said, *others = sentences(rng, drawing, wordings, 1 + manner.paraphrases)
    sample = AugmentedSample(
        index=index,
        seed=manner.seed,
        source=ground.name,
        task=replace(task, instruction=said),
        instruction=said,
        paraphrases=tuple(others),
        frames=frames,
        adapted=adapted,
        code=policy.source(" ".join(policy.plan).replace("\\", "/").replace('"""', "'''").rstrip('"')),
        parameters=tuple(dict(vars(parameter)) for parameter in policy.parameters.values()),
        verdict="done" if adapted is proposed else "limited",
        check=check.to_dict(),
        measured=measured(drawing, task.trajectory, adapted, judged.sentence, status),
        family=family,
        split=split_of(ground.name, manner.shares),
        version=ovita.__version__,
    )
    return Made(sample, key)


def _roomy(frames: tuple[SemanticFrame, ...], ground: Ground) -> bool:
    """Whether there is room for the whole path where it is shifted to by so much; True where that is not all."""
    shifts = [frame.offset for frame in frames if isinstance(frame, Shift) and not frame.part]
    stated = [(word, q.value) for offset in shifts for word, q in offset if q is not None]
    if len(shifts) < len(frames) or len(stated) < sum(map(len, shifts)):
        return True
    shift = sum((ground.task.scene.frame.direction(word) * metres for word, metres in stated), np.zeros(3))
    return ground.legality.clear(ground.task.trajectory.positions + shift)


def _expected(drawing: Drawing, ground: Ground) -> Check:
    """The check of what was drawn; one that doing nothing passes too says nothing."""
    try:
        check = expected(drawing.frames, ground.task.trajectory, ground.task.scene)
        idle = check.passes(ground.unchanged)
    except (OvitaError, ValueError, IndexError):
        raise Rejected("question") from None
    if idle:
        raise Rejected("idle")
    return check


def _proposed(drawing: Drawing, ground: Ground) -> tuple[PolicyBuilder, Trajectory, tuple[str, ...]]:
    """The policy for what was drawn, what it makes of the trajectory, and what it means to touch."""
    trajectory, scene = ground.task.trajectory, ground.task.scene
    try:
        policy = realise(drawing.frames, trajectory, scene)
        if policy.question:
            raise Rejected("question")
        result, recorder = policy.run()
        rows = to_rows(result, ground.rows, "the policy's result")
        proposed = to_trajectory(rows, trajectory, scene, ground.reach)
    except (PolicyError, TooMuch):
        raise Rejected("policy") from None
    except (OvitaError, ValueError, IndexError):
        raise Rejected("question") from None
    touched = map(str, recorder.contacts)
    return policy, proposed, tuple(dict.fromkeys(scene[name].name for name in touched if name in scene))


def _within_limits(
    proposed: Trajectory, contacts: tuple[str, ...], ground: Ground, may_repair: bool
) -> tuple[Trajectory, str]:
    """A proposal within the limits, itself where they hold, and the status of the verdict on it."""
    legality, task = ground.legality, ground.task
    clear = legality.clear(proposed.positions, contacts)
    if clear and legality.steady(proposed):
        return proposed, "satisfied"
    if not clear and not may_repair:
        raise Rejected("repair")
    slower = legality.slowed(proposed) if clear else None
    if slower is not None:
        return slower, "repaired"
    solution = constrain(proposed, task.scene, ground.robot, original=task.trajectory, contacts=contacts)
    status = solution.verdict.status
    if status == "infeasible":
        raise Rejected("limits")
    if status == "preexisting" and legality.unbroken:
        raise Rejected("preexisting")
    return solution.trajectory, status


def _judged(check: Check, frames: tuple[SemanticFrame, ...], adapted: Trajectory, ground: Ground) -> CheckResult:
    """The check's verdict on the change."""
    after = adapted.to_array()
    if np.array_equal(ground.rows, after):
        raise Rejected("idle")
    judged = check.judge_pair(Pair(ground.rows, after, ground.task.scene))
    if not judged.passed or not _kept_clear(frames, adapted, ground):
        raise Rejected("check")
    return judged


def _kept_clear(frames: tuple[SemanticFrame, ...], adapted: Trajectory, ground: Ground) -> bool:
    """Whether distances that are stated are kept to a hundredth; the checks leave a tenth, too much for a label."""
    bounds = [frame for frame in frames if isinstance(frame, Clearance) and frame.distance.role == "at_least"]
    return all(
        ground.task.scene[name].cuboid.closest(adapted.positions)[0] >= 0.99 * bound.distance.value
        for bound in bounds
        for name in bound.objects
    )


def measured(drawing: Drawing, original: Trajectory, adapted: Trajectory, sentence: str, limits: str) -> dict[str, Any]:
    """What was measured of a change, and of what kind and size it is.

    Returns:
        "sentence" of the check; "limits", the verdict's status; "directions" and "region" of the request;
        "magnitude", its first number with its "unit"; "shift" [m], the largest displacement of the path.
    """
    frames = drawing.frames
    quantity = next((q for frame in frames for q in frame.quantities.values()), None)
    return {
        "sentence": sentence,
        "limits": limits,
        "directions": sorted({word for frame in frames for word in _directions(frame)}),
        "region": next((frame.part.kind for frame in frames if frame.part), "whole"),
        "magnitude": None if quantity is None else quantity.value,
        "unit": "" if quantity is None else quantity.unit,
        "shift": round(largest_shift(original, adapted), 6),
    }


def largest_shift(original: Trajectory, adapted: Trajectory) -> float:
    """The largest displacement of the path at the same share of the waypoints [m]."""
    there = adapted.positions
    if len(there) != len(original):
        there = interpolate(there, np.linspace(0.0, len(there) - 1.0, len(original)))
    return float(lengths(there - original.positions).max())


def _directions(frame: SemanticFrame) -> list[str]:
    """The words for where a frame changes the path or the speed to."""
    slots: Mapping[str, Any] = vars(frame)
    words = [direction for direction, _ in slots.get("offset", ())]
    said = [slots[name] for name in ("direction", "sense", "change") if slots.get(name)]
    return words + [word for word in said if word not in ("by", "to")]


def key_of(source: str, frames: Sequence[Mapping[str, Any]]) -> str:
    """The hash of a scene's name and of frames, as JSON documents, with their numbers rounded to one digit and a half.

    Two requests about the same scene whose numbers differ by less than about 10 % share it.
    """
    text = json.dumps([source, _coarse(frames)], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _coarse(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {k: _coarse(v) for k, v in value.items() if k != "said"}
    if isinstance(value, list | tuple):
        return [_coarse(item) for item in value]
    if isinstance(value, float) and value:
        return round(math.log(abs(value)) / 0.1) * math.copysign(1.0, value)
    return value
