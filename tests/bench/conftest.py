"""A small dataset of scene files with checks."""

import json
from importlib.resources import files
from types import SimpleNamespace

import bench_writers
import pytest

from ovita.bench.dataset import load_dataset
from ovita.bench.evaluate import Protocol, conditions_from
from ovita.bench.runner import RunPlan, run
from ovita.measure.predicates import all_of, moved, near, slower, speeds_kept

LEARNER = "python:bench_writers:Learner"
TASKS = [
    ("go left by 0.2", moved(left=0.2)),
    ("slow down near the cup", slower(where=near("cup"))),
    ("go right by 0.1", all_of(moved(right=0.1), speeds_kept())),
    ("go up by 0.1", moved(up=0.1)),
    ("fribble the zorp", moved("left")),
    ("go left by 0.2 m", all_of(moved(left=0.2), speeds_kept())),
]


@pytest.fixture
def dataset(tmp_path):
    """A folder with two subsets of three samples."""
    return write_toys(tmp_path / "toys")


@pytest.fixture(scope="session")
def outcome(tmp_path_factory):
    """A run of two writers with feedback and an ablation, never changed by a test, and its folder as `.folder`."""
    folder = tmp_path_factory.mktemp("bench")
    plan = RunPlan(
        writers=("builtin", LEARNER),
        conditions=conditions_from("examples,temperature=0,0.5"),
        protocol=Protocol(feedback=1),
        jobs=1,
    )
    done = run(load_dataset(write_toys(folder / "toys")), folder / "run", plan)
    return SimpleNamespace(records=done.records, manifest=done.manifest, folder=folder / "run")


def write_toys(root):
    base = json.loads((files("ovita") / "data" / "tabletop.json").read_text(encoding="utf-8"))
    for i, (instruction, check) in enumerate(TASKS):
        file = root / ("a" if i < 3 else "b") / f"s_{i}.json"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps({**base, "instruction": instruction, "check": check.to_dict(), "kind": f"k{i % 2}"}))
    return root


@pytest.fixture(autouse=True)
def fresh_writers():
    for item in vars(bench_writers).values():
        if isinstance(item, type) and hasattr(item, "prompts"):
            item.prompts.clear()
