"""The cases against hand-made adaptations: right ones pass; doing nothing, the opposite and other wrong ones fail."""

from pathlib import Path

import handmade_extended  # noqa: F401
import handmade_robots  # noqa: F401
import pytest
from handmade import RIGHT, WRONG

from ovita.bench.dataset import shipped_cases
from ovita.io import load_task
from ovita.measure.predicates import Check
from ovita.paths.trajectory import Trajectory

FOLDER = Path(__file__).parents[3] / "shared" / "data" / "ovita-dev"
CASES = tuple(shipped_cases().values())

needs_data = pytest.mark.skipif(
    not FOLDER.is_dir(), reason="needs the public OVITA files, which are not part of the project"
)

DONE_ALREADY = {
    # The sample's original already ends where the instruction wants to go on to.
    "extended_subset/extended_53",
}
HARMLESS = {
    # Aimed at another object, but the asked-for effect on the right one is there all the same and is as large.
    ("latte_subset/latte_0", "wrong object"),
    ("latte_subset/latte_14", "wrong object"),
    ("latte_subset/latte_43", "wrong object"),
    ("latte_subset/latte_59", "wrong object"),
    ("robot_subset/Drone/drone_trajectory_2", "wrong object"),
    ("robot_subset/Ground_robot/trajectory_22", "wrong object"),
}


def judged(case, edit):
    task = load_task(FOLDER / f"{case.id}.json")
    adapted = Trajectory.from_array(edit(task.trajectory.to_array(), task.scene))
    return case.check.judge(task.trajectory, adapted, task.scene)


def test_there_is_a_case_for_each_sample_by_id():
    assert len(CASES) == 114
    for case in CASES:
        assert shipped_cases()[case.id] is case
        assert Check.from_dict(case.check.to_dict()) == case.check
    assert {case.subset for case in CASES} == {"latte", "extended", "drone", "ground", "arm"}


def test_each_case_has_hand_made_adaptations():
    assert {case.id for case in CASES} == set(RIGHT) == set(WRONG)
    assert all(RIGHT.values()) and all(WRONG.values())


@needs_data
def test_the_ids_are_those_of_the_files():
    assert {str(p.relative_to(FOLDER).with_suffix("")) for p in FOLDER.rglob("*.json")} == {case.id for case in CASES}


SUBSETS = sorted({case.subset for case in CASES})


@needs_data
@pytest.mark.parametrize("subset", SUBSETS)
def test_doing_nothing_fails(subset):
    passing = {case.id for case in of(subset) if judged(case, lambda rows, scene: rows).passed}
    assert passing == DONE_ALREADY & {case.id for case in of(subset)}


@needs_data
@pytest.mark.parametrize("subset", SUBSETS)
def test_right_adaptations_pass(subset):
    verdicts = [(case.id, judged(case, edit)) for case in of(subset) for edit in RIGHT[case.id]]
    assert [(id, verdict.sentence) for id, verdict in verdicts if not verdict.passed] == []


@needs_data
@pytest.mark.parametrize("subset", SUBSETS)
def test_wrong_adaptations_fail(subset):
    edits = [(case, name, edit) for case in of(subset) for name, edit in WRONG[case.id]]
    passing = {(case.id, name) for case, name, edit in edits if judged(case, edit).passed}
    assert passing == {key for key in HARMLESS if key[0] in {case.id for case in of(subset)}}


def of(subset):
    return [case for case in CASES if case.subset == subset]
