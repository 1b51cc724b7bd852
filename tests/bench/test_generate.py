"""Generated datasets are reproducible, fulfillable, judged by checks that reject doing nothing, and split by word."""

import re
from pathlib import Path

import numpy as np
import pytest

from ovita.bench.dataset import load_dataset
from ovita.bench.generate import (
    CLAUSES,
    DEGREES,
    FAMILIES,
    MAKERS,
    NAMES,
    PLACES,
    SETTINGS,
    SIDES,
    ClauseMaker,
    generate,
    random_scene,
    vocabulary,
    words,
    write_dataset,
)
from ovita.errors import RequestError
from ovita.paths.robot import Robot
from ovita.paths.trajectory import Trajectory


def spoken(sample):
    """The words of an instruction without the objects' names."""
    text = sample.task.instruction
    for name in sorted(sample.task.scene.names, key=len, reverse=True):
        text = re.sub(rf"\b{re.escape(name)}\b", " ", text)
    return words(text)


@pytest.fixture(scope="module")
def drawn():
    return {split: list(generate(24, seed=3, split=split)) for split in ("train", "heldout")}


def test_every_heldout_instruction_has_a_word_that_train_never_has(drawn):
    train = vocabulary("train")
    for sample in drawn["train"]:
        assert spoken(sample) <= train, sample.task.instruction
    for sample in drawn["heldout"]:
        assert spoken(sample) - train, sample.task.instruction


def test_no_heldout_phrase_can_be_said_with_train_words():
    train = vocabulary("train")
    for name, phrases in CLAUSES.items():
        for phrase in phrases["heldout"]:
            assert words(phrase) - train, (name, phrase)
    for table in (*CLAUSES.values(), *DEGREES.values(), *SIDES.values(), *PLACES.values()):
        assert not set(table["train"]) & set(table["heldout"])
    assert not words(" ".join(NAMES["train"])) & words(" ".join(NAMES["heldout"]))


def test_the_same_seed_gives_the_same_samples_whatever_their_number(drawn):
    again = list(generate(5, seed=3))
    assert again == drawn["train"][:5]
    assert [s.task.trajectory for s in generate(5, seed=4)] != [s.task.trajectory for s in again]


@pytest.mark.parametrize("split", ["train", "heldout"])
def test_doing_nothing_fails_and_limits_hold_before(drawn, split):
    for sample in drawn[split]:
        task = sample.task
        assert not sample.check.judge(task.trajectory, task.trajectory, task.scene).passed, sample.id
        robot = Robot.preset(task.robot or "none")
        if robot.workspace is not None:
            assert (robot.workspace.inside(task.trajectory.positions) >= 0).all(), sample.id
        assert robot.max_speed is None or task.trajectory.speeds.max() <= robot.max_speed


def test_families_and_scales_take_turns(drawn):
    assert {s.subset for s in drawn["train"]} == set(FAMILIES)
    assert {s.task.extra["source"]["scale"] for s in drawn["train"]} == set(SETTINGS)
    assert {s.kind for s in drawn["train"] if s.subset == "multi"} == {"several"}
    only = list(generate(4, families=["numeric"], robots=["ground"]))
    assert {(s.subset, s.task.robot) for s in only} == {("numeric", "ground")}
    assert all((s.task.trajectory.positions[:, 2] == 0).all() for s in only)


@pytest.mark.parametrize("split", ["train", "heldout"])
def test_every_clause_can_be_drawn_and_its_own_edit_passes(split):
    assert [name for name in MAKERS if not fulfilled(name, split)] == []


def fulfilled(name, split):
    """Whether a clause of that name is fulfilled by its own edit, and not by doing nothing, in some scene."""
    for seed in range(60):
        rng = np.random.default_rng(seed)
        trajectory, scene = random_scene(rng, SETTINGS["drone"], split)
        clause = ClauseMaker(rng, trajectory, scene, split, flat=False).make(name)
        assert "{" not in clause.text and "  " not in clause.text
        adapted = Trajectory.from_array(clause.edit(trajectory.to_array()))
        nothing = clause.check.judge(trajectory, trajectory, scene).passed
        if not nothing and clause.check.judge(trajectory, adapted, scene).passed:
            return True
    return False


def test_files_load_as_the_samples_that_were_drawn(tmp_path):
    assert write_dataset(tmp_path / "d", generate(6, seed=1)) == 6
    loaded = {s.id: s for s in load_dataset(tmp_path / "d").samples}
    for sample in generate(6, seed=1):
        read = loaded[sample.id]
        assert (read.check, read.kind, read.subset) == (sample.check, sample.kind, sample.subset)
        assert read.task.trajectory == sample.task.trajectory and read.task.scene == sample.task.scene
        assert read.task.instruction == sample.task.instruction and read.task.robot == sample.task.robot
    with pytest.raises(RequestError, match="already"):
        write_dataset(tmp_path / "d", generate(1))


def test_unknown_names_are_refused_with_the_known_ones(tmp_path):
    with pytest.raises(RequestError, match="latte, numeric, multi"):
        next(generate(1, families=["haiku"]))
    with pytest.raises(RequestError, match="tabletop, drone, ground, arm"):
        write_dataset(tmp_path / "x", generate(1, robots=["submarine"]))
    assert not Path(tmp_path / "x").exists()
