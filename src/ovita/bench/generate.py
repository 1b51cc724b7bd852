"""Datasets without end: random scenes, instructions from a grammar, and checks that are known to be fulfillable."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.random import Generator

from ovita.bench.grammar import FAMILIES, SETTINGS, Clause, Maker, Setting, Split, random_scene
from ovita.bench.grammar.clauses import TOGETHER
from ovita.bench.grammar.lexicon import JOINS
from ovita.bench.samples import Sample
from ovita.errors import FormatError, OvitaError, RequestError
from ovita.io import Task, load_robot, save_task
from ovita.limits import constrain
from ovita.measure import predicates as checks
from ovita.measure.predicates import Check
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory

TRIES = 200
"""Draws before a sample is given up."""


def generate(
    n: int,
    *,
    seed: int = 0,
    split: Split = "train",
    families: Sequence[str] = (),
    robots: Sequence[str] = (),
) -> Iterator[Sample]:
    """Draw samples, each with a check that doing nothing fails and that a known edit passes within the robot's limits.

    Sample i depends on the seed, the split and i only, not on n.

    Args:
        n: How many.
        seed: Of the random numbers.
        split: Whose words are used; held-out instructions have words that no train instruction has.
        families: Of `FAMILIES`; all if empty.
        robots: Of `SETTINGS`; all if empty.

    Raises:
        RequestError: If a family or a robot is unknown.
    """
    chosen = _among("family", families, tuple(FAMILIES))
    scales = _among("robot", robots, tuple(SETTINGS))
    for i in range(n):
        rng = np.random.default_rng([seed, 0 if split == "train" else 1, i])
        family, scale = chosen[i % len(chosen)], scales[(i // len(chosen)) % len(scales)]
        yield _sample(rng, family, scale, split, i, seed)


def write_dataset(
    folder: str | os.PathLike[str],
    *,
    n: int,
    seed: int = 0,
    split: Split = "train",
    families: Sequence[str] = (),
    robots: Sequence[str] = (),
) -> int:
    """Write drawn samples as scene files with the further keys check, kind, subset and source; return how many.

    Raises:
        RequestError: If a family or robot is unknown, or the folder holds other .json files.
        FormatError: If a file cannot be written.
    """
    root = Path(folder)
    if root.exists() and any(root.rglob("*.json")):
        raise RequestError(f"{root} holds .json files already, which would become part of the dataset; name another")
    count = 0
    for sample in generate(n, seed=seed, split=split, families=families, robots=robots):
        file = root / f"{sample.id}.json"
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FormatError(str(file.parent), f"cannot be made: {error.strerror}") from None
        save_task(file, sample.task)
        count += 1
    return count


def _sample(rng: Generator, family: str, scale: str, split: Split, index: int, seed: int) -> Sample:
    setting = SETTINGS[scale]
    for _ in range(TRIES):
        trajectory, scene = random_scene(rng, setting, split)
        if len(scene) < 2:
            continue
        maker = Maker(rng, trajectory, scene, split, flat=setting.half[2] == 0.0)
        clauses = _draw(rng, maker, family)
        check = _whole(clauses)
        if not _sound(clauses, check, trajectory, scene, setting):
            continue
        text = clauses[0].text
        for clause in clauses[1:]:
            text += str(rng.choice(np.array(JOINS[split]))) + clause.text
        kind = clauses[0].kind if len(clauses) == 1 else "several"
        extra = {
            "check": check.to_dict(),
            "kind": kind,
            "subset": family,
            "source": {"generator": "ovita bench", "split": split, "seed": seed, "index": index, "scale": scale},
        }
        name = f"{family}/{scale}_{index:05d}"
        robot = None if setting.robot == "none" else setting.robot
        return Sample(name, family, kind, Task(trajectory, scene, text, extra, robot=robot), check)
    raise AssertionError(f"no {family} sample at the scale {scale} was found in {TRIES} draws")


def _draw(rng: Generator, maker: Maker, family: str) -> list[Clause]:
    if family != "multi":
        names = FAMILIES[family]
        return [maker.make(names[int(rng.integers(len(names)))])]
    left, right = TOGETHER[0] if rng.uniform() < 0.7 else TOGETHER[1]
    return [maker.make(str(rng.choice(np.array(part)))) for part in (left, right)]


def _whole(clauses: Sequence[Clause]) -> Check:
    """Every clause, and that what no clause is about stays as it was."""
    slots = {clause.slot for clause in clauses}
    parts = [clause.check for clause in clauses]
    if slots == {"speed"}:
        parts.append(checks.same_path())
    if slots == {"path"} and all(clause.name != "extend" for clause in clauses):
        parts.append(checks.speeds_kept())
    return parts[0] if len(parts) == 1 else checks.all_of(*parts)


def _sound(clauses: Sequence[Clause], check: Check, trajectory: Trajectory, scene: Scene, setting: Setting) -> bool:
    """Whether doing nothing fails, each clause is needed, and the clauses' own edits pass, limits included."""
    if any(clause.check.judge(trajectory, trajectory, scene).passed for clause in clauses):
        return False
    rows = trajectory.to_array()
    try:
        for clause in clauses:
            rows = clause.edit(rows)
        answer = Trajectory.from_array(rows)
        if not check.judge(trajectory, answer, scene).passed:
            return False
        solution = constrain(answer, scene, load_robot(setting.robot), original=trajectory)
    except OvitaError:
        return False
    limits_hold = solution.verdict.status in ("satisfied", "repaired")
    return limits_hold and check.judge(trajectory, solution.trajectory, scene).passed


def _among(what: str, given: Sequence[str], known: tuple[str, ...]) -> tuple[str, ...]:
    unknown = [name for name in given if name not in known]
    if unknown:
        raise RequestError(f"there is no {what} {unknown[0]!r}; choose from {', '.join(known)}")
    return tuple(dict.fromkeys(given)) or known
