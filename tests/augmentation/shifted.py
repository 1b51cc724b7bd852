"""Samples whose words, check and motion are one shift of a random path: quick to make, and right by construction."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ovita.augment.shards import AugmentedSample
from ovita.bench.generate import SETTINGS, random_scene
from ovita.io import Task
from ovita.measure import predicates as checks
from ovita.paths.trajectory import Trajectory


def samples(count: int, *, seed: int = 0, turned: bool = False) -> Iterator[AugmentedSample]:
    """Samples 0, 1, ...; of ten in a row, eight are for training, and one each for validation and test."""
    yield from (_sample(index, seed, turned) for index in range(count))


def _sample(index: int, seed: int, turned: bool) -> AugmentedSample:
    rng = np.random.default_rng([seed, index])
    path, scene = random_scene(rng, SETTINGS["drone"], "train")
    if turned:
        angles = np.linspace(0.0, rng.uniform(0.2, 1.0), len(path))
        turns = np.column_stack([np.cos(angles / 2), np.zeros((len(path), 2)), np.sin(angles / 2)])
        path = Trajectory(path.positions, path.speeds, turns)
    by = round(float(rng.uniform(0.05, 0.3)), 2)
    said = f"Go up by {by}"
    split = {8: "val", 9: "test"}.get(index % 10, "train")
    check = checks.moved(up=by)
    return AugmentedSample(
        index=index,
        seed=seed,
        source=f"random:drone/{index:05d}",
        task=Task(path, scene, said, robot="drone"),
        instruction=said,
        paraphrases=(f"Move the path {by} m higher", f"raise everything by {by}"),
        frames=({"frame": "Shift", "offset": [["up", {"value": by, "unit": "m"}]]},),
        adapted=path.with_(positions=path.positions + np.array([0.0, 0.0, by])),
        code=f"up = {by}\n",
        parameters=({"name": "up", "value": by, "unit": "m"},),
        verdict="done",
        check=check.to_dict(),
        measured={"sentence": f"moved {by} m", "directions": ["up"], "region": "all", "magnitude": by, "shift": by},
        family="distance",
        split=split,
        version="0.1.0",
    )
