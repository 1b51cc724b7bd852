"""`ovita simulate`, run as a user runs it."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from ovita import sim
from ovita.cli.main import main
from ovita.sim import render

pytest.importorskip("mujoco", reason="the extra sim is not installed")

DATA = Path(__file__).parents[3] / "shared" / "data" / "ovita-dev" / "robot_subset"
NO_GL = not (render.egl_works() or render.osmesa_works())


@pytest.fixture
def ovita(monkeypatch, capsys):
    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["ovita", *map(str, arguments)])
        try:
            main()
            code = 0
        except SystemExit as end:
            code = end.code
        said = capsys.readouterr()
        return code, said.out, said.err

    return run


@pytest.fixture
def scene(tmp_path):
    rows = np.column_stack([np.full(6, 0.5), np.linspace(-0.3, 0.3, 6), np.full(6, 0.4), np.full(6, 0.3)])
    path = tmp_path / "scene.json"
    cup = {"name": "cup", "x": 0.55, "y": 0.1, "z": 0.3, "dimensions": [0.1, 0.1, 0.1]}
    path.write_text(json.dumps({"trajectory": rows.tolist(), "objects": [cup], "instruction": "go higher by 0.1"}))
    return path


@pytest.fixture
def result(scene, tmp_path, ovita):
    out = tmp_path / "result.json"
    code, _, err = ovita("adapt", scene, "--writer", "builtin", "--out", out)
    assert code == 0, err
    return out


def test_both_trajectories_of_a_result_are_simulated_from_one_base(result, ovita):
    code, out, err = ovita("simulate", result, "--robot", "iiwa", "--json")
    assert code == 0, err
    reports = json.loads(out)
    assert list(reports) == ["original", "adapted"]
    assert reports["original"]["base"] == reports["adapted"]["base"]
    assert all(report["status"] == "followed" for report in reports.values())


def test_one_trajectory_of_a_result_or_a_scene_is_told_in_words(result, scene, ovita):
    code, out, _ = ovita("simulate", result, "--robot", "iiwa", "--which", "adapted", "--base", "0,0,0,0")
    assert code == 0 and "adapted: followed" in out and "original" not in out and "(as given)" in out
    code, out, _ = ovita("simulate", scene, "--robot", "crazyflie")
    assert code == 0 and "original: followed" in out and "Contact with cup" not in out


def test_a_bare_trajectory_is_simulated_among_the_objects_of_a_scene_file(scene, tmp_path, ovita):
    path = tmp_path / "path.csv"
    path.write_text("x,y,z,speed\n0.5,-0.1,0.4,0.4\n0.5,0.1,0.4,0.4\n")
    code, out, err = ovita("simulate", path, "--robot", "crazyflie", "--scene", scene, "--solid", "--json")
    report = json.loads(out)["original"]
    assert code == 0 and report["status"] == "followed" and report["base"]["z"] == 0.25, err
    code, _, err = ovita("simulate", path, "--robot", "crazyflie", "--topic", "/x", "--scene", tmp_path / "no.json")
    assert code == 2 and "no.json: there is no such file" in err


def test_a_result_has_a_scene_of_its_own(result, scene, ovita):
    code, _, err = ovita("simulate", result, "--robot", "iiwa", "--scene", scene)
    assert code == 2 and "is a result, which has its own scene; leave --scene out" in err


def test_a_robot_that_cannot_reach_a_waypoint_ends_with_exit_code_4(scene, ovita):
    code, out, _ = ovita("simulate", scene, "--robot", "iiwa", "--base", "-0.4,0.2,0,0")
    assert code == 4 and "original: unreachable" in out and "cannot be reached" in out


@pytest.mark.skipif(NO_GL, reason="neither EGL nor OSMesa works here (libegl1, libosmesa6)")
def test_a_video_is_made(scene, tmp_path, ovita, monkeypatch):
    from ovita.sim import video

    monkeypatch.setattr(video, "PANE", (128, 96))
    out = tmp_path / "v.mp4"
    code, said, err = ovita("simulate", scene, "--robot", "crazyflie", "--video", out)
    assert code == 0 and f"wrote {out}" in said and out.stat().st_size > 1000, err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--robot", "r2d2"], "unknown robot 'r2d2'; robots that can be simulated are arm, ground, drone"),
        ([], "does not say which robot it is for; choose one: --robot arm|ground|drone"),
        (["--robot", "iiwa", "--base", "9,9,0,0"], "no waypoint is within reach of the KUKA LBR iiwa 14"),
        (["--robot", "iiwa", "--base", "x"], "is not x,y,z,yaw"),
        (["--robot", "iiwa", "--base", "0,0,nan,0"], "is not finite"),
        (["--robot", "iiwa", "--video", "v.avi"], "videos are written as .mp4, .gif"),
        (["--robot", "iiwa", "--which", "adapted"], "is no result, so it has no adapted trajectory"),
        (["--robot", "none.toml"], "none.toml: there is no such file"),
    ],
)
def test_mistakes_are_one_sentence(scene, ovita, arguments, said):
    code, out, err = ovita("simulate", scene, *arguments)
    assert code == 2 and said in err and not out
    assert len(err.strip().splitlines()) == 1 and err.startswith("error: ")


@pytest.mark.parametrize(
    "content", ["{}", '{"instruction": "go left"}', '{"trajectory": [[0, 0, NaN, 1], [1, 1, 1, 1]]}']
)
def test_a_file_without_a_usable_trajectory_is_one_sentence(tmp_path, ovita, content):
    path = tmp_path / "bad.json"
    path.write_text(content)
    code, _, err = ovita("simulate", path, "--robot", "iiwa")
    assert code == 2 and "bad.json" in err and len(err.strip().splitlines()) == 1


def test_without_opengl_a_video_is_refused_in_one_sentence(scene, ovita, monkeypatch, tmp_path):
    monkeypatch.setenv("MUJOCO_GL", "disable")
    code, _, err = ovita("simulate", scene, "--robot", "crazyflie", "--video", tmp_path / "v.mp4")
    assert code == 2 and "libegl1" in err and "libosmesa6" in err and not (tmp_path / "v.mp4").exists()


@pytest.mark.skipif(not DATA.is_dir(), reason=f"the dataset is not at {DATA}; its licence keeps it out of here")
@pytest.mark.parametrize(
    ("folder", "robot", "tolerance"),
    [("Manipulator", "iiwa", 0.002), ("Ground_robot", "jackal", 0.05), ("Drone", "crazyflie", 0.05)],
)
def test_a_file_of_the_public_dataset_is_followed(folder, robot, tolerance):
    from ovita.io import load_task

    tasks = [load_task(path) for path in sorted((DATA / folder).glob("*.json"))]
    task = min(tasks, key=lambda task: task.trajectory.duration)
    report = sim.simulate(task.trajectory, task.scene, robot).report
    assert report.tracking.rms < tolerance and not report.unreachable
