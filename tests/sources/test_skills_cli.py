"""`ovita learn` and `ovita generate`."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from shown import demonstrations, reaching

from ovita.cli.main import cli
from ovita.errors import OvitaError
from ovita.io import load_task, save_task, save_trajectory


def ovita(*words: object) -> Result:
    return CliRunner().invoke(cli, [str(word) for word in words])


@pytest.fixture
def demos(tmp_path: Path) -> list[str]:
    for i, one in enumerate(demonstrations(4)):
        save_trajectory(tmp_path / f"{i}.csv", one)
    return [str(tmp_path / f"{i}.csv") for i in range(4)]


def test_learn_and_generate(demos, tmp_path):
    done = ovita("learn", *demos, "--out", tmp_path / "skill.json")
    assert done.exit_code == 0, done.output
    assert "Learned a kmp from 4 demonstrations: " in done.output and "varying by" in done.output
    out = tmp_path / "task.json"
    done = ovita("generate", tmp_path / "skill.json", "--goal", "0.7,0,0.25", "--via", "0.5: 0.3,0.1,0.4", "--out", out)
    assert done.exit_code == 0, done.output
    task = load_task(out)
    assert np.allclose(task.trajectory.positions[[50, -1]], [[0.3, 0.1, 0.4], [0.7, 0, 0.25]], atol=1e-6)
    assert len(task.extra["covariance"]) == len(task.trajectory)
    assert "the via-point at 0.5 (0.3,0.1,0.4) lies outside what was shown" in done.output


def test_a_promp_that_misses_exits_with_6_and_marks_the_file(demos, tmp_path):
    ovita("learn", *demos, "--kind", "promp", "--out", tmp_path / "skill.json")
    out = tmp_path / "task.json"
    done = ovita("generate", tmp_path / "skill.json", "--goal", "0.9,0.3,0.2", "--out", out)
    assert done.exit_code == 6 and "not as meant: the goal is missed by" in done.output
    assert load_task(out).verdict.startswith("not_as_meant: the goal is missed")


def test_objects_that_moved_are_followed(tmp_path):
    for seed in range(4):
        save_task(tmp_path / f"{seed}.json", reaching(seed))
    save_task(tmp_path / "now.json", reaching(50))
    files = [tmp_path / f"{seed}.json" for seed in range(4)]
    done = ovita("learn", *files, "--frames", "cup, plate", "--out", tmp_path / "skill.json")
    assert "relative to cup, plate" in done.output
    done = ovita("generate", tmp_path / "skill.json", "--scene", tmp_path / "now.json", "--json")
    made = np.array(json.loads(done.stdout)["trajectory"])
    assert np.allclose(made[-1, :3], reaching(50).scene["plate"].position, atol=0.01)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--via", "middle: cup"), "'middle' is no phase; say it as '0.5: cup'"),
        (("--goal", "cup"), "'cup' is no place"),
        (("--out", "x.foo"), "says nothing about the format"),
    ],
)
def test_mistakes_are_said(words, said, demos, tmp_path):
    ovita("learn", *demos, "--out", tmp_path / "skill.json")
    with pytest.raises(OvitaError, match=said):
        CliRunner().invoke(cli, ["generate", str(tmp_path / "skill.json"), *words], catch_exceptions=False)


def test_what_is_generated_is_measured_against_the_limits_and_repaired_on_request(demos, tmp_path):
    box = {"name": "box", "x": 0.3, "y": 0.1, "z": 0.2, "dimensions": [0.1, 0.1, 0.1]}
    (tmp_path / "now.json").write_text(json.dumps({"objects": [box]}))
    ovita("learn", *demos, "--out", tmp_path / "skill.json")
    words = ("generate", tmp_path / "skill.json", "--scene", tmp_path / "now.json", "--goal", "0.3,0.1,0.2")
    inside = ovita(*words, "--out", tmp_path / "a.json")
    assert inside.exit_code == 5 and "too close to 'box'" in inside.output and "--repair" in inside.output
    assert load_task(tmp_path / "a.json").verdict.startswith("limited: ")
    moved = ovita(*words, "--repair", "--robot", "drone", "--out", tmp_path / "b.json")
    task = load_task(tmp_path / "b.json")
    assert moved.exit_code == 6 and "[0.3, 0.1, 0.2] is missed by" in moved.output
    assert task.scene["box"].clearance(task.trajectory.resample(500).positions).min() >= 0.08 - 1e-6
    assert ovita("generate", tmp_path / "skill.json", "--max-speed", "0.01").exit_code == 5


def test_the_frame_that_demonstrations_are_taken_to_be_in_is_said(demos, tmp_path):
    silent = ovita("learn", *demos, "--out", tmp_path / "skill.json")
    assert "taken to be in the frame rfu (+x right, +y front, +z up)" in silent.output
    assert "taken to be" not in ovita("learn", *demos, "--frame", "flu", "--out", tmp_path / "skill.json").output


def test_generate_takes_a_frame(tmp_path):
    for seed in range(4):
        save_task(tmp_path / f"{seed}.json", reaching(seed))
    ovita("learn", *(tmp_path / f"{seed}.json" for seed in range(4)), "--out", tmp_path / "skill.json")
    words = ["generate", tmp_path / "skill.json", "--goal", "0.3 m left of the plate", "--json"]
    ends = {
        frame: np.array(json.loads(ovita(*words, *chosen).stdout)["trajectory"])[-1, :2]
        for frame, chosen in {"": (), "rfu": ("--frame", "rfu"), "flu": ("--frame", "flu")}.items()
    }
    plate = reaching(0).scene["plate"].position[:2]
    assert np.allclose(ends[""], ends["rfu"])
    assert np.allclose(np.sign(np.round(ends["rfu"] - plate, 6)), (-1, 0))
    assert np.allclose(np.sign(np.round(ends["flu"] - plate, 6)), (0, 1))


def test_what_is_no_skill_and_what_no_object_is_said_in_a_sentence(demos, tmp_path):
    (tmp_path / "scene.json").write_text('{"objects": []}')
    told = str(ovita("generate", tmp_path / "scene.json").exception)
    assert "this is no skill: the schema is null, not 'ovita.skill/1'" in told
    told = str(ovita("learn", *demos, "--frames", "cup", "--out", tmp_path / "s.json").exception)
    assert "the scene has no object 'cup'; it holds no objects" in told
